!> The beam in contact with the three-element stop: its natural exponents, found from the secular equation.
!>
!> With the free modes b_i at the stop and D_i(s) = s^2 + W_i^2 (1 + 2 zeta s), the exponents are the roots of
!>     1 + k (1 + beta s/(s + nu)) sum b_i^2/D_i(s) = 0,    nu = beta k/c,
!> and everything that moves is a sum of exp(s t) over them, its amplitudes the residues of the Laplace transform.
!> All roots are found at once by the Ehrlich-Aberth iteration (Bini, Numer. Algorithms 13 (1996) 179), from
!> the modes of the beam with the stop's spring attached. Near s = -1/(2 zeta), where the heavily damped modes
!> crowd, roots are kept by e = 1 + 2 zeta s, whose leading digits would be lost in s.
module contact_modes
   use damped_oscillators, only: propagate
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use modal_beam, only: attach_spring, modal_beam_t
   use stop_models, only: three_element_t
   implicit none (type, external)
   private
   public :: contact_modes_t, make_contact_modes, contact_amplitudes, contact_state
   public :: contact_losses_t, make_contact_losses, contact_losses

   type :: contact_modes_t
      logical :: made = .false.
      !> Number of exponents; of a conjugate pair only the one with Im s > 0 is kept
      integer :: count = 0
      !> Exponents s, and 1 + 2 zeta s, [count]
      complex(wp), allocatable :: exponent(:)
      complex(wp), allocatable :: relative(:)
      !> 1 for a real exponent, 2 for a conjugate pair, [count]
      real(wp), allocatable :: weight(:)
      !> d/ds of (s + nu) (1 + ...) at the root, [count]
      complex(wp), allocatable :: derivative(:)
      !> b_i/D_i(s): displacement of free mode i per unit of P, [free, count]
      complex(wp), allocatable :: shape(:, :)
      !> Free modes with a node at the stop: they swing on as if alone
      integer, allocatable :: inactive(:)
      !> Stop point and tip per unit of P, [count]
      complex(wp), allocatable :: stop_value(:)
      complex(wp), allocatable :: tip_value(:)
      !> The tip in the static shape of P = 1
      real(wp) :: static_tip = 0.0_wp
      !> Condition of each exponent: 1 for well separated ones, infinite where two coalesce, [count]
      real(wp), allocatable :: condition(:)
   end type contact_modes_t

   !> Dissipation per pair of exponents: power = Re sum (plain A_m A_n + conjugate A_m conj(A_n))/2, [count, count].
   type :: contact_losses_t
      !> In the beam: 2 zeta sum W_i^2 v_i^2
      complex(wp), allocatable :: beam_plain(:, :), beam_conjugate(:, :)
      !> In the damper: nu P2^2/(beta k)
      complex(wp), allocatable :: stop_plain(:, :), stop_conjugate(:, :)
   end type contact_losses_t

