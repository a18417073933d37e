!> Results of a fit: the group /fit of the results file, and the table on the console; and the statistics that they
!> contain: covariance and 95 % intervals from the Jacobian at the minimum, parameters that the signal does not
!> determine, growth of small changes with time, and a test whether the residuals are white noise.
module fit_results
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
   use distributions, only: student_quantile
   use fit_model, only: max_name_length
   use inference_settings, only: observed_impacts, observed_table
   use kinds, only: wp
   use number_text, only: rounded, to_text
   use quantities, only: units_t, units_in
   use quantity_groups, only: quantity_group_t
   use reader_units, only: with_unit, unit_in
   use scene_types, only: scene_t
   use singular_vectors, only: find_singular
   use sweep_plan, only: plan_t
   use table_columns, only: add_numbers, add_texts, print_line, print_table, print_title, six_digits, &
      table_t, two_digits
   implicit none (type, external)
   private
   public :: fit_t, write_fit, print_fit, significance, smallest_share, certainty_t, find_certainty, growth_rate, &
      whiteness

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

   !> Residuals with a smaller probability of whiteness are not white noise.
   real(wp), parameter :: significance = 0.01_wp

   !> An interval is too narrow if the sum of squares at one of its ends increases by less than this share of the
   !> increase of a linear signal.
   real(wp), parameter :: smallest_share = 0.6_wp

   !> Estimates of the fitted parameters with their errors, and the quality of the fit.
   type :: fit_t
      !> Names of the fitted parameters, [parameters]
      character(max_name_length), allocatable :: names(:)
      !> Units of the fitted parameters; '1': dimensionless
      character(max_name_length), allocatable :: units(:)
      !> Estimates of the parameters, [parameters]
      real(wp), allocatable :: values(:)
      !> Minimum of each parameter, [parameters]
      real(wp), allocatable :: minimum(:)
      !> Maximum of each parameter, [parameters]
      real(wp), allocatable :: maximum(:)
      type(certainty_t) :: certainty
      !> Signal of the model with the fitted parameters, in the units of the results, [samples]
      real(wp), allocatable :: model(:)
      !> Probability that white noise has autocorrelations as large as the residuals
      real(wp) :: whiteness = 0.0_wp
      !> Exponential growth rate of changes of the signal due to small changes of the parameters, per unit of time
      real(wp) :: growth_rate = 0.0_wp
      !> Time at which a change of the size of the noise has grown to the size of the signal; `huge`: it does not grow
      real(wp) :: horizon = huge(1.0_wp)
      !> Whether the residuals are rounding errors
      logical :: is_exact = .false.
      !> Increase of the sum of squares at the ends of the intervals, over that of a linear signal, [parameters]
      real(wp), allocatable :: interval_share(:)
      !> Parameters at the start of each fit, [parameters, starts]
      real(wp), allocatable :: started(:, :)
      !> Parameters at the end of each fit, [parameters, starts]; NaN: the start failed
      real(wp), allocatable :: ended(:, :)
      !> Sum of squares at the end of each fit, [starts]; NaN: the start failed
      real(wp), allocatable :: sums(:)
      !> Number of runs of each fit, [starts]
      real(wp), allocatable :: runs(:)
      !> Number of starts whose fits ended at the estimates
      integer :: agreeing = 0
      !> Number of impacts or rebounds of the signal that the run with the estimates does not have
      integer :: missing = 0
   end type fit_t

