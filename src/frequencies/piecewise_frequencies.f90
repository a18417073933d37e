!> Frequencies of a continuous beam of uniform segments, with masses, springs and supports at the joints of segments and
!> any support of the root, from the dynamic stiffness matrix (docs/theory.md, section 4).
!>
!> The Wittrick-Williams algorithm counts the roots below a given lambda, so no root is missed and coincident roots
!> count separately. The dynamic stiffness is computed in quadruple precision because of the cancellation for short
!> segments; the error of every root is at most 3e-16.
module piecewise_frequencies
   use beam_model, only: beam_model_t
   use beam_section, only: area, inertia
   use bessel_functions, only: pi_quad, qp
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: segments_of, piecewise_lambda

   !> A uniform segment: length in L, area in Abar, second moment of area in Ibar; E Ibar = rho Abar = L = 1.
   type :: uniform_segment_t
      real(wp) :: length = 0.0_wp
      real(wp) :: area = 1.0_wp
      real(wp) :: inertia = 1.0_wp
   end type uniform_segment_t

   !> A joint between segments, or an end of the beam: inertia (mass, rotary inertia), spring stiffness and constraint
   !> of [displacement, slope].
   type :: joint_t
      real(wp) :: inertia(2) = 0.0_wp
      real(wp) :: stiffness(2) = 0.0_wp
      logical :: is_constrained(2) = .false.
   end type joint_t

   !> A beam of uniform segments between joints.
   type :: piecewise_t
      type(uniform_segment_t), allocatable :: segments(:)
      !> Joints and ends, [0:segments]
      type(joint_t), allocatable :: joints(:)
   end type piecewise_t

