!> Displacements and contact forces as sums of exponentials, for the integrals of these signals and of their squares
!> over parts of a phase, the motion between two events (docs/theory.md, section 20).
module phase_integrals
   use driven_modes, only: driven_mode_t, make_driven_mode
   use driven_signal, only: driven_terms_t
   use kinds, only: wp
   use mode_terms, only: find_mode_terms, mode_terms_t, slow_exponents, slow_points
   use moment_signals, only: find_load_terms, moment_row_t
   use motion_intervals, only: output_row_t
   use phase_rows, only: is_on_path, signal_of_row
   use phase_state, only: force_terms, phase_state_t
   use row_integrals, only: find_row_interval_terms, integrate_rows, make_row_form
   use row_signals, only: row_signal_t
   use signal_integrals, only: signals_t
   implicit none (type, external)
   private
   public :: find_signals, integrate_on_path, integrate_rates_on_path

contains

   !> Find the signals in this order: displacements s y at some contacts (s = 1 for a contact below the beam, -1 above),
   !> displacement of the tip, forces of some closed contacts, bending moments and displacements of bodies.
   subroutine find_signals(self, length, places, closed, signals, moments, order)
      type(phase_state_t), intent(in) :: self
      !> Length of the phase
      real(wp), intent(in) :: length
      !> Indices of the contacts whose displacements are signals
      integer, intent(in) :: places(:)
      !> Indices of the closed contacts whose forces are signals
      integer, intent(in) :: closed(:)
      type(signals_t), intent(out) :: signals
      !> Moments and displacements of bodies that are signals; absent: none
      type(moment_row_t), intent(in), optional :: moments(:)
      !> Order of the time derivative of the signals: 0 (default), or 2 for displacements alone
      integer, intent(in), optional :: order

      type(moment_row_t), allocatable :: bending(:)
      ! terms of uncoupled modes: one less than the first, and the last
      integer :: modes(2)
      ! number of displacements at contacts, and index of a term
      integer :: n
      ! number of all signals
      integer :: rows

      n = size(places)
      if (present(moments)) then
         allocate (bending, source=moments)
      else
         allocate (bending(0))
      end if
      rows = n + 1 + size(closed) + size(bending)
      allocate (signals%offset(rows), signals%slope(rows), source=0.0_wp)
      allocate (signals%exponent(0), signals%amplitude(rows, 0))
      signals%offset(:n) = self%set%constrained%static_gap(places) + self%beam%observed_height(places)
      signals%offset(n + 1) = self%set%constrained%static_tip
      if (size(self%set%compliant) > 0) then
         call add_terms(self, places, closed, bending, signals)
         modes(1) = size(signals%exponent)
         call add_mode_terms(self, length, self%set%coupled%inactive, places, closed, bending, signals, order)
      else
         modes(1) = 0
         call add_mode_terms(self, length, [(n, n=1, self%set%constrained%count)], places, closed, bending, signals, &
            order)
      end if
      modes(2) = size(signals%exponent)
      if (self%loads%count > 0) call add_load_response(self, places, closed, bending, signals)
      if (.not. present(order)) return
      ! the second derivatives of constants and slopes are zero, and `add_mode_terms` has differentiated the terms of
      ! its modes
      signals%offset = 0.0_wp
      signals%slope = 0.0_wp
      do n = 1, size(signals%exponent)
         if (n > modes(1) .and. n <= modes(2)) cycle
         signals%amplitude(:, n) = signals%exponent(n)**order*signals%amplitude(:, n)
      end do
   end subroutine find_signals

   !> Add the exponential terms of the motion with compliant contacts; the arguments are those of `find_signals`.
   subroutine add_terms(self, places, closed, bending, signals)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: places(:)
      integer, intent(in) :: closed(:)
      type(moment_row_t), intent(in) :: bending(:)
      type(signals_t), intent(inout) :: signals

      complex(wp), allocatable :: amplitude(:)
      integer :: m, n, p

      n = size(places)
      associate (set => self%set)
         signals%exponent = set%coupled%exponent
         deallocate (signals%amplitude)
         allocate (signals%amplitude(size(signals%offset), size(signals%exponent)))
         signals%offset(:n) = set%rest_gap(places) + self%beam%observed_height(places)
         do m = 1, size(signals%exponent)
            signals%amplitude(:n, m) = set%gap(places, m)*self%amplitude(m)
         end do
         call force_terms(self, 0, self%amplitude, signals%offset(n + 1), amplitude)
         signals%amplitude(n + 1, :) = amplitude
         do m = 1, size(closed)
            call force_terms(self, closed(m), self%amplitude, signals%offset(n + 1 + m), amplitude)
            signals%amplitude(n + 1 + m, :) = amplitude
         end do
         n = n + 1 + size(closed)
         do p = 1, size(bending)
            associate (row => bending(p), coupled => set%coupled)
               signals%offset(n + p) = sum(row%weight*set%rest_modes) + sum(row%force_moment*set%rest_force)
               do m = 1, coupled%count
                  signals%amplitude(n + p, m) = self%amplitude(m)*(merge(coupled%viscous(m), (1.0_wp, 0.0_wp), &
                     row%is_viscous)*sum(row%weight*coupled%shape(:, m)) + sum(row%force_moment*coupled%force(:, m)))
               end do
            end associate
         end do
      end associate
   end subroutine add_terms

   !> Add the free vibrations of uncoupled modes, and the responses of these modes to loads that drive them from rest.
   !> The other arguments are those of `find_signals`.
   subroutine add_mode_terms(self, length, modes, places, closed, bending, signals, order)
      type(phase_state_t), intent(in) :: self
      real(wp), intent(in) :: length
      !> Indices of the uncoupled modes
      integer, intent(in) :: modes(:)
      integer, intent(in) :: places(:)
      integer, intent(in) :: closed(:)
      type(moment_row_t), intent(in) :: bending(:)
      type(signals_t), intent(inout) :: signals
      integer, intent(in), optional :: order

      type(driven_mode_t), allocatable :: driven(:)
      type(mode_terms_t) :: terms(size(modes))
      ! displacement and velocity of a mode at the start of the phase, or their second derivatives
      real(wp) :: start(2)
      complex(wp), allocatable :: amplitude(:, :), exponent(:)
      ! signals per unit of the displacement of a mode, and per unit of displacement + 2 zeta velocity
      real(wp) :: weight_of_signal(size(signals%offset), 2)
      ! index of each contact in `constrained%closed`; 0: a compliant contact, at which the modes have nodes
      integer :: of_constrained(size(closed))
      ! number of signals before the moments
      integer :: forces
      ! number of terms so far
      integer :: last
      ! number of exponents around 0 that all slow modes have in common
      integer :: shared
      integer :: j, n, p

      n = size(places)
      forces = n + 1 + size(closed)
      signals%offset(forces + 1:) = signals%offset(forces + 1:) + bending%static
      if (size(modes) == 0) return
      do j = 1, size(modes)
         start = [self%z(modes(j)), self%v(modes(j))]
         driven = forced_motions_of(self, modes(j))
         if (present(order)) call derive_twice(make_driven_mode(self%set%constrained%oscillators, modes(j)), start, &
            driven)
         call find_mode_terms(self%set%constrained%oscillators, modes(j), start, driven, length, terms(j))
      end do
      last = size(signals%exponent)
      shared = 0
      if (any([(any(abs(terms(j)%slow) > 0.0_wp), j=1, size(modes))])) shared = slow_points
      allocate (exponent, source=[signals%exponent, slow_exponents(length, shared), &
         (terms(j)%exponent, j=1, size(modes))])
      allocate (amplitude(size(signals%offset), size(exponent)), source=(0.0_wp, 0.0_wp))
      amplitude(:, :last) = signals%amplitude
      associate (constrained => self%set%constrained, slow => amplitude(:, last + 1:last + shared))
         of_constrained = [(findloc(constrained%closed, closed(j), dim=1), j=1, size(closed))]
         last = last + shared
         weight_of_signal = 0.0_wp
         do j = 1, size(modes)
            weight_of_signal(:n, 1) = constrained%value(modes(j), places)
            weight_of_signal(n + 1, 1) = constrained%tip_value(modes(j))
            do p = 1, size(closed)
               if (of_constrained(p) > 0) weight_of_signal(n + 1 + p, 2) = &
                  constrained%reaction(of_constrained(p), modes(j))
            end do
            do p = 1, size(bending)
               weight_of_signal(forces + p, merge(2, 1, bending(p)%is_viscous)) = bending(p)%weight(modes(j))
            end do
            signals%offset = signals%offset + matmul(weight_of_signal, terms(j)%offset)
            signals%slope = signals%slope + matmul(weight_of_signal, terms(j)%slope)
            slow = slow + matmul(weight_of_signal, terms(j)%slow(:, :shared))
            associate (added => size(terms(j)%exponent))
               amplitude(:, last + 1:last + added) = matmul(weight_of_signal, terms(j)%amplitude)
               last = last + added
            end associate
         end do
         if (size(self%set%compliant) == 0) signals%offset(n + 2:forces) = signals%offset(n + 2:forces) &
            + constrained%static_force(of_constrained)
      end associate
      call move_alloc(exponent, signals%exponent)
      call move_alloc(amplitude, signals%amplitude)
   end subroutine add_mode_terms

   !> Replace a mode by its acceleration. The acceleration obeys the equation of motion of the mode, with the second
   !> derivatives of the loads. The terms of the motion are not differentiated: in a short phase their exponents are
   !> points of a circle with a large radius, whose square would amplify rounding errors.
   pure subroutine derive_twice(mode, start, driven)
      !> The mode, with its coefficients
      type(driven_mode_t), intent(in) :: mode
      !> On entry displacement and velocity at the start, without loads; on return their second derivatives, with loads
      real(wp), intent(inout) :: start(2)
      !> Motions driven from rest by loads
      type(driven_mode_t), intent(inout) :: driven(:)

      ! second derivatives of displacement and velocity
      real(wp) :: acceleration, jerk

      associate (force => driven%force, frequency => driven%frequency)
         acceleration = sum(real(force, wp), mask=.not. driven%is_ramp) - mode%square*start(1) - mode%damping*start(2)
         jerk = sum(merge(real(force, wp), -frequency*aimag(force), driven%is_ramp)) - mode%square*start(2) &
            - mode%damping*acceleration
         start = [acceleration, jerk]
         ! the second derivatives of constants and ramps are zero
         driven%force = -frequency**2*force
      end associate
   end subroutine derive_twice

   !> Responses of one mode to loads that drive it from rest.
   pure function forced_motions_of(self, mode) result(driven_motions)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: mode
      type(driven_mode_t), allocatable :: driven_motions(:)

      integer :: k

      allocate (driven_motions(0))
      if (self%loads%count == 0) return
      associate (driven => self%set%forced%driven, forced => self%forced)
         driven_motions = pack(forced%mode, [(driven(forced%pair(k))%mode == mode, k=1, size(forced%pair))])
      end associate
   end function forced_motions_of

   !> Add the load response without the modes that are driven from rest; the arguments are those of `find_signals`.
   subroutine add_load_response(self, places, closed, bending, signals)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: places(:)
      integer, intent(in) :: closed(:)
      type(moment_row_t), intent(in) :: bending(:)
      type(signals_t), intent(inout) :: signals

      complex(wp), allocatable :: amplitude(:, :)
      type(driven_terms_t) :: of_moment
      integer :: rows(size(signals%offset) - size(bending)), n, p, terms

      associate (at => self%set%forced%at, forced => self%forced)
         rows = [at%gaps + places, at%tip + 1, at%forces + closed]
         n = size(rows)
         terms = size(signals%exponent)
         signals%offset(:n) = signals%offset(:n) + forced%constant(rows)
         signals%slope(:n) = signals%slope(:n) + forced%slope(rows)
         allocate (amplitude(size(signals%offset), terms + size(forced%frequency)))
         amplitude(:, :terms) = signals%amplitude
         amplitude(:n, terms + 1:) = forced%harmonic(rows, :)
         do p = 1, size(bending)
            call find_load_terms(self, bending(p), of_moment)
            signals%offset(n + p) = signals%offset(n + p) + of_moment%constant
            signals%slope(n + p) = signals%slope(n + p) + of_moment%slope
            amplitude(n + p, terms + 1:) = of_moment%harmonic
         end do
         signals%exponent = [signals%exponent, cmplx(0.0_wp, forced%frequency, wp)]
      end associate
      call move_alloc(amplitude, signals%amplitude)
   end subroutine add_load_response

   !> Integrals of signals without slope, and of their squares, over a part of a phase that the path covers.
   subroutine integrate_on_path(self, from, length, signals, first, second)
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

      associate (set => self%set)
         if (.not. allocated(set%shared%form)) then
            allocate (set%shared%form)
            call make_row_form(set%shared%basis, set%shared%form)
         end if
         call find_row_interval_terms(set%shared%basis, set%shared%form, self%path%z(:, :, 0), from, length, self%span)
         call integrate_rows(set%shared%basis, set%shared%form, self%span, signals, first, second)
      end associate
   end subroutine integrate_on_path

   !> Integrals of the squared indentation rates of closed compliant contacts, from the start of a phase.
   subroutine integrate_rates_on_path(self, length, has_integrals, second)
      type(phase_state_t), intent(inout) :: self
      !> End of the integrals, since the start of the phase
      real(wp), intent(in) :: length
      !> Whether the path covers the integrals
      logical, intent(out) :: has_integrals
      !> Integrals of the squared indentation rates, [compliant contacts of the set]
      real(wp), intent(out) :: second(:)

      type(row_signal_t) :: signals(size(second))
      real(wp) :: first(size(second))
      integer :: j

      has_integrals = size(second) > 0
      do j = 1, size(second)
         associate (k => self%set%compliant(j))
            has_integrals = is_on_path(self, length, output_row_t(k))
            if (has_integrals) signals(j) = signal_of_row(self, output_row_t(k))
            if (has_integrals) has_integrals = .not. abs(signals(j)%slope) > 0.0_wp
            if (.not. has_integrals) return
            signals(j) = row_signal_t(row=signals(j)%row, factor=0.0_wp, rate_factor=1.0_wp)
         end associate
      end do
      if (has_integrals) call integrate_on_path(self, 0.0_wp, length, signals, first, second)
   end subroutine integrate_rates_on_path

end module phase_integrals
