!> What a scene saves by what it does not need: the same thing done without each skip and with it, how long both take,
!> and how far their answers differ.
module skip_savings
   use command_line, only: argument_t
   use contact_sets, only: contact_set_t, find_set, open_sets, set_store_t
   use damped_oscillators, only: damping_order, make_oscillators
   use failures, only: failure_t
   use free_modes, only: find_free_modes
   use constrained_sets, only: free_beam_t
   use history_list, only: eta_stop, eta_tip, force_stop, velocity_stop
   use kinds, only: wp
   use mode_choice, only: rates_of_modes
   use motion_precision, only: comparison_step
   use motion_tasks, only: no_output, prepare_task, settings_for, task_assembly, task_motion, task_run, task_t
   use number_text, only: to_text
   use precision_types, only: saving_t
   use program_identity, only: program_benchmark
   use program_run, only: read_scenes
   use response_types, only: response_t
   use results_file, only: write_results
   use run_settings, only: output_settings_t, run_settings_t, strict_mode_tolerance
   use scene_beam_model, only: run_of
   use scene_types, only: contender_exact, scene_t, shape_height_table, shape_taper
   use skyline_matrix, only: to_dense
   use stop_laws, only: make_yielding_stop
   use timed_tasks, only: measure_time
   use yielding_stop, only: impedance_t, yielding_stop_t
   implicit none (type, external)
   private
   public :: measure_savings

   !> Surface of a stop that the beam never reaches, delta: it swings down to -0.5 at most.
   real(wp), parameter :: contact_out_of_reach = -0.6_wp
   !> Distance of the shapes that are kept, tau.
   real(wp), parameter :: shape_step = 0.1_wp

   !> What a task does besides that of `task_t`: nothing; the modes of the contact first; or, instead of it, reading the
   !> scene's file only; reading it, running and writing the results.
   integer, parameter :: plain = 0
   integer, parameter :: contact_modes_first = 1
   integer, parameter :: reading_only = 2
   integer, parameter :: file_to_file = 3

   type, extends(task_t) :: skip_task_t
      !> One of the constants above
      integer :: besides = plain
      !> Folder of the results
      character(:), allocatable :: folder
   contains
      procedure :: run
   end type skip_task_t

   !> What was found so far.
   type :: findings_t
      !> The scene's run, its beam and its modes at hand
      type(skip_task_t) :: base
      type(saving_t), allocatable :: savings(:)
      !> Set when something has failed; nothing is measured after it
      type(failure_t), allocatable :: error
   end type findings_t

