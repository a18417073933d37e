!> A table of numbers in a text file, which is a measured signal or the course of a load, as instruments write it:
!> columns between semicolons, tabs, commas or blanks, a header of any length, units in a line of their own or after the
!> names of the columns, a point or a comma before decimals, and perhaps a column with the noise of the values.
module signal_file
   use file_system, only: load_text
   use kinds, only: wp
   use name_types, only: range_t, contains_value, range_text
   use namelist_tokens, only: lower_case, normalise_lines
   use namelist_values, only: read_real
   use number_text, only: list_of_numbers, to_text
   use printable_text, only: occurrences, excerpt
   use signal_units, only: split_unit, unit_ratio
   implicit none (type, external)
   private
   public :: signal_t, read_signal

   integer, parameter :: max_unit_length = 32
   character, parameter :: tab = achar(9)
   !> Characters between numbers
   character(*), parameter :: separators = ' ,;'//tab
   !> Characters that begin a comment after a number
   character(*), parameter :: marks = '#!'
   !> Maximum number of a line of the header that is not a comment.
   integer, parameter :: max_header = 200

   !> Two or three columns of a file.
   type :: signal_t
      !> Times, ascending, [samples]
      real(wp), allocatable :: time(:)
      !> Values, [samples]
      real(wp), allocatable :: value(:)
      !> Standard deviations of the noise of the values, in their unit, [samples]; unallocated: not requested
      real(wp), allocatable :: noise(:)
      !> Unit of the times as in the file; empty: the file has none
      character(max_unit_length) :: time_unit = ''
      !> Unit of the values as in the file; empty: the file has none
      character(max_unit_length) :: value_unit = ''
   end type signal_t

   !> Layout of the lines of a file.
   type :: layout_t
      !> Delimiter of columns; a blank: any number of blanks and tabs
      character :: delimiter = ' '
      logical :: has_decimal_comma = .false.
   end type layout_t

