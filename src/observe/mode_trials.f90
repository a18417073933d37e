!> Trial runs, by which the number of modes of a run is found: the beginning of the run is computed in a small set of
!> the lowest modes and in larger sets, until two successive trials agree (docs/theory.md, section 13). This module
!> decides the length of trials, their permitted cost, and whether the motions agree. Cost, or work, is the number of
!> evaluations (sums over the modes) times the number of modes. A run is driven if harmonic loads act throughout the
!> run.
module mode_trials
   use applied_loads, only: courses_of
   use free_modes, only: free_modes_t
   use history_list, only: eta_tip, history_table
   use kinds, only: lambda1, pi, wp
   use load_settings, only: is_steady, course_harmonic, start_balance, start_rest, time_course_t
   use response_types, only: event_impact, is_contact_start, mode_check_t, response_t
   use run_differences, only: count_hops, horizon_of, impact_difference, max_difference, moment_difference
   use run_settings, only: output_settings_t, run_settings_t, stress_settings_t
   use stop_contacts, only: contact_t, contacts_of, datum_of
   implicit none (type, external)
   private
   public :: trials_t, open_trials, can_afford, add_trial, settle_length, lengthen, shorten, judge_trials, max_stalled
   public :: is_driven, solution_work, trial_settings

   !> The smaller set of modes is retained if the two motions differ by at most this fraction of the tolerance. The
   !> difference estimates the error of the smaller set; the fraction allows for later events, which may enlarge it, but
   !> less in driven runs, of which only statistics are of interest then.
   real(wp), parameter :: agreement = 0.05_wp, driven_agreement = 0.125_wp
   !> Velocities of first impacts and moments may differ by this multiple of the accuracy, because they converge more
   !> slowly with the number of modes than displacements.
   real(wp), parameter :: slow_agreement = 10.0_wp
   !> A comparison makes no progress if its difference is at least this fraction of the previous difference.
   real(wp), parameter :: progress = 0.5_wp
   !> After this number of successive comparisons without progress no further set is tried.
   integer, parameter :: max_stalled = 2
   !> All trials together may take this fraction of the work (evaluations times modes) of the run in all modes, as
   !> estimated from the first trial; of finding all modes as well while these are not known. The documentation promises
   !> at most one half; the remainder allows for the error of the estimate.
   real(wp), parameter :: fraction_of_run = 0.4_wp
   !> Work of the solution for all N modes of a mesh, over N^3 (measured: 0.04 to 0.1, N from 128 to 280).
   real(wp), parameter :: solution_work = 0.1_wp
   !> The same fraction if the evaluations are extrapolated from the trial to a longer run.
   real(wp), parameter :: fraction_of_longer_run = 0.3_wp
   !> Trials with more than this fraction of all modes save hardly any work.
   real(wp), parameter :: max_fraction = 0.6_wp
   !> A first trial with at most this fraction of all modes may be repeated with a longer duration.
   real(wp), parameter :: max_first_fraction = 0.2_wp
   !> The repeated first trial may take this fraction of the work of the run in all modes, assumed to be uniform in
   !> time.
   real(wp), parameter :: fraction_of_first = 0.12_wp
   !> Driven trials that differ at their end count as equal if they agree over the first contacts, and over at least
   !> this fraction of their length.
   real(wp), parameter :: min_early_fraction = 0.25_wp
   !> Driven trials last at least this fraction of the maximum length of the comparison after the first contact, because
   !> one impact on a stiff stop can be a burst of many contacts.
   real(wp), parameter :: min_contact_fraction = 0.125_wp
   !> A motion is compared over at most this number of periods of the lowest mode.
   integer, parameter :: max_periods = 4
   !> Under harmonic loads a motion is compared over this number of periods of the slowest load instead.
   integer, parameter :: load_periods = 2
   !> Minimum number of contacts of a meaningful trial.
   integer, parameter :: min_contacts = 3
   !> Number of contacts that is sufficient for a trial.
   integer, parameter :: enough_contacts = 64
   !> Maximum number of events in a trial.
   integer, parameter :: max_events = 256
   !> Minimum number of samples in a trial.
   integer, parameter :: min_samples = 8
   !> Number of samples in a period of the lowest mode.
   integer, parameter :: samples = 256
   !> Maximum number of samples in a trial.
   integer, parameter :: max_samples = 4096

   !> State of the trials of a run.
   type :: trials_t
      !> Settings of the next trial
      type(run_settings_t) :: settings
      !> Length of the run, tau
      real(wp) :: run_length = 0.0_wp
      !> Maximum length of the comparison, tau
      real(wp) :: window = 0.0_wp
      !> Period of the lowest mode that is not a rigid-body motion, tau
      real(wp) :: period = 0.0_wp
      !> Whether the only loads that vary in time are harmonic
      logical :: is_driven = .false.
      !> Whether this is a driven run from rest, whose rate of contacts does not decrease in time
      logical :: builds_up = .false.
      !> Number of modes of the mesh
      integer :: all_modes = 0
      !> Whether the length of the first trial has been revised once
      logical :: is_lengthened = .false.
      !> Whether the length of the remaining trials has been chosen
      logical :: is_settled = .false.
      !> Length of trials that agree over the first contacts, tau. Trials of a driven run are shorter until then,
      !> because most small sets differ at once. 0: trials are as long already
      real(wp) :: full_length = 0.0_wp
      !> Evaluations that are expected of a trial of the full length, over those of a shorter trial
      real(wp) :: growth = 1.0_wp
      !> Work of the trials so far (evaluations times modes)
      real(wp) :: work = 0.0_wp
      !> Maximum work of all trials
      real(wp) :: max_work = huge(1.0_wp)
      !> Work that more trials may take as long as not all modes are known
      real(wp) :: saved_work = 0.0_wp
      !> Expected number of evaluations of the next trial
      real(wp) :: expected = 0.0_wp
      !> Value of `max_work` after the first trial
      real(wp) :: first_max_work = 0.0_wp
      !> Value of `expected` after the first trial
      real(wp) :: first_expected = 0.0_wp
      !> Number of successive comparisons without progress
      integer :: stalled = 0
      !> Difference of the last comparison
      real(wp) :: difference = huge(1.0_wp)
      !> Displacement of the tip from the undeformed beam at which `eta_tip` is zero
      real(wp) :: tip_offset = 0.0_wp
   end type trials_t

