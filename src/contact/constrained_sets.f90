!> The beam in its free modes, held at some of the surfaces that it can meet: what swings then, and what is at rest
!> (docs/theory.md, section 17). Held at none it swings in its free modes.
module constrained_sets
   use complementarity, only: solve_active
   use constrained_modes, only: constrain
   use damped_oscillators, only: damping_order, lanes, make_oscillators, oscillators_t, padded
   use kinds, only: wp
   use modal_signal, only: make_modal_signal, modal_signal_t
   use point_forces, only: find_point_forces, slow
   use sorting, only: order_columns
   implicit none (type, external)
   private
   public :: free_beam_t, constrained_set_t, make_constrained_set, damp_constrained_set, find_static_state, &
      to_constrained_modes, to_free_modes

   !> The beam in its free modes, and the surfaces.
   type :: free_beam_t
      type(oscillators_t) :: oscillators
      !> Each mode has a damping ratio of its own: held modes swing together then
      logical :: has_own_rates = .false.
      !> s b_i: mode i at each surface, with its sign, [modes, surfaces]
      real(wp), allocatable :: value(:, :)
      !> Mode i at the tip, [modes]
      real(wp), allocatable :: tip_value(:)
      !> Heights of the surfaces, [surfaces]
      real(wp), allocatable :: height(:)
      !> Change of each mode's velocity per unit of change at the one surface, where only its node changes its velocity
      !> at impacts, [modes]; unallocated: impulses act on the whole beam
      real(wp), allocatable :: nodal_shape(:)
      !> s where a surface is at the tip, else 0, [surfaces]
      real(wp), allocatable :: tip_sign(:)
   end type free_beam_t

   type :: constrained_set_t
      !> The surfaces that hold it
      integer, allocatable :: closed(:)
      !> Modes left
      integer :: count = 0
      type(oscillators_t) :: oscillators
      !> They in the free modes, orthonormal, [free, count]; unallocated: they are the free modes
      real(wp), allocatable :: mode(:, :)
      !> A mode is so stiff that W^2 times the square of a rounding error is energy to speak of
      logical :: has_stiff = .false.
      !> The same and its transpose, with zeros up to whole vectors of free modes and of those of the set, [padded free,
      !> count], [padded count, free]
      real(wp), allocatable, private :: out(:, :), into(:, :)
      !> Reaction of each surface that holds it per unit of mode (and of 2 zeta times its rate), [held, count]
      real(wp), allocatable :: reaction(:, :)
      !> At rest: displacement in the free modes, gaps, reactions, tip, energy, [free], [surfaces], [held]
      real(wp), allocatable :: static(:), static_gap(:), static_force(:)
      real(wp) :: static_tip = 0.0_wp
      real(wp) :: static_energy = 0.0_wp
      !> Modes at the surfaces and at the tip, [count, surfaces], [count]
      real(wp), allocatable :: value(:, :)
      real(wp), allocatable :: tip_value(:)
      !> Of a force at a surface the parts that the surfaces which hold it take at once, [held, surfaces]
      real(wp), allocatable :: share(:, :)
      !> Gaps and reactions as signals, [surfaces], [held]; their state is set by who looks at them
      type(modal_signal_t), allocatable :: gap(:), force(:)
   end type constrained_set_t

   !> Below this, W^2 times the square of a rounding error is no energy to speak of.
   real(wp), parameter :: least_stiff = 1.0e12_wp

