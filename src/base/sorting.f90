!> Sorting of numbers.
module sorting
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: ascending_order, order_columns

contains

   !> Indices of numbers in ascending order; equal numbers keep their order. The numbers are divided into short runs.
   !> Each run is sorted by insertion, which compares a number first with the last number sorted, so that a run in
   !> ascending order needs one comparison per number. Sorted runs are then merged in pairs until one remains.
   pure function ascending_order(values) result(order)
      real(wp), intent(in) :: values(:)
      integer :: order(size(values))

      ! length of a run that is sorted by insertion
      integer, parameter :: run_length = 64
      integer :: first, i, length, place

      do i = 1, size(values)
         first = i - modulo(i - 1, run_length)
         do place = i, first + 1, -1
            if (values(order(place - 1)) <= values(i)) exit
            order(place) = order(place - 1)
         end do
         order(place) = i
      end do
      length = run_length
      do while (length < size(values))
         do first = 1, size(values) - length, 2*length
            call merge_runs(values, order(first:min(first + 2*length - 1, size(values))), length)
         end do
         length = 2*length
      end do
   end function ascending_order

   !> Merge two sorted lists of indices of which the second follows the first.
   pure subroutine merge_runs(values, order, length)
      real(wp), intent(in) :: values(:)
      integer, intent(inout) :: order(:)
      !> Length of the first list
      integer, intent(in) :: length

      integer, allocatable :: first(:)
      integer :: i, k, place

      if (values(order(length)) <= values(order(length + 1))) return
      allocate (first, source=order(:length))
      i = 1
      k = length + 1
      do place = 1, size(order)
         if (i > length) exit
         if (k > size(order)) then
            order(place) = first(i)
            i = i + 1
         else if (values(first(i)) <= values(order(k))) then
            order(place) = first(i)
            i = i + 1
         else
            order(place) = order(k)
            k = k + 1
         end if
      end do
   end subroutine merge_runs

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
