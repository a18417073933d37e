!> Stops and supports at one point of the beam that contradict each other.
module stop_pairs
   use kinds, only: wp
   use number_text, only: to_text
   use run_settings, only: law_restitution, side_above, side_below, stop_settings_t
   implicit none (type, external)
   private
   public :: are_at_one_point, conflict_of_stops

contains

   !> Do two positions differ by rounding at most?
   elemental function are_at_one_point(one, other) result(answer)
      !> x / L
      real(wp), intent(in) :: one
      real(wp), intent(in) :: other
      logical :: answer

      answer = abs(one - other) <= 4.0_wp*epsilon(1.0_wp)
   end function are_at_one_point

   !> Why two stops cannot be at one point; empty: they can.
   pure function conflict_of_stops(one, other) result(conflict)
      type(stop_settings_t), intent(in) :: one
      type(stop_settings_t), intent(in) :: other
      character(:), allocatable :: conflict

      real(wp) :: clearance, rounding
      logical :: share_side

      conflict = ''
      share_side = (one%side /= side_above .and. other%side /= side_above) .or. &
         (one%side /= side_below .and. other%side /= side_below)
      if (share_side .and. (one%law == law_restitution .neqv. other%law == law_restitution)) then
         conflict = 'one is rigid, one yields, and both are on one side; keep one of them, or give each a position'
         return
      end if
      clearance = huge(1.0_wp)
      if (one%side /= side_above .and. other%side /= side_below) clearance = -one%preload - other%preload
      if (one%side /= side_below .and. other%side /= side_above) clearance = -one%preload - other%preload
      rounding = 4.0_wp*epsilon(1.0_wp)*max(abs(one%preload), abs(other%preload))
      if (clearance > rounding) return
      if (clearance < -rounding) then
         conflict = 'their surfaces overlap by '//to_text(-clearance)//' of |y_c(0) - d|; that above the beam must ' &
            //'be the higher one'
      else
         conflict = 'there is no clearance between both sides; that is a support: use &support'
      end if
   end function conflict_of_stops

end module stop_pairs
