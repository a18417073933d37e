!> Signals over one interval of a motion as sums of exponentials, whose exponents are common to all signals, and of a
!> cubic polynomial of time. Their integrals follow in closed form, without samples.
module exponential_sums
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: exponential_sums_t, open_sums, append_terms, differentiate, value_of

   !> Each signal is sum power(k) t^k + Re sum amplitude exp(exponent t); t is the time since the start of the interval.
   type :: exponential_sums_t
      !> Coefficients of the powers of t, [0:3, signals]
      real(wp), allocatable :: power(:, :)
      !> Exponents, [terms]
      complex(wp), allocatable :: exponent(:)
      !> Amplitudes, [signals, terms]
      complex(wp), allocatable :: amplitude(:, :)
   end type exponential_sums_t

contains

   !> Allocate sums that are zero.
   pure subroutine open_sums(signals, terms, sums)
      !> Number of signals
      integer, intent(in) :: signals
      !> Number of exponentials
      integer, intent(in) :: terms
      type(exponential_sums_t), intent(out) :: sums

      allocate (sums%power(0:3, signals), source=0.0_wp)
      allocate (sums%exponent(terms), sums%amplitude(signals, terms), source=(0.0_wp, 0.0_wp))
   end subroutine open_sums

   !> Append exponentials with the amplitude zero.
   pure subroutine append_terms(exponent, sums)
      complex(wp), intent(in) :: exponent(:)
      type(exponential_sums_t), intent(inout) :: sums

      complex(wp), allocatable :: amplitude(:, :)

      associate (known => size(sums%exponent))
         allocate (amplitude(size(sums%power, 2), known + size(exponent)), source=(0.0_wp, 0.0_wp))
         amplitude(:, :known) = sums%amplitude
      end associate
      call move_alloc(amplitude, sums%amplitude)
      sums%exponent = [sums%exponent, exponent]
   end subroutine append_terms

   !> Replace a signal by its derivative.
   pure subroutine differentiate(sums, signal)
      type(exponential_sums_t), intent(inout) :: sums
      !> Index of the signal
      integer, intent(in) :: signal

      sums%power(:, signal) = [[1.0_wp, 2.0_wp, 3.0_wp]*sums%power(1:3, signal), 0.0_wp]
      sums%amplitude(signal, :) = sums%amplitude(signal, :)*sums%exponent
   end subroutine differentiate

   !> Values of all signals at a time.
   pure function value_of(sums, time) result(values)
      type(exponential_sums_t), intent(in) :: sums
      !> Time since the start of the interval
      real(wp), intent(in) :: time
      real(wp) :: values(size(sums%power, 2))

      values = sums%power(0, :) + time*(sums%power(1, :) + time*(sums%power(2, :) + time*sums%power(3, :)))
      if (size(sums%exponent) == 0) return
      values = values + real(matmul(sums%amplitude, exp(sums%exponent*time)), wp)
   end function value_of

end module exponential_sums
