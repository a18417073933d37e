!> The response in closed form between events: free modes of the beam, then model A or B of the stop.
module exact_motion
   use applied_loads, only: has_loads
   use beam_model, only: beam_model_t
   use contact_phase, only: contact_phase_t
   use contact_sets, only: set_store_t
   use exact_start, only: finish_exact, start_exact
   use failures, only: failure_t
   use few_modes, only: find_base_modes, find_few_modes, keeps_all_modes, number_of_modes, takes_few_modes
   use free_modes, only: find_free_modes, free_modes_t
   use kinds, only: wp
   use mode_choice, only: first_count, largest_untried, most_count, next_count, take_modes
   use mode_trials, only: add_trial, can_afford, is_driven, judge_trials, most_stalled, open_trials, settle_length, &
      shorten, trials_t
   use moment_places, only: open_moments
   use motion_phases, only: advance, motion_t
   use response_records, only: open_records
   use response_types, only: mode_check_t, response_t
   use run_recorder, only: make_recorder, recorder_t
   use run_settings, only: count_samples, run_settings_t
   use section_types, only: section_state_t
   implicit none (type, external)
   private
   public :: exact_response, choose_modes, unknown

   !> Number of modes of a run that goes on from no other.
   integer, parameter :: unknown = -1

   !> A run to compare.
   type :: trial_t
      !> Number of the lowest modes; these, and residual modes
      integer :: count = 0
      type(free_modes_t) :: modes
      type(response_t) :: response
      !> It was made; not if it would cost too much, or fails
      logical :: is_done = .false.
   end type trial_t

