!> Groups of a scene that request further results of a run: &statistics, &relay, &poincare, &orbit, &frequency_response
!> and &spectrum. Their names, checks and completion, and the period of the harmonic loads on which results are based.
module scene_requests
   use kinds, only: wp
   use load_settings, only: is_steady, period_of, course_harmonic
   use name_table, only: table_t
   use name_types, only: condition_t, group_t, in_units_t, name_t, duration_range, instant_range, range_t
   use number_text, only: rounded, to_text
   use orbit_settings, only: orbit_settings_t, varied_names, vary_frequency, vary_nothing
   use run_settings, only: end_of_run, method_exact, method_newmark, name_length, poincare_settings_t, &
      response_settings_t
   use scene_input, only: scene_input_t
   use scene_spectrum, only: instant_in_words, list_spectrum, resolve_spectrum
   use scene_types, only: base_group_t, scene_t
   use sweep_settings, only: is_swept
   implicit none (type, external)
   private
   public :: request_names, list_request, resolve_requests, resolve_statistics, set_period, harmonic_frequencies, &
      has_gravity_alone, harmonic_loads

   !> Names of the groups, each of which requires &response, in the order of the reference and the echo.
   character(*), parameter :: request_names(*) = [character(name_length) :: 'statistics', 'relay', 'poincare', &
      'orbit', 'frequency_response', 'spectrum']

