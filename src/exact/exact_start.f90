!> Start and end of an exact run with any number of contacts: beam, loads and contacts in the free modes, initial state,
!> opening of observers and records; at the end, records, measures and energy balance of the run.
module exact_start
   use applied_loads, only: are_mergeable, gather_loads, has_loads, merge_loads
   use beam_model, only: beam_model_t, is_mechanism
   use constrained_sets, only: displacement_t, free_beam_t
   use contact_changes, only: find_opposite_contacts
   use contact_measures, only: open_measures
   use contact_phase, only: contact_phase_t
   use contact_sets, only: set_store_t
   use contact_states, only: energy_in, make_contact_state, has_rigid_stop, add_massless_node, contact_state_t
   use contact_values, only: gap_to_undeformed
   use damped_oscillators, only: make_oscillators
   use failures, only: failure_t
   use free_modes, only: free_modes_t, max_rigid_square
   use kinds, only: wp
   use load_courses, only: value_at
   use modal_starts, only: find_modal_start, find_rest_in_modes, modal_beam_t
   use mode_choice, only: common_zeta, damps_each_mode
   use moment_signals, only: make_moments
   use motion_phases, only: motion_t
   use phase_state, only: find_load, open_set_store, phase_state_t
   use phase_transitions, only: begin_contacts_at_start, update_contacts
   use response_records, only: open_contact_record
   use response_types, only: response_t
   use run_measures, only: no_rest
   use run_observers, only: finish_observers, observe_events, open_observers
   use run_recorder, only: energy_balance_t
   use run_settings, only: impulse_nodal, run_settings_t
   use section_states, only: restore_state
   use section_types, only: run_sections_t
   use stop_contacts, only: active_contacts, contact_t, contacts_of, shape_of_contact, observed_height, &
      height_from_rest
   use tangent_columns, only: allocate_tangent, tangent_t
   implicit none (type, external)
   private
   public :: start_exact, finish_exact

