!> Forces of springs or supports at points of a beam, in its modes, if all motion is proportional to exp(s t).
module point_forces
   use kinds, only: wp
   use small_equations, only: solve_small
   implicit none (type, external)
   private
   public :: find_point_forces, slow_frequency

   !> Frequency in omega1 below which modes are slow. Slow modes are unknowns of the equations, because their
   !> flexibility would hide that of the other modes.
   real(wp), parameter :: slow_frequency = 0.1_wp

contains

   !> Forces f and modes z of D_i z_i = load_i + sum b_ik f_k, sum b_ik z_i + flexibility_k f_k = gap_k.
   pure subroutine find_point_forces(dynamic, value, flexibility, load, gap, force, z)
      !> Dynamic stiffness D_i(s) of each mode, [modes]
      complex(wp), intent(in) :: dynamic(:)
      !> Mode shapes b_ik at the points, [modes, points]
      real(wp), intent(in) :: value(:, :)
      !> Flexibility of the spring or support at each point, [points]
      complex(wp), intent(in) :: flexibility(:)
      !> Modal load, [modes]
      complex(wp), intent(in) :: load(:)
      !> Prescribed gap at each point, [points]
      complex(wp), intent(in) :: gap(:)
      complex(wp), intent(out) :: force(:)
      complex(wp), intent(out) :: z(:)

      complex(wp) :: inverse(size(dynamic))
      complex(wp), allocatable :: matrix(:, :), right(:, :)
      integer, allocatable :: separate(:)
      integer :: i, j, k, points

      points = size(flexibility)
      allocate (separate, source=pack([(i, i=1, size(dynamic))], abs(dynamic) < slow_frequency**2))
      inverse = 1.0_wp/dynamic
      inverse(separate) = 0.0_wp
      allocate (matrix(points + size(separate), points + size(separate)), right(points + size(separate), 1))
      matrix = 0.0_wp
      do k = 1, points
         do j = 1, points
            matrix(j, k) = sum(value(:, j)*value(:, k)*inverse)
         end do
         matrix(k, k) = matrix(k, k) + flexibility(k)
         right(k, 1) = gap(k) - sum(value(:, k)*(inverse*load))
      end do
      do i = 1, size(separate)
         matrix(:points, points + i) = value(separate(i), :)
         matrix(points + i, :points) = -value(separate(i), :)
         matrix(points + i, points + i) = dynamic(separate(i))
         right(points + i, 1) = load(separate(i))
      end do
      right = solve_small(matrix, right)
      force = right(:points, 1)
      z = inverse*(load + matmul(value, force))
      z(separate) = right(points + 1:, 1)
   end subroutine find_point_forces

end module point_forces
