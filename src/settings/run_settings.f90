!> Settings of one run besides its beam: stops, loads, initial conditions, method of integration, requested results.
!>
!> Dimensionless scales (docs/theory.md, section 2): lengths along the beam in its length L, displacements eta in D,
!> times tau = omega1 t, contact forces Pbar in lambda1^4 E Ibar D / (hbar L^2). If the beam is released above a stop, D
!> is |y_c(0) - d|, with y_c(0) the initial displacement at this stop and d the height of its surface, both above the
!> undeformed beam; in other starts D is a given scale. omega1 is the first natural circular frequency of the uniform
!> cantilever of mean section without tip mass; lambda1 = 1.875 is its frequency parameter, omega1 = lambda1^2 sqrt(E
!> Ibar / (rho Abar L^4)). A bar marks the mean section: hbar is the mean height. eta_c is the gap, the distance of the
!> beam from the surface of a stop.
module run_settings
   use history_list, only: history_count, history_table
   use kinds, only: wp
   use load_settings, only: base_settings_t, force_settings_t, start_settings_t
   use spectrum_settings, only: spectrum_settings_t
   implicit none (type, external)
   private
   public :: run_settings_t, stop_settings_t, response_settings_t, output_settings_t, stress_settings_t
   public :: statistics_settings_t, poincare_settings_t, relay_settings_t, body_settings_t, extra_dof_t
   public :: law_restitution, law_three_element, law_spring_damper, law_table
   public :: stops_of, stop_released_from, sort_keys, count_samples, end_of_run, is_within, moves_in_modes
   public :: side_below, side_above, side_both, side_names
   public :: impulse_momentum, impulse_nodal, impulse_names
   public :: method_exact, method_newmark, method_names
   public :: name_length, strict_mode_tolerance

   !> Maximum length of the name of a scene, a solver or a history.
   integer, parameter :: name_length = 64

   !> Model A of the paper (Irie, Yamada, Asano 1977): rigid contact with a coefficient of restitution.
   integer, parameter :: law_restitution = 1
   !> Model B of the paper: compliant contact, a spring in parallel with a Maxwell branch (spring and damper in series).
   integer, parameter :: law_three_element = 2
   !> Compliant contact, a spring in parallel with a damper; the contact force is never tensile.
   integer, parameter :: law_spring_damper = 3

   !> The stop is below the beam, as in the paper.
   integer, parameter :: side_below = 1
   !> The stop is above the beam.
   integer, parameter :: side_above = 2
   !> The stop is on both sides of the beam.
   integer, parameter :: side_both = 3

   !> The impulse of an impact changes the velocities of the whole beam (balance of momentum).
   integer, parameter :: impulse_momentum = 1
   !> An impact replaces only the velocity of the node at the stop, as in the paper.
   integer, parameter :: impulse_nodal = 2

   !> Exact solution in closed form between events.
   integer, parameter :: method_exact = 1
   !> Newmark's method; the step is halved at an event.
   integer, parameter :: method_newmark = 2

   !> A contact law.
   type :: law_t
      !> Name in scene files
      character(name_length) :: name
      !> Name in tables
      character(name_length) :: words
      !> Whether the law has a Maxwell branch, and so the component `branch_ratio`
      logical :: has_branch = .false.
   end type law_t

   !> The contact laws, such as `law_table(law_restitution)`.
   type(law_t), parameter :: law_table(3) = [ &
      law_t('restitution', 'restitution'), &
      law_t('three_element', 'three elements', has_branch=.true.), &
      law_t('spring_damper', 'spring and damper')]

   !> Names of these constants in scene files, such as `side_names(side_above)`.
   character(*), parameter :: side_names(3) = [character(name_length) :: 'below', 'above', 'both']
   character(*), parameter :: impulse_names(2) = [character(name_length) :: 'momentum', 'nodal']
   character(*), parameter :: method_names(2) = [character(name_length) :: 'exact', 'newmark']

   !> Settings of a &stop, dimensionless.
   type :: stop_settings_t
      !> Position Lc / L
      real(wp) :: position = 1.0_wp
      !> One of the `side_` constants
      integer :: side = side_below
      !> delta = d/D for a stop below the beam, -d/D for a stop above it, with d the height of its surface above the
      !> undeformed beam. delta > 0: the undeformed beam would penetrate the surface, so that the stop is preloaded at
      !> rest. A stop on both sides has delta = -(clearance to each side)/D
      real(wp) :: preload = 0.0_wp
      !> One of the `law_` constants
      integer :: law = law_restitution
      !> Coefficient of restitution eps, 0 to 1
      real(wp) :: restitution = 0.6_wp
      !> `impulse_momentum` or `impulse_nodal`
      integer :: impulse = impulse_momentum
      !> Stiffness kappa = k / (3 E Ibar / L^3) of the spring k of a compliant stop
      real(wp) :: stiffness_ratio = 1.0e4_wp
      !> beta, stiffness of the spring in the Maxwell branch over k
      real(wp) :: branch_ratio = 20.0_wp
      !> Damping c* = c omega1 / (3 E Ibar / L^3) of the damper, which is in the Maxwell branch or in parallel with the
      !> spring
      real(wp) :: damper_ratio = 0.3_wp
      !> Index of the extra degree of freedom to which the contact belongs; 0: the stop is fixed to the base
      integer :: partner = 0
      !> Whether the contact is between that degree of freedom and the base, instead of between it and the beam
      logical :: is_of_base = .false.
      !> Added to the height of the contact surface: the height if the coordinate of the body counts from z = 0
      real(wp) :: shift_to_zero = 0.0_wp
      !> Added to the height of the contact surface: the height if the coordinate counts from `rest`
      real(wp) :: shift_to_rest = 0.0_wp
   end type stop_settings_t

   !> Settings of a &body, a rigid body that moves in the direction of the deflection, dimensionless. Its displacement z
   !> relative to the base, positive upwards, is zero where its distance from the undeformed beam is `clearance`.
   type :: body_settings_t
      !> Position x / L of the contact between body and beam
      real(wp) :: position = 1.0_wp
      !> Mass m / (rho Abar L)
      real(wp) :: mass_ratio = 0.0_wp
      !> One of the `side_` constants: the body is below the beam, above it, or in a cavity of the beam
      integer :: side = side_below
      !> Distance of the undeformed beam from the body at z = 0, on each side, in D
      real(wp) :: clearance = 0.0_wp
      !> Stiffness k / (3 E Ibar / L^3) of the spring between body and base; 0: none
      real(wp) :: spring_ratio = 0.0_wp
      !> Damping ratio c / (2 sqrt(k m)) of the damper between body and base; 0 if `base_damper_ratio` is given
      real(wp) :: damping_ratio = 0.0_wp
      !> c omega1 / (3 E Ibar / L^3) of the damper between body and base; 0 if `damping_ratio` is given
      real(wp) :: base_damper_ratio = 0.0_wp
      !> z / D at which the spring between body and base has no force
      real(wp) :: rest = 0.0_wp
      !> Initial velocity dz/dt / (D omega1)
      real(wp) :: start_velocity = 0.0_wp
      !> Distance of the body from the beam at the start, in a cavity from its lower wall, in D; < 0: not given
      real(wp) :: start_gap = -1.0_wp
      !> Distance of a fixed floor below z = 0, in D; < 0: there is no floor
      real(wp) :: floor = -1.0_wp
      !> Distance of a fixed ceiling above z = 0, in D; < 0: there is no ceiling
      real(wp) :: ceiling = -1.0_wp
      !> Law and parameters of the contacts with the beam; other components are not used
      type(stop_settings_t) :: contact
      !> Law and parameters of the contacts with floor and ceiling; other components are not used
      type(stop_settings_t) :: base_contact
   end type body_settings_t

   !> A degree of freedom z besides those of the beam, of which contacts alone couple it to the beam: an oscillator
   !> z'' + r z' + W^2 z = 0 with a mass. A body is one.
   type :: extra_dof_t
      !> Name for messages
      character(name_length) :: name = ''
      !> Position x / L
      real(wp) :: position = 1.0_wp
      !> Mass in rho Abar L
      real(wp) :: mass = 1.0_wp
      !> W^2, squared circular frequency over omega1^2; 0: the mass moves freely
      real(wp) :: square = 0.0_wp
      !> r, damping rate over omega1; negative: that of the proportional damping of the beam, 2 (zeta W^2 + zeta_mass)
      real(wp) :: rate = 0.0_wp
      !> Displacement in D from which the run counts z
      real(wp) :: origin = 0.0_wp
      !> Displacement in D at which its spring has no force
      real(wp) :: rest = 0.0_wp
      !> z at the start, in D, unless the run starts in equilibrium
      real(wp) :: start_displacement = 0.0_wp
      !> Whether that displacement is relative to the beam instead of the base
      logical :: starts_from_beam = .false.
      !> dz/dtau at the start, in D
      real(wp) :: start_velocity = 0.0_wp
   end type extra_dof_t

   !> Tolerance of modal truncation, in eta, for reference runs with which the results of other runs are compared.
   real(wp), parameter :: strict_mode_tolerance = 1.0e-9_wp

   !> Settings of &response.
   type :: response_settings_t
      !> Length of the run, tau
      real(wp) :: duration = 20.0_wp
      !> Interval between samples, and Newmark's time step, d tau
      real(wp) :: step = 0.01_wp
      !> Method of integration: `method_exact` or `method_newmark`
      integer :: method = method_exact
      !> Newmark's beta: 1/4 average acceleration, 1/6 linear acceleration, 0 explicit
      real(wp) :: newmark_beta = 0.25_wp
      !> Newmark's gamma
      real(wp) :: newmark_gamma = 0.5_wp
      !> Whether Newmark's method divides a step that is too long for the scheme instead of refusing it
      logical :: substep = .false.
      !> Newmark: gap |eta_c| below which an approaching beam is in contact
      real(wp) :: contact_tolerance = 1.0e-4_wp
      !> Newmark: contact force Pbar below which a change of its sign opens the contact
      real(wp) :: release_tolerance = 1.0e-2_wp
      !> A flight that never rises above this value (in eta) is a hop: it does not count and is replaced by a closed
      !> contact
      real(wp) :: hop_tolerance = 1.0e-8_wp
      !> Maximum number of events; with more the run fails
      integer :: event_limit = 10000000
      !> `exact`: maximum change of the displacements of stops and tip due to modal truncation, relative to the maximum
      !> displacement
      real(wp) :: accuracy = 1.0e-4_wp
      !> `exact`: maximum change of the displacements of stops and tip due to modal truncation, in eta; huge: not given,
      !> only `accuracy` limits the change
      real(wp) :: mode_tolerance = huge(1.0_wp)
      !> Whether the exact method uses all modes of the mesh
      logical :: keep_all_modes = .false.
      !> `exact`: number of the lowest modes that are used; 0: as many as `accuracy` requires
      integer :: mode_count = 0
      !> Whether Newmark's method integrates in modes, chosen as for `exact`, even if `mode_count` is 0
      logical :: steps_in_modes = .false.
   end type response_settings_t

   !> Settings of &output: contents of the results file besides the events.
   type :: output_settings_t
      !> Which of the histories in `history_table` are recorded at the sample times
      logical :: history(history_count) = history_table%is_default
      !> Instants (tau) at which the shape and the velocity of the whole beam are stored
      real(wp), allocatable :: shape_times(:)
      !> Interval of further instants from 0 to the end, tau, at which shape and velocity are stored; 0: none
      real(wp) :: shape_step = 0.0_wp
      !> Number of mode shapes to store
      integer :: mode_shapes = 0
      !> Whether to store the energy balance: energies and energy losses
      logical :: energy = .false.
      !> Whether to compute the measures (scalar results of the run); the program sets this component and the next,
      !> scene files cannot
      logical :: measures = .false.
      !> Maximum number of rebounds whose peaks are among the measures
      integer :: max_peaks = huge(1)
   end type output_settings_t

   !> Settings of &stress: points at which the bending moment and the stress at the outer fibre are computed.
   type :: stress_settings_t
      !> x/L of the points
      real(wp), allocatable :: position(:)
      !> Whether to record the histories of moments and stresses, besides their extremes
      logical :: history = .true.
      !> Exponent m of the S-N curve, number of cycles times range**m = constant; 0: cycles are not counted
      real(wp) :: fatigue_slope = 0.0_wp
      !> Minimum change of stress between turning points that cycle counting uses, in E D/L; 0: 1 % of the range of
      !> stress
      real(wp) :: fatigue_threshold = 0.0_wp
      !> Number of classes of the histogram of cycles
      integer :: fatigue_classes = 20
      !> Number of turning points of the stress at a place after which cycles are not counted
      integer :: fatigue_limit = 1000000
      !> Strength of the material, a stress in the units of the scene; 0: not given
      real(wp) :: strength = 0.0_wp
   end type stress_settings_t

   !> Settings of &statistics.
   type :: statistics_settings_t
      !> Start of the part of the run that is evaluated, tau
      real(wp) :: start = 0.0_wp
      !> End of that part, tau; `huge`: the end of the run
      real(wp) :: end = huge(1.0_wp)
      !> Number of blocks of equal length, from whose means the statistical errors follow
      integer :: blocks = 10
      !> Two contacts belong to one impact if at most this time, tau, separates the end of the first from the start of
      !> the second
      real(wp) :: rest = 0.0_wp
      !> Contact force Pbar that a contact with a compliant stop must reach to count as an impact
      real(wp) :: threshold = 0.0_wp
      !> Number of classes of the histogram of impacts
      integer :: classes = 20
      !> Whether to compute statistics of accelerations too
      logical :: acceleration = .false.
   end type statistics_settings_t

   !> Settings of &relay: measures of the bouncing of a contact that closes.
   type :: relay_settings_t
      !> Contact force Pbar of the measure `force_lasts`, the instant from which on the contact force is at least as
      !> large; 0: not given
      real(wp) :: lasting_force = 0.0_wp
      !> Openings that are shorter do not count as bounces, tau
      real(wp) :: shortest_opening = 0.0_wp
   end type relay_settings_t

   !> Settings of &poincare: Poincare sections, states of the motion at a fixed phase of each period of the load.
   type :: poincare_settings_t
      !> Phase of the Poincare sections, as a fraction of the period, from tau = 0
      real(wp) :: phase = 0.0_wp
      !> Number of Poincare sections that are discarded at the start
      integer :: skip = 100
      !> Number of sections recorded after the discarded sections
      integer :: keep = 100
      !> Number of the harmonic load whose period is used, &force counts before &base; 0: the common period of all loads
      integer :: load = 0
      !> Maximum period of the motion that is tested, in periods of the load
      integer :: max_periods = 16
      !> Maximum distance between a state and its return after this period, relative to the maximum of the recorded
      !> states
      real(wp) :: tolerance = 1.0e-6_wp
      !> Whether to record the states of all modes too
      logical :: records_modes = .false.
      !> Whether to compute the largest Lyapunov exponent
      logical :: wants_exponent = .true.
      !> Whether the scene gives no duration, so that the run lasts skip + keep periods of the load
      logical :: sets_duration = .false.
      !> Period of the load, tau, from `period_of`
      real(wp) :: period = 0.0_wp
   end type poincare_settings_t

   !> Settings of one run.
   type :: run_settings_t
      !> Stiffness-proportional damping C = gamma K: zeta = gamma omega1 / 2, the damping ratio of a mode with omega1
      real(wp) :: zeta = 0.0_wp
      type(stop_settings_t) :: stop
      type(response_settings_t) :: response
      type(output_settings_t) :: output
      !> hbar/L, mean height over length; the scale of Pbar contains it
      real(wp) :: height_ratio = 0.075_wp
      !> Stops besides `stop`; unallocated: none
      type(stop_settings_t), allocatable :: more_stops(:)
      !> Degrees of freedom besides those of the beam, in the order of &body; their contacts are among the stops.
      !> Unallocated: none
      type(extra_dof_t), allocatable :: extra_dofs(:)
      !> Number of the stop from which the beam is released; `stop` is number 1
      integer :: release_stop = 1
      !> Whether the run has stops; if not, `stop%position` is the point whose histories are recorded
      logical :: has_stop = .true.
      !> Loads on the beam; unallocated: there are none
      type(force_settings_t), allocatable :: forces(:)
      !> Motions of the base; unallocated: there are none
      type(base_settings_t), allocatable :: bases(:)
      !> Initial conditions
      type(start_settings_t) :: start
      !> Mass-proportional damping C = alpha M: zeta_mass = alpha / (2 omega1)
      real(wp) :: zeta_mass = 0.0_wp
      !> Damping ratios of the modes, in place of `zeta` and `zeta_mass`; the last ratio holds for all higher modes too.
      !> Unallocated: not given
      real(wp), allocatable :: mode_ratios(:)
      !> Unallocated: no stresses are computed
      type(stress_settings_t), allocatable :: stress
      !> Unallocated: no statistics are computed
      type(statistics_settings_t), allocatable :: statistics
      !> Unallocated: the bouncing of contacts is not measured
      type(relay_settings_t), allocatable :: relay
      !> Unallocated: no Poincare sections are recorded
      type(poincare_settings_t), allocatable :: poincare
      !> Unallocated: no spectra are computed
      type(spectrum_settings_t), allocatable :: spectrum
   end type run_settings_t

