!> An error that procedures return to their caller instead of stopping the program: an allocatable, unallocated if there
!> is no error. Only the run of a program (`program_run`) prints it and sets the exit status.
module failures
   implicit none (type, external)
   private
   public :: failure_t, fail, status_run_failed, status_bad_input

   !> Exit status if a run failed.
   integer, parameter :: status_run_failed = 1
   !> Exit status if usage or input is wrong.
   integer, parameter :: status_bad_input = 2

   !> An error.
   type :: failure_t
      !> Exit status of the program
      integer :: status = status_run_failed
      !> One or more sentences for the user; lines are separated by new_line('a')
      character(:), allocatable :: message
   end type failure_t

contains

   !> Set `error` to a failure, unless it already has one: the first failure counts.
   pure subroutine fail(error, status, message)
      type(failure_t), allocatable, intent(inout) :: error
      !> `status_run_failed` or `status_bad_input`
      integer, intent(in) :: status
      !> Message for the user
      character(*), intent(in) :: message

      if (allocated(error)) return
      allocate (error)
      error%status = status
      error%message = message
   end subroutine fail

end module failures
