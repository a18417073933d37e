!> Integrals of signals and of their squares over an interval of a phase, in closed form (docs/theory.md, section 20).
!>
!> All signals of a phase are sums of the same exponentials with different amplitudes, besides a constant and a slope.
!> The integral of a square is a sum over pairs of exponents: a quadratic form of the amplitudes, whose real matrix
!> serves all intervals of one length.
module signal_integrals
   use kinds, only: wp
   use power_integrals, only: integral
   implicit none (type, external)
   private
   public :: signals_t, squares_t, integrate_signals

   !> offset + slope t + Re sum amplitude exp(exponent t), of each signal.
   type :: signals_t
      !> Constant and slope of each signal, [signals]
      real(wp), allocatable :: offset(:), slope(:)
      !> Exponents s, Re s <= 0, [terms]
      complex(wp), allocatable :: exponent(:)
      !> Amplitudes at time 0, [signals, terms]
      complex(wp), allocatable :: amplitude(:, :)
   end type signals_t

   !> Quadratic form of the integrals of squares over an interval of one length: x^T matrix x with x the real parts of
   !> all amplitudes, then the imaginary parts.
   type :: squares_t
      !> Length of the interval
      real(wp), private :: length = 0.0_wp
      !> Exponents s, [terms]
      complex(wp), allocatable, private :: exponent(:)
      !> 1/(s_m + s_n) and 1/(s_m + conjg(s_n)), 0 where that is infinite, [terms, terms, 2]
      complex(wp), allocatable, private :: inverse(:, :, :)
      !> The quadratic form, [2 terms, 2 terms]
      real(wp), allocatable :: matrix(:, :)
   end type squares_t

