!> Nonlinear least squares by the method of Levenberg and Marquardt, from C/C++ Minpack (J. J. More, B. S. Garbow,
!> K. E. Hillstrom, ANL-80-74, 1980): lmdif, which differences the residuals itself.
module least_squares
   use, intrinsic :: iso_c_binding, only: c_double, c_f_pointer, c_funloc, c_funptr, c_int, c_loc, c_ptr
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: residuals_t, minimise, final_tolerance

   !> Relative tolerance of the last minimisation, so small that residuals may vanish.
   real(wp), parameter :: final_tolerance = 1.0e-14_wp

   !> A function of which the sum of squares is minimised; extensions have its data.
   type, abstract :: residuals_t
   contains
      procedure(evaluate_interface), deferred :: evaluate
   end type residuals_t

   abstract interface
      !> Evaluate the residuals at a point.
      subroutine evaluate_interface(self, x, residual)
         import :: residuals_t, wp
         implicit none (type, external)
         class(residuals_t), intent(inout) :: self
         real(wp), intent(in) :: x(:)
         !> Residuals, [data]
         real(wp), intent(out) :: residual(:)
      end subroutine evaluate_interface
   end interface

   !> User data that the C function passes to `evaluate_for_c`.
   type :: handle_t
      class(residuals_t), pointer :: residuals => null()
   end type handle_t

   interface
      function lmdif(fcn, p, m, n, x, fvec, ftol, xtol, gtol, maxfev, epsfcn, diag, mode, factor, nprint, nfev, fjac, &
         ldfjac, ipvt, qtf, wa1, wa2, wa3, wa4) result(info) bind(c, name='lmdif')
         import :: c_double, c_funptr, c_int, c_ptr
         implicit none (type, external)
         type(c_funptr), value :: fcn
         type(c_ptr), value :: p
         integer(c_int), value :: m, n, maxfev, mode, nprint, ldfjac
         real(c_double), value :: ftol, xtol, gtol, epsfcn, factor
         real(c_double), intent(inout) :: x(n), diag(n)
         real(c_double), intent(out) :: fvec(m), fjac(ldfjac, n), qtf(n), wa1(n), wa2(n), wa3(n), wa4(m)
         integer(c_int), intent(out) :: nfev, ipvt(n)
         integer(c_int) :: info
      end function lmdif
   end interface

contains

   !> Find a local minimum of the sum of squares from a point.
   subroutine minimise(residuals, count, tolerance, x, sum_of_squares, evaluations, max_evaluations)
      class(residuals_t), target, intent(inout) :: residuals
      !> Number of residuals, at least as many as coordinates
      integer, intent(in) :: count
      !> The search ends if the relative change of the sum of squares or of the point is less than this
      real(wp), intent(in) :: tolerance
      !> On entry start; on return minimum
      real(wp), contiguous, intent(inout) :: x(:)
      real(wp), intent(out) :: sum_of_squares
      !> Number of evaluations used
      integer, intent(out) :: evaluations
      !> Maximum number of evaluations
      integer, intent(in) :: max_evaluations

      real(c_double), parameter :: first_step = 1.0_c_double
      ! relative error of residuals, from which lmdif chooses the steps of its differences
      real(c_double), parameter :: error_of_residuals = 1.0e-12_c_double
      type(handle_t), target :: handle
      real(c_double), allocatable :: residual(:), jacobian(:, :), work(:, :), last(:)
      integer(c_int) :: pivot(size(x)), info, used

      handle%residuals => residuals
      allocate (residual(count), jacobian(count, size(x)), work(size(x), 5), last(count))
      info = lmdif(c_funloc(evaluate_for_c), c_loc(handle), int(count, c_int), int(size(x), c_int), x, residual, &
         tolerance, tolerance, 0.0_c_double, int(max_evaluations, c_int), error_of_residuals, work(:, 1), 1_c_int, &
         first_step, 0_c_int, used, jacobian, int(count, c_int), pivot, work(:, 2), work(:, 3), work(:, 4), &
         work(:, 5), &
         last)
      evaluations = int(used)
      sum_of_squares = sum(residual**2)
   end subroutine minimise

   !> Evaluate the residuals; lmdif calls this function.
   function evaluate_for_c(p, m, n, x, fvec, iflag) result(status) bind(c)
      !> Address of a `handle_t`
      type(c_ptr), value :: p
      integer(c_int), value :: m
      integer(c_int), value :: n
      real(c_double), intent(in) :: x(n)
      real(c_double), intent(out) :: fvec(m)
      !> 1: residuals are evaluated at a new point, 2: for the Jacobian
      integer(c_int), value :: iflag
      !> Negative: lmdif shall end
      integer(c_int) :: status

      type(handle_t), pointer :: handle

      associate (unused => iflag)
      end associate
      call c_f_pointer(p, handle)
      call handle%residuals%evaluate(x, fvec)
      status = 0_c_int
   end function evaluate_for_c

end module least_squares
