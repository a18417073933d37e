!> Measures of a run taken from its motion in closed form, phase by phase as they end: no samples.
!>
!> A flight is looked into only where it rises above the level that counts, a contact only where its force exceeds
!> the greatest so far; `certified_search` decides both, mostly at one look. What only the last such phase can
!> tell, the instant of quiet, is sought at the end of the run.
module flight_measures
   use certified_search, only: certified_signal_t, first_zero, found_zero, search_t
   use contact_losses, only: contact_losses_t, integral, losses_until, make_contact_losses
   use contact_modes, only: contact_modes_t, contact_state
   use damped_oscillators, only: oscillators_t, propagate
   use exponential_signal, only: exponential_signal_t
   use falling_zero, only: bracket_t, narrow, start_bracket
   use kinds, only: wp
   use modal_beam, only: modal_beam_t, pinned_beam_t
   use modal_signal, only: make_modal_signal, modal_signal_t
   use response_types, only: quiet_level, response_t, run_measures_t
   use run_measures, only: add_rebound, early_part, end_episode, excess_of, finish_tally, mark_energy, start_tally, &
                           take_contact, take_impulse, tally_t
   use run_settings, only: stop_settings_t
   use signal_peaks, only: greatest_value, last_time_above, peak_tolerance, signal_view
   use stop_models, only: stop_energy, three_element_t
   implicit none (type, external)
   private
   public :: measurer_t, start_measures, measure_impulse, measure_flight, measure_held_contact, measure_spring_contact, &
      finish_measures

   type :: measurer_t
      !> Without it nothing is measured
      logical :: is_wanted = .false.
      !> Peaks are kept of so many rebounds
      integer :: most_peaks = 0
      type(tally_t) :: tally
      type(run_measures_t) :: measures
      !> Energy lost in the stop
      real(wp) :: lost_stop = 0.0_wp
      !> Delta
      real(wp) :: surface = 0.0_wp
      !> The stop point has met the stop
      logical :: has_met = .false.
      !> The last phase in which |eta_c| exceeds the quiet level: start, length, eta_c or, in contact, -eta_c as a signal
      real(wp) :: loud_start = 0.0_wp
      real(wp) :: loud_length = 0.0_wp
      logical :: has_loud = .false.
      logical :: loud_in_contact = .false.
      type(modal_signal_t) :: loud_flight
      type(exponential_signal_t) :: loud_contact
      !> Pairs of exponents of contacts, made once
      type(contact_losses_t) :: losses
   end type measurer_t

