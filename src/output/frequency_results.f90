!> Frequencies and mode shapes: their tables on the terminal, and their group of the results file.
module frequency_results
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use frequency_types, only: error_in_percent, frequency_column_t, frequency_table_t
   use kinds, only: lambda1, wp
   use number_text, only: rounded, to_text
   use quantities, only: quantity_named, unit_of, units_t
   use quantity_groups, only: quantity_group_t
   use reader_units, only: choose_prefix
   use run_settings, only: name_length
   use scene_words, only: elements_in_words
   use table_columns, only: add_numbers, add_texts, percent, print_line, print_table, six_digits, table_t, &
      with_two_digits
   implicit none (type, external)
   private
   public :: print_frequency_table, write_frequencies

   character, parameter :: line_end = new_line('a')
   !> Decimals of lambda and of dimensionless frequencies.
   integer, parameter :: decimals = 6

contains

   !> Print a table of lambda with a row for each mode and a column for each mesh and solver ('-': the mesh does not
   !> have the mode), then a table of the errors if exact values are known. A table of one column has the errors beside
   !> the values. The reasons of failed solvers follow.
   subroutine print_frequency_table(unit, table, units)
      integer, intent(in) :: unit
      type(frequency_table_t), intent(in) :: table
      !> Units of the results
      type(units_t), intent(in) :: units

      real(wp), allocatable :: exact(:), lambda(:, :)
      character(:), allocatable :: frequency_unit
      ! factor from lambda^2 to a frequency in `frequency_unit`, and that of the prefix of this unit
      real(wp) :: hertz, prefix
      integer :: rows

      call fill_rows(table, lambda, exact)
      rows = size(exact)
      hertz = units%factor(quantity_named('frequency'))/lambda1**2
      ! the prefix of the unit suits the first mode
      call choose_prefix(hertz*maxval(lambda(:min(1, rows), 1))**2, unit_of(quantity_named('frequency'), units), &
         prefix, frequency_unit)
      hertz = prefix*hertz
      if (size(table%columns) == 1) then
         call print_column()
      else
         call print_meshes('lambda', lambda, decimals, exact)
         if (allocated(table%exact)) then
            call print_meshes('error of lambda in percent', error_in_percent(lambda(:size(table%exact), :), &
               spread(table%exact, 2, size(lambda, 2))), percent)
         end if
         if (units%are_physical) call print_meshes('frequency, '//frequency_unit, hertz*lambda**2, decimals, &
            hertz*exact**2)
      end if
      call print_notes(unit, table)

   contains

      !> Print the values of a single column with their errors.
      subroutine print_column()
         type(table_t) :: shown

         associate (column => table%columns(1))
            write (unit, '(/, 2x, a)') 'lambda, '//elements_in_words(column%elements, column%ratio)//', solver ' &
               //column%solver
         end associate
         call add_texts(shown, '', modes(rows))
         call add_numbers(shown, 'lambda', lambda(:, 1), decimals)
         if (allocated(table%exact)) then
            call add_numbers(shown, 'exact', exact, decimals)
            call add_numbers(shown, 'error %', error_in_percent(lambda(:, 1), exact), percent)
         end if
         if (units%are_physical) call add_numbers(shown, frequency_unit, hertz*lambda(:, 1)**2, six_digits)
         call print_table(unit, shown)
      end subroutine print_column

      !> Print the values of several columns, and a column of the exact values if `exact_values` is present.
      subroutine print_meshes(title, values, digits, exact_values)
         !> Heading of the table, which names the quantity
         character(*), intent(in) :: title
         !> Values to print, [modes, columns]
         real(wp), intent(in) :: values(:, :)
         !> Digits on the terminal, as in `column_t`
         integer, intent(in) :: digits
         !> Exact values, [modes]
         real(wp), intent(in), optional :: exact_values(:)

         type(table_t) :: shown
         integer :: k

         write (unit, '(/, 2x, a)') title
         call add_texts(shown, 'elements n'//line_end//'l_i/l_(i+1)'//line_end//'solver', modes(size(values, 1)))
         do k = 1, size(values, 2)
            call add_numbers(shown, heading_of(table%columns(k)), values(:, k), digits)
         end do
         if (present(exact_values) .and. allocated(table%exact)) then
            call add_numbers(shown, 'exact'//line_end//line_end, exact_values, decimals)
         end if
         call print_table(unit, shown)
      end subroutine print_meshes

   end subroutine print_frequency_table

   !> The values of a table of frequencies. They are NaN if a mesh does not have the mode, if its solver failed, and if
   !> the exact value is not known.
   pure subroutine fill_rows(table, lambda, exact)
      type(frequency_table_t), intent(in) :: table
      !> lambda_i of each column, [modes, columns]
      real(wp), allocatable, intent(out) :: lambda(:, :)
      !> Exact lambda_i, [modes]
      real(wp), allocatable, intent(out) :: exact(:)

      integer :: i, rows

      rows = 0
      if (allocated(table%exact)) rows = size(table%exact)
      rows = max(rows, maxval([(size(table%columns(i)%lambda), i=1, size(table%columns))]))
      allocate (lambda(rows, size(table%columns)), exact(rows), source=ieee_value(1.0_wp, ieee_quiet_nan))
      do i = 1, size(table%columns)
         lambda(:size(table%columns(i)%lambda), i) = table%columns(i)%lambda
      end do
      if (allocated(table%exact)) exact(:size(table%exact)) = table%exact
   end subroutine fill_rows

   !> Print the orthogonality errors of the mode shapes, the reason of each failed solver, and why `lanczos` may list
   !> fewer modes than requested.
   subroutine print_notes(unit, table)
      integer, intent(in) :: unit
      type(frequency_table_t), intent(in) :: table

      integer :: i

      if (allocated(table%shape)) write (unit, '(/, 2x, a)') 'mode shapes: orthogonal in M to ' &
         //with_two_digits(table%quality%mass_orthogonality)//', in K to ' &
         //with_two_digits(table%quality%stiffness_orthogonality)
      do i = 1, size(table%columns)
         associate (column => table%columns(i))
            if (allocated(column%failure)) call print_line(unit, '', 'no values for ' &
               //elements_in_words(column%elements, column%ratio)//', '//column%solver//': '//column%failure, width=0)
            if (column%solver == 'lanczos' .and. size(column%lambda) == column%elements) call print_line(unit, '', &
               'lanczos finds at most one mode for each of '//to_text(column%elements)//' elements', width=0)
         end associate
      end do
   end subroutine print_notes

   !> Labels of the rows: 'mode 1', 'mode 2' ...
   pure function modes(count) result(names)
      integer, intent(in) :: count
      character(16) :: names(count)

      integer :: i

      do i = 1, count
         names(i) = 'mode '//to_text(i)
      end do
   end function modes

   !> Heading of a column: number of elements, length ratio and solver, a line each.
   pure function heading_of(column) result(heading)
      type(frequency_column_t), intent(in) :: column
      character(:), allocatable :: heading

      heading = 'given'
      if (column%ratio > 0.0_wp) heading = rounded(column%ratio)
      heading = to_text(column%elements)//line_end//heading//line_end//column%solver
   end function heading_of

   !> Write the table of frequencies. The value is NaN if a mesh does not have the mode or its solver failed.
   subroutine write_frequencies(group, table)
      type(quantity_group_t), intent(in) :: group
      type(frequency_table_t), intent(in) :: table

      character(*), parameter :: column_coordinates = 'column_solver column_elements column_ratio'
      integer, parameter :: max_failure_length = 200
      type(quantity_group_t) :: shapes
      character(name_length) :: solver(size(table%columns))
      ! why the solver of a column failed; empty: it succeeded
      character(max_failure_length) :: failure(size(table%columns))
      integer :: column, columns, i
      real(wp) :: ratio(size(table%columns))
      real(wp), allocatable :: exact(:), lambda(:, :)

      columns = size(table%columns)
      call fill_rows(table, lambda, exact)
      lambda = transpose(lambda)
      ratio = merge(table%columns%ratio, ieee_value(1.0_wp, ieee_quiet_nan), table%columns%ratio > 0.0_wp)
      do column = 1, columns
         solver(column) = table%columns(column)%solver
         failure(column) = ''
         if (allocated(table%columns(column)%failure)) failure(column) = table%columns(column)%failure
      end do

      call group%add('mode', [(i, i=1, size(exact))], '1', 'mode', is_scale=.true.)
      call group%add('column', [(i, i=1, columns)], '1', 'column of the table: a solver on a mesh', is_scale=.true.)
      call group%add('column_solver', solver, 'none', 'solver', along='column')
      call group%add('column_elements', [table%columns%elements], '1', 'number of elements n', along='column')
      call group%add('column_ratio', ratio, '1', 'ratio of neighbouring lengths l_i/l_(i+1); NaN: nodes as given', &
         along='column')
      call group%add('column_failure', failure, 'none', 'why the solver gave no values; empty: it gave some', &
         along='column')
      call group%add('lambda', lambda, '1', 'lambda: omega = lambda^2 sqrt(E Ibar/(rho Abar L^4))', &
         'column mode')
      call group%attribute('coordinates', column_coordinates, 'lambda')
      call group%put('omega', (lambda/lambda1)**2, 'frequency', '{circular frequency in omega1~frequency}', &
         'column mode')
      call group%attribute('coordinates', column_coordinates, group%named('omega'))
      if (allocated(table%exact)) then
         call group%add('lambda_exact', table%exact, '1', 'exact lambda', along='mode')
         call group%add('error', error_in_percent(lambda, spread(exact, 1, columns)), 'percent', &
            'error of lambda against the exact value', 'column mode')
         call group%attribute('coordinates', column_coordinates, 'error')
      end if
      if (.not. allocated(table%shape)) return
      ! the mode shapes on the first mesh
      shapes = group%subgroup('shapes')
      call shapes%add('mode', [(i, i=1, size(table%shape, 2))], '1', 'mode', is_scale=.true.)
      call shapes%put('x', table%node, 'length', 'position of the nodes{ x/L}', is_scale=.true.)
      call shapes%add('displacement', table%shape, '1', 'mode shape of unit modal mass (mass in rho Abar L)', 'x mode')
      if (allocated(table%shape_slope)) call shapes%put('slope', table%shape_slope, &
         trim(merge('per_length', 'number    ', group%units%are_physical)), 'its derivative by {x/L~x}', 'x mode')
      call shapes%add('mass_orthogonality', table%quality%mass_orthogonality, '1', 'largest |phi_i.M phi_j - delta_ij|')
      call shapes%add('stiffness_orthogonality', table%quality%stiffness_orthogonality, '1', &
         'largest |phi_i.K phi_j/(lambda_i lambda_j)^2 - delta_ij|')
   end subroutine write_frequencies

end module frequency_results
