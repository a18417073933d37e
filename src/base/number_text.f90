!> Numbers as text in messages and tables, with the minimum number of digits that read back to the same number.
module number_text
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
   use kinds, only: i8, wp
   implicit none (type, external)
   private
   public :: to_text, rounded, list_of_numbers

   !> `to_text(value)`: an integer or a real as text, without blanks.
   interface to_text
      module procedure integer_to_text, long_integer_to_text, real_to_text
   end interface to_text

contains

   !> Whole numbers as text, such as '1, 26 and 51'.
   pure function list_of_numbers(numbers) result(words)
      !> One number or more
      integer, intent(in) :: numbers(:)
      character(:), allocatable :: words

      integer :: i

      words = to_text(numbers(1))
      do i = 2, size(numbers)
         words = words//trim(merge(' and', ',   ', i == size(numbers)))//' '//to_text(numbers(i))
      end do
   end function list_of_numbers

   pure function integer_to_text(value) result(text)
      integer, intent(in) :: value
      character(:), allocatable :: text

      text = long_integer_to_text(int(value, i8))
   end function integer_to_text

   pure function long_integer_to_text(value) result(text)
      integer(i8), intent(in) :: value
      character(:), allocatable :: text

      character(24) :: buffer

      write (buffer, '(i0)') value
      text = trim(buffer)
   end function long_integer_to_text

   !> A real as text, such as 0.075, 1e-4 (for 1.0e-4), 200000 and 1e6.
   pure function real_to_text(value) result(text)
      real(wp), intent(in) :: value
      character(:), allocatable :: text

      integer, parameter :: max_digits = 17
      ! A number that has up to this many digits is also the nearest one of this many digits, which then ends in zeros
      integer, parameter :: precise_digits = 15
      ! A larger number gets all digits, because it may be rounded up and overflow when it is read back
      real(wp), parameter :: largest_read_back = 1.0e300_wp
      character(32) :: buffer
      character(16) :: layout
      character(:), allocatable :: digits
      integer :: count, exponent
      real(wp) :: back

      if (ieee_is_nan(value)) then
         text = 'nan'
         return
      else if (.not. ieee_is_finite(value)) then
         text = trim(merge('inf ', '-inf', value > 0.0_wp))
         return
      else if (abs(value) <= 0.0_wp) then
         text = '0'
         return
      end if

      ! a subnormal number has fewer precise digits
      do count = merge(precise_digits, 1, abs(value) >= tiny(value)), max_digits
         write (layout, '(a, i0, a)') '(es32.', count - 1, 'e3)'
         write (buffer, layout) abs(value)
         if (abs(value) > largest_read_back) cycle
         read (buffer, *) back
         if (abs(back - abs(value)) <= 0.0_wp) exit
      end do
      buffer = adjustl(buffer)
      digits = buffer(1:1)//buffer(3:index(buffer, 'E') - 1)
      digits = digits(:verify(digits, '0', back=.true.))
      read (buffer(index(buffer, 'E') + 1:), *) exponent
      text = format_digits(digits, exponent)
      if (value < 0.0_wp) text = '-'//text
   end function real_to_text

   !> A real as text with at most six digits, which hide the rounding errors of a conversion of units.
   pure function rounded(value) result(text)
      real(wp), intent(in) :: value
      character(:), allocatable :: text

      character(24) :: buffer
      real(wp) :: short

      write (buffer, '(es24.5e3)') value
      read (buffer, *) short
      text = to_text(short)
   end function rounded

   !> The number d.ddd times a power of ten, with a decimal point or with an exponent, whichever is shorter.
   pure function format_digits(digits, exponent) result(text)
      !> Significant digits; the decimal point is after the first
      character(*), intent(in) :: digits
      !> Power of ten
      integer, intent(in) :: exponent
      character(:), allocatable :: text

      integer :: count

      count = len(digits)
      if (exponent >= -3 .and. exponent < 0) then
         text = '0.'//repeat('0', int(-exponent - 1, i8))//digits
      else if (exponent >= 0 .and. exponent < 6) then
         if (count <= exponent + 1) then
            text = digits//repeat('0', int(exponent + 1 - count, i8))
         else
            text = digits(:exponent + 1)//'.'//digits(exponent + 2:)
         end if
      else
         text = digits(1:1)
         if (count > 1) text = text//'.'//digits(2:)
         text = text//'e'//integer_to_text(exponent)
      end if
   end function format_digits

end module number_text
