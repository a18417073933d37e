!> Reads a scene file into the table of names. Names that the table does not have are reported as unknown. Of all
!> problems in a file, only the first problem in the text is recorded.
module scene_input
   use kinds, only: i8, wp
   use name_hints, only: choice_hint, group_hint, item_hint, other_parameters, phrase_of
   use name_table, only: max_repeats, table_t
   use name_types, only: entry_t, kind_logical, kind_number, kind_text, kind_whole, kind_word, max_name_length, &
      is_among, contains_value, range_t, range_text
   use namelist_text, only: find_group, find_item, further_values, group_name, item_name, item_text, namelist_t, &
      value_count, value_source, value_text
   use namelist_tokens, only: lower_case, slice
   use namelist_values, only: read_integer, read_logical, read_real, read_text
   use number_text, only: to_text
   use printable_text, only: occurrences, character_count, excerpt
   use program_identity, only: name_of_program, program_any
   use run_settings, only: name_length
   use sweep_names, only: chosen_parameter
   implicit none (type, external)
   private
   public :: scene_input_t

   !> Maximum number of values in a list.
   integer, parameter :: max_list_size = 100000

   !> A parsed scene file and the first problem in it.
   type :: scene_input_t
      !> Name of the file
      character(:), allocatable :: file
      type(namelist_t) :: namelist
      !> Position of the first problem in the text
      integer :: problem_position = huge(1)
      !> Message of this problem
      character(:), allocatable :: problem
      !> Names that count as given because a sweep gives them, such as 'stop 2 stiffness'
      character(name_length), allocatable :: added(:)
   contains
      procedure :: start
      procedure :: read_table
      procedure :: has_group
      procedure :: has
      procedure :: add
      procedure :: complain
      procedure :: has_problem
      procedure :: get_problem
      procedure, private :: read_entry, read_numbers, read_words, read_switch, read_line, report_groups, &
         report_items, reject, report
   end type scene_input_t

