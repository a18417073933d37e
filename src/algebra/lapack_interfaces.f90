!> Explicit interfaces of the LAPACK and BLAS routines that the program calls, and what their `info` means.
module lapack_interfaces
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: dsygv, lapack_message

   interface
      !> All eigenvalues, and on request eigenvectors, of A x = lambda B x, A symmetric, B positive definite.
      subroutine dsygv(itype, jobz, uplo, n, a, lda, b, ldb, w, work, lwork, info)
         import :: wp
         implicit none (type, external)
         integer, intent(in) :: itype, n, lda, ldb, lwork
         character, intent(in) :: jobz, uplo
         real(wp), intent(inout) :: a(lda, *), b(ldb, *)
         real(wp), intent(out) :: w(*), work(*)
         integer, intent(out) :: info
      end subroutine dsygv
   end interface

contains

   !> LAPACK's `info` in words.
   pure function lapack_message(routine, info, order) result(message)
      !> Name of the routine
      character(*), intent(in) :: routine
      !> What it returned, not 0
      integer, intent(in) :: info
      !> Order of the problem; for DSYGV an `info` above it blames the mass matrix
      integer, intent(in) :: order
      character(:), allocatable :: message

      character(12) :: number

      if (info < 0) then
         write (number, '(i0)') -info
         message = routine//' was called with an illegal value of argument '//trim(number)
      else if (info > order .and. routine == 'DSYGV') then
         write (number, '(i0)') info - order
         message = 'DSYGV: the mass matrix is not positive definite (leading minor '//trim(number)//')'
      else
         write (number, '(i0)') info
         message = routine//' did not converge (info = '//trim(number)//')'
      end if
   end function lapack_message

end module lapack_interfaces
