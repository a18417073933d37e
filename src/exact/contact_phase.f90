!> A phase of exact motion with any number of contacts: the set of closed contacts is constant until the first of the
!> signals that can end the phase (gaps of open contacts, forces of closed contacts) falls to zero (docs/theory.md,
!> section 17). A flight is the motion of a stop point (the point of the beam at a stop) from the opening of its contact
!> to the next closing, one or more phases. A massless node is the node at the stop of a redistributed mass matrix.
module contact_phase
   use certified_search, only: first_zero, found_never_positive, found_none, found_zero, search_t, &
      transformable_signal_t
   use contact_changes, only: end_starts, skip_blocked
   use contact_states, only: energy_in, set_indentation, record_start, node_motion_at, has_rigid_stop, &
      contact_state_t
   use coupled_modes, only: terms_at
   use damped_oscillators, only: modal_energy, next_sample
   use driven_signal, only: phasor_of
   use exponential_sums, only: exponential_sums_t
   use forced_responses, only: find_rows_at
   use history_list, only: acceleration_stop, acceleration_tip, eta_stop, eta_tip, force_stop, velocity_stop
   use kinds, only: wp
   use load_work, only: work_of_loads
   use moment_signals, only: begin_moments, sample_moments
   use motion_phases, only: found_segment_end, found_cancelled, motion_t
   use phase_intervals, only: phase_interval_t
   use phase_losses, only: advance_contact, find_losses, force_at, prepare_losses
   use phase_rows, only: can_search_rows, search_contacts
   use phase_searches, only: search_contact
   use phase_state, only: end_force, end_gap, to_free_state, cache_state, find_homogeneous_state, find_state, &
      phase_state_t, signal_of, start_phase, observed_gap
   use phase_sums, only: sample_accelerations
   use phase_transitions, only: project_gap
   use response_types, only: contact_record_t
   use run_observers, only: reads_losses, observe
   use run_recorder, only: requested_t, sample_t
   use section_states, only: motion_of, record_modes, state_at
   use section_types, only: section_state_t
   use set_motions, only: find_end_terms
   use stop_contacts, only: datum_of, force_on_point
   use tangent_events, only: begin_columns, end_columns, record_sizes
   implicit none (type, external)
   private
   public :: contact_phase_t

   !> A phase with any number of contacts, in closed form.
   type :: contact_phase_t
      !> Instant and outcome of the end of the phase. Outcomes: those of a search (`found_none`: the phase reaches the
      !> end of the run), and `found_cancelled` and `found_segment_end`
      type(search_t) :: search
      !> State of the present phase
      type(phase_state_t) :: now
      !> hbar/L, the factor from contact forces to Pbar, the force in the results
      real(wp) :: force_scale = 0.0_wp
      !> If the gap of a flight after a rebound stays below this value, the contact stays closed (capture)
      real(wp) :: hop_tolerance = 0.0_wp
      !> Index of the contact that ends the phase; 0: none
      integer :: ended_at = 0
      !> How this contact ends the phase: one of the `end_` constants
      integer :: ended_by = end_gap
      !> If the flight that ends at contact `ended_at` began with this phase: order of the first nonzero derivative of
      !> its gap; else 0
      integer :: start_order = 0
      !> Energy of the constrained modes at the start of the phase
      real(wp) :: start_energy = 0.0_wp
      !> Histories of each contact, [contacts]
      type(contact_record_t), allocatable :: records(:)
      !> Number of samples recorded in the histories
      integer :: recorded = 0
      !> Accelerations at the contacts and of the tip in the present phase; unallocated: not requested yet
      type(exponential_sums_t), allocatable :: accelerations
      !> The phase as an interval that observers can evaluate
      type(phase_interval_t) :: interval
      !> On entry state from which the run continues, if `q` is allocated; on return state at the end of the run.
      !> Unallocated: the run neither continues another run nor is continued
      type(section_state_t), allocatable :: carried
   contains
      procedure :: begin
      procedure :: find_end
      procedure :: evaluate_free_modes
      procedure :: take_sample
      procedure :: finish
      procedure :: measure
   end type contact_phase_t

