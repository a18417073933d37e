!> The beam in its element curvatures, however it is held (docs/theory.md, section 5).
!>
!> What the curvatures alone (`natural_coordinates`) leave open is added: a rotation about a root that turns freely, of
!> which a support tells how much, or, where there is none, that it is orthogonal in the mass product; coordinates of
!> springs along the beam, sqrt(k) times the displacement; a displacement that is continued from others. What supports
!> do not allow is a projection. So every product is two sums along the beam, and none cancels as a factorised
!> stiffness does.
module held_coordinates
   use beam_model, only: beam_model_t, has_rigid_mode
   use kinds, only: wp
   use natural_coordinates, only: coordinates_of_forces, coordinates_of_shape, deflect, deflect_transposed, &
      make_natural_beam, natural_beam_t, nodal_displacements, row_shape
   use pinned_coordinates, only: rigid_rotation
   implicit none (type, external)
   private
   public :: held_beam_t, make_held_beam, bend, bend_transposed, displace, displace_transposed, strain_of_shape

   type :: held_beam_t
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
      !> Motions besides: their rows of B, degrees of freedom, and how much of each belongs to the coordinates,
      !> [rows, motions], [dofs, motions], [order, motions]
      real(wp), allocatable :: motion_rows(:, :), motion_dofs(:, :), share(:, :)
      !> Degrees of freedom that are held
      integer, allocatable :: held(:)
   end type held_beam_t

contains

   !> The beam on its supports.
   pure subroutine make_held_beam(model, beam)
      type(beam_model_t), intent(in) :: model
      type(held_beam_t), intent(out) :: beam

      integer :: motions, told

      call make_natural_beam(model, beam%natural)
      beam%rows = beam%natural%rows
      beam%dofs = beam%natural%dofs
      associate (supports => model%supports)
         beam%held = pack(supports%dof, .not. supports%stiffness > 0.0_wp)
         beam%sprung = pack(supports%dof, supports%stiffness > 0.0_wp)
         beam%root_stiffness = sqrt(pack(supports%stiffness, supports%stiffness > 0.0_wp))
         beam%order = beam%natural%order + size(beam%sprung)
         motions = merge(1, 0, model%is_redistributed) + merge(1, 0, has_rigid_mode(model))
         allocate (beam%motion_rows(beam%rows, motions), beam%motion_dofs(beam%dofs, motions), &
            beam%share(beam%order, motions), source=0.0_wp)
         allocate (beam%excluded(beam%order, 0))
         if (model%is_redistributed) call continue_displacement(model, beam)
         told = 0
         if (has_rigid_mode(model)) call add_rotation(model, beam, told)
         call exclude_supports(model, told, beam)
      end associate
      beam%free = beam%order - size(beam%excluded, 2)
   end subroutine make_held_beam

   !> The rows of B with the displacement of the stop's node continued from the others.
   pure subroutine continue_displacement(model, beam)
      type(beam_model_t), intent(in) :: model
      type(held_beam_t), intent(inout) :: beam

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
      type(held_beam_t), intent(inout) :: beam
      !> The support, 0: there is none
      integer, intent(out) :: support

      real(wp) :: direction(beam%rows), give, least, motion(beam%dofs), share(beam%order)
      integer :: i

      call rigid_rotation(beam%natural, direction, motion)
      support = 0
      least = huge(1.0_wp)
      do i = 1, size(model%supports)
         associate (held => model%supports(i))
            if (.not. abs(motion(held%dof)) > 0.0_wp) cycle
            give = 1.0_wp
            if (held%stiffness > 0.0_wp) give = 1.0_wp + 1.0_wp/sqrt(held%stiffness)
            give = give/abs(motion(held%dof))
         end associate
         if (give >= least) cycle
         least = give
         support = i
      end do
      if (support > 0) then
         share = -strain_under(beam, model%supports(support)%dof)/motion(model%supports(support)%dof)
         if (model%supports(support)%stiffness > 0.0_wp) then
            i = count(model%supports(:support)%stiffness > 0.0_wp)
            share(beam%natural%order + i) = 1.0_wp/(beam%root_stiffness(i)*motion(beam%sprung(i)))
         end if
      else
         call bend_transposed(beam, direction, share)
         share = -share
      end if
      associate (last => size(beam%share, 2))
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
      type(held_beam_t), intent(inout) :: beam

      real(wp) :: direction(beam%order), shape(beam%dofs)
      integer :: i, springs

      springs = 0
      do i = 1, size(model%supports)
         associate (support => model%supports(i))
            direction = strain_under(beam, support%dof)
            if (support%stiffness > 0.0_wp) then
               springs = springs + 1
               direction(beam%natural%order + springs) = direction(beam%natural%order + springs) &
                  - 1.0_wp/beam%root_stiffness(springs)
            end if
            if (i /= told) call exclude(beam, direction)
         end associate
      end do
      if (.not. model%has_massless_node) return
      shape = 0.0_wp
      shape(2*model%mesh%struck_node - 1) = 1.0_wp
      call exclude(beam, strain_of_shape(beam, shape))
   end subroutine exclude_supports

   !> One direction more; one that others hold already excludes nothing.
   pure subroutine exclude(beam, direction)
      type(held_beam_t), intent(inout) :: beam
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
      type(held_beam_t), intent(in) :: beam
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
      type(held_beam_t), intent(in) :: beam
      !> Coordinates, [order]
      real(wp), intent(in) :: q(:)
      !> [rows]
      real(wp), intent(out) :: deflection(:)

      integer :: k

      call deflect(beam%natural, q(:beam%natural%order), deflection)
      do k = 1, size(beam%share, 2)
         deflection = deflection + beam%motion_rows(:, k)*dot_product(beam%share(:, k), q)
      end do
   end subroutine bend

   !> B^T f, as far as the supports allow it.
   pure subroutine bend_transposed(beam, f, q)
      type(held_beam_t), intent(in) :: beam
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
      type(held_beam_t), intent(in) :: beam
      !> Coordinates, [order]
      real(wp), intent(in) :: q(:)
      !> [dofs]
      real(wp), intent(out) :: nodal(:)

      integer :: k

      call nodal_displacements(beam%natural, q(:beam%natural%order), nodal)
      do k = 1, size(beam%share, 2)
         nodal = nodal + beam%motion_dofs(:, k)*dot_product(beam%share(:, k), q)
      end do
      nodal(beam%held) = 0.0_wp
   end subroutine displace

   !> The coordinates of the static shape under forces on the degrees of freedom, E Ibar = L = 1, as far as the supports
   !> allow it.
   pure subroutine displace_transposed(beam, forces, q)
      type(held_beam_t), intent(in) :: beam
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

   !> The same of a unit force, without what supports do not allow.
   pure function strain_under(beam, dof) result(q)
      type(held_beam_t), intent(in) :: beam
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
      type(held_beam_t), intent(in) :: beam
      !> [dofs]
      real(wp), intent(in) :: nodal(:)
      real(wp) :: q(beam%order)

      q(:beam%natural%order) = coordinates_of_shape(beam%natural, nodal)
      q(beam%natural%order + 1:) = beam%root_stiffness*nodal(beam%sprung)
   end function strain_of_shape

end module held_coordinates
