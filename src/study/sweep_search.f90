!> The least value of a function that jumps, without derivatives, between bounds: poll along random orthogonal
!> directions, longer steps after a success, shorter ones after none (Audet and Dennis, SIAM J. Optim. 17 (2006) 188;
!> directions by a reflection as in Abramson, Audet, Dennis and Le Digabel, ibid. 20 (2009) 948). With them go as many
!> points drawn from a wider box around the best one, for what lies beyond a jump.
!>
!> All points of a poll are known before any is computed, so they can be computed at once.
module sweep_search
   use kinds, only: wp
   use random_numbers, only: next_normal, next_random, random_t, start_random
   implicit none (type, external)
   private
   public :: search_state_t, start_search, next_poll, learn

   !> Coordinates are shares of the way between the bounds.
   type :: search_state_t
      !> The best point, [dimensions], and its value
      real(wp), allocatable :: best(:)
      real(wp) :: value = huge(1.0_wp)
      !> Length of the steps, and where the search ends
      real(wp) :: step = 0.125_wp
      real(wp) :: precision = 1.0e-4_wp
      !> Points computed, and allowed
      integer :: evaluations = 0
      integer :: most_evaluations = 0
      !> Polls without success at this length
      integer :: misses = 0
      logical :: is_over = .false.
      type(random_t) :: random
   end type search_state_t

   !> A jump can hide a better point beside one set of directions: so many sets before the step is halved.
   integer, parameter :: patience = 3
   !> Half the width of the box, in steps.
   real(wp), parameter :: box = 4.0_wp

contains

   !> Begin at a point.
   pure subroutine start_search(start, value, step, precision, most_evaluations, seed, state)
      !> The point, each coordinate 0 to 1
      real(wp), intent(in) :: start(:)
      !> Its value
      real(wp), intent(in) :: value
      !> First length of the steps, and where the search ends
      real(wp), intent(in) :: step
      real(wp), intent(in) :: precision
      !> Most points to compute
      integer, intent(in) :: most_evaluations
      !> Start of the random numbers
      integer, intent(in) :: seed
      !> Ready
      type(search_state_t), intent(out) :: state

      allocate (state%best, source=start)
      state%value = value
      state%step = step
      state%precision = precision
      state%most_evaluations = most_evaluations
      state%is_over = size(start) == 0 .or. most_evaluations <= 0
      call start_random(seed, 1000, state%random)
   end subroutine start_search

   !> Points around the best one: two in each of as many orthogonal directions as there are dimensions, then as many
   !> drawn from the box.
   pure subroutine next_poll(state, points)
      type(search_state_t), intent(inout) :: state
      !> The points, [dimensions, points]
      real(wp), allocatable, intent(out) :: points(:, :)

      real(wp), dimension(size(state%best)) :: normal, direction
      real(wp) :: place
      integer :: i, k, n, room

      n = size(state%best)
      do i = 1, n
         call next_normal(state%random, normal(i))
      end do
      normal = normal/norm2(normal)
      room = min(4*n, state%most_evaluations - state%evaluations)
      allocate (points(n, max(room, 0)))
      do i = 1, min(2*n, size(points, 2))
         ! column of the reflection 1 - 2 n n^T
         direction = -2.0_wp*normal((i + 1)/2)*normal
         direction((i + 1)/2) = direction((i + 1)/2) + 1.0_wp
         if (modulo(i, 2) == 0) direction = -direction
         points(:, i) = min(max(state%best + state%step*direction, 0.0_wp), 1.0_wp)
      end do
      do i = 2*n + 1, size(points, 2)
         do k = 1, n
            call next_random(state%random, place)
            points(k, i) = min(max(state%best(k) + box*state%step*(2.0_wp*place - 1.0_wp), 0.0_wp), 1.0_wp)
         end do
      end do
   end subroutine next_poll

   !> Take note of a poll's values.
   pure subroutine learn(state, points, values)
      type(search_state_t), intent(inout) :: state
      !> The points of the poll
      real(wp), intent(in) :: points(:, :)
      !> Their values; huge: none
      real(wp), intent(in) :: values(:)

      integer :: winner

      state%evaluations = state%evaluations + size(values)
      winner = 0
      if (size(values) > 0) winner = minloc(values, dim=1)
      if (winner > 0) then
         if (.not. values(winner) < state%value) winner = 0
      end if
      if (winner > 0) then
         state%value = values(winner)
         state%best = points(:, winner)
         state%step = min(2.0_wp*state%step, 0.5_wp)
         state%misses = 0
      else
         state%misses = state%misses + 1
         if (state%misses >= patience) then
            state%step = 0.5_wp*state%step
            state%misses = 0
         end if
      end if
      state%is_over = state%step < state%precision .or. state%evaluations >= state%most_evaluations
   end subroutine learn

end module sweep_search
