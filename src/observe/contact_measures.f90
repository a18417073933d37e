!> Measures (scalar results) of each contact, from intervals of the motion, that is, phases or steps (docs/theory.md,
!> section 12), not from samples. eta_c is the displacement at the contact from its surface.
!>
!> The peak of a flight is searched only if the flight may rise above the settling level, the maximum force of a closed
!> contact only if it may exceed the maximum so far. The settling time depends only on the last interval in which
!> |eta_c| exceeds the settling level, so it is searched at the end of the run.
module contact_measures
   use bracketed_zero, only: bracket_t, chord, enter_value, choose_point
   use closing_measures, only: closing_t, find_closing, record_closing
   use kinds, only: wp
   use motion_intervals, only: curve_t, interval_t, observed_contact_t, peak_t, output_row_t
   use response_types, only: settling_level, response_t, run_measures_t
   use run_measures, only: comes_to_rest, early_part, end_episode, excess_of, finish_accumulator, &
      gather_measures, open_accumulator, record_decay, record_peak, add_contact, add_impulse, accumulator_t
   use run_settings, only: relay_settings_t, run_settings_t
   implicit none (type, external)
   private
   public :: measurer_t, measures_t, open_measures, measure_interval, measure_impulse, finish_measures

   !> Measures and accumulated sums of a contact.
   type :: measurer_t
      !> Sums up to the present instant
      type(accumulator_t) :: accumulator
      !> Results; most of them are set at the end of the run
      type(run_measures_t) :: measures
      !> Number of the flight in progress, counted from the start of the run
      integer :: flight = 0
      !> Whether the flight in progress has risen above the settling level
      logical :: has_risen = .false.
      !> The last interval in which |eta_c| exceeds the settling level; unallocated: there is none
      class(curve_t), allocatable :: exceeded
      !> Force of the contact since its last closing
      type(closing_t) :: closing
   end type measurer_t

   !> Measures of all contacts of a run.
   type :: measures_t
      !> Whether measures are requested
      logical :: is_wanted = .false.
      !> Maximum number of rebounds whose peaks are recorded
      integer :: max_peaks = 0
      !> Index of the release contact, to which histories refer; 0: there is none
      integer :: release_contact = 0
      !> Settings of the measures of closings; unallocated: these measures are not requested
      type(relay_settings_t), allocatable :: relay
      !> Measures of each contact; index 0 is that of a run without contacts, [0:contacts]
      type(measurer_t), allocatable :: of(:)
   end type measures_t

