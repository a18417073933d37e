!> What a file gives, and a sweep or cases of another name for the same would silently overrule.
module lost_units
   use name_table, only: table_t
   use scene_input, only: scene_input_t
   implicit none (type, external)
   private
   public :: refuse_lost_units

   !> Ratios that are varied, and quantities that would no longer be what the file gives.
   character(*), parameter :: spoilt(2, 2) = reshape([character(32) :: 'stiffness_ratio', 'branch_stiffness', &
      'stiffness_ratio', 'damper'], [2, 2])

contains

   !> Problems go into the input.
   subroutine refuse_lost_units(input, table, place, by)
      type(scene_input_t), intent(inout) :: input
      !> Its names, read
      type(table_t), intent(in) :: table
      !> Of the entry that is varied
      integer, intent(in) :: place
      !> Who varies it, for the user
      character(*), intent(in) :: by

      integer :: i, k
      logical :: is_lost

      associate (varied => table%entries(place))
         do i = table%groups(varied%group)%first_entry, table%groups(varied%group)%last_entry
            associate (other => table%entries(i))
               if (.not. other%is_given) cycle
               is_lost = other%name%instead_of == varied%name%name .or. &
                  (varied%name%quantity /= '' .and. varied%name%instead_of == other%name%name)
               do k = 1, size(spoilt, 2)
                  is_lost = is_lost .or. (spoilt(1, k) == varied%name%name .and. spoilt(2, k) == other%name%name)
               end do
               if (is_lost) call input%complain(trim(table%groups(other%group)%name), trim(other%name%name), &
                  'does not go with '//by, table%groups(other%group)%occurrence)
            end associate
         end do
      end associate
   end subroutine refuse_lost_units

end module lost_units
