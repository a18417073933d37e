!> Terms exp(s t) of the motion of a beam with several closed compliant contacts: their exponents, shapes, amplitudes,
!> and values at a time t since the start of a phase (docs/theory.md, sections 17 and 18).
module coupled_terms
   use compliant_stop, only: has_same_dynamic_stiffness, dynamic_stiffness_t
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
      !> Dynamic stiffnesses of the stops
      type(dynamic_stiffness_t), allocatable :: spring(:)
      !> 2 zeta of stiffness-proportional damping
      real(wp) :: two_zeta = 0.0_wp
      !> alpha of mass-proportional damping, or 2 xi_i W_i of damping ratios xi_i given mode by mode, [modes]
      real(wp), allocatable :: mass_rate(:)
      !> Number of terms; of a complex conjugate pair only the term with Im s > 0 is stored
      integer :: count = 0
      !> Exponents s, [count]
      complex(wp), allocatable :: exponent(:)
      !> Weights of the terms: 1 for a real exponent, 2 for a conjugate pair, [count]
      real(wp), allocatable :: weight(:)
      !> -Re s, padded with zeros to whole SIMD vectors
      real(wp), allocatable :: decay(:)
      !> Im s, padded with zeros to whole SIMD vectors
      real(wp), allocatable :: omega(:)
      !> Force P of each stop per unit amplitude, [stops, count]
      complex(wp), allocatable :: force(:, :)
      !> Indentation u of each stop per unit amplitude, [stops, count]
      complex(wp), allocatable :: indentation(:, :)
      !> Branch force P2 of each stop per unit amplitude, [stops, count]
      complex(wp), allocatable :: branch(:, :)
      !> Displacement of each mode of the beam per unit amplitude, [modes, count]
      complex(wp), allocatable :: shape(:, :)
      !> 1 + 2 zeta s, [count]
      complex(wp), allocatable :: viscous(:)
      !> Real and imaginary parts of `shape` in panels of rows (`panels_of`), [lanes, 2, count, panels], shared by terms
      !> with the same stops on other sides
      real(wp), pointer, contiguous :: shape_parts(:, :, :, :) => null()
      !> Weight of the height of each stop in the amplitudes, [stops, count]
      complex(wp), allocatable :: height_weight(:, :)
      !> Weight of the internal variable of each stop, P2 - beta k u (without a branch: -c u), in the amplitudes,
      !> [stops, count]
      complex(wp), allocatable :: memory_weight(:, :)
      !> Weight of the initial state of each mode in the amplitudes, [modes, count]; deallocated after `weight_parts`
      !> has been made
      complex(wp), allocatable :: mode_weight(:, :)
      !> Real and imaginary parts of the transpose of `mode_weight` in panels of rows, [lanes, 2, modes, panels], shared
      !> by terms with the same stops on other sides
      real(wp), pointer, contiguous :: weight_parts(:, :, :, :) => null()
      !> Modes with nodes at all stops, which oscillate independently
      integer, allocatable :: inactive(:)
      !> Displacement of static equilibrium per unit height of each stop, [modes, stops]
      real(wp), allocatable :: static_shape(:, :)
      !> Force of each stop in that equilibrium, [stops, stops]
      real(wp), allocatable :: static_force(:, :)
   end type coupled_modes_t

   !> Column of sums over the modes: real part.
   integer, parameter :: re = 1
   !> Column of sums over the modes: imaginary part.
   integer, parameter :: im = 2
   !> Column of sums over the modes: sum of the magnitudes |Re| + |Im|.
   integer, parameter :: size_of = 3
   !> Number of columns of the state of the modes that these sums are taken of.
   integer, parameter :: columns = 3
   !> First form of the Laplace transform of the heights minus the free motion of the stop points; of the two forms the
   !> one with the smaller magnitudes is used.
   integer, parameter :: direct = 1
   !> Second form. It follows from the first by s (s + 2 zeta W^2 + alpha)/D = 1 - W^2/D, with D = s^2 + (2 zeta W^2 +
   !> alpha) s + W^2, and by (k + c s)/s - c = k/s, so that the parts that cancel for large s appear as the indentation.
   integer, parameter :: alternative = 2

