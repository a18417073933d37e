!> Impacts at rigid contacts of a beam in its degrees of freedom.
module newmark_impacts
   use complementarity, only: solve_active
   use contact_rows, only: put_along
   use failures, only: failure_t
   use impact_problem, only: comes_to_rest, find_impulses, find_nodal_impulse, holds, is_arrested, is_hit, is_pushed, &
      is_thrown_off, most_rounds, outcome_of, rebounds, struck_t, take_part
   use kinds, only: wp
   use newmark_contacts, only: event_here, keep_event, open_contact
   use newmark_energies, only: momentum_along
   use newmark_flights, only: take_flight_back
   use newmark_run, only: begins_now, gap_at, gap_rate_at, is_constrained, is_open, level_of, newmark_run_t, nowhere
   use newmark_stability, only: highest_frequency
   use newmark_stepper, only: newmark_stepper_t
   use response_types, only: event_closed_impulse, event_capture, event_impact, event_release, event_t, response_t
   use run_settings, only: impulse_nodal
   implicit none (type, external)
   private
   public :: strike

contains

   !> Newton's law for the surfaces that are hit, those that hold the beam, and any other that it has reached, all of
   !> which it does not leave. Who is turned back by the impulses takes part in the next problem at the same instant.
   pure subroutine strike(run, response)
      type(newmark_run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response

      type(struck_t) :: struck(size(run%contacts))
      logical :: is_nodal, is_soft
      integer :: i, n, round

      call capture_low_flights(run, response)
      if (allocated(run%error)) return
      do round = 1, most_rounds
         call find_struck(run, round == most_rounds, struck, n, is_nodal)
         if (.not. any(struck(:n)%before < 0.0_wp)) return
         is_soft = .not. any(struck(:n)%part == rebounds)
         if (is_nodal) then
            call replace_velocities(run, struck(:n))
         else
            call share_impulse(run, struck(:n))
         end if
         do i = 1, n
            call after_impulse(run, struck(i), is_soft, response)
            if (allocated(run%error)) return
         end do
         call shorten_next_step(run)
         if (allocated(run%error)) return
      end do
   end subroutine strike


   !> What takes part in an impact: nodes whose velocities are replaced, as long as there are any, and then all others.
   pure subroutine find_struck(run, is_last, struck, n, is_nodal)
      type(newmark_run_t), intent(in) :: run
      !> No contact gives any velocity back
      logical, intent(in) :: is_last
      type(struck_t), intent(inout) :: struck(:)
      !> So many take part
      integer, intent(out) :: n
      logical, intent(out) :: is_nodal

      integer :: k, part
      real(wp) :: rate

      n = 0
      do k = 1, size(run%contacts)
         rate = gap_rate_at(run, k, run%states(run%now))
         associate (contact => run%contacts(k))
            if (contact%status == is_constrained .or. contact%is_stopped) then
               part = holds
            else
               if (.not. touches(run, k) .or. (rate > 0.0_wp .and. .not. is_last)) cycle
               part = rebounds
               if (is_last .or. rate >= 0.0_wp .or. (contact%judged .and. contact%flight_events /= begins_now)) then
                  part = comes_to_rest
               end if
            end if
            call take_part(k, part, rate, contact%contact%settings%restitution, struck, n)
         end associate
      end do
      associate (nodal => struck(:n)%part == rebounds .and. &
         run%contacts(struck(:n)%contact)%contact%settings%impulse == impulse_nodal)
         is_nodal = any(nodal)
         if (.not. is_nodal) return
         struck(:count(nodal)) = pack(struck(:n), nodal)
         n = count(nodal)
      end associate
   end subroutine find_struck


   !> Flights that stayed low, with no event since they began, end where they began, in capture. Where captures at one
   !> surface throw the beam off another again and again, flights that were interrupted but low all of them, those
   !> surfaces bring it to rest together.
   pure subroutine capture_low_flights(run, response)
      type(newmark_run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response

      integer, parameter :: patience = 10
      logical, dimension(size(run%contacts)) :: chatters, is_caught
      integer :: k

      is_caught = run%arrives .and. run%contacts%judged .and. run%contacts%flight_events == response%event_count
      if (any(is_caught)) then
         call take_flight_back(run)
         run%arrives = .false.
         call bring_to_rest(run, is_caught, response)
         return
      end if
      chatters = run%contacts%captures >= patience
      if (.not. any(run%arrives .and. run%contacts%judged .and. chatters)) return
      do k = 1, size(run%contacts)
         chatters(k) = chatters(k) .and. (run%contacts(k)%is_stopped .or. touches(run, k))
      end do
      call bring_to_rest(run, chatters, response)
   end subroutine capture_low_flights


   !> Bring the beam to rest at surfaces by impulses at them and at those that hold it.
   pure subroutine bring_to_rest(run, is_caught, response)
      type(newmark_run_t), intent(inout) :: run
      !> Of each surface; at least one
      logical, intent(in) :: is_caught(:)
      !> Events
      type(response_t), intent(inout) :: response

      integer :: members(size(run%contacts)), k, last, n
      real(wp), dimension(size(run%contacts)) :: impulse, rate
      type(event_t) :: event

      associate (state => run%states(run%now))
         n = 0
         last = 0
         do k = 1, size(run%contacts)
            if (.not. (is_caught(k) .or. run%contacts(k)%status == is_constrained)) cycle
            n = n + 1
            if (is_caught(k)) last = n
            members(n) = k
            rate(n) = gap_rate_at(run, k, state)
         end do
         call solve_active(run%mobility(members(:n), members(:n)), rate(:n), spread(.true., 1, n), impulse(:n))
         do k = 1, n
            state%beam%velocity(:) = state%beam%velocity + impulse(k)*run%mass_columns(:, members(k))
         end do
         do k = 1, n
            associate (contact => run%contacts(members(k)))
               call put_along(contact%row, 0.0_wp, state%beam%velocity)
               if (contact%status == is_constrained) then
                  call keep_blow(run, members(k), impulse(k), response)
                  if (allocated(run%error)) return
                  cycle
               end if
               contact%is_stopped = .true.
               contact%is_captured = .true.
               contact%captures = contact%captures + 1
               contact%judged = .false.
               contact%refused_end = nowhere
               event = event_here(run, members(k), event_capture)
               event%velocity_before = contact%row%sign*rate(k)
               event%impulse = impulse(k)
               ! one by one they may win what the others lose
               if (k == last) event%energy_change = 0.5_wp*dot_product(impulse(:n), rate(:n))
               call keep_event(run, members(k), event, response)
               if (allocated(run%error)) return
            end associate
         end do
      end associate
      call shorten_next_step(run)
   end subroutine bring_to_rest


   !> The first step after an impulse is short, and the next ones grow.
   pure subroutine shorten_next_step(run)
      type(newmark_run_t), intent(inout) :: run

      if (run%impulse_level < 0) call find_impulse_level(run%stepper, run%impulse_level, run%error)
      run%next_level = max(run%next_level, run%impulse_level)
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
      call highest_frequency(stepper%stiffness, stepper%mass, frequency, error)
      if (.not. allocated(error)) level = level_of(stepper%step, 2.0_wp/(stepper%double_zeta*frequency**2))
   end subroutine find_impulse_level

   !> Is a rigid contact open, and does the beam touch it?
   pure function touches(run, k) result(answer)
      type(newmark_run_t), intent(in) :: run
      !> The contact
      integer, intent(in) :: k
      logical :: answer

      answer = .not. allocated(run%contacts(k)%stop) .and. run%contacts(k)%status == is_open
      if (answer) answer = run%arrives(k) .or. gap_at(run, k, run%states(run%now)) < run%contact_tolerance
   end function touches


   !> The nodal reading of impacts: a velocity is replaced, whatever that does to the beam beside it.
   pure subroutine replace_velocities(run, struck)
      type(newmark_run_t), intent(inout) :: run
      type(struck_t), intent(inout) :: struck(:)

      integer :: i
      real(wp) :: mass, momentum

      associate (beam => run%states(run%now)%beam)
         do i = 1, size(struck)
            associate (row => run%contacts(struck(i)%contact)%row)
               call momentum_along(run%stepper, beam, row, momentum, mass)
               call find_nodal_impulse(mass, momentum, struck(i))
               call put_along(row, struck(i)%after, beam%velocity)
            end associate
         end do
      end associate
   end subroutine replace_velocities


   !> Impulses by the mobility of the contacts.
   pure subroutine share_impulse(run, struck)
      type(newmark_run_t), intent(inout) :: run
      type(struck_t), intent(inout) :: struck(:)

      integer :: i

      call find_impulses(run%mobility(struck%contact, struck%contact), struck)
      associate (velocity => run%states(run%now)%beam%velocity)
         do i = 1, size(struck)
            velocity(:) = velocity + struck(i)%impulse*run%mass_columns(:, struck(i)%contact)
         end do
         do i = 1, size(struck)
            if (struck(i)%impulse > 0.0_wp) call put_along(run%contacts(struck(i)%contact)%row, struck(i)%after, &
               velocity)
         end do
      end associate
   end subroutine share_impulse


   !> What an impact has made of one surface that took part.
   pure subroutine after_impulse(run, struck, is_soft, response)
      type(newmark_run_t), intent(inout) :: run
      type(struck_t), intent(in) :: struck
      !> No surface was hit but to be captured
      logical, intent(in) :: is_soft
      !> Events
      type(response_t), intent(inout) :: response

      type(event_t) :: event

      associate (k => struck%contact, contact => run%contacts(struck%contact))
         if (struck%part /= holds) contact%armed = .true.
         select case (outcome_of(struck, 0.0_wp))
         case (is_pushed)
            call keep_blow(run, k, struck%impulse, response)
         case (is_thrown_off)
            if (struck%part /= holds) return
            event = event_here(run, k, event_release)
            event%velocity_before = 0.0_wp
            if (contact%status == is_constrained .or. contact%is_captured) call keep_event(run, k, event, response)
            call open_contact(run, k)
            contact%armed = .true.
            call begin_flight(run, k)
            if (.not. is_soft) contact%captures = 0
         case (is_hit, is_arrested)
            event = event_here(run, k, merge(event_impact, event_capture, struck%part == rebounds))
            event%velocity_before = contact%row%sign*struck%before
            event%impulse = struck%impulse
            event%energy_change = struck%energy_change
            contact%is_captured = struck%part == comes_to_rest
            if (contact%is_captured) contact%captures = contact%captures + 1
            contact%is_stopped = .not. struck%after > 0.0_wp
            contact%judged = .false.
            if (.not. contact%is_stopped) call begin_flight(run, k)
            contact%refused_end = nowhere
            call keep_event(run, k, event, response)
         end select
      end associate
   end subroutine after_impulse


   !> A flight begins that is a capture if it stays low.
   pure subroutine begin_flight(run, k)
      type(newmark_run_t), intent(inout) :: run
      !> The contact
      integer, intent(in) :: k

      associate (contact => run%contacts(k))
         contact%judged = .true.
         contact%peak = gap_at(run, k, run%states(run%now))
         contact%flight_events = begins_now
      end associate
      run%begins_flight = .true.
   end subroutine begin_flight


   !> What a surface on which the stop point is at rest gives the beam as others are hit.
   pure subroutine keep_blow(run, k, impulse, response)
      type(newmark_run_t), intent(inout) :: run
      !> The contact
      integer, intent(in) :: k
      real(wp), intent(in) :: impulse
      !> Events
      type(response_t), intent(inout) :: response

      type(event_t) :: event

      event = event_here(run, k, event_closed_impulse)
      event%impulse = impulse
      call keep_event(run, k, event, response)
   end subroutine keep_blow

end module newmark_impacts
