!> The study of &sweep: computation of all cases, results file and tables.
module sweep_study
!$ use omp_lib, only: omp_get_max_threads, omp_get_num_procs
   use analyses, only: analyse, analysed_t, of_beam, requested
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: i8, wp
   use lapack_interfaces, only: blas_buffer
   use mesh_choice, only: case_beam_t, choose_mesh
   use mesh_errors, only: mesh_errors_t, print_mesh_errors
   use mesh_estimates, only: estimate_cases
   use number_text, only: to_text
   use process, only: free_addresses
   use quantities, only: units_in
   use response_types, only: response_t
   use scene_beam_model, only: run_settings_of
   use scene_types, only: scene_t
   use study_job, only: job_t
   use sweep_best, only: refine, refined_t
   use sweep_chunks, only: open_chunk_folder
   use sweep_file, only: survey_chunks, survey_t, write_sweep
   use sweep_plan, only: make_plan, plan_t, plan_text
   use sweep_ranks, only: max_of_ranks, is_first_rank, rank_count
   use sweep_run, only: run_chunks, sample_plan
   use sweep_settings, only: design_grid, design_latin_hypercube, is_follower, sweep_settings_t, &
      value_count_of
   use sweep_tables, only: print_sweep
   implicit none (type, external)
   private
   public :: run_sweep, run_plan, plan_run_t, threads_for, workers_in_words, case_count_of, chain_count_of, &
      refuse_only_failures

   !> Run of the cases of a plan.
   type :: plan_run_t
      !> Number of threads of each process
      integer :: workers = 1
      !> Number of cases that were computed in this run
      integer :: computed = 0
      !> Time of their computation, seconds
      real(wp) :: seconds = 0.0_wp
   end type plan_run_t

