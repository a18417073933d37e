!> Terms exp(s t) of the motion of a beam with several closed compliant contacts: their exponents, shapes, amplitudes,
!> and values at a time t since the start of a phase (docs/theory.md, sections 17 and 18).
module coupled_terms
   use compliant_stop, only: has_same_impedance, impedance_t
   use damped_oscillators, only: lanes, padded
   use exponential_powers, only: find_terms
   use kinds, only: wp
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: coupled_modes_t, allocate_terms, append_terms, enlarge_terms, sort_terms, pad_terms
   public :: coupled_amplitudes, terms_at
   public :: compare_sides, mirror_terms

   !> The terms of one set of closed contacts.
   type :: coupled_modes_t
      !> Impedances of the stops
      type(impedance_t), allocatable :: spring(:)
      !> 2 zeta of stiffness-proportional damping
      real(wp) :: two_zeta = 0.0_wp
      !> alpha of mass-proportional damping, or 2 xi_i W_i of damping ratios xi_i given mode by mode, [modes]
      real(wp), allocatable :: mass_rate(:)
      !> Number of terms; of a complex conjugate pair only the term with Im s > 0 is stored
      integer :: count = 0
      !> Exponents s, and weights: 1 for a real exponent, 2 for a pair, [count]
      complex(wp), allocatable :: exponent(:)
      real(wp), allocatable :: weight(:)
      !> -Re s and Im s, padded with zeros to whole SIMD vectors
      real(wp), allocatable :: decay(:), omega(:)
      !> Force P of each stop, its indentation and its branch force P2 per unit amplitude, [stops, count]
      complex(wp), allocatable :: force(:, :), indentation(:, :), branch(:, :)
      !> Each mode of the beam per unit amplitude, [modes, count], and 1 + 2 zeta s, [count]
      complex(wp), allocatable :: shape(:, :), viscous(:)
      !> Real and imaginary parts of `shape`, [modes, count, 2]
      real(wp), allocatable :: shape_parts(:, :, :)
      !> Weights with which the initial state enters the amplitudes: the heights of the stops and their internal
      !> variables P2 - beta k u (without a branch: -c u), [stops, count], and the modes, [modes, count]
      complex(wp), allocatable :: height_weight(:, :), memory_weight(:, :), mode_weight(:, :)
      !> Real and imaginary parts of `mode_weight`, in whole SIMD vectors, [padded, modes, 2]
      real(wp), allocatable :: weight_parts(:, :, :)
      !> Modes with nodes at all stops, which oscillate independently
      integer, allocatable :: inactive(:)
      !> Displacement and force of static equilibrium per unit height of each stop, [modes, stops], [stops, stops]
      real(wp), allocatable :: static_shape(:, :), static_force(:, :)
   end type coupled_modes_t

