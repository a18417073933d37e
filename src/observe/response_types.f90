!> Result of a run: events, histories at equal time steps, shapes of the whole beam, energies, and measures (scalar
!> results). Both methods (`newmark`, `exact`) fill it; files and tables are written from it.
!>
!> All values are dimensionless (docs/theory.md, section 2): displacement eta = (y - d)/D, time tau = omega1 t, mass in
!> rho Abar L. Here d is the height of the release contact; D is the initial distance y_c(0) - d of the beam from this
!> contact in a release, and a given scale in other starts. Energies are therefore in rho Abar L omega1^2 D^2, impulses
!> in rho Abar L omega1 D, and forces are Pbar of Irie, Yamada and Asano (1977).
module response_types
   use history_list, only: history_count
   use kinds, only: i8, wp
   use measure_list, only: contact_owner_t
   use mesh_checks, only: mesh_check_t
   use section_types, only: run_sections_t
   use signal_peaks, only: extreme_search_t, peak_tolerance
   use spectrum_types, only: run_spectrum_t
   use statistic_types, only: run_statistics_t
   implicit none (type, external)
   private
   public :: response_t, event_t, point_record_t, contact_record_t, moment_record_t, moment_extremes_t, &
      moment_window_t, &
      append_event, event_names
   public :: event_impact, event_capture, event_release, event_contact, event_separation, event_closed_impulse
   public :: is_contact_start, is_contact_end, is_closed_start, is_impact, balance_error
   public :: mode_check_t, run_measures_t, closing_measures_t, settling_level, settled_energy

   !> Rigid stop (model A): the beam hits the stop and rebounds.
   integer, parameter :: event_impact = 1
   !> Rigid stop (model A): the beam comes to rest on the stop; the contact closes, or opens at once if the reaction
   !> would be tensile.
   integer, parameter :: event_capture = 2
   !> Rigid stop (model A): a closed contact opens.
   integer, parameter :: event_release = 3
   !> Compliant stop (model B): contact begins.
   integer, parameter :: event_contact = 4
   !> Compliant stop (model B): contact ends.
   integer, parameter :: event_separation = 5
   !> Rigid stop (model A): impulse on a closed contact during an impact at another contact.
   integer, parameter :: event_closed_impulse = 6
   !> Names of the events in results files and tables; 'impulse' is an impulse on a closed contact.
   character(*), parameter :: event_names(6) = [character(10) :: 'impact', 'capture', 'release', 'contact', &
      'separation', 'impulse']

   !> Settling level: the motion has settled when |eta_c| stays below it; a flight that rises above it is a rebound.
   real(wp), parameter :: settling_level = 0.02_wp
   !> The energy has decayed when at most this fraction of the initial energy is left, both above the energy at rest.
   real(wp), parameter :: settled_energy = 0.01_wp

   !> An event: an instant at which contacts open, close or are hit.
   type :: event_t
      !> Instant
      real(wp) :: tau = 0.0_wp
      !> One of the `event_` constants
      integer :: kind = 0
      !> Displacement eta of the beam at the contact
      real(wp) :: eta = 0.0_wp
      !> Velocity d eta/d tau of the beam at the contact before the event
      real(wp) :: velocity_before = 0.0_wp
      !> Velocity of the beam at the contact after the event
      real(wp) :: velocity_after = 0.0_wp
      !> Impulse on the beam, positive away from the stop
      real(wp) :: impulse = 0.0_wp
      !> Change of the energy of the beam at the event
      real(wp) :: energy_change = 0.0_wp
      !> Number of the contact in the scene's order, below before above
      integer :: contact = 1
   end type event_t

   !> Energies at the sample times. Kinetic + strain + stop + dissipated_* - created - work is constant.
   type :: energy_t
      !> Kinetic energy of beam and tip mass; by Newmark's method with the mass matrix M* (module `newmark_stepper`)
      real(wp), allocatable :: kinetic(:)
      !> Strain energy of the beam
      real(wp), allocatable :: strain(:)
      !> Strain energy of the springs of the stops
      real(wp), allocatable :: stop(:)
      !> Energy dissipated inside the beam since the start, including the numerical dissipation if gamma > 1/2
      real(wp), allocatable :: dissipated_beam(:)
      !> Energy dissipated in the stops since the start
      real(wp), allocatable :: dissipated_stop(:)
      !> Energy dissipated at impacts since the start
      real(wp), allocatable :: dissipated_impact(:)
      !> Energy created since the start where an impact replaces the velocity of a node alone (`impulse = 'nodal'`)
      real(wp), allocatable :: created(:)
      !> Work of forces and of the base since the start; unallocated: there are none
      real(wp), allocatable :: work(:)
   end type energy_t

   !> How a contact closes: its bounces, and its force afterwards. NaN: not defined.
   type :: closing_measures_t
      !> Number of openings after the first closing
      integer :: bounces = 0
      !> Time from the first to the final closing, tau
      real(wp) :: bounce_time = 0.0_wp
      !> Instant of the last opening, tau
      real(wp) :: last_opening = 0.0_wp
      !> Instant of the final closing, after which the contact is closed to the end of the run, tau
      real(wp) :: final_closing = 0.0_wp
      !> Minimum of the contact force, as Pbar, after the maximum that follows the final closing
      real(wp) :: minimum_force = 0.0_wp
      !> Static contact force at the end of the run, as Pbar
      real(wp) :: static_force = 0.0_wp
      !> Whether a `lasting_force` is given in &relay
      logical :: has_lasting_force = .false.
      !> Instant from which the contact force stays at least as large, tau
      real(wp) :: force_lasts = 0.0_wp
   end type closing_measures_t

   !> Measures of a run: when and how hard the beam hits, how long it stays in contact, how high it rebounds, when it
   !> settles. The measures follow from phases or steps and from events, not from samples, so they do not depend on the
   !> recorded histories.
   type :: run_measures_t
      !> Length of the run, tau
      real(wp) :: duration = 0.0_wp
      !> Number of impacts on rigid stops, or of contacts with compliant stops
      integer :: impacts = 0
      !> Beginning of each time in contact, a capture or the beginning of a contact, tau
      real(wp), allocatable :: contact_start(:)
      !> End of each time in contact: a release, a separation, or the end of the run, tau
      real(wp), allocatable :: contact_end(:)
      !> Whether the beam has hit a stop
      logical :: has_hit_stop = .false.
      !> Instant of the first impact, tau; not set if there is none
      real(wp) :: first_impact_tau = 0.0_wp
      !> d eta/d tau before the first impact
      real(wp) :: first_impact_velocity = 0.0_wp
      !> Longest time in contact, tau
      real(wp) :: longest_contact = 0.0_wp
      !> Total time in contact, tau
      real(wp) :: total_contact = 0.0_wp
      !> Tolerance of peaks and of extremes of moments and statistics, as a fraction of the value
      real(wp) :: extremes_tolerance = peak_tolerance
      !> Maximum force of compliant contacts, as Pbar; negative: there is none
      real(wp) :: greatest_force = -1.0_wp
      !> Maximum over all episodes (module `run_measures`) of rigid contacts of the mean force over `force_window` from
      !> the beginning of the episode, as Pbar; negative: there is no rigid contact
      real(wp) :: greatest_mean_force = -1.0_wp
      !> Maximum impulse of an episode, less the impulse of the force at rest during its contacts
      real(wp) :: greatest_impulse = 0.0_wp
      !> Number of rebounds
      integer :: rebounds = 0
      !> Peak eta of each rebound; if there are many, only of the first
      real(wp), allocatable :: peak_eta(:)
      !> Instant of each peak, tau
      real(wp), allocatable :: peak_tau(:)
      !> Whether |eta_c| does not exceed `settling_level` at the end of the run
      logical :: has_settled = .false.
      !> Instant at which |eta_c| last exceeded that level
      real(wp) :: settling_tau = 0.0_wp
      !> Whether the energy has decayed to the fraction `settled_energy` at the end of the run
      logical :: has_decayed = .false.
      !> Instant at which the energy last exceeded that fraction
      real(wp) :: decay_tau = 0.0_wp
      !> Energy at the start
      real(wp) :: start_energy = 0.0_wp
      !> Energy of the beam at rest
      real(wp) :: rest_energy = 0.0_wp
      !> Energy at the end
      real(wp) :: final_energy = 0.0_wp
      !> Energy dissipated in the beam, as a fraction of the initial energy above that at rest, like the next four
      real(wp) :: lost_beam = 0.0_wp
      !> Energy dissipated in the stops
      real(wp) :: lost_stop = 0.0_wp
      !> Energy dissipated at impacts
      real(wp) :: lost_impact = 0.0_wp
      !> Energy created by impacts that replace the velocity of one node
      real(wp) :: created = 0.0_wp
      !> Energy left at the end
      real(wp) :: left = 0.0_wp
      !> Whether bending moments are requested
      logical :: has_moment = .false.
      !> Maximum magnitude of the moment over all places of &stress
      real(wp) :: greatest_moment = 0.0_wp
      !> Whether stresses are defined at all places
      logical :: has_stress = .false.
      !> Maximum magnitude of the stress over all places, in E D/L
      real(wp) :: greatest_stress = 0.0_wp
      !> Instant of that stress, tau
      real(wp) :: greatest_stress_tau = 0.0_wp
      !> Position x/L of that stress
      real(wp) :: greatest_stress_position = 0.0_wp
      !> Maximum range of the stress at one place
      real(wp) :: stress_range = 0.0_wp
      !> Minimum, maximum and range of moments, then of stresses, over all places, within the window of &statistics,
      !> [6]. NaN: not defined; unallocated: not requested
      real(wp), allocatable :: steady(:)
      !> Number of stress cycles, and their damage-equivalent range, at the place where the latter is largest, [2];
      !> unallocated: not requested
      real(wp), allocatable :: fatigue(:)
      !> Number of elements of the mesh
      integer :: mesh_elements = 0
      !> How the contact closes; unallocated: not requested
      type(closing_measures_t), allocatable :: closing
      !> Statistics of all contacts together, [statistic_count]; unallocated: not requested
      real(wp), allocatable :: statistics(:)
      !> Statistics of each of several stops, [statistics of a stop, stops]; unallocated: there are none
      real(wp), allocatable :: of_stops(:, :)
      !> Measures by analyses of the finished run, [measure_count], NaN for the others; unallocated: no analyses
      real(wp), allocatable :: of_analyses(:)
      !> Whether Poincare sections are requested
      logical :: has_sections = .false.
      !> Period of the motion in periods of the load; 0: none was found
      integer :: motion_period = 0
      !> Impacts per period of the load
      real(wp) :: impacts_per_period = 0.0_wp
      !> Lyapunov exponent, per tau
      real(wp) :: lyapunov_exponent = 0.0_wp
   end type run_measures_t

   !> Number of modes of a run, and the trials by which this number was chosen.
   type :: mode_check_t
      !> Number of modes retained
      integer :: retained = 0
      !> Number of modes of the mesh
      integer :: all_modes = 0
      !> Number of modes of the trial that was compared with the trial in the retained modes; 0: there was no comparison
      integer :: compared_modes = 0
      !> End of the comparison, tau
      real(wp) :: horizon = 0.0_wp
      !> Maximum difference in eta of stops and tip up to the end of the comparison
      real(wp) :: difference = 0.0_wp
      !> Maximum difference in the extremes of the moments of &stress, over the maximum moment
      real(wp) :: moment_difference = 0.0_wp
      !> Requested tolerance of eta
      real(wp) :: tolerance = 0.0_wp
      !> Whether the difference is so small that the retained modes are accepted
      logical :: agrees = .false.
      !> Whether loads and stops act after the horizon, too: small differences of motions can then grow without limit,
      !> and only statistics remain comparable
      logical :: persists = .false.
      !> Evaluations in trials
      integer(i8) :: evaluations = 0_i8
      !> Sum over the trials of evaluations times modes
      real(wp) :: work = 0.0_wp
   end type mode_check_t

   !> A history; unallocated: not requested.
   type :: series_t
      real(wp), allocatable :: values(:)
   end type series_t

   !> Histories and measures of one of several contacts.
   type, extends(contact_owner_t) :: contact_record_t
      !> Position Lc/L
      real(wp) :: position = 1.0_wp
      !> Height d of the contact surface in the unit of displacement
      real(wp) :: height = 0.0_wp
      !> y - d at the sample times, with y the displacement of the beam; unallocated: not requested
      real(wp), allocatable :: eta(:)
      !> Velocity y' at the sample times; unallocated: not requested
      real(wp), allocatable :: velocity(:)
      !> Contact force Pbar >= 0 at the sample times; unallocated: not requested
      real(wp), allocatable :: force(:)
      !> Acceleration y'' of the beam at the sample times; unallocated: not requested
      real(wp), allocatable :: acceleration(:)
      !> Strain energy of the stop at the sample times
      real(wp), allocatable :: energy(:)
      !> Energy dissipated at the contact since the start, at the sample times
      real(wp), allocatable :: dissipated(:)
      !> Measures of the contact; those that describe the whole run (rebounds, settling time, energies) are not valid
      type(run_measures_t), allocatable :: measures
   end type contact_record_t

   !> Extremes of a bending moment.
   type :: moment_extremes_t
      !> Minimum of the moment, signed; the initial value means that nothing has been measured
      real(wp) :: minimum = huge(1.0_wp)
      !> Instant of the minimum, tau
      real(wp) :: minimum_tau = 0.0_wp
      !> Maximum of the moment, signed; the initial value means that nothing has been measured
      real(wp) :: maximum = -huge(1.0_wp)
      !> Instant of the maximum, tau
      real(wp) :: maximum_tau = 0.0_wp
   end type moment_extremes_t

   !> Bending moment and stress at a place of the beam. Moments are in the unit of Pbar times L, positive if the beam is
   !> bent upwards; stresses are in E D/L.
   type, extends(moment_extremes_t) :: moment_record_t
      !> Position x/L
      real(wp) :: position = 0.0_wp
      !> Stress at the outer fibre below the axis, positive in tension, per moment
      real(wp) :: stress_per_moment = 0.0_wp
      !> Whether the stress is defined at this place
      logical :: has_stress = .false.
      !> Moment at the sample times; unallocated: not requested
      real(wp), allocatable :: moment(:)
      !> Tolerance of the searches for the minimum, and number of evaluations that remain for them
      type(extreme_search_t) :: minimum_search
      !> The same for the maximum
      type(extreme_search_t) :: maximum_search
   end type moment_record_t

   !> Moment at a place within the window of &statistics, and cycles of its stress.
   type :: moment_window_t
      !> Beginning and end of the window, tau
      real(wp) :: window(2) = 0.0_wp
      !> Minimum and maximum of the moment, signed
      real(wp) :: extremes(2) = 0.0_wp
      !> Tolerance of both as a fraction of the maximum
      real(wp) :: tolerance = peak_tolerance
      !> Exponent m of the S-N curve; 0: cycles are not counted
      real(wp) :: slope = 0.0_wp
      !> Number of stress cycles
      real(wp) :: cycles = 0.0_wp
      !> Range at which the same number of equal cycles would do the same fatigue damage
      real(wp) :: equivalent_range = 0.0_wp
      !> Instant up to which cycles are counted, tau: the end of the window, unless there are too many turning points
      real(wp) :: counted_until = 0.0_wp
      !> Upper edges of the classes of ranges in the histogram, [classes]; unallocated: not counted
      real(wp), allocatable :: class_edge(:)
      !> Number of cycles in each class, [classes]
      real(wp), allocatable :: class_cycles(:)
   end type moment_window_t

   !> Histories of a recorded point with the displacement z.
   type :: point_record_t
      !> Position x/L
      real(wp) :: position = 0.0_wp
      !> Displacement z at the sample times; unallocated: not requested
      real(wp), allocatable :: displacement(:)
      !> Velocity z' at the sample times; unallocated: not requested
      real(wp), allocatable :: velocity(:)
      !> Sum of all contact forces on it, as Pbar, positive upwards, at the sample times; unallocated: not
      !> requested
      real(wp), allocatable :: force(:)
      !> z at which its spring has no force
      real(wp) :: rest = 0.0_wp
   end type point_record_t

   !> Result of a run.
   type :: response_t
      !> Events in order; only the first `event_count` are valid
      type(event_t), allocatable :: events(:)
      !> Number of events
      integer :: event_count = 0
      !> Sample times
      real(wp), allocatable :: tau(:)
      !> Histories in the order of `history_table`, at the sample times
      type(series_t) :: history(history_count)
      !> Contacts in the scene's order, below before above; unallocated: there is one contact
      type(contact_record_t), allocatable :: contacts(:)
      !> Recorded points of the model; unallocated: there are none
      type(point_record_t), allocatable :: points(:)
      !> Moments at the requested places, in the scene's order; unallocated: not requested
      type(moment_record_t), allocatable :: moments(:)
      !> Moments at the requested places within the window of &statistics; unallocated: not requested
      type(moment_window_t), allocatable :: moment_windows(:)
      !> Energies; unallocated: not requested
      type(energy_t), allocatable :: energy
      !> Measures; unallocated: not requested
      type(run_measures_t), allocatable :: measures
      !> Statistics; unallocated: not requested
      type(run_statistics_t), allocatable :: statistics
      !> Poincare sections; unallocated: not requested
      type(run_sections_t), allocatable :: sections
      !> Power spectra of the segments; unallocated: not requested
      type(run_spectrum_t), allocatable :: spectrum
      !> Whether each contact, in the scene's order, was closed at the start of a run that continues another;
      !> unallocated: the run does not continue another
      logical, allocatable :: starts_closed(:)
      !> Instants of the recorded shapes of the whole beam
      real(wp), allocatable :: shape_tau(:)
      !> Displacement eta at the nodes, clamp first, [nodes, instants]
      real(wp), allocatable :: shape_displacement(:, :)
      !> Slope d eta/d(x/L), [nodes, instants]
      real(wp), allocatable :: shape_slope(:, :)
      !> Velocity d eta/d tau, [nodes, instants]
      real(wp), allocatable :: shape_velocity(:, :)
      !> Rate of the slope d/d tau, [nodes, instants]
      real(wp), allocatable :: shape_slope_velocity(:, :)
      !> Energy at the start
      real(wp) :: initial_energy = 0.0_wp
      !> Number of steps taken (newmark) or of modal sums evaluated (exact)
      integer(i8) :: evaluations = 0_i8
      !> Number of rejected steps (newmark)
      integer(i8) :: rejected = 0_i8
      !> Number of factorisations (newmark) or eigenvalue problems (exact)
      integer :: factorisations = 0
      !> How the number of modes was chosen (exact)
      type(mode_check_t) :: mode_check
      !> How the mesh was chosen
      type(mesh_check_t) :: mesh_check
   end type response_t

