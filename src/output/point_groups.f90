!> Datasets over the points whose displacements a results file contains besides the tip: contacts and bodies.
module point_groups
   use kinds, only: wp
   use quantity_groups, only: quantity_group_t
   implicit none (type, external)
   private
   public :: contact_points, body_points, put_points, put_histories, put_motion, put_all_amplitudes, in_degrees

   !> Points of one kind.
   type :: points_t
      !> Name of their scale
      character(7) :: scale
      !> Meaning of the scale
      character(64) :: order
      !> End of the names of datasets
      character(4) :: name
      !> Meaning of displacements
      character(160) :: displacement
      !> Meaning of amplitudes while no contact is closed
      character(160) :: amplitude
   end type points_t

   !> Contacts in the order of the scene.
   type(points_t), parameter :: contact_points = points_t('surface', &
      'surface, in the order of &stop and &body, below before above', 'stop', &
      'displacement of the beam there, up from the unstressed beam, relative to the body if it is one; at floor and ' &
      //'ceiling that of the body', &
      'amplitude of the beam there, relative to the body if it is one; at floor and ceiling that of the body')
   !> Bodies, the recorded points of a model.
   type(points_t), parameter :: body_points = points_t('body', 'body, in the order of &body', 'body', &
      'displacement of the body, up', 'amplitude of the body alone on its spring and damper')

contains

   !> Write the scale of points.
   subroutine put_points(group, points, number)
      type(quantity_group_t), intent(in) :: group
      type(points_t), intent(in) :: points
      !> Number of the points
      integer, intent(in) :: number

      integer :: k

      call group%put(trim(points%scale), [(k, k=1, number)], trim(points%order), is_scale=.true.)
   end subroutine put_points

   !> Write a history of each point over the scale `tau` and the scale of the points.
   subroutine put_histories(group, points, number, name, values, meaning, quantity)
      type(quantity_group_t), intent(in) :: group
      type(points_t), intent(in) :: points
      !> Number of the points
      integer, intent(in) :: number
      !> Name of the dataset
      character(*), intent(in) :: name
      !> Values at the samples of the first point, of the second, and so on
      real(wp), intent(in) :: values(:)
      character(*), intent(in) :: meaning
      character(*), intent(in) :: quantity

      call group%put(name, reshape(values, [size(values)/number, number]), quantity, meaning, 'tau '//points%scale)
   end subroutine put_histories

   !> Write displacements and velocities over the scale of the points and the scale `tau`.
   subroutine put_motion(group, points, displacement, velocity)
      type(quantity_group_t), intent(in) :: group
      type(points_t), intent(in) :: points
      !> Displacements, [points, instants]
      real(wp), intent(in) :: displacement(:, :)
      !> Velocities, [points, instants]
      real(wp), intent(in) :: velocity(:, :)

      call group%put('displacement_'//points%name, displacement, 'displacement', trim(points%displacement), &
         trim(points%scale)//' tau')
      call group%put('velocity_'//points%name, velocity, 'velocity', 'its velocity', trim(points%scale)//' tau')
   end subroutine put_motion

   !> Write complex amplitudes of all recorded points and of all contacts.
   subroutine put_all_amplitudes(group, points, contacts)
      type(quantity_group_t), intent(in) :: group
      !> Amplitudes of the recorded points, [points, frequencies]
      complex(wp), intent(in) :: points(:, :)
      !> Amplitudes of the contacts in the scene's order, [contacts, frequencies]
      complex(wp), intent(in) :: contacts(:, :)

      call put_amplitudes(group, body_points, points)
      call put_amplitudes(group, contact_points, contacts)
   end subroutine put_all_amplitudes

   !> Write complex amplitudes over the scale `omega`, and the scale of the points, if there are any.
   subroutine put_amplitudes(group, points, amplitude)
      type(quantity_group_t), intent(in) :: group
      type(points_t), intent(in) :: points
      !> Amplitudes, [points, frequencies]
      complex(wp), intent(in) :: amplitude(:, :)

      if (size(amplitude, 1) == 0) return
      call put_points(group, points, size(amplitude, 1))
      call group%put('amplitude_'//points%name, abs(amplitude), 'displacement', trim(points%amplitude), &
         trim(points%scale)//' omega')
      call group%put('phase_'//points%name, in_degrees(amplitude), 'number', 'its phase in degrees', &
         trim(points%scale)//' omega')
   end subroutine put_amplitudes

   !> Phase of a complex amplitude in degrees; 0 if the amplitude is 0.
   elemental real(wp) function in_degrees(amplitude) result(phase)
      complex(wp), intent(in) :: amplitude

      phase = atan2(aimag(amplitude), real(amplitude, wp))*(180.0_wp/acos(-1.0_wp))
   end function in_degrees

end module point_groups
