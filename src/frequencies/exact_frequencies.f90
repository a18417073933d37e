!> Frequencies of the continuous beam, from the determinants of its closed-form solutions: uniform,
!> linear taper, full wedge; with a point mass at the tip.
!>
!> h/hbar = 1 + s (1 - 2 x/L); with z = lambda sqrt(h/hbar)/(2 s) the shapes are h^(-1/2) times J_1,
!> Y_1, I_1, K_1 of 2 z (docs/theory.md, section 4).
!>
!> Precision. Determinants are formed in quadruple precision for three reasons: for a slight taper the arguments
!> lambda/s are large and J and Y would lose their phase; for a heavy tip mass the first root is small and the
!> determinant has a cancellation like lambda^-4; and near a full wedge Y and K cancel at the tip. I and K have no
!> phase, so the library computes them in double precision unless one of the latter two cancellations matters. The error
!> of every root is relative and at most 3e-16 for 0 <= s < 1 and masses up to 1e9.
module exact_frequencies
   use bessel_functions, only: bessel_i_scaled, bessel_i_scaled_quad, bessel_k_scaled, bessel_k_scaled_quad, pi_quad, qp
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: exact_lambda

   !> Minimum taper; with a smaller taper the beam is uniform in double precision.
   real(wp), parameter :: min_taper = 1.0e-17_wp
   !> Value of lambda below which I and K are computed in quadruple precision.
   real(qp), parameter :: small_lambda = 1.5_qp
   !> Value of the argument of I and K below which they are computed in quadruple precision.
   real(qp), parameter :: small_argument = 2.0_qp
   !> Number of search steps per asymptotic distance of neighbouring roots.
   integer, parameter :: steps_per_root = 6

   !> Parameters of the characteristic equation, determinant = 0.
   type :: characteristic_t
      !> s = (h_root - h_tip)/(h_root + h_tip), above -1, at most 1 (full wedge)
      real(wp) :: taper = 0.0_wp
      !> Tip mass m/(rho Abar L)
      real(wp) :: tip_mass_ratio = 0.0_wp
      !> Whether the tip is constrained to y = 0, the limit of a heavy tip mass
      logical :: constrained_tip = .false.
   end type characteristic_t

