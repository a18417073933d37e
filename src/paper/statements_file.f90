!> Writes the results file and the text file of the statements of the paper (Irie, Yamada and Asano 1977). Users read
!> older words than the source: a dataset "way" counts variants, "figure" holds the deciding values, "has_end" whether
!> the statement is about the end of motion, "reading" the kinds of impulse, "quiet" the settling time, and "spent" the
!> instant at which 1 percent of the energy is left; "nodal reading" is the replacement of the nodal velocity.
module statements_file
   use, intrinsic :: iso_c_binding, only: c_size_t
   use failures, only: failure_t
   use file_system, only: kind_nothing, kind_of, load_file, make_folder, replace_file
   use hdf5_writing, only: hdf5_group_t
   use kinds, only: wp
   use number_text, only: to_text
   use paper_cases, only: variant_count, variant_t, definition_count, displacement_end, end_fractions, end_levels, &
      energy_end, or_nan
   use paper_series, only: convergence_t, impulse_kinds, series_names, series_t
   use process, only: open_text, text_of
   use quantity_groups, only: quantity_group_t
   use results_claim, only: refuse_foreign
   use results_file, only: begin_results, finish_results
   use scene_types, only: scene_t
   use statement_types, only: max_text_length, statement_t, verdict_in_words
   use statements_study, only: study_t
   use statements_tables, only: print_outcomes, print_statements
   implicit none (type, external)
   private
   public :: write_statements, refuse_foreign_text

   !> First characters of the text file after blanks: the number of the first statement.
   character(*), parameter :: text_start = '1a  '

