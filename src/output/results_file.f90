!> The HDF5 file of a scene. What was not computed is not in it.
!>
!> Everything is dimensionless as inside the program; `in_scene_units`, an attribute of the datasets for
!> which it is known, is what one unit of theirs is in the units of the scene.
module results_file
   use, intrinsic :: iso_c_binding, only: c_char, c_size_t
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use failures, only: fail, failure_t
   use file_system, only: make_folder, replace_file
   use frequency_types, only: frequency_table_t
   use history_list, only: history_count, history_table
   use hdf5_writing, only: hdf5_group_t
   use kinds, only: lambda1, lambda1_power4, wp
   use measure_list, only: measure_table
   use measure_rows, only: write_measures_of_run
   use program_identity, only: program_name, program_version
   use response_types, only: event_name, event_separation, response_t, run_measures_t
   use run_measures, only: row_of
   use scene_types, only: name_length, scales_t, scene_t
   implicit none (type, external)
   private
   public :: write_results, results_name, begin_results, finish_results, write_run

   character(*), parameter :: conventions = &
      'tau = omega1 t; eta = (y - d)/(y_c(0) - d), y from the unstressed beam, the stop at y = d, y_c at the stop; ' &
      //'omega1 = 1.8751040687^2 sqrt(E Ibar/(rho Abar L^4)) of the uniform beam of mean height without tip mass; ' &
      //'omega_i = lambda_i^2 sqrt(E Ibar/(rho Abar L^4)); ' &
      //'contact force Pbar = hbar L^2 P/(1.8751040687^4 (y_c(0) - d) E Ibar); mass in rho Abar L, ' &
      //'so impulses in rho Abar L omega1 (y_c(0) - d) and energies in rho Abar L omega1^2 (y_c(0) - d)^2; ' &
      //'in_scene_units: one unit of a dataset in the units of the scene'

   !> One unit of each kind of quantity in the units of the scene; 0: not known.
   type :: units_t
      real(wp) :: length = 0.0_wp
      real(wp) :: time = 0.0_wp
      real(wp) :: frequency = 0.0_wp
      real(wp) :: displacement = 0.0_wp
      real(wp) :: slope = 0.0_wp
      real(wp) :: velocity = 0.0_wp
      real(wp) :: slope_velocity = 0.0_wp
      real(wp) :: force = 0.0_wp
      real(wp) :: impulse = 0.0_wp
      real(wp) :: energy = 0.0_wp
   end type units_t

