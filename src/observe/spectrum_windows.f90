!> Windows of a spectrum: the segments, the frequencies at which half segments are integrated, and the transforms of
!> windowed segments, which are sums of these integrals (docs/theory.md, section 24).
module spectrum_windows
   use kinds, only: pi, wp
   use spectrum_settings, only: spectrum_settings_t, window_hann
   use spectrum_types, only: run_spectrum_t
   implicit none (type, external)
   private
   public :: windows_t, open_windows, transforms_of

   !> Segments of a run, and frequencies of the integrals.
   type :: windows_t
      !> One of the `window_` constants
      integer :: kind = window_hann
      !> Length of the spans that are integrated. With Hann windows these are half segments, of which all but the first
      !> and the last belong to two segments; with rectangular windows they are whole segments
      real(wp) :: half = 1.0_wp
      !> Number of these spans
      integer :: halves = 0
      !> Frequencies of the integrals
      real(wp), allocatable :: omega(:)
      !> First and last index of each block of these frequencies in which they ascend at equal distances, [2, blocks]
      integer, allocatable :: blocks(:, :)
      !> Index in `omega` of the first frequency of the spectrum, minus (-1), without (0) and plus (1) the frequency of
      !> the window
      integer :: first(-1:1) = 1
      !> Index in `omega` of the frequency 0, minus, without and plus the frequency of the window
      integer :: zero(-1:1) = 1
      !> Frequencies of the spectrum
      real(wp), allocatable :: frequency(:)
   end type windows_t