contains

   !> Write the results file, either completely or not at all, and then the text file.
   subroutine write_statements(folder, scene, study, error)
      !> Folder of the results file
      character(*), intent(in) :: folder
      type(scene_t), intent(in) :: scene
      type(study_t), intent(in) :: study
      !> Reason why a file could not be written
      type(failure_t), allocatable, intent(out) :: error

      ! estimated size of the file
      integer(c_size_t), parameter :: expected_bytes = 262144_c_size_t
      type(quantity_group_t) :: root
      type(hdf5_group_t) :: group
      integer :: i

      call make_folder(folder, error)
      if (allocated(error)) return
      call begin_results(root, expected_bytes, scene)
      group = root%group('statements')
      call write_verdicts(group, study%variants, study%statements)
      do i = 1, size(study%series)
         call write_series(group%group('over_'//trim(series_names(i))), trim(series_names(i)), study%variants, &
            study%series(i))
      end do
      call write_convergence(group%group('convergence'), study%convergence)
      call finish_results(root, folder, scene, error)
      if (allocated(error)) return
      call write_text(folder, scene%name//'.txt', study, error)
   end subroutine write_statements

   !> Refuse to replace a file that is not a text of statements.
   subroutine refuse_foreign_text(folder, scene, error)
      !> Folder of the results file
      character(*), intent(in) :: folder
      type(scene_t), intent(in) :: scene
      !> Set if the file exists and is not a text of statements
      type(failure_t), allocatable, intent(out) :: error

      character(:), allocatable :: path
      character(:), allocatable :: text
      type(failure_t), allocatable :: unreadable

      path = folder//'/'//scene%name//'.txt'
      if (kind_of(path) == kind_nothing) return
      call load_file(path, text, unreadable)
      if (index(adjustl(text), text_start) == 1) return
      call refuse_foreign(path, 'a table of statements', error)
   end subroutine refuse_foreign_text

   !> Write the statements with their verdicts.
   subroutine write_verdicts(group, variants, list)
      type(hdf5_group_t), intent(in) :: group
      type(variant_t), intent(in) :: variants(variant_count)
      type(statement_t), intent(in) :: list(:)

      character(max_text_length) :: verdict(size(list))
      integer :: i

      do i = 1, size(list)
         verdict(i) = verdict_in_words(list(i))
      end do
      call group%add('statement', [(i, i=1, size(list))], '1', 'one statement of the paper', is_scale=.true.)
      call group%add('way', [(i, i=1, variant_count)], '1', 'one way of computing', is_scale=.true.)
      call group%add('way_name', variants%name, 'none', 'name of the way', along='way')
      call group%add('label', list%label, 'none', 'number of the statement', along='statement')
      call group%add('text', list%text, 'none', 'what the paper says', along='statement')
      call group%add('measure', list%measure, 'none', 'what was measured, and the condition on it', along='statement')
      call group%add('detail', list%detail, 'none', 'the numbers behind it, exact motion on the fine mesh', &
         along='statement')
      call group%add('reason', list%reason, 'none', 'why the paper and the program differ', along='statement')
      call group%add('verdict', verdict, 'none', 'verdict', along='statement')
      call group%add('has_end', merge(1, 0, list%concerns_end), '1', '1: the end of the motion counts', &
         along='statement')
      call group%attribute('definitions_of_the_end', real(definition_count, wp), 'has_end')
      do i = 1, variant_count
         call group%add('figure_'//to_text(i), list%deciding_value(i), '1', &
            'figure that decides: '//trim(variants(i)%name), along='statement')
         call group%add('definitions_'//to_text(i), list%definitions_met(i), '1', &
            'definitions of the end for which the condition is met: '//trim(variants(i)%name), along='statement')
         call group%add('ties_'//to_text(i), list%ties(i), '1', &
            'definitions of the end by which the compared cases cannot be distinguished: '//trim(variants(i)%name), &
            along='statement')
         call group%add('holds_'//to_text(i), merge(1, 0, list%holds(i)), '1', 'condition met: '// &
            trim(variants(i)%name), along='statement')
      end do
   end subroutine write_verdicts

   !> Write the results of the cases of one figure of the paper, [cases, variants]. An instant that is not reached
   !> is NaN.
   subroutine write_series(group, name, variants, series)
      type(hdf5_group_t), intent(in) :: group
      !> Name of the varied parameter
      character(*), intent(in) :: name
      type(variant_t), intent(in) :: variants(variant_count)
      !> Series of the cases
      type(series_t), intent(in) :: series

      integer :: i

      call group%add(name, series%value, '1', 'what is varied', is_scale=.true.)
      call group%add('way', [(i, i=1, variant_count)], '1', 'one way of computing', is_scale=.true.)
      call group%add('way_name', variants%name, 'none', 'name of the way', along='way')
      do i = 1, size(end_levels)
         call add('end_level_'//to_text(i), or_nan(series%outcome%end_tau(i)), 'tau when |eta_c| last exceeds '// &
            to_text(end_levels(i)))
      end do
      do i = 1, size(end_fractions)
         call add('end_energy_'//to_text(i), or_nan(series%outcome%end_tau(size(end_levels) + i)), &
            "tau when the energy above rest last exceeds this share of the start's: "//to_text(end_fractions(i)))
      end do
      call add('first_impact', or_nan(series%outcome%impact_tau), 'first contact with the stop, tau')
      call add('main_peak', series%outcome%main_peak, 'highest rebound within a period, eta')
      call add('indentation', series%outcome%indentation, 'deepest indentation, eta')
      call add('first_contact', series%outcome%contact_length, 'length of the first contact that lasts, tau')
      call add('contact_ratio', series%outcome%contact_ratio, 'time on the stop over time away')
      call add('lost_at_impacts', series%outcome%lost_at_impacts, 'energy lost at impacts, of the energy to lose')
      call add('created', series%outcome%created, 'energy created by the nodal reading, of the energy to lose')
      call add('kinetic_at_first', series%outcome%kinetic_at_impact, &
         'kinetic energy at the first impact, of the energy to lose')
      call add('mass_in_impact', 1.0_wp/series%outcome%inverse_mass, 'mass that takes part in an impact, of the beam')
      call add('later_velocity', series%outcome%later_velocity, 'maximum velocity of approach after the main rebound')
      call add('high_displacement', series%outcome%high_mode_displacement, &
         'part of the modes above the second in the displacement of the stop point early in the main rebound')
      call add('high_velocity', series%outcome%high_mode_velocity, 'the same part in its velocity')
      call add('own_frequency', series%outcome%lowest_frequency, 'lowest frequency of the beam, in omega1')

   contains

      !> Write one dataset.
      subroutine add(dataset, values, long_name)
         !> Name of the dataset
         character(*), intent(in) :: dataset
         !> Values, [cases, variants]
         real(wp), contiguous, intent(in) :: values(:, :)
         character(*), intent(in) :: long_name

         call group%add(dataset, values, '1', long_name, name//' way')
      end subroutine add

   end subroutine write_series

   !> Write the convergence of the first example under mesh refinement.
   subroutine write_convergence(group, convergence)
      type(hdf5_group_t), intent(in) :: group
      !> Results of the convergence study
      type(convergence_t), intent(in) :: convergence

      character(*), parameter :: along = 'elements reading'

      call group%add('elements', convergence%elements, '1', 'equal elements', is_scale=.true.)
      call group%add('reading', [1, 2], '1', 'reading of the impulse: '//impulse_kinds(1)//', '//impulse_kinds(2), &
         is_scale=.true.)
      call group%add('mass_in_impact', 1.0_wp/convergence%outcome(:, 2)%inverse_mass, '1', &
         'mass that takes part in an impact, of the beam', along='elements')
      call group%add('first_impact', convergence%outcome(:, 2)%impact_tau, '1', 'first contact with the stop, tau', &
         along='elements')
      call group%add('main_peak', convergence%outcome%main_peak, '1', 'highest rebound within a period, eta', along)
      call group%add('quiet', or_nan(convergence%outcome%end_tau(displacement_end)), '1', &
         'tau when |eta_c| last exceeds 0.02', along)
      call group%add('spent', or_nan(convergence%outcome%end_tau(energy_end)), '1', &
         'tau when 1 percent of the energy above rest is left', along)
      call group%add('lost_at_impacts', convergence%outcome%lost_at_impacts, '1', &
         'energy lost at impacts, of the energy to lose', along)
      call group%add('created', convergence%outcome%created, '1', 'energy created, of the energy to lose', along)
   end subroutine write_convergence

   !> Write the tables as a text file.
   subroutine write_text(folder, name, study, error)
      !> Folder of the results file
      character(*), intent(in) :: folder
      !> Name of the file
      character(*), intent(in) :: name
      type(study_t), intent(in) :: study
      !> Reason why a file could not be written
      type(failure_t), allocatable, intent(inout) :: error

      character(:), allocatable :: text
      integer :: unit

      call open_text(unit, error)
      if (allocated(error)) return
      call print_statements(unit, study)
      call print_outcomes(unit, study)
      call text_of(unit, text, error)
      if (.not. allocated(error)) call replace_file(folder, name, text, error)
   end subroutine write_text

end module statements_file
