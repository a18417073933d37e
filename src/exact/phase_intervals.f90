!> A phase of exact motion (the motion between two events) as an interval that observers, such as measures and
!> statistics, evaluate: values, maxima, integrals and energies in closed form.
module phase_intervals
   use certified_search, only: search_t, transformable_signal_t
   use contact_states, only: energy_in, has_rigid_stop, contact_state_t
   use contact_values, only: gap_bound_of_terms
   use coupled_modes, only: terms_at
   use damped_oscillators, only: modal_energy
   use exponential_sums, only: exponential_sums_t
   use flight_peaks, only: find_peak
   use kinds, only: i8, wp
   use modal_signal, only: modal_signal_t
   use moment_signals, only: moments_t
   use motion_intervals, only: curve_t, interval_t, observed_contact_t, peak_t, output_row_t
   use phase_curves, only: signal_curve_t
   use phase_losses, only: integrate_on_path, advance_contact, impulse_in, loss_of_contact
   use phase_rows, only: can_square_rows, is_integrable, is_on_path, signal_of_row
   use phase_state, only: end_force, cache_state, find_state, phase_state_t, signal_of, observed_gap, observed_tip
   use phase_sums, only: find_acceleration, find_sums
   use response_types, only: settling_level
   use row_peaks, only: max_on_path, range_on_path, state_on_path
   use row_signals, only: row_signal_t
   use section_states, only: motion_of
   use signal_integrals, only: integrate_signals
   use signal_peaks, only: exceeds_in => exceeds, extreme_search_t, find_maximum, find_turn, peak_tolerance
   implicit none (type, external)
   private
   public :: phase_interval_t

   !> A phase as observers evaluate it; its output rows are gaps, tip, contact forces, moments and bodies.
   type, extends(interval_t) :: phase_interval_t
      type(phase_state_t), pointer :: now => null()
      !> Result of the search for the end of the phase at each contact, [contacts]
      type(search_t), allocatable :: searches(:)
      !> Bending moments, if requested
      type(moments_t) :: moments
      !> Contact states at the start of the phase, set if loads act or measures are requested and some contact is
      !> compliant
      type(contact_state_t), allocatable :: at_start(:)
      !> State of the constrained modes at the end of the phase, stored in the contact set, [modes]
      real(wp), pointer, contiguous :: z_end(:) => null(), v_end(:) => null()
      !> Displacements and forces as signals for integrals; unallocated: not requested yet
      type(exponential_sums_t), allocatable :: sums
   contains
      procedure :: contact, evaluate, gap_bound, rounding, exceeds, range_of, seek_peak, seek_turn, record_gap
      procedure :: impulse, integrate, expand_in_exponentials, energy, dissipated
   end type phase_interval_t

