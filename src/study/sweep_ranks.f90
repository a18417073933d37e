!> The MPI processes (ranks) that share a sweep; without MPI there is one process. The first process assigns the numbers
!> of the chunks to all processes from a queue, between the cases that it runs itself; the other processes request
!> numbers from the first process.
module sweep_ranks
   use, intrinsic :: iso_fortran_env, only: error_unit
   use failures, only: failure_t
   use rank_calls, only: load_rank_calls, rank_call, rank_call_t
   implicit none (type, external)
   private
   public :: start_ranks, stop_ranks, rank_number, rank_count, is_first_rank, max_of_ranks, queue_t, start_queue, &
      next_of_queue, serve_queue, clear_queue, finish_queue

   !> Number of this process, from 0; set once at the start.
   integer, protected :: this_rank = 0
   !> Number of processes; set once at the start.
   integer, protected :: rank_total = 1

   !> Procedures that call MPI (rank_calls_mpi.c); not associated: there is only this process. The result of
   !> `has_request(waits)` is 1 if another process has requested a number, else 0; with waits = 1 the call waits until
   !> another process has requested a number. `answer(number)` sends the number to the process whose request
   !> `has_request` found. `request(0)` requests a number from the first process and waits for the answer. `barrier(0)`
   !> waits for all processes, `maximum(value)` returns the maximum over all processes, and `stop_mpi(0)` finalises MPI.
   procedure(rank_call_t), pointer :: request => null(), has_request => null(), answer => null(), barrier => null(), &
      maximum => null(), stop_mpi => null()

   !> A queue of numbers, each of which is assigned once to a process.
   type :: queue_t
      !> The numbers
      integer, allocatable :: list(:)
      !> How many of the numbers have been assigned
      integer :: assigned = 0
      !> Number of other processes that do not know yet that all numbers are assigned
      integer :: uninformed = 0
      !> Whether this process knows that all numbers are assigned
      logical :: is_over = .false.
   end type queue_t

contains

   !> Initialise MPI, if the program was started by the MPI launcher.
   subroutine start_ranks(error)
      !> Set if the library with the MPI calls cannot be loaded
      type(failure_t), allocatable, intent(inout) :: error

      procedure(rank_call_t), pointer :: start, number, count
      logical :: are_loaded, allows_threads

      call load_rank_calls(are_loaded, error)
      if (.not. are_loaded) return
      start => rank_call('start')
      number => rank_call('number')
      count => rank_call('count')
      request => rank_call('ask')
      has_request => rank_call('is_asked')
      answer => rank_call('answer')
      barrier => rank_call('meet')
      maximum => rank_call('greatest')
      stop_mpi => rank_call('stop')
      ! 1: MPI provides MPI_THREAD_SERIALIZED, so that any thread may call MPI if no two threads call it at once
      allows_threads = start(0) == 1
      this_rank = number(0)
      rank_total = count(0)
      if (this_rank == 0 .and. .not. allows_threads) write (error_unit, &
         '(a)') 'impactbeam: this MPI does not let several threads call it; give --threads 1'
   end subroutine start_ranks

   !> Finalise MPI.
   subroutine stop_ranks()
      integer :: unused_result

      if (associated(stop_mpi)) unused_result = stop_mpi(0)
   end subroutine stop_ranks

   !> Number of this process, from 0.
   integer function rank_number()
      rank_number = this_rank
   end function rank_number

   !> Number of processes.
   integer function rank_count()
      rank_count = rank_total
   end function rank_count

   !> Whether this is the first process, which alone writes results files and prints. All processes read the scenes and
   !> write the chunks of cases that they run.
   logical function is_first_rank()
      is_first_rank = this_rank == 0
   end function is_first_rank

   !> Maximum of a value over all processes.
   integer function max_of_ranks(value)
      !> Value of this process
      integer, intent(in) :: value

      max_of_ranks = value
      if (rank_total > 1) max_of_ranks = maximum(value)
   end function max_of_ranks

   !> Initialise a queue.
   subroutine start_queue(list, queue)
      !> Numbers of the queue; only those of the first process are used
      integer, intent(in) :: list(:)
      type(queue_t), intent(out) :: queue

      allocate (queue%list, source=list)
      queue%uninformed = rank_total - 1
   end subroutine start_queue

   !> Get the next number of the queue. Only one thread may call this procedure at a time.
   subroutine next_of_queue(queue, number)
      type(queue_t), intent(inout) :: queue
      !> The number; 0: all numbers are assigned
      integer, intent(out) :: number

      number = 0
      if (queue%is_over) return
      if (this_rank == 0) then
         call serve_queue(queue)
         call assign_next(queue, number)
      else
         number = request(0)
      end if
      queue%is_over = number == 0
   end subroutine next_of_queue

   !> Assign the next number of the queue; called in the first process.
   pure subroutine assign_next(queue, number)
      type(queue_t), intent(inout) :: queue
      !> The number; 0: all numbers are assigned
      integer, intent(out) :: number

      number = 0
      if (queue%assigned >= size(queue%list)) return
      queue%assigned = queue%assigned + 1
      number = queue%list(queue%assigned)
   end subroutine assign_next

   !> Answer the pending requests of the other processes. Only one thread may call this procedure at a time.
   subroutine serve_queue(queue)
      type(queue_t), intent(inout) :: queue

      if (this_rank /= 0) return
      do while (queue%uninformed > 0)
         if (has_request(0) == 0) exit
         call answer_one(queue)
      end do
   end subroutine serve_queue

   !> End a queue early: the remaining numbers are not assigned.
   pure subroutine clear_queue(queue)
      type(queue_t), intent(inout) :: queue

      queue%assigned = size(queue%list)
   end subroutine clear_queue

   !> Wait until no process has any more work.
   subroutine finish_queue(queue)
      type(queue_t), intent(inout) :: queue

      integer :: number

      ! a process whose chunk could not be written (the sweep then fails) takes further numbers without computing them,
      ! so that the first process can end
      do while (this_rank /= 0 .and. .not. queue%is_over)
         call next_of_queue(queue, number)
      end do
      do while (this_rank == 0 .and. queue%uninformed > 0)
         number = has_request(1)
         call answer_one(queue)
      end do
      if (rank_total > 1) number = barrier(0)
      queue%is_over = .true.
   end subroutine finish_queue

   !> Answer one request.
   subroutine answer_one(queue)
      type(queue_t), intent(inout) :: queue

      integer :: number, unused_result

      call assign_next(queue, number)
      unused_result = answer(number)
      if (number == 0) queue%uninformed = queue%uninformed - 1
   end subroutine answer_one

end module sweep_ranks
