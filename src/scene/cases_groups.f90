!> The group &cases of a scene file, and what must fit together in it.
module cases_groups
   use kinds, only: wp
   use number_text, only: to_text
   use cases_settings, only: case_parameter_names, case_parameters
   use scene_input, only: scene_input_t
   use scene_ranges, only: parameter_range
   use scene_types, only: law_restitution, law_three_element, scene_t, shape_taper
   use scene_walk, only: scene_walk_t
   use sweep_settings, only: parameter_branch, parameter_damper, parameter_preload, &
      parameter_restitution, parameter_stiffness, parameter_taper, parameter_tip_mass, parameter_zeta
   use value_rules, only: range_t, role_t
   implicit none (type, external)
   private
   public :: walk_cases, resolve_cases

contains

   !> &cases
   subroutine walk_cases(walk, scene)
      !> What the calls do; the group is open
      type(scene_walk_t), intent(inout) :: walk
      !> The scene
      type(scene_t), intent(inout) :: scene

      type(range_t), parameter :: all_ranges = range_t(-1.0e6_wp, 1.0e12_wp)
      type(range_t) :: range

      associate (cases => scene%cases)
         call walk%choice('parameter', cases%choice, 'what differs from case to case', case_parameter_names, &
            role_t(default='none: give one'))
         range = all_ranges
         if (walk%is_reading() .and. cases%choice > 0) range = parameter_range(case_parameters(cases%choice))
         call walk%item('values', cases%values, 'its values, one case each', range, role_t(default='none: give some'))
      end associate
   end subroutine walk_cases

   !> The cases must fit the scene; problems go into the input.
   subroutine resolve_cases(input, scene)
      !> The file
      type(scene_input_t), intent(inout) :: input
      !> Read and resolved but for the cases
      type(scene_t), intent(in) :: scene

      if (.not. scene%wants_cases) return
      if (scene%wants_frequencies) then
         call input%complain('frequencies', '', 'does not go with &cases; give it a scene of its own')
      else if (scene%wants_sweep) then
         call input%complain('sweep', '', 'does not go with &cases; give it a scene of its own')
      else if (scene%cases%choice == 0) then
         call input%complain('cases', '', 'needs a parameter: what differs from case to case')
      else if (.not. allocated(scene%cases%values)) then
         call input%complain('cases', '', 'needs values, one for each case')
      else if (size(scene%cases%values) == 0) then
         call input%complain('cases', 'values', 'needs at least one value')
      end if
      if (input%has_problem()) return
      call check_parameter(input, scene, case_parameters(scene%cases%choice), &
                           trim(case_parameter_names(scene%cases%choice)))
   end subroutine resolve_cases

   !> The parameter must count in the scene, and must not be given in physical units, which would be lost. As in a
   !> sweep, a value given in its own group gives way.
   subroutine check_parameter(input, scene, parameter, name)
      !> The file
      type(scene_input_t), intent(inout) :: input
      !> The scene
      type(scene_t), intent(in) :: scene
      !> One of the `parameter_` constants, and its name
      integer, intent(in) :: parameter
      character(*), intent(in) :: name

      real(wp) :: thickest

      select case (parameter)
      case (parameter_preload)
         call refuse(input, 'stop', [character(15) :: 'surface_height', 'initial_height'], name)
      case (parameter_restitution)
         if (scene%stop%law /= law_restitution) &
            call input%complain('cases', 'parameter', name//' goes with law = ''restitution'' in &stop')
      case (parameter_stiffness)
         call refuse(input, 'stop', [character(16) :: 'stiffness', 'branch_stiffness', 'damper'], name)
      case (parameter_branch)
         call refuse(input, 'stop', ['branch_stiffness'], name)
      case (parameter_damper)
         call refuse(input, 'stop', ['damper'], name)
      case (parameter_zeta)
         call refuse(input, 'damping', ['stiffness_coefficient'], name)
      case (parameter_tip_mass)
         call refuse(input, 'tip_mass', ['mass'], name)
      case (parameter_taper)
         thickest = 2.0_wp*scene%scales%height_ratio
         if (scene%beam%shape /= shape_taper) then
            call input%complain('cases', 'parameter', 'taper goes with a linear taper in &beam, not with tables')
         else if (any(abs(scene%cases%values) > thickest*(1.0_wp + epsilon(1.0_wp)))) then
            call input%complain('cases', 'values', 'a taper must be at most twice mean_height_ratio = ' &
               //to_text(scene%scales%height_ratio)//' in size (a full wedge)')
         end if
      end select
      if (any(parameter == [parameter_stiffness, parameter_branch, parameter_damper]) &
         .and. scene%stop%law /= law_three_element) &
         call input%complain('cases', 'parameter', name//' goes with law = ''three_element'' in &stop')
   end subroutine check_parameter

   !> Physical quantities that &cases would overrule.
   subroutine refuse(input, group, names, parameter)
      !> The file
      type(scene_input_t), intent(inout) :: input
      !> Group of the names
      character(*), intent(in) :: group
      !> The names
      character(*), intent(in) :: names(:)
      !> What &cases calls it
      character(*), intent(in) :: parameter

      integer :: i

      do i = 1, size(names)
         if (.not. input%has(group, trim(names(i)))) cycle
         call input%complain(group, trim(names(i)), 'does not go with &cases parameter = '''//parameter//'''')
         return
      end do
   end subroutine refuse

end module cases_groups