contains

   !> Run in the modes that the accuracy asks for.
   subroutine exact_response(model, settings, response, error, shared, sets, carried)
      type(beam_model_t), intent(in) :: model
      !> Stop, damping, samples, tolerances, output
      type(run_settings_t), intent(in) :: settings
      !> Events and histories
      type(response_t), intent(out) :: response
      !> Set when the modes cannot be found or the run fails
      type(failure_t), allocatable, intent(out) :: error
      !> From `find_base_modes`, found beforehand for many runs; where they are absent or empty the run finds its own
      type(free_modes_t), target, intent(in), optional :: shared
      !> Sets of closed surfaces that the runs before made, for this one and those to come
      type(set_store_t), target, intent(inout), optional :: sets
      !> The motion that the run takes over, if it has a state; then that at its end
      type(section_state_t), intent(inout), optional :: carried

      type(free_modes_t), target :: own
      type(free_modes_t), allocatable :: chosen
      type(free_modes_t), pointer :: base
      type(mode_check_t) :: check
      type(set_store_t), target :: own_sets
      type(set_store_t), pointer :: kept
      integer :: lowest

      kept => own_sets
      if (present(sets)) kept => sets
      base => own
      if (present(shared)) then
         if (allocated(shared%lambda)) base => shared
      end if
      if (.not. allocated(base%lambda)) then
         call find_base_modes(model, settings, own, error)
         if (allocated(error)) return
      end if
      lowest = unknown
      if (present(carried)) then
         if (allocated(carried%q)) lowest = carried%lowest_modes
      end if
      call choose_modes(model, settings, base, chosen, lowest, check, error)
      if (allocated(error)) return
      if (allocated(chosen)) then
         call run_in_modes(model, chosen, check%kept, settings, kept, response, error, carried)
      else
         call run_in_modes(model, base, check%kept, settings, kept, response, error, carried)
      end if
      if (present(carried)) carried%lowest_modes = lowest
      response%mode_check = check
      response%evaluations = response%evaluations + check%evaluations
      if (associated(base, own)) response%factorisations = response%factorisations + 1
   end subroutine exact_response

   !> The modes of a run: the fewest that a comparison with more shows to suffice.
   !>
   !> They are some of the lowest, and residual modes, with which stops and loads find the beam as yielding as it is.
   !> What is left out then is the inertia of the others. How much that matters nobody knows before the run: so the
   !> motion in some modes is compared with that in more, and if both agree well within the accuracy that in fewer is
   !> good enough. Where trials would cost more than they can save, or never agree, all modes are taken.
   subroutine choose_modes(model, settings, base, modes, lowest, check, error)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      !> From `find_base_modes`
      type(free_modes_t), intent(in) :: base
      !> Unallocated: those of the base
      type(free_modes_t), allocatable, intent(out) :: modes
      !> Of a run that goes on from another so many of the lowest modes as that had, else `unknown`; then those found,
      !> 0: all
      integer, intent(inout) :: lowest
      !> How many, and how that was found
      type(mode_check_t), intent(out) :: check
      !> Set when they cannot be found
      type(failure_t), allocatable, intent(out) :: error

      check%all_modes = number_of_modes(model)
      if (settings%response%mode_count > 0) then
         lowest = 0
         check%kept = min(check%all_modes, settings%response%mode_count)
         if (check%kept <= size(base%lambda) .and. .not. takes_few_modes(model%mesh%elements, settings)) return
         ! moments take the static share of what is left out from the residual modes
         allocate (modes)
         call find_few_modes(model, settings, check%kept, modes, error, base)
         return
      end if
      if (lowest == unknown) then
         lowest = 0
         if (check%all_modes > largest_untried .and. .not. (keeps_all_modes(settings) .or. has_stiff_node(base))) then
            call try_numbers(model, settings, base, modes, lowest, check, error)
         end if
      else if (lowest > 0) then
         allocate (modes)
         call find_few_modes(model, settings, lowest, modes, error, base)
      end if
      if (allocated(error)) return
      if (lowest == 0 .and. size(base%lambda) < check%all_modes .and. &
         takes_few_modes(model%mesh%elements, settings)) then
         call take_most(model, settings, base, modes, lowest, error)
         if (allocated(error)) return
      end if
      check%kept = size(base%lambda)
      if (allocated(modes)) check%kept = size(modes%lambda)
      check%goes_on = is_driven(settings) .and. settings%has_stop .and. check%horizon < settings%response%duration
   end subroutine choose_modes

   !> Is the beam before a node without mass so stiff that only the highest modes of the mesh go with it? Lower ones
   !> alone would see it as rigid, and rounding as energy.
   pure function has_stiff_node(modes) result(answer)
      type(free_modes_t), intent(in) :: modes
      logical :: answer

      real(wp), parameter :: least_flexibility = 1.0e-20_wp

      answer = modes%node_flexibility > 0.0_wp .and. modes%node_flexibility < least_flexibility
   end function has_stiff_node

   !> Of a mesh of which not all modes were found, no number of which suffices: all, or as many as are ever taken.
   subroutine take_most(model, settings, base, modes, lowest, error)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      type(free_modes_t), intent(in) :: base
      type(free_modes_t), allocatable, intent(out) :: modes
      !> 0: all
      integer, intent(out) :: lowest
      type(failure_t), allocatable, intent(out) :: error

      allocate (modes)
      lowest = 0
      if (number_of_modes(model) <= 2*most_count) then
         call find_free_modes(model, modes, error)
      else
         lowest = most_count
         call find_few_modes(model, settings, lowest, modes, error, base)
      end if
   end subroutine take_most

   !> Trials of more and more modes, until two agree or no more can be afforded.
   subroutine try_numbers(model, settings, base, modes, lowest, check, error)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      type(free_modes_t), intent(in) :: base
      !> Those of the smaller of two sets that agree; unallocated: none do
      type(free_modes_t), allocatable, intent(out) :: modes
      !> How many of the lowest modes these have; 0: none do
      integer, intent(out) :: lowest
      !> What the trials found
      type(mode_check_t), intent(inout) :: check
      !> Set when modes cannot be found
      type(failure_t), allocatable, intent(out) :: error

      type(trial_t), allocatable :: fewer, more, enough
      type(trials_t) :: trials
      type(mode_check_t) :: early, of_enough
      integer :: count

      lowest = 0
      call open_trials(settings, base, check%all_modes, trials)
      count = first_count(settings, base)
      do while (count <= most_count)
         allocate (more)
         more%count = count
         call find_few_modes(model, settings, count, more%modes, error, base)
         if (allocated(error)) return
         call try_modes(model, more, trials, check)
         if (.not. more%is_done) exit
         if (allocated(fewer)) then
            check%compared = size(more%modes%lambda)
            call judge_trials(trials, fewer%response, more%response, check, early)
            if (check%agrees) early = check
            ! what agrees for the first contacts alone serves if no more do longer
            if (check%agrees .or. (early%agrees .and. .not. allocated(enough))) then
               of_enough = early
               call move_alloc(fewer, enough)
            end if
            if (check%agrees .or. trials%stalled >= most_stalled) exit
         end if
         call move_alloc(more, fewer)
         count = next_count(count)
      end do
      if (.not. allocated(enough)) return
      of_enough%evaluations = check%evaluations
      of_enough%work = check%work
      check = of_enough
      lowest = enough%count
      allocate (modes, source=enough%modes)
   end subroutine try_numbers

   !> A run to compare; the first is made again until it is long enough.
   subroutine try_modes(model, trial, trials, check)
      type(beam_model_t), intent(in) :: model
      !> Gets its response
      type(trial_t), intent(inout) :: trial
      type(trials_t), intent(inout) :: trials
      !> Gets what it took
      type(mode_check_t), intent(inout) :: check

      type(set_store_t), target :: sets
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
               ! why it fails the run itself tells
               call shorten(trials, trial%response, is_shorter)
               if (.not. is_shorter) return
               cycle
            end if
            if (.not. trials%is_settled) call settle_length(trials, number, trial%response)
            trial%is_done = trials%is_settled
         end associate
      end do
   end subroutine try_modes

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
         call run_among_contacts(model, modes, settings, sets, response, error, carried)
      else
         few = modes
         ours = settings
         call take_modes(kept, few, ours)
         call run_among_contacts(model, few, ours, sets, response, error, carried)
      end if
   end subroutine run_in_modes

   !> Any number of stops, with all modes.
   subroutine run_among_contacts(model, modes, settings, sets, response, error, carried)
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
      if (phase%now%release_contact > 0) then
         associate (state => phase%now%states(phase%now%release_contact))
            call fill_shapes(modes, state%contact%sign*state%contact%height, motion%recorder, response)
         end associate
      else
         call fill_shapes(modes, 0.0_wp, motion%recorder, response)
      end if
   end subroutine run_among_contacts

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
