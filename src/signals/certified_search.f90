!> The first zero of a signal, found so that no zero before it can be missed (docs/theory.md, section 9).
!>
!> A signal is a gap or a contact force as a function of time. At an instant it supplies its value s, its slope s' and
!> an upper bound B of -s'' that holds at all later times. While s + s' h - B h^2/2 > 0, the signal has no zero: each
!> step h ends at the root of the parabola. Inverse interpolation finds a zero up to which the slope is negative.
module certified_search
   use bracketed_zero, only: bracket_t, enter_value, choose_point
   use kinds, only: i8, wp
   implicit none (type, external)
   private
   public :: certified_signal_t, transformable_signal_t, bounds_t, search_t, search_history_t, history_size
   public :: first_zero, falls_to_zero, step_without_zero
   public :: term_value, term_rate, term_curvature, bound_value, bound_curvature, bound_jerk, term_columns
   public :: found_zero, found_none, found_never_positive, found_exhausted

   !> The signal falls through zero at `time`.
   integer, parameter :: found_zero = 1
   !> The signal has no zero up to the limit.
   integer, parameter :: found_none = 2
   !> A signal that starts at zero never rises above its rounding error.
   integer, parameter :: found_never_positive = 3
   !> The signal has no zero up to `time`, at which the permitted number of evaluations is used up.
   integer, parameter :: found_exhausted = 4

   !> Depth below zero that rounding errors may cause in a signal of magnitude 1 that starts at zero with zero slope.
   real(wp), parameter :: max_dip = 1.0e-11_wp

   ! The following constants are columns of an array with one row for each term of a signal, at one instant.
   !> Value of the term.
   integer, parameter :: term_value = 1
   !> First derivative of the term.
   integer, parameter :: term_rate = 2
   !> Second derivative of the term.
   integer, parameter :: term_curvature = 3
   !> Bound on the depth of the term below zero, from that instant on.
   integer, parameter :: bound_value = 4
   !> Bound on the magnitude of the second derivative, from that instant on.
   integer, parameter :: bound_curvature = 5
   !> Bound on the magnitude of the third derivative, from that instant on.
   integer, parameter :: bound_jerk = 6
   !> Number of these columns.
   integer, parameter :: term_columns = 6

   !> A function of time with guaranteed bounds on its derivatives.
   type, abstract :: certified_signal_t
      !> Order of the first derivative of s that is not 0 at t = 0 (3: or lower ones are within rounding); 0: s(0) > 0
      integer :: start_order = 0
   contains
      procedure(bounds_interface), deferred :: find_bounds
      procedure(evaluate_interface), deferred :: evaluate
   end type certified_signal_t

   !> A signal that yields other signals: itself or a derivative, shifted in time, scaled and offset.
   type, abstract, extends(certified_signal_t) :: transformable_signal_t
   contains
      procedure(transform_interface), deferred :: transform
   end type transformable_signal_t

   !> Maximum number of evaluations that a search history records.
   integer, parameter :: history_size = 32

   !> Result of a search for a zero.
   type :: search_t
      !> `found_zero`, `found_none`, `found_never_positive` or `found_exhausted`
      integer :: outcome = found_none
      !> Instant of the outcome
      real(wp) :: time = 0.0_wp
      !> Maximum of the signal over the instants evaluated
      real(wp) :: max_value = 0.0_wp
      !> Rounding error of the value at the start
      real(wp) :: rounding = 0.0_wp
      !> Upper bound of the signal up to `time`; huge: none was proven
      real(wp) :: ceiling = huge(1.0_wp)
      !> Number of evaluations
      integer(i8) :: evaluations = 0_i8
   end type search_t

   !> A derivative d of the signal, or the signal itself, at one instant, with bounds that hold from that instant on.
   type :: bounds_t
      !> d
      real(wp) :: value = 0.0_wp
      !> d'
      real(wp) :: slope = 0.0_wp
      !> d''
      real(wp) :: curvature = 0.0_wp
      !> Upper bound of -d''
      real(wp) :: bound = 0.0_wp
      !> Upper bound of |d''|
      real(wp) :: two_sided_bound = 0.0_wp
      !> Upper bound of |d'''|; huge: unknown
      real(wp) :: bound_jerk = huge(1.0_wp)
      !> Rounding error of d
      real(wp) :: rounding = 0.0_wp
      !> The signal itself
      real(wp) :: signal = 0.0_wp
      !> Rounding error of the signal
      real(wp) :: signal_rounding = 0.0_wp
      !> Lower bound of the signal
      real(wp) :: floor = -huge(1.0_wp)
      !> d has no zero within a step of this length, which may be longer than the step that `bound` certifies
      real(wp) :: zero_free_step = 0.0_wp
   end type bounds_t

   !> Evaluations of the signal that a search recorded. A signal that starts at zero rises until the first of them;
   !> after the last of them the signal falls to its zero, if it has one.
   type :: search_history_t
      !> Number of evaluations, in order of time; those after the first `history_size` are not recorded
      integer :: count = 0
      real(wp) :: time(history_size)
      type(bounds_t) :: bounds(history_size)
   end type search_history_t

   abstract interface
      !> A derivative of the signal, or of its sum with another signal, at an instant, with bounds that hold from that
      !> instant on. The components `signal`, `signal_rounding` and `rounding` do not include the other signal.
      subroutine bounds_interface(self, t, order, bounds, added, added_floor, needs_step)
         import :: certified_signal_t, bounds_t, term_columns, wp
         implicit none (type, external)
         class(certified_signal_t), intent(in) :: self
         !> Instant
         real(wp), intent(in) :: t
         !> Order of the derivative; 0: the signal itself
         integer, intent(in) :: order
         !> Values and bounds at the instant
         type(bounds_t), intent(out) :: bounds
         !> That derivative of the other signal, in the columns above, and its lower bound
         real(wp), intent(in), optional :: added(term_columns), added_floor
         !> False: the length of a step without a zero is not needed
         logical, intent(in), optional :: needs_step
      end subroutine bounds_interface

      !> The signal and its slope at an instant.
      subroutine evaluate_interface(self, t, value, slope)
         import :: certified_signal_t, wp
         implicit none (type, external)
         class(certified_signal_t), intent(in) :: self
         !> Instant
         real(wp), intent(in) :: t
         !> s and s'
         real(wp), intent(out) :: value, slope
      end subroutine evaluate_interface

      !> The signal offset + factor d(from + t), with d the derivative of the given order of this signal.
      subroutine transform_interface(self, from, factor, offset, order, transformed)
         import :: transformable_signal_t, wp
         implicit none (type, external)
         class(transformable_signal_t), intent(in) :: self
         !> Instant that becomes t = 0
         real(wp), intent(in) :: from
         real(wp), intent(in) :: factor, offset
         !> 0: d is the signal itself, 1: d is its slope
         integer, intent(in) :: order
         !> The new signal
         class(transformable_signal_t), allocatable, intent(out) :: transformed
      end subroutine transform_interface
   end interface

contains

   !> First zero of the signal in (0, limit].
   subroutine first_zero(signal, limit, search, history, max_evaluations)
      class(certified_signal_t), intent(in) :: signal
      !> End of the search
      real(wp), intent(in) :: limit
      type(search_t), intent(out) :: search
      !> Evaluations of the search
      type(search_history_t), intent(inout), optional :: history
      !> Permitted number of evaluations; default: unlimited
      integer(i8), intent(in), optional :: max_evaluations

      ! instant of the present evaluation, and length of the step to the next one
      real(wp) :: t, step
      type(bounds_t) :: bounds
      integer(i8) :: budget
      integer :: order

      budget = huge(budget)
      if (present(max_evaluations)) budget = max_evaluations
      t = 0.0_wp
      call bounds_at_start(signal, order, bounds, search)
      if (present(history)) history%count = 0
      search%ceiling = merge(bounds%signal, huge(1.0_wp), order == 0)
      do
         search%max_value = max(search%max_value, bounds%signal)
         if (present(history) .and. order == 0) call record_bounds(history, t, bounds)
         if (order == 0 .and. falls_to_zero(bounds)) then
            call find_bracketed_zero(signal, t, bounds, limit, search)
            return
         end if
         if (t > 0.0_wp .and. bounds%value <= bounds%rounding .and. (order > 0 .or. bounds%slope <= 0.0_wp)) then
            ! the value is zero to within its rounding error
            call end_at_zero(signal, t, order, bounds, search)
            return
         end if
         if (has_decayed(bounds) .or. (order == 0 .and. bounds%floor > bounds%rounding)) then
            search%outcome = found_none
            search%time = limit
            search%ceiling = huge(1.0_wp)
            return
         end if
         ! after t = 0, a value within rounding comes here only if it rises; the rounding error keeps the step above 0
         step = max(bounds%zero_free_step, step_without_zero(max(bounds%value, &
            merge(bounds%rounding, 0.0_wp, t > 0.0_wp)), bounds%slope, bounds%bound))
         if (order == 0) search%ceiling = max(search%ceiling, max_within_step(bounds, min(step, limit - t)))
         if (t + step >= limit .or. search%evaluations >= budget) then
            search%outcome = merge(found_none, found_exhausted, t + step >= limit)
            search%time = min(t + step, limit)
            return
         end if
         if (.not. t + step > t) then
            ! the step is shorter than the spacing of numbers at t
            call end_at_zero(signal, t, order, bounds, search)
            return
         end if
         t = t + step
         call evaluate_step(signal, t - step, t, order, bounds, search)
         if (search%outcome == found_zero) return
      end do
   end subroutine first_zero

   !> End the search at t, where the signal is zero. If the search ran on the signal itself and the signal started at
   !> zero, either it has remained zero, or the first step has ended at the next zero; the value in the middle decides.
   subroutine end_at_zero(signal, t, order, bounds, search)
      class(certified_signal_t), intent(in) :: signal
      real(wp), intent(in) :: t
      !> Order of the derivative that was searched
      integer, intent(in) :: order
      type(bounds_t), intent(in) :: bounds
      type(search_t), intent(inout) :: search

      real(wp) :: middle, slope

      search%outcome = merge(found_never_positive, found_zero, order > 0)
      search%time = t
      if (order > 0 .or. signal%start_order == 0 .or. bounds%signal > bounds%signal_rounding) return
      call signal%evaluate(0.5_wp*t, middle, slope)
      search%max_value = max(search%max_value, middle)
      if (search%max_value <= 4.0_wp*bounds%signal_rounding) search%outcome = found_never_positive
   end subroutine end_at_zero

   !> Append an evaluation, which is later than all recorded evaluations.
   pure subroutine record_bounds(history, t, bounds)
      type(search_history_t), intent(inout) :: history
      real(wp), intent(in) :: t
      !> Values and bounds of the signal
      type(bounds_t), intent(in) :: bounds

      history%count = history%count + 1
      if (history%count > history_size) return
      history%time(history%count) = t
      history%bounds(history%count) = bounds
   end subroutine record_bounds

   !> Upper bound of the signal within a step.
   elemental real(wp) function max_within_step(bounds, step) result(bound)
      !> Values and bounds of the signal at the start of the step
      type(bounds_t), intent(in) :: bounds
      real(wp), intent(in) :: step

      real(wp) :: bend, length, slope

      slope = max(bounds%slope, 0.0_wp)
      bend = bounds%two_sided_bound
      if (bounds%bound_jerk < sqrt(huge(1.0_wp))) bend = min(bend, bounds%curvature + step*bounds%bound_jerk)
      ! `bend` bounds the curvature from above; if it is negative, the maximum may be within the step
      length = step
      if (slope < -step*bend) length = -slope/bend
      bound = bounds%value + bounds%rounding + length*(slope + 0.5_wp*length*bend)
   end function max_within_step

   !> Begin the search. If the signal starts at zero without a slope (`start_order` > 1), the search runs on the first
   !> derivative that is positive at the start: as long as it is positive, so are the lower derivatives and the signal.
   subroutine bounds_at_start(signal, order, bounds, search)
      class(certified_signal_t), intent(in) :: signal
      !> Order of the derivative; 0: the signal itself
      integer, intent(out) :: order
      !> Values and bounds of that derivative
      type(bounds_t), intent(out) :: bounds
      !> Counts the evaluations
      type(search_t), intent(inout) :: search

      type(bounds_t) :: lower

      order = signal%start_order
      if (order == 1) order = 0
      call signal%find_bounds(0.0_wp, order, bounds)
      search%evaluations = 1_i8
      search%rounding = bounds%signal_rounding
      if (signal%start_order > 0) then
         bounds%signal = 0.0_wp
         if (order == 0) bounds%value = 0.0_wp
      end if
      if (order > 2 .and. bounds%value <= 64.0_wp*bounds%rounding) then
         ! the caller could not decide by lower derivatives; the second one is searched if it is above rounding
         call signal%find_bounds(0.0_wp, order - 1, lower)
         search%evaluations = search%evaluations + 1_i8
         if (lower%value > 64.0_wp*lower%rounding) then
            order = order - 1
            bounds = lower
            bounds%signal = 0.0_wp
         end if
      end if
   end subroutine bounds_at_start

   !> Evaluate at the end of a step. As soon as the value of a lower derivative, or of the signal itself, is clearly (64
   !> times) above rounding, the search continues on this derivative or on the signal.
   subroutine evaluate_step(signal, before, t, order, bounds, search)
      class(certified_signal_t), intent(in) :: signal
      !> Start and end of the step
      real(wp), intent(in) :: before, t
      !> Order of the derivative that is searched
      integer, intent(inout) :: order
      !> Values and bounds of that derivative at t
      type(bounds_t), intent(out) :: bounds
      !> `found_zero` on return if the signal has a zero before t
      type(search_t), intent(inout) :: search

      type(bounds_t) :: lower

      call signal%find_bounds(t, 0, bounds)
      search%evaluations = search%evaluations + 1_i8
      if (order > 0 .and. bounds%signal < -max(max_dip, 64.0_wp*bounds%signal_rounding)) then
         ! the derivative that should have made the signal positive was lost in rounding error
         search%outcome = found_zero
         search%time = start_of_dip(signal, before, t)
      else if (order == 0 .or. bounds%signal > 64.0_wp*bounds%signal_rounding) then
         order = 0
      else
         call signal%find_bounds(t, order, bounds)
         search%evaluations = search%evaluations + 1_i8
         if (order == 1) return
         call signal%find_bounds(t, order - 1, lower)
         search%evaluations = search%evaluations + 1_i8
         if (lower%value > 64.0_wp*lower%rounding) then
            order = order - 1
            bounds = lower
         end if
      end if
   end subroutine evaluate_step

   !> Whether the signal has decayed so far that its digits underflow.
   elemental logical function has_decayed(bounds) result(is)
      !> Values and bounds of the signal
      type(bounds_t), intent(in) :: bounds

      is = max(abs(bounds%value), abs(bounds%slope), bounds%bound) < tiny(1.0_wp)/epsilon(1.0_wp)
   end function has_decayed

   !> Instant at which a signal falls through -`max_dip`, by bisection.
   real(wp) function start_of_dip(signal, above, below) result(time)
      class(certified_signal_t), intent(in) :: signal
      !> Instants at which the signal is above and below -`max_dip`
      real(wp), intent(in) :: above, below

      type(bracket_t) :: bracket
      real(wp) :: value, slope

      bracket = bracket_t(low=above, high=below, value_tolerance=-1.0_wp, max_evaluations=40)
      call choose_point(bracket)
      do while (.not. bracket%is_found)
         call signal%evaluate(bracket%point, value, slope)
         call enter_value(bracket, value + max_dip)
         call choose_point(bracket)
      end do
      time = bracket%high
   end function start_of_dip

   !> Whether the signal certainly falls monotonically to zero, at more than half of its present slope.
   elemental logical function falls_to_zero(bounds) result(certain)
      !> Values and bounds of the signal
      type(bounds_t), intent(in) :: bounds

      ! squares of smaller slopes underflow, and with them the bounds
      real(wp), parameter :: min_slope = 1.0e-140_wp

      certain = bounds%slope < -min_slope .and. bounds%value > 0.0_wp
      if (certain) certain = bounds%slope**2 > 4.0_wp*curvature_bound(bounds)*bounds%value
   end function falls_to_zero

   !> Upper bound, >= 0, of s'' during the next 2 s/|s'|, twice the time to zero at the present slope.
   elemental real(wp) function curvature_bound(bounds) result(bound)
      !> Values and bounds of the signal; the slope is negative
      type(bounds_t), intent(in) :: bounds

      bound = bounds%two_sided_bound
      if (bounds%bound_jerk < huge(1.0_wp)) then
         bound = min(bound, max(0.0_wp, bounds%curvature - 2.0_wp*bounds%bound_jerk*bounds%value/bounds%slope))
      end if
   end function curvature_bound

   !> Positive root h of value + slope h - bound h^2/2 = 0, without cancellation. The root is limited to 1e290, which it
   !> exceeds only if the signal is almost constant.
   elemental real(wp) function step_without_zero(value, slope, bound) result(step)
      !> Value >= 0, slope, and upper `bound` >= 0 of minus the second derivative
      real(wp), intent(in) :: value, slope, bound

      ! the product of a smaller bound and a value would underflow
      real(wp), parameter :: min_bound = 1.0e-280_wp
      real(wp) :: root, curvature

      curvature = max(bound, min_bound)
      ! without branches, so that loops vectorise: numerator and denominator are chosen, not the quotient
      root = abs(slope) + sqrt(slope**2 + 2.0_wp*curvature*value)
      step = merge(root, 2.0_wp*value, slope >= 0.0_wp)
      step = step/max(merge(curvature, root, slope >= 0.0_wp), 1.0e-290_wp*step, tiny(1.0_wp))
   end function step_without_zero

   !> Find a zero that certainly exists, and up to which the slope is negative, by bracketed inverse interpolation.
   subroutine find_bracketed_zero(signal, start, at_start, limit, search)
      class(certified_signal_t), intent(in) :: signal
      !> Instant at which `falls_to_zero` holds
      real(wp), intent(in) :: start
      !> Values and bounds of the signal at that instant
      type(bounds_t), intent(in) :: at_start
      !> End of the search
      real(wp), intent(in) :: limit
      type(search_t), intent(inout) :: search

      type(bracket_t) :: bracket
      real(wp) :: t, value, slope, t_before, value_before, slope_before, t_next

      bracket = bracket_t(step_spacings=2.0_wp, value_tolerance=max(0.25_wp*at_start%rounding, tiny(1.0_wp)))
      associate (value => at_start%value, slope => at_start%slope)
         bracket%low = start + 2.0_wp*value/(sqrt(slope**2 + 2.0_wp*at_start%two_sided_bound*value) - slope)
         bracket%high = start + 2.0_wp*value/(sqrt(slope**2 - 2.0_wp*curvature_bound(at_start)*value) - slope)
         bracket%high = bracket%high + 4.0_wp*spacing(bracket%high)
         ! first estimate: the zero of the parabola through value, slope and curvature
         t = start + 2.0_wp*value/(sqrt(slope**2 - 2.0_wp*at_start%curvature*value) - slope)
      end associate
      bracket%point = min(max(t, bracket%low), bracket%high)
      t_before = start
      value_before = at_start%value
      slope_before = at_start%slope
      do while (.not. bracket%is_found)
         t = bracket%point
         call signal%evaluate(t, value, slope)
         search%evaluations = search%evaluations + 1_i8
         call enter_value(bracket, value)
         t_next = t + inverse_cubic_step(t - t_before, value_before, slope_before, value, slope)
         t_before = t
         if (.not. bracket%is_found .and. t_next > bracket%low .and. t_next < bracket%high .and. &
            0.5_wp*at_start%two_sided_bound*(t_next - t)**2 <= bracket%value_tolerance) then
            ! from t to the zero the signal leaves its tangent by less than the tolerance
            bracket%is_found = .true.
            t = t_next
         end if
         call choose_point(bracket, t_next)
         value_before = value
         slope_before = slope
      end do
      search%time = min(t, limit)
      search%outcome = merge(found_none, found_zero, t > limit)
   end subroutine find_bracketed_zero

   !> Step from the second of two points to the zero of the cubic that gives time as a function of the value; Newton's
   !> step if the points do not allow this.
   elemental real(wp) function inverse_cubic_step(distance, value_before, slope_before, value, slope) result(step)
      !> Time from the first point to the second
      real(wp), intent(in) :: distance
      !> Value and slope at the first point
      real(wp), intent(in) :: value_before, slope_before
      !> Value and slope at the second point
      real(wp), intent(in) :: value, slope

      real(wp) :: ratio, change

      step = -value/slope
      change = value - value_before
      if (.not. (slope < 0.0_wp .and. slope_before < 0.0_wp .and. abs(value) < 0.5_wp*abs(change))) return
      ratio = value/change
      ! Hermite's polynomial, with its origin at the second point
      step = step - ratio**2*(distance*(3.0_wp - 2.0_wp*ratio) - change*(2.0_wp/slope + 1.0_wp/slope_before) &
         + ratio*change*(1.0_wp/slope + 1.0_wp/slope_before))
   end function inverse_cubic_step

end module certified_search
