!> &stop and &support: the names of the groups, the stop from which the beam is released, the unit of displacement D,
!> and checks for stops and supports that are not compatible. A file may have any number of each group. The `scene` has
!> a first stop and a list of further stops (`more_stops`).
module scene_stops
   use kinds, only: wp
   use load_settings, only: start_release
   use name_table, only: table_t
   use name_types, only: condition_t, group_t, in_units_t, kind_number, name_t, sweep_t, off_root_range, range_t, &
      range_text, stiffness_range
   use number_text, only: rounded, to_text
   use program_identity, only: in_motion_and_benchmark
   use run_settings, only: impulse_names, impulse_nodal, law_table, law_restitution, side_above, &
      side_below, side_both, side_names, stop_settings_t
   use scene_input, only: scene_input_t
   use scene_types, only: all_stops, scales_t, scene_t, support_motion_names
   use stop_pairs, only: are_at_one_point, conflict_of_stops, conflict_of_supports, conflict_with_support
   use unit_ratios, only: needs_displacement, entries_in_units
   implicit none (type, external)
   private
   public :: list_stops, list_law, list_supports, find_displacement, check_stops, check_supports

   ! Conditions that several names have in common: words of `side` with which they may be given
   type(condition_t), parameter :: one_side = condition_t(name='side', words='below above', &
      phrase="side = 'below' or 'above', else give clearance")
   type(condition_t), parameter :: both_sides = condition_t(name='side', words='both', &
      phrase="side = 'both', else give surface_height")

   ! Range of heights in the user's units
   type(range_t), parameter :: height_range = range_t(-1.0e12_wp, 1.0e12_wp)

   !> Names that determine the surface of a stop; messages name the first of them that the file gives.
   character(*), parameter :: names_of_place = 'position side preload surface_height clearance_ratio clearance'

