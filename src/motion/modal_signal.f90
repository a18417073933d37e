!> A linear functional of damped oscillators as a signal with certain bounds: the gap in flight, the reaction in contact.
!>
!> Every derivative z^(k) obeys the same oscillator equation, whose energy never grows. So from any
!> instant on |z_i^(k)| <= hypot(z_i^(k), z_i^(k+1)/W_i), under-, critically or over-damped.
module modal_signal
   use certified_search, only: certified_signal_t, falls_to_zero, local_t
   use damped_oscillators, only: greatest_exponent, lanes, oscillators_t, padded, propagate, propagate_lanes
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: modal_signal_t, make_modal_signal

   !> s(t) = offset + sum c_i z_i(t) + surface exp(-rate t). The last term, a surface that relaxes, is convex.
   type, extends(certified_signal_t) :: modal_signal_t
      type(oscillators_t), pointer :: oscillators => null()
      !> What the oscillators swing about
      real(wp) :: offset = 0.0_wp
      !> c_i, [count]
      real(wp), allocatable :: weight(:)
      !> The same, filled up with zeros to whole vectors
      real(wp), allocatable, private :: lane_weight(:)
      !> z_i and z_i' at t = 0, [count]
      real(wp), allocatable :: z(:), v(:)
      !> For modes far beyond critical damping the sum is over z_i + 2 zeta z_i' instead (a force)
      logical :: is_viscous = .false.
      !> Indentation of the surface at t = 0, >= 0, and the rate at which it relaxes
      real(wp) :: surface = 0.0_wp
      real(wp) :: rate = 0.0_wp
   contains
      procedure :: look
      procedure :: evaluate
      procedure :: short_flight
   end type modal_signal_t

