!> The exponents of a beam that presses on several stops that yield (docs/theory.md, section 17).
!>
!> With the modes b_i at the stops, D_i(s) = s^2 + W_i^2 (1 + 2 zeta s), H(s) = sum b_i b_i'/D_i and, stop by stop,
!> N = s + nu (1 where there is no branch) and M = N Z, Z the impedance, they are the roots of det (N + M H) prod D_i =
!> 0. One mode is always taken apart: det (N + M H) D_i = det T_i (D_i + b_i' T_i^-1 M b_i), T_i without that mode, so
!> that nothing cancels next to its pole.
module joint_secular
   use constrained_modes, only: constrain
   use contact_secular, only: distances, find_mode_poles, inverses, root_distances, secular_t, size_of, sum_of_inverses
   use kinds, only: wp
   use yielding_stop, only: impedance_t
   implicit none (type, external)
   private
   public :: joint_secular_t, make_joint_secular, find_joint_roots, joint_vectors_t, vectors_at, solve_small

   !> `secular_t` has the poles, those of the branches last.
   type, extends(secular_t) :: joint_secular_t
      !> b_i at the stops, [modes, stops]
      real(wp), allocatable :: value(:, :)
      !> The stops, [stops], and the pole of the branch of each; 0: it has none
      type(impedance_t), allocatable :: spring(:)
      integer, allocatable :: branch_pole(:)
   end type joint_secular_t

   !> Roots that nearly coalesce are known within this share of them.
   real(wp), parameter :: coalescing = 1.0e-7_wp

   !> What belongs to a root, or to any s.
   type :: joint_vectors_t
      !> The mode taken apart; 0: there is no mode
      integer :: mode = 0
      !> T_i^-1 M b_i, and T_i'^-1 b_i, [stops]
      complex(wp), allocatable :: right(:), left(:)
      !> D_i + b_i' T_i^-1 M b_i, and its derivative
      complex(wp) :: value = 0.0_wp
      complex(wp) :: slope = 0.0_wp
      !> Logarithmic derivative of det T_i
      complex(wp) :: trace = 0.0_wp
      !> How much the sum for the slope cancels, >= 1
      real(wp) :: condition = 1.0_wp
   end type joint_vectors_t

contains

   !> The poles.
   subroutine make_joint_secular(square, value, zeta, spring, problem)
      !> W_i^2 of the modes that move a stop point, ascending, [modes]
      real(wp), intent(in) :: square(:)
      !> b_i, [modes, stops]
      real(wp), intent(in) :: value(:, :)
      real(wp), intent(in) :: zeta
      !> [stops]
      type(impedance_t), intent(in) :: spring(:)
      type(joint_secular_t), intent(out) :: problem

      integer :: j

      problem%modes = size(square)
      problem%two_zeta = 2.0_wp*zeta
      problem%poles = 2*size(square) + count(spring%branch_stiffness > 0.0_wp)
      problem%roots = problem%poles
      problem%spring = spring
      allocate (problem%square, source=square)
      allocate (problem%value, source=value)
      allocate (problem%pole(problem%poles), problem%relative(problem%poles))
      allocate (problem%branch_pole(size(spring)), source=0)
      call find_mode_poles(square, zeta, problem%pole, problem%relative)
      problem%poles = 2*size(square)
      do j = 1, size(spring)
         if (spring(j)%branch_stiffness <= 0.0_wp) cycle
         problem%poles = problem%poles + 1
         problem%branch_pole(j) = problem%poles
         problem%pole(problem%poles) = -spring(j)%relaxation_rate
         problem%relative(problem%poles) = 1.0_wp - problem%two_zeta*spring(j)%relaxation_rate
      end do
      allocate (problem%crowded(problem%poles))
      problem%crowded(:) = problem%two_zeta > 0.0_wp .and. abs(problem%relative) < 0.5_wp
   end subroutine make_joint_secular

   !> All roots, each as the nearest pole and the offset from it.
   subroutine find_joint_roots(problem, near, offset, converged)
      type(joint_secular_t), intent(in) :: problem
      !> [roots]
      integer, intent(out) :: near(:)
      complex(wp), intent(out) :: offset(:)
      logical, intent(out) :: converged

      integer, parameter :: iteration_cap = 500
      integer, parameter :: patient = 40
      integer, parameter :: most_patient = 200
      complex(wp) :: repulsion, step, s
      complex(wp), dimension(problem%poles) :: distance, inverse
      complex(wp), dimension(size(near)) :: apart
      type(joint_vectors_t) :: vectors
      logical :: done(size(near))
      real(wp) :: enough
      integer :: iteration, m, j

      call guess_roots(problem, near, offset)
      done = .false.
      do iteration = 1, iteration_cap
         do m = 1, size(near)
            if (done(m)) cycle
            call distances(problem%secular_t, near(m), offset(m), distance)
            j = minloc(size_of(distance), dim=1)
            if (j /= near(m)) then
               near(m) = j
               offset(m) = distance(j)
            end if
            s = problem%pole(near(m)) + offset(m)
            call inverses(distance, inverse)
            call vectors_at(problem, s, near(m), distance, vectors)
            repulsion = vectors%trace
            done(m) = vectors%mode > 0 .and. size_of(vectors%value) <= tiny(1.0_wp)
            if (done(m)) cycle
            if (vectors%mode > 0) repulsion = repulsion + vectors%slope/vectors%value
            do j = 1, problem%modes
               if (j /= vectors%mode) repulsion = repulsion + inverse(2*j - 1) + inverse(2*j)
            end do
            call root_distances(problem%secular_t, near, offset, m, apart)
            repulsion = repulsion - sum_of_inverses(apart)
            step = -1.0_wp/repulsion
            if (.not. size_of(step) <= huge(1.0_wp)) step = 1.0e-3_wp*offset(m)
            offset(m) = offset(m) + step
            enough = 1.0e-12_wp*size_of(offset(m))
            if (iteration > patient) enough = max(enough, 8.0_wp*epsilon(1.0_wp)*size_of(s))
            ! two that coalesce are known within the root of rounding
            if (iteration > most_patient) enough = coalescing*size_of(s)
            done(m) = size_of(step) <= enough .or. size_of(offset(m)) <= tiny(1.0_wp)
         end do
         if (all(done)) exit
      end do
      converged = all(done)
      if (converged) call make_real(problem, near, offset, converged)
   end subroutine find_joint_roots

   !> Real roots exactly real, the others in pairs.
   pure subroutine make_real(problem, near, offset, are_paired)
      type(joint_secular_t), intent(in) :: problem
      !> Roots, [roots]
      integer, intent(in) :: near(:)
      complex(wp), intent(inout) :: offset(:)
      logical, intent(out) :: are_paired

      complex(wp) :: s
      integer :: m

      do m = 1, size(near)
         s = problem%pole(near(m)) + offset(m)
         if (abs(aimag(problem%pole(near(m)))) > 0.0_wp) then
            if (abs(aimag(s)) <= 1.0e-12_wp*abs(s)) offset(m) = real(s, wp) - problem%pole(near(m))
         else if (abs(aimag(offset(m))) <= 1.0e-9_wp*abs(offset(m))) then
            offset(m) = real(offset(m), wp)
         end if
      end do
      are_paired = count(aimag(problem%pole(near) + offset) > 0.0_wp) == &
         count(aimag(problem%pole(near) + offset) < 0.0_wp)
      if (are_paired) return
      ! two that coalesce on the axis
      do m = 1, size(near)
         s = problem%pole(near(m)) + offset(m)
         if (abs(aimag(s)) <= coalescing*abs(s)) offset(m) = real(s, wp) - problem%pole(near(m))
      end do
      are_paired = count(aimag(problem%pole(near) + offset) > 0.0_wp) == &
         count(aimag(problem%pole(near) + offset) < 0.0_wp)
   end subroutine make_real

   !> Where to begin: the modes with all springs attached, each with its share of the damping.
   subroutine guess_roots(problem, near, offset)
      type(joint_secular_t), intent(in) :: problem
      !> [roots]
      integer, intent(out) :: near(:)
      complex(wp), intent(out) :: offset(:)

      complex(wp) :: s(size(near))
      real(wp), allocatable :: square(:), value(:, :), new(:), change(:, :), reaction(:)
      real(wp) :: damping, root, stiff, fastest
      integer :: j, k

      allocate (square, source=problem%square)
      allocate (value, source=problem%value)
      fastest = sqrt(maxval([0.0_wp, square]))
      do k = 1, size(problem%spring)
         stiff = problem%spring(k)%stiffness
         ! the branch is stiff for what is faster than it relaxes
         if (fastest > problem%spring(k)%relaxation_rate) stiff = stiff + problem%spring(k)%branch_stiffness
         call constrain(square, value(:, k), 1.0_wp/stiff, new, change, reaction)
         square = new
         value = matmul(transpose(change), value)
      end do
      do j = 1, problem%modes
         damping = 0.5_wp*problem%two_zeta*problem%square(j)
         do k = 1, size(problem%spring)
            associate (spring => problem%spring(k))
               damping = damping + 0.5_wp*spring%viscosity*value(j, k)**2
               if (spring%branch_stiffness > 0.0_wp) damping = damping + 0.5_wp*spring%branch_stiffness*value(j, k)**2 &
                  *spring%relaxation_rate/(spring%relaxation_rate**2 + square(j))
            end associate
         end do
         root = sqrt(abs(square(j) - damping**2))
         if (damping**2 < square(j)) then
            s(2*j - 1) = cmplx(-damping, root, wp)
            s(2*j) = conjg(s(2*j - 1))
         else
            root = damping + root
            s(2*j - 1) = -square(j)/root
            s(2*j) = -root
         end if
      end do
      do k = 1, size(problem%spring)
         if (problem%branch_pole(k) > 0) s(problem%branch_pole(k)) = 0.9_wp*problem%pole(problem%branch_pole(k))
      end do
      near = [(j, j=1, size(near))]
      offset = s - problem%pole
      do j = 1, size(s)
         if (problem%crowded(j)) then
            offset(j) = 0.05_wp*problem%relative(j)/problem%two_zeta
         else if (abs(offset(j)) < 1.0e-3_wp*abs(problem%pole(j))) then
            offset(j) = offset(j) + 1.0e-3_wp*abs(problem%pole(j))
         end if
         ! off the real axis, from where the iteration could not reach conjugate pairs
         if (.not. abs(aimag(problem%pole(j) + offset(j))) > 0.0_wp) then
            offset(j) = offset(j)*cmplx(1.0_wp, merge(0.3_wp, -0.3_wp, modulo(j, 2) == 0), wp)
         end if
      end do
   end subroutine guess_roots

   !> What belongs to an s, with the mode taken apart that has the nearest pole, or else moves the stops most.
   pure subroutine vectors_at(problem, s, near, distance, vectors)
      type(joint_secular_t), intent(in) :: problem
      complex(wp), intent(in) :: s
      !> The nearest pole
      integer, intent(in) :: near
      !> s - pole, [poles]
      complex(wp), intent(in) :: distance(:)
      type(joint_vectors_t), intent(out) :: vectors

      complex(wp), dimension(size(problem%spring), size(problem%spring)) :: h, h_slope, matrix, slope, solution
      complex(wp), dimension(size(problem%spring)) :: n, m, n_slope, m_slope, of_slope
      complex(wp) :: inverse
      real(wp) :: strength, strongest
      integer :: i, j, stops

      stops = size(problem%spring)
      vectors%mode = 0
      if (near <= 2*problem%modes) then
         vectors%mode = (near + 1)/2
      else
         strongest = 0.0_wp
         do i = 1, problem%modes
            strength = sum(problem%value(i, :)**2)/max(size_of(distance(2*i - 1)*distance(2*i)), tiny(1.0_wp))
            if (strength > strongest) vectors%mode = i
            strongest = max(strongest, strength)
         end do
      end if
      h = 0.0_wp
      h_slope = 0.0_wp
      do i = 1, problem%modes
         if (i == vectors%mode) cycle
         inverse = 1.0_wp/(distance(2*i - 1)*distance(2*i))
         do j = 1, stops
            h(:, j) = h(:, j) + problem%value(i, :)*(problem%value(i, j)*inverse)
            h_slope(:, j) = h_slope(:, j) - problem%value(i, :)*(problem%value(i, j)*inverse**2 &
               *(distance(2*i - 1) + distance(2*i)))
         end do
      end do
      call numerators(problem, s, distance, n, m, n_slope, m_slope)
      do j = 1, stops
         matrix(:, j) = m*h(:, j)
         slope(:, j) = m_slope*h(:, j) + m*h_slope(:, j)
         matrix(j, j) = matrix(j, j) + n(j)
         slope(j, j) = slope(j, j) + n_slope(j)
      end do
      solution = solve_small(matrix, slope)
      vectors%trace = sum([(solution(j, j), j=1, stops)])
      allocate (vectors%right(stops), vectors%left(stops))
      if (vectors%mode == 0) return
      associate (b => problem%value(vectors%mode, :), first => distance(2*vectors%mode - 1), &
         second => distance(2*vectors%mode))
         vectors%right = reshape(solve_small(matrix, reshape(m*b, [stops, 1])), [stops])
         vectors%left = reshape(solve_small(transpose(matrix), reshape(cmplx(b, 0.0_wp, wp), [stops, 1])), [stops])
         ! T_i is symmetric but for the factors M of its rows, which differ by far among soft and hard stops
         do j = 1, stops
            if (size_of(m(j)) > 1.0e-6_wp*(problem%spring(j)%stiffness*size_of(n(j)) &
               + (problem%spring(j)%branch_stiffness + problem%spring(j)%viscosity)*size_of(s))) then
               vectors%left(j) = vectors%right(j)/m(j)
            end if
         end do
         of_slope = matmul(slope, vectors%right)
         vectors%value = first*second + sum(b*vectors%right)
         vectors%slope = first + second + sum(vectors%left*(m_slope*b)) - sum(vectors%left*of_slope)
         vectors%condition = (size_of(first + second) + sum(size_of(vectors%left*(m_slope*b))) &
            + sum(size_of(vectors%left*of_slope)))/max(size_of(vectors%slope), tiny(1.0_wp))
      end associate
   end subroutine vectors_at

   !> N and M of each stop, and their derivatives.
   pure subroutine numerators(problem, s, distance, n, m, n_slope, m_slope)
      type(joint_secular_t), intent(in) :: problem
      complex(wp), intent(in) :: s
      !> s - pole, [poles]
      complex(wp), intent(in) :: distance(:)
      !> [stops]
      complex(wp), intent(out), dimension(:) :: n, m, n_slope, m_slope

      integer :: j

      do j = 1, size(problem%spring)
         associate (spring => problem%spring(j))
            if (problem%branch_pole(j) > 0) then
               n(j) = distance(problem%branch_pole(j))
               n_slope(j) = 1.0_wp
               m(j) = spring%stiffness*n(j) + spring%branch_stiffness*s
               m_slope(j) = spring%stiffness + spring%branch_stiffness
            else
               n(j) = 1.0_wp
               n_slope(j) = 0.0_wp
               m(j) = spring%stiffness + spring%viscosity*s
               m_slope(j) = spring%viscosity
            end if
         end associate
      end do
   end subroutine numerators

   !> Solve a few complex equations, by elimination with pivots from each column.
   pure function solve_small(matrix, right) result(solution)
      !> [size, size]
      complex(wp), intent(in) :: matrix(:, :)
      !> [size, number]
      complex(wp), intent(in) :: right(:, :)
      complex(wp) :: solution(size(right, 1), size(right, 2))

      complex(wp) :: a(size(matrix, 1), size(matrix, 1)), row(size(matrix, 1)), line(size(right, 2)), factor
      integer :: i, k, n, pivot

      n = size(matrix, 1)
      do i = 1, n
         factor = 1.0_wp/max(maxval(size_of(matrix(i, :))), tiny(1.0_wp))
         a(i, :) = factor*matrix(i, :)
         solution(i, :) = factor*right(i, :)
      end do
      do k = 1, n
         pivot = k - 1 + maxloc(size_of(a(k:, k)), dim=1)
         if (pivot /= k) then
            row = a(k, :)
            a(k, :) = a(pivot, :)
            a(pivot, :) = row
            line = solution(k, :)
            solution(k, :) = solution(pivot, :)
            solution(pivot, :) = line
         end if
         if (size_of(a(k, k)) <= tiny(1.0_wp)) a(k, k) = tiny(1.0_wp)
         do i = k + 1, n
            factor = a(i, k)/a(k, k)
            a(i, k + 1:) = a(i, k + 1:) - factor*a(k, k + 1:)
            solution(i, :) = solution(i, :) - factor*solution(k, :)
         end do
      end do
      do k = n, 1, -1
         solution(k, :) = solution(k, :)/a(k, k)
         do i = 1, k - 1
            solution(i, :) = solution(i, :) - a(i, k)*solution(k, :)
         end do
      end do
   end function solve_small

end module joint_secular