contains

   !> Allocate a number of terms.
   pure subroutine allocate_terms(modes, beam, stops, max_terms)
      type(coupled_modes_t), intent(inout) :: modes
      !> Number of modes of the beam
      integer, intent(in) :: beam
      !> Number of stops
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

   !> Store copies in whole SIMD vectors for the evaluation of amplitudes and exponentials of all terms. The owner of
   !> the terms deallocates `shape_parts` and `weight_parts`.
   pure subroutine pad_terms(modes)
      !> All terms are stored
      type(coupled_modes_t), intent(inout) :: modes

      associate (n => modes%count)
         allocate (modes%decay(padded(n)), modes%omega(padded(n)), source=0.0_wp)
         modes%decay(:n) = -real(modes%exponent, wp)
         modes%omega(:n) = aimag(modes%exponent)
         allocate (modes%weight_parts, source=panels_of(transpose(modes%mode_weight)))
         allocate (modes%shape_parts, source=panels_of(modes%shape))
         deallocate (modes%mode_weight)
      end associate
   end subroutine pad_terms

   !> A matrix in panels of `lanes` rows, one after the other, so that a product reads the memory in order.
   pure function panels_of(matrix) result(panels)
      complex(wp), intent(in) :: matrix(:, :)
      !> Real and imaginary parts, [lanes, 2, columns, panels]; rows beyond those of the matrix are zero
      real(wp), allocatable :: panels(:, :, :, :)

      integer :: i, m

      allocate (panels(lanes, 2, size(matrix, 2), padded(size(matrix, 1))/lanes), source=0.0_wp)
      do m = 1, size(matrix, 2)
         do i = 1, size(matrix, 1)
            panels(mod(i - 1, lanes) + 1, re, m, (i - 1)/lanes + 1) = real(matrix(i, m), wp)
            panels(mod(i - 1, lanes) + 1, im, m, (i - 1)/lanes + 1) = aimag(matrix(i, m))
         end do
      end do
   end function panels_of

   !> Are two lists of stops the same, apart from the sides of the beam on which the stops are?
   pure subroutine compare_sides(spring, value, other_spring, other_value, place, sign)
      !> Dynamic stiffnesses of the stops of one list, [stops]
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      !> Values of the modes at these stops, [modes, stops]
      real(wp), intent(in) :: value(:, :)
      !> Dynamic stiffnesses of the stops of the other list, [stops]
      type(dynamic_stiffness_t), intent(in) :: other_spring(:)
      !> Values of the modes at those stops, [modes, stops]
      real(wp), intent(in) :: other_value(:, :)
      !> Index of each stop in the other list, [stops]; 0: the stop is not there
      integer, intent(out) :: place(:)
      !> -1 if the stop is on the other side of the beam there, else 1, [stops]
      real(wp), intent(out) :: sign(:)

      integer :: i, j

      place = 0
      sign = 1.0_wp
      do j = 1, size(place)
         do i = 1, size(place)
            if (any(place(:j - 1) == i) .or. .not. has_same_dynamic_stiffness(spring(j), other_spring(i))) cycle
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
   subroutine mirror_terms(from, place, sign, modes)
      type(coupled_modes_t), intent(in) :: from
      !> Index of each stop in `from`, [stops]
      integer, intent(in) :: place(:)
      !> -1 if the stop is on the other side of the beam there, else 1, [stops]
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
      !> Indentation u at the start, [stops]; for a stiff stop it must be given, because one computed from displacements
      !> would be a rounding error
      real(wp), intent(in) :: indentation(:)
      !> Branch force P2 at the start, [stops]
      real(wp), intent(in) :: branch_force(:)
      !> Modal displacements relative to the static position, [modes]
      real(wp), intent(in) :: z(:)
      !> Modal velocities, [modes]
      real(wp), intent(in) :: v(:)
      !> Amplitudes without the weight, [count]
      complex(wp), intent(out) :: amplitude(:)

      ! columns of `state`: modal forces W^2 z, displacements z, rates v
      integer, parameter :: forces = 1, displacements = 2, rates = 3
      ! forms of the transform, the second times s, [terms, columns of sums, forms]
      real(wp) :: form(size(modes%decay), size_of, 2)
      ! 1/s, and the magnitude of s, [terms, columns of sums]
      real(wp) :: inverse(size(modes%decay), size_of)
      real(wp) :: square_sum, state(columns, size(modes%weight_parts, 3))
      ! sums over the modes (`total`), and those of alpha z (`mass_damping`), [terms, columns of sums]
      real(wp) :: total(size(modes%decay), size_of, columns), mass_damping(size(modes%decay), size_of)
      integer :: j, m

      state = 0.0_wp
      associate (rate => modes%mass_rate, beam => size(modes%weight_parts, 3))
         mass_damping = 0.0_wp
         if (maxval(rate) > minval(rate)) then
            state(displacements, :size(z)) = rate*z
            call sum_over_modes(size(modes%decay), beam, modes%weight_parts, state, total)
            mass_damping = total(:, :, displacements)
         end if
         state(forces, :size(z)) = square*z
         state(displacements, :size(z)) = z
         state(rates, :size(z)) = v
         call sum_over_modes(size(modes%decay), beam, modes%weight_parts, state, total)
         if (maxval(rate) <= minval(rate)) mass_damping = maxval(rate)*total(:, :, displacements)
      end associate
      ! the modes add -(s + alpha + 2 zeta W^2) z to the direct form, s = -decay + i omega, and W^2 z to the other one
      associate (decay => modes%decay, omega => modes%omega)
         !$omp simd private(square_sum)
         do m = 1, size(decay)
            inverse(m, size_of) = max(abs(decay(m)) + abs(omega(m)), tiny(1.0_wp))
            inverse(m, re) = -decay(m)/inverse(m, size_of)
            inverse(m, im) = -omega(m)/inverse(m, size_of)
            ! the sum of the two squares is at least 1/2, and no square overflows
            square_sum = inverse(m, size_of)*max(inverse(m, re)**2 + inverse(m, im)**2, 0.5_wp)
            inverse(m, re) = inverse(m, re)/square_sum
            inverse(m, im) = inverse(m, im)/square_sum
            form(m, re, direct) = decay(m)*total(m, re, displacements) + omega(m)*total(m, im, displacements) &
               - mass_damping(m, re) - modes%two_zeta*total(m, re, forces)
            form(m, im, direct) = decay(m)*total(m, im, displacements) - omega(m)*total(m, re, displacements) &
               - mass_damping(m, im) - modes%two_zeta*total(m, im, forces)
            form(m, size_of, direct) = inverse(m, size_of)*total(m, size_of, displacements) &
               + mass_damping(m, size_of) + modes%two_zeta*total(m, size_of, forces)
         end do
      end associate
      form(:, :, alternative) = total(:, :, forces)
      amplitude = -cmplx(total(:modes%count, re, rates), total(:modes%count, im, rates), wp)
      do j = 1, size(height)
         call add_stop(modes, j, height(j), indentation(j), branch_force(j), inverse, form, amplitude)
      end do
      !$omp simd
      do m = 1, modes%count
         if (form(m, size_of, alternative) < form(m, size_of, direct)*inverse(m, size_of)) then
            form(m, re, direct) = form(m, re, alternative)*inverse(m, re) - form(m, im, alternative)*inverse(m, im)
            form(m, im, direct) = form(m, re, alternative)*inverse(m, im) + form(m, im, alternative)*inverse(m, re)
         end if
         amplitude(m) = amplitude(m) + cmplx(form(m, re, direct), form(m, im, direct), wp)
      end do
   end subroutine coupled_amplitudes

   !> Add the contributions of a stop to the forms of the transform and to the amplitudes.
   pure subroutine add_stop(modes, j, height, indentation, branch_force, inverse, form, amplitude)
      type(coupled_modes_t), intent(in) :: modes
      !> Index of the stop
      integer, intent(in) :: j
      !> Height of the contact surface above the static position of the beam
      real(wp), intent(in) :: height
      !> Indentation u at the start
      real(wp), intent(in) :: indentation
      !> Branch force P2 at the start
      real(wp), intent(in) :: branch_force
      !> 1/s and magnitudes of s, [terms, columns of sums]
      real(wp), intent(in) :: inverse(:, :)
      !> Both forms of the transform, [terms, columns of sums, forms]
      real(wp), contiguous, intent(inout) :: form(:, :, :)
      !> Amplitudes, to which the contribution of the stop is added, [count]
      complex(wp), contiguous, intent(inout) :: amplitude(:)

      ! factors of the weights: `memory` is the internal variable P2 - beta k u of a stop with a branch, `viscous` minus
      ! the internal variable -c u of a stop without one; the others belong to the alternative form
      real(wp) :: memory, viscous, from_height, from_memory
      real(wp) :: at_re, at_im, height_re, height_im, memory_re, memory_im
      ! the stop has no branch, so that it may have a damper parallel to the spring
      logical :: has_damper
      integer :: m

      associate (spring => modes%spring(j))
         has_damper = spring%branch_stiffness <= 0.0_wp
         memory = merge(0.0_wp, branch_force - spring%branch_stiffness*indentation, has_damper)
         viscous = merge(spring%viscosity*indentation, 0.0_wp, has_damper)
         from_memory = merge(spring%stiffness*indentation, 0.0_wp, has_damper)
         from_height = merge(0.0_wp, indentation, has_damper)
      end associate
      !$omp simd private(at_re, at_im, height_re, height_im, memory_re, memory_im)
      do m = 1, modes%count
         height_re = real(modes%height_weight(j, m), wp)
         height_im = aimag(modes%height_weight(j, m))
         memory_re = real(modes%memory_weight(j, m), wp)
         memory_im = aimag(modes%memory_weight(j, m))
         form(m, re, direct) = form(m, re, direct) + height*(height_re*inverse(m, re) - height_im*inverse(m, im)) &
            - memory_re*viscous
         form(m, im, direct) = form(m, im, direct) + height*(height_re*inverse(m, im) + height_im*inverse(m, re)) &
            - memory_im*viscous
         form(m, size_of, direct) = form(m, size_of, direct) + (abs(height_re) + abs(height_im))*abs(height) &
            /inverse(m, size_of) + (abs(memory_re) + abs(memory_im))*abs(viscous)
         at_re = memory_re*from_memory + height_re*from_height
         at_im = memory_im*from_memory + height_im*from_height
         form(m, re, alternative) = form(m, re, alternative) + at_re
         form(m, im, alternative) = form(m, im, alternative) + at_im
         form(m, size_of, alternative) = form(m, size_of, alternative) + abs(at_re) + abs(at_im)
         amplitude(m) = amplitude(m) + cmplx(memory*memory_re, memory*memory_im, wp)
      end do
   end subroutine add_stop

   !> Sums over the modes for all terms and all columns of the state.
   pure subroutine sum_over_modes(terms, modes, weight, state, total)
      !> Number of terms, padded to whole SIMD vectors
      integer, intent(in) :: terms
      !> Number of modes
      integer, intent(in) :: modes
      !> `weight_parts` of the terms
      real(wp), intent(in) :: weight(lanes, 2, modes, terms/lanes)
      !> Columns of the state
      real(wp), intent(in) :: state(columns, modes)
      !> Sums of real parts, imaginary parts, magnitudes (these without the last column), [terms, 3, columns]
      real(wp), intent(out) :: total(terms, 3, columns)

      ! sums over the modes for one vector of terms, which stay in registers
      real(wp), dimension(lanes) :: im_1, im_2, im_3, re_1, re_2, re_3, size_1, size_2
      integer :: i, m, panel

      do panel = 1, terms/lanes
         re_1 = 0.0_wp
         re_2 = 0.0_wp
         re_3 = 0.0_wp
         im_1 = 0.0_wp
         im_2 = 0.0_wp
         im_3 = 0.0_wp
         size_1 = 0.0_wp
         size_2 = 0.0_wp
         do i = 1, modes
            !$omp simd
            do m = 1, lanes
               re_1(m) = re_1(m) + weight(m, re, i, panel)*state(1, i)
               re_2(m) = re_2(m) + weight(m, re, i, panel)*state(2, i)
               re_3(m) = re_3(m) + weight(m, re, i, panel)*state(3, i)
               im_1(m) = im_1(m) + weight(m, im, i, panel)*state(1, i)
               im_2(m) = im_2(m) + weight(m, im, i, panel)*state(2, i)
               im_3(m) = im_3(m) + weight(m, im, i, panel)*state(3, i)
               size_1(m) = size_1(m) + (abs(weight(m, re, i, panel)) + abs(weight(m, im, i, panel)))*abs(state(1, i))
               size_2(m) = size_2(m) + (abs(weight(m, re, i, panel)) + abs(weight(m, im, i, panel)))*abs(state(2, i))
            end do
         end do
         associate (part => total(lanes*(panel - 1) + 1:lanes*panel, :, :))
            part(:, re, 1) = re_1
            part(:, re, 2) = re_2
            part(:, re, 3) = re_3
            part(:, im, 1) = im_1
            part(:, im, 2) = im_2
            part(:, im, 3) = im_3
            part(:, size_of, 1) = size_1
            part(:, size_of, 2) = size_2
            part(:, size_of, 3) = 0.0_wp
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
