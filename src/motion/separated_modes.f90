!> Modes far beyond critical damping, by their two exponentials: A exp(-slow t) + B exp(-fast t).
module separated_modes
   use damped_oscillators, only: greatest_exponent, lanes, oscillators_t
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: separate, advance, join, bound_separate

contains

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

   !> Their terms of the sum and of its derivatives, and the bounds from now on.
   pure subroutine bound_separate(oscillators, weight, slow, fast, value, rate, curvature, swing, swing_curvature, swing_jerk)
      !> The family
      type(oscillators_t), intent(in) :: oscillators
      !> Weights, [padded]
      real(wp), contiguous, intent(in) :: weight(:)
      !> From `separate`, [padded]
      real(wp), contiguous, intent(in) :: slow(:)
      real(wp), contiguous, intent(in) :: fast(:)
      !> Terms and their first and second derivatives; those of blended modes stay, here and below, [padded]
      real(wp), contiguous, intent(inout) :: value(:)
      real(wp), contiguous, intent(inout) :: rate(:)
      real(wp), contiguous, intent(inout) :: curvature(:)
      !> Bounds on the terms, on their second and on their third derivatives, [padded]
      real(wp), contiguous, intent(inout) :: swing(:)
      real(wp), contiguous, intent(inout) :: swing_curvature(:)
      real(wp), contiguous, intent(inout) :: swing_jerk(:)

      real(wp) :: slow_rate, fast_rate, slow_term, fast_term
      integer :: i

      do i = oscillators%blended + 1, size(slow)
         slow_rate = oscillators%decay(i)
         fast_rate = slow_rate + 2.0_wp*oscillators%spread(i)
         slow_term = weight(i)*slow(i)
         fast_term = weight(i)*fast(i)
         value(i) = slow_term + fast_term
         swing(i) = abs(slow_term) + abs(fast_term)
         slow_term = -slow_term*slow_rate
         fast_term = -fast_term*fast_rate
         rate(i) = slow_term + fast_term
         slow_term = -slow_term*slow_rate
         fast_term = -fast_term*fast_rate
         curvature(i) = slow_term + fast_term
         swing_curvature(i) = abs(slow_term) + abs(fast_term)
         swing_jerk(i) = abs(slow_term)*slow_rate + abs(fast_term)*fast_rate
      end do
   end subroutine bound_separate

end module separated_modes
