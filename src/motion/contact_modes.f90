!> The beam in contact with the three-element stop, in closed form (docs/theory.md, section 8).
!>
!> Everything that moves is a sum of exp(s t) over the roots s of `contact_secular`, its amplitudes the residues of
!> the Laplace transform.
module contact_modes
   use contact_secular, only: distances, exponents, find_all_roots, first_guess, inverses, make_secular, secular, &
      secular_t, size_of
   use damped_oscillators, only: lanes, padded, propagate
   use exponential_powers, only: powers
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use modal_beam, only: modal_beam_t
   use sorting, only: ascending_order
   use yielding_stop, only: impedance_t
   implicit none (type, external)
   private
   public :: contact_modes_t, make_contact_modes, contact_amplitudes, contact_state, state_of_terms, terms_at

   !> Modes whose value at the stop is below this share of the greatest do not feel it.
   real(wp), parameter :: least_coupling = 1.0e-100_wp

   !> Above this condition two exponents are taken together, by so many points of a circle around both.
   real(wp), parameter :: greatest_condition = 1.0e3_wp
   integer, parameter :: circle_points = 48

   type :: contact_modes_t
      logical :: made = .false.
      !> The stop, and 2 zeta of the beam
      type(impedance_t) :: spring
      real(wp) :: two_zeta = 0.0_wp
      !> Number of exponents; of a conjugate pair only the one with Im s > 0 is kept
      integer :: count = 0
      !> Exponents s, the fastest last, [count]
      complex(wp), allocatable :: exponent(:)
      !> -Re s and Im s, filled up with zeros to whole vectors
      real(wp), allocatable :: decay(:), swing(:)
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
      !> Force in the branch per unit of P, [count]
      complex(wp), allocatable :: branch_value(:)
      !> The tip in the static shape of P = 1
      real(wp) :: static_tip = 0.0_wp
      !> Condition of each exponent: 1 for well separated ones, infinite where two coalesce, [count]
      real(wp), allocatable :: condition(:)
   end type contact_modes_t

