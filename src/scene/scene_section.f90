!> &section: the names of the group, and the two dimensions of the section's shape (such as width and height) at the
!> stations.
module scene_section
   use cubic_splines, only: spline_curvature
   use kinds, only: wp
   use name_table, only: table_t
   use name_types, only: condition_t, group_t, name_t, length_range, range_t
   use number_text, only: to_text
   use scene_beam, only: check_column, check_stations, dimension_of_sweep
   use scene_input, only: scene_input_t
   use scene_types, only: beam_settings_t, shape_height_table, shape_section, shape_taper
   use section_shapes, only: profile_cubic, profile_linear, profile_names, profile_stepped, section_settings_t, &
      shape_general, shape_names, shape_rectangle, shape_round, shape_tube
   implicit none (type, external)
   private
   public :: list_section, resolve_section

   ! Conditions that several names have in common: the shape of the section
   type(condition_t), parameter :: rectangle = condition_t(name='shape', words='rectangle')
   type(condition_t), parameter :: round = condition_t(name='shape', words='round')
   type(condition_t), parameter :: tube = condition_t(name='shape', words='tube')
   type(condition_t), parameter :: general = condition_t(name='shape', words='general')

   ! Values in the user's units: wide ranges, but products and quotients of a few values do not overflow
   type(range_t), parameter :: height_range = range_t(0.0_wp, 1.0e12_wp)

   !> Names of &beam that describe the section, and that a file with &section does not give.
   character(*), parameter :: names_of_beam(9) = [character(17) :: 'width', 'height_root', 'height_tip', 'taper', &
      'mean_height_ratio', 'station', 'height', 'area', 'inertia']
   !> Names of the dimensions of each shape, separated by blanks.
   character(*), parameter :: dimension_names(4) = [character(34) :: 'height width', 'diameter', &
      'outer_diameter wall inner_diameter', 'area inertia']
   !> Minimum of a dimension; only at the tip a dimension may be 0.
   real(wp), parameter :: min_dimension = 1.0e-48_wp

