!> The beam in its element curvatures (docs/theory.md, section 5).
!>
!> A cantilever is statically determinate: the curvatures of its elements (linear in each element, two values) determine
!> all displacements through sums along the beam whose terms have positive coefficients, without cancellation. The
!> stiffness matrix is block diagonal with 2 x 2 blocks; each block S = L L^T gives coordinates q = L^T (curvatures) in
!> which the strain energy is q.q/2. The kinetic energy is |B dq/dt|^2/2, where the rows of B are sqrt(w rho A) y at the
!> quadrature points of the mass matrix, sqrt(mu) y(L), and sqrt(m) y and sqrt(J) dy/dx at point masses. Therefore
!> omega^-2 = lambda^-4 are the squared singular values of B. The matrix N converts q to y and dy/dx of the nodes.
!>
!> On springs at the root the beam is still statically determinate: each spring adds a coordinate, q = sqrt(k) times the
!> displacement or the rotation of the root.
!>
!> Elements and quadrature are those of the assembled K and M; only the coordinates differ. Units: E Ibar = rho Abar = L
!> = 1.
module natural_coordinates
   use beam_element, only: gauss_rule, hermite_curvature, hermite_shape, section_breaks
   use beam_model, only: beam_model_t
   use beam_section, only: area, area_degree, inertia, inertia_degree
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: natural_beam_t, make_natural_beam, deflect, deflect_transposed, nodal_displacements
   public :: find_flexibility, coordinates_of_shape, coordinates_of_forces
   public :: rows_of_unit_displacement

   real(wp), parameter :: one_sixth = 1.0_wp/6.0_wp
   real(wp), parameter :: one_third = 1.0_wp/3.0_wp

   !> A beam in its element curvatures.
   type :: natural_beam_t
      !> Number of elements n
      integer :: elements = 0
      !> Number of coordinates: two for each element, then one for each spring at the root
      integer :: order = 0
      !> 1/sqrt(k) of the springs at the root against displacement and rotation; 0: no spring
      real(wp) :: sqrt_compliance(2) = 0.0_wp
      !> Coordinates of these springs; 0: no spring
      integer :: root_coordinate(2) = 0
      !> Number of degrees of freedom of nodes and root
      integer :: dofs = 0
      !> Degrees of freedom of the root; 0: constrained
      integer :: root_dofs(2) = 0
      !> Number of rows of B
      integer :: rows = 0
      !> Lengths of the elements, [n]
      real(wp), allocatable :: length(:)
      !> Positions x of the nodes, [0:n]
      real(wp), allocatable :: position(:)
      !> Distances of the nodes to the tip, [0:n]
      real(wp), allocatable :: tip_distance(:)
      !> Entries 11, 12, 22 of L^-T of each element, which converts coordinates to curvatures, [3, n]
      real(wp), allocatable :: inverse(:, :)
      !> Last row of B of each element, [0:n]; element i has rows last_row(i - 1) + 1 ... last_row(i)
      integer, allocatable :: last_row(:)
      !> Local coordinate of each quadrature point in its element, 0 left to 1 right, [last_row(n)]
      real(wp), allocatable :: point(:)
      !> sqrt(w rho A) at the quadrature points, [last_row(n)]
      real(wp), allocatable :: sqrt_mass(:)
      !> sqrt(mu), with the tip mass mu in rho Abar L; if positive, the tip mass has a row of B
      real(wp) :: sqrt_tip_mass = 0.0_wp
      !> Number of rows of the beam and the tip mass, which are weighted displacements along the beam
      integer :: beam_rows = 0
      !> Nodes of the point masses, ascending, [masses]
      integer, allocatable :: mass_node(:)
      !> Square roots of mass and rotary inertia of the point masses, each of which has two rows after `beam_rows`, [2,
      !> masses]
      real(wp), allocatable :: sqrt_point_mass(:, :)
   end type natural_beam_t

