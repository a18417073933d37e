!> Ends a run whose events do not end: too many of them, or none that advances.
module event_watch
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use number_text, only: to_text
   implicit none (type, external)
   private
   public :: event_watch_t, watch_events

   type :: event_watch_t
      !> Phases that ended at the instant at which they began, one after the other
      integer :: standstill = 0
   end type event_watch_t

contains

   !> At the end of a phase: may the run go on?
   subroutine watch_events(watch, events, limit, from, to, error)
      !> Counts the phases that stand still
      type(event_watch_t), intent(inout) :: watch
      !> Events so far, and after how many the run fails
      integer, intent(in) :: events
      integer, intent(in) :: limit
      !> Start and end of the phase, tau
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
      !> Set when it may not
      type(failure_t), allocatable, intent(inout) :: error

      integer, parameter :: standstill_cap = 1000
      character(*), parameter :: remedy = '; damping or a more even mesh ends that'

      watch%standstill = merge(0, watch%standstill + 1, to > from)
      if (events > limit) then
         call fail(error, status_run_failed, 'more than event_limit = '//to_text(limit)//' events by tau = '//to_text(to)// &
                   ': the motion chatters'//remedy)
      else if (watch%standstill > standstill_cap) then
         call fail(error, status_run_failed, 'the motion does not advance beyond tau = '//to_text(to)// &
                   ': events follow each other within the rounding error of time'//remedy)
      end if
   end subroutine watch_events

end module event_watch
