!> &beam: the names of the group, heights from taper and mean height, checks of tables of values along the beam, and the
!> mean section; checks and resolution of &mesh.
module scene_beam
   use kinds, only: wp
   use name_table, only: table_t
   use name_types, only: condition_t, group_t, name_t, sweep_t, length_range, range_t
   use number_text, only: rounded, to_text
   use program_identity, only: in_motion_and_benchmark
   use run_settings, only: method_newmark
   use scene_input, only: scene_input_t
   use scene_types, only: beam_settings_t, shape_height_table, shape_section, shape_section_table, shape_taper, scene_t
   use section_shapes, only: area_of_shape, inertia_of_shape, mean_of_profile, mean_of_table
   use sweep_settings, only: is_swept
   implicit none (type, external)
   private
   public :: list_beam, resolve_beam, check_stations, check_column, mean_section, min_tip_ratio, dimension_of_sweep, &
      decide_mesh, resolve_mesh, resolve_nodes

   ! Conditions that several names have in common: how the section is given
   type(condition_t), parameter :: heights = condition_t(without='area inertia', &
      phrase='heights, not with area and inertia')
   type(condition_t), parameter :: linear_taper = condition_t(without='station height area inertia', &
      phrase='a linear taper, not with tables')
   type(condition_t), parameter :: sections = condition_t(phrase='area and inertia, and station if they vary')

   ! Range of heights in the user's units: wide, but products and quotients of a few values do not overflow
   type(range_t), parameter :: height_range = range_t(0.0_wp, 1.0e12_wp)
   ! wide enough for kilograms per cubic nanometre
   type(range_t), parameter :: material_range = range_t(1.0e-30_wp, 1.0e30_wp)

   !> Minimum ratio of the height at the tip to the height at the root if the height at the tip is not 0; with a smaller
   !> ratio, rounding makes the beam indistinguishable from a full wedge.
   real(wp), parameter :: min_tip_ratio = 1.0e-9_wp

