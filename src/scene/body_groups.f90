!> The names of &beam, &section, &root and &mass, the last of which a file may have any number.
module body_groups
   use body_settings, only: mass_settings_t, root_names
   use kinds, only: wp
   use name_table, only: table_t
   use name_types, only: condition_t, group_t, name_t, sweep_t
   use number_text, only: to_text
   use program_identity, only: in_motion_and_benchmark
   use scene_types, only: beam_settings_t, scene_t
   use section_shapes, only: profile_names, shape_names
   use value_rules, only: length_range, physical_range, place_range, range_t, stiffness_range
   implicit none (type, external)
   private
   public :: list_beam, list_section, list_root, list_masses

   ! What more than one name needs
   type(condition_t), parameter :: heights = condition_t(without='area inertia', &
      phrase='heights, not with area and inertia')
   type(condition_t), parameter :: linear_taper = condition_t(without='station height area inertia', &
      phrase='a linear taper, not with tables')
   type(condition_t), parameter :: sections = condition_t(phrase='area and inertia, and station where they vary')
   type(condition_t), parameter :: rectangle = condition_t(name='shape', words='rectangle')
   type(condition_t), parameter :: round = condition_t(name='shape', words='round')
   type(condition_t), parameter :: tube = condition_t(name='shape', words='tube')
   type(condition_t), parameter :: general = condition_t(name='shape', words='general')
   type(condition_t), parameter :: springs = condition_t(name='kind', words='clamped')

   ! In the user's units: wide, but products and quotients of a few of them stay far from overflow
   type(range_t), parameter :: height_range = range_t(0.0_wp, 1.0e12_wp)
   ! kilograms per cubic nanometre among them
   type(range_t), parameter :: material_range = range_t(1.0e-30_wp, 1.0e30_wp)
   type(range_t), parameter :: mass_range = range_t(0.0_wp, 1.0e6_wp)

