!> Computation of the cases of a sweep: threads and processes take chunks (sets of successive cases) until all are done.
!> The results of a case depend only on its own parameters (those of a chain only on its own cases), so the results do
!> not depend on the distribution of the chunks.
module sweep_run
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: error_unit
   use analyses, only: analysed_t, of_run
   use case_runs, only: run_set_case => run_case, runner_t, set_case, start_runner
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use measure_list, only: measure_count, measure_status, measure_table, peak_count
   use measure_rows, only: row_in_units
   use mesh_estimates, only: sample_cases
   use motion_run, only: set_store_t
   use number_text, only: to_text
   use program_identity, only: program_name
   use quantities, only: quantity_named, units_t, are_physical, units_in
   use response_types, only: response_t
   use run_measures, only: row_of
   use run_settings, only: output_settings_t
   use scene_reader, only: set_parameters
   use scene_types, only: scene_t
   use section_types, only: run_sections_t
   use sweep_chunks, only: chunk_is_done, chunk_name, chunk_rows_t, read_chunk, max_reason_length, write_chunk
   use sweep_plan, only: case_values, first_of_chunk, last_of_chunk, plan_t, section_values
   use sweep_progress, only: erase_sweep_progress, progress_t, print_sweep_progress, start_sweep_progress
   use sweep_ranks, only: clear_queue, max_of_ranks, queue_t, finish_queue, is_first_rank, next_of_queue, rank_count, &
      serve_queue, start_queue
   use sweep_spectra, only: record_spectra, spectrum_size
   implicit none (type, external)
   private
   public :: run_chunks, run_cases, start_plan, run_case, sample_plan

   !> Data of a process that its threads share.
   type :: shared_t
      type(queue_t) :: queue
      type(progress_t) :: progress
      !> Number of cases found on disk
      integer :: before = 0
      !> Number of cases run by this process
      integer :: done = 0
      !> The first failure, after which all threads stop
      type(failure_t), allocatable :: error
   end type shared_t

