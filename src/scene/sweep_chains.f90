!> What must fit together in a sweep whose cases go on one from the other.
module sweep_chains
   use load_periods, only: is_steady
   use name_table, only: is_among
   use number_text, only: to_text
   use scene_input, only: scene_input_t
   use scene_types, only: scene_t
   use sweep_settings, only: design_grid, design_latin_hypercube, is_swept, parameter_t
   implicit none (type, external)
   private
   public :: check_chains

   !> Groups, and their names that change in a motion under way: neither its modes nor where surfaces are, nor the phase
   !> of loads.
   character(*), parameter :: changing(2, 5) = reshape([character(160) :: &
      'damping', 'zeta stiffness_coefficient zeta_mass mass_coefficient mode_ratios', &
      'stop', 'restitution stiffness_ratio stiffness branch_ratio branch_stiffness damper_ratio damper', &
      'force', 'amplitude_ratio amplitude frequency_ratio frequency', &
      'base', 'amplitude_ratio amplitude frequency_ratio frequency gravity_ratio gravity', &
      'response', 'hop_tolerance'], [2, 5])

contains

   !> Problems go into the input.
   subroutine check_chains(input, scene)
      type(scene_input_t), intent(inout) :: input
      !> Read and resolved
      type(scene_t), intent(in) :: scene

      integer :: k

      associate (sweep => scene%sweep)
         if (sweep%carry == 0) then
            if (sweep%carries_back) call input%complain('sweep', 'carry_back', &
               'needs carry, the parameter along whose values cases go on')
            return
         end if
         if (.not. is_swept(sweep%swept(sweep%carry))) then
            call input%complain('sweep', 'carry', 'must be swept: give it a list or a range')
         else if (sweep%design == design_latin_hypercube) then
            call input%complain('sweep', 'carry', "does not go with design = 'latin_hypercube', which has no order")
         else if (.not. scene%wants_poincare) then
            call input%complain('sweep', 'carry', 'needs &poincare: cases last whole periods of the load')
         end if
         if (input%has_problem()) return
         do k = 1, size(sweep%swept)
            if (.not. is_swept(sweep%swept(k)) .or. (k /= sweep%carry .and. sweep%design == design_grid)) cycle
            if (changes(sweep%swept(k)%parameter)) cycle
            call input%complain('sweep', 'carry', trim(sweep%swept(k)%parameter%name)//' cannot change in a motion ' &
               //'under way: '//reason(sweep%swept(k)%parameter))
            return
         end do
      end associate
      call check_course(input, scene)
   end subroutine check_chains

   !> Whole periods of loads that go on for ever, and nothing that runs cases by themselves.
   subroutine check_course(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene

      character(*), parameter :: cannot = 'does not go with carry of &sweep'
      integer :: k

      if (.not. scene%poincare%sets_duration) then
         call input%complain('response', 'duration duration_time', &
            cannot//', whose cases last skip + keep periods of the load')
      else if (scene%poincare%load > 0) then
         call input%complain('poincare', 'load', cannot//': a case ends with a period of all loads')
      else if (scene%wants_best .and. scene%best%refine) then
         call input%complain('best', 'refine', cannot//': its cases would begin by themselves')
      else if (scene%mesh%estimate) then
         call input%complain('mesh', 'estimate', cannot//': its cases would begin by themselves')
      end if
      if (scene%has_forces) then
         do k = 1, size(scene%forces)
            if (.not. is_steady(scene%forces(k)%course)) call complain_of('force')
         end do
      end if
      if (scene%has_bases) then
         do k = 1, size(scene%bases)
            if (.not. is_steady(scene%bases(k)%course)) call complain_of('base')
         end do
      end if

   contains

      subroutine complain_of(group)
         character(*), intent(in) :: group

         if (input%has_problem()) return
         call input%complain(group, '', 'carry of &sweep takes loads that go on for ever: ' &
            //"kind = 'harmonic' or 'step' without start and end; this is "//group//' '//to_text(k), k)
      end subroutine complain_of
   end subroutine check_course

   !> May it change in a motion under way?
   pure function changes(parameter)
      type(parameter_t), intent(in) :: parameter
      logical :: changes

      integer :: k

      k = findloc(changing(1, :), parameter%group, dim=1)
      changes = .false.
      if (k > 0) changes = is_among(parameter%name_in_group, changing(2, k))
   end function changes

   !> Why not?
   pure function reason(parameter) result(words)
      type(parameter_t), intent(in) :: parameter
      character(:), allocatable :: words

      if (parameter%is_of_beam) then
         words = 'another beam or mesh has other modes'
      else if (parameter%group == 'stop') then
         words = 'a surface elsewhere would be in the beam, or away from it'
      else if (any(parameter%group == [character(5) :: 'force', 'base'])) then
         words = 'loads go on in phase and in place, only amplitude and frequency change'
      else
         words = 'it says how a case begins or ends, or what is kept of it'
      end if
   end function reason

end module sweep_chains
