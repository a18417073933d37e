!> How a contact closes, for either method: its bounces, from the events of the run, and its force after the final
!> closing, from intervals of the motion (docs/theory.md, section 12).
!>
!> The final closing is the instant from which the contact is closed to the end of the run. The bounce time lasts from
!> the first to the final closing, as for relays; the last opening precedes the final closing by one flight. A contact
!> that is closed at rest at the start first closes after its first opening, which is the stroke of the actuator and no
!> bounce.
module closing_measures
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kinds, only: wp
   use motion_intervals, only: interval_t, observed_contact_t, output_row_t, peak_t
   use response_types, only: closing_measures_t, event_impact, is_closed_start, is_contact_end, &
      is_contact_start, response_t
   use run_measures, only: accumulator_t, comes_to_rest
   use run_settings, only: relay_settings_t
   use signal_peaks, only: extreme_search_t
   implicit none (type, external)
   private
   public :: closing_t, record_closing, find_closing

   !> Force of a contact since its last closing. The type has no allocatable components, so that a copy restores it when
   !> a run returns to an earlier state.
   type :: closing_t
      !> Whether the contact is closed
      logical :: is_closed = .false.
      !> Number of flights before this closing
      integer :: flights = 0
      !> Whether the force has a finite maximum
      logical :: has_finite_force = .false.
      !> Maximum of the force since the closing
      real(wp) :: maximum = -huge(1.0_wp)
      !> Minimum of the force since that maximum
      real(wp) :: minimum = huge(1.0_wp)
      !> Whether the force is at least the `lasting_force` of &relay
      logical :: lasts = .false.
      !> Instant since which the force has been at least the `lasting_force`, tau
      real(wp) :: lasts_from = 0.0_wp
      !> Tolerances of the searches for the minimum (1) and for the maximum (2), and number of evaluations that remain
      !> for them
      type(extreme_search_t) :: search_state(2)
   end type closing_t

