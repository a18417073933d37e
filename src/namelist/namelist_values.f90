!> Conversion of the text of one namelist value to an integer, a real, a logical or a text. The syntax is checked here
!> before the run-time library reads a number, because the library accepts nan, inf and 1e999, and stops the program if
!> floating-point exceptions are trapped.
module namelist_values
   use kinds, only: i8, wp
   use namelist_tokens, only: lower_case
   use number_text, only: to_text
   implicit none (type, external)
   private
   public :: read_integer, read_real, read_logical, read_text

   character(*), parameter :: digits = '0123456789'
   !> Allowed reals: 0, and numbers whose first significant digit stands for a power of ten from 1e-300 to 1e300.
   integer, parameter :: max_exponent = 300

contains

   !> Read a whole number: an optional sign, then digits.
   pure subroutine read_integer(text, value, is_legal, reason)
      character(*), intent(in) :: text
      integer, intent(out) :: value
      !> Whether the text is a whole number within the range of default integers
      logical, intent(out) :: is_legal
      !> Requirement that the text violates, if the text is a number such as 1e6. Unallocated otherwise
      character(:), allocatable, intent(out), optional :: reason

      integer, parameter :: max_digits = 18
      integer(i8) :: long_value
      integer :: first, last

      value = 0
      is_legal = .false.
      first = 1 + sign_length(text)
      last = len(text)
      if (last < first) return
      if (present(reason) .and. verify(text(first:), digits//'eE') == 0 .and. scan(text(first:), 'eE') > 1) then
         reason = 'must be a whole number without an exponent'
      end if
      if (verify(text(first:), digits) /= 0) return
      if (verify(text(first:), '0') > 0) first = first + verify(text(first:), '0') - 1
      if (last - first >= max_digits) return
      read (text(first:last), '(i18)') long_value
      if (text(1:1) == '-') long_value = -long_value
      if (abs(long_value) > huge(value)) return
      value = int(long_value)
      is_legal = .true.
   end subroutine read_integer

   !> Read a real: digits with an optional point, then an optional exponent with e or d.
   pure subroutine read_real(text, value, is_legal, reason)
      character(*), intent(in) :: text
      real(wp), intent(out) :: value
      !> Whether the text is a number, 0 or with a magnitude from 1e-300 to 1e300
      logical, intent(out) :: is_legal
      !> Requirement that the text violates, if the text is a number that is too near to 0 or has too many characters.
      !> Unallocated otherwise: the allowed range of the name, which the message then prints, explains the rest
      character(:), allocatable, intent(out), optional :: reason

      ! maximum number of characters of a number, which is the width in the format '(f100.0)' below
      integer, parameter :: max_characters = 100
      ! position of the first digit
      integer :: first
      ! position of the letter of the exponent
      integer :: letter_position
      ! position of the point
      integer :: point
      ! position of the first significant digit
      integer :: first_significant
      ! exponent as written
      integer :: exponent
      ! power of ten of the first significant digit
      integer :: power

      value = 0.0_wp
      is_legal = .false.
      first = 1 + sign_length(text)
      letter_position = scan(text, 'eEdD')
      exponent = 0
      if (letter_position > 0) then
         call read_exponent(text(letter_position + 1:), exponent, is_legal)
         if (.not. is_legal) return
         is_legal = .false.
      else
         letter_position = len(text) + 1
      end if
      associate (mantissa => text(first:letter_position - 1))
         if (scan(mantissa, digits) == 0) return
         if (verify(mantissa, digits//'.') /= 0) return
         point = index(mantissa, '.')
         if (point /= index(mantissa, '.', back=.true.)) return
         if (point == 0) point = len(mantissa) + 1

         ! power of ten of the first significant digit, for the check of the range
         first_significant = verify(mantissa, '0.')
         ! without a significant digit the number is zero, and `value` is zero already
         is_legal = first_significant == 0
         if (is_legal) return
         power = exponent + merge(point - first_significant - 1, point - first_significant, first_significant < point)
         is_legal = abs(power) <= max_exponent .and. len(text) <= max_characters
         if (.not. is_legal) then
            if (.not. present(reason)) return
            if (power < -max_exponent) reason = 'must be 0, or at least 1e-'//to_text(max_exponent)//' in size'
            if (abs(power) <= max_exponent) reason = 'must be written with at most '//to_text(max_characters) &
               //' characters'
            return
         end if
      end associate
      read (text, '(f100.0)') value
   end subroutine read_real

   !> Read the exponent of a real; an exponent beyond `exponent_limit` is replaced by this limit, which is beyond all
   !> reals.
   pure subroutine read_exponent(text, exponent, is_legal)
      !> Text after the letter e or d
      character(*), intent(in) :: text
      integer, intent(out) :: exponent
      !> Whether the text is an exponent
      logical, intent(out) :: is_legal

      integer, parameter :: exponent_limit = 10**8

      call read_integer(text, exponent, is_legal)
      if (.not. is_legal .and. len(text) > sign_length(text)) then
         is_legal = verify(text(1 + sign_length(text):), digits) == 0
         exponent = merge(-exponent_limit, exponent_limit, text(1:1) == '-')
      end if
      exponent = max(-exponent_limit, min(exponent_limit, exponent))
   end subroutine read_exponent

   !> Read .true., .false. or one of their short forms.
   pure subroutine read_logical(text, value, is_legal)
      character(*), intent(in) :: text
      logical, intent(out) :: value
      !> Whether the text is a logical value
      logical, intent(out) :: is_legal

      value = .false.
      is_legal = .true.
      select case (lower_case(text))
      case ('.true.', 'true', '.t.', 't')
         value = .true.
      case ('.false.', 'false', '.f.', 'f')
         value = .false.
      case default
         is_legal = .false.
      end select
   end subroutine read_logical

   !> The content of a text in quotes: two quotes in succession stand for one quote.
   pure function read_text(text, quote) result(value)
      !> Text between the quotes
      character(*), intent(in) :: text
      !> The quote, ' or "
      character(1), intent(in) :: quote
      character(:), allocatable :: value

      integer :: i, length

      allocate (character(len(text)) :: value)
      length = 0
      i = 1
      do while (i <= len(text))
         length = length + 1
         value(length:length) = text(i:i)
         if (text(i:i) == quote) i = i + 1
         i = i + 1
      end do
      value = value(:length)
   end function read_text

   !> Length of the sign at the beginning of a number: 0 or 1.
   pure integer function sign_length(text) result(length)
      !> Text of the number
      character(*), intent(in) :: text

      length = 0
      if (len(text) > 0) length = merge(1, 0, scan(text(1:1), '+-') == 1)
   end function sign_length

end module namelist_values
