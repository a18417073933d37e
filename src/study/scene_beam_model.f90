!> Conversion of a resolved scene to the assembled beam (section, mesh, matrices) and to the settings of its run.
module scene_beam_model
   use beam_mesh, only: make_mesh, mesh_t
   use beam_model, only: beam_model_t, beam_root_t, beam_support_t, make_beam_model, point_mass_t
   use beam_section, only: height_table_section, section_t, section_table_section, shaped_section, tapered_section
   use failures, only: fail, failure_t, status_bad_input
   use history_list, only: acceleration_stop, eta_stop, force_stop, velocity_stop
   use kinds, only: lambda1_power4, wp
   use load_settings, only: period_of, varies_to, course_step, start_drop, start_settings_t
   use mass_choice, only: is_redistribution_more_accurate
   use mode_trials, only: is_driven
   use number_text, only: to_text
   use root_and_mass_settings, only: root_pinned
   use run_settings, only: body_settings_t, end_of_run, extra_dof_t, run_settings_t, side_above, side_below, &
      side_both, stop_released_from, stop_settings_t
   use scene_requests, only: harmonic_frequencies, has_gravity_alone, set_period
   use scene_types, only: all_stops, beam_settings_t, mass_auto, mass_redistributed, scene_t, shape_height_table, &
      shape_section, shape_section_table, support_displacement, support_rotation
   use section_shapes, only: is_uniform, profile_stepped
   use stop_pairs, only: conflict_of_supports, conflict_with_support
   implicit none (type, external)
   private
   public :: load_period_of, varies_at_end, section_of, model_of, redistributes, run_settings_of

   !> Stiffness of a spring with stiffness ratio 1, for E Ibar = L = 1
   real(wp), parameter :: spring_unit = 3.0_wp

