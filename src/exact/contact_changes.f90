!> A surface that closes or opens during a motion, and how the flight that follows begins.
module contact_changes
   use kinds, only: wp
   use motion_phases, only: motion_t
   use phase_state, only: phase_state_t
   use response_types, only: append_event, event_capture, event_contact, event_release, event_separation, &
      event_t, response_t
   use contact_states, only: node_at
   use contact_values, only: event_of, force_of, velocity_of
   implicit none (type, external)
   private
   public :: let_go, open_contact, start_flight, close_contact, check_dampers

contains

   !> A closed surface whose force has vanished.
   subroutine let_go(self, k, motion, response)
      type(phase_state_t), intent(inout) :: self
      integer, intent(in) :: k
      type(motion_t), intent(in) :: motion
      type(response_t), intent(inout) :: response

      associate (state => self%states(k), velocity => velocity_of(self, k, motion))
         if (state%is_rigid) then
            call open_contact(self, k, 3, motion, response)
         else if (state%is_node) then
            ! its own damping lets the node go smoothly, without it the node leaves at the modes' velocity
            call open_contact(self, k, merge(2, 1, state%spring%viscosity > 0.0_wp), motion, response)
         else
            call append_event(response, event_of(self, k, event_separation, motion, velocity, velocity))
            call start_flight(self, k, 1, 0.0_wp)
            state%is_deformed = state%relaxes .and. state%depth > 0.0_wp
         end if
      end associate
   end subroutine let_go

   !> A rigid surface lets the beam go.
   subroutine open_contact(self, k, order, motion, response)
      type(phase_state_t), intent(inout) :: self
      integer, intent(in) :: k
      !> Of the first derivative of the gap that does not vanish
      integer, intent(in) :: order
      type(motion_t), intent(in) :: motion
      type(response_t), intent(inout) :: response

      call append_event(response, event_t(tau=motion%tau, kind=event_release, &
         contact=self%states(k)%contact%number))
      call start_flight(self, k, order, 0.0_wp)
   end subroutine open_contact

   !> The beam leaves a surface.
   pure subroutine start_flight(self, k, order, hop_tolerance)
      type(phase_state_t), intent(inout) :: self
      integer, intent(in) :: k
      !> Of the first derivative of the gap that does not vanish
      integer, intent(in) :: order
      !> If it stays below this it is a capture; 0: it is not asked
      real(wp), intent(in) :: hop_tolerance

      associate (state => self%states(k))
         state%is_closed = .false.
         state%is_touched = .false.
         state%start_order = order
         state%hop_tolerance = hop_tolerance
         state%is_new_flight = .true.
         state%is_low = .true.
         state%flights = state%flights + 1
      end associate
   end subroutine start_flight

   !> Contact with a surface that yields begins.
   subroutine close_contact(self, k, order, motion, response)
      type(phase_state_t), intent(inout) :: self
      integer, intent(in) :: k
      !> Of the first derivative of its force that does not vanish, where that is not a damper's
      integer, intent(in) :: order
      type(motion_t), intent(in) :: motion
      type(response_t), intent(inout) :: response

      type(event_t) :: event
      real(wp) :: node(2)

      associate (state => self%states(k), velocity => velocity_of(self, k, motion))
         if (state%relaxes .and. .not. state%is_deformed) state%depth = 0.0_wp
         if (state%is_node) then
            ! it comes back to the modes, and is held at once: without mass there is no impact
            node = node_at(state, 0.0_wp)
            event = event_of(self, k, event_capture, motion, velocity + node(2), 0.0_wp)
            ! exactly, not to rounding
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

   !> Impulses make the forces of dampers jump: is each spring with a damper pressed now, or left?
   subroutine check_dampers(self, motion, response)
      type(phase_state_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion
      type(response_t), intent(inout) :: response

      real(wp) :: force
      integer :: k

      do k = 1, size(self%states)
         associate (state => self%states(k))
            if (.not. (state%relaxes .and. (state%is_closed .or. state%is_deformed))) cycle
            force = force_of(self, k, motion)
            if (state%is_closed .and. force < 0.0_wp) then
               call let_go(self, k, motion, response)
               if (state%is_deformed) state%start_order = 0
            else if (state%is_deformed .and. force > 0.0_wp) then
               call close_contact(self, k, 1, motion, response)
            end if
         end associate
      end do
   end subroutine check_dampers

end module contact_changes
