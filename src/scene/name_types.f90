!> What is known about a name of scene files, and about its group.
module name_types
   use kinds, only: wp
   use program_identity, only: program_motion
   use run_settings, only: name_length
   use value_rules, only: range_t
   implicit none (type, external)
   private
   public :: entry_t, group_t, name_t, condition_t, sweep_t, name_room
   public :: kind_number, kind_whole, kind_logical, kind_text, kind_word

   integer, parameter :: kind_number = 1
   integer, parameter :: kind_whole = 2
   integer, parameter :: kind_logical = 3
   integer, parameter :: kind_text = 4
   integer, parameter :: kind_word = 5

   integer, parameter :: name_room = 48
   integer, parameter :: phrase_room = 64
   integer, parameter :: meaning_room = 180

   !> What must be so for a name to count; empty: it always counts.
   type :: condition_t
      !> The group of the names below; without any it is the group that the scene must have. Empty: the name's own
      character(name_room) :: group = ''
      !> Which of several groups of that name
      integer :: occurrence = 1
      !> This name must be one of these words, which have blanks between them; of a logical, .true.
      character(name_room) :: name = ''
      character(phrase_room) :: words = ''
      !> The file gives none of these names, which have blanks between them
      character(phrase_room) :: without = ''
      !> For the user, where it is neither "name = 'word'" nor "&group"
      character(phrase_room) :: phrase = ''
   end type condition_t

   !> What a sweep makes of a name.
   type :: sweep_t
      !> Its number among the parameters; of those of a grid what makes other beams varies slowest, and then the least
      !> number; 0: it is not swept
      integer :: order = 0
      !> Another value makes another beam or mesh
      logical :: is_of_beam = .false.
      !> &cases may vary it too
      logical :: is_in_cases = .false.
      !> It may change in a motion under way: neither modes nor where surfaces are, nor the phase of loads, go by it
      logical :: is_in_motion = .false.
      !> Name and meaning in a sweep, where they are others; of several groups the label stands before the name
      character(name_room) :: name = ''
      character(meaning_room) :: meaning = ''
   end type sweep_t

   !> What is known about a name; its type is that of the component to which it is bound.
   type :: name_t
      !> In small letters
      character(name_room) :: name = ''
      !> What it is, with its unit
      character(meaning_room) :: meaning = ''
      !> What each number may be, or the length of a text
      type(range_t) :: range = range_t(-huge(1.0_wp), huge(1.0_wp))
      !> When it counts
      type(condition_t) :: needs = condition_t()
      !> Another name of its group for the same quantity: never both in one file; the other is echoed
      character(name_room) :: instead_of = ''
      !> What it is, as in `quantity_table`, in the units of the scene: the other gets the ratio, and a sweep may vary
      !> it if it may the other
      character(name_room) :: quantity = ''
      !> The ratio is not to one unit of its quantity, but to this quantity of the group
      character(name_room) :: over = ''
      !> It says how long the unit of displacement is, and makes no ratio by itself
      logical :: is_scale = .false.
      !> Its default in words, where that is no fixed value
      character(phrase_room) :: default = ''
      !> It counts only where it is given
      logical :: is_optional = .false.
      !> Two words of a list that stand alone
      character(name_room) :: alone(2) = ''
      !> The range is that of the parameter which this name of the group chooses
      character(name_room) :: range_of = ''
      type(sweep_t) :: sweep = sweep_t()
   end type name_t

   !> A group, or one of several of a name.
   type :: group_t
      character(name_room) :: name = ''
      !> Programs that take it, a sum of `program_` constants
      integer :: programs = program_motion
      !> A file may have several
      logical :: repeats = .false.
      !> Which of them it is, and what it is called among them
      integer :: occurrence = 1
      character(name_room) :: label = ''
      !> The scene asks for it
      logical :: is_wanted = .true.
      !> Places of its entries
      integer :: first_entry = 1
      integer :: last_entry = 0
      !> Entries of it, or of another of its name, have changed; of several the first says so
      logical :: is_changed = .false.
   end type group_t

   type :: entry_t
      !> Its group in the list of all
      integer :: group = 0
      type(name_t) :: name
      !> One of the `kind_` constants
      integer :: kind = kind_number
      logical :: is_list = .false.
      !> What may be chosen
      character(name_length), allocatable :: words(:)
      !> The file gives it; of an echo: it has values
      logical :: is_given = .false.
      !> It has another value than the scene
      logical :: is_changed = .false.
      !> A number, the place of a word, 1 for .true.; or a list of these, unallocated where there is none; or a text
      real(wp) :: value = 0.0_wp
      real(wp), allocatable :: list(:)
      character(:), allocatable :: text
   end type entry_t

end module name_types
