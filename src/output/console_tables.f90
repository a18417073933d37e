!> Short tables of results for people to read.
module console_tables
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use frequency_types, only: frequency_column_t, frequency_table_t
   use kinds, only: wp
   use measure_list, only: measure_count, measure_named, measure_table
   use number_text, only: rounded, to_text
   use response_types, only: mesh_check_t, mode_check_t, run_measures_t, surface_record_t
   use run_measures, only: row_of
   use run_settings, only: method_names, method_newmark, side_below, stop_settings_t
   use scene_types, only: scene_t, shape_taper
   use stop_words, only: law_in_words, place_in_words, released_stop, stops_in_scene, support_in_words
   use text_columns, only: at_right, fixed, label_width, print_columns, print_line
   implicit none (type, external)
   private
   public :: print_model, print_frequency_table, print_measures, print_mesh, print_modes, print_surfaces
   public :: measured

   !> Width of a column of numbers.
   integer, parameter :: column_width = 12
   !> Wider tables of frequencies are printed in parts.
   integer, parameter :: most_columns = 6
   !> So many rebounds are listed; of more only the number is said.
   integer, parameter :: most_peaks = 12
   !> Errors in percent below this are written with an exponent.
   real(wp), parameter :: smallest_plain_error = 0.001_wp

contains

   !> What is computed: name, title, beam, mesh, stop, method.
   subroutine print_model(unit, scene, node_position)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      !> x/L of the nodes, [0:n]; not there if no motion is computed
      real(wp), intent(in), optional :: node_position(0:)

      character(:), allocatable :: heading

      heading = scene%name
      if (allocated(scene%title)) then
         if (scene%title /= '') heading = heading//': '//scene%title
      end if
      write (unit, '(a)') heading
      call print_line(unit, 'beam', beam_in_words(scene))
      if (scene%wants_response) then
         if (scene%mesh%tolerance > 0.0_wp .and. present(node_position)) then
            call print_line(unit, 'mesh', to_text(size(node_position) - 1)//' elements, found for a tolerance of ' &
               //rounded(scene%mesh%tolerance))
         else
            call print_line(unit, 'mesh', to_text(scene%mesh%elements)//' elements, l_i/l_(i+1) = ' &
               //to_text(scene%mesh%ratio))
         end if
         call print_stops(unit, scene, node_position)
         call print_line(unit, 'motion', motion_in_words(scene))
      end if
   end subroutine print_model

   !> Section, damping and tip mass.
   function beam_in_words(scene) result(words)
      type(scene_t), intent(in) :: scene
      character(:), allocatable :: words

      associate (beam => scene%beam)
         if (beam%shape /= shape_taper) then
            words = 'section given by a table'
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
      words = words//', hbar/L = '//rounded(scene%scales%height_ratio)
      if (scene%zeta > 0.0_wp .or. scene%wants_response) words = words//', zeta = '//rounded(scene%zeta)
      words = words//', mu = '//rounded(scene%tip_mass_ratio)
   end function beam_in_words

   !> Where each stop is and its law: of the paper's one in a line, of others in two.
   subroutine print_stops(unit, scene, node_position)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      !> x/L of the nodes, [0:n]
      real(wp), intent(in), optional :: node_position(0:)

      type(stop_settings_t), allocatable :: stops(:)
      character(:), allocatable :: label, words
      integer :: k

      allocate (stops, source=stops_in_scene(scene))
      do k = 1, size(stops)
         label = 'stop'
         if (size(stops) > 1) label = label//' '//to_text(k)
         words = place_in_words(stops(k), node_position)
         if (size(stops) == 1 .and. stops(k)%side == side_below) then
            call print_line(unit, label, law_in_words(stops(k))//', '//words)
            cycle
         end if
         if (k == released_stop(scene)) words = words//'; released from it'
         if (stops(k)%side == side_below) words = 'below, '//words
         call print_line(unit, label, words)
         call print_line(unit, '', law_in_words(stops(k)))
      end do
      if (.not. allocated(scene%supports)) return
      do k = 1, size(scene%supports)
         call print_line(unit, 'support '//to_text(k), support_in_words(scene%supports(k)))
      end do
   end subroutine print_stops

   !> Method and length of the run.
   function motion_in_words(scene) result(words)
      type(scene_t), intent(in) :: scene
      character(:), allocatable :: words

      associate (response => scene%response)
         words = trim(method_names(response%method))
         if (response%method == method_newmark) words = words//', beta = '//rounded(response%newmark_beta)// &
            ', gamma = '//rounded(response%newmark_gamma)
         words = words//', d tau = '//rounded(response%step)//', to tau = '//rounded(response%duration)
      end associate
   end function motion_in_words

   !> A table of frequencies: a row for each mode, a column for each mesh and solver, '-' where a mesh
   !> has no such mode; and the same for the errors, where exact values are known. A table of one column
   !> has its errors beside it. Then why a solver has failed, if one has.
   subroutine print_frequency_table(unit, table)
      integer, intent(in) :: unit
      type(frequency_table_t), intent(in) :: table

      type(frequency_table_t) :: part
      integer :: first, i

      if (size(table%columns) == 1) then
         call print_column(unit, table)
      else
         do first = 1, size(table%columns), most_columns
            part%columns = table%columns(first:min(first + most_columns - 1, size(table%columns)))
            if (allocated(table%exact)) part%exact = table%exact
            call print_frequency_columns(unit, part)
         end do
      end if
      if (allocated(table%shape)) write (unit, '(/, 2x, 2(a, es7.1))') 'mode shapes: orthogonal in M to ', &
         table%mass_orthogonality, ', in K to ', table%stiffness_orthogonality
      do i = 1, size(table%columns)
         associate (column => table%columns(i))
            if (allocated(column%failure)) write (unit, '(2x, a)') 'no values for n = '//to_text(column%elements) &
               //', l_i/l_(i+1) = '//rounded(column%ratio)//', '//column%solver//': '//column%failure
         end associate
      end do
   end subroutine print_frequency_table

   !> A table of one column.
   subroutine print_column(unit, table)
      integer, intent(in) :: unit
      type(frequency_table_t), intent(in) :: table

      character(column_width) :: cells(3)
      integer :: mode
      logical :: has_exact

      has_exact = allocated(table%exact)
      associate (column => table%columns(1))
         write (unit, '(/, 2x, a)') 'lambda, '//to_text(column%elements)//' elements, l_i/l_(i+1) = ' &
            //rounded(column%ratio)//', solver '//column%solver
         cells(:) = ''
         cells(1) = adjust_right('lambda')
         if (has_exact) cells(2:3) = [adjust_right('exact'), adjust_right('error %')]
         call print_cells(unit, '', cells)
         do mode = 1, size(column%lambda)
            cells(:) = ''
            cells(1) = adjust_right(fixed(column%lambda(mode), 6))
            if (has_exact) then
               if (mode <= size(table%exact)) cells(2:3) = [ &
                  adjust_right(fixed(table%exact(mode), 6)), &
                  adjust_right(error_text(100.0_wp*(column%lambda(mode)/table%exact(mode) - 1.0_wp)))]
            end if
            call print_cells(unit, 'mode '//to_text(mode), cells)
         end do
      end associate
   end subroutine print_column

   !> A table of several columns.
   subroutine print_frequency_columns(unit, table)
      integer, intent(in) :: unit
      type(frequency_table_t), intent(in) :: table

      character(column_width) :: cells(size(table%columns) + 1)
      integer :: column, columns, mode, rows

      columns = size(table%columns)
      rows = 0
      if (allocated(table%exact)) rows = size(table%exact)
      do column = 1, columns
         rows = max(rows, size(table%columns(column)%lambda))
      end do

      call print_heading(unit, table%columns, 'lambda', allocated(table%exact))
      do mode = 1, rows
         cells(:) = adjust_right('-')
         do column = 1, columns
            associate (lambda => table%columns(column)%lambda)
               if (mode <= size(lambda)) cells(column) = adjust_right(fixed(lambda(mode), 6))
            end associate
         end do
         cells(columns + 1) = ''
         if (allocated(table%exact)) then
            if (mode <= size(table%exact)) cells(columns + 1) = adjust_right(fixed(table%exact(mode), 6))
         end if
         call print_cells(unit, 'mode '//to_text(mode), cells)
      end do
      if (.not. allocated(table%exact)) return

      call print_heading(unit, table%columns, 'error of lambda in percent', .false.)
      do mode = 1, min(rows, size(table%exact))
         cells(:) = adjust_right('-')
         cells(columns + 1) = ''
         do column = 1, columns
            associate (lambda => table%columns(column)%lambda, exact => table%exact(mode))
               if (mode <= size(lambda)) cells(column) = &
                  adjust_right(error_text(100.0_wp*(lambda(mode)/exact - 1.0_wp)))
            end associate
         end do
         call print_cells(unit, 'mode '//to_text(mode), cells)
      end do
   end subroutine print_frequency_columns

   !> What the columns of a table of frequencies are.
   subroutine print_heading(unit, columns, heading, has_exact)
      integer, intent(in) :: unit
      type(frequency_column_t), intent(in) :: columns(:)
      !> What the numbers are
      character(*), intent(in) :: heading
      !> The last column is that of the exact values
      logical, intent(in) :: has_exact

      character(column_width) :: cells(size(columns) + 1)
      integer :: i

      write (unit, '(/, 2x, a)') heading
      cells(:) = ''
      do i = 1, size(columns)
         cells(i) = adjust_right(to_text(columns(i)%elements))
      end do
      if (has_exact) cells(size(cells)) = adjust_right('exact')
      call print_cells(unit, 'elements n', cells)
      cells(size(cells)) = ''
      do i = 1, size(columns)
         cells(i) = adjust_right(rounded(columns(i)%ratio))
      end do
      call print_cells(unit, 'l_i/l_(i+1)', cells)
      do i = 1, size(columns)
         cells(i) = adjust_right(columns(i)%solver)
      end do
      call print_cells(unit, 'solver', cells)
   end subroutine print_heading

   !> What a finer mesh does, and where the inertia of the stop's node is; nothing, if nothing is to be said.
   subroutine print_mesh(unit, check)
      !> Where to
      integer, intent(in) :: unit
      type(mesh_check_t), intent(in) :: check

      if (check%is_redistributed) call print_line(unit, '', 'inertia redistributed at the stop')
      if (check%adds_mass) call print_line(unit, '', &
         "the mesh adds to the mass that is struck: mass = 'auto' errs less")
      if (check%compared == 0) return
      call print_line(unit, '', 'with '//to_text(check%compared)//' elements the motion differs by '// &
         rounded(check%difference)//' until tau = '//rounded(check%horizon))
      if (.not. check%is_settled) call print_line(unit, '', 'it does NOT settle within the tolerance on finer meshes')
   end subroutine print_mesh

   !> What leaving out modes does; nothing, if none was left out.
   subroutine print_modes(unit, check)
      integer, intent(in) :: unit
      !> The modes kept, and those compared
      type(mode_check_t), intent(in) :: check

      if (check%compared == 0) return
      call print_line(unit, 'modes', to_text(check%kept)//' kept; with '//to_text(check%compared)// &
         ' eta differs by '//rounded(check%difference)//' until tau = '//rounded(check%horizon))
   end subroutine print_modes

   !> The measures of a run, a line each, and the highest points of its rebounds.
   subroutine print_measures(unit, measures, released)
      integer, intent(in) :: unit
      type(run_measures_t), intent(in) :: measures
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
         if (measure_table(i)%label /= '') call print_line(unit, trim(measure_table(i)%label), &
            measure_in_words(i, row(i), 6, measures%duration))
      end do
      if (measures%rebounds == 0) call print_line(unit, heading, 'none')
      do i = 1, min(measures%rebounds, most_peaks)
         call print_line(unit, merge(heading, repeat(' ', label_width), i == 1), 'eta = ' &
            //fixed(measures%peak_eta(i), 6)//' at tau = '//fixed(measures%peak_tau(i), 6))
      end do
      if (measures%rebounds > most_peaks) call print_line(unit, '', 'and '//to_text(measures%rebounds - most_peaks)// &
         ' more')
   end subroutine print_measures

   !> What happened at each of several surfaces, a line each.
   subroutine print_surfaces(unit, surfaces)
      integer, intent(in) :: unit
      !> With measures
      type(surface_record_t), intent(in) :: surfaces(:)

      integer, parameter :: size_of_heading = 16
      character(*), parameter :: shown(6) = [character(24) :: 'impacts', 'contacts', 'first_impact_tau', &
         'total_contact', 'greatest_force', 'greatest_impulse']
      character(column_width) :: cells(size(shown) + 2, size(surfaces))
      character(size_of_heading) :: headings(size(shown) + 2)
      real(wp) :: row(measure_count)
      integer :: i, k

      headings = [character(size_of_heading) :: 'stop', 'side', 'impacts', 'lasting contacts', 'first at tau =', &
         'time in contact', 'greatest force', 'greatest impulse']
      do i = 1, size(surfaces)
         row = row_of(surfaces(i)%measures)
         cells(:2, i) = [character(column_width) :: to_text(surfaces(i)%stop), &
            trim(merge('below', 'above', surfaces(i)%sign > 0))]
         do k = 1, size(shown)
            cells(k + 2, i) = measured(measure_named(shown(k)), row)
         end do
      end do
      write (unit, '()')
      call print_columns(unit, headings, cells)
   end subroutine print_surfaces

   !> A measure for a cell of a table; '-': it did not happen.
   function measured(measure, row) result(text)
      !> Its place in the table
      integer, intent(in) :: measure
      !> [measure_count]
      real(wp), intent(in) :: row(:)
      character(:), allocatable :: text

      text = '-'
      if (ieee_is_nan(row(measure))) return
      text = fixed(row(measure), 6)
      if (measure_table(measure)%is_whole) text = to_text(nint(row(measure)))
   end function measured

   !> Such as '15', 'at tau = 1.547641', 'not until tau = 20'.
   function measure_in_words(measure, value, decimals, duration) result(words)
      !> Its place in the table
      integer, intent(in) :: measure
      !> NaN: it did not happen
      real(wp), intent(in) :: value
      integer, intent(in) :: decimals
      !> Length of the run, tau
      real(wp), intent(in) :: duration
      character(:), allocatable :: words

      associate (entry => measure_table(measure))
         if (ieee_is_nan(value)) then
            words = 'none'
            if (entry%lead /= '') words = 'not until tau = '//rounded(duration)
         else if (entry%is_whole) then
            words = to_text(nint(value))
         else
            words = fixed(value, decimals)
            if (entry%lead /= '') words = trim(entry%lead)//' '//words
         end if
      end associate
   end function measure_in_words

   !> A row of a table.
   subroutine print_cells(unit, label, cells)
      integer, intent(in) :: unit
      !> The row's label
      character(*), intent(in) :: label
      !> Its cells
      character(column_width), intent(in) :: cells(:)

      character(column_width) :: padded
      character(:), allocatable :: line
      integer :: i

      padded = label
      line = padded
      do i = 1, size(cells)
         line = line//cells(i)
      end do
      write (unit, '(2x, a)') trim(line)
   end subroutine print_cells

   !> An error in percent: four decimals, or an exponent where these would hide it.
   pure function error_text(error) result(text)
      real(wp), intent(in) :: error
      character(:), allocatable :: text

      character(32) :: buffer

      if (abs(error) >= smallest_plain_error .or. abs(error) <= 0.0_wp) then
         text = fixed(error, 4)
      else
         write (buffer, '(es12.1e2)') error
         text = trim(adjustl(buffer))
      end if
   end function error_text

   !> A text at the right of a column.
   pure function adjust_right(text) result(cell)
      character(*), intent(in) :: text
      character(column_width) :: cell

      cell = at_right(text, column_width)
   end function adjust_right

end module console_tables
