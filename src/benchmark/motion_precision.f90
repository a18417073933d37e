!> Run time and error of motion for every method and every setting. An entry is one run with one set of settings. The
!> reference is exact motion with all modes and the strictest hop tolerance (the height of a flight in eta below which
!> the contact counts as closed); Newmark's method, extrapolated to a vanishing step, checks the reference. Runs on
!> other meshes are compared with a run on twice as many elements as the finest of these meshes. If the scene requests
!> errors against the beam (`against_beam`), this run represents the continuous beam.
module motion_precision
   use failures, only: failure_t
   use kinds, only: wp
   use motion_errors, only: energy_unit, impulse_balance_t, difference_of, extrapolate, results_of, horizon_of, &
      make_balance, &
      run_results_t
   use motion_tasks, only: events_only, histories_and_energy, prepare_task, settings_for, task_motion, task_run, task_t
   use precision_types, only: beam_run_t, check_t, motion_entry_t, precision_t, varied_hop, varied_mesh, varied_modes, &
      varied_step
   use response_types, only: balance_error
   use run_settings, only: moves_in_modes, response_settings_t, run_settings_t, strict_mode_tolerance
   use scene_beam_model, only: run_settings_of
   use scene_types, only: integrator_average, integrator_exact, mass_auto, mass_consistent, mass_redistributed, &
      precision_settings_t, scene_t
   use stop_laws, only: is_rigid
   use timed_tasks, only: measure_time
   implicit none (type, external)
   private
   public :: compare_motion, comparison_step, refinement

   !> Interval of the samples at which exact runs are compared, tau.
   real(wp), parameter :: comparison_step = 0.01_wp
   !> Hop tolerance of the reference.
   real(wp), parameter :: strictest_hop_tolerance = 1.0e-14_wp
   !> Order of the error in the length of the elements if the effective mass in an impact contains no mass of elements,
   !> as with the redistributed mass matrix.
   integer, parameter :: convergence_order = 4
   !> Ratio of the number of elements of the reference for meshes to the maximum number of elements compared.
   integer, parameter :: refinement = 2

