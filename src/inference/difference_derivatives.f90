!> Derivatives of computed values by Richardson's extrapolation of differences, with an estimate of their errors (C. J.
!> F. Ridders, Adv. Eng. Softw. 4 (1982) 75). A value may have a kink or a jump where an event appears or disappears, so
!> the one-sided derivatives are computed too, and a derivative exists only if both agree.
module difference_derivatives
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan, ieee_quiet_nan, ieee_value
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: derivative_t, differentiate, derivative_states
   public :: derivative_unknown, derivative_exists, derivative_from_above, derivative_from_below, derivative_differs

   !> State of a derivative: too few values are known.
   integer, parameter :: derivative_unknown = 1
   !> The derivatives from above and from below agree.
   integer, parameter :: derivative_exists = 2
   !> The function is known above the point only: the parameter is at its minimum, or a measure has no value below.
   integer, parameter :: derivative_from_above = 3
   !> The function is known below the point only: the parameter is at its maximum, or a measure has no value above.
   integer, parameter :: derivative_from_below = 4
   !> The one-sided derivatives differ or do not converge: a kink, a jump or a square root.
   integer, parameter :: derivative_differs = 5
   !> Names of these states in results files.
   character(*), parameter :: derivative_states(5) = [character(10) :: 'unknown', 'exists', 'from above', &
      'from below', &
      'none']

   !> A derivative with its one-sided derivatives and their estimated errors; NaN if a derivative does not exist.
   type :: derivative_t
      !> One of the `derivative_` constants
      integer :: state = derivative_unknown
      !> The derivative; if one side alone is known, the one-sided derivative
      real(wp) :: value = 0.0_wp
      !> Estimated error of the derivative
      real(wp) :: error = 0.0_wp
      !> One-sided derivative from above
      real(wp) :: above = 0.0_wp
      !> Estimated error of `above`
      real(wp) :: above_error = 0.0_wp
      !> One-sided derivative from below
      real(wp) :: below = 0.0_wp
      !> Estimated error of `below`
      real(wp) :: below_error = 0.0_wp
      !> Whether the error from above is relatively small or negligible
      logical :: above_converges = .false.
      !> Whether the error from below is relatively small or negligible
      logical :: below_converges = .false.
   end type derivative_t

   !> One-sided derivatives agree if they differ by at most this multiple of their errors plus a fraction of their
   !> magnitude.
   real(wp), parameter :: error_multiple = 10.0_wp
   !> Fraction of their magnitude by which one-sided derivatives that agree may differ.
   real(wp), parameter :: relative_tolerance = 1.0e-4_wp
   !> Maximum relative error of a derivative that exists; for example, estimates at a square root grow without limit.
   real(wp), parameter :: max_relative_error = 0.05_wp
   !> A derivative that changes the value by less than this fraction over the first step counts as zero.
   real(wp), parameter :: negligible_change = 1.0e-7_wp

