!> Loading of a complete text file into one string.
module text_file
   use file_system, only: load_bytes
   implicit none (type, external)
   private
   public :: load_text

   !> Maximum size in bytes of a file that is read, far beyond any scene.
   integer, parameter :: max_file_size = 2**25
   !> Byte order mark, with which some editors start a UTF-8 file
   character(*), parameter :: byte_order_mark = char(239)//char(187)//char(191)

contains

   !> Read a regular file, or the file to which a link leads. A byte order mark at its beginning is left out.
   subroutine load_text(file, text, problem)
      character(*), intent(in) :: file
      !> Content of the file
      character(:), allocatable, intent(out) :: text
      !> Reason of a failure; unallocated: the file was read
      character(:), allocatable, intent(out) :: problem

      logical :: is_there, is_directory

      if (len_trim(file) == 0) then
         problem = 'no file name'
         return
      end if
      ! only a directory contains '.'
      inquire (file=trim(file)//'/.', exist=is_directory)
      inquire (file=file, exist=is_there)
      if (is_directory) then
         problem = 'is a directory, not a text file'
         return
      else if (.not. is_there) then
         problem = 'no such file'
         return
      end if

      call load_bytes(file, follow_links=.true., max_length=max_file_size, bytes=text, problem=problem)
      if (allocated(problem)) then
         problem = 'cannot be read: '//problem
         return
      end if
      if (index(text, byte_order_mark) == 1) text = text(len(byte_order_mark) + 1:)
      if (len(text) == 0) then
         problem = 'the file is empty'
      else if (index(text, achar(0)) > 0) then
         problem = 'is not a text file'
      end if
   end subroutine load_text

end module text_file
