!> The beam in its element curvatures, however it is held (docs/theory.md, section 5).
!>
!> What the curvatures alone (`natural_coordinates`) leave open is added: a rotation about a root that turns freely, of
!> which a support tells how much, or, where there is none, that it is orthogonal in the mass product; coordinates of
!> springs along the beam, sqrt(k) times the displacement; a displacement that is continued from others. What supports
!> do not allow is a projection. So every product is two sums along the beam, and none cancels as a factorised
!> stiffness does.
!>
!> A projection leaves a rounding of q in the direction that it takes out. In a high mode of lambda_i displacements are
!> smaller than q by lambda_i^2, and the direction bends the beam as a force at the support does: the rounding would be
!> lambda_i^4 times as great in B^T B q. So displacements at supports are taken from the sums that make B q, where they
!> are known to the rounding of displacements, and the shape of that force is taken out of B q.
module support_coordinates
   use beam_model, only: beam_model_t, has_rigid_mode
   use kinds, only: wp
   use natural_coordinates, only: coordinates_of_forces, coordinates_of_shape, deflect, deflect_transposed, &
      make_natural_beam, natural_beam_t, nodal_displacements, row_shape
   use pinned_coordinates, only: rigid_rotation
   implicit none (type, external)
   private
   public :: supported_beam_t, make_supported_beam, bend, bend_transposed, displace, displace_transposed, &
      strain_of_shape

   !> A support: the displacement or slope of a degree of freedom is that of its spring, `give` times a coordinate.
   type :: tie_t
      !> 0: there is no support
      integer :: dof = 0
      !> 0: it is rigid
      integer :: coordinate = 0
      real(wp) :: give = 0.0_wp
   end type tie_t

   type :: supported_beam_t
      !> Coordinates: those of the curvatures, then of springs along the beam; directions that are not excluded
      integer :: order = 0
      integer :: free = 0
      !> Rows of B, and degrees of freedom
      integer :: rows = 0
      integer :: dofs = 0
      type(natural_beam_t) :: natural
      !> sqrt(k) of the springs and their degrees of freedom, [springs]
      real(wp), allocatable :: root_stiffness(:)
      integer, allocatable :: sprung(:)
      !> What supports and a node without mass exclude, orthonormal, [order, excluded]
      real(wp), allocatable :: excluded(:, :)
      !> Motions besides: their rows of B and degrees of freedom, [rows, motions], [dofs, motions]
      real(wp), allocatable :: motion_rows(:, :), motion_dofs(:, :)
      !> How much of each of the first of them belongs to the coordinates, [order, shares]; the others only take out
      !> what rounding leaves of an excluded direction
      real(wp), allocatable :: share(:, :)
      !> The support to which each motion gives way by 1, and at which those behind it are at rest, [motions]
      type(tie_t), allocatable :: tie(:)
      !> Degrees of freedom that are held
      integer, allocatable :: supported(:)
   end type supported_beam_t

