!> Model A in closed form: free flights, impacts with a coefficient of restitution, capture, contact as a
!> pinned support, release. No step in time: every phase ends at an event that `certified_search` finds
!> (docs/theory.md, section 7).
module exact_restitution
   use certified_search, only: certified_signal_t, first_zero, found_never_left, found_none, found_zero, local_t, search_t
   use damped_oscillators, only: elastic_and_viscous, propagate
   use event_watch, only: event_watch_t, watch_events
   use failures, only: failure_t
   use flight_measures, only: measure_flight, measure_held_contact, measure_impulse
   use history_list, only: eta_stop, eta_tip, force_stop, velocity_stop
   use kinds, only: i8, wp
   use modal_beam, only: make_pinned_beam, modal_beam_t, pinned_beam_t, support_t, to_free, to_pinned
   use modal_signal, only: make_modal_signal, modal_signal_t
   use modal_recorder, only: charge_event, keep_energy, keep_shape, modal_energy, next_sample, next_sample_time, &
                             phase_sampler_t, record_free_motion, record_sample, recorder_t, samples_before, shape_due, &
                             start_sampler, steps_t
   use response_types, only: append_event, event_capture, event_impact, event_release, event_t, response_t
   use signal_peaks, only: signal_view
   implicit none (type, external)
   private
   public :: run_exact_restitution, restitution_run_t

   !> What the run needs besides the beam.
   type :: restitution_run_t
      !> Surface of the stop, delta
      real(wp) :: surface = 0.0_wp
      !> eps
      real(wp) :: restitution = 0.0_wp
      !> Nodal reading: (M phi_i)_c, [modes]; unallocated: the momentum reading
      real(wp), allocatable :: nodal_mass(:)
      !> zeta
      real(wp) :: zeta = 0.0_wp
      !> Length of the run, tau
      real(wp) :: duration = 0.0_wp
      !> Flights that stay below this are captured
      real(wp) :: hop_tolerance = 0.0_wp
      !> Events after which the run fails
      integer :: event_limit = 0
      !> Pbar per unit of force
      real(wp) :: force_scale = 0.0_wp
   end type restitution_run_t

