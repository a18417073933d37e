!> Measures the time saved by skips. A skip is the omission of a computation that a scene does not need. The same task
!> is executed without and with each skip, and the results are compared. A variable `without` is the task that computes
!> everything, a variable `with` the task with the skip.
module skip_savings
   use command_line, only: argument_t
   use compliant_stop, only: dynamic_stiffness_t, compliant_stop_t
   use constrained_sets, only: free_beam_t
   use contact_sets, only: contact_set_t, find_set, start_sets, set_store_t
   use damped_oscillators, only: damping_order, make_oscillators
   use failures, only: failure_t
   use free_modes, only: find_free_modes
   use history_list, only: eta_stop, eta_tip, force_stop, velocity_stop
   use kinds, only: wp
   use mode_choice, only: rates_of_modes
   use motion_precision, only: comparison_step
   use motion_tasks, only: events_only, prepare_task, settings_for, task_assembly, task_motion, task_run, task_t
   use number_text, only: to_text
   use precision_types, only: saving_t
   use program_identity, only: program_benchmark
   use program_run, only: read_scenes
   use response_types, only: response_t
   use results_file, only: write_results
   use run_settings, only: output_settings_t, run_settings_t, strict_mode_tolerance
   use scene_beam_model, only: run_settings_of
   use scene_types, only: integrator_exact, scene_t, shape_height_table, shape_taper
   use skyline_matrix, only: to_dense
   use stop_laws, only: make_compliant_stop
   use timed_tasks, only: measure_time
   implicit none (type, external)
   private
   public :: measure_savings

   !> Preload delta of a stop that the beam never reaches (a negative preload is a gap). The beam is released from the
   !> static displacement 1 + delta at the stop, so its displacement at the stop remains above -(1 + delta), which lies
   !> above the surface of the stop at delta if delta < -0.5.
   real(wp), parameter :: contact_out_of_reach = -0.6_wp
   !> Interval of the stored shapes, tau.
   real(wp), parameter :: shape_step = 0.1_wp

   !> Sequences of actions of a task: only the task of `task_t`.
   integer, parameter :: task_only = 0
   !> First the modes of the beam in contact, then the task of `task_t`.
   integer, parameter :: contact_modes_first = 1
   !> Only reading of the scene file.
   integer, parameter :: reading_only = 2
   !> Reading of the scene file, computation of the run, and writing of the results file.
   integer, parameter :: file_to_file = 3

   !> A task that may include other actions than those of `task_t`.
   type, extends(task_t) :: skip_task_t
      !> Sequence of actions, `task_only` to `file_to_file`
      integer :: sequence = task_only
      !> Folder of the results
      character(:), allocatable :: folder
   contains
      procedure :: run
   end type skip_task_t

   !> Measured savings.
   type :: measured_savings_t
      !> Task of the scene's run, with assembled beam and modes, from which the compared tasks are copied
      type(skip_task_t) :: base
      type(saving_t), allocatable :: savings(:)
      !> Set if a task fails; after a failure nothing more is measured
      type(failure_t), allocatable :: error
   end type measured_savings_t

