!> The units of the results of a scene.
module scene_units
   use quantities, only: system_none, units_of, units_t
   use scene_types, only: output_dimensionless, output_scene, scene_t
   implicit none (type, external)
   private
   public :: are_physical, units_in

contains

   !> Units of the results: as the scene requests; without a request the units of the scene if it has a unit system,
   !> else no units (dimensionless results).
   pure type(units_t) function units_in(scene) result(units)
      type(scene_t), intent(in) :: scene

      units = units_of(scene%scales, scene%unit_system, are_physical(scene))
   end function units_in

   !> Whether the results of a scene are physical, that is, in its units; otherwise they are dimensionless.
   pure logical function are_physical(scene) result(answer)
      type(scene_t), intent(in) :: scene

      answer = scene%output_units == output_scene .or. (scene%output_units /= output_dimensionless &
         .and. scene%unit_system > 0 .and. scene%unit_system /= system_none)
   end function are_physical

end module scene_units
