!> Discretisation errors of the measures of some runs, estimated from three meshes of which each has twice as many
!> elements as the preceding mesh.
module mesh_errors
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
   use kinds, only: wp
   use measure_list, only: force_window, measure_count, measure_mean_force, measure_table
   use number_text, only: to_text
   use quantities, only: name_in_results, units_t
   use quantity_groups, only: quantity_group_t
   use reader_units, only: choose_prefix, phrase, unit_in
   use table_columns, only: add_numbers, add_texts, print_table, table_t, two_digits
   implicit none (type, external)
   private
   public :: mesh_errors_t, estimate_mesh_error, write_mesh_errors, print_mesh_errors

   !> The estimates for some runs.
   type :: mesh_errors_t
      !> Numbers of the cases, 1 for a single run, [cases]
      integer, allocatable :: case(:)
      !> Elements of the coarsest of the three meshes, [cases]
      integer, allocatable :: elements(:)
      !> Measures on the coarsest mesh, [measure_count, cases]
      real(wp), allocatable :: row(:, :)
      !> Estimated errors of `row`, NaN: no estimate is possible, [measure_count, cases]
      real(wp), allocatable :: error(:, :)
      !> Observed orders of convergence, NaN: none was observed, [measure_count, cases]
      real(wp), allocatable :: order(:, :)
   end type mesh_errors_t

