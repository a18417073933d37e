!> Frequencies of the continuous beam that is uniform piece by piece, with masses, springs and supports where pieces
!> meet and any root, from its dynamic stiffness (docs/theory.md, section 4).
!>
!> How many roots lie below a lambda is counted, after Wittrick and Williams: no root is missed, and two that coincide
!> are two. In quadruple precision, as the stiffness of short pieces cancels: every root is right to 3e-16.
module piecewise_frequencies
   use beam_model, only: beam_model_t
   use beam_section, only: area, inertia
   use bessel_functions, only: pi_quad, qp
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: pieces_of, piecewise_lambda

   !> A piece, E Ibar = rho Abar = L = 1.
   type :: load_segment_t
      real(wp) :: length = 0.0_wp
      real(wp) :: area = 1.0_wp
      real(wp) :: inertia = 1.0_wp
   end type load_segment_t

   !> What is where pieces meet, and at the ends: of displacement and slope.
   type :: joint_t
      real(wp) :: inertia(2) = 0.0_wp
      real(wp) :: stiffness(2) = 0.0_wp
      logical :: is_constrained(2) = .false.
   end type joint_t

   type :: piecewise_t
      type(load_segment_t), allocatable :: pieces(:)
      !> [0:pieces]
      type(joint_t), allocatable :: joints(:)
   end type piecewise_t

