!> The best cases of a sweep, and their refinement: a search for better cases between the values of the sweep.
module sweep_best
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use kinds, only: wp
   use measure_list, only: measure_count, measure_status
   use scene_types, only: scene_t
   use sweep_plan, only: fraction_at_value, plan_t, value_at_fraction
   use sweep_run, only: run_cases
   use sweep_search, only: update_search, next_poll, search_state_t, start_search
   use sweep_settings, only: goal_maximum
   implicit none (type, external)
   private
   public :: best_t, start_best, insert_case, refined_t, refine

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

end module sweep_best
