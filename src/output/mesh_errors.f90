!> What the mesh does to the measures of some runs: estimates from three meshes, each twice as fine as the one before.
module mesh_errors
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
   use kinds, only: i8, wp
   use measure_list, only: measure_count, measure_table
   use number_text, only: to_text
   use printable_text, only: character_count
   use quantities, only: name_in, quantity_named, unit_of, units_t
   use quantity_groups, only: quantity_group_t
   use reader_units, only: find_prefix
   implicit none (type, external)
   private
   public :: mesh_errors_t, judge, write_mesh_errors, print_mesh_errors

   type :: mesh_errors_t
      !> Numbers of the cases, 1 for a single run, [cases]
      integer, allocatable :: case(:)
      !> Elements of the coarsest of the three meshes, [cases]
      integer, allocatable :: elements(:)
      !> Measures on it; estimates of their errors, NaN: not to be told; and the orders seen, NaN: none,
      !> [measure_count, cases]
      real(wp), allocatable :: row(:, :)
      real(wp), allocatable :: error(:, :)
      real(wp), allocatable :: order(:, :)
   end type mesh_errors_t

   !> Width of names with their units.
   integer, parameter :: label_width = 28

contains

   !> Error of a measure and order of its convergence. Where the finer two meshes differ hardly less than the coarser
   !> two, chatter has taken over from the mesh, and a number would be chance.
   elemental subroutine judge(value, finer, finest, is_whole, error, order)
      !> On the three meshes; NaN: it did not happen
      real(wp), intent(in) :: value
      real(wp), intent(in) :: finer
      real(wp), intent(in) :: finest
      !> A count
      logical, intent(in) :: is_whole
      !> Of the first; NaN: not to be told
      real(wp), intent(out) :: error
      !> NaN: none was seen
      real(wp), intent(out) :: order

      ! differences below it are rounding; the order of the elements is four, that of peaks seldom more
      real(wp), parameter :: rounding = 1.0e-11_wp, least_order = 0.5_wp, most_order = 6.0_wp
      real(wp) :: coarse, fine

      order = ieee_value(1.0_wp, ieee_quiet_nan)
      error = order
      if (any(ieee_is_nan([value, finer, finest]))) return
      coarse = abs(value - finer)
      fine = abs(finer - finest)
      if (max(coarse, fine) <= rounding*max(1.0_wp, abs(value))) then
         error = 0.0_wp
      else if (.not. is_whole .and. fine*2.0_wp**least_order < coarse) then
         order = most_order
         if (fine*2.0_wp**most_order > coarse) order = log(coarse/fine)/log(2.0_wp)
         error = coarse/(1.0_wp - 0.5_wp**order)
      end if
   end subroutine judge

   !> The group of the estimates: a dataset a measure along the cases, and the same of orders.
   subroutine write_mesh_errors(group, errors)
      type(quantity_group_t), intent(in) :: group
      type(mesh_errors_t), intent(in) :: errors

      type(quantity_group_t) :: own
      integer :: i

      own = group%as_they_are()
      call own%put('case', errors%case, 'case; 1 for a single run', is_scale=.true.)
      call own%put('elements', errors%elements, &
         'elements of its mesh; compared with twice and four times as many', 'case')
      do i = 1, measure_count
         associate (measure => measure_table(i))
            if (.not. is_shown(i)) cycle
            if (measure%group /= '' .and. all(ieee_is_nan(errors%row(i, :)))) cycle
            call own%put(trim(measure%name), [errors%error(i, :)], measure%quantity, &
               'estimated error of the mesh; nan: it does not settle: '//measure%meaning, 'case')
            call own%put('order_'//trim(measure%name), [errors%order(i, :)], 'number', &
               'order of convergence seen; nan: none', 'case')
         end associate
      end do
   end subroutine write_mesh_errors

   !> A table: of one run value, error and order of each measure; of several the greatest error.
   subroutine print_mesh_errors(unit, errors, units)
      !> Where to
      integer, intent(in) :: unit
      type(mesh_errors_t), intent(in) :: errors
      !> What they are in
      type(units_t), intent(in) :: units

      character(label_width), parameter :: heading = 'measure'
      character(12) :: last
      character(:), allocatable :: label
      real(wp) :: factor
      integer :: cases, i, settled

      cases = size(errors%case)
      write (unit, '()')
      if (cases == 1) then
         write (unit, '(2x, a)') 'Error of the mesh, from '//to_text(errors%elements(1))//', '// &
            to_text(2*errors%elements(1))//' and '//to_text(4*errors%elements(1))//' elements'
         write (unit, '(2x, a, a14, a12, a8)') heading, 'value', 'error', 'order'
      else
         write (unit, '(2x, a)') 'Error of the mesh in '//to_text(cases)// &
            ' of the cases, each from its mesh and two finer'
         write (unit, '(2x, a, a14, a12)') heading, 'greatest error', 'settled'
      end if
      do i = 1, measure_count
         if (.not. is_shown(i)) cycle
         ! what happened nowhere
         if (all(ieee_is_nan(errors%row(i, :)))) cycle
         call find_label(i, errors%row(i, :), units, label, factor)
         settled = count(.not. ieee_is_nan(errors%error(i, :)))
         if (cases > 1) then
            last = 'none'
            if (settled > 0) last = short(factor*maxval(errors%error(i, :), &
               mask=.not. ieee_is_nan(errors%error(i, :))))
            write (unit, '(2x, a, a14, a12)') label, trim(last), &
               to_text(settled)//' of '//to_text(cases)
         else if (settled == 0) then
            write (unit, '(2x, a, f14.6, 4x, a)') label, factor*errors%row(i, 1), 'does not settle'
         else
            last = '-'
            if (.not. ieee_is_nan(errors%order(i, 1))) write (last, '(f8.1)') errors%order(i, 1)
            write (unit, '(2x, a, f14.6, a12, a8)') label, factor*errors%row(i, 1), &
               short(factor*errors%error(i, 1)), trim(adjustl(last))
         end if
      end do
   end subroutine print_mesh_errors

   !> What stands before the numbers of a measure, and what makes them of its values.
   pure subroutine find_label(measure, values, units, label, factor)
      !> Its place in the table
      integer, intent(in) :: measure
      real(wp), intent(in) :: values(:)
      !> What they are in
      type(units_t), intent(in) :: units
      character(:), allocatable, intent(out) :: label
      real(wp), intent(out) :: factor

      character(:), allocatable :: unit

      factor = 1.0_wp
      associate (quantity => measure_table(measure)%quantity)
         label = name_in(units, trim(measure_table(measure)%name))
         if (units%are_of_scene .and. quantity /= 'number') then
            call find_prefix(maxval(abs(values), mask=.not. ieee_is_nan(values)), &
               unit_of(quantity_named(quantity), units), factor, unit)
            label = label//', '//unit
         end if
         label = label//repeat(' ', int(max(0, label_width - character_count(label)), i8))
      end associate
   end subroutine find_label

   !> Does an error of this measure mean anything?
   pure function is_shown(measure) result(answer)
      !> Its place in the table
      integer, intent(in) :: measure
      logical :: answer

      answer = all(measure_table(measure)%name /= [character(24) :: 'status', 'mesh_elements'])
   end function is_shown

   !> Such as 3.1e-06.
   pure function short(value) result(text)
      real(wp), intent(in) :: value
      character(:), allocatable :: text

      character(12) :: buffer

      write (buffer, '(es9.1e2)') value
      text = trim(adjustl(buffer))
   end function short

end module mesh_errors
