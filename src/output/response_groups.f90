!> The groups of a run through time in a results file: histories, events, shapes, energies, measures.
module response_groups
   use hdf5_writing, only: hdf5_group_t
   use history_list, only: history_count, history_table
   use kinds, only: wp
   use measure_list, only: measure_table
   use measure_rows, only: write_measures_of_run
   use response_types, only: event_blow, event_names, response_t, run_measures_t
   use run_measures, only: row_of
   use scene_units, only: in_scene_units, units_t
   use surface_groups, only: names_of, write_surfaces
   implicit none (type, external)
   private
   public :: write_run

contains

   !> All that a run has.
   subroutine write_run(group, response, units, node_position)
      !> In which each has a group of its own
      type(hdf5_group_t), intent(in) :: group
      type(response_t), intent(in) :: response
      type(units_t), intent(in) :: units
      !> x/L of the nodes, clamp first; shapes have no place without them
      real(wp), contiguous, intent(in), optional :: node_position(:)

      call write_histories(group%group('response'), response, units)
      call write_events(group%group('events'), response, units)
      if (allocated(response%shape_tau) .and. present(node_position)) then
         call write_shapes(group%group('shapes'), response, node_position, units)
      end if
      if (allocated(response%energy)) call write_energy(group%group('energy'), response, units)
      if (allocated(response%measures)) call write_measures(group%group('measures'), response%measures, &
         allocated(response%surfaces), units)
      ! sample times that are not allocated are not present
      if (allocated(response%surfaces)) call write_surfaces(group%group('surfaces'), response%surfaces, units, &
         response%tau)
   end subroutine write_run

   subroutine write_histories(group, response, units)
      type(hdf5_group_t), intent(in) :: group
      type(response_t), intent(in) :: response
      type(units_t), intent(in) :: units

      integer :: i

      if (allocated(response%surfaces)) call group%attribute('among_several_surfaces', 'eta_stop and velocity_stop ' &
         //'are of the stop from which the beam is released, contact_force is the sum over all; each: /surfaces')
      call group%attribute('evaluations', real(response%evaluations, wp))
      call group%attribute('rejected', real(response%rejected, wp))
      call group%attribute('factorisations', real(response%factorisations, wp))
      associate (check => response%mode_check)
         call group%attribute('modes_kept', real(check%kept, wp))
         if (check%compared > 0) then
            call group%attribute('modes_compared', real(check%compared, wp))
            call group%attribute('mode_difference', check%difference)
            call group%attribute('mode_horizon', check%horizon)
         end if
      end associate
      associate (check => response%mesh_check)
         call group%attribute('mesh_mass', trim(merge('redistributed', 'consistent   ', check%is_redistributed)))
         if (check%compared > 0) then
            call group%attribute('mesh_tolerance', check%tolerance)
            call group%attribute('mesh_compared', real(check%compared, wp))
            call group%attribute('mesh_difference', check%difference)
            call group%attribute('mesh_horizon', check%horizon)
            call group%attribute('mesh_is_settled', merge(1.0_wp, 0.0_wp, check%is_settled))
         end if
      end associate
      if (.not. allocated(response%tau)) return
      call group%add('tau', response%tau, '1', 'time tau', is_scale=.true., in_scene_units=units%time)
      do i = 1, history_count
         if (.not. allocated(response%history(i)%values)) cycle
         associate (history => history_table(i))
            call group%add(trim(history%dataset), response%history(i)%values, '1', trim(history%meaning), 'tau', &
               in_scene_units=in_scene_units(history%unit, units))
         end associate
      end do
   end subroutine write_histories

   subroutine write_events(group, response, units)
      type(hdf5_group_t), intent(in) :: group
      type(response_t), intent(in) :: response
      type(units_t), intent(in) :: units

      character(:), allocatable :: meanings
      integer :: count, i, kinds

      ! only among several surfaces one takes an impulse as another is hit
      kinds = merge(size(event_names), event_blow - 1, allocated(response%surfaces))
      meanings = trim(event_names(1))
      do i = 2, kinds
         meanings = meanings//' '//trim(event_names(i))
      end do
      count = response%event_count
      call group%add('tau', [(response%events(i)%tau, i=1, count)], '1', 'time of the event, tau', &
         is_scale=.true., in_scene_units=units%time)
      call group%add('kind', [(response%events(i)%kind, i=1, count)], '1', 'kind of the event', along='tau')
      call group%attribute('flag_values', [(i, i=1, kinds)], 'kind')
      call group%attribute('flag_meanings', meanings, 'kind')
      call group%add('eta', [(response%events(i)%eta, i=1, count)], '1', &
         'displacement of the beam at the stop, eta', 'tau', in_scene_units=units%displacement)
      call group%add('velocity_before', [(response%events(i)%velocity_before, i=1, count)], '1', &
         'velocity of the beam at the stop just before, d eta/d tau', 'tau', in_scene_units=units%velocity)
      call group%add('velocity_after', [(response%events(i)%velocity_after, i=1, count)], '1', &
         'velocity of the beam at the stop just after, d eta/d tau', 'tau', in_scene_units=units%velocity)
      call group%add('impulse', [(response%events(i)%impulse, i=1, count)], '1', &
         'impulse on the beam in rho Abar L omega1 (y_c(0) - d)', 'tau', in_scene_units=units%impulse)
      call group%add('energy_change', [(response%events(i)%energy_change, i=1, count)], '1', &
         'change of energy in rho Abar L omega1^2 (y_c(0) - d)^2', 'tau', in_scene_units=units%energy)
      if (.not. allocated(response%surfaces)) return
      call group%add('surface', [(response%events(i)%surface, i=1, count)], '1', 'surface at which it happens', &
         along='tau')
      call group%attribute('flag_values', [(i, i=1, size(response%surfaces))], 'surface')
      call group%attribute('flag_meanings', names_of(response%surfaces), 'surface')
   end subroutine write_events

   !> Shapes of the whole beam at chosen instants.
   subroutine write_shapes(group, response, node_position, units)
      type(hdf5_group_t), intent(in) :: group
      type(response_t), intent(in) :: response
      !> x/L of the nodes
      real(wp), contiguous, intent(in) :: node_position(:)
      type(units_t), intent(in) :: units

      call group%add('tau', response%shape_tau, '1', 'time tau', is_scale=.true., in_scene_units=units%time)
      call group%add('x', node_position, '1', 'position of the nodes x/L', is_scale=.true., in_scene_units=units%length)
      call write_shape('displacement', response%shape_displacement, 'displacement of the beam, eta', units%displacement)
      call write_shape('slope', response%shape_slope, 'd eta/d(x/L)', units%slope)
      call write_shape('velocity', response%shape_velocity, 'velocity of the beam, d eta/d tau', units%velocity)
      call write_shape('slope_velocity', response%shape_slope_velocity, 'd^2 eta/(d(x/L) d tau)', units%slope_velocity)

   contains

      !> One table over nodes and instants, if it is there.
      subroutine write_shape(name, values, long_name, unit)
         !> Name, values and meaning of the dataset
         character(*), intent(in) :: name
         real(wp), contiguous, intent(in), optional :: values(:, :)
         character(*), intent(in) :: long_name
         !> One unit of it in the units of the scene; 0: not known
         real(wp), intent(in) :: unit

         if (.not. present(values)) return
         call group%add(name, values, '1', long_name, ['x  ', 'tau'], in_scene_units=unit)
      end subroutine write_shape

   end subroutine write_shapes

   subroutine write_energy(group, response, units)
      type(hdf5_group_t), intent(in) :: group
      type(response_t), intent(in) :: response
      type(units_t), intent(in) :: units

      call group%attribute('initial', response%initial_energy)
      call group%add('tau', response%tau, '1', 'time tau', is_scale=.true., in_scene_units=units%time)
      associate (energy => response%energy)
         call add('kinetic', energy%kinetic, 'kinetic energy of beam and tip mass')
         call add('strain', energy%strain, 'strain energy of the beam')
         call add('stop', energy%stop, 'energy in the springs of the stop')
         call add('dissipated_beam', energy%dissipated_beam, 'dissipated so far inside the beam')
         call add('dissipated_stop', energy%dissipated_stop, 'dissipated so far in the stop')
         call add('dissipated_impact', energy%dissipated_impact, 'dissipated so far at impacts')
         call add('created', energy%created, 'created so far by the nodal reading of the impulse')
         call add('work', energy%work, 'work done so far by forces and by the motion of the base')
      end associate

   contains

      !> One entry of the ledger, if it is there.
      subroutine add(name, values, long_name)
         character(*), intent(in) :: name
         real(wp), contiguous, intent(in), optional :: values(:)
         character(*), intent(in) :: long_name

         if (present(values)) call group%add(name, values, '1', long_name, 'tau', in_scene_units=units%energy)
      end subroutine add

   end subroutine write_energy

   !> What the table on the console says.
   subroutine write_measures(group, measures, has_surfaces, units)
      type(hdf5_group_t), intent(in) :: group
      type(run_measures_t), intent(in) :: measures
      !> There are several, which have measures of their own
      logical, intent(in) :: has_surfaces
      type(units_t), intent(in) :: units

      integer :: i

      if (has_surfaces) call group%attribute('among_several_surfaces', 'impacts, contacts and total_contact are ' &
         //'sums over all, first_impact is the first, longest_contact, greatest_force and greatest_impulse are the ' &
         //'greatest; rebounds, peaks and quiet are of the stop from which the beam is released; each: /surfaces')
      call group%add('duration', measures%duration, '1', 'length of the run, tau', in_scene_units=units%time)
      call write_measures_of_run(group, row_of(measures), in_scene_units(measure_table%unit, units))
      call group%add('contact', [(i, i=1, size(measures%contact_start))], '1', 'contact', is_scale=.true.)
      call group%add('contact_start', measures%contact_start, '1', 'begin of the contact, tau', 'contact', &
         in_scene_units=units%time)
      call group%add('contact_end', measures%contact_end, '1', 'end of the contact or of the run, tau', 'contact', &
         in_scene_units=units%time)
      call group%add('rebound', [(i, i=1, size(measures%peak_eta))], '1', 'rebound', is_scale=.true.)
      call group%add('peak_tau', measures%peak_tau, '1', 'time of the peak of the rebound, tau', 'rebound', &
         in_scene_units=units%time)
      call group%add('peak', measures%peak_eta, '1', 'peak of the rebound, eta at the stop', 'rebound', &
         in_scene_units=units%displacement)
   end subroutine write_measures

end module response_groups
