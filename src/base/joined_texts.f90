!> Several texts as one.
module joined_texts
   implicit none (type, external)
   private
   public :: joined

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

end module joined_texts