contains

   !> Run the chunks that are not on disk.
   subroutine run_chunks(scene, plan, threads, label, is_silent, computed, error)
      type(scene_t), intent(in) :: scene
      !> Plan of the sweep
      type(plan_t), intent(in) :: plan
      integer, intent(in) :: threads
      !> Label of the progress line
      character(*), intent(in) :: label
      !> Whether no progress is printed
      logical, intent(in) :: is_silent
      !> Number of cases that were not on disk
      integer, intent(out) :: computed
      !> Set if a chunk cannot be written
      type(failure_t), allocatable, intent(out) :: error

      type(shared_t) :: shared
      integer, allocatable :: missing(:)
      integer :: i

      call find_missing(plan, label, missing)
      computed = 0
      do i = 1, size(missing)
         computed = computed + last_of_chunk(plan, missing(i)) - first_of_chunk(plan, missing(i)) + 1
      end do
      shared%before = plan%cases - computed
      call start_queue(missing, shared%queue)
      call start_sweep_progress(is_first_rank() .and. .not. is_silent, label, plan%cases, shared%before, &
         shared%progress)
      !$omp parallel num_threads(threads) default(shared)
      call work_on_chunks(scene, plan, shared)
      !$omp end parallel
      if (allocated(shared%error)) call clear_queue(shared%queue)
      call finish_queue(shared%queue)
      call erase_sweep_progress(shared%progress)
      i = max_of_ranks(merge(1, 0, allocated(shared%error)))
      if (allocated(shared%error)) then
         call move_alloc(shared%error, error)
      else if (i > 0) then
         call fail(error, status_run_failed, 'another process could not write its part')
      end if
   end subroutine run_chunks

   !> Find the chunks that are missing on disk; only the first process searches.
   subroutine find_missing(plan, label, missing)
      !> Plan of the sweep
      type(plan_t), intent(in) :: plan
      !> Name of the sweep
      character(*), intent(in) :: label
      !> Numbers of the missing chunks
      integer, allocatable, intent(out) :: missing(:)

      type(chunk_rows_t) :: chunk
      logical, allocatable :: is_missing(:)
      logical :: is_good
      integer :: i

      allocate (is_missing(plan%chunks), source=.false.)
      if (is_first_rank()) then
         do i = 1, plan%chunks
            is_missing(i) = .not. chunk_is_done(plan%path, i)
            if (is_missing(i)) cycle
            call read_chunk(plan, i, chunk, is_good)
            is_missing(i) = .not. is_good
            if (.not. is_good) write (error_unit, '(a)') program_name//': '//label//": '"//plan%path//'/' &
               //chunk_name(i)//"' is damaged (its checksum is wrong); its cases are computed again"
         end do
      end if
      missing = pack([(i, i=1, plan%chunks)], is_missing)
   end subroutine find_missing

   !> Work of one thread: run one chunk after the other until all are taken.
   subroutine work_on_chunks(scene, plan, shared)
      type(scene_t), intent(in) :: scene
      !> Plan of the sweep
      type(plan_t), intent(in) :: plan
      !> Data that the threads share; a thread accesses the data in critical sections
      type(shared_t), intent(inout) :: shared

      type(runner_t) :: runner
      ! not a component of the runner, because gfortran 12 deallocates the other components if a component is finalised
      type(set_store_t), target :: sets
      type(chunk_rows_t) :: chunk
      type(failure_t), allocatable :: failure
      integer :: number

      call start_plan(scene, plan, runner)
      do
         !$omp critical (sweep_queue)
         number = 0
         if (.not. allocated(shared%error)) call next_of_queue(shared%queue, number)
         !$omp end critical (sweep_queue)
         if (number == 0) exit
         call run_chunk(runner, sets, plan, number, chunk, shared)
         !$omp critical (sweep_disk)
         call write_chunk(plan, number, chunk, failure)
         !$omp end critical (sweep_disk)
         if (allocated(failure)) then
            !$omp critical (sweep_queue)
            call fail(shared%error, failure%status, failure%message)
            !$omp end critical (sweep_queue)
         end if
      end do
   end subroutine work_on_chunks

   !> Run the cases of one chunk.
   subroutine run_chunk(runner, sets, plan, number, chunk, shared)
      !> Runner of the thread
      type(runner_t), intent(inout) :: runner
      !> Contact sets (the beam with given closed contacts), which the runs of the thread use in common
      type(set_store_t), target, intent(inout) :: sets
      type(plan_t), intent(in) :: plan
      !> Number of the chunk
      integer, intent(in) :: number
      !> Results of the chunk
      type(chunk_rows_t), intent(out) :: chunk
      !> Data that the threads share
      type(shared_t), intent(inout) :: shared

      character(:), allocatable :: reason
      character(max_reason_length), allocatable :: reasons(:)
      integer, allocatable :: failed(:)
      integer :: failed_case, case, cases, failures, first, shown

      first = first_of_chunk(plan, number)
      cases = last_of_chunk(plan, number) - first + 1
      allocate (chunk%values(size(plan%axes), cases), chunk%rows(measure_count, cases), failed(cases), reasons(cases))
      allocate (chunk%extras(plan%extras, cases))
      failures = 0
      failed_case = 0
      do case = 1, cases
         call case_values(plan, first + case - 1, chunk%values(:, case))
         if (plan%chain > 0) then
            if (modulo(case - 1, plan%chain) == 0) then
               failed_case = 0
               if (allocated(runner%carried)) deallocate (runner%carried)
               allocate (runner%carried)
            end if
         end if
         if (associated(plan%run)) then
            call plan%run(runner, chunk%values(:, case), chunk%rows(:, case), reason, sets, chunk%extras(:, case))
         else
            call run_case(runner, chunk%values(:, case), chunk%rows(:, case), reason, sets, chunk%extras(:, case), &
               failed_case)
         end if
         if (allocated(reason)) then
            if (plan%chain > 0 .and. failed_case == 0) failed_case = first + case - 1
            failures = failures + 1
            failed(failures) = first + case - 1
            reasons(failures) = reason
         end if
         !$omp critical (sweep_queue)
         shared%done = shared%done + 1
         shown = shared%before + shared%done
         ! other processes report no cases, so the number of cases in all assigned chunks is shown
         if (rank_count() > 1) shown = min(plan%cases, shared%before + shared%queue%assigned*plan%chunk_cases)
         call serve_queue(shared%queue)
         call print_sweep_progress(shared%progress, shown)
         !$omp end critical (sweep_queue)
      end do
      allocate (chunk%failed, source=failed(:failures))
      allocate (chunk%reasons(failures))
      chunk%reasons(:) = reasons(:failures)
   end subroutine run_chunk

   !> Make the scenes of some cases, evenly spaced from the first to the last.
   subroutine sample_plan(scene, plan, numbers, scenes)
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      !> Numbers of the cases
      integer, allocatable, intent(out) :: numbers(:)
      !> The scenes with the parameters of these cases
      type(scene_t), allocatable, intent(out) :: scenes(:)

      character(:), allocatable :: problem
      real(wp) :: values(size(plan%axes))
      integer :: i

      numbers = sample_cases(plan%cases)
      allocate (scenes(size(numbers)), source=scene)
      do i = 1, size(numbers)
         call case_values(plan, numbers(i), values)
         call set_parameters(scenes(i), plan%axes%parameter, values, problem)
      end do
   end subroutine sample_plan

   !> Prepare a runner for the cases of a plan; it records only measures.
   subroutine start_plan(scene, plan, runner)
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      type(runner_t), intent(out) :: runner

      call start_runner(scene, output_settings_t(history=.false., max_peaks=peak_count), &
         plan%axes%parameter, plan%axes%minimum, plan%axes%maximum, runner)
      runner%scene%stress%history = .false.
   end subroutine start_plan

   !> Run a case.
   subroutine run_case(runner, values, row, reason, sets, extras, failed_case)
      type(runner_t), intent(inout) :: runner
      !> Parameters of the case, in the order of the axes
      real(wp), intent(in) :: values(:)
      !> Measures of the case, [measure_count]
      real(wp), intent(out) :: row(:)
      !> Reason of the failure; unallocated: the case succeeded
      character(:), allocatable, intent(out) :: reason
      !> Cached contact sets (the beam with given closed contacts), shared by several runs; absent: not shared
      type(set_store_t), target, intent(inout), optional :: sets
      !> Numbers of the case besides its measures: Poincare sections, then spectra; absent or of size 0: not recorded
      real(wp), intent(inout), optional :: extras(:)
      !> Number of the earlier case of the chain that failed; 0 or absent: none
      integer, intent(in), optional :: failed_case

      type(response_t) :: response
      type(analysed_t), allocatable :: analysed(:)
      type(failure_t), allocatable :: error
      integer :: spectra

      ! measures that are whole numbers have no NaN: a failed case has 0
      row = merge(0.0_wp, ieee_value(1.0_wp, ieee_quiet_nan), measure_table%is_whole)
      row(measure_status) = 1.0_wp
      if (present(extras)) extras = ieee_value(1.0_wp, ieee_quiet_nan)
      if (present(failed_case)) then
         if (failed_case > 0) then
            !$omp critical (case_scenes)
            reason = 'its chain ended as case '//to_text(failed_case)//' failed'
            !$omp end critical (case_scenes)
            return
         end if
      end if
      call set_case(runner, values, error)
      if (.not. allocated(error)) call run_set_case(runner, response, analysed, error, sets, of_run)
      if (allocated(error)) then
         reason = error%message
         return
      end if
      row = row_of(response%measures)
      if (are_physical(runner%scene)) row = row_in_units(units_in(runner%scene), row)
      if (.not. present(extras)) return
      if (size(extras) == 0) return
      spectra = 0
      if (allocated(response%spectrum)) spectra = spectrum_size(runner%scene)
      if (allocated(response%sections)) call record_sections(response%sections, units_in(runner%scene), &
         extras(:size(extras) - spectra))
      if (spectra > 0) call record_spectra(response%spectrum, units_in(runner%scene), &
         extras(size(extras) - spectra + 1:))
   end subroutine run_case

   !> Convert the Poincare sections of a case to the units of the results: displacement and velocity at the stop from
   !> which the beam is released, and at the tip.
   pure subroutine record_sections(recorded, units, values)
      type(run_sections_t), intent(in) :: recorded
      type(units_t), intent(in) :: units
      !> Values of all Poincare sections, one section after the other, the last at the end
      real(wp), intent(inout) :: values(:)

      real(wp) :: factor(2)
      integer :: first, k

      factor = 1.0_wp
      if (units%are_physical) factor = [units%factor(quantity_named('displacement')), &
         units%factor(quantity_named('velocity'))]
      first = size(values)/section_values - recorded%count
      do k = 1, recorded%count
         associate (section => values(section_values*(first + k - 1) + 1:section_values*(first + k)))
            if (recorded%release_contact > 0) section(1:2) = factor*recorded%contact(:, recorded%release_contact, k)
            section(3:4) = factor*recorded%displacement(:, 0, k)
         end associate
      end do
   end subroutine record_sections

   !> Run cases that do not belong to a chunk, in parallel.
   subroutine run_cases(scene, plan, values, threads, rows)
      type(scene_t), intent(in) :: scene
      !> Plan of the sweep, for the parameters
      type(plan_t), intent(in) :: plan
      !> Parameters of each case, [axes, cases]
      real(wp), intent(in) :: values(:, :)
      integer, intent(in) :: threads
      !> Measures of each case, [measure_count, cases]
      real(wp), intent(out) :: rows(:, :)

      !$omp parallel num_threads(threads) default(shared)
      call work_on_cases(scene, plan, values, rows)
      !$omp end parallel
   end subroutine run_cases

   !> Run cases in one thread, which takes the next case when it has finished one.
   subroutine work_on_cases(scene, plan, values, rows)
      type(scene_t), intent(in) :: scene
      !> Plan of the sweep, for the parameters
      type(plan_t), intent(in) :: plan
      !> Parameters of each case, [axes, cases]
      real(wp), intent(in) :: values(:, :)
      !> Measures of each case, [measure_count, cases]
      real(wp), intent(inout) :: rows(:, :)

      type(runner_t) :: runner
      type(set_store_t), target :: sets
      character(:), allocatable :: reason
      integer :: i

      call start_plan(scene, plan, runner)
      !$omp do schedule(dynamic)
      do i = 1, size(values, 2)
         call run_case(runner, values(:, i), rows(:, i), reason, sets)
      end do
      !$omp end do
   end subroutine work_on_cases

end module sweep_run
