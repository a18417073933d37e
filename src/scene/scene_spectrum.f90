!> &spectrum: the names of the group, and its checks.
module scene_spectrum
   use kinds, only: pi, wp
   use name_table, only: table_t
   use name_types, only: condition_t, in_units_t, name_t, duration_range, instant_range, range_t
   use number_text, only: rounded, to_text
   use run_settings, only: end_of_run, side_both, stop_settings_t
   use scene_input, only: scene_input_t
   use scene_types, only: all_stops, scene_t
   use spectrum_settings, only: quantity_moment, signal_names, signal_table, spectrum_settings_t, window_names
   implicit none (type, external)
   private
   public :: list_spectrum, resolve_spectrum, instant_in_words

   !> Maximum number of frequencies.
   integer, parameter :: max_points = 1000000
   !> Maximum of frequencies times signals, whose results take half a gigabyte.
   real(wp), parameter :: max_numbers = 1.0e7_wp
   !> Maximum of frequencies times signals times segments, whose transforms take minutes, in closed form or from
   !> samples.
   real(wp), parameter :: max_transforms = 1.0e8_wp
   !> Maximum number of periods of the maximum frequency in the transformed part of a run, because the number of samples
   !> is proportional to it.
   real(wp), parameter :: max_periods = 1.0e7_wp

