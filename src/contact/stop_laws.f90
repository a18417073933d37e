!> Contact laws of the stops as the run settings select them: rigid with a coefficient of restitution, or compliant.
module stop_laws
   use compliant_stop, only: compliant_stop_t
   use kinds, only: lambda1_power4, wp
   use run_settings, only: law_restitution, law_spring_damper, law_three_element, stop_settings_t
   use spring_damper_stop, only: make_spring_damper
   use three_element_stop, only: make_three_element
   implicit none (type, external)
   private
   public :: is_rigid, static_stiffness, make_compliant_stop

contains

   !> Whether the stop is rigid, so that impulses act on the beam.
   elemental logical function is_rigid(settings) result(answer)
      type(stop_settings_t), intent(in) :: settings

      answer = settings%law == law_restitution
   end function is_rigid

   !> Static stiffness k in lambda1^4 E Ibar/L^3, the force per unit of constant indentation; 0: the stop is rigid. The
   !> ratio of the settings is in 3 E Ibar/L^3.
   elemental real(wp) function static_stiffness(settings) result(stiffness)
      type(stop_settings_t), intent(in) :: settings

      stiffness = 0.0_wp
      if (.not. is_rigid(settings)) stiffness = 3.0_wp*settings%stiffness_ratio/lambda1_power4
   end function static_stiffness

   !> Make the law of a compliant stop.
   subroutine make_compliant_stop(settings, stop)
      type(stop_settings_t), intent(in) :: settings
      !> Unallocated if the stop is rigid
      class(compliant_stop_t), allocatable, intent(out) :: stop

      select case (settings%law)
      case (law_three_element)
         allocate (stop, source=make_three_element(settings%stiffness_ratio, settings%branch_ratio, &
            settings%damper_ratio))
      case (law_spring_damper)
         allocate (stop, source=make_spring_damper(settings%stiffness_ratio, settings%damper_ratio))
      end select
   end subroutine make_compliant_stop

end module stop_laws
