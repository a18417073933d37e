!> What the user asked for, checked and made dimensionless. The reader fills these types; everything
!> else takes their components and never sees a namelist.
!>
!> Scales (docs/theory.md, section 2): lengths along the beam in L, displacements in y_c(0) - d, times
!> tau = omega1 t with omega1 of the uniform beam of mean section without tip mass.
module scene_types
   use body_settings, only: mass_settings_t, root_settings_t
   use kinds, only: wp
   use load_settings, only: base_settings_t, force_settings_t, start_settings_t
   use orbit_settings, only: orbit_settings_t
   use run_settings, only: name_length, output_settings_t, poincare_settings_t, response_settings_t, &
      statistics_settings_t, stop_settings_t, stress_settings_t
   use section_shapes, only: section_settings_t
   use sweep_settings, only: best_settings_t, cases_settings_t, sweep_settings_t
   implicit none (type, external)
   private
   public :: scene_t, echo_t, beam_settings_t, mesh_settings_t, support_settings_t, base_group_t, start_group_t
   public :: support_displacement, support_rotation, support_motion_names
   public :: frequency_response_settings_t, frequency_settings_t, scales_t, precision_settings_t, statements_settings_t
   public :: shape_taper, shape_height_table, shape_section_table, shape_section
   public :: solver_dsygv, solver_natural, solver_lanczos, solver_auto
   public :: output_scene, output_dimensionless, output_unit_names
   public :: reference_exact, reference_none, default_mode_count
   public :: solver_names, reference_names
   public :: mass_consistent, mass_redistributed, mass_auto, mass_names
   public :: contender_exact, contender_average, contender_linear, contender_explicit, contender_names

   !> Height varies linearly from root to tip (uniform if both are equal).
   integer, parameter :: shape_taper = 1
   !> Height given at stations, linear between them.
   integer, parameter :: shape_height_table = 2
   !> Area and second moment of area given at stations, linear between them.
   integer, parameter :: shape_section_table = 3
   !> What &section says.
   integer, parameter :: shape_section = 4

   !> LAPACK DSYGV on (K, M), the paper's.
   integer, parameter :: solver_dsygv = 1
   !> Element curvatures: singular values of the mass-weighted flexibility.
   integer, parameter :: solver_natural = 2
   !> Lanczos iteration on K^-1 M by the O(n) flexibility recursion.
   integer, parameter :: solver_lanczos = 3
   !> `natural` or `lanczos`, whichever is faster.
   integer, parameter :: solver_auto = 4

   !> What moves the inertia of the stop's node: all its motion, that of its neighbours, whichever errs less.
   integer, parameter :: mass_consistent = 1
   integer, parameter :: mass_redistributed = 2
   integer, parameter :: mass_auto = 3

   !> What a support holds.
   integer, parameter :: support_displacement = 1
   integer, parameter :: support_rotation = 2

   !> No reference values.
   integer, parameter :: reference_none = 1
   !> The exact frequencies from the determinants.
   integer, parameter :: reference_exact = 2

   !> Modes of a table of frequencies whose scene gives no number.
   integer, parameter :: default_mode_count = 12

   !> Results in the units of the scene, or dimensionless.
   integer, parameter :: output_scene = 1
   integer, parameter :: output_dimensionless = 2

   !> What &precision compares: `exact`, and Newmark with beta = 1/4, 1/6 and 0.
   integer, parameter :: contender_exact = 1
   integer, parameter :: contender_average = 2
   integer, parameter :: contender_linear = 3
   integer, parameter :: contender_explicit = 4

   !> The constants above as users write them: solver_names(solver_dsygv) and so on.
   character(*), parameter :: solver_names(4) = [character(name_length) :: 'dsygv', 'natural', 'lanczos', 'auto']
   character(*), parameter :: mass_names(3) = [character(name_length) :: 'consistent', 'redistributed', 'auto']
   character(*), parameter :: support_motion_names(2) = [character(name_length) :: 'displacement', 'rotation']
   character(*), parameter :: contender_names(4) = [character(name_length) :: &
      'exact', 'average_acceleration', 'linear_acceleration', 'explicit']
   character(*), parameter :: output_unit_names(2) = [character(name_length) :: 'scene', 'dimensionless']
   character(*), parameter :: reference_names(2) = [character(name_length) :: 'none', 'exact']

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
      !> What the file may give instead: (h0 - h1) / L and (h0 + h1) / (2 L)
      real(wp) :: taper = 0.0_wp
      real(wp) :: mean_height_ratio = 0.075_wp
      !> Stations from 0 to L, ascending, for the tables
      real(wp), allocatable :: station(:)
      !> Height at the stations, for `shape_height_table`
      real(wp), allocatable :: height(:)
      !> Area and second moment of area at the stations, for `shape_section_table`
      real(wp), allocatable :: area(:), inertia(:)
      !> &section is there; its shape, for `shape_section`
      logical :: has_section = .false.
      type(section_settings_t) :: section
   end type beam_settings_t

   !> &mesh
   type :: mesh_settings_t
      !> Number of elements n
      integer :: elements = 8
      !> Ratio of neighbouring lengths l_i / l_(i+1); > 1 puts the long element at the clamp
      real(wp) :: ratio = 1.0_wp
      !> Instead of these two: the nodes, ascending from 0 to L; unallocated: not given
      real(wp), allocatable :: nodes(:)
      !> One of the `mass_` constants: the mass matrix of motion
      integer :: mass = mass_consistent
      !> Instead of a number of elements: that of the coarsest mesh whose motion settles within this; 0: not asked for
      real(wp) :: tolerance = 0.0_wp
      !> Compare with two finer meshes
      logical :: estimate = .false.
   end type mesh_settings_t

   !> &support
   type :: support_settings_t
      !> x / L
      real(wp) :: position = 1.0_wp
      !> One of the `support_` constants
      integer :: motion = support_displacement
      !> Of its spring: k / (3 E Ibar / L^3), or, against rotation, k / (3 E Ibar / L); 0: the support is rigid
      real(wp) :: stiffness_ratio = 0.0_wp
   end type support_settings_t

   !> &base
   type, extends(base_settings_t) :: base_group_t
      !> A constant acceleration of the base besides
      real(wp) :: gravity_ratio = 0.0_wp
   end type base_group_t

   !> &start
   type, extends(start_settings_t) :: start_group_t
      !> From which the base falls; 0: its velocity is given
      real(wp) :: height_ratio = 0.0_wp
   end type start_group_t

   !> &frequencies: a table of lambda for every solver and every mesh
   type :: frequency_settings_t
      !> Number of modes; 0: as many as the mesh has, up to `default_mode_count`
      integer :: count = 0
      !> `solver_` constants, one or more; the reader fills what the file does not give
      integer, allocatable :: solver(:)
      !> Meshes of the table: elements and ratios, pairwise
      integer, allocatable :: mesh_elements(:)
      real(wp), allocatable :: mesh_ratios(:)
      !> `reference_exact` or `reference_none`
      integer :: reference = reference_exact
   end type frequency_settings_t

   !> &frequency_response: the beam with its stops open, under its harmonic loads at one frequency after the other
   type :: frequency_response_settings_t
      !> Least and greatest, over omega1
      real(wp), allocatable :: range(:)
      integer :: points = 400
      logical :: is_logarithmic = .false.
   end type frequency_response_settings_t

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
      !> Compare all methods on these meshes with the beam itself
      logical :: against_beam = .false.
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

   !> What turns the dimensionless results into the user's units.
   type :: scales_t
      !> L
      real(wp) :: length = 1.0_wp
      !> omega1 = lambda1^2 sqrt(E Ibar / (rho Abar L^4)), rad per unit of time
      real(wp) :: omega1 = 1.0_wp
      !> E, and E Ibar
      real(wp) :: youngs_modulus = 1.0_wp
      real(wp) :: bending_stiffness = 1.0_wp
      !> rho Abar L
      real(wp) :: beam_mass = 1.0_wp
      !> hbar / L
      real(wp) :: height_ratio = 0.075_wp
      !> D, the unit of displacement: y_c(0) - d of a beam pulled away; 0 when the scene gives only ratios
      real(wp) :: displacement = 0.0_wp
   end type scales_t

   !> One name and its value: a number, a list of numbers, or words.
   type :: echo_t
      !> As users write them, such as 'stop' and 'preload'
      character(:), allocatable :: group
      character(:), allocatable :: name
      !> Words; unallocated: the value is made of numbers
      character(:), allocatable :: text
      !> One element, or a list
      real(wp), allocatable :: number(:)
      !> The value is a list, even if of one element
      logical :: is_list = .false.
   end type echo_t

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
      !> Its names and resolved values, group by group; the last group is `scales`
      type(echo_t), allocatable :: echo(:)
      type(beam_settings_t) :: beam
      type(mesh_settings_t) :: mesh
      !> zeta = gamma omega1 / 2
      real(wp) :: zeta = 0.0_wp
      !> alpha / (2 omega1)
      real(wp) :: zeta_mass = 0.0_wp
      !> Damping ratios of the modes; unallocated: zeta and zeta_mass have them
      real(wp), allocatable :: mode_ratios(:)
      !> mu = m / (rho Abar L)
      real(wp) :: tip_mass_ratio = 0.0_wp
      !> &stop is there; a response has one
      logical :: has_stop = .false.
      type(stop_settings_t) :: stop
      !> Further &stop groups; unallocated: there are none
      type(stop_settings_t), allocatable :: more_stops(:)
      !> The stop from which the beam is released; 0: `stop_released_from` tells
      integer :: release_stop = 0
      !> &root is there
      logical :: has_root = .false.
      type(root_settings_t) :: root
      !> &mass is there; unallocated: it is not
      logical :: has_masses = .false.
      type(mass_settings_t), allocatable :: masses(:)
      !> &support is there; unallocated: it is not
      logical :: has_supports = .false.
      type(support_settings_t), allocatable :: supports(:)
      !> &force and &base are there; unallocated: they are not
      logical :: has_forces = .false.
      type(force_settings_t), allocatable :: forces(:)
      logical :: has_bases = .false.
      type(base_group_t), allocatable :: bases(:)
      !> &start is there
      logical :: has_start = .false.
      type(start_group_t) :: start
      !> &stress is there
      logical :: wants_stress = .false.
      type(stress_settings_t) :: stress
      !> &response is there
      logical :: wants_response = .false.
      type(response_settings_t) :: response
      !> &statistics is there
      logical :: wants_statistics = .false.
      type(statistics_settings_t) :: statistics
      !> &poincare is there
      logical :: wants_poincare = .false.
      type(poincare_settings_t) :: poincare
      !> &orbit is there
      logical :: wants_orbit = .false.
      type(orbit_settings_t) :: orbit
      !> &frequency_response is there
      logical :: wants_frequency_response = .false.
      type(frequency_response_settings_t) :: frequency_response
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
      !> Some cases of the sweep have values that do not fit together; each is then read anew
      logical :: has_misfits = .false.
      !> &cases is there
      logical :: wants_cases = .false.
      type(cases_settings_t) :: cases
      !> &statements is there
      logical :: wants_statements = .false.
      type(statements_settings_t) :: statements
      type(output_settings_t) :: output
      type(scales_t) :: scales
      !> Place in `system_names` of the units that the file's values are in; 0: it does not say
      integer :: unit_system = 0
      !> One of the `output_` constants: what results are in; 0: the file does not say
      integer :: output_units = 0
   contains
      procedure :: has_group
   end type scene_t

contains

   !> Is a group there of which measures or analyses are?
   elemental function has_group(scene, group) result(has)
      class(scene_t), intent(in) :: scene
      !> Empty: all are there without any
      character(*), intent(in) :: group
      logical :: has

      select case (group)
      case ('stress')
         has = scene%wants_stress
      case ('statistics')
         has = scene%wants_statistics
      case ('poincare')
         has = scene%wants_poincare
      case ('orbit')
         has = scene%wants_orbit
      case ('frequency_response')
         has = scene%wants_frequency_response
      case default
         has = .true.
      end select
   end function has_group

end module scene_types
