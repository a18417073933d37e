!> &body: the names of the group, and its checks: a body has a mass, its values do not exclude each other, and two
!> bodies on one side of the beam are at different points. A file may have any number of &body groups. z is the
!> displacement of a body, positive upwards; at z = 0 its distance from the undeformed beam is the clearance.
module scene_bodies
   use kinds, only: wp
   use load_settings, only: start_balance
   use name_table, only: table_t
   use name_types, only: in_units_t, name_t, sweep_t, load_range, off_root_range, range_t, signed_range, stiffness_range
   use number_text, only: to_text
   use run_settings, only: impulse_nodal, law_table, law_restitution, side_both, side_names
   use scene_input, only: scene_input_t
   use scene_stops, only: list_law
   use scene_types, only: scene_t
   use stop_pairs, only: are_at_one_point
   use sweep_settings, only: is_swept, parameter_t
   implicit none (type, external)
   private
   public :: list_bodies, check_bodies

   !> Allowed values of the mass over the mass of the beam.
   type(range_t), parameter :: mass_range = range_t(1.0e-12_wp, 1.0e6_wp)
   !> Allowed values of distances over D.
   type(range_t), parameter :: distance_range = range_t(0.0_wp, 1.0e6_wp)
   !> Allowed values of distances in the unit of length of the scene.
   type(range_t), parameter :: length_range = range_t(0.0_wp, 1.0e12_wp)

