!> Transitions between phases of exact motion (docs/theory.md, section 17): impacts, captures (a contact closes because
!> the flight after a rebound would stay below the hop tolerance), and opening and closing of contacts. A flight is the
!> motion of a stop point, the point of the beam at a stop, while its contact is open.
module phase_transitions
   use certified_search, only: found_never_positive, search_t
   use contact_changes, only: check_dampers, close_contact, close_opposite, detach_contact, is_blocked, open_contact, &
      start_flight
   use contact_impulses, only: arrest, bring_to_rest, capture_t, solve_impact
   use contact_measures, only: measure_impulse
   use contact_reactions, only: find_reactions, opening_orders, resolve_touched_contacts
   use contact_values, only: event_of, force_of, gap_of, gap_rounding, gap_to_undeformed, reaction_demand, &
      velocity_rounding, velocity_of
   use impact_problem, only: max_rounds
   use kinds, only: wp
   use motion_phases, only: found_segment_end, found_cancelled, motion_t
   use phase_state, only: end_force, end_gap, end_undeformed, end_renewed_contact, find_load, find_state, &
      phase_state_t, to_free_state
   use response_types, only: append_event, event_capture, event_t, response_t
   use run_recorder, only: charge_event
   use set_motions, only: point_response
   implicit none (type, external)
   private
   public :: apply_transition, begin_contacts_at_start, project_gap, update_contacts

   !> Time in 1/omega1 within which the ends of flights are simultaneous: flights of mirrored stops end at one instant
   !> but for rounding errors, and impacts one after the other would give other velocities.
   real(wp), parameter :: simultaneous = 1.0e-12_wp

