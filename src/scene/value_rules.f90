!> What a value may be, tested and in words.
module value_rules
   use kinds, only: wp
   use number_text, only: to_text
   implicit none (type, external)
   private
   public :: range_t, within, above, contains_value, range_text, one_of

   !> Numbers from `least`, which itself may be left out, to `most`.
   type :: range_t
      real(wp) :: least
      real(wp) :: most
      logical :: excludes_least = .false.
   end type range_t

   !> `within(least, most)`: both ends are allowed.
   interface within
      module procedure within_reals, within_integers
   end interface within

contains

   elemental function within_reals(least, most) result(range)
      !> Smallest number
      real(wp), intent(in) :: least
      !> Largest number
      real(wp), intent(in) :: most
      type(range_t) :: range

      range = range_t(least, most, excludes_least=.false.)
   end function within_reals

   elemental function within_integers(least, most) result(range)
      !> Smallest number
      integer, intent(in) :: least
      !> Largest number
      integer, intent(in) :: most
      type(range_t) :: range

      range = range_t(real(least, wp), real(most, wp), excludes_least=.false.)
   end function within_integers

   !> Larger than `limit`, up to `most`.
   elemental function above(limit, most) result(range)
      !> What every number must exceed
      real(wp), intent(in) :: limit
      !> Largest number
      real(wp), intent(in) :: most
      type(range_t) :: range

      range = range_t(limit, most, excludes_least=.true.)
   end function above

   !> Is the number in the range?
   elemental function contains_value(range, value) result(contains)
      !> The range
      type(range_t), intent(in) :: range
      !> The number, finite
      real(wp), intent(in) :: value
      logical :: contains

      contains = value >= range%least .and. value <= range%most
      if (range%excludes_least) contains = contains .and. value > range%least
   end function contains_value

   !> Such as 'from 0 to 1' and 'above 0, up to 1'.
   pure function range_text(range) result(text)
      !> The range
      type(range_t), intent(in) :: range
      character(:), allocatable :: text

      if (range%excludes_least) then
         text = 'above '//to_text(range%least)//', up to '//to_text(range%most)
      else
         text = 'from '//to_text(range%least)//' to '//to_text(range%most)
      end if
   end function range_text

   !> Such as 'exact' or 'newmark'.
   pure function one_of(words) result(text)
      !> What may be chosen
      character(*), intent(in) :: words(:)
      character(:), allocatable :: text

      integer :: i

      text = ''
      do i = 1, size(words)
         if (i > 1) text = text//trim(merge(' or', ',  ', i == size(words)))//' '
         text = text//''''//trim(words(i))//''''
      end do
   end function one_of

end module value_rules
