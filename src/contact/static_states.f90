!> Static states of beam and stops: the start of a run by release from a stop, and the equilibrium to which a motion
!> without loads decays.
!>
!> Scales: displacements in D (eta), forces P in lambda1^4 E Ibar D/L^3, as in the laws of the stops.
module static_states
   use beam_model, only: beam_model_t
   use contact_starts, only: find_static_forces
   use failures, only: fail, failure_t, status_bad_input
   use kinds, only: lambda1_power4, wp
   use number_text, only: to_text
   use run_settings, only: extra_dof_t
   use static_shapes, only: make_elastic_beam, unit_shape
   use stop_contacts, only: active_contacts, force_on_extra, penetrates, contact_t
   use support_coordinates, only: supported_beam_t
   implicit none (type, external)
   private
   public :: find_static_start, find_static_rest

contains

   !> Static shape of a force at the stop from which the beam is released, with a gap of 1 at that contact. Only
   !> fixed contacts are checked, because other surfaces are placed after the beam.
   pure subroutine find_static_start(model, contacts, displacement, error)
      type(beam_model_t), intent(in) :: model
      !> All contacts
      type(contact_t), intent(in) :: contacts(:)
      !> y and dy/dx of the nodes, [degrees of freedom]
      real(wp), allocatable, intent(out) :: displacement(:)
      !> Set if the beam is a mechanism, if no force at that stop moves the beam, or if the shape penetrates another
      !> contact
      type(failure_t), allocatable, intent(out) :: error

      type(supported_beam_t) :: beam
      real(wp) :: gap
      integer :: dof, k, release_contact

      call make_elastic_beam(model, beam, error)
      if (allocated(error)) return
      release_contact = findloc(contacts%is_release_contact, .true., dim=1)
      dof = model%stop_dofs(contacts(release_contact)%stop)
      if (any(model%supports%dof == dof .and. model%supports%stiffness <= 0.0_wp)) then
         call fail(error, status_bad_input, 'the beam cannot be pulled away from a stop at a rigid support')
         return
      end if
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
            to_text(contacts(k)%settings%position)//', by '//to_text(-gap)//' of the distance it was pulled; ' &
            //"&start kind = 'balance' begins in equilibrium on the stops")
         return
      end do
   end subroutine find_static_start

   !> Static equilibrium on the active contacts without loads: unilateral forces, with the springs of compliant stops in
   !> series with the beam, and with the springs of extra degrees of freedom.
   pure subroutine find_static_rest(model, contacts, forces, energy, error, extra)
      type(beam_model_t), intent(in) :: model
      !> All contacts
      type(contact_t), intent(in) :: contacts(:)
      !> Force P of each contact
      real(wp), intent(out) :: forces(:)
      !> Strain energy of the beam and of all springs, in rho Abar L omega1^2 D^2
      real(wp), intent(out) :: energy
      !> Set if the beam is a mechanism
      type(failure_t), allocatable, intent(out) :: error
      !> Extra degrees of freedom, each with a spring; absent: there are none
      type(extra_dof_t), intent(in), optional :: extra(:)

      type(supported_beam_t) :: beam
      type(contact_t), allocatable :: active(:)
      real(wp), allocatable :: compliance(:, :), active_forces(:), shape(:)
      integer, allocatable :: dofs(:)
      logical :: is_active(size(contacts))
      integer :: i, k

      forces = 0.0_wp
      energy = 0.0_wp
      call make_elastic_beam(model, beam, error)
      if (allocated(error)) return
      is_active = active_contacts(contacts, model%stop_dofs(contacts%stop))
      active = pack(contacts, is_active)
      dofs = model%stop_dofs(active%stop)
      allocate (compliance(size(dofs), size(dofs)), active_forces(size(dofs)))
      do k = 1, size(dofs)
         shape = unit_shape(beam, dofs(k))
         ! `unit_shape` has E Ibar = L = 1: lambda1^4 converts it to the unit of forces
         compliance(:, k) = merge(0.0_wp, active%sign*(lambda1_power4*active(k)%sign)*shape(dofs), &
            active%settings%is_of_base .or. active(k)%settings%is_of_base)
         if (.not. present(extra)) cycle
         do i = 1, size(extra)
            compliance(:, k) = compliance(:, k) + force_on_extra(active, i)*force_on_extra(active(k), i) &
               /(extra(i)%mass*extra(i)%square)
         end do
      end do
      call find_static_forces(active, -active%height, compliance, active_forces)
      energy = 0.5_wp*dot_product(active_forces, matmul(compliance, active_forces))
      forces = unpack(active_forces, is_active, forces)
   end subroutine find_static_rest

end module static_states
