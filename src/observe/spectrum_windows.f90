!> The windows of a spectrum: its segments, the frequencies at which half segments are integrated, and the transforms of
!> windowed segments from these (docs/theory.md, section 24).
module spectrum_windows
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kinds, only: pi, wp
   use spectrum_settings, only: spectrum_settings_t, window_hann
   use spectrum_types, only: run_spectrum_t
   implicit none (type, external)
   private
   public :: windows_t, open_windows, transforms_of

   type :: windows_t
      !> One of the `window_` constants
      integer :: kind = window_hann
      !> Length of a half segment, of which Hann's windows share each but the first and the last; of a rectangle that of
      !> a segment. Their number; 0: nothing is left to transform
      real(wp) :: half = 1.0_wp
      integer :: halves = 0
      !> Frequencies of the integrals, and blocks in which they ascend at equal steps, first and last, [2, blocks]
      real(wp), allocatable :: omega(:)
      integer, allocatable :: blocks(:, :)
      !> Where in them are the first frequency asked for and 0: less that of the window, as it is, and more
      integer :: first(-1:1) = 1
      integer :: zero(-1:1) = 1
      !> The frequencies asked for
      real(wp), allocatable :: frequency(:)
   end type windows_t

contains

   !> Segments and frequencies of a run.
   pure subroutine open_windows(asked, length, windows, result)
      type(spectrum_settings_t), intent(in) :: asked
      !> What of the run counts, tau; less than 0: nothing
      real(wp), intent(in) :: length
      type(windows_t), intent(out) :: windows
      !> Gets its frequencies
      type(run_spectrum_t), intent(inout) :: result

      real(wp) :: distance, last, turning
      integer :: aligned, i, points

      windows%kind = asked%window
      distance = 1.0_wp
      points = asked%points
      if (length > 0.0_wp) then
         distance = asked%distance_of(length)
         points = nint(asked%count_of(length))
      end if
      allocate (result%frequency, source=[(asked%range(1) + distance*real(i, wp), i=0, points - 1)])
      if (asked%points > 1) result%frequency(points) = asked%range(2)
      allocate (windows%frequency, source=result%frequency)
      allocate (result%power(points, size(result%of)), result%scatter(points, size(result%of)), source=0.0_wp)
      if (.not. length > 0.0_wp) then
         allocate (windows%omega(0), windows%blocks(2, 0))
         result%power(:, :) = ieee_value(1.0_wp, ieee_quiet_nan)
         return
      end if
      result%length = asked%segment_of(length)
      result%window = result%length
      result%window_square = result%length
      windows%half = result%length
      windows%halves = asked%segments
      if (windows%kind == window_hann) then
         result%window = 0.5_wp*result%length
         result%window_square = 0.375_wp*result%length
         ! the squares of the integral of one window times the next, over that of its square
         result%overlap = 1.0_wp/36.0_wp
         windows%half = 0.5_wp*result%length
         windows%halves = asked%segments + 1
         turning = 2.0_wp*pi/result%length
         aligned = nint(min(turning/distance, real(points, wp) + 1.0_wp))
         if (abs(real(aligned, wp)*distance - turning) > 1.0e-12_wp*turning) aligned = points + 1
         if (aligned <= points) then
            ! the frequencies less and more that of the window are among them but for a few
            windows%omega = asked%range(1) + distance*real([(i, i=-aligned, points - 1 + aligned)], wp)
            windows%first = 1 + aligned*[0, 1, 2]
            windows%blocks = reshape([1, points + 2*aligned], [2, 1])
         else
            windows%omega = [result%frequency - turning, result%frequency, result%frequency + turning]
            windows%first = 1 + points*[0, 1, 2]
            windows%blocks = reshape([1, points, points + 1, 2*points, 2*points + 1, 3*points], [2, 3])
         end if
         windows%zero = size(windows%omega) + [1, 2, 3]
         last = turning
         windows%omega = [windows%omega, -last, 0.0_wp, last]
         windows%blocks = reshape([windows%blocks, windows%zero([-1, 1])], [2, size(windows%blocks, 2) + 1])
      else
         windows%omega = [result%frequency, 0.0_wp]
         windows%zero = points + 1
         windows%blocks = reshape([1, points, points + 1, points + 1], [2, 2])
      end if
   end subroutine open_windows

   !> Transforms of a segment that the window weighs, at the frequencies asked for.
   pure function transforms_of(windows, halves, number, without_mean) result(segment)
      type(windows_t), intent(in) :: windows
      !> Integrals over its second half, and over the first, [frequencies, 2]
      complex(wp), intent(in) :: halves(:, :)
      !> Which segment, from 0
      integer, intent(in) :: number
      !> The signal less its mean, by the window too, is meant
      logical, intent(in) :: without_mean
      complex(wp) :: segment(size(windows%frequency))

      complex(wp) :: mean
      real(wp) :: sign
      integer :: points

      points = size(windows%frequency)
      if (windows%kind == window_hann) then
         sign = real(1 - 2*modulo(number, 2), wp)
         segment = 0.5_wp*whole(windows%first(0), points) - 0.25_wp*sign*(whole(windows%first(-1), points) &
            + whole(windows%first(1), points))
         mean = 0.5_wp*whole_at(windows%zero(0)) - 0.25_wp*sign*(whole_at(windows%zero(-1)) + whole_at(windows%zero(1)))
         mean = mean/windows%half
      else
         segment = halves(windows%first(0):windows%first(0) + points - 1, 1)
         mean = halves(windows%zero(0), 1)/windows%half
      end if
      if (without_mean) segment = segment - real(mean, wp)*of_window(windows, number, windows%frequency)

   contains

      !> Of both halves together.
      pure function whole(first, count) result(values)
         integer, intent(in) :: first
         integer, intent(in) :: count
         complex(wp) :: values(count)

         values = halves(first:first + count - 1, 1) + halves(first:first + count - 1, 2)
      end function whole

      pure complex(wp) function whole_at(place)
         integer, intent(in) :: place

         whole_at = halves(place, 1) + halves(place, 2)
      end function whole_at
   end function transforms_of

   !> Transform of the window of a segment.
   elemental function of_window(windows, number, omega) result(value)
      type(windows_t), intent(in) :: windows
      !> Which segment, from 0
      integer, intent(in) :: number
      real(wp), intent(in) :: omega
      complex(wp) :: value

      real(wp) :: turning

      if (windows%kind == window_hann) then
         turning = pi/windows%half
         value = 0.5_wp*of_rectangle(2.0_wp*windows%half, windows%half*real(number, wp), omega) &
            - 0.25_wp*real(1 - 2*modulo(number, 2), wp) &
            *(of_rectangle(2.0_wp*windows%half, windows%half*real(number, wp), omega - turning) &
            + of_rectangle(2.0_wp*windows%half, windows%half*real(number, wp), omega + turning))
      else
         value = of_rectangle(windows%half, windows%half*real(number, wp), omega)
      end if
   end function of_window

   !> Integral of exp(-i omega u) from an instant on.
   elemental function of_rectangle(length, from, omega) result(value)
      real(wp), intent(in) :: length
      real(wp), intent(in) :: from
      real(wp), intent(in) :: omega
      complex(wp) :: value

      real(wp) :: angle, share

      angle = 0.5_wp*omega*length
      share = 1.0_wp - angle**2/6.0_wp
      if (abs(angle) > 1.0e-4_wp) share = sin(angle)/angle
      value = length*share*exp(cmplx(0.0_wp, -omega*(from + 0.5_wp*length), wp))
   end function of_rectangle

end module spectrum_windows
