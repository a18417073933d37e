!> Initial state of a Newmark run: released from a static shape, in static equilibrium, with given displacements and
!> velocities, or the final state of an earlier run; and the contacts that are closed or hit in this state. In a chain
!> of cases each motion continues that of the case before, after whole periods of the loads (docs/theory.md, section
!> 21).
module newmark_start
   use beam_model, only: beam_model_t, moves_freely
   use beam_starts, only: find_start_momenta
   use contact_rows, only: band, row_value
   use contact_starts, only: find_slow_balance, find_static_equilibrium, check_start, flexible_beam_t, &
      move_onto_contacts
   use failures, only: failure_t
   use free_modes, only: complete_start, find_free_modes, free_modes_t
   use kinds, only: lambda1_power4, wp
   use load_settings, only: is_in_mode, start_balance, start_drop, start_mode, start_release, start_settings_t, &
      start_table, start_velocity
   use modal_starts, only: find_modal_start
   use newmark_contacts, only: event_now, record_event, resolve_contacts
   use newmark_energies, only: total_energy
   use newmark_events, only: begin_and_end_contacts
   use newmark_loads, only: load_at
   use newmark_run, only: gap_at, gap_rate_at, is_inactive, is_in_contact, is_open, is_unloaded, newmark_run_t, &
      spring_damper_force, instant_of, is_constrained
   use newmark_stepper, only: restart_acceleration
   use response_types, only: event_contact, response_t
   use run_settings, only: run_settings_t
   use section_types, only: section_state_t
   use skyline_matrix, only: factorise, skyline_t, solve_factorised
   use stop_contacts, only: active_contacts, contact_t, penetration_tolerance, shape_of_contact
   use stop_laws, only: static_stiffness
   implicit none (type, external)
   private
   public :: make_start, begin_at_contacts, state_of, start_from_state, resolve_stored_contacts

   !> Finite-element model with rigid supports fixed.
   type, extends(flexible_beam_t) :: finite_beam_t
      type(skyline_t) :: stiffness
      type(skyline_t) :: mass
   contains
      procedure :: find_static_shapes
   end type finite_beam_t

