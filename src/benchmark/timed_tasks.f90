!> How long a task takes: by repetition, with the system's monotonic clock.
module timed_tasks
   use failures, only: failure_t
   use kinds, only: i8, wp
   use scene_types, only: precision_settings_t
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: timed_task_t, timing_t, measure_time, clock_resolution

   !> Something that can be done again and again.
   type, abstract :: timed_task_t
   contains
      procedure(run_interface), deferred :: run
   end type timed_task_t

   abstract interface
      !> Do it once.
      subroutine run_interface(self, error)
         import :: failure_t, timed_task_t
         implicit none (type, external)
         class(timed_task_t), intent(inout) :: self
         !> Set when it fails
         type(failure_t), allocatable, intent(out) :: error
      end subroutine run_interface
   end interface

   !> Seconds that a task takes once.
   type :: timing_t
      !> Median of the timings, and the quartiles about it
      real(wp) :: median = 0.0_wp
      real(wp) :: lower_quartile = 0.0_wp
      real(wp) :: upper_quartile = 0.0_wp
      !> Timings, and how often the task was done within each
      integer :: timings = 0
      integer :: runs_each = 0
   end type timing_t

contains

   !> Seconds between two ticks of the clock.
   function clock_resolution() result(seconds)
      real(wp) :: seconds

      integer(i8) :: now, rate

      call system_clock(now, rate)
      seconds = 1.0_wp/real(rate, wp)
   end function clock_resolution

   !> Time a task.
   subroutine measure_time(task, asked, timing, error)
      class(timed_task_t), intent(inout) :: task
      !> How often, and how long at least; a task of more than a second gets three timings at most
      type(precision_settings_t), intent(in) :: asked
      type(timing_t), intent(out) :: timing
      !> Set when the task fails
      type(failure_t), allocatable, intent(out) :: error

      real(wp), parameter :: long_run = 1.0_wp
      integer, parameter :: most_of_long = 3, most_runs = 1000000
      real(wp), allocatable :: seconds(:)
      real(wp) :: once
      integer :: i, runs, timings

      ! the first run fills caches and tells how often to repeat
      call time_runs(task, 1, once, error)
      if (allocated(error)) return
      runs = 1
      do while (once*real(runs, wp) < asked%shortest_timing .and. runs < most_runs)
         runs = 2*runs
         call time_runs(task, runs, once, error)
         if (allocated(error)) return
      end do
      timings = asked%repetitions
      if (once > long_run) timings = min(asked%repetitions, most_of_long)
      allocate (seconds(timings))
      do i = 1, timings
         call time_runs(task, runs, seconds(i), error)
         if (allocated(error)) return
      end do
      seconds = seconds(ascending_order(seconds))
      timing%median = quantile(seconds, 0.5_wp)
      timing%lower_quartile = quantile(seconds, 0.25_wp)
      timing%upper_quartile = quantile(seconds, 0.75_wp)
      timing%timings = timings
      timing%runs_each = runs
   end subroutine measure_time

   !> Seconds a run, over several.
   subroutine time_runs(task, runs, seconds, error)
      class(timed_task_t), intent(inout) :: task
      !> How often
      integer, intent(in) :: runs
      !> Seconds of one
      real(wp), intent(out) :: seconds
      !> Set when the task fails
      type(failure_t), allocatable, intent(out) :: error

      integer(i8) :: start, finish, rate
      integer :: i

      seconds = 0.0_wp
      call system_clock(start, rate)
      do i = 1, runs
         call task%run(error)
         if (allocated(error)) return
      end do
      call system_clock(finish)
      seconds = real(finish - start, wp)/real(rate, wp)/real(runs, wp)
   end subroutine time_runs

   !> A quantile of sorted values, linear between them.
   pure function quantile(sorted, share) result(value)
      !> Ascending
      real(wp), intent(in) :: sorted(:)
      !> 0 ... 1
      real(wp), intent(in) :: share
      real(wp) :: value

      real(wp) :: place
      integer :: below

      place = 1.0_wp + share*real(size(sorted) - 1, wp)
      below = min(int(place), size(sorted) - 1)
      value = sorted(size(sorted))
      if (below < 1) return
      value = sorted(below) + (place - real(below, wp))*(sorted(below + 1) - sorted(below))
   end function quantile

end module timed_tasks
