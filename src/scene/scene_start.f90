!> &start: the names of the group, the default start of a motion, and checks of the start.
module scene_start
   use kinds, only: wp
   use load_settings, only: field_names, start_drop, start_mode, start_names, start_release, start_rest, start_table, &
      start_velocity
   use name_table, only: table_t
   use name_types, only: condition_t, in_units_t, name_t, sweep_t, load_range, point_range, positive_range, range_t, &
      signed_range
   use number_text, only: to_text
   use scene_input, only: scene_input_t
   use scene_types, only: scene_t, start_group_t
   implicit none (type, external)
   private
   public :: list_start, choose_start, check_start

   ! Conditions that several names have in common: kinds of start
   type(condition_t), parameter :: tabulated = condition_t(name='kind', words='table')
   type(condition_t), parameter :: moving = condition_t(name='kind', words='velocity mode drop')
   type(condition_t), parameter :: modal = condition_t(name='kind', words='mode')
   type(condition_t), parameter :: with_mode = condition_t(name='kind', words='velocity mode')
   type(condition_t), parameter :: fallen = condition_t(name='kind', words='drop')

contains

   !> List the names of &start in the table, and bind them to the components of the scene.
   subroutine list_start(table, start)
      class(table_t), intent(inout) :: table
      type(start_group_t), intent(inout) :: start

      call table%bind(start%kind, name_t('kind', 'pull: released from a stop; rest: undeformed; balance: ' &
         //'static equilibrium under loads and on stops it presses on; velocity, mode, table: as given; drop: the ' &
         //'base falls', default="'pull'; 'rest' without a stop"), &
         start_names)
      call table%bind(start%field, name_t('field', 'distribution of the velocity', &
         needs=condition_t(name='kind', words='velocity')), field_names)
      call table%bind(start%mode, name_t('mode', 'which mode of the free beam', range_t(1, 1000), with_mode, &
         sweep=sweep_t(53, is_in_cases=.true., name='start_mode')))
      call table%bind(start%velocity, name_t('velocity_ratio', 'velocity up, in a rotation or mode that of the tip, ' &
         //'after a drop that of the fall down, over D omega1', load_range, moving, &
         sweep=sweep_t(50, is_in_cases=.true., name='start_velocity_ratio')), in_units_t('velocity', 'velocity', &
         'the same, length over time', signed_range, swept_as='start_velocity'))
      call table%bind(start%displacement, name_t('displacement_ratio', 'displacement of the tip up over D', &
         load_range, modal, sweep=sweep_t(51, is_in_cases=.true., name='start_displacement_ratio')), &
         in_units_t('displacement', 'displacement', 'the same, length', signed_range, swept_as='start_displacement'))
      call table%bind(start%height_ratio, name_t('height_ratio', 'height of the fall over D', positive_range, fallen, &
         default='none: velocity as given', is_optional=.true., &
         sweep=sweep_t(52, is_in_cases=.true., name='start_height_ratio')), &
         in_units_t('height', 'displacement', 'height of the fall, length', swept_as='start_height'))
      call table%bind(start%position, name_t('position', 'points of the table over length, ascending', point_range, &
         tabulated, is_optional=.true.))
      call table%bind(start%displacements, name_t('displacement_ratios', &
         'displacements there over D, a spline between', load_range, tabulated, default='0', is_optional=.true.), &
         in_units_t('displacements', 'displacement', 'the same, length', signed_range))
      call table%bind(start%velocities, name_t('velocity_ratios', 'velocities there over D omega1, a spline between', &
         load_range, tabulated, default='0', is_optional=.true.), &
         in_units_t('velocities', 'velocity', 'the same, length over time', signed_range))
   end subroutine list_start

   !> Choose the kind of start if the file does not give it (release from a stop, or rest without a stop), and check
   !> that it is compatible with the stops.
   subroutine choose_start(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      !> Table of names with the values of the file
      type(table_t), intent(in) :: table
      !> On return with the kind of start
      type(scene_t), intent(inout) :: scene

      integer :: k

      if (.not. scene%has_stop) then
         if (.not. input%has('start', 'kind')) then
            scene%start%kind = start_rest
         else if (scene%start%kind == start_release) then
            call input%complain('start', 'kind', 'needs &stop, from which the beam is pulled away')
         end if
      else if (scene%start%kind /= start_release) then
         do k = 1, count(table%groups(:table%group_count)%name == 'stop')
            if (.not. (input%has('stop', 'initial_height', k) .or. input%has('stop', 'pulled', k))) cycle
            call input%complain('stop', 'initial_height pulled', "only goes with &start kind = 'pull'", k)
         end do
      end if
   end subroutine choose_start

   !> Check the initial conditions that &start gives.
   subroutine check_start(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      !> Table of names with the values of the file
      type(table_t), intent(in) :: table
      type(scene_t), intent(in) :: scene

      select case (scene%start%kind)
      case (start_velocity)
         if (.not. table%has_either('start', 'velocity_ratio')) call input%complain('start', 'kind', &
            'needs velocity_ratio or velocity')
      case (start_mode)
         if (.not. (table%has_either('start', 'velocity_ratio') .or. &
            table%has_either('start', 'displacement_ratio'))) call input%complain('start', 'kind', &
            'needs displacement_ratio or displacement, or velocity_ratio or velocity')
      case (start_drop)
         call check_drop(input, table, scene)
      case (start_table)
         call check_start_table(input, scene%start)
      end select
   end subroutine check_start

   !> Check that a fall has a height and gravity, or a velocity at its end.
   subroutine check_drop(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      type(scene_t), intent(in) :: scene

      if (table%has_either('start', 'height_ratio')) then
         if (table%has_either('start', 'velocity_ratio')) call input%complain('start', 'height_ratio height', &
            'does not go with a velocity: one of them follows from the other')
         if (.not. scene%has_bases) then
            call input%complain('start', 'height_ratio height', 'needs &base gravity_ratio or gravity')
         else if (all(scene%bases%gravity_ratio <= 0.0_wp)) then
            call input%complain('start', 'height_ratio height', 'needs &base gravity_ratio or gravity')
         end if
      else if (.not. table%has_either('start', 'velocity_ratio')) then
         call input%complain('start', 'kind', 'needs height_ratio or height, or velocity_ratio or velocity')
      else if (scene%start%velocity <= 0.0_wp) then
         call input%complain('start', 'velocity_ratio velocity', 'must be above 0 at the end of a fall')
      end if
   end subroutine check_drop

   !> Check the table of initial displacements and velocities.
   subroutine check_start_table(input, start)
      type(scene_input_t), intent(inout) :: input
      type(start_group_t), intent(in) :: start

      ! of points over length, as of stations of a section
      real(wp), parameter :: min_distance = 1.0e-9_wp

      if (.not. allocated(start%position)) then
         call input%complain('start', 'kind', 'needs position, the points of the table')
         return
      end if
      associate (x => start%position)
         if (size(x) < 2) then
            call input%complain('start', 'position', 'needs two points at least')
         else if (any(x(2:) <= x(:size(x) - 1))) then
            call input%complain('start', 'position', 'must be ascending')
         else if (any(x(2:) - x(:size(x) - 1) <= min_distance)) then
            call input%complain('start', 'position', 'must be more than '//to_text(min_distance)//' apart')
         end if
      end associate
      if (.not. (allocated(start%displacements) .or. allocated(start%velocities))) then
         call input%complain('start', 'kind', 'needs displacement_ratios or displacements, or velocity_ratios or ' &
            //'velocities')
      end if
      call check_column(input, 'displacement_ratios displacements', size(start%position), start%displacements)
      call check_column(input, 'velocity_ratios velocities', size(start%position), start%velocities)
   end subroutine check_start_table

   !> Check that a column of the table has as many values as points.
   subroutine check_column(input, names, points, column)
      type(scene_input_t), intent(inout) :: input
      !> Two names of one quantity, separated by a blank
      character(*), intent(in) :: names
      !> Number of points of the table
      integer, intent(in) :: points
      !> Values at these points; unallocated: not given
      real(wp), allocatable, intent(in) :: column(:)

      if (.not. allocated(column)) return
      if (size(column) /= points) call input%complain('start', names, 'needs as many values as position, ' &
         //to_text(points)//'; '//to_text(size(column))//' given')
   end subroutine check_column

end module scene_start
