!> The beam in its element curvatures with any root and supports (docs/theory.md, section 5).
!>
!> In the coordinates q the strain energy is q.q/2 and the kinetic energy |B dq/dt|^2/2; N q are the displacements and
!> rotations of the degrees of freedom. `bend` and `bend_transposed` multiply by B and B^T, `displace` and
!> `displace_transposed` by N and N^T; `deflect` multiplies by the B of the beam without supports. The coordinates of
!> `natural_coordinates` are followed by coordinates of springs along the beam, sqrt(k) times the displacement or
!> rotation. Two motions are added whose amounts are linear in the coordinates: the rigid-body rotation about a pinned
!> root, whose amount follows from a support or, without supports, from orthogonality in the mass product; and, if the
!> inertia of the node at the stop is redistributed (`redistributed_mass`; docs/theory.md, section 14), the motion of
!> this inertia from the node to the continuation of its displacement. The constraints of supports are imposed by
!> projection. Every product with B or B^T then takes two sums along the beam, without the cancellation of a factorised
!> stiffness matrix.
!>
!> A projection leaves a rounding error of q in the excluded direction. In a high mode displacements are smaller than q
!> by a factor lambda_i^2, and the excluded direction deflects the beam like a force at the support, so that the
!> rounding error relative to B^T B q would be lambda_i^4 times that relative to q. Displacements at supports are
!> therefore computed by the sums that give B q, with the rounding error of displacements, and a multiple of the
!> deflection under a force at the support is subtracted from B q so that the displacement satisfies the constraint.
module support_coordinates
   use beam_model, only: beam_model_t
   use kinds, only: wp
   use natural_coordinates, only: coordinates_of_forces, coordinates_of_shape, deflect, deflect_transposed, &
      make_natural_beam, natural_beam_t, nodal_displacements, rows_of_unit_displacement
   use pinned_coordinates, only: rigid_rotation
   implicit none (type, external)
   private
   public :: supported_beam_t, make_supported_beam, bend, bend_transposed, displace, displace_transposed, &
      coordinates_of_motion

   !> The constraint of a support: a degree of freedom equals the deflection of its spring, which is `sqrt_compliance`
   !> times the coordinate of the spring, or 0 if the support is rigid.
   type :: constraint_t
      !> Index of the degree of freedom; 0: there is no support
      integer :: dof = 0
      !> Index of the coordinate of the spring; 0: the support is rigid
      integer :: coordinate = 0
      !> 1/sqrt(k) of the spring
      real(wp) :: sqrt_compliance = 0.0_wp
   end type constraint_t

   !> A beam on its supports. The motion of the beam is that of `natural` under the coordinates, plus additional motions
   !> whose amounts are linear in the coordinates.
   type :: supported_beam_t
      !> Number of coordinates: those of `natural`, then one for each spring along the beam
      integer :: order = 0
      !> Number of coordinates less number of excluded directions
      integer :: free = 0
      !> Number of rows of B
      integer :: rows = 0
      !> Number of degrees of freedom
      integer :: dofs = 0
      type(natural_beam_t) :: natural
      !> sqrt(k) of the springs along the beam, [springs]
      real(wp), allocatable :: sqrt_stiffness(:)
      !> Degrees of freedom of these springs, [springs]
      integer, allocatable :: sprung_dofs(:)
      !> Directions that supports and a massless node exclude, orthonormal, [order, excluded]
      real(wp), allocatable :: excluded(:, :)
      !> Mass-weighted displacements (entries of B q) of additional motions per unit of their amounts, [rows, motions].
      !> The first are weighted motions: the continuation of the node whose inertia is redistributed, then the
      !> rigid-body rotation about a pinned root. The others remove rounding errors in excluded directions
      real(wp), allocatable :: motion_rows(:, :)
      !> Displacements and rotations of these motions per unit of their amounts, [dofs, motions]. They are zero for the
      !> continuation, which moves the inertia of the node but not the node
      real(wp), allocatable :: motion_dofs(:, :)
      !> Weights of the coordinates in the amounts of the weighted motions, [order, weighted motions]
      real(wp), allocatable :: weight(:, :)
      !> Constraint that each motion violates by 1 and that all later motions satisfy; its degree of freedom is 0 if the
      !> motion belongs to no support, [motions]
      type(constraint_t), allocatable :: constraint(:)
      !> Degrees of freedom that rigid supports constrain
      integer, allocatable :: supported(:)
   end type supported_beam_t

