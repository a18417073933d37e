!> What the user asked for, checked and made dimensionless. The reader fills these types; everything
!> else takes their components and never sees a namelist.
!>
!> Scales (docs/theory.md, section 2): lengths along the beam in L, displacements in y_c(0) - d, times
!> tau = omega1 t with omega1 of the uniform beam of mean section without tip mass.
module scene_types
   use cases_settings, only: cases_settings_t
   use kinds, only: wp
   use sweep_settings, only: best_settings_t, sweep_settings_t
   implicit none (type, external)
   private
   public :: scene_t, beam_settings_t, mesh_settings_t, stop_settings_t, response_settings_t
   public :: frequency_settings_t, output_settings_t, scales_t, precision_settings_t, statements_settings_t
   public :: shape_taper, shape_height_table, shape_section_table
   public :: law_restitution, law_three_element, impulse_momentum, impulse_nodal
   public :: method_exact, method_newmark
   public :: solver_dsygv, solver_natural, solver_lanczos, solver_auto
   public :: reference_exact, reference_none, name_length
   public :: law_names, impulse_names, method_names, solver_names, reference_names
   public :: contender_exact, contender_average, contender_linear, contender_explicit, contender_names

   !> Longest name of a scene, solver, history.
   integer, parameter :: name_length = 64

   !> Height varies linearly from root to tip (uniform if both are equal).
   integer, parameter :: shape_taper = 1
   !> Height given at stations, linear between them.
   integer, parameter :: shape_height_table = 2
   !> Area and second moment of area given at stations, linear between them.
   integer, parameter :: shape_section_table = 3

   !> Model A: coefficient of restitution.
   integer, parameter :: law_restitution = 1
   !> Model B: spring parallel to a Maxwell branch.
   integer, parameter :: law_three_element = 2

   !> The impulse acts on the whole beam.
   integer, parameter :: impulse_momentum = 1
   !> Only the velocity of the stop point is replaced.
   integer, parameter :: impulse_nodal = 2

   !> Closed form between events.
   integer, parameter :: method_exact = 1
   !> Newmark steps, halved at an event.
   integer, parameter :: method_newmark = 2

   !> LAPACK DSYGV on (K, M), the paper's.
   integer, parameter :: solver_dsygv = 1
   !> Element curvatures: singular values of the mass-weighted flexibility.
   integer, parameter :: solver_natural = 2
   !> Lanczos iteration on K^-1 M by the O(n) flexibility recursion.
   integer, parameter :: solver_lanczos = 3
   !> `natural` or `lanczos`, whichever is faster.
   integer, parameter :: solver_auto = 4

   !> No reference values.
   integer, parameter :: reference_none = 0
   !> The exact frequencies from the determinants.
   integer, parameter :: reference_exact = 1

   !> What &precision compares: `exact`, and Newmark with beta = 1/4, 1/6 and 0.
   integer, parameter :: contender_exact = 1
   integer, parameter :: contender_average = 2
   integer, parameter :: contender_linear = 3
   integer, parameter :: contender_explicit = 4

   !> The constants above as users write them: law_names(law_restitution) and so on; `reference_names`
   !> begins with reference_none.
   character(*), parameter :: law_names(2) = [character(name_length) :: 'restitution', 'three_element']
   character(*), parameter :: impulse_names(2) = [character(name_length) :: 'momentum', 'nodal']
   character(*), parameter :: method_names(2) = [character(name_length) :: 'exact', 'newmark']
   character(*), parameter :: solver_names(4) = [character(name_length) :: 'dsygv', 'natural', 'lanczos', 'auto']
   character(*), parameter :: contender_names(4) = [character(name_length) :: &
      'exact', 'average_acceleration', 'linear_acceleration', 'explicit']
   character(*), parameter :: reference_names(0:1) = [character(name_length) :: 'none', 'exact']

   !> &beam, in the user's units.
   type :: beam_settings_t
      !> Length L
      real(wp) :: length = 1.0_wp
      !> Width b
      real(wp) :: width = 1.0_wp
      !> Young's modulus E
      real(wp) :: youngs_modulus = 1.0_wp
      !> Density rho
      real(wp) :: density = 1.0_wp
      !> One of the `shape_` constants
      integer :: shape = shape_taper
      !> Height at the clamp and at the tip, for `shape_taper`; a tip height of 0 is a full wedge
      real(wp) :: height_root = 0.075_wp
      real(wp) :: height_tip = 0.075_wp
      !> Stations from 0 to L, ascending, for the tables
      real(wp), allocatable :: station(:)
      !> Height at the stations, for `shape_height_table`
      real(wp), allocatable :: height(:)
      !> Area and second moment of area at the stations, for `shape_section_table`
      real(wp), allocatable :: area(:), inertia(:)
   end type beam_settings_t

   !> &mesh
   type :: mesh_settings_t
      !> Number of elements n
      integer :: elements = 8
      !> Ratio of neighbouring lengths l_i / l_(i+1); > 1 puts the long element at the clamp
      real(wp) :: ratio = 1.0_wp
   end type mesh_settings_t

   !> &stop, dimensionless
   type :: stop_settings_t
      !> Lc / L
      real(wp) :: position = 1.0_wp
      !> delta = d / (y_c(0) - d)
      real(wp) :: preload = 0.0_wp
      !> `law_restitution` or `law_three_element`
      integer :: law = law_restitution
      !> eps, 0 to 1
      real(wp) :: restitution = 0.6_wp
      !> `impulse_momentum` or `impulse_nodal`
      integer :: impulse = impulse_momentum
      !> kappa = k / (3 E Ibar / L^3)
      real(wp) :: stiffness_ratio = 1.0e4_wp
      !> beta, the second spring in units of the first
      real(wp) :: branch_ratio = 20.0_wp
      !> c* = c omega1 / (3 E Ibar / L^3)
      real(wp) :: damper_ratio = 0.3_wp
   end type stop_settings_t

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
      !> `exact`: eta of stop and tip by which leaving out modes may change the motion, up to the third rebound
      real(wp) :: mode_tolerance = 1.0e-9_wp
      !> `exact`: keep all modes, whatever they contribute
      logical :: keep_all_modes = .false.
   end type response_settings_t

   !> &frequencies: a table of lambda for every solver and every mesh
   type :: frequency_settings_t
      !> Number of modes; 0: as many as the mesh has, up to 12
      integer :: count = 0
      !> `solver_` constants, one or more
      integer, allocatable :: solver(:)
      !> Meshes of the table: elements and ratios, pairwise; the mesh of &mesh if not given
      integer, allocatable :: mesh_elements(:)
      real(wp), allocatable :: mesh_ratios(:)
      !> `reference_exact` or `reference_none`
      integer :: reference = reference_exact
   end type frequency_settings_t

   !> &precision: run time against error
   type :: precision_settings_t
      !> Length of the runs, tau
      real(wp) :: duration = 20.0_wp
      !> `contender_` constants; all where the file names none
      integer, allocatable :: methods(:)
      !> Newmark's steps, d tau
      real(wp), allocatable :: steps(:)
      !> `exact`: tolerances, each varied by itself, and meshes
      real(wp), allocatable :: hop_tolerances(:)
      real(wp), allocatable :: mode_tolerances(:)
      integer, allocatable :: mesh_elements(:)
      !> Meshes and lengths over which the growth of the cost is measured
      integer, allocatable :: scaling_elements(:)
      real(wp), allocatable :: scaling_durations(:)
      !> Modes for which large meshes are solved
      integer :: scaling_modes = 6
      !> Measure what skipping saves
      logical :: skips = .false.
      !> Timings of each entry, and the seconds that one of them lasts at least
      integer :: repetitions = 7
      real(wp) :: shortest_timing = 0.02_wp
   end type precision_settings_t

   !> &statements: the paper's statements, judged
   type :: statements_settings_t
      !> Elements of equal length: of the paper's mesh, and of one where the mesh no longer matters
      integer :: elements = 8
      integer :: fine_elements = 32
      !> Length of the runs, tau
      real(wp) :: duration = 150.0_wp
   end type statements_settings_t

   !> &output: what goes into the file beyond the events
   type :: output_settings_t
      !> Histories at the sample times
      logical :: displacement_stop = .true.
      logical :: displacement_tip = .true.
      logical :: velocity_stop = .true.
      logical :: contact_force = .true.
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

   !> What turns the dimensionless results into the user's units.
   type :: scales_t
      !> L
      real(wp) :: length = 1.0_wp
      !> omega1 = lambda1^2 sqrt(E Ibar / (rho Abar L^4)), rad per unit of time
      real(wp) :: omega1 = 1.0_wp
      !> E Ibar
      real(wp) :: bending_stiffness = 1.0_wp
      !> rho Abar L
      real(wp) :: beam_mass = 1.0_wp
      !> hbar / L
      real(wp) :: height_ratio = 0.075_wp
      !> y_c(0) - d; 0 when the scene gives only ratios
      real(wp) :: displacement = 0.0_wp
   end type scales_t

   !> One scene. A group that the file does not have is not asked for.
   type :: scene_t
      !> File it was read from
      character(:), allocatable :: file
      !> Name of the results file, without ending
      character(:), allocatable :: name
      !> Heading of tables and pictures
      character(:), allocatable :: title
      !> The input as read
      character(:), allocatable :: text
      type(beam_settings_t) :: beam
      type(mesh_settings_t) :: mesh
      !> zeta = gamma omega1 / 2
      real(wp) :: zeta = 0.0_wp
      !> mu = m / (rho Abar L)
      real(wp) :: tip_mass_ratio = 0.0_wp
      !> &stop is there; a response has one
      logical :: has_stop = .false.
      type(stop_settings_t) :: stop
      !> &response is there
      logical :: wants_response = .false.
      type(response_settings_t) :: response
      !> &frequencies is there
      logical :: wants_frequencies = .false.
      type(frequency_settings_t) :: frequencies
      !> &precision is there
      logical :: wants_precision = .false.
      type(precision_settings_t) :: precision
      !> &sweep is there, and &best
      logical :: wants_sweep = .false.
      type(sweep_settings_t) :: sweep
      logical :: wants_best = .false.
      type(best_settings_t) :: best
      !> &cases is there
      logical :: wants_cases = .false.
      type(cases_settings_t) :: cases
      !> &statements is there
      logical :: wants_statements = .false.
      type(statements_settings_t) :: statements
      type(output_settings_t) :: output
      type(scales_t) :: scales
   end type scene_t

end module scene_types