contains

   !> List the names of all &stop groups in the table, and bind them to the components of the scene.
   !>
   !> At least one &stop is listed, so that its names are known, even if the file has none.
   subroutine list_stops(table, scene)
      class(table_t), intent(inout) :: table
      !> The scene; its stops are bound
      type(scene_t), intent(inout) :: scene

      integer :: number, k

      number = 1
      if (allocated(scene%more_stops)) number = 1 + size(scene%more_stops)
      number = table%groups_to_list('stop', number)
      if (number > 1 .and. .not. allocated(scene%more_stops)) allocate (scene%more_stops(number - 1))
      call table%open(group_t('stop', in_motion_and_benchmark, repeats=.true.), scene%has_stop)
      if (table%lists_names) call list_stop(table, 1, number, scene%stop, scene%release_stop)
      do k = 2, number
         call table%open(group_t('stop', in_motion_and_benchmark, repeats=.true., occurrence=k, &
            label='stop_'//to_text(k)))
         if (table%lists_names) call list_stop(table, k, number, scene%more_stops(k - 1), scene%release_stop)
      end do
   end subroutine list_stops

   !> List the names of one &stop in the table, and bind them to the components of the scene. The number that begins a
   !> `sweep_t` is the unique number of the parameter in sweeps. The mesh moves a stop near the tip to the tip if the
   !> element between them would be shorter than 1/100 of its neighbour.
   subroutine list_stop(table, which, number, stop, release_stop)
      class(table_t), intent(inout) :: table
      !> Number of this stop
      integer, intent(in) :: which
      !> Number of all stops
      integer, intent(in) :: number
      type(stop_settings_t), intent(inout) :: stop
      !> Number of the stop from which the beam is released; 0: not chosen
      integer, intent(inout) :: release_stop

      real(wp) :: clearance
      logical :: is_release_stop

      call table%bind(stop%position, name_t('position', 'position of the stop from the root, over length; at the ' &
         //'tip, if the element beyond would be shorter than 1/100 of its neighbour', off_root_range, sweep=sweep_t(5, &
         changes_beam=.true., is_in_cases=.true., meaning='position of the stop Lc over length')), &
         in_units_t('position_length', 'length', 'the same as a length from the root'))
      call table%bind(stop%side, name_t('side', 'below the beam, above it, or on both sides with a clearance'), &
         side_names)
      ! the file chooses this stop by `pulled = .true.`; with a single stop there is no choice
      is_release_stop = release_stop == which .and. number > 1
      call table%bind(is_release_stop, name_t('pulled', 'the beam is released from this stop', default='that with ' &
         //'initial_height, or the one nearest the tip', is_optional=.true.))
      if (is_release_stop) release_stop = which
      call table%bind(stop%preload, name_t('preload', 'height of the stop above the unstressed beam over its ' &
         //'distance from the beam at the release, delta = d/(y(0) - d); > 0: the beam presses on it at rest', &
         range_t(-1.0e6_wp, 1.0e6_wp), one_side, &
         sweep=sweep_t(9, is_in_cases=.true., meaning='delta = d / (y_c(0) - d)')))
      ! `preload` is minus the clearance of a stop on both sides; the subtraction avoids a negative zero
      clearance = 0.0_wp - stop%preload
      call table%bind(clearance, name_t('clearance_ratio', 'gap between the unstressed beam and the stop on each ' &
         //'side, over the unit of displacement', range_t(0.0_wp, 1.0e6_wp, excludes_minimum=.true.), &
         both_sides, default='none: give one', sweep=sweep_t(14, is_in_cases=.true.)))
      if (stop%side == side_both) stop%preload = -clearance
      call table%store(name_t('surface_height', &
         'height d of the stop above the unstressed beam, up, length; 0: it touches the beam', height_range, &
         one_side, instead_of='preload', quantity='displacement'), kind_number)
      call table%store(name_t('clearance', 'gap between the unstressed beam and the stop on each side, length', &
         range_t(0.0_wp, 1.0e12_wp, excludes_minimum=.true.), both_sides, instead_of='clearance_ratio', &
         quantity='displacement'), kind_number)
      call table%store(name_t('initial_height', 'height of the beam at its release above the unstressed beam, at ' &
         //'the stop from which it is released, length', height_range, instead_of='preload', &
         quantity='displacement', is_scale=.true.), kind_number)
      call table%bind(stop%law, name_t('law', 'rigid, with a coefficient of restitution; a spring beside a spring ' &
         //'and damper in series; or a spring beside a damper'), law_table%name)
      call list_law(table, stop, '', first=10, has_impulse=.true.)
   end subroutine list_stop

   !> List the names of a contact law in the table, and bind them to the components of a stop.
   subroutine list_law(table, stop, prefix, first, has_impulse)
      class(table_t), intent(inout) :: table
      type(stop_settings_t), intent(inout) :: stop
      !> Text before each name
      character(*), intent(in) :: prefix
      !> Number of the first of four parameters in sweeps
      integer, intent(in) :: first
      !> Whether the law has the name `impulse`, by which an impact can change the velocity of one node only
      logical, intent(in) :: has_impulse

      ! conditions that several names have in common: words of `law` with which they may be given
      type(condition_t) :: restitution, three_element, compliant

      restitution = condition_t(name=prefix//'law', words='restitution')
      three_element = condition_t(name=prefix//'law', words='three_element')
      compliant = condition_t(name=prefix//'law', words='three_element spring_damper')
      call table%bind(stop%restitution, name_t(prefix//'restitution', 'coefficient of restitution: velocity after ' &
         //'an impact over that before it', &
         range_t(0.0_wp, 1.0_wp), restitution, sweep=sweep_t(first, is_in_cases=.true., may_change_in_motion=.true.)))
      if (has_impulse) call table%bind(stop%impulse, name_t('impulse', &
         'what an impact acts on: the whole beam, or one velocity', needs=restitution), impulse_names)
      call table%bind(stop%stiffness_ratio, name_t(prefix//'stiffness_ratio', 'kappa = k / (3 E Ibar / L^3)', &
         stiffness_range, compliant, sweep=sweep_t(first + 1, is_in_cases=.true., may_change_in_motion=.true.)), &
         in_units_t(prefix//'stiffness', 'stiffness', 'spring k, force over indentation near the force that occurs; ' &
         //'of a sphere of radius R by Hertz (6 E*^2 R F)^(1/3)'))
      call table%bind(stop%branch_ratio, name_t(prefix//'branch_ratio', 'beta = spring of the Maxwell branch over k', &
         range_t(0.0_wp, 1.0e6_wp), three_element, &
         sweep=sweep_t(first + 2, is_in_cases=.true., may_change_in_motion=.true.)), in_units_t(prefix &
         //'branch_stiffness', 'stiffness', 'spring beta k, force over length', relative_to=prefix//'stiffness'))
      call table%bind(stop%damper_ratio, name_t(prefix//'damper_ratio', 'c* = c omega1 / (3 E Ibar / L^3), in the ' &
         //'branch or beside the spring; 0: none', range_t(0.0_wp, 1.0e9_wp), compliant, sweep=sweep_t(first + 3, &
         is_in_cases=.true., may_change_in_motion=.true., meaning='c* = c omega1 / (3 E Ibar / L^3)')), &
         in_units_t(prefix//'damper', 'damper', 'damper c, force over velocity; beside the spring, a mass m leaves ' &
         //'with a coefficient of restitution of about exp(-pi c/(2 (k m)^(1/2)))'))
   end subroutine list_law

   !> List the names of all &support groups in the table, and bind them to the components of the scene.
   subroutine list_supports(table, scene)
      class(table_t), intent(inout) :: table
      !> The scene; its supports are bound
      type(scene_t), intent(inout) :: scene

      integer :: k

      if (.not. allocated(scene%supports)) allocate (scene%supports(table%groups_to_list('support', 0)))
      do k = 1, size(scene%supports)
         call table%open_numbered('support', k, scene%has_supports)
         if (.not. table%lists_names) cycle
         associate (support => scene%supports(k))
            call table%bind(support%position, name_t('position', 'position of the support over length', &
               off_root_range, sweep=sweep_t(15, changes_beam=.true., is_in_cases=.true.)), &
               in_units_t('position_length', 'length', 'the same as a length from the root'))
            call table%bind(support%motion, name_t('motion', 'what the support holds at zero'), support_motion_names)
            call table%bind(support%stiffness_ratio, name_t('stiffness_ratio', 'k / (3 E Ibar / L^3) of its spring, ' &
               //'against rotation k / (3 E Ibar / L)', stiffness_range, default='none: rigid', is_optional=.true., &
               sweep=sweep_t(16, changes_beam=.true., is_in_cases=.true.)), &
               in_units_t('stiffness', 'stiffness', 'spring, force over length, or moment over angle'))
         end associate
      end do
      if (.not. scene%has_supports) deallocate (scene%supports)
   end subroutine list_supports

   !> Find the stop from which the beam is released and the unit of displacement D. For a beam that is released above a
   !> stop, D is y_c(0) - d, the initial distance of the beam from the surface of this stop: `initial_height` minus
   !> `surface_height`. Otherwise D is `displacement_scale` of the file; if a quantity in units requires D and the file
   !> does not give it, D is the maximum height or clearance of the stops that is given in units, or else the mean
   !> height of the cross-section of the beam. The heights of all stops are checked against D. Problems are reported to
   !> `input`.
   subroutine find_displacement(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      !> Table of names with the values of the file
      type(table_t), intent(in) :: table
      !> On entry with the scale of lengths; on return with the stop and with D, 0 if there is no unit of displacement
      type(scene_t), intent(inout) :: scene

      character(:), allocatable :: name
      ! whether D is needed, and follows from heights
      logical :: uses_heights
      integer :: k

      associate (unit => scene%scales%displacement)
         unit = table%number('scene', 'displacement_scale')
         uses_heights = scene%start%kind /= start_release .and. unit <= 0.0_wp
         if (uses_heights) uses_heights = any(needs_displacement(table%entries(entries_in_units(table))))
         if (uses_heights) then
            do k = 1, size(all_stops(scene))
               name = height_name(nint(table%number('stop', 'side', k)))
               if (table%has('stop', name, k)) unit = max(unit, abs(table%number('stop', name, k)))
            end do
            if (unit <= 0.0_wp) unit = scene%scales%height_ratio*scene%scales%length
         end if
      end associate
      if (.not. scene%has_stop) return
      call find_released(input, table, size(all_stops(scene)), scene%release_stop)
      if (.not. input%has_problem()) call check_heights(input, table, scene)
   end subroutine find_displacement

   !> Find the stop from which the beam is released: the stop with `initial_height` or with `pulled`.
   subroutine find_released(input, table, stops, released)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> Number of stops
      integer, intent(in) :: stops
      !> Number of the stop found; 0: no stop has either name
      integer, intent(out) :: released

      integer :: k

      released = 0
      do k = 1, stops
         if (.not. (table%has('stop', 'initial_height', k) .or. nint(table%number('stop', 'pulled', k)) == 1)) cycle
         if (released > 0) then
            call input%complain('stop', 'initial_height pulled', 'the beam is released from one stop, which is &stop ' &
               //'number '//to_text(released)//'; keep one of them', k)
            return
         end if
         released = k
      end do
   end subroutine find_released

   !> Find the unit of displacement from `initial_height`, if it is given, and check the heights of all stops against
   !> this unit.
   subroutine check_heights(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      !> Table of names with the values of the file
      type(table_t), intent(in) :: table
      !> On entry with the stops, and with D if it is known; on return with D
      type(scene_t), intent(inout) :: scene

      character(:), allocatable :: name
      real(wp) :: height
      logical :: has_height
      integer :: k, side

      associate (unit => scene%scales%displacement, preload_range => table%range_of('stop', 'preload'))
         has_height = .false.
         if (scene%release_stop > 0) has_height = table%has('stop', 'initial_height', scene%release_stop)
         if (has_height .and. unit > 0.0_wp) then
            call input%complain('stop', 'initial_height', 'does not go with &scene displacement_scale: both say what ' &
               //'the unit of displacement is', scene%release_stop)
         else if (has_height) then
            call find_displacement_unit(input, table, scene%release_stop, scene%scales)
         end if
         if (input%has_problem()) return
         do k = 1, size(all_stops(scene))
            side = nint(table%number('stop', 'side', k))
            name = height_name(side)
            if (.not. table%has('stop', name, k)) then
               if (side == side_both .and. .not. table%has('stop', 'clearance_ratio', k)) then
                  call input%complain('stop', 'side', 'needs clearance_ratio or clearance, the distance to each ' &
                     //'side; without any it is a support: use &support', k)
               end if
               cycle
            end if
            height = abs(table%number('stop', name, k))
            if (unit <= 0.0_wp) then
               call input%complain('stop', name, 'needs initial_height too'//trim(merge( &
                  ', here or at the stop from which the beam is released', &
                  '                                                     ', size(all_stops(scene)) > 1)) &
                  //trim(merge(", or &start kind = 'rest' for a beam at rest", repeat(' ', 44), &
                  side == side_both .or. input%has_group('force') .or. input%has_group('base'))) &
                  //trim(merge(' between them', repeat(' ', 13), side == side_both)), k)
            else if (height > scene%scales%length) then
               call input%complain('stop', name, "must be smaller in size than the beam's length, " &
                  //to_text(scene%scales%length), k)
            else if (height > preload_range%maximum*unit) then
               call input%complain('stop', name, 'must be at most '//to_text(preload_range%maximum) &
                  //' times the unit of displacement, '//rounded(unit)//', in size', k)
            end if
         end do
      end associate
   end subroutine check_heights

   !> Find the unit of displacement, the initial distance of the beam from the surface of the stop from which it is
   !> released; for a stop on both sides, from its lower surface.
   subroutine find_displacement_unit(input, table, released, scales)
      type(scene_input_t), intent(inout) :: input
      !> Table of names with the values of the file
      type(table_t), intent(in) :: table
      !> Number of the stop from which the beam is released
      integer, intent(in) :: released
      !> On entry with the scale of lengths; on return with that of displacements
      type(scales_t), intent(inout) :: scales

      ! minimum initial distance over the length of the beam; a smaller distance is not distinct from 0
      real(wp), parameter :: min_distance = 1.0e-15_wp
      character(*), parameter :: too_long = "must be smaller in size than the beam's length, "
      character(:), allocatable :: name
      real(wp) :: stop_height, start_height, initial_distance
      integer :: side

      side = nint(table%number('stop', 'side', released))
      name = height_name(side)
      if (.not. table%has('stop', name, released)) then
         call input%complain('stop', 'initial_height', 'needs '//name//' too', released)
         return
      end if
      stop_height = table%number('stop', name, released)
      start_height = table%number('stop', 'initial_height', released)
      initial_distance = start_height - stop_height
      if (side == side_above) initial_distance = stop_height - start_height
      if (side == side_both) initial_distance = start_height + stop_height
      associate (range => table%range_of('stop', 'preload'))
         if (abs(stop_height) > scales%length) then
            call input%complain('stop', name, too_long//to_text(scales%length), released)
         else if (abs(start_height) > scales%length) then
            call input%complain('stop', 'initial_height', too_long//to_text(scales%length), released)
         else if (side == side_both .and. abs(start_height) > stop_height) then
            call input%complain('stop', 'initial_height', 'must be between both sides, at most clearance = ' &
               //to_text(stop_height)//' in size', released)
         else if (initial_distance < min_distance*scales%length) then
            if (side == side_both) name = 'the lower side, -'//name
            call input%complain('stop', 'initial_height', 'must be ' &
               //trim(merge('below', 'above', side == side_above))//' '//name//' = ' &
               //to_text(merge(-stop_height, stop_height, side == side_both)), released)
         else if (abs(stop_height) > range%maximum*initial_distance) then
            call input%complain('stop', 'initial_height', 'is too near to '//name//': preload must be ' &
               //range_text(range), released)
         else
            scales%displacement = initial_distance
         end if
      end associate
   end subroutine find_displacement_unit

   !> The name in &stop that gives the height of the surface, or the distance to both surfaces.
   pure function height_name(side) result(name)
      !> One of the `side_` constants
      integer, intent(in) :: side
      character(:), allocatable :: name

      name = trim(merge('clearance     ', 'surface_height', side == side_both))
   end function height_name

   !> Check that stops at one point are compatible, and that a scene with requests that allow only one stop below the
   !> beam has no further stops.
   subroutine check_stops(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene

      type(stop_settings_t), allocatable :: stops(:)
      character(:), allocatable :: conflict
      integer :: i, k

      allocate (stops, source=all_stops(scene))
      do k = 1, size(stops)
         if (stops(k)%law == law_restitution .and. stops(k)%impulse == impulse_nodal .and. &
            (size(stops) > 1 .or. stops(k)%side /= side_below)) call input%complain('stop', 'impulse', &
            "goes with one stop below the beam and no other; else take 'momentum'", k)
         do i = 1, k - 1
            if (.not. are_at_one_point(stops(i)%position, stops(k)%position)) cycle
            conflict = conflict_of_stops(stops(i), stops(k))
            if (conflict == '') cycle
            call input%complain('stop', names_of_place, 'at the same point as &stop number '//to_text(i)//': ' &
               //conflict, k)
         end do
      end do
   end subroutine check_stops

   !> Check that each support is compatible with the stops and the preceding supports.
   subroutine check_supports(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene

      character(*), parameter :: names = 'position motion stiffness_ratio stiffness'
      type(stop_settings_t), allocatable :: stops(:)
      character(:), allocatable :: conflict
      integer :: i, k

      allocate (stops, source=all_stops(scene))
      do k = 1, size(scene%supports)
         associate (support => scene%supports(k))
            conflict = ''
            if (any(are_at_one_point(stops%position, support%position))) conflict = conflict_with_support(support)
            do i = 1, k - 1
               if (conflict /= '' .or. .not. are_at_one_point(scene%supports(i)%position, support%position)) cycle
               conflict = conflict_of_supports(scene%supports(i), support)
            end do
         end associate
         if (conflict /= '') call input%complain('support', names, conflict, k)
      end do
   end subroutine check_supports

end module scene_stops
