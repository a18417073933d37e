!> Measures of a run: contact by contact from its flights and contacts, interval by interval (docs/theory.md,
!> section 12), with no samples.
!>
!> A flight is looked into only where it rises above the level that counts, a contact only where its force exceeds the
!> greatest so far. The instant of quiet, which only the last interval above the level tells, is sought at the end of
!> the run.
module contact_measures
   use bracketed_zero, only: bracket_t, chord, enter, go_to
   use kinds, only: wp
   use motion_intervals, only: curve_t, interval_t, observed_contact_t, peak_t, row_t
   use response_types, only: settling_level, response_t, run_measures_t
   use run_measures, only: comes_to_rest, early_part, end_episode, excess_of, finish_accumulator, &
      gather_measures, record_decay, put_peak, take_contact, take_impulse, accumulator_t
   implicit none (type, external)
   private
   public :: measurer_t, measures_t, open_measures, measure_interval, measure_impulse, finish_measures

   !> What has gathered of a contact.
   type :: measurer_t
      type(accumulator_t) :: accumulator
      type(run_measures_t) :: measures
      !> The flight under way, counted from the start of the run, rose above the quiet level
      integer :: flight = 0
      logical :: has_risen = .false.
      !> The last interval in which |eta_c| exceeds the quiet level; unallocated: there is none
      class(curve_t), allocatable :: exceeded
   end type measurer_t

   type :: measures_t
      !> Without it nothing is measured
      logical :: is_wanted = .false.
      !> Peaks are kept of so many rebounds
      integer :: most_peaks = 0
      !> Place of the contact from which the beam is released; 0: there is none
      integer :: release_contact = 0
      !> Of each contact, and of a run without any, [0:contacts]
      type(measurer_t), allocatable :: of(:)
   end type measures_t

