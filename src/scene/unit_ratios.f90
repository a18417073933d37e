!> Quantities in the user's units: their conversion to dimensionless values (ratios), and the requirements of results in
!> units.
module unit_ratios
   use kinds, only: wp
   use name_table, only: table_t
   use name_types, only: entry_t, contains_value, range_text
   use number_text, only: to_text
   use quantities, only: is_of_displacement, quantity_named, ratio_of, system_none
   use run_settings, only: side_above
   use scene_input, only: scene_input_t
   use scene_types, only: output_dimensionless, output_scene, scales_t, scene_t
   use sweep_names, only: quantity_of
   implicit none (type, external)
   private
   public :: entries_in_units, needs_displacement, set_ratio, check_units

   !> Message for results in units without a unit of displacement, in scenes with and without a stop.
   character(*), parameter :: unknown_displacement(2) = [character(200) :: &
      'needs displacements in units: give initial_height, and the ' &
      //'height of the surface, at the &stop from which the beam is released (clearance at a stop on both sides); or ' &
      //"&output units = 'dimensionless'", &
      'needs displacements in units: give displacement_scale of &scene, or loads and start in units instead of ' &
      //"ratios; or &output units = 'dimensionless'"]

contains

   !> Indices of the entries that the file gives in units and that are converted to ratios.
   pure function entries_in_units(table) result(places)
      type(table_t), intent(in) :: table
      integer, allocatable :: places(:)

      integer :: i

      associate (entries => table%entries(:table%entry_count))
         places = pack([(i, i=1, table%entry_count)], &
            entries%is_given .and. entries%name%quantity /= '' .and. entries%name%instead_of /= '' .and. &
            .not. entries%name%is_scale)
      end associate
   end function entries_in_units

   !> Whether the ratio of an entry in units depends on the unit of displacement D.
   elemental logical function needs_displacement(entry) result(needs)
      type(entry_t), intent(in) :: entry

      needs = entry%name%quantity /= ''
      if (needs) needs = is_of_displacement(quantity_named(entry%name%quantity))
   end function needs_displacement

   !> Convert an entry in units to a ratio, and assign it to the dimensionless entry of the same quantity. Problems are
   !> reported to `input`.
   subroutine set_ratio(input, table, place, scales)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(inout) :: table
      !> Index of the entry
      integer, intent(in) :: place
      type(scales_t), intent(in) :: scales

      real(wp) :: ratio
      integer :: other, quantity

      associate (entry => table%entries(place), group => table%groups(table%entries(place)%group))
         other = table%find(entry%group, entry%name%instead_of)
         quantity = quantity_named(quantity_of(table, place))
         if (scales%displacement <= 0.0_wp .and. is_of_displacement(quantity)) then
            call input%complain(trim(group%name), trim(entry%name%name), 'needs a length to go by: ' &
               //'give &stop surface_height and initial_height, or &scene displacement_scale', group%occurrence)
            return
         end if
         if (entry%is_list) then
            call check_and_change(ratio_of(quantity, entry%list, scales))
            return
         end if
         ratio = ratio_of(quantity, entry%value, scales)
         if (entry%name%relative_to /= '') then
            ! a quantity relative to another quantity of the group, which the file gives in units or as a ratio
            associate (reference => table%entries(table%find(entry%group, entry%name%relative_to)))
               ratio = ratio/table%entries(table%find(entry%group, reference%name%instead_of))%value
               if (reference%is_given) ratio = entry%value/reference%value
            end associate
         end if
         if (entry%name%name == 'surface_height') then
            ! heights are positive upwards; a preload is positive if the surface would penetrate the undeformed beam,
            ! from below or above; the subtraction avoids a negative zero
            if (nint(table%entries(table%find(entry%group, 'side'))%value) == side_above) ratio = 0.0_wp - ratio
         end if
         call check_and_change([ratio])
      end associate

   contains

      !> Change the dimensionless entry, unless a value is out of its range.
      subroutine check_and_change(ratios)
         real(wp), intent(in) :: ratios(:)

         integer :: outside

         associate (range => table%entries(other)%name%range, entry => table%entries(place))
            do outside = 1, size(ratios)
               if (contains_value(range, ratios(outside))) cycle
               call input%complain(trim(table%groups(entry%group)%name), trim(entry%name%name), &
                  trim(entry%name%instead_of)//' would be '//to_text(ratios(outside))//': must be ' &
                  //range_text(range), table%groups(entry%group)%occurrence)
               return
            end do
            call table%change(other, ratios)
         end associate
      end subroutine check_and_change
   end subroutine set_ratio

   !> Check that results in units have a beam in units and a unit of displacement. Problems are reported to `input`.
   subroutine check_units(input, scene)
      type(scene_input_t), intent(inout) :: input
      !> Resolved except for the sweep
      type(scene_t), intent(in) :: scene

      character(*), parameter :: needed(3) = [character(16) :: 'length', 'youngs_modulus', 'density']
      integer :: i

      if (scene%unit_system > 0 .and. scene%unit_system /= system_none) then
         if (scene%wants_precision .or. scene%wants_statements) then
            call input%complain('scene', 'units', 'this scene has no results in units')
            return
         end if
         do i = 1, size(needed)
            if (input%has('beam', trim(needed(i)))) cycle
            call input%complain('scene', 'units', 'needs '//trim(needed(i))//' in &beam')
            return
         end do
         if (scene%output_units == output_dimensionless) return
      else if (scene%output_units /= output_scene) then
         return
      end if
      if (scene%wants_response .and. scene%scales%displacement <= 0.0_wp) then
         if (input%has('output', 'units')) then
            call input%complain('output', 'units', trim(unknown_displacement(merge(1, 2, scene%has_stop))))
         else
            call input%complain('scene', 'units', trim(unknown_displacement(merge(1, 2, scene%has_stop))))
         end if
      end if
   end subroutine check_units

end module unit_ratios
