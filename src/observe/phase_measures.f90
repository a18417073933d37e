!> Measures of a run taken from its motion in closed form, phase by phase as they end: no samples.
!>
!> A flight is looked into only where it rises above the level that counts, a contact only where its force exceeds
!> the greatest so far; `certified_search` decides both, mostly at one look. What only the last such phase can
!> tell, the instant of quiet, is sought at the end of the run.
module phase_measures
   use certified_search, only: trail_t, viewed_signal_t
   use flight_peaks, only: find_peak
   use kinds, only: wp
   use response_types, only: quiet_level, response_t, run_measures_t
   use run_measures, only: add_rebound, finish_tally, take_impulse, tally_t
   use run_recorder, only: ledger_t
   use signal_peaks, only: exceeds, greatest_value, last_time_above, looks_t, peak_tolerance
   implicit none (type, external)
   private
   public :: measurer_t, measure_impulse, measure_rise, measure_force, keep_loud, seek_peak, &
      finish_measures

   type :: measurer_t
      !> Without it nothing is measured
      logical :: is_wanted = .false.
      !> Peaks are kept of so many rebounds
      integer :: most_peaks = 0
      type(tally_t) :: tally
      type(run_measures_t) :: measures
      !> Energy lost in the stop
      real(wp) :: lost_stop = 0.0_wp
      !> The last phase in which |eta_c| exceeds the quiet level: start, length, eta_c; unallocated: there is none
      real(wp) :: loud_start = 0.0_wp
      real(wp) :: loud_length = 0.0_wp
      class(viewed_signal_t), allocatable :: loud
      !> It may be below as well as above
      logical :: may_be_low = .true.
      !> There, since the start of the phase, it was seen above; 0: it was not
      real(wp) :: seen_above = 0.0_wp
   end type measurer_t

