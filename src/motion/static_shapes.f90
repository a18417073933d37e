!> Static shapes of a beam on its supports under point forces.
!>
!> In its element curvatures (`natural_coordinates`) a point force bends the beam by sums in which nothing cancels, and
!> what supports take away is a projection: on meshes however uneven more digits stay than in a factorised stiffness,
!> which may not even have positive pivots there. A spring is one coordinate more, sqrt(k) times its displacement. Where
!> the root turns freely the curvatures do not tell the shape, and the stiffness is factorised.
module static_shapes
   use beam_model, only: beam_model_t, has_rigid_mode, hold_supports
   use failures, only: failure_t
   use kinds, only: wp
   use natural_coordinates, only: coordinates_of_force, make_natural_beam, natural_beam_t, nodal_displacements
   use skyline_matrix, only: factorise, skyline_t, solve_factorised
   implicit none (type, external)
   private
   public :: elastic_beam_t, make_elastic_beam, unit_shape

   type :: elastic_beam_t
      private
      type(natural_beam_t) :: natural
      !> What the supports do not allow, orthonormal, [coordinates and springs, supports]
      real(wp), allocatable :: excluded(:, :)
      !> Degrees of freedom that are held
      integer, allocatable :: held(:)
      !> The root turns freely: K factorised
      logical :: is_pinned = .false.
      type(skyline_t) :: factors
   end type elastic_beam_t

contains

   !> Ready for forces.
   pure subroutine make_elastic_beam(model, beam, error)
      type(beam_model_t), intent(in) :: model
      type(elastic_beam_t), intent(out) :: beam
      !> Set when it is free to move without strain
      type(failure_t), allocatable, intent(out) :: error

      type(beam_model_t) :: held
      real(wp), allocatable :: direction(:)
      integer :: i, kept, springs

      beam%held = pack(model%supports%dof, .not. model%supports%stiffness > 0.0_wp)
      beam%is_pinned = has_rigid_mode(model)
      if (beam%is_pinned) then
         held = hold_supports(model)
         beam%factors = held%stiffness
         call factorise(beam%factors, error)
         return
      end if
      call make_natural_beam(model, beam%natural)
      associate (order => beam%natural%order, supports => model%supports)
         allocate (direction(order + count(supports%stiffness > 0.0_wp)))
         allocate (beam%excluded(size(direction), size(supports)), source=0.0_wp)
         springs = 0
         kept = 0
         do i = 1, size(supports)
            direction = 0.0_wp
            direction(:order) = coordinates_of_force(beam%natural, supports(i)%dof)
            if (supports(i)%stiffness > 0.0_wp) then
               springs = springs + 1
               direction(order + springs) = -1.0_wp/sqrt(supports(i)%stiffness)
            end if
            direction = direction/norm2(direction)
            call take_out(beam%excluded(:, :kept), direction)
            ! one that others hold already excludes nothing
            if (norm2(direction) <= sqrt(tiny(1.0_wp))) cycle
            kept = kept + 1
            beam%excluded(:, kept) = direction/norm2(direction)
         end do
         beam%excluded = beam%excluded(:, :kept)
      end associate
   end subroutine make_elastic_beam

   !> What of a direction is orthogonal to others; twice, as rounding in the first would show.
   pure subroutine take_out(others, direction)
      !> Orthonormal, [size, others]
      real(wp), intent(in) :: others(:, :)
      real(wp), intent(inout) :: direction(:)

      real(wp) :: before
      integer :: k, round

      before = norm2(direction)
      do round = 1, 2
         do k = 1, size(others, 2)
            direction = direction - others(:, k)*dot_product(others(:, k), direction)
         end do
      end do
      if (norm2(direction) <= 4.0_wp*epsilon(1.0_wp)*before) direction = 0.0_wp
   end subroutine take_out

   !> y and dy/dx of the nodes under a unit force, E Ibar = L = 1.
   pure function unit_shape(beam, dof) result(shape)
      type(elastic_beam_t), intent(in) :: beam
      !> Degree of freedom on which the force acts; one that is held gives no shape
      integer, intent(in) :: dof
      real(wp), allocatable :: shape(:)

      real(wp), allocatable :: direction(:)

      if (beam%is_pinned) then
         allocate (shape(beam%factors%order), source=0.0_wp)
         shape(dof) = 1.0_wp
         call solve_factorised(beam%factors, shape)
      else
         allocate (direction(size(beam%excluded, 1)), source=0.0_wp)
         direction(:beam%natural%order) = coordinates_of_force(beam%natural, dof)
         call take_out(beam%excluded, direction)
         allocate (shape(beam%natural%dofs), source=0.0_wp)
         call nodal_displacements(beam%natural, direction(:beam%natural%order), shape)
      end if
      shape(beam%held) = 0.0_wp
      if (any(beam%held == dof)) shape = 0.0_wp
   end function unit_shape

end module static_shapes
