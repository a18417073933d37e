!> Warnings about a resolved scene whose values are allowed but implausible.
module scene_warnings
   use kinds, only: pi, wp
   use load_settings, only: base_displacement, course_table, start_release, time_course_t
   use measure_list, only: former_names, formerly_named, measure_force, measure_table
   use namelist_text, only: item_name, value_text
   use namelist_tokens, only: lower_case
   use number_text, only: rounded, to_text
   use quantities, only: quantity_named, system_names, system_none, unit_of, units_of, units_t
   use run_settings, only: side_both, sort_keys, stop_settings_t
   use scene_input, only: scene_input_t
   use scene_types, only: all_stops, has_rigid_stops, scene_t
   use warning_list, only: warning_first_frequency, warning_thick_beam, warning_former_name, warning_position_ratio, &
      warning_default_start, &
      warning_youngs_modulus, warning_t, warning_dimensionless_time, warning_identical_stops, warning_table_end
   implicit none (type, external)
   private
   public :: add_warning, warn_of_scene, words_of_frequency

   !> Ratio of height to length beyond which shear, which the theory neglects, is not small.
   real(wp), parameter :: max_height_ratio = 0.2_wp
   !> Minimum plausible first frequency, Hz: that of chimneys.
   real(wp), parameter :: min_frequency = 0.01_wp
   !> Maximum plausible first frequency, Hz: that of microbeams.
   real(wp), parameter :: max_frequency = 1.0e7_wp
   !> Minimum plausible Young's modulus, Pa: that of rubber.
   real(wp), parameter :: min_modulus = 1.0e5_wp
   !> Maximum plausible Young's modulus, Pa: that of diamond.
   real(wp), parameter :: max_modulus = 2.0e12_wp
   !> Minimum position x/L without a warning; a smaller number may be a length in m.
   real(wp), parameter :: min_position = 0.05_wp

