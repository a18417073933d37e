!> Signals through one interval of a motion, written out: a cubic polynomial and exponentials, each with the exponents
!> of all and amplitudes of its own. Integrals that no sample has to meet follow from these.
module interval_sums
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: interval_sums_t, open_sums, derivative_of, value_of

   !> sum power(k) t^k + Re sum amplitude exp(exponent t), t since the start of the interval, of each signal.
   type :: interval_sums_t
      !> [0:3, signals]
      real(wp), allocatable :: power(:, :)
      !> [terms]
      complex(wp), allocatable :: exponent(:)
      !> [signals, terms]
      complex(wp), allocatable :: amplitude(:, :)
   end type interval_sums_t

contains

   !> Signals that are zero, with room for some exponentials.
   pure subroutine open_sums(signals, terms, sums)
      integer, intent(in) :: signals
      integer, intent(in) :: terms
      type(interval_sums_t), intent(out) :: sums

      allocate (sums%power(0:3, signals), source=0.0_wp)
      allocate (sums%exponent(terms), sums%amplitude(signals, terms), source=(0.0_wp, 0.0_wp))
   end subroutine open_sums

   !> The derivative of one signal takes its place.
   pure subroutine derivative_of(sums, signal)
      type(interval_sums_t), intent(inout) :: sums
      integer, intent(in) :: signal

      sums%power(:, signal) = [[1.0_wp, 2.0_wp, 3.0_wp]*sums%power(1:3, signal), 0.0_wp]
      sums%amplitude(signal, :) = sums%amplitude(signal, :)*sums%exponent
   end subroutine derivative_of

   !> All signals at a time.
   pure function value_of(sums, time) result(values)
      type(interval_sums_t), intent(in) :: sums
      !> Since the start of the interval
      real(wp), intent(in) :: time
      real(wp) :: values(size(sums%power, 2))

      values = sums%power(0, :) + time*(sums%power(1, :) + time*(sums%power(2, :) + time*sums%power(3, :)))
      if (size(sums%exponent) == 0) return
      values = values + real(matmul(sums%amplitude, exp(sums%exponent*time)), wp)
   end function value_of

end module interval_sums
