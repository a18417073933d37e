!> The output of a sweep on the console: numbers of cases, run time, failures, best cases.
module sweep_tables
   use kinds, only: wp
   use measure_list, only: measure_table
   use measure_rows, only: extremes_in_words
   use number_text, only: to_text
   use quantities, only: name_in_results, units_t, units_in
   use reader_units, only: with_unit, scene_unit_of, unit_in
   use run_tables, only: print_mesh
   use scene_types, only: scene_t
   use scene_warnings, only: add_warning
   use scene_words, only: mesh_in_words, print_warnings
   use sweep_best, only: best_t, refined_t
   use sweep_file, only: survey_t
   use sweep_plan, only: is_at_end, plan_t
   use sweep_progress, only: rate_in_words
   use sweep_settings, only: goal_names
   use table_columns, only: add_numbers, add_texts, print_line, print_table, print_title, six_digits, table_t, whole
   use warning_list, only: warning_over_strength, warning_settling
   implicit none (type, external)
   private
   public :: print_sweep

contains

   !> Print the tables of a finished sweep.
   subroutine print_sweep(unit, scene, plan, survey, refined, computed, seconds, workers)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      !> Summary of the chunks
      type(survey_t), intent(in) :: survey
      !> The best case of the sweep (entry 1), then the improvements that the refinement found
      type(refined_t), intent(in) :: refined
      !> Number of cases that were computed in this run
      integer, intent(in) :: computed
      !> Time of the computation, seconds
      real(wp), intent(in) :: seconds
      !> Threads and processes in words
      character(*), intent(in) :: workers

      character(:), allocatable :: words
      ! the scene with warnings about its cases
      type(scene_t), allocatable :: scene_with_warnings
      type(units_t) :: units
      integer :: k

      units = units_in(scene)
      call print_title(unit, scene%name, scene%title)
      allocate (scene_with_warnings, source=scene)
      if (survey%unsettled_count > 0 .and. allocated(scene%warnings)) call add_warning(scene_with_warnings, &
         warning_settling, to_text(survey%unsettled_count)//' of '//to_text(plan%cases) &
         //' cases end less than half a ' &
         //'period of the first frequency after their settling time: the beam may leave the stop again; a longer run ' &
         //'shows it')
      if (survey%over_strength_count > 0 .and. allocated(scene%warnings)) call add_warning(scene_with_warnings, &
         warning_over_strength, to_text(survey%over_strength_count)//' of '//to_text(plan%cases) &
         //' cases have a maximum stress beyond the strength of '//with_unit(scene%stress%strength, &
         scene_unit_of(units, 'stress')))
      call print_warnings(unit, scene_with_warnings)
      ! if the program chose the mesh
      if (scene%mesh%found%finer_elements > 0) then
         call print_line(unit, 'mesh', mesh_in_words(scene))
         call print_mesh(unit, scene%mesh%found, units)
      end if
      do k = 1, size(plan%axes)
         associate (axis => plan%axes(k))
            words = with_unit(axis%minimum, scene_unit_of(units, axis%parameter%quantity))//' to ' &
               //with_unit(axis%maximum, scene_unit_of(units, axis%parameter%quantity))
            if (plan%is_grid) words = words//', '//to_text(size(axis%values))//' values'
            if (axis%leader > 0) words = words//', tied to '//trim(plan%axes(axis%leader)%parameter%name)
            if (axis%distribution /= '') then
               words = words//', '//trim(axis%distribution)
            else if (axis%is_logarithmic) then
               words = words//' evenly in the logarithm'
            end if
            call print_line(unit, trim(axis%parameter%name), words)
         end associate
      end do
      words = to_text(plan%cases)
      if (survey%failure_count > 0) words = words//', of which '//to_text(survey%failure_count)//' failed'
      call print_line(unit, 'cases', words)
      if (computed < plan%cases) call print_line(unit, '', to_text(plan%cases - computed) &
         //' of them were already computed')
      if (computed > 0) call print_line(unit, 'run time', to_text(real(nint(100.0_wp*min(seconds, 1.0e7_wp)), wp) &
         /100.0_wp)//' s, '//rate_in_words(computed, seconds, ' cases')//', '//workers)
      do k = 1, min(size(survey%failed_cases), 3)
         call print_line(unit, '', 'case '//to_text(survey%failed_cases(k))//' failed: '//trim(survey%reasons(k)), &
            width=0)
      end do
      words = extremes_in_words(survey%tolerance)
      if (words /= '') call print_line(unit, 'extremes', words)
      if (.not. scene%wants_best) return
      call print_best(unit, scene, plan, survey%best)
      if (survey%best%count == 0) return
      if (refined%count == 0) then
         call print_parameters_at_limits(unit, scene, plan, survey%best%values(:, 1))
      else
         call print_refined(unit, scene, plan, refined)
         call print_parameters_at_limits(unit, scene, plan, refined%values(:, refined%count))
      end if
   end subroutine print_sweep

   !> Name each parameter whose value in the best case is the minimum or maximum of its range, because better cases may
   !> lie beyond this limit.
   subroutine print_parameters_at_limits(unit, scene, plan, values)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      !> Values of the parameters in the best case, [axes]
      real(wp), intent(in) :: values(:)

      integer :: k

      do k = 1, size(plan%axes)
         if (.not. is_at_end(plan%axes(k), values(k))) cycle
         associate (parameter => plan%axes(k)%parameter)
            call print_line(unit, '', 'the best '//trim(parameter%name)//', '//with_unit(values(k), &
               scene_unit_of(units_in(scene), parameter%quantity)) &
               //', is at an end of its range: better cases may lie beyond', width=0)
         end associate
      end do
   end subroutine print_parameters_at_limits

   !> Print the best cases, one in each line.
   subroutine print_best(unit, scene, plan, best)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      type(best_t), intent(in) :: best

      type(table_t) :: table

      associate (measure => scene%best%measure)
         write (unit, '(/, 2x, a)') trim(goal_names(scene%best%goal))//' ' &
            //name_in_results(measure_table(measure)%name)
         if (best%count == 0) then
            write (unit, '(2x, a)') 'no case has a value of this measure'
            return
         end if
         call add_numbers(table, 'case', real(best%case(:best%count), wp), whole)
         call add_case_columns(table, scene, plan, best%values(:, :best%count), best%rows(measure, :best%count))
         call print_table(unit, table)
         if (best%without_value > 0) call print_line(unit, '', to_text(best%without_value)//' of the cases have no ' &
            //name_in_results(measure_table(measure)%name)//', and none of them is in this table', width=0)
      end associate
   end subroutine print_best

   !> Print the measure of the best case of the sweep, and the best case that the refinement found.
   subroutine print_refined(unit, scene, plan, refined)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      !> The best case of the sweep (entry 1), then the improvements that the refinement found
      type(refined_t), intent(in) :: refined

      type(table_t) :: table
      character(:), allocatable :: measured_in

      associate (measure => scene%best%measure, last => refined%count, units => units_in(scene))
         measured_in = unit_in(units, measure_table(measure)%quantity)
         write (unit, '(/, 2x, a)') 'refined with '//to_text(refined%all_evaluations)//' more cases: ' &
            //name_in_results(measure_table(measure)%name)//' from '//with_unit(refined%rows(measure, 1), measured_in) &
            //' to '//with_unit(refined%rows(measure, last), measured_in)
         call add_texts(table, '', ['best'])
         call add_case_columns(table, scene, plan, refined%values(:, last:last), refined%rows(measure, last:last))
         call print_table(unit, table)
      end associate
   end subroutine print_refined

   !> Add the columns of the parameters and of the measure by which cases are compared.
   subroutine add_case_columns(table, scene, plan, values, measured)
      type(table_t), intent(inout) :: table
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      !> Values of the parameters, [axes, lines]
      real(wp), intent(in) :: values(:, :)
      !> Values of the measure, [lines]
      real(wp), intent(in) :: measured(:)

      type(units_t) :: units
      integer :: k

      units = units_in(scene)
      do k = 1, size(plan%axes)
         associate (parameter => plan%axes(k)%parameter)
            call add_numbers(table, trim(parameter%name), values(k, :), six_digits, &
               scene_unit_of(units, parameter%quantity))
         end associate
      end do
      associate (measure => measure_table(scene%best%measure))
         call add_numbers(table, name_in_results(measure%name), measured, six_digits, unit_in(units, measure%quantity))
      end associate
   end subroutine add_case_columns

end module sweep_tables
