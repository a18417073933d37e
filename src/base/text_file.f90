!> A whole text file in one string.
module text_file
   use, intrinsic :: iso_fortran_env, only: iostat_end
   use number_text, only: to_text
   implicit none (type, external)
   private
   public :: load_text

   !> Longest file that is read, bytes: far beyond any scene.
   integer, parameter :: longest_file = 2**25

contains

   !> Read a file, or a pipe up to its end.
   subroutine load_text(file, text, problem)
      character(*), intent(in) :: file
      !> What is in it
      character(:), allocatable, intent(out) :: text
      !> What went wrong; unallocated: nothing
      character(:), allocatable, intent(out) :: problem

      character(256) :: reason
      integer :: unit, status, length
      logical :: is_there, is_directory

      if (len_trim(file) == 0) then
         problem = 'no file name'
         return
      end if
      ! Opening a directory succeeds in some run-time libraries
      inquire (file=trim(file)//'/.', exist=is_directory)
      inquire (file=file, exist=is_there)
      if (is_directory) then
         problem = 'is a directory, not a text file'
         return
      else if (.not. is_there) then
         problem = 'no such file'
         return
      end if

      open (newunit=unit, file=file, status='old', action='read', access='stream', form='unformatted', &
         iostat=status, iomsg=reason)
      if (status /= 0) then
         problem = 'cannot be opened: '//trim(reason)
         return
      end if
      inquire (unit=unit, size=length)
      if (length > longest_file) then
         problem = 'is too long: '//to_text(length)//' bytes, at most '//to_text(longest_file)//' are read'
      else if (length > 0) then
         allocate (character(length) :: text)
         read (unit, iostat=status, iomsg=reason) text
      else
         call load_stream(unit, text, status, reason)
         if (status == 0) problem = 'is too long: at most '//to_text(longest_file)//' bytes are read'
      end if
      close (unit)
      if (allocated(problem)) return
      if (status /= 0 .and. status /= iostat_end) then
         problem = 'cannot be read: '//trim(reason)
      else if (len(text) == 0) then
         problem = 'the file is empty'
      else if (index(text, achar(0)) > 0) then
         problem = 'is not a text file'
      end if
   end subroutine load_text

   !> Read byte by byte what has no size that is known: a pipe.
   subroutine load_stream(unit, text, status, reason)
      integer, intent(in) :: unit
      !> What is in it
      character(:), allocatable, intent(out) :: text
      !> The end was met, or why the reading ended; 0: at the longest length
      integer, intent(out) :: status
      character(*), intent(inout) :: reason

      character(:), allocatable :: larger
      character(1) :: byte
      integer :: length

      allocate (character(4096) :: text)
      length = 0
      do
         read (unit, iostat=status, iomsg=reason) byte
         if (status /= 0 .or. length == longest_file) exit
         if (length == len(text)) then
            allocate (character(2*length) :: larger)
            larger(:length) = text
            call move_alloc(larger, text)
         end if
         length = length + 1
         text(length:length) = byte
      end do
      text = text(:length)
   end subroutine load_stream

end module text_file