contains

   !> From rest at the given modal coordinates to the end of the run.
   subroutine run_exact_restitution(beam, shared, run, start, recorder, response, error)
      !> The beam in its free modes
      type(modal_beam_t), target, intent(in) :: beam
      !> The beam held at the stop, if made beforehand
      type(support_t), intent(in) :: shared
      !> Stop and run
      type(restitution_run_t), intent(in) :: run
      !> Modal coordinates at tau = 0, at rest, [modes]
      real(wp), intent(in) :: start(:)
      !> Samples
      type(recorder_t), intent(inout) :: recorder
      !> Gets events and histories
      type(response_t), intent(inout) :: response
      !> Set when the run fails
      type(failure_t), allocatable, intent(inout) :: error

      type(pinned_beam_t), target :: pinned
      type(steps_t) :: free_steps, pinned_steps
      type(modal_signal_t) :: gap
      type(search_t) :: search
      type(event_watch_t) :: watch
      real(wp), dimension(beam%count) :: q, v
      real(wp) :: t, before
      logical :: after_rebound, held, touching
      integer :: order

      t = 0.0_wp
      q = start
      v = 0.0_wp
      after_rebound = .false.
      call make_modal_signal(beam%oscillators, -run%surface, beam%stop_value, gap)
      touching = .false.
      if (sum(gap%weight*q) + gap%offset <= 4.0_wp*epsilon(1.0_wp)*(sum(abs(gap%weight*q)) + abs(gap%offset))) then
         ! the run starts on the surface
         call capture(beam, run, t, q, v, gap%start_order, recorder, response)
         touching = gap%start_order == 0
      end if
      do
         before = t
         if (touching) then
            if (.not. pinned%made) then
               call make_pinned_beam(beam, run%zeta, shared, pinned)
               response%factorisations = response%factorisations + 1
            end if
            call contact(beam, run, pinned, t, q, v, pinned_steps, recorder, response)
            if (response%ends_in_contact) return
            gap%start_order = 3
         end if
         gap%z = q
         gap%v = v
         call first_zero(gap, run%duration - t, search)
         response%evaluations = response%evaluations + search%evaluations
         if (search%outcome == found_none) then
            call measure_flight(recorder%measurer, beam, t, run%duration - t, .true., search%greatest, q, v, q, v, &
                                0.0_wp, 0.0_wp)
            call record_free_motion(beam, run%surface, 0.0_wp, 0.0_wp, t, run%duration - t, .true., q, v, free_steps, &
                                    recorder, response)
            return
         end if
         held = .false.
         if (search%outcome == found_zero .and. after_rebound) then
            if (search%greatest < run%hop_tolerance) &
               call judge_hop(gap, search%time, run%hop_tolerance, held, response%evaluations)
         end if
         if (held) then
            call capture(beam, run, t, q, v, order, recorder, response)
         else
            call record_free_motion(beam, run%surface, 0.0_wp, 0.0_wp, t, search%time, .false., q, v, free_steps, &
                                    recorder, response)
            call propagate(beam%oscillators, search%time, gap%z, gap%v, q, v)
            call lift(beam, run%surface, q, recorder)
            call measure_flight(recorder%measurer, beam, t, search%time, .false., search%greatest, gap%z, gap%v, q, v, &
                                0.0_wp, 0.0_wp)
            t = t + search%time
            if (search%outcome == found_never_left) then
               ! from rest: what would lift it is lost in the rounding error of the displacement, so it is pressed
               call capture(beam, run, t, q, v, order, recorder, response, is_pressed=gap%start_order > 1)
            else
               call impact(beam, run, t, q, v, order, recorder, response)
            end if
         end if
         after_rebound = order == 1
         touching = order == 0
         gap%start_order = order
         call watch_events(watch, response%event_count, run%event_limit, before, t, error)
         if (allocated(error)) return
      end do
   end subroutine run_exact_restitution

   !> A flight that rounding let dip below the surface ends on it: a static shape brings the stop point back, as that
   !> takes the least energy, and the ledger is charged with it.
   pure subroutine lift(beam, surface, q, recorder)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> delta
      real(wp), intent(in) :: surface
      !> Modal coordinates
      real(wp), intent(inout) :: q(:)
      !> Its ledger is charged
      type(recorder_t), intent(inout) :: recorder

      real(wp), parameter :: least = 5.0e-12_wp
      real(wp) :: dip, force

      dip = surface - sum(beam%stop_value*q)
      if (dip < least) return
      force = dip/beam%flexibility
      call charge_event(recorder%ledger, force*(sum(beam%stop_value*q) + 0.5_wp*dip))
      q = q + beam%stop_value/beam%oscillators%square*force
   end subroutine lift

   !> Does a flight stay below the tolerance all the way, for certain? As far as the rounding error of the gap can tell.
   subroutine judge_hop(gap, length, tolerance, is_hop, evaluations)
      !> The gap and its state at the start of the flight
      type(modal_signal_t), intent(in) :: gap
      !> Time to the return
      real(wp), intent(in) :: length
      !> Hop tolerance, in eta
      real(wp), intent(in) :: tolerance
      !> It does
      logical, intent(out) :: is_hop
      !> Counts the sums evaluated
      integer(i8), intent(inout) :: evaluations

      class(certified_signal_t), allocatable :: room
      type(search_t) :: search
      real(wp) :: noise

      noise = 4.0_wp*epsilon(1.0_wp)*(abs(gap%offset) + sum(abs(gap%weight*gap%z)))
      call signal_view(gap, 0.0_wp, -1.0_wp, tolerance + noise, 0, room)
      call first_zero(room, length, search)
      is_hop = search%outcome == found_none
      evaluations = evaluations + search%evaluations
   end subroutine judge_hop

   !> Which way a stop point at rest on the stop goes: the order of the first derivative of the gap that is
   !> certainly positive if it leaves (2: the support would have to pull; 3: its force vanishes and falls), or
   !> 0 if it is pressed against the stop.
   pure function leaving_order(beam, zeta, q, v) result(order)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> zeta
      real(wp), intent(in) :: zeta
      !> Modal state
      real(wp), intent(in) :: q(:)
      real(wp), intent(in) :: v(:)
      integer :: order

      real(wp), dimension(beam%count) :: weight, held
      real(wp) :: force, noise

      weight = beam%stop_value*beam%oscillators%square
      force = sum(weight*(q + 2.0_wp*zeta*v))
      noise = 4.0_wp*epsilon(1.0_wp)*sum(abs(weight)*(abs(q) + 2.0_wp*zeta*abs(v)))
      order = 0
      if (force < -noise) then
         order = 2
      else if (force <= noise) then
         ! the force as it changes under the support
         held = beam%stop_value*force/beam%mobility - beam%oscillators%square*(q + 2.0_wp*zeta*v)
         if (sum(weight*(v + 2.0_wp*zeta*held)) < 0.0_wp) order = 3
      end if
   end function leaving_order

   !> Impact: the velocity of the stop point becomes -eps times what it was.
   pure subroutine impact(beam, run, t, q, v, order, recorder, response)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> Stop and run
      type(restitution_run_t), intent(in) :: run
      !> Instant
      real(wp), intent(in) :: t
      !> Modal state
      real(wp), intent(in) :: q(:)
      real(wp), intent(inout) :: v(:)
      !> Start order of the flight that follows: 1 rebound, else from `leaving_order`; 0: contact lasts
      integer, intent(out) :: order
      !> Its ledger is charged
      type(recorder_t), intent(inout) :: recorder
      !> Gets the event
      type(response_t), intent(inout) :: response

      type(event_t) :: event
      real(wp) :: kinetic

      event%tau = t
      event%kind = event_impact
      event%eta = sum(beam%stop_value*q) - run%surface
      event%velocity_before = min(sum(beam%stop_value*v), 0.0_wp)
      event%velocity_after = -run%restitution*event%velocity_before
      if (allocated(run%nodal_mass)) then
         kinetic = 0.5_wp*sum(v**2)
         v = v + run%nodal_mass*(event%velocity_after - event%velocity_before)
         event%energy_change = 0.5_wp*sum(v**2) - kinetic
         event%impulse = sum(run%nodal_mass**2)*(event%velocity_after - event%velocity_before)
      else
         event%impulse = (event%velocity_after - event%velocity_before)/beam%mobility
         v = v + beam%stop_value*event%impulse
         event%energy_change = -0.5_wp*(1.0_wp - run%restitution**2)*event%velocity_before**2/beam%mobility
      end if
      call append_event(response, event)
      call measure_impulse(recorder%measurer, t, event%impulse)
      call charge_event(recorder%ledger, event%energy_change)
      order = 1
      if (.not. event%velocity_after > 0.0_wp) call capture(beam, run, t, q, v, order, recorder, response)
   end subroutine impact

   !> Bring the stop point to rest and, if it is pressed against the stop, hold it.
   pure subroutine capture(beam, run, t, q, v, order, recorder, response, is_pressed)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> Stop and run
      type(restitution_run_t), intent(in) :: run
      !> Instant
      real(wp), intent(in) :: t
      !> Modal state
      real(wp), intent(in) :: q(:)
      real(wp), intent(inout) :: v(:)
      !> Start order of the flight that follows, 0: the stop point is held
      integer, intent(out) :: order
      !> Its ledger is charged
      type(recorder_t), intent(inout) :: recorder
      !> Gets the event
      type(response_t), intent(inout) :: response
      !> It is known to be pressed against the stop; default: find out
      logical, intent(in), optional :: is_pressed

      type(event_t) :: event

      event%tau = t
      event%eta = sum(beam%stop_value*q) - run%surface
      event%velocity_before = sum(beam%stop_value*v)
      event%impulse = -event%velocity_before/beam%mobility
      event%energy_change = -0.5_wp*event%velocity_before**2/beam%mobility
      call charge_event(recorder%ledger, event%energy_change)
      v = v + beam%stop_value*event%impulse
      order = leaving_order(beam, run%zeta, q, v)
      if (present(is_pressed)) order = merge(0, order, is_pressed)
      event%kind = merge(event_capture, event_impact, order == 0)
      if (.not. (order == 0 .or. abs(event%velocity_before) > 0.0_wp)) return
      call append_event(response, event)
      call measure_impulse(recorder%measurer, t, event%impulse)
   end subroutine capture

   !> Contact that lasts: the stop point is held until the reaction would pull.
   subroutine contact(beam, run, pinned, t, q, v, steps, recorder, response)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> Stop and run
      type(restitution_run_t), intent(in) :: run
      !> The beam held at the stop
      type(pinned_beam_t), target, intent(in) :: pinned
      !> Instant; the release on return
      real(wp), intent(inout) :: t
      !> Modal state, free modes
      real(wp), intent(inout) :: q(:)
      real(wp), intent(inout) :: v(:)
      !> Step matrices of the pinned modes
      type(steps_t), intent(inout) :: steps
      !> Samples
      type(recorder_t), intent(inout) :: recorder
      !> Gets event and histories
      type(response_t), intent(inout) :: response

      type(modal_signal_t) :: reaction
      type(local_t) :: here
      type(search_t) :: search
      type(event_t) :: event
      real(wp), dimension(pinned%count) :: p, rate, p_end, rate_end
      real(wp) :: two_zeta

      two_zeta = 2.0_wp*run%zeta
      q = q - run%surface*pinned%static
      p = to_pinned(pinned, beam%oscillators%square, q)
      rate = matmul(v, pinned%mode)
      call make_modal_signal(pinned%oscillators, run%surface*pinned%static_force, pinned%reaction, reaction)
      ! p + 2 zeta p' swings like p itself
      reaction%z = p + two_zeta*rate
      reaction%v = rate - two_zeta*pinned%oscillators%square*reaction%z
      associate (first => pinned%oscillators%blended + 1)
         reaction%is_viscous = .true.
         reaction%z(first:) = p(first:)
         reaction%v(first:) = rate(first:)
      end associate
      call reaction%look(0.0_wp, 0, here)
      if (here%value <= here%rounding) reaction%start_order = 1
      call first_zero(reaction, run%duration - t, search)
      response%evaluations = response%evaluations + search%evaluations
      if (search%outcome == found_none) then
         call measure_held_contact(recorder%measurer, pinned, t, run%duration - t, .true., p, rate, p, rate)
         call record_contact(run, pinned, reaction, t, run%duration - t, .true., p, rate, steps, recorder, response)
         response%ends_in_contact = .true.
         return
      end if
      call record_contact(run, pinned, reaction, t, search%time, .false., p, rate, steps, recorder, response)
      call propagate(pinned%oscillators, search%time, p, rate, p_end, rate_end)
      call measure_held_contact(recorder%measurer, pinned, t, search%time, .false., p, rate, p_end, rate_end)
      q = run%surface*pinned%static + to_free(pinned, beam%oscillators%square, beam%stop_value, p_end)
      v = matmul(pinned%mode, rate_end)
      t = t + search%time
      event%tau = t
      event%kind = event_release
      call append_event(response, event)
   end subroutine contact

   !> Samples of a contact.
   pure subroutine record_contact(run, pinned, reaction, from, length, to_the_end, p, rate, steps, recorder, response)
      !> Stop and run
      type(restitution_run_t), intent(in) :: run
      !> The beam held at the stop
      type(pinned_beam_t), intent(in) :: pinned
      !> Its reaction
      type(modal_signal_t), intent(in) :: reaction
      !> Start and length of the contact
      real(wp), intent(in) :: from
      real(wp), intent(in) :: length
      !> The run ends with this contact
      logical, intent(in) :: to_the_end
      !> State in the pinned modes at its start
      real(wp), intent(in) :: p(:)
      real(wp), intent(in) :: rate(:)
      !> Step matrices of the pinned modes
      type(steps_t), intent(inout) :: steps
      !> Samples
      type(recorder_t), intent(inout) :: recorder
      !> Gets the histories
      type(response_t), intent(inout) :: response

      type(phase_sampler_t) :: sampler
      real(wp), dimension(pinned%count) :: p_then, rate_then
      real(wp) :: start_energy, energy(2), static_energy, time, to
      integer :: place

      to = from + length
      do while (shape_due(recorder, to, to_the_end))
         call propagate(pinned%oscillators, recorder%shape_tau(recorder%next_shape) - from, p, rate, p_then, rate_then)
         call keep_shape(recorder, run%surface*pinned%static + matmul(pinned%mode, p_then), &
                         matmul(pinned%mode, rate_then))
      end do
      ! static shape and pinned modes are orthogonal in K
      static_energy = 0.5_wp*run%surface**2*pinned%static_force
      start_energy = 0.0_wp
      if (allocated(response%energy)) start_energy = sum(modal_energy(pinned%oscillators, p, rate))
      if (samples_before(recorder, to, to_the_end)) then
         call start_sampler(from, p, rate, sampler)
         do while (samples_before(recorder, to, to_the_end))
            time = next_sample_time(recorder)
            call next_sample(sampler, pinned%oscillators, steps, recorder%step, time)
            call record_sample(recorder, place)
            if (allocated(response%history(eta_stop)%values)) response%history(eta_stop)%values(place) = 0.0_wp
            if (allocated(response%history(eta_tip)%values)) response%history(eta_tip)%values(place) = &
               run%surface*pinned%static_tip - run%surface + sum(pinned%tip_value*sampler%z)
            if (allocated(response%history(velocity_stop)%values)) response%history(velocity_stop)%values(place) = 0.0_wp
            if (allocated(response%history(force_stop)%values)) response%history(force_stop)%values(place) = run%force_scale* &
               (reaction%offset + sum(pinned%reaction*elastic_and_viscous( &
                                      pinned%oscillators, sampler%z, sampler%v, &
                                      max(time - from, 0.0_wp), p, rate)))
            if (allocated(response%energy)) then
               energy = modal_energy(pinned%oscillators, sampler%z, sampler%v)
               call keep_energy(response, place, recorder%ledger, energy + [0.0_wp, static_energy], 0.0_wp, &
                                start_energy - sum(energy), 0.0_wp)
            end if
         end do
      end if
      if (.not. allocated(response%energy) .or. to_the_end) return
      call propagate(pinned%oscillators, length, p, rate, p_then, rate_then)
      recorder%ledger%dissipated_beam = recorder%ledger%dissipated_beam + start_energy &
                                        - sum(modal_energy(pinned%oscillators, p_then, rate_then))
   end subroutine record_contact

end module exact_restitution
