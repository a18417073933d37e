!> Hops so short that the modes hardly turn: their end by the Taylor series of s(t)/t about the start.
module short_flights
   use certified_search, only: found_zero, search_t, step_without_zero
   use damped_oscillators, only: oscillators_t
   use kinds, only: i8, wp
   implicit none (type, external)
   private
   public :: find_short_flight, zero_of_series, most_derivatives, added_value, added_bound

   !> So many derivatives of what is added to the modes are used, by their values at the start and bounds on them.
   integer, parameter :: most_terms = 24
   integer, parameter :: most_derivatives = most_terms + 1
   integer, parameter :: added_value = 1
   integer, parameter :: added_bound = 2

contains

   !> The end of a short flight, certain since the remainder is bounded by the swing of the first derivative left out.
   subroutine find_short_flight(oscillators, weight, z, v, limit, is_short, search, added)
      type(oscillators_t), intent(in) :: oscillators
      !> Of the modes in the signal, which rises from zero, [padded]
      real(wp), contiguous, intent(in) :: weight(:)
      !> Their state, [count]
      real(wp), intent(in) :: z(:)
      real(wp), intent(in) :: v(:)
      !> Where the search ends
      real(wp), intent(in) :: limit
      !> The first zero is certain to be the one returned
      logical, intent(out) :: is_short
      !> Gets it, and how far the signal reaches before
      type(search_t), intent(inout) :: search
      !> Derivatives of what else is in the signal: at the start and bounds on them, [`most_derivatives`, 2]
      real(wp), intent(in), optional :: added(:, :)

      ! the series is used up to this multiple of the zero of its first two terms, if no mode turns by more than an
      ! angle
      real(wp), parameter :: margin = 1.6_wp, greatest_angle = 2.0_wp
      ! and as long as derivatives do not overflow
      real(wp), parameter :: most_decades = 250.0_wp
      real(wp), dimension(size(weight)) :: low, high, next
      ! s^(k)/k!
      real(wp) :: coefficient(most_derivatives)
      real(wp) :: angle, first, reach, remainder, second, share, step
      integer :: i, k, terms

      is_short = .false.
      associate (n => oscillators%count, square => oscillators%lane_square, two_zeta => oscillators%two_zeta)
         if (oscillators%blended < n .or. any(oscillators%mass_rate > 0.0_wp)) return
         low(n + 1:) = 0.0_wp
         high(n + 1:) = 0.0_wp
         low(:n) = z
         high(:n) = v
         first = 0.0_wp
         second = 0.0_wp
         !$omp simd reduction(+:first, second)
         do i = 1, size(weight)
            next(i) = -square(i)*(low(i) + two_zeta*high(i))
            first = first + weight(i)*high(i)
            second = second + weight(i)*next(i)
         end do
         if (present(added)) first = first + added(1, added_value)
         if (present(added)) second = second + added(2, added_value)
         if (.not. (first > 0.0_wp .and. second < 0.0_wp)) return
         coefficient(:2) = [first, 0.5_wp*second]
         reach = -margin*first/coefficient(2)
         if (reach >= limit) return
         ! derivatives of overdamped modes grow faster
         angle = reach*oscillators%frequency(n)*merge(1.0_wp, 2.0_wp, oscillators%oscillating == n)
         if (angle > greatest_angle) return
         terms = terms_for(angle)
         if (real(terms + 2, wp)*log10(oscillators%frequency(n)) > most_decades) return
         share = 0.5_wp
         do k = 3, terms + 1
            call next_derivative(square, two_zeta, weight, high, next, second)
            if (present(added)) second = second + added(k, added_value)
            share = share/real(k, wp)
            coefficient(k) = second*share
         end do
         call next_derivative(square, two_zeta, weight, high, next, second)
         ! bounded as in `bound_terms`; squares of the derivatives alone could overflow
         share = share*reach**terms
         remainder = sum(abs(weight)*sqrt((share*high)**2 + (share*next)**2*oscillators%inverse_square))
         if (present(added)) remainder = remainder + share*added(terms + 1, added_bound)
      end associate
      if (.not. remainder <= epsilon(1.0_wp)*first) return
      call zero_of_series(coefficient(:terms), reach, is_short, step)
      if (.not. is_short) return
      search%outcome = found_zero
      search%evaluations = 1_i8
      search%time = step
      ! the greatest value lies near the middle
      search%greatest = 0.0_wp
      search%ceiling = remainder*step
      do k = terms, 1, -1
         search%greatest = (search%greatest + coefficient(k))*0.5_wp*step
         search%ceiling = (search%ceiling + max(coefficient(k), 0.0_wp))*step
      end do
   end subroutine find_short_flight

   !> Terms of a series in which no mode turns by more than an angle.
   pure function terms_for(angle) result(terms)
      real(wp), intent(in) :: angle
      integer :: terms

      real(wp) :: share

      terms = 2
      share = 0.5_wp*angle
      do while (share > 0.1_wp*epsilon(1.0_wp) .and. terms < most_terms)
         terms = terms + 1
         share = share*angle/real(terms, wp)
      end do
   end function terms_for

   !> From two derivatives of the oscillators to the one after them.
   pure subroutine next_derivative(square, two_zeta, weight, low, high, total)
      !> W^2, [padded], and 2 zeta
      real(wp), contiguous, intent(in) :: square(:)
      real(wp), intent(in) :: two_zeta
      !> Weights, [padded]
      real(wp), contiguous, intent(in) :: weight(:)
      !> The two; the latter and the next on return, [padded]
      real(wp), contiguous, intent(inout) :: low(:)
      real(wp), contiguous, intent(inout) :: high(:)
      !> Weighted sum of the next
      real(wp), intent(out) :: total

      real(wp) :: new
      integer :: i

      total = 0.0_wp
      !$omp simd reduction(+:total) private(new)
      do i = 1, size(weight)
         new = -square(i)*(low(i) + two_zeta*high(i))
         low(i) = high(i)
         high(i) = new
         total = total + weight(i)*new
      end do
   end subroutine next_derivative

   !> First zero of c_1 + c_2 t + c_3 t^2 + ... up to a reach.
   pure subroutine zero_of_series(coefficient, reach, is_found, t)
      !> c, the first one positive
      real(wp), intent(in) :: coefficient(:)
      !> Up to here
      real(wp), intent(in) :: reach
      !> There is one
      logical, intent(out) :: is_found
      !> Where
      real(wp), intent(out) :: t

      integer, parameter :: step_cap = 12, iteration_cap = 10
      real(wp) :: bound, slope, step, value
      integer :: i, k

      ! of the second derivative, Horner's way
      bound = 0.0_wp
      do k = size(coefficient), 3, -1
         bound = bound*reach + real((k - 1)*(k - 2), wp)*abs(coefficient(k))
      end do
      is_found = .false.
      t = 0.0_wp
      value = coefficient(1)
      slope = coefficient(2)
      do i = 1, step_cap
         if (slope < 0.0_wp .and. slope**2 > 4.0_wp*bound*value) exit
         t = t + step_without_zero(value, slope, bound)
         if (t > reach .or. i == step_cap) return
         call evaluate_series(coefficient, t, value, slope)
      end do
      do i = 1, iteration_cap
         step = -value/slope
         t = t + step
         is_found = abs(step) <= 2.0_wp*spacing(t)
         if (is_found .or. t > reach) exit
         call evaluate_series(coefficient, t, value, slope)
      end do
      is_found = is_found .and. t > 0.0_wp .and. t <= reach
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

      integer :: k

      value = 0.0_wp
      slope = 0.0_wp
      do k = size(coefficient), 1, -1
         slope = slope*t + value
         value = value*t + coefficient(k)
      end do
   end subroutine evaluate_series

end module short_flights
