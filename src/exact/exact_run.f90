!> Exact motion from event to event: one phase after the other, each in closed form, with no step in time.
module exact_run
   use certified_search, only: found_none
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use motion_phases, only: found_taken_back, motion_t, phase_t, record_phase
   use number_text, only: to_text
   use response_types, only: response_t
   use run_reach, only: tell_reach
   use run_settings, only: response_settings_t
   implicit none (type, external)
   private
   public :: advance

contains

   !> One phase, and what follows.
   subroutine advance(phase, settings, standstill, motion, response, is_last)
      class(phase_t), target, intent(inout) :: phase
      !> Length of the run, limit of events
      type(response_settings_t), intent(in) :: settings
      !> Phases that ended at the instant at which they began, one after the other
      integer, intent(inout) :: standstill
      !> Its error is set where the run may not go on
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response
      !> The run ends with it
      logical, intent(out) :: is_last

      is_last = .false.
      call phase%begin(motion)
      if (allocated(motion%error)) return
      call phase%find_end(settings%duration - motion%tau)
      response%evaluations = response%evaluations + phase%search%evaluations
      standstill = standstill + 1
      if (phase%search%outcome /= found_taken_back) then
         is_last = phase%search%outcome == found_none
         if (is_last) phase%search%time = settings%duration - motion%tau
         call record_phase(phase, is_last, motion, response)
         if (.not. is_last) call phase%finish(motion)
         call phase%measure(is_last, motion)
         if (is_last) return
         if (motion%tau + phase%search%time > motion%tau) standstill = 0
         motion%tau = motion%tau + phase%search%time
      end if
      call tell_reach(motion%tau, settings%duration)
      call phase%follow(motion, response)
      call watch_events(response%event_count, settings%event_limit, standstill, motion%tau, motion%error)
   end subroutine advance

   !> Events that do not end: too many of them, or none that advances.
   subroutine watch_events(events, limit, standstill, tau, error)
      !> Events so far, and after how many the run fails
      integer, intent(in) :: events
      integer, intent(in) :: limit
      !> Phases that ended at the instant at which they began, one after the other
      integer, intent(in) :: standstill
      real(wp), intent(in) :: tau
      !> Set when the run may not go on
      type(failure_t), allocatable, intent(inout) :: error

      integer, parameter :: standstill_cap = 2000
      character(*), parameter :: remedy = '; damping or a more even mesh ends that'

      if (events > limit) then
         call fail(error, status_run_failed, 'more than event_limit = '//to_text(limit)//' events by tau = '// &
            to_text(tau)//': the motion chatters'//remedy)
      else if (standstill > standstill_cap) then
         call fail(error, status_run_failed, 'the motion does not advance beyond tau = '//to_text(tau)// &
            ': events follow each other within the rounding error of time'//remedy)
      end if
   end subroutine watch_events

end module exact_run
