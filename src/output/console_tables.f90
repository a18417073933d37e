!> Short tables of results for people to read.
module console_tables
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use body_words, only: mass_in_words, mesh_in_words, root_in_words, section_in_words
   use kinds, only: wp
   use load_settings, only: start_pull
   use measure_list, only: measure_count, measure_named, measure_table
   use measure_rows, only: row_in
   use number_text, only: rounded, to_text
   use quantities, only: quantity_named, unit_of, units_t, words_in
   use reader_units, only: find_prefix, reading_in
   use response_types, only: mesh_check_t, mode_check_t, run_measures_t, surface_record_t
   use run_measures, only: row_of
   use run_settings, only: method_names, method_newmark, side_below, stop_settings_t
   use scene_types, only: scene_t, shape_taper
   use scene_units, only: units_in
   use signal_peaks, only: peak_tolerance
   use stop_words, only: law_in_words, place_in_words, released_stop, stops_in_scene, support_in_words
   use text_columns, only: fixed, label_width, print_columns, print_line
   implicit none (type, external)
   private
   public :: print_model, print_measures, print_mesh, print_modes, print_surfaces
   public :: fill_column, surface_label

   !> Width of a column of numbers.
   integer, parameter :: column_width = 12
   !> So many rebounds are listed; of more only the number is said.
   integer, parameter :: most_peaks = 12

