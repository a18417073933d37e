!> Poincare map: from the state at one section of a motion to the state a number of load periods later, with its
!> derivative (docs/theory.md, section 22). A section is the state at a fixed phase of the load, i.e. at a fixed
!> fraction of the load period. The unknowns of a state are the displacements and velocities of the free modes, and the
!> forces P2 of Maxwell branches.
module section_map
   use applied_loads, only: count_forces, courses_of
   use beam_model, only: beam_model_t, complete_model
   use contact_sets, only: set_store_t
   use contact_states, only: make_contact_state, contact_state_t
   use exact_motion, only: choose_modes, exact_response
   use failures, only: failure_t
   use few_modes, only: find_common_modes
   use free_modes, only: free_modes_t, max_rigid_square
   use kinds, only: pi, wp
   use load_settings, only: base_displacement, course_harmonic, time_course_t
   use mode_choice, only: select_modes
   use response_types, only: is_impact, mode_check_t, response_t
   use run_settings, only: output_settings_t, poincare_settings_t, run_settings_t
   use section_types, only: section_state_t
   use stop_contacts, only: contact_t, contacts_of, shape_of_contact
   use tangent_columns, only: load_amplitude, load_frequency, no_parameter, allocate_tangent
   implicit none (type, external)
   private
   public :: section_map_t, map_result_t, open_section_map, run_map, evaluate_map, unknowns_of, set_unknowns
   public :: value_of_parameter, quantity_of, find_units, shift_section

   !> The map of one run, made by `open_section_map`. The caller sets `parameter`, `load`, `periods` and `sets`, and
   !> calls `find_units` before Newton's method needs the units.
   type :: section_map_t
      type(beam_model_t) :: model
      type(free_modes_t) :: modes
      type(run_settings_t) :: settings
      !> Common period of the loads in `settings`, tau
      real(wp) :: period = 0.0_wp
      !> Number of load periods of the map
      integer :: periods = 1
      !> Phase of the section in the load period, as a fraction of the period
      real(wp) :: section_phase = 0.0_wp
      !> Parameter of the map besides the state: `no_parameter`, `load_amplitude` or `load_frequency`
      integer :: parameter = no_parameter
      !> Number, among the harmonic loads (forces first), of the load whose amplitude or frequency is the parameter
      integer :: load = 0
      !> Contacts with their laws
      type(contact_state_t), allocatable :: contacts(:)
      !> Modal values at the contacts times the signs of the contacts, [modes, contacts]
      real(wp), allocatable :: value(:, :)
      !> Indices of the contacts with a branch, whose force P2 is a state variable
      integer, allocatable :: branch_contacts(:)
      !> Units of the unknowns and, last, of the parameter, [unknowns + 1]
      real(wp), allocatable :: unit(:)
      !> Sets of closed contacts that the runs of the map share; a pointer to a variable of the caller, because gfortran
      !> 12 deallocates the other components of this type if a component of it is finalized
      type(set_store_t), pointer :: sets => null()
   end type section_map_t

   !> Value and derivative of the map at one state.
   type :: map_result_t
      !> State at the end of the run
      type(section_state_t) :: end
      !> The run
      type(response_t) :: response
      !> Unknowns of the end state, [unknowns]
      real(wp), allocatable :: unknowns(:)
      !> Derivatives of these unknowns with respect to the unknowns of the initial state and, in the last column, to the
      !> parameter (0 if the map has no parameter), [unknowns, unknowns + 1]
      real(wp), allocatable :: derivative(:, :)
      !> Number of impacts and of beginnings of compliant contact
      integer :: impacts = 0
      !> Minimum normal speed of an impact at a rigid contact; huge: there is none
      real(wp) :: min_speed = huge(1.0_wp)
      !> Whether the run failed, or at its end other contacts are closed, or open with a surface that moves with the
      !> beam (`is_deformed`), than at its start
      logical :: failed = .false.
   end type map_result_t

