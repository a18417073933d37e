!> Ranges of values that names of scenes accept: a type, its tests and its texts in messages, and common ranges.
module value_rules
   use kinds, only: wp
   use number_text, only: to_text
   implicit none (type, external)
   private
   public :: range_t, contains_value, range_text, one_of, is_among, length_ratio_problem, max_length_ratio
   public :: max_stored_numbers, number_range
   public :: physical_range, signed_range, length_range, off_root_range, point_range, stiffness_range
   public :: load_range, positive_range, instant_range, duration_range

   !> Maximum ratio of the longest to the shortest element. Up to this ratio, positions hold at least three digits of
   !> the shortest length; with much larger ratios, nodes of the short elements coincide because of rounding.
   real(wp), parameter :: max_length_ratio = 1.0e12_wp
   !> Maximum number of values that a run stores of one kind (samples of a history; or number of shapes or modes times
   !> number of nodes); they take 0.8 GB.
   real(wp), parameter :: max_stored_numbers = 1.0e8_wp

   !> Closed interval from `minimum` to `maximum`; `excludes_minimum`: without `minimum` itself.
   type :: range_t
      real(wp) :: minimum
      real(wp) :: maximum
      logical :: excludes_minimum = .false.
   end type range_t

   !> Nonnegative values in the user's units. The limit of this range, and of the next two, is so low that products and
   !> quotients of a few values do not overflow.
   type(range_t), parameter :: physical_range = range_t(0.0_wp, 1.0e20_wp)
   !> All numbers that the reader of numbers accepts.
   type(range_t), parameter :: number_range = range_t(-1.0e300_wp, 1.0e300_wp)
   !> Values of either sign in the user's units.
   type(range_t), parameter :: signed_range = range_t(-1.0e20_wp, 1.0e20_wp)
   !> Lengths in the user's units.
   type(range_t), parameter :: length_range = range_t(1.0e-12_wp, 1.0e12_wp)
   !> Positions x/L of stops, supports, masses and bodies, which must not be at the root, nor so near to it that the
   !> mesh needs a very short element.
   type(range_t), parameter :: off_root_range = range_t(1.0e-3_wp, 1.0_wp)
   !> Positions x/L of any point of the beam.
   type(range_t), parameter :: point_range = range_t(0.0_wp, 1.0_wp)
   !> Stiffness ratios of springs.
   type(range_t), parameter :: stiffness_range = range_t(1.0e-6_wp, 1.0e12_wp)
   !> Dimensionless loads and displacements of either sign.
   type(range_t), parameter :: load_range = range_t(-1.0e12_wp, 1.0e12_wp)
   !> Positive dimensionless values.
   type(range_t), parameter :: positive_range = range_t(0.0_wp, 1.0e12_wp, excludes_minimum=.true.)
   !> Instants, tau.
   type(range_t), parameter :: instant_range = range_t(0.0_wp, 1.0e9_wp)
   !> Durations, tau.
   type(range_t), parameter :: duration_range = range_t(0.0_wp, 1.0e9_wp, excludes_minimum=.true.)

   interface range_t
      module procedure range_of_integers
   end interface range_t

contains

   !> A range from two integers.
   elemental type(range_t) function range_of_integers(minimum, maximum) result(range)
      integer, intent(in) :: minimum
      integer, intent(in) :: maximum

      range%minimum = real(minimum, wp)
      range%maximum = real(maximum, wp)
   end function range_of_integers

   !> Whether the number is in the range.
   elemental logical function contains_value(range, value) result(is_inside)
      type(range_t), intent(in) :: range
      real(wp), intent(in) :: value

      is_inside = value >= range%minimum .and. value <= range%maximum
      if (range%excludes_minimum) is_inside = is_inside .and. value > range%minimum
   end function contains_value

   !> A range in words, such as 'from 0 to 1' or 'above 0, up to 1'.
   pure function range_text(range) result(text)
      type(range_t), intent(in) :: range
      character(:), allocatable :: text

      if (range%excludes_minimum) then
         text = 'above '//to_text(range%minimum)//', up to '//to_text(range%maximum)
      else
         text = 'from '//to_text(range%minimum)//' to '//to_text(range%maximum)
      end if
   end function range_text

   !> Error message for a mesh in which the ratio of the longest to the shortest element, 10**decades, exceeds a limit.
   !> The number in the message is rounded up, so that it is above the limit too.
   pure function length_ratio_problem(decades, limit) result(text)
      !> Decimal logarithm of the ratio of the longest to the shortest element
      real(wp), intent(in) :: decades
      !> Maximum of this ratio
      real(wp), intent(in) :: limit
      character(:), allocatable :: text

      ! mantissa in tenths, rounded up, 10 to 99
      integer :: tenths
      integer :: exponent

      exponent = floor(decades)
      tenths = ceiling(10.0_wp**(1.0_wp + decades - real(exponent, wp)))
      if (tenths > 99) exponent = exponent + 1
      if (tenths > 99) tenths = 10
      text = to_text(tenths/10)
      if (modulo(tenths, 10) > 0) text = text//'.'//to_text(modulo(tenths, 10))
      text = 'the longest element is '//text//'e'//to_text(exponent)//' times the shortest: must be at most ' &
         //to_text(limit)
   end function length_ratio_problem

   !> Alternatives in words, such as "'exact' or 'newmark'".
   pure function one_of(words) result(text)
      !> Allowed words
      character(*), intent(in) :: words(:)
      character(:), allocatable :: text

      integer :: i

      text = ''
      do i = 1, size(words)
         if (i > 1 .and. i == size(words)) then
            text = text//' or '
         else if (i > 1) then
            text = text//', '
         end if
         text = text//"'"//trim(words(i))//"'"
      end do
   end function one_of

   !> Whether a list of words, separated by blanks, contains a word.
   pure logical function is_among(word, words)
      character(*), intent(in) :: word
      character(*), intent(in) :: words

      is_among = index(' '//trim(words)//' ', ' '//trim(word)//' ') > 0
   end function is_among

end module value_rules
