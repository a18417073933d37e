!> Exponents of the motion of a beam with several closed compliant contacts: the roots of the equation in
!> `coupled_equation`, found simultaneously by the Ehrlich-Aberth iteration, and by Newton's method where a root is
!> much nearer to a pole than to all others (docs/theory.md, section 17).
module coupled_roots
   use compliant_stop, only: is_rigid_stop
   use constrained_modes, only: constrain
   use coupled_equation, only: coupled_equation_t
   use coupled_vectors, only: coupled_vectors_t, vectors_at
   use free_modes, only: max_rigid_square
   use kinds, only: wp
   use pole_offsets, only: distances, root_distances, abs1, sum_of_inverses
   implicit none (type, external)
   private
   public :: find_circle, find_coupled_roots

   !> Iterates of the roots.
   type :: search_t
      !> Whether each step of every root accounts for all other roots
      logical :: is_simultaneous = .true.
      !> Index of the nearest pole of each root, [roots]
      integer, allocatable :: near(:)
      !> Offset of each root from that pole, [roots]
      complex(wp), allocatable :: offset(:)
      !> Length of the last step of each root, `huge` before the first step, [roots]
      real(wp), allocatable :: last_step(:)
      !> Whether each root has converged, [roots]
      logical, allocatable :: done(:)
      !> Workspace: distances of one root from all poles, [poles]
      complex(wp), allocatable :: distance(:)
      !> Workspace: distances of one root from all other roots, [roots]
      complex(wp), allocatable :: root_distance(:)
      !> Workspace: the vectors at that root
      type(coupled_vectors_t) :: vectors
   end type search_t

   !> Relative accuracy that is required of nearly coalescing roots.
   real(wp), parameter :: coalescing = 1.0e-7_wp

   !> A root is isolated if its distance from the nearest pole is less than this fraction of that from all others.
   real(wp), parameter :: isolation = 0.05_wp

