!> The tokens of a namelist file: group names, words, texts in quotes, and the separators , = /. All procedures that
!> read tokens require a text that ends with a newline, as from `normalise_lines`.
module namelist_tokens
   use printable_text, only: excerpt
   implicit none (type, external)
   private
   public :: cursor_t, value_t, advance, next_is_equals, is_name, normalise_lines, lower_case, slice
   public :: token_end, token_group, token_slash, token_comma, token_equals, token_value

   character(1), parameter :: newline = achar(10)
   character(1), parameter :: carriage_return = achar(13)
   character(1), parameter :: tab = achar(9)
   character(*), parameter :: blanks = ' '//tab//newline
   !> Characters that end a word
   character(*), parameter :: word_end = blanks//',/!=''"'
   character(*), parameter :: letters = 'abcdefghijklmnopqrstuvwxyz'
   character(*), parameter :: capitals = 'ABCDEFGHIJKLMNOPQRSTUVWXYZ'
   character(*), parameter :: digits = '0123456789'

   !> Kinds of token
   integer, parameter :: token_end = 1
   integer, parameter :: token_group = 2
   integer, parameter :: token_slash = 3
   integer, parameter :: token_comma = 4
   integer, parameter :: token_equals = 5
   integer, parameter :: token_value = 6

   !> One value, or `repeat` equal values.
   type :: value_t
      !> First position in the text, without repeat count and quotes
      integer :: first = 1
      !> Last position, without quotes
      integer :: last = 0
      !> First position, with repeat count and quotes
      integer :: outer_first = 1
      !> Last position, with quotes
      integer :: outer_last = 0
      !> r of r*value
      integer :: repeat = 1
      !> Whether the value is in quotes
      logical :: is_quoted = .false.
   end type value_t

   !> Position in the text, and the token that was read last; a word is a value or the name of an item
   type :: cursor_t
      !> Position of the next character
      integer :: next = 1
      !> Line of the next character
      integer :: line = 1
      !> Kind of the token: one of the `token_` constants
      integer :: kind = token_end
      !> First position of the token
      integer :: first = 1
      !> Line of the token
      integer :: token_line = 1
      !> Whether the token is the first in its line
      logical :: starts_line = .true.
      !> The name of a group, a word, or a text in quotes
      type(value_t) :: value
   end type cursor_t

