!> Impulses on a beam in its free modes at one instant (docs/theory.md, section 17): solutions of an impact problem,
!> which is Newton's impact law as a complementarity problem over the rigid contacts with zero gap, and impulses that
!> bring a stop point (the point of the beam at a stop) to rest.
module contact_impulses
   use complementarity, only: solve_active
   use contact_changes, only: is_blocked, start_flight
   use contact_measures, only: measure_impulse
   use contact_values, only: modal_product, event_of, velocity_rounding, velocity_of
   use impact_problem, only: comes_to_rest, find_impulses, find_nodal_impulse, stays_closed, is_hit, gets_impulse, &
      is_released, outcome_of, rebounds, impact_contact_t, add_impact_contact
   use kinds, only: wp
   use motion_phases, only: motion_t
   use phase_state, only: phase_state_t
   use response_types, only: append_event, event_closed_impulse, event_impact, event_release, event_t, response_t
   use run_recorder, only: charge_event
   use tangent_columns, only: reflect_columns
   implicit none (type, external)
   private
   public :: capture_t, solve_impact, bring_to_rest, arrest

   !> Capture at a rigid contact: the stop point is brought to rest without a further rebound.
   type :: capture_t
      !> Whether there is a capture at this contact
      logical :: is_captured = .false.
      !> Whether the contact force after the capture is known to be positive: the contact stays closed
      logical :: has_reaction = .false.
      !> Velocity of the stop point before the capture, positive away from the contact
      real(wp) :: velocity = 0.0_wp
      !> Impulse on the beam, positive away from the contact
      real(wp) :: impulse = 0.0_wp
      !> Change of the energy of the beam by the impulse
      real(wp) :: energy_change = 0.0_wp
   end type capture_t