contains

   !> Measure the savings of all skips.
   subroutine measure_savings(scene, folder, horizon, savings, error)
      !> Scene with a stop
      type(scene_t), intent(in) :: scene
      !> Folder of the results; the results file that is written there has the name of the study's results file
      character(*), intent(in) :: folder
      !> End of the comparison of runs with different numbers of modes, tau
      real(wp), intent(in) :: horizon
      !> Measured savings
      type(saving_t), allocatable, intent(out) :: savings(:)
      !> Set if a task fails
      type(failure_t), allocatable, intent(out) :: error

      type(measured_savings_t) :: measured
      type(skip_task_t) :: without, with

      allocate (measured%savings(0))
      call prepare_task(scene, scene%mesh%elements, measured%base, measured%error, with_modes=.true.)
      measured%base%folder = folder
      measured%base%settings = settings_for(integrator_exact, scene%precision, comparison_step)
      measured%base%action = task_motion
      if (scene%beam%shape == shape_taper) call measure_quadrature(measured)
      ! runs that share one computation of the modes, and runs that compute the modes each time
      call copy(measured%base, with)
      call copy(measured%base, without)
      without%action = task_run
      call compare_histories(measured, 'eigen-solve, shared by runs', without, with, with%settings%duration)
      call measure_mode_selection(measured, horizon)
      call measure_contact_modes(measured)
      call measure_output(measured)
      call measure_complete_run(measured)
      call move_alloc(measured%savings, savings)
      call move_alloc(measured%error, error)
   end subroutine measure_savings

   !> Compare closed forms of the element matrices with quadrature. For quadrature the same heights are given as a
   !> table.
   subroutine measure_quadrature(measured)
      type(measured_savings_t), intent(inout) :: measured

      type(skip_task_t) :: without, with
      type(saving_t) :: saving

      call copy(measured%base, with)
      with%action = task_assembly
      call copy(with, without)
      associate (beam => without%scene%beam)
         beam%shape = shape_height_table
         allocate (beam%station, source=[0.0_wp, beam%length])
         allocate (beam%height, source=[beam%height_root, beam%height_tip])
      end associate
      call run_both(measured, without, with)
      if (allocated(measured%error)) return
      saving%name = 'quadrature of element matrices'
      saving%compared = 'K and M, in their maximum entries'
      saving%difference = max(relative_difference(to_dense(with%model%stiffness), to_dense(without%model%stiffness)), &
         relative_difference(to_dense(with%model%mass), to_dense(without%model%mass)))
      call time_both(measured, without, with, saving)
   end subroutine measure_quadrature

   !> Compare the modes that the mode tolerance requires with all modes, for each mode tolerance of the scene or for the
   !> default.
   subroutine measure_mode_selection(measured, horizon)
      type(measured_savings_t), intent(inout) :: measured
      !> End of the comparison, tau
      real(wp), intent(in) :: horizon

      type(skip_task_t) :: without, with
      real(wp), allocatable :: tolerances(:)
      integer :: i

      allocate (tolerances(0))
      call copy(measured%base, with)
      if (allocated(with%scene%precision%mode_tolerances)) then
         tolerances = pack(with%scene%precision%mode_tolerances, with%scene%precision%mode_tolerances > 0.0_wp)
      end if
      if (size(tolerances) == 0) tolerances = [strict_mode_tolerance]
      call copy(measured%base, without)
      without%settings%keep_all_modes = .true.
      do i = 1, size(tolerances)
         with%settings%mode_tolerance = tolerances(i)
         call compare_histories(measured, 'modes that move eta by < '//to_text(tolerances(i)), without, with, horizon)
      end do
   end subroutine measure_mode_selection

   !> Compare a run without contact with the same run after a computation of the modes of the beam in contact.
   subroutine measure_contact_modes(measured)
      type(measured_savings_t), intent(inout) :: measured

      type(skip_task_t) :: without, with

      if (allocated(measured%error)) return
      call copy(measured%base, with)
      with%scene%stop%preload = contact_out_of_reach
      with%settings%keep_all_modes = .true.
      call find_free_modes(with%model, with%modes, measured%error)
      call copy(with, without)
      without%sequence = contact_modes_first
      call compare_histories(measured, 'contact modes, no contact', without, with, with%settings%duration)
   end subroutine measure_contact_modes

   !> Compare a run with events only with runs that record one kind of output each.
   subroutine measure_output(measured)
      type(measured_savings_t), intent(inout) :: measured

      type(output_settings_t) :: output

      output = events_only
      output%history(eta_stop) = .true.
      output%history(eta_tip) = .true.
      output%history(velocity_stop) = .true.
      call compare_events(measured, 'histories of eta', output)
      output = events_only
      output%history(force_stop) = .true.
      call compare_events(measured, 'history of the contact force', output)
      call compare_events(measured, 'energy balance', output_settings_t(history=.false., energy=.true.))
      call compare_events(measured, 'shapes, ten per unit of tau', output_settings_t(history=.false., &
         shape_step=shape_step))
   end subroutine measure_output

   !> Compare reading and checking the scene file (the option --check) with a complete run from the scene file to the
   !> results file.
   subroutine measure_complete_run(measured)
      type(measured_savings_t), intent(inout) :: measured

      type(skip_task_t) :: without, with
      type(saving_t) :: saving

      call copy(measured%base, with)
      with%sequence = reading_only
      call copy(measured%base, without)
      without%sequence = file_to_file
      without%output = output_settings_t()
      saving%name = 'run and file, by --check'
      saving%compared = 'nothing is computed'
      call time_both(measured, without, with, saving)
   end subroutine measure_complete_run

   !> Compare the histories of two runs, then time both runs with events only.
   subroutine compare_histories(measured, name, without, with, horizon)
      type(measured_savings_t), intent(inout) :: measured
      !> Name of the skip
      character(*), intent(in) :: name
      type(skip_task_t), intent(inout) :: without
      type(skip_task_t), intent(inout) :: with
      !> End of the comparison, tau
      real(wp), intent(in) :: horizon

      type(saving_t) :: saving
      ! index of the last sample that is compared
      integer :: last

      without%output = output_settings_t()
      with%output = output_settings_t()
      call run_both(measured, without, with)
      if (allocated(measured%error)) return
      saving%name = name
      saving%compared = 'eta at stop and tip'
      if (horizon < with%settings%duration) saving%compared = 'eta at stop and tip up to tau = '//to_text(horizon)
      associate (a => without%response, b => with%response)
         last = count(a%tau <= horizon*(1.0_wp + 8.0_wp*epsilon(1.0_wp)))
         saving%difference = max(maxval(abs(a%history(eta_stop)%values(:last) - b%history(eta_stop)%values(:last))), &
            maxval(abs(a%history(eta_tip)%values(:last) - b%history(eta_tip)%values(:last))))
      end associate
      without%output = events_only
      with%output = events_only
      call time_both(measured, without, with, saving)
   end subroutine compare_histories

   !> Compare the events of a run with some output with the events of a run without it, and time both runs.
   subroutine compare_events(measured, name, output)
      type(measured_savings_t), intent(inout) :: measured
      !> Name of the skip
      character(*), intent(in) :: name
      !> Output that is skipped
      type(output_settings_t), intent(in) :: output

      type(skip_task_t) :: without, with
      type(saving_t) :: saving

      call copy(measured%base, with)
      call copy(measured%base, without)
      without%output = output
      call run_both(measured, without, with)
      if (allocated(measured%error)) return
      saving%name = name
      saving%compared = 'events'
      saving%difference = difference_of_events(without%response, with%response)
      call time_both(measured, without, with, saving)
   end subroutine compare_events

   !> Execute a task without and with the skip, unless a task has failed before.
   subroutine run_both(measured, without, with)
      type(measured_savings_t), intent(inout) :: measured
      type(skip_task_t), intent(inout) :: without
      type(skip_task_t), intent(inout) :: with

      if (allocated(measured%error)) return
      call without%run(measured%error)
      if (.not. allocated(measured%error)) call with%run(measured%error)
   end subroutine run_both

   !> Time a task without and with the skip and append the saving, unless a task has failed before.
   subroutine time_both(measured, without, with, saving)
      type(measured_savings_t), intent(inout) :: measured
      type(skip_task_t), intent(inout) :: without
      type(skip_task_t), intent(inout) :: with
      !> Saving with name and difference; the times are set
      type(saving_t), intent(inout) :: saving

      if (allocated(measured%error)) return
      call measure_time(without, without%scene%precision, saving%without, measured%error)
      if (.not. allocated(measured%error)) call measure_time(with, with%scene%precision, saving%with, measured%error)
      if (.not. allocated(measured%error)) measured%savings = [measured%savings, saving]
   end subroutine time_both

   !> Maximum difference of the entries of two matrices, over the maximum entry of the second matrix, all in magnitude.
   pure real(wp) function relative_difference(a, b) result(difference)
      real(wp), intent(in) :: a(:, :)
      real(wp), intent(in) :: b(:, :)

      difference = maxval(abs(a - b))/maxval(abs(b))
   end function relative_difference

   !> Maximum difference of instant, eta, impulse or velocities over all events of two runs; if the numbers of events
   !> differ, the difference of these numbers.
   pure real(wp) function difference_of_events(one, other) result(difference)
      !> Compared runs
      type(response_t), intent(in) :: one
      type(response_t), intent(in) :: other

      difference = real(abs(one%event_count - other%event_count), wp)
      if (one%event_count /= other%event_count .or. one%event_count == 0) return
      associate (a => one%events(:one%event_count), b => other%events(:other%event_count))
         difference = max(maxval(abs(a%tau - b%tau)), maxval(abs(a%eta - b%eta)), maxval(abs(a%impulse - b%impulse)), &
            maxval(abs(a%velocity_before - b%velocity_before)), &
            maxval(abs(a%velocity_after - b%velocity_after)))
      end associate
   end function difference_of_events

   !> Copy a task. The assignment stands in one procedure, because its inlined code is long and would be repeated at
   !> each copy.
   subroutine copy(task, other)
      type(skip_task_t), intent(in) :: task
      !> Copy of the task
      type(skip_task_t), intent(inout) :: other

      other = task
   end subroutine copy

   !> Execute a task once.
   subroutine run(self, error)
      class(skip_task_t), intent(inout) :: self
      !> Set if the task fails
      type(failure_t), allocatable, intent(out) :: error

      select case (self%sequence)
      case (contact_modes_first)
         call find_contact_modes(self, error)
         if (.not. allocated(error)) call self%task_t%run(error)
      case (reading_only)
         call read_scene_file(self%scene%file, error)
      case (file_to_file)
         call read_scene_file(self%scene%file, error)
         if (allocated(error)) return
         self%action = task_assembly
         call self%task_t%run(error)
         if (allocated(error)) return
         self%action = task_run
         call self%task_t%run(error)
         if (allocated(error)) return
         call write_results(self%folder, self%scene, error, self%model%mesh%position, response=self%response)
      case default
         call self%task_t%run(error)
      end select
   end subroutine run

   !> Read and check a scene file, as the program does.
   subroutine read_scene_file(file, error)
      character(*), intent(in) :: file
      !> Set if the file cannot be read
      type(failure_t), allocatable, intent(out) :: error

      type(argument_t) :: files(1)
      type(scene_t), allocatable :: scenes(:)

      files(1)%text = file
      call read_scenes(program_benchmark, files, scenes, error)
   end subroutine read_scene_file

   !> Compute the modes of the beam in contact from all modes of the free beam.
   subroutine find_contact_modes(self, error)
      !> Task with the modes of the free beam
      class(skip_task_t), intent(inout) :: self
      !> Set if the modes cannot be computed
      type(failure_t), allocatable, intent(out) :: error

      type(free_beam_t) :: beam
      type(set_store_t) :: store
      type(contact_set_t), pointer :: set
      class(compliant_stop_t), allocatable :: stop
      type(dynamic_stiffness_t) :: dynamic_stiffness
      type(run_settings_t) :: settings
      ! order of the modes that the oscillators need
      integer, allocatable :: order(:)
      ! the run uses the set for the first time (not needed here)
      logical :: is_new

      call make_compliant_stop(self%scene%stop, stop)
      if (allocated(stop)) dynamic_stiffness = stop%dynamic_stiffness_t
      settings = run_settings_of(self%scene)
      associate (free => self%modes, rate => rates_of_modes(settings, self%modes%square))
         order = damping_order(free%square, settings%zeta, rate)
         call make_oscillators(free%square(order), settings%zeta, beam%oscillators, rate(order))
         beam%has_modal_damping = allocated(settings%mode_ratios)
         beam%value = reshape(free%mode(free%stop_dof, order), [size(order), 1])
         beam%tip_value = free%mode(free%tip_dof, order)
         beam%height = [self%scene%stop%preload]
         ! sign of the contact (below the beam) if the stop is at the tip, else 0
         beam%tip_sign = [merge(1.0_wp, 0.0_wp, free%stop_dof == free%tip_dof)]
      end associate
      call start_sets(beam, [.not. allocated(stop)], [dynamic_stiffness], store)
      call find_set([.true.], store, set, is_new, error)
   end subroutine find_contact_modes

end module skip_savings