contains

   !> All stops of a run, in the order of the scene.
   pure function stops_of(settings) result(stops)
      type(run_settings_t), intent(in) :: settings
      type(stop_settings_t), allocatable :: stops(:)

      allocate (stops(0))
      if (settings%has_stop) stops = [settings%stop]
      if (settings%has_stop .and. allocated(settings%more_stops)) stops = [stops, settings%more_stops]
   end function stops_of

   !> Number of samples after the start: whole steps within the duration, with an allowance for rounding of the
   !> quotient.
   pure integer function count_samples(duration, step) result(samples)
      !> Length of the run
      real(wp), intent(in) :: duration
      !> Interval between samples
      real(wp), intent(in) :: step

      samples = int(duration/step*(1.0_wp + 8.0_wp*epsilon(1.0_wp)))
   end function count_samples

   !> Whether an instant is within a duration, except for rounding.
   elemental logical function is_within(instant, duration) result(answer)
      real(wp), intent(in) :: instant
      real(wp), intent(in) :: duration

      answer = instant <= duration*(1.0_wp + 8.0_wp*epsilon(1.0_wp))
   end function is_within

   !> Whether the run is computed in modes of the beam: exact motion, and Newmark's method if the settings ask for
   !> modes.
   pure logical function moves_in_modes(response) result(answer)
      type(response_settings_t), intent(in) :: response

      answer = response%method == method_exact .or. response%steps_in_modes .or. response%mode_count > 0
   end function moves_in_modes

   !> The end of a run, tau; with Newmark's method the run ends at the last sample.
   pure real(wp) function end_of_run(response) result(tau)
      type(response_settings_t), intent(in) :: response

      tau = response%duration
      if (response%method == method_newmark) tau = min(tau, real(count_samples(tau, response%step), wp)*response%step)
   end function end_of_run

   !> Number of the stop from which the beam is released. If the scene does not choose one: the stop nearest to the tip.
   !> Among stops at one position, a stop below the beam precedes a stop above, which precedes one on both sides; then
   !> the largest preload decides, then the other settings. The order of the stops in the file has no effect, because
   !> stops with equal settings are interchangeable.
   pure integer function stop_released_from(stops, chosen) result(number)
      type(stop_settings_t), intent(in) :: stops(:)
      !> Number that the scene chooses; 0: none
      integer, intent(in) :: chosen

      real(wp) :: best_keys(9), candidate_keys(9)
      integer :: i, key

      number = chosen
      if (number > 0) return
      number = 1
      do i = 2, size(stops)
         best_keys = sort_keys(stops(number))
         candidate_keys = sort_keys(stops(i))
         key = findloc(abs(best_keys - candidate_keys) > 0.0_wp, .true., dim=1)
         if (key == 0) cycle
         if (candidate_keys(key) < best_keys(key)) number = i
      end do
   end function stop_released_from

   !> Sort keys of a stop for `stop_released_from`, in order of priority; the stop with the smallest keys is chosen.
   pure function sort_keys(stop) result(values)
      type(stop_settings_t), intent(in) :: stop
      real(wp) :: values(9)

      values = [-stop%position, real(stop%side, wp), -stop%preload, real(stop%law, wp), real(stop%impulse, wp), &
         -stop%restitution, stop%stiffness_ratio, stop%branch_ratio, stop%damper_ratio]
   end function sort_keys

end module run_settings
