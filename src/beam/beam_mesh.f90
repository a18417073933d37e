!> The partition of the beam into elements: geometric or as given, with a node at the stop (docs/theory.md, section 3).
module beam_mesh
   use failures, only: fail, failure_t, status_bad_input
   use kinds, only: wp
   use number_text, only: to_text
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: mesh_t, make_mesh

   !> A stop is at the tip where the element beyond it would be a smaller share of its neighbour than this. The mass
   !> that takes part in an impact falls with that element, so impacts grow without limit as it shrinks: with 1 to 32
   !> elements, ratios 0.7 to 3 and zeta = 0.001 to 1 they are under 1000 down to this share, and over 30 000 from
   !> 1/200 (ratio 2) or 1/2000 (ratio 1) on. Besides, it would cost the rest of the beam an element: at 1/5000 the
   !> first peak (preload 0.1) is wrong by 0.069 with n = 4 and 0.008 with n = 8, that of a stop at the tip by 0.005 and
   !> 0.001; with n = 32 the tip's is off by 0.001 at most.
   real(wp), parameter :: nearest_to_tip = 0.01_wp

   type :: mesh_t
      !> Number of elements n, more than asked for where one was split
      integer :: elements = 0
      !> Lengths in L, from the clamp, [n]
      real(wp), allocatable :: length(:)
      !> x/L of the nodes, [0:n]
      real(wp), allocatable :: position(:)
      !> Distance of the nodes to the tip in L, summed up from the tip, [0:n]
      real(wp), allocatable :: tip_distance(:)
      !> Node at the stop
      integer :: stop_node = 0
      !> The node whose inertia `redistributed_mass` gives away: of several stops it is the tip's, if one is there
      integer :: struck_node = 0
      !> Nodes at the further positions that were asked for; unallocated: none were
      integer, allocatable :: more_nodes(:)
      !> The first of them, those of stops
      integer :: more_stops = 0
   end type mesh_t

