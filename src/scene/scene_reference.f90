!> Every name that a scene file may have, for the user to read.
module scene_reference
   use name_table, only: table_t
   use name_types, only: entry_t, kind_logical, kind_number, kind_text, kind_whole, kind_word
   use number_text, only: to_text
   use program_identity, only: program_any
   use scene_echo, only: words_of
   use scene_groups, only: list_scene
   use scene_types, only: scene_t
   use value_rules, only: one_of, range_text
   implicit none (type, external)
   private
   public :: reference_t, list_names, reference_table

   !> One name, and all that is said about it.
   type :: reference_t
      character(:), allocatable :: group
      character(:), allocatable :: name
      !> What it is, with its unit, and what it goes with
      character(:), allocatable :: meaning
      !> Values that are allowed
      character(:), allocatable :: allowed
      character(:), allocatable :: default
   end type reference_t

contains

   !> The names, group by group.
   subroutine list_names(names, program)
      type(reference_t), allocatable, intent(out) :: names(:)
      !> Whose groups, a `program_` constant or a sum of them; absent: all
      integer, intent(in), optional :: program

      type(table_t) :: table
      type(scene_t) :: scene
      integer :: i, count, reader

      reader = program_any
      if (present(program)) reader = program
      call list_scene(table, scene)
      allocate (names(table%entry_count))
      count = 0
      do i = 1, table%entry_count
         associate (entry => table%entries(i), group => table%groups(table%entries(i)%group))
            if (iand(group%programs, reader) == 0 .or. group%occurrence > 1) cycle
            count = count + 1
            names(count)%group = trim(group%name)
            names(count)%name = trim(entry%name%name)
            names(count)%meaning = trim(entry%name%meaning)
            if (entry%name%instead_of /= '') then
               names(count)%meaning = names(count)%meaning//'; instead of '//trim(entry%name%instead_of)
            end if
            if (table%phrase(i) /= '') names(count)%meaning = names(count)%meaning//'; goes with '//table%phrase(i)
            if (group%repeats .and. entry%name%sweep%order > 0) then
               names(count)%meaning = names(count)%meaning &
                  //'; of the second &'//trim(group%name)//' a sweep calls it '//&
                  trim(group%name)//'_2_'//trim(entry%name%name)
            end if
            names(count)%allowed = allowed_in(entry)
            names(count)%default = default_of(entry)
         end associate
      end do
      names = names(:count)
   end subroutine list_names

   !> What a value may be, in words.
   pure function allowed_in(entry) result(text)
      type(entry_t), intent(in) :: entry
      character(:), allocatable :: text

      select case (entry%kind)
      case (kind_number)
         text = 'number'//trim(merge('s', ' ', entry%is_list))//' '//range_text(entry%name%range)
      case (kind_whole)
         text = 'whole number'//trim(merge('s', ' ', entry%is_list))//' '//range_text(entry%name%range)
      case (kind_word)
         text = one_of(entry%words)
         if (entry%is_list) text = 'some of '//text
      case (kind_logical)
         text = '.true. or .false.'
      case default
         text = 'text in quotes, '//to_text(nint(entry%name%range%least))//' to ' &
            //to_text(nint(entry%name%range%most))//' characters'
      end select
   end function allowed_in

   !> The value where the file gives none, in words.
   pure function default_of(entry) result(text)
      type(entry_t), intent(in) :: entry
      character(:), allocatable :: text

      text = ''
      if (entry%name%default /= '') then
         text = trim(entry%name%default)
      else if (entry%name%instead_of /= '') then
         return
      else if (any(entry%kind == [kind_logical, kind_text, kind_word])) then
         text = words_of(entry)
      else if (.not. entry%is_list) then
         text = to_text(entry%value)
         if (entry%kind == kind_whole) text = to_text(nint(entry%value))
      end if
   end function default_of

   !> The same as a table in Markdown, lines separated by new_line('a').
   subroutine reference_table(text, program)
      character(:), allocatable, intent(out) :: text
      !> Whose groups, a `program_` constant or a sum of them; absent: all
      integer, intent(in), optional :: program

      type(reference_t), allocatable :: names(:)
      integer :: i

      call list_names(names, program)
      text = '| group | name | value | default | meaning |'//new_line('a')//'|---|---|---|---|---|'//new_line('a')
      do i = 1, size(names)
         text = text//'| `&'//names(i)%group//'` | `'//names(i)%name//'` | '//without_bars(names(i)%allowed)//' | ' &
            //names(i)%default//' | '//without_bars(names(i)%meaning)//' |'//new_line('a')
      end do
   end subroutine reference_table

   !> A text for a cell of a table: bars, which would end the cell, escaped.
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

end module scene_reference
