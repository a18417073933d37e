!> What a run through time is made of besides its beam: the stop, the method, what to keep.
!>
!> Scales: lengths along the beam in L, displacements in y_c(0) - d, times tau = omega1 t with omega1 of the uniform
!> beam of mean section without tip mass.
module run_settings
   use history_list, only: history_count
   use kinds, only: wp
   use load_settings, only: base_settings_t, force_settings_t, start_settings_t
   implicit none (type, external)
   private
   public :: run_settings_t, stop_settings_t, response_settings_t, output_settings_t, stress_settings_t
   public :: statistics_settings_t, poincare_settings_t
   public :: law_restitution, law_three_element, law_spring_damper, law_names
   public :: stop_released_from, count_samples, end_of_run
   public :: side_below, side_above, side_both, side_names
   public :: impulse_momentum, impulse_nodal, impulse_names
   public :: method_exact, method_newmark, method_names
   public :: name_length, strict_mode_tolerance

   !> Longest name of a scene, solver, history.
   integer, parameter :: name_length = 64

   !> Model A: coefficient of restitution.
   integer, parameter :: law_restitution = 1
   !> Model B: spring parallel to a Maxwell branch.
   integer, parameter :: law_three_element = 2
   !> A spring and a damper side by side, which push and never pull.
   integer, parameter :: law_spring_damper = 3

   !> The stop is below the beam, as the paper's, above it, or on both sides.
   integer, parameter :: side_below = 1
   integer, parameter :: side_above = 2
   integer, parameter :: side_both = 3

   !> The impulse acts on the whole beam.
   integer, parameter :: impulse_momentum = 1
   !> Only the velocity of the stop point is replaced.
   integer, parameter :: impulse_nodal = 2

   !> Closed form between events.
   integer, parameter :: method_exact = 1
   !> Newmark steps, halved at an event.
   integer, parameter :: method_newmark = 2

   !> The constants above as users write them.
   character(*), parameter :: law_names(3) = [character(name_length) :: 'restitution', 'three_element', &
      'spring_damper']
   character(*), parameter :: side_names(3) = [character(name_length) :: 'below', 'above', 'both']
   character(*), parameter :: impulse_names(2) = [character(name_length) :: 'momentum', 'nodal']
   character(*), parameter :: method_names(2) = [character(name_length) :: 'exact', 'newmark']

   !> &stop, dimensionless
   type :: stop_settings_t
      !> Lc / L
      real(wp) :: position = 1.0_wp
      !> One of the `side_` constants
      integer :: side = side_below
      !> delta = d / (y_c(0) - d), of a stop above with both signs turned; on both sides it is minus the clearance.
      !> y_c(0) is that of the stop from which the beam is released
      real(wp) :: preload = 0.0_wp
      !> One of the `law_` constants
      integer :: law = law_restitution
      !> eps, 0 to 1
      real(wp) :: restitution = 0.6_wp
      !> `impulse_momentum` or `impulse_nodal`
      integer :: impulse = impulse_momentum
      !> kappa = k / (3 E Ibar / L^3)
      real(wp) :: stiffness_ratio = 1.0e4_wp
      !> beta, the second spring in units of the first
      real(wp) :: branch_ratio = 20.0_wp
      !> c* = c omega1 / (3 E Ibar / L^3), in the branch or beside the spring
      real(wp) :: damper_ratio = 0.3_wp
   end type stop_settings_t

   !> Tolerance of modes, in eta, of runs by which others are judged.
   real(wp), parameter :: strict_mode_tolerance = 1.0e-9_wp

   !> &response
   type :: response_settings_t
      !> Length of the run, tau
      real(wp) :: duration = 20.0_wp
      !> Distance of the samples and Newmark's step, d tau
      real(wp) :: step = 0.01_wp
      !> `method_exact` or `method_newmark`
      integer :: method = method_exact
      !> Newmark's beta: 1/4 average acceleration, 1/6 linear acceleration, 0 explicit
      real(wp) :: newmark_beta = 0.25_wp
      !> Newmark's gamma
      real(wp) :: newmark_gamma = 0.5_wp
      !> Newmark: divide a step that is too long for the scheme instead of refusing it
      logical :: substep = .false.
      !> Newmark: |eta_c| within which an approach is a contact
      real(wp) :: contact_tolerance = 1.0e-4_wp
      !> Newmark: Pbar below which, at a sign change, the beam separates
      real(wp) :: release_tolerance = 1.0e-2_wp
      !> A flight that never rises above this (in eta) is captured
      real(wp) :: hop_tolerance = 1.0e-8_wp
      !> Events after which the run fails
      integer :: event_limit = 10000000
      !> `exact`: by which share of the greatest displacement leaving out modes may change those of stops and tip
      real(wp) :: accuracy = 1.0e-4_wp
      !> `exact`: and by how much of eta; huge: as much as `accuracy` allows
      real(wp) :: mode_tolerance = huge(1.0_wp)
      !> `exact`: keep all modes, whatever they contribute
      logical :: keep_all_modes = .false.
      !> `exact`: keep so many of the lowest modes; 0: as many as `accuracy` asks for
      integer :: mode_count = 0
   end type response_settings_t

   !> &output: what goes into the file beyond the events
   type :: output_settings_t
      !> Those of `history_table` at the sample times
      logical :: history(history_count) = .true.
      !> Instants (tau) at which the shape and the velocity of the whole beam are stored
      real(wp), allocatable :: shape_times(:)
      !> Distance of further such instants, from 0 to the end, tau; 0: none
      real(wp) :: shape_step = 0.0_wp
      !> Number of mode shapes to store
      integer :: mode_shapes = 0
      !> The energy ledger
      logical :: energy = .false.
      !> Measures, and the highest points of so many rebounds among them; no name asks for it, runs and sweeps do
      logical :: measures = .false.
      integer :: most_peaks = huge(1)
   end type output_settings_t

   !> &stress: where the bending moment and the stress at the outer fibre are asked for
   type :: stress_settings_t
      !> x/L
      real(wp), allocatable :: position(:)
      !> Their histories are kept, besides their extremes
      logical :: history = .true.
   end type stress_settings_t

   !> &statistics
   type :: statistics_settings_t
      !> What of the run counts, tau; no end: that of the run
      real(wp) :: start = 0.0_wp
      real(wp) :: end = huge(1.0_wp)
      !> Blocks of equal length, from whose differences error bars follow
      integer :: blocks = 10
      !> Meetings not later than this after the end of the one before are one impact with it, tau
      real(wp) :: rest = 0.0_wp
      !> Pbar below which a meeting with a stop that yields is no impact
      real(wp) :: threshold = 0.0_wp
      !> Of the histogram of impacts
      integer :: classes = 20
   end type statistics_settings_t

   !> &poincare: the state once a period of the load
   type :: poincare_settings_t
      !> Where in the period, as a share of it, from tau = 0
      real(wp) :: phase = 0.0_wp
      !> Sections that are passed over, and kept after them
      integer :: skip = 100
      integer :: keep = 100
      !> Whose period among all harmonic loads, forces first; 0: that of all together
      integer :: load = 0
      !> Longest period of the motion that is looked for, in those of the load, and how near a state must return, as a
      !> share of the greatest
      integer :: most_periods = 16
      real(wp) :: tolerance = 1.0e-6_wp
      !> The whole state in the modes is kept too
      logical :: keeps_modes = .false.
      !> The greatest Lyapunov exponent is asked for
      logical :: wants_exponent = .true.
      !> Nothing else says how long the run is: the periods passed over and kept
      logical :: sets_duration = .false.
      !> That of the load, tau, as `period_of` tells
      real(wp) :: period = 0.0_wp
   end type poincare_settings_t

   type :: run_settings_t
      !> zeta = gamma omega1 / 2
      real(wp) :: zeta = 0.0_wp
      type(stop_settings_t) :: stop
      type(response_settings_t) :: response
      type(output_settings_t) :: output
      !> hbar/L, which makes Pbar of a force
      real(wp) :: height_ratio = 0.075_wp
      !> Stops that the scene gives besides; unallocated: it has one
      type(stop_settings_t), allocatable :: more_stops(:)
      !> From which of all the beam is released
      integer :: release_stop = 1
      !> Without a stop nothing is in the beam's way; `stop` then tells where histories are taken
      logical :: has_stop = .true.
      !> What acts on the beam; unallocated: nothing does
      type(force_settings_t), allocatable :: forces(:)
      type(base_settings_t), allocatable :: bases(:)
      !> How it begins
      type(start_settings_t) :: start
      !> C = gamma K + alpha M: alpha/(2 omega1)
      real(wp) :: zeta_mass = 0.0_wp
      !> Damping ratios of the modes instead, the last for all that follow; unallocated: C = gamma K + alpha M
      real(wp), allocatable :: mode_ratios(:)
      !> Unallocated: nowhere
      type(stress_settings_t), allocatable :: stress
      !> What is asked of a part of the run; unallocated: nothing
      type(statistics_settings_t), allocatable :: statistics
      !> Unallocated: no sections are asked for
      type(poincare_settings_t), allocatable :: poincare
   end type run_settings_t

