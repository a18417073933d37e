!> Impacts at rigid contacts of a finite-element beam. All contacts that are hit at one instant form one linear
!> complementarity problem for their impulses (module `impact_problem`). A contact captures the beam, that is, brings
!> the beam to rest without restitution, if the last flight from this contact stayed below the hop height. Roles
!> (`rebounds`, `comes_to_rest`, `stays_closed`) and outcomes (`is_hit`, `is_arrested`, `gets_impulse`, `is_released`)
!> of contacts are those of `impact_problem`.
module newmark_impacts
   use complementarity, only: solve_active
   use impact_problem, only: comes_to_rest, find_impulses, find_nodal_impulse, stays_closed, is_arrested, is_hit, &
      gets_impulse, &
      is_released, max_rounds, outcome_of, rebounds, impact_contact_t, add_impact_contact
   use kinds, only: wp
   use newmark_contacts, only: event_now, record_event, open_contact
   use newmark_energies, only: momentum_along
   use newmark_flights, only: cancel_flight
   use newmark_limits, only: highest_frequency
   use newmark_run, only: begins_now, gap_at, gap_rate_at, is_constrained, is_open, level_of, newmark_run_t, &
      no_rejection
   use newmark_stepper, only: impose_row_value, place_points_in_column
   use response_types, only: event_closed_impulse, event_capture, event_impact, event_release, event_t, response_t
   use run_settings, only: impulse_nodal
   implicit none (type, external)
   private
   public :: apply_impacts

