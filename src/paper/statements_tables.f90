!> Prints the statements of the paper (Irie, Yamada and Asano 1977) as text: a block for each statement with its
!> measured values in every variant of computing motion, and a summary.
module statements_tables
   use kinds, only: wp
   use number_text, only: to_text
   use paper_cases, only: definition_count, displacement_end, energy_end, or_nan, variant_count, variant_t
   use paper_series, only: impulse_kinds, series_symbols
   use statement_types, only: number, statement_t, verdict_in_words, verdict_names, verdict_of
   use statements_study, only: study_t
   use table_columns, only: add_numbers, add_texts, print_line, print_table, table_t
   implicit none (type, external)
   private
   public :: print_statements, print_outcomes

   !> Width of the labels of statements.
   integer, parameter :: label_width = 4

contains

   !> Print all statements.
   subroutine print_statements(unit, study)
      integer, intent(in) :: unit
      type(study_t), intent(in) :: study

      integer :: i, k

      do i = 1, size(study%statements)
         associate (item => study%statements(i), variants => study%variants)
            call print_line(unit, trim(item%label), trim(item%text)//' -- '//verdict_in_words(item), label_width)
            call print_line(unit, '', trim(item%measure)//':', label_width)
            call print_line(unit, '', deciding_values_text(item, variants), label_width)
            call print_line(unit, '', trim(item%detail), label_width)
            if (item%reason /= '') call print_line(unit, '', 'Why: '//trim(item%reason)//'.', label_width)
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

      character(*), parameter :: endings(definition_count) = [character(7) :: 'eta 5 %', 'eta 2 %', 'eta 1 %', &
         'E 5 %', 'E 1 %', 'E 0.2 %']
      type(table_t) :: table
      character(40), allocatable :: labels(:)
      integer :: i, k, variant

      associate (outcome => study%convergence%outcome, elements => study%convergence%elements, &
         kinds => size(impulse_kinds))
         write (unit, '()')
         call print_line(unit, '', 'The first example (uniform, zeta = 0.001, eps = 0.6) on finer meshes, exact '// &
            'motion', width=0)
         write (unit, '()')
         allocate (labels(size(outcome)))
         do k = 1, kinds
            do i = 1, size(elements)
               labels((k - 1)*size(elements) + i) = to_text(elements(i))//', '//impulse_kinds(k)
            end do
         end do
         call add_texts(table, 'elements, reading', labels)
         deallocate (labels)
         call add_numbers(table, 'first impact', [(outcome(:, 2)%impact_tau, k=1, kinds)], 7)
         call add_numbers(table, 'mass in impact', [(1.0_wp/outcome(:, 2)%inverse_mass, k=1, kinds)], 6)
         call add_numbers(table, 'main peak', [outcome%main_peak], 6)
         call add_numbers(table, '|eta| > 2 %', [or_nan(outcome%end_tau(displacement_end))], 4, none='never')
         call add_numbers(table, 'energy < 1 %', [or_nan(outcome%end_tau(energy_end))], 4, none='never')
         call add_numbers(table, 'lost, impacts', [outcome%lost_at_impacts], 6)
         call add_numbers(table, 'created', [outcome%created], 6)
      end associate
      call print_table(unit, table)
      write (unit, '()')
      call print_line(unit, '', 'Every case in every way: the end by six definitions (|eta_c| last exceeds a '// &
         'level, energy above rest falls to a share), then: highest main rebound, energy lost at impacts and '// &
         'created, part of the modes above the second in displacement and velocity of the stop point early in that '// &
         'rebound', width=0)
      do i = 1, size(study%series)
         associate (series => study%series(i), outcome => study%series(i)%outcome)
            deallocate (table%columns)
            allocate (labels(size(series%outcome)))
            do k = 1, size(series%value)
               do variant = 1, variant_count
                  labels((k - 1)*variant_count + variant) = to_text(series%value(k))//', '//study%variants(variant)%name
               end do
            end do
            call add_texts(table, trim(series_symbols(i))//', way', labels)
            deallocate (labels)
            do k = 1, definition_count
               call add_numbers(table, endings(k), [transpose(or_nan(outcome%end_tau(k)))], 2, none='never')
            end do
            call add_numbers(table, 'peak', [transpose(outcome%main_peak)], 4)
            call add_numbers(table, 'lost', [transpose(outcome%lost_at_impacts)], 4)
            call add_numbers(table, 'created', [transpose(outcome%created)], 4)
            call add_numbers(table, 'high eta', [transpose(outcome%high_mode_displacement)], 4)
            call add_numbers(table, 'high v', [transpose(outcome%high_mode_velocity)], 4)
         end associate
         write (unit, '()')
         call print_table(unit, table)
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

end module statements_tables
