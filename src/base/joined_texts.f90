!> Several texts as one, and the number of a letter in a text.
module joined_texts
   implicit none (type, external)
   private
   public :: joined, occurrences

contains

   !> Texts without trailing blanks, with a separator between them; empty if there are none.
   pure function joined(texts, separator) result(text)
      character(*), intent(in) :: texts(:)
      character(*), intent(in) :: separator
      character(:), allocatable :: text

      integer :: i

      text = ''
      do i = 1, size(texts)
         if (i > 1) text = text//separator
         text = text//trim(texts(i))
      end do
   end function joined

   !> How often a text contains a letter.
   pure integer function occurrences(letter, text)
      character(1), intent(in) :: letter
      character(*), intent(in) :: text

      integer :: i

      occurrences = 0
      do i = 1, len(text)
         if (text(i:i) == letter) occurrences = occurrences + 1
      end do
   end function occurrences

end module joined_texts
