!> What must fit together in the group &cases of a scene file.
module cases_resolve
   use kinds, only: wp
   use lost_units, only: refuse_lost_units
   use name_parameters, only: chosen_parameter
   use name_table, only: table_t
   use number_text, only: rounded
   use scene_input, only: scene_input_t
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: resolve_cases

contains

   !> The cases must fit the scene; problems go into the input.
   subroutine resolve_cases(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      !> Its names, read
      type(table_t), intent(in) :: table
      !> Resolved but for the cases
      type(scene_t), intent(in) :: scene

      if (.not. scene%wants_cases) return
      if (scene%cases%parameter%name == '') then
         call input%complain('cases', '', 'needs a parameter: what differs from case to case')
      else if (.not. allocated(scene%cases%values)) then
         call input%complain('cases', '', 'needs values, one for each case')
      else
         call check_parameter(input, table, trim(scene%cases%parameter%name))
         if (scene%cases%parameter%name == 'taper' .and. .not. input%has_problem()) call check_taper(input, scene)
      end if
   end subroutine resolve_cases

   !> The parameter must count in the scene, and must not be given in physical units, which would be lost. As in a
   !> sweep, a value given in its own group gives way.
   subroutine check_parameter(input, table, parameter)
      type(scene_input_t), intent(inout) :: input
      !> Its names, read
      type(table_t), intent(in) :: table
      !> As &cases calls it
      character(*), intent(in) :: parameter

      integer :: place

      place = chosen_parameter(table, table%find_group('cases'), 'parameter')
      associate (group => table%groups(table%entries(place)%group))
         if ((group%repeats .or. group%name == 'stress') .and. .not. group%is_wanted) call input%complain('cases', &
            'parameter', parameter//' goes with &'//trim(group%name))
      end associate
      if (.not. table%counts(place)) call input%complain('cases', 'parameter', &
         parameter//' goes with '//table%phrase(place, from_elsewhere=.true.))
      call refuse_lost_units(input, table, place, "&cases parameter = '"//parameter//"'")
   end subroutine check_parameter

   !> No height may be less than 0.
   subroutine check_taper(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene

      if (scene%beam%has_section) then
         call input%complain('section', '', 'says all of the section: a taper of &beam is not varied beside it')
      else if (any(abs(scene%cases%values) > 2.0_wp*scene%scales%height_ratio*(1.0_wp + epsilon(1.0_wp)))) then
         call input%complain('cases', 'values', 'a taper must be at most '//rounded(2.0_wp*scene%scales%height_ratio) &
            //' in size, twice the mean height over the length (a full wedge)')
      end if
   end subroutine check_taper

end module cases_resolve
