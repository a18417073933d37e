!> &sensitivity, &fit and &uncertainty: the names of the groups, their checks and defaults, and reading of the signal of
!> &fit.
module scene_inference
   use file_system, only: path_beside
   use inference_settings, only: fit_settings_t, observed_force, observed_impacts, observed_table
   use kinds, only: wp
   use measure_list, only: demand_of, measure_force, measure_mean_force, measure_of_word, measure_status, &
      measure_table, measure_words
   use name_hints, only: phrase_of
   use name_table, only: table_t
   use name_types, only: group_t, name_t, number_range, range_t
   use number_text, only: to_text
   use quantities, only: quantity_named, system_none, unit_of, units_of, units_t
   use run_settings, only: count_samples, method_exact, name_length
   use scene_input, only: scene_input_t
   use scene_sweep, only: entry_of_parameter, refuse_lost_values
   use scene_types, only: has_rigid_stops, scene_t
   use signal_file, only: read_signal, signal_t
   use signal_units, only: convert_unit
   use sweep_names, only: find_parameters, parameter_names, parameter_of
   use sweep_settings, only: design_latin_hypercube, is_swept, parameter_t, parameter_index
   implicit none (type, external)
   private
   public :: inference_names, list_inference, resolve_inference

   !> Names of the groups, in the order of the reference and of the echo.
   character(*), parameter :: inference_names(*) = [character(name_length) :: 'sensitivity', 'fit', 'uncertainty']
   !> The complaint about a method whose results do not change smoothly with parameters
   character(*), parameter :: not_smooth = "needs method = 'exact', whose motion changes smoothly with its parameters"

