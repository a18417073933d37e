!> Search for a periodic orbit by Newton's method from the final state of a run, and for branches of such orbits
!> (docs/theory.md, section 22).
module orbit_search
   use beam_model, only: beam_model_t
   use contact_sets, only: set_store_t
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use number_text, only: to_text
   use orbit_branches, only: trace_branches
   use orbit_newton, only: solve_orbit, initial_state_t, solution_t
   use orbit_settings, only: orbit_settings_t, vary_amplitude, vary_frequency, vary_nothing
   use orbit_types, only: orbit_study_t
   use response_types, only: response_t
   use run_settings, only: run_settings_t
   use section_map, only: find_units, open_section_map, quantity_of, run_map, section_map_t, shift_section, &
      value_of_parameter
   use tangent_columns, only: load_amplitude, load_frequency, no_parameter
   implicit none (type, external)
   private
   public :: find_orbits

   !> Number of intervals between the samples of an orbit in the results file.
   integer, parameter :: intervals = 400

contains

   !> Find the periodic orbit that a run approaches, and branches of such orbits.
   subroutine find_orbits(model, settings, options, study, error)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      !> Settings of &orbit
      type(orbit_settings_t), intent(in) :: options
      type(orbit_study_t), allocatable, intent(out) :: study
      !> Set if no orbit is found
      type(failure_t), allocatable, intent(out) :: error

      type(section_map_t), target :: map
      type(set_store_t), target :: sets
      type(solution_t) :: orbit
      type(run_settings_t) :: run_to_orbit

      map%sets => sets
      ! the number of modes is chosen for the run that leads to the orbit, not for that of the scene
      run_to_orbit = settings
      run_to_orbit%response%duration = real(options%skip, wp)*options%period
      call open_section_map(model, run_to_orbit, options%period, map, error)
      if (allocated(error)) return
      map%load = options%load
      map%parameter = no_parameter
      if (options%varied == vary_amplitude) map%parameter = load_amplitude
      if (options%varied == vary_frequency) map%parameter = load_frequency
      call find_first_orbit(map, options, orbit, error)
      if (allocated(error)) return
      allocate (study)
      study%orbit = orbit%point
      call record_orbit(map, orbit%initial, study, error)
      if (allocated(error) .or. options%varied == vary_nothing) return
      study%quantity = quantity_of(map)
      call trace_branches(map, options, orbit, study%branch)
   end subroutine find_orbits

   !> Find an orbit from the state after the transient of the run. Before Newton's method starts, the section is shifted
   !> away from events.
   subroutine find_first_orbit(map, options, orbit, error)
      type(section_map_t), target, intent(inout) :: map
      !> Settings of &orbit
      type(orbit_settings_t), intent(in) :: options
      type(solution_t), intent(out) :: orbit
      type(failure_t), allocatable, intent(out) :: error

      type(initial_state_t) :: guess
      type(response_t) :: response
      ! maximum number of attempts, each with a section away from the events of the last iterate
      integer, parameter :: max_rounds = 3
      integer :: i, round
      ! the section has been shifted away from events
      logical :: is_shifted

      guess%value = value_of_parameter(map)
      call run_map(map, guess%value, real(options%skip, wp), guess%state, response, error)
      if (allocated(error)) return
      map%periods = options%periods
      ! without a given period, the period of the motion at the end of the run is taken; 0: no period was found
      if (options%periods == 0) map%periods = response%sections%motion_period
      if (map%periods == 0) then
         call fail(error, status_run_failed, 'the motion does not repeat itself within 16 periods of the load: give ' &
            //'periods of &orbit, or a longer skip')
         return
      end if
      call find_units(map, guess%state, abs((options%max_ratio - options%min_ratio)*guess%value))
      do round = 1, max_rounds
         ! a second pass shifts the section again if the motion from the shifted section has other events near it
         do i = 1, 2
            call run_map(map, guess%value, real(map%periods, wp), guess%state, response, error)
            if (allocated(error)) return
            call shift_section(map, guess%value, guess%state, response, is_shifted, error)
            if (allocated(error)) return
            if (.not. is_shifted) exit
         end do
         guess%section_phase = map%section_phase
         call solve_orbit(map, guess, options%tolerance, options%max_steps, orbit)
         if (orbit%converged) return
         ! the events of the orbit may lie at other phases than those of the guess
         guess = orbit%initial
      end do
      call fail(error, status_run_failed, "Newton's method finds no motion that returns after "//to_text(map%periods) &
         //' periods of the load: after '//to_text(orbit%point%iterations)//' steps it misses its start by '// &
         to_text(orbit%point%residual)//' of its size; try another skip, periods or load')
   end subroutine find_first_orbit

   !> Record the orbit over one period of the orbit, from phase 0 of the loads on.
   subroutine record_orbit(map, initial, study, error)
      type(section_map_t), target, intent(inout) :: map
      type(initial_state_t), intent(in) :: initial
      type(orbit_study_t), intent(inout) :: study
      type(failure_t), allocatable, intent(out) :: error

      type(initial_state_t) :: start
      type(response_t) :: response
      ! samples of a history from phase 0 on, whose sample at the start is that at the end of the period
      integer, allocatable :: from_phase_0(:)
      integer :: k

      start = initial
      if (map%section_phase > 0.0_wp) then
         call run_map(map, start%value, 1.0_wp - map%section_phase, start%state, response, error)
         if (allocated(error)) return
      end if
      map%section_phase = 0.0_wp
      call run_map(map, start%value, real(map%periods, wp), start%state, response, error, intervals)
      map%section_phase = initial%section_phase
      if (allocated(error)) return
      associate (sections => response%sections)
         study%tau = [0.0_wp, sections%tau]
         from_phase_0 = [size(sections%tau), (k, k=1, size(sections%tau))]
         study%tip = sections%displacement(1, 0, from_phase_0)
         study%tip_velocity = sections%displacement(2, 0, from_phase_0)
         study%stop = sections%contact(1, :, from_phase_0)
         study%stop_velocity = sections%contact(2, :, from_phase_0)
      end associate
   end subroutine record_orbit

end module orbit_search