contains

   !> Find all roots, each as the nearest pole and the offset from it. Isolated roots, each of which is much nearer to
   !> one pole than to all others, are found by Newton's method, all others simultaneously. If two roots found so are
   !> equal, all roots are found simultaneously. Of each pair that starts as complex conjugates only one root is
   !> iterated, as long as it stays away from the real axis. A root without a conjugate partner may then converge to
   !> the same value as the other root of a pair; in that case all roots are iterated separately, first from the same
   !> initial values, then from others.
   subroutine find_coupled_roots(problem, near, offset, converged, evaluations)
      type(coupled_equation_t), intent(in) :: problem
      !> Index of the nearest pole of each root, [roots]
      integer, intent(out) :: near(:)
      !> Offset of each root from that pole, [roots]
      complex(wp), intent(out) :: offset(:)
      logical, intent(out) :: converged
      !> Number of evaluations of the equation
      integer, intent(out), optional :: evaluations

      integer :: count

      count = 0
      call iterate(problem, .false., .true., .false., near, offset, converged, count)
      if (converged) converged = are_different(problem, near, offset)
      if (.not. converged) call iterate(problem, .true., .true., .false., near, offset, converged, count)
      if (.not. converged) call iterate(problem, .true., .false., .false., near, offset, converged, count)
      if (.not. converged) call iterate(problem, .true., .false., .true., near, offset, converged, count)
      if (present(evaluations)) evaluations = count
   end subroutine find_coupled_roots

   !> Whether all roots differ from each other by much more than the error of the iteration.
   pure function are_different(problem, near, offset) result(answer)
      type(coupled_equation_t), intent(in) :: problem
      !> Index of the nearest pole of each root, [roots]
      integer, intent(in) :: near(:)
      !> Offset of each root from that pole, [roots]
      complex(wp), intent(in) :: offset(:)
      logical :: answer

      complex(wp) :: distance(size(near))
      integer :: m

      answer = .true.
      do m = 1, size(near)
         ! equal roots have the same nearest pole
         if (count(near == near(m)) == 1) cycle
         call root_distances(problem%secular_t, near, offset, m, distance)
         distance(m) = huge(1.0_wp)
         answer = answer .and. all(abs1(distance) > coalescing*abs1(offset) .or. near /= near(m))
      end do
   end function are_different

   !> The iteration of all roots.
   subroutine iterate(problem, is_simultaneous, in_pairs, combines_damping, near, offset, converged, evaluations)
      type(coupled_equation_t), intent(in) :: problem
      !> Whether to find isolated roots simultaneously with all others, too
      logical, intent(in) :: is_simultaneous
      !> Whether to iterate one root of each conjugate pair
      logical, intent(in) :: in_pairs
      !> Whether springs combine whole damping rates of modes: their two parts cancel for a light undamped body
      logical, intent(in) :: combines_damping
      !> Index of the nearest pole of each root, [roots]
      integer, intent(out) :: near(:)
      !> Offset of each root from that pole, [roots]
      complex(wp), intent(out) :: offset(:)
      logical, intent(out) :: converged
      !> Number of evaluations of the equation, to which those of this iteration are added
      integer, intent(inout) :: evaluations

      integer, parameter :: iteration_cap = 500
      type(search_t) :: search
      ! the next root is the conjugate of this root and is not iterated
      logical :: has_conjugate(size(near))
      ! this root is the conjugate of the root before it
      logical :: is_conjugate(size(near))
      complex(wp) :: pole
      integer :: iteration, m

      allocate (search%near(size(near)), search%offset(size(near)), search%root_distance(size(near)), &
         search%distance(problem%poles))
      search%is_simultaneous = is_simultaneous
      call guess_roots(problem, is_simultaneous, combines_damping, search%near, search%offset)
      allocate (search%done(size(near)), source=.false.)
      allocate (search%last_step(size(near)), source=huge(1.0_wp))
      has_conjugate = .false.
      ! the roots near the poles of the modes come first, two for each mode, then one for each branch
      do m = 1, size(near) - count(problem%branch_pole > 0) - 1, 2
         pole = problem%pole(search%near(m))
         has_conjugate(m) = in_pairs .and. abs(aimag(pole)) > 0.0_wp .and. stays_apart(pole + search%offset(m)) .and. &
            abs1(conjg(search%offset(m)) - search%offset(m + 1)) <= 0.0_wp
      end do
      is_conjugate = eoshift(has_conjugate, -1)
      do iteration = 1, iteration_cap
         do m = 1, size(near)
            if (search%done(m) .or. is_conjugate(m)) cycle
            evaluations = evaluations + 1
            call step_root(problem, m, iteration, search)
            if (.not. has_conjugate(m)) cycle
            has_conjugate(m) = stays_apart(problem%pole(search%near(m)) + search%offset(m))
            search%near(m + 1) = partner_of(problem, search%near(m))
            search%offset(m + 1) = conjg(search%offset(m))
            is_conjugate(m + 1) = has_conjugate(m)
            search%done(m:m + 1) = search%done(m) .and. has_conjugate(m)
         end do
         if (all(search%done)) exit
      end do
      converged = all(search%done)
      near = search%near
      offset = search%offset
      if (converged) call make_real(problem, near, offset, converged)

   contains

      !> Whether a root of the upper half-plane is far from the real axis, where the two roots of a pair may meet.
      pure logical function stays_apart(s) result(answer)
         complex(wp), intent(in) :: s

         answer = aimag(s) > 0.2_wp*abs(real(s, wp))
      end function stays_apart
   end subroutine iterate

   !> Index of the complex conjugate of a pole: the two poles of a mode are side by side.
   pure integer function partner_of(problem, pole) result(partner)
      type(coupled_equation_t), intent(in) :: problem
      !> Index of the pole
      integer, intent(in) :: pole

      partner = pole
      if (abs(aimag(problem%pole(pole))) > 0.0_wp) partner = pole + merge(1, -1, modulo(pole, 2) == 1)
   end function partner_of

   !> One step of the iteration for one root.
   subroutine step_root(problem, m, iteration, search)
      type(coupled_equation_t), intent(in) :: problem
      !> Index of the root
      integer, intent(in) :: m
      !> Number of the iteration
      integer, intent(in) :: iteration
      type(search_t), intent(inout) :: search

      ! number of iterations after which the tolerance of convergence is raised
      integer, parameter :: strict_iterations = 40
      ! number of iterations after which the tolerance becomes `coalescing`
      integer, parameter :: normal_iterations = 200
      complex(wp) :: log_derivative, step, s
      ! magnitude of s, or its distance from -1/(2 zeta) in the cluster, where that distance has all digits
      real(wp) :: scale
      real(wp) :: tolerance, length, magnitude, size_of_distance(size(search%distance))
      integer :: j
      logical :: is_alone

      associate (near => search%near, offset => search%offset, vectors => search%vectors, done => search%done(m), &
         last_step => search%last_step(m))
         call distances(problem%secular_t, near(m), offset(m), search%distance)
         size_of_distance = abs(real(search%distance, wp)) + abs(aimag(search%distance))
         j = minloc(size_of_distance, dim=1)
         if (j /= near(m)) then
            near(m) = j
            offset(m) = search%distance(j)
         end if
         s = problem%pole(near(m)) + offset(m)
         size_of_distance(j) = huge(1.0_wp)
         is_alone = .not. search%is_simultaneous .and. j <= 2*problem%modes .and. &
            abs1(offset(m)) < isolation*minval(size_of_distance)
         call vectors_at(problem, s, near(m), .not. is_alone, search%distance, vectors)
         done = vectors%mode > 0 .and. abs1(vectors%value) <= tiny(1.0_wp)
         if (done) return
         log_derivative = (0.0_wp, 0.0_wp)
         if (vectors%mode > 0) log_derivative = vectors%slope/vectors%value
         if (is_alone) then
            step = -1.0_wp/log_derivative
         else
            ! derivative of the logarithm of det (N + M H) prod D_i
            log_derivative = log_derivative + vectors%trace + vectors%pole_sum
            call root_distances(problem%secular_t, near, offset, m, search%root_distance)
            step = -1.0_wp/(log_derivative - sum_of_inverses(search%root_distance))
         end if
         ! leave a point at which the step is infinite or not a number
         if (.not. abs1(step) <= huge(1.0_wp)) step = 1.0e-3_wp*offset(m)
         offset(m) = offset(m) + step
         length = abs1(step)
         ! a step to the pole, to rounding, has left the offset without digits
         if (abs1(offset(m)) <= epsilon(1.0_wp)*length) offset(m) = epsilon(1.0_wp)*step
         magnitude = abs1(offset(m))
         scale = abs1(s)
         if (problem%is_clustered(near(m))) scale = abs1(problem%relative(near(m))/problem%two_zeta + offset(m))
         tolerance = 1.0e-12_wp*magnitude
         if (iteration > strict_iterations) tolerance = max(tolerance, 8.0_wp*epsilon(1.0_wp)*scale)
         ! coalescing roots are accurate to the square root of the rounding error only
         if (iteration > normal_iterations) tolerance = coalescing*scale
         done = length <= tolerance
         ! convergence is quadratic: the estimate of the next step is c step^2, with c = step/last_step^2
         if (last_step < huge(1.0_wp)) done = done .or. length*(length/last_step)**2 <= 1.0e-17_wp*magnitude
         ! a step is also short if another iterate is near, but then Newton's step is not
         done = done .and. abs1(log_derivative)*max(1.0e-3_wp*magnitude, tolerance) >= 1.0_wp
         done = done .or. magnitude <= tiny(1.0_wp)
         last_step = length
      end associate
   end subroutine step_root

   !> Set nearly real roots to exactly real values, and check that the other roots are complex conjugate pairs.
   pure subroutine make_real(problem, near, offset, are_paired)
      type(coupled_equation_t), intent(in) :: problem
      !> Index of the nearest pole of each root, [roots]
      integer, intent(in) :: near(:)
      !> Offset of each root from that pole, [roots]
      complex(wp), intent(inout) :: offset(:)
      !> Whether all roots that are not real are in conjugate pairs
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
      ! two roots that coalesce on the real axis
      do m = 1, size(near)
         s = problem%pole(near(m)) + offset(m)
         if (abs(aimag(s)) <= coalescing*abs(s)) offset(m) = real(s, wp) - problem%pole(near(m))
      end do
      are_paired = count(aimag(problem%pole(near) + offset) > 0.0_wp) == &
         count(aimag(problem%pole(near) + offset) < 0.0_wp)
   end subroutine make_real

   !> Find a circle around a root and those that nearly coalesce with it. The circle stays in the left half-plane, far
   !> from all other roots and poles; a circle that is not much larger than the group would need more points.
   pure subroutine find_circle(problem, s, root, is_inside, center, radius)
      type(coupled_equation_t), intent(in) :: problem
      !> Values s of the roots, [roots]
      complex(wp), intent(in) :: s(:)
      !> Index of the root
      integer, intent(in) :: root
      !> Whether the circle encloses each root, [roots]
      logical, intent(out) :: is_inside(:)
      complex(wp), intent(out) :: center
      !> Radius of the circle; 0: there is no such circle
      real(wp), intent(out) :: radius

      integer, parameter :: max_roots = 6
      real(wp) :: spread
      integer :: count, poles

      poles = max(2*problem%modes, maxval(problem%branch_pole))
      is_inside = .false.
      is_inside(root) = .true.
      center = s(root)
      do count = 2, min(max_roots, size(s))
         is_inside(minloc(abs(s - center), dim=1, mask=.not. is_inside)) = .true.
         center = sum(s, mask=is_inside)/real(count, wp)
         spread = maxval(abs(s - center), mask=is_inside)
         ! the circle also encloses the conjugate roots
         if (abs(aimag(center)) <= 2.0_wp*spread) center = real(center, wp)
         spread = maxval(abs(s - center), mask=is_inside)
         radius = 0.4_wp*min(abs(real(center, wp)), minval(abs(s - center), mask=.not. is_inside), &
            minval(abs(problem%pole(:poles) - center)))
         if (radius >= 2.5_wp*spread) return
      end do
      radius = 0.0_wp
   end subroutine find_circle

   !> Initial values of the roots: the frequencies of the modes with all springs attached, each with an estimate of its
   !> damping ratio, and for each branch a value near its relaxation rate.
   subroutine guess_roots(problem, is_simultaneous, combines_damping, near, offset)
      type(coupled_equation_t), intent(in) :: problem
      !> Whether isolated roots are found simultaneously with all others, too
      logical, intent(in) :: is_simultaneous
      !> Whether springs combine whole damping rates of modes: their two parts cancel for a light undamped body
      logical, intent(in) :: combines_damping
      !> Index of the nearest pole of each root, [roots]
      integer, intent(out) :: near(:)
      !> Offset of each root from that pole, [roots]
      complex(wp), intent(out) :: offset(:)

      ! the frequencies need not be more accurate than the neglect of damping allows
      real(wp), parameter :: start_tolerance = 1.0e-4_wp
      complex(wp) :: s(size(near))
      real(wp), allocatable :: square(:), value(:, :), rate(:), new_square(:), change(:, :), reaction(:)
      ! -Re s (`damping`) and Im s (`root`) of a complex root
      real(wp) :: damping, root
      ! highest frequency of the modes
      real(wp) :: fastest
      real(wp) :: stiffness, flexibility
      integer :: j, k, last

      allocate (square, source=problem%square)
      allocate (value, source=problem%value)
      allocate (rate, source=problem%mass_rate)
      if (combines_damping) rate = rate + problem%two_zeta*problem%square
      fastest = sqrt(maxval([0.0_wp, square]))
      do k = 1, size(problem%spring)
         stiffness = problem%spring(k)%stiffness
         ! the branch acts as a spring for motion faster than its relaxation
         if (fastest > problem%spring(k)%relaxation_rate) stiffness = stiffness + problem%spring(k)%branch_stiffness
         flexibility = 0.0_wp
         if (.not. is_rigid_stop(problem%spring(k))) flexibility = 1.0_wp/stiffness
         call constrain(square, value(:, k), flexibility, new_square, change, reaction, start_tolerance)
         square = new_square
         call combine(change, value, rate)
      end do
      do j = 1, size(square)
         damping = rate(j)
         if (.not. combines_damping) damping = damping + problem%two_zeta*problem%square(j)
         ! the rate of a body may be negative
         damping = max(0.5_wp*damping, 0.0_wp)
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
      near = [(j, j=1, size(near))]
      ! between the scales of these roots and of other motions the equation has no digits, so they start with theirs
      do j = 1, 2*size(square)
         if (square((j + 1)/2) <= max_rigid_square) near(j) = minloc(abs(problem%pole - s(j)), dim=1)
      end do
      last = 2*size(square)
      do k = 1, size(problem%spring)
         if (problem%branch_pole(k) == 0) cycle
         last = last + 1
         near(last) = problem%branch_pole(k)
         ! not the pole itself, where the equation is singular
         s(last) = 0.9_wp*problem%pole(near(last))
      end do
      offset = s - problem%pole(near)
      call leave_poles(problem, is_simultaneous, near, offset)
   end subroutine guess_roots

   !> Move initial values off the poles and, unless they belong to isolated roots, off the real axis.
   subroutine leave_poles(problem, is_simultaneous, near, offset)
      type(coupled_equation_t), intent(in) :: problem
      !> Whether isolated roots are found simultaneously with all others, too
      logical, intent(in) :: is_simultaneous
      !> Index of the nearest pole of each root, [roots]
      integer, intent(in) :: near(:)
      !> Offset of each root from that pole, [roots]
      complex(wp), intent(inout) :: offset(:)

      ! minimum offset of a start from its pole, over the magnitude of the pole
      real(wp), parameter :: min_offset = 1.0e-9_wp
      complex(wp) :: distance(problem%poles)
      integer :: j

      do j = 1, size(near)
         if (problem%is_clustered(near(j))) then
            ! poles in the cluster: start at a small fraction of their distance from -1/(2 zeta), unless the offset is
            ! smaller, but no rounding error
            associate (fraction => 0.05_wp*problem%relative(near(j))/problem%two_zeta)
               if (abs(offset(j)) > abs(fraction) .or. abs(offset(j)) < min_offset*abs(problem%pole(near(j)))) then
                  offset(j) = fraction
               end if
            end associate
         else if (abs(offset(j)) < min_offset*abs(problem%pole(near(j)))) then
            ! a start at the pole itself would be singular
            offset(j) = offset(j) + min_offset*abs(problem%pole(near(j)))
         end if
         if (.not. abs(aimag(problem%pole(near(j)) + offset(j))) > 0.0_wp) then
            if (.not. is_simultaneous) then
               ! an isolated root of a real pole is real
               call distances(problem%secular_t, near(j), offset(j), distance)
               distance(near(j)) = huge(1.0_wp)
               if (near(j) <= 2*problem%modes .and. abs1(offset(j)) < isolation*minval(abs1(distance))) cycle
            end if
            ! start off the real axis, because the iteration cannot reach complex conjugate pairs from real values
            offset(j) = offset(j)*cmplx(1.0_wp, merge(0.3_wp, -0.3_wp, modulo(j, 2) == 0), wp)
         end if
      end do
   end subroutine leave_poles

   !> Values and damping rates of combinations of the modes.
   pure subroutine combine(change, value, rate)
      !> The combinations, [modes, combinations]
      real(wp), contiguous, intent(in) :: change(:, :)
      real(wp), allocatable, intent(inout) :: value(:, :)
      real(wp), allocatable, intent(inout) :: rate(:)

      real(wp) :: new_value(size(change, 2), size(value, 2)), new_rate(size(change, 2))
      real(wp) :: total
      integer :: i, j, k

      do j = 1, size(change, 2)
         do k = 1, size(value, 2)
            total = 0.0_wp
            !$omp simd reduction(+:total)
            do i = 1, size(change, 1)
               total = total + change(i, j)*value(i, k)
            end do
            new_value(j, k) = total
         end do
         total = 0.0_wp
         !$omp simd reduction(+:total)
         do i = 1, size(change, 1)
            total = total + change(i, j)**2*rate(i)
         end do
         new_rate(j) = total
      end do
      value = new_value
      rate = new_rate
   end subroutine combine

end module coupled_roots
