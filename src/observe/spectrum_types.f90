!> What a run leaves behind for its spectra: powers of windowed segments at each frequency (docs/theory.md, section 24).
module spectrum_types
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: run_spectrum_t, amplitudes_of

   !> Signals in the order of the scene; a transform is the integral of window times signal times exp(-i omega tau).
   type :: run_spectrum_t
      !> Places in `signal_table`, [signals]
      integer, allocatable :: of(:)
      !> omega over omega1, [frequencies]
      real(wp), allocatable :: frequency(:)
      !> Mean over the segments of the squared magnitude of the transform of a signal less its mean, and the sum of the
      !> squares of what each segment differs from it, [frequencies, signals]; NaN: the run has no segment
      real(wp), allocatable :: power(:, :), scatter(:, :)
      !> Of each signal over all segments, [signals]
      real(wp), allocatable :: mean(:)
      !> Segments that were transformed, the start of the first, and the length of each, tau
      integer :: segments = 0
      real(wp) :: start = 0.0_wp
      real(wp) :: length = 0.0_wp
      !> Integrals of the window and of its square over a segment
      real(wp) :: window = 1.0_wp
      real(wp) :: window_square = 1.0_wp
      !> How much the transforms of neighbouring segments correlate by what they share, from 0 to 1
      real(wp) :: overlap = 0.0_wp
      !> Instant from which signals were sampled, tau, and the distance of the samples; huge: closed forms were enough
      real(wp) :: sampled_from = huge(1.0_wp)
      real(wp) :: step = 0.0_wp
      !> The greatest change of a transform when every second sample is left out, [signals]
      real(wp), allocatable :: sampling_error(:)
   end type run_spectrum_t

contains

   !> Amplitudes of harmonics that a spectrum has, of a constant its own, [frequencies, signals].
   pure function amplitudes_of(spectrum) result(amplitude)
      type(run_spectrum_t), intent(in) :: spectrum
      real(wp) :: amplitude(size(spectrum%power, 1), size(spectrum%power, 2))

      amplitude = sqrt(spectrum%power)*(2.0_wp/spectrum%window)
      where (spread(spectrum%frequency, 2, size(amplitude, 2)) <= 0.0_wp) amplitude = 0.5_wp*amplitude
   end function amplitudes_of

end module spectrum_types
