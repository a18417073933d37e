!> The maximum of a signal and the last exceedance of a level, found with the same certainty as the zeros of a signal.
module signal_peaks
   use certified_search, only: first_zero, found_never_positive, found_none, found_exhausted, found_zero, bounds_t, &
      search_t, transformable_signal_t
   use kinds, only: i8, wp
   use row_peaks, only: peak_tolerance
   implicit none (type, external)
   private
   public :: extreme_search_t, exceeds, find_maximum, find_last_exceedance, find_turn, peak_tolerance

   ! The following constants limit the evaluations of the searches for an extreme of a run. When the evaluations are
   ! used up, the tolerance is raised tenfold: a beam without damping keeps oscillating, and the cost of a search would
   ! have no limit with a fixed tolerance.
   !> Number of evaluations at the start of a run.
   integer(i8), parameter :: initial_evaluations = 50000_i8
   !> Number of further evaluations after the tolerance was raised.
   integer(i8), parameter :: further_evaluations = 10000_i8
   !> Number of evaluations that each phase adds, up to a remainder of `max_evaluations`.
   integer(i8), parameter :: phase_evaluations = 5000_i8
   !> Maximum number of evaluations that remain at the start of a phase.
   integer(i8), parameter :: max_evaluations = 500000_i8
   !> Tolerance above which an extreme counts as uncertain. The following phases are then also sampled, because a search
   !> with such a tolerance alone may pass over the highest peak.
   real(wp), parameter :: max_tolerance = 1.0e-3_wp
   !> Number of samples of the rest of a phase if ripples make many local maxima, and about each highest sample.
   integer(i8), parameter :: few_samples = 100_i8
   !> Maximum number of samples of a phase if the extreme is uncertain.
   integer(i8), parameter :: phase_samples = 5000_i8
   !> Maximum number of samples of the rest of a phase if the evaluations are used up.
   integer(i8), parameter :: many_samples = 5000_i8

   !> Tolerance of the searches for an extreme, and effort that remains for them, over the phases of a run.
   type :: extreme_search_t
      !> Present tolerance, as a fraction of the extreme
      real(wp) :: tolerance = peak_tolerance
      !> Number of evaluations that remain before the tolerance is raised
      integer(i8), private :: remaining = initial_evaluations
   end type extreme_search_t

