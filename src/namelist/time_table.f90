!> Reading of the table of a load or of a motion of the base: a text file with two columns, times and values.
module time_table
   use file_system, only: load_text
   use kinds, only: wp
   use name_types, only: range_text, signed_range
   use namelist_tokens, only: normalise_lines
   use namelist_values, only: read_real
   use number_text, only: to_text
   use printable_text, only: occurrences, excerpt
   implicit none (type, external)
   private
   public :: read_time_table

   !> Separators between a time and a value: blank, comma, semicolon, tab
   character(*), parameter :: separators = ' ,;'//achar(9)

contains

   !> Read a file with one time and one value in each line; # and ! begin comments, and empty lines are ignored.
   subroutine read_time_table(file, time, value, problem)
      character(*), intent(in) :: file
      !> Times in the order of the file
      real(wp), allocatable, intent(out) :: time(:)
      !> Values at these times
      real(wp), allocatable, intent(out) :: value(:)
      !> Error message with file and line; unallocated: no error
      character(:), allocatable, intent(out) :: problem

      character(:), allocatable :: raw, text, reason
      real(wp), allocatable :: numbers(:, :)
      ! first position of a line
      integer :: first
      ! last position of the line
      integer :: last
      ! number of characters of the rest of the text up to the next line break, with it; 0: there is none
      integer :: length
      integer :: line, rows

      call load_text(file, raw, problem)
      if (allocated(problem)) then
         problem = file//': '//problem
         return
      end if
      call normalise_lines(raw, text)
      allocate (numbers(2, 1 + occurrences(new_line('a'), text)))
      first = 1
      line = 0
      rows = 0
      do while (first <= len(text))
         line = line + 1
         length = index(text(first:), new_line('a'))
         last = merge(first + length - 2, len(text), length > 0)
         ! # is appended so that the search succeeds in a line without comment
         call read_row(text(first:first + scan(text(first:last)//'#', '#!') - 2), numbers(:, rows + 1), rows, reason)
         if (allocated(reason)) then
            problem = file//':'//to_text(line)//': '//reason
            return
         end if
         if (rows > 1) then
            if (numbers(1, rows) <= numbers(1, rows - 1)) then
               problem = file//':'//to_text(line)//': times must be ascending; '//to_text(numbers(1, rows)) &
                  //' follows '//to_text(numbers(1, rows - 1))
               return
            end if
         end if
         first = last + 2
      end do
      allocate (time, source=numbers(1, :rows))
      allocate (value, source=numbers(2, :rows))
   end subroutine read_time_table

   !> Read the two numbers of a line from which a comment has been removed.
   pure subroutine read_row(row, numbers, rows, reason)
      character(*), intent(in) :: row
      !> Time and value
      real(wp), intent(inout) :: numbers(2)
      !> Number of rows read so far; increased by one unless the line is empty
      integer, intent(inout) :: rows
      !> Error message; unallocated: no error
      character(:), allocatable, intent(out) :: reason

      real(wp) :: number
      integer :: first, last, k
      logical :: is_legal

      ! a line must have exactly two words, which are numbers; the third pass only detects a further word. Adjacent
      ! separators count as one, so an empty column is not detected
      last = 0
      do k = 1, 3
         first = verify(row(last + 1:), separators)
         if (first == 0) exit
         first = last + first
         ! a second separator between both words encloses an empty column
         if (k == 2 .and. occurrences(',', row(last + 1:first)) + occurrences(';', row(last + 1:first)) > 1) exit
         last = first + scan(row(first:)//' ', separators) - 2
         if (k > 2) exit
         call read_real(row(first:last), number, is_legal, reason)
         ! k is 1 or 2 here; `min` makes that evident to the compiler
         numbers(min(k, 2)) = number
         if (is_legal .and. abs(number) <= signed_range%maximum) cycle
         if (.not. allocated(reason)) reason = 'must be a number '//range_text(signed_range)
         reason = excerpt(row(first:last))//' '//reason
         return
      end do
      ! the line has k - 1 words, or more than two if k = 3 and `first` > 0
      if (k == 1) return
      rows = rows + 1
      if (k /= 3 .or. first > 0) reason = 'must have two columns, a time and a value, with decimal points'
   end subroutine read_row

end module time_table
