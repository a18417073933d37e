!> The names of a scene with the values that they came to, for result files.
module scene_echo
   use echo_types, only: echo_t
   use kinds, only: wp
   use name_table, only: entry_t, kind_logical, kind_text, kind_word, table_t
   use scene_groups, only: list_scene, physical_t
   use scene_types, only: scales_t, scene_t
   implicit none (type, external)
   private
   public :: make_echo, words_of

contains

   !> Put what counts in a scene into its echo: ratios instead of physical units, defaults filled in, without the groups that
   !> it does not ask for.
   subroutine make_echo(table, scene)
      !> Its names; their values need not be its own
      type(table_t), intent(inout) :: table
      !> Resolved
      type(scene_t), intent(inout) :: scene

      type(physical_t) :: physical
      type(echo_t), allocatable :: echo(:)
      integer :: i, count

      call table%take_values()
      call list_scene(table, scene, physical)
      do i = 1, table%entry_count
         associate (entry => table%entries(i))
            entry%is_given = allocated(entry%list) .or. (entry%name%is_optional .and. entry%value > 0.0_wp)
         end associate
      end do
      allocate (echo(table%entry_count + 6))
      count = 0
      do i = 1, table%entry_count
         associate (entry => table%entries(i))
            if (.not. table%groups(entry%group)%is_wanted .or. entry%name%instead_of /= '') cycle
            if (entry%name%is_optional .and. .not. entry%is_given) cycle
            if (.not. table%counts(i)) cycle
            count = count + 1
            call echo_entry(table, entry, echo(count))
         end associate
      end do
      call echo_scales(scene%scales, echo, count)
      scene%echo = echo(:count)
   end subroutine make_echo

   !> One name and its value.
   subroutine echo_entry(table, entry, echo)
      type(table_t), intent(in) :: table
      type(entry_t), intent(in) :: entry
      type(echo_t), intent(out) :: echo

      echo%group = trim(table%groups(entry%group)%name)
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
   subroutine echo_scales(scales, echo, count)
      type(scales_t), intent(in) :: scales
      type(echo_t), intent(inout) :: echo(:)
      !> Number of elements that are meant
      integer, intent(inout) :: count

      call add('length', scales%length)
      call add('omega1', scales%omega1)
      call add('bending_stiffness', scales%bending_stiffness)
      call add('beam_mass', scales%beam_mass)
      call add('height_ratio', scales%height_ratio)
      call add('displacement', scales%displacement)

   contains

      subroutine add(name, value)
         character(*), intent(in) :: name
         real(wp), intent(in) :: value

         count = count + 1
         echo(count)%group = 'scales'
         echo(count)%name = name
         echo(count)%number = [value]
      end subroutine add

   end subroutine echo_scales

end module scene_echo
