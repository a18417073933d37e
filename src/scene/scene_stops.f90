!> &stop and &support checked and completed: from which stop the beam is released, ratios of what is given in units,
!> stops that contradict each other.
module scene_stops
   use kinds, only: wp
   use name_table, only: table_t
   use number_text, only: rounded, to_text
   use run_settings, only: impulse_nodal, law_restitution, law_spring_damper, law_three_element, side_above, &
      side_below, side_both, stop_settings_t
   use scene_input, only: scene_input_t
   use scene_types, only: scales_t, scene_t, support_rotation
   use stop_groups, only: physical_stop_t, physical_support_t
   use stop_pairs, only: are_at_one_point, conflict_of_stops, conflict_of_supports, conflict_with_support
   use unit_ratios, only: take_ratio
   use value_rules, only: range_t, range_text
   implicit none (type, external)
   private
   public :: resolve_stops, resolve_supports

   !> Any of these says where a surface is; the first that the file gives is told.
   character(*), parameter :: names_of_place = 'position side preload surface_height clearance_ratio clearance'

contains

   !> Problems go into the input.
   subroutine resolve_stops(input, table, physical, scene)
      type(scene_input_t), intent(inout) :: input
      !> Its names, read
      type(table_t), intent(in) :: table
      !> What they give in physical units, [stops]
      type(physical_stop_t), intent(in) :: physical(:)
      !> Scales in; stops, the one from which the beam is released and the scale of displacements out
      type(scene_t), intent(inout) :: scene

      type(stop_settings_t) :: stops(size(physical))
      real(wp) :: unit_stiffness
      integer :: k

      stops(1) = scene%stop
      if (size(stops) > 1) stops(2:) = scene%more_stops
      call find_released(input, table, size(stops), scene%pulled)
      if (input%has_problem()) return
      call resolve_heights(input, table%range_of('stop', 'preload'), physical, scene%pulled, stops, scene%scales)
      unit_stiffness = 3.0_wp*scene%scales%bending_stiffness/scene%beam%length**3
      do k = 1, size(stops)
         if (stops(k)%law == law_restitution) cycle
         call resolve_law(input, table, k, physical(k), unit_stiffness, scene%scales%omega1, stops(k))
      end do
      if (input%has_problem()) return
      call check_pairs(input, scene%wants_precision, stops)
      scene%stop = stops(1)
      if (size(stops) > 1) scene%more_stops(:) = stops(2:)
   end subroutine resolve_stops

   !> The stop that gives the height of the start, or says that it is the one.
   subroutine find_released(input, table, stops, released)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> Number of stops
      integer, intent(in) :: stops
      !> The only one that says it is, or gives a height; 0: none
      integer, intent(out) :: released

      integer :: k

      released = 0
      do k = 1, stops
         associate (pulled => table%entries(table%find(table%find_group('stop', k), 'pulled')))
            if (.not. (input%has('stop', 'initial_height', k) .or. nint(pulled%value) == 1)) cycle
         end associate
         if (released > 0) then
            call input%complain('stop', 'initial_height pulled', 'the beam is released from one stop, which is &stop ' &
               //'number '//to_text(released)//'; keep one of them', k)
            return
         end if
         released = k
      end do
   end subroutine find_released

   !> The preloads from the heights of the stops and of the start.
   subroutine resolve_heights(input, preload_range, physical, released, stops, scales)
      type(scene_input_t), intent(inout) :: input
      type(range_t), intent(in) :: preload_range
      !> What they give in physical units, [stops]
      type(physical_stop_t), intent(in) :: physical(:)
      !> The one with the height of the start, if there is one
      integer, intent(in) :: released
      !> Preloads out, [stops]
      type(stop_settings_t), intent(inout) :: stops(:)
      !> Length in, and that of displacements where it is known; that of displacements out
      type(scales_t), intent(inout) :: scales

      real(wp) :: height
      logical :: has_unit, has_height
      integer :: k

      has_unit = scales%displacement > 0.0_wp
      has_height = .false.
      if (released > 0) has_height = input%has('stop', 'initial_height', released)
      if (has_height .and. has_unit) then
         call input%complain('stop', 'initial_height', 'does not go with &scene displacement_scale: both say what ' &
            //'the unit of displacement is', released)
      else if (has_height) then
         has_unit = .true.
         call find_unit(input, preload_range, physical(released), released, stops(released), scales)
      end if
      if (input%has_problem()) return
      do k = 1, size(stops)
         if (.not. input%has('stop', height_name(stops(k)), k)) then
            if (stops(k)%side == side_both .and. .not. input%has('stop', 'clearance_ratio', k)) then
               call input%complain('stop', 'side', 'needs clearance_ratio or clearance, the distance to each side; ' &
                  //'without any it is a support: use &support', k)
            end if
            cycle
         end if
         height = height_of(stops(k), physical(k))
         if (.not. has_unit) then
            call input%complain('stop', height_name(stops(k)), 'needs initial_height too'//trim(merge( &
               ', here or at the stop from which the beam is released', &
               '                                                     ', size(stops) > 1)), k)
         else if (abs(height) > scales%length) then
            call input%complain('stop', height_name(stops(k)), "must be smaller in size than the beam's length, " &
               //to_text(scales%length), k)
         else if (abs(height) > preload_range%most*scales%displacement) then
            call input%complain('stop', height_name(stops(k)), 'must be at most '//to_text(preload_range%most) &
               //' times the unit of displacement, '//rounded(scales%displacement)//', in size', k)
         else if (abs(height) > 0.0_wp) then
            stops(k)%preload = height/scales%displacement
         else
            stops(k)%preload = 0.0_wp
         end if
      end do
   end subroutine resolve_heights

   !> The unit of displacements, the height from which the beam is released over the surface.
   subroutine find_unit(input, preload_range, physical, released, stop, scales)
      type(scene_input_t), intent(inout) :: input
      type(range_t), intent(in) :: preload_range
      !> The stop from which the beam is released: its heights, which it is, and its side
      type(physical_stop_t), intent(in) :: physical
      integer, intent(in) :: released
      type(stop_settings_t), intent(in) :: stop
      !> Length in; that of displacements out
      type(scales_t), intent(inout) :: scales

      ! Share of the length: heights below it cannot be told from none
      real(wp), parameter :: smallest_lift = 1.0e-15_wp
      real(wp) :: lift, height

      if (.not. input%has('stop', height_name(stop), released)) then
         call input%complain('stop', 'initial_height', 'needs '//height_name(stop)//' too', released)
         return
      end if
      height = height_of(stop, physical)
      lift = merge(-1.0_wp, 1.0_wp, stop%side == side_above)*physical%initial_height - height
      if (abs(height) > scales%length) then
         call input%complain('stop', height_name(stop), "must be smaller in size than the beam's length, " &
            //to_text(scales%length), released)
      else if (abs(physical%initial_height) > scales%length) then
         call input%complain('stop', 'initial_height', "must be smaller in size than the beam's length, " &
            //to_text(scales%length), released)
      else if (stop%side == side_both .and. abs(physical%initial_height) > physical%clearance) then
         call input%complain('stop', 'initial_height', 'must be between both sides, at most clearance = ' &
            //to_text(physical%clearance)//' in size', released)
      else if (lift < smallest_lift*scales%length) then
         call input%complain('stop', 'initial_height', 'must be '//trim(merge('below', 'above', &
            stop%side == side_above))//' '//surface_in_words(stop, physical), released)
      else if (abs(height) > preload_range%most*lift) then
         call input%complain('stop', 'initial_height', 'is too near to '//height_name(stop)//': preload must be ' &
            //range_text(preload_range), released)
      else
         scales%displacement = lift
      end if
   end subroutine find_unit

   !> The name of the height of a stop's surface.
   pure function height_name(stop) result(name)
      type(stop_settings_t), intent(in) :: stop
      character(:), allocatable :: name

      name = trim(merge('clearance     ', 'surface_height', stop%side == side_both))
   end function height_name

   !> The height of a surface in the direction in which the stop pushes; on both sides that below.
   pure function height_of(stop, physical) result(height)
      type(stop_settings_t), intent(in) :: stop
      type(physical_stop_t), intent(in) :: physical
      real(wp) :: height

      height = physical%surface_height
      if (stop%side == side_above) height = -physical%surface_height
      if (stop%side == side_both) height = -physical%clearance
   end function height_of

   !> Such as 'surface_height = 0.1'.
   pure function surface_in_words(stop, physical) result(words)
      type(stop_settings_t), intent(in) :: stop
      type(physical_stop_t), intent(in) :: physical
      character(:), allocatable :: words

      words = height_name(stop)//' = '//to_text(physical%surface_height)
      if (stop%side == side_both) words = 'the lower side, -'//height_name(stop)//' = '//to_text(-physical%clearance)
   end function surface_in_words

   !> Ratios of a law from springs and damper.
   subroutine resolve_law(input, table, which, physical, unit_stiffness, omega1, stop)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> Which &stop
      integer, intent(in) :: which
      !> What it gives in physical units
      type(physical_stop_t), intent(in) :: physical
      !> 3 E Ibar / L^3
      real(wp), intent(in) :: unit_stiffness
      !> Reference frequency, rad per unit of time
      real(wp), intent(in) :: omega1
      type(stop_settings_t), intent(inout) :: stop

      real(wp) :: spring

      call take_ratio(input, table, 'stop', 'stiffness', physical%stiffness/unit_stiffness, stop%stiffness_ratio, which)
      if (input%has_problem()) return
      call take_ratio(input, table, 'stop', 'damper', physical%damper*omega1/unit_stiffness, stop%damper_ratio, which)
      if (stop%law /= law_three_element) return
      spring = stop%stiffness_ratio*unit_stiffness
      if (input%has('stop', 'stiffness', which)) spring = physical%stiffness
      call take_ratio(input, table, 'stop', 'branch_stiffness', physical%branch_stiffness/spring, stop%branch_ratio, &
         which)
   end subroutine resolve_law

   !> Stops that contradict each other, or what is computed with one stop below the beam alone.
   subroutine check_pairs(input, has_precision, stops)
      type(scene_input_t), intent(inout) :: input
      !> The scene measures precision
      logical, intent(in) :: has_precision
      type(stop_settings_t), intent(in) :: stops(:)

      character(:), allocatable :: conflict
      integer :: i, k

      do k = 1, size(stops)
         if (stops(k)%law == law_restitution .and. stops(k)%impulse == impulse_nodal .and. &
            (size(stops) > 1 .or. stops(k)%side /= side_below)) call input%complain('stop', 'impulse', &
            "goes with one stop below the beam and no other; else take 'momentum'", k)
         if (has_precision .and. (k > 1 .or. stops(k)%side /= side_below .or. stops(k)%law == law_spring_damper)) then
            call input%complain('stop', 'side law', 'does not go with &precision, which measures one stop below the ' &
               //'beam, rigid or of three elements', k)
         end if
         do i = 1, k - 1
            if (.not. are_at_one_point(stops(i)%position, stops(k)%position)) cycle
            conflict = conflict_of_stops(stops(i), stops(k))
            if (conflict == '') cycle
            call input%complain('stop', names_of_place, 'at the same point as &stop number '//to_text(i)//': ' &
               //conflict, k)
         end do
      end do
   end subroutine check_pairs

   !> Problems go into the input.
   subroutine resolve_supports(input, table, physical, scene)
      type(scene_input_t), intent(inout) :: input
      !> Its names, read
      type(table_t), intent(in) :: table
      !> What they give in physical units, [supports]
      type(physical_support_t), intent(in) :: physical(:)
      !> Scales in; supports out
      type(scene_t), intent(inout) :: scene

      real(wp) :: unit
      integer :: k

      do k = 1, size(physical)
         unit = 3.0_wp*scene%scales%bending_stiffness/scene%beam%length**3
         if (scene%supports(k)%motion == support_rotation) unit = unit*scene%beam%length**2
         call take_ratio(input, table, 'support', 'stiffness', physical(k)%stiffness/unit, &
            scene%supports(k)%stiffness_ratio, k)
      end do
      if (input%has_problem()) return
      do k = 1, size(physical)
         call check_support(input, scene, k)
      end do
   end subroutine resolve_supports

   !> A support that contradicts a stop or one before it.
   subroutine check_support(input, scene, which)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: which

      character(*), parameter :: names = 'position motion stiffness_ratio stiffness'
      character(:), allocatable :: conflict
      integer :: i

      associate (support => scene%supports(which))
         conflict = ''
         if (scene%has_stop) then
            if (are_at_one_point(scene%stop%position, support%position)) conflict = conflict_with_support(support)
            if (allocated(scene%more_stops)) then
               if (any(are_at_one_point(scene%more_stops%position, support%position))) then
                  conflict = conflict_with_support(support)
               end if
            end if
         end if
         do i = 1, which - 1
            if (conflict /= '' .or. .not. are_at_one_point(scene%supports(i)%position, support%position)) cycle
            conflict = conflict_of_supports(scene%supports(i), support)
         end do
      end associate
      if (conflict /= '') call input%complain('support', names, conflict, which)
   end subroutine check_support

end module scene_stops
