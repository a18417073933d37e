!> Signals over one interval of a motion as sums of exponentials, whose exponents are common to all signals, and of a
!> cubic polynomial of time. Their integrals follow in closed form, without samples.
module exponential_sums
   use kinds, only: wp
   use power_integrals, only: integral
   implicit none (type, external)
   private
   public :: exponential_sums_t, open_sums, differentiate, square_integral, value_of

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

   !> Integral of the square of a signal from one time to another. Powers beyond a constant are allowed without
   !> exponentials only.
   pure function square_integral(sums, signal, from, to) result(square)
      type(exponential_sums_t), intent(in) :: sums
      integer, intent(in) :: signal
      !> Beginning of the span, since the start of the interval
      real(wp), intent(in) :: from
      !> End of the span, since the start of the interval
      real(wp), intent(in) :: to
      real(wp) :: square

      complex(wp), dimension(size(sums%exponent) + 1) :: exponent, amplitude, power
      real(wp) :: length, start(0:3)
      integer :: i, k

      length = to - from
      associate (p => sums%power(:, signal))
         start = [p(1) + from*(p(2) + from*(p(3) + from*p(4))), p(2) + from*(2.0_wp*p(3) + 3.0_wp*from*p(4)), &
            p(3) + 3.0_wp*from*p(4), p(4)]
      end associate
      square = 0.0_wp
      if (size(sums%exponent) == 0) then
         do i = 0, 3
            do k = 0, 3
               square = square + start(i)*start(k)*length**(i + k + 1)/real(i + k + 1, wp)
            end do
         end do
         return
      end if
      exponent = [(0.0_wp, 0.0_wp), sums%exponent]
      amplitude = [cmplx(start(0), 0.0_wp, wp), sums%amplitude(signal, :)*exp(from*sums%exponent)]
      power = exp(length*exponent)
      do i = 1, size(exponent)
         do k = 1, i
            square = square + merge(0.5_wp, 1.0_wp, k == i)*real( &
               amplitude(i)*amplitude(k)*integral(exponent(i) + exponent(k), length, power(i)*power(k)) &
               + amplitude(i)*conjg(amplitude(k))*integral(exponent(i) + conjg(exponent(k)), length, &
               power(i)*conjg(power(k))), wp)
         end do
      end do
   end function square_integral

end module exponential_sums
