!> Motion of a beam with any number of contacts by Newmark's method, the alternative to exact motion (docs/theory.md,
!> section 10). A step that violates a contact condition is halved until it ends at the event. Rigid supports are fixed
!> exactly.
!>
!> Every state lies at a dyadic fraction of the undivided step. After an event the steps become longer again as fast as
!> this grid allows, so that states fall exactly on the samples. Two states are stored: a trial step overwrites the
!> state that is not the present one, and becomes the present state if it is accepted.
module newmark_motion
   use applied_loads, only: has_loads
   use beam_model, only: beam_model_t, constrain_supports, is_mechanism, moves_freely, complete_model
   use contact_measures, only: open_measures
   use contact_rows, only: band, contact_row_t, row_value
   use failures, only: fail, failure_t, status_bad_input
   use free_modes, only: free_modes_t
   use kinds, only: i8, wp
   use load_settings, only: start_release
   use modal_starts, only: find_rest_in_modes
   use mode_choice, only: common_zeta
   use moment_places, only: open_moments
   use newmark_contacts, only: resolve_contacts
   use newmark_energies, only: total_energy
   use newmark_events, only: close_touched, find_events, trigger_events
   use newmark_flights, only: record_flight_start
   use newmark_limits, only: explain_mesh_error, check_energy_balance, check_mesh, divide_step
   use newmark_loads, only: additional_damping, level_to_jump, pass_jump, prepare_loads
   use newmark_modes, only: make_modal_model
   use newmark_run, only: energy_left, instant_of, is_inactive, level_of, no_rejection, &
      newmark_run_t, whole_step
   use newmark_samples, only: moments_now, start_moments, shapes_in_step, take_sample
   use newmark_start, only: resolve_stored_contacts, start_from_state, state_of, begin_at_contacts, make_start
   use newmark_stepper, only: deepest_level, make_newmark_stepper, solve_mass_for_row
   use newmark_steps, only: account_step, find_violations, observe_step, prepare_level, try_step
   use number_text, only: rounded, to_text
   use response_records, only: open_contact_record, open_records
   use response_types, only: balance_error, response_t
   use run_measures, only: no_rest
   use run_observers, only: finish_observers, observe_events, open_observers
   use run_progress, only: report_progress
   use run_settings, only: count_samples, law_spring_damper, output_settings_t, run_settings_t
   use section_types, only: section_state_t
   use skyline_matrix, only: skyline_t
   use static_states, only: find_static_rest, find_static_start
   use step_intervals, only: open_step_interval
   use stop_contacts, only: active_contacts, has_one_contact, contact_t, contacts_of, datum_of, &
      height_from_rest
   use stop_laws, only: make_compliant_stop
   implicit none (type, external)
   private
   public :: newmark_response, check_newmark

