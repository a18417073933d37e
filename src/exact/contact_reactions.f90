!> Decisions at an instant from accelerations and their rates (docs/theory.md, section 17): the reactions of closed
!> rigid contacts and which of them open, whether touched compliant contacts (zero gap, zero force) close or open, and
!> whether the beam is at rest. ' is d/dtau, q are the displacements of the free modes, b their values at contact k.
module contact_reactions
   use complementarity, only: solve_complementarity
   use contact_changes, only: close_contact
   use contact_states, only: reactions_t
   use contact_values, only: modal_product, force_of, gap_of, gap_rounding, reaction_demand, velocity_rounding, &
      velocity_of, &
      compliant_forces
   use damped_oscillators, only: acceleration_of => acceleration
   use free_modes, only: max_rigid_square
   use kinds, only: wp
   use load_courses, only: load_segment_at, load_segment_t
   use motion_phases, only: motion_t
   use phase_state, only: find_load, phase_state_t
   use response_types, only: response_t
   implicit none (type, external)
   private
   public :: find_reactions, opening_orders, resolve_touched_contacts

   !> The beam may be at rest only if sum |q'| is at most this fraction of 1 + sum |q|. The fraction is larger than
   !> rounding errors.
   real(wp), parameter :: max_creep = 1.0e-6_wp

   !> Rounding error of a sum over the modes, as a fraction of the sum of the magnitudes.
   real(wp), parameter :: rounding = 64.0_wp*epsilon(1.0_wp)

