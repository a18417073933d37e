!> Values of the equation in `coupled_equation` at any s, and the vectors that belong to them (docs/theory.md, sections
!> 17 and 18).
!>
!> One mode i is separated, if any mode moves the stops: det (N + M H) D_i = det T_i (D_i + b_i' T_i^-1 M b_i), with T_i
!> the matrix N + M H without that mode, so that nothing cancels next to its pole. All derivatives are with respect to
!> s.
!>
!> Terms of H that exceed all others by far would hide the rest: those of a free body in slow motion between beam and
!> floor. The coordinates x_k = b_k' P/D_k of such dominant modes stay unknowns beside the forces P: T_i is then the
!> matrix (N + M H, M B; -B', D) with b_k in the columns of B, D_k in the diagonal matrix D, and the other modes in H.
module coupled_vectors
   use coupled_equation, only: coupled_equation_t, even, stop_fractions
   use damped_oscillators, only: lanes
   use kinds, only: wp
   use panel_products, only: multiply_panel
   use pole_offsets, only: abs1, strengths
   use small_equations, only: eliminate_bordered
   implicit none (type, external)
   private
   public :: coupled_vectors_t, vectors_at, vectors_at_root

   !> Value of the equation at one s, and its vectors.
   type :: coupled_vectors_t
      !> The separated mode; 0: there is none
      integer :: mode = 0
      !> Indices of the dominant modes, [dominant]
      integer, allocatable :: dominant(:)
      !> x_k of the dominant modes for the forces `right`, [dominant]
      complex(wp), allocatable :: coordinate(:)
      !> T_i^-1 M b_i, [stops]
      complex(wp), allocatable :: right(:)
      !> Product of b_i and the inverse of the transpose of T_i, [stops]
      complex(wp), allocatable :: left(:)
      !> D_i + b_i' T_i^-1 M b_i
      complex(wp) :: value = 0.0_wp
      !> Derivative of `value`
      complex(wp) :: slope = 0.0_wp
      !> Derivative of log det T_i, if requested
      complex(wp) :: trace = 0.0_wp
      !> Sum of 1/(s - pole) over the poles of all modes except the separated mode and the dominant modes
      complex(wp) :: pole_sum = 0.0_wp
      !> Condition number of the sum for the slope, >= 1; large if two roots nearly coalesce
      real(wp) :: condition = 1.0_wp
      !> Workspace, allocated once: the coefficients N and M of each stop in the coupled equation, [stops]
      complex(wp), allocatable, private :: n(:), m(:)
      !> Derivatives of N and M, [stops]
      complex(wp), allocatable, private :: n_slope(:), m_slope(:)
      !> Summands of the derivative of b_i' T_i^-1 M b_i by T_i, [2 stops]; of this dimension and the next ones, the
      !> first [stops + dominant] entries are used
      complex(wp), allocatable, private :: slope_times_right(:)
      !> T_i, [2 stops, 2 stops]
      complex(wp), allocatable, private :: matrix(:, :)
      !> Derivative of T_i with respect to s, [2 stops, 2 stops]
      complex(wp), allocatable, private :: slopes(:, :)
      !> Right-hand sides of the elimination, then its solutions, [2 stops, 2 stops + 1]
      complex(wp), allocatable, private :: solution(:, :)
      !> Copy of T_i for the elimination, [2 stops, 2 stops]
      complex(wp), allocatable, private :: elimination(:, :)
      !> Real and imaginary part of 1/D_i, and of minus its derivative, zero for the separated mode and the dominant
      !> ones, [even modes, 4]
      real(wp), allocatable :: term(:, :)
   end type coupled_vectors_t

contains

   !> Evaluate the equation at one s. The separated mode is that with the nearest pole or, if none is given, that which
   !> moves the stops most: a separated mode that hardly moves the stops would leave a root of the other modes in T_i.
   pure subroutine vectors_at(problem, s, near, needs_trace, distance, vectors)
      type(coupled_equation_t), intent(in) :: problem
      complex(wp), intent(in) :: s
      !> Index of the nearest pole; 0: unknown
      integer, intent(in) :: near
      !> Whether the trace is requested
      logical, intent(in) :: needs_trace
      !> s - pole, [poles]
      complex(wp), contiguous, intent(in) :: distance(:)
      !> Result; its workspace is reused in the next call
      type(coupled_vectors_t), intent(inout) :: vectors

      real(wp) :: strength(problem%modes)
      integer :: stops

      stops = size(problem%spring)
      if (.not. allocated(vectors%right)) allocate (vectors%right(stops), vectors%left(stops), vectors%n(stops), &
         vectors%m(stops), vectors%n_slope(stops), vectors%m_slope(stops), vectors%slope_times_right(2*stops), &
         vectors%matrix(2*stops, 2*stops), vectors%slopes(2*stops, 2*stops), &
         vectors%solution(2*stops, 2*stops + 1), vectors%elimination(2*stops, 2*stops), &
         vectors%term(even(problem%modes), 4))
      vectors%term(problem%modes:, :) = 0.0_wp
      vectors%mode = 0
      if (near > 0 .and. near <= 2*problem%modes) then
         vectors%mode = (near + 1)/2
      else
         strength = strengths(problem%squared_value, distance)
         if (any(strength > 0.0_wp)) vectors%mode = maxloc(strength, dim=1)
      end if
      call stop_fractions(problem, s, distance, vectors%n, vectors%m, vectors%n_slope, vectors%m_slope)
      call add_modes(problem, distance, vectors)
      call add_dominant(problem, distance, vectors)
      call separate_mode(problem, s, needs_trace, distance, vectors)
   end subroutine vectors_at

   !> Evaluate the equation at a root. The separated mode must take part in the motion of this root: a symmetric mode
   !> does not take part in an antisymmetric motion, which is then a root of T_i, too.
   pure subroutine vectors_at_root(problem, s, distance, vectors)
      type(coupled_equation_t), intent(in) :: problem
      !> The root
      complex(wp), intent(in) :: s
      !> s - pole, [poles]
      complex(wp), contiguous, intent(in) :: distance(:)
      !> Result; its workspace is reused in the next call
      type(coupled_vectors_t), intent(inout) :: vectors

      ! at a root, a mode that takes part leaves a small fraction of the summands of `value`, another mode a larger one
      real(wp), parameter :: small = 1.0e-9_wp
      ! limit of the summands over the scale of `value`; if T_i is nearly singular, large summands cancel and look like
      ! a root
      real(wp), parameter :: many_summands = 1.0e3_wp
      real(wp) :: strength(problem%modes), min_residual
      integer :: best, trial

      call vectors_at(problem, s, 0, .false., distance, vectors)
      best = vectors%mode
      if (best == 0 .or. size(problem%spring) == 1) return
      min_residual = residual(.true.)
      if (min_residual <= small) return
      strength = strengths(problem%squared_value, distance)
      ! at roots close to the pole of a branch, all modes of one symmetry can precede those of the other
      do trial = 2, problem%modes
         strength(vectors%mode) = 0.0_wp
         if (.not. any(strength > 0.0_wp)) exit
         ! the nearest pole given is one of the two of the mode to be separated
         call vectors_at(problem, s, 2*maxloc(strength, dim=1), .false., distance, vectors)
         associate (new => residual(.false.))
            if (new <= small) return
            if (new < min_residual) best = vectors%mode
            min_residual = min(min_residual, new)
         end associate
      end do
      call vectors_at(problem, s, 2*best, .false., distance, vectors)

   contains

      !> Magnitude of `value` over the sum of the magnitudes of its summands; if requested, over |s|^2 if that is
      !> greater, or over |s| times the distance of the next mode, which may be the one that takes part.
      pure real(wp) function residual(is_lenient)
         logical, intent(in) :: is_lenient

         real(wp) :: other(2*problem%modes)

         associate (summands => sum(abs1(problem%value(vectors%mode, :)*vectors%right)), &
            remainder => abs1(distance(2*vectors%mode - 1)*distance(2*vectors%mode)))
            other = abs1(distance(:size(other)))
            other(2*vectors%mode - 1:2*vectors%mode) = abs1(s)
            associate (scale => abs1(s)*minval(other))
               residual = abs1(vectors%value)/max(remainder + summands, merge(scale, 0.0_wp, is_lenient), tiny(1.0_wp))
               residual = max(residual, small/many_summands*(summands/max(remainder, scale, tiny(1.0_wp))))
            end associate
         end associate
      end function residual
   end subroutine vectors_at_root

   !> T_i = N + M H and its derivative, with all modes except the separated mode in H.
   pure subroutine add_modes(problem, distance, vectors)
      type(coupled_equation_t), intent(in) :: problem
      complex(wp), contiguous, intent(in) :: distance(:)
      type(coupled_vectors_t), intent(inout) :: vectors

      ! entries of H of some pairs of stops and minus their derivatives, real and imaginary parts
      real(wp) :: sums(lanes, 4)
      ! `h_slope` is minus the derivative of the entry h of H
      complex(wp) :: h, h_slope
      ! real and imaginary parts of the sum of both distances of a mode, of their inverses, and of 1/D_i
      real(wp) :: a, b, first, first_imag, second, second_imag, total, total_imag, x, y
      integer :: i, j, k, lane, pair

      ! columns 1, 2: 1/D_i; columns 3, 4: D_i'/D_i, which is the sum of 1/(s - pole) over the two poles of mode i
      !$omp simd private(a, b, first, first_imag, second, second_imag, total, total_imag, x, y)
      do i = 1, problem%modes
         ! multiply two inverses, because the square of D_i would overflow on strongly graded meshes; the limit avoids
         ! division by zero at the nearest pole, whose inverse is not used
         a = real(distance(2*i - 1), wp)
         b = aimag(distance(2*i - 1))
         total = 1.0_wp/max(a**2 + b**2, tiny(1.0_wp))
         first = a*total
         first_imag = -b*total
         x = real(distance(2*i), wp)
         y = aimag(distance(2*i))
         total = 1.0_wp/max(x**2 + y**2, tiny(1.0_wp))
         second = x*total
         second_imag = -y*total
         total = a + x
         total_imag = b + y
         x = first*second - first_imag*second_imag
         y = first*second_imag + first_imag*second
         vectors%term(i, 1) = x
         vectors%term(i, 2) = y
         vectors%term(i, 3) = x*total - y*total_imag
         vectors%term(i, 4) = x*total_imag + y*total
      end do
      if (vectors%mode > 0) vectors%term(vectors%mode, :) = 0.0_wp
      call find_dominant(problem, vectors)
      vectors%term(vectors%dominant, :) = 0.0_wp
      total = 0.0_wp
      total_imag = 0.0_wp
      ! columns 3, 4 become D_i'/D_i^2, which is minus the derivative of 1/D_i
      !$omp simd private(a, b) reduction(+:total, total_imag)
      do i = 1, problem%modes
         a = vectors%term(i, 3)
         b = vectors%term(i, 4)
         total = total + a
         total_imag = total_imag + b
         vectors%term(i, 3) = vectors%term(i, 1)*a - vectors%term(i, 2)*b
         vectors%term(i, 4) = vectors%term(i, 1)*b + vectors%term(i, 2)*a
      end do
      vectors%pole_sum = cmplx(total, total_imag, wp)
      pair = 0
      do k = 1, size(problem%spring)
         do j = 1, k
            lane = mod(pair, lanes) + 1
            if (lane == 1) call multiply_panel(size(vectors%term, 1), problem%product(:, :, pair/lanes + 1), &
               vectors%term(:, 1), vectors%term(:, 2), vectors%term(:, 3), vectors%term(:, 4), sums)
            pair = pair + 1
            h = cmplx(sums(lane, 1), sums(lane, 2), wp)
            h_slope = cmplx(sums(lane, 3), sums(lane, 4), wp)
            vectors%matrix(j, k) = vectors%m(j)*h
            vectors%slopes(j, k) = vectors%m_slope(j)*h - vectors%m(j)*h_slope
            vectors%matrix(k, j) = vectors%m(k)*h
            vectors%slopes(k, j) = vectors%m_slope(k)*h - vectors%m(k)*h_slope
         end do
         vectors%matrix(k, k) = vectors%matrix(k, k) + vectors%n(k)
         vectors%slopes(k, k) = vectors%slopes(k, k) + vectors%n_slope(k)
      end do
   end subroutine add_modes

   !> Modes whose terms of H exceed those of all other modes by far; as many as there are stops at most, none with one
   !> stop.
   pure subroutine find_dominant(problem, vectors)
      type(coupled_equation_t), intent(in) :: problem
      !> Contains 1/D_i, zero for the separated mode
      type(coupled_vectors_t), intent(inout) :: vectors

      ! terms of the dominant modes over the sum of all others
      real(wp), parameter :: much = 1.0e3_wp
      real(wp) :: highest, strength(problem%modes)
      integer :: first(size(problem%spring)), found, i

      found = 0
      if (size(problem%spring) > 1) then
         strength = problem%squared_value*(abs(vectors%term(:problem%modes, 1)) + abs(vectors%term(:problem%modes, 2)))
         ! in most cases more modes than there are stops are within this factor of the strongest
         if (count(much*strength > maxval(strength)) <= size(first)) then
            do i = 1, min(size(first), problem%modes)
               first(i) = maxloc(strength, dim=1)
               highest = strength(first(i))
               strength(first(i)) = 0.0_wp
               if (highest > much*sum(strength)) found = i
            end do
         end if
      end if
      vectors%dominant = first(:found)
   end subroutine find_dominant

   !> Rows and columns of the dominant modes in T_i and its derivative.
   pure subroutine add_dominant(problem, distance, vectors)
      type(coupled_equation_t), intent(in) :: problem
      complex(wp), contiguous, intent(in) :: distance(:)
      !> Contains T_i of the stops
      type(coupled_vectors_t), intent(inout) :: vectors

      integer :: j, k, n, stops

      stops = size(problem%spring)
      n = stops + size(vectors%dominant)
      vectors%matrix(stops + 1:n, stops + 1:n) = 0.0_wp
      vectors%slopes(stops + 1:n, :n) = 0.0_wp
      do j = stops + 1, n
         k = vectors%dominant(j - stops)
         vectors%matrix(:stops, j) = vectors%m*problem%value(k, :)
         vectors%matrix(j, :stops) = -problem%value(k, :)
         vectors%matrix(j, j) = distance(2*k - 1)*distance(2*k)
         vectors%slopes(:stops, j) = vectors%m_slope*problem%value(k, :)
         vectors%slopes(j, j) = distance(2*k - 1) + distance(2*k)
      end do
   end subroutine add_dominant

   !> Solve with T_i for vectors, value and slope of the separated mode, if there is one, and for the requested trace.
   pure subroutine separate_mode(problem, s, needs_trace, distance, vectors)
      type(coupled_equation_t), intent(in) :: problem
      complex(wp), intent(in) :: s
      logical, intent(in) :: needs_trace
      complex(wp), contiguous, intent(in) :: distance(:)
      !> Contains T_i and its derivative
      type(coupled_vectors_t), intent(inout) :: vectors

      ! number of right-hand sides for the trace
      integer :: columns
      integer :: j, n, stops
      logical :: needs_transpose

      stops = size(problem%spring)
      n = stops + size(vectors%dominant)
      columns = merge(n, 0, needs_trace)
      associate (m => vectors%m, right => vectors%right, left => vectors%left, m_slope => vectors%m_slope, &
         solution => vectors%solution)
         vectors%elimination(:n, :n) = vectors%matrix(:n, :n)
         solution(:n, :columns) = vectors%slopes(:n, :columns)
         solution(:n, columns + 1) = 0.0_wp
         if (vectors%mode > 0) solution(:stops, columns + 1) = m*problem%value(vectors%mode, :)
         call eliminate_bordered(vectors%elimination(:n, :n), solution(:n, :columns + 1), stops)
         vectors%trace = (0.0_wp, 0.0_wp)
         do j = 1, columns
            vectors%trace = vectors%trace + solution(j, j)
         end do
         if (vectors%mode == 0) return
         right(:) = solution(:stops, columns + 1)
         vectors%coordinate = solution(stops + 1:n, columns + 1)
         vectors%slope_times_right(:n) = matmul(vectors%slopes(:n, :n), solution(:n, columns + 1))
         ! the solution with the transpose has the coordinates with the opposite signs
         vectors%slope_times_right(stops + 1:n) = -vectors%coordinate*vectors%slope_times_right(stops + 1:n)
         needs_transpose = .false.
         ! T_i is M times a symmetric matrix, so `left` is `right`/M. The transpose serves where M has lost digits by
         ! cancellation.
         do j = 1, stops
            if (is_accurate(j)) then
               left(j) = right(j)/m(j)
            else
               needs_transpose = .true.
            end if
         end do
         if (needs_transpose) then
            vectors%elimination(:n, :n) = transpose(vectors%matrix(:n, :n))
            solution(:n, 1) = 0.0_wp
            solution(:stops, 1) = problem%value(vectors%mode, :)
            call eliminate_bordered(vectors%elimination(:n, :n), solution(:n, :1), stops)
            do j = 1, stops
               if (.not. is_accurate(j)) left(j) = solution(j, 1)
            end do
         end if
         associate (b => problem%value(vectors%mode, :), first => distance(2*vectors%mode - 1), &
            second => distance(2*vectors%mode))
            vectors%slope_times_right(:stops) = left*vectors%slope_times_right(:stops)
            vectors%value = first*second + sum(b*right)
            vectors%slope = first + second + sum(left*(m_slope*b)) - sum(vectors%slope_times_right(:n))
            vectors%condition = (abs1(first + second) + sum(abs1(left*(m_slope*b))) &
               + sum(abs1(vectors%slope_times_right(:n))))/max(abs1(vectors%slope), sqrt(tiny(1.0_wp)))
         end associate
      end associate

   contains

      !> Whether the factor M of stop j loses less than six digits by cancellation of its terms.
      pure logical function is_accurate(j) result(answer)
         integer, intent(in) :: j

         associate (spring => problem%spring(j))
            answer = abs1(vectors%m(j)) > 1.0e-6_wp*(spring%stiffness*abs1(vectors%n(j)) &
               + (spring%branch_stiffness + spring%viscosity)*abs1(s))
         end associate
      end function is_accurate
   end subroutine separate_mode

end module coupled_vectors
