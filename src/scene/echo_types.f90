!> Names of a scene file with what stands behind them: the list that files and the reference are
!> written from.
module echo_types
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: echo_t, append_entry

   !> One name and its resolved value: a number, a list of numbers, or a text.
   type :: echo_t
      !> Group and name as users write them, such as 'stop' and 'preload'
      character(:), allocatable :: group
      character(:), allocatable :: name
      !> What it is, with its unit
      character(:), allocatable :: meaning
      !> Values that are allowed, in words
      character(:), allocatable :: allowed
      !> Value in words, always there
      character(:), allocatable :: text
      !> Value, one element or a list; unallocated: the value is no number
      real(wp), allocatable :: number(:)
      !> The value is a list, even if of one element
      logical :: is_list = .false.
   end type echo_t

contains

   !> Add an entry; the array grows by doubling.
   subroutine append_entry(entries, count, entry)
      !> What it is added to
      type(echo_t), allocatable, intent(inout) :: entries(:)
      !> Number of entries that are meant
      integer, intent(inout) :: count
      !> What is added
      type(echo_t), intent(in) :: entry

      type(echo_t), allocatable :: larger(:)

      if (.not. allocated(entries)) allocate (entries(64))
      if (count == size(entries)) then
         allocate (larger(2*count))
         larger(:count) = entries
         call move_alloc(larger, entries)
      end if
      count = count + 1
      entries(count) = entry
   end subroutine append_entry

end module echo_types
