!> Resolution of a scene that has been read: groups are checked against each other, default values that depend on other
!> values are set, and quantities in the user's units are converted to dimensionless values (ratios). A check that fails
!> reports the problem to `input`, and the following steps are skipped.
module scene_resolve
   use kinds, only: lambda1, wp
   use name_table, only: table_t
   use name_types, only: contains_value, length_ratio_problem, max_length_ratio, max_stored_numbers, range_t, range_text
   use number_text, only: rounded, to_text
   use printable_text, only: character_count, excerpt
   use program_identity, only: name_of_program, program_benchmark, program_motion, program_paper
   use quantities, only: system_none
   use run_settings, only: end_of_run, is_within, method_newmark, moves_in_modes, response_settings_t
   use scene_beam, only: mean_section, resolve_beam, decide_mesh, resolve_mesh, resolve_nodes
   use scene_bodies, only: check_bodies
   use scene_groups, only: copy_changes_to_scene
   use scene_inference, only: resolve_inference
   use scene_input, only: scene_input_t
   use scene_loads, only: resolve_loads
   use scene_requests, only: resolve_requests, resolve_statistics
   use scene_root_and_masses, only: check_masses, check_root
   use scene_rules, only: check_rules
   use scene_section, only: resolve_section
   use scene_spectrum, only: instant_in_words
   use scene_start, only: choose_start
   use scene_stops, only: check_stops, check_supports, find_displacement
   use scene_sweep, only: resolve_cases, resolve_sweep
   use scene_types, only: beam_settings_t, integrator_average, integrator_exact, integrator_explicit, &
      integrator_linear, &
      default_mode_count, frequency_settings_t, mesh_settings_t, precision_settings_t, reference_exact, &
      reference_none, scales_t, scene_t, shape_section, shape_taper, solver_auto, solver_dsygv, solver_names, &
      solver_natural
   use scene_warnings, only: warn_of_scene, words_of_frequency
   use section_shapes, only: is_uniform, profile_stepped
   use unit_ratios, only: check_units, entries_in_units, set_ratio
   implicit none (type, external)
   private
   public :: resolve_scene, resolve_units, problem_with_damping

   !> Characters with which the name of a scene may begin.
   character(*), parameter :: letters_and_digits = 'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789'
   !> Characters that the name of a scene may have.
   character(*), parameter :: name_characters = letters_and_digits//'._-'

   !> Maximum length in bytes of the name of a scene file from which results can be named; with the suffixes that are
   !> appended, the name remains below 255 bytes.
   integer, parameter :: max_stem_length = 200

   !> Maximum ratio of the longest to the shortest element for a table of frequencies alone; larger than
   !> `max_length_ratio` for motions, because the eigenvalue solvers use lengths of elements and distances to the tip
   !> instead of positions, which rounding would make equal.
   real(wp), parameter :: max_length_ratio_in_table = 1.0e30_wp
   !> Maximum number of elements for a solver with full matrices (`dsygv` and `natural`).
   integer, parameter :: max_elements_full = 5000
   !> Maximum number of elements for which `natural`, whose run time grows with the third power of this number, is the
   !> default solver; it takes 0.03 s at the maximum. With more elements the default is `auto`.
   integer, parameter :: max_elements_natural = 100
   !> Maximum number of elements if each mode has its own damping ratio and the method is Newmark's, which then requires
   !> all modes and one full matrix for each length of the step: 10 s before the first step and 0.2 GB at this number.
   !> The time grows with the third power of the number of elements.
   integer, parameter :: max_elements_damped = 500

