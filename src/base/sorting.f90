!> Sorting of numbers.
module sorting
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: ascending_order, order_columns

contains

   !> Indices of numbers in ascending order; equal numbers stay in their order. Insertion sort from the end, which needs
   !> one comparison per number if they are already in order.
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

   !> Reorder the columns of a matrix, one by one, because gfortran would put a temporary of the whole matrix on the
   !> stack.
   pure subroutine order_columns(matrix, order)
      real(wp), allocatable, intent(inout) :: matrix(:, :)
      !> Index in the old matrix of each new column
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
