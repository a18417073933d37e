!> Initialisation of the HDF5 library, and the type of texts, which writing and loading share.
module hdf5_library
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_null_char, c_ptr
   use hdf5, only: h5dont_atexit_f, h5eset_auto_f, h5open_f, h5t_cset_utf8_f, h5t_string, h5tcopy_f, h5tset_cset_f, &
      hid_t
   implicit none (type, external)
   private
   public :: open_hdf5, make_text_type, c_free

   !> Whether the library has been initialised; each further initialisation would leave copies of its types behind
   logical :: is_open = .false.

   interface
      !> POSIX: set an environment variable. If `overwrite` is 0, a variable that is set already keeps its value.
      function posix_setenv(name, value, overwrite) bind(c, name='setenv') result(status)
         import :: c_char, c_int
         implicit none (type, external)
         character(kind=c_char), intent(in) :: name(*)
         character(kind=c_char), intent(in) :: value(*)
         integer(c_int), value :: overwrite
         integer(c_int) :: status
      end function posix_setenv

      !> C: free memory, here of a text that HDF5 has read.
      subroutine c_free(address) bind(c, name='free')
         import :: c_ptr
         implicit none (type, external)
         type(c_ptr), value :: address
      end subroutine c_free
   end interface

contains

   !> Initialise the library at the first call.
   subroutine open_hdf5(status)
      !> Status that HDF5 returned; negative is a failure
      integer, intent(out) :: status

      integer :: ignored_status

      status = 0
      ! HDF5's file locking is switched off because it prevents opening files on disks without locks; the program locks
      ! results files itself.
      if (.not. is_open) then
         ignored_status = posix_setenv('HDF5_USE_FILE_LOCKING'//c_null_char, 'FALSE'//c_null_char, 0_c_int)
         ! At the end of the program HDF5 would write again what a full disk has refused, from memory that is freed
         ! already. The callers close all files, so nothing is left to do then.
         call h5dont_atexit_f(ignored_status)
         call h5open_f(status)
      end if
      is_open = status == 0
      ! HDF5's own error messages are switched off because the callers report failures. The setting belongs to a thread,
      ! so each calling thread must set it.
      call h5eset_auto_f(0, ignored_status)
   end subroutine open_hdf5

   !> Make the HDF5 type of texts: UTF-8 of variable length.
   subroutine make_text_type(type_id, status)
      !> Identifier of the type, which the caller closes
      integer(hid_t), intent(out) :: type_id
      !> Status that HDF5 returned; negative is a failure
      integer, intent(out) :: status

      ! h5t_string is already of variable length and ends with a null character as in C.
      call h5tcopy_f(h5t_string, type_id, status)
      if (status >= 0) call h5tset_cset_f(type_id, h5t_cset_utf8_f, status)
   end subroutine make_text_type

end module hdf5_library
