!> Hints in error messages about names: the valid name nearest to an unknown one, or all valid names, and the conditions
!> under which a name may be given.
module name_hints
   use name_table, only: table_t
   use name_types, only: max_name_length, sweep_t, one_of
   use near_names, only: edit_distance, nearest_name
   use number_text, only: to_text
   use printable_text, only: joined
   use program_identity, only: program_name
   use run_settings, only: name_length
   use sweep_names, only: find_parameters, parameter_names, parameter_of, sweep_of
   use sweep_settings, only: parameter_t
   implicit none (type, external)
   private
   public :: group_hint, item_hint, choice_hint, other_parameters, phrase_of

   !> Maximum number of names in the line of a message.
   integer, parameter :: max_listed = 40

contains

   !> The hint for an unknown group: the most similar group name, or all groups.
   pure function group_hint(table, program, group) result(hint)
      !> Table of all names
      type(table_t), intent(in) :: table
      !> Programs whose groups are considered: a constant `program_...` of `program_identity`, or a sum of several
      integer, intent(in) :: program
      !> Word that the user wrote
      character(*), intent(in) :: group
      character(:), allocatable :: hint

      character(name_length) :: groups(table%group_count)
      integer :: i, count, nearest

      count = 0
      do i = 1, table%group_count
         associate (known => table%groups(i))
            if (iand(known%programs, program) == 0 .or. known%occurrence > 1) cycle
            count = count + 1
            groups(count) = known%name
         end associate
      end do
      nearest = nearest_name(group, groups(:count))
      if (nearest > 0) then
         hint = 'did you mean &'//trim(groups(nearest))//'?'
      else
         hint = 'the groups are &'//joined(groups(:count), ', &')
      end if
   end function group_hint

   !> The hint for an unknown name in a group: the most similar name of the group, the groups that have this name, or
   !> names of the group.
   pure function item_hint(table, program, group, name) result(hint)
      !> Table of all names
      type(table_t), intent(in) :: table
      !> Programs whose groups are considered: a constant `program_...` of `program_identity`, or a sum of several
      integer, intent(in) :: program
      !> Group in which the user wrote the name
      character(*), intent(in) :: group
      !> Word that the user wrote
      character(*), intent(in) :: name
      character(:), allocatable :: hint

      character(name_length), allocatable :: names(:)
      integer :: nearest, place

      if (group == 'sweep') then
         hint = unswept_hint(table, program, name)
         if (hint /= '') return
      end if
      place = table%find_group(group)
      if (place > 0) names = table%entries(table%groups(place)%first_entry:table%groups(place)%last_entry)%name%name
      if (place == 0) allocate (names(0))
      nearest = nearest_name(name, names)
      ! stop_3_position is near stop_2_position, but no typing error in a scene of two stops
      if (missing_group(table, name) /= '') nearest = 0
      if (nearest > 0) then
         hint = 'did you mean '//trim(names(nearest))//'?'
         return
      end if
      hint = groups_with(table, program, name)
      if (hint /= '') then
         hint = 'it belongs to'//hint
         return
      end if
      hint = missing_group(table, name)
      if (hint /= '') return
      if (size(names) <= max_listed) then
         hint = '&'//group//' takes '//joined(names, ', ')
      else
         hint = 'the nearest of '//to_text(size(names))//' are '//joined(nearest_of(name, names), ', ') &
            //'; --names prints all'
      end if
   end function item_hint

   !> The groups that have a name, such as ' &stop, &mass'; empty: no group has it.
   pure function groups_with(table, program, name) result(groups)
      type(table_t), intent(in) :: table
      !> Programs whose groups are considered: a constant `program_...` of `program_identity`, or a sum of several
      integer, intent(in) :: program
      character(*), intent(in) :: name
      character(:), allocatable :: groups

      integer :: i

      groups = ''
      do i = 1, table%entry_count
         associate (group => table%groups(table%entries(i)%group))
            if (table%entries(i)%name%name /= name .or. iand(group%programs, program) == 0) cycle
            if (group%occurrence > 1) cycle
            if (groups /= '') groups = groups//','
            groups = groups//' &'//trim(group%name)
         end associate
      end do
   end function groups_with

   !> The hint for a name of another group, with or without the ending `_range`, `_log_range` or `_points`, that &sweep
   !> cannot vary or calls otherwise; empty: it is no such name, or &sweep calls it the same.
   pure function unswept_hint(table, program, name) result(hint)
      type(table_t), intent(in) :: table
      !> Programs whose groups are considered: a constant `program_...` of `program_identity`, or a sum of several
      integer, intent(in) :: program
      !> Word that the user wrote in &sweep
      character(*), intent(in) :: name
      character(:), allocatable :: hint

      character(*), parameter :: endings(*) = [character(10) :: '_log_range', '_range', '_points']
      character(:), allocatable :: base
      type(parameter_t) :: parameter
      type(sweep_t) :: sweep
      integer :: i, start

      hint = ''
      base = name
      do i = 1, size(endings)
         start = len(name) - len_trim(endings(i)) + 1
         if (start > 1 .and. base == name) then
            if (name(start:) == trim(endings(i))) base = name(:start - 1)
         end if
      end do
      do i = 1, table%entry_count
         if (table%entries(i)%name%name /= base) cycle
         sweep = sweep_of(table, i)
         if (sweep%order == 0) cycle
         parameter = parameter_of(table, i)
         if (hint == '') hint = base//' of &'//trim(parameter%group)//' is '//trim(parameter%name) &
            //name(len(base) + 1:)//' here'
         if (parameter%name == base) hint = ''
         if (parameter%name == base) return
      end do
      if (hint /= '') return
      hint = groups_with(table, program, base)
      if (hint /= '') hint = base//' of'//hint//' cannot be swept: run one scene for each value, by a loop of a ' &
         //'script; --names sweep prints what may vary'
   end function unswept_hint

   !> The hint for a value that is none of the allowed words: all of them, or if they are many the nearest.
   pure function choice_hint(word, words, others) result(hint)
      !> Word that the user wrote
      character(*), intent(in) :: word
      !> Allowed words
      character(*), intent(in) :: words(:)
      !> Parameters of &sweep if the words are those of &cases
      character(*), intent(in) :: others(:)
      character(:), allocatable :: hint

      ! maximum length of a list in a message, characters
      integer, parameter :: max_list_length = 300
      ! whether each allowed word ends with the word after an underscore
      logical :: ends_so(size(words))
      integer :: nearest

      hint = one_of(words)//', in quotes'
      if (len(hint) <= max_list_length) return
      nearest = nearest_name(word, words)
      ! parameters of the first stop have no number
      if (index(word, 'stop_1_') == 1) then
         if (any(words == word(8:))) nearest = findloc(words, word(8:), dim=1)
      end if
      ! parameters of some groups have the name of the group before their own, such as section_wall
      ends_so = index(words//' ', '_'//word//' ') > 0
      if (nearest == 0 .and. count(ends_so) == 1) nearest = findloc(ends_so, .true., dim=1)
      if (any(others == word)) then
         hint = '&sweep varies it, &cases does not'
      else if (nearest > 0) then
         hint = 'did you mean '//one_of(words(nearest:nearest))//'?'
      else
         hint = 'near are '//one_of(nearest_of(word, words))
      end if
      hint = 'one of '//to_text(size(words))//' names, which '//program_name//' --names lists; '//hint
   end function choice_hint

   !> The parameters of &sweep, if a group is &cases, which takes fewer of them; otherwise none.
   pure function other_parameters(table, group) result(names)
      type(table_t), intent(in) :: table
      !> Index of the group
      integer, intent(in) :: group
      character(name_length), allocatable :: names(:)

      integer, allocatable :: places(:)

      allocate (places(0))
      if (table%groups(group)%name == 'cases') call find_parameters(table, places)
      allocate (names, source=parameter_names(table, places))
   end function other_parameters

   !> The three names nearest to a word.
   pure function nearest_of(name, names) result(nearest)
      !> Word that the user wrote
      character(*), intent(in) :: name
      character(*), intent(in) :: names(:)
      character(len(names)) :: nearest(3)

      integer :: distance(size(names)), i, place

      distance = [(edit_distance(name(:min(len(name), name_length)), trim(names(i))), i=1, size(names))]
      do i = 1, size(nearest)
         place = minloc(distance, dim=1)
         nearest(i) = names(place)
         distance(place) = huge(place)
      end do
   end function nearest_of

   !> Hint that a numbered group is missing, such as 'it needs &stop number 3, and the scene has 2' for stop_3_position,
   !> or that names of the first &stop have no number; empty: the name does not begin with the name and the number of a
   !> group, or the scene has this group.
   pure function missing_group(table, name) result(hint)
      type(table_t), intent(in) :: table
      !> Word that the user wrote
      character(*), intent(in) :: name
      character(:), allocatable :: hint

      integer :: i, first, last, number, there

      hint = ''
      do i = 1, table%group_count
         associate (group => table%groups(i))
            if (.not. group%repeats .or. group%occurrence > 1 .or. index(name, trim(group%name)//'_') /= 1) cycle
            first = len_trim(group%name) + 2
            last = first + verify(name(first:)//'_', '0123456789') - 2
            if (last < first) cycle
            if (group%name == 'stop' .and. name(first:last) == '1') then
               hint = 'of the first &stop it is '//name(min(last + 2, len(name) + 1):)
               return
            end if
            there = count(table%groups(:table%group_count)%name == group%name .and. &
               table%groups(:table%group_count)%is_wanted)
            number = huge(number)
            if (last - first < 9) read (name(first:last), *) number
            if (number <= there) cycle
            hint = 'it needs &'//trim(group%name)//' number '//name(first:last)//', and the scene has '//to_text(there)
         end associate
      end do
   end function missing_group

   !> The condition under which an entry may be given, in words; empty: there is no condition.
   pure function phrase_of(table, place, from_elsewhere) result(phrase)
      type(table_t), intent(in) :: table
      !> Index of the entry
      integer, intent(in) :: place
      !> Whether the phrase is for a message about another group, so it names the entry's group; absent: it is not
      logical, intent(in), optional :: from_elsewhere
      character(:), allocatable :: phrase

      character(max_name_length) :: group
      integer :: comma, i
      logical :: is_elsewhere

      associate (needs => table%entries(place)%name%needs)
         phrase = trim(needs%phrase)
         if (phrase == '' .and. needs%words /= '') then
            do i = 1, len_trim(needs%words)
               if (needs%words(i:i) /= ' ') phrase = phrase//needs%words(i:i)
               if (needs%words(i:i) == ' ') phrase = phrase//"' or '"
            end do
            phrase = trim(needs%name)//" = '"//phrase//"'"
         else if (phrase == '' .and. needs%name /= '') then
            phrase = trim(needs%name)//' = .true.'
         else if (phrase == '' .and. needs%group /= '') then
            phrase = '&'//trim(needs%group)
            return
         end if
         ! a condition on a name of a group that the scene does not have: the group is missing
         if (needs%group /= '') then
            associate (place_of_group => table%find_group(needs%group, needs%occurrence))
               if (table%groups(place_of_group)%repeats .and. .not. table%groups(place_of_group)%is_wanted) then
                  phrase = '&'//trim(needs%group)
                  return
               end if
            end associate
         end if
         group = needs%group
         if (group /= '' .and. needs%occurrence > 1) group = trim(group)//' '//to_text(needs%occurrence)
         is_elsewhere = .false.
         if (present(from_elsewhere)) is_elsewhere = from_elsewhere
         if (group == '' .and. is_elsewhere) then
            associate (group_of_entry => table%groups(table%entries(place)%group))
               group = group_of_entry%name
               if (group_of_entry%occurrence > 1) group = trim(group)//' '//to_text(group_of_entry%occurrence)
            end associate
         end if
         if (group == '' .or. phrase == '') return
         ! the group stands after the condition itself, before ', not with ...'
         comma = index(phrase//',', ',')
         phrase = phrase(:comma - 1)//' in &'//trim(group)//phrase(comma:)
      end associate
   end function phrase_of

end module name_hints