contains

   !> Record the force of a contact during an interval.
   subroutine record_closing(interval, k, contact, lasting_force, closing)
      class(interval_t), intent(inout) :: interval
      integer, intent(in) :: k
      !> Status of contact k
      type(observed_contact_t), intent(in) :: contact
      !> `lasting_force` of &relay, in the unit of forces; 0: not given
      real(wp), intent(in) :: lasting_force
      type(closing_t), intent(inout) :: closing

      if (.not. contact%is_closed) then
         closing%is_closed = .false.
         closing%lasts = .false.
         return
      end if
      if (.not. closing%is_closed .or. closing%flights /= contact%flights) closing = closing_t(is_closed=.true., &
         flights=contact%flights, search_state=closing%search_state)
      closing%has_finite_force = contact%has_finite_force
      if (.not. (closing%has_finite_force .and. interval%length > 0.0_wp)) return
      call record_extremes(interval, interval%force_row(k), closing)
      if (lasting_force > 0.0_wp) call record_duration(interval, interval%force_row(k), lasting_force, closing)
   end subroutine record_closing

   !> Update the maximum of the force since the closing, and the minimum since that maximum.
   subroutine record_extremes(interval, row, closing)
      class(interval_t), intent(inout) :: interval
      !> Row of the force
      integer, intent(in) :: row
      type(closing_t), intent(inout) :: closing

      type(peak_t) :: peak
      ! value and rate of the force at both ends of the interval
      real(wp) :: state(2, 2)
      ! time in the interval after which the minimum is searched: that of the maximum since the closing, 0 if the
      ! maximum was reached before the interval
      real(wp) :: from

      state(:, 1) = interval%evaluate(output_row_t(row), 0.0_wp)
      state(:, 2) = interval%evaluate(output_row_t(row), interval%length)
      from = 0.0_wp
      if (state(1, 1) > closing%maximum) call raise(state(1, 1), 0.0_wp)
      if (state(1, 2) > closing%maximum) call raise(state(1, 2), interval%length)
      call interval%seek_peak(output_row_t(row, scale=abs(closing%maximum), needs_time=.true.), &
         [0.0_wp, interval%length], closing%maximum, peak, closing%search_state(2))
      if (peak%is_found) call raise(peak%value, peak%time)
      if (.not. from < interval%length) return
      closing%minimum = min(closing%minimum, state(1, 2))
      call interval%seek_peak(output_row_t(row, -1.0_wp, scale=abs(closing%maximum)), [from, interval%length], &
         -closing%minimum, peak, closing%search_state(1))
      if (peak%is_found) closing%minimum = -peak%value

   contains

      !> Store a higher maximum. The minimum is then that of the time after this maximum.
      subroutine raise(value, time)
         real(wp), intent(in) :: value
         !> Time since the start of the interval
         real(wp), intent(in) :: time

         closing%maximum = value
         closing%minimum = value
         from = time
      end subroutine raise
   end subroutine record_extremes

   !> Update the instant since which the contact force has been at least a given force.
   subroutine record_duration(interval, row, force, closing)
      class(interval_t), intent(inout) :: interval
      !> Row of the contact force
      integer, intent(in) :: row
      !> The given force
      real(wp), intent(in) :: force
      type(closing_t), intent(inout) :: closing

      type(peak_t) :: peak
      type(output_row_t) :: deficit
      type(extreme_search_t) :: search_state
      real(wp) :: state(2), low, high, middle

      ! the given force less the contact force
      deficit = output_row_t(row, -1.0_wp, force)
      state = interval%evaluate(deficit, interval%length)
      if (state(1) > 0.0_wp) then
         closing%lasts = .false.
         return
      end if
      call interval%seek_peak(deficit, [0.0_wp, interval%length], 0.0_wp, peak, search_state)
      if (.not. peak%is_found) then
         if (.not. closing%lasts) closing%lasts_from = interval%start
         closing%lasts = .true.
         return
      end if
      ! bisection: the deficit is positive at `low`, and not positive at `high` and later
      low = peak%time
      high = interval%length
      do
         middle = low + 0.5_wp*(high - low)
         if (middle <= low .or. middle >= high) exit
         if (high - low <= 2.0_wp*epsilon(1.0_wp)*(interval%start + high)) exit
         call interval%seek_peak(deficit, [middle, high], 0.0_wp, peak, search_state)
         if (peak%is_found) then
            low = max(middle, peak%time)
         else
            high = middle
         end if
      end do
      closing%lasts_from = interval%start + high
      closing%lasts = .true.
   end subroutine record_duration

   !> Find the measures of a contact's closing at the end of the run.
   subroutine find_closing(closing, response, number, duration, accumulator, relay, measures)
      type(closing_t), intent(in) :: closing
      !> The run, with its events
      type(response_t), intent(in) :: response
      !> Number of the contact
      integer, intent(in) :: number
      !> Duration of the run, tau
      real(wp), intent(in) :: duration
      !> Sums of the contact, with its static force
      type(accumulator_t), intent(in) :: accumulator
      type(relay_settings_t), intent(in) :: relay
      type(closing_measures_t), allocatable, intent(out) :: measures

      real(wp) :: nan
      ! the contact has opened since the final closing, for less than the shortest opening that counts
      logical :: has_short_opening

      nan = ieee_value(1.0_wp, ieee_quiet_nan)
      allocate (measures)
      call count_bounces(response, number, duration, relay%shortest_opening, measures, has_short_opening)
      measures%has_lasting_force = relay%lasting_force > 0.0_wp
      measures%minimum_force = nan
      measures%static_force = nan
      measures%force_lasts = nan
      if (comes_to_rest(accumulator)) measures%static_force = accumulator%force_scale*accumulator%rest_force
      if (.not. closing%is_closed) return
      if (closing%has_finite_force) measures%minimum_force = merge(0.0_wp, accumulator%force_scale*closing%minimum, &
         has_short_opening)
      if (closing%lasts) measures%force_lasts = closing%lasts_from
   end subroutine find_closing

   !> Bounces, bounce time, last opening and final closing from the events. An impact on a rigid stop is a closing and
   !> an opening at the same instant; if its flight is discarded, a capture at this instant follows, and the contact has
   !> not opened. The contact counts as closed during an opening that is too short to count.
   subroutine count_bounces(response, number, duration, shortest, measures, has_short_opening)
      type(response_t), intent(in) :: response
      !> Number of the contact
      integer, intent(in) :: number
      !> Duration of the run, tau
      real(wp), intent(in) :: duration
      !> Duration of the shortest opening that counts, tau
      real(wp), intent(in) :: shortest
      type(closing_measures_t), intent(inout) :: measures
      !> Whether the contact has opened since the final closing, for less than the shortest duration
      logical, intent(out) :: has_short_opening

      real(wp) :: first_closing, opened
      ! whether the contact has closed at least once, and whether it is closed now
      logical :: has_closed, is_closed
      ! the contact has been closed since the start, except for openings that are too short
      logical :: is_initial
      integer :: i

      measures%last_opening = ieee_value(1.0_wp, ieee_quiet_nan)
      measures%final_closing = measures%last_opening
      measures%bounce_time = measures%last_opening
      first_closing = 0.0_wp
      opened = 0.0_wp
      has_closed = .false.
      has_short_opening = .false.
      is_closed = .false.
      is_initial = .false.
      if (allocated(response%starts_closed)) is_closed = response%starts_closed(number)
      do i = 1, response%event_count
         associate (event => response%events(i))
            if (event%contact /= number) cycle
            if (.not. has_closed) is_initial = is_closed_start(event)
            if (event%kind == event_impact .or. is_contact_start(event%kind)) call close_at(event%tau)
            if (event%kind /= event_impact .and. .not. is_contact_end(event%kind)) cycle
            is_closed = .false.
            opened = event%tau
         end associate
      end do
      if (.not. has_closed) return
      if (.not. is_closed) then
         call end_opening(duration)
         if (.not. has_short_opening) measures%final_closing = ieee_value(1.0_wp, ieee_quiet_nan)
      end if
      measures%bounce_time = measures%final_closing - first_closing

   contains

      !> Close the contact at an instant.
      subroutine close_at(tau)
         real(wp), intent(in) :: tau

         if (.not. has_closed) then
            first_closing = tau
            measures%final_closing = tau
         else if (.not. is_closed .and. tau > opened) then
            call end_opening(tau)
         end if
         has_closed = .true.
         is_closed = .true.
      end subroutine close_at

      !> Count the opening that ends at an instant, unless it is too short, or the first after a closed start.
      subroutine end_opening(tau)
         real(wp), intent(in) :: tau

         has_short_opening = tau - opened < shortest
         if (has_short_opening) return
         measures%final_closing = tau
         if (is_initial) then
            is_initial = .false.
            first_closing = tau
            return
         end if
         measures%bounces = measures%bounces + 1
         measures%last_opening = opened
      end subroutine end_opening
   end subroutine count_bounces

end module closing_measures
