!> Integrals of signals and of their squares over a stretch of a phase, in closed form (docs/theory.md, section 20).
!>
!> All signals of a phase are sums of the same exponentials with amplitudes of their own, besides a constant and a
!> slope; a square is one sum over pairs of exponents.
module signal_integrals
   use kinds, only: wp
   use power_integrals, only: integral
   implicit none (type, external)
   private
   public :: signals_t, integrate_signals

   !> offset + slope t + Re sum amplitude exp(exponent t), of each signal.
   type :: signals_t
      !> [signals]
      real(wp), allocatable :: offset(:), slope(:)
      !> [terms]
      complex(wp), allocatable :: exponent(:)
      !> [signals, terms]
      complex(wp), allocatable :: amplitude(:, :)
   end type signals_t

contains

   !> Integrals from one instant to another.
   pure subroutine integrate_signals(signals, from, to, first, second)
      type(signals_t), intent(in) :: signals
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
      !> Of each signal and of its square, [signals]
      real(wp), intent(out) :: first(:)
      real(wp), intent(out) :: second(:)

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
            ! symmetric in the two terms, up to conjugation
            do m = 1, n
               share = merge(0.5_wp, 1.0_wp, m == n)
               plain = share*integral(s(m) + s(n), length, power(m)*power(n))
               conjugate = share*integral(s(m) + conjg(s(n)), length, power(m)*conjg(power(n)))
               second = second + real(amplitude(:, m)*(amplitude(:, n)*plain + conjg(amplitude(:, n))*conjugate), wp)
            end do
         end do
      end associate
   end subroutine integrate_signals

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
