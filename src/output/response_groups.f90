!> The groups of a run in a results file: histories, events, shapes, energies, measures, statistics, and Poincare
!> sections (states of the motion at the instants of one phase angle in each period of the load).
module response_groups
   use history_list, only: history_count, history_table
   use kinds, only: wp
   use measure_list, only: force_window, first_statistic, measure_table
   use measure_rows, only: write_measures_of_run
   use number_text, only: to_text
   use point_groups, only: write_bodies, contact_names, write_contacts, contact_points, body_points, put_motion, &
      put_points
   use printable_text, only: joined
   use quantity_groups, only: quantity_group_t
   use response_types, only: event_closed_impulse, event_names, response_t, run_measures_t
   use run_measures, only: row_of
   use section_types, only: run_sections_t
   use signal_peaks, only: peak_tolerance
   use statistic_types, only: run_statistics_t, statistic_count
   use stress_groups, only: write_stress
   implicit none (type, external)
   private
   public :: write_run

contains

   !> Write every result that the run has.
   subroutine write_run(group, response, node_position)
      !> Parent of the groups
      type(quantity_group_t), intent(in) :: group
      type(response_t), intent(in) :: response
      !> Positions x/L of the nodes, root first; without them no shapes are written
      real(wp), contiguous, intent(in), optional :: node_position(:)

      call write_histories(group%subgroup('response'), response)
      call write_events(group%subgroup('events'), response)
      if (allocated(response%shape_tau) .and. present(node_position)) then
         call write_shapes(group%subgroup('shapes'), response, node_position)
      end if
      if (allocated(response%energy)) call write_energy(group%subgroup('energy'), response)
      if (allocated(response%measures)) call write_measures(group%subgroup('measures'), response%measures, &
         allocated(response%contacts))
      if (allocated(response%statistics)) then
         call write_statistics(group%subgroup('statistics'), response%statistics, contact_names(response%contacts))
      end if
      if (allocated(response%sections)) then
         call write_sections(group%subgroup('poincare'), response%sections, contact_names(response%contacts))
      end if
      ! an unallocated component is an absent argument
      if (allocated(response%contacts)) call write_contacts(group%subgroup('surfaces'), response%contacts, response%tau)
      if (allocated(response%points)) call write_bodies(group%subgroup('bodies'), response%points, response%tau)
      if (allocated(response%moments)) call write_stress(group%subgroup('stress'), response%moments, response%tau, &
         response%moment_windows)
   end subroutine write_run

   !> Write the histories at the sample times, and as attributes the cost of the run and the checks of modes and mesh.
   subroutine write_histories(group, response)
      type(quantity_group_t), intent(in) :: group
      type(response_t), intent(in) :: response

      integer :: i

      if (allocated(response%contacts)) call group%attribute('among_several_surfaces', group%resolved( &
         'displacement_stop and velocity_stop are of the stop from which the beam ' &
         //'is released, contact_force is the sum over all; each: /surfaces'))
      call group%attribute('evaluations', real(response%evaluations, wp))
      call group%attribute('rejected', real(response%rejected, wp))
      call group%attribute('factorisations', real(response%factorisations, wp))
      associate (check => response%mode_check)
         call group%attribute('modes_kept', real(check%retained, wp))
         if (check%compared_modes > 0) then
            call group%attribute('modes_compared', real(check%compared_modes, wp))
            call group%attribute('mode_difference', check%difference)
            call group%attribute('mode_tolerance', check%tolerance)
            call group%attribute('modes_agree', merge(1.0_wp, 0.0_wp, check%agrees))
            call group%put_attribute('mode_horizon', check%horizon, 'time')
         end if
      end associate
      associate (check => response%mesh_check)
         call group%attribute('mesh_mass', trim(merge('redistributed', 'consistent   ', check%is_redistributed)))
         if (check%finer_elements > 0) then
            call group%attribute('mesh_tolerance', check%tolerance)
            call group%attribute('mesh_compared', real(check%finer_elements, wp))
            call group%attribute('mesh_difference', check%difference)
            call group%put_attribute('mesh_horizon', check%horizon, 'time')
            call group%attribute('mesh_is_settled', merge(1.0_wp, 0.0_wp, check%is_converged))
         end if
      end associate
      if (.not. allocated(response%tau)) return
      call group%put('tau', response%tau, 'time', 'time{ tau}', is_scale=.true.)
      do i = 1, history_count
         if (.not. allocated(response%history(i)%values)) cycle
         associate (history => history_table(i))
            call group%put(trim(history%name), response%history(i)%values, history%quantity, history%meaning, 'tau')
         end associate
      end do
   end subroutine write_histories

   !> Write the events (impacts, begins and ends of contact), in order of time.
   subroutine write_events(group, response)
      type(quantity_group_t), intent(in) :: group
      type(response_t), intent(in) :: response

      integer :: count, i, kinds

      ! only with several contacts can an impact at one cause an impulse on another that is closed
      kinds = merge(size(event_names), event_closed_impulse - 1, allocated(response%contacts))
      count = response%event_count
      call group%put('tau', [(response%events(i)%tau, i=1, count)], 'time', 'time of the event{, tau}', is_scale=.true.)
      call group%put('kind', [(response%events(i)%kind, i=1, count)], 'kind of the event', along='tau')
      call group%put_flags('kind', joined(event_names(:kinds), ' '))
      call group%put('eta', [(response%events(i)%eta, i=1, count)], 'displacement', &
         'displacement of the beam at the stop, up from its surface{, eta}', 'tau')
      call group%put('velocity_before', [(response%events(i)%velocity_before, i=1, count)], 'velocity', &
         'velocity of the beam at the stop just before, upwards: positive at a stop above{, d eta/d tau}', 'tau')
      call group%put('velocity_after', [(response%events(i)%velocity_after, i=1, count)], 'velocity', &
         'velocity of the beam at the stop just after, upwards{, d eta/d tau}', 'tau')
      call group%put('impulse', [(response%events(i)%impulse, i=1, count)], 'impulse', &
         'impulse on the beam, away from the surface{ in rho Abar L omega1 (y_c(0) - d)}', 'tau')
      call group%put('energy_change', [(response%events(i)%energy_change, i=1, count)], 'energy', &
         'change of energy{ in rho Abar L omega1^2 (y_c(0) - d)^2}', 'tau')
      if (.not. allocated(response%contacts)) return
      call group%put('surface', [(response%events(i)%contact, i=1, count)], 'surface at which it happens', along='tau')
      call group%put_flags('surface', contact_names(response%contacts))
   end subroutine write_events

   !> Write the shapes of the whole beam at the requested instants.
   subroutine write_shapes(group, response, node_position)
      type(quantity_group_t), intent(in) :: group
      type(response_t), intent(in) :: response
      !> Positions x/L of the nodes
      real(wp), contiguous, intent(in) :: node_position(:)

      call group%put('tau', response%shape_tau, 'time', 'time{ tau}', is_scale=.true.)
      call group%put('x', node_position, 'length', 'position of the nodes{ x/L}', is_scale=.true.)
      call write_shape('displacement', response%shape_displacement, &
         'displacement of the beam, up from the surface of the stop, without a stop from the unstressed beam{, eta}')
      call write_shape('slope', response%shape_slope, '{d eta/d(x/L)~slope of the beam}')
      call write_shape('velocity', response%shape_velocity, 'velocity of the beam{, d eta/d tau}')
      call write_shape('slope_velocity', response%shape_slope_velocity, &
         '{d^2 eta/(d(x/L) d tau)~angular velocity of the beam}')

   contains

      !> Write one table over nodes and instants, if it was recorded.
      subroutine write_shape(name, values, meaning)
         !> Name of the dataset and of its quantity
         character(*), intent(in) :: name
         !> Values, [nodes, instants]
         real(wp), contiguous, intent(in), optional :: values(:, :)
         !> Long name of the dataset
         character(*), intent(in) :: meaning

         if (present(values)) call group%put(name, values, name, meaning, 'x tau')
      end subroutine write_shape

   end subroutine write_shapes

   !> Write the terms of the energy balance at the sample times.
   subroutine write_energy(group, response)
      type(quantity_group_t), intent(in) :: group
      type(response_t), intent(in) :: response

      call group%put_attribute('initial', response%initial_energy, 'energy')
      call group%put('tau', response%tau, 'time', 'time{ tau}', is_scale=.true.)
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

      !> Write one term of the energy balance, if it was recorded.
      subroutine add(name, values, meaning)
         character(*), intent(in) :: name
         real(wp), contiguous, intent(in), optional :: values(:)
         character(*), intent(in) :: meaning

         if (present(values)) call group%put(name, values, 'energy', meaning, 'tau')
      end subroutine add

   end subroutine write_energy

   !> Write the measures that the terminal shows, each interval of contact and the peak of each rebound.
   subroutine write_measures(group, measures, has_contacts)
      type(quantity_group_t), intent(in) :: group
      type(run_measures_t), intent(in) :: measures
      !> Whether the run has several contacts, each with measures in the group `surfaces`
      logical, intent(in) :: has_contacts

      integer :: i

      if (has_contacts) call group%attribute('among_several_surfaces', 'impacts, contacts and total_contact are ' &
         //'sums over all, first_impact_time is the first, longest_contact, forces and greatest_impulse are the ' &
         //'maximum; rebounds, peaks and settling_time are of the stop from which the beam is released; of each ' &
         //'stop: /surfaces')
      if (measures%extremes_tolerance > peak_tolerance) call group%attribute('tolerance', measures%extremes_tolerance)
      call group%put('duration', measures%duration, 'time', 'length of the run{, tau}')
      if (measures%greatest_mean_force >= 0.0_wp) call group%put_attribute('force_window', force_window, 'time')
      call write_measures_of_run(group, row_of(measures))
      call group%put('contact', [(i, i=1, size(measures%contact_start))], 'contact', is_scale=.true.)
      call group%put('contact_start', measures%contact_start, 'time', 'begin of the contact{, tau}', 'contact')
      call group%put('contact_end', measures%contact_end, 'time', 'end of the contact or of the run{, tau}', 'contact')
      call group%put('rebound', [(i, i=1, size(measures%peak_eta))], 'rebound', is_scale=.true.)
      call group%put('peak_tau', measures%peak_tau, 'time', 'time of the peak of the rebound{, tau}', 'rebound')
      call group%put('peak', measures%peak_eta, 'displacement', 'peak of the rebound, {eta~distance} from the ' &
         //'surface of the stop', 'rebound')
   end subroutine write_measures

   !> Write the instants of the sections, the states of the motion at the sections and, if it was computed, the Lyapunov
   !> exponent.
   subroutine write_sections(group, sections, names)
      type(quantity_group_t), intent(in) :: group
      type(run_sections_t), intent(in) :: sections
      !> Names of the contacts, with blanks between them
      character(*), intent(in) :: names

      integer :: k, contacts, extra

      associate (n => sections%count)
         call group%put_attribute('period', sections%period, 'time')
         call group%attribute('motion_period', [sections%motion_period])
         call group%attribute('impacts_per_period', sections%impacts_per_period)
         call group%attribute('tolerance', sections%tolerance)
         if (allocated(sections%log_norm)) then
            call group%put_attribute('lyapunov_exponent', sections%lyapunov_exponent, 'rate')
            call group%attribute('lyapunov_exponent_per_period', sections%lyapunov_exponent*sections%period)
         end if
         call group%put('tau', sections%tau(:n), 'time', 'instant of the section{, tau}', is_scale=.true.)
         ! a section within rounding of the end of a period belongs to that period
         call group%put('load_period', ceiling(sections%tau(:n)/sections%period - 1.0e-9_wp), &
            'in which period of the load it is', 'tau')
         call group%put('impacts', sections%impacts(:n), 'impacts in the period before', 'tau')
         call group%put('displacement_tip', sections%displacement(1, 0, :n), 'displacement', &
            'displacement of the tip, up from the unstressed beam', 'tau')
         call group%put('velocity_tip', sections%displacement(2, 0, :n), 'velocity', 'its velocity', 'tau')
         if (allocated(sections%log_norm)) call group%put('log_variation', sections%log_norm(:n), 'number', &
            'logarithm of the size of a variation of the motion, no number where nothing is left of it', 'tau')
         contacts = size(sections%contact, 2)
         if (contacts > 0) then
            call put_points(group, contact_points, contacts)
            call group%put_flags('surface', names)
            call put_motion(group, contact_points, sections%contact(1, :, :n), sections%contact(2, :, :n))
         end if
         extra = ubound(sections%displacement, 2)
         if (extra > 0) then
            call put_points(group, body_points, extra)
            call put_motion(group, body_points, sections%displacement(1, 1:, :n), sections%displacement(2, 1:, :n))
         end if
         if (.not. allocated(sections%modes)) return
         call group%put('mode', [(k, k=1, size(sections%modes, 2))], 'free mode, of unit modal mass rho Abar L = 1', &
            is_scale=.true.)
         call group%put('displacement_mode', sections%modes(1, :, :n), 'displacement', 'its coordinate', 'mode tau')
         call group%put('velocity_mode', sections%modes(2, :, :n), 'velocity', 'the rate of that', 'mode tau')
      end associate
   end subroutine write_sections

   !> Write the statistics of the impacts of a run, of all contacts together and of each alone: with confidence
   !> intervals and values of the blocks, and with histograms of the impacts.
   subroutine write_statistics(group, statistics, names)
      type(quantity_group_t), intent(in) :: group
      type(run_statistics_t), intent(in) :: statistics
      !> Names of the contacts, with blanks between them
      character(*), intent(in) :: names

      character(*), parameter :: along = 'surface', half_width_ending = '_half_width', block_ending = '_in_blocks'
      type(quantity_group_t) :: histogram
      integer :: blocks, i, k, contacts

      blocks = size(statistics%in_block, 2)
      contacts = size(statistics%has_finite_force)
      call group%put(along, [(k, k=0, contacts)], 'surface, in the order of &stop and &body, below before above; ' &
         //'0: all together', is_scale=.true.)
      call group%put_flags(along, trim('all '//names), first=0)
      call group%attribute('all', 'of all surfaces together sums and means are of the sum of their forces, impacts ' &
         //'and times in contact; displacements of the stop point are of the stop from which the beam is released')
      call group%attribute('half_widths', '95 % by the t distribution over the blocks; nan: there is none')
      if (.not. all(statistics%has_finite_force)) call group%attribute('restitution', 'an impulse has neither a ' &
         //'maximum force nor a square: of a rigid stop RMS and maximum forces are nan, means over the time in ' &
         //'contact are without impulses, and the classes are of impulses')
      if (any(statistics%is_maximum_unfinished)) call group%attribute('unfinished', 'an impact lasts at the end; ' &
         //'mean and maximum impulses of its surface contain its force until then')
      call group%put('block', [(i, i=1, blocks)], 'block', is_scale=.true.)
      call group%put('block_start', statistics%edge(0:blocks - 1), 'time', 'begin of the block{, tau}', 'block')
      call group%put('block_end', statistics%edge(1:), 'time', 'its end{, tau}', 'block')
      do i = 1, statistic_count
         associate (measure => measure_table(first_statistic - 1 + i))
            call group%put(trim(measure%name), statistics%value(i, :), measure%quantity, measure%meaning, along)
            if (statistics%tolerance(i) > peak_tolerance) call group%attribute('tolerance', statistics%tolerance(i), &
               group%named(trim(measure%name)))
            call group%put(trim(measure%name)//half_width_ending, statistics%half_width(i, :), measure%quantity, &
               'half the width of its 95 % interval', along)
            call group%put(trim(measure%name)//block_ending, statistics%in_block(i, :, :), measure%quantity, &
               'the same block by block', 'block surface')
         end associate
      end do
      do k = 1, contacts
         histogram = group%subgroup('surface_'//to_text(k))
         if (statistics%has_finite_force(k)) then
            call histogram%put('class', statistics%class_edge(:, k), 'force', &
               'upper end of the class, maximum force of an impact', is_scale=.true.)
         else
            call histogram%put('class', statistics%class_edge(:, k), 'impulse', &
               'upper end of the class, impulse of an impact', is_scale=.true.)
         end if
         call histogram%put('impacts', statistics%class_count(:, k), 'impacts in it; in the first: from 0 on', 'class')
      end do
   end subroutine write_statistics

end module response_groups
