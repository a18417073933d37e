!> The error that goes up instead of stopping the program: an allocatable that stays unallocated
!> while all is well. Only the main program prints it and sets the exit status.
module failures
   implicit none (type, external)
   private
   public :: failure_t, fail, status_run_failed, status_bad_input

   !> Exit status of a run that failed.
   integer, parameter :: status_run_failed = 1
   !> Exit status of bad usage or bad input.
   integer, parameter :: status_bad_input = 2

   type :: failure_t
      !> What the program's exit status becomes.
      integer :: status = status_run_failed
      !> One sentence or more for the user; lines separated by new_line('a').
      character(:), allocatable :: message
   end type failure_t

contains

   !> Set `error` to a failure. A failure that is already there is kept: the first one counts.
   pure subroutine fail(error, status, message)
      type(failure_t), allocatable, intent(inout) :: error
      !> `status_run_failed` or `status_bad_input`
      integer, intent(in) :: status
      !> What the user reads
      character(*), intent(in) :: message

      if (allocated(error)) return
      allocate (error)
      error%status = status
      error%message = message
   end subroutine fail

end module failures
