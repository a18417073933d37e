!> Runs of a part of the length in some modes and in more, by which the number of modes of a run is found: how long they
!> are, what they may cost, and whether their motions agree (docs/theory.md, section 13).
module mode_trials
   use applied_loads, only: courses_of
   use free_modes, only: free_modes_t
   use history_list, only: eta_stop, eta_tip, history_table
   use kinds, only: lambda1, pi, wp
   use load_periods, only: is_steady
   use load_settings, only: course_harmonic, start_balance, start_rest, time_course_t
   use response_types, only: event_impact, is_contact_start, mode_check_t, settling_level, response_t
   use run_settings, only: output_settings_t, run_settings_t, stress_settings_t
   use stop_contacts, only: contact_t, contacts_of
   implicit none (type, external)
   private
   public :: trials_t, open_trials, can_afford, add_trial, settle_length, shorten, judge_trials, most_stalled, is_driven
   public :: compare_runs, trial_settings

   !> The smaller of two sets is kept if the motion in both differs by no more than this share of the tolerance: the
   !> difference is nearly the error of the smaller, but events may enlarge it.
   real(wp), parameter :: agreement = 0.05_wp
   !> More modes that leave this share of the difference or more have not brought the motions nearer. Where that
   !> happens so often in turn, no further set is tried.
   real(wp), parameter :: progress = 0.5_wp
   integer, parameter :: most_stalled = 2
   !> All trials together may take this share of the evaluations times modes of the run in all modes, as estimated from
   !> the first trial. Half is promised; the rest is for the error of that estimate, which is greater if the run is
   !> longer.
   real(wp), parameter :: share_of_run = 0.4_wp, share_of_longer_run = 0.3_wp
   !> Trials of more than this share of all modes have little to save.
   real(wp), parameter :: most_worth = 0.6_wp
   !> A first trial of no more than this share of all modes may be made once more, longer, if it then takes no more than
   !> this share of the run should that be even.
   real(wp), parameter :: most_of_modes = 0.2_wp, share_of_first = 0.12_wp
   !> Trials that part are taken to agree if they do so for this share of their length at least.
   real(wp), parameter :: least_share = 0.25_wp
   !> A motion is compared until the peak of this rebound, and over so many periods of the lowest mode at most; one
   !> under harmonic loads over so many periods of the slowest.
   integer, parameter :: last_rebound = 3, most_periods = 4, load_periods = 2
   !> A trial with fewer contacts than this says little about a stop, one with so many enough.
   integer, parameter :: fewest_contacts = 3, enough_contacts = 64
   !> A trial with more events than this ends. It has so many samples at least.
   integer, parameter :: most_events = 256, fewest_samples = 8
   !> Samples in the period of the lowest mode, and in a whole trial.
   integer, parameter :: samples = 256, most_samples = 4096

   !> The runs from which the number of modes is found.
   type :: trials_t
      !> Of the next of them
      type(run_settings_t) :: settings
      !> Length of the run, and how long they are to be compared, tau
      real(wp) :: run_length = 0.0_wp
      real(wp) :: window = 0.0_wp
      !> Of the lowest mode with strain, tau
      real(wp) :: period = 0.0_wp
      !> Harmonic loads act, and nothing else changes
      logical :: is_driven = .false.
      !> From rest, so that contacts become no fewer
      logical :: builds_up = .false.
      !> Number of modes of the mesh
      integer :: all_modes = 0
      !> The first trial is made once more, longer; the length of the others is known
      logical :: is_lengthened = .false.
      logical :: is_settled = .false.
      !> Evaluations times modes of the trials so far, and what they may be; evaluations that the next one is expected
      !> to take
      real(wp) :: work = 0.0_wp
      real(wp) :: most_work = huge(1.0_wp)
      real(wp) :: expected = 0.0_wp
      !> What the first trial alone makes of either
      real(wp) :: work_of_first = 0.0_wp
      real(wp) :: of_first = 0.0_wp
      !> Comparisons in turn that brought the motions no nearer, and the last difference
      integer :: stalled = 0
      real(wp) :: difference = huge(1.0_wp)
      !> Where `eta_tip` counts from
      real(wp) :: tip_offset = 0.0_wp
   end type trials_t

