!> Measures of a run, that is, its scalar results such as the settling time, for either method: sums accumulated during
!> the run, and measures that follow from these sums and from the events at its end (docs/theory.md, section 12).
!>
!> An episode comprises all contact between two flights that rise above `settling_level`: impacts in quick succession,
!> closed contacts, and low flights between them. Single impacts and contacts change with the mesh; the impulse of an
!> episode does not. The force of a rigid stop does not converge with the mesh either, because it grows as the mass that
!> is stopped at once decreases; its mean over a fixed time converges.
module run_measures
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
   use kinds, only: wp
   use measure_list, only: first_of_stops, first_peak, first_statistic, force_window, measure_count, measure_status, &
      measure_table, measure_tolerance, peak_count
   use response_types, only: event_impact, is_closed_start, is_contact_end, &
      is_contact_start, is_impact, settled_energy, response_t, run_measures_t
   use signal_peaks, only: extreme_search_t, peak_tolerance
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: accumulator_t, open_accumulator, add_impulse, add_contact, end_episode, record_decay, record_peak
   public :: finish_accumulator, gather_measures
   public :: comes_to_rest, early_part, excess_of, no_rest, row_of

   !> Value of `rest_energy` that means: loads or rigid-body motion prevent static equilibrium.
   real(wp), parameter :: no_rest = -huge(1.0_wp)

   !> Accumulated sums of a contact. The type has no allocatable components, so that a copy restores the sums when a run
   !> returns to an earlier state.
   type :: accumulator_t
      !> Pbar per unit of force
      real(wp) :: force_scale = 0.0_wp
      !> Whether the stop is compliant, so that the maximum of the force itself is measured
      logical :: is_compliant = .false.
      !> Contact force at static equilibrium
      real(wp) :: rest_force = 0.0_wp
      !> Energy of beam and stops at static equilibrium; `no_rest`: there is no static equilibrium
      real(wp) :: rest_energy = 0.0_wp
      !> Energy of beam and stops at the start
      real(wp) :: start_energy = 0.0_wp
      !> Tolerance of the searches for peaks of rebounds, and number of evaluations that remain for them
      type(extreme_search_t) :: peak_search
      !> The same of the searches for the maximum force
      type(extreme_search_t) :: force_search
      !> Maximum force since the start of the run
      real(wp) :: greatest_force = 0.0_wp
      !> Maximum impulse of an episode since the start of the run
      real(wp) :: greatest_impulse = 0.0_wp
      !> Whether an episode is in progress
      logical :: in_episode = .false.
      !> Beginning of the episode, tau
      real(wp) :: begin = 0.0_wp
      !> Impulse of the episode less the impulse of the force at rest during its contacts
      real(wp) :: impulse = 0.0_wp
      !> Impulse of the episode within `force_window` of its beginning
      real(wp) :: early_impulse = 0.0_wp
      !> Whether the energy has decayed
      logical :: has_decayed = .false.
      !> Instant at which the energy decayed
      real(wp) :: decay_tau = 0.0_wp
   end type accumulator_t

