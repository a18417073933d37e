!> Of the ways compared with the beam itself, the fastest to each error.
module cheapest_ways
   use kinds, only: wp
   use precision_types, only: motion_entry_t, varied_mesh
   use scene_types, only: contender_exact, contender_names, mass_names
   implicit none (type, external)
   private
   public :: error_bounds, ways_of, way_name, cheapest_of, parts_of_error

   !> Largest differences of eta from the beam, each asked for.
   real(wp), parameter :: error_bounds(7) = [1.0e-2_wp, 1.0e-3_wp, 1.0e-4_wp, 1.0e-5_wp, 1.0e-6_wp, 1.0e-7_wp, &
      1.0e-8_wp]

contains

   !> The first entry of each method and mass matrix.
   pure function ways_of(entries) result(ways)
      type(motion_entry_t), intent(in) :: entries(:)
      !> Numbers of entries
      integer, allocatable :: ways(:)

      integer :: i

      allocate (ways(0))
      do i = 1, size(entries)
         if (entries(i)%varied /= varied_mesh) cycle
         if (any(are_alike(entries(ways), entries(i)))) cycle
         ways = [ways, i]
      end do
   end function ways_of

   !> What users call it.
   pure function way_name(entry) result(name)
      type(motion_entry_t), intent(in) :: entry
      character(40) :: name

      name = trim(contender_names(entry%contender))//', '//mass_names(entry%mass)
   end function way_name

   !> The fastest entry of a way that errs by no more than a bound, as all with more elements and shorter steps do, so
   !> that it does not owe this to errors that happen to cancel; 0: there is none.
   pure function cheapest_of(entries, way, bound) result(number)
      type(motion_entry_t), intent(in) :: entries(:)
      !> One entry of it
      type(motion_entry_t), intent(in) :: way
      !> Largest difference of eta
      real(wp), intent(in) :: bound
      integer :: number

      logical, dimension(size(entries)) :: is_of_way, errs_more
      integer :: i

      is_of_way = are_alike(entries, way) .and. entries%varied == varied_mesh .and. entries%failure == ''
      errs_more = is_of_way .and. entries%errors%history > bound
      number = minloc(entries%whole%median, dim=1, mask=is_of_way .and. [(.not. any(errs_more .and. &
         entries%elements >= entries(i)%elements .and. entries%step <= entries(i)%step), i=1, size(entries))])
   end function cheapest_of

   !> What an error of steps is made of: the step's, from exact motion on the same mesh; the mesh's, of exact motion on
   !> it; both. Negative: not known.
   pure function parts_of_error(entries, number) result(parts)
      type(motion_entry_t), intent(in) :: entries(:)
      !> Of the entry that varies the step
      integer, intent(in) :: number
      real(wp) :: parts(3)

      integer :: i

      parts = -1.0_wp
      associate (one => entries(number))
         if (one%failure == '') parts(1) = one%errors%history
         do i = 1, size(entries)
            if (entries(i)%varied /= varied_mesh .or. entries(i)%elements /= one%elements .or. &
               entries(i)%mass /= one%mass .or. entries(i)%failure /= '') cycle
            if (entries(i)%contender == contender_exact) parts(2) = entries(i)%errors%history
            if (entries(i)%contender == one%contender .and. .not. abs(entries(i)%step - one%step) > 0.0_wp) then
               parts(3) = entries(i)%errors%history
            end if
         end do
      end associate
   end function parts_of_error

   !> Of one method and one mass matrix.
   elemental function are_alike(one, other) result(answer)
      type(motion_entry_t), intent(in) :: one
      type(motion_entry_t), intent(in) :: other
      logical :: answer

      answer = one%contender == other%contender .and. one%mass == other%mass
   end function are_alike

end module cheapest_ways
