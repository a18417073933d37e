!> The processes that share a sweep, by MPI; without it there is one. The first one hands out the parts, between its own
!> cases; the others ask.
module sweep_ranks
   use, intrinsic :: iso_fortran_env, only: error_unit
   use failures, only: failure_t
   use number_text, only: to_text
   use rank_calls, only: load_rank_calls, rank_call, rank_call_t
   implicit none (type, external)
   private
   public :: start_ranks, stop_ranks, rank_number, rank_count, is_first_rank, greatest_of_all, deal_t, start_deal, &
      next_of_deal, serve_deal, abandon_deal, finish_deal, ranks_in_words

   !> Number of this process, and of all; set once at the start.
   integer, protected :: this_rank = 0
   integer, protected :: all_ranks = 1

   !> How to talk to the others; not associated: there are none.
   procedure(rank_call_t), pointer :: ask => null(), is_asked => null(), answer => null(), meet => null(), &
      greatest => null(), leave => null()

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
   subroutine start_ranks(error)
      !> Set where the others cannot be talked to
      type(failure_t), allocatable, intent(inout) :: error

      procedure(rank_call_t), pointer :: start, number, count
      logical :: are_loaded, take_turns

      call load_rank_calls(are_loaded, error)
      if (.not. are_loaded) return
      start => rank_call('start')
      number => rank_call('number')
      count => rank_call('count')
      ask => rank_call('ask')
      is_asked => rank_call('is_asked')
      answer => rank_call('answer')
      meet => rank_call('meet')
      greatest => rank_call('greatest')
      leave => rank_call('stop')
      take_turns = start(0) == 1
      this_rank = number(0)
      all_ranks = count(0)
      if (this_rank == 0 .and. .not. take_turns) write (error_unit, &
         '(a)') 'impactbeam: this MPI does not let threads take turns; give --threads 1'
   end subroutine start_ranks

   !> End.
   subroutine stop_ranks()
      integer :: nothing

      if (associated(leave)) nothing = leave(0)
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
      if (all_ranks > 1) greatest_of_all = greatest(value)
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
      else
         number = ask(0)
      end if
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

      if (this_rank /= 0) return
      do while (deal%asking > 0)
         if (is_asked(0) == 0) exit
         call answer_one(deal)
      end do
   end subroutine serve_deal

   !> Hand out no more, if this is the first process.
   pure subroutine abandon_deal(deal)
      type(deal_t), intent(inout) :: deal

      deal%given = size(deal%list)
   end subroutine abandon_deal

   !> Wait until all processes have nothing more to do.
   subroutine finish_deal(deal)
      type(deal_t), intent(inout) :: deal

      integer :: number

      ! a process that stops early takes the rest of what it is given without doing it
      do while (this_rank /= 0 .and. .not. deal%is_over)
         call next_of_deal(deal, number)
      end do
      do while (this_rank == 0 .and. deal%asking > 0)
         number = is_asked(1)
         call answer_one(deal)
      end do
      if (all_ranks > 1) number = meet(0)
      deal%is_over = .true.
   end subroutine finish_deal

   !> Answer one question.
   subroutine answer_one(deal)
      type(deal_t), intent(inout) :: deal

      integer :: number, nothing

      call take(deal, number)
      nothing = answer(number)
      if (number == 0) deal%asking = deal%asking - 1
   end subroutine answer_one

end module sweep_ranks