contains

   !> The first `count` lambda_i, ascending; omega_i = lambda_i^2 sqrt(E Ibar/(rho Abar L^4)).
   !>
   !> No root is missed: without tip mass, roots are searched with steps well below their distance, and the distances of
   !> the roots found are checked. With tip mass, root i is the only root between root i - 1 of the beam with
   !> constrained tip and root i of the beam without tip mass.
   subroutine exact_lambda(count, taper, tip_mass_ratio, lambda, error)
      !> Number of roots, >= 0
      integer, intent(in) :: count
      !> s = (h_root - h_tip)/(h_root + h_tip), above -1, at most 1 (full wedge)
      real(wp), intent(in) :: taper
      !> Tip mass m/(rho Abar L), >= 0; 0 for a full wedge
      real(wp), intent(in) :: tip_mass_ratio
      !> Roots lambda_i, [count]
      real(wp), allocatable, intent(out) :: lambda(:)
      !> Set if the roots do not exist or are not found
      type(failure_t), allocatable, intent(out) :: error

      real(qp) :: free_roots(count), constrained_roots(count), lower, root
      integer :: i

      if (taper >= 1.0_wp .and. tip_mass_ratio > 0.0_wp) then
         ! The static compliance of the tip, int (1-x)^2/I dx, diverges.
         call fail(error, status_run_failed, 'exact frequencies: a full wedge gives way without limit under a &
         &point mass at its tip, so there are none; take a tip of finite height, or no tip mass')
         return
      end if

      allocate (lambda(count))
      if (count == 0) return
      call search_roots(characteristic_t(taper, 0.0_wp, .false.), free_roots, error)
      if (allocated(error)) return
      if (.not. tip_mass_ratio > 0.0_wp) then
         lambda = real(free_roots, wp)
         return
      end if

      if (count > 1) call search_roots(characteristic_t(taper, 0.0_wp, .true.), constrained_roots(:count - 1), error)
      if (allocated(error)) return
      ! Dunkerley's bound
      lower = 1.0_qp/(1.0_qp/free_roots(1)**4 + real(tip_mass_ratio, qp)*tip_compliance(taper))**0.25_qp
      do i = 1, count
         if (lower > free_roots(i)) then
            call fail(error, status_run_failed, &
               'exact frequencies: the roots with free and with held tip do not interlace')
            return
         end if
         ! for a vanishing or very heavy mass the root is an end of the bracket, which is therefore widened by more than
         ! the errors of its ends
         call find_root(characteristic_t(taper, tip_mass_ratio, .false.), lower*(1.0_qp - 1.0e-14_qp), &
            free_roots(i)*(1.0_qp + 1.0e-14_qp), root, error)
         if (allocated(error)) return
         lambda(i) = real(root, wp)
         if (i < count) lower = constrained_roots(i)
      end do
   end subroutine exact_lambda

   !> The first roots without tip mass or with constrained tip, found by a search in steps.
   subroutine search_roots(problem, roots, error)
      type(characteristic_t), intent(in) :: problem
      !> Roots, ascending
      real(qp), intent(out) :: roots(:)
      !> Set if the roots do not exist or are not found
      type(failure_t), allocatable, intent(out) :: error

      real(qp) :: distance, left, right, step, value_left, value_right
      integer :: found

      if (abs(problem%taper) < min_taper) then
         call find_uniform_roots(problem, roots, error)
         return
      end if
      ! asymptotic distance of neighbouring roots: pi/int_0^1 (h/hbar)^(-1/2) dx
      distance = 0.5_qp*pi_quad*(sqrt(1.0_qp + real(problem%taper, qp)) + sqrt(1.0_qp - real(problem%taper, qp)))
      step = distance/real(steps_per_root, qp)
      roots = 0.0_qp
      found = 0
      ! lambda_1^-4 is at most the integral of the compliance times the mass per length (Dunkerley), therefore at most
      ! the compliance of the tip. The compliance of a full wedge diverges, but its lambda_1 exceeds 1.
      left = 0.99_qp
      if (problem%taper < 1.0_wp) left = 0.99_qp/tip_compliance(problem%taper)**0.25_qp
      value_left = characteristic_value(problem, left)
      do while (found < size(roots))
         right = left + step
         value_right = characteristic_value(problem, right)
         if ((value_left < 0.0_qp) .neqv. (value_right < 0.0_qp)) then
            found = found + 1
            call find_root(problem, left, right, roots(found), error)
            if (allocated(error)) return
            if (found > 1) then
               ! if the steps had skipped a pair of roots, these two roots would be three distances apart
               if (roots(found) - roots(found - 1) > 2.0_qp*distance) then
                  call fail(error, status_run_failed, 'exact frequencies: the distance of two roots is out of order')
                  return
               end if
            end if
         else if (right > (real(found, qp) + 3.0_qp)*distance) then
            call fail(error, status_run_failed, 'exact frequencies: a root was not found where it must be')
            return
         end if
         left = right
         value_left = value_right
      end do
   end subroutine search_roots

   !> The first roots of a uniform beam, of cos k = -1/cosh k, or tan k = tanh k with constrained tip. Only root i is
   !> near (i - 1/2) pi, or near (i + 1/4) pi with constrained tip.
   subroutine find_uniform_roots(problem, roots, error)
      type(characteristic_t), intent(in) :: problem
      !> Roots, ascending
      real(qp), intent(out) :: roots(:)
      !> Set if the roots do not exist or are not found
      type(failure_t), allocatable, intent(out) :: error

      real(qp) :: estimate, radius
      integer :: i

      roots = 0.0_qp
      do i = 1, size(roots)
         estimate = acos(-1.0_qp)*(real(i, qp) + merge(0.25_qp, -0.5_qp, problem%constrained_tip))
         ! the distance of the root from the estimate is below 2.2 exp(-estimate)
         radius = max(2.2_qp*exp(-estimate), 1.0e-18_qp*estimate)
         call find_root(problem, estimate - radius, estimate + radius, roots(i), error)
         if (allocated(error)) return
      end do
   end subroutine find_uniform_roots

   !> Deflection of the tip under a unit force at the tip, int_0^1 (1-x)^2/(h/hbar)^3 dx, or a close upper bound of it.
   pure function tip_compliance(taper) result(compliance)
      !> Taper s, below 1
      real(wp), intent(in) :: taper
      real(qp) :: compliance

      real(qp) :: ratio, s

      s = real(taper, qp)
      if (abs(s) < 1.0e-3_qp) then
         compliance = 1.0_qp/(3.0_qp*(1.0_qp - abs(s))**3)
      else
         ratio = (1.0_qp - s)/(1.0_qp + s)
         compliance = (-log(ratio) - 1.5_qp + 2.0_qp*ratio - 0.5_qp*ratio**2)/(8.0_qp*s**3)
      end if
   end function tip_compliance

   !> The determinant at lambda, scaled by exponentials and other positive factors. Only its sign and its roots are
   !> used.
   function characteristic_value(problem, lambda) result(value)
      type(characteristic_t), intent(in) :: problem
      !> Argument lambda > 0
      real(qp), intent(in) :: lambda
      real(qp) :: value

      if (abs(problem%taper) < min_taper) then
         value = uniform_value(real(problem%tip_mass_ratio, qp), problem%constrained_tip, lambda)
      else if (problem%taper >= 1.0_wp) then
         ! the full wedge without tip mass: J_1 I_2 + I_1 J_2 at lambda sqrt(2)
         associate (x => lambda*sqrt(2.0_qp))
            value = bessel_jn(1, x)*real(bessel_i_scaled(2, real(x, wp)), qp) + &
               bessel_jn(2, x)*real(bessel_i_scaled(1, real(x, wp)), qp)
         end associate
      else
         value = taper_value(problem, lambda)
      end if
   end function characteristic_value

   !> With k = lambda and the tip mass mu, the determinant exp(-k) (1 + cos k cosh k + mu k (cos k sinh k - sin k cosh
   !> k)) of a uniform beam; with constrained tip the factor of mu k.
   pure function uniform_value(tip_mass_ratio, constrained_tip, lambda) result(value)
      !> Tip mass m/(rho Abar L)
      real(qp), intent(in) :: tip_mass_ratio
      !> Whether the tip is constrained to y = 0
      logical, intent(in) :: constrained_tip
      !> Argument lambda > 0
      real(qp), intent(in) :: lambda
      real(qp) :: value

      real(qp) :: decay, supported

      decay = exp(-lambda)
      supported = 0.5_qp*(cos(lambda)*(1.0_qp - decay**2) - sin(lambda)*(1.0_qp + decay**2))
      if (constrained_tip) then
         value = supported
      else
         value = decay + 0.5_qp*cos(lambda)*(1.0_qp + decay**2) + tip_mass_ratio*lambda*supported
      end if
   end function uniform_value

   !> The 4 x 4 determinant of a taper. Rows: displacement and slope at the clamp, moment at the tip, shear at the tip
   !> (or displacement of a constrained tip); columns: J, Y, I, K.
   function taper_value(problem, lambda) result(value)
      type(characteristic_t), intent(in) :: problem
      !> Argument lambda > 0
      real(qp), intent(in) :: lambda
      real(qp) :: value

      real(qp) :: matrix(4, 4), clamp(4, 2), tip(4, 3), scale_root, scale_tip, shear, taper, x_root, x_tip
      logical :: in_quad
      integer :: n

      taper = real(problem%taper, qp)
      x_root = lambda*sqrt(1.0_qp + taper)/abs(taper)
      x_tip = lambda*sqrt(1.0_qp - taper)/abs(taper)
      in_quad = lambda < small_lambda .or. min(x_root, x_tip) < small_argument
      do n = 1, 2
         clamp(:, n) = four_functions(n, x_root, in_quad)
      end do
      do n = 1, 3
         tip(:, n) = four_functions(n, x_tip, in_quad)
      end do
      ! The scaled I and K of root and tip are brought to a common factor of each column: exp(-max(x_root, x_tip)) for
      ! I, exp(min(x_root, x_tip)) for K.
      scale_root = exp(x_root - max(x_root, x_tip))
      scale_tip = exp(x_tip - max(x_root, x_tip))
      clamp(3, :) = clamp(3, :)*scale_root
      tip(3, :) = tip(3, :)*scale_tip
      clamp(4, :) = clamp(4, :)*scale_tip
      tip(4, :) = tip(4, :)*scale_root

      matrix(1, :) = clamp(:, 1)
      ! with x = 2 z, d(x^-n C_n)/dx = -x^-n C_(n+1) for J, Y and K, but + for I (DLMF 10.6.6, 10.29.4)
      matrix(2, :) = clamp(:, 2)*[1.0_qp, 1.0_qp, -1.0_qp, 1.0_qp]
      matrix(3, :) = tip(:, 3)
      if (problem%constrained_tip) then
         matrix(4, :) = tip(:, 1)
      else
         ! coefficient of the shear force, 8 s^3 z^3 at the tip, divided by lambda^3: (h_tip/hbar)^(3/2) with the sign
         ! of s; d(x^n C_n)/dx = x^n C_(n-1) for J, Y and I, but - for K
         shear = sign((1.0_qp - taper)*sqrt(1.0_qp - taper), taper)
         matrix(4, :) = shear*tip(:, 2)*[1.0_qp, 1.0_qp, 1.0_qp, -1.0_qp] &
            - real(problem%tip_mass_ratio, qp)*lambda*tip(:, 1)
      end if
      value = determinant(matrix)
   end function taper_value

   !> The functions J_n, Y_n, exp(-x) I_n, exp(x) K_n.
   function four_functions(n, x, in_quad) result(values)
      !> Order
      integer, intent(in) :: n
      !> Argument, > 0
      real(qp), intent(in) :: x
      !> Whether to compute I and K in quadruple precision
      logical, intent(in) :: in_quad
      real(qp) :: values(4)

      values(1) = bessel_jn(n, x)
      values(2) = bessel_yn(n, x)
      if (in_quad) then
         values(3) = bessel_i_scaled_quad(n, x)
         values(4) = bessel_k_scaled_quad(n, x)
      else
         values(3) = real(bessel_i_scaled(n, real(x, wp)), qp)
         values(4) = real(bessel_k_scaled(n, real(x, wp)), qp)
      end if
   end function four_functions

   !> Determinant by Laplace expansion in 2 x 2 minors of the upper and lower pair of rows.
   pure function determinant(matrix) result(value)
      !> The matrix, [4, 4]
      real(qp), intent(in) :: matrix(4, 4)
      real(qp) :: value

      value = minor(1, 1, 2)*minor(3, 3, 4) - minor(1, 1, 3)*minor(3, 2, 4) + minor(1, 1, 4)*minor(3, 2, 3) &
         + minor(1, 2, 3)*minor(3, 1, 4) - minor(1, 2, 4)*minor(3, 1, 3) + minor(1, 3, 4)*minor(3, 1, 2)

   contains

      !> Determinant of the 2 x 2 submatrix of two neighbouring rows and the columns i and j.
      pure function minor(row, i, j) result(difference)
         !> Upper row of the pair of rows
         integer, intent(in) :: row
         !> Left column
         integer, intent(in) :: i
         !> Right column
         integer, intent(in) :: j
         real(qp) :: difference

         difference = matrix(row, i)*matrix(row + 1, j) - matrix(row, j)*matrix(row + 1, i)
      end function minor

   end function determinant

   !> The root in a bracket by Chandrupatla's method: inverse quadratic interpolation if three points make it safe, else
   !> bisection (Adv. Eng. Software 28 (1997) 145-149).
   subroutine find_root(problem, lower, upper, root, error)
      type(characteristic_t), intent(in) :: problem
      !> Lower end of the bracket
      real(qp), intent(in) :: lower
      !> Upper end of the bracket
      real(qp), intent(in) :: upper
      real(qp), intent(out) :: root
      !> Set if the roots do not exist or are not found
      type(failure_t), allocatable, intent(out) :: error

      real(qp), parameter :: tolerance = 1.0e-19_qp
      integer, parameter :: limit = 300
      real(qp) :: x(3), f(3), point, value, fraction, ratio_x, ratio_f
      integer :: iteration

      ! x(1) is the newest point, x(2) the other end of the bracket, x(3) the previous point.
      x = [upper, lower, lower]
      f(1) = characteristic_value(problem, x(1))
      f(2) = characteristic_value(problem, x(2))
      f(3) = f(2)
      root = x(1)
      if ((f(1) < 0.0_qp) .eqv. (f(2) < 0.0_qp)) then
         call fail(error, status_run_failed, &
            'exact frequencies: the determinant does not change sign where a root must be')
         return
      end if
      fraction = 0.5_qp
      do iteration = 1, limit
         point = x(1) + fraction*(x(2) - x(1))
         value = characteristic_value(problem, point)
         if ((value < 0.0_qp) .eqv. (f(1) < 0.0_qp)) then
            x(3) = x(1)
            f(3) = f(1)
         else
            x(3) = x(2)
            f(3) = f(2)
            x(2) = x(1)
            f(2) = f(1)
         end if
         x(1) = point
         f(1) = value
         root = merge(x(1), x(2), abs(f(1)) < abs(f(2)))
         if (.not. (abs(f(1)) > 0.0_qp .and. abs(x(2) - x(1)) > tolerance*abs(root))) return
         fraction = 0.5_qp
         ratio_x = (x(1) - x(2))/(x(3) - x(2))
         ratio_f = (f(1) - f(2))/(f(3) - f(2))
         if (ratio_f**2 < ratio_x .and. (1.0_qp - ratio_f)**2 < 1.0_qp - ratio_x) then
            fraction = f(1)/(f(2) - f(1))*f(3)/(f(2) - f(3)) &
               + (x(3) - x(1))/(x(2) - x(1))*f(1)/(f(3) - f(1))*f(2)/(f(3) - f(2))
         end if
         ! A minimum step passes the root, so that the iteration does not converge from one side only.
         fraction = min(max(fraction, 0.5_qp*tolerance*abs(root)/abs(x(2) - x(1))), 1.0_qp)
         if (fraction > 0.5_qp) fraction = min(fraction, 1.0_qp - 0.5_qp*tolerance*abs(root)/abs(x(2) - x(1)))
      end do
      call fail(error, status_run_failed, 'exact frequencies: the search for a root did not end')
   end subroutine find_root

end module exact_frequencies
