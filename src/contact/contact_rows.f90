!> Contacts for Newmark's method. The row w of a contact is a linear functional of the degrees of freedom y: the gap is
!> w . y - h, with h the height of the contact surface, and the contact force f acts on the beam as the load vector f w.
!> Each row has one entry, a degree of freedom with a sign, or two if the beam meets a body that moves.
module contact_rows
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: contact_row_t, row_value, set_row_value, band

   !> Half bandwidth of the beam's matrices: vectors are padded with as many zeros at both ends.
   integer, parameter :: band = 3

   !> The row w, with the sign s at the degree of freedom `dof`: s = 1 for a contact below the beam, -1 for one above
   !> it. If the beam meets a body there, the row has -s at the degree of freedom of the body.
   type :: contact_row_t
      !> Index of the degree of freedom
      integer :: dof = 0
      real(wp) :: sign = 1.0_wp
      !> Index of the degree of freedom of the body; 0, an entry of the padding, which is zero: no body moves
      integer :: body = 0
   end type contact_row_t

contains

   !> Value w . x of the row for a vector of degrees of freedom: the component of the vector normal to the contact.
   pure function row_value(row, vector) result(value)
      type(contact_row_t), intent(in) :: row
      !> x, padded, [-2 : order + 3]
      real(wp), intent(in) :: vector(1 - band:)
      real(wp) :: value

      value = row%sign*(vector(row%dof) - vector(row%body))
   end function row_value

   !> Set w . x to an exact value, or to rounding if the beam meets a body, whose entry is then set; before, w . x
   !> differs from the value by rounding errors only.
   pure subroutine set_row_value(row, value, vector)
      type(contact_row_t), intent(in) :: row
      real(wp), intent(in) :: value
      !> x, padded
      real(wp), intent(inout) :: vector(1 - band:)

      if (row%body > 0) then
         vector(row%body) = vector(row%dof) - row%sign*value
      else
         vector(row%dof) = row%sign*value
      end if
   end subroutine set_row_value

end module contact_rows
