!> A unit to print to, and what was printed there, for tests.
module printed_lines
   implicit none (type, external)
   private
   public :: open_paper, close_paper, printed, line_of, words_of, line_length, unit

   integer, parameter :: line_length = 200
   !> Open between `open_paper` and `close_paper`
   integer, protected :: unit

contains

   subroutine open_paper()
      open (newunit=unit, status='scratch', action='readwrite')
   end subroutine open_paper

   subroutine close_paper()
      close (unit)
   end subroutine close_paper

   !> Line by line.
   function printed() result(lines)
      character(line_length), allocatable :: lines(:)

      character(line_length) :: line
      integer :: status

      allocate (lines(0))
      rewind (unit)
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         lines = [lines, line]
      end do
      ! more may follow
      backspace (unit)
   end function printed

   !> The first line that begins with a label, without blanks at its ends; '(none)' if there is none.
   function line_of(label) result(line)
      character(*), intent(in) :: label
      character(:), allocatable :: line

      character(line_length), allocatable :: lines(:)
      integer :: i

      line = '(none)'
      lines = printed()
      do i = 1, size(lines)
         if (index(adjustl(lines(i)), label) /= 1) cycle
         line = trim(adjustl(lines(i)))
         return
      end do
   end function line_of

   !> The words of the first line that begins with some words, one blank between any two; '(none)' if there is none.
   function words_of(label) result(words)
      character(*), intent(in) :: label
      character(:), allocatable :: words

      character(line_length), allocatable :: lines(:)
      integer :: i

      lines = printed()
      do i = 1, size(lines)
         words = single_blanks(trim(adjustl(lines(i))))
         if (index(words, label) == 1) return
      end do
      words = '(none)'
   end function words_of

   pure function single_blanks(text) result(words)
      character(*), intent(in) :: text
      character(:), allocatable :: words

      integer :: i

      words = ''
      do i = 1, len(text)
         if (text(i:i) == ' ' .and. i > 1) then
            if (text(i - 1:i - 1) == ' ') cycle
         end if
         words = words//text(i:i)
      end do
   end function single_blanks

end module printed_lines