contains

   !> Start a phase from the present state of the motion.
   subroutine begin(self, motion)
      class(contact_phase_t), target, intent(inout) :: self
      type(motion_t), intent(inout) :: motion

      ! whether the run uses this set of closed contacts for the first time
      logical :: is_new

      call start_phase(self%now, motion%tau, motion%q, motion%v, is_new, motion%error)
      if (allocated(motion%error)) return
      if (is_new .and. any(self%now%states%is_closed)) motion%eigenproblems = motion%eigenproblems + 1
      if (allocated(motion%tangent)) call begin_columns(self%now, motion%tangent)
      ! variations are converted at the instant at which a contact becomes undeformed, so that this ends a phase
      self%now%passes_undeformed = .not. allocated(motion%tangent)
      self%now%needs_extremes = allocated(motion%observers%blocks)
      ! without loads, the terms exp(s t) alone give the dissipation
      if (self%now%loads%count == 0 .and. (motion%recorder%requested%energy .or. reads_losses(motion%observers))) then
         call prepare_losses(self%now%set, motion%recorder%requested%energy)
      end if
      if ((reads_losses(motion%observers) .or. self%now%loads%count > 0) .and. &
         .not. all(self%now%states%is_rigid)) call record_start(self%now%states, self%interval%at_start)
      self%interval%z_end => self%now%set%state(:, 3)
      self%interval%v_end => self%now%set%state(:, 4)
      if (needs_losses(self, motion)) then
         call find_state(self%now, 0.0_wp, self%interval%z_end, self%interval%v_end)
         self%start_energy = sum(modal_energy(self%now%set%constrained%oscillators, self%interval%z_end, &
            self%interval%v_end))
      end if
      if (allocated(self%accelerations)) deallocate (self%accelerations)
      ! the first sample comes from the closed form
      self%now%set%sampler%steps_since_renewal = huge(1)
      call begin_moments(self%interval%moments, self%now)
   end subroutine begin

   !> Find the end of the phase: the earliest end that a contact causes. A flight is cancelled if it began with this
   !> phase, its own contact ends the phase, and its gap stays below the hop tolerance.
   subroutine find_end(self, limit)
      class(contact_phase_t), intent(inout) :: self
      !> Time from the start of the phase to the end of the run
      real(wp), intent(in) :: limit

      type(search_t) :: search
      ! whether it is known already if and when each contact ends the phase, [contacts]
      logical :: is_decided(size(self%now%states))
      integer :: ended_by, i, k

      self%search = search_t(outcome=found_none, time=limit)
      if (self%now%max_length < limit) self%search = search_t(outcome=found_segment_end, time=self%now%max_length)
      self%ended_at = 0
      is_decided = .not. self%now%states%is_active
      call skip_blocked(self%now, limit, self%interval%searches, is_decided)
      if (can_search_rows(self%now)) then
         call search_contacts(self%now, (self%search%time), self%interval%searches, is_decided, self%ended_at, &
            self%ended_by, self%search%time)
         if (self%ended_at > 0) self%search%outcome = found_zero
         ! each evaluation computes the sums of all active contacts
         self%search%evaluations = self%now%path%evaluations*count(self%now%states%is_active)
      end if
      ! closed contacts first: the end of a short contact bounds the searches of gaps, which may oscillate as fast
      do i = 1, 2*size(self%now%states)
         k = modulo(i - 1, size(self%now%states)) + 1
         if (is_decided(k) .or. (self%now%states(k)%is_closed .neqv. i == k)) cycle
         call search_contact(self%now, k, self%search%time, search, ended_by)
         self%search%evaluations = self%search%evaluations + search%evaluations
         ! a zero found by the simultaneous search is retained unless this search finds an earlier zero
         if (self%ended_at /= k .or. search%outcome /= found_none) self%interval%searches(k) = search
         if (search%outcome == found_none) cycle
         self%ended_at = k
         self%ended_by = ended_by
         self%search%time = search%time
         self%search%outcome = search%outcome
      end do
      do k = 1, size(self%now%states)
         associate (state => self%now%states(k), search => self%interval%searches(k))
            if (.not. state%is_active .or. state%is_closed .or. state%hop_tolerance <= 0.0_wp) cycle
            ! a gap above the tolerance, evaluated within the phase, proves that the flight is no hop, an upper bound
            ! (`ceiling`) below the tolerance proves a hop; otherwise a search decides
            state%may_be_captured = state%may_be_captured .and. (search%max_value < state%hop_tolerance .or. &
               search%time > self%search%time)
            if (state%may_be_captured .and. .not. search%ceiling < state%hop_tolerance) call check_hop_height(self, k)
         end associate
      end do
      if (self%ended_at == 0) return
      self%search%max_value = self%interval%searches(self%ended_at)%max_value
      associate (state => self%now%states(self%ended_at))
         if (self%ended_by /= end_gap .or. all(self%search%outcome /= [found_zero, found_never_positive])) return
         if (.not. (state%hop_tolerance > 0.0_wp .and. state%may_be_captured .and. state%is_new_flight)) return
         self%search%outcome = found_cancelled
      end associate
   end subroutine find_end

   !> Set `may_be_captured`: the gap of the flight of contact k stays below the hop tolerance during the phase, up to
   !> the rounding error of the gap.
   subroutine check_hop_height(self, k)
      class(contact_phase_t), intent(inout) :: self
      integer, intent(in) :: k

      ! hop tolerance less the gap
      class(transformable_signal_t), allocatable :: margin
      class(transformable_signal_t), pointer :: gap
      ! result of the search for the zero of `margin`
      type(search_t) :: crossing
      ! rounding error of the gap
      real(wp) :: rounding

      associate (state => self%now%states(k), constrained => self%now%set%constrained)
         call signal_of(self%now, k, observed_gap, gap)
         rounding = 4.0_wp*epsilon(1.0_wp)*(abs(constrained%static_gap(k)) &
            + sum(abs(constrained%value(:, k)*self%now%z)))
         call gap%transform(0.0_wp, -1.0_wp, state%hop_tolerance + rounding, 0, margin)
         call first_zero(margin, self%search%time, crossing)
         state%may_be_captured = crossing%outcome == found_none
         self%search%evaluations = self%search%evaluations + crossing%evaluations
      end associate
   end subroutine check_hop_height

   !> State of the free modes at a time in the phase.
   subroutine evaluate_free_modes(self, time, q, v, node)
      class(contact_phase_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp), intent(out) :: q(:)
      real(wp), intent(out) :: v(:)
      !> Displacement and velocity of a massless node at the release contact, relative to the modes
      real(wp), intent(out) :: node(2)

      real(wp), dimension(size(self%now%z)) :: z, rate

      call find_state(self%now, time, z, rate)
      call to_free_state(self%now, z, rate, q, v)
      node = 0.0_wp
      if (self%now%release_contact == 0) return
      associate (state => self%now%states(self%now%release_contact), value => self%now%beam%value(:, &
         self%now%release_contact))
         if (state%is_node .and. state%is_closed) then
            node = [self%now%beam%height(self%now%release_contact) - sum(value*q), -sum(value*v)]
         else
            node = node_motion_at(state, time)
         end if
      end associate
   end subroutine evaluate_free_modes

   !> Compute the next sample, and record the histories of each contact.
   subroutine take_sample(self, time, step, requested, sample)
      class(contact_phase_t), intent(inout) :: self
      !> Time from the start of the phase
      real(wp), intent(in) :: time
      !> Interval of the samples
      real(wp), intent(in) :: step
      type(requested_t), intent(in) :: requested
      type(sample_t), intent(inout) :: sample

      ! displacements and velocities of the constrained modes with the load response, then without it, [modes, 4]
      real(wp) :: state(size(self%now%z), 4)
      ! values of the terms exp(s t) if a compliant contact is closed, [terms]
      complex(wp) :: term(merge(self%now%set%coupled%count, 0, size(self%now%set%compliant) > 0))
      ! gap of a contact and its rate; displacement and velocity of a massless node; force Pbar of each contact
      real(wp) :: gap, rate, node(2), force(size(self%records))
      integer :: k
      ! whether the contact is closed and rigid, so that gap and rate are zero
      logical :: is_constrained

      self%recorded = self%recorded + 1
      call sample_moments(self%interval%moments, time, sample)
      associate (now => self%now, set => self%now%set, constrained => self%now%set%constrained, &
         z => state(:, 1), v => state(:, 2), unforced => state(:, 3), unforced_rate => state(:, 4))
         if (size(set%compliant) > 0) then
            term = terms_at(set%coupled, now%amplitude, time)
            call find_homogeneous_state(now, time, unforced, unforced_rate)
         else
            call next_sample(set%sampler, constrained%oscillators, now%z, now%v, step, time)
            unforced = set%sampler%z
            unforced_rate = set%sampler%v
         end if
         z = unforced
         v = unforced_rate
         if (now%loads%count > 0) then
            call find_rows_at(set%forced, now%forced, 1, size(z), time, z, v)
            z = unforced + z
            v = unforced_rate + v
         end if
         force = 0.0_wp
         do k = 1, size(now%states)
            associate (record => self%records(k), sign => now%states(k)%contact%sign)
               node = node_motion_at(now%states(k), time)
               gap = constrained%static_gap(k) + sum(constrained%value(:, k)*z) + node(1)
               rate = sum(constrained%value(:, k)*v) + node(2)
               is_constrained = set%is_closed(k) .and. has_rigid_stop(now%states(k))
               ! gap and rate are exactly zero, not only to rounding
               gap = merge(0.0_wp, gap, is_constrained)
               rate = merge(0.0_wp, rate, is_constrained)
               if (allocated(record%eta)) record%eta(self%recorded) = sign*gap
               if (allocated(record%velocity)) record%velocity(self%recorded) = sign*rate
               if (requested%history(force_stop) .and. set%is_closed(k)) then
                  force(k) = self%force_scale*force_at(now, k, time, unforced, unforced_rate, term, rate)
                  record%force(self%recorded) = force(k)
               end if
               ! the histories of the run refer to the release contact: eta = 0 at its undeformed surface
               if (k /= now%release_contact) cycle
               sample%history([eta_stop, velocity_stop]) = sign*[gap, rate]
               sample%history(eta_tip) = (constrained%static_tip - datum_of(now%states(k)%contact)) &
                  + sum(constrained%tip_value*z)
               ! if the stop is at the tip, a massless node moves the tip, too
               if (abs(now%beam%tip_sign(k)) > 0.0_wp) sample%history(eta_tip) = merge(0.0_wp, &
                  sample%history(eta_tip) + sign*node(1), is_constrained)
            end associate
         end do
         if (now%release_contact == 0) then
            ! without a stop, all histories are those of the tip
            sample%history([eta_stop, eta_tip]) = constrained%static_tip + sum(constrained%tip_value*z)
            sample%history(velocity_stop) = sum(constrained%tip_value*v)
         end if
         associate (points => now%beam%displacement)
            if (size(points) > 0) sample%points = reshape([(motion_of(now, z, v, points(k)), &
               sum(force*force_on_point(now%states%contact, k)), k=1, size(points))], [3, size(points)])
         end associate
         sample%history(force_stop) = sum(force)
         if (any(requested%history([acceleration_stop, acceleration_tip]))) call sample_accelerations(now, &
            self%interval%moments, self%search%time, time, self%recorded, self%accelerations, self%records, sample)
         if (requested%energy) call sample_energy(self, time, state, term, sample)
      end associate
   end subroutine take_sample

   !> Energies of beam and stops at a sample, and energies dissipated up to the sample.
   subroutine sample_energy(self, time, modes, term, sample)
      class(contact_phase_t), intent(inout) :: self
      real(wp), intent(in) :: time
      !> State z, v with and without the load response, [modes, 4]
      real(wp), intent(in), contiguous :: modes(:, :)
      !> Values of the terms exp(s t) if a compliant contact is closed, [terms]
      complex(wp), intent(in) :: term(:)
      type(sample_t), intent(inout) :: sample

      ! states of the contacts at the time of the sample; unallocated: all contacts are rigid, and states are not needed
      type(contact_state_t), allocatable :: states(:)
      ! energy dissipated since the start of the phase: in the beam, then in each closed compliant contact
      real(wp) :: lost(1 + size(self%now%set%compliant))
      integer :: k

      associate (now => self%now, set => self%now%set, constrained => self%now%set%constrained)
         sample%beam_energy = modal_energy(constrained%oscillators, modes(:, 1), modes(:, 2))
         sample%stop_energy = 0.0_wp
         sample%work = work_of_loads(now, time, phasor_of(now%forced%frequency, time), modes(:, 3), modes(:, 4), term)
         if (all(now%states%is_rigid)) then
            call find_losses(self%now, self%interval%at_start, now%states, self%start_energy &
               - sum(sample%beam_energy) + sample%work, time, lost)
         else
            allocate (states, source=now%states)
            do k = 1, size(states)
               call advance_contact(now, k, time, modes(:, 1), term, states(k))
            end do
            call find_losses(self%now, self%interval%at_start, states, self%start_energy - sum(sample%beam_energy) &
               + sample%work, time, lost)
            states(set%compliant)%dissipated = states(set%compliant)%dissipated + lost(2:)
         end if
         sample%lost = [lost(1), 0.0_wp]
         sample%beam_energy(2) = sample%beam_energy(2) + constrained%static_energy
         do k = 1, size(now%states)
            if (now%states(k)%is_rigid) then
               if (allocated(self%records(k)%energy)) self%records(k)%dissipated(self%recorded) = &
                  now%states(k)%lost_at_impacts
               cycle
            end if
            if (states(k)%is_node) then
               sample%beam_energy(2) = sample%beam_energy(2) + energy_in(states(k))
               sample%lost(1) = sample%lost(1) + (states(k)%dissipated - now%states(k)%dissipated)
            else
               sample%stop_energy = sample%stop_energy + energy_in(states(k))
               sample%lost(2) = sample%lost(2) + (states(k)%dissipated - now%states(k)%dissipated)
            end if
            if (.not. allocated(self%records(k)%energy)) cycle
            self%records(k)%energy(self%recorded) = energy_in(states(k))
            self%records(k)%dissipated(self%recorded) = states(k)%dissipated + states(k)%lost_at_impacts
         end do
      end associate
   end subroutine sample_energy

   !> Advance variations, contacts, energy balance and state to the end of the phase.
   subroutine finish(self, motion)
      class(contact_phase_t), intent(inout) :: self
      type(motion_t), intent(inout) :: motion

      call end_variations(self, self%ended_at, motion)
      call evaluate_end(self, motion)
      where (self%now%undeformed_at <= self%search%time) self%now%states%is_deformed = .false.
      if (self%ended_at > 0) self%start_order = self%now%states(self%ended_at)%start_order
      self%now%states%is_new_flight = .false.
      if (self%ended_at > 0 .and. any(self%ended_by == [end_gap, end_force])) call project_gap(self%now, &
         self%ended_at, self%ended_by, self%interval%z_end, motion)
      if (.not. self%now%is_at_rest) call to_free_state(self%now, self%interval%z_end, self%interval%v_end, motion%q, &
         motion%v)
      call end_starts(self%now, self%ended_at, motion)
   end subroutine finish

   !> Advance the variations of the motion (derivatives with respect to its initial state or a load parameter) to the
   !> end of the phase, and record their sizes at the Poincare sections in the phase.
   subroutine end_variations(self, ended_at, motion)
      class(contact_phase_t), intent(inout) :: self
      !> Index of the contact that ends the phase; 0: none
      integer, intent(in) :: ended_at
      type(motion_t), intent(inout) :: motion

      if (.not. allocated(motion%tangent)) return
      if (allocated(motion%observers%sections)) call record_sizes(self%now, motion%tau, self%search%time, &
         motion%tangent, motion%observers%sections)
      call end_columns(self%now, ended_at, self%ended_by, self%search, motion%tangent)
   end subroutine end_variations

   !> Evaluate the end of the phase: set `z_end` and `v_end`, and advance the contacts and the energy balance.
   subroutine evaluate_end(self, motion)
      class(contact_phase_t), intent(inout) :: self
      type(motion_t), intent(inout) :: motion

      ! energy dissipated in the beam, then in each closed compliant contact, [1 + compliant]
      real(wp) :: lost(1 + size(self%now%set%compliant))
      ! work of the loads
      real(wp) :: work
      ! values of the terms exp(s t) at the end, [terms]
      complex(wp) :: term(self%now%set%coupled%count)
      ! exp(i w t) of the load frequencies w at the end, [harmonics]
      complex(wp) :: phasor(size(self%now%forced%frequency))
      integer :: k, place

      associate (now => self%now, set => self%now%set, constrained => self%now%set%constrained, &
         time => self%search%time, balance => motion%recorder%energy_balance)
         phasor = phasor_of(now%forced%frequency, time)
         if (size(set%compliant) > 0) call find_end_terms(set, now%amplitude, time, term)
         ! the state is cached, because observers request the state at the end of the phase again
         call cache_state(now, time, term)
         self%interval%z_end(:) = set%last%z
         self%interval%v_end(:) = set%last%v
         if (now%loads%count > 0) call find_state(now, time, self%interval%z_end, self%interval%v_end, phasor)
         do k = 1, size(now%states)
            call advance_contact(now, k, time, self%interval%z_end, term, now%states(k))
         end do
         if (needs_losses(self, motion) .or. motion%observers%measures%is_wanted) then
            work = work_of_loads(now, time, phasor, set%last%z, set%last%v, term)
            balance%work = balance%work + work
         end if
         if (needs_losses(self, motion)) then
            call find_losses(self%now, self%interval%at_start, now%states, self%start_energy &
               - sum(modal_energy(constrained%oscillators, self%interval%z_end, self%interval%v_end)) + work, time, &
               lost)
            balance%dissipated_beam = balance%dissipated_beam + lost(1)
         end if
         do place = 1, size(set%compliant)
            associate (state => now%states(set%compliant(place)))
               if (state%is_rigid) cycle
               if (needs_losses(self, motion)) state%dissipated = state%dissipated + lost(1 + place)
               ! the force vanishes: the branch force follows from the indentation
               if (self%ended_at == set%compliant(place)) call set_indentation(state, state%indentation)
            end associate
         end do
         balance%dissipated_stop = sum(now%states%dissipated, mask=.not. now%states%is_node)
         ! a massless node belongs to the beam
         balance%dissipated_beam = balance%dissipated_beam + sum(now%states%dissipated, mask=now%states%is_node)
         where (now%states%is_node) now%states%dissipated = 0.0_wp
      end associate
   end subroutine evaluate_end

   !> Whether dissipation is computed in this phase. Measures alone require dissipation only if a compliant contact is
   !> closed.
   pure logical function needs_losses(self, motion) result(needs)
      class(contact_phase_t), intent(in) :: self
      type(motion_t), intent(in) :: motion

      needs = size(self%now%set%compliant) > 0 .and. reads_losses(motion%observers)
      needs = needs .or. motion%recorder%requested%energy
   end function needs_losses

   !> Let the observers measure the phase.
   subroutine measure(self, is_last, motion)
      class(contact_phase_t), target, intent(inout) :: self
      !> Whether the run ends with this phase
      logical, intent(in) :: is_last
      type(motion_t), intent(inout) :: motion

      ! number of sections recorded before this phase
      integer :: recorded

      associate (interval => self%interval, observers => motion%observers)
         if (is_last) call end_variations(self, 0, motion)
         if (is_last .and. allocated(self%carried)) call state_at(self%now, motion%tau, self%search%time, self%carried)
         if (is_last .and. observers%measures%is_wanted) then
            self%ended_at = 0
            call evaluate_end(self, motion)
         end if
         interval%start = motion%tau
         interval%length = self%search%time
         interval%is_last = is_last
         ! an impact that replaces the nodal velocity alone may increase the energy
         interval%may_gain = allocated(self%now%beam%nodal_shape)
         interval%contacts = size(self%now%states)
         interval%others = size(self%now%beam%displacement)
         interval%now => self%now
         if (allocated(interval%moments%place)) interval%places = size(interval%moments%place)
         if (allocated(interval%sums)) deallocate (interval%sums)
         recorded = 0
         if (allocated(observers%sections)) recorded = observers%sections%count
         call observe(observers, interval)
         if (allocated(observers%sections)) call record_modes(self%now, motion%tau, self%search%time, recorded + 1, &
            observers%sections)
      end associate
   end subroutine measure

end module contact_phase
