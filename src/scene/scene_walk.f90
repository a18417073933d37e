!> A walk over everything that a scene may hold. The groups are described once, one call a name; the
!> walk decides what the calls do: read the values of a file, echo those of a scene, or list the
!> names with their defaults for the reference.
module scene_walk
   use echo_types, only: append_entry, echo_t
   use kinds, only: wp
   use namelist_text, only: namelist_t
   use number_text, only: to_text
   use scene_input, only: scene_input_t
   use value_rules, only: one_of, range_t, range_text, role_t
   implicit none (type, external)
   private
   public :: scene_walk_t

   integer, parameter :: mode_reading = 1
   integer, parameter :: mode_echoing = 2
   integer, parameter :: mode_listing = 3

   type :: scene_walk_t
      !> Reading: what the file has
      type(scene_input_t) :: input
      !> One of the `mode_` constants
      integer, private :: mode = mode_listing
      !> The group of the calls to come; a scene that is echoed has it
      character(:), allocatable, private :: group
      logical, private :: group_is_shown = .true.
      !> Echoing and listing: what came so far
      type(echo_t), allocatable, private :: entries(:)
      integer, private :: entry_count = 0
   contains
      procedure :: start_reading
      procedure :: start_echo
      procedure :: is_reading
      procedure :: open_group
      generic :: item => item_real, item_integer, item_logical, item_text, item_reals, item_integers
      procedure :: choice
      procedure :: choices
      procedure :: note_number
      procedure :: take_entries
      procedure, private :: item_real, item_integer, item_logical, item_text, item_reals, item_integers, note
   end type scene_walk_t

