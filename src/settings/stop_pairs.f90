!> Refuses combinations of stops and supports at one point of the beam that are mechanically impossible.
module stop_pairs
   use failures, only: fail, failure_t, status_bad_input
   use kinds, only: wp
   use number_text, only: rounded, to_text
   use run_settings, only: law_restitution, side_above, side_below, stop_settings_t
   use scene_types, only: support_displacement, support_settings_t
   implicit none (type, external)
   private
   public :: are_at_one_point, conflict_of_stops, check_nodes_of_stops
   public :: conflict_with_support, conflict_of_supports

contains

   !> Whether two positions are equal within rounding.
   elemental logical function are_at_one_point(one, other) result(answer)
      !> Position x / L of one contact
      real(wp), intent(in) :: one
      !> Position x / L of the other contact
      real(wp), intent(in) :: other

      answer = abs(one - other) <= 4.0_wp*epsilon(1.0_wp)
   end function are_at_one_point

   !> Reason why two stops cannot be at one point, as a text for messages; empty: they can.
   pure function conflict_of_stops(one, other) result(conflict)
      type(stop_settings_t), intent(in) :: one
      type(stop_settings_t), intent(in) :: other
      character(:), allocatable :: conflict

      real(wp) :: clearance, rounding
      logical :: have_common_side

      conflict = ''
      if (max(one%partner, other%partner) > 0) then
         if (min(one%partner, other%partner) > 0 .and. one%partner /= other%partner .and. one%side == other%side .and. &
            .not. (one%is_of_base .or. other%is_of_base)) conflict = 'both move on one side at one point and would meet'
         return
      end if
      have_common_side = (one%side /= side_above .and. other%side /= side_above) .or. &
         (one%side /= side_below .and. other%side /= side_below)
      if (have_common_side .and. (one%law == law_restitution .neqv. other%law == law_restitution)) then
         conflict = 'one is rigid, one yields, and both are on one side; keep one of them, or give each a position'
         return
      end if
      ! the distance between the surfaces below and above the beam, in D; huge: no two surfaces face each other
      clearance = huge(1.0_wp)
      if (one%side /= side_above .and. other%side /= side_below) clearance = -one%preload - other%preload
      if (one%side /= side_below .and. other%side /= side_above) clearance = -one%preload - other%preload
      rounding = 4.0_wp*epsilon(1.0_wp)*max(abs(one%preload), abs(other%preload))
      if (clearance > rounding) return
      if (clearance < -rounding) then
         conflict = 'their surfaces overlap by '//rounded(-clearance)//' of |y_c(0) - d|; that above the beam must ' &
            //'be the higher one'
      else
         conflict = 'there is no clearance between both sides; that is a support: use &support'
      end if
   end function conflict_of_stops

   !> Check all pairs of stops at one node of the mesh, because the mesh moves a stop that is close to the tip to the
   !> node at the tip.
   pure subroutine check_nodes_of_stops(stops, nodes, error)
      type(stop_settings_t), intent(in) :: stops(:)
      !> Node of each stop, or any other numbers that are equal for stops at one point, [stops]
      integer, intent(in) :: nodes(:)
      !> Set if two stops are not compatible
      type(failure_t), allocatable, intent(inout) :: error

      character(:), allocatable :: conflict
      integer :: i, k

      do k = 2, size(stops)
         do i = 1, k - 1
            if (nodes(i) /= nodes(k)) cycle
            conflict = conflict_of_stops(stops(i), stops(k))
            if (conflict == '') cycle
            call fail(error, status_bad_input, 'the stops at '//to_text(stops(i)%position)//' and at ' &
               //to_text(stops(k)%position)//': '//conflict)
            return
         end do
      end do
   end subroutine check_nodes_of_stops

   !> Reason why a stop cannot be at the point of a support, as a text for messages; empty: it can.
   pure function conflict_with_support(support) result(conflict)
      type(support_settings_t), intent(in) :: support
      character(:), allocatable :: conflict

      conflict = ''
      if (support%motion == support_displacement .and. support%stiffness_ratio <= 0.0_wp) then
         conflict = 'a rigid support holds the beam where a stop is; move one of them, or give the support a stiffness'
      end if
   end function conflict_with_support

   !> Reason why two supports cannot be at one point, as a text for messages; empty: they can.
   pure function conflict_of_supports(one, other) result(conflict)
      type(support_settings_t), intent(in) :: one
      type(support_settings_t), intent(in) :: other
      character(:), allocatable :: conflict

      conflict = ''
      if (one%motion /= other%motion .or. min(one%stiffness_ratio, other%stiffness_ratio) > 0.0_wp) return
      conflict = 'a rigid support holds this motion of the beam there already'
   end function conflict_of_supports

end module stop_pairs
