!> Static shapes of a beam on its supports under point forces.
!>
!> In element curvatures (`support_coordinates`) a point force bends the beam by sums in which nothing cancels, and
!> rigid supports act by a projection. On very uneven meshes this is more accurate than a factorised stiffness matrix,
!> which on such meshes may not even have positive pivots.
module static_shapes
   use beam_model, only: beam_model_t
   use kinds, only: wp
   use support_coordinates, only: displace, displace_transposed, supported_beam_t, make_supported_beam
   implicit none (type, external)
   private
   public :: make_elastic_beam, unit_shape

contains

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

end module static_shapes
