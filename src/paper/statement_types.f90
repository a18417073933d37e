!> A statement of the paper, what was measured of it in every way of computing, and the verdict.
module statement_types
   use kinds, only: wp
   use paper_cases, only: coarse, coarse_nodal, fine, paper_momentum, paper_nodal, way_count
   use paper_outcomes, only: definition_count
   implicit none (type, external)
   private
   public :: statement_t, statements_t, add_statement, add_statement_of_ends, mark_ties
   public :: verdict_of, verdict_names, verdict_in_words, verdict_holds, verdict_fails, verdict_nodal, verdict_coarse
   public :: order, listed, percent, number

   !> It holds for exact motion on the fine mesh.
   integer, parameter :: verdict_holds = 1
   !> It holds for no way, or only where the mesh or the steps are too coarse for it to mean anything.
   integer, parameter :: verdict_fails = 2
   !> It holds only where an impact changes one nodal velocity and nothing else.
   integer, parameter :: verdict_nodal = 3
   !> It holds on the paper's mesh, but not on the fine one.
   integer, parameter :: verdict_coarse = 4
   !> Neither: for most definitions of the end it holds, or what it compares differs by less than is known.
   integer, parameter :: verdict_tie = 5
   character(*), parameter :: verdict_names(5) = [character(40) :: 'holds', 'does not hold', &
      'holds only under the nodal reading', 'holds only on the coarse mesh', 'tie']

   type :: statement_t
      !> Its number, such as 4a
      character(4) :: label = ''
      !> What the paper says
      character(:), allocatable :: text
      !> What was measured, and the condition on it
      character(:), allocatable :: measure
      !> The figure that decides, and whether the condition is met, by way; where the way has no part in it, all the
      !> same
      real(wp) :: figure(way_count) = 0.0_wp
      logical :: holds(way_count) = .false.
      !> The numbers behind it, on the fine mesh
      character(:), allocatable :: detail
      !> Why, where the paper and the program differ
      character(:), allocatable :: reason
      !> The end of the motion counts, and for so many of its definitions the condition is met, by way
      logical :: has_end = .false.
      integer :: definitions(way_count) = 0
      !> and for so many more what it compares is a tie
      integer :: ties(way_count) = 0
      !> What the verdict needs beside it; empty: nothing
      character(:), allocatable :: remark
   end type statement_t

   !> A list that grows.
   type :: statements_t
      type(statement_t), allocatable :: item(:)
   end type statements_t

