!> Equivalent stops for compliant stops of one relaxation rate nu whose columns of modal values are linearly dependent,
!> because the stops are at one point or outnumber the modes. Such stops would give the characteristic equation roots at
!> the pole -nu itself, so fewer equivalent stops replace them.
!>
!> The indentations of the stops are u = S' v, with v the indentations of the equivalent stops and S' the transpose of
!> S, and the forces P of the stops act on the modes as the forces S P of the equivalent stops. The remaining branch
!> forces P2 with S P2 = 0 act on no mode and relax independently (docs/theory.md, section 17).
module equivalent_stops
   use compliant_stop, only: dynamic_stiffness_t
   use kinds, only: wp
   use lapack_interfaces, only: dsygv
   implicit none (type, external)
   private
   public :: equivalent_stops_t, find_equivalent_stops

   !> Equivalent stops for a set of stops.
   type :: equivalent_stops_t
      !> Some columns of modal values are linearly dependent
      logical :: is_needed = .false.
      !> Dynamic stiffnesses of the equivalent stops, and the modal values at them, [equivalent], [modes, equivalent]
      type(dynamic_stiffness_t), allocatable :: spring(:)
      real(wp), allocatable :: value(:, :)
      !> S: the indentations of the stops are S' times those of the equivalent stops, [equivalent, stops]
      real(wp), allocatable :: combination(:, :)
      !> The stop is its own equivalent stop, [stops]
      logical, allocatable :: is_own_equivalent(:)
      !> Independently relaxing branch forces: P2 of the stops per unit of each, the coefficients that give the amount
      !> of each in a given P2, and the relaxation rates, [stops, independent], [stops, independent], [independent]
      real(wp), allocatable :: independent(:, :), memory_weight(:, :), rate(:)
   end type equivalent_stops_t

   !> Relative tolerances: for equal relaxation rates, and for linear dependence of a column on those before it.
   real(wp), parameter :: rate_tolerance = 1.0e-10_wp, dependence_tolerance = 1.0e-12_wp