contains

   subroutine list_beam(table, beam)
      class(table_t), intent(inout) :: table
      type(beam_settings_t), intent(inout) :: beam

      call table%open(group_t('beam', in_motion_and_benchmark))
      call table%bind(beam%length, name_t('length', 'length L', length_range))
      call table%bind(beam%width, name_t('width', 'width b', length_range, heights))
      call table%bind(beam%youngs_modulus, name_t('youngs_modulus', "Young's modulus E", material_range))
      call table%bind(beam%density, name_t('density', 'density rho', material_range))
      call table%bind(beam%height_root, name_t('height_root', 'height at the clamp', length_range, linear_taper, &
         default='0.075 length'))
      call table%bind(beam%height_tip, name_t('height_tip', 'height at the tip; 0: a full wedge', height_range, &
         linear_taper, default='height_root'))
      call table%bind(beam%taper, name_t('taper', 'alpha = (height_root - height_tip) / length', &
         range_t(-2.0_wp, 2.0_wp), linear_taper, instead_of='height_root', default='0', &
         sweep=sweep_t(3, is_of_beam=.true., is_in_cases=.true., &
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

   subroutine list_section(table, beam)
      class(table_t), intent(inout) :: table
      type(beam_settings_t), intent(inout) :: beam

      call table%open(group_t('section'), beam%has_section)
      if (.not. table%is_open) return
      associate (section => beam%section)
         call table%bind(section%shape, name_t('shape', 'what the section is'), shape_names)
         call table%bind(section%profile, name_t('profile', 'dimensions between stations: linear, the same from each ' &
            //'to the next, or a natural cubic spline'), profile_names)
         call table%bind(section%station, name_t('station', &
            'positions of the dimensions, ascending from 0, to length or, ' &
            //'of steps, where each begins', height_range, default='none: uniform', is_optional=.true.))
         call table%bind(section%width, name_t('width', 'width, one value or one a station', length_range, rectangle, &
            default='width of &beam', is_optional=.true.))
         call table%bind(section%height, name_t('height', 'height, one value or one a station', height_range, &
            rectangle, &
            default='none: give some', is_optional=.true.))
         call table%bind(section%diameter, name_t('diameter', 'diameter, one value or one a station', height_range, &
            round, &
            default='none: give some', is_optional=.true.))
         call table%bind(section%outer_diameter, name_t('outer_diameter', &
            'outer diameter, one value or one a station', &
            height_range, tube, default='none: give some', is_optional=.true.))
         call table%bind(section%wall, name_t('wall', 'thickness of the wall, one value or one a station', &
            height_range, &
            tube, default='none: give it or inner_diameter', is_optional=.true.))
         call table%bind(section%inner_diameter, name_t('inner_diameter', &
            'inner diameter, one value or one a station', &
            height_range, condition_t(name='shape', words='tube', without='wall'), default='that of wall', &
            is_optional=.true.))
         call table%bind(section%area, name_t('area', 'area, one value or one a station', range_t(0.0_wp, 1.0e24_wp), &
            general, default='none: give some', is_optional=.true.))
         call table%bind(section%inertia, name_t('inertia', 'second moment of area, one value or one a station', &
            range_t(0.0_wp, 1.0e48_wp), general, default='none: give some', is_optional=.true.))
         call table%bind(section%outer_fibre, name_t('outer_fibre', 'distance of the outer fibre from the axis, for ' &
            //'stresses', length_range, general, default='not known', is_optional=.true.))
      end associate
   end subroutine list_section

   subroutine list_root(table, scene)
      class(table_t), intent(inout) :: table
      !> Its root
      type(scene_t), intent(inout) :: scene

      call table%open(group_t('root'), scene%has_root)
      if (.not. table%is_open) return
      associate (root => scene%root)
         call table%bind(root%kind, name_t('kind', 'what holds the root: the clamp, or a pin about which it turns ' &
            //'freely'), root_names)
         call table%bind(root%rotation_stiffness_ratio, name_t('rotation_stiffness_ratio', &
            'k / (3 E Ibar / L) of a spring against rotation', stiffness_range, springs, &
            default='none: it does not turn', is_optional=.true., &
            sweep=sweep_t(20, is_of_beam=.true., is_in_cases=.true., name='root_rotation_stiffness_ratio')))
         call table%keep(name_t('rotation_stiffness', 'the same, moment over angle', &
            physical_range, springs, instead_of='rotation_stiffness_ratio', &
            quantity='rotational_stiffness', sweep=sweep_t(name='root_rotation_stiffness')))
         call table%bind(root%translation_stiffness_ratio, name_t('translation_stiffness_ratio', &
            'k / (3 E Ibar / L^3) of a spring against displacement', stiffness_range, springs, &
            default='none: it does not move', is_optional=.true., sweep=sweep_t(21, is_of_beam=.true., &
            is_in_cases=.true., name='root_translation_stiffness_ratio')))
         call table%keep(name_t('translation_stiffness', &
            'the same, force over length', physical_range, springs, instead_of='translation_stiffness_ratio', &
            quantity='stiffness', sweep=sweep_t(name='root_translation_stiffness')))
      end associate
   end subroutine list_root

   !> Every &mass.
   subroutine list_masses(table, scene)
      class(table_t), intent(inout) :: table
      !> Its masses
      type(scene_t), intent(inout) :: scene

      type(mass_settings_t), allocatable :: masses(:)
      integer :: number, k

      number = 0
      if (allocated(scene%masses)) number = size(scene%masses)
      number = table%times('mass', number)
      allocate (masses(number))
      if (allocated(scene%masses)) masses(:) = scene%masses
      do k = 1, number
         if (k == 1) then
            call table%open(group_t('mass', repeats=.true., label='mass_1'), scene%has_masses)
         else
            call table%open(group_t('mass', repeats=.true., occurrence=k, label='mass_'//to_text(k)))
         end if
         if (table%is_open) call list_mass(table, masses(k))
      end do
      if (scene%has_masses) call move_alloc(masses, scene%masses)
   end subroutine list_masses

   subroutine list_mass(table, mass)
      class(table_t), intent(inout) :: table
      type(mass_settings_t), intent(inout) :: mass

      call table%bind(mass%position, name_t('position', 'position of the mass over length', place_range, &
         sweep=sweep_t(17, is_of_beam=.true., is_in_cases=.true.)))
      call table%bind(mass%mass_ratio, name_t('mass_ratio', 'mass over that of the beam', mass_range, &
         sweep=sweep_t(18, is_of_beam=.true., is_in_cases=.true.)))
      call table%keep(name_t('mass', 'mass', physical_range, instead_of='mass_ratio', quantity='mass'))
      call table%bind(mass%rotary_inertia_ratio, name_t('rotary_inertia_ratio', &
         'J / (rho Abar L^3), its moment of inertia about the axis of bending', mass_range, &
         sweep=sweep_t(19, is_of_beam=.true., is_in_cases=.true.)))
      call table%keep(name_t('rotary_inertia', 'J, mass times length squared', &
         physical_range, instead_of='rotary_inertia_ratio', quantity='rotary_inertia'))
   end subroutine list_mass

end module body_groups