contains

   !> The calls to come read from a file. Without this or `start_echo` they list.
   subroutine start_reading(walk, file, namelist)
      !> The walk
      class(scene_walk_t), intent(inout) :: walk
      !> Name of the file, for messages
      character(*), intent(in) :: file
      !> Its parts
      type(namelist_t), intent(in) :: namelist

      walk%mode = mode_reading
      call walk%input%start(file, namelist)
   end subroutine start_reading

   !> The calls to come list the values of a scene that count in it.
   subroutine start_echo(walk)
      !> The walk
      class(scene_walk_t), intent(inout) :: walk

      walk%mode = mode_echoing
   end subroutine start_echo

   !> Do the calls read from a file?
   pure function is_reading(walk)
      !> The walk
      class(scene_walk_t), intent(in) :: walk
      logical :: is_reading

      is_reading = walk%mode == mode_reading
   end function is_reading

   !> The calls to come belong to this group.
   subroutine open_group(walk, name, is_wanted)
      !> The walk
      class(scene_walk_t), intent(inout) :: walk
      !> Name in small letters
      character(*), intent(in) :: name
      !> Reading: set when the file has it. Echoing: in, the scene has it. Absent: every scene has it.
      logical, intent(inout), optional :: is_wanted

      logical :: is_there

      walk%group = name
      walk%group_is_shown = .true.
      select case (walk%mode)
      case (mode_reading)
         call walk%input%open_group(name, is_there)
         if (present(is_wanted)) is_wanted = is_there
      case (mode_echoing)
         if (present(is_wanted)) walk%group_is_shown = is_wanted
      end select
   end subroutine open_group

   !> A number.
   subroutine item_real(walk, name, value, meaning, range, role)
      !> The walk
      class(scene_walk_t), intent(inout) :: walk
      !> Name in small letters
      character(*), intent(in) :: name
      !> In: its default, or what is echoed. Reading: replaced if the file has the name
      real(wp), intent(inout) :: value
      !> What it is, with its unit
      character(*), intent(in) :: meaning
      !> What is allowed
      type(range_t), intent(in) :: range
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      if (walk%is_reading()) then
         call walk%input%take_real(name, value, range, role)
      else
         call walk%note(name, meaning, 'number '//range_text(range), to_text(value), [value], .false., role)
      end if
   end subroutine item_real

   !> A whole number.
   subroutine item_integer(walk, name, value, meaning, range, role)
      !> The walk
      class(scene_walk_t), intent(inout) :: walk
      !> Name in small letters
      character(*), intent(in) :: name
      !> In: its default, or what is echoed. Reading: replaced if the file has the name
      integer, intent(inout) :: value
      !> What it is, with its unit
      character(*), intent(in) :: meaning
      !> What is allowed
      type(range_t), intent(in) :: range
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      if (walk%is_reading()) then
         call walk%input%take_integer(name, value, range, role)
      else
         call walk%note(name, meaning, 'whole number '//range_text(range), to_text(value), [real(value, wp)], &
            .false., role)
      end if
   end subroutine item_integer

   !> A logical.
   subroutine item_logical(walk, name, value, meaning, role)
      !> The walk
      class(scene_walk_t), intent(inout) :: walk
      !> Name in small letters
      character(*), intent(in) :: name
      !> In: its default, or what is echoed. Reading: replaced if the file has the name
      logical, intent(inout) :: value
      !> What it is, with its unit
      character(*), intent(in) :: meaning
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      character(*), parameter :: allowed = '.true. or .false.'

      if (walk%is_reading()) then
         call walk%input%take_logical(name, value, role)
      else
         call walk%note(name, meaning, allowed, trim(merge('.true. ', '.false.', value)), role=role)
      end if
   end subroutine item_logical

   !> A text of one line.
   subroutine item_text(walk, name, value, meaning, longest, role)
      !> The walk
      class(scene_walk_t), intent(inout) :: walk
      !> Name in small letters
      character(*), intent(in) :: name
      !> In: its default, or what is echoed. Reading: replaced if the file has the name
      character(:), allocatable, intent(inout) :: value
      !> What it is, with its unit
      character(*), intent(in) :: meaning
      !> Most characters
      integer, intent(in) :: longest
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      character(:), allocatable :: allowed, text

      if (walk%is_reading()) then
         call walk%input%take_text(name, value, longest)
      else
         allowed = 'text in quotes, 1 to '//to_text(longest)//' characters'
         text = ''
         if (allocated(value)) text = value
         call walk%note(name, meaning, allowed, text, role=role)
      end if
   end subroutine item_text

   !> A list of numbers; it stays unallocated where the file does not have it.
   subroutine item_reals(walk, name, value, meaning, range, role)
      !> The walk
      class(scene_walk_t), intent(inout) :: walk
      !> Name in small letters
      character(*), intent(in) :: name
      !> In: its default, or what is echoed. Reading: replaced if the file has the name
      real(wp), allocatable, intent(inout) :: value(:)
      !> What it is, with its unit
      character(*), intent(in) :: meaning
      !> What is allowed for each
      type(range_t), intent(in) :: range
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      real(wp), allocatable :: list(:)

      if (walk%is_reading()) then
         call walk%input%take_reals(name, value, range, role)
      else
         if (allocated(value)) allocate (list, source=value)
         if (.not. allocated(list)) allocate (list(0))
         call walk%note(name, meaning, 'numbers '//range_text(range), list_text(list), list, .true., role)
      end if
   end subroutine item_reals

   !> A list of whole numbers; it stays unallocated where the file does not have it.
   subroutine item_integers(walk, name, value, meaning, range, role)
      !> The walk
      class(scene_walk_t), intent(inout) :: walk
      !> Name in small letters
      character(*), intent(in) :: name
      !> In: its default, or what is echoed. Reading: replaced if the file has the name
      integer, allocatable, intent(inout) :: value(:)
      !> What it is, with its unit
      character(*), intent(in) :: meaning
      !> What is allowed for each
      type(range_t), intent(in) :: range
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      real(wp), allocatable :: list(:)

      if (walk%is_reading()) then
         call walk%input%take_integers(name, value, range, role)
      else
         if (allocated(value)) allocate (list, source=real(value, wp))
         if (.not. allocated(list)) allocate (list(0))
         call walk%note(name, meaning, 'whole numbers '//range_text(range), list_text(list), list, .true., role)
      end if
   end subroutine item_integers

   !> One of some words; the value is its position in them.
   subroutine choice(walk, name, value, meaning, words, role)
      !> The walk
      class(scene_walk_t), intent(inout) :: walk
      !> Name in small letters
      character(*), intent(in) :: name
      !> In: its default, or what is echoed. Reading: replaced if the file has the name
      integer, intent(inout) :: value
      !> What it is, with its unit
      character(*), intent(in) :: meaning
      !> What may be chosen
      character(*), intent(in) :: words(:)
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      character(:), allocatable :: text

      if (walk%is_reading()) then
         call walk%input%take_choice(name, value, words, role)
      else
         text = ''
         if (value > 0) text = trim(words(value))
         call walk%note(name, meaning, one_of(words), text, role=role)
      end if
   end subroutine choice

   !> Some of some words, none twice; the values are their positions in them.
   subroutine choices(walk, name, value, meaning, words, role)
      !> The walk
      class(scene_walk_t), intent(inout) :: walk
      !> Name in small letters
      character(*), intent(in) :: name
      !> In: its default, or what is echoed. Reading: replaced if the file has the name
      integer, allocatable, intent(inout) :: value(:)
      !> What it is, with its unit
      character(*), intent(in) :: meaning
      !> What may be chosen
      character(*), intent(in) :: words(:)
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      character(:), allocatable :: text
      integer :: i

      if (walk%is_reading()) then
         call walk%input%take_choices(name, value, words, role)
      else
         text = ''
         if (allocated(value)) then
            do i = 1, size(value)
               text = text//trim(words(value(i)))
               if (i < size(value)) text = text//', '
            end do
         end if
         call walk%note(name, meaning, 'some of '//one_of(words), text, is_list=.true., role=role)
      end if
   end subroutine choices

   !> Put a number on the list that no file gives.
   subroutine note_number(walk, name, meaning, value)
      !> The walk
      class(scene_walk_t), intent(inout) :: walk
      !> Name in small letters
      character(*), intent(in) :: name
      !> What it is, with its unit
      character(*), intent(in) :: meaning
      !> The number
      real(wp), intent(in) :: value

      call walk%note(name, meaning, '', to_text(value), [value])
   end subroutine note_number

   !> Hand over what was echoed or listed.
   subroutine take_entries(walk, entries)
      !> The walk
      class(scene_walk_t), intent(inout) :: walk
      !> Names and values
      type(echo_t), allocatable, intent(out) :: entries(:)

      integer :: i

      allocate (entries(walk%entry_count))
      do i = 1, walk%entry_count
         entries(i) = walk%entries(i)
      end do
   end subroutine take_entries

   !> Put a name and its value on the list, if it counts in the scene.
   subroutine note(walk, name, meaning, allowed, text, number, is_list, role)
      !> The walk
      class(scene_walk_t), intent(inout) :: walk
      !> The name, what it means and may be, and its value in words
      character(*), intent(in) :: name
      character(*), intent(in) :: meaning
      character(*), intent(in) :: allowed
      character(*), intent(in) :: text
      !> Its value
      real(wp), intent(in), optional :: number(:)
      !> It takes a list
      logical, intent(in), optional :: is_list
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      type(role_t) :: rules
      type(echo_t) :: entry

      if (present(role)) rules = role
      if (walk%mode == mode_echoing) then
         if (.not. walk%group_is_shown .or. .not. rules%is_relevant .or. rules%instead_of /= '') return
      end if
      entry%group = walk%group
      entry%name = name
      entry%meaning = meaning
      entry%allowed = allowed
      entry%text = text
      if (present(is_list)) entry%is_list = is_list
      if (present(number)) allocate (entry%number, source=number)
      if (walk%mode == mode_listing) then
         if (rules%instead_of /= '') then
            entry%meaning = meaning//'; instead of '//trim(rules%instead_of)
            entry%text = ''
         end if
         if (rules%goes_with /= '') entry%meaning = entry%meaning//'; goes with '//trim(rules%goes_with)
         if (rules%default /= '') entry%text = trim(rules%default)
      end if
      call append_entry(walk%entries, walk%entry_count, entry)
   end subroutine note

   !> The first numbers of a list in words.
   pure function list_text(list) result(text)
      !> The numbers
      real(wp), intent(in) :: list(:)
      character(:), allocatable :: text

      integer, parameter :: most_shown = 12
      integer :: i

      text = ''
      do i = 1, min(size(list), most_shown)
         if (i > 1) text = text//', '
         text = text//to_text(list(i))
      end do
      if (size(list) > most_shown) text = text//', ... ('//to_text(size(list))//' values)'
   end function list_text

end module scene_walk
