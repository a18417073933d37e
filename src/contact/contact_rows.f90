!> Contacts as rows of the degrees of freedom y: the gap of a contact is w . y - h, and its force f acts on the beam as
!> f w. Newmark's steps take each row to be one degree of freedom with a sign.
module contact_rows
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: contact_row_t, along, put_along, band

   !> Entries beside the diagonal of the beam's matrices: vectors are padded with as many zeros at both ends.
   integer, parameter :: band = 3

   !> w
   type :: contact_row_t
      integer :: dof = 0
      real(wp) :: sign = 1.0_wp
   end type contact_row_t

contains

   !> w . x
   pure function along(row, vector) result(value)
      type(contact_row_t), intent(in) :: row
      !> x, padded, [-2 : order + 3]
      real(wp), intent(in) :: vector(1 - band:)
      real(wp) :: value

      value = row%sign*vector(row%dof)
   end function along

   !> Make w . x what it must be but for rounding.
   pure subroutine put_along(row, value, vector)
      type(contact_row_t), intent(in) :: row
      real(wp), intent(in) :: value
      !> x, padded
      real(wp), intent(inout) :: vector(1 - band:)

      vector(row%dof) = row%sign*value
   end subroutine put_along

end module contact_rows
