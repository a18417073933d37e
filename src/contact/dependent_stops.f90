!> Stops whose branches relax at one rate, where the beam cannot move them apart: at one point, or more of them than
!> modes.
!>
!> Their indentations are u = S' v, v those of fewer stops that the beam does move apart; their forces P move the modes
!> as S P of these. What their branches keep besides, P2 with S P2 = 0, moves no mode and relaxes alone (docs/theory.md,
!> section 17).
module dependent_stops
   use kinds, only: wp
   use lapack_interfaces, only: dsygv
   use yielding_stop, only: impedance_t
   implicit none (type, external)
   private
   public :: stop_parts_t, part_stops

   !> Stops that stand for others.
   type :: stop_parts_t
      !> They do: there are stops that the beam cannot move apart
      logical :: is_needed = .false.
      !> Those that stand for all, and modes there, [parts], [modes, parts]
      type(impedance_t), allocatable :: spring(:)
      real(wp), allocatable :: value(:, :)
      !> S: of their indentations those of the stops are sums, [parts, stops]
      real(wp), allocatable :: share(:, :)
      !> A stop stands for itself, [stops]
      logical, allocatable :: is_itself(:)
      !> What relaxes alone: P2 of the stops, how much there is of it in their P2, and how fast, [stops, alone], [alone]
      real(wp), allocatable :: alone(:, :), of_memory(:, :), rate(:)
   end type stop_parts_t

   !> Rates are the same, and directions dependent, within these shares.
   real(wp), parameter :: same_rate = 1.0e-10_wp, dependent = 1.0e-12_wp

