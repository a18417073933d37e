!> Integrals of signals and of their squares over a stretch of a phase, in closed form (docs/theory.md, section 20).
!>
!> All signals of a phase are sums of the same exponentials with amplitudes of their own, besides a constant and a
!> slope; a square is one sum over pairs of exponents. Over stretches of one length, again and again, that sum is a real
!> matrix made once.
module signal_integrals
   use kinds, only: wp
   use power_integrals, only: integral
   implicit none (type, external)
   private
   public :: signals_t, squares_t, integrate_signals, make_squares, are_squares_of

   !> offset + slope t + Re sum amplitude exp(exponent t), of each signal.
   type :: signals_t
      !> [signals]
      real(wp), allocatable :: offset(:), slope(:)
      !> [terms]
      complex(wp), allocatable :: exponent(:)
      !> [signals, terms]
      complex(wp), allocatable :: amplitude(:, :)
   end type signals_t

   !> What the terms of signals make of their squares over a stretch of one length: x^T matrix x with x the real parts
   !> of all amplitudes, then the imaginary ones.
   type :: squares_t
      real(wp) :: length = 0.0_wp
      !> [terms]
      complex(wp), allocatable :: exponent(:)
      !> [2 terms, 2 terms]
      real(wp), allocatable :: matrix(:, :)
   end type squares_t

contains

   !> Integrals from one instant to another.
   pure subroutine integrate_signals(signals, from, to, first, second, squares)
      type(signals_t), intent(in) :: signals
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
      !> Of each signal and of its square, [signals]
      real(wp), intent(out) :: first(:)
      real(wp), intent(out) :: second(:)
      !> Of their exponents, and of that length but for rounding; not given: all pairs are summed up
      type(squares_t), intent(in), optional :: squares

      complex(wp) :: amplitude(size(signals%amplitude, 1), size(signals%exponent)), power(size(signals%exponent))
      complex(wp) :: plain, conjugate, ramp
      real(wp) :: offset(size(first)), length, share
      integer :: m, n

      length = to - from
      offset = signals%offset + signals%slope*from
      associate (s => signals%exponent, slope => signals%slope)
         first = length*(offset + 0.5_wp*slope*length)
         second = length*(offset*(offset + slope*length) + slope**2*length**2/3.0_wp)
         power = exp(s*length)
         do n = 1, size(s)
            amplitude(:, n) = signals%amplitude(:, n)*exp(s(n)*from)
            plain = integral(s(n), length, power(n))
            ramp = ramp_integral(s(n), length, power(n))
            first = first + real(amplitude(:, n)*plain, wp)
            second = second + 2.0_wp*real(amplitude(:, n)*(offset*plain + slope*ramp), wp)
            if (present(squares)) cycle
            ! symmetric in the two terms, up to conjugation
            do m = 1, n
               share = merge(0.5_wp, 1.0_wp, m == n)
               plain = share*integral(s(m) + s(n), length, power(m)*power(n))
               conjugate = share*integral(s(m) + conjg(s(n)), length, power(m)*conjg(power(n)))
               second = second + real(amplitude(:, m)*(amplitude(:, n)*plain + conjg(amplitude(:, n))*conjugate), wp)
            end do
         end do
         ! rounding of its ends may make a stretch a little longer
         if (present(squares)) second = second + squares_by(squares, amplitude) + (length - squares%length) &
            *real(matmul(amplitude, power), wp)**2
      end associate
   end subroutine integrate_signals

   !> Prepare for many stretches of one length.
   pure subroutine make_squares(exponent, length, squares)
      complex(wp), intent(in) :: exponent(:)
      real(wp), intent(in) :: length
      type(squares_t), intent(out) :: squares

      complex(wp) :: conjugate, plain, power(size(exponent))
      integer :: m, n

      squares%length = length
      allocate (squares%exponent, source=exponent)
      power = exp(exponent*length)
      associate (k => size(exponent), s => exponent)
         allocate (squares%matrix(2*k, 2*k))
         do n = 1, k
            do m = 1, k
               plain = 0.5_wp*integral(s(m) + s(n), length, power(m)*power(n))
               conjugate = 0.5_wp*integral(s(m) + conjg(s(n)), length, power(m)*conjg(power(n)))
               squares%matrix(m, n) = real(conjugate, wp) + real(plain, wp)
               squares%matrix(k + m, k + n) = real(conjugate, wp) - real(plain, wp)
               squares%matrix(m, k + n) = aimag(conjugate) - aimag(plain)
               squares%matrix(k + m, n) = -aimag(conjugate) - aimag(plain)
            end do
         end do
      end associate
   end subroutine make_squares

   !> Are they those of these exponents, over such a length?
   pure function are_squares_of(squares, exponent, length) result(are)
      type(squares_t), intent(in) :: squares
      complex(wp), intent(in) :: exponent(:)
      real(wp), intent(in) :: length
      logical :: are

      are = allocated(squares%exponent)
      if (are) are = size(squares%exponent) == size(exponent) .and. abs(squares%length - length) <= 0.0_wp
      if (are) are = all(abs(squares%exponent - exponent) <= 0.0_wp)
   end function are_squares_of

   !> Integrals of the squares of sums of terms.
   pure function squares_by(squares, amplitude) result(integrals)
      type(squares_t), intent(in) :: squares
      !> At the start of the stretch, [signals, terms]
      complex(wp), intent(in) :: amplitude(:, :)
      real(wp) :: integrals(size(amplitude, 1))

      ! products of what has died out would be subnormal, which is slow
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
   end function squares_by

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