contains

   !> Derivative of a function f at a point from its values at the point and at steps to both sides.
   pure type(derivative_t) function differentiate(step, value, above, below) result(derivative)
      !> First step h; each further step is half of the preceding one
      real(wp), intent(in) :: step
      !> f at the point
      real(wp), intent(in) :: value
      !> f at the point plus each step, [steps]; NaN: unknown
      real(wp), intent(in) :: above(:)
      !> f at the point minus each step, [steps]; NaN: unknown
      real(wp), intent(in) :: below(:)

      real(wp) :: h(size(above)), central, central_error, nan, negligible
      integer :: k

      nan = ieee_value(1.0_wp, ieee_quiet_nan)
      derivative = derivative_t(derivative_unknown, nan, nan, nan, nan, nan, nan, .false., .false.)
      if (ieee_is_nan(value)) return
      h = [(scale(step, 1 - k), k=1, size(h))]
      associate (rounding => 4.0_wp*epsilon(1.0_wp)*abs(value))
         call extrapolate(one_sided(h, above), h(2:), 1, rounding, derivative%above, derivative%above_error)
         call extrapolate(-one_sided(h, below), h(2:), 1, rounding, derivative%below, derivative%below_error)
         call extrapolate((above - below)/(2.0_wp*h), h, 2, rounding, central, central_error)
      end associate
      negligible = negligible_change*abs(value)/step
      derivative%above_converges = is_converged(derivative%above, derivative%above_error, negligible)
      derivative%below_converges = is_converged(derivative%below, derivative%below_error, negligible)
      if (all(ieee_is_nan(below)) .and. derivative%above_converges) then
         derivative%state = derivative_from_above
         derivative%value = derivative%above
         derivative%error = derivative%above_error
      else if (all(ieee_is_nan(above)) .and. derivative%below_converges) then
         derivative%state = derivative_from_below
         derivative%value = derivative%below
         derivative%error = derivative%below_error
      else if (.not. all(ieee_is_nan([derivative%above, derivative%below]))) then
         derivative%state = derivative_differs
         ! unknown values must not be compared, because comparisons with NaN trap in checked builds
         if (.not. (derivative%above_converges .and. derivative%below_converges .and. &
            is_converged(central, central_error, negligible))) return
         if (agree(derivative%above, derivative%above_error, derivative%below, derivative%below_error, negligible) &
            .and. agree(central, central_error, 0.5_wp*(derivative%above + derivative%below), &
            derivative%above_error + derivative%below_error, negligible)) then
            derivative%state = derivative_exists
            derivative%value = central
            derivative%error = central_error
         end if
      end if
   end function differentiate

   !> Slopes between neighbouring steps of one side. The value at the point itself is not used, so that a jump at the
   !> point does not matter.
   pure function one_sided(h, values) result(slopes)
      !> Steps, descending
      real(wp), intent(in) :: h(:)
      !> f at the steps
      real(wp), intent(in) :: values(:)
      real(wp) :: slopes(size(h) - 1)

      associate (n => size(h))
         slopes = (values(:n - 1) - values(2:))/(h(:n - 1) - h(2:))
      end associate
   end function one_sided

   !> Whether the error of an extrapolated value is relatively small, or negligible.
   elemental logical function is_converged(value, error, negligible)
      !> NaN: unknown, and so not converged
      real(wp), intent(in) :: value
      real(wp), intent(in) :: error
      real(wp), intent(in) :: negligible

      is_converged = .not. ieee_is_nan(value)
      if (is_converged) is_converged = error <= max(max_relative_error*abs(value), negligible)
   end function is_converged

   !> Whether two numbers agree within their errors, or their difference is negligible.
   pure logical function agree(first, first_error, second, second_error, negligible)
      real(wp), intent(in) :: first
      real(wp), intent(in) :: first_error
      real(wp), intent(in) :: second
      real(wp), intent(in) :: second_error
      real(wp), intent(in) :: negligible

      agree = abs(first - second) <= error_multiple*(first_error + second_error) + &
         max(relative_tolerance*max(abs(first), abs(second)), negligible)
   end function agree

   !> Extrapolate estimates at steps that are halved each time to step zero. The limit is the entry of Richardson's
   !> table with the smallest error among those that the smaller steps do not contradict: neighbouring estimates at
   !> large steps, which an event may disturb, can agree by coincidence. The error of an entry is twice its difference
   !> from its two neighbours, and the error of the values over the step.
   pure subroutine extrapolate(estimates, h, power, rounding, limit, error)
      !> Estimates, in the order of decreasing steps; NaN: unknown
      real(wp), intent(in) :: estimates(:)
      !> Steps, [estimates]
      real(wp), intent(in) :: h(:)
      !> The error of an estimate is a series in the powers `power`, 2 `power`, ... of the step
      integer, intent(in) :: power
      !> Minimum error of the values
      real(wp), intent(in) :: rounding
      !> Limit; NaN if no two neighbouring estimates are known
      real(wp), intent(out) :: limit
      !> Error of the limit
      real(wp), intent(out) :: error

      ! changes between the estimates of the smallest steps, extrapolated up to twice, are due to errors of the values
      integer, parameter :: extrapolations = 2, last_steps = 2
      ! two entries contradict each other if they differ by more than this multiple of their errors
      real(wp), parameter :: contradiction = 3.0_wp
      real(wp) :: table(size(estimates), 0:size(estimates) - 1), error_of_values
      ! errors of the entries of one step, [extrapolations]
      real(wp) :: errors(size(estimates) - 1)
      integer :: j, k, n

      n = size(estimates)
      table = ieee_value(1.0_wp, ieee_quiet_nan)
      table(:, 0) = estimates
      do j = 1, n - 1
         ! table(k, j) extrapolates the estimates k - j ... k
         associate (factor => 2.0_wp**(power*j))
            table(j + 1:, j) = (factor*table(j + 1:, j - 1) - table(j:n - 1, j - 1))/(factor - 1.0_wp)
         end associate
      end do
      ! an event among the steps changes the columns that extrapolate across it; errors of the values change all columns
      error_of_values = huge(1.0_wp)
      do j = 0, min(extrapolations, n - 2)
         associate (first => max(j + 2, n - last_steps + 1))
            associate (changes => 2.0_wp*abs(table(first:, j) - table(first - 1:n - 1, j))*h(first:))
               if (any(ieee_is_finite(changes))) error_of_values = min(error_of_values, &
                  maxval(changes, mask=ieee_is_finite(changes)))
            end associate
         end associate
      end do
      error_of_values = max(merge(error_of_values, 0.0_wp, error_of_values < huge(1.0_wp)), rounding)
      limit = ieee_value(1.0_wp, ieee_quiet_nan)
      error = huge(1.0_wp)
      do k = n, 2, -1
         errors = huge(1.0_wp)
         do j = 1, k - 1
            if (ieee_is_finite(table(k, j))) errors(j) = error_of_values/h(k) + &
               2.0_wp*max(abs(table(k, j) - table(k, j - 1)), abs(table(k, j) - table(k - 1, j - 1)))
         end do
         j = minloc(errors, dim=1)
         if (errors(j) >= huge(1.0_wp)) cycle
         if (error < huge(1.0_wp)) then
            if (abs(table(k, j) - limit) > contradiction*(errors(j) + error)) exit
         end if
         if (errors(j) >= error) cycle
         error = errors(j)
         limit = table(k, j)
      end do
      if (ieee_is_nan(limit)) error = limit
   end subroutine extrapolate

end module difference_derivatives