contains

   !> Find the warnings of a scene, except those that the scene silences.
   subroutine warn_of_scene(input, scene)
      type(scene_input_t), intent(in) :: input
      !> The resolved scene; gets its warnings
      type(scene_t), intent(inout) :: scene

      type(stop_settings_t), allocatable :: stops(:)

      if (allocated(scene%warnings)) deallocate (scene%warnings)
      allocate (scene%warnings(0))
      if (.not. (scene%wants_response .or. scene%wants_frequencies)) return
      call warn_of_names(input, scene)
      call warn_of_beam(input, scene)
      if (.not. scene%wants_response) return
      allocate (stops, source=all_stops(scene))
      if (has_units(scene)) call warn_of_ratios(input, scene, stops)
      call warn_of_stops(input, scene, stops)
      call warn_of_tables(scene)
   end subroutine warn_of_scene

   !> Whether the values of a scene are in units.
   pure logical function has_units(scene) result(answer)
      type(scene_t), intent(in) :: scene

      answer = scene%unit_system > 0 .and. scene%unit_system /= system_none
   end function has_units

   !> Warn of a thick beam, and of an implausible first frequency.
   subroutine warn_of_beam(input, scene)
      type(scene_input_t), intent(in) :: input
      type(scene_t), intent(inout) :: scene

      real(wp) :: frequency, modulus

      if (scene%scales%height_ratio > max_height_ratio .and. input%has_group('beam')) call add_warning(scene, &
         warning_thick_beam, 'the height is '//rounded(scene%scales%height_ratio)//' of the length; the ' &
         //'theory neglects shear, which counts from '//rounded(max_height_ratio)//' on')
      if (.not. has_units(scene)) return
      ! MPa in the system of mm, tonnes and s
      modulus = scene%beam%youngs_modulus*merge(1.0e6_wp, 1.0_wp, system_names(scene%unit_system) == 'mm_t_s')
      if (modulus < min_modulus .or. modulus > max_modulus) call add_warning(scene, warning_youngs_modulus, &
         'youngs_modulus = '//to_text(scene%beam%youngs_modulus)//' is '//rounded(modulus)//' Pa, ' &
         //trim(merge('softer than rubber  ', 'stiffer than diamond', modulus < min_modulus))//'; is it in GPa?')
      frequency = scene%scales%omega1/(2.0_wp*pi)
      if (frequency < min_frequency .or. frequency > max_frequency) call add_warning(scene, warning_first_frequency, &
         words_of_frequency(scene))
   end subroutine warn_of_beam

   !> The first frequency of the beam and the values from which it follows, as the file gives them.
   pure function words_of_frequency(scene) result(words)
      !> A scene in units
      type(scene_t), intent(in) :: scene
      character(:), allocatable :: words

      associate (beam => scene%beam)
         words = 'with length = '//to_text(beam%length)//', youngs_modulus = '//to_text(beam%youngs_modulus) &
            //' and density = '//to_text(beam%density)//' the first frequency of the beam is ' &
            //rounded(scene%scales%omega1/(2.0_wp*pi))//" Hz; are they in the units of the scene, '" &
            //trim(system_names(scene%unit_system))//"'?"
      end associate
   end function words_of_frequency

   !> Warn of former names of measures, and of a measure that a rigid stop does not have.
   subroutine warn_of_names(input, scene)
      type(scene_input_t), intent(in) :: input
      type(scene_t), intent(inout) :: scene

      integer :: i, k, place

      associate (namelist => input%namelist)
         do i = 1, namelist%item_count
            if (index(item_name(namelist, i), 'measure') /= 1) cycle
            do k = namelist%items(i)%first_value, namelist%items(i)%last_value
               do place = size(former_names), 1, -1
                  if (lower_case(value_text(namelist, k)) == former_names(place)) exit
               end do
               if (lower_case(value_text(namelist, k)) == measure_table(measure_force)%name .and. &
                  has_rigid_stops(scene)) call add_warning(scene, warning_former_name, &
                  'a rigid stop has no greatest_force, because an impact is an impulse: greatest_mean_force is the ' &
                  //'mean over the first 0.1/omega1 of an episode')
               if (place > 0) call add_warning(scene, warning_former_name, "the measure '"//trim(former_names(place)) &
                  //"' is called '"//trim(measure_table(formerly_named(place))%name)//"' now")
            end do
         end do
      end associate
   end subroutine warn_of_names

   !> Warn of dimensionless positions and times that may have been meant in units.
   subroutine warn_of_ratios(input, scene, stops)
      type(scene_input_t), intent(in) :: input
      type(scene_t), intent(inout) :: scene
      type(stop_settings_t), intent(in) :: stops(:)

      integer :: k

      do k = 1, size(stops)
         ! a number beyond the length of the beam cannot have been meant as a length
         if (stops(k)%position >= min_position .or. stops(k)%position > scene%scales%length) cycle
         if (input%has('stop', 'position', k)) call add_warning(scene, warning_position_ratio, 'position = ' &
            //rounded(stops(k)%position)//' of &stop number '//to_text(k) &
            //' is a share of the length; use position_length for a length')
      end do
      if (input%has('response', 'duration')) then
         call warn_of_tau('duration', scene%response%duration)
      else if (input%has('response', 'step')) then
         call warn_of_tau('step', scene%response%step)
      end if
      if (.not. input%has('response', 'duration')) then
         if (input%has('statistics', 'start')) call warn_of_tau('start', scene%statistics%start, '&statistics ')
         if (input%has('spectrum', 'start')) call warn_of_tau('start', scene%spectrum%start, '&spectrum ')
      end if

   contains

      !> Warn that a name takes a dimensionless time, and give this time in units.
      subroutine warn_of_tau(name, value, group)
         character(*), intent(in) :: name
         real(wp), intent(in) :: value
         !> Name of the group, with & and a blank; absent: &response
         character(*), intent(in), optional :: group

         character(:), allocatable :: place
         type(units_t) :: units

         if (value <= 0.0_wp) return
         place = ''
         if (present(group)) place = group
         units = units_of(scene%scales, scene%unit_system, .true.)
         call add_warning(scene, warning_dimensionless_time, place//name//' = '//rounded(value) &
            //' is omega1 t, which is '//rounded(value*units%factor(quantity_named('time')))//' ' &
            //trim(unit_of(quantity_named('time'), units))//'; '//name//'_time is a time')
      end subroutine warn_of_tau

   end subroutine warn_of_ratios

   !> Warn of identical stops, and of a release among stops on both sides that the file does not request.
   subroutine warn_of_stops(input, scene, stops)
      type(scene_input_t), intent(in) :: input
      type(scene_t), intent(inout) :: scene
      type(stop_settings_t), intent(in) :: stops(:)

      integer :: j, k

      if (size(stops) == 0) return
      ! the cases of a sweep may have different stops
      do k = merge(size(stops) + 1, 2, scene%wants_sweep .or. scene%wants_cases), size(stops)
         do j = 1, k - 1
            if (any(abs(sort_keys(stops(j)) - sort_keys(stops(k))) > 0.0_wp)) cycle
            call add_warning(scene, warning_identical_stops, '&stop number '//to_text(k) &
               //' is identical to &stop number '//to_text(j))
         end do
      end do
      if (scene%start%kind /= start_release .or. scene%has_start) return
      if (any([(input%has('stop', 'initial_height', k) .or. input%has('stop', 'pulled', k), k=1, size(stops))])) return
      if (all(stops%side == stops(1)%side) .and. stops(1)%side /= side_both) return
      call add_warning(scene, warning_default_start, &
         "the beam is released from a deflection; &start kind = 'rest' starts it " &
         //'at rest between the stops')
   end subroutine warn_of_stops

   !> Warn of tables of loads that end during the run with a value that is not zero. A displacement of the base stays at
   !> its last value, so it does not jump.
   subroutine warn_of_tables(scene)
      type(scene_t), intent(inout) :: scene

      integer :: k

      if (scene%has_forces) then
         do k = 1, size(scene%forces)
            call warn_of_table('force', k, scene%forces(k)%course)
         end do
      end if
      if (.not. scene%has_bases) return
      do k = 1, size(scene%bases)
         if (scene%bases(k)%quantity /= base_displacement) call warn_of_table('base', k, scene%bases(k)%course)
      end do

   contains

      !> Warn of the table of one load.
      subroutine warn_of_table(group, which, course)
         !> Name of the group: 'force' or 'base'
         character(*), intent(in) :: group
         !> Number of the group
         integer, intent(in) :: which
         type(time_course_t), intent(in) :: course

         ! last value over the maximum value up to which the load counts as finished, as a measured shock may be
         real(wp), parameter :: negligible = 0.01_wp
         character(:), allocatable :: unit
         real(wp) :: time_scale, last
         type(units_t) :: units

         if (course%kind /= course_table) return
         associate (n => size(course%time))
            last = course%start + course%time(n)
            if (course%end < last .or. last >= (1.0_wp - 1.0e-6_wp)*scene%response%duration) return
            if (abs(course%value(n)) <= negligible*maxval(abs(course%value))) return
         end associate
         time_scale = 1.0_wp
         unit = ' (tau)'
         if (has_units(scene)) then
            units = units_of(scene%scales, scene%unit_system, .true.)
            time_scale = units%factor(quantity_named('time'))
            unit = ' '//trim(unit_of(quantity_named('time'), units))
         end if
         call add_warning(scene, warning_table_end, 'the table of &'//group//' number '//to_text(which)//' ends at ' &
            //rounded(last*time_scale)//unit//', before the run, which ends at ' &
            //rounded(scene%response%duration*time_scale)//unit//'; the load is zero after that')
      end subroutine warn_of_table

   end subroutine warn_of_tables

   !> Add a warning, unless the scene silences it.
   subroutine add_warning(scene, kind, text)
      type(scene_t), intent(inout) :: scene
      !> One of the `warning_` constants
      integer, intent(in) :: kind
      character(*), intent(in) :: text

      if (allocated(scene%silent_warnings)) then
         if (any(scene%silent_warnings == kind)) return
      end if
      scene%warnings = [scene%warnings, warning_t(kind, text)]
   end subroutine add_warning

end module scene_warnings
