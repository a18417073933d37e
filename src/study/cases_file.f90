!> The results file of several cases: one group a case, with all that a file of one run holds, and what the cases
!> are compared by along the varied parameter.
module cases_file
   use, intrinsic :: iso_c_binding, only: c_size_t
   use case_runs, only: case_t
   use failures, only: failure_t
   use file_system, only: make_folder
   use hdf5_writing, only: hdf5_group_t
   use kinds, only: wp
   use measure_list, only: measure_count, measure_table
   use measure_rows, only: write_measures_of_cases
   use number_text, only: to_text
   use results_file, only: begin_results, finish_results, write_groups
   use run_measures, only: row_of
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: write_cases

contains

   !> Write the file, whole or not at all.
   subroutine write_cases(folder, scene, cases, error)
      !> Folder of the results
      character(*), intent(in) :: folder
      type(scene_t), intent(in) :: scene
      type(case_t), intent(in) :: cases(:)
      !> Why the file could not be written
      type(failure_t), allocatable, intent(out) :: error

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
      call finish_results(root, folder, scene, error)
   end subroutine write_cases

end module cases_file
