!> Flights (motions with the contact open) so short that no mode oscillates or decays by more than a few radians in
!> them: the end of a flight is the zero of the Taylor series of s(t)/t about the start, with s the gap, which is zero
!> at the start.
module short_flights
   use certified_search, only: found_none, found_zero, search_t, step_without_zero
   use damped_oscillators, only: lanes, oscillators_t
   use kinds, only: i8, wp
   implicit none (type, external)
   private
   public :: find_short_flight, zero_of_series

   !> Maximum number of terms of the series; up to `max_angle` of `find_short_flight`, 35 terms suffice.
   integer, parameter :: max_terms = 40
   !> Maximum number of derivatives at the start: one more than terms, because one more derivative bounds the remainder.
   integer, parameter :: max_derivatives = max_terms + 1
   ! implied-do variable of the following constants
   integer :: n
   !> 1/k! for k from 1 on.
   real(wp), parameter :: inverse_factorial(max_derivatives) = 1.0_wp/[(gamma(real(n + 1, wp)), n=1, max_derivatives)]
   !> k terms are expected to suffice if the length of the interval times the fastest modal rate does not exceed
   !> max_angles(k): if all modes have this rate, the remainder of the series is about 0.2 epsilon/(k + 1) of s'(0).
   !> `find_short_flight` checks the remainder.
   real(wp), parameter :: max_angles(3:max_terms) = [((0.2_wp*epsilon(1.0_wp)*gamma(real(n + 1, wp))) &
      **(1.0_wp/real(n, wp)), n=3, max_terms)]

