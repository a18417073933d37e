!> Quantities in the user's units: ratios that a file gives by them, and what results in them need.
module unit_ratios
   use kinds, only: wp
   use name_table, only: table_t
   use number_text, only: to_text
   use quantities, only: system_none
   use scene_input, only: scene_input_t
   use scene_types, only: output_dimensionless, output_scene, scene_t
   use value_rules, only: contains_value, range_t, range_text
   implicit none (type, external)
   private
   public :: take_ratio, check_units

   character(*), parameter :: unknown_displacement = 'needs displacements in units: give initial_height, and the ' &
      //"height of the surface, at the &stop from which the beam is released; or &output units = 'dimensionless'"

contains

   !> A ratio, if the file gives its quantity.
   subroutine take_ratio(input, table, group, name, value, ratio, occurrence)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> Group and name of the quantity
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      !> The quantity as a ratio
      real(wp), intent(in) :: value
      !> Replaced by the value if the file has the quantity
      real(wp), intent(inout) :: ratio
      !> Which of the groups of this name; absent: the first
      integer, intent(in), optional :: occurrence

      character(:), allocatable :: ratio_name
      type(range_t) :: range

      if (.not. input%has(group, name, occurrence)) return
      ratio_name = trim(table%entries(table%find(table%find_group(group), name))%name%instead_of)
      range = table%range_of(group, ratio_name)
      if (contains_value(range, value)) then
         ratio = value
      else
         call input%complain(group, name, ratio_name//' would be '//to_text(value)//': must be ' &
            //range_text(range), occurrence)
      end if
   end subroutine take_ratio

   !> Results in units need a beam in units, and displacements; problems go into the input.
   subroutine check_units(input, scene)
      type(scene_input_t), intent(inout) :: input
      !> Resolved but for what is swept
      type(scene_t), intent(in) :: scene

      character(*), parameter :: needed(3) = [character(16) :: 'length', 'youngs_modulus', 'density']
      integer :: i

      if (scene%unit_system > 0 .and. scene%unit_system /= system_none) then
         if (scene%wants_precision .or. scene%wants_statements) then
            call input%complain('scene', 'units', 'this scene has no results in units')
            return
         end if
         do i = 1, size(needed)
            if (input%has('beam', trim(needed(i)))) cycle
            call input%complain('scene', 'units', 'needs '//trim(needed(i))//' in &beam')
            return
         end do
         if (scene%output_units == output_dimensionless) return
      else if (scene%output_units /= output_scene) then
         return
      end if
      if (scene%wants_response .and. scene%scales%displacement <= 0.0_wp) then
         if (input%has('output', 'units')) then
            call input%complain('output', 'units', unknown_displacement)
         else
            call input%complain('scene', 'units', unknown_displacement)
         end if
      end if
   end subroutine check_units

end module unit_ratios
