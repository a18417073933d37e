!> Ranges of the numbers of a scene that more than one name may give: as a ratio, in physical units, or swept.
module scene_ranges
   use kinds, only: wp
   use sweep_settings, only: parameter_count
   use value_rules, only: range_t
   implicit none (type, external)
   private
   public :: zeta_range, tip_mass_range, position_ratio_range, preload_range, restitution_range
   public :: stiffness_range, branch_range, damper_range, duration_range, step_range
   public :: taper_range, elements_range, ratio_range, hop_range, most_elements, parameter_range

   integer, parameter :: most_elements = 200000

   type(range_t), parameter :: zeta_range = range_t(0.0_wp, 10.0_wp)
   type(range_t), parameter :: tip_mass_range = range_t(0.0_wp, 1.0e6_wp)
   type(range_t), parameter :: position_ratio_range = range_t(1.0e-3_wp, 1.0_wp)
   type(range_t), parameter :: preload_range = range_t(-1.0e6_wp, 1.0e6_wp)
   type(range_t), parameter :: restitution_range = range_t(0.0_wp, 1.0_wp)
   type(range_t), parameter :: stiffness_range = range_t(1.0e-6_wp, 1.0e12_wp)
   type(range_t), parameter :: branch_range = range_t(0.0_wp, 1.0e6_wp)
   type(range_t), parameter :: damper_range = range_t(0.0_wp, 1.0e9_wp)
   type(range_t), parameter :: duration_range = range_t(0.0_wp, 1.0e9_wp, excludes_least=.true.)
   type(range_t), parameter :: step_range = range_t(1.0e-9_wp, 1.0e9_wp)
   type(range_t), parameter :: taper_range = range_t(-2.0_wp, 2.0_wp)
   type(range_t), parameter :: elements_range = range_t(1.0_wp, real(most_elements, wp))
   type(range_t), parameter :: ratio_range = range_t(0.1_wp, 10.0_wp)
   type(range_t), parameter :: hop_range = range_t(1.0e-14_wp, 0.1_wp)
   !> Those of the parameters of a sweep, in their order
   type(range_t), parameter :: ranges(parameter_count) = [elements_range, ratio_range, taper_range, tip_mass_range, &
      position_ratio_range, duration_range, hop_range, zeta_range, preload_range, restitution_range, stiffness_range, &
      branch_range, damper_range]

contains

   !> What the values of a swept parameter may be.
   pure function parameter_range(parameter) result(range)
      !> One of the `parameter_` constants
      integer, intent(in) :: parameter
      type(range_t) :: range

      range = ranges(parameter)
   end function parameter_range

end module scene_ranges
