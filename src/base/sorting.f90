!> The order of numbers.
module sorting
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: ascending_order, order_columns

contains

   !> Places of numbers from the least to the greatest; of equal ones the first stays the first. By insertion from the
   !> end: a list that is in order costs one look at each.
   pure function ascending_order(values) result(order)
      real(wp), intent(in) :: values(:)
      integer :: order(size(values))

      integer :: i, place

      do i = 1, size(values)
         do place = i, 2, -1
            if (values(order(place - 1)) <= values(i)) exit
            order(place) = order(place - 1)
         end do
         order(place) = i
      end do
   end function ascending_order

   !> Columns of a matrix in another order, one by one: gfortran would put a temporary of all on the stack.
   pure subroutine order_columns(matrix, order)
      real(wp), allocatable, intent(inout) :: matrix(:, :)
      !> Where each of the new columns stands
      integer, intent(in) :: order(:)

      real(wp), allocatable :: ordered(:, :)
      integer :: k

      allocate (ordered(size(matrix, 1), size(order)))
      do k = 1, size(order)
         ordered(:, k) = matrix(:, order(k))
      end do
      call move_alloc(ordered, matrix)
   end subroutine order_columns

end module sorting
