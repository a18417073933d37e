!> Runs: computes the motion of a beam by the method that the settings choose (exact motion from event to event, or
!> Newmark's steps), after checks whether the run can start.
module motion_run
   use beam_model, only: beam_model_t
   use beam_starts, only: check_table_of_start
   use contact_sets, only: set_store_t
   use contact_starts, only: check_gaps
   use exact_motion, only: choose_modes, exact_response
   use failures, only: fail, failure_t, status_bad_input
   use few_modes, only: find_common_modes, number_of_modes
   use free_modes, only: free_modes_t
   use kinds, only: wp
   use load_settings, only: is_in_mode, start_drop, start_release, start_rest, start_velocity
   use mass_choice, only: is_redistribution_more_accurate
   use mode_choice, only: select_modes
   use newmark_motion, only: check_newmark, newmark_response
   use number_text, only: to_text
   use response_types, only: mode_check_t, response_t
   use run_settings, only: impulse_momentum, impulse_nodal, method_exact, method_newmark, moves_in_modes, &
      output_settings_t, run_settings_t, stop_settings_t, stops_of
   use section_types, only: section_state_t
   use static_states, only: find_static_start
   use stop_contacts, only: contact_t, contacts_of, has_one_contact
   use stop_laws, only: is_rigid
   use stop_pairs, only: check_nodes_of_stops
   implicit none (type, external)
   private
   public :: run_motion, check_motion, find_shared_modes
   ! callers of `run_motion` declare a store of contact sets
   public :: set_store_t

contains

   !> Compute the motion from the start to the end of the run.
   subroutine run_motion(model, settings, response, error, shared, sets, carried)
      type(beam_model_t), intent(in) :: model
      !> Settings of the run
      type(run_settings_t), intent(in) :: settings
      !> Receives events, histories and measures
      type(response_t), intent(out) :: response
      !> Set if the run fails
      type(failure_t), allocatable, intent(out) :: error
      !> Modes from `find_shared_modes`; if absent, a run that needs modes computes them
      type(free_modes_t), intent(in), optional :: shared
      !> Contact sets (the beam with a given set of closed contacts) cached by earlier runs, which exact motion uses and
      !> extends; Newmark's method does not use them; private to one thread
      type(set_store_t), target, intent(inout), optional :: sets
      !> The state from which the run continues, if its component `q` is allocated: the end of a run under loads by the
      !> same method on the same mesh. On return, the state at the end of this run
      type(section_state_t), intent(inout), optional :: carried

      call check_beam(model, settings, error)
      if (allocated(error)) return
      select case (settings%response%method)
      case (method_exact)
         call exact_response(model, settings, response, error, shared, sets, carried)
      case (method_newmark)
         call step_motion(model, settings, response, error, shared, carried)
      end select
      ! with a single contact, its record would repeat the histories and measures of the run
      if (has_one_contact(settings, size(model%supports))) then
         if (allocated(response%contacts)) deallocate (response%contacts)
      end if
      response%mesh_check%elements = model%mesh%elements
      response%mesh_check%is_redistributed = model%is_redistributed
      ! nodal impulses follow the paper, whose mass matrix is the consistent one: no advice to redistribute the mass
      response%mesh_check%should_redistribute = .not. model%is_redistributed .and. &
         settings%stop%impulse == impulse_momentum .and. &
         is_redistribution_more_accurate(model%section, model%mesh, model%tip_mass_ratio, settings)
      if (allocated(response%measures)) response%measures%mesh_elements = model%mesh%elements
   end subroutine run_motion

   !> Compute the motion by Newmark's steps, in nodes or in modes.
   subroutine step_motion(model, settings, response, error, shared, carried)
      type(beam_model_t), intent(in) :: model
      !> Settings of the run
      type(run_settings_t), intent(in) :: settings
      !> Receives events, histories and measures
      type(response_t), intent(out) :: response
      !> Set if the run fails
      type(failure_t), allocatable, intent(out) :: error
      !> Modes from `find_shared_modes`
      type(free_modes_t), intent(in), optional :: shared
      !> The state from which the run continues, if its component `q` is allocated; on return the state at the end
      type(section_state_t), intent(inout), optional :: carried

      type(free_modes_t) :: modes
      type(run_settings_t) :: settings_in_modes
      type(mode_check_t) :: check

      if (.not. moves_in_modes(settings%response)) then
         call newmark_response(model, settings, response, error, carried)
         return
      end if
      call find_stepped_modes(model, settings, modes, settings_in_modes, check, error, shared, carried)
      if (allocated(error)) return
      call newmark_response(model, settings_in_modes, response, error, carried, modes)
      response%mode_check = check
   end subroutine step_motion

   !> Find the modes in which Newmark's method computes the motion: those of exact motion with the same settings.
   subroutine find_stepped_modes(model, settings, modes, settings_in_modes, check, error, shared, carried)
      type(beam_model_t), intent(in) :: model
      !> Settings of the run
      type(run_settings_t), intent(in) :: settings
      type(free_modes_t), intent(out) :: modes
      !> Settings of the run, with damping ratios and the mode of the start in the order of `modes`
      type(run_settings_t), intent(out) :: settings_in_modes
      !> Number of modes, and how the number was found
      type(mode_check_t), intent(out) :: check
      !> Set if the modes cannot be found
      type(failure_t), allocatable, intent(out) :: error
      !> Modes from `find_shared_modes`; absent or empty: the modes are computed
      type(free_modes_t), intent(in), optional :: shared
      !> State from which the run continues, if `q` is allocated; receives the modes for the next run
      type(section_state_t), intent(inout), optional :: carried

      type(free_modes_t), allocatable :: chosen

      settings_in_modes = settings
      ! trial runs are made by exact motion
      settings_in_modes%response%method = method_exact
      if (present(shared)) modes = shared
      if (.not. allocated(modes%lambda)) call find_common_modes(model, settings_in_modes, modes, error)
      if (.not. allocated(error)) call choose_modes(model, settings_in_modes, modes, chosen, check, error, &
         carried=carried)
      if (allocated(error)) return
      settings_in_modes%response%method = method_newmark
      if (allocated(chosen)) modes = chosen
      if (present(carried)) call move_alloc(chosen, carried%modes)
      call select_modes(check%retained, modes, settings_in_modes)
   end subroutine find_stepped_modes

   !> Check whether a run can start, as far as is known without running it.
   subroutine check_motion(model, settings, error)
      type(beam_model_t), intent(in) :: model
      !> Settings of the run
      type(run_settings_t), intent(in) :: settings
      !> Set if the run cannot start
      type(failure_t), allocatable, intent(out) :: error

      type(free_modes_t) :: modes
      type(run_settings_t) :: settings_in_modes
      type(mode_check_t) :: check

      call check_beam(model, settings, error)
      if (allocated(error)) return
      if (settings%response%method /= method_newmark) then
         call check_exact_start(model, settings, error)
      else if (.not. moves_in_modes(settings%response)) then
         call check_newmark(model, settings, error)
      else if (settings%response%mode_count > 0 .or. settings%response%keep_all_modes) then
         ! other numbers of modes are not known without trial runs, and the steps depend on them
         call find_stepped_modes(model, settings, modes, settings_in_modes, check, error)
         if (.not. allocated(error)) call check_newmark(model, settings_in_modes, error, modes)
      else
         call check_exact_start(model, settings, error)
      end if
   end subroutine check_motion

   !> Check the start in modes by a run of exact motion that ends as it begins, unless `check_beam` knows the start: a
   !> mode, a table, few modes of a release, or a body may begin beyond a contact, and contacts may be more than modes.
   !> Unless the number of modes is given, all modes are taken, because fewer may refuse a start that the run accepts;
   !> the start on a mesh with too many modes for that is left to the run.
   subroutine check_exact_start(model, settings, error)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      !> Set if the run cannot start
      type(failure_t), allocatable, intent(out) :: error

      ! length of the run, tau
      real(wp), parameter :: brief = 1.0e-9_wp
      integer, parameter :: max_modes = 200
      type(run_settings_t) :: start
      type(response_t) :: response
      type(stop_settings_t), allocatable :: stops(:)
      logical :: is_known

      allocate (stops, source=stops_of(settings))
      is_known = settings%response%mode_count == 0 .and. any(settings%start%kind == &
         [start_release, start_rest, start_velocity, start_drop])
      ! an undeformed beam at rest is so in any number of modes, and compliant contacts may be more than modes
      is_known = is_known .or. (settings%start%kind == start_rest .and. .not. any(is_rigid(stops)))
      is_known = is_known .and. all(stops%partner == 0)
      if (is_known .or. .not. settings%has_stop .or. has_one_contact(settings, size(model%supports))) return
      if (settings%response%mode_count == 0 .and. number_of_modes(model) > max_modes) return
      start = settings
      start%response%method = method_exact
      start%response%keep_all_modes = settings%response%mode_count == 0
      start%response%duration = brief
      start%response%step = brief
      start%output = output_settings_t(history=.false.)
      if (allocated(start%statistics)) deallocate (start%statistics)
      if (allocated(start%poincare)) deallocate (start%poincare)
      if (allocated(start%spectrum)) deallocate (start%spectrum)
      call exact_response(model, start, response, error)
   end subroutine check_exact_start

   !> Check whether the beam can start, by any method. A massless node needs exact motion and a single rigid stop, for
   !> which its displacement has a closed form.
   subroutine check_beam(model, settings, error)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      !> Set if the beam cannot start
      type(failure_t), allocatable, intent(out) :: error

      type(contact_t), allocatable :: fixed(:)
      real(wp), allocatable :: start(:)
      logical :: has_single_contact

      has_single_contact = has_one_contact(settings, size(model%supports))
      ! a single contact needs no such checks: the mesh has a node at the stop, and the release is from a gap of 1
      if (settings%has_stop .and. .not. has_single_contact) then
         call check_nodes_of_stops(stops_of(settings), model%stop_dofs, error)
         if (.not. allocated(error) .and. settings%start%kind == start_release) then
            call find_static_start(model, contacts_of(settings), start, error)
         else if (any(settings%start%kind == [start_rest, start_velocity, start_drop])) then
            ! the beam is undeformed
            fixed = contacts_of(settings)
            fixed = pack(fixed, fixed%is_fixed)
            call check_gaps(fixed, -fixed%height, spread(0.0_wp, 1, size(fixed)), error)
         end if
         if (allocated(error)) return
      end if
      if (model%has_massless_node .and. .not. (settings%response%method == method_exact .and. has_single_contact .and. &
         is_rigid(settings%stop))) then
         call fail(error, status_bad_input, "mass = 'redistributed' leaves the node at the stop without mass: " &
            //"that needs method = 'exact', one rigid stop below the beam with a release from it, no supports " &
            //'along the beam, loads, &stress or &statistics, and damping by zeta alone; or a tip mass at a stop at ' &
            //"the tip; else take 'consistent' or 'auto'")
         return
      end if
      if (settings%stop%impulse == impulse_nodal .and. settings%response%mode_count > 0 .and. &
         settings%response%mode_count < number_of_modes(model)) then
         call fail(error, status_bad_input, 'modes must be all '//to_text(number_of_modes(model)) &
            //" of the mesh, because impulse = 'nodal' in &stop changes the velocity of one node; give no number")
         return
      end if
      call check_mode_of_start(model, settings, error)
      if (.not. allocated(error)) call check_table_of_start(model, settings%start, error)
   end subroutine check_beam

   !> Check that the initial mode exists, and that the run retains it.
   pure subroutine check_mode_of_start(model, settings, error)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      !> Set if the run cannot retain the mode, or if a support fixes the tip, whose displacement scales the mode
      type(failure_t), allocatable, intent(inout) :: error

      ! maximum number of modes that the run can retain
      integer :: modes

      if (.not. is_in_mode(settings%start)) return
      modes = number_of_modes(model)
      if (settings%response%mode_count > 0) modes = min(modes, settings%response%mode_count)
      if (settings%start%mode > modes) then
         call fail(error, status_bad_input, 'the mode of the start must be from 1 to '//to_text(modes) &
            //', the modes that this run keeps on its mesh')
      else if (any(model%supports%dof == model%tip_dof .and. model%supports%stiffness <= 0.0_wp)) then
         call fail(error, status_bad_input, 'the mode of the start is defined by the motion of the tip, which a &
         &support holds')
      end if
   end subroutine check_mode_of_start

   !> Find the modes that all runs of one beam share (`find_common_modes`): all modes, or the lowest of a large mesh.
   subroutine find_shared_modes(model, settings, modes, error)
      type(beam_model_t), intent(in) :: model
      !> Settings of one of the runs
      type(run_settings_t), intent(in) :: settings
      !> Modes of the beam; empty for runs that do not move in modes
      type(free_modes_t), intent(out) :: modes
      !> Set if the modes cannot be found
      type(failure_t), allocatable, intent(out) :: error

      if (moves_in_modes(settings%response)) call find_common_modes(model, settings, modes, error)
   end subroutine find_shared_modes

end module motion_run
