!> The partition of the beam into elements, with a node at the stop (docs/theory.md, section 3). The lengths of the
!> elements are a geometric progression, or the elements divide the intervals between given nodes.
module beam_mesh
   use failures, only: fail, failure_t, status_bad_input
   use kinds, only: wp
   use number_text, only: to_text
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: mesh_t, make_mesh

   !> Minimum length of the element between stop and tip, relative to its neighbour; for a shorter element the stop is
   !> moved to the tip. The mass that takes part in an impact decreases with that element, so the number of impacts
   !> grows without limit as the element shrinks. With 1 to 32 elements, l_i/l_(i+1) from 0.7 to 3 and zeta from 0.001
   !> to 1, a run has under 1000 impacts down to this relative length; below 1/200 (if l_i/l_(i+1) = 2) or 1/2000 (if
   !> the lengths are equal) it has over 30 000. Moreover, a node that is moved so near to the tip leaves the rest of
   !> the beam with one element less. For a stop that leaves a last element of relative length 1/5000 (preload 0.1), the
   !> error of eta at its first peak, compared with a fine mesh, is 0.069 with n = 4 and 0.008 with n = 8; after the
   !> stop has been moved to the tip it is 0.005 and 0.001.
   !>
   !> This is also the minimum length, relative to the element, of the parts of an element that is split at a position;
   !> the only element of a mesh may be split into parts of any length.
   real(wp), parameter :: min_relative_length = 0.01_wp

   !> The partition. Distances to the tip are stored besides positions because 1 - x would lose digits near the tip.
   type :: mesh_t
      !> Number of elements n, more than requested if elements were split
      integer :: elements = 0
      !> Lengths of the elements in L, from the root, [n]
      real(wp), allocatable :: length(:)
      !> Positions x/L of the nodes, [0:n]
      real(wp), allocatable :: position(:)
      !> Distances of the nodes to the tip in L, summed up from the tip, [0:n]
      real(wp), allocatable :: tip_distance(:)
      !> Node at the stop
      integer :: stop_node = 0
      !> Node whose inertia `redistributed_mass` redistributes: the tip if one of the stops is at the tip, else
      !> `stop_node`
      integer :: redistributed_node = 0
      !> Nodes at further positions: of other stops, then of supports, masses and steps of the cross section;
      !> unallocated: there are none
      integer, allocatable :: further_nodes(:)
      !> Number of the other stops, whose nodes come first in `further_nodes`
      integer :: further_stops = 0
   end type mesh_t