contains

   !> Set up the map of a run over one common period of its loads.
   subroutine open_section_map(model, settings, period, map, error)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      !> Common period, tau
      real(wp), intent(in) :: period
      type(section_map_t), intent(inout) :: map
      !> Set if the modes are not found
      type(failure_t), allocatable, intent(out) :: error

      type(beam_model_t) :: whole
      type(contact_t), allocatable :: contacts(:)
      type(free_modes_t), allocatable :: chosen
      type(mode_check_t) :: check
      integer :: k

      map%model = model
      map%period = period
      map%settings = settings
      map%settings%output = output_settings_t(history=.false.)
      if (allocated(map%settings%stress)) deallocate (map%settings%stress)
      if (allocated(map%settings%statistics)) deallocate (map%settings%statistics)
      if (allocated(map%settings%spectrum)) deallocate (map%settings%spectrum)
      call find_common_modes(model, settings, map%modes, error)
      if (allocated(error)) return
      call choose_modes(model, settings, map%modes, chosen, check, error)
      if (allocated(error)) return
      if (allocated(chosen)) map%modes = chosen
      call select_modes(check%retained, map%modes, map%settings)
      ! the runs of the map use these modes without further selection
      map%settings%response%keep_all_modes = .true.
      map%settings%response%mode_count = 0
      whole = model
      call complete_model(settings, whole)
      allocate (contacts, source=contacts_of(settings))
      allocate (map%contacts(size(contacts)), map%value(size(map%modes%square), size(contacts)))
      do k = 1, size(contacts)
         call make_contact_state(contacts(k), map%contacts(k))
         map%value(:, k) = shape_of_contact(contacts(k), whole, map%modes%mode)
      end do
      allocate (map%branch_contacts(0))
      do k = 1, size(contacts)
         if (.not. allocated(map%contacts(k)%spring)) cycle
         if (map%contacts(k)%spring%branch_stiffness > 0.0_wp) map%branch_contacts = [map%branch_contacts, k]
      end do
   end subroutine open_section_map

   !> Value of the parameter in the settings.
   pure real(wp) function value_of_parameter(map) result(value)
      type(section_map_t), intent(in) :: map

      type(time_course_t), allocatable :: courses(:)

      value = 0.0_wp
      if (map%parameter == no_parameter) return
      allocate (courses, source=courses_of(map%settings))
      associate (course => courses(index_of_load(map)))
         value = merge(course%amplitude, course%frequency, map%parameter == load_amplitude)
      end associate
   end function value_of_parameter

   !> Quantity of the parameter, as in `quantity_table`.
   pure function quantity_of(map) result(quantity)
      type(section_map_t), intent(in) :: map
      character(16) :: quantity

      integer :: forces

      quantity = 'frequency'
      if (map%parameter /= load_amplitude) return
      forces = count_forces(map%settings)
      associate (g => index_of_load(map))
         if (g > forces) then
            quantity = 'acceleration'
            if (map%settings%bases(g - forces)%quantity == base_displacement) quantity = 'displacement'
         else
            quantity = 'load'
            if (.not. allocated(map%settings%forces(g)%position)) quantity = 'line_load'
         end if
      end associate
   end function quantity_of

   !> Index of the load of the parameter, which is one of the harmonic loads, among all loads, forces first.
   pure integer function index_of_load(map) result(load_index)
      type(section_map_t), intent(in) :: map

      type(time_course_t), allocatable :: courses(:)
      integer, allocatable :: places(:)
      integer :: g

      allocate (courses, source=courses_of(map%settings))
      places = pack([(g, g=1, size(courses))], courses%kind == course_harmonic)
      load_index = places(map%load)
   end function index_of_load

   !> Settings with another value of the parameter, for a run that starts at the section with tau = 0. If the parameter
   !> is a frequency, the frequencies of all loads change in proportion.
   pure subroutine set_parameter(map, value, settings, period)
      type(section_map_t), intent(in) :: map
      real(wp), intent(in) :: value
      type(run_settings_t), intent(out) :: settings
      !> Period of the loads at that value, tau
      real(wp), intent(out) :: period

      real(wp) :: ratio
      integer :: forces, g

      settings = map%settings
      ratio = 1.0_wp
      if (map%parameter == load_frequency) ratio = value/value_of_parameter(map)
      period = map%period/ratio
      forces = count_forces(settings)
      if (allocated(settings%forces)) call shift_phase(settings%forces%course)
      if (allocated(settings%bases)) call shift_phase(settings%bases%course)
      if (map%parameter /= load_amplitude) return
      g = index_of_load(map)
      if (g <= forces) then
         settings%forces(g)%course%amplitude = value
      else
         settings%bases(g - forces)%course%amplitude = value
      end if

   contains

      !> Set the initial phase of a harmonic to its phase at the section.
      elemental subroutine shift_phase(course)
         type(time_course_t), intent(inout) :: course

         if (course%kind /= course_harmonic) return
         ! `anint`: number of periods of this harmonic in the common period, a whole number
         course%phase = course%phase + 2.0_wp*pi*map%section_phase*anint(map%period*course%frequency/(2.0_wp*pi))
         course%frequency = ratio*course%frequency
      end subroutine shift_phase
   end subroutine set_parameter

   !> Run from a section on or, if the state is empty, from the start of the scene (the input file).
   subroutine run_map(map, value, periods, state, response, error, samples)
      type(section_map_t), target, intent(inout) :: map
      !> Value of the parameter
      real(wp), intent(in) :: value
      !> Length of the run in load periods
      real(wp), intent(in) :: periods
      !> On entry state at the start, or empty; on return state at the end
      type(section_state_t), intent(inout) :: state
      !> The run; its sections are at phase 0 of the loads
      type(response_t), intent(out) :: response
      !> Set if the run fails
      type(failure_t), allocatable, intent(out) :: error
      !> If present, this number of sections at equal intervals is recorded instead
      integer, intent(in), optional :: samples

      ! maximum relative difference of two sections that count as equal
      real(wp), parameter :: equal_sections = 1.0e-3_wp
      type(run_settings_t) :: settings
      real(wp) :: period

      call set_parameter(map, value, settings, period)
      settings%response%duration = periods*period
      settings%response%step = settings%response%duration
      if (allocated(settings%poincare)) deallocate (settings%poincare)
      allocate (settings%poincare)
      associate (poincare => settings%poincare)
         ! the run starts (tau = 0) at the section, so phase 0 of the loads comes 1 - `section_phase` periods later
         poincare = poincare_settings_t(phase=modulo(1.0_wp - map%section_phase, 1.0_wp), skip=0, &
            keep=int(periods) + 1, tolerance=equal_sections, wants_exponent=.false., period=period)
         if (present(samples)) then
            poincare%phase = 0.0_wp
            poincare%keep = samples
            poincare%period = settings%response%duration/real(samples, wp)
         end if
      end associate
      call exact_response(map%model, settings, response, error, map%modes, map%sets, state)
   end subroutine run_map

   !> Evaluate the map and its derivative.
   subroutine evaluate_map(map, value, state, result)
      type(section_map_t), target, intent(inout) :: map
      !> Value of the parameter
      real(wp), intent(in) :: value
      type(section_state_t), intent(in) :: state
      type(map_result_t), intent(out) :: result

      type(failure_t), allocatable :: error
      ! length of the run, tau
      real(wp) :: length
      integer :: i, k
      ! number of modes
      integer :: modes
      ! number of unknowns
      integer :: total

      modes = size(state%q)
      total = 2*modes + size(map%branch_contacts)
      result%end = state
      allocate (result%end%tangent)
      associate (tangent => result%end%tangent)
         call allocate_tangent(modes, size(map%contacts), total + 1, tangent)
         do i = 1, modes
            tangent%q(i, i) = 1.0_wp
            tangent%v(i, modes + i) = 1.0_wp
         end do
         do k = 1, size(map%branch_contacts)
            tangent%branch_force(map%branch_contacts(k), 2*modes + k) = 1.0_wp
         end do
         tangent%parameter = map%parameter
         if (map%parameter /= no_parameter) tangent%load = index_of_load(map)
      end associate
      call run_map(map, value, real(map%periods, wp), result%end, result%response, error)
      result%failed = allocated(error)
      if (result%failed) return
      result%failed = any(result%end%is_closed .neqv. state%is_closed) .or. &
         any(result%end%is_deformed .neqv. state%is_deformed)
      allocate (result%unknowns, source=unknowns_of(map, result%end))
      allocate (result%derivative(total, total + 1))
      associate (tangent => result%end%tangent, derivative => result%derivative)
         derivative(:modes, :) = tangent%q
         derivative(modes + 1:2*modes, :) = tangent%v
         derivative(2*modes + 1:, :) = tangent%branch_force(map%branch_contacts, :)
         if (map%parameter == load_frequency) then
            ! the run ends earlier by length/value per unit of the frequency; after a run, `boundary_rates` holds
            ! the time derivatives of the state at its end
            length = result%response%sections%period*real(map%periods, wp)
            derivative(:, total + 1) = derivative(:, total + 1) - (length/value)*[tangent%boundary_rates%q, &
               tangent%boundary_rates%v, &
               tangent%boundary_rates%branch_force(map%branch_contacts)]
         end if
         result%min_speed = tangent%min_speed
      end associate
      deallocate (result%end%tangent)
      if (result%response%event_count == 0) return
      result%impacts = count(is_impact(result%response%events(:result%response%event_count)))
   end subroutine evaluate_map

   !> Unknowns of a state: modal displacements and velocities, and the forces P2 of the branches.
   pure function unknowns_of(map, state) result(x)
      type(section_map_t), intent(in) :: map
      type(section_state_t), intent(in) :: state
      real(wp), allocatable :: x(:)

      allocate (x, source=[state%q, state%v, state%branch_force(map%branch_contacts)])
   end function unknowns_of

   !> Set the unknowns of a state with the same closed contacts.
   pure subroutine set_unknowns(map, x, state, is_admissible)
      type(section_map_t), intent(in) :: map
      !> Unknowns, as `unknowns_of` gives them
      real(wp), intent(in) :: x(:)
      type(section_state_t), intent(inout) :: state
      !> Whether the state penetrates no contact
      logical, intent(out) :: is_admissible

      ! permitted penetration of a stop by rounding, eta
      real(wp), parameter :: max_penetration = 1.0e-11_wp
      real(wp) :: gap
      integer :: k, n

      n = size(state%q)
      state%q = x(:n)
      state%v = x(n + 1:2*n)
      state%branch_force(map%branch_contacts) = x(2*n + 1:)
      is_admissible = .true.
      do k = 1, size(map%contacts)
         associate (contact => map%contacts(k))
            gap = sum(map%value(:, k)*state%q) - contact%contact%height
            ! the surface of the stop touches the beam: it is closed, or open and moves with the beam (`is_deformed`)
            if (state%is_closed(k) .or. state%is_deformed(k)) then
               if (.not. contact%is_rigid) state%indentation(k) = -gap
            else
               ! an open stop bears no force, 0 = P = k u + P2, so P2 gives its remaining indentation u
               if (any(map%branch_contacts == k)) then
                  state%indentation(k) = max(0.0_wp, -state%branch_force(k)/contact%spring%stiffness)
                  state%branch_force(k) = -contact%spring%stiffness*state%indentation(k)
               end if
               is_admissible = is_admissible .and. gap + state%indentation(k) >= -max_penetration
            end if
         end associate
      end do
   end subroutine set_unknowns

   !> Set the units of the unknowns: in each mode the displacement and the velocity whose energy is the total energy of
   !> the motion; in rigid-body modes the displacement is this velocity times the period of the loads over 2 pi. The
   !> unit of the forces P2 has the value of that of velocities, because a force of 1 changes the velocity of a mass of
   !> 1 by 1 in a time of 1 (rho Abar L, 1/omega1). Units only weight the unknowns against each other in norms of
   !> residuals and of steps, so their exact values do not matter.
   pure subroutine find_units(map, state, range)
      type(section_map_t), intent(inout) :: map
      type(section_state_t), intent(in) :: state
      !> Range of the parameter, which is its unit
      real(wp), intent(in) :: range

      real(wp) :: frequency(size(map%modes%square)), velocity_unit

      frequency = merge(2.0_wp*pi/map%period, sqrt(map%modes%square), map%modes%square <= max_rigid_square)
      associate (square => map%modes%square)
         velocity_unit = sqrt(sum(square*state%q**2) + sum(state%v**2))
         if (.not. velocity_unit > 0.0_wp) velocity_unit = 1.0_wp
         map%unit = [velocity_unit/frequency, spread(velocity_unit, 1, size(state%v)), &
            spread(velocity_unit, 1, size(map%branch_contacts)), range]
      end associate
   end subroutine find_units

   !> Shift the section to the middle of the longest interval without events if events lie near the section: the map is
   !> discontinuous when an event passes the section.
   subroutine shift_section(map, value, state, response, is_shifted, error)
      type(section_map_t), target, intent(inout) :: map
      real(wp), intent(in) :: value
      !> State of the periodic motion at the section
      type(section_state_t), intent(inout) :: state
      !> Run over the periods of the motion
      type(response_t), intent(in) :: response
      !> Whether the section has been shifted; false: no event lies near it
      logical, intent(out) :: is_shifted
      !> Set if the run to the shifted section fails
      type(failure_t), allocatable, intent(out) :: error

      ! an event within this fraction of the load period from the section lies near it
      real(wp), parameter :: near = 0.01_wp
      type(response_t) :: unused
      ! instants of the events in load periods, [events]
      real(wp), allocatable :: instant(:)
      ! intervals from each event to the next in load periods, [events]
      real(wp), allocatable :: interval(:)
      ! shift of the section in load periods
      real(wp) :: shift
      ! length of the run in load periods
      real(wp) :: length
      ! index of the longest interval
      integer :: longest
      ! number of events
      integer :: n

      is_shifted = .false.
      n = response%event_count
      if (n == 0) return
      instant = response%events(:n)%tau/response%sections%period
      length = real(map%periods, wp)
      if (instant(1) > near .and. instant(n) < length - near) return
      ! the motion is periodic, so the last interval reaches to the first event of the next period
      interval = [instant(2:), instant(1) + length] - instant
      longest = maxloc(interval, dim=1)
      shift = modulo(instant(longest) + 0.5_wp*interval(longest), length)
      call run_map(map, value, shift, state, unused, error)
      if (allocated(error)) return
      map%section_phase = modulo(map%section_phase + shift, 1.0_wp)
      is_shifted = .true.
   end subroutine shift_section

end module section_map
