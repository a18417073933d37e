!> The groups of a scene file and the names in them: one call a name, with its meaning and what it
!> may be. Defaults are those declared in `scene_types`. To add a name, add its component there and a
!> call here; reading, the echo in result files and the reference follow.
module scene_groups
   use cases_groups, only: walk_cases
   use history_list, only: history_count, history_table
   use kinds, only: wp
   use scene_ranges, only: branch_range, damper_range, duration_range, elements_range, hop_range, most_elements, &
      position_ratio_range, preload_range, ratio_range, restitution_range, step_range, stiffness_range, taper_range, &
      tip_mass_range, zeta_range
   use scene_types, only: beam_settings_t, contender_names, frequency_settings_t, impulse_names, law_names, &
      law_restitution, &
      law_three_element, mesh_settings_t, method_exact, method_names, method_newmark, name_length, &
      output_settings_t, precision_settings_t, reference_names, response_settings_t, scene_t, shape_height_table, &
      shape_section_table, shape_taper, solver_names, statements_settings_t, stop_settings_t
   use scene_walk, only: scene_walk_t
   use sweep_groups, only: walk_best, walk_sweep
   use value_rules, only: above, range_t, role_t, within
   implicit none (type, external)
   private
   public :: physical_t, walk_scene
   public :: scheme_average_acceleration, scheme_linear_acceleration, scheme_explicit

   !> Quantities that a file may give instead of the ratios of a scene, in the user's units. Which of
   !> them it gives the input knows.
   type :: physical_t
      !> (h0 - h1) / L, and (h0 + h1) / (2 L)
      real(wp) :: taper = 0.0_wp
      real(wp) :: mean_height_ratio = 0.075_wp
      !> gamma of C = gamma K
      real(wp) :: stiffness_coefficient = 0.0_wp
      !> Tip mass
      real(wp) :: mass = 0.0_wp
      !> d and y_c(0), from the unstressed beam
      real(wp) :: surface_height = 0.0_wp
      real(wp) :: initial_height = 1.0_wp
      !> k, beta k and c
      real(wp) :: stiffness = 0.0_wp
      real(wp) :: branch_stiffness = 0.0_wp
      real(wp) :: damper = 0.0_wp
      !> Duration and step of the response
      real(wp) :: duration_time = 0.0_wp
      real(wp) :: step_time = 0.0_wp
      !> One of the `scheme_` constants; 0: not given
      integer :: newmark_scheme = 0
   end type physical_t

   integer, parameter :: scheme_average_acceleration = 1
   integer, parameter :: scheme_linear_acceleration = 2
   integer, parameter :: scheme_explicit = 3
   character(*), parameter :: scheme_names(3) = [character(name_length) :: &
      'average_acceleration', 'linear_acceleration', 'explicit']

   integer, parameter :: history_all = history_count + 1
   integer, parameter :: history_none = history_count + 2
   character(*), parameter :: history_names(history_count + 2) = [character(name_length) :: &
      history_table%name, 'all', 'none']

   integer, parameter :: longest_title = 200
   integer, parameter :: most_elements_judged = 128
   ! Ranges in the user's units: wide, but products and quotients of a few of them stay far from
   ! overflow
   type(range_t), parameter :: length_range = range_t(1.0e-12_wp, 1.0e12_wp)
   type(range_t), parameter :: height_range = range_t(0.0_wp, 1.0e12_wp)
   type(range_t), parameter :: position_range = range_t(-1.0e12_wp, 1.0e12_wp)
   type(range_t), parameter :: area_range = range_t(0.0_wp, 1.0e24_wp)
   type(range_t), parameter :: inertia_range = range_t(0.0_wp, 1.0e48_wp)
   ! kilograms per cubic nanometre among them
   type(range_t), parameter :: material_range = range_t(1.0e-30_wp, 1.0e30_wp)
   type(range_t), parameter :: physical_range = range_t(0.0_wp, 1.0e20_wp)