contains

   !> Find them.
   subroutine part_stops(value, spring, parts)
      !> [modes, stops]
      real(wp), intent(in) :: value(:, :)
      !> [stops]
      type(impedance_t), intent(in) :: spring(:)
      type(stop_parts_t), intent(out) :: parts

      integer, allocatable :: group(:)
      logical :: is_done(size(spring))
      integer :: j

      allocate (parts%spring(0), parts%value(size(value, 1), 0), parts%share(0, size(spring)), &
         parts%is_itself(size(spring)))
      allocate (parts%alone(size(spring), 0), parts%of_memory(size(spring), 0), parts%rate(0))
      is_done = .false.
      do j = 1, size(spring)
         if (is_done(j)) cycle
         allocate (group, source=members(j))
         is_done(group) = .true.
         call part_group(value(:, group), spring(group), group, parts)
         deallocate (group)
      end do
      parts%is_needed = size(parts%rate) > 0

   contains

      !> All stops with the rate of one; without a branch it is alone.
      pure function members(j) result(places)
         integer, intent(in) :: j
         integer, allocatable :: places(:)

         integer :: k

         places = [j]
         if (spring(j)%branch_stiffness <= 0.0_wp) return
         places = pack([(k, k=1, size(spring))], spring%branch_stiffness > 0.0_wp .and. .not. is_done .and. &
            abs(spring%relaxation_rate - spring(j)%relaxation_rate) <= same_rate*spring(j)%relaxation_rate)
      end function members
   end subroutine part_stops

   !> Stops of one rate.
   subroutine part_group(value, spring, places, parts)
      !> Of the group, [modes, group]
      real(wp), intent(in) :: value(:, :)
      type(impedance_t), intent(in) :: spring(:)
      !> Which stops they are
      integer, intent(in) :: places(:)
      type(stop_parts_t), intent(inout) :: parts

      real(wp), allocatable :: basis(:, :), elastic(:, :), kept(:, :), share(:, :), strength(:)
      type(impedance_t), allocatable :: made(:)
      real(wp) :: length
      integer :: i, n, rank

      n = size(places)
      call factorise(value, basis, share)
      rank = size(basis, 2)
      if (rank == n .or. spring(1)%branch_stiffness <= 0.0_wp) then
         share = reshape([(merge(1.0_wp, 0.0_wp, modulo(i, n + 1) == 1), i=1, n*n)], [n, n])
         call add_parts(value, spring, share, places, parts)
         parts%is_itself(places) = .true.
         return
      end if
      parts%is_itself(places) = .false.
      elastic = matmul(share*spread(spring%stiffness, 1, rank), transpose(share))
      kept = matmul(share*spread(spring%branch_stiffness, 1, rank), transpose(share))
      call make_diagonal(elastic, kept, strength)
      ! kept is X with X' K X = 1 now
      basis = matmul(basis, matmul(elastic, kept))
      share = matmul(transpose(kept), share)
      allocate (made(rank))
      do i = 1, rank
         length = norm2(share(i, :))
         share(i, :) = share(i, :)/length
         basis(:, i) = basis(:, i)*length
         made(i) = impedance_t(stiffness=length**(-2), branch_stiffness=strength(i)*length**(-2), &
            relaxation_rate=spring(1)%relaxation_rate)
      end do
      call add_parts(basis, made, share, places, parts)
      call add_alone(share, made, spring, places, parts)
   end subroutine part_group

   !> value = basis share, the columns of the basis orthonormal: as many as are independent.
   pure subroutine factorise(value, basis, share)
      real(wp), intent(in) :: value(:, :)
      real(wp), allocatable, intent(out) :: basis(:, :)
      real(wp), allocatable, intent(out) :: share(:, :)

      real(wp) :: own(size(value, 1)), part(size(value, 2)), parts(size(value, 2), size(value, 2))
      integer :: j, rank, turn

      allocate (basis(size(value, 1), 0))
      parts = 0.0_wp
      do j = 1, size(value, 2)
         own = value(:, j)
         rank = size(basis, 2)
         ! once more for what rounding left
         do turn = 1, 2
            part(:rank) = matmul(own, basis)
            own = own - matmul(basis, part(:rank))
            parts(:rank, j) = parts(:rank, j) + part(:rank)
         end do
         if (norm2(own) <= dependent*norm2(value(:, j))) cycle
         basis = reshape([basis, own/norm2(own)], [size(own), rank + 1])
         parts(rank + 1, j) = norm2(own)
      end do
      allocate (share, source=parts(:size(basis, 2), :))
   end subroutine factorise

   !> Of two symmetric matrices X with X' K X = 1 and X' A X diagonal.
   subroutine make_diagonal(elastic, kept, strength)
      !> K, positive definite
      real(wp), intent(in) :: elastic(:, :)
      !> A, then X
      real(wp), intent(inout) :: kept(:, :)
      !> The diagonal
      real(wp), allocatable, intent(out) :: strength(:)

      real(wp) :: factor(size(elastic, 1), size(elastic, 1)), work(8*size(elastic, 1) + 8)
      integer :: info, n

      n = size(elastic, 1)
      allocate (strength(n))
      factor = elastic
      if (n > 0) call dsygv(1, 'V', 'U', n, kept, n, factor, n, strength, work, size(work), info)
   end subroutine make_diagonal

   !> Stops that stand for some.
   pure subroutine add_parts(value, spring, share, places, parts)
      real(wp), intent(in) :: value(:, :)
      type(impedance_t), intent(in) :: spring(:)
      !> [of these, places]
      real(wp), intent(in) :: share(:, :)
      integer, intent(in) :: places(:)
      type(stop_parts_t), intent(inout) :: parts

      real(wp), allocatable :: larger(:, :)
      integer :: before

      before = size(parts%spring)
      allocate (larger(before + size(spring), size(parts%share, 2)), source=0.0_wp)
      larger(:before, :) = parts%share
      larger(before + 1:, places) = share
      call move_alloc(larger, parts%share)
      parts%spring = [parts%spring, spring]
      parts%value = reshape([parts%value, value], [size(value, 1), size(parts%spring)])
   end subroutine add_parts

   !> What is in no P2 = A S' y: the projection 1 - A S' (S A S')^-1 S as products of a column and a row.
   pure subroutine add_alone(share, made, spring, places, parts)
      real(wp), intent(in) :: share(:, :)
      !> With S A S'
      type(impedance_t), intent(in) :: made(:)
      !> With A
      type(impedance_t), intent(in) :: spring(:)
      integer, intent(in) :: places(:)
      type(stop_parts_t), intent(inout) :: parts

      real(wp), dimension(size(places), size(places)) :: projection, rest
      real(wp), dimension(size(parts%is_itself)) :: column, row
      integer :: i, j

      projection = 0.0_wp
      do i = 1, size(places)
         projection(i, i) = 1.0_wp
         do j = 1, size(places)
            projection(j, i) = projection(j, i) - spring(j)%branch_stiffness*sum(share(:, j)*share(:, i) &
               /made%branch_stiffness)
         end do
      end do
      rest = projection
      do i = 1, size(places) - size(made)
         j = maxloc(norm2(rest, 1), dim=1)
         column = 0.0_wp
         row = 0.0_wp
         column(places) = rest(:, j)/norm2(rest(:, j))
         row(places) = matmul(column(places), projection)
         rest = rest - spread(column(places), 2, size(places))*spread(matmul(column(places), rest), 1, size(places))
         parts%alone = reshape([parts%alone, column], [size(column), size(parts%rate) + 1])
         parts%of_memory = reshape([parts%of_memory, row], [size(row), size(parts%rate) + 1])
         parts%rate = [parts%rate, spring(1)%relaxation_rate]
      end do
   end subroutine add_alone

end module dependent_stops
