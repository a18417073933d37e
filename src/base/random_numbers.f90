!> Random numbers that are the same on every machine for the same seed: two congruential generators combined
!> (L'Ecuyer, Commun. ACM 31 (1988) 742).
module random_numbers
   use kinds, only: i8, pi, wp
   implicit none (type, external)
   private
   public :: random_t, start_random, next_random, next_normal, shuffle

   !> State of a generator.
   type :: random_t
      private
      !> State of the first congruential generator
      integer(i8) :: first = 1_i8
      !> State of the second congruential generator
      integer(i8) :: second = 1_i8
   end type random_t

   !> Modulus of the first generator.
   integer(i8), parameter :: first_modulus = 2147483563_i8
   !> Modulus of the second generator.
   integer(i8), parameter :: second_modulus = 2147483399_i8

contains

   !> Begin a sequence.
   pure subroutine start_random(seed, stream, random)
      !> Seed, > 0
      integer, intent(in) :: seed
      !> Number of the sequence, >= 0; each seed has many sequences
      integer, intent(in) :: stream
      type(random_t), intent(out) :: random

      real(wp) :: discarded
      integer :: i

      random%first = modulo(int(seed, i8), first_modulus - 1_i8) + 1_i8
      ! 104729 is a prime, which gives each sequence of a seed another state
      random%second = modulo(int(stream, i8)*104729_i8 + int(seed, i8), second_modulus - 1_i8) + 1_i8
      ! the first numbers are discarded, because those of neighbouring seeds are similar
      do i = 1, 32
         call next_random(random, discarded)
      end do
   end subroutine start_random

   !> Draw a uniformly distributed number between 0 and 1, both excluded.
   pure subroutine next_random(random, value)
      type(random_t), intent(inout) :: random
      !> The random number
      real(wp), intent(out) :: value

      integer(i8) :: mixed

      random%first = modulo(40014_i8*random%first, first_modulus)
      random%second = modulo(40692_i8*random%second, second_modulus)
      mixed = modulo(random%first - random%second, first_modulus - 1_i8)
      if (mixed == 0_i8) mixed = first_modulus - 1_i8
      value = real(mixed, wp)/real(first_modulus, wp)
   end subroutine next_random

   !> Draw a normally distributed number (Box and Muller).
   pure subroutine next_normal(random, value)
      type(random_t), intent(inout) :: random
      !> The random number
      real(wp), intent(out) :: value

      real(wp) :: first, second

      call next_random(random, first)
      call next_random(random, second)
      value = sqrt(-2.0_wp*log(first))*cos(2.0_wp*pi*second)
   end subroutine next_normal

   !> Put the numbers 1 ... n into random order (Fisher and Yates).
   pure subroutine shuffle(random, order)
      type(random_t), intent(inout) :: random
      !> The numbers, [n]
      integer, intent(out) :: order(:)

      real(wp) :: value
      integer :: i, other, swapped

      order = [(i, i=1, size(order))]
      do i = size(order), 2, -1
         call next_random(random, value)
         other = min(1 + int(value*real(i, wp)), i)
         swapped = order(i)
         order(i) = order(other)
         order(other) = swapped
      end do
   end subroutine shuffle

end module random_numbers
