!> &force, &base and &start checked and completed: the unit of displacement, ratios of what is given in units, tables
!> read, what does not go together.
module scene_loads
   use kinds, only: wp
   use load_groups, only: physical_course_t, physical_start_t
   use load_settings, only: base_displacement, base_settings_t, course_harmonic, course_table, force_settings_t, &
      start_drop, start_mode, start_pull, start_rest, start_table, start_velocity, time_course_t
   use load_table, only: read_load_table
   use name_table, only: is_among, table_t
   use number_text, only: to_text
   use run_settings, only: impulse_nodal, law_restitution
   use scene_groups, only: physical_t
   use scene_input, only: scene_input_t
   use scene_types, only: scales_t, scene_t, start_group_t
   use unit_ratios, only: take_ratio
   use value_rules, only: range_t, range_text
   implicit none (type, external)
   private
   public :: choose_start, find_displacement_unit, resolve_loads

   !> Groups, and their names that only the unit of displacement makes ratios.
   character(*), parameter :: names_in_units(2, 5) = reshape([character(64) :: 'stop', 'surface_height clearance', &
      'force', 'amplitude', 'base', 'amplitude gravity', &
      'start', 'velocity displacement height displacements velocities', 'statistics', 'force_threshold'], [2, 5])

   !> Times and values of tables.
   type(range_t), parameter :: table_range = range_t(-1.0e20_wp, 1.0e20_wp)
   real(wp), parameter :: one_turn = 2.0_wp*acos(-1.0_wp)

