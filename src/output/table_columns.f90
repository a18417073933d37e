!> Tables of numbers and texts, and printing them on a terminal. The module `table_texts` writes the same tables to
!> files.
module table_columns
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use kinds, only: i8, wp
   use number_text, only: rounded, to_text
   use printable_text, only: occurrences, character_count
   use reader_units, only: choose_prefix, with_decimals
   implicit none (type, external)
   private
   public :: column_t, table_t, add_numbers, add_texts, print_line, print_table, print_title, rows_of
   public :: whole, six_digits, two_digits, percent, all_digits, with_two_digits

   character, parameter :: line_end = new_line('a')
   !> Maximum length of the text in a cell.
   integer, parameter :: max_text_length = 200
   !> Maximum length of a heading.
   integer, parameter :: max_heading_length = 120
   !> Width of the label before a line of text
   integer, parameter :: label_width = 20
   !> Width of a line on a terminal
   integer, parameter :: page_width = 80
   !> Maximum width of a heading that is never broken into two lines
   integer, parameter :: short_heading = 8
   ! The following constants are formats of numbers on a terminal; a positive format is a number of decimals.
   !> Format: a whole number.
   integer, parameter :: whole = 0
   !> Format: at most six digits.
   integer, parameter :: six_digits = -1
   !> Format: an error in percent with four decimals, or with two digits if the error is small.
   integer, parameter :: percent = -2
   !> Format: all digits.
   integer, parameter :: all_digits = -3
   !> Format: two digits.
   integer, parameter :: two_digits = -4
   !> Errors in percent below this are written with two digits.
   real(wp), parameter :: min_decimal_error = 0.001_wp

   !> A column of numbers or of texts.
   type :: column_t
      !> Name in files, and heading on a terminal. A heading is broken into lines at each new_line('a'); a long heading
      !> without new_line('a') is broken at a blank
      character(:), allocatable :: name
      !> Unit of the numbers; '1': none
      character(:), allocatable :: units
      !> Number of decimals on a terminal, or one of the formats `whole`, `six_digits`, ...
      integer :: digits = six_digits
      !> Text that stands for NaN on a terminal
      character(:), allocatable :: none
      !> Numbers, [rows]; unallocated: a column of texts
      real(wp), allocatable :: numbers(:)
      !> Texts of a column without numbers, [rows]
      character(max_text_length), allocatable :: texts(:)
   end type column_t

   !> A table, all columns of which have the same number of rows.
   type :: table_t
      character(:), allocatable :: name
      type(column_t), allocatable :: columns(:)
   end type table_t

