!> Parser of namelist files: it finds groups (&name ... /), the items `name = value, value ...` in them, and their
!> positions in the text. Values remain text.
!>
!> The accepted syntax is a subset of the standard (Fortran 2018, 13.11): a namelist READ statement can read every
!> accepted file. Rejected on purpose: subscripts and components, null values, texts that continue on the next line, `$`
!> and `&end`, and anything except blanks and comments outside of groups.
module namelist_text
   use kinds, only: i8
   use namelist_tokens, only: advance, cursor_t, next_is_equals, is_name, lower_case, &
      normalise_lines, slice, token_comma, token_end, token_equals, token_group, token_slash, token_value, value_t
   use number_text, only: to_text
   use printable_text, only: occurrences, excerpt
   implicit none (type, external)
   private
   public :: namelist_t, parse_namelist
   public :: find_group, find_item, group_name, item_name, value_text, value_source, item_text, value_count
   public :: further_values

   !> Maximum number of groups, and of items, that are parsed. The limit is far above the number of valid names; a
   !> longer file therefore has an unknown or a repeated name before the limit, and this name is reported.
   integer, parameter :: max_parsed = 10000

   !> An item, name = values.
   type :: item_t
      !> First position of its name in the text
      integer :: first = 1
      !> Last position of its name
      integer :: last = 0
      !> Line of its name
      integer :: line = 0
      !> Index of its group
      integer :: group = 0
      !> Index of the first value in `values`
      integer :: first_value = 1
      !> Index of the last value in `values`
      integer :: last_value = 0
   end type item_t

   !> A group, &name ... /.
   type :: group_t
      !> First position of its name in the text, after the &
      integer :: first = 1
      !> Last position of its name
      integer :: last = 0
      !> Line of its name
      integer :: line = 0
      !> Index of the first item in `items`
      integer :: first_item = 1
      !> Index of the last item in `items`
      integer :: last_item = 0
   end type group_t

   !> A parsed namelist file.
   type :: namelist_t
      !> The text with one newline at the end of each line, without byte order mark
      character(:), allocatable :: text
      !> Groups in the order of the text; only the first `group_count` are used
      type(group_t), allocatable :: groups(:)
      !> Items of all groups in the order of the text; only the first `item_count` are used
      type(item_t), allocatable :: items(:)
      !> Values of all items in the order of the text; only the first `value_count` are used
      type(value_t), allocatable :: values(:)
      !> Number of groups
      integer :: group_count = 0
      !> Number of items
      integer :: item_count = 0
      !> Number of values
      integer :: value_count = 0
   end type namelist_t

