!> What &statistics says on standard output: a line for each surface.
module statistic_tables
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use console_tables, only: fill_column, surface_label
   use kinds, only: wp
   use measure_list, only: first_statistic, measure_count, measure_named
   use measure_rows, only: row_in
   use number_text, only: to_text
   use quantities, only: units_t
   use reader_units, only: reading_in
   use response_types, only: surface_record_t
   use statistic_types, only: run_statistics_t
   use text_columns, only: fixed, print_columns
   implicit none (type, external)
   private
   public :: print_statistics

contains

   subroutine print_statistics(unit, statistics, surfaces, units)
      integer, intent(in) :: unit
      type(run_statistics_t), intent(in) :: statistics
      type(surface_record_t), intent(in) :: surfaces(:)
      !> What results are in
      type(units_t), intent(in) :: units

      integer, parameter :: column_width = 12, size_of_heading = 32
      character(*), parameter :: shown(*) = [character(24) :: 'mean_force', 'rms_force', 'maximum_force', &
         'contact_share', 'impact_rate', 'mean_impact_velocity', 'mean_impulse', 'rms_displacement']
      character(*), parameter :: titles(*) = [character(24) :: 'mean force', 'RMS force', 'greatest force', &
         'share in contact', 'impact rate', 'mean velocity', 'mean impulse', 'RMS displacement']
      !> The last column of forces, and those of the rest
      integer, parameter :: forces = 5, others(*) = [1, 6, 7, 8, 9]
      character(column_width) :: cells(size(shown) + 1, size(surfaces))
      character(size_of_heading) :: headings(size(shown) + 1)
      real(wp) :: rows(measure_count, size(surfaces))
      integer :: i, k

      write (unit, '(/, 2x, a)') 'statistics from '//instant(statistics%edge(0))//' to ' &
         //instant(statistics%edge(size(statistics%edge) - 1))//' in '//to_text(size(statistics%edge) - 1)//' blocks'
      headings(1) = 'stop'
      rows = ieee_value(1.0_wp, ieee_quiet_nan)
      do i = 1, size(surfaces)
         rows(first_statistic:, i) = statistics%value(:, i)
         rows(:, i) = row_in(units, rows(:, i))
         cells(1, i) = surface_label(surfaces(i))
      end do
      do k = 1, size(shown)
         call fill_column(measure_named(shown(k)), rows, trim(titles(k)), units, headings(k + 1), cells(k + 1, :))
      end do
      if (size(surfaces) == 0) return
      ! side by side they are wider than a terminal
      call print_columns(unit, headings(:forces), cells(:forces, :))
      write (unit, '()')
      call print_columns(unit, headings(others), cells(others, :))

   contains

      pure function instant(tau) result(words)
         real(wp), intent(in) :: tau
         character(:), allocatable :: words

         if (units%are_of_scene) then
            words = 't = '//reading_in(units, 'time', tau)
         else
            words = 'tau = '//fixed(tau, 6)
         end if
      end function instant
   end subroutine print_statistics

end module statistic_tables
