!> A scene: the contents of an input file (scene file), checked and dimensionless. `scene_reader` fills these types; all
!> other code takes their components and knows nothing of the file format, Fortran namelists: groups such as &stop, with
!> names and their values. The components of a group's type are the names of the group.
!>
!> Dimensionless scales as in `run_settings`: lengths along the beam in L, displacements in D, times tau = omega1 t. A
!> bar marks the mean section: Abar, Ibar, hbar are its area, second moment of area and height.
module scene_types
   use inference_settings, only: fit_settings_t, sensitivity_settings_t, uncertainty_settings_t
   use kinds, only: wp
   use load_settings, only: base_settings_t, force_settings_t, start_settings_t
   use measure_list, only: measured_groups
   use mesh_checks, only: mesh_check_t
   use orbit_settings, only: orbit_settings_t
   use root_and_mass_settings, only: mass_settings_t, root_settings_t
   use run_settings, only: body_settings_t, law_restitution, name_length, output_settings_t, poincare_settings_t, &
      relay_settings_t, response_settings_t, statistics_settings_t, stop_settings_t, stress_settings_t
   use section_shapes, only: section_settings_t
   use spectrum_settings, only: spectrum_settings_t
   use sweep_settings, only: best_settings_t, is_swept, sweep_settings_t, swept_t
   use warning_list, only: warning_t
   implicit none (type, external)
   private
   public :: all_stops, has_rigid_stops
   public :: scene_t, echo_t, beam_settings_t, mesh_settings_t, support_settings_t, base_group_t, start_group_t
   public :: support_displacement, support_rotation, support_motion_names
   public :: frequency_response_settings_t, frequency_settings_t, scales_t, precision_settings_t, statements_settings_t
   public :: shape_taper, shape_height_table, shape_section_table, shape_section
   public :: solver_dsygv, solver_natural, solver_lanczos, solver_auto
   public :: output_scene, output_dimensionless, output_unit_names
   public :: reference_exact, reference_none, default_mode_count
   public :: solver_names, reference_names
   public :: mass_consistent, mass_redistributed, mass_auto, mass_names
   public :: integrator_exact, integrator_average, integrator_linear, integrator_explicit, integrator_names

   !> Height varies linearly from root to tip (uniform if both are equal).
   integer, parameter :: shape_taper = 1
   !> Height given at stations, linear between them.
   integer, parameter :: shape_height_table = 2
   !> Area and second moment of area given at stations, linear between them.
   integer, parameter :: shape_section_table = 3
   !> Section of &section.
   integer, parameter :: shape_section = 4

   !> Solvers of the eigenvalue problem. LAPACK's DSYGV on the stiffness and mass matrices, the solver of the paper.
   integer, parameter :: solver_dsygv = 1
   !> Singular values of the mass-weighted flexibility in element curvatures.
   integer, parameter :: solver_natural = 2
   !> Lanczos iteration in element curvatures, for few modes.
   integer, parameter :: solver_lanczos = 3
   !> `natural` or `lanczos`, whichever is faster.
   integer, parameter :: solver_auto = 4

   !> Mass matrix of the motion: consistent.
   integer, parameter :: mass_consistent = 1
   !> Mass matrix with the mass of the node at the stop redistributed to its neighbours.
   integer, parameter :: mass_redistributed = 2
   !> The more accurate of these two matrices.
   integer, parameter :: mass_auto = 3

   !> A support constrains the displacement.
   integer, parameter :: support_displacement = 1
   !> A support constrains the rotation.
   integer, parameter :: support_rotation = 2

   !> Reference values of a table of frequencies: none.
   integer, parameter :: reference_none = 1
   !> Reference values of a table of frequencies: the exact frequencies from the zeros of determinants.
   integer, parameter :: reference_exact = 2

   !> Number of modes in a table of frequencies if the scene gives none.
   integer, parameter :: default_mode_count = 12

   !> Results are in the units of the scene.
   integer, parameter :: output_scene = 1
   !> Results are dimensionless.
   integer, parameter :: output_dimensionless = 2

   !> Integration method that &precision compares: `exact`.
   integer, parameter :: integrator_exact = 1
   !> Newmark's method with beta = 1/4 (average acceleration).
   integer, parameter :: integrator_average = 2
   !> Newmark's method with beta = 1/6 (linear acceleration).
   integer, parameter :: integrator_linear = 3
   !> Newmark's method with beta = 0 (explicit).
   integer, parameter :: integrator_explicit = 4

   !> Names of these constants in scene files, such as `solver_names(solver_dsygv)`.
   character(*), parameter :: solver_names(4) = [character(name_length) :: 'dsygv', 'natural', 'lanczos', 'auto']
   character(*), parameter :: mass_names(3) = [character(name_length) :: 'consistent', 'redistributed', 'auto']
   character(*), parameter :: support_motion_names(2) = [character(name_length) :: 'displacement', 'rotation']
   character(*), parameter :: integrator_names(4) = [character(name_length) :: &
      'exact', 'average_acceleration', 'linear_acceleration', 'explicit']
   character(*), parameter :: output_unit_names(2) = [character(name_length) :: 'scene', 'dimensionless']
   character(*), parameter :: reference_names(2) = [character(name_length) :: 'none', 'exact']

   !> Settings of &beam, in the user's units.
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
      !> Height at the clamp (root), for `shape_taper`
      real(wp) :: height_root = 0.075_wp
      !> Height at the tip, for `shape_taper`; 0: a full wedge
      real(wp) :: height_tip = 0.075_wp
      !> Alternative to the two heights h0 and h1: taper (h0 - h1) / L
      real(wp) :: taper = 0.0_wp
      !> Alternative to the two heights: mean height (h0 + h1) / (2 L)
      real(wp) :: mean_height_ratio = 0.075_wp
      !> Stations from 0 to L, ascending, for the tables
      real(wp), allocatable :: station(:)
      !> Height at the stations, for `shape_height_table`
      real(wp), allocatable :: height(:)
      !> Area at the stations, for `shape_section_table`
      real(wp), allocatable :: area(:)
      !> Second moment of area at the stations
      real(wp), allocatable :: inertia(:)
      !> Whether the file has &section
      logical :: has_section = .false.
      !> Settings of &section, for `shape_section`
      type(section_settings_t) :: section
   end type beam_settings_t

   !> Settings of &mesh.
   type :: mesh_settings_t
      !> Number of elements n
      integer :: elements = 8
      !> Ratio of neighbouring element lengths l_i / l_(i+1); > 1: the longest element is at the clamp
      real(wp) :: ratio = 1.0_wp
      !> Positions of the nodes, ascending from 0 to L, instead of `elements` and `ratio`; unallocated: not given
      real(wp), allocatable :: nodes(:)
      !> One of the `mass_` constants: the mass matrix of motion
      integer :: mass = mass_auto
      !> Tolerance of the motion, in eta and tau; the coarsest mesh within this tolerance is then chosen instead of
      !> `elements`. 0: not used
      real(wp) :: tolerance = 0.0_wp
      !> Whether the scene gives no mesh, so that the mesh is found before the runs
      logical :: is_sought = .false.
      !> Result of the search for the mesh, if the scene gives none; `found%finer_elements` = 0: the mesh is given
      type(mesh_check_t) :: found
      !> The runs for which the mesh was found, in words; empty: the run of the scene
      character(80) :: found_for = ''
      !> Whether to estimate the errors of measures from two finer meshes
      logical :: estimate = .false.
      !> Whether the scene does not set `estimate`: a single run then makes the estimate if its cost is small
      logical :: estimates_if_cheap = .false.
   end type mesh_settings_t

   !> Settings of a &support.
   type :: support_settings_t
      !> x / L of the support
      real(wp) :: position = 1.0_wp
      !> One of the `support_` constants
      integer :: motion = support_displacement
      !> Stiffness k / (3 E Ibar / L^3) of a translational or k / (3 E Ibar / L) of a rotational spring; 0: a rigid
      !> support
      real(wp) :: stiffness_ratio = 0.0_wp
   end type support_settings_t

   !> Settings of a &base.
   type, extends(base_settings_t) :: base_group_t
      !> Gravity over D omega1^2, a constant acceleration in addition to the motion of the base
      real(wp) :: gravity_ratio = 0.0_wp
   end type base_group_t

   !> Settings of &start.
   type, extends(start_settings_t) :: start_group_t
      !> Height over D from which the base falls; 0: the velocity of the fall is given
      real(wp) :: height_ratio = 0.0_wp
   end type start_group_t

   !> Settings of &frequencies: a table of lambda_i = sqrt(omega_i/omega1) lambda1, a column for each solver and mesh
   type :: frequency_settings_t
      !> Number of modes; 0: as many as the mesh has, up to `default_mode_count`
      integer :: count = 0
      !> One or more `solver_` constants; `scene_resolve` fills the lists that the file does not give
      integer, allocatable :: solver(:)
      !> Numbers of elements of the meshes of the table
      integer, allocatable :: mesh_elements(:)
      !> Ratio of neighbouring element lengths of each of these meshes
      real(wp), allocatable :: mesh_ratios(:)
      !> Whether the file gives neither, so that the mesh of the table is that of the response
      logical :: has_mesh_of_response = .false.
      !> `reference_exact` or `reference_none`
      integer :: reference = reference_exact
   end type frequency_settings_t

   !> Settings of &frequency_response: steady response of the beam with open contacts to its harmonic loads
   type :: frequency_response_settings_t
      !> Minimum and maximum frequency, over omega1
      real(wp), allocatable :: range(:)
      !> Number of frequencies
      integer :: points = 400
      !> Whether the frequencies are evenly spaced on a logarithmic scale
      logical :: is_logarithmic = .false.
   end type frequency_response_settings_t

   !> Settings of &precision: run time against error, of motions and of eigenvalue solvers.
   type :: precision_settings_t
      !> Length of the runs, tau
      real(wp) :: duration = 20.0_wp
      !> Integration methods that are compared, `integrator_` constants; all of them if the file names none
      integer, allocatable :: methods(:)
      !> Newmark's steps, d tau
      real(wp), allocatable :: steps(:)
      !> Number of the lowest modes in which all methods compute the motion; 0: exact motion in the modes that its
      !> tolerances require, Newmark's steps on the matrices of the mesh
      integer :: mode_count = 0
      !> For the exact method: values of `hop_tolerance` of &response; this list and the next two are varied separately
      real(wp), allocatable :: hop_tolerances(:)
      !> Values of `mode_tolerance` of &response
      real(wp), allocatable :: mode_tolerances(:)
      !> Numbers of elements
      integer, allocatable :: mesh_elements(:)
      !> Whether to compare all methods on the meshes of `mesh_elements` with the limit of infinitely fine meshes
      logical :: against_beam = .false.
      !> Numbers of elements over which the growth of run time and memory is measured
      integer, allocatable :: scaling_elements(:)
      !> Durations of runs over which this growth is measured, tau
      real(wp), allocatable :: scaling_durations(:)
      !> Number of modes that are computed on large meshes
      integer :: scaling_modes = 6
      !> Whether to measure the time that is saved by omitting unnecessary computations, and to compare the results with
      !> and without
      logical :: skips = .false.
      !> Number of timings of each entry
      integer :: repetitions = 7
      !> Minimum duration of one timing, seconds
      real(wp) :: shortest_timing = 0.02_wp
   end type precision_settings_t

   !> Settings of &statements: check of the statements in the paper (Irie, Yamada, Asano 1977)
   type :: statements_settings_t
      !> Number of elements of equal length of the mesh of the paper
      integer :: elements = 8
      !> Number of elements of equal length of a mesh whose discretisation error is negligible
      integer :: fine_elements = 32
      !> Length of the runs, tau
      real(wp) :: duration = 150.0_wp
   end type statements_settings_t

   !> Scales by which dimensionless results are converted to the user's units.
   type :: scales_t
      !> Length L
      real(wp) :: length = 1.0_wp
      !> Circular frequency omega1 = lambda1^2 sqrt(E Ibar / (rho Abar L^4)), rad per unit of time
      real(wp) :: omega1 = 1.0_wp
      !> Young's modulus E
      real(wp) :: youngs_modulus = 1.0_wp
      !> Bending stiffness E Ibar
      real(wp) :: bending_stiffness = 1.0_wp
      !> Mass rho Abar L
      real(wp) :: beam_mass = 1.0_wp
      !> Mean height over length, hbar / L
      real(wp) :: height_ratio = 0.075_wp
      !> D = |y_c(0) - d|, the unit of displacement: initial distance of a released beam from the surface of its stop;
      !> 0: unknown, because the scene gives only dimensionless values
      real(wp) :: displacement = 0.0_wp
   end type scales_t

   !> One name of a scene with its value after all defaults: a number, a list of numbers, or words. Results files repeat
   !> (echo) these values.
   type :: echo_t
      !> Group in scene files, such as 'stop'
      character(:), allocatable :: group
      !> Name in that group, such as 'preload'
      character(:), allocatable :: name
      !> Value in words; unallocated: the value is numeric
      character(:), allocatable :: text
      !> Numeric value: one element, or a list
      real(wp), allocatable :: number(:)
      !> Whether the value is a list, even if of one element
      logical :: is_list = .false.
   end type echo_t

   !> One scene. The components `has_...` and `wants_...` report which groups the file has.
   type :: scene_t
      !> File from which the scene was read
      character(:), allocatable :: file
      !> Name of the results file, without extension
      character(:), allocatable :: name
      !> Heading of tables and pictures
      character(:), allocatable :: title
      !> Text of the file
      character(:), allocatable :: text
      !> Indices of the warnings that the file silences; unallocated: none
      integer, allocatable :: silent_warnings(:)
      !> Warnings about the scene; unallocated until it is resolved
      type(warning_t), allocatable :: warnings(:)
      !> Names and resolved values, group by group; the last group is `scales`
      type(echo_t), allocatable :: echo(:)
      type(beam_settings_t) :: beam
      type(mesh_settings_t) :: mesh
      !> Stiffness-proportional damping: zeta = gamma omega1 / 2
      real(wp) :: zeta = 0.0_wp
      !> Mass-proportional damping: alpha / (2 omega1)
      real(wp) :: zeta_mass = 0.0_wp
      !> Damping ratios of the modes, instead of `zeta` and `zeta_mass`; unallocated: not given
      real(wp), allocatable :: mode_ratios(:)
      !> Tip mass over mass of the beam: mu = m / (rho Abar L)
      real(wp) :: tip_mass_ratio = 0.0_wp
      !> Whether the file has &stop
      logical :: has_stop = .false.
      type(stop_settings_t) :: stop
      !> Further &stop groups; unallocated: there are none
      type(stop_settings_t), allocatable :: more_stops(:)
      !> Number of the stop from which the beam is released; 0: `stop_released_from` chooses it
      integer :: release_stop = 0
      !> Whether the file has &root
      logical :: has_root_group = .false.
      type(root_settings_t) :: root
      !> Whether the file has &mass; without this group `masses` is unallocated
      logical :: has_masses = .false.
      type(mass_settings_t), allocatable :: masses(:)
      !> Whether the file has &body; without this group `bodies` is unallocated
      logical :: has_bodies = .false.
      type(body_settings_t), allocatable :: bodies(:)
      !> Whether the file has &support; without this group `supports` is unallocated
      logical :: has_supports = .false.
      type(support_settings_t), allocatable :: supports(:)
      !> Whether the file has &force
      logical :: has_forces = .false.
      !> Settings of each &force; unallocated: the file has none
      type(force_settings_t), allocatable :: forces(:)
      !> Whether the file has &base
      logical :: has_bases = .false.
      !> Settings of each &base; unallocated: the file has none
      type(base_group_t), allocatable :: bases(:)
      !> Whether the file has &start
      logical :: has_start = .false.
      type(start_group_t) :: start
      !> Whether the file has &stress
      logical :: wants_stress = .false.
      type(stress_settings_t) :: stress
      !> Whether the file has &response
      logical :: wants_response = .false.
      type(response_settings_t) :: response
      !> Whether the file has &statistics
      logical :: wants_statistics = .false.
      type(statistics_settings_t) :: statistics
      !> Whether the file has &relay
      logical :: wants_relay = .false.
      type(relay_settings_t) :: relay
      !> Whether the file has &poincare
      logical :: wants_poincare = .false.
      type(poincare_settings_t) :: poincare
      !> Whether the file has &orbit
      logical :: wants_orbit = .false.
      type(orbit_settings_t) :: orbit
      !> Whether the file has &frequency_response
      logical :: wants_frequency_response = .false.
      type(frequency_response_settings_t) :: frequency_response
      !> Whether the file has &spectrum
      logical :: wants_spectrum = .false.
      type(spectrum_settings_t) :: spectrum
      !> Whether the file has &frequencies
      logical :: wants_frequencies = .false.
      type(frequency_settings_t) :: frequencies
      !> Whether the file has &precision
      logical :: wants_precision = .false.
      type(precision_settings_t) :: precision
      !> Whether the file has &sweep
      logical :: wants_sweep = .false.
      !> Settings of &sweep
      type(sweep_settings_t) :: sweep
      !> Whether the file has &best
      logical :: wants_best = .false.
      !> Settings of &best
      type(best_settings_t) :: best
      !> Whether some cases of the sweep may have inconsistent values, so that each case is read and checked as a file
      !> of its own
      logical :: has_inconsistent_cases = .false.
      !> Whether the file has &cases
      logical :: wants_cases = .false.
      !> The parameter of &cases with the list of its values, one for each case; an empty name: not given. In a resolved
      !> scene `sweep` contains this parameter alone
      type(swept_t) :: cases
      !> Whether the file has &sensitivity
      logical :: wants_sensitivity = .false.
      type(sensitivity_settings_t) :: sensitivity
      !> Whether the file has &fit
      logical :: wants_fit = .false.
      type(fit_settings_t) :: fit
      !> Whether the file has &uncertainty
      logical :: wants_uncertainty = .false.
      type(uncertainty_settings_t) :: uncertainty
      !> Whether the file has &statements
      logical :: wants_statements = .false.
      type(statements_settings_t) :: statements
      type(output_settings_t) :: output
      type(scales_t) :: scales
      !> System of units of the values in the file, index in `system_names` of `quantities`; 0: not given
      integer :: unit_system = 0
      !> Units of the results, one of the `output_` constants; 0: not given
      integer :: output_units = 0
   contains
      procedure :: has_contacts
      procedure :: has_group
   end type scene_t

