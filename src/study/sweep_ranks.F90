!> The processes that share a sweep, by MPI; without it there is one. The first one hands out the parts, between its own
!> cases; the others ask.
module sweep_ranks
#ifdef IMPACTBEAM_MPI
   use, intrinsic :: iso_fortran_env, only: error_unit
   use mpi_f08, only: mpi_allreduce, mpi_any_source, mpi_barrier, mpi_comm_rank, mpi_comm_size, mpi_comm_world, &
      mpi_finalize, mpi_in_place, mpi_init_thread, mpi_integer, mpi_iprobe, mpi_max, mpi_recv, mpi_send, &
      mpi_status, mpi_status_ignore, mpi_thread_serialized, mpi_probe
#endif
   use number_text, only: to_text
   implicit none (type, external)
   private
   public :: start_ranks, stop_ranks, rank_number, rank_count, is_first_rank, greatest_of_all, deal_t, start_deal, &
      next_of_deal, serve_deal, abandon_deal, finish_deal, ranks_in_words

#ifdef IMPACTBEAM_MPI
   integer, parameter :: tag_question = 1
   integer, parameter :: tag_answer = 2
   logical, protected :: is_started = .false.
#endif

   !> Number of this process, and of all; set once at the start.
   integer, protected :: this_rank = 0
   integer, protected :: all_ranks = 1

   !> Hands out the numbers of a list, each once.
   type :: deal_t
      integer, allocatable :: list(:)
      integer :: given = 0
      !> Other processes that have not been told yet that there are no more
      integer :: asking = 0
      !> This process has been told
      logical :: is_over = .false.
   end type deal_t

contains

   !> Begin, if the program was started by MPI's launcher.
   subroutine start_ranks()
#ifdef IMPACTBEAM_MPI
      integer :: provided

      is_started = any([is_set('OMPI_COMM_WORLD_SIZE'), is_set('PMI_SIZE'), is_set('PMIX_RANK'), is_set('PMI_RANK')])
      if (.not. is_started) return
      call mpi_init_thread(mpi_thread_serialized, provided)
      call mpi_comm_size(mpi_comm_world, all_ranks)
      call mpi_comm_rank(mpi_comm_world, this_rank)
      if (provided >= mpi_thread_serialized) return
      if (this_rank == 0) write (error_unit, &
         '(a)') 'impactbeam: this MPI does not let threads take turns; give --threads 1'
#endif
   end subroutine start_ranks

   !> End.
   subroutine stop_ranks()
#ifdef IMPACTBEAM_MPI
      if (is_started) call mpi_finalize()
#endif
   end subroutine stop_ranks

   !> Number of this process, from 0.
   integer function rank_number()
      rank_number = this_rank
   end function rank_number

   !> Number of processes.
   integer function rank_count()
      rank_count = all_ranks
   end function rank_count

   !> Is this the one that reads, writes and prints?
   logical function is_first_rank()
      is_first_rank = this_rank == 0
   end function is_first_rank

   !> Such as '2 processes'; empty for one.
   function ranks_in_words() result(words)
      character(:), allocatable :: words

      words = ''
      if (all_ranks > 1) words = to_text(all_ranks)//' processes'
   end function ranks_in_words

   !> The greatest value that any process has.
   integer function greatest_of_all(value)
      !> The value of this one
      integer, intent(in) :: value

      greatest_of_all = value
#ifdef IMPACTBEAM_MPI
      if (all_ranks > 1) call mpi_allreduce(mpi_in_place, greatest_of_all, 1, mpi_integer, mpi_max, mpi_comm_world)
#endif
   end function greatest_of_all

   !> Begin to hand out.
   subroutine start_deal(list, deal)
      !> What is handed out; only the first process's counts
      integer, intent(in) :: list(:)
      type(deal_t), intent(out) :: deal

      allocate (deal%list, source=list)
      deal%asking = all_ranks - 1
   end subroutine start_deal

   !> Take one; 0: there are no more. One thread at a time.
   subroutine next_of_deal(deal, number)
      type(deal_t), intent(inout) :: deal
      !> What was taken
      integer, intent(out) :: number

      number = 0
      if (deal%is_over) return
      if (this_rank == 0) then
         call serve_deal(deal)
         call take(deal, number)
      end if
#ifdef IMPACTBEAM_MPI
      if (this_rank > 0) then
         call mpi_send(number, 1, mpi_integer, 0, tag_question, mpi_comm_world)
         call mpi_recv(number, 1, mpi_integer, 0, tag_answer, mpi_comm_world, mpi_status_ignore)
      end if
#endif
      deal%is_over = number == 0
   end subroutine next_of_deal

   !> The next number of the list.
   pure subroutine take(deal, number)
      type(deal_t), intent(inout) :: deal
      !> The number; 0: there are no more
      integer, intent(out) :: number

      number = 0
      if (deal%given >= size(deal%list)) return
      deal%given = deal%given + 1
      number = deal%list(deal%given)
   end subroutine take

   !> Answer the other processes, if any has asked. One thread at a time.
   subroutine serve_deal(deal)
      type(deal_t), intent(inout) :: deal

#ifdef IMPACTBEAM_MPI
      type(mpi_status) :: status
      logical :: is_asked

#endif
      if (this_rank /= 0 .or. deal%asking == 0) return
#ifdef IMPACTBEAM_MPI
      do while (deal%asking > 0)
         call mpi_iprobe(mpi_any_source, tag_question, mpi_comm_world, is_asked, status)
         if (.not. is_asked) return
         call answer(deal, status%mpi_source)
      end do
#endif
   end subroutine serve_deal

   !> Hand out no more, if this is the first process.
   pure subroutine abandon_deal(deal)
      type(deal_t), intent(inout) :: deal

      deal%given = size(deal%list)
   end subroutine abandon_deal

   !> Wait until all processes have nothing more to do.
   subroutine finish_deal(deal)
      type(deal_t), intent(inout) :: deal

#ifdef IMPACTBEAM_MPI
      type(mpi_status) :: status
      integer :: number

      ! a process that stops early takes the rest of what it is given without doing it
      do while (this_rank /= 0 .and. .not. deal%is_over)
         call next_of_deal(deal, number)
      end do
      do while (this_rank == 0 .and. deal%asking > 0)
         call mpi_probe(mpi_any_source, tag_question, mpi_comm_world, status)
         call answer(deal, status%mpi_source)
      end do
      if (all_ranks > 1) call mpi_barrier(mpi_comm_world)
#endif
      deal%is_over = .true.
   end subroutine finish_deal

#ifdef IMPACTBEAM_MPI
   !> Is an environment variable set?
   function is_set(name) result(answer)
      character(*), intent(in) :: name
      logical :: answer

      integer :: length, status

      call get_environment_variable(name, length=length, status=status)
      answer = status == 0 .and. length > 0
   end function is_set

   !> Answer one question.
   subroutine answer(deal, source)
      type(deal_t), intent(inout) :: deal
      !> Who asked
      integer, intent(in) :: source

      integer :: number

      call mpi_recv(number, 1, mpi_integer, source, tag_question, mpi_comm_world, mpi_status_ignore)
      call take(deal, number)
      call mpi_send(number, 1, mpi_integer, source, tag_answer, mpi_comm_world)
      if (number == 0) deal%asking = deal%asking - 1
   end subroutine answer
#endif

end module sweep_ranks