contains

   !> Set the segments and frequencies of a run.
   pure subroutine open_windows(settings, length, windows, result)
      type(spectrum_settings_t), intent(in) :: settings
      !> Length of the part of the run that is transformed, tau
      real(wp), intent(in) :: length
      type(windows_t), intent(out) :: windows
      !> On return frequencies, lengths and integrals of the window are set, powers are zero
      type(run_spectrum_t), intent(inout) :: result

      ! difference of neighbouring frequencies of the spectrum
      real(wp) :: distance
      ! frequency of the window
      real(wp) :: window_frequency
      ! number of distances in the frequency of the window
      integer :: aligned
      integer :: i, points

      windows%kind = settings%window
      distance = settings%frequency_spacing(length)
      points = nint(settings%frequency_count(length))
      allocate (result%frequency, source=[(settings%range(1) + distance*real(i, wp), i=0, points - 1)])
      if (settings%points > 1) result%frequency(points) = settings%range(2)
      allocate (windows%frequency, source=result%frequency)
      allocate (result%power(points, size(result%of)), result%scatter(points, size(result%of)), source=0.0_wp)
      result%length = settings%segment_length(length)
      result%window = result%length
      result%window_square = result%length
      windows%half = result%length
      windows%halves = settings%segments
      if (windows%kind == window_hann) then
         result%window = 0.5_wp*result%length
         result%window_square = 0.375_wp*result%length
         ! square of the integral of one window times the next, over the square of the integral of the squared window
         result%overlap = 1.0_wp/36.0_wp
         windows%half = 0.5_wp*result%length
         windows%halves = settings%segments + 1
         window_frequency = 2.0_wp*pi/result%length
         aligned = nint(min(window_frequency/distance, real(points, wp) + 1.0_wp))
         if (abs(real(aligned, wp)*distance - window_frequency) > 1.0e-12_wp*window_frequency) aligned = points + 1
         if (aligned <= points) then
            ! the frequencies plus and minus the frequency of the window are again frequencies of the spectrum, except
            ! for those at both ends
            windows%omega = settings%range(1) + distance*real([(i, i=-aligned, points - 1 + aligned)], wp)
            windows%first = 1 + aligned*[0, 1, 2]
            windows%blocks = reshape([1, points + 2*aligned], [2, 1])
         else
            windows%omega = [result%frequency - window_frequency, result%frequency, result%frequency + window_frequency]
            windows%first = 1 + points*[0, 1, 2]
            windows%blocks = reshape([1, points, points + 1, 2*points, 2*points + 1, 3*points], [2, 3])
         end if
         windows%zero = size(windows%omega) + [1, 2, 3]
         windows%omega = [windows%omega, -window_frequency, 0.0_wp, window_frequency]
         windows%blocks = reshape([windows%blocks, windows%zero([-1, 1])], [2, size(windows%blocks, 2) + 1])
      else
         windows%omega = [result%frequency, 0.0_wp]
         windows%zero = points + 1
         windows%blocks = reshape([1, points, points + 1, points + 1], [2, 2])
      end if
   end subroutine open_windows

   !> Transforms of a windowed segment, less its mean, at the frequencies of the spectrum.
   pure function transforms_of(windows, halves, number) result(segment)
      type(windows_t), intent(in) :: windows
      !> Integrals over the second and over the first half of the segment, [frequencies, 2]
      complex(wp), intent(in) :: halves(:, :)
      !> Number of the segment, from 0
      integer, intent(in) :: number
      complex(wp) :: segment(size(windows%frequency))

      complex(wp) :: mean
      real(wp) :: sign
      integer :: points

      points = size(windows%frequency)
      if (windows%kind == window_hann) then
         ! the window (1 - cos(Omega (u - n h)))/2 of segment n, which starts after n half segments of length h; with
         ! Omega h = pi, the cosine is `sign` times cos(Omega u), half the sum of two exponentials
         sign = real(1 - 2*modulo(number, 2), wp)
         segment = 0.5_wp*whole(windows%first(0), points) - 0.25_wp*sign*(whole(windows%first(-1), points) &
            + whole(windows%first(1), points))
         mean = 0.5_wp*whole_at(windows%zero(0)) - 0.25_wp*sign*(whole_at(windows%zero(-1)) + whole_at(windows%zero(1)))
         mean = mean/windows%half
      else
         segment = halves(windows%first(0):windows%first(0) + points - 1, 1)
         mean = halves(windows%zero(0), 1)/windows%half
      end if
      segment = segment - real(mean, wp)*of_window(windows, number, windows%frequency)

   contains

      !> Integrals over the segment.
      pure function whole(first, count) result(values)
         !> Index of the first frequency
         integer, intent(in) :: first
         !> Number of frequencies
         integer, intent(in) :: count
         complex(wp) :: values(count)

         values = halves(first:first + count - 1, 1) + halves(first:first + count - 1, 2)
      end function whole

      !> Integral over the segment at one frequency.
      pure complex(wp) function whole_at(place)
         !> Index of the frequency
         integer, intent(in) :: place

         whole_at = halves(place, 1) + halves(place, 2)
      end function whole_at
   end function transforms_of

   !> Transform of the window of a segment.
   elemental function of_window(windows, number, omega) result(value)
      type(windows_t), intent(in) :: windows
      !> Number of the segment, from 0
      integer, intent(in) :: number
      real(wp), intent(in) :: omega
      complex(wp) :: value

      real(wp) :: window_frequency

      if (windows%kind == window_hann) then
         window_frequency = pi/windows%half
         value = 0.5_wp*of_rectangle(2.0_wp*windows%half, windows%half*real(number, wp), omega) &
            - 0.25_wp*real(1 - 2*modulo(number, 2), wp) &
            *(of_rectangle(2.0_wp*windows%half, windows%half*real(number, wp), omega - window_frequency) &
            + of_rectangle(2.0_wp*windows%half, windows%half*real(number, wp), omega + window_frequency))
      else
         value = of_rectangle(windows%half, windows%half*real(number, wp), omega)
      end if
   end function of_window

   !> Integral of exp(-i omega u) over a time span: length sinc(omega length/2) exp(-i omega (from + length/2)), with
   !> sinc a = sin(a)/a.
   elemental function of_rectangle(length, from, omega) result(value)
      !> Length of the time span, tau
      real(wp), intent(in) :: length
      !> Start of the time span, tau
      real(wp), intent(in) :: from
      real(wp), intent(in) :: omega
      complex(wp) :: value

      real(wp) :: angle, sinc

      angle = 0.5_wp*omega*length
      sinc = 1.0_wp - angle**2/6.0_wp
      if (abs(angle) > 1.0e-4_wp) sinc = sin(angle)/angle
      value = length*sinc*exp(cmplx(0.0_wp, -omega*(from + 0.5_wp*length), wp))
   end function of_rectangle

end module spectrum_windows
