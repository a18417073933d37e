!> Branches of motions that return over a parameter, by steps of pseudo-arclength, and what happens on them (docs/
!> theory.md, section 22).
module orbit_branches
   use bracketed_zero, only: bracket_t, chord, enter, go_to
   use failures, only: failure_t
   use kinds, only: wp
   use orbit_newton, only: close_orbit, direction_of_multiplier, distance_of, find_direction, moved_along, place_t, &
      solution_t
   use orbit_returns, only: change_places, joins_at, look_back, returns_in_half
   use orbit_settings, only: orbit_settings_t
   use orbit_types, only: mark_doubling, mark_fold, mark_grazing, mark_limit, mark_lost, mark_none, mark_torus, &
      orbit_branch_t, orbit_point_t
   use section_map, only: section_map_t, turn_section
   implicit none (type, external)
   private
   public :: trace_branches

   !> Steps of Newton's method in which a point of a branch must be found.
   integer, parameter :: most_corrections = 8

   !> A branch while it is traced.
   type :: trace_t
      type(solution_t) :: last
      !> Its direction there, in units of the map
      real(wp), allocatable :: direction(:)
      real(wp) :: step = 0.0_wp
      !> Range of the parameter
      real(wp) :: limit(2) = 0.0_wp
      type(orbit_point_t), allocatable :: point(:)
      !> Where the period doubles, and which points that are
      type(place_t), allocatable :: doubling(:)
      integer, allocatable :: at(:)
      !> Where the branch that it left doubles its period
      type(orbit_point_t), allocatable :: origin(:)
      logical :: is_over = .false.
      !> Where it began, how it went on, and whether it was elsewhere since and came back
      type(orbit_point_t) :: start, second
      logical :: has_left = .false.
      logical :: is_closed = .false.
   end type trace_t

