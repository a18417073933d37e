!> Exact motion: the response of a beam with stops, in closed form between events. The module chooses the number of
!> modes by trial runs if the settings leave it open (docs/theory.md, section 13), and runs the motion phase by phase (a
!> phase is the motion between two events).
module exact_motion
   use applied_loads, only: has_loads
   use beam_model, only: beam_model_t, complete_model
   use contact_phase, only: contact_phase_t
   use contact_sets, only: set_store_t
   use exact_start, only: finish_exact, start_exact
   use failures, only: failure_t
   use few_modes, only: begins_with_few_modes, common_count, find_common_modes, find_few_modes, max_iterated, &
      needs_all_modes, number_of_modes, takes_few_modes
   use free_modes, only: are_modes_of_run, are_same, find_free_modes, free_modes_t
   use kinds, only: wp
   use lapack_interfaces, only: dgemm
   use mode_choice, only: first_count, max_all_modes, max_count, next_count, select_modes
   use mode_trials, only: add_trial, can_afford, is_driven, judge_trials, lengthen, max_stalled, open_trials, &
      settle_length, shorten, trials_t
   use moment_places, only: open_moments
   use motion_advance, only: advance
   use motion_phases, only: motion_t
   use response_records, only: open_records
   use response_types, only: mode_check_t, response_t
   use run_recorder, only: make_recorder, recorder_t
   use run_settings, only: count_samples, run_settings_t
   use section_types, only: section_state_t
   use stop_contacts, only: datum_of
   implicit none (type, external)
   private
   public :: exact_response, choose_modes

   !> A trial run, made to compare numbers of modes.
   type :: trial_t
      type(free_modes_t) :: modes
      type(response_t) :: response
      !> Whether the run was made; false if it would cost too much, or failed
      logical :: is_done = .false.
   end type trial_t

