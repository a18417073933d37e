!> The group `bodies` of a results file: position and histories of each body.
module body_groups
   use kinds, only: wp
   use point_groups, only: body_points, put_histories, put_points
   use quantity_groups, only: quantity_group_t
   use response_types, only: point_record_t
   implicit none (type, external)
   private
   public :: write_bodies

contains

   !> Write the positions of the bodies, and a table over instants and bodies for each history.
   subroutine write_bodies(group, bodies, tau)
      type(quantity_group_t), intent(in) :: group
      !> Bodies in the order of the scene
      type(point_record_t), intent(in) :: bodies(:)
      !> Sample times tau; without them no histories are written
      real(wp), contiguous, intent(in), optional :: tau(:)

      integer :: b, n

      n = size(bodies)
      call put_points(group, body_points, n)
      call group%put('position', [bodies%position], 'length', 'position{ x/L}', 'body')
      call group%put('rest', [bodies%rest], 'displacement', 'displacement at which its spring has no force', 'body')
      if (.not. present(tau)) return
      call group%put('tau', tau, 'time', 'time{ tau}', is_scale=.true.)
      if (allocated(bodies(1)%displacement)) call put_histories(group, body_points, n, 'displacement', &
         [(bodies(b)%displacement, b=1, n)], &
         'displacement of the body, up from where its distance from the unstressed beam is the clearance', &
         'displacement')
      if (allocated(bodies(1)%velocity)) call put_histories(group, body_points, n, 'velocity', [(bodies(b)%velocity, &
         b=1, n)], &
         'velocity of the body, up', 'velocity')
      if (allocated(bodies(1)%force)) call put_histories(group, body_points, n, 'force', [(bodies(b)%force, b=1, n)], &
         'sum of the contact forces on the body{, Pbar}, up', 'force')
   end subroutine write_bodies

end module body_groups
