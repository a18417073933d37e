!> Datasets over the points whose displacements a results file contains besides the tip: contacts and bodies. The group
!> `surfaces`, for a beam with other contacts than a single stop below it: position, side, histories and measures of
!> each contact. Users read the word surface for a contact. The group `bodies`: position and histories of each body.
module point_groups
   use kinds, only: pi, wp
   use measure_list, only: contact_name, measure_count, measure_table
   use measure_rows, only: write_measure_lists
   use quantity_groups, only: quantity_group_t
   use response_types, only: contact_record_t, point_record_t
   use run_measures, only: row_of
   implicit none (type, external)
   private
   public :: contact_points, body_points, put_points, put_motion, put_amplitudes, in_degrees, &
      write_contacts, contact_names, write_bodies

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

      phase = atan2(aimag(amplitude), real(amplitude, wp))*(180.0_wp/pi)
   end function in_degrees

   !> Write a list over the contacts for each scalar quantity and a table over instants and contacts for each history.
   subroutine write_contacts(group, contacts, tau)
      type(quantity_group_t), intent(in) :: group
      !> Contacts in the order of the scene
      type(contact_record_t), intent(in) :: contacts(:)
      !> Sample times tau; without them no histories are written
      real(wp), contiguous, intent(in), optional :: tau(:)

      character(*), parameter :: along = 'surface'
      integer :: i

      call put_points(group, contact_points, size(contacts))
      call group%put_flags(along, contact_names(contacts))
      call group%put('stop', [contacts%stop], 'which &stop it belongs to, 0: to none', along)
      if (any(contacts%body > 0)) call group%put('body', [contacts%body], 'which &body it belongs to, 0: to none', &
         along)
      call group%put('side', [contacts%sign], '1: below the beam, -1: above it', along)
      call group%put('position', [contacts%position], 'length', 'position{ Lc/L}', along)
      call group%put('height', [contacts%height], 'displacement', 'd, up from the unstressed beam', along)
      if (present(tau) .and. size(contacts) > 0) call write_histories(group, contacts, tau)
      if (all([(allocated(contacts(i)%measures), i=1, size(contacts))])) call write_measures(group, contacts)
   end subroutine write_contacts

   !> Names of the contacts with blanks between them, such as 'stop_1_below stop_2_above'.
   pure function contact_names(contacts) result(names)
      type(contact_record_t), intent(in) :: contacts(:)
      character(:), allocatable :: names

      integer :: i

      names = ''
      do i = 1, size(contacts)
         if (i > 1) names = names//' '
         names = names//contact_name(contacts(i))
      end do
   end function contact_names

   !> Write the histories that were requested.
   subroutine write_histories(group, contacts, tau)
      type(quantity_group_t), intent(in) :: group
      type(contact_record_t), intent(in) :: contacts(:)
      real(wp), contiguous, intent(in) :: tau(:)

      integer :: k, n

      n = size(contacts)
      call group%put('tau', tau, 'time', 'time{ tau}', is_scale=.true.)
      if (allocated(contacts(1)%eta)) call put_histories(group, contact_points, n, 'eta', [(contacts(k)%eta, k=1, n)], &
         'displacement of ' &
         //'the beam there from the surface{, eta}; multiplied by `side`: the gap', 'displacement')
      if (allocated(contacts(1)%velocity)) call put_histories(group, contact_points, n, 'velocity', &
         [(contacts(k)%velocity, k=1, n)], &
         'velocity of the beam there{, d eta/d tau}', 'velocity')
      if (allocated(contacts(1)%force)) call put_histories(group, contact_points, n, 'force', [(contacts(k)%force, &
         k=1, n)], &
         'contact force{ Pbar}, away from the surface', 'force')
      if (allocated(contacts(1)%acceleration)) call put_histories(group, contact_points, n, 'acceleration', &
         [(contacts(k)%acceleration, k=1, n)], 'acceleration of the beam there, without impulses', 'acceleration')
      if (.not. allocated(contacts(1)%energy)) return
      call put_histories(group, contact_points, n, 'energy', [(contacts(k)%energy, k=1, n)], &
         'energy in the springs of the surface', &
         'energy')
      call put_histories(group, contact_points, n, 'dissipated', [(contacts(k)%dissipated, k=1, n)], &
         'dissipated so far in the surface and at impacts on it', 'energy')
   end subroutine write_histories

   !> Write the measures of each contact, and start and end of each interval in which a contact is closed.
   subroutine write_measures(group, contacts)
      type(quantity_group_t), intent(in) :: group
      !> Contacts, each with its measures allocated
      type(contact_record_t), intent(in) :: contacts(:)

      character(len(measure_table%name)) :: names(measure_count)
      real(wp) :: rows(measure_count, size(contacts))
      real(wp), allocatable :: start(:), end(:)
      integer, allocatable :: contact_index(:)
      integer :: i, k

      ! a dataset has the name of the measure in results of a run, or that in sweeps if a run has none; '': left out
      names = measure_table%name
      where (.not. measure_table%is_of_contact) names = ''
      where (measure_table%is_of_contact .and. measure_table%run_name /= '') names = measure_table%run_name
      allocate (start(0), end(0), contact_index(0))
      do k = 1, size(contacts)
         associate (measures => contacts(k)%measures)
            rows(:, k) = row_of(measures)
            start = [start, measures%contact_start]
            end = [end, measures%contact_end]
            contact_index = [contact_index, [(k, i=1, size(measures%contact_start))]]
         end associate
      end do
      call write_measure_lists(group, names, rows, 'surface')
      call group%put('contact', [(i, i=1, size(start))], 'contact that lasts, surface by surface', is_scale=.true.)
      call group%put('contact_surface', contact_index, 'its surface', 'contact')
      call group%put_flags('contact_surface', contact_names(contacts))
      call group%put('contact_start', start, 'time', 'its begin{, tau}', 'contact')
      call group%put('contact_end', end, 'time', 'its end or that of the run{, tau}', 'contact')
   end subroutine write_measures

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

end module point_groups