contains

   !> State of a contact during the phase, as observers use it.
   pure type(observed_contact_t) function contact(self, k)
      class(phase_interval_t), intent(in) :: self
      integer, intent(in) :: k

      associate (state => self%now%states(k))
         contact%number = state%contact%number
         contact%sign = state%contact%sign
         contact%signed_height = self%now%beam%observed_height(k)
         contact%is_closed = self%now%set%is_closed(k)
         contact%is_compliant = .not. has_rigid_stop(state)
         contact%has_finite_force = .not. state%is_rigid
         contact%is_active = state%is_active
         contact%has_zero_gap = contact%is_closed .and. .not. contact%is_compliant
         contact%flights = state%flights
         contact%first_at_place = self%now%colocated(k)
         contact%is_at_tip = abs(self%now%beam%tip_sign(k)) > 0.0_wp .and. .not. state%is_node
      end associate
   end function contact

   !> Value and rate of an output row at a time, from the path of the simultaneous search if it contains the row.
   function evaluate(self, row, time) result(state)
      class(phase_interval_t), intent(in) :: self
      type(output_row_t), intent(in) :: row
      real(wp), intent(in) :: time
      real(wp) :: state(2)

      class(transformable_signal_t), pointer :: signal
      real(wp) :: z(size(self%now%z)), v(size(self%now%z))

      if (is_on_path(self%now, self%length, row)) then
         call state_on_path(self%now%set%shared%basis, self%now%path, signal_of_row(self%now, row), time, state)
         return
      end if
      if (row%number > self%moment_row(self%places)) then
         call find_state(self%now, time, z, v)
         state = motion_of(self%now, z, v, self%now%beam%displacement(row%number - self%moment_row(self%places)))
      else
         call find_signal(self, row, signal)
         call signal%evaluate(time, state(1), state(2))
      end if
      state = row%factor*state + [row%offset, 0.0_wp]
   end function evaluate

   !> Upper bound of the magnitude of a gap; `huge`: unknown. For an open contact, the bound follows from the search for
   !> the end of the phase: the gap is negative by at most the indentation at the start of the phase, because an open
   !> contact recovers. For a closed contact, the bound follows from the amplitudes of the terms, which do not grow.
   pure real(wp) function gap_bound(self, k)
      class(phase_interval_t), intent(in) :: self
      integer, intent(in) :: k

      gap_bound = huge(1.0_wp)
      if (self%now%set%is_closed(k)) then
         if (size(self%now%set%compliant) > 0) gap_bound = gap_bound_of_terms(self%now, k)
      else if (self%now%states(k)%is_deformed) then
         return
      else if (self%now%states(k)%is_rigid) then
         gap_bound = self%searches(k)%ceiling
      else if (allocated(self%at_start)) then
         gap_bound = max(self%searches(k)%ceiling, self%at_start(k)%indentation)
      end if
   end function gap_bound

   !> Rounding error of a gap.
   pure real(wp) function rounding(self, k)
      class(phase_interval_t), intent(in) :: self
      integer, intent(in) :: k

      associate (constrained => self%now%set%constrained)
         rounding = 4.0_wp*epsilon(1.0_wp)*(abs(constrained%static_gap(k)) + sum(abs(constrained%value(:, &
            k)*self%now%z)))
      end associate
   end function rounding

   !> Whether an output row exceeds a level during the phase.
   logical function exceeds(self, row, level) result(does)
      class(phase_interval_t), intent(in) :: self
      type(output_row_t), intent(in) :: row
      real(wp), intent(in) :: level

      class(transformable_signal_t), allocatable :: part
      class(transformable_signal_t), pointer :: signal
      real(wp) :: maximum, time

      does = .false.
      if (row%factor < 0.0_wp .and. row%number <= self%contacts) then
         ! for an open contact, minus the gap nowhere exceeds its value at the end of the previous phase
         if (.not. (self%now%set%is_closed(row%number) .and. self%gap_bound(row%number) > level)) return
      else if (row%number <= self%contacts) then
         associate (k => row%number, search => self%searches(row%number))
            ! whether the search for the end of the phase has found a value above the level within the phase
            does = self%now%states(k)%is_rigid .and. .not. self%now%set%is_closed(k) .and. search%time <= self%length &
               .and. row%factor*search%max_value + row%offset > level
            if (does) return
         end associate
      end if
      if (is_on_path(self%now, self%length, row)) then
         maximum = level
         call max_on_path(self%now%set%shared%basis, self%now%path, signal_of_row(self%now, row), &
            [0.0_wp, self%length], 0.0_wp, does, maximum, time)
         return
      end if
      call find_signal(self, row, signal)
      if (row%factor < 0.0_wp) then
         call signal%transform(0.0_wp, row%factor, row%offset, 0, part)
         does = exceeds_in(part, self%length, level)
      else
         does = exceeds_in(signal, self%length, level)
      end if
   end function exceeds

   !> Whether the phase state contains the search history of the gap of contact k, and all evaluations of this history
   !> are within the phase.
   pure logical function has_history(self, k)
      class(phase_interval_t), intent(in) :: self
      integer, intent(in) :: k

      has_history = self%now%history_of == k .and. self%searches(k)%time <= self%length
   end function has_history

   !> Find the maximum of an output row.
   subroutine seek_peak(self, row, span, known, peak, search_state)
      class(phase_interval_t), intent(inout) :: self
      type(output_row_t), intent(in) :: row
      !> Start and end of the part of the phase that is searched
      real(wp), intent(in) :: span(2)
      !> Only a maximum above this known value is reported
      real(wp), intent(in) :: known
      type(peak_t), intent(inout) :: peak
      type(extreme_search_t), intent(inout) :: search_state

      class(transformable_signal_t), allocatable, target :: part
      class(transformable_signal_t), pointer :: signal
      ! maximum of the signal known from the search for the end of the phase
      real(wp) :: known_max, threshold
      ! whether the row itself is searched, with the factor 1 and the offset 0, whether the maximum is certain, and
      ! whether `span` is the whole phase
      logical :: is_unscaled, is_certain, is_whole

      is_whole = .not. (span(1) > 0.0_wp .or. span(2) < self%length)
      is_unscaled = .not. (abs(row%factor - 1.0_wp) > 0.0_wp .or. abs(row%offset) > 0.0_wp .or. row%order > 0)
      peak%still_rises = .false.
      if (is_on_path(self%now, self%length, row)) then
         peak%value = known
         call max_on_path(self%now%set%shared%basis, self%now%path, signal_of_row(self%now, row), span, &
            max(row%scale, 0.0_wp), peak%is_found, peak%value, peak%time)
         peak%still_rises = peak%is_found .and. .not. peak%time < span(2)
         return
      end if
      threshold = known
      ! no value is known yet; half of `huge` avoids overflow in the products below
      known_max = -0.5_wp*huge(1.0_wp)
      call find_signal(self, row, signal)
      if (is_whole .and. is_unscaled .and. row%scale < 0.0_wp .and. row%number <= self%contacts) then
         if (has_history(self, row%number) .and. .not. self%is_last) then
            select type (signal)
            type is (modal_signal_t)
               call signal%prepare(1)
            end select
            call find_peak(signal, self%now%history, is_certain, peak%value, peak%time)
            peak%is_found = is_certain .and. peak%value > known
            if (is_certain) return
         end if
      end if
      if (all([is_whole, is_unscaled, .not. row%needs_time, row%number > self%tip_row(), &
         row%number <= self%force_row(self%contacts)])) then
         associate (search => self%searches(row%number - self%tip_row()))
            ! a search beyond the end of the phase, which another contact ended, may have found later values
            if (search%time <= self%length) known_max = search%max_value
         end associate
         threshold = max(threshold, known_max*(1.0_wp + peak_tolerance))
      end if
      if (span(1) > 0.0_wp .or. .not. is_unscaled) then
         call signal%transform(span(1), row%factor, row%offset, 0, part)
         signal => part
      end if
      if (row%scale < 0.0_wp) then
         call find_maximum(signal, span(2) - span(1), threshold, peak%is_found, peak%still_rises, peak%value, &
            peak%time, extreme_search=search_state)
      else
         call find_maximum(signal, span(2) - span(1), threshold, peak%is_found, peak%still_rises, peak%value, &
            peak%time, row%scale, search_state)
      end if
      peak%time = span(1) + peak%time
      if (peak%is_found .or. .not. known_max*(1.0_wp + peak_tolerance) > known) return
      peak%is_found = .true.
      peak%value = known_max
   end subroutine seek_peak

   !> Lower and upper bound of an output row over the phase, if the path of the simultaneous search gives them.
   function range_of(self, row) result(bounds)
      class(phase_interval_t), intent(in) :: self
      type(output_row_t), intent(in) :: row
      real(wp) :: bounds(2)

      bounds = [-huge(1.0_wp), huge(1.0_wp)]
      if (is_on_path(self%now, self%length, row)) bounds = range_on_path(self%now%set%shared%basis, self%now%path, &
         signal_of_row(self%now, row))
   end function range_of

   !> Find the first turning point of an output row.
   subroutine seek_turn(self, row, span, direction, is_found, time, evaluations)
      class(phase_interval_t), intent(inout) :: self
      type(output_row_t), intent(in) :: row
      real(wp), intent(in) :: span(2)
      integer, intent(inout) :: direction
      logical, intent(out) :: is_found
      real(wp), intent(out) :: time
      integer(i8), intent(inout) :: evaluations

      class(transformable_signal_t), pointer :: signal

      call find_signal(self, row, signal)
      call find_turn(signal, span, direction, is_found, time, evaluations)
   end subroutine seek_turn

   !> Store the gap as a curve, unless it ends so far from zero that the gap of the next phase will be stored instead.
   !> The set to which the curve points is protected from deallocation.
   subroutine record_gap(self, k, curve)
      class(phase_interval_t), intent(in) :: self
      integer, intent(in) :: k
      class(curve_t), allocatable, intent(inout) :: curve

      class(transformable_signal_t), pointer :: signal
      real(wp) :: state(2)
      integer :: i

      if (is_on_path(self%now, self%length, output_row_t(k)) .and. .not. self%is_last) then
         state = self%evaluate(output_row_t(k), self%length)
         if (abs(state(1)) > 2.0_wp*settling_level) return
      end if
      if (.not. allocated(curve)) allocate (signal_curve_t :: curve)
      curve%start = self%start
      curve%length = self%length
      select type (curve)
      type is (signal_curve_t)
         call signal_of(self%now, k, observed_gap, signal)
         if (allocated(curve%signal)) deallocate (curve%signal)
         if (associated(signal, self%now%signal)) then
            call move_alloc(self%now%signal, curve%signal)
         else
            allocate (curve%signal, source=signal)
         end if
         curve%is_above = .not. (self%now%set%is_closed(k) .or. self%now%states(k)%is_deformed)
         if (allocated(self%at_start)) curve%is_above = curve%is_above &
            .and. self%at_start(k)%indentation <= settling_level
         curve%known_above = 0.0_wp
         if (has_history(self, k)) then
            associate (history => self%now%history)
               do i = 1, min(history%count, size(history%time))
                  if (history%bounds(i)%signal > settling_level) curve%known_above = history%time(i)
               end do
            end associate
         end if
      end select
      self%now%store%in_use => self%now%set
   end subroutine record_gap

   !> Integrals of all output rows except bending moments, and of their squares.
   subroutine integrate(self, span, integrals, square_integrals, order)
      class(phase_interval_t), intent(inout) :: self
      !> Start and end of the integrals, since the start of the phase
      real(wp), intent(in) :: span(2)
      !> Integral of each output row, and of its square, [rows]
      real(wp), intent(out) :: integrals(:)
      real(wp), intent(out) :: square_integrals(:)
      integer, intent(in), optional :: order

      ! displacements at contacts and tip, forces of closed contacts: as output rows, as signals, and their integrals
      type(output_row_t) :: rows(2*self%contacts + 1)
      type(row_signal_t) :: signals(size(rows))
      real(wp), dimension(size(rows)) :: row_integral, square_integral
      type(exponential_sums_t) :: accelerations
      logical :: are_rows
      ! index of the displacement at the tip among the rows; 0: the tip is at no contact
      integer :: tip_place
      ! numbers of rows and of sums
      integer :: i, k, m, n

      if (present(order)) then
         call find_sums(self%now, self%moments, self%length, [(k, k=1, size(integrals))], accelerations, order)
         call integrate_signals(accelerations, span(1), span(2), self%now%set%squares, integrals, square_integrals)
         return
      end if
      associate (now => self%now, set => self%now%set)
         n = 0
         tip_place = 0
         do k = 1, self%contacts
            if (now%colocated(k) /= k) cycle
            n = n + 1
            rows(n) = output_row_t(k, offset=now%beam%observed_height(k))
            if (abs(now%beam%tip_sign(k)) > 0.0_wp .and. .not. now%states(k)%is_node) tip_place = n
         end do
         do k = 1, self%contacts
            if (.not. set%is_closed(k)) cycle
            n = n + 1
            rows(n) = output_row_t(self%force_row(k))
         end do
         n = n + 1
         rows(n) = output_row_t(self%tip_row())
         are_rows = can_square_rows(now)
         ! a tip at a contact needs no sum of its own
         m = merge(n - 1, n, tip_place > 0)
         do i = 1, m
            if (are_rows) are_rows = is_integrable(now, rows(i))
            if (.not. are_rows) exit
            signals(i) = signal_of_row(now, rows(i))
         end do
         if (are_rows) then
            call integrate_on_path(now, span(1), span(2) - span(1), signals(:m), row_integral(:m), &
               square_integral(:m), are_rows)
         end if
         if (are_rows) then
            if (tip_place > 0) then
               row_integral(n) = now%beam%tip_sign(rows(tip_place)%number)*row_integral(tip_place)
               square_integral(n) = square_integral(tip_place)
            end if
         else
            if (.not. allocated(self%sums)) then
               allocate (self%sums)
               call find_sums(now, self%moments, self%length, rows(:n)%number, self%sums)
            end if
            call integrate_signals(self%sums, span(1), span(2), set%squares, row_integral(:n), square_integral(:n))
         end if
         integrals = 0.0_wp
         square_integrals = 0.0_wp
         integrals(rows(:n)%number) = row_integral(:n)
         square_integrals(rows(:n)%number) = square_integral(:n)
         do k = 1, self%contacts
            if (now%colocated(k) == k) cycle
            integrals(k) = now%colocated_sign(k)*integrals(now%colocated(k))
            square_integrals(k) = square_integrals(now%colocated(k))
         end do
      end associate
   end subroutine integrate

   !> Rows as sums of exponentials.
   subroutine expand_in_exponentials(self, rows, sums)
      class(phase_interval_t), intent(in) :: self
      integer, intent(in) :: rows(:)
      type(exponential_sums_t), intent(out) :: sums

      call find_sums(self%now, self%moments, self%length, rows, sums)
   end subroutine expand_in_exponentials

   !> Energy of beam and stops.
   real(wp) function energy(self, time)
      class(phase_interval_t), intent(in) :: self
      real(wp), intent(in) :: time

      type(contact_state_t) :: state
      real(wp), dimension(size(self%now%z)) :: z, v
      complex(wp), allocatable :: term(:)
      integer :: k

      associate (now => self%now, set => self%now%set, constrained => self%now%set%constrained)
         if (.not. time < self%length) then
            ! the contact states are already those at the end of the phase
            energy = constrained%static_energy + sum(modal_energy(constrained%oscillators, self%z_end, self%v_end)) &
               + sum(energy_in(now%states))
            return
         end if
         allocate (term(0))
         if (size(set%compliant) > 0) then
            term = terms_at(set%coupled, now%amplitude, time)
            call cache_state(now, time, term)
         end if
         call find_state(now, time, z, v)
         energy = constrained%static_energy + sum(modal_energy(constrained%oscillators, z, v))
         if (all(now%states%is_rigid)) return
         if (.not. time > 0.0_wp) then
            energy = energy + sum(energy_in(self%at_start))
            return
         end if
         do k = 1, size(now%states)
            state = self%at_start(k)
            call advance_contact(now, k, time, z, term, state)
            energy = energy + energy_in(state)
         end do
      end associate
   end function energy

   !> Energy dissipated in the dampers of the stop of a contact.
   real(wp) function dissipated(self, k, time) result(energy)
      class(phase_interval_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: time

      energy = 0.0_wp
      if (.not. allocated(self%at_start) .or. .not. time > 0.0_wp) return
      energy = loss_of_contact(self%now, k, self%at_start(k), time, time < self%length)
   end function dissipated

   !> An output row as a signal, without factor and offset; rows are gaps, tip, contact forces, moments in this order.
   subroutine find_signal(self, row, signal)
      class(phase_interval_t), target, intent(in) :: self
      type(output_row_t), intent(in) :: row
      class(transformable_signal_t), pointer, intent(out) :: signal

      associate (k => row%number - self%tip_row())
         if (row%order > 0) then
            call find_acceleration(self%now, row%number, signal)
         else if (k > self%contacts) then
            signal => self%moments%place(k - self%contacts)%signal
         else if (k > 0 .and. self%now%force_signal_at == k) then
            signal => self%now%force_signal
         else if (k > 0) then
            call signal_of(self%now, k, end_force, signal)
         else if (k == 0) then
            call signal_of(self%now, 0, observed_tip, signal)
         else
            call signal_of(self%now, row%number, observed_gap, signal)
         end if
      end associate
   end subroutine find_signal

   !> Integral of a contact force from the start of the phase.
   real(wp) function impulse(self, k, time)
      class(phase_interval_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: time

      real(wp) :: integral_of_force(1)
      type(row_signal_t) :: force

      ! a single integral is not worth the terms of rows that no search has used
      if (self%now%path%is_begun) then
         if (is_integrable(self%now, output_row_t(self%force_row(k)))) then
            force = signal_of_row(self%now, output_row_t(self%force_row(k)))
            call integrate_on_path(self%now, 0.0_wp, time, [force], integral_of_force)
            impulse = integral_of_force(1)
            return
         end if
      end if
      impulse = impulse_in(self%now, k, time)
   end function impulse

end module phase_intervals
