!> The terms of a contact with several stops (docs/theory.md, sections 17 and 18).
module joint_terms
   use damped_oscillators, only: padded
   use exponential_powers, only: find_terms
   use kinds, only: wp
   use sorting, only: ascending_order
   use yielding_stop, only: impedance_t
   implicit none (type, external)
   private
   public :: joint_modes_t, make_room, add_room, put_in_order, ready_terms, joint_amplitudes, terms_at

   type :: joint_modes_t
      !> The stops
      type(impedance_t), allocatable :: spring(:)
      real(wp) :: two_zeta = 0.0_wp
      !> alpha, [modes of the beam]
      real(wp), allocatable :: mass_rate(:)
      !> Number of terms; of a conjugate pair only the one with Im s > 0 is kept
      integer :: count = 0
      !> Exponents s, and 1 for a real one, 2 for a pair, [count]
      complex(wp), allocatable :: exponent(:)
      real(wp), allocatable :: weight(:)
      !> -Re s and Im s, filled up with zeros to whole vectors
      real(wp), allocatable :: decay(:), omega(:)
      !> P of each stop, its indentation and its P2 per unit of amplitude, [stops, count]
      complex(wp), allocatable :: force(:, :), indentation(:, :), branch(:, :)
      !> Each mode of the beam per unit of amplitude, [modes, count], and 1 + 2 zeta s, [count]
      complex(wp), allocatable :: shape(:, :), viscous(:)
      !> Real and imaginary parts of the shapes, [modes, count, 2]
      real(wp), allocatable :: moves(:, :, :)
      !> What makes the amplitude of the state at the start: of heights, of what the stops keep, [stops, count], and of
      !> the modes, [modes, count]
      complex(wp), allocatable :: of_height(:, :), of_memory(:, :), of_mode(:, :)
      !> Real and imaginary parts of the last, and the sums of their magnitudes, in whole vectors, [padded, modes, 3]
      real(wp), allocatable :: parts(:, :, :)
      !> Modes with nodes at all stops: they swing on as if alone
      integer, allocatable :: inactive(:)
      !> Displacement and force of the state of rest per unit of height, [modes, stops], [stops, stops]
      real(wp), allocatable :: static_shape(:, :), static_force(:, :)
   end type joint_modes_t

