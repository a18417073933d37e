!> Hops so short that the modes hardly turn: their end by the Taylor series of s(t)/t about the start.
module short_flights
   use certified_search, only: found_none, found_zero, search_t, step_without_zero
   use damped_oscillators, only: lanes, oscillators_t
   use kinds, only: i8, wp
   implicit none (type, external)
   private
   public :: find_short_flight, zero_of_series

   !> So many terms are used, by the derivatives at the start, and bounds on that of one more.
   integer, parameter :: most_terms = 40
   integer, parameter :: most_derivatives = most_terms + 1
   integer :: place
   real(wp), parameter :: inverse_factorial(most_derivatives) = 1.0_wp/[(gamma(real(place + 1, wp)), place=1, &
      most_derivatives)]
   !> The angle up to which it takes so many terms, if no mode turns or dies out by more.
   real(wp), parameter :: greatest_angles(3:most_terms) = [((0.2_wp*epsilon(1.0_wp)*gamma(real(place + 1, wp))) &
      **(1.0_wp/real(place, wp)), place=3, most_terms)]

contains

   !> The end of a short flight, certain since the remainder is bounded by the swing of the first derivative left out.
   subroutine find_short_flight(oscillators, weight, z, v, limit, search, slope, turning, frequency)
      type(oscillators_t), intent(in) :: oscillators
      !> Of the modes in the signal, which rises from zero, [padded]
      real(wp), contiguous, intent(in) :: weight(:)
      !> Their state, [count]
      real(wp), intent(in) :: z(:)
      real(wp), intent(in) :: v(:)
      !> Where the search ends
      real(wp), intent(in) :: limit
      !> Gets the first zero, and how far the signal reaches before, if it is certain; else its outcome is `found_none`
      type(search_t), intent(inout) :: search
      !> What else is in the signal: its slope, and what turns with i W, [harmonics]; as often differentiated as was
      !> needed on return. All of them or none.
      real(wp), intent(in), optional :: slope
      complex(wp), intent(inout), optional :: turning(:)
      real(wp), intent(in), optional :: frequency(:)

      ! the series is used up to this multiple of the zero that its first terms tell, if no mode turns or dies out by
      ! more than an angle
      real(wp), parameter :: margin = 1.25_wp, greatest_angle = 4.5_wp
      ! and as long as derivatives do not overflow
      real(wp), parameter :: greatest_rate = 1.0e5_wp
      real(wp), dimension(size(weight)) :: low, high
      ! weighted sums of the derivatives, lane by lane; s^(k)/k!
      real(wp) :: total(lanes, most_derivatives), coefficient(most_derivatives)
      real(wp) :: rate, reach, remainder, share, step
      integer :: terms
      logical :: is_short

      search%outcome = found_none
      associate (n => oscillators%count, square => oscillators%lane_square, two_zeta => oscillators%two_zeta)
         if (any(oscillators%mass_rate > 0.0_wp)) return
         low(n + 1:) = 0.0_wp
         high(n + 1:) = 0.0_wp
         low(:n) = z
         high(:n) = v
         rate = oscillators%frequency(n)
         if (oscillators%oscillating < n) rate = oscillators%decay(n) + 2.0_wp*oscillators%spread(n)
         if (rate > greatest_rate) return
         call add_derivatives(size(weight)/lanes, 1, 3, square, two_zeta, weight, low, high, total)
         call divide(total, 1, 3, coefficient, slope, turning, frequency)
         if (.not. (coefficient(1) > 0.0_wp .and. coefficient(2) < 0.0_wp)) return
         reach = margin*early_zero(coefficient(:3))
         if (reach >= limit .or. reach*rate > greatest_angle) return
         terms = min(3 + count(greatest_angles < reach*rate), most_terms)
         call add_derivatives(size(weight)/lanes, 4, terms + 1, square, two_zeta, weight, low, high, total)
         call divide(total, 4, terms + 1, coefficient, slope, turning, frequency)
         ! bounded as in `bound_terms`; squares of the derivatives alone could overflow
         share = inverse_factorial(terms + 1)*reach**terms
         remainder = sum(abs(weight)*sqrt((share*low)**2 + (share*high)**2*oscillators%inverse_square))
         if (present(turning)) remainder = remainder + share*sum(abs(real(turning, wp)) + abs(aimag(turning)))
      end associate
      if (.not. remainder <= epsilon(1.0_wp)*coefficient(1)) return
      call zero_of_series(coefficient(:terms), reach, is_short, step)
      if (.not. is_short) return
      search%outcome = found_zero
      search%evaluations = 1_i8
      search%time = step
      call height_of_series(coefficient(:terms), step, search%greatest, search%ceiling)
      search%ceiling = search%ceiling + remainder*step
   end subroutine find_short_flight

   !> Coefficients from derivatives.
   pure subroutine divide(total, from, to, coefficient, slope, turning, frequency)
      !> The modes' weighted sums, lane by lane
      real(wp), intent(in) :: total(lanes, most_derivatives)
      !> The first and the last of them
      integer, intent(in) :: from
      integer, intent(in) :: to
      real(wp), intent(inout) :: coefficient(most_derivatives)
      !> What is added, as above, differentiated as often as the last before these
      real(wp), intent(in), optional :: slope
      complex(wp), intent(inout), optional :: turning(:)
      real(wp), intent(in), optional :: frequency(:)

      complex(wp) :: now
      integer :: k, m

      do k = from, to
         coefficient(k) = sum(total(:, k))
      end do
      if (present(turning)) then
         if (from == 1) coefficient(1) = coefficient(1) + slope
         do m = 1, size(turning)
            now = turning(m)
            do k = from, to
               now = cmplx(-frequency(m)*aimag(now), frequency(m)*real(now, wp), wp)
               coefficient(k) = coefficient(k) + real(now, wp)
            end do
            turning(m) = now
         end do
      end if
      coefficient(from:to) = coefficient(from:to)*inverse_factorial(from:to)
   end subroutine divide

   !> About where c_1 + c_2 t + c_3 t^2 + ... has its first zero, as if the terms from the second on were those of a
   !> geometric series: what pulls back dies out.
   pure function early_zero(coefficient) result(t)
      !> c, the first one positive, the second negative
      real(wp), intent(in) :: coefficient(3)
      real(wp) :: t

      ! no later than so many times the zero of the first two
      real(wp), parameter :: latest = 3.0_wp, never = 1.0e290_wp
      real(wp) :: square

      square = coefficient(2)**2
      t = never
      if (square > tiny(1.0_wp)) then
         t = -coefficient(1)*coefficient(2)/max(square - coefficient(1)*coefficient(3), square/latest)
      end if
   end function early_zero

   !> How far c_1 t + c_2 t^2 + c_3 t^3 + ... reaches before its zero.
   pure subroutine height_of_series(coefficient, zero, greatest, ceiling)
      !> c
      real(wp), intent(in) :: coefficient(:)
      !> Where it is zero
      real(wp), intent(in) :: zero
      !> As high as this in the middle, near which its peak is
      real(wp), intent(out) :: greatest
      !> And no higher than this
      real(wp), intent(out) :: ceiling

      real(wp) :: bend, half, slope
      integer :: k

      half = 0.5_wp*zero
      call evaluate_series(coefficient, half, greatest, slope)
      slope = greatest + half*slope
      greatest = half*greatest
      ! no lesser bend downwards than this
      bend = 0.0_wp
      do k = size(coefficient), 2, -1
         bend = bend*zero + real(k*(k - 1), wp)*merge(coefficient(2), max(coefficient(k), 0.0_wp), k == 2)
      end do
      if (-bend*half > abs(slope)) then
         ceiling = greatest - 0.5_wp*slope**2/bend
      else
         ceiling = greatest + half*(abs(slope) + 0.5_wp*half*max(bend, 0.0_wp))
      end if
   end subroutine height_of_series

   !> Weighted sums of further derivatives of the oscillators.
   pure subroutine add_derivatives(blocks, from, to, square, two_zeta, weight, low, high, total)
      !> Vectors in each array
      integer, intent(in) :: blocks
      !> The first and the last of these derivatives
      integer, intent(in) :: from
      integer, intent(in) :: to
      !> W^2, and 2 zeta
      real(wp), intent(in) :: square(lanes, blocks)
      real(wp), intent(in) :: two_zeta
      real(wp), intent(in) :: weight(lanes, blocks)
      !> The two derivatives from `from` - 1 on; from `to` on on return
      real(wp), intent(inout), dimension(lanes, blocks) :: low, high
      !> Their sums, lane by lane
      real(wp), intent(inout) :: total(lanes, most_derivatives)

      real(wp), dimension(lanes) :: next, now, pull, share
      integer :: b, i, k

      total(:, from:to) = 0.0_wp
      do b = 1, blocks
         now = low(:, b)
         next = high(:, b)
         pull = -square(:, b)
         share = weight(:, b)
         do k = from, to
            !$omp simd
            do i = 1, lanes
               total(i, k) = total(i, k) + share(i)*next(i)
               low(i, b) = pull(i)*(now(i) + two_zeta*next(i))
               now(i) = next(i)
               next(i) = low(i, b)
            end do
         end do
         low(:, b) = now
         high(:, b) = next
      end do
   end subroutine add_derivatives

   !> First zero of c_1 + c_2 t + c_3 t^2 + ... up to a reach.
   pure subroutine zero_of_series(coefficient, reach, is_found, t)
      !> c, three or more, the first one positive
      real(wp), intent(in) :: coefficient(:)
      !> Up to here
      real(wp), intent(in) :: reach
      !> There is one
      logical, intent(out) :: is_found
      !> Where
      real(wp), intent(out) :: t

      integer, parameter :: step_cap = 24, iteration_cap = 12
      ! of t over the reach
      real(wp) :: scaled(size(coefficient))
      real(wp) :: above, below, doubt, first, last, power, slope, step, term, value
      integer :: i, k

      power = 1.0_wp
      do k = 1, size(coefficient)
         scaled(k) = coefficient(k)*power
         power = power*reach
      end do
      ! bounds on the second derivative, and on the rounding error
      above = 0.0_wp
      below = 0.0_wp
      doubt = 0.0_wp
      !$omp simd reduction(+:above, below, doubt) private(term)
      do k = 1, size(coefficient)
         term = real((k - 1)*(k - 2), wp)*scaled(k)
         above = above + max(term, 0.0_wp)
         below = below - min(term, 0.0_wp)
         doubt = doubt + abs(scaled(k))
      end do
      doubt = epsilon(1.0_wp)*doubt
      is_found = .false.
      first = 0.0_wp
      value = scaled(1)
      slope = scaled(2)
      do i = 1, step_cap
         if (slope < 0.0_wp .and. slope**2 > 4.0_wp*above*value) exit
         first = first + step_without_zero(value, slope, below)
         if (first > 1.0_wp .or. i == step_cap) return
         call evaluate_series(scaled, first, value, slope)
      end do
      ! from here on it falls until it is zero
      last = min(1.0_wp, first - 2.0_wp*value/slope)
      t = early_zero(scaled(:3))
      if (.not. (t > first .and. t < last)) t = first
      do i = 1, iteration_cap
         call evaluate_series(scaled, t, value, slope)
         step = -value/slope
         t = t + step
         is_found = abs(step) <= max(2.0_wp*spacing(t), doubt/abs(slope))
         if (is_found) exit
         if (.not. (t > first .and. t < last)) t = first
      end do
      is_found = is_found .and. t > 0.0_wp .and. t <= last
      t = t*reach
   end subroutine zero_of_series

   !> c_1 + c_2 t + c_3 t^2 + ... and its slope.
   pure subroutine evaluate_series(coefficient, t, value, slope)
      !> c
      real(wp), intent(in) :: coefficient(:)
      !> Where
      real(wp), intent(in) :: t
      !> Value and slope
      real(wp), intent(out) :: value
      real(wp), intent(out) :: slope

      real(wp) :: even, even_slope, odd, odd_slope, square
      integer :: k, n

      ! even and odd powers at once take half the time
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