contains

   !> Run the sweep of a scene; chunks that a previous run has completed are not computed again.
   subroutine run_sweep(scene, job, error)
      !> A scene with &sweep
      type(scene_t), intent(in) :: scene
      type(job_t), intent(in) :: job
      !> Set if there are no results, and the completed chunks remain on disk; also if all cases failed, which have
      !> results
      type(failure_t), allocatable, intent(out) :: error

      type(plan_t) :: plan
      type(plan_run_t) :: run
      type(survey_t) :: survey
      type(refined_t) :: refined
      type(mesh_errors_t), allocatable :: errors
      type(case_beam_t) :: beam
      type(response_t) :: none
      type(analysed_t), allocatable :: analysed(:)
      ! cases whose errors are estimated, and their numbers
      type(scene_t), allocatable :: sample(:)
      integer, allocatable :: numbers(:)

      call make_plan(scene, plan)
      allocate (analysed(0))
      if (is_first_rank() .and. any(requested(scene, of_beam))) then
         ! analyses of the beam, for example its frequency response, are independent of the cases and need no run; they
         ! come first, because the parts of the cases would remain after a failure
         call choose_mesh(scene, beam)
         if (allocated(beam%error)) then
            error = beam%error
         else
            call analyse(scene, beam%model, run_settings_of(scene), none, analysed, error, of_beam)
         end if
      end if
      call run_plan(scene, plan, job, run, error)
      if (allocated(error) .or. .not. is_first_rank()) return
      call survey_chunks(scene, plan, survey, error)
      if (allocated(error)) return
      call move_alloc(analysed, survey%analysed)
      if (scene%wants_best .and. scene%best%refine) call refine(scene, plan, survey%best, run%workers, refined)
      if (scene%mesh%estimate) then
         allocate (errors)
         call sample_plan(scene, plan, numbers, sample)
         call estimate_cases(sample, numbers, errors)
      end if
      call write_sweep(job%folder, scene, plan, survey, refined, error, errors)
      if (allocated(error)) return
      call refuse_only_failures(plan, survey, error)
      if (job%quiet) return
      call print_sweep(job%unit, scene, plan, survey, refined, run%computed, run%seconds, &
         workers_in_words(run%workers))
      if (allocated(errors)) call print_mesh_errors(job%unit, errors, units_in(scene))
   end subroutine run_sweep

   !> Report that all cases failed.
   pure subroutine refuse_only_failures(plan, survey, error)
      type(plan_t), intent(in) :: plan
      !> Summary of the cases of the plan
      type(survey_t), intent(in) :: survey
      !> Set if all cases failed
      type(failure_t), allocatable, intent(inout) :: error

      if (survey%failure_count == plan%cases) call fail(error, status_run_failed, 'all '//to_text(plan%cases) &
         //' cases failed, case 1: '//trim(survey%reasons(1)))
   end subroutine refuse_only_failures

   !> Compute the cases of a plan that are not in chunks on disk yet, with threads and processes, and store their rows.
   subroutine run_plan(scene, plan, job, run, error)
      type(scene_t), intent(in) :: scene
      !> On return with its text and the folder of its chunks
      type(plan_t), intent(inout) :: plan
      type(job_t), intent(in) :: job
      type(plan_run_t), intent(out) :: run
      !> On entry set if this process could not plan the cases, which ends all processes; on return set if cases have no
      !> rows; complete chunks remain on disk
      type(failure_t), allocatable, intent(inout) :: error

      character(:), allocatable :: text
      integer :: status
      integer(i8) :: start, finish, rate

      run%workers = threads_for(job%threads, real(plan%cases/max(plan%chain, 1), wp))
      call plan_text(scene, plan, text)
      call move_alloc(text, plan%text)
      plan%path = job%folder//'/'//scene%name//'.parts'
      status = 0
      if (is_first_rank() .and. .not. allocated(error)) call open_chunk_folder(plan%path, plan%text, error)
      if (allocated(error)) status = error%status
      status = max_of_ranks(status)
      if (status > 0) then
         call fail(error, status, '')
         return
      end if
      call system_clock(start, rate)
      call run_chunks(scene, plan, run%workers, scene%name, job%quiet, run%computed, error)
      call system_clock(finish)
      run%seconds = real(finish - start, wp)/real(rate, wp)
   end subroutine run_plan

   !> Number of threads of a sweep: the requested number, but at most the number of independent cases (or chains of
   !> cases), four for each core, and the number for which there is address space.
   integer function threads_for(requested, chains) result(threads)
      !> Requested number; 0: the default of OpenMP, one for each core unless OMP_NUM_THREADS is set
      integer, intent(in) :: requested
      !> Number of independent cases, or of chains of cases
      real(wp), intent(in) :: chains

      ! stack of a thread, and address space that the C library reserves for the memory of a thread, bytes
      real(wp), parameter :: space_of_a_thread = 8.4e6_wp + 1.35e8_wp
      ! number of threads that fit into half of the free address space
      real(wp) :: max_threads

      threads = max(requested, 1)
!$    if (requested == 0) threads = omp_get_max_threads()
!$    threads = min(threads, 4*omp_get_num_procs())
      threads = int(min(real(threads, wp), max(chains, 1.0_wp)))
      max_threads = 0.5_wp*free_addresses()/(space_of_a_thread + real(blas_buffer(), wp))
      threads = int(min(real(threads, wp), 1.0_wp + max_threads))
   end function threads_for

   !> Number of chains of a checked sweep, or of cases if they are independent.
   pure real(wp) function chain_count_of(sweep) result(chains)
      type(sweep_settings_t), intent(in) :: sweep

      chains = case_count_of(sweep)
      if (sweep%carry > 0) chains = chains/real(value_count_of(sweep, sweep%carry), wp)
   end function chain_count_of

   !> Number of cases of a checked sweep, as a real number, because it may exceed the range of integers.
   pure real(wp) function case_count_of(sweep) result(cases)
      type(sweep_settings_t), intent(in) :: sweep

      integer :: k, values

      cases = 1.0_wp
      if (sweep%design == design_latin_hypercube) cases = real(sweep%count, wp)
      do k = 1, size(sweep%swept)
         values = value_count_of(sweep, k)
         if (sweep%design == design_grid .and. .not. is_follower(sweep, k)) cases = cases*real(values, wp)
         if (sweep%design /= design_latin_hypercube) cases = max(cases, real(values, wp))
      end do
   end function case_count_of

   !> Threads and processes in words, such as '2 threads' and '2 threads in each of 4 processes'.
   function workers_in_words(threads) result(words)
      integer, intent(in) :: threads
      character(:), allocatable :: words

      words = to_text(threads)//trim(merge(' thread ', ' threads', threads == 1))
      if (rank_count() > 1) words = words//' in each of '//to_text(rank_count())//' processes'
   end function workers_in_words

end module sweep_study
