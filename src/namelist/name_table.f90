!> The names of scene files as data: one table entry for each name, with its description and its value.
!>
!> Listing all names (`list_scene` and `list_group` of `scene_groups`) opens the groups one after the other and binds
!> each entry to a component of a scene. Quantities in units have no component, because only the dimensionless value
!> (ratio) computed from them has one; their names are listed together with those of the ratios. The first listing makes
!> the table with the values of the scene; later listings copy values between the table and the scene, so that one
!> statement connects a name with its component. Reading a file, the echo in results files, the reference (--names),
!> sweeps and cases use the table alone.
module name_table
   use kinds, only: wp
   use name_types, only: entry_t, group_t, in_units_t, kind_logical, kind_number, kind_text, kind_whole, kind_word, &
      max_name_length, name_t, sweep_t, contains_value, is_among, range_t
   use number_text, only: to_text
   implicit none (type, external)
   private
   public :: table_t, max_repeats

   !> Maximum number of groups of one name; all names in them are fewer than the maximum that `namelist_text` parses.
   integer, parameter :: max_repeats = 500

   !> Table of all groups and names.
   type :: table_t
      !> Groups in the order of listing; only the first `group_count` are used
      type(group_t), allocatable :: groups(:)
      !> Entries in the order of listing; only the first `entry_count` are used
      type(entry_t), allocatable :: entries(:)
      integer :: group_count = 0
      integer :: entry_count = 0
      !> Whether a listing adds entries to the table
      logical, private :: adds_entries = .true.
      !> Whether a listing copies the values of the scene into the table
      logical, private :: copies_from_scene = .true.
      !> Whether a listing copies the values of the table into the scene
      logical, private :: copies_to_scene = .false.
      !> Whether the scene receives only values that have changed
      logical, private :: copies_changes_only = .false.
      !> The only name whose value the scene receives; empty: all names
      character(max_name_length), private :: only = ''
      !> Number of the group of that name among several of one name
      integer, private :: only_in = 1
      !> Index of the open group; a listing advances it
      integer, private :: open_group = 0
      !> Index of the current entry; a listing advances it
      integer, private :: current = 0
      !> Whether the names of the open group must be listed; if not, their entries are skipped
      logical :: lists_names = .true.
      !> Names of the groups in the file, from which the number of repeated groups follows; unallocated: no file
      character(max_name_length), allocatable :: groups_given(:)
      !> Whether names of a group that stands alone are omitted if the file does not have the group
      logical :: omits_absent = .false.
   contains
      procedure :: begin_copy_to_scene
      procedure :: begin_copy_from_scene
      procedure :: begin_copy_of_one
      procedure :: change
      procedure :: begin_copy_of_changes
      procedure :: groups_to_list
      procedure :: open, open_numbered
      procedure :: store
      generic :: bind => bind_real, bind_integer, bind_logical, bind_text, bind_reals, bind_integers
      procedure :: find_group, find
      procedure :: has, has_either
      procedure :: number
      procedure :: applies
      procedure :: range_of
      procedure, private :: bind_real, bind_integer, bind_logical, bind_text, bind_reals, bind_integers, advance, &
         store_in_units
   end type table_t