contains

   !> Begin a run.
   pure subroutine start_measures(is_wanted, most_peaks, stop, start_energy, force_scale, measurer)
      !> Measures are asked for
      logical, intent(in) :: is_wanted
      !> Peaks are kept of so many rebounds
      integer, intent(in) :: most_peaks
      !> The stop
      type(stop_settings_t), intent(in) :: stop
      !> Energy at tau = 0
      real(wp), intent(in) :: start_energy
      !> Pbar per unit of force
      real(wp), intent(in) :: force_scale
      !> Ready for the first phase
      type(measurer_t), intent(out) :: measurer

      measurer%is_wanted = is_wanted
      if (.not. is_wanted) return
      measurer%most_peaks = most_peaks
      measurer%surface = stop%preload
      call start_tally(stop, start_energy, force_scale, measurer%tally)
   end subroutine start_measures

   !> An impulse.
   pure subroutine measure_impulse(measurer, tau, impulse)
      !> Gets what it tells
      type(measurer_t), intent(inout) :: measurer
      !> The instant
      real(wp), intent(in) :: tau
      !> The impulse
      real(wp), intent(in) :: impulse

      if (measurer%is_wanted) call take_impulse(measurer%tally, tau, impulse)
   end subroutine measure_impulse

   !> A free flight.
   subroutine measure_flight(measurer, beam, from, length, to_the_end, greatest, q, v, q_end, v_end, energy_stop, decay)
      !> Gets what the flight tells
      type(measurer_t), intent(inout) :: measurer
      !> The beam in its free modes
      type(modal_beam_t), target, intent(in) :: beam
      !> Start and length
      real(wp), intent(in) :: from
      real(wp), intent(in) :: length
      !> The run ends with it
      logical, intent(in) :: to_the_end
      !> eta of the stop point was seen to be as great as this
      real(wp), intent(in) :: greatest
      !> Modal state at its start and, unless the run ends with it, at its end
      real(wp), intent(in) :: q(:)
      real(wp), intent(in) :: v(:)
      real(wp), intent(in) :: q_end(:)
      real(wp), intent(in) :: v_end(:)
      !> Energy in the stop at its start, and the rate at which the stop loses it
      real(wp), intent(in) :: energy_stop
      real(wp), intent(in) :: decay

      type(modal_signal_t) :: eta
      real(wp), dimension(beam%count) :: q_last, v_last
      logical :: rises

      if (.not. measurer%is_wanted) return
      call make_modal_signal(beam%oscillators, -measurer%surface, beam%stop_value, eta)
      eta%z = q
      eta%v = v
      call measure_rise(measurer, eta, from, length, to_the_end, greatest, rises)
      if (rises) call end_episode(measurer%tally)
      ! over a surface that is still indented it may stay below; no deeper than at its start
      if (rises .or. sum(beam%stop_value*q) - measurer%surface < -quiet_level) then
         measurer%has_loud = .true.
         measurer%loud_in_contact = .false.
         measurer%loud_start = from
         measurer%loud_length = length
         measurer%loud_flight = eta
      end if
      measurer%has_met = .true.
      measurer%lost_stop = measurer%lost_stop - energy_stop*expm1(-decay*length)
      q_last = q_end
      v_last = v_end
      if (to_the_end) call propagate(beam%oscillators, length, q, v, q_last, v_last)
      call measure_energy(measurer, beam%oscillators, from, length, q, v, q_last, v_last, 0.0_wp, energy_stop, decay)
   end subroutine measure_flight

   !> Does a flight rise above the quiet level? After the first meeting with the stop it is a rebound then, unless it still
   !> rises to its highest point as the run ends.
   subroutine measure_rise(measurer, eta, from, length, to_the_end, greatest, rises)
      !> Gets the rebound
      type(measurer_t), intent(inout) :: measurer
      !> eta of the stop point
      type(modal_signal_t), intent(in) :: eta
      !> Start and length
      real(wp), intent(in) :: from
      real(wp), intent(in) :: length
      !> The run ends with it
      logical, intent(in) :: to_the_end
      !> Seen to be as great as this
      real(wp), intent(in) :: greatest
      !> It does
      logical, intent(out) :: rises

      logical :: keeps_peak, still_rises
      real(wp) :: peak, time

      keeps_peak = measurer%measures%rebounds < measurer%most_peaks
      if (.not. measurer%has_met .or. .not. (keeps_peak .or. to_the_end)) then
         rises = greatest > quiet_level
         if (.not. rises) rises = exceeds(eta, length, quiet_level)
         if (rises .and. measurer%has_met) call add_rebound(measurer%measures)
         return
      end if
      call greatest_value(eta, length, max(quiet_level, greatest*(1.0_wp - peak_tolerance)), rises, still_rises, peak, time)
      if (.not. rises .and. greatest > quiet_level) then
         rises = .true.
         peak = greatest
      end if
      if (.not. rises .or. (to_the_end .and. still_rises)) return
      if (keeps_peak) then
         call add_rebound(measurer%measures, from + time, peak)
      else
         call add_rebound(measurer%measures)
      end if
   end subroutine measure_rise

   !> Does a signal exceed a level?
   function exceeds(signal, length, level) result(does)
      !> The signal
      class(certified_signal_t), intent(in) :: signal
      !> Length of the phase
      real(wp), intent(in) :: length
      !> The level
      real(wp), intent(in) :: level
      logical :: does

      class(certified_signal_t), allocatable :: below
      type(search_t) :: search
      real(wp) :: value, slope

      call signal%evaluate(0.0_wp, value, slope)
      does = value > level
      if (does) return
      call signal_view(signal, 0.0_wp, -1.0_wp, level, 0, below)
      call first_zero(below, length, search)
      does = search%outcome == found_zero
   end function exceeds

   !> A contact of model A: the stop point held.
   subroutine measure_held_contact(measurer, pinned, from, length, to_the_end, p, rate, p_end, rate_end)
      !> Gets what the contact tells
      type(measurer_t), intent(inout) :: measurer
      !> The beam held at the stop
      type(pinned_beam_t), target, intent(in) :: pinned
      !> Start and length
      real(wp), intent(in) :: from
      real(wp), intent(in) :: length
      !> The run ends with it
      logical, intent(in) :: to_the_end
      !> State in the pinned modes at its start and, unless the run ends with it, at its end
      real(wp), intent(in) :: p(:)
      real(wp), intent(in) :: rate(:)
      real(wp), intent(in) :: p_end(:)
      real(wp), intent(in) :: rate_end(:)

      real(wp), dimension(pinned%count) :: p_then, rate_then
      real(wp) :: early, early_impulse

      if (.not. measurer%is_wanted) return
      measurer%has_met = .true.
      early = early_part(measurer%tally, from, length)
      early_impulse = 0.0_wp
      if (early > 0.0_wp) then
         call propagate(pinned%oscillators, early, p, rate, p_then, rate_then)
         early_impulse = impulse_until(early, rate_then)
      end if
      p_then = p_end
      rate_then = rate_end
      if (to_the_end) call propagate(pinned%oscillators, length, p, rate, p_then, rate_then)
      call take_contact(measurer%tally, from, length, impulse_until(length, rate_then), early_impulse)
      ! static shape and pinned modes are orthogonal in K
      call measure_energy(measurer, pinned%oscillators, from, length, p, rate, p_then, rate_then, &
                          0.5_wp*measurer%surface**2*pinned%static_force, 0.0_wp, 0.0_wp)

   contains

      !> Integral of the reaction: a mode's part, p + 2 zeta p', is -p''/w^2.
      pure function impulse_until(time, rate_then) result(impulse)
         !> Up to here
         real(wp), intent(in) :: time
         !> p' there
         real(wp), intent(in) :: rate_then(:)
         real(wp) :: impulse

         impulse = measurer%surface*pinned%static_force*time + sum(pinned%reaction*(rate - rate_then)/pinned%square)
      end function impulse_until

   end subroutine measure_held_contact

   !> A contact of model B.
   subroutine measure_spring_contact(measurer, beam, zeta, spring, modes, force, from, length, to_the_end, greatest, q, v)
      !> Gets what the contact tells
      type(measurer_t), intent(inout) :: measurer
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> zeta
      real(wp), intent(in) :: zeta
      !> The stop
      type(three_element_t), intent(in) :: spring
      !> Exponents and shapes
      type(contact_modes_t), intent(in) :: modes
      !> The force: static part, exponents, weight times c
      type(exponential_signal_t), intent(in) :: force
      !> Start and length
      real(wp), intent(in) :: from
      real(wp), intent(in) :: length
      !> The run ends with it
      logical, intent(in) :: to_the_end
      !> The force was seen to be as great as this
      real(wp), intent(in) :: greatest
      !> Modal state at its start
      real(wp), intent(in) :: q(:)
      real(wp), intent(in) :: v(:)

      type(exponential_signal_t) :: indentation
      type(bracket_t) :: bracket
      real(wp) :: lost(2), energy, impulse

      if (.not. measurer%is_wanted) return
      measurer%has_met = .true.
      call measure_force(measurer%tally, force, length, greatest)
      impulse = force%offset*length &
                + sum(real(force%amplitude*integral(force%exponent, length, exp(force%exponent*length)), wp))
      call take_contact(measurer%tally, from, length, impulse, 0.0_wp)
      if (.not. measurer%losses%made) call make_contact_losses(beam, zeta, spring, modes, measurer%losses)
      call losses_until(beam, modes, measurer%losses, force%amplitude, q, v, length, lost)
      measurer%lost_stop = measurer%lost_stop + lost(2)
      ! -eta: how far the stop yields; never less than nothing, as a branch that was drawn in pulls
      indentation%offset = measurer%surface - force%offset*beam%flexibility
      allocate (indentation%exponent, source=force%exponent)
      allocate (indentation%place, source=force%place)
      allocate (indentation%amplitude, source=-modes%stop_value*force%amplitude)
      if (exceeds(indentation, length, quiet_level)) then
         measurer%has_loud = .true.
         measurer%loud_in_contact = .true.
         measurer%loud_start = from
         measurer%loud_length = length
         measurer%loud_contact = indentation
      end if
      ! beam and stop together win no energy
      if (measurer%tally%has_spent .and. .not. to_the_end) return
      energy = energy_at(length)
      measurer%measures%final_energy = energy
      if (measurer%tally%has_spent .or. excess_of(measurer%tally, energy) > 0.0_wp) return
      call start_bracket(length, excess_of(measurer%tally, energy_at(0.0_wp)), excess_of(measurer%tally, energy), bracket)
      do while (.not. bracket%is_done)
         call narrow(bracket, excess_of(measurer%tally, energy_at(bracket%guess)))
      end do
      call mark_energy(measurer%tally, .true., from + bracket%guess)

   contains

      !> Energy of beam and stop at a time in the contact.
      function energy_at(t) result(total)
         !> The time
         real(wp), intent(in) :: t
         real(wp) :: total

         real(wp), dimension(beam%count) :: q_then, v_then
         real(wp) :: depth, now

         call contact_state(beam, modes, force%offset, force%amplitude/modes%weight, q, v, t, q_then, v_then)
         depth = measurer%surface - sum(beam%stop_value*q_then)
         now = force%offset + sum(real(force%amplitude*exp(force%exponent*t), wp))
         total = 0.5_wp*sum(v_then**2 + beam%oscillators%square*q_then**2) &
                 + stop_energy(spring, depth, now - spring%stiffness*depth)
      end function energy_at

   end subroutine measure_spring_contact

   !> The end of the run.
   subroutine finish_measures(measurer, duration, lost_impact, created, response)
      !> What the phases told
      type(measurer_t), intent(inout) :: measurer
      !> Its length, tau
      real(wp), intent(in) :: duration
      !> Energy dissipated at impacts, and created by the nodal reading
      real(wp), intent(in) :: lost_impact
      real(wp), intent(in) :: created
      !> The run, with its events; gets the measures
      type(response_t), intent(inout) :: response

      type(run_measures_t) :: measures
      class(certified_signal_t), allocatable :: depth
      real(wp) :: last, lost_beam, lower
      logical :: is_loud, is_low

      measures = measurer%measures
      ! the ledger closes to rounding
      lost_beam = measurer%tally%start_energy + created - lost_impact - measurer%lost_stop - measures%final_energy
      call finish_tally(measurer%tally, response, duration, [lost_beam, measurer%lost_stop, lost_impact], created, &
                        measurer%most_peaks, measures)
      last = 0.0_wp
      is_loud = .false.
      if (measurer%loud_in_contact) then
         call last_time_above(measurer%loud_contact, measurer%loud_length, quiet_level, last, is_loud)
      else if (measurer%has_loud) then
         call last_time_above(measurer%loud_flight, measurer%loud_length, quiet_level, last, is_loud)
         call signal_view(measurer%loud_flight, 0.0_wp, -1.0_wp, 0.0_wp, 0, depth)
         call last_time_above(depth, measurer%loud_length, quiet_level, lower, is_low)
         last = max(last, lower)
         is_loud = is_loud .or. is_low
      end if
      measures%is_quiet = .not. is_loud
      measures%quiet_tau = measurer%loud_start + last
      allocate (response%measures, source=measures)
   end subroutine finish_measures

   !> Does the force exceed the greatest so far, and how far?
   subroutine measure_force(tally, force, length, greatest)
      !> Gets the force
      type(tally_t), intent(inout) :: tally
      !> The force as a signal
      class(certified_signal_t), intent(in) :: force
      !> Length of the contact
      real(wp), intent(in) :: length
      !> Seen in this contact
      real(wp), intent(in) :: greatest

      real(wp) :: peak, time, known
      logical :: exceeds, still_rises

      known = max(tally%greatest_force/tally%force_scale, greatest)
      call greatest_value(force, length, known*(1.0_wp + peak_tolerance), exceeds, still_rises, peak, time)
      if (exceeds) known = max(known, peak)
      tally%greatest_force = tally%force_scale*known
   end subroutine measure_force

   !> Energy of oscillators, and where it falls for good to the share that counts as spent.
   subroutine measure_energy(measurer, oscillators, from, length, z, v, z_end, v_end, constant, energy_stop, decay)
      !> Gets the instant
      type(measurer_t), intent(inout) :: measurer
      !> Oscillators of the phase
      type(oscillators_t), intent(in) :: oscillators
      !> Start and length
      real(wp), intent(in) :: from
      real(wp), intent(in) :: length
      !> State at its start and at its end
      real(wp), intent(in) :: z(:)
      real(wp), intent(in) :: v(:)
      real(wp), intent(in) :: z_end(:)
      real(wp), intent(in) :: v_end(:)
      !> Energy besides: constant, and in the stop, which loses it at a rate
      real(wp), intent(in) :: constant
      real(wp), intent(in) :: energy_stop
      real(wp), intent(in) :: decay

      type(bracket_t) :: bracket
      real(wp), dimension(size(z)) :: z_then, v_then
      real(wp) :: at_start, at_end

      measurer%measures%final_energy = energy_of(z_end, v_end, length)
      at_start = excess_of(measurer%tally, energy_of(z, v, 0.0_wp))
      at_end = excess_of(measurer%tally, measurer%measures%final_energy)
      ! the nodal reading of an impulse may have created some
      if (at_start > 0.0_wp .and. measurer%tally%has_spent) call mark_energy(measurer%tally, .false., from)
      if (measurer%tally%has_spent .or. at_end > 0.0_wp) return
      call start_bracket(length, at_start, at_end, bracket)
      do while (.not. bracket%is_done)
         call propagate(oscillators, bracket%guess, z, v, z_then, v_then)
         call narrow(bracket, excess_of(measurer%tally, energy_of(z_then, v_then, bracket%guess)))
      end do
      call mark_energy(measurer%tally, .true., from + bracket%guess)

   contains

      !> Energy in a state.
      pure function energy_of(state, velocity, time) result(total)
         !> The state
         real(wp), intent(in) :: state(:)
         real(wp), intent(in) :: velocity(:)
         !> Its time
         real(wp), intent(in) :: time
         real(wp) :: total

         total = constant + energy_stop*exp(-decay*time) + 0.5_wp*sum(velocity**2 + oscillators%square*state**2)
      end function energy_of

   end subroutine measure_energy

   !> exp(x) - 1 for x <= 0 without cancellation.
   elemental function expm1(x) result(value)
      !> The argument
      real(wp), intent(in) :: x
      real(wp) :: value

      ! exp(x) - 1 = tanh(x/2) (exp(x) + 1)
      value = tanh(0.5_wp*x)*(exp(x) + 1.0_wp)
   end function expm1

end module flight_measures