contains

   !> List the names of &spectrum in the table, and bind them to the components of the scene.
   subroutine list_spectrum(table, spectrum)
      class(table_t), intent(inout) :: table
      type(spectrum_settings_t), intent(inout) :: spectrum

      type(condition_t), parameter :: without_points = condition_t(without='points', &
         phrase='a distance of frequencies, not with points')

      call table%bind(spectrum%of, name_t('of', 'signals whose spectra are requested; measures refer to the first', &
         default="'displacement_tip'"), signal_names)
      if (.not. allocated(spectrum%of)) spectrum%of = [1]
      call table%bind(spectrum%contact, name_t('contact', 'which contact, in the order of &stop and &body, of each ' &
         //'below, above, floor, ceiling; 0: that from which the beam is released, of forces the sum of all', &
         range_t(0, 1000)))
      call table%bind(spectrum%point, name_t('point', 'which of the points of &stress, for moments', &
         range_t(1, 100000)))
      call table%bind(spectrum%recorded_point, name_t('body', 'which &body, for signals of a body', range_t(1, 1000)))
      call table%bind(spectrum%range, name_t('frequency_ratio_range', &
         'minimum and maximum circular frequency, over omega1', range_t(0.0_wp, 1.0e6_wp), default='none: give one'), &
         in_units_t('frequency_range', 'frequency', 'the same in cycles per unit of time'))
      call table%bind(spectrum%points, name_t('points', 'number of frequencies in this range', range_t(2, max_points), &
         default='from resolution', is_optional=.true.))
      call table%bind(spectrum%resolution, name_t('resolution_ratio', 'difference of neighbouring circular ' &
         //'frequencies, over omega1', range_t(0.0_wp, 1.0e6_wp, excludes_minimum=.true.), without_points, &
         default='half of 1 over a segment', is_optional=.true.), &
         in_units_t('resolution', 'frequency', 'the same in cycles per unit of time'))
      call table%bind(spectrum%segments, name_t('segments', 'segments of equal length, from whose differences ' &
         //'confidence intervals follow; with hann each overlaps the next by half; 1: no intervals', range_t(1, 10000)))
      call table%bind(spectrum%window, name_t('window', 'weight over a segment'), window_names)
      call table%bind(spectrum%start, name_t('start', 'start of the part that is evaluated, tau', instant_range), &
         in_units_t('start_time', 'time', 'the same in time'))
      call table%bind(spectrum%end, name_t('end', 'end of the part that is evaluated, tau', duration_range, &
         default='that of the run', is_optional=.true.), in_units_t('end_time', 'time', 'the same in time'))
      call table%bind(spectrum%closed_form_limit, name_t('closed_form_limit', 'maximum of exponentials of all ' &
         //'intervals times frequencies and signals that are integrated in closed form; later intervals are sampled', &
         range_t(0.0_wp, 1.0e15_wp)))
   end subroutine list_spectrum

   !> Check that the scene has the requested signals, a range of frequencies, and a part of the run to transform.
   !> Problems are reported to `input`.
   subroutine resolve_spectrum(input, scene)
      type(scene_input_t), intent(inout) :: input
      !> Scene with resolved loads and duration
      type(scene_t), intent(inout) :: scene

      character(*), parameter :: group = 'spectrum', name = 'frequency_ratio_range frequency_range'
      ! end of the part that is transformed, tau
      real(wp) :: end
      integer :: k

      associate (spectrum => scene%spectrum)
         do k = 1, size(spectrum%of)
            if (signal_table(spectrum%of(k))%is_of_contact .and. contact_count(scene) == 0) then
               call input%complain(group, 'of', trim(signal_names(spectrum%of(k)))//' needs &stop or &body')
            else if (signal_table(spectrum%of(k))%is_of_point .and. .not. scene%has_bodies) then
               call input%complain(group, 'of', trim(signal_names(spectrum%of(k)))//' needs &body')
            else if (signal_table(spectrum%of(k))%base == quantity_moment .and. .not. scene%wants_stress) then
               call input%complain(group, 'of', 'moment needs &stress, which gives the positions')
            end if
            if (input%has_problem()) return
         end do
         call check_owners(input, scene)
         if (input%has_problem()) return
         if (.not. allocated(spectrum%range)) then
            call input%complain(group, '', 'needs frequency_ratio_range or frequency_range')
         else if (size(spectrum%range) /= 2) then
            call input%complain(group, name, 'takes two values, the minimum and the maximum')
         else if (.not. spectrum%range(2) > spectrum%range(1)) then
            call input%complain(group, name, 'the first value must be less than the second')
         end if
         if (input%has_problem()) return
         end = end_of_run(scene%response)
         if (spectrum%end < huge(spectrum%end)) then
            if (spectrum%end > end) call input%complain(group, 'end end_time', 'must be at most the end of the run, ' &
               //instant_in_words(input, scene, group, 'end_time', end))
            end = spectrum%end
         end if
         if (spectrum%start >= end) then
            call input%complain(group, 'start start_time', 'nothing is left to transform: it must be before the end, ' &
               //instant_in_words(input, scene, group, 'start_time', end))
         else
            call check_numbers(input, spectrum, end - spectrum%start)
         end if
      end associate
   end subroutine resolve_spectrum

   !> An instant or a duration in words: in units of time if the file gives `name`, else in tau.
   pure function instant_in_words(input, scene, group, name, tau) result(words)
      type(scene_input_t), intent(in) :: input
      type(scene_t), intent(in) :: scene
      character(*), intent(in) :: group
      !> Name of the group for a time in units
      character(*), intent(in) :: name
      real(wp), intent(in) :: tau
      character(:), allocatable :: words

      if (input%has(group, name)) then
         words = rounded(tau/scene%scales%omega1)//' (time)'
      else
         words = to_text(tau)//' (tau)'
      end if
   end function instant_in_words

   !> Check that contact, body and point exist, and that a signal belongs to each. Problems are reported to `input`.
   subroutine check_owners(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene

      character(*), parameter :: group = 'spectrum'

      associate (spectrum => scene%spectrum)
         if (spectrum%contact > 0 .and. .not. any(signal_table(spectrum%of)%is_of_contact)) then
            call input%complain(group, 'contact', 'only goes with a signal of a contact in of')
         else if (spectrum%point > 1 .and. all(signal_table(spectrum%of)%base /= quantity_moment)) then
            call input%complain(group, 'point', 'only goes with moment in of')
         else if (spectrum%recorded_point > 1 .and. .not. any(signal_table(spectrum%of)%is_of_point)) then
            call input%complain(group, 'body', 'only goes with a signal of a body in of')
         else if (spectrum%recorded_point > body_count(scene)) then
            call input%complain(group, 'body', 'must be at most '//to_text(body_count(scene)) &
               //', the number of &body groups')
         else if (spectrum%contact > contact_count(scene)) then
            call input%complain(group, 'contact', 'must be at most '//to_text(contact_count(scene)) &
               //', the contacts of the scene')
         else if (spectrum%point > max(stress_point_count(scene), 1)) then
            call input%complain(group, 'point', 'must be at most '//to_text(stress_point_count(scene)) &
               //', the points of &stress')
         end if
      end associate
   end subroutine check_owners

   !> Check that number and maximum of the frequencies are within the limits. Problems are reported to `input`.
   subroutine check_numbers(input, spectrum, length)
      type(scene_input_t), intent(inout) :: input
      type(spectrum_settings_t), intent(in) :: spectrum
      !> Length of the transformed part of the run, tau
      real(wp), intent(in) :: length

      character(*), parameter :: group = 'spectrum'
      real(wp) :: points

      points = spectrum%frequency_count(length)
      if (points > real(max_points, wp)) then
         call input%complain(group, 'points resolution_ratio resolution frequency_ratio_range frequency_range', &
            'would be '//to_text(points)//' frequencies: at most '//to_text(max_points)//' are computed')
      else if (points*real(size(spectrum%of), wp) > max_numbers) then
         call input%complain(group, 'of', 'would be '//to_text(points*real(size(spectrum%of), wp)) &
            //' numbers: at most '//to_text(max_numbers)//' are computed')
      else if (points*real(size(spectrum%of)*spectrum%segments, wp) > max_transforms) then
         call input%complain(group, 'segments', 'would be ' &
            //to_text(points*real(size(spectrum%of)*spectrum%segments, wp))//' numbers in all segments: at most ' &
            //to_text(max_transforms)//' are computed')
      else if (spectrum%range(2)*length/(2.0_wp*pi) > max_periods) then
         call input%complain(group, 'frequency_ratio_range frequency_range', 'the run has ' &
            //to_text(anint(spectrum%range(2)*length/(2.0_wp*pi)))//' periods of the maximum frequency: at most ' &
            //to_text(max_periods)//' are transformed')
      end if
   end subroutine check_numbers

   !> Number of contacts of a scene: one for each side of each stop and of each body, and floors and
   !> ceilings.
   pure integer function contact_count(scene)
      type(scene_t), intent(in) :: scene

      type(stop_settings_t), allocatable :: stops(:)

      allocate (stops, source=all_stops(scene))
      contact_count = size(stops) + count(stops%side == side_both)
      if (.not. scene%has_bodies) return
      associate (bodies => scene%bodies)
         contact_count = contact_count + size(bodies) + count(bodies%side == side_both) &
            + count(bodies%floor >= 0.0_wp) + count(bodies%ceiling >= 0.0_wp)
      end associate
   end function contact_count

   !> Number of &body groups; 1 without such a group, because 1 is the default of `body`.
   pure integer function body_count(scene)
      type(scene_t), intent(in) :: scene

      body_count = 1
      if (scene%has_bodies) body_count = size(scene%bodies)
   end function body_count

   !> Number of points of &stress.
   pure integer function stress_point_count(scene)
      type(scene_t), intent(in) :: scene

      stress_point_count = 0
      if (allocated(scene%stress%position)) stress_point_count = size(scene%stress%position)
   end function stress_point_count

end module scene_spectrum
