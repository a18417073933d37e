!> Run time against error of motion: every method at every setting, against exact motion with all modes and the
!> tightest hop tolerance, which itself is checked against Newmark's steps extrapolated to none.
module motion_precision
   use failures, only: failure_t
   use kinds, only: wp
   use motion_errors, only: balance_t, difference_of, extrapolate, facts_of, horizon_of, make_balance, &
      motion_facts_t
   use motion_tasks, only: full_output, no_output, prepare_task, settings_for, task_motion, task_run, task_t
   use precision_types, only: check_t, motion_entry_t, precision_t, varied_hop, varied_mesh, varied_modes, varied_step
   use response_types, only: miss_of_energies
   use run_settings, only: response_settings_t
   use scene_types, only: contender_average, contender_exact, scene_t
   use timed_tasks, only: measure_time
   implicit none (type, external)
   private
   public :: compare_motion, comparison_step

   !> Distance of the samples at which exact runs are compared, tau.
   real(wp), parameter :: comparison_step = 0.01_wp
   !> Hop tolerance of the reference.
   real(wp), parameter :: tightest_hop = 1.0e-14_wp
   !> The reference of meshes has so many times the elements of the largest.
   integer, parameter :: finer = 2

contains

   !> Run and time all that the scene compares.
   subroutine compare_motion(scene, study, error)
      type(scene_t), intent(in) :: scene
      !> Gets entries, horizon and check
      type(precision_t), intent(inout) :: study
      !> Set when the reference fails
      type(failure_t), allocatable, intent(out) :: error

      type(task_t) :: reference, finest
      integer :: i

      call list_entries(scene, study%motion)
      call make_reference(scene, scene%mesh%elements, reference, error)
      if (allocated(error)) return
      study%horizon = horizon_of(reference%response, scene%precision%duration, &
         max(comparison_step, maxval(scene%precision%steps)))
      reference%output%shape_times = [study%horizon]
      call reference%run(error)
      if (allocated(error)) return
      call check_reference(scene, study%horizon, reference, study%check)
      if (any(study%motion%varied == varied_mesh)) then
         call make_reference(scene, finer*maxval(study%motion%elements), finest, error)
         if (allocated(error)) return
         finest%output%shape_times = [study%horizon]
         call finest%run(error)
         if (allocated(error)) return
      end if
      do i = 1, size(study%motion)
         if (study%motion(i)%varied == varied_mesh) then
            call measure_entry(scene, study%horizon, finest, study%motion(i))
         else
            call measure_entry(scene, study%horizon, reference, study%motion(i))
         end if
      end do
   end subroutine compare_motion

   !> What is compared: each list varied by itself.
   pure subroutine list_entries(scene, entries)
      type(scene_t), intent(in) :: scene
      !> The entries, nothing measured yet
      type(motion_entry_t), allocatable, intent(out) :: entries(:)

      type(motion_entry_t) :: entry
      type(response_settings_t) :: defaults
      integer :: i, k

      allocate (entries(0))
      associate (asked => scene%precision)
         do i = 1, size(asked%methods)
            entry = motion_entry_t(contender=asked%methods(i), varied=varied_step, step=comparison_step, &
               hop_tolerance=defaults%hop_tolerance, mode_tolerance=defaults%mode_tolerance, &
               elements=scene%mesh%elements)
            if (asked%methods(i) /= contender_exact) then
               do k = 1, size(asked%steps)
                  entry%step = asked%steps(k)
                  entries = [entries, entry]
               end do
               cycle
            end if
            entry%varied = varied_hop
            do k = 1, size(asked%hop_tolerances)
               entry%hop_tolerance = asked%hop_tolerances(k)
               entries = [entries, entry]
            end do
            entry%hop_tolerance = tightest_hop
            if (allocated(asked%mode_tolerances)) then
               entry%varied = varied_modes
               do k = 1, size(asked%mode_tolerances)
                  entry%mode_tolerance = asked%mode_tolerances(k)
                  entries = [entries, entry]
               end do
               entry%mode_tolerance = defaults%mode_tolerance
            end if
            if (.not. allocated(asked%mesh_elements)) cycle
            entry%varied = varied_mesh
            do k = 1, size(asked%mesh_elements)
               entry%elements = asked%mesh_elements(k)
               entries = [entries, entry]
            end do
         end do
      end associate
   end subroutine list_entries

   !> The strictest run on a mesh.
   subroutine make_reference(scene, elements, task, error)
      type(scene_t), intent(in) :: scene
      !> Its mesh
      integer, intent(in) :: elements
      !> Gets the response
      type(task_t), intent(out) :: task
      !> Set when it fails
      type(failure_t), allocatable, intent(out) :: error

      call prepare_task(scene, elements, task, error, with_modes=.true.)
      if (allocated(error)) return
      task%what = task_motion
      task%output = full_output()
      task%output%measures = .true.
      task%settings = settings_for(contender_exact, scene%precision, comparison_step)
      task%settings%hop_tolerance = tightest_hop
      task%settings%keep_all_modes = .true.
      call task%run(error)
   end subroutine make_reference

   !> The reference against Newmark's steps extrapolated to none, events located to rounding.
   subroutine check_reference(scene, horizon, reference, check)
      type(scene_t), intent(in) :: scene
      !> Up to here
      real(wp), intent(in) :: horizon
      !> The reference; its model is used
      type(task_t), intent(inout) :: reference
      !> What differs
      type(check_t), intent(out) :: check

      real(wp), parameter :: locating = 1.0e-13_wp
      type(balance_t) :: balance
      type(motion_facts_t) :: exact, runs(2), limit
      type(failure_t), allocatable :: error
      type(task_t) :: newmark
      integer :: i

      check%steps = minval(scene%precision%steps)*[1.0_wp, 0.5_wp]
      newmark%scene = scene
      newmark%model = reference%model
      newmark%output = reference%output
      call make_balance(reference%model, scene%stop%preload, scene%zeta, balance, error)
      if (allocated(error)) then
         check%failure = error%message
         return
      end if
      do i = 1, 2
         newmark%settings = settings_for(contender_average, scene%precision, check%steps(i))
         newmark%settings%contact_tolerance = locating
         newmark%settings%release_tolerance = locating
         call newmark%run(error)
         if (allocated(error)) then
            check%failure = error%message
            return
         end if
         call facts_of(newmark%response, horizon, balance, runs(i))
      end do
      call reference_facts(reference, check%steps(1), horizon, exact, error)
      if (allocated(error)) then
         check%failure = error%message
         return
      end if
      call extrapolate(runs(1), runs(2), limit)
      check%difference = difference_of(limit, exact)
      check%between_steps = difference_of(runs(1), limit)
   end subroutine check_reference

   !> The reference sampled as another run is.
   subroutine reference_facts(reference, step, horizon, facts, error)
      !> The reference, modes and settings
      type(task_t), intent(inout) :: reference
      !> Distance of samples
      real(wp), intent(in) :: step
      !> Up to here
      real(wp), intent(in) :: horizon
      type(motion_facts_t), intent(out) :: facts
      !> Set when the run fails
      type(failure_t), allocatable, intent(out) :: error

      type(balance_t) :: balance

      if (abs(reference%settings%step - step) > 0.0_wp) then
         reference%settings%step = step
         call reference%run(error)
         if (allocated(error)) return
      end if
      call make_balance(reference%model, reference%scene%stop%preload, reference%scene%zeta, balance, error)
      if (allocated(error)) return
      call facts_of(reference%response, horizon, balance, facts)
   end subroutine reference_facts

   !> Errors and time of an entry. An entry that fails keeps the reason.
   subroutine measure_entry(scene, horizon, reference, entry)
      type(scene_t), intent(in) :: scene
      !> Up to here
      real(wp), intent(in) :: horizon
      type(task_t), intent(inout) :: reference
      type(motion_entry_t), intent(inout) :: entry

      type(failure_t), allocatable :: error
      type(balance_t) :: balance
      type(motion_facts_t) :: facts, exact
      type(task_t) :: task

      if (entry%varied == varied_mesh) then
         call prepare_task(scene, entry%elements, task, error, with_modes=.true.)
      else
         task%scene = scene
         task%model = reference%model
         task%modes = reference%modes
      end if
      task%what = task_run
      task%output = reference%output
      task%settings = settings_for(entry%contender, scene%precision, entry%step)
      if (entry%contender == contender_exact) then
         task%settings%hop_tolerance = entry%hop_tolerance
         task%settings%mode_tolerance = entry%mode_tolerance
      end if
      if (.not. allocated(error)) call task%run(error)
      if (.not. allocated(error)) call make_balance(task%model, scene%stop%preload, scene%zeta, balance, error)
      if (.not. allocated(error)) call reference_facts(reference, entry%step, horizon, exact, error)
      if (.not. allocated(error)) then
         call facts_of(task%response, horizon, balance, facts)
         entry%errors = difference_of(facts, exact)
         entry%errors%ledger = miss_of_energies(task%response)/task%response%initial_energy
         task%output = no_output()
         call measure_time(task, scene%precision, entry%whole, error)
      end if
      entry%motion = entry%whole
      if (.not. allocated(error) .and. entry%contender == contender_exact) then
         task%what = task_motion
         call measure_time(task, scene%precision, entry%motion, error)
      end if
      entry%event_count = task%response%event_count
      entry%modes_kept = task%response%mode_check%kept
      entry%evaluations = task%response%evaluations
      if (allocated(error)) entry%failure = error%message
   end subroutine measure_entry

end module motion_precision