contains

   !> Estimate the discretisation error of a measure and its order of convergence. If the difference of the two finer
   !> meshes is not clearly smaller than that of the two coarser meshes, the measure does not converge (for instance
   !> because of chatter), and no estimate is possible.
   elemental subroutine estimate_mesh_error(coarse, medium, fine, is_whole, error, order)
      !> Value on the coarse mesh; NaN: the event of the measure did not happen
      real(wp), intent(in) :: coarse
      !> Value on the medium mesh
      real(wp), intent(in) :: medium
      !> Value on the fine mesh
      real(wp), intent(in) :: fine
      !> Whether the measure is a count
      logical, intent(in) :: is_whole
      !> Estimated error of `coarse`; NaN: no estimate is possible
      real(wp), intent(out) :: error
      !> Observed order of convergence; NaN: none was observed
      real(wp), intent(out) :: order

      ! relative differences below this are rounding errors
      real(wp), parameter :: rounding = 1.0e-11_wp
      ! minimum of plausible orders of convergence; the elements converge with order four
      real(wp), parameter :: min_order = 0.5_wp
      ! maximum of plausible orders; peaks seldom converge faster than with order four
      real(wp), parameter :: max_order = 6.0_wp
      ! differences of neighbouring meshes
      real(wp) :: coarse_difference, fine_difference

      order = ieee_value(1.0_wp, ieee_quiet_nan)
      error = order
      if (any(ieee_is_nan([coarse, medium, fine]))) return
      coarse_difference = abs(coarse - medium)
      fine_difference = abs(medium - fine)
      if (max(coarse_difference, fine_difference) <= rounding*max(1.0_wp, abs(coarse))) then
         error = 0.0_wp
      else if (.not. is_whole .and. fine_difference*2.0_wp**min_order < coarse_difference) then
         order = max_order
         if (fine_difference*2.0_wp**max_order > coarse_difference) then
            order = log(coarse_difference/fine_difference)/log(2.0_wp)
         end if
         ! Richardson extrapolation
         error = coarse_difference/(1.0_wp - 0.5_wp**order)
      end if
   end subroutine estimate_mesh_error

   !> Write the group of the estimates: for each measure a dataset of errors and a dataset of orders over the cases.
   subroutine write_mesh_errors(group, errors)
      type(quantity_group_t), intent(in) :: group
      type(mesh_errors_t), intent(in) :: errors

      ! the group without multiplication of values by the units of the results
      type(quantity_group_t) :: unscaled
      integer :: i

      unscaled = group%unscaled()
      call unscaled%put('case', errors%case, 'case; 1 for a single run', is_scale=.true.)
      call unscaled%put('elements', errors%elements, &
         'elements of its mesh; compared with twice and four times as many', 'case')
      do i = 1, measure_count
         associate (measure => measure_table(i))
            if (.not. is_shown(i)) cycle
            if (measure%group /= '' .and. all(ieee_is_nan(errors%row(i, :)))) cycle
            call unscaled%put(trim(measure%name), [errors%error(i, :)], measure%quantity, &
               'estimated discretisation error; nan: it does not converge: '//measure%meaning, 'case')
            call unscaled%put('order_'//trim(measure%name), [errors%order(i, :)], 'number', &
               'observed order of convergence; nan: none', 'case')
         end associate
      end do
   end subroutine write_mesh_errors

   !> Print a table: value, error and order of each measure for one run; the maximum error of each measure for several
   !> runs.
   subroutine print_mesh_errors(unit, errors, units)
      !> Unit number of the output
      integer, intent(in) :: unit
      type(mesh_errors_t), intent(in) :: errors
      !> Units of the results
      type(units_t), intent(in) :: units

      type(table_t) :: table
      character(64) :: labels(measure_count)
      character(24) :: estimated(measure_count)
      character(:), allocatable :: prefixed_unit
      real(wp), dimension(measure_count) :: factors, max_error
      integer, allocatable :: shown(:)
      integer :: cases, i

      cases = size(errors%case)
      ! measures of events that happened in no case are left out
      shown = pack([(i, i=1, measure_count)], [(is_shown(i) .and. .not. all(ieee_is_nan(errors%row(i, :))), &
         i=1, measure_count)])
      factors = 1.0_wp
      do i = 1, measure_count
         associate (values => errors%row(i, :), known => .not. ieee_is_nan(errors%error(i, :)))
            labels(i) = name_in_results(measure_table(i)%name)
            call choose_prefix(maxval(abs(values), mask=.not. ieee_is_nan(values)), &
               unit_in(units, measure_table(i)%quantity), factors(i), prefixed_unit)
            if (prefixed_unit /= '') labels(i) = trim(labels(i))//', '//prefixed_unit
            if (i == measure_mean_force) labels(i) = trim(labels(i)) &
               //phrase(units, ', over the first ', 'time', force_window)
            max_error(i) = ieee_value(1.0_wp, ieee_quiet_nan)
            if (any(known)) max_error(i) = factors(i)*maxval(errors%error(i, :), mask=known)
            estimated(i) = to_text(count(known))//' of '//to_text(cases)
         end associate
      end do
      call add_texts(table, 'measure', labels(shown))
      if (cases == 1) then
         write (unit, '(/, 2x, a)') 'Discretisation error, from '//to_text(errors%elements(1))//', '// &
            to_text(2*errors%elements(1))//' and '//to_text(4*errors%elements(1))//' elements'
         call add_numbers(table, 'value', factors(shown)*errors%row(shown, 1), 6)
         call add_numbers(table, 'error', max_error(shown), two_digits, none='does not converge')
         call add_numbers(table, 'order', errors%order(shown, 1), 1)
      else
         write (unit, '(/, 2x, a)') 'Discretisation error in '//to_text(cases)// &
            ' of the cases, each from its mesh and two finer'
         call add_numbers(table, 'maximum error', max_error(shown), two_digits, none='none')
         call add_texts(table, 'converged', estimated(shown))
      end if
      call print_table(unit, table)
   end subroutine print_mesh_errors

   !> Whether the measure has a discretisation error that is worth showing.
   pure logical function is_shown(measure) result(answer)
      !> Index in `measure_table`
      integer, intent(in) :: measure

      answer = all(measure_table(measure)%name /= [character(24) :: 'status', 'mesh_elements', 'extremes_tolerance'])
   end function is_shown

end module mesh_errors
