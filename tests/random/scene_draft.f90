!> A scene being written: names with their values, group by group, and the namelist text of them.
module scene_draft
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: draft_t, draft_of, put, drop, has_name, value_of, number_of, text_of, numbered, mend, save_text

   !> Groups of which a scene may have several.
   character(*), parameter :: repeating(6) = [character(7) :: 'stop', 'body', 'support', 'mass', 'force', 'base']
   !> Longest value.
   integer, parameter :: room = 600

   !> A name and its value; without a name: the group is there.
   type :: line_t
      character(24) :: group = ''
      character(48) :: name = ''
      character(room) :: value = ''
   end type line_t

   type :: draft_t
      type(line_t), allocatable :: lines(:)
      integer :: count = 0
   end type draft_t

contains

   !> A scene from its names and values: 'mesh elements 8; stop position 0.5'.
   pure function draft_of(text) result(draft)
      !> Group, name and value, separated by semicolons
      character(*), intent(in) :: text
      type(draft_t) :: draft

      character(:), allocatable :: rest, group, name

      rest = text//';'
      do while (rest /= '')
         rest = adjustl(rest)
         group = word_in(rest)
         rest = adjustl(rest(len(group) + 1:))
         name = word_in(rest)
         call put(draft, group, name, adjustl(rest(len(name) + 1:index(rest, ';') - 1)))
         rest = rest(index(rest, ';') + 1:)
      end do
   end function draft_of

   !> Where a name stands; 0: nowhere.
   pure function parameter_index(draft, group, name) result(place)
      !> The scene
      type(draft_t), intent(in) :: draft
      !> The name
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      integer :: place

      do place = draft%count, 1, -1
         if (draft%lines(place)%group == group .and. draft%lines(place)%name == name) return
      end do
   end function parameter_index

   !> Is the name there?
   pure function has_name(draft, group, name) result(has)
      !> The scene
      type(draft_t), intent(in) :: draft
      !> The name
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      logical :: has

      has = parameter_index(draft, group, name) > 0
   end function has_name

   !> The value of a name; blank: it is not there.
   pure function value_of(draft, group, name) result(value)
      !> The scene
      type(draft_t), intent(in) :: draft
      !> The name
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      character(room) :: value

      value = ''
      if (has_name(draft, group, name)) value = draft%lines(parameter_index(draft, group, name))%value
   end function value_of

   !> The value of a name that is there, as a number.
   function number_of(draft, group, name) result(number)
      !> The scene
      type(draft_t), intent(in) :: draft
      !> The name
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      real(wp) :: number

      character(room) :: value

      value = value_of(draft, group, name)
      read (value, *) number
   end function number_of

   !> Give a name a value, whatever it had.
   pure subroutine put(draft, group, name, value)
      !> The scene
      type(draft_t), intent(inout) :: draft
      !> The name
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      !> Its value as it stands in the file
      character(*), intent(in) :: value

      type(line_t), allocatable :: more(:)
      integer :: place

      if (.not. allocated(draft%lines)) allocate (draft%lines(64))
      place = parameter_index(draft, group, name)
      if (place == 0) then
         if (draft%count == size(draft%lines)) then
            allocate (more(2*draft%count))
            more(:draft%count) = draft%lines
            call move_alloc(more, draft%lines)
         end if
         ! repeated groups stand in the order of their numbers, as the program counts them as they stand
         do place = 1, draft%count
            if (base_of(draft%lines(place)%group) == base_of(group) .and. draft%lines(place)%group > group) exit
         end do
         draft%lines(place + 1:draft%count + 1) = draft%lines(place:draft%count)
         draft%count = draft%count + 1
      end if
      draft%lines(place) = line_t(group, name, value)
   end subroutine put

   !> Take a name out, or, without a name, the whole group.
   pure subroutine drop(draft, group, name)
      !> The scene
      type(draft_t), intent(inout) :: draft
      !> The group
      character(*), intent(in) :: group
      !> The name
      character(*), intent(in) :: name

      integer :: i, kept

      kept = 0
      do i = 1, draft%count
         if (draft%lines(i)%group == group .and. (draft%lines(i)%name == name .or. name == '')) cycle
         kept = kept + 1
         draft%lines(kept) = draft%lines(i)
      end do
      draft%count = kept
   end subroutine drop

   !> The namelist text.
   pure function text_of(draft) result(text)
      !> The scene
      type(draft_t), intent(in) :: draft
      character(:), allocatable :: text

      integer :: i, k

      text = ''
      do i = 1, draft%count
         if (any(draft%lines(:i - 1)%group == draft%lines(i)%group)) cycle
         text = text//'&'//base_of(draft%lines(i)%group)
         do k = i, draft%count
            if (draft%lines(k)%group /= draft%lines(i)%group .or. draft%lines(k)%name == '') cycle
            text = text//new_line('a')//'   '//trim(draft%lines(k)%name)//' = '//trim(draft%lines(k)%value)
         end do
         text = text//' /'//new_line('a')
      end do
   end function text_of

   !> The scene with its repeated groups numbered without a gap, as the program counts them.
   pure function numbered(draft) result(same)
      !> The scene
      type(draft_t), intent(in) :: draft
      type(draft_t) :: same

      character(:), allocatable :: base
      character(2) :: number
      integer :: i, k, place

      same = draft
      do k = 1, size(repeating)
         base = trim(repeating(k))
         place = 0
         do i = 1, draft%count
            if (base_of(draft%lines(i)%group) /= base) cycle
            if (any(draft%lines(:i - 1)%group == draft%lines(i)%group)) cycle
            place = place + 1
            number = '_'//achar(iachar('0') + place)
            if (base == 'stop' .and. place == 1) number = ''
            where (draft%lines(:draft%count)%group == draft%lines(i)%group) same%lines(:draft%count)%group = base//number
         end do
      end do
   end function numbered

   !> The name of a group in a file: 'stop' of 'stop_2'.
   pure function base_of(group) result(base)
      character(*), intent(in) :: group
      character(:), allocatable :: base

      integer :: k

      base = trim(group)
      do k = 1, size(repeating)
         if (index(base, trim(repeating(k))//'_') == 1) base = trim(repeating(k))
      end do
   end function base_of

   !> The group in the draft that stands in a line of its text.
   pure function group_in_line(draft, message) result(group)
      type(draft_t), intent(in) :: draft
      !> It begins with the line, `:LINE:`
      character(*), intent(in) :: message
      character(:), allocatable :: group

      integer :: k, last, line, code

      group = ''
      read (message(2:index(message(2:), ':')), *, iostat=code) last
      if (code /= 0) return
      line = 0
      do k = 1, draft%count
         if (any(draft%lines(:k - 1)%group == draft%lines(k)%group)) cycle
         ! its lines begin with its name, and end where the next begins
         line = line + 1
         if (line > last) return
         group = trim(draft%lines(k)%group)
         line = line + count(draft%lines(:draft%count)%group == group .and. draft%lines(:draft%count)%name /= '')
      end do
   end function group_in_line

   !> Take out what the reader refuses, going by its message: `FILE:LINE: &group name = ...` names it.
   pure subroutine mend(draft, message, is_mended)
      !> The scene
      type(draft_t), intent(inout) :: draft
      !> What the reader says
      character(*), intent(in) :: message
      !> False: the message names nothing that could be taken out
      logical, intent(out) :: is_mended

      character(:), allocatable :: group, name, rest
      integer :: before

      before = draft%count
      rest = message(index(message, '&') + 1:)
      group = word_in(rest)
      rest = rest(len(group) + 1:)
      if (any(group == repeating)) group = group_in_line(draft, message)
      if (index(rest, ': give ') == 1) then
         name = word_in(rest(8:))
      else
         name = word_in(rest(2:))
      end if
      if (name /= '' .and. has_name(draft, group, name)) then
         call drop(draft, group, name)
      else if (any(draft%lines(:before)%group == group .and. draft%lines(:before)%name /= '')) then
         ! a default that does not fit the rest
         call drop(draft, group, trim(draft%lines(findloc(draft%lines(:before)%group == group .and. &
            draft%lines(:before)%name /= '', .true., dim=1))%name))
      else
         call drop(draft, group, '')
      end if
      is_mended = draft%count < before
   end subroutine mend

   !> The name at the start of a text.
   pure function word_in(text) result(word)
      !> The text
      character(*), intent(in) :: text
      character(:), allocatable :: word

      word = text(:verify(text//' ', 'abcdefghijklmnopqrstuvwxyz_0123456789') - 1)
   end function word_in

   !> Write a text to a file.
   subroutine save_text(file, text)
      !> Name of the file
      character(*), intent(in) :: file
      !> The text
      character(*), intent(in) :: text

      integer :: unit

      open (newunit=unit, file=file, status='replace', action='write', access='stream')
      write (unit) text
      close (unit)
   end subroutine save_text

end module scene_draft
