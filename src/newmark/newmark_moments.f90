!> Bending moments of a Newmark run at the requested positions, from displacements y, velocities v and accelerations a
!> of the degrees of freedom (docs/theory.md, section 19). Between the ends of steps moments are interpolated linearly.
!>
!> Newmark steps satisfy M* a + C* v + K y = F with matrices M* and C* that contain terms in K (`newmark_stepper`), so
!> the moments contain these terms too.
module newmark_moments
   use applied_loads, only: applied_loads_t, gather_loads
   use beam_model, only: beam_model_t
   use kinds, only: wp
   use load_courses, only: value_at
   use moment_places, only: find_place_weights, take_modes
   use newmark_run, only: newmark_run_t
   use response_types, only: response_t
   use run_settings, only: run_settings_t
   use skyline_matrix, only: combine, factorise, multiply, solve_factorised
   implicit none (type, external)
   private
   public :: start_moments, moments_now

contains

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

end module newmark_moments
