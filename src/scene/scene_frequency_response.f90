!> What becomes of &frequency_response.
module scene_frequency_response
   use kinds, only: wp
   use scene_input, only: scene_input_t
   use scene_poincare, only: harmonic_frequencies
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: resolve_frequency_response

contains

   !> A range, and what shakes the beam; problems go into the input.
   subroutine resolve_frequency_response(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(inout) :: scene

      character(*), parameter :: group = 'frequency_response', name = 'frequency_ratio_range frequency_range'

      associate (response => scene%frequency_response)
         if (size(harmonic_frequencies(scene)) == 0) then
            call input%complain(group, '', "needs what shakes the beam: &force or &base of kind = 'harmonic'")
         else if (.not. allocated(response%range)) then
            call input%complain(group, '', 'needs frequency_ratio_range or frequency_range')
         else if (size(response%range) /= 2) then
            call input%complain(group, name, 'takes two values, the least and the greatest')
         else if (.not. (response%range(1) > 0.0_wp .and. response%range(2) > response%range(1))) then
            call input%complain(group, name, 'the first value must be above 0 and less than the second')
         end if
      end associate
   end subroutine resolve_frequency_response

end module scene_frequency_response