contains

   !> Hold the beam, at one surface after the other.
   subroutine make_constrained_set(beam, closed, set)
      type(free_beam_t), intent(in) :: beam
      !> Surfaces, no two at one point
      integer, intent(in) :: closed(:)
      !> Must stay where it is: its signals point to its oscillators
      type(constrained_set_t), target, intent(out) :: set

      real(wp), allocatable :: square(:), change(:, :), row(:), new(:), fixed(:), reaction(:, :)
      integer, allocatable :: order(:)
      integer :: i, k

      set%closed = closed
      allocate (square, source=beam%oscillators%square)
      set%value = beam%value
      set%tip_value = beam%tip_value
      allocate (set%reaction(0, size(square)))
      allocate (set%share(size(closed), size(beam%height)), source=0.0_wp)
      do i = 1, size(closed)
         call constrain(square, set%value(:, closed(i)), 0.0_wp, new, change, row)
         ! what of a force here the surfaces before take
         fixed = set%share(:i - 1, closed(i))
         allocate (reaction(i, size(new)))
         reaction(:i - 1, :) = matmul(set%reaction, change)
         do k = 1, i - 1
            reaction(k, :) = reaction(k, :) - fixed(k)*row
         end do
         reaction(i, :) = row
         call move_alloc(reaction, set%reaction)
         do k = 1, size(beam%height)
            call share_out(set%value(:, closed(i)), set%value(:, k), fixed, i, set%share(:, k))
         end do
         set%value = matmul(transpose(change), set%value)
         set%tip_value = matmul(set%tip_value, change)
         if (allocated(set%mode)) then
            set%mode = matmul(set%mode, change)
         else
            set%mode = change
         end if
         square = new
      end do
      set%count = size(square)
      set%has_stiff = maxval(square) >= least_stiff
      associate (zeta => 0.5_wp*beam%oscillators%two_zeta, mass_rate => beam%oscillators%mass_rate(:set%count))
         if (size(closed) > 0) then
            order = damping_order(square, zeta, mass_rate)
            square = square(order)
            call order_columns(set%mode, order)
            allocate (set%out(padded(size(set%mode, 1)), set%count), set%into(padded(set%count), size(set%mode, 1)), &
               source=0.0_wp)
            set%out(:size(set%mode, 1), :) = set%mode
            ! a transposed matrix would stand on the stack
            do i = 1, size(set%mode, 1)
               set%into(:set%count, i) = set%mode(i, :)
            end do
            set%reaction = set%reaction(:, order)
            set%value = set%value(order, :)
            set%tip_value = set%tip_value(order)
         end if
         call make_oscillators(square, zeta, set%oscillators, mass_rate)
      end associate
      ! held exactly, not to rounding
      set%value(:, closed) = 0.0_wp
      do k = 1, size(closed)
         if (abs(beam%tip_sign(closed(k))) > 0.0_wp) set%tip_value = 0.0_wp
      end do
      call make_signals(set)
      allocate (set%static(size(beam%oscillators%square)), set%static_force(size(closed)), &
         set%static_gap(size(beam%height)))
      call find_static_state(beam, set)
   end subroutine make_constrained_set

   !> Gaps and reactions of a set at the damping of its oscillators.
   subroutine make_signals(set)
      type(constrained_set_t), target, intent(inout) :: set

      integer :: k

      if (allocated(set%gap)) deallocate (set%gap, set%force)
      allocate (set%gap(size(set%value, 2)), set%force(size(set%closed)))
      do k = 1, size(set%gap)
         call make_modal_signal(set%oscillators, 0.0_wp, set%value(:, k), set%gap(k))
      end do
      do k = 1, size(set%closed)
         call make_modal_signal(set%oscillators, 0.0_wp, set%reaction(k, :), set%force(k))
         set%force(k)%is_viscous = .true.
      end do
   end subroutine make_signals

   !> Give a set the damping of its beam, which is proportional to stiffness alone: it does not change the modes, nor
   !> their order.
   subroutine damp_constrained_set(beam, set)
      type(free_beam_t), intent(in) :: beam
      type(constrained_set_t), target, intent(inout) :: set

      real(wp) :: square(set%count)

      square = set%oscillators%square
      call make_oscillators(square, 0.5_wp*beam%oscillators%two_zeta, set%oscillators)
      call make_signals(set)
   end subroutine damp_constrained_set

   !> A force at a surface, as far as the surface held last takes it at once, and with it those before.
   pure subroutine share_out(last, value, before, place, share)
      !> Modes at the surface held last, and at that of the force
      real(wp), intent(in) :: last(:)
      real(wp), intent(in) :: value(:)
      !> Share of a force at the surface held last, [place - 1]
      real(wp), intent(in) :: before(:)
      integer, intent(in) :: place
      !> Share of the force, [held]
      real(wp), intent(inout) :: share(:)

      real(wp) :: part

      part = sum(last*value)/sum(last**2)
      share(place) = part
      share(:place - 1) = share(:place - 1) - part*before
   end subroutine share_out

   !> At rest on the surfaces that hold it, at their present heights, nothing else acting.
   pure subroutine find_static_state(beam, set)
      type(free_beam_t), intent(in) :: beam
      type(constrained_set_t), intent(inout) :: set

      complex(wp), dimension(size(beam%tip_value)) :: nothing, shape
      complex(wp) :: force(size(set%closed))
      real(wp) :: flexibility(size(set%closed), size(set%closed)), stiffness
      integer :: j, k

      set%static_tip = 0.0_wp
      associate (h => beam%height(set%closed), b => beam%value(:, set%closed), square => beam%oscillators%square)
         do k = 1, size(set%closed)
            do j = 1, size(set%closed)
               flexibility(j, k) = sum(b(:, j)*b(:, k)/square)
            end do
         end do
         if (size(h) == 1) then
            ! as `make_support` has it, to the last digit
            stiffness = 1.0_wp/flexibility(1, 1)
            set%static_force(:) = h*stiffness
            set%static(:) = h(1)*(b(:, 1)/square*stiffness)
            set%static_tip = h(1)*sum(beam%tip_value*(b(:, 1)/square*stiffness))
         else if (any(square < slow**2)) then
            nothing = (0.0_wp, 0.0_wp)
            call find_point_forces(cmplx(square, 0.0_wp, wp), b, nothing(:size(h)), nothing, cmplx(h, 0.0_wp, wp), &
               force, shape)
            set%static_force(:) = real(force, wp)
            set%static(:) = real(shape, wp)
            set%static_tip = sum(beam%tip_value*set%static)
         else
            call solve_active(flexibility, -h, spread(.true., 1, size(h)), set%static_force)
            set%static(:) = matmul(b, set%static_force)/square
            set%static_tip = sum(beam%tip_value*set%static)
         end if
         set%static_energy = 0.5_wp*sum(set%static_force*h)
      end associate
      do k = 1, size(beam%height)
         set%static_gap(k) = sum(beam%value(:, k)*set%static) - beam%height(k)
      end do
      set%static_gap(set%closed) = 0.0_wp
      do k = 1, size(set%closed)
         if (abs(beam%tip_sign(set%closed(k))) <= 0.0_wp) cycle
         set%static_tip = beam%tip_sign(set%closed(k))*beam%height(set%closed(k))
      end do
      set%gap%offset = set%static_gap
      set%force%offset = set%static_force
   end subroutine find_static_state

   !> Displacements that hold the surfaces, less those at rest, and velocities, from free modes to those of the set. In
   !> a mode far stiffer than the others the rounding error of the sum is a great force, so where that is better the
   !> forces are summed instead: w_j^2 p_j = sum psi_ij W_i^2 q_i.
   pure subroutine to_constrained_modes(beam, set, q, v, p, rate)
      type(free_beam_t), intent(in) :: beam
      type(constrained_set_t), intent(in) :: set
      !> State in the free modes, [free]
      real(wp), contiguous, intent(in) :: q(:)
      real(wp), contiguous, intent(in) :: v(:)
      !> In those of the set, [count]
      real(wp), contiguous, intent(out) :: p(:)
      real(wp), contiguous, intent(out) :: rate(:)

      real(wp), dimension(size(q)) :: moved, forces
      real(wp), dimension(padded(size(p))) :: lane_p, lane_rate
      integer :: j

      if (.not. allocated(set%mode)) then
         p = q
         rate = v
         return
      end if
      moved = q - set%static
      call add_up(size(set%into, 1)/lanes, size(q), set%into, moved, v, lane_p, lane_rate)
      p = lane_p(:set%count)
      rate = lane_rate(:set%count)
      if (.not. set%has_stiff) return
      forces = beam%oscillators%square*moved
      do j = 1, set%count
         if (sum(abs(set%mode(:, j)*forces)) < set%oscillators%square(j)*sum(abs(set%mode(:, j)*moved))) then
            p(j) = sum(set%mode(:, j)*forces)/set%oscillators%square(j)
         end if
      end do
   end subroutine to_constrained_modes

   !> And back: W_i^2 q_i = sum psi_ij w_j^2 p_j + b_i' (sum reaction_j p_j).
   pure subroutine to_free_modes(beam, set, p, rate, q, v)
      type(free_beam_t), intent(in) :: beam
      type(constrained_set_t), intent(in) :: set
      !> [count]
      real(wp), contiguous, intent(in) :: p(:)
      real(wp), contiguous, intent(in) :: rate(:)
      !> [free]
      real(wp), contiguous, intent(out) :: q(:)
      real(wp), contiguous, intent(out) :: v(:)

      real(wp), dimension(size(set%closed)) :: reaction, magnitude
      real(wp) :: forces(set%count)
      real(wp), dimension(padded(size(q))) :: lane_q, lane_v
      integer :: i

      if (.not. allocated(set%mode)) then
         q = p
         v = rate
         return
      end if
      call add_up(size(set%out, 1)/lanes, size(p), set%out, p, rate, lane_q, lane_v)
      q = lane_q(:size(q))
      v = lane_v(:size(v))
      if (set%has_stiff) then
         forces = set%oscillators%square*p
         reaction = matmul(set%reaction, p)
         magnitude = matmul(abs(set%reaction), abs(p))
         do i = 1, size(q)
            if (sum(abs(set%mode(i, :)*forces)) + sum(abs(beam%value(i, set%closed))*magnitude) < &
               beam%oscillators%square(i)*sum(abs(set%mode(i, :)*p))) then
               q(i) = (sum(set%mode(i, :)*forces) + sum(beam%value(i, set%closed)*reaction))/beam%oscillators%square(i)
            end if
         end do
      end if
      q = set%static + q
   end subroutine to_free_modes

   !> Two sums of columns, in whole vectors.
   pure subroutine add_up(blocks, columns, matrix, first, second, first_sum, second_sum)
      !> Vectors in each column
      integer, intent(in) :: blocks
      integer, intent(in) :: columns
      real(wp), intent(in) :: matrix(lanes*blocks, columns)
      !> Factors of the columns
      real(wp), intent(in), dimension(columns) :: first, second
      real(wp), intent(out), dimension(lanes*blocks) :: first_sum, second_sum

      integer :: i, j

      first_sum = 0.0_wp
      second_sum = 0.0_wp
      do i = 1, columns
         !$omp simd
         do j = 1, lanes*blocks
            first_sum(j) = first_sum(j) + matrix(j, i)*first(i)
            second_sum(j) = second_sum(j) + matrix(j, i)*second(i)
         end do
      end do
   end subroutine add_up

end module constrained_sets
