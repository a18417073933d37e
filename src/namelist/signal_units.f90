!> Units of measured signals and of tables of loads, as texts: their prefixes, and the conversion of values.
module signal_units
   use kinds, only: wp
   use printable_text, only: excerpt
   implicit none (type, external)
   private
   public :: convert_unit, unit_ratio, split_unit

contains

   !> Convert values from the unit of a file, if it has one.
   pure subroutine convert_unit(unit, wanted, unless_none, values, problem)
      !> Unit of the file; empty: none
      character(*), intent(in) :: unit
      !> Unit of the values on return; empty: none
      character(*), intent(in) :: wanted
      !> Ending of the error message on a unit of the file if none is wanted
      character(*), intent(in) :: unless_none
      real(wp), intent(inout) :: values(:)
      !> Error message; unallocated: no error
      character(:), allocatable, intent(inout) :: problem

      ! texts that dimensionless values may have instead of units
      character(*), parameter :: no_units(5) = [character(3) :: '', '1', '-', 'tau', 'eta']
      real(wp) :: ratio

      if (unit == '' .or. allocated(problem)) return
      if (wanted /= '') then
         call unit_ratio(unit, wanted, ratio, problem)
         if (.not. allocated(problem)) values(:) = ratio*values
      else if (.not. any(no_units == unit)) then
         problem = 'has the unit '//excerpt(trim(unit))//', but '//unless_none
      end if
   end subroutine convert_unit

   !> Find the factor that converts numbers from one unit to another.
   pure subroutine unit_ratio(unit, wanted, ratio, problem)
      !> Unit of the numbers, such as 'mm/s'
      character(*), intent(in) :: unit
      !> The other unit, such as 'm/s'
      character(*), intent(in) :: wanted
      real(wp), intent(out) :: ratio
      !> Error message if the units have different dimensions or one of them is not known; unallocated: no error
      character(:), allocatable, intent(out) :: problem

      character(:), allocatable :: base, other
      real(wp) :: first, second
      logical :: is_known, other_known

      call split_unit(unit, base, first, is_known)
      call split_unit(wanted, other, second, other_known)
      ratio = first/second
      if (.not. (is_known .and. other_known)) then
         problem = 'unit '//excerpt(trim(unit))//' is not known; it must be '//trim(wanted)//', or that with a prefix'
      else if (base /= other) then
         problem = 'unit '//excerpt(trim(unit))//' must be '//trim(wanted)//', or that with a prefix'
      end if
   end subroutine unit_ratio

   !> Split a unit into a factor and a unit without prefixes: 'mm/s' into 0.001 and 'm/s'.
   pure subroutine split_unit(unit, base, factor, is_known)
      character(*), intent(in) :: unit
      character(:), allocatable, intent(out) :: base
      real(wp), intent(out) :: factor
      logical, intent(out) :: is_known

      character(:), allocatable :: part
      real(wp) :: size_of
      integer :: first, last, k

      factor = 1.0_wp
      is_known = len_trim(unit) > 0
      if (unit == 'g') then
         ! standard gravity
         base = 'm/s^2'
         factor = 9.80665_wp
         return
      end if
      base = ''
      first = 1
      k = 0
      do while (first <= len_trim(unit) .and. is_known)
         last = first + index(trim(unit(first:))//'/', '/') - 2
         part = with_caret(trim(adjustl(unit(first:last))))
         call split_prefix(part, size_of, is_known)
         k = k + 1
         if (k == 1) then
            factor = size_of
            base = part
         else
            ! ms^2 is (ms)^2
            if (index(part, '^2') > 0) size_of = size_of**2
            factor = factor/size_of
            base = base//'/'//part
         end if
         first = last + 2
      end do
      if (base == 'm/s/s') base = 'm/s^2'
   end subroutine split_unit

   !> A unit with its square as '^2', which files may also have as '2', '**2' or a superscript 2 (in UTF-8 or Latin-1).
   pure function with_caret(unit) result(part)
      character(*), intent(in) :: unit
      character(:), allocatable :: part

      character(*), parameter :: squares(5) = [character(3) :: '^2', '**2', char(194)//char(178), char(178), '2']
      integer :: i, last

      part = unit
      do i = 1, size(squares)
         last = len(unit) - len_trim(squares(i))
         if (last < 1) cycle
         if (unit(last + 1:) /= squares(i)) cycle
         part = unit(:last)//'^2'
         return
      end do
   end function with_caret

   !> Split a unit without divisions into a factor and the unit without its prefix.
   pure subroutine split_prefix(part, factor, is_known)
      !> On entry such as 'mm'; on return such as 'm'
      character(:), allocatable, intent(inout) :: part
      real(wp), intent(out) :: factor
      logical, intent(out) :: is_known

      character(*), parameter :: bases(4) = [character(4) :: 'm', 's', 'N', 's^2']
      ! other names of the second, which have no prefix
      character(*), parameter :: seconds(3) = [character(7) :: 'sec', 'second', 'seconds']
      ! micro: u, the micro of UTF-8 as a sign and as a Greek letter, and of Latin-1
      character(*), parameter :: prefixes(11) = [character(2) :: 'p', 'n', 'u', char(194)//char(181), &
         char(206)//char(188), char(181), 'm', 'c', 'k', 'M', 'd']
      real(wp), parameter :: factors(11) = [1.0e-12_wp, 1.0e-9_wp, 1.0e-6_wp, 1.0e-6_wp, 1.0e-6_wp, 1.0e-6_wp, &
         1.0e-3_wp, 1.0e-2_wp, 1.0e3_wp, 1.0e6_wp, 1.0e-1_wp]
      integer :: i, length

      factor = 1.0_wp
      if (any(seconds == part)) part = 's'
      is_known = any(bases == part)
      if (is_known) return
      do i = 1, size(prefixes)
         length = len_trim(prefixes(i))
         if (index(part, trim(prefixes(i))) /= 1) cycle
         if (.not. any(bases == part(length + 1:))) cycle
         is_known = .true.
         factor = factors(i)
         part = part(length + 1:)
         return
      end do
   end subroutine split_prefix

end module signal_units
