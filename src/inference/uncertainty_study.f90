!> What uncertain parameters make of the measures of a run: a sweep over a sample of them, and its statistics.
module uncertainty_study
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use, intrinsic :: iso_c_binding, only: c_char, c_size_t
   use checksums, only: checksum
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use measure_selection, only: chosen_measures
   use number_text, only: to_text
   use sample_statistics, only: describe
   use scene_types, only: scene_t
   use scene_units, only: units_in
   use study_job, only: job_t
   use sweep_best, only: refined_t
   use sweep_chunks, only: chunk_rows_t, read_chunk
   use sweep_file, only: survey_chunks, survey_t, write_sweep
   use sweep_plan, only: first_of_chunk, make_plan, plan_t
   use sweep_ranks, only: max_of_ranks, is_first_rank, ranks_in_words
   use sweep_study, only: in_words, plan_run_t, run_plan, threads_for
   use sweep_tables, only: print_sweep
   use uncertain_values, only: distribute
   use uncertainty_results, only: print_uncertainty, uncertainty_t
   implicit none (type, external)
   private
   public :: run_uncertainty, plan_sample, describe_rows

contains

   !> Run the sample, write the file, print the tables.
   subroutine run_uncertainty(scene, job, error)
      !> It has &uncertainty
      type(scene_t), intent(in) :: scene
      type(job_t), intent(in) :: job
      !> Why there are no results; the parts that are done stay
      type(failure_t), allocatable, intent(out) :: error

      type(plan_t) :: plan
      type(plan_run_t) :: run
      type(survey_t) :: survey
      type(refined_t) :: refined
      type(uncertainty_t), allocatable :: uncertainty
      real(wp), allocatable :: values(:, :)
      integer :: trouble

      call plan_sample(scene, plan, error)
      trouble = 0
      if (allocated(error)) trouble = error%status
      ! a process that cannot read the fit must not let the others wait for it
      trouble = max_of_ranks(trouble)
      if (trouble > 0) then
         call fail(error, trouble, '')
         return
      end if
      call run_plan(scene, plan, job, threads_for(job%threads, real(plan%cases, wp)), run, error)
      if (allocated(error) .or. .not. is_first_rank()) return
      call survey_chunks(run%path, scene, plan, run%text, survey, error)
      if (allocated(error)) return
      allocate (survey%analysed(0), uncertainty)
      uncertainty%measures = chosen_measures(scene, scene%uncertainty%measures)
      call collect_values(run, plan, uncertainty%measures, values, error)
      if (allocated(error)) return
      call describe_rows(scene, values, uncertainty)
      allocate (survey%summary, source=uncertainty)
      call write_sweep(job%folder, run%path, scene, plan, run%text, survey, refined, error)
      if (allocated(error) .or. job%quiet) return
      call print_sweep(job%unit, scene, plan, survey, refined, run%computed, run%seconds, &
         in_words(run%workers, ranks_in_words()))
      call print_uncertainty(job%unit, units_in(scene), uncertainty)
   end subroutine run_uncertainty

   !> The sample.
   subroutine plan_sample(scene, plan, error)
      !> It has &uncertainty
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(out) :: plan
      !> Set when a fit cannot be read
      type(failure_t), allocatable, intent(out) :: error

      character(kind=c_char), allocatable :: bytes(:)
      integer :: k, room

      call make_plan(scene, plan)
      call distribute(scene, plan, error)
      if (allocated(error)) return
      ! of values that follow from a fit the scene says only where it is
      plan%remark = 'sample, checksum'
      room = plan%cases*(storage_size(1.0_wp)/8)
      allocate (bytes(room))
      do k = 1, size(plan%axes)
         bytes(:) = transfer(plan%axes(k)%values, bytes)
         plan%remark = plan%remark//' '//to_text(checksum(bytes, size(bytes, kind=c_size_t)))
      end do
   end subroutine plan_sample

   !> Some measures of all cases.
   subroutine collect_values(run, plan, measures, values, error)
      type(plan_run_t), intent(in) :: run
      type(plan_t), intent(in) :: plan
      !> Places in the table of measures
      integer, intent(in) :: measures(:)
      !> [cases, measures]
      real(wp), allocatable, intent(out) :: values(:, :)
      !> Set when a part cannot be read
      type(failure_t), allocatable, intent(out) :: error

      type(chunk_rows_t) :: part
      logical :: is_good
      integer :: first, i, number

      allocate (values(plan%cases, size(measures)))
      do number = 1, plan%chunks
         call read_chunk(run%path, plan, run%text, number, part, is_good)
         if (.not. is_good) then
            call fail(error, status_run_failed, "'"//run%path//"' was spoilt since it was written; give the same " &
               //'command again')
            return
         end if
         first = first_of_chunk(plan, number)
         do i = 1, size(part%rows, 2)
            values(first + i - 1, :) = part%rows(measures, i)
         end do
      end do
   end subroutine collect_values

   !> Statistics of all measures that are asked for; of those that nobody named, those that are there.
   subroutine describe_rows(scene, values, uncertainty)
      type(scene_t), intent(in) :: scene
      !> [cases, measures]
      real(wp), intent(in) :: values(:, :)
      !> Its measures in
      type(uncertainty_t), intent(inout) :: uncertainty

      integer, allocatable :: there(:)
      integer :: i

      allocate (there, source=[(i, i=1, size(uncertainty%measures))])
      if (.not. allocated(scene%uncertainty%measures)) then
         there = pack(there, [(count(.not. ieee_is_nan(values(:, i))) > 1, i=1, size(there))])
      end if
      uncertainty%measures = uncertainty%measures(there)
      uncertainty%probabilities = scene%uncertainty%quantiles
      allocate (uncertainty%samples(size(there)))
      do i = 1, size(there)
         call describe(values(:, there(i)), uncertainty%probabilities, scene%uncertainty%classes, &
            uncertainty%samples(i))
      end do
   end subroutine describe_rows

end module uncertainty_study
