!> Arithmetic of a Newmark step if the degrees of freedom are modes of the beam, so that the matrices of the step are
!> diagonal (module `newmark_stepper`).
!>
!> A state vector then holds the modal coordinates z and, after them, the displacements of some points of the beam,
!> each the sum of phi_i z_i over the modes, with phi_i the shape of mode i at the point. Contacts, observers and
!> samples read these entries in the same way as the displacement of a node.
module modal_steps
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: predict_modes, place_points, loss_of_modes

contains

   !> Predict the end of a step without contact forces: predictors of displacement, z + h z' + h^2 z''/4, and of
   !> velocity, z' + h z''/2, and the acceleration with which they satisfy the equation of motion.
   pure subroutine predict_modes(modes, h, diagonals, z, rate, acceleration, new_z, new_rate, new_acceleration)
      !> Number of modes
      integer, intent(in) :: modes
      !> Length of the step
      real(wp), intent(in) :: h
      !> Diagonals of K and of C*, and reciprocals of the diagonal of A, the matrix of the step
      real(wp), intent(in) :: diagonals(modes, 3)
      !> z at the beginning of the step
      real(wp), intent(in) :: z(modes)
      !> z' at the beginning of the step
      real(wp), intent(in) :: rate(modes)
      !> z'' at the beginning of the step
      real(wp), intent(in) :: acceleration(modes)
      !> Predictors of the displacements
      real(wp), intent(inout) :: new_z(modes)
      !> Predictors of the velocities
      real(wp), intent(inout) :: new_rate(modes)
      !> Modal loads; the acceleration on return
      real(wp), intent(inout) :: new_acceleration(modes)

      real(wp) :: factor_z, factor_rate
      integer :: i

      factor_z = 0.25_wp*h*h
      factor_rate = 0.5_wp*h
      do i = 1, modes
         new_z(i) = z(i) + (h*rate(i) + factor_z*acceleration(i))
         new_rate(i) = rate(i) + factor_rate*acceleration(i)
         new_acceleration(i) = (new_acceleration(i) - diagonals(i, 1)*new_z(i) - diagonals(i, 2)*new_rate(i)) &
            *diagonals(i, 3)
      end do
   end subroutine predict_modes

   !> Displacements, velocities and accelerations of the points, after those of the modes. The three sums of a
   !> point do not wait for one another.
   pure subroutine place_points(modes, points, shape, y, v, a)
      !> Number of modes
      integer, intent(in) :: modes
      !> Number of points
      integer, intent(in) :: points
      !> Displacement of each point per unit of each mode
      real(wp), intent(in) :: shape(modes, points)
      !> Displacements of the modes, then of the points, which are set
      real(wp), intent(inout) :: y(modes + points)
      !> Velocities of the modes, then of the points, which are set
      real(wp), intent(inout) :: v(modes + points)
      !> Accelerations of the modes, then of the points, which are set
      real(wp), intent(inout) :: a(modes + points)

      real(wp) :: sum_y, sum_v, sum_a
      integer :: i, p

      do p = 1, points
         sum_y = 0.0_wp
         sum_v = 0.0_wp
         sum_a = 0.0_wp
         !$omp simd reduction(+:sum_y, sum_v, sum_a)
         do i = 1, modes
            sum_y = sum_y + shape(i, p)*y(i)
            sum_v = sum_v + shape(i, p)*v(i)
            sum_a = sum_a + shape(i, p)*a(i)
         end do
         y(modes + p) = sum_y
         v(modes + p) = sum_v
         a(modes + p) = sum_a
      end do
   end subroutine place_points

   !> The sum of c_i u_i^2 over the modes, with u_i the mean of the velocities at both ends of a step: the energy
   !> dissipated per unit of time.
   pure real(wp) function loss_of_modes(modes, damping, old, new) result(loss)
      !> Number of modes
      integer, intent(in) :: modes
      !> c_i, the diagonal of C*
      real(wp), intent(in) :: damping(modes)
      !> Velocities of the modes at the beginning of the step
      real(wp), intent(in) :: old(modes)
      !> Velocities of the modes at the end of the step
      real(wp), intent(in) :: new(modes)

      integer :: i

      loss = 0.0_wp
      !$omp simd reduction(+:loss)
      do i = 1, modes
         loss = loss + damping(i)*(0.5_wp*(old(i) + new(i)))**2
      end do
   end function loss_of_modes

end module modal_steps
