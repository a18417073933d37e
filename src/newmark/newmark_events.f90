!> Where the beam meets surfaces or leaves them at the end of a step: the rules of one stop, contact and release within
!> their tolerances, for each surface.
module newmark_events
   use contact_rows, only: along
   use failures, only: fail, status_run_failed
   use kinds, only: wp
   use newmark_contacts, only: begin_contact, end_contact, event_here, keep_event, open_contact, settle
   use newmark_impacts, only: strike
   use newmark_run, only: gap_at, gap_rate_at, instant_of, is_constrained, is_inactive, is_in_contact, is_lifted, &
      is_open, lets_go, lifted_force, rounding_at, newmark_run_t
   use number_text, only: to_text
   use response_types, only: event_release, response_t
   use step_intervals, only: cubic_of, greatest_of
   implicit none (type, external)
   private
   public :: find_events, give_way, begin_and_end_contacts

contains

   !> The rules of contact and release at the end of an accepted step.
   pure subroutine find_events(run, step, response)
      type(newmark_run_t), intent(inout) :: run
      real(wp), intent(in) :: step
      !> Events
      type(response_t), intent(inout) :: response

      integer :: k
      logical :: happens

      happens = .false.
      do k = 1, size(run%contacts)
         run%arrives(k) = .false.
         run%leaves(k) = .false.
         select case (run%contacts(k)%status)
         case (is_open)
            call check_flight(run, k, step)
         case (is_constrained, is_in_contact)
            if (run%closing(k)) run%leaves(k) = fades(run, k)
         case (is_lifted)
            call check_lifted(run, k)
         case (is_inactive)
            cycle
         end select
         happens = happens .or. run%arrives(k) .or. run%leaves(k)
      end do
      if (happens) call begin_and_end_contacts(run, response)
   end subroutine find_events


   !> Is a force that vanishes ahead as good as gone? One that still rises is the beginning of a contact, not its end.
   !> Under a hard surface that of release may be less than rounding leaves, of which no short step tells whether it
   !> rises.
   pure function fades(run, k)
      type(newmark_run_t), intent(in) :: run
      !> The contact
      integer, intent(in) :: k
      logical :: fades

      associate (old => run%states(3 - run%now), new => run%states(run%now), contact => run%contacts(k))
         fades = new%force(k) < run%release_force .and. new%force(k) < old%force(k)
         if (.not. allocated(contact%stop)) return
         if (fades .and. contact%is_viscous) fades = lets_go(run, k, new)
         fades = fades .or. (along(contact%row, new%beam%velocity) > 0.0_wp .and. &
            new%force(k) <= rounding_at(run, k, new))
      end associate
   end function fades


   !> Does the beam arrive at an open surface?
   pure subroutine check_flight(run, k, step)
      type(newmark_run_t), intent(inout) :: run
      !> The contact
      integer, intent(in) :: k
      real(wp), intent(in) :: step

      real(wp) :: gap, rate

      associate (old => run%states(3 - run%now), new => run%states(run%now), contact => run%contacts(k))
         gap = gap_at(run, k, new)
         rate = gap_rate_at(run, k, new)
         if (contact%judged) then
            contact%peak = max(contact%peak, greatest_of(cubic_of([gap_at(run, k, old), gap], &
               step*[gap_rate_at(run, k, old), rate])))
            if (contact%peak > run%hop_height) contact%judged = .false.
         end if
         if (gap > run%hop_height) contact%captures = 0
         contact%leaving = gap < -run%contact_tolerance
         if (gap >= run%contact_tolerance) then
            contact%armed = .true.
         else if (rate < 0.0_wp .and. (contact%armed .or. run%closing(k) .or. contact%leaving)) then
            run%arrives(k) = .true.
         else if (rate > 0.0_wp) then
            contact%armed = .true.
         end if
      end associate
   end subroutine check_flight


   !> Spring and damper without force: does the beam leave the surface, or do they push again?
   pure subroutine check_lifted(run, k)
      type(newmark_run_t), intent(inout) :: run
      !> The contact
      integer, intent(in) :: k

      real(wp) :: force

      associate (old => run%states(3 - run%now), new => run%states(run%now), contact => run%contacts(k))
         if (new%indentation(k) <= 0.0_wp) then
            call open_contact(run, k)
            return
         end if
         force = lifted_force(run, k, new)
         if (force <= 0.0_wp) then
            contact%armed = .true.
         else if (force > lifted_force(run, k, old)) then
            run%arrives(k) = contact%armed .or. run%closing(k)
         end if
      end associate
   end subroutine check_lifted


   !> Even the shortest step crosses a condition: the event is here.
   pure subroutine give_way(run, response)
      type(newmark_run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response

      integer :: k

      run%leaves = run%refuses .and. (run%contacts%status == is_constrained .or. run%contacts%status == is_in_contact)
      run%arrives = run%refuses .and. run%contacts%status == is_lifted
      if (any(run%arrives) .or. any(run%leaves)) then
         call begin_and_end_contacts(run, response)
         return
      end if
      k = findloc(run%refuses, .true., dim=1)
      call fail(run%error, status_run_failed, 'the contact near tau = '//to_text(instant_of(run))//' at '// &
         to_text(run%contacts(k)%contact%settings%position)//' cannot be located: even the step halved to its limit &
      &goes through the stop; contact_tolerance is too small, or the motion is not finite')
   end subroutine give_way


   !> What arrives and what leaves at one instant.
   pure subroutine begin_and_end_contacts(run, response)
      type(newmark_run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response

      integer :: k

      do k = 1, size(run%contacts)
         if (.not. run%leaves(k)) cycle
         if (run%contacts(k)%status == is_constrained) then
            call open_contact(run, k)
            call keep_event(run, k, event_here(run, k, event_release), response)
         else
            call end_contact(run, k, response)
         end if
      end do
      do k = 1, size(run%contacts)
         if (run%arrives(k) .and. allocated(run%contacts(k)%stop)) call begin_contact(run, k, response)
      end do
      do k = 1, size(run%contacts)
         if (allocated(run%contacts(k)%stop)) run%arrives(k) = .false.
      end do
      if (any(run%arrives)) call strike(run, response)
      if (.not. allocated(run%error)) call settle(run, response)
   end subroutine begin_and_end_contacts

end module newmark_events