contains

   !> Prepare the table for another listing of the same names, which copies the values of the table into the scene.
   subroutine begin_copy_to_scene(table)
      class(table_t), intent(inout) :: table

      table%adds_entries = .false.
      table%copies_from_scene = .false.
      table%copies_to_scene = .true.
      table%copies_changes_only = .false.
      table%open_group = 0
      table%current = 0
   end subroutine begin_copy_to_scene

   !> Prepare the table for another listing of the same names, which copies the values of the scene into the table.
   subroutine begin_copy_from_scene(table)
      class(table_t), intent(inout) :: table

      call table%begin_copy_to_scene()
      table%copies_from_scene = .true.
      table%copies_to_scene = .false.
   end subroutine begin_copy_from_scene

   !> Prepare an empty table for a listing that copies `value` into the scene, to one name only; other entries are not
   !> stored.
   subroutine begin_copy_of_one(table, occurrence, name, value)
      class(table_t), intent(inout) :: table
      !> Number of the group among several of one name
      integer, intent(in) :: occurrence
      character(*), intent(in) :: name
      real(wp), intent(in) :: value

      call table%begin_copy_to_scene()
      table%only = name
      table%only_in = occurrence
      allocate (table%groups(1), table%entries(1))
      table%entries%value = value
      table%entries(1)%list = [value]
   end subroutine begin_copy_of_one

   !> Change the value of an entry.
   subroutine change(table, place, value)
      class(table_t), intent(inout) :: table
      !> Index of the entry
      integer, intent(in) :: place
      !> The number, or all numbers of a list
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

   !> Prepare the table for another listing of the names of one group, which copies the changed values into the scene,
   !> even if the scene does not have the group.
   subroutine begin_copy_of_changes(table, group)
      class(table_t), intent(inout) :: table
      !> Index of the group; for several groups of one name, the index of the first
      integer, intent(in) :: group

      call table%begin_copy_to_scene()
      table%copies_changes_only = .true.
      table%open_group = group - 1
      table%current = table%groups(group)%first_entry - 1
      table%groups(group)%is_changed = .false.
   end subroutine begin_copy_of_changes

   !> Number of groups of a name that must be listed: at least one, so that the names of the group are in the table.
   pure integer function groups_to_list(table, group, in_scene) result(number)
      class(table_t), intent(in) :: table
      character(*), intent(in) :: group
      !> Number of these groups in the scene
      integer, intent(in) :: in_scene

      if (table%only /= '') then
         number = in_scene
      else if (.not. table%adds_entries) then
         number = count(table%groups(:table%group_count)%name == group)
      else
         number = max(1, in_scene)
         if (allocated(table%groups_given)) number = max(number, min(max_repeats, count(table%groups_given == group)))
      end if
   end function groups_to_list

   !> Open a group: names that are bound next belong to this group. If `lists_names` is then .false., the names of the
   !> group are not to be listed.
   subroutine open(table, group, is_wanted)
      class(table_t), intent(inout) :: table
      type(group_t), intent(in) :: group
      !> Whether the scene has the group; absent: every scene has this group
      logical, intent(inout), optional :: is_wanted

      type(group_t), allocatable :: more(:)

      table%lists_names = .true.
      ! `begin_copy_of_one`: the table has no groups, and only names of one group are copied
      if (table%only /= '') then
         table%lists_names = group%occurrence == table%only_in
         return
      end if
      table%open_group = table%open_group + 1
      if (table%copies_changes_only) return
      if (table%adds_entries) then
         if (.not. allocated(table%groups)) allocate (table%groups(16))
         if (table%open_group > size(table%groups)) then
            allocate (more(2*table%group_count))
            more(:table%group_count) = table%groups
            call move_alloc(more, table%groups)
         end if
         table%group_count = table%open_group
         table%groups(table%group_count) = group
         if (group%label == '') table%groups(table%group_count)%label = group%name
         table%groups(table%group_count)%first_entry = table%current + 1
         table%groups(table%group_count)%last_entry = table%current
      end if
      associate (opened => table%groups(table%open_group))
         if (table%copies_from_scene) opened%is_wanted = .true.
         if (.not. present(is_wanted)) return
         if (table%copies_from_scene) opened%is_wanted = is_wanted
         if (table%copies_to_scene) is_wanted = opened%is_wanted
         table%lists_names = is_wanted .or. table%adds_entries
         if (table%adds_entries .and. table%omits_absent .and. opened%stands_alone) table%lists_names = &
            any(table%groups_given == opened%name)
         if (.not. table%lists_names) table%current = opened%last_entry
      end associate
   end subroutine open

   !> Open one of several groups of one name; the label of each group has its number, even that of the first.
   subroutine open_numbered(table, group, which, is_wanted)
      class(table_t), intent(inout) :: table
      character(*), intent(in) :: group
      !> Number of the group
      integer, intent(in) :: which
      !> Whether the scene has at least one of these groups
      logical, intent(inout) :: is_wanted

      type(group_t) :: opened

      opened = group_t(group, repeats=.true., occurrence=which, label=group//'_'//to_text(which))
      if (which == 1) then
         call table%open(opened, is_wanted)
      else
         call table%open(opened)
      end if
   end subroutine open_numbered

   !> Add a name that is bound to no component: its value is only in the table.
   subroutine store(table, name, kind)
      class(table_t), intent(inout) :: table
      type(name_t), intent(in) :: name
      !> One of the `kind_` constants
      integer, intent(in) :: kind

      call table%advance(name, kind, .false.)
   end subroutine store

   !> Add the name in units of a ratio.
   subroutine store_in_units(table, ratio, in_units, is_list)
      class(table_t), intent(inout) :: table
      !> Description of the ratio
      type(name_t), intent(in) :: ratio
      type(in_units_t), intent(in) :: in_units
      logical, intent(in) :: is_list

      type(range_t) :: range

      ! a value of 0 is a ratio of 0
      range = in_units%range
      if (abs(range%minimum) <= 0.0_wp .and. .not. contains_value(ratio%range, 0.0_wp)) range%excludes_minimum = .true.
      call table%advance(name_t(in_units%name, in_units%meaning, range, ratio%needs, &
         instead_of=ratio%name, quantity=in_units%quantity, relative_to=in_units%relative_to, &
         sweep=sweep_t(name=in_units%swept_as)), kind_number, is_list)
   end subroutine store_in_units

   !> Bind a number. The table has 0 for the number `huge`, the default of limits that a scene need not have.
   subroutine bind_real(table, value, name, in_units)
      class(table_t), intent(inout) :: table
      real(wp), intent(inout) :: value
      type(name_t), intent(in) :: name
      !> Name of the same quantity in units; absent: it has none
      type(in_units_t), intent(in), optional :: in_units

      call table%advance(name, kind_number, .false.)
      associate (entry => table%entries(table%current))
         if (table%copies_from_scene) entry%value = merge(value, 0.0_wp, value < huge(value))
         if (table%copies_to_scene .and. (value < huge(value) .or. entry%value > 0.0_wp)) value = entry%value
      end associate
      if (present(in_units)) call table%store_in_units(name, in_units, is_list=.false.)
   end subroutine bind_real

   !> Bind a whole number, or one of several words, represented by its index; 0: no word.
   subroutine bind_integer(table, value, name, words)
      class(table_t), intent(inout) :: table
      integer, intent(inout) :: value
      type(name_t), intent(in) :: name
      !> Allowed words, if the value is a word
      character(*), intent(in), optional :: words(:)

      call table%advance(name, kind_whole, .false., words)
      associate (entry => table%entries(table%current))
         if (table%copies_from_scene) entry%value = real(value, wp)
         if (table%copies_to_scene) value = nint(entry%value)
      end associate
   end subroutine bind_integer

   !> Bind a logical value.
   subroutine bind_logical(table, value, name)
      class(table_t), intent(inout) :: table
      logical, intent(inout) :: value
      type(name_t), intent(in) :: name

      call table%advance(name, kind_logical, .false.)
      associate (entry => table%entries(table%current))
         if (table%copies_from_scene) entry%value = merge(1.0_wp, 0.0_wp, value)
         if (table%copies_to_scene) value = nint(entry%value) == 1
      end associate
   end subroutine bind_logical

   !> Bind a text of one line.
   subroutine bind_text(table, value, name)
      class(table_t), intent(inout) :: table
      character(:), allocatable, intent(inout) :: value
      type(name_t), intent(in) :: name

      call table%advance(name, kind_text, .false.)
      associate (entry => table%entries(table%current))
         if (table%copies_from_scene .and. allocated(value)) entry%text = value
         if (table%copies_to_scene .and. allocated(entry%text)) value = entry%text
      end associate
   end subroutine bind_text

   !> Bind a list of numbers, or of whole numbers that the scene stores as reals.
   subroutine bind_reals(table, value, name, in_units, are_whole)
      class(table_t), intent(inout) :: table
      real(wp), allocatable, intent(inout) :: value(:)
      type(name_t), intent(in) :: name
      !> Name of the same quantities in units; absent: they have none
      type(in_units_t), intent(in), optional :: in_units
      logical, intent(in), optional :: are_whole

      call table%advance(name, kind_number, .true.)
      associate (entry => table%entries(table%current))
         if (present(are_whole)) entry%kind = merge(kind_whole, kind_number, are_whole)
         if (table%copies_from_scene .and. allocated(value)) entry%list = value
         if (table%copies_to_scene .and. allocated(entry%list)) value = entry%list
      end associate
      if (present(in_units)) call table%store_in_units(name, in_units, is_list=.true.)
   end subroutine bind_reals

   !> Bind a list of whole numbers, or of words, represented by their indices.
   subroutine bind_integers(table, value, name, words)
      class(table_t), intent(inout) :: table
      integer, allocatable, intent(inout) :: value(:)
      type(name_t), intent(in) :: name
      !> Allowed words, if the values are words
      character(*), intent(in), optional :: words(:)

      call table%advance(name, kind_whole, .true., words)
      associate (entry => table%entries(table%current))
         if (table%copies_from_scene .and. allocated(value)) entry%list = real(value, wp)
         if (table%copies_to_scene .and. allocated(entry%list)) value = nint(entry%list)
      end associate
   end subroutine bind_integers

   !> Advance to the next entry; in the first listing, add the entry to the open group.
   subroutine advance(table, name, kind, is_list, words)
      class(table_t), intent(inout) :: table
      type(name_t), intent(in) :: name
      !> Kind of the value, unless `words` is present
      integer, intent(in) :: kind
      logical, intent(in) :: is_list
      character(*), intent(in), optional :: words(:)

      type(entry_t), allocatable :: more(:)

      ! `begin_copy_of_one`: the only entry of the table has the value for one name
      if (table%only /= '') then
         table%current = 1
         table%copies_to_scene = name%name == table%only
         return
      end if
      table%current = table%current + 1
      if (table%copies_changes_only) then
         table%copies_to_scene = table%entries(table%current)%is_changed
         table%entries(table%current)%is_changed = .false.
      end if
      if (.not. table%adds_entries) return
      if (.not. allocated(table%entries)) allocate (table%entries(320))
      if (table%current > size(table%entries)) then
         allocate (more(2*table%entry_count))
         more(:table%entry_count) = table%entries
         call move_alloc(more, table%entries)
      end if
      table%entry_count = table%current
      associate (entry => table%entries(table%current))
         entry%group = table%open_group
         table%groups(table%open_group)%last_entry = table%current
         entry%name = name
         entry%kind = kind
         entry%is_list = is_list
         if (.not. present(words)) return
         entry%kind = kind_word
         allocate (entry%words(size(words)))
         entry%words(:) = words
      end associate
   end subroutine advance

   !> Index of a group; 0: there is none.
   pure integer function find_group(table, name, occurrence) result(place)
      class(table_t), intent(in) :: table
      character(*), intent(in) :: name
      !> Number of the group among several of one name; absent: the first
      integer, intent(in), optional :: occurrence

      integer :: wanted

      wanted = 1
      if (present(occurrence)) wanted = occurrence
      do place = table%group_count, 1, -1
         if (table%groups(place)%name == name .and. table%groups(place)%occurrence == wanted) exit
      end do
   end function find_group

   !> Index of an entry; 0: there is none.
   pure integer function find(table, group, name) result(place)
      class(table_t), intent(in) :: table
      !> Index of the group
      integer, intent(in) :: group
      character(*), intent(in) :: name

      do place = table%groups(group)%first_entry, table%groups(group)%last_entry
         if (table%entries(place)%name%name == name) return
      end do
      place = 0
   end function find

   !> Whether the file gives this name.
   pure logical function has(table, group, name, occurrence)
      class(table_t), intent(in) :: table
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      !> Number of the group among several of one name; absent: the first
      integer, intent(in), optional :: occurrence

      has = table%entries(table%find(table%find_group(group, occurrence), name))%is_given
   end function has

   !> Whether the file gives this name, or a quantity in units instead of it.
   pure logical function has_either(table, group, name, occurrence) result(has)
      class(table_t), intent(in) :: table
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      !> Number of the group among several of one name; absent: the first
      integer, intent(in), optional :: occurrence

      associate (opened => table%groups(table%find_group(group, occurrence)))
         associate (entries => table%entries(opened%first_entry:opened%last_entry))
            has = any(entries%is_given .and. (entries%name%name == name .or. entries%name%instead_of == name))
         end associate
      end associate
   end function has_either

   !> The value of a name that is a number, the index of a word, or 1 for .true.
   pure real(wp) function number(table, group, name, occurrence)
      class(table_t), intent(in) :: table
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      !> Number of the group among several of one name; absent: the first
      integer, intent(in), optional :: occurrence

      number = table%entries(table%find(table%find_group(group, occurrence), name))%value
   end function number

   !> Whether the condition of an entry is met, so that its name may be given.
   pure logical function applies(table, place)
      class(table_t), intent(in) :: table
      !> Index of the entry
      integer, intent(in) :: place

      integer :: group, i

      applies = .true.
      associate (needs => table%entries(place)%name%needs)
         group = table%entries(place)%group
         if (needs%group /= '') group = table%find_group(needs%group, needs%occurrence)
         if (needs%name /= '') then
            associate (other => table%entries(table%find(group, needs%name)))
               if (any(other%kind == [kind_word, kind_logical])) applies = nint(other%value) > 0
               if (applies .and. other%kind == kind_word) then
                  applies = is_among(other%words(nint(other%value)), needs%words)
               end if
            end associate
         end if
         if (needs%without /= '') then
            do i = table%groups(group)%first_entry, table%groups(group)%last_entry
               if (.not. table%entries(i)%is_given) cycle
               if (is_among(table%entries(i)%name%name, needs%without)) applies = .false.
            end do
         else if (needs%name == '' .and. needs%group /= '') then
            applies = table%groups(group)%is_wanted
         end if
         ! names of a group that may be repeated, and of &section, are in the table even if the scene lacks the group
         if (any([table%groups(group)%repeats, table%groups(group)%name == 'section']) .and. &
            .not. table%groups(group)%is_wanted) applies = .false.
      end associate
   end function applies

   !> The range of a number.
   pure type(range_t) function range_of(table, group, name) result(range)
      class(table_t), intent(in) :: table
      !> Group and name, which must be in the table
      character(*), intent(in) :: group
      character(*), intent(in) :: name

      range = table%entries(table%find(table%find_group(group), name))%name%range
   end function range_of

end module name_table
