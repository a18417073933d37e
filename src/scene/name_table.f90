!> The names of scene files as data: one entry a name, which says all that is known about it and holds its value.
!>
!> A procedure that lists names (`list_group` of `scene_groups`) opens groups and binds entries to the components of a
!> scene; a quantity in units has none, the ratio that stands for it has. It is gone through to fill the table with the
!> scene's values, and again to give the scene what the table has by then, so a name and its component stand together in
!> one statement. Reading a file, the echo, the reference, sweeps and cases work on the table alone.
module name_table
   use kinds, only: wp
   use name_types, only: entry_t, group_t, kind_logical, kind_number, kind_text, kind_whole, kind_word, name_room, &
      name_t
   use number_text, only: to_text
   use value_rules, only: range_t
   implicit none (type, external)
   private
   public :: table_t, is_among, most_repeats

   !> Most groups of one name; all their names are fewer than `namelist_text` takes apart.
   integer, parameter :: most_repeats = 500

   type :: table_t
      !> In the order in which they were listed; only the first `*_count` are meant
      type(group_t), allocatable :: groups(:)
      type(entry_t), allocatable :: entries(:)
      integer :: group_count = 0
      integer :: entry_count = 0
      !> What is listed is put at the end; the table gets its values, or gives it those it has
      logical, private :: grows = .true.
      logical, private :: takes = .true.
      logical, private :: gives = .false.
      !> It gives only what has changed
      logical, private :: gives_changes = .false.
      !> The only name that gets a value, and in which of several groups of a name; empty: all
      character(name_room), private :: only = ''
      integer, private :: only_in = 1
      !> The group that is open, and the entry whose turn it is
      integer, private :: open_group = 0
      integer, private :: now = 0
      !> The names of the group that was opened last are to be listed
      logical :: is_open = .true.
      !> Groups of the file, for those that may be given several times; unallocated: there is no file
      character(name_room), allocatable, private :: groups_given(:)
   contains
      procedure :: expect_groups
      procedure :: give_values
      procedure :: take_values
      procedure :: give_one
      procedure :: change
      procedure :: give_changes
      procedure :: times
      procedure :: open
      procedure :: open_numbered
      procedure :: keep
      generic :: bind => bind_real, bind_integer, bind_logical, bind_text, bind_reals, bind_integers
      procedure :: find_group
      procedure :: find
      procedure :: has
      procedure :: has_either
      procedure :: number
      procedure :: counts
      procedure :: range_of
      procedure, private :: bind_real, bind_integer, bind_logical, bind_text, bind_reals, bind_integers, advance
   end type table_t