contains

   !> Compute and time all runs that the scene compares.
   subroutine compare_motion(scene, study, error)
      type(scene_t), intent(in) :: scene
      !> Study; entries, horizon and check of the reference are set
      type(precision_t), intent(inout) :: study
      !> Set if the reference fails
      type(failure_t), allocatable, intent(out) :: error

      ! reference of the runs on the mesh of the scene
      type(task_t) :: reference
      ! reference of the runs on other meshes
      type(task_t) :: finest
      type(run_settings_t) :: settings
      ! reason why the reference could not be checked
      type(failure_t), allocatable :: failure
      integer :: i

      settings = run_settings_of(scene)
      call list_entries(scene, study%runs)
      call make_reference(scene, scene%mesh%elements, scene%mesh%mass, reference, error)
      if (allocated(error)) return
      study%horizon = horizon_of(settings, reference%response, scene%precision%duration, grid_of(scene))
      if (any(study%runs%varied == varied_mesh)) then
         call make_reference(scene, refinement*maxval(study%runs%elements), merge(mass_auto, scene%mesh%mass, &
            scene%precision%against_beam), finest, error)
         if (allocated(error)) return
         if (scene%precision%against_beam) study%horizon = horizon_of(settings, finest%response, &
            scene%precision%duration, grid_of(scene))
         finest%output%shape_times = [0.0_wp, study%horizon]
         call finest%run(error)
         if (allocated(error)) return
      end if
      reference%output%shape_times = [0.0_wp, study%horizon]
      call reference%run(error)
      if (allocated(error)) return
      call check_reference(scene, study%horizon, reference, study%check, failure)
      if (allocated(failure)) study%check%failure = failure%message
      if (scene%precision%against_beam) call check_beam(scene, study%horizon, finest, study%beam, error)
      if (allocated(error)) return
      do i = 1, size(study%runs)
         if (study%runs(i)%varied == varied_mesh) then
            call measure_entry(scene, study%horizon, finest, study%runs(i))
         else
            call measure_entry(scene, study%horizon, reference, study%runs(i))
         end if
      end do
   end subroutine compare_motion

   !> Interval of the instants that all runs sample, tau.
   pure real(wp) function grid_of(scene) result(grid)
      type(scene_t), intent(in) :: scene

      grid = max(comparison_step, maxval(scene%precision%steps))
   end function grid_of

   !> List the runs to compare. Each list of settings of the scene is varied separately.
   pure subroutine list_entries(scene, entries)
      type(scene_t), intent(in) :: scene
      !> Entries with their settings but without results
      type(motion_entry_t), allocatable, intent(out) :: entries(:)

      type(motion_entry_t) :: entry
      ! default settings, whose hop tolerance holds for Newmark's method and for errors against the beam; where modes or
      ! meshes are varied otherwise, the strictest one adds no error of its own
      type(response_settings_t) :: defaults
      integer :: i, k

      allocate (entries(0))
      associate (requested => scene%precision)
         do i = 1, size(requested%methods)
            entry = motion_entry_t(integrator=requested%methods(i), varied=varied_step, step=comparison_step, &
               hop_tolerance=defaults%hop_tolerance, mode_tolerance=strict_mode_tolerance, &
               elements=scene%mesh%elements, mass=scene%mesh%mass)
            if (requested%methods(i) /= integrator_exact) then
               do k = 1, size(requested%steps)
                  entry%step = requested%steps(k)
                  entries = [entries, entry]
                  if (requested%against_beam) call add_mesh_entries(requested, entry, entries)
               end do
               cycle
            end if
            entry%varied = varied_hop
            do k = 1, size(requested%hop_tolerances)
               entry%hop_tolerance = requested%hop_tolerances(k)
               entries = [entries, entry]
            end do
            entry%hop_tolerance = strictest_hop_tolerance
            if (allocated(requested%mode_tolerances)) then
               entry%varied = varied_modes
               do k = 1, size(requested%mode_tolerances)
                  entry%mode_tolerance = requested%mode_tolerances(k)
                  entries = [entries, entry]
               end do
               entry%mode_tolerance = strict_mode_tolerance
            end if
            ! against the beam, meshes have the consistent matrix and, with a rigid stop, the redistributed one as well;
            ! otherwise they have the mass matrix of the scene
            if (requested%against_beam) then
               entry%hop_tolerance = defaults%hop_tolerance
               entry%mass = mass_consistent
               call add_mesh_entries(requested, entry, entries)
               entry%mass = mass_redistributed
               ! the redistributed matrix reduces the error of impacts at rigid stops only
               if (.not. is_rigid(scene%stop)) cycle
            end if
            call add_mesh_entries(requested, entry, entries)
         end do
      end associate
   end subroutine list_entries

   !> Add entries with the settings of a given entry, one for every mesh of the scene.
   pure subroutine add_mesh_entries(requested, entry, entries)
      type(precision_settings_t), intent(in) :: requested
      type(motion_entry_t), intent(in) :: entry
      type(motion_entry_t), allocatable, intent(inout) :: entries(:)

      type(motion_entry_t) :: mesh_entry
      integer :: i

      if (.not. allocated(requested%mesh_elements)) return
      mesh_entry = entry
      mesh_entry%varied = varied_mesh
      do i = 1, size(requested%mesh_elements)
         mesh_entry%elements = requested%mesh_elements(i)
         entries = [entries, mesh_entry]
      end do
   end subroutine add_mesh_entries

   !> Compute the run with the strictest settings on a mesh.
   subroutine make_reference(scene, elements, mass, task, error, horizon)
      type(scene_t), intent(in) :: scene
      !> Number of elements
      integer, intent(in) :: elements
      !> Mass matrix: one of the `mass_` constants
      integer, intent(in) :: mass
      !> Task with the response of the run
      type(task_t), intent(out) :: task
      !> Set if the run fails
      type(failure_t), allocatable, intent(out) :: error
      !> Instant tau at which the shape is stored, besides the start; absent: no shapes
      real(wp), intent(in), optional :: horizon

      call prepare_task(scene, elements, task, error, with_modes=.true., mass=mass)
      if (allocated(error)) return
      task%action = task_motion
      task%output = histories_and_energy
      task%output%measures = .true.
      if (present(horizon)) task%output%shape_times = [0.0_wp, horizon]
      task%settings = settings_for(integrator_exact, scene%precision, comparison_step)
      task%settings%hop_tolerance = strictest_hop_tolerance
      task%settings%keep_all_modes = .true.
      call task%run(error)
   end subroutine make_reference

   !> Compare the reference with Newmark's method, extrapolated to a vanishing step, whose events are located to within
   !> rounding.
   subroutine check_reference(scene, horizon, reference, check, error)
      type(scene_t), intent(in) :: scene
      !> End of the comparison, tau
      real(wp), intent(in) :: horizon
      !> Task of the reference; its model and modes are used
      type(task_t), intent(inout) :: reference
      !> Differences from the reference
      type(check_t), intent(out) :: check
      !> Set if there is no comparison
      type(failure_t), allocatable, intent(out) :: error

      real(wp), parameter :: event_tolerance = 1.0e-13_wp
      type(impulse_balance_t) :: balance
      ! compared quantities of the reference
      type(run_results_t) :: exact
      ! compared quantities of Newmark's runs with two steps
      type(run_results_t) :: runs(2)
      ! extrapolation of these runs to a vanishing step
      type(run_results_t) :: limit
      type(task_t) :: newmark
      integer :: i

      check%steps = minval(scene%precision%steps)*[1.0_wp, 0.5_wp]
      newmark%scene = scene
      newmark%model = reference%model
      newmark%output = reference%output
      call make_balance(reference%model, reference%modes, run_settings_of(scene), balance, error)
      if (allocated(error)) return
      do i = 1, 2
         newmark%settings = settings_for(integrator_average, scene%precision, check%steps(i))
         newmark%settings%contact_tolerance = event_tolerance
         newmark%settings%release_tolerance = event_tolerance
         call newmark%run(error)
         if (allocated(error)) return
         call results_of(newmark%response, horizon, balance, runs(i))
      end do
      call find_reference_results(reference, check%steps(1), horizon, exact, error)
      if (allocated(error)) return
      call extrapolate(runs(1), runs(2), limit)
      check%difference = difference_of(limit, exact)
      check%longer_step_difference = difference_of(runs(1), limit)
   end subroutine check_reference

   !> Compare the run that represents the beam (converged in the mesh) with runs on half as many elements and with the
   !> other mass matrix.
   subroutine check_beam(scene, horizon, finest, beam, error)
      type(scene_t), intent(in) :: scene
      !> End of the comparison, tau
      real(wp), intent(in) :: horizon
      !> Task of the run that represents the beam
      type(task_t), intent(inout) :: finest
      type(beam_run_t), allocatable, intent(out) :: beam
      !> Set if the run or its comparison on half as many elements fails
      type(failure_t), allocatable, intent(out) :: error

      ! compared quantities of the run that represents the beam
      type(run_results_t) :: results
      ! compared quantities of the run on half as many elements
      type(run_results_t) :: half
      ! compared quantities of the runs with the other mass matrix, on half as many and on as many elements
      type(run_results_t) :: other(2)
      ! extrapolation of these two runs to infinitely many elements
      type(run_results_t) :: other_limit
      type(failure_t), allocatable :: other_error
      ! the mass matrix that the run for the beam does not use, one of the `mass_` constants
      integer :: other_mass
      integer :: i

      allocate (beam)
      beam%elements = finest%elements
      beam%mass = merge(mass_redistributed, mass_consistent, finest%model%is_redistributed)
      other_mass = merge(mass_consistent, mass_redistributed, finest%model%is_redistributed)
      call find_reference_results(finest, comparison_step, horizon, results, error)
      if (.not. allocated(error)) call compute(beam%elements/refinement, beam%mass, half, error)
      if (allocated(error)) return
      beam%half_mesh_difference = difference_of(half, results)
      beam%uncertainty = beam%half_mesh_difference%history/real(refinement**convergence_order - 1, wp)
      do i = 1, 2
         if (.not. allocated(other_error)) call compute(beam%elements*i/refinement, other_mass, other(i), other_error)
      end do
      if (allocated(other_error)) then
         beam%other_mass_failure = other_error%message
         return
      end if
      ! with the consistent matrix the effective mass in an impact contains a part of the mass of an element, an error
      ! of first order, which extrapolation removes
      if (finest%model%is_redistributed) call extrapolate(other(1), other(2), other_limit, order=1)
      if (.not. finest%model%is_redistributed) other_limit = other(2)
      beam%other_mass_difference = difference_of(other_limit, results)

   contains

      !> Compute the compared quantities of the run with the strictest settings on a mesh.
      subroutine compute(elements, mass, results, failure)
         !> Number of elements
         integer, intent(in) :: elements
         !> Mass matrix: one of the `mass_` constants
         integer, intent(in) :: mass
         type(run_results_t), intent(out) :: results
         !> Set if the run fails
         type(failure_t), allocatable, intent(out) :: failure

         type(task_t) :: task

         call make_reference(scene, elements, mass, task, failure, horizon)
         if (.not. allocated(failure)) call find_reference_results(task, comparison_step, horizon, results, failure)
      end subroutine compute

   end subroutine check_beam

   !> Extract the compared quantities of the reference at a given interval of samples.
   subroutine find_reference_results(reference, step, horizon, results, error, every)
      !> Task of the reference, with modes and settings
      type(task_t), intent(inout) :: reference
      !> Interval of the samples, tau
      real(wp), intent(in) :: step
      !> End of the comparison, tau
      real(wp), intent(in) :: horizon
      type(run_results_t), intent(out) :: results
      !> Set if the run fails
      type(failure_t), allocatable, intent(out) :: error
      !> Stride of the reference's samples that gives this interval; absent: the reference is computed again with the
      !> interval if its own interval differs
      integer, intent(in), optional :: every

      type(impulse_balance_t) :: balance

      if (abs(reference%settings%step - step) > 0.0_wp .and. .not. present(every)) then
         reference%settings%step = step
         call reference%run(error)
         if (allocated(error)) return
      end if
      call make_balance(reference%model, reference%modes, run_settings_of(reference%scene), balance, error)
      if (allocated(error)) return
      call results_of(reference%response, horizon, balance, results, every)
   end subroutine find_reference_results

   !> Compute the errors and the run time of an entry. If the run fails, the entry stores the reason.
   subroutine measure_entry(scene, horizon, reference, entry)
      type(scene_t), intent(in) :: scene
      !> End of the comparison, tau
      real(wp), intent(in) :: horizon
      !> Task of the reference for this entry
      type(task_t), intent(inout) :: reference
      type(motion_entry_t), intent(inout) :: entry

      type(failure_t), allocatable :: error
      type(impulse_balance_t) :: balance
      type(run_results_t) :: results, exact
      type(task_t) :: task
      ! strides of the samples of the entry and of the reference, so that both have the same instants; 0: there are no
      ! such strides
      integer :: every(2)

      if (entry%varied == varied_mesh) then
         call prepare_task(scene, entry%elements, task, error, with_modes=.true., mass=entry%mass)
         associate (step => entry%step, other => reference%settings%step)
            every = max(1, nint([other/step, step/other]))
            if (abs(real(every(1), wp)*step - real(every(2), wp)*other) > 1.0e-9_wp*other) every = 0
         end associate
      else
         every = [1, 1]
         task%scene = scene
         task%model = reference%model
         task%modes = reference%modes
      end if
      task%action = task_run
      task%output = reference%output
      task%settings = settings_for(entry%integrator, scene%precision, entry%step)
      if (entry%integrator == integrator_exact) then
         task%settings%hop_tolerance = entry%hop_tolerance
         task%settings%mode_tolerance = entry%mode_tolerance
      end if
      if (.not. allocated(error)) call task%run(error)
      if (.not. allocated(error)) call make_balance(task%model, task%modes, run_settings_of(scene), balance, error)
      if (.not. allocated(error)) then
         if (entry%varied == varied_mesh .and. every(1) > 0) then
            call find_reference_results(reference, entry%step, horizon, exact, error, every(2))
         else
            call find_reference_results(reference, entry%step, horizon, exact, error)
         end if
      end if
      if (.not. allocated(error)) then
         call results_of(task%response, horizon, balance, results, max(every(1), 1))
         entry%errors = difference_of(results, exact)
         entry%errors%energy_balance = balance_error(task%response)/energy_unit(task%response)
         task%output = events_only
         call measure_time(task, scene%precision, entry%run_time, error)
      end if
      ! Newmark's steps on the matrices of the mesh need no modes, so both times are the same
      entry%motion_time = entry%run_time
      if (.not. allocated(error) .and. moves_in_modes(task%settings)) then
         task%action = task_motion
         call measure_time(task, scene%precision, entry%motion_time, error)
      end if
      entry%event_count = task%response%event_count
      entry%retained_modes = task%response%mode_check%retained
      entry%evaluations = task%response%evaluations
      if (allocated(error)) entry%failure = error%message
   end subroutine measure_entry

end module motion_precision