contains

   !> The end of a short flight, in which the signal is zero at the start and rises. The end is certain: the first
   !> derivative that the series omits has a bound for all later times, because each derivative of a modal displacement
   !> satisfies the equation of the mode, whose energy decays; this bounds the remainder of the series.
   subroutine find_short_flight(oscillators, weight, z, v, limit, search, slope, harmonics, frequency)
      type(oscillators_t), intent(in) :: oscillators
      !> Weights of the modes in the signal, [padded]
      real(wp), contiguous, intent(in) :: weight(:)
      !> Displacements of the modes at the start, [padded]
      real(wp), intent(in) :: z(:)
      !> Velocities of the modes at the start, [padded]
      real(wp), intent(in) :: v(:)
      !> End of the search
      real(wp), intent(in) :: limit
      !> The zero, the value in the middle, an upper bound of the signal; `found_none`: the zero is not certain
      type(search_t), intent(inout) :: search
      !> Slope of a further linear term; `slope`, `harmonics` and `frequency` are given together or not at all
      real(wp), intent(in), optional :: slope
      !> Amplitudes h of further terms Re h exp(i W t), [harmonics]; changed, without use for the caller
      complex(wp), intent(inout), optional :: harmonics(:)
      !> Frequencies W of these terms, [harmonics]
      real(wp), intent(in), optional :: frequency(:)

      ! the series is used up to this multiple of the estimated zero, because the zero may lie later
      real(wp), parameter :: margin = 1.25_wp
      ! maximum of `length*rate`, in radians; longer flights are left to the general search
      real(wp), parameter :: max_angle = 4.5_wp
      ! derivatives of faster modes may overflow
      real(wp), parameter :: max_rate = 1.0e5_wp
      ! a derivative of the modal displacements, [padded]
      real(wp) :: low(size(weight))
      ! the next derivative, [padded]
      real(wp) :: high(size(weight))
      ! weighted sums of the derivatives in each SIMD lane, [lanes, order]
      real(wp) :: total(lanes, max_derivatives)
      ! coefficients s^(k)/k! of the series
      real(wp) :: coefficient(max_derivatives)
      ! magnitude of the fastest exponent of the modes
      real(wp) :: rate
      ! time up to which the series is used
      real(wp) :: length
      ! bound on the first omitted term of the series of s(t)/t
      real(wp) :: remainder
      ! length^terms/(terms + 1)!, a factor of this bound
      real(wp) :: factor
      ! end of the flight
      real(wp) :: step
      ! number of terms of the series
      integer :: terms
      logical :: is_short

      search%outcome = found_none
      associate (n => oscillators%count, square => oscillators%lane_square, two_zeta => oscillators%two_zeta)
         ! `add_derivatives` has no damping proportional to mass
         if (any(abs(oscillators%mass_rate) > 0.0_wp)) return
         low = z
         high = v
         rate = oscillators%frequency(n)
         if (oscillators%underdamped < n) rate = oscillators%decay(n) + 2.0_wp*oscillators%spread(n)
         if (rate > max_rate) return
         call add_derivatives(size(weight)/lanes, 1, 3, square, two_zeta, weight, low, high, total)
         call find_coefficients(total, 1, 3, coefficient, slope, harmonics, frequency)
         if (.not. (coefficient(1) > 0.0_wp .and. coefficient(2) < 0.0_wp)) return
         length = margin*estimated_zero(coefficient(:3))
         if (length >= limit .or. length*rate > max_angle) return
         terms = min(3 + count(max_angles < length*rate), max_terms)
         call add_derivatives(size(weight)/lanes, 4, terms + 1, square, two_zeta, weight, low, high, total)
         call find_coefficients(total, 4, terms + 1, coefficient, slope, harmonics, frequency)
         ! energy bound of the omitted derivative of order terms + 1; the squares of derivatives alone could overflow
         factor = inverse_factorial(terms + 1)*length**terms
         remainder = sum(abs(weight)*sqrt((factor*low)**2 + (factor*high)**2*oscillators%inverse_square))
         if (present(harmonics)) remainder = remainder + factor*sum(abs(real(harmonics, wp)) + abs(aimag(harmonics)))
      end associate
      if (.not. remainder <= epsilon(1.0_wp)*coefficient(1)) return
      call zero_of_series(coefficient(:terms), length, is_short, step)
      if (.not. is_short) return
      search%outcome = found_zero
      search%evaluations = 1_i8
      search%time = step
      call maximum_of_series(coefficient(:terms), step, search%max_value, search%ceiling)
      search%ceiling = search%ceiling + remainder*step
   end subroutine find_short_flight

   !> Taylor coefficients from derivatives.
   pure subroutine find_coefficients(total, from, to, coefficient, slope, harmonics, frequency)
      !> Weighted sums of the modal derivatives in each SIMD lane
      real(wp), intent(in) :: total(lanes, max_derivatives)
      !> First coefficient to be computed
      integer, intent(in) :: from
      !> Last coefficient to be computed
      integer, intent(in) :: to
      !> Coefficients s^(k)/k! of the series
      real(wp), intent(inout) :: coefficient(max_derivatives)
      !> Slope of a further term, as in `find_short_flight`
      real(wp), intent(in), optional :: slope
      !> Further terms Re h exp(i W t). On entry the derivative of order `from` - 1 of h exp(i W t) at t = 0; on return
      !> that of order `to`
      complex(wp), intent(inout), optional :: harmonics(:)
      !> Frequencies W of these terms, [harmonics]
      real(wp), intent(in), optional :: frequency(:)

      complex(wp) :: derivative
      integer :: k, m

      do k = from, to
         coefficient(k) = sum(total(:, k))
      end do
      if (present(harmonics)) then
         if (from == 1) coefficient(1) = coefficient(1) + slope
         do m = 1, size(harmonics)
            derivative = harmonics(m)
            do k = from, to
               derivative = cmplx(-frequency(m)*aimag(derivative), frequency(m)*real(derivative, wp), wp)
               coefficient(k) = coefficient(k) + real(derivative, wp)
            end do
            harmonics(m) = derivative
         end do
      end if
      coefficient(from:to) = coefficient(from:to)*inverse_factorial(from:to)
   end subroutine find_coefficients

   !> Estimate of the first zero of c_1 + c_2 t + c_3 t^2 + ...: from the second on, the terms are continued as a
   !> geometric series with the ratio c_3 t/c_2.
   pure real(wp) function estimated_zero(coefficient) result(t)
      !> c_1 > 0, c_2 < 0, c_3
      real(wp), intent(in) :: coefficient(3)

      ! maximum ratio of the estimate to the zero of the first two terms
      real(wp), parameter :: max_ratio = 3.0_wp
      ! the estimate if c_2 is too small to be squared
      real(wp), parameter :: never = 1.0e290_wp
      ! c_2^2
      real(wp) :: square

      square = coefficient(2)**2
      t = never
      if (square > tiny(1.0_wp)) then
         t = -coefficient(1)*coefficient(2)/max(square - coefficient(1)*coefficient(3), square/max_ratio)
      end if
   end function estimated_zero

   !> Value in the middle, and an upper bound, of c_1 t + c_2 t^2 + c_3 t^3 + ... before its zero.
   pure subroutine maximum_of_series(coefficient, zero, mid_value, ceiling)
      !> Coefficients c
      real(wp), intent(in) :: coefficient(:)
      !> The zero
      real(wp), intent(in) :: zero
      !> Value at half of the zero, near which the maximum is
      real(wp), intent(out) :: mid_value
      !> Upper bound of the maximum
      real(wp), intent(out) :: ceiling

      real(wp) :: curvature, half, slope
      integer :: k

      half = 0.5_wp*zero
      call evaluate_series(coefficient, half, mid_value, slope)
      slope = mid_value + half*slope
      mid_value = half*mid_value
      ! upper bound of the second derivative up to the zero: its term from c_2 is constant, each other term is at most
      ! its value at the zero or 0
      curvature = 0.0_wp
      do k = size(coefficient), 2, -1
         curvature = curvature*zero + real(k*(k - 1), wp)*merge(coefficient(2), max(coefficient(k), 0.0_wp), k == 2)
      end do
      if (-curvature*half > abs(slope)) then
         ceiling = mid_value - 0.5_wp*slope**2/curvature
      else
         ceiling = mid_value + half*(abs(slope) + 0.5_wp*half*max(curvature, 0.0_wp))
      end if
   end subroutine maximum_of_series

   !> Weighted sums of further derivatives of the oscillators.
   pure subroutine add_derivatives(blocks, from, to, square, two_zeta, weight, low, high, total)
      !> Number of SIMD vectors in each array
      integer, intent(in) :: blocks
      !> Order of the first derivative to be computed
      integer, intent(in) :: from
      !> Order of the last derivative to be computed
      integer, intent(in) :: to
      !> W^2 of the modes
      real(wp), intent(in) :: square(lanes, blocks)
      !> 2 zeta: the equation of a mode is z'' = -W^2 (z + 2 zeta z')
      real(wp), intent(in) :: two_zeta
      !> Weights of the modes in the signal
      real(wp), intent(in) :: weight(lanes, blocks)
      !> On entry derivative of order `from` - 1; on return derivative of order `to`
      real(wp), intent(inout), dimension(lanes, blocks) :: low
      !> On entry derivative of order `from`; on return derivative of order `to` + 1
      real(wp), intent(inout), dimension(lanes, blocks) :: high
      !> Sums of the derivatives in each SIMD lane
      real(wp), intent(inout) :: total(lanes, max_derivatives)

      real(wp), dimension(lanes) :: next, current, minus_square, factor
      integer :: b, i, k

      total(:, from:to) = 0.0_wp
      do b = 1, blocks
         current = low(:, b)
         next = high(:, b)
         minus_square = -square(:, b)
         factor = weight(:, b)
         do k = from, to
            !$omp simd
            do i = 1, lanes
               total(i, k) = total(i, k) + factor(i)*next(i)
               low(i, b) = minus_square(i)*(current(i) + two_zeta*next(i))
               current(i) = next(i)
               next(i) = low(i, b)
            end do
         end do
         low(:, b) = current
         high(:, b) = next
      end do
   end subroutine add_derivatives

   !> First zero of c_1 + c_2 t + c_3 t^2 + ... in an interval.
   pure subroutine zero_of_series(coefficient, length, is_found, t)
      !> Coefficients c, three or more, c_1 > 0
      real(wp), intent(in) :: coefficient(:)
      !> End of the interval
      real(wp), intent(in) :: length
      !> Whether a zero is found; false: the interval has no zero, or the search needs more steps than permitted
      logical, intent(out) :: is_found
      !> The zero; undefined if none is found
      real(wp), intent(out) :: t

      ! maximum number of steps without a zero
      integer, parameter :: step_cap = 24
      ! maximum number of Newton steps
      integer, parameter :: iteration_cap = 12
      ! coefficients of the series in t over the length of the interval
      real(wp) :: scaled(size(coefficient))
      ! upper bound of the second derivative, >= 0
      real(wp) :: upward_curvature
      ! upper bound of minus the second derivative, >= 0
      real(wp) :: downward_curvature
      ! bound on the rounding error of the series
      real(wp) :: rounding
      ! instants between which the zero lies
      real(wp) :: first, last
      real(wp) :: power, slope, step, term, value
      integer :: i, k

      power = 1.0_wp
      do k = 1, size(coefficient)
         scaled(k) = coefficient(k)*power
         power = power*length
      end do
      upward_curvature = 0.0_wp
      downward_curvature = 0.0_wp
      rounding = 0.0_wp
      !$omp simd reduction(+:upward_curvature, downward_curvature, rounding) private(term)
      do k = 1, size(coefficient)
         term = real((k - 1)*(k - 2), wp)*scaled(k)
         upward_curvature = upward_curvature + max(term, 0.0_wp)
         downward_curvature = downward_curvature - min(term, 0.0_wp)
         rounding = rounding + abs(scaled(k))
      end do
      rounding = epsilon(1.0_wp)*rounding
      is_found = .false.
      first = 0.0_wp
      value = scaled(1)
      slope = scaled(2)
      do i = 1, step_cap
         if (slope < 0.0_wp .and. slope**2 > 4.0_wp*upward_curvature*value) exit
         first = first + step_without_zero(value, slope, downward_curvature)
         if (first > 1.0_wp .or. i == step_cap) return
         call evaluate_series(scaled, first, value, slope)
      end do
      ! from `first` to `last` the slope is less than half of its value at `first`, so the series falls to zero before
      ! `last`
      last = min(1.0_wp, first - 2.0_wp*value/slope)
      t = estimated_zero(scaled(:3))
      if (.not. (t > first .and. t < last)) t = first
      do i = 1, iteration_cap
         call evaluate_series(scaled, t, value, slope)
         step = -value/slope
         t = t + step
         is_found = abs(step) <= max(2.0_wp*spacing(t), rounding/abs(slope))
         if (is_found) exit
         if (.not. (t > first .and. t < last)) t = first
      end do
      is_found = is_found .and. t > 0.0_wp .and. t <= last
      t = t*length
   end subroutine zero_of_series

   !> c_1 + c_2 t + c_3 t^2 + ... and its slope.
   pure subroutine evaluate_series(coefficient, t, value, slope)
      !> Coefficients c
      real(wp), intent(in) :: coefficient(:)
      !> Instant
      real(wp), intent(in) :: t
      !> Value
      real(wp), intent(out) :: value
      !> Slope
      real(wp), intent(out) :: slope

      real(wp) :: even, even_slope, odd, odd_slope, square
      integer :: k, n

      ! even and odd powers are summed independently, which takes half the time
      square = t*t
      n = size(coefficient)
      even = 0.0_wp
      odd = 0.0_wp
      even_slope = 0.0_wp
      odd_slope = 0.0_wp
      if (modulo(n, 2) == 1) even = coefficient(n)
      do k = 2*(n/2), 2, -2
         odd_slope = odd_slope*square + odd
         odd = odd*square + coefficient(k)
         even_slope = even_slope*square + even
         even = even*square + coefficient(k - 1)
      end do
      value = even + t*odd
      slope = odd + 2.0_wp*t*(even_slope + t*odd_slope)
   end subroutine evaluate_series

end module short_flights