contains

   !> Samples after the start: whole steps within the duration, rounding forgiven.
   pure function count_samples(duration, step) result(samples)
      !> Length of the run
      real(wp), intent(in) :: duration
      !> Distance of the samples
      real(wp), intent(in) :: step
      integer :: samples

      samples = int(duration/step*(1.0_wp + 8.0_wp*epsilon(1.0_wp)))
   end function count_samples

   !> Newmark's steps end with the last sample.
   pure function end_of_run(response) result(tau)
      type(response_settings_t), intent(in) :: response
      real(wp) :: tau

      tau = response%duration
      if (response%method == method_newmark) tau = min(tau, real(count_samples(tau, response%step), wp)*response%step)
   end function end_of_run

   !> From which of several stops the beam is released: where the scene leaves that open, the one nearest the tip; of
   !> those below before above before on both sides; of those the highest. Never by their order: of stops that are alike
   !> in all that any serves.
   pure function stop_released_from(stops, chosen) result(place)
      type(stop_settings_t), intent(in) :: stops(:)
      !> By the scene; 0: it leaves that open
      integer, intent(in) :: chosen
      integer :: place

      real(wp) :: first(9), other(9)
      integer :: i, key

      place = chosen
      if (place > 0) return
      place = 1
      do i = 2, size(stops)
         first = keys(stops(place))
         other = keys(stops(i))
         key = findloc(abs(first - other) > 0.0_wp, .true., dim=1)
         if (key == 0) cycle
         if (other(key) < first(key)) place = i
      end do
   end function stop_released_from

   !> What that goes by, the least first.
   pure function keys(stop) result(values)
      type(stop_settings_t), intent(in) :: stop
      real(wp) :: values(9)

      values = [-stop%position, real(stop%side, wp), -stop%preload, real(stop%law, wp), real(stop%impulse, wp), &
         -stop%restitution, stop%stiffness_ratio, stop%branch_ratio, stop%damper_ratio]
   end function keys

end module run_settings
