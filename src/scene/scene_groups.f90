!> The names of scene files: one entry for each name, bound to a component of the scene, whose declaration has the
!> default value. Reading, checks, echo (values in results files) and reference (--names) follow from these entries; to
!> add a name, add its entry and its component.
!>
!> The names in the condition of an entry must be listed before the entry, in its own group or in an earlier one.
module scene_groups
   use history_list, only: history_count, history_table
   use kinds, only: wp
   use measure_list, only: measure_of_word, measure_status, measure_words
   use name_table, only: table_t
   use name_types, only: condition_t, group_t, in_units_t, kind_number, name_t, sweep_t, duration_range, length_range, &
      point_range, range_t
   use program_identity, only: in_motion_and_benchmark, program_any, program_benchmark, program_paper
   use quantities, only: system_names
   use run_settings, only: method_names, name_length, output_settings_t, response_settings_t
   use scene_beam, only: list_beam
   use scene_bodies, only: list_bodies
   use scene_inference, only: inference_names, list_inference
   use scene_loads, only: list_bases, list_forces
   use scene_requests, only: list_request, request_names
   use scene_root_and_masses, only: list_masses, list_root
   use scene_section, only: list_section
   use scene_start, only: list_start
   use scene_stops, only: list_stops, list_supports
   use scene_types, only: integrator_names, frequency_settings_t, mass_names, mesh_settings_t, output_unit_names, &
      precision_settings_t, reference_names, scene_t, solver_names, statements_settings_t
   use sweep_names, only: find_parameters, list_sweep, parameter_names, parameter_of, sweep_of
   use sweep_settings, only: best_settings_t, goal_names, swept_t
   use warning_list, only: warning_names
   implicit none (type, external)
   private
   public :: list_scene, list_group, copy_changes_to_scene

   !> Names of Newmark's schemes (`newmark_scheme` of &response).
   character(*), parameter :: scheme_names(3) = [character(name_length) :: &
      'average_acceleration', 'linear_acceleration', 'explicit']
   !> Newmark's beta of each scheme
   real(wp), parameter :: scheme_betas(3) = [1.0_wp/4.0_wp, 1.0_wp/6.0_wp, 0.0_wp]

   !> Index of 'all' in `history_names`.
   integer, parameter :: history_all = history_count + 1
   !> Index of 'none' in `history_names`.
   integer, parameter :: history_none = history_count + 2
   character(*), parameter :: history_names(history_count + 2) = [character(name_length) :: &
      history_table%name, 'all', 'none']

   !> Names of the groups, in the order of the reference and the echo.
   character(*), parameter :: group_names(*) = [character(name_length) :: 'scene', 'beam', 'section', 'root', 'mass', &
      'mesh', 'damping', 'tip_mass', 'stop', 'body', 'support', 'force', 'base', 'start', 'response', 'stress', &
      request_names, 'frequencies', 'precision', 'sweep', 'best', 'cases', inference_names, 'statements', 'output']

   ! Shared conditions: Rayleigh damping, Newmark's method, refinement in &best, groups that the scene must have
   type(condition_t), parameter :: rayleigh = condition_t(without='mode_ratios', &
      phrase='C = gamma K + alpha M, not with mode_ratios')
   type(condition_t), parameter :: newmark = condition_t(name='method', words='newmark')
   type(condition_t), parameter :: refinement = condition_t(name='refine')
   type(condition_t), parameter :: a_stop = condition_t(group='stop')
   type(condition_t), parameter :: a_response = condition_t(group='response')

   !> Maximum number of elements of any mesh.
   integer, parameter :: max_elements = 200000
   !> Maximum number of elements of a mesh for the statements of the paper.
   integer, parameter :: max_elements_statements = 128
   !> Maximum number of elements of a mesh for methods with full matrices.
   integer, parameter :: max_elements_full_matrices = 1000
   ! Ranges that several names have in common
   type(range_t), parameter :: elements_range = range_t(1.0_wp, real(max_elements, wp))
   type(range_t), parameter :: statements_range = range_t(1.0_wp, real(max_elements_statements, wp))
   type(range_t), parameter :: modes_range = range_t(1.0_wp, 2.0_wp*real(max_elements, wp))
   type(range_t), parameter :: ratio_range = range_t(0.1_wp, 10.0_wp)
   type(range_t), parameter :: hop_range = range_t(1.0e-14_wp, 0.1_wp)
   type(range_t), parameter :: mode_range = range_t(0.0_wp, 0.1_wp)

   !> Meaning of `displacement_scale` of &scene.
   character(*), parameter :: unit_of_displacement = 'unit of displacement D, length; without a release by default ' &
      //'the maximum distance of a stop that is given in units, else the mean height'

