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
   use kinds, only: wp
   use modal_beam, only: modal_beam_t, pinned_beam_t
   use modal_signal, only: make_modal_signal, modal_signal_t
   use response_types, only: most_peaks, quiet_energy, quiet_level, run_measures_t
   use signal_peaks, only: greatest_value, last_time_above, peak_tolerance, signal_view
   use stop_models, only: stop_energy, three_element_t
   implicit none (type, external)
   private
   public :: measurer_t, start_measures, measure_flight, measure_held_contact, measure_spring_contact, finish_measures

   type :: measurer_t
      !> Without it nothing is measured
      logical :: is_wanted = .false.
      type(run_measures_t) :: measures
      !> Energy at the start and at rest at the end of all motion
      real(wp) :: start_energy = 0.0_wp
      real(wp) :: rest_energy = 0.0_wp
      !> Delta
      real(wp) :: surface = 0.0_wp
      !> The stop point has met the stop
      logical :: has_met = .false.
      !> The last phase in which |eta_c| exceeds the quiet level: start, length, |eta_c| as a signal
      real(wp) :: loud_start = 0.0_wp
      real(wp) :: loud_length = 0.0_wp
      logical :: has_loud = .false.
      logical :: loud_in_contact = .false.
      type(modal_signal_t) :: loud_flight
      type(exponential_signal_t) :: loud_contact
      !> Pairs of exponents of contacts, made once
      type(contact_losses_t) :: losses
   end type measurer_t

   !> Where a falling function passes zero: regula falsi, the weight of an end that stays halved (Illinois).
   type :: bracket_t
      real(wp) :: low = 0.0_wp
      real(wp) :: high = 0.0_wp
      real(wp) :: value_low = 0.0_wp
      real(wp) :: value_high = 0.0_wp
      !> Where to evaluate next
      real(wp) :: guess = 0.0_wp
      integer :: last_side = 0
      integer :: count = 0
      logical :: is_done = .false.
   end type bracket_t

