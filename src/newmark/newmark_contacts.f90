!> Changes of contact status at the present state of a Newmark run, and the events that record them: a compliant contact
!> opens or closes by the sign of its force, a rigid contact by the complementarity of reactions and accelerations.
!>
!> The flags of a contact are components of `contact_progress_t` (module `newmark_run`), which explains each of them.
module newmark_contacts
   use complementarity, only: solve_complementarity
   use compliant_stop, only: contact_force
   use contact_measures, only: measure_impulse
   use contact_rows, only: row_value
   use failures, only: fail, status_run_failed
   use kinds, only: wp
   use newmark_run, only: gap_at, gap_rate_at, instant_of, is_constrained, is_in_contact, is_unloaded, is_open, &
      is_force_free, spring_damper_force, no_rejection, no_stored_start, newmark_run_t, contact_energy
   use newmark_stepper, only: impose_row_value, restart_acceleration
   use number_text, only: rounded, to_text
   use response_types, only: append_event, event_closed_impulse, event_capture, event_contact, event_impact, &
      event_release, &
      event_separation, event_t, is_contact_end, response_t
   use run_recorder, only: charge_event
   implicit none (type, external)
   private
   public :: open_contact, begin_contact, end_contact, resolve_contacts, event_now, record_event

contains

   !> Open a contact at the present state.
   pure subroutine open_contact(run, k)
      type(newmark_run_t), intent(inout) :: run
      !> Index of the contact
      integer, intent(in) :: k

      associate (state => run%states(run%now), contact => run%contacts(k))
         contact%status = is_open
         ! only a flight that an impact or an impulse begins may count as a capture; the caller then sets
         ! `may_be_captured`
         contact%may_be_captured = .false.
         contact%is_stopped = .false.
         contact%shift = 0.0_wp
         ! steps that were rejected because of the closed contact announce no event of the open contact
         contact%rejected_end = no_rejection
         state%force(k) = 0.0_wp
         if (contact%is_viscous) then
            state%indentation(k) = 0.0_wp
            state%branch_force(k) = 0.0_wp
         end if
         ! a rigid contact may close again only after the gap has grown, a compliant contact already if the gap grows
         ! now
         contact%may_close = allocated(contact%stop) .and. gap_rate_at(run, k, state) > 0.0_wp
         contact%is_penetrating = gap_at(run, k, state) < -run%contact_tolerance
      end associate
   end subroutine open_contact


   !> Close a compliant contact. The force of a three-element stop starts at zero; the force of a spring and damper
   !> starts at the damper's force, or, if the stop was deformed but unloaded, at its present small force.
   pure subroutine begin_contact(run, k, response)
      type(newmark_run_t), intent(inout) :: run
      !> Index of the contact
      integer, intent(in) :: k
      !> Receives the events
      type(response_t), intent(inout) :: response

      associate (contact => run%contacts(k))
         if (contact%status == is_open) contact%shift = gap_at(run, k, run%states(run%now))
         contact%is_penetrating = .false.
         contact%status = is_in_contact
         contact%rejected_end = no_rejection
         ! the contact force changes within its time constant, which the first step resolves
         run%next_level = max(run%next_level, contact%contact_level)
      end associate
      call record_event(run, k, event_now(run, k, event_contact), response)
   end subroutine begin_contact


   !> End the force of a compliant contact. A three-element stop then relaxes without force; a spring and damper stays
   !> unloaded until the beam leaves the stop.
   pure subroutine end_contact(run, k, response)
      type(newmark_run_t), intent(inout) :: run
      !> Index of the contact
      integer, intent(in) :: k
      !> Receives the events
      type(response_t), intent(inout) :: response

      ! energy dissipated when the stop releases its remaining force
      real(wp) :: lost

      associate (state => run%states(run%now), contact => run%contacts(k))
         if (contact%is_viscous .and. state%indentation(k) > 0.0_wp) then
            contact%status = is_unloaded
            contact%may_close = .false.
            contact%rejected_end = no_rejection
            state%force(k) = 0.0_wp
         else
            lost = contact_energy(run, k, state)
            call contact%stop%unload(state%indentation(k), state%branch_force(k))
            lost = lost - contact_energy(run, k, state)
            run%energy_balance%dissipated_stop = run%energy_balance%dissipated_stop + lost
            contact%dissipated = contact%dissipated + lost
            call open_contact(run, k)
         end if
      end associate
      call record_event(run, k, event_now(run, k, event_separation), response)
   end subroutine end_contact


   !> Find forces and accelerations from the equation of motion, and which contacts stay closed: compliant contacts by
   !> the sign of their force; closed rigid contacts, and those at which an impact stopped the beam, by the
   !> complementarity of reactions and accelerations.
   pure subroutine resolve_contacts(run, response)
      type(newmark_run_t), intent(inout) :: run
      !> Receives the events
      type(response_t), intent(inout) :: response

      ! reactions of the n rigid contacts
      real(wp) :: reaction(size(run%contacts))
      ! normal accelerations without reactions at the n rigid contacts
      real(wp) :: free_acceleration(size(run%contacts))
      ! indices of the n rigid contacts in the complementarity problem
      integer :: members(size(run%contacts))
      integer :: k, n
      logical :: is_closed(size(run%contacts))

      call update_compliant_contacts(run, response)
      associate (state => run%states(run%now))
         call restart_acceleration(run%stepper, state%beam)
         n = 0
         do k = 1, size(run%contacts)
            associate (contact => run%contacts(k))
               if (contact%status == is_in_contact) call accelerate(state%beam%acceleration, k, state%force(k))
               if (contact%status /= is_constrained .and. .not. contact%is_stopped) cycle
               n = n + 1
               members(n) = k
            end associate
         end do
         if (n == 0) return
         free_acceleration(:n) = [(row_value(run%contacts(members(k))%row, state%beam%acceleration), k=1, n)]
         call solve_complementarity(run%mobility(members(:n), members(:n)), free_acceleration(:n), reaction(:n), &
            is_closed(:n))
         do k = 1, n
            call accelerate(state%beam%acceleration, members(k), reaction(k))
         end do
         do k = 1, n
            if (reaction(k) > 0.0_wp) call impose_row_value(run%stepper, run%contacts(members(k))%row, 0.0_wp, &
               state%beam%acceleration)
            call close_or_release(run, members(k), reaction(k), response)
            if (allocated(run%error)) return
         end do
      end associate

   contains

      !> Add the acceleration due to a contact force.
      pure subroutine accelerate(acceleration, k, force)
         real(wp), intent(inout) :: acceleration(:)
         !> Index of the contact
         integer, intent(in) :: k
         real(wp), intent(in) :: force

         acceleration = acceleration + force*run%mass_columns(:, k)
      end subroutine accelerate

   end subroutine resolve_contacts


   !> Update the forces of compliant contacts, because the force of a spring and damper jumps if the velocity jumps.
   !> This jump may open or close the contact.
   pure subroutine update_compliant_contacts(run, response)
      type(newmark_run_t), intent(inout) :: run
      !> Receives the events
      type(response_t), intent(inout) :: response

      real(wp) :: force
      integer :: k

      associate (state => run%states(run%now))
         do k = 1, size(run%contacts)
            associate (contact => run%contacts(k))
               if (.not. allocated(contact%stop)) cycle
               if (contact%is_viscous .and. (contact%status == is_in_contact .or. contact%status == is_unloaded)) then
                  force = spring_damper_force(run, k, state)
                  if (contact%status == is_in_contact .and. force < 0.0_wp) call end_contact(run, k, response)
                  ! the force of a contact that leaves may exceed the release force: it ends in the shortest step
                  if (contact%status == is_unloaded .and. .not. run%leaves(k)) then
                     if (.not. is_force_free(run, k, state)) call begin_contact(run, k, response)
                  end if
                  if (contact%status == is_in_contact) then
                     state%branch_force(k) = force - contact%stop%stiffness*state%indentation(k)
                  end if
               end if
               if (contact%status == is_in_contact) then
                  state%force(k) = contact_force(contact%stop, state%indentation(k), state%branch_force(k))
               end if
            end associate
         end do
      end associate
   end subroutine update_compliant_contacts


   !> Close a rigid contact if its reaction is compressive; otherwise open the contact.
   pure subroutine close_or_release(run, k, reaction, response)
      type(newmark_run_t), intent(inout) :: run
      !> Index of the contact
      integer, intent(in) :: k
      real(wp), intent(in) :: reaction
      !> Receives the events
      type(response_t), intent(inout) :: response

      logical :: was_constrained, was_captured

      associate (contact => run%contacts(k), state => run%states(run%now))
         was_constrained = contact%status == is_constrained
         was_captured = contact%is_captured
         if (reaction > 0.0_wp) then
            state%force(k) = reaction
            contact%status = is_constrained
            contact%may_be_captured = .false.
            contact%rejected_end = no_rejection
            if (.not. (was_constrained .or. contact%is_captured)) then
               call record_event(run, k, event_now(run, k, event_capture), response)
            end if
         else
            call open_contact(run, k)
            ! during a low flight from another contact, the flight continues the low flights before the capture, so it
            ! is not cancelled but captured: two contacts between which the beam bounces ever faster capture it together
            contact%may_be_captured = was_captured .and. any(run%contacts%may_be_captured)
            contact%peak = gap_at(run, k, state)
            contact%flight_events = no_stored_start
            if (was_constrained .or. was_captured) call record_event(run, k, event_now(run, k, event_release), response)
         end if
         contact%is_stopped = .false.
         contact%is_captured = .false.
      end associate
   end subroutine close_or_release


   !> An event at the present state; the velocity after the event equals the velocity before.
   pure type(event_t) function event_now(run, k, kind) result(event)
      type(newmark_run_t), intent(in) :: run
      !> Index of the contact
      integer, intent(in) :: k
      !> One of the `event_` constants
      integer, intent(in) :: kind

      associate (state => run%states(run%now)%beam, contact => run%contacts(k))
         event%tau = instant_of(run)
         event%kind = kind
         event%eta = contact%row%sign*(row_value(contact%row, state%displacement) - contact%contact%height)
         event%velocity_before = contact%row%sign*row_value(contact%row, state%velocity)
         event%velocity_after = event%velocity_before
         event%contact = contact%contact%number
      end associate
   end function event_now


   !> Record an event, and add its change of energy to the energy balance.
   pure subroutine record_event(run, k, event, response)
      type(newmark_run_t), intent(inout) :: run
      !> Index of the contact
      integer, intent(in) :: k
      type(event_t), intent(in) :: event
      !> Receives the events
      type(response_t), intent(inout) :: response

      if (response%event_count >= run%event_limit) then
         call fail(run%error, status_run_failed, 'more than event_limit = '//to_text(run%event_limit)// &
            ' events by tau = '//rounded(event%tau)//': raise event_limit if so many are expected')
         return
      end if
      call append_event(response, event)
      call charge_event(run%energy_balance, event%energy_change)
      associate (contact => run%contacts(k))
         contact%dissipated = contact%dissipated - event%energy_change
         contact%lost_at_impacts = contact%lost_at_impacts - event%energy_change
         if (any(event%kind == [event_impact, event_capture, event_closed_impulse])) call measure_impulse( &
            run%observers%measures, k, event%tau, event%impulse)
         if (event%kind == event_impact .or. is_contact_end(event%kind)) contact%flights = contact%flights + 1
      end associate
   end subroutine record_event

end module newmark_contacts