contains

   !> Append an event; the array grows by doubling.
   pure subroutine append_event(response, event)
      !> The run that receives the event
      type(response_t), intent(inout) :: response
      type(event_t), intent(in) :: event

      if (.not. allocated(response%events)) allocate (response%events(64))
      ! twice as many; the second half is overwritten
      if (response%event_count == size(response%events)) response%events = [response%events, response%events]
      response%event_count = response%event_count + 1
      response%events(response%event_count) = event
   end subroutine append_event

   !> Maximum error of the energy balance at the samples of a run.
   pure real(wp) function balance_error(response) result(max_error)
      !> The run, with its energies
      type(response_t), intent(in) :: response

      real(wp) :: excess(size(response%energy%kinetic))

      associate (e => response%energy)
         excess = e%kinetic + e%strain + e%stop + e%dissipated_beam + e%dissipated_stop + e%dissipated_impact &
            - e%created - response%initial_energy
         if (allocated(e%work)) excess = excess - e%work
      end associate
      max_error = maxval(abs(excess))
   end function balance_error

   !> Whether an event of this kind begins a closed contact.
   elemental logical function is_contact_start(kind) result(starts)
      !> One of the `event_` constants
      integer, intent(in) :: kind

      starts = kind == event_capture .or. kind == event_contact
   end function is_contact_start

   !> Whether an event is the beginning of a contact that is closed at rest at the start of the run. It is no impact,
   !> because the contact was not open before.
   elemental logical function is_closed_start(event) result(answer)
      type(event_t), intent(in) :: event

      answer = is_contact_start(event%kind) .and. .not. event%tau > 0.0_wp .and. &
         .not. abs(event%velocity_before) > 0.0_wp
   end function is_closed_start

   !> Whether an event is an impact on a rigid stop or the beginning of a contact with a compliant one.
   elemental logical function is_impact(event) result(answer)
      type(event_t), intent(in) :: event

      answer = (event%kind == event_impact .or. event%kind == event_contact) .and. .not. is_closed_start(event)
   end function is_impact

   !> Whether an event of this kind ends a closed contact.
   elemental logical function is_contact_end(kind) result(ends)
      !> One of the `event_` constants
      integer, intent(in) :: kind

      ends = kind == event_release .or. kind == event_separation
   end function is_contact_end

end module response_types
