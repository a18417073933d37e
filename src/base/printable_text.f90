!> Texts: the part that a terminal can show, UTF-8 characters without control characters; several texts as one; and the
!> number of a letter in a text.
module printable_text
   implicit none (type, external)
   private
   public :: character_count, excerpt, joined, occurrences

contains

   !> Number of bytes of the first character of a text; 0: the text begins with a control character or is not UTF-8.
   pure integer function character_bytes(text) result(bytes)
      !> The text, not empty
      character(*), intent(in) :: text

      ! Range of the bytes after the first; the range of the second byte depends on the first
      integer, parameter :: min_code = 128, max_code = 191
      ! Other second bytes encode overlong forms, surrogates or numbers beyond Unicode
      integer :: second_min, second_max, i

      second_min = min_code
      second_max = max_code
      select case (ichar(text(1:1)))
      case (32:126)
         bytes = 1
      case (194)
         ! The first 32 of these codes are control characters
         bytes = 2
         second_min = 160
      case (195:223)
         bytes = 2
      case (224)
         bytes = 3
         second_min = 160
      case (237)
         bytes = 3
         second_max = 159
      case (225:236, 238:239)
         bytes = 3
      case (240)
         bytes = 4
         second_min = 144
      case (244)
         bytes = 4
         second_max = 143
      case (241:243)
         bytes = 4
      case default
         bytes = 0
      end select
      if (bytes > len(text)) bytes = 0
      do i = 2, bytes
         associate (code => ichar(text(i:i)))
            if (code < second_min .or. code > second_max) bytes = 0
         end associate
         second_min = min_code
         second_max = max_code
      end do
   end function character_bytes

   !> Number of characters; -1: some characters cannot be shown.
   pure integer function character_count(text) result(count)
      character(*), intent(in) :: text

      integer :: i, bytes

      count = 0
      i = 1
      do while (i <= len(text))
         bytes = character_bytes(text(i:))
         if (bytes == 0) then
            count = -1
            return
         end if
         count = count + 1
         i = i + bytes
      end do
   end function character_count

   !> The start of a text for one line of a message: up to the end of the line, at most 40 characters, with a question
   !> mark for each byte that cannot be shown.
   pure function excerpt(text) result(short)
      character(*), intent(in) :: text
      character(:), allocatable :: short

      integer, parameter :: max_characters = 40
      integer :: i, count, last, bytes

      last = index(text, achar(10)) - 1
      if (last < 0) last = len(text)
      last = len_trim(text(:last))
      short = ''
      i = 1
      do count = 1, max_characters
         if (i > last) return
         bytes = character_bytes(text(i:last))
         if (bytes == 0) then
            short = short//'?'
         else
            short = short//text(i:i + bytes - 1)
         end if
         i = i + max(bytes, 1)
      end do
      if (i <= last) short = short//'...'
   end function excerpt

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

end module printable_text
