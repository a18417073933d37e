!> Modified Bessel functions, scaled against overflow. (J and Y are intrinsics, in every precision.)
!>
!> `bessel_i_scaled`, `bessel_k_scaled`: the GNU Scientific Library, double precision.
!> `bessel_i_scaled_quad`, `bessel_k_scaled_quad`: quadruple precision, for the few places where a
!> determinant cancels more digits than a double has; slower.
module bessel_functions
   use, intrinsic :: iso_c_binding, only: c_double, c_int, c_ptr
   use, intrinsic :: iso_fortran_env, only: real128
   use kinds, only: i8, wp
   implicit none (type, external)
   private
   public :: qp, bessel_i_scaled, bessel_k_scaled, bessel_i_scaled_quad, bessel_k_scaled_quad

   !> Quadruple precision.
   integer, parameter :: qp = real128

   !> From here on I_2, I_3 ... come from I_0 and I_1 by recurrence: nothing cancels at such
   !> arguments, while GSL 2.7's own I_n loses digits (I_3: 8e-13 at x = 1234, 6e-9 at 1e5).
   real(wp), parameter :: recurrence_from = 20.0_wp

   !> exp(-80) is below the rounding of quadruple precision.
   real(qp), parameter :: negligible_exponent = -85.0_qp

   interface
      function gsl_sf_bessel_In_scaled(n, x) bind(c, name='gsl_sf_bessel_In_scaled') result(value)
         import :: c_double, c_int
         implicit none (type, external)
         integer(c_int), value :: n
         real(c_double), value :: x
         real(c_double) :: value
      end function gsl_sf_bessel_In_scaled
      function gsl_sf_bessel_Kn_scaled(n, x) bind(c, name='gsl_sf_bessel_Kn_scaled') result(value)
         import :: c_double, c_int
         implicit none (type, external)
         integer(c_int), value :: n
         real(c_double), value :: x
         real(c_double) :: value
      end function gsl_sf_bessel_Kn_scaled
      function gsl_set_error_handler_off() bind(c, name='gsl_set_error_handler_off') result(previous)
         import :: c_ptr
         implicit none (type, external)
         type(c_ptr) :: previous
      end function gsl_set_error_handler_off
   end interface

contains

   !> exp(-x) I_n(x)
   function bessel_i_scaled(n, x) result(value)
      !> Order, >= 0
      integer, intent(in) :: n
      !> Argument, > 0
      real(wp), intent(in) :: x
      real(wp) :: value

      call keep_gsl_from_aborting()
      if (n < 2 .or. x < recurrence_from*real(max(1, n - 2), wp)) then
         value = gsl_sf_bessel_In_scaled(int(n, c_int), x)
      else
         value = recurrence(n, -x, gsl_sf_bessel_In_scaled(0_c_int, x), gsl_sf_bessel_In_scaled(1_c_int, x))
      end if
   end function bessel_i_scaled

   !> exp(x) K_n(x). K_2, K_3 ... from K_0 and K_1: the recurrence adds positive terms, while GSL
   !> 2.7's own K_n loses digits (K_3: 1e-14 at x = 4.6, 2e-11 at 1e5).
   function bessel_k_scaled(n, x) result(value)
      !> Order, >= 0
      integer, intent(in) :: n
      !> Argument, > 0
      real(wp), intent(in) :: x
      real(wp) :: value

      call keep_gsl_from_aborting()
      if (n < 2) then
         value = gsl_sf_bessel_Kn_scaled(int(n, c_int), x)
      else
         value = recurrence(n, x, gsl_sf_bessel_Kn_scaled(0_c_int, x), gsl_sf_bessel_Kn_scaled(1_c_int, x))
      end if
   end function bessel_k_scaled

   !> K_n(x) from K_0 and K_1; I_n(-x) from I_0 and I_1.
   pure function recurrence(n, x, zeroth, first) result(value)
      !> Order, >= 1
      integer, intent(in) :: n
      real(wp), intent(in) :: x
      real(wp), intent(in) :: zeroth
      real(wp), intent(in) :: first
      real(wp) :: value

      real(wp) :: before, next
      integer :: order

      before = zeroth
      value = first
      do order = 1, n - 1
         next = before + 2.0_wp*real(order, wp)/x*value
         before = value
         value = next
      end do
   end function recurrence

   !> exp(-x) I_n(x) = 1/pi int_0^pi exp(x (cos t - 1)) cos(n t) dt (DLMF 10.32.3) by the trapezoidal
   !> rule, which converges exponentially: the integrand is periodic.
   pure function bessel_i_scaled_quad(n, x) result(value)
      !> Order, >= 0
      integer, intent(in) :: n
      !> Argument, > 0
      real(qp), intent(in) :: x
      real(qp) :: value

      real(qp), parameter :: pi_quad = acos(-1.0_qp)
      real(qp) :: exponent, weight
      integer(i8) :: intervals, k

      intervals = max(48_i8, ceiling(10.0_qp*sqrt(x), i8)) + int(n, i8)
      value = 0.5_qp
      do k = 1_i8, intervals
         ! cos t - 1 without cancellation
         exponent = -2.0_qp*x*sin(0.5_qp*pi_quad*real(k, qp)/real(intervals, qp))**2
         if (exponent < negligible_exponent) exit
         weight = merge(0.5_qp, 1.0_qp, k == intervals)
         value = value + weight*exp(exponent)*cos(pi_quad*real(int(n, i8)*k, qp)/real(intervals, qp))
      end do
      value = value/real(intervals, qp)
   end function bessel_i_scaled_quad

   !> exp(x) K_n(x) = int_0^infinity exp(-x (cosh t - 1)) cosh(n t) dt (DLMF 10.32.9) by the
   !> trapezoidal rule, which converges exponentially: the integrand is even and dies out twice
   !> exponentially.
   pure function bessel_k_scaled_quad(n, x) result(value)
      !> Order, >= 0
      integer, intent(in) :: n
      !> Argument, > 0
      real(qp), intent(in) :: x
      real(qp) :: value

      real(qp) :: exponent, step, t
      integer :: k

      step = min(0.1_qp, 0.4_qp/sqrt(x))
      value = 0.5_qp
      k = 0
      do
         k = k + 1
         t = step*real(k, qp)
         exponent = -2.0_qp*x*sinh(0.5_qp*t)**2
         if (exponent + real(n, qp)*t < negligible_exponent) exit
         value = value + 0.5_qp*(exp(exponent + real(n, qp)*t) + exp(exponent - real(n, qp)*t))
      end do
      value = value*step
   end function bessel_k_scaled_quad

   !> GSL's default is to abort the program when a result underflows.
   subroutine keep_gsl_from_aborting()
      type(c_ptr) :: previous

      previous = gsl_set_error_handler_off()
   end subroutine keep_gsl_from_aborting

end module bessel_functions
