!> Opening and closing of contacts during a motion, and the start of the flight that follows an opening: the motion of
!> a stop point (the point of the beam at a stop) while its contact is open.
module contact_changes
   use certified_search, only: found_none, search_t
   use contact_states, only: node_motion_at
   use contact_values, only: event_of, force_of, gap_of, gap_rounding, velocity_of, velocity_rounding
   use kinds, only: wp
   use motion_phases, only: motion_t
   use phase_state, only: phase_state_t
   use response_types, only: append_event, event_capture, event_contact, event_release, event_separation, &
      event_t, response_t
   implicit none (type, external)
   private
   public :: detach_contact, open_contact, start_flight, close_contact, check_dampers
   public :: end_starts, find_opposite_contacts, is_blocked, skip_blocked, close_opposite

contains

   !> Open a closed contact whose force has fallen to zero.
   subroutine detach_contact(self, k, motion, response)
      type(phase_state_t), intent(inout) :: self
      integer, intent(in) :: k
      type(motion_t), intent(in) :: motion
      type(response_t), intent(inout) :: response

      associate (state => self%states(k), velocity => velocity_of(self, k, motion))
         if (state%is_rigid) then
            ! the gap acceleration is zero while the contact is closed, and continuous because the force falls to zero:
            ! the third derivative of the gap is the first that is not zero
            call open_contact(self, k, 3, motion, response)
         else if (state%is_node) then
            ! the velocity of a damped massless node is continuous (order 2), that of an undamped node jumps to the
            ! velocity of the modes (order 1)
            call open_contact(self, k, merge(2, 1, state%spring%viscosity > 0.0_wp), motion, response)
         else
            call append_event(response, event_of(self, k, event_separation, motion, velocity, velocity))
            call start_flight(self, k, 1, 0.0_wp)
            state%is_deformed = state%moves_with_beam .and. state%indentation > 0.0_wp
         end if
      end associate
   end subroutine detach_contact

   !> Open a closed contact with a rigid stop: record the release, and start the flight.
   subroutine open_contact(self, k, order, motion, response)
      type(phase_state_t), intent(inout) :: self
      integer, intent(in) :: k
      !> Order of the first nonzero derivative of the gap
      integer, intent(in) :: order
      type(motion_t), intent(in) :: motion
      type(response_t), intent(inout) :: response

      call append_event(response, event_t(tau=motion%tau, kind=event_release, &
         contact=self%states(k)%contact%number))
      call start_flight(self, k, order, 0.0_wp)
   end subroutine open_contact

   !> Open a contact, from which the beam begins a flight.
   pure subroutine start_flight(self, k, order, hop_tolerance)
      type(phase_state_t), intent(inout) :: self
      integer, intent(in) :: k
      !> Order of the first nonzero derivative of the gap
      integer, intent(in) :: order
      !> If the gap of the flight stays below this value, the contact stays closed (capture); 0: not tested
      real(wp), intent(in) :: hop_tolerance

      associate (state => self%states(k))
         state%is_closed = .false.
         state%is_touched = .false.
         state%start_order = order
         state%hop_tolerance = hop_tolerance
         ! captures that each open another contact would cancel flights of each other without end
         state%is_new_flight = order == 1
         state%may_be_captured = .true.
         state%flights = state%flights + 1
      end associate
   end subroutine start_flight

   !> End the starts of flights at the end of a phase: `start_order` is reset, except at rigid contacts that the beam
   !> has left in a phase so short that the gap is still zero to rounding. Several contacts of a symmetric beam open in
   !> such phases, all at one instant but for rounding.
   subroutine end_starts(self, ended_at, motion)
      type(phase_state_t), intent(inout) :: self
      !> The contact that ended the phase; 0: none
      integer, intent(in) :: ended_at
      !> At the end of the phase
      type(motion_t), intent(in) :: motion

      integer :: k

      do k = 1, size(self%states)
         associate (state => self%states(k))
            if (state%start_order == 0) cycle
            if (k /= ended_at .and. state%is_rigid .and. .not. state%is_closed) then
               if (gap_of(self, k, motion%q) <= gap_rounding(self, k, motion) .and. &
                  .not. velocity_of(self, k, motion) < -velocity_rounding(self, k, motion)) cycle
            end if
            state%start_order = 0
         end associate
      end do
   end subroutine end_starts

   !> Close a compliant contact.
   subroutine close_contact(self, k, order, motion, response)
      type(phase_state_t), intent(inout) :: self
      integer, intent(in) :: k
      !> Order of the first nonzero derivative of the contact force, unless a damper makes the force jump
      integer, intent(in) :: order
      type(motion_t), intent(in) :: motion
      type(response_t), intent(inout) :: response

      type(event_t) :: event
      real(wp) :: node(2)

      associate (state => self%states(k), velocity => velocity_of(self, k, motion))
         ! an open stop with spring and damper that is not deformed has no indentation left
         if (state%moves_with_beam .and. .not. state%is_deformed) state%indentation = 0.0_wp
         if (state%is_node) then
            ! the massless node returns to the position given by the modes, without an impact because it has no mass
            node = node_motion_at(state, 0.0_wp)
            event = event_of(self, k, event_capture, motion, velocity + node(2), 0.0_wp)
            ! the gap is exactly zero, not only to rounding
            event%eta = 0.0_wp
            call append_event(response, event)
         else
            call append_event(response, event_of(self, k, event_contact, motion, velocity, velocity))
         end if
         state%is_closed = .true.
         state%is_touched = .false.
         state%is_deformed = .false.
         state%start_order = order
         if (state%spring%viscosity > 0.0_wp .and. force_of(self, k, motion) > 0.0_wp) state%start_order = 0
      end associate
   end subroutine close_contact

   !> Open or close each contact with a spring and damper according to the sign of its force: impulses change
   !> velocities, hence damper forces, abruptly. A touched contact (zero gap, zero force) closes if the beam approaches.
   subroutine check_dampers(self, motion, response)
      type(phase_state_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion
      type(response_t), intent(inout) :: response

      real(wp) :: force
      integer :: k

      do k = 1, size(self%states)
         associate (state => self%states(k))
            if (.not. state%moves_with_beam) cycle
            if (state%is_touched) then
               if (gap_of(self, k, motion%q) > gap_rounding(self, k, motion)) cycle
               if (velocity_of(self, k, motion) < -velocity_rounding(self, k, motion)) call close_contact(self, k, 1, &
                  motion, response)
            end if
            if (.not. (state%is_closed .or. state%is_deformed)) cycle
            force = force_of(self, k, motion)
            if (state%is_closed .and. force < 0.0_wp) then
               call detach_contact(self, k, motion, response)
               ! the force has jumped below zero: no derivative is needed to know its sign
               if (state%is_deformed) state%start_order = 0
            else if (state%is_deformed .and. force > 0.0_wp) then
               call close_contact(self, k, 1, motion, response)
            end if
         end associate
      end do
   end subroutine check_dampers

   !> Find the pairs of rigid contacts on opposite sides of one point of the beam. Active contacts must be known.
   pure subroutine find_opposite_contacts(self)
      type(phase_state_t), intent(inout) :: self

      ! clearance, in units of displacement, that is lost in the rounding of gaps
      real(wp), parameter :: rounding = 64.0_wp*epsilon(1.0_wp)
      integer :: j, k

      associate (states => self%states, height => self%beam%height)
         do k = 1, size(states)
            if (.not. (states(k)%is_active .and. states(k)%is_rigid)) cycle
            j = findloc(states%is_active .and. states%is_rigid .and. self%colocated == self%colocated(k) .and. &
               self%colocated_sign*self%colocated_sign(k) < 0.0_wp, .true., dim=1)
            states(k)%opposite = j
            if (j > 0) states(k)%has_no_clearance = -height(j) - height(k) <= rounding*max(1.0_wp, abs(height(k)))
         end do
      end associate
   end subroutine find_opposite_contacts

   !> Whether the contact has no clearance to the opposite contact, and the opposite contact is closed. The gap is then
   !> zero until the opposite contact opens.
   pure logical function is_blocked(self, k) result(answer)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k

      answer = self%states(k)%has_no_clearance
      if (answer) answer = self%states(self%states(k)%opposite)%is_closed
   end function is_blocked

   !> Whether closed rigid contacts fix the point of an open compliant contact, such as a body between the beam and its
   !> floor if a stop holds the beam. The gap is then constant: if it is zero, the signs of its rounding errors mean
   !> nothing.
   pure logical function is_fixed(self, k) result(answer)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k

      real(wp), parameter :: rounding = 64.0_wp*epsilon(1.0_wp)

      associate (state => self%states(k))
         answer = .not. (state%is_rigid .or. state%is_closed .or. state%is_deformed .or. state%indentation > 0.0_wp)
      end associate
      if (answer) answer = all(abs(self%set%constrained%value(:, k)) <= rounding*maxval(abs(self%beam%value(:, k))))
   end function is_fixed

   !> Leave contacts whose gaps do not change out of the search for the end of a phase.
   pure subroutine skip_blocked(self, limit, searches, is_decided)
      type(phase_state_t), intent(in) :: self
      !> Time from the start of the phase to the end of the run
      real(wp), intent(in) :: limit
      !> Receives the searches of these contacts, [contacts]
      type(search_t), intent(inout) :: searches(:)
      !> Whether a contact needs no search, [contacts]
      logical, intent(inout) :: is_decided(:)

      integer :: k

      do k = 1, size(is_decided)
         if (is_decided(k) .or. .not. (is_blocked(self, k) .or. is_fixed(self, k))) cycle
         is_decided(k) = .true.
         searches(k) = search_t(outcome=found_none, time=limit, ceiling=0.0_wp)
      end do
   end subroutine skip_blocked

   !> Close the rigid contact opposite to a contact that has opened, if no clearance is between both: the force on the
   !> beam changes its sign, and the beam does not move.
   subroutine close_opposite(self, k, motion, response)
      type(phase_state_t), intent(inout) :: self
      !> The contact that has opened
      integer, intent(in) :: k
      type(motion_t), intent(in) :: motion
      type(response_t), intent(inout) :: response

      if (.not. self%states(k)%has_no_clearance .or. self%states(k)%is_closed) return
      associate (other => self%states(k)%opposite)
         associate (state => self%states(other))
            if (state%is_closed) return
            state%is_closed = .true.
            state%is_deformed = .false.
            state%start_order = 0
         end associate
         call append_event(response, event_of(self, other, event_capture, motion, 0.0_wp, 0.0_wp))
      end associate
   end subroutine close_opposite

end module contact_changes
