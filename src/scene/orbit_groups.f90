!> The names of &orbit.
module orbit_groups
   use kinds, only: wp
   use name_table, only: table_t
   use name_types, only: condition_t, group_t, name_t
   use orbit_settings, only: orbit_settings_t, varied_names
   use poincare_groups, only: list_poincare
   use scene_types, only: scene_t
   use value_rules, only: range_t
   implicit none (type, external)
   private
   public :: list_periods

contains

   !> What goes by the periods of loads.
   subroutine list_periods(group, table, scene)
      !> 'poincare' or 'orbit'
      character(*), intent(in) :: group
      class(table_t), intent(inout) :: table
      type(scene_t), intent(inout) :: scene

      if (group == 'poincare') then
         call list_poincare(table, scene)
      else
         call table%open(group_t('orbit'), scene%wants_orbit)
         if (table%is_open) call list_names(table, scene%orbit)
      end if
   end subroutine list_periods

   subroutine list_names(table, orbit)
      class(table_t), intent(inout) :: table
      type(orbit_settings_t), intent(inout) :: orbit

      type(condition_t), parameter :: varied = condition_t(name='parameter', words='amplitude frequency')
      type(range_t), parameter :: step_range = range_t(0.0_wp, 1.0_wp, excludes_least=.true.)

      call table%bind(orbit%periods, name_t('periods', 'periods of the loads after which the motion returns; 0: ' &
         //'those that are found, 16 at most', range_t(0, 64)))
      call table%bind(orbit%skip, name_t('skip', 'periods that run before', range_t(1, 1000000)))
      call table%bind(orbit%tolerance, name_t('tolerance', 'by how much the motion may miss its start, as a share of ' &
         //'its size', range_t(1.0e-13_wp, 1.0e-3_wp)))
      call table%bind(orbit%most_steps, name_t('most_steps', "steps of Newton's method after which it fails", &
         range_t(1, 1000)))
      call table%bind(orbit%varied, name_t('parameter', 'what of a load varies along a branch of motions; with ' &
         //'frequency those of all loads in proportion'), varied_names)
      call table%bind(orbit%load, name_t('load', 'of which: a number among the harmonic loads, &force before &base', &
         range_t(1, 1000), needs=varied))
      call table%bind(orbit%lowest_ratio, name_t('lowest_ratio', 'least of it over what the load has', &
         range_t(1.0e-6_wp, 1.0_wp), needs=varied))
      call table%bind(orbit%greatest_ratio, name_t('greatest_ratio', 'greatest of it over what the load has', &
         range_t(1.0_wp, 1.0e6_wp), needs=varied))
      call table%bind(orbit%step, name_t('step', 'first step along a branch, as a share of the range and of the size ' &
         //'of the motion', step_range, needs=varied))
      call table%bind(orbit%greatest_step, name_t('greatest_step', 'the greatest', step_range, needs=varied))
      call table%bind(orbit%most_points, name_t('most_points', 'points of a branch to either side', &
         range_t(1, 100000), needs=varied))
      call table%bind(orbit%doublings, name_t('doublings', 'how often branches of twice the period leave others', &
         range_t(0, 6), needs=varied))
   end subroutine list_names

end module orbit_groups
