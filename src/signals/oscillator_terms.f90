!> The terms that damped oscillators add to a signal, and bounds on these terms that hold from an instant on. Modes far
!> beyond critical damping are represented by their two exponentials, A exp(-slow t) + B exp(-fast t).
module oscillator_terms
   use certified_search, only: bound_curvature, bound_jerk, bound_value, term_columns, &
      term_curvature, term_rate, term_value
   use damped_oscillators, only: find_decay_factors, lanes, oscillators_t
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: bound_terms, bound_exponentials, split_exponentials, differentiate, add_exponentials

contains

   !> The terms of the signal and of its first two derivatives, with bounds that hold from that instant on. The bound of
   !> each oscillator is the smaller of two: one from its energy, which is tight near critical damping, and one from its
   !> envelope (of exponentials), which is tight far from critical damping.
   pure subroutine bound_terms(blocks, oscillators, weight, z, v, terms)
      !> Number of SIMD vectors
      integer, intent(in) :: blocks
      type(oscillators_t), intent(in) :: oscillators
      !> Weights
      real(wp), intent(in) :: weight(lanes*blocks)
      !> Displacement of the modes at the instant
      real(wp), intent(in) :: z(lanes*blocks)
      !> Velocity of the modes at the instant
      real(wp), intent(in) :: v(lanes*blocks)
      !> Columns as in `certified_search`, [padded, 6]
      real(wp), contiguous, intent(inout) :: terms(:, :)

      ! second derivative of z
      real(wp) :: a
      ! third derivative of z
      real(wp) :: jerk
      ! fourth derivative of z
      real(wp) :: snap
      real(wp) :: magnitude, block(lanes, term_columns)
      integer :: b, i

      associate (square => oscillators%lane_square, inverse_square => oscillators%inverse_square, &
         decay => oscillators%decay, spread => oscillators%spread, inverse_spread => oscillators%inverse_spread, &
         two_zeta => oscillators%two_zeta, mass_rate => oscillators%mass_rate, &
         underdamped => oscillators%underdamped)
         do b = 0, lanes*(blocks - 1), lanes
            if (underdamped > b) then
               ! arguments by copy, so that vectors stay in registers and the descriptors of components are not read
               ! again
               block = underdamped_terms(square(b + 1:b + lanes), inverse_square(b + 1:b + lanes), &
                  decay(b + 1:b + lanes), inverse_spread(b + 1:b + lanes), two_zeta, mass_rate(b + 1:b + lanes), &
                  weight(b + 1:b + lanes), z(b + 1:b + lanes), v(b + 1:b + lanes))
               terms(b + 1:b + lanes, :) = block
            end if
            if (underdamped >= min(b + lanes, oscillators%unseparated)) cycle
            !$omp simd private(a, jerk, snap, magnitude)
            do i = max(underdamped, b) + 1, b + lanes
               a = -square(i)*(z(i) + two_zeta*v(i)) - mass_rate(i)*v(i)
               jerk = -square(i)*(v(i) + two_zeta*a) - mass_rate(i)*a
               snap = -square(i)*(a + two_zeta*jerk) - mass_rate(i)*jerk
               terms(i, term_value) = weight(i)*z(i)
               terms(i, term_rate) = weight(i)*v(i)
               terms(i, term_curvature) = weight(i)*a
               magnitude = abs(weight(i))
               terms(i, bound_value) = magnitude*overdamped_bound(z(i), v(i), inverse_square(i), decay(i), spread(i), &
                  inverse_spread(i))
               terms(i, bound_curvature) = magnitude*overdamped_bound(a, jerk, inverse_square(i), decay(i), spread(i), &
                  inverse_spread(i))
               terms(i, bound_jerk) = magnitude*overdamped_bound(jerk, snap, inverse_square(i), decay(i), spread(i), &
                  inverse_spread(i))
            end do
         end do
      end associate
   end subroutine bound_terms

   !> The terms of one SIMD vector of underdamped modes, with their bounds.
   pure function underdamped_terms(square, inverse_square, decay, inverse_spread, two_zeta, mass_rate, weight, z, v) &
      result(terms)
      !> W^2 of the modes
      real(wp), dimension(lanes), intent(in) :: square
      !> 1/W^2
      real(wp), dimension(lanes), intent(in) :: inverse_square
      !> Decay rate of the modes
      real(wp), dimension(lanes), intent(in) :: decay
      !> 1/spread of the modes
      real(wp), dimension(lanes), intent(in) :: inverse_spread
      real(wp), intent(in) :: two_zeta
      !> Coefficient alpha of mass-proportional damping of the modes
      real(wp), dimension(lanes), intent(in) :: mass_rate
      !> Weight of the modes in the sum
      real(wp), dimension(lanes), intent(in) :: weight
      !> Displacement of the modes at the instant
      real(wp), dimension(lanes), intent(in) :: z
      !> Velocity of the modes at the instant
      real(wp), dimension(lanes), intent(in) :: v
      !> Columns as in `certified_search`
      real(wp) :: terms(lanes, term_columns)

      real(wp) :: a, jerk, snap, magnitude
      integer :: i

      !$omp simd private(a, jerk, snap, magnitude)
      do i = 1, lanes
         a = -square(i)*(z(i) + two_zeta*v(i)) - mass_rate(i)*v(i)
         jerk = -square(i)*(v(i) + two_zeta*a) - mass_rate(i)*a
         snap = -square(i)*(a + two_zeta*jerk) - mass_rate(i)*jerk
         terms(i, term_value) = weight(i)*z(i)
         terms(i, term_rate) = weight(i)*v(i)
         terms(i, term_curvature) = weight(i)*a
         magnitude = abs(weight(i))
         terms(i, bound_value) = magnitude*underdamped_bound(z(i), v(i), inverse_square(i), decay(i), inverse_spread(i))
         terms(i, bound_curvature) = magnitude*underdamped_bound(a, jerk, inverse_square(i), decay(i), &
            inverse_spread(i))
         terms(i, bound_jerk) = magnitude*underdamped_bound(jerk, snap, inverse_square(i), decay(i), inverse_spread(i))
      end do
   end function underdamped_terms

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

      real(wp) :: fast_rate
      integer :: blocks, first, i

      first = lanes*(oscillators%unseparated/lanes) + 1
      blocks = (size(z0) - first + 1)/lanes
      call find_decay_factors(blocks, t, oscillators%decay(first:) + 2.0_wp*oscillators%spread(first:), fast(first:))
      call apply_amplitudes(blocks, cutoff, oscillators%decay(first:), oscillators%inverse_spread(first:), &
         weight(first:), z0(first:), v0(first:), slow(first:), fast(first:))
      if (.not. is_viscous) return
      do i = first, size(z0)
         ! 1 - 2 zeta s = -s (s - alpha)/W^2 for both decay rates s
         fast_rate = oscillators%decay(i) + 2.0_wp*oscillators%spread(i)
         slow(i) = -slow(i)*oscillators%inverse_square(i)*(oscillators%decay(i) &
            *(oscillators%decay(i) - oscillators%mass_rate(i)))
         fast(i) = -fast(i)*oscillators%inverse_square(i)*(fast_rate*oscillators%fast_excess(i))
      end do
   end subroutine split_exponentials

   !> Multiply the two exponentials by their amplitudes, in whole SIMD vectors.
   pure subroutine apply_amplitudes(blocks, cutoff, decay, inverse_spread, weight, z0, v0, slow, fast)
      !> Number of SIMD vectors in each array
      integer, intent(in) :: blocks
      !> Fast exponentials whose weighted amplitude does not exceed this are left out
      real(wp), intent(in) :: cutoff
      !> Decay rate of the modes
      real(wp), intent(in), dimension(lanes*blocks) :: decay
      !> 1/spread of the modes
      real(wp), intent(in), dimension(lanes*blocks) :: inverse_spread
      !> Weights of the modes
      real(wp), intent(in), dimension(lanes*blocks) :: weight
      !> Displacements at time 0
      real(wp), intent(in), dimension(lanes*blocks) :: z0
      !> Velocities at time 0
      real(wp), intent(in), dimension(lanes*blocks) :: v0
      !> On entry exp(-slow t); on return A exp(-slow t)
      real(wp), intent(inout), dimension(lanes*blocks) :: slow
      !> On entry exp(-fast t); on return B exp(-fast t)
      real(wp), intent(inout), dimension(lanes*blocks) :: fast

      real(wp) :: amplitude
      integer :: i

      !$omp simd private(amplitude)
      do i = 1, lanes*blocks
         amplitude = -0.5_wp*inverse_spread(i)*(v0(i) + decay(i)*z0(i))
         amplitude = merge(amplitude, 0.0_wp, abs(weight(i)*amplitude) > cutoff)
         slow(i) = (z0(i) - amplitude)*slow(i)
         fast(i) = amplitude*fast(i)
      end do
   end subroutine apply_amplitudes

   !> Differentiate both exponentials once.
   pure subroutine differentiate(oscillators, slow, fast)
      type(oscillators_t), intent(in) :: oscillators
      !> A exp(-slow t) from `split_exponentials`, [padded]
      real(wp), contiguous, intent(inout) :: slow(:)
      !> B exp(-fast t) from `split_exponentials`, [padded]
      real(wp), contiguous, intent(inout) :: fast(:)

      integer :: i

      do i = lanes*(oscillators%unseparated/lanes) + 1, size(slow)
         slow(i) = -oscillators%decay(i)*slow(i)
         fast(i) = -(oscillators%decay(i) + 2.0_wp*oscillators%spread(i))*fast(i)
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

      integer :: b

      do b = lanes*(oscillators%unseparated/lanes), size(slow) - lanes, lanes
         call add_block(oscillators%unseparated - b, oscillators%decay(b + 1:b + lanes), &
            oscillators%spread(b + 1:b + lanes), slow(b + 1:b + lanes), fast(b + 1:b + lanes), z(b + 1:b + lanes), &
            v(b + 1:b + lanes))
      end do
   end subroutine add_exponentials

   !> `add_exponentials` for one SIMD vector.
   pure subroutine add_block(unchanged, decay, spread, slow, fast, z, v)
      !> Number of leading modes that stay unchanged
      integer, intent(in) :: unchanged
      !> Decay rate of the slow exponential of each mode
      real(wp), intent(in), dimension(lanes) :: decay
      !> Half of the difference of the two decay rates
      real(wp), intent(in), dimension(lanes) :: spread
      !> A exp(-slow t)
      real(wp), intent(in), dimension(lanes) :: slow
      !> B exp(-fast t)
      real(wp), intent(in), dimension(lanes) :: fast
      !> Sum of the exponentials
      real(wp), intent(inout), dimension(lanes) :: z
      !> Slope of that sum
      real(wp), intent(inout), dimension(lanes) :: v

      integer :: i

      !$omp simd
      do i = 1, lanes
         z(i) = merge(slow(i) + fast(i), z(i), i > unchanged)
         v(i) = merge(-decay(i)*slow(i) - (decay(i) + 2.0_wp*spread(i))*fast(i), v(i), i > unchanged)
      end do
   end subroutine add_block

   !> The terms of the modes that are represented by two exponentials, with bounds that hold from that instant on.
   pure subroutine bound_exponentials(oscillators, weight, slow, fast, terms)
      type(oscillators_t), intent(in) :: oscillators
      !> Weights, [padded]
      real(wp), contiguous, intent(in) :: weight(:)
      !> A exp(-slow t), [padded]
      real(wp), contiguous, intent(in) :: slow(:)
      !> B exp(-fast t), [padded]
      real(wp), contiguous, intent(in) :: fast(:)
      !> Columns as in `certified_search`; modes up to `unseparated` stay unchanged, [padded, 6]
      real(wp), contiguous, intent(inout) :: terms(:, :)

      real(wp) :: block(lanes, term_columns)
      integer :: b, i, k, unchanged

      do b = lanes*(oscillators%unseparated/lanes), size(slow) - lanes, lanes
         block = exponential_terms(oscillators%decay(b + 1:b + lanes), oscillators%spread(b + 1:b + lanes), &
            weight(b + 1:b + lanes), slow(b + 1:b + lanes), fast(b + 1:b + lanes))
         unchanged = oscillators%unseparated - b
         if (unchanged > 0) then
            do k = 1, term_columns
               !$omp simd
               do i = 1, lanes
                  block(i, k) = merge(terms(b + i, k), block(i, k), i <= unchanged)
               end do
            end do
         end if
         terms(b + 1:b + lanes, :) = block
      end do
   end subroutine bound_exponentials

   !> The terms of one SIMD vector of two exponentials, with their bounds.
   pure function exponential_terms(decay, spread, weight, slow, fast) result(terms)
      !> Decay rate of the slow exponential of each mode
      real(wp), intent(in), dimension(lanes) :: decay
      !> Half of the difference of the two decay rates
      real(wp), intent(in), dimension(lanes) :: spread
      !> Weight of the modes in the sum
      real(wp), intent(in), dimension(lanes) :: weight
      !> A exp(-slow t)
      real(wp), intent(in), dimension(lanes) :: slow
      !> B exp(-fast t)
      real(wp), intent(in), dimension(lanes) :: fast
      !> Columns as in `certified_search`
      real(wp) :: terms(lanes, term_columns)

      real(wp) :: fast_rate, fast_term, slow_term
      integer :: i

      !$omp simd private(fast_rate, fast_term, slow_term)
      do i = 1, lanes
         fast_rate = decay(i) + 2.0_wp*spread(i)
         slow_term = weight(i)*slow(i)
         fast_term = weight(i)*fast(i)
         terms(i, term_value) = slow_term + fast_term
         ! if the two terms differ in sign, their sum ends with the sign of the slow term
         terms(i, bound_value) = max(0.0_wp, -slow_term, -(slow_term + fast_term))
         slow_term = -slow_term*decay(i)
         fast_term = -fast_term*fast_rate
         terms(i, term_rate) = slow_term + fast_term
         slow_term = -slow_term*decay(i)
         fast_term = -fast_term*fast_rate
         terms(i, term_curvature) = slow_term + fast_term
         terms(i, bound_curvature) = abs(slow_term) + abs(fast_term)
         terms(i, bound_jerk) = abs(slow_term)*decay(i) + abs(fast_term)*fast_rate
      end do
   end function exponential_terms

end module oscillator_terms
