!> Arithmetic of a Newmark step on state vectors (module `newmark_stepper`): predictors and correctors, and product and
!> solution by diagonals if the half bandwidth of the beam's matrices is three.
module banded_steps
   use contact_rows, only: band
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: predict, negative_product, solve_banded, add_column, add_column_and_correct, correct

contains

   !> Predictors of displacement, y + h v + h^2 a/4, and velocity, v + h a/2, and the combination of both by which
   !> stiffness and damping forces are a single product with K.
   pure subroutine predict(order, h, stiffness_damping, y, v, a, y_new, v_new, combined)
      !> Number of degrees of freedom
      integer, intent(in) :: order
      !> Length of the step
      real(wp), intent(in) :: h
      !> C* as a multiple of K
      real(wp), intent(in) :: stiffness_damping
      !> Displacements at the beginning of the step
      real(wp), intent(in) :: y(1 - band:order + band)
      !> Velocities at the beginning of the step
      real(wp), intent(in) :: v(1 - band:order + band)
      !> Accelerations at the beginning of the step
      real(wp), intent(in) :: a(1 - band:order + band)
      !> Predictors of the displacements
      real(wp), intent(inout) :: y_new(1 - band:order + band)
      !> Predictors of the velocities
      real(wp), intent(inout) :: v_new(1 - band:order + band)
      !> Predictor of displacement + `stiffness_damping` times that of velocity
      real(wp), intent(inout) :: combined(1 - band:order + band)

      real(wp) :: factor_y, factor_v
      integer :: i

      factor_y = 0.25_wp*h*h
      factor_v = 0.5_wp*h
      do i = 1, order
         y_new(i) = y(i) + (h*v(i) + factor_y*a(i))
         v_new(i) = v(i) + factor_v*a(i)
         combined(i) = y_new(i) + stiffness_damping*v_new(i)
      end do
   end subroutine predict

   !> Product -K x by diagonals.
   pure subroutine negative_product(order, diagonals, x, product)
      !> Number of degrees of freedom
      integer, intent(in) :: order
      !> K(i, i + k) at (i, k)
      real(wp), intent(in) :: diagonals(order, -band:band)
      !> x, padded with zeros
      real(wp), intent(in) :: x(1 - band:order + band)
      !> -K x; the padding stays as it is
      real(wp), intent(inout) :: product(1 - band:order + band)

      integer :: i

      do i = 1, order
         product(i) = -(diagonals(i, -3)*x(i - 3) + diagonals(i, -2)*x(i - 2) + diagonals(i, -1)*x(i - 1) &
            + diagonals(i, 0)*x(i) &
            + diagonals(i, 1)*x(i + 1) + diagonals(i, 2)*x(i + 2) + diagonals(i, 3)*x(i + 3))
      end do
   end subroutine negative_product

   !> Solve L D L^T x = b. In each sum the entry of x that was computed last is added last, so that most operations do
   !> not wait for this entry.
   pure subroutine solve_banded(order, lower, lower_left, reciprocal_pivot, x)
      !> Number of degrees of freedom
      integer, intent(in) :: order
      !> L(i, i - k) at (i, k), padded with zeros
      real(wp), intent(in) :: lower(order + band, band)
      !> L(order, order - 5) and L(order, order - 4)
      real(wp), intent(in) :: lower_left(2)
      !> 1/D
      real(wp), intent(in) :: reciprocal_pivot(order)
      !> b; x on return
      real(wp), intent(inout) :: x(1 - band:order + band)

      integer :: i

      do i = 1, order
         x(i) = ((x(i) - lower(i, 3)*x(i - 3)) - lower(i, 2)*x(i - 2)) - lower(i, 1)*x(i - 1)
      end do
      if (order > 5) x(order) = x(order) - (lower_left(1)*x(order - 5) + lower_left(2)*x(order - 4))
      do i = 1, order
         x(i) = x(i)*reciprocal_pivot(i)
      end do
      if (order > 5) x(order - 5:order - 4) = x(order - 5:order - 4) - lower_left*x(order)
      do i = order, 1, -1
         x(i) = ((x(i) - lower(i + 3, 3)*x(i + 3)) - lower(i + 2, 2)*x(i + 2)) - lower(i + 1, 1)*x(i + 1)
      end do
   end subroutine solve_banded

   !> Add the acceleration due to a contact force.
   pure subroutine add_column(length, force, column, acceleration)
      !> Number of entries of a vector without its padding
      integer, intent(in) :: length
      !> The contact force f
      real(wp), intent(in) :: force
      !> A^-1 w or M*^-1 w with the row w of the contact, padded
      real(wp), intent(in) :: column(1 - band:length + band)
      !> Accelerations, which are changed
      real(wp), intent(inout) :: acceleration(1 - band:length + band)

      integer :: i

      do i = 1, length
         acceleration(i) = acceleration(i) + force*column(i)
      end do
   end subroutine add_column

   !> Add a contact force, and correct the predictors: a + f A^-1 w, y + h^2 a/4, v + h a/2. One loop does both, because
   !> besides product and solution these operations take most of the time of a step in contact.
   pure subroutine add_column_and_correct(length, force, column, factor_y, factor_v, y, v, a)
      !> Number of entries of a vector without its padding
      integer, intent(in) :: length
      !> The contact force f
      real(wp), intent(in) :: force
      !> A^-1 w with the row w of the contact, padded
      real(wp), intent(in) :: column(1 - band:length + band)
      !> h^2/4
      real(wp), intent(in) :: factor_y
      !> h/2
      real(wp), intent(in) :: factor_v
      !> Predictors of the displacements; on return the displacements
      real(wp), intent(inout) :: y(1 - band:length + band)
      !> Predictors of the velocities; on return the velocities
      real(wp), intent(inout) :: v(1 - band:length + band)
      !> On return the accelerations
      real(wp), intent(inout) :: a(1 - band:length + band)

      integer :: i

      do i = 1, length
         a(i) = a(i) + force*column(i)
         y(i) = y(i) + factor_y*a(i)
         v(i) = v(i) + factor_v*a(i)
      end do
   end subroutine add_column_and_correct

   !> Correct the predictors: y + h^2 a/4, v + h a/2
   pure subroutine correct(length, factor_y, factor_v, y, v, a)
      !> Number of entries of a vector without its padding
      integer, intent(in) :: length
      !> h^2/4
      real(wp), intent(in) :: factor_y
      !> h/2
      real(wp), intent(in) :: factor_v
      !> Predictors of the displacements; on return the displacements
      real(wp), intent(inout) :: y(1 - band:length + band)
      !> Predictors of the velocities; on return the velocities
      real(wp), intent(inout) :: v(1 - band:length + band)
      !> Accelerations at the end of the step
      real(wp), intent(in) :: a(1 - band:length + band)

      integer :: i

      do i = 1, length
         y(i) = y(i) + factor_y*a(i)
         v(i) = v(i) + factor_v*a(i)
      end do
   end subroutine correct

end module banded_steps
