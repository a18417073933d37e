!> The assembled beam: stiffness and mass matrices in skyline storage, with point masses, clamped, pinned or on springs
!> at x = 0, in units where E Ibar = rho Abar = L = 1. The eigenvalues are lambda^4.
!>
!> The model of a run is that of its beam and, after the degrees of freedom of the beam, the extra degrees of freedom of
!> the run, such as those of bodies, with entries on the diagonals of K and M alone. Contacts, whose rows have entries
!> for these degrees of freedom, couple them to the beam.
module beam_model
   use beam_element, only: element_mass, element_stiffness
   use beam_mesh, only: mesh_t
   use beam_section, only: section_t
   use failures, only: failure_t
   use kinds, only: wp, lambda1_power4
   use redistributed_mass, only: continuation_at_stop, continuation_t, redistribute
   use run_settings, only: extra_dof_t, run_settings_t, stop_settings_t, stops_of
   use skyline_matrix, only: add_element, add_to_diagonal, factorise, make_skyline, skyline_t, solve_factorised
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: beam_model_t, beam_support_t, beam_root_t, point_mass_t, recorded_point_t, make_beam_model, element_dofs, &
      is_mechanism, moves_freely, node_dofs, constrain_supports, static_shape, complete_model, &
      beam_alone

   !> A support along the beam, a bilateral constraint or a spring on one degree of freedom.
   type :: beam_support_t
      !> Degree of freedom of the support, a displacement or a slope
      integer :: dof = 0
      !> Stiffness of the spring, E Ibar = L = 1; 0: the support is rigid
      real(wp) :: stiffness = 0.0_wp
   end type beam_support_t

   !> The support of the beam at x = 0; by default a clamp.
   type :: beam_root_t
      !> Stiffness of a spring against displacement, with E Ibar = L = 1; 0: the displacement is constrained
      real(wp) :: translation_stiffness = 0.0_wp
      !> Stiffness of a spring against rotation, with E Ibar = L = 1; 0: the rotation is constrained
      real(wp) :: rotation_stiffness = 0.0_wp
      !> Whether the root rotates freely
      logical :: is_pinned = .false.
   end type beam_root_t

   !> A concentrated mass at a node besides the tip mass.
   type :: point_mass_t
      integer :: node = 0
      !> In rho Abar L
      real(wp) :: mass = 0.0_wp
      !> Moment of inertia about the node, in rho Abar L^3
      real(wp) :: rotary_inertia = 0.0_wp
   end type point_mass_t

   !> A degree of freedom whose motion is recorded besides that of the beam.
   type :: recorded_point_t
      integer :: dof = 0
      !> Position x/L
      real(wp) :: position = 0.0_wp
      !> Displacement at which the degree of freedom is zero
      real(wp) :: origin = 0.0_wp
      !> Displacement at which a spring to the base has no force
      real(wp) :: rest = 0.0_wp
   end type recorded_point_t

   !> The assembled beam. The degrees of freedom 2 i - 1 and 2 i are y and dy/dx of node i = 1 ... n. Free degrees of
   !> freedom of the root come last.
   type :: beam_model_t
      type(section_t) :: section
      type(mesh_t) :: mesh
      !> Tip mass mu, in rho Abar L
      real(wp) :: tip_mass_ratio = 0.0_wp
      !> K, which includes the springs of supports; rigid supports are not constrained yet
      type(skyline_t) :: stiffness
      !> M, of the same skyline profile
      type(skyline_t) :: mass
      !> Degree of freedom of the displacement at the stop
      integer :: stop_dof = 0
      !> Degree of freedom of the displacement at the tip
      integer :: tip_dof = 0
      !> Degrees of freedom of the displacements at all stops, including the first, in the order of the scene
      integer, allocatable :: stop_dofs(:)
      !> Degree of freedom of the surface of each stop, which moves with it; 0: the surface is fixed, [stops]
      integer, allocatable :: partner_dofs(:)
      !> Degrees of freedom besides those of the beam, the last of K and M (`complete_model`); of size 0 if there are
      !> none
      type(extra_dof_t), allocatable :: extra(:)
      !> Recorded degrees of freedom besides those of the beam; of size 0 if there are none
      type(recorded_point_t), allocatable :: points(:)
      !> Masses besides those of the mesh that a translation of the base moves; unallocated: there are none, [order]
      real(wp), allocatable :: lumped_mass(:)
      !> Damping rate of each degree of freedom, over omega1, instead of the damping of the beam; negative: there is no
      !> such rate. Unallocated: none has such a rate, [order]
      real(wp), allocatable :: own_rate(:)
      type(beam_root_t) :: root
      !> Degrees of freedom of y and dy/dx at x = 0; 0: constrained
      integer :: root_dofs(2) = 0
      !> Concentrated masses, ascending along the beam; of size 0 if there are none
      type(point_mass_t), allocatable :: point_masses(:)
      !> Supports along the beam; of size 0 if there are none
      type(beam_support_t), allocatable :: supports(:)
      !> Whether the inertia of the node at the stop is redistributed to its neighbours
      logical :: is_redistributed = .false.
      !> Displacement of that node as a linear function of other degrees of freedom
      type(continuation_t) :: continuation
      !> Whether that node has no mass, not even a point mass
      logical :: has_massless_node = .false.
   end type beam_model_t

