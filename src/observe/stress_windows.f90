!> Bending moments and stresses within the window of &statistics, for either method: extremes, and stress cycles by
!> rainflow counting (ASTM E1049, section 5.4.4) of the turning points of the motion itself, not of samples, and the
!> damage-equivalent range of these cycles (docs/theory.md, section 19).
!>
!> A turning point counts only if the signal reverses by more than a threshold at this point. Values of the signal are
!> added in the order of time; they need to include all extremes, and other values do no harm.
module stress_windows
   use interval_statistics, only: widen_range
   use kinds, only: i8, wp
   use motion_intervals, only: interval_t, output_row_t
   use response_types, only: moment_record_t, moment_window_t, response_t
   use run_settings, only: end_of_run, run_settings_t
   use signal_peaks, only: extreme_search_t
   implicit none (type, external)
   private
   public :: stress_windows_t, place_window_t, open_windows, add_interval, finish_windows, turning_points_t, &
      reversal_search_t, add_value, reversals_of, count_cycles, equivalent_range

   !> Search for reversals. The type has no allocatable components, so that a copy restores it when a run returns to an
   !> earlier state.
   type :: reversal_search_t
      !> Number of reversals found
      integer :: count = 0
      !> 1: the signal rises, -1: it falls, 0: it has not moved by more than the threshold yet
      integer :: direction = 0
      !> Extreme value since the last reversal; without a direction the first value
      real(wp) :: extreme = 0.0_wp
      !> Minimum of the signal before it has a direction
      real(wp) :: minimum = huge(1.0_wp)
      !> Maximum of the signal before it has a direction
      real(wp) :: maximum = -huge(1.0_wp)
   end type reversal_search_t

   !> Values at the reversals; only the first `count` of the search are valid.
   type :: turning_points_t
      real(wp), allocatable :: values(:)
   end type turning_points_t

   !> Record of the moment at a place. The type has no allocatable components, so that a copy restores it when a run
   !> returns to an earlier state.
   type :: place_window_t
      !> Minimum and maximum of the moment so far
      real(wp) :: extremes(2) = [huge(1.0_wp), -huge(1.0_wp)]
      !> Tolerances of the searches for the minimum (1) and for the maximum (2), and number of evaluations that remain
      !> for them
      type(extreme_search_t) :: search_state(2)
      !> Search for reversals
      type(reversal_search_t) :: reversals
      !> Number of turning points so far
      integer :: turns = 0
      !> Number of evaluations in the search for turning points
      integer(i8) :: evaluations = 0_i8
      !> Instant from which turning points are not searched because there are too many, tau
      real(wp) :: counted_until = huge(1.0_wp)
   end type place_window_t

   !> Windows of all places.
   type :: stress_windows_t
      !> Beginning and end of the window, tau
      real(wp) :: window(2) = 0.0_wp
      !> Slope of the S-N curve; 0: cycles are not counted
      real(wp) :: slope = 0.0_wp
      !> Number of classes of the histogram of cycles
      integer :: classes = 1
      !> Maximum number of turning points at a place
      integer :: limit = huge(1)
      !> Moment by which the signal must reverse for a turning point to count, [places]
      real(wp), allocatable :: threshold(:)
      !> Records up to the present instant, [places]
      type(place_window_t), allocatable :: now(:)
      !> Moments at the turning points, [places]
      type(turning_points_t), allocatable :: points(:)
   end type stress_windows_t

