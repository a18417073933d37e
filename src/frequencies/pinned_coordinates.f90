!> The beam in its element curvatures where it turns freely about its root (docs/theory.md, section 5).
!>
!> The curvatures leave a rotation open, which has no strain. Every coordinate moves the beam by a bend about its
!> element and as much of that rotation as one likes; in the modes it is orthogonal in the mass product to the
!> rotation. To project it out loses digits where the bend, from a clamped root, is nearly a rotation itself, as those
!> near the root are. So each bend is taken, without cancellation, in that of three forms which is least: with the
!> root, the part beyond the element, or the tip at rest.
module pinned_coordinates
   use kinds, only: wp
   use natural_coordinates, only: natural_beam_t
   implicit none (type, external)
   private
   public :: pinned_flexibility, take_rotation_out, rigid_rotation

   !> What has no motion.
   integer, parameter :: root_at_rest = 1
   integer, parameter :: end_at_rest = 2
   integer, parameter :: tip_at_rest = 3

   !> A bend within an element, and a rotation of the whole.
   type :: bend_t
      integer :: element = 0
      !> Its curvature at the left and at the right node, times its length
      real(wp) :: left = 0.0_wp
      real(wp) :: right = 0.0_wp
      !> One of the constants above, and the rotation at the root that it comes to
      integer :: at_rest = root_at_rest
      real(wp) :: root_rotation = 0.0_wp
      !> Rotation of what is beyond the element against the root, and that times the place of the bend
      real(wp) :: rotation = 0.0_wp
      real(wp) :: moment = 0.0_wp
   end type bend_t

contains

   !> Rows of B and motions of the nodes, but for a rotation of the whole.
   pure subroutine pinned_flexibility(natural, flexibility, nodal)
      type(natural_beam_t), intent(in) :: natural
      !> [rows, order]
      real(wp), allocatable, intent(out) :: flexibility(:, :)
      !> [dofs, order]
      real(wp), allocatable, intent(out) :: nodal(:, :)

      real(wp) :: column(natural%rows), least
      type(bend_t) :: bend
      integer :: form, j

      allocate (flexibility(natural%rows, natural%order), nodal(natural%dofs, natural%order))
      do j = 1, natural%order
         least = huge(1.0_wp)
         do form = root_at_rest, tip_at_rest
            bend = bend_of(natural, j, form)
            call rows_of(natural, bend, column)
            if (norm2(column) >= least) cycle
            least = norm2(column)
            flexibility(:, j) = column
            call nodes_of(natural, bend, nodal(:, j))
         end do
      end do
   end subroutine pinned_flexibility

   !> Project each column to be orthogonal to the rotation of the whole; twice, the second time for rounding.
   pure subroutine take_rotation_out(natural, flexibility, nodal)
      type(natural_beam_t), intent(in) :: natural
      !> [rows, order]
      real(wp), intent(inout) :: flexibility(:, :)
      !> [dofs, order]
      real(wp), intent(inout) :: nodal(:, :)

      real(wp) :: direction(natural%rows), motion(natural%dofs), share
      integer :: j, pass

      call rigid_rotation(natural, direction, motion)
      do pass = 1, 2
         do j = 1, size(flexibility, 2)
            share = dot_product(direction, flexibility(:, j))
            flexibility(:, j) = flexibility(:, j) - share*direction
            nodal(:, j) = nodal(:, j) - share*motion
         end do
      end do
   end subroutine take_rotation_out

   !> The rotation about the root, of unit modal mass.
   pure subroutine rigid_rotation(natural, direction, motion)
      type(natural_beam_t), intent(in) :: natural
      !> Its rows of B, of unit length, [rows]
      real(wp), intent(out) :: direction(:)
      !> y and dy/dx of the nodes, [dofs]
      real(wp), intent(out) :: motion(:)

      type(bend_t) :: turn
      real(wp) :: length

      turn%root_rotation = 1.0_wp
      turn%rotation = 1.0_wp
      call rows_of(natural, turn, direction)
      call nodes_of(natural, turn, motion)
      length = norm2(direction)
      direction = direction/length
      motion = motion/length
   end subroutine rigid_rotation

   !> The bend of a coordinate.
   pure function bend_of(natural, coordinate, form) result(bend)
      type(natural_beam_t), intent(in) :: natural
      integer, intent(in) :: coordinate
      !> What is at rest
      integer, intent(in) :: form
      type(bend_t) :: bend

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

   !> Displacement of a place beyond the element.
   pure function displacement_beyond(bend, x, tip_distance) result(displacement)
      type(bend_t), intent(in) :: bend
      !> Distances to the root and to the tip
      real(wp), intent(in) :: x
      real(wp), intent(in) :: tip_distance
      real(wp) :: displacement

      select case (bend%at_rest)
      case (end_at_rest)
         displacement = -bend%moment
      case (tip_at_rest)
         displacement = -bend%moment*tip_distance
      case default
         displacement = bend%rotation*x - bend%moment
      end select
   end function displacement_beyond

   !> Rotation beyond the element.
   pure function rotation_beyond(bend) result(rotation)
      type(bend_t), intent(in) :: bend
      real(wp) :: rotation

      rotation = 0.0_wp
      if (bend%at_rest == root_at_rest) rotation = bend%rotation
      if (bend%at_rest == tip_at_rest) rotation = bend%moment
   end function rotation_beyond

   !> Rows of B.
   pure subroutine rows_of(natural, bend, column)
      type(natural_beam_t), intent(in) :: natural
      type(bend_t), intent(in) :: bend
      !> [rows]
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
                  displacement = displacement_beyond(bend, x, natural%tip_distance(element) + (1.0_wp - xi)*length)
               else
                  displacement = bend%root_rotation*x
                  if (element == bend%element) displacement = displacement + &
                     length*xi**2*(bend%left*(0.5_wp - one_sixth*xi) + bend%right*one_sixth*xi)
               end if
            end associate
            column(row) = natural%root_mass(row)*displacement
         end do
      end do
      call nodes_of(natural, bend, nodal)
      if (natural%root_tip_mass > 0.0_wp) column(natural%beam_rows) = natural%root_tip_mass &
         *nodal(2*natural%elements - 1)
      do i = 1, size(natural%mass_node)
         dof = 2*natural%mass_node(i) - 1
         row = natural%beam_rows + 2*i - 1
         column(row:row + 1) = natural%root_of_mass(:, i)*nodal(dof:dof + 1)
      end do
   end subroutine rows_of

   !> y and dy/dx of the nodes, and the rotation of the root.
   pure subroutine nodes_of(natural, bend, nodal)
      type(natural_beam_t), intent(in) :: natural
      type(bend_t), intent(in) :: bend
      !> [dofs]
      real(wp), intent(out) :: nodal(:)

      integer :: node

      nodal(natural%root_dofs(2)) = bend%root_rotation
      do node = 1, natural%elements
         associate (x => natural%position(node))
            if (node < bend%element) then
               nodal(2*node - 1:2*node) = bend%root_rotation*[x, 1.0_wp]
            else
               nodal(2*node - 1) = displacement_beyond(bend, x, natural%tip_distance(node))
               nodal(2*node) = rotation_beyond(bend)
            end if
         end associate
      end do
   end subroutine nodes_of

end module pinned_coordinates