contains

   !> Assemble K and M.
   pure subroutine make_beam_model(section, mesh, tip_mass_ratio, model, is_redistributed, supports, root, point_masses)
      type(section_t), intent(in) :: section
      type(mesh_t), intent(in) :: mesh
      !> Tip mass mu, >= 0
      real(wp), intent(in) :: tip_mass_ratio
      type(beam_model_t), intent(out) :: model
      !> Whether to redistribute the inertia of the node at the stop to its neighbours; default false
      logical, intent(in), optional :: is_redistributed
      !> Supports along the beam
      type(beam_support_t), intent(in), optional :: supports(:)
      !> Support at x = 0; default clamped
      type(beam_root_t), intent(in), optional :: root
      !> Concentrated masses at nodes
      type(point_mass_t), intent(in), optional :: point_masses(:)

      integer :: element, i

      model%section = section
      model%mesh = mesh
      model%tip_mass_ratio = tip_mass_ratio
      model%stop_dof = 2*mesh%stop_node - 1
      model%tip_dof = 2*mesh%elements - 1
      allocate (model%supports(0), model%point_masses(0), model%extra(0), model%points(0))
      if (present(supports)) model%supports = supports
      if (present(point_masses)) model%point_masses = &
         point_masses(ascending_order(real(point_masses%node, wp)))
      model%stop_dofs = [model%stop_dof]
      if (allocated(mesh%further_nodes)) model%stop_dofs = [model%stop_dof, 2*mesh%further_nodes(:mesh%further_stops) &
         - 1]
      allocate (model%partner_dofs(size(model%stop_dofs)), source=0)
      if (present(root)) call add_root_dofs(root, model)
      if (present(is_redistributed)) model%is_redistributed = is_redistributed
      if (model%is_redistributed) then
         model%continuation = continuation_at_stop(mesh, model%root_dofs)
         associate (masses => model%point_masses, node => mesh%redistributed_node)
            model%has_massless_node = .not. sum(masses%mass, mask=masses%node == node) &
               + merge(tip_mass_ratio, 0.0_wp, node == mesh%elements) > 0.0_wp
         end associate
      end if
      call make_profiles(model)
      do element = 1, mesh%elements
         call add_element(model%stiffness, element_dofs(model, element), &
            element_stiffness(section, mesh%length(element), mesh%tip_distance(element)))
         call add_element(model%mass, element_dofs(model, element), &
            element_mass(section, mesh%length(element), mesh%tip_distance(element)))
      end do
      if (model%is_redistributed) call redistribute(section, mesh, model%continuation, model%root_dofs, model%mass)
      call add_to_diagonal(model%mass, model%tip_dof, tip_mass_ratio)
      do i = 1, size(model%point_masses)
         call add_to_diagonal(model%mass, 2*model%point_masses(i)%node - 1, model%point_masses(i)%mass)
         call add_to_diagonal(model%mass, 2*model%point_masses(i)%node, model%point_masses(i)%rotary_inertia)
      end do
      do i = 1, size(model%supports)
         call add_to_diagonal(model%stiffness, model%supports(i)%dof, model%supports(i)%stiffness)
      end do
   end subroutine make_beam_model

   !> Add the free degrees of freedom of the root after all others, whose numbers do not change.
   pure subroutine add_root_dofs(root, model)
      type(beam_root_t), intent(in) :: root
      type(beam_model_t), intent(inout) :: model

      model%root = root
      if (root%translation_stiffness > 0.0_wp) model%root_dofs(1) = 2*model%mesh%elements + 1
      if (root%is_pinned .or. root%rotation_stiffness > 0.0_wp) then
         model%root_dofs(2) = max(2*model%mesh%elements, model%root_dofs(1)) + 1
      end if
   end subroutine add_root_dofs

   !> Make the skyline profiles of K and M, with zeros except for the springs of the root. The rows of the root span all
   !> columns before them.
   pure subroutine make_profiles(model)
      type(beam_model_t), intent(inout) :: model

      integer, allocatable :: first_row(:)
      integer :: i

      associate (mesh => model%mesh)
         allocate (first_row(max(2*mesh%elements, maxval(model%root_dofs))), source=1)
         do i = 2, mesh%elements
            first_row(2*i - 1:2*i) = 2*i - 3
         end do
         ! the redistribution couples the node and the nodes c - 2, c - 1 and c + 1
         if (model%is_redistributed) then
            associate (first => max(1, 2*mesh%redistributed_node - 5), last => min(2*mesh%redistributed_node + 2, &
               2*mesh%elements))
               first_row(first:last) = min(first_row(first:last), first)
            end associate
         end if
      end associate
      call make_skyline(model%stiffness, first_row)
      call make_skyline(model%mass, first_row)
      associate (stiffness => [model%root%translation_stiffness, model%root%rotation_stiffness])
         do i = 1, 2
            if (model%root_dofs(i) > 0) call add_to_diagonal(model%stiffness, model%root_dofs(i), stiffness(i))
         end do
      end associate
   end subroutine make_profiles

   !> Degrees of freedom of an element: y and dy/dx at the left, then at the right node; 0: constrained at the root.
   pure function element_dofs(model, element) result(dofs)
      type(beam_model_t), intent(in) :: model
      integer, intent(in) :: element
      integer :: dofs(4)

      dofs = 2*element - [3, 2, 1, 0]
      if (element == 1) dofs(1:2) = model%root_dofs
   end function element_dofs

   !> Degrees of freedom of y and dy/dx of a node; 0: constrained at the root.
   pure function node_dofs(model, node) result(dofs)
      type(beam_model_t), intent(in) :: model
      !> Number of the node; 0: the root
      integer, intent(in) :: node
      integer :: dofs(2)

      dofs = model%root_dofs
      if (node > 0) dofs = [2*node - 1, 2*node]
   end function node_dofs

   !> Whether the beam with its supports has a rigid-body rotation about the root.
   pure logical function is_mechanism(model) result(answer)
      type(beam_model_t), intent(in) :: model

      answer = model%root%is_pinned .and. size(model%supports) == 0
   end function is_mechanism

   !> Whether a part of the model can move without strain.
   pure logical function moves_freely(model) result(answer)
      type(beam_model_t), intent(in) :: model

      answer = is_mechanism(model) .or. any(model%extra%square <= 0.0_wp)
   end function moves_freely

   !> The beam with its rigid supports constrained: each of their degrees of freedom becomes an oscillator of its own (1
   !> on both diagonals), which remains at rest if no force acts on it. An eigen-solver would find its eigenvalue 1.
   pure type(beam_model_t) function constrain_supports(model) result(constrained)
      type(beam_model_t), intent(in) :: model

      integer :: i

      constrained = model
      do i = 1, size(model%supports)
         if (model%supports(i)%stiffness > 0.0_wp) cycle
         call decouple(constrained%stiffness, model%supports(i)%dof)
         call decouple(constrained%mass, model%supports(i)%dof)
      end do
   end function constrain_supports

   !> Replace a row and its column by those of the unit matrix.
   pure subroutine decouple(matrix, dof)
      type(skyline_t), intent(inout) :: matrix
      !> Index of the row
      integer, intent(in) :: dof

      integer :: column

      associate (diagonal_index => matrix%diagonal)
         matrix%values(diagonal_index(dof) - (dof - matrix%first_row(dof)):diagonal_index(dof)) = 0.0_wp
         do column = dof + 1, matrix%order
            if (matrix%first_row(column) <= dof) matrix%values(diagonal_index(column) - (column - dof)) = 0.0_wp
         end do
         matrix%values(diagonal_index(dof)) = 1.0_wp
      end associate
   end subroutine decouple

   !> Static deflection shape under a point force at the stop, scaled to a unit displacement at the stop. A rigid-body
   !> rotation is constrained at the root.
   pure subroutine static_shape(model, shape, error)
      type(beam_model_t), intent(in) :: model
      !> y and dy/dx over the degrees of freedom, [order of the model]
      real(wp), allocatable, intent(out) :: shape(:)
      !> Set if the stiffness matrix cannot be factorised
      type(failure_t), allocatable, intent(out) :: error

      type(skyline_t) :: factors

      factors = model%stiffness
      if (is_mechanism(model)) call decouple(factors, model%root_dofs(2))
      call factorise(factors, error)
      if (allocated(error)) return
      allocate (shape(factors%order), source=0.0_wp)
      shape(model%stop_dof) = 1.0_wp
      call solve_factorised(factors, shape)
      shape = shape/shape(model%stop_dof)
   end subroutine static_shape

   !> Complete the model of a beam to that of a run: append the extra degrees of freedom, and let the contacts of bodies
   !> refer to them.
   pure subroutine complete_model(settings, model)
      type(run_settings_t), intent(in) :: settings
      !> On entry the beam alone
      type(beam_model_t), intent(inout) :: model

      type(stop_settings_t), allocatable :: stops(:)
      integer :: k

      if (.not. allocated(settings%extra_dofs)) return
      allocate (stops, source=stops_of(settings))
      associate (order => model%mass%order)
         do k = 1, size(stops)
            if (stops(k)%partner == 0) cycle
            if (stops(k)%is_of_base) model%stop_dofs(k) = order + stops(k)%partner
            if (.not. stops(k)%is_of_base) model%partner_dofs(k) = order + stops(k)%partner
         end do
      end associate
      call set_extra(settings%extra_dofs, model)
   end subroutine complete_model

   !> A model without extra degrees of freedom. Its stops may still refer to them.
   pure type(beam_model_t) function beam_alone(model) result(beam)
      type(beam_model_t), intent(in) :: model

      beam = model
      if (size(model%extra) > 0) call set_extra(model%extra(:0), beam)
   end function beam_alone

   !> Replace the extra degrees of freedom of a model.
   pure subroutine set_extra(extra, model)
      type(extra_dof_t), intent(in) :: extra(:)
      type(beam_model_t), intent(inout) :: model

      integer :: i

      associate (before => model%mass%order - size(model%extra))
         model%points = [(recorded_point_t(before + i, extra(i)%position, extra(i)%origin, extra(i)%rest), &
            i=1, size(extra))]
         call replace_end(before, lambda1_power4*extra%mass*extra%square, model%stiffness)
         call replace_end(before, extra%mass, model%mass)
      end associate
      model%extra = extra
      if (allocated(model%lumped_mass)) deallocate (model%lumped_mass)
      if (allocated(model%own_rate)) deallocate (model%own_rate)
      if (size(extra) == 0) return
      associate (beam => model%mass%order - size(extra))
         model%lumped_mass = [spread(0.0_wp, 1, beam), extra%mass]
         if (any(extra%rate >= 0.0_wp)) model%own_rate = [spread(-1.0_wp, 1, beam), extra%rate]
      end associate
   end subroutine set_extra

   !> Replace the last columns of a matrix by those of a diagonal matrix.
   pure subroutine replace_end(before, diagonal, matrix)
      !> Number of columns before them
      integer, intent(in) :: before
      real(wp), intent(in) :: diagonal(:)
      type(skyline_t), intent(inout) :: matrix

      integer :: i

      associate (entries => matrix%diagonal(before))
         matrix%values = [matrix%values(:entries), diagonal]
         matrix%diagonal = [matrix%diagonal(:before), [(entries + i, i=1, size(diagonal))]]
      end associate
      matrix%first_row = [matrix%first_row(:before), [(before + i, i=1, size(diagonal))]]
      matrix%order = before + size(diagonal)
   end subroutine replace_end

end module beam_model
