!> Tables as texts: comma-separated values, or JSON. Each text names its scene.
module table_texts
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use kinds, only: i8
   use number_text, only: to_text
   use program_identity, only: program_name, program_version
   use table_columns, only: column_t, rows_of, table_t, whole
   implicit none (type, external)
   private
   public :: growing_text_t, table_formats, beginning_of, value_count, write_csv, write_json

   !> Formats of table files, by the extension of their names.
   character(*), parameter :: table_formats(2) = [character(4) :: 'csv', 'json']
   character, parameter :: line_end = new_line('a')

   !> A text buffer that grows by appending.
   type :: growing_text_t
      !> Buffer, of which the first `length` characters are used
      character(:), allocatable :: text
      integer(i8) :: length = 0_i8
   end type growing_text_t

contains

   !> First characters of a table, by which the program recognises a file that it wrote for this scene.
   pure function beginning_of(format, stem) result(text)
      !> One of `table_formats`
      character(*), intent(in) :: format
      !> Name of the scene
      character(*), intent(in) :: stem
      character(:), allocatable :: text

      if (format == 'json') then
         text = '{"program": "'//program_name//'", "scene": "'//escaped(stem, '\"')//'", "version": "'
      else
         text = '# '//program_name//', scene '//stem//', version '
      end if
   end function beginning_of

   !> Local date and time of day in the format of ISO 8601.
   function date_of_today() result(text)
      character(25) :: text

      character(8) :: date
      character(10) :: time
      character(5) :: zone

      call date_and_time(date, time, zone)
      text = date(:4)//'-'//date(5:6)//'-'//date(7:)//'T'//time(:2)//':'//time(3:4)//':'//time(5:6)// &
         zone(:3)//':'//zone(4:)
   end function date_of_today

   !> Heading of a column of comma-separated values: its name, and its unit in parentheses; in quotation marks if it
   !> has a comma.
   pure function heading(column) result(text)
      type(column_t), intent(in) :: column
      character(:), allocatable :: text

      text = column%name
      if (column%units /= '1') text = text//' ('//column%units//')'
      if (index(text, ',') > 0) text = '"'//escaped(text, '""')//'"'
   end function heading

   !> Write comma-separated values, preceded by a comment that names the scene and a line of column names. NaN and
   !> infinity are empty.
   subroutine write_csv(table, stem, text)
      type(table_t), intent(in) :: table
      !> Name of the scene
      character(*), intent(in) :: stem
      type(growing_text_t), intent(out) :: text

      integer :: i, k

      call add(text, beginning_of('csv', stem)//program_version//', '//date_of_today()//line_end)
      do k = 1, size(table%columns)
         call add(text, heading(table%columns(k))//merge(line_end, ',', k == size(table%columns)))
      end do
      do i = 1, rows_of(table%columns(1))
         do k = 1, size(table%columns)
            call add(text, value_text(table%columns(k), i, '""', '')//merge(line_end, ',', k == size(table%columns)))
         end do
      end do
   end subroutine write_csv

   !> Write all tables as one JSON object. NaN and infinity are null.
   subroutine write_json(tables, stem, text)
      type(table_t), intent(in) :: tables(:)
      !> Name of the scene
      character(*), intent(in) :: stem
      type(growing_text_t), intent(out) :: text

      integer :: i, k, t

      call add(text, beginning_of('json', stem)//program_version//'", "date": "'//date_of_today()//'", "tables": {')
      do t = 1, size(tables)
         call add(text, trim(merge(',', ' ', t > 1))//line_end//'  "'//tables(t)%name//'": {')
         do k = 1, size(tables(t)%columns)
            associate (column => tables(t)%columns(k))
               call add(text, trim(merge(',', ' ', k > 1))//line_end//'    "'//column%name//'": {"units": "'// &
                  column%units//'", "values": [')
               do i = 1, rows_of(tables(t)%columns(1))
                  if (i > 1) call add(text, ', ')
                  call add(text, value_text(column, i, '\"', 'null'))
               end do
               call add(text, ']}')
            end associate
         end do
         call add(text, line_end//'  }')
      end do
      call add(text, line_end//'}}'//line_end)
   end subroutine write_json

   !> Number of values in a table.
   pure integer(i8) function value_count(table) result(count)
      type(table_t), intent(in) :: table

      count = int(rows_of(table%columns(1)), i8)*size(table%columns, kind=i8)
   end function value_count

   !> Text of one value in a file.
   pure function value_text(column, row, quote, none) result(text)
      type(column_t), intent(in) :: column
      integer, intent(in) :: row
      !> Replacement of a quotation mark within a text
      character(*), intent(in) :: quote
      !> Text for NaN and infinity
      character(*), intent(in) :: none
      character(:), allocatable :: text

      if (allocated(column%texts)) then
         text = '"'//escaped(trim(column%texts(row)), quote)//'"'
      else if (.not. ieee_is_finite(column%numbers(row))) then
         text = none
      else if (column%digits == whole) then
         text = to_text(nint(column%numbers(row)))
      else
         text = to_text(column%numbers(row))
      end if
   end function value_text

   !> A text with its quotation marks escaped.
   pure function escaped(word, quote) result(text)
      character(*), intent(in) :: word
      !> Replacement of a quotation mark; if it begins with a backslash, backslashes are doubled
      character(*), intent(in) :: quote
      character(:), allocatable :: text

      integer :: i

      text = ''
      do i = 1, len(word)
         if (word(i:i) == '"') then
            text = text//quote
         else if (word(i:i) == '\' .and. quote(1:1) == '\') then
            text = text//'\\'
         else
            text = text//word(i:i)
         end if
      end do
   end function escaped

   !> Append words; doubling the buffer avoids a copy of the whole text at each call.
   pure subroutine add(growing, words)
      type(growing_text_t), intent(inout) :: growing
      character(*), intent(in) :: words

      character(:), allocatable :: longer
      integer(i8) :: length

      if (.not. allocated(growing%text)) allocate (character(4096) :: growing%text)
      length = growing%length + len(words, kind=i8)
      if (length > len(growing%text, kind=i8)) then
         allocate (character(2_i8*length) :: longer)
         longer(:growing%length) = growing%text(:growing%length)
         call move_alloc(longer, growing%text)
      end if
      growing%text(growing%length + 1_i8:length) = words
      growing%length = length
   end subroutine add

end module table_texts
