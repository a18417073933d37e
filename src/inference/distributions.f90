!> Probabilities and quantiles of the normal distribution, also truncated.
module distributions
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: normal_probability, normal_quantile, quantile_within

contains

   !> Probability that a number from the normal distribution with mean 0 and standard deviation 1 is less than x.
   elemental function normal_probability(x) result(probability)
      real(wp), intent(in) :: x
      real(wp) :: probability

      probability = 0.5_wp*erfc(-x/sqrt(2.0_wp))
   end function normal_probability

   !> Quantile of the normal distribution with mean 0 and standard deviation 1, by bisection and Newton's method.
   elemental function normal_quantile(probability) result(x)
      !> 0 to 1, both excluded
      real(wp), intent(in) :: probability
      real(wp) :: x

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
         slope = exp(-0.5_wp*x**2)/sqrt(2.0_wp*acos(-1.0_wp))
         previous = x
         x = x - (normal_probability(x) - lower_probability)/max(slope, tiny(slope))
         if (abs(x - previous) <= 2.0_wp*epsilon(x)*abs(x)) exit
         if (.not. (x > low .and. x < high)) x = 0.5_wp*(low + high)
      end do
      if (probability > 0.5_wp) x = -x
   end function normal_quantile

   !> Quantile of a normal distribution that is truncated at two limits.
   elemental function quantile_within(probability, mean, deviation, minimum, maximum) result(x)
      !> 0 to 1, both excluded
      real(wp), intent(in) :: probability
      real(wp), intent(in) :: mean
      real(wp), intent(in) :: deviation
      real(wp), intent(in) :: minimum
      real(wp), intent(in) :: maximum
      real(wp) :: x

      real(wp) :: above, below

      below = normal_probability((minimum - mean)/deviation)
      above = normal_probability((maximum - mean)/deviation)
      x = mean + deviation*normal_quantile(min(max(below + probability*(above - below), tiny(x)), 1.0_wp - epsilon(x)))
      x = min(max(x, minimum), maximum)
   end function quantile_within

end module distributions
