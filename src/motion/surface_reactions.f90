!> What rigid surfaces that hold the beam do to it at an instant, and what follows for the others: surfaces that yield
!> and that it touches, and whether it moves at all (docs/theory.md, section 17).
module surface_reactions
   use complementarity, only: solve_complementarity
   use damped_oscillators, only: acceleration_of => acceleration
   use kinds, only: wp
   use load_courses, only: piece_at, piece_t
   use motion_phases, only: motion_t
   use response_types, only: response_t
   use several_state, only: find_load, several_t
   use surface_changes, only: close_surface
   use surface_values, only: force_of, gap_of, noise_of, pull_of, speed_noise, velocity_of, yielding_forces
   implicit none (type, external)
   private
   public :: find_reactions, force_rate_of, settle_touched

   !> More than rounding leaves of the velocities of a beam at rest.
   real(wp), parameter :: most_creep = 1.0e-6_wp

   !> Rounding error of a sum over the parts that its modes are made of.
   real(wp), parameter :: rounding = 64.0_wp*epsilon(1.0_wp)

contains

   !> Forces of rigid surfaces on which the beam rests, from the complementarity of reactions and accelerations.
   subroutine find_reactions(self, resting, motion, mobility, free, noise, force, acceleration)
      !> Its loads are those of the instant
      type(several_t), intent(in) :: self
      !> Places of these surfaces
      integer, intent(in) :: resting(:)
      type(motion_t), intent(in) :: motion
      !> Acceleration of each gap by a force at another, [resting, resting]
      real(wp), intent(out) :: mobility(:, :)
      !> Acceleration of each gap without them, and its rounding error, [resting]
      real(wp), intent(out) :: free(:)
      real(wp), intent(out) :: noise(:)
      !> Away from the surface, >= 0, [resting]
      real(wp), intent(out) :: force(:)
      !> Of the free modes with them
      real(wp), intent(out) :: acceleration(:)

      logical :: holds(size(resting))
      integer :: a, k

      acceleration = acceleration_of(self%beam%oscillators, motion%q, motion%v)
      if (.not. all(self%states%is_rigid)) acceleration = acceleration + yielding_forces(self, motion)
      if (self%loads%count > 0) acceleration = acceleration + self%load
      if (size(resting) == 0) return
      do a = 1, size(resting)
         do k = 1, a
            mobility(k, a) = dot_product(self%beam%value(:, resting(k)), self%beam%value(:, resting(a)))
            mobility(a, k) = mobility(k, a)
         end do
         free(a) = -pull_of(self, resting(a), motion, noise(a))
      end do
      call solve_complementarity(mobility, free, force, holds)
      do a = 1, size(resting)
         acceleration = acceleration + self%beam%value(:, resting(a))*force(a)
      end do
   end subroutine find_reactions

   !> How the force with which the beam presses on a surface that does not act changes.
   function force_rate_of(self, k, motion, acceleration) result(rate)
      !> Its loads are those of the instant
      type(several_t), intent(in) :: self
      integer, intent(in) :: k
      type(motion_t), intent(in) :: motion
      !> Of the free modes
      real(wp), intent(in) :: acceleration(:)
      real(wp) :: rate

      associate (b => self%beam%value(:, k), square => self%beam%oscillators%square, &
         two_zeta => self%beam%oscillators%two_zeta, mass_rate => self%beam%oscillators%mass_rate(:size(motion%q)))
         rate = sum(b*(square*(motion%v + two_zeta*acceleration) + mass_rate*acceleration))
         if (self%loads%count > 0) rate = rate - sum(b*self%load_rate)
      end associate
   end function force_rate_of

   !> The beam touches surfaces that yield and does not press on them: is each pressed from now on, or left, or does
   !> that go on? And does anything move?
   subroutine settle_touched(self, motion, response)
      type(several_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion
      !> Gets the events
      type(response_t), intent(inout) :: response

      self%is_at_rest = .false.
      if (.not. any(self%states%is_touched) .and. sum(abs(motion%v)) > most_creep*(1.0_wp + sum(abs(motion%q)))) return
      call ask_touched(self, motion, response)
   end subroutine settle_touched

   !> The same of a beam that touches surfaces or hardly moves.
   subroutine ask_touched(self, motion, response)
      type(several_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion
      !> Gets the events
      type(response_t), intent(inout) :: response

      integer :: resting(count(self%states%is_rigid .and. self%states%is_closed)), k
      real(wp), dimension(size(resting)) :: free, noise, force
      real(wp) :: mobility(size(resting), size(resting)), acceleration(size(motion%q)), spread(size(motion%q))

      if (self%loads%count > 0) call find_load(self, motion%tau)
      resting = pack([(k, k=1, size(self%states))], self%states%is_rigid .and. self%states%is_closed)
      call find_reactions(self, resting, motion, mobility, free, noise, force, acceleration)
      spread = self%beam%oscillators%square*abs(motion%q) + matmul(abs(self%beam%value(:, resting)), force)
      if (self%loads%count > 0) spread = spread + abs(self%load)
      do k = 1, size(self%states)
         if (self%states(k)%is_rigid .or. .not. self%states(k)%is_closed) cycle
         spread = spread + abs(self%beam%value(:, k)*force_of(self, k, motion))
      end do
      do k = 1, size(self%states)
         if (self%states(k)%is_touched) call leave_or_press(self, k, motion, acceleration, spread, response)
      end do
      self%is_at_rest = is_at_rest(self, motion, acceleration, spread)
   end subroutine ask_touched

   !> A surface that yields is pressed by the beam that touches it at rest, is left, or neither: the first derivative of
   !> the gap that exceeds its rounding error decides.
   subroutine leave_or_press(self, k, motion, acceleration, spread, response)
      type(several_t), intent(inout) :: self
      integer, intent(in) :: k
      type(motion_t), intent(in) :: motion
      !> Of the free modes
      real(wp), intent(in) :: acceleration(:)
      !> Sum of the magnitudes that each of these is made of
      real(wp), intent(in) :: spread(:)
      !> Gets a contact
      type(response_t), intent(inout) :: response

      real(wp) :: velocity, push
      integer :: order

      associate (b => self%beam%value(:, k), state => self%states(k))
         state%is_touched = gap_of(self, k, motion%q) <= noise_of(self, k, motion)
         if (.not. state%is_touched) return
         velocity = velocity_of(self, k, motion)
         push = sum(b*acceleration)
         order = 2
         if (abs(velocity) > speed_noise(self, k, motion)) then
            push = velocity
            order = 1
         else if (abs(push) <= rounding*sum(abs(b)*spread)) then
            push = -force_rate_of(self, k, motion, acceleration)
            order = 3
         end if
         if (push < 0.0_wp) then
            call close_surface(self, k, order, motion, response)
         else
            state%is_touched = .not. abs(push) > 0.0_wp
            state%start_order = order
         end if
      end associate
   end subroutine leave_or_press

   !> Does nothing move until loads change? Velocities and accelerations are rounding errors, loads constant, and no
   !> surface is on its way home.
   function is_at_rest(self, motion, acceleration, spread) result(answer)
      type(several_t), intent(in) :: self
      type(motion_t), intent(in) :: motion
      !> Of the free modes
      real(wp), intent(in) :: acceleration(:)
      !> Sum of the magnitudes that each of these is made of
      real(wp), intent(in) :: spread(:)
      logical :: answer

      type(piece_t) :: piece
      integer :: g, k

      answer = all(abs(acceleration) <= rounding*spread) .and. &
         all(abs(motion%v)*max(self%beam%oscillators%frequency, 1.0_wp) <= rounding*spread)
      do g = 1, self%loads%count
         if (.not. answer) return
         piece = piece_at(self%loads%course(g), motion%tau)
         answer = .not. (abs(piece%slope) > 0.0_wp .or. abs(piece%harmonic) > 0.0_wp)
      end do
      do k = 1, size(self%states)
         associate (state => self%states(k))
            if (state%is_rigid .or. .not. answer) cycle
            answer = .not. (state%is_indented .or. abs(state%branch_force) > 0.0_wp .or. &
               (state%depth > 0.0_wp .and. .not. state%is_closed))
         end associate
      end do
   end function is_at_rest

end module surface_reactions
