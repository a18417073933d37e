!> The checksum CRC-32 of zlib: it detects any change within 32 successive bits, and misses one in 2^32 of other
!> changes.
module checksums
   use, intrinsic :: iso_c_binding, only: c_char, c_long, c_size_t
   use kinds, only: i8, wp
   implicit none (type, external)
   private
   public :: checksum, checksum_of_numbers

   interface
      !> zlib: the checksum of bytes that follow other bytes with the checksum `before`.
      pure function crc32_z(before, bytes, count) bind(c) result(sum)
         import :: c_char, c_long, c_size_t
         implicit none (type, external)
         integer(c_long), value :: before
         character(kind=c_char), intent(in) :: bytes(*)
         integer(c_size_t), value :: count
         integer(c_long) :: sum
      end function crc32_z
   end interface

contains

   !> The checksum of a sequence of bytes.
   pure integer(i8) function checksum(bytes) result(sum)
      character(*), intent(in) :: bytes

      sum = int(crc32_z(0_c_long, bytes, len(bytes, kind=c_size_t)), i8)
   end function checksum

   !> The checksum of the bytes of numbers.
   pure integer(i8) function checksum_of_numbers(numbers) result(sum)
      real(wp), intent(in) :: numbers(:)

      character(:), allocatable :: bytes

      allocate (character(size(numbers)*storage_size(numbers)/8) :: bytes)
      bytes(:) = transfer(numbers, bytes)
      sum = checksum(bytes)
   end function checksum_of_numbers

end module checksums
