!> The beam in its element curvatures with a pinned root (docs/theory.md, section 5).
!>
!> In the coordinates q of `natural_coordinates` the strain energy is q.q/2 and the kinetic energy |B dq/dt|^2/2. A row
!> of B gives the displacement at a quadrature point of the mass, times the square root of the mass at this point.
!>
!> The curvatures do not determine the rigid-body rotation about the root, which has no strain energy. Each coordinate
!> deflects the beam by a bend within one element plus an arbitrary amount of that rotation. In the modes this amount
!> makes the deflection orthogonal in the mass product to the rotation. Projecting the rotation out loses digits if the
!> deflection is nearly a rotation itself, as that of a bend near a clamped root is. Each bend is therefore computed,
!> without cancellation, in three forms, of which that with the smallest deflection is used: with the root, the part
!> beyond the element, or the tip at rest.
module pinned_coordinates
   use kinds, only: wp
   use natural_coordinates, only: natural_beam_t
   implicit none (type, external)
   private
   public :: pinned_flexibility, remove_rotation, rigid_rotation

   !> Form of the deflection of a bend with the part before the element at rest.
   integer, parameter :: root_at_rest = 1
   !> Form with the outer part beyond the element at rest (without rotation).
   integer, parameter :: end_at_rest = 2
   !> Form with the tip at rest (without displacement).
   integer, parameter :: tip_at_rest = 3

   !> A bend within an element, plus a rigid-body rotation of the beam.
   type :: bend_t
      !> Number of the element that bends; 0: the beam does not bend
      integer :: element = 0
      !> Curvature at the left node of the element, times the length of the element
      real(wp) :: left = 0.0_wp
      !> Curvature at the right node of the element, times the length of the element
      real(wp) :: right = 0.0_wp
      !> Form of the deflection, one of the `_at_rest` constants
      integer :: at_rest = root_at_rest
      !> Rotation of the root in this form
      real(wp) :: root_rotation = 0.0_wp
      !> Rotation of the outer part beyond the element relative to the root
      real(wp) :: rotation = 0.0_wp
      !> First moment of the curvature about the root: `rotation` times the position x/L at which the tangents on both
      !> sides of the bend intersect
      real(wp) :: moment = 0.0_wp
   end type bend_t

