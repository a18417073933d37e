!> What acts on the beam besides stops, and the bending moment within it, over the degrees of freedom of a model
!> (docs/theory.md, section 3). Units: E Ibar = rho Abar = L = 1; forces and displacements count upwards, the moment
!> E I y'' is positive where the beam is bent upwards.
!>
!> Loads are consistent: of a force at x the values of the shape functions there, so that no node is needed. The moment
!> is that of equilibrium, not of the curvature of the shape functions: the forces at an element's end from its
!> stiffness, its inertia and its loads, and from there what acts on the beam up to x. In a beam that is not
!> redistributed it is exact under any loads at rest, and converges as displacements do, with the fourth power of the
!> element.
!>
!> Where the inertia of the stop's node belongs to its neighbours (`redistributed_mass`), so do the loads there: the
!> node moves no mass, so that a force on it would move it at once. Between these nodes a moment then lacks a share of
!> the square of the element.
module beam_loads
   use beam_element, only: element_mass, element_stiffness, gauss_rule, hermite_shape, section_pieces
   use beam_model, only: beam_model_t, element_dofs, node_dofs
   use beam_section, only: area, area_degree
   use kinds, only: wp
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: base_mass_vector, base_rotation_vector, inertia_of_motion, inertia_of_curve, point_load, line_load
   public :: curve_t, value_on
   public :: moment_weights_t, moment_weights, moment_of_point_load, moment_of_line_load

   !> Cubics between points, beyond them straight on.
   type :: curve_t
      !> x/L, ascending, two or more
      real(wp), allocatable :: position(:)
      !> y and dy/dx there
      real(wp), allocatable :: value(:)
      real(wp), allocatable :: slope(:)
   end type curve_t

   !> The moment at x is stiffness.(y + gamma y') + mass.(y'' + alpha y') + base a_b + those of the loads.
   type :: moment_weights_t
      !> [order of the model]
      real(wp), allocatable :: stiffness(:)
      real(wp), allocatable :: mass(:)
      !> Of a translation of the base with unit acceleration
      real(wp) :: base = 0.0_wp
   end type moment_weights_t

   !> Points of a rule that is exact for shape functions.
   integer, parameter :: load_points = 2

