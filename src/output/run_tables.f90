!> Results of a run on the terminal: lines of its measures, and tables of the measures of each contact, of cases and of
!> statistics.
module run_tables
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
   use kinds, only: wp
   use measure_list, only: contact_name, first_peak, first_statistic, force_window, measure_count, measure_decay, &
      measure_force, measure_mean_force, measure_named, measure_settling, measure_table, measure_tolerance, peak_count
   use measure_rows, only: extremes_in_words, row_in_units
   use mesh_checks, only: mesh_check_t
   use mesh_errors, only: mesh_errors_t
   use number_text, only: rounded, to_text
   use printable_text, only: joined
   use quantities, only: quantity_named, units_t, words_in
   use reader_units, only: choose_prefix, phrase, value_in_units, unit_in
   use response_types, only: mode_check_t, run_measures_t, contact_record_t, moment_record_t, &
      moment_window_t
   use run_measures, only: row_of
   use statistic_types, only: run_statistics_t
   use table_columns, only: add_numbers, add_texts, print_line, print_table, table_t, two_digits, whole, with_two_digits
   implicit none (type, external)
   private
   public :: measure_column_t, add_measures, print_measures, print_driven, print_mesh, print_modes, print_statistics, &
      print_contacts, print_stresses

   !> A column of a table of measures.
   type :: measure_column_t
      !> Name of the measure in `measure_table`, which also has its quantity
      character(24) :: measure
      !> Heading for `words_in`; empty: the label of the measure
      character(24) :: text = ''
   end type measure_column_t

   !> Decimals of dimensionless measures
   integer, parameter :: decimals = 6
   !> Maximum number of rebounds that are listed; of further rebounds only the number is printed.
   integer, parameter :: max_peaks = 12

   !> Columns of the table of contacts.
   type(measure_column_t), parameter :: contact_columns(*) = [ &
      measure_column_t('impacts', 'impacts'), &
      measure_column_t('contacts', 'contacts'), &
      measure_column_t('first_impact_time', 'first at {tau =~t}'), &
      measure_column_t('total_contact', 'time in contact'), &
      measure_column_t('greatest_force', 'maximum force'), &
      measure_column_t('greatest_mean_force', 'mean force'), &
      measure_column_t('greatest_impulse', 'maximum impulse')]

   !> Columns of the table of &statistics.
   type(measure_column_t), parameter :: statistic_columns(*) = [ &
      measure_column_t('mean_force', 'mean force'), &
      measure_column_t('rms_force', 'RMS force'), &
      measure_column_t('maximum_force', 'maximum force'), &
      measure_column_t('contact_share', 'share in contact'), &
      measure_column_t('impact_rate', 'impact rate'), &
      measure_column_t('mean_impact_velocity', 'mean velocity'), &
      measure_column_t('maximum_impact_velocity', 'maximum velocity'), &
      measure_column_t('mean_impulse', 'mean impulse'), &
      measure_column_t('work_rate', 'work rate'), &
      measure_column_t('rms_displacement', 'RMS displacement')]
   !> Statistics among these columns after which the half width of the 95 % interval is printed
   character(*), parameter :: with_interval(*) = [character(12) :: 'mean_force', 'rms_force', 'impact_rate', &
      'work_rate']

