!> The study of &cases: runs of all cases, their table, and their results file. The file has a group for each case, with
!> the contents of the file of one run, and the measures as functions of the varied parameter.
module cases_study
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_c_binding, only: c_size_t
   use analyses, only: write_analyses
   use case_runs, only: case_t, run_cases
   use failures, only: failure_t
   use kinds, only: wp
   use measure_list, only: measure_count, measure_named, measure_table, measure_tolerance, measured_groups
   use measure_rows, only: extremes_in_words, row_in_units, write_measure_lists
   use mesh_errors, only: mesh_errors_t, print_mesh_errors, write_mesh_errors
   use mesh_estimates, only: estimate_cases, sample_cases
   use number_text, only: to_text
   use progress_line, only: start_progress, stop_progress
   use quantities, only: units_t, units_in
   use quantity_groups, only: quantity_group_t
   use reader_units, only: scene_unit_of
   use results_file, only: begin_results, finish_results, write_groups
   use run_measures, only: row_of
   use run_tables, only: add_measures, measure_column_t, print_mesh
   use run_warnings, only: warn_of_run
   use scene_beam_model, only: varies_at_end
   use scene_types, only: scene_t
   use scene_words, only: print_model
   use study_job, only: job_t
   use sweep_settings, only: varies_scales
   use table_columns, only: add_numbers, all_digits, print_line, print_table, table_t
   implicit none (type, external)
   private
   public :: run_cases_of_scene, write_cases

   !> Measures in the table that compares the cases; the last two only if the motion settles
   type(measure_column_t), parameter :: compared_measures(*) = [ &
      measure_column_t('impacts'), &
      measure_column_t('first_impact_time'), &
      measure_column_t('first_impact_velocity'), &
      measure_column_t('settling_time'), &
      measure_column_t('spent_time')]
   !> Measures in this table if the scene has their groups and any case has a value
   type(measure_column_t), parameter :: requested_measures(*) = [ &
      measure_column_t('greatest_force'), &
      measure_column_t('greatest_stress'), &
      measure_column_t('equivalent_range'), &
      measure_column_t('bounces'), &
      measure_column_t('bounce_time'), &
      measure_column_t('strongest_frequency')]