contains

   !> List the names of &section in the table, and bind them to the components of the scene.
   subroutine list_section(table, beam)
      class(table_t), intent(inout) :: table
      type(beam_settings_t), intent(inout) :: beam

      call table%open(group_t('section'), beam%has_section)
      if (.not. table%lists_names) return
      associate (section => beam%section)
         call table%bind(section%shape, name_t('shape', 'what the section is'), shape_names)
         call table%bind(section%profile, name_t('profile', 'dimensions between stations: linear, the same from each ' &
            //'to the next, or a natural cubic spline'), profile_names)
         call table%bind(section%station, name_t('station', &
            'positions of the dimensions, ascending from 0, to length or, ' &
            //'of steps, where each begins', height_range, default='none: uniform', is_optional=.true.))
         call list_dimension(section%width, 61, 'width', 'width', length_range, rectangle, 'width of &beam')
         call list_dimension(section%height, 62, 'height', 'height', height_range, rectangle, 'none: give some')
         call list_dimension(section%diameter, 63, 'diameter', 'diameter', height_range, round, 'none: give some')
         call list_dimension(section%outer_diameter, 64, 'outer_diameter', 'outer diameter', height_range, tube, &
            'none: give some')
         call list_dimension(section%wall, 65, 'wall', 'thickness of the wall', height_range, &
            condition_t(name='shape', words='tube', without='inner_diameter', &
            phrase="shape = 'tube', not with inner_diameter"), 'none: give it or inner_diameter')
         call list_dimension(section%inner_diameter, 66, 'inner_diameter', 'inner diameter', height_range, &
            condition_t(name='shape', words='tube', without='wall', phrase="shape = 'tube', not with wall"), &
            'that of wall')
         call table%bind(section%area, name_t('area', 'area, one value or one a station', range_t(0.0_wp, 1.0e24_wp), &
            general, default='none: give some', is_optional=.true.))
         call table%bind(section%inertia, name_t('inertia', 'second moment of area, one value or one a station', &
            range_t(0.0_wp, 1.0e48_wp), general, default='none: give some', is_optional=.true.))
         call table%bind(section%outer_fibre, name_t('outer_fibre', 'distance of the outer fibre from the axis, for ' &
            //'stresses', length_range, general, default='not known', is_optional=.true.))
      end associate

   contains

      !> List a dimension that sweeps may vary; they give it one value for all stations.
      subroutine list_dimension(values, order, name, meaning, range, needs, default)
         real(wp), allocatable, intent(inout) :: values(:)
         !> Unique number of the parameter in sweeps
         integer, intent(in) :: order
         character(*), intent(in) :: name
         character(*), intent(in) :: meaning
         type(range_t), intent(in) :: range
         !> Shape that has the dimension
         type(condition_t), intent(in) :: needs
         !> Default value in words
         character(*), intent(in) :: default

         call table%bind(values, name_t(name, meaning//', one value or one a station', range, needs, &
            quantity='length', default=default, is_optional=.true., &
            sweep=dimension_of_sweep(order, 'section_'//name)))
      end subroutine list_dimension

   end subroutine list_section

   !> Check and complete a section. A rectangle that &beam could describe (constant width, linear profile) is treated as
   !> such a beam: a taper or a table of heights. Problems are reported to `input`.
   subroutine resolve_section(input, beam)
      type(scene_input_t), intent(inout) :: input
      !> On entry section as read; on return complete
      type(beam_settings_t), intent(inout) :: beam

      integer :: i, k

      do i = 1, size(names_of_beam)
         if (beam%section%shape == shape_rectangle .and. names_of_beam(i) == 'width') cycle
         if (input%has('beam', trim(names_of_beam(i)))) call input%complain('beam', trim(names_of_beam(i)), &
            'does not go with &section, which says all of the section')
      end do
      if (input%has_problem()) return
      associate (section => beam%section)
         if (section%shape == shape_rectangle .and. .not. allocated(section%width)) section%width = [beam%width]
         if (allocated(section%station) .and. section%profile == profile_stepped) then
            call check_steps(input, beam%length, section%station)
         else if (allocated(section%station)) then
            call check_stations(input, 'section', 'station', beam%length, section%station)
         end if
         if (input%has_problem()) return
         call check_dimensions(input, section)
         if (input%has_problem()) return
         call find_dimensions(input, section)
         if (input%has_problem()) return
         if (allocated(section%station)) then
            ! dimensions with one value get one value for each station
            section%first = spread_to(section%first, size(section%station))
            section%second = spread_to(section%second, size(section%station))
            if (allocated(section%outer_fibre)) section%outer_fibre = spread_to(section%outer_fibre, &
               size(section%station))
         end if
         if (section%profile == profile_cubic .and. allocated(section%station)) call check_spline(input, section)
         if (section%shape == shape_tube) then
            k = findloc(2.0_wp*section%second > section%first*(1.0_wp + epsilon(1.0_wp)), .true., dim=1)
            if (k > 0) call input%complain('section', 'wall inner_diameter', 'the wall must be at most half the ' &
               //'outer diameter, '//to_text(0.5_wp*section%first(k)))
         end if
         beam%shape = shape_section
         if (section%shape /= shape_rectangle .or. section%profile /= profile_linear) return
         if (maxval(section%first) > minval(section%first)) return
         beam%width = section%first(1)
         if (size(section%second) <= 2) then
            beam%shape = shape_taper
            beam%height_root = section%second(1)
            beam%height_tip = section%second(size(section%second))
         else
            beam%shape = shape_height_table
            beam%station = section%station
            beam%height = section%second
         end if
      end associate
   end subroutine resolve_section

   !> Find the two dimensions of the shape from the given dimensions.
   subroutine find_dimensions(input, section)
      type(scene_input_t), intent(inout) :: input
      type(section_settings_t), intent(inout) :: section

      select case (section%shape)
      case (shape_rectangle)
         call set_dimensions('height', section%width, section%height)
      case (shape_round)
         call set_dimensions('diameter', section%diameter, section%diameter)
      case (shape_tube)
         ! either diameter has one value for all stations, or one for each station
         if (allocated(section%inner_diameter) .and. allocated(section%outer_diameter)) then
            if (any(size(section%inner_diameter) == [1, size(section%outer_diameter)])) then
               section%wall = 0.5_wp*(section%outer_diameter - spread_to(section%inner_diameter, &
                  size(section%outer_diameter)))
            else
               section%wall = 0.5_wp*(spread_to(section%outer_diameter, size(section%inner_diameter)) &
                  - section%inner_diameter)
            end if
            if (any(section%wall <= 0.0_wp)) call input%complain('section', 'inner_diameter', &
               'must be below the outer diameter')
         end if
         call set_dimensions('outer_diameter and wall', section%outer_diameter, section%wall)
      case (shape_general)
         call set_dimensions('area and inertia', section%area, section%inertia)
      end select

   contains

      !> Assign the two dimensions, if both are given.
      subroutine set_dimensions(names, first, second)
         !> Names of the required dimensions, for the message
         character(*), intent(in) :: names
         real(wp), allocatable, intent(in) :: first(:)
         real(wp), allocatable, intent(in) :: second(:)

         if (allocated(first) .and. allocated(second)) then
            section%first = first
            section%second = second
         else
            call input%complain('section', 'shape', "shape = '"//trim(shape_names(section%shape))//"' needs "//names)
         end if
      end subroutine set_dimensions

   end subroutine find_dimensions

   !> Check that each given dimension has one value or as many values as stations, and that all are positive; at the tip
   !> of a linear profile a dimension may be 0.
   subroutine check_dimensions(input, section)
      type(scene_input_t), intent(inout) :: input
      type(section_settings_t), intent(in) :: section

      ! dimensions of other shapes are not given
      call check('width', section%width)
      call check('height', section%height)
      call check('diameter', section%diameter)
      call check('outer_diameter', section%outer_diameter)
      call check('wall', section%wall)
      call check('inner_diameter', section%inner_diameter, may_be_zero=.true.)
      call check('area', section%area)
      call check('inertia', section%inertia)
      call check('outer_fibre', section%outer_fibre)

   contains

      !> Check one dimension.
      subroutine check(name, values, may_be_zero)
         character(*), intent(in) :: name
         !> Unallocated: not given
         real(wp), allocatable, intent(in) :: values(:)
         !> Whether all values may be 0; absent: .false.
         logical, intent(in), optional :: may_be_zero

         real(wp) :: minimum
         logical :: is_table

         if (.not. allocated(values)) return
         minimum = min_dimension
         if (present(may_be_zero)) minimum = 0.0_wp
         is_table = allocated(section%station)
         if (size(values) == 1) then
            call check_column(input, 'section', name, 1, values, minimum, .false.)
         else if (is_table) then
            call check_column(input, 'section', name, size(section%station), values, minimum, &
               section%profile == profile_linear)
         else
            call input%complain('section', name, 'needs station where it has more than one value')
         end if
      end subroutine check

   end subroutine check_dimensions

   !> Values expanded from one value to a number of equal values.
   pure function spread_to(values, count) result(spread_values)
      real(wp), intent(in) :: values(:)
      integer, intent(in) :: count
      real(wp), allocatable :: spread_values(:)

      if (size(values) == 1) then
         allocate (spread_values(count), source=values(1))
      else
         allocate (spread_values, source=values)
      end if
   end function spread_to

   !> Check the stations of a stepped profile: the first is 0, they ascend, and the last is before the tip.
   subroutine check_steps(input, length, station)
      type(scene_input_t), intent(inout) :: input
      real(wp), intent(in) :: length
      real(wp), intent(in) :: station(:)

      ! minimum distance of two steps, and of the last step from the tip, over the length
      real(wp), parameter :: minimum = 1.0e-3_wp
      integer :: i

      if (station(1) > 0.0_wp) then
         call input%complain('section', 'station', 'the first must be 0')
         return
      end if
      do i = 2, size(station)
         if (station(i) - station(i - 1) >= minimum*length .and. station(i) <= (1.0_wp - minimum)*length) cycle
         call input%complain('section', 'station', 'each step must begin at least '//to_text(minimum) &
            //' of the length after the one before, and as much before the tip; '//to_text(station(i))//' does not')
         return
      end do
   end subroutine check_steps

   !> Check that the cubic splines of both dimensions, of the distance of the outer fibre and of the bore of a tube are
   !> positive between their stations, at `checked_points` - 1 points of each interval.
   subroutine check_spline(input, section)
      type(scene_input_t), intent(inout) :: input
      type(section_settings_t), intent(in) :: section

      integer, parameter :: checked_points = 64, of_fibre = 3, of_bore = 4
      ! values at the stations, and their second derivatives, [stations, 4]
      real(wp), dimension(size(section%station), 4) :: curvature, values
      character(:), allocatable :: names, problem
      ! position within an interval, from 0 to 1
      real(wp) :: fraction
      ! length of the interval
      real(wp) :: width
      integer :: i, j, k, m

      values = reshape([section%first, section%second, section%second, section%second], shape(values))
      if (allocated(section%outer_fibre)) values(:, of_fibre) = section%outer_fibre
      ! the wall of a solid tube is half the diameter to rounding
      if (section%shape == shape_tube) values(:, of_bore) = section%first*(1.0_wp + 4.0_wp*epsilon(1.0_wp)) &
         - 2.0_wp*section%second
      do j = 1, size(values, 2)
         curvature(:, j) = spline_curvature(section%station, values(:, j), [.false., .false.])
      end do
      do i = 1, size(section%station) - 1
         width = section%station(i + 1) - section%station(i)
         do k = 1, checked_points - 1
            fraction = real(k, wp)/real(checked_points, wp)
            j = findloc([(value_of(values(:, m), curvature(:, m)) > 0.0_wp, m=1, size(values, 2))], .false., dim=1)
            if (j == 0) cycle
            names = trim(dimension_names(section%shape))
            problem = "the spline of profile = 'cubic' falls to 0"
            if (j == of_fibre) names = 'outer_fibre'
            if (j == of_bore) problem = "the wall exceeds half the outer diameter, by the splines of profile = 'cubic',"
            call input%complain('section', names, problem//' between the stations '//to_text(section%station(i)) &
               //' and '//to_text(section%station(i + 1)))
            return
         end do
      end do

   contains

      !> Value of the spline at a fraction of interval i, from values and second derivatives at the ends of the
      !> interval.
      pure real(wp) function value_of(values, curvatures) result(value)
         !> Values of the dimension at the stations
         real(wp), intent(in) :: values(:)
         !> Second derivatives of the dimension at the stations
         real(wp), intent(in) :: curvatures(:)

         associate (left_weight => 1.0_wp - fraction, right_weight => fraction)
            value = left_weight*values(i) + right_weight*values(i + 1) + ((left_weight**3 - left_weight)*curvatures(i) &
               + (right_weight**3 - right_weight)*curvatures(i + 1))*width**2/6.0_wp
         end associate
      end function value_of

   end subroutine check_spline

end module scene_section
