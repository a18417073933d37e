!> Measures in files of one run or of several cases: a dataset for each that the table gives a name there.
module measure_rows
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use hdf5_writing, only: hdf5_group_t
   use kinds, only: wp
   use measure_list, only: measure_count, measure_table
   implicit none (type, external)
   private
   public :: write_measures_of_run, write_measures_of_cases

contains

   !> One number a measure; what did not happen is left out.
   subroutine write_measures_of_run(group, row, in_scene_units)
      type(hdf5_group_t), intent(in) :: group
      !> [measure_count]
      real(wp), intent(in) :: row(:)
      !> One unit of each measure in the units of the scene; 0: not known
      real(wp), intent(in) :: in_scene_units(:)

      integer :: i

      do i = 1, measure_count
         associate (measure => measure_table(i))
            if (measure%run_name == '') cycle
            ! a share of no energy is no number, but is there
            if (ieee_is_nan(row(i)) .and. measure%unit /= '1') cycle
            if (measure%is_whole) then
               call group%add(trim(measure%run_name), nint(row(i)), '1', trim(measure%meaning))
            else
               call group%add(trim(measure%run_name), row(i), '1', trim(measure%meaning), in_scene_units(i))
            end if
         end associate
      end do
   end subroutine write_measures_of_run

   !> One list a measure.
   subroutine write_measures_of_cases(group, names, units, rows, along, in_scene_units)
      type(hdf5_group_t), intent(in) :: group
      !> Of the datasets, [measure_count]; empty: it is left out
      character(*), intent(in) :: names(:)
      character(*), intent(in) :: units(:)
      !> [measure_count, cases]
      real(wp), intent(in) :: rows(:, :)
      !> Dimension scale of the cases
      character(*), intent(in) :: along
      !> One unit of each measure in the units of the scene; 0: not known
      real(wp), intent(in), optional :: in_scene_units(:)

      real(wp) :: column(size(rows, 2)), known(measure_count)
      integer :: i

      known = 0.0_wp
      if (present(in_scene_units)) known = in_scene_units
      do i = 1, measure_count
         if (names(i) == '') cycle
         column = rows(i, :)
         if (measure_table(i)%is_whole) then
            call group%add(trim(names(i)), nint(column), trim(units(i)), trim(measure_table(i)%meaning), along)
         else
            call group%add(trim(names(i)), column, trim(units(i)), trim(measure_table(i)%meaning), along, &
               in_scene_units=known(i))
         end if
      end do
   end subroutine write_measures_of_cases

end module measure_rows
