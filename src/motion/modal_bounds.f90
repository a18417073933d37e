!> Bounds on sums of damped oscillators from an instant on, and how far they keep such a sum from zero.
module modal_bounds
   use certified_search, only: step_without_zero
   use damped_oscillators, only: lanes
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: bound_terms, free_step

contains

   !> The terms of the sum and of its derivatives, and bounds on their magnitudes from now on. Each oscillator by the
   !> smaller of two bounds: its energy's, which is good near critical damping, and its envelope's, which is good far
   !> from it.
   pure subroutine bound_terms(blocks, oscillating, two_zeta, weight, square, inverse_square, decay, spread, &
                               inverse_spread, z, v, value, rate, curvature, swing, swing_curvature, swing_jerk)
      !> Vectors in each array
      integer, intent(in) :: blocks
      !> Number of underdamped modes, 2 zeta
      integer, intent(in) :: oscillating
      real(wp), intent(in) :: two_zeta
      !> Weights, and the family
      real(wp), intent(in), dimension(lanes, blocks) :: weight, square, inverse_square, decay, spread, inverse_spread
      !> State now
      real(wp), intent(in), dimension(lanes, blocks) :: z, v
      !> Terms of the sum, of its first and of its second derivative
      real(wp), intent(out), dimension(lanes, blocks) :: value, rate, curvature
      !> Bounds on the terms, on their second and on their third derivatives
      real(wp), intent(out), dimension(lanes, blocks) :: swing, swing_curvature, swing_jerk

      real(wp) :: a, jerk, snap, magnitude
      integer :: b, i

      do b = 1, blocks
         if (oscillating > lanes*(b - 1)) then
            !$omp simd private(a, jerk, snap, magnitude)
            do i = 1, lanes
               a = -square(i, b)*(z(i, b) + two_zeta*v(i, b))
               jerk = -square(i, b)*(v(i, b) + two_zeta*a)
               snap = -square(i, b)*(a + two_zeta*jerk)
               value(i, b) = weight(i, b)*z(i, b)
               rate(i, b) = weight(i, b)*v(i, b)
               curvature(i, b) = weight(i, b)*a
               magnitude = abs(weight(i, b))
               swing(i, b) = magnitude*oscillating_bound(z(i, b), v(i, b), inverse_square(i, b), decay(i, b), inverse_spread(i, b))
               swing_curvature(i, b) = magnitude*oscillating_bound(a, jerk, inverse_square(i, b), decay(i, b), &
                                                                   inverse_spread(i, b))
               swing_jerk(i, b) = magnitude*oscillating_bound(jerk, snap, inverse_square(i, b), decay(i, b), inverse_spread(i, b))
            end do
         end if
         if (oscillating >= lanes*b) cycle
         !$omp simd private(a, jerk, snap, magnitude)
         do i = max(oscillating - lanes*(b - 1), 0) + 1, lanes
            a = -square(i, b)*(z(i, b) + two_zeta*v(i, b))
            jerk = -square(i, b)*(v(i, b) + two_zeta*a)
            snap = -square(i, b)*(a + two_zeta*jerk)
            value(i, b) = weight(i, b)*z(i, b)
            rate(i, b) = weight(i, b)*v(i, b)
            curvature(i, b) = weight(i, b)*a
            magnitude = abs(weight(i, b))
            swing(i, b) = magnitude*creeping_bound(z(i, b), v(i, b), inverse_square(i, b), decay(i, b), spread(i, b), &
                                                   inverse_spread(i, b))
            swing_curvature(i, b) = magnitude*creeping_bound(a, jerk, inverse_square(i, b), decay(i, b), spread(i, b), &
                                                             inverse_spread(i, b))
            swing_jerk(i, b) = magnitude*creeping_bound(jerk, snap, inverse_square(i, b), decay(i, b), spread(i, b), &
                                                        inverse_spread(i, b))
         end do
      end do
   end subroutine bound_terms

   !> Bound on |z| from now on, underdamped.
   elemental function oscillating_bound(z, v, inverse_square, decay, inverse_spread) result(bound)
      !> State
      real(wp), intent(in) :: z
      real(wp), intent(in) :: v
      !> 1/W^2, decay and 1/spread
      real(wp), intent(in) :: inverse_square
      real(wp), intent(in) :: decay
      real(wp), intent(in) :: inverse_spread
      real(wp) :: bound

      bound = sqrt(z**2 + min(v**2*inverse_square, ((v + decay*z)*inverse_spread)**2))
   end function oscillating_bound

   !> Bound on |z| from now on, overdamped: z = A exp(-slow t) + B exp(-fast t).
   elemental function creeping_bound(z, v, inverse_square, decay, spread, inverse_spread) result(bound)
      !> State
      real(wp), intent(in) :: z
      real(wp), intent(in) :: v
      !> 1/W^2, decay, spread and its reciprocal
      real(wp), intent(in) :: inverse_square
      real(wp), intent(in) :: decay
      real(wp), intent(in) :: spread
      real(wp), intent(in) :: inverse_spread
      real(wp) :: bound

      bound = min(sqrt(z**2 + v**2*inverse_square), &
                  0.5_wp*inverse_spread*(abs(v + (decay + 2.0_wp*spread)*z) + abs(v + decay*z)))
   end function creeping_bound

   !> How far there is certainly no zero, by more than one bound on the second derivative.
   !>
   !> The modes above any number k swing no further than their amplitudes; those up to k are kept by their value,
   !> slope and a bound B on their second derivative. The best k is taken. Within a time T the second derivative
   !> changes by no more than T times a bound on the third; the best T is taken, too.
   pure function free_step(value, slope, curvature, swing, swing_curvature, swing_jerk, rest, rest_slope, whole, &
                           whole_slope) result(step)
      !> Terms of the sum, of its first and of its second derivative, [count]
      real(wp), contiguous, intent(in) :: value(:)
      real(wp), contiguous, intent(in) :: slope(:)
      real(wp), contiguous, intent(in) :: curvature(:)
      !> Bounds on the magnitude of each term from now on, on its second and third derivative, [count]
      real(wp), contiguous, intent(in) :: swing(:)
      real(wp), contiguous, intent(in) :: swing_curvature(:)
      real(wp), contiguous, intent(in) :: swing_jerk(:)
      !> What is added to the terms, and its slope; it is convex
      real(wp), intent(in) :: rest
      real(wp), intent(in) :: rest_slope
      !> The sum and its slope
      real(wp), intent(in) :: whole
      real(wp), intent(in) :: whole_slope
      real(wp) :: step

      real(wp), parameter :: horizons(8) = [1.25_wp, 1.6_wp, 2.0_wp, 2.6_wp, 3.4_wp, 5.0_wp, 8.0_wp, 16.0_wp]
      ! sums of the first k terms, and of the last
      real(wp), dimension(size(value)) :: values, slopes, bounds, curvatures, jerks, left, low, length
      real(wp) :: sums(6), doubt, trial(size(horizons))
      integer :: best, j, k, n, pass

      n = size(value)
      sums = 0.0_wp
      sums(1) = rest
      sums(2) = rest_slope
      do k = 1, n
         sums(1) = sums(1) + value(k)
         sums(2) = sums(2) + slope(k)
         sums(3) = sums(3) + swing_curvature(k)
         sums(4) = sums(4) + curvature(k)
         sums(5) = sums(5) + swing_jerk(k)
         values(k) = sums(1)
         slopes(k) = sums(2)
         bounds(k) = sums(3)
         curvatures(k) = sums(4)
         jerks(k) = sums(5)
         left(n + 1 - k) = sums(6)
         sums(6) = sums(6) + swing(n + 1 - k)
      end do
      ! what the order of summation leaves in doubt
      doubt = 8.0_wp*epsilon(1.0_wp)*(sums(6) + abs(rest))
      !$omp simd
      do k = 1, n
         low(k) = values(k) - left(k) - doubt
      end do
      low(n) = max(whole, 0.0_wp)
      slopes(n) = whole_slope
      !$omp simd
      do k = 1, n
         length(k) = step_without_zero(max(low(k), 0.0_wp), slopes(k), bounds(k))
         length(k) = merge(length(k), 0.0_wp, low(k) >= 0.0_wp)
      end do
      step = 0.0_wp
      best = n
      do k = 1, n
         if (length(k) > step) then
            step = length(k)
            best = k
         end if
      end do
      do pass = 1, 2
         k = merge(best, n, pass == 1)
         if (pass == 2 .and. best == n) exit
         !$omp simd
         do j = 1, size(horizons)
            trial(j) = horizons(j)*step
            trial(j) = min(trial(j), step_without_zero(low(k), slopes(k), &
                                                       min(bounds(k), max(0.0_wp, jerks(k)*trial(j) - curvatures(k)))))
         end do
         step = max(step, maxval(trial))
      end do
   end function free_step

end module modal_bounds
