!> The names of &poincare.
module poincare_groups
   use kinds, only: wp
   use name_table, only: table_t
   use name_types, only: condition_t, group_t, name_t
   use run_settings, only: poincare_settings_t
   use scene_types, only: scene_t
   use value_rules, only: range_t
   implicit none (type, external)
   private
   public :: list_poincare

contains

   subroutine list_poincare(table, scene)
      class(table_t), intent(inout) :: table
      type(scene_t), intent(inout) :: scene

      call table%open(group_t('poincare'), scene%wants_poincare)
      if (table%is_open) call list_names(table, scene%poincare)
   end subroutine list_poincare

   subroutine list_names(table, poincare)
      class(table_t), intent(inout) :: table
      type(poincare_settings_t), intent(inout) :: poincare

      type(condition_t), parameter :: exact = condition_t(group='response', name='method', words='exact')
      real(wp) :: degrees, before

      degrees = 360.0_wp*poincare%phase
      before = degrees
      call table%bind(degrees, name_t('phase', 'where in the period of the load, degrees from tau = 0', &
         range_t(0.0_wp, 360.0_wp)))
      ! else a phase that nothing changes keeps its last digit
      if (abs(degrees - before) > 0.0_wp) poincare%phase = degrees/360.0_wp
      call table%bind(poincare%skip, name_t('skip', 'sections that are passed over', range_t(0, 10000000)))
      call table%bind(poincare%keep, name_t('keep', 'sections after them that are kept; without a duration ' &
         //'the run ends with the period of the last', range_t(1, 100000)))
      call table%bind(poincare%load, name_t('load', 'whose period counts: a number among the harmonic loads, ' &
         //'&force before &base; 0: that of all together', range_t(0, 1000)))
      call table%bind(poincare%most_periods, name_t('most_periods', 'longest period of the motion that is looked ' &
         //'for, in those of the load; half of what is kept at most', range_t(1, 10000)))
      call table%bind(poincare%tolerance, name_t('tolerance', 'how near a state must return to be the same, as a ' &
         //'share of the greatest', range_t(1.0e-14_wp, 0.1_wp)))
      call table%bind(poincare%wants_exponent, name_t('exponent', 'follow how motions that begin side by side part: ' &
         //'the greatest Lyapunov exponent', needs=exact))
      call table%bind(poincare%keeps_modes, name_t('modes', 'keep the state of all free modes too', needs=exact))
   end subroutine list_names

end module poincare_groups
