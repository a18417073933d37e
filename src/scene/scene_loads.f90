!> &force and &base: the names of the groups, reading of tables of loads, and checks. A file may have any number of each
!> group.
module scene_loads
   use file_system, only: path_beside
   use kinds, only: pi, wp
   use load_settings, only: base_displacement, base_names, base_settings_t, course_harmonic, course_names, &
      course_table, force_settings_t, pulse_names, start_release, time_course_t
   use name_table, only: table_t
   use name_types, only: condition_t, in_units_t, kind_text, name_t, sweep_t, duration_range, instant_range, &
      load_range, point_range, positive_range, range_t, range_text, signed_range
   use number_text, only: to_text
   use quantities, only: system_none
   use run_settings, only: impulse_nodal, law_restitution
   use scene_input, only: scene_input_t
   use scene_start, only: check_start
   use scene_types, only: scene_t
   use signal_file, only: read_signal, signal_t
   use signal_units, only: convert_unit
   implicit none (type, external)
   private
   public :: list_forces, list_bases, resolve_loads

   ! Conditions that several names have in common: kinds of time functions
   type(condition_t), parameter :: harmonic = condition_t(name='kind', words='harmonic')
   type(condition_t), parameter :: pulse = condition_t(name='kind', words='pulse')
   type(condition_t), parameter :: lasting = condition_t(name='kind', words='harmonic step table')
   type(condition_t), parameter :: tabulated = condition_t(name='kind', words='table')

   real(wp), parameter :: degree = pi/180.0_wp