contains

   !> Apply the transition at the end of a phase.
   subroutine apply_transition(self, k, ended_by, start_order, search, hop_tolerance, motion, response)
      type(phase_state_t), intent(inout) :: self
      !> Index of the contact that ended the phase
      integer, intent(in) :: k
      !> How the contact ended the phase: one of the `end_` constants
      integer, intent(in) :: ended_by
      !> If the flight that ends began with this phase: order of the first nonzero derivative of its gap; else 0
      integer, intent(in) :: start_order
      type(search_t), intent(in) :: search
      !> If the gap of a flight after a rebound stays below this value, the contact stays closed (capture)
      real(wp), intent(in) :: hop_tolerance
      type(motion_t), intent(inout) :: motion
      !> Receives the events
      type(response_t), intent(inout) :: response

      ! whether a flight from each contact has begun at this instant, before the transition
      logical :: has_begun(size(self%states))
      integer :: i

      if (search%outcome == found_segment_end) then
         call update_contacts(self, motion, response)
         return
      end if
      has_begun = self%states%start_order > 1 .and. self%states%is_rigid .and. .not. self%states%is_closed
      call apply_contact_end(self, k, ended_by, start_order, search, hop_tolerance, motion, response)
      do i = 1, size(has_begun)
         if (.not. has_begun(i) .or. self%states(i)%is_closed) cycle
         ! an impulse has given the stop point a velocity
         if (velocity_of(self, i, motion) > velocity_rounding(self, i, motion)) self%states(i)%start_order = 1
      end do
      if (self%loads%count > 0 .and. .not. motion%tau < self%forced%until) then
         ! the loads change at the same instant
         call update_contacts(self, motion, response)
      else
         call resolve_touched_contacts(self, motion, response)
      end if
   end subroutine apply_transition

   !> Apply the transition at a contact that ended a phase.
   subroutine apply_contact_end(self, k, ended_by, start_order, search, hop_tolerance, motion, response)
      type(phase_state_t), intent(inout) :: self
      !> Index of the contact that ended the phase
      integer, intent(in) :: k
      !> How the contact ended the phase: one of the `end_` constants
      integer, intent(in) :: ended_by
      !> If the flight that ends began with this phase: order of the first nonzero derivative of its gap; else 0
      integer, intent(in) :: start_order
      type(search_t), intent(in) :: search
      !> If the gap of a flight after a rebound stays below this value, the contact stays closed (capture)
      real(wp), intent(in) :: hop_tolerance
      type(motion_t), intent(inout) :: motion
      !> Receives the events
      type(response_t), intent(inout) :: response

      type(capture_t) :: captures(size(self%states))

      associate (state => self%states(k))
         select case (ended_by)
         case (end_force)
            call detach_contact(self, k, motion, response)
            call close_opposite(self, k, motion, response)
         case (end_undeformed)
            state%is_deformed = .false.
            state%indentation = 0.0_wp
            state%start_order = 1
         case (end_renewed_contact)
            call close_contact(self, k, 1, motion, response)
         case default
            if (.not. state%is_rigid) then
               call close_compliant(self, k, search, motion, response)
               ! the force of a damper has jumped, and with it the reactions of closed rigid contacts
               if (state%is_closed .and. state%start_order == 0) call update_rigid_contacts(self, captures, motion, &
                  response)
               return
            end if
            ! the gap of the flight that ends did not exceed rounding, or did not exceed the hop tolerance; a change of
            ! a load just before an impact begins a phase without a positive gap, but not the flight
            captures(k)%is_captured = search%outcome == found_cancelled .or. (search%outcome == found_never_positive &
               .and. (start_order > 0 .or. .not. velocity_of(self, k, motion) < -velocity_rounding(self, k, motion))) &
               .or. (state%hop_tolerance > 0.0_wp .and. state%may_be_captured .and. start_order < 2)
            ! after a flight from rest that never exceeded rounding, the contact force is taken as positive
            captures(k)%has_reaction = search%outcome == found_never_positive .and. start_order > 1
            if (search%outcome == found_cancelled .or. (search%outcome == found_never_positive .and. &
               velocity_of(self, k, motion) > 0.0_wp)) then
               call bring_to_rest(self, cancelled_flights(self, k, search, motion%tau), captures, motion, response)
               call check_dampers(self, motion, response)
               call update_rigid_contacts(self, captures, motion, response)
            else
               call apply_impacts(self, k, hop_tolerance, captures, motion, response)
            end if
         end select
      end associate
   end subroutine apply_contact_end

   !> Contacts whose flights are cancelled with that of contact k: these flights began with that of contact k, are as
   !> low, and end at the same instant. Contact k is the first of them.
   pure function cancelled_flights(self, k, search, tau) result(flights)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      !> Search for the end of the phase
      type(search_t), intent(in) :: search
      !> Start of the phase
      real(wp), intent(in) :: tau
      integer, allocatable :: flights(:)

      ! displacements of the constrained modes at the end of the flight
      real(wp) :: z(size(self%z))
      ! velocities of the constrained modes at the end of the flight
      real(wp) :: rate(size(self%z))
      ! displacements of the free modes at the end of the flight
      real(wp) :: q(size(self%beam%value, 1))
      ! velocities of the free modes at the end of the flight
      real(wp) :: v(size(self%beam%value, 1))
      ! rounding error of time
      real(wp) :: tau_rounding
      integer :: j

      flights = [k]
      if (search%outcome /= found_cancelled .or. size(self%states) == 1) return
      call find_state(self, search%time, z, rate)
      call to_free_state(self, z, rate, q, v)
      tau_rounding = max(simultaneous, 4.0_wp*epsilon(1.0_wp)*(tau + search%time))
      do j = 1, size(self%states)
         associate (state => self%states(j), value => self%beam%value(:, j))
            if (j == k .or. .not. (state%is_active .and. state%is_rigid .and. state%hop_tolerance > 0.0_wp)) cycle
            if (state%is_closed .or. .not. (state%is_new_flight .and. state%may_be_captured)) cycle
            if (gap_to_undeformed(self, j, q) <= tau_rounding*max(-sum(value*v), 0.0_wp) + 4.0_wp*epsilon(1.0_wp) &
               *(abs(self%beam%height(j)) + sum(abs(value*q)))) flights = [flights, j]
         end associate
      end do
   end function cancelled_flights

   !> Update the closed contacts after a change of load segment, or at the start of a continued motion.
   subroutine update_contacts(self, motion, response)
      type(phase_state_t), intent(inout) :: self
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      type(capture_t) :: captures(size(self%states))
      integer :: k

      ! a flight whose gap is still zero to rounding has begun for other loads: without a velocity, it is decided anew
      do k = 1, size(self%states)
         associate (state => self%states(k))
            if (.not. (state%is_active .and. state%is_rigid) .or. state%is_closed .or. state%start_order < 2) cycle
            captures(k)%is_captured = .not. velocity_of(self, k, motion) > velocity_rounding(self, k, motion)
            if (.not. captures(k)%is_captured) state%start_order = 1
         end associate
      end do
      call check_dampers(self, motion, response)
      call update_rigid_contacts(self, captures, motion, response)
      call resolve_touched_contacts(self, motion, response)
   end subroutine update_contacts

   !> Find the contacts that are closed, touched or hit at the start of a run.
   subroutine begin_contacts_at_start(self, hop_tolerance, motion, response)
      type(phase_state_t), intent(inout) :: self
      !> If the gap of a flight after a rebound stays below this value, the contact stays closed (capture)
      real(wp), intent(in) :: hop_tolerance
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      type(capture_t) :: captures(size(self%states))
      ! the last rigid contact that the beam hits; 0: there is none. `apply_impacts` finds the others
      integer :: hit
      integer :: k

      hit = 0
      do k = 1, size(self%states)
         if (.not. self%states(k)%is_active) cycle
         if (self%states(k)%is_deformed) then
            ! here `is_deformed` means that the contact has a force in the initial static equilibrium, in which bodies
            ! may start with velocities
            if (.not. self%states(k)%is_rigid) then
               ! the velocity of a body makes the force of a damper negative: the contact begins open, with its
               ! indentation, as after a separation
               if (self%states(k)%moves_with_beam .and. force_of(self, k, motion) < 0.0_wp) cycle
               call close_contact(self, k, 0, motion, response)
               cycle
            end if
            self%states(k)%is_deformed = .false.
            captures(k)%is_captured = abs(velocity_of(self, k, motion)) <= velocity_rounding(self, k, motion)
            if (captures(k)%is_captured) cycle
         end if
         if (gap_of(self, k, motion%q) > gap_rounding(self, k, motion)) cycle
         associate (state => self%states(k), velocity => velocity_of(self, k, motion))
            if (abs(velocity) > velocity_rounding(self, k, motion)) then
               state%start_order = 1
               ! an impulse at this instant may reverse the velocity
               state%is_touched = velocity > 0.0_wp .and. .not. state%is_rigid
               if (velocity > 0.0_wp) cycle
               if (state%is_rigid) hit = k
               if (.not. state%is_rigid) call close_contact(self, k, 1, motion, response)
               cycle
            end if
            captures(k)%is_captured = state%is_rigid
            state%is_touched = .not. state%is_rigid
         end associate
      end do
      if (hit > 0) then
         call apply_impacts(self, hit, hop_tolerance, captures, motion, response)
      else
         call update_rigid_contacts(self, captures, motion, response)
      end if
      call resolve_touched_contacts(self, motion, response)
   end subroutine begin_contacts_at_start

   !> Close a compliant contact whose gap has fallen to zero.
   subroutine close_compliant(self, k, search, motion, response)
      type(phase_state_t), intent(inout) :: self
      integer, intent(in) :: k
      type(search_t), intent(in) :: search
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      ! gap velocity of the recovering surface
      real(wp) :: surface_speed
      ! velocity of the stop point relative to the surface
      real(wp) :: excess_speed
      real(wp) :: impulse(1)
      integer :: order

      order = 1
      if (search%outcome == found_never_positive .and. .not. self%states(k)%is_node) then
         if (self%loads%count > 0) call find_load(self, motion%tau)
         associate (state => self%states(k))
            ! after a flight below rounding, a stop point that is not slower than the recovering surface gets the
            ! velocity of the surface
            surface_speed = 0.0_wp
            if (.not. state%moves_with_beam) surface_speed = state%spring%recovery_rate*state%indentation
            if (.not. abs(velocity_of(self, k, motion)) < surface_speed) then
               order = 2
               excess_speed = velocity_of(self, k, motion) - surface_speed
               call arrest(self, [k], [excess_speed], motion, response, impulse)
               ! impulse*surface_speed is negligible: either `excess_speed` is a rounding error, or both speeds are as
               ! small as the flight is low
               call charge_event(motion%recorder%energy_balance, 0.5_wp*impulse(1)*excess_speed)
               ! the recovering surface (du/dtau = -rate u) is decelerated by rate times `surface_speed`; a stop point
               ! that is decelerated no more than the surface leaves the surface
               if (.not. reaction_demand(self, k, motion) > state%spring%recovery_rate*surface_speed) then
                  call start_flight(self, k, 2, 0.0_wp)
                  ! a deceleration of zero but for rounding decides nothing; `resolve_touched_contacts` reads its rate
                  state%is_touched = .not. surface_speed > 0.0_wp
                  return
               end if
            end if
         end associate
      end if
      call close_contact(self, k, order, motion, response)
   end subroutine close_compliant

   !> Apply the impulses of one instant: Newton's impact law as a complementarity problem over the rigid contact that is
   !> hit, closed rigid contacts, and open rigid contacts with zero gap at which the beam does not separate. If the
   !> impulses reverse the separating velocity at a further contact, that contact is hit in the next problem.
   subroutine apply_impacts(self, first, hop_tolerance, captures, motion, response)
      type(phase_state_t), intent(inout) :: self
      !> The contact that is hit
      integer, intent(in) :: first
      !> If the gap of a flight after a rebound stays below this value, the contact stays closed (capture)
      real(wp), intent(in) :: hop_tolerance
      !> On entry, contacts without rebound; on return, all contacts at which the stop point is brought to rest
      type(capture_t), intent(inout) :: captures(:)
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      ! rigid contacts with zero gap
      logical :: reached(size(self%states))
      ! reached contacts whose flights have been low, so that the beam does not rebound from them
      logical :: is_low(size(self%states))
      real(wp) :: velocity
      ! contact that is hit in the next problem; 0: there is none
      integer :: next
      integer :: k, round

      is_low = .false.
      do k = 1, size(self%states)
         reached(k) = self%states(k)%is_active .and. self%states(k)%is_rigid
         if (.not. reached(k) .or. k == first .or. self%states(k)%is_closed) cycle
         velocity = velocity_of(self, k, motion)
         reached(k) = gap_of(self, k, motion%q) <= gap_rounding(self, k, motion) + simultaneous*max(-velocity, 0.0_wp)
         ! a low flight that other events interrupted is captured, as that of the contact that is hit
         is_low(k) = reached(k) .and. self%states(k)%may_be_captured .and. self%states(k)%hop_tolerance > 0.0_wp
         captures(k)%is_captured = captures(k)%is_captured .or. (is_low(k) .and. &
            velocity < -velocity_rounding(self, k, motion))
      end do
      next = first
      do round = 1, max_rounds
         ! no rebound in the last permitted problem
         if (round == max_rounds) captures%is_captured = captures%is_captured .or. (reached .and. &
            .not. self%states%is_closed)
         call solve_impact(self, reached, next, hop_tolerance, captures, motion, response)
         if (count(reached) == 1) exit
         next = 0
         do k = 1, size(reached)
            if (.not. reached(k) .or. captures(k)%is_captured .or. self%states(k)%is_closed) cycle
            if (is_blocked(self, k)) cycle
            velocity = velocity_of(self, k, motion)
            if (velocity < 0.0_wp) then
               if (velocity < -velocity_rounding(self, k, motion)) next = k
            end if
         end do
         if (next == 0) exit
         captures(next)%is_captured = is_low(next)
      end do
      call check_dampers(self, motion, response)
      call update_rigid_contacts(self, captures, motion, response)
   end subroutine apply_impacts

   !> Decide which rigid contacts with zero gap and velocity stay closed: complementarity of reactions and
   !> accelerations, or of their rates if both vanish. The forces of dampers must be known (`check_dampers`): they
   !> depend on velocities alone, and the reactions depend on them.
   subroutine update_rigid_contacts(self, captures, motion, response)
      type(phase_state_t), intent(inout) :: self
      !> Captures at this instant; closed rigid contacts take part as well
      type(capture_t), intent(in) :: captures(:)
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      ! contacts that may stay closed
      integer, dimension(size(self%states)) :: candidates
      ! order of the first positive derivative of the gap of each candidate; 0: the contact stays closed
      integer, dimension(size(self%states)) :: orders
      ! that of the flight that ends
      real(wp) :: hop_tolerance
      type(event_t) :: event
      integer :: a, k, n

      n = 0
      do k = 1, size(self%states)
         if (.not. (captures(k)%is_captured .or. (self%states(k)%is_rigid .and. self%states(k)%is_closed))) cycle
         n = n + 1
         candidates(n) = k
      end do
      if (n == 0) return
      if (self%loads%count > 0) call find_load(self, motion%tau)
      call find_reactions(self, candidates(:n), motion)
      orders(:n) = opening_orders(self, motion)
      ! a contact whose opposite contact bears the force opens, with the slowest of the opening motions
      do a = 1, n
         if (orders(a) == 0 .and. bears_nothing(a)) orders(a) = 3
      end do
      do a = 1, n
         k = candidates(a)
         associate (state => self%states(k), order => orders(a))
            if (captures(k)%has_reaction) order = 0
            if (captures(k)%is_captured) then
               hop_tolerance = state%hop_tolerance
               state%is_closed = order == 0
               state%is_deformed = .false.
               state%start_order = 0
               ! a contact that opens at once after no impulse was not captured
               if (state%is_closed .or. abs(captures(k)%velocity) > 0.0_wp .or. captures(k)%impulse > 0.0_wp) then
                  event = event_of(self, k, event_capture, motion, captures(k)%velocity, 0.0_wp)
                  event%impulse = captures(k)%impulse
                  event%energy_change = captures(k)%energy_change
                  call append_event(response, event)
                  call measure_impulse(motion%observers%measures, k, motion%tau, captures(k)%impulse)
                  if (order > 0) call open_contact(self, k, order, motion, response)
               end if
               ! two contacts between which the beam bounces ever faster capture it together
               if (order > 0) call start_flight(self, k, order, hop_tolerance)
            else if (order > 0) then
               call open_contact(self, k, order, motion, response)
            end if
         end associate
      end do
      do a = 1, n
         if (orders(a) > 0) call close_opposite(self, candidates(a), motion, response)
      end do

   contains

      !> Whether the opposite contact at the same point, which stays closed as well, bears the force that both could
      !> bear. Two constraints at one point would be redundant.
      pure logical function bears_nothing(a) result(answer)
         !> Index among the candidates
         integer, intent(in) :: a

         integer :: b

         answer = .false.
         if (captures(candidates(a))%has_reaction) return
         b = findloc(candidates(:n), self%states(candidates(a))%opposite, dim=1)
         if (b == 0) return
         if (orders(b) > 0) return
         associate (force => self%reactions%force)
            answer = captures(candidates(b))%has_reaction .or. force(b) > force(a) .or. &
               (.not. force(a) > force(b) .and. b < a)
         end associate
      end function bears_nothing
   end subroutine update_rigid_contacts

   !> Correct rounding errors of the gap at the contact that ends the phase. A rigid contact that the beam penetrates
   !> gets gap zero; a stop point that leaves a compliant contact gets the displacement of the contact surface. The
   !> correction has the static shape of a force at the contact, because this shape needs the minimum strain energy. At
   !> a rigid contact, the work of this force is charged to the energy balance of the run.
   subroutine project_gap(self, k, ended_by, z, motion)
      type(phase_state_t), intent(in) :: self
      !> Index of the contact that ends the phase
      integer, intent(in) :: k
      !> How the contact ends the phase: one of the `end_` constants
      integer, intent(in) :: ended_by
      !> Displacements of the constrained modes at the end of the phase, [modes]
      real(wp), intent(inout) :: z(:)
      type(motion_t), intent(inout) :: motion

      ! smaller penetrations of a rigid contact, in eta, are not corrected
      real(wp), parameter :: min_correction = 5.0e-12_wp
      ! displacement of the stop point
      real(wp) :: displacement
      ! correction of this displacement
      real(wp) :: correction
      ! force that causes the correction
      real(wp) :: force

      associate (constrained => self%set%constrained, state => self%states(k))
         if (state%is_rigid .neqv. ended_by == end_gap) return
         displacement = sum(constrained%value(:, k)*z)
         ! afterwards the gap `displacement` + `static_gap` is minus the indentation, 0 at a rigid contact
         correction = -state%indentation - constrained%static_gap(k) - displacement
         if (state%is_rigid .and. correction < min_correction) return
         associate (shape => point_response(self%set, k, constrained%oscillators%square))
            force = correction/sum(constrained%value(:, k)*shape)
            ! the force is the change of the modal forces K z: change of the strain energy z.K z/2
            if (state%is_rigid) call charge_event(motion%recorder%energy_balance, force*(displacement &
               + 0.5_wp*correction))
            z = z + shape*force
         end associate
      end associate
   end subroutine project_gap

end module phase_transitions
