!> The beam in its element curvatures (docs/theory.md, section 5).
!>
!> A cantilever is statically determinate: the curvatures of its elements (linear in each element,
!> two values) determine all displacements through sums of positive terms down the beam, in which
!> nothing cancels. The stiffness is block diagonal, 2 x 2; each block S = L L^T gives coordinates
!> q = L^T (curvatures) in which the strain energy is q.q/2. The kinetic energy is |B q'|^2/2, where
!> the rows of B are sqrt(w rho A) y at the quadrature points of the mass matrix, sqrt(mu) y(L), and sqrt(m) y and
!> sqrt(J) dy/dx at point masses. So omega^-2 = lambda^-4 are the squared singular values of B.
!>
!> On springs at the root it is statically determinate still: their forces are two coordinates more, q = sqrt(k) times
!> the displacement or the rotation of the root, in series with the beam's, and nothing cancels.
!>
!> These are the same K, M and elements as the assembled matrices', the same quadrature, only other
!> coordinates. Units: E Ibar = rho Abar = L = 1.
module natural_coordinates
   use beam_element, only: gauss_rule, hermite_curvature, hermite_shape, section_pieces
   use beam_model, only: beam_model_t
   use beam_section, only: area, area_degree, inertia, inertia_degree
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: natural_beam_t, make_natural_beam, deflect, deflect_transposed, nodal_displacements
   public :: flexibility_matrix, nodal_flexibility, coordinates_of_shape, coordinates_of_forces, row_shape

   real(wp), parameter :: one_sixth = 1.0_wp/6.0_wp
   real(wp), parameter :: one_third = 1.0_wp/3.0_wp

   type :: natural_beam_t
      !> Number of elements n
      integer :: elements = 0
      !> Number of coordinates: two an element, then those of the springs at the root
      integer :: order = 0
      !> 1/sqrt(k) of these springs, and their coordinates; 0: the root does not move so
      real(wp) :: root_give(2) = 0.0_wp
      integer :: root_place(2) = 0
      !> Degrees of freedom of the nodes and the root, and the places of those of the root among them
      integer :: dofs = 0
      integer :: root_dofs(2) = 0
      !> Rows of B
      integer :: rows = 0
      !> Lengths of the elements, [n]
      real(wp), allocatable :: length(:)
      !> x of the nodes and their distances to the tip, [0:n]
      real(wp), allocatable :: position(:), tip_distance(:)
      !> L^-T of each element's stiffness S = L L^T, its entries 11, 12, 22, which turns coordinates into
      !> curvatures, [3, n]
      real(wp), allocatable :: inverse(:, :)
      !> Last row of B of each element, [0:n]; those of element i are last_row(i - 1) + 1 ... last_row(i)
      integer, allocatable :: last_row(:)
      !> Place of each quadrature point in its element, 0 left to 1 right, [last_row(n)]
      real(wp), allocatable :: point(:)
      !> sqrt(w rho A) there, [last_row(n)]
      real(wp), allocatable :: root_mass(:)
      !> sqrt(mu); above 0 it has a row of its own
      real(wp) :: root_tip_mass = 0.0_wp
      !> Rows of the beam and the tip mass, whose values are displacements along it
      integer :: beam_rows = 0
      !> Point masses, ascending: node, and sqrt of mass and rotary inertia, [2, masses]; each has two rows behind
      !> `beam_rows`
      integer, allocatable :: mass_node(:)
      real(wp), allocatable :: root_of_mass(:, :)
   end type natural_beam_t