contains

   !> Read two or three columns of a file.
   subroutine read_signal(file, columns, range, are_all, signal, problem)
      character(*), intent(in) :: file
      !> Columns of the time, of the value and, if requested, of the standard deviation of its noise
      integer, intent(in) :: columns(:)
      !> Allowed numbers
      type(range_t), intent(in) :: range
      !> Whether the file must have no other columns. Of the units in comments, only those of time then count
      logical, intent(in) :: are_all
      type(signal_t), intent(out) :: signal
      !> Error message with file and line; unallocated: no error
      character(:), allocatable, intent(out) :: problem

      character(:), allocatable :: raw, text, reason
      real(wp), allocatable :: numbers(:, :)
      type(layout_t) :: layout
      ! first and last position of a line in the text
      integer :: first, last
      ! number of this line
      integer :: line
      ! number of lines of numbers so far
      integer :: rows
      ! whether the layout is known, i.e. the first line of numbers has been found
      logical :: has_layout

      call load_text(file, raw, problem)
      if (allocated(problem)) then
         problem = file//': '//problem
         return
      end if
      call normalise_lines(raw, text)
      allocate (numbers(size(columns), 1 + occurrences(new_line('a'), text)))
      first = 1
      line = 0
      rows = 0
      has_layout = .false.
      do while (first <= len(text))
         line = line + 1
         ! each line ends with a new line (`normalise_lines`)
         last = first + index(text(first:), new_line('a')) - 2
         associate (row => text(first:last))
            if (has_words(row)) then
               if (.not. has_layout) call find_layout(row, columns, are_all, layout, has_layout)
               if (has_layout) then
                  call read_row(row, layout, columns, range, are_all, numbers(:, rows + 1), reason)
                  if (.not. allocated(reason) .and. rows > 0) then
                     if (numbers(1, rows + 1) <= numbers(1, rows)) reason = 'times must ascend, but ' &
                        //to_text(numbers(1, rows + 1))//' follows '//to_text(numbers(1, rows))
                  end if
                  rows = rows + 1
                  if (.not. allocated(reason) .and. size(columns) > 2) then
                     if (numbers(3, rows) <= 0.0_wp) reason = 'column '//to_text(columns(3)) &
                        //', the noise, must be greater than 0'
                  end if
               else
                  call read_header(row, columns, are_all, signal)
                  if (line > max_header) reason = 'no line before has numbers in columns '//list_of_numbers(columns)
               end if
            else if (.not. has_layout) then
               call read_header(row, columns, are_all, signal)
            end if
         end associate
         if (allocated(reason)) then
            problem = file//':'//to_text(line)//': '//reason
            return
         end if
         first = last + 2
      end do
      if (rows == 0) problem = file//': no line has numbers in columns '//list_of_numbers(columns)
      allocate (signal%time, source=numbers(1, :rows))
      allocate (signal%value, source=numbers(2, :rows))
      if (size(columns) > 2) allocate (signal%noise, source=numbers(3, :rows))
   end subroutine read_signal

   !> Whether a line has more than separators and a comment.
   pure logical function has_words(row)
      character(*), intent(in) :: row

      integer :: first

      first = verify(row, separators)
      has_words = first > 0
      if (has_words) has_words = scan(row(first:first), marks//'%') == 0
   end function has_words

   !> Find the layout with which a line has numbers in all columns, if there is one. A line of numbers of which one is
   !> not allowed, such as nan, or missing, has a layout too, so that the line is not taken for a part of the header.
   pure subroutine find_layout(row, columns, are_all, layout, is_found)
      character(*), intent(in) :: row
      integer, intent(in) :: columns(:)
      !> Whether the file must have no other columns
      logical, intent(in) :: are_all
      type(layout_t), intent(out) :: layout
      logical, intent(out) :: is_found

      ! the comma is the last, because commas may also stand before decimals
      character, parameter :: delimiters(4) = [';', tab, ' ', ',']
      character(:), allocatable :: reason
      real(wp) :: numbers(size(columns))
      integer :: i, commas

      is_found = .false.
      do i = 1, size(delimiters)
         do commas = 0, 1
            if (delimiters(i) == ',' .and. commas == 1) cycle
            layout = layout_t(delimiters(i), commas == 1)
            call read_row(row, layout, columns, range_t(-huge(1.0_wp), huge(1.0_wp)), .false., numbers, reason)
            is_found = .not. allocated(reason)
            ! a line without a decimal point may be the first, with whole numbers, of a file with decimal commas
            if (is_found .and. commas == 0 .and. delimiters(i) /= ',' .and. index(row, '.') == 0) then
               layout%has_decimal_comma = .true.
            end if
            if (is_found) return
         end do
      end do
      is_found = numeric_words(row) >= merge(1, size(columns), are_all)
      layout = layout_t(',')
      if (index(trim(adjustl(row)), ' ') > 0 .and. index(row, ', ') == 0) layout%delimiter = ' '
      if (index(row, tab) > 0) layout%delimiter = tab
      if (index(row, ';') > 0) layout%delimiter = ';'
      layout%has_decimal_comma = layout%delimiter /= ',' .and. index(row, '.') == 0
   end subroutine find_layout

   !> Number of words of a line, if all of them are numbers, allowed or not; 0 otherwise.
   pure integer function numeric_words(row) result(words)
      character(*), intent(in) :: row

      character(*), parameter :: digits = '0123456789', characters = digits//'+-.eEdD'
      character(*), parameter :: not_finite(*) = [character(8) :: 'nan', 'inf', 'infinity']
      character(:), allocatable :: word
      integer :: first, last, comment

      comment = scan(row//marks, marks)
      words = 0
      last = 0
      do
         first = verify(row(last + 1:comment - 1), separators)
         if (first == 0) return
         first = last + first
         last = first + scan(row(first:comment - 1)//' ', separators) - 2
         word = row(first:last)
         words = words + 1
         if (scan(word(:1), digits//'+-.') > 0 .and. verify(word, characters) == 0) cycle
         if (scan(word(:1), '+-') > 0) word = word(2:)
         if (any(not_finite == lower_case(word))) cycle
         words = 0
         return
      end do
   end function numeric_words

   !> Read the numbers of one line.
   pure subroutine read_row(row, layout, columns, range, are_all, numbers, reason)
      character(*), intent(in) :: row
      type(layout_t), intent(in) :: layout
      !> Numbers of the columns
      integer, intent(in) :: columns(:)
      !> Allowed numbers
      type(range_t), intent(in) :: range
      !> Whether the line must have no other columns
      logical, intent(in) :: are_all
      !> Numbers in these columns
      real(wp), intent(inout) :: numbers(:)
      !> Error message; unallocated: no error
      character(:), allocatable, intent(out) :: reason

      character(:), allocatable :: cell
      integer :: comment, i, k, last
      logical :: is_legal

      ! a comment may follow a number
      comment = scan(row, marks)
      do k = 1, size(columns)
         call find_cell(row, layout%delimiter, columns(k), cell, last)
         if (comment > 0) cell = trim(cell(:scan(cell//marks, marks) - 1))
         if (cell == '') then
            reason = 'there is no column '//to_text(columns(k))
            return
         end if
         i = 0
         if (layout%has_decimal_comma) then
            i = index(cell, ',')
            ! a comma at the end separates columns, so the number is illegal with decimal commas
            if (i == len(cell)) i = 0
            if (i > 0) cell(i:i) = '.'
         end if
         call read_real(cell, numbers(k), is_legal, reason)
         if (is_legal) is_legal = contains_value(range, numbers(k))
         if (is_legal) cycle
         if (i > 0) cell(i:i) = ','
         if (.not. allocated(reason)) reason = 'must be a number '//range_text(range)
         reason = 'column '//to_text(columns(k))//', '//excerpt(cell)//': '//reason
         return
      end do
      if (.not. are_all) return
      if (comment == 0) comment = len(row) + 1
      if (verify(row(last + 1:comment - 1), separators) > 0) reason = 'must have '//to_text(size(columns)) &
         //' columns, but has more'
   end subroutine read_row

   !> Find the text in a column, without surrounding blanks and quotes; empty: the line does not have the column.
   pure subroutine find_cell(row, delimiter, column, cell, last)
      character(*), intent(in) :: row
      !> Delimiter of columns; a blank: any number of blanks and tabs
      character, intent(in) :: delimiter
      integer, intent(in) :: column
      character(:), allocatable, intent(out) :: cell
      !> Last position of the column in the line, if the line has it
      integer, intent(out) :: last

      integer :: first, k, length

      first = 1
      length = 0
      do k = 1, column
         if (delimiter == ' ') then
            length = verify(row(min(first, len(row) + 1):), ' '//tab)
            if (length == 0) exit
            first = first + length - 1
            length = scan(row(first:), ' '//tab) - 1
         else
            if (first > len(row) + 1) exit
            length = index(row(first:), delimiter) - 1
         end if
         if (length < 0) length = len(row) + 1 - first
         if (k < column) first = first + length + 1
      end do
      last = min(first + length - 1, len(row))
      length = verify(row(first:last), ' '//tab, back=.true.)
      cell = row(first - 1 + max(1, verify(row(first:last), ' '//tab)):first - 1 + length)
      if (len(cell) < 2) return
      if (scan(cell(1:1), '"''') > 0 .and. cell(len(cell):) == cell(1:1)) cell = trim(adjustl(cell(2:len(cell) - 1)))
   end subroutine find_cell

   !> Read the units of a line of the header; a later line replaces units of an earlier line. Units stand in brackets or
   !> after ' / ' following the names of the columns, or in a line of their own. If one column of a line has a known
   !> unit without brackets, the text of the other column is a unit too, even if it is not known.
   pure subroutine read_header(row, columns, are_all, signal)
      character(*), intent(in) :: row
      !> Columns of the time and of the value
      integer, intent(in) :: columns(:)
      !> Whether a comment counts only if it has a unit of time
      logical, intent(in) :: are_all
      type(signal_t), intent(inout) :: signal

      character(:), allocatable :: line, time_cell, value_cell, problem
      character(max_unit_length) :: time_unit, value_unit
      character :: delimiter
      real(wp) :: ratio
      integer :: last
      logical :: time_is_bare, value_is_bare

      time_unit = signal%time_unit
      value_unit = signal%value_unit
      line = row
      if (.not. has_words(row)) line = row(scan(row, marks//'%') + 1:)
      delimiter = ' '
      if (index(line, ',') > 0) delimiter = ','
      if (index(line, tab) > 0) delimiter = tab
      if (index(line, ';') > 0) delimiter = ';'
      if (delimiter == ' ' .and. scan(line, '([') > 0) then
         ! names of columns may have blanks too, so the unit of a column is found by the number of its brackets: each
         ! column before it must have a unit in brackets
         time_cell = bracketed(line, columns(1))
         value_cell = bracketed(line, columns(2))
      else
         call find_cell(line, delimiter, columns(1), time_cell, last)
         call find_cell(line, delimiter, columns(2), value_cell, last)
      end if
      call take_unit(time_cell, time_unit, time_is_bare)
      call take_unit(value_cell, value_unit, value_is_bare)
      if (time_is_bare .and. .not. (value_is_bare .or. is_bracketed(value_cell))) call take_bare_unit(value_cell, &
         value_unit)
      if (value_is_bare .and. .not. (time_is_bare .or. is_bracketed(time_cell))) call take_bare_unit(time_cell, &
         time_unit)
      if (are_all .and. .not. has_words(row)) then
         call unit_ratio(time_unit, 's', ratio, problem)
         if (allocated(problem)) return
      end if
      signal%time_unit = time_unit
      signal%value_unit = value_unit
   end subroutine read_header

   !> Text in a pair of brackets of a line, with the brackets; empty: the line has fewer pairs.
   pure function bracketed(row, which) result(part)
      character(*), intent(in) :: row
      !> Number of the pair
      integer, intent(in) :: which
      character(:), allocatable :: part

      integer :: first, k, last

      part = ''
      first = 1
      last = 0
      do k = 1, which
         first = last + scan(row(last + 1:), '([')
         if (first == last) return
         last = first + scan(row(first + 1:), ')]')
         if (last == first) return
      end do
      part = row(first:last)
   end function bracketed

   !> Take the unit from a cell of the header, if the cell has one.
   pure subroutine take_unit(cell, unit, is_bare)
      character(*), intent(in) :: cell
      character(max_unit_length), intent(inout) :: unit
      !> Whether the cell has a known unit without brackets
      logical, intent(out) :: is_bare

      character(:), allocatable :: base
      real(wp) :: factor

      is_bare = .false.
      if (is_bracketed(cell)) then
         unit = trim(adjustl(cell(scan(cell, '([', back=.true.) + 1:scan(cell, ')]', back=.true.) - 1)))
         return
      end if
      call split_unit(bare_unit(cell), base, factor, is_bare)
      if (is_bare) unit = bare_unit(cell)
   end subroutine take_unit

   !> Take the text of a cell without brackets as a unit, unless the cell is empty.
   pure subroutine take_bare_unit(cell, unit)
      character(*), intent(in) :: cell
      character(max_unit_length), intent(inout) :: unit

      if (cell /= '') unit = bare_unit(cell)
   end subroutine take_bare_unit

   !> Whether a cell has a text in brackets.
   pure logical function is_bracketed(cell)
      character(*), intent(in) :: cell

      is_bracketed = scan(cell, '([') > 0 .and. scan(cell, ')]', back=.true.) > scan(cell, '([', back=.true.) + 1
   end function is_bracketed

   !> Text after the last ' / ' in a cell, or the whole text if it has no ' / '.
   pure function bare_unit(cell) result(unit)
      character(*), intent(in) :: cell
      character(:), allocatable :: unit

      character(*), parameter :: divided_by = ' / '
      integer :: place

      place = index(cell, divided_by, back=.true.)
      if (place > 0) place = place + len(divided_by) - 1
      unit = trim(adjustl(cell(place + 1:)))
   end function bare_unit

end module signal_file
