!> The statements as text: one block each, with what was measured in every way, and a summary.
module statements_tables
   use kinds, only: wp
   use paper_cases, only: way_count, way_t
   use paper_outcomes, only: definition_count
   use statement_types, only: number, statement_t, statements_t, verdict_in_words, verdict_names, verdict_of
   implicit none (type, external)
   private
   public :: print_statements

   integer, parameter :: width = 116

contains

   !> Print all statements.
   subroutine print_statements(unit, ways, list)
      !> Where to
      integer, intent(in) :: unit
      !> The ways
      type(way_t), intent(in) :: ways(way_count)
      !> The statements
      type(statements_t), intent(in) :: list

      integer :: i, k

      do i = 1, size(list%item)
         associate (item => list%item(i))
            call print_wrapped(unit, trim(item%label), item%text//' -- '//verdict_in_words(item))
            call print_wrapped(unit, '', item%measure//':')
            call print_wrapped(unit, '', figures(item, ways))
            call print_wrapped(unit, '', item%detail)
            if (item%reason /= '') call print_wrapped(unit, '', 'Why: '//item%reason//'.')
            if (item%agreeing > 0) call print_wrapped(unit, '', 'The verdict is the same for '// &
               number(real(item%agreeing, wp), 0)//' of '//number(real(definition_count, wp), 0)//' definitions of the end.')
            write (unit, '(a)') ''
         end associate
      end do
      write (unit, '(a)') 'Verdicts:'
      do k = 1, size(verdict_names)
         write (unit, '(2x, i3, 2x, a)') count([(verdict_of(list%item(i)%holds) == k, i=1, size(list%item))]), &
            trim(verdict_names(k))
      end do
   end subroutine print_statements

   !> The deciding figure by way, each with yes or no.
   function figures(item, ways) result(text)
      !> The statement
      type(statement_t), intent(in) :: item
      !> The ways
      type(way_t), intent(in) :: ways(way_count)
      character(:), allocatable :: text

      integer :: way

      text = ''
      if (maxval(item%figure) - minval(item%figure) <= 0.0_wp .and. (all(item%holds) .or. .not. any(item%holds))) then
         text = in_short(item%figure(1))//trim(merge(' (yes)', ' (no) ', item%holds(1)))
         return
      end if
      do way = 1, way_count
         if (way > 1) text = text//'; '
         text = text//trim(ways(way)%name)//' '//in_short(item%figure(way))//trim(merge(' (yes)', ' (no) ', item%holds(way)))
      end do
   end function figures

   !> Four digits.
   function in_short(value) result(text)
      !> A figure
      real(wp), intent(in) :: value
      character(:), allocatable :: text

      character(16) :: room

      if (abs(value) > 0.0_wp .and. (abs(value) < 1.0e-3_wp .or. abs(value) >= 1.0e5_wp)) then
         write (room, '(es9.2)') value
         text = trim(adjustl(room))
      else
         text = number(value, 4)
      end if
   end function in_short

   !> Print words in lines of the same width, the label in the margin of the first.
   subroutine print_wrapped(unit, label, text)
      !> Where to
      integer, intent(in) :: unit
      !> What stands in the margin
      character(*), intent(in) :: label
      !> The words
      character(*), intent(in) :: text

      character(5) :: margin
      integer :: first, last

      margin = label
      first = 1
      do while (first <= len_trim(text))
         last = len_trim(text)
         if (last - first + 1 > width) then
            last = first + index(text(first:first + width), ' ', back=.true.) - 2
            if (last < first) last = first + width - 1
         end if
         write (unit, '(a, 1x, a)') margin, text(first:last)
         first = last + 1
         do while (first <= len(text))
            if (text(first:first) /= ' ') exit
            first = first + 1
         end do
         margin = ''
      end do
   end subroutine print_wrapped

end module statements_tables
