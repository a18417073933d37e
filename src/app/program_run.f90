!> A whole run of the program: arguments, dispatch, messages and exit status; nothing else. A procedure, so
!> that all it holds is given back before the program stops.
module program_run
   use, intrinsic :: iso_fortran_env, only: error_unit
   use blas_threads, only: single_threaded_blas
   use command_line, only: argument_t, command_line_t, get_arguments, parse_arguments, program_version, usage
   use failures, only: fail, failure_t, status_bad_input
   use process, only: prepare_process, print_text
   use scene_echo, only: reference_table
   use scene_needs, only: check_needs
   use scene_run, only: read_scenes, run_scene
   use scene_types, only: scene_t
   use sweep_ranks, only: agree, is_first_rank, start_ranks, stop_ranks
   implicit none (type, external)
   private
   public :: run_program

contains

   !> A run of the program, in one process or several.
   subroutine run_program(status)
      !> Exit status: 0 done, 1 a run failed, 2 bad usage or input
      integer, intent(out) :: status

      call prepare_process()
      call single_threaded_blas()
      call start_ranks()
      call run_command_line(status)
      call stop_ranks()
   end subroutine run_program

   !> Do what the command line asks for.
   subroutine run_command_line(status)
      !> Exit status: 0 done, 1 a run failed, 2 bad usage or input
      integer, intent(out) :: status

      type(argument_t), allocatable :: arguments(:)
      type(command_line_t) :: command
      type(scene_t), allocatable :: scenes(:)
      type(failure_t), allocatable :: error
      integer :: i

      status = 0
      call get_arguments(arguments)
      call parse_arguments(arguments, command, error)
      if (allocated(error)) then
         call report(error%message, error%status, status)
         return
      end if
      if (command%wants_version .or. command%wants_help .or. command%wants_names) then
         call print_answers(command, error)
         if (allocated(error)) call report(error%message, error%status, status)
         return
      end if
      call read_scenes(command%scenes, scenes, error)
      if (.not. allocated(error)) call check_all_needs(scenes, command%threads, error)
      if (allocated(error)) then
         call report(error%message, error%status, status)
         return
      end if
      do i = 1, size(scenes)
         if (command%check_only) then
            call check_scene(scenes(i), command%quiet, error)
         else
            call run_scene(scenes(i), command%folder, command%threads, command%quiet, error)
         end if
         if (allocated(error)) call report(scenes(i)%file//': '//error%message, error%status, status)
      end do
   end subroutine run_command_line

   !> Is there room for each scene? Processes may see different rooms: the first one decides.
   subroutine check_all_needs(scenes, threads, error)
      !> The scenes
      type(scene_t), intent(in) :: scenes(:)
      !> Threads of a sweep; 0: as many as there are cores
      integer, intent(in) :: threads
      !> Set by the first scene that does not fit
      type(failure_t), allocatable, intent(inout) :: error

      type(failure_t), allocatable :: refusal
      integer :: i

      do i = 1, size(scenes)
         if (.not. is_first_rank()) exit
         call check_needs(scenes(i), threads, refusal)
         if (.not. allocated(refusal)) cycle
         call fail(error, refusal%status, scenes(i)%file//': '//refusal%message)
         exit
      end do
      if (agree(merge(1, 0, allocated(error))) > 0) call fail(error, status_bad_input, 'a scene was refused')
   end subroutine check_all_needs

   !> Print what the command line asks about the program.
   subroutine print_answers(command, error)
      !> The command line
      type(command_line_t), intent(in) :: command
      !> Why it could not be printed
      type(failure_t), allocatable, intent(inout) :: error

      character, parameter :: next = new_line('a')
      character(:), allocatable :: names, text

      if (.not. is_first_rank()) return
      text = ''
      if (command%wants_version) text = text//'impactbeam '//program_version//next
      if (command%wants_help) text = text//usage()//next
      if (command%wants_names) then
         call reference_table(names)
         text = text//names//next
      end if
      call print_text(text, error)
   end subroutine print_answers

   !> Say that a scene is good.
   subroutine check_scene(scene, quiet, error)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Say nothing
      logical, intent(in) :: quiet
      !> Why it could not be said
      type(failure_t), allocatable, intent(inout) :: error

      if (.not. quiet .and. is_first_rank()) call print_text(scene%file//': good'//new_line('a'), error)
   end subroutine check_scene

   !> Print a failure; the gravest status stays.
   subroutine report(message, found, status)
      !> What happened
      character(*), intent(in) :: message
      !> Its status
      integer, intent(in) :: found
      !> Status so far
      integer, intent(inout) :: status

      if (is_first_rank()) write (error_unit, '(a)') 'impactbeam: '//message
      status = max(status, found)
   end subroutine report

end module program_run