contains

   !> The continuous beam of a model whose section is the same between stations.
   pure function pieces_of(model) result(beam)
      type(beam_model_t), intent(in) :: model
      type(piecewise_t) :: beam

      ! large, and threads have small stacks
      type(joint_t), allocatable :: joints(:)
      type(load_segment_t), allocatable :: pieces(:)
      real(wp) :: start
      integer :: i, count
      logical :: is_end

      associate (n => model%mesh%elements, position => model%mesh%position, tip => model%mesh%tip_distance)
         allocate (joints(0:n), pieces(n))
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
               call hold(joints((support%dof + 1)/2), 2 - modulo(support%dof, 2), support%stiffness)
            end associate
         end do
         count = 0
         start = 0.0_wp
         do i = 1, n
            is_end = i == n
            if (.not. is_end) is_end = any(joints(i)%is_constrained) .or. any(abs([joints(i)%inertia, &
               joints(i)%stiffness]) &
               > 0.0_wp) .or. section_differs(model, 0.5_wp*(tip(i - 1) + tip(i)), 0.5_wp*(tip(i) + tip(i + 1)))
            if (.not. is_end) cycle
            count = count + 1
            pieces(count) = load_segment_t(position(i) - start, area(model%section, 0.5_wp*(tip(i - 1) + tip(i))), &
               inertia(model%section, 0.5_wp*(tip(i - 1) + tip(i))))
            joints(count) = joints(i)
            start = position(i)
         end do
      end associate
      allocate (beam%pieces(count), beam%joints(0:count))
      beam%pieces(:) = pieces(:count)
      beam%joints(:) = joints(:count)
   end function pieces_of

   !> Hold a joint, or put a spring there.
   pure subroutine hold(joint, motion, stiffness)
      type(joint_t), intent(inout) :: joint
      !> 1: displacement, 2: slope
      integer, intent(in) :: motion
      !> 0: it is held
      real(wp), intent(in) :: stiffness

      joint%stiffness(motion) = joint%stiffness(motion) + stiffness
      if (.not. stiffness > 0.0_wp) joint%is_constrained(motion) = .true.
   end subroutine hold

   !> Is the section another one?
   pure function section_differs(model, one, other) result(answer)
      type(beam_model_t), intent(in) :: model
      !> Distances to the tip
      real(wp), intent(in) :: one
      real(wp), intent(in) :: other
      logical :: answer

      answer = abs(area(model%section, one) - area(model%section, other)) > 0.0_wp .or. &
         abs(inertia(model%section, one) - inertia(model%section, other)) > 0.0_wp
   end function section_differs

   !> The first lambda_i, ascending; omega_i = lambda_i^2 sqrt(E Ibar/(rho Abar L^4)). A motion without strain has 0.
   pure function piecewise_lambda(count, beam) result(lambda)
      !> Number of roots, >= 0
      integer, intent(in) :: count
      type(piecewise_t), intent(in) :: beam
      real(wp) :: lambda(count)

      !> Below all roots but those of motions without strain
      real(qp), parameter :: least = 1.0e-5_qp
      real(qp), parameter :: tolerance = 1.0e-19_qp
      real(qp) :: lower, upper, middle
      integer :: i

      lower = least
      do i = 1, count
         lambda(i) = 0.0_wp
         if (roots_below(beam, least) >= i) cycle
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

   !> How many roots lie below: of each piece held at both ends, and negative pivots of the dynamic stiffness.
   pure function roots_below(beam, lambda) result(count)
      type(piecewise_t), intent(in) :: beam
      !> > 0
      real(qp), intent(in) :: lambda
      integer :: count

      real(qp), parameter :: least = epsilon(1.0_qp)**2
      real(qp) :: block(2, 2), coupling(2, 2), diagonal(2, 2), next(2, 2), determinant
      integer :: i, supported

      count = 0
      diagonal = 0.0_qp
      do i = 0, size(beam%pieces)
         next = 0.0_qp
         coupling = 0.0_qp
         if (i < size(beam%pieces)) then
            call add_piece(beam%pieces(i + 1), lambda, diagonal, coupling, next, supported)
            count = count + supported
         end if
         associate (joint => beam%joints(i))
            diagonal(1, 1) = diagonal(1, 1) + real(joint%stiffness(1), qp) - lambda**4*real(joint%inertia(1), qp)
            diagonal(2, 2) = diagonal(2, 2) + real(joint%stiffness(2), qp) - lambda**4*real(joint%inertia(2), qp)
            call leave_out(joint%is_constrained, diagonal, coupling)
         end associate
         determinant = diagonal(1, 1)*diagonal(2, 2) - diagonal(1, 2)**2
         if (determinant < 0.0_qp) then
            count = count + 1
         else if (diagonal(1, 1) < 0.0_qp) then
            count = count + 2
         end if
         if (i == size(beam%pieces)) exit
         ! a root of what lies before the joint: next to it the count is the same
         determinant = sign(max(abs(determinant), least*sum(diagonal**2)), determinant)
         block(1, :) = (diagonal(2, 2)*coupling(1, :) - diagonal(1, 2)*coupling(2, :))/determinant
         block(2, :) = (diagonal(1, 1)*coupling(2, :) - diagonal(1, 2)*coupling(1, :))/determinant
         diagonal = next - matmul(transpose(coupling), block)
      end do
   end function roots_below

   !> Of what is held only a one stays on the diagonal.
   pure subroutine leave_out(is_constrained, diagonal, coupling)
      logical, intent(in) :: is_constrained(2)
      !> Of the joint, and with the next
      real(qp), intent(inout) :: diagonal(2, 2)
      real(qp), intent(inout) :: coupling(2, 2)

      integer :: i

      do i = 1, 2
         if (.not. is_constrained(i)) cycle
         diagonal(i, :) = 0.0_qp
         diagonal(:, i) = 0.0_qp
         diagonal(i, i) = 1.0_qp
         coupling(i, :) = 0.0_qp
      end do
   end subroutine leave_out

   !> The dynamic stiffness of a piece: what it adds at its ends, and between them.
   pure subroutine add_piece(piece, lambda, near, coupling, far, supported)
      type(load_segment_t), intent(in) :: piece
      real(qp), intent(in) :: lambda
      !> At the end towards the root
      real(qp), intent(inout) :: near(2, 2)
      !> Between both ends, and at the other
      real(qp), intent(out) :: coupling(2, 2)
      real(qp), intent(out) :: far(2, 2)
      !> Roots below of the piece held at both ends
      integer, intent(out) :: supported

      real(qp) :: k, length, s(6), stiff(0:2)

      length = real(piece%length, qp)
      k = lambda*length*sqrt(sqrt(real(piece%area, qp)/real(piece%inertia, qp)))
      call find_coefficients(k, s, supported)
      ! E I/l^3, E I/l^2, E I/l
      stiff = real(piece%inertia, qp)/[length**3, length**2, length]
      near = near + reshape([stiff(0)*s(1), stiff(1)*s(2), stiff(1)*s(2), stiff(2)*s(5)], [2, 2])
      far = reshape([stiff(0)*s(1), -stiff(1)*s(2), -stiff(1)*s(2), stiff(2)*s(5)], [2, 2])
      coupling = reshape([-stiff(0)*s(3), -stiff(1)*s(4), stiff(1)*s(4), stiff(2)*s(6)], [2, 2])
   end subroutine add_piece

   !> 12, 6, 12, 6, 4 and 2 of the static stiffness, where the piece moves: k^3 (c S + s C)/D, k^2 s S/D, k^3 (s + S)/D,
   !> k^2 (C - c)/D, k (s C - c S)/D and k (S - s)/D with D = 1 - c C, c = cos k, C = cosh k and so on.
   pure subroutine find_coefficients(k, s, supported)
      !> lambda of the piece itself
      real(qp), intent(in) :: k
      real(qp), intent(out) :: s(6)
      !> Roots of D below k
      integer, intent(out) :: supported

      real(qp), parameter :: small = 2.0_qp
      real(qp) :: c, d, decay, square, t
      integer :: halves

      if (k < small) then
         supported = 0
         t = k**4
         d = series(-4.0_qp, 4)
         s = [0.5_qp*series(-4.0_qp, 1), 0.5_qp*series(-4.0_qp, 2), 0.5_qp*series(1.0_qp, 1), &
            0.5_qp*series(1.0_qp, 2), series(-4.0_qp, 3), 0.5_qp*series(1.0_qp, 3)]/d
         return
      end if
      ! all times 2 exp(-k)
      decay = exp(-k)
      square = decay**2
      c = cos(k)
      t = sin(k)
      d = 2.0_qp*decay - c*(1.0_qp + square)
      s = [k**3*(c*(1.0_qp - square) + t*(1.0_qp + square)), k**2*t*(1.0_qp - square), &
         k**3*(2.0_qp*decay*t + 1.0_qp - square), k**2*(1.0_qp + square - 2.0_qp*decay*c), &
         k*(t*(1.0_qp + square) - c*(1.0_qp - square)), k*(1.0_qp - square - 2.0_qp*decay*t)]/d
      halves = int(k/pi_quad)
      supported = halves
      if (d > 0.0_qp .eqv. modulo(halves, 2) == 1) supported = halves - 1

   contains

      !> Sum of g^n t^n/(4 n + p)!
      pure function series(g, p) result(total)
         real(qp), intent(in) :: g
         integer, intent(in) :: p
         real(qp) :: total

         real(qp) :: term
         integer :: n

         term = 1.0_qp/gamma(real(p + 1, qp))
         total = term
         do n = 1, 14
            term = term*g*t/(real(4*n + p, qp)*real(4*n + p - 1, qp)*real(4*n + p - 2, qp)*real(4*n + p - 3, qp))
            total = total + term
         end do
      end function series

   end subroutine find_coefficients

end module piecewise_frequencies
