!> What becomes of &statistics.
module scene_statistics
   use kinds, only: wp
   use name_table, only: table_t
   use number_text, only: to_text
   use quantities, only: quantity_named, ratio_of
   use run_settings, only: end_of_run
   use scene_input, only: scene_input_t
   use scene_types, only: scene_t
   use statistics_groups, only: physical_statistics_t
   use unit_ratios, only: take_ratio
   implicit none (type, external)
   private
   public :: resolve_statistics

contains

   !> Ratios, and what goes together; problems go into the input.
   subroutine resolve_statistics(input, table, physical, scene)
      type(scene_input_t), intent(inout) :: input
      !> Its names, read
      type(table_t), intent(in) :: table
      type(physical_statistics_t), intent(in) :: physical
      !> Its scales and its duration in
      type(scene_t), intent(inout) :: scene

      character(*), parameter :: group = 'statistics'
      real(wp) :: end

      associate (statistics => scene%statistics, omega1 => scene%scales%omega1)
         call take_ratio(input, table, group, 'start_time', physical%start_time*omega1, statistics%start)
         call take_ratio(input, table, group, 'end_time', physical%end_time*omega1, statistics%end)
         call take_ratio(input, table, group, 'rest_time', physical%rest_time*omega1, statistics%rest)
         if (input%has_problem()) return
         if (input%has(group, 'force_threshold')) call take_ratio(input, table, group, 'force_threshold', &
            ratio_of(quantity_named('force'), physical%force_threshold, scene%scales), statistics%threshold)
         end = end_of_run(scene%response)
         if (statistics%end < huge(statistics%end)) then
            if (statistics%end > end) call input%complain(group, 'end end_time', &
               'must be at most the end of the run, ' &
               //to_text(end)//' (tau)')
            end = statistics%end
         end if
         if (statistics%start >= end) call input%complain(group, 'start start_time', &
            'nothing is left to count: it must be before the end, '//to_text(end)//' (tau)')
      end associate
   end subroutine resolve_statistics

end module scene_statistics
