!> Linear complementarity problem: z >= 0, w = A z + q >= 0 and z_i w_i = 0, with z contact forces or impulses, w gaps
!> or their rates (docs/theory.md, section 17). If A is positive definite, the solution is unique. Besides, `close_gaps`
!> finds forces of either sign that make negative gaps zero.
module complementarity
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: solve_complementarity, solve_active, close_gaps

contains

   !> Principal pivoting: the first component that is negative changes between the active and the inactive set (Murty,
   !> Linear Algebra Appl. 5 (1972) 65). With a positive definite matrix this ends; if rounding prevents the end, the
   !> set with the minimum violation is taken. The values follow from the final set alone.
   pure subroutine solve_complementarity(matrix, right, solution, is_positive, is_equation, value, place)
      !> A, symmetric, positive definite, [n, n]
      real(wp), intent(in) :: matrix(:, :)
      !> q, [n]
      real(wp), intent(in) :: right(:)
      !> z, [n]
      real(wp), intent(out) :: solution(:)
      !> True: w is zero and z may be positive (the active set), [n]
      logical, intent(out) :: is_positive(:)
      !> True: an equation; w is zero and z may have either sign, [n]; default: none
      logical, intent(in), optional :: is_equation(:)
      !> Matrix whose columns `place` have the products A, [modes, columns]; if absent, A alone is used
      real(wp), intent(in), optional :: value(:, :)
      !> The columns, [n]
      integer, intent(in), optional :: place(:)

      if (size(right) == 1) then
         ! a single contact, as in most runs: no arrays are allocated
         is_positive(1) = right(1) < 0.0_wp
         if (present(is_equation)) is_positive(1) = is_positive(1) .or. is_equation(1)
         solution(1) = merge(-right(1)/matrix(1, 1), 0.0_wp, is_positive(1))
         return
      end if
      is_positive = .false.
      if (present(is_equation)) is_positive = is_equation
      call find_active_set(matrix, right, is_positive, solution, value, place)
   end subroutine solve_complementarity

   !> Find the active set and the solution by exchanges of one element of the set after the other.
   pure subroutine find_active_set(matrix, right, is_positive, solution, value, place)
      !> A
      real(wp), intent(in) :: matrix(:, :)
      !> q
      real(wp), intent(in) :: right(:)
      !> On entry the equations, on return the active set
      logical, intent(inout) :: is_positive(:)
      !> z
      real(wp), intent(out) :: solution(:)
      !> Matrix whose columns `place` have the products A, [modes, columns]; if absent, A alone is used
      real(wp), intent(in), optional :: value(:, :)
      !> The columns, [n]
      integer, intent(in), optional :: place(:)

      integer, parameter :: max_pivots = 1000
      logical :: best_set(size(right)), is_equation(size(right))
      real(wp) :: violation(size(right)), min_violation
      integer :: first, round

      is_equation = is_positive
      best_set = .false.
      min_violation = huge(1.0_wp)
      do round = 1, max_pivots
         call solve_active(matrix, right, is_positive, solution, value, place)
         violation = merge(0.0_wp, violations(matrix, right, is_positive, solution), is_equation)
         first = findloc(violation > 0.0_wp, .true., dim=1)
         if (first == 0) exit
         if (maxval(violation) < min_violation) then
            min_violation = maxval(violation)
            best_set = is_positive
         end if
         is_positive(first) = .not. is_positive(first)
      end do
      if (first > 0) then
         is_positive = best_set
         call solve_active(matrix, right, is_positive, solution, value, place)
      end if
      solution = merge(solution, max(solution, 0.0_wp), is_equation)
   end subroutine find_active_set

   !> Magnitude by which z_i (in the active set) or w_i (outside it) is negative beyond rounding, as a fraction of its
   !> terms; 0: not negative.
   pure function violations(matrix, right, is_positive, solution) result(violation)
      !> A
      real(wp), intent(in) :: matrix(:, :)
      !> q
      real(wp), intent(in) :: right(:)
      !> Whether each unknown is in the active set
      logical, intent(in) :: is_positive(:)
      !> Solution of the active set
      real(wp), intent(in) :: solution(:)
      real(wp) :: violation(size(right))

      real(wp) :: value, terms
      integer :: i, n

      n = size(right)
      violation = 0.0_wp
      do i = 1, n
         if (is_positive(i)) then
            value = solution(i)
            terms = maxval(abs(solution))
         else
            value = right(i) + dot_product(matrix(:, i), solution)
            terms = abs(right(i)) + dot_product(abs(matrix(:, i)), abs(solution))
         end if
         if (value < -8.0_wp*real(n, wp)*epsilon(1.0_wp)*terms) violation(i) = -value/terms
      end do
   end function violations

   !> Solve A z + q = 0 on the active set, with z = 0 elsewhere.
   pure subroutine solve_active(matrix, right, is_positive, solution, value, place)
      !> A
      real(wp), intent(in) :: matrix(:, :)
      !> q
      real(wp), intent(in) :: right(:)
      !> The active set
      logical, intent(in) :: is_positive(:)
      !> z
      real(wp), intent(out) :: solution(:)
      !> Matrix whose columns `place` have the products A, [modes, columns]; if absent, A alone is used
      real(wp), intent(in), optional :: value(:, :)
      !> The columns, [n]
      integer, intent(in), optional :: place(:)

      logical :: loses_digits

      if (size(right) == 1) then
         ! a single contact: no arrays are allocated
         solution(1) = 0.0_wp
         if (is_positive(1) .and. matrix(1, 1) > 0.0_wp) solution(1) = -right(1)/matrix(1, 1)
         return
      end if
      call eliminate_active(matrix, right, is_positive, solution, loses_digits)
      if (loses_digits .and. present(value)) call solve_columns(value(:, place), right, is_positive, solution)
   end subroutine solve_active

   !> `solve_active` by orthogonal columns with the products A. The products of the large values of a light body hide
   !> the products of the beam, and these hide the products of a heavy body. Columns in which one mode takes part, such
   !> as that of a body and its floor, come first: the others lose this mode without rounding. A column that depends
   !> linearly on the previous columns is omitted, and its z is zero.
   pure subroutine solve_columns(value, right, is_positive, solution)
      !> The columns, [modes, n]
      real(wp), intent(in) :: value(:, :)
      !> q
      real(wp), intent(in) :: right(:)
      !> The active set
      logical, intent(in) :: is_positive(:)
      !> z
      real(wp), intent(out) :: solution(:)

      ! part of a column that is orthogonal to the previous columns, as a fraction of the column; a smaller part is
      ! rounding
      real(wp), parameter :: min_part = 64.0_wp*epsilon(1.0_wp)
      ! orthonormal columns
      real(wp) :: unit(size(value, 1), size(right))
      ! coefficients of the columns of the matrix in the orthonormal columns
      real(wp) :: factor(size(right), size(right))
      real(wp) :: column(size(value, 1)), part, y(size(right))
      integer :: i, j, k, n, pass, round, used(size(right))

      n = size(right)
      k = 0
      do round = 1, 2
         do j = 1, n
            column = value(:, j)
            if (.not. is_positive(j) .or. (count(abs(column) > 0.0_wp) == 1 .neqv. round == 1)) cycle
            factor(:, k + 1) = 0.0_wp
            do pass = 1, 2
               do i = 1, k
                  part = sum(unit(:, i)*column)
                  factor(i, k + 1) = factor(i, k + 1) + part
                  column = column - part*unit(:, i)
               end do
            end do
            part = norm2(column)
            if (.not. part > min_part*norm2(value(:, j))) cycle
            k = k + 1
            used(k) = j
            factor(k, k) = part
            unit(:, k) = column/part
         end do
      end do
      do i = 1, k
         y(i) = -(right(used(i)) + sum(factor(:i - 1, i)*y(:i - 1)))/factor(i, i)
      end do
      solution = 0.0_wp
      do i = k, 1, -1
         y(i) = (y(i) - sum(factor(i, i + 1:k)*y(i + 1:k)))/factor(i, i)
         solution(used(i)) = y(i)
      end do
   end subroutine solve_columns

   !> `solve_active` by elimination without pivoting. An equation that depends linearly on the previous equations is
   !> omitted, and its z is zero.
   pure subroutine eliminate_active(matrix, right, is_positive, solution, loses_digits)
      !> A
      real(wp), intent(in) :: matrix(:, :)
      !> q
      real(wp), intent(in) :: right(:)
      !> The active set
      logical, intent(in) :: is_positive(:)
      !> z
      real(wp), intent(out) :: solution(:)
      !> Whether a pivot is a small difference
      logical, intent(out) :: loses_digits

      ! pivot over its entry of A
      real(wp), parameter :: small = 1.0e-3_wp
      real(wp) :: rows(size(right), size(right))
      integer :: i, j, n
      logical :: is_independent(size(right))

      n = size(right)
      rows = matrix
      solution = merge(-right, 0.0_wp, is_positive)
      is_independent = is_positive
      loses_digits = .false.
      do j = 1, n
         if (.not. is_independent(j)) cycle
         loses_digits = loses_digits .or. rows(j, j) < small*matrix(j, j)
         is_independent(j) = rows(j, j) > 4.0_wp*epsilon(1.0_wp)*matrix(j, j)
         if (.not. is_independent(j)) then
            solution(j) = 0.0_wp
            cycle
         end if
         do i = j + 1, n
            if (.not. is_independent(i)) cycle
            associate (factor => rows(i, j)/rows(j, j))
               rows(i, j + 1:) = rows(i, j + 1:) - factor*rows(j, j + 1:)
               solution(i) = solution(i) - factor*solution(j)
            end associate
         end do
      end do
      do j = n, 1, -1
         if (.not. is_independent(j)) cycle
         do i = j + 1, n
            if (is_independent(i)) solution(j) = solution(j) - rows(j, i)*solution(i)
         end do
         solution(j) = solution(j)/rows(j, j)
      end do
   end subroutine eliminate_active

   !> Forces, of either sign, that make negative gaps zero. The most negative gap is closed first; then, repeatedly, the
   !> most negative of the other gaps is closed together with the gaps that are closed already. Of several gaps at one
   !> point only one is closed by a force.
   pure subroutine close_gaps(compliance, gap, rounding, force)
      !> Change of each gap per unit force at each other gap, symmetric, [gaps, gaps]
      real(wp), intent(in) :: compliance(:, :)
      real(wp), intent(in) :: gap(:)
      !> Rounding errors of the gaps: a gap less negative than its rounding error stays open
      real(wp), intent(in) :: rounding(:)
      real(wp), intent(out) :: force(:)

      real(wp) :: current_gap(size(gap))
      logical :: is_closed(size(gap))
      integer :: round, worst

      force = 0.0_wp
      is_closed = .false.
      do round = 1, size(gap)
         current_gap = merge(0.0_wp, gap + matmul(compliance, force) + rounding, is_closed)
         worst = minloc(current_gap, dim=1)
         if (current_gap(worst) >= 0.0_wp) return
         is_closed(worst) = .true.
         call solve_active(compliance, gap, is_closed, force)
      end do
   end subroutine close_gaps

end module complementarity
