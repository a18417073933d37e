!> Terms exp(s t) of the motion of a beam with several closed compliant contacts: their exponents, shapes and weights
!> (docs/theory.md, sections 17 and 18). Module `term_amplitudes` computes their amplitudes and values.
module coupled_terms
   use compliant_stop, only: has_same_dynamic_stiffness, dynamic_stiffness_t
   use damped_oscillators, only: lanes, padded
   use kinds, only: wp
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: coupled_modes_t, allocate_terms, append_terms, enlarge_terms, sort_terms, pad_terms
   public :: compare_sides, mirror_terms
   public :: re, im, size_of, height_re, height_im, memory_re, memory_im

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
      !> Weight of the height of each stop in the amplitudes, [stops, count]; deallocated after `stop_weights` has been
      !> made
      complex(wp), allocatable :: height_weight(:, :)
      !> Weight of the internal variable of each stop, P2 - beta k u (without a branch: -c u), in the amplitudes,
      !> [stops, count]; deallocated likewise
      complex(wp), allocatable :: memory_weight(:, :)
      !> Real and imaginary parts of both weights, padded with zeros to whole SIMD vectors, [padded terms,
      !> `stop_columns`, stops]
      real(wp), allocatable :: stop_weights(:, :, :)
      !> Real and imaginary part of 1/s, and |Re s| + |Im s|, padded likewise, [padded terms, `size_of`]
      real(wp), allocatable :: inverse(:, :)
      !> Whether `mass_rate` differs between the modes
      logical :: has_own_rates = .false.
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

   !> Column of the real part of a number.
   integer, parameter :: re = 1
   !> Column of the imaginary part of a number.
   integer, parameter :: im = 2
   !> Column of the magnitude |Re| + |Im| of a number, or of the sum of the magnitudes of summands.
   integer, parameter :: size_of = 3
   !> Columns of `stop_weights`.
   integer, parameter :: height_re = 1, height_im = 2, memory_re = 3, memory_im = 4
   !> Number of these columns.
   integer, parameter :: stop_columns = 4

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
      integer :: j

      old = modes
      call allocate_terms(modes, size(old%shape, 1), size(old%force, 1), size(old%exponent) + more)
      modes%count = 0
      call copy_terms(old, [(j, j=1, size(old%force, 1))], modes)
   end subroutine enlarge_terms

   !> Append the terms of some of the stops.
   pure subroutine append_terms(part, members, modes)
      type(coupled_modes_t), intent(in) :: part
      !> Index of each stop of `part` among all stops
      integer, intent(in) :: members(:)
      type(coupled_modes_t), intent(inout) :: modes

      call enlarge_terms(modes, part%count)
      call copy_terms(part, members, modes)
   end subroutine append_terms

   !> Copy the terms of some of the stops behind the terms so far, for which there is room.
   pure subroutine copy_terms(part, members, modes)
      type(coupled_modes_t), intent(in) :: part
      !> Index of each stop of `part` among all stops
      integer, intent(in) :: members(:)
      type(coupled_modes_t), intent(inout) :: modes

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
   end subroutine copy_terms

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
      !> All terms are stored, and `mass_rate` is set
      type(coupled_modes_t), intent(inout) :: modes

      real(wp) :: square_sum
      integer :: j, m

      associate (n => modes%count, stops => size(modes%force, 1))
         allocate (modes%decay(padded(n)), modes%omega(padded(n)), modes%inverse(padded(n), size_of), &
            modes%stop_weights(padded(n), stop_columns, stops), source=0.0_wp)
         modes%decay(:n) = -real(modes%exponent, wp)
         modes%omega(:n) = aimag(modes%exponent)
         do j = 1, stops
            modes%stop_weights(:n, height_re, j) = real(modes%height_weight(j, :), wp)
            modes%stop_weights(:n, height_im, j) = aimag(modes%height_weight(j, :))
            modes%stop_weights(:n, memory_re, j) = real(modes%memory_weight(j, :), wp)
            modes%stop_weights(:n, memory_im, j) = aimag(modes%memory_weight(j, :))
         end do
      end associate
      do m = 1, size(modes%decay)
         associate (inverse => modes%inverse(m, :))
            inverse(size_of) = max(abs(modes%decay(m)) + abs(modes%omega(m)), tiny(1.0_wp))
            inverse(re) = -modes%decay(m)/inverse(size_of)
            inverse(im) = -modes%omega(m)/inverse(size_of)
            ! the sum of the two squares is at least 1/2, and no square overflows
            square_sum = inverse(size_of)*max(inverse(re)**2 + inverse(im)**2, 0.5_wp)
            inverse(:im) = inverse(:im)/square_sum
         end associate
      end do
      modes%has_own_rates = maxval(modes%mass_rate) > minval(modes%mass_rate)
      allocate (modes%weight_parts, source=panels_of(transpose(modes%mode_weight)))
      allocate (modes%shape_parts, source=panels_of(modes%shape))
      deallocate (modes%mode_weight, modes%height_weight, modes%memory_weight)
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

   !> Find whether two lists of stops are the same, apart from the sides of the beam on which the stops are.
   pure subroutine compare_sides(spring, value, other_spring, other_value, place, sign)
      !> Dynamic stiffnesses of the stops of one list, [stops]
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      !> Values of the modes at these stops, [modes, stops]
      real(wp), intent(in) :: value(:, :)
      !> Dynamic stiffnesses of the stops of the other list, [stops]
      type(dynamic_stiffness_t), intent(in) :: other_spring(:)
      !> Values of the modes at those stops, [modes, stops]
      real(wp), intent(in) :: other_value(:, :)
      !> Index of each stop in the other list, [stops]; 0: the other list does not have the stop
      integer, intent(out) :: place(:)
      !> -1 if the stop in the other list is on the other side of the beam, else 1, [stops]
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
      !> -1 if the stop in the other list is on the other side of the beam, else 1, [stops]
      real(wp), intent(in) :: sign(:)
      type(coupled_modes_t), intent(out) :: modes

      integer :: j

      modes = from
      do j = 1, size(place)
         modes%spring(j) = from%spring(place(j))
         modes%force(j, :) = sign(j)*from%force(place(j), :)
         modes%indentation(j, :) = sign(j)*from%indentation(place(j), :)
         modes%branch(j, :) = sign(j)*from%branch(place(j), :)
         modes%stop_weights(:, :, j) = sign(j)*from%stop_weights(:, :, place(j))
         modes%static_shape(:, j) = sign(j)*from%static_shape(:, place(j))
         modes%static_force(:, j) = sign*sign(j)*from%static_force(place, place(j))
      end do
   end subroutine mirror_terms

end module coupled_terms
