!> Energy dissipated in beam and stops during a phase (the motion between two events), and forces and indentations of
!> compliant contacts at a time in the phase (docs/theory.md, sections 17 and 18); integrals of displacements and
!> contact forces, and of their squares, over parts of a phase that a path covers (section 20).
module phase_losses
   use contact_sets, only: contact_set_t
   use contact_states, only: energy_in, force_in, set_indentation, recover, contact_state_t
   use damped_oscillators, only: elastic_and_viscous, propagate
   use driven_modes, only: integral_of_free_motion, make_driven_mode
   use driven_signal, only: phasor_of
   use forced_responses, only: find_rows_at
   use kinds, only: wp
   use load_work, only: load_response_impulse, loss_in_stop
   use motion_intervals, only: output_row_t
   use phase_rows, only: is_integrable, signal_of_row
   use phase_state, only: find_homogeneous_state, find_state, force_terms, phase_state_t
   use point_forces, only: slow_frequency
   use power_integrals, only: energy_over, find_interval_terms, integrals_in, make_power_form
   use row_integrals, only: find_row_interval_terms, integrate_rows, make_row_form
   use row_signals, only: row_signal_t
   implicit none (type, external)
   private
   public :: advance_contact, find_losses, force_at, impulse_in, loss_of_contact, losses_in, prepare_losses, &
      integrate_on_path

