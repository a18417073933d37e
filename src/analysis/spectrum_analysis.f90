!> Spectra of a finished run: amplitudes, power spectral densities with error bars, lines (docs/theory.md, section 24),
!> which are local maxima of the amplitude, and the harmonic of a load to which each line belongs.
module spectrum_analysis
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use analysis_types, only: analysis_t
   use applied_loads, only: courses_of
   use beam_model, only: beam_model_t
   use distributions, only: student_quantile
   use failures, only: failure_t
   use kinds, only: pi, wp
   use load_settings, only: course_harmonic, time_course_t
   use measure_list, only: contact_name, measure_named
   use number_text, only: to_text
   use quantities, only: quantity_named, units_t, words_in
   use quantity_groups, only: quantity_group_t
   use reader_units, only: phrase, unit_in
   use response_types, only: response_t
   use run_settings, only: name_length, run_settings_t
   use scene_types, only: scene_t
   use sorting, only: ascending_order
   use spectrum_settings, only: signal_t, signal_table, spectrum_settings_t, window_hann, window_names
   use spectrum_types, only: amplitudes_of, run_spectrum_t
   use table_columns, only: add_numbers, add_texts, print_line, print_table, six_digits, table_t, two_digits
   implicit none (type, external)
   private
   public :: spectrum_analysis_t, line_t, find_lines, owner_of

   !> Minimum amplitude of a line, relative to the amplitude of the strongest line.
   real(wp), parameter :: min_amplitude_ratio = 0.01_wp
   !> Maximum number of lines.
   integer, parameter :: max_lines = 12
   !> Maximum denominator n of the frequency m/n times a load frequency of a harmonic (n = 1) or subharmonic.
   integer, parameter :: max_divisor = 4

   !> A line of a spectrum.
   type :: line_t
      !> Index of the frequency with the maximum amplitude
      integer :: place = 0
      !> Frequency over omega1, between those of the spectrum
      real(wp) :: frequency = 0.0_wp
      !> Amplitude at that frequency
      real(wp) :: amplitude = 0.0_wp
      !> The frequency is `multiple`/`divisor` times the frequency of the load `load`
      integer :: multiple = 0
      !> Divisor of the frequency of the load
      integer :: divisor = 1
      !> Index of the load; 0: the frequency belongs to no load
      integer :: load = 0
   end type line_t

   !> Confidence of the error bars.
   real(wp), parameter :: confidence = 0.95_wp

   !> Spectra of a run; all numbers are dimensionless.
   type, extends(analysis_t) :: spectrum_analysis_t
      type(run_spectrum_t) :: run
      !> One of the `window_` constants
      integer :: window = window_hann
      !> Contact or body of each signal, an addition to its meaning; empty if the scene has one only, [signals]
      character(name_length), allocatable :: owner(:)
      !> Amplitude of a harmonic at each frequency, [frequencies, signals]
      real(wp), allocatable :: amplitude(:, :)
      !> One-sided power spectral density, [frequencies, signals]
      real(wp), allocatable :: density(:, :)
      !> Half width of its confidence interval, [frequencies, signals]; NaN: fewer than two segments
      real(wp), allocatable :: half_width(:, :)
      !> Maximum error of an amplitude by sampling, [signals]
      real(wp), allocatable :: sampling_error(:)
      !> Frequencies of the harmonic loads, over omega1
      real(wp), allocatable :: load(:)
   contains
      procedure :: compute
      procedure :: write => write_group
      procedure :: print => print_lines
      procedure :: supply_measures
   end type spectrum_analysis_t

