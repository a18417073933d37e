!> Where a branch of motions that return comes back to what it left, told by their sections (docs/theory.md,
!> section 22).
module orbit_returns
   use kinds, only: wp
   use orbit_types, only: orbit_point_t
   implicit none (type, external)
   private
   public :: change_places, joins_at, look_back, returns_in_half

contains

   !> Do the two halves of a motion become each other between two points of a branch?
   pure function change_places(last, next) result(answer)
      !> Of an even number of periods
      type(orbit_point_t), intent(in) :: last
      type(orbit_point_t), intent(in) :: next
      logical :: answer

      answer = dot_product(change_in_half(last), change_in_half(next)) < 0.0_wp
   end function change_places

   !> Does a branch come back to one that it left? Where that doubles its period the two halves change places; from
   !> there on the branch is what it was, half its period later.
   pure function joins_at(other, last, next, range) result(answer)
      !> Where the period of the other doubles
      type(orbit_point_t), intent(in) :: other
      !> Between these points
      type(orbit_point_t), intent(in) :: last
      type(orbit_point_t), intent(in) :: next
      !> Not further away in the parameter
      real(wp), intent(in) :: range
      logical :: answer

      integer :: j

      answer = .false.
      if (.not. change_places(last, next) .or. abs(next%value - other%value) > range) return
      do j = 1, other%periods
         answer = answer .or. is_beside(last, other%tip(:, j)) .and. is_beside(next, other%tip(:, j))
      end do

   contains

      !> Half of the change would be exact.
      pure function is_beside(point, tip)
         type(orbit_point_t), intent(in) :: point
         real(wp), intent(in) :: tip(2)
         logical :: is_beside

         is_beside = norm2(in_one_unit(point, point%tip(:, 1) - tip)) <= norm2(change_in_half(point))
      end function is_beside
   end function joins_at

   !> Does the beginning of a branch lie between two points, in the direction in which it began? Told by what is the
   !> same wherever in the period the section is, and for the same motion some periods of the loads later, too.
   pure subroutine look_back(start, second, last, next, units, is_away, is_back)
      !> The first two points
      type(orbit_point_t), intent(in) :: start
      type(orbit_point_t), intent(in) :: second
      type(orbit_point_t), intent(in) :: last
      type(orbit_point_t), intent(in) :: next
      !> Of the parameter and of velocities
      real(wp), intent(in) :: units(2)
      !> It is far from there
      logical, intent(out) :: is_away
      logical, intent(out) :: is_back

      real(wp), dimension(1 + 2*next%periods) :: begin, from, move, to
      real(wp) :: length
      integer :: later

      from = seen(last, units, 0)
      to = seen(next, units, 0)
      length = norm2(to - from)
      is_away = .true.
      is_back = .false.
      do later = 0, next%periods - 1
         begin = seen(start, units, later)
         move = seen(second, units, later) - begin
         is_back = is_back .or. norm2(begin - from) + norm2(to - begin) <= 1.1_wp*length .and. &
            dot_product(to - from, move) > 0.7_wp*length*norm2(move)
         is_away = is_away .and. norm2(to - begin) > 4.0_wp*length
      end do
   end subroutine look_back

   !> Is it a motion of half the period, twice?
   pure function returns_in_half(point, units) result(answer)
      !> Of an even number of periods
      type(orbit_point_t), intent(in) :: point
      real(wp), intent(in) :: units(2)
      logical :: answer

      real(wp), parameter :: near = 1.0e-6_wp

      answer = norm2(change_in_half(point)) <= near*units(2)
   end function returns_in_half

   !> The parameter and the sections of a motion, some periods of the loads later.
   pure function seen(point, units, later) result(values)
      type(orbit_point_t), intent(in) :: point
      real(wp), intent(in) :: units(2)
      integer, intent(in) :: later
      real(wp) :: values(1 + 2*point%periods)

      integer :: j

      values(1) = point%value/units(1)
      do j = 1, point%periods
         values(2*j:2*j + 1) = in_one_unit(point, point%tip(:, 1 + modulo(j - 1 + later, point%periods)))/units(2)
      end do
   end function seen

   !> By how much the tip has moved after half the period, and its velocity changed.
   pure function change_in_half(point) result(change)
      type(orbit_point_t), intent(in) :: point
      real(wp) :: change(2)

      change = in_one_unit(point, point%tip(:, 1) - point%tip(:, 1 + point%periods/2))
   end function change_in_half

   !> The displacement times the frequency of the loads, and the velocity.
   pure function in_one_unit(point, tip) result(velocities)
      type(orbit_point_t), intent(in) :: point
      real(wp), intent(in) :: tip(2)
      real(wp) :: velocities(2)

      real(wp), parameter :: one_turn = 2.0_wp*acos(-1.0_wp)

      velocities = [one_turn/point%period*tip(1), tip(2)]
   end function in_one_unit

end module orbit_returns
