!> Types that describe a name of scene files (a group such as &stop has names such as `position`), its group, and its
!> entry in the table of all names.
module name_types
   use kinds, only: wp
   use program_identity, only: program_motion
   use run_settings, only: name_length
   use value_rules, only: physical_range, range_t
   implicit none (type, external)
   private
   public :: entry_t, group_t, name_t, condition_t, in_units_t, sweep_t, max_name_length
   public :: kind_number, kind_whole, kind_logical, kind_text, kind_word

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

end module name_types
