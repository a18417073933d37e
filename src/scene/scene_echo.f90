!> The names of a scene with the values that they came to, for result files.
module scene_echo
   use kinds, only: wp
   use name_table, only: table_t
   use name_types, only: entry_t, kind_logical, kind_text, kind_word
   use scene_groups, only: list_scene
   use scene_types, only: echo_t, scene_t
   implicit none (type, external)
   private
   public :: make_echo, words_of

   character(*), parameter :: names_of_scales(6) = [character(17) :: &
      'length', 'omega1', 'bending_stiffness', 'beam_mass', 'height_ratio', 'displacement']

contains

   !> Put what counts in a scene into its echo: ratios instead of physical units, defaults filled in, without the
   !> groups that it does not ask for.
   subroutine make_echo(table, scene)
      !> Its names; their values need not be its own
      type(table_t), intent(inout) :: table
      !> Resolved
      type(scene_t), intent(inout) :: scene

      logical :: is_echoed(table%entry_count)
      integer :: i, k

      call table%take_values()
      call list_scene(table, scene)
      do i = 1, table%entry_count
         associate (entry => table%entries(i))
            entry%is_given = allocated(entry%list) .or. (entry%name%is_optional .and. entry%value > 0.0_wp)
         end associate
      end do
      do i = 1, table%entry_count
         associate (entry => table%entries(i))
            is_echoed(i) = table%groups(entry%group)%is_wanted .and. entry%name%instead_of == '' .and. entry%name%quantity == '' &
               .and. (entry%is_given .or. .not. entry%name%is_optional)
            if (is_echoed(i)) is_echoed(i) = table%counts(i)
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
      associate (scales => scene%scales)
         call echo_scales([scales%length, scales%omega1, scales%bending_stiffness, scales%beam_mass, &
            scales%height_ratio, scales%displacement], scene%echo(k + 1:))
      end associate
   end subroutine make_echo

   !> One name and its value.
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

   !> A text, a logical, a word, or words with commas between them.
   pure function words_of(entry) result(text)
      type(entry_t), intent(in) :: entry
      character(:), allocatable :: text

      integer :: i

      text = ''
      if (allocated(entry%text)) text = entry%text
      if (entry%kind == kind_logical) text = trim(merge('.true. ', '.false.', nint(entry%value) == 1))
      if (entry%kind /= kind_word) return
      if (.not. entry%is_list) then
         if (nint(entry%value) > 0) text = trim(entry%words(nint(entry%value)))
      else if (allocated(entry%list)) then
         do i = 1, size(entry%list)
            if (i > 1) text = text//', '
            text = text//trim(entry%words(nint(entry%list(i))))
         end do
      end if
   end function words_of

   !> What turns ratios into the user's units; no file gives it.
   pure subroutine echo_scales(values, echo)
      !> In the order of `names_of_scales`
      real(wp), intent(in) :: values(:)
      type(echo_t), intent(inout) :: echo(:)

      integer :: i

      do i = 1, size(values)
         echo(i)%group = 'scales'
         echo(i)%name = trim(names_of_scales(i))
         echo(i)%number = [values(i)]
      end do
   end subroutine echo_scales

end module scene_echo