contains

   !> Start a run from the initial state given by the settings.
   subroutine start_exact(model, modes, settings, samples, sets, phase, motion, response, error)
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(in) :: modes
      type(run_settings_t), intent(in) :: settings
      !> Number of samples after the initial one
      integer, intent(in) :: samples
      !> Contact sets cached by this run and earlier runs; a set is the beam with given closed contacts
      type(set_store_t), target, intent(inout) :: sets
      type(contact_phase_t), intent(inout) :: phase
      !> Motion with an open recorder; receives the initial state
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response
      !> Set if the beam penetrates a contact, no contact supports the beam, or there are more rigid stops than modes
      type(failure_t), allocatable, intent(out) :: error

      type(contact_t), allocatable :: contacts(:)
      type(modal_beam_t) :: modal
      ! energy in the static equilibrium in which the motion may come to rest
      real(wp) :: static_energy
      ! contact forces P in this equilibrium, [contacts]
      real(wp), allocatable :: static_force(:)
      ! whether no other rigid contact at the same point and on the same side is in front of the contact
      ! (docs/theory.md, section 17)
      logical, allocatable :: is_active(:)
      integer :: k

      allocate (contacts, source=contacts_of(settings))
      allocate (is_active, source=active_contacts(contacts, model%stop_dofs(contacts%stop)))
      allocate (static_force(size(contacts)), source=0.0_wp)
      associate (beam => phase%now%beam, now => phase%now)
         now%release_contact = findloc(contacts%is_release_contact, .true., dim=1)
         call make_beam(model, modes, settings, contacts, beam)
         if (has_loads(settings)) call set_up_loads(model, modes, settings, now)
         if (allocated(response%moments)) call make_moments(model, modes, settings, contacts, now%loads, &
            phase%interval%moments)
         allocate (now%states(size(contacts)), phase%interval%searches(size(contacts)), phase%records(size(contacts)))
         do k = 1, size(contacts)
            call make_contact_state(contacts(k), now%states(k))
            if (modes%node_flexibility > 0.0_wp) call add_massless_node(now%states(k), modes%node_flexibility, &
               beam%oscillators%two_zeta)
         end do
         modal%row = beam%value
         modal%square = beam%oscillators%square
         modal%node_flexibility = modes%node_flexibility
         static_energy = no_rest
         if (.not. (now%loads%count > 0 .or. is_mechanism(model))) call find_equilibrium(modal, contacts, is_active, &
            static_force, static_energy)
         if (is_continued(phase)) then
            allocate (motion%q, source=phase%carried%q)
            allocate (motion%v, source=phase%carried%v)
            call restore_state(phase%carried, now)
            allocate (response%starts_closed(size(contacts)))
            response%starts_closed(contacts%number) = phase%carried%is_closed
         else
            call set_initial_state(model, modes, settings, modal, now, motion, error)
            if (allocated(error)) return
         end if
         response%initial_energy = 0.5_wp*sum(beam%oscillators%square*motion%q**2 + motion%v**2) &
            + sum([(energy_in(now%states(k)), k=1, size(contacts))])
         call open_measures(settings, now%release_contact, .not. has_rigid_stop(now%states), response%initial_energy, &
            static_force, static_energy, motion%observers%measures)
         do k = 1, size(contacts)
            if (now%states(k)%is_node) call release_node(gap_to_undeformed(now, k, motion%q), now%states(k), &
               motion%recorder%energy_balance)
            ! without loads, a contact is inactive also if the initial energy E cannot deflect the beam by -height, to
            ! its surface: the maximum deflection is sqrt(2 E flexibility); 1.001 is a margin
            now%states(k)%is_active = is_active(k) .and. (now%loads%count > 0 .or. -beam%height(k) <= 1.001_wp &
               *sqrt(2.0_wp*response%initial_energy*(sum(beam%value(:, k)**2/beam%oscillators%square) &
               + modal%node_flexibility)))
            call open_contact_record(contacts(k), settings%output, samples + 1, phase%records(k))
         end do
         call open_set_store(now, sets)
         phase%force_scale = settings%height_ratio
         phase%hop_tolerance = settings%response%hop_tolerance
      end associate
      call start_motion(settings, phase, motion, response)
   end subroutine start_exact

   !> Open the observers, and find opposite contacts and contacts that are closed at the start.
   subroutine start_motion(settings, phase, motion, response)
      type(run_settings_t), intent(in) :: settings
      type(contact_phase_t), intent(inout) :: phase
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      call find_opposite_contacts(phase%now)
      call open_observers(settings, phase%now%states%contact%number, .not. phase%now%states%is_rigid, &
         phase%now%release_contact, response, motion%observers, size(motion%q))
      if (allocated(settings%poincare)) then
         if (settings%poincare%wants_exponent .and. .not. allocated(motion%tangent)) call start_variation(phase%now, &
            motion%observers%sections, motion%tangent)
      end if
      if (is_continued(phase)) then
         call update_contacts(phase%now, motion, response)
      else
         call begin_contacts_at_start(phase%now, settings%response%hop_tolerance, motion, response)
      end if
      call observe_events(motion%observers, response)
   end subroutine start_motion

   !> Whether the run continues an earlier motion.
   pure logical function is_continued(phase)
      type(contact_phase_t), intent(in) :: phase

      is_continued = .false.
      if (allocated(phase%carried)) is_continued = allocated(phase%carried%q)
   end function is_continued

   !> Set the initial state given by the settings, with the contacts that support the beam.
   subroutine set_initial_state(model, modes, settings, modal, now, motion, error)
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(in) :: modes
      type(run_settings_t), intent(in) :: settings
      !> The beam in the modes
      type(modal_beam_t), intent(in) :: modal
      type(phase_state_t), intent(inout) :: now
      !> Receives the initial state
      type(motion_t), intent(inout) :: motion
      !> Set if the beam penetrates a contact, no contact supports the beam, or there are more rigid stops than modes
      type(failure_t), allocatable, intent(inout) :: error

      real(wp) :: forces(size(now%states))
      integer :: k

      allocate (motion%q(size(modal%square)), source=0.0_wp)
      allocate (motion%v(size(modal%square)))
      if (now%loads%count > 0) motion%q(:) = matmul(now%loads%mode, value_at(now%loads%course, 0.0_wp))
      call find_modal_start(model, modes, settings, modal, now%states%contact, motion%q, motion%v, forces, error)
      if (allocated(error)) return
      do k = 1, size(forces)
         associate (state => now%states(k))
            ! until `begin_contacts_at_start`, which closes these contacts, `is_deformed` marks any contact with a
            ! force, also a rigid one
            state%is_deformed = forces(k) > 0.0_wp
            if (forces(k) > 0.0_wp .and. .not. state%is_rigid) state%indentation = forces(k)/state%spring%stiffness
            ! before the release, the stop point has eta = 1, which is a displacement of 1 + h. The force that holds it
            ! so, F = (1 + h)/(flexibility of modes + flexibility of node), displaces the node relative to the modes by
            ! F times the flexibility of the node
            if (state%is_node) state%indentation = modal%node_flexibility*(1.0_wp + now%beam%height(k)) &
               /(sum(modal%row(:, k)**2/modal%square) + modal%node_flexibility)
         end associate
      end do
   end subroutine set_initial_state

   !> Move an undamped massless node at once to the displacement of the modes, or onto the stop.
   pure subroutine release_node(gap, state, balance)
      !> Distance of the modal displacement of the stop point from the stop, negative below it
      real(wp), intent(in) :: gap
      type(contact_state_t), intent(inout) :: state
      !> Energy balance of the run, which receives the energy released by the node as dissipated in the beam
      type(energy_balance_t), intent(inout) :: balance

      real(wp) :: before

      ! a damped node relaxes at a finite rate
      if (state%spring%recovery_rate < huge(1.0_wp)) return
      before = energy_in(state)
      state%indentation = max(0.0_wp, -gap)
      state%is_deformed = state%indentation > 0.0_wp
      balance%dissipated_beam = balance%dissipated_beam + (before - energy_in(state))
   end subroutine release_node

   !> Start one variation of the state, whose growth between the Poincare sections gives the Lyapunov exponent.
   subroutine start_variation(now, sections, tangent)
      type(phase_state_t), intent(in) :: now
      type(run_sections_t), intent(inout) :: sections
      type(tangent_t), allocatable, intent(out) :: tangent

      allocate (sections%log_norm(size(sections%tau)), source=0.0_wp)
      allocate (tangent)
      associate (square => now%beam%oscillators%square)
         call allocate_tangent(size(square), size(now%states), 1, tangent)
         ! any start in which all modes take part serves; here all modes with a restoring force have the same energy
         tangent%q(:, 1) = 1.0_wp/sqrt(merge(1.0_wp, square, square <= max_rigid_square))
         tangent%v(:, 1) = 0.5_wp
      end associate
   end subroutine start_variation

   !> Set up the applied loads in the free modes.
   subroutine set_up_loads(model, modes, settings, now)
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(in) :: modes
      type(run_settings_t), intent(in) :: settings
      type(phase_state_t), intent(inout) :: now

      call gather_loads(model, settings, now%loads)
      if (are_mergeable(settings)) call merge_loads(now%loads)
      allocate (now%loads%mode, source=matmul(transpose(modes%mode), now%loads%vector))
      allocate (now%load(size(modes%square)), now%load_rate(size(modes%square)))
      call find_load(now, 0.0_wp)
   end subroutine set_up_loads

   !> Set up the beam and its contacts in the free modes.
   pure subroutine make_beam(model, modes, settings, contacts, beam)
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(in) :: modes
      type(run_settings_t), intent(in) :: settings
      type(contact_t), intent(in) :: contacts(:)
      type(free_beam_t), intent(out) :: beam

      integer :: k

      beam%has_modal_damping = damps_each_mode(settings, modes)
      call make_oscillators(modes%square, common_zeta(settings), beam%oscillators, modes%rate)
      associate (point => model%points)
         beam%displacement = [(displacement_t(maxloc(modes%mode(point(k)%dof, :), dim=1), &
            maxval(modes%mode(point(k)%dof, :)), point(k)%origin), k=1, size(point))]
      end associate
      if (settings%stop%impulse == impulse_nodal) then
         ! the velocity of mode i after a unit velocity of the node alone is phi_i . M e_c, because modes have unit mass
         allocate (beam%nodal_shape, source=modes%nodal_mass(:size(modes%square)))
      end if
      allocate (beam%value(size(modes%square), size(contacts)))
      allocate (beam%height(size(contacts)), beam%observed_height(size(contacts)))
      beam%height(:) = contacts%height
      beam%observed_height(:) = observed_height(contacts)
      allocate (beam%tip_value, source=modes%mode(modes%tip_dof, :))
      allocate (beam%tip_sign(size(contacts)), source=0.0_wp)
      do k = 1, size(contacts)
         associate (dof => model%stop_dofs(contacts(k)%stop))
            beam%value(:, k) = shape_of_contact(contacts(k), model, modes%mode)
            if (dof == modes%tip_dof .and. contacts(k)%is_fixed) beam%tip_sign(k) = contacts(k)%sign
         end associate
      end do
   end subroutine make_beam

   !> Static equilibrium without loads: contact forces and energy, in the modes of the motion. The caller excludes beams
   !> that turn freely about the root, whose motion need not come to rest. With masses without springs, equilibrium is
   !> known only if no contact is preloaded (height > 0); it is then the undeformed state.
   pure subroutine find_equilibrium(modal, contacts, is_active, force, energy)
      type(modal_beam_t), intent(in) :: modal
      type(contact_t), intent(in) :: contacts(:)
      !> Whether each contact is active, [contacts]
      logical, intent(in) :: is_active(:)
      !> Contact forces P, [contacts]
      real(wp), intent(out) :: force(:)
      !> Energy of beam and stops
      real(wp), intent(out) :: energy

      if (any(modal%square <= max_rigid_square)) then
         force = 0.0_wp
         energy = merge(no_rest, 0.0_wp, any(height_from_rest(contacts) > 0.0_wp))
      else
         call find_rest_in_modes(modal, contacts, is_active, force, energy)
      end if
   end subroutine find_equilibrium

   !> Store contact records and measures in the response, contacts in the order of the input file.
   subroutine finish_exact(settings, phase, motion, response)
      type(run_settings_t), intent(in) :: settings
      type(contact_phase_t), intent(inout) :: phase
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      real(wp) :: lost_beam, lost_stop
      integer :: k

      allocate (response%contacts(size(phase%records)))
      do k = 1, size(phase%records)
         response%contacts(phase%now%states(k)%contact%number) = phase%records(k)
      end do
      lost_stop = sum(phase%now%states%dissipated)
      associate (balance => motion%recorder%energy_balance, measures => motion%observers%measures)
         ! dissipation in the beam is the remainder of the energy balance, because phases compute it only if energies
         ! are requested
         lost_beam = response%initial_energy + balance%work + balance%created - balance%dissipated_impact - lost_stop &
            - measures%of(measures%release_contact)%measures%final_energy
         call finish_observers(motion%observers, settings%response%duration, [lost_beam, lost_stop, &
            balance%dissipated_impact], balance%created, phase%now%states%contact%number, response)
      end associate
   end subroutine finish_exact

end module exact_start
