!> A mass matrix in which the inertia of the node at the stop is redistributed to its neighbours (docs/theory.md,
!> section 14).
!>
!> The displacement y_c of that node has no inertia: in the kinetic energy y_c is replaced by t.y, an interpolation (at
!> the tip an extrapolation) of neighbouring degrees of freedom, called its continuation. The new mass matrix is T^T M T
!> with T = 1 - e_c d^T, d = e_c - t, and the unit vector e_c of the node. An impact then acts only on the point mass at
!> the node. This agrees with the continuous beam, whose distributed mass takes part in no impact (mass redistribution
!> method: Khenous, Laborde and Renard, Eur. J. Mech. A 27 (2008) 918).
module redistributed_mass
   use beam_element, only: element_mass, hermite_shape
   use beam_mesh, only: mesh_t
   use beam_section, only: section_t
   use kinds, only: wp
   use skyline_matrix, only: add_element, skyline_t
   implicit none (type, external)
   private
   public :: continuation_t, continuation_at_stop, redistribute

   !> The continuation y_c = sum weight y_dof, exact for motions that are polynomials of low degree around the node.
   type :: continuation_t
      !> Degrees of freedom from which the displacement is interpolated; 0: constrained at the root
      integer :: dof(4) = 0
      !> Weights of these degrees of freedom
      real(wp) :: weight(4) = 0.0_wp
   end type continuation_t

   !> Minimum length of the last but one element relative to the last element for a cubic continuation at the tip. On a
   !> shorter element the cubic would be ill-conditioned and T would amplify small differences.
   real(wp), parameter :: min_length_ratio = 0.5_wp

contains

   !> The continuation of the displacement at the stop. Between two elements it is the cubic through the displacements
   !> and slopes at their far ends; at the tip it is the cubic through the displacements of the two preceding nodes and
   !> the slopes of the last two nodes, or a parabola if the last but one element is missing or too short.
   pure type(continuation_t) function continuation_at_stop(mesh, root_dofs) result(continuation)
      type(mesh_t), intent(in) :: mesh
      !> Degrees of freedom of the root; 0: constrained
      integer, intent(in) :: root_dofs(2)

      real(wp) :: a_weight(2), b_weight(2), divisor
      integer :: node

      node = mesh%redistributed_node
      associate (l => mesh%length(node), dof => continuation%dof, weight => continuation%weight)
         if (node < mesh%elements) then
            associate (total => l + mesh%length(node + 1))
               dof = with_root([2*node - 3, 2*node - 2, 2*node + 1, 2*node + 2], root_dofs)
               weight = hermite_shape(l/total, total)
            end associate
            return
         end if
         dof = with_root([2*node - 3, 2*node - 2, 2*node, 2*node - 5], root_dofs)
         weight = [1.0_wp, 0.5_wp*l, 0.5_wp*l, 0.0_wp]
         if (node == 1) return
         associate (m => mesh%length(node - 1))
            if (m < min_length_ratio*l) return
            ! y = y1 + theta1 s + a s^2 + b s^3, with y1 and theta1 of the last node but one, at s = 0; the slope at the
            ! tip, s = l, and the displacement of the node at s = -m determine a and b
            divisor = m**2*(2.0_wp*m + 3.0_wp*l)
            ! weights in a and b of the slope at the tip minus theta1, and of the displacement at -m minus y1 - theta1 m
            a_weight = [m**3/l, 3.0_wp*l]/divisor
            b_weight = [m**2/l, -2.0_wp]/divisor
            associate (slope => l**2*a_weight(1) + l**3*b_weight(1), deviation => l**2*a_weight(2) + l**3*b_weight(2))
               weight = [1.0_wp - deviation, l - slope + deviation*m, slope, deviation]
            end associate
         end associate
      end associate
   end function continuation_at_stop

   !> Degrees of freedom from numbers in which -1 and 0 stand for y and dy/dx of the root.
   pure function with_root(numbers, root_dofs) result(dofs)
      integer, intent(in) :: numbers(:)
      !> Degrees of freedom of the root; 0: constrained
      integer, intent(in) :: root_dofs(2)
      integer :: dofs(size(numbers))

      dofs = max(numbers, 0)
      where (numbers == -1) dofs = root_dofs(1)
      where (numbers == 0) dofs = root_dofs(2)
   end function with_root

   !> Replace M by T^T M T. The profile of M must couple the neighbours of the node with all degrees of freedom of the
   !> continuation. Point masses at the node are added later.
   pure subroutine redistribute(section, mesh, continuation, root_dofs, mass)
      type(section_t), intent(in) :: section
      type(mesh_t), intent(in) :: mesh
      type(continuation_t), intent(in) :: continuation
      !> Degrees of freedom of the root; 0: constrained
      integer, intent(in) :: root_dofs(2)
      !> Mass matrix of the beam without point masses
      type(skyline_t), intent(inout) :: mass

      ! index of y_c among the degrees of freedom of nodes c - 2 to c + 1
      integer, parameter :: yc = 5
      ! column of M that belongs to y_c
      real(wp) :: column(8)
      ! the vector d
      real(wp) :: difference(8)
      ! mass matrix of an element
      real(wp) :: element(4, 4)
      ! T^T M T - M
      real(wp) :: change(8, 8)
      integer :: dofs(8), i, j

      associate (node => mesh%redistributed_node)
         dofs = with_root([(2*node - yc + i, i=0, 7)], root_dofs)
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
      difference(yc) = 1.0_wp
      do i = 1, 4
         where (dofs == continuation%dof(i) .and. dofs > 0) difference = difference - continuation%weight(i)
      end do
      ! T^T M T - M with T = 1 - e_c d^T and the column m = M e_c: m_c d d^T - m d^T - d m^T
      do j = 1, 8
         do i = 1, 8
            change(i, j) = column(yc)*difference(i)*difference(j) - column(i)*difference(j) - difference(i)*column(j)
         end do
      end do
      ! these entries are set directly, so that the row of the node in the sum is exactly zero
      change(:, yc) = -column
      change(yc, :) = -column
      call add_element(mass, dofs, change)
   end subroutine redistribute

end module redistributed_mass
