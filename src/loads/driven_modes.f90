!> A mode that a load drives from rest, in closed form: E'' + 2 a E' + W^2 E = exp(sigma t), or t (docs/theory.md,
!> section 18). So go modes with which a load resonates and those that are slow, whose answers to a load without a
!> start would be far greater than the motion.
module driven_modes
   use damped_oscillators, only: oscillators_t
   use exponential_differences, only: exponential_difference, find_differences, square_of
   use kinds, only: wp
   use load_courses, only: load_segment_t
   implicit none (type, external)
   private
   public :: driven_mode_t, make_driven_mode, driven_mode_at, integral_of, work_on, bound_driven_mode, &
      work_on_free_motion, &
      integral_of_free_motion

   type :: driven_mode_t
      !> The motion is Re(force E)
      complex(wp) :: force = (0.0_wp, 0.0_wp)
      !> sigma = i frequency
      real(wp) :: frequency = 0.0_wp
      !> Driven by t, sigma = 0
      logical :: is_ramp = .false.
      !> 2 a, W^2 and the exponents of the mode alone
      real(wp) :: damping = 0.0_wp
      real(wp) :: square = 0.0_wp
      complex(wp) :: own(2) = (0.0_wp, 0.0_wp)
   end type driven_mode_t

   !> Of exp(s t), in a divided difference of which a mode goes
   integer, parameter :: most_points = 4

