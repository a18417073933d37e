!> Integrals of displacements and contact forces, and of their squares, over parts of a phase that a path covers. A
!> phase is the motion between two events (docs/theory.md, section 20).
module phase_integrals
   use kinds, only: wp
   use motion_intervals, only: output_row_t
   use phase_rows, only: is_integrable, signal_of_row
   use phase_state, only: phase_state_t
   use row_integrals, only: find_row_interval_terms, integrate_rows, make_row_form
   use row_signals, only: row_signal_t
   implicit none (type, external)
   private
   public :: integrate_on_path, integrate_rates_on_path

contains

   !> Integrals of signals, and of their squares, over a part of a phase.
   subroutine integrate_on_path(self, from, length, signals, first, second, has_digits)
      type(phase_state_t), intent(inout) :: self
      !> Start of the part, since the start of the phase
      real(wp), intent(in) :: from
      !> Length of the part
      real(wp), intent(in) :: length
      type(row_signal_t), intent(in) :: signals(:)
      !> Integral of each signal, [signals]
      real(wp), intent(out) :: first(:)
      !> Integral of the square of each signal, [signals]; absent: not requested
      real(wp), intent(out), optional :: second(:)
      !> Receives false if the squares lose their digits, as in `integrate_rows`
      logical, intent(inout), optional :: has_digits

      associate (set => self%set)
         if (.not. allocated(set%shared%form)) then
            allocate (set%shared%form)
            call make_row_form(set%shared%basis, set%shared%form)
         end if
         call find_row_interval_terms(set%shared%basis, set%shared%form, self%path%z(:, :, 0), from, length, self%span)
         call integrate_rows(set%shared%basis, set%shared%form, self%span, signals, first, second, &
            has_digits)
      end associate
   end subroutine integrate_on_path

   !> Integrals of the squared indentation rates of closed compliant contacts, from the start of a phase.
   subroutine integrate_rates_on_path(self, length, has_integrals, second)
      type(phase_state_t), intent(inout) :: self
      !> End of the integrals, since the start of the phase
      real(wp), intent(in) :: length
      !> Whether they follow from the terms of rows
      logical, intent(out) :: has_integrals
      !> Integrals of the squared indentation rates, [compliant contacts of the set]
      real(wp), intent(out) :: second(:)

      type(row_signal_t) :: signals(size(second))
      real(wp) :: first(size(second))
      integer :: j

      has_integrals = size(second) > 0
      do j = 1, size(second)
         associate (k => self%set%compliant(j))
            has_integrals = is_integrable(self, output_row_t(k))
            if (.not. has_integrals) return
            ! the rate of a gap has its slope as a constant
            signals(j) = signal_of_row(self, output_row_t(k))
            signals(j) = row_signal_t(row=signals(j)%row, factor=0.0_wp, rate_factor=signals(j)%factor, &
               offset=signals(j)%slope)
         end associate
      end do
      if (has_integrals) call integrate_on_path(self, 0.0_wp, length, signals, first, second)
   end subroutine integrate_rates_on_path

end module phase_integrals
