!> Minimisation of a discontinuous function between bounds without derivatives: mesh adaptive direct search. Each poll
!> has points in random orthogonal directions around the best point; the step is lengthened after a success and
!> shortened after failures (Audet and Dennis, SIAM J. Optim. 17 (2006) 188; directions by a reflection as in Abramson,
!> Audet, Dennis and Le Digabel, ibid. 20 (2009) 948). Each poll also has as many random points in a wider box around
!> the best point, to find better points beyond a discontinuity.
!>
!> All points of a poll are known before the first is computed, so they can be computed in parallel.
module sweep_search
   use kinds, only: wp
   use random_numbers, only: next_normal, next_random, random_t, start_random
   implicit none (type, external)
   private
   public :: search_state_t, start_search, next_poll, update_search

   !> State of a search. Coordinates are 0 at the lower and 1 at the upper bound.
   type :: search_state_t
      !> Best point, [dimensions]
      real(wp), allocatable :: best(:)
      !> Value at the best point
      real(wp) :: value = huge(1.0_wp)
      !> Length of the steps
      real(wp) :: step = 0.125_wp
      !> Length below which the search ends
      real(wp) :: precision = 1.0e-4_wp
      !> Number of points computed
      integer :: evaluations = 0
      !> Maximum number of points
      integer :: max_evaluations = 0
      !> Number of successive polls without success at this length of the step
      integer :: failed_polls = 0
      !> Whether the search has ended
      logical :: is_over = .false.
      type(random_t) :: random
   end type search_state_t

   !> Number of unsuccessful polls before the step is halved; several sets of directions are tried, because beside a
   !> discontinuity a better point can lie between the directions of one set.
   integer, parameter :: patience = 3
   !> Half the width of the box of random points, in steps.
   real(wp), parameter :: box = 4.0_wp

contains

   !> Initialise a search at a point.
   pure subroutine start_search(start, value, step, precision, max_evaluations, seed, state)
      !> First point, each coordinate 0 to 1
      real(wp), intent(in) :: start(:)
      !> Value of the function at the first point
      real(wp), intent(in) :: value
      !> First length of the steps
      real(wp), intent(in) :: step
      !> Length below which the search ends
      real(wp), intent(in) :: precision
      !> Maximum number of points to compute
      integer, intent(in) :: max_evaluations
      !> Seed of the random numbers
      integer, intent(in) :: seed
      !> Initialised search
      type(search_state_t), intent(out) :: state

      allocate (state%best, source=start)
      state%value = value
      state%step = step
      state%precision = precision
      state%max_evaluations = max_evaluations
      state%is_over = size(start) == 0 .or. max_evaluations <= 0
      ! the sequence 1000 is that of no parameter of a sweep
      call start_random(seed, 1000, state%random)
   end subroutine start_search

   !> The points of the next poll: two in each of n orthogonal directions around the best point, with n the number of
   !> dimensions, then 2 n random points in the box.
   pure subroutine next_poll(state, points)
      type(search_state_t), intent(inout) :: state
      !> Points of the poll, [dimensions, points]
      real(wp), allocatable, intent(out) :: points(:, :)

      real(wp), dimension(size(state%best)) :: normal, direction
      real(wp) :: number
      integer :: i, k, n, size_of_poll

      n = size(state%best)
      do i = 1, n
         call next_normal(state%random, normal(i))
      end do
      normal = normal/norm2(normal)
      size_of_poll = min(4*n, state%max_evaluations - state%evaluations)
      allocate (points(n, max(size_of_poll, 0)))
      do i = 1, min(2*n, size(points, 2))
         ! column of the Householder reflection 1 - 2 u u^T with the unit vector u = `normal`
         direction = -2.0_wp*normal((i + 1)/2)*normal
         direction((i + 1)/2) = direction((i + 1)/2) + 1.0_wp
         if (modulo(i, 2) == 0) direction = -direction
         points(:, i) = min(max(state%best + state%step*direction, 0.0_wp), 1.0_wp)
      end do
      do i = 2*n + 1, size(points, 2)
         do k = 1, n
            call next_random(state%random, number)
            points(k, i) = min(max(state%best(k) + box*state%step*(2.0_wp*number - 1.0_wp), 0.0_wp), 1.0_wp)
         end do
      end do
   end subroutine next_poll

   !> Update the search with the values of a poll.
   pure subroutine update_search(state, points, values)
      type(search_state_t), intent(inout) :: state
      !> Points of the poll
      real(wp), intent(in) :: points(:, :)
      !> Values at the points; huge: no value
      real(wp), intent(in) :: values(:)

      integer :: best_of_poll

      state%evaluations = state%evaluations + size(values)
      best_of_poll = 0
      if (size(values) > 0) best_of_poll = minloc(values, dim=1)
      if (best_of_poll > 0) then
         if (.not. values(best_of_poll) < state%value) best_of_poll = 0
      end if
      if (best_of_poll > 0) then
         state%value = values(best_of_poll)
         state%best = points(:, best_of_poll)
         state%step = min(2.0_wp*state%step, 0.5_wp)
         state%failed_polls = 0
      else
         state%failed_polls = state%failed_polls + 1
         if (state%failed_polls >= patience) then
            state%step = 0.5_wp*state%step
            state%failed_polls = 0
         end if
      end if
      state%is_over = state%step < state%precision .or. state%evaluations >= state%max_evaluations
   end subroutine update_search

end module sweep_search