contains

   !> Make the beam in element curvatures from a model.
   pure subroutine make_natural_beam(model, natural)
      type(beam_model_t), intent(in) :: model
      type(natural_beam_t), intent(out) :: natural

      integer :: i

      natural%elements = model%mesh%elements
      allocate (natural%length, source=model%mesh%length)
      allocate (natural%position, source=model%mesh%position)
      allocate (natural%tip_distance, source=model%mesh%tip_distance)
      call make_elements(model, natural)
      natural%sqrt_tip_mass = sqrt(max(model%tip_mass_ratio, 0.0_wp))
      natural%beam_rows = natural%last_row(natural%elements) + merge(1, 0, natural%sqrt_tip_mass > 0.0_wp)
      natural%rows = natural%beam_rows + 2*size(model%point_masses)
      natural%mass_node = model%point_masses%node
      allocate (natural%sqrt_point_mass(2, size(model%point_masses)))
      natural%sqrt_point_mass(1, :) = sqrt(model%point_masses%mass)
      natural%sqrt_point_mass(2, :) = sqrt(model%point_masses%rotary_inertia)

      natural%dofs = model%stiffness%order
      natural%root_dofs = model%root_dofs
      natural%order = 2*natural%elements
      associate (stiffness => [model%root%translation_stiffness, model%root%rotation_stiffness])
         do i = 1, 2
            if (.not. stiffness(i) > 0.0_wp) cycle
            natural%order = natural%order + 1
            natural%root_coordinate(i) = natural%order
            natural%sqrt_compliance(i) = 1.0_wp/sqrt(stiffness(i))
         end do
      end associate
   end subroutine make_natural_beam

   !> Compute the factors L^-T of the stiffness blocks and the quadrature points of the elements.
   pure subroutine make_elements(model, natural)
      type(beam_model_t), intent(in) :: model
      !> Beam whose number and lengths of elements are set
      type(natural_beam_t), intent(inout) :: natural

      real(wp), allocatable :: breakpoint(:), mass_point(:), mass_weight(:), stiffness_point(:), stiffness_weight(:)
      ! entries 11, 12, 22 of a block S
      real(wp) :: block(3)
      real(wp) :: right_tip_distance, width, xi
      integer :: element, i, segment, row
      logical :: is_piecewise

      associate (section => model%section, mesh => model%mesh)
         call gauss_rule((6 + area_degree(section))/2 + 1, mass_point, mass_weight)
         call gauss_rule((2 + inertia_degree(section))/2 + 1, stiffness_point, stiffness_weight)
         allocate (natural%inverse(3, mesh%elements), natural%last_row(0:mesh%elements))

         is_piecewise = allocated(section%tip_distance)
         breakpoint = [0.0_wp, 1.0_wp]
         natural%last_row(0) = 0
         do element = 1, mesh%elements
            if (is_piecewise) breakpoint = section_breaks(section, mesh%length(element), mesh%tip_distance(element))
            natural%last_row(element) = natural%last_row(element - 1) + (size(breakpoint) - 1)*size(mass_point)
         end do
         allocate (natural%point(natural%last_row(mesh%elements)), natural%sqrt_mass(natural%last_row(mesh%elements)))

         row = 0
         do element = 1, mesh%elements
            right_tip_distance = mesh%tip_distance(element)
            associate (length => mesh%length(element))
               if (is_piecewise) breakpoint = section_breaks(section, length, right_tip_distance)
               block = 0.0_wp
               do segment = 1, size(breakpoint) - 1
                  width = breakpoint(segment + 1) - breakpoint(segment)
                  do i = 1, size(stiffness_point)
                     xi = breakpoint(segment) + width*stiffness_point(i)
                     block = block + stiffness_weight(i)*width*length &
                        *inertia(section, right_tip_distance + (1.0_wp - xi)*length) &
                        *[(1.0_wp - xi)**2, (1.0_wp - xi)*xi, xi**2]
                  end do
                  do i = 1, size(mass_point)
                     row = row + 1
                     xi = breakpoint(segment) + width*mass_point(i)
                     natural%point(row) = xi
                     natural%sqrt_mass(row) = sqrt(mass_weight(i)*width*length &
                        *area(section, right_tip_distance + (1.0_wp - xi)*length))
                  end do
               end do
               natural%inverse(1, element) = 1.0_wp/sqrt(block(1))
               natural%inverse(3, element) = 1.0_wp/sqrt(block(3) - block(2)**2/block(1))
               natural%inverse(2, element) = -block(2)/block(1)*natural%inverse(3, element)
            end associate
         end do
      end associate
   end subroutine make_elements

   !> The product B q, by sums from the root to the tip.
   pure subroutine deflect(natural, q, deflection, nodal)
      type(natural_beam_t), intent(in) :: natural
      !> Coordinates, [order]
      real(wp), intent(in) :: q(:)
      !> B q, [rows]
      real(wp), intent(out) :: deflection(:)
      !> y and dy/dx of nodes and root, as from `nodal_displacements` but by the same sums as B q, [dofs]
      real(wp), intent(out), optional :: nodal(:)

      ! curvature at the left node of an element, times the length of the element
      real(wp) :: left
      ! curvature at the right node, times this length
      real(wp) :: right
      real(wp) :: displacement, displacement_error, rotation, rotation_error, xi
      integer :: element, mass, row

      call root_motion(natural, q, displacement, rotation)
      if (present(nodal)) call store_node(natural%root_dofs, displacement, rotation, nodal)
      displacement_error = 0.0_wp
      rotation_error = 0.0_wp
      mass = 1
      do element = 1, natural%elements
         associate (length => natural%length(element), inverse => natural%inverse(:, element))
            left = (inverse(1)*q(2*element - 1) + inverse(2)*q(2*element))*length
            right = inverse(3)*q(2*element)*length
            ! displacements in the element are the double integral of the curvature left (1 - xi) + right xi
            do row = natural%last_row(element - 1) + 1, natural%last_row(element)
               xi = natural%point(row)
               deflection(row) = natural%sqrt_mass(row)*(displacement + xi*length*(rotation + &
                  xi*(left*(0.5_wp - one_sixth*xi) + right*one_sixth*xi)))
            end do
            call add_compensated(displacement, displacement_error, length*(rotation + one_sixth*(2.0_wp*left + right)))
            call add_compensated(rotation, rotation_error, 0.5_wp*(left + right))
         end associate
         if (present(nodal)) call store_node([2*element - 1, 2*element], displacement, rotation, nodal)
         do mass = mass, size(natural%mass_node)
            if (natural%mass_node(mass) > element) exit
            deflection(natural%beam_rows + 2*mass - 1) = natural%sqrt_point_mass(1, mass)*displacement
            deflection(natural%beam_rows + 2*mass) = natural%sqrt_point_mass(2, mass)*rotation
         end do
      end do
      if (natural%sqrt_tip_mass > 0.0_wp) deflection(natural%beam_rows) = natural%sqrt_tip_mass*displacement
   end subroutine deflect

   !> Store displacement and rotation of a node or of the root at the positions of its degrees of freedom.
   pure subroutine store_node(dofs, displacement, rotation, nodal)
      !> Degrees of freedom of displacement and rotation; 0: constrained
      integer, intent(in) :: dofs(2)
      !> Displacement of the node
      real(wp), intent(in) :: displacement
      !> Rotation of the node
      real(wp), intent(in) :: rotation
      real(wp), intent(inout) :: nodal(:)

      if (dofs(1) > 0) nodal(dofs(1)) = displacement
      if (dofs(2) > 0) nodal(dofs(2)) = rotation
   end subroutine store_node

   !> Displacement and rotation of the root.
   pure subroutine root_motion(natural, q, displacement, rotation)
      type(natural_beam_t), intent(in) :: natural
      !> Coordinates, [order]
      real(wp), intent(in) :: q(:)
      real(wp), intent(out) :: displacement
      real(wp), intent(out) :: rotation

      displacement = 0.0_wp
      rotation = 0.0_wp
      associate (coordinate => natural%root_coordinate)
         if (coordinate(1) > 0) displacement = natural%sqrt_compliance(1)*q(coordinate(1))
         if (coordinate(2) > 0) rotation = natural%sqrt_compliance(2)*q(coordinate(2))
      end associate
   end subroutine root_motion

   !> The product B^T f, by sums of forces and moments from the tip to the root.
   pure subroutine deflect_transposed(natural, f, q)
      type(natural_beam_t), intent(in) :: natural
      !> f, [rows]
      real(wp), intent(in) :: f(:)
      !> B^T f, [order]
      real(wp), intent(out) :: q(:)

      ! generalised force of the curvature at the left node of an element
      real(wp) :: left
      ! generalised force of the curvature at the right node
      real(wp) :: right
      real(wp) :: first, force, force_sum, moment, moment_error, second, shear, shear_error, third, xi
      integer :: element, mass, row

      moment = 0.0_wp
      moment_error = 0.0_wp
      shear = 0.0_wp
      shear_error = 0.0_wp
      if (natural%sqrt_tip_mass > 0.0_wp) shear = natural%sqrt_tip_mass*f(natural%beam_rows)
      mass = size(natural%mass_node)
      do element = natural%elements, 1, -1
         do mass = mass, 1, -1
            if (natural%mass_node(mass) < element) exit
            call add_compensated(shear, shear_error, natural%sqrt_point_mass(1, mass)*f(natural%beam_rows + 2*mass - 1))
            call add_compensated(moment, moment_error, natural%sqrt_point_mass(2, mass)*f(natural%beam_rows + 2*mass))
         end do
         associate (length => natural%length(element), inverse => natural%inverse(:, element))
            ! sums of force, force xi, force xi^2/2 and force xi^3/6 over the quadrature points
            force_sum = 0.0_wp
            first = 0.0_wp
            second = 0.0_wp
            third = 0.0_wp
            do row = natural%last_row(element - 1) + 1, natural%last_row(element)
               xi = natural%point(row)
               force = natural%sqrt_mass(row)*f(row)
               force_sum = force_sum + force
               force = force*xi
               first = first + force
               force = 0.5_wp*force*xi
               second = second + force
               third = third + force*one_third*xi
            end do
            ! the sums of `deflect`, transposed
            right = length*(0.5_wp*moment + length*(one_sixth*shear + third))
            left = length*(0.5_wp*moment + length*(one_third*shear + (second - third)))
            call add_compensated(moment, moment_error, length*(shear + first))
            call add_compensated(shear, shear_error, force_sum)
            q(2*element - 1) = inverse(1)*left
            q(2*element) = inverse(2)*left + inverse(3)*right
         end associate
      end do
      associate (coordinate => natural%root_coordinate)
         if (coordinate(1) > 0) q(coordinate(1)) = natural%sqrt_compliance(1)*shear
         if (coordinate(2) > 0) q(coordinate(2)) = natural%sqrt_compliance(2)*moment
      end associate
   end subroutine deflect_transposed

   !> The product N^T f: the coordinates under forces and moments on the degrees of freedom, [order].
   pure function coordinates_of_forces(natural, forces) result(q)
      type(natural_beam_t), intent(in) :: natural
      !> Forces and moments, [dofs]
      real(wp), intent(in) :: forces(:)
      real(wp) :: q(natural%order)

      ! generalised force of the curvature at the left node of an element
      real(wp) :: left
      ! generalised force of the curvature at the right node
      real(wp) :: right
      real(wp) :: force, force_error, moment, moment_error
      integer :: element

      force = 0.0_wp
      force_error = 0.0_wp
      moment = 0.0_wp
      moment_error = 0.0_wp
      do element = natural%elements, 1, -1
         call add_compensated(force, force_error, forces(2*element - 1))
         call add_compensated(moment, moment_error, forces(2*element))
         associate (length => natural%length(element), inverse => natural%inverse(:, element))
            right = length*(0.5_wp*moment + length*one_sixth*force)
            left = length*(0.5_wp*moment + length*one_third*force)
            q(2*element - 1) = inverse(1)*left
            q(2*element) = inverse(2)*left + inverse(3)*right
            call add_compensated(moment, moment_error, length*force)
         end associate
      end do
      associate (coordinate => natural%root_coordinate, root => natural%root_dofs)
         if (coordinate(1) > 0) q(coordinate(1)) = natural%sqrt_compliance(1)*(force + forces(root(1)))
         if (coordinate(2) > 0) q(coordinate(2)) = natural%sqrt_compliance(2)*(moment + forces(root(2)))
      end associate
   end function coordinates_of_forces

   !> The product N q: y and dy/dx of the nodes and of a root that moves.
   pure subroutine nodal_displacements(natural, q, nodal)
      type(natural_beam_t), intent(in) :: natural
      !> Coordinates, [order]
      real(wp), intent(in) :: q(:)
      !> Displacements and rotations in the order of the degrees of freedom, [dofs]
      real(wp), intent(out) :: nodal(:)

      ! curvature at the left node of an element, times the length of the element
      real(wp) :: left
      ! curvature at the right node, times this length
      real(wp) :: right
      real(wp) :: displacement, displacement_error, rotation, rotation_error
      integer :: element

      call root_motion(natural, q, displacement, rotation)
      call store_node(natural%root_dofs, displacement, rotation, nodal)
      displacement_error = 0.0_wp
      rotation_error = 0.0_wp
      do element = 1, natural%elements
         associate (length => natural%length(element), inverse => natural%inverse(:, element))
            left = (inverse(1)*q(2*element - 1) + inverse(2)*q(2*element))*length
            right = inverse(3)*q(2*element)*length
            call add_compensated(displacement, displacement_error, length*(rotation + one_sixth*(2.0_wp*left + right)))
            call add_compensated(rotation, rotation_error, 0.5_wp*(left + right))
            call store_node([2*element - 1, 2*element], displacement, rotation, nodal)
         end associate
      end do
   end subroutine nodal_displacements

   !> Add a term by Kahan's compensated sum, because with many elements rounding errors of the running sums would
   !> matter.
   pure subroutine add_compensated(total, rounding, term)
      !> Running sum
      real(wp), intent(inout) :: total
      !> Accumulated rounding error of the sum
      real(wp), intent(inout) :: rounding
      !> Next term
      real(wp), intent(in) :: term

      real(wp) :: previous, corrected

      previous = total
      corrected = term - rounding
      total = previous + corrected
      rounding = (total - previous) - corrected
   end subroutine add_compensated

   !> Find the matrices B, which gives the deflection, and N, which converts coordinates to y and dy/dx of the nodes.
   pure subroutine find_flexibility(natural, flexibility, nodal)
      type(natural_beam_t), intent(in) :: natural
      !> B, [rows, order]
      real(wp), allocatable, intent(out) :: flexibility(:, :)
      !> N, [dofs, order]
      real(wp), allocatable, intent(out) :: nodal(:, :)

      real(wp) :: unit(natural%order)
      integer :: column

      allocate (flexibility(natural%rows, natural%order), nodal(natural%dofs, natural%order))
      unit = 0.0_wp
      do column = 1, natural%order
         unit(column) = 1.0_wp
         call deflect(natural, unit, flexibility(:, column))
         call nodal_displacements(natural, unit, nodal(:, column))
         unit(column) = 0.0_wp
      end do
   end subroutine find_flexibility

   !> The coordinates q of a motion of the degrees of freedom, whose strain energy is q.q/2, [order].
   pure function coordinates_of_shape(natural, nodal) result(q)
      !> The beam in its element curvatures
      type(natural_beam_t), intent(in) :: natural
      !> Displacements and rotations of the motion, [dofs]
      real(wp), intent(in) :: nodal(:)
      real(wp) :: q(natural%order)

      ! curvature at the left and at the right node of an element
      real(wp) :: curvature(2)
      ! degrees of freedom of the element
      real(wp) :: values(4)
      integer :: element, i

      values = 0.0_wp
      do i = 1, 2
         if (natural%root_dofs(i) > 0) values(2 + i) = nodal(natural%root_dofs(i))
         if (natural%root_coordinate(i) > 0) q(natural%root_coordinate(i)) = values(2 + i)/natural%sqrt_compliance(i)
      end do
      do element = 1, natural%elements
         values = [values(3:4), nodal(2*element - 1:2*element)]
         associate (length => natural%length(element), inverse => natural%inverse(:, element))
            curvature = [dot_product(hermite_curvature(0.0_wp, length), values), &
               dot_product(hermite_curvature(1.0_wp, length), values)]
            q(2*element) = curvature(2)/inverse(3)
            q(2*element - 1) = (curvature(1) - inverse(2)*q(2*element))/inverse(1)
         end associate
      end do
   end function coordinates_of_shape

   !> B times the coordinates of a unit displacement of one node, with all other degrees of freedom zero, [rows]. The
   !> rows of tip mass and point masses are set to 0.
   pure function rows_of_unit_displacement(natural, node) result(shape)
      !> The beam in its element curvatures
      type(natural_beam_t), intent(in) :: natural
      integer, intent(in) :: node
      real(wp) :: shape(natural%rows)

      real(wp) :: values(4)
      integer :: element, row

      shape = 0.0_wp
      do element = node, min(node + 1, natural%elements)
         do row = natural%last_row(element - 1) + 1, natural%last_row(element)
            values = hermite_shape(natural%point(row), natural%length(element))
            ! the node is the right end of its element (third function) and the left end of the next (first function)
            shape(row) = natural%sqrt_mass(row)*values(merge(3, 1, element == node))
         end do
      end do
   end function rows_of_unit_displacement

end module natural_coordinates
