!> Selection of measures (scalar results of a run) for sensitivities and uncertainty.
module measure_selection
   use measure_list, only: measure_count, measure_table
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: chosen_measures

contains

   !> Indices of the selected measures: those that the scene names, or else all measures of the scene that are not
   !> counts.
   pure function chosen_measures(scene, given) result(measures)
      type(scene_t), intent(in) :: scene
      !> Measures that the scene names; unallocated: none
      integer, allocatable, intent(in) :: given(:)
      integer, allocatable :: measures(:)

      ! copy of the component: gfortran 12 gives texts of a constant array to a function with less than their length
      character(len(measure_table%group)) :: group(measure_count)
      integer :: i

      if (allocated(given)) then
         allocate (measures, source=given)
      else
         do i = 1, measure_count
            group(i) = measure_table(i)%group
         end do
         measures = pack([(i, i=1, measure_count)], .not. measure_table%is_whole .and. &
            scene%has_group(group) .and. &
            (measure_table%run_name /= '' .or. group /= '' .or. measure_table%name(:5) == 'peak_'))
      end if
   end function chosen_measures

end module measure_selection
