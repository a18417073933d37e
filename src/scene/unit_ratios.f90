!> Ratios that a file gives by quantities in the user's units.
module unit_ratios
   use kinds, only: wp
   use name_table, only: table_t
   use number_text, only: to_text
   use scene_input, only: scene_input_t
   use value_rules, only: contains_value, range_t, range_text
   implicit none (type, external)
   private
   public :: take_ratio

contains

   !> A ratio, if the file gives its quantity.
   subroutine take_ratio(input, table, group, name, value, ratio, occurrence)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      !> Group and name of the quantity
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      !> The quantity as a ratio
      real(wp), intent(in) :: value
      !> Replaced by the value if the file has the quantity
      real(wp), intent(inout) :: ratio
      !> Which of the groups of this name; absent: the first
      integer, intent(in), optional :: occurrence

      character(:), allocatable :: ratio_name
      type(range_t) :: range

      if (.not. input%has(group, name, occurrence)) return
      ratio_name = trim(table%entries(table%find(table%find_group(group), name))%name%instead_of)
      range = table%range_of(group, ratio_name)
      if (contains_value(range, value)) then
         ratio = value
      else
         call input%complain(group, name, ratio_name//' would be '//to_text(value)//': must be ' &
            //range_text(range), occurrence)
      end if
   end subroutine take_ratio

end module unit_ratios
