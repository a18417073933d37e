!> The maximum gap of a flight (motion with the contact open). The search for the end of the flight has recorded its
!> evaluations; from these and two or three further evaluations the maximum follows.
module flight_peaks
   use certified_search, only: bounds_t, history_size, search_history_t, transformable_signal_t
   use kinds, only: wp
   use row_peaks, only: highest_point
   use row_signals, only: bernstein_coefficients
   use signal_peaks, only: peak_tolerance
   implicit none (type, external)
   private
   public :: find_peak

contains

   !> The maximum of a signal between two zeros. If it is certain, no value of the signal exceeds it by more than the
   !> fraction `peak_tolerance`. An evaluation above the local maximum leads to a higher one.
   subroutine find_peak(signal, history, is_certain, peak, time)
      class(transformable_signal_t), intent(in) :: signal
      !> Evaluations of the search for the second zero; further evaluations are inserted
      type(search_history_t), intent(inout) :: history
      !> False: there may be a higher maximum
      logical, intent(out) :: is_certain
      !> The maximum
      real(wp), intent(out) :: peak
      !> Instant of the maximum
      real(wp), intent(out) :: time

      integer, parameter :: max_evaluations = 16
      real(wp) :: level
      type(bounds_t) :: bounds
      integer :: evaluations, place

      call find_local_maximum(signal, history, is_certain, peak, time)
      level = peak*(1.0_wp + peak_tolerance)
      evaluations = 0
      place = 1
      do while (is_certain)
         place = place_above(history, level, place)
         if (place == 0) return
         evaluations = evaluations + 1
         is_certain = evaluations <= max_evaluations .and. history%count < history_size
         if (.not. is_certain) return
         associate (t => 0.5_wp*(history%time(place) + history%time(place + 1)))
            call signal%find_bounds(t, 0, bounds, needs_step=.false.)
            call insert(history, place + 1, t, bounds)
         end associate
         if (bounds%value < level) cycle
         call find_local_maximum(signal, history, is_certain, peak, time)
         level = peak*(1.0_wp + peak_tolerance)
         place = 1
      end do
   end subroutine find_peak

   !> Index of the first evaluation such that a signal may reach a level before the next evaluation; 0: none.
   pure integer function place_above(history, level, first) result(place)
      type(search_history_t), intent(in) :: history
      real(wp), intent(in) :: level
      !> Index at which to begin
      integer, intent(in) :: first

      do place = first, history%count - 1
         if (.not. stays_below(level, history%time(place + 1) - history%time(place), history%bounds(place), &
            history%bounds(place + 1))) return
      end do
      place = 0
   end function place_above

   !> Find the local maximum next to the highest evaluation by iteration on the slope, and insert it into the history.
   subroutine find_local_maximum(signal, history, is_found, peak, time)
      class(transformable_signal_t), intent(in) :: signal
      type(search_history_t), intent(inout) :: history
      logical, intent(out) :: is_found
      real(wp), intent(out) :: peak
      real(wp), intent(out) :: time

      integer, parameter :: max_evaluations = 12
      type(bounds_t) :: bounds
      real(wp) :: from, step, to
      integer :: k, place

      peak = 0.0_wp
      time = 0.0_wp
      is_found = .false.
      call bracket_maximum(signal, history, place)
      if (place == 0) return
      from = history%time(place)
      to = history%time(place + 1)
      associate (earlier => history%bounds(place), later => history%bounds(place + 1))
         ! the quintic through the values, slopes and second derivatives of both evaluations
         time = from + (to - from)*highest_point(bernstein_coefficients([earlier%value, earlier%slope, &
            earlier%curvature], [later%value, later%slope, later%curvature], to - from))
      end associate
      do k = 1, max_evaluations
         ! `bounds` of order 1: `value` is the slope of the signal, `slope` its second, `curvature` its third derivative
         call signal%find_bounds(time, 1, bounds, needs_step=.false.)
         if (bounds%value > 0.0_wp) from = time
         if (bounds%value <= 0.0_wp) to = time
         step = step_to_maximum(bounds)
         ! converged: the parabola of the slope is exact to the rounding error of the slope
         is_found = abs(step) <= 2.0_wp*spacing(time) .or. (time + step > from .and. time + step < to .and. &
            min(bounds%bound_jerk, 1.0e100_wp)*abs(step)**3 <= bounds%rounding)
         if (is_found) exit
         time = time + step
         if (.not. (time > from .and. time < to)) time = 0.5_wp*(from + to)
      end do
      if (.not. is_found) return
      time = time + step
      peak = bounds%signal + step*(bounds%value + step*(bounds%slope/2.0_wp + step*bounds%curvature/6.0_wp))
      bounds = bounds_t(value=peak, curvature=bounds%slope + step*bounds%curvature, &
         bound_jerk=history%bounds(place)%bound_jerk)
      call insert(history, place + 1, time, bounds)
   end subroutine find_local_maximum

   !> Find two successive evaluations, the highest of all and a neighbour, between which the slope changes from + to -.
   subroutine bracket_maximum(signal, history, place)
      class(transformable_signal_t), intent(in) :: signal
      !> Further evaluations are inserted
      type(search_history_t), intent(inout) :: history
      !> Index of the earlier of the two evaluations; 0: not found
      integer, intent(out) :: place

      integer, parameter :: max_evaluations = 4
      type(bounds_t) :: bounds
      real(wp) :: t
      integer :: k

      do k = 0, max_evaluations
         place = 0
         if (history%count < 2 .or. history%count >= history_size - 1) return
         place = maxloc(history%bounds(:history%count)%value, 1)
         if (history%bounds(place)%slope < 0.0_wp) place = place - 1
         if (place == history%count) place = 0
         if (place == 0) return
         if (history%bounds(place)%slope > 0.0_wp .and. history%bounds(place + 1)%slope < 0.0_wp) return
         t = 0.5_wp*(history%time(place) + history%time(place + 1))
         call signal%find_bounds(t, 0, bounds, needs_step=.false.)
         call insert(history, place + 1, t, bounds)
      end do
      place = 0
   end subroutine bracket_maximum

   !> Step to the maximum of a signal: to the zero of the parabola that its slope and the first two derivatives of the
   !> slope define.
   elemental real(wp) function step_to_maximum(bounds) result(step)
      !> Bounds of order 1: the slope of the signal and its derivatives
      type(bounds_t), intent(in) :: bounds

      ! marks a step that does not exist; its cube does not overflow
      real(wp), parameter :: no_step = 1.0e50_wp
      real(wp) :: radicand

      step = no_step
      radicand = bounds%slope**2 - 2.0_wp*bounds%value*bounds%curvature
      if (bounds%slope < 0.0_wp .and. radicand > 0.0_wp) step = 2.0_wp*bounds%value/(sqrt(radicand) - bounds%slope)
   end function step_to_maximum

   !> Whether a signal certainly stays below a level between two evaluations. The time between them is divided at one of
   !> 17 instants. Before this instant a cubic from the earlier evaluation lies above the signal, after this instant a
   !> cubic from the later evaluation, both with the bound on the third derivative; the maximum Bernstein coefficient
   !> lies above each cubic.
   pure logical function stays_below(level, distance, earlier, later) result(is)
      real(wp), intent(in) :: level
      real(wp), intent(in) :: distance
      !> The earlier evaluation
      type(bounds_t), intent(in) :: earlier
      !> The later evaluation
      type(bounds_t), intent(in) :: later

      integer, parameter :: divisions = 16
      ! instants in the order of trials: the middle decides most intervals
      integer, parameter :: place(0:divisions) = [8, 4, 12, 0, 16, 2, 6, 10, 14, 1, 3, 5, 7, 9, 11, 13, 15]
      real(wp) :: from_left, from_right, jerk, left, right
      integer :: j

      ! An unknown bound is huge: its products must not overflow
      jerk = min(earlier%bound_jerk, 1.0e100_wp)
      is = .false.
      do j = 0, divisions
         left = distance*real(place(j), wp)/real(divisions, wp)
         right = distance - left
         from_left = bernstein_maximum(earlier%value, earlier%slope, earlier%curvature, jerk, left)
         from_right = bernstein_maximum(later%value, -later%slope, later%curvature, jerk, right)
         is = max(from_left, from_right) < level
         if (is) return
      end do
   end function stays_below

   !> The maximum Bernstein coefficient of a cubic on [0, length], an upper bound of the cubic.
   elemental real(wp) function bernstein_maximum(value, slope, curvature, jerk, length) result(top)
      real(wp), intent(in) :: value
      real(wp), intent(in) :: slope
      real(wp), intent(in) :: curvature
      real(wp), intent(in) :: jerk
      real(wp), intent(in) :: length

      real(wp) :: curvature_term

      curvature_term = length**2*curvature
      top = max(value, value + length*slope/3.0_wp, value + length*slope*(2.0_wp/3.0_wp) + curvature_term/6.0_wp, &
         value + length*slope + 0.5_wp*curvature_term + length**3*jerk/6.0_wp)
   end function bernstein_maximum

   !> Insert an evaluation at an index of the history.
   pure subroutine insert(history, place, t, bounds)
      type(search_history_t), intent(inout) :: history
      integer, intent(in) :: place
      real(wp), intent(in) :: t
      type(bounds_t), intent(in) :: bounds

      integer :: i

      do i = history%count, place, -1
         history%time(i + 1) = history%time(i)
         history%bounds(i + 1) = history%bounds(i)
      end do
      history%time(place) = t
      history%bounds(place) = bounds
      history%count = history%count + 1
   end subroutine insert

end module flight_peaks
