!> Branches of periodic orbits over a parameter (amplitude or frequency of a load), by pseudo-arclength continuation,
!> and the bifurcations and grazing points on them (docs/theory.md, section 22). The continuation runs in the space of
!> the unknowns of `section_map` and the parameter, in units of the map (`section_map_t%unit`; the parameter has the
!> last unit, the length of its range). A step is an orbit predicted along the tangent and corrected by Newton's method.
module orbit_branches
   use bracketed_zero, only: bracket_t, chord, enter_value, choose_point
   use branch_closures, only: halves_swap, rejoins_at, check_closure, has_half_period, has_pair_on_circle
   use failures, only: failure_t
   use kinds, only: wp
   use orbit_newton, only: solve_orbit, doubling_direction, distance_of, find_branch_tangent, predictor, &
      initial_state_t, solution_t
   use orbit_settings, only: orbit_settings_t
   use orbit_types, only: mark_doubling, mark_fold, mark_grazing, mark_limit, mark_lost, mark_none, mark_torus, &
      orbit_branch_t, orbit_point_t
   use section_map, only: section_map_t, shift_section
   implicit none (type, external)
   private
   public :: trace_branches

   !> Maximum number of Newton steps for a point of a branch.
   integer, parameter :: max_corrections = 8

   !> A branch during its continuation.
   type :: trace_t
      !> Last orbit
      type(solution_t) :: last
      !> Tangent of the branch at the last orbit, in units of the map
      real(wp), allocatable :: direction(:)
      !> Length of the next step, in units of the map
      real(wp) :: step = 0.0_wp
      !> Minimum and maximum of the parameter
      real(wp) :: limit(2) = 0.0_wp
      !> Points after the start, in the order of the continuation
      type(orbit_point_t), allocatable :: point(:)
      !> Initial states of the orbits at period doublings
      type(initial_state_t), allocatable :: doubling(:)
      !> Indices of the period doublings in `point`
      integer, allocatable :: doubling_index(:)
      !> Period doublings of the branch that this branch left
      type(orbit_point_t), allocatable :: parent_doublings(:)
      !> Whether the branch has ended
      logical :: is_over = .false.
      !> First and second point of the branch
      type(orbit_point_t) :: start, second
      !> Whether the branch has moved away from its start
      logical :: has_left = .false.
      !> Whether the branch has returned to its start
      logical :: is_closed = .false.
   end type trace_t