contains

   !> Parse a text, up to `max_parsed` groups or items. If there is a problem, `namelist` is incomplete.
   subroutine parse_namelist(text, namelist, line, problem)
      character(*), intent(in) :: text
      !> The groups, items and values
      type(namelist_t), intent(out) :: namelist
      !> Line of the problem
      integer, intent(out) :: line
      !> Error message; unallocated: no error
      character(:), allocatable, intent(out) :: problem

      type(cursor_t) :: cursor
      logical :: is_after_slash

      call normalise_lines(text, namelist%text)
      allocate (namelist%groups(min(occurrences('&', namelist%text), max_parsed)), &
         namelist%items(min(occurrences('=', namelist%text), max_parsed)), namelist%values(64))
      is_after_slash = .false.
      do while (max(namelist%group_count, namelist%item_count) < max_parsed)
         call advance(namelist%text, cursor, problem)
         if (allocated(problem)) exit
         select case (cursor%kind)
         case (token_end)
            exit
         case (token_group)
            if (is_after_slash .and. .not. cursor%starts_line) then
               problem = '&'//excerpt(slice(namelist%text, cursor%value%first, cursor%value%last)) &
                  //': a group must begin on a line of its own'
               exit
            end if
            call parse_group(namelist, cursor, problem)
            if (allocated(problem)) exit
            is_after_slash = .true.
         case default
            problem = excerpt(namelist%text(cursor%first:))//': text outside of a group (&name ... /)'
            exit
         end select
      end do
      line = cursor%token_line

   end subroutine parse_namelist

   !> Parse one group, from its name up to the slash.
   subroutine parse_group(namelist, cursor, problem)
      !> The groups parsed before; this group is added
      type(namelist_t), intent(inout) :: namelist
      !> On entry at the group's name; on return at its slash
      type(cursor_t), intent(inout) :: cursor
      character(:), allocatable, intent(inout) :: problem

      type(group_t) :: group

      group%first = cursor%value%first
      group%last = cursor%value%last
      group%line = cursor%token_line
      group%first_item = namelist%item_count + 1
      group%last_item = namelist%item_count
      associate (count => namelist%group_count)
         count = count + 1
         namelist%groups(count) = group
      end associate
      call advance(namelist%text, cursor, problem)
      do while (namelist%item_count < max_parsed)
         if (allocated(problem)) return
         select case (cursor%kind)
         case (token_slash)
            return
         case (token_value)
            call parse_item(namelist, cursor, group, problem)
         case (token_end, token_group)
            problem = not_closed(namelist%text, cursor, marked(namelist%text, group), group%line)
         case (token_comma)
            problem = marked(namelist%text, group)//': a comma without a value before it'
         case (token_equals)
            problem = marked(namelist%text, group)//': an = sign without a name before it'
         end select
      end do
   end subroutine parse_group

   !> Parse one item, name = values, up to the next name or the slash.
   subroutine parse_item(namelist, cursor, group, problem)
      !> The items parsed before; this item and its values are added
      type(namelist_t), intent(inout) :: namelist
      !> On entry at the name; on return at the token after the values
      type(cursor_t), intent(inout) :: cursor
      !> The group, for messages
      type(group_t), intent(in) :: group
      character(:), allocatable, intent(inout) :: problem

      type(item_t) :: item
      logical :: wants_value
      integer :: first, next

      item%first = cursor%value%first
      item%last = cursor%value%last
      item%line = cursor%token_line
      item%group = namelist%group_count
      item%first_value = namelist%value_count + 1
      first = cursor%first
      next = cursor%next
      if (cursor%value%is_quoted .or. .not. next_is_equals(namelist%text, cursor%next)) then
         problem = subject()//': name = value expected here'
         return
      end if
      if (.not. is_name(slice(namelist%text, item%first, item%last)) .or. cursor%first < item%first) then
         problem = subject()//': a name is made of letters, digits and _ (no subscripts: give the whole list)'
         return
      end if

      call advance(namelist%text, cursor, problem)
      wants_value = .true.
      do
         call advance(namelist%text, cursor, problem)
         if (allocated(problem)) then
            problem = subject()//': '//problem
            return
         end if
         select case (cursor%kind)
         case (token_value)
            if (next_is_equals(namelist%text, cursor%next)) exit
            call add_value(namelist, cursor%value)
            wants_value = .false.
         case (token_comma)
            if (wants_value) then
               problem = subject()//': an empty value (before a comma)'
               return
            end if
            wants_value = .true.
         case (token_equals)
            problem = subject()//': a second = sign'
            return
         case default
            exit
         end select
      end do
      item%last_value = namelist%value_count
      if (item%last_value < item%first_value) then
         ! at the end of the text a missing slash is the more likely mistake
         if (cursor%kind /= token_end) problem = subject()//': no value after the = sign'
         if (cursor%kind == token_end) problem = subject()//': no value, and no / to close the group'
         return
      end if
      namelist%item_count = namelist%item_count + 1
      namelist%items(namelist%item_count) = item
      namelist%groups(item%group)%last_item = namelist%item_count

   contains

      !> Group and name for messages.
      function subject() result(words)
         character(:), allocatable :: words

         words = marked(namelist%text, group)//' '//excerpt(slice(namelist%text, first, next - 1))
      end function subject

   end subroutine parse_item

   !> Name of a group with its &, printable in messages.
   pure function marked(text, group) result(words)
      character(*), intent(in) :: text
      type(group_t), intent(in) :: group
      character(:), allocatable :: words

      words = excerpt(text(group%first - 1:group%last))
   end function marked


   !> Error message for a group that is not closed before another group or the end of the text.
   pure function not_closed(text, cursor, name, line) result(problem)
      character(*), intent(in) :: text
      !> At the other group or at the end of the text
      type(cursor_t), intent(in) :: cursor
      !> Name of the group with its &
      character(*), intent(in) :: name
      !> Line in which the group begins
      integer, intent(in) :: line
      character(:), allocatable :: problem

      character(:), allocatable :: other

      problem = name//' (from line '//to_text(line)//'): not closed, a / is missing '
      if (cursor%kind == token_end) then
         problem = problem//'before the end of the file'
      else
         other = '&'//excerpt(text(cursor%value%first:cursor%value%last))
         if (other == '&end') then
            problem = name//': close a group with / instead of &end'
         else
            problem = problem//'before '//other
         end if
      end if
   end function not_closed

   !> Append a value to the list of values.
   pure subroutine add_value(namelist, value)
      type(namelist_t), intent(inout) :: namelist
      type(value_t), intent(in) :: value

      type(value_t), allocatable :: larger(:)

      if (namelist%value_count == size(namelist%values)) then
         allocate (larger(2*namelist%value_count))
         larger(:namelist%value_count) = namelist%values
         call move_alloc(larger, namelist%values)
      end if
      namelist%value_count = namelist%value_count + 1
      namelist%values(namelist%value_count) = value
   end subroutine add_value

   !> Index of the group of this name; 0: there is none.
   pure integer function find_group(namelist, name, occurrence) result(position)
      type(namelist_t), intent(in) :: namelist
      !> Name in lower case
      character(*), intent(in) :: name
      !> Number of the group among several of this name; absent: the first
      integer, intent(in), optional :: occurrence

      integer :: remaining

      remaining = 1
      if (present(occurrence)) remaining = occurrence
      do position = 1, namelist%group_count
         associate (group => namelist%groups(position))
            if (is_called(namelist%text, group%first, group%last, name)) remaining = remaining - 1
            if (remaining == 0) return
         end associate
      end do
      position = 0
   end function find_group

   !> Index of the first item of this name in a group; 0: there is none.
   pure integer function find_item(namelist, group, name) result(position)
      type(namelist_t), intent(in) :: namelist
      !> Index of the group
      integer, intent(in) :: group
      !> Name in lower case
      character(*), intent(in) :: name

      do position = namelist%groups(group)%first_item, namelist%groups(group)%last_item
         associate (item => namelist%items(position))
            if (is_called(namelist%text, item%first, item%last, name)) return
         end associate
      end do
      position = 0
   end function find_item

   !> Whether a part of a text equals a name, without regard to case. The lengths are compared first, which is fast for
   !> long texts.
   pure logical function is_called(text, first, last, name) result(equal)
      character(*), intent(in) :: text
      !> First character of the part
      integer, intent(in) :: first
      !> Last character of the part
      integer, intent(in) :: last
      !> The name in lower case; trailing blanks are ignored
      character(*), intent(in) :: name

      equal = last - first + 1 == len_trim(name)
      if (equal) equal = lower_case(text(first:last)) == name
   end function is_called

   !> Name of a group in lower case.
   pure function group_name(namelist, position) result(name)
      type(namelist_t), intent(in) :: namelist
      !> Index of the group
      integer, intent(in) :: position
      character(:), allocatable :: name

      name = lower_case(slice(namelist%text, namelist%groups(position)%first, namelist%groups(position)%last))
   end function group_name

   !> Name of an item in lower case.
   pure function item_name(namelist, position) result(name)
      type(namelist_t), intent(in) :: namelist
      !> Index of the item
      integer, intent(in) :: position
      character(:), allocatable :: name

      name = lower_case(slice(namelist%text, namelist%items(position)%first, namelist%items(position)%last))
   end function item_name

   !> Text of a value as in the file, without its quotes.
   pure function value_text(namelist, position) result(text)
      type(namelist_t), intent(in) :: namelist
      !> Index of the value
      integer, intent(in) :: position
      character(:), allocatable :: text

      text = slice(namelist%text, namelist%values(position)%first, namelist%values(position)%last)
   end function value_text

   !> Text of a value as in the file, with its repeat count and its quotes, shortened for messages.
   pure function value_source(namelist, position) result(text)
      type(namelist_t), intent(in) :: namelist
      !> Index of the value
      integer, intent(in) :: position
      character(:), allocatable :: text

      associate (value => namelist%values(position))
         text = excerpt(slice(namelist%text, value%outer_first, value%outer_last))
      end associate
   end function value_source

   !> Text of all values of an item as in the file, shortened for messages.
   pure function item_text(namelist, position) result(text)
      type(namelist_t), intent(in) :: namelist
      !> Index of the item
      integer, intent(in) :: position
      character(:), allocatable :: text

      integer :: i

      text = ''
      do i = namelist%items(position)%first_value, namelist%items(position)%last_value
         if (len(text) > 0) text = text//', '
         text = text//value_source(namelist, i)
         if (len(text) > 80) exit
      end do
      text = excerpt(text)
   end function item_text

   !> Number of values of an item; repeat counts are included.
   pure integer(i8) function value_count(namelist, position) result(count)
      type(namelist_t), intent(in) :: namelist
      !> Index of the item
      integer, intent(in) :: position

      associate (item => namelist%items(position))
         count = sum(int(namelist%values(item%first_value:item%last_value)%repeat, i8))
      end associate
   end function value_count

   !> End of the message about an item that takes one value but has more: the number of values; for two values such as
   !> 0,5, that a decimal point must replace the comma; for a number and a word such as 10 ms, that no unit may follow.
   pure function further_values(namelist, item) result(words)
      type(namelist_t), intent(in) :: namelist
      integer, intent(in) :: item
      character(:), allocatable :: words

      character(*), parameter :: digits = '0123456789'
      character(*), parameter :: letters = 'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ%'

      words = ', '//to_text(value_count(namelist, item))//' given'
      associate (whole => namelist%values(namelist%items(item)%first_value), text => namelist%text, &
         decimals => namelist%values(namelist%items(item)%last_value))
         if (value_count(namelist, item) /= 2) return
         if (scan(text(whole%last:whole%last), digits//'.') > 0 .and. &
            scan(text(decimals%first:decimals%first), letters) > 0) words = ': no unit may follow it'
         if (decimals%first /= whole%last + 2) return
         if (text(whole%last + 1:whole%last + 1) == ',' .and. verify(text(whole%first:whole%last), '+-'//digits) == 0 &
            .and. verify(text(decimals%first:decimals%last), digits//'eEdD+-') == 0) then
            words = ': decimals have a point, not a comma'
         end if
      end associate
   end function further_values

end module namelist_text
