!> Singular values and right singular vectors of a matrix by LAPACK's DGEJSV, whose relative errors are small even for
!> the smallest singular values.
module singular_vectors
   use, intrinsic :: ieee_exceptions, only: ieee_all, ieee_get_halting_mode, ieee_set_flag, ieee_set_halting_mode
   use kinds, only: wp
   use lapack_interfaces, only: dgejsv
   implicit none (type, external)
   private
   public :: find_singular

contains

   !> Find the singular values, descending, and the right singular vectors of a matrix with at least as many rows as
   !> columns.
   subroutine find_singular(matrix, with_vectors, singular, vectors, info)
      !> Matrix, [rows, columns]
      real(wp), intent(in) :: matrix(:, :)
      !> Whether to compute the singular vectors
      logical, intent(in) :: with_vectors
      !> Singular values, [columns]
      real(wp), allocatable, intent(out) :: singular(:)
      !> Right singular vectors as columns, [columns, columns]; [1, 1] if not requested
      real(wp), allocatable, intent(out) :: vectors(:, :)
      !> 0: found, otherwise the error code of DGEJSV
      integer, intent(out) :: info

      real(wp), allocatable :: copy(:, :), work(:)
      integer, allocatable :: integer_work(:)
      ! the exceptions that halt the program; debug builds enable them
      logical :: halting(size(ieee_all))
      real(wp) :: left(1, 1)
      integer :: columns, rows

      rows = size(matrix, 1)
      columns = size(matrix, 2)
      allocate (copy, source=matrix)
      allocate (singular(columns))
      allocate (integer_work(max(3, rows + 3*columns)))
      ! DGEJSV scales by numbers that may overflow, then tests the result
      call ieee_get_halting_mode(ieee_all, halting)
      if (any(halting)) call ieee_set_halting_mode(ieee_all, .false.)
      if (with_vectors) then
         allocate (vectors(columns, columns), work(max(7, 2*rows + columns, 6*columns + 2*columns**2)))
         call dgejsv('F', 'N', 'V', 'N', 'N', 'N', rows, columns, copy, rows, singular, left, 1, &
            vectors, columns, work, size(work), integer_work, info)
      else
         allocate (vectors(1, 1), work(max(7, 2*rows + columns, 34*columns + 1)))
         call dgejsv('F', 'N', 'N', 'N', 'N', 'N', rows, columns, copy, rows, singular, left, 1, &
            vectors, 1, work, size(work), integer_work, info)
      end if
      call ieee_set_flag(ieee_all, .false.)
      if (any(halting)) call ieee_set_halting_mode(ieee_all, halting)
      ! DGEJSV scales the singular values to avoid overflow
      if (info == 0) singular = singular*(work(1)/work(2))
   end subroutine find_singular

end module singular_vectors