contains

   !> Prepare a signal; its state `z`, `v` is set by the caller.
   subroutine make_modal_signal(oscillators, offset, weight, signal)
      !> The oscillators; they must outlive the signal
      type(oscillators_t), target, intent(in) :: oscillators
      !> Offset
      real(wp), intent(in) :: offset
      !> c_i, [count]
      real(wp), intent(in) :: weight(:)
      !> The signal
      type(modal_signal_t), intent(out) :: signal

      signal%oscillators => oscillators
      signal%offset = offset
      allocate (signal%weight, source=weight)
      allocate (signal%lane_weight(padded(size(weight))), source=0.0_wp)
      signal%lane_weight(:size(weight)) = weight
      allocate (signal%z(size(weight)), signal%v(size(weight)))
   end subroutine make_modal_signal

   !> The signal and its slope at an instant.
   subroutine evaluate(self, t, value, slope)
      class(modal_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> s and s'
      real(wp), intent(out) :: value
      real(wp), intent(out) :: slope

      real(wp), dimension(self%oscillators%count) :: z, v
      real(wp) :: surface

      call propagate(self%oscillators, t, self%z, self%v, z, v)
      if (self%is_viscous) call join_after(self, t, z, v)
      value = self%offset + sum(self%weight*z)
      slope = sum(self%weight*v)
      if (self%surface > 0.0_wp) then
         surface = self%surface*exp(-self%rate*t)
         value = value + surface
         slope = slope - self%rate*surface
      end if
   end subroutine evaluate

   !> A hop so short that the modes hardly turn: its end by the Taylor series of s(t)/t about the start, certain since
   !> the remainder is bounded by the swing of the first derivative left out.
   subroutine short_flight(self, limit, is_short, time, greatest)
      class(modal_signal_t), intent(in) :: self
      !> Where the search ends
      real(wp), intent(in) :: limit
      !> The first zero is certain to be the one returned
      logical, intent(out) :: is_short
      !> Where it is
      real(wp), intent(inout) :: time
      !> The signal reaches so far before
      real(wp), intent(inout) :: greatest

      integer, parameter :: most_terms = 24
      ! the series is used up to this multiple of the zero of its first two terms, if no mode turns by more than an angle
      real(wp), parameter :: margin = 1.6_wp, greatest_angle = 2.0_wp
      real(wp), dimension(size(self%lane_weight)) :: low, high, next
      ! s^(k)/k!
      real(wp) :: coefficient(most_terms + 1)
      real(wp) :: angle, first, reach, remainder, second, share, step
      integer :: i, k, n, terms

      is_short = .false.
      n = self%oscillators%count
      if (self%surface > 0.0_wp .or. self%oscillators%blended < n) return
      associate (oscillators => self%oscillators, weight => self%lane_weight, square => self%oscillators%lane_square, &
                 two_zeta => self%oscillators%two_zeta)
         low(n + 1:) = 0.0_wp
         high(n + 1:) = 0.0_wp
         low(:n) = self%z
         high(:n) = self%v
         first = 0.0_wp
         second = 0.0_wp
         !$omp simd reduction(+:first, second)
         do i = 1, size(weight)
            next(i) = -square(i)*(low(i) + two_zeta*high(i))
            first = first + weight(i)*high(i)
            second = second + weight(i)*next(i)
         end do
         if (.not. (first > 0.0_wp .and. second < 0.0_wp)) return
         coefficient(1) = first
         coefficient(2) = 0.5_wp*second
         reach = -margin*first/coefficient(2)
         if (reach >= limit) return
         ! derivatives of overdamped modes grow faster
         angle = reach*oscillators%frequency(n)*merge(1.0_wp, 2.0_wp, oscillators%oscillating == n)
         if (angle > greatest_angle) return
         terms = 2
         share = 0.5_wp*angle
         do while (share > 0.1_wp*epsilon(1.0_wp) .and. terms < most_terms)
            terms = terms + 1
            share = share*angle/real(terms, wp)
         end do
         share = 0.5_wp
         do k = 3, terms + 1
            call next_derivative(square, two_zeta, weight, high, next, second)
            share = share/real(k, wp)
            coefficient(k) = second*share
         end do
         low = high
         high = next
         call next_derivative(square, two_zeta, weight, low, next, second)
         ! bounded as in `bound_terms`
         remainder = sum(abs(weight)*sqrt(high**2 + next**2*oscillators%inverse_square))
      end associate
      remainder = remainder*share*reach**terms
      if (remainder > epsilon(1.0_wp)*first) return
      call zero_of_series(coefficient(:terms), reach, is_short, step)
      if (.not. is_short) return
      time = step
      ! the greatest value lies near the middle
      greatest = 0.0_wp
      do k = terms, 1, -1
         greatest = (greatest + coefficient(k))*0.5_wp*step
      end do
   end subroutine short_flight

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

   !> Value, slope and bounds of a derivative of the signal at an instant; the surface counts in order 0 only.
   subroutine look(self, t, order, here)
      class(modal_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Which derivative, 0: the signal itself
      integer, intent(in) :: order
      !> What is there
      type(local_t), intent(out) :: here

      real(wp), dimension(size(self%lane_weight)) :: z0, v0, z, v, a, jerk, snap, swing, swing_a, swing_jerk, slow, fast
      real(wp) :: magnitude, surface, signal, rest, slope
      integer :: k, last
      logical :: separates

      associate (oscillators => self%oscillators, weight => self%lane_weight, square => self%oscillators%lane_square, &
                 n => self%oscillators%count)
         z0(n + 1:) = 0.0_wp
         v0(n + 1:) = 0.0_wp
         z0(:n) = self%z
         v0(:n) = self%v
         last = padded(oscillators%blended)
         separates = oscillators%blended < n
         call propagate_lanes(oscillators, t, z0(:last), v0(:last), z(:last), v(:last))
         if (separates) then
            call separate(oscillators, weight, self%offset, self%start_order > 1, self%is_viscous, t, z0, v0, slow, fast)
            call join(oscillators, slow, fast, z, v)
         end if
         call sum_up(weight, t, z, v, signal, slope, magnitude)
         here%signal = self%offset + signal
         here%signal_rounding = epsilon(1.0_wp)*(4.0_wp*abs(self%offset) + magnitude)
         here%value = here%signal
         here%rounding = here%signal_rounding
         do k = 1, order
            a = -square*(z + oscillators%two_zeta*v)
            z = v
            v = a
            if (separates) then
               call advance(oscillators, slow, fast)
               call join(oscillators, slow, fast, z, v)
            end if
         end do
         if (order > 0) then
            call sum_up(weight, 0.0_wp, z, v, here%value, slope, magnitude)
            here%rounding = epsilon(1.0_wp)*magnitude
         end if
         here%slope = slope
         call differentiate(square, oscillators%two_zeta, z, v, a, jerk, snap)
         call bound_terms(oscillators, weight, z, v, swing)
         call bound_terms(oscillators, weight, a, jerk, swing_a)
         if (separates) then
            call bound_separate(oscillators, weight, slow, fast, swing)
            call advance(oscillators, slow, fast)
            call advance(oscillators, slow, fast)
            call join(oscillators, slow, fast, a, jerk)
            call bound_separate(oscillators, weight, slow, fast, swing_a)
         end if
         if (order == 0 .and. self%offset > 0.0_wp) here%floor = self%offset - sum(swing)
         here%bound = sum(swing_a)
         here%bound_both = here%bound
         surface = 0.0_wp
         if (self%surface > 0.0_wp) then
            surface = self%surface*exp(-self%rate*t)
            here%value = here%value + surface
            here%signal = here%value
            here%slope = here%slope - self%rate*surface
            here%bound_both = here%bound_both + self%rate**2*surface
         end if
         if (order == 0 .and. here%floor > here%rounding) return
         call bound_terms(oscillators, weight, jerk, snap, swing_jerk)
         if (separates) then
            call advance(oscillators, slow, fast)
            call bound_separate(oscillators, weight, slow, fast, swing_jerk)
         end if
         here%curvature = dot_product(weight, a) + self%rate**2*surface
         here%bound_jerk = sum(swing_jerk) + self%rate**3*surface
         if (order == 0 .and. falls_to_zero(here)) return
         rest = merge(self%offset, 0.0_wp, order == 0) + surface
         here%free = free_step(weight*z, weight*v, weight*a, swing, swing_a, swing_jerk, rest, -self%rate*surface, &
                               here%value, here%slope)
      end associate
   end subroutine look

   !> The two exponentials of the modes far beyond critical damping. Their derivatives are taken one by one: in
   !> the equation of motion z and 2 zeta z' of the slow one cancel, and what is left is rounding error.
   !>
   !> Where high derivatives decide (a start at rest), fast exponentials that are lost in the rounding error of the sum
   !> are left out: in a derivative that error would be all there is.
   pure subroutine separate(oscillators, weight, offset, drops, is_viscous, t, z0, v0, slow, fast)
      !> The family
      type(oscillators_t), intent(in) :: oscillators
      !> Weights, [padded], and what is added to the sum
      real(wp), contiguous, intent(in) :: weight(:)
      real(wp), intent(in) :: offset
      !> Leave out what is lost in rounding
      logical, intent(in) :: drops
      !> Take z + 2 zeta z' for z
      logical, intent(in) :: is_viscous
      !> Instant
      real(wp), intent(in) :: t
      !> State at time 0, [padded]
      real(wp), contiguous, intent(in) :: z0(:)
      real(wp), contiguous, intent(in) :: v0(:)
      !> A exp(-slow t), B exp(-fast t), [padded]; those of blended modes mean nothing
      real(wp), contiguous, intent(out) :: slow(:)
      real(wp), contiguous, intent(out) :: fast(:)

      !GCC$ builtin (exp) attributes simd (notinbranch) if('x86_64')
      real(wp), dimension(size(z0)) :: slow_factor, fast_factor
      real(wp) :: amplitude, least
      integer :: i, first

      first = lanes*(oscillators%blended/lanes) + 1
      least = 0.0_wp
      if (drops) least = 0.25_wp*epsilon(1.0_wp)*(abs(offset) + sum(abs(weight*z0)))/real(size(z0), wp)
      do i = first, size(z0)
         slow_factor(i) = exp(-min(oscillators%decay(i)*t, greatest_exponent))
      end do
      do i = first, size(z0)
         fast_factor(i) = exp(-min((oscillators%decay(i) + 2.0_wp*oscillators%spread(i))*t, greatest_exponent))
      end do
      !$omp simd private(amplitude)
      do i = first, size(z0)
         amplitude = -0.5_wp*oscillators%inverse_spread(i)*(v0(i) + oscillators%decay(i)*z0(i))
         amplitude = merge(amplitude, 0.0_wp, abs(weight(i)*amplitude) > least)
         slow(i) = (z0(i) - amplitude)*slow_factor(i)
         fast(i) = amplitude*fast_factor(i)
      end do
      if (.not. is_viscous) return
      do i = first, size(z0)
         ! 1 - 2 zeta s = -s^2/W^2 for both exponents
         slow(i) = -slow(i)*oscillators%inverse_square(i)*oscillators%decay(i)**2
         fast(i) = -fast(i)*oscillators%inverse_square(i)*(oscillators%decay(i) + 2.0_wp*oscillators%spread(i))**2
      end do
   end subroutine separate

   !> One derivative further.
   pure subroutine advance(oscillators, slow, fast)
      !> The family
      type(oscillators_t), intent(in) :: oscillators
      !> From `separate`, [padded]
      real(wp), contiguous, intent(inout) :: slow(:)
      real(wp), contiguous, intent(inout) :: fast(:)

      integer :: i

      do i = lanes*(oscillators%blended/lanes) + 1, size(slow)
         slow(i) = -oscillators%decay(i)*slow(i)
         fast(i) = -(oscillators%decay(i) + 2.0_wp*oscillators%spread(i))*fast(i)
      end do
   end subroutine advance

   !> Value and slope of the modes far beyond critical damping at an instant.
   pure subroutine join_after(self, t, z, v)
      !> The signal
      type(modal_signal_t), intent(in) :: self
      !> The instant
      real(wp), intent(in) :: t
      !> Those of the other modes stay, [count]
      real(wp), intent(inout) :: z(:)
      real(wp), intent(inout) :: v(:)

      real(wp), dimension(size(self%lane_weight)) :: z0, v0, slow, fast, lane_z, lane_v

      associate (oscillators => self%oscillators, n => self%oscillators%count)
         if (oscillators%blended == n) return
         z0(n + 1:) = 0.0_wp
         v0(n + 1:) = 0.0_wp
         z0(:n) = self%z
         v0(:n) = self%v
         call separate(oscillators, self%lane_weight, self%offset, self%start_order > 1, self%is_viscous, t, z0, v0, slow, fast)
         call join(oscillators, slow, fast, lane_z, lane_v)
         z(oscillators%blended + 1:) = lane_z(oscillators%blended + 1:n)
         v(oscillators%blended + 1:) = lane_v(oscillators%blended + 1:n)
      end associate
   end subroutine join_after

   !> Value and slope from the two exponentials, where they are told apart.
   pure subroutine join(oscillators, slow, fast, z, v)
      !> The family
      type(oscillators_t), intent(in) :: oscillators
      !> From `separate`, [padded]
      real(wp), contiguous, intent(in) :: slow(:)
      real(wp), contiguous, intent(in) :: fast(:)
      !> Their sum and its slope; those of blended modes stay, [padded]
      real(wp), contiguous, intent(inout) :: z(:)
      real(wp), contiguous, intent(inout) :: v(:)

      real(wp) :: rate
      integer :: i

      do i = oscillators%blended + 1, size(slow)
         rate = oscillators%decay(i) + 2.0_wp*oscillators%spread(i)
         z(i) = slow(i) + fast(i)
         v(i) = -oscillators%decay(i)*slow(i) - rate*fast(i)
      end do
   end subroutine join

   !> Their bounds from now on.
   pure subroutine bound_separate(oscillators, weight, slow, fast, terms)
      !> The family
      type(oscillators_t), intent(in) :: oscillators
      !> Weights, [padded]
      real(wp), contiguous, intent(in) :: weight(:)
      !> From `separate`, [padded]
      real(wp), contiguous, intent(in) :: slow(:)
      real(wp), contiguous, intent(in) :: fast(:)
      !> The bounds; those of blended modes stay, [padded]
      real(wp), contiguous, intent(inout) :: terms(:)

      integer :: i

      do i = oscillators%blended + 1, size(slow)
         terms(i) = abs(weight(i))*(abs(slow(i)) + abs(fast(i)))
      end do
   end subroutine bound_separate

   !> The sum of all terms, its slope, and what its rounding error is measured by.
   pure subroutine sum_up(weight, t, z, v, value, slope, magnitude)
      !> Weights, [padded]
      real(wp), contiguous, intent(in) :: weight(:)
      !> Time since the start: the phase W t is rounded too
      real(wp), intent(in) :: t
      !> State now, [padded]
      real(wp), contiguous, intent(in) :: z(:)
      real(wp), contiguous, intent(in) :: v(:)
      !> sum weight z, sum weight v
      real(wp), intent(out) :: value
      real(wp), intent(out) :: slope
      !> Sum of magnitudes
      real(wp), intent(out) :: magnitude

      integer :: i

      value = 0.0_wp
      slope = 0.0_wp
      magnitude = 0.0_wp
      !$omp simd reduction(+:value, slope, magnitude)
      do i = 1, size(weight)
         value = value + weight(i)*z(i)
         slope = slope + weight(i)*v(i)
         magnitude = magnitude + abs(weight(i))*(4.0_wp*abs(z(i)) + t*abs(v(i)))
      end do
   end subroutine sum_up

   !> The next three derivatives, from the equation of motion.
   pure subroutine differentiate(square, two_zeta, z, v, a, jerk, snap)
      !> W^2, [padded]
      real(wp), contiguous, intent(in) :: square(:)
      !> 2 zeta
      real(wp), intent(in) :: two_zeta
      !> State now, [padded]
      real(wp), contiguous, intent(in) :: z(:)
      real(wp), contiguous, intent(in) :: v(:)
      !> z'', z''', z'''', [padded]
      real(wp), contiguous, intent(out) :: a(:)
      real(wp), contiguous, intent(out) :: jerk(:)
      real(wp), contiguous, intent(out) :: snap(:)

      integer :: i

      do i = 1, size(square)
         a(i) = -square(i)*(z(i) + two_zeta*v(i))
         jerk(i) = -square(i)*(v(i) + two_zeta*a(i))
         snap(i) = -square(i)*(a(i) + two_zeta*jerk(i))
      end do
   end subroutine differentiate

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
      real(wp), dimension(size(value)) :: low, low_slope, bound, length
      real(wp) :: sum_of(5), trial(size(horizons))
      integer :: best, j, k, n, pass

      n = size(value)
      sum_of = 0.0_wp
      do k = n, 1, -1
         low(k) = -sum_of(1)
         sum_of(1) = sum_of(1) + swing(k)
      end do
      ! what the order of summation leaves in doubt
      sum_of(1) = rest - 8.0_wp*epsilon(1.0_wp)*(sum_of(1) + abs(rest))
      sum_of(2) = rest_slope
      do k = 1, n
         sum_of(1) = sum_of(1) + value(k)
         sum_of(2) = sum_of(2) + slope(k)
         sum_of(3) = sum_of(3) + swing_curvature(k)
         low(k) = low(k) + sum_of(1)
         low_slope(k) = sum_of(2)
         bound(k) = sum_of(3)
      end do
      low(n) = max(whole, 0.0_wp)
      low_slope(n) = whole_slope
      do k = 1, n
         length(k) = step_without_zero(max(low(k), 0.0_wp), low_slope(k), bound(k))
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
         sum_of(4) = sum(curvature(:k))
         sum_of(5) = sum(swing_jerk(:k))
         !$omp simd
         do j = 1, size(horizons)
            trial(j) = horizons(j)*step
            trial(j) = min(trial(j), step_without_zero(low(k), low_slope(k), &
                                                       min(bound(k), max(0.0_wp, sum_of(5)*trial(j) - sum_of(4)))))
         end do
         step = max(step, maxval(trial))
      end do
   end function free_step

   !> `safe_step` of the search, for loops over many of them.
   elemental function step_without_zero(value, slope, bound) result(step)
      !> Value, >= 0
      real(wp), intent(in) :: value
      !> Slope
      real(wp), intent(in) :: slope
      !> Bound on the second derivative, >= 0
      real(wp), intent(in) :: bound
      real(wp) :: step

      real(wp) :: root

      ! without branches: the numerator and the denominator are chosen, not the quotient
      root = abs(slope) + sqrt(slope**2 + 2.0_wp*bound*value)
      step = merge(root, 2.0_wp*value, slope >= 0.0_wp)
      step = step/max(merge(bound, root, slope >= 0.0_wp), 1.0e-290_wp*step, tiny(1.0_wp))
   end function step_without_zero

   !> From now on |weight z| stays within these. Each oscillator by the smaller of two bounds: its energy's,
   !> which is good near critical damping, and its envelope's, which is good far from it.
   pure subroutine bound_terms(oscillators, weight, z, v, terms)
      !> The family
      type(oscillators_t), intent(in) :: oscillators
      !> Weights, [padded]
      real(wp), contiguous, intent(in) :: weight(:)
      !> State now, [padded]
      real(wp), contiguous, intent(in) :: z(:)
      real(wp), contiguous, intent(in) :: v(:)
      !> The bounds, [padded]
      real(wp), contiguous, intent(out) :: terms(:)

      real(wp) :: energy, envelope
      integer :: i

      associate (decay => oscillators%decay, spread => oscillators%spread, inverse => oscillators%inverse_spread)
         !$omp simd private(energy, envelope)
         do i = 1, padded(oscillators%oscillating)
            energy = v(i)**2*oscillators%inverse_square(i)
            envelope = ((v(i) + decay(i)*z(i))*inverse(i))**2
            terms(i) = abs(weight(i))*sqrt(z(i)**2 + min(energy, envelope))
         end do
         !$omp simd private(energy, envelope)
         do i = lanes*(oscillators%oscillating/lanes) + 1, padded(oscillators%count)
            ! z = A exp(-slow t) + B exp(-fast t)
            energy = sqrt(z(i)**2 + v(i)**2*oscillators%inverse_square(i))
            envelope = 0.5_wp*inverse(i)*(abs(v(i) + (decay(i) + 2.0_wp*spread(i))*z(i)) + abs(v(i) + decay(i)*z(i)))
            terms(i) = merge(abs(weight(i))*min(energy, envelope), terms(i), i > oscillators%oscillating)
         end do
      end associate
   end subroutine bound_terms

end module modal_signal
