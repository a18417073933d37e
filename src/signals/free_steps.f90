!> How far a sum of terms has no zero for certain, by more than the bound on its second derivative.
module free_steps
   use certified_search, only: bound_curvature, bound_jerk, bound_value, step_without_zero, term_columns, &
      term_curvature, term_rate, term_value
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: free_step

contains

   !> How far there is certainly no zero, by more than one bound on the second derivative.
   !>
   !> The modes above any number k come no further below zero than they are bounded to; those up to k are kept by their
   !> value, slope and a bound B on their second derivative. The best k is taken. From there a cubic may reach further:
   !> the second derivative falls no faster than a bound on the third.
   pure function free_step(terms, rest, whole, whole_slope) result(step)
      !> Terms of the sum with their bounds, [count, 6]
      real(wp), contiguous, intent(in) :: terms(:, :)
      !> What is added to the terms, in the same columns; the bounds are but on what of it is not convex
      real(wp), intent(in) :: rest(term_columns)
      !> The sum and its slope
      real(wp), intent(in) :: whole
      real(wp), intent(in) :: whole_slope
      real(wp) :: step

      ! sums of the first k terms, and of the last
      real(wp), dimension(size(terms, 1)) :: values, slopes, bounds, curvatures, jerks, left, low, length
      real(wp) :: sums(6), doubt
      integer :: best, k, n

      n = size(terms, 1)
      sums(:5) = rest([term_value, term_rate, bound_curvature, term_curvature, bound_jerk])
      sums(6) = 0.0_wp
      do k = 1, n
         sums(1) = sums(1) + terms(k, term_value)
         sums(2) = sums(2) + terms(k, term_rate)
         sums(3) = sums(3) + terms(k, bound_curvature)
         sums(4) = sums(4) + terms(k, term_curvature)
         sums(5) = sums(5) + terms(k, bound_jerk)
         values(k) = sums(1)
         slopes(k) = sums(2)
         bounds(k) = sums(3)
         curvatures(k) = sums(4)
         jerks(k) = sums(5)
         left(n + 1 - k) = sums(6)
         sums(6) = sums(6) + terms(n + 1 - k, bound_value)
      end do
      ! what the order of summation leaves in doubt
      doubt = 8.0_wp*epsilon(1.0_wp)*(2.0_wp*(sums(6) + rest(bound_value) + abs(rest(term_value))) + abs(sums(1)))
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
      step = max(step, cubic_step(low(best), slopes(best), curvatures(best), jerks(best), step))
      if (best < n) step = max(step, cubic_step(low(n), slopes(n), curvatures(n), jerks(n), step))
   end function free_step

   !> How far a cubic is certainly positive, of some multiples of a step, and of multiples of the longest of them; 0: of
   !> none. It does not come below the least of its coefficients in Bernstein's form.
   pure function cubic_step(value, slope, curvature, jerk, step) result(longest)
      !> Value, slope and second derivative at the start, and how fast that falls at the most
      real(wp), intent(in) :: value
      real(wp), intent(in) :: slope
      real(wp), intent(in) :: curvature
      real(wp), intent(in) :: jerk
      !> What the multiples are of
      real(wp), intent(in) :: step
      real(wp) :: longest

      real(wp), parameter :: multiples(16) = [1.1_wp, 1.2_wp, 1.3_wp, 1.45_wp, 1.6_wp, 1.75_wp, 1.9_wp, 2.1_wp, &
         2.4_wp, 2.7_wp, 3.2_wp, 4.0_wp, 5.0_wp, 7.0_wp, 10.0_wp, 16.0_wp]
      ! powers and products of no more than this do not overflow
      real(wp), parameter :: greatest = 1.0e70_wp
      real(wp) :: bend, fall, h, least, reach
      integer :: j

      longest = 0.0_wp
      if (.not. max(abs(slope), abs(curvature), jerk) < greatest) return
      reach = step
      do while (reach > 0.0_wp .and. reach < greatest)
         !$omp simd private(bend, fall, h, least) reduction(max:longest)
         do j = 1, size(multiples)
            h = min(multiples(j)*reach, greatest)
            bend = h*h*curvature/6.0_wp
            fall = h*h*h*jerk/6.0_wp
            least = min(value + h*slope/3.0_wp, value + h*slope*(2.0_wp/3.0_wp) + bend, &
               value + h*slope + 3.0_wp*bend - fall)
            longest = max(longest, merge(h, 0.0_wp, least > 0.0_wp))
         end do
         ! where stiff modes cancel the second derivative is far below its bound
         if (longest < multiples(size(multiples))*reach) exit
         reach = longest
      end do
   end function cubic_step

end module free_steps
