!> States of a beam in its modes: the initial state of a motion by either method (release from rest, static equilibrium
!> under the loads, or given displacements and velocities; docs/theory.md, section 18), and the equilibrium to which a
!> motion without loads decays. In a release the unit of displacement D is the initial distance of the beam from the
!> release contact; in other starts D is a given scale.
module modal_starts
   use beam_model, only: beam_model_t
   use beam_starts, only: find_start_momenta
   use contact_starts, only: find_slow_balance, find_static_equilibrium, find_static_forces, check_mode_count, &
      check_start, flexible_beam_t, move_onto_contacts
   use failures, only: failure_t
   use few_modes, only: number_of_modes
   use free_modes, only: complete_start, free_modes_t
   use kinds, only: wp
   use load_settings, only: is_in_mode, start_balance, start_drop, start_mode, start_release, &
      start_table, start_velocity
   use number_text, only: to_text
   use point_forces, only: slow_frequency
   use run_settings, only: run_settings_t
   use stop_contacts, only: active_contacts, contact_t
   implicit none (type, external)
   private
   public :: modal_beam_t, find_modal_start, find_rest_in_modes

   !> The beam in its free modes, as a flexible body under static contact forces.
   type, extends(flexible_beam_t) :: modal_beam_t
      !> W^2, squared frequencies, [modes]
      real(wp), allocatable :: square(:)
      !> Flexibility of the beam at a massless node at the only stop (of a redistributed mass matrix), in addition to
      !> that of the modes; 0: there is no massless node
      real(wp) :: node_flexibility = 0.0_wp
   contains
      procedure :: find_static_shapes
   end type modal_beam_t

contains

   !> Find the initial state of the modes and the contact forces.
   subroutine find_modal_start(model, modes, settings, beam, contacts, q, v, forces, error)
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(in) :: modes
      type(run_settings_t), intent(in) :: settings
      type(modal_beam_t), intent(in) :: beam
      type(contact_t), intent(in) :: contacts(:)
      !> On entry modal loads at tau = 0, on return modal displacements, [modes]
      real(wp), intent(inout) :: q(:)
      !> Modal velocities, [modes]
      real(wp), intent(out) :: v(:)
      !> Contact forces P, [contacts]
      real(wp), intent(out) :: forces(:)
      !> Set if the beam penetrates a contact, no contact supports a mass that moves freely, or there are more rigid
      !> stops than modes
      type(failure_t), allocatable, intent(inout) :: error

      ! M y and M dy/dtau of the start, [degrees of freedom, 2]
      real(wp) :: mass_times_start(model%mass%order, 2)
      ! the motion has fewer modes than the mesh, the start is a release, and no node is massless
      logical :: is_truncated
      ! no other rigid contact at the same point and on the same side is in front of the contact
      logical :: is_active(size(contacts))
      real(wp) :: load(size(q))

      load = q
      q = 0.0_wp
      v = 0.0_wp
      forces = 0.0_wp
      call check_mode_count(contacts, model%stop_dofs(contacts%stop), beam%row, error)
      if (allocated(error)) return
      is_active = active_contacts(contacts, model%stop_dofs(contacts%stop))
      associate (start => settings%start)
         select case (start%kind)
         case (start_release)
            ! the static shape of a force at the release contact, with a gap of 1 at this contact
            associate (released => findloc(contacts%is_release_contact, .true., dim=1))
               associate (b => beam%row(:, released))
                  q = (1.0_wp + contacts(released)%height)*b &
                     /(beam%square*(sum(b**2/beam%square) + beam%node_flexibility))
               end associate
            end associate
         case (start_balance)
            if (any(beam%square < slow_frequency**2)) then
               call find_slow_balance(modes, beam%row, contacts, is_active, load, q, forces, error)
            else
               q = load/beam%square
               call find_static_equilibrium(beam, contacts, is_active, q, forces, error)
            end if
         case (start_velocity, start_drop, start_mode, start_table)
            if (is_in_mode(start)) then
               associate (tip => modes%mode(modes%tip_dof, start%mode))
                  if (start%kind == start_mode) q(start%mode) = start%displacement/tip
                  v(start%mode) = start%velocity/tip
               end associate
            else
               call find_start_momenta(model, start, mass_times_start(:, 1), mass_times_start(:, 2))
               q = matmul(mass_times_start(:, 1), modes%mode)
               v = matmul(mass_times_start(:, 2), modes%mode)
            end if
         end select
      end associate
      call complete_start(model, settings%start%kind == start_balance, q, v, modes)
      ! The static shape of a release was checked on the finite-element model before the modes were computed. The sum of
      ! all modes has the same displacements at the stops, so that only truncation can make the shape penetrate a
      ! contact; if a node is massless, there is no other contact to penetrate
      is_truncated = settings%start%kind == start_release .and. &
         size(q) < number_of_modes(model) .and. .not. beam%node_flexibility > 0.0_wp
      if (settings%start%kind /= start_release .or. is_truncated .or. .not. all(contacts%is_fixed)) then
         call check_start(beam, contacts, forces, q, error)
      end if
      if (allocated(error) .and. is_truncated) error%message = error%message//', because the static shape of the ' &
         //'start needs more modes than the '//to_text(size(q))//' of the motion'
      if (.not. allocated(error)) call move_onto_contacts(beam, contacts, is_active, forces, q, error)
   end subroutine find_modal_start

   !> Static equilibrium on the active contacts without loads. No mode may be without strain (W = 0).
   pure subroutine find_rest_in_modes(beam, contacts, is_active, forces, energy)
      type(modal_beam_t), intent(in) :: beam
      type(contact_t), intent(in) :: contacts(:)
      !> Whether each contact is active, [contacts]
      logical, intent(in) :: is_active(:)
      !> Force P of each contact; 0 if the contact is not active
      real(wp), intent(out) :: forces(:)
      !> Strain energy of the beam, of its supports and of the springs of the contacts
      real(wp), intent(out) :: energy

      real(wp) :: active_forces(count(is_active))
      ! displacement at each active contact per unit force at each active contact; `find_static_forces` adds the springs
      ! of the contacts
      real(wp) :: compliance(count(is_active), count(is_active))
      ! indices of the active contacts
      integer :: place(count(is_active))
      integer :: k

      place = pack([(k, k=1, size(is_active))], is_active)
      associate (b => beam%row(:, place))
         compliance = matmul(transpose(b), b/spread(beam%square, 2, size(place))) + beam%node_flexibility
      end associate
      call find_static_forces(contacts(place), -contacts(place)%height, compliance, active_forces)
      forces = 0.0_wp
      forces(place) = active_forces
      energy = 0.5_wp*dot_product(forces, contacts%height)
   end subroutine find_rest_in_modes

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