contains

   !> An impulse at an instant.
   pure subroutine measure_impulse(measurer, tau, impulse)
      type(measurer_t), intent(inout) :: measurer
      real(wp), intent(in) :: tau
      real(wp), intent(in) :: impulse

      if (measurer%is_wanted) call take_impulse(measurer%tally, tau, impulse)
   end subroutine measure_impulse

   !> Does a flight rise above the quiet level? If the run does not start with it, it is a rebound then, unless it still
   !> rises to its highest point as the run ends.
   subroutine measure_rise(measurer, eta, from, length, is_first, to_the_end, greatest, rises, trail)
      !> Gets the rebound
      type(measurer_t), intent(inout) :: measurer
      !> eta of the stop point
      class(viewed_signal_t), intent(in) :: eta
      !> Start and length of the flight
      real(wp), intent(in) :: from
      real(wp), intent(in) :: length
      !> The run starts with it: nothing was hit
      logical, intent(in) :: is_first
      !> The run ends with it
      logical, intent(in) :: to_the_end
      !> eta was seen to be as great as this
      real(wp), intent(in) :: greatest
      logical, intent(out) :: rises
      !> What the search for its end has seen of eta
      type(trail_t), intent(inout), optional :: trail

      logical :: keeps_peak, is_known, still_rises
      real(wp) :: peak, time

      keeps_peak = measurer%measures%rebounds < measurer%most_peaks
      if (is_first .or. .not. (keeps_peak .or. to_the_end)) then
         rises = greatest > quiet_level
         if (.not. rises) rises = exceeds(eta, length, quiet_level)
         if (rises .and. .not. is_first) call add_rebound(measurer%measures)
         return
      end if
      is_known = .false.
      if (present(trail) .and. .not. to_the_end) call find_peak(eta, trail, is_known, peak, time)
      if (is_known) then
         rises = peak > quiet_level
         still_rises = .false.
      else
         call seek_peak(measurer%tally, eta, length, max(quiet_level, greatest*(1.0_wp - peak_tolerance)), rises, &
            still_rises, peak, time)
      end if
      if (.not. rises .and. greatest > quiet_level) then
         rises = .true.
         peak = greatest
      end if
      if (.not. rises .or. (to_the_end .and. still_rises)) return
      if (keeps_peak) then
         call add_rebound(measurer%measures, from + time, peak)
      else
         call add_rebound(measurer%measures)
      end if
   end subroutine measure_rise

   !> In this phase |eta_c| exceeds the quiet level.
   subroutine keep_loud(measurer, eta, from, length, may_be_low, seen_above)
      type(measurer_t), intent(inout) :: measurer
      !> eta of the stop point
      class(viewed_signal_t), intent(in) :: eta
      !> Start and length of the phase
      real(wp), intent(in) :: from
      real(wp), intent(in) :: length
      !> eta_c may come below the level downwards; default: it may
      logical, intent(in), optional :: may_be_low
      !> So late in the phase it was seen above the level; default: nothing was
      real(wp), intent(in), optional :: seen_above

      measurer%loud_start = from
      measurer%loud_length = length
      measurer%may_be_low = .true.
      if (present(may_be_low)) measurer%may_be_low = may_be_low
      measurer%seen_above = 0.0_wp
      if (present(seen_above)) measurer%seen_above = seen_above
      if (allocated(measurer%loud)) deallocate (measurer%loud)
      allocate (measurer%loud, source=eta)
   end subroutine keep_loud

   !> Does the force exceed the greatest so far, and how far?
   subroutine measure_force(tally, force, length, greatest)
      !> Gets the force
      type(tally_t), intent(inout) :: tally
      !> The force as a signal
      class(viewed_signal_t), intent(in) :: force
      !> Length of the contact
      real(wp), intent(in) :: length
      !> Seen in this contact
      real(wp), intent(in) :: greatest

      real(wp) :: peak, time, known
      logical :: does_exceed, still_rises

      known = max(tally%greatest_force/tally%force_scale, greatest)
      call seek_peak(tally, force, length, known*(1.0_wp + peak_tolerance), does_exceed, still_rises, peak, time)
      if (does_exceed) known = max(known, peak)
      tally%greatest_force = tally%force_scale*known
   end subroutine measure_force

   !> The greatest value of a signal in a phase, if it exceeds a threshold; the tally gets the tolerance.
   subroutine seek_peak(tally, signal, length, threshold, does_exceed, still_rises, peak, time)
      type(tally_t), intent(inout) :: tally
      class(viewed_signal_t), intent(in) :: signal
      !> Length of the phase
      real(wp), intent(in) :: length
      !> Which it must exceed
      real(wp), intent(in) :: threshold
      logical, intent(out) :: does_exceed
      !> It is that at the end of the phase
      logical, intent(out) :: still_rises
      !> The value and its time since the start of the phase
      real(wp), intent(out) :: peak
      real(wp), intent(out) :: time

      type(looks_t) :: looks

      call greatest_value(signal, length, threshold, does_exceed, still_rises, peak, time, looks=looks)
      tally%tolerance = max(tally%tolerance, looks%tolerance)
   end subroutine seek_peak

   !> The end of the run.
   subroutine finish_measures(measurer, duration, ledger, response, surface)
      !> What the phases told
      type(measurer_t), intent(inout) :: measurer
      !> Length of the run, tau
      real(wp), intent(in) :: duration
      !> With all events charged
      type(ledger_t), intent(in) :: ledger
      !> The run, with its events; gets the measures
      type(response_t), intent(inout) :: response
      !> Only the events of this surface are meant; default: all
      integer, intent(in), optional :: surface

      type(run_measures_t) :: measures
      class(viewed_signal_t), allocatable :: depth
      real(wp) :: last, lost_beam, lower
      logical :: is_loud, is_low

      measures = measurer%measures
      ! the ledger closes to rounding
      lost_beam = measurer%tally%start_energy + ledger%work + ledger%created - ledger%dissipated_impact &
         - measurer%lost_stop - measures%final_energy
      call finish_tally(measurer%tally, response, duration, [lost_beam, measurer%lost_stop, ledger%dissipated_impact], &
         ledger%created, measurer%most_peaks, measures, surface)
      last = 0.0_wp
      is_loud = .false.
      if (allocated(measurer%loud)) then
         call last_time_above(measurer%loud, measurer%loud_length, quiet_level, last, is_loud, &
            measurer%seen_above)
      end if
      if (allocated(measurer%loud) .and. measurer%may_be_low) then
         call measurer%loud%view(0.0_wp, -1.0_wp, 0.0_wp, 0, depth)
         call last_time_above(depth, measurer%loud_length, quiet_level, lower, is_low)
         last = max(last, lower)
         is_loud = is_loud .or. is_low
      end if
      measures%is_quiet = .not. is_loud
      measures%quiet_tau = measurer%loud_start + last
      allocate (response%measures, source=measures)
   end subroutine finish_measures

end module phase_measures
