!> Datasets of the measures, the scalar results of a run, in the results files of one run or of several cases. A row has
!> all measures of one run in the order of `measure_table`.
module measure_rows
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use kinds, only: wp
   use measure_list, only: measure_count, measure_force, measure_mean_force, measure_table
   use number_text, only: rounded, to_text
   use quantities, only: quantity_named, units_t
   use quantity_groups, only: quantity_group_t
   implicit none (type, external)
   private
   public :: write_measures_of_run, write_measure_lists, row_in_units, extremes_in_words

contains

   !> Write one number for each measure to which `measure_table` gives a name of a dataset. Measures of events that did
   !> not happen are left out.
   subroutine write_measures_of_run(group, row)
      type(quantity_group_t), intent(in) :: group
      !> Dimensionless measures, [measure_count]
      real(wp), intent(in) :: row(:)

      integer :: i

      do i = 1, measure_count
         associate (measure => measure_table(i))
            if (measure%run_name == '') cycle
            ! shares of the initial energy are NaN if the beam starts at rest, or if it has no static equilibrium; they
            ! are written nevertheless
            if (ieee_is_nan(row(i)) .and. (measure%quantity /= 'number' .or. measure%group /= '')) cycle
            if (measure%is_whole) then
               call group%put(trim(measure%run_name), nint(row(i)), measure%meaning)
            else
               call group%put(trim(measure%run_name), row(i), measure%quantity, measure%meaning)
            end if
         end associate
      end do
   end subroutine write_measures_of_run

   !> Convert measures to the units of the results.
   pure function row_in_units(units, row) result(converted)
      type(units_t), intent(in) :: units
      !> Dimensionless measures, [measure_count]
      real(wp), intent(in) :: row(:)
      real(wp) :: converted(measure_count)

      integer :: i

      converted = row
      if (.not. units%are_physical) return
      do i = 1, measure_count
         ! a run has few of all measures, and in a short run the search for names of quantities takes long
         if (ieee_is_nan(row(i))) cycle
         if (measure_table(i)%quantity /= 'number') converted(i) = row(i)*units%factor(quantity_named( &
            measure_table(i)%quantity))
      end do
   end function row_in_units

   !> Write for each measure a list over cases or contacts. Lists of forces, and of measures that need a group of the
   !> scene, are left out if they have no value.
   subroutine write_measure_lists(group, names, rows, along)
      type(quantity_group_t), intent(in) :: group
      !> Names of the datasets, [measure_count]; a measure with an empty name is left out
      character(*), intent(in) :: names(:)
      !> Measures, [measure_count, cases or contacts]
      real(wp), intent(in) :: rows(:, :)
      !> Dimension scale of the cases or contacts
      character(*), intent(in) :: along

      integer :: i

      do i = 1, measure_count
         if (names(i) == '') cycle
         if ((measure_table(i)%group /= '' .or. any(i == [measure_force, measure_mean_force])) .and. &
            all(ieee_is_nan(rows(i, :)))) cycle
         ! a case that failed has no number, which only real numbers can express
         if (measure_table(i)%is_whole .and. .not. any(ieee_is_nan(rows(i, :)))) then
            call group%put(trim(names(i)), nint(rows(i, :)), measure_table(i)%meaning, along)
         else
            call group%put(trim(names(i)), [rows(i, :)], measure_table(i)%quantity, measure_table(i)%meaning, along)
         end if
      end do
   end subroutine write_measure_lists

   !> How certain the extremes of some runs are, in words; empty: all are certain to the usual tolerance.
   pure function extremes_in_words(tolerance) result(words)
      !> Tolerance of the extremes of each run; NaN: the usual tolerance
      real(wp), intent(in) :: tolerance(:)
      character(:), allocatable :: words

      words = ''
      associate (raised => pack(tolerance, .not. ieee_is_nan(tolerance)))
         if (size(raised) == 0) return
         words = 'certain within '//rounded(maxval(raised))//' of themselves'
         if (size(tolerance) > 1) words = 'in '//to_text(size(raised))//' of '//to_text(size(tolerance)) &
            //' cases '//words
      end associate
   end function extremes_in_words

end module measure_rows
