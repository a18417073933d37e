!> Onsets and ends of contact at the end of a Newmark step. A step that would violate a contact condition is halved
!> until the gap or the contact force at its end lies within a tolerance of zero; the contact then closes or opens at
!> the end of the step.
module newmark_events
   use contact_rows, only: row_value
   use failures, only: fail, status_run_failed
   use kinds, only: wp
   use newmark_contacts, only: begin_contact, end_contact, event_now, record_event, open_contact, resolve_contacts
   use newmark_impacts, only: apply_impacts
   use newmark_run, only: gap_at, gap_rate_at, instant_of, is_constrained, is_inactive, is_in_contact, is_unloaded, &
      is_open, is_force_free, spring_damper_force, force_rounding_at, newmark_run_t, no_rejection, &
      run_state_t
   use number_text, only: rounded, to_text
   use response_types, only: event_capture, event_release, response_t
   use step_intervals, only: cubic_of, maximum_of
   implicit none (type, external)
   private
   public :: find_events, trigger_events, begin_and_end_contacts, close_touched

   !> The beam is at rest on a contact if the gap, and the change of the gap over an undivided step by its rate or by
   !> its acceleration, do not exceed this value, in the unit of displacement. During the shortest steps the gap of a
   !> moving beam changes less, too.
   real(wp), parameter :: at_rest = 1.0e-13_wp

