!> A measured signal in a text file as instruments write it: columns between semicolons, tabs, commas or blanks, a
!> header of any length, units in a line of their own or after the names of the columns, a point or a comma before
!> decimals, and perhaps a column with the noise of the values.
module signal_file
   use file_system, only: load_text
   use kinds, only: wp
   use name_types, only: number_range, range_text
   use namelist_tokens, only: normalise_lines
   use namelist_values, only: read_real
   use number_text, only: list_of_numbers, to_text
   use printable_text, only: occurrences, excerpt
   implicit none (type, external)
   private
   public :: signal_t, read_signal, unit_ratio

   integer, parameter :: max_unit_length = 32
   character, parameter :: tab = achar(9)
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
   subroutine read_signal(file, columns, signal, problem)
      character(*), intent(in) :: file
      !> Columns of the time, of the value and, if requested, of the standard deviation of its noise
      integer, intent(in) :: columns(:)
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
            ! neither empty nor a comment, which has its mark in the first column
            if (verify(row, ' '//tab//';,') > 0 .and. scan(row(:min(1, len(row))), '#!%') == 0) then
               if (.not. has_layout) call find_layout(row, columns, layout, has_layout)
               if (has_layout) then
                  call read_row(row, layout, columns, numbers(:, rows + 1), reason)
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
                  call read_header(row, columns, signal)
                  if (line > max_header) reason = 'no line before has numbers in columns '//list_of_numbers(columns)
               end if
            else if (.not. has_layout) then
               call read_header(row, columns, signal)
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

   !> Find the layout with which a line has numbers in all columns, if there is one.
   pure subroutine find_layout(row, columns, layout, is_found)
      character(*), intent(in) :: row
      integer, intent(in) :: columns(:)
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
            call read_row(row, layout, columns, numbers, reason)
            is_found = .not. allocated(reason)
            ! a line without a decimal point may be the first, with whole numbers, of a file with decimal commas
            if (is_found .and. commas == 0 .and. delimiters(i) /= ',' .and. index(row, '.') == 0) then
               layout%has_decimal_comma = .true.
            end if
            if (is_found) return
         end do
      end do
   end subroutine find_layout

   !> Read the numbers of one line.
   pure subroutine read_row(row, layout, columns, numbers, reason)
      character(*), intent(in) :: row
      type(layout_t), intent(in) :: layout
      !> Numbers of the columns
      integer, intent(in) :: columns(:)
      !> Numbers in these columns
      real(wp), intent(inout) :: numbers(:)
      !> Error message; unallocated: no error
      character(:), allocatable, intent(out) :: reason

      character(:), allocatable :: cell, shown
      integer :: i, k
      logical :: is_legal

      do k = 1, size(columns)
         cell = cell_of(row, layout%delimiter, columns(k))
         if (cell == '') then
            reason = 'there is no column '//to_text(columns(k))
            return
         end if
         shown = excerpt(cell)
         if (layout%has_decimal_comma) then
            i = index(cell, ',')
            ! a comma at the end separates columns, so the number is illegal with decimal commas
            if (i > 0 .and. i < len(cell)) cell(i:i) = '.'
         end if
         call read_real(cell, numbers(k), is_legal, reason)
         if (is_legal) cycle
         if (.not. allocated(reason)) reason = 'must be a number '//range_text(number_range)
         reason = 'column '//to_text(columns(k))//', '//shown//': '//reason
         return
      end do
   end subroutine read_row

   !> Text in a column, without surrounding blanks and quotes; empty: the line does not have the column.
   pure function cell_of(row, delimiter, column) result(cell)
      character(*), intent(in) :: row
      !> Delimiter of columns; a blank: any number of blanks and tabs
      character, intent(in) :: delimiter
      integer, intent(in) :: column
      character(:), allocatable :: cell

      integer :: first, k, length

      first = 1
      length = 0
      cell = ''
      do k = 1, column
         if (delimiter == ' ') then
            length = verify(row(min(first, len(row) + 1):), ' '//tab)
            if (length == 0) return
            first = first + length - 1
            length = scan(row(first:)//' ', ' '//tab) - 1
         else
            if (first > len(row) + 1) return
            length = index(row(first:)//delimiter, delimiter) - 1
         end if
         if (k < column) first = first + length + 1
      end do
      cell = trim(adjustl(row(first:first + length - 1)))
      if (len(cell) < 2) return
      if (scan(cell(1:1), '"''') > 0 .and. cell(len(cell):) == cell(1:1)) cell = trim(adjustl(cell(2:len(cell) - 1)))
   end function cell_of

   !> Read the units of a line of the header; a later line replaces units of an earlier line. Units stand in brackets or
   !> after ' / ' following the names of the columns, or in a line of their own. If one column of a line has a known
   !> unit without brackets, the text of the other column is a unit too, even if it is not known.
   pure subroutine read_header(row, columns, signal)
      character(*), intent(in) :: row
      !> Columns of the time and of the value
      integer, intent(in) :: columns(:)
      type(signal_t), intent(inout) :: signal

      character(:), allocatable :: line, time_cell, value_cell
      character :: delimiter
      logical :: time_is_bare, value_is_bare

      line = row
      if (scan(line(:min(1, len(line))), '#!%') > 0) line = line(2:)
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
         time_cell = cell_of(line, delimiter, columns(1))
         value_cell = cell_of(line, delimiter, columns(2))
      end if
      call take_unit(time_cell, signal%time_unit, time_is_bare)
      call take_unit(value_cell, signal%value_unit, value_is_bare)
      if (time_is_bare .and. .not. (value_is_bare .or. is_bracketed(value_cell))) call take_bare_unit(value_cell, &
         signal%value_unit)
      if (value_is_bare .and. .not. (time_is_bare .or. is_bracketed(time_cell))) call take_bare_unit(time_cell, &
         signal%time_unit)
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

   !> Find the factor that converts numbers from one unit to another.
   pure subroutine unit_ratio(unit, wanted, ratio, problem)
      !> Unit of the numbers, such as 'mm/s'
      character(*), intent(in) :: unit
      !> The other unit, such as 'm/s'
      character(*), intent(in) :: wanted
      real(wp), intent(out) :: ratio
      !> Error message if the units have different dimensions or one of them is not known; unallocated: no error
      character(:), allocatable, intent(out) :: problem

      character(:), allocatable :: base, other
      real(wp) :: first, second
      logical :: is_known, other_known

      call split_unit(unit, base, first, is_known)
      call split_unit(wanted, other, second, other_known)
      ratio = first/second
      if (.not. (is_known .and. other_known)) then
         problem = 'unit '//excerpt(trim(unit))//' is not known; it must be '//trim(wanted)//', or that with a prefix'
      else if (base /= other) then
         problem = 'unit '//excerpt(trim(unit))//' must be '//trim(wanted)//', or that with a prefix'
      end if
   end subroutine unit_ratio

   !> Split a unit into a factor and a unit without prefixes: 'mm/s' into 0.001 and 'm/s'.
   pure subroutine split_unit(unit, base, factor, is_known)
      character(*), intent(in) :: unit
      character(:), allocatable, intent(out) :: base
      real(wp), intent(out) :: factor
      logical, intent(out) :: is_known

      character(:), allocatable :: part
      real(wp) :: size_of
      integer :: first, last, k

      factor = 1.0_wp
      is_known = len_trim(unit) > 0
      if (unit == 'g') then
         ! standard gravity
         base = 'm/s^2'
         factor = 9.80665_wp
         return
      end if
      base = ''
      first = 1
      k = 0
      do while (first <= len_trim(unit) .and. is_known)
         last = first + index(trim(unit(first:))//'/', '/') - 2
         part = with_caret(trim(adjustl(unit(first:last))))
         call split_prefix(part, size_of, is_known)
         k = k + 1
         if (k == 1) then
            factor = size_of
            base = part
         else
            ! ms^2 is (ms)^2
            if (index(part, '^2') > 0) size_of = size_of**2
            factor = factor/size_of
            base = base//'/'//part
         end if
         first = last + 2
      end do
      if (base == 'm/s/s') base = 'm/s^2'
   end subroutine split_unit

   !> A unit with its square as '^2', which files may also have as '2', '**2' or a superscript 2 (in UTF-8 or Latin-1).
   pure function with_caret(unit) result(part)
      character(*), intent(in) :: unit
      character(:), allocatable :: part

      character(*), parameter :: squares(5) = [character(3) :: '^2', '**2', char(194)//char(178), char(178), '2']
      integer :: i, last

      part = unit
      do i = 1, size(squares)
         last = len(unit) - len_trim(squares(i))
         if (last < 1) cycle
         if (unit(last + 1:) /= squares(i)) cycle
         part = unit(:last)//'^2'
         return
      end do
   end function with_caret

   !> Split a unit without divisions into a factor and the unit without its prefix.
   pure subroutine split_prefix(part, factor, is_known)
      !> On entry such as 'mm'; on return such as 'm'
      character(:), allocatable, intent(inout) :: part
      real(wp), intent(out) :: factor
      logical, intent(out) :: is_known

      character(*), parameter :: bases(4) = [character(4) :: 'm', 's', 'N', 's^2']
      ! other names of the second, which have no prefix
      character(*), parameter :: seconds(3) = [character(7) :: 'sec', 'second', 'seconds']
      ! micro: u, the micro of UTF-8 as a sign and as a Greek letter, and of Latin-1
      character(*), parameter :: prefixes(10) = [character(2) :: 'n', 'u', char(194)//char(181), char(206)//char(188), &
         char(181), 'm', 'c', 'k', 'M', 'd']
      real(wp), parameter :: factors(10) = [1.0e-9_wp, 1.0e-6_wp, 1.0e-6_wp, 1.0e-6_wp, 1.0e-6_wp, 1.0e-3_wp, &
         1.0e-2_wp, 1.0e3_wp, 1.0e6_wp, 1.0e-1_wp]
      integer :: i, length

      factor = 1.0_wp
      if (any(seconds == part)) part = 's'
      is_known = any(bases == part)
      if (is_known) return
      do i = 1, size(prefixes)
         length = len_trim(prefixes(i))
         if (index(part, trim(prefixes(i))) /= 1) cycle
         if (.not. any(bases == part(length + 1:))) cycle
         is_known = .true.
         factor = factors(i)
         part = part(length + 1:)
         return
      end do
   end subroutine split_prefix

end module signal_file