contains

   !> Rows of B and displacements of the nodes under each coordinate, up to a rigid-body rotation.
   pure subroutine pinned_flexibility(natural, flexibility, nodal)
      type(natural_beam_t), intent(in) :: natural
      !> Rows of B for each coordinate, [rows, order]
      real(wp), allocatable, intent(out) :: flexibility(:, :)
      !> y and dy/dx of the nodes and the root for each coordinate, [dofs, order]
      real(wp), allocatable, intent(out) :: nodal(:, :)

      real(wp) :: column(natural%rows), min_norm
      type(bend_t) :: bend
      integer :: form, j

      allocate (flexibility(natural%rows, natural%order), nodal(natural%dofs, natural%order))
      do j = 1, natural%order
         min_norm = huge(1.0_wp)
         do form = root_at_rest, tip_at_rest
            bend = bend_of(natural, j, form)
            call deflection_of(natural, bend, column)
            if (norm2(column) >= min_norm) cycle
            min_norm = norm2(column)
            flexibility(:, j) = column
            call nodal_motion_of(natural, bend, nodal(:, j))
         end do
      end do
   end subroutine pinned_flexibility

   !> Project each column to be orthogonal to the rigid-body rotation. A second pass removes rounding errors.
   pure subroutine remove_rotation(natural, flexibility, nodal)
      type(natural_beam_t), intent(in) :: natural
      !> Rows of B for each coordinate, [rows, order]
      real(wp), intent(inout) :: flexibility(:, :)
      !> y and dy/dx of the nodes and the root for each coordinate, [dofs, order]
      real(wp), intent(inout) :: nodal(:, :)

      real(wp) :: direction(natural%rows), motion(natural%dofs), amount
      integer :: j, pass

      call rigid_rotation(natural, direction, motion)
      do pass = 1, 2
         do j = 1, size(flexibility, 2)
            amount = dot_product(direction, flexibility(:, j))
            flexibility(:, j) = flexibility(:, j) - amount*direction
            nodal(:, j) = nodal(:, j) - amount*motion
         end do
      end do
   end subroutine remove_rotation

   !> The rigid-body rotation about the root, of unit modal mass.
   pure subroutine rigid_rotation(natural, direction, motion)
      type(natural_beam_t), intent(in) :: natural
      !> Rows of B of the rotation, of unit length, [rows]
      real(wp), intent(out) :: direction(:)
      !> y and dy/dx of the nodes and the root, [dofs]
      real(wp), intent(out) :: motion(:)

      type(bend_t) :: rotation_alone
      real(wp) :: length

      rotation_alone%root_rotation = 1.0_wp
      rotation_alone%rotation = 1.0_wp
      call deflection_of(natural, rotation_alone, direction)
      call nodal_motion_of(natural, rotation_alone, motion)
      length = norm2(direction)
      direction = direction/length
      motion = motion/length
   end subroutine rigid_rotation

   !> The bend of a unit coordinate.
   pure type(bend_t) function bend_of(natural, coordinate, form) result(bend)
      type(natural_beam_t), intent(in) :: natural
      integer, intent(in) :: coordinate
      !> Part of the beam that is at rest, one of the `_at_rest` constants
      integer, intent(in) :: form

      real(wp), parameter :: one_sixth = 1.0_wp/6.0_wp

      bend%element = (coordinate + 1)/2
      bend%at_rest = form
      associate (length => natural%length(bend%element), inverse => natural%inverse(:, bend%element), &
         left => bend%left, right => bend%right)
         if (2*bend%element > coordinate) then
            left = inverse(1)*length
         else
            left = inverse(2)*length
            right = inverse(3)*length
         end if
         bend%rotation = 0.5_wp*(left + right)
         bend%moment = bend%rotation*natural%position(bend%element - 1) + one_sixth*length*(left + 2.0_wp*right)
         if (form == end_at_rest) bend%root_rotation = -bend%rotation
         if (form == tip_at_rest) bend%root_rotation = -(one_sixth*length*(2.0_wp*left + right) &
            + bend%rotation*natural%tip_distance(bend%element))
      end associate
   end function bend_of

   !> Displacement of a point beyond the bent element.
   pure real(wp) function outer_displacement(bend, x, tip_distance) result(displacement)
      type(bend_t), intent(in) :: bend
      !> Distance of the point to the root
      real(wp), intent(in) :: x
      !> Distance of the point to the tip
      real(wp), intent(in) :: tip_distance

      select case (bend%at_rest)
      case (end_at_rest)
         displacement = -bend%moment
      case (tip_at_rest)
         displacement = -bend%moment*tip_distance
      case default
         displacement = bend%rotation*x - bend%moment
      end select
   end function outer_displacement

   !> The deflection of a bend as a column of B.
   pure subroutine deflection_of(natural, bend, column)
      type(natural_beam_t), intent(in) :: natural
      type(bend_t), intent(in) :: bend
      !> Column of B, [rows]
      real(wp), intent(out) :: column(:)

      real(wp), parameter :: one_sixth = 1.0_wp/6.0_wp
      real(wp) :: displacement, nodal(natural%dofs), x, xi
      integer :: dof, element, i, row

      do element = 1, natural%elements
         do row = natural%last_row(element - 1) + 1, natural%last_row(element)
            xi = natural%point(row)
            associate (length => natural%length(element))
               x = natural%position(element - 1) + xi*length
               if (element > bend%element) then
                  displacement = outer_displacement(bend, x, natural%tip_distance(element) + (1.0_wp - xi)*length)
               else
                  displacement = bend%root_rotation*x
                  if (element == bend%element) displacement = displacement + &
                     length*xi**2*(bend%left*(0.5_wp - one_sixth*xi) + bend%right*one_sixth*xi)
               end if
            end associate
            column(row) = natural%sqrt_mass(row)*displacement
         end do
      end do
      call nodal_motion_of(natural, bend, nodal)
      if (natural%sqrt_tip_mass > 0.0_wp) column(natural%beam_rows) = natural%sqrt_tip_mass &
         *nodal(2*natural%elements - 1)
      do i = 1, size(natural%mass_node)
         dof = 2*natural%mass_node(i) - 1
         row = natural%beam_rows + 2*i - 1
         column(row:row + 1) = natural%sqrt_point_mass(:, i)*nodal(dof:dof + 1)
      end do
   end subroutine deflection_of

   !> y and dy/dx of the nodes, and the rotation of the root, of a bend.
   pure subroutine nodal_motion_of(natural, bend, nodal)
      type(natural_beam_t), intent(in) :: natural
      type(bend_t), intent(in) :: bend
      !> Displacements and rotations, [dofs]
      real(wp), intent(out) :: nodal(:)

      integer :: node

      nodal(natural%root_dofs(2)) = bend%root_rotation
      do node = 1, natural%elements
         associate (x => natural%position(node))
            if (node < bend%element) then
               nodal(2*node - 1:2*node) = bend%root_rotation*[x, 1.0_wp]
            else
               nodal(2*node - 1) = outer_displacement(bend, x, natural%tip_distance(node))
               nodal(2*node) = 0.0_wp
               if (bend%at_rest == root_at_rest) nodal(2*node) = bend%rotation
               if (bend%at_rest == tip_at_rest) nodal(2*node) = bend%moment
            end if
         end associate
      end do
   end subroutine nodal_motion_of

end module pinned_coordinates
