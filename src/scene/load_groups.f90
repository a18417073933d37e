!> The names of &force and &base, of which a file may have any number, and of &start.
module load_groups
   use kinds, only: wp
   use load_settings, only: base_names, course_names, field_names, force_settings_t, pulse_names, start_names, &
      time_course_t
   use name_table, only: table_t
   use name_types, only: condition_t, group_t, kind_text, name_t, sweep_t
   use number_text, only: to_text
   use scene_types, only: base_group_t, scene_t, start_group_t
   use value_rules, only: physical_range, range_t
   implicit none (type, external)
   private
   public :: list_forces, list_bases, list_start

   ! What more than one name needs
   type(condition_t), parameter :: harmonic = condition_t(name='kind', words='harmonic')
   type(condition_t), parameter :: pulse = condition_t(name='kind', words='pulse')
   type(condition_t), parameter :: lasting = condition_t(name='kind', words='harmonic step table')
   type(condition_t), parameter :: tabulated = condition_t(name='kind', words='table')
   type(condition_t), parameter :: moving = condition_t(name='kind', words='velocity mode drop')
   type(condition_t), parameter :: modal = condition_t(name='kind', words='mode')
   type(condition_t), parameter :: of_mode = condition_t(name='kind', words='velocity mode')
   type(condition_t), parameter :: fallen = condition_t(name='kind', words='drop')

   ! Ranges of more than one name
   type(range_t), parameter :: load_range = range_t(-1.0e12_wp, 1.0e12_wp)
   type(range_t), parameter :: positive_range = range_t(0.0_wp, 1.0e12_wp, excludes_least=.true.)
   type(range_t), parameter :: instant_range = range_t(0.0_wp, 1.0e9_wp)
   type(range_t), parameter :: duration_range = range_t(0.0_wp, 1.0e9_wp, excludes_least=.true.)
   type(range_t), parameter :: signed_range = range_t(-1.0e20_wp, 1.0e20_wp)
   type(range_t), parameter :: place_range = range_t(0.0_wp, 1.0_wp)

   real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp

