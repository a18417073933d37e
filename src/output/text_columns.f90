!> Lines with labels, and columns of text.
module text_columns
   use kinds, only: i8, wp
   use printable_text, only: character_count
   implicit none (type, external)
   private
   public :: print_line, print_columns, fixed, at_right, label_width

   !> Width of the labels at the left, and of all.
   integer, parameter :: label_width = 20, page_width = 80

contains

   !> A label and what belongs to it, in as many lines as it takes.
   subroutine print_line(unit, label, words)
      integer, intent(in) :: unit
      character(*), intent(in) :: label
      !> What belongs to it
      character(*), intent(in) :: words

      character(max(label_width, len_trim(label) + 1)) :: padded
      integer :: first, last

      padded = label
      first = 1
      do
         last = first - 1 + end_of_line(words(first:), page_width - 2 - len(padded))
         write (unit, '(2x, a, a)') padded, trim(words(first:last))
         if (last >= len(words)) exit
         first = last + 1
         padded = ''
      end do
   end subroutine print_line

   !> Where a text is to be broken: behind the last comma or colon that fits, else at the last blank, else at the first.
   pure function end_of_line(words, width) result(last)
      character(*), intent(in) :: words
      !> Characters that a line has
      integer, intent(in) :: width
      integer :: last

      integer :: i
      logical :: is_at_comma

      last = len(words)
      if (character_count(words) <= width) return
      is_at_comma = .false.
      do i = 2, len(words) - 1
         if (words(i:i) /= ' ') cycle
         if (last < len(words) .and. character_count(words(:i - 1)) > width) return
         if (is_at_comma .and. scan(words(i - 1:i - 1), ',:;') == 0) cycle
         is_at_comma = scan(words(i - 1:i - 1), ',:;') > 0
         last = i
      end do
   end function end_of_line

   !> Columns as wide as what stands in them, under headings of two lines.
   subroutine print_columns(unit, headings, cells)
      integer, intent(in) :: unit
      !> [columns]
      character(*), intent(in) :: headings(:)
      !> [columns, rows]
      character(*), intent(in) :: cells(:, :)

      character(max(len(cells), len(headings))) :: lines(size(headings), size(cells, 2) + 2)
      character(:), allocatable :: line
      integer :: i, k, widths(size(headings))

      do k = 1, size(headings)
         call split_heading(trim(headings(k)), lines(k, 1), lines(k, 2))
      end do
      lines(:, 3:) = cells
      do k = 1, size(headings)
         widths(k) = maxval([(max(0, character_count(trim(lines(k, i)))), i=1, size(lines, 2))])
      end do
      do i = 1, size(lines, 2)
         line = ''
         do k = 1, size(headings)
            line = line//'  '//at_right(lines(k, i), widths(k))
         end do
         write (unit, '(a)') line
      end do
   end subroutine print_columns

   !> At the blank that makes the longer half shortest; without any all of it belongs below.
   pure subroutine split_heading(heading, upper, lower)
      character(*), intent(in) :: heading
      character(*), intent(out) :: upper
      character(*), intent(out) :: lower

      integer :: i, place

      place = 0
      do i = 1, len(heading)
         if (heading(i:i) == ' ' .and. max(i, len(heading) - i) < max(place, len(heading) - place)) place = i
      end do
      upper = heading(:place)
      lower = heading(place + 1:)
   end subroutine split_heading

   !> A number with so many decimals; with an exponent if it is too large for that.
   pure function fixed(value, decimals) result(text)
      real(wp), intent(in) :: value
      !> Digits behind the point
      integer, intent(in) :: decimals
      character(:), allocatable :: text

      real(wp), parameter :: largest = 1.0e6_wp
      character(32) :: buffer, layout

      if (abs(value) < largest) then
         write (layout, '(a, i0, a)') '(f24.', decimals, ')'
      else
         write (layout, '(a, i0, a)') '(es24.', decimals, ')'
      end if
      write (buffer, layout) value
      text = trim(adjustl(buffer))
   end function fixed

   !> A text at the right of a column of any width.
   pure function at_right(text, width) result(cell)
      character(*), intent(in) :: text
      integer, intent(in) :: width
      character(:), allocatable :: cell

      cell = repeat(' ', int(max(0, width - character_count(trim(text))), i8))//trim(text)
   end function at_right

end module text_columns
