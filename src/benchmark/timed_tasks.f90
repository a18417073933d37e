!> Measures the run time of a task by repetition, with the monotonic clock of the system.
module timed_tasks
   use failures, only: failure_t
   use kinds, only: i8, wp
   use scene_types, only: precision_settings_t
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: timed_task_t, timing_t, measure_time, clock_resolution

   !> Task that can be executed repeatedly.
   type, abstract :: timed_task_t
   contains
      procedure(run_interface), deferred :: run
   end type timed_task_t

   abstract interface
      !> Execute the task once.
      subroutine run_interface(self, error)
         import :: failure_t, timed_task_t
         implicit none (type, external)
         class(timed_task_t), intent(inout) :: self
         !> Set if the task fails
         type(failure_t), allocatable, intent(out) :: error
      end subroutine run_interface
   end interface

   !> Run time of one execution of a task, s.
   type :: timing_t
      !> Median of the timings, s
      real(wp) :: median = 0.0_wp
      !> Lower quartile of the timings, s
      real(wp) :: lower_quartile = 0.0_wp
      !> Upper quartile of the timings, s
      real(wp) :: upper_quartile = 0.0_wp
      !> Number of timings
      integer :: timings = 0
      !> Number of executions in each timing
      integer :: runs_each = 0
   end type timing_t

contains

   !> Resolution of the clock, s.
   real(wp) function clock_resolution() result(seconds)

      integer(i8) :: now, rate

      call system_clock(now, rate)
      seconds = 1.0_wp/real(rate, wp)
   end function clock_resolution

   !> Measure the run time of a task.
   subroutine measure_time(task, requested, timing, error)
      class(timed_task_t), intent(inout) :: task
      !> Number of timings, and minimum length of a timing; a task of more than a second is timed three times at most
      type(precision_settings_t), intent(in) :: requested
      type(timing_t), intent(out) :: timing
      !> Set if the task fails
      type(failure_t), allocatable, intent(out) :: error

      ! a task of more than this time is long, s
      real(wp), parameter :: long_run = 1.0_wp
      ! maximum number of timings of a long task
      integer, parameter :: max_long_timings = 3
      ! maximum number of executions in a timing
      integer, parameter :: max_runs = 1000000
      real(wp), allocatable :: seconds(:)
      ! time of one execution, s
      real(wp) :: once
      ! number of executions in a timing
      integer :: runs
      ! number of timings
      integer :: timings
      integer :: i

      ! the first execution fills the caches; its time starts the search for the number of executions in a timing
      call time_runs(task, 1, once, error)
      if (allocated(error)) return
      runs = 1
      do while (once*real(runs, wp) < requested%shortest_timing .and. runs < max_runs)
         runs = 2*runs
         call time_runs(task, runs, once, error)
         if (allocated(error)) return
      end do
      timings = requested%repetitions
      if (once > long_run) timings = min(requested%repetitions, max_long_timings)
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

   !> Mean time of one execution over several executions, s.
   subroutine time_runs(task, runs, seconds, error)
      class(timed_task_t), intent(inout) :: task
      !> Number of executions
      integer, intent(in) :: runs
      !> Time of one execution, s
      real(wp), intent(out) :: seconds
      !> Set if the task fails
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

   !> Quantile of sorted values, with linear interpolation.
   pure real(wp) function quantile(sorted, probability) result(value)
      !> Values in ascending order
      real(wp), intent(in) :: sorted(:)
      !> Probability of the quantile, 0 to 1
      real(wp), intent(in) :: probability

      real(wp) :: position
      integer :: below

      position = 1.0_wp + probability*real(size(sorted) - 1, wp)
      below = min(int(position), size(sorted) - 1)
      value = sorted(size(sorted))
      if (below < 1) return
      value = sorted(below) + (position - real(below, wp))*(sorted(below + 1) - sorted(below))
   end function quantile

end module timed_tasks