contains

   !> The section of the beam of a scene.
   pure type(section_t) function section_of(settings) result(section)
      type(beam_settings_t), intent(in) :: settings

      select case (settings%shape)
      case (shape_section)
         section = shaped_section(settings%section, settings%length)
      case (shape_height_table)
         section = height_table_section(settings%station/settings%length, settings%height)
      case (shape_section_table)
         section = section_table_section(settings%station/settings%length, settings%area, settings%inertia)
      case default
         section = tapered_section(settings%height_root, settings%height_tip)
      end select
   end function section_of

   !> Period of the loads of a run that is driven throughout, tau: the common period of its harmonic loads, or that of
   !> the slowest load if the loads have no common period. 0: the run is not driven.
   pure real(wp) function load_period_of(scene) result(period)
      type(scene_t), intent(in) :: scene

      real(wp), allocatable :: frequencies(:)

      period = 0.0_wp
      if (.not. is_driven(run_settings_of(scene))) return
      frequencies = harmonic_frequencies(scene)
      period = period_of(frequencies, 0)
      if (period <= 0.0_wp) period = period_of(frequencies, minloc(frequencies, dim=1))
   end function load_period_of

   !> Whether a load or a motion of the base still varies at the end of the run, so that the motion does not settle.
   pure logical function varies_at_end(scene) result(answer)
      type(scene_t), intent(in) :: scene

      integer :: k

      answer = .false.
      if (scene%has_forces) answer = any([(varies_to(scene%forces(k)%course, end_of_run(scene%response)), &
         k=1, size(scene%forces))])
      if (scene%has_bases) answer = answer .or. any([(varies_to(scene%bases(k)%course, end_of_run(scene%response)) &
         .and. abs(scene%bases(k)%course%amplitude) > 0.0_wp, k=1, size(scene%bases))])
   end function varies_at_end

   !> Assemble the beam of a scene on a mesh.
   pure subroutine model_of(scene, elements, ratio, model, error, moves)
      type(scene_t), intent(in) :: scene
      !> Number of elements of the mesh
      integer, intent(in) :: elements
      !> Length of an element over that of the next towards the tip
      real(wp), intent(in) :: ratio
      type(beam_model_t), intent(out) :: model
      !> Set if the mesh cannot be made
      type(failure_t), allocatable, intent(out) :: error
      !> Whether the beam has the mass matrix that the scene chooses for runs in time; else the matrix is consistent
      logical, intent(in) :: moves

      type(mesh_t) :: mesh
      logical :: is_redistributed

      call mesh_of(scene, elements, ratio, mesh, error)
      if (allocated(error)) return
      is_redistributed = .false.
      if (moves) is_redistributed = redistributes(scene, mesh)
      call make_beam_model(section_of(scene%beam), mesh, scene%tip_mass_ratio, model, is_redistributed, &
         supports_of(scene, mesh), root_of(scene), masses_of(scene, mesh))
   end subroutine model_of

   !> Whether the mass of the node at the stop is redistributed to its neighbours in the runs of a scene.
   pure logical function redistributes(scene, mesh) result(answer)
      type(scene_t), intent(in) :: scene
      type(mesh_t), intent(in) :: mesh

      type(point_mass_t), allocatable :: masses(:)
      real(wp) :: tip_mass

      answer = scene%mesh%mass == mass_redistributed
      if (scene%mesh%mass /= mass_auto) return
      tip_mass = scene%tip_mass_ratio
      allocate (masses, source=masses_of(scene, mesh))
      tip_mass = tip_mass + sum(masses%mass, mask=masses%node == mesh%elements)
      answer = is_redistribution_more_accurate(section_of(scene%beam), mesh, tip_mass, run_settings_of(scene))
      ! with supports, only the node at the tip can be redistributed, and only if it has a point mass
      if (scene%has_supports) answer = answer .and. mesh%redistributed_node == mesh%elements .and. tip_mass > 0.0_wp
   end function redistributes

   !> Make a mesh with nodes at the stops, supports, masses and steps of the section; `further_nodes` has them in this
   !> order.
   pure subroutine mesh_of(scene, elements, ratio, mesh, error)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: elements
      !> Length of an element over that of the next towards the tip
      real(wp), intent(in) :: ratio
      type(mesh_t), intent(out) :: mesh
      !> Set if the mesh cannot be made
      type(failure_t), allocatable, intent(out) :: error

      real(wp), allocatable :: nodes(:), positions(:), steps(:)
      type(stop_settings_t), allocatable :: all_stops(:)
      real(wp) :: stop_position
      integer :: stops

      allocate (all_stops, source=stops_of_scene(scene))
      stop_position = scene%stop%position
      if (size(all_stops) > 0) stop_position = all_stops(1)%position
      ! if `nodes` is not allocated, the argument counts as absent
      if (allocated(scene%mesh%nodes)) nodes = scene%mesh%nodes/scene%beam%length

      associate (section => scene%beam%section)
         allocate (steps(0))
         if (scene%beam%shape == shape_section .and. section%profile == profile_stepped) then
            if (.not. is_uniform(section)) steps = section%station(2:)/scene%beam%length
         end if
      end associate
      if (.not. (size(all_stops) > 1 .or. allocated(scene%supports) .or. allocated(scene%masses) &
         .or. size(steps) > 0)) then
         call make_mesh(elements, ratio, stop_position, mesh, error, nodes=nodes)
         return
      end if
      allocate (positions(0))
      if (size(all_stops) > 1) positions = all_stops(2:)%position
      stops = size(positions)
      if (allocated(scene%supports)) positions = [positions, scene%supports%position]
      if (allocated(scene%masses)) positions = [positions, scene%masses%position]
      positions = [positions, steps]
      call make_mesh(elements, ratio, stop_position, mesh, error, positions, stops, nodes)
      if (.not. allocated(error) .and. allocated(scene%supports)) call check_supports(scene, mesh, error)
   end subroutine mesh_of

   !> Check that supports are compatible with each other and with stops if the mesh has moved them to the node at the
   !> tip.
   pure subroutine check_supports(scene, mesh, error)
      type(scene_t), intent(in) :: scene
      type(mesh_t), intent(in) :: mesh
      !> Set if two supports, or a support and a stop, are not compatible
      type(failure_t), allocatable, intent(inout) :: error

      character(:), allocatable :: conflict
      integer :: i, k, supports_offset

      ! stops come before supports in `further_nodes`
      supports_offset = mesh%further_stops
      do k = 1, size(scene%supports)
         conflict = ''
         associate (node => mesh%further_nodes(supports_offset + k), support => scene%supports(k))
            if (scene%has_contacts() .and. (mesh%stop_node == node .or. &
               any(mesh%further_nodes(:supports_offset) == node))) then
               conflict = conflict_with_support(support)
            end if
            do i = 1, k - 1
               if (mesh%further_nodes(supports_offset + i) == node .and. conflict == '') then
                  conflict = conflict_of_supports(scene%supports(i), support)
               end if
            end do
            if (conflict == '') cycle
            call fail(error, status_bad_input, 'the support at '//to_text(support%position)//': '//conflict)
            return
         end associate
      end do
   end subroutine check_supports

   !> The supports of a scene as constraints or springs of degrees of freedom: node k has the displacement 2 k - 1 and
   !> the rotation 2 k.
   pure function supports_of(scene, mesh) result(supports)
      type(scene_t), intent(in) :: scene
      type(mesh_t), intent(in) :: mesh
      type(beam_support_t), allocatable :: supports(:)

      integer :: k, number

      number = 0
      if (allocated(scene%supports)) number = size(scene%supports)
      allocate (supports(number))
      do k = 1, number
         supports(k)%dof = 2*mesh%further_nodes(mesh%further_stops + k)
         if (scene%supports(k)%motion == support_displacement) supports(k)%dof = supports(k)%dof - 1
         supports(k)%stiffness = spring_unit*scene%supports(k)%stiffness_ratio
      end do
   end function supports_of

   !> The boundary conditions at the root (the end x = 0).
   pure type(beam_root_t) function root_of(scene) result(root)
      type(scene_t), intent(in) :: scene

      root%is_pinned = scene%root%kind == root_pinned
      if (root%is_pinned) return
      root%rotation_stiffness = spring_unit*scene%root%rotation_stiffness_ratio
      root%translation_stiffness = spring_unit*scene%root%translation_stiffness_ratio
   end function root_of

   !> The point masses of a scene at the nodes of its mesh.
   pure function masses_of(scene, mesh) result(masses)
      type(scene_t), intent(in) :: scene
      type(mesh_t), intent(in) :: mesh
      type(point_mass_t), allocatable :: masses(:)

      integer :: k, masses_offset

      allocate (masses(0))
      if (.not. allocated(scene%masses)) return
      masses_offset = mesh%further_stops
      if (allocated(scene%supports)) masses_offset = masses_offset + size(scene%supports)
      masses = [(point_mass_t(node=mesh%further_nodes(masses_offset + k), mass=scene%masses(k)%mass_ratio, &
         rotary_inertia=scene%masses(k)%rotary_inertia_ratio), k=1, size(scene%masses))]
   end function masses_of

   !> The settings of the run of a scene; the contacts of its bodies are among the stops.
   pure type(run_settings_t) function run_settings_of(scene) result(settings)
      type(scene_t), intent(in) :: scene

      type(stop_settings_t), allocatable :: stops(:)
      integer :: k

      settings%zeta = scene%zeta
      settings%zeta_mass = scene%zeta_mass
      if (allocated(scene%mode_ratios)) settings%mode_ratios = scene%mode_ratios
      call set_loads(scene, settings)
      allocate (stops, source=stops_of_scene(scene))
      settings%has_stop = size(stops) > 0
      settings%stop = scene%stop
      if (size(stops) > 0) settings%stop = stops(1)
      if (size(stops) > 1) settings%more_stops = stops(2:)
      if (allocated(scene%bodies)) then
         settings%extra_dofs = [(extra_dof_of(k, scene%bodies(k), settings%start), k=1, size(scene%bodies))]
         associate (extra => settings%extra_dofs)
            ! if all bodies have the proportional damping of the beam, it does not couple constrained modes
            if (.not. (allocated(settings%mode_ratios) .or. any(abs(extra%rate - 2.0_wp*(settings%zeta*extra%square &
               + settings%zeta_mass)) > 0.0_wp))) extra%rate = -1.0_wp
         end associate
      end if
      ! the number of the stop from which the beam is released is 1 by default
      if (allocated(scene%more_stops)) settings%release_stop = stop_released_from([scene%stop, scene%more_stops], &
         scene%release_stop)
      settings%response = scene%response
      if (scene%wants_statistics) settings%statistics = scene%statistics
      if (scene%wants_relay) settings%relay = scene%relay
      if (scene%wants_poincare) then
         settings%poincare = scene%poincare
         call set_period(scene, settings%poincare, settings%response)
      end if
      if (scene%wants_spectrum) settings%spectrum = scene%spectrum
      settings%output = scene%output
      ! a beam without stops has only histories of the tip
      if (.not. settings%has_stop) settings%output%history([eta_stop, velocity_stop, force_stop, &
         acceleration_stop]) = .false.
      settings%height_ratio = scene%scales%height_ratio
      if (.not. scene%wants_stress) return
      settings%stress = scene%stress
      settings%stress%position = [settings%stress%position, places_beyond_jumps(scene)]
   end function run_settings_of

   !> Places x/L just beyond those of &stress at which the moment jumps: at masses with rotary inertia, and at supports
   !> that resist rotation. At the place itself the moment is that on the side of the root.
   pure function places_beyond_jumps(scene) result(places)
      !> Scene with &stress
      type(scene_t), intent(in) :: scene
      real(wp), allocatable :: places(:)

      ! distance from the jump in L: more than the rounding errors of the nodes
      real(wp), parameter :: beyond = 1.0e-9_wp
      real(wp), allocatable :: jumps(:)
      integer :: p

      allocate (jumps(0))
      if (allocated(scene%masses)) jumps = pack(scene%masses%position, scene%masses%rotary_inertia_ratio > 0.0_wp)
      if (allocated(scene%supports)) jumps = [jumps, pack(scene%supports%position, &
         scene%supports%motion == support_rotation)]
      associate (at => scene%stress%position)
         places = beyond + pack(at, [(any(abs(jumps - at(p)) < 0.5_wp*beyond) .and. at(p) + beyond < 1.0_wp, &
            p=1, size(at))])
      end associate
   end function places_beyond_jumps

   !> All stops of a scene, and after them the contacts of each body with the beam from below and from above, with its
   !> floor and with its ceiling. Runs count the coordinate of a body from its origin. With the body at its origin, a
   !> contact has the gap that the scene gives for z = 0, less the origin if the body approaches its partner upwards
   !> (beam above it, ceiling), plus the origin otherwise.
   pure function stops_of_scene(scene) result(stops)
      type(scene_t), intent(in) :: scene
      type(stop_settings_t), allocatable :: stops(:)

      real(wp) :: origin
      integer :: b

      allocate (stops, source=all_stops(scene))
      if (.not. allocated(scene%bodies)) return
      do b = 1, size(scene%bodies)
         origin = origin_of(scene%bodies(b))
         associate (body => scene%bodies(b))
            if (body%side /= side_above) stops = [stops, contact_of_body(b, side_below, body, &
               origin - body%clearance, .false.)]
            if (body%side /= side_below) stops = [stops, contact_of_body(b, side_above, body, &
               -origin - body%clearance, .false.)]
            if (body%floor >= 0.0_wp) stops = [stops, contact_of_body(b, side_below, body, -origin - body%floor, &
               .true.)]
            if (body%ceiling >= 0.0_wp) stops = [stops, contact_of_body(b, side_above, body, &
               origin - body%ceiling, .true.)]
         end associate
      end do
   end function stops_of_scene

   !> Displacement z from which runs count the coordinate of a body: with a spring, the position in which it has no
   !> force. Without a spring, of the position `rest` and the positions in which the body meets the undeformed beam, its
   !> floor and its ceiling, the position nearest to the start: a gap is the difference of the coordinate and the height
   !> of a surface, and the rounding error of large coordinates would change the energy at each impact.
   elemental real(wp) function origin_of(body) result(origin)
      type(body_settings_t), intent(in) :: body

      ! displacements z at the start and in contact with the beam (in a cavity with its lower wall)
      real(wp) :: start, wall
      ! 1 for a body below the beam, else -1
      real(wp) :: side

      origin = body%rest
      if (body%spring_ratio > 0.0_wp .or. body%start_gap < 0.0_wp) return
      side = merge(1.0_wp, -1.0_wp, body%side == side_below)
      wall = side*body%clearance
      start = wall - side*body%start_gap
      if (abs(start - wall) < abs(start - origin)) origin = wall
      if (body%floor >= 0.0_wp .and. abs(start + body%floor) < abs(start - origin)) origin = -body%floor
      if (body%ceiling >= 0.0_wp .and. abs(start - body%ceiling) < abs(start - origin)) origin = body%ceiling
   end function origin_of

   !> A body as a degree of freedom besides those of the beam. At the start a body is at its given distance from the
   !> beam, or, without a given distance, where its spring has no force; without a spring it is in the middle of its
   !> cavity.
   pure type(extra_dof_t) function extra_dof_of(number, body, start) result(extra)
      !> Number of the body
      integer, intent(in) :: number
      type(body_settings_t), intent(in) :: body
      !> Start of the beam
      type(start_settings_t), intent(in) :: start

      ! 1 for a body below the beam, else -1
      real(wp) :: side

      extra%name = '&body number '//to_text(number)
      extra%position = body%position
      extra%mass = body%mass_ratio
      ! a sweep over the mass may leave it open
      if (extra%mass > 0.0_wp) then
         ! the units are 3 E Ibar/L^3, rho Abar L and omega1^2 = lambda1^4 E Ibar/(rho Abar L^4)
         extra%square = 3.0_wp*body%spring_ratio/(lambda1_power4*body%mass_ratio)
         extra%rate = 2.0_wp*body%damping_ratio*sqrt(extra%square) + 3.0_wp*body%base_damper_ratio &
            /(lambda1_power4*body%mass_ratio)
      end if
      extra%origin = origin_of(body)
      extra%rest = body%rest
      extra%starts_from_beam = body%start_gap >= 0.0_wp .or. (body%side == side_both .and. body%spring_ratio <= 0.0_wp)
      if (body%start_gap >= 0.0_wp) then
         side = merge(1.0_wp, -1.0_wp, body%side == side_below)
         ! if the origin is the contact with the beam, the difference in brackets is exactly 0
         extra%start_displacement = (side*body%clearance - extra%origin) - side*body%start_gap
      end if
      extra%start_velocity = body%start_velocity
      if (start%kind == start_drop) extra%start_velocity = extra%start_velocity - start%velocity
   end function extra_dof_of

   !> A contact of a body as a stop.
   pure type(stop_settings_t) function contact_of_body(number, side, body, height, is_of_base) result(stop)
      !> Number of the body
      integer, intent(in) :: number
      !> One of the `side_` constants
      integer, intent(in) :: side
      type(body_settings_t), intent(in) :: body
      !> Preload of the contact: minus the gap at zero displacement of beam and body, in D
      real(wp), intent(in) :: height
      !> Whether the contact is that with floor or ceiling
      logical, intent(in) :: is_of_base

      stop = body%contact
      if (is_of_base) stop = body%base_contact
      stop%position = body%position
      stop%side = side
      stop%preload = height
      stop%partner = number
      stop%is_of_base = is_of_base
      associate (direction => merge(1.0_wp, -1.0_wp, (side == side_below) .eqv. is_of_base))
         stop%shift_to_zero = direction*origin_of(body)
         stop%shift_to_rest = direction*(origin_of(body) - body%rest)
      end associate
   end function contact_of_body

   !> Set the loads on the beam and the initial conditions.
   pure subroutine set_loads(scene, settings)
      type(scene_t), intent(in) :: scene
      type(run_settings_t), intent(inout) :: settings

      ! sum of the gravity ratios of all &base groups, a constant acceleration
      real(wp) :: gravity
      ! number of &base groups with a motion, not only with gravity
      integer :: moving_bases
      integer :: k

      if (allocated(scene%forces)) settings%forces = scene%forces
      gravity = 0.0_wp
      if (allocated(scene%bases)) then
         gravity = sum(scene%bases%gravity_ratio)
         moving_bases = count(.not. has_gravity_alone(scene%bases))
         allocate (settings%bases(moving_bases + merge(1, 0, gravity > 0.0_wp)))
         moving_bases = 0
         do k = 1, size(scene%bases)
            if (has_gravity_alone(scene%bases(k))) cycle
            moving_bases = moving_bases + 1
            settings%bases(moving_bases) = scene%bases(k)%base_settings_t
         end do
         if (gravity > 0.0_wp) then
            ! gravity downwards is equivalent to an acceleration of the base upwards
            settings%bases(moving_bases + 1)%course%kind = course_step
            settings%bases(moving_bases + 1)%course%amplitude = gravity
         end if
      end if
      settings%start = scene%start%start_settings_t
      ! a fall over a height, instead of a given velocity: v = sqrt(2 g h), with all values dimensionless
      if (scene%start%kind /= start_drop .or. scene%start%height_ratio <= 0.0_wp) return
      settings%start%velocity = sqrt(2.0_wp*gravity*scene%start%height_ratio)
   end subroutine set_loads

end module scene_beam_model
