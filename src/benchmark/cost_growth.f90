!> Measures how the run time divides between the parts of a run, and how time and memory grow with the mesh, the length
!> of the run, the number of events and the number of modes. Each growth curve gets the fitted exponent of a power law.
!> A task (`task_t`) is the computation that is timed.
module cost_growth
   use failures, only: failure_t
   use kinds, only: wp
   use motion_tasks, only: events_only, histories_and_energy, prepare_task, settings_for, task_assembly, &
      task_few_modes, task_modes, task_motion, task_run, task_t
   use precision_types, only: curve_t, motion_entry_t, timed_part_t, precision_t, varied_hop
   use run_settings, only: name_length, output_settings_t
   use scene_types, only: integrator_average, integrator_exact, precision_settings_t, scene_t
   use timed_tasks, only: reset_peak_memory, peak_memory, measure_time, timing_t
   implicit none (type, external)
   private
   public :: measure_parts, measure_growth, fitted_exponent

   !> Interval of the samples in timed runs, tau.
   real(wp), parameter :: sample_step = 0.01_wp
   !> Maximum number of elements for which Newmark's method and the computation of all modes are timed, because the time
   !> of the dense eigenvalue solver grows with the third power of the number of elements.
   integer, parameter :: max_elements_modes = 256
   !> Maximum number of elements for which the exact motion in all modes is timed, for the same reason.
   integer, parameter :: max_elements_motion = 128