contains

   !> Run the cases, write the results file, print the table.
   subroutine run_cases_of_scene(scene, job, error)
      !> A scene with &cases
      type(scene_t), intent(in) :: scene
      type(job_t), intent(in) :: job
      !> Set if all runs fail or the file cannot be written
      type(failure_t), allocatable, intent(out) :: error

      type(case_t), allocatable :: cases(:)
      type(mesh_errors_t), allocatable :: errors
      ! numbers of the cases that have run
      integer, allocatable :: done(:)
      integer :: i, k, first

      if (.not. job%quiet) call start_progress(job%label)
      call run_cases(scene, cases, error)
      allocate (done, source=pack([(i, i=1, size(cases))], cases%has_run))
      if (scene%mesh%estimate .and. .not. allocated(error)) then
         allocate (errors)
         associate (sample => done(sample_cases(size(done))))
            call estimate_cases(cases(sample)%scene, sample, errors)
         end associate
      end if
      call stop_progress()
      if (allocated(error)) return
      call write_cases(job%folder, scene, cases, error, errors)
      if (allocated(error) .or. job%quiet) return
      call print_model(job%unit, cases(done(1))%scene, cases(done(1))%node_position)
      call print_mesh(job%unit, scene%mesh%found, units_in(scene))
      call print_cases(job%unit, scene, cases)
      do i = 1, size(cases)
         if (.not. cases(i)%has_run) call print_line(job%unit, '', 'failed: '//cases(i)%reason, width=0)
         if (.not. allocated(cases(i)%scene%warnings)) cycle
         first = size(cases(i)%scene%warnings) + 1
         call warn_of_run(cases(i)%scene, cases(i)%response)
         do k = first, size(cases(i)%scene%warnings)
            call print_line(job%unit, 'warning', trim(scene%cases%parameter%name)//' = '//to_text(scene%cases%list(i)) &
               //': '//trim(cases(i)%scene%warnings(k)%text))
         end do
      end do
      if (allocated(errors)) call print_mesh_errors(job%unit, errors, units_in(scene))
   end subroutine run_cases_of_scene

   !> Write the results file; if writing fails, there is no file.
   subroutine write_cases(folder, scene, cases, error, errors)
      !> Folder of the results
      character(*), intent(in) :: folder
      type(scene_t), intent(in) :: scene
      type(case_t), intent(in) :: cases(:)
      !> Set if the file cannot be written
      type(failure_t), allocatable, intent(out) :: error
      !> Estimated errors of the mesh for some of the cases
      type(mesh_errors_t), intent(in), optional :: errors

      ! size of the file that is built in memory, bytes; a larger file grows
      integer(c_size_t), parameter :: expected_bytes = 4000000_c_size_t
      type(quantity_group_t) :: root, group, case_group
      character(:), allocatable :: name
      integer :: i

      name = trim(scene%cases%parameter%name)
      call begin_results(root, expected_bytes, scene)
      group = root%subgroup('cases')
      group = group%unscaled(varies_scales(scene%cases%parameter))
      call group%attribute('parameter', name)
      call group%attribute('meaning', trim(scene%cases%parameter%meaning))
      call group%add(name, scene%cases%list, group%scene_unit(scene%cases%parameter%quantity), &
         trim(scene%cases%parameter%meaning), is_scale=.true.)
      call write_measure_lists(group, measure_table%run_name, rows_of(cases), name)
      do i = 1, size(cases)
         case_group = group%subgroup('case_'//to_text(i))
         if (.not. cases(i)%has_run) then
            call case_group%attribute('value', scene%cases%list(i))
            call case_group%attribute('failure_reason', cases(i)%reason)
            cycle
         end if
         case_group%units = units_in(cases(i)%scene)
         case_group%scales_values = .true.
         call case_group%attribute('value', scene%cases%list(i))
         call write_groups(case_group, cases(i)%node_position, response=cases(i)%response)
         call write_analyses(case_group, cases(i)%analysed)
      end do
      if (present(errors)) call write_mesh_errors(root%subgroup('mesh_estimate'), errors)
      call finish_results(root, folder, scene, error)
   end subroutine write_cases

   !> Measures of each case in the units of its scene; those of a case that failed are NaN.
   function rows_of(cases) result(rows)
      type(case_t), intent(in) :: cases(:)
      real(wp) :: rows(measure_count, size(cases))

      integer :: i

      rows = ieee_value(1.0_wp, ieee_quiet_nan)
      do i = 1, size(cases)
         if (cases(i)%has_run) rows(:, i) = row_in_units(units_in(cases(i)%scene), row_of(cases(i)%response%measures))
      end do
   end function rows_of

   !> Print one line for each case: value of the parameter, measures, highest rebound.
   subroutine print_cases(unit, scene, cases)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      type(case_t), intent(in) :: cases(:)

      type(table_t) :: table
      real(wp) :: rows(measure_count, size(cases)), highest(measure_count, size(cases))
      type(units_t) :: units
      character(:), allocatable :: group, heading, place, words
      integer :: i

      ! in the rows of `highest`, all measures equal the highest rebound; only the column `peak_1`, a displacement, is
      ! printed
      units = units_in(scene)
      highest = ieee_value(1.0_wp, ieee_quiet_nan)
      rows = rows_of(cases)
      do i = 1, size(cases)
         if (.not. cases(i)%has_run) cycle
         associate (case_units => units_in(cases(i)%scene), measures => cases(i)%response%measures)
            if (size(measures%peak_eta) > 0) highest(:, i) = maxval(measures%peak_eta)
            highest(:, i) = row_in_units(case_units, highest(:, i))
         end associate
      end do
      associate (parameter => scene%cases%parameter)
         words = 'one of '
         if (cases(1)%has_run) words = 'the first of '
         write (unit, '(2x, a, /)') words//to_text(size(cases))//' cases; in the others another '//trim(parameter%name)
         heading = trim(parameter%name)
         if (parameter%quantity /= '') heading = heading//', '//scene_unit_of(units, parameter%quantity)
         call add_numbers(table, heading, scene%cases%list, all_digits)
      end associate
      call add_measures(table, compared_measures(:merge(3, 5, varies_at_end(scene))), rows, units)
      call add_measures(table, [measure_column_t('peak_1', 'highest rebound')], highest, units)
      do i = 1, size(requested_measures)
         associate (measure => measure_named(requested_measures(i)%measure))
            if (all(ieee_is_nan(rows(measure, :))) .or. .not. scene%has_group(measure_table(measure)%group)) cycle
            call add_measures(table, requested_measures(i:i), rows, units)
         end associate
      end do
      if (scene%wants_statistics .and. .not. any(scene%has_group(measured_groups))) then
         call add_measures(table, [measure_column_t('contact_share', 'share in contact'), &
            measure_column_t('rms_force', 'RMS force'), measure_column_t('work_rate', 'work rate')], rows, units)
      else if (scene%wants_statistics) then
         do i = 1, size(measured_groups)
            if (.not. scene%has_group(measured_groups(i))) cycle
            group = trim(measured_groups(i))
            place = group(:index(group, '_') - 1)//' '//group(index(group, '_') + 1:)
            call add_measures(table, [measure_column_t('contact_share_'//group, 'share at '//place), &
               measure_column_t('rms_force_'//group, 'RMS force at '//place), &
               measure_column_t('work_rate_'//group, 'work rate at '//place)], rows, units)
         end do
      end if
      call print_table(unit, table)
      words = extremes_in_words(rows(measure_tolerance, :))
      if (words /= '') call print_line(unit, 'extremes', words)
   end subroutine print_cases

end module cases_study
