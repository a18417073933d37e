!> Small systems of complex linear equations, by Gaussian elimination with row scaling and partial pivoting.
module small_equations
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: eliminate_bordered, solve_small, eliminate

   !> A pivot of this size, beside rows of size 1, is zero. The solution of a singular system is then immense, but its
   !> squares do not overflow.
   real(wp), parameter :: min_pivot = 1.0e-70_wp

contains

   !> Solve A X = B.
   pure function solve_small(matrix, right) result(solution)
      !> A, [n, n]
      complex(wp), intent(in) :: matrix(:, :)
      !> B, [n, number of right-hand sides]
      complex(wp), intent(in) :: right(:, :)
      complex(wp) :: solution(size(right, 1), size(right, 2))

      ! on the heap, because it grows with the square of the number of equations
      complex(wp), allocatable :: a(:, :)

      allocate (a, source=matrix)
      solution = right
      call eliminate(a, solution)
   end function solve_small

   !> Solve A X = B in place.
   pure subroutine eliminate(a, solution, is_singular)
      !> On entry A; on return undefined, [n, n]
      complex(wp), intent(inout) :: a(:, :)
      !> On entry B; on return X, [n, number of right-hand sides]
      complex(wp), intent(inout) :: solution(:, :)
      !> True: a pivot is less than `min_pivot`, and X is undefined. If absent, such a pivot is replaced by `min_pivot`.
      logical, intent(out), optional :: is_singular

      complex(wp) :: factor(size(a, 1)), swap
      real(wp) :: row_scale(size(a, 1))
      integer :: j, k, n, pivot

      if (present(is_singular)) is_singular = .false.
      n = size(a, 1)
      row_scale = 0.0_wp
      do j = 1, n
         row_scale = max(row_scale, abs1(a(:, j)))
      end do
      ! the right-hand sides of a row of zeros must not overflow
      where (.not. row_scale > tiny(1.0_wp)) row_scale = 1.0_wp
      do j = 1, n
         a(:, j) = a(:, j)/row_scale
      end do
      do j = 1, size(solution, 2)
         solution(:, j) = solution(:, j)/row_scale
      end do
      do k = 1, n
         pivot = k - 1 + maxloc(abs1(a(k:, k)), dim=1)
         if (pivot /= k) then
            do j = 1, n
               swap = a(k, j)
               a(k, j) = a(pivot, j)
               a(pivot, j) = swap
            end do
            do j = 1, size(solution, 2)
               swap = solution(k, j)
               solution(k, j) = solution(pivot, j)
               solution(pivot, j) = swap
            end do
         end if
         if (abs1(a(k, k)) <= min_pivot) then
            if (present(is_singular)) then
               is_singular = .true.
               return
            end if
            a(k, k) = min_pivot
         end if
         factor(k + 1:) = a(k + 1:, k)/a(k, k)
         do j = k + 1, n
            a(k + 1:, j) = a(k + 1:, j) - factor(k + 1:)*a(k, j)
         end do
         do j = 1, size(solution, 2)
            solution(k + 1:, j) = solution(k + 1:, j) - factor(k + 1:)*solution(k, j)
         end do
      end do
      do k = n, 1, -1
         factor(k) = 1.0_wp/a(k, k)
         do j = 1, size(solution, 2)
            solution(k, j) = factor(k)*solution(k, j)
            solution(:k - 1, j) = solution(:k - 1, j) - a(:k - 1, k)*solution(k, j)
         end do
      end do
   end subroutine eliminate

   !> Solve equations whose last unknowns have the small diagonal D, as `eliminate` does. The first unknowns are of the
   !> order of D: they lose their digits unless the last equations, which contain the rows and D, eliminate them first.
   pure subroutine eliminate_bordered(a, solution, count)
      !> On entry A; on return undefined, [n, n]
      complex(wp), intent(inout) :: a(:, :)
      !> On entry B; on return X, [n, number of right-hand sides]
      complex(wp), intent(inout) :: solution(:, :)
      !> Number of first unknowns
      integer, intent(in) :: count

      ! value of D above which the first unknowns keep enough digits
      real(wp), parameter :: max_small = 1.0e-12_wp
      ! pivots may be as small as the scale, and must exceed `min_pivot`
      real(wp), parameter :: min_scale = 1.0e-50_wp
      real(wp) :: scale
      integer :: i

      scale = maxval([min_scale, (abs1(a(i, i)), i=count + 1, size(a, 1))])
      if (scale > max_small .or. count == size(a, 1)) scale = 1.0_wp
      a(:, :count) = scale*a(:, :count)
      call eliminate(a, solution)
      solution(:count, :) = scale*solution(:count, :)
   end subroutine eliminate_bordered

   !> |Re z| + |Im z|.
   elemental real(wp) function abs1(z) result(value)
      complex(wp), intent(in) :: z

      value = abs(real(z, wp)) + abs(aimag(z))
   end function abs1

end module small_equations
