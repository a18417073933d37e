!> What becomes of &statistics.
module scene_statistics
   use kinds, only: wp
   use number_text, only: to_text
   use run_settings, only: end_of_run
   use scene_input, only: scene_input_t
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: resolve_statistics

contains

   !> What goes together; problems go into the input.
   subroutine resolve_statistics(input, scene)
      type(scene_input_t), intent(inout) :: input
      !> Its duration in
      type(scene_t), intent(inout) :: scene

      character(*), parameter :: group = 'statistics'
      real(wp) :: end

      associate (statistics => scene%statistics)
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
