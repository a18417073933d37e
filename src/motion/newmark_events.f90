!> The rules of contact and release for steps of finite length, and what impact, capture, contact and release do.
module newmark_events
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use newmark_energies, only: momentum_at_stop
   use newmark_run, only: gap, gap_rate, instant, level_of, nowhere, phase_contact, phase_free, phase_held, run_t, &
      stop_energy
   use newmark_stability, only: highest_frequency
   use newmark_stepper, only: copy_state, newmark_state_t, newmark_stepper_t, restart_acceleration
   use number_text, only: to_text
   use response_types, only: append_event, event_capture, event_contact, event_impact, event_release, &
      event_separation, event_t, response_t
   use restitution_stop, only: nodal_energy_change, nodal_impulse, rebound_energy_change, rebound_impulse
   use run_recorder, only: charge_event
   use run_settings, only: impulse_nodal
   use step_measures, only: greatest_in, measure_event, piece_t
   use yielding_stop, only: rounding_of_force
   implicit none (type, external)
   private
   public :: look_for_event, give_way, find_impulse_level

contains

   !> The rules of contact and release at the end of an accepted step.
   pure subroutine look_for_event(run, step, closing, response)
      type(run_t), intent(inout) :: run
      real(wp), intent(in) :: step
      !> A longer step was taken back: the event lies ahead
      logical, intent(in) :: closing
      !> Events
      type(response_t), intent(inout) :: response

      real(wp) :: distance, rate

      associate (old => run%states(3 - run%now), new => run%states(run%now))
         if (run%phase == phase_free) then
            distance = gap(run, new)
            rate = gap_rate(run, new)
            if (run%judged) then
               run%peak = max(run%peak, greatest_in(piece_t(0.0_wp, step, [gap(run, old), distance], &
                  [gap_rate(run, old), rate])))
               if (run%peak > run%hop_height) run%judged = .false.
            end if
            run%leaving = distance < -run%contact_tolerance
            if (distance >= run%contact_tolerance) then
               run%armed = .true.
            else if (rate < 0.0_wp .and. (run%armed .or. closing .or. run%leaving)) then
               if (allocated(run%stop)) then
                  call begin_contact(run, response)
               else
                  call strike(run, response)
               end if
            else if (rate > 0.0_wp) then
               run%armed = .true.
            end if
         else if (closing .and. fades(run, old, new)) then
            if (run%phase == phase_held) then
               call release(run, response)
            else
               call end_contact(run, response)
            end if
         end if
      end associate
   end subroutine look_for_event

   !> Is a force that vanishes ahead as good as gone? One that still rises is the beginning of a contact, not its end.
   !> Under a hard stop that of release may be less than rounding leaves, of which no short step tells whether it rises.
   pure function fades(run, old, new)
      type(run_t), intent(in) :: run
      !> At the beginning and the end of the step
      type(newmark_state_t), intent(in) :: old
      type(newmark_state_t), intent(in) :: new
      logical :: fades

      fades = new%force < run%release_force .and. new%force < old%force
      if (fades .or. .not. allocated(run%stop)) return
      associate (y => new%displacement(run%stepper%stop_dof), v => new%velocity(run%stepper%stop_dof))
         fades = v > 0.0_wp .and. new%force <= rounding_of_force(run%stop, abs(run%settings%preload) + abs(y), v)
      end associate
   end function fades

   !> Even the shortest step crosses the condition: the event is here.
   pure subroutine give_way(run, response)
      type(run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response

      character(24) :: tau_text

      run%refused_end = nowhere
      select case (run%phase)
      case (phase_free)
         write (tau_text, '(f24.9)') instant(run, run%progress)
         call fail(run%error, status_run_failed, 'the contact near tau = '//trim(adjustl(tau_text))// &
            ' cannot be located: even the step halved to its limit goes through the stop; '// &
            'contact_tolerance is too small, or the motion is not finite')
      case (phase_held)
         call release(run, response)
      case (phase_contact)
         call end_contact(run, response)
      end select
   end subroutine give_way

   !> Model A: the free stop point has come to the stop. A flight that stayed low ends where it began, in capture.
   pure subroutine strike(run, response)
      type(run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response

      if (run%judged) then
         call copy_state(run%flight_state, run%states(run%now))
         run%progress = run%flight_progress
         run%refused_end = nowhere
         call capture(run, response)
      else
         call rebound(run, response)
      end if
   end subroutine strike

   !> Model A: reverse the velocity by the restitution and begin a flight.
   pure subroutine rebound(run, response)
      type(run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response

      type(event_t) :: event
      real(wp) :: momentum

      associate (state => run%states(run%now), c => run%stepper%stop_dof, eps => run%settings%restitution)
         event = event_here(run, event_impact)
         event%velocity_after = -eps*event%velocity_before
         if (run%settings%impulse == impulse_nodal) then
            call momentum_at_stop(run%stepper, state, momentum)
            event%impulse = nodal_impulse(event%velocity_before, eps, run%stepper%mass_diagonal)
            event%energy_change = nodal_energy_change(event%velocity_before, eps, momentum, run%stepper%mass_diagonal)
         else
            call push(run, event, eps)
         end if
         state%velocity(c) = event%velocity_after
         call keep_event(run, event, response)
         if (allocated(run%error)) return
         if (state%velocity(c) > 0.0_wp) then
            call restart_acceleration(run%stepper, state, .false.)
            call shorten_next_step(run)
            if (allocated(run%error)) return
            run%judged = .true.
            run%armed = .true.
            run%peak = gap(run, state)
            call copy_state(state, run%flight_state)
            run%flight_progress = run%progress
         else
            call capture(run, response)
         end if
      end associate
   end subroutine rebound

   !> Model A: bring the stop point to rest and hold it, unless the stop would have to pull.
   pure subroutine capture(run, response)
      type(run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response

      type(event_t) :: event

      run%judged = .false.
      associate (state => run%states(run%now), c => run%stepper%stop_dof)
         event = event_here(run, event_capture)
         call push(run, event, 0.0_wp)
         event%velocity_after = 0.0_wp
         state%velocity(c) = 0.0_wp
         call restart_acceleration(run%stepper, state, .true.)
         call shorten_next_step(run)
         if (allocated(run%error)) return
         if (state%force > 0.0_wp) then
            run%phase = phase_held
            call keep_event(run, event, response)
         else
            ! with no impulse given (eps = 0) there was no capture to speak of
            if (abs(event%velocity_before) > 0.0_wp) call keep_event(run, event, response)
            if (allocated(run%error)) return
            run%phase = phase_free
            run%armed = .false.
            call restart_acceleration(run%stepper, state, .false.)
            if (abs(event%velocity_before) > 0.0_wp) call keep_event(run, event_here(run, event_release), response)
         end if
      end associate
   end subroutine capture

   !> Give the beam the impulse that turns v_c into -eps v_c.
   pure subroutine push(run, event, restitution)
      !> The run; the velocities change
      type(run_t), intent(inout) :: run
      !> Its impulse and energy change are set
      type(event_t), intent(inout) :: event
      !> eps
      real(wp), intent(in) :: restitution

      associate (stepper => run%stepper)
         event%impulse = rebound_impulse(event%velocity_before, restitution, stepper%mobility)
         event%energy_change = rebound_energy_change(event%velocity_before, restitution, stepper%mobility)
         associate (velocity => run%states(run%now)%velocity)
            velocity(1:stepper%order) = velocity(1:stepper%order) + event%impulse*stepper%mass_column
         end associate
      end associate
   end subroutine push

   !> The first step after an impulse is short, and the next ones grow.
   pure subroutine shorten_next_step(run)
      !> The run; its next step is bounded
      type(run_t), intent(inout) :: run

      if (run%impulse_level < 0) call find_impulse_level(run%stepper, run%impulse_level, run%error)
      run%next_level = run%impulse_level
   end subroutine shorten_next_step

   !> After an impulse the stiffest modes, strongly damped, come to rest within 1/(zeta omega^2). A long step would make
   !> them ring instead, and lose digits in their accelerations; so the first step should be that short.
   pure subroutine find_impulse_level(stepper, level, error)
      type(newmark_stepper_t), intent(in) :: stepper
      !> How often that step is halved
      integer, intent(out) :: level
      !> Set when the highest frequency is not found
      type(failure_t), allocatable, intent(inout) :: error

      real(wp) :: frequency

      level = 0
      if (stepper%double_zeta <= 0.0_wp) return
      call highest_frequency(stepper%stiffness, stepper%mass, stepper%stop_dof, 0.0_wp, frequency, error)
      if (.not. allocated(error)) level = level_of(stepper%step, 2.0_wp/(stepper%double_zeta*frequency**2))
   end subroutine find_impulse_level

   !> Model A: the held stop point leaves.
   pure subroutine release(run, response)
      type(run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response

      call restart_acceleration(run%stepper, run%states(run%now), .false.)
      run%phase = phase_free
      run%judged = .false.
      run%armed = .false.
      run%refused_end = nowhere
      call keep_event(run, event_here(run, event_release), response)
   end subroutine release

   !> Model B: contact begins, with P = 0.
   pure subroutine begin_contact(run, response)
      type(run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response

      run%contact_gap = gap(run, run%states(run%now))
      run%leaving = .false.
      run%phase = phase_contact
      run%refused_end = nowhere
      run%next_level = run%contact_level
      call keep_event(run, event_here(run, event_contact), response)
   end subroutine begin_contact

   !> Model B: contact ends. The surface springs back from the rest of the force and is then free.
   pure subroutine end_contact(run, response)
      type(run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response

      real(wp) :: before

      associate (state => run%states(run%now), ledger => run%progress%ledger)
         before = stop_energy(run, state)
         call run%stop%unload(state%indentation, state%branch_force)
         ledger%dissipated_stop = ledger%dissipated_stop + before - stop_energy(run, state)
         call restart_acceleration(run%stepper, state, .false.)
         run%phase = phase_free
         run%armed = gap_rate(run, state) > 0.0_wp
         run%leaving = gap(run, state) < -run%contact_tolerance
         run%refused_end = nowhere
         call keep_event(run, event_here(run, event_separation), response)
      end associate
   end subroutine end_contact

   !> An event at the present state; velocity before and after as it is now.
   pure function event_here(run, kind) result(event)
      type(run_t), intent(in) :: run
      !> One of the `event_` constants
      integer, intent(in) :: kind
      type(event_t) :: event

      associate (state => run%states(run%now), c => run%stepper%stop_dof)
         event%tau = instant(run, run%progress)
         event%kind = kind
         event%eta = state%displacement(c) - run%settings%preload
         event%velocity_before = state%velocity(c)
         event%velocity_after = state%velocity(c)
      end associate
   end function event_here

   !> Keep an event and what it did to the energy.
   pure subroutine keep_event(run, event, response)
      type(run_t), intent(inout) :: run
      type(event_t), intent(in) :: event
      !> Events
      type(response_t), intent(inout) :: response

      character(24) :: tau_text

      if (response%event_count >= run%event_limit) then
         write (tau_text, '(f24.9)') event%tau
         call fail(run%error, status_run_failed, 'more than event_limit = '//to_text(run%event_limit)// &
            ' events by tau = '//trim(adjustl(tau_text)))
         return
      end if
      call append_event(response, event)
      if (run%keeps_measures) call measure_event(run%progress%measurer, event, run%measures)
      call charge_event(run%progress%ledger, event%energy_change)
   end subroutine keep_event

end module newmark_events
