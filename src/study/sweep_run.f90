!> All cases of a sweep: threads and processes take parts until there are no more. Each case depends on its own
!> parameters alone, so who runs it, and beside what, leaves no trace in its row.
module sweep_run
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: error_unit
   use analyses, only: analysed_t, fill_row, of_run
   use case_runs, only: run_next, runner_t, start_runner
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use measure_list, only: measure_count, measure_status, measure_table, peak_count
   use measure_rows, only: row_in
   use motion_run, only: set_store_t
   use number_text, only: to_text
   use program_identity, only: program_name
   use quantities, only: quantity_named, units_t
   use response_types, only: response_t
   use run_measures, only: row_of
   use run_settings, only: output_settings_t
   use scene_reader, only: set_parameters
   use scene_types, only: scene_t
   use scene_units, only: units_in
   use section_types, only: run_sections_t
   use sweep_parts, only: part_is_done, part_name, part_rows_t, read_part, reason_room, write_part
   use sweep_plan, only: case_values, first_of_part, last_of_part, plan_t, section_values
   use sweep_progress, only: end_rate, progress_t, show_rate, start_rate
   use sweep_ranks, only: abandon_deal, greatest_of_all, deal_t, finish_deal, is_first_rank, next_of_deal, rank_count, &
      serve_deal, start_deal
   implicit none (type, external)
   private
   public :: run_parts, run_cases, start_plan, run_case, scene_of_case

   !> What the threads share.
   type :: shared_t
      type(deal_t) :: deal
      type(progress_t) :: progress
      !> Cases found on disk, and run here
      integer :: before = 0
      integer :: done = 0
      !> The first failure; no thread goes on after it
      type(failure_t), allocatable :: error
   end type shared_t