contains

   !> Read the next token; blanks and comments are skipped.
   subroutine advance(text, cursor, problem)
      character(*), intent(in) :: text
      !> On entry at the previous token; on return at the next one
      type(cursor_t), intent(inout) :: cursor
      character(:), allocatable, intent(inout) :: problem

      ! true only at the beginning of the text; `skip_blanks` sets it if a line begins among the blanks
      cursor%starts_line = cursor%starts_line .and. cursor%next == 1
      call skip_blanks(text, cursor%next, cursor%line, cursor%starts_line)
      cursor%first = cursor%next
      cursor%token_line = cursor%line
      cursor%value = value_t()
      if (cursor%next > len(text)) then
         cursor%kind = token_end
         ! the newline at the end of the text begins no new line
         cursor%token_line = max(1, cursor%line - 1)
         return
      end if

      cursor%next = cursor%next + 1
      select case (text(cursor%first:cursor%first))
      case (',')
         cursor%kind = token_comma
      case ('=')
         cursor%kind = token_equals
      case ('/')
         cursor%kind = token_slash
      case ('&')
         cursor%kind = token_group
         call read_group_name(text, cursor, problem)
      case ("'", '"')
         cursor%kind = token_value
         call read_quoted(text, cursor, problem)
      case default
         cursor%kind = token_value
         call read_word(text, cursor, problem)
      end select
      cursor%value%outer_first = cursor%first
      cursor%value%outer_last = cursor%next - 1
   end subroutine advance

   !> Read the name of a group after its &.
   subroutine read_group_name(text, cursor, problem)
      character(*), intent(in) :: text
      !> On entry after the &
      type(cursor_t), intent(inout) :: cursor
      character(:), allocatable, intent(inout) :: problem

      integer :: last

      last = word_last(text, cursor%next)
      cursor%value%first = cursor%next
      cursor%value%last = last
      if (last < cursor%next) then
         problem = '&: a name must follow at once'
      else if (.not. is_name(text(cursor%next:last))) then
         problem = excerpt(text(cursor%first:last))//': a group name is made of letters, digits and _'
      else if (scan(text(last + 1:last + 1), blanks//'/!') == 0) then
         problem = excerpt(text(cursor%first:last))//': a blank must follow the name of a group'
      end if
      cursor%next = last + 1
   end subroutine read_group_name

   !> Read a text in quotes, which must end in its line; a doubled quote stands for one quote.
   subroutine read_quoted(text, cursor, problem)
      character(*), intent(in) :: text
      !> On entry after the opening quote
      type(cursor_t), intent(inout) :: cursor
      character(:), allocatable, intent(inout) :: problem

      character(1) :: quote

      quote = text(cursor%next - 1:cursor%next - 1)
      cursor%value%is_quoted = .true.
      cursor%value%first = cursor%next
      ! the search succeeds always, because the text ends with a newline
      do
         cursor%next = cursor%next + scan(text(cursor%next:), quote//newline)
         if (text(cursor%next - 1:cursor%next - 1) == newline) exit
         if (text(cursor%next:cursor%next) /= quote) exit
         cursor%next = cursor%next + 1
      end do
      cursor%value%last = cursor%next - 2
      if (text(cursor%next - 1:cursor%next - 1) /= quote) then
         problem = excerpt(text(cursor%first:))//': the closing quote is missing on this line'
      else if (scan(text(cursor%next:cursor%next), blanks//',/!=') == 0) then
         problem = excerpt(text(cursor%first:))//': a blank or comma must follow the closing quote'
      end if
   end subroutine read_quoted

   !> Read a word, or a repeat count r* and the repeated value.
   subroutine read_word(text, cursor, problem)
      character(*), intent(in) :: text
      !> On entry after the first character
      type(cursor_t), intent(inout) :: cursor
      character(:), allocatable, intent(inout) :: problem

      integer, parameter :: max_digits = 9
      integer :: last, star, count

      last = word_last(text, cursor%first)
      cursor%value%first = cursor%first
      cursor%value%last = last
      cursor%next = last + 1
      ! position in the word of the first character that is no digit; 0: the word has digits only
      star = verify(text(cursor%first:last), digits)
      if (star < 2) return
      ! the same position in the text
      star = cursor%first + star - 1
      if (text(star:star) /= '*') return

      if (star - cursor%first > max_digits) then
         problem = excerpt(text(cursor%first:last))//': the repeat count is too large'
         return
      end if
      read (text(cursor%first:star - 1), *) count
      if (count == 0) then
         problem = excerpt(text(cursor%first:last))//': the repeat count must be at least 1'
      else if (star < last) then
         cursor%value%first = star + 1
      else if (scan(text(cursor%next:cursor%next), '''"') == 1) then
         cursor%next = cursor%next + 1
         call read_quoted(text, cursor, problem)
      else
         problem = excerpt(text(cursor%first:last))//': an empty value (nothing is repeated)'
      end if
      cursor%value%repeat = count
   end subroutine read_word

   !> Skip blanks, ends of lines and comments.
   pure subroutine skip_blanks(text, next, line, starts_line)
      character(*), intent(in) :: text
      !> Position of the next character
      integer, intent(inout) :: next
      !> Line of the next character
      integer, intent(inout) :: line
      !> Whether a line begins among the skipped characters; unchanged if none does
      logical, intent(inout) :: starts_line

      do while (next <= len(text))
         select case (text(next:next))
         case (' ', tab)
            next = next + 1
         case (newline)
            next = next + 1
            line = line + 1
            starts_line = .true.
         case ('!')
            next = next + index(text(next:), newline) - 1
         case default
            return
         end select
      end do
   end subroutine skip_blanks

   !> Whether the next token is an = sign.
   pure logical function next_is_equals(text, next) result(answer)
      character(*), intent(in) :: text
      !> Position at which the search begins
      integer, intent(in) :: next

      integer :: position, line
      logical :: starts_line

      position = next
      line = 0
      starts_line = .false.
      call skip_blanks(text, position, line, starts_line)
      answer = .false.
      if (position <= len(text)) answer = text(position:position) == '='
   end function next_is_equals

   !> Position of the last character of the word that begins at `first`; first - 1: there is no word.
   pure integer function word_last(text, first) result(last)
      character(*), intent(in) :: text
      !> First position of the word
      integer, intent(in) :: first

      integer :: length

      length = scan(text(first:), word_end)
      last = merge(len(text), first + length - 2, length == 0)
   end function word_last

   !> Whether a text is a name: a letter, then letters, digits and underscores.
   pure logical function is_name(text) result(is_legal)
      character(*), intent(in) :: text

      is_legal = .false.
      if (len(text) == 0) return
      is_legal = scan(text(1:1), letters//capitals) == 1 &
         .and. verify(text, letters//capitals//digits//'_') == 0
   end function is_name

   !> Convert the line ends of any operating system to one newline at the end of each line.
   pure subroutine normalise_lines(raw, text)
      character(*), intent(in) :: raw
      !> Text with converted line ends
      character(:), allocatable, intent(out) :: text

      integer :: i, length

      allocate (character(len(raw) + 1) :: text)
      length = 0
      do i = 1, len(raw)
         if (raw(i:i) == newline .and. i > 1) then
            if (raw(i - 1:i - 1) == carriage_return) cycle
         end if
         length = length + 1
         text(length:length) = raw(i:i)
         if (raw(i:i) == carriage_return) text(length:length) = newline
      end do
      if (length > 0) then
         if (text(length:length) == newline) length = length - 1
      end if
      length = length + 1
      text(length:length) = newline
      text = text(:length)
   end subroutine normalise_lines

   !> A text with its capital letters A to Z in lower case.
   pure function lower_case(text) result(lower)
      character(*), intent(in) :: text
      character(len(text)) :: lower

      integer :: i

      lower = text
      do i = 1, len(text)
         if (text(i:i) >= 'A' .and. text(i:i) <= 'Z') lower(i:i) = achar(iachar(text(i:i)) + iachar('a') - iachar('A'))
      end do
   end function lower_case

   !> The characters `first` to `last` of a text.
   pure function slice(text, first, last) result(part)
      character(*), intent(in) :: text
      !> First position
      integer, intent(in) :: first
      !> Last position; less than `first`: the result is empty
      integer, intent(in) :: last
      character(:), allocatable :: part

      part = text(first:last)
   end function slice

end module namelist_tokens