contains

   !> The continuous beam of a model whose section is uniform between stations.
   pure type(piecewise_t) function segments_of(model) result(beam)
      type(beam_model_t), intent(in) :: model

      ! these arrays are large and threads have small stacks, so the arrays are allocated
      type(joint_t), allocatable :: joints(:)
      type(uniform_segment_t), allocatable :: segments(:)
      ! area and second moment of area of each element
      real(wp), allocatable :: section(:, :)
      real(wp) :: start
      integer :: i, count
      logical :: is_end

      associate (n => model%mesh%elements, position => model%mesh%position, tip => model%mesh%tip_distance)
         allocate (joints(0:n), segments(n))
         section = reshape([(area(model%section, 0.5_wp*(tip(i - 1) + tip(i))), inertia(model%section, &
            0.5_wp*(tip(i - 1) + tip(i))), i=1, n)], [2, n])
         joints(0)%stiffness = [model%root%translation_stiffness, model%root%rotation_stiffness]
         joints(0)%is_constrained = .not. joints(0)%stiffness > 0.0_wp
         if (model%root%is_pinned) joints(0)%is_constrained = [.true., .false.]
         joints(n)%inertia(1) = model%tip_mass_ratio
         do i = 1, size(model%point_masses)
            associate (mass => model%point_masses(i))
               joints(mass%node)%inertia = joints(mass%node)%inertia + [mass%mass, mass%rotary_inertia]
            end associate
         end do
         do i = 1, size(model%supports)
            associate (support => model%supports(i))
               call constrain(joints((support%dof + 1)/2), 2 - modulo(support%dof, 2), support%stiffness)
            end associate
         end do
         count = 0
         start = 0.0_wp
         do i = 1, n
            is_end = i == n
            if (.not. is_end) is_end = any(joints(i)%is_constrained) .or. any(abs([joints(i)%inertia, &
               joints(i)%stiffness, section(:, i + 1) - section(:, i)]) > 0.0_wp)
            if (.not. is_end) cycle
            count = count + 1
            segments(count) = uniform_segment_t(position(i) - start, section(1, i), section(2, i))
            joints(count) = joints(i)
            start = position(i)
         end do
      end associate
      allocate (beam%segments(count), beam%joints(0:count))
      beam%segments(:) = segments(:count)
      beam%joints(:) = joints(:count)
   end function segments_of

   !> Constrain a joint, or add a spring at a joint.
   pure subroutine constrain(joint, motion, stiffness)
      type(joint_t), intent(inout) :: joint
      !> 1: displacement, 2: slope
      integer, intent(in) :: motion
      !> Stiffness of the spring; 0: the motion is constrained
      real(wp), intent(in) :: stiffness

      joint%stiffness(motion) = joint%stiffness(motion) + stiffness
      if (.not. stiffness > 0.0_wp) joint%is_constrained(motion) = .true.
   end subroutine constrain

   !> The first lambda_i, ascending; omega_i = lambda_i^2 sqrt(E Ibar/(rho Abar L^4)). A rigid-body mode has lambda = 0.
   pure function piecewise_lambda(count, beam) result(lambda)
      !> Number of roots, >= 0
      integer, intent(in) :: count
      type(piecewise_t), intent(in) :: beam
      real(wp) :: lambda(count)

      ! lower bound of all roots except those of rigid-body modes
      real(qp), parameter :: min_lambda = 1.0e-5_qp
      real(qp), parameter :: tolerance = 1.0e-19_qp
      real(qp) :: lower, upper, middle
      integer :: i

      lower = min_lambda
      do i = 1, count
         lambda(i) = 0.0_wp
         if (roots_below(beam, min_lambda) >= i) cycle
         upper = max(2.0_qp*lower, 1.0_qp)
         do while (roots_below(beam, upper) < i)
            lower = upper
            upper = 2.0_qp*upper
         end do
         do while (upper - lower > tolerance*upper)
            middle = 0.5_qp*(lower + upper)
            if (roots_below(beam, middle) < i) then
               lower = middle
            else
               upper = middle
            end if
         end do
         lambda(i) = real(upper, wp)
      end do
   end function piecewise_lambda

   !> Number of roots below lambda: the roots of each segment with both ends clamped, plus the negative eigenvalues
   !> of the dynamic stiffness matrix, which is eliminated joint by joint from the root to the tip.
   pure integer function roots_below(beam, lambda) result(count)
      type(piecewise_t), intent(in) :: beam
      !> Bound lambda > 0
      real(qp), intent(in) :: lambda

      real(qp), parameter :: min_ratio = epsilon(1.0_qp)**2
      ! block of the matrix for a joint, after the elimination of all joints before
      real(qp) :: diagonal(2, 2)
      ! block between this joint and the next
      real(qp) :: coupling(2, 2)
      ! contribution of the segment between them to the block of the next joint
      real(qp) :: next(2, 2)
      ! diagonal^-1 coupling
      real(qp) :: block(2, 2)
      real(qp) :: determinant
      integer :: i, j, clamped_roots

      count = 0
      diagonal = 0.0_qp
      do i = 0, size(beam%segments)
         next = 0.0_qp
         coupling = 0.0_qp
         if (i < size(beam%segments)) then
            call add_segment(beam%segments(i + 1), lambda, diagonal, coupling, next, clamped_roots)
            count = count + clamped_roots
         end if
         associate (joint => beam%joints(i))
            diagonal(1, 1) = diagonal(1, 1) + real(joint%stiffness(1), qp) - lambda**4*real(joint%inertia(1), qp)
            diagonal(2, 2) = diagonal(2, 2) + real(joint%stiffness(2), qp) - lambda**4*real(joint%inertia(2), qp)
            ! rows and columns of constrained motions become those of the unit matrix
            do j = 1, 2
               if (.not. joint%is_constrained(j)) cycle
               diagonal(j, :) = 0.0_qp
               diagonal(:, j) = 0.0_qp
               diagonal(j, j) = 1.0_qp
               coupling(j, :) = 0.0_qp
            end do
         end associate
         determinant = diagonal(1, 1)*diagonal(2, 2) - diagonal(1, 2)**2
         ! one negative eigenvalue of the block, or two
         if (determinant < 0.0_qp) then
            count = count + 1
         else if (diagonal(1, 1) < 0.0_qp) then
            count = count + 2
         end if
         if (i == size(beam%segments)) exit
         ! a zero determinant means a root of the beam up to this joint; the count is the same for a small non-zero
         ! value
         determinant = sign(max(abs(determinant), min_ratio*sum(diagonal**2)), determinant)
         block(1, :) = (diagonal(2, 2)*coupling(1, :) - diagonal(1, 2)*coupling(2, :))/determinant
         block(2, :) = (diagonal(1, 1)*coupling(2, :) - diagonal(1, 2)*coupling(1, :))/determinant
         diagonal = next - matmul(transpose(coupling), block)
      end do
   end function roots_below

   !> Add the dynamic stiffness of a segment.
   pure subroutine add_segment(segment, lambda, near, coupling, far, clamped_roots)
      type(uniform_segment_t), intent(in) :: segment
      real(qp), intent(in) :: lambda
      !> Diagonal block at the end towards the root, to which the stiffness is added
      real(qp), intent(inout) :: near(2, 2)
      !> Coupling block between both ends
      real(qp), intent(out) :: coupling(2, 2)
      !> Diagonal block at the end towards the tip
      real(qp), intent(out) :: far(2, 2)
      !> Number of roots below lambda of the segment with both ends clamped
      integer, intent(out) :: clamped_roots

      real(qp) :: k, length, s(6), factor(0:2)

      length = real(segment%length, qp)
      k = lambda*length*sqrt(sqrt(real(segment%area, qp)/real(segment%inertia, qp)))
      call find_coefficients(k, s, clamped_roots)
      ! E I/l^3, E I/l^2, E I/l
      factor = real(segment%inertia, qp)/[length**3, length**2, length]
      near = near + reshape([factor(0)*s(1), factor(1)*s(2), factor(1)*s(2), factor(2)*s(5)], [2, 2])
      far = reshape([factor(0)*s(1), -factor(1)*s(2), -factor(1)*s(2), factor(2)*s(5)], [2, 2])
      coupling = reshape([-factor(0)*s(3), -factor(1)*s(4), factor(1)*s(4), factor(2)*s(6)], [2, 2])
   end subroutine add_segment

   !> Coefficients that replace 12, 6, 12, 6, 4 and 2 of the static stiffness matrix: k^3 (c S + s C)/D, k^2 s S/D, k^3
   !> (s + S)/D, k^2 (C - c)/D, k (s C - c S)/D and k (S - s)/D with D = 1 - c C, c = cos k, C = cosh k, s = sin k, S =
   !> sinh k.
   pure subroutine find_coefficients(k, s, clamped_roots)
      !> k = lambda l (A/I)^(1/4) of the segment, of length l
      real(qp), intent(in) :: k
      real(qp), intent(out) :: s(6)
      !> Number of roots of D below k
      integer, intent(out) :: clamped_roots

      real(qp), parameter :: small = 2.0_qp
      ! cos k
      real(qp) :: c
      ! sin k
      real(qp) :: sine
      ! denominator D
      real(qp) :: d
      ! exp(-k)
      real(qp) :: decay
      ! square of exp(-k)
      real(qp) :: square
      integer :: half_waves

      if (k < small) then
         clamped_roots = 0
         d = series(-4.0_qp, 4)
         s = [0.5_qp*series(-4.0_qp, 1), 0.5_qp*series(-4.0_qp, 2), 0.5_qp*series(1.0_qp, 1), &
            0.5_qp*series(1.0_qp, 2), series(-4.0_qp, 3), 0.5_qp*series(1.0_qp, 3)]/d
         return
      end if
      ! numerators and denominator are multiplied by 2 exp(-k)
      decay = exp(-k)
      square = decay**2
      c = cos(k)
      sine = sin(k)
      d = 2.0_qp*decay - c*(1.0_qp + square)
      s = [k**3*(c*(1.0_qp - square) + sine*(1.0_qp + square)), k**2*sine*(1.0_qp - square), &
         k**3*(2.0_qp*decay*sine + 1.0_qp - square), k**2*(1.0_qp + square - 2.0_qp*decay*c), &
         k*(sine*(1.0_qp + square) - c*(1.0_qp - square)), k*(1.0_qp - square - 2.0_qp*decay*sine)]/d
      ! D has one root between j pi and (j + 1) pi for each j >= 1; the sign of D shows whether k exceeds this root
      half_waves = int(k/pi_quad)
      clamped_roots = half_waves
      if (d > 0.0_qp .eqv. modulo(half_waves, 2) == 1) clamped_roots = half_waves - 1

   contains

      !> Sum of (g k^4)^n/(4 n + p)! over n >= 0, without the cancellation of the closed forms at small k
      pure function series(g, p) result(total)
         real(qp), intent(in) :: g
         integer, intent(in) :: p
         real(qp) :: total

         real(qp) :: term
         integer :: n

         term = 1.0_qp/gamma(real(p + 1, qp))
         total = term
         do n = 1, 14
            term = term*g*k**4/(real(4*n + p, qp)*real(4*n + p - 1, qp)*real(4*n + p - 2, qp)*real(4*n + p - 3, qp))
            total = total + term
         end do
      end function series

   end subroutine find_coefficients

end module piecewise_frequencies
