!> The beam and the stop through time, the paper's way: Newmark steps, halved at an event until the condition of
!> the stop is met.
!>
!> Every state stands at a dyadic fraction of the step; after an event the steps grow again as fast as
!> this grid allows, so that the samples are met exactly. A step is taken back by not changing to the state that it
!> led to.
module newmark_motion
   use beam_model, only: beam_model_t
   use failures, only: fail, failure_t, status_bad_input, status_run_failed
   use kinds, only: i8, lambda1_power4, wp
   use newmark_recorder, only: ledger_t, record_sample, record_shapes
   use newmark_stability, only: critical_step, highest_frequency, is_unconditionally_stable
   use newmark_stepper, only: beam_dissipation, copy_state, deepest_level, finish_step, make_factors, make_newmark_stepper, &
                              make_start_state, momentum_at_stop, newmark_state_t, newmark_stepper_t, predict_step, &
                              restart_acceleration, strain_energy
   use response_records, only: count_samples, open_records
   use response_types, only: append_event, event_capture, event_contact, event_impact, event_release, event_separation, &
                             event_t, response_t
   use scene_types, only: impulse_nodal, law_three_element, output_settings_t, response_settings_t, stop_settings_t
   use stop_models, only: branch_dissipation, contact_force_coefficients, make_three_element, nodal_energy_change, &
                          nodal_impulse, rebound_energy_change, rebound_impulse, stop_energy, three_element_t, unload_surface
   implicit none (type, external)
   private
   public :: newmark_response

   !> Away from the stop.
   integer, parameter :: phase_free = 1
   !> Model A: the stop point is held on the stop.
   integer, parameter :: phase_held = 2
   !> Model B: the stop yields under the beam.
   integer, parameter :: phase_contact = 3

   !> The undivided step in units of the shortest.
   integer(i8), parameter :: whole = 2_i8**deepest_level
   !> No step was taken back that ends ahead of the present state.
   integer(i8), parameter :: nowhere = -1_i8

   !> Where a state stands, and what has gathered until then.
   type :: progress_t
      !> Samples passed, whole steps since the last one, and the part of the present one in shortest steps
      integer :: sample = 0
      integer :: part = 0
      integer(i8) :: offset = 0_i8
      !> The next shape to keep
      integer :: next_shape = 1
      type(ledger_t) :: ledger
   end type progress_t

   !> One run under way.
   type :: run_t
      type(newmark_stepper_t) :: stepper
      type(stop_settings_t) :: settings
      type(three_element_t) :: stop
      !> Steps between two samples, and the distance of the samples
      integer :: parts = 1
      real(wp) :: sample_step = 0.0_wp
      !> |eta_c| within which an approach is a contact; f below which, at a sign change, the beam leaves
      real(wp) :: contact_tolerance = 0.0_wp
      real(wp) :: release_force = 0.0_wp
      !> A flight that begins with a rebound and never rises above this is captured
      real(wp) :: hop_height = 0.0_wp
      integer :: event_limit = 0
      !> hbar/L
      real(wp) :: height_ratio = 0.0_wp
      logical :: keeps_ledger = .false.
      logical :: keeps_shapes = .false.
      !> The present state and, in the other place, the one a step leads to or came from
      type(newmark_state_t) :: states(2)
      integer :: now = 1
      type(progress_t) :: progress
      integer :: phase = phase_free
      !> End of the last step taken back, as an offset, as long as it is ahead
      integer(i8) :: refused_end = nowhere
      !> The flight: does it end in capture if it stays low, how high did it rise, may it touch the stop? After leaving with a
      !> rest of force the beam first sinks a little: that is no impact.
      logical :: judged = .false.
      real(wp) :: peak = 0.0_wp
      logical :: armed = .true.
      !> Where the flight began
      type(newmark_state_t) :: flight_state
      type(progress_t) :: flight_progress
      !> Model B: gap at which contact began; the surface is taken to be there
      real(wp) :: contact_gap = 0.0_wp
   end type run_t

