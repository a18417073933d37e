!> Forces of springs or supports at points of a beam, in its modes, if all motion is proportional to exp(s t).
module point_forces
   use kinds, only: wp
   use small_equations, only: eliminate
   implicit none (type, external)
   private
   public :: find_point_forces, slow_frequency

   !> A mode is slow if its dynamic stiffness is less than the square of this number (at s = 0: if its frequency is
   !> less, in omega1). Slow modes are unknowns of the equations, because their flexibility would hide that of the other
   !> modes in rounding errors.
   real(wp), parameter :: slow_frequency = 0.1_wp

contains

   !> Solve D_i z_i = load_i + sum_k b_ik f_k and sum_i b_ik z_i + flexibility_k f_k = gap_k for point forces f and
   !> modal displacements z.
   pure subroutine find_point_forces(dynamic_stiffness, value, flexibility, load, gap, force, z, is_singular)
      !> Dynamic stiffness D_i(s) of each mode, [modes]
      complex(wp), intent(in) :: dynamic_stiffness(:)
      !> Mode shapes b_ik at the points, [modes, points]
      real(wp), intent(in) :: value(:, :)
      !> Flexibility of the spring at each point, 0 at a rigid support, [points]
      complex(wp), intent(in) :: flexibility(:)
      !> Modal load, [modes]
      complex(wp), intent(in) :: load(:)
      !> Prescribed gap at each point, [points]
      complex(wp), intent(in) :: gap(:)
      !> f, [points]
      complex(wp), intent(out) :: force(:)
      !> z, [modes]
      complex(wp), intent(out) :: z(:)
      !> True: the equations have no unique solution (two rigid supports at one point, or a rigid support at a point
      !> that no mode moves), and force and z are 0. If absent, the equations are known to have a unique solution.
      logical, intent(out), optional :: is_singular

      complex(wp) :: inverse(size(dynamic_stiffness))
      complex(wp), allocatable :: matrix(:, :), right(:, :)
      integer, allocatable :: slow(:)
      integer :: i, j, k, points

      points = size(flexibility)
      allocate (slow, source=pack([(i, i=1, size(dynamic_stiffness))], abs(dynamic_stiffness) < slow_frequency**2))
      inverse = 1.0_wp/dynamic_stiffness
      inverse(slow) = 0.0_wp
      allocate (matrix(points + size(slow), points + size(slow)), right(points + size(slow), 1))
      matrix = 0.0_wp
      do k = 1, points
         do j = 1, points
            matrix(j, k) = sum(value(:, j)*value(:, k)*inverse)
         end do
         matrix(k, k) = matrix(k, k) + flexibility(k)
         right(k, 1) = gap(k) - sum(value(:, k)*(inverse*load))
      end do
      do i = 1, size(slow)
         matrix(:points, points + i) = value(slow(i), :)
         matrix(points + i, :points) = -value(slow(i), :)
         matrix(points + i, points + i) = dynamic_stiffness(slow(i))
         right(points + i, 1) = load(slow(i))
      end do
      call eliminate(matrix, right, is_singular)
      if (present(is_singular)) then
         if (is_singular) right = 0.0_wp
      end if
      force = right(:points, 1)
      z = inverse*(load + matmul(value, force))
      z(slow) = right(points + 1:, 1)
   end subroutine find_point_forces

end module point_forces
