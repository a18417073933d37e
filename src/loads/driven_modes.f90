!> A mode driven from rest by a load, in closed form: E'' + 2 a E' + W^2 E = exp(sigma t), or t for a ramp, with E = E'
!> = 0 at the start, where primes are derivatives with respect to the time t since the start of the phase and 2 a = 2
!> zeta W^2 + alpha (docs/theory.md, section 18). E is the divided difference of the function exp(s t) of s at the
!> points sigma and the two exponents of the mode. This form is accurate for modes in resonance with a load and for slow
!> modes, whose steady-state response would be much larger than the motion.
module driven_modes
   use damped_oscillators, only: oscillators_t
   use exponential_differences, only: exponential_difference, find_differences, square_of
   use kinds, only: wp
   use load_courses, only: load_segment_t
   implicit none (type, external)
   private
   public :: driven_mode_t, make_driven_mode, driven_mode_at, integral_of, work_on, bound_driven_mode, adjoint_of, &
      work_on_free_motion, integral_of_free_motion, resonant, resonates

   !> A harmonic load of frequency w resonates with a mode if |exponent - i w| is less than this fraction of w.
   real(wp), parameter :: resonant = 3.0e-3_wp

   !> A mode and the load that drives it from rest, from `make_driven_mode`.
   type :: driven_mode_t
      !> Complex amplitude of the modal load; the motion is Re(force E)
      complex(wp) :: force = (0.0_wp, 0.0_wp)
      !> Circular frequency of the load: sigma = i frequency; 0: the load is constant or a ramp
      real(wp) :: frequency = 0.0_wp
      !> Whether the load is the ramp t instead of exp(sigma t), and sigma = 0
      logical :: is_ramp = .false.
      !> Damping coefficient 2 a = 2 zeta W^2 + alpha
      real(wp) :: damping = 0.0_wp
      !> W^2, squared circular frequency of the mode without damping
      real(wp) :: square = 0.0_wp
      !> Exponents of the free motion of the mode
      complex(wp) :: exponent(2) = (0.0_wp, 0.0_wp)
      !> Number of terms amplitude exp(point t) whose sum has E as its real part, or E' for a ramp. A pair of conjugate
      !> exponents has one term. 0: the points are too close to each other
      integer :: terms = 0
      complex(wp) :: point(3) = (0.0_wp, 0.0_wp)
      complex(wp) :: amplitude(3) = (0.0_wp, 0.0_wp)
      !> Magnitudes of the points
      real(wp) :: rate(3) = 0.0_wp
      !> Magnitudes of the amplitudes
      real(wp) :: magnitude(3) = 0.0_wp
      !> Time after which the sum is accurate, because any two points s t are farther from each other than 1, and gives
      !> the motion and its bounds
      real(wp) :: terms_from = huge(1.0_wp)
   end type driven_mode_t

   !> Maximum number of points of a divided difference of exp(s t) that gives the motion
   integer, parameter :: max_points = 4

