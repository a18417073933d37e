!> Recording of a Newmark run: histories at the samples, displacements of the whole beam (shapes) at instants within a
!> step, and bending moments at the requested positions, from displacements y, velocities v and accelerations a of the
!> degrees of freedom (docs/theory.md, section 19). Between the ends of steps moments are interpolated linearly.
!>
!> Newmark steps satisfy M* a + C* v + K y = F with matrices M* and C* that contain terms in K (`newmark_stepper`), so
!> the moments contain these terms too.
module newmark_samples
   use applied_loads, only: applied_loads_t, gather_loads
   use beam_model, only: beam_model_t
   use contact_rows, only: row_value
   use history_list, only: acceleration_stop, acceleration_tip, eta_stop, eta_tip, force_stop, velocity_stop
   use kinds, only: wp
   use load_courses, only: value_at
   use moment_places, only: find_place_weights, take_modes
   use newmark_energies, only: kinetic_energy, strain_energy
   use newmark_modes, only: nodal_state
   use newmark_run, only: instant_of, newmark_run_t, contact_energy
   use newmark_stepper, only: newmark_state_t
   use response_types, only: response_t
   use run_recorder, only: record_sample, sample_t
   use run_settings, only: run_settings_t
   use skyline_matrix, only: combine, factorise, multiply, solve_factorised
   use stop_contacts, only: force_on_point
   implicit none (type, external)
   private
   public :: take_sample, shapes_in_step, start_moments, moments_now