contains

   !> Allocate a number of terms.
   pure subroutine allocate_terms(modes, beam, stops, max_terms)
      type(coupled_modes_t), intent(inout) :: modes
      !> Number of modes of the beam
      integer, intent(in) :: beam
      integer, intent(in) :: stops
      !> Maximum number of terms
      integer, intent(in) :: max_terms

      if (allocated(modes%exponent)) deallocate (modes%exponent, modes%weight, modes%viscous, modes%force, &
         modes%indentation, modes%branch, modes%height_weight, modes%memory_weight, modes%shape, modes%mode_weight)
      allocate (modes%exponent(max_terms), modes%weight(max_terms), modes%viscous(max_terms))
      allocate (modes%force(stops, max_terms), modes%indentation(stops, max_terms), modes%branch(stops, max_terms), &
         modes%height_weight(stops, max_terms), modes%memory_weight(stops, max_terms), modes%shape(beam, max_terms), &
         modes%mode_weight(beam, max_terms), source=(0.0_wp, 0.0_wp))
   end subroutine allocate_terms

   !> Enlarge the arrays by a number of terms; the terms so far are copied.
   pure subroutine enlarge_terms(modes, more)
      type(coupled_modes_t), intent(inout) :: modes
      !> Number of additional terms
      integer, intent(in) :: more

      type(coupled_modes_t) :: old

      old = modes
      call allocate_terms(modes, size(old%shape, 1), size(old%force, 1), size(old%exponent) + more)
      associate (n => old%count)
         modes%exponent(:n) = old%exponent(:n)
         modes%weight(:n) = old%weight(:n)
         modes%viscous(:n) = old%viscous(:n)
         modes%force(:, :n) = old%force(:, :n)
         modes%indentation(:, :n) = old%indentation(:, :n)
         modes%branch(:, :n) = old%branch(:, :n)
         modes%height_weight(:, :n) = old%height_weight(:, :n)
         modes%memory_weight(:, :n) = old%memory_weight(:, :n)
         modes%shape(:, :n) = old%shape(:, :n)
         modes%mode_weight(:, :n) = old%mode_weight(:, :n)
      end associate
   end subroutine enlarge_terms

   !> Append the terms of some of the stops.
   pure subroutine append_terms(part, members, modes)
      type(coupled_modes_t), intent(in) :: part
      !> Index of each stop of `part` among all stops
      integer, intent(in) :: members(:)
      type(coupled_modes_t), intent(inout) :: modes

      call enlarge_terms(modes, part%count)
      associate (n => part%count, first => modes%count + 1, last => modes%count + part%count)
         modes%exponent(first:last) = part%exponent(:n)
         modes%weight(first:last) = part%weight(:n)
         modes%viscous(first:last) = part%viscous(:n)
         modes%force(members, first:last) = part%force(:, :n)
         modes%indentation(members, first:last) = part%indentation(:, :n)
         modes%branch(members, first:last) = part%branch(:, :n)
         modes%height_weight(members, first:last) = part%height_weight(:, :n)
         modes%memory_weight(members, first:last) = part%memory_weight(:, :n)
         modes%shape(:, first:last) = part%shape(:, :n)
         modes%mode_weight(:, first:last) = part%mode_weight(:, :n)
         modes%count = last
      end associate
   end subroutine append_terms

   !> Trim the arrays to the number of terms, and sort them by increasing magnitude of the exponent: a search replaces
   !> the last terms by lower bounds, and its steps are long if these are the fast terms (`zero_free_steps`).
   pure subroutine sort_terms(modes)
      type(coupled_modes_t), intent(inout) :: modes

      integer :: order(modes%count)

      order = ascending_order(abs(modes%exponent(:modes%count)))
      modes%exponent = modes%exponent(order)
      modes%weight = modes%weight(order)
      modes%viscous = modes%viscous(order)
      modes%force = modes%force(:, order)
      modes%indentation = modes%indentation(:, order)
      modes%branch = modes%branch(:, order)
      modes%height_weight = modes%height_weight(:, order)
      modes%memory_weight = modes%memory_weight(:, order)
      modes%shape = modes%shape(:, order)
      modes%mode_weight = modes%mode_weight(:, order)
   end subroutine sort_terms

   !> Store copies in whole SIMD vectors for the evaluation of amplitudes and exponentials of all terms.
   pure subroutine pad_terms(modes)
      !> All terms are stored
      type(coupled_modes_t), intent(inout) :: modes

      associate (n => modes%count)
         allocate (modes%decay(padded(n)), modes%omega(padded(n)), source=0.0_wp)
         modes%decay(:n) = -real(modes%exponent, wp)
         modes%omega(:n) = aimag(modes%exponent)
         allocate (modes%weight_parts(padded(n), size(modes%mode_weight, 1), 2), source=0.0_wp)
         modes%weight_parts(:n, :, 1) = transpose(real(modes%mode_weight, wp))
         modes%weight_parts(:n, :, 2) = transpose(aimag(modes%mode_weight))
         allocate (modes%shape_parts(size(modes%shape, 1), n, 2))
         modes%shape_parts(:, :, 1) = real(modes%shape, wp)
         modes%shape_parts(:, :, 2) = aimag(modes%shape)
      end associate
   end subroutine pad_terms

   !> Are two lists of stops the same, apart from the sides of the beam on which the stops are?
   pure subroutine compare_sides(spring, value, other_spring, other_value, place, sign)
      !> Impedances of the stops, [stops], and values of the modes at the stops, [modes, stops]
      type(impedance_t), intent(in) :: spring(:)
      real(wp), intent(in) :: value(:, :)
      !> The other list, as long
      type(impedance_t), intent(in) :: other_spring(:)
      real(wp), intent(in) :: other_value(:, :)
      !> Index of each stop in the other list, 0: it is not there; -1 if it is on the other side there, else 1, [stops]
      integer, intent(out) :: place(:)
      real(wp), intent(out) :: sign(:)

      integer :: i, j

      place = 0
      sign = 1.0_wp
      do j = 1, size(place)
         do i = 1, size(place)
            if (any(place(:j - 1) == i) .or. .not. has_same_impedance(spring(j), other_spring(i))) cycle
            if (any(abs(value(:, j) - other_value(:, i)) > 0.0_wp)) then
               if (any(abs(value(:, j) + other_value(:, i)) > 0.0_wp)) cycle
               sign(j) = -1.0_wp
            end if
            place(j) = i
            exit
         end do
         if (place(j) == 0) return
      end do
   end subroutine compare_sides

   !> Terms with the same stops on other sides of the beam: all forces, indentations and heights at a moved stop change
   !> their signs.
   pure subroutine mirror_terms(from, place, sign, modes)
      type(coupled_modes_t), intent(in) :: from
      !> Index of each stop in `from`, and -1 if the stop is on the other side there, else 1, [stops]
      integer, intent(in) :: place(:)
      real(wp), intent(in) :: sign(:)
      type(coupled_modes_t), intent(out) :: modes

      integer :: j

      modes = from
      do j = 1, size(place)
         modes%spring(j) = from%spring(place(j))
         modes%force(j, :) = sign(j)*from%force(place(j), :)
         modes%indentation(j, :) = sign(j)*from%indentation(place(j), :)
         modes%branch(j, :) = sign(j)*from%branch(place(j), :)
         modes%height_weight(j, :) = sign(j)*from%height_weight(place(j), :)
         modes%memory_weight(j, :) = sign(j)*from%memory_weight(place(j), :)
         modes%static_shape(:, j) = sign(j)*from%static_shape(:, place(j))
         modes%static_force(:, j) = sign*sign(j)*from%static_force(place, place(j))
      end do
   end subroutine mirror_terms

   !> Amplitudes from the state at the start of a phase. A quantity of the motion is its static value plus the sum over
   !> all terms of weight times Re (amplitude value exp(s t)), with `value` the quantity per unit amplitude.
   pure subroutine coupled_amplitudes(square, modes, height, indentation, branch_force, z, v, amplitude)
      !> Squared circular frequencies W_i^2 of the beam's modes
      real(wp), intent(in) :: square(:)
      type(coupled_modes_t), intent(in) :: modes
      !> Heights of the contact surfaces above the static position of the beam, [stops]
      real(wp), intent(in) :: height(:)
      !> Indentation u and branch force P2 at the start, [stops]; the indentation of a stiff stop computed from
      !> displacements would be a rounding error
      real(wp), intent(in) :: indentation(:)
      real(wp), intent(in) :: branch_force(:)
      !> Modal displacements and velocities relative to the static position, [modes]
      real(wp), intent(in) :: z(:)
      real(wp), intent(in) :: v(:)
      !> Amplitudes without the weight, [count]
      complex(wp), intent(out) :: amplitude(:)

      ! columns of `state`: W^2 z, z, v, alpha z
      integer, parameter :: forces = 1, displacements = 2, rates = 3, mass_damping = 4
      complex(wp) :: direct, at_stop, inverse, alternative, sums(4)
      real(wp) :: scale, magnitude, alternative_scale, sizes(4), state(size(z), 4)
      ! sums over the modes for all terms: real part, imaginary part, magnitude (not of v), [padded count, 3, columns of
      ! `state`]
      real(wp) :: total(size(modes%decay), 3, 4)
      ! at the start: P2 - beta k u of a stop with a branch, c u of a stop without one, and k u
      real(wp), dimension(size(height)) :: memory, viscous, elastic
      ! the stop has no branch, so that it may have a damper parallel to the spring
      logical :: has_damper(size(height))
      integer :: j, m

      has_damper = modes%spring%branch_stiffness <= 0.0_wp
      memory = merge(0.0_wp, branch_force - modes%spring%branch_stiffness*indentation, has_damper)
      viscous = merge(modes%spring%viscosity*indentation, 0.0_wp, has_damper)
      elastic = modes%spring%stiffness*indentation
      state(:, forces) = square*z
      state(:, displacements) = z
      state(:, rates) = v
      state(:, mass_damping) = modes%mass_rate*z
      call sum_over_modes(size(modes%decay), size(z), modes%weight_parts, state, total)
      do m = 1, modes%count
         sums = cmplx(total(m, 1, :), total(m, 2, :), wp)
         sizes = total(m, 3, :)
         inverse = 1.0_wp/modes%exponent(m)
         magnitude = abs(modes%decay(m)) + abs(modes%omega(m))
         ! Laplace transform of the heights minus the free motion of the stop points, in two forms, of which the one
         ! with the smaller magnitudes is used. `alternative` follows from `direct` by s (s + 2 zeta W^2 + alpha)/D = 1
         ! - W^2/D, with D = s^2 + (2 zeta W^2 + alpha) s + W^2, and by (k + c s)/s - c = k/s, so that the parts that
         ! cancel for large s appear as the indentation.
         direct = -(modes%exponent(m)*sums(displacements) + sums(mass_damping)) - modes%two_zeta*sums(forces)
         scale = magnitude*sizes(displacements) + sizes(mass_damping) + modes%two_zeta*sizes(forces)
         alternative = sums(forces)
         alternative_scale = sizes(forces)
         amplitude(m) = -sums(rates)
         do j = 1, size(height)
            associate (height_weight => modes%height_weight(j, m), memory_weight => modes%memory_weight(j, m))
               ! magnitudes as |Re| + |Im|
               scale = scale + (abs(real(height_weight, wp)) + abs(aimag(height_weight)))*abs(height(j))/magnitude &
                  + (abs(real(memory_weight, wp)) + abs(aimag(memory_weight)))*abs(viscous(j))
               at_stop = merge(memory_weight*elastic(j), height_weight*indentation(j), has_damper(j))
               alternative_scale = alternative_scale + abs(real(at_stop, wp)) + abs(aimag(at_stop))
               direct = direct + height_weight*height(j)*inverse - memory_weight*viscous(j)
               alternative = alternative + at_stop
               amplitude(m) = amplitude(m) + memory_weight*memory(j)
            end associate
         end do
         amplitude(m) = amplitude(m) + merge(alternative*inverse, direct, alternative_scale < scale*magnitude)
      end do
   end subroutine coupled_amplitudes

   !> Sums over the modes for all terms, for the columns W^2 z, z, v and alpha z of the state.
   pure subroutine sum_over_modes(terms, modes, weight, state, total)
      !> Number of terms in whole SIMD vectors
      integer, intent(in) :: terms
      integer, intent(in) :: modes
      !> Real and imaginary parts
      real(wp), intent(in) :: weight(terms, modes, 2)
      real(wp), intent(in) :: state(modes, 4)
      !> Sums of real parts, imaginary parts, magnitudes (0 for v), [terms, 3, columns of the state]
      real(wp), intent(out) :: total(terms, 3, 4)

      ! the sums of one SIMD vector of terms stay in registers
      real(wp), dimension(lanes) :: real_1, real_2, real_3, real_4, imag_1, imag_2, imag_3, imag_4, &
         size_1, size_2, size_4
      real(wp) :: magnitude
      integer :: first, i, m

      do first = 0, terms - lanes, lanes
         real_1 = 0.0_wp
         real_2 = 0.0_wp
         real_3 = 0.0_wp
         real_4 = 0.0_wp
         imag_1 = 0.0_wp
         imag_2 = 0.0_wp
         imag_3 = 0.0_wp
         imag_4 = 0.0_wp
         size_1 = 0.0_wp
         size_2 = 0.0_wp
         size_4 = 0.0_wp
         do i = 1, modes
            !$omp simd private(magnitude)
            do m = 1, lanes
               real_1(m) = real_1(m) + weight(first + m, i, 1)*state(i, 1)
               real_2(m) = real_2(m) + weight(first + m, i, 1)*state(i, 2)
               real_3(m) = real_3(m) + weight(first + m, i, 1)*state(i, 3)
               real_4(m) = real_4(m) + weight(first + m, i, 1)*state(i, 4)
               imag_1(m) = imag_1(m) + weight(first + m, i, 2)*state(i, 1)
               imag_2(m) = imag_2(m) + weight(first + m, i, 2)*state(i, 2)
               imag_3(m) = imag_3(m) + weight(first + m, i, 2)*state(i, 3)
               imag_4(m) = imag_4(m) + weight(first + m, i, 2)*state(i, 4)
               magnitude = abs(weight(first + m, i, 1)) + abs(weight(first + m, i, 2))
               size_1(m) = size_1(m) + magnitude*abs(state(i, 1))
               size_2(m) = size_2(m) + magnitude*abs(state(i, 2))
               size_4(m) = size_4(m) + magnitude*abs(state(i, 4))
            end do
         end do
         associate (last => first + lanes)
            total(first + 1:last, 1, 1) = real_1
            total(first + 1:last, 1, 2) = real_2
            total(first + 1:last, 1, 3) = real_3
            total(first + 1:last, 1, 4) = real_4
            total(first + 1:last, 2, 1) = imag_1
            total(first + 1:last, 2, 2) = imag_2
            total(first + 1:last, 2, 3) = imag_3
            total(first + 1:last, 2, 4) = imag_4
            total(first + 1:last, 3, 1) = size_1
            total(first + 1:last, 3, 2) = size_2
            total(first + 1:last, 3, 3) = 0.0_wp
            total(first + 1:last, 3, 4) = size_4
         end associate
      end do
   end subroutine sum_over_modes

   !> Values of the terms at one time.
   pure function terms_at(modes, amplitude, time) result(term)
      type(coupled_modes_t), intent(in) :: modes
      !> Amplitudes times the weights of the terms, [count]
      complex(wp), intent(in) :: amplitude(:)
      !> Time since the start of the phase
      real(wp), intent(in) :: time
      complex(wp) :: term(modes%count)

      ! results of `find_terms` that are not needed
      real(wp), dimension(size(modes%decay)) :: decay_factor, imaginary_part, change_factor

      call find_terms(amplitude, modes%decay, modes%omega, time, term, imaginary_part, change_factor, decay_factor)
   end function terms_at

end module coupled_terms
