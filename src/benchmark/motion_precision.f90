!> Run time against error of motion: every method at every setting, against exact motion with all modes and the
!> tightest hop tolerance, which itself is checked against Newmark's steps extrapolated to none.
module motion_precision
   use failures, only: failure_t
   use kinds, only: wp
   use motion_errors, only: balance_t, difference_of, extrapolate, facts_of, horizon_of, make_balance, &
      motion_facts_t
   use motion_tasks, only: full_output, no_output, prepare_task, settings_for, task_motion, task_run, task_t
   use precision_types, only: beam_t, check_t, motion_entry_t, precision_t, varied_hop, varied_mesh, varied_modes, &
      varied_step
   use response_types, only: miss_of_energies
   use run_settings, only: response_settings_t, strict_mode_tolerance
   use scene_beam_model, only: run_of
   use scene_types, only: contender_average, contender_exact, mass_auto, mass_consistent, mass_redistributed, &
      precision_settings_t, scene_t
   use stop_laws, only: is_rigid
   use timed_tasks, only: measure_time
   implicit none (type, external)
   private
   public :: compare_motion, comparison_step, finer

   !> Distance of the samples at which exact runs are compared, tau.
   real(wp), parameter :: comparison_step = 0.01_wp
   !> Hop tolerance of the reference.
   real(wp), parameter :: tightest_hop = 1.0e-14_wp
   !> Errors fall with this power of the elements' length where no part of an element is struck.
   integer, parameter :: order = 4
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
      call make_reference(scene, scene%mesh%elements, scene%mesh%mass, reference, error)
      if (allocated(error)) return
      study%horizon = horizon_of(reference%response, scene%precision%duration, grid_of(scene))
      if (any(study%motion%varied == varied_mesh)) then
         associate (elements => finer*maxval(study%motion%elements))
            call make_reference(scene, elements, merge(mass_auto, scene%mesh%mass, scene%precision%against_beam), &
               finest, error)
         end associate
         if (allocated(error)) return
         if (scene%precision%against_beam) study%horizon = horizon_of(finest%response, scene%precision%duration, &
            grid_of(scene))
         finest%output%shape_times = [0.0_wp, study%horizon]
         call finest%run(error)
         if (allocated(error)) return
      end if
      reference%output%shape_times = [0.0_wp, study%horizon]
      call reference%run(error)
      if (allocated(error)) return
      call check_reference(scene, study%horizon, reference, study%check)
      if (scene%precision%against_beam) call check_beam(scene, study%horizon, finest, study%beam, error)
      if (allocated(error)) return
      do i = 1, size(study%motion)
         if (study%motion(i)%varied == varied_mesh) then
            call measure_entry(scene, study%horizon, finest, study%motion(i))
         else
            call measure_entry(scene, study%horizon, reference, study%motion(i))
         end if
      end do
   end subroutine compare_motion

   !> Distance of instants that all runs sample.
   pure function grid_of(scene) result(grid)
      type(scene_t), intent(in) :: scene
      real(wp) :: grid

      grid = max(comparison_step, maxval(scene%precision%steps))
   end function grid_of

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
               hop_tolerance=defaults%hop_tolerance, mode_tolerance=strict_mode_tolerance, &
               elements=scene%mesh%elements, mass=scene%mesh%mass)
            if (asked%methods(i) /= contender_exact) then
               do k = 1, size(asked%steps)
                  entry%step = asked%steps(k)
                  entries = [entries, entry]
                  if (asked%against_beam) call add_meshes(asked, entry, entries)
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
               entry%mode_tolerance = strict_mode_tolerance
            end if
            if (asked%against_beam) then
               entry%hop_tolerance = defaults%hop_tolerance
               entry%mass = mass_consistent
               call add_meshes(asked, entry, entries)
               entry%mass = mass_redistributed
               if (.not. is_rigid(scene%stop)) cycle
            end if
            call add_meshes(asked, entry, entries)
         end do
      end associate
   end subroutine list_entries

   !> The same on every mesh.
   pure subroutine add_meshes(asked, entry, entries)
      type(precision_settings_t), intent(in) :: asked
      type(motion_entry_t), intent(in) :: entry
      type(motion_entry_t), allocatable, intent(inout) :: entries(:)

      type(motion_entry_t) :: one
      integer :: i

      if (.not. allocated(asked%mesh_elements)) return
      one = entry
      one%varied = varied_mesh
      do i = 1, size(asked%mesh_elements)
         one%elements = asked%mesh_elements(i)
         entries = [entries, one]
      end do
   end subroutine add_meshes

   !> The strictest run on a mesh.
   subroutine make_reference(scene, elements, mass, task, error, horizon)
      type(scene_t), intent(in) :: scene
      !> Its mesh, and one of the `mass_` constants
      integer, intent(in) :: elements
      integer, intent(in) :: mass
      !> Gets the response
      type(task_t), intent(out) :: task
      !> Set when it fails
      type(failure_t), allocatable, intent(out) :: error
      !> Keep the shapes at the start and at this instant
      real(wp), intent(in), optional :: horizon

      call prepare_task(scene, elements, task, error, with_modes=.true., mass=mass)
      if (allocated(error)) return
      task%what = task_motion
      task%output = full_output()
      task%output%measures = .true.
      if (present(horizon)) task%output%shape_times = [0.0_wp, horizon]
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
      call make_balance(reference%model, reference%modes, run_of(scene), balance, error)
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

   !> How far from the run that stands for the beam are the same on half the elements and the other mass matrix.
   subroutine check_beam(scene, horizon, finest, beam, error)
      type(scene_t), intent(in) :: scene
      !> Up to here
      real(wp), intent(in) :: horizon
      !> That run
      type(task_t), intent(inout) :: finest
      type(beam_t), allocatable, intent(out) :: beam
      !> Set when it cannot be repeated
      type(failure_t), allocatable, intent(out) :: error

      type(motion_facts_t) :: facts, half, other(2)
      type(failure_t), allocatable :: trouble
      integer :: other_mass, i

      allocate (beam)
      beam%elements = finest%elements
      beam%mass = merge(mass_redistributed, mass_consistent, finest%model%is_redistributed)
      other_mass = merge(mass_consistent, mass_redistributed, finest%model%is_redistributed)
      call reference_facts(finest, comparison_step, horizon, facts, error)
      if (.not. allocated(error)) call compute(beam%elements/finer, beam%mass, half, error)
      if (allocated(error)) return
      beam%half = difference_of(half, facts)
      beam%uncertainty = beam%half%history/real(finer**order - 1, wp)
      do i = 1, 2
         if (.not. allocated(trouble)) call compute(beam%elements*i/finer, other_mass, other(i), trouble)
      end do
      if (allocated(trouble)) then
         beam%no_other = trouble%message
         return
      end if
      ! a point mass struck together with part of an element: an error of the first order
      if (finest%model%is_redistributed) call extrapolate(other(1), other(2), half, order=1)
      if (.not. finest%model%is_redistributed) half = other(2)
      beam%other = difference_of(half, facts)

   contains

      !> The facts of a run.
      subroutine compute(elements, mass, found, failure)
         !> Its mesh, and one of the `mass_` constants
         integer, intent(in) :: elements
         integer, intent(in) :: mass
         type(motion_facts_t), intent(out) :: found
         !> Set when it fails
         type(failure_t), allocatable, intent(out) :: failure

         type(task_t) :: task

         call make_reference(scene, elements, mass, task, failure, horizon)
         if (.not. allocated(failure)) call reference_facts(task, comparison_step, horizon, found, failure)
      end subroutine compute

   end subroutine check_beam

   !> The reference sampled as another run is.
   subroutine reference_facts(reference, step, horizon, facts, error, every)
      !> The reference, modes and settings
      type(task_t), intent(inout) :: reference
      !> Distance of samples
      real(wp), intent(in) :: step
      !> Up to here
      real(wp), intent(in) :: horizon
      type(motion_facts_t), intent(out) :: facts
      !> Set when the run fails
      type(failure_t), allocatable, intent(out) :: error
      !> Every so many of its own samples are at that distance; default: it runs again where they are not
      integer, intent(in), optional :: every

      type(balance_t) :: balance

      if (abs(reference%settings%step - step) > 0.0_wp .and. .not. present(every)) then
         reference%settings%step = step
         call reference%run(error)
         if (allocated(error)) return
      end if
      call make_balance(reference%model, reference%modes, run_of(reference%scene), balance, error)
      if (allocated(error)) return
      call facts_of(reference%response, horizon, balance, facts, every)
   end subroutine reference_facts

   !> Every which of the samples of two runs are at the same instants; 0: they have no such.
   pure function common_samples(step, other) result(every)
      !> Distances of their samples
      real(wp), intent(in) :: step
      real(wp), intent(in) :: other
      integer :: every(2)

      every = max(1, nint([other/step, step/other]))
      if (abs(real(every(1), wp)*step - real(every(2), wp)*other) > 1.0e-9_wp*other) every = 0
   end function common_samples

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
      integer :: every(2)

      if (entry%varied == varied_mesh) then
         call prepare_task(scene, entry%elements, task, error, with_modes=.true., mass=entry%mass)
         every = common_samples(entry%step, reference%settings%step)
      else
         every = [1, 1]
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
      if (.not. allocated(error)) call make_balance(task%model, task%modes, run_of(scene), balance, error)
      if (.not. allocated(error)) then
         if (entry%varied == varied_mesh .and. every(1) > 0) then
            call reference_facts(reference, entry%step, horizon, exact, error, every(2))
         else
            call reference_facts(reference, entry%step, horizon, exact, error)
         end if
      end if
      if (.not. allocated(error)) then
         call facts_of(task%response, horizon, balance, facts, max(every(1), 1))
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
