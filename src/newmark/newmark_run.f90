!> Data of a Newmark run with any number of contacts: the beam, the status of each contact, the present state, and its
!> position on the time grid, and quantities of a contact that follow from a state.
!>
!> Displacements are in D (eta), times in tau, forces in lambda1^4 E Ibar D/L^3. The gap of a contact is w . y - s d,
!> with w the row of the contact (module `contact_rows`), y the displacements of the degrees of freedom, d the
!> coordinate of the contact surface, and s = 1 for a contact below the beam, -1 for a contact above it. M, K and C are
!> the matrices of mass, stiffness and damping, M* and C* those with which the steps are taken (module
!> `newmark_stepper`).
module newmark_run
   use applied_loads, only: applied_loads_t
   use beam_model, only: recorded_point_t
   use compliant_stop, only: rounding_of_force, stop_step_t, compliant_stop_t
   use contact_measures, only: measurer_t
   use contact_rows, only: row_value, contact_row_t
   use failures, only: failure_t
   use free_modes, only: free_modes_t
   use kinds, only: i8, wp
   use modal_starts, only: modal_beam_t
   use moment_places, only: place_weights_t
   use newmark_stepper, only: deepest_level, newmark_state_t, newmark_stepper_t
   use response_types, only: moment_extremes_t
   use run_observers, only: observers_t
   use run_recorder, only: energy_balance_t
   use run_spectra, only: spectrum_sums_t
   use skyline_matrix, only: skyline_t
   use statistic_types, only: impact_t
   use step_intervals, only: step_interval_t
   use stop_contacts, only: contact_t
   use stress_windows, only: place_window_t
   implicit none (type, external)
   private
   public :: newmark_run_t, run_state_t, run_progress_t, contact_progress_t
   public :: whole_step, no_rejection, level_of, begins_now, no_stored_start, is_open, is_constrained, is_in_contact, &
      is_unloaded, is_inactive
   public :: instant_of, gap_at, gap_rate_at, indentation_at, spring_damper_force, is_force_free, force_rounding_at, &
      contact_energy, energy_left

   !> Length of the undivided step in units of the shortest step.
   integer(i8), parameter :: whole_step = 2_i8**deepest_level
   !> No rejected step ends after the present state.
   integer(i8), parameter :: no_rejection = -1_i8

   !> Status: the beam is away from the contact.
   integer, parameter :: is_open = 1
   !> Status: closed rigid contact.
   integer, parameter :: is_constrained = 2
   !> Status: closed compliant contact.
   integer, parameter :: is_in_contact = 3
   !> Status: a spring and damper is still deformed but carries no force, because the force would be tensile.
   integer, parameter :: is_unloaded = 4
   !> Status: the contact is inactive, because another rigid contact at the same point and on the same side lies in
   !> front of it. An inactive contact never closes.
   integer, parameter :: is_inactive = 5

   !> Value of `flight_events` if the flight begins at this instant.
   integer, parameter :: begins_now = -1
   !> Value of `flight_events` if the run has not stored the state at the beginning of the flight (before the first
   !> flight, or in a flight that began in an earlier run), so that the flight cannot be cancelled.
   integer, parameter :: no_stored_start = -2

   !> State of the beam and of the contacts (module `compliant_stop`).
   type :: run_state_t
      type(newmark_state_t) :: beam
      !> Force P = k u + P2 of each contact, [contacts]
      real(wp), allocatable :: force(:)
      !> Indentation u of the stop of each contact, [contacts]
      real(wp), allocatable :: indentation(:)
      !> Force P2 in the branch of each stop, [contacts]
      real(wp), allocatable :: branch_force(:)
      !> Instant at which the load was evaluated; at a jump of the load, just before or just after the jump
      real(wp) :: load_tau = 0.0_wp
   end type run_state_t

   !> Status and history of a contact. The type has no allocatable components, so that a copy restores it when a flight
   !> is cancelled.
   type :: contact_progress_t
      !> One of the status constants `is_open` to `is_inactive`
      integer :: status = is_open
      !> Whether a flight is in progress that has stayed below the hop height: if the flight ends below the hop height,
      !> a capture replaces it
      logical :: may_be_captured = .false.
      !> Maximum gap of the flight so far
      real(wp) :: peak = 0.0_wp
      !> Whether the contact may close; false after it opened, until the gap grows
      logical :: may_close = .true.
      !> Whether the beam penetrates the surface of the open contact by more than the contact tolerance, due to
      !> relaxation of the stop or rounding; steps with such a penetration are accepted
      logical :: is_penetrating = .false.
      !> Number of events of the run when the flight began, or one of `begins_now` and `no_stored_start`
      integer :: flight_events = no_stored_start
      !> Whether an impact brought the beam to rest on this rigid contact, and `resolve_contacts` has yet to decide by
      !> the reaction whether the contact closes
      logical :: is_stopped = .false.
      !> Whether that impact has been recorded as a capture, so that closing the contact is not recorded again
      logical :: is_captured = .false.
      !> Number of captures since the gap last exceeded the hop height, or an impact with restitution opened the contact
      integer :: captures = 0
      !> Gap at which contact began, within the contact tolerance of zero; the indentation is measured from this gap
      real(wp) :: shift = 0.0_wp
      !> End of the last step that was rejected because of this contact, in units of the shortest step since the
      !> beginning of the whole step (as `offset`): an event of the contact lies before this end. `no_rejection`: the
      !> end has passed
      integer(i8) :: rejected_end = no_rejection
      !> Energy dissipated at the contact, including losses at impacts
      real(wp) :: dissipated = 0.0_wp
      !> Losses at impacts
      real(wp) :: lost_at_impacts = 0.0_wp
      !> Energy dissipated without losses at impacts, at the end of the last step that was passed to observers
      real(wp) :: observed = 0.0_wp
      !> Number of flights since the start of the run
      integer :: flights = 0
   end type contact_progress_t

   !> A contact with its status.
   type, extends(contact_progress_t) :: newmark_contact_t
      !> Position, height and law
      type(contact_t) :: contact
      !> Row w
      type(contact_row_t) :: row
      !> Unallocated: the contact is rigid
      class(compliant_stop_t), allocatable :: stop
      !> Whether the stop is a spring and damper; its surface stays on the beam until the beam reaches the undeformed
      !> position
      logical :: is_viscous = .false.
      !> Compliant contact: minimum number of halvings of the first step after it closed
      integer :: contact_level = 0
      !> Work of the beam on the stop over the last trial step
      real(wp) :: work = 0.0_wp
   end type newmark_contact_t

   !> Coefficients of a step of given length, besides the factors of the stepper; A is the matrix of the step.
   type :: contact_factors_t
      !> Whether the coefficients have been computed
      logical :: made = .false.
      !> A^-1 w_j of each contact row, padded with zeros, [-2 : length + 3, contacts]
      real(wp), allocatable :: columns(:, :)
      !> Acceleration at contact j due to a unit force at contact l over the step, w_j . A^-1 w_l, [contacts, contacts]
      real(wp), allocatable :: gains(:, :)
      !> Coefficients of compliant contacts over the step, [contacts]
      type(stop_step_t), allocatable :: stops(:)
   end type contact_factors_t

   !> Position of a run on the time grid, and sums accumulated up to this position. The type has no allocatable
   !> components, so that a copy restores it.
   type :: run_progress_t
      !> Number of samples passed
      integer :: sample = 0
      !> Number of whole steps since the last sample
      integer :: step_in_sample = 0
      !> Position within the present whole step, in units of the shortest step
      integer(i8) :: offset = 0_i8
      !> Index of the next shape to record
      integer :: next_shape = 1
      !> Minimum number of halvings of the next step
      integer :: next_level = 0
      !> Index of the next instant at which a load jumps
      integer :: next_jump = 1
      !> Sum of the magnitudes of the work of loads over all steps
      real(wp) :: absolute_work = 0.0_wp
      !> Energies dissipated and supplied so far
      type(energy_balance_t) :: energy_balance
   end type run_progress_t

   !> State of the run at which the last flight after a rebound began.
   type :: flight_start_t
      !> State of beam and contacts
      type(run_state_t) :: state
      !> Position on the time grid, and accumulated sums
      type(run_progress_t) :: progress
      !> Status and history of each contact
      type(contact_progress_t), allocatable :: contacts(:)
      !> Measures of each contact
      type(measurer_t), allocatable :: measurers(:)
      !> Extremes of the moments, [places]
      type(moment_extremes_t), allocatable :: moments(:)
      !> Moments within the window of the statistics, [places]
      type(place_window_t), allocatable :: windows(:)
      !> Number of sections recorded
      integer :: sections = 0
      !> Number of the block of the statistics in progress (a run is divided into equal blocks); 0: none has begun
      integer :: block = 0
      !> Sums of that block, of the tip and of each contact, [sum_count, 0:contacts]
      real(wp), allocatable :: sums(:, :)
      !> Last impact at each contact
      type(impact_t), allocatable :: impacts(:)
      !> Whether the gap of each contact exceeded the hop tolerance since the last impact, [contacts]
      logical, allocatable :: has_separated(:)
      !> Integrals of spectra up to the beginning of the flight, if spectra are requested
      type(spectrum_sums_t) :: spectrum
   end type flight_start_t

   !> A run: beam, contacts, loads, present state and observers.
   type, extends(run_progress_t) :: newmark_run_t
      type(newmark_stepper_t) :: stepper
      !> The modes that are the degrees of freedom; unallocated: the degrees of freedom are those of the nodes
      type(free_modes_t), allocatable :: modes
      !> Rows of the contacts over these modes
      type(modal_beam_t) :: beam
      type(newmark_contact_t), allocatable :: contacts(:)
      !> Index of the release contact (`history_list`), to which the histories of the run refer; 0: there are no
      !> contacts
      integer :: release_contact = 1
      !> Recorded points, with their entries in state vectors
      type(recorded_point_t), allocatable :: points(:)
      !> Height d of that contact, in the unit of displacement
      real(wp) :: height = 0.0_wp
      !> Coefficients of steps of length step/2^level, computed at first use, [0:deepest_level]
      type(contact_factors_t) :: factors(0:deepest_level)
      !> M*^-1 w_j of each contact row, padded with zeros, [-2 : length + 3, contacts]
      real(wp), allocatable :: mass_columns(:, :)
      !> Mobility matrix of the contacts, w_j . M*^-1 w_l, [contacts, contacts]
      real(wp), allocatable :: mobility(:, :)
      !> Number of whole steps between two samples
      integer :: steps_per_sample = 1
      !> Time between two samples, tau
      real(wp) :: sample_step = 0.0_wp
      !> Number of samples after that at the start
      integer :: samples = 0
      !> Gap within which an approaching beam closes the contact
      real(wp) :: contact_tolerance = 0.0_wp
      !> Force below which a closed contact opens, if a longer step, which was rejected, made the force tensile
      real(wp) :: release_force = 0.0_wp
      !> Hop height: a flight after a rebound that never exceeds it counts as a capture
      real(wp) :: hop_height = 0.0_wp
      !> Maximum number of events
      integer :: event_limit = 0
      !> hbar/L, which is Pbar per unit of contact force
      real(wp) :: height_ratio = 0.0_wp
      !> Whether each step adds to the energy balance
      logical :: records_energy_balance = .false.
      !> Whether shapes are recorded
      logical :: records_shapes = .false.
      !> Whether an observer reads every step
      logical :: observes = .false.
      type(observers_t) :: observers
      !> The last step in the form that observers read
      type(step_interval_t) :: interval
      !> Displacement and rotation of the root among the degrees of freedom; 0: fixed
      integer :: root_dofs(2) = 0
      !> The present state at index `now`; at the other index the state before the last step, or the state at the end of
      !> the trial step
      type(run_state_t) :: states(2)
      !> Index of the present state in `states`
      integer :: now = 1
      !> Whether a flight begins that may count as a capture, so the present state has to be stored in `flight_start`
      logical :: begins_flight = .false.
      !> State at the beginning of the last such flight
      type(flight_start_t) :: flight_start
      !> Number of halvings of the first step after an impulse; negative: not known yet
      integer :: impulse_level = -1
      !> Applied loads
      type(applied_loads_t) :: loads
      !> Instants at which the loads may jump, tau
      real(wp), allocatable :: jumps(:)
      !> Weights of the bending moments at the requested positions; unallocated: no moments are requested
      type(place_weights_t), allocatable :: place_weights
      !> M* - M is this multiple of K plus `damping_acceleration_factor` times the damping matrix without its part in
      !> proportion to K
      real(wp) :: stiffness_acceleration_factor = 0.0_wp
      !> Factor of that damping matrix in M* - M
      real(wp) :: damping_acceleration_factor = 0.0_wp
      !> Damping proportional to M, as a multiple of M
      real(wp) :: mass_damping = 0.0_wp
      !> Whether damping is given for each mode
      logical :: has_modal_damping = .false.
      !> Matrix of modal damping, C* less its multiple of K
      type(skyline_t) :: mode_damping
      !> The factors of M
      type(skyline_t) :: bare_mass
      !> Energy of beam and stops at the start
      real(wp) :: start_energy = 0.0_wp
      !> Indices of the closed contacts in the equations for their forces, rigid contacts first, [contacts]; of
      !> `closed`, `rows` and `right` as many entries are used as contacts are closed
      integer, allocatable :: closed(:)
      !> Matrix of these equations, [contacts, contacts]
      real(wp), allocatable :: rows(:, :)
      !> Right side of these equations, and their solution, [contacts]
      real(wp), allocatable :: right(:)
      !> Whether the trial step violates the condition of each contact, [contacts]
      logical, allocatable :: violates(:)
      !> Whether an event of each contact lies ahead, because the contact rejected a longer step, [contacts]
      logical, allocatable :: event_ahead(:)
      !> Whether each contact closes at the end of the step, [contacts]
      logical, allocatable :: arrives(:)
      !> Whether each contact opens at the end of the step, [contacts]
      logical, allocatable :: leaves(:)
      !> Whether at least one contact may have an event ahead
      logical :: has_event_ahead = .false.
      !> Whether at least one stop is compliant
      logical :: has_compliant_stop = .false.
      !> Set if the run cannot continue
      type(failure_t), allocatable :: error
   end type newmark_run_t