contains

   !> A mode of a set of oscillators and its load, which is zero by default.
   pure type(driven_mode_t) function make_driven_mode(oscillators, place, force, frequency, is_ramp) result(mode)
      type(oscillators_t), intent(in) :: oscillators
      !> Index of the mode
      integer, intent(in) :: place
      !> Complex amplitude of the modal load
      complex(wp), intent(in), optional :: force
      !> Circular frequency of the load; default: 0
      real(wp), intent(in), optional :: frequency
      !> Whether the load is a ramp; default: no
      logical, intent(in), optional :: is_ramp

      associate (decay => oscillators%decay(place), spread => oscillators%spread(place))
         mode%square = oscillators%square(place)
         mode%damping = oscillators%two_zeta*mode%square + oscillators%mass_rate(place)
         if (place <= oscillators%underdamped) then
            mode%exponent = [cmplx(-decay, spread, wp), cmplx(-decay, -spread, wp)]
         else
            mode%exponent = [cmplx(-decay, 0.0_wp, wp), cmplx(-(decay + 2.0_wp*spread), 0.0_wp, wp)]
         end if
      end associate
      if (.not. present(force)) return
      mode%force = force
      if (present(frequency)) mode%frequency = frequency
      if (present(is_ramp)) mode%is_ramp = is_ramp
      call find_terms(mode)
   end function make_driven_mode

   !> Find the terms of the motion, or of its rate if the load is a ramp.
   pure subroutine find_terms(mode)
      type(driven_mode_t), intent(inout) :: mode

      ! minimum distance of two distinct points
      real(wp), parameter :: min_distance = sqrt(tiny(1.0_wp))
      ! distance of each point from the next
      real(wp) :: distance(3)
      integer :: i

      mode%point = [cmplx(0.0_wp, mode%frequency, wp), mode%exponent]
      distance = sqrt(square_of(mode%point - mode%point([2, 3, 1])))
      if (any(distance*distance([3, 1, 2]) < min_distance)) return
      mode%terms = 3
      do i = 1, 3
         associate (next => mode%point(modulo(i, 3) + 1), last => mode%point(modulo(i + 1, 3) + 1))
            mode%amplitude(i) = mode%force/((mode%point(i) - next)*(mode%point(i) - last))
         end associate
      end do
      if (aimag(mode%exponent(1)) > 0.0_wp) then
         mode%terms = 2
         mode%amplitude(2) = mode%amplitude(2) + conjg(mode%amplitude(3))
      end if
      mode%rate = sqrt(square_of(mode%point))
      mode%magnitude = abs(mode%amplitude)
      if (.not. mode%is_ramp) mode%terms_from = 1.0_wp/minval(distance)
   end subroutine find_terms

   !> The motion and its derivatives. The derivative of a divided difference over some points is the first point times
   !> that difference plus the difference over the other points. Derivatives by the equation of motion would amplify
   !> rounding errors in stiff modes. The terms cost a tenth as much.
   pure function driven_mode_at(mode, time, highest) result(derivative)
      type(driven_mode_t), intent(in) :: mode
      real(wp), intent(in) :: time
      !> Highest derivative, >= 1
      integer, intent(in) :: highest
      real(wp) :: derivative(0:highest)

      ! points of the divided differences, as `find_points` gives them
      complex(wp) :: points(0:max_points)
      ! entry i: derivative of order k of the divided difference over the points i to `last`
      complex(wp) :: differences(max_points)
      complex(wp) :: term
      integer :: i, k, last

      if (time > mode%terms_from) then
         derivative = 0.0_wp
         do i = 1, mode%terms
            term = mode%amplitude(i)*exp(mode%point(i)*time)
            do k = 0, highest
               derivative(k) = derivative(k) + real(term, wp)
               term = mode%point(i)*term
            end do
         end do
         return
      end if
      call find_points(mode, points, last)
      call find_differences(points(1:last), time, differences(:last))
      do k = 0, highest
         derivative(k) = real(mode%force*differences(1), wp)
         do i = 1, last - 1
            differences(i) = points(i)*differences(i) + differences(i + 1)
         end do
         differences(last) = points(last)*differences(last)
      end do
   end function driven_mode_at

   !> Points of the divided differences of exp(s t). E has the points 1 to last, i.e. sigma (a ramp: 0 twice) and the
   !> exponents of the mode; E' - sigma E has the points from 2 on; the integral of E has the point 0 in addition.
   pure subroutine find_points(mode, points, last)
      type(driven_mode_t), intent(in) :: mode
      complex(wp), intent(out) :: points(0:max_points)
      !> Index of the last point
      integer, intent(out) :: last

      points = (0.0_wp, 0.0_wp)
      points(1) = cmplx(0.0_wp, mode%frequency, wp)
      last = merge(4, 3, mode%is_ramp)
      points(last - 1:last) = mode%exponent
   end subroutine find_points

   !> Integral of the motion from the start.
   pure real(wp) function integral_of(mode, time) result(value)
      type(driven_mode_t), intent(in) :: mode
      real(wp), intent(in) :: time

      complex(wp) :: points(0:max_points)
      integer :: last

      call find_points(mode, points, last)
      value = real(mode%force*exponential_difference(points(:last), time), wp)
   end function integral_of

   !> Work of a load on the motion, the integral of load times E': by parts for a slope, as half the sum of conjugates
   !> for a harmonic.
   pure real(wp) function work_on(mode, segment, time) result(work)
      type(driven_mode_t), intent(in) :: mode
      !> The load per unit of its modal load
      type(load_segment_t), intent(in) :: segment
      real(wp), intent(in) :: time

      ! displacement and velocity of the mode
      real(wp) :: motion(0:1)

      motion = driven_mode_at(mode, time, 1)
      work = segment%constant*motion(0)
      if (abs(segment%slope) > 0.0_wp) work = work + segment%slope*(time*motion(0) - integral_of(mode, time))
      if (abs(segment%harmonic) <= 0.0_wp) return
      associate (load_exponent => cmplx(0.0_wp, segment%frequency, wp))
         work = work + 0.5_wp*real(mode%force*(segment%harmonic*integral_with(load_exponent) &
            + conjg(segment%harmonic)*integral_with(-load_exponent)), wp)
      end associate

   contains

      !> Integral of exp(theta t) E' from the start, the sum of sigma E and E' - sigma E, whose points `find_points`
      !> gives. The factor exp(theta t) shifts all points by theta; the integral adds the point 0.
      pure function integral_with(theta) result(value)
         complex(wp), intent(in) :: theta
         complex(wp) :: value

         complex(wp) :: points(0:max_points)
         integer :: last

         call find_points(mode, points, last)
         points(1:) = points(1:) + theta
         value = (0.0_wp, 0.0_wp)
         if (mode%frequency > 0.0_wp) value = cmplx(0.0_wp, mode%frequency, wp) &
            *exponential_difference(points(:last), time)
         points(1) = (0.0_wp, 0.0_wp)
         value = value + exponential_difference(points(1:last), time)
      end function integral_with
   end function work_on

   !> Work of a load on the free motion of the mode, z' = v0 h' - W^2 z0 h with h the response to a unit impulse.
   pure real(wp) function work_on_free_motion(mode, start, segment, time) result(work)
      type(driven_mode_t), intent(in) :: mode
      !> z and z' at time 0
      real(wp), intent(in) :: start(2)
      !> The load per unit of its modal load
      type(load_segment_t), intent(in) :: segment
      real(wp), intent(in) :: time

      complex(wp), parameter :: zero = (0.0_wp, 0.0_wp)
      ! change of the displacement since time 0
      complex(wp) :: change
      ! i times the frequency of the load
      complex(wp) :: theta

      change = start(2)*exponential_difference(mode%exponent, time) &
         - mode%square*start(1)*exponential_difference([zero, mode%exponent], time)
      work = segment%constant*real(change, wp)
      if (abs(segment%slope) > 0.0_wp) then
         work = work + segment%slope*(time*(start(1) + real(change, wp)) - integral_of_free_motion(mode, start, time))
      end if
      if (abs(segment%harmonic) <= 0.0_wp) return
      theta = cmplx(0.0_wp, segment%frequency, wp)
      ! h' is exponent(1) h + exp(exponent(2) t); the factor exp(theta t) shifts the exponents, the integral adds 0
      associate (exponent => mode%exponent + theta)
         work = work + real(segment%harmonic*(start(2)*exponential_difference([zero, exponent(2)], time) &
            + (start(2)*mode%exponent(1) - mode%square*start(1))*exponential_difference([zero, exponent], time)), wp)
      end associate
   end function work_on_free_motion

   !> Integral of the free motion of the mode.
   pure real(wp) function integral_of_free_motion(mode, start, time) result(value)
      type(driven_mode_t), intent(in) :: mode
      !> z and z' at time 0
      real(wp), intent(in) :: start(2)
      real(wp), intent(in) :: time

      complex(wp), parameter :: zero = (0.0_wp, 0.0_wp)

      value = start(1)*time + real(start(2)*exponential_difference([zero, mode%exponent], time) &
         - mode%square*start(1)*exponential_difference([zero, zero, mode%exponent], time), wp)
   end function integral_of_free_motion

   !> Bounds on the motion and its derivatives between two instants. After a unit impulse neither the velocity of the
   !> mode nor W times its displacement exceeds 1; the load is a superposition of impulses, and the equation of motion
   !> gives the bound on each further derivative. The derivatives of the response to a constant load are a free motion
   !> after any instant, so each is bounded by its value and that of the next derivative at that instant. Finally, no
   !> derivative exceeds the sum of the magnitudes of its terms, none of which grows.
   pure subroutine bound_driven_mode(mode, until, bounds, from, derivative)
      type(driven_mode_t), intent(in) :: mode
      !> Instant up to which the bounds hold
      real(wp), intent(in) :: until
      !> Bounds on the motion (index 0) and its derivatives, [0 : highest derivative]
      real(wp), intent(out) :: bounds(0:)
      !> Instant from which the bounds hold; default: the start
      real(wp), intent(in), optional :: from
      !> Motion and derivatives at that instant, up to one order higher than the bounds
      real(wp), intent(in), optional :: derivative(0:)

      ! the square of the time must not overflow
      real(wp), parameter :: max_time = 1.0e100_wp
      ! bound on the load's derivative of the order k - 2
      real(wp) :: load_bound
      ! maximum of the response to a unit impulse
      real(wp) :: max_response
      ! time in which the response to an impulse decays
      real(wp) :: length
      ! bound on the motion if earlier impulses have decayed
      real(wp) :: decayed_bound
      real(wp) :: time
      integer :: k

      time = min(until, max_time)
      max_response = min(time, 1.0_wp/sqrt(mode%square), &
         2.0_wp/max(abs(mode%exponent(1) - mode%exponent(2)), tiny(1.0_wp)))
      bounds(0) = time*min(max_response, 0.5_wp*time)
      bounds(1) = time
      if (abs(aimag(mode%exponent(1))) > 0.0_wp) then
         ! the effect of earlier impulses has decayed
         length = min(time, 2.0_wp/max(mode%damping, tiny(1.0_wp)))
         decayed_bound = length/abs(aimag(mode%exponent(1)))
         bounds(0) = min(bounds(0), decayed_bound)
         bounds(1) = min(bounds(1), sqrt(mode%square)*decayed_bound)
      end if
      load_bound = 1.0_wp
      if (.not. mode%frequency > 0.0_wp) then
         bounds(0) = min(bounds(0), 2.0_wp/mode%square)
         bounds(1) = min(bounds(1), max_response)
         if (mode%is_ramp) then
            bounds(1) = bounds(0)
            bounds(0) = time*bounds(0)
            load_bound = time
         end if
      end if
      do k = 2, ubound(bounds, 1)
         bounds(k) = load_bound + mode%damping*bounds(k - 1) + mode%square*bounds(k - 2)
         if (mode%is_ramp) load_bound = merge(1.0_wp, 0.0_wp, k == 2)
         if (.not. mode%is_ramp) load_bound = load_bound*mode%frequency
      end do
      bounds = min(abs(mode%force)*bounds, sums_of_magnitudes(mode, ubound(bounds, 1), from))
      if (.not. present(derivative) .or. mode%frequency > 0.0_wp) return
      do k = merge(2, 1, mode%is_ramp), ubound(bounds, 1)
         bounds(k) = min(bounds(k), hypot(derivative(k), derivative(k + 1)/sqrt(mode%square)))
      end do
   end subroutine bound_driven_mode

   !> Bounds by the sum of the magnitudes of the terms of the motion and its derivatives, none of which grows after an
   !> instant. The rate of the response to a ramp is the response to a constant.
   pure function sums_of_magnitudes(mode, highest, from) result(bounds)
      type(driven_mode_t), intent(in) :: mode
      !> Highest derivative
      integer, intent(in) :: highest
      !> Instant from which the bounds hold; default: the start
      real(wp), intent(in), optional :: from
      real(wp) :: bounds(0:highest)

      ! magnitude of a derivative of a term
      real(wp) :: magnitude
      integer :: i, k, lowest

      bounds = huge(1.0_wp)
      if (mode%terms == 0) return
      lowest = merge(1, 0, mode%is_ramp)
      bounds(lowest:) = 0.0_wp
      do i = 1, mode%terms
         magnitude = mode%magnitude(i)
         if (present(from)) magnitude = magnitude*exp(real(mode%point(i), wp)*from)
         do k = lowest, highest
            bounds(k) = bounds(k) + magnitude
            magnitude = mode%rate(i)*magnitude
         end do
      end do
   end function sums_of_magnitudes

   !> Response of uncoupled modes to a harmonic load by the adjoint equation (damping of the other sign).
   pure function adjoint_of(oscillators, load, frequency, left_out) result(response)
      type(oscillators_t), intent(in) :: oscillators
      !> Modal loads, [modes]
      real(wp), intent(in) :: load(:)
      real(wp), intent(in) :: frequency
      !> Whether a mode has no response, because it is driven from rest, [modes]
      logical, intent(in) :: left_out(:)
      complex(wp) :: response(size(load))

      real(wp) :: damping(size(load))

      response = (0.0_wp, 0.0_wp)
      damping = oscillators%two_zeta*oscillators%square + oscillators%mass_rate(:size(load))
      where (.not. left_out) response = load/cmplx(oscillators%square - frequency**2, -damping*frequency, wp)
   end function adjoint_of

   !> Whether each mode is in resonance with a harmonic load, [modes].
   pure function resonates(oscillators, frequency) result(answer)
      type(oscillators_t), intent(in) :: oscillators
      real(wp), intent(in) :: frequency
      logical :: answer(oscillators%count)

      answer = .false.
      associate (n => oscillators%underdamped)
         answer(:n) = hypot(oscillators%decay(:n), oscillators%spread(:n) - frequency) <= resonant*frequency
      end associate
   end function resonates

end module driven_modes
