!> Measures the run time of a task by repetition, with the monotonic clock of the system. Conditions on which a timing
!> depends besides the program (processor, compiler, build), and the memory of the process; processor and memory are
!> read from /proc if the system has it.
module timed_tasks
   use, intrinsic :: iso_fortran_env, only: compiler_options
   use failures, only: failure_t
   use kinds, only: i8, wp
   use scene_types, only: precision_settings_t
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: timed_task_t, timing_t, measure_time, clock_resolution, processor_name, options_of_compiler, &
      kind_of_build, peak_memory, reset_peak_memory

   !> Maximum length of a line of the files in /proc.
   integer, parameter :: line_length = 256

   interface
      !> Return freed memory to the system if the C library can do so.
      subroutine return_free_memory() bind(c, name='impactbeam_return_free_memory')
         implicit none (type, external)
      end subroutine return_free_memory
   end interface

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

   !> Name of the processor; empty if it is not known.
   function processor_name() result(name)
      character(:), allocatable :: name

      name = value_in('/proc/cpuinfo', 'model name')
   end function processor_name

   !> Options of the compiler, without those that contain folders.
   function options_of_compiler() result(options)
      character(:), allocatable :: options

      character(:), allocatable :: all_options, word
      integer :: position, next
      ! whether the next word is the argument of an option that is left out
      logical :: skips_word

      all_options = compiler_options()//' '
      options = ''
      position = 1
      skips_word = .false.
      do while (position <= len(all_options))
         next = position + index(all_options(position:), ' ') - 1
         word = all_options(position:next - 1)
         position = next + 1
         if (skips_word .or. len(word) == 0) then
            skips_word = .false.
            cycle
         end if
         skips_word = word == '-I' .or. word == '-J' .or. word == '-o'
         if (skips_word .or. scan(word, '/') > 0) cycle
         if (len(options) > 0) options = options//' '
         options = options//word
      end do
   end function options_of_compiler

   !> Kind of the build ('release' or 'debug', and 'with checks'), from the options of the compiler.
   function kind_of_build() result(kind)
      character(:), allocatable :: kind

      kind = 'debug'
      if (index(compiler_options(), '-O3') > 0) kind = 'release'
      if (index(compiler_options(), '-fcheck') > 0) kind = kind//' with checks'
   end function kind_of_build

   !> Maximum memory of the process since the last call of `reset_peak_memory`, in bytes; 0 if it is not known.
   real(wp) function peak_memory() result(bytes)

      character(:), allocatable :: value
      integer :: status, kilobytes

      bytes = 0.0_wp
      ! the peak of the resident memory, in kilobytes
      value = value_in('/proc/self/status', 'VmHWM')
      if (len(value) == 0) return
      read (value, *, iostat=status) kilobytes
      if (status == 0) bytes = 1024.0_wp*real(kilobytes, wp)
   end function peak_memory

   !> Return freed memory to the system and restart the measurement of peak memory. If the system does not permit the
   !> restart, later peaks are those of the whole process.
   subroutine reset_peak_memory()
      integer :: unit, status

      call return_free_memory()
      open (newunit=unit, file='/proc/self/clear_refs', status='old', action='write', iostat=status)
      if (status /= 0) return
      ! by writing 5, Linux resets VmHWM
      write (unit, '(a)', iostat=status) '5'
      close (unit, iostat=status)
   end subroutine reset_peak_memory

   !> Text after the colon in the first line of a file that starts with a name; empty if there is no such line.
   function value_in(file, name) result(value)
      character(*), intent(in) :: file
      character(*), intent(in) :: name
      character(:), allocatable :: value

      character(line_length) :: line
      integer :: i, unit, status

      value = ''
      open (newunit=unit, file=file, status='old', action='read', iostat=status)
      if (status /= 0) return
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         if (index(line, name) /= 1) cycle
         line = line(index(line, ':') + 1:)
         do i = 1, len(line)
            if (line(i:i) == achar(9)) line(i:i) = ' '
         end do
         value = trim(adjustl(line))
         exit
      end do
      close (unit, iostat=status)
   end function value_in

end module timed_tasks
