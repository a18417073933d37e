!> Forces at points of a beam in its modes where springs or supports act, while all moves as exp(s t).
module point_forces
   use kinds, only: wp
   use small_equations, only: solve_small
   implicit none (type, external)
   private
   public :: find_point_forces, slow

   !> Modes below this are slow, beside omega1: their flexibility hides that of the others, so they are unknowns of
   !> their own.
   real(wp), parameter :: slow = 0.1_wp

contains

   !> Forces f and modes z of D_i z_i = load_i + sum b_ik f_k, sum b_ik z_i + flexibility_k f_k = gap_k.
   pure subroutine find_point_forces(dynamic, value, flexibility, load, gap, force, z)
      !> D_i(s), [modes]
      complex(wp), intent(in) :: dynamic(:)
      !> b_ik, [modes, points]
      real(wp), intent(in) :: value(:, :)
      !> Of what acts there, [points]
      complex(wp), intent(in) :: flexibility(:)
      !> [modes]
      complex(wp), intent(in) :: load(:)
      !> [points]
      complex(wp), intent(in) :: gap(:)
      complex(wp), intent(out) :: force(:)
      complex(wp), intent(out) :: z(:)

      complex(wp) :: inverse(size(dynamic))
      complex(wp), allocatable :: matrix(:, :), right(:, :)
      integer, allocatable :: apart(:)
      integer :: i, j, k, points

      points = size(flexibility)
      allocate (apart, source=pack([(i, i=1, size(dynamic))], abs(dynamic) < slow**2))
      inverse = 1.0_wp/dynamic
      inverse(apart) = 0.0_wp
      allocate (matrix(points + size(apart), points + size(apart)), right(points + size(apart), 1))
      matrix = 0.0_wp
      do k = 1, points
         do j = 1, points
            matrix(j, k) = sum(value(:, j)*value(:, k)*inverse)
         end do
         matrix(k, k) = matrix(k, k) + flexibility(k)
         right(k, 1) = gap(k) - sum(value(:, k)*(inverse*load))
      end do
      do i = 1, size(apart)
         matrix(:points, points + i) = value(apart(i), :)
         matrix(points + i, :points) = -value(apart(i), :)
         matrix(points + i, points + i) = dynamic(apart(i))
         right(points + i, 1) = load(apart(i))
      end do
      right = solve_small(matrix, right)
      force = right(:points, 1)
      z = inverse*(load + matmul(value, force))
      z(apart) = right(points + 1:, 1)
   end subroutine find_point_forces

end module point_forces
