!> Lines with labels, and columns of text.
module text_columns
   use kinds, only: i8, wp
   use printable_text, only: character_count
   implicit none (type, external)
   private
   public :: print_line, print_columns, fixed, at_right, label_width

   !> Width of the labels at the left.
   integer, parameter :: label_width = 20

contains

   !> A label and what belongs to it.
   subroutine print_line(unit, label, words)
      integer, intent(in) :: unit
      character(*), intent(in) :: label
      !> What belongs to it
      character(*), intent(in) :: words

      character(max(label_width, len_trim(label) + 1)) :: padded

      padded = label
      write (unit, '(2x, a, a)') padded, words
   end subroutine print_line

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
