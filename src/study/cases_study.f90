!> The cases of a scene, from the scene to their table and file: a group for each, with all that a file of one run
!> holds, and what the cases are compared by along the varied parameter.
module cases_study
   use, intrinsic :: iso_c_binding, only: c_size_t
   use case_runs, only: case_t, run_cases
   use console_tables, only: measured, print_model
   use failures, only: failure_t
   use file_system, only: make_folder
   use hdf5_writing, only: hdf5_group_t
   use kinds, only: wp
   use measure_list, only: measure_count, measure_named, measure_table
   use measure_rows, only: write_measures_of_cases
   use mesh_errors, only: mesh_errors_t, print_mesh_errors, write_mesh_errors
   use mesh_estimate, only: estimate_cases, sample_of
   use number_text, only: to_text
   use progress_line, only: start_progress, stop_progress
   use results_file, only: begin_results, finish_results, write_groups
   use run_measures, only: row_of
   use scene_types, only: scene_t
   use study_job, only: job_t
   use text_columns, only: fixed, print_columns
   implicit none (type, external)
   private
   public :: run_cases_of_scene, write_cases

   integer, parameter :: width = 40
   !> Measures that cases are compared by
   character(*), parameter :: shown(*) = [character(24) :: &
      'impacts', 'first_impact_tau', 'first_impact_velocity', 'quiet_tau', 'spent_tau']

contains

   !> Run the cases, write the file, print the table.
   subroutine run_cases_of_scene(scene, job, error)
      !> It has &cases
      type(scene_t), intent(in) :: scene
      type(job_t), intent(in) :: job
      !> Set when a run fails or the file cannot be written
      type(failure_t), allocatable, intent(out) :: error

      type(case_t), allocatable :: cases(:)
      type(mesh_errors_t), allocatable :: errors

      if (.not. job%quiet) call start_progress(job%label)
      call run_cases(scene, cases, error)
      if (scene%mesh%estimate .and. .not. allocated(error)) then
         allocate (errors)
         call estimate_cases(cases(sample_of(size(cases)))%scene, sample_of(size(cases)), errors)
      end if
      call stop_progress()
      if (allocated(error)) return
      call write_cases(job%folder, scene, cases, error, errors)
      if (allocated(error) .or. job%quiet) return
      call print_model(job%unit, cases(1)%scene, cases(1)%node_position)
      call print_cases(job%unit, scene, cases)
      if (allocated(errors)) call print_mesh_errors(job%unit, errors)
   end subroutine run_cases_of_scene

   !> Write the file, whole or not at all.
   subroutine write_cases(folder, scene, cases, error, errors)
      !> Folder of the results
      character(*), intent(in) :: folder
      type(scene_t), intent(in) :: scene
      type(case_t), intent(in) :: cases(:)
      !> Why the file could not be written
      type(failure_t), allocatable, intent(out) :: error
      !> What the mesh does to some of them
      type(mesh_errors_t), intent(in), optional :: errors

      integer(c_size_t), parameter :: expected_bytes = 4000000_c_size_t
      type(hdf5_group_t) :: root, group, case_group
      character(:), allocatable :: name
      real(wp) :: rows(measure_count, size(cases))
      integer :: i

      call make_folder(folder, error)
      if (allocated(error)) return
      name = trim(scene%cases%parameter%name)
      call begin_results(root, expected_bytes, scene)
      group = root%group('cases')
      call group%attribute('parameter', name)
      call group%attribute('meaning', trim(scene%cases%parameter%meaning))
      call group%add(name, cases%value, '1', trim(scene%cases%parameter%meaning), is_scale=.true.)
      do i = 1, size(cases)
         rows(:, i) = row_of(cases(i)%response%measures)
      end do
      call write_measures_of_cases(group, measure_table%run_name, spread('1', 1, measure_count), rows, name)
      do i = 1, size(cases)
         case_group = group%group('case_'//to_text(i))
         call case_group%attribute('value', cases(i)%value)
         call write_groups(case_group, cases(i)%scene, cases(i)%node_position, response=cases(i)%response)
      end do
      if (present(errors)) call write_mesh_errors(root%group('mesh_estimate'), errors)
      call finish_results(root, folder, scene, error)
   end subroutine write_cases

   !> One line a case: its value, measures, its highest rebound.
   subroutine print_cases(unit, scene, cases)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      type(case_t), intent(in) :: cases(:)

      character(width) :: headings(size(shown) + 2), cells(size(shown) + 2, size(cases))
      real(wp) :: row(measure_count)
      integer :: i, k

      write (unit, '(2x, a, /)') 'the first of '//to_text(size(cases))//' cases; in the others another '// &
         trim(scene%cases%parameter%name)
      headings(1) = scene%cases%parameter%name
      headings(size(headings)) = 'highest rebound'
      cells = '-'
      do k = 1, size(shown)
         headings(k + 1) = measure_table(measure_named(shown(k)))%label
      end do
      do i = 1, size(cases)
         row = row_of(cases(i)%response%measures)
         cells(1, i) = to_text(cases(i)%value)
         do k = 1, size(shown)
            cells(k + 1, i) = measured(measure_named(shown(k)), row)
         end do
         associate (peaks => cases(i)%response%measures%peak_eta)
            if (size(peaks) > 0) cells(size(headings), i) = fixed(maxval(peaks), 6)
         end associate
      end do
      call print_columns(unit, headings, cells)
   end subroutine print_cases

end module cases_study
