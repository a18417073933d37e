!> The groups &sweep and &best of a scene file, and what must fit together in them.
module sweep_groups
   use kinds, only: i8, wp
   use measure_list, only: measure_status, measure_table
   use number_text, only: to_text
   use scene_input, only: scene_input_t
   use scene_ranges, only: parameter_range
   use scene_types, only: law_restitution, law_three_element, scene_t, shape_taper
   use scene_walk, only: scene_walk_t
   use sweep_settings, only: best_settings_t, design_grid, design_latin_hypercube, design_names, design_paired, &
      goal_names, is_swept, parameter_branch, parameter_count, parameter_damper, parameter_duration, &
      parameter_elements, parameter_meanings, parameter_mesh_ratio, parameter_names, parameter_restitution, &
      parameter_stiffness, parameter_taper, swept_t
   use value_rules, only: role_t, within
   implicit none (type, external)
   private
   public :: walk_sweep, walk_best, resolve_sweep

   !> Most cases of a sweep.
   integer, parameter :: most_cases = 1000000000

contains

   !> &sweep
   subroutine walk_sweep(walk, scene)
      !> What the calls do; the group is open
      type(scene_walk_t), intent(inout) :: walk
      !> The scene
      type(scene_t), intent(inout) :: scene

      character(*), parameter :: hypercube = 'design = ''latin_hypercube'''
      character(:), allocatable :: name, meaning
      logical :: is_hypercube, shows_all
      integer :: k

      shows_all = walk%is_reading()
      associate (sweep => scene%sweep)
         call walk%choice('design', sweep%design, 'which combinations of the values: all, the lists side by side, ' &
            //'or a random sample', design_names)
         is_hypercube = sweep%design == design_latin_hypercube
         call walk%item('count', sweep%count, 'number of cases', within(1, most_cases), &
            role_t(is_hypercube, hypercube, default='none'))
         call walk%item('seed', sweep%seed, 'start of the random numbers', within(1, 2000000000), &
            role_t(is_hypercube, hypercube))
         call walk%item('part_cases', sweep%part_cases, 'cases that reach the disk together', within(1, 1000000), &
            role_t(default='a 400th, 10 to 16384'))
         do k = 1, parameter_count
            name = trim(parameter_names(k))
            meaning = trim(parameter_meanings(k))
            associate (swept => sweep%swept(k))
               if (k == parameter_elements) then
                  call walk_elements(walk, swept, name, meaning)
                  cycle
               end if
               call walk%item(name, swept%list, meaning, parameter_range(k), &
                  sweep_role(scene, k, shows_all .or. allocated(swept%list)))
               call walk%item(name//'_range', swept%range, 'least and greatest, divided evenly', parameter_range(k), &
                  sweep_role(scene, k, shows_all .or. allocated(swept%range)))
               call walk%item(name//'_log_range', swept%log_range, 'the same, divided evenly in the logarithm', &
                  parameter_range(k), sweep_role(scene, k, shows_all .or. allocated(swept%log_range)))
               call walk%item(name//'_points', swept%points, 'number of values in the range', within(2, 1000000), &
                  sweep_role(scene, k, shows_all .or. swept%points > 0))
            end associate
         end do
      end associate
   end subroutine walk_sweep

   !> Numbers of elements: a list of whole numbers.
   subroutine walk_elements(walk, swept, name, meaning)
      !> What the calls do; the group is open
      type(scene_walk_t), intent(inout) :: walk
      !> The values
      type(swept_t), intent(inout) :: swept
      !> Name and meaning of the parameter
      character(*), intent(in) :: name
      character(*), intent(in) :: meaning

      integer, allocatable :: list(:)

      if (allocated(swept%list)) allocate (list, source=nint(swept%list))
      call walk%item(name, list, meaning, parameter_range(parameter_elements), &
         role_t(walk%is_reading() .or. allocated(list), default='not swept'))
      if (walk%is_reading() .and. allocated(list)) allocate (swept%list, source=real(list, wp))
   end subroutine walk_elements

   !> When a parameter can be swept, and when its values are echoed.
   function sweep_role(scene, parameter, is_shown) result(role)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> One of the `parameter_` constants
      integer, intent(in) :: parameter
      !> It is read, or has values
      logical, intent(in) :: is_shown
      type(role_t) :: role

      role%default = 'not swept'
      role%is_relevant = is_shown
      select case (parameter)
      case (parameter_restitution)
         role%goes_with = 'law = ''restitution'' in &stop'
         role%is_relevant = is_shown .and. scene%stop%law == law_restitution
      case (parameter_stiffness, parameter_branch, parameter_damper)
         role%goes_with = 'law = ''three_element'' in &stop'
         role%is_relevant = is_shown .and. scene%stop%law == law_three_element
      case (parameter_taper)
         role%goes_with = 'a linear taper in &beam, not with tables'
         role%is_relevant = is_shown .and. scene%beam%shape == shape_taper
      end select
   end function sweep_role

   !> &best
   subroutine walk_best(walk, best)
      !> What the calls do; the group is open
      type(scene_walk_t), intent(inout) :: walk
      !> What is sought
      type(best_settings_t), intent(inout) :: best

      character(*), parameter :: refine = 'refine = .true.'
      integer :: chosen

      chosen = best%measure - measure_status
      call walk%choice('measure', chosen, 'measure by which cases are compared; with restitution greatest_force is the mean ' &
                       //'over the first 0.1 of tau of an episode, as the peak has no limit in the mesh', &
                       measure_table(measure_status + 1:)%name)
      best%measure = chosen + measure_status
      call walk%choice('goal', best%goal, 'which of its values is the best', goal_names)
      call walk%item('count', best%count, 'cases in the table of the best', within(1, 10000))
      call walk%item('refine', best%refine, 'seek better ones between the swept values, from the best case')
      call walk%item('evaluations', best%evaluations, 'most cases that the refinement computes', within(1, 10000000), &
         role_t(best%refine, refine))
      call walk%item('precision', best%precision, 'share of each range at which it ends', within(1.0e-12_wp, 0.1_wp), &
         role_t(best%refine, refine))
   end subroutine walk_best

   !> What is given must fit together; problems go into the input.
   subroutine resolve_sweep(input, scene)
      !> The file
      type(scene_input_t), intent(inout) :: input
      !> Read and resolved but for the sweep
      type(scene_t), intent(inout) :: scene

      character(*), parameter :: others(3) = [character(10) :: 'cases', 'precision', 'statements']
      integer :: k

      if (scene%wants_best .and. .not. scene%wants_sweep) then
         if (scene%wants_cases) call input%complain('best', '', 'does not go with &cases; give it a scene with &sweep')
         call input%complain('best', '', 'needs a sweep; add &sweep with the parameters to vary')
      end if
      if (.not. scene%wants_sweep) return
      if (scene%wants_frequencies) then
         call input%complain('frequencies', '', 'does not go with &sweep; give it a scene of its own')
      else if (input%has_group('output')) then
         call input%complain('output', '', 'does not go with &sweep: each case is a row of measures; for histories ' &
            //'run a scene of that case alone')
      end if
      do k = 1, size(others)
         if (input%has_group(trim(others(k)))) &
            call input%complain(trim(others(k)), '', 'does not go with &sweep; give it a scene of its own')
      end do
      do k = 1, parameter_count
         call check_values(input, scene, k)
         if (input%has_problem()) return
      end do
      if (.not. any(is_swept(scene%sweep%swept))) then
         call input%complain('sweep', '', 'varies nothing; give a parameter a list or a range, such as zeta = 0.01, 0.02')
         return
      end if
      if (scene%sweep%design == design_latin_hypercube .and. scene%sweep%count == 0) &
         call input%complain('sweep', 'design', 'needs count, the number of cases')
      call check_count(input, scene)
      call check_beams(input, scene)
      call check_duration(input, scene)
   end subroutine resolve_sweep

   !> The values of one parameter.
   subroutine check_values(input, scene, parameter)
      !> The file
      type(scene_input_t), intent(inout) :: input
      !> The scene
      type(scene_t), intent(in) :: scene
      !> One of the `parameter_` constants
      integer, intent(in) :: parameter

      character(:), allocatable :: name
      logical :: has_list, has_range, has_log

      name = trim(parameter_names(parameter))
      associate (swept => scene%sweep%swept(parameter))
         has_list = allocated(swept%list)
         has_range = allocated(swept%range)
         has_log = allocated(swept%log_range)
         if (count([has_list, has_range, has_log]) > 1) then
            call input%complain('sweep', name//trim(merge('_range    ', '_log_range', has_range)), &
               'give one of '//name//', '//name//'_range and '//name//'_log_range')
            return
         end if
         if (has_range) call check_range(input, name//'_range', swept%range)
         if (has_log) call check_range(input, name//'_log_range', swept%log_range)
         if (input%has_problem()) return
         if (has_log) then
            if (swept%log_range(1) <= 0.0_wp) &
               call input%complain('sweep', name//'_log_range', 'must be above 0: it is divided in the logarithm')
         end if
         if (swept%points > 0 .and. .not. (has_range .or. has_log)) &
            call input%complain('sweep', name//'_points', 'goes with '//name//'_range or '//name//'_log_range')
         select case (scene%sweep%design)
         case (design_grid)
            if ((has_range .or. has_log) .and. swept%points == 0) call input%complain('sweep', &
               name//trim(merge('_range    ', '_log_range', has_range)), 'needs '//name//'_points too')
         case (design_paired)
            if (has_range .or. has_log) call input%complain('sweep', &
               name//trim(merge('_range    ', '_log_range', has_range)), 'design = ''paired'' takes lists: give '//name)
         case (design_latin_hypercube)
            if (has_list) call input%complain('sweep', name, 'design = ''latin_hypercube'' takes ranges')
            if (swept%points > 0) call input%complain('sweep', name//'_points', &
               'does not go with design = ''latin_hypercube'', which has a value for each case')
         end select
         if (input%has_problem() .or. .not. has_list) return
         if (size(swept%list) == 0) call input%complain('sweep', name, 'needs at least one value')
      end associate
   end subroutine check_values

   !> Two values, ascending.
   subroutine check_range(input, name, range)
      !> The file
      type(scene_input_t), intent(inout) :: input
      !> Its name
      character(*), intent(in) :: name
      !> The values
      real(wp), intent(in) :: range(:)

      if (size(range) /= 2) then
         call input%complain('sweep', name, 'takes two values, the least and the greatest')
      else if (.not. range(2) > range(1)) then
         call input%complain('sweep', name, 'the first value must be less than the second')
      end if
   end subroutine check_range

   !> Lists of one length; not too many cases.
   subroutine check_count(input, scene)
      !> The file
      type(scene_input_t), intent(inout) :: input
      !> The scene
      type(scene_t), intent(in) :: scene

      character(:), allocatable :: first
      integer(i8) :: cases, values
      integer :: k

      cases = 1_i8
      first = ''
      do k = 1, parameter_count
         associate (swept => scene%sweep%swept(k))
            values = int(max(swept%points, 1), i8)
            if (allocated(swept%list)) values = size(swept%list, kind=i8)
            if (scene%sweep%design == design_grid) cases = min(cases*values, 2_i8*most_cases)
            if (scene%sweep%design /= design_paired .or. .not. allocated(swept%list)) cycle
            if (first /= '' .and. values /= cases) then
               call input%complain('sweep', trim(parameter_names(k)), 'design = ''paired'' takes lists of one length; ' &
                  //first//' has '//to_text(cases)//' values, this '//to_text(values))
               return
            end if
            first = trim(parameter_names(k))
            cases = values
         end associate
      end do
      if (cases > int(most_cases, i8)) call input%complain('sweep', '', 'has more than '//to_text(most_cases)//' cases')
   end subroutine check_count

   !> Beams and meshes of the cases pass the checks of a scene's.
   subroutine check_beams(input, scene)
      !> The file
      type(scene_input_t), intent(inout) :: input
      !> The scene
      type(scene_t), intent(in) :: scene

      real(wp), parameter :: largest_spread = 1.0e12_wp
      real(wp), parameter :: smallest_tip = 1.0e-9_wp
      real(wp), allocatable :: values(:)
      real(wp) :: elements, mean, decades
      integer :: i

      call values_given(scene%sweep%swept(parameter_taper), values)
      mean = 0.5_wp*(scene%beam%height_root + scene%beam%height_tip)/scene%beam%length
      do i = 1, size(values)
         if (values(i) > -2.0_wp*mean .and. abs(values(i)) <= 2.0_wp*mean*(1.0_wp - smallest_tip)) cycle
         if (abs(values(i) - 2.0_wp*mean) <= 4.0_wp*epsilon(mean)*mean) cycle
         call input%complain('sweep', given_name(scene%sweep%swept(parameter_taper), 'taper'), 'taper = ' &
            //to_text(values(i))//': the height at the clamp must not vanish, at the tip it must be 0 or at least ' &
            //to_text(smallest_tip)//' of that; so at most '//to_text(2.0_wp*mean)//' in size (a full wedge)')
         return
      end do
      elements = real(scene%mesh%elements, wp)
      call values_given(scene%sweep%swept(parameter_elements), values)
      if (size(values) > 0) elements = maxval(values)
      call values_given(scene%sweep%swept(parameter_mesh_ratio), values)
      if (size(values) == 0) values = [scene%mesh%ratio]
      decades = (elements - 1.0_wp)*maxval(abs(log10(values)))
      if (decades > log10(largest_spread)) call input%complain('sweep', 'elements', 'with '//to_text(nint(elements)) &
         //' elements and the ratios given the longest element is 1e'//to_text(nint(decades)) &
         //' times the shortest: must be at most '//to_text(largest_spread))
   end subroutine check_beams

   !> No run is shorter than a step.
   subroutine check_duration(input, scene)
      !> The file
      type(scene_input_t), intent(inout) :: input
      !> The scene
      type(scene_t), intent(in) :: scene

      real(wp), parameter :: most_samples = 1.0e8_wp
      real(wp), allocatable :: values(:)
      character(:), allocatable :: name

      call values_given(scene%sweep%swept(parameter_duration), values)
      if (size(values) == 0) return
      name = given_name(scene%sweep%swept(parameter_duration), 'duration')
      if (minval(values) < scene%response%step) then
         call input%complain('sweep', name, 'must not be shorter than the step '//to_text(scene%response%step))
      else if (maxval(values) > most_samples*scene%response%step) then
         call input%complain('sweep', name, 'must be at most '//to_text(most_samples)//' steps')
      end if
   end subroutine check_duration

   !> Values of a parameter that a file gives: its list, or the ends of its range.
   subroutine values_given(swept, values)
      !> The parameter
      type(swept_t), intent(in) :: swept
      !> Its values; none: not swept
      real(wp), allocatable, intent(out) :: values(:)

      if (allocated(swept%list)) then
         allocate (values, source=swept%list)
      else if (allocated(swept%range)) then
         allocate (values, source=swept%range)
      else if (allocated(swept%log_range)) then
         allocate (values, source=swept%log_range)
      else
         allocate (values(0))
      end if
   end subroutine values_given

   !> The name under which they stand.
   pure function given_name(swept, name) result(given)
      !> The parameter
      type(swept_t), intent(in) :: swept
      !> Its name
      character(*), intent(in) :: name
      character(:), allocatable :: given

      given = name
      if (allocated(swept%range)) given = name//'_range'
      if (allocated(swept%log_range)) given = name//'_log_range'
   end function given_name

end module sweep_groups
