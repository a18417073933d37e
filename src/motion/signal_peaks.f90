!> The greatest value of a signal and the last time it was above a level, certain like the search for its zeros.
module signal_peaks
   use certified_search, only: first_zero, found_never_left, found_none, found_zero, search_t, viewed_signal_t
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: exceeds, greatest_value, last_time_above, peak_tolerance

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
   !> the next turn gives a better one.
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
         level = raised(max(turn, level), least)
      end do
   end subroutine greatest_value

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