contains

   !> Whether a signal exceeds a level in a phase (the motion between two events).
   logical function exceeds(signal, length, level) result(answer)
      class(transformable_signal_t), intent(in) :: signal
      !> Length of the phase
      real(wp), intent(in) :: length
      !> The level
      real(wp), intent(in) :: level

      class(transformable_signal_t), allocatable :: below
      type(search_t) :: search
      real(wp) :: value, slope

      call signal%evaluate(0.0_wp, value, slope)
      answer = value > level
      if (answer) return
      call signal%transform(0.0_wp, -1.0_wp, level, 0, below)
      call first_zero(below, length, search)
      answer = search%outcome == found_zero
   end function exceeds

   !> The maximum of a signal in a phase, if it exceeds a threshold.
   !>
   !> The search skips every interval in which the signal certainly stays below the maximum found until now. If the
   !> signal rises above that maximum, the next zero of its slope gives a higher maximum. If ripples on a rise make many
   !> local maxima, or the permitted evaluations are used up, samples of the rest of the phase raise the maximum first;
   !> if earlier phases have left the extreme uncertain, samples of the whole phase do.
   subroutine find_maximum(signal, length, threshold, is_found, still_rises, value, time, scale, extreme_search)
      class(transformable_signal_t), intent(in) :: signal
      !> Length of the phase
      real(wp), intent(in) :: length
      !> Value that the maximum must exceed
      real(wp), intent(in) :: threshold
      !> Whether the maximum exceeds the threshold
      logical, intent(out) :: is_found
      !> Whether the maximum is at the end of the phase
      logical, intent(out) :: still_rises
      !> The maximum, within the tolerance
      real(wp), intent(out) :: value
      !> Instant of the maximum
      real(wp), intent(out) :: time
      !> Minimum magnitude to which the tolerance refers. If the argument is present, the magnitude is raised so that
      !> the tolerance exceeds the rounding error, and the maximum must exceed `threshold` by the tolerance
      real(wp), intent(in), optional :: scale
      !> State of the searches over all phases; default: a state for this phase alone
      type(extreme_search_t), intent(inout), optional :: extreme_search

      class(transformable_signal_t), allocatable :: transformed
      type(bounds_t) :: bounds
      type(extreme_search_t) :: state
      type(search_t) :: search
      real(wp) :: min_scale, level, slope, t, candidate
      integer(i8) :: samples
      integer :: attempt

      min_scale = 0.0_wp
      if (present(extreme_search)) state = extreme_search
      if (present(scale)) then
         call signal%find_bounds(0.0_wp, 0, bounds)
         min_scale = max(scale, bounds%rounding/peak_tolerance)
      end if
      state%remaining = min(state%remaining + phase_evaluations, max_evaluations)
      value = threshold
      call begin_maximum(signal, length, state%tolerance > max_tolerance, value, time)
      is_found = value > threshold
      level = merge(raised_level(value, min_scale, state), threshold, is_found .or. min_scale > 0.0_wp)
      t = 0.0_wp
      attempt = 0
      do
         call signal%transform(t, -1.0_wp, level, 0, transformed)
         call search_with_budget(transformed, length - t, state, search)
         if (search%outcome == found_none .or. search%outcome == found_never_positive) exit
         t = t + search%time
         if (search%outcome == found_zero) then
            call signal%transform(t, 1.0_wp, 0.0_wp, 1, transformed)
            call search_with_budget(transformed, length - t, state, search)
            is_found = .true.
            if (search%outcome == found_none) then
               call signal%evaluate(length, value, slope)
               time = length
               exit
            end if
            t = t + search%time
            call signal%evaluate(t, candidate, slope)
            if (candidate > value) then
               value = candidate
               time = t
            end if
         end if
         attempt = attempt + 1
         ! Samples are taken at attempts 16, 32, 64, ... and when the evaluations are used up
         if (search%outcome == found_exhausted .or. (popcnt(attempt) == 1 .and. attempt >= 16)) then
            samples = few_samples
            if (search%outcome == found_exhausted) samples = dense_samples(signal, t, length, many_samples)
            call sample_ahead(signal, t, length, samples, value, time)
            is_found = is_found .or. value > threshold
         end if
         level = raised_level(max(value, level), min_scale, state)
      end do
      still_rises = is_found .and. .not. time < length
      if (present(extreme_search)) extreme_search = state
   end subroutine find_maximum

   !> Begin the search for a maximum: with the value at the start or, if earlier phases have left the maximum uncertain,
   !> with samples of the whole phase.
   subroutine begin_maximum(signal, length, is_uncertain, value, time)
      class(transformable_signal_t), intent(in) :: signal
      !> Length of the phase
      real(wp), intent(in) :: length
      logical, intent(in) :: is_uncertain
      !> On entry the value that the maximum must exceed; on return the maximum found until now
      real(wp), intent(inout) :: value
      !> Instant of that maximum
      real(wp), intent(out) :: time

      real(wp) :: start, slope

      time = 0.0_wp
      call signal%evaluate(0.0_wp, start, slope)
      value = max(value, start)
      if (is_uncertain) call sample_ahead(signal, 0.0_wp, length, dense_samples(signal, 0.0_wp, length, &
         phase_samples), value, time)
   end subroutine begin_maximum

   !> The first zero within the evaluations that remain; if they are used up, the tolerance is raised tenfold.
   subroutine search_with_budget(signal, limit, extreme_search, search)
      class(transformable_signal_t), intent(in) :: signal
      real(wp), intent(in) :: limit
      type(extreme_search_t), intent(inout) :: extreme_search
      type(search_t), intent(out) :: search

      call first_zero(signal, limit, search, max_evaluations=extreme_search%remaining)
      extreme_search%remaining = extreme_search%remaining - search%evaluations
      if (extreme_search%remaining > 0) return
      extreme_search%remaining = further_evaluations
      extreme_search%tolerance = 10.0_wp*extreme_search%tolerance
   end subroutine search_with_budget

   !> Number of intervals between samples that follow the fastest terms of a signal, about six in each of their periods.
   !> The ratio of the bounds of its third and of its second derivative is a mean of the frequencies of the terms.
   integer(i8) function dense_samples(signal, from, to, limit) result(count)
      class(transformable_signal_t), intent(in) :: signal
      !> Start of the samples
      real(wp), intent(in) :: from
      !> End of the samples
      real(wp), intent(in) :: to
      !> Maximum of the number; the minimum is `few_samples`
      integer(i8), intent(in) :: limit

      type(bounds_t) :: bounds
      ! bound of the third derivative times the length
      real(wp) :: change

      call signal%find_bounds(from, 0, bounds, needs_step=.false.)
      count = limit
      ! an unknown bound is huge: its products must not overflow
      change = min(bounds%bound_jerk, 1.0e100_wp)*(to - from)
      ! a comparison of products, because the second derivative may vanish
      if (change < real(limit, wp)*bounds%two_sided_bound) count = max(few_samples, &
         int(change/bounds%two_sided_bound, i8))
   end function dense_samples

   !> The maximum over samples, then over ever closer samples about the highest sample. Samples are taken at least three
   !> times, because the first closer samples need not be higher, and then as long as the maximum increases.
   subroutine sample_ahead(signal, from, to, samples, value, time)
      class(transformable_signal_t), intent(in) :: signal
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
      !> Number of intervals between the first samples; there are `few_samples` intervals about each highest sample
      integer(i8), intent(in) :: samples
      !> The maximum found until now
      real(wp), intent(inout) :: value
      !> Instant of that maximum
      real(wp), intent(inout) :: time

      ! maximum number of times that the samples are taken
      integer, parameter :: zooms = 10
      ! first instant of the samples
      real(wp) :: first
      ! last instant of the samples
      real(wp) :: last
      ! interval between samples
      real(wp) :: width
      ! maximum before the samples were taken
      real(wp) :: previous
      real(wp) :: sample, slope, t
      integer(i8) :: i, count
      integer :: zoom

      first = from
      last = to
      count = samples
      do zoom = 1, zooms
         previous = value
         width = (last - first)/real(count, wp)
         do i = 0, count
            t = first + width*real(i, wp)
            call signal%evaluate(t, sample, slope)
            if (sample <= value) cycle
            value = sample
            time = t
         end do
         ! if no sample is above the known value, the highest sample is not in the interval
         if (time < from .or. (zoom > 2 .and. .not. value - previous > peak_tolerance*abs(value))) exit
         first = max(from, time - width)
         last = min(to, time + width)
         count = few_samples
      end do
   end subroutine sample_ahead

   !> The level that a higher maximum must reach.
   elemental real(wp) function raised_level(level, scale, extreme_search) result(higher)
      !> The maximum found until now
      real(wp), intent(in) :: level
      !> Magnitude that replaces a maximum near zero
      real(wp), intent(in) :: scale
      !> The search that has the tolerance
      type(extreme_search_t), intent(in) :: extreme_search

      higher = level + extreme_search%tolerance*max(abs(level), scale) + tiny(1.0_wp)
   end function raised_level

   !> Find the instant at which a signal was last above a level (its last exceedance).
   subroutine find_last_exceedance(signal, length, level, time, stays_above, from)
      class(transformable_signal_t), intent(in) :: signal
      !> Length of the phase
      real(wp), intent(in) :: length
      !> The level
      real(wp), intent(in) :: level
      !> The last exceedance; 0: none
      real(wp), intent(out) :: time
      !> Whether the signal is above the level at the end of the phase
      logical, intent(out) :: stays_above
      !> Start of the search; default: the start of the phase
      real(wp), intent(in), optional :: from

      class(transformable_signal_t), allocatable :: transformed
      type(search_t) :: search
      real(wp) :: value, slope, t
      logical :: is_above, is_at_level

      t = 0.0_wp
      if (present(from)) t = from
      call signal%evaluate(t, value, slope)
      is_at_level = .not. abs(value - level) > 0.0_wp
      is_above = value > level .or. (is_at_level .and. slope > 0.0_wp)
      time = 0.0_wp
      do
         call signal%transform(t, merge(1.0_wp, -1.0_wp, is_above), merge(-level, level, is_above), 0, transformed)
         if (is_at_level) transformed%start_order = 1
         call first_zero(transformed, length - t, search)
         if (search%outcome == found_none .or. search%outcome == found_never_positive) exit
         t = t + search%time
         if (is_above) time = t
         is_above = .not. is_above
         is_at_level = .true.
         ! a signal that starts at the level, to within rounding, is taken as not above it
         if (.not. search%time > 0.0_wp) exit
      end do
      stays_above = is_above .and. search%outcome == found_none
      if (stays_above) time = length
   end subroutine find_last_exceedance

   !> The first turning point of a signal, a zero of its slope. If the search cannot decide at the start, because the
   !> sign of the slope is uncertain or no certain zero is found, the start is delayed, repeatedly and each time by
   !> twice as much. So is the start of a search whose many steps are short because the slope remains within rounding,
   !> or are together shorter than the delay.
   subroutine find_turn(signal, span, direction, is_found, time, evaluations)
      class(transformable_signal_t), intent(in) :: signal
      !> Start and end of the search
      real(wp), intent(in) :: span(2)
      !> On entry 1 (-1) if the search starts at a turning point after which the signal rises (falls), else 0. On return
      !> 1 (-1) if the signal rises (falls) after the turning point that was found; not defined if none was found
      integer, intent(inout) :: direction
      logical, intent(out) :: is_found
      !> Instant of the turning point; not defined if none was found
      real(wp), intent(out) :: time
      !> Number of evaluations, to which those of this search are added
      integer(i8), intent(inout) :: evaluations

      ! first delay of the start, as a fraction of the interval that is searched
      real(wp), parameter :: first_delay = 1.0e-9_wp
      ! evaluations after which a search is interrupted, to see whether the slope was ever above rounding and whether
      ! the steps come forward
      integer(i8), parameter :: evaluations_at_once = 500_i8
      class(transformable_signal_t), allocatable :: rate
      type(bounds_t) :: bounds
      type(search_t) :: search
      real(wp) :: delay
      ! the derivative that decides the direction: the slope or, if the slope is zero, the second derivative
      real(wp) :: tendency
      ! whether the slope is zero, to within rounding, at the (delayed) start
      logical :: is_turning

      is_found = .false.
      time = span(1)
      delay = first_delay*(span(2) - span(1))
      do while (time < span(2))
         is_turning = direction /= 0
         if (direction == 0) then
            call signal%find_bounds(time, 1, bounds)
            evaluations = evaluations + 1_i8
            ! a slope that is zero except for rounding makes the start a turning point
            is_turning = abs(bounds%value) <= bounds%rounding
            tendency = merge(bounds%slope, bounds%value, is_turning)
            if (abs(tendency) > 0.0_wp) direction = merge(1, -1, tendency > 0.0_wp)
         end if
         if (direction /= 0) then
            call signal%transform(time, real(direction, wp), 0.0_wp, 1, rate)
            if (is_turning) rate%start_order = 1
            call first_zero(rate, span(2) - time, search, max_evaluations=evaluations_at_once)
            evaluations = evaluations + search%evaluations
            if (search%outcome == found_none) return
            is_found = search%outcome == found_zero .and. time + search%time > time
            if (is_found .or. search%outcome == found_exhausted) time = time + search%time
            if (is_found) then
               direction = -direction
               return
            end if
            direction = 0
            if (search%outcome == found_exhausted .and. search%max_value > search%rounding .and. &
               search%time > delay) cycle
         end if
         time = time + delay
         delay = 2.0_wp*delay
      end do
   end subroutine find_turn

end module signal_peaks
