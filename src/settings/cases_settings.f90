!> Several cases of one scene.
module cases_settings
   use kinds, only: wp
   use sweep_settings, only: parameter_branch, parameter_damper, parameter_names, parameter_position, parameter_preload, &
      parameter_restitution, parameter_stiffness, parameter_taper, parameter_tip_mass, parameter_zeta
   implicit none (type, external)
   private
   public :: cases_settings_t, case_parameters, case_parameter_names

   !> What may differ from case to case, among the parameters of a sweep.
   integer, parameter :: case_parameters(9) = [parameter_preload, parameter_restitution, parameter_position, parameter_zeta, &
      parameter_tip_mass, parameter_taper, parameter_stiffness, parameter_branch, parameter_damper]
   character(*), parameter :: case_parameter_names(size(case_parameters)) = parameter_names(case_parameters)

   !> &cases: one scene, run for several values of one parameter, histories kept
   type :: cases_settings_t
      !> Which of `case_parameters`; 0: not given
      integer :: choice = 0
      !> Its values, one case each
      real(wp), allocatable :: values(:)
   end type cases_settings_t

end module cases_settings