contains

   !> A mode of a family, with nothing that drives it.
   pure function make_driven_mode(oscillators, place) result(mode)
      type(oscillators_t), intent(in) :: oscillators
      integer, intent(in) :: place
      type(driven_mode_t) :: mode

      associate (decay => oscillators%decay(place), spread => oscillators%spread(place))
         mode%square = oscillators%square(place)
         mode%damping = oscillators%two_zeta*mode%square + oscillators%mass_rate(place)
         if (place <= oscillators%oscillating) then
            mode%own = [cmplx(-decay, spread, wp), cmplx(-decay, -spread, wp)]
         else
            mode%own = [cmplx(-decay, 0.0_wp, wp), cmplx(-(decay + 2.0_wp*spread), 0.0_wp, wp)]
         end if
      end associate
   end function make_driven_mode

   !> It and its derivatives: that of the difference over some points is the first of them times it, and the difference
   !> over the others. By the equation of motion rounding would grow by what is stiff.
   pure function driven_mode_at(mode, time, most) result(derivative)
      type(driven_mode_t), intent(in) :: mode
      real(wp), intent(in) :: time
      !> The highest, >= 1
      integer, intent(in) :: most
      real(wp) :: derivative(0:most)

      complex(wp) :: points(0:most_points), differences(most_points)
      integer :: i, k, last

      call find_points(mode, points, last)
      call find_differences(points(1:last), time, differences(:last))
      do k = 0, most
         derivative(k) = real(mode%force*differences(1), wp)
         do i = 1, last - 1
            differences(i) = points(i)*differences(i) + differences(i + 1)
         end do
         differences(last) = points(last)*differences(last)
      end do
   end function driven_mode_at

   !> E is the divided difference of exp(s t) over points 1 to last, E' - sigma E that over those from 2 on, and the
   !> integral of E that with point 0 besides.
   pure subroutine find_points(mode, points, last)
      type(driven_mode_t), intent(in) :: mode
      complex(wp), intent(out) :: points(0:most_points)
      integer, intent(out) :: last

      points = (0.0_wp, 0.0_wp)
      points(1) = cmplx(0.0_wp, mode%frequency, wp)
      last = merge(4, 3, mode%is_ramp)
      points(last - 1:last) = mode%own
   end subroutine find_points

   !> Its integral from the start.
   pure function integral_of(mode, time) result(value)
      type(driven_mode_t), intent(in) :: mode
      real(wp), intent(in) :: time
      real(wp) :: value

      complex(wp) :: points(0:most_points)
      integer :: last

      call find_points(mode, points, last)
      value = real(mode%force*exponential_difference(points(:last), time), wp)
   end function integral_of

   !> Work that a load does on it.
   pure function work_on(mode, segment, time) result(work)
      type(driven_mode_t), intent(in) :: mode
      !> The load, per unit of its share in the mode
      type(load_segment_t), intent(in) :: segment
      real(wp), intent(in) :: time
      real(wp) :: work

      real(wp) :: here(0:1)

      here = driven_mode_at(mode, time, 1)
      work = segment%constant*here(0)
      if (abs(segment%slope) > 0.0_wp) work = work + segment%slope*(time*here(0) - integral_of(mode, time))
      if (abs(segment%harmonic) <= 0.0_wp) return
      associate (turning => cmplx(0.0_wp, segment%frequency, wp))
         work = work + 0.5_wp*real(mode%force*(segment%harmonic*turned(turning) &
            + conjg(segment%harmonic)*turned(-turning)), wp)
      end associate

   contains

      !> Integral of exp(theta t) E'.
      pure function turned(theta) result(value)
         complex(wp), intent(in) :: theta
         complex(wp) :: value

         complex(wp) :: points(0:most_points)
         integer :: last

         call find_points(mode, points, last)
         points(1:) = points(1:) + theta
         value = (0.0_wp, 0.0_wp)
         if (mode%frequency > 0.0_wp) value = cmplx(0.0_wp, mode%frequency, wp) &
            *exponential_difference(points(:last), time)
         points(1) = (0.0_wp, 0.0_wp)
         value = value + exponential_difference(points(1:last), time)
      end function turned
   end function work_on

   !> Work of a load on the mode that swings of itself, z' = v0 h' - W^2 z0 h with h its answer to a unit impulse.
   pure function work_on_free_motion(mode, start, segment, time) result(work)
      type(driven_mode_t), intent(in) :: mode
      !> z and z' at time 0
      real(wp), intent(in) :: start(2)
      !> The load, per unit of its share in the mode
      type(load_segment_t), intent(in) :: segment
      real(wp), intent(in) :: time
      real(wp) :: work

      complex(wp), parameter :: zero = (0.0_wp, 0.0_wp)
      complex(wp) :: moved, theta

      moved = start(2)*exponential_difference(mode%own, time) &
         - mode%square*start(1)*exponential_difference([zero, mode%own], time)
      work = segment%constant*real(moved, wp)
      if (abs(segment%slope) > 0.0_wp) then
         work = work + segment%slope*(time*(start(1) + real(moved, wp)) - integral_of_free_motion(mode, start, time))
      end if
      if (abs(segment%harmonic) <= 0.0_wp) return
      theta = cmplx(0.0_wp, segment%frequency, wp)
      associate (own => mode%own + theta)
         work = work + real(segment%harmonic*(start(2)*exponential_difference([zero, own(2)], time) &
            + (start(2)*mode%own(1) - mode%square*start(1))*exponential_difference([zero, own], time)), wp)
      end associate
   end function work_on_free_motion

   !> Integral of the mode that swings of itself.
   pure function integral_of_free_motion(mode, start, time) result(value)
      type(driven_mode_t), intent(in) :: mode
      !> z and z' at time 0
      real(wp), intent(in) :: start(2)
      real(wp), intent(in) :: time
      real(wp) :: value

      complex(wp), parameter :: zero = (0.0_wp, 0.0_wp)

      value = start(1)*time + real(start(2)*exponential_difference([zero, mode%own], time) &
         - mode%square*start(1)*exponential_difference([zero, zero, mode%own], time), wp)
   end function integral_of_free_motion

   !> Bounds on it and on its derivatives between two instants. Of a mode that is hit by a unit impulse neither the
   !> velocity exceeds 1 nor W times the displacement; the load is a sum of such hits, each derivative further one by
   !> the equation of motion. From an instant on the rates of what a constant drives go like those of a mode that swings
   !> of itself, of which each is bounded by itself and the next. And nothing exceeds the sum of the exponentials in it,
   !> each of which only dies away.
   pure subroutine bound_driven_mode(mode, until, bounds, from, here)
      type(driven_mode_t), intent(in) :: mode
      real(wp), intent(in) :: until
      !> From the mode itself on
      real(wp), intent(out) :: bounds(0:)
      !> Bounds from then on are asked for; default: from the start
      real(wp), intent(in), optional :: from
      !> It and its derivatives then, one more than are bounded
      real(wp), intent(in), optional :: here(0:)

      ! whose square is a number
      real(wp), parameter :: greatest_time = 1.0e100_wp
      real(wp) :: forced, greatest, length, omega, time
      integer :: k

      time = min(until, greatest_time)
      greatest = min(time, 1.0_wp/sqrt(mode%square), 2.0_wp/max(abs(mode%own(1) - mode%own(2)), tiny(1.0_wp)))
      bounds(0) = time*min(greatest, 0.5_wp*time)
      bounds(1) = time
      if (abs(aimag(mode%own(1))) > 0.0_wp) then
         ! what was long ago has died away
         length = min(time, 2.0_wp/max(mode%damping, tiny(1.0_wp)))
         omega = length/abs(aimag(mode%own(1)))
         bounds(0) = min(bounds(0), omega)
         bounds(1) = min(bounds(1), sqrt(mode%square)*omega)
      end if
      forced = 1.0_wp
      if (.not. mode%frequency > 0.0_wp) then
         bounds(0) = min(bounds(0), 2.0_wp/mode%square)
         bounds(1) = min(bounds(1), greatest)
         if (mode%is_ramp) then
            bounds(1) = bounds(0)
            bounds(0) = time*bounds(0)
            forced = time
         end if
      end if
      do k = 2, ubound(bounds, 1)
         bounds(k) = forced + mode%damping*bounds(k - 1) + mode%square*bounds(k - 2)
         if (mode%is_ramp) forced = merge(1.0_wp, 0.0_wp, k == 2)
         if (.not. mode%is_ramp) forced = forced*mode%frequency
      end do
      bounds = min(bounds, sums_of_exponentials(mode, ubound(bounds, 1), from))
      bounds = abs(mode%force)*bounds
      if (.not. present(here) .or. mode%frequency > 0.0_wp) return
      do k = merge(2, 1, mode%is_ramp), ubound(bounds, 1)
         bounds(k) = min(bounds(k), hypot(here(k), here(k + 1)/sqrt(mode%square)))
      end do
   end subroutine bound_driven_mode

   !> From an instant on none of the exponentials of which it and its derivatives consist is greater than then; the rate
   !> of what a ramp drives is what a constant does.
   pure function sums_of_exponentials(mode, most, from) result(bounds)
      type(driven_mode_t), intent(in) :: mode
      !> The highest derivative
      integer, intent(in) :: most
      !> Default: from the start
      real(wp), intent(in), optional :: from
      !> Per unit of the force
      real(wp) :: bounds(0:most)

      ! with less between them points are one
      real(wp), parameter :: least_apart = sqrt(tiny(1.0_wp))
      complex(wp) :: points(3)
      real(wp) :: apart(3), greatest(3), rate(3)
      integer :: k

      bounds = huge(1.0_wp)
      points = [cmplx(0.0_wp, mode%frequency, wp), mode%own]
      apart = sqrt(square_of(points - cshift(points, 1)))
      ! from the two others
      apart = apart*cshift(apart, -1)
      if (any(apart < least_apart)) return
      greatest = 1.0_wp/apart
      if (present(from)) greatest(2:) = greatest(2:)*exp(real(mode%own, wp)*from)
      rate = sqrt(square_of(points))
      do k = merge(1, 0, mode%is_ramp), most
         bounds(k) = sum(greatest)
         greatest = rate*greatest
      end do
   end function sums_of_exponentials

end module driven_modes
