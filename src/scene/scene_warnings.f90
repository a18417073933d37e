!> Warnings about a resolved scene whose values are allowed but implausible.
module scene_warnings
   use kinds, only: pi, wp
   use load_settings, only: start_release
   use number_text, only: rounded, to_text
   use quantities, only: quantity_named, system_none, unit_of, units_of, units_t
   use run_settings, only: side_both, stop_settings_t
   use scene_input, only: scene_input_t
   use scene_types, only: scene_t
   use warning_list, only: warning_frequency, warning_height, warning_position, warning_start, warning_t, warning_tau, &
      warning_twins
   implicit none (type, external)
   private
   public :: warn_of_scene

   !> Ratio of height to length beyond which shear, which the theory neglects, is not small.
   real(wp), parameter :: max_height_ratio = 0.2_wp
   !> Range of plausible first frequencies, Hz: from chimneys to microbeams.
   real(wp), parameter :: min_frequency = 0.01_wp, max_frequency = 1.0e7_wp
   !> Positions below this share of the length are rare, and lengths in m are often below.
   real(wp), parameter :: min_position = 0.05_wp

contains

   !> Find the warnings of a scene, except those that the scene silences.
   subroutine warn_of_scene(input, scene)
      type(scene_input_t), intent(in) :: input
      !> The resolved scene; gets its warnings
      type(scene_t), intent(inout) :: scene

      type(stop_settings_t), allocatable :: stops(:)

      if (allocated(scene%warnings)) deallocate (scene%warnings)
      allocate (scene%warnings(0), stops(0))
      if (.not. (scene%wants_response .or. scene%wants_frequencies)) return
      call warn_of_beam(input, scene)
      if (.not. scene%wants_response) return
      if (scene%has_stop) stops = [scene%stop]
      if (scene%has_stop .and. allocated(scene%more_stops)) stops = [stops, scene%more_stops]
      if (has_units(scene)) call warn_of_ratios(input, scene, stops)
      call warn_of_stops(input, scene, stops)
   end subroutine warn_of_scene

   !> Are the values of a scene in units?
   pure function has_units(scene) result(answer)
      type(scene_t), intent(in) :: scene
      logical :: answer

      answer = scene%unit_system > 0 .and. scene%unit_system /= system_none
   end function has_units

   !> Warn of a thick beam, and of an implausible first frequency.
   subroutine warn_of_beam(input, scene)
      type(scene_input_t), intent(in) :: input
      type(scene_t), intent(inout) :: scene

      real(wp) :: frequency

      if (scene%scales%height_ratio > max_height_ratio .and. input%has_group('beam')) call add(scene, warning_height, &
         'the height is '//rounded(scene%scales%height_ratio)//' of the length; the theory neglects shear, which ' &
         //'counts from '//rounded(max_height_ratio)//' on')
      if (.not. has_units(scene)) return
      frequency = scene%scales%omega1/(2.0_wp*pi)
      if (frequency < min_frequency .or. frequency > max_frequency) call add(scene, warning_frequency, &
         'the first frequency of the beam is '//rounded(frequency)//' Hz; are lengths, E and density in the units ' &
         //'of the scene?')
   end subroutine warn_of_beam

   !> Warn of dimensionless positions and times that may have been meant in units.
   subroutine warn_of_ratios(input, scene, stops)
      type(scene_input_t), intent(in) :: input
      type(scene_t), intent(inout) :: scene
      type(stop_settings_t), intent(in) :: stops(:)

      integer :: k

      do k = 1, size(stops)
         if (stops(k)%position >= min_position .or. stops(k)%position > scene%scales%length) cycle
         if (input%has('stop', 'position', k)) call add(scene, warning_position, 'position = ' &
            //rounded(stops(k)%position)//' of &stop number '//to_text(k) &
            //' is a share of the length; use position_length for a length')
      end do
      if (input%has('response', 'duration')) then
         call warn_of_tau('duration', scene%response%duration)
      else if (input%has('response', 'step')) then
         call warn_of_tau('step', scene%response%step)
      end if

   contains

      !> Tell what a name of &response for dimensionless time is in units.
      subroutine warn_of_tau(name, value)
         character(*), intent(in) :: name
         real(wp), intent(in) :: value

         type(units_t) :: units

         units = units_of(scene%scales, scene%unit_system, .true.)
         call add(scene, warning_tau, name//' = '//rounded(value)//' is omega1 t, which is ' &
            //rounded(value*units%factor(quantity_named('time')))//' '//trim(unit_of(quantity_named('time'), units)) &
            //'; '//name//'_time is a time')
      end subroutine warn_of_tau

   end subroutine warn_of_ratios

   !> Warn of identical stops, and of a release among stops on both sides that the file does not request.
   subroutine warn_of_stops(input, scene, stops)
      type(scene_input_t), intent(in) :: input
      type(scene_t), intent(inout) :: scene
      type(stop_settings_t), intent(in) :: stops(:)

      integer :: j, k

      if (size(stops) == 0) return
      ! a sweep may vary what the stops differ in
      do k = merge(size(stops) + 1, 2, scene%wants_sweep .or. scene%wants_cases), size(stops)
         do j = 1, k - 1
            if (are_identical(stops(j), stops(k))) call add(scene, warning_twins, '&stop number '//to_text(k) &
               //' is identical to &stop number '//to_text(j))
         end do
      end do
      if (scene%start%kind /= start_release .or. scene%has_start) return
      if (any([(input%has('stop', 'initial_height', k) .or. input%has('stop', 'pulled', k), k=1, size(stops))])) return
      if (all(stops%side == stops(1)%side) .and. stops(1)%side /= side_both) return
      call add(scene, warning_start, "the beam is released from a deflection; &start kind = 'rest' starts it at rest " &
         //'between the stops')
   end subroutine warn_of_stops

   !> Add a warning, unless the scene silences it.
   subroutine add(scene, kind, text)
      type(scene_t), intent(inout) :: scene
      !> One of the `warning_` constants
      integer, intent(in) :: kind
      character(*), intent(in) :: text

      if (allocated(scene%silent_warnings)) then
         if (any(scene%silent_warnings == kind)) return
      end if
      scene%warnings = [scene%warnings, warning_t(kind, text)]
   end subroutine add

   !> Do two stops have the same place, side and law?
   pure function are_identical(first, second) result(answer)
      type(stop_settings_t), intent(in) :: first
      type(stop_settings_t), intent(in) :: second
      logical :: answer

      answer = first%side == second%side .and. first%law == second%law .and. first%impulse == second%impulse .and. &
         all(abs(numbers(first) - numbers(second)) <= 0.0_wp)
   end function are_identical

   !> The numbers of a stop.
   pure function numbers(stop)
      type(stop_settings_t), intent(in) :: stop
      real(wp) :: numbers(6)

      numbers = [stop%position, stop%preload, stop%restitution, stop%stiffness_ratio, stop%branch_ratio, &
         stop%damper_ratio]
   end function numbers

end module scene_warnings