contains

   !> Partition with l_i / l_(i+1) = ratio, or between given nodes, with a node at the stop. The nearest interior node
   !> is moved to the stop (of two equally near nodes that towards the root). If there is no interior node, or the
   !> nearest is needed at another position, an element is split. The node at the tip never moves: a stop, support, mass
   !> or step of the cross section closer to the tip than `min_relative_length` allows is moved to the tip.
   !>
   !> The partition fails if an element vanishes in double precision, or if a position is too near to another position
   !> or to the clamp.
   pure subroutine make_mesh(elements, ratio, stop_position, mesh, error, further_positions, further_stop_count, nodes)
      !> Number of elements, >= 1
      integer, intent(in) :: elements
      !> Ratio of neighbouring lengths, > 0; above 1 the longest element is at the root
      real(wp), intent(in) :: ratio
      !> Position Lc/L of the stop, in (0, 1]
      real(wp), intent(in) :: stop_position
      type(mesh_t), intent(out) :: mesh
      !> Set if no such partition exists
      type(failure_t), allocatable, intent(out) :: error
      !> Positions x/L that need a node, in (0, 1]: of further stops, then of supports, masses and steps of the cross
      !> section
      real(wp), intent(in), optional :: further_positions(:)
      !> Number of stops among `further_positions`; default all
      integer, intent(in), optional :: further_stop_count
      !> Positions x/L of given nodes, ascending from 0 to 1; each interval between them is divided into the same number
      !> of elements, so `elements` is a multiple of the number of intervals. `ratio` is then not used
      real(wp), intent(in), optional :: nodes(:)

      integer :: i

      mesh%elements = elements
      if (present(nodes)) then
         associate (parts => elements/(size(nodes) - 1))
            ! each interval between given nodes has this number of equal parts: element i is in the interval
            ! (i + parts - 1)/parts
            mesh%length = [((nodes(1 + (i + parts - 1)/parts) - nodes((i + parts - 1)/parts))/real(parts, wp), &
               i=1, (size(nodes) - 1)*parts)]
         end associate
      else
         mesh%length = geometric_lengths(elements, ratio)
      end if
      if (minval(mesh%length) < tiny(1.0_wp)/epsilon(1.0_wp)) then
         call fail(error, status_bad_input, 'the smallest element of this mesh vanishes in double precision')
         return
      end if
      call compute_positions(mesh)
      if (present(further_positions)) then
         if (size(further_positions) > 0) then
            mesh%further_stops = size(further_positions)
            if (present(further_stop_count)) mesh%further_stops = further_stop_count
            call place_nodes_at(mesh, [stop_position, further_positions], error)
            return
         end if
      end if
      mesh%stop_node = mesh%elements
      ! if node n - 1 is moved to the stop, the last element gets the length 1 - stop_position, and its neighbour begins
      ! at node n - 2; if another node is moved, the last element is long enough and the test is true
      if (1.0_wp - stop_position >= min_relative_length*(stop_position - mesh%position(max(0, elements - 2)))) then
         call place_stop_node(mesh, stop_position)
      end if
      mesh%redistributed_node = mesh%stop_node
   end subroutine make_mesh

   !> Lengths of elements in geometric progression.
   pure function geometric_lengths(elements, ratio) result(length)
      integer, intent(in) :: elements
      !> Ratio of neighbouring lengths
      real(wp), intent(in) :: ratio
      !> Lengths with sum 1, [elements]
      real(wp) :: length(elements)

      real(wp) :: common_ratio
      integer :: i

      ! before the division by the sum, the longest element has length 1, so that no power overflows
      common_ratio = min(ratio, 1.0_wp/ratio)
      length = [(common_ratio**(i - 1), i=1, elements)]
      if (ratio < 1.0_wp) length = length(elements:1:-1)
      length = length/sum(length)
   end function geometric_lengths

   !> Compute positions of nodes and distances to the tip from the lengths of elements.
   pure subroutine compute_positions(mesh)
      !> Mesh with given lengths
      type(mesh_t), intent(inout) :: mesh

      real(wp) :: compensation
      integer :: i

      associate (n => mesh%elements)
         if (allocated(mesh%position)) deallocate (mesh%position, mesh%tip_distance)
         allocate (mesh%position(0:n), mesh%tip_distance(0:n))
         mesh%position(0) = 0.0_wp
         compensation = 0.0_wp
         do i = 1, n - 1
            call add_compensated(mesh%position(i - 1), mesh%length(i), mesh%position(i), compensation)
         end do
         mesh%position(n) = 1.0_wp
         mesh%tip_distance(n) = 0.0_wp
         compensation = 0.0_wp
         do i = n - 1, 1, -1
            call add_compensated(mesh%tip_distance(i + 1), mesh%length(i + 1), mesh%tip_distance(i), compensation)
         end do
         mesh%tip_distance(0) = 1.0_wp
      end associate
   end subroutine compute_positions

   !> Kahan's compensated sum. Without compensation rounding would move the nodes by 1e-12 along 100 000 elements.
   pure subroutine add_compensated(before, term, total, compensation)
      !> Partial sum
      real(wp), intent(in) :: before
      !> Next term
      real(wp), intent(in) :: term
      !> Sum with the next term
      real(wp), intent(out) :: total
      !> Accumulated rounding error of the sum
      real(wp), intent(inout) :: compensation

      real(wp) :: corrected

      corrected = term - compensation
      total = before + corrected
      compensation = (total - before) - corrected
   end subroutine add_compensated

   !> Place a node at each of several positions in any order. The nearest interior node is moved to a position; if that
   !> node is needed at another position, an element is split.
   pure subroutine place_nodes_at(mesh, positions, error)
      !> Mesh to be changed
      type(mesh_t), intent(inout) :: mesh
      !> Positions x/L; the node at the first becomes `stop_node`
      real(wp), intent(in) :: positions(:)
      !> Set if a position is too close to another position or to the clamp
      type(failure_t), allocatable, intent(inout) :: error

      integer :: order(size(positions)), node
      ! position of node n - 2: if node n - 1 is moved to a position near the tip, the neighbour of the last element
      ! begins here
      real(wp) :: position_of_neighbour
      real(wp) :: position(size(positions))
      logical, allocatable :: is_fixed(:)
      integer :: i

      allocate (is_fixed(mesh%elements), source=.false.)
      position_of_neighbour = mesh%position(max(0, mesh%elements - 2))
      position = positions
      where (1.0_wp - position < min_relative_length*(position - position_of_neighbour)) position = 1.0_wp
      do i = 1, size(position)
         node = node_at(mesh, position(i))
         if (node > 0) is_fixed(node) = .true.
      end do
      order = ascending_order(position)
      do i = 1, size(order)
         call place_node_at(mesh, position(order(i)), is_fixed, error)
         if (allocated(error)) return
      end do
      mesh%stop_node = node_at(mesh, position(1))
      allocate (mesh%further_nodes, source=[(node_at(mesh, position(i)), i=2, size(position))])
      mesh%redistributed_node = mesh%stop_node
      if (any(mesh%further_nodes(:mesh%further_stops) == mesh%elements)) mesh%redistributed_node = mesh%elements
   end subroutine place_nodes_at

   !> The node at a position within rounding; 0: there is none.
   pure integer function node_at(mesh, x) result(node)
      type(mesh_t), intent(in) :: mesh
      !> Position x/L
      real(wp), intent(in) :: x

      node = minloc(abs(mesh%position(1:) - x), dim=1)
      if (abs(mesh%position(node) - x) > 4.0_wp*epsilon(1.0_wp)) node = 0
   end function node_at

   !> Place a node at x. Nodes that `is_fixed` marks are not moved, because they are at other requested positions.
   pure subroutine place_node_at(mesh, x, is_fixed, error)
      !> Mesh to be changed
      type(mesh_t), intent(inout) :: mesh
      !> Position x/L
      real(wp), intent(in) :: x
      !> Whether a node must not be moved, [elements]
      logical, allocatable, intent(inout) :: is_fixed(:)
      !> Set if the position is too close to another node
      type(failure_t), allocatable, intent(inout) :: error

      ! length of the element at the left of x
      real(wp) :: left
      ! length of the element at the right of x
      real(wp) :: right
      ! index of the element that contains x
      integer :: element
      ! index of the interior node that is moved to x, the nearest one; 0: there is none, or it must not be moved
      integer :: node

      if (node_at(mesh, x) > 0) return
      element = count(mesh%position < x)
      ! lengths if the element is split; if the nearest node is moved instead, one of them changes below
      left = x - mesh%position(element - 1)
      right = mesh%position(element) - x
      node = minloc(abs(mesh%position(1:mesh%elements - 1) - x), dim=1)
      ! node is 0 if there are no interior nodes
      if (node > 0) then
         if (is_fixed(node)) node = 0
      end if
      if (node > 0) then
         if (node < element) left = x - mesh%position(node - 1)
         if (node == element) right = mesh%position(node + 1) - x
         mesh%length(node:node + 1) = [left, right]
      else if (min(left, right) < min_relative_length*(left + right) .and. mesh%elements > 1) then
         ! (the only element of a mesh may be split into parts of any length, as in `place_stop_node`)
         call fail(error, status_bad_input, &
            'the position '//to_text(x)//' of a stop, support, mass or step of the section is &
         &too near to that of another, to the clamp or to the tip for an element between them; a finer mesh has &
         &shorter ones')
         return
      else
         node = element
         mesh%length = [mesh%length(:element - 1), left, right, mesh%length(element + 1:)]
         is_fixed = [is_fixed(:element - 1), .true., is_fixed(element:)]
         mesh%elements = mesh%elements + 1
      end if
      is_fixed(node) = .true.
      call compute_positions(mesh)
   end subroutine place_node_at

   !> Move the nearest interior node to the stop; split the element of a mesh that has only one element.
   pure subroutine place_stop_node(mesh, stop_position)
      !> Mesh to be changed
      type(mesh_t), intent(inout) :: mesh
      !> Position Lc/L of the stop, in (0, 1)
      real(wp), intent(in) :: stop_position

      integer :: node

      if (mesh%elements == 1) then
         mesh%length = [stop_position, 1.0_wp - stop_position]
         mesh%elements = 2
         node = 1
      else
         node = minloc(abs(mesh%position(1:mesh%elements - 1) - stop_position), dim=1)
         if (abs(mesh%position(node) - stop_position) > 4.0_wp*epsilon(1.0_wp)) then
            mesh%length(node + 1) = mesh%position(node + 1) - stop_position
            mesh%length(node) = stop_position - mesh%position(node - 1)
         end if
      end if
      mesh%stop_node = node
      call compute_positions(mesh)
   end subroutine place_stop_node

end module beam_mesh