contains

   !> Begin a run; each tally is opened by who knows its force at rest.
   pure subroutine open_measures(contacts, release_contact, is_wanted, most_peaks, measures)
      integer, intent(in) :: contacts
      integer, intent(in) :: release_contact
      logical, intent(in) :: is_wanted
      integer, intent(in) :: most_peaks
      type(measures_t), intent(out) :: measures

      measures%is_wanted = is_wanted
      measures%most_peaks = most_peaks
      measures%release_contact = release_contact
      allocate (measures%of(0:contacts))
   end subroutine open_measures

   !> An impulse at an instant.
   pure subroutine measure_impulse(measures, k, tau, impulse)
      type(measures_t), intent(inout) :: measures
      integer, intent(in) :: k
      real(wp), intent(in) :: tau
      real(wp), intent(in) :: impulse

      if (measures%is_wanted) call take_impulse(measures%of(k)%accumulator, tau, impulse)
   end subroutine measure_impulse

   !> What an interval tells of each contact, and of the energy.
   subroutine measure_interval(interval, measures)
      class(interval_t), intent(inout) :: interval
      type(measures_t), intent(inout) :: measures

      type(observed_contact_t) :: contact
      integer :: k
      logical :: had_risen

      do k = 1, interval%contacts
         contact = interval%contact(k)
         if (.not. (contact%is_active .or. k == measures%release_contact)) cycle
         had_risen = measures%of(k)%has_risen .and. contact%flights == measures%of(k)%flight &
            .and. .not. contact%is_closed
         if (contact%is_closed) then
            call measure_closed(interval, k, contact, measures%of(k))
         else
            call measure_flight(interval, k, contact%flights, measures%most_peaks, measures%of(k))
         end if
         if (k == measures%release_contact .and. (contact%yields &
            .or. .not. contact%is_closed)) call record_exceedance(interval, k, &
            had_risen, measures%of(k))
      end do
      call measure_energy(interval, measures%of(measures%release_contact))
   end subroutine measure_interval

   !> Force and impulse of a closed contact.
   subroutine measure_closed(interval, k, contact, measurer)
      class(interval_t), intent(inout) :: interval
      integer, intent(in) :: k
      type(observed_contact_t), intent(in) :: contact
      type(measurer_t), intent(inout) :: measurer

      type(peak_t) :: peak
      real(wp) :: early, early_impulse

      early_impulse = 0.0_wp
      measurer%has_risen = .false.
      associate (accumulator => measurer%accumulator)
         if (contact%yields) then
            call interval%seek_peak(row_t(interval%force_row(k)), [0.0_wp, interval%length], &
               accumulator%greatest_force/accumulator%force_scale*(1.0_wp + interval%tolerance), peak)
            if (peak%is_found) accumulator%greatest_force = max(accumulator%greatest_force, &
               accumulator%force_scale*peak%value)
            accumulator%tolerance = max(accumulator%tolerance, peak%looks%tolerance)
         else
            early = early_part(accumulator, interval%start, interval%length)
            if (early > 0.0_wp) early_impulse = interval%impulse(k, early)
         end if
         call take_contact(accumulator, interval%start, interval%length, interval%impulse(k, interval%length), &
            early_impulse)
      end associate
   end subroutine measure_closed

   !> Does a flight rise above the quiet level, or, where an earlier interval belongs to it, above its highest point so
   !> far? If it is not the one with which the run starts, it is a rebound then, unless it still rises to its highest
   !> point as the run ends.
   subroutine measure_flight(interval, k, flights, most_peaks, measurer)
      class(interval_t), intent(inout) :: interval
      integer, intent(in) :: k
      !> So many began before it
      integer, intent(in) :: flights
      integer, intent(in) :: most_peaks
      type(measurer_t), intent(inout) :: measurer

      type(peak_t) :: peak
      real(wp) :: known
      integer :: counted
      logical :: is_kept

      if (flights /= measurer%flight) measurer%has_risen = .false.
      measurer%flight = flights
      if (.not. (measurer%has_risen .or. interval%reach(k) > settling_level)) return
      associate (measures => measurer%measures, has_risen => measurer%has_risen)
         counted = measures%rebounds + merge(0, 1, has_risen)
         is_kept = counted <= most_peaks
         if (flights == 0 .or. .not. (is_kept .or. interval%is_last)) then
            if (has_risen) return
            has_risen = interval%exceeds(row_t(k), settling_level)
            if (.not. has_risen) return
            if (flights > 0) measures%rebounds = counted
            call end_episode(measurer%accumulator)
            return
         end if
         known = settling_level
         if (has_risen .and. is_kept) known = measures%peak_eta(counted)
         call interval%seek_peak(row_t(k), [0.0_wp, interval%length], known, peak)
         measurer%accumulator%tolerance = max(measurer%accumulator%tolerance, peak%looks%tolerance)
         if (.not. peak%is_found) return
         if (.not. has_risen) call end_episode(measurer%accumulator)
         has_risen = .true.
         measures%rebounds = counted
         if (interval%is_last .and. peak%still_rises) then
            measures%rebounds = counted - 1
         else if (is_kept) then
            call put_peak(measures, interval%start + peak%time, peak%value)
         end if
      end associate
   end subroutine measure_flight

   !> Keep an interval in which |eta_c| exceeds the quiet level.
   subroutine record_exceedance(interval, k, had_risen, measurer)
      class(interval_t), intent(in) :: interval
      integer, intent(in) :: k
      !> The flight rose above the level before the interval
      logical, intent(in) :: had_risen
      type(measurer_t), intent(inout) :: measurer

      real(wp) :: state(2)
      logical :: is_exceeded

      if (.not. (had_risen .or. interval%reach(k) > settling_level)) return
      is_exceeded = measurer%has_risen .and. .not. had_risen
      if (.not. is_exceeded) then
         ! it may have been low from the start, or risen before
         state = interval%evaluate(row_t(k), 0.0_wp)
         is_exceeded = abs(state(1)) > settling_level
      end if
      if (.not. is_exceeded .and. had_risen) is_exceeded = interval%exceeds(row_t(k), settling_level)
      if (.not. is_exceeded) is_exceeded = interval%exceeds(row_t(k, -1.0_wp), settling_level)
      if (is_exceeded) call interval%keep_gap(k, measurer%exceeded)
   end subroutine record_exceedance

   !> Where in an interval does the energy fall for good to the share that counts as spent?
   subroutine measure_energy(interval, measurer)
      class(interval_t), intent(in) :: interval
      type(measurer_t), intent(inout) :: measurer

      type(bracket_t) :: bracket
      real(wp) :: at_end, excess

      associate (accumulator => measurer%accumulator)
         if (.not. (interval%is_last .or. interval%may_gain)) then
            if (accumulator%has_spent .or. .not. comes_to_rest(accumulator)) return
         end if
         measurer%measures%final_energy = interval%energy(interval%length)
         at_end = excess_of(accumulator, measurer%measures%final_energy)
         ! most intervals neither are the last with it nor come after that
         if (.not. accumulator%has_spent .and. at_end > 0.0_wp) return
         excess = excess_of(accumulator, interval%energy(0.0_wp))
         if (excess > 0.0_wp .and. accumulator%has_spent) call record_decay(accumulator, .false., interval%start)
         if (accumulator%has_spent .or. at_end > 0.0_wp) return
         ! down to the rounding error of the energy that is left
         bracket = bracket_t(high=interval%length, value_low=excess, value_high=at_end, &
            least_value=2.0_wp*epsilon(1.0_wp)*abs(excess_of(accumulator, 0.0_wp)), least_length=4.0_wp*epsilon(1.0_wp))
         ! an impact before the interval may have spent it
         bracket%is_found = excess <= 0.0_wp
         if (.not. bracket%is_found) bracket%point = chord(bracket)
         do while (.not. bracket%is_found)
            call enter(bracket, excess_of(accumulator, interval%energy(bracket%point)))
            call go_to(bracket, chord(bracket))
         end do
         call record_decay(accumulator, .true., interval%start + bracket%point)
      end associate
   end subroutine measure_energy

   !> The end of the run: measures of each contact, and of all.
   subroutine finish_measures(measures, duration, lost, created, number, response)
      type(measures_t), intent(inout) :: measures
      !> Length of the run, tau
      real(wp), intent(in) :: duration
      !> Energy dissipated in the beam, in stops, at impacts
      real(wp), intent(in) :: lost(3)
      !> Energy created by the nodal reading
      real(wp), intent(in) :: created
      !> Of each contact in the scene's order
      integer, intent(in) :: number(:)
      !> The run, with its events and surfaces; gets the measures
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

      subroutine finish_contact(measurer, own, place)
         type(measurer_t), intent(inout) :: measurer
         type(run_measures_t), allocatable, intent(out) :: own
         !> Its number; default: there is none
         integer, intent(in), optional :: place

         real(wp) :: time
         logical :: is_exceeded

         call finish_accumulator(measurer%accumulator, response, duration, lost, created, measures%most_peaks, &
            measurer%measures, place)
         is_exceeded = .false.
         time = 0.0_wp
         if (allocated(measurer%exceeded)) then
            call measurer%exceeded%last_beyond(settling_level, time, is_exceeded)
            time = measurer%exceeded%start + time
         end if
         measurer%measures%has_settled = .not. is_exceeded
         measurer%measures%settling_tau = time
         allocate (own, source=measurer%measures)
      end subroutine finish_contact
   end subroutine finish_measures

end module contact_measures
