!> How a Newmark run begins.
module newmark_start
   use beam_loads, only: base_mass_vector, base_rotation_vector, inertia_of_curve
   use beam_model, only: beam_model_t
   use complementarity, only: close_gaps, solve_complementarity
   use contact_rows, only: band
   use failures, only: fail, failure_t, status_bad_input
   use free_modes, only: find_free_modes, free_modes_t
   use history_list, only: eta_stop, force_stop, velocity_stop
   use kinds, only: lambda1_power4, wp
   use load_settings, only: field_rotation, field_uniform, start_balance, start_drop, start_mode, start_pull, &
      start_settings_t, start_table, start_velocity
   use newmark_contacts, only: event_here, keep_event, settle
   use newmark_events, only: meet_and_leave
   use newmark_loads, only: load_at
   use newmark_run, only: gap_at, gap_rate_at, is_inactive, is_in_contact, is_open, newmark_run_t
   use newmark_stepper, only: make_start_state, restart_acceleration
   use number_text, only: to_text
   use response_types, only: event_contact, response_t
   use run_settings, only: run_settings_t
   use skyline_matrix, only: factorise, skyline_t, solve_factorised
   use stop_laws, only: static_stiffness
   use stop_surfaces, only: is_beyond, surface_t, touch_tolerance
   use table_starts, only: curve_of_table
   implicit none (type, external)
   private
   public :: make_start, open_contacts, begin_at_contacts

