!> Results of a run for its spectra: powers of windowed segments at each frequency (docs/theory.md, section 24).
module spectrum_types
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: run_spectrum_t, amplitudes_of

   !> Powers of the signals, in the order of the scene. A transform is the integral of window times signal times
   !> exp(-i omega tau) over a segment.
   type :: run_spectrum_t
      !> Indices of the signals in `signal_table`, [signals]
      integer, allocatable :: of(:)
      !> Frequencies omega over omega1, [frequencies]
      real(wp), allocatable :: frequency(:)
      !> Power: squared magnitude of the transform of the signal minus its mean, averaged over the segments,
      !> [frequencies, signals]
      real(wp), allocatable :: power(:, :)
      !> Sum of the squared deviations of the segments' powers from this average, [frequencies, signals]
      real(wp), allocatable :: scatter(:, :)
      !> Mean of each signal over all segments, [signals]
      real(wp), allocatable :: mean(:)
      !> Number of transformed segments
      integer :: segments = 0
      !> Start of the first segment, tau
      real(wp) :: start = 0.0_wp
      !> Length of a segment, tau
      real(wp) :: length = 0.0_wp
      !> Integral of the window over a segment
      real(wp) :: window = 1.0_wp
      !> Integral of the squared window over a segment
      real(wp) :: window_square = 1.0_wp
      !> Correlation of the powers of neighbouring segments by their overlap, from 0 to 1
      real(wp) :: overlap = 0.0_wp
      !> Instant after which signals were sampled, tau; `huge`: no signal was sampled
      real(wp) :: sampled_from = huge(1.0_wp)
      !> Sampling interval, tau
      real(wp) :: step = 0.0_wp
      !> Maximum change of a transform if every second sample is left out, [signals]
      real(wp), allocatable :: sampling_error(:)
   end type run_spectrum_t

contains

   !> Amplitudes of the harmonics in a spectrum (at frequency 0: of the constant), [frequencies, signals].
   pure function amplitudes_of(spectrum) result(amplitude)
      type(run_spectrum_t), intent(in) :: spectrum
      real(wp) :: amplitude(size(spectrum%power, 1), size(spectrum%power, 2))

      amplitude = sqrt(spectrum%power)*(2.0_wp/spectrum%window)
      where (spread(spectrum%frequency, 2, size(amplitude, 2)) <= 0.0_wp) amplitude = 0.5_wp*amplitude
   end function amplitudes_of

end module spectrum_types
