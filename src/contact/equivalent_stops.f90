!> Stops that are replaced before the coupled motion is computed. `reduce_rows` treats stops that share modes with a
!> rigid stop.
!>
!> Equivalent stops replace compliant stops of one relaxation rate nu whose columns of modal values are linearly
!> dependent, because the stops are at one point or outnumber the modes. Such stops would give the characteristic
!> equation roots at the pole -nu itself, so fewer equivalent stops replace them.
!>
!> The indentations of the stops are u = S' v, with v the indentations of the equivalent stops and S' the transpose of
!> S, and the forces P of the stops act on the modes as the forces S P of the equivalent stops. The remaining branch
!> forces P2 with S P2 = 0 act on no mode and relax independently (docs/theory.md, section 17).
module equivalent_stops
   use compliant_stop, only: dynamic_stiffness_t, is_rigid_stop
   use kinds, only: wp
   use lapack_interfaces, only: dsygv
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: equivalent_stops_t, find_equivalent_stops, reduce_rows

   !> Equivalent stops for a set of stops.
   type :: equivalent_stops_t
      !> Whether some columns of modal values are linearly dependent
      logical :: is_needed = .false.
      !> Dynamic stiffnesses of the equivalent stops, [equivalent]
      type(dynamic_stiffness_t), allocatable :: spring(:)
      !> Modal values at the equivalent stops, [modes, equivalent]
      real(wp), allocatable :: value(:, :)
      !> S: the indentations of the stops are S' times those of the equivalent stops, [equivalent, stops]
      real(wp), allocatable :: combination(:, :)
      !> Whether each stop is its own equivalent stop, [stops]
      logical, allocatable :: is_own_equivalent(:)
      !> Combinations of branch forces that relax independently: P2 of each stop per unit of each combination, [stops,
      !> independent]
      real(wp), allocatable :: independent(:, :)
      !> Coefficients that give the amount of each combination in given branch forces P2, [stops, independent]
      real(wp), allocatable :: memory_weight(:, :)
      !> Relaxation rate of each combination, [independent]
      real(wp), allocatable :: rate(:)
   end type equivalent_stops_t

   !> Relaxation rates that differ by less than this fraction are equal.
   real(wp), parameter :: rate_tolerance = 1.0e-10_wp
   !> A column counts as linearly dependent on the columns before it if less than this fraction of the column is
   !> independent.
   real(wp), parameter :: dependence_tolerance = 1.0e-12_wp

contains

   !> If a rigid stop and another stop are at one point of the beam, replace the row b_j of the other stop by b_j + c
   !> b_i, with b_i the row of the rigid stop and c = 1 or -1 such that the modes of the beam cancel. Because the rigid
   !> stop does not move, this does not change the gap of the other stop; c times the force of stop j must then be added
   !> to the force of stop i. A body that meets the beam at such a point thus moves independently of the beam, and the
   !> equations are not singular at its roots.
   !>
   !> A rigid stop that one mode alone moves holds this mode, and c is such that the mode cancels in the rows of all
   !> other stops; the equations would be singular if this mode were their separated mode.
   pure subroutine reduce_rows(spring, row, base, factor)
      !> Dynamic stiffnesses of the stops, [stops]
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      !> Rows of the stops: values of the modes, [modes, stops]
      real(wp), intent(inout) :: row(:, :)
      !> Index of the rigid stop i whose row has been added to that of each stop; 0: none, [stops]
      integer, intent(out) :: base(:)
      !> c of each stop, [stops]
      real(wp), intent(out) :: factor(:)

      ! values of c that are tried
      real(wp) :: trial(3)
      real(wp) :: sum_of_rows(size(row, 1))
      ! indices of the stops, ascending by the number of modes that take part in their rows
      integer :: order(size(spring)), i, j, k, m
      ! the only mode that moves a rigid stop; 0: there are more
      integer :: only

      base = 0
      factor = 0.0_wp
      order = ascending_order(real(count(abs(row) > 0.0_wp, dim=1), wp))
      do m = 1, size(spring)
         i = order(m)
         if (.not. is_rigid_stop(spring(i)) .or. base(i) > 0) cycle
         only = 0
         if (count(abs(row(:, i)) > 0.0_wp) == 1) only = maxloc(abs(row(:, i)), dim=1)
         do j = 1, size(spring)
            if (j == i .or. base(j) > 0 .or. any(base == j)) cycle
            trial = [-1.0_wp, 1.0_wp, 0.0_wp]
            if (only > 0) trial(3) = -row(only, j)/row(only, i)
            do k = 1, size(trial)
               sum_of_rows = row(:, j) + trial(k)*row(:, i)
               if (k == 3 .and. only > 0) sum_of_rows(only) = 0.0_wp
               associate (entries => count(abs(sum_of_rows) > 0.0_wp))
                  ! a compliant stop that does not move is independent of all modes: its branch force alone relaxes
                  if (entries == 0 .and. is_rigid_stop(spring(j))) cycle
                  if (entries >= count(abs(row(:, j)) > 0.0_wp)) cycle
               end associate
               base(j) = i
               factor(j) = trial(k)
               row(:, j) = sum_of_rows
               exit
            end do
         end do
      end do
   end subroutine reduce_rows

   !> Find the equivalent stops of each group of stops with one relaxation rate; none are needed without branches.
   subroutine find_equivalent_stops(value, spring, equivalent)
      !> Modal values at the stops, [modes, stops]
      real(wp), intent(in) :: value(:, :)
      !> Dynamic stiffnesses, [stops]
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      type(equivalent_stops_t), intent(out) :: equivalent

      integer, allocatable :: group(:)
      logical :: is_done(size(spring))
      integer :: j

      if (.not. any(spring%branch_stiffness > 0.0_wp)) return
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
      !> Equivalent stops of all groups so far; those of this group are appended
      type(equivalent_stops_t), intent(inout) :: equivalent

      real(wp), allocatable :: basis(:, :), elastic(:, :), branch(:, :), combination(:, :), eigenvalue(:)
      real(wp), allocatable :: factor(:, :), work(:)
      type(dynamic_stiffness_t), allocatable :: dynamic_stiffness(:)
      real(wp) :: length
      integer :: i, info, n, rank

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
      ! K = S k S' and G = S A S', with the diagonal matrices k of stiffnesses and A of branch stiffnesses of the stops
      elastic = matmul(combination*spread(spring%stiffness, 1, rank), transpose(combination))
      branch = matmul(combination*spread(spring%branch_stiffness, 1, rank), transpose(combination))
      ! `branch` becomes X, with X' K X = 1 and X' G X diagonal. `info` is not tested, because K is positive definite
      factor = elastic
      allocate (eigenvalue(rank), work(8*rank + 8))
      if (rank > 0) call dsygv(1, 'V', 'U', rank, branch, rank, factor, rank, eigenvalue, work, size(work), info)
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
   !> basis as `value` has independent columns.
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

   !> Append equivalent stops of a group.
   pure subroutine add_equivalents(value, spring, combination, places, equivalent)
      !> Modal values at these equivalent stops, [modes, equivalent of the group]
      real(wp), intent(in) :: value(:, :)
      !> Dynamic stiffnesses of these equivalent stops
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      !> Rows of S for the group, [equivalent of the group, places]
      real(wp), intent(in) :: combination(:, :)
      !> Indices of the stops of the group among all stops
      integer, intent(in) :: places(:)
      !> Equivalent stops of all groups so far; those of this group are appended
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
      !> Equivalent stops of all groups so far; those of this group are appended
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
