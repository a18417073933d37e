!> impactbeam: arguments, dispatch, messages and exit status; nothing else.
program impactbeam
   use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
   use command_line, only: argument_t, command_line_t, get_arguments, parse_arguments, program_version, usage
   use failures, only: failure_t
   use scene_run, only: read_scenes, run_scene
   use scene_types, only: scene_t
   implicit none (type, external)

   type(argument_t), allocatable :: arguments(:)
   type(command_line_t) :: command
   type(scene_t), allocatable :: scenes(:)
   type(failure_t), allocatable :: error
   integer :: i, failed

   call get_arguments(arguments)
   call parse_arguments(arguments, command, error)
   if (allocated(error)) call leave(error)
   if (command%wants_help .or. command%wants_version) then
      if (command%wants_version) write (output_unit, '(a)') 'impactbeam '//program_version
      if (command%wants_help) write (output_unit, '(a)') usage()
      stop
   end if

   call read_scenes(command%scenes, scenes, error)
   if (allocated(error)) call leave(error)
   if (command%check_only) then
      if (.not. command%quiet) then
         do i = 1, size(scenes)
            write (output_unit, '(a)') scenes(i)%file//': good'
         end do
      end if
      stop
   end if

   failed = 0
   do i = 1, size(scenes)
      call run_scene(scenes(i), command%folder, command%quiet, error)
      if (.not. allocated(error)) cycle
      write (error_unit, '(a)') 'impactbeam: '//scenes(i)%file//': '//error%message
      failed = max(failed, error%status)
   end do
   if (failed /= 0) stop failed, quiet=.true.

contains

   !> Print a failure and stop with its status.
   subroutine leave(failure)
      !> The failure
      type(failure_t), intent(in) :: failure

      write (error_unit, '(a)') 'impactbeam: '//failure%message
      stop failure%status, quiet=.true.
   end subroutine leave

end program impactbeam
