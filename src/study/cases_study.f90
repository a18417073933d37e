!> The cases of a scene, from the scene to their file and table.
module cases_study
   use case_runs, only: case_t, run_cases
   use cases_file, only: write_cases
   use cases_tables, only: print_cases
   use console_tables, only: print_model
   use failures, only: failure_t
   use progress_line, only: start_progress, stop_progress
   use scene_types, only: scene_t
   use study_job, only: job_t
   implicit none (type, external)
   private
   public :: run_cases_of_scene

contains

   !> Run the cases, write the file, print the table.
   subroutine run_cases_of_scene(scene, job, error)
      !> It has &cases
      type(scene_t), intent(in) :: scene
      type(job_t), intent(in) :: job
      !> Set when a run fails or the file cannot be written
      type(failure_t), allocatable, intent(out) :: error

      type(case_t), allocatable :: cases(:)

      if (.not. job%quiet) call start_progress(job%label)
      call run_cases(scene, cases, error)
      call stop_progress()
      if (allocated(error)) return
      call write_cases(job%folder, scene, cases, error)
      if (allocated(error) .or. job%quiet) return
      call print_model(job%unit, cases(1)%scene, cases(1)%node_position)
      call print_cases(job%unit, scene, cases)
   end subroutine run_cases_of_scene

end module cases_study
