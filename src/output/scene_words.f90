!> A scene, the contents of one input file, in words: its beam, mesh, stops, supports and motion.
module scene_words
   use kinds, only: wp
   use load_settings, only: start_release
   use number_text, only: rounded, to_text
   use quantities, only: units_t, words_in, units_in
   use reader_units, only: phrase, value_in_units
   use root_and_mass_settings, only: mass_settings_t, root_pinned, root_settings_t
   use run_settings, only: body_settings_t, impulse_nodal, law_restitution, law_table, &
      method_names, method_newmark, side_above, side_below, side_both, side_names, stop_released_from, stop_settings_t
   use scene_types, only: all_stops, beam_settings_t, scene_t, shape_section, shape_taper, support_displacement, &
      support_settings_t
   use section_shapes, only: is_uniform, profile_names, profile_stepped, shape_names, shape_rectangle
   use table_columns, only: print_line, print_title
   use warning_list, only: warning_names
   implicit none (type, external)
   private
   public :: print_model, print_warnings, law_in_words, mass_in_words, elements_in_words, mesh_in_words, &
      place_in_words, stop_of_release, root_in_words, support_in_words

contains

   !> Print a scene: name, title, beam, mesh, stops, supports, method.
   subroutine print_model(unit, scene, node_position)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      !> Positions x/L of the nodes, [0:n]; absent if no motion is computed
      real(wp), intent(in), optional :: node_position(0:)

      type(units_t) :: units
      integer :: i

      units = units_in(scene)
      call print_title(unit, scene%name, scene%title)
      call print_line(unit, 'beam', beam_in_words(scene, units))
      if (scene%has_root_group) call print_line(unit, 'root', root_in_words(scene%root, units))
      if (allocated(scene%masses)) then
         do i = 1, size(scene%masses)
            call print_line(unit, 'mass '//to_text(i), mass_in_words(scene%masses(i), units))
         end do
      end if
      if (.not. scene%wants_response) then
         call print_warnings(unit, scene)
         return
      end if
      call print_line(unit, 'mesh', mesh_in_words(scene, node_position))
      call print_stops(unit, scene, units, node_position)
      if (allocated(scene%bodies)) then
         do i = 1, size(scene%bodies)
            call print_line(unit, 'body '//to_text(i), body_in_words(scene%bodies(i), units))
            call print_line(unit, '', law_in_words(scene%bodies(i)%contact, units))
            if (ends_of_path(scene%bodies(i)) /= '') call print_line(unit, '', ends_of_path(scene%bodies(i))//': ' &
               //law_in_words(scene%bodies(i)%base_contact, units))
         end do
      end if
      if (allocated(scene%supports)) then
         do i = 1, size(scene%supports)
            call print_line(unit, 'support '//to_text(i), support_in_words(scene%supports(i), units))
         end do
      end if
      call print_line(unit, 'motion', motion_in_words(scene, units))
      call print_warnings(unit, scene)
   end subroutine print_model

   !> Print the warnings about a scene, each with the name that silences it.
   subroutine print_warnings(unit, scene)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene

      integer :: i

      if (.not. allocated(scene%warnings)) return
      do i = 1, size(scene%warnings)
         call print_line(unit, 'warning', trim(scene%warnings(i)%text)//" (silent_warnings = '" &
            //trim(warning_names(scene%warnings(i)%kind))//"')")
      end do
   end subroutine print_warnings

   !> Section, damping and tip mass of the beam. In texts for `phrase` and `words_in`, {a~b} stands for a in
   !> dimensionless results and for b in results with units.
   pure function beam_in_words(scene, units) result(words)
      type(scene_t), intent(in) :: scene
      !> Units of the results
      type(units_t), intent(in) :: units
      character(:), allocatable :: words

      associate (beam => scene%beam)
         if (beam%shape /= shape_taper) then
            words = section_in_words(beam)
         else if (abs(beam%height_root - beam%height_tip) <= 0.0_wp) then
            words = 'uniform'
         else if (beam%height_tip <= 0.0_wp) then
            words = 'full wedge'
         else
            words = 'taper, h1/h0 = '//rounded(beam%height_tip/beam%height_root)
         end if
         if (beam%shape == shape_taper .and. beam%height_root > beam%height_tip) then
            words = words//', alpha = '//rounded((beam%height_root - beam%height_tip)/beam%length)
         end if
      end associate
      if (units%are_physical) words = words//', L = '//value_in_units(units, 'length', 1.0_wp)
      ! the mean height of other sections is that of a rectangle with the same inertia and area, which no reader expects
      if (scene%beam%shape /= shape_section .or. scene%beam%section%shape == shape_rectangle) words = words &
         //phrase(units, ', {hbar/L~hbar} = ', 'length', scene%scales%height_ratio)
      words = words//damping_in_words(scene)
      if (scene%tip_mass_ratio > 0.0_wp .or. .not. units%are_physical) words = words &
         //phrase(units, ', {mu =~tip mass} ', 'mass', scene%tip_mass_ratio)
   end function beam_in_words

   !> Damping ratios of the beam.
   pure function damping_in_words(scene) result(words)
      type(scene_t), intent(in) :: scene
      character(:), allocatable :: words

      integer, parameter :: max_shown = 4
      integer :: i

      words = ''
      if (allocated(scene%mode_ratios)) then
         words = ', modal damping ratios'
         do i = 1, min(size(scene%mode_ratios), max_shown)
            words = words//' '//rounded(scene%mode_ratios(i))
         end do
         if (size(scene%mode_ratios) > max_shown) words = words//' ...'
         return
      end if
      if (scene%zeta > 0.0_wp .or. scene%wants_response) words = ', zeta = '//rounded(scene%zeta)
      if (scene%zeta_mass > 0.0_wp) words = words//', mass-proportional damping ratio '//rounded(scene%zeta_mass)
   end function damping_in_words

   !> Print position and law of each stop, in one line for a single stop below the beam, else in two lines each.
   subroutine print_stops(unit, scene, units, node_position)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      !> Units of the results
      type(units_t), intent(in) :: units
      !> Positions x/L of the nodes, [0:n]
      real(wp), intent(in), optional :: node_position(0:)

      type(stop_settings_t), allocatable :: stops(:)
      character(:), allocatable :: label, words
      integer :: k

      if (.not. scene%has_stop) then
         if (.not. scene%has_bodies) call print_line(unit, 'stop', 'none')
         return
      end if
      allocate (stops, source=all_stops(scene))
      do k = 1, size(stops)
         label = 'stop'
         if (size(stops) > 1) label = label//' '//to_text(k)
         words = place_in_words(stops(k), node_position, units)
         if (size(stops) == 1 .and. stops(k)%side == side_below) then
            call print_line(unit, label, law_in_words(stops(k), units)//', '//words)
            cycle
         end if
         if (scene%start%kind == start_release .and. k == stop_of_release(scene)) words = words//'; released from it'
         if (stops(k)%side == side_below) words = 'below, '//words
         call print_line(unit, label, words)
         call print_line(unit, '', law_in_words(stops(k), units))
      end do
   end subroutine print_stops

   !> The fixed obstacles of a body besides the beam: floor, ceiling, both or none.
   pure function ends_of_path(body) result(words)
      type(body_settings_t), intent(in) :: body
      character(:), allocatable :: words

      words = ''
      if (body%floor >= 0.0_wp) words = 'floor'
      if (body%ceiling >= 0.0_wp) words = 'ceiling'
      if (min(body%floor, body%ceiling) >= 0.0_wp) words = 'floor and ceiling'
   end function ends_of_path

   !> Mass, side, position, spring and damper of a body, its start, and its floor and ceiling.
   pure function body_in_words(body, units) result(words)
      type(body_settings_t), intent(in) :: body
      !> Units of the results
      type(units_t), intent(in) :: units
      character(:), allocatable :: words

      words = value_in_units(units, 'mass', body%mass_ratio)//words_in(units, '{ of the beam~}')
      if (body%side == side_both) then
         words = words//', in a cavity'
      else
         words = words//', '//trim(side_names(body%side))
      end if
      words = words//phrase(units, ' at {x/L~x} = ', 'length', body%position) &
         //phrase(units, ', clearance ', 'displacement', body%clearance)
      if (body%spring_ratio > 0.0_wp) words = words//phrase(units, ', spring ', 'stiffness', body%spring_ratio)
      if (body%damping_ratio > 0.0_wp) words = words//', damping ratio '//rounded(body%damping_ratio)
      if (body%base_damper_ratio > 0.0_wp) words = words//phrase(units, ', damper ', 'damper', body%base_damper_ratio)
      if (abs(body%rest) > 0.0_wp) words = words//phrase(units, ', rest at ', 'displacement', body%rest)
      if (body%start_gap >= 0.0_wp) words = words//phrase(units, ', start gap ', 'displacement', body%start_gap)
      if (abs(body%start_velocity) > 0.0_wp) words = words &
         //phrase(units, ', start velocity ', 'velocity', body%start_velocity)
      if (body%floor >= 0.0_wp) words = words//phrase(units, ', floor at ', 'displacement', 0.0_wp - body%floor)
      if (body%ceiling >= 0.0_wp) words = words//phrase(units, ', ceiling at ', 'displacement', body%ceiling)
   end function body_in_words

   !> Method, time step or distance of the samples, and duration of the run.
   pure function motion_in_words(scene, units) result(words)
      type(scene_t), intent(in) :: scene
      !> Units of the results
      type(units_t), intent(in) :: units
      character(:), allocatable :: words

      associate (response => scene%response)
         words = trim(method_names(response%method))
         if (response%method == method_newmark) words = words//', beta = '//rounded(response%newmark_beta)// &
            ', gamma = '//rounded(response%newmark_gamma)
         if (response%method == method_newmark .and. response%mode_count > 0) then
            words = words//', in '//to_text(response%mode_count)//' modes'
         else if (response%steps_in_modes) then
            words = words//', in modes'
         end if
         ! exact motion has no time step, only a distance of the samples of its histories
         if (response%method == method_newmark) then
            words = words//phrase(units, ', steps of {d tau~dt} = ', 'time', response%step)
         else
            words = words//phrase(units, ', samples every {d tau = ~}', 'time', response%step)
         end if
         words = words//phrase(units, ', to {tau~t} = ', 'time', response%duration)
      end associate
   end function motion_in_words

   !> A section that is given by a table or by a shape of its profile.
   pure function section_in_words(beam) result(words)
      type(beam_settings_t), intent(in) :: beam
      character(:), allocatable :: words

      words = 'section given by a table'
      if (beam%shape /= shape_section) return
      words = trim(shape_names(beam%section%shape))//' section, '
      if (is_uniform(beam%section)) then
         words = words//'uniform'
      else if (beam%section%profile == profile_stepped) then
         words = words//'in steps'
      else
         words = words//trim(profile_names(beam%section%profile))//' between stations'
      end if
   end function section_in_words

   !> Support of the root: clamped, pinned or on springs.
   pure function root_in_words(root, units) result(words)
      type(root_settings_t), intent(in) :: root
      !> Units of the results
      type(units_t), intent(in) :: units
      character(:), allocatable :: words

      words = ''
      if (root%rotation_stiffness_ratio > 0.0_wp) words = phrase(units, &
         ', spring against rotation of ', 'rotational_stiffness', root%rotation_stiffness_ratio)
      if (root%translation_stiffness_ratio > 0.0_wp) words = words//phrase(units, &
         ', spring against displacement of ', 'stiffness', root%translation_stiffness_ratio)
      if (words == '') words = ', clamped'
      if (root%kind == root_pinned) words = ', pinned'
      ! without the leading comma and blank
      words = words(3:)
   end function root_in_words

   !> A concentrated mass on the beam.
   pure function mass_in_words(mass, units) result(words)
      type(mass_settings_t), intent(in) :: mass
      !> Units of the results
      type(units_t), intent(in) :: units
      character(:), allocatable :: words

      words = value_in_units(units, 'mass', mass%mass_ratio)//words_in(units, '{ of the beam~}')
      if (mass%rotary_inertia_ratio > 0.0_wp) words = words//phrase(units, ', J = ', 'rotary_inertia', &
         mass%rotary_inertia_ratio)
      words = words//phrase(units, ', at {x/L~x} = ', 'length', mass%position)
   end function mass_in_words

   !> Mesh of a scene: the number of elements with the ratio of their lengths or, if the program chose the mesh, the
   !> tolerance for which it was chosen.
   pure function mesh_in_words(scene, node_position) result(words)
      type(scene_t), intent(in) :: scene
      !> Positions x/L of the nodes, [0:n]; absent if no motion is computed
      real(wp), intent(in), optional :: node_position(0:)
      character(:), allocatable :: words

      associate (mesh => scene%mesh)
         words = elements_in_words(mesh%elements, merge(0.0_wp, mesh%ratio, allocated(mesh%nodes)))
         if (mesh%tolerance > 0.0_wp .and. present(node_position)) then
            words = to_text(size(node_position) - 1)//' elements, found for a tolerance of '//rounded(mesh%tolerance)
         else if (mesh%found%finer_elements > 0) then
            ! the scene gives no mesh, and the mesh was found from the runs named in `found_for`, for a tolerance of
            ! displacements and of the first impact
            if (abs(mesh%ratio - 1.0_wp) <= 0.0_wp) words = to_text(mesh%elements)//' elements'
            words = trim(words//', found for a tolerance of '//rounded(100.0_wp*mesh%found%tolerance) &
               //' % of displacement and first impact '//mesh%found_for)
         end if
      end associate
   end function mesh_in_words

   !> Number of elements and ratio of their lengths.
   pure function elements_in_words(elements, ratio) result(words)
      integer, intent(in) :: elements
      !> Ratio l_i/l_(i+1) of neighbouring lengths; 0: the nodes are given
      real(wp), intent(in) :: ratio
      character(:), allocatable :: words

      words = to_text(elements)//' elements'
      if (ratio > 0.0_wp) then
         words = words//', l_i/l_(i+1) = '//rounded(ratio)
      else
         words = words//' between nodes that are given'
      end if
   end function elements_in_words

   !> Number of the stop from which the beam is released; 0: there is a single stop.
   pure integer function stop_of_release(scene) result(number)
      type(scene_t), intent(in) :: scene

      number = 0
      if (allocated(scene%more_stops)) number = stop_released_from(all_stops(scene), scene%release_stop)
   end function stop_of_release

   !> The law of a stop with its parameters.
   pure function law_in_words(stop, units) result(words)
      type(stop_settings_t), intent(in) :: stop
      !> Units of the results
      type(units_t), intent(in) :: units
      character(:), allocatable :: words

      words = trim(law_table(stop%law)%words)
      if (stop%law == law_restitution) then
         words = words//' '//rounded(stop%restitution)//' (' &
            //merge('node alone', 'whole beam', stop%impulse == impulse_nodal)//')'
         return
      end if
      words = words//phrase(units, ', {kappa~k} = ', 'stiffness', stop%stiffness_ratio)
      if (law_table(stop%law)%has_branch) words = words//', branch ratio '//rounded(stop%branch_ratio)
      words = words//phrase(units, ', {c*~c} = ', 'damper', stop%damper_ratio)
   end function law_in_words

   !> Position of a stop, and its side unless the stop is below the beam.
   pure function place_in_words(stop, node_position, units) result(words)
      type(stop_settings_t), intent(in) :: stop
      !> Positions x/L of the nodes, [0:n]
      real(wp), intent(in), optional :: node_position(0:)
      !> Units of the results
      type(units_t), intent(in) :: units
      character(:), allocatable :: words

      words = phrase(units, 'at {x/L~x} = ', 'length', stop%position)
      if (present(node_position)) then
         if (stop%position < 1.0_wp .and. minloc(abs(node_position - stop%position), dim=1) == size(node_position)) then
            words = words//' (so near to the tip that it is put there)'
         end if
      end if
      ! A preload is positive if the unstressed beam would overlap the stop, and negative if there is a gap. Results
      ! with units print the height of the stop instead, positive upwards: for a stop above the beam, minus the preload
      if (stop%side == side_both) then
         words = 'on both sides, '//words//phrase(units, ', clearance ', 'displacement', -stop%preload)
      else
         words = words//phrase(units, ', {delta~d} = ', 'displacement', &
            merge(-stop%preload, stop%preload, units%are_physical .and. stop%side == side_above))
      end if
      if (stop%side == side_above) words = 'above, '//words
   end function place_in_words

   !> The motion that a support constrains, its stiffness and its position.
   pure function support_in_words(support, units) result(words)
      type(support_settings_t), intent(in) :: support
      !> Units of the results
      type(units_t), intent(in) :: units
      character(:), allocatable :: words

      if (support%stiffness_ratio <= 0.0_wp) then
         words = 'holds the '//trim(merge('displacement', 'rotation    ', support%motion == support_displacement))
      else if (support%motion == support_displacement) then
         words = phrase(units, 'spring against displacement of ', 'stiffness', support%stiffness_ratio)
      else
         words = phrase(units, 'spring against rotation of ', 'rotational_stiffness', support%stiffness_ratio)
      end if
      words = words//phrase(units, ', at {x/L~x} = ', 'length', support%position)
   end function support_in_words

end module scene_words
