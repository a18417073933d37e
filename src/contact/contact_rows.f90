!> Contacts for Newmark's method. The row w of a contact is a linear functional of the state vector y: the gap is
!> w . y - s d, with s = 1 for a contact below the beam, s = -1 for a contact above the beam, and d the coordinate of
!> the contact surface (between beam and body: the displacement of the beam relative to the body at which both touch).
!> A row has one nonzero entry, s, at a point of the beam, or at a body that meets its floor or ceiling; or two entries,
!> s and -s, if the beam meets a body.
!>
!> If the degrees of freedom are those of nodes, the contact force f acts as the load vector f w. If they are modes, the
!> entries of w belong to the points that follow the modes in a state vector (module `modal_steps`), and the load vector
!> is f times the row over the modes, `modal_row` of `newmark_stepper`.
module contact_rows
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: contact_row_t, row_value, set_row_value, band

   !> Half bandwidth of the beam's matrices: vectors are padded with as many zeros at both ends.
   integer, parameter :: band = 3

   !> The row w: s at the entry `dof` of a state vector, and -s at the entry `body` if the beam meets a body.
   type :: contact_row_t
      !> Entry of the point of the beam; at floor and ceiling of a body, entry of the body
      integer :: dof = 0
      !> s
      real(wp) :: sign = 1.0_wp
      !> Entry of the body that the beam meets. 0: the beam, or the body at its floor or ceiling, meets a fixed surface;
      !> entry 0 of a padded vector is zero
      integer :: partner = 0
   end type contact_row_t

contains

   !> Value w . vector: the displacement, velocity or acceleration of the beam relative to the body or the surface that
   !> the beam meets, positive away from the contact.
   pure real(wp) function row_value(row, vector) result(value)
      type(contact_row_t), intent(in) :: row
      !> Displacements, velocities or accelerations, padded with zeros, [-2 : n + 3] with n entries
      real(wp), intent(in) :: vector(1 - band:)

      value = row%sign*(vector(row%dof) - vector(row%partner))
   end function row_value

   !> Set w . vector to a value from which it differs by rounding errors only. If the beam meets a body, the entry of
   !> the body is set, because a closed stop at the same point may have set that of the beam; w . vector then has the
   !> value up to one rounding. Otherwise the entry of the beam is set, and w . vector has the value exactly.
   pure subroutine set_row_value(row, value, vector)
      type(contact_row_t), intent(in) :: row
      real(wp), intent(in) :: value
      !> Displacements, velocities or accelerations, padded with zeros
      real(wp), intent(inout) :: vector(1 - band:)

      if (row%partner > 0) then
         vector(row%partner) = vector(row%dof) - row%sign*value
      else
         vector(row%dof) = row%sign*value
      end if
   end subroutine set_row_value

end module contact_rows