contains

   !> Make the initial state, and the forces of the contacts that carry it.
   subroutine make_start(model, supported, settings, contacts, release_shape, run, error)
      type(beam_model_t), intent(in) :: model
      !> The model with its rigid supports fixed, or in modes
      type(beam_model_t), intent(in) :: supported
      type(run_settings_t), intent(in) :: settings
      type(contact_t), intent(in) :: contacts(:)
      !> The static shape from which the beam is released, [order of the beam]; unallocated: the beam starts otherwise
      real(wp), allocatable, intent(in) :: release_shape(:)
      !> The run; its stepper and loads are ready
      type(newmark_run_t), intent(inout) :: run
      !> Set if the state cannot be found, or the beam would start beyond a contact
      type(failure_t), allocatable, intent(inout) :: error

      ! on entry to the procedures below the loads at the start
      real(wp) :: displacement(supported%stiffness%order)
      real(wp) :: velocity(supported%stiffness%order)
      integer :: k

      displacement = 0.0_wp
      associate (state => run%states(1), n => run%stepper%order, last => run%stepper%length + band)
         allocate (state%beam%displacement(1 - band:last), state%beam%velocity(1 - band:last), &
            state%beam%acceleration(1 - band:last), state%force(size(contacts)), &
            state%indentation(size(contacts)), state%branch_force(size(contacts)), source=0.0_wp)
         if (run%loads%count > 0) then
            allocate (state%beam%load(1 - band:last), source=0.0_wp)
            call load_at(run, 0.0_wp, state%beam%load)
            displacement = state%beam%load(1:n)
         end if
         if (allocated(run%modes)) then
            run%beam%square = run%modes%square
            allocate (run%beam%row(n, size(contacts)))
            do k = 1, size(contacts)
               run%beam%row(:, k) = shape_of_contact(contacts(k), model, run%modes%mode)
            end do
            call find_modal_start(model, run%modes, settings, run%beam, contacts, displacement, velocity, state%force, &
               error)
         else
            call find_nodal_start(model, supported, settings, contacts, release_shape, displacement, velocity, &
               state%force, error)
         end if
         if (allocated(error)) return
         where (state%force > 0.0_wp .and. static_stiffness(contacts%settings) > 0.0_wp) state%indentation = &
            state%force/static_stiffness(contacts%settings)
         state%beam%displacement(1:n) = displacement
         state%beam%velocity(1:n) = velocity
         call restart_acceleration(run%stepper, state%beam)
      end associate
   end subroutine make_start

   !> Find the initial state of the degrees of freedom of the nodes and the contact forces.
   subroutine find_nodal_start(model, supported, settings, contacts, release_shape, displacement, velocity, forces, &
      error)
      type(beam_model_t), intent(in) :: model
      !> The model with its rigid supports fixed
      type(beam_model_t), intent(in) :: supported
      type(run_settings_t), intent(in) :: settings
      type(contact_t), intent(in) :: contacts(:)
      !> The static shape from which the beam is released, [order of the beam]; unallocated: the beam starts otherwise
      real(wp), allocatable, intent(in) :: release_shape(:)
      !> On entry loads at tau = 0, on return displacements, [degrees of freedom]
      real(wp), intent(inout) :: displacement(:)
      real(wp), intent(out) :: velocity(:)
      !> Force P of each contact
      real(wp), intent(out) :: forces(:)
      !> Set if the state cannot be found, or the beam would start beyond a contact
      type(failure_t), allocatable, intent(inout) :: error

      type(finite_beam_t) :: flexible
      real(wp) :: load(size(displacement))
      logical :: is_active(size(contacts))

      load = displacement
      displacement = 0.0_wp
      velocity = 0.0_wp
      forces = 0.0_wp
      is_active = active_contacts(contacts, model%stop_dofs(contacts%stop))
      call make_flexible(model, supported, contacts, flexible)
      associate (start => settings%start)
         select case (start%kind)
         case (start_release)
            displacement(:size(release_shape)) = release_shape
         case (start_balance)
            call find_balance(model, contacts, is_active, flexible, load, displacement, forces, error)
         case (start_velocity, start_drop, start_mode, start_table)
            call set_in_motion(model, supported, start, displacement, velocity, error)
         end select
         if (allocated(error)) return
         call complete_start(model, start%kind == start_balance, displacement, velocity)
         if (start%kind /= start_release .or. .not. all(contacts%is_fixed)) call check_start(flexible, contacts, &
            forces, displacement, error)
      end associate
      if (.not. allocated(error)) call move_onto_contacts(flexible, contacts, is_active, forces, displacement, error)
   end subroutine find_nodal_start

   !> Static equilibrium under the loads at the start with unilateral contact forces. If a part of the model can move
   !> without strain, the stiffness matrix is singular, so that the equilibrium is found in modes.
   subroutine find_balance(model, contacts, is_active, flexible, load, displacement, forces, error)
      type(beam_model_t), intent(in) :: model
      type(contact_t), intent(in) :: contacts(:)
      !> Whether each contact is active, [contacts]
      logical, intent(in) :: is_active(:)
      type(finite_beam_t), intent(in) :: flexible
      !> Loads on the degrees of freedom, [order]
      real(wp), intent(in) :: load(:)
      real(wp), intent(inout) :: displacement(:)
      !> Force P of each contact
      real(wp), intent(inout) :: forces(:)
      !> Set if nothing carries a part that moves freely, or the displacements cannot be found
      type(failure_t), allocatable, intent(inout) :: error

      type(free_modes_t) :: free
      real(wp), allocatable :: q(:)
      real(wp) :: shape(size(load), 1)
      integer :: i

      if (.not. moves_freely(model)) then
         call flexible%find_static_shapes(0.0_wp, reshape(load, [size(load), 1]), shape, error)
         if (allocated(error)) return
         displacement = shape(:, 1)
         call find_static_equilibrium(flexible, contacts, is_active, displacement, forces, error)
      else
         call find_free_modes(model, free, error)
         if (allocated(error)) return
         allocate (q(size(free%square)))
         call find_slow_balance(free, matmul(transpose(free%mode), flexible%row), contacts, is_active, &
            matmul(load, free%mode), q, forces, error)
         displacement = matmul(free%mode, q)
         do i = 1, size(model%supports)
            if (model%supports(i)%stiffness <= 0.0_wp) displacement(model%supports(i)%dof) = 0.0_wp
         end do
      end if
   end subroutine find_balance

   !> Collect matrices and contact rows.
   pure subroutine make_flexible(model, supported, contacts, flexible)
      type(beam_model_t), intent(in) :: model
      !> The model with its rigid supports fixed
      type(beam_model_t), intent(in) :: supported
      type(contact_t), intent(in) :: contacts(:)
      type(finite_beam_t), intent(out) :: flexible

      integer :: k

      flexible%stiffness = supported%stiffness
      flexible%mass = supported%mass
      allocate (flexible%row(supported%stiffness%order, size(contacts)), source=0.0_wp)
      do k = 1, size(contacts)
         associate (dof => model%stop_dofs(contacts(k)%stop), partner => model%partner_dofs(contacts(k)%stop))
            flexible%row(dof, k) = merge(0.0_wp, contacts(k)%sign, any(model%supports%dof == dof .and. &
               model%supports%stiffness <= 0.0_wp))
            if (partner > 0) flexible%row(partner, k) = -contacts(k)%sign
         end associate
      end do
   end subroutine make_flexible

   !> Static displacements of the degrees of freedom under given loads. An elastic foundation, whose stiffness is
   !> proportional to the mass, makes the problem regular if the beam can move as a rigid body.
   pure subroutine find_static_shapes(self, foundation, load, shape, error)
      class(finite_beam_t), intent(in) :: self
      !> Stiffness of the foundation as a multiple of the mass
      real(wp), intent(in) :: foundation
      !> Loads, one load case in each column, [degrees of freedom, cases]
      real(wp), intent(in) :: load(:, :)
      !> Displacements, one load case in each column, [degrees of freedom, cases]
      real(wp), intent(out) :: shape(:, :)
      !> Set if the stiffness cannot be factorised
      type(failure_t), allocatable, intent(inout) :: error

      type(skyline_t) :: factors
      integer :: k

      factors = self%stiffness
      factors%values(:) = factors%values + foundation*lambda1_power4*self%mass%values
      call factorise(factors, error)
      if (allocated(error)) return
      shape = lambda1_power4*load
      do k = 1, size(load, 2)
         call solve_factorised(factors, shape(:, k))
      end do
   end subroutine find_static_shapes

   !> Initial velocities, and for a mode or a table initial displacements. A motion that violates the boundary
   !> conditions, such as a uniform velocity, is projected: the velocities of the supported beam are M^-1 p, with p the
   !> momenta of that motion at the degrees of freedom.
   subroutine set_in_motion(model, supported, start, displacement, velocity, error)
      type(beam_model_t), intent(in) :: model
      !> The model with its rigid supports fixed
      type(beam_model_t), intent(in) :: supported
      type(start_settings_t), intent(in) :: start
      !> Displacements of the degrees of freedom, [degrees of freedom]
      real(wp), intent(inout) :: displacement(:)
      !> Velocities of the degrees of freedom, [degrees of freedom]
      real(wp), intent(inout) :: velocity(:)
      !> Set if the mode does not exist
      type(failure_t), allocatable, intent(inout) :: error

      type(free_modes_t) :: modes
      type(skyline_t) :: factors
      integer :: i

      if (is_in_mode(start)) then
         call find_free_modes(model, modes, error)
         if (allocated(error)) return
         associate (tip => modes%mode(modes%tip_dof, start%mode))
            if (start%kind == start_mode) displacement = start%displacement/tip*modes%mode(:, start%mode)
            velocity = start%velocity/tip*modes%mode(:, start%mode)
         end associate
         return
      end if
      ! until they are multiplied by M^-1, both vectors are products of mass and motion
      call find_start_momenta(model, start, displacement, velocity)
      do i = 1, size(model%supports)
         if (model%supports(i)%stiffness > 0.0_wp) cycle
         displacement(model%supports(i)%dof) = 0.0_wp
         velocity(model%supports(i)%dof) = 0.0_wp
      end do
      factors = supported%mass
      call factorise(factors, error)
      if (allocated(error)) return
      call solve_factorised(factors, displacement)
      call solve_factorised(factors, velocity)
   end subroutine set_in_motion

   !> Close the contacts that carry the beam at the start, are hit at the start, or have a compressive reaction.
   pure subroutine begin_at_contacts(run, response)
      type(newmark_run_t), intent(inout) :: run
      !> Receives the events
      type(response_t), intent(inout) :: response

      ! rate of the gap of a contact
      real(wp) :: rate
      integer :: k

      run%arrives = .false.
      associate (state => run%states(run%now))
         do k = 1, size(run%contacts)
            associate (contact => run%contacts(k))
               if (contact%status == is_inactive) cycle
               if (allocated(contact%stop) .and. state%force(k) > 0.0_wp) then
                  ! the velocity of a body makes the force of a damper negative: the contact begins open, with its
                  ! indentation, as after a separation
                  contact%status = is_unloaded
                  if (contact%is_viscous .and. spring_damper_force(run, k, state) < 0.0_wp) then
                     state%force(k) = 0.0_wp
                     cycle
                  end if
                  contact%status = is_in_contact
                  run%next_level = max(run%next_level, contact%contact_level)
                  call record_event(run, k, event_now(run, k, event_contact), response)
                  cycle
               end if
               if (contact%status /= is_open .or. gap_at(run, k, state) > penetration_tolerance(contact%contact)) cycle
               rate = gap_rate_at(run, k, state)
               ! an approaching beam hits the contact; at a beam at rest on a rigid contact, the reaction decides
               ! whether the contact closes (`resolve_contacts`)
               run%arrives(k) = rate < 0.0_wp
               if (.not. allocated(contact%stop)) contact%is_stopped = .not. abs(rate) > 0.0_wp
            end associate
         end do
      end associate
      if (any(run%arrives)) then
         call begin_and_end_contacts(run, response)
      else if (any(run%contacts%is_stopped) .or. any(run%contacts%status == is_in_contact)) then
         call resolve_contacts(run, response)
      end if
   end subroutine begin_at_contacts

   !> Copy the present state, from which another run can start.
   pure subroutine state_of(run, state)
      type(newmark_run_t), intent(in) :: run
      type(section_state_t), intent(inout) :: state

      state%tau = instant_of(run)
      associate (now => run%states(run%now))
         state%q = now%beam%displacement
         state%v = now%beam%velocity
         state%is_closed = run%contacts%status == is_constrained .or. run%contacts%status == is_in_contact
         state%is_deformed = run%contacts%status == is_unloaded
         state%indentation = now%indentation
         state%branch_force = now%branch_force
         ! with Newmark's method, `flight_height` of a stored state is the maximum gap of the flight so far
         state%flight_height = run%contacts%peak
         state%may_be_captured = run%contacts%may_be_captured
      end associate
   end subroutine state_of

   !> Start a run from a stored state. The run must have the same contacts in the same order as the run that stored the
   !> state; the parameters of their laws may differ.
   subroutine start_from_state(state, run)
      type(section_state_t), intent(in) :: state
      !> The run, ready to start
      type(newmark_run_t), intent(inout) :: run

      integer :: k

      associate (now => run%states(run%now))
         now%beam%displacement(:) = state%q
         now%beam%velocity(:) = state%v
         now%force = 0.0_wp
         now%indentation = state%indentation
         now%branch_force = state%branch_force
         do k = 1, size(run%contacts)
            associate (contact => run%contacts(k))
               if (contact%status == is_inactive) cycle
               contact%status = is_open
               contact%may_be_captured = state%may_be_captured(k)
               contact%peak = state%flight_height(k)
               if (state%is_deformed(k)) contact%status = is_unloaded
               if (state%is_closed(k)) contact%status = merge(is_in_contact, is_constrained, allocated(contact%stop))
               ! the indentation is measured from the gap at which contact began, which is not stored
               if (any(contact%status == [is_in_contact, is_unloaded])) contact%shift = state%indentation(k) &
                  - contact%contact%height + row_value(contact%row, now%beam%displacement)
               contact%is_penetrating = contact%status == is_open .and. gap_at(run, k, now) < -run%contact_tolerance
            end associate
         end do
         call restart_acceleration(run%stepper, now%beam)
         call total_energy(run, run%start_energy)
      end associate
      run%states(3 - run%now) = run%states(run%now)
   end subroutine start_from_state

   !> Find the contact forces at the first instant, and the contacts that open at this instant under the loads of this
   !> run, although they were closed when the state was stored.
   pure subroutine resolve_stored_contacts(run, response)
      type(newmark_run_t), intent(inout) :: run
      !> Receives the events, and which contacts were closed
      type(response_t), intent(inout) :: response

      integer :: k

      allocate (response%starts_closed(size(run%contacts)))
      do k = 1, size(run%contacts)
         associate (contact => run%contacts(k))
            response%starts_closed(contact%contact%number) = contact%status == is_constrained &
               .or. contact%status == is_in_contact
         end associate
      end do
      call resolve_contacts(run, response)
   end subroutine resolve_stored_contacts

end module newmark_start