contains

   !> List the names of all &force groups in the table, and bind them to the components of the scene.
   subroutine list_forces(table, scene)
      class(table_t), intent(inout) :: table
      !> The scene; its forces are bound
      type(scene_t), intent(inout) :: scene

      ! number of the first parameter of this group in sweeps; `list_course` uses the next five
      integer, parameter :: first_parameter = 30
      real(wp), allocatable :: stretch(:)
      integer :: k

      if (.not. allocated(scene%forces)) allocate (scene%forces(table%groups_to_list('force', 0)))
      do k = 1, size(scene%forces)
         call table%open_numbered('force', k, scene%has_forces)
         if (.not. table%lists_names) cycle
         associate (force => scene%forces(k))
            call table%bind(force%position, name_t('position', 'points over length, with the whole force at each', &
               point_range, condition_t(without='stretch stretch_length', phrase='points, not with stretch'), &
               default='none: give position or stretch', is_optional=.true., &
               sweep=sweep_t(first_parameter + 6, is_in_cases=.true., meaning='point of the force over length')), &
               in_units_t('position_length', 'length', 'the same as lengths from the root'))
            stretch = force%stretch
            call table%bind(stretch, name_t('stretch', &
               'beginning and end of the line load over length, such as 0.5, 1', point_range, &
               condition_t(without='position position_length', phrase='a line load, not with position'), &
               default='none: give position or stretch', is_optional=.true.), &
               in_units_t('stretch_length', 'length', 'the same as lengths from the root'))
            ! `check_force` reports a list that does not have two values
            if (allocated(stretch)) force%stretch = [stretch(1), stretch(size(stretch))]
            call table%bind(force%course%kind, name_t('kind', 'course in time'), course_names)
            call table%bind(force%course%amplitude, name_t('amplitude_ratio', 'force up over 3 E Ibar D / L^3, a ' &
               //'line load over 3 E Ibar D / L^4, D the unit of displacement; factor of a table', load_range, &
               default='none: give one', &
               sweep=sweep_t(first_parameter, is_in_cases=.true., may_change_in_motion=.true.)), &
               in_units_t('amplitude', 'load', 'force up, a line load over length; factor of a table in units', &
               signed_range))
            call list_course(table, force%course, first_parameter)
         end associate
      end do
      if (.not. scene%has_forces) deallocate (scene%forces)
   end subroutine list_forces

   !> List the names of a time function (course), except kind and amplitude, in the table, and bind them to its
   !> components.
   subroutine list_course(table, course, first)
      class(table_t), intent(inout) :: table
      type(time_course_t), intent(inout) :: course
      !> Number of the first parameter of the group for sweeps
      integer, intent(in) :: first

      ! phase in degrees
      real(wp) :: degrees
      ! phase in degrees before `bind`
      real(wp) :: given_degrees

      call table%bind(course%frequency, name_t('frequency_ratio', 'circular frequency over omega1', positive_range, &
         harmonic, sweep=sweep_t(first + 1, is_in_cases=.true., may_change_in_motion=.true.)), in_units_t('frequency', &
         'frequency', 'cycles per unit of time'))
      degrees = course%phase/degree
      given_degrees = degrees
      call table%bind(degrees, name_t('phase', 'phase of the sine at tau = 0, degrees, also with a later start', &
         range_t(-360.0_wp, 360.0_wp), harmonic, sweep=sweep_t(first + 2, is_in_cases=.true.)))
      ! an unchanged phase is not converted back, because rounding would change its last digit
      if (abs(degrees - given_degrees) > 0.0_wp) course%phase = degrees*degree
      call table%bind(course%start, name_t('start', 'instant at which it begins, tau; there a table has time 0', &
         instant_range, sweep=sweep_t(first + 3, is_in_cases=.true.)), &
         in_units_t('start_time', 'time', 'the same in time'))
      call table%bind(course%end, name_t('end', 'instant at which it ends, tau', duration_range, lasting, &
         default='that of the run', is_optional=.true., sweep=sweep_t(first + 4, is_in_cases=.true.)), &
         in_units_t('end_time', 'time', 'the same in time'))
      call table%bind(course%duration, name_t('duration', 'length of the pulse, tau', &
         range_t(1.0e-12_wp, duration_range%maximum), pulse, sweep=sweep_t(first + 5, is_in_cases=.true.)), &
         in_units_t('duration_time', 'time', 'length of the pulse, time'))
      call table%bind(course%shape, name_t('shape', 'shape of the pulse', needs=pulse), pulse_names)
      call table%bind(course%time, name_t('times', 'instants of the table, ascending, tau; with amplitude in time', &
         signed_range, tabulated, default='those of the file', is_optional=.true.))
      call table%bind(course%value, name_t('values', 'values at these instants, linear between, 0 before and after; ' &
         //'of a displacement of the base a cubic spline, constant before and after', signed_range, tabulated, &
         default='those of the file', is_optional=.true.))
      call table%store(name_t('table', 'text file beside the scene: a column of times and a column of ' &
         //'values, in any layout that data of &fit may have; # and ! begin comments', &
         range_t(1, 1000), tabulated, instead_of='times'), kind_text)
   end subroutine list_course

   !> List the names of all &base groups in the table, and bind them to the components of the scene.
   subroutine list_bases(table, scene)
      class(table_t), intent(inout) :: table
      !> The scene; the motions of its base are bound
      type(scene_t), intent(inout) :: scene

      ! number of the first parameter of this group in sweeps; `list_course` uses the next five
      integer, parameter :: first_parameter = 40
      integer :: k

      if (.not. allocated(scene%bases)) allocate (scene%bases(table%groups_to_list('base', 0)))
      do k = 1, size(scene%bases)
         call table%open_numbered('base', k, scene%has_bases)
         if (.not. table%lists_names) cycle
         associate (base => scene%bases(k))
            call table%bind(base%gravity_ratio, name_t('gravity_ratio', 'gravity, which pulls down, over D omega1^2, ' &
               //'D the unit of displacement', range_t(0.0_wp, 1.0e12_wp), &
               sweep=sweep_t(first_parameter + 6, is_in_cases=.true., may_change_in_motion=.true.)), &
               in_units_t('gravity', 'acceleration', 'gravity, length over time squared'))
            call table%bind(base%quantity, name_t('quantity', 'given motion of clamp, stops and supports, besides ' &
               //'gravity; a displacement is harmonic from tau = 0 on, or a table, and has no end of its own'), &
               base_names)
            call table%bind(base%course%kind, name_t('kind', 'course in time'), course_names)
            call table%bind(base%course%amplitude, name_t('amplitude_ratio', 'acceleration up over D omega1^2, or ' &
               //'displacement over D, D the unit of displacement; factor of a table', load_range, &
               default='none: give one, or gravity', &
               sweep=sweep_t(first_parameter, is_in_cases=.true., may_change_in_motion=.true.)), &
               in_units_t('amplitude', 'acceleration', 'acceleration or displacement up; factor of a table in units', &
               signed_range))
            call list_course(table, base%course, first_parameter)
         end associate
      end do
      if (.not. scene%has_bases) deallocate (scene%bases)
   end subroutine list_bases

   !> Check loads and start, and read tables of loads. Problems are reported to `input`.
   subroutine resolve_loads(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      !> Table of names with the values of the file
      type(table_t), intent(in) :: table
      !> On entry ratios are resolved; on return with the tables of loads
      type(scene_t), intent(inout) :: scene

      integer :: k

      if (scene%has_stop .and. scene%stop%law == law_restitution .and. scene%stop%impulse == impulse_nodal .and. &
         (scene%has_forces .or. scene%has_bases .or. scene%start%kind /= start_release .or. scene%zeta_mass > 0.0_wp &
         .or. allocated(scene%mode_ratios) .or. scene%wants_stress .or. scene%wants_statistics)) then
         call input%complain('stop', 'impulse', 'goes with a beam that is pulled away and left alone, damped in ' &
            //"proportion to its stiffness, without &stress and &statistics; else take 'momentum'")
      end if
      if (scene%has_forces) then
         do k = 1, size(scene%forces)
            call check_force(input, table, k, scene%forces(k))
            if (.not. input%has_problem()) call resolve_course(input, table, 'force', k, scene%scales%omega1, &
               scene%unit_system, scene%file, scene%forces(k)%course)
            if (input%has_problem()) return
         end do
      end if
      if (scene%has_bases) then
         do k = 1, size(scene%bases)
            call check_base(input, table, k, scene%bases(k)%base_settings_t)
            if (.not. input%has_problem()) call resolve_course(input, table, 'base', k, scene%scales%omega1, &
               scene%unit_system, scene%file, scene%bases(k)%course)
            if (input%has_problem()) return
         end do
      end if
      if (scene%has_start) call check_start(input, table, scene)
   end subroutine resolve_loads

   !> Check that a force has points or a stretch, and an amplitude.
   subroutine check_force(input, table, which, force)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> Number of the &force
      integer, intent(in) :: which
      type(force_settings_t), intent(in) :: force

      if (.not. allocated(force%position)) then
         if (.not. table%has_either('force', 'stretch', which)) then
            call input%complain('force', '', 'needs position, the points where it acts, or stretch, the ends of a ' &
               //'line load', which)
            return
         end if
         associate (ends => table%entries(table%find(table%find_group('force', which), 'stretch'))%list)
            if (size(ends) /= 2) then
               call input%complain('force', 'stretch stretch_length', 'takes two values, its ends', which)
            else if (.not. ends(2) > ends(1)) then
               call input%complain('force', 'stretch stretch_length', 'the first value must be less than the second', &
                  which)
            end if
         end associate
      end if
      if (.not. table%has_either('force', 'amplitude_ratio', which)) then
         call input%complain('force', '', 'needs amplitude_ratio or amplitude', which)
      end if
   end subroutine check_force

   !> Check a motion of the base.
   subroutine check_base(input, table, which, base)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> Number of the &base
      integer, intent(in) :: which
      type(base_settings_t), intent(in) :: base

      if (.not. table%has_either('base', 'amplitude_ratio', which)) then
         if (.not. table%has_either('base', 'gravity_ratio', which)) then
            call input%complain('base', '', 'needs amplitude_ratio or amplitude, or gravity_ratio or gravity', which)
         else if (table%has('base', 'kind', which)) then
            call input%complain('base', 'kind', 'needs amplitude_ratio or amplitude', which)
         end if
      end if
      if (base%quantity /= base_displacement) return
      if (base%course%kind /= course_harmonic .and. base%course%kind /= course_table) then
         call input%complain('base', 'kind', "must be 'harmonic' or 'table' of a displacement, which does not jump", &
            which)
      end if
      ! a harmonic displacement that begins later would have a jump of the velocity
      if (base%course%kind == course_harmonic .and. base%course%start > 0.0_wp) then
         call input%complain('base', 'start start_time', 'does not go with a harmonic displacement, which goes on ' &
            //'from tau = 0', which)
      end if
      if (base%course%end < huge(base%course%end)) then
         call input%complain('base', 'end end_time', 'does not go with a displacement, which would stop at once', which)
      end if
   end subroutine check_base

   !> Check the instants of a load, and read its table if it has one.
   subroutine resolve_course(input, table, group, which, omega1, unit_system, scene_file, course)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> Name of the group: 'force' or 'base'
      character(*), intent(in) :: group
      !> Number of the group
      integer, intent(in) :: which
      !> Reference circular frequency, rad per unit of time
      real(wp), intent(in) :: omega1
      !> Index in `system_names`; 0: not given
      integer, intent(in) :: unit_system
      character(*), intent(in) :: scene_file
      type(time_course_t), intent(inout) :: course

      if (course%end <= course%start) call input%complain(group, 'end end_time', &
         'it ends before it begins, at tau = '//to_text(course%start), which)
      if (course%kind /= course_table) return
      call fetch_table(input, table, group, which, unit_system, scene_file, course)
      if (input%has_problem()) return
      ! with amplitudes in units, the times of the table are in units too
      if (input%has(group, 'amplitude', which)) course%time(:) = course%time*omega1
      call check_table(input, group, which, course)
   end subroutine resolve_course

   !> Read the times and values of a table from its file, if the file is given.
   subroutine fetch_table(input, table, group, which, unit_system, scene_file, course)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> Name of the group: 'force' or 'base'
      character(*), intent(in) :: group
      !> Number of the group
      integer, intent(in) :: which
      !> Index in `system_names`; 0: not given
      integer, intent(in) :: unit_system
      character(*), intent(in) :: scene_file
      type(time_course_t), intent(inout) :: course

      type(signal_t) :: signal
      character(:), allocatable :: file, problem, time_unit

      if (.not. table%has(group, 'table', which)) then
         if (allocated(course%time) .and. .not. allocated(course%value)) then
            call input%complain(group, 'times', 'needs values, as many as times', which)
         else if (allocated(course%value) .and. .not. allocated(course%time)) then
            call input%complain(group, 'values', 'needs times, as many as values', which)
         else if (.not. allocated(course%value)) then
            call input%complain(group, 'times', 'needs table, a file of times and values, or times and values', which)
         end if
         return
      end if
      if (allocated(course%value)) then
         call input%complain(group, 'values', 'does not go with table, whose file has the values', which)
         return
      end if
      file = path_beside(scene_file, table%entries(table%find(table%find_group(group, which), 'table'))%text)
      call read_signal(file, [1, 2], signed_range, .true., signal, problem)
      if (.not. allocated(problem)) then
         time_unit = ''
         if (input%has(group, 'amplitude', which) .and. unit_system > 0 .and. unit_system /= system_none) then
            time_unit = 's'
         end if
         call convert_unit(signal%time_unit, time_unit, 'its times are in tau or without a unit; give &scene units ' &
            //'and amplitude', signal%time, problem)
         if (allocated(problem)) problem = file//': '//problem
      end if
      if (allocated(problem)) then
         call input%complain(group, 'table', problem, which)
         return
      end if
      call move_alloc(signal%time, course%time)
      call move_alloc(signal%value, course%value)
   end subroutine fetch_table

   !> Check that a table has at least two points, and that the times ascend by more than rounding errors of an instant
   !> of the run, because the second derivative of a spline between closer points overflows.
   subroutine check_table(input, group, which, course)
      type(scene_input_t), intent(inout) :: input
      !> Name of the group: 'force' or 'base'
      character(*), intent(in) :: group
      !> Number of the group
      integer, intent(in) :: which
      !> Time function with the times in tau, and the values as in the file
      type(time_course_t), intent(in) :: course

      real(wp), parameter :: rounding = 16.0_wp*epsilon(1.0_wp)
      integer :: k

      associate (time => course%time, value => course%value)
         if (size(time) /= size(value)) then
            call input%complain(group, 'values', 'needs as many values as times, '//to_text(size(time))//'; ' &
               //to_text(size(value))//' given', which)
         else if (size(time) < 2) then
            call input%complain(group, 'times table', 'needs two points at least', which)
         else if (max(maxval(abs(time)), maxval(abs(value))) > signed_range%maximum) then
            call input%complain(group, 'times table', 'has numbers that are not '//range_text(signed_range), which)
         else
            k = findloc(time(2:) - time(:size(time) - 1) > rounding*max(abs(time(2:)), abs(time(:size(time) - 1)), &
               1.0_wp), .false., dim=1)
            if (k > 0) call input%complain(group, 'times table', 'times must be ascending; number '//to_text(k + 1) &
               //' is not beyond number '//to_text(k), which)
         end if
      end associate
   end subroutine check_table

end module scene_loads
