!> Student's t distribution, for the confidence intervals of means of few values; probabilities and quantiles of the
!> normal distribution, also truncated.
module distributions
   use kinds, only: pi, wp
   implicit none (type, external)
   private
   public :: student_quantile, normal_probability, normal_quantile, quantile_within

contains

   !> The bound that |t| does not exceed with a given probability.
   pure real(wp) function student_quantile(confidence, freedom) result(t)
      !> Probability that |t| is within the bound, 0 to 1
      real(wp), intent(in) :: confidence
      !> Degrees of freedom, >= 1
      integer, intent(in) :: freedom

      real(wp) :: high, low, middle

      ! bisection on the angle atan(t/sqrt(freedom)), which is bounded
      low = 0.0_wp
      high = 0.5_wp*pi
      do
         middle = 0.5_wp*(low + high)
         if (middle <= low .or. middle >= high) exit
         if (probability_within(middle, freedom) < confidence) then
            low = middle
         else
            high = middle
         end if
      end do
      t = sqrt(real(freedom, wp))*tan(middle)
   end function student_quantile

   !> Probability that |t| <= sqrt(freedom) tan(angle), as a finite sum (Abramowitz and Stegun,
   !> 26.7.3 and 26.7.4).
   pure real(wp) function probability_within(angle, freedom) result(probability)
      real(wp), intent(in) :: angle
      integer, intent(in) :: freedom

      real(wp) :: sum, term
      integer :: k

      sum = 0.0_wp
      if (modulo(freedom, 2) == 1) then
         term = cos(angle)
         do k = 1, freedom - 2, 2
            sum = sum + term
            term = term*cos(angle)**2*real(k + 1, wp)/real(k + 2, wp)
         end do
         probability = 2.0_wp/pi*(angle + sin(angle)*sum)
      else
         term = 1.0_wp
         do k = 0, freedom - 2, 2
            sum = sum + term
            term = term*cos(angle)**2*real(k + 1, wp)/real(k + 2, wp)
         end do
         probability = sin(angle)*sum
      end if
   end function probability_within

   !> Probability that a number from the normal distribution with mean 0 and standard deviation 1 is less than x.
   elemental real(wp) function normal_probability(x) result(probability)
      real(wp), intent(in) :: x

      probability = 0.5_wp*erfc(-x/sqrt(2.0_wp))
   end function normal_probability

   !> Quantile of the normal distribution with mean 0 and standard deviation 1, by Newton's method, with a bisection if
   !> a step leaves the interval that contains the quantile.
   elemental real(wp) function normal_quantile(probability) result(x)
      !> 0 to 1, both excluded
      real(wp), intent(in) :: probability

      ! the probability of a number below -38 is less than the smallest normalised real number
      real(wp), parameter :: max_deviations = 38.0_wp
      real(wp) :: previous, high, low, lower_probability, slope
      integer :: i

      ! compute in the lower half, where small probabilities have all their digits
      lower_probability = min(probability, 1.0_wp - probability)
      low = -max_deviations
      high = 0.0_wp
      x = 0.0_wp
      do i = 1, 100
         if (normal_probability(x) < lower_probability) then
            low = x
         else
            high = x
         end if
         slope = exp(-0.5_wp*x**2)/sqrt(2.0_wp*pi)
         previous = x
         x = x - (normal_probability(x) - lower_probability)/max(slope, tiny(slope))
         if (abs(x - previous) <= 2.0_wp*epsilon(x)*abs(x)) exit
         if (.not. (x > low .and. x < high)) x = 0.5_wp*(low + high)
      end do
      if (probability > 0.5_wp) x = -x
   end function normal_quantile

   !> Quantile of a normal distribution that is truncated at two limits. The minimum must be at most a few standard
   !> deviations above the mean: beyond, the difference of the probabilities of both limits has lost its digits.
   elemental real(wp) function quantile_within(probability, mean, deviation, minimum, maximum) result(x)
      !> 0 to 1, both excluded
      real(wp), intent(in) :: probability
      real(wp), intent(in) :: mean
      real(wp), intent(in) :: deviation
      real(wp), intent(in) :: minimum
      real(wp), intent(in) :: maximum

      ! probabilities of a number below the minimum and below the maximum, without truncation
      real(wp) :: below_minimum, below_maximum
      ! probability of a number below the quantile, without truncation
      real(wp) :: untruncated

      below_minimum = normal_probability((minimum - mean)/deviation)
      below_maximum = normal_probability((maximum - mean)/deviation)
      untruncated = below_minimum + probability*(below_maximum - below_minimum)
      ! the quantiles of 0 and 1 are infinite
      x = mean + deviation*normal_quantile(min(max(untruncated, tiny(x)), 1.0_wp - epsilon(x)))
      x = min(max(x, minimum), maximum)
   end function quantile_within

end module distributions
