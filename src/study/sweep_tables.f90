!> What a sweep says on standard output: its size, how it went, its best cases.
module sweep_tables
   use kinds, only: i8, wp
   use measure_list, only: measure_table
   use number_text, only: rounded, to_text
   use printable_text, only: character_count
   use quantities, only: name_in, quantity_named, unit_of, units_t
   use reader_units, only: find_prefix, reading
   use scene_types, only: scene_t
   use scene_units, only: units_in
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

      type(units_t) :: units
      integer :: k

      units = units_in(scene)
      write (unit, '(a)') scene%name//': '//scene%title
      do k = 1, size(plan%axes)
         associate (axis => plan%axes(k))
            if (axis%parameter%name(20:) == '') then
               write (unit, '(2x, a20, a)') axis%parameter%name, values_in_words(k)
            else
               write (unit, '(2x, a)') trim(axis%parameter%name)//' '//values_in_words(k)
            end if
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
            words = value_in_words(it%least, it%parameter%quantity, units)//' to ' &
               //value_in_words(it%most, it%parameter%quantity, units)
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

      real(wp) :: factors(size(plan%axes) + 1)
      character(:), allocatable :: heading
      integer :: i, k

      associate (column => scene%best%measure)
         write (unit, '(/, 2x, a)') trim(goal_names(scene%best%goal))//' ' &
            //name_in(units_in(scene), measure_table(column)%name)
         if (best%count == 0) then
            write (unit, '(2x, a)') 'no case has one'
            return
         end if
         call find_columns(scene, plan, best%values(:, :best%count), best%rows(column, :best%count), factors, heading)
         write (unit, '(2x, *(a))') cell('case'), heading
         do i = 1, best%count
            write (unit, '(2x, *(a))') cell(to_text(best%case(i))), &
               (cell(rounded(best%values(k, i)*factors(k))), k=1, size(plan%axes)), &
               cell(rounded(best%rows(column, i)*factors(size(factors))))
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

      character(:), allocatable :: heading
      real(wp) :: factors(size(plan%axes) + 1)
      integer :: k

      associate (column => scene%best%measure, last => refined%count)
         call find_columns(scene, plan, refined%values(:, :last), refined%rows(column, :last), factors, heading)
         associate (factor => factors(size(factors)))
            write (unit, '(/, 2x, a)') 'refined with '//to_text(refined%all_evaluations)//' more cases: ' &
               //name_in(units_in(scene), measure_table(column)%name)//' from ' &
               //rounded(refined%rows(column, 1)*factor)//' to '//rounded(refined%rows(column, last)*factor)
         end associate
         write (unit, '(2x, *(a))') cell(''), heading
         write (unit, '(2x, *(a))') cell('best'), (cell(rounded(refined%values(k, last)*factors(k))), &
            k=1, size(plan%axes)), cell(rounded(refined%rows(column, last)*factors(size(factors))))
      end associate
   end subroutine print_refined

   !> What stands over the columns of parameters and a measure, and what makes its numbers easy to read.
   subroutine find_columns(scene, plan, values, measured, factors, heading)
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      !> Parameters [axes, lines], and the measure [lines]
      real(wp), intent(in) :: values(:, :)
      real(wp), intent(in) :: measured(:)
      !> Of all columns, [axes + 1]
      real(wp), intent(out) :: factors(:)
      character(:), allocatable, intent(out) :: heading

      type(units_t) :: units
      integer :: k

      units = units_in(scene)
      heading = ''
      do k = 1, size(plan%axes)
         associate (parameter => plan%axes(k)%parameter)
            call add_heading(trim(parameter%name), parameter%quantity, maxval(abs(values(k, :))), factors(k))
         end associate
      end do
      associate (measure => measure_table(scene%best%measure))
         if (units%are_of_scene) then
            call add_heading(name_in(units, measure%name), trim(measure%quantity), maxval(abs(measured)), &
               factors(size(factors)))
         else
            call add_heading(trim(measure%name), '', 0.0_wp, factors(size(factors)))
         end if
      end associate

   contains

      subroutine add_heading(name, quantity, greatest, factor)
         character(*), intent(in) :: name
         !> Empty, or 'number': without unit
         character(*), intent(in) :: quantity
         !> Of the sizes of the numbers
         real(wp), intent(in) :: greatest
         real(wp), intent(out) :: factor

         character(:), allocatable :: read_unit

         factor = 1.0_wp
         if (quantity == '' .or. quantity == 'number') then
            heading = heading//cell(name)
            return
         end if
         call find_prefix(greatest, unit_of(quantity_named(quantity), units), factor, read_unit)
         heading = heading//cell(name//', '//read_unit)
      end subroutine add_heading

   end subroutine find_columns

   !> A value of a parameter, with its unit if it has one.
   pure function value_in_words(value, quantity, units) result(words)
      real(wp), intent(in) :: value
      !> Empty: a number
      character(*), intent(in) :: quantity
      type(units_t), intent(in) :: units
      character(:), allocatable :: words

      words = rounded(value)
      if (quantity /= '') words = reading(value, unit_of(quantity_named(quantity), units))
   end function value_in_words

   !> A text at the right of a column.
   pure function cell(text) result(padded)
      character(*), intent(in) :: text
      character(:), allocatable :: padded

      padded = repeat(' ', int(max(width - character_count(text), 0) + 2, i8))//text
   end function cell

   !> Such as '0.32 s' and '12 s'.
   function seconds_in_words(seconds) result(words)
      real(wp), intent(in) :: seconds
      character(:), allocatable :: words

      words = to_text(real(nint(100.0_wp*min(seconds, 1.0e7_wp)), wp)/100.0_wp)//' s'
   end function seconds_in_words

end module sweep_tables