contains

   !> M_b: rows of the full mass matrix, those of the clamp left out and its columns not, times a translation by 1.
   pure function base_mass_vector(model) result(vector)
      type(beam_model_t), intent(in) :: model
      !> [order of the model]
      real(wp), allocatable :: vector(:)

      integer :: i

      allocate (vector, source=inertia_of_motion(model, [(1.0_wp, i=0, model%mesh%elements)]))
   end function base_mass_vector

   !> The same of a rotation by 1 about the root.
   pure function base_rotation_vector(model) result(vector)
      type(beam_model_t), intent(in) :: model
      !> [order of the model]
      real(wp), allocatable :: vector(:)

      allocate (vector, source=inertia_of_motion(model, model%mesh%position))
   end function base_rotation_vector

   !> The full mass matrix times a motion linear between nodes; a rotary inertia turns by the mean of both sides.
   pure function inertia_of_motion(model, motion) result(vector)
      type(beam_model_t), intent(in) :: model
      !> y of the nodes, [0:n]
      real(wp), intent(in) :: motion(0:)
      real(wp) :: vector(model%mass%order)

      real(wp) :: slope(0:size(motion))
      integer :: dofs(2), element, i

      vector = 0.0_wp
      do element = 1, model%mesh%elements
         associate (before => motion(element - 1), after => motion(element))
            slope(element) = (after - before)/model%mesh%length(element)
            call spread_over(element_dofs(model, element), matmul(mass_of(model, element), [before, slope(element), &
               after, slope(element)]), vector)
         end associate
      end do
      slope(0) = slope(1)
      slope(size(motion)) = slope(model%mesh%elements)
      call give_to_neighbours(model, vector)
      vector(model%tip_dof) = vector(model%tip_dof) + model%tip_mass_ratio*motion(model%mesh%elements)
      do i = 1, size(model%point_masses)
         associate (added => model%point_masses(i), node => model%point_masses(i)%node)
            dofs = node_dofs(model, node)
            vector(dofs) = vector(dofs) + [added%mass*motion(node), added%rotary_inertia*0.5_wp*(slope(node) &
               + slope(node + 1))]
         end associate
      end do
   end function inertia_of_motion

   !> Integrals of the mass per length times a curve times the shape functions, and point masses times its values and
   !> slopes: the right side of the motion that is nearest to it in the mean over the mass.
   pure function inertia_of_curve(model, curve) result(vector)
      type(beam_model_t), intent(in) :: model
      type(curve_t), intent(in) :: curve
      !> [order of the model]
      real(wp) :: vector(model%mass%order)

      integer :: element, i, node

      vector = 0.0_wp
      do element = 1, model%mesh%elements
         call spread_over(element_dofs(model, element), inertia_on_element(model, element, curve), vector)
      end do
      call give_to_neighbours(model, vector)
      vector(model%tip_dof) = vector(model%tip_dof) + model%tip_mass_ratio*value_on(curve, 1.0_wp)
      do i = 1, size(model%point_masses)
         node = model%point_masses(i)%node
         associate (added => model%point_masses(i), dofs => node_dofs(model, node), x => model%mesh%position(node))
            vector(dofs) = vector(dofs) + [added%mass*value_on(curve, x), added%rotary_inertia*slope_on(curve, x)]
         end associate
      end do
   end function inertia_of_curve

   !> The same of the mass of one element.
   pure function inertia_on_element(model, element, curve) result(inertia)
      type(beam_model_t), intent(in) :: model
      integer, intent(in) :: element
      type(curve_t), intent(in) :: curve
      real(wp) :: inertia(4)

      real(wp), allocatable :: cut(:), point(:), weight(:)
      real(wp) :: xi, width
      integer :: i, piece

      inertia = 0.0_wp
      allocate (cut, source=pieces_of(model, element, curve))
      call gauss_rule((6 + area_degree(model%section))/2 + 1, point, weight)
      associate (left => model%mesh%position(element - 1), length => model%mesh%length(element), &
         right => model%mesh%tip_distance(element))
         do piece = 1, size(cut) - 1
            width = cut(piece + 1) - cut(piece)
            do i = 1, size(point)
               xi = cut(piece) + width*point(i)
               inertia = inertia + weight(i)*width*length*area(model%section, right + (1.0_wp - xi)*length) &
                  *value_on(curve, left + xi*length)*hermite_shape(xi, length)
            end do
         end do
      end associate
   end function inertia_on_element

   !> Where an element must be cut so that its section and a curve are one polynomial on each piece.
   pure function pieces_of(model, element, curve) result(cut)
      type(beam_model_t), intent(in) :: model
      integer, intent(in) :: element
      type(curve_t), intent(in) :: curve
      !> Ascending from 0 (left node) to 1 (right node)
      real(wp), allocatable :: cut(:)

      real(wp), allocatable :: place(:)

      associate (left => model%mesh%position(element - 1), length => model%mesh%length(element))
         allocate (place, source=[section_pieces(model%section, length, model%mesh%tip_distance(element)), &
            pack((curve%position - left)/length, curve%position > left .and. &
            curve%position < model%mesh%position(element))])
      end associate
      allocate (cut, source=place(ascending_order(place)))
   end function pieces_of

   !> A curve at a place.
   pure function value_on(curve, x) result(value)
      type(curve_t), intent(in) :: curve
      !> x/L
      real(wp), intent(in) :: x
      real(wp) :: value

      real(wp) :: end
      integer :: k

      end = min(max(x, curve%position(1)), curve%position(size(curve%position)))
      k = stretch_at(curve, x)
      associate (length => curve%position(k + 1) - curve%position(k))
         value = dot_product(hermite_shape((end - curve%position(k))/length, length), [curve%value(k), curve%slope(k), &
            curve%value(k + 1), curve%slope(k + 1)])
      end associate
      if (abs(x - end) > 0.0_wp) value = value + (x - end)*slope_on(curve, end)
   end function value_on

   !> Its slope there.
   pure function slope_on(curve, x) result(slope)
      type(curve_t), intent(in) :: curve
      !> x/L
      real(wp), intent(in) :: x
      real(wp) :: slope

      real(wp) :: share
      integer :: k

      k = stretch_at(curve, x)
      associate (length => curve%position(k + 1) - curve%position(k))
         share = min(max((x - curve%position(k))/length, 0.0_wp), 1.0_wp)
         slope = 6.0_wp*share*(1.0_wp - share)*(curve%value(k + 1) - curve%value(k))/length &
            + (1.0_wp - share)*(1.0_wp - 3.0_wp*share)*curve%slope(k) &
            + share*(3.0_wp*share - 2.0_wp)*curve%slope(k + 1)
      end associate
   end function slope_on

   !> The stretch of a curve in which x lies, or the one next to it.
   pure function stretch_at(curve, x) result(stretch)
      type(curve_t), intent(in) :: curve
      real(wp), intent(in) :: x
      integer :: stretch

      stretch = max(1, min(count(curve%position <= x), size(curve%position) - 1))
   end function stretch_at

   !> Consistent loads of a unit force.
   pure function point_load(model, at) result(vector)
      type(beam_model_t), intent(in) :: model
      !> x/L, 0 to 1
      real(wp), intent(in) :: at
      !> [order of the model]
      real(wp) :: vector(model%mass%order)

      integer :: element

      vector = 0.0_wp
      element = element_at(model, at)
      associate (length => model%mesh%length(element))
         call spread_over(element_dofs(model, element), hermite_shape(place_in(model, element, at)/length, length), &
            vector)
      end associate
      call give_to_neighbours(model, vector)
   end function point_load

   !> Consistent loads of a unit force per length.
   pure function line_load(model, from, to) result(vector)
      type(beam_model_t), intent(in) :: model
      !> Ends of its stretch, x/L, 0 to 1, ascending
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
      !> [order of the model]
      real(wp) :: vector(model%mass%order)

      integer :: element

      vector = 0.0_wp
      do element = element_at(model, from), element_at(model, to)
         call spread_over(element_dofs(model, element), load_on_element(model, element, from, to), vector)
      end do
      call give_to_neighbours(model, vector)
   end function line_load

   !> The bending moment at x; at a node that on the clamp's side of it, at the root that within the beam.
   pure function moment_weights(model, x) result(weights)
      type(beam_model_t), intent(in) :: model
      !> x/L, 0 to 1
      real(wp), intent(in) :: x
      type(moment_weights_t) :: weights

      real(wp), allocatable :: cut(:), point(:), weight(:)
      real(wp) :: inertia(4), s, stiffness(4, 4), xi, width
      integer :: element, i, piece

      element = element_at(model, x)
      s = place_in(model, element, x)
      stiffness = element_stiffness(model%section, model%mesh%length(element), model%mesh%tip_distance(element))
      inertia = end_moment(mass_of(model, element), s)
      associate (length => model%mesh%length(element), right => model%mesh%tip_distance(element))
         allocate (cut, source=section_pieces(model%section, length, right))
         call gauss_rule((4 + area_degree(model%section))/2 + 1, point, weight)
         do piece = 1, size(cut) - 1
            width = min(cut(piece + 1), s/length) - cut(piece)
            if (width <= 0.0_wp) exit
            do i = 1, size(point)
               xi = cut(piece) + width*point(i)
               inertia = inertia - weight(i)*width*length*area(model%section, right + (1.0_wp - xi)*length) &
                  *(s - xi*length)*hermite_shape(xi, length)
            end do
         end do
      end associate
      allocate (weights%stiffness(model%stiffness%order), weights%mass(model%mass%order), source=0.0_wp)
      call spread_over(element_dofs(model, element), end_moment(stiffness, s), weights%stiffness)
      call spread_over(element_dofs(model, element), inertia, weights%mass)
      call give_to_neighbours(model, weights%mass)
      weights%base = inertia(1) + inertia(3)
   end function moment_weights

   !> What a unit force adds to the moment at x.
   pure function moment_of_point_load(model, x, at) result(moment)
      type(beam_model_t), intent(in) :: model
      !> Where the moment is asked for, and where the force acts, x/L, 0 to 1
      real(wp), intent(in) :: x
      real(wp), intent(in) :: at
      real(wp) :: moment

      real(wp) :: ends(4), s
      integer :: element

      moment = 0.0_wp
      element = element_at(model, x)
      if (element_at(model, at) /= element) return
      s = place_in(model, element, x)
      associate (length => model%mesh%length(element))
         ends = hermite_shape(place_in(model, element, at)/length, length)
      end associate
      moment = ends(2) - s*ends(1) + max(x - at, 0.0_wp)
   end function moment_of_point_load

   !> What a unit force per length adds to the moment at x.
   pure function moment_of_line_load(model, x, from, to) result(moment)
      type(beam_model_t), intent(in) :: model
      !> Where the moment is asked for, x/L, 0 to 1
      real(wp), intent(in) :: x
      !> Ends of the stretch, x/L, 0 to 1, ascending
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
      real(wp) :: moment

      real(wp) :: ends(4), left, right
      integer :: element

      element = element_at(model, x)
      associate (start => model%mesh%position(element - 1))
         ends = load_on_element(model, element, from, to)
         left = max(from, start)
         right = max(min(to, x), left)
         moment = ends(2) - (x - start)*ends(1) + (right - left)*(x - 0.5_wp*(left + right))
      end associate
   end function moment_of_line_load

   !> The moment at a distance from an element's left end, of the forces at that end alone.
   pure function end_moment(matrix, s) result(weights)
      !> Of the element; times its degrees of freedom it gives the forces at its ends
      real(wp), intent(in) :: matrix(4, 4)
      !> The distance, in L
      real(wp), intent(in) :: s
      real(wp) :: weights(4)

      weights = s*matrix(:, 1) - matrix(:, 2)
   end function end_moment

   !> Consistent loads of a unit force per length on an element.
   pure function load_on_element(model, element, from, to) result(load)
      type(beam_model_t), intent(in) :: model
      integer, intent(in) :: element
      !> Ends of its stretch, x/L
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
      real(wp) :: load(4)

      real(wp), allocatable :: point(:), weight(:)
      real(wp) :: left, width
      integer :: i

      load = 0.0_wp
      associate (length => model%mesh%length(element))
         left = max(place_in(model, element, from), 0.0_wp)/length
         width = min(place_in(model, element, to)/length, 1.0_wp) - left
         if (width <= 0.0_wp) return
         call gauss_rule(load_points, point, weight)
         do i = 1, load_points
            load = load + weight(i)*width*length*hermite_shape(left + width*point(i), length)
         end do
      end associate
   end function load_on_element

   !> The element in which x lies; of two that of the clamp's side.
   pure function element_at(model, x) result(element)
      type(beam_model_t), intent(in) :: model
      !> x/L, 0 to 1
      real(wp), intent(in) :: x
      integer :: element

      element = max(1, min(model%mesh%elements, count(model%mesh%position < x)))
   end function element_at

   !> The distance of x to an element's left end, in L.
   pure function place_in(model, element, x) result(s)
      type(beam_model_t), intent(in) :: model
      integer, intent(in) :: element
      !> x/L
      real(wp), intent(in) :: x
      real(wp) :: s

      s = min(x - model%mesh%position(element - 1), model%mesh%length(element))
   end function place_in

   pure function mass_of(model, element) result(mass)
      type(beam_model_t), intent(in) :: model
      integer, intent(in) :: element
      real(wp) :: mass(4, 4)

      mass = element_mass(model%section, model%mesh%length(element), model%mesh%tip_distance(element))
   end function mass_of

   !> Add what belongs to the degrees of freedom of an element.
   pure subroutine spread_over(dofs, values, vector)
      !> Those that are held are below 1
      integer, intent(in) :: dofs(4)
      real(wp), intent(in) :: values(4)
      real(wp), intent(inout) :: vector(:)

      integer :: i

      do i = 1, 4
         if (dofs(i) > 0) vector(dofs(i)) = vector(dofs(i)) + values(i)
      end do
   end subroutine spread_over

   !> What acts on a node whose inertia belongs to its neighbours acts on those.
   pure subroutine give_to_neighbours(model, vector)
      type(beam_model_t), intent(in) :: model
      real(wp), intent(inout) :: vector(:)

      integer :: own

      if (.not. model%is_redistributed) return
      own = 2*model%mesh%struck_node - 1
      call spread_over(model%continuation%dof, model%continuation%weight*vector(own), vector)
      vector(own) = 0.0_wp
   end subroutine give_to_neighbours

end module beam_loads
