!> The response in closed form between events: free modes of the beam, then model A or B of the stop.
module exact_motion
   use applied_loads, only: has_loads
   use beam_model, only: beam_model_t
   use contact_phase, only: contact_phase_t
   use contact_sets, only: set_store_t
   use exact_start, only: finish_exact, start_exact
   use failures, only: failure_t
   use few_modes, only: find_few_modes, find_modes_of_run, first_count, most_count, wants_few_modes
   use free_modes, only: find_free_modes, free_modes_t
   use kinds, only: wp
   use mode_choice, only: agreement, compare_runs, modes_that_matter, next_count, take_modes, trial_settings
   use moment_places, only: open_moments
   use motion_phases, only: advance, motion_t
   use response_records, only: open_records
   use response_types, only: mode_check_t, response_t
   use run_recorder, only: make_recorder, recorder_t
   use run_settings, only: count_samples, impulse_nodal, run_settings_t
   use section_types, only: section_state_t
   use stop_laws, only: is_rigid
   use stop_surfaces, only: has_one_contact
   implicit none (type, external)
   private
   public :: exact_response

contains

   !> Run with the modes that the mode tolerance asks for.
   subroutine exact_response(model, settings, response, error, shared, sets, carried)
      type(beam_model_t), intent(in) :: model
      !> Stop, damping, samples, tolerances, output
      type(run_settings_t), intent(in) :: settings
      !> Events and histories
      type(response_t), intent(out) :: response
      !> Set when the modes cannot be found or the run fails
      type(failure_t), allocatable, intent(out) :: error
      !> The modes of the beam, found beforehand for many runs; where they are absent or empty the run finds its own
      type(free_modes_t), intent(in), optional :: shared
      !> Sets of closed surfaces that the runs before made, for this one and those to come
      type(set_store_t), target, intent(inout), optional :: sets
      !> The motion that the run takes over, if it has a state; then that at its end
      type(section_state_t), intent(inout), optional :: carried

      type(free_modes_t) :: own
      type(mode_check_t) :: check
      type(run_settings_t) :: ours
      type(set_store_t), target :: own_sets
      type(set_store_t), pointer :: kept

      kept => own_sets
      if (present(sets)) kept => sets
      if (present(shared)) then
         if (allocated(shared%lambda)) then
            call respond(model, shared, settings, kept, response, error, carried)
            return
         end if
      end if
      ours = settings
      if (wants_few_modes(model, settings)) then
         call choose_few_modes(model, settings, present(carried), own, check, error)
         ours%response%keep_all_modes = .true.
      else
         call find_free_modes(model, own, error)
      end if
      if (allocated(error)) return
      call respond(model, own, ours, kept, response, error, carried)
      if (check%compared > 0) response%mode_check = check
      response%evaluations = response%evaluations + check%evaluations
      response%factorisations = response%factorisations + 1
   end subroutine exact_response

   !> Of a large mesh so many modes that twice as many change nothing, up to the third rebound.
   subroutine choose_few_modes(model, settings, is_chain, modes, check, error)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      !> The run is one of a chain, whose states must have the same modes
      logical, intent(in) :: is_chain
      type(free_modes_t), intent(out) :: modes
      !> How many, and how that was found
      type(mode_check_t), intent(out) :: check
      !> Set when they cannot be found, or a run fails
      type(failure_t), allocatable, intent(out) :: error

      type(response_t) :: fewer, more
      type(run_settings_t) :: trial
      integer :: count

      if (is_chain .or. settings%response%mode_count > 0) then
         call find_modes_of_run(model, settings, modes, error)
         return
      end if
      count = first_count
      do
         call find_few_modes(model, settings, count, modes, error)
         if (allocated(error)) return
         trial = trial_settings(settings, modes%lambda(1))
         call try_modes(model, modes, trial, more, error)
         if (allocated(error)) return
         check%evaluations = check%evaluations + more%evaluations
         check%kept = size(modes%lambda)
         if (allocated(fewer%tau)) then
            call compare_runs(fewer, more, trial%response%duration, check)
            if (check%difference <= agreement*settings%response%mode_tolerance .or. 2*count > most_count) return
         end if
         check%compared = check%kept
         count = 2*count
         fewer = more
      end do
   end subroutine choose_few_modes

   !> A run to compare.
   subroutine try_modes(model, modes, settings, response, error)
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(in) :: modes
      type(run_settings_t), intent(in) :: settings
      type(response_t), intent(out) :: response
      !> Set when the run fails
      type(failure_t), allocatable, intent(out) :: error

      type(run_settings_t) :: ours
      type(set_store_t), target :: sets

      ours = settings
      ours%response%keep_all_modes = .true.
      if (allocated(ours%stress)) deallocate (ours%stress)
      call respond(model, modes, ours, sets, response, error)
   end subroutine try_modes

   !> Choose the modes and run.
   subroutine respond(model, modes, settings, sets, response, error, carried)
      type(beam_model_t), intent(in) :: model
      !> The modes of the free beam
      type(free_modes_t), intent(in) :: modes
      !> Stop, damping, samples, tolerances, output
      type(run_settings_t), intent(in) :: settings
      type(set_store_t), target, intent(inout) :: sets
      !> Events and histories
      type(response_t), intent(out) :: response
      !> Set when the run fails
      type(failure_t), allocatable, intent(out) :: error
      !> Of a run among surfaces
      type(section_state_t), intent(inout), optional :: carried

      type(mode_check_t) :: check

      check%kept = size(modes%lambda)
      if (settings%response%mode_count > 0) then
         check%kept = min(check%kept, settings%response%mode_count)
      else if (has_one_contact(settings, size(model%supports)) .and. .not. settings%response%keep_all_modes .and. &
         settings%stop%impulse /= impulse_nodal) then
         call choose_modes(model, modes, settings, sets, check)
      end if
      call run_in_modes(model, modes, check%kept, settings, sets, response, error, carried)
      response%evaluations = response%evaluations + check%evaluations
      response%mode_check = check
   end subroutine respond

   !> The modes to keep: those that can matter at all, then more of them until more change nothing.
   !>
   !> That what is left out moves the stop point by little does not say that the others move as if it were there: it
   !> makes the beam more yielding where it hits. So a run is compared with one of more modes, and that one is kept if
   !> both agree far within the tolerance, up to the third rebound: chatter lets any difference grow without end.
   subroutine choose_modes(model, modes, settings, sets, check)
      type(beam_model_t), intent(in) :: model
      !> The modes of the free beam
      type(free_modes_t), intent(in) :: modes
      type(run_settings_t), intent(in) :: settings
      type(set_store_t), target, intent(inout) :: sets
      !> How many to keep, and how that was found
      type(mode_check_t), intent(inout) :: check

      type(run_settings_t) :: trial
      type(response_t) :: fewer, more
      type(failure_t), allocatable :: error
      integer :: all

      all = size(modes%lambda)
      associate (b => modes%mode(modes%stop_dof, :), tolerance => settings%response%mode_tolerance)
         check%kept = modes_that_matter(modes%square, b, 1.0_wp + settings%stop%preload, tolerance, &
            is_rigid(settings%stop) .and. modes%node_flexibility <= 0.0_wp)
         if (check%kept == all) return
         trial = trial_settings(settings, modes%lambda(1))
         do
            check%compared = check%kept
            check%kept = next_count(modes%square, b, check%compared)
            if (check%kept == all) exit
            if (.not. allocated(fewer%tau)) then
               call run_in_modes(model, modes, check%compared, trial, sets, fewer, error)
               if (allocated(error)) exit
               check%evaluations = check%evaluations + fewer%evaluations
            end if
            call run_in_modes(model, modes, check%kept, trial, sets, more, error)
            if (allocated(error)) exit
            check%evaluations = check%evaluations + more%evaluations
            call compare_runs(fewer, more, trial%response%duration, check)
            if (check%difference <= agreement*tolerance) return
            fewer = more
         end do
      end associate
      check = mode_check_t(kept=all, evaluations=check%evaluations)
   end subroutine choose_modes

   !> Run in the lowest modes.
   subroutine run_in_modes(model, modes, kept, settings, sets, response, error, carried)
      type(beam_model_t), intent(in) :: model
      !> The modes of the free beam, which other runs may share
      type(free_modes_t), intent(in) :: modes
      !> Only the first of them are used
      integer, intent(in) :: kept
      !> Stop, damping, samples, tolerances, output
      type(run_settings_t), intent(in) :: settings
      type(set_store_t), target, intent(inout) :: sets
      !> Events and histories
      type(response_t), intent(out) :: response
      !> Set when the run fails
      type(failure_t), allocatable, intent(out) :: error
      type(section_state_t), intent(inout), optional :: carried

      type(free_modes_t) :: few
      type(run_settings_t) :: ours

      if (kept == size(modes%lambda) .and. .not. allocated(settings%mode_ratios) .and. &
         settings%zeta_mass <= 0.0_wp) then
         call run_among_surfaces(model, modes, settings, sets, response, error, carried)
      else
         few = modes
         ours = settings
         call take_modes(kept, few, ours)
         call run_among_surfaces(model, few, ours, sets, response, error, carried)
      end if
   end subroutine run_in_modes

   !> Any number of stops, with all modes.
   subroutine run_among_surfaces(model, modes, settings, sets, response, error, carried)
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(in) :: modes
      type(run_settings_t), intent(in) :: settings
      type(set_store_t), target, intent(inout) :: sets
      type(response_t), intent(out) :: response
      !> Set when the run cannot start, or fails
      type(failure_t), allocatable, intent(out) :: error
      type(section_state_t), intent(inout), optional :: carried

      type(contact_phase_t), target :: phase
      type(motion_t) :: motion
      integer :: samples, standstill
      logical :: is_last

      samples = count_samples(settings%response%duration, settings%response%step)
      call open_records(modes%elements, settings%output, samples, settings%response%step, response, &
         is_driven=has_loads(settings))
      call open_moments(model, settings, samples, response)
      call make_recorder(samples, settings%response%step, size(modes%square), response, motion%recorder)
      if (present(carried)) then
         allocate (phase%carried, source=carried)
         if (allocated(carried%tangent)) allocate (motion%tangent, source=carried%tangent)
      end if
      call start_exact(model, modes, settings, samples, sets, phase, motion, response, error)
      if (allocated(error)) return
      standstill = 0
      is_last = .false.
      do while (.not. (is_last .or. allocated(motion%error)))
         call advance(phase, settings%response, standstill, motion, response, is_last)
      end do
      response%ends_in_contact = any(phase%now%states%is_closed)
      response%factorisations = motion%factorisations
      if (allocated(motion%error)) then
         call move_alloc(motion%error, error)
         return
      end if
      if (present(carried)) then
         carried = phase%carried
         call move_alloc(motion%tangent, carried%tangent)
      end if
      call finish_exact(settings, phase, motion, response)
      if (.not. allocated(response%shape_tau)) return
      if (phase%now%pulled > 0) then
         associate (state => phase%now%states(phase%now%pulled))
            call fill_shapes(modes, state%surface%sign*state%surface%height, motion%recorder, response)
         end associate
      else
         call fill_shapes(modes, 0.0_wp, motion%recorder, response)
      end if
   end subroutine run_among_surfaces

   !> The whole beam at the instants that were kept.
   subroutine fill_shapes(modes, height, recorder, response)
      type(free_modes_t), intent(in) :: modes
      !> delta: where eta is 0
      real(wp), intent(in) :: height
      type(recorder_t), intent(in) :: recorder
      type(response_t), intent(inout) :: response

      integer :: i, kept

      kept = size(recorder%shape_z, 1)
      do i = 1, modes%elements
         response%shape_displacement(i, :) = matmul(modes%mode(2*i - 1, :kept), recorder%shape_z) - height
         response%shape_slope(i, :) = matmul(modes%mode(2*i, :kept), recorder%shape_z)
         response%shape_velocity(i, :) = matmul(modes%mode(2*i - 1, :kept), recorder%shape_v)
         response%shape_slope_velocity(i, :) = matmul(modes%mode(2*i, :kept), recorder%shape_v)
      end do
      associate (node => modes%stop_dof/2 + 1)
         response%shape_displacement(node, :) = response%shape_displacement(node, :) + recorder%shape_node(1, :)
         response%shape_velocity(node, :) = response%shape_velocity(node, :) + recorder%shape_node(2, :)
      end associate
      response%shape_displacement(0, :) = -height
      associate (dofs => modes%root_dofs)
         if (dofs(1) > 0) then
            response%shape_displacement(0, :) = matmul(modes%mode(dofs(1), :kept), recorder%shape_z) - height
            response%shape_velocity(0, :) = matmul(modes%mode(dofs(1), :kept), recorder%shape_v)
         end if
         if (dofs(2) > 0) then
            response%shape_slope(0, :) = matmul(modes%mode(dofs(2), :kept), recorder%shape_z)
            response%shape_slope_velocity(0, :) = matmul(modes%mode(dofs(2), :kept), recorder%shape_v)
         end if
      end associate
   end subroutine fill_shapes

end module exact_motion
