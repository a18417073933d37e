!> What the program `impactbeam-benchmark` does with a scene.
module benchmark_run
   use failures, only: failure_t
   use kinds, only: wp
   use memory_needs, only: add_modes, add_samples, need_t
   use precision_file, only: write_precision
   use precision_study, only: run_precision
   use precision_tables, only: print_precision
   use precision_types, only: precision_t
   use progress_line, only: start_progress, stop_progress
   use scene_types, only: scene_t
   use study_job, only: job_t
   use sweep_ranks, only: is_first_rank
   implicit none (type, external)
   private
   public :: needs_of_precision, run_precision_scene

contains

   !> One run after the other, beside a reference.
   subroutine needs_of_precision(scene, threads, need)
      type(scene_t), intent(in) :: scene
      !> Of no meaning here
      integer, intent(in) :: threads
      type(need_t), intent(out) :: need

      real(wp) :: step
      integer :: elements

      elements = scene%mesh%elements
      step = scene%response%step
      associate (unused => threads, precision => scene%precision)
         if (allocated(precision%steps)) then
            if (size(precision%steps) > 0) step = minval(precision%steps)
         end if
         if (allocated(precision%mesh_elements)) elements = max(elements, maxval(precision%mesh_elements))
         call add_samples(precision%duration/step, 34, '&precision', &
            'give &precision a shorter duration or longer steps', need)
      end associate
      call add_modes(elements, 1, 'give fewer elements', need)
   end subroutine needs_of_precision

   !> Compare run time and error, write the file, print the tables.
   subroutine run_precision_scene(scene, job, error)
      type(scene_t), intent(in) :: scene
      type(job_t), intent(in) :: job
      !> Set when the study fails or its file cannot be written
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

end module benchmark_run
