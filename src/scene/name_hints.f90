!> What to tell a user about a name that does not exist: the nearest one, or all there are.
module name_hints
   use near_names, only: nearest_name
   use scene_types, only: name_length
   implicit none (type, external)
   private
   public :: known_name_t, group_hint, item_hint

   !> A name that a scene file may have.
   type :: known_name_t
      character(name_length) :: group = ''
      character(name_length) :: name = ''
   end type known_name_t

contains

   !> What a user who wrote an unknown group may have meant.
   pure function group_hint(known, group) result(hint)
      !> All the names there are
      type(known_name_t), intent(in) :: known(:)
      !> What the user wrote
      character(*), intent(in) :: group
      character(:), allocatable :: hint

      character(name_length) :: groups(size(known))
      integer :: i, count, nearest

      count = 0
      do i = 1, size(known)
         if (any(groups(:count) == known(i)%group)) cycle
         count = count + 1
         groups(count) = known(i)%group
      end do
      nearest = nearest_name(group, groups(:count))
      if (nearest > 0) then
         hint = 'did you mean &'//trim(groups(nearest))//'?'
      else
         hint = 'the groups are'//joined(groups(:count), '&')
      end if
   end function group_hint

   !> What a user who wrote an unknown name may have meant.
   pure function item_hint(known, group, name) result(hint)
      !> All the names there are
      type(known_name_t), intent(in) :: known(:)
      !> Where the user wrote it
      character(*), intent(in) :: group
      !> What the user wrote
      character(*), intent(in) :: name
      character(:), allocatable :: hint

      character(name_length) :: names(size(known))
      integer :: i, count, nearest

      count = 0
      do i = 1, size(known)
         if (known(i)%group /= group) cycle
         count = count + 1
         names(count) = known(i)%name
      end do
      nearest = nearest_name(name, names(:count))
      if (nearest > 0) then
         hint = 'did you mean '//trim(names(nearest))//'?'
         return
      end if
      do i = 1, size(known)
         if (known(i)%name /= name) cycle
         hint = 'it belongs to &'//trim(known(i)%group)
         return
      end do
      hint = '&'//group//' takes'//joined(names(:count), '')
   end function item_hint

   !> Names with a prefix and commas between them.
   pure function joined(names, prefix) result(text)
      !> The names
      character(*), intent(in) :: names(:)
      !> What stands before each
      character(*), intent(in) :: prefix
      character(:), allocatable :: text

      integer :: i

      text = ''
      do i = 1, size(names)
         text = text//' '//prefix//trim(names(i))
         if (i < size(names)) text = text//','
      end do
   end function joined

end module name_hints