contains

   !> Trace the branch through an orbit in both directions, and the branches that leave it at period doublings.
   subroutine trace_branches(map, options, orbit, branch)
      type(section_map_t), target, intent(inout) :: map
      !> Settings of &orbit
      type(orbit_settings_t), intent(in) :: options
      type(solution_t), intent(in) :: orbit
      type(orbit_branch_t), allocatable, intent(out) :: branch(:)

      type(trace_t) :: down, up
      type(initial_state_t), allocatable :: doubling(:)
      type(orbit_branch_t) :: first
      integer :: i, n

      call trace_from(map, options, orbit, -1.0_wp, down)
      if (down%is_closed) then
         ! a closed branch is complete: the other direction has no points
         call open_trace(map, options, orbit, up)
      else
         call trace_from(map, options, orbit, 1.0_wp, up)
      end if
      n = size(down%point)
      allocate (first%point, source=[down%point(n:1:-1), orbit%point, up%point])
      associate (point => first%point)
         if (n == 0) point(1)%mark = mark_lost
         if (.not. down%is_closed .and. size(up%point) == 0) point(size(point))%mark = mark_lost
      end associate
      allocate (branch(1), source=[first])
      doubling = [down%doubling, up%doubling]
      associate (doubling_index => [n + 1 - down%doubling_index, n + 1 + up%doubling_index])
         do i = 1, size(doubling)
            if (options%doublings > 0 .and. .not. is_traced(map, branch, 1, doubling(i)%value)) call switch_branch( &
               map, options, 1, doubling_index(i), doubling(i), 2*orbit%point%periods, options%doublings, branch)
         end do
      end associate
   end subroutine trace_branches

   !> Switch to the branch of twice the period at a period doubling, trace this branch, and switch from it to further
   !> branches in turn. Nothing is added if no orbit of twice the period is found.
   recursive subroutine switch_branch(map, options, parent, parent_point, doubling, periods, levels, branch)
      type(section_map_t), target, intent(inout) :: map
      type(orbit_settings_t), intent(in) :: options
      !> Index of the parent branch in `branch`
      integer, intent(in) :: parent
      !> Index of the point of the parent branch at which the new branch leaves
      integer, intent(in) :: parent_point
      type(initial_state_t), intent(in) :: doubling
      !> Period of the new branch in periods of the load
      integer, intent(in) :: periods
      !> Maximum number of successive period doublings that are followed, this doubling included
      integer, intent(in) :: levels
      type(orbit_branch_t), allocatable, intent(inout) :: branch(:)

      ! orbit at the period doubling, on the parent branch
      type(solution_t) :: at_doubling
      ! first orbit of the new branch
      type(solution_t) :: branched
      type(trace_t) :: trace
      type(orbit_branch_t) :: new_branch
      real(wp), allocatable :: direction(:)
      real(wp) :: length
      integer :: i, number
      logical :: is_new

      map%periods = periods/2
      call solve_orbit(map, doubling, options%tolerance, max_corrections, at_doubling)
      if (.not. at_doubling%converged) return
      call doubling_direction(map, at_doubling%map, direction)
      if (.not. allocated(direction)) return
      map%periods = periods
      length = options%step
      ! shorten the step until Newton's method converges to an orbit of doubled period
      do i = 1, 4
         call solve_orbit(map, predictor(map, doubling, direction, length), options%tolerance, 2*max_corrections, &
            branched, direction)
         is_new = branched%converged
         if (is_new) is_new = .not. has_half_period(branched%point, units_of(map))
         if (is_new) exit
         length = 0.3_wp*length
      end do
      if (.not. is_new) return
      call open_trace(map, options, branched, trace)
      associate (point => branch(parent)%point)
         trace%parent_doublings = pack(point, point%mark == mark_doubling)
      end associate
      call find_branch_tangent(map, branched%map, direction, trace%direction)
      if (.not. allocated(trace%direction)) return
      call continue_trace(map, options, trace)
      new_branch%parent = parent
      new_branch%parent_point = parent_point
      allocate (new_branch%point, source=[at_doubling%point, branched%point, trace%point])
      branch = [branch, new_branch]
      number = size(branch)
      if (levels < 2) return
      do i = 1, size(trace%doubling)
         if (.not. is_traced(map, branch, number, trace%doubling(i)%value)) call switch_branch(map, options, number, &
            2 + trace%doubling_index(i), trace%doubling(i), 2*periods, levels - 1, branch)
      end do
   end subroutine switch_branch

   !> Whether a known branch that left the same parent branch at another period doubling already ends at this doubling.
   pure logical function is_traced(map, branch, parent, value) result(answer)
      type(section_map_t), intent(in) :: map
      type(orbit_branch_t), intent(in) :: branch(:)
      !> Index of the parent branch in `branch`
      integer, intent(in) :: parent
      !> Value of the parameter at the doubling
      real(wp), intent(in) :: value

      ! values of the parameter closer than this fraction of its range are the same
      real(wp), parameter :: near = 1.0e-6_wp
      integer :: i

      answer = .false.
      do i = 2, size(branch)
         associate (last => branch(i)%point(size(branch(i)%point)))
            answer = answer .or. branch(i)%parent == parent .and. last%mark == mark_doubling .and. &
               abs(last%value - value) <= near*map%unit(size(map%unit))
         end associate
      end do
   end function is_traced

   !> Trace a branch from an orbit in the direction of decreasing or increasing parameter.
   subroutine trace_from(map, options, orbit, side, trace)
      type(section_map_t), target, intent(inout) :: map
      type(orbit_settings_t), intent(in) :: options
      type(solution_t), intent(in) :: orbit
      !> -1: decreasing, 1: increasing
      real(wp), intent(in) :: side
      type(trace_t), intent(out) :: trace

      call open_trace(map, options, orbit, trace)
      call find_branch_tangent(map, orbit%map, [spread(0.0_wp, 1, size(map%unit) - 1), side], trace%direction)
      if (allocated(trace%direction)) call continue_trace(map, options, trace)
   end subroutine trace_from

   !> Prepare a trace that starts at an orbit; the caller sets its direction.
   subroutine open_trace(map, options, start, trace)
      type(section_map_t), intent(in) :: map
      type(orbit_settings_t), intent(in) :: options
      type(solution_t), intent(in) :: start
      type(trace_t), intent(inout) :: trace

      trace%last = start
      trace%start = start%point
      trace%step = options%step
      ! the limits are ratios to the scene's value of the parameter, which may be negative, and the unit is the range
      ! between them
      trace%limit = sign(map%unit(size(map%unit)), start%initial%value)*[options%min_ratio, options%max_ratio] &
         /(options%max_ratio - options%min_ratio)
      if (trace%limit(1) > trace%limit(2)) trace%limit = trace%limit(2:1:-1)
      allocate (trace%point(0), trace%doubling(0), trace%doubling_index(0), trace%parent_doublings(0))
   end subroutine open_trace

   !> Continue a branch until it ends or leaves the range of the parameter.
   subroutine continue_trace(map, options, trace)
      type(section_map_t), target, intent(inout) :: map
      type(orbit_settings_t), intent(in) :: options
      type(trace_t), intent(inout) :: trace

      ! a branch ends if a step shorter than this fraction of the first step fails
      real(wp), parameter :: min_ratio = 1.0e-4_wp
      type(solution_t) :: next
      real(wp), allocatable :: direction(:)
      logical :: is_acceptable

      do while (.not. trace%is_over .and. size(trace%point) < options%max_points)
         call solve_orbit(map, predictor(map, trace%last%initial, trace%direction, trace%step), options%tolerance, &
            max_corrections, next, trace%direction)
         is_acceptable = .false.
         if (next%converged) then
            call find_branch_tangent(map, next%map, trace%direction, direction)
            ! the tangent turns by less than 45 degrees, and the orbit is not much farther away than the step
            if (allocated(direction)) is_acceptable = sum(direction*trace%direction) > 0.7_wp .and. &
               distance_of(map, next%initial, trace%last%initial) < 2.0_wp*trace%step
            ! reject an orbit on the branch of half the period, which a branch of doubled period may jump back to
            if (size(trace%parent_doublings) > 0) is_acceptable = is_acceptable .and. &
               .not. has_half_period(next%point, units_of(map))
         end if
         if (is_acceptable .and. next%point%impacts == trace%last%point%impacts) then
            call add_step(map, options, next, direction, trace)
         else if (trace%step > min_ratio*options%step) then
            trace%step = 0.25_wp*trace%step
         else
            call locate_end(map, options, trace, next, is_acceptable)
            if (is_acceptable) call add_step(map, options, next, direction, trace)
         end if
      end do
      if (.not. trace%is_over .or. trace%is_closed .or. size(trace%point) == 0) return
      ! a branch without a mark at its end: Newton's method failed at the limit of the range or at the shifted section
      if (trace%point(size(trace%point))%mark == mark_none) trace%point(size(trace%point))%mark = mark_lost
   end subroutine continue_trace

   !> Add a point, and the bifurcations between this point and the point before. If the point lies outside the range of
   !> the parameter, the branch ends at the limit of the range. If events of the new orbit lie near its section, the
   !> section is shifted.
   subroutine add_step(map, options, next, direction, trace)
      type(section_map_t), target, intent(inout) :: map
      type(orbit_settings_t), intent(in) :: options
      type(solution_t), intent(in) :: next
      !> Tangent of the branch at the new point, [unknowns + 1]
      real(wp), intent(in) :: direction(:)
      type(trace_t), intent(inout) :: trace

      type(initial_state_t) :: guess
      type(solution_t) :: end
      type(failure_t), allocatable :: error
      logical :: is_shifted
      ! index of the parameter, the last component of the tangent
      integer :: n

      n = size(direction)
      call check_end(map, next%point, trace)
      if (trace%is_over) return
      if (next%point%impacts == trace%last%point%impacts) call locate_bifurcations(map, options, next, direction, trace)
      if (trace%is_over) return
      if (next%initial%value < trace%limit(1) .or. next%initial%value > trace%limit(2)) then
         guess = next%initial
         guess%value = min(max(guess%value, trace%limit(1)), trace%limit(2))
         call solve_orbit(map, guess, options%tolerance, 2*max_corrections, end)
         end%point%mark = mark_limit
         if (end%converged) trace%point = [trace%point, end%point]
         trace%is_over = .true.
         return
      end if
      trace%point = [trace%point, next%point]
      trace%last = next
      trace%direction = direction
      ! few Newton steps: the next step along the branch may be longer
      if (next%point%iterations <= 3) trace%step = min(1.5_wp*trace%step, options%max_step)
      ! after a shift of the section the tangent is found anew, with the sign of the parameter's change; near a fold
      ! this sign is uncertain, so the section is not shifted near a fold
      if (abs(direction(n)) < 1.0e-3_wp) return
      call shift_section(map, trace%last%initial%value, trace%last%initial%state, next%map%response, is_shifted, error)
      if (.not. is_shifted .or. allocated(error)) return
      trace%last%initial%section_phase = map%section_phase
      call solve_orbit(map, trace%last%initial, options%tolerance, max_corrections, end)
      trace%is_over = .not. end%converged
      if (trace%is_over) return
      trace%last = end
      call find_branch_tangent(map, end%map, [spread(0.0_wp, 1, n - 1), sign(1.0_wp, direction(n))], trace%direction)
      trace%is_over = .not. allocated(trace%direction)
   end subroutine add_step

   !> End a branch that rejoins the branch that it left, or closes in itself.
   pure subroutine check_end(map, next, trace)
      type(section_map_t), intent(in) :: map
      type(orbit_point_t), intent(in) :: next
      type(trace_t), intent(inout) :: trace

      ! values of the parameter closer than this fraction of its range are the same
      real(wp), parameter :: near = 1.0e-6_wp
      logical :: is_away
      integer :: i

      do i = 1, size(trace%parent_doublings)
         trace%is_over = rejoins_at(trace%parent_doublings(i), trace%last%point, next, &
            2.0_wp*trace%step*map%unit(size(map%unit)))
         if (.not. trace%is_over) cycle
         ! the previous step may have marked the same point as a fold
         where (trace%point%mark == mark_fold .and. abs(trace%point%value - trace%parent_doublings(i)%value) <= near &
            *map%unit(size(map%unit))) trace%point%mark = mark_none
         trace%point = [trace%point, trace%parent_doublings(i)]
         return
      end do
      if (.not. allocated(trace%second%tip)) trace%second = next
      call check_closure(trace%start, trace%second, trace%last%point, next, units_of(map), is_away, trace%is_closed)
      trace%is_closed = trace%is_closed .and. trace%has_left
      trace%has_left = trace%has_left .or. is_away
      trace%is_over = trace%is_closed
      if (trace%is_over) trace%point = [trace%point, trace%start]
   end subroutine check_end

   !> Units of the parameter and of velocities.
   pure function units_of(map) result(units)
      type(section_map_t), intent(in) :: map
      real(wp) :: units(2)

      ! `map%value` has a row for each mode; the unit of the first velocity follows the units of the modal displacements
      units = map%unit([size(map%unit), size(map%value, 1) + 1])
   end function units_of

   !> Locate folds, period doublings and Neimark-Sacker bifurcations between the last point and the next.
   subroutine locate_bifurcations(map, options, next, direction, trace)
      type(section_map_t), target, intent(inout) :: map
      type(orbit_settings_t), intent(in) :: options
      type(solution_t), intent(in) :: next
      !> Tangent of the branch at the next point, [unknowns + 1]
      real(wp), intent(in) :: direction(:)
      type(trace_t), intent(inout) :: trace

      type(solution_t) :: bifurcation
      ! value of the test function at the last point (`before`) and at the next (`after`)
      real(wp) :: before, after
      ! fold, period doubling, Neimark-Sacker bifurcation
      integer :: kind

      do kind = mark_fold, mark_torus
         before = test_function(kind, trace%last%point, trace%direction)
         after = test_function(kind, next%point, direction)
         if ((before > 0.0_wp) .eqv. (after > 0.0_wp)) cycle
         call locate_zero(map, options, trace, kind, [before, after], bifurcation)
         if (.not. bifurcation%converged) cycle
         if (kind == mark_torus .and. .not. has_pair_on_circle(bifurcation%point)) cycle
         bifurcation%point%mark = kind
         ! if the two halves of the period exchange their values at the fold, it is a period doubling of another,
         ! unknown branch
         if (kind == mark_fold .and. size(trace%parent_doublings) > 0) trace%is_over = &
            halves_swap(trace%last%point, next%point)
         if (trace%is_over) bifurcation%point%mark = mark_doubling
         trace%point = [trace%point, bifurcation%point]
         if (trace%is_over) return
         if (kind /= mark_doubling) cycle
         trace%doubling = [trace%doubling, bifurcation%initial]
         trace%doubling_index = [trace%doubling_index, size(trace%point)]
      end do
   end subroutine locate_bifurcations

   !> Test function of a bifurcation, which changes its sign at the bifurcation. Fold: the parameter component of the
   !> tangent. Period doubling: the product of (multiplier + 1) over all multipliers. Neimark-Sacker bifurcation: the
   !> product over all pairs of (product of both multipliers - 1). Both products are real, because complex multipliers
   !> come in conjugate pairs.
   pure real(wp) function test_function(kind, point, direction) result(value)
      !> One of `mark_fold`, `mark_doubling` and `mark_torus`
      integer, intent(in) :: kind
      type(orbit_point_t), intent(in) :: point
      !> Tangent of the branch at the point, the parameter last
      real(wp), intent(in) :: direction(:)

      complex(wp), parameter :: one = (1.0_wp, 0.0_wp)
      complex(wp) :: product_of_all
      integer :: i

      associate (multiplier => point%multiplier)
         product_of_all = one
         select case (kind)
         case (mark_fold)
            product_of_all = cmplx(direction(size(direction)), 0.0_wp, wp)
         case (mark_doubling)
            do i = 1, size(multiplier)
               product_of_all = product_of_all*(multiplier(i) + one)
            end do
         case default
            ! the product over all pairs is smooth, also if two multipliers meet on the real axis
            do i = 2, size(multiplier)
               product_of_all = product_of_all*product(multiplier(i)*multiplier(:i - 1) - one)
            end do
         end select
      end associate
      value = real(product_of_all, wp)
   end function test_function

   !> Locate the zero of a test function between the last point and the next, by a bracketed search for the step length
   !> of the predictor.
   subroutine locate_zero(map, options, trace, kind, values, bifurcation)
      type(section_map_t), target, intent(inout) :: map
      type(orbit_settings_t), intent(in) :: options
      type(trace_t), intent(in) :: trace
      !> One of `mark_fold`, `mark_doubling` and `mark_torus`
      integer, intent(in) :: kind
      !> Test function at the last point and at the next
      real(wp), intent(in) :: values(2)
      type(solution_t), intent(out) :: bifurcation

      type(bracket_t) :: bracket
      real(wp), allocatable :: direction(:)

      bracket = bracket_t(high=trace%step, grows=values(2) > 0.0_wp, value_low=values(1), value_high=values(2), &
         step_tolerance=1.0e-12_wp, max_evaluations=60)
      bracket%point = chord(bracket)
      do
         call solve_orbit(map, predictor(map, trace%last%initial, trace%direction, bracket%point), options%tolerance, &
            max_corrections, bifurcation, trace%direction)
         if (.not. bifurcation%converged) return
         call find_branch_tangent(map, bifurcation%map, trace%direction, direction)
         if (.not. allocated(direction)) return
         call enter_value(bracket, test_function(kind, bifurcation%point, direction))
         call choose_point(bracket, chord(bracket))
         if (bracket%is_found) return
      end do
   end subroutine locate_zero

   !> Locate the end of a branch after steps of minimum length have failed: at the end an impact appears or vanishes, or
   !> no orbit exists beyond it. The last orbit with the same impacts is found by bisection.
   subroutine locate_end(map, options, trace, next, continues)
      type(section_map_t), target, intent(inout) :: map
      type(orbit_settings_t), intent(in) :: options
      type(trace_t), intent(inout) :: trace
      !> Solution of the last step, which was not accepted, or whose number of impacts differs
      type(solution_t), intent(in) :: next
      !> Whether the branch continues with other impacts
      logical, intent(in) :: continues

      ! numbers of restarts (`rounds`) nearer to the end, where Newton's method converges from shorter steps, and of
      ! `halvings`
      integer, parameter :: rounds = 12, halvings = 8
      ! an impact slower than this fraction of the velocity unit is grazing
      real(wp), parameter :: grazing_ratio = 1.0e-2_wp
      ! last orbit found with the same impacts
      type(solution_t) :: best
      type(solution_t) :: trial
      real(wp), allocatable :: direction(:)
      ! bounds `low` and `high` of the step from the last orbit to the end of the branch, and the step that is tried
      real(wp) :: low, high, trial_step
      ! minimum speed of an impact in all trials
      real(wp) :: min_speed
      integer :: i, round

      best = trace%last
      direction = trace%direction
      min_speed = min(best%point%min_speed, next%min_speed)
      high = trace%step
      do round = 1, rounds
         trace%last = best
         low = 0.0_wp
         do i = 1, halvings
            trial_step = 0.5_wp*(low + high)
            call solve_orbit(map, predictor(map, trace%last%initial, direction, trial_step), options%tolerance, &
               max_corrections, trial, direction)
            min_speed = min(min_speed, trial%min_speed)
            if (trial%converged .and. trial%point%impacts == best%point%impacts) then
               best = trial
               low = trial_step
            else
               high = trial_step
            end if
         end do
         if (.not. low > 0.0_wp) exit
         ! the end is about high - low beyond the best orbit; the bound is twice this, because the tangent changes
         high = 2.0_wp*(high - low)
         call find_branch_tangent(map, best%map, trace%direction, direction)
         if (.not. allocated(direction)) exit
         trace%direction = direction
      end do
      best%point%mark = mark_lost
      if (continues .or. min_speed < grazing_ratio*map%unit(size(best%initial%state%q) + 1)) best%point%mark = &
         mark_grazing
      trace%point = [trace%point, best%point]
      trace%is_over = .not. continues
   end subroutine locate_end

end module orbit_branches