contains

   !> All stops of a scene, in the order of &stop.
   pure function all_stops(scene) result(stops)
      class(scene_t), intent(in) :: scene
      type(stop_settings_t), allocatable :: stops(:)

      allocate (stops(0))
      if (scene%has_stop) stops = [scene%stop]
      if (scene%has_stop .and. allocated(scene%more_stops)) stops = [stops, scene%more_stops]
   end function all_stops

   !> Whether the scene has stops or bodies.
   pure logical function has_contacts(scene) result(has)
      class(scene_t), intent(in) :: scene

      has = scene%has_stop .or. scene%has_bodies
   end function has_contacts

   !> Whether the scene has stops, all of them rigid.
   pure logical function has_rigid_stops(scene) result(answer)
      class(scene_t), intent(in) :: scene

      answer = scene%has_stop .and. scene%stop%law == law_restitution
      if (answer .and. allocated(scene%more_stops)) answer = all(scene%more_stops%law == law_restitution)
   end function has_rigid_stops

   !> Whether the scene has the groups that a measure or an analysis requires.
   elemental logical function has_group(scene, group) result(has)
      class(scene_t), intent(in) :: scene
      !> Component `group` of a measure, or name of a group; the result is true if it is empty or not listed here
      character(*), intent(in) :: group

      character(*), parameter :: groups(9) = [character(18) :: 'stress', 'statistics', 'steady', 'fatigue', 'relay', &
         'poincare', 'orbit', 'frequency_response', 'spectrum']
      logical :: counts_cycles

      counts_cycles = scene%stress%fatigue_slope > 0.0_wp
      has = .true.
      if (any(group == measured_groups)) has = scene%wants_statistics .and. has_own_statistics(scene, group)
      ! where cycles of stresses are counted, the steady window is the whole run
      if (any(group == groups)) has = any(group == pack(groups, [scene%wants_stress, scene%wants_statistics, &
         scene%wants_stress .and. (scene%wants_statistics .or. counts_cycles), scene%wants_stress .and. counts_cycles, &
         scene%wants_relay, scene%wants_poincare, scene%wants_orbit, scene%wants_frequency_response, &
         scene%wants_spectrum]))
   end function has_group

   !> Whether the scene has a stop, body, floor or ceiling besides others, so that its statistics differ from those of
   !> all.
   pure logical function has_own_statistics(scene, group) result(has)
      class(scene_t), intent(in) :: scene
      !> One of `measured_groups`
      character(*), intent(in) :: group

      character(*), parameter :: floor_names(4) = [character(13) :: 'floor', 'floor_ratio', 'ceiling', 'ceiling_ratio']
      ! whether each body has a floor or a ceiling, in some cases of a sweep at least
      logical, allocatable :: has_floor(:)
      ! number of stops, and the number in the name of the group
      integer :: stops, number
      integer :: k

      stops = size(all_stops(scene))
      allocate (has_floor(0))
      if (scene%has_bodies) has_floor = max(scene%bodies%floor, scene%bodies%ceiling) >= 0.0_wp
      if (allocated(scene%sweep%swept)) then
         do k = 1, size(scene%sweep%swept)
            associate (swept => scene%sweep%swept(k), parameter => scene%sweep%swept(k)%parameter)
               if (.not. is_swept(swept) .or. parameter%group /= 'body') cycle
               if (any(parameter%name_in_group == floor_names)) has_floor(parameter%occurrence) = .true.
            end associate
         end do
      end if
      has = stops + size(has_floor) + count(has_floor) > 1
      if (.not. has) return
      associate (place => index(group, '_') + 1)
         number = iachar(group(place:place)) - iachar('0')
      end associate
      has = number <= merge(stops, size(has_floor), group(1:1) == 's')
      if (has .and. group(1:1) == 'f') has = has_floor(number)
   end function has_own_statistics

end module scene_types
