!> The greatest value of a signal and the last time it was above a level, certain like the search for its zeros.
module signal_peaks
   use certified_search, only: first_zero, found_never_left, found_none, found_spent, found_zero, bounds_t, search_t, &
      viewed_signal_t
   use kinds, only: i8, wp
   use row_peaks, only: peak_tolerance
   implicit none (type, external)
   private
   public :: extreme_search_t, exceeds, greatest_value, last_time_above, peak_tolerance

   !> Looks that the searches for an extreme of a run may take besides those of each phase, before their tolerance is
   !> raised tenfold: undamped, a beam swings for ever.
   integer(i8), parameter :: first_looks = 20000_i8
   integer(i8), parameter :: further_looks = 2000_i8
   integer(i8), parameter :: looks_of_phase = 100_i8

   !> What searches for an extreme have left.
   type :: extreme_search_t
      !> Its tolerance by now, as a share
      real(wp) :: tolerance = peak_tolerance
      integer(i8), private :: left = first_looks
   end type extreme_search_t

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
   !> the next turn gives a better one. Where ripples on a rise make many turns, or the looks are spent, samples ahead
   !> tell how far it goes.
   subroutine greatest_value(signal, length, threshold, exceeds, still_rises, value, time, scale, looks)
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
      !> The greatest value (within the tolerance) and its time
      real(wp), intent(out) :: value
      real(wp), intent(out) :: time
      !> A value by which the tolerance goes, too, where the signal is near zero; with it the tolerance is no finer than
      !> rounding
      real(wp), intent(in), optional :: scale
      !> What searches for the extreme of all phases have left; default: those in this phase have their own
      type(extreme_search_t), intent(inout), optional :: looks

      class(viewed_signal_t), allocatable :: part
      type(bounds_t) :: here
      type(extreme_search_t) :: mine
      type(search_t) :: search
      real(wp) :: least, level, slope, t, turn
      integer :: attempt

      least = 0.0_wp
      if (present(looks)) mine = looks
      if (present(scale)) then
         call signal%find_bounds(0.0_wp, 0, here)
         least = max(scale, here%rounding/peak_tolerance)
      end if
      mine%left = min(mine%left + looks_of_phase, max(mine%left, further_looks))
      exceeds = .false.
      still_rises = .false.
      value = threshold
      time = 0.0_wp
      level = merge(raised(threshold, least, mine), threshold, least > 0.0_wp)
      t = 0.0_wp
      call signal%evaluate(t, turn, slope)
      if (turn > threshold) then
         exceeds = .true.
         value = turn
         level = raised(turn, least, mine)
      end if
      attempt = 0
      do
         call signal%view(t, -1.0_wp, level, 0, part)
         call seek(part, length - t, mine, search)
         if (search%outcome == found_none .or. search%outcome == found_never_left) exit
         t = t + search%time
         if (search%outcome == found_zero) then
            call signal%view(t, 1.0_wp, 0.0_wp, 1, part)
            call seek(part, length - t, mine, search)
            exceeds = .true.
            if (search%outcome == found_none) then
               call signal%evaluate(length, value, slope)
               time = length
               still_rises = .true.
               exit
            end if
            t = t + search%time
            call signal%evaluate(t, turn, slope)
            if (turn > value) then
               value = turn
               time = t
            end if
         end if
         attempt = attempt + 1
         if (search%outcome == found_spent .or. (popcnt(attempt) == 1 .and. attempt >= 16)) then
            call look_ahead(signal, t, length, &
               merge(further_looks, looks_of_phase, search%outcome == found_spent), value, time)
            exceeds = exceeds .or. value > threshold
         end if
         level = raised(max(value, level), least, mine)
      end do
      if (present(looks)) looks = mine
   end subroutine greatest_value

   !> The first zero, with what is left of looks; where they are spent the tolerance is raised.
   subroutine seek(signal, limit, looks, search)
      class(viewed_signal_t), intent(in) :: signal
      real(wp), intent(in) :: limit
      type(extreme_search_t), intent(inout) :: looks
      type(search_t), intent(out) :: search

      call first_zero(signal, limit, search, most_evaluations=looks%left)
      looks%left = looks%left - search%evaluations
      if (looks%left > 0) return
      looks%left = further_looks
      looks%tolerance = 10.0_wp*looks%tolerance
   end subroutine seek

   !> The best of samples ahead, then of those ever closer about the best, while that gains.
   subroutine look_ahead(signal, from, to, samples, value, time)
      class(viewed_signal_t), intent(in) :: signal
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
      !> So many, and about each best a hundred
      integer(i8), intent(in) :: samples
      !> The best so far, and where
      real(wp), intent(inout) :: value
      real(wp), intent(inout) :: time

      integer, parameter :: zooms = 10
      real(wp) :: before, first, here, last, slope, t, width
      integer(i8) :: i, count
      integer :: zoom

      first = from
      last = to
      count = samples
      do zoom = 1, zooms
         before = value
         width = (last - first)/real(count, wp)
         do i = 0, count
            t = first + width*real(i, wp)
            call signal%evaluate(t, here, slope)
            if (here <= value) cycle
            value = here
            time = t
         end do
         if (zoom > 2 .and. .not. value - before > peak_tolerance*abs(value)) exit
         first = max(from, time - width)
         last = min(to, time + width)
         count = looks_of_phase
      end do
   end subroutine look_ahead

   !> What a better peak must reach.
   elemental function raised(level, scale, looks) result(higher)
      !> The best so far
      real(wp), intent(in) :: level
      !> What counts where that is near zero
      real(wp), intent(in) :: scale
      !> They tell the tolerance
      type(extreme_search_t), intent(in) :: looks
      real(wp) :: higher

      higher = level + looks%tolerance*max(abs(level), scale) + tiny(1.0_wp)
   end function raised

   !> When a signal was last above a level.
   subroutine last_time_above(signal, length, level, time, stays_above, from)
      !> The signal, without a surface that relaxes
      class(viewed_signal_t), intent(in) :: signal
      !> Length of the phase
      real(wp), intent(in) :: length
      real(wp), intent(in) :: level
      !> When, 0: never
      real(wp), intent(out) :: time
      !> It is above at the end
      logical, intent(out) :: stays_above
      !> What was before matters not; default: all does
      real(wp), intent(in), optional :: from

      class(viewed_signal_t), allocatable :: part
      type(search_t) :: search
      real(wp) :: value, slope, t
      logical :: is_above, is_at_level

      t = 0.0_wp
      if (present(from)) t = from
      call signal%evaluate(t, value, slope)
      is_above = value > level
      is_at_level = .false.
      time = 0.0_wp
      do
         call signal%view(t, merge(1.0_wp, -1.0_wp, is_above), merge(-level, level, is_above), 0, part)
         if (is_at_level) part%start_order = 1
         call first_zero(part, length - t, search)
         if (search%outcome == found_none .or. search%outcome == found_never_left) exit
         t = t + search%time
         if (is_above) time = t
         is_above = .not. is_above
         is_at_level = .true.
         if (.not. search%time > 0.0_wp) exit
      end do
      stays_above = is_above .and. search%outcome == found_none
      if (stays_above) time = length
   end subroutine last_time_above

end module signal_peaks