contains

   !> Geometric partition, l_i / l_(i+1) = ratio, with a node at the stop: the nearest interior node
   !> moves there (of two equally near the one towards the clamp); without interior nodes the element is split.
   !> The tip never moves: a stop too near to it (`nearest_to_tip`) is at the tip.
   !>
   !> Fails when an element vanishes in working precision.
   pure subroutine make_mesh(elements, ratio, stop_position, mesh, error, more_positions, more_stops, nodes)
      !> Number of elements, >= 1
      integer, intent(in) :: elements
      !> Ratio of neighbouring lengths, > 0; above 1 the long element is at the clamp
      real(wp), intent(in) :: ratio
      !> Lc/L, in (0, 1]
      real(wp), intent(in) :: stop_position
      type(mesh_t), intent(out) :: mesh
      !> Set when no such partition exists
      type(failure_t), allocatable, intent(out) :: error
      !> x/L of further stops and then of all else that needs a node, in (0, 1]
      real(wp), intent(in), optional :: more_positions(:)
      !> So many of them are stops; default all
      integer, intent(in), optional :: more_stops
      !> x/L of nodes that are given instead of the ratio, ascending from 0 to 1; elements divide what is between them
      real(wp), intent(in), optional :: nodes(:)

      mesh%elements = elements
      if (present(nodes)) then
         mesh%length = divided(nodes, elements/(size(nodes) - 1))
      else
         mesh%length = geometric(elements, ratio)
      end if
      if (minval(mesh%length) < tiny(1.0_wp)/epsilon(1.0_wp)) then
         call fail(error, status_bad_input, 'the smallest element of this mesh vanishes in double precision')
         return
      end if
      call place_nodes(mesh)
      if (present(more_positions)) then
         if (size(more_positions) > 0) then
            mesh%more_stops = size(more_positions)
            if (present(more_stops)) mesh%more_stops = more_stops
            call put_nodes(mesh, [stop_position, more_positions], error)
            return
         end if
      end if
      mesh%stop_node = mesh%elements
      if (1.0_wp - stop_position >= nearest_to_tip*(stop_position - mesh%position(max(0, elements - 2)))) then
         call put_node_at_stop(mesh, stop_position, error)
      end if
      mesh%struck_node = mesh%stop_node
   end subroutine make_mesh

   !> Lengths in geometric progression.
   pure function geometric(elements, ratio) result(length)
      integer, intent(in) :: elements
      !> Of neighbours
      real(wp), intent(in) :: ratio
      !> Of sum 1, [elements]
      real(wp) :: length(elements)

      real(wp) :: step
      integer :: i

      ! the longest element is 1, so that nothing overflows
      step = min(ratio, 1.0_wp/ratio)
      do i = 1, elements
         if (ratio >= 1.0_wp) then
            length(i) = step**(i - 1)
         else
            length(i) = step**(elements - i)
         end if
      end do
      length = length/sum(length)
   end function geometric

   !> Lengths between nodes, each divided into equal parts.
   pure function divided(nodes, parts) result(length)
      !> x/L, ascending from 0 to 1
      real(wp), intent(in) :: nodes(:)
      integer, intent(in) :: parts
      real(wp) :: length((size(nodes) - 1)*parts)

      integer :: i

      length = [((nodes(1 + (i + parts - 1)/parts) - nodes((i + parts - 1)/parts))/real(parts, wp), i=1, size(length))]
   end function divided

   !> Positions and distances to the tip from the lengths.
   pure subroutine place_nodes(mesh)
      !> The mesh, its lengths given
      type(mesh_t), intent(inout) :: mesh

      real(wp) :: lost
      integer :: i

      associate (n => mesh%elements)
         if (allocated(mesh%position)) deallocate (mesh%position, mesh%tip_distance)
         allocate (mesh%position(0:n), mesh%tip_distance(0:n))
         mesh%position(0) = 0.0_wp
         lost = 0.0_wp
         do i = 1, n - 1
            call add_up(mesh%position(i - 1), mesh%length(i), mesh%position(i), lost)
         end do
         mesh%position(n) = 1.0_wp
         mesh%tip_distance(n) = 0.0_wp
         lost = 0.0_wp
         do i = n - 1, 1, -1
            call add_up(mesh%tip_distance(i + 1), mesh%length(i + 1), mesh%tip_distance(i), lost)
         end do
         mesh%tip_distance(0) = 1.0_wp
      end associate
   end subroutine place_nodes

   !> Kahan's compensated sum: along 100 000 elements rounding would else move the nodes by 1e-12.
   pure subroutine add_up(before, term, total, lost)
      !> Sum so far
      real(wp), intent(in) :: before
      !> Next term
      real(wp), intent(in) :: term
      !> Sum with it
      real(wp), intent(out) :: total
      !> What rounding has added to the sum too much
      real(wp), intent(inout) :: lost

      real(wp) :: rest

      rest = term - lost
      total = before + rest
      lost = (total - before) - rest
   end subroutine add_up

   !> A node at each of several positions, whatever their order. As for one stop alone the nearest interior node moves
   !> there; where it is needed elsewhere, an element is split.
   pure subroutine put_nodes(mesh, positions, error)
      !> The mesh that changes
      type(mesh_t), intent(inout) :: mesh
      !> x/L, the first that of `stop_node`
      real(wp), intent(in) :: positions(:)
      !> Set where two of them are too near to each other
      type(failure_t), allocatable, intent(inout) :: error

      integer :: order(size(positions)), node
      real(wp) :: last_but_one, place(size(positions))
      logical, allocatable :: is_taken(:)
      integer :: i

      allocate (is_taken(mesh%elements), source=.false.)
      last_but_one = mesh%position(max(0, mesh%elements - 2))
      place = positions
      where (1.0_wp - place < nearest_to_tip*(place - last_but_one)) place = 1.0_wp
      do i = 1, size(place)
         node = node_at(mesh, place(i))
         if (node > 0) is_taken(node) = .true.
      end do
      order = ascending_order(place)
      do i = 1, size(order)
         call put_node(mesh, place(order(i)), is_taken, error)
         if (allocated(error)) return
      end do
      mesh%stop_node = node_at(mesh, place(1))
      allocate (mesh%more_nodes, source=[(node_at(mesh, place(i)), i=2, size(place))])
      mesh%struck_node = mesh%stop_node
      if (any(mesh%more_nodes(:mesh%more_stops) == mesh%elements)) mesh%struck_node = mesh%elements
   end subroutine put_nodes

   !> The node at a position, but for rounding; 0: there is none.
   pure function node_at(mesh, x) result(node)
      type(mesh_t), intent(in) :: mesh
      !> x/L
      real(wp), intent(in) :: x
      integer :: node

      node = minloc(abs(mesh%position(1:) - x), dim=1)
      if (abs(mesh%position(node) - x) > 4.0_wp*epsilon(1.0_wp)) node = 0
   end function node_at

   !> A node at one of several positions.
   pure subroutine put_node(mesh, x, is_taken, error)
      !> The mesh that changes
      type(mesh_t), intent(inout) :: mesh
      !> x/L
      real(wp), intent(in) :: x
      !> The nodes that stay where they are, [elements]
      logical, allocatable, intent(inout) :: is_taken(:)
      !> Set where there is no room for it
      type(failure_t), allocatable, intent(inout) :: error

      real(wp) :: left, right
      integer :: element, node

      if (node_at(mesh, x) > 0) return
      element = count(mesh%position < x)
      left = x - mesh%position(element - 1)
      right = mesh%position(element) - x
      node = minloc(abs(mesh%position(1:mesh%elements - 1) - x), dim=1)
      if (node > 0) then
         if (is_taken(node)) node = 0
      end if
      if (node > 0) then
         if (node < element) left = x - mesh%position(node - 1)
         if (node == element) right = mesh%position(node + 1) - x
         mesh%length(node:node + 1) = [left, right]
      else if (min(left, right) < nearest_to_tip*(left + right) .and. size(is_taken) > 1) then
         call fail(error, status_bad_input, 'the position '//to_text(x)//' of a stop, support, mass or step is &
         &too near to that of another, to the clamp or to the tip for an element between them; a finer mesh has &
         &shorter ones')
         return
      else
         node = element
         mesh%length = [mesh%length(:element - 1), left, right, mesh%length(element + 1:)]
         is_taken = [is_taken(:element - 1), .true., is_taken(element:)]
         mesh%elements = mesh%elements + 1
      end if
      is_taken(node) = .true.
      call place_nodes(mesh)
   end subroutine put_node

   !> Move the nearest interior node to the stop, or split the only element.
   pure subroutine put_node_at_stop(mesh, stop_position, error)
      !> The mesh that changes
      type(mesh_t), intent(inout) :: mesh
      !> Lc/L, in (0, 1)
      real(wp), intent(in) :: stop_position
      !> Set when the stop is too near to a neighbour for an element between them
      type(failure_t), allocatable, intent(inout) :: error

      integer :: node

      if (mesh%elements == 1) then
         mesh%length = [stop_position, 1.0_wp - stop_position]
         mesh%elements = 2
         node = 1
      else
         node = minloc(abs(mesh%position(1:mesh%elements - 1) - stop_position), dim=1)
         if (abs(mesh%position(node) - stop_position) > 4.0_wp*epsilon(1.0_wp)) then
            if (node + 1 == mesh%elements) then
               mesh%length(node + 1) = 1.0_wp - stop_position
            else
               mesh%length(node + 1) = mesh%position(node + 1) - stop_position
            end if
            mesh%length(node) = stop_position - mesh%position(node - 1)
         end if
      end if
      mesh%stop_node = node
      if (minval(mesh%length) <= 0.0_wp) then
         call fail(error, status_bad_input, 'the stop is too near to the next node for an element between them')
         return
      end if
      call place_nodes(mesh)
   end subroutine put_node_at_stop

end module beam_mesh