contains

   !> Initialise the accumulator of a contact.
   elemental subroutine open_accumulator(is_compliant, start_energy, rest_force, rest_energy, force_scale, accumulator)
      !> Whether the contact is compliant
      logical, intent(in) :: is_compliant
      !> Energy at the start
      real(wp), intent(in) :: start_energy
      !> Contact force at static equilibrium
      real(wp), intent(in) :: rest_force
      !> Energy of beam and stops at static equilibrium
      real(wp), intent(in) :: rest_energy
      !> Pbar per unit of force
      real(wp), intent(in) :: force_scale
      !> The accumulator, ready for the first phase
      type(accumulator_t), intent(out) :: accumulator

      accumulator%is_compliant = is_compliant
      accumulator%start_energy = start_energy
      accumulator%rest_force = rest_force
      accumulator%rest_energy = rest_energy
      accumulator%force_scale = force_scale
   end subroutine open_accumulator

   !> Add an impulse at an instant.
   elemental subroutine add_impulse(accumulator, tau, impulse)
      type(accumulator_t), intent(inout) :: accumulator
      real(wp), intent(in) :: tau
      real(wp), intent(in) :: impulse

      call begin_episode(accumulator, tau)
      accumulator%impulse = accumulator%impulse + impulse
      if (tau <= accumulator%begin + force_window) call add_early_impulse(accumulator, impulse)
   end subroutine add_impulse

   !> Add a closed contact, or one step of a closed contact.
   elemental subroutine add_contact(accumulator, from, length, impulse, early_impulse)
      type(accumulator_t), intent(inout) :: accumulator
      !> Beginning of the contact, tau
      real(wp), intent(in) :: from
      !> Length of the contact, tau
      real(wp), intent(in) :: length
      !> Integral of the force over the contact
      real(wp), intent(in) :: impulse
      !> Integral of the force over its `early_part`
      real(wp), intent(in) :: early_impulse

      call begin_episode(accumulator, from)
      accumulator%impulse = accumulator%impulse + (impulse - accumulator%rest_force*length)
      call add_early_impulse(accumulator, early_impulse)
   end subroutine add_contact

   !> Length of the part of a contact that lies within `force_window` of the beginning of its episode.
   elemental real(wp) function early_part(accumulator, from, length) result(part)
      type(accumulator_t), intent(in) :: accumulator
      !> Beginning of the contact, tau
      real(wp), intent(in) :: from
      !> Length of the contact, tau
      real(wp), intent(in) :: length

      part = force_window
      if (accumulator%in_episode) part = accumulator%begin - from + force_window
      part = min(max(part, 0.0_wp), length)
   end function early_part

   !> Add an impulse within `force_window`.
   elemental subroutine add_early_impulse(accumulator, impulse)
      type(accumulator_t), intent(inout) :: accumulator
      real(wp), intent(in) :: impulse

      accumulator%early_impulse = accumulator%early_impulse + impulse
      if (.not. accumulator%is_compliant) then
         accumulator%greatest_force = max(accumulator%greatest_force, &
            accumulator%force_scale*accumulator%early_impulse/force_window)
      end if
   end subroutine add_early_impulse

   !> Begin an episode, unless one is in progress.
   elemental subroutine begin_episode(accumulator, tau)
      type(accumulator_t), intent(inout) :: accumulator
      real(wp), intent(in) :: tau

      if (accumulator%in_episode) return
      accumulator%in_episode = .true.
      accumulator%begin = tau
      accumulator%impulse = 0.0_wp
      accumulator%early_impulse = 0.0_wp
   end subroutine begin_episode

   !> End the episode, because a flight rises above `settling_level` or the run ends.
   elemental subroutine end_episode(accumulator)
      type(accumulator_t), intent(inout) :: accumulator

      if (accumulator%in_episode) accumulator%greatest_impulse = max(accumulator%greatest_impulse, accumulator%impulse)
      accumulator%in_episode = .false.
   end subroutine end_episode

   !> Whether the beam comes to rest in static equilibrium.
   elemental logical function comes_to_rest(accumulator) result(does)
      type(accumulator_t), intent(in) :: accumulator

      does = accumulator%rest_energy > no_rest
   end function comes_to_rest

   !> Energy at the start above that at rest; 0 if it is a rounding error of these energies.
   elemental real(wp) function start_excess(accumulator) result(excess)
      type(accumulator_t), intent(in) :: accumulator

      real(wp), parameter :: rounding = 1.0e-12_wp

      excess = accumulator%start_energy - accumulator%rest_energy
      if (excess <= rounding*abs(accumulator%rest_energy)) excess = 0.0_wp
   end function start_excess

   !> Excess of an energy above the energy that counts as decayed, at rest + `settled_energy` (start - at rest); 0 if
   !> the start is at rest.
   elemental real(wp) function excess_of(accumulator, energy) result(excess)
      type(accumulator_t), intent(in) :: accumulator
      real(wp), intent(in) :: energy

      excess = settled_energy*start_excess(accumulator)
      if (excess > 0.0_wp) excess = energy - accumulator%rest_energy - excess
   end function excess_of

   !> Record that the energy has decayed, or that it exceeds the energy that counts as decayed again.
   elemental subroutine record_decay(accumulator, has_decayed, tau)
      type(accumulator_t), intent(inout) :: accumulator
      logical, intent(in) :: has_decayed
      real(wp), intent(in) :: tau

      if (has_decayed .and. .not. accumulator%has_decayed) accumulator%decay_tau = tau
      accumulator%has_decayed = has_decayed
   end subroutine record_decay

   !> Record the peak of the last rebound.
   pure subroutine record_peak(measures, tau, eta)
      !> Measures, in which the rebound is already counted
      type(run_measures_t), intent(inout) :: measures
      !> Instant of the peak, tau
      real(wp), intent(in) :: tau
      !> Displacement eta of the peak
      real(wp), intent(in) :: eta

      associate (place => measures%rebounds)
         if (.not. allocated(measures%peak_eta)) allocate (measures%peak_eta(8), measures%peak_tau(8))
         if (place > size(measures%peak_eta)) then
            ! twice as many; the second half is overwritten
            measures%peak_eta = [measures%peak_eta, measures%peak_eta]
            measures%peak_tau = [measures%peak_tau, measures%peak_tau]
         end if
         measures%peak_eta(place) = eta
         measures%peak_tau(place) = tau
      end associate
   end subroutine record_peak

   !> Compute the measures at the end of the run.
   pure subroutine finish_accumulator(accumulator, response, duration, lost, created, max_peaks, measures, contact)
      !> Accumulated sums
      type(accumulator_t), intent(inout) :: accumulator
      !> The run, with its events
      type(response_t), intent(in) :: response
      !> Length of the run, tau
      real(wp), intent(in) :: duration
      !> Energy dissipated in the beam, in the stop, at impacts
      real(wp), intent(in) :: lost(3)
      !> Energy created by replacing nodal velocities
      real(wp), intent(in) :: created
      !> Maximum number of rebounds whose peaks are recorded
      integer, intent(in) :: max_peaks
      !> Measures; final energy and rebounds have been set
      type(run_measures_t), intent(inout) :: measures
      !> Number of the contact whose events are counted; absent: all
      integer, intent(in), optional :: contact

      real(wp) :: fractions(5), initial_excess
      integer :: peaks

      call end_episode(accumulator)
      measures%duration = duration
      measures%extremes_tolerance = max(measures%extremes_tolerance, accumulator%peak_search%tolerance, &
         accumulator%force_search%tolerance)
      if (accumulator%is_compliant) then
         measures%greatest_force = accumulator%greatest_force
      else
         measures%greatest_mean_force = accumulator%greatest_force
      end if
      measures%greatest_impulse = accumulator%greatest_impulse
      call record_decay(accumulator, excess_of(accumulator, measures%final_energy) <= 0.0_wp, duration)
      measures%has_decayed = accumulator%has_decayed
      measures%decay_tau = accumulator%decay_tau
      measures%start_energy = accumulator%start_energy
      measures%rest_energy = merge(accumulator%rest_energy, ieee_value(1.0_wp, ieee_quiet_nan), &
         comes_to_rest(accumulator))
      ! without initial energy the fractions are not defined
      initial_excess = start_excess(accumulator)
      fractions = ieee_value(1.0_wp, ieee_quiet_nan)
      if (initial_excess > 0.0_wp .and. comes_to_rest(accumulator)) then
         fractions = [lost, created, measures%final_energy - accumulator%rest_energy]/initial_excess
      end if
      measures%lost_beam = fractions(1)
      measures%lost_stop = fractions(2)
      measures%lost_impact = fractions(3)
      measures%created = fractions(4)
      measures%left = fractions(5)
      if (.not. allocated(measures%peak_eta)) allocate (measures%peak_eta(0), measures%peak_tau(0))
      peaks = min(measures%rebounds, max_peaks)
      if (size(measures%peak_eta) > peaks) then
         measures%peak_eta = measures%peak_eta(:peaks)
         measures%peak_tau = measures%peak_tau(:peaks)
      end if
      call measure_events(response, measures, contact)
   end subroutine finish_accumulator

   !> Measures that follow from the events alone.
   pure subroutine measure_events(response, measures, contact)
      type(response_t), intent(in) :: response
      !> Measures; the length of the run has been set
      type(run_measures_t), intent(inout) :: measures
      !> Number of the contact whose events are counted; absent: all
      integer, intent(in), optional :: contact

      ! number of closed contacts until now
      integer :: contacts
      integer :: i
      logical :: in_contact
      ! start and end of each closed contact, [2, contacts]; index 0 stands for a contact before the run
      real(wp), allocatable :: contact_times(:, :)

      allocate (contact_times(2, 0:response%event_count + 1), source=-1.0_wp)
      contacts = 0
      in_contact = .false.
      if (present(contact) .and. allocated(response%starts_closed)) in_contact = response%starts_closed(contact)
      if (in_contact) then
         contacts = 1
         contact_times(:, 1) = [0.0_wp, measures%duration]
      end if
      do i = 1, response%event_count
         if (present(contact)) then
            if (response%events(i)%contact /= contact) cycle
         end if
         associate (event => response%events(i))
            if (is_impact(event)) measures%impacts = measures%impacts + 1
            if (.not. (measures%has_hit_stop .or. is_closed_start(event)) .and. &
               (event%kind == event_impact .or. is_contact_start(event%kind))) then
               measures%has_hit_stop = .true.
               measures%first_impact_tau = event%tau
               measures%first_impact_velocity = event%velocity_before
            end if
            if (is_contact_start(event%kind) .and. .not. in_contact) then
               in_contact = .true.
               ! a contact that an impulse at another contact opens, and that closes in the same instant, continues
               if (event%tau > contact_times(2, contacts)) then
                  contacts = contacts + 1
                  contact_times(1, contacts) = event%tau
               end if
               contact_times(2, contacts) = measures%duration
            else if (is_contact_end(event%kind) .and. in_contact) then
               in_contact = .false.
               contact_times(2, contacts) = event%tau
               ! a contact that opens at once is not a closed contact
               if (.not. event%tau > contact_times(1, contacts)) contacts = contacts - 1
            end if
         end associate
      end do
      measures%contact_start = contact_times(1, 1:contacts)
      measures%contact_end = contact_times(2, 1:contacts)
      measures%total_contact = sum(measures%contact_end - measures%contact_start)
      if (contacts > 0) measures%longest_contact = maxval(measures%contact_end - measures%contact_start)
   end subroutine measure_events

   !> Measures of a run with several contacts from the measures of each: sums, the earliest, the longest, the maximum.
   !> Rebounds, settling time and energies are those of the release contact.
   pure subroutine gather_measures(response, release_contact)
      !> The run, whose contacts have measures; receives the measures of the run
      type(response_t), intent(inout) :: response
      !> The release contact (`history_list`)
      integer, intent(in) :: release_contact

      integer :: k
      integer, allocatable :: order(:)
      real(wp), allocatable :: start(:), end(:)

      allocate (response%measures, source=response%contacts(release_contact)%measures)
      allocate (start(0), end(0))
      associate (whole => response%measures)
         whole%impacts = 0
         whole%has_hit_stop = .false.
         do k = 1, size(response%contacts)
            associate (of_contact => response%contacts(k)%measures)
               whole%impacts = whole%impacts + of_contact%impacts
               start = [start, of_contact%contact_start]
               end = [end, of_contact%contact_end]
               whole%greatest_force = max(whole%greatest_force, of_contact%greatest_force)
               whole%greatest_mean_force = max(whole%greatest_mean_force, of_contact%greatest_mean_force)
               whole%greatest_impulse = max(whole%greatest_impulse, of_contact%greatest_impulse)
               whole%extremes_tolerance = max(whole%extremes_tolerance, of_contact%extremes_tolerance)
               if (.not. of_contact%has_hit_stop) cycle
               if (whole%has_hit_stop .and. of_contact%first_impact_tau >= whole%first_impact_tau) cycle
               whole%has_hit_stop = .true.
               whole%first_impact_tau = of_contact%first_impact_tau
               whole%first_impact_velocity = of_contact%first_impact_velocity
            end associate
         end do
         order = ascending_order(start)
         whole%contact_start = start(order)
         whole%contact_end = end(order)
         whole%total_contact = sum(end - start)
         whole%longest_contact = 0.0_wp
         if (size(start) > 0) whole%longest_contact = maxval(end - start)
      end associate
   end subroutine gather_measures

   !> The measures in the order of `measure_table`; NaN for a measure that is not defined.
   pure function row_of(measures) result(row)
      !> Measures of the run
      type(run_measures_t), intent(in) :: measures
      real(wp) :: row(measure_count)

      character(*), parameter :: name(measure_count) = measure_table%name

      row = ieee_value(1.0_wp, ieee_quiet_nan)
      ! the indices are constants: a name that is missing in the table gives index 0, which the compiler refuses
      row(measure_status) = 0.0_wp
      row(findloc(name, 'impacts', 1)) = real(measures%impacts, wp)
      row(findloc(name, 'contacts', 1)) = real(size(measures%contact_start), wp)
      row(findloc(name, 'rebounds', 1)) = real(measures%rebounds, wp)
      if (measures%has_hit_stop) then
         row(findloc(name, 'first_impact_time', 1)) = measures%first_impact_tau
         row(findloc(name, 'first_impact_velocity', 1)) = measures%first_impact_velocity
      end if
      if (measures%greatest_force >= 0.0_wp) row(findloc(name, 'greatest_force', 1)) = measures%greatest_force
      if (measures%greatest_mean_force >= 0.0_wp) row(findloc(name, 'greatest_mean_force', 1)) = &
         measures%greatest_mean_force
      row(findloc(name, 'greatest_impulse', 1)) = measures%greatest_impulse
      row(findloc(name, 'total_contact', 1)) = measures%total_contact
      row(findloc(name, 'longest_contact', 1)) = measures%longest_contact
      associate (peaks => min(size(measures%peak_eta), peak_count))
         row(first_peak:first_peak + peaks - 1) = measures%peak_eta(:peaks)
      end associate
      if (measures%has_settled) row(findloc(name, 'settling_time', 1)) = measures%settling_tau
      if (measures%has_decayed) row(findloc(name, 'spent_time', 1)) = measures%decay_tau
      row(findloc(name, 'lost_beam', 1)) = measures%lost_beam
      row(findloc(name, 'lost_stop', 1)) = measures%lost_stop
      row(findloc(name, 'lost_impact', 1)) = measures%lost_impact
      row(findloc(name, 'created', 1)) = measures%created
      row(findloc(name, 'left', 1)) = measures%left
      if (measures%has_moment) row(findloc(name, 'greatest_moment', 1)) = measures%greatest_moment
      if (measures%has_stress) then
         row(findloc(name, 'greatest_stress', 1)) = measures%greatest_stress
         row(findloc(name, 'greatest_stress_time', 1)) = measures%greatest_stress_tau
         row(findloc(name, 'greatest_stress_position', 1)) = measures%greatest_stress_position
         row(findloc(name, 'stress_range', 1)) = measures%stress_range
      end if
      if (measures%extremes_tolerance > peak_tolerance) row(measure_tolerance) = measures%extremes_tolerance
      associate (first => findloc(name, 'minimum_moment', 1))
         if (allocated(measures%steady)) row(first:first + 5) = measures%steady
         if (allocated(measures%fatigue)) row(first + 6:first + 7) = measures%fatigue
      end associate
      if (allocated(measures%closing)) then
         associate (closing => measures%closing)
            row(findloc(name, 'bounces', 1)) = real(closing%bounces, wp)
            row(findloc(name, 'bounce_time', 1)) = closing%bounce_time
            row(findloc(name, 'last_opening', 1)) = closing%last_opening
            row(findloc(name, 'final_closing', 1)) = closing%final_closing
            row(findloc(name, 'minimum_force_closed', 1)) = closing%minimum_force
            row(findloc(name, 'static_force', 1)) = closing%static_force
            row(findloc(name, 'force_lasts', 1)) = closing%force_lasts
         end associate
      end if
      if (measures%has_sections) then
         row(findloc(name, 'motion_period', 1)) = real(measures%motion_period, wp)
         row(findloc(name, 'impacts_per_period', 1)) = measures%impacts_per_period
         row(findloc(name, 'lyapunov_exponent', 1)) = measures%lyapunov_exponent
      end if
      row(findloc(name, 'mesh_elements', 1)) = real(measures%mesh_elements, wp)
      if (allocated(measures%statistics)) row(first_statistic:) = measures%statistics
      if (allocated(measures%of_stops)) row(first_of_stops:first_of_stops + size(measures%of_stops) - 1) &
         = reshape(measures%of_stops, [size(measures%of_stops)])
      if (.not. allocated(measures%of_analyses)) return
      where (.not. ieee_is_nan(measures%of_analyses)) row = measures%of_analyses
   end function row_of

end module run_measures