contains

   !> How the motion begins where the file leaves that open, and what then cannot be.
   subroutine choose_start(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      !> Its names, read
      type(table_t), intent(in) :: table
      !> The kind of its start out
      type(scene_t), intent(inout) :: scene

      integer :: k

      if (.not. scene%has_stop) then
         if (.not. input%has('start', 'kind')) then
            scene%start%kind = start_rest
         else if (scene%start%kind == start_pull) then
            call input%complain('start', 'kind', 'needs &stop, from which the beam is pulled away')
         end if
      else if (scene%start%kind /= start_pull) then
         do k = 1, count(table%groups(:table%group_count)%name == 'stop')
            if (.not. (input%has('stop', 'initial_height', k) .or. input%has('stop', 'pulled', k))) cycle
            call input%complain('stop', 'initial_height pulled', "only goes with &start kind = 'pull'", k)
         end do
      end if
   end subroutine choose_start

   !> The unit of displacement of a beam that is not pulled away from a stop, where anything needs it: as given, or the
   !> greatest distance of a stop to the beam, or the mean height of the section.
   subroutine find_displacement_unit(input, table, physical, scene)
      type(scene_input_t), intent(in) :: input
      !> Its names, read
      type(table_t), intent(in) :: table
      !> What it gives in physical units
      type(physical_t), intent(in) :: physical
      !> Scales out
      type(scene_t), intent(inout) :: scene

      integer :: k

      associate (unit => scene%scales%displacement)
         unit = physical%displacement_scale
         if (scene%start%kind == start_pull .or. unit > 0.0_wp .or. first_in_units(table) == 0) return
         do k = 1, merge(size(physical%stops), 0, scene%has_stop)
            if (input%has('stop', 'surface_height', k)) unit = max(unit, abs(physical%stops(k)%surface_height))
            if (input%has('stop', 'clearance', k)) unit = max(unit, physical%stops(k)%clearance)
         end do
         if (unit <= 0.0_wp) unit = scene%scales%height_ratio*scene%scales%length
      end associate
   end subroutine find_displacement_unit

   !> Place of the first entry that the file gives and only the unit of displacement makes a ratio; 0: there is none.
   pure function first_in_units(table) result(place)
      type(table_t), intent(in) :: table
      integer :: place

      integer :: k

      do place = 1, table%entry_count
         associate (entry => table%entries(place))
            if (.not. entry%is_given) cycle
            k = findloc(names_in_units(1, :), table%groups(entry%group)%name, dim=1)
            if (k == 0) cycle
            if (is_among(entry%name%name, names_in_units(2, k))) return
         end associate
      end do
      place = 0
   end function first_in_units

   !> Problems go into the input.
   subroutine resolve_loads(input, table, physical, scene)
      type(scene_input_t), intent(inout) :: input
      !> Its names, read
      type(table_t), intent(in) :: table
      !> What it gives in physical units
      type(physical_t), intent(in) :: physical
      !> Scales in; loads and start out
      type(scene_t), intent(inout) :: scene

      character(:), allocatable :: folder
      integer :: k, lacking

      if (scene%has_stop .and. scene%stop%law == law_restitution .and. scene%stop%impulse == impulse_nodal .and. &
         (scene%has_forces .or. scene%has_bases .or. scene%start%kind /= start_pull .or. scene%zeta_mass > 0.0_wp .or. &
         allocated(scene%mode_ratios) .or. scene%wants_stress .or. scene%wants_statistics)) then
         call input%complain('stop', 'impulse', 'goes with a beam that is pulled away and left alone, damped in ' &
            //"proportion to its stiffness, without &stress and &statistics; else take 'momentum'")
      end if
      lacking = first_in_units(table)
      if (lacking > 0 .and. scene%scales%displacement <= 0.0_wp) then
         associate (group => table%groups(table%entries(lacking)%group))
            call input%complain(trim(group%name), trim(table%entries(lacking)%name%name), 'needs a length to go by: ' &
               //'give &stop surface_height and initial_height, or &scene displacement_scale', group%occurrence)
         end associate
         return
      end if
      folder = folder_of(scene%file)
      if (scene%has_forces) then
         do k = 1, size(scene%forces)
            call resolve_force(input, table, k, physical%forces(k), scene%scales, scene%forces(k))
            if (.not. input%has_problem()) call resolve_course(input, table, 'force', k, physical%forces(k), &
               scene%scales%omega1, folder, scene%forces(k)%course)
            if (input%has_problem()) return
         end do
      end if
      if (scene%has_bases) then
         do k = 1, size(scene%bases)
            call check_base(input, k, physical%bases(k)%course%start_time, scene%bases(k)%base_settings_t)
            associate (unit => merge(1.0_wp, scene%scales%omega1**2, scene%bases(k)%quantity == base_displacement))
               call take_ratio(input, table, 'base', 'amplitude', &
                  over(physical%bases(k)%course%amplitude, unit*scene%scales%displacement), &
                  scene%bases(k)%course%amplitude, k)
            end associate
            call take_ratio(input, table, 'base', 'gravity', over(physical%bases(k)%gravity, &
               scene%scales%omega1**2*scene%scales%displacement), scene%bases(k)%gravity_ratio, k)
            if (.not. input%has_problem()) call resolve_course(input, table, 'base', k, physical%bases(k)%course, &
               scene%scales%omega1, folder, scene%bases(k)%course)
            if (input%has_problem()) return
         end do
      end if
      if (scene%has_start) call resolve_start(input, table, physical%start, scene)
   end subroutine resolve_loads

   !> What stands before the name of a file, the last stroke included.
   pure function folder_of(file) result(folder)
      character(*), intent(in) :: file
      character(:), allocatable :: folder

      folder = file(:index(file, '/', back=.true.))
   end function folder_of

   !> A quantity in its unit; 0 where there is none.
   elemental function over(quantity, unit) result(ratio)
      real(wp), intent(in) :: quantity
      real(wp), intent(in) :: unit
      real(wp) :: ratio

      ratio = 0.0_wp
      if (unit > 0.0_wp) ratio = quantity/unit
   end function over

   !> Where a force acts, and how much of it.
   subroutine resolve_force(input, table, which, physical, scales, force)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> Which &force
      integer, intent(in) :: which
      type(physical_course_t), intent(in) :: physical
      type(scales_t), intent(in) :: scales
      type(force_settings_t), intent(inout) :: force

      real(wp) :: unit

      unit = 3.0_wp*scales%bending_stiffness*scales%displacement/scales%length**3
      if (.not. allocated(force%position)) then
         unit = unit/scales%length
         if (.not. input%has('force', 'stretch', which)) then
            call input%complain('force', '', 'needs position, the points where it acts, or stretch, the ends of a ' &
               //'line load', which)
            return
         end if
         associate (ends => table%entries(table%find(table%find_group('force', which), 'stretch'))%list)
            if (size(ends) /= 2) then
               call input%complain('force', 'stretch', 'takes two values, its ends', which)
            else if (.not. ends(2) > ends(1)) then
               call input%complain('force', 'stretch', 'the first value must be less than the second', which)
            end if
         end associate
      end if
      if (.not. (input%has('force', 'amplitude_ratio', which) .or. input%has('force', 'amplitude', which))) then
         call input%complain('force', '', 'needs amplitude_ratio or amplitude', which)
      end if
      call take_ratio(input, table, 'force', 'amplitude', over(physical%amplitude, unit), force%course%amplitude, which)
   end subroutine resolve_force

   !> A base that moves.
   subroutine check_base(input, which, start_time, base)
      type(scene_input_t), intent(inout) :: input
      !> Which &base
      integer, intent(in) :: which
      !> Instant at which it sets in, in time
      real(wp), intent(in) :: start_time
      type(base_settings_t), intent(in) :: base

      character(*), parameter :: amplitudes(2) = [character(15) :: 'amplitude_ratio', 'amplitude']
      character(*), parameter :: gravities(2) = [character(13) :: 'gravity_ratio', 'gravity']
      integer :: i

      if (.not. any([(input%has('base', trim(amplitudes(i)), which), i=1, 2)])) then
         if (.not. any([(input%has('base', trim(gravities(i)), which), i=1, 2)])) then
            call input%complain('base', '', 'needs amplitude_ratio or amplitude, or gravity_ratio or gravity', which)
         else if (input%has('base', 'kind', which)) then
            call input%complain('base', 'kind', 'needs amplitude_ratio or amplitude', which)
         end if
      end if
      if (base%quantity /= base_displacement) return
      if (base%course%kind /= course_harmonic .and. base%course%kind /= course_table) then
         call input%complain('base', 'kind', "must be 'harmonic' or 'table' of a displacement, which does not jump", &
            which)
      end if
      ! its velocity would jump
      if (base%course%kind == course_harmonic .and. max(base%course%start, start_time) > 0.0_wp) then
         call input%complain('base', 'start start_time', 'does not go with a harmonic displacement, which goes on ' &
            //'from tau = 0', which)
      end if
      if (base%course%end < huge(base%course%end) .or. input%has('base', 'end_time', which)) then
         call input%complain('base', 'end end_time', 'does not go with a displacement, which would stop at once', which)
      end if
   end subroutine check_base

   !> Times, frequency and table of a load whose amplitude is a ratio by now.
   subroutine resolve_course(input, table, group, which, physical, omega1, folder, course)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> &force or &base
      character(*), intent(in) :: group
      integer, intent(in) :: which
      type(physical_course_t), intent(in) :: physical
      !> Reference frequency, rad per unit of time
      real(wp), intent(in) :: omega1
      !> That of the scene's file, with a stroke at its end; empty: where the program was started
      character(*), intent(in) :: folder
      type(time_course_t), intent(inout) :: course

      call take_ratio(input, table, group, 'frequency', one_turn*physical%frequency/omega1, course%frequency, which)
      call take_ratio(input, table, group, 'start_time', physical%start_time*omega1, course%start, which)
      call take_ratio(input, table, group, 'end_time', physical%end_time*omega1, course%end, which)
      call take_ratio(input, table, group, 'duration_time', physical%duration_time*omega1, course%duration, which)
      if (input%has_problem()) return
      if (course%end <= course%start) call input%complain(group, 'end end_time', &
         'it ceases before it sets in, at tau = '//to_text(course%start), which)
      if (course%kind /= course_table) return
      call fetch_table(input, group, which, physical, folder, course)
      if (input%has_problem()) return
      if (input%has(group, 'amplitude', which)) course%time(:) = course%time*omega1
      call check_table(input, group, which, course)
   end subroutine resolve_course

   !> The times and values of a table from its file, if it has one.
   subroutine fetch_table(input, group, which, physical, folder, course)
      type(scene_input_t), intent(inout) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: which
      type(physical_course_t), intent(in) :: physical
      character(*), intent(in) :: folder
      type(time_course_t), intent(inout) :: course

      character(:), allocatable :: file, problem

      if (.not. allocated(physical%table)) then
         if (.not. (allocated(course%time) .and. allocated(course%value))) call input%complain(group, &
            trim(merge('values', 'times ', allocated(course%value))), 'needs '//missing(course), which)
         return
      end if
      if (allocated(course%value)) then
         call input%complain(group, 'values', 'does not go with table, whose file has the values', which)
         return
      end if
      file = physical%table
      if (file(1:1) /= '/') file = folder//file
      call read_load_table(file, course%time, course%value, problem)
      if (allocated(problem)) call input%complain(group, 'table', problem, which)
   end subroutine fetch_table

   !> What a table without a file lacks.
   pure function missing(course) result(names)
      type(time_course_t), intent(in) :: course
      character(:), allocatable :: names

      if (allocated(course%time)) then
         names = 'values, as many as times'
      else if (allocated(course%value)) then
         names = 'times, as many as values'
      else
         names = 'table, a file of times and values, or times and values'
      end if
   end function missing

   !> Two points or more, ascending as far as rounding can tell.
   subroutine check_table(input, group, which, course)
      type(scene_input_t), intent(inout) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: which
      !> tau, and values as the file has them
      type(time_course_t), intent(in) :: course

      real(wp), parameter :: rounding = 16.0_wp*epsilon(1.0_wp)
      integer :: k

      associate (time => course%time, value => course%value)
         if (size(time) /= size(value)) then
            call input%complain(group, 'values', 'needs as many values as times, '//to_text(size(time))//'; ' &
               //to_text(size(value))//' given', which)
         else if (size(time) < 2) then
            call input%complain(group, 'times table', 'needs two points at least', which)
         else if (max(maxval(abs(time)), maxval(abs(value))) > table_range%most) then
            call input%complain(group, 'times table', 'has numbers that are not '//range_text(table_range), which)
         else
            k = findloc(time(2:) - time(:size(time) - 1) > rounding*max(abs(time(2:)), abs(time(:size(time) - 1))), &
               .false., dim=1)
            if (k > 0) call input%complain(group, 'times table', 'times must be ascending; number '//to_text(k + 1) &
               //' is not beyond number '//to_text(k), which)
         end if
      end associate
   end subroutine check_table

   !> &start
   subroutine resolve_start(input, table, physical, scene)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> What it gives in physical units
      type(physical_start_t), intent(in) :: physical
      !> Scales in; its start out
      type(scene_t), intent(inout) :: scene

      associate (start => scene%start, length => scene%scales%displacement, omega1 => scene%scales%omega1)
         call take_ratio(input, table, 'start', 'velocity', over(physical%velocity, length*omega1), start%velocity)
         call take_ratio(input, table, 'start', 'displacement', over(physical%displacement, length), start%displacement)
         call take_ratio(input, table, 'start', 'height', over(physical%height, length), start%height_ratio)
         select case (start%kind)
         case (start_velocity)
            if (.not. has_velocity(input)) call input%complain('start', 'kind', 'needs velocity_ratio or velocity')
         case (start_mode)
            if (.not. (has_velocity(input) .or. input%has('start', 'displacement_ratio') .or. &
               input%has('start', 'displacement'))) call input%complain('start', 'kind', &
               'needs displacement_ratio or displacement, or velocity_ratio or velocity')
         case (start_drop)
            call check_drop(input, scene)
         case (start_table)
            if (allocated(physical%displacements)) start%displacements = physical%displacements/length
            if (allocated(physical%velocities)) start%velocities = physical%velocities/(length*omega1)
            call check_start_table(input, start)
         end select
      end associate
   end subroutine resolve_start

   !> Does &start give a velocity?
   pure function has_velocity(input) result(has)
      type(scene_input_t), intent(in) :: input
      logical :: has

      has = input%has('start', 'velocity_ratio') .or. input%has('start', 'velocity')
   end function has_velocity

   !> A fall has a height and gravity, or a velocity at its end.
   subroutine check_drop(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene

      if (input%has('start', 'height_ratio') .or. input%has('start', 'height')) then
         if (has_velocity(input)) call input%complain('start', 'height_ratio height', &
            'does not go with a velocity: one of them tells the other')
         if (.not. scene%has_bases) then
            call input%complain('start', 'height_ratio height', 'needs &base gravity_ratio or gravity')
         else if (all(scene%bases%gravity_ratio <= 0.0_wp)) then
            call input%complain('start', 'height_ratio height', 'needs &base gravity_ratio or gravity')
         end if
      else if (.not. has_velocity(input)) then
         call input%complain('start', 'kind', 'needs height_ratio or height, or velocity_ratio or velocity')
      else if (scene%start%velocity <= 0.0_wp) then
         call input%complain('start', 'velocity_ratio velocity', 'must be above 0 at the end of a fall')
      end if
   end subroutine check_drop

   !> Points along the beam, and what is there.
   subroutine check_start_table(input, start)
      type(scene_input_t), intent(inout) :: input
      type(start_group_t), intent(in) :: start

      if (.not. allocated(start%position)) then
         call input%complain('start', 'kind', 'needs position, the points of the table')
         return
      end if
      associate (x => start%position)
         if (size(x) < 2) then
            call input%complain('start', 'position', 'needs two points at least')
         else if (any(x(2:) <= x(:size(x) - 1))) then
            call input%complain('start', 'position', 'must be ascending')
         end if
      end associate
      if (.not. (allocated(start%displacements) .or. allocated(start%velocities))) then
         call input%complain('start', 'kind', 'needs displacement_ratios or displacements, or velocity_ratios or ' &
            //'velocities')
      end if
      call check_column(input, 'displacement_ratios displacements', size(start%position), start%displacements)
      call check_column(input, 'velocity_ratios velocities', size(start%position), start%velocities)
   end subroutine check_start_table

   !> As many values as points.
   subroutine check_column(input, names, points, column)
      type(scene_input_t), intent(inout) :: input
      !> Two names of one quantity
      character(*), intent(in) :: names
      integer, intent(in) :: points
      !> Unallocated: not given
      real(wp), allocatable, intent(in) :: column(:)

      if (.not. allocated(column)) return
      if (size(column) /= points) call input%complain('start', names, 'needs as many values as position, ' &
         //to_text(points)//'; '//to_text(size(column))//' given')
   end subroutine check_column

end module scene_loads
