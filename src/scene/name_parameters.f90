!> Names of a table that a sweep, or several cases, may vary.
module name_parameters
   use kinds, only: wp
   use name_table, only: table_t
   use name_types, only: kind_whole, sweep_t
   use sorting, only: ascending_order
   use sweep_settings, only: parameter_t
   implicit none (type, external)
   private
   public :: list_parameters, parameter_of, chosen_parameter

   !> Above the number of any parameter.
   integer, parameter :: beyond_all = 100

contains

   !> Places of their entries, in the order of a grid: what makes other beams first, so that each is made once.
   pure subroutine list_parameters(table, places)
      class(table_t), intent(in) :: table
      integer, allocatable, intent(out) :: places(:)

      integer :: i

      places = pack([(i, i=1, table%entry_count)], table%entries(:table%entry_count)%name%sweep%order > 0)
      places = places(ascending_order([(grid_order(table%entries(places(i))%name%sweep), i=1, size(places))]))
   end subroutine list_parameters

   !> The later, the faster it varies in a grid.
   elemental function grid_order(sweep) result(order)
      type(sweep_t), intent(in) :: sweep
      real(wp) :: order

      order = real(sweep%order + merge(0, beyond_all, sweep%is_of_beam), wp)
   end function grid_order

   !> What a sweep must know of an entry.
   pure function parameter_of(table, place) result(parameter)
      class(table_t), intent(in) :: table
      integer, intent(in) :: place
      type(parameter_t) :: parameter

      associate (entry => table%entries(place), sweep => table%entries(place)%name%sweep)
         parameter = parameter_t(name=entry%name%name, meaning=entry%name%meaning, &
            group=table%groups(entry%group)%name, occurrence=table%groups(entry%group)%occurrence, &
            name_in_group=entry%name%name, is_of_beam=sweep%is_of_beam, is_whole=entry%kind == kind_whole)
         parameter%order = sweep%order + beyond_all*(parameter%occurrence - 1)
         if (sweep%name /= '') parameter%name = sweep%name
         associate (group => table%groups(entry%group))
            if (group%label /= group%name) parameter%name = trim(group%label)//'_'//parameter%name
         end associate
         if (sweep%meaning /= '') parameter%meaning = sweep%meaning
      end associate
   end function parameter_of

   !> Place of the entry that another one chooses by its word; 0: none is chosen.
   pure function chosen_parameter(table, group, name) result(place)
      class(table_t), intent(in) :: table
      !> Place of the group, and the name, of the one that chooses
      integer, intent(in) :: group
      character(*), intent(in) :: name
      integer :: place

      type(parameter_t) :: candidate
      integer, allocatable :: places(:)
      integer :: i

      place = 0
      associate (entry => table%entries(table%find(group, name)))
         if (nint(entry%value) == 0) return
         call list_parameters(table, places)
         do i = 1, size(places)
            candidate = parameter_of(table, places(i))
            if (candidate%name == entry%words(nint(entry%value))) place = places(i)
         end do
      end associate
   end function chosen_parameter

end module name_parameters