contains

   !> Begin with a parsed file.
   subroutine start(input, file, namelist, table)
      class(scene_input_t), intent(inout) :: input
      !> Name of the file, for messages
      character(*), intent(in) :: file
      type(namelist_t), intent(in) :: namelist
      !> Table, before its names are listed; receives the names of the file's groups. Absent: the input is only for
      !> messages
      type(table_t), intent(inout), optional :: table

      character(max_name_length) :: names(namelist%group_count)
      integer :: i

      input%file = file
      input%namelist = namelist
      if (.not. present(table)) return
      do i = 1, size(names)
         names(i) = group_name(namelist, i)
      end do
      table%groups_given = names
   end subroutine start

   !> Read the values of the file into a table; values that are not given, or have a problem, do not change.
   subroutine read_table(input, table, program)
      class(scene_input_t), intent(inout) :: input
      !> Table with all names and their default values
      type(table_t), intent(inout) :: table
      !> Program that reads the file, one of the `program_` constants or a sum of several; groups of others are problems
      integer, intent(in) :: program

      ! item of each entry in the file; 0: not given
      integer :: items(table%entry_count)
      ! index of each group of the table in the file; 0: not given
      integer :: places(table%group_count)
      integer :: i

      do i = 1, table%group_count
         associate (group => table%groups(i))
            places(i) = find_group(input%namelist, group%name, group%occurrence)
            group%is_wanted = places(i) > 0
         end associate
      end do
      do i = 1, table%entry_count
         associate (entry => table%entries(i))
            items(i) = 0
            if (places(entry%group) == 0) cycle
            items(i) = find_item(input%namelist, places(entry%group), entry%name%name)
            entry%is_given = items(i) > 0
         end associate
      end do
      do i = 1, table%entry_count
         if (items(i) > 0) call input%read_entry(table, i, items(i))
      end do
      call input%report_groups(table, program)
      call input%report_items(table, program, items)
   end subroutine read_table

   !> Read the value of a name, if the name may be given in this scene.
   subroutine read_entry(input, table, place, item)
      class(scene_input_t), intent(inout) :: input
      type(table_t), intent(inout) :: table
      !> Index of the entry; the entries in its condition have been read before
      integer, intent(in) :: place
      !> Item of the entry in the file
      integer, intent(in) :: item

      type(range_t) :: range
      integer :: other, chosen

      associate (entry => table%entries(place), name => table%entries(place)%name)
         if (name%instead_of /= '') then
            other = find_item(input%namelist, input%namelist%items(item)%group, name%instead_of)
            if (other > 0) then
               call input%report(input%namelist%items(max(item, other))%first, &
                  '&'//trim(table%groups(entry%group)%name) &
                  //': give '//trim(name%name)//' or '//trim(name%instead_of)//', not both')
               return
            end if
         end if
         if (.not. table%applies(place)) then
            call input%reject(item, 0, 'only goes with '//phrase_of(table, place))
            return
         end if
         if (.not. entry%is_list .and. value_count(input%namelist, item) > 1_i8) then
            call input%reject(item, 0, 'takes one value'//further_values(input%namelist, item))
            return
         end if
         range = name%range
         if (name%range_of /= '') then
            chosen = chosen_parameter(table, entry%group, name%range_of)
            if (chosen > 0) range = table%entries(chosen)%name%range
         end if
         select case (entry%kind)
         case (kind_number, kind_whole)
            call input%read_numbers(item, range, entry)
         case (kind_word)
            call input%read_words(item, other_parameters(table, entry%group), entry)
         case (kind_logical)
            call input%read_switch(item, entry)
         case (kind_text)
            call input%read_line(item, nint(range%maximum), entry)
         end select
      end associate
   end subroutine read_entry

   !> Read numbers; a value that is not a number in the range is a problem.
   subroutine read_numbers(input, item, range, entry)
      class(scene_input_t), intent(inout) :: input
      integer, intent(in) :: item
      !> Allowed range
      type(range_t), intent(in) :: range
      !> Entry that receives the values
      type(entry_t), intent(inout) :: entry

      real(wp), allocatable :: values(:)
      character(:), allocatable :: reason
      real(wp) :: number
      integer :: i, whole, count
      logical :: is_legal

      if (value_count(input%namelist, item) > int(max_list_size, i8)) then
         call input%reject(item, 0, 'takes at most '//to_text(max_list_size)//' values, ' &
            //to_text(value_count(input%namelist, item))//' given')
         return
      end if
      allocate (values(value_count(input%namelist, item)))
      count = 0
      do i = input%namelist%items(item)%first_value, input%namelist%items(item)%last_value
         if (entry%kind == kind_whole) then
            call read_integer(value_text(input%namelist, i), whole, is_legal, reason)
            number = real(whole, wp)
         else
            call read_real(value_text(input%namelist, i), number, is_legal, reason)
         end if
         is_legal = is_legal .and. .not. input%namelist%values(i)%is_quoted .and. contains_value(range, number)
         if (.not. is_legal) then
            if (.not. allocated(reason)) reason = 'must be a ' &
               //trim(merge('whole number', 'number      ', entry%kind == kind_whole))//' '//range_text(range)
            call input%reject(item, i, reason)
            return
         end if
         values(count + 1:count + input%namelist%values(i)%repeat) = number
         count = count + input%namelist%values(i)%repeat
      end do
      if (entry%is_list) then
         call move_alloc(values, entry%list)
      else
         entry%value = values(1)
      end if
   end subroutine read_numbers

   !> Read words as indices of the allowed words; an unknown or a repeated word is a problem.
   subroutine read_words(input, item, others, entry)
      class(scene_input_t), intent(inout) :: input
      integer, intent(in) :: item
      !> Parameters that &sweep varies, for the message about a word that is none of those allowed
      character(*), intent(in) :: others(:)
      !> Entry that receives the values
      type(entry_t), intent(inout) :: entry

      character(:), allocatable :: word
      integer, allocatable :: chosen(:)
      integer :: i, place
      logical :: is_alone

      associate (part => input%namelist%items(item))
         allocate (chosen(part%first_value:part%last_value), source=0)
      end associate
      is_alone = .false.
      do i = lbound(chosen, 1), ubound(chosen, 1)
         word = lower_case(value_text(input%namelist, i))
         do place = size(entry%words), 1, -1
            if (word == lower_case(entry%words(place))) exit
         end do
         if (.not. input%namelist%values(i)%is_quoted) place = 0
         if (place == 0 .or. len(word) == 0) then
            call input%reject(item, i, 'must be '//choice_hint(word, entry%words, others))
            return
         else if (any(chosen == place) .or. input%namelist%values(i)%repeat > 1) then
            call input%reject(item, i, 'given twice')
            return
         end if
         is_alone = is_alone .or. any(word == entry%name%alone)
         chosen(i) = place
      end do
      if (is_alone .and. size(chosen) > 1) then
         call input%reject(item, 0, &
            "'"//trim(entry%name%alone(1))//"' and '"//trim(entry%name%alone(2))//"' stand alone")
      else if (entry%is_list) then
         entry%list = real(chosen, wp)
      else
         entry%value = real(maxval(chosen), wp)
      end if
   end subroutine read_words

   !> Read a logical value.
   subroutine read_switch(input, item, entry)
      class(scene_input_t), intent(inout) :: input
      integer, intent(in) :: item
      !> Entry that receives the value
      type(entry_t), intent(inout) :: entry

      integer :: first
      logical :: is_on, is_legal

      first = input%namelist%items(item)%first_value
      call read_logical(value_text(input%namelist, first), is_on, is_legal)
      if (is_legal .and. .not. input%namelist%values(first)%is_quoted) then
         entry%value = merge(1.0_wp, 0.0_wp, is_on)
      else
         call input%reject(item, first, 'must be .true. or .false.')
      end if
   end subroutine read_switch

   !> Read a text of one line, without trailing blanks.
   subroutine read_line(input, item, longest, entry)
      class(scene_input_t), intent(inout) :: input
      integer, intent(in) :: item
      !> Maximum number of characters
      integer, intent(in) :: longest
      !> Entry that receives the value
      type(entry_t), intent(inout) :: entry

      character(:), allocatable :: text
      integer :: first, quote

      first = input%namelist%items(item)%first_value
      if (.not. input%namelist%values(first)%is_quoted) then
         call input%reject(item, first, 'must be a text in quotes')
         return
      end if
      ! position of the quotation mark before the text
      quote = input%namelist%values(first)%first - 1
      text = trim(read_text(value_text(input%namelist, first), slice(input%namelist%text, quote, quote)))
      if (len(text) > 0 .and. character_count(text) < 0) then
         call input%reject(item, first, 'must be UTF-8 free of tabs and other control characters')
      else if (len(text) == 0 .or. character_count(text) > longest) then
         call input%reject(item, first, 'must have 1 to '//to_text(longest)//' characters, this has ' &
            //to_text(character_count(text)))
      else
         entry%text = text
      end if
   end subroutine read_line

   !> Report the first group that the table does not have, that belongs to another program, or that is given too often.
   !> The loop ends at this group, so the number of calls of `find_group` is limited by the number of valid groups.
   subroutine report_groups(input, table, program)
      class(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> Program that reads the file: one of the `program_` constants, or a sum of several
      integer, intent(in) :: program

      character(:), allocatable :: group, problem
      integer :: i, first, place, accepting_programs

      ! programs that accept all groups of the file; 0: no program accepts all of them
      accepting_programs = program_any
      do i = 1, table%group_count
         if (table%groups(i)%is_wanted) accepting_programs = iand(accepting_programs, table%groups(i)%programs)
      end do
      do i = 1, input%namelist%group_count
         group = group_name(input%namelist, i)
         first = find_group(input%namelist, group)
         place = table%find_group(group)
         if (place == 0) then
            problem = '&'//excerpt(group)//': unknown group; '//group_hint(table, program, group)
         else if (accepting_programs > 0 .and. iand(table%groups(place)%programs, program) == 0) then
            problem = '&'//group//': '//name_of_program(accepting_programs)//' runs this scene'
         else if (first < i .and. .not. table%groups(place)%repeats) then
            problem = '&'//group//': given twice, first in line '//to_text(input%namelist%groups(first)%line)
         else if (first < i .and. i == find_group(input%namelist, group, max_repeats + 1)) then
            problem = '&'//group//': may be given '//to_text(max_repeats)//' times at most'
         else
            cycle
         end if
         call input%report(input%namelist%groups(i)%first, problem)
         return
      end do
   end subroutine report_groups

   !> Report the first name that the table does not have or that is given twice.
   subroutine report_items(input, table, program, items)
      class(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> Program that reads the file: one of the `program_` constants, or a sum of several
      integer, intent(in) :: program
      !> Item of each entry of the table in the file; 0: not given
      integer, intent(in) :: items(:)

      character(:), allocatable :: group, name, problem
      integer :: i, first

      do i = 1, input%namelist%item_count
         if (any(items == i)) cycle
         name = item_name(input%namelist, i)
         group = group_name(input%namelist, input%namelist%items(i)%group)
         first = find_item(input%namelist, input%namelist%items(i)%group, name)
         problem = 'given twice, first in line '//to_text(input%namelist%items(first)%line)
         if (first == i) problem = 'unknown name; '//item_hint(table, program, group, name)
         call input%report(input%namelist%items(i)%first, '&'//excerpt(group)//' '//excerpt(name)//': '//problem)
         return
      end do
   end subroutine report_items

   !> Whether the file has this group.
   pure logical function has_group(input, group)
      class(scene_input_t), intent(in) :: input
      character(*), intent(in) :: group

      has_group = find_group(input%namelist, group) > 0
   end function has_group

   !> Whether the file has this name in this group.
   pure logical function has(input, group, name, occurrence)
      class(scene_input_t), intent(in) :: input
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      !> Number of the group among several of this name; absent: the first
      integer, intent(in), optional :: occurrence

      integer :: place

      place = find_group(input%namelist, group, occurrence)
      has = is_added(input, group, name, occurrence)
      if (place > 0) has = has .or. find_item(input%namelist, place, name) > 0
   end function has

   !> Whether a name was added to the names that the file gives.
   pure logical function is_added(input, group, name, occurrence) result(answer)
      type(scene_input_t), intent(in) :: input
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      !> Number of the group among several of this name; absent: the first
      integer, intent(in), optional :: occurrence

      integer :: which

      which = 1
      if (present(occurrence)) which = occurrence
      answer = allocated(input%added)
      if (answer) answer = any(input%added == group//' '//to_text(which)//' '//name)
   end function is_added

   !> Add a name to those that count as given.
   pure subroutine add(input, group, name, occurrence)
      class(scene_input_t), intent(inout) :: input
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      !> Number of the group among several of this name
      integer, intent(in) :: occurrence

      if (.not. allocated(input%added)) allocate (input%added(0))
      input%added = [character(name_length) :: input%added, group//' '//to_text(occurrence)//' '//name]
   end subroutine add

   !> Report a problem with a name. If the file does not give the name, the message gives the line of its group; if it
   !> does not have the group, no line. Of several names for one quantity, the message has the first in the file.
   subroutine complain(input, group, name, problem, occurrence)
      class(scene_input_t), intent(inout) :: input
      !> Name of the group; empty: the whole file
      character(*), intent(in) :: group
      !> The name, or several names separated by blanks; empty: the group
      character(*), intent(in) :: name
      character(*), intent(in) :: problem
      !> Number of the group among several of this name; absent: the first
      integer, intent(in), optional :: occurrence

      character(:), allocatable :: found
      integer :: place, item

      place = find_group(input%namelist, group, occurrence)
      if (place == 0) call input%report(0, problem)
      if (place == 0) return
      do item = input%namelist%groups(place)%first_item, input%namelist%groups(place)%last_item
         found = item_name(input%namelist, item)
         ! the value of a name that was added is not the value in the file
         if (.not. is_among(found, name) .or. is_added(input, group, found, occurrence)) cycle
         call input%reject(item, 0, problem)
         return
      end do
      call input%report(input%namelist%groups(place)%first, '&'//group//': '//problem)
   end subroutine complain

   !> Whether a problem has been reported.
   pure logical function has_problem(input)
      class(scene_input_t), intent(in) :: input

      has_problem = allocated(input%problem)
   end function has_problem

   !> Get the first problem and reset the input to no problem.
   pure subroutine get_problem(input, problem)
      class(scene_input_t), intent(inout) :: input
      !> Message of one line; unallocated: no problem
      character(:), allocatable, intent(out) :: problem

      if (.not. allocated(input%problem)) return
      problem = input%file//': '//input%problem
      if (input%problem_position > 0) then
         problem = input%file//':'//to_text(1 + occurrences(new_line('a'), slice(input%namelist%text, 1, &
            input%problem_position - 1)))//': '//input%problem
      end if
      input%problem_position = huge(1)
      deallocate (input%problem)
   end subroutine get_problem

   !> Report a problem with one value of an item, or with the whole item.
   subroutine reject(input, item, value, problem)
      class(scene_input_t), intent(inout) :: input
      integer, intent(in) :: item
      !> Index of the value; 0: the whole item
      integer, intent(in) :: value
      character(*), intent(in) :: problem

      character(:), allocatable :: subject
      integer :: position

      associate (part => input%namelist%items(item))
         subject = '&'//group_name(input%namelist, part%group)//' '//item_name(input%namelist, item)//' = '
         if (value > 0 .and. part%last_value > part%first_value) then
            position = input%namelist%values(value)%outer_first
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

   !> Record a problem if it comes before the recorded one in the text.
   subroutine report(input, position, problem)
      class(scene_input_t), intent(inout) :: input
      !> Position in the text; 0: the whole file
      integer, intent(in) :: position
      !> Message with group and name
      character(*), intent(in) :: problem

      if (position >= input%problem_position) return
      input%problem_position = position
      input%problem = problem
   end subroutine report

end module scene_input