contains

   !> List the names of one group in the table, and bind them to the components of the scene.
   subroutine list_inference(group, table, scene)
      !> One of `inference_names`
      character(*), intent(in) :: group
      class(table_t), intent(inout) :: table
      type(scene_t), intent(inout) :: scene

      select case (group)
      case ('sensitivity')
         call table%open(group_t(group, stands_alone=.true.), scene%wants_sensitivity)
         if (.not. table%lists_names) return
         associate (sensitivity => scene%sensitivity)
            call list_chosen_parameters(table, 'parameters', 'parameters whose influence is requested, by their ' &
               //'names in &sweep', 'none: give one', sensitivity%parameters)
            call list_chosen_measures(table, sensitivity%measures)
            call table%bind(sensitivity%step, name_t('step', 'first of the steps of the differences, as a share of ' &
               //'the value; if the value is 0, the step itself', range_t(1.0e-6_wp, 0.5_wp)))
            call table%bind(sensitivity%steps, name_t('steps', 'number of steps, each half of the one before', &
               range_t(3, 30)))
         end associate
      case ('fit')
         call table%open(group_t(group, stands_alone=.true.), scene%wants_fit)
         if (table%lists_names) call list_fit(table, scene%fit)
      case ('uncertainty')
         call table%open(group_t(group, stands_alone=.true.), scene%wants_uncertainty)
         if (.not. table%lists_names) return
         associate (uncertainty => scene%uncertainty)
            call list_chosen_parameters(table, 'normal', 'parameters of &sweep distributed normally, or where they ' &
               //'have a _log_range lognormally, with 95 % of the values in the range', 'none: all evenly', &
               uncertainty%normal)
            call table%bind(uncertainty%fit, name_t('fit', 'results file of a &fit, beside the scene, whose ' &
               //'estimates and covariance count', range_t(1, 1000), default='none', is_optional=.true.))
            call list_chosen_measures(table, uncertainty%measures)
            if (.not. allocated(uncertainty%quantiles)) uncertainty%quantiles = [0.025_wp, 0.25_wp, 0.5_wp, 0.75_wp, &
               0.975_wp]
            call table%bind(uncertainty%quantiles, name_t('quantiles', 'probabilities of the quantiles', &
               range_t(1.0e-6_wp, 1.0_wp - 1.0e-6_wp), default='0.025, 0.25, 0.5, 0.75, 0.975'))
            call table%bind(uncertainty%classes, name_t('classes', 'classes of a histogram', range_t(2, 10000)))
         end associate
      end select
   end subroutine list_inference

   !> List the names of &fit in the table, and bind them to the components of the scene.
   subroutine list_fit(table, fit)
      class(table_t), intent(inout) :: table
      type(fit_settings_t), intent(inout) :: fit

      type(range_t), parameter :: columns = range_t(1.0_wp, 1000.0_wp)

      call table%bind(fit%data, name_t('data', 'text file of the measured signal, beside the scene: columns of ' &
         //'numbers, their units in a header', range_t(1, 1000), default='none: give one', is_optional=.true.))
      call table%bind(fit%observed, name_t('of', 'what was measured', default='none: give one', is_optional=.true.), &
         observed_table%name)
      call table%bind(fit%time_column, name_t('time_column', &
         'column of the file with the time, or with the number of an impact or rebound', columns))
      call table%bind(fit%value_column, name_t('value_column', 'column with the values', columns))
      call table%bind(fit%noise_column, name_t('noise_column', &
         'column with the standard deviation of the noise of each value, in their unit; 0: none', &
         range_t(0.0_wp, 1000.0_wp)))
      call table%bind(fit%start, name_t('start', 'instant from which on the signal counts, in time as results ' &
         //'have it', range_t(0.0_wp, 1.0e9_wp)))
      call table%bind(fit%end, name_t('end', 'instant up to which it counts', &
         range_t(0.0_wp, 1.0e9_wp, excludes_minimum=.true.), default='that of the run', is_optional=.true.))
      call table%bind(fit%noise, name_t('noise', 'standard deviation of the noise, in units of results; 0: that ' &
         //'of the residuals', range_t(0.0_wp, 1.0e20_wp)))
      call table%bind(fit%has_offset, name_t('offset', 'find the zero of the signal too'))
      call table%bind(fit%has_scale, name_t('scale', 'find the scale of the signal too'))
      call table%bind(fit%max_time_shift, name_t('time_shift', 'find the delay of the signal too, at most this ' &
         //'time late or early, in the unit of time of the results; 0: do not', range_t(0.0_wp, 1.0e9_wp)))
      call table%bind(fit%evaluations, name_t('evaluations', 'maximum number of runs from one start', &
         range_t(10, 10000000)))
   end subroutine list_fit

   !> List a name whose values are parameters that a sweep may vary.
   subroutine list_chosen_parameters(table, name, meaning, default, parameters)
      class(table_t), intent(inout) :: table
      !> Name, meaning and default as in `name_t`
      character(*), intent(in) :: name
      character(*), intent(in) :: meaning
      character(*), intent(in) :: default
      !> Unallocated: none is given
      type(parameter_t), allocatable, intent(inout) :: parameters(:)

      integer, allocatable :: chosen(:), places(:)
      character(name_length), allocatable :: names(:)
      integer :: k

      call find_parameters(table, places)
      allocate (names, source=parameter_names(table, places))
      if (allocated(parameters)) chosen = [(findloc(names, parameters(k)%name, dim=1), k=1, size(parameters))]
      call table%bind(chosen, name_t(name, meaning, default=default), names)
      if (allocated(chosen)) parameters = [(parameter_of(table, places(chosen(k))), k=1, size(chosen))]
   end subroutine list_chosen_parameters

   !> List the name `measures`, whose values are measures of a run.
   subroutine list_chosen_measures(table, measures)
      class(table_t), intent(inout) :: table
      !> Indices in `measure_table`; unallocated: the scene gives none
      integer, allocatable, intent(inout) :: measures(:)

      integer, allocatable :: chosen(:)

      if (allocated(measures)) allocate (chosen, source=measures - measure_status)
      call table%bind(chosen, name_t('measures', 'measures of a run that are asked about', &
         default='all that are no counts'), measure_words)
      if (allocated(chosen)) measures = measure_of_word(chosen)
   end subroutine list_chosen_measures

   !> Check the groups and set their defaults; problems are added to the input.
   subroutine resolve_inference(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      !> Table of the names with their values
      type(table_t), intent(in) :: table
      !> Scene, of which all other groups are resolved
      type(scene_t), intent(inout) :: scene

      if (has_rigid_stops(scene)) then
         call replace_force(scene%sensitivity%measures)
         call replace_force(scene%uncertainty%measures)
      end if
      if (scene%wants_sensitivity) call resolve_sensitivity(input, table, scene)
      if (scene%wants_fit) call resolve_fit(input, scene)
      if (scene%wants_uncertainty) call resolve_uncertainty(input, scene)
   end subroutine resolve_inference

   !> Replace the maximum contact force, which a rigid stop does not have, by the maximum over episodes (all contact
   !> between two rebounds above the settling level) of the mean force in the first `force_window`.
   pure subroutine replace_force(measures)
      !> Indices in `measure_table`; unallocated: none
      integer, allocatable, intent(inout) :: measures(:)

      if (.not. allocated(measures)) return
      where (measures == measure_force) measures = measure_mean_force
   end subroutine replace_force

   !> Check &sensitivity: each parameter has a value that can be changed continuously, and runs of the scene have the
   !> measures.
   subroutine resolve_sensitivity(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      !> Table of the names with their values
      type(table_t), intent(in) :: table
      type(scene_t), intent(inout) :: scene

      character(*), parameter :: group = 'sensitivity'
      integer :: i, k

      associate (sensitivity => scene%sensitivity)
         if (.not. allocated(sensitivity%parameters)) then
            call input%complain(group, '', "needs parameters, such as parameters = 'restitution', 'zeta'")
            return
         else if (scene%response%method /= method_exact .and. scene%has_contacts()) then
            ! Newmark's steps find contacts at dyadic fractions of a step, so the differences of measures are those of a
            ! motion whose events stay at their instants
            call input%complain(group, '', not_smooth)
            return
         end if
         associate (parameters => sensitivity%parameters)
            if (allocated(sensitivity%values)) deallocate (sensitivity%values)
            allocate (sensitivity%values(size(parameters)))
            do k = 1, size(parameters)
               call check_parameter(input, table, parameters(k), scene)
               if (input%has_problem()) return
               i = entry_of_parameter(table, parameters(k))
               sensitivity%values(k) = value_of(scene, parameters(k), table, i)
            end do
         end associate
         call check_measures(input, group, sensitivity%measures, scene)
      end associate
   end subroutine resolve_sensitivity

   !> Check that a parameter applies in the scene and has a single value in the scene, which is not restricted to whole
   !> numbers. Problems are added to the input.
   subroutine check_parameter(input, table, parameter, scene)
      type(scene_input_t), intent(inout) :: input
      !> Table of the names with their values
      type(table_t), intent(in) :: table
      type(parameter_t), intent(in) :: parameter
      type(scene_t), intent(in) :: scene

      character(*), parameter :: group = 'sensitivity'
      character(:), allocatable :: name
      integer :: place

      name = trim(parameter%name)
      place = entry_of_parameter(table, parameter)
      associate (entry => table%entries(place), own => table%groups(table%entries(place)%group))
         if (parameter%is_whole) then
            call input%complain(group, 'parameters', name &
               //' is a whole number: there is no derivative with respect to it')
         else if ((own%repeats .or. own%name == 'stress') .and. .not. own%is_wanted) then
            call input%complain(group, 'parameters', name//' goes with &'//trim(own%name))
         else if (.not. table%applies(place)) then
            call input%complain(group, 'parameters', name//' goes with '//phrase_of(table, place, &
               from_elsewhere=.true.))
         else if (entry%is_list) then
            if (.not. allocated(entry%list)) then
               call input%complain(group, 'parameters', name//' has no value: give it one in &'//trim(own%name))
            else if (size(entry%list) /= 1) then
               call input%complain(group, 'parameters', name//' has several values')
            end if
         else if ((entry%name%is_optional .or. parameter%quantity /= '') .and. .not. entry%is_given) then
            call input%complain(group, 'parameters', name//' has no value: give it one in &'//trim(own%name))
         else if (name == 'taper' .and. scene%beam%has_section) then
            call input%complain('section', '', 'says all of the section: a taper of &beam is not varied beside it')
         end if
      end associate
      if (parameter%quantity == '' .and. .not. input%has_problem()) then
         call refuse_lost_values(input, table, place, "&sensitivity parameters = '"//name//"'")
      end if
   end subroutine check_parameter

   !> Value of a parameter in the scene.
   pure real(wp) function value_of(scene, parameter, table, place) result(value)
      type(scene_t), intent(in) :: scene
      type(parameter_t), intent(in) :: parameter
      !> Table of the names with their values, with the ratios of quantities that the scene gives in units
      type(table_t), intent(in) :: table
      !> Index of the entry of the parameter
      integer, intent(in) :: place

      value = table%entries(place)%value
      if (table%entries(place)%is_list) value = table%entries(place)%list(1)
      ! the scene may give heights instead of the taper
      if (parameter%name == 'taper') value = (scene%beam%height_root - scene%beam%height_tip)/scene%beam%length
   end function value_of

   !> Check &fit and read its signal; problems are added to the input.
   subroutine resolve_fit(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(inout) :: scene

      character(*), parameter :: group = 'fit'
      integer :: k

      associate (fit => scene%fit, sweep => scene%sweep)
         if (.not. allocated(fit%data)) then
            call input%complain(group, '', "needs data, the file of a signal, such as data = 'signal.csv'")
         else if (fit%observed == 0) then
            call input%complain(group, '', "needs of, what was measured, such as of = 'displacement_tip'")
         else if (.not. (observed_table(fit%observed)%is_of_tip .or. scene%has_stop .or. (scene%has_bodies .and. &
            (observed_table(fit%observed)%is_feature .or. fit%observed == observed_force)))) then
            call input%complain(group, 'of', 'needs &stop')
         else if (fit%time_column == fit%value_column) then
            call input%complain(group, 'time_column value_column', 'must differ')
         else if (any(fit%noise_column == [fit%time_column, fit%value_column])) then
            call input%complain(group, 'noise_column', 'must differ from time_column and value_column')
         else if (fit%noise > 0.0_wp .and. fit%noise_column > 0) then
            call input%complain(group, 'noise', 'does not go with noise_column; give one of them')
         else if (observed_table(fit%observed)%is_feature .and. fit%max_time_shift > 0.0_wp) then
            call input%complain(group, 'time_shift', 'does not go with numbered ' &
               //trim(observed_table(fit%observed)%name))
         else if (fit%start >= fit%end) then
            call input%complain(group, 'start end', 'no part of the signal is between start and end')
         else if (scene%response%method /= method_exact) then
            call input%complain(group, '', not_smooth)
         else if (sweep%design /= design_latin_hypercube) then
            call input%complain('sweep', 'design', "must be 'latin_hypercube' for &fit: its cases are the starts")
         end if
         do k = 1, size(sweep%swept)
            if (.not. is_swept(sweep%swept(k)) .or. input%has_problem()) cycle
            associate (parameter => sweep%swept(k)%parameter)
               if (parameter%name_in_group(:8) == 'duration' .and. parameter%group == 'response') call input%complain( &
                  'sweep', trim(parameter%name)//'_range '//trim(parameter%name)//'_log_range', &
                  'is no parameter that &fit could find')
            end associate
         end do
         if (.not. input%has_problem()) call read_signal_of_fit(input, scene, count(is_swept(sweep%swept)))
      end associate
   end subroutine resolve_fit

   !> Read the signal, convert it to the units of the results and select the part that is fitted. Problems
   !> are added to the input.
   subroutine read_signal_of_fit(input, scene, parameters)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(inout) :: scene
      !> Number of parameters in the sweep
      integer, intent(in) :: parameters

      character(*), parameter :: group = 'fit'
      ! minimum of differences and noise: squares of their quotients neither overflow nor vanish
      real(wp), parameter :: min_size = 1.0e-50_wp
      ! maximum number of a feature, that of the events of a run
      real(wp), parameter :: max_number = 1.0e9_wp
      type(signal_t) :: signal
      character(:), allocatable :: file, problem
      integer, allocatable :: inside(:)
      real(wp) :: end
      integer :: i, minimum_count

      file = path_beside(scene%file, scene%fit%data)
      call read_signal(file, pack([scene%fit%time_column, scene%fit%value_column, scene%fit%noise_column], &
         [.true., .true., scene%fit%noise_column > 0]), number_range, .false., signal, problem)
      if (.not. allocated(problem)) call convert_to_results(scene, signal, file, end, problem)
      if (allocated(problem)) then
         call input%complain(group, 'data', problem)
         return
      end if
      associate (fit => scene%fit)
         inside = pack([(i, i=1, size(signal%time))], signal%time >= fit%start .and. signal%time <= fit%end &
            .and. merge(signal%value, signal%time, fit%observed == observed_impacts) <= end)
         end = min(fit%end, end)
         minimum_count = max(10, parameters + 4)
         if (observed_table(fit%observed)%is_feature) then
            minimum_count = parameters + count([fit%has_offset, fit%has_scale]) + 1
            end = min(fit%end, maxval(signal%time))
         end if
         if (size(inside) < minimum_count) then
            call input%complain(group, 'data', file//' has '//to_text(size(inside))//' values from '// &
               to_text(fit%start)//' to '//to_text(end)//trim(merge(' within the run            ', &
               ', the end of what is fitted', fit%observed == observed_impacts))//': must be at least ' &
               //to_text(minimum_count))
            return
         else if (observed_table(fit%observed)%is_feature .and. &
            any(abs(signal%time - anint(signal%time)) > 0.0_wp .or. signal%time < 1.0_wp &
            .or. signal%time > max_number)) then
            call input%complain(group, 'data', file//': the time_column of '//trim(observed_table(fit%observed)%name) &
               //' must have their numbers 1, 2, ..., at most '//to_text(max_number))
            return
         end if
         if (allocated(fit%time)) deallocate (fit%time, fit%value, fit%noise_of_value)
         allocate (fit%time(size(inside)), fit%value(size(inside)), fit%noise_of_value(size(inside)))
         fit%time(:) = signal%time(inside)
         fit%value(:) = signal%value(inside)
         fit%noise_of_value(:) = fit%noise
         if (allocated(signal%noise)) fit%noise_of_value(:) = signal%noise(inside)
         associate (difference => maxval(fit%value) - minval(fit%value))
            if (difference <= 0.0_wp) then
               call input%complain(group, 'data', file//': all values are the same')
            else if (min(difference, minval(fit%noise_of_value, mask=fit%noise_of_value > 0.0_wp)) < min_size) then
               call input%complain(group, 'data', file//': differences of values, and the noise, must be at least ' &
                  //to_text(min_size))
            end if
         end associate
      end associate
   end subroutine read_signal_of_fit

   !> Convert a signal to the units of the results.
   subroutine convert_to_results(scene, signal, file, end, problem)
      type(scene_t), intent(in) :: scene
      type(signal_t), intent(inout) :: signal
      character(*), intent(in) :: file
      !> End of the run in the unit of time of the results; `huge` for rebounds, whose signal contains no times
      real(wp), intent(out) :: end
      !> Error message about the units; unallocated: no error
      character(:), allocatable, intent(out) :: problem

      character(*), parameter :: unless_none = 'the scene has none; give &scene units'
      type(units_t) :: units
      character(:), allocatable :: time_unit, value_unit

      ! the last sample of the run
      end = real(count_samples(scene%response%duration, scene%response%step), wp)*scene%response%step
      if (observed_table(scene%fit%observed)%is_feature) then
         if (scene%fit%observed == observed_impacts) end = scene%response%duration
         if (scene%fit%observed /= observed_impacts) end = huge(1.0_wp)
         signal%time_unit = ''
      end if
      time_unit = ''
      value_unit = ''
      if (scene%unit_system > 0 .and. scene%unit_system /= system_none) then
         units = units_of(scene%scales, scene%unit_system, .true.)
         time_unit = unit_of(quantity_named('time'), units)
         value_unit = unit_of(quantity_named(observed_table(scene%fit%observed)%quantity), units)
         if (end < huge(1.0_wp)) end = end*units%factor(quantity_named('time'))
      end if
      call convert_unit(signal%time_unit, time_unit, unless_none, signal%time, problem)
      call convert_unit(signal%value_unit, value_unit, unless_none, signal%value, problem)
      if (allocated(signal%noise)) call convert_unit(signal%value_unit, value_unit, unless_none, signal%noise, problem)
      if (allocated(problem)) problem = file//': '//problem
   end subroutine convert_to_results

   !> Check &uncertainty; problems are added to the input.
   subroutine resolve_uncertainty(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene

      character(*), parameter :: group = 'uncertainty'
      integer :: k, place

      if (scene%sweep%design /= design_latin_hypercube) then
         call input%complain('sweep', 'design', "must be 'latin_hypercube' for &uncertainty: its cases are a sample")
         return
      end if
      if (allocated(scene%uncertainty%normal)) then
         do k = 1, size(scene%uncertainty%normal)
            associate (name => scene%uncertainty%normal(k)%name)
               place = parameter_index(trim(name), scene%sweep%swept)
               if (.not. is_swept(scene%sweep%swept(place))) call input%complain(group, 'normal', &
                  trim(name)//' has no range in &sweep')
            end associate
         end do
      end if
      call check_measures(input, group, scene%uncertainty%measures, scene)
   end subroutine resolve_uncertainty

   !> Check that runs of the scene have the measures and that none is a count; problems are added to the input.
   subroutine check_measures(input, group, measures, scene)
      type(scene_input_t), intent(inout) :: input
      !> Group that names the measures
      character(*), intent(in) :: group
      !> Indices in `measure_table`; unallocated: the scene gives none
      integer, allocatable, intent(in) :: measures(:)
      type(scene_t), intent(in) :: scene

      integer :: k

      if (.not. allocated(measures)) return
      do k = 1, size(measures)
         associate (measure => measure_table(measures(k)))
            if (measure%is_whole) then
               call input%complain(group, 'measures', trim(measure%name)//' is a count')
            else if (.not. scene%has_group(measure%group)) then
               call input%complain(group, 'measures', trim(measure%name)//' '//demand_of(measure%group))
            end if
         end associate
         if (input%has_problem()) return
      end do
   end subroutine check_measures

end module scene_inference