contains

   !> Append a column to a table.
   subroutine add(table, column)
      type(table_t), intent(inout) :: table
      type(column_t), intent(in) :: column

      type(column_t), allocatable :: longer(:)
      integer :: count

      count = 0
      if (allocated(table%columns)) count = size(table%columns)
      allocate (longer(count + 1))
      if (count > 0) longer(:count) = table%columns
      longer(count + 1) = column
      call move_alloc(longer, table%columns)
   end subroutine add

   !> Append a column of texts to a table.
   subroutine add_texts(table, name, texts)
      type(table_t), intent(inout) :: table
      character(*), intent(in) :: name
      character(*), intent(in) :: texts(:)

      type(column_t) :: column

      column%name = name
      column%units = '1'
      allocate (column%texts(size(texts)))
      column%texts(:) = texts
      call add(table, column)
   end subroutine add_texts

   !> Append a column of numbers to a table. A unit gets the prefix that leaves few digits before the decimal point, and
   !> is appended to the name.
   subroutine add_numbers(table, name, numbers, digits, unit, none)
      type(table_t), intent(inout) :: table
      character(*), intent(in) :: name
      !> Values; NaN: no number
      real(wp), intent(in) :: numbers(:)
      !> Decimals or format, as in `column_t`
      integer, intent(in) :: digits
      !> Unit of the numbers; empty or absent: none
      character(*), intent(in), optional :: unit
      !> Text for NaN; absent: a dash
      character(*), intent(in), optional :: none

      type(column_t) :: column
      real(wp) :: factor

      column%name = name
      column%units = '1'
      column%digits = digits
      column%none = '-'
      if (present(none)) column%none = none
      allocate (column%numbers, source=numbers)
      if (present(unit)) then
         if (unit /= '') then
            call choose_prefix(maxval(abs(numbers), mask=.not. ieee_is_nan(numbers)), unit, factor, column%units)
            column%numbers(:) = factor*numbers
            column%name = name//', '//column%units
         end if
      end if
      call add(table, column)
   end subroutine add_numbers

   !> Print the name and the title of a scene, broken into lines of the page width.
   subroutine print_title(unit, name, title)
      integer, intent(in) :: unit
      character(*), intent(in) :: name
      !> Title; absent, empty or the name: there is none
      character(*), intent(in), optional :: title

      character(:), allocatable :: words
      integer :: last

      words = name
      if (present(title)) then
         if (title /= '' .and. title /= name) words = name//': '//title
      end if
      last = end_of_line(words, page_width)
      write (unit, '(a)') trim(words(:last))
      if (last < len(words)) call print_line(unit, '', words(last + 1:), width=0)
   end subroutine print_title

   !> Print a label and a text, broken into lines of the page width.
   subroutine print_line(unit, label, words, width)
      integer, intent(in) :: unit
      character(*), intent(in) :: label
      !> Text beside the label
      character(*), intent(in) :: words
      !> Width of the label; absent: `label_width`
      integer, intent(in), optional :: width

      character(:), allocatable :: padded
      integer :: first, last

      ! last: first the width of the label, then the position of the last character of a line
      last = label_width
      if (present(width)) last = width
      ! a label wider than its column is followed by one blank
      padded = left_aligned(label, max(last, merge(0, len_trim(label) + 1, label == '')))
      first = 1
      do
         last = first - 1 + end_of_line(words(first:), page_width - 2 - len(padded))
         write (unit, '(2x, a, a)') padded, trim(words(first:last))
         if (last >= len(words)) exit
         first = last + 1
         padded = repeat(' ', len(padded, kind=i8))
      end do
   end subroutine print_line

   !> Position at which a text is broken: after the last comma, colon or semicolon that fits, else at the last blank
   !> that fits, else at the first blank; never beside an equals sign.
   pure integer function end_of_line(words, width) result(last)
      character(*), intent(in) :: words
      !> Maximum number of characters in a line
      integer, intent(in) :: width

      integer :: i
      logical :: is_at_comma

      last = len(words)
      if (character_count(words) <= width) return
      is_at_comma = .false.
      do i = 2, len(words) - 1
         if (words(i:i) /= ' ' .or. words(i - 1:i - 1) == '=' .or. words(i + 1:i + 1) == '=') cycle
         if (last < len(words) .and. character_count(words(:i - 1)) > width) return
         if (is_at_comma .and. scan(words(i - 1:i - 1), ',:;') == 0) cycle
         is_at_comma = scan(words(i - 1:i - 1), ',:;') > 0
         last = i
      end do
   end function end_of_line

   !> Print a table of two columns or more on a terminal. Columns are as wide as their cells and broken headings, texts
   !> are left-aligned and numbers right-aligned. A table wider than a page is printed in parts, each of which begins
   !> with the first column. A column of half widths, '+-', stays beside the column of its values.
   subroutine print_table(unit, table)
      integer, intent(in) :: unit
      type(table_t), intent(in) :: table

      character(max_heading_length) :: headings(size(table%columns))
      ! first column of the part that is being printed
      integer :: first
      ! number of lines of the heading of each column
      integer :: heights(size(table%columns))
      ! last column of the part
      integer :: last
      ! last column that the part has if it grows
      integer :: next
      integer :: i, k, widths(size(table%columns))

      do k = 1, size(widths)
         associate (column => table%columns(k), rows => rows_of(table%columns(k)))
            widths(k) = maxval([0, (character_count(cell_of(column, i)), i=1, rows)])
            headings(k) = broken_heading(column%name, max(short_heading, widths(k)))
            heights(k) = 1 + occurrences(line_end, headings(k))
            widths(k) = maxval([widths(k), (character_count(line_of(headings(k), i)), i=1, heights(k))])
         end associate
      end do
      last = 1
      do while (last < size(widths))
         if (last > 1) write (unit, '()')
         first = last + 1
         last = first
         do while (last < size(widths))
            next = last + 1
            if (next < size(widths)) then
               if (table%columns(next + 1)%name == '+-') next = next + 1
            end if
            if (sum(widths(first:next) + 2) + widths(1) + 2 > page_width) exit
            last = next
         end do
         do i = 1 - max(heights(1), maxval(heights(first:last))), rows_of(table%columns(1))
            call print_row(i, [1, (k, k=first, last)])
         end do
      end do

   contains

      !> Print a row of some columns.
      subroutine print_row(row, columns)
         !> Number of the row; 0, -1 ...: line of the headings, from the last one up
         integer, intent(in) :: row
         integer, intent(in) :: columns(:)

         character(:), allocatable :: cell, line
         integer :: i_column

         line = ''
         do i_column = 1, size(columns)
            associate (column => table%columns(columns(i_column)), heading => headings(columns(i_column)), &
               width => widths(columns(i_column)))
               if (row > 0) then
                  cell = cell_of(column, row)
               else
                  cell = line_of(heading, row + heights(columns(i_column)))
               end if
               if (allocated(column%texts)) cell = left_aligned(cell, width)
               line = line//'  '//repeat(' ', int(max(0, width - character_count(cell)), i8))//cell
            end associate
         end do
         write (unit, '(a)') trim(line)
      end subroutine print_row

   end subroutine print_table

   !> Number of rows of a column.
   pure integer function rows_of(column)
      type(column_t), intent(in) :: column

      if (allocated(column%texts)) then
         rows_of = size(column%texts)
      else
         rows_of = size(column%numbers)
      end if
   end function rows_of

   !> A heading. A long heading of one line is broken at the blank that makes the longer of two lines shortest, but
   !> neither before a sign such as % nor before or in the unit after the last comma.
   pure function broken_heading(name, width) result(heading)
      character(*), intent(in) :: name
      !> Maximum length of a heading that is not broken
      integer, intent(in) :: width
      character(:), allocatable :: heading

      integer :: i, last, place

      heading = name
      if (index(heading, line_end) > 0 .or. character_count(heading) <= width) return
      last = index(heading, ', ', back=.true.)
      if (last == 0) last = len(heading)
      place = 0
      do i = 1, last - 1
         if (heading(i:i) /= ' ' .or. scan(heading(i + 1:i + 1), '%=+') > 0) cycle
         if (max(i, len(heading) - i) < max(place, len(heading) - place)) place = i
      end do
      if (place > 0) heading(place:place) = line_end
   end function broken_heading

   !> Line number `number` of a text, counted from 1; empty if the number is below 1.
   pure function line_of(text, number) result(line)
      character(*), intent(in) :: text
      integer, intent(in) :: number
      character(:), allocatable :: line

      integer :: i

      line = ''
      if (number > 0) line = trim(text)
      do i = 2, number
         line = line(index(line, line_end) + 1:)
      end do
      line = line(:index(line//line_end, line_end) - 1)
   end function line_of

   !> Text of one value on a terminal.
   pure function cell_of(column, row) result(text)
      type(column_t), intent(in) :: column
      integer, intent(in) :: row
      character(:), allocatable :: text

      if (allocated(column%texts)) then
         text = trim(column%texts(row))
         return
      end if
      associate (number => column%numbers(row), digits => column%digits)
         if (ieee_is_nan(number)) then
            text = column%none
         else if (digits == whole) then
            text = to_text(nint(number))
         else if (digits == six_digits) then
            text = rounded(number)
         else if (digits == all_digits) then
            text = to_text(number)
         else if (digits == percent .and. (abs(number) >= min_decimal_error .or. abs(number) <= 0.0_wp)) then
            text = with_decimals(number, 4)
         else if (digits < 0) then
            text = with_two_digits(number)
         else
            text = with_decimals(number, digits)
         end if
      end associate
   end function cell_of

   !> A number with two digits, such as 3.1e-5.
   pure function with_two_digits(value) result(text)
      real(wp), intent(in) :: value
      character(:), allocatable :: text

      character(16) :: buffer
      real(wp) :: short

      write (buffer, '(es16.1e3)') value
      read (buffer, *) short
      text = to_text(short)
   end function with_two_digits

   !> A text padded on the right to a width.
   pure function left_aligned(text, width) result(cell)
      character(*), intent(in) :: text
      integer, intent(in) :: width
      character(:), allocatable :: cell

      cell = trim(text)//repeat(' ', int(max(0, width - character_count(trim(text))), i8))
   end function left_aligned

end module table_columns