contains

   !> Apply Newton's impact law to the contacts that are hit, to closed rigid contacts, and to every other contact that
   !> the beam touches without separating from it. If the impulses make the beam approach another contact, that contact
   !> takes part in the next impact problem at the same instant.
   pure subroutine apply_impacts(run, response)
      type(newmark_run_t), intent(inout) :: run
      !> Receives the events
      type(response_t), intent(inout) :: response

      type(impact_contact_t) :: struck(size(run%contacts))
      logical :: is_nodal, only_captures
      integer :: i, n, round

      call capture_low_flights(run, response)
      if (allocated(run%error)) return
      do round = 1, max_rounds
         call find_struck(run, round == max_rounds, struck, n, is_nodal)
         if (.not. any(struck(:n)%before < 0.0_wp)) return
         only_captures = .not. any(struck(:n)%role == rebounds)
         if (is_nodal) then
            call replace_velocities(run, struck(:n))
         else
            call distribute_impulses(run, struck(:n))
         end if
         do i = 1, n
            call after_impulse(run, struck(i), only_captures, response)
            if (allocated(run%error)) return
         end do
         call shorten_next_step(run)
         if (allocated(run%error)) return
      end do
   end subroutine apply_impacts


   !> Find the contacts that take part in an impact problem: if any of them applies Newton's law to the velocity of its
   !> node alone (`impulse_nodal`), only contacts that apply the law in this way; otherwise all.
   pure subroutine find_struck(run, is_last, struck, n, is_nodal)
      type(newmark_run_t), intent(in) :: run
      !> Whether this is the last round of impact problems, in which restitution is zero at every contact
      logical, intent(in) :: is_last
      !> The contacts of the problem, with their velocities before the impact
      type(impact_contact_t), intent(inout) :: struck(:)
      !> Number of these contacts
      integer, intent(out) :: n
      !> Whether the contacts replace nodal velocities
      logical, intent(out) :: is_nodal

      ! normal velocities at the contacts; < 0: the beam approaches the contact
      real(wp) :: rates(size(run%contacts))
      ! whether the beam touches each contact
      logical :: touched(size(run%contacts))
      ! normal velocity that is a rounding error of the fastest approach
      real(wp) :: rounding
      integer :: k, role

      do k = 1, size(rates)
         rates(k) = gap_rate_at(run, k, run%states(run%now))
         touched(k) = is_touched(run, k)
      end do
      ! a body that stands on its floor without a force does not separate from it by a rounding error
      rounding = 8.0_wp*epsilon(1.0_wp)*max(0.0_wp, maxval(-rates, mask=touched))
      n = 0
      do k = 1, size(rates)
         associate (contact => run%contacts(k), rate => rates(k))
            if (contact%status == is_constrained .or. contact%is_stopped) then
               role = stays_closed
            else
               if (.not. touched(k) .or. (rate > rounding .and. .not. is_last)) cycle
               role = rebounds
               ! a flight that begins at this instant (`begins_now`) has not been low yet, unless another low flight
               ! ends at this instant: two contacts between which the beam bounces ever faster capture it together
               if (is_last .or. rate >= 0.0_wp .or. (contact%may_be_captured .and. &
                  (contact%flight_events /= begins_now .or. any(run%contacts%is_captured)))) role = comes_to_rest
            end if
            call add_impact_contact(k, role, rate, contact%contact%settings%restitution, struck, n)
         end associate
      end do
      associate (nodal => struck(:n)%role == rebounds .and. &
         run%contacts(struck(:n)%contact)%contact%settings%impulse == impulse_nodal)
         is_nodal = any(nodal)
         if (.not. is_nodal) return
         struck(:count(nodal)) = pack(struck(:n), nodal)
         n = count(nodal)
      end associate
   end subroutine find_struck


   !> Capture the beam at contacts to which it returns from a low flight. If no event has occurred since the flight
   !> began, the capture takes place at the beginning of the flight. If each capture at one contact opens another
   !> contact, and all flights are low but interrupted by events, these contacts bring the beam to rest together.
   pure subroutine capture_low_flights(run, response)
      type(newmark_run_t), intent(inout) :: run
      !> Receives the events
      type(response_t), intent(inout) :: response

      ! a contact chatters (captures the beam again and again) after this number of captures without a flight above the
      ! hop height in between
      integer, parameter :: chatter_limit = 10
      logical, dimension(size(run%contacts)) :: chatters, captures_beam
      integer :: k

      captures_beam = run%arrives .and. run%contacts%may_be_captured .and. &
         run%contacts%flight_events == response%event_count
      if (any(captures_beam)) then
         ! the present state is now that at the beginning of the flight
         call cancel_flight(run)
         run%arrives = .false.
         call bring_to_rest(run, captures_beam, response)
         return
      end if
      chatters = run%contacts%captures >= chatter_limit
      if (.not. any(run%arrives .and. run%contacts%may_be_captured .and. chatters)) return
      chatters = chatters .and. [(run%contacts(k)%is_stopped .or. is_touched(run, k), k=1, size(run%contacts))]
      call bring_to_rest(run, chatters, response)
   end subroutine capture_low_flights


   !> Bring the beam to rest at the captured contacts by impulses at these and at the closed rigid contacts.
   pure subroutine bring_to_rest(run, captures_beam, response)
      type(newmark_run_t), intent(inout) :: run
      !> Whether each contact captures the beam; true for at least one
      logical, intent(in) :: captures_beam(:)
      !> Receives the events
      type(response_t), intent(inout) :: response

      ! indices of the n contacts with an impulse
      integer :: members(size(run%contacts))
      ! position in this list of the last contact that captures the beam
      integer :: last
      integer :: k, n
      ! impulses of these contacts
      real(wp), dimension(size(run%contacts)) :: impulse
      ! normal velocities of the beam at these contacts before the impulses
      real(wp), dimension(size(run%contacts)) :: rate
      type(event_t) :: event

      associate (state => run%states(run%now))
         n = 0
         last = 0
         do k = 1, size(run%contacts)
            if (.not. (captures_beam(k) .or. run%contacts(k)%status == is_constrained)) cycle
            n = n + 1
            if (captures_beam(k)) last = n
            members(n) = k
            rate(n) = gap_rate_at(run, k, state)
         end do
         call solve_active(run%mobility(members(:n), members(:n)), rate(:n), spread(.true., 1, n), impulse(:n))
         do k = 1, n
            state%beam%velocity(:) = state%beam%velocity + impulse(k)*run%mass_columns(:, members(k))
         end do
         do k = 1, n
            associate (contact => run%contacts(members(k)))
               call impose_row_value(run%stepper, contact%row, 0.0_wp, state%beam%velocity)
               if (contact%status == is_constrained) then
                  call record_closed_impulse(run, members(k), impulse(k), response)
                  if (allocated(run%error)) return
                  cycle
               end if
               contact%is_stopped = .true.
               contact%is_captured = .true.
               contact%captures = contact%captures + 1
               contact%may_be_captured = .false.
               contact%rejected_end = no_rejection
               event = event_now(run, members(k), event_capture)
               event%velocity_before = contact%row%sign*rate(k)
               event%impulse = impulse(k)
               ! the last event has the change of energy by all impulses, because that by a single impulse may have
               ! either sign
               if (k == last) event%energy_change = 0.5_wp*dot_product(impulse(:n), rate(:n))
               call record_event(run, members(k), event, response)
               if (allocated(run%error)) return
            end associate
         end do
      end associate
      call shorten_next_step(run)
   end subroutine bring_to_rest


   !> Shorten the first step after an impulse; the steps after it become longer again. The highest mode, strongly
   !> damped, comes to rest within 1/(zeta omega^2); with longer steps this mode would oscillate instead, and its
   !> accelerations would lose digits.
   pure subroutine shorten_next_step(run)
      type(newmark_run_t), intent(inout) :: run

      real(wp) :: frequency

      associate (stepper => run%stepper)
         if (run%impulse_level < 0) then
            run%impulse_level = 0
            if (stepper%stiffness_damping > 0.0_wp) then
               call highest_frequency(stepper%stiffness, stepper%mass, frequency, run%error)
               if (allocated(run%error)) return
               run%impulse_level = level_of(stepper%step, 2.0_wp/(stepper%stiffness_damping*frequency**2))
            end if
         end if
      end associate
      run%next_level = max(run%next_level, run%impulse_level)
   end subroutine shorten_next_step

   !> Whether a rigid contact is open, and the beam is within the contact tolerance of this contact.
   pure logical function is_touched(run, k) result(answer)
      type(newmark_run_t), intent(in) :: run
      !> Index of the contact
      integer, intent(in) :: k

      answer = .not. allocated(run%contacts(k)%stop) .and. run%contacts(k)%status == is_open
      if (answer) answer = run%arrives(k) .or. gap_at(run, k, run%states(run%now)) < run%contact_tolerance
   end function is_touched


   !> Replace the velocities of the nodes at the contacts by Newton's law, even if the energy increases.
   pure subroutine replace_velocities(run, struck)
      type(newmark_run_t), intent(inout) :: run
      !> The contacts; receive velocities and impulses
      type(impact_contact_t), intent(inout) :: struck(:)

      integer :: i
      ! change of the velocity of the node, upwards
      real(wp) :: jump
      ! mass of the node along the row of the contact
      real(wp) :: mass
      ! momentum of the node along this row
      real(wp) :: momentum

      associate (beam => run%states(run%now)%beam, n => run%stepper%order)
         do i = 1, size(struck)
            associate (row => run%contacts(struck(i)%contact)%row)
               if (allocated(run%modes)) then
                  call momentum_along(run%stepper, beam, row, momentum, mass, run%modes%nodal_mass(:n))
                  call find_nodal_impulse(mass, momentum, struck(i))
                  jump = row%sign*(struck(i)%after - struck(i)%before)
                  beam%velocity(1:n) = beam%velocity(1:n) + jump*run%modes%nodal_mass(:n)
                  call place_points_in_column(run%stepper, beam%velocity)
                  cycle
               end if
               call momentum_along(run%stepper, beam, row, momentum, mass)
               call find_nodal_impulse(mass, momentum, struck(i))
               call impose_row_value(run%stepper, row, struck(i)%after, beam%velocity)
            end associate
         end do
      end associate
   end subroutine replace_velocities


   !> Find the impulses that satisfy Newton's law, and add the velocities of the beam due to them.
   pure subroutine distribute_impulses(run, struck)
      type(newmark_run_t), intent(inout) :: run
      !> The contacts; receive velocities and impulses
      type(impact_contact_t), intent(inout) :: struck(:)

      integer :: i

      call find_impulses(run%mobility(struck%contact, struck%contact), struck)
      associate (velocity => run%states(run%now)%beam%velocity)
         do i = 1, size(struck)
            velocity(:) = velocity + struck(i)%impulse*run%mass_columns(:, struck(i)%contact)
         end do
         do i = 1, size(struck)
            if (struck(i)%impulse > 0.0_wp) call impose_row_value(run%stepper, run%contacts(struck(i)%contact)%row, &
               struck(i)%after, velocity)
         end do
      end associate
   end subroutine distribute_impulses


   !> Update one contact that took part in an impact, and record its event.
   pure subroutine after_impulse(run, struck, only_captures, response)
      type(newmark_run_t), intent(inout) :: run
      !> The contact, with its velocities and impulse
      type(impact_contact_t), intent(in) :: struck
      !> Whether every contact that was hit captured the beam
      logical, intent(in) :: only_captures
      !> Receives the events
      type(response_t), intent(inout) :: response

      type(event_t) :: event

      associate (k => struck%contact, contact => run%contacts(struck%contact))
         if (struck%role /= stays_closed) contact%may_close = .true.
         ! 0: every separating velocity counts, however small
         select case (outcome_of(struck, 0.0_wp))
         case (gets_impulse)
            call record_closed_impulse(run, k, struck%impulse, response)
         case (is_released)
            ! an open contact that the beam leaves without an impulse has no event
            if (struck%role /= stays_closed) return
            event = event_now(run, k, event_release)
            event%velocity_before = 0.0_wp
            if (contact%status == is_constrained .or. contact%is_captured) call record_event(run, k, event, response)
            call open_contact(run, k)
            contact%may_close = .true.
            call begin_flight(run, k)
            if (.not. only_captures) contact%captures = 0
         case (is_hit, is_arrested)
            event = event_now(run, k, merge(event_impact, event_capture, struck%role == rebounds))
            event%velocity_before = contact%row%sign*struck%before
            event%impulse = struck%impulse
            event%energy_change = struck%energy_change
            contact%is_captured = struck%role == comes_to_rest
            if (contact%is_captured) contact%captures = contact%captures + 1
            contact%is_stopped = .not. struck%after > 0.0_wp
            contact%may_be_captured = .false.
            if (.not. contact%is_stopped) call begin_flight(run, k)
            contact%rejected_end = no_rejection
            call record_event(run, k, event, response)
         end select
      end associate
   end subroutine after_impulse


   !> Begin a flight, which counts as a capture if it stays below the hop height.
   pure subroutine begin_flight(run, k)
      type(newmark_run_t), intent(inout) :: run
      !> Index of the contact
      integer, intent(in) :: k

      associate (contact => run%contacts(k))
         contact%may_be_captured = .true.
         contact%peak = gap_at(run, k, run%states(run%now))
         contact%flight_events = begins_now
      end associate
      run%begins_flight = .true.
   end subroutine begin_flight


   !> Record the impulse of a closed rigid contact during an impact at another contact.
   pure subroutine record_closed_impulse(run, k, impulse, response)
      type(newmark_run_t), intent(inout) :: run
      !> Index of the contact
      integer, intent(in) :: k
      real(wp), intent(in) :: impulse
      !> Receives the events
      type(response_t), intent(inout) :: response

      type(event_t) :: event

      event = event_now(run, k, event_closed_impulse)
      event%impulse = impulse
      call record_event(run, k, event, response)
   end subroutine record_closed_impulse

end module newmark_impacts
