!> Results of &sensitivity, derivatives of measures with respect to parameters: the group of the results file, and the
!> tables on the console.
module sensitivity_results
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
   use difference_derivatives, only: derivative_exists, derivative_differs, derivative_states, derivative_t, &
      derivative_unknown
   use kinds, only: wp
   use measure_list, only: measure_table
   use quantities, only: name_in_results, units_t
   use quantity_groups, only: quantity_group_t
   use reader_units, only: with_unit, scene_unit_of, unit_in
   use scene_types, only: scene_t
   use scene_units, only: units_in
   use table_columns, only: add_numbers, add_texts, print_line, print_table, six_digits, table_t, two_digits
   implicit none (type, external)
   private
   public :: sensitivity_t, write_sensitivity, print_sensitivity

   !> Maximum length of the texts in the results file.
   integer, parameter :: max_text_length = 60

   !> A derivative for each pair of a measure and a parameter.
   type :: sensitivity_t
      !> Indices of the measures in `measure_table`
      integer, allocatable :: measures(:)
      !> Values of the measures with the parameters of the scene, in the units of the results
      real(wp), allocatable :: measured(:)
      !> Derivatives, [parameters, measures]
      type(derivative_t), allocatable :: derivative(:, :)
      !> Number of impacts at the smallest step above the value of a parameter minus the number below, [parameters]
      integer, allocatable :: impacts_change(:)
      !> Whether all steps to one side of the value of a parameter are beyond its range, [parameters]
      logical, allocatable :: is_at_limit(:)
   end type sensitivity_t