contains

   !> The beam on its supports.
   pure subroutine make_supported_beam(model, beam)
      type(beam_model_t), intent(in) :: model
      type(supported_beam_t), intent(out) :: beam

      integer :: shares, told

      call make_natural_beam(model, beam%natural)
      beam%rows = beam%natural%rows
      beam%dofs = beam%natural%dofs
      associate (supports => model%supports)
         beam%supported = pack(supports%dof, .not. supports%stiffness > 0.0_wp)
         beam%sprung = pack(supports%dof, supports%stiffness > 0.0_wp)
         beam%root_stiffness = sqrt(pack(supports%stiffness, supports%stiffness > 0.0_wp))
         beam%order = beam%natural%order + size(beam%sprung)
         shares = merge(1, 0, model%is_redistributed) + merge(1, 0, has_rigid_mode(model))
         allocate (beam%motion_rows(beam%rows, shares), beam%motion_dofs(beam%dofs, shares), &
            beam%share(beam%order, shares), source=0.0_wp)
         allocate (beam%tie(shares))
         allocate (beam%excluded(beam%order, 0))
         if (model%is_redistributed) call continue_displacement(model, beam)
         told = 0
         if (has_rigid_mode(model)) call add_rotation(model, beam, told)
         call exclude_supports(model, told, beam)
      end associate
      beam%free = beam%order - size(beam%excluded, 2)
   end subroutine make_supported_beam

   !> The rows of B with the displacement of the stop's node continued from the others.
   pure subroutine continue_displacement(model, beam)
      type(beam_model_t), intent(in) :: model
      type(supported_beam_t), intent(inout) :: beam

      real(wp) :: forces(beam%dofs)
      integer :: i

      forces = 0.0_wp
      associate (struck => 2*model%mesh%struck_node - 1, continuation => model%continuation)
         forces(struck) = -1.0_wp
         do i = 1, size(continuation%dof)
            if (continuation%dof(i) > 0) forces(continuation%dof(i)) = continuation%weight(i)
         end do
      end associate
      beam%motion_rows(:, 1) = row_shape(beam%natural, model%mesh%struck_node)
      beam%share(:beam%natural%order, 1) = coordinates_of_forces(beam%natural, forces)
   end subroutine continue_displacement

   !> The rotation about the root. A support tells how much of it there is, that which holds it best; else it is
   !> orthogonal to what the coordinates move.
   pure subroutine add_rotation(model, beam, support)
      type(beam_model_t), intent(in) :: model
      type(supported_beam_t), intent(inout) :: beam
      !> The support, 0: there is none
      integer, intent(out) :: support

      real(wp) :: direction(beam%rows), give, least, motion(beam%dofs), share(beam%order)
      integer :: i

      call rigid_rotation(beam%natural, direction, motion)
      support = 0
      least = huge(1.0_wp)
      do i = 1, size(model%supports)
         associate (supported => model%supports(i))
            if (.not. abs(motion(supported%dof)) > 0.0_wp) cycle
            give = 1.0_wp
            if (supported%stiffness > 0.0_wp) give = 1.0_wp + 1.0_wp/sqrt(supported%stiffness)
            give = give/abs(motion(supported%dof))
         end associate
         if (give >= least) cycle
         least = give
         support = i
      end do
      associate (last => size(beam%share, 2))
         if (support > 0) then
            associate (tie => beam%tie(last))
               tie = tie_of(model, beam, support)
               share = -strain_under_tie(beam, tie)
               direction = direction/motion(tie%dof)
               motion = motion/motion(tie%dof)
            end associate
         else
            call bend_transposed(beam, direction, share)
            share = -share
         end if
         beam%motion_rows(:, last) = direction
         beam%motion_dofs(:, last) = motion
         beam%share(:, last) = share
      end associate
   end subroutine add_rotation

   !> What supports do not allow, and the motion of a node without mass alone, which is orthogonal to all modes.
   pure subroutine exclude_supports(model, told, beam)
      type(beam_model_t), intent(in) :: model
      !> The support that tells the rotation already
      integer, intent(in) :: told
      type(supported_beam_t), intent(inout) :: beam

      type(tie_t) :: tie
      real(wp) :: shape(beam%dofs)
      integer :: i, before

      do i = 1, size(model%supports)
         if (i == told) cycle
         tie = tie_of(model, beam, i)
         before = size(beam%excluded, 2)
         call exclude(beam, strain_under_tie(beam, tie))
         if (size(beam%excluded, 2) > before) call add_motion(tie, beam)
      end do
      if (.not. model%has_massless_node) return
      shape = 0.0_wp
      shape(2*model%mesh%struck_node - 1) = 1.0_wp
      call exclude(beam, strain_of_shape(beam, shape))
   end subroutine exclude_supports

   !> What a support is to the coordinates.
   pure function tie_of(model, beam, support) result(tie)
      type(beam_model_t), intent(in) :: model
      !> Its springs
      type(supported_beam_t), intent(in) :: beam
      integer, intent(in) :: support
      type(tie_t) :: tie

      integer :: spring

      associate (supports => model%supports)
         tie%dof = supports(support)%dof
         if (.not. supports(support)%stiffness > 0.0_wp) return
         spring = count(supports(:support)%stiffness > 0.0_wp)
         tie%coordinate = beam%natural%order + spring
         tie%give = 1.0_wp/beam%root_stiffness(spring)
      end associate
   end function tie_of

   !> The motion of the direction excluded last, by which the support gives way by 1.
   pure subroutine add_motion(tie, beam)
      type(tie_t), intent(in) :: tie
      type(supported_beam_t), intent(inout) :: beam

      real(wp), allocatable :: rows(:, :), dofs(:, :)
      integer :: before

      before = size(beam%tie)
      allocate (rows(beam%rows, before + 1), dofs(beam%dofs, before + 1))
      rows(:, :before) = beam%motion_rows
      dofs(:, :before) = beam%motion_dofs
      associate (q => beam%excluded(:, size(beam%excluded, 2)), row => rows(:, before + 1), dof => dofs(:, before + 1))
         call deflect(beam%natural, q(:beam%natural%order), row, dof)
         associate (amount => amounts_of(beam, q, dof))
            row = row + matmul(beam%motion_rows, amount)
            dof = dof + matmul(beam%motion_dofs, amount)
         end associate
         associate (moved => gap_at(tie, q, dof(tie%dof)))
            row = row/moved
            dof = dof/moved
         end associate
      end associate
      call move_alloc(rows, beam%motion_rows)
      call move_alloc(dofs, beam%motion_dofs)
      beam%tie = [beam%tie, tie]
   end subroutine add_motion

   !> How far a degree of freedom is from where its support has it.
   pure function gap_at(tie, q, displacement) result(gap)
      type(tie_t), intent(in) :: tie
      !> Coordinates, [order]
      real(wp), intent(in) :: q(:)
      real(wp), intent(in) :: displacement
      real(wp) :: gap

      gap = displacement
      if (tie%coordinate > 0) gap = gap - tie%give*q(tie%coordinate)
   end function gap_at

   !> How much of each motion besides there is.
   pure function amounts_of(beam, q, nodal) result(amount)
      type(supported_beam_t), intent(in) :: beam
      !> Coordinates, [order]
      real(wp), intent(in) :: q(:)
      !> What curvatures move, [dofs]
      real(wp), intent(in) :: nodal(:)
      real(wp) :: amount(size(beam%tie))

      integer :: k

      do k = 1, size(beam%tie)
         associate (tie => beam%tie(k))
            if (tie%dof == 0) then
               amount(k) = dot_product(beam%share(:, k), q)
            else
               amount(k) = -gap_at(tie, q, nodal(tie%dof) + dot_product(beam%motion_dofs(tie%dof, :k - 1), &
                  amount(:k - 1)))
            end if
         end associate
      end do
   end function amounts_of

   !> One direction more; one that others hold already excludes nothing.
   pure subroutine exclude(beam, direction)
      type(supported_beam_t), intent(inout) :: beam
      !> [order]
      real(wp), intent(in) :: direction(:)

      real(wp), allocatable :: excluded(:, :)
      real(wp) :: rest(beam%order)
      integer :: count

      rest = direction/norm2(direction)
      call take_out(beam, rest)
      if (norm2(rest) <= 4.0_wp*epsilon(1.0_wp)) return
      count = size(beam%excluded, 2)
      allocate (excluded(beam%order, count + 1))
      excluded(:, :count) = beam%excluded
      excluded(:, count + 1) = rest/norm2(rest)
      call move_alloc(excluded, beam%excluded)
   end subroutine exclude

   !> What of a vector is allowed; twice, as rounding in the first would show.
   pure subroutine take_out(beam, q)
      type(supported_beam_t), intent(in) :: beam
      !> [order]
      real(wp), intent(inout) :: q(:)

      integer :: k, round

      do round = 1, 2
         do k = 1, size(beam%excluded, 2)
            q = q - beam%excluded(:, k)*dot_product(beam%excluded(:, k), q)
         end do
      end do
   end subroutine take_out

   !> B q.
   pure subroutine bend(beam, q, deflection)
      type(supported_beam_t), intent(in) :: beam
      !> Coordinates, [order]
      real(wp), intent(in) :: q(:)
      !> [rows]
      real(wp), intent(out) :: deflection(:)

      real(wp) :: amount(size(beam%tie)), nodal(beam%dofs)
      integer :: k

      if (size(beam%tie) == 0) then
         call deflect(beam%natural, q(:beam%natural%order), deflection)
         return
      end if
      call deflect(beam%natural, q(:beam%natural%order), deflection, nodal)
      amount = amounts_of(beam, q, nodal)
      do k = 1, size(amount)
         deflection = deflection + beam%motion_rows(:, k)*amount(k)
      end do
   end subroutine bend

   !> B^T f, as far as the supports allow it.
   pure subroutine bend_transposed(beam, f, q)
      type(supported_beam_t), intent(in) :: beam
      !> [rows]
      real(wp), intent(in) :: f(:)
      !> Coordinates, [order]
      real(wp), intent(out) :: q(:)

      integer :: k

      call deflect_transposed(beam%natural, f, q(:beam%natural%order))
      q(beam%natural%order + 1:) = 0.0_wp
      do k = 1, size(beam%share, 2)
         q = q + beam%share(:, k)*dot_product(beam%motion_rows(:, k), f)
      end do
      call take_out(beam, q)
   end subroutine bend_transposed

   !> Motion of the degrees of freedom.
   pure subroutine displace(beam, q, nodal)
      type(supported_beam_t), intent(in) :: beam
      !> Coordinates, [order]
      real(wp), intent(in) :: q(:)
      !> [dofs]
      real(wp), intent(out) :: nodal(:)

      real(wp) :: amount(size(beam%tie))
      integer :: k

      call nodal_displacements(beam%natural, q(:beam%natural%order), nodal)
      amount = amounts_of(beam, q, nodal)
      do k = 1, size(amount)
         nodal = nodal + beam%motion_dofs(:, k)*amount(k)
      end do
      nodal(beam%supported) = 0.0_wp
   end subroutine displace

   !> The coordinates of the static shape under forces on the degrees of freedom, E Ibar = L = 1, as far as the supports
   !> allow it.
   pure subroutine displace_transposed(beam, forces, q)
      type(supported_beam_t), intent(in) :: beam
      !> [dofs]
      real(wp), intent(in) :: forces(:)
      !> Coordinates, [order]
      real(wp), intent(out) :: q(:)

      integer :: k

      q(:beam%natural%order) = coordinates_of_forces(beam%natural, forces)
      q(beam%natural%order + 1:) = 0.0_wp
      do k = 1, size(beam%share, 2)
         q = q + beam%share(:, k)*dot_product(beam%motion_dofs(:, k), forces)
      end do
      call take_out(beam, q)
   end subroutine displace_transposed

   !> The coordinates of a unit pair of forces on a degree of freedom and against its spring, also in the directions
   !> that supports exclude.
   pure function strain_under_tie(beam, tie) result(q)
      type(supported_beam_t), intent(in) :: beam
      type(tie_t), intent(in) :: tie
      real(wp) :: q(beam%order)

      q = strain_under(beam, tie%dof)
      if (tie%coordinate > 0) q(tie%coordinate) = q(tie%coordinate) - tie%give
   end function strain_under_tie

   !> The same of the force alone.
   pure function strain_under(beam, dof) result(q)
      type(supported_beam_t), intent(in) :: beam
      integer, intent(in) :: dof
      real(wp) :: q(beam%order)

      real(wp) :: forces(beam%dofs)
      integer :: k

      forces = 0.0_wp
      forces(dof) = 1.0_wp
      q = 0.0_wp
      q(:beam%natural%order) = coordinates_of_forces(beam%natural, forces)
      do k = 1, size(beam%share, 2)
         q = q + beam%share(:, k)*beam%motion_dofs(dof, k)
      end do
   end function strain_under

   !> Coordinates of a motion of the degrees of freedom, which the supports allow.
   pure function strain_of_shape(beam, nodal) result(q)
      type(supported_beam_t), intent(in) :: beam
      !> [dofs]
      real(wp), intent(in) :: nodal(:)
      real(wp) :: q(beam%order)

      q(:beam%natural%order) = coordinates_of_shape(beam%natural, nodal)
      q(beam%natural%order + 1:) = beam%root_stiffness*nodal(beam%sprung)
   end function strain_of_shape

end module support_coordinates
