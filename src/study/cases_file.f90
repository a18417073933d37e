!> The results file of several cases: one group a case, with all that a file of one run holds, and what the cases
!> are compared by along the varied parameter.
module cases_file
   use, intrinsic :: iso_c_binding, only: c_size_t
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use case_runs, only: case_t
   use cases_settings, only: case_parameters
   use failures, only: failure_t
   use file_system, only: make_folder
   use hdf5_writing, only: hdf5_group_t
   use kinds, only: wp
   use number_text, only: to_text
   use measure_rows, only: row_of, write_columns
   use response_types, only: run_measures_t
   use results_file, only: begin_results, finish_results, write_run
   use scene_types, only: scene_t
   use sweep_settings, only: measure_count, parameter_meanings, parameter_names
   implicit none (type, external)
   private
   public :: write_cases

contains

   !> Write the file, whole or not at all.
   subroutine write_cases(folder, version, scene, cases, error)
      !> Folder of the results
      character(*), intent(in) :: folder
      !> Version of the program
      character(*), intent(in) :: version
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Its cases
      type(case_t), intent(in) :: cases(:)
      !> Why the file could not be written
      type(failure_t), allocatable, intent(out) :: error

      integer(c_size_t), parameter :: expected_bytes = 4000000_c_size_t
      type(hdf5_group_t) :: root, group, case_group
      character(:), allocatable :: name
      integer :: i, parameter

      call make_folder(folder, error)
      if (allocated(error)) return
      parameter = case_parameters(scene%cases%choice)
      name = trim(parameter_names(parameter))
      call begin_results(root, expected_bytes, version, scene)
      group = root%group('cases')
      call group%note('parameter', name)
      call group%note('meaning', trim(parameter_meanings(parameter)))
      call group%add(name, cases%value, '1', trim(parameter_meanings(parameter)), is_scale=.true.)
      call write_comparison(group, name, cases)
      do i = 1, size(cases)
         case_group = group%group('case_'//to_text(i))
         call case_group%note('value', cases(i)%value)
         call write_run(case_group, cases(i)%scene, cases(i)%node_position, response=cases(i)%response)
      end do
      call finish_results(root, folder, scene, error)
   end subroutine write_cases

   !> One number a case; what did not happen is NaN.
   subroutine write_comparison(group, name, cases)
      !> The group
      type(hdf5_group_t), intent(in) :: group
      !> The dimension scale
      character(*), intent(in) :: name
      !> The cases
      type(case_t), intent(in) :: cases(:)

      type(run_measures_t) :: measures(size(cases))
      real(wp) :: rows(measure_count, size(cases))
      integer :: i

      do i = 1, size(cases)
         measures(i) = cases(i)%response%measures
         rows(:, i) = row_of(measures(i))
      end do
      call group%add('impacts', measures%impacts, '1', 'number of impacts', along=name)
      call group%add('first_impact', known(measures%first_impact_tau, measures%has_met_stop), '1', &
                     'time of the first impact, tau', along=name)
      call group%add('first_impact_velocity', known(measures%first_impact_velocity, measures%has_met_stop), '1', &
                     'velocity at the stop before the first impact, d eta/d tau', along=name)
      call group%add('quiet', known(measures%quiet_tau, measures%is_quiet), '1', &
                     'time when |eta| at the stop last exceeded 0.02, tau', along=name)
      call group%add('spent', known(measures%spent_tau, measures%has_spent), '1', &
                     'time when the energy above that at rest last exceeded 1 percent, tau', along=name)
      call write_columns(group, rows, 0.0_wp, 0.0_wp, 0.0_wp, along=name)
   end subroutine write_comparison

   !> The value, or NaN.
   elemental function known(value, is_known) result(number)
      !> The value
      real(wp), intent(in) :: value
      !> It is known
      logical, intent(in) :: is_known
      real(wp) :: number

      number = value
      if (.not. is_known) number = ieee_value(1.0_wp, ieee_quiet_nan)
   end function known

end module cases_file