contains

   !> Compute the response with the number of modes that the requested accuracy needs.
   subroutine exact_response(model, settings, response, error, shared, sets, carried)
      type(beam_model_t), intent(in) :: model
      !> Settings of the run: stops, damping, samples, tolerances, output
      type(run_settings_t), intent(in) :: settings
      !> Events and histories of the run
      type(response_t), intent(out) :: response
      !> Set if the modes cannot be found or the run fails
      type(failure_t), allocatable, intent(out) :: error
      !> Modes from `find_common_modes`, shared by several runs; if absent or empty, the run computes its own
      type(free_modes_t), target, intent(in), optional :: shared
      !> Contact sets cached by earlier runs, for this run and later runs
      type(set_store_t), target, intent(inout), optional :: sets
      !> State from which the run continues, if `q` is allocated; on return the state at the end of the run
      type(section_state_t), intent(inout), optional :: carried

      type(free_modes_t), target :: own_modes
      type(free_modes_t), allocatable :: chosen
      type(free_modes_t), pointer :: common_modes
      type(mode_check_t) :: check
      type(set_store_t), allocatable, target :: own_sets
      type(set_store_t), pointer :: store

      if (present(sets)) then
         store => sets
      else
         allocate (own_sets)
         ! the number of modes of the run is nearly always that of the last trial or of the last but one: memory of
         ! earlier trials is used again
         own_sets%max_others = 2
         store => own_sets
      end if
      common_modes => own_modes
      if (present(shared)) then
         if (allocated(shared%lambda)) common_modes => shared
      end if
      if (.not. allocated(common_modes%lambda)) then
         call find_common_modes(model, settings, own_modes, error)
         if (allocated(error)) return
      end if
      call choose_modes(model, settings, common_modes, chosen, check, error, store, carried)
      if (allocated(error)) return
      if (allocated(chosen)) then
         call run_in_modes(model, chosen, check%retained, settings, store, response, error, carried)
      else
         call run_in_modes(model, common_modes, check%retained, settings, store, response, error, carried)
      end if
      if (present(carried)) call move_alloc(chosen, carried%modes)
      response%mode_check = check
      response%evaluations = response%evaluations + check%evaluations
      if (associated(common_modes, own_modes)) response%factorisations = response%factorisations + 1
   end subroutine exact_response

   !> Choose the modes of a run: the smallest number of modes that a comparison with a larger number shows to suffice.
   !>
   !> A reduced set of modes holds some of the lowest modes, and residual modes, which give stops and loads the full
   !> static flexibility of the beam. Only the inertia of the other modes is neglected. The effect of this neglect is
   !> not known before the run, so the motion with few modes is compared with the motion with more modes. If both
   !> motions agree well within the requested accuracy, the smaller number is used. If trial runs would cost more than
   !> they can save, or never agree, all modes are used. A run that continues another one has the modes of that run.
   subroutine choose_modes(model, settings, common_modes, modes, check, error, sets, carried)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      !> From `find_common_modes`
      type(free_modes_t), intent(in) :: common_modes
      !> Chosen modes; unallocated: the modes of `common_modes` are used
      type(free_modes_t), allocatable, intent(out) :: modes
      !> Number of modes, and how the number was found
      type(mode_check_t), intent(out) :: check
      !> Set if the modes cannot be found
      type(failure_t), allocatable, intent(out) :: error
      !> Contact sets that trial runs share with other runs
      type(set_store_t), target, intent(inout), optional :: sets
      !> State from which the run continues, if `q` is allocated; its modes are moved to `modes`
      type(section_state_t), intent(inout), optional :: carried

      type(set_store_t), allocatable, target :: own_sets
      type(set_store_t), pointer :: store
      logical :: is_continued

      if (present(sets)) then
         store => sets
      else
         allocate (own_sets)
         store => own_sets
      end if
      check%all_modes = number_of_modes(model)
      is_continued = .false.
      if (present(carried)) is_continued = allocated(carried%q)
      if (is_continued) call move_alloc(carried%modes, modes)
      if (settings%response%mode_count > 0) then
         check%retained = min(check%all_modes, settings%response%mode_count)
         if (allocated(modes)) return
         if (check%retained <= size(common_modes%lambda) .and. &
            .not. takes_few_modes(model%mesh%elements, settings)) return
         ! moments take the static contribution of the truncated modes from the residual modes
         allocate (modes)
         call find_few_modes(model, settings, check%retained, modes, error, common_modes)
         return
      end if
      if (.not. is_continued .and. check%all_modes > max_all_modes .and. &
         .not. (needs_all_modes(settings) .or. has_stiff_node(common_modes))) then
         call try_numbers(model, settings, common_modes, store, modes, check, error)
         if (allocated(error)) return
      end if
      if (.not. allocated(modes) .and. size(common_modes%lambda) < check%all_modes .and. &
         begins_with_few_modes(model%mesh%elements, settings)) then
         ! no tried number suffices: all modes, or the maximum number of lowest modes if the mesh is too large
         if (max_count > max_iterated(model%mesh%elements)) then
            call find_all_modes(model, common_modes, store, error)
            if (.not. allocated(error)) allocate (modes, source=store%all_modes)
         else
            allocate (modes)
            call find_few_modes(model, settings, max_count, modes, error)
         end if
         if (allocated(error)) return
      end if
      check%retained = size(common_modes%lambda)
      if (allocated(modes)) check%retained = size(modes%lambda)
      check%persists = is_driven(settings) .and. settings%has_stop .and. check%horizon < settings%response%duration
   end subroutine choose_modes

   !> Whether the beam is so stiff at a massless node that only the highest modes of the mesh move the node. With lower
   !> modes alone, the node would be rigid, and its rounding errors would count as energy.
   pure logical function has_stiff_node(modes) result(answer)
      type(free_modes_t), intent(in) :: modes

      ! below this flexibility the energy (displacement)^2/(2 flexibility) of a rounding error is significant
      real(wp), parameter :: min_flexibility = 1.0e-20_wp

      answer = modes%node_flexibility > 0.0_wp .and. modes%node_flexibility < min_flexibility
   end function has_stiff_node

   !> Find all modes of a beam, unless an earlier run with the same common modes has found them.
   subroutine find_all_modes(model, common_modes, sets, error)
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(in) :: common_modes
      !> Receives the modes
      type(set_store_t), intent(inout) :: sets
      !> Set if the modes cannot be found
      type(failure_t), allocatable, intent(out) :: error

      if (allocated(sets%all_modes)) then
         if (are_same(common_modes, sets%common_modes)) return
         deallocate (sets%all_modes)
      end if
      allocate (sets%all_modes)
      sets%common_modes = common_modes
      call find_free_modes(model, sets%all_modes, error)
      if (allocated(error)) deallocate (sets%all_modes)
   end subroutine find_all_modes

   !> Try increasing numbers of modes until two trials agree or no further trial can be afforded.
   subroutine try_numbers(model, settings, common_modes, sets, modes, check, error)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      type(free_modes_t), target, intent(in) :: common_modes
      type(set_store_t), target, intent(inout) :: sets
      !> Modes of the smaller of two trials that agree; unallocated: no two trials agree
      type(free_modes_t), allocatable, intent(out) :: modes
      !> Receives the result of the trials
      type(mode_check_t), intent(inout) :: check
      !> Set if modes cannot be found
      type(failure_t), allocatable, intent(out) :: error

      ! the last trial but one and the last trial, which has more modes
      type(trial_t), allocatable :: fewer, more
      ! trial whose number of modes suffices
      type(trial_t), allocatable :: enough
      type(trials_t) :: trials
      ! comparison of two trials that agree up to the first contacts
      type(mode_check_t) :: early
      ! comparison that shows that the trial `enough` suffices
      type(mode_check_t) :: enough_check
      ! modes among which the next trial chooses
      type(free_modes_t), pointer :: base
      ! number of the lowest modes in the present trial
      integer :: count

      call open_trials(settings, common_modes, check%all_modes, trials)
      base => common_modes
      count = first_count(settings, base)
      ! if loads require all modes found so far, they may require further modes
      if (count == size(base%lambda) .and. count < min(common_count, check%all_modes)) then
         call choose_among_all()
         if (allocated(error)) return
         count = first_count(settings, base)
      end if
      do while (count <= max_count)
         if (count > size(base%lambda) .and. count > max_iterated(model%mesh%elements)) then
            if (.not. can_afford(trials, count)) exit
            call choose_among_all()
            if (allocated(error)) return
         end if
         allocate (more)
         call find_few_modes(model, settings, count, more%modes, error, base)
         if (allocated(error)) return
         call try_modes(model, more, sets, trials, check)
         if (.not. more%is_done) exit
         if (allocated(fewer)) then
            check%compared_modes = size(more%modes%lambda)
            call judge_trials(trials, fewer%response, more%response, check, early)
            if (check%agrees .and. trials%full_length > 0.0_wp) call compare_longer(model, sets, trials, fewer, more, &
               check, early)
            if (check%agrees) early = check
            ! agreement up to the first contacts alone is used if no later comparison agrees for longer
            if (check%agrees .or. (early%agrees .and. .not. allocated(enough))) then
               enough_check = early
               call move_alloc(fewer, enough)
            end if
            if (check%agrees .or. trials%stalled >= max_stalled .or. .not. more%is_done) exit
         end if
         call move_alloc(more, fewer)
         count = next_count(count)
      end do
      if (.not. allocated(enough)) return
      enough_check%evaluations = check%evaluations
      enough_check%work = check%work
      check = enough_check
      allocate (modes, source=enough%modes)

   contains

      !> Let the next trials choose among all modes.
      subroutine choose_among_all()
         call find_all_modes(model, common_modes, sets, error)
         trials%saved_work = 0.0_wp
         if (.not. allocated(error)) base => sets%all_modes
      end subroutine choose_among_all

   end subroutine try_numbers

   !> Repeat two trials that agree over the first contacts with the full length, and compare them again. If that would
   !> cost too much, the comparison over the first contacts remains.
   subroutine compare_longer(model, sets, trials, fewer, more, check, early)
      type(beam_model_t), intent(in) :: model
      type(set_store_t), target, intent(inout) :: sets
      type(trials_t), intent(inout) :: trials
      type(trial_t), intent(inout) :: fewer
      type(trial_t), intent(inout) :: more
      !> Comparison over the first contacts on entry, over the full length on return
      type(mode_check_t), intent(inout) :: check
      !> Comparison over the first contacts
      type(mode_check_t), intent(inout) :: early

      type(mode_check_t) :: first

      first = check
      call lengthen(trials)
      fewer%is_done = .false.
      more%is_done = .false.
      call try_modes(model, fewer, sets, trials, check)
      if (fewer%is_done) call try_modes(model, more, sets, trials, check)
      early = first
      check%agrees = .false.
      if (more%is_done) call judge_trials(trials, fewer%response, more%response, check, early)
   end subroutine compare_longer

   !> Make a trial run. The first trial run is repeated with new lengths until `settle_length` accepts the length.
   subroutine try_modes(model, trial, sets, trials, check)
      type(beam_model_t), intent(in) :: model
      !> The trial, which receives its response
      type(trial_t), intent(inout) :: trial
      type(set_store_t), target, intent(inout) :: sets
      type(trials_t), intent(inout) :: trials
      !> Receives the cost of the trial
      type(mode_check_t), intent(inout) :: check

      type(failure_t), allocatable :: error
      logical :: is_shorter

      do while (.not. trial%is_done)
         associate (number => size(trial%modes%lambda))
            if (.not. can_afford(trials, number)) return
            call run_in_modes(model, trial%modes, number, trials%settings, sets, trial%response, error)
            call add_trial(trials, number, trial%response)
            check%evaluations = check%evaluations + trial%response%evaluations
            check%work = trials%work
            if (allocated(error)) then
               ! the error is not reported here: the run itself will fail in the same way
               call shorten(trials, trial%response, is_shorter)
               if (.not. is_shorter) return
               cycle
            end if
            if (.not. trials%is_settled) call settle_length(trials, number, trial%response)
            trial%is_done = trials%is_settled
         end associate
      end do
   end subroutine try_modes

   !> Run with the first `mode_count` modes.
   subroutine run_in_modes(model, modes, mode_count, settings, sets, response, error, carried)
      type(beam_model_t), intent(in) :: model
      !> Modes of the free beam, shared with other runs
      type(free_modes_t), intent(in) :: modes
      !> Number of modes used, from the first
      integer, intent(in) :: mode_count
      !> Settings of the run: stops, damping, samples, tolerances, output
      type(run_settings_t), intent(in) :: settings
      type(set_store_t), target, intent(inout) :: sets
      !> Events and histories of the run
      type(response_t), intent(out) :: response
      !> Set if the run fails
      type(failure_t), allocatable, intent(out) :: error
      type(section_state_t), intent(inout), optional :: carried

      type(beam_model_t) :: whole
      type(free_modes_t) :: reduced
      type(run_settings_t) :: reduced_settings

      if (are_modes_of_run(settings, mode_count, modes) .and. .not. allocated(settings%mode_ratios) .and. &
         settings%zeta_mass <= 0.0_wp) then
         call run_among_contacts(model, modes, settings, sets, response, error, carried)
      else
         reduced = modes
         reduced_settings = settings
         call select_modes(mode_count, reduced, reduced_settings)
         whole = model
         call complete_model(settings, whole)
         call run_among_contacts(whole, reduced, reduced_settings, sets, response, error, carried)
      end if
   end subroutine run_in_modes

   !> Run with all given modes and any number of stops.
   subroutine run_among_contacts(model, modes, settings, sets, response, error, carried)
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(in) :: modes
      type(run_settings_t), intent(in) :: settings
      type(set_store_t), target, intent(inout) :: sets
      type(response_t), intent(out) :: response
      !> Set if the run cannot start, or fails
      type(failure_t), allocatable, intent(out) :: error
      type(section_state_t), intent(inout), optional :: carried

      type(contact_phase_t), target :: phase
      type(motion_t) :: motion
      ! number of samples
      integer :: samples
      ! number of consecutive phases of length zero
      integer :: standstill
      logical :: is_last

      samples = count_samples(settings%response%duration, settings%response%step)
      call open_records(modes%elements, settings%output, settings%response, response, &
         has_loads(settings), model%points)
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
      response%factorisations = motion%eigenproblems
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
      if (phase%now%release_contact > 0) then
         associate (state => phase%now%states(phase%now%release_contact))
            call fill_shapes(modes, datum_of(state%contact), motion%recorder, response)
         end associate
      else
         call fill_shapes(modes, 0.0_wp, motion%recorder, response)
      end if
   end subroutine run_among_contacts

   !> Compute displacements, slopes and velocities of the whole beam at the recorded instants.
   subroutine fill_shapes(modes, height, recorder, response)
      type(free_modes_t), intent(in) :: modes
      !> Height delta of the release contact, where eta = 0, in units of displacement
      real(wp), intent(in) :: height
      type(recorder_t), intent(in) :: recorder
      type(response_t), intent(inout) :: response

      ! modes of displacements and slopes at the nodes after the root; contiguous, so that their products are fast
      real(wp), allocatable :: displacement(:, :), slope(:, :)
      integer :: mode_count

      mode_count = size(recorder%shape_z, 1)
      ! rows 2 i - 1 and 2 i of a mode are displacement and slope of node i; node 0 is the root
      allocate (displacement, source=modes%mode(1:2*modes%elements - 1:2, :mode_count))
      allocate (slope, source=modes%mode(2:2*modes%elements:2, :mode_count))
      call multiply(displacement, recorder%shape_z, response%shape_displacement)
      call multiply(slope, recorder%shape_z, response%shape_slope)
      call multiply(displacement, recorder%shape_v, response%shape_velocity)
      call multiply(slope, recorder%shape_v, response%shape_slope_velocity)
      response%shape_displacement(1:, :) = response%shape_displacement(1:, :) - height
      ! a massless node at the stop is displaced relative to the modes
      associate (node => modes%stop_dof/2 + 1)
         response%shape_displacement(node, :) = response%shape_displacement(node, :) + recorder%shape_node(1, :)
         response%shape_velocity(node, :) = response%shape_velocity(node, :) + recorder%shape_node(2, :)
      end associate
      response%shape_displacement(0, :) = -height
      associate (dofs => modes%root_dofs)
         if (dofs(1) > 0) then
            response%shape_displacement(0, :) = matmul(modes%mode(dofs(1), :mode_count), recorder%shape_z) - height
            response%shape_velocity(0, :) = matmul(modes%mode(dofs(1), :mode_count), recorder%shape_v)
         end if
         if (dofs(2) > 0) then
            response%shape_slope(0, :) = matmul(modes%mode(dofs(2), :mode_count), recorder%shape_z)
            response%shape_slope_velocity(0, :) = matmul(modes%mode(dofs(2), :mode_count), recorder%shape_v)
         end if
      end associate

   contains

      !> Multiply modes at the nodes after the root by amplitudes.
      subroutine multiply(values, amplitudes, products)
         !> Values of the modes at the nodes, [nodes, modes], and amplitudes, [modes, instants]
         real(wp), intent(in) :: values(:, :), amplitudes(:, :)
         !> Products at the nodes from the root on, [0:nodes, instants]; that at the root stays as it is
         real(wp), allocatable, intent(inout) :: products(:, :)

         if (size(amplitudes, 2) > 0) call dgemm('N', 'N', size(values, 1), size(amplitudes, 2), mode_count, 1.0_wp, &
            values, size(values, 1), amplitudes, mode_count, 0.0_wp, products(1, 1), size(products, 1))
      end subroutine multiply

   end subroutine fill_shapes

end module exact_motion