contains

   !> List the names of all &body groups in the table, and bind them to the components of the scene. The number that
   !> begins a `sweep_t` is the unique number of the parameter in sweeps.
   subroutine list_bodies(table, scene)
      class(table_t), intent(inout) :: table
      !> The scene; its bodies are bound
      type(scene_t), intent(inout) :: scene

      integer :: k

      ! a scene without &body lists one, so that the names are known
      if (.not. allocated(scene%bodies)) allocate (scene%bodies(table%groups_to_list('body', 0)))
      do k = 1, size(scene%bodies)
         ! `open_numbered` also sets `has_bodies` from the file, or reads it when the scene is written
         call table%open_numbered('body', k, scene%has_bodies)
         if (.not. table%lists_names) cycle
         associate (body => scene%bodies(k))
            call table%bind(body%position, name_t('position', 'where it meets the beam, over length', off_root_range, &
               sweep=sweep_t(70, changes_beam=.true., is_in_cases=.true.)), &
               in_units_t('position_length', 'length', 'the same as a length from the root'))
            call table%bind(body%mass_ratio, name_t('mass_ratio', 'mass over that of the beam', mass_range, &
               default='none: give one', sweep=sweep_t(71, is_in_cases=.true.)), in_units_t('mass', 'mass', 'mass'))
            call table%bind(body%side, &
               name_t('side', 'where it is: below the beam, above it, or in a cavity of the beam'), side_names)
            call table%bind(body%clearance, name_t('clearance_ratio', 'distance of the undeformed beam from it at z ' &
               //'= 0, on each side, over D', distance_range, sweep=sweep_t(72, is_in_cases=.true.)), &
               in_units_t('clearance', 'displacement', 'the same, length', length_range))
            ! spring and damper between body and base, and the initial conditions
            call table%bind(body%spring_ratio, name_t('spring_ratio', &
               'k / (3 E Ibar / L^3) of its spring to the base', stiffness_range, default='none: it moves freely', &
               is_optional=.true., sweep=sweep_t(73, is_in_cases=.true.)), &
               in_units_t('spring', 'stiffness', 'the same, force over length'))
            call table%bind(body%damping_ratio, name_t('damping_ratio', 'c / (2 sqrt(k m)) of its damper to the base', &
               range_t(0.0_wp, 1.0e6_wp), sweep=sweep_t(74, is_in_cases=.true.)))
            call table%bind(body%base_damper_ratio, name_t('base_damper_ratio', 'c omega1 / (3 E Ibar / L^3) of its ' &
               //'damper to the base, with or without a spring', range_t(0.0_wp, 1.0e9_wp), &
               sweep=sweep_t(75, is_in_cases=.true.)), &
               in_units_t('base_damper', 'damper', 'the same, force over velocity'))
            call table%bind(body%rest, name_t('rest_ratio', 'z over D, up, at which its spring has no force', &
               load_range, sweep=sweep_t(76, is_in_cases=.true.)), &
               in_units_t('rest', 'displacement', 'the same, length', signed_range))
            call table%bind(body%start_velocity, name_t('start_velocity_ratio', &
               'its velocity up at the start, over D omega1', load_range, sweep=sweep_t(77, is_in_cases=.true.)), &
               in_units_t('start_velocity', 'velocity', 'the same, length over time', signed_range))
            call table%bind(body%start_gap, name_t('start_gap_ratio', 'its distance from the beam at the start, in a ' &
               //'cavity from the lower wall, over D', distance_range, &
               default='at rest_ratio; in a cavity the middle', is_optional=.true., &
               sweep=sweep_t(78, is_in_cases=.true.)), &
               in_units_t('start_gap', 'displacement', 'the same, length', length_range))
            call table%bind(body%contact%law, name_t('law', 'model of its contact with the beam'), law_table%name)
            call list_law(table, body%contact, '', first=81, has_impulse=.false.)
            ! floor and ceiling, which are fixed to the base
            call table%bind(body%floor, name_t('floor_ratio', 'depth of a fixed floor of its own below z = 0, over D', &
               distance_range, default='none', is_optional=.true., sweep=sweep_t(79, is_in_cases=.true.)), &
               in_units_t('floor', 'displacement', 'the same, length', length_range))
            call table%bind(body%ceiling, name_t('ceiling_ratio', &
               'height of a fixed ceiling of its own above z = 0, over D', distance_range, default='none', &
               is_optional=.true., sweep=sweep_t(80, is_in_cases=.true.)), &
               in_units_t('ceiling', 'displacement', 'the same, length', length_range))
            call table%bind(body%base_contact%law, name_t('floor_law', &
               'model of its contacts with floor and ceiling'), law_table%name)
            call list_law(table, body%base_contact, 'floor_', first=85, has_impulse=.false.)
         end associate
      end do
      if (.not. scene%has_bodies) deallocate (scene%bodies)
   end subroutine list_bodies

   !> Check each body, and that no two bodies can touch each other. Problems are reported to `input`.
   subroutine check_bodies(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      !> Table of names with the values of the file
      type(table_t), intent(in) :: table
      type(scene_t), intent(in) :: scene

      integer :: i, k

      if (.not. scene%has_bodies) return
      if (scene%has_stop .and. scene%stop%law == law_restitution .and. scene%stop%impulse == impulse_nodal) then
         call input%complain('stop', 'impulse', "does not go with &body; take 'momentum'")
      end if
      do k = 1, size(scene%bodies)
         associate (body => scene%bodies(k))
            call check_values(input, table, scene, k)
            do i = 1, k - 1
               associate (other => scene%bodies(i))
                  if (body%side /= other%side .and. body%side /= side_both .and. other%side /= side_both) cycle
                  if (.not. are_at_one_point(body%position, other%position)) cycle
               end associate
               call input%complain('body', 'position position_length side', 'is on the side of &body number ' &
                  //to_text(i)//' at the same point, where both would meet; bodies meet the beam and their floors, ' &
                  //'not each other', k)
            end do
         end associate
      end do
   end subroutine check_bodies

   !> Check the values of one body; a sweep or &cases may give missing values.
   subroutine check_values(input, table, scene, k)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      type(scene_t), intent(in) :: scene
      !> Number of the body
      integer, intent(in) :: k

      ! the body has a spring, or a sweep or &cases may give it one
      logical :: may_have_spring
      ! the scene has a sweep or &cases
      logical :: varies

      varies = scene%wants_sweep .or. scene%wants_cases
      associate (body => scene%bodies(k))
         may_have_spring = gives('spring_ratio') .or. varies
         if (.not. (gives('mass_ratio') .or. is_varied(scene, k, 'mass'))) call input%complain('body', '', &
            'needs mass_ratio or mass', k)
         if (body%side == side_both .and. body%clearance <= 0.0_wp .and. .not. varies) call input%complain('body', &
            'side', 'needs clearance_ratio or clearance, the distance to each wall of the cavity', k)
         if (gives('damping_ratio') .and. .not. may_have_spring) call input%complain('body', 'damping_ratio', &
            'needs spring_ratio or spring; without one give base_damper_ratio or base_damper', k)
         if (gives('damping_ratio') .and. gives('base_damper_ratio')) call input%complain('body', 'damping_ratio', &
            'does not go with base_damper_ratio or base_damper: each determines the other; give one of them', k)
         if (gives('rest_ratio') .and. .not. may_have_spring) call input%complain('body', 'rest_ratio rest', &
            'needs spring_ratio or spring, whose rest it is', k)
         if (gives('start_gap_ratio') .and. scene%start%kind == start_balance) call input%complain('body', &
            'start_gap_ratio start_gap', "does not go with &start kind = 'balance', which places the body", k)
         ! floor and ceiling are given (>= 0), both at z = 0
         if (max(body%floor, body%ceiling) <= 0.0_wp .and. min(body%floor, body%ceiling) >= 0.0_wp) then
            call input%complain('body', 'ceiling_ratio ceiling', 'leaves the body no room above its floor', k)
         end if
         if (body%side == side_both .and. body%start_gap > 2.0_wp*body%clearance .and. .not. varies) then
            call input%complain('body', 'start_gap_ratio start_gap', &
               'is wider than the cavity, twice clearance_ratio = '//to_text(body%clearance), k)
         end if
      end associate

   contains

      !> Whether the file gives this name, or a quantity in units instead of it.
      logical function gives(name)
         character(*), intent(in) :: name

         gives = table%has_either('body', name, k)
      end function gives
   end subroutine check_values

   !> Whether a sweep or &cases gives a name of a body, or a quantity in units instead of it.
   pure logical function is_varied(scene, k, name)
      type(scene_t), intent(in) :: scene
      !> Number of the body
      integer, intent(in) :: k
      !> Name without `_ratio`
      character(*), intent(in) :: name

      is_varied = .false.
      if (scene%wants_cases) is_varied = is_named(scene%cases%parameter, k, name)
      if (scene%wants_sweep) is_varied = is_varied .or. any(is_swept(scene%sweep%swept) .and. &
         is_named(scene%sweep%swept%parameter, k, name))
   end function is_varied

   !> Whether a parameter is a name of a body, or a quantity in units instead of it.
   elemental logical function is_named(parameter, k, name)
      type(parameter_t), intent(in) :: parameter
      !> Number of the body
      integer, intent(in) :: k
      !> Name without `_ratio`
      character(*), intent(in) :: name

      is_named = parameter%group == 'body' .and. parameter%occurrence == k .and. &
         (parameter%name_in_group == name .or. parameter%name_in_group == name//'_ratio')
   end function is_named

end module scene_bodies
