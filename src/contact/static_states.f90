!> Beam and surfaces at rest: where a run starts, and where it ends at last.
!>
!> Scales: displacement eta, forces Pbar / (hbar/L), as of the laws of the stops.
module static_states
   use beam_model, only: beam_model_t
   use contact_starts, only: find_carrying_forces
   use failures, only: fail, failure_t, status_bad_input
   use held_coordinates, only: held_beam_t
   use kinds, only: lambda1_power4, wp
   use number_text, only: to_text
   use static_shapes, only: make_elastic_beam, unit_shape
   use stop_surfaces, only: acting, is_beyond, surface_t
   implicit none (type, external)
   private
   public :: find_static_start, find_static_rest

contains

   !> At rest in the static shape of a force at the stop from which the beam is released, 1 away from its surface.
   pure subroutine find_static_start(model, surfaces, displacement, error)
      type(beam_model_t), intent(in) :: model
      !> All surfaces
      type(surface_t), intent(in) :: surfaces(:)
      !> y and dy/dx of the nodes, [order]
      real(wp), allocatable, intent(out) :: displacement(:)
      !> Set when no force at that stop moves it, or when the shape reaches beyond another surface
      type(failure_t), allocatable, intent(out) :: error

      type(held_beam_t) :: beam
      real(wp) :: gap
      integer :: dof, k, pulled

      call make_elastic_beam(model, beam, error)
      if (allocated(error)) return
      pulled = findloc(surfaces%is_pulled, .true., dim=1)
      dof = model%stop_dofs(surfaces(pulled)%stop)
      if (any(model%supports%dof == dof .and. model%supports%stiffness <= 0.0_wp)) then
         call fail(error, status_bad_input, 'the beam cannot be pulled away from a stop at a rigid support')
         return
      end if
      displacement = unit_shape(beam, dof)
      displacement = displacement*(surfaces(pulled)%sign*(1.0_wp + surfaces(pulled)%height)/displacement(dof))
      do k = 1, size(surfaces)
         gap = surfaces(k)%sign*displacement(model%stop_dofs(surfaces(k)%stop)) - surfaces(k)%height
         if (.not. is_beyond(surfaces(k), gap)) cycle
         call fail(error, status_bad_input, 'the beam, pulled away from the stop at '// &
            to_text(surfaces(pulled)%settings%position)//', starts beyond the surface at '// &
            to_text(surfaces(k)%settings%position)//', by '//to_text(-gap)//' of the distance it was pulled')
         return
      end do
   end subroutine find_static_start

   !> At rest on the surfaces that carry it: forces that push only, their yielding ones in a row with the beam.
   pure subroutine find_static_rest(model, surfaces, forces, energy, error)
      type(beam_model_t), intent(in) :: model
      !> All surfaces
      type(surface_t), intent(in) :: surfaces(:)
      !> P of each
      real(wp), intent(out) :: forces(:)
      !> Of the beam and of all springs
      real(wp), intent(out) :: energy
      !> Set when nothing holds the beam
      type(failure_t), allocatable, intent(out) :: error

      type(held_beam_t) :: beam
      type(surface_t), allocatable :: bearing(:)
      real(wp), allocatable :: compliance(:, :), push(:), shape(:)
      integer, allocatable :: dofs(:)
      logical :: acts(size(surfaces))
      integer :: k

      forces = 0.0_wp
      energy = 0.0_wp
      call make_elastic_beam(model, beam, error)
      if (allocated(error)) return
      acts = acting(surfaces, model%stop_dofs(surfaces%stop))
      bearing = pack(surfaces, acts)
      dofs = model%stop_dofs(bearing%stop)
      allocate (compliance(size(dofs), size(dofs)), push(size(dofs)))
      do k = 1, size(dofs)
         shape = unit_shape(beam, dofs(k))
         compliance(:, k) = bearing%sign*(lambda1_power4*bearing(k)%sign)*shape(dofs)
      end do
      call find_carrying_forces(bearing, -bearing%height, compliance, push)
      energy = 0.5_wp*dot_product(push, matmul(compliance, push))
      forces = unpack(push, acts, forces)
   end subroutine find_static_rest

end module static_states
