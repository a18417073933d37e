!> The names and values of one scene file: each is taken once, by a call that says what is allowed.
!> What no call took is unknown. Of all the problems in a file the one that stands first is kept.
module scene_input
   use kinds, only: i8, wp
   use name_hints, only: group_hint, item_hint, known_name_t
   use namelist_text, only: find_group, find_item, group_name, item_name, item_text, namelist_t, &
      value_count, value_source, value_text
   use namelist_tokens, only: line_of, lower_case, slice
   use namelist_values, only: read_integer, read_logical, read_real, read_text
   use number_text, only: to_text
   use printable_text, only: character_count, excerpt
   use scene_types, only: name_length
   use value_rules, only: contains_value, one_of, range_t, range_text, role_t
   implicit none (type, external)
   private
   public :: scene_input_t

   !> Longest list of values.
   integer, parameter :: longest_list = 100000

   type :: scene_input_t
      private
      !> The file, its parts, and which of them a call has asked for
      character(:), allocatable :: file
      type(namelist_t) :: namelist
      logical, allocatable :: group_is_known(:)
      logical, allocatable :: item_is_known(:)
      !> The group of the calls to come, and where it is in the file; 0: it is not
      character(:), allocatable :: group
      integer :: group_position = 0
      !> The names asked for so far
      type(known_name_t), allocatable :: names(:)
      integer :: name_count = 0
      !> Where in the text the first problem is, and what it is
      integer :: problem_position = huge(1)
      character(:), allocatable :: problem
   contains
      procedure :: start
      procedure :: open_group
      procedure :: take_real
      procedure :: take_integer
      procedure :: take_logical
      procedure :: take_text
      procedure :: take_reals
      procedure :: take_integers
      procedure :: take_choice
      procedure :: take_choices
      procedure :: has_group
      procedure :: has
      procedure :: complain
      procedure :: finish
      procedure :: has_problem
      procedure :: get_problem
      procedure, private :: find, find_single, numbers, words_chosen, reject, report
   end type scene_input_t

