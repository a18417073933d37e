!> Taylor series of short hops: derivatives of damped oscillators one after the other, and the zero of a series.
module hop_series
   use certified_search, only: step_without_zero
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: next_derivative, zero_of_series

contains

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

end module hop_series
