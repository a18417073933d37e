!> The state of exact motion among several surfaces at an instant, its sections, and a motion that goes on from one
!> (docs/theory.md, section 21).
module section_states
   use kinds, only: wp
   use phase_losses, only: keep_indentation, leave_behind
   use phase_state, only: free_state, move_to, phase_state_t
   use section_records, only: next_section
   use section_types, only: run_sections_t, section_state_t
   use surface_states, only: surface_state_t
   implicit none (type, external)
   private
   public :: state_at, take_sections, put_state

contains

   !> The state at a time in the present phase.
   subroutine state_at(self, tau, time, state)
      type(phase_state_t), intent(in) :: self
      !> Start of the phase
      real(wp), intent(in) :: tau
      real(wp), intent(in) :: time
      type(section_state_t), intent(out) :: state

      real(wp), dimension(size(self%z)) :: z, v
      complex(wp), allocatable :: term(:)
      type(surface_state_t) :: surface
      integer :: k, n, place

      n = size(self%states)
      state%tau = tau + time
      allocate (state%q(size(self%beam%tip_value)), state%v(size(self%beam%tip_value)))
      allocate (state%is_closed(n), state%is_indented(n), state%is_low(n))
      allocate (state%depth(n), state%branch_force(n), state%hop_tolerance(n))
      call move_to(self, time, z, v)
      call free_state(self, z, v, state%q, state%v)
      allocate (term(0))
      if (size(self%set%pressed) > 0) term = self%amplitude*exp(self%set%joint%exponent*time)
      do k = 1, n
         surface = self%states(k)
         if (.not. surface%is_rigid) then
            place = findloc(self%set%pressed, k, dim=1)
            if (place > 0) then
               call keep_indentation(self, place, time, term, surface)
            else
               call leave_behind(self%set%held%static_gap(k) + sum(self%set%held%value(:, k)*z), time, surface)
            end if
         end if
         state%is_closed(k) = surface%is_closed
         state%is_indented(k) = surface%is_indented
         state%depth(k) = surface%depth
         state%branch_force(k) = surface%branch_force
         state%hop_tolerance(k) = surface%hop_tolerance
         state%is_low(k) = surface%is_low
      end do
   end subroutine state_at

   !> The surfaces as they were; the beam is to be there, too.
   pure subroutine put_state(state, self)
      type(section_state_t), intent(in) :: state
      type(phase_state_t), intent(inout) :: self

      integer :: k

      do k = 1, size(self%states)
         associate (surface => self%states(k))
            surface%is_closed = state%is_closed(k)
            surface%is_indented = state%is_indented(k)
            surface%depth = state%depth(k)
            surface%branch_force = state%branch_force(k)
            surface%hop_tolerance = state%hop_tolerance(k)
            surface%is_low = state%is_low(k)
            surface%is_new_flight = .false.
         end associate
      end do
   end subroutine put_state

   !> What sections keep of a phase, the instant with which it ends included.
   subroutine take_sections(self, tau, length, sections)
      type(phase_state_t), intent(in) :: self
      !> Its start
      real(wp), intent(in) :: tau
      real(wp), intent(in) :: length
      type(run_sections_t), intent(inout) :: sections

      real(wp), dimension(size(self%z)) :: z, rate
      real(wp), dimension(size(self%beam%tip_value)) :: q, v
      integer :: k

      ! as near to the end as rounding can tell is in it
      do while (next_section(sections) <= tau + length + 4.0_wp*epsilon(1.0_wp)*tau)
         sections%count = sections%count + 1
         associate (n => sections%count)
            call move_to(self, min(max(sections%tau(n) - tau, 0.0_wp), length), z, rate)
            call free_state(self, z, rate, q, v)
            sections%tip(:, n) = [sum(self%beam%tip_value*q), sum(self%beam%tip_value*v)]
            do k = 1, size(self%states)
               associate (state => self%states(k))
                  sections%stop(:, state%surface%number, n) = state%surface%sign*[sum(self%beam%value(:, k)*q), &
                     sum(self%beam%value(:, k)*v)]
                  ! exactly, not to rounding
                  if (state%is_rigid .and. state%is_closed) sections%stop(:, state%surface%number, n) = &
                     [state%surface%sign*state%surface%height, 0.0_wp]
               end associate
            end do
            if (allocated(sections%modes)) then
               sections%modes(1, :, n) = q
               sections%modes(2, :, n) = v
            end if
         end associate
      end do
   end subroutine take_sections

end module section_states