contains

   !> Print whether the inertia at the stop is redistributed, a warning if it should be, and the change of the motion on
   !> a finer mesh; print nothing if none of these applies.
   subroutine print_mesh(unit, check, units)
      !> Unit number of the output
      integer, intent(in) :: unit
      type(mesh_check_t), intent(in) :: check
      !> Units of the results
      type(units_t), intent(in) :: units

      ! a greater difference stands for runs that failed or ended before a comparison
      real(wp), parameter :: max_difference = 1.0e3_wp
      character(:), allocatable :: label, words

      label = 'mesh check'
      if (check%is_redistributed) call print_words('inertia redistributed at the stop')
      if (check%should_redistribute) call print_words('the consistent mass matrix overestimates the mass that takes ' &
         //"part in impacts; mass = 'auto' is more accurate")
      if (check%finer_elements == 0) return
      words = 'with '//to_text(check%finer_elements)//' elements '
      if (check%difference > max_difference) then
         words = words//'no motion was found to compare'
      else if (check%is_relative) then
         words = words//'displacement and first impact differ by '//with_two_digits(100.0_wp*check%difference)//' %'
      else
         words = words//phrase(units, 'the motion differs by ', 'displacement', check%difference)
      end if
      call print_words(words//phrase(units, ', until {tau~t} = ', 'time', check%horizon))
      if (check%is_converged) return
      if (check%is_cut) then
         call print_words('the tolerance is NOT reached: finer meshes would take long; &mesh tolerance searches on')
      else
         call print_words('finer meshes do NOT converge to the tolerance')
      end if

   contains

      !> Print words; the first of them have a label, because other lines may precede them.
      subroutine print_words(text)
         character(*), intent(in) :: text

         call print_line(unit, label, text)
         label = ''
      end subroutine print_words

   end subroutine print_mesh

   !> Print how the motion differs with another number of modes; print nothing if no other number was tried.
   subroutine print_modes(unit, check, units, is_stepped)
      integer, intent(in) :: unit
      !> Number of retained modes, and comparison with another number of modes
      type(mode_check_t), intent(in) :: check
      !> Units of the results
      type(units_t), intent(in) :: units
      !> Whether the run has Newmark's steps, whose errors the comparison, which is of exact motion, does not contain
      logical, intent(in) :: is_stepped

      ! the comparison in words
      character(:), allocatable :: found

      if (check%compared_modes == 0) return
      found = 'with '//to_text(check%compared_modes)//phrase(units, ' {eta~the displacement} differs by ', &
         'displacement', check%difference)//phrase(units, ' until {tau~t} = ', 'time', check%horizon)
      if (is_stepped) found = 'in exact motion, '//found
      if (check%moment_difference > 0.0_wp) found = found//', moments by '//with_two_digits(100.0_wp &
         *check%moment_difference)//' %'
      if (.not. check%agrees) found = 'fewer do not agree: '//found
      if (check%retained == check%all_modes) then
         call print_line(unit, 'modes', 'all '//to_text(check%retained)//'; '//found)
      else
         call print_line(unit, 'modes', to_text(check%retained)//' of '//to_text(check%all_modes)//'; '//found)
         if (.not. check%agrees) call print_line(unit, '', 'the requested accuracy is NOT confirmed')
      end if
      if (check%persists) call print_line(unit, '', 'contacts may later make two such motions differ completely: ' &
         //'compare statistics, not histories')
   end subroutine print_modes

   !> Print the measures of a run, a line each, and the peaks of its rebounds.
   subroutine print_measures(unit, measures, units, released, is_driven, has_window, has_contacts, errors)
      integer, intent(in) :: unit
      type(run_measures_t), intent(in) :: measures
      !> Units of the results
      type(units_t), intent(in) :: units
      !> Number of the stop whose rebounds are listed; 0: the number is not printed
      integer, intent(in) :: released
      !> Whether loads vary to the end of the run, so that neither settling nor rebounds from the start are of interest
      logical, intent(in) :: is_driven
      !> Whether the scene has &statistics, so that the extremes of its window are not those of the run
      logical, intent(in) :: has_window
      !> Whether the scene has stops or bodies; without them no measure of contacts is printed
      logical, intent(in) :: has_contacts
      !> Errors of the mesh; absent: they are not printed
      type(mesh_errors_t), intent(in), optional :: errors

      character(:), allocatable :: heading, window
      real(wp) :: row(measure_count)
      logical :: is_printed(measure_count)
      integer :: i
      ! the contact is rigid at a node with mass, so that its force has no extremes
      logical :: has_rigid_force

      heading = 'rebound peaks'
      if (released > 0) heading = 'peaks at stop '//to_text(released)
      ! averaging time of the force of a rigid stop
      window = phrase(units, ' over the first ', 'time', force_window)//words_in(units, '{ of tau~}')//' of an episode'
      row = row_of(measures)
      has_rigid_force = all(ieee_is_nan(row([measure_force, measure_named('minimum_force_closed')])))
      ! forces over a window, and measures that need a group of the scene, are not printed if they are not defined
      is_printed = measure_table%label /= '' .and. (has_contacts .or. .not. measure_table%is_of_contact) .and. &
         (has_window .or. index(measure_table%label, 'steady') == 0) .and. (measure_table%group == '' &
         .or. .not. ieee_is_nan(row) .or. prints_absence(measures, [(i, i=1, measure_count)]))
      if (ieee_is_nan(row(measure_mean_force))) is_printed(measure_mean_force) = .false.
      is_printed(measure_settling) = has_contacts .and. .not. is_driven
      ! without energy above rest at the start no part of it can be left
      is_printed(measure_decay) = .not. (is_driven .or. ieee_is_nan(measures%left))
      if (.not. any(is_printed)) return
      write (unit, '()')
      do i = 1, measure_count
         if (is_printed(i)) call print_line(unit, words_in(units, trim(measure_table(i)%label)), &
            measure_in_words(i, row(i), measures%duration, units, has_rigid_force)//error_in_words(i, units, errors) &
            //window(:merge(len(window), 0, i == measure_mean_force)))
      end do
      if (.not. ieee_is_nan(row(measure_tolerance))) call print_line(unit, 'extremes', &
         extremes_in_words(row(measure_tolerance:measure_tolerance)))
      if (has_contacts .and. .not. is_driven) then
         if (measures%rebounds == 0) call print_line(unit, heading, 'none')
         do i = 1, min(measures%rebounds, max_peaks)
            if (i == 2) heading = ''
            call print_line(unit, heading, &
               phrase(units, '{eta~|y - d|} = ', 'displacement', measures%peak_eta(i), decimals) &
               //error_in_words(merge(first_peak + i - 1, 0, i <= peak_count), units, errors) &
               //phrase(units, ' at {tau~t} = ', 'time', measures%peak_tau(i), decimals))
         end do
         if (measures%rebounds > max_peaks) call print_line(unit, '', 'and '//to_text(measures%rebounds - max_peaks) &
            //' more')
      end if
      if (present(errors)) call print_line(unit, '', '+- discretisation error, by '//to_text(2*errors%elements(1)) &
         //' and '//to_text(4*errors%elements(1))//' elements')
   end subroutine print_measures

   !> The error of the mesh of a measure, such as ' +- 3e-5', in the unit of the number that stands before it.
   pure function error_in_words(measure, units, errors) result(words)
      !> Index in `measure_table`; 0: no error is known
      integer, intent(in) :: measure
      !> Units of the results
      type(units_t), intent(in) :: units
      !> Absent: the result is empty
      type(mesh_errors_t), intent(in), optional :: errors
      character(:), allocatable :: words

      character(:), allocatable :: unit_of_value
      real(wp) :: factor

      words = ''
      if (.not. present(errors) .or. measure == 0) return
      if (ieee_is_nan(errors%row(measure, 1)) .or. measure_table(measure)%is_whole) return
      words = ' +- ?'
      if (ieee_is_nan(errors%error(measure, 1))) return
      call choose_prefix(abs(errors%row(measure, 1)), unit_in(units, measure_table(measure)%quantity), factor, &
         unit_of_value)
      words = ' +- '//with_two_digits(factor*errors%error(measure, 1))
   end function error_in_words

   !> Whether it is printed that an event of &relay did not happen. Each measure of another group is printed only if it
   !> is defined.
   elemental logical function prints_absence(measures, measure)
      type(run_measures_t), intent(in) :: measures
      !> Index in `measure_table`
      integer, intent(in) :: measure

      prints_absence = .false.
      if (.not. allocated(measures%closing)) return
      prints_absence = measure_table(measure)%name == 'final_closing' &
         .or. measures%closing%has_lasting_force .and. measure_table(measure)%name == 'force_lasts'
   end function prints_absence

   !> A measure in words, such as '15', 'at tau = 1.547641', 'not until t = 6 ms'.
   pure function measure_in_words(measure, value, duration, units, has_rigid_force) result(words)
      !> Index in `measure_table`
      integer, intent(in) :: measure
      !> Dimensionless value; NaN: the event of the measure did not happen
      real(wp), intent(in) :: value
      !> Length of the run in tau
      real(wp), intent(in) :: duration
      !> Units of the results
      type(units_t), intent(in) :: units
      !> Whether the contact is rigid at a node with mass
      logical, intent(in) :: has_rigid_force
      character(:), allocatable :: words

      associate (entry => measure_table(measure))
         if (ieee_is_nan(value) .and. has_rigid_force .and. &
            any(entry%name == ['greatest_force', 'force_lasts   '])) then
            words = 'not defined for a rigid stop'
         else if (ieee_is_nan(value)) then
            words = 'none'
            if (entry%lead /= '') words = phrase(units, 'not until {tau~t} = ', 'time', duration)
         else if (entry%is_whole .and. entry%lead /= '' .and. abs(value) < 0.5_wp) then
            words = 'none found'
         else
            words = trim(words_in(units, trim(entry%lead)))
            if (words /= '') words = words//' '
            if (entry%is_whole) then
               words = words//to_text(nint(value))
            else
               words = words//value_in_units(units, entry%quantity, value, decimals)
            end if
         end if
      end associate
   end function measure_in_words

   !> Add columns of measures to a table; '-' stands for an event that did not happen.
   subroutine add_measures(table, shown, rows, units)
      type(table_t), intent(inout) :: table
      type(measure_column_t), intent(in) :: shown(:)
      !> Measures in the units of the results, [measure_count, lines]
      real(wp), intent(in) :: rows(:, :)
      !> Units of the results
      type(units_t), intent(in) :: units

      ! index in `measure_table`
      integer :: entry_number
      integer :: k

      do k = 1, size(shown)
         entry_number = measure_named(shown(k)%measure)
         associate (measure => measure_table(entry_number))
            call add_numbers(table, words_in(units, trim(merge(measure%label, shown(k)%text, shown(k)%text == ''))), &
               rows(entry_number, :), merge(whole, decimals, measure%is_whole), unit_in(units, measure%quantity))
         end associate
      end do
   end subroutine add_measures

   !> Print a table of measures with a line for each contact.
   subroutine print_contacts(unit, contacts, units)
      integer, intent(in) :: unit
      !> Contacts, each with its measures allocated
      type(contact_record_t), intent(in) :: contacts(:)
      !> Units of the results
      type(units_t), intent(in) :: units

      type(table_t) :: table
      real(wp) :: rows(measure_count, size(contacts))
      integer :: i
      logical :: has_column(size(contact_columns))

      do i = 1, size(contacts)
         rows(:, i) = row_in_units(units, row_of(contacts(i)%measures))
      end do
      call add_contacts(table, contacts)
      ! the column of a force that no contact has is left out
      has_column = [(index(contact_columns(i)%measure, '_force') == 0 .or. .not. all(ieee_is_nan(rows(measure_named( &
         contact_columns(i)%measure), :))), i=1, size(contact_columns))]
      call add_measures(table, pack(contact_columns, has_column), rows, units)
      write (unit, '()')
      call print_table(unit, table)
   end subroutine print_contacts

   !> Print the statistics requested by &statistics with a line for each contact.
   subroutine print_statistics(unit, statistics, contacts, units, load_period)
      integer, intent(in) :: unit
      type(run_statistics_t), intent(in) :: statistics
      type(contact_record_t), intent(in) :: contacts(:)
      !> Units of the results
      type(units_t), intent(in) :: units
      !> Period of the loads of a driven run, tau; 0: the run is not driven
      real(wp), intent(in) :: load_period

      type(table_t) :: table
      real(wp), dimension(measure_count, size(contacts)) :: rows, half_widths
      character(:), allocatable :: unit_of_values
      real(wp) :: factor
      integer :: blocks, i, measure

      blocks = ubound(statistics%edge, 1)
      write (unit, '(/, 2x, a)') 'statistics from '//instant(0)//' to '//instant(blocks)//' in '//to_text(blocks) &
         //' blocks'
      write (unit, '(2x, a)') 'displacements are up from the unstressed beam; +- is a 95 % interval'
      rows = ieee_value(1.0_wp, ieee_quiet_nan)
      half_widths = rows
      do i = 1, size(contacts)
         rows(first_statistic:, i) = statistics%value(:, i)
         rows(:, i) = row_in_units(units, rows(:, i))
         half_widths(first_statistic:, i) = statistics%half_width(:, i)
         half_widths(:, i) = row_in_units(units, half_widths(:, i))
      end do
      call add_contacts(table, contacts)
      do i = 1, size(statistic_columns)
         call add_measures(table, statistic_columns(i:i), rows, units)
         measure = measure_named(statistic_columns(i)%measure)
         ! a rigid stop has no half widths of RMS forces
         if (all(with_interval /= statistic_columns(i)%measure) .or. all(ieee_is_nan(half_widths(measure, :)))) cycle
         call choose_prefix(maxval(abs(rows(measure, :)), mask=.not. ieee_is_nan(rows(measure, :))), &
            unit_in(units, measure_table(measure)%quantity), factor, unit_of_values)
         call add_numbers(table, '+-', factor*half_widths(measure, :), two_digits)
      end do
      if (load_period > 0.0_wp) then
         call add_numbers(table, 'amplitude', 0.5_wp*(rows(measure_named('maximum_displacement'), :) &
            - rows(measure_named('minimum_displacement'), :)), decimals, unit_in(units, 'displacement'))
         call add_numbers(table, 'impacts a period', load_period*statistics%value(measure_named('impact_rate') &
            - first_statistic + 1, 1:), 3)
      end if
      call print_table(unit, table)
      if (any(statistics%is_maximum_unfinished)) then
         write (unit, '(2x, a)') 'mean impulse at '//joined(pack(labels_of(contacts), &
            statistics%is_maximum_unfinished), ', ')//' contains the force of an impact that lasts', &
            'at the end; the maximum impulse above is without the force at rest'
      end if

   contains

      !> Instant of an edge of the blocks in words.
      pure function instant(edge) result(words)
         integer, intent(in) :: edge
         character(:), allocatable :: words

         words = phrase(units, '{tau~t} = ', 'time', statistics%edge(edge), decimals)
      end function instant

   end subroutine print_statistics

   !> Print a table of the stresses requested by &stress with a line for each place.
   subroutine print_stresses(unit, moments, units, has_window, windows)
      integer, intent(in) :: unit
      !> Moments with their stresses, at least one
      type(moment_record_t), intent(in) :: moments(:)
      !> Units of the results
      type(units_t), intent(in) :: units
      !> Whether the scene has &statistics, so that the extremes of its window are not those of the run
      logical, intent(in) :: has_window
      !> Moments within the window of &statistics; absent: not requested
      type(moment_window_t), intent(in), optional :: windows(:)

      type(table_t) :: table
      integer :: k

      if (.not. all(moments%has_stress .and. moments%maximum >= moments%minimum)) return
      call add('stress at {x/L~x}', 'length', moments%position)
      call add('minimum', 'stress', moments%stress_per_moment*moments%minimum)
      call add('maximum', 'stress', moments%stress_per_moment*moments%maximum)
      call add('range', 'stress', moments%stress_per_moment*(moments%maximum - moments%minimum))
      if (present(windows)) then
         if (has_window) then
            call add('steady minimum', 'stress', moments%stress_per_moment*[(windows(k)%extremes(1), k=1, &
               size(windows))])
            call add('steady maximum', 'stress', moments%stress_per_moment*[(windows(k)%extremes(2), k=1, &
               size(windows))])
         end if
         if (windows(1)%slope > 0.0_wp) then
            call add('cycles', 'number', windows%cycles)
            call add('equivalent range', 'stress', windows%equivalent_range)
         end if
      end if
      write (unit, '()')
      call print_table(unit, table)

   contains

      !> Add a column of dimensionless values.
      subroutine add(heading, quantity, values)
         character(*), intent(in) :: heading
         !> Name of the quantity in `quantity_table`
         character(*), intent(in) :: quantity
         real(wp), intent(in) :: values(:)

         real(wp) :: factor

         factor = 1.0_wp
         if (units%are_physical .and. quantity /= 'number') factor = units%factor(quantity_named(quantity))
         call add_numbers(table, words_in(units, heading), factor*values, decimals, unit_in(units, quantity))
      end subroutine add
   end subroutine print_stresses

   !> Print the lines of a driven run: the period of its loads and, in the window of &statistics, the displacement of
   !> the tip and the impacts, or how to ask for them.
   subroutine print_driven(unit, statistics, load_period, units)
      integer, intent(in) :: unit
      !> Absent: the scene has no &statistics
      type(run_statistics_t), intent(in), optional :: statistics
      !> Period of the loads, tau
      real(wp), intent(in) :: load_period
      !> Units of the results
      type(units_t), intent(in) :: units

      write (unit, '()')
      call print_line(unit, 'load period', phrase(units, '{tau =~} ', 'time', load_period))
      if (.not. present(statistics)) then
         call print_line(unit, 'driven motion', 'amplitudes, RMS values, shares of time in contact and impacts a ' &
            //'period: add &statistics, with a start after the start-up')
         return
      end if
      ! a rigidly supported tip does not move
      if (value_of('maximum_tip') > value_of('minimum_tip')) then
         call print_line(unit, 'amplitude of tip', value_in_units(units, 'displacement', 0.5_wp*( &
            value_of('maximum_tip') - value_of('minimum_tip')), decimals)//', half of its range')
         call print_line(unit, 'RMS of tip', value_in_units(units, 'displacement', value_of('rms_tip'), decimals) &
            //phrase(units, ', mean ', 'displacement', value_of('mean_tip'), decimals))
      end if
      if (ubound(statistics%value, 2) == 0) return
      call print_line(unit, 'impacts a period', rounded(load_period*value_of('impact_rate')) &
         //' at all stops, mean of &statistics')
      call print_line(unit, 'share in contact', rounded(value_of('contact_share'))//' of the time, summed over stops')

   contains

      !> A statistic of all contacts together.
      pure real(wp) function value_of(name) result(value)
         character(*), intent(in) :: name

         value = statistics%value(measure_named(name) - first_statistic + 1, 0)
      end function value_of

   end subroutine print_driven

   !> Add the first column of a table of contacts, with entries such as '2 above'.
   subroutine add_contacts(table, contacts)
      type(table_t), intent(inout) :: table
      type(contact_record_t), intent(in) :: contacts(:)

      call add_texts(table, trim(merge('contact', 'stop   ', any(contacts%body > 0))), labels_of(contacts))
   end subroutine add_contacts

   !> Labels of contacts in tables, such as '2 above'.
   pure function labels_of(contacts) result(labels)
      type(contact_record_t), intent(in) :: contacts(:)
      character(20) :: labels(size(contacts))

      integer :: i

      do i = 1, size(contacts)
         labels(i) = to_text(contacts(i)%stop)//' '//merge('below', 'above', contacts(i)%sign > 0)
         if (any(contacts%body > 0)) labels(i) = contact_name(contacts(i))
      end do
   end function labels_of

end module run_tables
