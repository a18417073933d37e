!> Statements of the paper (Irie, Yamada and Asano 1977), each with its measured values in all variants of computing
!> motion (methods and meshes) and its verdict.
module statement_types
   use kinds, only: wp
   use paper_cases, only: coarse, coarse_nodal, fine, paper_momentum, paper_nodal, variant_count, definition_count
   implicit none (type, external)
   private
   public :: statement_t, add_end_statement, max_text_length
   public :: verdict_of, verdict_names, verdict_in_words, verdict_holds, verdict_fails, verdict_nodal, verdict_coarse
   public :: rank_correlation, listed, percent, number

   !> The statement holds for exact motion on the fine mesh.
   integer, parameter :: verdict_holds = 1
   !> Exact motion meets the condition on neither mesh, and no other verdict applies.
   integer, parameter :: verdict_fails = 2
   !> The statement holds only if an impact replaces the velocity of one node and changes nothing else (in texts for
   !> users: the nodal reading of the paper).
   integer, parameter :: verdict_nodal = 3
   !> The statement holds on the coarse mesh of the paper, but not on the fine mesh.
   integer, parameter :: verdict_coarse = 4
   !> Undecided: for most definitions of the end of motion the condition is met, or the compared values differ by less
   !> than their error.
   integer, parameter :: verdict_tie = 5
   character(*), parameter :: verdict_names(5) = [character(40) :: 'holds', 'does not hold', &
      'holds only under the nodal reading', 'holds only on the coarse mesh', 'tie']

   !> Maximum length of the texts of a statement.
   integer, parameter :: max_text_length = 500

   !> A statement with what was measured.
   type :: statement_t
      !> Number of the statement, such as 4a
      character(4) :: label = ''
      !> Assertion of the paper
      character(max_text_length) :: text = ''
      !> Description of the measured value, then, after '; required: ', the condition on it
      character(max_text_length) :: measure = ''
      !> Value that decides, in each variant; equal in all variants if the statement does not involve motion
      real(wp) :: deciding_value(variant_count) = 0.0_wp
      !> Whether the condition is met in each variant
      logical :: holds(variant_count) = .false.
      !> Further values on the fine mesh
      character(max_text_length) :: detail = ''
      !> Reason of a difference between the paper and the program; empty: none
      character(max_text_length) :: reason = ''
      !> Qualification of the verdict; empty: none
      character(max_text_length) :: remark = ''
      !> Whether the statement is about the end of motion
      logical :: concerns_end = .false.
      !> Number of definitions of the end of motion for which the condition is met, in each variant
      integer :: definitions_met(variant_count) = 0
      !> Number of further definitions for which the compared values are tied, in each variant
      integer :: ties(variant_count) = 0
   end type statement_t

contains

   !> Append a statement about the end of motion. In each variant the statement holds if the condition is met for most
   !> definitions of the end.
   pure subroutine add_end_statement(list, statement, holds, is_tied)
      type(statement_t), allocatable, intent(inout) :: list(:)
      !> The statement without its verdict
      type(statement_t), intent(in) :: statement
      !> Whether the condition is met, for each definition of the end of motion and each variant
      logical, intent(in) :: holds(definition_count, variant_count)
      !> Whether the compared values are tied, so that the condition is not met; absent: ties are not looked for
      logical, intent(in), optional :: is_tied(definition_count, variant_count)

      list = [list, statement]
      associate (new => list(size(list)))
         new%concerns_end = .true.
         new%definitions_met = count(holds, dim=1)
         new%holds = 2*new%definitions_met > definition_count
         if (present(is_tied)) new%ties = count(is_tied, dim=1)
      end associate
   end subroutine add_end_statement

   !> The verdict on a statement. Exact motion on the fine mesh decides. If the condition is not met on this mesh, the
   !> statement is attributed to the replacement of the nodal velocity only if the condition is met by both methods that
   !> replace this velocity on the mesh of the paper, and not by the paper's steps without this replacement.
   pure integer function verdict_of(item) result(verdict)
      type(statement_t), intent(in) :: item

      associate (holds => item%holds)
         if (holds(fine)) then
            verdict = verdict_holds
         else if (item%concerns_end .and. 2*(item%definitions_met(fine) + item%ties(fine)) > definition_count) then
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

   !> The verdict with its qualification, and whether the verdict depends on the definition of the end of motion.
   pure function verdict_in_words(item) result(words)
      type(statement_t), intent(in) :: item
      character(:), allocatable :: words

      integer :: variant, verdict

      verdict = verdict_of(item)
      words = trim(verdict_names(verdict))
      if (item%remark /= '') words = words//', '//trim(item%remark)
      if (.not. item%concerns_end .or. verdict == verdict_tie) return
      variant = fine
      if (verdict == verdict_coarse) variant = coarse
      if (verdict == verdict_nodal) variant = coarse_nodal
      ! a single definition that differs from the others is not mentioned
      if (item%definitions_met(variant) > 1 .and. item%definitions_met(variant) < definition_count - 1) then
         words = words//' (hangs on the definition of the end)'
      end if
   end function verdict_in_words

   !> Kendall's rank correlation of a sequence with its index: the fraction of ascending pairs minus the fraction of
   !> descending pairs.
   pure function rank_correlation(value) result(correlation)
      real(wp), intent(in) :: value(:)
      !> Rank correlation; 1: ascending, -1: descending
      real(wp) :: correlation

      integer :: i, j

      correlation = 0.0_wp
      do i = 1, size(value) - 1
         do j = i + 1, size(value)
            if (value(j) > value(i)) correlation = correlation + 1.0_wp
            if (value(j) < value(i)) correlation = correlation - 1.0_wp
         end do
      end do
      correlation = correlation/(0.5_wp*real(size(value)*(size(value) - 1), wp))
   end function rank_correlation

   !> Text of numbers, separated by commas.
   pure function listed(values, digits) result(text)
      real(wp), intent(in) :: values(:)
      !> Number of decimals
      integer, intent(in) :: digits
      character(:), allocatable :: text

      integer :: i

      text = ''
      do i = 1, size(values)
         if (i > 1) text = text//', '
         text = text//number(values(i), digits)
      end do
   end function listed

   !> Text of a number; 'never' for an instant that is not reached within the run.
   pure function number(value, digits) result(text)
      real(wp), intent(in) :: value
      !> Number of decimals
      integer, intent(in) :: digits
      character(:), allocatable :: text

      character(40) :: buffer, layout

      ! `never` of `paper_cases` is larger
      if (value > 1.0e8_wp) then
         text = 'never'
         return
      end if
      if (digits == 0) then
         write (buffer, '(i0)') nint(value)
      else
         write (layout, '(a,i0,a)') '(f0.', digits, ')'
         write (buffer, layout) value
      end if
      text = trim(buffer)
      if (index(text, '.') == 1) text = '0'//text
      if (index(text, '-.') == 1) text = '-0'//text(2:)
   end function number

   !> Text of a fraction in percent.
   pure function percent(fraction) result(text)
      real(wp), intent(in) :: fraction
      character(:), allocatable :: text

      if (abs(fraction) > 0.0_wp .and. abs(fraction) < 1.0e-4_wp) then
         text = 'under 0.01 %'
      else if (abs(fraction) < 0.01_wp) then
         text = number(100.0_wp*fraction, 2)//' %'
      else
         text = number(100.0_wp*fraction, 1)//' %'
      end if
   end function percent

end module statement_types
