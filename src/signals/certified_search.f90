!> The first zero of a signal, found so that no zero before it can be missed (docs/theory.md, section 9).
!>
!> A signal tells its value s, its slope s' and a bound B on |s''| that holds from that instant on. As
!> long as s + s' h - B h^2/2 > 0 there is no zero: each step goes up to the root of that parabola.
!> Once s' < 0 is certain to keep its sign up to a certain zero, a safeguarded Newton iteration ends the search.
module certified_search
   use bracketed_zero, only: bracket_t, enter, go_to
   use kinds, only: i8, wp
   implicit none (type, external)
   private
   public :: certified_signal_t, viewed_signal_t, bounds_t, search_t, search_history_t, history_size, first_zero, &
      falls_to_zero
   public :: step_without_zero
   public :: term_value, term_rate, term_curvature, bound_value, bound_curvature, bound_jerk, term_columns
   public :: found_zero, found_none, found_never_left, found_spent

   !> The signal falls through zero at `time`.
   integer, parameter :: found_zero = 1
   !> No zero up to the limit.
   integer, parameter :: found_none = 2
   !> A signal that starts at zero never rises above its rounding error.
   integer, parameter :: found_never_left = 3
   !> There is none up to `time`, where the looks that it may take are spent.
   integer, parameter :: found_spent = 4

   !> After a start at rest a signal of the order of 1 may dip so far by the rounding error of forces.
   real(wp), parameter :: deepest_dip = 1.0e-11_wp

   !> What is known of each term of a signal, column by column: its value and first two derivatives, and bounds from now
   !> on on how far it comes below zero and on the magnitudes of its second and third derivative.
   integer, parameter :: term_value = 1
   integer, parameter :: term_rate = 2
   integer, parameter :: term_curvature = 3
   integer, parameter :: bound_value = 4
   integer, parameter :: bound_curvature = 5
   integer, parameter :: bound_jerk = 6
   integer, parameter :: term_columns = 6

   !> Something that swings, with certain bounds on its derivatives.
   type, abstract :: certified_signal_t
      !> 0: s(0) > 0. k > 0: s and its first k - 1 derivatives vanish at 0, the k-th is positive
      integer :: start_order = 0
   contains
      procedure(bounds_interface), deferred :: find_bounds
      procedure :: find_bounds_without_step
      procedure(evaluate_interface), deferred :: evaluate
   end type certified_signal_t

   !> One of which parts are signals, too: what is asked of it after the search.
   type, abstract, extends(certified_signal_t) :: viewed_signal_t
   contains
      procedure(view_interface), deferred :: view
   end type viewed_signal_t

   !> Room for so many looks of a search.
   integer, parameter :: history_size = 32

   type :: search_t
      !> `found_zero`, `found_none`, `found_never_left` or `found_spent`
      integer :: outcome = found_none
      !> Where
      real(wp) :: time = 0.0_wp
      !> Greatest value seen on the way
      real(wp) :: greatest = 0.0_wp
      !> Rounding error of the value where it starts
      real(wp) :: rounding = 0.0_wp
      !> On the way it stays below this for certain, where the search could tell
      real(wp) :: ceiling = huge(1.0_wp)
      !> Sums evaluated
      integer(i8) :: evaluations = 0_i8
   end type search_t

   !> Values at one instant of a derivative of the signal (or of itself).
   type :: bounds_t
      !> That derivative and the next one
      real(wp) :: value = 0.0_wp
      real(wp) :: slope = 0.0_wp
      !> And the one after that
      real(wp) :: curvature = 0.0_wp
      !> From here on the one after never falls below minus this
      real(wp) :: bound = 0.0_wp
      !> Nor does its magnitude exceed this
      real(wp) :: bound_both = 0.0_wp
      !> Nor that of the derivative after that, if it is known
      real(wp) :: bound_jerk = huge(1.0_wp)
      !> Rounding error of the value
      real(wp) :: rounding = 0.0_wp
      !> The signal itself, its rounding error
      real(wp) :: signal = 0.0_wp
      real(wp) :: signal_rounding = 0.0_wp
      !> From here on the signal never falls below this
      real(wp) :: floor = -huge(1.0_wp)
      !> There is no zero of that derivative within this either, as the signal knows from more than the bound
      real(wp) :: free = 0.0_wp
   end type bounds_t

   !> What a search has seen of the signal itself. Before the first of these looks the signal rose, if it started at
   !> rest; behind the last it fell, if it has a zero.
   type :: search_history_t
      !> As many, in order of time; more than there is room for: not all were kept
      integer :: count = 0
      real(wp) :: time(history_size)
      type(bounds_t) :: find_bounds(history_size)
   end type search_history_t

   abstract interface
      !> Values of a derivative at an instant.
      subroutine bounds_interface(self, t, order, here)
         import :: certified_signal_t, bounds_t, wp
         implicit none (type, external)
         class(certified_signal_t), intent(in) :: self
         !> Instant
         real(wp), intent(in) :: t
         !> Which derivative, 0: the signal itself
         integer, intent(in) :: order
         !> What is there
         type(bounds_t), intent(out) :: here
      end subroutine bounds_interface

      !> The signal and its slope at an instant.
      subroutine evaluate_interface(self, t, value, slope)
         import :: certified_signal_t, wp
         implicit none (type, external)
         class(certified_signal_t), intent(in) :: self
         !> Instant
         real(wp), intent(in) :: t
         !> s and s'
         real(wp), intent(out) :: value
         real(wp), intent(out) :: slope
      end subroutine evaluate_interface

      !> offset + factor times a derivative of the signal, from an instant on.
      subroutine view_interface(self, from, factor, offset, order, part)
         import :: viewed_signal_t, wp
         implicit none (type, external)
         class(viewed_signal_t), intent(in) :: self
         !> The instant
         real(wp), intent(in) :: from
         real(wp), intent(in) :: factor
         real(wp), intent(in) :: offset
         !> 0: the signal itself, 1: its slope
         integer, intent(in) :: order
         !> The same as a signal
         class(viewed_signal_t), allocatable, intent(out) :: part
      end subroutine view_interface
   end interface

