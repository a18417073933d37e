!> The study of a scene with &uncertainty: a sweep over a sample of uncertain parameters, and statistics of its
!> measures.
module uncertainty_study
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use checksums, only: checksum_of_numbers
   use failures, only: failure_t
   use kinds, only: wp
   use measure_selection, only: chosen_measures
   use number_text, only: to_text
   use sample_statistics, only: find_sample_statistics
   use scene_types, only: scene_t
   use scene_units, only: units_in
   use study_job, only: job_t
   use sweep_best, only: refined_t
   use sweep_file, only: survey_chunks, survey_t, write_sweep
   use sweep_plan, only: make_plan, plan_t
   use sweep_ranks, only: is_first_rank, ranks_in_words
   use sweep_study, only: plan_run_t, refuse_only_failures, run_plan, workers_in_words
   use sweep_tables, only: print_sweep
   use uncertain_values, only: distribute
   use uncertainty_results, only: print_uncertainty, uncertainty_t
   implicit none (type, external)
   private
   public :: run_uncertainty, plan_sample, find_statistics

contains

   !> Run the sample, write the results file, print the tables.
   subroutine run_uncertainty(scene, job, error)
      !> Scene with &uncertainty
      type(scene_t), intent(in) :: scene
      type(job_t), intent(in) :: job
      !> Set if there are no results; complete chunks remain on disk
      type(failure_t), allocatable, intent(out) :: error

      type(plan_t) :: plan
      type(plan_run_t) :: run
      type(survey_t) :: survey
      type(refined_t) :: refined
      type(uncertainty_t), allocatable :: uncertainty

      call plan_sample(scene, plan, error)
      call run_plan(scene, plan, job, run, error)
      if (allocated(error) .or. .not. is_first_rank()) return
      allocate (uncertainty)
      uncertainty%measures = chosen_measures(scene, scene%uncertainty%measures)
      call survey_chunks(scene, plan, survey, error, uncertainty%measures)
      if (allocated(error)) return
      allocate (survey%analysed(0))
      call find_statistics(scene, survey%values, uncertainty)
      allocate (survey%summary, source=uncertainty)
      call write_sweep(job%folder, scene, plan, survey, refined, error)
      if (allocated(error)) return
      call refuse_only_failures(plan, survey, error)
      if (job%quiet) return
      call print_sweep(job%unit, scene, plan, survey, refined, run%computed, run%seconds, &
         workers_in_words(run%workers, ranks_in_words()))
      call print_uncertainty(job%unit, units_in(scene), uncertainty)
   end subroutine run_uncertainty

   !> Plan the cases, a sample of the distributions.
   subroutine plan_sample(scene, plan, error)
      !> Scene with &uncertainty
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(out) :: plan
      !> Set if the results of a fit cannot be read
      type(failure_t), allocatable, intent(out) :: error

      integer :: k

      call make_plan(scene, plan)
      call distribute(scene, plan, error)
      if (allocated(error)) return
      ! the plan depends on the values, because the scene gives only the name of the results file of a fit
      plan%remark = 'sample, checksum'
      do k = 1, size(plan%axes)
         plan%remark = plan%remark//' '//to_text(checksum_of_numbers(plan%axes(k)%values))
      end do
   end subroutine plan_sample

   !> Find the statistics of the selected measures; measures that the scene does not name are left out if they have no
   !> value.
   subroutine find_statistics(scene, values, uncertainty)
      type(scene_t), intent(in) :: scene
      !> Measures, [cases, measures]
      real(wp), intent(in) :: values(:, :)
      !> On entry measures; on return statistics
      type(uncertainty_t), intent(inout) :: uncertainty

      integer, allocatable :: known(:)
      integer :: i

      allocate (known, source=[(i, i=1, size(uncertainty%measures))])
      if (.not. allocated(scene%uncertainty%measures)) then
         known = pack(known, [(count(.not. ieee_is_nan(values(:, i))) > 1, i=1, size(known))])
      end if
      uncertainty%measures = uncertainty%measures(known)
      uncertainty%probabilities = scene%uncertainty%quantiles
      allocate (uncertainty%samples(size(known)))
      do i = 1, size(known)
         call find_sample_statistics(values(:, known(i)), uncertainty%probabilities, scene%uncertainty%classes, &
            uncertainty%samples(i))
      end do
   end subroutine find_statistics

end module uncertainty_study
