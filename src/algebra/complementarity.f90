!> The linear complementarity problem of a few contacts (docs/theory.md, section 17).
module complementarity
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: solve_complementarity

contains

   !> x >= 0 with y = right + matrix x >= 0 and x y = 0, place by place: one solution, as the matrix is positive definite.
   !>
   !> The set of places where x may be positive changes by the first that is violated until none is (Murty, Linear
   !> Algebra Appl. 5 (1972) 65).
   pure subroutine solve_complementarity(matrix, right, solution, is_positive)
      !> Symmetric and positive definite, [size, size]
      real(wp), intent(in) :: matrix(:, :)
      !> y where x vanishes, [size]
      real(wp), intent(in) :: right(:)
      !> x, [size]
      real(wp), intent(out) :: solution(:)
      !> Places at which y vanishes for x, [size]
      logical, intent(out) :: is_positive(:)

      integer, parameter :: most_changes = 4096
      real(wp) :: rest(size(right))
      logical :: is_wrong(size(right))
      integer :: change, first

      is_positive = .false.
      do change = 1, most_changes
         call solve_among(matrix, -right, is_positive, solution)
         rest = right + matmul(matrix, solution)
         is_wrong = merge(solution < 0.0_wp, rest < 0.0_wp, is_positive)
         first = findloc(is_wrong, .true., dim=1)
         if (first == 0) return
         is_positive(first) = .not. is_positive(first)
      end do
      ! rounding lets a place that belongs to neither go to and fro
      solution = max(solution, 0.0_wp)
   end subroutine solve_complementarity

   !> Solve some of the equations, the other unknowns 0: by Cholesky's decomposition.
   pure subroutine solve_among(matrix, right, is_in, solution)
      !> Symmetric and positive definite, [size, size]
      real(wp), intent(in) :: matrix(:, :)
      real(wp), intent(in) :: right(:)
      !> The equations
      logical, intent(in) :: is_in(:)
      real(wp), intent(out) :: solution(:)

      real(wp) :: factor(size(right), size(right))
      integer :: place(size(right)), i, j, n

      n = count(is_in)
      place(:n) = pack([(i, i=1, size(right))], is_in)
      solution = 0.0_wp
      factor = 0.0_wp
      associate (x => solution, p => place)
         do j = 1, n
            factor(j, j) = sqrt(max(matrix(p(j), p(j)) - sum(factor(j, :j - 1)**2), tiny(1.0_wp)))
            do i = j + 1, n
               factor(i, j) = (matrix(p(i), p(j)) - sum(factor(i, :j - 1)*factor(j, :j - 1)))/factor(j, j)
            end do
            x(p(j)) = (right(p(j)) - sum(factor(j, :j - 1)*x(p(:j - 1))))/factor(j, j)
         end do
         do j = n, 1, -1
            x(p(j)) = (x(p(j)) - sum(factor(j + 1:n, j)*x(p(j + 1:n))))/factor(j, j)
         end do
      end associate
   end subroutine solve_among

end module complementarity