contains

   !> List the names of one group in the table, and bind them to the components of the scene. Depending on the state of
   !> the table (module `name_table`), this creates the entries, or copies values from the scene or to it.
   subroutine list_request(group, table, scene)
      !> One of `request_names`
      character(*), intent(in) :: group
      class(table_t), intent(inout) :: table
      type(scene_t), intent(inout) :: scene

      select case (group)
      case ('statistics')
         call table%open(group_t(group), scene%wants_statistics)
         if (.not. table%lists_names) return
         associate (statistics => scene%statistics)
            call table%bind(statistics%start, name_t('start', &
               'start of the part that is evaluated, tau: after the initial transient', instant_range), &
               in_units_t('start_time', 'time', 'the same in time'))
            call table%bind(statistics%end, name_t('end', 'end of the part that is evaluated, tau', duration_range, &
               default='that of the run', is_optional=.true.), in_units_t('end_time', 'time', 'the same in time'))
            call table%bind(statistics%blocks, name_t('blocks', 'number of blocks of equal length: the half width of ' &
               //'the 95 % interval of a value follows from the scatter of its values in the blocks; 1: no intervals', &
               range_t(1, 10000)))
            call table%bind(statistics%rest, name_t('rest', 'contacts that follow each other after a shorter time, ' &
               //'tau, count as one impact, as after a flight below hop_tolerance; 0: each counts', instant_range), &
               in_units_t('rest_time', 'time', 'the same in time'))
            call table%bind(statistics%threshold, name_t('threshold_ratio', 'Pbar that a contact with a compliant ' &
               //'stop must reach to be an impact', range_t(0.0_wp, 1.0e12_wp)), &
               in_units_t('force_threshold', 'force', 'the same as a force'))
            call table%bind(statistics%classes, &
               name_t('classes', 'classes of the histogram of impacts', range_t(1, 10000)))
            call table%bind(statistics%acceleration, &
               name_t('acceleration', 'RMS and extremes of the accelerations of stops and tip too'))
         end associate
      case ('relay')
         call table%open(group_t(group), scene%wants_relay)
         if (.not. table%lists_names) return
         associate (relay => scene%relay)
            call table%bind(relay%lasting_force, name_t('lasting_force_ratio', 'Pbar; measure force_lasts is the ' &
               //'instant from which the contact force stays at least as large', range_t(0.0_wp, 1.0e12_wp), &
               default='none', is_optional=.true.), in_units_t('lasting_force', 'force', 'the same as a force'))
            call table%bind(relay%shortest_opening, name_t('shortest_opening', 'openings of the contact that are ' &
               //'shorter, tau, are no bounces: the contact counts as closed meanwhile', instant_range), &
               in_units_t('shortest_opening_time', 'time', 'the same in time'))
         end associate
      case ('poincare')
         call table%open(group_t(group), scene%wants_poincare)
         if (table%lists_names) call list_poincare(table, scene%poincare)
      case ('orbit')
         call table%open(group_t(group), scene%wants_orbit)
         if (table%lists_names) call list_orbit(table, scene%orbit)
      case ('frequency_response')
         call table%open(group_t(group), scene%wants_frequency_response)
         if (.not. table%lists_names) return
         associate (settings => scene%frequency_response)
            call table%bind(settings%range, name_t('frequency_ratio_range', 'minimum and maximum circular frequency ' &
               //'of the harmonic loads, over omega1', range_t(0.0_wp, 1.0e6_wp, excludes_minimum=.true.), &
               default='none: give one'), &
               in_units_t('frequency_range', 'frequency', 'the same in cycles per unit of time'))
            call table%bind(settings%points, &
               name_t('points', 'number of frequencies in this range', range_t(2, 1000000)))
            call table%bind(settings%is_logarithmic, name_t('logarithmic', 'distribute the frequencies evenly on a ' &
               //'logarithmic scale'))
         end associate
      case ('spectrum')
         call table%open(group_t(group), scene%wants_spectrum)
         if (table%lists_names) call list_spectrum(table, scene%spectrum)
      end select
   end subroutine list_request

   !> Check and complete the requests, except statistics, which are resolved later because they depend on the duration.
   !> Problems are reported to `input`.
   subroutine resolve_requests(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> Scene with resolved loads
      type(scene_t), intent(inout) :: scene

      if (scene%wants_poincare .and. .not. input%has_problem()) call resolve_poincare(input, table, scene)
      if (scene%wants_orbit .and. .not. input%has_problem()) call resolve_orbit(input, scene)
      if (scene%wants_frequency_response .and. .not. input%has_problem()) call resolve_frequency_response(input, scene)
      if (scene%wants_spectrum .and. .not. input%has_problem()) call resolve_spectrum(input, scene)
   end subroutine resolve_requests

   !> Check that the interval of &statistics is within the run. Problems are reported to `input`.
   subroutine resolve_statistics(input, scene)
      type(scene_input_t), intent(inout) :: input
      !> Scene with known duration
      type(scene_t), intent(inout) :: scene

      character(*), parameter :: group = 'statistics'
      ! end of the part that is evaluated, tau
      real(wp) :: end

      associate (statistics => scene%statistics, end_of_motion => end_of_run(scene%response))
         end = end_of_motion
         if (statistics%end < huge(statistics%end)) then
            if (statistics%end > end_of_motion) call input%complain(group, 'end end_time', &
               'must be at most the end of the run, '//instant_in_words(input, scene, group, 'end_time', end_of_motion))
            end = statistics%end
         end if
         if (statistics%start >= end) call input%complain(group, 'start start_time', &
            'nothing is left to count: it must be before the end, ' &
            //instant_in_words(input, scene, group, 'start_time', end))
      end associate
   end subroutine resolve_statistics

   !> List the names of &poincare in the table, and bind them to the components of the scene.
   subroutine list_poincare(table, poincare)
      class(table_t), intent(inout) :: table
      type(poincare_settings_t), intent(inout) :: poincare

      type(condition_t), parameter :: exact = condition_t(group='response', name='method', words='exact')
      real(wp) :: degrees, given_degrees

      degrees = 360.0_wp*poincare%phase
      given_degrees = degrees
      call table%bind(degrees, name_t('phase', 'phase of the sections in the period, degrees from tau = 0', &
         range_t(0.0_wp, 360.0_wp)))
      ! `bind` may have copied a value of the table to `degrees`; an unchanged value is not converted back, because
      ! rounding would change the last digit of the phase
      if (abs(degrees - given_degrees) > 0.0_wp) poincare%phase = degrees/360.0_wp
      call table%bind(poincare%skip, name_t('skip', 'number of sections omitted at first', range_t(0, 10000000)))
      call table%bind(poincare%keep, name_t('keep', 'number of sections stored after them; without a duration ' &
         //'the run ends with the period of the last', range_t(1, 100000)))
      call table%bind(poincare%load, name_t('load', 'number of the harmonic load that gives the period, ' &
         //'&force before &base; 0: all, by their common period', range_t(0, 1000)))
      call table%bind(poincare%max_periods, name_t('most_periods', 'maximum period of the motion that is ' &
         //'sought, in periods of the load; at most half of keep', range_t(1, 10000)))
      call table%bind(poincare%tolerance, name_t('tolerance', 'how near a state must return to be the same, as a ' &
         //'share of the maximum', range_t(1.0e-14_wp, 0.1_wp)))
      call table%bind(poincare%wants_exponent, name_t('exponent', 'compute the maximum Lyapunov exponent', needs=exact))
      call table%bind(poincare%records_modes, name_t('modes', 'store the state of all free modes too', &
         needs=exact))
   end subroutine list_poincare

   !> Find the period of the loads, and check that there are Poincare sections within the run. Problems are reported to
   !> `input`.
   subroutine resolve_poincare(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      !> Table of names with the values of the file
      type(table_t), intent(in) :: table
      !> On entry loads are resolved; on return with the duration if it follows from the number of Poincare sections
      type(scene_t), intent(inout) :: scene

      character(*), parameter :: group = 'poincare'
      ! phase of the first section as a fraction of the period, above 0 and at most 1, because there is no section at
      ! tau = 0
      real(wp) :: first_phase
      integer :: loads

      loads = size(harmonic_frequencies(scene))
      associate (poincare => scene%poincare, response => scene%response)
         if (loads == 0) then
            call input%complain(group, '', 'is based on the period of a load: ' &
               //"needs &force or &base of kind = 'harmonic'")
         else if (poincare%load > loads) then
            call input%complain(group, 'load', 'the scene has '//to_text(loads)//' harmonic loads')
         end if
         if (input%has_problem()) return
         poincare%sets_duration = .not. table%has_either('response', 'duration')
         if (scene%wants_sweep) poincare%sets_duration = poincare%sets_duration .and. .not. any(is_swept( &
            scene%sweep%swept) .and. scene%sweep%swept%parameter%group == 'response' .and. &
            (scene%sweep%swept%parameter%name_in_group == 'duration' .or. &
            scene%sweep%swept%parameter%name_in_group == 'duration_time'))
         call set_period(scene, poincare, response)
         first_phase = modulo(poincare%phase, 1.0_wp)
         if (first_phase <= 0.0_wp) first_phase = 1.0_wp
         if (poincare%period <= 0.0_wp) then
            call input%complain(group, 'load', 'the harmonic loads have no period in common within 64 periods of the ' &
               //'slowest: give load, the one that gives the period')
         else if (response%duration < poincare%period*(real(poincare%skip, wp) + first_phase)) then
            call input%complain(group, 'skip', 'no section is left: the run of '//to_text(response%duration) &
               //' (tau) has '//to_text(int(response%duration/poincare%period))//' periods of the load')
         else if (poincare%sets_duration) then
            call check_length(input, group, 'skip keep', response%duration)
         end if
      end associate
   end subroutine resolve_poincare

   !> Refuse a number of load periods that lasts longer than a run may.
   subroutine check_length(input, group, names, length)
      type(scene_input_t), intent(inout) :: input
      !> Group that requests the periods
      character(*), intent(in) :: group
      !> Names of the group that give their number
      character(*), intent(in) :: names
      !> Duration of the periods, tau
      real(wp), intent(in) :: length

      if (length > duration_range%maximum) call input%complain(group, names, 'the periods of the load last '// &
         rounded(length)//' (tau): at most '//to_text(duration_range%maximum)//' are computed')
   end subroutine check_length

   !> Find the period of the load that &poincare chooses, or the common period of all loads, and the duration of the run
   !> if it follows from the number of Poincare sections. In that case Newmark's step, or any step longer than the
   !> period, is adjusted so that the period is a whole number of steps.
   pure subroutine set_period(scene, poincare, response)
      type(scene_t), intent(in) :: scene
      type(poincare_settings_t), intent(inout) :: poincare
      type(response_settings_t), intent(inout) :: response

      poincare%period = period_of(harmonic_frequencies(scene), poincare%load)
      if (.not. poincare%sets_duration .or. poincare%period <= 0.0_wp) return
      response%duration = real(poincare%skip + poincare%keep, wp)*poincare%period
      if (response%method /= method_newmark .and. response%step <= poincare%period) return
      ! the number of steps is rounded up, unless it is at most 1e-4 above a whole number
      response%step = poincare%period/anint(max(1.0_wp, poincare%period/response%step + 0.4999_wp))
   end subroutine set_period

   !> Frequencies of all harmonic loads over omega1, &force before &base.
   pure function harmonic_frequencies(scene) result(frequencies)
      type(scene_t), intent(in) :: scene
      real(wp), allocatable :: frequencies(:)

      allocate (frequencies(0))
      if (scene%has_forces) frequencies = scene%forces%course%frequency
      if (scene%has_bases) frequencies = [frequencies, scene%bases%course%frequency]
      frequencies = frequencies(harmonic_loads(scene))
   end function harmonic_frequencies

   !> Places of the harmonic loads among all &force groups, followed by all &base groups. A &base with gravity alone is
   !> not among them.
   pure function harmonic_loads(scene) result(places)
      type(scene_t), intent(in) :: scene
      integer, allocatable :: places(:)

      logical, allocatable :: is_harmonic(:)
      integer :: i

      allocate (is_harmonic(0))
      if (scene%has_forces) is_harmonic = scene%forces%course%kind == course_harmonic
      if (scene%has_bases) is_harmonic = [is_harmonic, scene%bases%course%kind == course_harmonic .and. &
         .not. has_gravity_alone(scene%bases)]
      places = pack([(i, i=1, size(is_harmonic))], is_harmonic)
   end function harmonic_loads

   !> Whether a &base has gravity and no motion. A &base without gravity is a load even with the amplitude 0, from which
   !> a sweep of the amplitude may begin.
   elemental logical function has_gravity_alone(base) result(answer)
      type(base_group_t), intent(in) :: base

      answer = base%gravity_ratio > 0.0_wp .and. .not. abs(base%course%amplitude) > 0.0_wp
   end function has_gravity_alone

   !> List the names of &orbit in the table, and bind them to the components of the scene.
   subroutine list_orbit(table, orbit)
      class(table_t), intent(inout) :: table
      type(orbit_settings_t), intent(inout) :: orbit

      type(condition_t), parameter :: varied = condition_t(name='parameter', words='amplitude frequency')
      type(range_t), parameter :: step_range = range_t(0.0_wp, 1.0_wp, excludes_minimum=.true.)

      call table%bind(orbit%periods, name_t('periods', 'periods of the loads after which the motion returns; 0: ' &
         //'those that are found, 16 at most', range_t(0, 64)))
      call table%bind(orbit%skip, name_t('skip', 'periods computed before the search', range_t(1, 1000000)))
      call table%bind(orbit%tolerance, name_t('tolerance', 'maximum difference of the end from the start, as a share ' &
         //'of the size of the motion', range_t(1.0e-13_wp, 1.0e-3_wp)))
      call table%bind(orbit%max_steps, name_t('most_steps', "steps of Newton's method after which it fails", &
         range_t(1, 1000)))
      call table%bind(orbit%varied, name_t('parameter', 'quantity of a load that varies along a branch of motions; ' &
         //'the frequency varies with those of all other loads in proportion'), varied_names)
      call table%bind(orbit%load, name_t('load', 'number of the harmonic load whose quantity varies, &force ' &
         //'before &base', range_t(1, 1000), needs=varied))
      call table%bind(orbit%min_ratio, name_t('lowest_ratio', 'minimum of this quantity over its value in ' &
         //'the scene', range_t(1.0e-6_wp, 1.0_wp), needs=varied))
      call table%bind(orbit%max_ratio, name_t('greatest_ratio', 'maximum of this quantity over its value in the ' &
         //'scene', range_t(1.0_wp, 1.0e6_wp), needs=varied))
      call table%bind(orbit%step, name_t('step', 'first step along a branch: its arc length, with the ' &
         //'quantity divided by its range and the state by the size of the motion', step_range, needs=varied))
      call table%bind(orbit%max_step, name_t('greatest_step', 'the maximum step', step_range, needs=varied))
      call table%bind(orbit%max_points, name_t('most_points', 'points of a branch to either side', &
         range_t(1, 100000), needs=varied))
      call table%bind(orbit%doublings, name_t('doublings', 'number of successive period doublings that are followed', &
         range_t(0, 6), needs=varied))
   end subroutine list_orbit

   !> Check &orbit: it requires loads that act from tau = 0 without end and have a common period. Problems are reported
   !> to `input`.
   subroutine resolve_orbit(input, scene)
      type(scene_input_t), intent(inout) :: input
      !> Scene with resolved loads
      type(scene_t), intent(inout) :: scene

      character(*), parameter :: group = 'orbit'
      ! amplitudes of all loads, and places of the harmonic loads among them
      real(wp), allocatable :: amplitude(:)
      integer, allocatable :: places(:)
      integer :: loads
      logical :: are_steady

      loads = size(harmonic_frequencies(scene))
      are_steady = .true.
      if (scene%has_forces) are_steady = all(is_steady(scene%forces%course))
      if (scene%has_bases) are_steady = are_steady .and. all(is_steady(scene%bases%course) .or. &
         abs(scene%bases%course%amplitude) <= 0.0_wp)
      associate (orbit => scene%orbit)
         if (scene%response%method /= method_exact) then
            call input%complain(group, '', "needs method = 'exact', which gives the derivative of a motion")
         else if (loads == 0) then
            call input%complain(group, '', 'is based on the period of a load: ' &
               //"needs &force or &base of kind = 'harmonic'")
         else if (.not. are_steady) then
            call input%complain(group, '', "needs loads that do not change their course: of kind = 'harmonic' or " &
               //"'step', from tau = 0 to the end")
         else if (orbit%varied /= vary_nothing .and. orbit%load > loads) then
            call input%complain(group, 'load', 'the scene has '//to_text(loads)//' harmonic loads')
         else if (orbit%varied /= vary_nothing .and. .not. orbit%min_ratio < orbit%max_ratio) then
            call input%complain(group, 'lowest_ratio greatest_ratio', 'nothing lies between them')
         else if (orbit%step > orbit%max_step) then
            call input%complain(group, 'step greatest_step', 'the first step must be at most the maximum')
         else if (orbit%varied /= vary_nothing) then
            amplitude = spread(0.0_wp, 1, 0)
            if (scene%has_forces) amplitude = scene%forces%course%amplitude
            if (scene%has_bases) amplitude = [amplitude, scene%bases%course%amplitude]
            places = harmonic_loads(scene)
            if (abs(amplitude(places(orbit%load))) <= 0.0_wp) call input%complain(group, 'load', &
               'the load that is to vary has no amplitude')
         end if
         if (input%has_problem()) return
         orbit%period = period_of(harmonic_frequencies(scene), 0)
         if (orbit%period <= 0.0_wp) call input%complain(group, '', 'the harmonic loads have no period in common ' &
            //'within 64 periods of the slowest')
         ! along a branch, the period is longest at the minimum of the frequency. If the number of periods is sought
         ! (periods = 0), it is 1 or more
         call check_length(input, group, 'skip periods lowest_ratio', orbit%period*max(real(orbit%skip, wp), &
            real(max(orbit%periods, 1), wp)/merge(orbit%min_ratio, 1.0_wp, orbit%varied == vary_frequency)))
      end associate
   end subroutine resolve_orbit

   !> Check &frequency_response: it requires a range of frequencies and harmonic loads. Problems are reported to
   !> `input`.
   subroutine resolve_frequency_response(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(inout) :: scene

      character(*), parameter :: group = 'frequency_response', name = 'frequency_ratio_range frequency_range'

      associate (settings => scene%frequency_response)
         if (size(harmonic_frequencies(scene)) == 0) then
            call input%complain(group, '', "needs an excitation: &force or &base of kind = 'harmonic'")
         else if (.not. allocated(settings%range)) then
            call input%complain(group, '', 'needs frequency_ratio_range or frequency_range')
         else if (size(settings%range) /= 2) then
            call input%complain(group, name, 'takes two values, the minimum and the maximum')
         else if (.not. (settings%range(1) > 0.0_wp .and. settings%range(2) > settings%range(1))) then
            call input%complain(group, name, 'the first value must be above 0 and less than the second')
         end if
      end associate
   end subroutine resolve_frequency_response

end module scene_requests
