!> Results of a fit: the group /fit of the results file, and the table on the console.
module fit_results
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use fit_model, only: max_name_length
   use fit_statistics, only: certainty_t
   use inference_settings, only: observed_impacts, observed_table
   use kinds, only: wp
   use number_text, only: rounded, to_text
   use quantities, only: units_t
   use quantity_groups, only: quantity_group_t
   use reader_units, only: with_unit, unit_in
   use scene_types, only: scene_t
   use scene_units, only: units_in
   use sweep_plan, only: plan_t
   use table_columns, only: add_numbers, add_texts, print_line, print_table, six_digits, table_t, two_digits
   implicit none (type, external)
   private
   public :: fit_t, write_fit, print_fit, significance, smallest_share

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
      character(:), allocatable :: own, unit_of_time

      units = units_in(scene)
      own = unit_in(units, observed_table(scene%fit%observed)%quantity)
      write (unit, '(a)') scene%name//': '//scene%title
      unit_of_time = unit_in(units, 'time')
      if (observed_table(scene%fit%observed)%is_feature) unit_of_time = ''
      call print_line(unit, 'signal', trim(observed_table(scene%fit%observed)%name)//' of '//scene%fit%data//', '// &
         to_text(size(scene%fit%value))//' values from '//with_unit(scene%fit%time(1), unit_of_time) &
         //' to '//with_unit(scene%fit%time(size(scene%fit%time)), unit_of_time))
      call print_line(unit, 'starts', to_text(size(fit%sums))//', of which '//to_text(fit%agreeing)//' ended here'// &
         trim(merge(', and        ', '             ', any(ieee_is_nan(fit%sums))))//failures(fit))
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

   !> Number of starts that failed, in words; empty: none.
   pure function failures(fit) result(words)
      type(fit_t), intent(in) :: fit
      character(:), allocatable :: words

      words = ''
      if (any(ieee_is_nan(fit%sums))) words = ' '//to_text(count(ieee_is_nan(fit%sums)))//' failed'
   end function failures

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

end module fit_results