contains

   !> The branch through a motion, both ways, and those that leave it where the period doubles.
   subroutine trace_branches(map, asked, orbit, branch)
      type(section_map_t), target, intent(inout) :: map
      type(orbit_settings_t), intent(in) :: asked
      type(solution_t), intent(in) :: orbit
      type(orbit_branch_t), allocatable, intent(out) :: branch(:)

      type(trace_t) :: down, up
      type(place_t), allocatable :: doubling(:)
      type(orbit_branch_t) :: first
      integer :: i, n

      call trace_from(map, asked, orbit, -1.0_wp, down)
      if (down%is_closed) then
         call open_trace(map, asked, orbit, up)
      else
         call trace_from(map, asked, orbit, 1.0_wp, up)
      end if
      n = size(down%point)
      allocate (first%point, source=[down%point(n:1:-1), orbit%point, up%point])
      allocate (branch(1), source=[first])
      doubling = [down%doubling, up%doubling]
      associate (at => [n + 1 - down%at, n + 1 + up%at])
         do i = 1, size(doubling)
            if (asked%doublings > 0 .and. .not. is_traced(map, branch, 1, doubling(i)%value)) call leave_branch(map, &
               asked, 1, at(i), doubling(i), 2*orbit%point%periods, asked%doublings, branch)
         end do
      end associate
   end subroutine trace_branches

   !> A branch of twice the period, and those that leave it in turn.
   recursive subroutine leave_branch(map, asked, parent, parent_point, doubling, periods, levels, branch)
      type(section_map_t), target, intent(inout) :: map
      type(orbit_settings_t), intent(in) :: asked
      integer, intent(in) :: parent
      integer, intent(in) :: parent_point
      type(place_t), intent(in) :: doubling
      integer, intent(in) :: periods
      !> So many doublings are left
      integer, intent(in) :: levels
      type(orbit_branch_t), allocatable, intent(inout) :: branch(:)

      type(solution_t) :: here, there
      type(trace_t) :: trace
      type(orbit_branch_t) :: one
      real(wp), allocatable :: aside(:)
      real(wp) :: length
      integer :: i, number
      logical :: is_other

      map%periods = periods/2
      call close_orbit(map, doubling, asked%tolerance, most_corrections, here)
      if (.not. here%converged) return
      call direction_of_multiplier(map, here%map, aside)
      if (.not. allocated(aside)) return
      map%periods = periods
      length = asked%step
      do i = 1, 4
         call close_orbit(map, moved_along(map, doubling, aside, length), asked%tolerance, 2*most_corrections, &
            there, aside)
         is_other = there%converged
         if (is_other) is_other = .not. returns_in_half(there%point, units_of(map))
         if (is_other) exit
         length = 0.3_wp*length
      end do
      if (.not. is_other) return
      call open_trace(map, asked, there, trace)
      associate (point => branch(parent)%point)
         trace%origin = pack(point, point%mark == mark_doubling)
      end associate
      call find_direction(map, there%map, aside, trace%direction)
      if (.not. allocated(trace%direction)) return
      call trace_on(map, asked, trace)
      one%parent = parent
      one%parent_point = parent_point
      allocate (one%point, source=[here%point, there%point, trace%point])
      branch = [branch, one]
      number = size(branch)
      if (levels < 2) return
      do i = 1, size(trace%doubling)
         if (.not. is_traced(map, branch, number, trace%doubling(i)%value)) call leave_branch(map, asked, number, &
            2 + trace%at(i), trace%doubling(i), 2*periods, levels - 1, branch)
      end do
   end subroutine leave_branch

   !> Does a branch that left the same one elsewhere end where the period doubles?
   pure function is_traced(map, branch, parent, value) result(answer)
      type(section_map_t), intent(in) :: map
      type(orbit_branch_t), intent(in) :: branch(:)
      integer, intent(in) :: parent
      !> Of the parameter there
      real(wp), intent(in) :: value
      logical :: answer

      ! as a share of the range
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

   !> Down or up from a motion.
   subroutine trace_from(map, asked, orbit, side, trace)
      type(section_map_t), target, intent(inout) :: map
      type(orbit_settings_t), intent(in) :: asked
      type(solution_t), intent(in) :: orbit
      !> -1 or 1
      real(wp), intent(in) :: side
      type(trace_t), intent(out) :: trace

      real(wp), allocatable :: along(:)

      call open_trace(map, asked, orbit, trace)
      allocate (along(size(map%unit)), source=0.0_wp)
      along(size(along)) = side
      call find_direction(map, orbit%map, along, trace%direction)
      if (allocated(trace%direction)) call trace_on(map, asked, trace)
   end subroutine trace_from

   subroutine open_trace(map, asked, start, trace)
      type(section_map_t), intent(in) :: map
      type(orbit_settings_t), intent(in) :: asked
      type(solution_t), intent(in) :: start
      type(trace_t), intent(inout) :: trace

      trace%last = start
      trace%start = start%point
      trace%step = asked%step
      trace%limit = map%unit(size(map%unit))*[asked%lowest_ratio, asked%greatest_ratio] &
         /(asked%greatest_ratio - asked%lowest_ratio)
      allocate (trace%point(0), trace%doubling(0), trace%at(0), trace%origin(0))
   end subroutine open_trace

   !> Step on until the range ends, or the branch.
   subroutine trace_on(map, asked, trace)
      type(section_map_t), target, intent(inout) :: map
      type(orbit_settings_t), intent(in) :: asked
      type(trace_t), intent(inout) :: trace

      ! steps below this, as a share of the first, tell that the branch ends
      real(wp), parameter :: least = 1.0e-4_wp
      type(solution_t) :: next
      real(wp), allocatable :: direction(:)
      logical :: is_near

      do while (.not. trace%is_over .and. size(trace%point) < asked%most_points)
         call close_orbit(map, moved_along(map, trace%last%place, trace%direction, trace%step), asked%tolerance, &
            most_corrections, next, trace%direction)
         is_near = .false.
         if (next%converged) then
            call find_direction(map, next%map, trace%direction, direction)
            if (allocated(direction)) is_near = sum(direction*trace%direction) > 0.7_wp .and. &
               distance_of(map, next%place, trace%last%place) < 2.0_wp*trace%step
            ! back on the branch that it left
            if (size(trace%origin) > 0) is_near = is_near .and. .not. returns_in_half(next%point, units_of(map))
         end if
         if (is_near .and. next%point%impacts == trace%last%point%impacts) then
            call take_step(map, asked, next, direction, trace)
         else if (trace%step > least*asked%step) then
            trace%step = 0.25_wp*trace%step
         else
            call end_of_impacts(map, asked, trace, next, is_near)
            if (is_near) call take_step(map, asked, next, direction, trace)
         end if
      end do
   end subroutine trace_on

   !> A point, and what lies between it and the one before.
   subroutine take_step(map, asked, next, direction, trace)
      type(section_map_t), target, intent(inout) :: map
      type(orbit_settings_t), intent(in) :: asked
      type(solution_t), intent(in) :: next
      real(wp), intent(in) :: direction(:)
      type(trace_t), intent(inout) :: trace

      type(place_t) :: guess
      type(solution_t) :: end
      type(failure_t), allocatable :: error
      real(wp), allocatable :: along(:)
      real(wp) :: side
      logical :: is_turned
      integer :: n

      n = size(direction)
      call see_whether_over(map, next%point, trace)
      if (trace%is_over) return
      if (next%point%impacts == trace%last%point%impacts) call mark_between(map, asked, next, direction, trace)
      if (trace%is_over) return
      if (next%place%value < trace%limit(1) .or. next%place%value > trace%limit(2)) then
         guess = next%place
         guess%value = min(max(guess%value, trace%limit(1)), trace%limit(2))
         call close_orbit(map, guess, asked%tolerance, 2*most_corrections, end)
         end%point%mark = mark_limit
         if (end%converged) trace%point = [trace%point, end%point]
         trace%is_over = .true.
         return
      end if
      trace%point = [trace%point, next%point]
      trace%last = next
      trace%direction = direction
      if (next%point%iterations <= 3) trace%step = min(1.5_wp*trace%step, asked%greatest_step)
      ! near a fold the parameter tells no direction
      if (abs(direction(n)) < 1.0e-3_wp) return
      side = sign(1.0_wp, direction(n))
      call turn_section(map, trace%last%place%value, trace%last%place%state, next%map%response, is_turned, error)
      if (.not. is_turned .or. allocated(error)) return
      trace%last%place%turn = map%turn
      call close_orbit(map, trace%last%place, asked%tolerance, most_corrections, end)
      trace%is_over = .not. end%converged
      if (trace%is_over) return
      trace%last = end
      allocate (along(n), source=0.0_wp)
      along(n) = side
      call find_direction(map, end%map, along, trace%direction)
      trace%is_over = .not. allocated(trace%direction)
   end subroutine take_step

   !> A branch ends where it comes back to the one that it left, or to its own beginning.
   pure subroutine see_whether_over(map, next, trace)
      type(section_map_t), intent(in) :: map
      type(orbit_point_t), intent(in) :: next
      type(trace_t), intent(inout) :: trace

      ! as a share of the range
      real(wp), parameter :: near = 1.0e-6_wp
      logical :: is_away
      integer :: i

      do i = 1, size(trace%origin)
         trace%is_over = joins_at(trace%origin(i), trace%last%point, next, 2.0_wp*trace%step*map%unit(size(map%unit)))
         if (.not. trace%is_over) cycle
         ! that it turns back there, too, may have been seen a step before
         where (trace%point%mark == mark_fold .and. abs(trace%point%value - trace%origin(i)%value) <= near &
            *map%unit(size(map%unit))) trace%point%mark = mark_none
         trace%point = [trace%point, trace%origin(i)]
         return
      end do
      if (size(trace%point) == 0) trace%second = next
      call look_back(trace%start, trace%second, trace%last%point, next, units_of(map), is_away, trace%is_closed)
      trace%is_closed = trace%is_closed .and. trace%has_left
      trace%has_left = trace%has_left .or. is_away
      trace%is_over = trace%is_closed
      if (trace%is_over) trace%point = [trace%point, trace%start]
   end subroutine see_whether_over

   !> Of the parameter and of velocities.
   pure function units_of(map) result(units)
      type(section_map_t), intent(in) :: map
      real(wp) :: units(2)

      units = map%unit([size(map%unit), size(map%value, 1) + 1])
   end function units_of

   !> Folds, doublings and tori between the last point and the next.
   subroutine mark_between(map, asked, next, direction, trace)
      type(section_map_t), target, intent(inout) :: map
      type(orbit_settings_t), intent(in) :: asked
      type(solution_t), intent(in) :: next
      real(wp), intent(in) :: direction(:)
      type(trace_t), intent(inout) :: trace

      type(solution_t) :: there
      real(wp) :: before, after
      integer :: kind

      do kind = mark_fold, mark_torus
         before = test_of(kind, trace%last%point, trace%direction)
         after = test_of(kind, next%point, direction)
         if ((before > 0.0_wp) .eqv. (after > 0.0_wp)) cycle
         call find_between(map, asked, trace, kind, [before, after], there)
         if (.not. there%converged) cycle
         if (kind == mark_torus .and. .not. has_pair_on_circle(there%point)) cycle
         there%point%mark = kind
         ! another branch, that is not known, doubles its period where the sections of this one change places
         if (kind == mark_fold .and. size(trace%origin) > 0) trace%is_over = change_places(trace%last%point, next%point)
         if (trace%is_over) there%point%mark = mark_doubling
         trace%point = [trace%point, there%point]
         if (trace%is_over) return
         if (kind /= mark_doubling) cycle
         trace%doubling = [trace%doubling, there%place]
         trace%at = [trace%at, size(trace%point)]
      end do
   end subroutine mark_between

   !> Changes its sign where something happens.
   pure function test_of(kind, point, direction) result(value)
      integer, intent(in) :: kind
      type(orbit_point_t), intent(in) :: point
      real(wp), intent(in) :: direction(:)
      real(wp) :: value

      complex(wp), parameter :: one = (1.0_wp, 0.0_wp)
      complex(wp) :: all
      integer :: i

      associate (multiplier => point%multiplier)
         all = one
         select case (kind)
         case (mark_fold)
            all = cmplx(direction(size(direction)), 0.0_wp, wp)
         case (mark_doubling)
            do i = 1, size(multiplier)
               all = all*(multiplier(i) + one)
            end do
         case default
            ! of all pairs: smooth where two meet on the real axis, too
            do i = 2, size(multiplier)
               all = all*product(multiplier(i)*multiplier(:i - 1) - one)
            end do
         end select
      end associate
      value = real(all, wp)
   end function test_of

   !> Or is it a pair of real ones, the inverse of each other, of which nothing comes?
   pure function has_pair_on_circle(point) result(answer)
      type(orbit_point_t), intent(in) :: point
      logical :: answer

      real(wp), parameter :: near = 1.0e-6_wp

      answer = any(abs(aimag(point%multiplier)) > 0.0_wp .and. abs(abs(point%multiplier) - 1.0_wp) < near)
   end function has_pair_on_circle

   !> Where that is, as exactly as Newton's method tells.
   subroutine find_between(map, asked, trace, kind, values, there)
      type(section_map_t), target, intent(inout) :: map
      type(orbit_settings_t), intent(in) :: asked
      type(trace_t), intent(in) :: trace
      integer, intent(in) :: kind
      !> At the last point and at the next
      real(wp), intent(in) :: values(2)
      type(solution_t), intent(out) :: there

      type(bracket_t) :: bracket
      real(wp), allocatable :: direction(:)

      bracket = bracket_t(high=trace%step, grows=values(2) > 0.0_wp, value_low=values(1), value_high=values(2), &
         least_step=1.0e-12_wp, most_evaluations=60)
      bracket%point = chord(bracket)
      do
         call close_orbit(map, moved_along(map, trace%last%place, trace%direction, bracket%point), asked%tolerance, &
            most_corrections, there, trace%direction)
         if (.not. there%converged) return
         call find_direction(map, there%map, trace%direction, direction)
         if (.not. allocated(direction)) return
         call enter(bracket, test_of(kind, there%point, direction))
         call go_to(bracket, chord(bracket))
         if (bracket%is_found) return
      end do
   end subroutine find_between

   !> No step is short enough: an impact comes or goes, or there is nothing beyond. The last motion of the old kind.
   subroutine end_of_impacts(map, asked, trace, next, goes_on)
      type(section_map_t), target, intent(inout) :: map
      type(orbit_settings_t), intent(in) :: asked
      type(trace_t), intent(inout) :: trace
      !> The step that was tried last
      type(solution_t), intent(in) :: next
      !> The branch does, with other impacts
      logical, intent(in) :: goes_on

      ! from each motion found so, as Newton's method reaches less far the nearer it is to the last
      integer, parameter :: rounds = 12, halvings = 8
      ! a speed below this share of the motion's is that of a graze
      real(wp), parameter :: slow = 1.0e-2_wp
      type(solution_t) :: best, trial
      real(wp), allocatable :: direction(:)
      real(wp) :: high, low, speed, tried
      integer :: i, round

      best = trace%last
      direction = trace%direction
      speed = min(best%point%least_speed, next%least_speed)
      high = trace%step
      do round = 1, rounds
         trace%last = best
         low = 0.0_wp
         do i = 1, halvings
            tried = 0.5_wp*(low + high)
            call close_orbit(map, moved_along(map, trace%last%place, direction, tried), asked%tolerance, &
               most_corrections, trial, direction)
            speed = min(speed, trial%least_speed)
            if (trial%converged .and. trial%point%impacts == best%point%impacts) then
               best = trial
               low = tried
            else
               high = tried
            end if
         end do
         if (.not. low > 0.0_wp) exit
         high = 2.0_wp*(high - low)
         call find_direction(map, best%map, trace%direction, direction)
         if (.not. allocated(direction)) exit
         trace%direction = direction
      end do
      best%point%mark = mark_lost
      associate (whole => map%unit(size(best%place%state%q) + 1))
         if (goes_on .or. speed < slow*whole) best%point%mark = mark_grazing
      end associate
      trace%point = [trace%point, best%point]
      trace%is_over = .not. goes_on
   end subroutine end_of_impacts

end module orbit_branches
