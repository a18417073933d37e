!> What becomes of &poincare, and the period by which its sections go.
module scene_poincare
   use kinds, only: wp
   use load_periods, only: period_of
   use load_settings, only: course_harmonic
   use number_text, only: to_text
   use run_settings, only: method_newmark, poincare_settings_t, response_settings_t
   use scene_input, only: scene_input_t
   use scene_types, only: scene_t
   use sweep_settings, only: is_swept
   implicit none (type, external)
   private
   public :: resolve_poincare, set_period, harmonic_frequencies

contains

   !> A period, and sections within the run; problems go into the input.
   subroutine resolve_poincare(input, scene)
      type(scene_input_t), intent(inout) :: input
      !> Its loads resolved in; the duration out, where it follows
      type(scene_t), intent(inout) :: scene

      character(*), parameter :: group = 'poincare'
      integer :: loads

      loads = size(harmonic_frequencies(scene))
      associate (poincare => scene%poincare, response => scene%response)
         if (loads == 0) then
            call input%complain(group, '', "goes by the period of a load: needs &force or &base of kind = 'harmonic'")
         else if (poincare%load > loads) then
            call input%complain(group, 'load', 'the scene has '//to_text(loads)//' harmonic loads')
         end if
         if (input%has_problem()) return
         poincare%sets_duration = .not. (input%has('response', 'duration') .or. input%has('response', 'duration_time'))
         if (scene%wants_sweep) poincare%sets_duration = poincare%sets_duration .and. .not. any(is_swept( &
            scene%sweep%swept) .and. scene%sweep%swept%parameter%group == 'response' .and. &
            (scene%sweep%swept%parameter%name_in_group == 'duration' .or. &
            scene%sweep%swept%parameter%name_in_group == 'duration_time'))
         call set_period(scene, poincare, response)
         if (poincare%period <= 0.0_wp) then
            call input%complain(group, 'load', 'the harmonic loads have no period in common within 64 periods of the ' &
               //'slowest: give load, the one whose period counts')
         else if (response%duration < poincare%period*(real(poincare%skip, wp) + first_part(poincare))) then
            call input%complain(group, 'skip', 'no section is left: the run of '//to_text(response%duration) &
               //' (tau) has '//to_text(int(response%duration/poincare%period))//' periods of the load')
         end if
      end associate
   end subroutine resolve_poincare

   !> When in its period the first section is: at tau = 0 there is none.
   pure function first_part(poincare) result(part)
      type(poincare_settings_t), intent(in) :: poincare
      real(wp) :: part

      part = modulo(poincare%phase, 1.0_wp)
      if (part <= 0.0_wp) part = 1.0_wp
   end function first_part

   !> The period of a scene's loads, and the duration that follows from it; Newmark's steps then divide it evenly.
   pure subroutine set_period(scene, poincare, response)
      type(scene_t), intent(in) :: scene
      type(poincare_settings_t), intent(inout) :: poincare
      type(response_settings_t), intent(inout) :: response

      poincare%period = period_of(harmonic_frequencies(scene), poincare%load)
      if (.not. poincare%sets_duration .or. poincare%period <= 0.0_wp) return
      response%duration = real(poincare%skip + poincare%keep, wp)*poincare%period
      if (response%method /= method_newmark .and. response%step <= poincare%period) return
      response%step = poincare%period/anint(max(1.0_wp, poincare%period/response%step + 0.4999_wp))
   end subroutine set_period

   !> Of all its harmonic loads, &force before &base.
   pure function harmonic_frequencies(scene) result(frequencies)
      type(scene_t), intent(in) :: scene
      real(wp), allocatable :: frequencies(:)

      allocate (frequencies(0))
      if (scene%has_forces) frequencies = pack(scene%forces%course%frequency, &
         scene%forces%course%kind == course_harmonic)
      ! a &base of gravity alone does not swing
      if (scene%has_bases) frequencies = [frequencies, pack(scene%bases%course%frequency, &
         scene%bases%course%kind == course_harmonic .and. .not. (scene%bases%gravity_ratio > 0.0_wp .and. &
         abs(scene%bases%course%amplitude) <= 0.0_wp))]
   end function harmonic_frequencies

end module scene_poincare