contains

   !> The beam's state, and the forces of the surfaces that carry it.
   subroutine make_start(model, held, settings, surfaces, acts, run, error)
      type(beam_model_t), intent(in) :: model
      !> Its rigid supports held
      type(beam_model_t), intent(in) :: held
      type(run_settings_t), intent(in) :: settings
      type(surface_t), intent(in) :: surfaces(:)
      !> Those that can carry it
      logical, intent(in) :: acts(:)
      !> Its stepper and loads are ready
      type(newmark_run_t), intent(inout) :: run
      !> Set when the state cannot be found, or a surface is in the way
      type(failure_t), allocatable, intent(out) :: error

      real(wp), allocatable :: displacement(:)

      associate (beam => run%states(1)%beam, n => run%stepper%order, start => settings%start)
         if (start%kind == start_pull) then
            associate (pulled => surfaces(run%pulled))
               call make_start_state(held, run%stepper, pulled%sign + run%height, beam, error)
            end associate
            if (allocated(error)) return
         else
            allocate (beam%displacement(1 - band:n + band), beam%velocity(1 - band:n + band), &
               beam%acceleration(1 - band:n + band), source=0.0_wp)
         end if
         if (run%loads%count > 0) then
            allocate (beam%load(1 - band:n + band), source=0.0_wp)
            call load_at(run, 0.0_wp, beam%load)
         end if
         allocate (run%states(1)%force(size(surfaces)), run%states(1)%indentation(size(surfaces)), &
            run%states(1)%branch_force(size(surfaces)), source=0.0_wp)
         select case (start%kind)
         case (start_balance)
            allocate (displacement(n), source=0.0_wp)
            if (allocated(beam%load)) displacement(:) = beam%load(1:n)
            call carry(model, held, surfaces, acts, displacement, run%states(1)%force, error)
            if (allocated(error)) return
            beam%displacement(1:n) = displacement
         case (start_velocity, start_drop, start_mode, start_table)
            call set_in_motion(model, held, start, beam%displacement(1:n), beam%velocity(1:n), error)
            if (allocated(error)) return
         end select
         if (start%kind /= start_pull) call check_surfaces(model, surfaces, run, error)
         if (.not. allocated(error)) call move_onto_surfaces(model, held, surfaces, acts, run, error)
         if (.not. allocated(error)) call restart_acceleration(run%stepper, beam)
      end associate
   end subroutine make_start

   !> At rest under loads on the surfaces that carry it: they push and never pull, and yield in a row with the beam.
   subroutine carry(model, held, surfaces, acts, displacement, forces, error)
      type(beam_model_t), intent(in) :: model
      !> Its rigid supports held
      type(beam_model_t), intent(in) :: held
      type(surface_t), intent(in) :: surfaces(:)
      logical, intent(in) :: acts(:)
      !> Loads in; displacement out
      real(wp), intent(inout) :: displacement(:)
      !> P of each surface
      real(wp), intent(inout) :: forces(:)
      !> Set when the stiffness cannot be factorised
      type(failure_t), allocatable, intent(out) :: error

      type(skyline_t) :: factors
      real(wp), dimension(count(acts)) :: push, sign
      real(wp) :: compliance(count(acts), count(acts)), shapes(size(displacement), count(acts)), stiffness
      integer :: place(count(acts)), dofs(count(acts)), k
      logical :: carries(count(acts))

      factors = held%stiffness
      call factorise(factors, error)
      if (allocated(error)) return
      place = pack([(k, k=1, size(acts))], acts)
      sign = surfaces(place)%sign
      dofs = model%stop_dofs(surfaces(place)%stop)
      displacement = lambda1_power4*displacement
      call solve_factorised(factors, displacement)
      shapes = 0.0_wp
      do k = 1, size(place)
         if (.not. any(model%supports%dof == dofs(k) .and. model%supports%stiffness <= 0.0_wp)) then
            shapes(dofs(k), k) = lambda1_power4*sign(k)
            call solve_factorised(factors, shapes(:, k))
         end if
         compliance(:, k) = sign*shapes(dofs, k)
         stiffness = static_stiffness(surfaces(place(k))%settings)
         if (stiffness > 0.0_wp) compliance(k, k) = compliance(k, k) + 1.0_wp/stiffness
      end do
      call solve_complementarity(compliance, sign*displacement(dofs) - surfaces(place)%height, push, carries)
      displacement = displacement + matmul(shapes, push)
      forces(place) = push
   end subroutine carry

   !> Velocities that the clamp allows, M^-1 M_b v; of a mode and of a table displacements too.
   subroutine set_in_motion(model, held, start, displacement, velocity, error)
      type(beam_model_t), intent(in) :: model
      !> Its rigid supports held
      type(beam_model_t), intent(in) :: held
      type(start_settings_t), intent(in) :: start
      !> [order]
      real(wp), intent(inout) :: displacement(:)
      real(wp), intent(inout) :: velocity(:)
      !> Set when there is no such mode
      type(failure_t), allocatable, intent(out) :: error

      type(free_modes_t) :: modes
      type(skyline_t) :: factors
      integer :: i

      if (start%kind == start_table) then
         if (allocated(start%displacements)) displacement = inertia_of(start%displacements)
         if (allocated(start%velocities)) velocity = inertia_of(start%velocities)
      else if (start%kind == start_drop .or. start%field == field_uniform .and. start%kind == start_velocity) then
         velocity = start%velocity*base_mass_vector(model)
         if (start%kind == start_drop) velocity = -velocity
      else if (start%field == field_rotation .and. start%kind == start_velocity) then
         velocity = start%velocity*base_rotation_vector(model)
      else
         call find_free_modes(model, modes, error)
         if (allocated(error)) return
         associate (tip => modes%mode(modes%tip_dof, start%mode))
            if (start%kind == start_mode) displacement = start%displacement/tip*modes%mode(:, start%mode)
            velocity = start%velocity/tip*modes%mode(:, start%mode)
         end associate
         return
      end if
      do i = 1, size(model%supports)
         if (model%supports(i)%stiffness > 0.0_wp) cycle
         displacement(model%supports(i)%dof) = 0.0_wp
         velocity(model%supports(i)%dof) = 0.0_wp
      end do
      factors = held%mass
      call factorise(factors, error)
      if (allocated(error)) return
      call solve_factorised(factors, displacement)
      call solve_factorised(factors, velocity)

   contains

      !> M times what a table says.
      function inertia_of(values) result(vector)
         real(wp), intent(in) :: values(:)
         real(wp), allocatable :: vector(:)

         allocate (vector, source=inertia_of_curve(model, curve_of_table(model, start%position, values)))
      end function inertia_of

   end subroutine set_in_motion

   !> Room for what is kept of each surface.
   subroutine open_contacts(settings, run, response)
      !> Output
      type(run_settings_t), intent(in) :: settings
      type(newmark_run_t), intent(in) :: run
      !> Its histories have room
      type(response_t), intent(inout) :: response

      integer :: k, n

      n = 0
      if (allocated(response%tau)) n = size(response%tau)
      allocate (response%surfaces(size(run%contacts)))
      do k = 1, size(run%contacts)
         associate (surface => run%contacts(k)%surface)
            associate (record => response%surfaces(surface%number))
               record%stop = surface%stop
               record%sign = nint(surface%sign)
               record%position = surface%settings%position
               record%height = surface%sign*surface%height
               if (.not. run%keeps_contacts) cycle
               if (settings%output%history(eta_stop)) allocate (record%eta(n), source=0.0_wp)
               if (settings%output%history(velocity_stop)) allocate (record%velocity(n), source=0.0_wp)
               if (settings%output%history(force_stop)) allocate (record%force(n), source=0.0_wp)
               if (settings%output%energy) allocate (record%energy(n), record%dissipated(n), source=0.0_wp)
            end associate
         end associate
      end do
   end subroutine open_contacts

   !> Is a surface in the way that does not carry the beam?
   subroutine check_surfaces(model, surfaces, run, error)
      type(beam_model_t), intent(in) :: model
      type(surface_t), intent(in) :: surfaces(:)
      type(newmark_run_t), intent(in) :: run
      !> Set when there is one
      type(failure_t), allocatable, intent(out) :: error

      real(wp) :: gap
      integer :: k

      do k = 1, size(surfaces)
         gap = surfaces(k)%sign*run%states(1)%beam%displacement(model%stop_dofs(surfaces(k)%stop)) - surfaces(k)%height
         if (run%states(1)%force(k) > 0.0_wp .or. .not. is_beyond(surfaces(k), gap)) cycle
         call fail(error, status_bad_input, 'the beam starts beyond the surface at '// &
            to_text(surfaces(k)%settings%position)//', by '//to_text(-gap)//' of the unit of displacement')
         return
      end do
   end subroutine check_surfaces

   !> Move what lies beyond surfaces, by their tolerance at most, onto them, along the shapes that exact motion takes:
   !> of a force there on a beam on an elastic foundation.
   subroutine move_onto_surfaces(model, held, surfaces, acts, run, error)
      type(beam_model_t), intent(in) :: model
      !> Its rigid supports held
      type(beam_model_t), intent(in) :: held
      type(surface_t), intent(in) :: surfaces(:)
      !> Those that can be met
      logical, intent(in) :: acts(:)
      !> Its displacements change
      type(newmark_run_t), intent(inout) :: run
      !> Set when the stiffness cannot be factorised
      type(failure_t), allocatable, intent(inout) :: error

      type(skyline_t) :: factors
      real(wp), dimension(size(acts)) :: gap, noise
      real(wp), allocatable :: shape(:, :), shift(:)
      integer, allocatable :: place(:)
      integer :: dofs(size(acts)), i, k

      associate (displacement => run%states(1)%beam%displacement(1:run%stepper%order))
         gap = surfaces%sign*displacement(model%stop_dofs(surfaces%stop)) - surfaces%height
         noise = 4.0_wp*epsilon(1.0_wp)*abs(surfaces%height)
         allocate (place, source=pack([(k, k=1, size(acts))], acts .and. .not. (run%states(1)%force > 0.0_wp .or. &
            is_beyond(surfaces, gap))))
         if (all(gap(place) >= -noise(place))) return
         dofs = model%stop_dofs(surfaces%stop)
         allocate (shape(run%stepper%order, size(place)), shift(size(place)))
         factors = held%stiffness
         factors%values(:) = factors%values + lambda1_power4*held%mass%values
         call factorise(factors, error)
         if (allocated(error)) return
         shape = 0.0_wp
         do i = 1, size(place)
            shape(dofs(place(i)), i) = surfaces(place(i))%sign
            call solve_factorised(factors, shape(:, i))
         end do
         call close_gaps(spread(surfaces(place)%sign, 2, size(place))*shape(dofs(place), :), gap(place), noise(place), &
            shift)
         displacement = displacement + matmul(shape, shift)
      end associate
   end subroutine move_onto_surfaces

   !> Surfaces that carry the beam at the start, or are hit there, or have to push.
   pure subroutine begin_at_contacts(run, response)
      type(newmark_run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response

      real(wp) :: rate
      integer :: k

      run%arrives = .false.
      run%leaves = .false.
      associate (state => run%states(run%now))
         do k = 1, size(run%contacts)
            associate (contact => run%contacts(k))
               if (contact%status == is_inactive) cycle
               if (allocated(contact%stop) .and. state%force(k) > 0.0_wp) then
                  contact%status = is_in_contact
                  state%indentation(k) = state%force(k)/static_stiffness(contact%surface%settings)
                  run%next_level = max(run%next_level, contact%contact_level)
                  call keep_event(run, k, event_here(run, k, event_contact), response)
                  cycle
               end if
               if (contact%status /= is_open .or. gap_at(run, k, state) > touch_tolerance(contact%surface)) cycle
               rate = gap_rate_at(run, k, state)
               run%arrives(k) = rate < 0.0_wp
               if (.not. allocated(contact%stop)) contact%is_stopped = .not. abs(rate) > 0.0_wp
            end associate
         end do
      end associate
      if (any(run%arrives)) then
         call meet_and_leave(run, response)
      else if (any(run%contacts%is_stopped) .or. any(run%contacts%status == is_in_contact)) then
         call settle(run, response)
      end if
   end subroutine begin_at_contacts

end module newmark_start
