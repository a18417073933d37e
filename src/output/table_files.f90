!> Tables of a results file (`table_names`) as texts for other programs: each as a file of comma-separated values, or
!> all in one file of JSON. The tables are read back from the results file. Each run of a scene rewrites the files that
!> an earlier run of this scene wrote.
module table_files
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
   use failures, only: fail, failure_t, status_run_failed
   use file_system, only: kind_file, kind_nothing, kind_of, load_file, remove_entries, replace_file
   use hdf5_loading, only: hdf5_source_t, member_t
   use kinds, only: i8, wp
   use number_text, only: to_text
   use results_claim, only: refuse_foreign
   use table_columns, only: add_numbers, column_t, six_digits, table_t, whole
   use table_texts, only: beginning_of, growing_text_t, table_formats, value_count, write_csv, write_json
   implicit none (type, external)
   private
   public :: write_table_files

   !> Names of the tables; each ends the name of its file
   character(*), parameter :: table_names(8) = [character(11) :: 'measures', 'sweep', 'best', 'frequencies', &
      'spectrum', 'sensitivity', 'fit', 'uncertainty']
   !> Maximum number of values in a table: some hundred megabytes of text
   integer(i8), parameter :: max_values = 20000000_i8

contains

   !> Write the tables of a results file into files beside it, each file either complete or not at all, in the requested
   !> format and in those formats in which an earlier run wrote them.
   subroutine write_table_files(folder, name, error, format)
      character(*), intent(in) :: folder
      !> Name of the results file with its extension .h5
      character(*), intent(in) :: name
      !> Reason why the tables could not be written
      type(failure_t), allocatable, intent(inout) :: error
      !> One of `table_formats`; absent: only the formats of existing files
      character(*), intent(in), optional :: format

      type(hdf5_source_t) :: file
      type(table_t), allocatable :: tables(:)
      character(:), allocatable :: stem
      integer :: i
      logical :: is_wanted(size(table_formats))

      stem = name(:len(name) - len('.h5'))
      call remove_tables(folder, stem, is_wanted)
      if (present(format)) is_wanted = is_wanted .or. table_formats == format
      if (.not. any(is_wanted)) return
      call file%open_file(folder//'/'//name)
      call read_tables(file, tables)
      if (.not. file%is_sound()) then
         call fail(error, status_run_failed, "cannot read '"//folder//'/'//name//"' back")
      else if (any([(value_count(tables(i)) > max_values, i=1, size(tables))])) then
         call fail(error, status_run_failed, "'"//folder//'/'//name//"' exists and has more than "// &
            to_text(int(max_values))//' numbers in a table: too many for --format; read them from it')
      end if
      call file%close_source()
      do i = 1, size(table_formats)
         if (is_wanted(i)) call write_format(folder, stem, tables, trim(table_formats(i)), error)
      end do
   end subroutine write_table_files

   !> Write all tables in a format.
   subroutine write_format(folder, stem, tables, format, error)
      character(*), intent(in) :: folder
      !> Name of the results file without .h5, the name of the scene
      character(*), intent(in) :: stem
      type(table_t), intent(in) :: tables(:)
      !> One of `table_formats`
      character(*), intent(in) :: format
      !> Reason why a table could not be written. If set on entry, nothing is written
      type(failure_t), allocatable, intent(inout) :: error

      type(growing_text_t) :: text
      integer :: i

      if (allocated(error)) return
      if (format == 'json') then
         call write_json(tables, stem, text)
         call write_new_file(folder, stem//'.json', text, error)
         return
      end if
      do i = 1, size(tables)
         if (allocated(error)) return
         call write_csv(tables(i), stem, text)
         call write_new_file(folder, csv_name(stem, tables(i)%name), text, error)
      end do
   end subroutine write_format

   !> Name of the file of a table.
   pure function csv_name(stem, table) result(name)
      !> Name of the results file without .h5
      character(*), intent(in) :: stem
      !> One of `table_names`
      character(*), intent(in) :: table
      character(:), allocatable :: name

      name = stem//'_'//trim(table)//'.csv'
   end function csv_name

   !> Remove the tables that the program wrote for a scene. Other files of these names remain.
   subroutine remove_tables(folder, stem, were_there)
      character(*), intent(in) :: folder
      !> Name of the results file without .h5
      character(*), intent(in) :: stem
      !> Whether a table was removed, for each of `table_formats`
      logical, intent(out) :: were_there(size(table_formats))

      integer :: i

      were_there = .false.
      call remove_table(stem//'.json', findloc(table_formats, 'json', dim=1))
      do i = 1, size(table_names)
         call remove_table(csv_name(stem, table_names(i)), findloc(table_formats, 'csv', dim=1))
      end do

   contains

      !> Remove a file if it begins like a table of this scene.
      subroutine remove_table(name, format)
         character(*), intent(in) :: name
         !> Index in `table_formats`
         integer, intent(in) :: format

         character(:), allocatable :: text
         type(failure_t), allocatable :: unreadable

         if (kind_of(folder//'/'//name) /= kind_file) return
         call load_file(folder//'/'//name, text, unreadable)
         ! a file that does not begin like a table of this scene is left alone
         if (index(text, beginning_of(table_formats(format), stem)) /= 1) return
         were_there(format) = .true.
         ! the trailing '/.' resolves a folder that is a link
         call remove_entries(folder//'/.', [name])
      end subroutine remove_table

   end subroutine remove_tables

   !> Write a text into a new file. An existing file of this name is a failure.
   subroutine write_new_file(folder, name, text, error)
      character(*), intent(in) :: folder
      character(*), intent(in) :: name
      type(growing_text_t), intent(in) :: text
      type(failure_t), allocatable, intent(inout) :: error

      if (kind_of(folder//'/'//name) /= kind_nothing) then
         call refuse_foreign(folder//'/'//name, 'a table of this scene', error)
      else
         call replace_file(folder, name, text%text(:text%length), error)
      end if
   end subroutine write_new_file

   !> Read all tables of a results file.
   subroutine read_tables(file, tables)
      type(hdf5_source_t), intent(inout) :: file
      type(table_t), allocatable, intent(out) :: tables(:)

      type(table_t) :: table
      integer :: i

      allocate (tables(0))
      do i = 1, size(table_names)
         if (file%has(trim(table_names(i)))) then
            if (table_names(i) == 'frequencies') then
               call read_frequencies(file, table)
            else
               ! the group of measures also has lists, such as the rebounds; the table has only its single numbers
               call read_flat(file, trim(table_names(i)), merge(0, 1, table_names(i) == 'measures'), table)
            end if
         else if (table_names(i) == 'measures') then
            if (.not. file%has('cases')) cycle
            call read_cases(file, table)
         else
            cycle
         end if
         if (size(table%columns) > 0) call append(table, tables)
      end do
   end subroutine read_tables

   !> Append a table to a list.
   subroutine append(table, tables)
      type(table_t), intent(in) :: table
      type(table_t), allocatable, intent(inout) :: tables(:)

      type(table_t), allocatable :: longer(:)

      allocate (longer(size(tables) + 1))
      longer(:size(tables)) = tables
      longer(size(longer)) = table
      call move_alloc(longer, tables)
   end subroutine append

   !> Read the single values of a group, or its lists that have as many values as the longest, each as a column.
   !> Datasets of more dimensions, such as sections, are left out. In the group of a sweep a measure that is NaN in all
   !> cases makes no column.
   subroutine read_flat(file, group, rank, table)
      type(hdf5_source_t), intent(inout) :: file
      character(*), intent(in) :: group
      !> 0: single values, which are one row; 1: lists
      integer, intent(in) :: rank
      type(table_t), intent(out) :: table

      type(member_t), allocatable :: members(:)
      type(column_t) :: column
      integer :: columns, i, rows

      call file%members_of(group, members)
      rows = int(maxval([members%points, 0_i8], mask=[members%rank == rank, .true.]))
      members = pack(members, members%rank == rank .and. members%points == int(rows, i8))
      table%name = group
      allocate (table%columns(size(members)))
      columns = 0
      do i = 1, size(members)
         call read_column(file, group, members(i), rows, column)
         if (group == 'sweep' .and. allocated(column%numbers)) then
            if (all(ieee_is_nan(column%numbers))) cycle
         end if
         columns = columns + 1
         table%columns(columns) = column
      end do
      table%columns = table%columns(:columns)
   end subroutine read_flat

   !> Read one dataset.
   subroutine read_column(file, group, member, rows, column)
      type(hdf5_source_t), intent(inout) :: file
      character(*), intent(in) :: group
      type(member_t), intent(in) :: member
      integer, intent(in) :: rows
      type(column_t), intent(out) :: column

      character(:), allocatable :: path

      path = group//'/'//trim(member%name)
      column%name = trim(member%name)
      if (member%is_integer) column%digits = whole
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

   !> Read the measures of all cases, a row each. Measures that a case does not have are NaN.
   subroutine read_cases(file, table)
      type(hdf5_source_t), intent(inout) :: file
      type(table_t), intent(out) :: table

      type(member_t), allocatable :: cases(:)
      type(table_t) :: row
      character(:), allocatable :: group, parameter
      integer :: i, k, index_found, rows

      call file%members_of('cases', cases)
      rows = count(cases%name(:5) == 'case_')
      table%name = 'measures'
      allocate (table%columns(0))
      call find_column(table, 'case', '1', whole, rows, index_found)
      parameter = file%text_attribute('parameter', 'cases')
      call find_column(table, parameter, file%text_attribute('units', 'cases/'//parameter), six_digits, rows, &
         index_found)
      do i = 1, rows
         group = 'cases/case_'//to_text(i)
         table%columns(1)%numbers(i) = real(i, wp)
         table%columns(2)%numbers(i) = file%number_attribute('value', group)
         ! the case has failed
         if (.not. file%has(group//'/measures')) cycle
         call read_flat(file, group//'/measures', 0, row)
         do k = 1, size(row%columns)
            if (.not. allocated(row%columns(k)%numbers)) cycle
            call find_column(table, row%columns(k)%name, row%columns(k)%units, row%columns(k)%digits, rows, index_found)
            table%columns(index_found)%numbers(i) = row%columns(k)%numbers(1)
         end do
      end do
   end subroutine read_cases

   !> Index of a column of numbers by its name. A missing column is appended with NaN in all rows.
   subroutine find_column(table, name, units, digits, rows, index_found)
      type(table_t), intent(inout) :: table
      character(*), intent(in) :: name
      character(*), intent(in) :: units
      !> Decimals or format, as in `column_t`
      integer, intent(in) :: digits
      !> Number of rows of the table
      integer, intent(in) :: rows
      integer, intent(out) :: index_found

      do index_found = 1, size(table%columns)
         if (table%columns(index_found)%name == name) return
      end do
      ! `index_found` is now the number of columns plus 1, the index of the appended column
      call add_numbers(table, name, spread(ieee_value(1.0_wp, ieee_quiet_nan), 1, rows), digits)
      table%columns(index_found)%units = units
   end subroutine find_column

   !> Read the table of frequencies, with a row for each mode of each combination of solver and mesh. In the file such a
   !> combination is called a column.
   subroutine read_frequencies(file, table)
      type(hdf5_source_t), intent(inout) :: file
      type(table_t), intent(out) :: table

      character(*), parameter :: group = 'frequencies'
      type(member_t), allocatable :: members(:)
      type(column_t) :: column
      ! number of combinations of solver and mesh
      integer :: combinations
      ! number of values of a dataset
      integer :: points
      integer :: i, k, modes

      call file%members_of(group, members)
      modes = int(sum(members%points, mask=members%name == 'mode'))
      combinations = int(sum(members%points, mask=members%name == 'column'))
      members = pack(members, members%points > 0)
      table%name = group
      allocate (table%columns(size(members)))
      do i = 1, size(members)
         points = int(members(i)%points)
         call read_column(file, group, members(i), points, column)
         ! A dataset has a value for each mode, for each combination, or for both; in the file the index of the
         ! combination varies fastest.
         if (members(i)%name == 'mode' .or. (points == modes .and. members(i)%name(:6) /= 'column')) then
            if (allocated(column%numbers)) column%numbers = [(spread(column%numbers(k), 1, combinations), k=1, modes)]
         else if (members(i)%name(:6) == 'column') then
            if (allocated(column%numbers)) column%numbers = [(column%numbers, k=1, modes)]
            if (allocated(column%texts)) column%texts = [(column%texts, k=1, modes)]
         end if
         table%columns(i) = column
      end do
   end subroutine read_frequencies

end module table_files
