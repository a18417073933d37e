!> Keeps linear algebra in the calling thread, and reports the memory that OpenBLAS takes (blas_threads.c).
module blas_threads
   use, intrinsic :: iso_c_binding, only: c_long_long
   implicit none (type, external)
   private
   public :: single_threaded_blas, blas_buffer

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

end module blas_threads
