!> Consistent load vectors of external loads and of base motion, and the bending moment at any point of the beam as a
!> linear functional of nodal displacements, nodal accelerations and loads (docs/theory.md, section 3). Units: E Ibar =
!> rho Abar = L = 1; forces and displacements are positive upwards, the moment E I d^2y/dx^2 is positive if it makes the
!> beam concave upwards.
!>
!> Loads are consistent: a force at x is multiplied by the shape functions at x, so that no node is needed there. The
!> moment follows from equilibrium instead of the curvature of the shape functions: the force and the moment at the left
!> end of an element follow from its stiffness, its inertia and its loads; the moment at x follows from these two and
!> from inertia and loads between the left end and x. With the consistent mass matrix the moment is exact under any
!> static loads, and converges as displacements do, with the fourth power of the element length.
!>
!> If the inertia of the node at the stop is redistributed to its neighbours (`redistributed_mass`), the loads at this
!> node are redistributed too, because a force on a node without mass would move the node instantly. The moment between
!> the neighbours then has an error of the order of the square of the element length.
module beam_loads
   use beam_element, only: element_mass, element_stiffness, gauss_rule, hermite_shape, section_breaks
   use beam_model, only: beam_model_t, element_dofs, node_dofs
   use beam_section, only: area, area_degree
   use kinds, only: wp
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: base_mass_vector, base_rotation_vector, inertia_of_motion, inertia_of_curve, point_load, line_load
   public :: piecewise_cubic_t, curve_value
   public :: moment_weights_t, moment_weights, moment_of_point_load, moment_of_line_load

   !> A piecewise cubic curve y(x), extended by straight lines beyond its end points.
   type :: piecewise_cubic_t
      !> Positions x/L of the points, ascending, two or more
      real(wp), allocatable :: position(:)
      !> y at the points
      real(wp), allocatable :: value(:)
      !> dy/dx at the points
      real(wp), allocatable :: slope(:)
   end type piecewise_cubic_t

   !> The linear functional that gives the moment at x: stiffness.(u + gamma v) + mass.(a + alpha v) + base*a_b + the
   !> contributions of the loads, with displacements u, velocities v and accelerations a over the degrees of freedom,
   !> the coefficients gamma and alpha of Rayleigh damping gamma K + alpha M, and the acceleration a_b of the base.
   type :: moment_weights_t
      !> Weights of the degrees of freedom in the stiffness term, [degrees of freedom of the model]
      real(wp), allocatable :: stiffness(:)
      !> Weights in the inertia term, [degrees of freedom of the model]
      real(wp), allocatable :: mass(:)
      !> Moment under a translation of the base with unit acceleration
      real(wp) :: base = 0.0_wp
   end type moment_weights_t

   !> Number of Gauss points that integrates the shape functions, which are cubic, exactly.
   integer, parameter :: load_gauss_points = 2

