!> Model B in closed form: free flights over a surface that relaxes, and contacts with the three-element
!> stop. No step in time: every phase ends at an event that `certified_search` finds
!> (docs/theory.md, section 8).
module exact_three_element
   use certified_search, only: found_never_left, found_none, found_zero, first_zero, search_t
   use contact_losses, only: contact_losses_t, losses_of_step, losses_until, make_contact_losses
   use contact_modes, only: contact_amplitudes, contact_modes_t, contact_state, make_contact_modes
   use damped_oscillators, only: propagate
   use exponential_signal, only: exponential_signal_t, fastest_last
   use event_watch, only: event_watch_t, watch_events
   use failures, only: failure_t
   use flight_measures, only: measure_flight, measure_spring_contact
   use history_list, only: eta_stop, eta_tip, force_stop, velocity_stop
   use kinds, only: wp
   use modal_beam, only: modal_beam_t
   use modal_recorder, only: charge_event, keep_energy, keep_shape, modal_energy, next_sample_time, record_free_motion, &
                             record_sample, recorder_t, samples_before, shape_due, steps_t
   use modal_signal, only: make_modal_signal, modal_signal_t
   use response_types, only: append_event, event_contact, event_separation, event_t, response_t
   use stop_models, only: stop_energy, three_element_t
   implicit none (type, external)
   private
   public :: run_exact_three_element, three_element_run_t

   !> What the run needs besides the beam.
   type :: three_element_run_t
      type(three_element_t) :: spring
      !> Surface of the stop at rest, delta
      real(wp) :: surface = 0.0_wp
      !> zeta
      real(wp) :: zeta = 0.0_wp
      !> Length of the run, tau
      real(wp) :: duration = 0.0_wp
      !> Events after which the run fails
      integer :: event_limit = 0
      !> Pbar per unit of force
      real(wp) :: force_scale = 0.0_wp
   end type three_element_run_t

