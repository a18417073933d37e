!> Variations of a motion during a phase, the motion between two events (docs/theory.md, section 22). A variation is the
!> derivative of the state with respect to the initial state or a load parameter, stored as a column of a matrix. The
!> motion of a phase is linear, so its closed form applies to each variation. The state holds the displacements q and
!> velocities v of the free modes, and the branch forces P2 of compliant contacts with a Maxwell branch
!> (`branch_force`).
module tangent_flow
   use complementarity, only: solve_active
   use constrained_sets, only: constrained_set_t
   use contact_states, only: contact_state_t
   use coupled_modes, only: coupled_amplitudes
   use damped_oscillators, only: acceleration, propagate
   use driven_modes, only: driven_mode_t, make_driven_mode
   use exponential_differences, only: exponential_difference
   use forced_responses, only: find_rows_at
   use kinds, only: wp
   use load_courses, only: load_segment_at, load_segment_t
   use load_settings, only: course_harmonic, time_course_t
   use phase_state, only: find_state, phase_state_t
   use tangent_columns, only: load_amplitude, no_parameter, state_rates_t, tangent_t
   implicit none (type, external)
   private
   public :: propagate_columns, find_rates, has_branch_force, find_load_changes

   !> Derivative of a load with respect to the load parameter, at time t in the phase: constant + slope t + Re((harmonic
   !> + secular t) exp(i frequency t)).
   type :: load_change_t
      !> Constant, slope, harmonic and frequency
      type(load_segment_t) :: segment
      !> Amplitude of the term that grows in proportion to time; a change of the frequency of a load causes it
      complex(wp) :: secular = (0.0_wp, 0.0_wp)
   end type load_change_t