contains

   !> Begin with the parts of a file.
   subroutine start(input, file, namelist)
      !> The input
      class(scene_input_t), intent(inout) :: input
      !> Name of the file, for messages
      character(*), intent(in) :: file
      !> Its parts
      type(namelist_t), intent(in) :: namelist

      input%file = file
      input%namelist = namelist
      allocate (input%group_is_known(namelist%group_count), source=.false.)
      allocate (input%item_is_known(namelist%item_count), source=.false.)
      allocate (input%names(32))
   end subroutine start

   !> The calls to come take from this group.
   subroutine open_group(input, group, is_there)
      !> The input
      class(scene_input_t), intent(inout) :: input
      !> Its name
      character(*), intent(in) :: group
      !> The file has it
      logical, intent(out) :: is_there

      input%group = group
      input%group_position = find_group(input%namelist, group)
      is_there = input%group_position > 0
      if (is_there) input%group_is_known(input%group_position) = .true.
   end subroutine open_group

   !> A number.
   subroutine take_real(input, name, value, range, role)
      !> The input
      class(scene_input_t), intent(inout) :: input
      !> Name in small letters
      character(*), intent(in) :: name
      !> Stays as it is where the file does not have the name, or there is a problem
      real(wp), intent(inout) :: value
      !> What is allowed
      type(range_t), intent(in) :: range
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      real(wp), allocatable :: list(:)
      integer :: item

      call input%find_single(name, item, role)
      if (item == 0) return
      call input%numbers(item, range, .false., list)
      if (allocated(list)) value = list(1)
   end subroutine take_real

   !> A whole number.
   subroutine take_integer(input, name, value, range, role)
      !> The input
      class(scene_input_t), intent(inout) :: input
      !> Name in small letters
      character(*), intent(in) :: name
      !> Stays as it is where the file does not have the name, or there is a problem
      integer, intent(inout) :: value
      !> What is allowed
      type(range_t), intent(in) :: range
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      real(wp), allocatable :: list(:)
      integer :: item

      call input%find_single(name, item, role)
      if (item == 0) return
      call input%numbers(item, range, .true., list)
      if (allocated(list)) value = nint(list(1))
   end subroutine take_integer

   !> A logical.
   subroutine take_logical(input, name, value, role)
      !> The input
      class(scene_input_t), intent(inout) :: input
      !> Name in small letters
      character(*), intent(in) :: name
      !> Stays as it is where the file does not have the name, or there is a problem
      logical, intent(inout) :: value
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      integer :: item, first
      logical :: read_value, is_legal

      call input%find_single(name, item, role)
      if (item == 0) return
      first = input%namelist%items(item)%first_value
      call read_logical(value_text(input%namelist, first), read_value, is_legal)
      if (is_legal .and. .not. input%namelist%values(first)%is_quoted) then
         value = read_value
      else
         call input%reject(item, first, 'must be .true. or .false.')
      end if
   end subroutine take_logical

   !> A text of one line, without blanks at its end.
   subroutine take_text(input, name, value, longest)
      !> The input
      class(scene_input_t), intent(inout) :: input
      !> Name in small letters
      character(*), intent(in) :: name
      !> Stays as it is where the file does not have the name, or there is a problem
      character(:), allocatable, intent(inout) :: value
      !> Most characters
      integer, intent(in) :: longest

      character(:), allocatable :: text
      integer :: item, first, i

      call input%find_single(name, item)
      if (item == 0) return
      first = input%namelist%items(item)%first_value
      if (.not. input%namelist%values(first)%is_quoted) then
         call input%reject(item, first, 'must be a text in quotes')
         return
      end if
      i = input%namelist%values(first)%first - 1
      text = trim(read_text(value_text(input%namelist, first), slice(input%namelist%text, i, i)))
      if (len(text) > 0 .and. character_count(text) < 0) then
         call input%reject(item, first, 'must be UTF-8 free of tabs and other control characters')
      else if (len(text) == 0 .or. character_count(text) > longest) then
         call input%reject(item, first, 'must have 1 to '//to_text(longest)//' characters, this has ' &
            //to_text(character_count(text)))
      else
         value = text
      end if
   end subroutine take_text

   !> A list of numbers.
   subroutine take_reals(input, name, value, range, role)
      !> The input
      class(scene_input_t), intent(inout) :: input
      !> Name in small letters
      character(*), intent(in) :: name
      !> Stays as it is where the file does not have the name, or there is a problem
      real(wp), allocatable, intent(inout) :: value(:)
      !> What is allowed for each
      type(range_t), intent(in) :: range
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      real(wp), allocatable :: list(:)
      integer :: item

      call input%find(name, item, role)
      if (item == 0) return
      call input%numbers(item, range, .false., list)
      if (allocated(list)) call move_alloc(list, value)
   end subroutine take_reals

   !> A list of whole numbers.
   subroutine take_integers(input, name, value, range, role)
      !> The input
      class(scene_input_t), intent(inout) :: input
      !> Name in small letters
      character(*), intent(in) :: name
      !> Stays as it is where the file does not have the name, or there is a problem
      integer, allocatable, intent(inout) :: value(:)
      !> What is allowed for each
      type(range_t), intent(in) :: range
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      real(wp), allocatable :: list(:)
      integer :: item

      call input%find(name, item, role)
      if (item == 0) return
      call input%numbers(item, range, .true., list)
      if (.not. allocated(list)) return
      if (allocated(value)) deallocate (value)
      allocate (value(size(list)))
      value(:) = nint(list)
   end subroutine take_integers

   !> One of some words; the value is its position in them.
   subroutine take_choice(input, name, value, words, role)
      !> The input
      class(scene_input_t), intent(inout) :: input
      !> Name in small letters
      character(*), intent(in) :: name
      !> Stays as it is where the file does not have the name, or there is a problem
      integer, intent(inout) :: value
      !> What may be chosen
      character(*), intent(in) :: words(:)
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      integer, allocatable :: chosen(:)
      integer :: item

      call input%find_single(name, item, role)
      if (item == 0) return
      call input%words_chosen(item, words, chosen)
      if (allocated(chosen)) value = chosen(1)
   end subroutine take_choice

   !> Some of some words, none twice; the values are their positions in them.
   subroutine take_choices(input, name, value, words, role)
      !> The input
      class(scene_input_t), intent(inout) :: input
      !> Name in small letters
      character(*), intent(in) :: name
      !> Stays as it is where the file does not have the name, or there is a problem
      integer, allocatable, intent(inout) :: value(:)
      !> What may be chosen
      character(*), intent(in) :: words(:)
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      integer, allocatable :: chosen(:)
      integer :: item

      call input%find(name, item, role)
      if (item == 0) return
      call input%words_chosen(item, words, chosen)
      if (allocated(chosen)) call move_alloc(chosen, value)
   end subroutine take_choices

   !> Does the file have this group?
   pure function has_group(input, group)
      !> The input
      class(scene_input_t), intent(in) :: input
      !> Its name
      character(*), intent(in) :: group
      logical :: has_group

      has_group = find_group(input%namelist, group) > 0
   end function has_group

   !> Does the file have this name in this group?
   pure function has(input, group, name)
      !> The input
      class(scene_input_t), intent(in) :: input
      !> The group
      character(*), intent(in) :: group
      !> The name
      character(*), intent(in) :: name
      logical :: has

      has = .false.
      if (input%has_group(group)) has = find_item(input%namelist, find_group(input%namelist, group), name) > 0
   end function has

   !> Report a problem with a name, or with its group or the whole file where that is absent.
   subroutine complain(input, group, name, problem)
      !> The input
      class(scene_input_t), intent(inout) :: input
      !> The group, or nothing
      character(*), intent(in) :: group
      !> The name, or nothing
      character(*), intent(in) :: name
      !> What is wrong
      character(*), intent(in) :: problem

      integer :: position

      if (input%has(group, name)) then
         position = find_item(input%namelist, find_group(input%namelist, group), name)
         call input%report(input%namelist%items(position)%first, &
            '&'//group//' '//name//' = '//item_text(input%namelist, position)//': '//problem)
      else if (input%has_group(group)) then
         position = find_group(input%namelist, group)
         call input%report(input%namelist%groups(position)%first, '&'//group//': '//problem)
      else
         call input%report(0, problem)
      end if
   end subroutine complain

   !> After the last call: report groups and names that no call asked for, and those given twice. Only the first of either
   !> counts, and it stands behind no more good ones than there are names: the time grows with the text, not its square.
   subroutine finish(input)
      !> The input
      class(scene_input_t), intent(inout) :: input

      character(:), allocatable :: group, name
      integer :: i, first

      do i = 1, input%namelist%group_count
         group = group_name(input%namelist, i)
         first = find_group(input%namelist, group)
         if (.not. input%group_is_known(first)) then
            call input%report(input%namelist%groups(i)%first, '&'//excerpt(group)//': unknown group; ' &
               //group_hint(input%names(:input%name_count), group))
         else if (first < i) then
            call input%report(input%namelist%groups(i)%first, '&'//group//': given twice, first in line ' &
               //to_text(input%namelist%groups(first)%line))
         else
            cycle
         end if
         exit
      end do
      do i = 1, input%namelist%item_count
         name = item_name(input%namelist, i)
         group = group_name(input%namelist, input%namelist%items(i)%group)
         first = find_item(input%namelist, input%namelist%items(i)%group, name)
         if (first < i) then
            call input%report(input%namelist%items(i)%first, '&'//excerpt(group)//' '//excerpt(name) &
               //': given twice, first in line '//to_text(input%namelist%items(first)%line))
         else if (.not. input%item_is_known(i)) then
            call input%report(input%namelist%items(i)%first, '&'//excerpt(group)//' '//excerpt(name) &
               //': unknown name; '//item_hint(input%names(:input%name_count), group, name))
         else
            cycle
         end if
         exit
      end do
   end subroutine finish

   !> Is there a problem so far?
   pure function has_problem(input)
      !> The input
      class(scene_input_t), intent(in) :: input
      logical :: has_problem

      has_problem = allocated(input%problem)
   end function has_problem

   !> The first problem, on one line; unallocated: there is none.
   pure subroutine get_problem(input, problem)
      !> The input
      class(scene_input_t), intent(in) :: input
      !> What the user reads
      character(:), allocatable, intent(out) :: problem

      if (.not. allocated(input%problem)) return
      problem = input%file//': '//input%problem
      if (input%problem_position > 0) &
         problem = input%file//':'//to_text(line_of(input%namelist%text, input%problem_position))//': '//input%problem
   end subroutine get_problem

   !> The item of this name in the open group, 0 if the file does not have it or should not.
   subroutine find(input, name, item, role)
      !> The input; the name becomes a known one
      class(scene_input_t), intent(inout) :: input
      !> Name in small letters
      character(*), intent(in) :: name
      !> Its position
      integer, intent(out) :: item
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      type(known_name_t), allocatable :: more(:)
      integer :: other

      if (input%name_count == size(input%names)) then
         allocate (more(2*input%name_count))
         more(:input%name_count) = input%names
         call move_alloc(more, input%names)
      end if
      input%name_count = input%name_count + 1
      input%names(input%name_count) = known_name_t(input%group, name)
      item = 0
      if (input%group_position == 0) return
      item = find_item(input%namelist, input%group_position, name)
      if (item == 0) return
      input%item_is_known(item) = .true.
      if (.not. present(role)) return
      other = find_item(input%namelist, input%group_position, trim(role%instead_of))
      if (other > 0) then
         associate (later => input%namelist%items(max(item, other)))
            call input%report(later%first, '&'//input%group//': give '//name//' or ' &
               //trim(role%instead_of)//', not both')
         end associate
         item = 0
      else if (.not. role%is_relevant) then
         call input%reject(item, 0, 'only goes with '//trim(role%goes_with))
         item = 0
      end if
   end subroutine find

   !> The same for a name that takes one value.
   subroutine find_single(input, name, item, role)
      !> The input; the name becomes a known one
      class(scene_input_t), intent(inout) :: input
      !> Name in small letters
      character(*), intent(in) :: name
      !> Its position
      integer, intent(out) :: item
      !> What it is to other names
      type(role_t), intent(in), optional :: role

      call input%find(name, item, role)
      if (item == 0) return
      if (value_count(input%namelist, item) > 1_i8) then
         call input%reject(item, 0, 'takes one value, '//to_text(value_count(input%namelist, item))//' given')
         item = 0
      end if
   end subroutine find_single

   !> The values of an item as numbers; unallocated if one of them is none or is not allowed.
   subroutine numbers(input, item, range, are_whole, list)
      !> The input
      class(scene_input_t), intent(inout) :: input
      !> The item
      integer, intent(in) :: item
      !> What is allowed
      type(range_t), intent(in) :: range
      !> Only whole numbers
      logical, intent(in) :: are_whole
      !> The numbers
      real(wp), allocatable, intent(out) :: list(:)

      real(wp), allocatable :: values(:)
      character(:), allocatable :: reason
      real(wp) :: number
      integer :: i, whole, count
      logical :: is_legal

      if (value_count(input%namelist, item) > int(longest_list, i8)) then
         call input%reject(item, 0, 'takes at most '//to_text(longest_list)//' values, ' &
            //to_text(value_count(input%namelist, item))//' given')
         return
      end if
      allocate (values(value_count(input%namelist, item)))
      count = 0
      do i = input%namelist%items(item)%first_value, input%namelist%items(item)%last_value
         if (are_whole) then
            call read_integer(value_text(input%namelist, i), whole, is_legal)
            number = real(whole, wp)
         else
            call read_real(value_text(input%namelist, i), number, is_legal, reason)
         end if
         is_legal = is_legal .and. .not. input%namelist%values(i)%is_quoted
         if (is_legal) is_legal = contains_value(range, number)
         if (.not. is_legal) then
            if (.not. allocated(reason)) &
               reason = 'must be a '//trim(merge('whole number', 'number      ', are_whole))//' '//range_text(range)
            call input%reject(item, i, reason)
            return
         end if
         values(count + 1:count + input%namelist%values(i)%repeat) = number
         count = count + input%namelist%values(i)%repeat
      end do
      call move_alloc(values, list)
   end subroutine numbers

   !> The values of an item as positions in some words; unallocated if one of them is not there.
   subroutine words_chosen(input, item, words, list)
      !> The input
      class(scene_input_t), intent(inout) :: input
      !> The item
      integer, intent(in) :: item
      !> What may be chosen
      character(*), intent(in) :: words(:)
      !> The positions
      integer, allocatable, intent(out) :: list(:)

      character(:), allocatable :: word
      integer, allocatable :: chosen(:)
      integer :: i, position

      allocate (chosen(0))
      do i = input%namelist%items(item)%first_value, input%namelist%items(item)%last_value
         word = lower_case(value_text(input%namelist, i))
         do position = size(words), 1, -1
            if (word == words(position)) exit
         end do
         if (.not. input%namelist%values(i)%is_quoted) position = 0
         if (position == 0 .or. len(word) == 0) then
            call input%reject(item, i, 'must be '//one_of(words)//', in quotes')
            return
         else if (any(chosen == position) .or. input%namelist%values(i)%repeat > 1) then
            call input%reject(item, i, 'given twice')
            return
         end if
         chosen = [chosen, position]
      end do
      call move_alloc(chosen, list)
   end subroutine words_chosen

   !> Report a problem with a value of an item, or with the item.
   subroutine reject(input, item, value, problem)
      !> The input
      class(scene_input_t), intent(inout) :: input
      !> The item
      integer, intent(in) :: item
      !> The value; 0: the item as a whole
      integer, intent(in) :: value
      !> What is wrong
      character(*), intent(in) :: problem

      character(:), allocatable :: subject
      integer :: position

      subject = '&'//input%group//' '//excerpt(item_name(input%namelist, item))//' = '
      associate (part => input%namelist%items(item))
         if (value > 0 .and. part%last_value > part%first_value) then
            position = input%namelist%values(value)%start
            associate (values => input%namelist%values(part%first_value:value))
               subject = subject//value_source(input%namelist, value)//' (value ' &
                  //to_text(1_i8 + sum(int(values(:size(values) - 1)%repeat, i8)))//' of ' &
                  //to_text(value_count(input%namelist, item))//')'
            end associate
         else
            position = part%first
            subject = subject//item_text(input%namelist, item)
         end if
      end associate
      call input%report(position, subject//': '//problem)
   end subroutine reject

   !> Keep a problem if it stands before the one kept so far.
   subroutine report(input, position, problem)
      !> The input
      class(scene_input_t), intent(inout) :: input
      !> Where it stands in the text; 0: nowhere
      integer, intent(in) :: position
      !> What is wrong, with the group and the name
      character(*), intent(in) :: problem

      if (position >= input%problem_position) return
      input%problem_position = position
      input%problem = problem
   end subroutine report

end module scene_input