contains

   !> A look for who takes no step from it: `free` may be missing.
   subroutine find_bounds_without_step(self, t, order, here)
      class(certified_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Which derivative, 0: the signal itself
      integer, intent(in) :: order
      !> What is there
      type(bounds_t), intent(out) :: here

      call self%find_bounds(t, order, here)
   end subroutine find_bounds_without_step

   !> First zero of the signal in (0, limit].
   subroutine first_zero(signal, limit, search, history, most_evaluations, at_start)
      class(certified_signal_t), intent(in) :: signal
      !> Where the search ends
      real(wp), intent(in) :: limit
      !> What was found
      type(search_t), intent(out) :: search
      !> And seen on the way
      type(search_history_t), intent(inout), optional :: history
      !> How many it may take; default: as many as it needs
      integer(i8), intent(in), optional :: most_evaluations
      !> What `find_bounds` tells of the signal itself at 0, where it is known
      type(bounds_t), intent(in), optional :: at_start

      real(wp) :: t, before, step
      type(bounds_t) :: here
      integer(i8) :: most
      integer :: order
      logical :: is_found

      most = huge(most)
      if (present(most_evaluations)) most = most_evaluations
      t = 0.0_wp
      before = 0.0_wp
      call bounds_at_start(signal, order, here, search, at_start)
      if (present(history)) history%count = 0
      search%ceiling = merge(here%signal, huge(1.0_wp), order == 0)
      do
         search%greatest = max(search%greatest, here%signal)
         if (order > 0 .and. t > 0.0_wp) then
            call lower_order(signal, before, t, order, here, search, is_found)
            if (is_found) return
         end if
         if (present(history) .and. order == 0) call keep_look(history, t, here)
         if (order == 0 .and. falls_to_zero(here)) then
            call finish(signal, t, here, limit, search)
            return
         end if
         if (t > 0.0_wp .and. here%value <= here%rounding .and. (order > 0 .or. here%slope <= 0.0_wp)) then
            ! at zero as far as rounding can tell
            search%outcome = merge(found_never_left, found_zero, order > 0 .or. is_still_there())
            search%time = t
            return
         end if
         if (is_faint(here) .or. (order == 0 .and. here%floor > here%rounding)) then
            search%outcome = found_none
            search%time = limit
            search%ceiling = huge(1.0_wp)
            return
         end if
         ! what rises from within its rounding error by less than that is no nearer to a zero than it was
         step = max(here%free, step_without_zero(max(here%value, merge(here%rounding, 0.0_wp, t > 0.0_wp)), &
            here%slope, here%bound))
         if (order == 0) search%ceiling = max(search%ceiling, highest(here, min(step, limit - t)))
         if (t + step >= limit .or. search%evaluations >= most) then
            search%outcome = merge(found_none, found_spent, t + step >= limit)
            search%time = min(t + step, limit)
            return
         end if
         if (.not. t + step > t) then
            ! no room left between the instants that can be told apart
            search%outcome = merge(found_never_left, found_zero, order > 0 .or. is_still_there())
            search%time = t
            return
         end if
         before = t
         t = t + step
         call signal%find_bounds(t, order, here)
         search%evaluations = search%evaluations + 1_i8
      end do

   contains

      !> From its start at zero the signal did not get beyond its rounding error.
      pure function is_still_there() result(is)
         logical :: is

         is = signal%start_order > 0 .and. here%signal <= here%signal_rounding .and. &
            search%greatest <= 4.0_wp*here%signal_rounding
      end function is_still_there
   end subroutine first_zero

   !> Keep a look at a later time than those before.
   pure subroutine keep_look(history, t, here)
      type(search_history_t), intent(inout) :: history
      real(wp), intent(in) :: t
      !> Values of the signal
      type(bounds_t), intent(in) :: here

      history%count = history%count + 1
      if (history%count > history_size) return
      history%time(history%count) = t
      history%find_bounds(history%count) = here
   end subroutine keep_look

   !> What a signal does not exceed within a step.
   elemental function highest(here, step) result(bound)
      !> Values of the signal at its start
      type(bounds_t), intent(in) :: here
      real(wp), intent(in) :: step
      real(wp) :: bound

      real(wp) :: bend, length, slope

      slope = max(here%slope, 0.0_wp)
      bend = here%bound_both
      if (here%bound_jerk < sqrt(huge(1.0_wp))) bend = min(bend, here%curvature + step*here%bound_jerk)
      ! of a parabola that is bent downwards, its top
      length = step
      if (slope < -step*bend) length = -slope/bend
      bound = here%value + here%rounding + length*(slope + 0.5_wp*length*bend)
   end function highest

   !> From a zero the search marches on the derivative that is positive there: while it is, so is all below it.
   subroutine bounds_at_start(signal, order, here, search, known)
      class(certified_signal_t), intent(in) :: signal
      !> Which derivative; 0: the signal itself
      integer, intent(out) :: order
      !> Its values
      type(bounds_t), intent(out) :: here
      !> Counts the looks
      type(search_t), intent(inout) :: search
      !> Those of the signal itself
      type(bounds_t), intent(in), optional :: known

      type(bounds_t) :: lower

      order = signal%start_order
      if (order == 1) order = 0
      if (present(known) .and. order == 0) then
         here = known
      else
         call signal%find_bounds(0.0_wp, order, here)
      end if
      search%evaluations = 1_i8
      search%rounding = here%signal_rounding
      if (signal%start_order > 0) then
         here%signal = 0.0_wp
         if (order == 0) here%value = 0.0_wp
      end if
      if (order > 2 .and. here%value <= 64.0_wp*here%rounding) then
         ! where stiff modes creep the derivative below decides
         call signal%find_bounds(0.0_wp, order - 1, lower)
         search%evaluations = search%evaluations + 1_i8
         if (lower%value > 64.0_wp*lower%rounding) then
            order = order - 1
            here = lower
            here%signal = 0.0_wp
         end if
      end if
   end subroutine bounds_at_start

   !> March on a lower derivative, or on the signal, as soon as it exceeds its rounding error.
   subroutine lower_order(signal, before, t, order, here, search, is_found)
      class(certified_signal_t), intent(in) :: signal
      !> The last instant but one, and the last
      real(wp), intent(in) :: before
      real(wp), intent(in) :: t
      !> Which derivative, > 0
      integer, intent(inout) :: order
      !> Its values
      type(bounds_t), intent(inout) :: here
      type(search_t), intent(inout) :: search
      !> The signal has a zero before t
      logical, intent(out) :: is_found

      type(bounds_t) :: lower

      is_found = here%signal < -max(deepest_dip, 64.0_wp*here%signal_rounding)
      if (is_found) then
         ! what should have lifted it was lost in the rounding error of forces
         search%outcome = found_zero
         search%time = start_of_dip(signal, before, t)
      else if (here%signal > 64.0_wp*here%signal_rounding) then
         order = 0
         call signal%find_bounds(t, order, here)
         search%evaluations = search%evaluations + 1_i8
      else if (order > 1) then
         call signal%find_bounds(t, order - 1, lower)
         search%evaluations = search%evaluations + 1_i8
         if (lower%value > 64.0_wp*lower%rounding) then
            order = order - 1
            here = lower
         end if
      end if
   end subroutine lower_order

   !> Has the signal died away so far that its digits underflow?
   elemental function is_faint(here) result(is)
      !> Values of the signal
      type(bounds_t), intent(in) :: here
      logical :: is

      real(wp), parameter :: least = tiny(1.0_wp)/epsilon(1.0_wp)

      is = max(abs(here%value), abs(here%slope), here%bound) < least
   end function is_faint

   !> Where a signal sinks through -`deepest_dip`, by bisection.
   function start_of_dip(signal, above, below) result(time)
      class(certified_signal_t), intent(in) :: signal
      !> Instants at which it is above and below
      real(wp), intent(in) :: above
      real(wp), intent(in) :: below
      real(wp) :: time

      type(bracket_t) :: bracket
      real(wp) :: value, slope

      bracket = bracket_t(low=above, high=below, least_value=-1.0_wp, most_evaluations=40)
      call go_to(bracket)
      do while (.not. bracket%is_found)
         call signal%evaluate(bracket%point, value, slope)
         call enter(bracket, value + deepest_dip)
         call go_to(bracket)
      end do
      time = bracket%high
   end function start_of_dip

   !> Is it certain that the signal falls, without a turn, until it is zero?
   elemental function falls_to_zero(here) result(certain)
      !> Values of the signal
      type(bounds_t), intent(in) :: here
      logical :: certain

      ! below this squares underflow, and with them bounds
      real(wp), parameter :: least_slope = 1.0e-140_wp

      certain = here%slope < -least_slope .and. here%value > 0.0_wp
      if (certain) certain = here%slope**2 > 4.0_wp*upper_bound(here)*here%value
   end function falls_to_zero

   !> Bound, >= 0, from above on the second derivative for twice as long as the signal would take to zero at its slope.
   elemental function upper_bound(here) result(bound)
      !> Values of the signal; the slope is negative
      type(bounds_t), intent(in) :: here
      real(wp) :: bound

      bound = here%bound_both
      if (here%bound_jerk < huge(1.0_wp)) then
         bound = min(bound, max(0.0_wp, here%curvature - 2.0_wp*here%bound_jerk*here%value/here%slope))
      end if
   end function upper_bound

   !> Positive root h of value + slope h - bound h^2/2 = 0, without cancellation; no more than 1e290, which a value that
   !> nothing moves comes near.
   elemental function step_without_zero(value, slope, bound) result(step)
      !> Value, >= 0
      real(wp), intent(in) :: value
      !> Slope
      real(wp), intent(in) :: slope
      !> Bound on the second derivative, >= 0
      real(wp), intent(in) :: bound
      real(wp) :: step

      ! below this a bound times a value would vanish
      real(wp), parameter :: least_bound = 1.0e-280_wp
      real(wp) :: root, curvature

      curvature = max(bound, least_bound)
      ! without branches, for loops over many: the numerator and the denominator are chosen, not the quotient
      root = abs(slope) + sqrt(slope**2 + 2.0_wp*curvature*value)
      step = merge(root, 2.0_wp*value, slope >= 0.0_wp)
      step = step/max(merge(curvature, root, slope >= 0.0_wp), 1.0e-290_wp*step, tiny(1.0_wp))
   end function step_without_zero

   !> The slope keeps its sign up to a zero that is certain to come: inverse interpolation inside a bracket.
   subroutine finish(signal, start, at_start, limit, search)
      class(certified_signal_t), intent(in) :: signal
      !> Where the certificate was given
      real(wp), intent(in) :: start
      !> Values there, which fall to zero for certain
      type(bounds_t), intent(in) :: at_start
      !> Where the search ends
      real(wp), intent(in) :: limit
      !> What was found
      type(search_t), intent(inout) :: search

      type(bracket_t) :: bracket
      real(wp) :: t, value, slope, t_before, value_before, slope_before

      associate (value => at_start%value, slope => at_start%slope)
         bracket%low = start + 2.0_wp*value/(sqrt(slope**2 + 2.0_wp*at_start%bound_both*value) - slope)
         bracket%high = start + 2.0_wp*value/(sqrt(slope**2 - 2.0_wp*upper_bound(at_start)*value) - slope)
         bracket%high = bracket%high + 4.0_wp*spacing(bracket%high)
         ! the zero of the parabola through value, slope and curvature
         t = start + 2.0_wp*value/(sqrt(slope**2 - 2.0_wp*at_start%curvature*value) - slope)
      end associate
      bracket%neighbours = 2.0_wp
      bracket%least_value = max(0.25_wp*at_start%rounding, tiny(1.0_wp))
      bracket%most_evaluations = 100
      bracket%point = min(max(t, bracket%low), bracket%high)
      t_before = start
      value_before = at_start%value
      slope_before = at_start%slope
      do while (.not. bracket%is_found)
         t = bracket%point
         call signal%evaluate(t, value, slope)
         search%evaluations = search%evaluations + 1_i8
         call enter(bracket, value)
         call go_to(bracket, t + return_step(t - t_before, value_before, slope_before, value, slope))
         t_before = t
         value_before = value
         slope_before = slope
      end do
      search%time = t
      search%outcome = found_zero
      if (t > limit) then
         search%time = limit
         search%outcome = found_none
      end if
   end subroutine finish

   !> From the second of two points to where the cubic through them, time over value, has value zero; Newton's step
   !> where they are no good for that.
   elemental function return_step(distance, value_before, slope_before, value, slope) result(step)
      !> Time between the points
      real(wp), intent(in) :: distance
      !> Values and slopes there
      real(wp), intent(in) :: value_before
      real(wp), intent(in) :: slope_before
      real(wp), intent(in) :: value
      real(wp), intent(in) :: slope
      real(wp) :: step

      real(wp) :: share, fall

      step = -value/slope
      fall = value - value_before
      if (.not. (slope < 0.0_wp .and. slope_before < 0.0_wp .and. abs(value) < 0.5_wp*abs(fall))) return
      share = value/fall
      ! Hermite's polynomial, counted from the second point
      step = step - share**2*(distance*(3.0_wp - 2.0_wp*share) - fall*(2.0_wp/slope + 1.0_wp/slope_before) &
         + share*fall*(1.0_wp/slope + 1.0_wp/slope_before))
   end function return_step

end module certified_search
