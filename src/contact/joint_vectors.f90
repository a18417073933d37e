!> The equation of a beam that presses on several stops, at any s (docs/theory.md, sections 17 and 18).
!>
!> With the modes b_i at the stops, D_i(s) = s^2 + W_i^2 (1 + 2 zeta s), H(s) = sum b_i b_i'/D_i and, stop by stop,
!> N = s + nu (1 where there is no branch) and M = N Z, Z the impedance (N = 0, M = 1: it holds), it is
!> det (N + M H) prod D_i = 0. One mode is always taken apart:
!> det (N + M H) D_i = det T_i (D_i + b_i' T_i^-1 M b_i), T_i without that mode, so that nothing cancels next to its
!> pole.
module joint_vectors
   use kinds, only: wp
   use pole_offsets, only: find_mode_poles, secular_t, size_of
   use small_equations, only: eliminate
   use yielding_stop, only: holds, impedance_t
   implicit none (type, external)
   private
   public :: joint_secular_t, make_joint_secular, joint_vectors_t, vectors_at, numerators

   !> `secular_t` has the poles, those of the branches last.
   type, extends(secular_t) :: joint_secular_t
      !> b_i at the stops, [modes, stops]
      real(wp), allocatable :: value(:, :)
      !> alpha of each mode, [modes]
      real(wp), allocatable :: mass_rate(:)
      !> The stops, [stops], and the pole of the branch of each; 0: it has none
      type(impedance_t), allocatable :: spring(:)
      integer, allocatable :: branch_pole(:)
      !> b_ij b_ik of each pair of stops j <= k, [modes, pairs]
      real(wp), allocatable :: product(:, :)
   end type joint_secular_t

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
      !> Sum of 1/distance over the poles of all modes but that one
      complex(wp) :: of_poles = 0.0_wp
      !> How much the sum for the slope cancels, >= 1
      real(wp) :: condition = 1.0_wp
      !> Room, kept from one s to the next: N, M and their derivatives, T_i and its derivative, what is solved, 1/D_i
      !> and its derivative
      complex(wp), allocatable, private :: n(:), m(:), n_slope(:), m_slope(:), of_slope(:)
      complex(wp), allocatable, private :: matrix(:, :), slopes(:, :), solution(:, :), elimination(:, :)
      real(wp), allocatable, private :: term(:, :)
   end type joint_vectors_t

contains

   !> The poles.
   subroutine make_joint_secular(square, value, zeta, mass_rate, spring, problem)
      !> W_i^2 of the modes that move a stop point, ascending, [modes]
      real(wp), intent(in) :: square(:)
      !> b_i, [modes, stops]
      real(wp), intent(in) :: value(:, :)
      real(wp), intent(in) :: zeta
      !> alpha, [modes]
      real(wp), intent(in) :: mass_rate(:)
      !> [stops]
      type(impedance_t), intent(in) :: spring(:)
      type(joint_secular_t), intent(out) :: problem

      integer :: j, k, pair

      problem%modes = size(square)
      problem%two_zeta = 2.0_wp*zeta
      problem%poles = 2*size(square) + count(spring%branch_stiffness > 0.0_wp)
      ! what holds takes a mode away
      problem%roots = problem%poles - 2*count(holds(spring))
      problem%spring = spring
      allocate (problem%square, source=square)
      allocate (problem%value, source=value)
      allocate (problem%mass_rate, source=mass_rate)
      allocate (problem%pole(problem%poles + 1), problem%relative(problem%poles + 1))
      allocate (problem%branch_pole(size(spring)), source=0)
      call find_mode_poles(square, zeta, problem%pole, problem%relative, mass_rate)
      problem%poles = 2*size(square)
      do j = 1, size(spring)
         if (spring(j)%branch_stiffness <= 0.0_wp) cycle
         problem%poles = problem%poles + 1
         problem%branch_pole(j) = problem%poles
         problem%pole(problem%poles) = -spring(j)%relaxation_rate
         problem%relative(problem%poles) = 1.0_wp - problem%two_zeta*spring(j)%relaxation_rate
      end do
      if (problem%poles > 2*size(square)) then
         ! no pole, but a branch that creeps has a root so near to 0 that only its distance from there has the digits
         problem%poles = problem%poles + 1
         problem%pole(problem%poles) = 0.0_wp
         problem%relative(problem%poles) = 1.0_wp
      end if
      allocate (problem%product(size(square), (size(spring)*(size(spring) + 1))/2))
      pair = 0
      do k = 1, size(spring)
         do j = 1, k
            pair = pair + 1
            problem%product(:, pair) = value(:, j)*value(:, k)
         end do
      end do
      problem%crowded = problem%two_zeta > 0.0_wp .and. abs(problem%relative) < 0.5_wp
   end subroutine make_joint_secular

   !> What belongs to an s, with the mode taken apart that has the nearest pole, or else moves the stops most: a mode
   !> that hardly moves them leaves a root of the others in T_i.
   pure subroutine vectors_at(problem, s, near, distance, vectors)
      type(joint_secular_t), intent(in) :: problem
      complex(wp), intent(in) :: s
      !> The nearest pole; 0: whatever it is
      integer, intent(in) :: near
      !> s - pole, [poles]
      complex(wp), contiguous, intent(in) :: distance(:)
      !> Its room is kept for the next call
      type(joint_vectors_t), intent(inout) :: vectors

      real(wp) :: strength, strongest
      integer :: i, stops

      stops = size(problem%spring)
      if (.not. allocated(vectors%right)) allocate (vectors%right(stops), vectors%left(stops), vectors%n(stops), &
         vectors%m(stops), vectors%n_slope(stops), vectors%m_slope(stops), vectors%of_slope(stops), &
         vectors%matrix(stops, stops), vectors%slopes(stops, stops), vectors%solution(stops, stops + 1), &
         vectors%elimination(stops, stops), vectors%term(problem%modes, 4))
      vectors%mode = 0
      if (near > 0 .and. near <= 2*problem%modes) then
         vectors%mode = (near + 1)/2
      else
         strongest = 0.0_wp
         do i = 1, problem%modes
            strength = sum(problem%value(i, :)**2)/max(size_of(distance(2*i - 1)*distance(2*i)), sqrt(tiny(1.0_wp)))
            if (strength > strongest) vectors%mode = i
            strongest = max(strongest, strength)
         end do
      end if
      call numerators(problem, s, distance, vectors%n, vectors%m, vectors%n_slope, vectors%m_slope)
      call add_modes(problem, distance, vectors)
      call take_apart(problem, s, distance, vectors)
   end subroutine vectors_at

   !> T_i = N + M H and its derivative, in H all modes but the one apart.
   pure subroutine add_modes(problem, distance, vectors)
      type(joint_secular_t), intent(in) :: problem
      complex(wp), contiguous, intent(in) :: distance(:)
      type(joint_vectors_t), intent(inout) :: vectors

      complex(wp) :: both, h, h_slope
      integer :: i, j, k, pair

      ! 1/D_i, and its derivative less the sign
      do i = 1, problem%modes
         ! one after the other: the square of D_i would overflow on strongly graded meshes
         both = inverse_of(distance(2*i - 1))*inverse_of(distance(2*i))
         vectors%term(i, 1) = real(both, wp)
         vectors%term(i, 2) = aimag(both)
         both = both*(distance(2*i - 1) + distance(2*i))
         vectors%term(i, 3) = real(both, wp)
         vectors%term(i, 4) = aimag(both)
      end do
      if (vectors%mode > 0) vectors%term(vectors%mode, :) = 0.0_wp
      vectors%of_poles = cmplx(sum(vectors%term(:, 3)), sum(vectors%term(:, 4)), wp)
      do i = 1, problem%modes
         both = cmplx(vectors%term(i, 1), vectors%term(i, 2), wp)*cmplx(vectors%term(i, 3), vectors%term(i, 4), wp)
         vectors%term(i, 3) = real(both, wp)
         vectors%term(i, 4) = aimag(both)
      end do
      pair = 0
      do k = 1, size(problem%spring)
         do j = 1, k
            pair = pair + 1
            call weigh_terms(problem%product(:, pair), vectors%term, h, h_slope)
            vectors%matrix(j, k) = vectors%m(j)*h
            vectors%slopes(j, k) = vectors%m_slope(j)*h - vectors%m(j)*h_slope
            vectors%matrix(k, j) = vectors%m(k)*h
            vectors%slopes(k, j) = vectors%m_slope(k)*h - vectors%m(k)*h_slope
         end do
         vectors%matrix(k, k) = vectors%matrix(k, k) + vectors%n(k)
         vectors%slopes(k, k) = vectors%slopes(k, k) + vectors%n_slope(k)
      end do
   end subroutine add_modes

   !> 1/z; that of the nearest pole, whose square may underflow, is not used.
   elemental function inverse_of(z) result(inverse)
      complex(wp), intent(in) :: z
      complex(wp) :: inverse

      inverse = conjg(z)*(1.0_wp/max(real(z, wp)**2 + aimag(z)**2, tiny(1.0_wp)))
   end function inverse_of

   !> Sums of a column over 1/D_i and over (1/D_i)' less the sign.
   pure subroutine weigh_terms(weight, term, h, h_slope)
      !> b_ij b_ik, [modes]
      real(wp), contiguous, intent(in) :: weight(:)
      !> [modes, 4]
      real(wp), contiguous, intent(in) :: term(:, :)
      complex(wp), intent(out) :: h
      complex(wp), intent(out) :: h_slope

      real(wp) :: a, b, c, d
      integer :: i

      a = 0.0_wp
      b = 0.0_wp
      c = 0.0_wp
      d = 0.0_wp
      !$omp simd reduction(+:a, b, c, d)
      do i = 1, size(weight)
         a = a + weight(i)*term(i, 1)
         b = b + weight(i)*term(i, 2)
         c = c + weight(i)*term(i, 3)
         d = d + weight(i)*term(i, 4)
      end do
      h = cmplx(a, b, wp)
      h_slope = cmplx(c, d, wp)
   end subroutine weigh_terms

   !> What T_i makes of the mode apart.
   pure subroutine take_apart(problem, s, distance, vectors)
      type(joint_secular_t), intent(in) :: problem
      complex(wp), intent(in) :: s
      complex(wp), contiguous, intent(in) :: distance(:)
      !> T_i and its derivative are there
      type(joint_vectors_t), intent(inout) :: vectors

      integer :: j, stops
      logical :: is_lost

      stops = size(problem%spring)
      associate (m => vectors%m, right => vectors%right, left => vectors%left, m_slope => vectors%m_slope, &
         solution => vectors%solution)
         vectors%elimination(:, :) = vectors%matrix
         solution(:, :stops) = vectors%slopes
         solution(:, stops + 1) = 0.0_wp
         if (vectors%mode > 0) solution(:, stops + 1) = m*problem%value(vectors%mode, :)
         call eliminate(vectors%elimination, solution)
         vectors%trace = 0.0_wp
         do j = 1, stops
            vectors%trace = vectors%trace + solution(j, j)
         end do
         if (vectors%mode == 0) return
         right(:) = solution(:, stops + 1)
         is_lost = .false.
         ! T_i is symmetric but for the factors M of its rows, which differ by far among soft and hard stops
         do j = 1, stops
            if (is_great(j)) then
               left(j) = right(j)/m(j)
            else
               is_lost = .true.
            end if
         end do
         if (is_lost) then
            vectors%elimination(:, :) = transpose(vectors%matrix)
            solution(:, 1) = problem%value(vectors%mode, :)
            call eliminate(vectors%elimination, solution(:, :1))
            do j = 1, stops
               if (.not. is_great(j)) left(j) = solution(j, 1)
            end do
         end if
         associate (b => problem%value(vectors%mode, :), first => distance(2*vectors%mode - 1), &
            second => distance(2*vectors%mode))
            vectors%of_slope(:) = matmul(vectors%slopes, right)
            vectors%value = first*second + sum(b*right)
            vectors%slope = first + second + sum(left*(m_slope*b)) - sum(left*vectors%of_slope)
            vectors%condition = (size_of(first + second) + sum(size_of(left*(m_slope*b))) &
               + sum(size_of(left*vectors%of_slope)))/max(size_of(vectors%slope), tiny(1.0_wp))
         end associate
      end associate

   contains

      !> Is the factor of a row far from cancelling?
      pure function is_great(j) result(answer)
         integer, intent(in) :: j
         logical :: answer

         associate (spring => problem%spring(j))
            answer = size_of(vectors%m(j)) > 1.0e-6_wp*(spring%stiffness*size_of(vectors%n(j)) &
               + (spring%branch_stiffness + spring%viscosity)*size_of(s))
         end associate
      end function is_great
   end subroutine take_apart

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
            if (holds(spring)) then
               n(j) = 0.0_wp
               n_slope(j) = 0.0_wp
               m(j) = 1.0_wp
               m_slope(j) = 0.0_wp
            else if (problem%branch_pole(j) > 0) then
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

end module joint_vectors