contains

   !> Every &force.
   subroutine list_forces(table, scene)
      class(table_t), intent(inout) :: table
      !> Its forces
      type(scene_t), intent(inout) :: scene

      type(force_settings_t), allocatable :: forces(:)
      integer :: number, k

      number = 0
      if (allocated(scene%forces)) number = size(scene%forces)
      number = table%times('force', number)
      allocate (forces(number))
      if (allocated(scene%forces)) forces(:) = scene%forces
      do k = 1, number
         call open_numbered(table, 'force', k, scene%has_forces)
         if (table%is_open) call list_force(table, forces(k))
      end do
      if (scene%has_forces) call move_alloc(forces, scene%forces)
   end subroutine list_forces

   !> One of several groups, of which even the first is called by its number.
   subroutine open_numbered(table, group, which, is_wanted)
      class(table_t), intent(inout) :: table
      character(*), intent(in) :: group
      integer, intent(in) :: which
      !> The scene asks for one at least
      logical, intent(inout) :: is_wanted

      if (which == 1) then
         call table%open(group_t(group, repeats=.true., label=group//'_1'), is_wanted)
      else
         call table%open(group_t(group, repeats=.true., occurrence=which, label=group//'_'//to_text(which)))
      end if
   end subroutine open_numbered

   subroutine list_force(table, force)
      class(table_t), intent(inout) :: table
      type(force_settings_t), intent(inout) :: force

      integer, parameter :: first_parameter = 30
      real(wp), allocatable :: stretch(:)

      call table%bind(force%position, name_t('position', 'points over length, with the whole force at each', &
         place_range, condition_t(without='stretch', phrase='points, not with stretch'), &
         default='none: give position or stretch', is_optional=.true., &
         sweep=sweep_t(first_parameter + 6, is_in_cases=.true., meaning='point of the force over length')))
      allocate (stretch, source=force%stretch)
      call table%bind(stretch, name_t('stretch', 'ends of the stretch under a line load, over length', &
         place_range, condition_t(without='position', phrase='a line load, not with position'), &
         default='none: give position or stretch', is_optional=.true.))
      ! what has other than two ends is told by who checks it
      if (allocated(stretch)) force%stretch = [stretch(1), stretch(size(stretch))]
      call table%bind(force%course%kind, name_t('kind', 'how it goes on in time'), course_names)
      call table%bind(force%course%amplitude, name_t('amplitude_ratio', 'force up over 3 E Ibar D / L^3, a line load ' &
         //'over 3 E Ibar D / L^4, D the unit of displacement; factor of a table', load_range, &
         default='none: give one', sweep=sweep_t(first_parameter, is_in_cases=.true.)))
      call table%keep(name_t('amplitude', 'force up, a line load over length; factor of a table ' &
         //'in units', signed_range, instead_of='amplitude_ratio', quantity='load'))
      call list_course(table, force%course, first_parameter)
   end subroutine list_force

   !> What courses of all loads have besides kind and amplitude.
   subroutine list_course(table, course, first)
      class(table_t), intent(inout) :: table
      type(time_course_t), intent(inout) :: course
      !> Number of the first of its parameters
      integer, intent(in) :: first

      real(wp) :: degrees, before, last

      call table%bind(course%frequency, name_t('frequency_ratio', 'frequency over that of omega1', positive_range, &
         harmonic, sweep=sweep_t(first + 1, is_in_cases=.true.)))
      call table%keep(name_t('frequency', 'periods over time', &
         range_t(0.0_wp, 1.0e20_wp, excludes_least=.true.), harmonic, instead_of='frequency_ratio', &
         quantity='frequency'))
      degrees = course%phase/degree
      before = degrees
      call table%bind(degrees, name_t('phase', 'phase of the sine at tau = 0, degrees, also with a later start', &
         range_t(-360.0_wp, 360.0_wp), harmonic, sweep=sweep_t(first + 2, is_in_cases=.true.)))
      ! else a phase that nothing changes keeps its last digit
      if (abs(degrees - before) > 0.0_wp) course%phase = degrees*degree
      call table%bind(course%start, name_t('start', 'instant at which it sets in, tau; there a table has time 0', &
         instant_range, sweep=sweep_t(first + 3, is_in_cases=.true.)))
      call table%keep(name_t('start_time', 'the same in time', physical_range, &
         instead_of='start', quantity='time'))
      last = 0.0_wp
      if (course%end < huge(course%end)) last = course%end
      call table%bind(last, name_t('end', 'instant at which it ceases, tau', duration_range, lasting, &
         default='that of the run', is_optional=.true., sweep=sweep_t(first + 4, is_in_cases=.true.)))
      if (last > 0.0_wp) course%end = last
      call table%keep(name_t('end_time', 'the same in time', physical_range, lasting, &
         instead_of='end', quantity='time'))
      call table%bind(course%duration, name_t('duration', 'length of the pulse, tau', duration_range, pulse, &
         sweep=sweep_t(first + 5, is_in_cases=.true.)))
      call table%keep(name_t('duration_time', 'length of the pulse, time', &
         range_t(0.0_wp, 1.0e20_wp, excludes_least=.true.), pulse, instead_of='duration', &
         quantity='time'))
      call table%bind(course%shape, name_t('shape', 'shape of the pulse', needs=pulse), pulse_names)
      call table%bind(course%time, name_t('times', 'instants of the table, ascending, tau; with amplitude in time', &
         signed_range, tabulated, default='those of the file', is_optional=.true.))
      call table%bind(course%value, name_t('values', 'values at them, linear between; nothing before and after', &
         signed_range, tabulated, default='those of the file', is_optional=.true.))
      call table%keep(name_t('table', 'file with a time and a value in each line, sought beside the ' &
         //'scene file; # and ! begin comments', range_t(1, 1000), tabulated, instead_of='times'), kind_text)
   end subroutine list_course

   !> Every &base.
   subroutine list_bases(table, scene)
      class(table_t), intent(inout) :: table
      !> What moves its base
      type(scene_t), intent(inout) :: scene

      type(base_group_t), allocatable :: bases(:)
      integer :: number, k

      number = 0
      if (allocated(scene%bases)) number = size(scene%bases)
      number = table%times('base', number)
      allocate (bases(number))
      if (allocated(scene%bases)) bases(:) = scene%bases
      do k = 1, number
         call open_numbered(table, 'base', k, scene%has_bases)
         if (table%is_open) call list_base(table, bases(k))
      end do
      if (scene%has_bases) call move_alloc(bases, scene%bases)
   end subroutine list_bases

   subroutine list_base(table, base)
      class(table_t), intent(inout) :: table
      type(base_group_t), intent(inout) :: base

      integer, parameter :: first_parameter = 40

      call table%bind(base%gravity_ratio, name_t('gravity_ratio', 'gravity, which pulls down, over D omega1^2, D the ' &
         //'unit of displacement', range_t(0.0_wp, 1.0e12_wp), sweep=sweep_t(first_parameter + 6, is_in_cases=.true.)))
      call table%keep(name_t('gravity', 'gravity, length over time squared', physical_range, &
         instead_of='gravity_ratio', quantity='acceleration'))
      call table%bind(base%quantity, name_t('quantity', 'what of clamp, stops and supports goes on so, besides ' &
         //'gravity; a displacement is harmonic from tau = 0 on, or a table, and has no end of its own'), base_names)
      call table%bind(base%course%kind, name_t('kind', 'how it goes on in time'), course_names)
      call table%bind(base%course%amplitude, name_t('amplitude_ratio', 'acceleration up over D omega1^2, or ' &
         //'displacement over D, D the unit of displacement; factor of a table', load_range, &
         default='none: give one, or gravity', sweep=sweep_t(first_parameter, is_in_cases=.true.)))
      call table%keep(name_t('amplitude', 'acceleration or displacement up; factor of a ' &
         //'table in units', signed_range, instead_of='amplitude_ratio', quantity='acceleration'))
      call list_course(table, base%course, first_parameter)
   end subroutine list_base

   !> &start
   subroutine list_start(table, start)
      class(table_t), intent(inout) :: table
      type(start_group_t), intent(inout) :: start

      call table%bind(start%kind, name_t('kind', 'from rest pulled away from a stop, from rest, from rest under the ' &
         //'loads, moving, in a mode, as a table says, or dropped', default="'pull'; 'rest' without a stop"), &
         start_names)
      call table%bind(start%field, name_t('field', 'which velocities', &
         needs=condition_t(name='kind', words='velocity')), field_names)
      call table%bind(start%mode, name_t('mode', 'which mode of the free beam', range_t(1, 1000), of_mode, &
         sweep=sweep_t(53, is_in_cases=.true., name='start_mode')))
      call table%bind(start%velocity, name_t('velocity_ratio', 'velocity up, in a rotation or mode that of the tip, ' &
         //'after a drop that of the fall down, over D omega1', load_range, moving, &
         sweep=sweep_t(50, is_in_cases=.true., name='start_velocity_ratio')))
      call table%keep(name_t('velocity', 'the same, length over time', signed_range, moving, &
         instead_of='velocity_ratio', quantity='velocity', sweep=sweep_t(name='start_velocity')))
      call table%bind(start%displacement, name_t('displacement_ratio', 'displacement of the tip up over D', &
         load_range, modal, sweep=sweep_t(51, is_in_cases=.true., name='start_displacement_ratio')))
      call table%keep(name_t('displacement', 'the same, length', signed_range, modal, &
         instead_of='displacement_ratio', quantity='displacement', sweep=sweep_t(name='start_displacement')))
      call table%bind(start%height_ratio, name_t('height_ratio', 'height of the fall over D', positive_range, fallen, &
         default='none: velocity as given', is_optional=.true., &
         sweep=sweep_t(52, is_in_cases=.true., name='start_height_ratio')))
      call table%keep(name_t('height', 'height of the fall, length', physical_range, fallen, &
         instead_of='height_ratio', quantity='displacement', sweep=sweep_t(name='start_height')))
      call table%bind(start%position, name_t('position', 'points of the table over length, ascending', place_range, &
         tabulated, is_optional=.true.))
      call table%bind(start%displacements, name_t('displacement_ratios', &
         'displacements there over D, a spline between', load_range, tabulated, default='0', is_optional=.true.))
      call table%keep(name_t('displacements', 'the same, length', signed_range, tabulated, &
         instead_of='displacement_ratios', quantity='displacement'), is_list=.true.)
      call table%bind(start%velocities, name_t('velocity_ratios', 'velocities there over D omega1, a spline between', &
         load_range, tabulated, default='0', is_optional=.true.))
      call table%keep(name_t('velocities', 'the same, length over time', signed_range, tabulated, &
         instead_of='velocity_ratios', quantity='velocity'), is_list=.true.)
   end subroutine list_start

end module load_groups