contains

   !> Find all exponents.
   subroutine make_contact_modes(beam, zeta, spring, modes, error)
      type(modal_beam_t), intent(in) :: beam
      !> zeta
      real(wp), intent(in) :: zeta
      !> The stop
      class(impedance_t), intent(in) :: spring
      !> The exponents and their shapes
      type(contact_modes_t), intent(out) :: modes
      !> Set when the iteration does not converge
      type(failure_t), allocatable, intent(inout) :: error

      type(secular_t) :: problem
      integer, allocatable :: active(:), near(:), keep(:)
      complex(wp), allocatable :: offset(:), distance(:), inverse(:), s(:)
      integer :: i, m, n
      complex(wp) :: value, slope
      real(wp) :: noise
      logical :: converged

      associate (b => abs(beam%stop_value))
         allocate (active, source=pack([(i, i=1, beam%count)], b > least_coupling*maxval(b)))
         allocate (modes%inactive, source=pack([(i, i=1, beam%count)], b <= least_coupling*maxval(b)))
      end associate
      call make_secular(beam, active, zeta, spring, problem)
      n = problem%roots
      allocate (near(n), offset(n), s(n), distance(problem%poles), inverse(problem%poles))
      call first_guess(beam, active, zeta, spring, problem, near, offset)
      call find_all_roots(problem, near, offset, converged)
      if (.not. converged) then
         call fail(error, status_run_failed, 'the exponents of the contact with the three-element stop were not found')
         return
      end if
      s(:) = exponents(problem, near, offset)
      allocate (keep, source=pack([(i, i=1, n)], aimag(s) >= 0.0_wp))
      modes%made = .true.
      modes%spring = impedance_t(spring%stiffness, spring%branch_stiffness, spring%relaxation_rate)
      modes%two_zeta = 2.0_wp*zeta
      modes%count = size(keep)
      allocate (modes%exponent(modes%count), modes%weight(modes%count), modes%derivative(modes%count))
      allocate (modes%condition(modes%count), modes%shape(beam%count, modes%count))
      allocate (modes%stop_value(modes%count), modes%tip_value(modes%count), modes%branch_value(modes%count))
      modes%exponent(:) = s(keep)
      modes%weight = merge(2.0_wp, 1.0_wp, aimag(modes%exponent) > 0.0_wp)
      modes%shape = (0.0_wp, 0.0_wp)
      do m = 1, modes%count
         call distances(problem, near(keep(m)), offset(keep(m)), distance)
         do i = 1, size(active)
            modes%shape(active(i), m) = beam%stop_value(active(i))/(distance(2*i - 1)*distance(2*i))
         end do
         call inverses(distance, inverse)
         call secular(problem, modes%exponent(m), distance(problem%poles), inverse, value, slope, noise, &
            modes%condition(m))
         modes%derivative(m) = slope
         modes%stop_value(m) = stop_value_at_root(problem, s(keep(m)), distance(problem%poles), &
            beam%stop_value*modes%shape(:, m))
         modes%branch_value(m) = branch_value_at_root(problem, s(keep(m)), distance(problem%poles), modes%stop_value(m))
         modes%tip_value(m) = sum(beam%tip_value*modes%shape(:, m))
         if (beam%stop_is_tip) modes%tip_value(m) = modes%stop_value(m)
      end do
      if (any(modes%condition > greatest_condition)) call replace_clusters(beam, problem, active, s, keep, modes)
      call put_in_order(modes)
      modes%static_tip = sum(beam%tip_value*beam%stop_value/beam%oscillators%square)
      if (beam%stop_is_tip) modes%static_tip = beam%flexibility
   end subroutine make_contact_modes

   !> The fastest last.
   subroutine put_in_order(modes)
      type(contact_modes_t), intent(inout) :: modes

      complex(wp), allocatable :: shape(:, :)
      integer :: order(modes%count), m

      order = ascending_order(abs(modes%exponent))
      modes%exponent(:) = modes%exponent(order)
      modes%weight(:) = modes%weight(order)
      modes%derivative(:) = modes%derivative(order)
      modes%condition(:) = modes%condition(order)
      modes%stop_value(:) = modes%stop_value(order)
      modes%branch_value(:) = modes%branch_value(order)
      modes%tip_value(:) = modes%tip_value(order)
      allocate (shape, mold=modes%shape)
      do m = 1, modes%count
         shape(:, m) = modes%shape(:, order(m))
      end do
      call move_alloc(shape, modes%shape)
      allocate (modes%decay(padded(modes%count)), modes%swing(padded(modes%count)), source=0.0_wp)
      modes%decay(:modes%count) = -real(modes%exponent, wp)
      modes%swing(:modes%count) = aimag(modes%exponent)
   end subroutine put_in_order

   !> The stop point per unit of P at an exponent: the sum over the modes, or what the stop itself says, where less
   !> cancels. Next to the pole of a mode that hardly feels the stop the sum is nothing but rounding error.
   pure function stop_value_at_root(problem, s, from_branch, terms) result(stop_value)
      type(secular_t), intent(in) :: problem
      !> The exponent
      complex(wp), intent(in) :: s
      !> Its distance from the pole of the branch, if there is one
      complex(wp), intent(in) :: from_branch
      !> The sum's, [modes]
      complex(wp), intent(in) :: terms(:)
      complex(wp) :: stop_value

      complex(wp) :: relaxed, total
      real(wp) :: magnitude

      stop_value = sum(terms)
      relaxed = (1.0_wp, 0.0_wp)
      total = problem%stiffness
      magnitude = problem%stiffness
      if (problem%has_branch) then
         relaxed = from_branch
         total = problem%stiffness*from_branch + problem%branch_stiffness*s
         magnitude = problem%stiffness*size_of(from_branch) + problem%branch_stiffness*size_of(s)
      end if
      if (magnitude*size_of(stop_value) < size_of(total)*sum(size_of(terms))) stop_value = -relaxed/total
   end function stop_value_at_root

   !> Force in the branch per unit of P at an exponent, P - k u, or what the branch itself says, where less cancels.
   pure function branch_value_at_root(problem, s, from_branch, stop_value) result(branch_value)
      type(secular_t), intent(in) :: problem
      !> The exponent
      complex(wp), intent(in) :: s
      !> Its distance from the pole of the branch, if there is one
      complex(wp), intent(in) :: from_branch
      !> The stop point per unit of P
      complex(wp), intent(in) :: stop_value
      complex(wp) :: branch_value

      branch_value = (0.0_wp, 0.0_wp)
      if (.not. problem%has_branch) return
      if (problem%branch_stiffness*size_of(s) < problem%stiffness*size_of(from_branch)) then
         branch_value = -problem%branch_stiffness*s/from_branch*stop_value
      else
         branch_value = 1.0_wp + problem%stiffness*stop_value
      end if
   end function branch_value_at_root

   !> Two exponents that nearly coalesce have large amplitudes that cancel. Their sum is the integral of the Laplace
   !> transform over a circle around both, where nothing is large: by the trapezoidal rule, which converges
   !> geometrically there, the points of the circle take the place of the two exponents
   !> (Trefethen and Weideman, SIAM Rev. 56 (2014) 385).
   subroutine replace_clusters(beam, problem, active, s, keep, modes)
      type(modal_beam_t), intent(in) :: beam
      type(secular_t), intent(in) :: problem
      !> Modes that move the stop point
      integer, intent(in) :: active(:)
      !> All exponents, and which of them `modes` has
      complex(wp), intent(in) :: s(:)
      integer, intent(in) :: keep(:)
      !> Clusters are replaced
      type(contact_modes_t), intent(inout) :: modes

      type(contact_modes_t) :: circles
      complex(wp) :: center, direction
      real(wp) :: apart, room, radius, angle
      logical :: gone(size(keep)), on_axis
      integer :: m, i, k, partner, place

      gone = .false.
      call make_room(circles, beam%count, (circle_points + 1)*size(keep))
      do m = 1, size(keep)
         if (gone(m) .or. modes%condition(m) <= greatest_condition) cycle
         partner = minloc(abs(s - s(keep(m))), dim=1, mask=[(i, i=1, size(s))] /= keep(m))
         center = 0.5_wp*(s(keep(m)) + s(partner))
         apart = abs(s(keep(m)) - s(partner))
         on_axis = abs(aimag(center)) <= apart
         if (on_axis) center = real(center, wp)
         room = minval(abs(s - center), mask=[(i, i=1, size(s))] /= keep(m) .and. [(i, i=1, size(s))] /= partner)
         room = min(room, minval(abs(problem%pole - center)))
         ! inside the half plane of decay, far from everything else
         radius = min(0.3_wp*abs(real(center, wp)), 0.3_wp*room)
         if (radius < 2.5_wp*apart) cycle
         gone(m) = .true.
         do i = 1, size(keep)
            if (keep(i) == partner) gone(i) = .true.
         end do
         do k = 1, circle_points
            angle = 2.0_wp*acos(-1.0_wp)*(real(k, wp) - 0.5_wp)/real(circle_points, wp)
            ! around the real axis the lower half is the conjugate of the upper one
            if (on_axis .and. k > circle_points/2) exit
            direction = cmplx(cos(angle), sin(angle), wp)
            call add_node(beam, problem, active, center, radius*direction, circles)
         end do
      end do
      if (.not. any(gone)) return
      do m = 1, size(keep)
         if (gone(m)) cycle
         place = circles%count + 1
         circles%count = place
         circles%exponent(place) = modes%exponent(m)
         circles%weight(place) = modes%weight(m)
         circles%derivative(place) = modes%derivative(m)
         circles%condition(place) = modes%condition(m)
         circles%shape(:, place) = modes%shape(:, m)
         circles%stop_value(place) = modes%stop_value(m)
         circles%branch_value(place) = modes%branch_value(m)
         circles%tip_value(place) = modes%tip_value(m)
      end do
      associate (all => circles%count)
         modes%count = all
         modes%exponent = circles%exponent(:all)
         modes%weight = circles%weight(:all)
         modes%derivative = circles%derivative(:all)
         modes%condition = circles%condition(:all)
         modes%shape = circles%shape(:, :all)
         modes%stop_value = circles%stop_value(:all)
         modes%branch_value = circles%branch_value(:all)
         modes%tip_value = circles%tip_value(:all)
      end associate
   end subroutine replace_clusters

   !> A point of a circle in the place of an exponent.
   subroutine add_node(beam, problem, active, center, arm, circles)
      type(modal_beam_t), intent(in) :: beam
      type(secular_t), intent(in) :: problem
      !> Modes that move the stop point
      integer, intent(in) :: active(:)
      !> The center, and the point less the center
      complex(wp), intent(in) :: center
      complex(wp), intent(in) :: arm
      !> Gets it
      type(contact_modes_t), intent(inout) :: circles

      complex(wp), dimension(problem%poles) :: distance, inverse
      complex(wp) :: node, value, slope
      real(wp) :: noise, condition
      integer :: i, near

      node = center + arm
      near = minloc(abs(problem%pole - node), dim=1)
      call distances(problem, near, node - problem%pole(near), distance)
      call inverses(distance, inverse)
      call secular(problem, node, distance(problem%poles), inverse, value, slope, noise, condition)
      circles%count = circles%count + 1
      associate (place => circles%count)
         circles%condition(place) = 1.0_wp
         circles%exponent(place) = node
         circles%weight(place) = 2.0_wp
         circles%derivative(place) = value*real(circle_points, wp)/arm
         do i = 1, size(active)
            circles%shape(active(i), place) = beam%stop_value(active(i))/(distance(2*i - 1)*distance(2*i))
         end do
         circles%stop_value(place) = sum(beam%stop_value*circles%shape(:, place))
         ! off the roots the branch's own equation does not hold
         circles%branch_value(place) = 0.0_wp
         if (problem%has_branch) circles%branch_value(place) = 1.0_wp + problem%stiffness*circles%stop_value(place)
         circles%tip_value(place) = sum(beam%tip_value*circles%shape(:, place))
      end associate
   end subroutine add_node

   !> Room for some exponents.
   pure subroutine make_room(modes, free, most)
      !> Nothing in it yet
      type(contact_modes_t), intent(inout) :: modes
      !> Number of free modes, and of exponents at most
      integer, intent(in) :: free
      integer, intent(in) :: most

      allocate (modes%exponent(most), modes%weight(most), modes%derivative(most), modes%condition(most))
      allocate (modes%shape(free, most), modes%stop_value(most), modes%tip_value(most), modes%branch_value(most))
      modes%shape = (0.0_wp, 0.0_wp)
   end subroutine make_room

   !> Amplitudes c of P(t) = P_static + sum weight Re(c exp(s t)) from the state at the start of a contact.
   pure subroutine contact_amplitudes(beam, modes, surface, q, v, branch_force, static_force, amplitude)
      type(modal_beam_t), intent(in) :: beam
      !> Exponents and shapes
      type(contact_modes_t), intent(in) :: modes
      !> delta
      real(wp), intent(in) :: surface
      !> Modal state
      real(wp), intent(in) :: q(:)
      real(wp), intent(in) :: v(:)
      !> P2, the force in the branch: P = 0 at the start
      real(wp), intent(in) :: branch_force
      !> The force that remains
      real(wp), intent(out) :: static_force
      !> c, [modes%count]
      complex(wp), intent(out) :: amplitude(:)

      real(wp) :: indentation, scale, other_scale, real_part, imaginary_part, magnitude
      ! b_i-weighted sums of q, W^2 q and v, real and imaginary
      real(wp) :: places(2), forces(2), rates(2), place_scale, force_scale
      complex(wp) :: forcing, other
      integer :: i, m

      ! P = k u + P2 = 0; from the displacement of the beam it would be no more than a rounding error of it
      indentation = -branch_force/modes%spring%stiffness
      static_force = modes%spring%stiffness*surface/(1.0_wp + modes%spring%stiffness*beam%flexibility)
      do m = 1, modes%count
         places = 0.0_wp
         forces = 0.0_wp
         rates = 0.0_wp
         place_scale = 0.0_wp
         force_scale = 0.0_wp
         !$omp simd reduction(+:places, forces, rates, place_scale, force_scale) &
         !$omp& private(real_part, imaginary_part, magnitude)
         do i = 1, beam%count
            real_part = real(modes%shape(i, m), wp)
            imaginary_part = aimag(modes%shape(i, m))
            magnitude = (abs(real_part) + abs(imaginary_part))*abs(q(i))
            places(1) = places(1) + real_part*q(i)
            places(2) = places(2) + imaginary_part*q(i)
            forces(1) = forces(1) + real_part*beam%oscillators%square(i)*q(i)
            forces(2) = forces(2) + imaginary_part*beam%oscillators%square(i)*q(i)
            rates(1) = rates(1) + real_part*v(i)
            rates(2) = rates(2) + imaginary_part*v(i)
            place_scale = place_scale + magnitude
            force_scale = force_scale + magnitude*beam%oscillators%square(i)
         end do
         associate (s => modes%exponent(m), spring => modes%spring, two_zeta => modes%two_zeta)
            ! the surface less the free motion of the stop point, transformed, in two ways: as it stands, or with
            ! s (s + 2 zeta W^2)/D = 1 - W^2/D, where what cancels for great s is the indentation
            forcing = surface/s - s*cmplx(places(1), places(2), wp) - two_zeta*cmplx(forces(1), forces(2), wp)
            scale = abs(surface)/size_of(s) + size_of(s)*place_scale + two_zeta*force_scale
            other = (indentation + cmplx(forces(1), forces(2), wp))/s
            other_scale = (abs(indentation) + force_scale)/size_of(s)
            if (other_scale < scale) forcing = other
            forcing = forcing - cmplx(rates(1), rates(2), wp)
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

      call state_of_terms(beam, modes, static_force, terms_at(modes, modes%weight*amplitude, t), q0, v0, t, q, v)
   end subroutine contact_state

   !> The terms of P at a time after the start of a contact.
   pure function terms_at(modes, amplitude, t) result(term)
      type(contact_modes_t), intent(in) :: modes
      !> weight times c, [modes%count]
      complex(wp), intent(in) :: amplitude(:)
      !> Time
      real(wp), intent(in) :: t
      complex(wp) :: term(modes%count)

      real(wp), dimension(size(modes%decay)) :: real_part, imaginary_part

      call powers(size(modes%decay)/lanes, modes%decay, modes%swing, t, real_part, imaginary_part)
      term = amplitude*cmplx(real_part(:modes%count), imaginary_part(:modes%count), wp)
   end function terms_at

   !> The modal state from the terms of P at the same instant.
   pure subroutine state_of_terms(beam, modes, static_force, term, q0, v0, t, q, v)
      type(modal_beam_t), intent(in) :: beam
      !> Exponents and shapes
      type(contact_modes_t), intent(in) :: modes
      !> From `contact_amplitudes`
      real(wp), intent(in) :: static_force
      !> From `terms_at`
      complex(wp), intent(in) :: term(:)
      !> Modal state at the start; only the modes with a node at the stop are read
      real(wp), intent(in) :: q0(:)
      real(wp), intent(in) :: v0(:)
      !> Time
      real(wp), intent(in) :: t
      !> Modal state
      real(wp), intent(out) :: q(:)
      real(wp), intent(out) :: v(:)

      complex(wp) :: rate
      real(wp), dimension(size(q0)) :: alone, alone_rate
      integer :: i, m

      q = beam%stop_value/beam%oscillators%square*static_force
      v = 0.0_wp
      do m = 1, modes%count
         rate = term(m)*modes%exponent(m)
         !$omp simd
         do i = 1, size(q)
            q(i) = q(i) + real(term(m), wp)*real(modes%shape(i, m), wp) - aimag(term(m))*aimag(modes%shape(i, m))
            v(i) = v(i) + real(rate, wp)*real(modes%shape(i, m), wp) - aimag(rate)*aimag(modes%shape(i, m))
         end do
      end do
      if (size(modes%inactive) == 0) return
      call propagate(beam%oscillators, t, q0, v0, alone, alone_rate)
      q(modes%inactive) = alone(modes%inactive)
      v(modes%inactive) = alone_rate(modes%inactive)
   end subroutine state_of_terms

end module contact_modes
