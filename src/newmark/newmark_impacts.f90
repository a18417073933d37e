!> Impacts at rigid contacts: Newton's law as one complementarity problem of velocities and impulses.
module newmark_impacts
   use complementarity, only: solve_complementarity
   use contact_rows, only: put_along
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use newmark_contacts, only: event_here, keep_event, open_contact
   use newmark_energies, only: momentum_along
   use newmark_flights, only: take_flight_back
   use newmark_run, only: begins_now, gap_at, gap_rate_at, instant_of, is_held, is_open, level_of, &
      nowhere, newmark_run_t
   use newmark_stability, only: highest_frequency
   use newmark_stepper, only: newmark_stepper_t
   use newmark_steps, only: eliminate
   use number_text, only: to_text
   use response_types, only: event_blow, event_capture, event_impact, event_release, event_t, response_t
   use restitution_stop, only: nodal_energy_change, nodal_impulse
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

      ! from here on no surface gives any velocity back, and those that the beam leaves take part as well
      integer, parameter :: patience = 50
      integer, parameter :: most_rounds = 2*patience
      real(wp), dimension(size(run%contacts)) :: rate, restitution, impulse
      integer :: members(size(run%contacts)), k, n, round
      logical :: has_hit, is_soft

      call capture_low_flights(run, response)
      if (allocated(run%error)) return
      do round = 1, most_rounds
         call replace_velocities(run, response)
         if (allocated(run%error)) return
         n = 0
         has_hit = .false.
         is_soft = .true.
         do k = 1, size(run%contacts)
            if (.not. takes_part(run, k, round > patience)) cycle
            n = n + 1
            members(n) = k
            rate(n) = gap_rate_at(run, k, run%states(run%now))
            associate (contact => run%contacts(k))
               if (contact%status == is_held .or. contact%is_stopped) rate(n) = 0.0_wp
               restitution(n) = contact%surface%settings%restitution
               if (contact%judged .or. rate(n) >= 0.0_wp .or. round > patience) restitution(n) = 0.0_wp
               has_hit = has_hit .or. rate(n) < 0.0_wp
               is_soft = is_soft .and. (contact%judged .or. rate(n) >= 0.0_wp)
            end associate
         end do
         if (.not. has_hit) return
         call share_impulse(run, members(:n), rate(:n), restitution(:n), impulse(:n))
         do k = 1, n
            call after_impulse(run, members(k), rate(k), impulse(k), &
               0.5_wp*impulse(k)*(rate(k) + gap_rate_at(run, members(k), run%states(run%now))), is_soft, response)
            if (allocated(run%error)) return
         end do
         call shorten_next_step(run)
         if (allocated(run%error)) return
      end do
      call fail(run%error, status_run_failed, 'the impacts at tau = '//to_text(instant_of(run))// &
         ' do not come to an end')
   end subroutine strike


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
         chatters(k) = chatters(k) .and. run%contacts(k)%status /= is_held .and. takes_part(run, k, leaving_too=.true.)
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
            if (.not. (is_caught(k) .or. run%contacts(k)%status == is_held)) cycle
            n = n + 1
            if (is_caught(k)) last = n
            members(n) = k
            rate(n) = gap_rate_at(run, k, state)
         end do
         impulse(:n) = -rate(:n)
         run%rows(:n, :n) = run%mobility(members(:n), members(:n))
         call eliminate(run%rows, impulse, n)
         do k = 1, n
            state%beam%velocity(:) = state%beam%velocity + impulse(k)*run%mass_columns(:, members(k))
         end do
         do k = 1, n
            associate (contact => run%contacts(members(k)))
               call put_along(contact%row, 0.0_wp, state%beam%velocity)
               if (contact%status == is_held) then
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
      call highest_frequency(stepper%stiffness, stepper%mass, stepper%stop_dof, 0.0_wp, frequency, error)
      if (.not. allocated(error)) level = level_of(stepper%step, 2.0_wp/(stepper%double_zeta*frequency**2))
   end subroutine find_impulse_level

   !> Does a surface take part in an impact?
   pure function takes_part(run, k, leaving_too) result(answer)
      type(newmark_run_t), intent(in) :: run
      !> The contact
      integer, intent(in) :: k
      !> Even where the beam leaves it
      logical, intent(in) :: leaving_too
      logical :: answer

      associate (contact => run%contacts(k), state => run%states(run%now))
         answer = .false.
         if (allocated(contact%stop)) return
         answer = contact%status == is_held .or. contact%is_stopped
         if (answer .or. contact%status /= is_open) return
         answer = (run%arrives(k) .or. gap_at(run, k, state) < run%contact_tolerance) .and. &
            (leaving_too .or. gap_rate_at(run, k, state) <= 0.0_wp)
      end associate
   end function takes_part


   !> The nodal reading of impacts: a velocity is replaced, whatever that does to the beam beside it.
   pure subroutine replace_velocities(run, response)
      type(newmark_run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response

      integer :: k
      real(wp) :: mass, momentum, rate

      associate (beam => run%states(run%now)%beam)
         do k = 1, size(run%contacts)
            associate (contact => run%contacts(k), own => run%contacts(k)%surface%settings)
               rate = gap_rate_at(run, k, run%states(run%now))
               if (own%impulse /= impulse_nodal .or. contact%status /= is_open .or. contact%judged) cycle
               if (.not. (rate < 0.0_wp .and. takes_part(run, k, leaving_too=.false.))) cycle
               call momentum_along(run%stepper, beam, contact%row, momentum, mass)
               call put_along(contact%row, -own%restitution*rate, beam%velocity)
               call after_impulse(run, k, rate, nodal_impulse(rate, own%restitution, mass), &
                  nodal_energy_change(rate, own%restitution, momentum, mass), .false., response)
               if (.not. allocated(run%error)) call shorten_next_step(run)
               if (allocated(run%error)) return
            end associate
         end do
      end associate
   end subroutine replace_velocities


   !> Impulses such that no rate falls below -eps times that before, and where it rises above there is none.
   pure subroutine share_impulse(run, members, rate, restitution, impulse)
      type(newmark_run_t), intent(inout) :: run
      !> Surfaces taking part
      integer, intent(in) :: members(:)
      !> Rates of their gaps before, and eps
      real(wp), intent(in) :: rate(:)
      real(wp), intent(in) :: restitution(:)
      !> What each gives the beam
      real(wp), intent(out) :: impulse(:)

      integer :: i
      logical :: pushes(size(members))

      call solve_complementarity(run%mobility(members, members), (1.0_wp + restitution)*rate, impulse, pushes)
      associate (velocity => run%states(run%now)%beam%velocity)
         do i = 1, size(members)
            velocity(:) = velocity + impulse(i)*run%mass_columns(:, members(i))
         end do
         do i = 1, size(members)
            if (.not. impulse(i) > 0.0_wp) cycle
            call put_along(run%contacts(members(i))%row, -restitution(i)*rate(i), velocity)
         end do
      end associate
   end subroutine share_impulse


   !> What an impact has made of one surface that took part.
   pure subroutine after_impulse(run, k, rate, impulse, energy_change, is_soft, response)
      type(newmark_run_t), intent(inout) :: run
      !> The contact
      integer, intent(in) :: k
      !> Rate of its gap before, and the impulse it gave
      real(wp), intent(in) :: rate
      real(wp), intent(in) :: impulse
      real(wp), intent(in) :: energy_change
      !> No surface was hit but to be captured
      logical, intent(in) :: is_soft
      !> Events
      type(response_t), intent(inout) :: response

      real(wp) :: rate_after
      type(event_t) :: event

      associate (contact => run%contacts(k), state => run%states(run%now))
         rate_after = gap_rate_at(run, k, state)
         if (contact%status == is_held .or. contact%is_stopped) then
            if (impulse > 0.0_wp) then
               call keep_blow(run, k, impulse, response)
            else if (rate_after > 0.0_wp) then
               ! the others throw the beam off
               event = event_here(run, k, event_release)
               event%velocity_before = 0.0_wp
               if (contact%status == is_held .or. contact%is_captured) call keep_event(run, k, event, response)
               call open_contact(run, k)
               contact%armed = .true.
               call begin_flight(run, k)
               if (.not. is_soft) contact%captures = 0
            end if
            return
         end if
         contact%armed = .true.
         if (.not. impulse > 0.0_wp) return
         event = event_here(run, k, merge(event_capture, event_impact, contact%judged .or. rate >= 0.0_wp))
         event%velocity_before = contact%row%sign*rate
         event%impulse = impulse
         event%energy_change = energy_change
         contact%is_captured = event%kind == event_capture
         if (contact%is_captured) contact%captures = contact%captures + 1
         contact%is_stopped = .not. rate_after > 0.0_wp
         contact%judged = .false.
         if (.not. contact%is_stopped) call begin_flight(run, k)
         contact%refused_end = nowhere
         call keep_event(run, k, event, response)
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

      event = event_here(run, k, event_blow)
      event%impulse = impulse
      call keep_event(run, k, event, response)
   end subroutine keep_blow

end module newmark_impacts
