!> Types that describe a name of scene files (a group such as &stop has names such as `position`), its group, and its
!> entry in the table of all names; and ranges of values that names accept, their tests and their texts in messages.
module name_types
   use kinds, only: wp
   use number_text, only: to_text
   use program_identity, only: program_motion
   use run_settings, only: name_length
   implicit none (type, external)
   private
   public :: entry_t, group_t, name_t, condition_t, in_units_t, sweep_t, max_name_length, kind_number, kind_whole, &
      kind_logical, kind_text, kind_word, range_t, contains_value, range_text, one_of, is_among, length_ratio_problem, &
      max_length_ratio, max_stored_numbers, number_range, signed_range, length_range, off_root_range, point_range, &
      stiffness_range, load_range, positive_range, instant_range, duration_range

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
   !> Numbers of a measured signal. Squares of them and of their quotients do not overflow.
   type(range_t), parameter :: number_range = range_t(-1.0e50_wp, 1.0e50_wp)
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

   !> Kind of a value: a number.
   integer, parameter :: kind_number = 1
   !> Kind of a value: a whole number.
   integer, parameter :: kind_whole = 2
   !> Kind of a value: true or false.
   integer, parameter :: kind_logical = 3
   !> Kind of a value: any text.
   integer, parameter :: kind_text = 4
   !> Kind of a value: one of several allowed words.
   integer, parameter :: kind_word = 5

   !> Maximum length of a name, including those of sweeps, such as support_2_rotational_stiffness_ratio_log_range.
   integer, parameter :: max_name_length = 48
   !> Maximum length of a name that a description refers to.
   integer, parameter :: max_reference_length = 32
   !> Maximum length of a phrase.
   integer, parameter :: max_phrase_length = 64
   !> Maximum length of a meaning.
   integer, parameter :: max_meaning_length = 180

   !> Condition under which a name may be given; with empty components there is no condition.
   type :: condition_t
      !> Group of `name` and `without`; empty: the group of the name that has the condition. If only `group` is given,
      !> the scene must have this group
      character(max_reference_length) :: group = ''
      !> Number of the group among several groups of that name
      integer :: occurrence = 1
      !> Name whose value must be one of `words`; a logical value must be .true.
      character(max_reference_length) :: name = ''
      !> Allowed words, separated by blanks
      character(max_phrase_length) :: words = ''
      !> Names separated by blanks, none of which the file may give
      character(max_phrase_length) :: without = ''
      !> The condition in words, if "name = 'word'" or "&group" does not express it
      character(max_phrase_length) :: phrase = ''
   end type condition_t

   !> Use of a name as a parameter of sweeps; constructors give `order` without its keyword.
   type :: sweep_t
      !> Unique number of the parameter; 0: the name cannot be swept. In a grid, parameters that change the beam vary
      !> slowest, and among parameters of one kind those with smaller numbers
      integer :: order = 0
      !> Whether a change of the value changes the beam or the mesh
      logical :: changes_beam = .false.
      !> Whether a change of the value changes the scales of the scene, so that the scene is resolved anew for each
      !> value
      logical :: changes_scales = .false.
      !> Whether &cases may vary the parameter too
      logical :: is_in_cases = .false.
      !> Whether the value may change during a motion, because neither the modes nor the positions of stops nor the
      !> phases of loads depend on it
      logical :: may_change_in_motion = .false.
      !> Name in a sweep if it differs from that in the group; the label of a numbered group is put before it
      character(max_reference_length) :: name = ''
      !> Meaning in a sweep if it differs from that in the group
      character(max_phrase_length) :: meaning = ''
   end type sweep_t

   !> Description of a name; the component to which the name is bound determines its type.
   type :: name_t
      !> Name in lower case
      character(max_name_length) :: name = ''
      !> Meaning of the value, with its unit
      character(max_meaning_length) :: meaning = ''
      !> Range of each number, or of the length of a text
      type(range_t) :: range = range_t(-huge(1.0_wp), huge(1.0_wp))
      !> Condition under which the name applies
      type(condition_t) :: needs = condition_t()
      !> Another name of the group for the same quantity. A file may give only one of both; the results file always has
      !> the other name
      character(max_reference_length) :: instead_of = ''
      !> Quantity of a value in the units of the scene, a name in `quantity_table`. The name `instead_of`, if there is
      !> one, receives the dimensionless value (ratio), and a sweep may vary this name if it may vary `instead_of`
      character(max_reference_length) :: quantity = ''
      !> Name of another quantity of the group by which this quantity is divided to give the ratio, instead of by a
      !> scale
      character(max_reference_length) :: relative_to = ''
      !> Whether the value determines the unit of displacement D and is not converted to a ratio
      logical :: is_scale = .false.
      !> Default value in words, if the default is not a constant
      character(max_phrase_length) :: default = ''
      !> Whether the name has no effect unless the file gives it
      logical :: is_optional = .false.
      !> Two words of a list that must each be its only word, such as 'all' and 'none'
      character(max_reference_length) :: alone(2) = ''
      !> Name in the group whose value chooses a parameter, such as `parameter` of &cases; the range is that of this
      !> parameter
      character(max_reference_length) :: range_of = ''
      type(sweep_t) :: sweep = sweep_t()
   end type name_t

   !> Name of a ratio's quantity in the units of the scene, which is listed after the name of the ratio and applies
   !> under the same condition.
   type :: in_units_t
      !> Name in lower case
      character(max_name_length) :: name = ''
      !> Name in `quantity_table`
      character(max_reference_length) :: quantity = ''
      !> Meaning of the value, with its unit
      character(max_meaning_length) :: meaning = ''
      type(range_t) :: range = physical_range
      !> Name in a sweep if it differs from that in the group
      character(max_reference_length) :: swept_as = ''
      !> As in `name_t`
      character(max_reference_length) :: relative_to = ''
   end type in_units_t

   !> A group, or one of several groups of one name.
   type :: group_t
      character(max_reference_length) :: name = ''
      !> Programs that accept the group, a sum of `program_` constants
      integer :: programs = program_motion
      !> Whether a file may have several groups of this name
      logical :: repeats = .false.
      !> Whether no other group refers to names of this group
      logical :: stands_alone = .false.
      !> Number among the groups of this name
      integer :: occurrence = 1
      !> Label with that number
      character(max_reference_length) :: label = ''
      !> Whether the scene has the group
      logical :: is_wanted = .true.
      !> Index of its first entry in the table
      integer :: first_entry = 1
      !> Index of its last entry in the table
      integer :: last_entry = 0
      !> Whether values of the group have changed and are not yet in the scene; the flag of the first of several groups
      !> of one name counts for all
      logical :: is_changed = .false.
   end type group_t

   !> A name of the table and its value.
   type :: entry_t
      !> Index of the group
      integer :: group = 0
      type(name_t) :: name
      !> One of the `kind_` constants
      integer :: kind = kind_number
      !> Whether the value is a list of numbers or words
      logical :: is_list = .false.
      !> Allowed words
      character(name_length), allocatable :: words(:)
      !> Whether the file gives the name; in `make_echo`: whether the name has a value
      logical :: is_given = .false.
      !> Whether the value has changed and is not yet in the scene
      logical :: is_changed = .false.
      !> The value if it is no list or text: a number, the index of a word, or 1 for .true.
      real(wp) :: value = 0.0_wp
      !> A list of such values; unallocated: there is none
      real(wp), allocatable :: list(:)
      !> The value if it is a text; unallocated: there is none
      character(:), allocatable :: text
   end type entry_t

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

end module name_types
