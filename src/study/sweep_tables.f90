!> What a sweep says on standard output: its size, how it went, its best cases.
module sweep_tables
   use kinds, only: wp
   use measure_list, only: measure_table
   use number_text, only: rounded, to_text
   use scene_types, only: scene_t
   use sweep_best, only: best_t, refined_t
   use sweep_file, only: survey_t
   use sweep_plan, only: plan_t
   use sweep_settings, only: goal_names
   implicit none (type, external)
   private
   public :: print_sweep

   integer, parameter :: width = 12

contains

   !> The tables of a finished sweep.
   subroutine print_sweep(unit, scene, plan, survey, refined, fresh, seconds, workers)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      !> What its parts hold
      type(survey_t), intent(in) :: survey
      !> Better cases
      type(refined_t), intent(in) :: refined
      !> Cases that were not on disk already, and the seconds they took
      integer, intent(in) :: fresh
      real(wp), intent(in) :: seconds
      !> Threads and processes in words
      character(*), intent(in) :: workers

      integer :: k

      write (unit, '(a)') scene%name//': '//scene%title
      do k = 1, size(plan%axes)
         associate (axis => plan%axes(k))
            write (unit, '(2x, a20, a)') axis%parameter%name, values_in_words(k)
         end associate
      end do
      write (unit, '(2x, a20, a)') 'cases               ', to_text(plan%cases)//failed_in_words()
      if (fresh < plan%cases) write (unit, '(2x, a20, a)') '                    ', &
         to_text(plan%cases - fresh)//' of them were found done'
      if (fresh > 0) write (unit, '(2x, a20, a)') 'run time            ', seconds_in_words(seconds)//', ' &
         //to_text(nint(real(fresh, wp)/max(seconds, 1.0e-3_wp)))//' cases a second, '//workers
      do k = 1, min(size(survey%failed), 3)
         write (unit, '(2x, a)') 'case '//to_text(survey%failed(k))//' failed: '//trim(survey%reasons(k))
      end do
      if (.not. scene%wants_best) return
      call print_best(unit, scene, plan, survey%best)
      if (refined%count > 0) call print_refined(unit, scene, plan, refined)

   contains

      !> The values of an axis.
      function values_in_words(axis) result(words)
         !> Its number
         integer, intent(in) :: axis
         character(:), allocatable :: words

         associate (it => plan%axes(axis))
            words = rounded(it%least)//' to '//rounded(it%most)
            if (plan%is_grid) words = words//', '//to_text(size(it%values))//' values'
            if (it%is_logarithmic) words = words//' evenly in the logarithm'
         end associate
      end function values_in_words

      !> How many failed.
      function failed_in_words() result(words)
         character(:), allocatable :: words

         words = ''
         if (survey%failures > 0) words = ', of which '//to_text(survey%failures)//' failed'
      end function failed_in_words

   end subroutine print_sweep

   !> The best cases, one a line.
   subroutine print_best(unit, scene, plan, best)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      type(best_t), intent(in) :: best

      integer :: i, k

      associate (column => scene%best%measure)
         write (unit, '(/, 2x, a)') trim(goal_names(scene%best%goal))//' '//trim(measure_table(column)%name)
         if (best%count == 0) then
            write (unit, '(2x, a)') 'no case has one'
            return
         end if
         write (unit, '(2x, *(a))') cell('case'), (cell(trim(plan%axes(k)%parameter%name)), k=1, size(plan%axes)), &
            cell(trim(measure_table(column)%name))
         do i = 1, best%count
            write (unit, '(2x, *(a))') cell(to_text(best%case(i))), &
               (cell(rounded(best%values(k, i))), k=1, size(plan%axes)), cell(rounded(best%rows(column, i)))
         end do
      end associate
   end subroutine print_best

   !> The best case of the sweep and the best that the refinement found.
   subroutine print_refined(unit, scene, plan, refined)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      !> What was found
      type(refined_t), intent(in) :: refined

      integer :: k

      associate (column => scene%best%measure, last => refined%count)
         write (unit, '(/, 2x, a)') 'refined with '//to_text(refined%all_evaluations)//' more cases: ' &
            //trim(measure_table(column)%name)//' from '//rounded(refined%rows(column, 1))//' to ' &
            //rounded(refined%rows(column, last))
         write (unit, '(2x, *(a))') cell(''), (cell(trim(plan%axes(k)%parameter%name)), k=1, size(plan%axes)), &
            cell(trim(measure_table(column)%name))
         write (unit, '(2x, *(a))') cell('best'), (cell(rounded(refined%values(k, last))), k=1, size(plan%axes)), &
            cell(rounded(refined%rows(column, last)))
      end associate
   end subroutine print_refined

   !> A text at the right of a column.
   pure function cell(text) result(padded)
      character(*), intent(in) :: text
      character(max(width, len(text)) + 2) :: padded

      padded = text
      padded = adjustr(padded)
   end function cell

   !> Such as '0.32 s' and '12 s'.
   function seconds_in_words(seconds) result(words)
      real(wp), intent(in) :: seconds
      character(:), allocatable :: words

      words = to_text(real(nint(100.0_wp*min(seconds, 1.0e7_wp)), wp)/100.0_wp)//' s'
   end function seconds_in_words

end module sweep_tables