contains

   !> Use of a dimension or a material property of the beam as a parameter of sweeps and cases.
   pure type(sweep_t) function dimension_of_sweep(order, name) result(sweep)
      !> Unique number of the parameter
      integer, intent(in) :: order
      !> Name in sweeps; absent: that in the group
      character(*), intent(in), optional :: name

      sweep = sweep_t(order, changes_beam=.true., changes_scales=.true., is_in_cases=.true.)
      if (present(name)) sweep%name = name
   end function dimension_of_sweep

   !> List the names of &beam in the table, and bind them to the components of the scene.
   subroutine list_beam(table, beam)
      class(table_t), intent(inout) :: table
      type(beam_settings_t), intent(inout) :: beam

      call table%open(group_t('beam', in_motion_and_benchmark))
      call table%bind(beam%length, name_t('length', 'length L', length_range, quantity='length', &
         sweep=dimension_of_sweep(22)))
      call table%bind(beam%width, name_t('width', 'width b', length_range, heights, quantity='length', &
         sweep=dimension_of_sweep(23)))
      call table%bind(beam%youngs_modulus, name_t('youngs_modulus', "Young's modulus E", material_range, &
         quantity='modulus', sweep=dimension_of_sweep(24)))
      call table%bind(beam%density, name_t('density', 'density rho', material_range, quantity='density', &
         sweep=dimension_of_sweep(25)))
      call table%bind(beam%height_root, name_t('height_root', 'height at the clamp', length_range, linear_taper, &
         default='0.075 length', quantity='length', sweep=dimension_of_sweep(26)))
      call table%bind(beam%height_tip, name_t('height_tip', 'height at the tip; 0: a full wedge', height_range, &
         linear_taper, default='height_root', quantity='length', sweep=dimension_of_sweep(27)))
      call table%bind(beam%taper, name_t('taper', 'alpha = (height_root - height_tip) / length', &
         range_t(-2.0_wp, 2.0_wp), linear_taper, instead_of='height_root', default='0', sweep=sweep_t(3, &
         changes_beam=.true., is_in_cases=.true., &
         meaning='alpha = (height_root - height_tip) / length, mean height kept')))
      call table%bind(beam%mean_height_ratio, name_t('mean_height_ratio', 'mean height over length', &
         range_t(1.0e-9_wp, 1.0_wp), linear_taper, instead_of='height_root', default='0.075'))
      call table%bind(beam%station, name_t('station', 'positions of the table, from 0 to length, ascending', &
         height_range, condition_t(phrase='height, or with area and inertia'), is_optional=.true.))
      call table%bind(beam%height, name_t('height', 'heights at the stations, linear between them', height_range, &
         condition_t(without='area inertia', phrase='station, not with area and inertia'), is_optional=.true.))
      call table%bind(beam%area, name_t('area', 'areas at the stations, linear between them', &
         range_t(0.0_wp, 1.0e24_wp), sections, is_optional=.true.))
      call table%bind(beam%inertia, name_t('inertia', 'second moments of area at the stations', &
         range_t(0.0_wp, 1.0e48_wp), sections, is_optional=.true.))
   end subroutine list_beam

   !> Complete the settings of the beam and check them. Problems are reported to `input`.
   subroutine resolve_beam(input, beam)
      type(scene_input_t), intent(inout) :: input
      !> On entry as read; on return complete
      type(beam_settings_t), intent(inout) :: beam

      real(wp), parameter :: min_height = 1.0e-12_wp
      real(wp), parameter :: min_area = 1.0e-24_wp
      real(wp), parameter :: min_inertia = 1.0e-48_wp

      if (beam%has_section) return
      beam%shape = shape_taper
      if (allocated(beam%height)) beam%shape = shape_height_table
      if (allocated(beam%area)) beam%shape = shape_section_table
      select case (beam%shape)
      case (shape_taper)
         call resolve_taper(input, beam)
      case (shape_height_table)
         call check_stations(input, 'beam', 'station', beam%length, beam%station)
         call check_column(input, 'beam', 'height', size(beam%station), beam%height, min_height, .true.)
      case (shape_section_table)
         if (.not. allocated(beam%station) .and. size(beam%area) == 1 .and. size(beam%inertia) == 1) then
            beam%station = [0.0_wp, beam%length]
            beam%area = spread(beam%area(1), 1, 2)
            beam%inertia = spread(beam%inertia(1), 1, 2)
         else if (.not. allocated(beam%station)) then
            call input%complain('beam', 'area', 'needs station where area or inertia has more than one value')
            return
         end if
         call check_stations(input, 'beam', 'station', beam%length, beam%station)
         call check_column(input, 'beam', 'area', size(beam%station), beam%area, min_area, .true.)
         call check_column(input, 'beam', 'inertia', size(beam%station), beam%inertia, min_inertia, .true.)
      end select
   end subroutine resolve_beam

   !> Find the heights at both ends from those given, or from taper and mean height.
   subroutine resolve_taper(input, beam)
      type(scene_input_t), intent(inout) :: input
      !> On return heights at both ends
      type(beam_settings_t), intent(inout) :: beam

      logical :: gives_root_height

      gives_root_height = input%has('beam', 'height_root')
      if (gives_root_height) then
         if (.not. input%has('beam', 'height_tip')) beam%height_tip = beam%height_root
      else
         if (abs(beam%taper) > 2.0_wp*beam%mean_height_ratio) then
            call input%complain('beam', 'taper', 'must be at most '//rounded(2.0_wp*beam%mean_height_ratio) &
               //' in size, twice mean_height_ratio (a full wedge)')
            return
         end if
         beam%height_root = beam%length*(beam%mean_height_ratio + 0.5_wp*beam%taper)
         beam%height_tip = beam%length*(beam%mean_height_ratio - 0.5_wp*beam%taper)
      end if
      if (beam%height_root < min_tip_ratio*beam%height_tip .or. beam%height_root <= 0.0_wp) then
         call input%complain('beam', trim(merge('height_root', 'taper      ', gives_root_height)), &
            'the height at the clamp must be at least '//to_text(min_tip_ratio)//' of that at the tip')
      else if (beam%height_tip > 0.0_wp .and. beam%height_tip < min_tip_ratio*beam%height_root) then
         call input%complain('beam', trim(merge('height_tip', 'taper     ', gives_root_height)), &
            'the height at the tip must be 0 or at least '//to_text(min_tip_ratio)//' of that at the clamp')
      end if
   end subroutine resolve_taper

   !> Check that stations ascend from 0 to the length of the beam; the last one is then set to exactly the length.
   subroutine check_stations(input, group, name, length, station)
      type(scene_input_t), intent(inout) :: input
      !> Group of the stations, for messages
      character(*), intent(in) :: group
      !> Name of the stations, for messages
      character(*), intent(in) :: name
      real(wp), intent(in) :: length
      !> Positions of the stations
      real(wp), intent(inout) :: station(:)

      real(wp), parameter :: tolerance = 1.0e-9_wp
      integer :: i, count

      count = size(station)
      if (count < 2) then
         call input%complain(group, name, 'needs at least two values, 0 and the length')
         return
      else if (station(1) > 0.0_wp) then
         call input%complain(group, name, 'the first must be 0')
         return
      else if (abs(station(count) - length) > tolerance*length) then
         call input%complain(group, name, 'the last, '//to_text(station(count))//', must be the length, ' &
            //to_text(length))
         return
      end if
      station(count) = length
      do i = 2, count
         if (station(i) - station(i - 1) > tolerance*length) cycle
         if (station(i) > station(i - 1)) then
            call input%complain(group, name, 'must be more than '//to_text(tolerance)//' of the length apart; ' &
               //to_text(station(i))//' follows '//to_text(station(i - 1)))
         else
            call input%complain(group, name, 'must be ascending; '//to_text(station(i))//' follows ' &
               //to_text(station(i - 1)))
         end if
         return
      end do
   end subroutine check_stations

   !> Check that there are as many values as stations, and that they are positive; the value at the tip may be 0 if
   !> `may_vanish`.
   subroutine check_column(input, group, name, stations, column, min_value, may_vanish)
      type(scene_input_t), intent(inout) :: input
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      !> Number of stations
      integer, intent(in) :: stations
      !> Values at the stations
      real(wp), intent(in) :: column(:)
      !> Minimum of values that are not 0
      real(wp), intent(in) :: min_value
      !> Whether the last value may be 0
      logical, intent(in) :: may_vanish

      character(:), allocatable :: place
      integer :: i

      if (size(column) /= stations) call input%complain(group, name, 'needs as many values as station, ' &
         //to_text(stations)//'; '//to_text(size(column))//' given')
      do i = 1, size(column)
         if (column(i) >= min_value .or. (may_vanish .and. i == size(column) .and. column(i) <= 0.0_wp)) cycle
         place = ''
         if (size(column) > 1) place = ' at every station'
         if (may_vanish) place = place//'; at the tip 0 is allowed'
         if (column(i) > 0.0_wp) then
            call input%complain(group, name, 'must be at least '//to_text(min_value)//place)
         else
            call input%complain(group, name, 'must be above 0'//place)
         end if
         return
      end do
   end subroutine check_column

   !> Area and second moment of area of the uniform beam of mean section: from the mean height, from the mean dimensions
   !> of the shape, or, if areas are given, mean area and mean second moment of area.
   pure subroutine mean_section(beam, area, inertia)
      !> Complete settings of the beam
      type(beam_settings_t), intent(in) :: beam
      !> Abar
      real(wp), intent(out) :: area
      !> Ibar
      real(wp), intent(out) :: inertia

      real(wp) :: first, height, second

      if (beam%shape == shape_section) then
         first = mean_of_profile(beam%section, beam%length, beam%section%first)
         second = mean_of_profile(beam%section, beam%length, beam%section%second)
         area = area_of_shape(beam%section%shape, first, second)
         inertia = inertia_of_shape(beam%section%shape, first, second)
         return
      end if
      if (beam%shape == shape_section_table) then
         area = mean_of_table(beam%station, beam%area)
         inertia = mean_of_table(beam%station, beam%inertia)
         return
      end if
      if (beam%shape == shape_taper) then
         height = 0.5_wp*(beam%height_root + beam%height_tip)
      else
         height = mean_of_table(beam%station, beam%height)
      end if
      area = beam%width*height
      inertia = beam%width*height**3/12.0_wp
   end subroutine mean_section

   !> Check the nodes of a mesh, if they are given.
   subroutine resolve_nodes(input, scene)
      type(scene_input_t), intent(inout) :: input
      !> On entry with the length of the beam; on return with the number of elements
      type(scene_t), intent(inout) :: scene

      call check_stations(input, 'mesh', 'nodes', scene%beam%length, scene%mesh%nodes)
      scene%mesh%elements = size(scene%mesh%nodes) - 1
      if (scene%wants_precision) call input%complain('mesh', 'nodes', &
         'does not go with &precision, which refines meshes')
      if (allocated(scene%frequencies%mesh_elements) .or. allocated(scene%frequencies%mesh_ratios)) then
         call input%complain('frequencies', 'mesh_elements mesh_ratios', &
            'does not go with nodes of &mesh, which say all of the mesh')
      end if
   end subroutine resolve_nodes

   !> Check the requests for a mesh within a tolerance and for error estimates.
   subroutine resolve_mesh(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(inout) :: scene

      if (scene%mesh%estimate .and. .not. scene%wants_response) then
         call input%complain('mesh', 'estimate', 'estimates errors of measures; add &response / (with &stop /)')
      end if
      if (scene%mesh%tolerance <= 0.0_wp) return
      if (.not. scene%wants_response) then
         call input%complain('mesh', 'tolerance', 'finds a mesh for a response; add &response / (with &stop /)')
      end if
   end subroutine resolve_mesh

   !> Decide whether the mesh is found before the runs, because the scene gives none, and whether a single run estimates
   !> its error.
   subroutine decide_mesh(input, scene)
      type(scene_input_t), intent(in) :: input
      type(scene_t), intent(inout) :: scene

      logical :: varies_mesh

      scene%mesh%estimates_if_cheap = scene%wants_response .and. .not. input%has('mesh', 'estimate')
      varies_mesh = scene%wants_precision
      if (allocated(scene%sweep%swept)) varies_mesh = varies_mesh .or. any(is_swept(scene%sweep%swept) .and. &
         scene%sweep%swept%parameter%group == 'mesh')
      scene%mesh%is_sought = scene%wants_response .and. .not. (varies_mesh .or. allocated(scene%mesh%nodes) .or. &
         scene%mesh%tolerance > 0.0_wp .or. input%has('mesh', 'elements') .or. input%has('mesh', 'ratio'))
      ! where the mesh limits the time step, the given step may be too long for another mesh
      associate (response => scene%response)
         if (response%method == method_newmark .and. .not. response%substep .and. &
            2.0_wp*response%newmark_beta < response%newmark_gamma) scene%mesh%is_sought = .false.
      end associate
   end subroutine decide_mesh

end module scene_beam
