!> Values in units as people read them: with the prefix that leaves few digits before the point.
module reader_units
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use kinds, only: wp
   use number_text, only: rounded
   use quantities, only: quantity_named, unit_of, units_t, words_in
   implicit none (type, external)
   private
   public :: find_prefix, fixed, phrase, reading, reading_in, unit_given, unit_in

   type :: prefix_t
      character(2) :: text
      integer :: decade
   end type prefix_t

   !> A unit, and the prefixes with which it is read, each by its first letter; '-': without.
   type :: symbol_t
      character(2) :: text
      character(7) :: prefixes
   end type symbol_t

   type(prefix_t), parameter :: prefixes(*) = [prefix_t('G', 9), prefix_t('M', 6), prefix_t('k', 3), prefix_t('', 0), &
      prefix_t('m', -3), prefix_t(char(194)//char(181), -6), prefix_t('n', -9)]
   character(*), parameter :: letters = 'GMk-mun'
   type(symbol_t), parameter :: symbols(*) = [symbol_t('s', '-mun'), symbol_t('m', '-mun'), symbol_t('g', 'k-mun'), &
      symbol_t('N', 'GMk-mun'), symbol_t('J', 'k-mun'), symbol_t('Pa', 'M'), symbol_t('Hz', 'Mk-')]

contains

   !> The unit in which numbers are read, and what makes them of those in their own unit.
   pure subroutine find_prefix(greatest, unit, factor, read_unit)
      !> Of the sizes of the numbers
      real(wp), intent(in) :: greatest
      !> Their unit
      character(*), intent(in) :: unit
      real(wp), intent(out) :: factor
      character(:), allocatable, intent(out) :: read_unit

      integer :: decade, i, symbol
      character(:), allocatable :: head, tail

      factor = 1.0_wp
      read_unit = trim(unit)
      if (.not. greatest > 0.0_wp) return
      i = scan(read_unit//' ', ' /^')
      head = read_unit(:i - 1)
      tail = read_unit(i:)
      ! a tonne is a million grams
      decade = 0
      if (head == 't') decade = 6
      if (head == 't') head = 'g'
      symbol = symbol_named(head)
      if (symbol == 0 .and. len(head) > 1) then
         symbol = symbol_named(head(2:))
         i = index(letters, head(1:1))
         if (i == 0 .or. symbol == 0) return
         decade = prefixes(i)%decade
      end if
      if (symbol == 0) return
      do i = 1, size(prefixes)
         if (index(symbols(symbol)%prefixes, letters(i:i)) == 0) cycle
         factor = 10.0_wp**(decade - prefixes(i)%decade)
         read_unit = trim(prefixes(i)%text)//trim(symbols(symbol)%text)//tail
         ! 0.4 mm and 400 N
         if (greatest*factor >= merge(1.0_wp, 0.1_wp, prefixes(i)%decade > 0)) return
      end do
   end subroutine find_prefix

   !> Place of a unit; 0: it takes no prefix.
   pure function symbol_named(text) result(place)
      character(*), intent(in) :: text
      integer :: place

      ! findloc of gfortran 12 finds none of them
      do place = size(symbols), 1, -1
         if (symbols(place)%text == text) return
      end do
   end function symbol_named

   !> A number with its unit, if it has one.
   pure function reading(value, unit) result(words)
      real(wp), intent(in) :: value
      character(*), intent(in) :: unit
      character(:), allocatable :: words

      character(:), allocatable :: read_unit
      real(wp) :: factor

      if (ieee_is_nan(value)) then
         words = '-'
         return
      end if
      call find_prefix(abs(value), unit, factor, read_unit)
      words = trim(rounded(value*factor)//' '//read_unit)
   end function reading

   !> A dimensionless number as results have it: with its unit, or without where they are dimensionless.
   pure function reading_in(units, quantity, value, decimals) result(words)
      type(units_t), intent(in) :: units
      !> As in `quantity_table`
      character(*), intent(in) :: quantity
      real(wp), intent(in) :: value
      !> Digits behind the point of what has no unit; absent: six digits at most
      integer, intent(in), optional :: decimals
      character(:), allocatable :: words

      character(:), allocatable :: unit

      unit = unit_in(units, quantity)
      if (unit /= '') then
         words = reading(value*units%factor(quantity_named(quantity)), unit)
      else if (present(decimals) .and. .not. units%are_of_scene) then
         words = fixed(value, decimals)
      else
         words = rounded(value)
      end if
   end function reading_in

   !> Words, as `words_in` takes them, and a number as `reading_in` has it, such as 'at t = 3 ms'.
   pure function phrase(units, words, quantity, value, decimals) result(text)
      type(units_t), intent(in) :: units
      character(*), intent(in) :: words
      !> As in `quantity_table`
      character(*), intent(in) :: quantity
      real(wp), intent(in) :: value
      !> Digits behind the point of what has no unit; absent: six digits at most
      integer, intent(in), optional :: decimals
      character(:), allocatable :: text

      text = words_in(units, words)//reading_in(units, quantity, value, decimals)
   end function phrase

   !> What results have a quantity in; empty: it has no unit there.
   pure function unit_in(units, quantity) result(unit)
      type(units_t), intent(in) :: units
      !> As in `quantity_table`
      character(*), intent(in) :: quantity
      character(:), allocatable :: unit

      unit = ''
      if (units%are_of_scene .and. quantity /= 'number') unit = unit_of(quantity_named(quantity), units)
   end function unit_in

   !> What a parameter is in, whatever results are in; empty: a ratio, or a number.
   pure function unit_given(units, quantity) result(unit)
      type(units_t), intent(in) :: units
      !> As in `quantity_table`, or empty
      character(*), intent(in) :: quantity
      character(:), allocatable :: unit

      unit = ''
      if (quantity /= '') unit = unit_of(quantity_named(quantity), units)
   end function unit_given

   !> A number with so many decimals; with an exponent if it is too large for that.
   pure function fixed(value, decimals) result(text)
      real(wp), intent(in) :: value
      !> Digits behind the point
      integer, intent(in) :: decimals
      character(:), allocatable :: text

      real(wp), parameter :: largest = 1.0e6_wp
      character(32) :: buffer, layout

      write (layout, '(a, i0, a)') trim(merge('(f24. ', '(es24.', abs(value) < largest)), decimals, ')'
      write (buffer, layout) value
      text = trim(adjustl(buffer))
   end function fixed

end module reader_units
