!> A linear combination of damped oscillators z_i(t) as a signal with guaranteed bounds, if no compliant contact is
!> closed: a gap, the reaction of a closed rigid contact, or a bending moment.
!>
!> Every derivative z_i^(k) obeys the same oscillator equation, so one set of bounds serves all of them: envelopes, with
!> factors that the state at the start determines (`oscillator_terms`).
module modal_signal
   use certified_search, only: bound_curvature, bound_jerk, bound_value, falls_to_zero, first_zero, found_none, &
      found_zero, bounds_t, search_t, term_columns, term_curvature, term_rate, term_value, search_history_t, &
      transformable_signal_t
   use damped_oscillators, only: acceleration, lanes, oscillators_t, padded, propagate_lanes
   use kinds, only: wp
   use oscillator_terms, only: basis_columns, factor_columns, find_basis, find_factors, find_terms, find_values, &
      weighted_sum
   use short_flights, only: find_short_flight
   use summed_signal, only: add_to_bounds
   use zero_free_steps, only: zero_free_step
   implicit none (type, external)
   private
   public :: modal_signal_t, modal_state_t, make_modal_signal, set_reaction_state, set_state

   !> Modal state at an instant.
   type :: modal_state_t
      !> Instant; negative: there is none
      real(wp) :: time = -1.0_wp
      !> Displacements of the modes, [count]
      real(wp), allocatable :: z(:)
      !> Velocities of the modes, [count]
      real(wp), allocatable :: v(:)
   end type modal_state_t

   !> offset + sum c_i z_i(t) + relaxation exp(-rate t). The last term is the remaining deformation of an unloaded
   !> compliant stop or of a node without mass. Weights and states are padded with zeros to whole SIMD vectors.
   type, extends(transformable_signal_t) :: modal_signal_t
      type(oscillators_t), pointer :: oscillators => null()
      !> Value of the signal without motion
      real(wp) :: offset = 0.0_wp
      !> c_i, [padded]
      real(wp), allocatable :: weight(:)
      !> z_i at t = 0, [padded]
      real(wp), allocatable :: z(:)
      !> z_i' at t = 0, [padded]
      real(wp), allocatable :: v(:)
      !> Whether the signal is a force: modes far beyond critical damping then enter the sum by z_i + 2 zeta z_i'
      !> instead of z_i (the state of all other modes has been replaced by `set_reaction_state`)
      logical :: is_viscous = .false.
      !> Relaxing deformation at t = 0
      real(wp) :: relaxation = 0.0_wp
      !> Decay rate of the relaxing deformation
      real(wp) :: rate = 0.0_wp
      !> Receives the state at the last instant of `evaluate`, in arrays that are already allocated; null: not requested
      type(modal_state_t), pointer :: last => null()
      !> Factors from `find_factors` for the present state, of the signal and of its first derivative if it was
      !> prepared, [padded, factor_columns, 0:1]
      real(wp), allocatable :: factors(:, :, :)
      !> Maximum order of the derivatives for which `factors` are valid; negative: for none
      integer :: prepared_order = -1
      !> Value of `start_order` for which `factors` are valid
      integer :: prepared_start = 0
   contains
      procedure :: prepare
      procedure :: find_bounds
      procedure :: evaluate
      procedure :: transform
      procedure :: find_zero
      procedure :: find_end_of_short_flight
   end type modal_signal_t

