!> Student's t distribution, for the confidence intervals of means of few values.
module student
   use kinds, only: pi, wp
   implicit none (type, external)
   private
   public :: student_quantile

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

end module student