contains

   !> The name of a scene's file in the folder of results.
   pure function results_name(scene) result(name)
      !> The scene
      type(scene_t), intent(in) :: scene
      character(:), allocatable :: name

      name = scene%name//'.h5'
   end function results_name

   !> Write the file of a scene, whole or not at all; the folder is made if it is not there.
   subroutine write_results(folder, scene, error, node_position, frequencies, response)
      !> Folder of the results
      character(*), intent(in) :: folder
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Why the file could not be written
      type(failure_t), allocatable, intent(out) :: error
      !> x/L of the nodes, clamp first, if the scene has one mesh
      real(wp), contiguous, intent(in), optional :: node_position(:)
      !> What was computed
      type(frequency_table_t), intent(in), optional :: frequencies
      type(response_t), intent(in), optional :: response

      type(hdf5_group_t) :: root

      call make_folder(folder, error)
      if (allocated(error)) return
      call begin_results(root, expected_size(response), scene)
      ! the sanitizer takes an absent array handed on for one that is read
      if (present(node_position)) then
         call write_run(root, scene, node_position, frequencies, response)
      else
         call write_run(root, scene, frequencies=frequencies, response=response)
      end if
      call finish_results(root, folder, scene, error)
   end subroutine write_results

   !> The groups of a run.
   subroutine write_run(group, scene, node_position, frequencies, response)
      !> The group
      type(hdf5_group_t), intent(in) :: group
      !> The scene
      type(scene_t), intent(in) :: scene
      !> x/L of the nodes, clamp first, if the scene has one mesh
      real(wp), contiguous, intent(in), optional :: node_position(:)
      !> What was computed
      type(frequency_table_t), intent(in), optional :: frequencies
      type(response_t), intent(in), optional :: response

      type(units_t) :: units

      units = units_of(scene%scales)
      if (present(node_position)) call write_mesh(group%group('mesh'), node_position, units)
      if (present(frequencies)) call write_frequencies(group%group('frequencies'), frequencies, units)
      if (present(response)) then
         call write_response(group%group('response'), response, units)
         call write_events(group%group('events'), response, units)
         if (allocated(response%shape_tau) .and. present(node_position)) &
            call write_shapes(group%group('shapes'), response, node_position, units)
         if (allocated(response%energy)) call write_energy(group%group('energy'), response, units)
         if (allocated(response%measures)) call write_measures(group%group('measures'), response%measures, units)
      end if
   end subroutine write_run

   !> Start the file of a scene: its attributes and the scene; a study adds groups of its own.
   subroutine begin_results(root, expected_bytes, scene)
      !> The root of the file
      type(hdf5_group_t), intent(inout) :: root
      !> About so many bytes will come
      integer(c_size_t), intent(in) :: expected_bytes
      !> The scene
      type(scene_t), intent(in) :: scene

      call root%begin(expected_bytes)
      call write_root(root, scene)
      call write_scene(root%group('scene'), scene)
   end subroutine begin_results

   !> Put the finished file into its folder, which is there.
   subroutine finish_results(root, folder, scene, error)
      !> The root of the file
      type(hdf5_group_t), intent(inout) :: root
      !> Folder of the results
      character(*), intent(in) :: folder
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Why the file could not be written
      type(failure_t), allocatable, intent(out) :: error

      character(kind=c_char), allocatable :: bytes(:)
      type(failure_t), allocatable :: refusal

      call root%finish(bytes, refusal)
      if (allocated(refusal)) then
         call fail(error, refusal%status, "cannot make '"//results_name(scene)//"': "//refusal%message)
         return
      end if
      call replace_file(folder, results_name(scene), bytes, error)
   end subroutine finish_results

   !> A guess at the size of the file in bytes, so that its memory is not moved about.
   pure function expected_size(response) result(bytes)
      !> The run
      type(response_t), intent(in), optional :: response
      integer(c_size_t) :: bytes

      integer(c_size_t), parameter :: event_parts = 8_c_size_t, shape_parts = 4_c_size_t, overhead = 262144_c_size_t
      integer :: histories, i

      bytes = 0_c_size_t
      if (present(response)) then
         histories = count([allocated(response%tau), (allocated(response%history(i)%values), i=1, history_count)])
         ! the ledger has an axis of its own
         if (allocated(response%energy)) histories = histories + 8
         if (allocated(response%tau)) bytes = bytes + int(histories, c_size_t)*size(response%tau, kind=c_size_t)
         bytes = bytes + event_parts*int(response%event_count, c_size_t)
         if (allocated(response%shape_displacement)) &
            bytes = bytes + shape_parts*size(response%shape_displacement, kind=c_size_t)
      end if
      bytes = overhead + bytes*(storage_size(1.0_wp)/8)
   end function expected_size

   !> One unit of each quantity in the units of the scene.
   pure function units_of(scales) result(units)
      !> The scene's scales
      type(scales_t), intent(in) :: scales
      type(units_t) :: units

      units%length = scales%length
      units%time = 1.0_wp/scales%omega1
      units%frequency = scales%omega1
      if (scales%displacement <= 0.0_wp) return
      units%displacement = scales%displacement
      units%slope = scales%displacement/scales%length
      units%velocity = scales%omega1*units%displacement
      units%slope_velocity = scales%omega1*units%slope
      units%force = lambda1_power4*scales%displacement*scales%bending_stiffness/(scales%height_ratio*scales%length**3)
      units%impulse = scales%beam_mass*units%velocity
      units%energy = scales%beam_mass*units%velocity**2
   end function units_of

   !> One unit of a measure or a history in the units of the scene; 0: not known.
   elemental function in_scene_units(unit, units) result(value)
      !> As in their tables
      character(*), intent(in) :: unit
      !> Those of the scene
      type(units_t), intent(in) :: units
      real(wp) :: value

      select case (unit)
      case ('tau')
         value = units%time
      case ('eta')
         value = units%displacement
      case ('eta/tau')
         value = units%velocity
      case ('Pbar')
         value = units%force
      case ('impulse')
         value = units%impulse
      case default
         value = 0.0_wp
      end select
   end function in_scene_units

   !> Attributes of the file.
   subroutine write_root(group, scene)
      !> The group
      type(hdf5_group_t), intent(in) :: group
      !> The scene
      type(scene_t), intent(in) :: scene

      if (allocated(scene%title)) then
         call group%note('title', scene%title)
      else
         call group%note('title', scene%name)
      end if
      call group%note('name', scene%name)
      call group%note('program', program_name)
      call group%note('version', program_version)
      call group%note('conventions', conventions)
   end subroutine write_root

   !> The input as read, and a group for each of its groups with the resolved values as attributes.
   subroutine write_scene(group, scene)
      !> Its group
      type(hdf5_group_t), intent(in) :: group
      !> The scene
      type(scene_t), intent(in) :: scene

      type(hdf5_group_t) :: echoed
      character(:), allocatable :: name
      integer :: i

      if (allocated(scene%text)) call group%add('text', scene%text, 'none', 'scene file as read')
      if (.not. allocated(scene%echo)) return
      name = ''
      do i = 1, size(scene%echo)
         associate (entry => scene%echo(i))
            if (entry%group /= name) then
               name = entry%group
               echoed = group%group(name)
            end if
            if (.not. allocated(entry%number)) then
               call echoed%note(entry%name, entry%text)
            else if (entry%is_list) then
               call echoed%note(entry%name, entry%number)
            else
               call echoed%note(entry%name, entry%number(1))
            end if
         end associate
      end do
   end subroutine write_scene

   !> Nodes and elements.
   subroutine write_mesh(group, node_position, units)
      !> Its group
      type(hdf5_group_t), intent(in) :: group
      !> x/L of the nodes
      real(wp), contiguous, intent(in) :: node_position(:)
      !> Units
      type(units_t), intent(in) :: units

      integer :: elements, i

      elements = size(node_position) - 1
      call group%add('x', node_position, '1', 'position of the nodes x/L', is_scale=.true.)
      call group%note('in_scene_units', units%length, 'x')
      call group%add('element', [(i, i=1, elements)], '1', 'element, clamp first', is_scale=.true.)
      call group%add('element_length', node_position(2:) - node_position(:elements), '1', &
                     'length of the elements in L', along='element')
      call group%note('in_scene_units', units%length, 'element_length')
   end subroutine write_mesh

   !> The table of frequencies; where a mesh has no such mode, or its solver failed, stands NaN.
   subroutine write_frequencies(group, table, units)
      !> Its group
      type(hdf5_group_t), intent(in) :: group
      !> The table
      type(frequency_table_t), intent(in) :: table
      !> Units
      type(units_t), intent(in) :: units

      character(*), parameter :: of_columns = 'column_solver column_elements column_ratio'
      integer, parameter :: longest_failure = 200
      character(name_length) :: solver(size(table%columns))
      character(longest_failure) :: failure(size(table%columns))
      integer :: column, columns, elements(size(table%columns)), i, modes, rows
      real(wp) :: nan, ratio(size(table%columns))
      real(wp), allocatable :: error(:, :), lambda(:, :), omega(:, :)

      columns = size(table%columns)
      rows = 0
      if (allocated(table%exact)) rows = size(table%exact)
      do column = 1, columns
         rows = max(rows, size(table%columns(column)%lambda))
      end do
      nan = ieee_value(nan, ieee_quiet_nan)
      allocate (lambda(columns, rows), omega(columns, rows), error(columns, rows), source=nan)
      do column = 1, columns
         solver(column) = table%columns(column)%solver
         failure(column) = ''
         if (allocated(table%columns(column)%failure)) failure(column) = table%columns(column)%failure
         elements(column) = table%columns(column)%elements
         ratio(column) = table%columns(column)%ratio
         modes = size(table%columns(column)%lambda)
         lambda(column, :modes) = table%columns(column)%lambda
         omega(column, :modes) = (table%columns(column)%lambda/lambda1)**2
         if (.not. allocated(table%exact)) cycle
         modes = min(modes, size(table%exact))
         error(column, :modes) = 100.0_wp*(table%columns(column)%lambda(:modes)/table%exact(:modes) - 1.0_wp)
      end do

      call group%add('mode', [(i, i=1, rows)], '1', 'mode', is_scale=.true.)
      call group%add('column', [(i, i=1, columns)], '1', 'column of the table: a solver on a mesh', is_scale=.true.)
      call group%add('column_solver', solver, 'none', 'solver', along='column')
      call group%add('column_elements', elements, '1', 'number of elements n', along='column')
      call group%add('column_ratio', ratio, '1', 'ratio of neighbouring lengths l_i/l_(i+1)', along='column')
      call group%add('column_failure', failure, 'none', 'why the solver gave no values; empty: it gave some', along='column')
      call group%add('lambda', lambda, '1', 'lambda: omega = lambda^2 sqrt(E Ibar/(rho Abar L^4))', ['column', 'mode  '])
      call group%note('coordinates', of_columns, 'lambda')
      call group%add('omega', omega, '1', 'circular frequency in omega1', ['column', 'mode  '])
      call group%note('in_scene_units', units%frequency, 'omega')
      call group%note('coordinates', of_columns, 'omega')
      if (allocated(table%exact)) then
         call group%add('lambda_exact', table%exact, '1', 'exact lambda', along='mode')
         call group%add('error', error, 'percent', 'error of lambda against the exact value', ['column', 'mode  '])
         call group%note('coordinates', of_columns, 'error')
      end if
      if (allocated(table%shape)) call write_mode_shapes(group%group('shapes'), table, units)
   end subroutine write_frequencies

   !> Mode shapes on the first mesh of the table.
   subroutine write_mode_shapes(group, table, units)
      !> Its group
      type(hdf5_group_t), intent(in) :: group
      !> The table
      type(frequency_table_t), intent(in) :: table
      !> Units
      type(units_t), intent(in) :: units

      integer :: i

      call group%add('mode', [(i, i=1, size(table%shape, 2))], '1', 'mode', is_scale=.true.)
      call group%add('x', table%node, '1', 'position of the nodes x/L', is_scale=.true.)
      call group%note('in_scene_units', units%length, 'x')
      call group%add('displacement', table%shape, '1', 'mode shape of unit modal mass (mass in rho Abar L)', ['x   ', 'mode'])
      if (allocated(table%shape_slope)) &
         call group%add('slope', table%shape_slope, '1', 'its derivative by x/L', ['x   ', 'mode'])
      call group%add('mass_orthogonality', table%mass_orthogonality, '1', 'largest |phi_i.M phi_j - delta_ij|')
      call group%add('stiffness_orthogonality', table%stiffness_orthogonality, '1', &
                     'largest |phi_i.K phi_j/(lambda_i lambda_j)^2 - delta_ij|')
   end subroutine write_mode_shapes

   !> The histories.
   subroutine write_response(group, response, units)
      !> Its group
      type(hdf5_group_t), intent(in) :: group
      !> The run
      type(response_t), intent(in) :: response
      !> Units
      type(units_t), intent(in) :: units

      integer :: i

      call group%note('evaluations', real(response%evaluations, wp))
      call group%note('rejected', real(response%rejected, wp))
      call group%note('factorisations', real(response%factorisations, wp))
      associate (check => response%mode_check)
         call group%note('modes_kept', real(check%kept, wp))
         if (check%compared > 0) then
            call group%note('modes_compared', real(check%compared, wp))
            call group%note('mode_difference', check%difference)
            call group%note('mode_horizon', check%horizon)
         end if
      end associate
      if (.not. allocated(response%tau)) return
      call write_times(group, response%tau, 'time tau', units)
      do i = 1, history_count
         call write_along_tau(group, trim(history_table(i)%dataset), response%history(i)%values, trim(history_table(i)%meaning), &
                              in_scene_units(history_table(i)%unit, units))
      end do
   end subroutine write_response

   !> The scale of a group that goes along time.
   subroutine write_times(group, tau, long_name, units)
      !> The group
      type(hdf5_group_t), intent(in) :: group
      !> Times
      real(wp), contiguous, intent(in) :: tau(:)
      !> What they are
      character(*), intent(in) :: long_name
      !> Units
      type(units_t), intent(in) :: units

      call group%add('tau', tau, '1', long_name, is_scale=.true.)
      call group%note('in_scene_units', units%time, 'tau')
   end subroutine write_times

   !> A list along the times of its group, if it is there.
   subroutine write_along_tau(group, name, values, long_name, unit)
      !> The group
      type(hdf5_group_t), intent(in) :: group
      !> Name, values and meaning of the dataset
      character(*), intent(in) :: name
      real(wp), contiguous, intent(in), optional :: values(:)
      character(*), intent(in) :: long_name
      !> One unit of it in the units of the scene; 0: not known
      real(wp), intent(in) :: unit

      if (.not. present(values)) return
      call group%add(name, values, '1', long_name, along='tau')
      if (unit > 0.0_wp) call group%note('in_scene_units', unit, name)
   end subroutine write_along_tau

   !> The events.
   subroutine write_events(group, response, units)
      !> Its group
      type(hdf5_group_t), intent(in) :: group
      !> The run
      type(response_t), intent(in) :: response
      !> Units
      type(units_t), intent(in) :: units

      character(:), allocatable :: meanings
      integer :: count, i

      meanings = event_name(1)
      do i = 2, event_separation
         meanings = meanings//' '//event_name(i)
      end do
      count = response%event_count
      call write_times(group, [(response%events(i)%tau, i=1, count)], 'time of the event, tau', units)
      call group%add('kind', [(response%events(i)%kind, i=1, count)], '1', 'kind of the event', along='tau')
      call group%note('flag_values', [(i, i=1, event_separation)], 'kind')
      call group%note('flag_meanings', meanings, 'kind')
      call write_along_tau(group, 'eta', [(response%events(i)%eta, i=1, count)], &
                           'displacement of the beam at the stop, eta', units%displacement)
      call write_along_tau(group, 'velocity_before', [(response%events(i)%velocity_before, i=1, count)], &
                           'velocity of the beam at the stop just before, d eta/d tau', units%velocity)
      call write_along_tau(group, 'velocity_after', [(response%events(i)%velocity_after, i=1, count)], &
                           'velocity of the beam at the stop just after, d eta/d tau', units%velocity)
      call write_along_tau(group, 'impulse', [(response%events(i)%impulse, i=1, count)], &
                           'impulse on the beam in rho Abar L omega1 (y_c(0) - d)', units%impulse)
      call write_along_tau(group, 'energy_change', [(response%events(i)%energy_change, i=1, count)], &
                           'change of energy in rho Abar L omega1^2 (y_c(0) - d)^2', units%energy)
   end subroutine write_events

   !> Shapes of the whole beam at chosen instants.
   subroutine write_shapes(group, response, node_position, units)
      !> Its group
      type(hdf5_group_t), intent(in) :: group
      !> The run
      type(response_t), intent(in) :: response
      !> x/L of the nodes
      real(wp), contiguous, intent(in) :: node_position(:)
      !> Units
      type(units_t), intent(in) :: units

      call write_times(group, response%shape_tau, 'time tau', units)
      call group%add('x', node_position, '1', 'position of the nodes x/L', is_scale=.true.)
      call group%note('in_scene_units', units%length, 'x')
      call write_shape('displacement', response%shape_displacement, 'displacement of the beam, eta', units%displacement)
      call write_shape('slope', response%shape_slope, 'd eta/d(x/L)', units%slope)
      call write_shape('velocity', response%shape_velocity, 'velocity of the beam, d eta/d tau', units%velocity)
      call write_shape('slope_velocity', response%shape_slope_velocity, 'd^2 eta/(d(x/L) d tau)', units%slope_velocity)

   contains

      !> One table over nodes and instants, if it is there.
      subroutine write_shape(name, values, long_name, unit)
         !> Name, values and meaning of the dataset
         character(*), intent(in) :: name
         real(wp), contiguous, intent(in), optional :: values(:, :)
         character(*), intent(in) :: long_name
         !> One unit of it in the units of the scene; 0: not known
         real(wp), intent(in) :: unit

         if (.not. present(values)) return
         call group%add(name, values, '1', long_name, ['x  ', 'tau'])
         if (unit > 0.0_wp) call group%note('in_scene_units', unit, name)
      end subroutine write_shape

   end subroutine write_shapes

   !> The ledger.
   subroutine write_energy(group, response, units)
      !> Its group
      type(hdf5_group_t), intent(in) :: group
      !> The run
      type(response_t), intent(in) :: response
      !> Units
      type(units_t), intent(in) :: units

      call group%note('initial', response%initial_energy)
      call write_times(group, response%tau, 'time tau', units)
      associate (energy => response%energy)
         call write_along_tau(group, 'kinetic', energy%kinetic, 'kinetic energy of beam and tip mass', units%energy)
         call write_along_tau(group, 'strain', energy%strain, 'strain energy of the beam', units%energy)
         call write_along_tau(group, 'stop', energy%stop, 'energy in the springs of the stop', units%energy)
         call write_along_tau(group, 'dissipated_beam', energy%dissipated_beam, &
                              'dissipated so far inside the beam', units%energy)
         call write_along_tau(group, 'dissipated_stop', energy%dissipated_stop, &
                              'dissipated so far in the stop', units%energy)
         call write_along_tau(group, 'dissipated_impact', energy%dissipated_impact, &
                              'dissipated so far at impacts', units%energy)
         call write_along_tau(group, 'created', energy%created, &
                              'created so far by the nodal reading of the impulse', units%energy)
      end associate
   end subroutine write_energy

   !> What the table on the console says.
   subroutine write_measures(group, measures, units)
      !> Its group
      type(hdf5_group_t), intent(in) :: group
      !> The measures
      type(run_measures_t), intent(in) :: measures
      !> Units
      type(units_t), intent(in) :: units

      integer :: i

      call group%add('duration', measures%duration, '1', 'length of the run, tau')
      call group%note('in_scene_units', units%time, 'duration')
      call write_measures_of_run(group, row_of(measures), in_scene_units(measure_table%unit, units))
      call group%add('contact', [(i, i=1, size(measures%contact_start))], '1', 'contact', is_scale=.true.)
      call write_along('contact_start', measures%contact_start, 'begin of the contact, tau', 'contact', units%time)
      call write_along('contact_end', measures%contact_end, 'end of the contact or of the run, tau', 'contact', units%time)
      call group%add('rebound', [(i, i=1, size(measures%peak_eta))], '1', 'rebound', is_scale=.true.)
      call write_along('peak_tau', measures%peak_tau, 'time of the peak of the rebound, tau', 'rebound', units%time)
      call write_along('peak', measures%peak_eta, 'peak of the rebound, eta at the stop', 'rebound', units%displacement)

   contains

      !> A list along contacts or rebounds.
      subroutine write_along(name, values, long_name, scale, unit)
         !> Name, values and meaning of the dataset
         character(*), intent(in) :: name
         real(wp), contiguous, intent(in) :: values(:)
         character(*), intent(in) :: long_name
         !> What it goes along
         character(*), intent(in) :: scale
         !> One unit of it in the units of the scene; 0: not known
         real(wp), intent(in) :: unit

         call group%add(name, values, '1', long_name, along=scale)
         if (unit > 0.0_wp) call group%note('in_scene_units', unit, name)
      end subroutine write_along

   end subroutine write_measures

end module results_file
