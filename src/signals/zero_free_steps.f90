!> Steps in which a signal, a sum of terms, certainly has no zero; longer steps than a bound on the second derivative of
!> the whole sum gives.
module zero_free_steps
   use certified_search, only: bound_curvature, bound_jerk, bound_value, step_without_zero, term_columns, &
      term_curvature, term_rate, term_value
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: taylor_step, zero_free_step

contains

   !> Length of a step in which a sum of terms certainly has no zero.
   !>
   !> For each number k, the terms after the k-th are replaced by their lower bounds, and the sum of the first k terms
   !> by the parabola with its value, its slope and a bound on its second derivative. The longest of these steps is
   !> taken. A cubic, with a bound on the third derivative, may give a longer step.
   pure real(wp) function zero_free_step(terms, other_terms, whole, whole_slope) result(step)
      !> Terms of the sum with their bounds, in the columns of `certified_search`, [count, 6]
      real(wp), contiguous, intent(in) :: terms(:, :)
      !> Sum of further terms, in the same columns; its bounds need not include convex terms
      real(wp), intent(in) :: other_terms(term_columns)
      !> The whole sum
      real(wp), intent(in) :: whole
      !> Slope of the whole sum
      real(wp), intent(in) :: whole_slope

      ! for each k, sums over the first k terms: values, slopes, second derivatives and bounds
      real(wp), dimension(size(terms, 1)) :: values, slopes, curvatures, curvature_bounds, jerk_bounds
      ! for each k, sum of the depths below zero that the terms after the k-th can reach
      real(wp) :: depths(size(terms, 1))
      ! for each k, lower bound of the whole sum at the start
      real(wp) :: lower_value(size(terms, 1))
      ! for each k, length of the step
      real(wp) :: step_length(size(terms, 1))
      ! these sums up to the present term
      real(wp) :: value, slope, curvature, curvature_bound, jerk_bound, depth
      real(wp) :: rounding
      integer :: best, k, n

      n = size(terms, 1)
      if (n == 0) then
         ! closed rigid stops have left no mode, so the sum has no terms
         step = step_without_zero(max(whole, 0.0_wp), whole_slope, other_terms(bound_curvature))
         return
      end if
      value = other_terms(term_value)
      slope = other_terms(term_rate)
      curvature = other_terms(term_curvature)
      curvature_bound = other_terms(bound_curvature)
      jerk_bound = other_terms(bound_jerk)
      depth = 0.0_wp
      do k = 1, n
         value = value + terms(k, term_value)
         slope = slope + terms(k, term_rate)
         curvature = curvature + terms(k, term_curvature)
         curvature_bound = curvature_bound + terms(k, bound_curvature)
         jerk_bound = jerk_bound + terms(k, bound_jerk)
         values(k) = value
         slopes(k) = slope
         curvatures(k) = curvature
         curvature_bounds(k) = curvature_bound
         jerk_bounds(k) = jerk_bound
         depths(n + 1 - k) = depth
         depth = depth + terms(n + 1 - k, bound_value)
      end do
      ! rounding error of the partial sums, whatever the order of summation
      rounding = 8.0_wp*epsilon(1.0_wp)*(2.0_wp*(depth + other_terms(bound_value) + abs(other_terms(term_value))) &
         + abs(value))
      !$omp simd
      do k = 1, n
         lower_value(k) = values(k) - depths(k) - rounding
      end do
      lower_value(n) = max(whole, 0.0_wp)
      slopes(n) = whole_slope
      !$omp simd
      do k = 1, n
         step_length(k) = step_without_zero(max(lower_value(k), 0.0_wp), slopes(k), curvature_bounds(k))
         step_length(k) = merge(step_length(k), 0.0_wp, lower_value(k) >= 0.0_wp)
      end do
      step = 0.0_wp
      best = n
      do k = 1, n
         if (step_length(k) > step) then
            step = step_length(k)
            best = k
         end if
      end do
      step = max(step, cubic_step(lower_value(best), slopes(best), curvatures(best), jerk_bounds(best), step))
      if (best < n) step = max(step, cubic_step(lower_value(n), slopes(n), curvatures(n), jerk_bounds(n), step))
   end function zero_free_step

   !> The longest of some multiples of a step over which a cubic is certainly positive, because its minimum Bernstein
   !> coefficient is positive; 0: the cubic may vanish in all. If the largest multiple is free of zeros, its multiples
   !> are tried in turn.
   pure real(wp) function cubic_step(value, slope, curvature, jerk, step) result(longest)
      !> Value at the start
      real(wp), intent(in) :: value
      !> Slope at the start
      real(wp), intent(in) :: slope
      !> Second derivative at the start
      real(wp), intent(in) :: curvature
      !> Maximum rate at which the second derivative falls
      real(wp), intent(in) :: jerk
      !> The step of which multiples are tried
      real(wp), intent(in) :: step

      real(wp), parameter :: multiples(16) = [1.1_wp, 1.2_wp, 1.3_wp, 1.45_wp, 1.6_wp, 1.75_wp, 1.9_wp, 2.1_wp, &
         2.4_wp, 2.7_wp, 3.2_wp, 4.0_wp, 5.0_wp, 7.0_wp, 10.0_wp, 16.0_wp]
      ! powers and products of magnitudes up to this do not overflow
      real(wp), parameter :: max_magnitude = 1.0e70_wp
      ! length of a step, a multiple of `trial_step`
      real(wp) :: h
      ! h^2 (second derivative)/6
      real(wp) :: curvature_term
      ! h^3 (bound on the third derivative)/6
      real(wp) :: jerk_term
      ! minimum Bernstein coefficient of the cubic on [0, h]
      real(wp) :: lower_bound
      real(wp) :: trial_step
      integer :: j

      longest = 0.0_wp
      if (.not. max(abs(slope), abs(curvature), jerk) < max_magnitude) return
      trial_step = step
      do while (trial_step > 0.0_wp .and. trial_step < max_magnitude)
         ! a cubic that vanishes within the step vanishes within all its multiples
         if (.not. value + trial_step*(slope + trial_step*(0.5_wp*curvature - trial_step*jerk/6.0_wp)) > 0.0_wp) exit
         !$omp simd private(curvature_term, jerk_term, h, lower_bound) reduction(max:longest)
         do j = 1, size(multiples)
            h = min(multiples(j)*trial_step, max_magnitude)
            curvature_term = h*h*curvature/6.0_wp
            jerk_term = h*h*h*jerk/6.0_wp
            lower_bound = min(value + h*slope/3.0_wp, value + h*slope*(2.0_wp/3.0_wp) + curvature_term, &
               value + h*slope + 3.0_wp*curvature_term - jerk_term)
            longest = max(longest, merge(h, 0.0_wp, lower_bound > 0.0_wp))
         end do
         ! if stiff modes cancel in the sum, its second derivative is far below its bound: try longer steps
         if (longest < multiples(size(multiples))*trial_step) exit
         trial_step = longest
      end do
   end function cubic_step

   !> Length of a step in which a sum of decaying exponentials certainly has no zero, by the Taylor polynomial of the
   !> sum; 0: no step is found that is much longer than the known step. Large exponentials that cancel in the sum cancel
   !> in the coefficients of the polynomial, too, but not in a bound on the second derivative of the sum.
   pure real(wp) function taylor_step(exponent, term, constant, whole, step) result(longest)
      !> Exponents s, Re s <= 0, [count]
      complex(wp), intent(in) :: exponent(:)
      !> Exponentials at the start of the step, [count]
      complex(wp), intent(in) :: term(:)
      !> Constant of the sum
      real(wp), intent(in) :: constant
      !> The whole sum at the start of the step
      real(wp), intent(in) :: whole
      !> The known step
      real(wp), intent(in) :: step

      integer, parameter :: degree = 15
      ! the first step times the rate of the fastest exponential
      real(wp), parameter :: first_angle = 0.5_wp
      ! factor by which an unsuccessful step is shortened
      real(wp), parameter :: shortened = 0.25_wp
      ! steps that gain less than this factor are not worth their costs
      real(wp), parameter :: min_gain = 16.0_wp
      ! fraction of the sum that is neglected: exponentials that have decayed count by their magnitudes
      real(wp), parameter :: small = 1.0e-3_wp
      ! coefficients of the polynomial of t/h, and its Bernstein coefficients on [0, h] before division by binomials
      real(wp) :: coefficient(0:degree), bernstein(0:degree)
      complex(wp) :: derivative(size(term))
      ! bound on the terms beyond the polynomial (`remainder`), and on exponentials that have `decayed`
      real(wp) :: remainder, decayed
      real(wp) :: fastest, h
      logical :: is_large(size(term))
      integer :: i, j

      longest = 0.0_wp
      is_large = abs(term)*real(size(term), wp) > small*whole
      fastest = maxval(abs(exponent), mask=is_large)
      if (.not. first_angle > min_gain*step*fastest .or. .not. whole > 0.0_wp) return
      h = first_angle/fastest
      decayed = sum(abs(term), mask=.not. is_large)
      derivative = merge(term, (0.0_wp, 0.0_wp), is_large)
      coefficient(0) = constant + sum(real(derivative, wp))
      do j = 1, degree
         where (is_large) derivative = derivative*exponent*cmplx(h/real(j, wp), kind=wp)
         coefficient(j) = sum(real(derivative, wp))
      end do
      ! no exponential grows
      remainder = sum(abs(derivative*exponent), mask=is_large)*h/real(degree + 1, wp)
      do while (h > min_gain*step)
         bernstein = coefficient
         do j = 1, degree
            bernstein(j) = coefficient(j)/binomial(degree, j)
         end do
         do j = 1, degree
            do i = degree, j, -1
               bernstein(i) = bernstein(i) + bernstein(i - 1)
            end do
         end do
         if (minval(bernstein) > decayed + remainder) then
            longest = h
            return
         end if
         h = shortened*h
         coefficient = coefficient*[(shortened**j, j=0, degree)]
         remainder = remainder*shortened**(degree + 1)
      end do

   contains

      !> Number of subsets with k of n elements.
      pure real(wp) function binomial(n, k) result(number)
         integer, intent(in) :: n
         integer, intent(in) :: k

         integer :: i

         number = 1.0_wp
         do i = 1, k
            number = number*real(n + 1 - i, wp)/real(i, wp)
         end do
      end function binomial
   end function taylor_step

end module zero_free_steps
