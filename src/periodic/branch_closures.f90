!> Closure of branches of periodic orbits: a branch ends if it returns to the branch that it left, or to its own start.
!> Both are detected from the section values, i.e. displacement and velocity of the tip at sections of phase 0
!> (docs/theory.md, section 22).
module branch_closures
   use kinds, only: pi, wp
   use orbit_types, only: orbit_point_t
   implicit none (type, external)
   private
   public :: halves_swap, rejoins_at, check_closure, has_half_period, has_pair_on_circle

contains

   !> Whether the two halves of the period exchange their section values between two points of a branch.
   pure logical function halves_swap(last, next) result(answer)
      !> Last point of the branch, an orbit of an even number of load periods
      type(orbit_point_t), intent(in) :: last
      !> Next point of the branch
      type(orbit_point_t), intent(in) :: next

      answer = dot_product(half_period_change(last), half_period_change(next)) < 0.0_wp
   end function halves_swap

   !> Whether a branch of doubled period rejoins the branch that it left, at a period doubling of the latter. At this
   !> doubling the two halves of the period exchange their section values; afterwards the branch of doubled period
   !> repeats itself, shifted by half its period.
   pure logical function rejoins_at(other, last, next, max_difference) result(answer)
      !> Period doubling of the other branch
      type(orbit_point_t), intent(in) :: other
      !> Last point of the branch
      type(orbit_point_t), intent(in) :: last
      !> Next point of the branch
      type(orbit_point_t), intent(in) :: next
      !> Maximum difference of the parameter between the doubling and `next`
      real(wp), intent(in) :: max_difference

      integer :: j

      answer = .false.
      if (.not. halves_swap(last, next) .or. abs(next%value - other%value) > max_difference) return
      do j = 1, other%periods
         answer = answer .or. is_close(last, other%tip(:, j)) .and. is_close(next, other%tip(:, j))
      end do

   contains

      !> Whether section values are close to those of a point. At the doubling both halves of the period coincide, so
      !> the exact distance would be half of the change in half a period; the test allows for the whole change.
      pure logical function is_close(point, tip)
         type(orbit_point_t), intent(in) :: point
         real(wp), intent(in) :: tip(2)

         is_close = norm2(as_velocities(point, point%tip(:, 1) - tip)) <= norm2(half_period_change(point))
      end function is_close
   end function rejoins_at

   !> Find whether the start of a branch lies between two successive points, with the initial direction of the branch.
   !> The points are compared by the parameter and the section values at phase 0, because the states from which Newton's
   !> method starts may lie at different phases; the orbit is compared at all shifts by load periods.
   pure subroutine check_closure(start, second, last, next, units, is_away, has_returned)
      !> First point of the branch
      type(orbit_point_t), intent(in) :: start
      !> Second point of the branch, which shows its initial direction
      type(orbit_point_t), intent(in) :: second
      !> Last point of the branch
      type(orbit_point_t), intent(in) :: last
      !> Next point of the branch
      type(orbit_point_t), intent(in) :: next
      !> Units of the parameter and of velocities
      real(wp), intent(in) :: units(2)
      !> Whether the point `next` is farther from the start than four times the distance of the two points
      logical, intent(out) :: is_away
      !> Whether the start lies between the two points
      logical, intent(out) :: has_returned

      ! parameter and section values at the start
      real(wp) :: at_start(1 + 2*next%periods)
      ! parameter and section values at `last`
      real(wp) :: at_last(1 + 2*next%periods)
      ! parameter and section values at `next`
      real(wp) :: at_next(1 + 2*next%periods)
      ! initial change of these values, from the start to the second point
      real(wp) :: initial_change(1 + 2*next%periods)
      ! distance of the two points
      real(wp) :: length
      ! number of load periods by which the orbit is shifted
      integer :: shift

      at_last = section_values(last, units, 0)
      at_next = section_values(next, units, 0)
      length = norm2(at_next - at_last)
      is_away = .true.
      has_returned = .false.
      do shift = 0, next%periods - 1
         at_start = section_values(start, units, shift)
         initial_change = section_values(second, units, shift) - at_start
         ! the start lies on the path between the points to 10 %, at an angle of less than 45 degrees to the initial
         ! direction
         has_returned = has_returned .or. norm2(at_start - at_last) + norm2(at_next - at_start) <= 1.1_wp*length .and. &
            dot_product(at_next - at_last, initial_change) > 0.7_wp*length*norm2(initial_change)
         is_away = is_away .and. norm2(at_next - at_start) > 4.0_wp*length
      end do
   end subroutine check_closure

   !> Whether the orbit is one of half the period, traversed twice.
   pure logical function has_half_period(point, units) result(answer)
      !> Orbit of an even number of load periods
      type(orbit_point_t), intent(in) :: point
      !> Units of the parameter and of velocities
      real(wp), intent(in) :: units(2)

      ! relative to the unit of velocities
      real(wp), parameter :: near = 1.0e-6_wp

      answer = norm2(half_period_change(point)) <= near*units(2)
   end function has_half_period

   !> Parameter and section values of an orbit, shifted by a number of load periods.
   pure function section_values(point, units, shift) result(values)
      type(orbit_point_t), intent(in) :: point
      !> Units of the parameter and of velocities
      real(wp), intent(in) :: units(2)
      integer, intent(in) :: shift
      !> Parameter, then displacement and velocity of the tip at each section
      real(wp) :: values(1 + 2*point%periods)

      integer :: j

      values(1) = point%value/units(1)
      do j = 1, point%periods
         values(2*j:2*j + 1) = as_velocities(point, point%tip(:, 1 + modulo(j - 1 + shift, point%periods)))/units(2)
      end do
   end function section_values

   !> Change of displacement (times the load frequency) and velocity of the tip in half a period.
   pure function half_period_change(point) result(change)
      type(orbit_point_t), intent(in) :: point
      real(wp) :: change(2)

      change = as_velocities(point, point%tip(:, 1) - point%tip(:, 1 + point%periods/2))
   end function half_period_change

   !> Section values in units of velocity: displacement times the circular frequency of the load, and velocity.
   pure function as_velocities(point, tip) result(velocities)
      type(orbit_point_t), intent(in) :: point
      real(wp), intent(in) :: tip(2)
      real(wp) :: velocities(2)

      velocities = [2.0_wp*pi/point%period*tip(1), tip(2)]
   end function as_velocities

   !> Whether a complex pair of multipliers is on the unit circle. The test function of a torus also vanishes for two
   !> real multipliers that are inverse to each other, without a bifurcation.
   pure logical function has_pair_on_circle(point) result(answer)
      type(orbit_point_t), intent(in) :: point

      real(wp), parameter :: near = 1.0e-6_wp

      answer = any(abs(aimag(point%multiplier)) > 0.0_wp .and. abs(abs(point%multiplier) - 1.0_wp) < near)
   end function has_pair_on_circle

end module branch_closures
