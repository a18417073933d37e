!> A sweep from its scene to its file and tables.
module sweep_study
   !$ use omp_lib, only: omp_get_max_threads
   use failures, only: fail, failure_t
   use kinds, only: i8, wp
   use number_text, only: to_text
   use scene_types, only: scene_t
   use sweep_best, only: refine, refined_t
   use sweep_file, only: survey_parts, survey_t, write_sweep
   use sweep_parts, only: enter_folder, parts_folder
   use sweep_plan, only: make_plan, plan_t, plan_text
   use sweep_ranks, only: agree, is_first_rank, ranks_in_words
   use sweep_run, only: run_parts
   use sweep_tables, only: print_sweep
   implicit none (type, external)
   private
   public :: run_sweep

contains

   !> Run the sweep of a scene, or the rest of it.
   subroutine run_sweep(scene, folder, version, threads, quiet, unit, error)
      !> The scene; it has &sweep
      type(scene_t), intent(in) :: scene
      !> Folder of the results, which is there; the results file in it is claimed
      character(*), intent(in) :: folder
      !> Version of the program
      character(*), intent(in) :: version
      !> Number of threads; 0: as many as there are cores
      integer, intent(in) :: threads
      !> No table
      logical, intent(in) :: quiet
      !> Where the table goes
      integer, intent(in) :: unit
      !> Why there are no results; the parts that are done stay
      type(failure_t), allocatable, intent(out) :: error

      type(plan_t) :: plan
      type(survey_t) :: survey
      type(refined_t) :: refined
      character(:), allocatable :: path, text
      integer :: workers, fresh, trouble
      integer(i8) :: start, finish, rate

      workers = threads
      if (workers == 0) then
         workers = 1
         !$ workers = omp_get_max_threads()
      end if
      call make_plan(scene, plan)
      call plan_text(scene, plan, version, text)
      path = parts_folder(folder, scene%name)
      trouble = 0
      if (is_first_rank()) call enter_folder(path, text, error)
      if (allocated(error)) trouble = error%status
      trouble = agree(trouble)
      if (trouble > 0) then
         call fail(error, trouble, '')
         return
      end if
      call system_clock(start, rate)
      call run_parts(scene, plan, text, path, workers, scene%name, quiet, fresh, error)
      call system_clock(finish)
      if (allocated(error) .or. .not. is_first_rank()) return
      call survey_parts(path, scene, plan, text, survey, error)
      if (allocated(error)) return
      if (scene%wants_best .and. scene%best%refine) call refine(scene, plan, survey%best, workers, refined)
      call write_sweep(folder, path, version, scene, plan, text, survey, refined, error)
      if (allocated(error) .or. quiet) return
      call print_sweep(unit, scene, plan, survey, refined, fresh, real(finish - start, wp)/real(rate, wp), &
                       in_words(workers, ranks_in_words()))
   end subroutine run_sweep

   !> Such as '2 threads' and '2 threads in each of 4 processes'.
   pure function in_words(threads, processes) result(words)
      !> Number of threads
      integer, intent(in) :: threads
      !> Processes in words; empty: one
      character(*), intent(in) :: processes
      character(:), allocatable :: words

      words = to_text(threads)//trim(merge(' thread ', ' threads', threads == 1))
      if (processes /= '') words = words//' in each of '//processes
   end function in_words

end module sweep_study