contains

   !> Time the parts of a run by exact motion with default tolerances for the scene's beam.
   subroutine measure_parts(scene, study, error)
      type(scene_t), intent(in) :: scene
      !> Study, to which the parts are added
      type(precision_t), intent(inout) :: study
      !> Set if a part fails
      type(failure_t), allocatable, intent(out) :: error

      ! the default output: the default histories, no energies
      type(output_settings_t) :: histories
      type(task_t) :: task
      ! time of a run that records only events, s
      real(wp) :: without_histories
      ! time of a run that records histories as well, s
      real(wp) :: with_histories

      call prepare_task(scene, scene%mesh%elements, task, error)
      if (allocated(error)) return
      task%settings = settings_for(integrator_exact, scene%precision, sample_step)
      allocate (study%parts(0))
      call add_part(task_assembly, events_only, 'assembly', 0.0_wp)
      if (.not. allocated(error)) call add_part(task_modes, events_only, 'modes', 0.0_wp)
      if (.not. allocated(error)) call add_part(task_motion, events_only, 'events', 0.0_wp)
      if (allocated(error)) return
      without_histories = study%parts(size(study%parts))%timing%median
      call add_part(task_motion, histories, 'histories', without_histories)
      if (allocated(error)) return
      with_histories = without_histories + study%parts(size(study%parts))%timing%median
      call add_part(task_motion, histories_and_energy, 'energy', with_histories)

   contains

      !> Time a part of a run, as the median time of a task less the time of another task that is included in it.
      subroutine add_part(action, output, name, subtracted)
         !> Kind of the task, one of the `task_` constants
         integer, intent(in) :: action
         !> Requested output
         type(output_settings_t), intent(in) :: output
         !> Name of the part
         character(*), intent(in) :: name
         !> Time to subtract, s
         real(wp), intent(in) :: subtracted

         type(timed_part_t) :: part

         task%action = action
         task%output = output
         part%name = name
         call measure_time(task, scene%precision, part%timing, error)
         associate (timing => part%timing)
            timing%median = timing%median - subtracted
            timing%lower_quartile = timing%lower_quartile - subtracted
            timing%upper_quartile = timing%upper_quartile - subtracted
         end associate
         study%parts = [study%parts, part]
      end subroutine add_part

   end subroutine measure_parts

   !> Measure all growth curves that the scene requests.
   subroutine measure_growth(scene, study, error)
      type(scene_t), intent(in) :: scene
      !> Study with the entries of motion; the curves are added
      type(precision_t), intent(inout) :: study
      !> Set if a run fails
      type(failure_t), allocatable, intent(out) :: error

      type(motion_entry_t), allocatable :: entries(:)

      allocate (study%curves(0))
      ! time of a run against its number of events, from the runs with different hop tolerances (heights of a flight
      ! below which the contact counts as closed)
      entries = pack(study%runs, study%runs%varied == varied_hop .and. study%runs%failure == '' .and. &
         study%runs%event_count > 0)
      if (size(entries) > 1) call add_curve(study%curves, 'exact motion', 'events', 's', &
         real(entries%event_count, wp), entries%motion_time%median)
      if (allocated(scene%precision%scaling_durations)) call add_growth_with_duration(scene, study%curves, error)
      if (allocated(error)) return
      if (allocated(scene%precision%scaling_elements)) call add_growth_with_elements(scene, study%curves, error)
   end subroutine measure_growth

   !> Time of a run against its length.
   subroutine add_growth_with_duration(scene, curves, error)
      type(scene_t), intent(in) :: scene
      !> List to which the curves are added
      type(curve_t), allocatable, intent(inout) :: curves(:)
      !> Set if a run fails
      type(failure_t), allocatable, intent(out) :: error

      integer, parameter :: integrators(2) = [integrator_exact, integrator_average]
      character(*), parameter :: names(2) = [character(name_length) :: 'exact motion', 'newmark, d tau = 0.01']
      type(task_t) :: task
      type(timing_t) :: timing
      real(wp), allocatable :: seconds(:), evaluations(:)
      integer :: i, k

      associate (durations => scene%precision%scaling_durations)
         allocate (seconds(size(durations)), evaluations(size(durations)))
         call prepare_task(scene, scene%mesh%elements, task, error, with_modes=.true.)
         if (allocated(error)) return
         do k = 1, 2
            task%action = merge(task_motion, task_run, integrators(k) == integrator_exact)
            task%settings = settings_for(integrators(k), scene%precision, sample_step)
            do i = 1, size(durations)
               task%settings%duration = durations(i)
               call measure_time(task, scene%precision, timing, error)
               if (allocated(error)) return
               seconds(i) = timing%median
               evaluations(i) = real(task%response%evaluations, wp)
            end do
            call add_curve(curves, names(k), 'duration', 's', durations, seconds)
            if (k == 1) call add_curve(curves, 'exact motion, modal sums', 'duration', '1', durations, evaluations)
         end do
      end associate
   end subroutine add_growth_with_duration

   !> Time and memory against the number of elements, and time of a sample against the number of modes.
   subroutine add_growth_with_elements(scene, curves, error)
      type(scene_t), intent(in) :: scene
      !> List to which the curves are added
      type(curve_t), allocatable, intent(inout) :: curves(:)
      !> Set if a run fails
      type(failure_t), allocatable, intent(out) :: error

      type(task_t) :: task
      ! times of a few modes, of all modes, of exact motion in all modes, of Newmark's method, s, [meshes]
      real(wp), allocatable :: few_modes(:), all_modes(:), motion(:), newmark(:)
      ! time of one sample of exact motion (`sample`), s, and number of modes in this motion, [meshes]
      real(wp), allocatable :: sample(:), modes(:)
      ! memory that the computation of a few modes needs, bytes, [meshes]
      real(wp), allocatable :: memory(:)
      ! time of a task in seconds, and peak memory `before` the computation in bytes
      real(wp) :: seconds, before
      integer, allocatable :: elements(:)
      integer :: i

      allocate (elements, source=scene%precision%scaling_elements)
      allocate (few_modes(size(elements)), memory(size(elements)), newmark(0), all_modes(0), motion(0), sample(0), &
         modes(0))
      do i = 1, size(elements)
         call reset_peak_memory()
         before = peak_memory()
         call prepare_task(scene, elements(i), task, error)
         if (allocated(error)) return
         task%mode_count = scene%precision%scaling_modes
         call seconds_of(scene%precision, task, task_few_modes, few_modes(i), error)
         if (allocated(error)) return
         memory(i) = max(peak_memory() - before, 0.0_wp)
         if (elements(i) > max_elements_modes) cycle
         task%settings = settings_for(integrator_average, scene%precision, sample_step)
         call seconds_of(scene%precision, task, task_run, seconds, error)
         if (allocated(error)) return
         newmark = [newmark, seconds]
         call seconds_of(scene%precision, task, task_modes, seconds, error)
         if (allocated(error)) return
         all_modes = [all_modes, seconds]
         if (elements(i) > max_elements_motion) cycle
         task%settings = settings_for(integrator_exact, scene%precision, sample_step)
         task%settings%keep_all_modes = .true.
         call add_motion(task)
         if (allocated(error)) return
      end do
      associate (n => real(elements, wp), mesh => 'elements')
         call add_curve(curves, 'few modes by lanczos, with assembly', mesh, 's', n, few_modes)
         call add_curve(curves, 'memory of few modes, at peak', mesh, 'byte', n, memory)
         call add_curve(curves, 'newmark, d tau = 0.01', mesh, 's', n(:size(newmark)), newmark)
         call add_curve(curves, 'all modes, dense', mesh, 's', n(:size(all_modes)), all_modes)
         call add_curve(curves, 'exact motion, all modes kept', mesh, 's', n(:size(motion)), motion)
         call add_curve(curves, 'a sample of all histories', 'modes', 's', modes, sample)
      end associate

   contains

      !> Time exact motion with all modes, without samples and with samples of all histories.
      subroutine add_motion(motion_task)
         type(task_t), intent(inout) :: motion_task

         real(wp), parameter :: fine_step = 0.001_wp
         real(wp) :: without_samples, with_samples

         call seconds_of(scene%precision, motion_task, task_motion, without_samples, error)
         if (allocated(error)) return
         motion_task%output%history = .true.
         motion_task%settings%step = fine_step
         call seconds_of(scene%precision, motion_task, task_motion, with_samples, error)
         if (allocated(error)) return
         motion = [motion, without_samples]
         modes = [modes, real(motion_task%response%mode_check%retained, wp)]
         sample = [sample, (with_samples - without_samples)/real(size(motion_task%response%tau), wp)]
         motion_task%output = events_only
      end subroutine add_motion
   end subroutine add_growth_with_elements

   !> Median time of a task, s.
   subroutine seconds_of(requested, task, action, median, error)
      !> Number of repetitions, and minimum time of a timing
      type(precision_settings_t), intent(in) :: requested
      !> Task to be timed
      type(task_t), intent(inout) :: task
      !> Kind of the task, one of the `task_` constants
      integer, intent(in) :: action
      real(wp), intent(out) :: median
      !> Set if the task fails
      type(failure_t), allocatable, intent(out) :: error

      type(timing_t) :: timing

      task%action = action
      call measure_time(task, requested, timing, error)
      median = timing%median
   end subroutine seconds_of

   !> Add a curve with its fitted exponent.
   pure subroutine add_curve(curves, name, abscissa_name, unit, abscissa, ordinate)
      type(curve_t), allocatable, intent(inout) :: curves(:)
      !> Name of the quantity that grows
      character(*), intent(in) :: name
      !> Name of the quantity on which it depends
      character(*), intent(in) :: abscissa_name
      !> Unit of the quantity that grows
      character(*), intent(in) :: unit
      !> Abscissas of the points of the curve, > 0, [points]
      real(wp), intent(in) :: abscissa(:)
      !> Ordinates of the points, > 0, [points]
      real(wp), intent(in) :: ordinate(:)

      type(curve_t), allocatable :: extended(:)

      allocate (extended(size(curves) + 1))
      extended(:size(curves)) = curves
      associate (curve => extended(size(extended)))
         curve%name = name
         curve%abscissa_name = abscissa_name
         curve%unit = unit
         allocate (curve%abscissa, source=abscissa)
         allocate (curve%ordinate, source=ordinate)
         curve%exponent = fitted_exponent(abscissa, ordinate)
      end associate
      call move_alloc(extended, curves)
   end subroutine add_curve

   !> Exponent of a power law: least-squares slope of the logarithms of the second half of the points, but of at least
   !> three points if there are three; 0: fewer than two points are positive.
   pure real(wp) function fitted_exponent(abscissa, ordinate) result(exponent)
      !> Abscissas of the points of the curve, > 0, [points]
      real(wp), intent(in) :: abscissa(:)
      !> Ordinates of the points, > 0, [points]
      real(wp), intent(in) :: ordinate(:)

      integer, parameter :: min_points = 3
      real(wp), allocatable :: x(:), y(:)
      ! whether the point takes part in the fit
      logical :: used(size(abscissa))
      integer :: i, points

      exponent = 0.0_wp
      points = size(abscissa)
      used = [(i > min(points/2, max(points - min_points, 0)), i=1, points)]
      used = used .and. abscissa > 0.0_wp .and. ordinate > 0.0_wp
      if (count(used) < 2) return
      allocate (x, source=log(pack(abscissa, used)))
      allocate (y, source=log(pack(ordinate, used)))
      x = x - sum(x)/real(size(x), wp)
      y = y - sum(y)/real(size(y), wp)
      if (sum(x**2) > 0.0_wp) exponent = sum(x*y)/sum(x**2)
   end function fitted_exponent

end module cost_growth
