!> What the names of a scene came to, for result files and tables.
module echo_types
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: echo_t

   !> One name and its value: a number, a list of numbers, or words.
   type :: echo_t
      !> As users write them, such as 'stop' and 'preload'
      character(:), allocatable :: group
      character(:), allocatable :: name
      !> Words; unallocated: the value is made of numbers
      character(:), allocatable :: text
      !> One element, or a list
      real(wp), allocatable :: number(:)
      !> The value is a list, even if of one element
      logical :: is_list = .false.
   end type echo_t

end module echo_types
