!> Tables of frequencies for people to read.
module frequency_tables
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use body_words, only: mesh_in_words
   use frequency_types, only: error_in_percent, frequency_column_t, frequency_table_t
   use kinds, only: lambda1, wp
   use number_text, only: rounded, to_text
   use quantities, only: quantity_named, unit_of, units_t
   use reader_units, only: find_prefix
   use text_columns, only: at_right, fixed
   implicit none (type, external)
   private
   public :: print_frequency_table

   !> Width of a column of numbers.
   integer, parameter :: column_width = 12
   !> Wider tables of frequencies are printed in parts.
   integer, parameter :: most_columns = 4
   !> Errors in percent below this are written with an exponent.
   real(wp), parameter :: smallest_plain_error = 0.001_wp

contains

   !> A table of frequencies: a row for each mode, a column for each mesh and solver, '-' where a mesh
   !> has no such mode; and the same for the errors, where exact values are known. A table of one column
   !> has its errors beside it. Then why a solver has failed, if one has.
   subroutine print_frequency_table(unit, table, units)
      integer, intent(in) :: unit
      type(frequency_table_t), intent(in) :: table
      !> What results are in
      type(units_t), intent(in) :: units

      type(frequency_table_t) :: part
      character(:), allocatable :: frequency_unit
      real(wp) :: factor
      integer :: first, i

      factor = 0.0_wp
      frequency_unit = ''
      if (units%are_of_scene) call find_hertz(table, units, factor, frequency_unit)
      if (size(table%columns) == 1) then
         call print_column(unit, table, factor, frequency_unit)
      else
         do first = 1, size(table%columns), most_columns
            part%columns = table%columns(first:min(first + most_columns - 1, size(table%columns)))
            if (allocated(table%exact)) part%exact = table%exact
            call print_frequency_columns(unit, part)
            if (.not. units%are_of_scene) cycle
            do i = 1, size(part%columns)
               part%columns(i)%lambda = factor*part%columns(i)%lambda**2
            end do
            if (allocated(part%exact)) part%exact = factor*part%exact**2
            call print_frequency_columns(unit, part, 'frequency, '//frequency_unit)
         end do
      end if
      if (allocated(table%shape)) write (unit, '(/, 2x, 2(a, es7.1))') 'mode shapes: orthogonal in M to ', &
         table%mass_orthogonality, ', in K to ', table%stiffness_orthogonality
      do i = 1, size(table%columns)
         associate (column => table%columns(i))
            if (allocated(column%failure)) write (unit, '(2x, a)') 'no values for ' &
               //mesh_in_words(column%elements, column%ratio)//', '//column%solver//': '//column%failure
         end associate
      end do
   end subroutine print_frequency_table

   !> What makes frequencies of squares of lambda, as they are read.
   pure subroutine find_hertz(table, units, factor, frequency_unit)
      type(frequency_table_t), intent(in) :: table
      !> What results are in
      type(units_t), intent(in) :: units
      real(wp), intent(out) :: factor
      character(:), allocatable, intent(out) :: frequency_unit

      real(wp) :: hertz, prefix

      hertz = units%factor(quantity_named('frequency'))/lambda1**2
      associate (lambda => table%columns(1)%lambda)
         call find_prefix(hertz*maxval(lambda(:min(1, size(lambda))))**2, unit_of(quantity_named('frequency'), units), &
            prefix, frequency_unit)
      end associate
      factor = hertz*prefix
   end subroutine find_hertz

   !> A table of one column.
   subroutine print_column(unit, table, factor, frequency_unit)
      integer, intent(in) :: unit
      type(frequency_table_t), intent(in) :: table
      !> What makes frequencies of squares of lambda, and their unit; 0: they are not printed
      real(wp), intent(in) :: factor
      character(*), intent(in) :: frequency_unit

      character(column_width) :: cells(4)
      integer :: mode
      logical :: has_exact

      has_exact = allocated(table%exact)
      associate (column => table%columns(1))
         write (unit, '(/, 2x, a)') 'lambda, '//mesh_in_words(column%elements, column%ratio)//', solver '//column%solver
         cells(:) = ''
         cells(1) = adjust_right('lambda')
         if (has_exact) cells(2:3) = [adjust_right('exact'), adjust_right('error %')]
         if (factor > 0.0_wp) cells(4) = adjust_right(frequency_unit)
         call print_cells(unit, '', cells)
         do mode = 1, size(column%lambda)
            cells(:) = ''
            cells(1) = adjust_right(fixed(column%lambda(mode), 6))
            if (has_exact) then
               if (mode <= size(table%exact)) cells(2:3) = [ &
                  adjust_right(fixed(table%exact(mode), 6)), &
                  adjust_right(error_text(error_in_percent(column%lambda(mode), table%exact(mode))))]
            end if
            if (factor > 0.0_wp) cells(4) = adjust_right(rounded(factor*column%lambda(mode)**2))
            call print_cells(unit, 'mode '//to_text(mode), cells)
         end do
      end associate
   end subroutine print_column

   !> A table of several columns.
   subroutine print_frequency_columns(unit, table, heading)
      integer, intent(in) :: unit
      type(frequency_table_t), intent(in) :: table
      !> What stands there instead of lambda; its errors are left out then
      character(*), intent(in), optional :: heading

      character(column_width) :: cells(size(table%columns) + 1)
      integer :: column, columns, mode, rows

      columns = size(table%columns)
      rows = 0
      if (allocated(table%exact)) rows = size(table%exact)
      do column = 1, columns
         rows = max(rows, size(table%columns(column)%lambda))
      end do

      if (present(heading)) then
         call print_heading(unit, table%columns, heading, allocated(table%exact))
      else
         call print_heading(unit, table%columns, 'lambda', allocated(table%exact))
      end if
      do mode = 1, rows
         cells(:) = adjust_right('-')
         do column = 1, columns
            associate (lambda => table%columns(column)%lambda)
               if (mode <= size(lambda)) cells(column) = adjust_right(fixed(lambda(mode), 6))
            end associate
         end do
         cells(columns + 1) = ''
         if (allocated(table%exact)) then
            if (mode <= size(table%exact)) cells(columns + 1) = adjust_right(fixed(table%exact(mode), 6))
         end if
         call print_cells(unit, 'mode '//to_text(mode), cells)
      end do
      if (present(heading) .or. .not. allocated(table%exact)) return

      call print_heading(unit, table%columns, 'error of lambda in percent', .false.)
      do mode = 1, min(rows, size(table%exact))
         cells(:) = adjust_right('-')
         cells(columns + 1) = ''
         do column = 1, columns
            associate (lambda => table%columns(column)%lambda, exact => table%exact(mode))
               if (mode <= size(lambda)) cells(column) = &
                  adjust_right(error_text(error_in_percent(lambda(mode), exact)))
            end associate
         end do
         call print_cells(unit, 'mode '//to_text(mode), cells)
      end do
   end subroutine print_frequency_columns

   !> What the columns of a table of frequencies are.
   subroutine print_heading(unit, columns, heading, has_exact)
      integer, intent(in) :: unit
      type(frequency_column_t), intent(in) :: columns(:)
      !> What the numbers are
      character(*), intent(in) :: heading
      !> The last column is that of the exact values
      logical, intent(in) :: has_exact

      character(column_width) :: cells(size(columns) + 1)
      integer :: i

      write (unit, '(/, 2x, a)') heading
      cells(:) = ''
      do i = 1, size(columns)
         cells(i) = adjust_right(to_text(columns(i)%elements))
      end do
      if (has_exact) cells(size(cells)) = adjust_right('exact')
      call print_cells(unit, 'elements n', cells)
      cells(size(cells)) = ''
      do i = 1, size(columns)
         cells(i) = adjust_right('given')
         if (columns(i)%ratio > 0.0_wp) cells(i) = adjust_right(rounded(columns(i)%ratio))
      end do
      call print_cells(unit, 'l_i/l_(i+1)', cells)
      do i = 1, size(columns)
         cells(i) = adjust_right(columns(i)%solver)
      end do
      call print_cells(unit, 'solver', cells)
   end subroutine print_heading

   !> A row of a table.
   subroutine print_cells(unit, label, cells)
      integer, intent(in) :: unit
      !> The row's label
      character(*), intent(in) :: label
      !> Its cells
      character(column_width), intent(in) :: cells(:)

      character(column_width) :: padded
      character(:), allocatable :: line
      integer :: i

      padded = label
      line = padded
      do i = 1, size(cells)
         line = line//cells(i)
      end do
      write (unit, '(2x, a)') trim(line)
   end subroutine print_cells

   !> An error in percent: four decimals, or an exponent where these would hide it.
   pure function error_text(error) result(text)
      real(wp), intent(in) :: error
      character(:), allocatable :: text

      character(32) :: buffer

      if (ieee_is_nan(error)) then
         text = '-'
      else if (abs(error) >= smallest_plain_error .or. abs(error) <= 0.0_wp) then
         text = fixed(error, 4)
      else
         write (buffer, '(es12.1e2)') error
         text = trim(adjustl(buffer))
      end if
   end function error_text

   !> A text at the right of a column.
   pure function adjust_right(text) result(cell)
      character(*), intent(in) :: text
      character(column_width) :: cell

      cell = at_right(text, column_width)
   end function adjust_right

end module frequency_tables
