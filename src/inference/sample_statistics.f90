!> Mean, standard deviation, quantiles and histogram of a sample, each with its error.
module sample_statistics
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
   use distributions, only: student_quantile
   use kinds, only: wp
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: sample_t, find_sample_statistics

   !> Statistics of a sample. Errors are half widths of 95 % intervals for independent numbers; errors of a Latin
   !> hypercube are rarely larger. The fewer the values, the nearer the error of the standard deviation is at least to
   !> that of normally distributed values; with `few` or fewer it is not below it.
   type :: sample_t
      !> Number of values that are not NaN
      integer :: count = 0
      real(wp) :: mean = 0.0_wp
      real(wp) :: mean_error = 0.0_wp
      real(wp) :: deviation = 0.0_wp
      real(wp) :: deviation_error = 0.0_wp
      !> Quantile of each probability, [probabilities]
      real(wp), allocatable :: quantile(:)
      !> Error of each quantile, [probabilities]; NaN: one end of the interval is beyond all values
      real(wp), allocatable :: quantile_error(:)
      !> Minimum of the values, the lower end of the first class of the histogram
      real(wp) :: minimum = 0.0_wp
      !> Upper ends of the classes, which have equal widths
      real(wp), allocatable :: class(:)
      !> Number of values in each class
      integer, allocatable :: in_class(:)
   end type sample_t

   !> Half width of a 95 % interval in standard deviations.
   real(wp), parameter :: half_width = 1.959963984540054_wp

   !> Number of values up to which their fourth moment is too uncertain to show a distribution narrower than the normal
   !> one, and weight of the normal distribution, as a number of values, if there are more.
   real(wp), parameter :: few = 30.0_wp

contains

   !> Find the statistics of a sample.
   subroutine find_sample_statistics(values, probabilities, classes, sample)
      !> Values; NaN: no value
      real(wp), intent(in) :: values(:)
      !> Probabilities of the quantiles
      real(wp), intent(in) :: probabilities(:)
      !> Number of classes of the histogram
      integer, intent(in) :: classes
      type(sample_t), intent(out) :: sample

      real(wp), allocatable :: sorted(:)
      ! degrees of freedom beyond which Student's t differs from the normal quantile by less than 2e-4
      integer, parameter :: max_freedom = 10000
      real(wp) :: fourth, n, nan, t, width
      integer :: i, k

      nan = ieee_value(1.0_wp, ieee_quiet_nan)
      allocate (sorted, source=pack(values, .not. ieee_is_nan(values)))
      sample%count = size(sorted)
      allocate (sample%quantile(size(probabilities)), sample%quantile_error(size(probabilities)), &
         sample%class(classes), &
         source=nan)
      allocate (sample%in_class(classes), source=0)
      sample%mean = nan
      sample%mean_error = nan
      sample%deviation = nan
      sample%deviation_error = nan
      if (sample%count < 2) return
      sorted(:) = sorted(ascending_order(sorted))
      n = real(sample%count, wp)
      sample%mean = sum(sorted)/n
      sample%deviation = sqrt(sum((sorted - sample%mean)**2)/(n - 1.0_wp))
      t = student_quantile(0.95_wp, min(sample%count - 1, max_freedom))
      sample%mean_error = t*sample%deviation/sqrt(n)
      ! The variance s^2 has the variance (m4 - s^4 (n - 3)/(n - 1))/n, m4 being the fourth central moment (3 s^4 of a
      ! normal distribution), and d(s^2) = 2 s ds.
      fourth = sum((sorted - sample%mean)**4)/n
      fourth = fourth + max(3.0_wp*sample%deviation**4 - fourth, 0.0_wp)*min(1.0_wp, few/n)
      sample%deviation_error = 0.0_wp
      if (sample%deviation > 0.0_wp) sample%deviation_error = t* &
         sqrt(max(fourth - sample%deviation**4*(n - 3.0_wp)/(n - 1.0_wp), 0.0_wp)/n)/(2.0_wp*sample%deviation)
      ! the share of values below a quantile has the variance p (1 - p)/n
      do k = 1, size(probabilities)
         associate (p => probabilities(k))
            sample%quantile(k) = quantile_of(sorted, p)
            associate (spread => half_width*sqrt(p*(1.0_wp - p)/n))
               if (p > spread .and. p + spread < 1.0_wp) sample%quantile_error(k) = 0.5_wp &
                  *(quantile_of(sorted, p + spread) - quantile_of(sorted, p - spread))
            end associate
         end associate
      end do
      sample%minimum = sorted(1)
      width = (sorted(sample%count) - sorted(1))/real(classes, wp)
      sample%class = [(sorted(1) + real(k, wp)*width, k=1, classes)]
      sample%class(classes) = sorted(sample%count)
      k = 1
      do i = 1, sample%count
         do while (k < classes .and. sorted(i) > sample%class(k))
            k = k + 1
         end do
         sample%in_class(k) = sample%in_class(k) + 1
      end do
   end subroutine find_sample_statistics

   !> Quantile of a sorted sample, interpolated linearly.
   pure real(wp) function quantile_of(sorted, probability) result(value)
      real(wp), intent(in) :: sorted(:)
      real(wp), intent(in) :: probability

      real(wp) :: place
      integer :: k

      place = min(max(probability*real(size(sorted), wp) + 0.5_wp, 1.0_wp), real(size(sorted), wp))
      k = min(int(place), size(sorted) - 1)
      value = sorted(k) + (place - real(k, wp))*(sorted(k + 1) - sorted(k))
   end function quantile_of

end module sample_statistics
