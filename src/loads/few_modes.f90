!> Reduced basis of a large mesh for one run: the lowest modes, and residual modes, which add the static response of
!> all other modes to forces at the stops and to the loads, their response to fast forces at stiff stops, and their part
!> in the start (docs/theory.md, section 13).
!> Mode shapes are also given in the coordinates q of `support_coordinates`, in which the strain energy is q.q/2 and the
!> kinetic energy |B dq/dt|^2/2.
module few_modes
   use applied_loads, only: applied_loads_t, are_mergeable, gather_loads, has_loads, merge_loads
   use beam_model, only: beam_model_t, constrain_supports, is_mechanism
   use beam_starts, only: find_start_momenta
   use compliant_stop, only: compliant_stop_t, dynamic_stiffness
   use failures, only: failure_t
   use free_modes, only: complete_modes, find_free_modes, free_modes_t
   use kinds, only: lambda1, lambda1_power4, wp
   use lanczos_solver, only: lambda_of, lanczos_vectors
   use load_settings, only: is_in_mode, start_drop, start_table, start_velocity
   use mode_shapes, only: fix_mode_signs
   use pinned_coordinates, only: rigid_rotation
   use residual_modes, only: find_residual_modes
   use run_settings, only: impulse_nodal, run_settings_t, stop_settings_t, stops_of
   use skyline_matrix, only: combine, factorise, skyline_t, solve_factorised
   use stop_laws, only: is_rigid, make_compliant_stop
   use support_coordinates, only: bend, bend_transposed, displace, displace_transposed, supported_beam_t, &
      make_supported_beam, &
      coordinates_of_motion
   implicit none (type, external)
   private
   public :: takes_few_modes, needs_all_modes, number_of_modes, begins_with_few_modes, max_iterated, &
      common_count
   public :: find_common_modes, find_modes_of_run, find_few_modes

   !> Up to this number of elements all modes are found in one direct solution, in about 0.05 s.
   integer, parameter :: max_elements_for_all_modes = 100
   !> The same if the number of modes is chosen by trials, which begin with few modes.
   integer, parameter :: max_elements_before_trials = 63
   !> Number of the lowest modes that are found of a larger mesh. If the number of modes can be chosen by trial runs,
   !> runs choose among these modes, else they use all of these.
   integer, parameter :: common_count = 64

