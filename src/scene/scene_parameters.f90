!> Another value of a parameter for a scene that has been read.
module scene_parameters
   use kinds, only: wp
   use name_parameters, only: list_parameters, parameter_of
   use name_table, only: table_t
   use scene_beam, only: set_taper
   use scene_groups, only: list_group, list_scene, physical_t
   use scene_types, only: scene_t
   use sweep_settings, only: parameter_t
   implicit none (type, external)
   private
   public :: set_parameter, parameter_called

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

   !> The parameter that &sweep calls by a name; without a name: there is none.
   function parameter_called(name) result(parameter)
      character(*), intent(in) :: name
      type(parameter_t) :: parameter

      type(table_t) :: table
      type(scene_t) :: scene
      type(physical_t) :: physical
      integer, allocatable :: places(:)
      integer :: i

      call list_scene(table, scene, physical)
      call list_parameters(table, places)
      do i = 1, size(places)
         parameter = parameter_of(table, places(i))
         if (parameter%name == name) return
      end do
      parameter = parameter_t()
   end function parameter_called

end module scene_parameters
