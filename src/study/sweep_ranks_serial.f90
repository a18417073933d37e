!> The processes that share a sweep: here, without MPI, there is one.
module sweep_ranks
   implicit none (type, external)
   private
   public :: start_ranks, stop_ranks, rank_number, rank_count, is_first_rank, greatest_of_all, deal_t, start_deal, &
      next_of_deal, serve_deal, abandon_deal, finish_deal, ranks_in_words

   !> Hands out the numbers of a list, each once.
   type :: deal_t
      integer, allocatable :: list(:)
      integer :: given = 0
   end type deal_t

contains

   !> Begin.
   subroutine start_ranks()
   end subroutine start_ranks

   !> End.
   subroutine stop_ranks()
   end subroutine stop_ranks

   !> Number of this process, from 0.
   integer function rank_number()
      rank_number = 0
   end function rank_number

   !> Number of processes.
   integer function rank_count()
      rank_count = 1
   end function rank_count

   !> Is this the one that reads, writes and prints?
   logical function is_first_rank()
      is_first_rank = .true.
   end function is_first_rank

   !> Such as '2 processes'; empty without MPI.
   function ranks_in_words() result(words)
      character(:), allocatable :: words

      words = ''
   end function ranks_in_words

   !> The greatest value that any process has.
   integer function greatest_of_all(value)
      !> The value of this one
      integer, intent(in) :: value

      greatest_of_all = value
   end function greatest_of_all

   !> Begin to hand out.
   subroutine start_deal(list, deal)
      !> What is handed out; only the first process's counts
      integer, intent(in) :: list(:)
      type(deal_t), intent(out) :: deal

      allocate (deal%list, source=list)
   end subroutine start_deal

   !> Take one; 0: there are no more. One thread at a time.
   subroutine next_of_deal(deal, number)
      type(deal_t), intent(inout) :: deal
      !> What was taken
      integer, intent(out) :: number

      number = 0
      if (deal%given == size(deal%list)) return
      deal%given = deal%given + 1
      number = deal%list(deal%given)
   end subroutine next_of_deal

   !> Answer the other processes, if any has asked. One thread at a time.
   subroutine serve_deal(deal)
      type(deal_t), intent(inout) :: deal

      associate (unused => deal)
      end associate
   end subroutine serve_deal

   !> Hand out no more, if this is the first process.
   pure subroutine abandon_deal(deal)
      type(deal_t), intent(inout) :: deal

      deal%given = size(deal%list)
   end subroutine abandon_deal

   !> Wait until all processes have nothing more to do.
   subroutine finish_deal(deal)
      type(deal_t), intent(inout) :: deal

      associate (unused => deal)
      end associate
   end subroutine finish_deal

end module sweep_ranks
