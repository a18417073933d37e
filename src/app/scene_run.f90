!> The computation of a scene by the program `impactbeam`: a sweep, a few cases, or a single run.
module scene_run
   use cases_study, only: run_cases_of_scene
   use default_mesh, only: find_mesh
   use failures, only: failure_t
   use fit_study, only: run_fit
   use scene_types, only: scene_t
   use sensitivity_study, only: run_sensitivity
   use single_study, only: run_single
   use study_job, only: job_t
   use sweep_ranks, only: is_first_rank
   use sweep_study, only: run_sweep
   use uncertainty_study, only: run_uncertainty
   implicit none (type, external)
   private
   public :: run_motion_scene

contains

   !> Compute a scene. MPI processes share the cases of a sweep; other scenes are computed by the first process alone.
   subroutine run_motion_scene(given, job, error)
      !> The scene as read, perhaps without a mesh
      type(scene_t), intent(in) :: given
      type(job_t), intent(in) :: job
      !> Set if a run fails or a file cannot be written
      type(failure_t), allocatable, intent(out) :: error

      type(scene_t), allocatable :: scene

      allocate (scene, source=given)
      call find_mesh(scene)
      if (scene%wants_fit) then
         call run_fit(scene, job, error)
      else if (scene%wants_uncertainty) then
         call run_uncertainty(scene, job, error)
      else if (scene%wants_sweep) then
         call run_sweep(scene, job, error)
      else if (scene%wants_sensitivity) then
         call run_sensitivity(scene, job, error)
      else if (scene%wants_cases) then
         if (is_first_rank()) call run_cases_of_scene(scene, job, error)
      else
         if (is_first_rank()) call run_single(scene, job, error)
      end if
   end subroutine run_motion_scene

end module scene_run
