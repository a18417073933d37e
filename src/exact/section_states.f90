!> The complete state of exact motion at an instant, modal states at Poincare sections (instants one load period apart),
!> and the continuation of a motion from a stored state (docs/theory.md, section 21).
module section_states
   use constrained_sets, only: displacement_t
   use contact_states, only: contact_state_t
   use free_modes, only: max_rigid_square
   use kinds, only: wp
   use phase_losses, only: advance_contact
   use phase_state, only: to_free_state, find_state, phase_state_t
   use section_types, only: run_sections_t, section_state_t
   implicit none (type, external)
   private
   public :: state_at, record_modes, motion_of, restore_state

contains

   !> Complete state (modes and contacts) at a time in the present phase.
   subroutine state_at(self, tau, time, state)
      type(phase_state_t), intent(in) :: self
      !> Start of the phase
      real(wp), intent(in) :: tau
      !> Time since the start of the phase
      real(wp), intent(in) :: time
      type(section_state_t), intent(out) :: state

      real(wp), dimension(size(self%z)) :: z, v
      complex(wp), allocatable :: term(:)
      type(contact_state_t) :: contact
      integer :: k, n

      n = size(self%states)
      state%tau = tau + time
      allocate (state%q(size(self%beam%tip_value)), state%v(size(self%beam%tip_value)))
      allocate (state%is_closed(n), state%is_deformed(n), state%may_be_captured(n))
      allocate (state%indentation(n), state%branch_force(n), state%flight_height(n))
      call find_state(self, time, z, v)
      call to_free_state(self, z, v, state%q, state%v)
      allocate (term(0))
      if (size(self%set%compliant) > 0) term = self%amplitude*exp(self%set%coupled%exponent*time)
      do k = 1, n
         contact = self%states(k)
         call advance_contact(self, k, time, z, term, contact)
         state%is_closed(k) = contact%is_closed
         state%is_deformed(k) = contact%is_deformed .and. self%undeformed_at(k) > time
         state%indentation(k) = contact%indentation
         state%branch_force(k) = contact%branch_force
         state%flight_height(k) = contact%hop_tolerance
         state%may_be_captured(k) = contact%may_be_captured
      end do
   end subroutine state_at

   !> Set the contact states from a stored state. The caller sets the state of the modes.
   pure subroutine restore_state(state, self)
      type(section_state_t), intent(in) :: state
      type(phase_state_t), intent(inout) :: self

      integer :: k

      do k = 1, size(self%states)
         associate (contact => self%states(k))
            contact%is_closed = state%is_closed(k)
            contact%is_deformed = state%is_deformed(k)
            contact%indentation = state%indentation(k)
            contact%branch_force = state%branch_force(k)
            contact%hop_tolerance = state%flight_height(k)
            contact%may_be_captured = state%may_be_captured(k)
            contact%is_new_flight = .false.
         end associate
      end do
   end subroutine restore_state

   !> A displacement in which one mode takes part, such as that of a body, and its velocity.
   pure function motion_of(self, z, v, displacement) result(motion)
      type(phase_state_t), intent(in) :: self
      !> Displacements of the constrained modes, [modes]
      real(wp), intent(in) :: z(:)
      !> Velocities of the constrained modes, [modes]
      real(wp), intent(in) :: v(:)
      type(displacement_t), intent(in) :: displacement
      real(wp) :: motion(2)

      associate (constrained => self%set%constrained, i => displacement%mode)
         if (allocated(constrained%mode)) then
            motion = [constrained%static(i) + sum(constrained%mode(i, :)*z), sum(constrained%mode(i, :)*v)]
         else
            motion = [z(i), v(i)]
         end if
      end associate
      motion = displacement%value*motion + [displacement%origin, 0.0_wp]
   end function motion_of

   !> Record the free modes at the sections in a phase.
   subroutine record_modes(self, tau, length, first, sections)
      type(phase_state_t), intent(in) :: self
      !> Start of the phase, tau
      real(wp), intent(in) :: tau
      !> Length of the phase
      real(wp), intent(in) :: length
      !> Index of the first section in the phase
      integer, intent(in) :: first
      type(run_sections_t), intent(inout) :: sections

      real(wp), dimension(size(self%z)) :: z, rate
      real(wp), dimension(size(self%beam%tip_value)) :: q, v
      integer :: n

      if (.not. allocated(sections%modes)) return
      do n = first, sections%count
         call find_state(self, min(max(sections%tau(n) - tau, 0.0_wp), length), z, rate)
         call to_free_state(self, z, rate, q, v)
         sections%modes(1, :, n) = q
         ! the coordinate of a body without spring is stored from z = 0
         associate (of => self%beam%displacement)
            where (self%beam%oscillators%square(of%mode) <= max_rigid_square) sections%modes(1, of%mode, n) = &
               q(of%mode) + of%origin/of%value
         end associate
         sections%modes(2, :, n) = v
      end do
   end subroutine record_modes

end module section_states