contains

   !> Integrals from one instant to another.
   pure subroutine integrate_signals(signals, from, to, squares, first, second)
      type(signals_t), intent(in) :: signals
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
      !> The quadratic form, computed anew if the exponents or the length of the interval have changed
      type(squares_t), intent(inout) :: squares
      !> Integrals of each signal and of its square, [signals]
      real(wp), intent(out) :: first(:)
      real(wp), intent(out) :: second(:)

      ! lengths that differ by less than this share are equal: the ends of an interval are rounded
      real(wp), parameter :: rounding = 1.0e-9_wp
      complex(wp) :: amplitude(size(signals%amplitude, 1), size(signals%exponent)), power(size(signals%exponent))
      complex(wp) :: plain, ramp
      real(wp) :: offset(size(first)), length
      integer :: n

      length = to - from
      offset = signals%offset + signals%slope*from
      associate (s => signals%exponent, slope => signals%slope)
         call find_inverses(s, squares)
         if (abs(length - squares%length) > rounding*squares%length) call make_squares(length, squares)
         first = length*(offset + 0.5_wp*slope*length)
         second = length*(offset*(offset + slope*length) + slope**2*length**2/3.0_wp)
         power = exp(s*length)
         do n = 1, size(s)
            amplitude(:, n) = signals%amplitude(:, n)
            if (from > 0.0_wp) amplitude(:, n) = amplitude(:, n)*exp(s(n)*from)
            plain = integral(s(n), length, power(n))
            ramp = (0.0_wp, 0.0_wp)
            if (any(abs(slope) > 0.0_wp)) ramp = ramp_integral(s(n), length, power(n))
            first = first + real(amplitude(:, n)*plain, wp)
            second = second + 2.0_wp*real(amplitude(:, n)*(offset*plain + slope*ramp), wp)
         end do
         second = second + integrate_squares(squares, amplitude) + (length - squares%length) &
            *real(matmul(amplitude, power), wp)**2
      end associate
   end subroutine integrate_signals

   !> Store the exponents and the inverses of their sums.
   pure subroutine find_inverses(exponent, squares)
      complex(wp), intent(in) :: exponent(:)
      type(squares_t), intent(inout) :: squares

      integer :: m, n

      if (allocated(squares%exponent)) then
         if (size(squares%exponent) == size(exponent)) then
            associate (change => squares%exponent - exponent)
               if (all(abs(real(change, wp)) + abs(aimag(change)) <= 0.0_wp)) return
            end associate
         end if
         deallocate (squares%exponent, squares%inverse, squares%matrix)
      end if
      squares%length = 0.0_wp
      allocate (squares%exponent, source=exponent)
      associate (k => size(exponent), s => exponent)
         allocate (squares%inverse(k, k, 2), source=(0.0_wp, 0.0_wp))
         allocate (squares%matrix(2*k, 2*k))
         do n = 1, k
            do m = 1, k
               if (abs(s(m) + s(n)) > 0.0_wp) squares%inverse(m, n, 1) = 1.0_wp/(s(m) + s(n))
               if (abs(s(m) + conjg(s(n))) > 0.0_wp) squares%inverse(m, n, 2) = 1.0_wp/(s(m) + conjg(s(n)))
            end do
         end do
      end associate
   end subroutine find_inverses

   !> Compute the quadratic form for intervals of one length.
   pure subroutine make_squares(length, squares)
      real(wp), intent(in) :: length
      !> In: exponents and inverses from `find_inverses`
      type(squares_t), intent(inout) :: squares

      complex(wp) :: conjugate, plain, power(size(squares%exponent))
      integer :: m, n

      squares%length = length
      power = exp(squares%exponent*length)
      associate (k => size(power), s => squares%exponent)
         do n = 1, k
            ! the matrix is symmetric in the two terms, up to conjugation
            do m = 1, n
               plain = 0.5_wp*pair_integral(s(m) + s(n), squares%inverse(m, n, 1), power(m)*power(n))
               conjugate = 0.5_wp*pair_integral(s(m) + conjg(s(n)), squares%inverse(m, n, 2), power(m)*conjg(power(n)))
               squares%matrix(m, n) = real(conjugate, wp) + real(plain, wp)
               squares%matrix(n, m) = squares%matrix(m, n)
               squares%matrix(k + m, k + n) = real(conjugate, wp) - real(plain, wp)
               squares%matrix(k + n, k + m) = squares%matrix(k + m, k + n)
               squares%matrix(m, k + n) = aimag(conjugate) - aimag(plain)
               squares%matrix(k + n, m) = squares%matrix(m, k + n)
               squares%matrix(k + m, n) = -aimag(conjugate) - aimag(plain)
               squares%matrix(n, k + m) = squares%matrix(k + m, n)
            end do
         end do
      end associate

   contains

      !> Integral of exp(s t) over the length, by the stored inverse unless that cancels.
      pure function pair_integral(s, inverse, end) result(value)
         complex(wp), intent(in) :: s
         complex(wp), intent(in) :: inverse
         !> exp(s length)
         complex(wp), intent(in) :: end
         complex(wp) :: value

         if ((abs(real(s, wp)) + abs(aimag(s)))*length < 0.1_wp) then
            value = integral(s, length, end)
         else
            value = (end - 1.0_wp)*inverse
         end if
      end function pair_integral
   end subroutine make_squares

   !> Integrals of the squares of sums of exponentials.
   pure function integrate_squares(squares, amplitude) result(integrals)
      type(squares_t), intent(in) :: squares
      !> Amplitudes at the start of the interval, [signals, terms]
      complex(wp), intent(in) :: amplitude(:, :)
      real(wp) :: integrals(size(amplitude, 1))

      ! products of smaller amplitudes would be subnormal, which is slow
      real(wp), parameter :: negligible = 1.0e-140_wp
      real(wp), allocatable :: parts(:, :), products(:, :)

      associate (k => size(amplitude, 2))
         allocate (parts(2*k, size(amplitude, 1)), products(2*k, size(amplitude, 1)))
         parts(:k, :) = transpose(real(amplitude, wp))
         parts(k + 1:, :) = transpose(aimag(amplitude))
         where (abs(parts) < negligible) parts = 0.0_wp
         products = matmul(squares%matrix, parts)
         integrals = sum(parts*products, dim=1)
      end associate
   end function integrate_squares

   !> Integral of t exp(s t) without cancellation.
   elemental function ramp_integral(s, t, power) result(value)
      complex(wp), intent(in) :: s
      real(wp), intent(in) :: t
      !> exp(s t)
      complex(wp), intent(in) :: power
      complex(wp) :: value

      complex(wp) :: x

      x = s*t
      if (abs(x) < 1.0_wp) then
         value = t**2*series(x)
      else
         value = t**2*(power*(x - 1.0_wp) + 1.0_wp)/x**2
      end if

   contains

      !> sum over k of x^k/(k! (k + 2)).
      pure function series(x) result(sum)
         complex(wp), intent(in) :: x
         complex(wp) :: sum

         real(wp) :: factorial
         integer :: i

         sum = (0.0_wp, 0.0_wp)
         factorial = gamma(20.0_wp)
         do i = 19, 0, -1
            sum = 1.0_wp/(factorial*real(i + 2, wp)) + x*sum
            factorial = factorial/real(max(i, 1), wp)
         end do
      end function series
   end function ramp_integral

end module signal_integrals
