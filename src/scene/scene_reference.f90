!> Lists of the names of scene files: the names of one scene with their resolved values (echo), for results files, and
!> all names with their descriptions (reference), for users.
module scene_reference
   use kinds, only: wp
   use name_hints, only: group_hint, phrase_of
   use name_table, only: table_t
   use name_types, only: entry_t, kind_logical, kind_number, kind_text, kind_whole, kind_word, one_of, range_text
   use number_text, only: to_text
   use printable_text, only: joined
   use program_identity, only: program_any
   use scene_groups, only: list_scene
   use scene_types, only: echo_t, scene_t
   use sweep_names, only: find_parameters, parameter_of, unswept
   use sweep_settings, only: parameter_t
   implicit none (type, external)
   private
   public :: make_echo, reference_t, list_names, hint_for_group

   !> Names of the components of `scales_t` in the echo.
   character(*), parameter :: names_of_scales(6) = [character(17) :: &
      'length', 'omega1', 'bending_stiffness', 'beam_mass', 'height_ratio', 'displacement']

   !> Description of one name.
   type :: reference_t
      character(:), allocatable :: group
      character(:), allocatable :: name
      !> Meaning, with the unit and the condition under which the name applies
      character(:), allocatable :: meaning
      !> Allowed values, in words
      character(:), allocatable :: allowed
      character(:), allocatable :: default
      !> Whether the name is one of the many names in &sweep that give the values of a parameter
      logical :: is_swept = .false.
   end type reference_t

contains

   !> Make the echo of a scene: all names that apply in the scene, with dimensionless values instead of values in units
   !> and with default values, without groups that the scene does not have.
   subroutine make_echo(table, scene)
      !> Names of the scene; their values are replaced by those of the scene
      type(table_t), intent(inout) :: table
      !> Resolved scene
      type(scene_t), intent(inout) :: scene

      logical :: is_echoed(table%entry_count)
      real(wp) :: values(size(names_of_scales))
      integer :: i, k

      call table%begin_copy_from_scene()
      call list_scene(table, scene)
      do i = 1, table%entry_count
         associate (entry => table%entries(i))
            entry%is_given = allocated(entry%list) .or. (entry%name%is_optional .and. entry%value > 0.0_wp)
         end associate
      end do
      do i = 1, table%entry_count
         associate (entry => table%entries(i))
            is_echoed(i) = table%groups(entry%group)%is_wanted .and. entry%name%instead_of == '' &
               .and. .not. entry%name%is_scale .and. (entry%is_given .or. .not. entry%name%is_optional)
            if (is_echoed(i)) is_echoed(i) = table%applies(i)
            ! runs find the mesh, and with it that of the frequencies, which their table contains
            if (scene%frequencies%has_mesh_of_response .and. (scene%mesh%is_sought .or. scene%mesh%tolerance > 0.0_wp) &
               .and. any(entry%name%name == [character(13) :: 'mesh_elements', 'mesh_ratios'])) is_echoed(i) = .false.
         end associate
      end do
      if (allocated(scene%echo)) deallocate (scene%echo)
      allocate (scene%echo(count(is_echoed) + size(names_of_scales)))
      k = 0
      do i = 1, table%entry_count
         if (.not. is_echoed(i)) cycle
         k = k + 1
         call echo_entry(table, table%entries(i), scene%echo(k))
      end do
      ! the scales that convert ratios to the user's units are computed, not read
      associate (scales => scene%scales)
         values = [scales%length, scales%omega1, scales%bending_stiffness, scales%beam_mass, scales%height_ratio, &
            scales%displacement]
      end associate
      do i = 1, size(values)
         associate (echo => scene%echo(k + i))
            echo%group = 'scales'
            echo%name = trim(names_of_scales(i))
            echo%number = [values(i)]
         end associate
      end do
   end subroutine make_echo

   !> Make the echo of one name and its value.
   subroutine echo_entry(table, entry, echo)
      type(table_t), intent(in) :: table
      type(entry_t), intent(in) :: entry
      type(echo_t), intent(out) :: echo

      echo%group = trim(table%groups(entry%group)%label)
      echo%name = trim(entry%name%name)
      echo%is_list = entry%is_list
      select case (entry%kind)
      case (kind_logical, kind_text, kind_word)
         echo%text = words_of(entry)
      case default
         if (.not. entry%is_list) then
            echo%number = [entry%value]
         else if (allocated(entry%list)) then
            echo%number = entry%list
         else
            allocate (echo%number(0))
         end if
      end select
   end subroutine echo_entry

   !> The value of an entry in words: a text, a logical, a word, or words separated by commas.
   pure function words_of(entry) result(text)
      type(entry_t), intent(in) :: entry
      character(:), allocatable :: text

      text = ''
      if (allocated(entry%text)) text = entry%text
      if (entry%kind == kind_logical) text = trim(merge('.true. ', '.false.', nint(entry%value) == 1))
      if (entry%kind /= kind_word) return
      if (.not. entry%is_list) then
         if (nint(entry%value) > 0) text = trim(entry%words(nint(entry%value)))
      else if (allocated(entry%list)) then
         text = joined(entry%words(nint(entry%list)), ', ')
      end if
   end function words_of

   !> Describe all names, group by group.
   subroutine list_names(names, program)
      type(reference_t), allocatable, intent(out) :: names(:)
      !> Programs whose groups are described, a `program_` constant or a sum of them; absent: all
      integer, intent(in), optional :: program

      type(table_t) :: table
      type(scene_t) :: scene
      type(parameter_t) :: parameter
      integer, allocatable :: places(:)
      integer :: i, count, reader

      reader = program_any
      if (present(program)) reader = program
      call list_scene(table, scene)
      call find_parameters(table, places)
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
            if (phrase_of(table, i) /= '') then
               names(count)%meaning = names(count)%meaning//'; goes with '//phrase_of(table, i)
            end if
            names(count)%is_swept = entry%name%default == unswept
            if (any(places == i)) then
               parameter = parameter_of(table, i)
               names(count)%meaning = names(count)%meaning//'; a sweep may vary it'
               if (parameter%name /= entry%name%name) names(count)%meaning = names(count)%meaning//' as ' &
                  //trim(parameter%name)
               if (group%repeats) names(count)%meaning = names(count)%meaning//', that of the second &' &
                  //trim(group%name)//' as '//trim(group%name)//'_2_'//trim(entry%name%name)
            end if
            names(count)%allowed = allowed_in(entry)
            names(count)%default = default_of(entry)
         end associate
      end do
      names = names(:count)
   end subroutine list_names

   !> The allowed values of an entry, in words.
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
         text = 'text in quotes, '//to_text(nint(entry%name%range%minimum))//' to ' &
            //to_text(nint(entry%name%range%maximum))//' characters'
      end select
   end function allowed_in

   !> The default value of an entry, in words.
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

   !> The hint for an unknown group: the group nearest to it, or all groups.
   function hint_for_group(program, group) result(hint)
      !> One of the `program_` constants
      integer, intent(in) :: program
      !> Word that the user wrote
      character(*), intent(in) :: group
      character(:), allocatable :: hint

      type(table_t) :: table
      type(scene_t) :: scene

      call list_scene(table, scene)
      hint = group_hint(table, program, group)
   end function hint_for_group

end module scene_reference
