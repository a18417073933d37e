!> Tables of a results file as texts for other programs: measures, sweeps, their best cases and frequencies, each a
!> file of comma-separated values, or all in one of JSON. They are read back from the results file.
module table_files
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_c_binding, only: c_char
   use failures, only: fail, failure_t, status_run_failed
   use file_system, only: kind_file, kind_nothing, kind_of, load_file, replace_file
   use hdf5_loading, only: hdf5_source_t, member_t
   use kinds, only: i8, wp
   use number_text, only: to_text
   use program_identity, only: program_name, program_version
   use results_claim, only: refuse_foreign
   implicit none (type, external)
   private
   public :: table_formats, write_table_files

   character(*), parameter :: table_formats(2) = [character(4) :: 'csv', 'json']
   character(*), parameter :: first_of_json = '{"program": "'//program_name//'"'
   character, parameter :: next = new_line('a')
   integer, parameter :: longest_text = 200
   !> Of one table: some hundred megabytes of text
   integer(i8), parameter :: most_values = 20000000_i8

   type :: column_t
      character(:), allocatable :: name
      !> '1' for a number without
      character(:), allocatable :: units
      logical :: is_integer = .false.
      real(wp), allocatable :: numbers(:)
      !> Instead of numbers
      character(longest_text), allocatable :: texts(:)
   end type column_t

   type :: table_t
      character(:), allocatable :: name
      type(column_t), allocatable :: columns(:)
   end type table_t

   !> Text that grows.
   type :: growing_t
      character(:), allocatable :: text
      integer(i8) :: length = 0_i8
   end type growing_t

