!> Gaps, gap velocities and forces of contacts at the present state of a motion in the free modes, and their rounding
!> errors. A gap is the distance of the stop point (the point of the beam at a stop) from the undeformed contact
!> surface, positive away from the surface.
module contact_values
   use contact_states, only: force_in
   use kinds, only: wp
   use motion_phases, only: motion_t
   use phase_state, only: phase_state_t
   use response_types, only: event_t
   implicit none (type, external)
   private
   public :: modal_product, event_of, gap_of, gap_to_undeformed, velocity_of, gap_rounding, velocity_rounding, force_of
   public :: compliant_forces, gap_bound_of_terms, reaction_demand

contains

   !> An event at the present state. In the event, the displacement and velocities of the stop point are positive
   !> upward.
   pure type(event_t) function event_of(self, k, kind, motion, before, after) result(event)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      !> One of the `event_` constants
      integer, intent(in) :: kind
      type(motion_t), intent(in) :: motion
      !> Velocity of the stop point before the event, positive away from the contact
      real(wp), intent(in) :: before
      !> Velocity of the stop point after the event, positive away from the contact
      real(wp), intent(in) :: after

      associate (contact => self%states(k)%contact)
         event = event_t(tau=motion%tau, kind=kind, eta=contact%sign*gap_of(self, k, motion%q), &
            velocity_before=contact%sign*before, velocity_after=contact%sign*after, contact=contact%number)
      end associate
   end function event_of

   !> Gap of a contact, including the displacement of a massless node.
   pure real(wp) function gap_of(self, k, q) result(gap)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), contiguous, intent(in) :: q(:)

      gap = gap_to_undeformed(self, k, q)
      if (self%states(k)%is_node) gap = gap + self%states(k)%indentation
   end function gap_of

   !> Gap of a contact by the displacement of the modes alone, without the displacement of a massless node.
   pure real(wp) function gap_to_undeformed(self, k, q) result(gap)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), contiguous, intent(in) :: q(:)

      gap = modal_product(self%beam%value(:, k), q) - self%beam%height(k)
   end function gap_to_undeformed

   !> Displacement or velocity of a point, or the mobility between two points: the product of a mode-shape vector with a
   !> modal vector.
   pure real(wp) function modal_product(shape, state) result(value)
      !> Mode-shape values at the point, [modes]
      real(wp), contiguous, intent(in) :: shape(:)
      !> Modal displacements or velocities, or mode-shape values at the other point, [modes]
      real(wp), contiguous, intent(in) :: state(:)

      integer :: i

      value = 0.0_wp
      !$omp simd reduction(+:value)
      do i = 1, size(shape)
         value = value + shape(i)*state(i)
      end do
   end function modal_product

   !> Gap velocity, positive away from the contact.
   pure real(wp) function velocity_of(self, k, motion) result(velocity)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      type(motion_t), intent(in) :: motion

      velocity = modal_product(self%beam%value(:, k), motion%v)
   end function velocity_of

   !> Rounding error of a gap, including the effect of the rounding error of tau.
   pure real(wp) function gap_rounding(self, k, motion) result(rounding)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      type(motion_t), intent(in) :: motion

      rounding = 4.0_wp*epsilon(1.0_wp)*(abs(self%beam%height(k)) + sum(abs(self%beam%value(:, k)*motion%q)) &
         + abs(velocity_of(self, k, motion))*motion%tau)
   end function gap_rounding

   !> Rounding error of a gap velocity.
   pure real(wp) function velocity_rounding(self, k, motion) result(rounding)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      type(motion_t), intent(in) :: motion

      rounding = 8.0_wp*epsilon(1.0_wp)*sum(abs(self%beam%value(:, k)*motion%v))
   end function velocity_rounding

   !> Force of a compliant contact if the contact is closed.
   pure real(wp) function force_of(self, k, motion) result(force)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      type(motion_t), intent(in) :: motion

      force = force_in(self%states(k), velocity_of(self, k, motion))
   end function force_of

   !> Modal forces of all closed compliant contacts, [modes].
   pure function compliant_forces(self, motion) result(forces)
      type(phase_state_t), intent(in) :: self
      type(motion_t), intent(in) :: motion
      real(wp) :: forces(size(motion%q))

      integer :: k

      forces = 0.0_wp
      do k = 1, size(self%states)
         if (self%states(k)%is_rigid .or. .not. self%states(k)%is_closed) cycle
         forces = forces + self%beam%value(:, k)*force_of(self, k, motion)
      end do
   end function compliant_forces

   !> Negative acceleration of a gap without a force at this contact: positive if a reaction is needed to keep the gap
   !> at zero.
   real(wp) function reaction_demand(self, k, motion, rounding) result(demand)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      type(motion_t), intent(in) :: motion
      !> Rounding error of the result
      real(wp), intent(out), optional :: rounding

      real(wp), allocatable :: compliant(:)

      associate (b => self%beam%value(:, k), square => self%beam%oscillators%square, &
         two_zeta => self%beam%oscillators%two_zeta, mass_rate => self%beam%oscillators%mass_rate(:size(motion%q)))
         demand = sum(b*square*(motion%q + two_zeta*motion%v)) + sum(b*mass_rate*motion%v)
         if (present(rounding)) rounding = sum(abs(b)*(square*(abs(motion%q) + two_zeta*abs(motion%v)) &
            + mass_rate*abs(motion%v)))
         if (.not. all(self%states%is_rigid)) then
            allocate (compliant, source=compliant_forces(self, motion))
            demand = demand - sum(b*compliant)
            if (present(rounding)) rounding = rounding + sum(abs(b*compliant))
         end if
         if (self%loads%count > 0) then
            demand = demand - sum(b*self%load)
            if (present(rounding)) rounding = rounding + sum(abs(b*self%load))
         end if
         if (present(rounding)) rounding = 4.0_wp*epsilon(1.0_wp)*rounding
      end associate
   end function reaction_demand

   !> Upper bound of the magnitude of the gap of a closed compliant contact.
   pure real(wp) function gap_bound_of_terms(self, k) result(gap_bound)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k

      associate (term => self%set%gap(k, :)*self%amplitude)
         gap_bound = abs(self%set%rest_gap(k)) + sum(sqrt(real(term, wp)**2 + aimag(term)**2))
      end associate
      if (self%loads%count == 0) return
      associate (row => self%set%forced%at%gaps + k, forced => self%forced)
         gap_bound = gap_bound + abs(forced%constant(row)) + sum(abs(forced%harmonic(row, :)))
         ! a ramp and a mode driven from rest may grow
         if (abs(forced%slope(row)) > 0.0_wp .or. size(forced%pair) > 0) gap_bound = huge(1.0_wp)
      end associate
   end function gap_bound_of_terms

end module contact_values
