!> The beam in its free modes, with what the motion needs of each: frequency, and value at the stop and at the
!> tip. Mass-normalised modes: M becomes the unit matrix, K the squared frequencies.
module modal_beam
   use constrained_modes, only: constrain
   use damped_oscillators, only: make_oscillators, oscillators_t
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: modal_beam_t, make_modal_beam, support_t, make_support, pinned_beam_t, make_pinned_beam
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

   !> Modes of the beam held at the stop point, and the static shape that moves it. Where the stop holds a massless node
   !> there is one more mode.
   pure subroutine make_support(beam, support)
      type(modal_beam_t), intent(in) :: beam
      type(support_t), intent(out) :: support

      call constrain(beam%oscillators%square, beam%stop_value, beam%node_flexibility, support%square, support%mode, &
         support%reaction)
      support%made = .true.
      support%static_force = 1.0_wp/beam%flexibility
      allocate (support%static, source=beam%stop_value/beam%oscillators%square*support%static_force)
      allocate (support%tip_value, source=matmul(beam%tip_value, support%mode))
      support%static_tip = sum(beam%tip_value*support%static)
      if (.not. beam%stop_is_tip) return
      ! held exactly, not to rounding
      support%tip_value = 0.0_wp
      support%static_tip = 1.0_wp
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
   pure function to_pinned(pinned, free_square, at_stop, q) result(p)
      type(pinned_beam_t), intent(in) :: pinned
      !> W_i^2 of the free modes, [modes]
      real(wp), intent(in) :: free_square(:)
      !> Sum of b_i q_i where a massless node is held, known better than from q; else not used
      real(wp), intent(in) :: at_stop
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
            if (pinned%count == size(q)) p(j) = p(j) - pinned%reaction(j)*at_stop/pinned%square(j)
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

end module modal_beam
