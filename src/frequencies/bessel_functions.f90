!> Modified Bessel functions, scaled against overflow. (J and Y are Fortran intrinsics in every precision.)
!>
!> `bessel_i_scaled`, `bessel_k_scaled`: double precision.
!> `bessel_i_scaled_quad`, `bessel_k_scaled_quad`: quadruple precision, slower, for the few cases in which the
!> cancellation in a determinant exceeds double precision.
module bessel_functions
   use, intrinsic :: iso_fortran_env, only: real128
   use kinds, only: i8, pi, wp
   implicit none (type, external)
   private
   public :: qp, pi_quad, bessel_i_scaled, bessel_k_scaled, bessel_i_scaled_quad, bessel_k_scaled_quad

   !> Quadruple precision.
   integer, parameter :: qp = real128
   !> Value of pi, given as a literal because not every compiler computes acos in quadruple precision.
   real(qp), parameter :: pi_quad = 3.1415926535897932384626433832795029_qp

   !> Exponent below which terms are negligible in double precision: exp(-40) is below its rounding.
   real(wp), parameter :: negligible_double = -40.0_wp
   !> Exponent below which terms are negligible in quadruple precision: exp(-85) is below its rounding.
   real(qp), parameter :: negligible_quad = -85.0_qp

contains

   !> The function exp(-x) I_n(x), by the power series if it is short, else by the integral.
   pure real(wp) function bessel_i_scaled(n, x) result(value)
      !> Order, >= 0
      integer, intent(in) :: n
      !> Argument, > 0
      real(wp), intent(in) :: x

      if (is_short_series(n, x)) then
         value = real(bessel_i_series(n, real(x, qp)), wp)
      else
         value = bessel_i_integral(n, x)
      end if
   end function bessel_i_scaled

   !> The function exp(x) K_n(x), by a recurrence that adds positive terms.
   pure real(wp) function bessel_k_scaled(n, x) result(value)
      !> Order, >= 0
      integer, intent(in) :: n
      !> Argument, > 0
      real(wp), intent(in) :: x

      if (n < 2) then
         value = bessel_k_integral(n, x)
      else
         value = bessel_k_recurrence(n, x, bessel_k_integral(0, x), bessel_k_integral(1, x))
      end if
   end function bessel_k_scaled

   !> Whether the power series of I_n has few terms. Otherwise I_n exceeds I_0/2, so that its integral has no
   !> cancellation.
   pure logical function is_short_series(n, x) result(is_short)
      !> Order, >= 0
      integer, intent(in) :: n
      !> Argument, > 0
      real(wp), intent(in) :: x

      is_short = x < real(max(5, n**2), wp)
   end function is_short_series

   !> exp(-x) I_n(x) = exp(-x) (x/2)^n/n! (1 + (x/2)^2/(1 (n + 1)) (1 + (x/2)^2/(2 (n + 2)) (1 + ...))),
   !> all terms positive (DLMF 10.25.2).
   pure function bessel_i_series(n, x) result(value)
      !> Order, >= 0
      integer, intent(in) :: n
      !> Argument, > 0
      real(qp), intent(in) :: x
      real(qp) :: value

      real(qp) :: square
      integer :: k

      square = 0.25_qp*x**2
      value = 1.0_qp
      ! further terms are below rounding
      do k = 20 + ceiling(2.0_qp*x), 1, -1
         value = 1.0_qp + square/real(k*(n + k), qp)*value
      end do
      value = value*exp(-x)
      do k = 1, n
         value = value*(0.5_qp*x/real(k, qp))
      end do
   end function bessel_i_series

   !> The integral of `bessel_i_scaled_quad`, evaluated in double precision.
   pure real(wp) function bessel_i_integral(n, x) result(value)
      !> Order, >= 0
      integer, intent(in) :: n
      !> Argument, >= max(5, n^2)
      real(wp), intent(in) :: x

      real(wp) :: exponent, step
      integer(i8) :: intervals, k

      ! with so many intervals the error of the trapezoidal rule is below rounding
      intervals = 8_i8 + ceiling(5.0_wp*sqrt(x), i8) + int(n, i8)
      step = pi/real(intervals, wp)
      value = 0.5_wp
      do k = 1_i8, intervals
         exponent = -2.0_wp*x*sin(0.5_wp*step*real(k, wp))**2
         if (exponent < negligible_double) exit
         value = value + merge(0.5_wp, 1.0_wp, k == intervals)*exp(exponent)*cos(real(int(n, i8)*k, wp)*step)
      end do
      value = value/real(intervals, wp)
   end function bessel_i_integral

   !> The integral of `bessel_k_scaled_quad`, evaluated in double precision.
   pure real(wp) function bessel_k_integral(n, x) result(value)
      !> Order
      integer, intent(in) :: n
      !> Argument, > 0
      real(wp), intent(in) :: x

      real(wp) :: exponent, step, t
      integer :: k

      ! with this step the error of the trapezoidal rule is below rounding
      step = min(0.2_wp, 0.6_wp/sqrt(x))
      value = 0.5_wp
      k = 0
      do
         k = k + 1
         t = step*real(k, wp)
         exponent = -2.0_wp*x*sinh(0.5_wp*t)**2
         if (exponent + real(n, wp)*t < negligible_double) exit
         value = value + exp(exponent)*cosh(real(n, wp)*t)
      end do
      value = value*step
   end function bessel_k_integral

   !> K_n(x) from K_0(x) and K_1(x) by forward recurrence; all three may be scaled by the same factor.
   pure real(wp) function bessel_k_recurrence(n, x, zeroth, first) result(value)
      !> Order, >= 1
      integer, intent(in) :: n
      !> Argument
      real(wp), intent(in) :: x
      !> K_0(x)
      real(wp), intent(in) :: zeroth
      !> K_1(x)
      real(wp), intent(in) :: first

      real(wp) :: previous, next
      integer :: order

      previous = zeroth
      value = first
      do order = 1, n - 1
         next = previous + 2.0_wp*real(order, wp)/x*value
         previous = value
         value = next
      end do
   end function bessel_k_recurrence

   !> exp(-x) I_n(x) = 1/pi int_0^pi exp(x (cos t - 1)) cos(n t) dt (DLMF 10.32.3) by the trapezoidal
   !> rule, which converges exponentially: the integrand is periodic.
   pure function bessel_i_scaled_quad(n, x) result(value)
      !> Order, >= 0
      integer, intent(in) :: n
      !> Argument, > 0
      real(qp), intent(in) :: x
      real(qp) :: value

      real(qp) :: exponent, weight
      integer(i8) :: intervals, k

      if (is_short_series(n, real(x, wp))) then
         value = bessel_i_series(n, x)
         return
      end if
      ! with so many intervals the error of the trapezoidal rule is below rounding
      intervals = max(48_i8, ceiling(10.0_qp*sqrt(x), i8)) + int(n, i8)
      value = 0.5_qp
      do k = 1_i8, intervals
         ! cos t - 1 without cancellation
         exponent = -2.0_qp*x*sin(0.5_qp*pi_quad*real(k, qp)/real(intervals, qp))**2
         if (exponent < negligible_quad) exit
         weight = merge(0.5_qp, 1.0_qp, k == intervals)
         value = value + weight*exp(exponent)*cos(pi_quad*real(int(n, i8)*k, qp)/real(intervals, qp))
      end do
      value = value/real(intervals, qp)
   end function bessel_i_scaled_quad

   !> exp(x) K_n(x) = int_0^infinity exp(-x (cosh t - 1)) cosh(n t) dt (DLMF 10.32.9) by the
   !> trapezoidal rule, which converges exponentially: the integrand is even and decays double
   !> exponentially.
   pure function bessel_k_scaled_quad(n, x) result(value)
      !> Order, >= 0
      integer, intent(in) :: n
      !> Argument, > 0
      real(qp), intent(in) :: x
      real(qp) :: value

      real(qp) :: exponent, step, t
      integer :: k

      ! with this step the error of the trapezoidal rule is below rounding
      step = min(0.1_qp, 0.4_qp/sqrt(x))
      value = 0.5_qp
      k = 0
      do
         k = k + 1
         t = step*real(k, qp)
         exponent = -2.0_qp*x*sinh(0.5_qp*t)**2
         if (exponent + real(n, qp)*t < negligible_quad) exit
         value = value + 0.5_qp*(exp(exponent + real(n, qp)*t) + exp(exponent - real(n, qp)*t))
      end do
      value = value*step
   end function bessel_k_scaled_quad

end module bessel_functions