contains

   !> What is computed: name, title, beam, mesh, stop, method.
   subroutine print_model(unit, scene, node_position)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      !> x/L of the nodes, [0:n]; not there if no motion is computed
      real(wp), intent(in), optional :: node_position(0:)

      character(:), allocatable :: heading
      integer :: i

      heading = scene%name
      if (allocated(scene%title)) then
         if (scene%title /= '') heading = heading//': '//scene%title
      end if
      write (unit, '(a)') heading
      call print_line(unit, 'beam', beam_in_words(scene))
      if (scene%has_root) call print_line(unit, 'root', root_in_words(scene%root, units_in(scene)))
      if (allocated(scene%masses)) then
         do i = 1, size(scene%masses)
            call print_line(unit, 'mass '//to_text(i), mass_in_words(scene%masses(i), units_in(scene)))
         end do
      end if
      if (scene%wants_response) then
         if (scene%mesh%tolerance > 0.0_wp .and. present(node_position)) then
            call print_line(unit, 'mesh', to_text(size(node_position) - 1)//' elements, found for a tolerance of ' &
               //rounded(scene%mesh%tolerance))
         else
            call print_line(unit, 'mesh', mesh_in_words(scene%mesh%elements, merge(0.0_wp, scene%mesh%ratio, &
               allocated(scene%mesh%nodes))))
         end if
         call print_stops(unit, scene, node_position)
         call print_line(unit, 'motion', motion_in_words(scene))
      end if
   end subroutine print_model

   !> Section, damping and tip mass.
   function beam_in_words(scene) result(words)
      type(scene_t), intent(in) :: scene
      character(:), allocatable :: words

      type(units_t) :: units

      associate (beam => scene%beam)
         if (beam%shape /= shape_taper) then
            words = section_in_words(beam)
         else if (abs(beam%height_root - beam%height_tip) <= 0.0_wp) then
            words = 'uniform'
         else if (beam%height_tip <= 0.0_wp) then
            words = 'full wedge'
         else
            words = 'taper, h1/h0 = '//rounded(beam%height_tip/beam%height_root)
         end if
         if (beam%shape == shape_taper .and. beam%height_root > beam%height_tip) then
            words = words//', alpha = '//rounded((beam%height_root - beam%height_tip)/beam%length)
         end if
      end associate
      units = units_in(scene)
      if (units%are_of_scene) then
         words = words//', L = '//reading_in(units, 'length', 1.0_wp)//', hbar = ' &
            //reading_in(units, 'length', scene%scales%height_ratio)
      else
         words = words//', hbar/L = '//rounded(scene%scales%height_ratio)
      end if
      words = words//damping_in_words(scene)
      if (units%are_of_scene) then
         if (scene%tip_mass_ratio > 0.0_wp) words = words//', tip mass ' &
            //reading_in(units, 'mass', scene%tip_mass_ratio)
      else
         words = words//', mu = '//rounded(scene%tip_mass_ratio)
      end if
   end function beam_in_words

   !> What damps it.
   pure function damping_in_words(scene) result(words)
      type(scene_t), intent(in) :: scene
      character(:), allocatable :: words

      integer, parameter :: most = 4
      integer :: i

      words = ''
      if (allocated(scene%mode_ratios)) then
         words = ', mode ratios'
         do i = 1, min(size(scene%mode_ratios), most)
            words = words//' '//rounded(scene%mode_ratios(i))
         end do
         if (size(scene%mode_ratios) > most) words = words//' ...'
         return
      end if
      if (scene%zeta > 0.0_wp .or. scene%wants_response) words = ', zeta = '//rounded(scene%zeta)
      if (scene%zeta_mass > 0.0_wp) words = words//', zeta_mass = '//rounded(scene%zeta_mass)
   end function damping_in_words

   !> Where each stop is and its law: of the paper's one in a line, of others in two.
   subroutine print_stops(unit, scene, node_position)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      !> x/L of the nodes, [0:n]
      real(wp), intent(in), optional :: node_position(0:)

      type(stop_settings_t), allocatable :: stops(:)
      character(:), allocatable :: label, words
      type(units_t) :: units
      integer :: k

      units = units_in(scene)
      if (.not. scene%has_stop) then
         call print_line(unit, 'stop', 'none')
      else
         allocate (stops, source=stops_in_scene(scene))
         do k = 1, size(stops)
            label = 'stop'
            if (size(stops) > 1) label = label//' '//to_text(k)
            words = place_in_words(stops(k), node_position, units)
            if (size(stops) == 1 .and. stops(k)%side == side_below) then
               call print_line(unit, label, law_in_words(stops(k), units)//', '//words)
               cycle
            end if
            if (scene%start%kind == start_pull .and. k == released_stop(scene)) words = words//'; released from it'
            if (stops(k)%side == side_below) words = 'below, '//words
            call print_line(unit, label, words)
            call print_line(unit, '', law_in_words(stops(k), units))
         end do
      end if
      if (.not. allocated(scene%supports)) return
      do k = 1, size(scene%supports)
         call print_line(unit, 'support '//to_text(k), support_in_words(scene%supports(k), units))
      end do
   end subroutine print_stops

   !> Method and length of the run.
   function motion_in_words(scene) result(words)
      type(scene_t), intent(in) :: scene
      character(:), allocatable :: words

      type(units_t) :: units

      associate (response => scene%response)
         words = trim(method_names(response%method))
         if (response%method == method_newmark) words = words//', beta = '//rounded(response%newmark_beta)// &
            ', gamma = '//rounded(response%newmark_gamma)
         units = units_in(scene)
         words = words//words_in(units, ', {d tau~dt} = ')//reading_in(units, 'time', response%step) &
            //words_in(units, ', to {tau~t} = ')//reading_in(units, 'time', response%duration)
      end associate
   end function motion_in_words

   !> What a finer mesh does, and where the inertia of the stop's node is; nothing, if nothing is to be said.
   subroutine print_mesh(unit, check, units)
      !> Where to
      integer, intent(in) :: unit
      type(mesh_check_t), intent(in) :: check
      !> What results are in
      type(units_t), intent(in) :: units

      if (check%is_redistributed) call print_line(unit, '', 'inertia redistributed at the stop')
      if (check%adds_mass) call print_line(unit, '', &
         "the mesh adds to the mass that is struck: mass = 'auto' errs less")
      if (check%compared == 0) return
      call print_line(unit, '', 'with '//to_text(check%compared)//' elements the motion differs by '// &
         reading_in(units, 'displacement', check%difference)//words_in(units, ', until {tau~t} = ') &
         //reading_in(units, 'time', check%horizon))
      if (.not. check%is_settled) call print_line(unit, '', 'it does NOT settle within the tolerance on finer meshes')
   end subroutine print_mesh

   !> What leaving out modes does; nothing, if none was left out.
   subroutine print_modes(unit, check, units)
      integer, intent(in) :: unit
      !> The modes kept, and those compared
      type(mode_check_t), intent(in) :: check
      !> What results are in
      type(units_t), intent(in) :: units

      if (check%compared == 0) return
      call print_line(unit, 'modes', to_text(check%kept)//' kept; with '//to_text(check%compared)// &
         words_in(units, ' {eta~the displacement} differs by ')//reading_in(units, 'displacement', check%difference) &
         //words_in(units, ' until {tau~t} = ')//reading_in(units, 'time', check%horizon))
   end subroutine print_modes

   !> The measures of a run, a line each, and the highest points of its rebounds.
   subroutine print_measures(unit, measures, units, released)
      integer, intent(in) :: unit
      type(run_measures_t), intent(in) :: measures
      !> What results are in
      type(units_t), intent(in) :: units
      !> The stop of the rebounds, if that must be said; 0: it need not
      integer, intent(in), optional :: released

      character(label_width) :: heading
      real(wp) :: row(measure_count)
      integer :: i

      heading = 'rebound peaks'
      if (present(released)) then
         if (released > 0) heading = 'peaks at stop '//to_text(released)
      end if
      row = row_of(measures)
      write (unit, '()')
      do i = 1, measure_count
         if (measure_table(i)%group /= '' .and. ieee_is_nan(row(i))) cycle
         if (measure_table(i)%label /= '') call print_line(unit, words_in(units, trim(measure_table(i)%label)), &
            measure_in_words(i, row(i), measures%duration, units))
      end do
      if (measures%extremes_tolerance > peak_tolerance) call print_line(unit, 'extremes', &
         'certain within '//rounded(measures%extremes_tolerance)//' of themselves')
      if (measures%rebounds == 0) call print_line(unit, heading, 'none')
      do i = 1, min(measures%rebounds, most_peaks)
         call print_line(unit, merge(heading, repeat(' ', label_width), i == 1), words_in(units, '{eta~y - d} = ') &
            //said('displacement', measures%peak_eta(i), units)//words_in(units, ' at {tau~t} = ') &
            //said('time', measures%peak_tau(i), units))
      end do
      if (measures%rebounds > most_peaks) call print_line(unit, '', 'and '//to_text(measures%rebounds - most_peaks)// &
         ' more')
   end subroutine print_measures

   !> What happened at each of several surfaces, a line each.
   subroutine print_surfaces(unit, surfaces, units)
      integer, intent(in) :: unit
      !> With measures
      type(surface_record_t), intent(in) :: surfaces(:)
      !> What results are in
      type(units_t), intent(in) :: units

      integer, parameter :: size_of_heading = 32
      character(*), parameter :: shown(6) = [character(24) :: 'impacts', 'contacts', 'first_impact_tau', &
         'total_contact', 'greatest_force', 'greatest_impulse']
      character(*), parameter :: titles(6) = [character(24) :: 'impacts', 'lasting contacts', &
         'first at {tau =~t}', 'time in contact', 'greatest force', 'greatest impulse']
      character(column_width) :: cells(size(shown) + 1, size(surfaces))
      character(size_of_heading) :: headings(size(shown) + 1)
      real(wp) :: rows(measure_count, size(surfaces))
      integer :: i, k

      headings(1) = 'stop'
      do i = 1, size(surfaces)
         rows(:, i) = row_in(units, row_of(surfaces(i)%measures))
         cells(1, i) = surface_label(surfaces(i))
      end do
      do k = 1, size(shown)
         call fill_column(measure_named(shown(k)), rows, words_in(units, trim(titles(k))), units, headings(k + 1), &
            cells(k + 1, :))
      end do
      write (unit, '()')
      call print_columns(unit, headings, cells)
   end subroutine print_surfaces

   !> Such as '2 above'.
   pure function surface_label(surface) result(words)
      type(surface_record_t), intent(in) :: surface
      character(:), allocatable :: words

      words = to_text(surface%stop)//' '//merge('below', 'above', surface%sign > 0)
   end function surface_label

   !> A column of a measure; '-': it did not happen.
   pure subroutine fill_column(measure, rows, title, units, heading, cells)
      !> Its place in the table
      integer, intent(in) :: measure
      !> As results have them, [measure_count, lines]
      real(wp), intent(in) :: rows(:, :)
      character(*), intent(in) :: title
      !> What results are in
      type(units_t), intent(in) :: units
      !> The title, in units with the unit of all
      character(*), intent(out) :: heading
      character(*), intent(out) :: cells(:)

      character(:), allocatable :: unit
      real(wp) :: factor
      integer :: i

      factor = 1.0_wp
      heading = title
      associate (entry => measure_table(measure), values => rows(measure, :))
         if (units%are_of_scene .and. entry%quantity /= 'number') then
            call find_prefix(maxval(abs(values), mask=.not. ieee_is_nan(values)), &
               unit_of(quantity_named(entry%quantity), units), factor, unit)
            heading = title//', '//unit
         end if
         do i = 1, size(cells)
            cells(i) = '-'
            if (ieee_is_nan(values(i))) cycle
            cells(i) = fixed(values(i)*factor, 6)
            if (entry%is_whole) cells(i) = to_text(nint(values(i)))
         end do
      end associate
   end subroutine fill_column

   !> Such as '15', 'at tau = 1.547641', 'not until t = 6 ms'.
   pure function measure_in_words(measure, value, duration, units) result(words)
      !> Its place in the table
      integer, intent(in) :: measure
      !> Dimensionless; NaN: it did not happen
      real(wp), intent(in) :: value
      !> Length of the run, tau
      real(wp), intent(in) :: duration
      !> What results are in
      type(units_t), intent(in) :: units
      character(:), allocatable :: words

      associate (entry => measure_table(measure))
         if (ieee_is_nan(value)) then
            words = 'none'
            if (entry%lead /= '') words = words_in(units, 'not until {tau~t} = ')//reading_in(units, 'time', duration)
         else if (entry%is_whole) then
            words = to_text(nint(value))
            if (entry%lead /= '') words = trim(entry%lead)//' '//words
            if (entry%lead /= '' .and. nint(value) == 0) words = 'none found'
         else
            words = said(entry%quantity, value, units)
            if (entry%lead /= '') words = words_in(units, trim(entry%lead))//' '//words
         end if
      end associate
   end function measure_in_words

   !> A dimensionless value as results have it, with six decimals where that is without unit.
   pure function said(quantity, value, units) result(words)
      character(*), intent(in) :: quantity
      real(wp), intent(in) :: value
      !> What results are in
      type(units_t), intent(in) :: units
      character(:), allocatable :: words

      if (units%are_of_scene) then
         words = reading_in(units, quantity, value)
      else
         words = fixed(value, 6)
      end if
   end function said

end module console_tables