contains

   !> Write the group of the results file.
   subroutine write_fit(group, scene, plan, fit)
      type(quantity_group_t), intent(in) :: group
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      type(fit_t), intent(in) :: fit

      type(quantity_group_t) :: part
      character(*), parameter :: along = 'parameter', own = "the parameter's"
      character(:), allocatable :: unit
      integer :: i, k, n

      n = size(fit%values)
      call group%attribute('data', scene%fit%data)
      call group%attribute('of', trim(observed_table(scene%fit%observed)%name))
      call group%attribute('condition', fit%certainty%condition)
      call group%attribute('noise', fit%certainty%noise)
      call group%attribute('freedom', [fit%certainty%freedom])
      call group%attribute('whiteness', fit%whiteness)
      call group%attribute('growth_rate', fit%growth_rate)
      if (fit%horizon < huge(1.0_wp)) call group%attribute('horizon', fit%horizon)
      call group%attribute('starts', [size(fit%sums)])
      call group%attribute('agreeing_starts', [fit%agreeing])
      if (observed_table(scene%fit%observed)%is_feature) call group%attribute('missing', [fit%missing])
      call group%add(along, [(i, i=1, n)], '1', 'number of the parameter', is_scale=.true.)
      call group%add('name', fit%names, 'none', 'parameter', along)
      call group%add('unit', fit%units, 'none', 'its unit', along)
      call group%add('estimate', fit%values, own, 'value with the minimum sum of squares', along=along)
      call group%add('standard_error', fit%certainty%error, own, &
         'standard error; nan: the signal does not depend on it', &
         along=along)
      call group%add('half_width', fit%certainty%half_width, own, 'half width of the 95 % interval; nan: the signal ' &
         //'cannot tell it', along=along)
      call group%add('interval_share', fit%interval_share, '1', 'increase of the sum of squares at the ends of the ' &
         //'interval, over that of a signal linear in the parameters', along=along)
      call group%add('least', fit%minimum, own, 'minimum value allowed', along=along)
      call group%add('greatest', fit%maximum, own, 'maximum value allowed', along=along)
      call group%add('is_told', merge(1, 0, fit%certainty%is_determined), '1', '1: the signal determines it', &
         along=along)
      part = group%subgroup('joint')
      call part%add('first', [(i, i=1, n)], '1', 'number of a parameter', is_scale=.true.)
      call part%add('second', [(i, i=1, n)], '1', 'number of another', is_scale=.true.)
      call part%add('covariance', fit%certainty%covariance, "product of the parameters'", 'covariance', &
         'first second')
      call part%add('correlation', fit%certainty%correlation, '1', 'correlation', 'first second')
      part = group%subgroup('signal')
      unit = unit_in(units_in(scene), observed_table(scene%fit%observed)%quantity, '1')
      if (observed_table(scene%fit%observed)%is_feature) then
         call part%add('time', scene%fit%time, '1', 'number of the impact or rebound', is_scale=.true.)
      else
         call part%add('time', scene%fit%time, unit_in(units_in(scene), 'time', '1'), 'time of the signal', &
            is_scale=.true.)
      end if
      call part%add('measured', scene%fit%value, unit, 'signal', along='time')
      call part%add('model', fit%model, unit, 'signal of the model', along='time')
      call part%add('residual', scene%fit%value - fit%model, unit, 'what the model leaves', along='time')
      part = group%subgroup('starts')
      call part%add('start', [(i, i=1, size(fit%sums))], '1', 'number of the start', is_scale=.true.)
      do k = 1, n
         if (k <= size(plan%axes)) call part%add('first_'//trim(fit%names(k)), [fit%started(k, :)], &
            trim(fit%units(k)), &
            'value at the start', along='start')
         call part%add(trim(fit%names(k)), [fit%ended(k, :)], trim(fit%units(k)), 'value at the end', along='start')
      end do
      call part%add('sum_of_squares', fit%sums, '1', &
         'sum of squared residuals over the square of the noise or, where ' &
         //'it is not given, of the standard deviation of the signal', along='start')
      call part%add('runs', nint_or_none(fit%runs), '1', 'runs that it took', along='start')
   end subroutine write_fit

   !> Nearest whole number, 0 for NaN.
   elemental integer function nint_or_none(number)
      real(wp), intent(in) :: number

      nint_or_none = 0
      if (.not. ieee_is_nan(number)) nint_or_none = nint(number)
   end function nint_or_none

   !> Print the table of the estimates, and remarks about the quality of the fit.
   subroutine print_fit(unit, scene, plan, fit)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      type(fit_t), intent(in) :: fit

      type(table_t) :: table
      type(units_t) :: units
      character(:), allocatable :: own, unit_of_time, words

      units = units_in(scene)
      own = unit_in(units, observed_table(scene%fit%observed)%quantity)
      call print_title(unit, scene%name, scene%title)
      unit_of_time = unit_in(units, 'time')
      if (observed_table(scene%fit%observed)%is_feature) unit_of_time = ''
      call print_line(unit, 'signal', trim(observed_table(scene%fit%observed)%name)//' of '//scene%fit%data//', '// &
         to_text(size(scene%fit%value))//' values from '//with_unit(scene%fit%time(1), unit_of_time) &
         //' to '//with_unit(scene%fit%time(size(scene%fit%time)), unit_of_time))
      words = to_text(size(fit%sums))//', of which '//to_text(fit%agreeing)//' ended here'
      if (any(ieee_is_nan(fit%sums))) words = words//', and '//to_text(count(ieee_is_nan(fit%sums)))//' failed'
      call print_line(unit, 'starts', words)
      write (unit, '()')
      call add_texts(table, 'parameter', fit%names)
      call add_numbers(table, 'estimate', fit%values, six_digits)
      call add_numbers(table, '95 % within', fit%certainty%half_width, two_digits)
      if (any(fit%units /= '1')) call add_texts(table, 'unit', fit%units)
      call add_numbers(table, 'from', fit%minimum, six_digits)
      call add_numbers(table, 'to', fit%maximum, six_digits)
      call print_table(unit, table)
      write (unit, '()')
      call print_line(unit, 'residual', with_unit(fit%certainty%noise, own)//' RMS')
      call print_line(unit, 'condition', rounded(fit%certainty%condition)//' of the Jacobian with columns of length 1')
      call print_undetermined(unit, plan, fit)
      if (fit%missing > 0) call print_line(unit, '', 'the run does not reach '//to_text(fit%missing)//' of these '// &
         to_text(size(fit%model))//' and has '//trim(merge('its end ', 'height 0', &
         scene%fit%observed == observed_impacts))//' in their place: a longer &response duration may help')
      if (fit%horizon < scene%fit%time(size(scene%fit%time))) call print_line(unit, '', &
         'small changes of the parameters ' &
         //'grow e-fold in '//with_unit(1.0_wp/fit%growth_rate, unit_in(units, 'time'))//': after '// &
         with_unit(fit%horizon, unit_in(units, 'time'))//' the noise has grown to the signal; fit it up to there (end)')
      if (fit%is_exact) then
         call print_line(unit, '', 'the model explains the signal to rounding errors')
      else if (ieee_is_nan(fit%whiteness)) then
         call print_line(unit, '', 'there are too few residuals to decide whether they are noise')
      else if (fit%whiteness < significance) then
         call print_line(unit, '', 'the residuals are no noise (probability '//rounded(fit%whiteness)//'): the model ' &
            //'does not explain the signal, and the intervals do not hold')
      else
         call print_line(unit, '', 'the residuals look like noise (probability '//rounded(fit%whiteness)//')')
      end if
   end subroutine print_fit

   !> Print the parameters that the signal does not determine.
   subroutine print_undetermined(unit, plan, fit)
      integer, intent(in) :: unit
      type(plan_t), intent(in) :: plan
      type(fit_t), intent(in) :: fit

      real(wp), parameter :: at_limit = 1.0e-6_wp
      character(:), allocatable :: together
      integer :: k

      together = ''
      do k = 1, size(fit%values)
         if (.not. fit%certainty%has_influence(k)) then
            call print_line(unit, '', 'the signal does not depend on '//trim(fit%names(k)))
         else if (.not. fit%certainty%is_determined(k) .and. .not. ieee_is_nan(fit%certainty%half_width(k))) then
            call print_line(unit, '', 'the signal hardly depends on '//trim(fit%names(k))// &
               ': its interval is wider than its range')
         else if (.not. fit%certainty%is_determined(k)) then
            together = together//', '//trim(fit%names(k))
         else if (k <= size(plan%axes) .and. min(fit%values(k) - fit%minimum(k), fit%maximum(k) - fit%values(k)) < &
            at_limit*(fit%maximum(k) - fit%minimum(k))) then
            call print_line(unit, '', trim(fit%names(k))//' is at its limit')
         end if
         if (fit%interval_share(k) < smallest_share) call print_line(unit, '', &
            'the interval of '//trim(fit%names(k))// &
            ' is too narrow: the signal is not linear in the parameters within it')
      end do
      if (together /= '') call print_line(unit, '', 'the signal cannot distinguish these: '//together(3:))
   end subroutine print_undetermined

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

end module fit_results