contains

   !> Write the group of the results file; each dataset is a column of a table with one row for each pair.
   subroutine write_sensitivity(group, scene, sensitivity)
      type(quantity_group_t), intent(in) :: group
      type(scene_t), intent(in) :: scene
      type(sensitivity_t), intent(in) :: sensitivity

      character(*), parameter :: along = 'pair', unit = "the measure's over the parameter's", dimensionless = '1'
      character(max_text_length), allocatable :: texts(:)
      type(derivative_t), allocatable :: derivative(:)
      integer, allocatable :: parameter(:), measure(:)
      integer :: i, parameters, pairs

      associate (settings => scene%sensitivity, measures => sensitivity%measures)
         parameters = size(settings%parameters)
         pairs = size(sensitivity%derivative)
         allocate (derivative(pairs), texts(pairs))
         derivative(:) = reshape(sensitivity%derivative, [pairs])
         allocate (parameter, source=[(modulo(i - 1, parameters) + 1, i=1, pairs)])
         allocate (measure, source=[((i - 1)/parameters + 1, i=1, pairs)])
         call group%add(along, [(i, i=1, pairs)], dimensionless, 'pair of a measure and a parameter', is_scale=.true.)
         texts(:) = [(named(group, measures(measure(i))), i=1, pairs)]
         call group%add('measure', texts, 'none', 'measure of the run', along)
         texts(:) = settings%parameters(parameter)%name
         call group%add('parameter', texts, 'none', 'parameter of the scene', along)
         texts(:) = [(unit_of_pair(units_in(scene), measures(measure(i)), &
            settings%parameters(parameter(i))%quantity), i=1, pairs)]
         call group%add('unit', texts, 'none', 'unit of the derivative', along)
         call group%add('parameter_value', settings%values(parameter), "the parameter's", 'value of the parameter', &
            along=along)
         call group%add('measure_value', sensitivity%measured(measure), "the measure's", 'value of the measure', &
            along=along)
         call group%add('derivative', derivative%value, unit, 'derivative of the measure with respect to the ' &
            //'parameter; nan: there is none', along=along)
         call group%add('error', derivative%error, unit, 'estimate of its error', along=along)
         call group%add('elasticity', elasticities(derivative, settings%values(parameter), &
            sensitivity%measured(measure)), dimensionless, 'percent of the measure for a percent of the ' &
            //'parameter', along=along)
         call group%add('from_above', derivative%above, unit, 'derivative for greater values of the parameter', &
            along=along)
         call group%add('from_above_error', derivative%above_error, unit, 'estimate of its error', along=along)
         call group%add('from_below', derivative%below, unit, 'derivative for smaller values of the parameter', &
            along=along)
         call group%add('from_below_error', derivative%below_error, unit, 'estimate of its error', along=along)
         texts(:) = derivative_states(derivative%state)
         call group%add('state', texts, 'none', 'exists: both sides agree; from above or below: the other side is ' &
            //'beyond a limit or has no value; none: the sides differ or do not converge; unknown: the measure is ' &
            //'not there', along)
         call group%add('impacts_change', sensitivity%impacts_change(parameter), dimensionless, &
            'impacts with the parameter at the smallest step above its value, less those below it', along=along)
      end associate
   end subroutine write_sensitivity

   !> Name of a measure in the results.
   pure function named(group, measure) result(name)
      type(quantity_group_t), intent(in) :: group
      !> Index in `measure_table`
      integer, intent(in) :: measure
      character(max_text_length) :: name

      name = group%named(measure_table(measure)%name)
   end function named

   !> Unit of a derivative.
   pure function unit_of_pair(units, measure, quantity) result(unit)
      type(units_t), intent(in) :: units
      !> Index in `measure_table`
      integer, intent(in) :: measure
      !> Quantity of the parameter; empty: dimensionless
      character(*), intent(in) :: quantity
      character(max_text_length) :: unit

      character(:), allocatable :: own

      unit = unit_in(units, measure_table(measure)%quantity, '1')
      own = scene_unit_of(units, quantity)
      if (scan(own, '/ ') > 0) own = '('//own//')'
      if (own /= '') unit = trim(unit)//'/'//own
   end function unit_of_pair

   !> Elasticity: relative change of a measure per relative change of a parameter.
   elemental real(wp) function elasticities(derivative, parameter, value) result(elasticity)
      type(derivative_t), intent(in) :: derivative
      real(wp), intent(in) :: parameter
      real(wp), intent(in) :: value

      elasticity = ieee_value(1.0_wp, ieee_quiet_nan)
      if (abs(value) > 0.0_wp) elasticity = derivative%value*parameter/value
   end function elasticities

   !> Print the tables, one for each measure.
   subroutine print_sensitivity(unit, scene, sensitivity)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      type(sensitivity_t), intent(in) :: sensitivity

      type(table_t) :: table
      character(max_text_length), allocatable :: texts(:)
      character(:), allocatable :: name
      type(units_t) :: units
      integer :: i, k

      units = units_in(scene)
      write (unit, '(a)') scene%name//': '//scene%title
      allocate (texts(size(scene%sensitivity%parameters)))
      associate (settings => scene%sensitivity, measures => sensitivity%measures)
         do k = 1, size(settings%parameters)
            call print_line(unit, trim(settings%parameters(k)%name), &
               with_unit(settings%values(k), scene_unit_of(units, settings%parameters(k)%quantity)))
         end do
         do i = 1, size(measures)
            name = name_in_results(measure_table(measures(i))%name)
            associate (derivative => sensitivity%derivative(:, i))
               if (all(derivative%state == derivative_unknown)) then
                  write (unit, '(/, 2x, a)') name//': no run has one'
                  cycle
               end if
               write (unit, '(/, 2x, a)') name//' = ' &
                  //with_unit(sensitivity%measured(i), unit_in(units, measure_table(measures(i))%quantity))
               if (allocated(table%columns)) deallocate (table%columns)
               call add_texts(table, 'parameter', settings%parameters%name)
               texts(:) = [(unit_of_pair(units, measures(i), settings%parameters(k)%quantity), k=1, size(derivative))]
               call add_numbers(table, 'derivative', derivative%value, six_digits)
               call add_numbers(table, 'its error', derivative%error, two_digits)
               if (any(texts /= '1')) call add_texts(table, 'unit', texts)
               call add_numbers(table, 'percent a percent', elasticities(derivative, settings%values, &
                  sensitivity%measured(i)), six_digits)
               call print_table(unit, table)
               call print_one_sided(unit, scene, sensitivity, i)
            end associate
         end do
      end associate
   end subroutine print_sensitivity

   !> Print remarks about derivatives that exist on one side only or differ between both sides.
   subroutine print_one_sided(unit, scene, sensitivity, which)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      type(sensitivity_t), intent(in) :: sensitivity
      !> Index among the measures
      integer, intent(in) :: which

      character(:), allocatable :: words
      integer :: k

      do k = 1, size(sensitivity%derivative, 1)
         associate (derivative => sensitivity%derivative(k, which), parameter => scene%sensitivity%parameters(k))
            select case (derivative%state)
            case (derivative_exists)
               cycle
            case (derivative_differs)
               words = 'no derivative: '//side_in_words(derivative%above, derivative%above_converges)// &
                  ' from above and '//side_in_words(derivative%below, derivative%below_converges)//' from below'
               if (sensitivity%impacts_change(k) /= 0) words = words//', where impacts come or go'
            case (derivative_unknown)
               words = 'no derivative: the measure is not there beside this value'
            case default
               words = 'derivative '//trim(derivative_states(derivative%state)) &
                  //' alone, as the parameter is at its limit'
               if (.not. sensitivity%is_at_limit(k)) words = 'derivative '//trim(derivative_states(derivative%state)) &
                  //' alone, as the measure has no value on the other side'
            end select
            call print_line(unit, trim(parameter%name), words)
         end associate
      end do
   end subroutine print_one_sided

   !> A one-sided derivative in words.
   function side_in_words(value, converges) result(words)
      !> NaN: the measure has no value on this side
      real(wp), intent(in) :: value
      !> Whether the error of the derivative is relatively small
      logical, intent(in) :: converges
      character(:), allocatable :: words

      if (converges) then
         words = with_unit(value, '')
      else if (ieee_is_nan(value)) then
         words = 'none'
      else
         words = 'none that converges'
      end if
   end function side_in_words

end module sensitivity_results