contains

   !> Prepare a signal; the caller sets the first `count` elements of its state `z`, `v`.
   subroutine make_modal_signal(oscillators, offset, weight, signal)
      !> The oscillators; they must outlive the signal
      type(oscillators_t), target, intent(in) :: oscillators
      !> Constant term
      real(wp), intent(in) :: offset
      !> c_i, [count]
      real(wp), intent(in) :: weight(:)
      type(modal_signal_t), intent(out) :: signal

      signal%oscillators => oscillators
      signal%offset = offset
      allocate (signal%weight(padded(size(weight))), signal%z(padded(size(weight))), signal%v(padded(size(weight))), &
         source=0.0_wp)
      signal%weight(:size(weight)) = weight
   end subroutine make_modal_signal

   !> Set the state of a signal at t = 0.
   subroutine set_state(z, v, signal)
      !> Displacements of the modes, [count]
      real(wp), intent(in) :: z(:)
      !> Velocities of the modes, [count]
      real(wp), intent(in) :: v(:)
      type(modal_signal_t), intent(inout) :: signal

      signal%z(:size(z)) = z
      signal%v(:size(v)) = v
      signal%prepared_order = -1
   end subroutine set_state

   !> Prepare the factors that evaluations have in common. Without them, each evaluation finds its own.
   subroutine prepare(self, max_order)
      class(modal_signal_t), intent(inout) :: self
      !> Maximum order of the derivatives to be evaluated; 0: the signal alone, 1: its first derivative, too
      integer, intent(in) :: max_order

      integer :: order

      if (.not. allocated(self%factors)) allocate (self%factors(size(self%weight), factor_columns, 0:1))
      do order = 0, max_order
         call find_factors(self%oscillators, size(self%weight), order, self%weight, min_amplitude(self), &
            self%is_viscous, self%z, self%v, self%factors(:, :, order))
      end do
      self%prepared_order = max_order
      self%prepared_start = self%start_order
   end subroutine prepare

   !> Whether the factors of a derivative are prepared.
   pure logical function is_prepared(self, order)
      class(modal_signal_t), intent(in) :: self
      !> Order of the derivative; 0: the signal itself
      integer, intent(in) :: order

      is_prepared = order <= self%prepared_order .and. self%prepared_start == self%start_order
   end function is_prepared

   !> The factors of the terms of a derivative of the signal.
   pure subroutine factors_of(self, order, factors)
      class(modal_signal_t), intent(in) :: self
      !> Order of the derivative; 0: the signal itself
      integer, intent(in) :: order
      !> Columns as in `oscillator_terms`, [padded, factor_columns]
      real(wp), contiguous, intent(out) :: factors(:, :)

      call find_factors(self%oscillators, size(self%weight), order, self%weight, min_amplitude(self), self%is_viscous, &
         self%z, self%v, factors)
   end subroutine factors_of

   !> Set the state of a reaction signal, a sum over p + 2 zeta p' of each mode p (' = d/dtau). This quantity obeys the
   !> equation of p, so it is the state of the first `unseparated` modes. Modes far beyond critical damping have the
   !> state p, p'; the signal forms p + 2 zeta p' from their two exponentials (`is_viscous`), without cancellation.
   subroutine set_reaction_state(z, v, reaction)
      !> Displacements of the constrained modes without the load response (homogeneous part), [modes]
      real(wp), intent(in) :: z(:)
      !> Velocities of the constrained modes without the load response (homogeneous part), [modes]
      real(wp), intent(in) :: v(:)
      type(modal_signal_t), intent(inout) :: reaction

      integer :: i

      associate (oscillators => reaction%oscillators, two_zeta => reaction%oscillators%two_zeta)
         !$omp simd
         do i = 1, oscillators%unseparated
            reaction%z(i) = z(i) + two_zeta*v(i)
            reaction%v(i) = v(i) - two_zeta*(oscillators%square(i)*reaction%z(i) + oscillators%mass_rate(i)*v(i))
         end do
         reaction%z(oscillators%unseparated + 1:size(z)) = z(oscillators%unseparated + 1:)
         reaction%v(oscillators%unseparated + 1:size(z)) = v(oscillators%unseparated + 1:)
         reaction%prepared_order = -1
      end associate
   end subroutine set_reaction_state

   !> The signal and its slope at an instant.
   subroutine evaluate(self, t, value, slope)
      class(modal_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Value of the signal
      real(wp), intent(out) :: value
      !> Slope of the signal
      real(wp), intent(out) :: slope

      real(wp), dimension(size(self%weight)) :: z, v, decayed
      real(wp) :: basis(size(self%weight), basis_columns)
      real(wp) :: magnitude, relaxation

      associate (oscillators => self%oscillators, n => self%oscillators%count)
         if (self%is_viscous) then
            call find_basis(oscillators, size(z), t, basis)
            call sum_values(self, basis, t, value, slope, magnitude)
         else
            call propagate_lanes(oscillators, n, t, self%z, self%v, z, v, decayed)
            if (associated(self%last)) then
               self%last%time = t
               self%last%z(:) = z(:n)
               self%last%v(:) = v(:n)
            end if
            value = weighted_sum(size(z)/lanes, self%weight, z)
            slope = weighted_sum(size(z)/lanes, self%weight, v)
         end if
      end associate
      value = self%offset + value
      if (abs(self%relaxation) > 0.0_wp) then
         relaxation = self%relaxation*exp(-self%rate*t)
         value = value + relaxation
         slope = slope - self%rate*relaxation
      end if
   end subroutine evaluate

   !> The signal offset + factor d(from + t), with d the derivative of the given order of this signal.
   subroutine transform(self, from, factor, offset, order, transformed)
      class(modal_signal_t), intent(in) :: self
      !> Instant that becomes t = 0
      real(wp), intent(in) :: from
      !> Factor of the transformed signal
      real(wp), intent(in) :: factor
      !> Constant that is added to the signal
      real(wp), intent(in) :: offset
      !> 0: d is the signal itself, 1: d is its slope
      integer, intent(in) :: order
      !> The new signal
      class(transformable_signal_t), allocatable, intent(out) :: transformed

      type(modal_signal_t), allocatable :: modal
      real(wp), dimension(size(self%weight)) :: factors
      real(wp), dimension(self%oscillators%count) :: rate
      real(wp) :: constant

      constant = offset
      if (order == 0) constant = offset + factor*self%offset
      allocate (modal)
      associate (oscillators => self%oscillators, n => self%oscillators%count)
         call make_modal_signal(oscillators, constant, factor*self%weight(:n), modal)
         modal%is_viscous = self%is_viscous
         call propagate_lanes(oscillators, n, max(from, 0.0_wp), self%z, self%v, modal%z, modal%v, factors)
         modal%rate = self%rate
         modal%relaxation = factor*self%relaxation*exp(-self%rate*from)
         if (order == 1) then
            rate = modal%v(:n)
            modal%v(:n) = acceleration(oscillators, modal%z(:n), rate)
            modal%z(:n) = rate
            modal%relaxation = -self%rate*modal%relaxation
         end if
      end associate
      call move_alloc(modal, transformed)
   end subroutine transform

   !> First zero of the signal in (0, limit]. The end of a short flight comes from a Taylor series.
   subroutine find_zero(self, limit, search, history)
      class(modal_signal_t), intent(in) :: self
      !> End of the search
      real(wp), intent(in) :: limit
      !> Outcome
      type(search_t), intent(out) :: search
      !> Evaluations of the search; none if the Taylor series was enough
      type(search_history_t), intent(inout), optional :: history

      if (present(history)) history%count = 0
      if (self%start_order == 1) then
         call self%find_end_of_short_flight(limit, search)
         if (search%outcome == found_zero) return
      end if
      call first_zero(self, limit, search, history)
      if (associated(self%last) .and. search%outcome == found_zero) call shift_state(self%oscillators, search%time, &
         self%last)
   end subroutine find_zero

   !> Shift a state to another instant, if the rounding error of the state exceeds the square of the change.
   pure subroutine shift_state(oscillators, time, state)
      type(oscillators_t), intent(in) :: oscillators
      real(wp), intent(in) :: time
      type(modal_state_t), intent(inout) :: state

      ! maximum of the interval times the fastest modal rate
      real(wp), parameter :: max_angle = 1.0e-8_wp
      real(wp) :: step

      step = time - state%time
      if (.not. abs(step)*maxval(oscillators%decay + 2.0_wp*oscillators%spread) < max_angle) return
      state%time = time
      state%z(:) = state%z + step*state%v
      state%v(:) = state%v + step*acceleration(oscillators, state%z, state%v)
   end subroutine shift_state

   !> The end of a short flight, in which the signal rises from zero, by `find_short_flight`.
   subroutine find_end_of_short_flight(self, limit, search, slope, harmonics, frequency)
      class(modal_signal_t), intent(in) :: self
      !> End of the search
      real(wp), intent(in) :: limit
      !> Outcome, as `find_short_flight` returns it
      type(search_t), intent(inout) :: search
      !> Slope of the terms besides the modes, as in `find_short_flight`
      real(wp), intent(in), optional :: slope
      !> Harmonics of these terms, [harmonics]
      complex(wp), intent(inout), optional :: harmonics(:)
      !> Frequencies of the harmonics, [harmonics]
      real(wp), intent(in), optional :: frequency(:)

      search%outcome = found_none
      if (abs(self%relaxation) > 0.0_wp) return
      call find_short_flight(self%oscillators, self%weight, self%z, self%v, limit, search, slope, harmonics, &
         frequency)
   end subroutine find_end_of_short_flight

   !> A derivative of the signal, or of its sum with another signal, at an instant, as in `bounds_interface`.
   subroutine find_bounds(self, t, order, bounds, added, added_floor, needs_step)
      class(modal_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Order of the derivative; 0: the signal itself
      integer, intent(in) :: order
      !> Values and bounds of the sum at the instant
      type(bounds_t), intent(out) :: bounds
      !> The other signal: columns as in `certified_search`
      real(wp), intent(in), optional :: added(term_columns)
      !> Lower bound of the other signal
      real(wp), intent(in), optional :: added_floor
      !> False: the length of a step without a zero is not needed
      logical, intent(in), optional :: needs_step

      real(wp) :: basis(size(self%weight), basis_columns), factors(size(self%weight), factor_columns)
      real(wp) :: terms(size(self%weight), term_columns)
      ! sums of the columns of `terms`; then sum of all terms that are not modes
      real(wp) :: sums(term_columns), other_terms(term_columns)
      real(wp) :: magnitude, relaxation, slope
      integer :: blocks

      associate (n => size(self%weight))
         blocks = n/lanes
         call find_basis(self%oscillators, n, t, basis)
         if (is_prepared(self, order)) then
            call find_terms(blocks, self%factors(:, :, order), basis, merge(t, 0.0_wp, order == 0), &
               terms, sums, magnitude)
         else
            call factors_of(self, order, factors)
            call find_terms(blocks, factors, basis, merge(t, 0.0_wp, order == 0), terms, sums, &
               magnitude)
         end if
         if (order > 0) then
            call sum_values(self, basis, t, bounds%signal, slope, bounds%signal_rounding)
         else
            bounds%signal = sums(term_value)
            bounds%signal_rounding = magnitude
            if (self%offset > 0.0_wp) bounds%floor = self%offset - sums(bound_value)
         end if
         bounds%signal = self%offset + bounds%signal
         bounds%signal_rounding = epsilon(1.0_wp)*(4.0_wp*abs(self%offset) + bounds%signal_rounding)
         bounds%value = merge(bounds%signal, sums(term_value), order == 0)
         bounds%rounding = merge(bounds%signal_rounding, epsilon(1.0_wp)*magnitude, order == 0)
         bounds%slope = sums(term_rate)
         bounds%curvature = sums(term_curvature)
         bounds%bound = sums(bound_curvature)
         bounds%two_sided_bound = bounds%bound
         bounds%bound_jerk = sums(bound_jerk)
         relaxation = 0.0_wp
         if (abs(self%relaxation) > 0.0_wp) call add_relaxation(self, t, order, bounds, relaxation)
         if (present(added)) call add_to_bounds(added, added_floor, bounds)
         if (present(needs_step)) then
            if (.not. needs_step) return
         end if
         if (order == 0 .and. bounds%floor > bounds%rounding) return
         if (order == 0 .and. falls_to_zero(bounds)) return
         ! `other_terms` has no bounds for a concave exponential; a convex exponential needs no bounds
         if (relaxation < 0.0_wp) return
         other_terms = 0.0_wp
         if (present(added)) other_terms = added
         other_terms(term_value) = merge(self%offset, 0.0_wp, order == 0) + relaxation + other_terms(term_value)
         other_terms(term_rate) = other_terms(term_rate) - self%rate*relaxation
         bounds%zero_free_step = zero_free_step(terms, other_terms, bounds%value, bounds%slope)
      end associate
   end subroutine find_bounds

   !> Add the relaxing deformation to values and bounds.
   pure subroutine add_relaxation(self, t, order, bounds, relaxation)
      type(modal_signal_t), intent(in) :: self
      real(wp), intent(in) :: t
      !> Order of the derivative
      integer, intent(in) :: order
      type(bounds_t), intent(inout) :: bounds
      !> The derivative of the term
      real(wp), intent(out) :: relaxation

      relaxation = self%relaxation*exp(-self%rate*t)
      bounds%floor = bounds%floor + min(relaxation, 0.0_wp)
      bounds%signal = bounds%signal + relaxation
      relaxation = relaxation*(-self%rate)**order
      bounds%value = bounds%value + relaxation
      if (order > 0) bounds%rounding = bounds%rounding + 4.0_wp*epsilon(1.0_wp)*abs(relaxation)
      bounds%slope = bounds%slope - self%rate*relaxation
      bounds%curvature = bounds%curvature + self%rate**2*relaxation
      ! a positive exponential is convex, so it does not add to the one-sided bound
      bounds%bound = bounds%bound + self%rate**2*max(-relaxation, 0.0_wp)
      bounds%two_sided_bound = bounds%two_sided_bound + self%rate**2*abs(relaxation)
      bounds%bound_jerk = bounds%bound_jerk + self%rate**3*abs(relaxation)
   end subroutine add_relaxation

   !> The sum of the modes, its slope, and a magnitude proportional to its rounding error.
   pure subroutine sum_values(self, basis, t, value, slope, magnitude)
      class(modal_signal_t), intent(in) :: self
      !> From `find_basis`, [padded, basis_columns]
      real(wp), contiguous, intent(in) :: basis(:, :)
      !> Instant
      real(wp), intent(in) :: t
      real(wp), intent(out) :: value
      real(wp), intent(out) :: slope
      real(wp), intent(out) :: magnitude

      real(wp) :: factors(size(self%weight), factor_columns)

      if (is_prepared(self, 0)) then
         call find_values(size(basis, 1)/lanes, self%factors(:, :, 0), basis, t, value, slope, magnitude)
      else
         call factors_of(self, 0, factors)
         call find_values(size(basis, 1)/lanes, factors, basis, t, value, slope, magnitude)
      end if
   end subroutine sum_values

   !> Amplitude up to which fast exponentials are left out. A signal that starts at zero with zero slope is searched by
   !> its higher derivatives. Fast exponentials dominate the higher derivatives; if their amplitude is below the
   !> rounding error of the signal, they would add nothing but error.
   pure real(wp) function min_amplitude(self) result(threshold)
      type(modal_signal_t), intent(in) :: self

      threshold = 0.0_wp
      if (self%start_order > 1) then
         threshold = 0.25_wp*epsilon(1.0_wp)*(abs(self%offset) + sum(abs(self%weight*self%z)))/real(size(self%z), wp)
      end if
   end function min_amplitude

end module modal_signal
