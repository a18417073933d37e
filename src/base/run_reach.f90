!> Progress of the single run of a scene: simulated time over duration, for a progress line.
module run_reach
   use, intrinsic :: iso_c_binding, only: c_double, c_loc, c_ptr
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: watch_reach, forget_reach, tell_reach, place_of_reach

   !> 0 to 1; a timer reads it at any moment
   real(c_double), volatile, target :: progress = 0.0_c_double
   !> True during a single run in one thread; sweeps report their cases instead
   logical :: is_enabled = .false.

contains

   !> Enable reports of progress.
   subroutine watch_reach()
      progress = 0.0_c_double
      is_enabled = .true.
   end subroutine watch_reach

   !> Disable reports of progress.
   subroutine forget_reach()
      is_enabled = .false.
      progress = 0.0_c_double
   end subroutine forget_reach

   !> Report the progress of the run, if reports are enabled.
   subroutine tell_reach(time, duration)
      real(wp), intent(in) :: time
      real(wp), intent(in) :: duration

      if (is_enabled) progress = real(time/duration, c_double)
   end subroutine tell_reach

   !> Address of the progress, for code that is not written in Fortran.
   function place_of_reach() result(address)
      type(c_ptr) :: address

      address = c_loc(progress)
   end function place_of_reach

end module run_reach
