!> Runs the program `impactbeam-benchmark` for one scene: a precision study, which measures the run time and the error
!> of all methods.
module precision_study
   use cost_growth, only: measure_growth, measure_parts
   use failures, only: failure_t
   use kinds, only: wp
   use memory_needs, only: add_modes, add_samples, memory_need_t
   use motion_precision, only: comparison_step, compare_motion, refinement
   use motion_tasks, only: histories_and_energy, prepare_task, settings_for, task_run, task_t
   use precision_file, only: write_precision
   use precision_tables, only: print_precision
   use precision_types, only: timed_part_t, precision_t
   use progress_line, only: start_progress, stop_progress
   use response_types, only: response_t
   use results_file, only: write_results
   use scene_types, only: integrator_exact, scene_t
   use skip_savings, only: measure_savings
   use solver_precision, only: compare_solvers
   use study_job, only: job_t
   use sweep_ranks, only: is_first_rank
   use timed_tasks, only: measure_time, timed_task_t
   implicit none (type, external)
   private
   public :: memory_need_of_precision, run_precision_scene, run_precision

   !> Task that writes the results file of a run.
   type, extends(timed_task_t) :: file_task_t
      character(:), allocatable :: folder
      type(scene_t) :: scene
      type(response_t) :: response
   contains
      procedure :: run
   end type file_task_t

contains

   !> Memory that the scene needs. One run is computed at a time, in addition to the reference.
   subroutine memory_need_of_precision(scene, threads, need)
      type(scene_t), intent(in) :: scene
      !> Not used, because runs are not computed in parallel
      integer, intent(in) :: threads
      type(memory_need_t), intent(out) :: need

      real(wp) :: step
      integer :: elements

      elements = scene%mesh%elements
      step = scene%response%step
      associate (unused => threads, precision => scene%precision)
         if (allocated(precision%steps)) then
            if (size(precision%steps) > 0) step = minval(precision%steps)
         end if
         if (allocated(precision%mesh_elements)) elements = max(elements, &
            refinement*maxval(precision%mesh_elements))
         ! estimated: 34 numbers for each sample, of histories, energies and temporary arrays
         call add_samples(precision%duration/step, 34, '&precision', &
            'give &precision a shorter duration or longer steps', need)
      end associate
      call add_modes(elements, 1, 'give fewer elements', need)
   end subroutine memory_need_of_precision

   !> Compute the study, write the results file and print the tables.
   subroutine run_precision_scene(scene, job, error)
      type(scene_t), intent(in) :: scene
      type(job_t), intent(in) :: job
      !> Set if the study fails or its file cannot be written
      type(failure_t), allocatable, intent(out) :: error

      type(precision_t) :: study

      if (.not. is_first_rank()) return
      if (.not. job%quiet) call start_progress(job%label)
      call run_precision(scene, job%folder, study, error)
      call stop_progress()
      if (allocated(error)) return
      call write_precision(job%folder, scene, study, error)
      if (allocated(error) .or. job%quiet) return
      call print_precision(job%unit, scene, study)
   end subroutine run_precision_scene

   !> Compute the study. The file whose writing is timed has the name of the study's results file, which overwrites it
   !> later.
   subroutine run_precision(scene, folder, study, error)
      type(scene_t), intent(in) :: scene
      !> Folder of the results file
      character(*), intent(in) :: folder
      type(precision_t), intent(out) :: study
      !> Set if a run on which the whole study depends fails; a failed entry stores its reason instead
      type(failure_t), allocatable, intent(out) :: error

      if (scene%has_stop) then
         call compare_motion(scene, study, error)
         if (allocated(error)) return
         call measure_parts(scene, study, error)
         if (allocated(error)) return
         call measure_growth(scene, study, error)
         if (allocated(error)) return
      end if
      if (scene%wants_frequencies) call compare_solvers(scene, study, error)
      if (allocated(error)) return
      if (.not. scene%has_stop) return
      if (scene%precision%skips) call measure_savings(scene, folder, study%horizon, study%savings, error)
      if (allocated(error)) return
      call measure_writing(scene, folder, study, error)
   end subroutine run_precision

   !> Time the writing of a results file with the default histories and the energy balance.
   subroutine measure_writing(scene, folder, study, error)
      type(scene_t), intent(in) :: scene
      !> Folder of the results file
      character(*), intent(in) :: folder
      !> Study, to which the part is added
      type(precision_t), intent(inout) :: study
      !> Set if the file cannot be written
      type(failure_t), allocatable, intent(out) :: error

      type(file_task_t) :: writing
      type(task_t) :: task
      type(timed_part_t) :: part

      call prepare_task(scene, scene%mesh%elements, task, error)
      if (allocated(error)) return
      task%action = task_run
      task%output = histories_and_energy
      task%settings = settings_for(integrator_exact, scene%precision, comparison_step)
      call task%run(error)
      if (allocated(error)) return
      writing%folder = folder
      writing%scene = scene
      writing%response = task%response
      part%name = 'results file'
      call measure_time(writing, scene%precision, part%timing, error)
      if (allocated(error)) return
      study%parts = [study%parts, part]
   end subroutine measure_writing

   !> Write the results file once.
   subroutine run(self, error)
      class(file_task_t), intent(inout) :: self
      !> Set if the file cannot be written
      type(failure_t), allocatable, intent(out) :: error

      call write_results(self%folder, self%scene, error, response=self%response)
   end subroutine run

end module precision_study
