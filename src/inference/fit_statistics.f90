!> Statistics of a fit: covariance and 95 % intervals from the Jacobian at the minimum, parameters that the signal does
!> not determine, growth of small changes with time, and a test whether the residuals are white noise.
module fit_statistics
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use distributions, only: student_quantile
   use kinds, only: wp
   use singular_vectors, only: find_singular
   implicit none (type, external)
   private
   public :: certainty_t, find_certainty, growth_rate, whiteness

   !> Errors and correlation of fitted parameters.
   type :: certainty_t
      !> Whether the signal determines the parameter; not if the signal does not depend on it, depends only on a
      !> combination of it with other parameters, or the interval is wider than the range
      logical, allocatable :: is_determined(:)
      !> Whether the signal depends on the parameter
      logical, allocatable :: has_influence(:)
      !> Standard errors of the parameters, [parameters]; NaN: the signal does not determine the parameter
      real(wp), allocatable :: error(:)
      !> Half widths of their 95 % intervals, [parameters]
      real(wp), allocatable :: half_width(:)
      !> Covariance of the parameters, [parameters, parameters]; NaN for a parameter on which the signal does not depend
      real(wp), allocatable :: covariance(:, :)
      !> Correlation of the parameters, NaN as in `covariance`, [parameters, parameters]
      real(wp), allocatable :: correlation(:, :)
      !> Condition number of the Jacobian with columns scaled to length 1
      real(wp) :: condition = 1.0_wp
      !> Standard deviation of the noise
      real(wp) :: noise = 0.0_wp
      !> Degrees of freedom of the residuals
      integer :: freedom = 0
   end type certainty_t

   !> A signal does not depend on a parameter whose range, from minimum to maximum, changes the signal by less than this
   !> fraction of its standard deviation.
   real(wp), parameter :: min_influence = 1.0e-8_wp
   !> Condition number of the Jacobian beyond which, within the errors of the derivatives, the signal depends only on
   !> combinations of parameters.
   real(wp), parameter :: max_condition = 1.0e6_wp
   !> Minimum component of a parameter in the least certain direction for which the parameter counts as undetermined.
   real(wp), parameter :: min_component = 0.1_wp