contains

   !> The motion from rest in the static shape, eta_c = 1, until the end of the run.
   pure subroutine newmark_response(model, zeta, stop_settings, response_settings, output_settings, height_ratio, response, error)
      !> The assembled beam
      type(beam_model_t), intent(in) :: model
      !> zeta = gamma omega1 / 2
      real(wp), intent(in) :: zeta
      !> The stop
      type(stop_settings_t), intent(in) :: stop_settings
      !> Duration, steps, tolerances
      type(response_settings_t), intent(in) :: response_settings
      !> What to keep
      type(output_settings_t), intent(in) :: output_settings
      !> hbar/L
      real(wp), intent(in) :: height_ratio
      !> Events and histories
      type(response_t), intent(out) :: response
      !> Set when the step is too long for the scheme, or an event cannot be located
      type(failure_t), allocatable, intent(out) :: error

      type(run_t) :: run
      integer :: samples

      call make_run(model, zeta, stop_settings, response_settings, height_ratio, run, error)
      if (allocated(error)) return
      samples = count_samples(response_settings%duration, response_settings%step)
      call open_records(model%mesh%elements, output_settings, samples, response_settings%step, response)
      run%keeps_ledger = allocated(response%energy)
      run%keeps_shapes = allocated(response%shape_tau)
      call strain_energy(run%stepper, run%states(1), response%initial_energy)
      if (run%keeps_shapes) &
         call record_shapes(run%stepper%order, run%states(1), run%states(1), 0.0_wp, 0.0_wp, stop_settings%preload, &
                            run%progress%next_shape, response)
      call keep_sample(run, response)

      do while (run%progress%sample < samples)
         call advance(run, response, error)
         if (allocated(error)) return
         if (run%progress%part == 0 .and. run%progress%offset == 0_i8) call keep_sample(run, response)
      end do
      response%ends_in_contact = run%phase /= phase_free
      response%factorisations = run%stepper%factorisations
   end subroutine newmark_response

   !> Check the step, make the stepper, the stop and the start.
   pure subroutine make_run(model, zeta, stop_settings, response_settings, height_ratio, run, error)
      !> The assembled beam
      type(beam_model_t), intent(in) :: model
      !> zeta
      real(wp), intent(in) :: zeta
      !> The stop
      type(stop_settings_t), intent(in) :: stop_settings
      !> Duration, steps, tolerances
      type(response_settings_t), intent(in) :: response_settings
      !> hbar/L
      real(wp), intent(in) :: height_ratio
      !> The run at its start
      type(run_t), intent(out) :: run
      !> Set when the step is too long for the scheme
      type(failure_t), allocatable, intent(out) :: error

      run%settings = stop_settings
      run%sample_step = response_settings%step
      run%contact_tolerance = response_settings%contact_tolerance
      run%release_force = response_settings%release_tolerance/height_ratio
      run%hop_height = max(response_settings%hop_tolerance, response_settings%contact_tolerance)
      run%event_limit = response_settings%event_limit
      run%height_ratio = height_ratio
      if (stop_settings%law == law_three_element) then
         run%stop = make_three_element(stop_settings%stiffness_ratio, stop_settings%branch_ratio, stop_settings%damper_ratio)
      end if
      associate (beta => response_settings%newmark_beta, gamma => response_settings%newmark_gamma)
         call divide_step(model, zeta, run%stop, response_settings, run%parts, error)
         if (allocated(error)) return
         call make_newmark_stepper(model, zeta, beta, gamma, response_settings%step/real(run%parts, wp), run%stepper, error)
         if (allocated(error)) return
      end associate
      call make_start_state(model, run%stepper, 1.0_wp + stop_settings%preload, run%states(1), error)
      if (allocated(error)) return
      run%states(2) = run%states(1)
      run%flight_state = run%states(1)
   end subroutine make_run

   !> Refuse a step that is too long for a conditionally stable scheme, or divide it if that was asked for.
   pure subroutine divide_step(model, zeta, stop, settings, parts, error)
      !> The assembled beam
      type(beam_model_t), intent(in) :: model
      !> zeta
      real(wp), intent(in) :: zeta
      !> Model B; its springs make the beam stiffer
      type(three_element_t), intent(in) :: stop
      !> Step and scheme
      type(response_settings_t), intent(in) :: settings
      !> Number of steps between two samples
      integer, intent(out) :: parts
      !> Set when the step is too long
      type(failure_t), allocatable, intent(out) :: error

      ! stay a little below the limit, where errors neither grow nor fade
      real(wp), parameter :: margin = 1.0e-3_wp
      real(wp) :: frequency, limit, spring
      character(24) :: step_text, limit_text, gamma_text

      parts = 1
      if (settings%newmark_gamma < 0.5_wp) then
         write (gamma_text, '(f24.4)') settings%newmark_gamma
         call fail(error, status_bad_input, 'newmark_gamma must be at least 1/2: with '//trim(adjustl(gamma_text))// &
                   ' every step would feed energy into the motion')
         return
      end if
      if (is_unconditionally_stable(settings%newmark_beta, settings%newmark_gamma)) return
      spring = stop%stiffness + stop%branch_stiffness
      call highest_frequency(model%stiffness, model%mass, model%stop_dof, spring*lambda1_power4, frequency, error)
      if (allocated(error)) return
      frequency = frequency/sqrt(lambda1_power4)
      ! the stop does not share the damping of the beam: without it the limit is on the safe side
      limit = critical_step(settings%newmark_beta, settings%newmark_gamma, merge(zeta, 0.0_wp, spring <= 0.0_wp), frequency)
      if (settings%step <= limit) return
      if (settings%substep .and. settings%step/limit < 1.0e6_wp) then
         parts = ceiling(settings%step*(1.0_wp + margin)/limit)
         return
      end if
      write (step_text, '(es12.4)') settings%step
      write (limit_text, '(es12.4)') limit
      call fail(error, status_bad_input, 'the step '//trim(adjustl(step_text))//' is too long for this Newmark scheme: '// &
                'on this mesh it is stable up to d tau = '//trim(adjustl(limit_text))// &
                '; shorten step, allow substep = .true., or take newmark_beta = 0.25')
   end subroutine divide_step

   !> Instant of a state.
   pure function instant(run, progress) result(tau)
      !> The run
      type(run_t), intent(in) :: run
      !> Where the state stands
      type(progress_t), intent(in) :: progress
      real(wp) :: tau

      tau = (real(progress%sample, wp) + (real(progress%part, wp) + scale(real(progress%offset, wp), -deepest_level)) &
             /real(run%parts, wp))*run%sample_step
   end function instant

   !> Distance of the stop point from the surface.
   pure function gap(run, state) result(distance)
      !> The run
      type(run_t), intent(in) :: run
      !> The state
      type(newmark_state_t), intent(in) :: state
      real(wp) :: distance

      distance = state%displacement(run%stepper%stop_dof) - run%settings%preload + state%indentation
   end function gap

   !> Rate of this distance while the beam is free.
   pure function gap_rate(run, state) result(rate)
      !> The run
      type(run_t), intent(in) :: run
      !> The state
      type(newmark_state_t), intent(in) :: state
      real(wp) :: rate

      rate = state%velocity(run%stepper%stop_dof)
      if (state%indentation > 0.0_wp) rate = rate - run%stop%surface_rate*state%indentation
   end function gap_rate

   !> One accepted step and the event it may end with; or the event that no step leads past.
   pure subroutine advance(run, response, error)
      !> The run
      type(run_t), intent(inout) :: run
      !> Events and counters
      type(response_t), intent(inout) :: response
      !> Set when an event cannot be located
      type(failure_t), allocatable, intent(out) :: error

      integer :: level
      integer(i8) :: span
      logical :: closing

      level = 0
      if (run%progress%offset > 0_i8) level = deepest_level - trailz(run%progress%offset)
      do
         if (.not. run%stepper%factors(level)%made) then
            call make_factors(run%stepper, level, run%stop, error)
            if (allocated(error)) return
         end if
         span = shiftr(whole, level)
         call try_step(run, level)
         response%evaluations = response%evaluations + 1_i8
         if (is_acceptable(run, level)) exit
         response%rejected = response%rejected + 1_i8
         run%refused_end = run%progress%offset + span
         if (level == deepest_level) then
            call give_way(run, response, error)
            return
         end if
         level = level + 1
      end do

      run%now = 3 - run%now
      run%progress%offset = run%progress%offset + span
      closing = run%progress%offset < run%refused_end
      if (.not. closing) run%refused_end = nowhere
      if (run%progress%offset == whole) then
         run%progress%offset = 0_i8
         run%progress%part = run%progress%part + 1
         if (run%progress%part == run%parts) then
            run%progress%part = 0
            run%progress%sample = run%progress%sample + 1
         end if
      end if
      if (run%keeps_ledger) call account_step(run, run%stepper%factors(level)%step)
      if (run%keeps_shapes) &
         call record_shapes(run%stepper%order, run%states(3 - run%now), run%states(run%now), instant(run, run%progress), &
                            run%stepper%factors(level)%step, run%settings%preload, run%progress%next_shape, response)
      call look_for_event(run, run%stepper%factors(level)%step, closing, response, error)
   end subroutine advance

   !> Step from the present state into the other place.
   pure subroutine try_step(run, level)
      !> The run
      type(run_t), intent(inout) :: run
      !> How often the step is halved
      integer, intent(in) :: level

      real(wp) :: force, free_displacement, slope, rest

      associate (old => run%states(run%now), new => run%states(3 - run%now), factors => run%stepper%factors(level), &
                 stepper => run%stepper, c => run%stepper%stop_dof)
         call predict_step(stepper, level, old, new)
         select case (run%phase)
         case (phase_free)
            call finish_step(stepper, level, 0.0_wp, new)
            if (old%indentation > 0.0_wp) then
               new%indentation = old%indentation*factors%surface
               new%branch_force = -run%stop%stiffness*new%indentation
            else
               new%indentation = 0.0_wp
               new%branch_force = 0.0_wp
            end if
         case (phase_held)
            force = -new%acceleration(c)/factors%column_at_stop
            call finish_step(stepper, level, force, new)
            ! zero but for rounding
            new%displacement(c) = old%displacement(c)
            new%velocity(c) = 0.0_wp
            new%acceleration(c) = 0.0_wp
         case (phase_contact)
            ! P = slope u + rest at the end of the step, and u falls with P through A^-1
            associate (give => stepper%beta*factors%step**2)
               free_displacement = new%displacement(c) + give*new%acceleration(c)
               call contact_force_coefficients(run%stop, factors%decay, factors%gain, old%indentation, old%branch_force, &
                                               slope, rest)
               force = (slope*(run%settings%preload + run%contact_gap - free_displacement) + rest) &
                       /(1.0_wp + slope*give*factors%column_at_stop)
            end associate
            call finish_step(stepper, level, force, new)
            new%indentation = run%settings%preload + run%contact_gap - new%displacement(c)
            new%branch_force = force - run%stop%stiffness*new%indentation
         end select
      end associate
   end subroutine try_step

   !> Does the step in the other place stand? Written so that a NaN does not.
   pure function is_acceptable(run, level) result(stands)
      !> The run
      type(run_t), intent(in) :: run
      !> How often the step was halved
      integer, intent(in) :: level
      logical :: stands

      associate (new => run%states(3 - run%now))
         if (run%phase == phase_free) then
            stands = gap(run, new) >= -run%contact_tolerance
            ! at the last level rounding may be all that is missing
            if (.not. stands .and. level == deepest_level) stands = gap(run, new) >= -2.0_wp*run%contact_tolerance
         else
            stands = new%force > 0.0_wp
         end if
      end associate
   end function is_acceptable

   !> Even the shortest step crosses the condition: the event is here.
   pure subroutine give_way(run, response, error)
      !> The run
      type(run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response
      !> Set when the beam is free: the tolerance is then below what arithmetic can resolve
      type(failure_t), allocatable, intent(out) :: error

      character(24) :: tau_text

      run%refused_end = nowhere
      select case (run%phase)
      case (phase_free)
         write (tau_text, '(f24.9)') instant(run, run%progress)
         call fail(error, status_run_failed, 'the contact near tau = '//trim(adjustl(tau_text))// &
                   ' cannot be located: even the step halved to its limit goes through the stop; '// &
                   'contact_tolerance is too small, or the motion is not finite')
      case (phase_held)
         call release(run, response, error)
      case (phase_contact)
         call separate(run, response, error)
      end select
   end subroutine give_way

   !> What the step just accepted cost.
   pure subroutine account_step(run, step)
      !> The run
      type(run_t), intent(inout) :: run
      !> Length of the step
      real(wp), intent(in) :: step

      real(wp) :: dissipated

      associate (old => run%states(3 - run%now), new => run%states(run%now), ledger => run%progress%ledger)
         call beam_dissipation(run%stepper, step, old, new, dissipated)
         ledger%dissipated_beam = ledger%dissipated_beam + dissipated
         if (run%phase == phase_contact) then
            ledger%dissipated_stop = ledger%dissipated_stop &
                                     + branch_dissipation(run%stop, step, new%indentation - old%indentation, &
                                                          old%branch_force, new%branch_force)
         else if (old%indentation > 0.0_wp) then
            ledger%dissipated_stop = ledger%dissipated_stop + stop_energy(run%stop, old%indentation, old%branch_force) &
                                     - stop_energy(run%stop, new%indentation, new%branch_force)
         end if
      end associate
   end subroutine account_step

   !> The rules of contact and release at the end of an accepted step.
   pure subroutine look_for_event(run, step, closing, response, error)
      !> The run
      type(run_t), intent(inout) :: run
      !> Length of the step
      real(wp), intent(in) :: step
      !> A longer step was taken back: the event lies ahead
      logical, intent(in) :: closing
      !> Events
      type(response_t), intent(inout) :: response
      !> Set when there are too many
      type(failure_t), allocatable, intent(out) :: error

      real(wp) :: distance, rate

      associate (old => run%states(3 - run%now), new => run%states(run%now))
         if (run%phase == phase_free) then
            distance = gap(run, new)
            rate = gap_rate(run, new)
            if (run%judged) then
               run%peak = max(run%peak, distance, greatest_within(gap(run, old), gap_rate(run, old), distance, rate, step))
               if (run%peak > run%hop_height) run%judged = .false.
            end if
            if (distance >= run%contact_tolerance) then
               run%armed = .true.
            else if (rate < 0.0_wp .and. (run%armed .or. closing)) then
               if (run%settings%law == law_three_element) then
                  call begin_contact(run, response, error)
               else
                  call strike(run, response, error)
               end if
            else if (rate > 0.0_wp) then
               run%armed = .true.
            end if
         else if (closing .and. new%force < run%release_force .and. new%force < old%force) then
            ! a force that still rises is the beginning of a contact, not its end
            if (run%phase == phase_held) then
               call release(run, response, error)
            else
               call separate(run, response, error)
            end if
         end if
      end associate
   end subroutine look_for_event

   !> Greatest value of the cubic through both ends if it turns within the step, else the greater end.
   elemental function greatest_within(value_0, rate_0, value_1, rate_1, step) result(greatest)
      !> Value and rate at the beginning
      real(wp), intent(in) :: value_0
      real(wp), intent(in) :: rate_0
      !> Value and rate at the end
      real(wp), intent(in) :: value_1
      real(wp), intent(in) :: rate_1
      !> Length of the step
      real(wp), intent(in) :: step
      real(wp) :: greatest

      real(wp) :: a1, a2, a3, root, s

      greatest = max(value_0, value_1)
      if (.not. (rate_0 > 0.0_wp .and. rate_1 < 0.0_wp)) return
      a1 = step*rate_0
      a2 = 3.0_wp*(value_1 - value_0) - step*(2.0_wp*rate_0 + rate_1)
      a3 = step*(rate_0 + rate_1) - 2.0_wp*(value_1 - value_0)
      ! the zero of a1 + 2 a2 s + 3 a3 s^2 in the step, without cancellation
      root = sqrt(max(0.0_wp, a2**2 - 3.0_wp*a3*a1))
      if (a2 <= 0.0_wp) then
         s = a1/(root - a2)
      else
         s = (a2 + root)/(-3.0_wp*a3)
      end if
      greatest = max(greatest, value_0 + s*(a1 + s*(a2 + s*a3)))
   end function greatest_within

   !> Model A: the free stop point has come to the stop. A flight that stayed low ends where it began, in capture.
   pure subroutine strike(run, response, error)
      !> The run
      type(run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response
      !> Set when there are too many
      type(failure_t), allocatable, intent(out) :: error

      if (run%judged) then
         call copy_state(run%flight_state, run%states(run%now))
         run%progress = run%flight_progress
         run%refused_end = nowhere
         call capture(run, response, error)
      else
         call rebound(run, response, error)
      end if
   end subroutine strike

   !> Model A: reverse the velocity by the restitution and begin a flight.
   pure subroutine rebound(run, response, error)
      !> The run
      type(run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response
      !> Set when there are too many
      type(failure_t), allocatable, intent(out) :: error

      type(event_t) :: event
      real(wp) :: momentum

      associate (state => run%states(run%now), c => run%stepper%stop_dof, eps => run%settings%restitution)
         event = event_here(run, event_impact)
         event%velocity_after = -eps*event%velocity_before
         if (run%settings%impulse == impulse_nodal) then
            call momentum_at_stop(run%stepper, state, momentum)
            event%impulse = nodal_impulse(event%velocity_before, eps, run%stepper%mass_diagonal)
            event%energy_change = nodal_energy_change(event%velocity_before, eps, momentum, run%stepper%mass_diagonal)
         else
            call push(run, event, eps)
         end if
         state%velocity(c) = event%velocity_after
         call keep_event(run, event, response, error)
         if (allocated(error)) return
         if (state%velocity(c) > 0.0_wp) then
            call restart_acceleration(run%stepper, state, .false.)
            run%judged = .true.
            run%armed = .true.
            run%peak = gap(run, state)
            call copy_state(state, run%flight_state)
            run%flight_progress = run%progress
         else
            call capture(run, response, error)
         end if
      end associate
   end subroutine rebound

   !> Model A: bring the stop point to rest and hold it, unless the stop would have to pull.
   pure subroutine capture(run, response, error)
      !> The run
      type(run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response
      !> Set when there are too many
      type(failure_t), allocatable, intent(out) :: error

      type(event_t) :: event

      run%judged = .false.
      associate (state => run%states(run%now), c => run%stepper%stop_dof)
         event = event_here(run, event_capture)
         call push(run, event, 0.0_wp)
         event%velocity_after = 0.0_wp
         state%velocity(c) = 0.0_wp
         call restart_acceleration(run%stepper, state, .true.)
         if (state%force > 0.0_wp) then
            run%phase = phase_held
            call keep_event(run, event, response, error)
         else
            ! with no impulse given (eps = 0) there was no capture to speak of
            if (abs(event%velocity_before) > 0.0_wp) call keep_event(run, event, response, error)
            if (allocated(error)) return
            run%phase = phase_free
            run%armed = .false.
            call restart_acceleration(run%stepper, state, .false.)
            if (abs(event%velocity_before) > 0.0_wp) call keep_event(run, event_here(run, event_release), response, error)
         end if
      end associate
   end subroutine capture

   !> Give the beam the impulse that turns v_c into -eps v_c.
   pure subroutine push(run, event, restitution)
      !> The run; the velocities change
      type(run_t), intent(inout) :: run
      !> Its impulse and energy change are set
      type(event_t), intent(inout) :: event
      !> eps
      real(wp), intent(in) :: restitution

      associate (stepper => run%stepper)
         event%impulse = rebound_impulse(event%velocity_before, restitution, stepper%mobility)
         event%energy_change = rebound_energy_change(event%velocity_before, restitution, stepper%mobility)
         associate (velocity => run%states(run%now)%velocity)
            velocity(1:stepper%order) = velocity(1:stepper%order) + event%impulse*stepper%mass_column
         end associate
      end associate
   end subroutine push

   !> Model A: the held stop point leaves.
   pure subroutine release(run, response, error)
      !> The run
      type(run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response
      !> Set when there are too many
      type(failure_t), allocatable, intent(out) :: error

      call restart_acceleration(run%stepper, run%states(run%now), .false.)
      run%phase = phase_free
      run%judged = .false.
      run%armed = .false.
      run%refused_end = nowhere
      call keep_event(run, event_here(run, event_release), response, error)
   end subroutine release

   !> Model B: contact begins, with P = 0.
   pure subroutine begin_contact(run, response, error)
      !> The run
      type(run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response
      !> Set when there are too many
      type(failure_t), allocatable, intent(out) :: error

      run%contact_gap = gap(run, run%states(run%now))
      run%phase = phase_contact
      run%refused_end = nowhere
      call keep_event(run, event_here(run, event_contact), response, error)
   end subroutine begin_contact

   !> Model B: contact ends. The surface springs back from the rest of the force and is then free.
   pure subroutine separate(run, response, error)
      !> The run
      type(run_t), intent(inout) :: run
      !> Events
      type(response_t), intent(inout) :: response
      !> Set when there are too many
      type(failure_t), allocatable, intent(out) :: error

      real(wp) :: before

      associate (state => run%states(run%now), ledger => run%progress%ledger)
         before = stop_energy(run%stop, state%indentation, state%branch_force)
         call unload_surface(run%stop, state%indentation, state%branch_force)
         ledger%dissipated_stop = ledger%dissipated_stop &
                                  + before - stop_energy(run%stop, state%indentation, state%branch_force)
         call restart_acceleration(run%stepper, state, .false.)
         run%phase = phase_free
         run%armed = gap_rate(run, state) > 0.0_wp
         run%refused_end = nowhere
         call keep_event(run, event_here(run, event_separation), response, error)
      end associate
   end subroutine separate

   !> An event at the present state; velocity before and after as it is now.
   pure function event_here(run, kind) result(event)
      !> The run
      type(run_t), intent(in) :: run
      !> One of the `event_` constants
      integer, intent(in) :: kind
      type(event_t) :: event

      associate (state => run%states(run%now), c => run%stepper%stop_dof)
         event%tau = instant(run, run%progress)
         event%kind = kind
         event%eta = state%displacement(c) - run%settings%preload
         event%velocity_before = state%velocity(c)
         event%velocity_after = state%velocity(c)
      end associate
   end function event_here

   !> Keep an event and what it did to the energy.
   pure subroutine keep_event(run, event, response, error)
      !> The run
      type(run_t), intent(inout) :: run
      !> The event
      type(event_t), intent(in) :: event
      !> Events
      type(response_t), intent(inout) :: response
      !> Set when there are too many
      type(failure_t), allocatable, intent(out) :: error

      character(24) :: limit_text, tau_text

      if (response%event_count >= run%event_limit) then
         write (limit_text, '(i0)') run%event_limit
         write (tau_text, '(f24.9)') event%tau
         call fail(error, status_run_failed, 'more than event_limit = '//trim(limit_text)//' events by tau = '// &
                      trim(adjustl(tau_text)))
         return
      end if
      call append_event(response, event)
      associate (ledger => run%progress%ledger)
         ledger%dissipated_impact = ledger%dissipated_impact + max(0.0_wp, -event%energy_change)
         ledger%created = ledger%created + max(0.0_wp, event%energy_change)
      end associate
   end subroutine keep_event

   !> Keep the present state as a sample.
   pure subroutine keep_sample(run, response)
      !> The run
      type(run_t), intent(inout) :: run
      !> Histories
      type(response_t), intent(inout) :: response

      call record_sample(run%stepper, run%stop, run%states(run%now), run%progress%ledger, run%progress%sample, &
                         run%settings%preload, run%height_ratio, response)
   end subroutine keep_sample

end module newmark_motion
