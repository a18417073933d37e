!> The greatest value of a signal and the last time it was above a level, certain like the search for its zeros.
module signal_peaks
   use certified_search, only: certified_signal_t, first_zero, found_never_left, found_none, found_zero, search_t
   use damped_oscillators, only: acceleration, propagate
   use exponential_signal, only: exponential_signal_t
   use kinds, only: wp
   use modal_signal, only: make_modal_signal, modal_signal_t
   implicit none (type, external)
   private
   public :: greatest_value, last_time_above, signal_view, peak_tolerance

   !> A higher peak in the same phase is missed only if it is higher by less than this share.
   real(wp), parameter :: peak_tolerance = 1.0e-6_wp

contains

   !> The greatest value of a signal in a phase, if it exceeds a threshold.
   !>
   !> Where the signal is proven to stay below the best value known it is not looked into; where it comes up to it,
   !> the next turn gives a better one.
   subroutine greatest_value(signal, length, threshold, exceeds, still_rises, value, time)
      !> The signal, without a surface that relaxes
      class(certified_signal_t), intent(in) :: signal
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

      integer, parameter :: cap = 10000
      class(certified_signal_t), allocatable :: part
      type(search_t) :: search
      real(wp) :: level, slope, t, turn
      integer :: attempt

      exceeds = .false.
      still_rises = .false.
      value = threshold
      time = 0.0_wp
      level = threshold
      t = 0.0_wp
      call signal%evaluate(t, turn, slope)
      if (turn > threshold) then
         exceeds = .true.
         value = turn
         level = raised(turn)
      end if
      do attempt = 1, cap
         call signal_view(signal, t, -1.0_wp, level, 0, part)
         call first_zero(part, length - t, search)
         if (search%outcome /= found_zero) return
         t = t + search%time
         call signal_view(signal, t, 1.0_wp, 0.0_wp, 1, part)
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
         level = raised(max(turn, level))
      end do
   end subroutine greatest_value

   !> What a better peak must reach.
   elemental function raised(level) result(higher)
      !> The best so far
      real(wp), intent(in) :: level
      real(wp) :: higher

      higher = level + peak_tolerance*abs(level) + tiny(1.0_wp)
   end function raised

   !> When a signal was last above a level.
   subroutine last_time_above(signal, length, level, time, stays_above)
      !> The signal, without a surface that relaxes
      class(certified_signal_t), intent(in) :: signal
      !> Length of the phase
      real(wp), intent(in) :: length
      !> The level
      real(wp), intent(in) :: level
      !> When, 0: never
      real(wp), intent(out) :: time
      !> It is above at the end
      logical, intent(out) :: stays_above

      class(certified_signal_t), allocatable :: part
      type(search_t) :: search
      real(wp) :: value, slope, t
      logical :: is_above

      call signal%evaluate(0.0_wp, value, slope)
      is_above = value > level
      time = 0.0_wp
      t = 0.0_wp
      do
         call signal_view(signal, t, merge(1.0_wp, -1.0_wp, is_above), merge(-level, level, is_above), 0, part)
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

   !> offset + factor times a derivative of a signal from an instant on.
   subroutine signal_view(signal, from, factor, offset, order, part)
      !> The signal, without a surface that relaxes
      class(certified_signal_t), intent(in) :: signal
      !> The instant
      real(wp), intent(in) :: from
      !> Factor, and what is added
      real(wp), intent(in) :: factor
      real(wp), intent(in) :: offset
      !> 0: the signal itself, 1: its slope
      integer, intent(in) :: order
      !> The same as a signal
      class(certified_signal_t), allocatable, intent(out) :: part

      type(modal_signal_t), allocatable :: modal
      type(exponential_signal_t), allocatable :: exponential
      real(wp) :: whole

      whole = offset
      select type (signal)
      type is (modal_signal_t)
         allocate (modal)
         if (order == 0) whole = offset + factor*signal%offset
         call make_modal_signal(signal%oscillators, whole, factor*signal%weight, modal)
         modal%is_viscous = signal%is_viscous
         if (from > 0.0_wp) then
            call propagate(signal%oscillators, from, signal%z, signal%v, modal%z, modal%v)
         else
            modal%z = signal%z
            modal%v = signal%v
         end if
         if (order == 1) then
            block
               real(wp), dimension(signal%oscillators%count) :: rate
               rate = modal%v
               modal%v = acceleration(signal%oscillators, modal%z, rate)
               modal%z = rate
            end block
         end if
         call move_alloc(modal, part)
      type is (exponential_signal_t)
         allocate (exponential)
         if (order == 0) whole = offset + factor*signal%offset
         exponential%offset = whole
         allocate (exponential%exponent, source=signal%exponent)
         if (allocated(signal%place)) allocate (exponential%place, source=signal%place)
         allocate (exponential%amplitude, source=factor*signal%amplitude*exp(signal%exponent*from)*signal%exponent**order)
         call move_alloc(exponential, part)
      end select
   end subroutine signal_view

end module signal_peaks
