!> Advance of exact motion by one phase: its end, the samples and shapes in it, and the transition to the next phase.
module motion_advance
   use certified_search, only: found_none
   use contact_phase, only: contact_phase_t
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use motion_phases, only: found_cancelled, motion_t
   use number_text, only: rounded, to_text
   use phase_transitions, only: apply_transition
   use response_types, only: response_t
   use run_observers, only: observe_events
   use run_progress, only: report_progress
   use run_recorder, only: next_sample_time, record_sample, record_shape, sample_t, samples_before, shape_due
   use run_settings, only: response_settings_t
   use tangent_events, only: revert_columns
   implicit none (type, external)
   private
   public :: advance

contains

   !> Advance the motion by one phase and the transition at its end.
   subroutine advance(phase, settings, standstill, motion, response, is_last)
      class(contact_phase_t), target, intent(inout) :: phase
      !> Length of the run, maximum number of events
      type(response_settings_t), intent(in) :: settings
      !> Number of consecutive phases that did not change tau, because their length is zero or below its rounding error
      integer, intent(inout) :: standstill
      !> Component `error` is set if the run cannot continue
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response
      !> Whether the run ends with this phase
      logical, intent(out) :: is_last

      is_last = .false.
      call phase%begin(motion)
      if (allocated(motion%error)) return
      call phase%find_end(settings%duration - motion%tau)
      response%evaluations = response%evaluations + phase%search%evaluations
      standstill = standstill + 1
      if (phase%search%outcome /= found_cancelled) then
         is_last = phase%search%outcome == found_none
         if (is_last) phase%search%time = settings%duration - motion%tau
         call record_phase(phase, is_last, motion, response)
         if (.not. is_last) call phase%finish(motion)
         call phase%measure(is_last, motion)
         if (is_last) return
         if (motion%tau + phase%search%time > motion%tau) standstill = 0
         motion%tau = motion%tau + phase%search%time
      end if
      call report_progress(motion%tau, settings%duration)
      if (phase%search%outcome == found_cancelled) call revert_columns(motion%tangent)
      call apply_transition(phase%now, phase%ended_at, phase%ended_by, phase%start_order, phase%search, &
         phase%hop_tolerance, motion, response)
      call observe_events(motion%observers, response)
      call check_events(response%event_count, settings%event_limit, standstill, motion%tau, motion%error)
   end subroutine advance

   !> Report an error if there are too many events, or events without progress in time.
   subroutine check_events(events, limit, standstill, tau, error)
      !> Number of events so far
      integer, intent(in) :: events
      !> Maximum number of events
      integer, intent(in) :: limit
      !> Number of consecutive phases that did not change tau
      integer, intent(in) :: standstill
      real(wp), intent(in) :: tau
      !> Set if the run cannot continue
      type(failure_t), allocatable, intent(inout) :: error

      ! maximum number of consecutive phases that do not change tau; far above the number of contacts, each of which may
      ! close, open or be captured at one instant
      integer, parameter :: standstill_cap = 2000
      ! without damping, a contact may open and close with the period of the fastest mode, that of the shortest element
      character(*), parameter :: remedy = 'damping or a more even mesh ends that'

      if (events > limit) then
         call fail(error, status_run_failed, 'more than event_limit = '//to_text(limit)//' events by tau = '// &
            rounded(tau)//': raise event_limit if so many are expected; if the motion chatters, '//remedy)
      else if (standstill > standstill_cap) then
         call fail(error, status_run_failed, 'the motion does not advance beyond tau = '//rounded(tau)// &
            ': events follow each other within the rounding error of time; '//remedy)
      end if
   end subroutine check_events

   !> Record the samples of a phase, and the shapes of the whole beam that are due in the phase.
   subroutine record_phase(phase, is_last, motion, response)
      class(contact_phase_t), intent(inout) :: phase
      !> Whether the run ends with this phase
      logical, intent(in) :: is_last
      type(motion_t), intent(inout) :: motion
      !> Receives the histories
      type(response_t), intent(inout) :: response

      type(sample_t) :: sample
      real(wp), allocatable :: q(:), v(:)
      real(wp) :: node(2), end_tau

      associate (recorder => motion%recorder)
         end_tau = motion%tau + phase%search%time
         do while (shape_due(recorder, end_tau, is_last))
            if (.not. allocated(q)) allocate (q(size(motion%q)), v(size(motion%v)))
            call phase%evaluate_free_modes(recorder%shape_tau(recorder%next_shape) - motion%tau, q, v, node)
            call record_shape(recorder, q, v, node)
         end do
         do while (samples_before(recorder, end_tau, is_last))
            ! a sample at the start of the phase may precede it by a rounding error
            call phase%take_sample(max(next_sample_time(recorder) - motion%tau, 0.0_wp), recorder%step, &
               recorder%requested, sample)
            ! sample 0, the initial state, has the index 1
            recorder%next = recorder%next + 1
            call record_sample(recorder%next, sample, recorder%energy_balance, response)
         end do
      end associate
   end subroutine record_phase

end module motion_advance