contains

   !> Write what a results file has of tables beside it, each file whole or not at all.
   subroutine write_table_files(folder, name, format, error)
      character(*), intent(in) :: folder
      !> Of the results file, with its ending .h5
      character(*), intent(in) :: name
      !> One of `table_formats`
      character(*), intent(in) :: format
      !> Why they could not be written
      type(failure_t), allocatable, intent(inout) :: error

      type(hdf5_source_t) :: file
      type(table_t), allocatable :: tables(:)
      character(:), allocatable :: stem
      type(growing_t) :: text
      integer :: i

      call file%open_file(folder//'/'//name)
      call read_tables(file, tables)
      if (.not. file%is_sound()) then
         call fail(error, status_run_failed, "cannot read '"//folder//'/'//name//"' back")
      else if (any([(values_of(tables(i)) > most_values, i=1, size(tables))])) then
         call fail(error, status_run_failed, "'"//folder//'/'//name//"' is there, and has more than "// &
            to_text(int(most_values))//' numbers in a table: too many for --format; read them from it')
      end if
      call file%close_source()
      if (allocated(error)) return
      stem = name(:len(name) - len('.h5'))
      if (format == 'json') then
         call write_json(tables, text)
         call write_whole(folder, stem//'.json', text, first_of_json, error)
         return
      end if
      do i = 1, size(tables)
         call write_csv(tables(i), text)
         call write_whole(folder, stem//'_'//tables(i)%name//'.csv', text, heading(tables(i)%columns(1)), error)
         if (allocated(error)) return
      end do
   end subroutine write_table_files

   !> Write a text in place of what an earlier run wrote, which begins alike.
   subroutine write_whole(folder, name, text, beginning, error)
      character(*), intent(in) :: folder
      character(*), intent(in) :: name
      type(growing_t), intent(in) :: text
      character(*), intent(in) :: beginning
      type(failure_t), allocatable, intent(inout) :: error

      character(kind=c_char), allocatable :: bytes(:)
      character(:), allocatable :: path
      integer :: i
      integer(i8) :: k

      path = folder//'/'//name
      select case (kind_of(path))
      case (kind_nothing)
      case (kind_file)
         call load_file(path, bytes, error)
         if (allocated(error)) return
         if (size(bytes) < len(beginning)) then
            call refuse_foreign(path, 'a table', error)
         else if (any(bytes(:len(beginning)) /= [(beginning(i:i), i=1, len(beginning))])) then
            call refuse_foreign(path, 'a table', error)
         end if
      case default
         call refuse_foreign(path, 'a table', error)
      end select
      if (allocated(error)) return
      bytes = [(text%text(k:k), k=1_i8, text%length)]
      call replace_file(folder, name, bytes, error)
   end subroutine write_whole

   !> All tables of a file.
   subroutine read_tables(file, tables)
      type(hdf5_source_t), intent(inout) :: file
      type(table_t), allocatable, intent(out) :: tables(:)

      character(*), parameter :: flat(2) = ['sweep', 'best ']
      type(table_t) :: table
      integer :: i

      allocate (tables(0))
      if (file%has('measures')) then
         call read_flat(file, 'measures', 1, table)
         call append(table, tables)
      else if (file%has('cases')) then
         call read_cases(file, table)
         call append(table, tables)
      end if
      do i = 1, size(flat)
         if (.not. file%has(trim(flat(i)))) cycle
         call read_flat(file, trim(flat(i)), 0, table)
         call append(table, tables)
      end do
      if (file%has('frequencies')) then
         call read_frequencies(file, table)
         call append(table, tables)
      end if
   end subroutine read_tables

   !> One more table, if it has any column.
   subroutine append(table, tables)
      type(table_t), intent(in) :: table
      type(table_t), allocatable, intent(inout) :: tables(:)

      type(table_t), allocatable :: longer(:)

      if (size(table%columns) == 0) return
      allocate (longer(size(tables) + 1))
      longer(:size(tables)) = tables
      longer(size(longer)) = table
      call move_alloc(longer, tables)
   end subroutine append

   !> The datasets of a group, each a column.
   subroutine read_flat(file, group, rows, table)
      type(hdf5_source_t), intent(inout) :: file
      character(*), intent(in) :: group
      !> Numbers in each; 0: as many as in the first
      integer, intent(in) :: rows
      type(table_t), intent(out) :: table

      type(member_t), allocatable :: members(:)
      integer :: i, wanted

      call file%members_of(group, members)
      wanted = rows
      if (wanted == 0 .and. size(members) > 0) wanted = int(maxval(members%points))
      members = pack(members, members%points == int(wanted, i8))
      table%name = group
      allocate (table%columns(size(members)))
      do i = 1, size(members)
         call read_column(file, group, members(i), wanted, table%columns(i))
      end do
   end subroutine read_flat

   !> One dataset.
   subroutine read_column(file, group, member, rows, column)
      type(hdf5_source_t), intent(inout) :: file
      character(*), intent(in) :: group
      type(member_t), intent(in) :: member
      integer, intent(in) :: rows
      type(column_t), intent(out) :: column

      character(:), allocatable :: path

      path = group//'/'//trim(member%name)
      column%name = trim(member%name)
      column%is_integer = member%is_integer
      column%units = file%text_attribute('units', path)
      if (len(column%units) == 0 .or. column%units == 'none') column%units = '1'
      if (member%is_text) then
         allocate (column%texts(rows))
         call file%load(path, column%texts)
      else
         allocate (column%numbers(rows))
         call file%load(path, column%numbers)
      end if
   end subroutine read_column

   !> The measures of all cases, a row each; a case has only those that it came to.
   subroutine read_cases(file, table)
      type(hdf5_source_t), intent(inout) :: file
      type(table_t), intent(out) :: table

      type(member_t), allocatable :: cases(:)
      type(table_t) :: row
      character(:), allocatable :: group
      integer :: i, k, place, rows

      call file%members_of('cases', cases)
      rows = count(cases%name(:5) == 'case_')
      table%name = 'measures'
      allocate (table%columns(0))
      call find_column(table, 'case', '1', .true., rows, place)
      group = file%text_attribute('parameter', 'cases')
      call find_column(table, group, '1', .false., rows, place)
      do i = 1, rows
         group = 'cases/case_'//to_text(i)
         table%columns(1)%numbers(i) = real(i, wp)
         table%columns(2)%numbers(i) = file%number_attribute('value', group)
         call read_flat(file, group//'/measures', 1, row)
         do k = 1, size(row%columns)
            if (.not. allocated(row%columns(k)%numbers)) cycle
            call find_column(table, row%columns(k)%name, row%columns(k)%units, row%columns(k)%is_integer, rows, place)
            table%columns(place)%numbers(i) = row%columns(k)%numbers(1)
         end do
      end do
   end subroutine read_cases

   !> Where a column of numbers is; where there is none yet, it is added and holds none.
   subroutine find_column(table, name, units, is_integer, rows, place)
      type(table_t), intent(inout) :: table
      character(*), intent(in) :: name
      character(*), intent(in) :: units
      logical, intent(in) :: is_integer
      integer, intent(in) :: rows
      integer, intent(out) :: place

      type(column_t), allocatable :: longer(:)

      do place = 1, size(table%columns)
         if (table%columns(place)%name == name) return
      end do
      allocate (longer(place))
      longer(:place - 1) = table%columns
      longer(place)%name = name
      longer(place)%units = units
      longer(place)%is_integer = is_integer
      allocate (longer(place)%numbers(rows), source=ieee_value(1.0_wp, ieee_quiet_nan))
      call move_alloc(longer, table%columns)
   end subroutine find_column

   !> A row for each mode on each mesh.
   subroutine read_frequencies(file, table)
      type(hdf5_source_t), intent(inout) :: file
      type(table_t), intent(out) :: table

      character(*), parameter :: group = 'frequencies'
      type(member_t), allocatable :: members(:)
      type(column_t) :: column
      integer :: columns, i, k, modes, points

      call file%members_of(group, members)
      modes = int(sum(members%points, mask=members%name == 'mode'))
      columns = int(sum(members%points, mask=members%name == 'column'))
      members = pack(members, members%points > 0)
      table%name = group
      allocate (table%columns(size(members)))
      do i = 1, size(members)
         points = int(members(i)%points)
         call read_column(file, group, members(i), points, column)
         ! of a mode, of a mesh, or of both: in the file the meshes of one mode follow each other
         if (members(i)%name == 'mode' .or. (points == modes .and. members(i)%name(:6) /= 'column')) then
            if (allocated(column%numbers)) column%numbers = [(spread(column%numbers(k), 1, columns), k=1, modes)]
         else if (members(i)%name(:6) == 'column') then
            if (allocated(column%numbers)) column%numbers = [(column%numbers, k=1, modes)]
            if (allocated(column%texts)) column%texts = [(column%texts, k=1, modes)]
         end if
         table%columns(i) = column
      end do
   end subroutine read_frequencies

   !> Name and unit of a column.
   pure function heading(column) result(text)
      type(column_t), intent(in) :: column
      character(:), allocatable :: text

      text = column%name
      if (column%units /= '1') text = text//' ('//column%units//')'
   end function heading

   !> Comma-separated values after a line of names; what is not a number is empty.
   pure subroutine write_csv(table, text)
      type(table_t), intent(in) :: table
      type(growing_t), intent(out) :: text

      integer :: i, k

      do k = 1, size(table%columns)
         call add(text, quoted(heading(table%columns(k)), '""')//merge(next, ',', k == size(table%columns)))
      end do
      do i = 1, rows_of(table)
         do k = 1, size(table%columns)
            call add(text, value_text(table%columns(k), i, '""', '')//merge(next, ',', k == size(table%columns)))
         end do
      end do
   end subroutine write_csv

   !> All tables in one object; what is not a number is null.
   pure subroutine write_json(tables, text)
      type(table_t), intent(in) :: tables(:)
      type(growing_t), intent(out) :: text

      integer :: i, k, t

      call add(text, first_of_json//', "version": "'//program_version//'", "tables": {')
      do t = 1, size(tables)
         call add(text, trim(merge(',', ' ', t > 1))//next//'  "'//tables(t)%name//'": {')
         do k = 1, size(tables(t)%columns)
            associate (column => tables(t)%columns(k))
               call add(text, trim(merge(',', ' ', k > 1))//next//'    "'//column%name//'": {"units": "'// &
                  column%units//'", "values": [')
               do i = 1, rows_of(tables(t))
                  if (i > 1) call add(text, ', ')
                  call add(text, value_text(column, i, '\"', 'null'))
               end do
               call add(text, ']}')
            end associate
         end do
         call add(text, next//'  }')
      end do
      call add(text, next//'}}'//next)
   end subroutine write_json

   !> How many there are in a table.
   pure function values_of(table) result(count)
      type(table_t), intent(in) :: table
      integer(i8) :: count

      count = int(rows_of(table), i8)*size(table%columns, kind=i8)
   end function values_of

   pure integer function rows_of(table)
      type(table_t), intent(in) :: table

      associate (first => table%columns(1))
         if (allocated(first%texts)) then
            rows_of = size(first%texts)
         else
            rows_of = size(first%numbers)
         end if
      end associate
   end function rows_of

   !> One value as it stands in a file.
   pure function value_text(column, row, quote, none) result(text)
      type(column_t), intent(in) :: column
      integer, intent(in) :: row
      !> What a quotation mark becomes within a text
      character(*), intent(in) :: quote
      !> What stands for no number
      character(*), intent(in) :: none
      character(:), allocatable :: text

      if (allocated(column%texts)) then
         text = '"'//escaped(trim(column%texts(row)), quote)//'"'
      else if (.not. ieee_is_finite(column%numbers(row))) then
         text = none
      else if (column%is_integer) then
         text = to_text(nint(column%numbers(row)))
      else
         text = to_text(column%numbers(row))
      end if
   end function value_text

   !> In quotation marks if it has a comma.
   pure function quoted(word, quote) result(text)
      character(*), intent(in) :: word
      character(*), intent(in) :: quote
      character(:), allocatable :: text

      text = word
      if (index(word, ',') > 0) text = '"'//escaped(word, quote)//'"'
   end function quoted

   pure function escaped(word, quote) result(text)
      character(*), intent(in) :: word
      character(*), intent(in) :: quote
      character(:), allocatable :: text

      integer :: i

      text = ''
      do i = 1, len(word)
         if (word(i:i) == '"') then
            text = text//quote
         else
            text = text//word(i:i)
         end if
      end do
   end function escaped

   !> Append, without a copy of all each time.
   pure subroutine add(growing, words)
      type(growing_t), intent(inout) :: growing
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

end module table_files
