!> Impulses on a beam at one instant: Newton's law as a complementarity problem over the rigid surfaces that take part,
!> what follows for each, and stop points that are brought to rest (docs/theory.md, section 17).
module contact_impulses
   use complementarity, only: solve_complementarity
   use contact_measures, only: measure_impulse
   use contact_sets, only: moved_by
   use kinds, only: wp
   use motion_phases, only: motion_t
   use phase_state, only: phase_state_t
   use response_types, only: append_event, event_blow, event_impact, event_release, event_t, response_t
   use run_recorder, only: charge_event
   use small_equations, only: solve_small
   use surface_changes, only: start_flight
   use surface_values, only: along, event_of, speed_noise, velocity_of
   use tangent_columns, only: brake_columns, strike_columns
   implicit none (type, external)
   private
   public :: capture_t, solve_impact, bring_to_rest, brake

   !> Is a surface brought to rest, and what did that take?
   type :: capture_t
      logical :: is_in = .false.
      !> It is known to be pressed against the surface
      logical :: is_pressed = .false.
      real(wp) :: velocity = 0.0_wp
      real(wp) :: impulse = 0.0_wp
      real(wp) :: energy_change = 0.0_wp
   end type capture_t

contains

   !> A flight that is taken back did not happen: its stop point is brought to rest where it began, and those that hold
   !> the beam keep it.
   subroutine bring_to_rest(self, k, captures, motion, response)
      type(phase_state_t), intent(inout) :: self
      integer, intent(in) :: k
      type(capture_t), intent(inout) :: captures(:)
      type(motion_t), intent(inout) :: motion
      !> Gets what these give
      type(response_t), intent(inout) :: response

      associate (capture => captures(k))
         capture%velocity = velocity_of(self, k, motion)
         call brake(self, k, capture%velocity, motion, capture%impulse)
         capture%impulse = -capture%impulse
         capture%energy_change = 0.5_wp*capture%impulse*capture%velocity
         call charge_event(motion%recorder%ledger, capture%energy_change)
         self%states(k)%lost_at_impacts = self%states(k)%lost_at_impacts - capture%energy_change
         call share_blow(self, k, capture%impulse, motion, response)
      end associate
   end subroutine bring_to_rest

   !> What the rigid surfaces that hold the beam give it, or take, as it gets an impulse elsewhere.
   subroutine share_blow(self, k, impulse, motion, response)
      type(phase_state_t), intent(inout) :: self
      !> The surface from which the impulse comes
      integer, intent(in) :: k
      real(wp), intent(in) :: impulse
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      complex(wp) :: mobility(size(self%states), size(self%states)), share(size(self%states), 1)
      type(event_t) :: event
      integer :: i, n
      integer, allocatable :: closed(:)

      if (.not. any(self%states%is_rigid .and. self%states%is_closed)) return
      allocate (closed, source=pack([(i, i=1, size(self%states))], self%states%is_rigid .and. self%states%is_closed))
      n = size(closed)
      associate (value => self%beam%value)
         share(:n, 1) = cmplx(-impulse*matmul(value(:, k), value(:, closed)), kind=wp)
         mobility(:n, :n) = cmplx(matmul(transpose(value(:, closed)), value(:, closed)), kind=wp)
      end associate
      share(:n, :) = solve_small(mobility(:n, :n), share(:n, :))
      do i = 1, n
         event = event_of(self, closed(i), event_blow, motion, 0.0_wp, 0.0_wp)
         event%impulse = real(share(i, 1), wp)
         call append_event(response, event)
         call measure_impulse(motion%observers%measures, closed(i), motion%tau, event%impulse)
      end do
   end subroutine share_blow

   !> Take some velocity away from a stop point by an impulse there; those that hold the beam keep it.
   subroutine brake(self, k, velocity, motion, impulse)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: velocity
      type(motion_t), intent(inout) :: motion
      !> Towards the surface
      real(wp), intent(out) :: impulse

      real(wp) :: b(self%set%held%count), unit(self%set%held%count), moved(size(motion%v)), mobility

      unit = 1.0_wp
      b = moved_by(self%set, k, unit)
      mobility = sum(b**2)
      impulse = velocity/mobility
      if (allocated(self%set%held%mode)) then
         moved = matmul(self%set%held%mode, b)
      else
         moved = b
      end if
      motion%v = motion%v - moved*impulse
      if (allocated(motion%tangent)) call brake_columns(self%beam%value(:, k), moved/mobility, motion%tangent)
   end subroutine brake

   !> One such problem.
   subroutine solve_impact(self, reached, first, hop_tolerance, captures, motion, response)
      type(phase_state_t), intent(inout) :: self
      !> Open rigid surfaces that the beam touches
      logical, intent(in) :: reached(:)
      !> That one is hit
      integer, intent(in) :: first
      real(wp), intent(in) :: hop_tolerance
      type(capture_t), intent(inout) :: captures(:)
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      integer :: taking(size(reached))
      real(wp), dimension(size(taking)) :: before, after, impulse, restitution
      real(wp) :: mobility(size(taking), size(taking)), change
      logical :: acts(size(taking))
      type(event_t) :: event
      integer :: a, k, n

      n = 0
      do k = 1, size(reached)
         if (.not. takes_part(k)) cycle
         n = n + 1
         taking(n) = k
         do a = 1, n
            mobility(a, n) = along(self%beam%value(:, taking(a)), self%beam%value(:, k))
            mobility(n, a) = mobility(a, n)
         end do
         before(n) = 0.0_wp
         if (.not. self%states(k)%is_closed) before(n) = velocity_of(self, k, motion)
         ! without restitution, and so without a gain of energy, what is on its way out may be turned back
         if (k == first .or. .not. captures(k)%is_in) before(n) = min(before(n), 0.0_wp)
         restitution(n) = self%states(k)%surface%settings%restitution
         if (captures(k)%is_in .or. self%states(k)%is_closed) restitution(n) = 0.0_wp
      end do
      if (n == 1) then
         after(1) = -restitution(1)*before(1)
         impulse(1) = (after(1) - before(1))/mobility(1, 1)
      else
         call solve_complementarity(mobility(:n, :n), (1.0_wp + restitution(:n))*before(:n), impulse(:n), acts(:n))
         after(:n) = before(:n) + matmul(mobility(:n, :n), impulse(:n))
         where (acts(:n)) after(:n) = -restitution(:n)*before(:n)
      end if
      if (allocated(self%beam%nodal_shape)) then
         call replace_velocity(self%beam%nodal_shape, after(1) - before(1), motion%v, impulse(1), change)
      else
         change = 0.5_wp*sum(impulse(:n)*(before(:n) + after(:n)))
         do a = 1, n
            motion%v(:) = motion%v + self%beam%value(:, taking(a))*impulse(a)
         end do
      end if
      call charge_event(motion%recorder%ledger, change)
      if (allocated(motion%tangent)) call strike_columns(self%beam%value(:, taking(:n)), restitution(:n), &
         impulse(:n) > 0.0_wp, motion%tangent)
      do a = 1, n
         k = taking(a)
         event = event_of(self, k, event_impact, motion, before(a), after(a))
         event%impulse = impulse(a)
         event%energy_change = 0.5_wp*impulse(a)*(before(a) + after(a))
         if (n == 1) event%energy_change = change
         self%states(k)%lost_at_impacts = self%states(k)%lost_at_impacts - event%energy_change
         call enter_impact(self, k, event, hop_tolerance, captures, motion, response)
      end do

   contains

      !> Does a surface take part?
      function takes_part(k) result(answer)
         integer, intent(in) :: k
         logical :: answer

         answer = k == first .or. (self%states(k)%is_rigid .and. self%states(k)%is_closed)
         if (.not. answer .and. reached(k)) answer = captures(k)%is_in .or. .not. velocity_of(self, k, motion) > 0.0_wp
      end function takes_part
   end subroutine solve_impact

   !> The nodal reading of an impulse: one node changes its velocity, and the others keep theirs.
   pure subroutine replace_velocity(shape, change, v, impulse, energy_change)
      !> Of the modes' velocities per unit of that of the node, [modes]
      real(wp), intent(in) :: shape(:)
      !> Of the node's velocity
      real(wp), intent(in) :: change
      !> Of the modes
      real(wp), intent(inout) :: v(:)
      real(wp), intent(out) :: impulse
      !> Won or lost
      real(wp), intent(out) :: energy_change

      energy_change = -0.5_wp*sum(v**2)
      v = v + shape*change
      energy_change = energy_change + 0.5_wp*sum(v**2)
      impulse = sum(shape**2)*change
   end subroutine replace_velocity

   !> What an impulse, or none, made of a surface that took part.
   subroutine enter_impact(self, k, event, hop_tolerance, captures, motion, response)
      type(phase_state_t), intent(inout) :: self
      integer, intent(in) :: k
      !> As an impact
      type(event_t), intent(in) :: event
      real(wp), intent(in) :: hop_tolerance
      type(capture_t), intent(inout) :: captures(:)
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      type(event_t) :: other
      real(wp) :: leaves

      leaves = self%states(k)%surface%sign*event%velocity_after
      if (self%states(k)%is_closed) then
         other = event
         if (event%impulse > 0.0_wp) then
            other%kind = event_blow
            call append_event(response, other)
            call measure_impulse(motion%observers%measures, k, motion%tau, event%impulse)
         else if (leaves > speed_noise(self, k, motion)) then
            other%kind = event_release
            call append_event(response, other)
            call start_flight(self, k, 1, hop_tolerance)
         end if
      else if (captures(k)%is_in) then
         captures(k)%velocity = captures(k)%velocity + self%states(k)%surface%sign*event%velocity_before
         captures(k)%impulse = captures(k)%impulse + event%impulse
         captures(k)%energy_change = captures(k)%energy_change + event%energy_change
         if (.not. leaves > speed_noise(self, k, motion)) return
         ! what hits others lifts it
         if (captures(k)%impulse > 0.0_wp) then
            other = event
            other%velocity_before = self%states(k)%surface%sign*captures(k)%velocity
            other%impulse = captures(k)%impulse
            other%energy_change = captures(k)%energy_change
            call append_event(response, other)
            call measure_impulse(motion%observers%measures, k, motion%tau, other%impulse)
         end if
         captures(k) = capture_t()
         call start_flight(self, k, 1, hop_tolerance)
      else
         if (event%impulse > 0.0_wp .or. .not. leaves > 0.0_wp) then
            call append_event(response, event)
            call measure_impulse(motion%observers%measures, k, motion%tau, event%impulse)
         end if
         captures(k)%is_in = .not. leaves > 0.0_wp
         if (leaves > 0.0_wp) call start_flight(self, k, 1, hop_tolerance)
      end if
   end subroutine enter_impact

end module contact_impulses
