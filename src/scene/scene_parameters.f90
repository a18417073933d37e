!> Another value of a parameter for a scene that has been read.
module scene_parameters
   use kinds, only: wp
   use name_table, only: table_t
   use scene_beam, only: set_taper
   use scene_groups, only: list_group, physical_t
   use scene_types, only: scene_t
   use sweep_settings, only: parameter_t
   implicit none (type, external)
   private
   public :: set_parameter

contains

   !> Give a scene another value of a parameter.
   subroutine set_parameter(scene, parameter, value)
      type(scene_t), intent(inout) :: scene
      type(parameter_t), intent(in) :: parameter
      real(wp), intent(in) :: value

      type(table_t) :: table
      type(physical_t) :: physical

      call table%give_one(trim(parameter%name_in_group), value)
      call list_group(trim(parameter%group), table, scene, physical)
      if (parameter%name == 'taper') call set_taper(scene%beam, value)
   end subroutine set_parameter

end module scene_parameters