contains

   !> Find the equivalent stops of each group of stops with one relaxation rate.
   subroutine find_equivalent_stops(value, spring, equivalent)
      !> Modal values at the stops, [modes, stops]
      real(wp), intent(in) :: value(:, :)
      !> Dynamic stiffnesses, [stops]
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      type(equivalent_stops_t), intent(out) :: equivalent

      integer, allocatable :: group(:)
      logical :: is_done(size(spring))
      integer :: j

      allocate (equivalent%spring(0), equivalent%value(size(value, 1), 0), equivalent%combination(0, size(spring)), &
         equivalent%is_own_equivalent(size(spring)))
      allocate (equivalent%independent(size(spring), 0), equivalent%memory_weight(size(spring), 0), equivalent%rate(0))
      is_done = .false.
      do j = 1, size(spring)
         if (is_done(j)) cycle
         allocate (group, source=members(j))
         is_done(group) = .true.
         call find_group_equivalents(value(:, group), spring(group), group, equivalent)
         deallocate (group)
      end do
      equivalent%is_needed = size(equivalent%rate) > 0

   contains

      !> Indices of all stops that have the relaxation rate of stop j; a stop without a branch forms a group of one.
      pure function members(j) result(places)
         integer, intent(in) :: j
         integer, allocatable :: places(:)

         integer :: k

         places = [j]
         if (spring(j)%branch_stiffness <= 0.0_wp) return
         places = pack([(k, k=1, size(spring))], spring%branch_stiffness > 0.0_wp .and. .not. is_done .and. &
            abs(spring%relaxation_rate - spring(j)%relaxation_rate) <= rate_tolerance*spring(j)%relaxation_rate)
      end function members
   end subroutine find_equivalent_stops

   !> Equivalent stops of a group with one relaxation rate.
   subroutine find_group_equivalents(value, spring, places, equivalent)
      !> Modal values at the stops of the group, [modes, group]
      real(wp), intent(in) :: value(:, :)
      !> Dynamic stiffnesses of the stops of the group, [group]
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      !> Indices of the stops of the group among all stops
      integer, intent(in) :: places(:)
      type(equivalent_stops_t), intent(inout) :: equivalent

      real(wp), allocatable :: basis(:, :), elastic(:, :), branch(:, :), combination(:, :), eigenvalue(:)
      type(dynamic_stiffness_t), allocatable :: dynamic_stiffness(:)
      real(wp) :: length
      integer :: i, n, rank

      n = size(places)
      call factorise(value, basis, combination)
      rank = size(basis, 2)
      if (rank == n .or. spring(1)%branch_stiffness <= 0.0_wp) then
         ! the identity matrix: each stop is its own equivalent stop
         combination = reshape([(merge(1.0_wp, 0.0_wp, modulo(i, n + 1) == 1), i=1, n*n)], [n, n])
         call add_equivalents(value, spring, combination, places, equivalent)
         equivalent%is_own_equivalent(places) = .true.
         return
      end if
      equivalent%is_own_equivalent(places) = .false.
      ! K = S k S' and A = S beta k S', with the diagonal matrices of the stops' k and beta k
      elastic = matmul(combination*spread(spring%stiffness, 1, rank), transpose(combination))
      branch = matmul(combination*spread(spring%branch_stiffness, 1, rank), transpose(combination))
      call diagonalise(elastic, branch, eigenvalue)
      ! `branch` now contains X, with X' K X = 1
      basis = matmul(basis, matmul(elastic, branch))
      combination = matmul(transpose(branch), combination)
      allocate (dynamic_stiffness(rank))
      do i = 1, rank
         ! scale each row of S to unit length; before, the equivalent stop has the stiffness 1 and the branch stiffness
         ! `eigenvalue`, which change with the square of the length
         length = norm2(combination(i, :))
         combination(i, :) = combination(i, :)/length
         basis(:, i) = basis(:, i)*length
         dynamic_stiffness(i) = dynamic_stiffness_t(stiffness=length**(-2), &
            branch_stiffness=eigenvalue(i)*length**(-2), relaxation_rate=spring(1)%relaxation_rate)
      end do
      call add_equivalents(basis, dynamic_stiffness, combination, places, equivalent)
      call add_independent(combination, dynamic_stiffness, spring, places, equivalent)
   end subroutine find_group_equivalents

   !> Factorise value = basis combination by Gram-Schmidt orthogonalisation, with as many orthonormal columns in the
   !> basis as `value` has independent ones.
   pure subroutine factorise(value, basis, combination)
      real(wp), intent(in) :: value(:, :)
      real(wp), allocatable, intent(out) :: basis(:, :)
      real(wp), allocatable, intent(out) :: combination(:, :)

      real(wp) :: residual(size(value, 1)), projection(size(value, 2)), coefficients(size(value, 2), size(value, 2))
      integer :: j, rank, pass

      allocate (basis(size(value, 1), 0))
      coefficients = 0.0_wp
      do j = 1, size(value, 2)
         residual = value(:, j)
         rank = size(basis, 2)
         ! the second pass removes the rounding errors of the first
         do pass = 1, 2
            projection(:rank) = matmul(residual, basis)
            residual = residual - matmul(basis, projection(:rank))
            coefficients(:rank, j) = coefficients(:rank, j) + projection(:rank)
         end do
         if (norm2(residual) <= dependence_tolerance*norm2(value(:, j))) cycle
         basis = reshape([basis, residual/norm2(residual)], [size(residual), rank + 1])
         coefficients(rank + 1, j) = norm2(residual)
      end do
      allocate (combination, source=coefficients(:size(basis, 2), :))
   end subroutine factorise

   !> Solve the generalised symmetric eigenproblem of the stiffness matrix K and the branch stiffness matrix A: find X
   !> with X' K X = 1 and X' A X diagonal.
   subroutine diagonalise(elastic, branch, eigenvalue)
      !> K, positive definite
      real(wp), intent(in) :: elastic(:, :)
      !> A on entry, X on return
      real(wp), intent(inout) :: branch(:, :)
      !> Diagonal of X' A X
      real(wp), allocatable, intent(out) :: eigenvalue(:)

      real(wp) :: factor(size(elastic, 1), size(elastic, 1)), work(8*size(elastic, 1) + 8)
      integer :: info, n

      n = size(elastic, 1)
      allocate (eigenvalue(n))
      factor = elastic
      ! `info` is not tested, because K is positive definite
      if (n > 0) call dsygv(1, 'V', 'U', n, branch, n, factor, n, eigenvalue, work, size(work), info)
   end subroutine diagonalise

   !> Append equivalent stops of a group.
   pure subroutine add_equivalents(value, spring, combination, places, equivalent)
      !> Modal values at these equivalent stops, and their dynamic stiffnesses
      real(wp), intent(in) :: value(:, :)
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      !> Rows of S for the group, [equivalent of the group, places]
      real(wp), intent(in) :: combination(:, :)
      !> Indices of the stops of the group among all stops
      integer, intent(in) :: places(:)
      type(equivalent_stops_t), intent(inout) :: equivalent

      real(wp), allocatable :: larger(:, :)
      integer :: before

      before = size(equivalent%spring)
      allocate (larger(before + size(spring), size(equivalent%combination, 2)), source=0.0_wp)
      larger(:before, :) = equivalent%combination
      larger(before + 1:, places) = combination
      call move_alloc(larger, equivalent%combination)
      equivalent%spring = [equivalent%spring, spring]
      equivalent%value = reshape([equivalent%value, value], [size(value, 1), size(equivalent%spring)])
   end subroutine add_equivalents

   !> Append the independently relaxing branch forces, the complement of those P2 = A S' y that the equivalent stops
   !> represent: the projection 1 - A S' (S A S')^-1 S, with A the diagonal matrix of branch stiffnesses, as a sum of
   !> products of a column and a row.
   pure subroutine add_independent(combination, dynamic_stiffness, spring, places, equivalent)
      !> Rows of S for the group, [equivalent of the group, places]
      real(wp), intent(in) :: combination(:, :)
      !> Equivalent stops, whose branch stiffnesses are S A S'
      type(dynamic_stiffness_t), intent(in) :: dynamic_stiffness(:)
      !> Stops of the group, whose branch stiffnesses are A
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      !> Indices of the stops of the group among all stops
      integer, intent(in) :: places(:)
      type(equivalent_stops_t), intent(inout) :: equivalent

      real(wp), dimension(size(places), size(places)) :: projection, remainder
      real(wp), dimension(size(equivalent%is_own_equivalent)) :: column, row
      integer :: i, j

      projection = 0.0_wp
      do i = 1, size(places)
         projection(i, i) = 1.0_wp
         do j = 1, size(places)
            projection(j, i) = projection(j, i) - spring(j)%branch_stiffness*sum(combination(:, j)*combination(:, i) &
               /dynamic_stiffness%branch_stiffness)
         end do
      end do
      remainder = projection
      ! Gram-Schmidt orthogonalisation of the projection's columns, the longest remaining column first
      do i = 1, size(places) - size(dynamic_stiffness)
         j = maxloc(norm2(remainder, 1), dim=1)
         column = 0.0_wp
         row = 0.0_wp
         column(places) = remainder(:, j)/norm2(remainder(:, j))
         row(places) = matmul(column(places), projection)
         remainder = remainder - spread(column(places), 2, size(places)) &
            *spread(matmul(column(places), remainder), 1, size(places))
         equivalent%independent = reshape([equivalent%independent, column], [size(column), size(equivalent%rate) + 1])
         equivalent%memory_weight = reshape([equivalent%memory_weight, row], [size(row), size(equivalent%rate) + 1])
         equivalent%rate = [equivalent%rate, spring(1)%relaxation_rate]
      end do
   end subroutine add_independent

end module equivalent_stops
