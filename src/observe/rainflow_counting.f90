!> Cycles of a stress history by rainflow counting (ASTM E1049, section 5.4.4), from its turning points, and the
!> damage-equivalent range of these cycles (docs/theory.md, section 19).
!>
!> A turning point counts only if the signal reverses by more than a threshold at this point. Values of the signal are
!> added in the order of time; they need to include all extremes, and other values do no harm.
module rainflow_counting
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: turning_points_t, reversal_search_t, add_value, reversals_of, count_cycles, equivalent_range

   !> Search for reversals. The type has no allocatable components, so that a copy restores it when a run returns to an
   !> earlier state.
   type :: reversal_search_t
      !> Number of reversals found
      integer :: count = 0
      !> 1: the signal rises, -1: it falls, 0: it has not moved by more than the threshold yet
      integer :: direction = 0
      !> Extreme value since the last reversal; without a direction the first value
      real(wp) :: extreme = 0.0_wp
      !> Minimum of the signal before it has a direction
      real(wp) :: minimum = huge(1.0_wp)
      !> Maximum of the signal before it has a direction
      real(wp) :: maximum = -huge(1.0_wp)
   end type reversal_search_t

   !> Values at the reversals; only the first `count` of the search are valid.
   type :: turning_points_t
      real(wp), allocatable :: values(:)
   end type turning_points_t

contains

   !> Add a value of the signal.
   subroutine add_value(value, threshold, search, points)
      real(wp), intent(in) :: value
      !> Reversals by at most this much do not count
      real(wp), intent(in) :: threshold
      type(reversal_search_t), intent(inout) :: search
      type(turning_points_t), intent(inout) :: points

      if (search%direction == 0) then
         search%minimum = min(search%minimum, value)
         search%maximum = max(search%maximum, value)
         if (value - search%minimum > threshold) then
            call add_reversal((search%minimum), 1)
         else if (search%maximum - value > threshold) then
            call add_reversal((search%maximum), -1)
         end if
      else if (real(search%direction, wp)*(value - search%extreme) >= 0.0_wp) then
         search%extreme = value
      else if (abs(value - search%extreme) > threshold) then
         call add_reversal((search%extreme), -search%direction)
      end if

   contains

      !> Append the value at a reversal.
      subroutine add_reversal(reversal, direction)
         real(wp), intent(in) :: reversal
         !> Direction of the signal after the reversal
         integer, intent(in) :: direction

         if (.not. allocated(points%values)) allocate (points%values(64))
         ! twice as many; the second half is overwritten
         if (search%count == size(points%values)) points%values = [points%values, points%values]
         search%count = search%count + 1
         points%values(search%count) = reversal
         search%direction = direction
         search%extreme = value
      end subroutine add_reversal
   end subroutine add_value

   !> Values at the reversals, followed by the extreme since the last reversal.
   pure function reversals_of(search, points) result(values)
      type(reversal_search_t), intent(in) :: search
      type(turning_points_t), intent(in) :: points
      real(wp), allocatable :: values(:)

      if (search%direction == 0) then
         allocate (values(0))
      else
         values = [points%values(:search%count), search%extreme]
      end if
   end function reversals_of

   !> Count the cycles. A range counts when the range after it is at least as large: as half a cycle if it contains the
   !> first of the remaining reversals, else as a cycle. The ranges that remain at the end are half cycles.
   subroutine count_cycles(reversals, range, cycles, number)
      !> Values at the reversals, alternately minima and maxima
      real(wp), intent(in) :: reversals(:)
      !> Range of each count, [size(reversals)]
      real(wp), intent(out) :: range(:)
      !> Number of cycles of each count: 1, or 0.5 for half a cycle, [size(reversals)]
      real(wp), intent(out) :: cycles(:)
      !> Number of counts
      integer, intent(out) :: number

      ! remaining reversals, of which the first is `remaining(first)`
      real(wp) :: remaining(size(reversals))
      real(wp) :: last_range, previous_range
      integer :: first, i, top

      number = 0
      range = 0.0_wp
      cycles = 0.0_wp
      first = 1
      top = 0
      do i = 1, size(reversals)
         top = top + 1
         remaining(top) = reversals(i)
         do while (top - first >= 2)
            last_range = abs(remaining(top) - remaining(top - 1))
            previous_range = abs(remaining(top - 1) - remaining(top - 2))
            if (last_range < previous_range) exit
            if (top - first == 2) then
               call add(previous_range, 0.5_wp)
               first = first + 1
            else
               call add(previous_range, 1.0_wp)
               remaining(top - 2) = remaining(top)
               top = top - 2
            end if
         end do
      end do
      do i = first, top - 1
         call add(abs(remaining(i + 1) - remaining(i)), 0.5_wp)
      end do

   contains

      !> Append a counted range.
      subroutine add(counted_range, cycle_count)
         real(wp), intent(in) :: counted_range
         !> Cycles that the range counts: 1 or 0.5
         real(wp), intent(in) :: cycle_count

         number = number + 1
         range(number) = counted_range
         cycles(number) = cycle_count
      end subroutine add
   end subroutine count_cycles

   !> Damage-equivalent range: the same number of cycles of this range does the same damage by Miner's rule, if the
   !> damage of a cycle is proportional to the power m of its range, (sum n_i range_i^m / sum n_i)^(1/m). 0: there are
   !> no cycles.
   pure real(wp) function equivalent_range(range, cycles, slope) result(equivalent)
      !> Range of each count
      real(wp), intent(in) :: range(:)
      !> Number of cycles of each count
      real(wp), intent(in) :: cycles(:)
      !> Exponent m, the slope of the S-N curve in logarithms
      real(wp), intent(in) :: slope

      real(wp) :: largest

      equivalent = 0.0_wp
      largest = maxval([0.0_wp, range])
      if (.not. (largest > 0.0_wp .and. sum(cycles) > 0.0_wp)) return
      ! quotients of ranges do not overflow
      equivalent = largest*(sum(cycles*(range/largest)**slope)/sum(cycles))**(1.0_wp/slope)
   end function equivalent_range

end module rainflow_counting