contains

   !> Record the present state as a sample.
   pure subroutine take_sample(run, response)
      type(newmark_run_t), intent(inout) :: run
      !> Histories are recorded if they are allocated
      type(response_t), intent(inout) :: response

      type(sample_t) :: sample
      ! index of the sample in the histories, of which the first is the start
      integer :: place
      integer :: k
      ! energy of one stop
      real(wp) :: energy

      place = run%sample + 1
      associate (state => run%states(run%now), stepper => run%stepper)
         if (run%release_contact > 0) then
            ! the surface of the release contact may move: the histories are those of the gap
            associate (contact => run%contacts(run%release_contact))
               sample%history(eta_stop) = contact%row%sign*(row_value(contact%row, state%beam%displacement) &
                  - contact%contact%height)
               sample%history(velocity_stop) = contact%row%sign*row_value(contact%row, state%beam%velocity)
               sample%history(acceleration_stop) = contact%row%sign*row_value(contact%row, state%beam%acceleration)
            end associate
         else
            sample%history(eta_stop) = state%beam%displacement(stepper%stop_dof) - run%height
            sample%history(velocity_stop) = state%beam%velocity(stepper%stop_dof)
            sample%history(acceleration_stop) = state%beam%acceleration(stepper%stop_dof)
         end if
         sample%history(eta_tip) = state%beam%displacement(stepper%tip_dof) - run%height
         sample%history(acceleration_tip) = state%beam%acceleration(stepper%tip_dof)
         sample%history(force_stop) = run%height_ratio*sum(state%force)
         if (allocated(response%energy)) then
            call kinetic_energy(stepper, state%beam, sample%beam_energy(1))
            call strain_energy(stepper, state%beam, sample%beam_energy(2))
         end if
         do k = 1, size(run%contacts)
            associate (contact => run%contacts(k), record => response%contacts(run%contacts(k)%contact%number))
               if (allocated(record%eta)) record%eta(place) = contact%row%sign*(row_value(contact%row, &
                  state%beam%displacement) - contact%contact%height)
               if (allocated(record%velocity)) record%velocity(place) = contact%row%sign*row_value(contact%row, &
                  state%beam%velocity)
               if (allocated(record%acceleration)) record%acceleration(place) = &
                  contact%row%sign*row_value(contact%row, state%beam%acceleration)
               if (allocated(record%force)) record%force(place) = run%height_ratio*state%force(k)
               if (.not. allocated(response%energy)) cycle
               energy = contact_energy(run, k, state)
               sample%stop_energy = sample%stop_energy + energy
               if (.not. allocated(record%energy)) cycle
               record%energy(place) = energy
               record%dissipated(place) = contact%dissipated
            end associate
         end do
      end associate
      associate (state => run%states(run%now), point => run%points)
         if (size(point) > 0) sample%points = reshape([(point(k)%origin + state%beam%displacement(point(k)%dof), &
            state%beam%velocity(point(k)%dof), sum(run%height_ratio*state%force &
            *force_on_point(run%contacts%contact, k)), k=1, size(point))], [3, size(point)])
      end associate
      if (allocated(run%place_weights)) sample%moment = moments_now(run)
      call record_sample(place, sample, run%energy_balance, response)
   end subroutine take_sample

   !> Record the requested shapes within the last step.
   pure subroutine shapes_in_step(run, step, response)
      type(newmark_run_t), intent(inout) :: run
      !> Length of the step; 0: the start of the run
      real(wp), intent(in) :: step
      !> Receives the shapes
      type(response_t), intent(inout) :: response

      if (run%next_shape > size(response%shape_tau)) return
      if (response%shape_tau(run%next_shape) > instant_of(run)) return
      associate (old => run%states(3 - run%now)%beam, new => run%states(run%now)%beam)
         if (allocated(run%modes)) then
            call interpolate_shapes(run%root_dofs, nodal_state(run%modes, old), nodal_state(run%modes, new), &
               instant_of(run), step, run%height, run%next_shape, response)
         else
            call interpolate_shapes(run%root_dofs, old, new, instant_of(run), step, run%height, run%next_shape, &
               response)
         end if
      end associate
   end subroutine shapes_in_step

   !> Interpolate the requested shapes within a step: displacements by the Hermite cubic through both states, velocities
   !> linearly. At the instant of an event the state before the event is recorded.
   pure subroutine interpolate_shapes(root_dofs, old, new, tau, step, height, next, response)
      !> Displacement and rotation of the root among the degrees of freedom, numbered after those of the nodes; 0: fixed
      integer, intent(in) :: root_dofs(2)
      !> State at the beginning of the step
      type(newmark_state_t), intent(in) :: old
      !> State at the end of the step
      type(newmark_state_t), intent(in) :: new
      !> Instant of the end of the step, tau
      real(wp), intent(in) :: tau
      !> Length of the step; 0: the start of the run
      real(wp), intent(in) :: step
      !> Height d of the release contact, from which displacements are measured
      real(wp), intent(in) :: height
      !> Index of the next shape to record
      integer, intent(inout) :: next
      !> Receives the shapes
      type(response_t), intent(inout) :: response

      ! position within the step, 0 to 1
      real(wp) :: s
      ! Hermite polynomials at this position
      real(wp) :: weight(4)
      ! number of degrees of freedom of the nodes besides the root
      integer :: order

      order = 2*(size(response%shape_displacement, 1) - 1)
      do while (next <= size(response%shape_tau))
         if (response%shape_tau(next) > tau) exit
         ! the instant lies within the step except for rounding
         s = 1.0_wp
         if (step > 0.0_wp) s = max(0.0_wp, 1.0_wp - (tau - response%shape_tau(next))/step)
         weight = [(1.0_wp + 2.0_wp*s)*(1.0_wp - s)**2, step*s*(1.0_wp - s)**2, &
            s**2*(3.0_wp - 2.0_wp*s), -step*s**2*(1.0_wp - s)]
         associate (y => response%shape_displacement(:, next), slope => response%shape_slope(:, next), &
            v => response%shape_velocity(:, next), slope_rate => response%shape_slope_velocity(:, next))
            ! index 1 is the root: at rest, unless it is among the degrees of freedom (below)
            y(1) = -height
            y(2:) = weight(1)*old%displacement(1:order:2) + weight(2)*old%velocity(1:order:2) &
               + weight(3)*new%displacement(1:order:2) + weight(4)*new%velocity(1:order:2) - height
            slope(2:) = weight(1)*old%displacement(2:order:2) + weight(2)*old%velocity(2:order:2) &
               + weight(3)*new%displacement(2:order:2) + weight(4)*new%velocity(2:order:2)
            v(2:) = (1.0_wp - s)*old%velocity(1:order:2) + s*new%velocity(1:order:2)
            slope_rate(2:) = (1.0_wp - s)*old%velocity(2:order:2) + s*new%velocity(2:order:2)
            associate (dofs => root_dofs)
               if (dofs(1) > 0) then
                  y(1) = value_within(dofs(1)) - height
                  v(1) = (1.0_wp - s)*old%velocity(dofs(1)) + s*new%velocity(dofs(1))
               end if
               if (dofs(2) > 0) then
                  slope(1) = value_within(dofs(2))
                  slope_rate(1) = (1.0_wp - s)*old%velocity(dofs(2)) + s*new%velocity(dofs(2))
               end if
            end associate
         end associate
         next = next + 1
      end do

   contains

      !> Interpolated value of a degree of freedom.
      pure real(wp) function value_within(dof) result(value)
         integer, intent(in) :: dof

         value = weight(1)*old%displacement(dof) + weight(2)*old%velocity(dof) + weight(3)*new%displacement(dof) &
            + weight(4)*new%velocity(dof)
      end function value_within

   end subroutine interpolate_shapes

   !> Compute the weights of the moments, and the coefficients of M* and C*.
   subroutine start_moments(model, settings, response, run)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      !> The response, whose moments are allocated if the scene requests them
      type(response_t), intent(in) :: response
      !> The run, with its loads; its error is set if the mass matrix cannot be factorised
      type(newmark_run_t), intent(inout) :: run

      type(applied_loads_t) :: loads

      if (.not. allocated(response%moments)) return
      allocate (run%place_weights)
      call find_place_weights(model, settings, run%loads, run%place_weights)
      if (allocated(run%modes)) then
         ! those of the run are loads on its modes
         call gather_loads(model, settings, loads)
         call take_modes(model, run%modes, run%contacts%contact, loads, run%place_weights)
      end if
      associate (scheme => settings%response, stepper => run%stepper)
         run%damping_acceleration_factor = (scheme%newmark_gamma - 0.5_wp)*stepper%step
         run%stiffness_acceleration_factor = 2.0_wp*settings%zeta*run%damping_acceleration_factor &
            + (scheme%newmark_beta - 0.5_wp*scheme%newmark_gamma)*stepper%step**2
         run%mass_damping = 2.0_wp*settings%zeta_mass
         run%has_modal_damping = allocated(settings%mode_ratios)
         if (.not. run%has_modal_damping) return
         run%mode_damping = combine(1.0_wp, stepper%damping, -stepper%stiffness_damping, stepper%stiffness)
         ! M, from which the factors are made
         run%bare_mass = combine(1.0_wp, combine(1.0_wp, stepper%mass, -run%damping_acceleration_factor, &
            run%mode_damping), -run%stiffness_acceleration_factor, stepper%stiffness)
         call factorise(run%bare_mass, run%error)
      end associate
   end subroutine start_moments

   !> Bending moments of the present state, from M* a + C* v + K y. The terms in K depend on the curvature at the cross
   !> section; M, and the damping in proportion to M or given for each mode, contribute as forces distributed along the
   !> beam.
   pure function moments_now(run) result(moment)
      type(newmark_run_t), intent(in) :: run
      !> Moments, [places]
      real(wp) :: moment(size(run%place_weights%stiffness, 2))

      ! The moment is that of M times `inertial` and of K times `elastic`. `damped` is M^-1 C' (v + (gamma - 1/2) h a),
      ! with the damping C' without its term in K. Bodies, which come after the beam, cause no moment
      real(wp), dimension(run%stepper%order) :: inertial, damped, elastic
      integer :: g

      associate (state => run%states(run%now), stepper => run%stepper, n => run%stepper%order)
         associate (y => state%beam%displacement(1:n), v => state%beam%velocity(1:n), &
            a => state%beam%acceleration(1:n))
            if (run%has_modal_damping) then
               call multiply(run%mode_damping, v + run%damping_acceleration_factor*a, damped)
               call solve_factorised(run%bare_mass, damped)
            else
               damped = run%mass_damping*(v + run%damping_acceleration_factor*a)
            end if
            inertial = a + damped
            elastic = y + stepper%stiffness_damping*v + run%stiffness_acceleration_factor*a
         end associate
         associate (beam => size(run%place_weights%stiffness, 1))
            moment = matmul(elastic(:beam), run%place_weights%stiffness) + matmul(inertial(:beam), &
               run%place_weights%mass)
         end associate
         if (allocated(run%place_weights%contact)) moment = moment + matmul(state%force, run%place_weights%contact)
         do g = 1, run%loads%count
            moment = moment + value_at(run%loads%course(g), state%load_tau)*run%place_weights%load(g, :)
         end do
      end associate
   end function moments_now

end module newmark_samples