contains

   !> Make the beam on its supports from a model.
   pure subroutine make_supported_beam(model, beam)
      type(beam_model_t), intent(in) :: model
      type(supported_beam_t), intent(out) :: beam

      integer :: weighted, rotation_support

      call make_natural_beam(model, beam%natural)
      beam%rows = beam%natural%rows
      beam%dofs = beam%natural%dofs
      associate (supports => model%supports)
         ! a support of stiffness 0 is rigid
         beam%supported = pack(supports%dof, .not. supports%stiffness > 0.0_wp)
         beam%sprung_dofs = pack(supports%dof, supports%stiffness > 0.0_wp)
         beam%sqrt_stiffness = sqrt(pack(supports%stiffness, supports%stiffness > 0.0_wp))
         beam%order = beam%natural%order + size(beam%sprung_dofs)
         weighted = merge(1, 0, model%is_redistributed) + merge(1, 0, model%root%is_pinned)
         allocate (beam%motion_rows(beam%rows, weighted), beam%motion_dofs(beam%dofs, weighted), &
            beam%weight(beam%order, weighted), source=0.0_wp)
         allocate (beam%constraint(weighted))
         allocate (beam%excluded(beam%order, 0))
         if (model%is_redistributed) call continue_displacement(model, beam)
         rotation_support = 0
         if (model%root%is_pinned) call add_rotation(model, beam, rotation_support)
         call exclude_supports(model, rotation_support, beam)
      end associate
      beam%free = beam%order - size(beam%excluded, 2)
   end subroutine make_supported_beam

   !> Add the motion that replaces the displacement of the node at the stop by its continuation in B.
   pure subroutine continue_displacement(model, beam)
      type(beam_model_t), intent(in) :: model
      type(supported_beam_t), intent(inout) :: beam

      real(wp) :: forces(beam%dofs)
      integer :: i

      forces = 0.0_wp
      associate (struck_dof => 2*model%mesh%redistributed_node - 1, continuation => model%continuation)
         forces(struck_dof) = -1.0_wp
         do i = 1, size(continuation%dof)
            if (continuation%dof(i) > 0) forces(continuation%dof(i)) = continuation%weight(i)
         end do
      end associate
      beam%motion_rows(:, 1) = rows_of_unit_displacement(beam%natural, model%mesh%redistributed_node)
      beam%weight(:beam%natural%order, 1) = coordinates_of_forces(beam%natural, forces)
   end subroutine continue_displacement

   !> Add the rigid-body rotation about the root. Its amount follows from the support that constrains the rotation best;
   !> without supports the motion is orthogonal to the rotation in the mass product.
   pure subroutine add_rotation(model, beam, support)
      type(beam_model_t), intent(in) :: model
      type(supported_beam_t), intent(inout) :: beam
      !> Support that determines the amount; 0: there is none
      integer, intent(out) :: support

      ! estimate of the largest weight (component `weight`) if this support determined the amount of the rotation: the
      ! displacement at the support per unit of a coordinate, about 1 for curvatures and 1/sqrt(k) for the spring, over
      ! that per unit of the rotation; large weights lose digits
      real(wp) :: largest_weight
      ! minimum over the supports
      real(wp) :: min_weight
      real(wp) :: direction(beam%rows), motion(beam%dofs), weight(beam%order)
      integer :: i

      call rigid_rotation(beam%natural, direction, motion)
      support = 0
      min_weight = huge(1.0_wp)
      do i = 1, size(model%supports)
         associate (candidate => model%supports(i))
            if (.not. abs(motion(candidate%dof)) > 0.0_wp) cycle
            largest_weight = 1.0_wp
            if (candidate%stiffness > 0.0_wp) largest_weight = 1.0_wp + 1.0_wp/sqrt(candidate%stiffness)
            largest_weight = largest_weight/abs(motion(candidate%dof))
         end associate
         if (largest_weight >= min_weight) cycle
         min_weight = largest_weight
         support = i
      end do
      associate (last => size(beam%weight, 2))
         if (support > 0) then
            associate (constraint => beam%constraint(last))
               constraint = constraint_of(model, beam, support)
               weight = -coordinates_under_constraint(beam, constraint)
               direction = direction/motion(constraint%dof)
               motion = motion/motion(constraint%dof)
            end associate
         else
            call bend_transposed(beam, direction, weight)
            weight = -weight
         end if
         beam%motion_rows(:, last) = direction
         beam%motion_dofs(:, last) = motion
         beam%weight(:, last) = weight
      end associate
   end subroutine add_rotation

   !> Exclude the directions that supports constrain, and the motion of a massless node alone, which is orthogonal to
   !> all modes in strain energy.
   pure subroutine exclude_supports(model, rotation_support, beam)
      type(beam_model_t), intent(in) :: model
      !> Support that already determines the rotation; 0: there is none
      integer, intent(in) :: rotation_support
      type(supported_beam_t), intent(inout) :: beam

      type(constraint_t) :: constraint
      real(wp) :: shape(beam%dofs)
      integer :: i, before

      do i = 1, size(model%supports)
         if (i == rotation_support) cycle
         constraint = constraint_of(model, beam, i)
         before = size(beam%excluded, 2)
         call exclude(beam, coordinates_under_constraint(beam, constraint))
         if (size(beam%excluded, 2) > before) call add_motion(constraint, beam)
      end do
      if (.not. model%has_massless_node) return
      shape = 0.0_wp
      shape(2*model%mesh%redistributed_node - 1) = 1.0_wp
      call exclude(beam, coordinates_of_motion(beam, shape))
   end subroutine exclude_supports

   !> The constraint of a support in terms of the coordinates.
   pure type(constraint_t) function constraint_of(model, beam, support) result(constraint)
      type(beam_model_t), intent(in) :: model
      !> Beam whose springs are set
      type(supported_beam_t), intent(in) :: beam
      integer, intent(in) :: support

      integer :: spring

      associate (supports => model%supports)
         constraint%dof = supports(support)%dof
         if (.not. supports(support)%stiffness > 0.0_wp) return
         spring = count(supports(:support)%stiffness > 0.0_wp)
         constraint%coordinate = beam%natural%order + spring
         constraint%sqrt_compliance = 1.0_wp/beam%sqrt_stiffness(spring)
      end associate
   end function constraint_of

   !> Add the motion along the last excluded direction, scaled so that it violates the constraint of the support by 1.
   pure subroutine add_motion(constraint, beam)
      type(constraint_t), intent(in) :: constraint
      type(supported_beam_t), intent(inout) :: beam

      real(wp), allocatable :: rows(:, :), dofs(:, :)
      integer :: before

      before = size(beam%constraint)
      allocate (rows(beam%rows, before + 1), dofs(beam%dofs, before + 1))
      rows(:, :before) = beam%motion_rows
      dofs(:, :before) = beam%motion_dofs
      associate (q => beam%excluded(:, size(beam%excluded, 2)), row => rows(:, before + 1), dof => dofs(:, before + 1))
         call deflect(beam%natural, q(:beam%natural%order), row, dof)
         associate (amount => motion_amounts(beam, q, dof))
            row = row + matmul(beam%motion_rows, amount)
            dof = dof + matmul(beam%motion_dofs, amount)
         end associate
         associate (unit_violation => violation_of(constraint, q, dof(constraint%dof)))
            row = row/unit_violation
            dof = dof/unit_violation
         end associate
      end associate
      call move_alloc(rows, beam%motion_rows)
      call move_alloc(dofs, beam%motion_dofs)
      beam%constraint = [beam%constraint, constraint]
   end subroutine add_motion

   !> Violation of the constraint of a support.
   pure real(wp) function violation_of(constraint, q, displacement) result(violation)
      type(constraint_t), intent(in) :: constraint
      !> Coordinates, [order]
      real(wp), intent(in) :: q(:)
      !> Displacement or rotation of the degree of freedom of the support
      real(wp), intent(in) :: displacement

      violation = displacement
      if (constraint%coordinate > 0) violation = violation - constraint%sqrt_compliance*q(constraint%coordinate)
   end function violation_of

   !> Amounts of the additional motions.
   pure function motion_amounts(beam, q, nodal) result(amount)
      type(supported_beam_t), intent(in) :: beam
      !> Coordinates, [order]
      real(wp), intent(in) :: q(:)
      !> Displacements and rotations due to the curvatures, [dofs]
      real(wp), intent(in) :: nodal(:)
      real(wp) :: amount(size(beam%constraint))

      integer :: k

      do k = 1, size(beam%constraint)
         associate (constraint => beam%constraint(k))
            if (constraint%dof == 0) then
               amount(k) = dot_product(beam%weight(:, k), q)
            else
               amount(k) = -violation_of(constraint, q, nodal(constraint%dof) &
                  + dot_product(beam%motion_dofs(constraint%dof, :k - 1), amount(:k - 1)))
            end if
         end associate
      end do
   end function motion_amounts

   !> Exclude a further direction, unless it is linearly dependent on the excluded directions.
   pure subroutine exclude(beam, direction)
      type(supported_beam_t), intent(inout) :: beam
      !> Direction, [order]
      real(wp), intent(in) :: direction(:)

      real(wp), allocatable :: excluded(:, :)
      real(wp) :: residual(beam%order)
      integer :: count

      residual = direction/norm2(direction)
      call project(beam, residual)
      if (norm2(residual) <= 4.0_wp*epsilon(1.0_wp)) return
      count = size(beam%excluded, 2)
      allocate (excluded(beam%order, count + 1))
      excluded(:, :count) = beam%excluded
      excluded(:, count + 1) = residual/norm2(residual)
      call move_alloc(excluded, beam%excluded)
   end subroutine exclude

   !> Project a vector onto the directions that are not excluded. A second pass removes rounding errors of the first.
   pure subroutine project(beam, q)
      type(supported_beam_t), intent(in) :: beam
      !> Coordinates, [order]
      real(wp), intent(inout) :: q(:)

      integer :: k, pass

      do pass = 1, 2
         do k = 1, size(beam%excluded, 2)
            q = q - beam%excluded(:, k)*dot_product(beam%excluded(:, k), q)
         end do
      end do
   end subroutine project

   !> The product B q: mass-weighted displacements under the coordinates.
   pure subroutine bend(beam, q, deflection)
      type(supported_beam_t), intent(in) :: beam
      !> Coordinates, [order]
      real(wp), intent(in) :: q(:)
      !> B q, [rows]
      real(wp), intent(out) :: deflection(:)

      real(wp) :: amount(size(beam%constraint)), nodal(beam%dofs)
      integer :: k

      if (size(beam%constraint) == 0) then
         call deflect(beam%natural, q(:beam%natural%order), deflection)
         return
      end if
      call deflect(beam%natural, q(:beam%natural%order), deflection, nodal)
      amount = motion_amounts(beam, q, nodal)
      do k = 1, size(amount)
         deflection = deflection + beam%motion_rows(:, k)*amount(k)
      end do
   end subroutine bend

   !> The product B^T f, projected onto the directions that are not excluded. Motions other than the weighted motions
   !> are omitted, because they only correct rounding errors of `bend`.
   pure subroutine bend_transposed(beam, f, q)
      type(supported_beam_t), intent(in) :: beam
      !> f, [rows]
      real(wp), intent(in) :: f(:)
      !> Coordinates, [order]
      real(wp), intent(out) :: q(:)

      integer :: k

      call deflect_transposed(beam%natural, f, q(:beam%natural%order))
      q(beam%natural%order + 1:) = 0.0_wp
      do k = 1, size(beam%weight, 2)
         q = q + beam%weight(:, k)*dot_product(beam%motion_rows(:, k), f)
      end do
      call project(beam, q)
   end subroutine bend_transposed

   !> Displacements and rotations of the degrees of freedom under the coordinates.
   pure subroutine displace(beam, q, nodal)
      type(supported_beam_t), intent(in) :: beam
      !> Coordinates, [order]
      real(wp), intent(in) :: q(:)
      !> Displacements and rotations, [dofs]
      real(wp), intent(out) :: nodal(:)

      real(wp) :: amount(size(beam%constraint))
      integer :: k

      call nodal_displacements(beam%natural, q(:beam%natural%order), nodal)
      amount = motion_amounts(beam, q, nodal)
      do k = 1, size(amount)
         nodal = nodal + beam%motion_dofs(:, k)*amount(k)
      end do
      nodal(beam%supported) = 0.0_wp
   end subroutine displace

   !> The coordinates of the static shape under forces on the degrees of freedom, E Ibar = L = 1, projected onto the
   !> directions that are not excluded.
   pure subroutine displace_transposed(beam, forces, q)
      type(supported_beam_t), intent(in) :: beam
      !> Forces and moments, [dofs]
      real(wp), intent(in) :: forces(:)
      !> Coordinates, [order]
      real(wp), intent(out) :: q(:)

      integer :: k

      q(:beam%natural%order) = coordinates_of_forces(beam%natural, forces)
      q(beam%natural%order + 1:) = 0.0_wp
      do k = 1, size(beam%weight, 2)
         q = q + beam%weight(:, k)*dot_product(beam%motion_dofs(:, k), forces)
      end do
      call project(beam, q)
   end subroutine displace_transposed

   !> The coordinates under a unit constraint force, which acts on the degree of freedom and in opposite direction on
   !> its spring, without projection.
   pure function coordinates_under_constraint(beam, constraint) result(q)
      type(supported_beam_t), intent(in) :: beam
      type(constraint_t), intent(in) :: constraint
      real(wp) :: q(beam%order)

      q = coordinates_under_force(beam, constraint%dof)
      if (constraint%coordinate > 0) q(constraint%coordinate) = q(constraint%coordinate) - constraint%sqrt_compliance
   end function coordinates_under_constraint

   !> The coordinates under a unit force on a degree of freedom, without projection.
   pure function coordinates_under_force(beam, dof) result(q)
      type(supported_beam_t), intent(in) :: beam
      integer, intent(in) :: dof
      real(wp) :: q(beam%order)

      real(wp) :: forces(beam%dofs)
      integer :: k

      forces = 0.0_wp
      forces(dof) = 1.0_wp
      q = 0.0_wp
      q(:beam%natural%order) = coordinates_of_forces(beam%natural, forces)
      do k = 1, size(beam%weight, 2)
         q = q + beam%weight(:, k)*beam%motion_dofs(dof, k)
      end do
   end function coordinates_under_force

   !> Coordinates of a motion of the degrees of freedom that satisfies the constraints of the supports.
   pure function coordinates_of_motion(beam, nodal) result(q)
      type(supported_beam_t), intent(in) :: beam
      !> Displacements and rotations, [dofs]
      real(wp), intent(in) :: nodal(:)
      real(wp) :: q(beam%order)

      q(:beam%natural%order) = coordinates_of_shape(beam%natural, nodal)
      q(beam%natural%order + 1:) = beam%sqrt_stiffness*nodal(beam%sprung_dofs)
   end function coordinates_of_motion

end module support_coordinates