contains

   !> Instant of the present state.
   pure real(wp) function instant_of(run, further) result(tau)
      type(newmark_run_t), intent(in) :: run
      !> Number of shortest steps after the present state
      integer(i8), intent(in), optional :: further

      real(wp), parameter :: shortest = 0.5_wp**deepest_level
      integer(i8) :: offset

      offset = run%offset
      if (present(further)) offset = offset + further
      tau = (real(run%sample, wp) + (real(run%step_in_sample, wp) + shortest*real(offset, wp)) &
         /real(run%steps_per_sample, wp))*run%sample_step
   end function instant_of

   !> Gap between the beam and the contact surface. The surface of an open three-element stop is still displaced by its
   !> indentation.
   pure real(wp) function gap_at(run, k, state) result(gap)
      type(newmark_run_t), intent(in) :: run
      !> Index of the contact
      integer, intent(in) :: k
      type(run_state_t), intent(in) :: state

      associate (contact => run%contacts(k))
         gap = row_value(contact%row, state%beam%displacement) - contact%contact%height
         if (.not. contact%is_viscous) gap = gap + state%indentation(k)
      end associate
   end function gap_at

   !> Rate of the gap while the contact is open.
   pure real(wp) function gap_rate_at(run, k, state) result(rate)
      type(newmark_run_t), intent(in) :: run
      !> Index of the contact
      integer, intent(in) :: k
      type(run_state_t), intent(in) :: state

      associate (contact => run%contacts(k))
         rate = row_value(contact%row, state%beam%velocity)
         if (contact%is_viscous) return
         if (state%indentation(k) > 0.0_wp) rate = rate - contact%stop%recovery_rate*state%indentation(k)
      end associate
   end function gap_rate_at

   !> Indentation of a closed contact.
   pure real(wp) function indentation_at(run, k, state) result(indentation)
      type(newmark_run_t), intent(in) :: run
      !> Index of the contact
      integer, intent(in) :: k
      type(run_state_t), intent(in) :: state

      associate (contact => run%contacts(k))
         indentation = contact%contact%height + contact%shift - row_value(contact%row, state%beam%displacement)
      end associate
   end function indentation_at

   !> Force of a spring and damper with the indentation u, k u + c du/dtau, which may be tensile.
   pure real(wp) function spring_damper_force(run, k, state) result(force)
      type(newmark_run_t), intent(in) :: run
      !> Index of the contact
      integer, intent(in) :: k
      type(run_state_t), intent(in) :: state

      associate (contact => run%contacts(k))
         force = contact%stop%stiffness*state%indentation(k) &
            - contact%stop%viscosity*row_value(contact%row, state%beam%velocity)
      end associate
   end function spring_damper_force

   !> Rounding error of the force of a compliant contact.
   pure real(wp) function force_rounding_at(run, k, state) result(force)
      type(newmark_run_t), intent(in) :: run
      !> Index of the contact
      integer, intent(in) :: k
      type(run_state_t), intent(in) :: state

      associate (contact => run%contacts(k))
         force = rounding_of_force(contact%stop, abs(contact%contact%height) &
            + abs(row_value(contact%row, state%beam%displacement)), abs(row_value(contact%row, state%beam%velocity)))
      end associate
   end function force_rounding_at

   !> Whether an unloaded spring and damper remains without force. A force up to the release force counts as zero only
   !> if the beam moves away, because the release force may be large beside the stiffness of the spring.
   pure logical function is_force_free(run, k, state)
      type(newmark_run_t), intent(in) :: run
      !> Index of the contact
      integer, intent(in) :: k
      type(run_state_t), intent(in) :: state

      real(wp) :: force

      force = spring_damper_force(run, k, state)
      is_force_free = force <= force_rounding_at(run, k, state) .or. &
         (force <= run%release_force .and. row_value(run%contacts(k)%row, state%beam%velocity) >= 0.0_wp)
   end function is_force_free

   !> Strain energy of the springs of a contact.
   pure real(wp) function contact_energy(run, k, state) result(energy)
      type(newmark_run_t), intent(in) :: run
      !> Index of the contact
      integer, intent(in) :: k
      type(run_state_t), intent(in) :: state

      energy = 0.0_wp
      associate (contact => run%contacts(k))
         if (allocated(contact%stop)) energy = contact%stop%energy(state%indentation(k), state%branch_force(k))
      end associate
   end function contact_energy

   !> Energy of beam and stops at the present state, computed from the energy balance; it agrees with the state to
   !> rounding.
   pure real(wp) function energy_left(run) result(energy)
      type(newmark_run_t), intent(in) :: run

      associate (balance => run%energy_balance)
         energy = run%start_energy + balance%work + balance%created - balance%dissipated_beam &
            - balance%dissipated_stop - balance%dissipated_impact
      end associate
   end function energy_left

   !> Number of halvings that make a step no longer than a given time.
   pure integer function level_of(step, time) result(level)
      !> Length of the undivided step
      real(wp), intent(in) :: step
      !> The time to resolve, tau
      real(wp), intent(in) :: time

      ! a change that takes less than 2^-30 of the step differs from an instantaneous change by less than rounding
      integer, parameter :: deepest_start = 30

      level = 0
      do while (level < deepest_start .and. scale(step, -level) > time)
         level = level + 1
      end do
   end function level_of

end module newmark_run