contains

   !> Find the contacts that close or open at the end of an accepted step.
   pure subroutine find_events(run, step, response)
      type(newmark_run_t), intent(inout) :: run
      !> Length of the step, tau
      real(wp), intent(in) :: step
      !> Receives the events
      type(response_t), intent(inout) :: response

      integer :: k
      ! a contact closes or opens
      logical :: has_event

      has_event = .false.
      do k = 1, size(run%contacts)
         run%arrives(k) = .false.
         run%leaves(k) = .false.
         select case (run%contacts(k)%status)
         case (is_open)
            call check_open(run, k, step)
         case (is_constrained, is_in_contact)
            if (run%event_ahead(k)) run%leaves(k) = is_vanishing(run, k)
         case (is_unloaded)
            call check_unloaded(run, k)
         case (is_inactive)
            ! another rigid contact lies in front of this contact, which therefore never closes
            cycle
         end select
         has_event = has_event .or. run%arrives(k) .or. run%leaves(k)
      end do
      if (has_event) call begin_and_end_contacts(run, response)
   end subroutine find_events


   !> Whether the force of a closed contact is small enough to open the contact, after a longer step made the force
   !> tensile. A rising force marks the beginning of a contact, not its end. At a stiff stop the release force may be
   !> smaller than the rounding error of the contact force, so that no short step shows whether the force rises; the
   !> velocity then decides.
   pure logical function is_vanishing(run, k)
      type(newmark_run_t), intent(in) :: run
      !> Index of the contact
      integer, intent(in) :: k

      associate (old => run%states(3 - run%now), new => run%states(run%now), contact => run%contacts(k))
         is_vanishing = new%force(k) < run%release_force .and. new%force(k) < old%force(k)
         if (.not. allocated(contact%stop)) return
         if (is_vanishing .and. contact%is_viscous) is_vanishing = is_force_free(run, k, new)
         is_vanishing = is_vanishing .or. (row_value(contact%row, new%beam%velocity) > 0.0_wp .and. &
            new%force(k) <= force_rounding_at(run, k, new))
      end associate
   end function is_vanishing


   !> Of the open contacts that the beam touches at rest, close the contact that a trial step penetrates most: a load
   !> begins to press the beam onto it. The contact closes at the beginning of the step, because otherwise the load
   !> would accelerate the beam until the penetration exceeds the contact tolerance, and the beam would then bounce.
   pure subroutine close_touched(run, response, has_closed)
      type(newmark_run_t), intent(inout) :: run
      !> Receives the event
      type(response_t), intent(inout) :: response
      !> Whether a contact has closed
      logical, intent(out) :: has_closed

      ! a penetration up to this value is a rounding error
      real(wp), parameter :: min_penetration = 1.0e-14_wp
      ! a penetration up to this fraction of the maximum displacement over the step is a rounding error
      real(wp), parameter :: rounding = 1.0e-12_wp
      real(wp) :: gap, lowest
      integer :: k, closing

      lowest = -min_penetration
      closing = 0
      associate (old => run%states(run%now), new => run%states(3 - run%now))
         do k = 1, size(run%contacts)
            if (run%contacts(k)%status /= is_open .or. .not. run%contacts(k)%may_close) cycle
            if (.not. lies_at_rest(run, k, old)) cycle
            ! the acceleration lifts the beam off the contact at first
            if (run%stepper%step**2*row_value(run%contacts(k)%row, old%beam%acceleration) > at_rest) cycle
            gap = gap_at(run, k, new)
            if (gap >= lowest) cycle
            if (-gap < rounding*maxval(abs(new%beam%displacement - old%beam%displacement))) cycle
            lowest = gap
            closing = k
         end do
         has_closed = closing > 0
         if (.not. has_closed) return
         associate (contact => run%contacts(closing))
            if (allocated(contact%stop)) then
               call begin_contact(run, closing, response)
            else if (run%stepper%step**2*row_value(contact%row, old%beam%acceleration) < -at_rest) then
               contact%is_stopped = .true.
               call resolve_contacts(run, response)
            else
               ! a load that grows from zero has no reaction yet
               contact%status = is_constrained
               contact%may_be_captured = .false.
               contact%rejected_end = no_rejection
               call record_event(run, closing, event_now(run, closing, event_capture), response)
            end if
         end associate
      end associate
   end subroutine close_touched


   !> Whether the beam touches a contact and moves by rounding errors only.
   pure logical function lies_at_rest(run, k, state) result(lies)
      type(newmark_run_t), intent(in) :: run
      !> Index of the contact
      integer, intent(in) :: k
      type(run_state_t), intent(in) :: state

      lies = abs(gap_at(run, k, state)) <= at_rest .and. run%stepper%step*abs(gap_rate_at(run, k, state)) <= at_rest
   end function lies_at_rest


   !> Mark an open contact as closing if the beam arrives at it, and update the peak of its flight.
   pure subroutine check_open(run, k, step)
      type(newmark_run_t), intent(inout) :: run
      !> Index of the contact
      integer, intent(in) :: k
      !> Length of the step, tau
      real(wp), intent(in) :: step

      real(wp) :: gap, rate

      associate (old => run%states(3 - run%now), new => run%states(run%now), contact => run%contacts(k))
         gap = gap_at(run, k, new)
         rate = gap_rate_at(run, k, new)
         if (contact%may_be_captured) then
            contact%peak = max(contact%peak, maximum_of(cubic_of([gap_at(run, k, old), gap], &
               step*[gap_rate_at(run, k, old), rate])))
            if (contact%peak > run%hop_height) contact%may_be_captured = .false.
         end if
         ! captures are counted between flights above the hop height
         if (gap > run%hop_height) contact%captures = 0
         contact%is_penetrating = gap < -run%contact_tolerance
         if (gap >= run%contact_tolerance .or. lies_at_rest(run, k, new)) then
            contact%may_close = .true.
         else if (rate < 0.0_wp .and. (contact%may_close .or. run%event_ahead(k) .or. contact%is_penetrating)) then
            run%arrives(k) = .true.
         else if (rate > 0.0_wp) then
            contact%may_close = .true.
         end if
      end associate
   end subroutine check_open


   !> Open the contact of an unloaded spring and damper if the beam has left the stop, or mark the contact as closing if
   !> its force is compressive again.
   pure subroutine check_unloaded(run, k)
      type(newmark_run_t), intent(inout) :: run
      !> Index of the contact
      integer, intent(in) :: k

      real(wp) :: force

      associate (old => run%states(3 - run%now), new => run%states(run%now), contact => run%contacts(k))
         if (new%indentation(k) <= 0.0_wp) then
            call open_contact(run, k)
            return
         end if
         force = spring_damper_force(run, k, new)
         if (force <= 0.0_wp) then
            contact%may_close = .true.
         else if (force > spring_damper_force(run, k, old)) then
            run%arrives(k) = contact%may_close .or. run%event_ahead(k)
         end if
      end associate
   end subroutine check_unloaded


   !> Open or close contacts at the present state, because even the shortest step violates a contact condition.
   pure subroutine trigger_events(run, response)
      type(newmark_run_t), intent(inout) :: run
      !> Receives the events
      type(response_t), intent(inout) :: response

      integer :: k

      run%leaves = run%violates .and. (run%contacts%status == is_constrained .or. run%contacts%status == is_in_contact)
      run%arrives = run%violates .and. run%contacts%status == is_unloaded
      ! if only open contacts are violated, the beam goes through a stop within the shortest step: the run fails
      if (any(run%arrives) .or. any(run%leaves)) then
         call begin_and_end_contacts(run, response)
         return
      end if
      k = findloc(run%violates, .true., dim=1)
      call fail(run%error, status_run_failed, 'the contact near tau = '//rounded(instant_of(run))//' at '// &
         to_text(run%contacts(k)%contact%settings%position)//' cannot be located: even the step halved to its limit &
      &goes through the stop; contact_tolerance is too small, or the motion is not finite')
   end subroutine trigger_events


   !> Close the contacts marked in `arrives` and open those marked in `leaves` at the present instant.
   pure subroutine begin_and_end_contacts(run, response)
      type(newmark_run_t), intent(inout) :: run
      !> Receives the events
      type(response_t), intent(inout) :: response

      integer :: k

      do k = 1, size(run%contacts)
         if (.not. run%leaves(k)) cycle
         if (run%contacts(k)%status == is_constrained) then
            call open_contact(run, k)
            call record_event(run, k, event_now(run, k, event_release), response)
         else
            call end_contact(run, k, response)
         end if
      end do
      ! compliant contacts close; rigid contacts at which the beam arrives remain for the impact problem
      do k = 1, size(run%contacts)
         if (.not. allocated(run%contacts(k)%stop)) cycle
         if (run%arrives(k)) call begin_contact(run, k, response)
         run%arrives(k) = .false.
      end do
      if (any(run%arrives)) call apply_impacts(run, response)
      if (.not. allocated(run%error)) call resolve_contacts(run, response)
   end subroutine begin_and_end_contacts

end module newmark_events
