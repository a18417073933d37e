!> The greatest value of a signal and the last time it was above a level, certain like the search for its zeros.
module signal_peaks
   use certified_search, only: first_zero, found_never_left, found_none, found_zero, local_t, search_t, viewed_signal_t
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: exceeds, greatest_value, last_time_above, peak_tolerance, size_of_terms

   !> A higher peak in the same phase is missed only if it is higher by less than this share.
   real(wp), parameter :: peak_tolerance = 1.0e-6_wp

contains

   !> Does a signal exceed a level in a phase?
   function exceeds(signal, length, level) result(does)
      class(viewed_signal_t), intent(in) :: signal
      !> Length of the phase
      real(wp), intent(in) :: length
      real(wp), intent(in) :: level
      logical :: does

      class(viewed_signal_t), allocatable :: below
      type(search_t) :: search
      real(wp) :: value, slope

      call signal%evaluate(0.0_wp, value, slope)
      does = value > level
      if (does) return
      call signal%view(0.0_wp, -1.0_wp, level, 0, below)
      call first_zero(below, length, search)
      does = search%outcome == found_zero
   end function exceeds

   !> The greatest value of a signal in a phase, if it exceeds a threshold.
   !>
   !> Where the signal is proven to stay below the best value known it is not looked into; where it comes up to it,
   !> the next turn gives a better one. Where ripples on a rise make many turns, samples ahead tell how far it goes.
   subroutine greatest_value(signal, length, threshold, exceeds, still_rises, value, time, scale)
      !> The signal, without a surface that relaxes
      class(viewed_signal_t), intent(in) :: signal
      !> Length of the phase
      real(wp), intent(in) :: length
      !> What it must exceed
      real(wp), intent(in) :: threshold
      !> It does
      logical, intent(out) :: exceeds
      !> The greatest value is that at the end of the phase
      logical, intent(out) :: still_rises
      !> The greatest value (within `peak_tolerance`) and its time
      real(wp), intent(out) :: value
      real(wp), intent(out) :: time
      !> A value by which the tolerance goes, too, where the signal is near zero; default: it does not
      real(wp), intent(in), optional :: scale

      integer, parameter :: cap = 10000
      class(viewed_signal_t), allocatable :: part
      type(search_t) :: search
      real(wp) :: least, level, slope, t, turn
      integer :: attempt

      least = 0.0_wp
      if (present(scale)) least = scale
      exceeds = .false.
      still_rises = .false.
      value = threshold
      time = 0.0_wp
      level = threshold
      if (least > 0.0_wp) level = raised(threshold, least)
      t = 0.0_wp
      call signal%evaluate(t, turn, slope)
      if (turn > threshold) then
         exceeds = .true.
         value = turn
         level = raised(turn, least)
      end if
      do attempt = 1, cap
         call signal%view(t, -1.0_wp, level, 0, part)
         call first_zero(part, length - t, search)
         if (search%outcome /= found_zero) return
         t = t + search%time
         call signal%view(t, 1.0_wp, 0.0_wp, 1, part)
         call first_zero(part, length - t, search)
         exceeds = .true.
         if (search%outcome == found_none) then
            call signal%evaluate(length, value, slope)
            time = length
            still_rises = .true.
            return
         end if
         t = t + search%time
         call signal%evaluate(t, turn, slope)
         if (turn > value) then
            value = turn
            time = t
         end if
         if (popcnt(attempt) == 1 .and. attempt >= 16) call look_ahead(signal, t, length, value, time)
         level = raised(max(value, level), least)
      end do
   end subroutine greatest_value

   !> A value by which the tolerance of a peak may go where the signal is next to nothing beside its terms: a share of
   !> them, and of what they can come to within the phase. The search then has some ten thousand steps at most for each
   !> time that it takes the terms to grow and fall.
   function size_of_terms(signal, length) result(scale)
      class(viewed_signal_t), intent(in) :: signal
      !> Length of the phase
      real(wp), intent(in) :: length
      real(wp) :: scale

      real(wp), parameter :: share = 1.0e-2_wp
      class(viewed_signal_t), allocatable :: raised
      type(local_t) :: here
      real(wp) :: curvature, level
      integer :: i

      call signal%look(0.0_wp, 0, here)
      curvature = here%bound_both
      level = 1.0_wp + 4.0_wp*abs(here%value)
      do i = 1, 8
         ! how far a signal falls is known where it is lifted
         call signal%view(0.0_wp, 1.0_wp, level, 0, raised)
         call raised%look(0.0_wp, 0, here)
         if (here%floor > -huge(1.0_wp)) exit
         level = 16.0_wp*level
      end do
      scale = share*min(curvature*length**2, max(here%value - here%floor, epsilon(1.0_wp)*level))
   end function size_of_terms

   !> The best of samples ahead, then of those about the best.
   subroutine look_ahead(signal, from, to, value, time)
      class(viewed_signal_t), intent(in) :: signal
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
      !> The best so far, and where
      real(wp), intent(inout) :: value
      real(wp), intent(inout) :: time

      integer, parameter :: samples = 200
      real(wp) :: first, here, last, slope, t, width
      integer :: i, zoom

      first = from
      last = to
      do zoom = 1, 3
         width = (last - first)/real(samples, wp)
         do i = 0, samples
            t = first + width*real(i, wp)
            call signal%evaluate(t, here, slope)
            if (here <= value) cycle
            value = here
            time = t
         end do
         first = max(from, time - width)
         last = min(to, time + width)
      end do
   end subroutine look_ahead

   !> What a better peak must reach.
   elemental function raised(level, scale) result(higher)
      !> The best so far
      real(wp), intent(in) :: level
      !> What counts where that is near zero
      real(wp), intent(in) :: scale
      real(wp) :: higher

      higher = level + peak_tolerance*max(abs(level), scale) + tiny(1.0_wp)
   end function raised

   !> When a signal was last above a level.
   subroutine last_time_above(signal, length, level, time, stays_above)
      !> The signal, without a surface that relaxes
      class(viewed_signal_t), intent(in) :: signal
      !> Length of the phase
      real(wp), intent(in) :: length
      real(wp), intent(in) :: level
      !> When, 0: never
      real(wp), intent(out) :: time
      !> It is above at the end
      logical, intent(out) :: stays_above

      class(viewed_signal_t), allocatable :: part
      type(search_t) :: search
      real(wp) :: value, slope, t
      logical :: is_above

      call signal%evaluate(0.0_wp, value, slope)
      is_above = value > level
      time = 0.0_wp
      t = 0.0_wp
      do
         call signal%view(t, merge(1.0_wp, -1.0_wp, is_above), merge(-level, level, is_above), 0, part)
         if (t > 0.0_wp) part%start_order = 1
         call first_zero(part, length - t, search)
         if (search%outcome == found_none .or. search%outcome == found_never_left) exit
         t = t + search%time
         if (is_above) time = t
         is_above = .not. is_above
         if (.not. search%time > 0.0_wp) exit
      end do
      stays_above = is_above .and. search%outcome == found_none
      if (stays_above) time = length
   end subroutine last_time_above

end module signal_peaks
