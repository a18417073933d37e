!> Amplitudes of the terms exp(s t) of a motion, and values of the terms at a time t since the start of a phase
!> (docs/theory.md, sections 17 and 18).
module term_amplitudes
   use coupled_terms, only: coupled_modes_t, height_im, height_re, im, memory_im, memory_re, re, size_of
   use damped_oscillators, only: lanes
   use exponential_powers, only: find_terms
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: coupled_amplitudes, terms_at

   !> Number of columns of the state of the modes; each column is summed over the modes.
   integer, parameter :: columns = 3
   !> First form of the Laplace transform of the heights minus the free motion of the stop points; of the two forms the
   !> one with the smaller magnitudes is used.
   integer, parameter :: direct = 1
   !> Second form. It follows from the first by s (s + 2 zeta W^2 + alpha)/D = 1 - W^2/D, with D = s^2 + (2 zeta W^2 +
   !> alpha) s + W^2, and by (k + c s)/s - c = k/s, so that the parts that cancel for large s appear as the indentation.
   integer, parameter :: alternative = 2

contains

   !> Amplitudes from the state at the start of a phase. A quantity of the motion is its static value plus the sum over
   !> all terms of weight times Re (amplitude value exp(s t)), with `value` the quantity per unit amplitude.
   pure subroutine coupled_amplitudes(square, modes, height, indentation, branch_force, z, v, amplitude, velocity)
      !> Squared circular frequencies W_i^2 of the beam's modes
      real(wp), intent(in) :: square(:)
      type(coupled_modes_t), intent(in) :: modes
      !> Heights of the contact surfaces above the static position of the beam, [stops]
      real(wp), intent(in) :: height(:)
      !> Indentation u at the start, [stops]; the indentation of a stiff stop must be given, because displacements would
      !> give only its rounding error
      real(wp), intent(in) :: indentation(:)
      !> Branch force P2 at the start, [stops]
      real(wp), intent(in) :: branch_force(:)
      !> Modal displacements relative to the static position, [modes]
      real(wp), intent(in) :: z(:)
      !> Modal velocities, [modes]
      real(wp), intent(in) :: v(:)
      !> Amplitudes without the weight, [count]
      complex(wp), intent(out) :: amplitude(:)
      !> Velocities of the stop points at the start, [stops]; those of rigid stops must be given as zero, because modal
      !> velocities would give only their rounding error. Default: by the modal velocities
      real(wp), intent(in), optional :: velocity(:)

      ! columns of `state`: modal forces W^2 z, displacements z, rates v
      integer, parameter :: forces = 1, displacements = 2, rates = 3
      ! forms of the transform, the second times s, [terms, columns of sums, forms]
      real(wp) :: form(size(modes%decay), size_of, 2)
      ! real and imaginary parts of the amplitudes, [terms, 2]
      real(wp) :: part(size(modes%decay), im)
      real(wp) :: state(columns, size(modes%weight_parts, 3))
      ! sums over the modes (`total`), and those of alpha z (`mass_damping`), [terms, columns of sums]
      real(wp) :: total(size(modes%decay), size_of, columns), mass_damping(size(modes%decay), size_of)
      integer :: j, m

      state = 0.0_wp
      associate (beam => size(modes%weight_parts, 3))
         if (modes%has_own_rates) then
            state(displacements, :size(z)) = modes%mass_rate*z
            call sum_over_modes(size(modes%decay), beam, modes%weight_parts, state, total)
            mass_damping = total(:, :, displacements)
         end if
         state(forces, :size(z)) = square*z
         state(displacements, :size(z)) = z
         state(rates, :size(z)) = v
         call sum_over_modes(size(modes%decay), beam, modes%weight_parts, state, total)
         ! the rate that all modes have; a set without modes has no rate
         if (.not. modes%has_own_rates) mass_damping = sum(modes%mass_rate(:min(1, size(modes%mass_rate)))) &
            *total(:, :, displacements)
      end associate
      ! the modes add -(s + alpha + 2 zeta W^2) z to the direct form, s = -decay + i omega, and W^2 z to the alternative
      ! form
      associate (decay => modes%decay, omega => modes%omega)
         !$omp simd
         do m = 1, size(decay)
            form(m, re, direct) = decay(m)*total(m, re, displacements) + omega(m)*total(m, im, displacements) &
               - mass_damping(m, re) - modes%two_zeta*total(m, re, forces)
            form(m, im, direct) = decay(m)*total(m, im, displacements) - omega(m)*total(m, re, displacements) &
               - mass_damping(m, im) - modes%two_zeta*total(m, im, forces)
            form(m, size_of, direct) = modes%inverse(m, size_of)*total(m, size_of, displacements) &
               + mass_damping(m, size_of) + modes%two_zeta*total(m, size_of, forces)
         end do
      end associate
      form(:, :, alternative) = total(:, :, forces)
      part = -total(:, :im, rates)
      if (present(velocity)) then
         part = 0.0_wp
         call add_rates(square, modes, v, velocity, part)
      end if
      do j = 1, size(height)
         call add_stop(size(modes%decay), modes, j, height(j), indentation(j), branch_force(j), form, part)
      end do
      call add_forms(size(modes%decay), modes%inverse, form, part)
      do m = 1, modes%count
         amplitude(m) = cmplx(part(m, re), part(m, im), wp)
      end do
   end subroutine coupled_amplitudes

   !> Add minus the sums of the modal velocities to the amplitudes, in the form that has the smaller magnitudes. The
   !> second form follows from 1/D = (1 - (2 zeta W^2 + alpha) s/D - W^2/D)/s^2: the parts that cancel for large s
   !> appear as the velocities of the stop points.
   pure subroutine add_rates(square, modes, v, velocity, part)
      !> Squared circular frequencies W_i^2 of the beam's modes
      real(wp), intent(in) :: square(:)
      type(coupled_modes_t), intent(in) :: modes
      !> Modal velocities, [modes]
      real(wp), intent(in) :: v(:)
      !> Velocities of the stop points, [stops]
      real(wp), intent(in) :: velocity(:)
      !> Amplitudes, [terms, 2]
      real(wp), intent(inout) :: part(:, :)

      ! both forms, the second times s, [terms, columns of sums, forms]
      real(wp) :: form(size(modes%decay), size_of, 2)
      real(wp) :: state(columns, size(modes%weight_parts, 3))
      real(wp) :: total(size(modes%decay), size_of, columns)
      integer :: j

      state = 0.0_wp
      state(1, :size(v)) = v
      state(2, :size(v)) = (modes%two_zeta*square + modes%mass_rate)*v
      call sum_over_modes(size(form, 1), size(state, 2), modes%weight_parts, state, total)
      form(:, :im, direct) = -total(:, :im, 1)
      form(:, size_of, direct) = total(:, size_of, 1)
      form(:, :, alternative) = total(:, :, 2)
      state(1, :size(v)) = square*v
      call sum_over_modes(size(form, 1), size(state, 2), modes%weight_parts, state, total)
      associate (elastic => total(:, :, 1), inverse => modes%inverse)
         do j = 1, size(velocity)
            associate (weight => modes%stop_weights(:, :, j))
               elastic(:, re) = elastic(:, re) - weight(:, height_re)*velocity(j)
               elastic(:, im) = elastic(:, im) - weight(:, height_im)*velocity(j)
               elastic(:, size_of) = elastic(:, size_of) + (abs(weight(:, height_re)) + abs(weight(:, height_im))) &
                  *abs(velocity(j))
            end associate
         end do
         form(:, re, alternative) = form(:, re, alternative) + elastic(:, re)*inverse(:, re) &
            - elastic(:, im)*inverse(:, im)
         form(:, im, alternative) = form(:, im, alternative) + elastic(:, re)*inverse(:, im) &
            + elastic(:, im)*inverse(:, re)
         form(:, size_of, alternative) = form(:, size_of, alternative) + elastic(:, size_of)/inverse(:, size_of)
      end associate
      call add_forms(size(form, 1), modes%inverse, form, part)
   end subroutine add_rates

   !> Add the contributions of a stop to the forms of the transform and to the amplitudes.
   pure subroutine add_stop(terms, modes, j, height, indentation, branch_force, form, part)
      !> Number of terms, padded to whole SIMD vectors
      integer, intent(in) :: terms
      type(coupled_modes_t), intent(in) :: modes
      !> Index of the stop
      integer, intent(in) :: j
      !> Height of the contact surface above the static position of the beam
      real(wp), intent(in) :: height
      !> Indentation u at the start
      real(wp), intent(in) :: indentation
      !> Branch force P2 at the start
      real(wp), intent(in) :: branch_force
      !> Both forms of the transform, [terms, columns of sums, forms]
      real(wp), intent(inout) :: form(terms, size_of, 2)
      !> Amplitudes, to which the contribution of the stop is added, [terms, 2]
      real(wp), intent(inout) :: part(terms, im)

      ! factors of the weights: `memory` is the internal variable P2 - beta k u of a stop with a branch, `viscous` minus
      ! the internal variable -c u of a stop without one; the others belong to the alternative form
      real(wp) :: memory, viscous, from_height, from_memory
      real(wp) :: at_re, at_im
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
      associate (weight => modes%stop_weights(:, :, j), inverse => modes%inverse)
         !$omp simd private(at_re, at_im)
         do m = 1, terms
            form(m, re, direct) = form(m, re, direct) + height*(weight(m, height_re)*inverse(m, re) &
               - weight(m, height_im)*inverse(m, im)) - weight(m, memory_re)*viscous
            form(m, im, direct) = form(m, im, direct) + height*(weight(m, height_re)*inverse(m, im) &
               + weight(m, height_im)*inverse(m, re)) - weight(m, memory_im)*viscous
            form(m, size_of, direct) = form(m, size_of, direct) + (abs(weight(m, height_re)) &
               + abs(weight(m, height_im)))*abs(height)/inverse(m, size_of) + (abs(weight(m, memory_re)) &
               + abs(weight(m, memory_im)))*abs(viscous)
            at_re = weight(m, memory_re)*from_memory + weight(m, height_re)*from_height
            at_im = weight(m, memory_im)*from_memory + weight(m, height_im)*from_height
            form(m, re, alternative) = form(m, re, alternative) + at_re
            form(m, im, alternative) = form(m, im, alternative) + at_im
            form(m, size_of, alternative) = form(m, size_of, alternative) + abs(at_re) + abs(at_im)
            part(m, re) = part(m, re) + memory*weight(m, memory_re)
            part(m, im) = part(m, im) + memory*weight(m, memory_im)
         end do
      end associate
   end subroutine add_stop

   !> Add to the amplitudes the form of the transform that has the smaller magnitudes.
   pure subroutine add_forms(terms, inverse, form, part)
      !> Number of terms, padded to whole SIMD vectors
      integer, intent(in) :: terms
      !> 1/s, and magnitudes of s, [terms, columns of sums]
      real(wp), intent(in) :: inverse(terms, size_of)
      !> Both forms of the transform, [terms, columns of sums, forms]
      real(wp), intent(in) :: form(terms, size_of, 2)
      !> Amplitudes, [terms, 2]
      real(wp), intent(inout) :: part(terms, im)

      real(wp) :: other_re, other_im
      integer :: m

      !$omp simd private(other_re, other_im)
      do m = 1, terms
         other_re = form(m, re, alternative)*inverse(m, re) - form(m, im, alternative)*inverse(m, im)
         other_im = form(m, re, alternative)*inverse(m, im) + form(m, im, alternative)*inverse(m, re)
         associate (is_smaller => form(m, size_of, alternative) < form(m, size_of, direct)*inverse(m, size_of))
            part(m, re) = part(m, re) + merge(other_re, form(m, re, direct), is_smaller)
            part(m, im) = part(m, im) + merge(other_im, form(m, im, direct), is_smaller)
         end associate
      end do
   end subroutine add_forms

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
      !> Sums of real parts, imaginary parts, and magnitudes (0 in the last column), [terms, 3, columns]
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

end module term_amplitudes