contains

   !> Whether the branch force P2 of a contact is a state variable.
   elemental logical function has_branch_force(state) result(answer)
      type(contact_state_t), intent(in) :: state

      answer = .false.
      if (allocated(state%spring)) answer = state%spring%branch_stiffness > 0.0_wp
   end function has_branch_force

   !> Rates of change of the state at a time in the phase: velocities and accelerations of the free modes, and rates of
   !> the branch forces.
   subroutine find_rates(now, time, rates)
      type(phase_state_t), intent(in) :: now
      real(wp), intent(in) :: time
      type(state_rates_t), intent(inout) :: rates

      ! displacements of the constrained modes
      real(wp) :: z(size(now%z))
      ! velocities of the constrained modes
      real(wp) :: v(size(now%z))
      ! accelerations of the constrained modes
      real(wp) :: a(size(now%z))
      ! terms exp(s t) of the motion with their amplitudes
      complex(wp), allocatable :: term(:)
      ! forces of the closed compliant contacts, [compliant]
      real(wp), allocatable :: force(:)
      real(wp) :: branch_force
      integer :: g, k, place

      call find_state(now, time, z, v)
      associate (set => now%set, constrained => now%set%constrained)
         a = acceleration(constrained%oscillators, z, v)
         do g = 1, now%loads%count
            a = a + set%forced%load(:, g)*value_of(now%forced%segment(g), time)
         end do
         allocate (term(size(set%compliant)), force(size(set%compliant)))
         if (size(set%compliant) > 0) then
            term = now%amplitude*exp(set%coupled%exponent*time)
            force = set%rest_force + real(matmul(set%coupled%force, term), wp)
            if (now%loads%count > 0) force = force + row_at(set%forced%at%forces + set%compliant)
            a = a + matmul(constrained%value(:, set%compliant), force)
         end if
         rates%q = free_part(constrained, v)
         rates%v = free_part(constrained, a)
         ! closed contact: dP2/dtau = -beta k w - nu P2, with w the velocity of the beam away from the stop; open
         ! contact: the surface recovers, and P2 decays with the recovery rate
         rates%branch_force = [(0.0_wp, k=1, size(now%states))]
         do k = 1, size(now%states)
            if (.not. has_branch_force(now%states(k))) cycle
            associate (spring => now%states(k)%spring)
               place = findloc(set%compliant, k, dim=1)
               if (place > 0) then
                  branch_force = sum(real(set%coupled%branch(place, :)*term, wp))
                  if (now%loads%count > 0) branch_force = branch_force + sum(row_at([set%forced%at%branches + k]))
                  rates%branch_force(k) = -spring%branch_stiffness*sum(constrained%value(:, k)*v) &
                     - spring%relaxation_rate*branch_force
               else
                  rates%branch_force(k) = -spring%recovery_rate*now%states(k)%branch_force &
                     *exp(-spring%recovery_rate*time)
               end if
            end associate
         end do
      end associate

   contains

      !> Load response in output rows.
      function row_at(rows) result(values)
         integer, intent(in) :: rows(:)
         real(wp) :: values(size(rows))

         real(wp) :: rate(1)
         integer :: i

         do i = 1, size(rows)
            call find_rows_at(now%set%forced, now%forced, rows(i), rows(i), time, values(i:i), rate)
         end do
      end function row_at
   end subroutine find_rates

   !> Value of a load at a time from the start of the phase.
   elemental real(wp) function value_of(segment, time) result(value)
      type(load_segment_t), intent(in) :: segment
      real(wp), intent(in) :: time

      value = segment%constant + segment%slope*time + real(segment%harmonic*exp(cmplx(0.0_wp, segment%frequency*time, &
         wp)), wp)
   end function value_of

   !> Propagate the variations from the start of the phase to a time in the phase.
   subroutine propagate_columns(now, time, tangent)
      type(phase_state_t), intent(in) :: now
      real(wp), intent(in) :: time
      type(tangent_t), intent(inout) :: tangent

      ! derivatives of the loads with respect to the load parameter, [loads]
      type(load_change_t) :: change(now%loads%count)
      integer :: i, k
      ! whether the column is the derivative with respect to a load parameter, so that the changes of the loads drive it
      logical :: is_driven

      do i = 1, now%loads%count
         call change_load(now, i, tangent, change(i))
      end do
      do i = 1, size(tangent%delay)
         is_driven = i == size(tangent%delay) .and. tangent%parameter /= no_parameter
         call flow_column(now, time, change, is_driven, tangent%q(:, i), tangent%v(:, i), tangent%branch_force(:, i))
      end do
      do k = 1, size(now%states)
         if (any(now%set%compliant == k)) cycle
         if (has_branch_force(now%states(k))) then
            tangent%branch_force(k, :) = tangent%branch_force(k, :)*exp(-now%states(k)%spring%recovery_rate*time)
         else
            tangent%branch_force(k, :) = 0.0_wp
         end if
      end do
   end subroutine propagate_columns

   !> Propagate a column.
   subroutine flow_column(now, time, change, is_driven, q, v, branch_force)
      type(phase_state_t), intent(in) :: now
      real(wp), intent(in) :: time
      !> Derivatives of the loads with respect to the load parameter, [loads]
      type(load_change_t), intent(in) :: change(:)
      !> Whether the column is the derivative with respect to a load parameter: the changes of the loads drive it
      logical, intent(in) :: is_driven
      !> Variations of the displacements q of the free modes, [free modes]
      real(wp), intent(inout) :: q(:)
      !> Variations of the velocities v of the free modes, [free modes]
      real(wp), intent(inout) :: v(:)
      !> Variations of the branch forces, [contacts]
      real(wp), intent(inout) :: branch_force(:)

      ! variations of the constrained modes at the start of the phase (z0, v0), and at the time (z1, v1)
      real(wp), dimension(size(now%z)) :: z0, v0, z1, v1
      integer :: i

      associate (constrained => now%set%constrained)
         z0 = constrained_part(constrained, q)
         v0 = constrained_part(constrained, v)
         if (size(now%set%compliant) > 0) then
            call hold_rigid_contacts(now, z0)
            call hold_rigid_contacts(now, v0)
            call flow_coupled(now, time, change, is_driven, z0, v0, z1, v1, branch_force)
            call flow_uncoupled(now, time, change, is_driven, now%set%coupled%inactive, z0, v0, z1, v1)
         else
            call flow_uncoupled(now, time, change, is_driven, [(i, i=1, constrained%count)], z0, v0, z1, v1)
         end if
         q = free_part(constrained, z1)
         v = free_part(constrained, v1)
      end associate
   end subroutine flow_column

   !> Remove from a variation the motion of closed rigid contacts that apply forces, as constrained modes do for those
   !> that are constraints. At the start of a Poincare map, variations of single modes move such a contact. The
   !> amplitudes of the terms are linear in the variation only if the contact does not move (`coupled_amplitudes`).
   subroutine hold_rigid_contacts(now, z)
      type(phase_state_t), intent(in) :: now
      !> Displacements or rates of the constrained modes, [modes]
      real(wp), intent(inout) :: z(:)

      ! indices of these contacts, [rigid]
      integer, allocatable :: rigid(:)
      ! values of the constrained modes there, [modes, rigid]
      real(wp), allocatable :: value(:, :)
      real(wp), allocatable :: multiplier(:)

      allocate (rigid, source=pack(now%set%compliant, now%states(now%set%compliant)%is_rigid))
      if (size(rigid) == 0) return
      value = now%set%constrained%value(:, rigid)
      allocate (multiplier(size(rigid)))
      call solve_active(matmul(transpose(value), value), matmul(z, value), spread(.true., 1, size(rigid)), multiplier)
      z = z + matmul(value, multiplier)
   end subroutine hold_rigid_contacts

   !> Propagate the constrained modes that no compliant contact couples.
   subroutine flow_uncoupled(now, time, change, is_driven, modes, z0, v0, z, rate)
      type(phase_state_t), intent(in) :: now
      real(wp), intent(in) :: time
      !> Derivatives of the loads with respect to the load parameter, [loads]
      type(load_change_t), intent(in) :: change(:)
      !> Whether the changes of the loads drive the column
      logical, intent(in) :: is_driven
      !> Indices of these modes
      integer, intent(in) :: modes(:)
      !> Displacements of all constrained modes at the start of the phase, [modes]
      real(wp), intent(in) :: z0(:)
      !> Their rates at the start of the phase, [modes]
      real(wp), intent(in) :: v0(:)
      !> Displacements at the time; those of other modes remain, [modes]
      real(wp), intent(inout) :: z(:)
      !> Rates at the time, [modes]
      real(wp), intent(inout) :: rate(:)

      ! displacements and rates of all constrained modes if they were uncoupled
      real(wp), dimension(size(z)) :: uncoupled, uncoupled_rate
      integer :: g, i, j

      if (size(modes) == 0) return
      associate (oscillators => now%set%constrained%oscillators)
         call propagate(oscillators, time, z0, v0, uncoupled, uncoupled_rate)
         do j = 1, size(modes)
            i = modes(j)
            z(i) = uncoupled(i)
            rate(i) = uncoupled_rate(i)
            if (.not. is_driven) cycle
            do g = 1, size(change)
               call add_mode_response(make_driven_mode(oscillators, i), change(g), now%set%forced%load(i, g), time, &
                  z(i), rate(i))
            end do
         end do
      end associate
   end subroutine flow_uncoupled

   !> Displacements or rates of the constrained modes from those of the free modes, [modes].
   pure function constrained_part(constrained, free) result(modes)
      type(constrained_set_t), intent(in) :: constrained
      !> Displacements or rates of the free modes, [free modes]
      real(wp), intent(in) :: free(:)
      real(wp) :: modes(constrained%count)

      ! without a closed rigid contact the constrained modes are the free modes
      if (allocated(constrained%mode)) then
         modes = matmul(free, constrained%mode)
      else
         modes = free
      end if
   end function constrained_part

   !> Displacements or rates of the free modes from those of the constrained modes, [free modes].
   pure function free_part(constrained, modes) result(free)
      type(constrained_set_t), intent(in) :: constrained
      !> Displacements or rates of the constrained modes, [modes]
      real(wp), intent(in) :: modes(:)
      real(wp) :: free(size(constrained%static))

      if (allocated(constrained%mode)) then
         free = matmul(constrained%mode, modes)
      else
         free = modes
      end if
   end function free_part

   !> Add to z, v the response of a mode, initially at rest, to the derivative of a load with respect to the load
   !> parameter. The response is a sum of divided differences of exp(s t) over the exponents of the load and the two
   !> exponents s1, s2 of the mode: exp[0, s1, s2] for a constant, exp[0, 0, s1, s2] for t, exp[sigma, s1, s2] for
   !> exp(sigma t), and exp[sigma, sigma, s1, s2] for t exp(sigma t); exp[s1, s2] is the response to a unit impulse.
   pure subroutine add_mode_response(mode, change, load_factor, time, z, v)
      type(driven_mode_t), intent(in) :: mode
      type(load_change_t), intent(in) :: change
      !> Modal load per unit of load
      real(wp), intent(in) :: load_factor
      real(wp), intent(in) :: time
      !> Displacement of the mode
      real(wp), intent(inout) :: z
      !> Velocity of the mode
      real(wp), intent(inout) :: v

      complex(wp), parameter :: zero = (0.0_wp, 0.0_wp)
      ! response to a unit impulse
      complex(wp) :: impulse_response
      ! response to the constant 1, afterwards to exp(sigma t)
      complex(wp) :: response
      ! response to t exp(sigma t)
      complex(wp) :: secular_response
      ! i times the frequency of the load
      complex(wp) :: sigma

      associate (exponent => mode%exponent, segment => change%segment)
         impulse_response = exponential_difference(exponent, time)
         response = exponential_difference([zero, exponent], time)
         z = z + load_factor*real(segment%constant*response &
            + segment%slope*exponential_difference([zero, zero, exponent], time), wp)
         v = v + load_factor*real(segment%constant*impulse_response + segment%slope*response, wp)
         if (abs(segment%harmonic) + abs(change%secular) <= 0.0_wp) return
         sigma = cmplx(0.0_wp, segment%frequency, wp)
         response = exponential_difference([sigma, exponent], time)
         secular_response = exponential_difference([sigma, sigma, exponent], time)
         z = z + load_factor*real(segment%harmonic*response + change%secular*secular_response, wp)
         v = v + load_factor*real(segment%harmonic*(sigma*response + impulse_response) + change%secular*(response &
            + sigma*secular_response), wp)
      end associate
   end subroutine add_mode_response

   !> Propagate the constrained modes that closed compliant contacts couple.
   subroutine flow_coupled(now, time, change, is_driven, z0, v0, z, rate, branch_force)
      type(phase_state_t), intent(in) :: now
      real(wp), intent(in) :: time
      !> Derivatives of the loads with respect to the load parameter, [loads]
      type(load_change_t), intent(in) :: change(:)
      !> Whether the changes of the loads drive the column
      logical, intent(in) :: is_driven
      !> Displacements of the constrained modes at the start of the phase, [modes]
      real(wp), intent(in) :: z0(:)
      !> Their rates at the start of the phase, [modes]
      real(wp), intent(in) :: v0(:)
      !> Displacements of the constrained modes at the time, [modes]
      real(wp), intent(out) :: z(:)
      !> Rates of z, [modes]
      real(wp), intent(out) :: rate(:)
      !> Variations of the branch forces, [contacts]
      real(wp), intent(inout) :: branch_force(:)

      ! values of the terms exp(s t) of the column at the time
      complex(wp) :: term(now%set%coupled%count)
      ! amplitudes of the terms after a unit impulse of a load
      complex(wp) :: impulse_term(now%set%coupled%count)
      ! a static gap of zero at each contact
      real(wp) :: zeros(size(now%set%compliant))
      ! variations of the indentations
      real(wp) :: indentation(size(now%set%compliant))
      integer :: g, m

      associate (constrained => now%set%constrained, coupled => now%set%coupled, compliant => now%set%compliant)
         zeros = 0.0_wp
         indentation = [(-sum(z0*constrained%value(:, compliant(m))), m=1, size(compliant))]
         call coupled_amplitudes(constrained%oscillators%square, coupled, zeros, indentation, branch_force(compliant), &
            z0, v0, term)
         term = coupled%weight*term*exp(coupled%exponent*time)
         if (is_driven) then
            do g = 1, size(change)
               call coupled_amplitudes(constrained%oscillators%square, coupled, zeros, zeros, zeros, 0.0_wp*z0, &
                  now%set%forced%load(:, g), impulse_term)
               do m = 1, coupled%count
                  term(m) = term(m) + coupled%weight(m)*impulse_term(m)*term_response(coupled%exponent(m), change(g), &
                     time)
               end do
            end do
         end if
         z = real(matmul(coupled%shape, term), wp)
         rate = real(matmul(coupled%shape, coupled%exponent*term), wp)
         branch_force(compliant) = real(matmul(coupled%branch, term), wp)
      end associate
   end subroutine flow_coupled

   !> Response of a term exp(s t) to the derivative of a load with respect to the load parameter, per unit of the
   !> amplitude that a unit impulse of the load gives to the term.
   pure function term_response(exponent, change, time) result(response)
      !> Exponent s of the term
      complex(wp), intent(in) :: exponent
      type(load_change_t), intent(in) :: change
      real(wp), intent(in) :: time
      complex(wp) :: response

      complex(wp), parameter :: zero = (0.0_wp, 0.0_wp)
      ! i times the frequency of the load
      complex(wp) :: sigma

      associate (segment => change%segment)
         response = segment%constant*exponential_difference([zero, exponent], time) &
            + segment%slope*exponential_difference([zero, zero, exponent], time)
         if (abs(segment%harmonic) + abs(change%secular) <= 0.0_wp) return
         sigma = cmplx(0.0_wp, segment%frequency, wp)
         response = response + 0.5_wp*(segment%harmonic*exponential_difference([sigma, exponent], time) &
            + change%secular*exponential_difference([sigma, sigma, exponent], time) &
            + conjg(segment%harmonic)*exponential_difference([-sigma, exponent], time) &
            + conjg(change%secular)*exponential_difference([-sigma, -sigma, exponent], time))
      end associate
   end function term_response

   !> Derivative of a load with respect to the load parameter during the present phase.
   pure subroutine change_load(now, load, tangent, change)
      type(phase_state_t), intent(in) :: now
      !> Index of the load
      integer, intent(in) :: load
      type(tangent_t), intent(in) :: tangent
      type(load_change_t), intent(out) :: change

      type(time_course_t) :: course

      if (tangent%parameter == no_parameter) return
      course = now%loads%course(load)
      associate (power => now%loads%power(load), segment => now%forced%segment(load))
         change%segment%frequency = segment%frequency
         if (tangent%parameter == load_amplitude) then
            if (load /= tangent%load) return
            ! the load per unit of amplitude; if the displacement of the base is given (power 2), the load is its
            ! acceleration, -w**2 times the amplitude
            course%amplitude = 1.0_wp
            if (power > 0) course%amplitude = -course%frequency**power
            change%segment = load_segment_at(course, now%forced%tau)
         else if (course%kind == course_harmonic) then
            ! derivative of w**power exp(i w tau) with respect to w, at tau = start of the phase + t, times the
            ! derivative of w by the parameter, because all frequencies change in proportion
            associate (frequency_ratio => course%frequency/now%loads%course(tangent%load)%frequency)
               change%segment%harmonic = frequency_ratio*segment%harmonic*cmplx(real(power, wp)/course%frequency, &
                  now%forced%tau, wp)
               change%secular = frequency_ratio*segment%harmonic*(0.0_wp, 1.0_wp)
            end associate
         end if
      end associate
   end subroutine change_load

   !> Derivatives of all loads with respect to the load parameter, and by time, at a time in the phase.
   pure subroutine find_load_changes(now, time, tangent, by_parameter, rate)
      type(phase_state_t), intent(in) :: now
      real(wp), intent(in) :: time
      type(tangent_t), intent(in) :: tangent
      !> Derivatives with respect to the load parameter, [loads]
      real(wp), intent(out) :: by_parameter(:)
      !> Derivatives with respect to time, [loads]
      real(wp), intent(out) :: rate(:)

      type(load_change_t) :: change
      integer :: g

      do g = 1, now%loads%count
         call change_load(now, g, tangent, change)
         associate (segment => now%forced%segment(g), phasor => exp(cmplx(0.0_wp, &
            now%forced%segment(g)%frequency*time, wp)))
            by_parameter(g) = value_of(change%segment, time) + real(change%secular*time*phasor, wp)
            rate(g) = segment%slope + real(cmplx(0.0_wp, segment%frequency, wp)*segment%harmonic*phasor, wp)
         end associate
      end do
   end subroutine find_load_changes

end module tangent_flow
