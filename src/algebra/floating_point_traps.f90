!> Floating-point traps, which debug builds switch on, kept away from libraries that use infinities and NaNs
!> on purpose: LAPACK's DGEJSV scales by what may overflow and looks at the result.
module floating_point_traps
   use, intrinsic :: ieee_exceptions, only: ieee_all, ieee_get_halting_mode, ieee_set_flag, ieee_set_halting_mode
   implicit none (type, external)
   private
   public :: traps_t, suspend_traps, resume_traps

   !> Which exceptions halted before.
   type :: traps_t
      logical :: halting(size(ieee_all)) = .false.
   end type traps_t

contains

   !> No exception halts from here on.
   subroutine suspend_traps(traps)
      !> What was on, for `resume_traps`
      type(traps_t), intent(out) :: traps

      call ieee_get_halting_mode(ieee_all, traps%halting)
      if (any(traps%halting)) call ieee_set_halting_mode(ieee_all, .false.)
   end subroutine suspend_traps

   !> As it was before; what was raised in between is forgotten.
   subroutine resume_traps(traps)
      !> From `suspend_traps`
      type(traps_t), intent(in) :: traps

      call ieee_set_flag(ieee_all, .false.)
      if (any(traps%halting)) call ieee_set_halting_mode(ieee_all, traps%halting)
   end subroutine resume_traps

end module floating_point_traps
