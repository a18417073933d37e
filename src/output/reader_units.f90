!> Numbers with units as texts for readers. The prefix of a unit, such as the m of mm, is chosen so that few digits
!> stand before the decimal point.
module reader_units
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use kinds, only: wp
   use number_text, only: rounded
   use quantities, only: quantity_named, unit_of, units_t, words_in
   implicit none (type, external)
   private
   public :: choose_prefix, with_decimals, phrase, with_unit, value_in_units, scene_unit_of, unit_in

   !> A prefix and its power of ten.
   type :: prefix_t
      character(2) :: text
      !> Power of ten
      integer :: decade
   end type prefix_t

   !> A unit and the letters of the prefixes that it may have; '-': no prefix.
   type :: symbol_t
      character(2) :: text
      character(9) :: prefixes
   end type symbol_t

   !> All prefixes, in descending order.
   type(prefix_t), parameter :: prefixes(*) = [prefix_t('G', 9), prefix_t('M', 6), prefix_t('k', 3), prefix_t('', 0), &
      prefix_t('m', -3), prefix_t(char(194)//char(181), -6), prefix_t('n', -9), prefix_t('p', -12), prefix_t('f', -15)]
   !> One letter for each of `prefixes`: u stands for the micro sign, - for no prefix.
   character(*), parameter :: letters = 'GMk-munpf'
   !> Units that may have prefixes.
   type(symbol_t), parameter :: symbols(*) = [symbol_t('s', '-munp'), symbol_t('m', '-munp'), symbol_t('g', 'k-munp'), &
      symbol_t('N', 'GMk-munpf'), symbol_t('J', 'k-munpf'), symbol_t('W', 'k-munpf'), symbol_t('Pa', 'M'), &
      symbol_t('Hz', 'Mk-')]

contains

   !> Choose the prefix of a unit for numbers of a given size, and the factor that converts the numbers to it.
   pure subroutine choose_prefix(maximum, unit, factor, prefixed_unit)
      !> Maximum absolute value of the numbers
      real(wp), intent(in) :: maximum
      !> Unit of the numbers
      character(*), intent(in) :: unit
      real(wp), intent(out) :: factor
      character(:), allocatable, intent(out) :: prefixed_unit

      ! power of ten of the prefix that the unit has already
      integer :: decade
      integer :: i, symbol
      ! the first symbol of the unit
      character(:), allocatable :: head
      ! the rest of the unit
      character(:), allocatable :: tail

      factor = 1.0_wp
      prefixed_unit = trim(unit)
      if (.not. maximum > 0.0_wp) return
      i = scan(prefixed_unit//' ', ' /^')
      head = prefixed_unit(:i - 1)
      tail = prefixed_unit(i:)
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
         prefixed_unit = trim(prefixes(i)%text)//trim(symbols(symbol)%text)//tail
         ! the prefixes G, M, k need a number of at least 1, the others of at least 0.1: 400 N, 0.4 mm
         if (maximum*factor >= merge(1.0_wp, 0.1_wp, prefixes(i)%decade > 0)) return
      end do
   end subroutine choose_prefix

   !> Index of a unit in `symbols`; 0: the unit takes no prefix.
   pure integer function symbol_named(text) result(number)
      character(*), intent(in) :: text

      ! findloc of gfortran 12 does not find any of the texts
      do number = size(symbols), 1, -1
         if (symbols(number)%text == text) return
      end do
   end function symbol_named

   !> A number with its unit, if the number has a unit.
   pure function with_unit(value, unit) result(words)
      real(wp), intent(in) :: value
      character(*), intent(in) :: unit
      character(:), allocatable :: words

      character(:), allocatable :: prefixed_unit
      real(wp) :: factor

      if (ieee_is_nan(value)) then
         words = '-'
         return
      end if
      call choose_prefix(abs(value), unit, factor, prefixed_unit)
      words = trim(rounded(value*factor)//' '//prefixed_unit)
   end function with_unit

   !> A dimensionless number converted to the units of the results, followed by its unit; without a unit if the results
   !> are dimensionless.
   pure function value_in_units(units, quantity, value, decimals) result(words)
      type(units_t), intent(in) :: units
      !> Name of the quantity in `quantity_table`
      character(*), intent(in) :: quantity
      real(wp), intent(in) :: value
      !> Decimals of a number without unit; absent: at most six digits
      integer, intent(in), optional :: decimals
      character(:), allocatable :: words

      character(:), allocatable :: unit

      unit = unit_in(units, quantity)
      if (unit /= '') then
         words = with_unit(value*units%factor(quantity_named(quantity)), unit)
      else if (present(decimals) .and. .not. units%are_physical) then
         words = with_decimals(value, decimals)
      else
         words = rounded(value)
      end if
   end function value_in_units

   !> A text for `words_in`, followed by a number in the units of the results, such as 'at t = 3 ms'.
   pure function phrase(units, words, quantity, value, decimals) result(text)
      type(units_t), intent(in) :: units
      character(*), intent(in) :: words
      !> Name of the quantity in `quantity_table`
      character(*), intent(in) :: quantity
      real(wp), intent(in) :: value
      !> Decimals of a number without unit; absent: at most six digits
      integer, intent(in), optional :: decimals
      character(:), allocatable :: text

      text = words_in(units, words)//value_in_units(units, quantity, value, decimals)
   end function phrase

   !> Unit of a quantity in the results.
   pure function unit_in(units, quantity, none) result(unit)
      type(units_t), intent(in) :: units
      !> Name of the quantity in `quantity_table`
      character(*), intent(in) :: quantity
      !> Result for a quantity that is dimensionless in the results; absent: empty
      character(*), intent(in), optional :: none
      character(:), allocatable :: unit

      unit = ''
      if (present(none)) unit = none
      if (units%are_physical .and. quantity /= 'number') unit = unit_of(quantity_named(quantity), units)
   end function unit_in

   !> Unit of an input parameter in the scene, whatever the units of the results; empty for a ratio or a pure number.
   pure function scene_unit_of(units, quantity) result(unit)
      type(units_t), intent(in) :: units
      !> Name of the quantity in `quantity_table`, or empty
      character(*), intent(in) :: quantity
      character(:), allocatable :: unit

      unit = ''
      if (quantity /= '') unit = unit_of(quantity_named(quantity), units)
   end function scene_unit_of

   !> A number with a fixed number of decimals, or with an exponent if the number is large.
   pure function with_decimals(value, decimals) result(text)
      real(wp), intent(in) :: value
      !> Number of decimals
      integer, intent(in) :: decimals
      character(:), allocatable :: text

      real(wp), parameter :: largest = 1.0e6_wp
      character(32) :: buffer, layout

      write (layout, '(a, i0, a)') trim(merge('(f24. ', '(es24.', abs(value) < largest)), decimals, ')'
      write (buffer, layout) value
      text = trim(adjustl(buffer))
      ! zero has no sign, and so has a number that is rounded to zero
      if (verify(text, '-0.') == 0) text = text(scan(text, '0'):)
   end function with_decimals

end module reader_units
