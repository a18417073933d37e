!> What becomes of &orbit, and the period of the loads by which its motions return.
module scene_orbit
   use kinds, only: wp
   use load_periods, only: is_steady, period_of
   use load_settings, only: course_harmonic
   use number_text, only: to_text
   use orbit_settings, only: vary_nothing
   use run_settings, only: method_exact
   use scene_input, only: scene_input_t
   use scene_poincare, only: harmonic_frequencies
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: resolve_orbit

contains

   !> Loads that go on for ever, with a period; problems go into the input.
   subroutine resolve_orbit(input, scene)
      type(scene_input_t), intent(inout) :: input
      !> Its loads resolved in
      type(scene_t), intent(inout) :: scene

      character(*), parameter :: group = 'orbit'
      integer :: loads
      logical :: are_steady

      if (.not. scene%wants_orbit .or. input%has_problem()) return
      loads = size(harmonic_frequencies(scene))
      are_steady = .true.
      if (scene%has_forces) are_steady = all(is_steady(scene%forces%course))
      if (scene%has_bases) are_steady = are_steady .and. all(is_steady(scene%bases%course) .or. &
         abs(scene%bases%course%amplitude) <= 0.0_wp)
      associate (orbit => scene%orbit)
         if (scene%response%method /= method_exact) then
            call input%complain(group, '', "needs method = 'exact', which tells the derivative of a motion")
         else if (loads == 0) then
            call input%complain(group, '', "goes by the period of a load: needs &force or &base of kind = 'harmonic'")
         else if (.not. are_steady) then
            call input%complain(group, '', "needs loads that go on as they begin: of kind = 'harmonic' or 'step', " &
               //'from tau = 0 to the end')
         else if (orbit%varied /= vary_nothing .and. orbit%load > loads) then
            call input%complain(group, 'load', 'the scene has '//to_text(loads)//' harmonic loads')
         else if (orbit%varied /= vary_nothing .and. .not. orbit%lowest_ratio < orbit%greatest_ratio) then
            call input%complain(group, 'lowest_ratio greatest_ratio', 'nothing lies between them')
         else if (orbit%step > orbit%greatest_step) then
            call input%complain(group, 'step greatest_step', 'the first step must be at most the greatest')
         else if (orbit%varied /= vary_nothing) then
            if (vanishes(scene, orbit%load)) call input%complain(group, 'load', &
               'the load that is to vary has no amplitude')
         end if
         if (input%has_problem()) return
         orbit%period = period_of(harmonic_frequencies(scene), 0)
         if (orbit%period <= 0.0_wp) call input%complain(group, '', 'the harmonic loads have no period in common ' &
            //'within 64 periods of the slowest')
      end associate
   end subroutine resolve_orbit

   !> Is the amplitude of a harmonic load zero?
   pure function vanishes(scene, load) result(answer)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: load
      logical :: answer

      real(wp), allocatable :: amplitude(:)

      allocate (amplitude(0))
      if (scene%has_forces) amplitude = pack(scene%forces%course%amplitude, scene%forces%course%kind == course_harmonic)
      if (scene%has_bases) amplitude = [amplitude, pack(scene%bases%course%amplitude, &
         scene%bases%course%kind == course_harmonic .and. abs(scene%bases%course%amplitude) > 0.0_wp)]
      answer = .true.
      if (load <= size(amplitude)) answer = abs(amplitude(load)) <= 0.0_wp
   end function vanishes

end module scene_orbit