contains

   !> Room for some terms.
   pure subroutine make_room(modes, beam, stops, most)
      type(joint_modes_t), intent(inout) :: modes
      !> Modes of the beam
      integer, intent(in) :: beam
      integer, intent(in) :: stops
      !> Terms at most
      integer, intent(in) :: most

      if (allocated(modes%exponent)) deallocate (modes%exponent, modes%weight, modes%viscous, modes%force, &
         modes%indentation, modes%branch, modes%of_height, modes%of_memory, modes%shape, modes%of_mode)
      allocate (modes%exponent(most), modes%weight(most), modes%viscous(most))
      allocate (modes%force(stops, most), modes%indentation(stops, most), modes%branch(stops, most), &
         modes%of_height(stops, most), modes%of_memory(stops, most), modes%shape(beam, most), &
         modes%of_mode(beam, most), source=(0.0_wp, 0.0_wp))
   end subroutine make_room

   !> Room for so many more.
   pure subroutine add_room(modes, more)
      type(joint_modes_t), intent(inout) :: modes
      integer, intent(in) :: more

      type(joint_modes_t) :: old

      old = modes
      call make_room(modes, size(old%shape, 1), size(old%force, 1), size(old%exponent) + more)
      associate (n => old%count)
         modes%exponent(:n) = old%exponent(:n)
         modes%weight(:n) = old%weight(:n)
         modes%viscous(:n) = old%viscous(:n)
         modes%force(:, :n) = old%force(:, :n)
         modes%indentation(:, :n) = old%indentation(:, :n)
         modes%branch(:, :n) = old%branch(:, :n)
         modes%of_height(:, :n) = old%of_height(:, :n)
         modes%of_memory(:, :n) = old%of_memory(:, :n)
         modes%shape(:, :n) = old%shape(:, :n)
         modes%of_mode(:, :n) = old%of_mode(:, :n)
      end associate
   end subroutine add_room

   !> Keep the room that is used, the fastest terms last, which lets the steps of searches be long.
   pure subroutine put_in_order(modes)
      type(joint_modes_t), intent(inout) :: modes

      integer :: order(modes%count)

      order = ascending_order(abs(modes%exponent(:modes%count)))
      modes%exponent = modes%exponent(order)
      modes%weight = modes%weight(order)
      modes%viscous = modes%viscous(order)
      modes%force = modes%force(:, order)
      modes%indentation = modes%indentation(:, order)
      modes%branch = modes%branch(:, order)
      modes%of_height = modes%of_height(:, order)
      modes%of_memory = modes%of_memory(:, order)
      modes%shape = modes%shape(:, order)
      modes%of_mode = modes%of_mode(:, order)
   end subroutine put_in_order

   !> What the amplitudes and powers of all terms need in whole vectors.
   pure subroutine ready_terms(modes)
      !> With its terms
      type(joint_modes_t), intent(inout) :: modes

      associate (n => modes%count)
         allocate (modes%decay(padded(n)), modes%omega(padded(n)), source=0.0_wp)
         modes%decay(:n) = -real(modes%exponent, wp)
         modes%omega(:n) = aimag(modes%exponent)
         allocate (modes%parts(padded(n), size(modes%of_mode, 1), 3), source=0.0_wp)
         modes%parts(:n, :, 1) = transpose(real(modes%of_mode, wp))
         modes%parts(:n, :, 2) = transpose(aimag(modes%of_mode))
         modes%parts(:, :, 3) = abs(modes%parts(:, :, 1)) + abs(modes%parts(:, :, 2))
         allocate (modes%moves(size(modes%shape, 1), n, 2))
         modes%moves(:, :, 1) = real(modes%shape, wp)
         modes%moves(:, :, 2) = aimag(modes%shape)
      end associate
   end subroutine ready_terms

   !> Amplitudes from the state at the start of a contact: what moves is rest + sum weight Re (amplitude value exp(s
   !> t)).
   pure subroutine joint_amplitudes(square, modes, height, indentation, branch_force, z, v, amplitude)
      !> W_i^2 of the beam's modes
      real(wp), intent(in) :: square(:)
      type(joint_modes_t), intent(in) :: modes
      !> Of the stops, from where the beam's modes swing about, [stops]
      real(wp), intent(in) :: height(:)
      !> u and P2 at the start: from displacements the indentation of a hard stop would be rounding error, [stops]
      real(wp), intent(in) :: indentation(:)
      real(wp), intent(in) :: branch_force(:)
      !> State of the modes, [modes]
      real(wp), intent(in) :: z(:)
      real(wp), intent(in) :: v(:)
      !> Without the weight, [count]
      complex(wp), intent(out) :: amplitude(:)

      ! W^2 z, z, v, alpha z
      integer, parameter :: forces = 1, places = 2, rates = 3, arrests = 4
      complex(wp) :: as_is, closed, inverse, other, sums(4)
      real(wp) :: scale, speed, other_scale, sizes(4), state(size(z), 4)
      ! sums over the modes for all terms: real and imaginary part, magnitude
      real(wp) :: total(size(modes%decay), 3, 4)
      real(wp), dimension(size(height)) :: memory, viscous, elastic
      logical :: has_damper(size(height))
      integer :: j, m

      has_damper = modes%spring%branch_stiffness <= 0.0_wp
      memory = merge(0.0_wp, branch_force - modes%spring%branch_stiffness*indentation, has_damper)
      viscous = merge(modes%spring%viscosity*indentation, 0.0_wp, has_damper)
      elastic = modes%spring%stiffness*indentation
      state(:, forces) = square*z
      state(:, places) = z
      state(:, rates) = v
      state(:, arrests) = modes%mass_rate*z
      call add_up(size(modes%decay), size(z), modes%parts, state, total)
      total(:, :, arrests) = 0.0_wp
      if (any(modes%mass_rate > 0.0_wp)) then
         total(:, 1, arrests) = matmul(modes%parts(:, :, 1), state(:, arrests))
         total(:, 2, arrests) = matmul(modes%parts(:, :, 2), state(:, arrests))
         total(:, 3, arrests) = matmul(modes%parts(:, :, 3), abs(state(:, arrests)))
      end if
      do m = 1, modes%count
         sums = cmplx(total(m, 1, :), total(m, 2, :), wp)
         sizes = total(m, 3, :)
         inverse = 1.0_wp/modes%exponent(m)
         speed = abs(modes%decay(m)) + abs(modes%omega(m))
         ! the heights less the free motion of the stop points, transformed, in two ways: as it stands, or with
         ! s (s + 2 zeta W^2 + alpha)/D = 1 - W^2/D, where what cancels for great s is the indentation, and with
         ! (k + c s)/s - c = k/s
         as_is = -(modes%exponent(m)*sums(places) + sums(arrests)) - modes%two_zeta*sums(forces)
         scale = speed*sizes(places) + sizes(arrests) + modes%two_zeta*sizes(forces)
         other = sums(forces)
         other_scale = sizes(forces)
         amplitude(m) = -sums(rates)
         do j = 1, size(height)
            associate (of_height => modes%of_height(j, m), of_memory => modes%of_memory(j, m))
               ! |Re| + |Im|
               scale = scale + (abs(real(of_height, wp)) + abs(aimag(of_height)))*abs(height(j))/speed &
                  + (abs(real(of_memory, wp)) + abs(aimag(of_memory)))*abs(viscous(j))
               closed = merge(of_memory*elastic(j), of_height*indentation(j), has_damper(j))
               other_scale = other_scale + abs(real(closed, wp)) + abs(aimag(closed))
               as_is = as_is + of_height*height(j)*inverse - of_memory*viscous(j)
               other = other + closed
               amplitude(m) = amplitude(m) + of_memory*memory(j)
            end associate
         end do
         amplitude(m) = amplitude(m) + merge(other*inverse, as_is, other_scale < scale*speed)
      end do
   end subroutine joint_amplitudes

   !> Sums over the modes for all terms at once.
   pure subroutine add_up(terms, modes, parts, state, total)
      !> In whole vectors
      integer, intent(in) :: terms
      integer, intent(in) :: modes
      real(wp), intent(in) :: parts(terms, modes, 3)
      real(wp), intent(in) :: state(modes, 3)
      !> Real and imaginary parts, magnitudes
      real(wp), intent(out) :: total(terms, 3, 3)

      integer :: c, i, m

      total = 0.0_wp
      do i = 1, modes
         !$omp simd
         do m = 1, terms
            do c = 1, 3
               total(m, 1, c) = total(m, 1, c) + parts(m, i, 1)*state(i, c)
               total(m, 2, c) = total(m, 2, c) + parts(m, i, 2)*state(i, c)
               total(m, 3, c) = total(m, 3, c) + parts(m, i, 3)*abs(state(i, c))
            end do
         end do
      end do
   end subroutine add_up

   !> The terms at a time.
   pure function terms_at(modes, amplitude, time) result(term)
      type(joint_modes_t), intent(in) :: modes
      !> With the weight, [count]
      complex(wp), intent(in) :: amplitude(:)
      !> Since the start
      real(wp), intent(in) :: time
      complex(wp) :: term(modes%count)

      real(wp), dimension(size(modes%decay)) :: fall, imaginary_part, less_one

      call find_terms(amplitude, modes%decay, modes%omega, time, term, imaginary_part, less_one, fall)
   end function terms_at

end module joint_terms