contains

   !> Whether the mesh is so large that only a part of its modes is found.
   pure logical function takes_few_modes(elements, settings) result(answer)
      !> Number of elements of the mesh
      integer, intent(in) :: elements
      type(run_settings_t), intent(in) :: settings

      answer = elements > max_elements_for_all_modes .and. .not. needs_all_modes(settings)
   end function takes_few_modes

   !> Whether a run needs all modes, unless the scene gives their number. The replacement of the nodal velocity changes
   !> the velocity of one degree of freedom alone, which is a combination of all modes. An impulse at a rigid stop
   !> causes no moment elsewhere at first, because the moments of all modes cancel; those of a part of them do not. The
   !> same holds for root and supports, which stop a fall or a given velocity at the start, unless this has the shape of
   !> a mode, and for a spring at the root that a table turns.
   pure logical function needs_all_modes(settings) result(answer)
      type(run_settings_t), intent(in) :: settings

      answer = settings%response%keep_all_modes .or. settings%stop%impulse == impulse_nodal
      if (allocated(settings%stress) .and. settings%response%mode_count == 0) then
         answer = answer .or. any(is_rigid(stops_of(settings)))
         answer = answer .or. (any(settings%start%kind == [start_drop, start_table, start_velocity]) &
            .and. .not. is_in_mode(settings%start))
      end if
   end function needs_all_modes

   !> Number of modes of the mesh.
   pure integer function number_of_modes(model) result(number)
      type(beam_model_t), intent(in) :: model

      number = model%stiffness%order - count(model%supports%stiffness <= 0.0_wp) - merge(1, 0, model%has_massless_node)
   end function number_of_modes

   !> Whether trials, by which a run chooses its number of modes, begin with a part of the modes of the mesh.
   pure logical function begins_with_few_modes(elements, settings) result(answer)
      !> Number of elements of the mesh
      integer, intent(in) :: elements
      type(run_settings_t), intent(in) :: settings

      answer = elements > max_elements_before_trials .and. settings%response%mode_count == 0 .and. &
         .not. needs_all_modes(settings)
   end function begins_with_few_modes

   !> Maximum number of the lowest modes that are found by iteration, because all modes are found as fast as more.
   pure integer function max_iterated(elements) result(number)
      !> Number of elements of the mesh
      integer, intent(in) :: elements

      number = elements/2
   end function max_iterated

   !> Common modes, which several runs of a beam can share and choose from: all modes, or the lowest modes of a large
   !> mesh, without residual modes.
   subroutine find_common_modes(model, settings, modes, error)
      type(beam_model_t), intent(in) :: model
      !> Settings of one of the runs
      type(run_settings_t), intent(in) :: settings
      type(free_modes_t), intent(out) :: modes
      !> Set if the modes cannot be found
      type(failure_t), allocatable, intent(out) :: error

      type(run_settings_t) :: unloaded

      unloaded%has_stop = .false.
      if (begins_with_few_modes(model%mesh%elements, settings)) then
         call find_few_modes(model, unloaded, min(common_count, max_iterated(model%mesh%elements)), modes, error)
      else if (takes_few_modes(model%mesh%elements, settings)) then
         call find_few_modes(model, unloaded, common_count, modes, error)
      else
         call find_free_modes(model, modes, error)
      end if
   end subroutine find_common_modes

   !> Modes of a run whose number of modes is not chosen by trials: all modes, or a fixed number of the lowest modes of
   !> a large mesh, followed by residual modes.
   subroutine find_modes_of_run(model, settings, modes, error)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      type(free_modes_t), intent(out) :: modes
      !> Set if the modes cannot be found
      type(failure_t), allocatable, intent(out) :: error

      integer :: count

      if (takes_few_modes(model%mesh%elements, settings)) then
         count = common_count
         if (settings%response%mode_count > 0) count = settings%response%mode_count
         call find_few_modes(model, settings, count, modes, error)
      else
         call find_free_modes(model, modes, error)
      end if
   end subroutine find_modes_of_run

   !> The lowest modes, followed by the residual modes of stops and loads. All modes are found instead if more of the
   !> lowest modes are needed than half the number of elements and `common_modes` does not contain them, or if Lanczos'
   !> method fails and the mesh is small enough.
   subroutine find_few_modes(model, settings, count, modes, error, common_modes)
      type(beam_model_t), intent(in) :: model
      !> Stops and loads
      type(run_settings_t), intent(in) :: settings
      !> Minimum number of the lowest modes; the mode of the start may require more
      integer, intent(in) :: count
      type(free_modes_t), intent(out) :: modes
      !> Set if the modes cannot be found
      type(failure_t), allocatable, intent(out) :: error
      !> Modes from `find_common_modes`, which are reused
      type(free_modes_t), intent(in), optional :: common_modes

      ! maximum number of elements for a solution of all modes, which takes minutes then
      integer, parameter :: max_elements_for_fallback = 2048
      type(supported_beam_t) :: beam
      real(wp), allocatable :: deflection(:, :), residuals(:, :), shapes(:, :), vectors(:, :)
      integer :: lowest
      logical :: is_available

      call make_supported_beam(model, beam)
      lowest = max(count, settings%start%mode)
      is_available = .false.
      if (present(common_modes)) is_available = size(common_modes%lambda) >= lowest
      if (is_available) then
         call take_lowest(model, beam, lowest, common_modes, modes, vectors)
      else
         if (lowest <= max_iterated(model%mesh%elements)) call find_lowest(model, beam, lowest, modes, vectors, error)
         if (.not. allocated(vectors) .or. allocated(error)) then
            if (allocated(error) .and. model%mesh%elements > max_elements_for_fallback) then
               error%message = error%message//'; take fewer elements, a mesh ratio nearer to 1, or fewer modes (modes)'
               return
            end if
            if (allocated(error)) deallocate (error)
            call find_free_modes(model, modes, error)
            return
         end if
      end if
      call gather_shapes(model, settings, beam, shapes, error)
      if (allocated(error)) return
      if (settings%has_stop) call add_dynamic_shapes(model, settings, beam, modes%lambda(size(modes%lambda)), shapes)
      call find_residual_modes(beam, shapes, vectors, residuals, deflection, error)
      if (allocated(error)) return
      call append(model, beam, residuals, deflection, modes)
      call complete_modes(model, modes)
   end subroutine find_few_modes

   !> Take the lowest of the modes already known.
   subroutine take_lowest(model, beam, lowest, common_modes, modes, vectors)
      type(beam_model_t), intent(in) :: model
      type(supported_beam_t), intent(in) :: beam
      !> Number of modes
      integer, intent(in) :: lowest
      type(free_modes_t), intent(in) :: common_modes
      !> Receives lambda and the shapes
      type(free_modes_t), intent(inout) :: modes
      !> Multiples B^T B q of the coordinates q of the modes other than the rigid-body rotation, of which only the
      !> directions are used, [order, modes]
      real(wp), allocatable, intent(out) :: vectors(:, :)

      real(wp) :: deflection(beam%rows)
      integer :: j, rigid_modes

      rigid_modes = merge(1, 0, is_mechanism(model))
      allocate (modes%lambda, source=common_modes%lambda(:lowest))
      allocate (modes%mode, source=common_modes%mode(:, :lowest))
      allocate (vectors(beam%order, lowest - rigid_modes))
      do j = 1, size(vectors, 2)
         ! q from displacements contains strains of high modes by rounding errors. The product with B^T B (`bend`
         ! multiplies by B, `bend_transposed` by B^T) suppresses them, because they have little inertia, and is a
         ! multiple of the exact q
         call bend(beam, coordinates_of_motion(beam, modes%mode(:, rigid_modes + j)), deflection)
         call bend_transposed(beam, deflection, vectors(:, j))
      end do
   end subroutine take_lowest

   !> Find the lowest modes, the first of which is the rigid-body rotation about the root if nothing prevents it.
   subroutine find_lowest(model, beam, lowest, modes, vectors, error)
      type(beam_model_t), intent(in) :: model
      type(supported_beam_t), intent(in) :: beam
      !> Number of modes
      integer, intent(in) :: lowest
      !> Receives lambda and the shapes
      type(free_modes_t), intent(inout) :: modes
      !> Coordinates q of the modes other than the rigid-body rotation, [order, modes]
      real(wp), allocatable, intent(out) :: vectors(:, :)
      !> Set if the modes are not found
      type(failure_t), allocatable, intent(out) :: error

      real(wp), allocatable :: deflection(:, :)
      real(wp) :: direction(beam%rows)
      integer :: rigid_modes

      rigid_modes = merge(1, 0, is_mechanism(model))
      call lanczos_vectors(model, beam, lowest - rigid_modes, vectors, deflection, error)
      if (allocated(error)) return
      allocate (modes%lambda(rigid_modes), source=0.0_wp)
      allocate (modes%mode(beam%dofs, rigid_modes))
      if (rigid_modes > 0) call rigid_rotation(beam%natural, direction, modes%mode(:, 1))
      call append(model, beam, vectors, deflection, modes)
   end subroutine find_lowest

   !> Append modes, given in the coordinates q.
   subroutine append(model, beam, vectors, deflection, modes)
      type(beam_model_t), intent(in) :: model
      type(supported_beam_t), intent(in) :: beam
      !> Coordinates q of the appended modes, of unit modal mass, [order, appended]
      real(wp), intent(in) :: vectors(:, :)
      !> B times these coordinates, [rows, appended]
      real(wp), intent(in) :: deflection(:, :)
      !> Receives lambda and the shapes
      type(free_modes_t), intent(inout) :: modes

      real(wp), allocatable :: shape(:, :)
      integer :: before, j

      before = size(modes%lambda)
      allocate (shape(beam%dofs, before + size(vectors, 2)))
      shape(:, :before) = modes%mode
      do j = 1, size(vectors, 2)
         call displace(beam, vectors(:, j), shape(:, before + j))
      end do
      call fix_mode_signs(model%tip_dof, shape)
      call move_alloc(shape, modes%mode)
      modes%lambda = [modes%lambda, lambda_of(vectors, deflection)]
   end subroutine append

   !> Shapes from which residual modes are made: static shapes of unit forces at the stops and of the loads, for each
   !> rigid stop the velocity field of a unit impulse at the stop, and the initial displacement and velocity, unless
   !> the start is a static shape or a mode.
   subroutine gather_shapes(model, settings, beam, shapes, error)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      type(supported_beam_t), intent(in) :: beam
      !> Shapes in the coordinates q, [order, shapes]
      real(wp), allocatable, intent(out) :: shapes(:, :)
      !> Set if the mass matrix cannot be factorised
      type(failure_t), allocatable, intent(out) :: error

      type(applied_loads_t) :: loads
      type(beam_model_t) :: constrained
      type(skyline_t) :: factors
      ! minimum of twice the strain energy over twice the kinetic energy of a field that is more than a rotation of a
      ! pinned beam and its rounding errors
      real(wp), parameter :: min_strain = 1.0e-12_wp
      real(wp), allocatable :: forces(:, :), momenta(:, :), motion(:)
      ! M y and M y' at the start
      real(wp) :: at_start(beam%dofs, 2)
      logical, allocatable :: has_impulses(:)
      integer :: found, j, stops

      stops = 0
      if (settings%has_stop) stops = size(model%stop_dofs)
      allocate (has_impulses(stops), source=.false.)
      if (stops > 0) has_impulses = is_rigid(stops_of(settings)) .and. .not. model%has_massless_node
      if (has_loads(settings)) then
         call gather_loads(model, settings, loads)
         if (are_mergeable(settings)) call merge_loads(loads)
      end if
      allocate (forces(beam%dofs, stops + loads%count), source=0.0_wp)
      do j = 1, stops
         forces(model%stop_dofs(j), j) = 1.0_wp
      end do
      if (loads%count > 0) forces(:, stops + 1:) = loads%vector(:beam%dofs, :)
      ! a force at a rigid support has no effect on the beam
      forces(beam%supported, :) = 0.0_wp
      call find_start_momenta(model, settings%start, at_start(:, 1), at_start(:, 2))
      at_start(beam%supported, :) = 0.0_wp
      if (model%has_massless_node) at_start = 0.0_wp
      allocate (momenta, source=reshape([forces(:, pack([(j, j=1, stops)], has_impulses)), at_start], &
         [beam%dofs, count(has_impulses) + size(at_start, 2)]))
      allocate (shapes(beam%order, size(forces, 2) + size(momenta, 2)))
      do j = 1, size(forces, 2)
         call displace_transposed(beam, forces(:, j), shapes(:, j))
      end do
      found = size(forces, 2)
      if (any(abs(momenta) > 0.0_wp)) then
         constrained = constrain_supports(model)
         factors = constrained%mass
         call factorise(factors, error)
         if (allocated(error)) return
         do j = 1, size(momenta, 2)
            motion = momenta(:, j)
            call solve_factorised(factors, motion)
            shapes(:, found + 1) = coordinates_of_motion(beam, motion)
            if (sum(shapes(:, found + 1)**2) > min_strain*dot_product(momenta(:, j), motion)) found = found + 1
         end do
      end if
      shapes = shapes(:, :found)
   end subroutine gather_shapes

   !> Add dynamic shapes of stiff compliant stops. A force that grows as exp(sigma tau) at the stop c deflects the beam
   !> in the shape (K + s M)^-1 e_c, s = sigma^2/(1 + 2 zeta sigma). Such shapes represent the response of the truncated
   !> modes to the short force of an impact. Their numbers s are a geometric series, from the retained modes to forces
   !> so fast that the stop is much more flexible than the beam.
   subroutine add_dynamic_shapes(model, settings, beam, lambda, shapes)
      type(beam_model_t), intent(in) :: model
      !> Stops and damping
      type(run_settings_t), intent(in) :: settings
      type(supported_beam_t), intent(in) :: beam
      !> Highest of the retained modes
      real(wp), intent(in) :: lambda
      !> Shapes in the coordinates q, [order, shapes]
      real(wp), allocatable, intent(inout) :: shapes(:, :)

      ! first s over the square of the frequency of the highest retained mode, and ratio of successive s
      real(wp), parameter :: first_ratio = 1.5_wp, series_ratio = 3.0_wp
      ! minimum flexibility of the beam over that of the stop
      real(wp), parameter :: min_flexibility = 0.1_wp
      ! where the beam responds like a point mass, its flexibility decreases as 1/s, and one such shape suffices
      real(wp), parameter :: decrease_of_mass = 0.95_wp*series_ratio
      type(beam_model_t) :: constrained
      type(skyline_t) :: factors
      type(stop_settings_t), allocatable :: stops(:)
      class(compliant_stop_t), allocatable :: stop
      type(failure_t), allocatable :: singular
      real(wp) :: flexibility, motion(beam%dofs), previous, s, sigma
      integer :: j

      if (model%has_massless_node) return
      allocate (stops, source=stops_of(settings))
      constrained = constrain_supports(model)
      do j = 1, size(stops)
         if (is_rigid(stops(j)) .or. stops(j)%is_of_base) cycle
         call make_compliant_stop(stops(j), stop)
         s = first_ratio*(max(lambda, lambda1)/lambda1)**4
         previous = 0.0_wp
         do
            factors = combine(1.0_wp/lambda1_power4, constrained%stiffness, s, constrained%mass)
            call factorise(factors, singular)
            ! rounding errors of a strongly graded mesh can make the matrix singular
            if (allocated(singular)) exit
            motion = 0.0_wp
            motion(model%stop_dofs(j)) = 1.0_wp
            motion(beam%supported) = 0.0_wp
            call solve_factorised(factors, motion)
            flexibility = motion(model%stop_dofs(j))
            sigma = settings%zeta*s + sqrt((settings%zeta*s)**2 + s)
            if (flexibility*real(dynamic_stiffness(stop%dynamic_stiffness_t, cmplx(sigma, kind=wp))) &
               < min_flexibility*(1.0_wp + 2.0_wp*settings%zeta*sigma)) exit
            shapes = reshape([shapes, coordinates_of_motion(beam, motion)], [beam%order, size(shapes, 2) + 1])
            if (previous > decrease_of_mass*flexibility) exit
            previous = flexibility
            s = series_ratio*s
         end do
      end do
   end subroutine add_dynamic_shapes

end module few_modes
