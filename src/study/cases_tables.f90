!> The table of several cases for people to read.
module cases_tables
   use case_runs, only: case_t
   use kinds, only: wp
   use number_text, only: to_text
   use response_types, only: quiet_level
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: print_cases

contains

   !> One line a case.
   subroutine print_cases(unit, scene, cases)
      !> Where to
      integer, intent(in) :: unit
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Its cases
      type(case_t), intent(in) :: cases(:)

      integer, parameter :: width = 16
      character(width) :: quiet, spent, peak, value
      integer :: i

      write (unit, '(2x, a)') 'the first of '//to_text(size(cases))//' cases; in the others another '// &
         trim(scene%cases%parameter%name)
      write (quiet, '(a, i0, a)') '|eta| > ', nint(100.0_wp*quiet_level), ' %'
      write (unit, '(/, 2x, 3a16, a9, 3a16)') adjustr(scene%cases%parameter%name(:width)), &
         'first impact', 'velocity', 'impacts', 'highest rebound', adjustr(quiet), 'energy < 1 %'
      do i = 1, size(cases)
         associate (measures => cases(i)%response%measures)
            value = to_text(cases(i)%value)
            value = adjustr(value)
            quiet = 'to the end'
            if (measures%is_quiet) write (quiet, '(f0.4)') measures%quiet_tau
            spent = 'never'
            if (measures%has_spent) write (spent, '(f0.4)') measures%spent_tau
            peak = 'none'
            if (measures%rebounds > 0) write (peak, '(f0.4)') maxval(measures%peak_eta)
            if (measures%has_met_stop) then
               write (unit, '(2x, a16, 2f16.6, i9, 3a16)') value, measures%first_impact_tau, &
                  measures%first_impact_velocity, measures%impacts, adjustr(peak), adjustr(quiet), adjustr(spent)
            else
               write (unit, '(2x, a16, a32, i9, 3a16)') value, 'does not meet the stop', measures%impacts, &
                  adjustr(peak), adjustr(quiet), adjustr(spent)
            end if
         end associate
      end do
   end subroutine print_cases

end module cases_tables