contains

   !> Contributions of the load response to the force, the indentation and the branch force of a contact at a time in
   !> the phase.
   pure function load_response_of(self, k, time) result(driven)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: time
      !> Force, indentation, branch force
      real(wp) :: driven(3)

      ! rates of the rows, an output of `find_rows_at` that is not used here
      real(wp) :: rate(1)
      ! rows of force, indentation and branch force
      integer :: row(3)
      integer :: i

      driven = 0.0_wp
      if (self%loads%count == 0) return
      associate (at => self%set%forced%at, phasor => phasor_of(self%forced%frequency, time))
         row = [at%forces, at%indentations, at%branches] + k
         do i = 1, size(row)
            call find_rows_at(self%set%forced, self%forced, row(i), row(i), time, driven(i:i), rate, phasor)
         end do
      end associate
   end function load_response_of

   !> Force of a closed contact at a time in the phase.
   real(wp) function force_at(now, k, time, z, v, term, rate) result(force)
      type(phase_state_t), intent(in) :: now
      integer, intent(in) :: k
      !> Time from the start of the phase
      real(wp), intent(in) :: time
      !> Displacements of the constrained modes without the load response (homogeneous part), [modes]
      real(wp), intent(in) :: z(:)
      !> Velocities of the constrained modes without the load response (homogeneous part), [modes]
      real(wp), intent(in) :: v(:)
      !> Values of the terms exp(s t) if a compliant contact is closed, [terms]
      complex(wp), intent(in) :: term(:)
      !> Rate of the gap, from which the force of a compliant contact follows at time 0: with stiff dampers the sum of
      !> the terms would lose digits
      real(wp), intent(in) :: rate

      real(wp) :: driven(3)
      integer :: place

      if (.not. (time > 0.0_wp .or. now%states(k)%is_rigid)) then
         force = force_in(now%states(k), rate)
         return
      end if
      associate (set => now%set, constrained => now%set%constrained)
         driven = load_response_of(now, k, time)
         force = driven(1)
         place = findloc(set%compliant, k, dim=1)
         if (place > 0) then
            force = force + set%rest_force(place) + sum(real(set%coupled%force(place, :)*term, wp))
            return
         end if
         place = findloc(constrained%closed, k, dim=1)
         if (size(set%compliant) > 0) then
            force = force + set%rest_reaction(place) + sum(real(set%reaction(place, :)*term, wp))
            if (size(set%coupled%inactive) == 0) return
            associate (inactive => set%coupled%inactive, &
               elastic => elastic_and_viscous(constrained%oscillators, z, v, time, now%z, now%v))
               force = force + sum(constrained%reaction(place, inactive)*elastic(inactive))
            end associate
         else
            force = force + constrained%static_force(place) + sum(constrained%reaction(place, :) &
               *elastic_and_viscous(constrained%oscillators, z, v, time, now%z, now%v))
         end if
      end associate
   end function force_at

   !> Energy dissipated since the start of the phase. Under loads, dissipation in the beam is the remainder of the
   !> energy balance.
   subroutine find_losses(self, at_start, at_time, energy_lost, time, lost)
      type(phase_state_t), intent(inout) :: self
      !> Contact states at the start of the phase, [contacts]
      type(contact_state_t), allocatable, intent(in) :: at_start(:)
      !> Contact states at the time, with the results of `advance_contact`, [contacts]
      type(contact_state_t), intent(in) :: at_time(:)
      !> Energy of the constrained modes at the start of the phase, less that at the time, plus the work of the loads
      real(wp), intent(in) :: energy_lost
      real(wp), intent(in) :: time
      !> Energy dissipated in the beam, then in each closed compliant contact, [1 + compliant]
      real(wp), intent(out) :: lost(:)

      ! index among the compliant contacts of the set
      integer :: place

      associate (set => self%set)
         if (size(set%compliant) > 0 .and. self%loads%count == 0) then
            call losses_in(set, self%amplitude, self%z, self%v, time, lost)
            return
         end if
         ! energy balance of the beam: decrease of its energy plus work of the loads, less the energies that the stops
         ! receive
         lost(1) = energy_lost
         call find_stop_losses(self, time, lost(2:))
         do place = 1, size(set%compliant)
            associate (k => set%compliant(place))
               if (.not. self%states(k)%is_rigid) lost(1) = lost(1) + energy_in(at_start(k)) - lost(1 + place) &
                  - energy_in(at_time(k))
            end associate
         end do
      end associate
   end subroutine find_losses

   !> Energy dissipated in each closed compliant contact since the start of the phase, under loads. A rigid contact that
   !> applies a force instead of a constraint dissipates nothing.
   subroutine find_stop_losses(self, time, lost)
      type(phase_state_t), intent(inout) :: self
      real(wp), intent(in) :: time
      !> Energies, [compliant]
      real(wp), intent(out) :: lost(:)

      ! integrals of the squared indentation rates, [compliant]
      real(wp) :: squares(size(lost))
      ! whether `squares` is known
      logical :: has_squares
      ! index among the compliant contacts of the set
      integer :: place

      lost = 0.0_wp
      call integrate_rates_on_path(self, time, has_squares, squares)
      do place = 1, size(lost)
         associate (spring => self%set%coupled%spring(place))
            if (self%states(self%set%compliant(place))%is_rigid) cycle
            if (has_squares .and. spring%branch_stiffness <= 0.0_wp) then
               lost(place) = spring%viscosity*squares(place)
            else
               lost(place) = loss_in_stop(self, place, time)
            end if
         end associate
      end do
   end subroutine find_stop_losses

   !> Energy dissipated in the stop of a contact since the start of the phase; the states of contacts are already those
   !> at the end of the phase.
   real(wp) function loss_of_contact(self, k, at_start, time, is_inside) result(loss)
      type(phase_state_t), intent(inout) :: self
      integer, intent(in) :: k
      !> State of the contact at the start of the phase
      type(contact_state_t), intent(in) :: at_start
      real(wp), intent(in) :: time
      !> Whether the time is before the end of the phase
      logical, intent(in) :: is_inside

      type(contact_state_t) :: contact
      real(wp), dimension(size(self%z)) :: z, v
      ! energy dissipated in the beam, then in each closed compliant contact, [1 + compliant]
      real(wp) :: lost(1 + size(self%set%compliant))
      ! index among the compliant contacts of the set; 0: the contact is open
      integer :: place

      loss = 0.0_wp
      ! the damper of a massless node is the damping of the beam
      if (self%states(k)%is_rigid .or. self%states(k)%is_node) return
      place = findloc(self%set%compliant, k, dim=1)
      if (.not. is_inside) then
         loss = self%states(k)%dissipated - at_start%dissipated
      else if (place == 0) then
         contact = at_start
         z = 0.0_wp
         ! a contact that is not deformed recovers without the beam
         if (contact%is_deformed) call find_state(self, time, z, v)
         call recover_contact(self%set%constrained%static_gap(k) + sum(self%set%constrained%value(:, k)*z), time, &
            contact)
         loss = contact%dissipated - at_start%dissipated
      else
         if (self%loads%count > 0) then
            call find_stop_losses(self, time, lost(2:))
         else
            call losses_in(self%set, self%amplitude, self%z, self%v, time, lost)
         end if
         loss = lost(1 + place)
      end if
   end function loss_of_contact

   !> Advance a contact from the start of the phase: a compliant contact is indented if it is closed, and recovers if it
   !> is open.
   subroutine advance_contact(self, k, time, z, term, state)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      !> Time since the start of the phase
      real(wp), intent(in) :: time
      !> Displacements of the constrained modes at that time, [modes]
      real(wp), intent(in) :: z(:)
      !> Values of the terms exp(s t) at that time, if a compliant contact is closed, [terms]
      complex(wp), intent(in) :: term(:)
      !> State of the contact, on entry at the start of the phase
      type(contact_state_t), intent(inout) :: state

      ! index among the compliant contacts of the set; 0: the contact is open
      integer :: place

      if (state%is_rigid) return
      place = findloc(self%set%compliant, k, dim=1)
      if (place > 0) then
         call update_indentation(self, place, time, term, state)
      else
         call recover_contact(self%set%constrained%static_gap(k) + sum(self%set%constrained%value(:, k)*z), time, &
            state)
      end if
   end subroutine advance_contact

   !> Set indentation and branch force of a closed compliant contact at a time in the phase.
   subroutine update_indentation(self, place, time, term, state)
      type(phase_state_t), intent(in) :: self
      !> Index among the compliant contacts of the set
      integer, intent(in) :: place
      real(wp), intent(in) :: time
      !> Values of the terms exp(s t) at that time, [terms]
      complex(wp), intent(in) :: term(:)
      type(contact_state_t), intent(inout) :: state

      real(wp) :: driven(3)
      ! sum of the terms
      real(wp) :: total
      integer :: m

      associate (set => self%set, spring => self%set%coupled%spring(place), indentation => state%indentation)
         driven = load_response_of(self, set%compliant(place), time)
         indentation = set%rest_force(place)/self%states(set%compliant(place))%spring%stiffness + driven(2)
         total = 0.0_wp
         !$omp simd reduction(+:total)
         do m = 1, size(term)
            total = total + (real(set%coupled%indentation(place, m), wp)*real(term(m), wp) &
               - aimag(set%coupled%indentation(place, m))*aimag(term(m)))
         end do
         indentation = indentation + total
         state%branch_force = driven(3)
         if (spring%branch_stiffness <= 0.0_wp) return
         state%branch_force = state%branch_force + sum(real(set%coupled%branch(place, :)*term, wp))
      end associate
   end subroutine update_indentation

   !> Let the stop of an open compliant contact recover for some time. If `is_deformed`, the surface moves with the
   !> beam, else it recovers freely.
   subroutine recover_contact(gap, time, state)
      !> Distance of the stop point from the undeformed contact surface at the end
      real(wp), intent(in) :: gap
      !> Duration of the recovery
      real(wp), intent(in) :: time
      type(contact_state_t), intent(inout) :: state

      ! energy stored in the stop before the recovery
      real(wp) :: before

      if (.not. state%is_deformed) then
         call recover(state, time)
         return
      end if
      before = energy_in(state)
      call set_indentation(state, max(-gap, 0.0_wp))
      state%dissipated = state%dissipated + (before - energy_in(state))
   end subroutine recover_contact

   !> Prepare the dissipated powers as quadratic forms of the terms.
   pure subroutine prepare_losses(set, with_beam)
      type(contact_set_t), intent(inout) :: set
      !> Whether to prepare the dissipation in the beam, too
      logical, intent(in) :: with_beam

      ! square root of the power dissipated in each mode, or in a stop, per unit of each term, [modes or 1, terms]
      complex(wp), allocatable :: rate(:, :)
      integer :: j, m

      if (size(set%compliant) == 0) return
      associate (coupled => set%coupled, k => set%coupled%count)
         if (with_beam .and. .not. allocated(set%beam_loss)) then
            allocate (set%beam_loss, rate(set%constrained%count, k))
            do m = 1, k
               rate(:, m) = sqrt(max(coupled%two_zeta*set%constrained%oscillators%square + coupled%mass_rate, &
                  0.0_wp))*coupled%exponent(m)*coupled%shape(:, m)
            end do
            call make_power_form(coupled%exponent, rate, set%beam_loss)
            deallocate (rate)
         end if
         if (allocated(set%losses)) return
         allocate (set%losses(size(set%compliant)), rate(1, k))
         do j = 1, size(set%losses)
            associate (spring => coupled%spring(j))
               if (spring%branch_stiffness > 0.0_wp) then
                  rate(1, :) = sqrt(spring%relaxation_rate/spring%branch_stiffness)*coupled%branch(j, :)
               else
                  rate(1, :) = sqrt(spring%viscosity)*coupled%exponent*coupled%indentation(j, :)
               end if
            end associate
            call make_power_form(coupled%exponent, rate, set%losses(j))
         end do
      end associate
   end subroutine prepare_losses

   !> Energy dissipated since the start of the phase without loads.
   pure subroutine losses_in(set, amplitude, z0, v0, time, lost)
      !> Prepared by `prepare_losses`
      type(contact_set_t), intent(inout) :: set
      !> Values of the terms exp(s t) at the start of the phase, [terms]
      complex(wp), intent(in) :: amplitude(:)
      !> Displacements of the modes at the start of the phase, [modes]
      real(wp), intent(in) :: z0(:)
      !> Velocities of the modes at the start of the phase, [modes]
      real(wp), intent(in) :: v0(:)
      real(wp), intent(in) :: time
      !> Energy dissipated in the beam, if prepared, then in each closed compliant contact, [1 + compliant]
      real(wp), intent(out) :: lost(:)

      real(wp), dimension(size(z0)) :: z, v
      integer :: j

      call find_interval_terms(set%losses(1), amplitude, time, set%span)
      lost(1) = 0.0_wp
      if (allocated(set%beam_loss)) lost(1) = energy_over(set%beam_loss, set%span)
      do j = 1, size(set%losses)
         lost(1 + j) = energy_over(set%losses(j), set%span)
      end do
      if (size(set%coupled%inactive) == 0) return
      call propagate(set%constrained%oscillators, time, z0, v0, z, v)
      associate (i => set%coupled%inactive, w2 => set%constrained%oscillators%square)
         lost(1) = lost(1) + 0.5_wp*sum(v0(i)**2 - v(i)**2 + w2(i)*(z0(i)**2 - z(i)**2))
      end associate
   end subroutine losses_in

   !> Integral of the force of a closed contact from the start of the phase.
   real(wp) function impulse_in(now, k, time) result(impulse)
      type(phase_state_t), intent(in) :: now
      integer, intent(in) :: k
      !> Time from the start of the phase to the end of the integral
      real(wp), intent(in) :: time

      complex(wp), allocatable :: amplitude(:)
      ! constant part of the force
      real(wp) :: offset
      integer :: i, place

      associate (set => now%set, constrained => now%set%constrained)
         place = findloc(constrained%closed, k, dim=1)
         if (size(set%compliant) > 0) then
            call prepare_losses(set, .false.)
            call find_interval_terms(set%losses(1), now%amplitude, time, set%span)
            call force_terms(now, k, integrals_in(set%losses(1), set%span), offset, amplitude)
            impulse = offset*time + sum(real(amplitude, wp))
            if (place > 0 .and. size(set%coupled%inactive) > 0) impulse = impulse &
               + impulse_of_modes(now, place, set%coupled%inactive, time)
         else
            impulse = constrained%static_force(place)*time + impulse_of_modes(now, place, [(i, i=1, size(now%z))], time)
         end if
      end associate
      if (now%loads%count > 0) impulse = impulse + load_response_impulse(now, k, time)
   end function impulse_in

   !> Contribution of modes without coupling to compliant contacts to the impulse of a closed rigid contact. The
   !> contribution of a mode p to a reaction, p + 2 zeta p' with ' = d/dtau, is -(p'' + alpha p')/W^2, with alpha the
   !> rate of mass-proportional damping.
   real(wp) function impulse_of_modes(now, place, modes, time) result(impulse)
      type(phase_state_t), intent(in) :: now
      !> Index of the contact among the closed rigid contacts
      integer, intent(in) :: place
      !> Indices of the modes
      integer, intent(in) :: modes(:)
      !> Time from the start of the phase to the end of the integral
      real(wp), intent(in) :: time

      real(wp), dimension(size(now%z)) :: z, v
      ! integral of p + 2 zeta p' of a mode
      real(wp) :: part
      integer :: i, m

      call find_homogeneous_state(now, time, z, v)
      impulse = 0.0_wp
      associate (constrained => now%set%constrained, square => now%set%constrained%oscillators%square)
         do m = 1, size(modes)
            i = modes(m)
            if (square(i) < slow_frequency**2) then
               part = integral_of_free_motion(make_driven_mode(constrained%oscillators, i), [now%z(i), now%v(i)], &
                  time) + constrained%oscillators%two_zeta*(z(i) - now%z(i))
            else
               part = (now%v(i) - v(i) + constrained%oscillators%mass_rate(i)*(now%z(i) - z(i)))/square(i)
            end if
            impulse = impulse + constrained%reaction(place, i)*part
         end do
      end associate
   end function impulse_of_modes

   !> Integrals of signals, and of their squares, over a part of a phase.
   subroutine integrate_on_path(self, from, length, signals, first, second, has_digits)
      type(phase_state_t), intent(inout) :: self
      !> Start of the part, since the start of the phase
      real(wp), intent(in) :: from
      !> Length of the part
      real(wp), intent(in) :: length
      type(row_signal_t), intent(in) :: signals(:)
      !> Integral of each signal, [signals]
      real(wp), intent(out) :: first(:)
      !> Integral of the square of each signal, [signals]; absent: not requested
      real(wp), intent(out), optional :: second(:)
      !> Receives false if the squares lose their digits, as in `integrate_rows`
      logical, intent(inout), optional :: has_digits

      associate (set => self%set)
         if (.not. allocated(set%shared%form)) then
            allocate (set%shared%form)
            call make_row_form(set%shared%basis, set%shared%form)
         end if
         call find_row_interval_terms(set%shared%basis, set%shared%form, self%path%z(:, :, 0), from, length, self%span)
         call integrate_rows(set%shared%basis, set%shared%form, self%span, signals, first, second, &
            has_digits)
      end associate
   end subroutine integrate_on_path

   !> Integrals of the squared indentation rates of closed compliant contacts, from the start of a phase.
   subroutine integrate_rates_on_path(self, length, has_integrals, second)
      type(phase_state_t), intent(inout) :: self
      !> End of the integrals, since the start of the phase
      real(wp), intent(in) :: length
      !> Whether they follow from the terms of rows
      logical, intent(out) :: has_integrals
      !> Integrals of the squared indentation rates, [compliant contacts of the set]
      real(wp), intent(out) :: second(:)

      type(row_signal_t) :: signals(size(second))
      real(wp) :: first(size(second))
      integer :: j

      has_integrals = size(second) > 0
      do j = 1, size(second)
         associate (k => self%set%compliant(j))
            has_integrals = is_integrable(self, output_row_t(k))
            if (.not. has_integrals) return
            ! the rate of a gap has its slope as a constant
            signals(j) = signal_of_row(self, output_row_t(k))
            signals(j) = row_signal_t(row=signals(j)%row, factor=0.0_wp, rate_factor=signals(j)%factor, &
               offset=signals(j)%slope)
         end associate
      end do
      if (has_integrals) call integrate_on_path(self, 0.0_wp, length, signals, first, second)
   end subroutine integrate_rates_on_path

end module phase_losses