contains

   !> Prepare the trials of a run.
   subroutine open_trials(requested, base, all_modes, trials)
      !> Settings of the run
      type(run_settings_t), intent(in) :: requested
      !> Modes of the beam, at least the lowest
      type(free_modes_t), intent(in) :: base
      !> Number of modes of the mesh
      integer, intent(in) :: all_modes
      type(trials_t), intent(out) :: trials

      type(contact_t), allocatable :: contacts(:)
      type(time_course_t), allocatable :: courses(:)
      integer :: release_contact

      trials%all_modes = all_modes
      if (size(base%lambda) < all_modes) trials%saved_work = fraction_of_run*solution_work*real(all_modes, wp)**3
      trials%settings = trial_settings(requested, 1.0_wp)
      if (allocated(trials%settings%stress)) deallocate (trials%settings%stress)
      if (allocated(requested%stress)) trials%settings%stress = stress_settings_t(position=requested%stress%position, &
         history=.false.)
      ! the extremes of moments are found with the measures
      trials%settings%output%measures = allocated(requested%stress)
      trials%run_length = requested%response%duration
      trials%period = 2.0_wp*pi*(lambda1/base%lambda(findloc(base%lambda > 0.0_wp, .true., dim=1)))**2
      trials%window = min(trials%run_length, real(max_periods, wp)*trials%period)
      allocate (courses, source=courses_of(requested))
      associate (harmonic => courses%kind == course_harmonic)
         trials%is_driven = is_driven(requested)
         trials%builds_up = trials%is_driven .and. any(requested%start%kind == [start_rest, start_balance])
         if (any(harmonic)) trials%window = min(trials%run_length, real(load_periods, wp)*2.0_wp*pi &
            /minval(courses%frequency, mask=harmonic))
      end associate
      trials%settings%response%event_limit = min(requested%response%event_limit, max_events)
      call set_length(trials, min(trials%window, real(max_periods, wp)*trials%period))
      allocate (contacts, source=contacts_of(requested))
      release_contact = findloc(contacts%is_release_contact, .true., dim=1)
      if (release_contact > 0) trials%tip_offset = datum_of(contacts(release_contact))
   end subroutine open_trials

   !> Whether harmonic loads act throughout the run, and no other load that varies in time.
   pure logical function is_driven(settings) result(answer)
      type(run_settings_t), intent(in) :: settings

      type(time_course_t), allocatable :: courses(:)

      allocate (courses, source=courses_of(settings))
      answer = any(courses%kind == course_harmonic) .and. all(is_steady(courses))
   end function is_driven

   !> Set the length of the next trial, and its samples.
   pure subroutine set_length(trials, length)
      type(trials_t), intent(inout) :: trials
      !> Length, tau
      real(wp), intent(in) :: length

      associate (response => trials%settings%response)
         response%duration = length
         response%step = max(min(length, trials%period)/real(samples, wp), length/real(max_samples, wp))
      end associate
   end subroutine set_length

   !> Whether the permitted cost allows a trial with a given number of modes. Before the first trial only the lengths of
   !> trial and run are known, and the work of at least two such trials must be permitted.
   pure logical function can_afford(trials, modes) result(answer)
      type(trials_t), intent(in) :: trials
      integer, intent(in) :: modes

      real(wp) :: length

      answer = real(modes, wp) <= max_fraction*real(trials%all_modes, wp)
      if (.not. answer) return
      length = trials%settings%response%duration
      if (trials%work > 0.0_wp) then
         answer = trials%work + trials%expected*real(modes, wp) <= trials%max_work + trials%saved_work
      else
         if (trials%builds_up) length = length**2/trials%run_length
         answer = 2.0_wp*real(modes, wp)*length <= fraction_of_run*real(trials%all_modes, wp) &
            *trials%settings%response%duration
      end if
   end function can_afford

   !> Add the work of a trial. The first trial gives an estimate of the evaluations of the run: at least as many as in
   !> the trial. A driven run from rest needs more, in proportion to its remaining length and to the fraction of events
   !> in the second half of the trial, because its contacts do not become rarer.
   pure subroutine add_trial(trials, modes, response)
      type(trials_t), intent(inout) :: trials
      integer, intent(in) :: modes
      type(response_t), intent(in) :: response

      real(wp) :: max_evaluations

      associate (length => trials%settings%response%duration, evaluations => real(response%evaluations, wp))
         trials%work = trials%work + evaluations*real(modes, wp)
         if (trials%is_settled) then
            ! a trial with more modes may take fewer evaluations
            trials%max_work = trials%first_max_work*min(1.0_wp, evaluations/max(trials%first_expected, 1.0_wp))
         else
            max_evaluations = fraction_of_run*evaluations
            if (trials%builds_up .and. response%event_count > 0 .and. length < trials%run_length) then
               associate (tau => response%events(:response%event_count)%tau)
                  max_evaluations = fraction_of_longer_run*evaluations*(1.0_wp &
                     + 2.0_wp*(trials%run_length - length)/length &
                     *real(count(tau > 0.5_wp*length), wp)/real(response%event_count, wp))
               end associate
            end if
            trials%max_work = max_evaluations*real(trials%all_modes, wp)
            trials%first_max_work = trials%max_work
         end if
         trials%expected = evaluations
      end associate
   end subroutine add_trial

   !> After the first trial, make the trial longer if it has too few contacts, so that the caller repeats the trial;
   !> otherwise choose the length of the remaining trials.
   pure subroutine settle_length(trials, modes, response)
      type(trials_t), intent(inout) :: trials
      integer, intent(in) :: modes
      !> Result of the trial
      type(response_t), intent(in) :: response

      ! length of the trial
      real(wp) :: length
      ! length of the next trial
      real(wp) :: new_length

      associate (settings => trials%settings, contacts => contact_times(response))
         length = settings%response%duration
         if (.not. trials%is_lengthened .and. size(contacts) < enough_contacts .and. &
            real(modes, wp) <= max_first_fraction*real(trials%all_modes, wp)) then
            trials%is_lengthened = .true.
            new_length = trials%window
            if (size(contacts) < min_contacts .and. settings%has_stop) new_length = trials%run_length
            new_length = min(new_length, fraction_of_first*trials%run_length*real(trials%all_modes, wp)/real(modes, wp))
            if (new_length > length) then
               call set_length(trials, new_length)
               return
            end if
         end if
         trials%is_settled = .true.
         if (trials%is_driven) then
            trials%full_length = enough_time(trials, response)
            new_length = first_contacts(trials, response, trials%full_length)
            trials%growth = evaluations_until(trials%full_length)/evaluations_until(new_length)
            if (.not. new_length < trials%full_length) trials%full_length = 0.0_wp
         else
            new_length = horizon_of(response, length)
         end if
         trials%expected = trials%expected*evaluations_until(new_length)/evaluations_until(length)
         trials%first_expected = trials%expected
         ! the sampling step does not change
         settings%response%duration = new_length
      end associate

   contains

      !> Evaluations until an instant, in evaluations an event.
      pure real(wp) function evaluations_until(tau) result(number)
         real(wp), intent(in) :: tau

         number = 1.0_wp
         if (response%event_count > 0) number = real(1 + count(response%events(:response%event_count)%tau <= tau), wp)
      end function evaluations_until
   end subroutine settle_length

   !> Give further trials the full length.
   pure subroutine lengthen(trials)
      type(trials_t), intent(inout) :: trials

      trials%settings%response%duration = trials%full_length
      trials%full_length = 0.0_wp
      trials%expected = trials%growth*trials%expected
      trials%first_expected = trials%growth*trials%first_expected
   end subroutine lengthen

   !> After the first trial has stopped at the maximum number of events, shorten the trial if enough samples remain for
   !> a comparison.
   pure subroutine shorten(trials, response, has_shortened)
      type(trials_t), intent(inout) :: trials
      !> Result of the trial
      type(response_t), intent(in) :: response
      logical, intent(out) :: has_shortened

      associate (settings => trials%settings%response, contacts => contact_times(response))
         has_shortened = .not. trials%is_settled .and. response%event_count > settings%event_limit &
            .and. size(contacts) > enough_contacts
         if (has_shortened) has_shortened = contacts(enough_contacts) >= real(min_samples, wp)*settings%step &
            .and. enough_time(trials, response) < contacts(size(contacts))
         if (.not. has_shortened) return
         settings%duration = enough_time(trials, response)
         trials%is_lengthened = .true.
      end associate
   end subroutine shorten

   !> Length of a trial that contains `enough_contacts` contacts, at most the present length.
   pure real(wp) function enough_time(trials, response) result(length)
      type(trials_t), intent(in) :: trials
      type(response_t), intent(in) :: response

      associate (settings => trials%settings%response, contacts => contact_times(response))
         length = settings%duration
         if (size(contacts) > enough_contacts) length = min(length, max(contacts(enough_contacts), contacts(1) &
            + min_contact_fraction*trials%window, real(min_samples, wp)*settings%step))
      end associate
   end function enough_time

   !> Instants at which contacts begin in a run.
   pure function contact_times(response) result(tau)
      type(response_t), intent(in) :: response
      real(wp), allocatable :: tau(:)

      allocate (tau(0))
      if (response%event_count == 0) return
      associate (events => response%events(:response%event_count))
         tau = pack(events%tau, events%kind == event_impact .or. is_contact_start(events%kind))
      end associate
   end function contact_times

   !> Compare the last two trials.
   pure subroutine judge_trials(trials, fewer, more, check, early)
      type(trials_t), intent(inout) :: trials
      type(response_t), intent(in) :: fewer
      type(response_t), intent(in) :: more
      !> Receives difference, horizon and tolerance, and whether the motions agree
      type(mode_check_t), intent(inout) :: check
      !> For a driven run, comparison of the trials over the first contacts alone, because after several contacts any
      !> two motions differ
      type(mode_check_t), intent(out) :: early

      real(wp) :: horizon

      early = check
      horizon = trials%settings%response%duration
      if (trials%is_driven) then
         call compare_until(trials, min(first_contacts(trials, fewer, horizon), &
            first_contacts(trials, more, horizon)), fewer, more, early)
      else
         horizon = min(horizon_of(fewer, horizon), horizon_of(more, horizon))
      end if
      call compare_until(trials, horizon, fewer, more, check)
      trials%stalled = trials%stalled + 1
      if (check%difference < progress*trials%difference) trials%stalled = 0
      trials%difference = check%difference
   end subroutine judge_trials

   !> Instant at which the fourth contact begins, at least a fraction of the length of the trial, and of the maximum
   !> length after the first contact; the end of the trial if there are fewer than four contacts.
   pure real(wp) function first_contacts(trials, response, length) result(tau)
      type(trials_t), intent(in) :: trials
      type(response_t), intent(in) :: response
      !> Length of the trial, tau
      real(wp), intent(in) :: length

      tau = length
      associate (contacts => contact_times(response))
         if (size(contacts) > min_contacts) tau = min(tau, max(contacts(min_contacts + 1), min_early_fraction*length, &
            contacts(1) + min_contact_fraction*trials%window))
      end associate
   end function first_contacts

   !> Maximum difference of two trials in the displacements of stops and tip, and whether it is small compared with the
   !> maximum displacement. If nothing that is compared moves, the trials do not show what omitted modes change.
   pure subroutine compare_until(trials, horizon, fewer, more, check)
      type(trials_t), intent(in) :: trials
      !> End of the comparison, tau
      real(wp), intent(in) :: horizon
      !> Results of the trials, with the same samples
      type(response_t), intent(in) :: fewer
      type(response_t), intent(in) :: more
      type(mode_check_t), intent(inout) :: check

      real(wp) :: max_displacement
      integer :: k, last

      last = count(more%tau <= horizon)
      check%difference = max_difference(fewer, more, last)
      check%moment_difference = moment_difference(fewer, more)
      max_displacement = maxval(abs(more%history(eta_tip)%values(:last) + trials%tip_offset))
      do k = 1, size(more%contacts)
         ! the displacement at a body is relative to the body, which may be far away
         if (more%contacts(k)%stop > 0) max_displacement = max(max_displacement, &
            maxval(abs(more%contacts(k)%eta(:last) + more%contacts(k)%height)))
      end do
      check%horizon = horizon
      check%tolerance = min(trials%settings%response%accuracy*max_displacement, trials%settings%response%mode_tolerance)
      check%agrees = max_displacement > 0.0_wp .and. &
         check%difference <= merge(driven_agreement, agreement, trials%is_driven)*check%tolerance
      if (check%agrees) check%agrees = &
         count_hops(fewer, horizon, check%tolerance) == count_hops(more, horizon, check%tolerance) .and. &
         max(impact_difference(fewer, more, horizon), check%moment_difference) &
         <= slow_agreement*trials%settings%response%accuracy
   end subroutine compare_until

   !> Settings of a run for comparison, limited to a few periods of its lowest mode, with samples for the comparison
   !> only.
   pure type(run_settings_t) function trial_settings(requested, lowest) result(settings)
      !> Settings of the run
      type(run_settings_t), intent(in) :: requested
      !> lambda of the lowest mode
      real(wp), intent(in) :: lowest

      real(wp) :: period

      settings = requested
      settings%output = output_settings_t(history=history_table%quantity == 'displacement')
      ! output that is not compared is omitted; an empty list of stresses remains because `has_one_contact` reads the
      ! list
      if (allocated(settings%stress) .or. allocated(settings%statistics)) then
         settings%stress = stress_settings_t(history=.false.)
         allocate (settings%stress%position(0))
         if (allocated(settings%statistics)) deallocate (settings%statistics)
      end if
      if (allocated(settings%poincare)) deallocate (settings%poincare)
      if (allocated(settings%spectrum)) deallocate (settings%spectrum)
      ! a beam that turns freely has lambda 0
      period = 2.0_wp*pi*(lambda1/max(lowest, epsilon(1.0_wp)))**2
      associate (response => settings%response)
         response%duration = min(requested%response%duration, real(max_periods, wp)*period)
         response%step = min(response%duration, period)/real(samples, wp)
      end associate
   end function trial_settings

end module mode_trials