contains

   !> From rest at the given modal coordinates to the end of the run.
   subroutine run_exact_three_element(beam, run, start, recorder, response, error)
      !> The beam in its free modes
      type(modal_beam_t), target, intent(in) :: beam
      !> Stop and run
      type(three_element_run_t), intent(in) :: run
      !> Modal coordinates at tau = 0, at rest, [modes]
      real(wp), intent(in) :: start(:)
      !> Samples
      type(recorder_t), intent(inout) :: recorder
      !> Gets events and histories
      type(response_t), intent(inout) :: response
      !> Set when the run fails
      type(failure_t), allocatable, intent(inout) :: error

      type(contact_modes_t) :: modes
      type(contact_losses_t) :: losses
      type(steps_t) :: steps
      type(modal_signal_t) :: gap
      type(search_t) :: search
      type(event_watch_t) :: watch
      type(event_t) :: event
      real(wp), dimension(beam%count) :: q, v
      real(wp) :: t, before, branch_force
      integer :: force_order
      logical :: touching

      t = 0.0_wp
      q = start
      v = 0.0_wp
      branch_force = 0.0_wp
      call make_modal_signal(beam%oscillators, -run%surface, beam%stop_value, gap)
      if (run%spring%branch_stiffness > 0.0_wp) gap%rate = run%spring%surface_rate
      touching = .false.
      force_order = 1
      if (sum(gap%weight*q) + gap%offset <= 4.0_wp*epsilon(1.0_wp)*(sum(abs(gap%weight*q)) + abs(gap%offset))) then
         ! the run starts at rest on the surface: it leaves, or the force grows from zero like the indentation
         touching = sum(beam%stop_value*beam%oscillators%square*q) > 0.0_wp
         gap%start_order = 2
         if (touching) force_order = 2
      end if
      do
         before = t
         if (touching) then
            event = event_t(tau=t, kind=event_contact, eta=sum(beam%stop_value*q) - run%surface, &
                            velocity_before=sum(beam%stop_value*v), velocity_after=sum(beam%stop_value*v))
            call append_event(response, event)
            if (.not. modes%made) then
               call make_contact_modes(beam, run%zeta, run%spring, modes, error)
               if (allocated(error)) return
               response%factorisations = response%factorisations + 1
            end if
            call contact(beam, run, modes, losses, force_order, t, q, v, branch_force, recorder, response)
            force_order = 1
            if (response%ends_in_contact) return
            gap%start_order = 1
         end if
         gap%z = q
         gap%v = v
         gap%surface = -branch_force/run%spring%stiffness
         call first_zero(gap, run%duration - t, search)
         response%evaluations = response%evaluations + search%evaluations
         if (search%outcome == found_none) search%time = run%duration - t
         call record_free_motion(beam, run%surface, stop_energy(run%spring, gap%surface, branch_force), &
                                 2.0_wp*gap%rate, t, search%time, search%outcome == found_none, q, v, steps, &
                                 recorder, response)
         if (search%outcome /= found_none) call propagate(beam%oscillators, search%time, gap%z, gap%v, q, v)
         call measure_flight(recorder%measurer, beam, t, search%time, search%outcome == found_none, &
                             search%greatest - gap%surface, gap%z, gap%v, q, v, &
                             stop_energy(run%spring, gap%surface, branch_force), 2.0_wp*gap%rate)
         if (search%outcome == found_none) return
         t = t + search%time
         ! the surface pushes back nothing: P = k u + P2 = 0
         branch_force = branch_force*exp(-gap%rate*search%time)
         touching = .true.
         if (search%outcome == found_never_left) then
            call settle(beam, run%zeta, gap%rate, -branch_force/run%spring%stiffness, q, v, recorder, touching, &
                        force_order)
            gap%start_order = 2
         end if
         call watch_events(watch, response%event_count, run%event_limit, before, t, error)
         if (allocated(error)) return
      end do
   end subroutine run_exact_three_element

   !> A flight too low to be told from none: let the stop point go with the surface, which relaxes, and see whether
   !> it is pressed on it.
   pure subroutine settle(beam, zeta, rate, indentation, q, v, recorder, pressed, order)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> zeta
      real(wp), intent(in) :: zeta
      !> Rate at which the surface relaxes, and how far it still has to
      real(wp), intent(in) :: rate
      real(wp), intent(in) :: indentation
      !> Modal state
      real(wp), intent(in) :: q(:)
      real(wp), intent(inout) :: v(:)
      !> Its ledger is charged
      type(recorder_t), intent(inout) :: recorder
      !> It is, so contact goes on
      logical, intent(out) :: pressed
      !> First derivative of the force that does not vanish then
      integer, intent(out) :: order

      real(wp) :: speed, surface_speed

      speed = sum(beam%stop_value*v)
      surface_speed = rate*indentation
      ! a surface that comes up to a slower point meets it
      pressed = abs(speed) < surface_speed
      order = 1
      if (pressed) return
      order = 2
      v = v - beam%stop_value*(speed - surface_speed)/beam%mobility
      call charge_event(recorder%ledger, -0.5_wp*(speed - surface_speed)*(speed + surface_speed)/beam%mobility)
      pressed = sum(beam%stop_value*beam%oscillators%square*(q + 2.0_wp*zeta*v)) > rate*surface_speed
   end subroutine settle

   !> One contact, from P = 0 to P = 0.
   subroutine contact(beam, run, modes, losses, start_order, t, q, v, branch_force, recorder, response)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> Stop and run
      type(three_element_run_t), intent(in) :: run
      !> Exponents of the contact
      type(contact_modes_t), intent(in) :: modes
      !> What they dissipate; made at its first use
      type(contact_losses_t), intent(inout) :: losses
      !> First derivative of P that does not vanish at the start: 1 on arrival, 2 from rest
      integer, intent(in) :: start_order
      !> Instant; the separation on return
      real(wp), intent(inout) :: t
      !> Modal state
      real(wp), intent(inout) :: q(:)
      real(wp), intent(inout) :: v(:)
      !> P2, the force in the branch
      real(wp), intent(inout) :: branch_force
      !> Samples
      type(recorder_t), intent(inout) :: recorder
      !> Gets event and histories
      type(response_t), intent(inout) :: response

      type(exponential_signal_t) :: force
      type(search_t) :: search
      complex(wp) :: amplitude(modes%count)
      real(wp), dimension(beam%count) :: q_end, v_end
      real(wp) :: static_force, indentation

      call contact_amplitudes(beam, run%zeta, run%spring, modes, run%surface, q, v, branch_force, static_force, amplitude)
      force%offset = static_force
      allocate (force%exponent, source=modes%exponent)
      allocate (force%amplitude, source=modes%weight*amplitude)
      allocate (force%place, source=fastest_last(modes%exponent))
      force%start_order = start_order
      call first_zero(force, run%duration - t, search)
      response%evaluations = response%evaluations + search%evaluations
      if (search%outcome == found_none) search%time = run%duration - t
      call record_contact(beam, run, modes, losses, static_force, force%amplitude, q, v, t, search%time, &
                          search%outcome == found_none, recorder, response)
      call measure_spring_contact(recorder%measurer, beam, run%zeta, run%spring, modes, force, t, search%time, &
                                  search%outcome == found_none, search%greatest, q, v)
      if (search%outcome == found_none) then
         response%ends_in_contact = .true.
         return
      end if
      call contact_state(beam, modes, static_force, amplitude, q, v, search%time, q_end, v_end)
      q = q_end
      v = v_end
      t = t + search%time
      ! P = k u + P2 = 0; the indentation from the exponentials, as from the displacements it would be a rounding error
      ! where the stop is hard, and the displacements follow it
      indentation = static_force/run%spring%stiffness &
                    - sum(real(modes%weight*amplitude*modes%stop_value*exp(modes%exponent*search%time), wp))
      branch_force = 0.0_wp
      if (run%spring%branch_stiffness > 0.0_wp) branch_force = -run%spring%stiffness*max(indentation, 0.0_wp)
      q = q + beam%stop_value/beam%oscillators%square*(((run%surface + branch_force/run%spring%stiffness) &
              - sum(beam%stop_value*q))/beam%flexibility)
      call append_event(response, event_t(tau=t, kind=event_separation, eta=sum(beam%stop_value*q) - run%surface, &
                                          velocity_before=sum(beam%stop_value*v), velocity_after=sum(beam%stop_value*v)))
   end subroutine contact

   !> Samples of a contact.
   subroutine record_contact(beam, run, modes, losses, static_force, amplitude, q, v, from, length, to_the_end, recorder, &
                             response)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> Stop and run
      type(three_element_run_t), intent(in) :: run
      !> Exponents of the contact
      type(contact_modes_t), intent(in) :: modes
      !> What they dissipate; made at its first use
      type(contact_losses_t), intent(inout) :: losses
      !> The force that remains
      real(wp), intent(in) :: static_force
      !> weight times c at its start
      complex(wp), intent(in) :: amplitude(:)
      !> Modal state there
      real(wp), intent(in) :: q(:)
      real(wp), intent(in) :: v(:)
      !> Start and length of the contact
      real(wp), intent(in) :: from
      real(wp), intent(in) :: length
      !> The run ends with this contact
      logical, intent(in) :: to_the_end
      !> Samples
      type(recorder_t), intent(inout) :: recorder
      !> Gets the histories
      type(response_t), intent(inout) :: response

      integer, parameter :: renewal = 64
      complex(wp), dimension(modes%count) :: term, factor, velocity_value
      real(wp), dimension(size(q)) :: q_then, v_then
      real(wp) :: lost(2), loss(2), step_loss(2), indentation, time, to
      integer :: place, since

      to = from + length
      do while (shape_due(recorder, to, to_the_end))
         call contact_state(beam, modes, static_force, amplitude/modes%weight, q, v, &
                            recorder%shape_tau(recorder%next_shape) - from, q_then, v_then)
         call keep_shape(recorder, q_then, v_then)
      end do
      if (allocated(response%energy)) then
         if (.not. losses%made) call make_contact_losses(beam, run%zeta, run%spring, modes, losses)
         if (.not. to_the_end) call losses_until(beam, modes, losses, amplitude, q, v, length, lost)
      end if
      factor = exp(modes%exponent*recorder%step)
      velocity_value = modes%exponent*modes%stop_value
      since = renewal
      do while (samples_before(recorder, to, to_the_end))
         time = next_sample_time(recorder)
         if (since >= renewal .or. (allocated(response%energy) .and. size(modes%inactive) > 0)) then
            term = amplitude*exp(modes%exponent*max(time - from, 0.0_wp))
            since = 0
            if (allocated(response%energy)) call losses_until(beam, modes, losses, amplitude, q, v, time - from, loss)
         else
            if (allocated(response%energy)) then
               call losses_of_step(modes, recorder%step, losses, term, step_loss)
               loss = loss + step_loss
            end if
            term = term*factor
            since = since + 1
         end if
         call record_sample(recorder, place)
         if (allocated(response%history(eta_stop)%values)) response%history(eta_stop)%values(place) = &
            static_force*beam%flexibility - run%surface + sum(real(modes%stop_value*term, wp))
         if (allocated(response%history(eta_tip)%values)) response%history(eta_tip)%values(place) = &
            static_force*modes%static_tip - run%surface + sum(real(modes%tip_value*term, wp))
         if (allocated(response%history(velocity_stop)%values)) &
            response%history(velocity_stop)%values(place) = sum(real(velocity_value*term, wp))
         if (allocated(response%history(force_stop)%values)) response%history(force_stop)%values(place) = &
            run%force_scale*(static_force + sum(real(term, wp)))
         if (.not. allocated(response%energy)) cycle
         call contact_state(beam, modes, static_force, amplitude/modes%weight, q, v, time - from, q_then, v_then)
         indentation = run%surface - sum(beam%stop_value*q_then)
         call keep_energy(response, place, recorder%ledger, modal_energy(beam%oscillators, q_then, v_then), &
                          stop_energy(run%spring, indentation, static_force + sum(real(term, wp)) &
                                      - run%spring%stiffness*indentation), loss(1), loss(2))
      end do
      if (.not. allocated(response%energy) .or. to_the_end) return
      recorder%ledger%dissipated_beam = recorder%ledger%dissipated_beam + lost(1)
      recorder%ledger%dissipated_stop = recorder%ledger%dissipated_stop + lost(2)
   end subroutine record_contact

end module exact_three_element