contains

   !> Begin a run.
   pure subroutine start_measures(is_wanted, start_energy, surface, compliance, measurer)
      !> Measures are asked for
      logical, intent(in) :: is_wanted
      !> Energy at tau = 0
      real(wp), intent(in) :: start_energy
      !> delta
      real(wp), intent(in) :: surface
      !> Displacement of the stop point in contact, at rest, per unit of force: of the beam and of the stop
      real(wp), intent(in) :: compliance
      !> Ready for the first phase
      type(measurer_t), intent(out) :: measurer

      measurer%is_wanted = is_wanted
      measurer%start_energy = start_energy
      measurer%surface = surface
      measurer%rest_energy = 0.5_wp*max(surface, 0.0_wp)**2/compliance
   end subroutine start_measures

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
      class(certified_signal_t), allocatable :: below
      type(search_t) :: search
      real(wp) :: peak, peak_time
      logical :: exceeds, still_rises

      if (.not. measurer%is_wanted) return
      call make_modal_signal(beam%oscillators, -measurer%surface, beam%stop_value, eta)
      eta%z = q
      eta%v = v
      associate (measures => measurer%measures)
         if (measurer%has_met .and. measures%rebounds < most_peaks) then
            call greatest_value(eta, length, max(quiet_level, greatest*(1.0_wp - peak_tolerance)), &
                                exceeds, still_rises, peak, peak_time)
            if (.not. exceeds .and. greatest > quiet_level) then
               exceeds = .true.
               peak = greatest
            end if
            if (exceeds .and. .not. (to_the_end .and. still_rises)) then
               measures%rebounds = measures%rebounds + 1
               measures%peak_eta(measures%rebounds) = peak
            end if
         else
            exceeds = greatest > quiet_level
            if (.not. exceeds) then
               call signal_view(eta, 0.0_wp, -1.0_wp, quiet_level, 0, below)
               call first_zero(below, length, search)
               exceeds = search%outcome == found_zero
            end if
            if (exceeds .and. measurer%has_met) measures%rebounds = measures%rebounds + 1
         end if
         if (exceeds) then
            measurer%has_loud = .true.
            measurer%loud_in_contact = .false.
            measurer%loud_start = from
            measurer%loud_length = length
            measurer%loud_flight = eta
         end if
      end associate
      measurer%has_met = .true.
      measurer%measures%lost_stop = measurer%measures%lost_stop - energy_stop*expm1(-decay*length)
      call measure_energy(measurer, beam%oscillators, from, length, to_the_end, q, v, q_end, v_end, 0.0_wp, &
                          energy_stop, decay)
   end subroutine measure_flight

   !> A contact of model A: the stop point held.
   subroutine measure_held_contact(measurer, pinned, reaction, force_scale, from, length, to_the_end, greatest, p, rate, &
                                   p_end, rate_end)
      !> Gets what the contact tells
      type(measurer_t), intent(inout) :: measurer
      !> The beam held at the stop
      type(pinned_beam_t), target, intent(in) :: pinned
      !> Its reaction
      type(modal_signal_t), intent(in) :: reaction
      !> Pbar per unit of force
      real(wp), intent(in) :: force_scale
      !> Start and length
      real(wp), intent(in) :: from
      real(wp), intent(in) :: length
      !> The run ends with it
      logical, intent(in) :: to_the_end
      !> The force was seen to be as great as this
      real(wp), intent(in) :: greatest
      !> State in the pinned modes at its start and, unless the run ends with it, at its end
      real(wp), intent(in) :: p(:)
      real(wp), intent(in) :: rate(:)
      real(wp), intent(in) :: p_end(:)
      real(wp), intent(in) :: rate_end(:)

      if (.not. measurer%is_wanted) return
      measurer%has_met = .true.
      call measure_force(measurer%measures, reaction, length, greatest, force_scale)
      ! static shape and pinned modes are orthogonal in K
      call measure_energy(measurer, pinned%oscillators, from, length, to_the_end, p, rate, p_end, rate_end, &
                          0.5_wp*measurer%surface**2*pinned%static_force, 0.0_wp, 0.0_wp)
   end subroutine measure_held_contact

   !> A contact of model B.
   subroutine measure_spring_contact(measurer, beam, zeta, spring, modes, force, force_scale, from, length, to_the_end, &
                                     greatest, q, v)
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
      !> Pbar per unit of force
      real(wp), intent(in) :: force_scale
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
      class(certified_signal_t), allocatable :: below
      type(search_t) :: search
      type(bracket_t) :: bracket
      real(wp) :: lost(2), energy

      if (.not. measurer%is_wanted) return
      measurer%has_met = .true.
      call measure_force(measurer%measures, force, length, greatest, force_scale)
      associate (measures => measurer%measures)
         measures%greatest_impulse = max(measures%greatest_impulse, force%offset*length + sum(real( &
            force%amplitude*integral(force%exponent, length, exp(force%exponent*length)), wp)))
         if (.not. measurer%losses%made) call make_contact_losses(beam, zeta, spring, modes, measurer%losses)
         call losses_until(beam, modes, measurer%losses, force%amplitude, q, v, length, lost)
         measures%lost_stop = measures%lost_stop + lost(2)
      end associate
      ! -eta: how far the stop yields
      indentation%offset = measurer%surface - force%offset*beam%flexibility
      allocate (indentation%exponent, source=force%exponent)
      allocate (indentation%amplitude, source=-modes%stop_value*force%amplitude)
      call signal_view(indentation, 0.0_wp, -1.0_wp, quiet_level, 0, below)
      call first_zero(below, length, search)
      if (search%outcome == found_zero) then
         measurer%has_loud = .true.
         measurer%loud_in_contact = .true.
         measurer%loud_start = from
         measurer%loud_length = length
         measurer%loud_contact = indentation
      end if
      if (measurer%measures%has_spent .and. .not. to_the_end) return
      energy = energy_at(length)
      if (to_the_end) measurer%measures%final_energy = energy
      if (measurer%measures%has_spent .or. excess_of(measurer, energy) > 0.0_wp) return
      call start_bracket(length, excess_of(measurer, energy_at(0.0_wp)), excess_of(measurer, energy), bracket)
      do while (.not. bracket%is_done)
         call narrow(bracket, excess_of(measurer, energy_at(bracket%guess)))
      end do
      measurer%measures%has_spent = .true.
      measurer%measures%spent_tau = from + bracket%guess

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
   subroutine finish_measures(measurer, lost_impact, created, measures)
      !> What the phases told
      type(measurer_t), intent(in) :: measurer
      !> Energy dissipated at impacts, and created by the nodal reading
      real(wp), intent(in) :: lost_impact
      real(wp), intent(in) :: created
      !> All of it
      type(run_measures_t), intent(out) :: measures

      real(wp) :: last
      logical :: stays_above

      measures = measurer%measures
      measures%start_energy = measurer%start_energy
      measures%rest_energy = measurer%rest_energy
      measures%lost_impact = lost_impact
      measures%created = created
      ! the ledger closes to rounding
      measures%lost_beam = measurer%start_energy + created - lost_impact - measures%lost_stop - measures%final_energy
      measures%is_quiet = .true.
      if (.not. measurer%has_loud) return
      if (measurer%loud_in_contact) then
         call last_time_above(measurer%loud_contact, measurer%loud_length, quiet_level, last, stays_above)
      else
         call last_time_above(measurer%loud_flight, measurer%loud_length, quiet_level, last, stays_above)
      end if
      measures%is_quiet = .not. stays_above
      measures%quiet_tau = measurer%loud_start + last
   end subroutine finish_measures

   !> Does the force exceed the greatest so far, and how far?
   subroutine measure_force(measures, force, length, greatest, scale)
      !> Gets the force
      type(run_measures_t), intent(inout) :: measures
      !> The force as a signal
      class(certified_signal_t), intent(in) :: force
      !> Length of the contact
      real(wp), intent(in) :: length
      !> Seen in this contact
      real(wp), intent(in) :: greatest
      !> Pbar per unit of force
      real(wp), intent(in) :: scale

      real(wp) :: peak, time, known
      logical :: exceeds, still_rises

      known = max(measures%greatest_force/scale, greatest)
      call greatest_value(force, length, known*(1.0_wp + peak_tolerance), exceeds, still_rises, peak, time)
      if (exceeds) known = max(known, peak)
      measures%greatest_force = scale*known
   end subroutine measure_force

   !> Energy of oscillators, and where it falls to the share that counts as spent.
   subroutine measure_energy(measurer, oscillators, from, length, to_the_end, z, v, z_end, v_end, constant, energy_stop, &
                             decay)
      !> Gets the instant
      type(measurer_t), intent(inout) :: measurer
      !> Oscillators of the phase
      type(oscillators_t), intent(in) :: oscillators
      !> Start and length
      real(wp), intent(in) :: from
      real(wp), intent(in) :: length
      !> The run ends with it
      logical, intent(in) :: to_the_end
      !> State at its start and, unless the run ends with it, at its end
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
      real(wp) :: energy

      if (measurer%measures%has_spent .and. .not. to_the_end) return
      if (to_the_end) then
         call propagate(oscillators, length, z, v, z_then, v_then)
         energy = energy_of(z_then, v_then, length)
         measurer%measures%final_energy = energy
      else
         energy = energy_of(z_end, v_end, length)
      end if
      if (measurer%measures%has_spent .or. excess_of(measurer, energy) > 0.0_wp) return
      call start_bracket(length, excess_of(measurer, energy_of(z, v, 0.0_wp)), excess_of(measurer, energy), bracket)
      do while (.not. bracket%is_done)
         call propagate(oscillators, bracket%guess, z, v, z_then, v_then)
         call narrow(bracket, excess_of(measurer, energy_of(z_then, v_then, bracket%guess)))
      end do
      measurer%measures%has_spent = .true.
      measurer%measures%spent_tau = from + bracket%guess

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

   !> By how much an energy, less that of rest, exceeds the share that counts as spent.
   pure function excess_of(measurer, energy) result(excess)
      !> Energies at the start and at rest
      type(measurer_t), intent(in) :: measurer
      !> The energy
      real(wp), intent(in) :: energy
      real(wp) :: excess

      excess = energy - measurer%rest_energy - quiet_energy*(measurer%start_energy - measurer%rest_energy)
   end function excess_of

   !> Bracket the zero of a function that falls from 0 to a length.
   pure subroutine start_bracket(length, at_start, at_end, bracket)
      !> The length
      real(wp), intent(in) :: length
      !> Values; the last one is not positive
      real(wp), intent(in) :: at_start
      real(wp), intent(in) :: at_end
      !> The bracket
      type(bracket_t), intent(out) :: bracket

      bracket%high = length
      bracket%value_low = at_start
      bracket%value_high = at_end
      ! an impact before the phase may have made it so already
      bracket%is_done = at_start <= 0.0_wp
      if (.not. bracket%is_done) call next_guess(bracket)
   end subroutine start_bracket

   !> Enter the value at the guess and make the next.
   pure subroutine narrow(bracket, value)
      !> The bracket
      type(bracket_t), intent(inout) :: bracket
      !> The value
      real(wp), intent(in) :: value

      integer, parameter :: cap = 200
      integer :: side

      side = merge(1, -1, value > 0.0_wp)
      if (value > 0.0_wp) then
         bracket%low = bracket%guess
         bracket%value_low = value
         if (bracket%last_side == side) bracket%value_high = 0.5_wp*bracket%value_high
      else
         bracket%high = bracket%guess
         bracket%value_high = value
         if (bracket%last_side == side) bracket%value_low = 0.5_wp*bracket%value_low
      end if
      bracket%last_side = side
      bracket%count = bracket%count + 1
      bracket%is_done = bracket%count >= cap .or. abs(value) <= 0.0_wp .or. &
                        bracket%high - bracket%low <= 4.0_wp*epsilon(1.0_wp)*bracket%high
      if (.not. bracket%is_done) call next_guess(bracket)
   end subroutine narrow

   !> Where the chord passes zero, and the middle now and then.
   pure subroutine next_guess(bracket)
      !> The bracket
      type(bracket_t), intent(inout) :: bracket

      real(wp) :: middle, guess

      middle = bracket%low + 0.5_wp*(bracket%high - bracket%low)
      guess = bracket%low + (bracket%high - bracket%low)*(bracket%value_low/(bracket%value_low - bracket%value_high))
      if (.not. (guess > bracket%low .and. guess < bracket%high) .or. modulo(bracket%count, 8) == 7) guess = middle
      bracket%guess = guess
      if (.not. (guess > bracket%low .and. guess < bracket%high)) bracket%is_done = .true.
   end subroutine next_guess

   !> exp(x) - 1 for x <= 0 without cancellation.
   elemental function expm1(x) result(value)
      !> The argument
      real(wp), intent(in) :: x
      real(wp) :: value

      ! exp(x) - 1 = tanh(x/2) (exp(x) + 1)
      value = tanh(0.5_wp*x)*(exp(x) + 1.0_wp)
   end function expm1

end module flight_measures
