!> Numbers drawn at random, the same on every machine.
module drawn_numbers
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: draw

contains

   !> Numbers between 0 and 1: Park and Miller's generator, by Schrage's factors.
   subroutine draw(seed, u)
      !> The last number, 1 at first or any other
      integer, intent(inout) :: seed
      real(wp), intent(out) :: u(:)

      integer :: i

      do i = 1, size(u)
         seed = 16807*modulo(seed, 127773) - 2836*(seed/127773)
         if (seed <= 0) seed = seed + huge(seed)
         u(i) = real(seed, wp)/real(huge(seed), wp)
      end do
   end subroutine draw

end module drawn_numbers
