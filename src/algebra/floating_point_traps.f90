!> Suspends floating-point traps, which debug builds enable, around libraries that use infinities and NaNs on purpose:
!> LAPACK's DGEJSV scales by numbers that may overflow, then tests the result.
module floating_point_traps
   use, intrinsic :: ieee_exceptions, only: ieee_all, ieee_get_halting_mode, ieee_set_flag, ieee_set_halting_mode
   implicit none (type, external)
   private
   public :: traps_t, suspend_traps, resume_traps

   !> The exceptions that halted the program before the suspension.
   type :: traps_t
      logical :: halting(size(ieee_all)) = .false.
   end type traps_t

contains

   !> Disable all traps.
   subroutine suspend_traps(traps)
      !> Traps that were enabled, for `resume_traps`
      type(traps_t), intent(out) :: traps

      call ieee_get_halting_mode(ieee_all, traps%halting)
      if (any(traps%halting)) call ieee_set_halting_mode(ieee_all, .false.)
   end subroutine suspend_traps

   !> Restore the traps; exceptions raised in between are cleared.
   subroutine resume_traps(traps)
      !> Traps from `suspend_traps`
      type(traps_t), intent(in) :: traps

      call ieee_set_flag(ieee_all, .false.)
      if (any(traps%halting)) call ieee_set_halting_mode(ieee_all, traps%halting)
   end subroutine resume_traps

end module floating_point_traps
