!> A mass matrix in which the inertia of the node at the stop belongs to its neighbours (docs/theory.md, section 14).
!>
!> The displacement y_c of that node moves no inertia: in the kinetic energy it is replaced by its continuation t.y from
!> the other coordinates, M' = T^T M T with T = 1 - e_c d^T, d = e_c - t. So an impact acts on the point mass at the
!> node alone, as it does on a beam, whose own mass takes part in no impact (mass redistribution: Khenous, Laborde and
!> Renard, Eur. J. Mech. A 27 (2008) 918).
module redistributed_mass
   use beam_element, only: element_mass, hermite_shape
   use beam_mesh, only: mesh_t
   use beam_section, only: section_t
   use kinds, only: wp
   use skyline_matrix, only: add_element, skyline_t
   implicit none (type, external)
   private
   public :: continuation_t, continuation_at_stop, redistribute

   !> t: y_c = sum weight y_dof for every motion that is a polynomial of low degree around the node.
   type :: continuation_t
      !> Degrees of freedom; 0: held at the root
      integer :: dof(4) = 0
      real(wp) :: weight(4) = 0.0_wp
   end type continuation_t

   !> Beyond this share of its last element a beam is not continued from the element before: a cubic would rest on
   !> a short base, and T would make much of little.
   real(wp), parameter :: least_base = 0.5_wp

contains

   !> The continuation of the displacement at the stop: between two elements the cubic of the displacements and slopes
   !> at their far ends, at the tip that of the displacements of the two nodes before and of the slopes of the last
   !> two, or a parabola where there is no element to rest it on.
   pure function continuation_at_stop(mesh, root_dofs) result(continuation)
      type(mesh_t), intent(in) :: mesh
      !> Degrees of freedom of the root; 0: held
      integer, intent(in) :: root_dofs(2)
      type(continuation_t) :: continuation

      real(wp) :: cubic(2), divisor, square(2)
      integer :: node

      node = mesh%struck_node
      associate (l => mesh%length(node), dof => continuation%dof, weight => continuation%weight)
         if (node < mesh%elements) then
            associate (whole => l + mesh%length(node + 1))
               dof = with_root([2*node - 3, 2*node - 2, 2*node + 1, 2*node + 2], root_dofs)
               weight = hermite_shape(l/whole, whole)
            end associate
            return
         end if
         dof = with_root([2*node - 3, 2*node - 2, 2*node, 2*node - 5], root_dofs)
         weight = [1.0_wp, 0.5_wp*l, 0.5_wp*l, 0.0_wp]
         if (node == 1) return
         associate (m => mesh%length(node - 1))
            if (m < least_base*l) return
            ! y = y1 + theta1 s + a s^2 + b s^3, s from the last node but one: the slope at the tip and the displacement
            ! at -m give a and b
            divisor = m**2*(2.0_wp*m + 3.0_wp*l)
            ! by the difference of slopes, and by that of the displacement at -m from the tangent
            square = [m**3/l, 3.0_wp*l]/divisor
            cubic = [m**2/l, -2.0_wp]/divisor
            associate (by_slope => l**2*square(1) + l**3*cubic(1), by_fall => l**2*square(2) + l**3*cubic(2))
               weight = [1.0_wp - by_fall, l - by_slope + by_fall*m, by_slope, by_fall]
            end associate
         end associate
      end associate
   end function continuation_at_stop

   !> Degrees of freedom counted on beyond the first node: -1 and 0 are those of the root.
   pure function with_root(counted, root_dofs) result(dofs)
      integer, intent(in) :: counted(:)
      !> 0: held
      integer, intent(in) :: root_dofs(2)
      integer :: dofs(size(counted))

      dofs = max(counted, 0)
      where (counted == -1) dofs = root_dofs(1)
      where (counted == 0) dofs = root_dofs(2)
   end function with_root

   !> Turn M into M'. The profile of M must reach from the node's neighbours to all that the continuation rests on; a
   !> point mass at the node comes after.
   pure subroutine redistribute(section, mesh, continuation, root_dofs, mass)
      type(section_t), intent(in) :: section
      type(mesh_t), intent(in) :: mesh
      type(continuation_t), intent(in) :: continuation
      !> Degrees of freedom of the root; 0: held
      integer, intent(in) :: root_dofs(2)
      !> M of the beam alone
      type(skyline_t), intent(inout) :: mass

      ! the node's row of M in the degrees of freedom of nodes c - 2 to c + 1, its own the fifth
      integer, parameter :: own = 5
      real(wp) :: column(8), difference(8), element(4, 4), change(8, 8)
      integer :: dofs(8), i, j

      associate (node => mesh%struck_node)
         dofs = with_root([(2*node - own + i, i=0, 7)], root_dofs)
         column = 0.0_wp
         element = element_mass(section, mesh%length(node), mesh%tip_distance(node))
         column(3:6) = element(:, 3)
         if (node < mesh%elements) then
            element = element_mass(section, mesh%length(node + 1), mesh%tip_distance(node + 1))
            column(5:8) = column(5:8) + element(:, 1)
         else
            dofs(7:8) = 0
         end if
      end associate
      difference = 0.0_wp
      difference(own) = 1.0_wp
      do i = 1, 4
         where (dofs == continuation%dof(i) .and. dofs > 0) difference = difference - continuation%weight(i)
      end do
      do j = 1, 8
         do i = 1, 8
            change(i, j) = column(own)*difference(i)*difference(j) - column(i)*difference(j) - difference(i)*column(j)
         end do
      end do
      ! to the last digit: nothing is left in the node's row
      change(:, own) = -column
      change(own, :) = -column
      call add_element(mass, dofs, change)
   end subroutine redistribute

end module redistributed_mass
