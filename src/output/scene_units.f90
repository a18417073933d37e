!> What one unit of each kind of quantity is in the units of the scene.
module scene_units
   use kinds, only: lambda1_power4, wp
   use scene_types, only: scales_t
   implicit none (type, external)
   private
   public :: units_t, units_of, in_scene_units

   !> 0: not known.
   type :: units_t
      real(wp) :: length = 0.0_wp
      real(wp) :: time = 0.0_wp
      real(wp) :: frequency = 0.0_wp
      real(wp) :: displacement = 0.0_wp
      real(wp) :: slope = 0.0_wp
      real(wp) :: velocity = 0.0_wp
      real(wp) :: slope_velocity = 0.0_wp
      real(wp) :: force = 0.0_wp
      real(wp) :: impulse = 0.0_wp
      real(wp) :: energy = 0.0_wp
   end type units_t

contains

   pure function units_of(scales) result(units)
      type(scales_t), intent(in) :: scales
      type(units_t) :: units

      units%length = scales%length
      units%time = 1.0_wp/scales%omega1
      units%frequency = scales%omega1
      if (scales%displacement <= 0.0_wp) return
      units%displacement = scales%displacement
      units%slope = scales%displacement/scales%length
      units%velocity = scales%omega1*units%displacement
      units%slope_velocity = scales%omega1*units%slope
      units%force = lambda1_power4*scales%displacement*scales%bending_stiffness/(scales%height_ratio*scales%length**3)
      units%impulse = scales%beam_mass*units%velocity
      units%energy = scales%beam_mass*units%velocity**2
   end function units_of

   !> One unit of a measure or a history in the units of the scene; 0: not known.
   elemental function in_scene_units(unit, units) result(value)
      !> As in their tables
      character(*), intent(in) :: unit
      !> Those of the scene
      type(units_t), intent(in) :: units
      real(wp) :: value

      select case (unit)
      case ('tau')
         value = units%time
      case ('eta')
         value = units%displacement
      case ('eta/tau')
         value = units%velocity
      case ('Pbar')
         value = units%force
      case ('impulse')
         value = units%impulse
      case default
         value = 0.0_wp
      end select
   end function in_scene_units

end module scene_units
