!> Calls by which the processes (ranks) that MPI's launcher has started communicate. They are in a library that is
!> loaded only if there are several processes.
module rank_calls
   use, intrinsic :: iso_c_binding, only: c_char, c_f_procpointer, c_funptr, c_int, c_null_char, c_size_t
   use failures, only: fail, failure_t, status_run_failed
   implicit none (type, external)
   private
   public :: load_rank_calls, rank_call, rank_call_t

   abstract interface
      !> A communication call, documented in rank_calls_mpi.c.
      function rank_call_t(value) bind(c) result(answer)
         import :: c_int
         implicit none (type, external)
         integer(c_int), value :: value
         integer(c_int) :: answer
      end function rank_call_t
   end interface

   interface
      ! The following functions are documented in rank_calls_posix.c.
      function impactbeam_load_rank_calls(reason_text, size) bind(c) result(answer)
         import :: c_char, c_int, c_size_t
         implicit none (type, external)
         character(kind=c_char), intent(out) :: reason_text(*)
         integer(c_size_t), value :: size
         integer(c_int) :: answer
      end function impactbeam_load_rank_calls

      function impactbeam_rank_call(name) bind(c) result(address)
         import :: c_char, c_funptr
         implicit none (type, external)
         character(kind=c_char), intent(in) :: name(*)
         type(c_funptr) :: address
      end function impactbeam_rank_call
   end interface

contains

   !> Load the communication calls if the program was started by MPI's launcher and built with MPI.
   subroutine load_rank_calls(are_loaded, error)
      logical, intent(out) :: are_loaded
      !> Set if the calls should exist but cannot be loaded
      type(failure_t), allocatable, intent(inout) :: error

      integer, parameter :: max_length = 500
      character(max_length, c_char) :: reason_text
      integer(c_int) :: answer

      ! -1: the program runs without MPI; 1: loaded; 0: loading failed
      answer = -1_c_int
      reason_text = ''
      if (any([is_set('OMPI_COMM_WORLD_SIZE'), is_set('PMI_SIZE'), is_set('PMIX_RANK'), is_set('PMI_RANK')])) then
         answer = impactbeam_load_rank_calls(reason_text, int(max_length, c_size_t))
      end if
      are_loaded = answer == 1_c_int
      if (answer == 0_c_int) call fail(error, status_run_failed, &
         'started as one of several processes, but the library for their communication is missing: '// &
         reason_text(:index(reason_text, c_null_char) - 1))
   end subroutine load_rank_calls

   !> One of the communication calls that were loaded.
   function rank_call(name) result(call)
      !> Name of the call without the prefix impactbeam_rank_
      character(*), intent(in) :: name
      procedure(rank_call_t), pointer :: call

      call c_f_procpointer(impactbeam_rank_call('impactbeam_rank_'//name//c_null_char), call)
   end function rank_call

   !> Whether an environment variable is set.
   logical function is_set(name) result(answer)
      character(*), intent(in) :: name

      integer :: length, status

      call get_environment_variable(name, length=length, status=status)
      answer = status == 0 .and. length > 0
   end function is_set

end module rank_calls
