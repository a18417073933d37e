!> Differences of two runs of one scene, by which numbers of modes and meshes are compared.
module run_differences
   use history_list, only: eta_stop, eta_tip
   use kinds, only: wp
   use response_types, only: event_impact, event_t, is_contact_start, response_t, settling_level
   implicit none (type, external)
   private
   public :: horizon_of, max_difference, impact_difference, moment_difference, count_hops

   !> A motion is compared up to the peak of this rebound.
   integer, parameter :: last_rebound = 3

contains

   !> Instant of the sample at the peak of the third rebound, that is, the third flight above the settling level; the
   !> end of the run if there are fewer.
   pure real(wp) function horizon_of(response, duration) result(horizon)
      type(response_t), intent(in) :: response
      !> Length of the run, tau
      real(wp), intent(in) :: duration

      ! maximum eta of the flight so far, or the settling level
      real(wp) :: max_eta
      integer :: event, rebounds, i

      horizon = duration
      event = 0
      rebounds = 0
      do i = 1, size(response%tau)
         do while (event < response%event_count)
            if (response%events(event + 1)%tau > response%tau(i)) exit
            event = event + 1
            max_eta = settling_level
         end do
         if (event == 0) cycle
         if (response%history(eta_stop)%values(i) <= max_eta) cycle
         if (max_eta <= settling_level) rebounds = rebounds + 1
         if (rebounds > last_rebound) return
         if (rebounds == last_rebound) horizon = response%tau(i)
         max_eta = response%history(eta_stop)%values(i)
      end do
   end function horizon_of

   !> Maximum difference of two runs in eta of the tip and of all contacts.
   pure real(wp) function max_difference(fewer, more, last) result(difference)
      !> The runs, with the same samples
      type(response_t), intent(in) :: fewer
      type(response_t), intent(in) :: more
      !> Number of samples that are compared
      integer, intent(in) :: last

      integer :: k

      difference = max(maxval(abs(fewer%history(eta_tip)%values(:last) - more%history(eta_tip)%values(:last))), &
         maxval(abs(fewer%history(eta_stop)%values(:last) - more%history(eta_stop)%values(:last))))
      ! a single contact has no history of its own
      if (.not. allocated(more%contacts)) return
      do k = 1, size(more%contacts)
         difference = max(difference, maxval(abs(fewer%contacts(k)%eta(:last) - more%contacts(k)%eta(:last))))
      end do
   end function max_difference

   !> Difference of two runs in the velocity before the first impact or contact of each contact, relative to the maximum
   !> velocity before an event. Samples may miss the motion before an impact soon after the start.
   pure real(wp) function impact_difference(fewer, more, horizon) result(difference)
      type(response_t), intent(in) :: fewer
      type(response_t), intent(in) :: more
      !> End of the comparison, tau
      real(wp), intent(in) :: horizon

      integer :: first(2), k

      difference = 0.0_wp
      if (min(fewer%event_count, more%event_count) == 0) return
      associate (some => fewer%events(:fewer%event_count), others => more%events(:more%event_count))
         do k = 1, maxval(others%contact)
            first = [first_impact(some), first_impact(others)]
            if (minval(first) > 0) difference = max(difference, &
               abs(some(first(1))%velocity_before - others(first(2))%velocity_before))
         end do
         if (difference > 0.0_wp) difference = difference/maxval(abs(others%velocity_before))
      end associate

   contains

      !> Index of the first impact or beginning of contact at contact k; 0: there is none before the horizon.
      pure integer function first_impact(events) result(place)
         type(event_t), intent(in) :: events(:)

         place = findloc(events%contact == k .and. events%tau <= horizon .and. &
            (events%kind == event_impact .or. is_contact_start(events%kind)), .true., dim=1)
      end function first_impact
   end function impact_difference

   !> Difference of two runs in the extremes of the bending moments, relative to the maximum magnitude of all moments;
   !> 0: moments are not recorded.
   pure real(wp) function moment_difference(fewer, more) result(difference)
      type(response_t), intent(in) :: fewer
      type(response_t), intent(in) :: more

      difference = 0.0_wp
      if (.not. allocated(more%moments)) return
      associate (some => fewer%moments, others => more%moments)
         difference = max(maxval(abs(some%maximum - others%maximum)), maxval(abs(some%minimum - others%minimum))) &
            /max(maxval(others%maximum), maxval(-others%minimum), tiny(1.0_wp))
      end associate
   end function moment_difference

   !> Number of flights between contacts that rise above a height. The height of a flight is estimated from its duration
   !> and final speed, because samples may miss the flight.
   pure integer function count_hops(response, horizon, height) result(number)
      type(response_t), intent(in) :: response
      !> End of the comparison, tau
      real(wp), intent(in) :: horizon
      real(wp), intent(in) :: height

      ! instant of the last event at each contact; negative: there is none yet
      real(wp), allocatable :: last(:)
      integer :: i

      number = 0
      if (response%event_count == 0) return
      allocate (last(maxval(response%events(:response%event_count)%contact)), source=-1.0_wp)
      do i = 1, response%event_count
         associate (event => response%events(i))
            if (event%tau > horizon) return
            if ((event%kind == event_impact .or. is_contact_start(event%kind)) .and. last(event%contact) >= 0.0_wp) then
               if (0.5_wp*abs(event%velocity_before)*(event%tau - last(event%contact)) > height) number = number + 1
            end if
            last(event%contact) = event%tau
         end associate
      end do
   end function count_hops

end module run_differences
