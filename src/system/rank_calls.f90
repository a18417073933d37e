!> What the processes that MPI's launcher has started say to each other.
module rank_calls
   use, intrinsic :: iso_c_binding, only: c_char, c_f_procpointer, c_funptr, c_int, c_null_char, c_size_t
   use failures, only: fail, failure_t, status_run_failed
   implicit none (type, external)
   private
   public :: load_rank_calls, rank_call, rank_call_t

   abstract interface
      !> A call, as rank_calls_mpi.c tells.
      function rank_call_t(value) bind(c) result(answer)
         import :: c_int
         implicit none (type, external)
         integer(c_int), value :: value
         integer(c_int) :: answer
      end function rank_call_t
   end interface

   interface
      ! These are explained in rank_calls_posix.c.
      function impactbeam_load_rank_calls(why, size) bind(c) result(answer)
         import :: c_char, c_int, c_size_t
         implicit none (type, external)
         character(kind=c_char), intent(out) :: why(*)
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

   !> Load the calls, if the program was started by MPI's launcher and built with MPI.
   subroutine load_rank_calls(are_loaded, error)
      logical, intent(out) :: are_loaded
      !> Set where they should be there and are not
      type(failure_t), allocatable, intent(inout) :: error

      integer, parameter :: longest = 500
      character(longest, c_char) :: why
      integer(c_int) :: answer

      answer = -1_c_int
      why = ''
      if (any([is_set('OMPI_COMM_WORLD_SIZE'), is_set('PMI_SIZE'), is_set('PMIX_RANK'), is_set('PMI_RANK')])) then
         answer = impactbeam_load_rank_calls(why, int(longest, c_size_t))
      end if
      are_loaded = answer == 1_c_int
      if (answer == 0_c_int) call fail(error, status_run_failed, &
         'started as one of several processes, but what talks to the others is missing: '// &
         why(:index(why, c_null_char) - 1))
   end subroutine load_rank_calls

   !> One of the calls that were loaded.
   function rank_call(name) result(call)
      !> What follows impactbeam_rank_ in its name
      character(*), intent(in) :: name
      procedure(rank_call_t), pointer :: call

      call c_f_procpointer(impactbeam_rank_call('impactbeam_rank_'//name//c_null_char), call)
   end function rank_call

   !> Is an environment variable set?
   function is_set(name) result(answer)
      character(*), intent(in) :: name
      logical :: answer

      integer :: length, status

      call get_environment_variable(name, length=length, status=status)
      answer = status == 0 .and. length > 0
   end function is_set

end module rank_calls
