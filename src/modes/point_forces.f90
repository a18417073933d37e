!> Forces of springs or supports at points of a beam, in its modes, if all motion is proportional to exp(s t).
module point_forces
   use free_modes, only: max_rigid_square, rigid_square
   use kinds, only: wp
   use small_equations, only: eliminate
   implicit none (type, external)
   private
   public :: combine_rigid_modes, find_point_forces, static_rows, slow_frequency

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
         do j = 1, k
            matrix(j, k) = sum(value(:, j)*value(:, k)*inverse)
            matrix(k, j) = matrix(j, k)
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

   !> Rows of static equilibrium: those of the points and one for each of the `rigid_motions`, which has no modal force
   !> in equilibrium: the sum of its components times W^2 z is zero, as at a rigid support. The W^2 of these modes are
   !> too small for the equations to yield that.
   pure function static_rows(square, value) result(rows)
      !> Squared circular frequencies W_i^2, [modes]
      real(wp), intent(in) :: square(:)
      !> Mode shapes at the points, [modes, points]
      real(wp), intent(in) :: value(:, :)
      !> Mode shapes at the points, then the rows of rigid supports, [modes, points + motions]
      real(wp), allocatable :: rows(:, :)

      real(wp), allocatable :: motion(:, :)
      integer :: points

      points = size(value, 2)
      allocate (motion, source=rigid_motions(square, value))
      allocate (rows(size(square), points + size(motion, 2)))
      rows(:, :points) = value
      rows(:, points + 1:) = spread(square/rigid_square, 2, size(motion, 2))*motion
   end function static_rows

   !> Combine the modes without restoring forces so that each motion of them which moves no point is a mode. Only modes
   !> with the same damping are combined, because damping would couple other combinations.
   pure subroutine combine_rigid_modes(square, mass_rate, value, change, is_still)
      !> Squared circular frequencies W_i^2, [modes]
      real(wp), intent(in) :: square(:)
      !> Coefficients of damping proportional to mass, [modes]
      real(wp), intent(in) :: mass_rate(:)
      !> Mode shapes at the points, [modes, points]
      real(wp), intent(in) :: value(:, :)
      !> The new modes as combinations of the modes, [modes, new modes]
      real(wp), allocatable, intent(out) :: change(:, :)
      !> Whether each new mode is a combination that moves no point, [new modes]; if none is, no mode has changed
      logical, intent(out) :: is_still(:)

      ! damping by less than this rate has no effect in a run of the maximum duration
      real(wp), parameter :: min_rate = 1.0e-18_wp
      real(wp), allocatable :: motion(:, :)
      ! squared frequencies, 1 for modes that do not take part in the combinations
      real(wp) :: restricted(size(square))
      integer, allocatable :: rigid(:)
      logical :: is_left(size(square))
      integer :: i

      allocate (change(size(square), size(square)), source=0.0_wp)
      do i = 1, size(square)
         change(i, i) = 1.0_wp
      end do
      is_still = .false.
      is_left = square <= max_rigid_square
      do while (any(is_left))
         i = findloc(is_left, .true., dim=1)
         rigid = pack([(i, i=1, size(square))], is_left .and. abs(mass_rate - mass_rate(i)) <= min_rate)
         is_left(rigid) = .false.
         restricted = 1.0_wp
         restricted(rigid) = square(rigid)
         motion = rigid_motions(restricted, value)
         associate (n => size(motion, 2))
            ! if each of the motions is a mode already, no mode changes
            if (n == count(.not. maxval(abs(value(rigid, :)), dim=2) > 0.0_wp)) cycle
            change(:, rigid(:n)) = motion
            change(:, rigid(n + 1:)) = rigid_motions(restricted, motion)
            is_still(rigid(:n)) = .true.
         end associate
      end do
   end subroutine combine_rigid_modes

   !> Motions of modes without restoring forces that move no point, for example the rotation of a beam about a pinned
   !> root together with a body, if the displacement of the point is the gap between both.
   pure function rigid_motions(square, value) result(motion)
      !> Squared circular frequencies W_i^2, [modes]
      real(wp), intent(in) :: square(:)
      !> Mode shapes at the points, [modes, points]
      real(wp), intent(in) :: value(:, :)
      !> Orthonormal motions, [modes, motions]
      real(wp), allocatable :: motion(:, :)

      ! a row whose part is below this fraction of it is a combination of the rows before it, to rounding
      real(wp), parameter :: rounding = 1.0e-10_wp
      ! projection of the modes without restoring forces on the motions that do not move the points so far
      real(wp), allocatable :: projection(:, :)
      real(wp), allocatable :: row(:)
      integer, allocatable :: rigid(:)
      integer :: i, k, n

      allocate (rigid, source=pack([(i, i=1, size(square))], square <= max_rigid_square))
      allocate (projection(size(rigid), size(rigid)), source=0.0_wp)
      allocate (row(size(rigid)))
      do i = 1, size(rigid)
         projection(i, i) = 1.0_wp
      end do
      do k = 1, size(value, 2)
         row(:) = matmul(projection, matmul(projection, value(rigid, k)))
         if (norm2(row) <= rounding*maxval([0.0_wp, abs(value(:, k))])) cycle
         row(:) = row/norm2(row)
         projection = projection - spread(row, 2, size(row))*spread(row, 1, size(row))
      end do
      n = nint(sum([(projection(i, i), i=1, size(rigid))]))
      allocate (motion(size(square), n), source=0.0_wp)
      do k = 1, n
         i = maxloc([(projection(i, i), i=1, size(rigid))], dim=1)
         row(:) = projection(:, i)/norm2(projection(:, i))
         motion(rigid, k) = row
         projection = projection - spread(row, 2, size(row))*spread(row, 1, size(row))
      end do
   end function rigid_motions

end module point_forces