contains

   !> List all names of all groups in the table, and bind them to the components of the scene.
   subroutine list_scene(table, scene)
      class(table_t), intent(inout) :: table
      type(scene_t), intent(inout) :: scene

      integer :: i

      do i = 1, size(group_names)
         call list_group(trim(group_names(i)), table, scene)
      end do
   end subroutine list_scene

   !> Copy the values that have changed in the table into the scene.
   subroutine copy_changes_to_scene(table, scene)
      class(table_t), intent(inout) :: table
      type(scene_t), intent(inout) :: scene

      integer :: i

      do i = 1, table%group_count
         if (.not. table%groups(i)%is_changed) cycle
         call table%begin_copy_of_changes(i)
         call list_group(trim(table%groups(i)%name), table, scene)
      end do
   end subroutine copy_changes_to_scene

   !> List the names of one group in the table, and bind them to the components of the scene.
   subroutine list_group(group, table, scene)
      !> One of `group_names`
      character(*), intent(in) :: group
      class(table_t), intent(inout) :: table
      type(scene_t), intent(inout) :: scene

      ! whether results besides measures are stored
      logical :: is_stored

      select case (group)
      case ('scene')
         call list_heading(table, scene)
      case ('beam')
         call list_beam(table, scene%beam)
      case ('section')
         call list_section(table, scene%beam)
      case ('root')
         call list_root(table, scene)
      case ('mass')
         call list_masses(table, scene)
      case ('mesh')
         call list_mesh(table, scene%mesh)
      case ('damping')
         call list_damping(table, scene)
      case ('tip_mass')
         call table%open(group_t('tip_mass', in_motion_and_benchmark))
         call table%bind(scene%tip_mass_ratio, name_t('ratio', 'mu = tip mass over mass of the beam', &
            range_t(0.0_wp, 1.0e6_wp), &
            sweep=sweep_t(4, changes_beam=.true., is_in_cases=.true., name='tip_mass_ratio')), &
            in_units_t('mass', 'mass', 'tip mass', swept_as='tip_mass'))
      case ('stop')
         call list_stops(table, scene)
      case ('body')
         call list_bodies(table, scene)
      case ('support')
         call list_supports(table, scene)
      case ('force')
         call list_forces(table, scene)
      case ('base')
         call list_bases(table, scene)
      case ('start')
         call table%open(group_t('start'), scene%has_start)
         if (table%lists_names) call list_start(table, scene%start)
      case ('response')
         call table%open(group_t('response'), scene%wants_response)
         if (table%lists_names) call list_response(table, scene%response)
      case ('stress')
         call list_stress(table, scene)
      case ('frequencies')
         call table%open(group_t('frequencies', in_motion_and_benchmark), scene%wants_frequencies)
         if (table%lists_names) call list_frequencies(table, scene%frequencies)
      case ('precision')
         call table%open(group_t('precision', program_benchmark, stands_alone=.true.), scene%wants_precision)
         if (table%lists_names) call list_precision(table, scene%precision)
      case ('sweep')
         call table%open(group_t('sweep', stands_alone=.true.), scene%wants_sweep)
         if (table%lists_names) call list_sweep(table, scene%sweep)
      case ('best')
         call table%open(group_t('best', stands_alone=.true.), scene%wants_best)
         if (table%lists_names) call list_best(table, scene%best)
      case ('cases')
         call list_cases(table, scene%wants_cases, scene%cases)
      case ('sensitivity', 'fit', 'uncertainty')
         call list_inference(group, table, scene)
      case ('statements')
         call table%open(group_t('statements', program_paper, stands_alone=.true.), scene%wants_statements)
         if (table%lists_names) call list_statements(table, scene%statements)
      case ('output')
         ! the results of a sweep are its rows of measures alone
         is_stored = .not. (scene%wants_sweep .or. scene%wants_sensitivity)
         call table%open(group_t('output'), is_stored)
         if (table%lists_names) call list_output(table, scene%output, scene%output_units)
      case default
         call list_request(group, table, scene)
      end select
   end subroutine list_group

   !> List the names of &scene in the table, and bind them to the components of the scene.
   subroutine list_heading(table, scene)
      class(table_t), intent(inout) :: table
      type(scene_t), intent(inout) :: scene

      call table%open(group_t('scene', program_any))
      call table%bind(scene%name, name_t('name', 'name of the results file: letters, digits, . _ -', &
         range_t(1, name_length), default='name of the scene file'))
      call table%store(name_t('displacement_scale', unit_of_displacement, length_range, &
         default='initial_height above the surface', is_optional=.true., is_scale=.true.), kind_number)
      call table%bind(scene%title, name_t('title', 'heading of tables and pictures', range_t(1, 200), &
         default='the name'))
      call table%bind(scene%unit_system, name_t('units', 'what its values are in; its results are in them too', &
         default='none: results are dimensionless', is_optional=.true.), system_names)
      call table%bind(scene%silent_warnings, name_t('silent_warnings', 'warnings that are not printed', &
         default='none: all are printed', is_optional=.true.), warning_names)
   end subroutine list_heading

   !> List the names of &damping in the table, and bind them to the components of the scene.
   subroutine list_damping(table, scene)
      class(table_t), intent(inout) :: table
      type(scene_t), intent(inout) :: scene

      call table%open(group_t('damping', in_motion_and_benchmark))
      call table%bind(scene%zeta, name_t('zeta', 'C = gamma K, gamma = 2 zeta/omega1: a mode of circular frequency ' &
         //'omega has the damping ratio zeta omega/omega1, omega1 being that of the uniform clamped beam', &
         range_t(0.0_wp, 10.0_wp), rayleigh, &
         sweep=sweep_t(8, is_in_cases=.true., may_change_in_motion=.true., meaning='damping ratio')), &
         in_units_t('stiffness_coefficient', 'stiffness_damping', 'gamma of C = gamma K, time: a mode of circular ' &
         //'frequency omega has the damping ratio gamma omega/2'))
      call table%bind(scene%zeta_mass, name_t('zeta_mass', 'C = alpha M, alpha = 2 zeta_mass omega1: a mode of ' &
         //'circular frequency omega has the damping ratio zeta_mass omega1/omega', range_t(0.0_wp, 10.0_wp), &
         rayleigh, sweep=sweep_t(54, is_in_cases=.true., may_change_in_motion=.true.)), &
         in_units_t('mass_coefficient', 'mass_damping', 'alpha of C = alpha M, per time: a mode of circular ' &
         //'frequency omega has the damping ratio alpha/(2 omega)'))
      call table%bind(scene%mode_ratios, name_t('mode_ratios', 'damping ratio of each mode of the beam with its ' &
         //'supports and masses, without contact: 1/(2 Q) or half a loss factor; the last is that of all higher ' &
         //'modes', &
         range_t(0.0_wp, 10.0_wp), condition_t(without='zeta stiffness_coefficient zeta_mass mass_coefficient', &
         phrase='damping of each mode alone'), default='none: C = gamma K + alpha M', is_optional=.true., &
         sweep=sweep_t(55, is_in_cases=.true., may_change_in_motion=.true.)))
   end subroutine list_damping

   !> List the names of &mesh in the table, and bind them to the components of the scene.
   subroutine list_mesh(table, mesh)
      class(table_t), intent(inout) :: table
      type(mesh_settings_t), intent(inout) :: mesh

      call table%open(group_t('mesh', in_motion_and_benchmark))
      call table%bind(mesh%nodes, name_t('nodes', &
         'positions of the nodes, ascending from 0 to length; the nearest moves to each stop, support or mass', &
         range_t(0.0_wp, length_range%maximum), default='elements of one ratio', is_optional=.true.))
      call table%bind(mesh%tolerance, name_t('tolerance', &
         'find the elements: eta of stop and tip, first impact and settling time are within this', &
         range_t(1.0e-10_wp, 0.1_wp), condition_t(without='nodes', phrase='a mesh that is sought, not with nodes'), &
         default='elements as given', is_optional=.true.))
      call table%bind(mesh%elements, name_t('elements', 'number of elements', elements_range, &
         condition_t(without='tolerance nodes', phrase='a given number, not with tolerance or nodes'), &
         default='8; found for a response', &
         sweep=sweep_t(1, changes_beam=.true.)))
      call table%bind(mesh%ratio, name_t('ratio', 'length of an element over that of the next towards the tip', &
         ratio_range, condition_t(without='nodes', phrase='elements of one ratio, not with nodes'), &
         sweep=sweep_t(2, changes_beam=.true., name='mesh_ratio', meaning='ratio of neighbouring elements')))
      call table%bind(mesh%mass, name_t('mass', 'mass matrix of motion; redistributed: impacts act on point masses', &
         default="'auto'"), mass_names)
      call table%bind(mesh%estimate, name_t('estimate', 'estimate the error of each measure from two finer meshes', &
         default='.true. if it is cheap for the run'))
   end subroutine list_mesh

   !> List the names of &response in the table, and bind them to the components of the scene.
   subroutine list_response(table, response)
      class(table_t), intent(inout) :: table
      type(response_settings_t), intent(inout) :: response

      ! index of Newmark's scheme, which gives beta by name; 0: not given
      integer :: scheme

      call table%bind(response%duration, name_t('duration', 'length of the run, tau = omega1 t', duration_range, &
         sweep=sweep_t(6, meaning='length of the run, tau')), &
         in_units_t('duration_time', 'time', 'length of the run, time'))
      call table%bind(response%step, name_t('step', "time between samples of the results, and Newmark's step, tau", &
         range_t(1.0e-9_wp, 1.0e9_wp)), in_units_t('step_time', 'time', 'the same in time'))
      call table%bind(response%method, name_t('method', 'method of integration in time'), method_names)
      call table%bind(response%newmark_beta, name_t('newmark_beta', "Newmark's beta", range_t(0.0_wp, 1.0_wp), newmark))
      scheme = 0
      call table%bind(scheme, name_t('newmark_scheme', 'beta by name: 1/4, 1/6, 0', needs=newmark, &
         instead_of='newmark_beta'), scheme_names)
      if (scheme > 0) response%newmark_beta = scheme_betas(scheme)
      call table%bind(response%newmark_gamma, name_t('newmark_gamma', "Newmark's gamma; below 1/2 no step is stable", &
         range_t(0.5_wp, 1.0_wp), newmark))
      call table%bind(response%substep, name_t('substep', 'divide a step that is too long for the scheme', &
         needs=newmark))
      call table%bind(response%contact_tolerance, name_t('contact_tolerance', &
         '|eta_c| at which an approach is a contact', range_t(0.0_wp, 0.1_wp, excludes_minimum=.true.), newmark))
      call table%bind(response%release_tolerance, name_t('release_tolerance', 'Pbar below which a contact ends', &
         range_t(0.0_wp, 1.0e3_wp, excludes_minimum=.true.), newmark))
      call table%bind(response%hop_tolerance, name_t('hop_tolerance', 'lower flights, over D, count as contact', &
         hop_range, sweep=sweep_t(7, may_change_in_motion=.true.)))
      call table%bind(response%event_limit, name_t('event_limit', 'events after which the run fails', &
         range_t(1, 1000000000)))
      call table%bind(response%accuracy, name_t('accuracy', 'share of the maximum displacement by which leaving out ' &
         //'modes may change those of stops and tip', range_t(0.0_wp, 0.1_wp, excludes_minimum=.true.)))
      call table%bind(response%mode_tolerance, name_t('mode_tolerance', &
         'eta by which leaving out modes may change the motion at most', mode_range, default='as accuracy asks', &
         is_optional=.true.))
      call table%bind(response%keep_all_modes, name_t('keep_all_modes', 'leave out no mode'))
      call table%bind(response%mode_count, name_t('modes', 'number of the lowest modes of the free beam to keep', &
         range_t(1.0_wp, 2.0_wp*real(max_elements, wp)), default='as accuracy asks', is_optional=.true., &
         sweep=sweep_t(56, is_in_cases=.true.)))
   end subroutine list_response

   !> List the names of &stress in the table, and bind them to the components of the scene.
   subroutine list_stress(table, scene)
      class(table_t), intent(inout) :: table
      type(scene_t), intent(inout) :: scene

      call table%open(group_t('stress'), scene%wants_stress)
      if (.not. table%lists_names) return
      call table%bind(scene%stress%position, name_t('position', 'points over length where bending moment and ' &
         //'stress at the outer fibre are requested; at a step of the section the greater stress of both sides; ' &
         //'where the moment jumps, both', point_range, default='0, the root', &
         sweep=sweep_t(60, is_in_cases=.true., name='stress_position', meaning='point of the stress over length')), &
         in_units_t('position_length', 'length', 'the same as lengths from the root', &
         swept_as='stress_position_length'))
      if (.not. allocated(scene%stress%position)) scene%stress%position = [0.0_wp]
      call table%bind(scene%stress%history, name_t('history', 'histories of both at the sample times'))
      call table%bind(scene%stress%fatigue_slope, name_t('fatigue_slope', 'exponent m of the S-N curve: count cycles ' &
         //'of the stress (rainflow, ASTM E1049) and give the range of equal cycles that do the same damage', &
         range_t(1.0_wp, 100.0_wp), default='none: cycles are not counted', is_optional=.true.))
      call table%bind(scene%stress%fatigue_threshold, name_t('fatigue_threshold_ratio', 'stress in E D/L by which ' &
         //'the stress must reverse at a turning point that counts', range_t(0.0_wp, 1.0e12_wp), &
         default='1 % of the range', is_optional=.true.), &
         in_units_t('fatigue_threshold', 'stress', 'the same as a stress'))
      call table%bind(scene%stress%fatigue_classes, name_t('fatigue_classes', 'classes of the histogram of cycles', &
         range_t(1, 10000)))
      call table%bind(scene%stress%fatigue_limit, name_t('fatigue_limit', 'turning points of the stress at a ' &
         //'position, after which cycles are no longer counted', range_t(1, 1000000000)))
      call table%bind(scene%stress%strength, name_t('strength', 'stress that the material bears, beyond which there ' &
         //'is a warning; 0: none', range_t(0.0_wp, 1.0e20_wp)))
   end subroutine list_stress

   !> List the names of &frequencies in the table, and bind them to the components of the scene.
   subroutine list_frequencies(table, frequencies)
      class(table_t), intent(inout) :: table
      type(frequency_settings_t), intent(inout) :: frequencies

      call table%bind(frequencies%count, name_t('count', 'number of modes', modes_range, &
         default='as many as the mesh has, up to 12'))
      call table%bind(frequencies%solver, name_t('solver', 'eigen-solvers, one column each', &
         default='natural; auto beyond 100 elements'), solver_names)
      call table%bind(frequencies%mesh_elements, name_t('mesh_elements', &
         'elements of each mesh; one value serves all', elements_range, default='elements of &mesh'))
      call table%bind(frequencies%mesh_ratios, name_t('mesh_ratios', 'ratio of each mesh; one value serves all', &
         ratio_range, default='ratio of &mesh'))
      call table%bind(frequencies%reference, name_t('reference', 'values to compare with', &
         default='exact if they are known'), reference_names)
   end subroutine list_frequencies

   !> List the names of &precision in the table, and bind them to the components of the scene.
   subroutine list_precision(table, precision)
      class(table_t), intent(inout) :: table
      type(precision_settings_t), intent(inout) :: precision

      call table%bind(precision%methods, name_t('methods', 'ways through time to compare', needs=a_stop, &
         default='all'), integrator_names)
      call table%bind(precision%duration, name_t('duration', 'length of the runs, tau', duration_range, a_stop))
      call table%bind(precision%steps, name_t('steps', "Newmark's steps d tau; tolerances fall with their squares", &
         range_t(1.0e-6_wp, 0.1_wp), a_stop, default='0.04 halved up to seven times'))
      call table%bind(precision%mode_count, name_t('modes', 'number of the lowest modes in which all methods move', &
         range_t(1.0_wp, 2.0_wp*real(max_elements, wp)), a_stop, default='as each method has it', is_optional=.true.))
      call table%bind(precision%hop_tolerances, name_t('hop_tolerances', 'hop tolerances of exact motion', hop_range, &
         a_stop, default='1e-2, 1e-3 ... 1e-12'))
      call table%bind(precision%mode_tolerances, name_t('mode_tolerances', 'mode tolerances of exact motion', &
         mode_range, a_stop, default='none'))
      call table%bind(precision%mesh_elements, name_t('mesh_elements', 'meshes of exact motion; against_beam: of all', &
         range_t(1, max_elements_full_matrices), a_stop, default='none'))
      call table%bind(precision%against_beam, name_t('against_beam', &
         'find the cheapest way to each error against the beam itself: every method on every mesh', needs=a_stop))
      call table%bind(precision%scaling_elements, name_t('scaling_elements', &
         'meshes over which cost and memory grow', elements_range, a_stop, default='none'))
      call table%bind(precision%scaling_modes, name_t('scaling_modes', 'modes for which these are solved', &
         range_t(1, 100), a_stop))
      call table%bind(precision%scaling_durations, name_t('scaling_durations', &
         'lengths of runs over which cost grows, tau', duration_range, a_stop, default='none'))
      call table%bind(precision%skips, name_t('skips', 'time what skipping saves, and compare the answers', &
         needs=a_stop))
      call table%bind(precision%repetitions, name_t('repetitions', &
         'timings of each entry, of which the median counts', range_t(1, 1000)))
      call table%bind(precision%shortest_timing, name_t('shortest_timing', 'seconds that a timing lasts at least', &
         range_t(1.0e-4_wp, 10.0_wp)))
   end subroutine list_precision

   !> List the names of &best in the table, and bind them to the components of the scene.
   subroutine list_best(table, best)
      class(table_t), intent(inout) :: table
      type(best_settings_t), intent(inout) :: best

      ! index of the measure, after the status of the case, in the list of words
      integer :: chosen

      ! the first measure, the status of a case, is no measure by which cases are compared
      chosen = best%measure - measure_status
      call table%bind(chosen, name_t('measure', 'measure by which cases are compared'), measure_words)
      best%measure = measure_of_word(chosen)
      call table%bind(best%goal, name_t('goal', 'which of its values is the best'), goal_names)
      call table%bind(best%count, name_t('count', 'cases in the table of the best', range_t(1, 10000)))
      call table%bind(best%refine, name_t('refine', &
         'search for better values between the swept ones, from the best case on'))
      call table%bind(best%evaluations, name_t('evaluations', 'most cases that the refinement computes', &
         range_t(1, 10000000), refinement))
      call table%bind(best%precision, name_t('precision', 'share of each range at which it ends', &
         range_t(1.0e-12_wp, 0.1_wp), refinement))
   end subroutine list_best

   !> List the names of &cases in the table, and bind them to the components of the scene.
   subroutine list_cases(table, is_wanted, cases)
      class(table_t), intent(inout) :: table
      logical, intent(inout) :: is_wanted
      type(swept_t), intent(inout) :: cases

      integer, allocatable :: places(:)
      character(name_length), allocatable :: names(:)
      integer :: k, chosen

      call table%open(group_t('cases', stands_alone=.true.), is_wanted)
      if (.not. table%lists_names) return
      call find_parameters(table, places)
      places = pack(places, [(is_in_cases(table, places(k)), k=1, size(places))])
      allocate (names, source=parameter_names(table, places))
      chosen = 0
      if (cases%parameter%name /= '') chosen = findloc(names, cases%parameter%name, dim=1)
      call table%bind(chosen, name_t('parameter', 'parameter that differs between cases', &
         default='none: give one'), names)
      if (chosen > 0) cases%parameter = parameter_of(table, places(chosen))
      call table%bind(cases%list, name_t('values', 'its values, one case each', range_t(-1.0e6_wp, 1.0e12_wp), &
         default='none: give some', range_of='parameter'))
   end subroutine list_cases

   !> Whether &cases may vary the entry.
   pure logical function is_in_cases(table, place)
      class(table_t), intent(in) :: table
      !> Index of the entry
      integer, intent(in) :: place

      type(sweep_t) :: sweep

      sweep = sweep_of(table, place)
      is_in_cases = sweep%is_in_cases
   end function is_in_cases

   !> List the names of &statements in the table, and bind them to the components of the scene.
   subroutine list_statements(table, statements)
      class(table_t), intent(inout) :: table
      type(statements_settings_t), intent(inout) :: statements

      call table%bind(statements%elements, name_t('elements', "elements of the paper's mesh", statements_range))
      call table%bind(statements%fine_elements, name_t('fine_elements', &
         'elements of a mesh that is fine enough to judge by', statements_range))
      call table%bind(statements%duration, name_t('duration', 'length of the runs, tau', duration_range))
   end subroutine list_statements

   !> List the names of &output in the table, and bind them to the components of the scene.
   subroutine list_output(table, output, units)
      class(table_t), intent(inout) :: table
      type(output_settings_t), intent(inout) :: output
      !> Units of the results: one of the `output_` constants, or 0
      integer, intent(inout) :: units

      integer, allocatable :: histories(:)
      integer :: i

      histories = pack([(i, i=1, history_count)], output%history)
      if (size(histories) == 0) histories = [history_none]
      call table%bind(histories, name_t('histories', 'histories at the sample times', needs=a_response, &
         default='all but accelerations', &
         alone=[character(32) :: 'all', 'none']), history_names)
      output%history = [(any(histories == i .or. histories == history_all), i=1, history_count)]
      call table%bind(output%shape_times, name_t('shape_times', 'instants at which the shape is stored, tau', &
         range_t(0.0_wp, 1.0e9_wp), a_response, default='0 in a single run'))
      call table%bind(output%shape_step, name_t('shape_step', &
         'distance of further such instants, from 0 to the end, tau; 0: none', range_t(0.0_wp, 1.0e9_wp), a_response))
      call table%bind(units, name_t('units', "what results are in, the scene's units or none", &
         default='scene if &scene units are given', is_optional=.true.), output_unit_names)
      call table%bind(output%energy, name_t('energy', 'the energy balance', needs=a_response))
      call table%bind(output%mode_shapes, name_t('mode_shapes', 'number of mode shapes to store', &
         range_t(0.0_wp, 2.0_wp*real(max_elements, wp)), condition_t(group='frequencies')))
   end subroutine list_output

end module scene_groups