contains

   !> Inertia forces under a base acceleration of -1, M_b in docs/theory.md: the mass matrix that also has the columns
   !> of the root, times a unit translation of all nodes, and the masses besides those of the mesh.
   pure function base_mass_vector(model) result(vector)
      type(beam_model_t), intent(in) :: model
      !> Forces on the degrees of freedom, [order of the model]
      real(wp), allocatable :: vector(:)

      integer :: i

      allocate (vector, source=inertia_of_motion(model, [(1.0_wp, i=0, model%mesh%elements)]))
      if (allocated(model%lumped_mass)) vector = vector + model%lumped_mass
   end function base_mass_vector

   !> Inertia forces under an angular acceleration of the base of -1 about the root: the mass matrix that also has the
   !> columns of the root, times a unit rotation of all nodes.
   pure function base_rotation_vector(model) result(vector)
      type(beam_model_t), intent(in) :: model
      !> Forces on the degrees of freedom, [order of the model]
      real(wp), allocatable :: vector(:)

      allocate (vector, source=inertia_of_motion(model, model%mesh%position))
   end function base_rotation_vector

   !> The mass matrix, which here also has the columns of the root, times a motion that is linear between nodes (rigid
   !> if the inertia of a node is redistributed). A rotary inertia at a node has the mean slope of both neighbouring
   !> elements.
   pure function inertia_of_motion(model, motion) result(vector)
      type(beam_model_t), intent(in) :: model
      !> Displacements y of the nodes, [0:n]
      real(wp), intent(in) :: motion(0:)
      real(wp) :: vector(model%mass%order)

      ! slopes of the elements, and of fictitious elements before the root and beyond the tip, [0:n + 1]
      real(wp) :: slope(0:size(motion))
      integer :: dofs(2), element, i

      vector = 0.0_wp
      do element = 1, model%mesh%elements
         associate (before => motion(element - 1), after => motion(element))
            slope(element) = (after - before)/model%mesh%length(element)
            call assemble(element_dofs(model, element), matmul(mass_of(model, element), [before, slope(element), &
               after, slope(element)]), vector)
         end associate
      end do
      slope(0) = slope(1)
      slope(size(motion)) = slope(model%mesh%elements)
      call redistribute_load(model, vector)
      vector(model%tip_dof) = vector(model%tip_dof) + model%tip_mass_ratio*motion(model%mesh%elements)
      do i = 1, size(model%point_masses)
         associate (added => model%point_masses(i), node => model%point_masses(i)%node)
            dofs = node_dofs(model, node)
            vector(dofs) = vector(dofs) + [added%mass*motion(node), added%rotary_inertia*0.5_wp*(slope(node) &
               + slope(node + 1))]
         end associate
      end do
   end function inertia_of_motion

   !> Integrals of mass per length times a curve times the shape functions, plus mass times value and rotary inertia
   !> times slope of the curve at point masses. This is the right side of the least-squares approximation of the curve,
   !> weighted by the mass.
   pure function inertia_of_curve(model, curve) result(vector)
      type(beam_model_t), intent(in) :: model
      type(piecewise_cubic_t), intent(in) :: curve
      !> Right side of this approximation, [order of the model]
      real(wp) :: vector(model%mass%order)

      integer :: element, i, node

      vector = 0.0_wp
      do element = 1, model%mesh%elements
         call assemble(element_dofs(model, element), inertia_on_element(model, element, curve), vector)
      end do
      call redistribute_load(model, vector)
      vector(model%tip_dof) = vector(model%tip_dof) + model%tip_mass_ratio*curve_value(curve, 1.0_wp)
      do i = 1, size(model%point_masses)
         node = model%point_masses(i)%node
         associate (added => model%point_masses(i), dofs => node_dofs(model, node), x => model%mesh%position(node))
            vector(dofs) = vector(dofs) + [added%mass*curve_value(curve, x), added%rotary_inertia*slope_on(curve, x)]
         end associate
      end do
   end function inertia_of_curve

   !> Contribution of one element to `inertia_of_curve`, without point masses.
   pure function inertia_on_element(model, element, curve) result(inertia)
      type(beam_model_t), intent(in) :: model
      integer, intent(in) :: element
      type(piecewise_cubic_t), intent(in) :: curve
      real(wp) :: inertia(4)

      real(wp), allocatable :: breakpoint(:), point(:), weight(:)
      real(wp) :: xi, width
      integer :: i, segment

      inertia = 0.0_wp
      allocate (breakpoint, source=breakpoints_of(model, element, curve))
      call gauss_rule((6 + area_degree(model%section))/2 + 1, point, weight)
      associate (left => model%mesh%position(element - 1), length => model%mesh%length(element), &
         right_tip_distance => model%mesh%tip_distance(element))
         do segment = 1, size(breakpoint) - 1
            width = breakpoint(segment + 1) - breakpoint(segment)
            do i = 1, size(point)
               xi = breakpoint(segment) + width*point(i)
               inertia = inertia + weight(i)*width*length &
                  *area(model%section, right_tip_distance + (1.0_wp - xi)*length) &
                  *curve_value(curve, left + xi*length)*hermite_shape(xi, length)
            end do
         end do
      end associate
   end function inertia_on_element

   !> Local coordinates of the breakpoints between which section and curve are single polynomials within an element.
   pure function breakpoints_of(model, element, curve) result(breakpoint)
      type(beam_model_t), intent(in) :: model
      integer, intent(in) :: element
      type(piecewise_cubic_t), intent(in) :: curve
      !> Breakpoints, ascending from 0 (left node) to 1 (right node)
      real(wp), allocatable :: breakpoint(:)

      real(wp), allocatable :: xi_unsorted(:)

      associate (left => model%mesh%position(element - 1), length => model%mesh%length(element))
         allocate (xi_unsorted, source=[section_breaks(model%section, length, model%mesh%tip_distance(element)), &
            pack((curve%position - left)/length, curve%position > left .and. &
            curve%position < model%mesh%position(element))])
      end associate
      allocate (breakpoint, source=xi_unsorted(ascending_order(xi_unsorted)))
   end function breakpoints_of

   !> Value of a curve at x.
   pure real(wp) function curve_value(curve, x) result(value)
      type(piecewise_cubic_t), intent(in) :: curve
      !> x/L
      real(wp), intent(in) :: x

      ! x clipped to the range of the points
      real(wp) :: xc
      integer :: k

      xc = min(max(x, curve%position(1)), curve%position(size(curve%position)))
      k = segment_at(curve, x)
      associate (length => curve%position(k + 1) - curve%position(k))
         value = dot_product(hermite_shape((xc - curve%position(k))/length, length), [curve%value(k), curve%slope(k), &
            curve%value(k + 1), curve%slope(k + 1)])
      end associate
      if (abs(x - xc) > 0.0_wp) value = value + (x - xc)*slope_on(curve, xc)
   end function curve_value

   !> Slope of a curve at x.
   pure real(wp) function slope_on(curve, x) result(slope)
      type(piecewise_cubic_t), intent(in) :: curve
      !> x/L
      real(wp), intent(in) :: x

      real(wp) :: xi
      integer :: k

      k = segment_at(curve, x)
      associate (length => curve%position(k + 1) - curve%position(k))
         xi = min(max((x - curve%position(k))/length, 0.0_wp), 1.0_wp)
         slope = 6.0_wp*xi*(1.0_wp - xi)*(curve%value(k + 1) - curve%value(k))/length &
            + (1.0_wp - xi)*(1.0_wp - 3.0_wp*xi)*curve%slope(k) &
            + xi*(3.0_wp*xi - 2.0_wp)*curve%slope(k + 1)
      end associate
   end function slope_on

   !> Number of the cubic segment of a curve that contains x, or of the nearest segment.
   pure integer function segment_at(curve, x) result(segment)
      type(piecewise_cubic_t), intent(in) :: curve
      real(wp), intent(in) :: x

      segment = max(1, min(count(curve%position <= x), size(curve%position) - 1))
   end function segment_at

   !> Consistent load vector of a unit force.
   pure function point_load(model, at) result(vector)
      type(beam_model_t), intent(in) :: model
      !> x/L, 0 to 1
      real(wp), intent(in) :: at
      !> Forces on the degrees of freedom, [order of the model]
      real(wp) :: vector(model%mass%order)

      integer :: element

      vector = 0.0_wp
      element = element_at(model, at)
      associate (length => model%mesh%length(element))
         call assemble(element_dofs(model, element), hermite_shape(offset_in(model, element, at)/length, length), &
            vector)
      end associate
      call redistribute_load(model, vector)
   end function point_load

   !> Consistent load vector of a unit force per length.
   pure function line_load(model, from, to) result(vector)
      type(beam_model_t), intent(in) :: model
      !> Start x/L of the loaded interval, from 0 to 1
      real(wp), intent(in) :: from
      !> End x/L of the loaded interval, not below the start
      real(wp), intent(in) :: to
      !> Forces on the degrees of freedom, [order of the model]
      real(wp) :: vector(model%mass%order)

      integer :: element

      vector = 0.0_wp
      do element = element_at(model, from), element_at(model, to)
         call assemble(element_dofs(model, element), load_on_element(model, element, from, to), vector)
      end do
      call redistribute_load(model, vector)
   end function line_load

   !> Weights of the bending moment at x, from the element that contains x; at a node from the element on the side of
   !> the root, at the root from the first element.
   pure type(moment_weights_t) function moment_weights(model, x) result(weights)
      type(beam_model_t), intent(in) :: model
      !> x/L, 0 to 1
      real(wp), intent(in) :: x

      real(wp), allocatable :: breakpoint(:), point(:), weight(:)
      ! distance of x from the left end of the element
      real(wp) :: s
      real(wp) :: inertia(4), stiffness(4, 4), xi, width
      integer :: element, i, segment

      element = element_at(model, x)
      s = offset_in(model, element, x)
      stiffness = element_stiffness(model%section, model%mesh%length(element), model%mesh%tip_distance(element))
      inertia = end_moment(mass_of(model, element), s)
      associate (length => model%mesh%length(element), right_tip_distance => model%mesh%tip_distance(element))
         allocate (breakpoint, source=section_breaks(model%section, length, right_tip_distance))
         call gauss_rule((4 + area_degree(model%section))/2 + 1, point, weight)
         do segment = 1, size(breakpoint) - 1
            ! only the inertia between the left end and x contributes
            width = min(breakpoint(segment + 1), s/length) - breakpoint(segment)
            if (width <= 0.0_wp) exit
            do i = 1, size(point)
               xi = breakpoint(segment) + width*point(i)
               inertia = inertia - weight(i)*width*length &
                  *area(model%section, right_tip_distance + (1.0_wp - xi)*length) &
                  *(s - xi*length)*hermite_shape(xi, length)
            end do
         end do
      end associate
      allocate (weights%stiffness(model%stiffness%order), weights%mass(model%mass%order), source=0.0_wp)
      call assemble(element_dofs(model, element), end_moment(stiffness, s), weights%stiffness)
      call assemble(element_dofs(model, element), inertia, weights%mass)
      call redistribute_load(model, weights%mass)
      ! a translation of the base displaces both nodes of the element by the same amount
      weights%base = inertia(1) + inertia(3)
   end function moment_weights

   !> Contribution of a unit force to the moment at x, to be added to the terms of `moment_weights_t`.
   pure real(wp) function moment_of_point_load(model, x, at) result(moment)
      type(beam_model_t), intent(in) :: model
      !> Position x/L of the moment, 0 to 1
      real(wp), intent(in) :: x
      !> Position x/L of the force, 0 to 1
      real(wp), intent(in) :: at

      ! consistent load vector of the element under the unit force
      real(wp) :: load(4)
      ! distance of x from the left end of the element
      real(wp) :: s
      integer :: element

      moment = 0.0_wp
      element = element_at(model, x)
      ! a force on another element acts on this moment only through the motion
      if (element_at(model, at) /= element) return
      s = offset_in(model, element, x)
      associate (length => model%mesh%length(element))
         load = hermite_shape(offset_in(model, element, at)/length, length)
      end associate
      ! force and moment on the left end of the element are those of stiffness and inertia minus the load vector, which
      ! contributes like F = -load(1), M = -load(2) in `end_moment`; the last term is the lever arm of the unit force
      moment = load(2) - s*load(1) + max(x - at, 0.0_wp)
   end function moment_of_point_load

   !> Contribution of a unit force per length to the moment at x, to be added to the terms of `moment_weights_t`.
   pure real(wp) function moment_of_line_load(model, x, from, to) result(moment)
      type(beam_model_t), intent(in) :: model
      !> Position x/L of the moment, 0 to 1
      real(wp), intent(in) :: x
      !> Start x/L of the loaded interval, from 0 to 1
      real(wp), intent(in) :: from
      !> End x/L of the loaded interval, not below the start
      real(wp), intent(in) :: to

      ! consistent load vector of the element under the unit force per length
      real(wp) :: load(4)
      ! start x/L of the loaded interval between the left node and x
      real(wp) :: left
      ! end x/L of this interval
      real(wp) :: right
      integer :: element

      element = element_at(model, x)
      associate (start => model%mesh%position(element - 1))
         load = load_on_element(model, element, from, to)
         left = max(from, start)
         right = max(min(to, x), left)
         ! as in `moment_of_point_load`; the last term is the force between the left node and x times its lever arm
         moment = load(2) - (x - start)*load(1) + (right - left)*(x - 0.5_wp*(left + right))
      end associate
   end function moment_of_line_load

   !> Weights of the moment at a distance s from the left end of an element due to the force F (upwards) and the moment
   !> M (counterclockwise) on that end: s F - M.
   pure function end_moment(matrix, s) result(weights)
      !> Element matrix; its product with the degrees of freedom is the vector of forces and moments at both ends
      real(wp), intent(in) :: matrix(4, 4)
      !> Distance s in L
      real(wp), intent(in) :: s
      real(wp) :: weights(4)

      weights = s*matrix(:, 1) - matrix(:, 2)
   end function end_moment

   !> Consistent load vector of a unit force per length on an element; 0 if the loaded interval does not reach it.
   pure function load_on_element(model, element, from, to) result(load)
      type(beam_model_t), intent(in) :: model
      integer, intent(in) :: element
      !> Left end x/L of the loaded interval
      real(wp), intent(in) :: from
      !> Right end x/L of the loaded interval
      real(wp), intent(in) :: to
      real(wp) :: load(4)

      real(wp), allocatable :: point(:), weight(:)
      ! local coordinate of the left end of the loaded interval within the element
      real(wp) :: left
      ! local length of this interval
      real(wp) :: width
      integer :: i

      load = 0.0_wp
      associate (length => model%mesh%length(element))
         left = max(offset_in(model, element, from), 0.0_wp)/length
         width = min(offset_in(model, element, to)/length, 1.0_wp) - left
         if (width <= 0.0_wp) return
         call gauss_rule(load_gauss_points, point, weight)
         do i = 1, load_gauss_points
            load = load + weight(i)*width*length*hermite_shape(left + width*point(i), length)
         end do
      end associate
   end function load_on_element

   !> Element that contains x; at a node the element on the side of the root.
   pure integer function element_at(model, x) result(element)
      type(beam_model_t), intent(in) :: model
      !> x/L, 0 to 1
      real(wp), intent(in) :: x

      ! a position this close to a node, in L, is at the node: nodes are sums of lengths, with rounding errors
      real(wp), parameter :: rounding = 1.0e-12_wp

      element = max(1, min(model%mesh%elements, count(model%mesh%position < x - rounding)))
   end function element_at

   !> Distance of x from the left end of an element, in L, at most the length of the element (a sum of lengths may
   !> exceed it by rounding); negative if x is left of the element.
   pure real(wp) function offset_in(model, element, x) result(s)
      type(beam_model_t), intent(in) :: model
      integer, intent(in) :: element
      !> x/L
      real(wp), intent(in) :: x

      s = min(x - model%mesh%position(element - 1), model%mesh%length(element))
   end function offset_in

   !> Consistent mass matrix of an element.
   pure function mass_of(model, element) result(mass)
      type(beam_model_t), intent(in) :: model
      integer, intent(in) :: element
      real(wp) :: mass(4, 4)

      mass = element_mass(model%section, model%mesh%length(element), model%mesh%tip_distance(element))
   end function mass_of

   !> Assemble an element vector into a global vector.
   pure subroutine assemble(dofs, values, vector)
      !> Degrees of freedom of the element; below 1: constrained
      integer, intent(in) :: dofs(4)
      real(wp), intent(in) :: values(4)
      real(wp), intent(inout) :: vector(:)

      integer :: i

      do i = 1, 4
         if (dofs(i) > 0) vector(dofs(i)) = vector(dofs(i)) + values(i)
      end do
   end subroutine assemble

   !> Transfer the force on a node whose inertia is redistributed to its neighbours.
   pure subroutine redistribute_load(model, vector)
      type(beam_model_t), intent(in) :: model
      real(wp), intent(inout) :: vector(:)

      integer :: struck_dof

      if (.not. model%is_redistributed) return
      struck_dof = 2*model%mesh%redistributed_node - 1
      call assemble(model%continuation%dof, model%continuation%weight*vector(struck_dof), vector)
      vector(struck_dof) = 0.0_wp
   end subroutine redistribute_load

end module beam_loads
