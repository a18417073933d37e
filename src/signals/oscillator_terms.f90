!> The terms that damped oscillators add to a signal, and bounds on these terms that hold from an instant on. Modes far
!> beyond critical damping are represented by their two exponentials, A exp(-slow t) + B exp(-fast t).
module oscillator_terms
   use certified_search, only: bound_curvature, bound_jerk, bound_value, term_columns, &
      term_curvature, term_rate, term_value
   use damped_oscillators, only: find_decay_factors, lanes, oscillators_t, padded
   use kinds, only: i8, wp
   implicit none (type, external)
   private
   public :: bound_terms, split_exponentials, differentiate, add_exponentials

contains

   !> The terms of the signal and of its first two derivatives, with bounds that hold from that instant on. The bound of
   !> each oscillator is the smaller of two: one from its energy, which is tight near critical damping, and one from its
   !> envelope (of exponentials), which is tight far from critical damping.
   pure subroutine bound_terms(oscillators, weight, z, v, slow, fast, terms)
      type(oscillators_t), intent(in) :: oscillators
      !> Weights, [padded]
      real(wp), contiguous, intent(in) :: weight(:)
      !> Displacements of the modes at the instant, [padded]
      real(wp), contiguous, intent(in) :: z(:)
      !> Velocities of the modes at the instant, [padded]
      real(wp), contiguous, intent(in) :: v(:)
      !> A exp(-slow t) of the modes far beyond critical damping, [padded]
      real(wp), contiguous, intent(in) :: slow(:)
      !> B exp(-fast t) of these modes, [padded]
      real(wp), contiguous, intent(in) :: fast(:)
      !> Columns as in `certified_search`, [padded, 6]
      real(wp), contiguous, intent(inout) :: terms(:, :)

      associate (count => oscillators%count, n => size(weight), underdamped => oscillators%underdamped, &
         unseparated => oscillators%unseparated)
         if (underdamped > 0) call bound_underdamped(padded(underdamped), n, oscillators, weight, z, v, terms)
         if (unseparated < count) call bound_exponentials(lanes*(unseparated/lanes), n, oscillators, weight, slow, &
            fast, terms)
         if (unseparated == count .and. padded(underdamped) < n) then
            ! the padding, too
            call bound_overdamped(n, oscillators, weight, z, v, terms)
         else if (underdamped < unseparated) then
            call bound_overdamped(unseparated, oscillators, weight, z, v, terms)
         end if
      end associate
   end subroutine bound_terms

   !> The terms of the underdamped modes.
   pure subroutine bound_underdamped(last, count, oscillators, weight, z, v, terms)
      !> Number of underdamped modes, padded to whole SIMD vectors
      integer, intent(in) :: last
      !> Number of all modes, padded
      integer, intent(in) :: count
      type(oscillators_t), intent(in) :: oscillators
      !> Weights of the modes in the sum
      real(wp), intent(in) :: weight(count)
      !> Displacement of the modes at the instant
      real(wp), intent(in) :: z(count)
      !> Velocity of the modes at the instant
      real(wp), intent(in) :: v(count)
      !> Columns as in `certified_search`
      real(wp), intent(inout) :: terms(count, term_columns)

      real(wp) :: a, jerk, snap, magnitude
      integer :: b, i

      do b = 0, last - lanes, lanes
         !$omp simd private(a, jerk, snap, magnitude)
         do i = b + 1, b + lanes
            a = -oscillators%lane_square(i)*(z(i) + oscillators%two_zeta*v(i)) - oscillators%mass_rate(i)*v(i)
            jerk = -oscillators%lane_square(i)*(v(i) + oscillators%two_zeta*a) - oscillators%mass_rate(i)*a
            snap = -oscillators%lane_square(i)*(a + oscillators%two_zeta*jerk) - oscillators%mass_rate(i)*jerk
            terms(i, term_value) = weight(i)*z(i)
            terms(i, term_rate) = weight(i)*v(i)
            terms(i, term_curvature) = weight(i)*a
            magnitude = abs(weight(i))
            terms(i, bound_value) = magnitude*underdamped_bound(z(i), v(i), oscillators%inverse_square(i), &
               oscillators%decay(i), oscillators%inverse_spread(i))
            terms(i, bound_curvature) = magnitude*underdamped_bound(a, jerk, oscillators%inverse_square(i), &
               oscillators%decay(i), oscillators%inverse_spread(i))
            terms(i, bound_jerk) = magnitude*underdamped_bound(jerk, snap, oscillators%inverse_square(i), &
               oscillators%decay(i), oscillators%inverse_spread(i))
         end do
      end do
   end subroutine bound_underdamped

   !> The terms of the modes at and beyond critical damping that are not represented by two exponentials.
   pure subroutine bound_overdamped(last, oscillators, weight, z, v, terms)
      !> Index of the last of these modes
      integer, intent(in) :: last
      type(oscillators_t), intent(in) :: oscillators
      !> Weights, [padded]
      real(wp), contiguous, intent(in) :: weight(:)
      !> Displacements of the modes at the instant, [padded]
      real(wp), contiguous, intent(in) :: z(:)
      !> Velocities of the modes at the instant, [padded]
      real(wp), contiguous, intent(in) :: v(:)
      !> Columns as in `certified_search`, [padded, 6]
      real(wp), contiguous, intent(inout) :: terms(:, :)

      real(wp) :: a, jerk, snap, magnitude
      integer :: i

      do i = oscillators%underdamped + 1, last
         a = -oscillators%lane_square(i)*(z(i) + oscillators%two_zeta*v(i)) - oscillators%mass_rate(i)*v(i)
         jerk = -oscillators%lane_square(i)*(v(i) + oscillators%two_zeta*a) - oscillators%mass_rate(i)*a
         snap = -oscillators%lane_square(i)*(a + oscillators%two_zeta*jerk) - oscillators%mass_rate(i)*jerk
         terms(i, term_value) = weight(i)*z(i)
         terms(i, term_rate) = weight(i)*v(i)
         terms(i, term_curvature) = weight(i)*a
         magnitude = abs(weight(i))
         terms(i, bound_value) = magnitude*overdamped_bound(z(i), v(i), oscillators%inverse_square(i), &
            oscillators%decay(i), oscillators%spread(i), oscillators%inverse_spread(i))
         terms(i, bound_curvature) = magnitude*overdamped_bound(a, jerk, oscillators%inverse_square(i), &
            oscillators%decay(i), oscillators%spread(i), oscillators%inverse_spread(i))
         terms(i, bound_jerk) = magnitude*overdamped_bound(jerk, snap, oscillators%inverse_square(i), &
            oscillators%decay(i), oscillators%spread(i), oscillators%inverse_spread(i))
      end do
   end subroutine bound_overdamped

   !> Bound on |z| of an underdamped mode from this instant on.
   elemental real(wp) function underdamped_bound(z, v, inverse_square, decay, inverse_spread) result(bound)
      !> Displacement of the modes at the instant
      real(wp), intent(in) :: z
      !> Velocity of the modes at the instant
      real(wp), intent(in) :: v
      !> 1/W^2
      real(wp), intent(in) :: inverse_square
      !> Decay rate
      real(wp), intent(in) :: decay
      !> 1/spread
      real(wp), intent(in) :: inverse_spread

      bound = sqrt(z**2 + min(v**2*inverse_square, ((v + decay*z)*inverse_spread)**2))
   end function underdamped_bound

   !> Bound on |z| of an overdamped mode from this instant on: z = A exp(-slow t) + B exp(-fast t).
   elemental real(wp) function overdamped_bound(z, v, inverse_square, decay, spread, inverse_spread) result(bound)
      !> Displacement of the modes at the instant
      real(wp), intent(in) :: z
      !> Velocity of the modes at the instant
      real(wp), intent(in) :: v
      !> 1/W^2
      real(wp), intent(in) :: inverse_square
      !> Decay rate
      real(wp), intent(in) :: decay
      !> Spread
      real(wp), intent(in) :: spread
      !> 1/spread
      real(wp), intent(in) :: inverse_spread

      bound = min(sqrt(z**2 + v**2*inverse_square), &
         0.5_wp*inverse_spread*(abs(v + (decay + 2.0_wp*spread)*z) + abs(v + decay*z)))
   end function overdamped_bound

   !> The two exponentials of the modes far beyond critical damping. Each exponential is differentiated by itself: in
   !> the equation of motion the terms z and 2 zeta z' of the slow exponential cancel, which leaves rounding errors.
   pure subroutine split_exponentials(oscillators, weight, cutoff, is_viscous, t, z0, v0, slow, fast)
      type(oscillators_t), intent(in) :: oscillators
      !> Weights, [padded]
      real(wp), contiguous, intent(in) :: weight(:)
      !> Fast exponentials whose weighted amplitude does not exceed this are left out
      real(wp), intent(in) :: cutoff
      !> Whether to replace z by z + 2 zeta z', the elastic and viscous force over W^2
      logical, intent(in) :: is_viscous
      !> Instant
      real(wp), intent(in) :: t
      !> Displacements at time 0, [padded]
      real(wp), contiguous, intent(in) :: z0(:)
      !> Velocities at time 0, [padded]
      real(wp), contiguous, intent(in) :: v0(:)
      !> On entry exp(-slow t); on return A exp(-slow t), without meaning for modes near critical damping, [padded]
      real(wp), contiguous, intent(inout) :: slow(:)
      !> On return B exp(-fast t), without meaning for modes near critical damping, [padded]
      real(wp), contiguous, intent(out) :: fast(:)

      real(wp) :: amplitude
      integer :: b, before, i

      before = lanes*(oscillators%unseparated/lanes)
      call find_decay_factors((size(z0) - before)/lanes, t, oscillators%fast(before + 1:), fast(before + 1:))
      do b = before, size(z0) - lanes, lanes
         !$omp simd private(amplitude)
         do i = b + 1, b + lanes
            amplitude = -0.5_wp*oscillators%inverse_spread(i)*(v0(i) + oscillators%decay(i)*z0(i))
            amplitude = merge(amplitude, 0.0_wp, abs(weight(i)*amplitude) > cutoff)
            slow(i) = (z0(i) - amplitude)*slow(i)
            fast(i) = amplitude*fast(i)
         end do
      end do
      if (.not. is_viscous) return
      do b = before, size(z0) - lanes, lanes
         !$omp simd
         do i = b + 1, b + lanes
            ! 1 - 2 zeta s = -s (s - alpha)/W^2 for both decay rates s
            slow(i) = -slow(i)*oscillators%inverse_square(i)*(oscillators%decay(i)*(oscillators%decay(i) &
               - oscillators%mass_rate(i)))
            fast(i) = -fast(i)*oscillators%inverse_square(i)*(oscillators%fast(i)*oscillators%fast_excess(i))
         end do
      end do
   end subroutine split_exponentials

   !> Differentiate both exponentials once.
   pure subroutine differentiate(oscillators, slow, fast)
      type(oscillators_t), intent(in) :: oscillators
      !> A exp(-slow t) from `split_exponentials`, [padded]
      real(wp), contiguous, intent(inout) :: slow(:)
      !> B exp(-fast t) from `split_exponentials`, [padded]
      real(wp), contiguous, intent(inout) :: fast(:)

      integer :: b, i

      do b = lanes*(oscillators%unseparated/lanes), size(slow) - lanes, lanes
         !$omp simd
         do i = b + 1, b + lanes
            slow(i) = -oscillators%decay(i)*slow(i)
            fast(i) = -oscillators%fast(i)*fast(i)
         end do
      end do
   end subroutine differentiate

   !> Value and slope of the modes that are represented by two exponentials.
   pure subroutine add_exponentials(oscillators, slow, fast, z, v)
      type(oscillators_t), intent(in) :: oscillators
      !> A exp(-slow t), [padded]
      real(wp), contiguous, intent(in) :: slow(:)
      !> B exp(-fast t), [padded]
      real(wp), contiguous, intent(in) :: fast(:)
      !> Sum of the exponentials; modes up to `unseparated` stay unchanged, [padded]
      real(wp), contiguous, intent(inout) :: z(:)
      !> Slope of that sum, [padded]
      real(wp), contiguous, intent(inout) :: v(:)

      ! as long as real numbers, so that both fill SIMD vectors alike
      integer(i8) :: b, i, unchanged

      unchanged = int(oscillators%unseparated, i8)
      do b = lanes*(unchanged/lanes), size(slow, kind=i8) - lanes, lanes
         !$omp simd
         do i = b + 1, b + lanes
            z(i) = merge(slow(i) + fast(i), z(i), i > unchanged)
            v(i) = merge(-oscillators%decay(i)*slow(i) - oscillators%fast(i)*fast(i), v(i), i > unchanged)
         end do
      end do
   end subroutine add_exponentials

   !> The terms of the modes that are represented by two exponentials.
   pure subroutine bound_exponentials(before, count, oscillators, weight, slow, fast, terms)
      !> Number of modes in the SIMD vectors before the first of these modes
      integer, intent(in) :: before
      !> Number of all modes, padded
      integer, intent(in) :: count
      type(oscillators_t), intent(in) :: oscillators
      !> Weights of the modes in the sum
      real(wp), intent(in) :: weight(count)
      !> A exp(-slow t)
      real(wp), intent(in) :: slow(count)
      !> B exp(-fast t)
      real(wp), intent(in) :: fast(count)
      !> Columns as in `certified_search`; modes up to `unseparated` stay unchanged
      real(wp), intent(inout) :: terms(count, term_columns)

      real(wp) :: fast_rate, fast_term, rate, slow_term
      ! as long as real numbers, so that both fill SIMD vectors alike
      integer(i8) :: b, i, unchanged

      unchanged = int(oscillators%unseparated, i8)
      do b = int(before, i8), int(count - lanes, i8), lanes
         !$omp simd private(fast_rate, fast_term, rate, slow_term)
         do i = b + 1, b + lanes
            rate = oscillators%decay(i)
            fast_rate = oscillators%fast(i)
            slow_term = weight(i)*slow(i)
            fast_term = weight(i)*fast(i)
            terms(i, term_value) = merge(terms(i, term_value), slow_term + fast_term, i <= unchanged)
            ! if the two terms differ in sign, their sum ends with the sign of the slow term
            terms(i, bound_value) = merge(terms(i, bound_value), max(0.0_wp, -slow_term, -(slow_term + fast_term)), &
               i <= unchanged)
            slow_term = -slow_term*rate
            fast_term = -fast_term*fast_rate
            terms(i, term_rate) = merge(terms(i, term_rate), slow_term + fast_term, i <= unchanged)
            slow_term = -slow_term*rate
            fast_term = -fast_term*fast_rate
            terms(i, term_curvature) = merge(terms(i, term_curvature), slow_term + fast_term, i <= unchanged)
            terms(i, bound_curvature) = merge(terms(i, bound_curvature), abs(slow_term) + abs(fast_term), &
               i <= unchanged)
            terms(i, bound_jerk) = merge(terms(i, bound_jerk), abs(slow_term)*rate + abs(fast_term)*fast_rate, &
               i <= unchanged)
         end do
      end do
   end subroutine bound_exponentials

end module oscillator_terms