contains

   !> Compute the spectra from the powers of the segments of a run.
   subroutine compute(self, scene, model, settings, response, error)
      class(spectrum_analysis_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(beam_model_t), intent(in) :: model
      !> Settings of the run, with its loads
      type(run_settings_t), intent(in) :: settings
      !> Response with the powers of the segments
      type(response_t), intent(in) :: response
      type(failure_t), allocatable, intent(out) :: error

      real(wp) :: spread, variance_ratio
      integer :: k

      associate (unused_1 => model, unused_2 => error)
      end associate
      self%window = scene%spectrum%window
      self%run = response%spectrum
      allocate (self%owner(size(self%run%of)))
      do k = 1, size(self%owner)
         self%owner(k) = owner_of(signal_table(self%run%of(k)), scene%spectrum, response)
      end do
      allocate (self%load, source=load_frequencies(settings))
      associate (run => self%run)
         allocate (self%amplitude, source=amplitudes_of(run))
         allocate (self%density, source=run%power/(pi*run%window_square))
         allocate (self%half_width, mold=self%density)
         if (run%segments > 1) then
            ! the powers of neighbours among n segments have the correlation r: the variance of their mean is larger by
            ! 1 + 2 r (n - 1)/n, and the variance among them smaller by 1 - 2 r/n, than of independent segments
            associate (n => real(run%segments, wp), r => run%overlap)
               variance_ratio = (1.0_wp + 2.0_wp*r*(n - 1.0_wp)/n)/(1.0_wp - 2.0_wp*r/n)
               spread = student_quantile(confidence, run%segments - 1)*sqrt(variance_ratio/(n*(n - 1.0_wp)))
            end associate
            self%half_width(:, :) = spread*sqrt(run%scatter)/(pi*run%window_square)
         end if
         allocate (self%sampling_error, source=run%sampling_error*(2.0_wp/run%window))
      end associate
   end subroutine compute

   !> The contact or body of a signal, with a comma and a blank before it; empty if the scene leaves no choice, or none
   !> was made.
   pure function owner_of(signal, settings, response) result(words)
      type(signal_t), intent(in) :: signal
      type(spectrum_settings_t), intent(in) :: settings
      !> Response with its contacts
      type(response_t), intent(in) :: response
      character(:), allocatable :: words

      words = ''
      if (.not. allocated(response%contacts)) return
      if (size(response%contacts) == 1) return
      if (signal%is_of_contact .and. settings%contact > 0) then
         words = ', '//contact_name(response%contacts(settings%contact))
      else if (signal%name == 'contact_force') then
         words = ', sum of all contacts'
      else if (signal%is_of_point .and. maxval(response%contacts%body) > 1) then
         words = ', body_'//to_text(settings%recorded_point)
      end if
   end function owner_of

   !> Write the group of the results file.
   subroutine write_group(self, group)
      class(spectrum_analysis_t), intent(in) :: self
      type(quantity_group_t), intent(in) :: group

      character(:), allocatable :: name
      integer :: k

      associate (run => self%run)
         call group%attribute('window', trim(window_names(self%window)))
         call group%attribute('segments', [run%segments])
         call group%put_attribute('segment_length', run%length, 'time')
         call group%put_attribute('start', run%start, 'time')
         call group%attribute('method', method_of(run))
         if (run%sampled_from < huge(1.0_wp)) then
            call group%put_attribute('sampled_from', run%sampled_from, 'time')
            call group%put_attribute('sample_step', run%step, 'time')
         end if
         call group%attribute('half_widths', '95 % by the t distribution over the segments')
         call group%put('omega', run%frequency, 'frequency', '{omega over omega1~frequency}', is_scale=.true.)
         if (size(self%load) > 0) call group%put('load_omega', self%load, 'frequency', &
            '{omega over omega1~frequency} of each harmonic load')
         do k = 1, size(run%of)
            associate (signal => signal_table(run%of(k)))
               name = trim(signal%name)
               call group%put('amplitude_'//name, self%amplitude(:, k), signal%quantity, 'amplitude of the ' &
                  //trim(signal%meaning)//trim(self%owner(k)), 'omega')
               call group%put('mean_'//name, run%mean(k), signal%quantity, &
                  'mean of it; of displacements up from the unstressed beam, at a contact of a body from the body')
               if (run%sampled_from < huge(1.0_wp)) call group%put('sampling_error_'//name, self%sampling_error(k), &
                  signal%quantity, 'what an amplitude changes by at most when every second sample is left out')
               call group%put('density_'//name, self%density(:, k), signal%density, &
                  'one-sided power spectral density of it', 'omega')
               if (run%segments > 1) call group%put('density_'//name//'_half_width', self%half_width(:, k), &
                  signal%density, 'half the width of its 95 % interval', 'omega')
               call write_signal_lines(self, k, group%subgroup('lines_'//name))
            end associate
         end do
      end associate
   end subroutine write_group

   !> Write the strongest lines of a signal.
   subroutine write_signal_lines(self, k, group)
      class(spectrum_analysis_t), intent(in) :: self
      !> Index of the signal
      integer, intent(in) :: k
      type(quantity_group_t), intent(in) :: group

      type(line_t), allocatable :: lines(:)
      integer :: i

      call find_lines(self%run%frequency, self%amplitude(:, k), self%run%length, self%window, self%load, lines)
      if (size(lines) == 0) return
      call group%put('line', [(i, i=1, size(lines))], 'line, the strongest first', is_scale=.true.)
      call group%put('omega', [lines%frequency], 'frequency', '{omega over omega1~frequency}', 'line')
      call group%put('amplitude', [lines%amplitude], signal_table(self%run%of(k))%quantity, &
         'amplitude there', 'line')
      call group%put('multiple', lines%multiple, 'it is this multiple of the frequency of a harmonic load', 'line')
      call group%put('over', lines%divisor, 'over this number', 'line')
      call group%put('load', lines%load, 'which of load_{omega~frequency}; 0: of none', 'line')
   end subroutine write_signal_lines

   !> How the integrals were computed, in words.
   pure function method_of(run) result(words)
      type(run_spectrum_t), intent(in) :: run
      character(:), allocatable :: words

      words = 'in closed form'
      if (run%sampled_from < huge(1.0_wp)) words = 'in closed form, then from samples'
      if (run%sampled_from <= run%start) words = 'from samples'
   end function method_of

   !> Print the strongest lines of each signal.
   subroutine print_lines(self, unit, units)
      class(spectrum_analysis_t), intent(in) :: self
      integer, intent(in) :: unit
      !> Units of the results
      type(units_t), intent(in) :: units

      type(line_t), allocatable :: lines(:)
      type(table_t) :: table
      character(16), allocatable :: orders(:)
      integer :: i, k

      associate (run => self%run)
         write (unit, '(/, 2x, a)') 'spectra of '//to_text(run%segments)//' segments'//phrase(units, &
            ' of {tau~t} = ', 'time', run%length)//', '//trim(window_names(self%window))//' window, '//method_of(run)
         if (size(run%frequency) > 1) then
            if (run%frequency(2) - run%frequency(1) > line_width(run%length)*(1.0_wp + 1.0e-9_wp)) call &
               print_line(unit, 'warning', 'the frequencies are farther apart than a line is wide, 1 over the ' &
               //'length of a segment: lines between them are missed')
         end if
         do k = 1, size(run%of)
            associate (signal => signal_table(run%of(k)))
               call find_lines(run%frequency, self%amplitude(:, k), run%length, self%window, self%load, lines)
               write (unit, '(/, 2x, a)') words_in(units, trim(signal%meaning))//trim(self%owner(k))
               if (run%sampled_from < huge(1.0_wp)) call print_line(unit, 'amplitudes within', phrase(units, '', &
                  trim(signal%quantity), self%sampling_error(k)))
               if (size(lines) == 0) cycle
               if (allocated(table%columns)) deallocate (table%columns)
               allocate (orders(size(lines)))
               do i = 1, size(lines)
                  orders(i) = order_in_words(lines(i), size(self%load))
               end do
               call add_numbers(table, words_in(units, '{omega~frequency}')//in_unit('frequency'), factor('frequency') &
                  *lines%frequency, six_digits)
               call add_numbers(table, 'amplitude', factor(signal%quantity)*lines%amplitude, six_digits, &
                  unit_in(units, trim(signal%quantity)))
               call add_numbers(table, 'density'//in_unit(signal%density), factor(signal%density) &
                  *self%density(lines%place, k), two_digits)
               if (run%segments > 1) call add_numbers(table, '+-', factor(signal%density) &
                  *self%half_width(lines%place, k), two_digits)
               if (size(self%load) > 0) call add_texts(table, 'times a load', orders)
               call print_table(unit, table)
               deallocate (orders)
            end associate
         end do
      end associate

   contains

      !> Factor from dimensionless numbers to the units of the results.
      pure real(wp) function factor(quantity)
         character(*), intent(in) :: quantity

         factor = 1.0_wp
         if (units%are_physical) factor = units%factor(quantity_named(quantity))
      end function factor

      !> Unit of a quantity for a heading. It has no prefix, because frequencies of a spectrum span decades and units of
      !> densities begin with a square.
      pure function in_unit(quantity) result(words)
         character(*), intent(in) :: quantity
         character(:), allocatable :: words

         words = unit_in(units, trim(quantity))
         if (words /= '') words = ', '//words
      end function in_unit
   end subroutine print_lines

   !> Set the measures: the frequency of the strongest line of the first signal, and the amplitude of the strongest line
   !> of the first signal of each quantity.
   subroutine supply_measures(self, measures)
      class(spectrum_analysis_t), intent(in) :: self
      real(wp), intent(inout) :: measures(:)

      type(line_t), allocatable :: lines(:)
      integer :: k, measure

      do k = 1, size(self%run%of)
         call find_lines(self%run%frequency, self%amplitude(:, k), self%run%length, self%window, self%load, lines)
         if (size(lines) == 0) cycle
         if (k == 1) measures(measure_named('strongest_frequency')) = lines(1)%frequency
         measure = measure_named(trim(signal_table(self%run%of(k))%measure))
         if (ieee_is_nan(measures(measure))) measures(measure) = lines(1)%amplitude
      end do
   end subroutine supply_measures

   !> Different frequencies of the harmonic loads of a run, over omega1, ascending.
   pure function load_frequencies(settings) result(frequency)
      type(run_settings_t), intent(in) :: settings
      real(wp), allocatable :: frequency(:)

      type(time_course_t), allocatable :: courses(:)
      real(wp), allocatable :: all(:)
      integer :: i

      allocate (courses, source=courses_of(settings))
      all = pack(courses%frequency, courses%kind == course_harmonic .and. abs(courses%amplitude) > 0.0_wp)
      all = all(ascending_order(all))
      allocate (frequency, source=pack(all, [(all(max(i - 1, 1)) < all(i) .or. i == 1, i=1, size(all))]))
   end function load_frequencies

   !> Find the lines, in descending order of their amplitudes. The amplitude of a line exceeds all others within the
   !> width of the window.
   pure subroutine find_lines(frequency, amplitude, length, window, load, lines)
      !> Frequencies over omega1, ascending at equal distances
      real(wp), intent(in) :: frequency(:)
      !> Amplitudes at these frequencies
      real(wp), intent(in) :: amplitude(:)
      !> Length of a segment, tau
      real(wp), intent(in) :: length
      !> One of the `window_` constants
      integer, intent(in) :: window
      !> Frequencies of the harmonic loads over omega1
      real(wp), intent(in) :: load(:)
      type(line_t), allocatable, intent(out) :: lines(:)

      integer, allocatable :: order(:), places(:)
      type(line_t), allocatable :: all_lines(:)
      real(wp) :: distance, width
      integer :: i, reach

      allocate (places(0))
      distance = huge(1.0_wp)
      if (size(frequency) > 1) distance = frequency(2) - frequency(1)
      width = line_width(length)
      ! the line of a Hann window extends by two widths to both sides
      reach = max(1, int(min(2.0_wp*width/distance, real(size(frequency), wp))))
      do i = 1, size(frequency)
         if (.not. amplitude(i) > 0.0_wp .or. amplitude(i) < min_amplitude_ratio*maxval(amplitude)) cycle
         if (any(amplitude(max(i - reach, 1):i - 1) >= amplitude(i))) cycle
         if (any(amplitude(i + 1:min(i + reach, size(frequency))) > amplitude(i))) cycle
         places = [places, i]
      end do
      allocate (all_lines(size(places)))
      do i = 1, size(places)
         all_lines(i)%place = places(i)
         call interpolate_line(frequency, amplitude, width, window, all_lines(i))
         call assign_load(0.5_wp*max(width, distance), load, all_lines(i))
      end do
      order = ascending_order(-all_lines%amplitude)
      lines = all_lines(order(:min(size(order), max_lines)))
   end subroutine find_lines

   !> Distance from the centre of a line to the first zero of the transform of a rectangle window, over omega1. With
   !> frequencies farther apart than this a spectrum can miss lines.
   elemental real(wp) function line_width(length) result(width)
      !> Length of a segment, tau
      real(wp), intent(in) :: length

      width = 2.0_wp*pi/length
   end function line_width

   !> Find frequency and amplitude of a line between the frequencies of the spectrum: those of the transform of the
   !> window that has the amplitudes at `place` and at the higher one of its neighbours. A neighbour that is lower than
   !> that of a line at `place` itself, or frequencies too far apart for one line to be seen at two of them, leave the
   !> line there.
   pure subroutine interpolate_line(frequency, amplitude, width, window, line)
      real(wp), intent(in) :: frequency(:)
      real(wp), intent(in) :: amplitude(:)
      !> Width of a line over omega1
      real(wp), intent(in) :: width
      !> One of the `window_` constants
      integer, intent(in) :: window
      !> On entry `place`; on return frequency and amplitude
      type(line_t), intent(inout) :: line

      ! the interval that contains the shift shrinks to rounding
      integer, parameter :: bisections = 50
      ! distance of the frequencies, bounds of the shift from `place` and their middle, over the width
      real(wp) :: distance, low, high, middle
      real(wp) :: ratio
      integer :: i, side

      i = line%place
      line%frequency = frequency(i)
      line%amplitude = amplitude(i)
      if (i == 1 .or. i == size(frequency)) return
      distance = (frequency(i + 1) - frequency(i))/width
      if (distance > 1.0_wp + 1.0e-9_wp) return
      side = merge(1, -1, amplitude(i + 1) > amplitude(i - 1))
      ratio = amplitude(i + side)/amplitude(i)
      if (ratio <= window_transform(distance, window)) return
      low = 0.0_wp
      high = 0.5_wp*distance
      do i = 1, bisections
         middle = 0.5_wp*(low + high)
         if (window_transform(distance - middle, window) > ratio*window_transform(middle, window)) then
            high = middle
         else
            low = middle
         end if
      end do
      line%frequency = line%frequency + real(side, wp)*middle*width
      line%amplitude = line%amplitude/window_transform(middle, window)
   end subroutine interpolate_line

   !> Magnitude of the transform of a window over that at its centre, up to one width from the centre: sin(pi x)/(pi x)
   !> of a rectangle, that over 1 - x^2 of Hann's window.
   elemental real(wp) function window_transform(distance, window) result(value)
      !> Distance x from the centre over the width of a line, between 0 and 1
      real(wp), intent(in) :: distance
      !> One of the `window_` constants
      integer, intent(in) :: window

      value = 1.0_wp
      if (.not. distance > 0.0_wp) return
      associate (x => distance, rest => 1.0_wp - distance)
         ! sin(pi x) = sin(pi (1 - x)) of the lesser angle, which is exact at both ends
         value = sin(pi*min(x, rest))/(pi*x)
         if (window /= window_hann) return
         if (rest > 0.0_wp) then
            value = value/(rest*(1.0_wp + x))
         else
            value = 0.5_wp
         end if
      end associate
   end function window_transform

   !> Find the load of which a line is a harmonic or a subharmonic, within the resolution of the spectrum.
   pure subroutine assign_load(tolerance, load, line)
      !> Maximum difference of frequencies that count as equal, over omega1
      real(wp), intent(in) :: tolerance
      !> Frequencies of the harmonic loads over omega1
      real(wp), intent(in) :: load(:)
      type(line_t), intent(inout) :: line

      ! minimum distance of neighbouring harmonics over the tolerance: with a smaller distance any frequency would count
      ! as a harmonic
      real(wp), parameter :: min_distance = 8.0_wp
      real(wp) :: basic
      integer :: k, divisor

      do divisor = 1, max_divisor
         do k = 1, size(load)
            basic = load(k)/real(divisor, wp)
            if (basic/min_distance < tolerance .or. line%frequency < 0.5_wp*basic) cycle
            if (abs(line%frequency - anint(line%frequency/basic)*basic) > tolerance) cycle
            line%multiple = nint(line%frequency/basic)
            line%divisor = divisor
            line%load = k
            return
         end do
      end do
   end subroutine assign_load

   !> The multiple in words, such as '3' or '3/2', and the number of the load if there is more than one.
   pure function order_in_words(line, loads) result(words)
      type(line_t), intent(in) :: line
      !> Number of loads
      integer, intent(in) :: loads
      character(:), allocatable :: words

      words = '-'
      if (line%load == 0) return
      words = to_text(line%multiple)
      if (line%divisor > 1) words = words//'/'//to_text(line%divisor)
      if (loads > 1) words = words//' of '//to_text(line%load)
   end function order_in_words

end module spectrum_analysis