contains

   !> Find all exponents.
   subroutine make_contact_modes(beam, zeta, spring, modes, error)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> zeta
      real(wp), intent(in) :: zeta
      !> The stop
      type(three_element_t), intent(in) :: spring
      !> The exponents and their shapes
      type(contact_modes_t), intent(out) :: modes
      !> Set when the iteration does not converge
      type(failure_t), allocatable, intent(inout) :: error

      complex(wp), allocatable :: s(:), e(:)
      integer, allocatable :: active(:), keep(:)
      integer :: i, m, n
      complex(wp) :: value, slope
      logical :: converged

      associate (b => beam%stop_value)
         allocate (active, source=pack([(i, i=1, beam%count)], abs(b) > 1.0e-14_wp*maxval(abs(b))))
         allocate (modes%inactive, source=pack([(i, i=1, beam%count)], abs(b) <= 1.0e-14_wp*maxval(abs(b))))
      end associate
      n = 2*size(active) + merge(1, 0, spring%branch_stiffness > 0.0_wp)
      allocate (s(n), e(n))
      call first_guess(beam, active, zeta, spring, s)
      e = 1.0_wp + 2.0_wp*zeta*s
      call find_all_roots(beam%oscillators%square(active), beam%stop_value(active)**2, zeta, spring, s, e, converged)
      if (.not. converged) then
         call fail(error, status_run_failed, 'the exponents of the contact with the three-element stop were not found')
         return
      end if
      allocate (keep, source=pack([(i, i=1, n)], aimag(s) >= 0.0_wp))
      modes%made = .true.
      modes%count = size(keep)
      allocate (modes%exponent(size(keep)), modes%relative(size(keep)))
      modes%exponent(:) = s(keep)
      modes%relative(:) = e(keep)
      allocate (modes%weight(size(keep)), modes%derivative(size(keep)), modes%condition(size(keep)))
      allocate (modes%shape(beam%count, size(keep)))
      modes%shape = (0.0_wp, 0.0_wp)
      do m = 1, modes%count
         modes%weight(m) = merge(2.0_wp, 1.0_wp, aimag(modes%exponent(m)) > 0.0_wp)
         associate (sm => modes%exponent(m), em => modes%relative(m), w2 => beam%oscillators%square(active), &
                    b => beam%stop_value(active))
            modes%shape(active, m) = b/(sm**2 + w2*em)
            call secular(w2, b**2, zeta, spring, sm, em, value, slope, modes%condition(m))
            modes%derivative(m) = slope
         end associate
      end do
      allocate (modes%stop_value(modes%count), modes%tip_value(modes%count))
      do m = 1, modes%count
         modes%stop_value(m) = sum(beam%stop_value*modes%shape(:, m))
         modes%tip_value(m) = sum(beam%tip_value*modes%shape(:, m))
      end do
      modes%static_tip = sum(beam%tip_value*beam%stop_value/beam%oscillators%square)
   end subroutine make_contact_modes

   !> Exponents to start from: each mode of the beam with the spring attached keeps its share of the damping.
   subroutine first_guess(beam, active, zeta, spring, s)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> Modes that move the stop point
      integer, intent(in) :: active(:)
      !> zeta
      real(wp), intent(in) :: zeta
      !> The stop
      type(three_element_t), intent(in) :: spring
      !> First guess, conjugate pairs side by side, the branch's real exponent last
      complex(wp), intent(out) :: s(:)

      real(wp), dimension(size(active)) :: square, at_stop
      real(wp) :: stiff, damping, root, share
      integer :: j

      stiff = spring%stiffness
      call attach_spring(beam%oscillators%square(active), beam%stop_value(active), stiff, square, at_stop)
      if (spring%branch_stiffness > 0.0_wp) then
         ! the branch is stiff for what is faster than it relaxes
         if (sqrt(square(size(active))) > spring%relaxation_rate) then
            stiff = spring%stiffness + spring%branch_stiffness
            call attach_spring(beam%oscillators%square(active), beam%stop_value(active), stiff, square, at_stop)
         end if
      end if
      do j = 1, size(active)
         damping = zeta*max(square(j) - stiff*at_stop(j)**2, 0.0_wp)
         if (spring%branch_stiffness > 0.0_wp) then
            share = spring%relaxation_rate**2/(spring%relaxation_rate**2 + square(j))
            damping = damping + 0.5_wp*spring%branch_stiffness*at_stop(j)**2*share/spring%relaxation_rate
         end if
         if (damping**2 < square(j)) then
            root = sqrt(square(j) - damping**2)
            s(2*j - 1) = cmplx(-damping, root, wp)
            s(2*j) = conjg(s(2*j - 1))
         else
            root = damping + sqrt(damping**2 - square(j))
            s(2*j - 1) = -root
            s(2*j) = -square(j)/root
         end if
      end do
      if (spring%branch_stiffness > 0.0_wp) then
         s(size(s)) = -spring%relaxation_rate*(1.0_wp + spring%stiffness*beam%flexibility)/ &
                      (1.0_wp + (spring%stiffness + spring%branch_stiffness)*beam%flexibility)
      end if
   end subroutine first_guess

   !> Ehrlich-Aberth iteration on all roots at once.
   pure subroutine find_all_roots(square, weight, zeta, spring, s, e, converged)
      !> W_i^2, [modes]
      real(wp), intent(in) :: square(:)
      !> b_i^2, [modes]
      real(wp), intent(in) :: weight(:)
      !> zeta
      real(wp), intent(in) :: zeta
      !> The stop
      type(three_element_t), intent(in) :: spring
      !> Roots: first guess in, roots out
      complex(wp), intent(inout) :: s(:)
      !> 1 + 2 zeta s, kept apart
      complex(wp), intent(inout) :: e(:)
      !> All corrections came down to rounding
      logical, intent(out) :: converged

      integer, parameter :: iteration_cap = 500
      complex(wp) :: value, slope, newton, repulsion, step, difference
      logical :: done(size(s))
      integer :: iteration, m, j, partner
      real(wp) :: condition, size_of_step

      done = .false.
      call separate(s, e, zeta)
      do iteration = 1, iteration_cap
         do m = 1, size(s)
            if (done(m)) cycle
            call secular(square, weight, zeta, spring, s(m), e(m), value, slope, condition)
            ! polynomial p = value * product of D_i; its logarithmic derivative
            repulsion = slope/value
            do j = 1, size(square)
               repulsion = repulsion + (2.0_wp*s(m) + 2.0_wp*zeta*square(j))/(s(m)**2 + square(j)*e(m))
            end do
            do j = 1, size(s)
               if (j == m) cycle
               difference = s(m) - s(j)
               if (zeta > 0.0_wp .and. abs(e(m)) < 0.5_wp .and. abs(e(j)) < 0.5_wp) &
                  difference = (e(m) - e(j))/(2.0_wp*zeta)
               repulsion = repulsion - 1.0_wp/difference
            end do
            newton = 1.0_wp/repulsion
            step = -newton
            size_of_step = abs(step)
            s(m) = s(m) + step
            e(m) = e(m) + 2.0_wp*zeta*step
            if (abs(e(m)) > 0.5_wp) e(m) = 1.0_wp + 2.0_wp*zeta*s(m)
            if (abs(e(m)) < 0.5_wp) s(m) = (e(m) - 1.0_wp)/(2.0_wp*zeta)
            if (size_of_step <= 4.0_wp*epsilon(1.0_wp)*max(1.0_wp, 0.1_wp*condition)*abs(s(m)) .and. &
                2.0_wp*zeta*size_of_step <= 1.0e-13_wp*max(1.0_wp, condition)*abs(e(m))) done(m) = .true.
         end do
         if (all(done)) exit
      end do
      converged = all(done)
      if (.not. converged) return
      ! conjugate pairs exactly conjugate, real roots exactly real
      do m = 1, size(s)
         if (abs(aimag(s(m))) <= 1.0e-11_wp*abs(s(m)) .and. abs(aimag(e(m))) <= 1.0e-8_wp*abs(e(m))) then
            partner = 0
            do j = 1, size(s)
               if (j /= m .and. abs(s(j) - conjg(s(m))) <= 0.1_wp*abs(aimag(s(m)))) partner = j
            end do
            if (partner == 0) then
               s(m) = real(s(m), wp)
               e(m) = real(e(m), wp)
            end if
         end if
      end do
      converged = modulo(count(abs(aimag(s)) > 0.0_wp), 2) == 0 .and. &
                  count(aimag(s) > 0.0_wp) == count(aimag(s) < 0.0_wp)
   end subroutine find_all_roots

   !> Move guesses apart that coincide.
   pure subroutine separate(s, e, zeta)
      !> Guesses
      complex(wp), intent(inout) :: s(:)
      complex(wp), intent(inout) :: e(:)
      !> zeta
      real(wp), intent(in) :: zeta

      integer :: m, j

      do m = 2, size(s)
         do j = 1, m - 1
            if (abs(s(m) - s(j)) <= 1.0e-6_wp*abs(s(m))) then
               s(m) = s(m)*cmplx(1.0_wp + 1.0e-3_wp*real(m, wp), 0.0_wp, wp)
               e(m) = 1.0_wp + 2.0_wp*zeta*s(m)
            end if
         end do
      end do
   end subroutine separate

   !> (s + nu) (1 + k (1 + beta s/(s + nu)) G(s)) and its derivative; without branch 1 + k G(s).
   pure subroutine secular(square, weight, zeta, spring, s, e, value, slope, condition)
      !> W_i^2 and b_i^2, [modes]
      real(wp), intent(in) :: square(:)
      real(wp), intent(in) :: weight(:)
      !> zeta
      real(wp), intent(in) :: zeta
      !> The stop
      type(three_element_t), intent(in) :: spring
      !> Where, and 1 + 2 zeta s
      complex(wp), intent(in) :: s
      complex(wp), intent(in) :: e
      !> Value and derivative
      complex(wp), intent(out) :: value
      complex(wp), intent(out) :: slope
      !> How much the sum for the derivative cancels, >= 1
      real(wp), intent(out) :: condition

      complex(wp) :: g, g_slope, d, numerator
      real(wp) :: size_of_slope
      integer :: i

      g = (0.0_wp, 0.0_wp)
      g_slope = (0.0_wp, 0.0_wp)
      size_of_slope = 0.0_wp
      do i = 1, size(square)
         d = 1.0_wp/(s**2 + square(i)*e)
         g = g + weight(i)*d
         d = weight(i)*d**2*(2.0_wp*s + 2.0_wp*zeta*square(i))
         g_slope = g_slope - d
         size_of_slope = size_of_slope + abs(d)
      end do
      if (spring%branch_stiffness > 0.0_wp) then
         numerator = (spring%stiffness + spring%branch_stiffness)*s + spring%stiffness*spring%relaxation_rate
         value = s + spring%relaxation_rate + numerator*g
         slope = 1.0_wp + (spring%stiffness + spring%branch_stiffness)*g + numerator*g_slope
         size_of_slope = 1.0_wp + (spring%stiffness + spring%branch_stiffness)*abs(g) + abs(numerator)*size_of_slope
      else
         value = 1.0_wp + spring%stiffness*g
         slope = spring%stiffness*g_slope
         size_of_slope = spring%stiffness*size_of_slope
      end if
      condition = size_of_slope/max(abs(slope), tiny(1.0_wp)*max(size_of_slope, 1.0_wp))
   end subroutine secular

   !> Amplitudes c of P(t) = P_static + sum weight Re(c exp(s t)) from the state at the start of a contact.
   pure subroutine contact_amplitudes(beam, zeta, spring, modes, surface, q, v, branch_force, static_force, amplitude)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> zeta
      real(wp), intent(in) :: zeta
      !> The stop
      type(three_element_t), intent(in) :: spring
      !> Its exponents
      type(contact_modes_t), intent(in) :: modes
      !> delta
      real(wp), intent(in) :: surface
      !> Modal state
      real(wp), intent(in) :: q(:)
      real(wp), intent(in) :: v(:)
      !> P2, the force in the branch
      real(wp), intent(in) :: branch_force
      !> The force that remains
      real(wp), intent(out) :: static_force
      !> c, [modes%count]
      complex(wp), intent(out) :: amplitude(:)

      real(wp) :: indentation
      complex(wp) :: start, forcing
      integer :: m

      indentation = surface - sum(beam%stop_value*q)
      static_force = spring%stiffness*surface/(1.0_wp + spring%stiffness*beam%flexibility)
      do m = 1, modes%count
         associate (s => modes%exponent(m))
            ! the free motion of the stop point, transformed
            start = sum(modes%shape(:, m)*((s + 2.0_wp*zeta*beam%oscillators%square)*q + v))
            forcing = surface/s - start
            if (spring%branch_stiffness > 0.0_wp) then
               forcing = forcing*((spring%stiffness + spring%branch_stiffness)*s &
                                  + spring%stiffness*spring%relaxation_rate) &
                         + branch_force - spring%branch_stiffness*indentation
            else
               forcing = spring%stiffness*forcing
            end if
            amplitude(m) = forcing/modes%derivative(m)
         end associate
      end do
   end subroutine contact_amplitudes

   !> Modal state at a time after the start of a contact.
   pure subroutine contact_state(beam, modes, static_force, amplitude, q0, v0, t, q, v)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> Exponents and shapes
      type(contact_modes_t), intent(in) :: modes
      !> From `contact_amplitudes`
      real(wp), intent(in) :: static_force
      complex(wp), intent(in) :: amplitude(:)
      !> Modal state at the start; only the modes with a node at the stop are read
      real(wp), intent(in) :: q0(:)
      real(wp), intent(in) :: v0(:)
      !> Time
      real(wp), intent(in) :: t
      !> Modal state
      real(wp), intent(out) :: q(:)
      real(wp), intent(out) :: v(:)

      complex(wp) :: factor
      real(wp), dimension(size(q0)) :: alone, alone_rate
      integer :: m

      q = beam%stop_value/beam%oscillators%square*static_force
      v = 0.0_wp
      do m = 1, modes%count
         factor = modes%weight(m)*amplitude(m)*exp(modes%exponent(m)*t)
         q = q + real(factor*modes%shape(:, m), wp)
         v = v + real(factor*modes%exponent(m)*modes%shape(:, m), wp)
      end do
      if (size(modes%inactive) == 0) return
      call propagate(beam%oscillators, t, q0, v0, alone, alone_rate)
      q(modes%inactive) = alone(modes%inactive)
      v(modes%inactive) = alone_rate(modes%inactive)
   end subroutine contact_state

   !> What the ledger needs of each pair of exponents.
   pure subroutine make_contact_losses(beam, zeta, spring, modes, losses)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> zeta
      real(wp), intent(in) :: zeta
      !> The stop
      type(three_element_t), intent(in) :: spring
      !> Exponents and shapes
      type(contact_modes_t), intent(in) :: modes
      !> The pairs
      type(contact_losses_t), intent(out) :: losses

      complex(wp) :: rate(beam%count, modes%count), branch(modes%count)
      real(wp) :: factor
      integer :: m, n

      associate (k => modes%count)
         allocate (losses%beam_plain(k, k), losses%beam_conjugate(k, k), losses%stop_plain(k, k), &
                   losses%stop_conjugate(k, k))
      end associate
      factor = 0.0_wp
      if (spring%branch_stiffness > 0.0_wp) factor = spring%relaxation_rate/spring%branch_stiffness
      ! P2 = P - k u, and u = -y_c where the static part is left out
      branch = 1.0_wp + spring%stiffness*modes%stop_value
      do m = 1, modes%count
         rate(:, m) = sqrt(2.0_wp*zeta*beam%oscillators%square)*modes%exponent(m)*modes%shape(:, m)
      end do
      do n = 1, modes%count
         do m = 1, modes%count
            losses%beam_plain(m, n) = sum(rate(:, m)*rate(:, n))
            losses%beam_conjugate(m, n) = sum(rate(:, m)*conjg(rate(:, n)))
            losses%stop_plain(m, n) = factor*branch(m)*branch(n)
            losses%stop_conjugate(m, n) = factor*branch(m)*conjg(branch(n))
         end do
      end do
   end subroutine make_contact_losses

   !> Dissipated from the start of a contact up to a time, integrated in closed form.
   pure subroutine contact_losses(beam, modes, losses, amplitude, q0, v0, t, lost)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> Exponents
      type(contact_modes_t), intent(in) :: modes
      !> From `make_contact_losses`
      type(contact_losses_t), intent(in) :: losses
      !> weight times c
      complex(wp), intent(in) :: amplitude(:)
      !> Modal state at the start; only the modes with a node at the stop are read
      real(wp), intent(in) :: q0(:)
      real(wp), intent(in) :: v0(:)
      !> Time
      real(wp), intent(in) :: t
      !> In the beam, in the stop
      real(wp), intent(out) :: lost(2)

      complex(wp) :: plain, conjugate, pair
      real(wp), dimension(size(q0)) :: q, v
      integer :: m, n

      lost = 0.0_wp
      do n = 1, modes%count
         do m = 1, modes%count
            pair = amplitude(m)*amplitude(n)
            plain = pair*integral(modes%exponent(m) + modes%exponent(n), t)
            pair = amplitude(m)*conjg(amplitude(n))
            conjugate = pair*integral(modes%exponent(m) + conjg(modes%exponent(n)), t)
            lost(1) = lost(1) + 0.5_wp*real(losses%beam_plain(m, n)*plain + losses%beam_conjugate(m, n)*conjugate, wp)
            lost(2) = lost(2) + 0.5_wp*real(losses%stop_plain(m, n)*plain + losses%stop_conjugate(m, n)*conjugate, wp)
         end do
      end do
      if (size(modes%inactive) == 0) return
      call propagate(beam%oscillators, t, q0, v0, q, v)
      associate (i => modes%inactive, w2 => beam%oscillators%square)
         lost(1) = lost(1) + 0.5_wp*sum(v0(i)**2 - v(i)**2 + w2(i)*(q0(i)**2 - q(i)**2))
      end associate
   end subroutine contact_losses

   !> (exp(s t) - 1)/s without cancellation.
   elemental function integral(s, t) result(value)
      !> Exponent
      complex(wp), intent(in) :: s
      !> Time
      real(wp), intent(in) :: t
      complex(wp) :: value

      complex(wp) :: x

      x = s*t
      if (abs(x) < 0.1_wp) then
         value = t*(1.0_wp + x/2.0_wp*(1.0_wp + x/3.0_wp*(1.0_wp + x/4.0_wp*(1.0_wp + x/5.0_wp*(1.0_wp + x/6.0_wp &
                    *(1.0_wp + x/7.0_wp*(1.0_wp + x/8.0_wp*(1.0_wp + x/9.0_wp*(1.0_wp + x/10.0_wp)))))))))
      else
         value = (exp(x) - 1.0_wp)/s
      end if
   end function integral

end module contact_modes