contains

   !> Run the parts that are not on disk.
   subroutine run_parts(scene, plan, text, path, threads, label, is_silent, fresh, error)
      type(scene_t), intent(in) :: scene
      !> Its plan, and the same in words
      type(plan_t), intent(in) :: plan
      character(*), intent(in) :: text
      !> Folder of the parts
      character(*), intent(in) :: path
      integer, intent(in) :: threads
      !> What the progress is called, and whether none is shown
      character(*), intent(in) :: label
      logical, intent(in) :: is_silent
      !> Cases that were not on disk
      integer, intent(out) :: fresh
      !> Set when a part cannot be written
      type(failure_t), allocatable, intent(out) :: error

      type(shared_t) :: shared
      integer, allocatable :: missing(:)
      integer :: i

      call find_missing(plan, text, path, label, missing)
      fresh = 0
      do i = 1, size(missing)
         fresh = fresh + last_of_part(plan, missing(i)) - first_of_part(plan, missing(i)) + 1
      end do
      shared%before = plan%cases - fresh
      call start_deal(missing, shared%deal)
      call start_rate(is_first_rank() .and. .not. is_silent, label, plan%cases, shared%before, shared%progress)
      !$omp parallel num_threads(threads) default(shared)
      call take_parts(scene, plan, text, path, shared)
      !$omp end parallel
      if (allocated(shared%error)) call abandon_deal(shared%deal)
      call finish_deal(shared%deal)
      call end_rate(shared%progress)
      i = greatest_of_all(merge(1, 0, allocated(shared%error)))
      if (allocated(shared%error)) then
         call move_alloc(shared%error, error)
      else if (i > 0) then
         call fail(error, status_run_failed, 'another process could not write its part')
      end if
   end subroutine run_parts

   !> The parts that are to be computed; the first process knows.
   subroutine find_missing(plan, text, path, label, missing)
      !> The plan, and the same in words
      type(plan_t), intent(in) :: plan
      character(*), intent(in) :: text
      !> Folder of the parts
      character(*), intent(in) :: path
      !> What the sweep is called
      character(*), intent(in) :: label
      !> Their numbers
      integer, allocatable, intent(out) :: missing(:)

      type(part_rows_t) :: part
      logical, allocatable :: is_missing(:)
      logical :: is_good
      integer :: i

      allocate (is_missing(plan%parts), source=.false.)
      if (is_first_rank()) then
         do i = 1, plan%parts
            is_missing(i) = .not. part_is_done(path, i)
            if (is_missing(i)) cycle
            call read_part(path, plan, text, i, part, is_good)
            is_missing(i) = .not. is_good
            if (.not. is_good) write (error_unit, '(a)') program_name//': '//label//": '"//path//'/'//part_name(i)// &
               "' was spoilt since it was written; its cases are computed again"
         end do
      end if
      missing = pack([(i, i=1, plan%parts)], is_missing)
   end subroutine find_missing

   !> What one thread does: a part after another, until there are no more.
   subroutine take_parts(scene, plan, text, path, shared)
      type(scene_t), intent(in) :: scene
      !> Its plan, and the same in words
      type(plan_t), intent(in) :: plan
      character(*), intent(in) :: text
      !> Folder of the parts
      character(*), intent(in) :: path
      !> What the threads share; each takes its turn
      type(shared_t), intent(inout) :: shared

      type(runner_t) :: runner
      ! apart from the runner, whose other components a compiler forgets where one is finalized
      type(set_store_t), target :: sets
      type(part_rows_t) :: part
      type(failure_t), allocatable :: trouble
      integer :: number

      call start_plan(scene, plan, runner)
      do
         !$omp critical (sweep_deal)
         number = 0
         if (.not. allocated(shared%error)) call next_of_deal(shared%deal, number)
         !$omp end critical (sweep_deal)
         if (number == 0) exit
         call run_part(runner, sets, plan, number, part, shared)
         !$omp critical (sweep_disk)
         call write_part(path, plan, text, number, part, trouble)
         !$omp end critical (sweep_disk)
         if (allocated(trouble)) then
            !$omp critical (sweep_deal)
            call fail(shared%error, trouble%status, trouble%message)
            !$omp end critical (sweep_deal)
         end if
      end do
   end subroutine take_parts

   !> The rows of one part.
   subroutine run_part(runner, sets, plan, number, part, shared)
      !> The thread's runner, and what its runs among several stops share
      type(runner_t), intent(inout) :: runner
      type(set_store_t), target, intent(inout) :: sets
      type(plan_t), intent(in) :: plan
      integer, intent(in) :: number
      type(part_rows_t), intent(out) :: part
      !> What the threads share
      type(shared_t), intent(inout) :: shared

      character(:), allocatable :: reason
      character(reason_room), allocatable :: reasons(:)
      integer, allocatable :: failed(:)
      integer :: broken, case, cases, failures, first, shown

      first = first_of_part(plan, number)
      cases = last_of_part(plan, number) - first + 1
      allocate (part%values(size(plan%axes), cases), part%rows(measure_count, cases), failed(cases), reasons(cases))
      allocate (part%sections(section_values*plan%sections, cases))
      failures = 0
      broken = 0
      do case = 1, cases
         call case_values(plan, first + case - 1, part%values(:, case))
         if (plan%chain > 0) then
            if (modulo(case - 1, plan%chain) == 0) then
               broken = 0
               if (allocated(runner%carried)) deallocate (runner%carried)
               allocate (runner%carried)
            end if
         end if
         call run_case(runner, part%values(:, case), part%rows(:, case), reason, sets, part%sections(:, case), &
            broken)
         if (allocated(reason)) then
            if (plan%chain > 0 .and. broken == 0) broken = first + case - 1
            failures = failures + 1
            failed(failures) = first + case - 1
            reasons(failures) = reason
         end if
         !$omp critical (sweep_deal)
         shared%done = shared%done + 1
         shown = shared%before + shared%done
         ! of other processes only is known what they were given
         if (rank_count() > 1) shown = min(plan%cases, shared%before + shared%deal%given*plan%part_cases)
         call serve_deal(shared%deal)
         call show_rate(shared%progress, shown)
         !$omp end critical (sweep_deal)
      end do
      allocate (part%failed, source=failed(:failures))
      allocate (part%reasons(failures))
      part%reasons(:) = reasons(:failures)
   end subroutine run_part

   !> The scene with the parameters of a case.
   subroutine scene_of_case(scene, plan, number, one)
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      !> The case, from 1
      integer, intent(in) :: number
      type(scene_t), intent(out) :: one

      character(:), allocatable :: problem
      real(wp) :: values(size(plan%axes))

      one = scene
      call case_values(plan, number, values)
      call set_parameters(one, plan%axes%parameter, values, problem)
   end subroutine scene_of_case

   !> Prepare a runner of the cases of a plan; it keeps measures only.
   subroutine start_plan(scene, plan, runner)
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      type(runner_t), intent(out) :: runner

      call start_runner(scene, output_settings_t(history=.false., measures=.true., most_peaks=peak_count), &
         plan%axes%parameter, plan%axes%least, plan%axes%most, runner)
   end subroutine start_plan

   !> Run a case.
   subroutine run_case(runner, values, row, reason, sets, sections, broken)
      type(runner_t), intent(inout) :: runner
      !> Parameters of the case, in the order of the axes
      real(wp), intent(in) :: values(:)
      !> Its measures, [measure_count]
      real(wp), intent(out) :: row(:)
      !> Why it failed; unallocated: it did not
      character(:), allocatable, intent(out) :: reason
      !> What runs among several stops share; absent: nothing
      type(set_store_t), target, intent(inout), optional :: sets
      !> Its sections; absent: not asked for
      real(wp), intent(inout), optional :: sections(:)
      !> The case that ended the chain; 0 or absent: none did
      integer, intent(in), optional :: broken

      type(response_t) :: response
      type(analysed_t), allocatable :: analysed(:)
      type(failure_t), allocatable :: error

      row = merge(0.0_wp, ieee_value(1.0_wp, ieee_quiet_nan), measure_table%is_whole)
      row(measure_status) = 1.0_wp
      if (present(sections)) sections = ieee_value(1.0_wp, ieee_quiet_nan)
      if (present(broken)) then
         if (broken > 0) then
            !$omp critical (case_scenes)
            reason = 'its chain ended as case '//to_text(broken)//' failed'
            !$omp end critical (case_scenes)
            return
         end if
      end if
      call run_next(runner, values, response, analysed, error, sets, of_run)
      if (allocated(error)) then
         reason = error%message
         return
      end if
      row = row_of(response%measures)
      call fill_row(analysed, row)
      row = row_in(units_in(runner%scene), row)
      if (present(sections) .and. allocated(response%sections)) call keep_sections(response%sections, &
         units_in(runner%scene), sections)
   end subroutine run_case

   !> Sections of a case as results have them.
   pure subroutine keep_sections(kept, units, values)
      type(run_sections_t), intent(in) :: kept
      type(units_t), intent(in) :: units
      !> All values of each, section after section, the last at the end
      real(wp), intent(inout) :: values(:)

      real(wp) :: factor(2)
      integer :: first, k

      factor = 1.0_wp
      if (units%are_of_scene) factor = [units%factor(quantity_named('displacement')), &
         units%factor(quantity_named('velocity'))]
      first = size(values)/section_values - kept%count
      do k = 1, kept%count
         associate (section => values(section_values*(first + k - 1) + 1:section_values*(first + k)))
            if (kept%release_contact > 0) section(1:2) = factor*kept%stop(:, kept%release_contact, k)
            section(3:4) = factor*kept%tip(:, k)
         end associate
      end do
   end subroutine keep_sections

   !> Run some cases that belong to no part, each by any thread.
   subroutine run_cases(scene, plan, values, threads, rows)
      type(scene_t), intent(in) :: scene
      !> Its plan, for the parameters
      type(plan_t), intent(in) :: plan
      !> Parameters of each case, [axes, cases]
      real(wp), intent(in) :: values(:, :)
      integer, intent(in) :: threads
      !> Their measures, [measure_count, cases]
      real(wp), intent(out) :: rows(:, :)

      !$omp parallel num_threads(threads) default(shared)
      call take_cases(scene, plan, values, rows)
      !$omp end parallel
   end subroutine run_cases

   !> What one thread does.
   subroutine take_cases(scene, plan, values, rows)
      type(scene_t), intent(in) :: scene
      !> Its plan, for the parameters
      type(plan_t), intent(in) :: plan
      !> Parameters of each case, [axes, cases]
      real(wp), intent(in) :: values(:, :)
      !> Their measures, [measure_count, cases]
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
   end subroutine take_cases

end module sweep_run
