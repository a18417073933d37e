!> The group of frequencies and mode shapes in a results file.
module frequency_groups
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use frequency_types, only: error_in_percent, frequency_table_t
   use kinds, only: lambda1, wp
   use quantity_groups, only: quantity_group_t
   use run_settings, only: name_length
   implicit none (type, external)
   private
   public :: write_frequencies

contains

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
      integer :: column, columns, elements(size(table%columns)), i, modes, rows
      real(wp) :: nan, ratio(size(table%columns))
      real(wp), allocatable :: error(:, :), lambda(:, :), omega(:, :)

      columns = size(table%columns)
      rows = 0
      if (allocated(table%exact)) rows = size(table%exact)
      do column = 1, columns
         rows = max(rows, size(table%columns(column)%lambda))
      end do
      nan = ieee_value(nan, ieee_quiet_nan)
      allocate (lambda(columns, rows), omega(columns, rows), error(columns, rows), source=nan)
      do column = 1, columns
         solver(column) = table%columns(column)%solver
         failure(column) = ''
         if (allocated(table%columns(column)%failure)) failure(column) = table%columns(column)%failure
         elements(column) = table%columns(column)%elements
         ratio(column) = merge(table%columns(column)%ratio, nan, table%columns(column)%ratio > 0.0_wp)
         modes = size(table%columns(column)%lambda)
         lambda(column, :modes) = table%columns(column)%lambda
         omega(column, :modes) = (table%columns(column)%lambda/lambda1)**2
         if (.not. allocated(table%exact)) cycle
         modes = min(modes, size(table%exact))
         error(column, :modes) = error_in_percent(table%columns(column)%lambda(:modes), table%exact(:modes))
      end do

      call group%add('mode', [(i, i=1, rows)], '1', 'mode', is_scale=.true.)
      call group%add('column', [(i, i=1, columns)], '1', 'column of the table: a solver on a mesh', is_scale=.true.)
      call group%add('column_solver', solver, 'none', 'solver', along='column')
      call group%add('column_elements', elements, '1', 'number of elements n', along='column')
      call group%add('column_ratio', ratio, '1', 'ratio of neighbouring lengths l_i/l_(i+1); NaN: nodes as given', &
         along='column')
      call group%add('column_failure', failure, 'none', 'why the solver gave no values; empty: it gave some', &
         along='column')
      call group%add('lambda', lambda, '1', 'lambda: omega = lambda^2 sqrt(E Ibar/(rho Abar L^4))', &
         'column mode')
      call group%attribute('coordinates', column_coordinates, 'lambda')
      call group%put('omega', omega, 'frequency', '{circular frequency in omega1~frequency}', 'column mode')
      call group%attribute('coordinates', column_coordinates, group%named('omega'))
      if (allocated(table%exact)) then
         call group%add('lambda_exact', table%exact, '1', 'exact lambda', along='mode')
         call group%add('error', error, 'percent', 'error of lambda against the exact value', 'column mode')
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

end module frequency_groups
