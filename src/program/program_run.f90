!> A whole run of the program: arguments, dispatch, messages and exit status; nothing else. A procedure, so
!> that all it holds is given back before the program stops.
module program_run
   use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
   use command_line, only: argument_t, command_line_t, get_arguments, parse_arguments, program_version, usage
   use failures, only: failure_t
   use scene_echo, only: reference_table
   use scene_run, only: read_scenes, run_scene
   use scene_types, only: scene_t
   use sweep_ranks, only: is_first_rank, start_ranks, stop_ranks
   implicit none (type, external)
   private
   public :: run_program

contains

   !> A run of the program, in one process or several.
   subroutine run_program(status)
      !> Exit status: 0 done, 1 a run failed, 2 bad usage or input
      integer, intent(out) :: status

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
      character(:), allocatable :: names
      integer :: i

      status = 0
      call get_arguments(arguments)
      call parse_arguments(arguments, command, error)
      if (allocated(error)) then
         call report(error%message, error%status, status)
         return
      end if
      if (command%wants_version) write (output_unit, '(a)') 'impactbeam '//program_version
      if (command%wants_help) write (output_unit, '(a)') usage()
      if (command%wants_names) then
         call reference_table(names)
         write (output_unit, '(a)') names
      end if
      if (command%wants_version .or. command%wants_help .or. command%wants_names) return

      call read_scenes(command%scenes, scenes, error)
      if (allocated(error)) then
         call report(error%message, error%status, status)
         return
      end if
      do i = 1, size(scenes)
         if (command%check_only) then
            if (.not. command%quiet .and. is_first_rank()) write (output_unit, '(a)') scenes(i)%file//': good'
            cycle
         end if
         call run_scene(scenes(i), command%folder, command%threads, command%quiet, error)
         if (allocated(error)) call report(scenes(i)%file//': '//error%message, error%status, status)
      end do
   end subroutine run_command_line

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