contains

   !> Bring the stop points to rest at the start of flights that were too low to resolve and are cancelled.
   subroutine bring_to_rest(self, flights, captures, motion, response)
      type(phase_state_t), intent(inout) :: self
      !> Contacts whose flights are cancelled
      integer, intent(in) :: flights(:)
      type(capture_t), intent(inout) :: captures(:)
      type(motion_t), intent(inout) :: motion
      !> Receives the events of the impulses
      type(response_t), intent(inout) :: response

      real(wp) :: velocity(size(flights)), impulse(size(flights))
      integer :: i

      velocity = [(velocity_of(self, flights(i), motion), i=1, size(flights))]
      call arrest(self, flights, velocity, motion, response, impulse)
      ! one of several contacts may gain energy from the others, for example if a body is between both
      call charge_event(motion%recorder%energy_balance, 0.5_wp*sum(impulse*velocity))
      do i = 1, size(flights)
         associate (capture => captures(flights(i)), state => self%states(flights(i)))
            capture%is_captured = .true.
            capture%velocity = velocity(i)
            capture%impulse = impulse(i)
            capture%energy_change = 0.5_wp*impulse(i)*velocity(i)
            state%lost_at_impacts = state%lost_at_impacts - capture%energy_change
         end associate
      end do
   end subroutine bring_to_rest

   !> Reduce the velocities of stop points by given amounts, by impulses at these points. The closed rigid contacts keep
   !> their velocity of zero, each by its own impulse.
   subroutine arrest(self, points, velocity, motion, response, impulse)
      type(phase_state_t), intent(inout) :: self
      !> Contacts of these stop points, none of them closed and rigid
      integer, intent(in) :: points(:)
      !> Amounts by which the velocities are reduced, positive away from the contacts, [points]
      real(wp), intent(in) :: velocity(:)
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response
      !> Impulses at the stop points, positive away from their contacts, [points]
      real(wp), intent(out) :: impulse(:)

      integer :: arrested(size(points) + count(self%states%is_rigid .and. self%states%is_closed)), i, j
      real(wp) :: value(size(motion%v), size(arrested)), mobility(size(arrested), size(arrested))
      real(wp), dimension(size(arrested)) :: reduction, impulses
      logical :: is_active(size(arrested))
      type(event_t) :: event

      ! an explicit loop, because `pack` would allocate temporary arrays
      j = size(points)
      arrested(:j) = points
      do i = 1, size(self%states)
         if (.not. (self%states(i)%is_rigid .and. self%states(i)%is_closed)) cycle
         j = j + 1
         arrested(j) = i
      end do
      value = self%beam%value(:, arrested)
      reduction = 0.0_wp
      is_active = .true.
      ! variations lose their whole velocities at these contacts: `reduction`, still zero, serves as restitution
      if (allocated(motion%tangent)) call reflect_columns(value, reduction, is_active, motion%tangent)
      reduction(:size(points)) = velocity
      do j = 1, size(arrested)
         mobility(:, j) = [(sum(value(:, i)*value(:, j)), i=1, size(arrested))]
      end do
      call solve_active(mobility, reduction, is_active, impulses, self%beam%value, arrested)
      motion%v = motion%v + matmul(value, impulses)
      impulse = impulses(:size(points))
      do i = size(points) + 1, size(arrested)
         event = event_of(self, arrested(i), event_closed_impulse, motion, 0.0_wp, 0.0_wp)
         event%impulse = impulses(i)
         call append_event(response, event)
         call measure_impulse(motion%observers%measures, arrested(i), motion%tau, impulses(i))
      end do
   end subroutine arrest

   !> Solve one impact problem and apply its impulses to the motion.
   subroutine solve_impact(self, reached, first, hop_tolerance, captures, motion, response)
      type(phase_state_t), intent(inout) :: self
      !> Whether the gap of each contact is zero and its stop rigid, [contacts]
      logical, intent(in) :: reached(:)
      !> Index of the contact that is hit
      integer, intent(in) :: first
      !> If the gap of a flight after this impact stays below this value, the contact stays closed (capture)
      real(wp), intent(in) :: hop_tolerance
      type(capture_t), intent(inout) :: captures(:)
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      ! contacts in the impact problem
      type(impact_contact_t) :: struck(size(reached))
      ! velocity change at each of these contacts per unit impulse at each of them
      real(wp) :: mobility(size(struck), size(struck))
      ! velocity at a contact, and its rounding error at the contact that is hit
      real(wp) :: velocity, first_rounding
      integer :: a, i, k, n

      n = 0
      first_rounding = velocity_rounding(self, first, motion)
      do k = 1, size(reached)
         if (.not. reached(k) .or. is_blocked(self, k)) cycle
         velocity = velocity_of(self, k, motion)
         ! the beam approaches the contact that is hit, even if rounding has made the velocity positive. A contact with
         ! the role `comes_to_rest` takes part even if its gap opens, because it adds no energy without restitution
         if (k == first) velocity = min(velocity, 0.0_wp)
         ! a body that stands on its floor without a force does not separate from it by a rounding error
         if (velocity > 0.0_wp .and. .not. velocity > first_rounding) velocity = 0.0_wp
         call add_impact_contact(k, role_of(k), velocity, self%states(k)%contact%settings%restitution, struck, n)
      end do
      if (allocated(self%beam%nodal_shape)) then
         ! the impact changes the velocity of the node at the only contact, and no other nodal velocity
         associate (shape => self%beam%nodal_shape)
            call find_nodal_impulse(sum(shape**2), sum(shape*motion%v), struck(1))
            motion%v(:) = motion%v + shape*(struck(1)%after - struck(1)%before)
         end associate
      else
         do a = 1, n
            do i = 1, a
               mobility(i, a) = modal_product(self%beam%value(:, struck(i)%contact), self%beam%value(:, &
                  struck(a)%contact))
               mobility(a, i) = mobility(i, a)
            end do
         end do
         call find_impulses(mobility(:n, :n), struck(:n), self%beam%value)
         do a = 1, n
            motion%v(:) = motion%v + self%beam%value(:, struck(a)%contact)*struck(a)%impulse
         end do
         ! the velocity of a light body between beam and floor is a small difference of its impulses
         do a = 1, n
            associate (row => self%beam%value(:, struck(a)%contact))
               if (.not. struck(a)%impulse > 0.0_wp .or. count(abs(row) > 0.0_wp) /= 1) cycle
               i = maxloc(abs(row), dim=1)
               motion%v(i) = struck(a)%after/row(i)
            end associate
         end do
      end if
      call charge_event(motion%recorder%energy_balance, sum(struck(:n)%energy_change))
      if (allocated(motion%tangent)) call reflect_columns(self%beam%value(:, struck(:n)%contact), &
         struck(:n)%restitution, struck(:n)%impulse > 0.0_wp, motion%tangent)
      do a = 1, n
         associate (state => self%states(struck(a)%contact))
            state%lost_at_impacts = state%lost_at_impacts - struck(a)%energy_change
         end associate
         call record_outcome(self, struck(a), hop_tolerance, captures, motion, response)
      end do

   contains

      !> Role of a contact in the impact problem: one of `rebounds`, `comes_to_rest` and `stays_closed`.
      pure integer function role_of(k) result(role)
         integer, intent(in) :: k

         role = rebounds
         if (captures(k)%is_captured) role = comes_to_rest
         if (self%states(k)%is_closed) role = stays_closed
      end function role_of
   end subroutine solve_impact

   !> Record the outcome of an impact problem at one contact: event, capture, or start of a flight.
   subroutine record_outcome(self, struck, hop_tolerance, captures, motion, response)
      type(phase_state_t), intent(inout) :: self
      type(impact_contact_t), intent(in) :: struck
      !> If the gap of a flight after this impact stays below this value, the contact stays closed (capture)
      real(wp), intent(in) :: hop_tolerance
      type(capture_t), intent(inout) :: captures(:)
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      real(wp) :: rounding
      integer :: outcome

      associate (k => struck%contact, capture => captures(struck%contact))
         rounding = 0.0_wp
         if (struck%role /= rebounds) rounding = velocity_rounding(self, k, motion)
         outcome = outcome_of(struck, rounding)
         select case (struck%role)
         case (stays_closed)
            if (outcome == gets_impulse) call record_impulse(event_closed_impulse, struck%before, struck%impulse, &
               struck%energy_change)
            if (outcome == is_released) call record_impulse(event_release, struck%before, 0.0_wp, 0.0_wp)
         case (comes_to_rest)
            capture%velocity = capture%velocity + struck%before
            capture%impulse = capture%impulse + struck%impulse
            capture%energy_change = capture%energy_change + struck%energy_change
            if (outcome == is_released) then
               if (capture%impulse > 0.0_wp) call record_impulse(event_impact, capture%velocity, capture%impulse, &
                  capture%energy_change)
               capture = capture_t()
            end if
         case (rebounds)
            if (outcome /= is_released) call record_impulse(event_impact, struck%before, struck%impulse, &
               struck%energy_change)
            capture%is_captured = .not. struck%after > 0.0_wp
            if (outcome == is_hit .and. .not. capture%is_captured) outcome = is_released
         end select
         if (outcome == is_released) call start_flight(self, k, 1, hop_tolerance)
      end associate

   contains

      !> Append an event with its impulse, and add the impulse to the measures.
      subroutine record_impulse(kind, before, impulse, energy_change)
         !> One of the `event_` constants
         integer, intent(in) :: kind
         !> Velocity of the stop point before the impulse, positive away from the contact
         real(wp), intent(in) :: before
         !> Impulse on the beam, positive away from the contact
         real(wp), intent(in) :: impulse
         !> Change of the energy of the beam by the impulse
         real(wp), intent(in) :: energy_change

         type(event_t) :: event

         event = event_of(self, struck%contact, kind, motion, before, struck%after)
         event%impulse = impulse
         event%energy_change = energy_change
         call append_event(response, event)
         if (kind /= event_release) call measure_impulse(motion%observers%measures, struck%contact, motion%tau, impulse)
      end subroutine record_impulse
   end subroutine record_outcome

end module contact_impulses
