!> Initial state of a motion in the free modes: release from rest, static equilibrium under the loads, or given
!> displacements and velocities (docs/theory.md, section 18). In a release the unit of displacement D is the initial
!> distance of the beam from the release contact; in other starts D is a given scale.
module modal_starts
   use beam_model, only: beam_model_t
   use beam_starts, only: find_start_momenta
   use contact_starts, only: find_slow_balance, find_static_equilibrium, check_mode_count, check_start, &
      flexible_beam_t, move_onto_contacts, place_extra_dofs
   use contact_states, only: contact_state_t
   use failures, only: failure_t
   use few_modes, only: number_of_modes
   use free_modes, only: free_modes_t
   use kinds, only: wp
   use load_courses, only: value_at
   use load_settings, only: is_in_mode, start_balance, start_drop, start_mode, start_release, &
      start_table, start_velocity
   use number_text, only: to_text
   use phase_state, only: phase_state_t
   use point_forces, only: slow_frequency
   use run_settings, only: run_settings_t
   implicit none (type, external)
   private
   public :: find_modal_start, node_flexibility

   !> The beam in its free modes, as a flexible body under static contact forces.
   type, extends(flexible_beam_t) :: modal_beam_t
      !> W^2, squared frequencies, [modes]
      real(wp), allocatable :: square(:)
   contains
      procedure :: find_static_shapes
   end type modal_beam_t

contains

   !> Find the initial state of the free modes and the contact forces.
   subroutine find_modal_start(model, modes, settings, phase, is_active, q, v, forces, error)
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(in) :: modes
      type(run_settings_t), intent(in) :: settings
      !> The beam, its contacts and the loads on it
      type(phase_state_t), intent(in) :: phase
      !> Whether each contact is active: no other rigid contact at the same point and on the same side is in front of
      !> it, [contacts]
      logical, intent(in) :: is_active(:)
      !> Modal displacements, [modes]
      real(wp), allocatable, intent(out) :: q(:)
      !> Modal velocities, [modes]
      real(wp), allocatable, intent(out) :: v(:)
      !> Contact forces P, [contacts]
      real(wp), intent(out) :: forces(:)
      !> Set if the beam penetrates a contact, no contact supports a mass that moves freely, or there are more rigid
      !> stops than modes
      type(failure_t), allocatable, intent(inout) :: error

      type(modal_beam_t) :: beam
      ! M y and M dy/dtau of the start, [degrees of freedom, 2]
      real(wp) :: mass_times_start(model%mass%order, 2)
      ! the motion has fewer modes than the mesh, the start is a release, and no node is massless
      logical :: is_truncated

      allocate (q(size(modes%square)), v(size(modes%square)), source=0.0_wp)
      forces = 0.0_wp
      associate (contacts => phase%states%contact)
         call check_mode_count(contacts, model%stop_dofs(contacts%stop), size(q) - size(model%extra), error)
      end associate
      if (allocated(error)) return
      beam%row = phase%beam%value
      beam%square = phase%beam%oscillators%square
      associate (start => settings%start)
         select case (start%kind)
         case (start_release)
            ! the static shape of a force at the release contact, with a gap of 1 at this contact
            associate (b => phase%beam%value(:, phase%release_contact), square => phase%beam%oscillators%square)
               q(:) = (1.0_wp + phase%beam%height(phase%release_contact))*b &
                  /(square*(sum(b**2/square) + node_flexibility(phase%states(phase%release_contact))))
            end associate
         case (start_balance)
            call find_balance(model, modes, phase, beam, is_active, q, forces, error)
         case (start_velocity, start_drop, start_mode, start_table)
            if (is_in_mode(start)) then
               associate (tip => modes%mode(modes%tip_dof, start%mode))
                  if (start%kind == start_mode) q(start%mode) = start%displacement/tip
                  v(start%mode) = start%velocity/tip
               end associate
            else
               call find_start_momenta(model, start, mass_times_start(:, 1), mass_times_start(:, 2))
               q(:) = matmul(mass_times_start(:, 1), modes%mode)
               v(:) = matmul(mass_times_start(:, 2), modes%mode)
            end if
         end select
      end associate
      call place_extra_dofs(model, settings%start%kind == start_balance, q, v, modes)
      ! The static shape of a release was checked on the finite-element model before the modes were computed. The sum of
      ! all modes has the same displacements at the stops, so that only truncation can make the shape penetrate a
      ! contact; if a node is massless, there is no other contact to penetrate
      is_truncated = settings%start%kind == start_release .and. &
         size(q) < number_of_modes(model) .and. .not. any(phase%states%is_node)
      if (settings%start%kind /= start_release .or. size(model%extra) > 0 .or. is_truncated) then
         call check_start(beam, phase%states%contact, forces, q, error)
      end if
      if (allocated(error) .and. is_truncated) error%message = error%message//', because the static shape of the ' &
         //'start needs more than the '//to_text(size(q))//' modes of the motion'
      if (.not. allocated(error)) call move_onto_contacts(beam, phase%states%contact, is_active, forces, q, error)
   end subroutine find_modal_start

   !> Flexibility of the beam at a massless node at the stop (of a redistributed mass matrix), in addition to that of
   !> the modes; 0: there is no massless node.
   pure real(wp) function node_flexibility(state) result(flexibility)
      type(contact_state_t), intent(in) :: state

      flexibility = 0.0_wp
      if (state%is_node) flexibility = 1.0_wp/state%spring%stiffness
   end function node_flexibility

   !> Static equilibrium under the loads at tau = 0 with unilateral contact forces.
   subroutine find_balance(model, modes, phase, beam, is_active, q, forces, error)
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(in) :: modes
      type(phase_state_t), intent(in) :: phase
      type(modal_beam_t), intent(in) :: beam
      logical, intent(in) :: is_active(:)
      !> Modal displacements in equilibrium, [modes]
      real(wp), intent(inout) :: q(:)
      !> Contact forces P in equilibrium, [contacts]
      real(wp), intent(inout) :: forces(:)
      !> Set if no contact supports a mass that moves freely
      type(failure_t), allocatable, intent(inout) :: error

      real(wp) :: load(size(q))

      load = 0.0_wp
      if (phase%loads%count > 0) load = matmul(phase%loads%mode, value_at(phase%loads%course, 0.0_wp))
      if (any(beam%square < slow_frequency**2)) then
         call find_slow_balance(modes, model%extra, beam%row, phase%states%contact, is_active, load, q, forces, error)
         return
      end if
      q = load/beam%square
      call find_static_equilibrium(beam, phase%states%contact, is_active, q, forces, error)
   end subroutine find_balance

   !> Static displacements of the modes.
   pure subroutine find_static_shapes(self, foundation, load, shape, error)
      class(modal_beam_t), intent(in) :: self
      !> Stiffness added to each mode by an elastic foundation
      real(wp), intent(in) :: foundation
      !> Modal loads, [modes, loads]
      real(wp), intent(in) :: load(:, :)
      !> Modal displacements, [modes, loads]
      real(wp), intent(out) :: shape(:, :)
      !> Never set
      type(failure_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      shape = load/spread(foundation + self%square, 2, size(load, 2))
   end subroutine find_static_shapes

end module modal_starts