contains

   !> Append a statement.
   subroutine add_statement(list, label, text, measure, figure, holds, detail, reason, remark)
      type(statements_t), intent(inout) :: list
      !> Parts of the statement
      character(*), intent(in) :: label
      character(*), intent(in) :: text
      character(*), intent(in) :: measure
      real(wp), intent(in) :: figure(way_count)
      logical, intent(in) :: holds(way_count)
      character(*), intent(in) :: detail
      character(*), intent(in) :: reason
      character(*), intent(in), optional :: remark

      type(statement_t), allocatable :: longer(:)
      integer :: n, i

      n = 0
      if (allocated(list%item)) n = size(list%item)
      allocate (longer(n + 1))
      do i = 1, n
         longer(i) = list%item(i)
      end do
      associate (new => longer(n + 1))
         new%label = label
         new%text = text
         new%measure = measure
         new%figure = figure
         new%holds = holds
         new%detail = detail
         new%reason = reason
         new%remark = ''
         if (present(remark)) new%remark = remark
      end associate
      call move_alloc(longer, list%item)
   end subroutine add_statement

   !> Append a statement about the end of the motion: in a way it holds if it does for most definitions of the end.
   subroutine add_statement_of_ends(list, label, text, measure, figure, holds, detail, reason, remark)
      type(statements_t), intent(inout) :: list
      !> Parts of the statement; the condition by definition of the end and way
      character(*), intent(in) :: label
      character(*), intent(in) :: text
      character(*), intent(in) :: measure
      real(wp), intent(in) :: figure(way_count)
      logical, intent(in) :: holds(definition_count, way_count)
      character(*), intent(in) :: detail
      character(*), intent(in) :: reason
      character(*), intent(in), optional :: remark

      call add_statement(list, label, text, measure, figure, 2*count(holds, dim=1) > definition_count, detail, reason, &
         remark)
      associate (new => list%item(size(list%item)))
         new%has_end = .true.
         new%definitions = count(holds, dim=1)
      end associate
   end subroutine add_statement_of_ends

   !> Say of the last statement, one of ends, where it compares what cannot be told apart.
   pure subroutine mark_ties(list, is_tied)
      type(statements_t), intent(inout) :: list
      !> By definition of the end and way; it does not hold there
      logical, intent(in) :: is_tied(definition_count, way_count)

      list%item(size(list%item))%ties = count(is_tied, dim=1)
   end subroutine mark_ties

   !> The verdict on a statement: exact motion on the fine mesh decides. Where it denies, the nodal reading is what the
   !> paper saw only if both ways of computing it on the paper's mesh affirm.
   pure function verdict_of(item) result(verdict)
      type(statement_t), intent(in) :: item
      integer :: verdict

      associate (holds => item%holds)
         if (holds(fine)) then
            verdict = verdict_holds
         else if (item%has_end .and. 2*(item%definitions(fine) + item%ties(fine)) > definition_count) then
            verdict = verdict_tie
         else if (holds(coarse)) then
            verdict = verdict_coarse
         else if (holds(coarse_nodal) .and. holds(paper_nodal) .and. .not. holds(paper_momentum)) then
            verdict = verdict_nodal
         else
            verdict = verdict_fails
         end if
      end associate
   end function verdict_of

   !> The verdict with its remark, and whether it hangs on how the end of the motion is defined.
   pure function verdict_in_words(item) result(words)
      type(statement_t), intent(in) :: item
      character(:), allocatable :: words

      integer :: way, verdict

      verdict = verdict_of(item)
      words = trim(verdict_names(verdict))
      if (item%remark /= '') words = words//', '//item%remark
      if (.not. item%has_end .or. verdict == verdict_tie) return
      way = fine
      if (verdict == verdict_coarse) way = coarse
      if (verdict == verdict_nodal) way = coarse_nodal
      if (item%definitions(way) > 1 .and. item%definitions(way) < definition_count - 1) then
         words = words//' (hangs on the definition of the end)'
      end if
   end function verdict_in_words

   !> How well a sequence is in order: share of the pairs that rise less those that fall (Kendall's rank correlation).
   pure function order(value) result(tau)
      real(wp), intent(in) :: value(:)
      !> 1: it rises, -1: it falls
      real(wp) :: tau

      integer :: i, j

      tau = 0.0_wp
      do i = 1, size(value) - 1
         do j = i + 1, size(value)
            if (value(j) > value(i)) tau = tau + 1.0_wp
            if (value(j) < value(i)) tau = tau - 1.0_wp
         end do
      end do
      tau = tau/(0.5_wp*real(size(value)*(size(value) - 1), wp))
   end function order

   !> Numbers side by side.
   pure function listed(values, digits) result(text)
      real(wp), intent(in) :: values(:)
      !> Digits behind the point
      integer, intent(in) :: digits
      character(:), allocatable :: text

      integer :: i

      text = ''
      do i = 1, size(values)
         if (i > 1) text = text//', '
         text = text//number(values(i), digits)
      end do
   end function listed

   !> A number; what never happens as such.
   pure function number(value, digits) result(text)
      real(wp), intent(in) :: value
      !> Digits behind the point
      integer, intent(in) :: digits
      character(:), allocatable :: text

      character(40) :: room, form

      if (value > 1.0e8_wp) then
         text = 'never'
         return
      end if
      if (digits == 0) then
         write (room, '(i0)') nint(value)
      else
         write (form, '(a,i0,a)') '(f0.', digits, ')'
         write (room, form) value
      end if
      text = trim(room)
      if (index(text, '.') == 1) text = '0'//text
      if (index(text, '-.') == 1) text = '-0'//text(2:)
   end function number

   !> A share in percent.
   pure function percent(share) result(text)
      real(wp), intent(in) :: share
      character(:), allocatable :: text

      if (abs(share) > 0.0_wp .and. abs(share) < 1.0e-4_wp) then
         text = 'under 0.01 %'
      else if (abs(share) < 0.01_wp) then
         text = number(100.0_wp*share, 2)//' %'
      else
         text = number(100.0_wp*share, 1)//' %'
      end if
   end function percent

end module statement_types
