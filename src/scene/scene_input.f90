!> A scene file read into a table of names. What the table does not have is unknown. Of all the problems in a file the
!> one that stands first is kept.
module scene_input
   use kinds, only: i8, wp
   use name_hints, only: choice_hint, group_hint, item_hint, phrase_of
   use name_table, only: is_among, most_repeats, table_t
   use name_types, only: entry_t, kind_logical, kind_number, kind_text, kind_whole, kind_word
   use namelist_text, only: find_group, find_item, group_name, item_name, item_text, namelist_t, value_count, &
      value_source, value_text
   use namelist_tokens, only: line_of, lower_case, slice
   use namelist_values, only: read_integer, read_logical, read_real, read_text
   use number_text, only: to_text
   use printable_text, only: character_count, excerpt
   use program_identity, only: name_of_program, program_any
   use run_settings, only: name_length
   use sweep_names, only: chosen_parameter
   use value_rules, only: contains_value, range_t, range_text
   implicit none (type, external)
   private
   public :: scene_input_t

   !> Longest list of values.
   integer, parameter :: longest_list = 100000

   type :: scene_input_t
      !> The file, and its parts
      character(:), allocatable :: file
      type(namelist_t) :: namelist
      !> Where in the text the first problem is, and what it is
      integer :: problem_position = huge(1)
      character(:), allocatable :: problem
      !> What counts as given besides, such as 'stop 2 stiffness'
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

   !> Begin with the parts of a file.
   subroutine start(input, file, namelist, table)
      class(scene_input_t), intent(inout) :: input
      !> Its name, for messages
      character(*), intent(in) :: file
      type(namelist_t), intent(in) :: namelist
      !> It is told which groups will be read, before its names are listed; absent: nothing is read
      type(table_t), intent(inout), optional :: table

      character(name_length) :: names(namelist%group_count)
      integer :: i

      input%file = file
      input%namelist = namelist
      if (.not. present(table)) return
      do i = 1, size(names)
         names(i) = group_name(namelist, i)
      end do
      call table%expect_groups(names)
   end subroutine start

   !> Put what the file gives into a table; what the file does not give, or what is a problem, stays as it is there.
   subroutine read_table(input, table, program)
      class(scene_input_t), intent(inout) :: input
      !> Listed, with the defaults
      type(table_t), intent(inout) :: table
      !> One of the `program_` constants, or a sum of them: groups of others are problems
      integer, intent(in) :: program

      !> For each entry its item in the file; 0: it is not given
      integer :: items(table%entry_count)
      !> For each group of the table its place in the file
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

   !> The value of a name, if it may stand there.
   subroutine read_entry(input, table, place, item)
      class(scene_input_t), intent(inout) :: input
      type(table_t), intent(inout) :: table
      !> The entry; those that it needs have been read
      integer, intent(in) :: place
      !> Its item in the file
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
         if (.not. table%counts(place)) then
            call input%reject(item, 0, 'only goes with '//phrase_of(table, place))
            return
         end if
         if (.not. entry%is_list .and. value_count(input%namelist, item) > 1_i8) then
            call input%reject(item, 0, 'takes one value, '//to_text(value_count(input%namelist, item))//' given')
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
            call input%read_words(item, entry)
         case (kind_logical)
            call input%read_switch(item, entry)
         case (kind_text)
            call input%read_line(item, nint(range%most), entry)
         end select
      end associate
   end subroutine read_entry

   !> Numbers; one that is none or is not allowed is a problem.
   subroutine read_numbers(input, item, range, entry)
      class(scene_input_t), intent(inout) :: input
      integer, intent(in) :: item
      !> What is allowed
      type(range_t), intent(in) :: range
      !> Gets them
      type(entry_t), intent(inout) :: entry

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
         if (entry%kind == kind_whole) then
            call read_integer(value_text(input%namelist, i), whole, is_legal)
            number = real(whole, wp)
         else
            call read_real(value_text(input%namelist, i), number, is_legal, reason)
         end if
         is_legal = is_legal .and. .not. input%namelist%values(i)%is_quoted
         if (is_legal) is_legal = contains_value(range, number)
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

   !> Words as places in what may be chosen, none twice; one that is not there is a problem.
   subroutine read_words(input, item, entry)
      class(scene_input_t), intent(inout) :: input
      integer, intent(in) :: item
      !> Gets them
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
            call input%reject(item, i, 'must be '//choice_hint(word, entry%words))
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

   !> A logical.
   subroutine read_switch(input, item, entry)
      class(scene_input_t), intent(inout) :: input
      integer, intent(in) :: item
      !> Gets it
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

   !> A text of one line, without blanks at its end.
   subroutine read_line(input, item, longest, entry)
      class(scene_input_t), intent(inout) :: input
      integer, intent(in) :: item
      !> Most characters
      integer, intent(in) :: longest
      !> Gets it
      type(entry_t), intent(inout) :: entry

      character(:), allocatable :: text
      integer :: first, i

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
         entry%text = text
      end if
   end subroutine read_line

   !> Groups that the table does not have, that another program takes, and those given twice. Only the first counts,
   !> and it stands behind no more good ones than there are names: the time grows with the text, not its square.
   subroutine report_groups(input, table, program)
      class(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> One of the `program_` constants, or a sum of them
      integer, intent(in) :: program

      character(:), allocatable :: group, problem
      integer :: i, first, place, takers

      ! where no program takes all groups, they contradict each other
      takers = program_any
      do i = 1, table%group_count
         if (table%groups(i)%is_wanted) takers = iand(takers, table%groups(i)%programs)
      end do
      do i = 1, input%namelist%group_count
         group = group_name(input%namelist, i)
         first = find_group(input%namelist, group)
         place = table%find_group(group)
         if (place == 0) then
            problem = '&'//excerpt(group)//': unknown group; '//group_hint(table, program, group)
         else if (takers > 0 .and. iand(table%groups(place)%programs, program) == 0) then
            problem = '&'//group//': '//name_of_program(takers)//' runs this scene'
         else if (first < i .and. .not. table%groups(place)%repeats) then
            problem = '&'//group//': given twice, first in line '//to_text(input%namelist%groups(first)%line)
         else if (first < i .and. i == find_group(input%namelist, group, most_repeats + 1)) then
            problem = '&'//group//': may be given '//to_text(most_repeats)//' times at most'
         else
            cycle
         end if
         call input%report(input%namelist%groups(i)%first, problem)
         return
      end do
   end subroutine report_groups

   !> Names that the table does not have, and those given twice; again only the first counts.
   subroutine report_items(input, table, program, items)
      class(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> One of the `program_` constants, or a sum of them
      integer, intent(in) :: program
      !> The items of the table's entries
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

   !> Does the file have this group?
   pure function has_group(input, group)
      class(scene_input_t), intent(in) :: input
      character(*), intent(in) :: group
      logical :: has_group

      has_group = find_group(input%namelist, group) > 0
   end function has_group

   !> Does the file have this name in this group?
   pure function has(input, group, name, occurrence)
      class(scene_input_t), intent(in) :: input
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      !> Which of the groups of this name; absent: the first
      integer, intent(in), optional :: occurrence
      logical :: has

      integer :: place

      place = find_group(input%namelist, group, occurrence)
      has = is_added(input, group, name, occurrence)
      if (place > 0) has = has .or. find_item(input%namelist, place, name) > 0
   end function has

   !> Was it added to what the file gives?
   pure function is_added(input, group, name, occurrence) result(is)
      type(scene_input_t), intent(in) :: input
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      !> Which of the groups of this name; absent: the first
      integer, intent(in), optional :: occurrence
      logical :: is

      integer :: which

      which = 1
      if (present(occurrence)) which = occurrence
      is = allocated(input%added)
      if (is) is = any(input%added == group//' '//to_text(which)//' '//name)
   end function is_added

   !> A name counts as given hereafter.
   pure subroutine add(input, group, name, occurrence)
      class(scene_input_t), intent(inout) :: input
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      !> Which of the groups of this name
      integer, intent(in) :: occurrence

      if (.not. allocated(input%added)) allocate (input%added(0))
      input%added = [character(name_length) :: input%added, group//' '//to_text(occurrence)//' '//name]
   end subroutine add

   !> Report a problem with a name, or with its group or the whole file where that is absent. Of several names for one
   !> quantity the first that the file has is told.
   subroutine complain(input, group, name, problem, occurrence)
      class(scene_input_t), intent(inout) :: input
      !> The group, or nothing
      character(*), intent(in) :: group
      !> The name, or several with blanks between them, or nothing
      character(*), intent(in) :: name
      character(*), intent(in) :: problem
      !> Which of the groups of this name; absent: the first
      integer, intent(in), optional :: occurrence

      character(:), allocatable :: found
      integer :: place, item

      place = find_group(input%namelist, group, occurrence)
      if (place == 0) call input%report(0, problem)
      if (place == 0) return
      do item = input%namelist%groups(place)%first_item, input%namelist%groups(place)%last_item
         found = item_name(input%namelist, item)
         ! of what was added the file has another value
         if (.not. is_among(found, name) .or. is_added(input, group, found, occurrence)) cycle
         call input%reject(item, 0, problem)
         return
      end do
      call input%report(input%namelist%groups(place)%first, '&'//group//': '//problem)
   end subroutine complain

   !> Is there a problem so far?
   pure function has_problem(input)
      class(scene_input_t), intent(in) :: input
      logical :: has_problem

      has_problem = allocated(input%problem)
   end function has_problem

   !> The first problem, on one line; unallocated: there is none. From then on there is none.
   pure subroutine get_problem(input, problem)
      class(scene_input_t), intent(inout) :: input
      !> What the user reads
      character(:), allocatable, intent(out) :: problem

      if (.not. allocated(input%problem)) return
      problem = input%file//': '//input%problem
      if (input%problem_position > 0) then
         problem = input%file//':'//to_text(line_of(input%namelist%text, input%problem_position))//': '//input%problem
      end if
      input%problem_position = huge(1)
      deallocate (input%problem)
   end subroutine get_problem

   !> Report a problem with a value of an item, or with the item.
   subroutine reject(input, item, value, problem)
      class(scene_input_t), intent(inout) :: input
      integer, intent(in) :: item
      !> The value; 0: the item as a whole
      integer, intent(in) :: value
      character(*), intent(in) :: problem

      character(:), allocatable :: subject
      integer :: position

      associate (part => input%namelist%items(item))
         subject = '&'//group_name(input%namelist, part%group)//' '//item_name(input%namelist, item)//' = '
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
