!> The names that a scene can contain, listed for users in columns or as a table in Markdown.
module name_list
   use failures, only: fail, failure_t, status_bad_input
   use measure_list, only: demand_of, first_of_stops, likewise_measured, measure_count, measure_status, measure_table, &
      measured_groups, statistics_of_stop
   use namelist_tokens, only: lower_case
   use process, only: open_text, text_of
   use quantities, only: units_t, words_in
   use scene_reference, only: hint_for_group, list_names, reference_t
   use table_columns, only: print_line
   implicit none (type, external)
   private
   public :: write_names

contains

   !> List all names, or the names of a group, or the measures. The names of a sweep that give values of its parameters
   !> are replaced by the patterns NAME, NAME_range, NAME_log_range and NAME_points.
   subroutine write_names(program, group, is_markdown, text, error)
      !> Program whose names are listed, one of the `program_` constants
      integer, intent(in) :: program
      !> Group as the user wrote it, or `measures`; empty: all groups
      character(*), intent(in) :: group
      logical, intent(in) :: is_markdown
      !> Lines ended by new_line('a')
      character(:), allocatable, intent(out) :: text
      !> Set if there is no such group
      type(failure_t), allocatable, intent(inout) :: error

      character, parameter :: line_end = new_line('a')
      type(reference_t), allocatable :: names(:)
      character(:), allocatable :: wanted
      integer, allocatable :: selected(:)
      integer :: i, unit

      text = ''
      call list_names(names, program)
      wanted = lower_case(group)
      if (index(wanted, '&') == 1) wanted = wanted(2:)
      if (wanted == 'measures') then
         call list_measures(names)
      else
         selected = pack([(i, i=1, size(names))], [(wanted == '' .or. names(i)%group == wanted, i=1, size(names))])
         names = names(selected)
      end if
      ! the measures are mentioned unless the hint proposes a similar group with a question
      if (size(names) == 0) then
         call fail(error, status_bad_input, '--names '//group//': there is no such group; '// &
            hint_for_group(program, wanted)//trim(merge('; measures: the results of a run', repeat(' ', 32), &
            index(hint_for_group(program, wanted), '?') == 0)))
         return
      end if
      call replace_by_patterns(names)
      call refer_to_lists(names)
      if (is_markdown) then
         text = '| group | name | value | default | meaning |'//line_end//'|---|---|---|---|---|'//line_end
         do i = 1, size(names)
            text = text//'| `'//heading_of(names(i)%group)//'` | `'//names(i)%name//'` | ' &
               //without_bars(names(i)%allowed)//' | '//names(i)%default//' | '//without_bars(names(i)%meaning)//' |' &
               //line_end
         end do
      else
         call open_text(unit, error)
         if (allocated(error)) return
         call print_names(unit, names)
         call text_of(unit, text, error)
      end if
   end subroutine write_names

   !> Replace a long list of allowed words by a reference to the first name that has the same list.
   subroutine refer_to_lists(names)
      type(reference_t), intent(inout) :: names(:)

      character(*), parameter :: some_of = 'some of '
      ! length in characters from which on a list is not repeated
      integer, parameter :: long_list = 400
      ! position in a list at which its words start
      integer :: start
      integer :: i, k

      do i = size(names), 2, -1
         if (len(names(i)%allowed) < long_list) cycle
         start = 1
         if (index(names(i)%allowed, some_of) == 1) start = len(some_of) + 1
         do k = 1, i - 1
            associate (first => names(k)%allowed)
               if (first /= names(i)%allowed(start:) .and. first /= some_of//names(i)%allowed(start:)) cycle
            end associate
            names(i)%allowed = trim(merge('one of  ', some_of, start == 1))//' those of &'//names(k)%group//' ' &
               //names(k)%name
            exit
         end do
      end do
   end subroutine refer_to_lists

   !> List the measures of a run, each with its quantity and the group that it needs; of the statistics of single stops
   !> only those of the first stop.
   subroutine list_measures(names)
      type(reference_t), allocatable, intent(out) :: names(:)

      integer :: count, i

      allocate (names(measure_count))
      count = 0
      do i = measure_status + 1, measure_count
         if (i >= first_of_stops + size(statistics_of_stop) .and. &
            i < first_of_stops + size(measured_groups)*size(statistics_of_stop)) cycle
         count = count + 1
         associate (measure => measure_table(i), name => names(count))
            name%group = 'measures'
            name%name = trim(measure%name)
            name%allowed = trim(measure%quantity)
            if (measure%group /= '') name%allowed = name%allowed//'; '//demand_of(measure%group)
            name%default = ''
            name%meaning = words_in(units_t(are_physical=.true.), trim(measure%meaning))
            if (i >= first_of_stops .and. i < first_of_stops + size(statistics_of_stop)) name%meaning = name%meaning &
               //likewise_measured
         end associate
      end do
      names = names(:count)
   end subroutine list_measures

   !> Replace the names of every swept parameter by four names that stand for any parameter.
   subroutine replace_by_patterns(names)
      type(reference_t), allocatable, intent(inout) :: names(:)

      ! name, allowed values and meaning of each of the four names
      character(*), parameter :: pattern(3, 4) = reshape([character(59) :: &
         'NAME', 'numbers in the range of that name', 'values of NAME, which is one of the names allowed for carry', &
         'NAME_range', 'two such numbers; not for names of whole numbers', 'minimum and maximum, divided evenly', &
         'NAME_log_range', 'two such numbers; not for names of whole numbers', &
         'the same, evenly on a logarithmic scale', &
         'NAME_points', 'whole number from 2 to 1e6', 'number of values in the range'], [3, 4])
      integer, allocatable :: remaining(:), swept(:)
      integer :: i

      swept = pack([(i, i=1, size(names))], names%is_swept)
      if (size(swept) == 0) return
      do i = 1, size(pattern, 2)
         names(swept(i))%name = trim(pattern(1, i))
         names(swept(i))%allowed = trim(pattern(2, i))
         names(swept(i))%meaning = trim(pattern(3, i))
         names(swept(i))%is_swept = .false.
      end do
      remaining = pack([(i, i=1, size(names))], .not. names%is_swept)
      names = names(remaining)
   end subroutine replace_by_patterns

   !> Print names in columns, group by group.
   subroutine print_names(unit, names)
      integer, intent(in) :: unit
      !> Names, ordered by group
      type(reference_t), intent(in) :: names(:)

      character(:), allocatable :: group, allowed
      integer :: i, k, width

      group = ''
      width = 0
      do i = 1, size(names)
         if (names(i)%group /= group) then
            if (i > 1) write (unit, '()')
            group = names(i)%group
            write (unit, '(a)') heading_of(group)
            width = 2 + maxval([(len(names(k)%name), k=1, size(names))], &
               mask=[(names(k)%group == group, k=1, size(names))])
         end if
         allowed = names(i)%allowed
         if (names(i)%default /= '') allowed = allowed//'; default '//names(i)%default
         call print_line(unit, names(i)%name, allowed, width)
         call print_line(unit, '', names(i)%meaning, width)
      end do
   end subroutine print_names

   !> A group as scenes begin it; `measures` is not a group.
   pure function heading_of(group) result(heading)
      character(*), intent(in) :: group
      character(:), allocatable :: heading

      heading = trim(merge(' ', '&', group == 'measures'))//group
   end function heading_of

   !> A text for a cell of a table, with bars escaped because they would end the cell.
   pure function without_bars(text) result(cell)
      character(*), intent(in) :: text
      character(:), allocatable :: cell

      integer :: i

      cell = ''
      do i = 1, len(text)
         if (text(i:i) == '|') cell = cell//'\'
         cell = cell//text(i:i)
      end do
   end function without_bars

end module name_list
