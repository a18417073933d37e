!> Memory that this process can still allocate (machine_memory_posix.c), and numbers of bytes in words.
module machine_memory
   use, intrinsic :: iso_c_binding, only: c_double
   use kinds, only: wp
   use number_text, only: to_text
   implicit none (type, external)
   private
   public :: free_memory, free_addresses, in_bytes

   interface
      !> Free memory and swap of this process within the limits of its control groups, in bytes; infinite: unknown.
      function free_memory() bind(c, name='impactbeam_free_memory') result(bytes)
         import :: c_double
         implicit none (type, external)
         real(c_double) :: bytes
      end function free_memory

      !> Free address space if it is limited (ulimit -v), in bytes; infinite: unlimited.
      function free_addresses() bind(c, name='impactbeam_free_addresses') result(bytes)
         import :: c_double
         implicit none (type, external)
         real(c_double) :: bytes
      end function free_addresses
   end interface

contains

   !> A number of bytes in words, such as '12.3 GB'.
   pure function in_bytes(bytes) result(words)
      real(wp), intent(in) :: bytes
      character(:), allocatable :: words

      real(wp), parameter :: megabyte = 1.0e6_wp, gigabyte = 1.0e9_wp, max_gigabytes = 1.0e9_wp
      character(16) :: digits

      if (bytes < gigabyte) then
         words = to_text(nint(bytes/megabyte))//' MB'
      else if (bytes < 100.0_wp*gigabyte) then
         write (digits, '(f0.1)') bytes/gigabyte
         words = trim(digits)//' GB'
      else
         words = to_text(nint(min(bytes/gigabyte, max_gigabytes)))//' GB'
      end if
   end function in_bytes

end module machine_memory