contains

   !> Check and complete a scene. Problems are reported to `input`; the scene is then incomplete.
   subroutine resolve_scene(input, table, program, scene)
      !> The parsed file, which also records problems
      type(scene_input_t), intent(inout) :: input
      !> On entry names with the values of the file; on return with the ratios computed from quantities in units
      type(table_t), intent(inout) :: table
      !> The program that reads the scene, one of the `program_` constants (powers of two), or a sum: any of several
      integer, intent(in) :: program
      !> On entry values as read; on return resolved
      type(scene_t), intent(inout) :: scene

      call check_name(input, scene%name)
      call check_rules(input, table)
      if (input%has_problem()) return
      call check_requests(input, program, scene)
      if (input%has_problem()) return
      if (scene%beam%has_section) call resolve_section(input, scene%beam)
      if (input%has_problem()) return
      call resolve_beam(input, scene%beam)
      if (input%has_problem()) return
      call find_scales(input, scene%beam, scene%scales)
      if (input%has_problem()) return
      if (allocated(scene%mesh%nodes)) call resolve_nodes(input, scene)
      if (input%has_problem()) return
      ! the table of frequencies uses this mesh too; the check comes first so that a problem is reported in &mesh
      call check_length_ratio(input, 'mesh', 'ratio', scene%mesh%elements, scene%mesh%ratio, max_length_ratio)
      if (input%has_problem()) return
      call resolve_mesh(input, scene)
      call check_root(input, scene)
      call check_masses(input, table, scene)
      call choose_start(input, table, scene)
      if (input%has_problem()) return
      call find_displacement(input, table, scene)
      if (input%has_problem()) return
      call resolve_units(input, table, entries_in_units(table), scene)
      if (input%has_problem()) return
      if (scene%has_stop) call check_stops(input, scene)
      call check_bodies(input, table, scene)
      if (scene%has_supports) call check_supports(input, scene)
      if (input%has_problem()) return
      call resolve_loads(input, table, scene)
      call resolve_motion(input, table, scene)
      if (scene%wants_frequencies) call resolve_frequencies(input, scene)
      if (scene%wants_precision .and. scene%has_stop) call resolve_precision(scene%precision)
      if (input%has_problem()) return
      call check_units(input, scene)
      if (input%has_problem()) return
      call resolve_sweep(input, table, scene)
      if (input%has_problem()) return
      call resolve_cases(input, table, scene)
      if (input%has_problem()) return
      call resolve_inference(input, table, scene)
      if (input%has_problem()) return
      call decide_mesh(input, scene)
      call check_output(input, scene)
      if (.not. input%has_problem()) call warn_of_scene(input, scene)
   end subroutine resolve_scene

   !> Convert quantities in units to ratios, and copy all changed values of the table into the scene. If there is a
   !> problem, the scene does not change.
   subroutine resolve_units(input, table, places, scene)
      type(scene_input_t), intent(inout) :: input
      !> On entry names with their values; on return with the ratios
      type(table_t), intent(inout) :: table
      !> Indices of the entries of the table that the file gives in units, ascending
      integer, intent(in) :: places(:)
      !> Scene with known scales
      type(scene_t), intent(inout) :: scene

      integer :: k

      do k = 1, size(places)
         call set_ratio(input, table, places(k), scene%scales)
      end do
      if (.not. input%has_problem()) call copy_changes_to_scene(table, scene)
   end subroutine resolve_units

   !> Check the name of the scene, which is also the name of its results file.
   subroutine check_name(input, name)
      type(scene_input_t), intent(inout) :: input
      character(*), intent(in) :: name

      if (.not. input%has('scene', 'name')) then
         if (.not. can_name_a_file(name)) call input%complain('', '', &
            'the results cannot have the name of the file, '//excerpt(name)//'; that must be 1 to ' &
            //to_text(max_stem_length)//' bytes before the ending, UTF-8 without control characters, beginning with ' &
            //'neither . nor - nor a blank; give &scene name')
      else if (verify(name, name_characters) > 0 .or. verify(name(1:1), letters_and_digits) > 0) then
         call input%complain('scene', 'name', &
            'must be letters, digits, . _ - and begin with a letter or a digit')
      end if
   end subroutine check_name

   !> Check that the scene requests results, and results that this program computes.
   subroutine check_requests(input, program, scene)
      type(scene_input_t), intent(inout) :: input
      !> The program that reads the scene, one of the `program_` constants, or a sum of several: any of them
      integer, intent(in) :: program
      type(scene_t), intent(in) :: scene

      if ((program == program_paper .and. .not. scene%wants_statements) .or. &
         (program == program_benchmark .and. .not. scene%wants_precision)) then
         call input%complain('', '', name_of_program(program_motion)//' runs this scene')
      else if (.not. any([scene%wants_statements, scene%wants_precision, scene%wants_response, &
         scene%wants_frequencies])) then
         call input%complain('', '', 'requests nothing; add &response / or &frequencies /')
      end if
   end subroutine check_requests

   !> Whether the name of a scene file, without extension, can be the name of its results. Names are not altered,
   !> because two different names could become equal.
   pure logical function can_name_a_file(name) result(answer)
      character(*), intent(in) :: name

      answer = len(name) >= 1 .and. len(name) <= max_stem_length
      if (answer) answer = scan(name(1:1), '.- ') == 0 .and. len_trim(name) == len(name) .and. character_count(name) > 0
   end function can_name_a_file

   !> Find the scales: L, omega1, E, E Ibar, mass and hbar / L of the uniform beam of mean section.
   subroutine find_scales(input, beam, scales)
      type(scene_input_t), intent(inout) :: input
      type(beam_settings_t), intent(in) :: beam
      !> All scales except that of displacements
      type(scales_t), intent(inout) :: scales

      type(range_t), parameter :: height_ratio_range = range_t(1.0e-9_wp, 1.0_wp)
      real(wp) :: area, inertia

      call mean_section(beam, area, inertia)
      scales%length = beam%length
      ! the height of a rectangle with this area and second moment of area
      scales%height_ratio = sqrt(12.0_wp*inertia/area)/beam%length
      if (beam%shape == shape_taper) then
         scales%height_ratio = 0.5_wp*(beam%height_root + beam%height_tip)/beam%length
      end if
      scales%youngs_modulus = beam%youngs_modulus
      scales%bending_stiffness = beam%youngs_modulus*inertia
      scales%beam_mass = beam%density*area*beam%length
      scales%omega1 = lambda1**2*sqrt(scales%bending_stiffness/(beam%density*area))/beam%length**2
      if (.not. contains_value(height_ratio_range, scales%height_ratio)) then
         call input%complain(trim(merge('section', 'beam   ', beam%has_section .and. .not. input%has_group('beam'))), &
            'length height_root mean_height_ratio height area inertia', 'mean height over length would be ' &
            //to_text(scales%height_ratio)//': must be '//range_text(height_ratio_range))
      end if
   end subroutine find_scales

   !> Check and complete the settings of the run and the requests for further results.
   subroutine resolve_motion(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> Scene with resolved loads
      type(scene_t), intent(inout) :: scene

      if (scene%wants_response) call check_response(input, scene%response)
      call resolve_requests(input, table, scene)
      if (scene%wants_response .and. .not. input%has_problem()) call check_samples(input, scene)
      if (scene%wants_statistics) call resolve_statistics(input, scene)
      if (problem_with_damping(scene) /= '') call input%complain('damping', 'mode_ratios', problem_with_damping(scene))
   end subroutine resolve_motion

   !> Reason why damping ratios of single modes are not possible with Newmark's method on the mesh of a scene; empty:
   !> they are possible.
   pure function problem_with_damping(scene) result(problem)
      type(scene_t), intent(in) :: scene
      character(:), allocatable :: problem

      integer :: elements

      problem = ''
      elements = scene%mesh%elements
      ! the error estimate also runs on meshes with two and four times as many elements
      if (scene%mesh%estimate) elements = 4*elements
      if (.not. (scene%wants_response .and. allocated(scene%mode_ratios)) .or. elements <= max_elements_damped) return
      if (moves_in_modes(scene%response) .or. scene%mesh%tolerance > 0.0_wp) return
      problem = "with method = 'newmark' damping of single modes needs full matrices, for at most "// &
         to_text(max_elements_damped)//' elements, not for '//to_text(elements)// &
         ": give modes, take method = 'exact', or damping by "//'zeta and zeta_mass, or fewer elements'
   end function problem_with_damping

   !> Check &response.
   subroutine check_response(input, response)
      type(scene_input_t), intent(inout) :: input
      type(response_settings_t), intent(inout) :: response

      if (response%keep_all_modes .and. (input%has('response', 'mode_tolerance') .or. &
         input%has('response', 'accuracy'))) call input%complain('response', 'mode_tolerance accuracy', &
         'does not go with keep_all_modes = .true.')
      if (response%mode_count > 0 .and. (response%keep_all_modes .or. input%has('response', 'mode_tolerance') .or. &
         input%has('response', 'accuracy'))) then
         call input%complain('response', 'modes', 'does not go with accuracy, mode_tolerance or keep_all_modes, ' &
            //'which choose the number')
      end if
      ! the file gives mode_tolerance = 0, which means that no mode is omitted. `list_response` does not copy this 0
      ! into the component, so that it still has its default value `huge`
      if (input%has('response', 'mode_tolerance') .and. .not. response%mode_tolerance < huge(1.0_wp)) then
         response%keep_all_modes = .true.
      end if
      response%steps_in_modes = response%method == method_newmark .and. (response%keep_all_modes .or. &
         input%has('response', 'accuracy') .or. input%has('response', 'mode_tolerance'))
   end subroutine check_response

   !> Check the number of samples of a run with known duration.
   subroutine check_samples(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene

      character(:), allocatable :: names, reason

      associate (response => scene%response, omega1 => scene%scales%omega1)
         if (response%step > response%duration) then
            reason = 'step '//to_text(response%step)//' is longer than duration '//to_text(response%duration)//' (tau)'
            if (input%has('response', 'step_time')) reason = 'is longer than the run, ' &
               //instant_in_words(input, scene, 'response', 'step_time', response%duration)
            names = 'step step_time'
            ! with units and a step by default, the message gives both times in s
            if (scene%unit_system > 0 .and. scene%unit_system /= system_none .and. &
               .not. any([input%has('response', 'step'), input%has('response', 'step_time')])) then
               names = names//' duration_time'
               reason = 'a step of '//rounded(response%step/omega1)//' s is longer than the run of ' &
                  //rounded(response%duration/omega1)//' s: '//words_of_frequency(scene)
            end if
            call input%complain('response', names, reason)
         else if (response%duration/response%step > max_stored_numbers) then
            call input%complain('response', 'step step_time', &
               'duration over step is '//to_text(response%duration/response%step) &
               //' samples: must be at most '//to_text(max_stored_numbers)//' to fit into memory')
         end if
      end associate
   end subroutine check_samples

   !> Check and complete &frequencies.
   subroutine resolve_frequencies(input, scene)
      type(scene_input_t), intent(inout) :: input
      !> On entry beam and mesh are resolved; on return with solvers, meshes and reference
      type(scene_t), intent(inout) :: scene

      logical :: has_exact_values

      associate (frequencies => scene%frequencies)
         if (.not. allocated(frequencies%solver)) then
            allocate (frequencies%solver(1), source=solver_natural)
            if (allocated(frequencies%mesh_elements)) then
               if (maxval(frequencies%mesh_elements) > max_elements_natural) frequencies%solver = solver_auto
            else if (scene%mesh%elements > max_elements_natural) then
               frequencies%solver = solver_auto
            end if
         end if
         call resolve_meshes(input, scene%mesh, frequencies)
         if (input%has_problem()) return
         if (frequencies%count > 2*maxval(frequencies%mesh_elements)) then
            call input%complain('frequencies', 'count', 'the largest mesh has only ' &
               //to_text(2*maxval(frequencies%mesh_elements))//' modes (2 for each element)')
         end if

         has_exact_values = .false.
         if (scene%beam%shape == shape_section) then
            has_exact_values = is_uniform(scene%beam%section) .or. scene%beam%section%profile == profile_stepped
         else if (scene%beam%shape == shape_taper) then
            ! no exact frequencies exist with a mass at the tip of a full wedge, because the flexibility of the tip is
            ! unbounded
            has_exact_values = .not. (scene%has_supports .or. scene%has_root_group .or. scene%has_masses) &
               .and. (scene%beam%height_tip > 0.0_wp .or. scene%tip_mass_ratio <= 0.0_wp)
            has_exact_values = has_exact_values .or. abs(scene%beam%height_root - scene%beam%height_tip) <= 0.0_wp
         end if
         if (has_exact_values) return
         if (.not. input%has('frequencies', 'reference')) then
            frequencies%reference = reference_none
         else if (frequencies%reference == reference_exact) then
            call input%complain('frequencies', 'reference', 'exact values are known only for beams that are uniform ' &
               //"or stepped, and for linear tapers with no more than a tip mass, a full wedge without; give 'none'")
         end if
      end associate
   end subroutine resolve_frequencies

   !> Set the lists of &precision that the file does not give: integration methods, Newmark's steps and the values of
   !> `hop_tolerance` that are compared.
   pure subroutine resolve_precision(precision)
      !> On entry as read; on return resolved
      type(precision_settings_t), intent(inout) :: precision

      integer :: i

      if (.not. allocated(precision%methods)) then
         allocate (precision%methods, source=[integrator_exact, integrator_average, integrator_linear, &
            integrator_explicit])
      end if
      if (.not. allocated(precision%steps)) allocate (precision%steps, source=[(scale(0.04_wp, -i), i=0, 7)])
      if (.not. allocated(precision%hop_tolerances)) then
         allocate (precision%hop_tolerances, source=[(10.0_wp**(-i), i=2, 12)])
      end if
   end subroutine resolve_precision

   !> Complete the meshes of the frequency table: a list with one value is extended to the length of the other list.
   subroutine resolve_meshes(input, mesh, frequencies)
      type(scene_input_t), intent(inout) :: input
      !> &mesh, used if the table gives no mesh
      type(mesh_settings_t), intent(in) :: mesh
      !> On entry numbers of elements and ratios of neighbouring lengths as read; on return equally many of both
      type(frequency_settings_t), intent(inout) :: frequencies

      integer :: meshes, i, max_elements

      frequencies%has_mesh_of_response = .not. (allocated(frequencies%mesh_elements) .or. &
         allocated(frequencies%mesh_ratios))
      if (.not. allocated(frequencies%mesh_elements)) allocate (frequencies%mesh_elements(1), source=mesh%elements)
      if (.not. allocated(frequencies%mesh_ratios)) allocate (frequencies%mesh_ratios(1), source=mesh%ratio)
      associate (elements => frequencies%mesh_elements, ratios => frequencies%mesh_ratios)
         meshes = max(size(elements), size(ratios))
         if (min(size(elements), size(ratios)) < meshes .and. min(size(elements), size(ratios)) > 1) then
            call input%complain('frequencies', 'mesh_ratios', 'needs one value or as many as mesh_elements, ' &
               //to_text(size(elements))//'; '//to_text(size(ratios))//' given')
            return
         end if
      end associate
      if (size(frequencies%mesh_elements) < meshes) then
         frequencies%mesh_elements = spread(frequencies%mesh_elements(1), 1, meshes)
      else if (size(frequencies%mesh_ratios) < meshes) then
         frequencies%mesh_ratios = spread(frequencies%mesh_ratios(1), 1, meshes)
      end if

      do i = 1, meshes
         call check_length_ratio(input, 'frequencies', 'mesh_ratios', frequencies%mesh_elements(i), &
            frequencies%mesh_ratios(i), max_length_ratio_in_table)
         if (input%has_problem()) return
      end do
      max_elements = maxval(frequencies%mesh_elements)
      if (max_elements <= max_elements_full) return
      do i = 1, size(frequencies%solver)
         if (all(frequencies%solver(i) /= [solver_dsygv, solver_natural])) cycle
         call input%complain('frequencies', 'solver', trim(solver_names(frequencies%solver(i))) &
            //' takes at most '//to_text(max_elements_full)//' elements, a mesh has '//to_text(max_elements) &
            //"; use 'lanczos' or 'auto'")
         return
      end do
   end subroutine resolve_meshes

   !> Check the ratio of the longest to the shortest element, r^(n - 1) for n elements with the ratio r of neighbouring
   !> lengths.
   subroutine check_length_ratio(input, group, name, elements, ratio, limit)
      type(scene_input_t), intent(inout) :: input
      !> Group of the ratio, for messages
      character(*), intent(in) :: group
      !> Name of the ratio, for messages
      character(*), intent(in) :: name
      !> Number of elements
      integer, intent(in) :: elements
      !> Ratio of neighbouring lengths
      real(wp), intent(in) :: ratio
      !> Maximum ratio of the longest to the shortest element
      real(wp), intent(in) :: limit

      real(wp) :: decades

      decades = real(elements - 1, wp)*abs(log10(ratio))
      if (decades > log10(limit)) call input%complain(group, name, 'with '//to_text(elements)//' elements and ratio ' &
         //to_text(ratio)//' '//length_ratio_problem(decades, limit)//'; this ratio goes with at most ' &
         //to_text(1 + int(log10(limit)/abs(log10(ratio))))//' elements')
   end subroutine check_length_ratio

   !> Check &output against the other settings.
   subroutine check_output(input, scene)
      type(scene_input_t), intent(inout) :: input
      !> Resolved scene
      type(scene_t), intent(in) :: scene

      integer :: modes, i
      ! number of displacements in all shapes
      real(wp) :: numbers

      if (allocated(scene%output%shape_times)) then
         associate (instants => scene%output%shape_times)
            numbers = real(size(instants), wp)*real(scene%mesh%elements + 1, wp)
            if (.not. is_within(maxval(instants), end_of_run(scene%response))) then
               call input%complain('output', 'shape_times', 'must be at most the end of the run, ' &
                  //to_text(end_of_run(scene%response))//' (tau)')
            else if (any([(instants(i) >= instants(i + 1), i=1, size(instants) - 1)])) then
               call input%complain('output', 'shape_times', 'must be ascending')
            else if (numbers > max_stored_numbers) then
               call input%complain('output', 'shape_times', to_text(size(instants))//' shapes of ' &
                  //to_text(scene%mesh%elements + 1)//' nodes: the product must be at most ' &
                  //to_text(max_stored_numbers))
            end if
         end associate
      end if
      if (scene%output%shape_step > 0.0_wp) then
         numbers = scene%response%duration/scene%output%shape_step*real(scene%mesh%elements + 1, wp)
         if (numbers > max_stored_numbers) call input%complain('output', 'shape_step', to_text(numbers) &
            //' numbers would be stored: must be at most '//to_text(max_stored_numbers))
      end if
      if (.not. scene%wants_frequencies) return
      modes = 2*scene%frequencies%mesh_elements(1)
      if (scene%frequencies%count > 0) modes = min(modes, scene%frequencies%count)
      if (scene%frequencies%count == 0) modes = min(modes, default_mode_count)
      if (scene%output%mode_shapes > modes) then
         call input%complain('output', 'mode_shapes', 'must be at most the number of modes of the first mesh, ' &
            //to_text(modes))
      end if
   end subroutine check_output

end module scene_resolve
