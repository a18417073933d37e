!> What must fit together in the group &cases of a scene file.
module cases_resolve
   use kinds, only: wp
   use name_parameters, only: chosen_parameter
   use name_table, only: table_t
   use number_text, only: to_text
   use scene_input, only: scene_input_t
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: resolve_cases

   !> Ratios that &cases vary, and quantities that would no longer be what the file gives.
   character(*), parameter :: spoilt(2, 2) = reshape([character(32) :: 'stiffness_ratio', 'branch_stiffness', &
      'stiffness_ratio', 'damper'], [2, 2])

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

      integer :: place, i, k
      logical :: is_lost

      place = chosen_parameter(table, table%find_group('cases'), 'parameter')
      associate (chosen => table%entries(place))
         if (.not. table%counts(place)) call input%complain('cases', 'parameter', &
            parameter//' goes with '//table%phrase(place, from_elsewhere=.true.))
         do i = 1, table%entry_count
            associate (other => table%entries(i))
               if (other%group /= chosen%group .or. .not. other%is_given) cycle
               is_lost = other%name%instead_of == chosen%name%name
               do k = 1, size(spoilt, 2)
                  is_lost = is_lost .or. (spoilt(1, k) == chosen%name%name .and. spoilt(2, k) == other%name%name)
               end do
               if (is_lost) call input%complain(trim(table%groups(other%group)%name), trim(other%name%name), &
                  "does not go with &cases parameter = '"//parameter//"'")
            end associate
         end do
      end associate
   end subroutine check_parameter

   !> No height may be less than 0.
   subroutine check_taper(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene

      if (any(abs(scene%cases%values) > 2.0_wp*scene%scales%height_ratio*(1.0_wp + epsilon(1.0_wp)))) then
         call input%complain('cases', 'values', 'a taper must be at most twice mean_height_ratio = ' &
            //to_text(scene%scales%height_ratio)//' in size (a full wedge)')
      end if
   end subroutine check_taper

end module cases_resolve