contains

   !> Call for every name of every group.
   subroutine walk_scene(walk, scene, physical)
      !> What the calls do: read, echo or list
      type(scene_walk_t), intent(inout) :: walk
      !> What is read into or echoed
      type(scene_t), intent(inout) :: scene
      !> Reading: what the file gives in physical units
      type(physical_t), intent(inout) :: physical

      call walk%open_group('scene')
      call walk%item('name', scene%name, 'name of the results file: letters, digits, . _ -', name_length, &
         role_t(default='name of the scene file'))
      call walk%item('title', scene%title, 'heading of tables and pictures', longest_title, &
         role_t(default='the name'))
      call walk_beam(walk, scene%beam, physical)
      call walk_mesh(walk, scene%mesh)
      call walk%open_group('damping')
      call walk%item('zeta', scene%zeta, 'damping ratio gamma omega1 / 2', zeta_range)
      call walk%item('stiffness_coefficient', physical%stiffness_coefficient, 'gamma of C = gamma K, time', &
         physical_range, role_t(instead_of='zeta'))
      call walk%open_group('tip_mass')
      call walk%item('ratio', scene%tip_mass_ratio, 'mu = tip mass over mass of the beam', tip_mass_range)
      call walk%item('mass', physical%mass, 'tip mass', physical_range, role_t(instead_of='ratio'))
      call walk%open_group('stop', scene%has_stop)
      call walk_stop(walk, scene%stop, physical)
      call walk%open_group('response', scene%wants_response)
      call walk_response(walk, scene%response, physical)
      call walk%open_group('frequencies', scene%wants_frequencies)
      call walk_frequencies(walk, scene%frequencies)
      call walk%open_group('precision', scene%wants_precision)
      call walk_precision(walk, scene%precision, scene%has_stop)
      call walk%open_group('sweep', scene%wants_sweep)
      call walk_sweep(walk, scene)
      call walk%open_group('best', scene%wants_best)
      call walk_best(walk, scene%best)
      call walk%open_group('cases', scene%wants_cases)
      call walk_cases(walk, scene)
      call walk%open_group('statements', scene%wants_statements)
      call walk_statements(walk, scene%statements)
      call walk%open_group('output')
      call walk_output(walk, scene%output, scene%wants_response .and. (walk%is_reading() .or. .not. scene%wants_sweep), &
         scene%wants_frequencies)
   end subroutine walk_scene

   !> &beam
   subroutine walk_beam(walk, beam, physical)
      !> What the calls do
      type(scene_walk_t), intent(inout) :: walk
      !> The beam
      type(beam_settings_t), intent(inout) :: beam
      !> Its taper, if that is what the file gives
      type(physical_t), intent(inout) :: physical

      character(*), parameter :: heights = 'heights, not with area and inertia'
      character(*), parameter :: taper = 'a linear taper, not with tables'
      character(*), parameter :: height_table = 'station, not with area and inertia'
      character(*), parameter :: section_table = 'area and inertia, and station where they vary'
      character(*), parameter :: any_table = 'height, or with area and inertia'
      logical :: is_taper, is_section

      if (walk%is_reading()) beam%shape = shape_from_names(walk)
      is_taper = beam%shape == shape_taper
      is_section = beam%shape == shape_section_table
      call walk%open_group('beam')
      call walk%item('length', beam%length, 'length L', length_range)
      call walk%item('width', beam%width, 'width b', length_range, role_t(.not. is_section, heights))
      call walk%item('youngs_modulus', beam%youngs_modulus, 'Young''s modulus E', material_range)
      call walk%item('density', beam%density, 'density rho', material_range)
      call walk%item('height_root', beam%height_root, 'height at the clamp', length_range, &
         role_t(is_taper, taper, default='0.075 length'))
      call walk%item('height_tip', beam%height_tip, 'height at the tip; 0: a full wedge', height_range, &
         role_t(is_taper, taper, default='height_root'))
      call walk%item('taper', physical%taper, 'alpha = (height_root - height_tip) / length', &
         taper_range, role_t(is_taper, taper, 'height_root', '0'))
      call walk%item('mean_height_ratio', physical%mean_height_ratio, 'mean height over length', &
         range_t(1.0e-9_wp, 1.0_wp), role_t(is_taper, taper, 'height_root', '0.075'))
      call walk%item('station', beam%station, 'positions of the table, from 0 to length, ascending', &
         height_range, role_t(.not. is_taper, any_table))
      call walk%item('height', beam%height, 'heights at the stations, linear between them', height_range, &
         role_t(beam%shape == shape_height_table, height_table))
      call walk%item('area', beam%area, 'areas at the stations, linear between them', area_range, &
         role_t(is_section, section_table))
      call walk%item('inertia', beam%inertia, 'second moments of area at the stations', inertia_range, &
         role_t(is_section, section_table))
   end subroutine walk_beam

   !> Which description of the section the file gives; what contradicts it is reported later.
   function shape_from_names(walk) result(shape)
      !> The file
      type(scene_walk_t), intent(in) :: walk
      integer :: shape

      shape = shape_taper
      if (walk%input%has('beam', 'area') .or. walk%input%has('beam', 'inertia')) then
         shape = shape_section_table
      else if (walk%input%has('beam', 'height') .or. walk%input%has('beam', 'station')) then
         shape = shape_height_table
      end if
   end function shape_from_names

   !> &mesh
   subroutine walk_mesh(walk, mesh)
      !> What the calls do
      type(scene_walk_t), intent(inout) :: walk
      !> The mesh
      type(mesh_settings_t), intent(inout) :: mesh

      call walk%open_group('mesh')
      call walk%item('elements', mesh%elements, 'number of elements', elements_range)
      call walk%item('ratio', mesh%ratio, 'length of an element over that of the next towards the tip', &
         ratio_range)
   end subroutine walk_mesh

   !> &stop
   subroutine walk_stop(walk, stop, physical)
      !> What the calls do; the group is open
      type(scene_walk_t), intent(inout) :: walk
      !> The stop
      type(stop_settings_t), intent(inout) :: stop
      !> What the file gives in physical units
      type(physical_t), intent(inout) :: physical

      character(*), parameter :: restitution = 'law = ''restitution'''
      character(*), parameter :: three_element = 'law = ''three_element'''
      logical :: is_restitution, is_three

      call walk%item('position', stop%position, 'position of the stop Lc over length; the tip where the element ' &
         //'beyond would be under 1/100 of its neighbour', position_ratio_range)
      call walk%item('preload', stop%preload, 'delta = d / (y_c(0) - d); > 0: presses on the stop at rest', &
         preload_range)
      call walk%item('surface_height', physical%surface_height, 'd, the stop above the unstressed beam, length', &
         position_range, role_t(instead_of='preload'))
      call walk%item('initial_height', physical%initial_height, 'y_c(0) above the unstressed beam, length', &
         position_range, role_t(instead_of='preload'))
      call walk%choice('law', stop%law, 'model of the stop', law_names)
      is_restitution = stop%law == law_restitution
      is_three = stop%law == law_three_element
      call walk%item('restitution', stop%restitution, 'coefficient of restitution eps', restitution_range, &
         role_t(is_restitution, restitution))
      call walk%choice('impulse', stop%impulse, 'what an impact acts on: the whole beam, or one velocity', &
         impulse_names, role_t(is_restitution, restitution))
      call walk%item('stiffness_ratio', stop%stiffness_ratio, 'kappa = k / (3 E Ibar / L^3)', stiffness_range, &
         role_t(is_three, three_element))
      call walk%item('stiffness', physical%stiffness, 'spring k, force over length', physical_range, &
         role_t(is_three, three_element, 'stiffness_ratio'))
      call walk%item('branch_ratio', stop%branch_ratio, 'beta = spring of the Maxwell branch over k', &
         branch_range, role_t(is_three, three_element))
      call walk%item('branch_stiffness', physical%branch_stiffness, 'spring beta k, force over length', &
         physical_range, role_t(is_three, three_element, 'branch_ratio'))
      call walk%item('damper_ratio', stop%damper_ratio, 'c* = c omega1 / (3 E Ibar / L^3); 0: no branch', &
         damper_range, role_t(is_three, three_element))
      call walk%item('damper', physical%damper, 'damper c of the branch, force over velocity', physical_range, &
         role_t(is_three, three_element, 'damper_ratio'))
   end subroutine walk_stop

   !> &response
   subroutine walk_response(walk, response, physical)
      !> What the calls do; the group is open
      type(scene_walk_t), intent(inout) :: walk
      !> The response
      type(response_settings_t), intent(inout) :: response
      !> What the file gives in physical units
      type(physical_t), intent(inout) :: physical

      character(*), parameter :: newmark = 'method = ''newmark'''
      character(*), parameter :: exact = 'method = ''exact'''
      logical :: is_newmark, is_exact

      call walk%item('duration', response%duration, 'length of the run, tau = omega1 t', duration_range)
      call walk%item('duration_time', physical%duration_time, 'length of the run, time', physical_range, &
         role_t(instead_of='duration'))
      call walk%item('step', response%step, 'distance of the samples, and Newmark''s step, d tau', step_range)
      call walk%item('step_time', physical%step_time, 'the same in time', physical_range, &
         role_t(instead_of='step'))
      call walk%choice('method', response%method, 'way through time', method_names)
      is_newmark = response%method == method_newmark
      is_exact = response%method == method_exact
      call walk%item('newmark_beta', response%newmark_beta, 'Newmark''s beta', within(0.0_wp, 1.0_wp), &
         role_t(is_newmark, newmark))
      call walk%choice('newmark_scheme', physical%newmark_scheme, 'beta by name: 1/4, 1/6, 0', scheme_names, &
         role_t(is_newmark, newmark, 'newmark_beta'))
      call walk%item('newmark_gamma', response%newmark_gamma, 'Newmark''s gamma; below 1/2 no step is stable', &
         within(0.5_wp, 1.0_wp), role_t(is_newmark, newmark))
      call walk%item('substep', response%substep, 'divide a step that is too long for the scheme', &
         role_t(is_newmark, newmark))
      call walk%item('contact_tolerance', response%contact_tolerance, '|eta_c| at which an approach is a contact', &
         above(0.0_wp, 0.1_wp), role_t(is_newmark, newmark))
      call walk%item('release_tolerance', response%release_tolerance, 'Pbar at which contact is over', &
         above(0.0_wp, 1.0e3_wp), role_t(is_newmark, newmark))
      call walk%item('hop_tolerance', response%hop_tolerance, 'eta that a flight must exceed to be no rest', &
         hop_range)
      call walk%item('event_limit', response%event_limit, 'events after which the run fails', &
         within(1, 1000000000))
      call walk%item('mode_tolerance', response%mode_tolerance, 'eta by which leaving out modes may change the motion', &
         within(0.0_wp, 0.1_wp), role_t(is_exact, exact))
      call walk%item('keep_all_modes', response%keep_all_modes, 'leave out no mode', role_t(is_exact, exact))
   end subroutine walk_response

   !> &frequencies
   subroutine walk_frequencies(walk, frequencies)
      !> What the calls do; the group is open
      type(scene_walk_t), intent(inout) :: walk
      !> The table
      type(frequency_settings_t), intent(inout) :: frequencies

      integer :: reference

      call walk%item('count', frequencies%count, 'number of modes', within(1, 2*most_elements), &
         role_t(default='as many as the mesh has, up to 12'))
      call walk%choices('solver', frequencies%solver, 'eigen-solvers, one column each', solver_names, &
         role_t(default='natural; auto beyond 100 elements'))
      call walk%item('mesh_elements', frequencies%mesh_elements, 'elements of each mesh; one value serves all', &
         elements_range, role_t(default='elements of &mesh'))
      call walk%item('mesh_ratios', frequencies%mesh_ratios, 'ratio of each mesh; one value serves all', &
         ratio_range, role_t(default='ratio of &mesh'))
      ! Its constants begin with 0, choices with 1
      reference = frequencies%reference + 1
      call walk%choice('reference', reference, 'values to compare with', reference_names, &
         role_t(default='exact where they are known'))
      frequencies%reference = reference - 1
   end subroutine walk_frequencies

   !> &statements
   subroutine walk_statements(walk, statements)
      !> What the calls do
      type(scene_walk_t), intent(inout) :: walk
      !> The study
      type(statements_settings_t), intent(inout) :: statements

      call walk%item('elements', statements%elements, 'elements of the paper''s mesh', within(1, most_elements_judged))
      call walk%item('fine_elements', statements%fine_elements, 'elements of a mesh that is fine enough to judge by', &
         within(1, most_elements_judged))
      call walk%item('duration', statements%duration, 'length of the runs, tau', duration_range)
   end subroutine walk_statements

   !> &precision
   subroutine walk_precision(walk, precision, has_stop)
      !> What the calls do; the group is open
      type(scene_walk_t), intent(inout) :: walk
      !> The study
      type(precision_settings_t), intent(inout) :: precision
      !> The scene has a stop, so motion is compared; else frequencies alone
      logical, intent(in) :: has_stop

      character(*), parameter :: stop = '&stop'
      integer, parameter :: most_elements_dense = 1000

      call walk%choices('methods', precision%methods, 'ways through time to compare', contender_names, &
         role_t(has_stop, stop, default='all'))
      call walk%item('duration', precision%duration, 'length of the runs, tau', duration_range, role_t(has_stop, stop))
      call walk%item('steps', precision%steps, 'Newmark''s steps d tau; tolerances fall with their squares', &
         range_t(1.0e-6_wp, 0.1_wp), role_t(has_stop, stop, default='0.04 halved up to seven times'))
      call walk%item('hop_tolerances', precision%hop_tolerances, 'hop tolerances of exact motion', &
         within(1.0e-14_wp, 0.1_wp), role_t(has_stop, stop, default='1e-2, 1e-3 ... 1e-12'))
      call walk%item('mode_tolerances', precision%mode_tolerances, 'mode tolerances of exact motion', &
         within(0.0_wp, 0.1_wp), role_t(has_stop, stop, default='none'))
      call walk%item('mesh_elements', precision%mesh_elements, 'meshes of exact motion', &
         within(1, most_elements_dense), role_t(has_stop, stop, default='none'))
      call walk%item('scaling_elements', precision%scaling_elements, 'meshes over which cost and memory grow', &
         elements_range, role_t(has_stop, stop, default='none'))
      call walk%item('scaling_modes', precision%scaling_modes, 'modes for which these are solved', within(1, 100), &
         role_t(has_stop, stop))
      call walk%item('scaling_durations', precision%scaling_durations, 'lengths of runs over which cost grows, tau', &
         duration_range, role_t(has_stop, stop, default='none'))
      call walk%item('skips', precision%skips, 'time what skipping saves, and compare the answers', &
         role_t(has_stop, stop))
      call walk%item('repetitions', precision%repetitions, 'timings of each entry, of which the median counts', &
         within(1, 1000))
      call walk%item('shortest_timing', precision%shortest_timing, 'seconds that a timing lasts at least', &
         within(1.0e-4_wp, 10.0_wp))
   end subroutine walk_precision

   !> &output
   subroutine walk_output(walk, output, has_response, has_frequencies)
      !> What the calls do; the group is open
      type(scene_walk_t), intent(inout) :: walk
      !> What goes into the file
      type(output_settings_t), intent(inout) :: output
      !> The scene asks for a response
      logical, intent(in) :: has_response
      !> The scene asks for frequencies
      logical, intent(in) :: has_frequencies

      integer, allocatable :: histories(:)
      integer :: i

      histories = pack([(i, i=1, history_count)], output%history)
      if (size(histories) == 0) histories = [history_none]
      call walk%choices('histories', histories, 'histories at the sample times', history_names, &
         role_t(has_response, '&response', default='all'))
      if (walk%is_reading() .and. size(histories) > 1 .and. any(histories >= history_all)) then
         call walk%input%complain('output', 'histories', '''all'' and ''none'' stand alone')
      end if
      if (any(histories == history_all)) histories = [(i, i=1, history_count)]
      output%history = [(any(histories == i), i=1, history_count)]
      call walk%item('shape_times', output%shape_times, 'instants at which the shape is stored, tau', &
         within(0.0_wp, 1.0e9_wp), role_t(has_response, '&response', default='none'))
      call walk%item('shape_step', output%shape_step, 'distance of further such instants, from 0 to the end, tau; 0: none', &
         within(0.0_wp, 1.0e9_wp), role_t(has_response, '&response'))
      call walk%item('energy', output%energy, 'the energy ledger', role_t(has_response, '&response'))
      call walk%item('mode_shapes', output%mode_shapes, 'number of mode shapes to store', &
         within(0, 2*most_elements), role_t(has_frequencies, '&frequencies'))
   end subroutine walk_output

end module scene_groups
