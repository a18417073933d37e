!> Prints the statements of the paper (Irie, Yamada and Asano 1977) as text: a block for each statement with its
!> measured values in every variant of computing motion, and a summary.
module statements_tables
   use kinds, only: wp
   use paper_cases, only: variant_count, variant_t, definition_count, displacement_end, energy_end
   use paper_series, only: impulse_kinds, series_symbols
   use statement_types, only: number, statement_t, verdict_in_words, verdict_names, verdict_of
   use statements_study, only: study_t
   implicit none (type, external)
   private
   public :: print_statements, print_outcomes

   !> Maximum number of characters in a line, without the margin.
   integer, parameter :: line_width = 116

contains

   !> Print all statements.
   subroutine print_statements(unit, study)
      integer, intent(in) :: unit
      type(study_t), intent(in) :: study

      integer :: i, k

      do i = 1, size(study%statements)
         associate (item => study%statements(i), variants => study%variants)
            call print_wrapped(unit, trim(item%label), trim(item%text)//' -- '//verdict_in_words(item))
            call print_wrapped(unit, '', trim(item%measure)//':')
            call print_wrapped(unit, '', deciding_values_text(item, variants))
            call print_wrapped(unit, '', item%detail)
            if (item%reason /= '') call print_wrapped(unit, '', 'Why: '//trim(item%reason)//'.')
            write (unit, '(a)') ''
         end associate
      end do
      write (unit, '(a)') 'Verdicts:'
      do k = 1, size(verdict_names)
         write (unit, '(2x, i3, 2x, a)') count([(verdict_of(study%statements(i)) == k, i=1, &
            size(study%statements))]), trim(verdict_names(k))
      end do
   end subroutine print_statements

   !> Print all computed results: convergence of the paper's first example under mesh refinement, then the ends of
   !> motion and other measures of every case in every variant.
   subroutine print_outcomes(unit, study)
      integer, intent(in) :: unit
      type(study_t), intent(in) :: study

      integer :: i, k, variant, definition
      character(14) :: cells(definition_count)

      associate (c => study%convergence)
         write (unit, '(/, a)') 'The first example (uniform, zeta = 0.001, eps = 0.6) on finer meshes, exact motion'
         write (unit, '(a6, a14, a16, 2x, a10, 5a14)') 'n', 'first impact', 'mass in impact', 'reading', 'main peak', &
            '|eta| > 2 %', 'energy < 1 %', 'lost, impacts', 'created'
         do k = 1, size(impulse_kinds)
            do i = 1, size(c%elements)
               associate (outcome => c%outcome(i, k))
                  cells(:2) = [character(14) :: number(outcome%end_tau(displacement_end), 4), &
                     number(outcome%end_tau(energy_end), 4)]
                  write (unit, '(i6, f14.7, f16.6, 4x, a8, f14.6, 2a14, 2f14.6)') c%elements(i), &
                     c%outcome(i, 2)%impact_tau, 1.0_wp/c%outcome(i, 2)%inverse_mass, impulse_kinds(k), &
                     outcome%main_peak, adjustr(cells(:2)), outcome%lost_at_impacts, outcome%created
               end associate
            end do
         end do
      end associate
      write (unit, '(/, a)') 'Every case in every way: the end by six definitions (|eta_c| last exceeds a level, '// &
         'energy above rest'
      write (unit, '(a)') 'falls to a share), then: highest main rebound, energy lost at impacts and created, part '// &
         'of the modes'
      write (unit, '(a)') 'above the second in displacement and velocity of the stop point early in that rebound'
      do i = 1, size(study%series)
         write (unit, '(/, a8, 2x, a22, 6a9, 5a10)') series_symbols(i), 'way                   ', 'eta 5 %', &
            'eta 2 %', 'eta 1 %', 'E 5 %', 'E 1 %', 'E 0.2 %', 'peak', 'lost', 'created', 'high eta', 'high v'
         do k = 1, size(study%series(i)%cases)
            do variant = 1, variant_count
               associate (outcome => study%series(i)%outcome(k, variant))
                  do definition = 1, definition_count
                     cells(definition) = number(outcome%end_tau(definition), 2)
                  end do
                  write (unit, '(g10.4, a22, 6a9, 5f10.4)') study%series(i)%value(k), study%variants(variant)%name, &
                     (adjustr(cells(definition)(:9)), definition=1, definition_count), outcome%main_peak, &
                     outcome%lost_at_impacts, outcome%created, outcome%high_mode_displacement, &
                     outcome%high_mode_velocity
               end associate
            end do
         end do
      end do
   end subroutine print_outcomes

   !> Text of the deciding value in each variant, followed by yes or no for the condition.
   function deciding_values_text(item, variants) result(text)
      type(statement_t), intent(in) :: item
      type(variant_t), intent(in) :: variants(variant_count)
      character(:), allocatable :: text

      integer :: variant

      text = ''
      if (.not. item%concerns_end .and. maxval(item%deciding_value) - minval(item%deciding_value) <= 0.0_wp .and. &
         (all(item%holds) .or. .not. any(item%holds))) then
         text = short_text(item%deciding_value(1))//trim(merge(' (yes)', ' (no) ', item%holds(1)))
         return
      end if
      do variant = 1, variant_count
         if (variant > 1) text = text//'; '
         text = text//trim(variants(variant)%name)//' '//short_text(item%deciding_value(variant))//' ('// &
            trim(merge('yes', 'no ', item%holds(variant)))
         if (item%concerns_end) text = text//', '//number(real(item%definitions_met(variant), wp), 0)//' of ' &
            //number(real(definition_count, wp), 0)
         if (item%ties(variant) > 0) text = text//', '//number(real(item%ties(variant), wp), 0)//' tied'
         text = text//')'
      end do
      if (item%concerns_end) text = text//'; in brackets by how many of the '//number(real(definition_count, wp), 0) &
         //' definitions of the end'
   end function deciding_values_text

   !> Text of a number with four decimals, or with an exponent if the number is very small or large.
   function short_text(value) result(text)
      real(wp), intent(in) :: value
      character(:), allocatable :: text

      character(16) :: buffer

      if (abs(value) > 0.0_wp .and. (abs(value) < 1.0e-3_wp .or. abs(value) >= 1.0e5_wp)) then
         write (buffer, '(es9.2)') value
         text = trim(adjustl(buffer))
      else
         text = number(value, 4)
      end if
   end function short_text

   !> Print a text in lines of limited width, with a label in the margin of the first line.
   subroutine print_wrapped(unit, label, text)
      integer, intent(in) :: unit
      !> Label in the margin
      character(*), intent(in) :: label
      !> Text to be printed
      character(*), intent(in) :: text

      character(5) :: margin
      integer :: first, last

      margin = label
      first = 1
      do while (first <= len_trim(text))
         last = len_trim(text)
         if (last - first + 1 > line_width) then
            last = first + index(text(first:first + line_width), ' ', back=.true.) - 2
            if (last < first) last = first + line_width - 1
         end if
         write (unit, '(a, 1x, a)') margin, text(first:last)
         first = last + 1
         do while (first <= len(text))
            if (text(first:first) /= ' ') exit
            first = first + 1
         end do
         margin = ''
      end do
   end subroutine print_wrapped

end module statements_tables
