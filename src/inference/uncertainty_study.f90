!> The study of a scene with &uncertainty: a sweep over a sample of uncertain parameters, and statistics of its
!> measures, with their group of the results file and their table on the console.
module uncertainty_study
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use checksums, only: checksum_of_numbers
   use failures, only: failure_t
   use kinds, only: wp
   use measure_list, only: measure_table
   use measure_selection, only: chosen_measures
   use number_text, only: to_text, rounded
   use quantities, only: name_in_results, units_t, units_in
   use quantity_groups, only: quantity_group_t
   use reader_units, only: unit_in
   use sample_statistics, only: find_sample_statistics, sample_t
   use scene_types, only: scene_t
   use study_job, only: job_t
   use sweep_best, only: refined_t
   use sweep_file, only: survey_chunks, survey_t, write_sweep, summary_t
   use sweep_plan, only: make_plan, plan_t
   use sweep_ranks, only: is_first_rank
   use sweep_study, only: plan_run_t, refuse_only_failures, run_plan, workers_in_words
   use sweep_tables, only: print_sweep
   use table_columns, only: add_numbers, add_texts, print_table, six_digits, table_t, whole, two_digits
   use uncertain_values, only: distribute
   implicit none (type, external)
   private
   public :: run_uncertainty, plan_sample, find_statistics, uncertainty_t

   !> Maximum length of names and units in the results file.
   integer, parameter :: max_text_length = 40

   type, extends(summary_t) :: uncertainty_t
      !> Indices of the measures in `measure_table`
      integer, allocatable :: measures(:)
      !> Statistics of each measure
      type(sample_t), allocatable :: samples(:)
      !> Probabilities of the quantiles
      real(wp), allocatable :: probabilities(:)
   contains
      procedure :: write => write_uncertainty
   end type uncertainty_t

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
         workers_in_words(run%workers))
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

   !> Write the group /uncertainty: a row for each measure, and subgroups with quantiles and histograms.
   subroutine write_uncertainty(self, root)
      class(uncertainty_t), intent(in) :: self
      type(quantity_group_t), intent(in) :: root

      type(quantity_group_t) :: classes, group, part
      character(*), parameter :: along = 'measure', own = "the measure's"
      character(max_text_length) :: names(size(self%measures)), units(size(self%measures))
      integer :: i, k

      group = root%subgroup('uncertainty')
      do i = 1, size(self%measures)
         names(i) = group%named(measure_table(self%measures(i))%name)
         units(i) = unit_in(group%units, measure_table(self%measures(i))%quantity, '1')
      end do
      call group%add(along, [(i, i=1, size(names))], '1', 'number of the measure', is_scale=.true.)
      call group%add('name', names, 'none', 'measure of the run', along)
      call group%add('unit', units, 'none', 'its unit', along)
      call group%add('count', self%samples%count, '1', 'cases that have it', along=along)
      call group%add('mean', self%samples%mean, own, 'mean', along=along)
      call group%add('mean_half_width', self%samples%mean_error, own, 'half width of its 95 % interval', along=along)
      call group%add('standard_deviation', self%samples%deviation, own, 'standard deviation', along=along)
      call group%add('standard_deviation_half_width', self%samples%deviation_error, own, &
         'half width of its 95 % interval', along=along)
      part = group%subgroup('quantiles')
      call part%add('probability', self%probabilities, '1', 'probability of a value below', is_scale=.true.)
      do i = 1, size(names)
         call part%add(trim(names(i)), self%samples(i)%quantile, trim(units(i)), 'quantiles', along='probability')
         call part%add(trim(names(i))//'_half_width', self%samples(i)%quantile_error, trim(units(i)), &
            'half widths of their 95 % intervals', along='probability')
      end do
      part = group%subgroup('histograms')
      do i = 1, size(names)
         classes = part%subgroup(trim(names(i)))
         call classes%attribute('least', self%samples(i)%minimum)
         call classes%add('class', self%samples(i)%class, trim(units(i)), 'upper end of the class', is_scale=.true.)
         call classes%add('cases', [(self%samples(i)%in_class(k), k=1, size(self%samples(i)%in_class))], '1', &
            'cases in the class', along='class')
      end do
   end subroutine write_uncertainty

   !> Print the table.
   subroutine print_uncertainty(unit, units, uncertainty)
      integer, intent(in) :: unit
      !> Units of the results
      type(units_t), intent(in) :: units
      type(uncertainty_t), intent(in) :: uncertainty

      type(table_t) :: table
      character(max_text_length), allocatable :: names(:), measured_in(:)
      real(wp) :: quantiles(size(uncertainty%measures))
      integer :: i, k

      allocate (names(size(uncertainty%measures)), measured_in(size(uncertainty%measures)))
      do i = 1, size(names)
         names(i) = name_in_results(measure_table(uncertainty%measures(i))%name)
         measured_in(i) = unit_in(units, measure_table(uncertainty%measures(i))%quantity)
      end do
      write (unit, '()')
      call add_texts(table, 'measure', names)
      if (any(measured_in /= '')) call add_texts(table, 'unit', measured_in)
      call add_numbers(table, 'cases', real(uncertainty%samples%count, wp), whole)
      call add_numbers(table, 'mean', uncertainty%samples%mean, six_digits)
      call add_numbers(table, '95 % within', uncertainty%samples%mean_error, two_digits)
      call add_numbers(table, 'standard deviation', uncertainty%samples%deviation, six_digits)
      call add_numbers(table, '95 % within', uncertainty%samples%deviation_error, two_digits)
      do k = 1, size(uncertainty%probabilities)
         quantiles = [(uncertainty%samples(i)%quantile(k), i=1, size(names))]
         call add_numbers(table, rounded(100.0_wp*uncertainty%probabilities(k))//' % below', quantiles, six_digits)
      end do
      call print_table(unit, table)
      if (any(uncertainty%samples%count < maxval(uncertainty%samples%count))) write (unit, '(/, 2x, a)') &
         'a case without a measure, such as one without impacts, does not count for it: of '// &
         to_text(maxval(uncertainty%samples%count))//' cases'
   end subroutine print_uncertainty

end module uncertainty_study
