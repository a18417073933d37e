!> Progress of a single run: simulated time over duration, for the progress line of a terminal.
module run_progress
   use, intrinsic :: iso_c_binding, only: c_double, c_loc, c_ptr
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: enable_progress, disable_progress, report_progress, progress_address

   !> Fraction of the run that is done, 0 to 1; volatile, because the timer signal of the progress line interrupts the
   !> computation at any moment and reads this variable
   real(c_double), volatile, target :: progress = 0.0_c_double
   !> True during a single run in one thread; a sweep reports its finished cases instead
   logical :: is_enabled = .false.

contains

   !> Enable reports of progress.
   subroutine enable_progress()
      progress = 0.0_c_double
      is_enabled = .true.
   end subroutine enable_progress

   !> Disable reports of progress, and set the progress to 0, so that a later progress line does not show that of the
   !> finished run.
   subroutine disable_progress()
      is_enabled = .false.
      progress = 0.0_c_double
   end subroutine disable_progress

   !> Report the progress of the run, if reports are enabled.
   subroutine report_progress(time, duration)
      !> Simulated time reached, in any unit
      real(wp), intent(in) :: time
      !> Length of the run, in the same unit
      real(wp), intent(in) :: duration

      if (is_enabled) progress = real(time/duration, c_double)
   end subroutine report_progress

   !> Address of the progress, for code that is not written in Fortran.
   type(c_ptr) function progress_address() result(address)

      address = c_loc(progress)
   end function progress_address

end module run_progress
