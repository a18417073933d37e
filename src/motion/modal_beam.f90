!> The beam in its free modes, with what the motion needs of each: frequency, and value at the stop and at the
!> tip. Mass-normalised modes: M becomes the unit matrix, K the squared frequencies.
module modal_beam
   use bracketed_zero, only: bracket_t, enter, go_to
   use damped_oscillators, only: make_oscillators, oscillators_t
   use kinds, only: wp
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: modal_beam_t, make_modal_beam, support_t, make_support, pinned_beam_t, make_pinned_beam, attach_spring
   public :: to_pinned, to_free

   type :: modal_beam_t
      !> Number of modes kept
      integer :: count = 0
      !> The modes as oscillators in tau
      type(oscillators_t) :: oscillators
      !> b_i: mode i at the stop point, [count]
      real(wp), allocatable :: stop_value(:)
      !> The stop is at the tip
      logical :: stop_is_tip = .false.
      !> Mode i at the tip, [count]
      real(wp), allocatable :: tip_value(:)
      !> sum b_i^2 = (M^-1)_cc: one over the mass that takes part in an impact
      real(wp) :: mobility = 0.0_wp
      !> (K^-1)_cc = sum b_i^2/W_i^2, and the node's own
      real(wp) :: flexibility = 0.0_wp
      !> A massless node at the stop hangs on the modes by a spring of this flexibility; 0: there is none
      real(wp) :: node_flexibility = 0.0_wp
   end type modal_beam_t

   !> The beam held at the stop point, as a constraint on the free modes; damping has no part in it.
   type :: support_t
      !> It has been made
      logical :: made = .false.
      !> Squared frequencies W^2 of the pinned modes, ascending, [pinned]
      real(wp), allocatable :: square(:)
      !> Pinned modes in the free ones, orthonormal, [free, pinned]
      real(wp), allocatable :: mode(:, :)
      !> Reaction per unit of each pinned mode (and of 2 zeta times its rate), [pinned]
      real(wp), allocatable :: reaction(:)
      !> Free modal coordinates of the static shape that moves the stop point by 1, [free]
      real(wp), allocatable :: static(:)
      !> The tip in this shape, and in each pinned mode, [pinned]
      real(wp) :: static_tip = 0.0_wp
      real(wp), allocatable :: tip_value(:)
      !> Force that it takes
      real(wp) :: static_force = 0.0_wp
   end type support_t

   !> The same, with its pinned modes as oscillators.
   type, extends(support_t) :: pinned_beam_t
      !> Number of pinned modes: one less than free ones, or as many where a massless node is held
      integer :: count = 0
      type(oscillators_t) :: oscillators
   end type pinned_beam_t

   !> Below this, W^2 times the square of a rounding error is no energy to speak of.
   real(wp), parameter :: least_stiff = 1.0e14_wp

