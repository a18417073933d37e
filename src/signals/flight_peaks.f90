!> The peak of a flight from what the search for its end has seen: two or three looks more, instead of searches.
module flight_peaks
   use certified_search, only: bounds_t, history_size, search_history_t, viewed_signal_t
   use kinds, only: wp
   use signal_peaks, only: peak_tolerance
   implicit none (type, external)
   private
   public :: find_peak

contains

   !> The greatest value between two zeros of a signal, certain within `peak_tolerance`.
   subroutine find_peak(signal, history, is_certain, peak, time)
      class(viewed_signal_t), intent(in) :: signal
      !> From the search for the second zero; gets the looks that are taken
      type(search_history_t), intent(inout) :: history
      !> Else there may be a higher one
      logical, intent(out) :: is_certain
      real(wp), intent(out) :: peak
      real(wp), intent(out) :: time

      integer, parameter :: most_evaluations = 8
      real(wp) :: level
      type(bounds_t) :: here
      integer :: i, looks

      call climb(signal, history, is_certain, peak, time)
      if (.not. is_certain) return
      level = peak*(1.0_wp + peak_tolerance)
      looks = 0
      i = 1
      do while (i < history%count)
         if (stays_below(level, history%time(i + 1) - history%time(i), history%find_bounds(i), history%find_bounds(i &
            + 1))) then
            i = i + 1
            cycle
         end if
         looks = looks + 1
         is_certain = looks <= most_evaluations .and. history%count < history_size
         if (.not. is_certain) return
         associate (t => 0.5_wp*(history%time(i) + history%time(i + 1)))
            call signal%find_bounds_without_step(t, 0, here)
            call insert(history, i + 1, t, here)
         end associate
         is_certain = here%value < level
         if (.not. is_certain) return
      end do
   end subroutine find_peak

   !> To the turn next to the highest look, which joins the looks.
   subroutine climb(signal, history, is_found, peak, time)
      class(viewed_signal_t), intent(in) :: signal
      type(search_history_t), intent(inout) :: history
      logical, intent(out) :: is_found
      real(wp), intent(out) :: peak
      real(wp), intent(out) :: time

      integer, parameter :: most_evaluations = 12
      type(bounds_t) :: here
      real(wp) :: from, step, to
      integer :: k, place

      peak = 0.0_wp
      time = 0.0_wp
      is_found = .false.
      call find_turn(signal, history, place)
      if (place == 0) return
      from = history%time(place)
      to = history%time(place + 1)
      time = from + (to - from)*top_between(to - from, history%find_bounds(place), history%find_bounds(place + 1))
      do k = 1, most_evaluations
         call signal%find_bounds_without_step(time, 1, here)
         if (here%value > 0.0_wp) from = time
         if (here%value <= 0.0_wp) to = time
         step = step_to_turn(here)
         is_found = abs(step) <= 2.0_wp*spacing(time) .or. (time + step > from .and. time + step < to .and. &
            min(here%bound_jerk, 1.0e100_wp)*abs(step)**3 <= here%rounding)
         if (is_found) exit
         time = time + step
         if (.not. (time > from .and. time < to)) time = 0.5_wp*(from + to)
      end do
      if (.not. is_found) return
      time = time + step
      peak = here%signal + step*(here%value + step*(here%slope/2.0_wp + step*here%curvature/6.0_wp))
      here = bounds_t(value=peak, curvature=here%slope + step*here%curvature, &
         bound_jerk=history%find_bounds(place)%bound_jerk)
      call insert(history, place + 1, time, here)
   end subroutine climb

   !> Two looks next to each other, one of them the highest, between which the signal turns downwards.
   subroutine find_turn(signal, history, place)
      class(viewed_signal_t), intent(in) :: signal
      !> Gets the looks that are taken
      type(search_history_t), intent(inout) :: history
      !> The former of them, 0: not found
      integer, intent(out) :: place

      integer, parameter :: most_evaluations = 4
      type(bounds_t) :: here
      real(wp) :: t
      integer :: k

      do k = 0, most_evaluations
         place = 0
         if (history%count < 2 .or. history%count >= history_size - 1) return
         place = maxloc(history%find_bounds(:history%count)%value, 1)
         if (history%find_bounds(place)%slope < 0.0_wp) place = place - 1
         if (place == history%count) place = 0
         if (place == 0) return
         if (history%find_bounds(place)%slope > 0.0_wp .and. history%find_bounds(place + 1)%slope < 0.0_wp) return
         t = 0.5_wp*(history%time(place) + history%time(place + 1))
         call signal%find_bounds_without_step(t, 0, here)
         call insert(history, place + 1, t, here)
      end do
      place = 0
   end subroutine find_turn

   !> To where the parabola through the slope, its slope and its curvature is zero.
   elemental function step_to_turn(here) result(step)
      !> Values of the signal's slope
      type(bounds_t), intent(in) :: here
      real(wp) :: step

      ! a step of this length leads nowhere; its cube is a number
      real(wp), parameter :: far = 1.0e50_wp
      real(wp) :: root

      step = far
      root = here%slope**2 - 2.0_wp*here%value*here%curvature
      if (here%slope < 0.0_wp .and. root > 0.0_wp) step = 2.0_wp*here%value/(sqrt(root) - here%slope)
   end function step_to_turn

   !> Where between two looks the cubic through their values and slopes is highest, as a share of their distance.
   pure function top_between(distance, low, high) result(share)
      real(wp), intent(in) :: distance
      !> It rises
      type(bounds_t), intent(in) :: low
      !> It falls
      type(bounds_t), intent(in) :: high
      real(wp) :: share

      real(wp) :: bend, mean, middle

      mean = (high%value - low%value)/distance
      ! its slope is s + 2 m x + b x^2
      middle = 3.0_wp*mean - 2.0_wp*low%slope - high%slope
      bend = 3.0_wp*(low%slope + high%slope - 2.0_wp*mean)
      share = low%slope/(sqrt(max(middle**2 - bend*low%slope, 0.0_wp)) - middle)
      if (.not. (share > 0.0_wp .and. share < 1.0_wp)) share = 0.5_wp
   end function top_between

   !> Does a signal stay below a level between two looks? From either side a cubic is above it, and that no higher than
   !> its coefficients in Bernstein's form.
   pure function stays_below(level, distance, low, high) result(is)
      real(wp), intent(in) :: level
      real(wp), intent(in) :: distance
      !> The looks
      type(bounds_t), intent(in) :: low
      type(bounds_t), intent(in) :: high
      logical :: is

      integer, parameter :: parts = 16
      real(wp) :: from_left, from_right, jerk, left, right
      integer :: j

      jerk = min(low%bound_jerk, 1.0e100_wp)
      is = .false.
      do j = 0, parts
         left = distance*real(j, wp)/real(parts, wp)
         right = distance - left
         from_left = top_of(low%value, low%slope, low%curvature, jerk, left)
         from_right = top_of(high%value, -high%slope, high%curvature, jerk, right)
         is = is .or. max(from_left, from_right) < level
      end do
   end function stays_below

   !> A cubic does not come above this.
   elemental function top_of(value, slope, curvature, jerk, length) result(top)
      real(wp), intent(in) :: value
      real(wp), intent(in) :: slope
      real(wp), intent(in) :: curvature
      real(wp), intent(in) :: jerk
      real(wp), intent(in) :: length
      real(wp) :: top

      real(wp) :: bend

      bend = length**2*curvature
      top = max(value, value + length*slope/3.0_wp, value + length*slope*(2.0_wp/3.0_wp) + bend/6.0_wp, &
         value + length*slope + 0.5_wp*bend + length**3*jerk/6.0_wp)
   end function top_of

   !> Put a look among the others.
   pure subroutine insert(history, place, t, here)
      type(search_history_t), intent(inout) :: history
      integer, intent(in) :: place
      real(wp), intent(in) :: t
      type(bounds_t), intent(in) :: here

      integer :: i

      do i = history%count, place, -1
         history%time(i + 1) = history%time(i)
         history%find_bounds(i + 1) = history%find_bounds(i)
      end do
      history%time(place) = t
      history%find_bounds(place) = here
      history%count = history%count + 1
   end subroutine insert

end module flight_peaks
