!> The table of several cases for people to read.
module cases_tables
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use case_runs, only: case_t
   use kinds, only: wp
   use measure_list, only: measure_count, measure_named, measure_table
   use number_text, only: to_text
   use run_measures, only: row_of
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: print_cases

   integer, parameter :: width = 20
   !> Measures that cases are compared by
   character(*), parameter :: shown(*) = [character(24) :: &
      'impacts', 'first_impact_tau', 'first_impact_velocity', 'quiet_tau', 'spent_tau']

contains

   !> One line a case: its value, measures, its highest rebound.
   subroutine print_cases(unit, scene, cases)
      !> Where to
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      type(case_t), intent(in) :: cases(:)

      character(width) :: cells(size(shown) + 2)
      real(wp) :: row(measure_count)
      integer :: i, k

      write (unit, '(2x, a)') 'the first of '//to_text(size(cases))//' cases; in the others another '// &
         trim(scene%cases%parameter%name)
      cells(1) = scene%cases%parameter%name(:width)
      do k = 1, size(shown)
         cells(k + 1) = measure_table(measure_named(shown(k)))%label
      end do
      cells(size(cells)) = 'highest rebound'
      write (unit, '(/, 2x, *(a))') adjustr(cells)
      do i = 1, size(cases)
         row = row_of(cases(i)%response%measures)
         cells(:) = '-'
         cells(1) = to_text(cases(i)%value)
         do k = 1, size(shown)
            associate (measure => measure_named(shown(k)))
               if (measure_table(measure)%is_whole) then
                  cells(k + 1) = to_text(nint(row(measure)))
               else if (.not. ieee_is_nan(row(measure))) then
                  write (cells(k + 1), '(f20.6)') row(measure)
               end if
            end associate
         end do
         associate (peaks => cases(i)%response%measures%peak_eta)
            if (size(peaks) > 0) write (cells(size(cells)), '(f20.6)') maxval(peaks)
         end associate
         write (unit, '(2x, *(a))') adjustr(cells)
      end do
   end subroutine print_cases

end module cases_tables
