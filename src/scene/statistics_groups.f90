!> The names of &statistics.
module statistics_groups
   use kinds, only: wp
   use name_table, only: table_t
   use name_types, only: group_t, name_t
   use run_settings, only: statistics_settings_t
   use scene_types, only: scene_t
   use value_rules, only: physical_range, range_t
   implicit none (type, external)
   private
   public :: list_statistics

contains

   subroutine list_statistics(table, scene)
      class(table_t), intent(inout) :: table
      type(scene_t), intent(inout) :: scene

      call table%open(group_t('statistics'), scene%wants_statistics)
      if (table%is_open) call list_names(table, scene%statistics)
   end subroutine list_statistics

   subroutine list_names(table, statistics)
      class(table_t), intent(inout) :: table
      type(statistics_settings_t), intent(inout) :: statistics

      type(range_t), parameter :: instant_range = range_t(0.0_wp, 1.0e9_wp)
      real(wp) :: last

      call table%bind(statistics%start, name_t('start', 'instant from which on the run counts, tau', instant_range))
      call table%keep(name_t('start_time', 'the same in time', physical_range, &
         instead_of='start', quantity='time'))
      last = 0.0_wp
      if (statistics%end < huge(statistics%end)) last = statistics%end
      call table%bind(last, name_t('end', 'instant up to which it counts, tau', &
         range_t(0.0_wp, 1.0e9_wp, excludes_least=.true.), default='that of the run', is_optional=.true.))
      if (last > 0.0_wp) statistics%end = last
      call table%keep(name_t('end_time', 'the same in time', physical_range, instead_of='end', &
         quantity='time'))
      call table%bind(statistics%blocks, name_t('blocks', 'blocks of equal length, from whose differences the error ' &
         //'bars follow; 1: there are none', range_t(1, 10000)))
      call table%bind(statistics%rest, name_t('rest', 'a meeting is an impact of its own if since the end of the one ' &
         //'before more than this has passed, tau, and the beam has risen above hop_tolerance', instant_range))
      call table%keep(name_t('rest_time', 'the same in time', physical_range, &
         instead_of='rest', quantity='time'))
      call table%bind(statistics%threshold, name_t('threshold_ratio', 'Pbar that a meeting with a stop that yields ' &
         //'must reach to be an impact', range_t(0.0_wp, 1.0e12_wp)))
      call table%keep(name_t('force_threshold', 'the same as a force', physical_range, &
         instead_of='threshold_ratio', quantity='force'))
      call table%bind(statistics%classes, name_t('classes', 'classes of the histogram of impacts', range_t(1, 10000)))
   end subroutine list_names

end module statistics_groups
