!> &force, &base and &start checked and completed: tables read, what does not go together.
module scene_loads
   use kinds, only: wp
   use load_settings, only: base_displacement, base_settings_t, course_harmonic, course_table, force_settings_t, &
      start_drop, start_mode, start_pull, start_rest, start_table, start_velocity, time_course_t
   use load_table, only: read_load_table
   use name_table, only: table_t
   use number_text, only: to_text
   use run_settings, only: impulse_nodal, law_restitution
   use scene_input, only: scene_input_t
   use scene_types, only: scene_t, start_group_t
   use value_rules, only: range_t, range_text
   implicit none (type, external)
   private
   public :: choose_start, resolve_loads

   !> Times and values of tables.
   type(range_t), parameter :: table_range = range_t(-1.0e20_wp, 1.0e20_wp)

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

   !> Problems go into the input.
   subroutine resolve_loads(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      !> Its names, read
      type(table_t), intent(in) :: table
      !> Ratios in; tables of loads out
      type(scene_t), intent(inout) :: scene

      character(:), allocatable :: folder
      integer :: k

      if (scene%has_stop .and. scene%stop%law == law_restitution .and. scene%stop%impulse == impulse_nodal .and. &
         (scene%has_forces .or. scene%has_bases .or. scene%start%kind /= start_pull .or. scene%zeta_mass > 0.0_wp .or. &
         allocated(scene%mode_ratios) .or. scene%wants_stress .or. scene%wants_statistics)) then
         call input%complain('stop', 'impulse', 'goes with a beam that is pulled away and left alone, damped in ' &
            //"proportion to its stiffness, without &stress and &statistics; else take 'momentum'")
      end if
      folder = folder_of(scene%file)
      if (scene%has_forces) then
         do k = 1, size(scene%forces)
            call check_force(input, table, k, scene%forces(k))
            if (.not. input%has_problem()) call resolve_course(input, table, 'force', k, scene%scales%omega1, folder, &
               scene%forces(k)%course)
            if (input%has_problem()) return
         end do
      end if
      if (scene%has_bases) then
         do k = 1, size(scene%bases)
            call check_base(input, k, scene%bases(k)%base_settings_t)
            if (.not. input%has_problem()) call resolve_course(input, table, 'base', k, scene%scales%omega1, folder, &
               scene%bases(k)%course)
            if (input%has_problem()) return
         end do
      end if
      if (scene%has_start) call check_start(input, scene)
   end subroutine resolve_loads

   !> What stands before the name of a file, the last stroke included.
   pure function folder_of(file) result(folder)
      character(*), intent(in) :: file
      character(:), allocatable :: folder

      folder = file(:index(file, '/', back=.true.))
   end function folder_of

   !> Where a force acts, and how much of it.
   subroutine check_force(input, table, which, force)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> Which &force
      integer, intent(in) :: which
      type(force_settings_t), intent(in) :: force

      if (.not. allocated(force%position)) then
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
   end subroutine check_force

   !> A base that moves.
   subroutine check_base(input, which, base)
      type(scene_input_t), intent(inout) :: input
      !> Which &base
      integer, intent(in) :: which
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
      if (base%course%kind == course_harmonic .and. base%course%start > 0.0_wp) then
         call input%complain('base', 'start start_time', 'does not go with a harmonic displacement, which goes on ' &
            //'from tau = 0', which)
      end if
      if (base%course%end < huge(base%course%end)) then
         call input%complain('base', 'end end_time', 'does not go with a displacement, which would stop at once', which)
      end if
   end subroutine check_base

   !> Instants and table of a load.
   subroutine resolve_course(input, table, group, which, omega1, folder, course)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> &force or &base
      character(*), intent(in) :: group
      integer, intent(in) :: which
      !> Reference frequency, rad per unit of time
      real(wp), intent(in) :: omega1
      !> That of the scene's file, with a stroke at its end; empty: where the program was started
      character(*), intent(in) :: folder
      type(time_course_t), intent(inout) :: course

      if (course%end <= course%start) call input%complain(group, 'end end_time', &
         'it ceases before it sets in, at tau = '//to_text(course%start), which)
      if (course%kind /= course_table) return
      call fetch_table(input, table, group, which, folder, course)
      if (input%has_problem()) return
      if (input%has(group, 'amplitude', which)) course%time(:) = course%time*omega1
      call check_table(input, group, which, course)
   end subroutine resolve_course

   !> The times and values of a table from its file, if it has one.
   subroutine fetch_table(input, table, group, which, folder, course)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      character(*), intent(in) :: group
      integer, intent(in) :: which
      character(*), intent(in) :: folder
      type(time_course_t), intent(inout) :: course

      character(:), allocatable :: file, problem

      if (.not. table%has(group, 'table', which)) then
         if (.not. (allocated(course%time) .and. allocated(course%value))) call input%complain(group, &
            trim(merge('values', 'times ', allocated(course%value))), 'needs '//missing(course), which)
         return
      end if
      if (allocated(course%value)) then
         call input%complain(group, 'values', 'does not go with table, whose file has the values', which)
         return
      end if
      file = table%entries(table%find(table%find_group(group, which), 'table'))%text
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
   subroutine check_start(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene

      select case (scene%start%kind)
      case (start_velocity)
         if (.not. has_velocity(input)) call input%complain('start', 'kind', 'needs velocity_ratio or velocity')
      case (start_mode)
         if (.not. (has_velocity(input) .or. input%has('start', 'displacement_ratio') .or. &
            input%has('start', 'displacement'))) call input%complain('start', 'kind', &
            'needs displacement_ratio or displacement, or velocity_ratio or velocity')
      case (start_drop)
         call check_drop(input, scene)
      case (start_table)
         call check_start_table(input, scene%start)
      end select
   end subroutine check_start

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
