!> The best cases of a sweep, and better ones between its values.
module sweep_best
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use kinds, only: wp
   use measure_list, only: measure_count, measure_status
   use scene_types, only: scene_t
   use sweep_plan, only: axis_t, plan_t
   use sweep_run, only: run_cases
   use sweep_search, only: learn, next_poll, search_state_t, start_search
   use sweep_settings, only: goal_most
   implicit none (type, external)
   private
   public :: best_t, start_best, consider, refined_t, refine

   !> The best cases so far, the best first.
   type :: best_t
      !> Column they are compared by, and the sign that makes the best the least
      integer :: column = 0
      real(wp) :: sign = 1.0_wp
      integer :: count = 0
      !> Numbers of the cases, their parameters [axes, room] and measures [measure_count, room]
      integer, allocatable :: case(:)
      real(wp), allocatable :: values(:, :)
      real(wp), allocatable :: rows(:, :)
   end type best_t

   !> Better ones found by the refinement, in the order in which they were found; the first is the sweep's best case.
   type :: refined_t
      integer :: count = 0
      !> Cases computed by then
      integer, allocatable :: evaluations(:)
      real(wp), allocatable :: values(:, :)
      real(wp), allocatable :: rows(:, :)
      !> Cases computed in all
      integer :: all_evaluations = 0
   end type refined_t

contains

   !> Begin a list.
   subroutine start_best(scene, plan, best)
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      type(best_t), intent(out) :: best

      best%column = scene%best%measure
      best%sign = merge(-1.0_wp, 1.0_wp, scene%best%goal == goal_most)
      associate (room => min(scene%best%count, plan%cases))
         allocate (best%case(room), best%values(size(plan%axes), room), best%rows(measure_count, room))
      end associate
   end subroutine start_best

   !> What a row is worth: the less, the better.
   pure function cost_of(best, row) result(cost)
      !> What counts
      type(best_t), intent(in) :: best
      !> The row
      real(wp), intent(in) :: row(:)
      real(wp) :: cost

      cost = huge(1.0_wp)
      if (row(measure_status) > 0.0_wp) return
      if (ieee_is_nan(row(best%column))) return
      cost = best%sign*row(best%column)
   end function cost_of

   !> Enter a row, if it is good enough. Of equals the one with the lower number comes first.
   pure subroutine consider(best, case, values, row)
      type(best_t), intent(inout) :: best
      !> Number of the case, its parameters and measures
      integer, intent(in) :: case
      real(wp), intent(in) :: values(:)
      real(wp), intent(in) :: row(:)

      real(wp) :: cost
      integer :: place

      cost = cost_of(best, row)
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
   end subroutine consider

   !> Search between the least and the greatest swept value of each parameter, from the best case.
   !>
   !> Numbers of elements stay as they are: more of them cost, and are no other beam.
   subroutine refine(scene, plan, best, threads, refined)
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      !> Its best cases
      type(best_t), intent(in) :: best
      integer, intent(in) :: threads
      !> What was found
      type(refined_t), intent(out) :: refined

      type(search_state_t) :: state
      real(wp), allocatable :: points(:, :), values(:, :), rows(:, :), costs(:), start(:)
      logical :: free(size(plan%axes))
      integer, allocatable :: moved(:)
      integer :: i, k, room, winner

      if (best%count == 0) return
      free = .not. plan%axes%parameter%is_whole .and. plan%axes%most > plan%axes%least
      moved = pack([(k, k=1, size(free))], free)
      allocate (start(size(moved)))
      do i = 1, size(moved)
         start(i) = share_of(plan%axes(moved(i)), best%values(moved(i), 1))
      end do
      room = scene%best%evaluations + 1
      allocate (refined%evaluations(room), refined%values(size(plan%axes), room), refined%rows(measure_count, room))
      call keep(0, best%values(:, 1), best%rows(:, 1))
      call start_search(start, cost_of(best, best%rows(:, 1)), 0.125_wp, scene%best%precision, scene%best%evaluations, &
         scene%sweep%seed, state)
      do while (.not. state%is_over)
         call next_poll(state, points)
         allocate (values(size(plan%axes), size(points, 2)), rows(measure_count, size(points, 2)), &
            costs(size(points, 2)))
         do i = 1, size(points, 2)
            values(:, i) = best%values(:, 1)
            do k = 1, size(moved)
               values(moved(k), i) = value_at(plan%axes(moved(k)), points(k, i))
            end do
         end do
         call run_cases(scene, plan, values, threads, rows)
         do i = 1, size(costs)
            costs(i) = cost_of(best, rows(:, i))
         end do
         winner = minloc(costs, dim=1)
         if (costs(winner) < state%value) call keep(state%evaluations + size(costs), values(:, winner), rows(:, winner))
         call learn(state, points, costs)
         deallocate (values, rows, costs)
      end do
      refined%all_evaluations = state%evaluations

   contains

      !> Note a better one.
      subroutine keep(evaluations, parameters, row)
         !> Cases computed by then
         integer, intent(in) :: evaluations
         !> Its parameters and measures
         real(wp), intent(in) :: parameters(:)
         real(wp), intent(in) :: row(:)

         refined%count = refined%count + 1
         refined%evaluations(refined%count) = evaluations
         refined%values(:, refined%count) = parameters
         refined%rows(:, refined%count) = row
      end subroutine keep

   end subroutine refine

   !> Where a value lies between the bounds of its axis, 0 to 1.
   pure function share_of(axis, value) result(share)
      type(axis_t), intent(in) :: axis
      real(wp), intent(in) :: value
      real(wp) :: share

      if (axis%is_logarithmic) then
         share = log(value/axis%least)/log(axis%most/axis%least)
      else
         share = (value - axis%least)/(axis%most - axis%least)
      end if
      share = min(max(share, 0.0_wp), 1.0_wp)
   end function share_of

   !> The value there.
   pure function value_at(axis, share) result(value)
      type(axis_t), intent(in) :: axis
      real(wp), intent(in) :: share
      real(wp) :: value

      if (axis%is_logarithmic) then
         value = axis%least*(axis%most/axis%least)**share
      else
         value = axis%least + share*(axis%most - axis%least)
      end if
      value = min(max(value, axis%least), axis%most)
   end function value_at

end module sweep_best
