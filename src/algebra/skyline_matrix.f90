!> Symmetric matrices in skyline (profile) storage: each column is stored from its first non-zero entry down to the
!> diagonal, so that for a beam numbered along its axis storage, product, factorisation and solution cost O(n).
!>
!> Bathe, Finite Element Procedures, section 8.2 (active column solution).
module skyline_matrix
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use number_text, only: to_text
   implicit none (type, external)
   private
   public :: skyline_t, make_skyline, add_element, add_to_diagonal, combine, multiply
   public :: factorise, solve_factorised, to_dense, negative_pivots

   !> Symmetric matrix, or its factors L D L^T in the same places.
   type :: skyline_t
      !> Order
      integer :: order = 0
      !> Row of the first stored entry of each column, [order]
      integer, allocatable :: first_row(:)
      !> Index of each column's diagonal entry in `values`, [order]
      integer, allocatable :: diagonal(:)
      !> Stored entries, column after column, each from `first_row` down to the diagonal
      real(wp), allocatable :: values(:)
   end type skyline_t

contains

   !> A zero matrix of the given profile.
   pure subroutine make_skyline(matrix, first_row)
      type(skyline_t), intent(out) :: matrix
      !> Row of the first entry of each column, at most the column itself, [order]
      integer, intent(in) :: first_row(:)

      integer :: column, place

      matrix%order = size(first_row)
      matrix%first_row = first_row
      allocate (matrix%diagonal(matrix%order))
      place = 0
      do column = 1, matrix%order
         place = place + column - first_row(column) + 1
         matrix%diagonal(column) = place
      end do
      allocate (matrix%values(place), source=0.0_wp)
   end subroutine make_skyline

   !> Add an element matrix.
   pure subroutine add_element(matrix, dofs, element)
      !> The matrix; its profile must contain every pair of `dofs`
      type(skyline_t), intent(inout) :: matrix
      !> Row in `matrix` of each row of `element`; 0: fixed, left out
      integer, intent(in) :: dofs(:)
      !> Symmetric element matrix, [size(dofs), size(dofs)]
      real(wp), intent(in) :: element(:, :)

      integer :: i, j, place

      do j = 1, size(dofs)
         if (dofs(j) == 0) cycle
         do i = 1, size(dofs)
            if (dofs(i) == 0 .or. dofs(i) > dofs(j)) cycle
            place = matrix%diagonal(dofs(j)) - (dofs(j) - dofs(i))
            matrix%values(place) = matrix%values(place) + element(i, j)
         end do
      end do
   end subroutine add_element

   !> Add to one diagonal entry.
   pure subroutine add_to_diagonal(matrix, row, value)
      type(skyline_t), intent(inout) :: matrix
      integer, intent(in) :: row
      !> Value to be added
      real(wp), intent(in) :: value

      associate (entry => matrix%values(matrix%diagonal(row)))
         entry = entry + value
      end associate
   end subroutine add_to_diagonal

   !> factor_a A + factor_b B for two matrices of one profile.
   pure type(skyline_t) function combine(factor_a, a, factor_b, b) result(sum)
      !> Factor of the first matrix
      real(wp), intent(in) :: factor_a
      !> First matrix; its profile becomes the result's
      type(skyline_t), intent(in) :: a
      !> Factor of the second matrix
      real(wp), intent(in) :: factor_b
      !> Second matrix, of the same profile
      type(skyline_t), intent(in) :: b

      sum = a
      sum%values = factor_a*a%values + factor_b*b%values
   end function combine

   !> A x.
   pure subroutine multiply(matrix, x, product)
      type(skyline_t), intent(in) :: matrix
      !> x, [order]
      real(wp), intent(in) :: x(:)
      !> A x, [order]
      real(wp), intent(out) :: product(:)

      integer :: column, row, offset
      real(wp) :: total, factor

      do column = 1, matrix%order
         offset = matrix%diagonal(column) - column
         factor = x(column)
         total = matrix%values(offset + column)*factor
         do row = matrix%first_row(column), column - 1
            total = total + matrix%values(offset + row)*x(row)
            product(row) = product(row) + matrix%values(offset + row)*factor
         end do
         product(column) = total
      end do
   end subroutine multiply

   !> Factorise A = L D L^T in place; L has a unit diagonal, D stands on the diagonal.
   !>
   !> Fails if a pivot is so small against its diagonal entry that no digit of it is significant (the matrix is singular
   !> to working precision), is not finite, or is negative although `positive` is true.
   pure subroutine factorise(matrix, error, positive)
      !> On entry A; on return its factors
      type(skyline_t), intent(inout) :: matrix
      !> Set if a pivot is refused; the message has its row
      type(failure_t), allocatable, intent(out) :: error
      !> Whether to demand positive pivots (default true); false for K - sigma M
      logical, intent(in), optional :: positive

      integer :: column, row, first, offset, row_offset, k
      real(wp) :: original, total, factor, pivot
      logical :: demand_positive, acceptable

      demand_positive = .true.
      if (present(positive)) demand_positive = positive

      do column = 1, matrix%order
         first = matrix%first_row(column)
         offset = matrix%diagonal(column) - column
         original = matrix%values(offset + column)
         ! column g of D L^T: g_i = A_ij - sum over k < i of L_ik g_k; then L_ji = g_i/D_i, and the pivot D_j = A_jj -
         ! sum over i of L_ji g_i
         do row = first + 1, column - 1
            row_offset = matrix%diagonal(row) - row
            total = matrix%values(offset + row)
            do k = max(first, matrix%first_row(row)), row - 1
               total = total - matrix%values(row_offset + k)*matrix%values(offset + k)
            end do
            matrix%values(offset + row) = total
         end do
         pivot = original
         do row = first, column - 1
            factor = matrix%values(offset + row)/matrix%values(matrix%diagonal(row))
            pivot = pivot - factor*matrix%values(offset + row)
            matrix%values(offset + row) = factor
         end do
         acceptable = ieee_is_finite(pivot)
         if (acceptable) acceptable = abs(pivot) > 4.0_wp*epsilon(1.0_wp)*abs(original)
         if (acceptable .and. demand_positive) acceptable = pivot > 0.0_wp
         if (.not. acceptable) then
            call fail(error, status_run_failed, 'the matrix cannot be factorised: its pivot in row '// &
               to_text(column)//' is zero to working precision, negative or not finite')
            return
         end if
         matrix%values(offset + column) = pivot
      end do
   end subroutine factorise

   !> Solve A x = b with the factors.
   pure subroutine solve_factorised(factors, x)
      !> L D L^T from `factorise`
      type(skyline_t), intent(in) :: factors
      !> On entry b; on return x, [order]
      real(wp), intent(inout) :: x(:)

      integer :: column, row, offset
      real(wp) :: total, factor

      do column = 1, factors%order
         offset = factors%diagonal(column) - column
         total = x(column)
         do row = factors%first_row(column), column - 1
            total = total - factors%values(offset + row)*x(row)
         end do
         x(column) = total
      end do
      do column = 1, factors%order
         x(column) = x(column)/factors%values(factors%diagonal(column))
      end do
      do column = factors%order, 1, -1
         offset = factors%diagonal(column) - column
         factor = x(column)
         do row = factors%first_row(column), column - 1
            x(row) = x(row) - factors%values(offset + row)*factor
         end do
      end do
   end subroutine solve_factorised

   !> Number of negative pivots: by Sylvester's law of inertia the number of eigenvalues of (K, M)
   !> below sigma, if the factors are those of K - sigma M.
   pure integer function negative_pivots(factors) result(count_negative)
      !> L D L^T from `factorise`
      type(skyline_t), intent(in) :: factors

      count_negative = count(factors%values(factors%diagonal) < 0.0_wp)
   end function negative_pivots

   !> The matrix as a full array, both triangles.
   pure function to_dense(matrix) result(dense)
      type(skyline_t), intent(in) :: matrix
      real(wp) :: dense(matrix%order, matrix%order)

      integer :: column, row, offset

      dense = 0.0_wp
      do column = 1, matrix%order
         offset = matrix%diagonal(column) - column
         do row = matrix%first_row(column), column
            dense(row, column) = matrix%values(offset + row)
            dense(column, row) = matrix%values(offset + row)
         end do
      end do
   end function to_dense

end module skyline_matrix