contains

   !> Open the measures of a run.
   pure subroutine open_measures(settings, release_contact, is_compliant, start_energy, rest_force, rest_energy, &
      measures)
      type(run_settings_t), intent(in) :: settings
      !> Index of the release contact, to which histories refer; 0: there is none
      integer, intent(in) :: release_contact
      !> Whether each contact is compliant, [contacts]
      logical, intent(in) :: is_compliant(:)
      !> Energy of beam and stops at the start
      real(wp), intent(in) :: start_energy
      !> Force of each contact at static equilibrium, [contacts]
      real(wp), intent(in) :: rest_force(:)
      !> Energy of beam and stops at static equilibrium; `no_rest`: there is no static equilibrium
      real(wp), intent(in) :: rest_energy
      type(measures_t), intent(out) :: measures

      if (allocated(settings%relay)) measures%relay = settings%relay
      measures%is_wanted = settings%output%measures
      measures%max_peaks = settings%output%max_peaks
      measures%release_contact = release_contact
      allocate (measures%of(0:size(is_compliant)))
      call open_accumulator([.false., is_compliant], start_energy, [0.0_wp, rest_force], rest_energy, &
         settings%height_ratio, measures%of%accumulator)
   end subroutine open_measures

   !> Add an impulse at an instant.
   pure subroutine measure_impulse(measures, k, tau, impulse)
      type(measures_t), intent(inout) :: measures
      !> Index of the contact
      integer, intent(in) :: k
      real(wp), intent(in) :: tau
      real(wp), intent(in) :: impulse

      if (measures%is_wanted) call add_impulse(measures%of(k)%accumulator, tau, impulse)
   end subroutine measure_impulse

   !> Update the measures of each contact, and of the energy, by an interval.
   subroutine measure_interval(interval, measures)
      class(interval_t), intent(inout) :: interval
      type(measures_t), intent(inout) :: measures

      type(observed_contact_t) :: contact
      integer :: k
      ! the flight in progress rose above the settling level before the interval
      logical :: had_risen

      do k = 1, interval%contacts
         contact = interval%contact(k)
         if (.not. (contact%is_active .or. k == measures%release_contact)) cycle
         had_risen = measures%of(k)%has_risen .and. contact%flights == measures%of(k)%flight &
            .and. .not. contact%is_closed
         if (contact%is_closed) then
            call measure_closed(interval, k, contact, measures%of(k))
         else
            ! only the peaks at the release contact are results of the run
            call measure_flight(interval, k, contact%flights, merge(measures%max_peaks, 0, &
               k == measures%release_contact), measures%of(k))
         end if
         if (allocated(measures%relay)) call record_closing(interval, k, contact, &
            measures%relay%lasting_force/measures%of(k)%accumulator%force_scale, measures%of(k)%closing)
         if (k == measures%release_contact .and. (contact%is_compliant &
            .or. .not. contact%is_closed)) call record_exceedance(interval, k, &
            had_risen, measures%of(k))
      end do
      call measure_energy(interval, measures%of(measures%release_contact))
   end subroutine measure_interval

   !> Add the force and impulse of a closed contact.
   subroutine measure_closed(interval, k, contact, measurer)
      class(interval_t), intent(inout) :: interval
      integer, intent(in) :: k
      type(observed_contact_t), intent(in) :: contact
      type(measurer_t), intent(inout) :: measurer

      type(peak_t) :: peak
      ! length of the part of the interval within `force_window` of the beginning of the episode
      real(wp) :: early
      ! impulse of the force over this part
      real(wp) :: early_impulse

      early_impulse = 0.0_wp
      measurer%has_risen = .false.
      associate (accumulator => measurer%accumulator)
         if (contact%is_compliant) then
            call interval%seek_peak(output_row_t(interval%force_row(k)), [0.0_wp, interval%length], &
               accumulator%greatest_force/accumulator%force_scale*(1.0_wp + interval%tolerance), peak, &
               accumulator%force_search)
            if (peak%is_found) accumulator%greatest_force = max(accumulator%greatest_force, &
               accumulator%force_scale*peak%value)
         else
            early = early_part(accumulator, interval%start, interval%length)
            if (early > 0.0_wp) early_impulse = interval%impulse(k, early)
         end if
         call add_contact(accumulator, interval%start, interval%length, interval%impulse(k, interval%length), &
            early_impulse)
      end associate
   end subroutine measure_closed

   !> Count a flight as a rebound if it rises above the settling level, unless the run starts with the flight, or ends
   !> while the flight still rises. Record the peak of the rebound; if an earlier interval belongs to the same flight,
   !> only a higher peak replaces the recorded one.
   subroutine measure_flight(interval, k, flights, max_peaks, measurer)
      class(interval_t), intent(inout) :: interval
      integer, intent(in) :: k
      !> Number of the flight, counted from the start of the run; 0: the run starts with it
      integer, intent(in) :: flights
      integer, intent(in) :: max_peaks
      type(measurer_t), intent(inout) :: measurer

      type(peak_t) :: peak
      real(wp) :: threshold
      integer :: rebound_count
      logical :: is_recorded

      if (flights /= measurer%flight) measurer%has_risen = .false.
      measurer%flight = flights
      if (.not. (measurer%has_risen .or. interval%gap_bound(k) > settling_level)) return
      associate (measures => measurer%measures, has_risen => measurer%has_risen)
         rebound_count = measures%rebounds + merge(0, 1, has_risen)
         is_recorded = rebound_count <= max_peaks
         if (flights == 0 .or. .not. (is_recorded .or. interval%is_last)) then
            if (has_risen) return
            has_risen = interval%exceeds(output_row_t(k), settling_level)
            if (.not. has_risen) return
            if (flights > 0) measures%rebounds = rebound_count
            call end_episode(measurer%accumulator)
            return
         end if
         threshold = settling_level
         if (has_risen .and. is_recorded) threshold = measures%peak_eta(rebound_count)
         if (.not. interval%gap_bound(k) > threshold) return
         call interval%seek_peak(output_row_t(k), [0.0_wp, interval%length], threshold, peak, &
            measurer%accumulator%peak_search)
         if (.not. peak%is_found) return
         if (.not. has_risen) call end_episode(measurer%accumulator)
         has_risen = .true.
         measures%rebounds = rebound_count
         if (interval%is_last .and. peak%still_rises) then
            measures%rebounds = rebound_count - 1
         else if (is_recorded) then
            call record_peak(measures, interval%start + peak%time, peak%value)
         end if
      end associate
   end subroutine measure_flight

   !> Record an interval in which |eta_c| exceeds the settling level.
   subroutine record_exceedance(interval, k, had_risen, measurer)
      class(interval_t), intent(in) :: interval
      integer, intent(in) :: k
      !> Whether the flight rose above the level before the interval
      logical, intent(in) :: had_risen
      type(measurer_t), intent(inout) :: measurer

      real(wp) :: state(2)
      logical :: is_exceeded

      if (.not. (had_risen .or. interval%gap_bound(k) > settling_level)) return
      is_exceeded = measurer%has_risen .and. .not. had_risen
      if (.not. is_exceeded) then
         ! the gap may exceed the level at the start of the interval, with either sign
         state = interval%evaluate(output_row_t(k), 0.0_wp)
         is_exceeded = abs(state(1)) > settling_level
      end if
      if (.not. is_exceeded .and. had_risen) is_exceeded = interval%exceeds(output_row_t(k), settling_level)
      if (.not. is_exceeded) is_exceeded = interval%exceeds(output_row_t(k, -1.0_wp), settling_level)
      if (is_exceeded) call interval%record_gap(k, measurer%exceeded)
   end subroutine record_exceedance

   !> Find the instant in an interval at which the energy falls for the last time to the fraction that counts as
   !> decayed.
   subroutine measure_energy(interval, measurer)
      class(interval_t), intent(in) :: interval
      type(measurer_t), intent(inout) :: measurer

      type(bracket_t) :: bracket
      ! energy above the fraction that counts as decayed, at the end of the interval
      real(wp) :: final_excess
      ! the same at the start of the interval
      real(wp) :: excess

      associate (accumulator => measurer%accumulator)
         if (.not. (interval%is_last .or. interval%may_gain)) then
            if (accumulator%has_decayed .or. .not. comes_to_rest(accumulator)) return
         end if
         measurer%measures%final_energy = interval%energy(interval%length)
         final_excess = excess_of(accumulator, measurer%measures%final_energy)
         ! most intervals end before the energy has decayed
         if (.not. accumulator%has_decayed .and. final_excess > 0.0_wp) return
         excess = excess_of(accumulator, interval%energy(0.0_wp))
         if (excess > 0.0_wp .and. accumulator%has_decayed) call record_decay(accumulator, .false., interval%start)
         if (accumulator%has_decayed .or. final_excess > 0.0_wp) return
         ! the tolerance is the rounding error of the energy
         bracket = bracket_t(high=interval%length, value_low=excess, value_high=final_excess, &
            value_tolerance=2.0_wp*epsilon(1.0_wp)*abs(excess_of(accumulator, 0.0_wp)), &
            length_tolerance=4.0_wp*epsilon(1.0_wp))
         ! an impact just before the interval may have dissipated the energy already
         bracket%is_found = excess <= 0.0_wp
         if (.not. bracket%is_found) bracket%point = chord(bracket)
         do while (.not. bracket%is_found)
            call enter_value(bracket, excess_of(accumulator, interval%energy(bracket%point)))
            call choose_point(bracket, chord(bracket))
         end do
         call record_decay(accumulator, .true., interval%start + bracket%point)
      end associate
   end subroutine measure_energy

   !> Finish the measures of each contact, and of the run, at its end.
   subroutine finish_measures(measures, duration, lost, created, number, response)
      type(measures_t), intent(inout) :: measures
      !> Length of the run, tau
      real(wp), intent(in) :: duration
      !> Energy dissipated in the beam, in stops, at impacts
      real(wp), intent(in) :: lost(3)
      !> Energy created by replacing nodal velocities
      real(wp), intent(in) :: created
      !> Number of each contact in the scene's order
      integer, intent(in) :: number(:)
      !> The run, with its events and contacts; receives the measures
      type(response_t), intent(inout) :: response

      integer :: k

      if (size(number) == 0) then
         call finish_contact(measures%of(0), response%measures)
         return
      end if
      do k = 1, size(number)
         measures%of(k)%measures%final_energy = measures%of(measures%release_contact)%measures%final_energy
         call finish_contact(measures%of(k), response%contacts(number(k))%measures, number(k))
      end do
      call gather_measures(response, number(measures%release_contact))

   contains

      !> Finish the measures of one contact, or of a run without contacts.
      subroutine finish_contact(measurer, finished, place)
         type(measurer_t), intent(inout) :: measurer
         type(run_measures_t), allocatable, intent(out) :: finished
         !> Number of the contact; absent: the run has no contacts
         integer, intent(in), optional :: place

         real(wp) :: time
         logical :: is_exceeded

         call finish_accumulator(measurer%accumulator, response, duration, lost, created, measures%max_peaks, &
            measurer%measures, place)
         is_exceeded = .false.
         time = 0.0_wp
         if (allocated(measurer%exceeded)) then
            call measurer%exceeded%last_exceedance(settling_level, time, is_exceeded)
            time = measurer%exceeded%start + time
         end if
         ! without a contact there is no stop point that settles
         measurer%measures%has_settled = present(place) .and. .not. is_exceeded
         measurer%measures%settling_tau = time
         if (allocated(measures%relay) .and. present(place)) call find_closing(measurer%closing, response, place, &
            duration, measurer%accumulator, measures%relay, measurer%measures%closing)
         allocate (finished, source=measurer%measures)
      end subroutine finish_contact
   end subroutine finish_measures

end module contact_measures