contains

   !> Compute the motion from the start, mostly rest in the static shape of a force at the release contact, to the end
   !> of the run.
   subroutine newmark_response(model, settings, response, error, carried, modes)
      type(beam_model_t), intent(in) :: model
      !> Stops, damping, steps, tolerances, output
      type(run_settings_t), intent(in) :: settings
      !> Receives events and histories
      type(response_t), intent(out) :: response
      !> Set if the run cannot start, an event cannot be located, or rounding violates the energy balance
      type(failure_t), allocatable, intent(out) :: error
      !> The state from which the run continues, if it has one; on return the state at the end
      type(section_state_t), intent(inout), optional :: carried
      !> Modes that are the degrees of freedom of the steps; absent: the degrees of freedom are those of the nodes
      type(free_modes_t), intent(in), optional :: modes

      ! minimum number of samples at which the energy balance is checked, if energies are not recorded
      integer, parameter :: min_checks = 8
      type(newmark_run_t) :: run
      ! number of samples between two checks of the energy balance, of which the last one is at the end of the run
      integer :: check_interval
      ! energy of beam and stops
      real(wp) :: energy
      ! the run continues from the state `carried`
      logical :: is_continued

      call make_run(model, settings, run, error, modes)
      if (allocated(error)) return
      is_continued = .false.
      if (present(carried)) is_continued = allocated(carried%q)
      if (is_continued) call start_from_state(carried, run)
      call open_outputs(model, settings, run, response)
      check_interval = max(1, run%samples/min_checks)
      run%records_shapes = allocated(response%shape_tau)
      run%root_dofs = model%root_dofs
      response%initial_energy = run%start_energy
      if (settings%output%measures) call start_measures(model, settings, run)
      if (run%records_shapes) call shapes_in_step(run, 0.0_wp, response)
      call begin(is_continued, run, response)
      if (.not. allocated(run%error)) call take_sample(run, response)
      do while (run%sample < run%samples .and. .not. allocated(run%error))
         call advance(run, response)
         if (allocated(run%error)) exit
         call observe_events(run%observers, response)
         if (run%begins_flight) call record_flight_start(run, response%event_count)
         if (run%step_in_sample > 0 .or. run%offset > 0_i8) cycle
         call take_sample(run, response)
         call report_progress(real(run%sample, wp), real(run%samples, wp))
         if (.not. run%records_energy_balance .or. modulo(run%samples - run%sample, check_interval) > 0) cycle
         ! the energy of beam and stops must be that which follows from the energy balance
         call total_energy(run, energy)
         call check_energy_balance(instant_of(run), abs(energy - energy_left(run)), run%start_energy &
            + run%energy_balance%created + run%absolute_work, run%error)
      end do
      if (.not. allocated(run%error) .and. allocated(response%energy)) then
         call check_energy_balance(instant_of(run), balance_error(response), run%start_energy &
            + run%energy_balance%created + run%absolute_work, run%error)
      end if
      if (allocated(run%error)) then
         call move_alloc(run%error, error)
         return
      end if
      call finish(run, response)
      if (present(carried)) call state_of(run, carried)
   end subroutine newmark_response

   !> Allocate the requested output.
   subroutine open_outputs(model, settings, run, response)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      !> The run at its start
      type(newmark_run_t), intent(inout) :: run
      type(response_t), intent(inout) :: response

      type(output_settings_t) :: output
      integer :: k, places, samples

      samples = count_samples(settings%response%duration, settings%response%step)
      run%samples = samples
      call open_records(model%mesh%elements, settings%output, settings%response, response, &
         has_loads(settings), run%points)
      call open_moments(model, settings, samples, response)
      call start_moments(model, settings, response, run)
      allocate (response%contacts(size(run%contacts)))
      do k = 1, size(run%contacts)
         associate (contact => run%contacts(k)%contact)
            ! a single contact has the histories of the run; recording them twice would take 7 % of the time
            output = settings%output
            output%history = output%history .and. .not. has_one_contact(settings, size(model%supports))
            call open_contact_record(contact, output, samples + 1, response%contacts(contact%number))
         end associate
      end do
      run%records_energy_balance = allocated(response%energy) .or. settings%output%measures &
         .or. allocated(settings%statistics)
      call open_observers(settings, run%contacts%contact%number, [(allocated(run%contacts(k)%stop), &
         k=1, size(run%contacts))], run%release_contact, response, run%observers)
      if (allocated(run%observers%blocks)) run%observers%blocks%hop_tolerance = run%hop_height
      places = 0
      if (allocated(run%place_weights)) places = size(response%moments)
      run%observes = settings%output%measures .or. allocated(settings%statistics) .or. allocated(settings%poincare) &
         .or. allocated(settings%spectrum)
      call open_step_interval(size(run%contacts), places, run%interval, run%points%origin)
   end subroutine open_outputs

   !> Close the contacts of the first instant, and pass its events to the observers.
   subroutine begin(is_continued, run, response)
      !> Whether the run continues from the final state of another
      logical, intent(in) :: is_continued
      type(newmark_run_t), intent(inout) :: run
      type(response_t), intent(inout) :: response

      if (is_continued) then
         call resolve_stored_contacts(run, response)
      else
         call begin_at_contacts(run, response)
      end if
      call observe_events(run%observers, response)
      if (run%begins_flight) call record_flight_start(run, response%event_count)
   end subroutine begin

   !> Store the final values and the results of the observers in the response.
   subroutine finish(run, response)
      type(newmark_run_t), intent(inout) :: run
      type(response_t), intent(inout) :: response

      response%factorisations = run%stepper%factorisations
      associate (balance => run%energy_balance, measures => run%observers%measures)
         if (measures%is_wanted) measures%of(run%release_contact)%measures%final_energy = energy_left(run)
         call finish_observers(run%observers, instant_of(run), [balance%dissipated_beam, balance%dissipated_stop, &
            balance%dissipated_impact], balance%created, run%contacts%contact%number, response)
      end associate
   end subroutine finish

   !> Check whether a run can start, as far as is known without running it.
   subroutine check_newmark(model, settings, error, modes)
      type(beam_model_t), intent(in) :: model
      !> Stops, damping, steps, tolerances, output
      type(run_settings_t), intent(in) :: settings
      !> Set if the run cannot start
      type(failure_t), allocatable, intent(out) :: error
      !> Modes that are the degrees of freedom of the steps; absent: the degrees of freedom are those of the nodes
      type(free_modes_t), intent(in), optional :: modes

      type(newmark_run_t) :: run

      call make_run(model, settings, run, error, modes)
   end subroutine check_newmark

   !> Check the step and the contacts, and make the stepper, the stops and the initial state.
   subroutine make_run(model, settings, run, error, modes)
      type(beam_model_t), intent(in) :: model
      !> Stops, damping, steps, tolerances, output
      type(run_settings_t), intent(in) :: settings
      !> The run at its start
      type(newmark_run_t), intent(out) :: run
      !> Set if the step is too long for the scheme, or the beam cannot start with these contacts
      type(failure_t), allocatable, intent(out) :: error
      !> Modes that are the degrees of freedom of the steps
      type(free_modes_t), intent(in), optional :: modes

      ! the model of the run; the same with rigid supports fixed, or in modes
      type(beam_model_t) :: whole, supported
      type(contact_t), allocatable :: contacts(:)
      type(skyline_t), allocatable :: damping
      real(wp), allocatable :: point_shape(:, :), shape(:)

      run%sample_step = settings%response%step
      run%contact_tolerance = settings%response%contact_tolerance
      run%release_force = settings%response%release_tolerance/settings%height_ratio
      run%hop_height = max(settings%response%hop_tolerance, settings%response%contact_tolerance)
      run%event_limit = settings%response%event_limit
      run%height_ratio = settings%height_ratio
      contacts = contacts_of(settings)
      if (settings%start%kind == start_release) call find_static_start(model, contacts, shape, error)
      if (allocated(error)) return
      run%release_contact = findloc(contacts%is_release_contact, .true., dim=1)
      whole = model
      call complete_model(settings, whole)
      if (run%release_contact > 0) then
         whole%stop_dof = whole%stop_dofs(contacts(run%release_contact)%stop)
         run%height = datum_of(contacts(run%release_contact))
      end if
      if (present(modes)) then
         run%modes = modes
         call make_modal_model(whole, modes, supported, point_shape)
      else
         supported = constrain_supports(model)
         ! this check is of the mesh alone, and before `additional_damping`, which may extend the matrices to the full
         ! profile
         call check_mesh(supported, error)
         if (allocated(error)) then
            if (error%status /= status_bad_input) call explain_mesh_error(error)
            return
         end if
         call complete_model(settings, supported)
         supported%stop_dof = whole%stop_dof
      end if
      run%points = supported%points
      ! a degree of freedom with a damping rate of its own may have little damping
      call divide_step(supported, merge(0.0_wp, settings%zeta, allocated(whole%own_rate)), settings%response, &
         run%steps_per_sample, error)
      if (allocated(error)) return
      call prepare_loads(whole, settings, run)
      call additional_damping(settings, whole, supported, run%modes, damping, error)
      if (allocated(error)) return
      call make_newmark_stepper(supported, common_zeta(settings), settings%response%newmark_beta, &
         settings%response%newmark_gamma, settings%response%step/real(run%steps_per_sample, wp), run%stepper, error, &
         damping, point_shape)
      if (.not. allocated(error)) call make_start(whole, supported, settings, contacts, shape, run, error)
      if (allocated(error)) then
         if (error%status /= status_bad_input) call explain_mesh_error(error)
         return
      end if
      run%states(2) = run%states(1)
      call make_contacts(supported, contacts, run, error)
      if (allocated(error)) return
      call total_energy(run, run%start_energy)
   end subroutine make_run

   !> Prepare the contacts of the run.
   subroutine make_contacts(supported, contacts, run, error)
      !> The model in the degrees of freedom of the steps
      type(beam_model_t), intent(in) :: supported
      type(contact_t), intent(in) :: contacts(:)
      !> Receives the contacts
      type(newmark_run_t), intent(inout) :: run
      !> Set if the contact tolerance is too wide for two opposite contacts
      type(failure_t), allocatable, intent(out) :: error

      integer :: j, k, n
      logical :: is_active(size(contacts))

      n = size(contacts)
      allocate (run%contacts(n), run%mass_columns(1 - band:run%stepper%length + band, n), run%mobility(n, n), &
         run%closed(n), run%rows(n, n), run%right(n), run%violates(n), run%event_ahead(n), run%arrives(n), &
         run%leaves(n))
      run%event_ahead = .false.
      run%leaves = .false.
      is_active = active_contacts(contacts, supported%stop_dofs(contacts%stop))
      do k = 1, n
         associate (contact => run%contacts(k))
            contact%contact = contacts(k)
            contact%row = contact_row_t(supported%stop_dofs(contacts(k)%stop), contacts(k)%sign, &
               supported%partner_dofs(contacts(k)%stop))
            if (.not. is_active(k)) contact%status = is_inactive
            call make_compliant_stop(contacts(k)%settings, contact%stop)
            run%has_compliant_stop = run%has_compliant_stop .or. allocated(contact%stop)
            contact%is_viscous = contacts(k)%settings%law == law_spring_damper
            call check_contact(run, k, error)
            if (allocated(error)) return
            call solve_mass_for_row(run%stepper, contact%row, run%mass_columns(:, k))
         end associate
      end do
      do k = 1, n
         run%mobility(:, k) = [(row_value(run%contacts(j)%row, run%mass_columns(:, k)), j=1, n)]
         associate (contact => run%contacts(k))
            if (.not. allocated(contact%stop)) cycle
            ! the first step in contact is no longer than the time constant of the contact force
            if (contact%stop%viscosity > 0.0_wp) then
               contact%contact_level = level_of(run%stepper%step, 1.0_wp/(contact%stop%viscosity*run%mobility(k, k)))
            else if (contact%stop%branch_stiffness > 0.0_wp .and. contact%stop%relaxation_rate > 0.0_wp) then
               contact%contact_level = level_of(run%stepper%step, 1.0_wp/contact%stop%relaxation_rate)
            end if
         end associate
      end do
   end subroutine make_contacts

   !> Check that the tolerances of a contact and of an opposite contact at the same point do not overlap.
   pure subroutine check_contact(run, k, error)
      !> The run, with all contacts up to this contact
      type(newmark_run_t), intent(in) :: run
      !> Index of the contact
      integer, intent(in) :: k
      !> Set if the contact tolerance is too wide for their clearance
      type(failure_t), allocatable, intent(out) :: error

      integer :: j
      ! distance between the two contact surfaces
      real(wp) :: clearance

      associate (contact => run%contacts(k))
         do j = 1, k - 1
            associate (other => run%contacts(j))
               if (other%row%dof /= contact%row%dof .or. other%row%partner /= contact%row%partner .or. &
                  other%row%sign*contact%row%sign > 0.0_wp) cycle
               clearance = -(other%contact%height + contact%contact%height)
               if (clearance > 2.0_wp*run%contact_tolerance) cycle
               call fail(error, status_bad_input, 'contact_tolerance '//to_text(run%contact_tolerance)// &
                  ' must be below half the clearance at '//to_text(contact%contact%settings%position)//', which is '// &
                  rounded(clearance)//' of the distance that the beam was pulled')
               return
            end associate
         end do
      end associate
   end subroutine check_contact

   !> Take one accepted step and process the events at its end; if even the shortest step violates a contact condition,
   !> process the events at the present state instead.
   subroutine advance(run, response)
      type(newmark_run_t), intent(inout) :: run
      !> Receives events and counters
      type(response_t), intent(inout) :: response

      ! number of halvings of the step
      integer :: level
      ! length of the step in units of the shortest step
      integer(i8) :: span
      ! a contact has closed at the beginning of the step
      logical :: has_closed
      ! a jump of a load lies at the end of the step
      logical :: has_passed
      ! the step violates no contact condition
      logical :: is_accepted
      ! at the beginning of the step: energy, instant (`from`); moments at both ends, [places, 2]; length of the step
      real(wp) :: energy, from, moments(run%interval%places, 2), step

      from = instant_of(run)
      if (allocated(run%place_weights)) moments(:, 1) = moments_now(run)
      level = run%next_level
      run%next_level = 0
      ! every step begins at a multiple of its own length
      if (run%offset > 0_i8) level = max(level, deepest_level - trailz(run%offset))
      if (run%next_jump <= size(run%jumps)) level = level_to_jump(run, level)
      do
         if (.not. run%factors(level)%made) then
            call prepare_level(run, level)
            if (allocated(run%error)) return
         end if
         span = shiftr(whole_step, level)
         call try_step(run, level)
         response%evaluations = response%evaluations + 1_i8
         call close_touched(run, response, has_closed)
         if (has_closed) return
         call find_violations(run, level, is_accepted)
         if (is_accepted) exit
         response%rejected = response%rejected + 1_i8
         run%has_event_ahead = .true.
         where (run%violates) run%contacts%rejected_end = run%offset + span
         if (level == deepest_level) then
            call trigger_events(run, response)
            return
         end if
         level = level + 1
      end do

      run%now = 3 - run%now
      run%offset = run%offset + span
      if (run%has_event_ahead) then
         run%event_ahead = run%offset < run%contacts%rejected_end
         where (.not. run%event_ahead) run%contacts%rejected_end = no_rejection
         run%has_event_ahead = any(run%event_ahead)
      end if
      if (run%offset == whole_step) then
         run%offset = 0_i8
         run%step_in_sample = run%step_in_sample + 1
         if (run%step_in_sample == run%steps_per_sample) then
            run%step_in_sample = 0
            run%sample = run%sample + 1
         end if
      end if
      step = run%stepper%factors(level)%step
      energy = energy_left(run)
      if (run%records_energy_balance) call account_step(run, step)
      if (run%observes) then
         if (allocated(run%place_weights)) moments(:, 2) = moments_now(run)
         call observe_step(run, from, step, [energy, energy_left(run)], moments)
      end if
      if (run%records_shapes) call shapes_in_step(run, step, response)
      call find_events(run, step, response)
      if (allocated(run%error)) return
      if (run%next_jump <= size(run%jumps)) then
         call pass_jump(run, has_passed)
         if (has_passed) call resolve_contacts(run, response)
      end if
   end subroutine advance

   !> Prepare the measures of each contact, which refer to the contact forces and the energy at static equilibrium.
   subroutine start_measures(model, settings, run)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      type(newmark_run_t), intent(inout) :: run

      ! the model of the run
      type(beam_model_t) :: whole
      ! contact forces at static equilibrium
      real(wp) :: forces(size(run%contacts))
      ! energy at static equilibrium; `no_rest`: loads or rigid-body motion prevent equilibrium
      real(wp) :: energy
      integer :: k

      forces = 0.0_wp
      energy = no_rest
      if (run%loads%count == 0 .and. .not. is_mechanism(model)) then
         whole = model
         call complete_model(settings, whole)
         if (moves_freely(whole)) then
            ! a mass without spring is at rest only if no contact presses
            if (.not. any(height_from_rest(run%contacts%contact) > 0.0_wp)) energy = 0.0_wp
         else if (allocated(run%modes)) then
            call find_rest_in_modes(run%beam, run%contacts%contact, run%contacts%status /= is_inactive, forces, energy)
         else
            call find_static_rest(whole, run%contacts%contact, forces, energy)
         end if
      end if
      call open_measures(settings, run%release_contact, [(allocated(run%contacts(k)%stop), k=1, size(forces))], &
         run%start_energy, forces, energy, run%observers%measures)
   end subroutine start_measures

end module newmark_motion