contains

   !> Names will be listed for a file.
   subroutine expect_groups(table, names)
      class(table_t), intent(inout) :: table
      !> The file's groups in small letters, once for each time that one is given
      character(*), intent(in) :: names(:)

      table%groups_given = names
   end subroutine expect_groups

   !> The same names are listed again and get the values of the table.
   subroutine give_values(table)
      class(table_t), intent(inout) :: table

      table%grows = .false.
      table%takes = .false.
      table%gives = .true.
      table%gives_changes = .false.
      table%open_group = 0
      table%now = 0
   end subroutine give_values

   !> The same names are listed again and the table gets their values.
   subroutine take_values(table)
      class(table_t), intent(inout) :: table

      call table%give_values()
      table%takes = .true.
      table%gives = .false.
   end subroutine take_values

   !> Of the names that are listed this one gets a value; the table keeps none of them.
   subroutine give_one(table, occurrence, name, value)
      class(table_t), intent(inout) :: table
      !> Which of several groups
      integer, intent(in) :: occurrence
      character(*), intent(in) :: name
      real(wp), intent(in) :: value

      call table%give_values()
      table%only = name
      table%only_in = occurrence
      allocate (table%groups(1), table%entries(1))
      table%entries%value = value
      table%entries(1)%list = [value]
   end subroutine give_one

   !> Another value of an entry.
   subroutine change(table, place, value)
      class(table_t), intent(inout) :: table
      integer, intent(in) :: place
      !> One number, or those of a list
      real(wp), intent(in) :: value(:)

      associate (entry => table%entries(place))
         if (entry%is_list) then
            entry%list = value
         else
            entry%value = value(1)
         end if
         entry%is_changed = .true.
         table%groups(table%find_group(table%groups(entry%group)%name))%is_changed = .true.
      end associate
   end subroutine change

   !> The names of one group are listed again and get the values that have changed, even of a group that the scene does
   !> not ask for.
   subroutine give_changes(table, group)
      class(table_t), intent(inout) :: table
      !> Its place, of several of a name that of the first
      integer, intent(in) :: group

      call table%give_values()
      table%gives_changes = .true.
      table%open_group = group - 1
      table%now = table%groups(group)%first_entry - 1
      table%groups(group)%is_changed = .false.
   end subroutine give_changes

   !> How often a group that may be given several times is to be opened: once at least, so that its names are known.
   pure function times(table, group, in_scene) result(number)
      class(table_t), intent(in) :: table
      character(*), intent(in) :: group
      !> So many the scene has
      integer, intent(in) :: in_scene
      integer :: number

      if (table%only /= '') then
         number = in_scene
      else if (.not. table%grows) then
         number = count(table%groups(:table%group_count)%name == group)
      else
         number = max(1, in_scene)
         if (allocated(table%groups_given)) number = max(number, min(most_repeats, count(table%groups_given == group)))
      end if
   end function times

   !> The names to come belong to this group; unless `is_open` says that they do not matter.
   subroutine open(table, group, is_wanted)
      class(table_t), intent(inout) :: table
      type(group_t), intent(in) :: group
      !> The scene asks for it; absent: every scene may have it
      logical, intent(inout), optional :: is_wanted

      type(group_t), allocatable :: more(:)

      table%is_open = .true.
      if (table%only /= '') then
         table%is_open = group%occurrence == table%only_in
         return
      end if
      table%open_group = table%open_group + 1
      if (table%gives_changes) return
      if (table%grows) then
         if (.not. allocated(table%groups)) allocate (table%groups(16))
         if (table%open_group > size(table%groups)) then
            allocate (more(2*table%group_count))
            more(:table%group_count) = table%groups
            call move_alloc(more, table%groups)
         end if
         table%group_count = table%open_group
         table%groups(table%group_count) = group
         if (group%label == '') table%groups(table%group_count)%label = group%name
         table%groups(table%group_count)%first_entry = table%now + 1
         table%groups(table%group_count)%last_entry = table%now
      end if
      associate (opened => table%groups(table%open_group))
         if (table%takes) opened%is_wanted = .true.
         if (.not. present(is_wanted)) return
         if (table%takes) opened%is_wanted = is_wanted
         if (table%gives) is_wanted = opened%is_wanted
         table%is_open = is_wanted .or. table%grows
         if (.not. table%is_open) table%now = opened%last_entry
      end associate
   end subroutine open

   !> One of several groups, of which even the first is called by its number.
   subroutine open_numbered(table, group, which, is_wanted)
      class(table_t), intent(inout) :: table
      character(*), intent(in) :: group
      integer, intent(in) :: which
      !> The scene asks for one at least
      logical, intent(inout) :: is_wanted

      type(group_t) :: opened

      opened = group_t(group, repeats=.true., occurrence=which, label=group//'_'//to_text(which))
      if (which == 1) then
         call table%open(opened, is_wanted)
      else
         call table%open(opened)
      end if
   end subroutine open_numbered

   !> A name without a component: its value stays in the table.
   subroutine keep(table, name, kind, is_list)
      class(table_t), intent(inout) :: table
      type(name_t), intent(in) :: name
      !> One of the `kind_` constants; absent: a number
      integer, intent(in), optional :: kind
      !> Absent: it is none
      logical, intent(in), optional :: is_list

      integer :: own_kind
      logical :: own_list

      own_kind = kind_number
      if (present(kind)) own_kind = kind
      own_list = .false.
      if (present(is_list)) own_list = is_list
      call table%advance(name, own_kind, own_list)
   end subroutine keep

   !> A number.
   subroutine bind_real(table, value, name)
      class(table_t), intent(inout) :: table
      real(wp), intent(inout) :: value
      type(name_t), intent(in) :: name

      call table%advance(name, kind_number, .false.)
      associate (entry => table%entries(table%now))
         if (table%takes) entry%value = value
         if (table%gives) value = entry%value
      end associate
   end subroutine bind_real

   !> A whole number, or one of some words, whose place in them it is; 0: none.
   subroutine bind_integer(table, value, name, words)
      class(table_t), intent(inout) :: table
      integer, intent(inout) :: value
      type(name_t), intent(in) :: name
      character(*), intent(in), optional :: words(:)

      call table%advance(name, kind_whole, .false., words)
      associate (entry => table%entries(table%now))
         if (table%takes) entry%value = real(value, wp)
         if (table%gives) value = nint(entry%value)
      end associate
   end subroutine bind_integer

   subroutine bind_logical(table, value, name)
      class(table_t), intent(inout) :: table
      logical, intent(inout) :: value
      type(name_t), intent(in) :: name

      call table%advance(name, kind_logical, .false.)
      associate (entry => table%entries(table%now))
         if (table%takes) entry%value = merge(1.0_wp, 0.0_wp, value)
         if (table%gives) value = nint(entry%value) == 1
      end associate
   end subroutine bind_logical

   !> A text of one line.
   subroutine bind_text(table, value, name)
      class(table_t), intent(inout) :: table
      character(:), allocatable, intent(inout) :: value
      type(name_t), intent(in) :: name

      call table%advance(name, kind_text, .false.)
      associate (entry => table%entries(table%now))
         if (table%takes .and. allocated(value)) entry%text = value
         if (table%gives .and. allocated(entry%text)) value = entry%text
      end associate
   end subroutine bind_text

   !> A list of numbers, or of whole numbers that the scene holds as reals.
   subroutine bind_reals(table, value, name, are_whole)
      class(table_t), intent(inout) :: table
      real(wp), allocatable, intent(inout) :: value(:)
      type(name_t), intent(in) :: name
      logical, intent(in), optional :: are_whole

      call table%advance(name, kind_number, .true.)
      associate (entry => table%entries(table%now))
         if (present(are_whole)) entry%kind = merge(kind_whole, kind_number, are_whole)
         if (table%takes .and. allocated(value)) entry%list = value
         if (table%gives .and. allocated(entry%list)) value = entry%list
      end associate
   end subroutine bind_reals

   !> A list of whole numbers, or some of some words, whose places in them they are.
   subroutine bind_integers(table, value, name, words)
      class(table_t), intent(inout) :: table
      integer, allocatable, intent(inout) :: value(:)
      type(name_t), intent(in) :: name
      character(*), intent(in), optional :: words(:)

      call table%advance(name, kind_whole, .true., words)
      associate (entry => table%entries(table%now))
         if (table%takes .and. allocated(value)) entry%list = real(value, wp)
         if (table%gives .and. allocated(entry%list)) value = nint(entry%list)
      end associate
   end subroutine bind_integers

   !> It is the turn of the next entry; filling, it is put into the group that is open.
   subroutine advance(table, name, kind, is_list, words)
      class(table_t), intent(inout) :: table
      type(name_t), intent(in) :: name
      !> Its kind without words
      integer, intent(in) :: kind
      logical, intent(in) :: is_list
      character(*), intent(in), optional :: words(:)

      type(entry_t), allocatable :: more(:)

      if (table%only /= '') then
         table%now = 1
         table%gives = name%name == table%only
         return
      end if
      table%now = table%now + 1
      if (table%gives_changes) then
         table%gives = table%entries(table%now)%is_changed
         table%entries(table%now)%is_changed = .false.
      end if
      if (.not. table%grows) return
      if (.not. allocated(table%entries)) allocate (table%entries(160))
      if (table%now > size(table%entries)) then
         allocate (more(2*table%entry_count))
         more(:table%entry_count) = table%entries
         call move_alloc(more, table%entries)
      end if
      table%entry_count = table%now
      associate (entry => table%entries(table%now))
         entry%group = table%open_group
         table%groups(table%open_group)%last_entry = table%now
         entry%name = name
         entry%kind = kind
         entry%is_list = is_list
         if (.not. present(words)) return
         entry%kind = kind_word
         allocate (entry%words(size(words)))
         entry%words(:) = words
      end associate
   end subroutine advance

   !> Place of a group; 0: there is none.
   pure function find_group(table, name, occurrence) result(place)
      class(table_t), intent(in) :: table
      character(*), intent(in) :: name
      !> Which of several; absent: the first
      integer, intent(in), optional :: occurrence
      integer :: place

      integer :: wanted

      wanted = 1
      if (present(occurrence)) wanted = occurrence
      do place = table%group_count, 1, -1
         if (table%groups(place)%name == name .and. table%groups(place)%occurrence == wanted) exit
      end do
   end function find_group

   !> Place of an entry; 0: there is none.
   pure function find(table, group, name) result(place)
      class(table_t), intent(in) :: table
      !> Place of its group
      integer, intent(in) :: group
      character(*), intent(in) :: name
      integer :: place

      do place = table%groups(group)%first_entry, table%groups(group)%last_entry
         if (table%entries(place)%name%name == name) return
      end do
      place = 0
   end function find

   !> Does the file give a name?
   pure function has(table, group, name, occurrence)
      class(table_t), intent(in) :: table
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      !> Which of several groups; absent: the first
      integer, intent(in), optional :: occurrence
      logical :: has

      has = table%entries(table%find(table%find_group(group, occurrence), name))%is_given
   end function has

   !> Does the file give a name, or in units what stands for it?
   pure function has_either(table, group, name, occurrence) result(has)
      class(table_t), intent(in) :: table
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      !> Which of several groups; absent: the first
      integer, intent(in), optional :: occurrence
      logical :: has

      associate (opened => table%groups(table%find_group(group, occurrence)))
         associate (entries => table%entries(opened%first_entry:opened%last_entry))
            has = any(entries%is_given .and. (entries%name%name == name .or. entries%name%instead_of == name))
         end associate
      end associate
   end function has_either

   !> The value of a name.
   pure function number(table, group, name, occurrence)
      class(table_t), intent(in) :: table
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      !> Which of several groups; absent: the first
      integer, intent(in), optional :: occurrence
      real(wp) :: number

      number = table%entries(table%find(table%find_group(group, occurrence), name))%value
   end function number

   !> Is what an entry needs there?
   pure function counts(table, place)
      class(table_t), intent(in) :: table
      integer, intent(in) :: place
      logical :: counts

      integer :: group, i

      counts = .true.
      associate (needs => table%entries(place)%name%needs)
         group = table%entries(place)%group
         if (needs%group /= '') group = table%find_group(needs%group, needs%occurrence)
         if (needs%name /= '') then
            associate (other => table%entries(table%find(group, needs%name)))
               if (other%kind == kind_word) counts = nint(other%value) > 0
               if (other%kind == kind_word .and. counts) then
                  counts = is_among(other%words(nint(other%value)), needs%words)
               end if
               if (other%kind == kind_logical) counts = nint(other%value) == 1
            end associate
         else if (needs%without /= '') then
            do i = table%groups(group)%first_entry, table%groups(group)%last_entry
               if (.not. table%entries(i)%is_given) cycle
               if (is_among(table%entries(i)%name%name, needs%without)) counts = .false.
            end do
         else if (needs%group /= '') then
            counts = table%groups(group)%is_wanted
         end if
         ! its names have defaults even where it is not there
         if (table%groups(group)%repeats) counts = counts .and. table%groups(group)%is_wanted
      end associate
   end function counts

   !> Is it one of some words with blanks between them?
   pure function is_among(word, words)
      character(*), intent(in) :: word
      character(*), intent(in) :: words
      logical :: is_among

      is_among = index(' '//trim(words)//' ', ' '//trim(word)//' ') > 0
   end function is_among

   !> What a number may be.
   pure function range_of(table, group, name) result(range)
      class(table_t), intent(in) :: table
      !> They are in the table
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      type(range_t) :: range

      range = table%entries(table%find(table%find_group(group), name))%name%range
   end function range_of

end module name_table
