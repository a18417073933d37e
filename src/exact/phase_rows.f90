!> Gaps, contact forces and tip displacement of a phase (the motion between two events) as output rows: linear
!> combinations of the same exponential terms. One search evaluates all rows at the nodes of a path of time steps, and
!> so finds the contact that ends the phase (docs/theory.md, section 23).
module phase_rows
   use certified_search, only: found_none, found_zero, search_t
   use compliant_stop, only: dynamic_stiffness_t
   use contact_sets, only: has_force_row
   use contact_states, only: dynamic_stiffness_of
   use damped_oscillators, only: lanes
   use kinds, only: wp
   use motion_intervals, only: output_row_t
   use phase_state, only: end_force, end_gap, end_undeformed, end_renewed_contact, phase_state_t, observed_gap, &
      observed_tip
   use row_basis, only: has_terms, make_row_basis, row_basis_t, set_row
   use row_search, only: search_rows
   use row_signals, only: max_steps, row_signal_t
   use set_motions, only: exponents_of, is_unsuitable, min_modulus
   implicit none (type, external)
   private
   public :: can_search_rows, can_square_rows, search_contacts, is_integrable, is_on_path, signal_of_row

contains

   !> Whether all contacts of the phase can be searched simultaneously.
   logical function can_search_rows(self) result(can)
      type(phase_state_t), intent(inout) :: self

      can = .false.
      ! separate searches are faster without loads
      if (self%loads%count == 0 .or. .not. any(self%states%is_active)) return
      ! ... and for the gap of a single rigid contact, whose low flights `short_flights` finds, unless a load rises or
      ! falls or the path has another use
      if (count(self%states%is_active) == 1 .and. any(self%states%is_active .and. self%states%is_rigid)) then
         if (.not. (self%needs_extremes .or. any(abs(self%forced%slope) > 0.0_wp))) return
      end if
      can = has_rows(self)
   end function can_search_rows

   !> Whether the motion of the phase is a sum of the terms of output rows. At the first use the output rows of the set
   !> are made.
   logical function has_rows(self) result(has)
      type(phase_state_t), intent(inout) :: self

      has = .false.
      if (self%is_at_rest .or. self%loads%count == 0) return
      ! modes driven from rest, and surrogate harmonics of slow loads, are not among the terms of the set
      if (size(self%forced%pair) > 0 .or. size(self%forced%frequency) /= size(self%loads%frequencies)) return
      if (.not. self%set%has_rows) call make_rows(self)
      has = self%set%can_search_rows
   end function has_rows

   !> Whether squares of rows can be integrated. The quadratic form of the rows would lose the small values of a slow
   !> harmonic in the rounding error of its large amplitude.
   pure logical function can_square_rows(self)
      type(phase_state_t), intent(in) :: self

      can_square_rows = .true.
      if (self%loads%count > 0) can_square_rows = all(self%loads%frequencies >= min_modulus)
   end function can_square_rows

   !> Make the output rows of the set.
   subroutine make_rows(self)
      type(phase_state_t), intent(inout) :: self

      complex(wp), allocatable :: exponent(:)
      ! number of contacts
      integer :: n
      ! number of rows so far
      integer :: rows
      integer :: j, k

      n = size(self%states)
      associate (set => self%set)
         set%has_rows = .true.
         allocate (exponent, source=exponents_of(self%set))
         set%motion_terms = size(exponent)
         set%can_search_rows = .not. is_unsuitable(self%set, exponent)
         if (.not. set%can_search_rows) return
         exponent = [exponent, cmplx(0.0_wp, self%loads%frequencies, wp)]
         set%gap_row = [(0, k=1, n)]
         set%force_row = set%gap_row
         set%row_contact = [(0, k=1, 2*n)]
         set%gap_sign = [(1.0_wp, k=1, n)]
         rows = 0
         do k = 1, n
            if (.not. self%states(k)%is_active) cycle
            ! the first active contact at the same point of the beam
            j = findloc(self%colocated(:k) == self%colocated(k) .and. self%states(:k)%is_active, .true., dim=1)
            set%gap_sign(k) = self%colocated_sign(j)*self%colocated_sign(k)
            if (j == k) rows = rows + 1
            set%gap_row(k) = merge(rows, set%gap_row(j), j == k)
            if (j == k .or. set%is_closed(k)) set%row_contact(set%gap_row(k)) = k
            if (.not. set%is_closed(k)) cycle
            if (any(set%compliant == k) .and. .not. has_force_row(dynamic_stiffness_of(self%states(k)))) cycle
            rows = rows + 1
            set%force_row(k) = rows
         end do
         set%tip_row = 0
         do k = 1, n
            if (set%gap_row(k) == 0 .or. self%states(k)%is_node .or. .not. abs(self%beam%tip_sign(k)) > 0.0_wp) cycle
            set%tip_row = set%gap_row(k)
            set%tip_row_sign = self%beam%tip_sign(k)*set%gap_sign(k)
         end do
         if (set%tip_row == 0) then
            rows = rows + 1
            set%tip_row = rows
            set%tip_row_sign = 1.0_wp
         end if
         if (set%shared%run == set%run) return
         set%shared%run = set%run
         if (.not. has_terms(set%shared%basis, exponent, rows)) then
            if (allocated(set%shared%form)) deallocate (set%shared%form)
            call make_row_basis(exponent, rows, set%shared%basis)
         end if
         call set_coefficients(self, set%shared%basis)
      end associate
   end subroutine make_rows

   !> Set the coefficients of the output rows, except those of load harmonics.
   subroutine set_coefficients(self, basis)
      type(phase_state_t), intent(in) :: self
      type(row_basis_t), intent(inout) :: basis

      integer :: k

      associate (set => self%set)
         do k = 1, size(self%states)
            if (set%gap_row(k) == 0) cycle
            if (set%row_contact(set%gap_row(k)) == k) call set_row(basis, set%gap_row(k), 1, &
               set%gap_sign(k)*coefficients_of(self, k, end_gap))
            if (set%force_row(k) > 0) call set_row(basis, set%force_row(k), 1, coefficients_of(self, k, end_force))
         end do
         if (all(set%gap_row /= set%tip_row)) call set_row(basis, set%tip_row, 1, &
            coefficients_of(self, 0, observed_tip))
      end associate
   end subroutine set_coefficients

   !> Coefficients of an output row per unit amplitude of each term.
   pure function coefficients_of(self, k, kind) result(coefficient)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      !> `end_gap`, `end_force` or `observed_tip`
      integer, intent(in) :: kind
      complex(wp) :: coefficient(self%set%motion_terms)

      associate (set => self%set, constrained => self%set%constrained)
         if (size(set%compliant) > 0) then
            if (kind == end_gap) then
               coefficient = set%gap(k, :)
            else if (kind == observed_tip) then
               coefficient = matmul(constrained%tip_value, set%coupled%shape)
            else if (any(set%compliant == k)) then
               coefficient = set%coupled%force(findloc(set%compliant, k, dim=1), :)
            else
               coefficient = set%reaction(findloc(constrained%closed, k, dim=1), :)
            end if
         else if (kind == end_gap) then
            coefficient = of_modes(constrained%value(:, k))
         else if (kind == observed_tip) then
            coefficient = of_modes(constrained%tip_value)
         else
            ! a mode exp(s t) contributes 1 + 2 zeta s = -s (s + alpha)/W^2 to a reaction: a form without cancellation
            ! (alpha: rate of mass-proportional damping)
            associate (s => exponents_of(self%set))
               coefficient = of_modes(constrained%reaction(findloc(constrained%closed, k, dim=1), &
                  :)/constrained%oscillators%square)
               coefficient = -s*(s + of_modes(constrained%oscillators%mass_rate(:constrained%count)))*coefficient
            end associate
         end if
      end associate

   contains

      !> Coefficients of the terms from coefficients of the modes; both terms of an overdamped mode have the coefficient
      !> of the mode.
      pure function of_modes(values) result(terms)
         real(wp), intent(in) :: values(:)
         complex(wp) :: terms(self%set%motion_terms)

         terms = cmplx([values, values(self%set%constrained%oscillators%underdamped + 1:)], 0.0_wp, wp)
      end function of_modes
   end function coefficients_of

   !> Set the amplitudes of the terms at the start of the phase (real and imaginary parts at node 0 of the path), and
   !> the coefficients of the load harmonics in the rows.
   subroutine start_path(self)
      type(phase_state_t), intent(inout) :: self

      ! number of load harmonics
      integer :: harmonics
      ! index of a mode
      integer :: i
      ! index of the second term of this mode
      integer :: m
      integer :: k, n

      self%span%length = -1.0_wp
      self%path%is_begun = .true.
      associate (set => self%set, path => self%path, basis => self%set%shared%basis)
         n = size(basis%decay)
         if (allocated(path%z)) then
            if (size(path%z, 1) /= n .or. size(path%rows, 1) /= lanes*basis%blocks) deallocate (path%z, path%rows, &
               path%bounds)
         end if
         if (.not. allocated(path%z)) allocate (path%z(n, 2, 0:max_steps), path%rows(lanes*basis%blocks, &
            0:max_steps), path%bounds(lanes*basis%blocks, 0:max_steps))
         associate (z => path%z(:, :, 0))
            z = 0.0_wp
            if (size(set%compliant) > 0) then
               do m = 1, size(self%amplitude)
                  z(m, 1) = real(self%amplitude(m), wp)
                  z(m, 2) = aimag(self%amplitude(m))
               end do
            else
               associate (oscillators => set%constrained%oscillators)
                  ! underdamped: amplitude z - i (v + decay z)/spread; overdamped: two real terms, of which term m
                  ! decays faster
                  do i = 1, oscillators%underdamped
                     z(i, 1) = self%z(i)
                     z(i, 2) = -(self%v(i) + oscillators%decay(i)*self%z(i))*oscillators%inverse_spread(i)
                  end do
                  do i = oscillators%underdamped + 1, oscillators%count
                     m = i + oscillators%count - oscillators%underdamped
                     z(m, 1) = -0.5_wp*(self%v(i) + oscillators%decay(i)*self%z(i))*oscillators%inverse_spread(i)
                     z(i, 1) = self%z(i) - z(m, 1)
                  end do
               end associate
            end if
            if (self%loads%count == 0) return
            harmonics = basis%terms - set%motion_terms
            z(set%motion_terms + 1:basis%terms, 1) = 1.0_wp
         end associate
         if (harmonics == 0) return
         do k = 1, size(self%states)
            if (set%gap_row(k) == 0) cycle
            if (set%row_contact(set%gap_row(k)) == k) call set_row(basis, set%gap_row(k), &
               set%motion_terms + 1, set%gap_sign(k)*self%forced%harmonic(set%forced%at%gaps + k, :))
            if (set%force_row(k) > 0) call set_row(basis, set%force_row(k), set%motion_terms + 1, &
               self%forced%harmonic(set%forced%at%forces + k, :))
         end do
         if (all(set%gap_row /= set%tip_row)) call set_row(basis, set%tip_row, set%motion_terms + 1, &
            self%forced%harmonic(set%forced%at%tip + 1, :))
      end associate
   end subroutine start_path

   !> Whether a signal is a combination of output rows. The gap is none while the open stop recovers from its
   !> indentation, because the surface of the stop then moves without the beam.
   pure logical function is_row(self, k, kind) result(is)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      !> One of the `end_` or `observed_` constants
      integer, intent(in) :: kind

      is = .true.
      if (kind == observed_tip) return
      is = self%set%gap_row(k) > 0
      if (kind == end_force) return
      associate (state => self%states(k))
         if (kind == end_gap) is = is .and. (state%moves_with_beam .or. .not. state%indentation > 0.0_wp)
         if (kind == observed_gap) is = is .and. .not. (state%is_node .and. self%node_depth > 0.0_wp)
      end associate
   end function is_row

   !> A signal that ends a phase or is observed, as a combination of output rows.
   pure type(row_signal_t) function row_signal(self, k, kind) result(signal)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      !> A kind for which `is_row` is true
      integer, intent(in) :: kind

      type(dynamic_stiffness_t) :: spring
      ! row of the load response; 0: no loads
      integer :: load_row
      ! factor of the gap in the signal
      real(wp) :: factor
      ! factor of the rate of the gap in the signal
      real(wp) :: rate_factor

      associate (set => self%set, constrained => self%set%constrained)
         load_row = 0
         if (kind == observed_tip) then
            signal%row = set%tip_row
            signal%factor = set%tip_row_sign
            signal%offset = constrained%static_tip
            if (size(set%compliant) > 0) signal%offset = signal%offset + sum(constrained%tip_value*set%rest_modes)
            if (self%loads%count > 0) load_row = set%forced%at%tip + 1
         else if (kind == end_force .and. set%force_row(k) > 0) then
            signal%row = set%force_row(k)
            if (size(set%compliant) == 0) then
               signal%offset = constrained%static_force(findloc(constrained%closed, k, dim=1))
            else if (any(set%compliant == k)) then
               signal%offset = set%rest_force(findloc(set%compliant, k, dim=1))
            else
               signal%offset = set%rest_reaction(findloc(constrained%closed, k, dim=1))
            end if
            if (self%loads%count > 0) load_row = set%forced%at%forces + k
         else
            signal%row = set%gap_row(k)
            signal%factor = set%gap_sign(k)
            signal%offset = constrained%static_gap(k)
            if (size(set%compliant) > 0) signal%offset = set%rest_gap(k)
            if (self%loads%count > 0) load_row = set%forced%at%gaps + k
         end if
         if (load_row > 0) then
            signal%offset = signal%offset + self%forced%constant(load_row)
            signal%slope = self%forced%slope(load_row)
         end if
         if (kind == end_gap .or. kind == observed_gap .or. kind == observed_tip) return
         if (kind == end_force .and. set%force_row(k) > 0) return
         ! indentation -gap, force -(stiffness gap + viscosity gap rate), or the negative of that force
         spring = dynamic_stiffness_of(self%states(k))
         factor = -1.0_wp
         rate_factor = 0.0_wp
         if (kind /= end_undeformed) then
            factor = merge(-1.0_wp, 1.0_wp, kind == end_force)*spring%stiffness
            rate_factor = merge(-1.0_wp, 1.0_wp, kind == end_force)*spring%viscosity
         end if
         signal%offset = factor*signal%offset + rate_factor*signal%slope
         signal%slope = factor*signal%slope
         signal%rate_factor = rate_factor*signal%factor
         signal%factor = factor*signal%factor
      end associate
   end function row_signal

   !> Find the contact that ends the phase first. Contacts that cannot be decided here must be searched one by one.
   subroutine search_contacts(self, limit, searches, is_decided, ended_at, ended_by, time)
      type(phase_state_t), intent(inout) :: self
      !> Time at which the search ends
      real(wp), intent(in) :: limit
      !> Result for each contact, [contacts]
      type(search_t), intent(inout) :: searches(:)
      !> Whether it is known if and when a contact ends the phase; on entry true if it never does, [contacts]
      logical, intent(inout) :: is_decided(:)
      !> Index of the contact that ends the phase; 0: there is none
      integer, intent(out) :: ended_at
      !> How the contact ends the phase: one of the `end_` constants
      integer, intent(out) :: ended_by
      !> Time of the end, or the limit
      real(wp), intent(out) :: time

      ! signals to search; a deformed open contact has two signals
      type(row_signal_t) :: signals(2*size(searches))
      ! contact of each signal, and `end_` constant of the signal (`kind`)
      integer, dimension(2*size(searches)) :: contact, kind
      ! index of the signal with the first zero, or 0 (`first`); `last` node of the path; number n of signals
      integer :: first, last, n, k

      call start_path(self)
      n = 0
      do k = 1, size(searches)
         associate (state => self%states(k))
            if (is_decided(k)) cycle
            n = n + 1
            contact(n) = k
            kind(n) = end_gap
            if (state%is_closed) kind(n) = end_force
            if (state%is_deformed) kind(n) = end_renewed_contact
            signals(n) = row_signal(self, k, kind(n))
            ! a signal that starts with zero value and slope may stay within rounding: the search of one contact decides
            signals(n)%is_certified = is_row(self, k, kind(n)) .and. state%start_order < 2
            signals(n)%start_order = state%start_order
            if (.not. state%is_deformed) cycle
            n = n + 1
            contact(n) = k
            kind(n) = end_undeformed
            signals(n) = row_signal(self, k, end_undeformed)
         end associate
      end do
      call search_rows(self%set%shared%basis, limit, signals(:n), self%path, first, time)
      do while (passes_undeformed(self, first, contact, kind, signals))
         self%undeformed_at(contact(first)) = time
         ! the gap replaces two signals: that of renewed contact, with index first - 1, and that of `end_undeformed`
         signals(first - 1) = row_signal(self, contact(first), end_gap)
         signals(first - 1)%start_order = 1
         kind(first - 1) = end_gap
         n = n - 1
         signals(first:n) = signals(first + 1:n + 1)
         contact(first:n) = contact(first + 1:n + 1)
         kind(first:n) = kind(first + 1:n + 1)
         last = self%path%steps
         call search_rows(self%set%shared%basis, limit, signals(:n), self%path, first, time, last)
      end do
      ended_at = 0
      ended_by = end_gap
      if (first > 0) then
         ended_at = contact(first)
         ended_by = kind(first)
         if (signals(first)%max_value <= 64.0_wp*signals(first)%rounding) then
            ! this signal cannot be distinguished from zero: search the contacts one by one
            signals%is_certified = .false.
            ended_at = 0
            time = limit
         end if
      end if
      is_decided = .true.
      do k = 1, n
         is_decided(contact(k)) = is_decided(contact(k)) .and. signals(k)%is_certified
         if (kind(k) == end_undeformed) cycle
         searches(contact(k)) = search_t(outcome=found_none, time=time, max_value=signals(k)%max_value, &
            rounding=signals(k)%rounding, ceiling=signals(k)%ceiling)
         ! before the contact became undeformed its gap was not searched, so no upper bound of the gap is known
         if (self%undeformed_at(contact(k)) < time) searches(contact(k))%ceiling = huge(1.0_wp)
      end do
      if (ended_at > 0) searches(ended_at)%outcome = found_zero
   end subroutine search_contacts

   !> Whether the phase continues although a deformed contact becomes undeformed.
   pure logical function passes_undeformed(self, first, contact, kind, signals) result(passes)
      type(phase_state_t), intent(in) :: self
      !> Index of the signal that vanishes, 0: none
      integer, intent(in) :: first
      !> Contact of each signal, [signals]
      integer, intent(in) :: contact(:)
      !> `end_` constant of each signal, [signals]
      integer, intent(in) :: kind(:)
      type(row_signal_t), intent(in) :: signals(:)

      passes = self%passes_undeformed .and. first > 0
      if (passes) passes = kind(first) == end_undeformed
      ! the contact may have closed again before, at a zero of its signal of renewed contact (index first - 1), unless
      ! this search has examined that signal, too
      if (passes) passes = is_row(self, contact(first), end_gap) .and. signals(first - 1)%is_certified .and. &
         signals(first)%max_value > 64.0_wp*signals(first)%rounding
   end function passes_undeformed

   !> Whether integrals of this output row follow from the terms of rows. The path of the phase is begun if no search
   !> has begun it.
   logical function is_integrable(self, row) result(is)
      type(phase_state_t), intent(inout) :: self
      type(output_row_t), intent(in) :: row

      if (.not. self%path%is_begun) then
         if (has_rows(self)) call start_path(self)
      end if
      is = self%path%is_begun
      if (is) is = is_output_row(self, row)
   end function is_integrable

   !> Whether the path of the simultaneous search covers the phase, and this output row can be evaluated from the path.
   pure logical function is_on_path(self, length, row) result(is)
      type(phase_state_t), intent(in) :: self
      !> Length of the phase
      real(wp), intent(in) :: length
      type(output_row_t), intent(in) :: row

      is = self%path%is_complete
      if (is) is = self%path%time(self%path%steps) >= length
      if (is) is = is_output_row(self, row)
   end function is_on_path

   !> Whether a row requested by observers is a combination of output rows.
   pure logical function is_output_row(self, row) result(is)
      type(phase_state_t), intent(in) :: self
      type(output_row_t), intent(in) :: row

      associate (contacts => size(self%states))
         is = row%number <= 2*contacts + 1 .and. row%order == 0
         if (is .and. row%number /= contacts + 1) is = is_row(self, mod(row%number - 1, contacts + 1) + 1, &
            merge(end_force, observed_gap, row%number > contacts))
      end associate
   end function is_output_row

   !> An output row requested by observers, as a signal on the path of the simultaneous search.
   pure type(row_signal_t) function signal_of_row(self, row) result(signal)
      type(phase_state_t), intent(in) :: self
      type(output_row_t), intent(in) :: row

      associate (contacts => size(self%states))
         if (row%number > contacts + 1) then
            signal = row_signal(self, row%number - contacts - 1, end_force)
         else
            signal = row_signal(self, row%number, merge(observed_tip, observed_gap, row%number > contacts))
         end if
      end associate
      signal%offset = row%offset + row%factor*signal%offset
      signal%slope = row%factor*signal%slope
      signal%factor = row%factor*signal%factor
      signal%rate_factor = row%factor*signal%rate_factor
   end function signal_of_row

end module phase_rows