contains

   !> Find the reactions of rigid contacts with zero gap and zero gap velocity: a linear complementarity problem of
   !> reactions >= 0 and gap accelerations >= 0.
   subroutine find_reactions(self, place, motion)
      !> Contains the loads at the instant; `reactions` is set
      type(phase_state_t), intent(inout) :: self
      !> Indices of the rigid contacts
      integer, intent(in) :: place(:)
      type(motion_t), intent(in) :: motion

      logical :: in_active_set(size(place))
      integer :: a, i, n

      n = size(place)
      associate (reactions => self%reactions)
         reactions%place = place
         if (allocated(reactions%free)) then
            if (size(reactions%free) /= n) deallocate (reactions%mobility, reactions%free, reactions%rounding, &
               reactions%force)
         end if
         if (.not. allocated(reactions%free)) allocate (reactions%mobility(n, n), reactions%free(n), &
            reactions%rounding(n), reactions%force(n))
         reactions%acceleration = acceleration_of(self%beam%oscillators, motion%q, motion%v)
         if (.not. all(self%states%is_rigid)) then
            reactions%acceleration = reactions%acceleration + compliant_forces(self, motion)
         end if
         if (self%loads%count > 0) reactions%acceleration = reactions%acceleration + self%load
         do a = 1, n
            do i = 1, n
               reactions%mobility(i, a) = modal_product(self%beam%value(:, place(i)), self%beam%value(:, place(a)))
            end do
            reactions%free(a) = -reaction_demand(self, place(a), motion, reactions%rounding(a))
         end do
         if (n > 0) call solve_complementarity(reactions%mobility, reactions%free, reactions%force, in_active_set, &
            value=self%beam%value, place=place)
         do a = 1, n
            reactions%acceleration = reactions%acceleration + self%beam%value(:, place(a))*reactions%force(a)
         end do
      end associate
   end subroutine find_reactions

   !> For each rigid contact in `reactions`: order of the first derivative of the gap that exceeds its rounding error,
   !> if this derivative is positive, so that the contact opens; 0: the contact stays closed, with or without a force.
   function opening_orders(self, motion) result(order)
      type(phase_state_t), intent(in) :: self
      type(motion_t), intent(in) :: motion
      integer :: order(size(self%reactions%place))

      real(wp), dimension(size(motion%q)) :: jerk, jerk_magnitude
      logical, dimension(size(order)) :: is_loaded, is_opening
      integer :: a

      call classify_reactions(self%reactions, is_loaded, is_opening)
      order = merge(2, 0, is_opening)
      if (all(is_loaded .or. is_opening)) return
      call find_jerk(self, motion, self%reactions, jerk, jerk_magnitude)
      do a = 1, size(order)
         if (is_loaded(a) .or. is_opening(a)) cycle
         associate (b => self%beam%value(:, self%reactions%place(a)))
            if (sum(b*jerk) > rounding*sum(abs(b)*jerk_magnitude)) order(a) = 3
         end associate
      end do
   end function opening_orders

   !> Classify rigid contacts: with a positive reaction, opening with a positive gap acceleration, or neither (reaction
   !> and acceleration vanish).
   pure subroutine classify_reactions(reactions, is_loaded, is_opening)
      type(reactions_t), intent(in) :: reactions
      logical, intent(out) :: is_loaded(:)
      logical, intent(out) :: is_opening(:)

      integer :: a

      do a = 1, size(is_loaded)
         is_loaded(a) = reactions%force(a)*reactions%mobility(a, a) > reactions%rounding(a)
         is_opening(a) = .not. is_loaded(a) .and. &
            reactions%free(a) + sum(reactions%mobility(:, a)*reactions%force) > reactions%rounding(a)
      end do
   end subroutine classify_reactions

   !> Rates of change of the modal accelerations. Contacts with a positive reaction stay closed. For contacts with zero
   !> reaction and zero gap acceleration, the rates of reaction and acceleration are complementary. One problem is
   !> solved over all these contacts because the effect of a load on one contact depends on which other contacts stay
   !> closed.
   subroutine find_jerk(self, motion, reactions, jerk, jerk_magnitude)
      type(phase_state_t), intent(in) :: self
      type(motion_t), intent(in) :: motion
      type(reactions_t), intent(in) :: reactions
      !> Rates of change of the accelerations of the free modes, [modes]
      real(wp), intent(out) :: jerk(:)
      !> Sum of the magnitudes of the summands of each rate, [modes]
      real(wp), intent(out) :: jerk_magnitude(:)

      real(wp) :: magnitude(size(motion%q))
      logical, dimension(size(reactions%place)) :: is_loaded, is_opening
      real(wp), allocatable :: rate(:)
      logical, allocatable :: in_active_set(:)
      ! contacts in `reactions` that do not open by their accelerations
      integer, allocatable :: undecided(:)
      integer :: a, k

      jerk = acceleration_of(self%beam%oscillators, motion%v, reactions%acceleration)
      magnitude = magnitude_of(self, motion, reactions)
      associate (beam => self%beam%oscillators)
         jerk_magnitude = beam%square*(abs(motion%v) + beam%two_zeta*magnitude) &
            + beam%mass_rate(:size(magnitude))*magnitude
      end associate
      if (self%loads%count > 0) then
         jerk = jerk + self%load_rate
         jerk_magnitude = jerk_magnitude + abs(self%load_rate)
      end if
      do k = 1, size(self%states)
         associate (state => self%states(k), b => self%beam%value(:, k))
            if (state%is_rigid .or. .not. state%is_closed) cycle
            associate (spring_rate => -(state%spring%stiffness + state%spring%branch_stiffness) &
               *velocity_of(self, k, motion) - state%spring%relaxation_rate*state%branch_force, &
               viscosity => state%spring%viscosity)
               jerk = jerk + b*(spring_rate - viscosity*sum(b*reactions%acceleration))
               jerk_magnitude = jerk_magnitude + abs(b)*(abs(spring_rate) + viscosity*sum(abs(b)*magnitude))
            end associate
         end associate
      end do
      call classify_reactions(reactions, is_loaded, is_opening)
      allocate (undecided, source=pack([(a, a=1, size(is_opening))], .not. is_opening))
      allocate (rate(size(undecided)), in_active_set(size(undecided)))
      associate (b => self%beam%value(:, reactions%place(undecided)))
         call solve_complementarity(reactions%mobility(undecided, undecided), matmul(jerk, b), rate, in_active_set, &
            is_loaded(undecided), self%beam%value, reactions%place(undecided))
         jerk = jerk + matmul(b, rate)
         do a = 1, size(undecided)
            jerk_magnitude = jerk_magnitude + abs(b(:, a)*rate(a))
         end do
      end associate
   end subroutine find_jerk

   !> Sum of the magnitudes of the summands of each modal acceleration, as a scale of their rounding errors, [modes].
   !> The damping forces are omitted, because this scale is used if the beam hardly moves.
   function magnitude_of(self, motion, reactions) result(magnitude)
      type(phase_state_t), intent(in) :: self
      type(motion_t), intent(in) :: motion
      type(reactions_t), intent(in) :: reactions
      real(wp) :: magnitude(size(motion%q))

      integer :: k

      magnitude = self%beam%oscillators%square*abs(motion%q)
      do k = 1, size(reactions%place)
         magnitude = magnitude + abs(self%beam%value(:, reactions%place(k)))*reactions%force(k)
      end do
      if (self%loads%count > 0) magnitude = magnitude + abs(self%load)
      do k = 1, size(self%states)
         if (self%states(k)%is_rigid .or. .not. self%states(k)%is_closed) cycle
         magnitude = magnitude + abs(self%beam%value(:, k)*force_of(self, k, motion))
      end do
   end function magnitude_of

   !> Decide for each touched compliant contact (zero gap, zero force) whether it closes, opens or stays touched, and
   !> whether the beam is at rest.
   subroutine resolve_touched_contacts(self, motion, response)
      type(phase_state_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion
      !> Receives the events
      type(response_t), intent(inout) :: response

      real(wp) :: displacements, speeds
      integer :: i

      self%is_at_rest = .false.
      displacements = 0.0_wp
      speeds = 0.0_wp
      !$omp simd reduction(+:displacements, speeds)
      do i = 1, size(motion%q)
         displacements = displacements + abs(motion%q(i))
         speeds = speeds + abs(motion%v(i))
      end do
      if (.not. any(self%states%is_touched) .and. speeds > max_creep*(1.0_wp + displacements)) return
      call resolve_touched(self, motion, response)
   end subroutine resolve_touched_contacts

   !> Second part of `resolve_touched_contacts`, needed only if a contact is touched or the beam hardly moves.
   subroutine resolve_touched(self, motion, response)
      type(phase_state_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion
      !> Receives the events
      type(response_t), intent(inout) :: response

      real(wp), dimension(size(motion%q)) :: jerk, magnitude, jerk_magnitude
      integer :: k

      if (self%loads%count > 0) call find_load(self, motion%tau)
      call find_reactions(self, pack([(k, k=1, size(self%states))], self%states%is_rigid .and. self%states%is_closed), &
         motion)
      magnitude = magnitude_of(self, motion, self%reactions)
      if (any(self%states%is_touched)) then
         call find_jerk(self, motion, self%reactions, jerk, jerk_magnitude)
         do k = 1, size(self%states)
            if (self%states(k)%is_touched) call open_or_close(self, k, motion, reshape([ &
               self%reactions%acceleration, magnitude, jerk, jerk_magnitude], [size(jerk), 4]), response)
         end do
      end if
      self%is_at_rest = is_at_rest(self, motion, self%reactions%acceleration, magnitude)
   end subroutine resolve_touched

   !> Close or open a touched compliant contact, or leave it touched: the sign of the first derivative of the gap that
   !> exceeds its rounding error decides.
   subroutine open_or_close(self, k, motion, changes, response)
      type(phase_state_t), intent(inout) :: self
      integer, intent(in) :: k
      type(motion_t), intent(in) :: motion
      !> Accelerations of the free modes, the sums of the magnitudes of their summands, and the rates of change of the
      !> accelerations with their sums, [modes, 4]
      real(wp), intent(in) :: changes(:, :)
      !> Receives the event of a closing contact
      type(response_t), intent(inout) :: response

      real(wp) :: derivative(3), error(3)
      integer :: order

      associate (b => self%beam%value(:, k), state => self%states(k))
         state%is_touched = gap_of(self, k, motion%q) <= gap_rounding(self, k, motion)
         if (.not. state%is_touched) return
         derivative = [velocity_of(self, k, motion), sum(b*changes(:, 1)), sum(b*changes(:, 3))]
         error = [velocity_rounding(self, k, motion), rounding*sum(abs(b)*changes(:, 2)), &
            rounding*sum(abs(b)*changes(:, 4))]
         order = findloc(abs(derivative) > error, .true., dim=1)
         if (order == 0) then
            ! undecided: the contact stays touched, and the search treats the gap as opening with its third derivative
            state%start_order = 3
         else if (derivative(order) < 0.0_wp) then
            call close_contact(self, k, order, motion, response)
         else
            state%is_touched = .false.
            state%start_order = order
         end if
      end associate
   end subroutine open_or_close

   !> Whether the beam is at rest until loads change. Velocities and accelerations are then rounding errors, loads are
   !> constant, no open contact is deformed, and no contact has a branch force.
   logical function is_at_rest(self, motion, acceleration, magnitude) result(answer)
      type(phase_state_t), intent(in) :: self
      type(motion_t), intent(in) :: motion
      !> Accelerations of the free modes, [modes]
      real(wp), intent(in) :: acceleration(:)
      !> Sum of the magnitudes of the summands of each acceleration, [modes]
      real(wp), intent(in) :: magnitude(:)

      type(load_segment_t) :: segment
      logical :: is_free(size(acceleration))
      real(wp) :: scale(size(acceleration))
      integer :: g, k

      ! a mode without stiffness and load moves by contact forces alone, whose rounding errors come from all modes
      is_free = self%beam%oscillators%square <= max_rigid_square
      if (self%loads%count > 0) is_free = is_free .and. abs(self%load) <= 0.0_wp
      scale = merge(maxval(magnitude), magnitude, is_free)
      answer = all(abs(acceleration) <= rounding*scale) .and. &
         all(abs(motion%v)*max(self%beam%oscillators%frequency, 1.0_wp) <= rounding*scale)
      do g = 1, self%loads%count
         if (.not. answer) return
         segment = load_segment_at(self%loads%course(g), motion%tau)
         answer = .not. (abs(segment%slope) > 0.0_wp .or. abs(segment%harmonic) > 0.0_wp)
      end do
      do k = 1, size(self%states)
         associate (state => self%states(k))
            if (state%is_rigid .or. .not. answer) cycle
            answer = .not. (state%is_deformed .or. abs(state%branch_force) > 0.0_wp .or. &
               (state%indentation > 0.0_wp .and. .not. state%is_closed))
         end associate
      end do
   end function is_at_rest

end module contact_reactions