contains

   !> Find the errors of fitted parameters.
   subroutine find_certainty(jacobian, ranges, spread, residual, noise, certainty)
      !> Derivatives of the signal with respect to the parameters, over the relative noise of each value, [samples,
      !> parameters]
      real(wp), intent(in) :: jacobian(:, :)
      !> Maximum minus minimum of each parameter
      real(wp), intent(in) :: ranges(:)
      !> Standard deviation of the signal
      real(wp), intent(in) :: spread
      !> Signal minus model, over the relative noise of each value, [samples]
      real(wp), intent(in) :: residual(:)
      !> Standard deviation of the noise, RMS of all values; 0: estimated from the residuals
      real(wp), intent(in) :: noise
      type(certainty_t), intent(out) :: certainty

      real(wp), allocatable :: scaled(:, :), singular(:), vectors(:, :)
      real(wp) :: nan, norm(size(ranges)), t
      integer, allocatable :: places(:)
      integer :: i, j, k, n

      nan = ieee_value(1.0_wp, ieee_quiet_nan)
      n = size(ranges)
      norm = [(norm2(jacobian(:, k)), k=1, n)]
      allocate (certainty%has_influence(n), source=norm*ranges > min_influence*spread*sqrt(real(size(residual), wp)))
      allocate (certainty%is_determined, source=certainty%has_influence)
      allocate (certainty%error(n), certainty%half_width(n), certainty%covariance(n, n), certainty%correlation(n, n), &
         source=nan)
      places = pack([(k, k=1, n)], certainty%has_influence)
      certainty%freedom = max(1, size(residual) - size(places))
      certainty%noise = sqrt(sum(residual**2)/real(certainty%freedom, wp))
      if (size(places) == 0) return
      allocate (scaled(size(residual), size(places)))
      do k = 1, size(places)
         scaled(:, k) = jacobian(:, places(k))/norm(places(k))
      end do
      call find_singular(scaled, .true., singular, vectors, k)
      ! the minimum avoids a division by 0
      singular = max(singular, tiny(1.0_wp)**0.25_wp)
      certainty%condition = singular(1)/max(singular(size(places)), tiny(1.0_wp))
      if (certainty%condition > max_condition) then
         certainty%is_determined(places) = abs(vectors(:, size(places))) < min_component
      end if
      ! covariance noise^2 (J^T J)^(-1) of the parameters, from the singular values of J with columns of length 1
      do j = 1, size(places)
         do i = 1, size(places)
            certainty%covariance(places(i), places(j)) = merge(noise, certainty%noise, noise > 0.0_wp)**2 &
               *sum(vectors(i, :)*vectors(j, :)/singular**2)/(norm(places(i))*norm(places(j)))
         end do
      end do
      do k = 1, size(places)
         certainty%error(places(k)) = sqrt(certainty%covariance(places(k), places(k)))
      end do
      do j = 1, size(places)
         do i = 1, size(places)
            associate (product => certainty%error(places(i))*certainty%error(places(j)))
               certainty%correlation(places(i), places(j)) = merge(1.0_wp, 0.0_wp, i == j)
               if (product > 0.0_wp .and. i /= j) certainty%correlation(places(i), places(j)) = &
                  certainty%covariance(places(i), places(j))/product
            end associate
         end do
      end do
      t = student_quantile(0.95_wp, certainty%freedom)
      ! noise that is known, not estimated from the residuals, has a normal distribution: infinite degrees of freedom
      if (noise > 0.0_wp) t = student_quantile(0.95_wp, 1000000)
      certainty%half_width = merge(t*certainty%error, nan, certainty%is_determined)
      do k = 1, n
         if (certainty%is_determined(k)) certainty%is_determined(k) = certainty%half_width(k) <= ranges(k)
      end do
   end subroutine find_certainty

   !> Growth rate of the change of the signal by small changes of parameters: slope of the logarithm of the derivatives,
   !> in blocks of time. The derivatives of a chaotic motion grow exponentially, others at most in proportion to time.
   pure function growth_rate(time, jacobian) result(rate)
      real(wp), intent(in) :: time(:)
      !> Derivatives of the signal with respect to the parameters, [samples, parameters]
      real(wp), intent(in) :: jacobian(:, :)
      !> Growth rate per unit of time; 0: too few samples
      real(wp) :: rate

      integer, parameter :: blocks = 10
      real(wp) :: change(blocks), middle(blocks), norm(size(jacobian, 2))
      logical :: is_nonzero(blocks)
      integer :: b, first, k, last

      rate = 0.0_wp
      norm = [(norm2(jacobian(:, k)), k=1, size(norm))]
      if (size(time) < 2*blocks) return
      do b = 1, blocks
         first = 1 + (b - 1)*size(time)/blocks
         last = b*size(time)/blocks
         middle(b) = 0.5_wp*(time(first) + time(last))
         change(b) = 0.0_wp
         do k = 1, size(norm)
            if (norm(k) > 0.0_wp) change(b) = change(b) + sum((jacobian(first:last, k)/norm(k))**2)
         end do
      end do
      is_nonzero = change > 0.0_wp
      if (count(is_nonzero) < blocks/2) return
      ! slope of the straight line through the logarithms of the RMS changes; 1/2, because `change` is a sum of squares
      associate (t => pack(middle, is_nonzero), growth => 0.5_wp*log(pack(change, is_nonzero)))
         associate (mean => sum(t)/real(size(t), wp))
            rate = sum((t - mean)*growth)/sum((t - mean)**2)
         end associate
      end associate
   end function growth_rate

   !> Test of whiteness (G. M. Ljung and G. E. P. Box, Biometrika 65 (1978) 297): probability that white noise has
   !> autocorrelations as large as these residuals; small if the model does not explain the signal.
   pure function whiteness(residual) result(probability)
      real(wp), intent(in) :: residual(:)
      !> Probability; NaN: there are too few residuals, or all vanish
      real(wp) :: probability

      integer, parameter :: max_lags = 20
      real(wp) :: centred(size(residual)), sum_of_squares, statistic, term
      integer :: k, lags, n

      n = size(residual)
      ! for an even number of degrees of freedom the probability is a finite sum
      lags = min(max_lags, 2*(n/10))
      probability = ieee_value(1.0_wp, ieee_quiet_nan)
      centred = residual - sum(residual)/real(n, wp)
      sum_of_squares = sum(centred**2)
      if (lags < 2 .or. sum_of_squares <= 0.0_wp) return
      statistic = 0.0_wp
      do k = 1, lags
         statistic = statistic + (sum(centred(1 + k:)*centred(:n - k))/sum_of_squares)**2/real(n - k, wp)
      end do
      statistic = 0.5_wp*statistic*real(n, wp)*real(n + 2, wp)
      ! probability that chi squared with an even number of degrees of freedom exceeds twice this value
      term = 1.0_wp
      probability = 1.0_wp
      do k = 1, lags/2 - 1
         term = term*statistic/real(k, wp)
         probability = probability + term
      end do
      probability = probability*exp(-min(statistic, 700.0_wp))
   end function whiteness

end module fit_statistics