contains

   !> Prepare the windows, if statistics or cycles of stresses are requested.
   pure subroutine open_windows(settings, moments, windows)
      type(run_settings_t), intent(in) :: settings
      !> Moments with their stresses, [places]
      type(moment_record_t), intent(in) :: moments(:)
      type(stress_windows_t), allocatable, intent(out) :: windows

      if (.not. (allocated(settings%statistics) .or. settings%stress%fatigue_slope > 0.0_wp)) return
      allocate (windows)
      windows%window = [0.0_wp, end_of_run(settings%response)]
      windows%slope = settings%stress%fatigue_slope
      windows%classes = settings%stress%fatigue_classes
      windows%limit = settings%stress%fatigue_limit
      if (allocated(settings%statistics)) windows%window = [settings%statistics%start, &
         min(settings%statistics%end, windows%window(2))]
      allocate (windows%now(size(moments)), windows%points(size(moments)))
      allocate (windows%threshold(size(moments)), source=0.0_wp)
      where (moments%stress_per_moment > 0.0_wp) windows%threshold = settings%stress%fatigue_threshold &
         /moments%stress_per_moment
   end subroutine open_windows

   !> Add the part of an interval that lies within the window.
   subroutine add_interval(interval, windows)
      class(interval_t), intent(inout) :: interval
      type(stress_windows_t), intent(inout) :: windows

      type(output_row_t) :: row
      real(wp) :: span(2)
      integer :: p

      span = [max(windows%window(1) - interval%start, 0.0_wp), &
         min(windows%window(2) - interval%start, interval%length)]
      if (.not. span(2) > span(1)) return
      do p = 1, size(windows%now)
         row = output_row_t(interval%moment_row(p))
         associate (now => windows%now(p))
            call widen_range(interval, row, span, now%extremes, now%search_state)
            if (windows%slope > 0.0_wp) call add_turns(interval, row, span, windows%threshold(p), windows%limit, &
               now, windows%points(p))
         end associate
      end do
   end subroutine add_interval

   !> Add the values at both ends of a span and at all turning points between them. Without damping a fine mesh has
   !> turning points at the rate of its highest mode, so their number is limited.
   subroutine add_turns(interval, row, span, threshold, limit, now, points)
      class(interval_t), intent(inout) :: interval
      type(output_row_t), intent(in) :: row
      real(wp), intent(in) :: span(2)
      real(wp), intent(in) :: threshold
      integer, intent(in) :: limit
      type(place_window_t), intent(inout) :: now
      type(turning_points_t), intent(inout) :: points

      real(wp) :: state(2), time, turn
      integer :: direction
      logical :: is_found

      if (now%counted_until < huge(1.0_wp)) return
      state = interval%evaluate(row, span(1))
      call add_value(state(1), threshold, now%reversals, points)
      direction = 0
      time = span(1)
      do
         call interval%seek_turn(row, [time, span(2)], direction, is_found, turn, now%evaluations)
         if (.not. is_found .or. turn <= time) exit
         time = turn
         state = interval%evaluate(row, time)
         call add_value(state(1), threshold, now%reversals, points)
         now%turns = now%turns + 1
         if (now%turns < limit) cycle
         now%counted_until = interval%start + time
         return
      end do
      state = interval%evaluate(row, span(2))
      call add_value(state(1), threshold, now%reversals, points)
   end subroutine add_turns

   !> Store the results at the end of the run: in the response, and the extremes over all places among its measures.
   subroutine finish_windows(windows, response)
      type(stress_windows_t), intent(in) :: windows
      type(response_t), intent(inout) :: response

      ! moments up to this fraction of the maximum of all places are rounding errors of zero, as at a free tip
      real(wp), parameter :: rounding = 1.0e-12_wp
      real(wp) :: largest(size(windows%now))
      integer :: p

      largest = [(max(windows%now(p)%extremes(2), -windows%now(p)%extremes(1)), p=1, size(largest))]
      allocate (response%moment_windows(size(windows%now)))
      do p = 1, size(windows%now)
         associate (found => response%moment_windows(p), now => windows%now(p))
            found%window = windows%window
            found%extremes = now%extremes
            found%tolerance = maxval(now%search_state%tolerance)
            found%slope = windows%slope
            found%counted_until = min(now%counted_until, windows%window(2))
            response%evaluations = response%evaluations + now%evaluations
            if (.not. (windows%slope > 0.0_wp .and. response%moments(p)%has_stress)) cycle
            call summarise(response%moments(p)%stress_per_moment*pack(reversals_of(now%reversals, windows%points(p)), &
               largest(p) > rounding*maxval(largest)), .not. windows%threshold(p) > 0.0_wp, windows%classes, found)
         end associate
      end do
   end subroutine finish_windows

   !> Cycles of the stress at a place: number, damage-equivalent range, and histogram of the ranges.
   subroutine summarise(reversals, has_default, classes, found)
      !> Stresses at the reversals
      real(wp), intent(in) :: reversals(:)
      !> Whether the settings give no threshold: reversals by less than `default_fraction` of the range of the stress do
      !> not count
      logical, intent(in) :: has_default
      !> Number of classes
      integer, intent(in) :: classes
      type(moment_window_t), intent(inout) :: found

      real(wp), parameter :: default_fraction = 0.01_wp
      type(reversal_search_t) :: search
      type(turning_points_t) :: points
      real(wp), allocatable :: counted(:)
      real(wp), dimension(size(reversals) + 1) :: range, cycles
      real(wp) :: largest, threshold
      integer :: i, number, place

      threshold = 0.0_wp
      if (has_default .and. size(reversals) > 0) threshold = default_fraction*(maxval(reversals) - minval(reversals))
      do i = 1, size(reversals)
         call add_value(reversals(i), threshold, search, points)
      end do
      counted = reversals_of(search, points)
      call count_cycles(counted, range(:size(counted)), cycles(:size(counted)), number)
      found%cycles = sum(cycles(:number))
      found%equivalent_range = equivalent_range(range(:number), cycles(:number), found%slope)
      largest = maxval([0.0_wp, range(:number)])
      found%class_edge = [(largest*real(i, wp)/real(classes, wp), i=1, classes)]
      found%class_edge(classes) = largest
      allocate (found%class_cycles(classes), source=0.0_wp)
      do i = 1, number
         place = min(count(found%class_edge < range(i)) + 1, classes)
         found%class_cycles(place) = found%class_cycles(place) + cycles(i)
      end do
   end subroutine summarise

   !> Add a value of the signal.
   subroutine add_value(value, threshold, search, points)
      real(wp), intent(in) :: value
      !> Reversals by at most this much do not count
      real(wp), intent(in) :: threshold
      type(reversal_search_t), intent(inout) :: search
      type(turning_points_t), intent(inout) :: points

      if (search%direction == 0) then
         search%minimum = min(search%minimum, value)
         search%maximum = max(search%maximum, value)
         if (value - search%minimum > threshold) then
            call add_reversal((search%minimum), 1)
         else if (search%maximum - value > threshold) then
            call add_reversal((search%maximum), -1)
         end if
      else if (real(search%direction, wp)*(value - search%extreme) >= 0.0_wp) then
         search%extreme = value
      else if (abs(value - search%extreme) > threshold) then
         call add_reversal((search%extreme), -search%direction)
      end if

   contains

      !> Append the value at a reversal.
      subroutine add_reversal(reversal, direction)
         real(wp), intent(in) :: reversal
         !> Direction of the signal after the reversal
         integer, intent(in) :: direction

         if (.not. allocated(points%values)) allocate (points%values(64))
         ! twice as many; the second half is overwritten
         if (search%count == size(points%values)) points%values = [points%values, points%values]
         search%count = search%count + 1
         points%values(search%count) = reversal
         search%direction = direction
         search%extreme = value
      end subroutine add_reversal
   end subroutine add_value

   !> Values at the reversals, followed by the extreme since the last reversal.
   pure function reversals_of(search, points) result(values)
      type(reversal_search_t), intent(in) :: search
      type(turning_points_t), intent(in) :: points
      real(wp), allocatable :: values(:)

      if (search%direction == 0) then
         allocate (values(0))
      else
         values = [points%values(:search%count), search%extreme]
      end if
   end function reversals_of

   !> Count the cycles. A range counts when the range after it is at least as large: as half a cycle if it contains the
   !> first of the remaining reversals, else as a cycle. The ranges that remain at the end are half cycles.
   subroutine count_cycles(reversals, range, cycles, number)
      !> Values at the reversals, alternately minima and maxima
      real(wp), intent(in) :: reversals(:)
      !> Range of each count, [size(reversals)]
      real(wp), intent(out) :: range(:)
      !> Number of cycles of each count: 1, or 0.5 for half a cycle, [size(reversals)]
      real(wp), intent(out) :: cycles(:)
      !> Number of counts
      integer, intent(out) :: number

      ! remaining reversals, of which the first is `remaining(first)`
      real(wp) :: remaining(size(reversals))
      real(wp) :: last_range, previous_range
      integer :: first, i, top

      number = 0
      range = 0.0_wp
      cycles = 0.0_wp
      first = 1
      top = 0
      do i = 1, size(reversals)
         top = top + 1
         remaining(top) = reversals(i)
         do while (top - first >= 2)
            last_range = abs(remaining(top) - remaining(top - 1))
            previous_range = abs(remaining(top - 1) - remaining(top - 2))
            if (last_range < previous_range) exit
            if (top - first == 2) then
               call add(previous_range, 0.5_wp)
               first = first + 1
            else
               call add(previous_range, 1.0_wp)
               remaining(top - 2) = remaining(top)
               top = top - 2
            end if
         end do
      end do
      do i = first, top - 1
         call add(abs(remaining(i + 1) - remaining(i)), 0.5_wp)
      end do

   contains

      !> Append a counted range.
      subroutine add(counted_range, cycle_count)
         real(wp), intent(in) :: counted_range
         !> Cycles that the range counts: 1 or 0.5
         real(wp), intent(in) :: cycle_count

         number = number + 1
         range(number) = counted_range
         cycles(number) = cycle_count
      end subroutine add
   end subroutine count_cycles

   !> Damage-equivalent range: the same number of cycles of this range does the same damage by Miner's rule, if the
   !> damage of a cycle is proportional to the power m of its range, (sum n_i range_i^m / sum n_i)^(1/m). 0: there are
   !> no cycles.
   pure real(wp) function equivalent_range(range, cycles, slope) result(equivalent)
      !> Range of each count
      real(wp), intent(in) :: range(:)
      !> Number of cycles of each count
      real(wp), intent(in) :: cycles(:)
      !> Exponent m, the slope of the S-N curve in logarithms
      real(wp), intent(in) :: slope

      real(wp) :: largest

      equivalent = 0.0_wp
      largest = maxval([0.0_wp, range])
      if (.not. (largest > 0.0_wp .and. sum(cycles) > 0.0_wp)) return
      ! quotients of ranges do not overflow
      equivalent = largest*(sum(cycles*(range/largest)**slope)/sum(cycles))**(1.0_wp/slope)
   end function equivalent_range

end module stress_windows