contains

   !> Prepare the trials of a run.
   subroutine open_trials(asked, base, all_modes, trials)
      !> The run itself
      type(run_settings_t), intent(in) :: asked
      !> The lowest modes at least
      type(free_modes_t), intent(in) :: base
      !> Number of modes of the mesh
      integer, intent(in) :: all_modes
      type(trials_t), intent(out) :: trials

      type(contact_t), allocatable :: contacts(:)
      type(time_course_t), allocatable :: courses(:)
      integer :: release_contact

      trials%all_modes = all_modes
      trials%settings = trial_settings(asked, 1.0_wp)
      if (allocated(trials%settings%stress)) deallocate (trials%settings%stress)
      trials%run_length = asked%response%duration
      associate (first => findloc(base%lambda > 0.0_wp, .true., dim=1))
         trials%period = 2.0_wp*pi*(lambda1/base%lambda(first))**2
      end associate
      trials%window = min(trials%run_length, real(most_periods, wp)*trials%period)
      allocate (courses, source=courses_of(asked))
      associate (harmonic => courses%kind == course_harmonic)
         trials%is_driven = is_driven(asked)
         trials%builds_up = trials%is_driven .and. any(asked%start%kind == [start_rest, start_balance])
         if (any(harmonic)) trials%window = min(trials%run_length, real(load_periods, wp)*2.0_wp*pi &
            /minval(courses%frequency, mask=harmonic))
      end associate
      trials%settings%response%event_limit = min(asked%response%event_limit, most_events)
      call set_length(trials, min(trials%window, real(most_periods, wp)*trials%period))
      allocate (contacts, source=contacts_of(asked))
      release_contact = findloc(contacts%is_release_contact, .true., dim=1)
      if (release_contact > 0) trials%tip_offset = contacts(release_contact)%sign*contacts(release_contact)%height
   end subroutine open_trials

   !> Do harmonic loads act from the start for ever, and nothing else that changes?
   pure function is_driven(settings) result(answer)
      type(run_settings_t), intent(in) :: settings
      logical :: answer

      type(time_course_t), allocatable :: courses(:)

      allocate (courses, source=courses_of(settings))
      answer = any(courses%kind == course_harmonic) .and. all(is_steady(courses))
   end function is_driven

   !> The next trial is so long.
   pure subroutine set_length(trials, length)
      type(trials_t), intent(inout) :: trials
      !> tau
      real(wp), intent(in) :: length

      associate (response => trials%settings%response)
         response%duration = length
         response%step = max(min(length, trials%period)/real(samples, wp), length/real(most_samples, wp))
      end associate
   end subroutine set_length

   !> May a trial of so many modes be made? Before the first nothing is known but the lengths: that trial and one of
   !> more modes must fit.
   pure function can_afford(trials, modes) result(answer)
      type(trials_t), intent(in) :: trials
      integer, intent(in) :: modes
      logical :: answer

      real(wp) :: length

      answer = real(modes, wp) <= most_worth*real(trials%all_modes, wp)
      if (.not. answer) return
      length = trials%settings%response%duration
      if (trials%work > 0.0_wp) then
         answer = trials%work + trials%expected*real(modes, wp) <= trials%most_work
      else
         if (trials%builds_up) length = length**2/trials%run_length
         answer = 2.0_wp*real(modes, wp)*length <= share_of_run*real(trials%all_modes, wp) &
            *trials%settings%response%duration
      end if
   end function can_afford

   !> What a trial took. The first shows what the run will take: no less than that, and under harmonic loads as much
   !> again as often as the trial goes into the run, if contacts do not become fewer.
   pure subroutine add_trial(trials, modes, response)
      type(trials_t), intent(inout) :: trials
      integer, intent(in) :: modes
      type(response_t), intent(in) :: response

      real(wp) :: of_run

      associate (length => trials%settings%response%duration, evaluations => real(response%evaluations, wp))
         trials%work = trials%work + evaluations*real(modes, wp)
         if (trials%is_settled) then
            ! more modes may need fewer
            trials%most_work = trials%work_of_first*min(1.0_wp, evaluations/max(trials%of_first, 1.0_wp))
         else
            of_run = share_of_run*evaluations
            if (trials%builds_up .and. response%event_count > 0 .and. length < trials%run_length) then
               associate (tau => response%events(:response%event_count)%tau)
                  of_run = share_of_longer_run*evaluations*(1.0_wp + 2.0_wp*(trials%run_length - length)/length &
                     *real(count(tau > 0.5_wp*length), wp)/real(response%event_count, wp))
               end associate
            end if
            trials%most_work = of_run*real(trials%all_modes, wp)
            trials%work_of_first = trials%most_work
         end if
         trials%expected = evaluations
      end associate
   end subroutine add_trial

   !> After the first trial: lengthen it if it has met too few contacts, to be made once more; else settle the length of
   !> the others.
   pure subroutine settle_length(trials, modes, response)
      type(trials_t), intent(inout) :: trials
      integer, intent(in) :: modes
      !> The trial
      type(response_t), intent(in) :: response

      real(wp) :: length, most

      associate (settings => trials%settings, contacts => contact_times(response))
         length = settings%response%duration
         if (.not. trials%is_lengthened .and. size(contacts) < enough_contacts .and. &
            real(modes, wp) <= most_of_modes*real(trials%all_modes, wp)) then
            trials%is_lengthened = .true.
            most = trials%window
            if (size(contacts) < fewest_contacts .and. settings%has_stop) most = trials%run_length
            most = min(most, share_of_first*trials%run_length*real(trials%all_modes, wp)/real(modes, wp))
            if (most > length) then
               call set_length(trials, most)
               return
            end if
         end if
         trials%is_settled = .true.
         most = horizon_of(response, length)
         if (trials%is_driven) most = enough_time(trials, response)
         if (response%event_count > 0 .and. most < length) then
            associate (events => response%events(:response%event_count))
               trials%expected = trials%expected*real(1 + count(events%tau <= most), wp)/real(1 + size(events), wp)
            end associate
         end if
         trials%of_first = trials%expected
         ! the samples stay where they are
         settings%response%duration = most
      end associate
   end subroutine settle_length

   !> After the first trial has ended with too many events: shorten it, if that leaves something to compare.
   pure subroutine shorten(trials, response, has_shortened)
      type(trials_t), intent(inout) :: trials
      !> The trial
      type(response_t), intent(in) :: response
      logical, intent(out) :: has_shortened

      associate (settings => trials%settings%response, contacts => contact_times(response))
         has_shortened = .not. trials%is_settled .and. response%event_count > settings%event_limit &
            .and. size(contacts) > enough_contacts
         if (has_shortened) has_shortened = contacts(enough_contacts) >= real(fewest_samples, wp)*settings%step
         if (.not. has_shortened) return
         settings%duration = contacts(enough_contacts)
         trials%is_lengthened = .true.
      end associate
   end subroutine shorten

   !> How long a trial is that meets enough contacts, and no longer than it was.
   pure function enough_time(trials, response) result(length)
      type(trials_t), intent(in) :: trials
      type(response_t), intent(in) :: response
      real(wp) :: length

      associate (settings => trials%settings%response, contacts => contact_times(response))
         length = settings%duration
         if (size(contacts) > enough_contacts) length = min(length, max(contacts(enough_contacts), &
            real(fewest_samples, wp)*settings%step))
      end associate
   end function enough_time

   !> When contacts begin in a run.
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
      !> Gets difference, horizon and tolerance, and whether the motions agree
      type(mode_check_t), intent(inout) :: check
      !> The same of the first contacts alone, under harmonic loads, where contacts soon make any motion another
      type(mode_check_t), intent(out) :: early

      real(wp) :: horizon, soon

      early = check
      horizon = trials%settings%response%duration
      if (trials%is_driven) then
         soon = max(least_share*horizon, min(after_contacts(fewer, horizon), after_contacts(more, horizon)))
         call compare_until(trials, soon, fewer, more, early)
      else
         horizon = min(horizon_of(fewer, horizon), horizon_of(more, horizon))
      end if
      call compare_until(trials, horizon, fewer, more, check)
      trials%stalled = trials%stalled + 1
      if (check%difference < progress*trials%difference) trials%stalled = 0
      trials%difference = check%difference
   end subroutine judge_trials

   !> The end of the third contact, as the next one begins; the end of the trial if there are fewer.
   pure function after_contacts(response, length) result(tau)
      type(response_t), intent(in) :: response
      !> Its length
      real(wp), intent(in) :: length
      real(wp) :: tau

      tau = length
      associate (contacts => contact_times(response))
         if (size(contacts) > fewest_contacts) tau = min(tau, contacts(fewest_contacts + 1))
      end associate
   end function after_contacts

   !> The greatest difference of two trials in the displacements of stops and tip, and whether it is small beside the
   !> greatest displacement.
   pure subroutine compare_until(trials, horizon, fewer, more, check)
      type(trials_t), intent(in) :: trials
      !> tau
      real(wp), intent(in) :: horizon
      !> Sampled alike
      type(response_t), intent(in) :: fewer
      type(response_t), intent(in) :: more
      type(mode_check_t), intent(inout) :: check

      real(wp) :: greatest
      integer :: k, last

      last = count(more%tau <= horizon)
      associate (one => fewer%history(eta_tip)%values(:last), other => more%history(eta_tip)%values(:last))
         check%difference = maxval(abs(one - other))
         greatest = maxval(abs(other + trials%tip_offset))
      end associate
      do k = 1, size(more%contacts)
         associate (one => fewer%contacts(k)%eta(:last), other => more%contacts(k)%eta(:last))
            check%difference = max(check%difference, maxval(abs(one - other)))
            greatest = max(greatest, maxval(abs(other + more%contacts(k)%height)))
         end associate
      end do
      check%horizon = horizon
      associate (response => trials%settings%response)
         check%tolerance = min(response%accuracy*greatest, response%mode_tolerance)
      end associate
      check%agrees = check%difference <= agreement*check%tolerance
      if (check%agrees) check%agrees = &
         count_hops(fewer, horizon, check%tolerance) == count_hops(more, horizon, check%tolerance)
   end subroutine compare_until

   !> Number of flights from contact to contact that rise above a height, as far as their length and their last speed
   !> tell: samples may miss them.
   pure function count_hops(response, horizon, height) result(number)
      type(response_t), intent(in) :: response
      !> Up to here, tau
      real(wp), intent(in) :: horizon
      real(wp), intent(in) :: height
      integer :: number

      real(wp) :: last(size(response%contacts))
      integer :: i

      number = 0
      last = -1.0_wp
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

   !> A run to compare: no longer than it may be trusted, with samples of its own.
   pure function trial_settings(asked, lowest) result(settings)
      !> The run itself
      type(run_settings_t), intent(in) :: asked
      !> lambda of the lowest mode
      real(wp), intent(in) :: lowest
      type(run_settings_t) :: settings

      real(wp) :: period

      settings = asked
      settings%output = output_settings_t(history=history_table%quantity == 'displacement')
      ! what is not compared costs nothing: moments nowhere, so that a run among surfaces stays one
      if (allocated(settings%stress) .or. allocated(settings%statistics)) then
         settings%stress = stress_settings_t(history=.false.)
         allocate (settings%stress%position(0))
         if (allocated(settings%statistics)) deallocate (settings%statistics)
      end if
      if (allocated(settings%poincare)) deallocate (settings%poincare)
      period = 2.0_wp*pi*(lambda1/lowest)**2
      associate (response => settings%response)
         response%duration = min(asked%response%duration, real(most_periods, wp)*period)
         response%step = min(response%duration, period)/real(samples, wp)
      end associate
   end function trial_settings

   !> The greatest difference of two runs in eta of stop and tip, up to the peak of the third rebound of either.
   pure subroutine compare_runs(fewer, more, duration, check)
      !> The runs, sampled alike
      type(response_t), intent(in) :: fewer
      type(response_t), intent(in) :: more
      !> Their length
      real(wp), intent(in) :: duration
      !> Gets difference and horizon
      type(mode_check_t), intent(inout) :: check

      integer :: last

      check%horizon = min(horizon_of(fewer, duration), horizon_of(more, duration))
      last = count(more%tau <= check%horizon)
      check%difference = max(maxval(abs(fewer%history(eta_stop)%values(:last) &
         - more%history(eta_stop)%values(:last))), &
         maxval(abs(fewer%history(eta_tip)%values(:last) - more%history(eta_tip)%values(:last))))
   end subroutine compare_runs

   !> The sample at the peak of the third rebound, a flight that rises above the quiet level; the end if there are
   !> fewer.
   pure function horizon_of(response, duration) result(horizon)
      type(response_t), intent(in) :: response
      !> Its length
      real(wp), intent(in) :: duration
      real(wp) :: horizon

      real(wp) :: highest
      integer :: event, rebounds, i

      horizon = duration
      event = 0
      rebounds = 0
      do i = 1, size(response%tau)
         do while (event < response%event_count)
            if (response%events(event + 1)%tau > response%tau(i)) exit
            event = event + 1
            highest = settling_level
         end do
         if (event == 0) cycle
         if (response%history(eta_stop)%values(i) <= highest) cycle
         if (highest <= settling_level) rebounds = rebounds + 1
         if (rebounds > last_rebound) return
         if (rebounds == last_rebound) horizon = response%tau(i)
         highest = response%history(eta_stop)%values(i)
      end do
   end function horizon_of

end module mode_trials
