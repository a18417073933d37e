!> Lines of a spectrum (local maxima of the amplitude), and the harmonic of a load to which each line belongs.
module spectrum_lines
   use kinds, only: pi, wp
   use load_settings, only: course_harmonic
   use number_text, only: to_text
   use run_settings, only: run_settings_t
   use sorting, only: ascending_order
   use spectrum_settings, only: window_hann
   implicit none (type, external)
   private
   public :: line_t, find_lines, load_frequencies, order_in_words, line_width

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

contains

   !> Different frequencies of the harmonic loads of a run, over omega1, ascending.
   pure function load_frequencies(settings) result(frequency)
      type(run_settings_t), intent(in) :: settings
      real(wp), allocatable :: frequency(:)

      real(wp), allocatable :: all(:)
      integer :: i

      allocate (all(0))
      if (allocated(settings%forces)) all = pack(settings%forces%course%frequency, &
         settings%forces%course%kind == course_harmonic .and. abs(settings%forces%course%amplitude) > 0.0_wp)
      if (allocated(settings%bases)) all = [all, pack(settings%bases%course%frequency, &
         settings%bases%course%kind == course_harmonic .and. abs(settings%bases%course%amplitude) > 0.0_wp)]
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

end module spectrum_lines
