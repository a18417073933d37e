!> The study of a scene with &sensitivity: derivatives of measures follow from runs with each parameter at steps above
!> and below its value, which are the cases of a sweep plan; their group of the results file, and their tables on the
!> console.
module sensitivity_study
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_c_binding, only: c_size_t
   use difference_derivatives, only: differentiate, derivative_exists, derivative_differs, derivative_states, &
      derivative_t, derivative_unknown
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use measure_list, only: measure_named, measure_status, measure_table
   use measure_selection, only: chosen_measures
   use quantities, only: quantity_named, units_t, units_in, name_in_results
   use quantity_groups, only: quantity_group_t
   use reader_units, only: with_unit, scene_unit_of, unit_in
   use results_file, only: begin_results, finish_results
   use scene_types, only: scene_t
   use study_job, only: job_t
   use sweep_chunks, only: chunk_rows_t, load_chunks, remove_chunk_folder
   use sweep_plan, only: plan_t
   use sweep_ranks, only: is_first_rank
   use sweep_settings, only: parameter_t
   use sweep_study, only: plan_run_t, run_plan
   use table_columns, only: add_numbers, add_texts, print_line, print_table, print_title, six_digits, &
      table_t, two_digits
   implicit none (type, external)
   private
   public :: run_sensitivity, plan_steps, find_sensitivity, sensitivity_t, print_sensitivity

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

   !> Run the cases, write the results file, print the tables.
   subroutine run_sensitivity(scene, job, error)
      !> Scene with &sensitivity
      type(scene_t), intent(in) :: scene
      type(job_t), intent(in) :: job
      !> Set if there are no results
      type(failure_t), allocatable, intent(out) :: error

      ! estimated size of the file
      integer(c_size_t), parameter :: expected_bytes = 100000_c_size_t
      type(plan_t) :: plan
      type(plan_run_t) :: run
      type(sensitivity_t) :: sensitivity
      type(quantity_group_t) :: root
      type(chunk_rows_t) :: cases

      call plan_steps(scene, plan)
      call run_plan(scene, plan, job, run, error)
      if (allocated(error) .or. .not. is_first_rank()) return
      call load_chunks(plan, cases, error)
      if (allocated(error)) return
      if (cases%rows(measure_status, 1) > 0.0_wp) then
         call remove_chunk_folder(plan%path)
         call fail(error, status_run_failed, trim(cases%reasons(1)))
         return
      end if
      call find_sensitivity(scene, cases%rows, sensitivity)
      call begin_results(root, expected_bytes, scene)
      call write_sensitivity(root%subgroup('sensitivity'), scene, sensitivity)
      call finish_results(root, job%folder, scene, error)
      if (allocated(error)) return
      call remove_chunk_folder(plan%path)
      if (.not. job%quiet) call print_sensitivity(job%unit, scene, sensitivity)
   end subroutine run_sensitivity

   !> Plan the cases: the scene itself, then for each parameter and step one case above and one below its value.
   subroutine plan_steps(scene, plan)
      !> Scene with &sensitivity
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(out) :: plan

      ! number of cases in a chunk, so small that all threads have work
      integer, parameter :: cases_together = 8
      real(wp) :: step(size(scene%sensitivity%parameters))
      integer :: case, i, k, side

      associate (settings => scene%sensitivity)
         plan%cases = 1 + 2*settings%steps*size(settings%parameters)
         plan%chunk_cases = cases_together
         plan%chunks = (plan%cases - 1)/cases_together + 1
         step = first_steps(scene)
         allocate (plan%axes(size(settings%parameters)))
         do k = 1, size(plan%axes)
            plan%axes(k)%parameter = settings%parameters(k)
            allocate (plan%axes(k)%values(plan%cases), source=settings%values(k))
         end do
         case = 1
         do k = 1, size(plan%axes)
            do i = 1, settings%steps
               do side = 1, 2
                  case = case + 1
                  associate (value => settings%values(k) + merge(1.0_wp, -1.0_wp, side == 1)*scale(step(k), 1 - i))
                     ! a case beyond a limit is run with the value of the scene and not used
                     if (is_allowed(settings%parameters(k), value)) plan%axes(k)%values(case) = value
                  end associate
               end do
            end do
            plan%axes(k)%minimum = minval(plan%axes(k)%values)
            plan%axes(k)%maximum = maxval(plan%axes(k)%values)
         end do
      end associate
   end subroutine plan_steps

   !> First step of each parameter: a fraction of its value or, if the value is 0, the same fraction of the scale of its
   !> quantity (1 for a dimensionless parameter).
   pure function first_steps(scene) result(step)
      !> Scene with &sensitivity
      type(scene_t), intent(in) :: scene
      real(wp) :: step(size(scene%sensitivity%parameters))

      type(units_t) :: units
      integer :: k

      units = units_in(scene)
      associate (settings => scene%sensitivity)
         do k = 1, size(step)
            step(k) = settings%step*abs(settings%values(k))
            if (step(k) > 0.0_wp) cycle
            step(k) = settings%step
            if (settings%parameters(k)%quantity /= '') then
               step(k) = settings%step*units%factor(quantity_named(settings%parameters(k)%quantity))
            end if
         end do
      end associate
   end function first_steps

   !> Find the derivatives from the measures of all cases.
   subroutine find_sensitivity(scene, rows, sensitivity)
      !> Scene with &sensitivity
      type(scene_t), intent(in) :: scene
      !> Measures, [measure_count, cases], in the order of the plan
      real(wp), intent(in) :: rows(:, :)
      type(sensitivity_t), intent(out) :: sensitivity

      integer, allocatable :: above(:), below(:)
      real(wp) :: nan, step(size(scene%sensitivity%parameters))
      logical, dimension(scene%sensitivity%steps) :: reaches_above, reaches_below
      integer :: first, i, k

      nan = ieee_value(1.0_wp, ieee_quiet_nan)
      step = first_steps(scene)
      sensitivity%measures = chosen_measures(scene, scene%sensitivity%measures)
      ! if the scene names no measures, all measures that have a value
      if (.not. allocated(scene%sensitivity%measures)) sensitivity%measures = pack(sensitivity%measures, &
         .not. ieee_is_nan(rows(sensitivity%measures, 1)))
      sensitivity%measured = rows(sensitivity%measures, 1)
      associate (settings => scene%sensitivity, measures => sensitivity%measures)
         allocate (sensitivity%derivative(size(step), size(measures)), sensitivity%impacts_change(size(step)), &
            sensitivity%is_at_limit(size(step)))
         do k = 1, size(step)
            ! the order of `plan_steps`: case 1 is the scene; then, for each parameter and step, a case above and one
            ! below
            first = 2 + 2*settings%steps*(k - 1)
            above = [(first + 2*(i - 1), i=1, settings%steps)]
            below = above + 1
            associate (parameter => settings%parameters(k), value => settings%values(k), &
               steps => [(scale(step(k), 1 - i), i=1, settings%steps)])
               reaches_above = is_allowed(parameter, value + steps)
               reaches_below = is_allowed(parameter, value - steps)
               do i = 1, size(measures)
                  sensitivity%derivative(k, i) = differentiate(step(k), rows(measures(i), 1), &
                     merge(rows(measures(i), above), nan, reaches_above), &
                     merge(rows(measures(i), below), nan, reaches_below))
               end do
               sensitivity%is_at_limit(k) = .not. (any(reaches_above) .and. any(reaches_below))
            end associate
            associate (impacts => rows(measure_named('impacts'), :), &
               nearest => [above(size(above)), below(size(below))])
               sensitivity%impacts_change(k) = nint(impacts(nearest(1)) - impacts(nearest(2)))
               ! a failed case has no number of impacts
               if (any(rows(measure_status, nearest) > 0.0_wp)) sensitivity%impacts_change(k) = 0
            end associate
         end do
      end associate

   end subroutine find_sensitivity

   !> Whether scenes may give a value of a parameter.
   elemental logical function is_allowed(parameter, value)
      type(parameter_t), intent(in) :: parameter
      real(wp), intent(in) :: value

      is_allowed = value >= parameter%allowed(1) .and. value <= parameter%allowed(2)
   end function is_allowed

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
      call print_title(unit, scene%name, scene%title)
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

end module sensitivity_study
