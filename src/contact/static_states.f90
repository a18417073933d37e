!> Static states of beam and stops: the start of a run by release from a stop, and the equilibrium to which a motion
!> without loads decays.
!>
!> In element curvatures (`support_coordinates`) a point force bends the beam by sums in which nothing cancels, and
!> rigid supports act by a projection. On very uneven meshes this is more accurate than a factorised stiffness matrix,
!> which on such meshes may not even have positive pivots.
!>
!> Scales: displacements in D (eta), forces P in lambda1^4 E Ibar D/L^3, as in the laws of the stops.
module static_states
   use beam_model, only: beam_model_t, beam_alone
   use contact_starts, only: find_static_forces
   use failures, only: fail, failure_t, status_bad_input
   use kinds, only: lambda1_power4, wp
   use number_text, only: rounded, to_text
   use stop_contacts, only: active_contacts, penetrates, shape_of_contact, contact_t
   use support_coordinates, only: supported_beam_t, displace, displace_transposed, make_supported_beam
   implicit none (type, external)
   private
   public :: find_static_start, find_static_rest, make_elastic_beam, unit_shape

contains

   !> Static shape of a force at the stop from which the beam is released, with a gap of 1 at that contact. Only
   !> fixed contacts are checked, because other surfaces are placed after the beam. The beam is no mechanism, and no
   !> rigid support is at that stop.
   pure subroutine find_static_start(model, contacts, displacement, error)
      type(beam_model_t), intent(in) :: model
      !> All contacts
      type(contact_t), intent(in) :: contacts(:)
      !> y and dy/dx of the nodes, [degrees of freedom]
      real(wp), allocatable, intent(out) :: displacement(:)
      !> Set if the shape penetrates another contact
      type(failure_t), allocatable, intent(out) :: error

      type(supported_beam_t) :: beam
      real(wp) :: gap
      integer :: dof, k, release_contact

      call make_elastic_beam(model, beam)
      release_contact = findloc(contacts%is_release_contact, .true., dim=1)
      dof = model%stop_dofs(contacts(release_contact)%stop)
      displacement = unit_shape(beam, dof)
      ! a gap of 1 at the release contact is the displacement s (1 + h), with sign s and height h of the contact
      displacement = displacement*(contacts(release_contact)%sign*(1.0_wp &
         + contacts(release_contact)%height)/displacement(dof))
      do k = 1, size(contacts)
         if (.not. contacts(k)%is_fixed) cycle
         gap = contacts(k)%sign*displacement(model%stop_dofs(contacts(k)%stop)) - contacts(k)%height
         if (.not. penetrates(contacts(k), gap)) cycle
         call fail(error, status_bad_input, 'the beam, pulled away from the stop at x/L = '// &
            to_text(contacts(release_contact)%settings%position)//', starts beyond the surface at x/L = '// &
            to_text(contacts(k)%settings%position)//', by '//rounded(-gap)//' of the distance it was pulled; ' &
            //"&start kind = 'balance' begins in equilibrium on the stops")
         return
      end do
   end subroutine find_static_start

   !> Static equilibrium on the active contacts without loads: unilateral forces, with the springs of compliant stops in
   !> series with the beam.
   pure subroutine find_static_rest(model, contacts, forces, energy)
      type(beam_model_t), intent(in) :: model
      !> All contacts
      type(contact_t), intent(in) :: contacts(:)
      !> Force P of each contact
      real(wp), intent(out) :: forces(:)
      !> Strain energy of the beam and of all springs, in rho Abar L omega1^2 D^2
      real(wp), intent(out) :: energy

      type(supported_beam_t) :: beam
      type(contact_t), allocatable :: active(:)
      real(wp), allocatable :: compliance(:, :), active_forces(:)
      ! displacements under a force at one contact
      real(wp) :: response(model%stiffness%order, 1)
      logical :: is_active(size(contacts))
      integer :: j, k

      forces = 0.0_wp
      energy = 0.0_wp
      call make_elastic_beam(beam_alone(model), beam)
      is_active = active_contacts(contacts, model%stop_dofs(contacts%stop))
      active = pack(contacts, is_active)
      allocate (compliance(size(active), size(active)), active_forces(size(active)))
      do k = 1, size(active)
         ! shapes have E Ibar = L = 1: lambda1^4 converts them to the unit of forces
         response(:, 1) = lambda1_power4*active(k)%sign*(unit_response(model%stop_dofs(active(k)%stop)) &
            - unit_response(model%partner_dofs(active(k)%stop)))
         compliance(:, k) = [(shape_of_contact(active(j), model, response), j=1, size(active))]
      end do
      call find_static_forces(active, -active%height, compliance, active_forces)
      energy = 0.5_wp*dot_product(active_forces, matmul(compliance, active_forces))
      forces = unpack(active_forces, is_active, forces)

   contains

      !> Displacements under a unit force on a degree of freedom, which belongs to the elements of the beam or has a
      !> spring of its own.
      pure function unit_response(dof) result(displacement)
         !> 0: there is none
         integer, intent(in) :: dof
         real(wp) :: displacement(size(response))

         displacement = 0.0_wp
         if (dof > beam%dofs) then
            displacement(dof) = 1.0_wp/model%stiffness%values(model%stiffness%diagonal(dof))
         else if (dof > 0) then
            displacement(:beam%dofs) = unit_shape(beam, dof)
         end if
      end function unit_response

   end subroutine find_static_rest

   !> Prepare a beam on its supports, which cannot move without strain, for static forces.
   pure subroutine make_elastic_beam(model, beam)
      type(beam_model_t), intent(in) :: model
      type(supported_beam_t), intent(out) :: beam

      type(beam_model_t) :: elastic

      ! in statics a massless node is like any other
      elastic = model
      elastic%has_massless_node = .false.
      call make_supported_beam(elastic, beam)
   end subroutine make_elastic_beam

   !> Displacements y and slopes dy/dx of the nodes under a unit force, E Ibar = L = 1.
   pure function unit_shape(beam, dof) result(shape)
      type(supported_beam_t), intent(in) :: beam
      !> Degree of freedom of the force; the shape is zero if a support fixes it
      integer, intent(in) :: dof
      real(wp), allocatable :: shape(:)

      real(wp) :: force(beam%dofs), strain(beam%order)

      allocate (shape(beam%dofs), source=0.0_wp)
      if (any(beam%supported == dof)) return
      force = 0.0_wp
      force(dof) = 1.0_wp
      call displace_transposed(beam, force, strain)
      call displace(beam, strain, shape)
   end function unit_shape

end module static_states