contains

   !> Free modes for the motion.
   pure subroutine make_modal_beam(square, stop_value, tip_value, zeta, beam, node_flexibility)
      !> W_i^2, ascending
      real(wp), intent(in) :: square(:)
      !> Mass-normalised modes at the stop point and at the tip, rho Abar L = 1
      real(wp), intent(in) :: stop_value(:)
      real(wp), intent(in) :: tip_value(:)
      !> zeta, >= 0
      real(wp), intent(in) :: zeta
      !> The beam in its modes
      type(modal_beam_t), intent(out) :: beam
      !> That of a massless node at the stop; default 0, it has mass
      real(wp), intent(in), optional :: node_flexibility

      if (present(node_flexibility)) beam%node_flexibility = node_flexibility
      beam%count = size(square)
      call make_oscillators(square, zeta, beam%oscillators)
      allocate (beam%stop_value, source=stop_value)
      allocate (beam%tip_value, source=tip_value)
      beam%stop_is_tip = all(abs(stop_value - tip_value) <= 0.0_wp)
      beam%mobility = sum(stop_value**2)
      beam%flexibility = sum(stop_value**2/beam%oscillators%square) + beam%node_flexibility
   end subroutine make_modal_beam

   !> Modes of the beam held at the stop point.
   !>
   !> With b_i the free modes at the stop the pinned frequencies w are the roots of
   !> sum b_i^2/(W_i^2 - w^2) = 0, one between each two neighbouring poles, and the modes are
   !> r b_i/(W_i^2 - w^2), r their reaction (Dowell, J. Appl. Mech. 46 (1979) 206: free vibrations of a
   !> linear structure with constraints). A root is sought as its distance from the nearer pole, so
   !> that no difference W_i^2 - w^2 cancels. A mode with a node at the stop (b_i vanishes) is its own pinned mode.
   !> Where the stop holds a massless node the flexibility f of its spring is added to the sum, and there is one more
   !> root, above all poles.
   pure subroutine make_support(beam, support)
      type(modal_beam_t), intent(in) :: beam
      type(support_t), intent(out) :: support

      integer, allocatable :: active(:)
      real(wp), allocatable :: square(:)
      real(wp), allocatable :: distance(:, :), consistent(:)
      real(wp) :: norm
      integer, allocatable :: order(:)
      integer :: i, j, a, n, alone, modes, roots

      n = beam%count
      modes = n
      if (beam%node_flexibility <= 0.0_wp) modes = n - 1
      support%made = .true.
      allocate (support%mode(n, modes), support%reaction(modes), support%square(modes), square(modes))
      support%mode = 0.0_wp
      support%static_force = 1.0_wp/beam%flexibility
      allocate (support%static, source=beam%stop_value/beam%oscillators%square*support%static_force)
      associate (b => beam%stop_value, w2 => beam%oscillators%square)
         allocate (active, source=pack([(i, i=1, n)], abs(b) > 1.0e-14_wp*maxval(abs(b))))
         j = 0
         do i = 1, n
            if (any(active == i)) cycle
            j = j + 1
            square(j) = w2(i)
            support%reaction(j) = 0.0_wp
            support%mode(i, j) = 1.0_wp
         end do
         alone = j
         roots = modes - alone
         allocate (distance(size(active), roots), consistent(size(active)))
         do a = 1, roots
            call root_between(w2(active), b(active)**2, beam%node_flexibility, a, square(alone + a), distance(:, a))
         end do
         call consistent_weights(w2(active), sum(b(active)**2), beam%node_flexibility, distance, consistent)
         consistent = sign(sqrt(consistent), b(active))
         do a = 1, roots
            norm = 1.0_wp/sqrt(sum((consistent/distance(:, a))**2))
            support%reaction(alone + a) = norm
            support%mode(active, alone + a) = norm*consistent/distance(:, a)
         end do
      end associate
      order = ascending_order(square)
      support%mode = support%mode(:, order)
      support%reaction = support%reaction(order)
      allocate (support%tip_value, source=matmul(beam%tip_value, support%mode))
      support%static_tip = sum(beam%tip_value*support%static)
      if (beam%stop_is_tip) then
         ! held exactly, not to rounding
         support%tip_value = 0.0_wp
         support%static_tip = 1.0_wp
      end if
      support%square(:) = square(order)
   end subroutine make_support

   !> The beam held at the stop, ready to move.
   pure subroutine make_pinned_beam(beam, zeta, shared, pinned)
      type(modal_beam_t), intent(in) :: beam
      !> zeta, >= 0
      real(wp), intent(in) :: zeta
      !> Made beforehand for all runs of this beam; not used unless it fits
      type(support_t), intent(in) :: shared
      type(pinned_beam_t), intent(out) :: pinned

      logical :: fits

      fits = shared%made
      if (fits) fits = size(shared%static) == beam%count
      if (fits) then
         pinned%support_t = shared
      else
         call make_support(beam, pinned%support_t)
      end if
      pinned%count = size(pinned%square)
      call make_oscillators(pinned%square, zeta, pinned%oscillators)
   end subroutine make_pinned_beam

   !> Displacements that hold the stop point, from free modes to pinned ones. In a mode far stiffer than the others the
   !> rounding error of the sum is a great force, so where that is better the forces are summed instead: w_j^2 p_j =
   !> sum psi_ij W_i^2 q_i.
   pure function to_pinned(pinned, free_square, stop_value, q) result(p)
      type(pinned_beam_t), intent(in) :: pinned
      !> W_i^2 and b_i of the free modes, [modes]
      real(wp), intent(in) :: free_square(:)
      real(wp), intent(in) :: stop_value(:)
      !> Free modal coordinates, [modes]
      real(wp), intent(in) :: q(:)
      real(wp) :: p(pinned%count)

      real(wp) :: forces(size(q))
      integer :: j

      p = matmul(q, pinned%mode)
      if (pinned%square(pinned%count) < least_stiff) return
      forces = free_square*q
      do j = 1, pinned%count
         if (sum(abs(pinned%mode(:, j)*forces)) < pinned%square(j)*sum(abs(pinned%mode(:, j)*q))) then
            p(j) = sum(pinned%mode(:, j)*forces)/pinned%square(j)
            ! a massless node stays where it is held, the modes at its place need not
            if (pinned%count == size(q)) p(j) = p(j) - pinned%reaction(j)*sum(stop_value*q)/pinned%square(j)
         end if
      end do
   end function to_pinned

   !> And back: W_i^2 q_i = sum psi_ij w_j^2 p_j + b_i sum r_j p_j.
   pure function to_free(pinned, free_square, stop_value, p) result(q)
      type(pinned_beam_t), intent(in) :: pinned
      !> W_i^2 and b_i of the free modes, [modes]
      real(wp), intent(in) :: free_square(:)
      real(wp), intent(in) :: stop_value(:)
      !> Pinned modal coordinates
      real(wp), intent(in) :: p(:)
      real(wp) :: q(size(free_square))

      real(wp) :: forces(pinned%count), reaction, magnitude
      integer :: i

      q = matmul(pinned%mode, p)
      if (pinned%square(pinned%count) < least_stiff) return
      forces = pinned%square*p
      reaction = sum(pinned%reaction*p)
      magnitude = sum(abs(pinned%reaction*p))
      do i = 1, size(q)
         if (sum(abs(pinned%mode(i, :)*forces)) + abs(stop_value(i))*magnitude < &
            free_square(i)*sum(abs(pinned%mode(i, :)*p))) then
            q(i) = (sum(pinned%mode(i, :)*forces) + stop_value(i)*reaction)/free_square(i)
         end if
      end do
   end function to_free

   !> Weights for which the computed roots are exact; they differ from the given ones by rounding only, but modes
   !> made of them are orthogonal to rounding (Gu and Eisenstat, SIAM J. Matrix Anal. Appl. 15 (1994) 1266).
   pure subroutine consistent_weights(pole, total, constant, distance, weight)
      !> Poles, ascending
      real(wp), intent(in) :: pole(:)
      !> Sum of the weights
      real(wp), intent(in) :: total
      !> Constant besides the poles' terms; above 0 there is a root above the last pole
      real(wp), intent(in) :: constant
      !> pole - root, [poles, roots]
      real(wp), intent(in) :: distance(:, :)
      !> The weights, [poles]
      real(wp), intent(out) :: weight(:)

      integer :: i, k

      do i = 1, size(pole)
         weight(i) = total
         if (constant > 0.0_wp) weight(i) = -constant*distance(i, size(pole))
         ! root k lies between poles k and k + 1: factor by factor, nothing overflows
         do k = 1, size(pole) - 1
            if (k < i) then
               weight(i) = weight(i)*(distance(i, k)/(pole(i) - pole(k)))
            else
               weight(i) = weight(i)*(-distance(i, k)/(pole(k + 1) - pole(i)))
            end if
         end do
      end do
   end subroutine consistent_weights

   !> Modes of the beam with a spring at the stop point: roots of 1/k + sum b_i^2/(W_i^2 - w^2) = 0.
   pure subroutine attach_spring(free_square, stop_value, stiffness, square, at_stop)
      !> W_i^2 of the free modes, ascending
      real(wp), intent(in) :: free_square(:)
      !> b_i, none zero
      real(wp), intent(in) :: stop_value(:)
      !> k > 0
      real(wp), intent(in) :: stiffness
      !> w^2 with the spring, ascending
      real(wp), intent(out) :: square(:)
      !> The modes with the spring at the stop point
      real(wp), intent(out) :: at_stop(:)

      real(wp) :: distance(size(free_square))
      integer :: i

      do i = 1, size(free_square)
         call root_between(free_square, stop_value**2, 1.0_wp/stiffness, i, square(i), distance)
         at_stop(i) = 1.0_wp/(stiffness*sqrt(sum((stop_value/distance)**2)))
      end do
   end subroutine attach_spring

   !> The root of constant + sum weight_k/(pole_k - x) between two neighbouring poles, or above the last.
   pure subroutine root_between(pole, weight, constant, left, root, distance)
      !> Poles, ascending and distinct
      real(wp), intent(in) :: pole(:)
      !> Weights, > 0
      real(wp), intent(in) :: weight(:)
      !> Constant, >= 0; > 0 for the root above the last pole
      real(wp), intent(in) :: constant
      !> The root lies between poles `left` and `left` + 1
      integer, intent(in) :: left
      real(wp), intent(out) :: root
      !> pole_k - root, to full relative precision, [size(pole)]
      real(wp), intent(out) :: distance(:)

      type(bracket_t) :: bracket
      real(wp) :: shifted(size(pole)), gap, low, high, next, value, slope
      integer :: origin

      origin = left
      low = 0.0_wp
      if (left == size(pole)) then
         high = sum(weight)/constant*(1.0_wp + 4.0_wp*epsilon(1.0_wp))
      else
         gap = pole(left + 1) - pole(left)
         high = 0.5_wp*gap
         ! the function grows from -infinity to +infinity; its sign in the middle tells the nearer pole
         value = constant + sum(weight/((pole - pole(left)) - 0.5_wp*gap))
         if (value <= 0.0_wp) then
            origin = left + 1
            low = -0.5_wp*gap
            high = 0.0_wp
         end if
      end if
      shifted = pole - pole(origin)
      bracket = bracket_t(low=low, high=high, point=0.5_wp*(low + high), grows=.true., &
         least_step=epsilon(1.0_wp), least_value=-1.0_wp)
      do while (.not. bracket%is_found)
         associate (x => bracket%point)
            value = constant + sum(weight/(shifted - x))
            slope = sum(weight/(shifted - x)**2)
            call enter(bracket, value)
            ! Newton on x f(x), whose pole at the origin is gone
            next = x - x*value/(value + x*slope)
         end associate
         associate (low => bracket%low, high => bracket%high)
            if (.not. (next > low .and. next < high)) then
               next = 0.5_wp*(low + high)
               ! towards a pole halve the exponent, not the interval
               if (low > 0.0_wp .and. high > 4.0_wp*low) next = sqrt(low)*sqrt(high)
               if (high < 0.0_wp .and. low < 4.0_wp*high) next = -sqrt(-low)*sqrt(-high)
            end if
         end associate
         call go_to(bracket, next)
      end do
      root = pole(origin) + bracket%point
      distance = shifted - bracket%point
   end subroutine root_between

end module modal_beam
