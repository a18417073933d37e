!> The best cases of a sweep, and their refinement: a search for better cases between the values of the sweep.
!>
!> The search minimises a discontinuous function between bounds without derivatives: mesh adaptive direct search. Each
!> poll has points in random orthogonal directions around the best point; the step is lengthened after a success and
!> shortened after failures (Audet and Dennis, SIAM J. Optim. 17 (2006) 188; directions by a reflection as in Abramson,
!> Audet, Dennis and Le Digabel, ibid. 20 (2009) 948). Each poll also has as many random points in a wider box around
!> the best point, to find better points beyond a discontinuity. All points of a poll are known before the first is
!> computed, so they can be computed in parallel.
module sweep_best
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use kinds, only: wp
   use measure_list, only: measure_count, measure_status
   use random_numbers, only: next_normal, next_random, random_t, start_random
   use scene_types, only: scene_t
   use sweep_plan, only: fraction_at_value, plan_t, value_at_fraction
   use sweep_run, only: run_cases
   use sweep_settings, only: goal_maximum
   implicit none (type, external)
   private
   public :: best_t, start_best, insert_case, refined_t, refine, search_state_t, start_search, next_poll, update_search

   !> The best of the cases that have been considered, the best first.
   type :: best_t
      !> Index, in the table of measures, of the measure by which cases are compared
      integer :: column = 0
      !> Factor 1 or -1 of the values of that measure, with which the best value becomes the minimum
      real(wp) :: sign = 1.0_wp
      !> Number of cases in the list
      integer :: count = 0
      !> Number of cases that ran without a value of the measure, such as the first rebound of a case without one
      integer :: without_value = 0
      !> Numbers of the cases, [maximum count]
      integer, allocatable :: case(:)
      !> Parameters of the cases, [axes, maximum count]
      real(wp), allocatable :: values(:, :)
      !> Measures of the cases, [measure_count, maximum count]
      real(wp), allocatable :: rows(:, :)
   end type best_t

   !> The best case of the sweep (entry 1), then the improvements in the order in which the refinement found them.
   type :: refined_t
      !> Number of entries
      integer :: count = 0
      !> Number of cases that the refinement had computed before each entry, [count]
      integer, allocatable :: evaluations(:)
      !> Parameters of each entry, [axes, count]
      real(wp), allocatable :: values(:, :)
      !> Measures of each entry, [measure_count, count]
      real(wp), allocatable :: rows(:, :)
      !> Number of all cases that the refinement computed
      integer :: all_evaluations = 0
   end type refined_t

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

   !> Initialise the list of the best cases.
   subroutine start_best(scene, plan, best)
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      type(best_t), intent(out) :: best

      best%column = scene%best%measure
      best%sign = merge(-1.0_wp, 1.0_wp, scene%best%goal == goal_maximum)
      associate (limit => min(scene%best%count, plan%cases))
         allocate (best%case(limit), best%values(size(plan%axes), limit), best%rows(measure_count, limit))
      end associate
   end subroutine start_best

   !> Cost of a case, smaller for better cases; huge if the case failed or has no value.
   pure real(wp) function cost_of(best, row) result(cost)
      !> Column and sign of the measure
      type(best_t), intent(in) :: best
      !> Measures of the case
      real(wp), intent(in) :: row(:)

      cost = huge(1.0_wp)
      if (row(measure_status) > 0.0_wp) return
      if (ieee_is_nan(row(best%column))) return
      cost = best%sign*row(best%column)
   end function cost_of

   !> Insert a case into the list if it is among the best. Of equal cases that with the smaller number comes first.
   pure subroutine insert_case(best, case, values, row)
      type(best_t), intent(inout) :: best
      !> Number of the case
      integer, intent(in) :: case
      !> Parameters of the case, [axes]
      real(wp), intent(in) :: values(:)
      !> Measures of the case, [measure_count]
      real(wp), intent(in) :: row(:)

      real(wp) :: cost
      integer :: place

      cost = cost_of(best, row)
      if (.not. row(measure_status) > 0.0_wp .and. ieee_is_nan(row(best%column))) best%without_value = &
         best%without_value + 1
      if (cost >= huge(1.0_wp)) return
      if (best%count == size(best%case)) then
         if (cost >= cost_of(best, best%rows(:, best%count))) return
      else
         best%count = best%count + 1
      end if
      place = best%count
      do while (place > 1)
         if (cost_of(best, best%rows(:, place - 1)) <= cost) exit
         best%case(place) = best%case(place - 1)
         best%values(:, place) = best%values(:, place - 1)
         best%rows(:, place) = best%rows(:, place - 1)
         place = place - 1
      end do
      best%case(place) = case
      best%values(:, place) = values
      best%rows(:, place) = row
   end subroutine insert_case

   !> Search for better cases between the minimum and the maximum of each parameter, starting from the best case.
   !>
   !> Whole-number parameters are not varied, because more elements increase the run time but do not change the beam.
   subroutine refine(scene, plan, best, threads, refined)
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      !> Best cases of the sweep
      type(best_t), intent(in) :: best
      integer, intent(in) :: threads
      !> Improvements
      type(refined_t), intent(out) :: refined

      type(search_state_t) :: state
      real(wp), allocatable :: points(:, :), values(:, :), rows(:, :), costs(:), start(:)
      logical :: is_varied(size(plan%axes))
      integer, allocatable :: varied(:)
      integer :: i, k, limit, winner

      if (best%count == 0) return
      is_varied = .not. plan%axes%parameter%is_whole .and. plan%axes%maximum > plan%axes%minimum
      varied = pack([(k, k=1, size(is_varied))], is_varied)
      allocate (start(size(varied)))
      do i = 1, size(varied)
         associate (axis => plan%axes(varied(i)))
            start(i) = min(max(fraction_at_value(axis%minimum, axis%maximum, axis%is_logarithmic, &
               best%values(varied(i), 1)), 0.0_wp), 1.0_wp)
         end associate
      end do
      limit = scene%best%evaluations + 1
      allocate (refined%evaluations(limit), refined%values(size(plan%axes), limit), refined%rows(measure_count, limit))
      call add(0, best%values(:, 1), best%rows(:, 1))
      ! the first step is an eighth of the range of each parameter
      call start_search(start, cost_of(best, best%rows(:, 1)), 0.125_wp, scene%best%precision, scene%best%evaluations, &
         scene%sweep%seed, state)
      do while (.not. state%is_over)
         call next_poll(state, points)
         allocate (values(size(plan%axes), size(points, 2)), rows(measure_count, size(points, 2)), &
            costs(size(points, 2)))
         do i = 1, size(points, 2)
            values(:, i) = best%values(:, 1)
            do k = 1, size(varied)
               associate (axis => plan%axes(varied(k)))
                  values(varied(k), i) = value_at_fraction(axis%minimum, axis%maximum, axis%is_logarithmic, &
                     points(k, i))
               end associate
            end do
         end do
         call run_cases(scene, plan, values, threads, rows)
         do i = 1, size(costs)
            costs(i) = cost_of(best, rows(:, i))
         end do
         winner = minloc(costs, dim=1)
         if (costs(winner) < state%value) call add(state%evaluations + size(costs), values(:, winner), rows(:, winner))
         call update_search(state, points, costs)
         deallocate (values, rows, costs)
      end do
      refined%all_evaluations = state%evaluations

   contains

      !> Add an improvement to the list.
      subroutine add(evaluations, parameters, row)
         !> Number of cases computed before
         integer, intent(in) :: evaluations
         !> Parameters of the case, [axes]
         real(wp), intent(in) :: parameters(:)
         !> Measures of the case, [measure_count]
         real(wp), intent(in) :: row(:)

         refined%count = refined%count + 1
         refined%evaluations(refined%count) = evaluations
         refined%values(:, refined%count) = parameters
         refined%rows(:, refined%count) = row
      end subroutine add

   end subroutine refine

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

end module sweep_best
