!> Linear algebra in the thread that calls it, and what OpenBLAS takes for that (blas_threads.c).
module blas_threads
   use, intrinsic :: iso_c_binding, only: c_long_long
   implicit none (type, external)
   private
   public :: single_threaded_blas, blas_buffer

   interface
      !> No threads of its own, from now on.
      subroutine single_threaded_blas() bind(c, name='impactbeam_single_threaded_blas')
         implicit none (type, external)
      end subroutine single_threaded_blas

      !> Address space that each thread takes, bytes.
      function blas_buffer() bind(c, name='impactbeam_blas_buffer') result(bytes)
         import :: c_long_long
         implicit none (type, external)
         integer(c_long_long) :: bytes
      end function blas_buffer
   end interface

end module blas_threads
