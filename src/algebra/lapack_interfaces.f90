!> Explicit interfaces of the LAPACK and BLAS routines that the program calls, and their `info` as a message; procedures
!> that keep BLAS in the calling thread and report the memory that OpenBLAS takes (blas_threads.c).
module lapack_interfaces
   use, intrinsic :: iso_c_binding, only: c_long_long
   use kinds, only: wp
   use number_text, only: to_text
   implicit none (type, external)
   private
   public :: dsygv, dgejsv, dpotrf, dstevd, dgesv, dgeev, dgemm, dgemv, dtrsm, lapack_message, single_threaded_blas, &
      blas_buffer

   interface
      !> From now on the BLAS library starts no threads.
      subroutine single_threaded_blas() bind(c, name='impactbeam_single_threaded_blas')
         implicit none (type, external)
      end subroutine single_threaded_blas

      !> Address space that OpenBLAS takes for each thread, bytes; 0: another library.
      function blas_buffer() bind(c, name='impactbeam_blas_buffer') result(bytes)
         import :: c_long_long
         implicit none (type, external)
         integer(c_long_long) :: bytes
      end function blas_buffer
   end interface

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
      !> Singular values to high relative accuracy, and on request singular vectors, by one-sided Jacobi rotations; the
      !> singular values are s work(1)/work(2).
      subroutine dgejsv(joba, jobu, jobv, jobr, jobt, jobp, m, n, a, lda, s, u, ldu, v, ldv, work, lwork, iwork, info)
         import :: wp
         implicit none (type, external)
         character, intent(in) :: joba, jobu, jobv, jobr, jobt, jobp
         integer, intent(in) :: m, n, lda, ldu, ldv, lwork
         real(wp), intent(inout) :: a(lda, *)
         real(wp), intent(out) :: s(*), u(ldu, *), v(ldv, *), work(*)
         integer, intent(out) :: iwork(*), info
      end subroutine dgejsv
      !> Cholesky factor of a symmetric matrix, in place.
      subroutine dpotrf(uplo, n, a, lda, info)
         import :: wp
         implicit none (type, external)
         character, intent(in) :: uplo
         integer, intent(in) :: n, lda
         real(wp), intent(inout) :: a(lda, *)
         integer, intent(out) :: info
      end subroutine dpotrf
      !> Eigenvalues, and on request eigenvectors, of a symmetric tridiagonal matrix.
      subroutine dstevd(jobz, n, d, e, z, ldz, work, lwork, iwork, liwork, info)
         import :: wp
         implicit none (type, external)
         character, intent(in) :: jobz
         integer, intent(in) :: n, ldz, lwork, liwork
         real(wp), intent(inout) :: d(*), e(*)
         real(wp), intent(out) :: z(ldz, *), work(*)
         integer, intent(out) :: iwork(*), info
      end subroutine dstevd
      !> Solve A X = B. X replaces B; the factors of A replace A.
      subroutine dgesv(n, nrhs, a, lda, ipiv, b, ldb, info)
         import :: wp
         implicit none (type, external)
         integer, intent(in) :: n, nrhs, lda, ldb
         real(wp), intent(inout) :: a(lda, *), b(ldb, *)
         integer, intent(out) :: ipiv(*), info
      end subroutine dgesv
      !> Eigenvalues, and on request eigenvectors, of a general matrix.
      subroutine dgeev(jobvl, jobvr, n, a, lda, wr, wi, vl, ldvl, vr, ldvr, work, lwork, info)
         import :: wp
         implicit none (type, external)
         character, intent(in) :: jobvl, jobvr
         integer, intent(in) :: n, lda, ldvl, ldvr, lwork
         real(wp), intent(inout) :: a(lda, *)
         real(wp), intent(out) :: wr(*), wi(*), vl(ldvl, *), vr(ldvr, *), work(*)
         integer, intent(out) :: info
      end subroutine dgeev
      !> C = alpha op(A) op(B) + beta C
      pure subroutine dgemm(transa, transb, m, n, k, alpha, a, lda, b, ldb, beta, c, ldc)
         import :: wp
         implicit none (type, external)
         character, intent(in) :: transa, transb
         integer, intent(in) :: m, n, k, lda, ldb, ldc
         real(wp), intent(in) :: alpha, beta, a(lda, *), b(ldb, *)
         real(wp), intent(inout) :: c(ldc, *)
      end subroutine dgemm
      !> y = alpha op(A) x + beta y
      subroutine dgemv(trans, m, n, alpha, a, lda, x, incx, beta, y, incy)
         import :: wp
         implicit none (type, external)
         character, intent(in) :: trans
         integer, intent(in) :: m, n, lda, incx, incy
         real(wp), intent(in) :: alpha, beta, a(lda, *), x(*)
         real(wp), intent(inout) :: y(*)
      end subroutine dgemv
      !> X op(A) = alpha B or op(A) X = alpha B, A triangular; X replaces B
      subroutine dtrsm(side, uplo, transa, diag, m, n, alpha, a, lda, b, ldb)
         import :: wp
         implicit none (type, external)
         character, intent(in) :: side, uplo, transa, diag
         integer, intent(in) :: m, n, lda, ldb
         real(wp), intent(in) :: alpha, a(lda, *)
         real(wp), intent(inout) :: b(ldb, *)
      end subroutine dtrsm
   end interface

contains

   !> LAPACK's `info` in words.
   pure function lapack_message(routine, info, order) result(message)
      !> Name of the routine
      character(*), intent(in) :: routine
      !> Value of `info` that the routine returned, not 0
      integer, intent(in) :: info
      !> Order of the problem; an `info` of DSYGV above it refers to the mass matrix
      integer, intent(in) :: order
      character(:), allocatable :: message

      if (info < 0) then
         message = routine//' was called with an illegal value of argument '//to_text(-info)
      else if (info > order .and. routine == 'DSYGV') then
         message = 'DSYGV: the mass matrix is not positive definite (leading minor '//to_text(info - order)//')'
      else if (routine == 'DPOTRF') then
         message = 'the mesh is too uneven: shape '//to_text(info)// &
            ' of its modes is not independent of those before it in double precision (DPOTRF)'
      else
         message = routine//' did not converge (info = '//to_text(info)//')'
      end if
   end function lapack_message


end module lapack_interfaces