contains

   !> Measure every skip.
   subroutine measure_savings(scene, folder, horizon, savings, error)
      !> The scene, with a stop
      type(scene_t), intent(in) :: scene
      !> Folder of the results; the file that is written there is the scene's own
      character(*), intent(in) :: folder
      !> Up to here runs with different modes are compared, tau
      real(wp), intent(in) :: horizon
      !> What was found
      type(saving_t), allocatable, intent(out) :: savings(:)
      !> Set when something fails
      type(failure_t), allocatable, intent(out) :: error

      type(findings_t) :: found

      allocate (found%savings(0))
      call prepare_task(scene, scene%mesh%elements, found%base, found%error, with_modes=.true.)
      found%base%folder = folder
      found%base%settings = settings_for(contender_exact, scene%precision, comparison_step)
      found%base%what = task_motion
      if (scene%beam%shape == shape_taper) call save_quadrature(found)
      call save_eigen_solve(found)
      call save_modes(found, horizon)
      call save_contact_modes(found)
      call save_output(found)
      call save_everything(found)
      call move_alloc(found%savings, savings)
      call move_alloc(found%error, error)
   end subroutine measure_savings

   !> Closed forms of the element matrices against quadrature, for which the same heights are given as a table.
   subroutine save_quadrature(found)
      type(findings_t), intent(inout) :: found

      type(skip_task_t) :: without, with
      type(saving_t) :: saving

      call copy(found%base, with)
      with%what = task_assembly
      call copy(with, without)
      associate (beam => without%scene%beam)
         beam%shape = shape_height_table
         allocate (beam%station, source=[0.0_wp, beam%length])
         allocate (beam%height, source=[beam%height_root, beam%height_tip])
      end associate
      call run_both(found, without, with)
      if (allocated(found%error)) return
      saving%name = 'quadrature of element matrices'
      saving%compared = 'K and M, in their greatest entries'
      saving%difference = max(relative_difference(to_dense(with%model%stiffness), to_dense(without%model%stiffness)), &
         relative_difference(to_dense(with%model%mass), to_dense(without%model%mass)))
      call time_both(found, without, with, saving)
   end subroutine save_quadrature

   !> An eigen-solve for each run against one that runs share.
   subroutine save_eigen_solve(found)
      type(findings_t), intent(inout) :: found

      type(skip_task_t) :: without, with

      call copy(found%base, with)
      call copy(found%base, without)
      without%what = task_run
      call compare_histories(found, 'eigen-solve, shared by runs', without, with, with%settings%duration)
   end subroutine save_eigen_solve

   !> All modes against those that matter, for each mode tolerance that the scene asks for or the default.
   subroutine save_modes(found, horizon)
      type(findings_t), intent(inout) :: found
      !> Up to here the runs are compared, tau
      real(wp), intent(in) :: horizon

      type(skip_task_t) :: without, with
      real(wp), allocatable :: tolerances(:)
      integer :: i

      allocate (tolerances(0))
      call copy(found%base, with)
      if (allocated(with%scene%precision%mode_tolerances)) then
         tolerances = pack(with%scene%precision%mode_tolerances, with%scene%precision%mode_tolerances > 0.0_wp)
      end if
      if (size(tolerances) == 0) tolerances = [strict_mode_tolerance]
      call copy(found%base, without)
      without%settings%keep_all_modes = .true.
      do i = 1, size(tolerances)
         with%settings%mode_tolerance = tolerances(i)
         call compare_histories(found, 'modes that move eta by < '//to_text(tolerances(i)), without, with, horizon)
      end do
   end subroutine save_modes

   !> A run that never touches, with the modes of the contact found beforehand against without.
   subroutine save_contact_modes(found)
      type(findings_t), intent(inout) :: found

      type(skip_task_t) :: without, with

      if (allocated(found%error)) return
      call copy(found%base, with)
      with%scene%stop%preload = contact_out_of_reach
      with%settings%keep_all_modes = .true.
      call find_free_modes(with%model, with%modes, found%error)
      call copy(with, without)
      without%besides = contact_modes_first
      call compare_histories(found, 'contact modes, no contact', without, with, with%settings%duration)
   end subroutine save_contact_modes

   !> Each kind of output by itself against events only.
   subroutine save_output(found)
      type(findings_t), intent(inout) :: found

      type(output_settings_t) :: output

      output = no_output()
      output%history(eta_stop) = .true.
      output%history(eta_tip) = .true.
      output%history(velocity_stop) = .true.
      call compare_events(found, 'histories of eta', output)
      output = no_output()
      output%history(force_stop) = .true.
      call compare_events(found, 'history of the contact force', output)
      output = no_output()
      output%energy = .true.
      call compare_events(found, 'ledger of energy', output)
      output = no_output()
      output%shape_step = shape_step
      call compare_events(found, 'shapes, ten per unit of tau', output)
   end subroutine save_output

   !> From file to file against reading and checking the scene's file, which is what --check does.
   subroutine save_everything(found)
      type(findings_t), intent(inout) :: found

      type(skip_task_t) :: without, with
      type(saving_t) :: saving

      call copy(found%base, with)
      with%besides = reading_only
      call copy(found%base, without)
      without%besides = file_to_file
      without%output = output_settings_t()
      saving%name = 'run and file, by --check'
      saving%compared = 'nothing is computed'
      call time_both(found, without, with, saving)
   end subroutine save_everything

   !> Compare the histories of two runs, then time them by their events alone.
   subroutine compare_histories(found, name, without, with, horizon)
      type(findings_t), intent(inout) :: found
      !> What is skipped
      character(*), intent(in) :: name
      type(skip_task_t), intent(inout) :: without
      type(skip_task_t), intent(inout) :: with
      !> Up to here they are compared, tau
      real(wp), intent(in) :: horizon

      type(saving_t) :: saving
      integer :: last

      without%output = output_settings_t()
      with%output = output_settings_t()
      call run_both(found, without, with)
      if (allocated(found%error)) return
      saving%name = name
      saving%compared = 'eta at stop and tip'
      if (horizon < with%settings%duration) saving%compared = 'eta at stop and tip up to tau = '//to_text(horizon)
      associate (a => without%response, b => with%response)
         last = count(a%tau <= horizon*(1.0_wp + 8.0_wp*epsilon(1.0_wp)))
         saving%difference = max(maxval(abs(a%history(eta_stop)%values(:last) - b%history(eta_stop)%values(:last))), &
            maxval(abs(a%history(eta_tip)%values(:last) - b%history(eta_tip)%values(:last))))
      end associate
      without%output = no_output()
      with%output = no_output()
      call time_both(found, without, with, saving)
   end subroutine compare_histories

   !> Compare the events of a run that keeps something with those of one that keeps nothing else, and time both.
   subroutine compare_events(found, name, output)
      type(findings_t), intent(inout) :: found
      !> What is skipped
      character(*), intent(in) :: name
      !> What is kept
      type(output_settings_t), intent(in) :: output

      type(skip_task_t) :: without, with
      type(saving_t) :: saving

      call copy(found%base, with)
      call copy(found%base, without)
      without%output = output
      call run_both(found, without, with)
      if (allocated(found%error)) return
      saving%name = name
      saving%compared = 'events'
      saving%difference = difference_of_events(without%response, with%response)
      call time_both(found, without, with, saving)
   end subroutine compare_events

   !> Do it without the skip and with it, unless something has failed.
   subroutine run_both(found, without, with)
      type(findings_t), intent(inout) :: found
      type(skip_task_t), intent(inout) :: without
      type(skip_task_t), intent(inout) :: with

      if (allocated(found%error)) return
      call without%run(found%error)
      if (.not. allocated(found%error)) call with%run(found%error)
   end subroutine run_both

   !> Time both ways and keep what was found, unless something has failed.
   subroutine time_both(found, without, with, saving)
      type(findings_t), intent(inout) :: found
      type(skip_task_t), intent(inout) :: without
      type(skip_task_t), intent(inout) :: with
      !> Names and difference in; times are added
      type(saving_t), intent(inout) :: saving

      if (allocated(found%error)) return
      call measure_time(without, without%scene%precision, saving%without, found%error)
      if (.not. allocated(found%error)) call measure_time(with, with%scene%precision, saving%with, found%error)
      if (.not. allocated(found%error)) found%savings = [found%savings, saving]
   end subroutine time_both

   !> The greatest difference of two matrices in the greatest entry of one.
   pure function relative_difference(a, b) result(difference)
      real(wp), intent(in) :: a(:, :)
      real(wp), intent(in) :: b(:, :)
      real(wp) :: difference

      difference = maxval(abs(a - b))/maxval(abs(b))
   end function relative_difference

   !> The greatest difference of instant, place, velocities or impulse of all events; if there are not as many, how many
   !> more.
   pure function difference_of_events(one, other) result(difference)
      !> The runs
      type(response_t), intent(in) :: one
      type(response_t), intent(in) :: other
      real(wp) :: difference

      difference = real(abs(one%event_count - other%event_count), wp)
      if (one%event_count /= other%event_count .or. one%event_count == 0) return
      associate (a => one%events(:one%event_count), b => other%events(:other%event_count))
         difference = max(maxval(abs(a%tau - b%tau)), maxval(abs(a%eta - b%eta)), maxval(abs(a%impulse - b%impulse)), &
            maxval(abs(a%velocity_before - b%velocity_before)), &
            maxval(abs(a%velocity_after - b%velocity_after)))
      end associate
   end function difference_of_events

   !> Another task like one. All that a task holds is copied in one place: in line it would be most of this file's code.
   subroutine copy(task, other)
      type(skip_task_t), intent(in) :: task
      !> Becomes like it
      type(skip_task_t), intent(inout) :: other

      other = task
   end subroutine copy

   !> Do a task once.
   subroutine run(self, error)
      class(skip_task_t), intent(inout) :: self
      !> Set when it fails
      type(failure_t), allocatable, intent(out) :: error

      select case (self%besides)
      case (contact_modes_first)
         call find_contact_modes(self, error)
         if (.not. allocated(error)) call self%task_t%run(error)
      case (reading_only)
         call read_again(self%scene%file, error)
      case (file_to_file)
         call read_again(self%scene%file, error)
         if (allocated(error)) return
         self%what = task_assembly
         call self%task_t%run(error)
         if (allocated(error)) return
         self%what = task_run
         call self%task_t%run(error)
         if (allocated(error)) return
         call write_results(self%folder, self%scene, error, self%model%mesh%position, response=self%response)
      case default
         call self%task_t%run(error)
      end select
   end subroutine run

   !> Read and check a scene's file, as the program does.
   subroutine read_again(file, error)
      character(*), intent(in) :: file
      !> Set when it cannot be read
      type(failure_t), allocatable, intent(out) :: error

      type(argument_t) :: files(1)
      type(scene_t), allocatable :: scenes(:)

      files(1)%text = file
      call read_scenes(program_benchmark, files, scenes, error)
   end subroutine read_again

   !> The modes of the beam in contact, of all its free modes.
   subroutine find_contact_modes(self, error)
      !> The task, with its modes
      class(skip_task_t), intent(inout) :: self
      !> Set when they cannot be found
      type(failure_t), allocatable, intent(out) :: error

      type(free_beam_t) :: beam
      type(set_store_t) :: store
      type(contact_set_t), pointer :: set
      class(yielding_stop_t), allocatable :: stop
      type(impedance_t) :: impedance
      type(run_settings_t) :: settings
      integer, allocatable :: order(:)
      logical :: is_new

      call make_yielding_stop(self%scene%stop, stop)
      if (allocated(stop)) impedance = stop%impedance_t
      settings = run_of(self%scene)
      associate (free => self%modes, rate => rates_of_modes(settings, self%modes%square))
         order = damping_order(free%square, settings%zeta, rate)
         call make_oscillators(free%square(order), settings%zeta, beam%oscillators, rate(order))
         beam%has_own_rates = allocated(settings%mode_ratios)
         beam%value = reshape(free%mode(free%stop_dof, order), [size(order), 1])
         beam%tip_value = free%mode(free%tip_dof, order)
         beam%height = [self%scene%stop%preload]
         beam%tip_sign = [merge(1.0_wp, 0.0_wp, free%stop_dof == free%tip_dof)]
      end associate
      call open_sets(beam, [.not. allocated(stop)], [impedance], store)
      call find_set([.true.], store, set, is_new, error)
   end subroutine find_contact_modes

end module skip_savings