contains

   !> Stiffness factors and quadrature points.
   pure subroutine make_natural_beam(model, natural)
      type(beam_model_t), intent(in) :: model
      type(natural_beam_t), intent(out) :: natural

      integer :: i

      natural%elements = model%mesh%elements
      allocate (natural%length, source=model%mesh%length)
      allocate (natural%position, source=model%mesh%position)
      allocate (natural%tip_distance, source=model%mesh%tip_distance)
      call make_elements(model, natural)
      natural%root_tip_mass = sqrt(max(model%tip_mass_ratio, 0.0_wp))
      natural%beam_rows = natural%last_row(natural%elements) + merge(1, 0, natural%root_tip_mass > 0.0_wp)
      natural%rows = natural%beam_rows + 2*size(model%point_masses)
      natural%mass_node = model%point_masses%node
      allocate (natural%root_of_mass(2, size(model%point_masses)))
      natural%root_of_mass(1, :) = sqrt(model%point_masses%mass)
      natural%root_of_mass(2, :) = sqrt(model%point_masses%rotary_inertia)

      natural%dofs = model%stiffness%order
      natural%root_dofs = model%root_dofs
      natural%order = 2*natural%elements
      associate (stiffness => [model%root%translation_stiffness, model%root%rotation_stiffness])
         do i = 1, 2
            if (.not. stiffness(i) > 0.0_wp) cycle
            natural%order = natural%order + 1
            natural%root_place(i) = natural%order
            natural%root_give(i) = 1.0_wp/sqrt(stiffness(i))
         end do
      end associate
   end subroutine make_natural_beam

   !> Stiffness factors and quadrature points of the elements.
   pure subroutine make_elements(model, natural)
      type(beam_model_t), intent(in) :: model
      !> Number and lengths of its elements in
      type(natural_beam_t), intent(inout) :: natural

      real(wp), allocatable :: cut(:), mass_point(:), mass_weight(:), stiffness_point(:), stiffness_weight(:)
      real(wp) :: block(3), right, width, xi
      integer :: element, i, piece, row
      logical :: in_pieces

      associate (section => model%section, mesh => model%mesh)
         call gauss_rule((6 + area_degree(section))/2 + 1, mass_point, mass_weight)
         call gauss_rule((2 + inertia_degree(section))/2 + 1, stiffness_point, stiffness_weight)
         allocate (natural%inverse(3, mesh%elements), natural%last_row(0:mesh%elements))

         in_pieces = allocated(section%tip_distance)
         cut = [0.0_wp, 1.0_wp]
         natural%last_row(0) = 0
         do element = 1, mesh%elements
            if (in_pieces) cut = section_pieces(section, mesh%length(element), mesh%tip_distance(element))
            natural%last_row(element) = natural%last_row(element - 1) + (size(cut) - 1)*size(mass_point)
         end do
         allocate (natural%point(natural%last_row(mesh%elements)), natural%root_mass(natural%last_row(mesh%elements)))

         row = 0
         do element = 1, mesh%elements
            right = mesh%tip_distance(element)
            associate (length => mesh%length(element))
               if (in_pieces) cut = section_pieces(section, length, right)
               block = 0.0_wp
               do piece = 1, size(cut) - 1
                  width = cut(piece + 1) - cut(piece)
                  do i = 1, size(stiffness_point)
                     xi = cut(piece) + width*stiffness_point(i)
                     block = block + stiffness_weight(i)*width*length*inertia(section, right + (1.0_wp - xi)*length) &
                        *[(1.0_wp - xi)**2, (1.0_wp - xi)*xi, xi**2]
                  end do
                  do i = 1, size(mass_point)
                     row = row + 1
                     xi = cut(piece) + width*mass_point(i)
                     natural%point(row) = xi
                     natural%root_mass(row) = sqrt(mass_weight(i)*width*length &
                        *area(section, right + (1.0_wp - xi)*length))
                  end do
               end do
               natural%inverse(1, element) = 1.0_wp/sqrt(block(1))
               natural%inverse(3, element) = 1.0_wp/sqrt(block(3) - block(2)**2/block(1))
               natural%inverse(2, element) = -block(2)/block(1)*natural%inverse(3, element)
            end associate
         end do
      end associate
   end subroutine make_elements

   !> B q: from the clamp to the tip.
   pure subroutine deflect(natural, q, deflection, nodal)
      type(natural_beam_t), intent(in) :: natural
      !> Coordinates, [order]
      real(wp), intent(in) :: q(:)
      !> B q, [rows]
      real(wp), intent(out) :: deflection(:)
      !> y and dy/dx of the nodes and the root as in `nodal_displacements`, from the same sums, [dofs]
      real(wp), intent(out), optional :: nodal(:)

      real(wp) :: displacement, displacement_lost, left, right, rotation, rotation_lost, xi
      integer :: element, next, row

      call move_root(natural, q, displacement, rotation)
      if (present(nodal)) call fill_node(natural%root_dofs, displacement, rotation, nodal)
      displacement_lost = 0.0_wp
      rotation_lost = 0.0_wp
      next = 1
      do element = 1, natural%elements
         associate (length => natural%length(element), inverse => natural%inverse(:, element))
            left = (inverse(1)*q(2*element - 1) + inverse(2)*q(2*element))*length
            right = inverse(3)*q(2*element)*length
            do row = natural%last_row(element - 1) + 1, natural%last_row(element)
               xi = natural%point(row)
               deflection(row) = natural%root_mass(row)*(displacement + xi*length*(rotation + &
                  xi*(left*(0.5_wp - one_sixth*xi) + right*one_sixth*xi)))
            end do
            call add(displacement, displacement_lost, length*(rotation + one_sixth*(2.0_wp*left + right)))
            call add(rotation, rotation_lost, 0.5_wp*(left + right))
         end associate
         if (present(nodal)) call fill_node([2*element - 1, 2*element], displacement, rotation, nodal)
         do next = next, size(natural%mass_node)
            if (natural%mass_node(next) > element) exit
            deflection(natural%beam_rows + 2*next - 1) = natural%root_of_mass(1, next)*displacement
            deflection(natural%beam_rows + 2*next) = natural%root_of_mass(2, next)*rotation
         end do
      end do
      if (natural%root_tip_mass > 0.0_wp) deflection(natural%beam_rows) = natural%root_tip_mass*displacement
   end subroutine deflect

   !> Put the motion of a node at its degrees of freedom.
   pure subroutine fill_node(dofs, displacement, rotation, nodal)
      !> Of displacement and rotation; 0: held
      integer, intent(in) :: dofs(2)
      real(wp), intent(in) :: displacement
      real(wp), intent(in) :: rotation
      real(wp), intent(inout) :: nodal(:)

      if (dofs(1) > 0) nodal(dofs(1)) = displacement
      if (dofs(2) > 0) nodal(dofs(2)) = rotation
   end subroutine fill_node

   !> Displacement and rotation of the root.
   pure subroutine move_root(natural, q, displacement, rotation)
      type(natural_beam_t), intent(in) :: natural
      !> Coordinates, [order]
      real(wp), intent(in) :: q(:)
      real(wp), intent(out) :: displacement
      real(wp), intent(out) :: rotation

      displacement = 0.0_wp
      rotation = 0.0_wp
      associate (place => natural%root_place)
         if (place(1) > 0) displacement = natural%root_give(1)*q(place(1))
         if (place(2) > 0) rotation = natural%root_give(2)*q(place(2))
      end associate
   end subroutine move_root

   !> B^T f: from the tip to the clamp, summing forces and moments.
   pure subroutine deflect_transposed(natural, f, q)
      type(natural_beam_t), intent(in) :: natural
      !> f, [rows]
      real(wp), intent(in) :: f(:)
      !> B^T f, [order]
      real(wp), intent(out) :: q(:)

      real(wp) :: first, force, force_sum, left, moment, moment_lost, right, second, shear, shear_lost, third, xi
      integer :: element, next, row

      moment = 0.0_wp
      moment_lost = 0.0_wp
      shear = 0.0_wp
      shear_lost = 0.0_wp
      if (natural%root_tip_mass > 0.0_wp) shear = natural%root_tip_mass*f(natural%beam_rows)
      next = size(natural%mass_node)
      do element = natural%elements, 1, -1
         do next = next, 1, -1
            if (natural%mass_node(next) < element) exit
            call add(shear, shear_lost, natural%root_of_mass(1, next)*f(natural%beam_rows + 2*next - 1))
            call add(moment, moment_lost, natural%root_of_mass(2, next)*f(natural%beam_rows + 2*next))
         end do
         associate (length => natural%length(element), inverse => natural%inverse(:, element))
            ! sums over the points of force, force xi, force xi^2/2 and force xi^3/6
            force_sum = 0.0_wp
            first = 0.0_wp
            second = 0.0_wp
            third = 0.0_wp
            do row = natural%last_row(element - 1) + 1, natural%last_row(element)
               xi = natural%point(row)
               force = natural%root_mass(row)*f(row)
               force_sum = force_sum + force
               force = force*xi
               first = first + force
               force = 0.5_wp*force*xi
               second = second + force
               third = third + force*one_third*xi
            end do
            right = length*(0.5_wp*moment + length*(one_sixth*shear + third))
            left = length*(0.5_wp*moment + length*(one_third*shear + (second - third)))
            call add(moment, moment_lost, length*(shear + first))
            call add(shear, shear_lost, force_sum)
            q(2*element - 1) = inverse(1)*left
            q(2*element) = inverse(2)*left + inverse(3)*right
         end associate
      end do
      associate (place => natural%root_place)
         if (place(1) > 0) q(place(1)) = natural%root_give(1)*shear
         if (place(2) > 0) q(place(2)) = natural%root_give(2)*moment
      end associate
   end subroutine deflect_transposed

   !> N^T f: the coordinates under forces and moments on the degrees of freedom, [order].
   pure function coordinates_of_forces(natural, forces) result(q)
      type(natural_beam_t), intent(in) :: natural
      !> [dofs]
      real(wp), intent(in) :: forces(:)
      real(wp) :: q(natural%order)

      real(wp) :: force, force_lost, left, moment, moment_lost, right
      integer :: element

      force = 0.0_wp
      force_lost = 0.0_wp
      moment = 0.0_wp
      moment_lost = 0.0_wp
      do element = natural%elements, 1, -1
         call add(force, force_lost, forces(2*element - 1))
         call add(moment, moment_lost, forces(2*element))
         associate (length => natural%length(element), inverse => natural%inverse(:, element))
            right = length*(0.5_wp*moment + length*one_sixth*force)
            left = length*(0.5_wp*moment + length*one_third*force)
            q(2*element - 1) = inverse(1)*left
            q(2*element) = inverse(2)*left + inverse(3)*right
            call add(moment, moment_lost, length*force)
         end associate
      end do
      associate (place => natural%root_place, root => natural%root_dofs)
         if (place(1) > 0) q(place(1)) = natural%root_give(1)*(force + forces(root(1)))
         if (place(2) > 0) q(place(2)) = natural%root_give(2)*(moment + forces(root(2)))
      end associate
   end function coordinates_of_forces

   !> y and dy/dx of the nodes, and of the root where it moves.
   pure subroutine nodal_displacements(natural, q, nodal)
      type(natural_beam_t), intent(in) :: natural
      !> Coordinates, [order]
      real(wp), intent(in) :: q(:)
      !> In the order of the degrees of freedom, [dofs]
      real(wp), intent(out) :: nodal(:)

      real(wp) :: displacement, displacement_lost, left, right, rotation, rotation_lost
      integer :: element

      call move_root(natural, q, displacement, rotation)
      call fill_node(natural%root_dofs, displacement, rotation, nodal)
      displacement_lost = 0.0_wp
      rotation_lost = 0.0_wp
      do element = 1, natural%elements
         associate (length => natural%length(element), inverse => natural%inverse(:, element))
            left = (inverse(1)*q(2*element - 1) + inverse(2)*q(2*element))*length
            right = inverse(3)*q(2*element)*length
            call add(displacement, displacement_lost, length*(rotation + one_sixth*(2.0_wp*left + right)))
            call add(rotation, rotation_lost, 0.5_wp*(left + right))
            call fill_node([2*element - 1, 2*element], displacement, rotation, nodal)
         end associate
      end do
   end subroutine nodal_displacements

   !> Kahan's compensated sum: on long beams the rounding of the running sums would show.
   pure subroutine add(total, lost, term)
      !> Running sum
      real(wp), intent(inout) :: total
      !> What rounding has added to it too much
      real(wp), intent(inout) :: lost
      !> Next term
      real(wp), intent(in) :: term

      real(wp) :: before, rest

      before = total
      rest = term - lost
      total = before + rest
      lost = (total - before) - rest
   end subroutine add

   !> B as a full matrix, [rows, order].
   pure function flexibility_matrix(natural) result(matrix)
      type(natural_beam_t), intent(in) :: natural
      real(wp) :: matrix(natural%rows, natural%order)

      real(wp) :: unit(natural%order)
      integer :: column

      unit = 0.0_wp
      do column = 1, natural%order
         unit(column) = 1.0_wp
         call deflect(natural, unit, matrix(:, column))
         unit(column) = 0.0_wp
      end do
   end function flexibility_matrix

   !> The matrix that turns coordinates into y and dy/dx of the nodes, [dofs, order].
   pure function nodal_flexibility(natural) result(matrix)
      type(natural_beam_t), intent(in) :: natural
      real(wp) :: matrix(natural%dofs, natural%order)

      real(wp) :: unit(natural%order)
      integer :: column

      unit = 0.0_wp
      do column = 1, natural%order
         unit(column) = 1.0_wp
         call nodal_displacements(natural, unit, matrix(:, column))
         unit(column) = 0.0_wp
      end do
   end function nodal_flexibility

   !> The coordinates of a motion of the degrees of freedom, [order]. Its strain energy is q.q/2.
   pure function coordinates_of_shape(natural, nodal) result(q)
      !> The beam in its curvatures
      type(natural_beam_t), intent(in) :: natural
      !> [dofs]
      real(wp), intent(in) :: nodal(:)
      real(wp) :: q(natural%order)

      real(wp) :: ends(2), values(4)
      integer :: element, i

      values = 0.0_wp
      do i = 1, 2
         if (natural%root_dofs(i) > 0) values(2 + i) = nodal(natural%root_dofs(i))
         if (natural%root_place(i) > 0) q(natural%root_place(i)) = values(2 + i)/natural%root_give(i)
      end do
      do element = 1, natural%elements
         values = [values(3:4), nodal(2*element - 1:2*element)]
         associate (length => natural%length(element), inverse => natural%inverse(:, element))
            ends = [dot_product(hermite_curvature(0.0_wp, length), values), &
               dot_product(hermite_curvature(1.0_wp, length), values)]
            q(2*element) = ends(2)/inverse(3)
            q(2*element - 1) = (ends(1) - inverse(2)*q(2*element))/inverse(1)
         end associate
      end do
   end function coordinates_of_shape

   !> What the rows of B are where one node moves by 1 and nothing else, the rows of point masses left out, [rows].
   pure function row_shape(natural, node) result(shape)
      !> The beam in its curvatures
      type(natural_beam_t), intent(in) :: natural
      integer, intent(in) :: node
      real(wp) :: shape(natural%rows)

      real(wp) :: values(4)
      integer :: element, row

      shape = 0.0_wp
      do element = node, min(node + 1, natural%elements)
         do row = natural%last_row(element - 1) + 1, natural%last_row(element)
            values = hermite_shape(natural%point(row), natural%length(element))
            shape(row) = natural%root_mass(row)*values(merge(3, 1, element == node))
         end do
      end do
   end function row_shape

end module natural_coordinates
