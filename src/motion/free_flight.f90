!> The phase in which the stop is open: the beam swings in its free modes until the gap is closed.
module free_flight
   use certified_search, only: first_zero, found_none, found_zero, most_kept, search_t, trail_t, viewed_signal_t
   use damped_oscillators, only: modal_energy, next_sample, propagate, sampler_t
   use history_list, only: eta_stop, eta_tip, velocity_stop
   use kinds, only: wp
   use modal_beam, only: modal_beam_t
   use modal_signal, only: make_modal_signal, modal_signal_t, modal_state_t
   use motion_phases, only: contact_t, found_taken_back, measure_energy, motion_t, phase_t
   use phase_measures, only: keep_loud, measure_rise
   use response_types, only: quiet_level, response_t
   use run_measures, only: end_episode
   use run_recorder, only: asked_t, charge_event, sample_t
   implicit none (type, external)
   private
   public :: flight_t, make_flight

   type, extends(phase_t) :: flight_t
      type(modal_beam_t), pointer :: beam => null()
      class(contact_t), pointer :: stop => null()
      !> Distance of the stop point from the surface as it is, and from where it is unstressed
      type(modal_signal_t) :: gap
      type(modal_signal_t) :: eta
      !> Where the search for the end looked last
      type(modal_state_t) :: last
      !> What the search for the end has seen of the former
      type(trail_t) :: trail
      type(sampler_t) :: sampler
      !> Energy of the beam at the start, where it is asked for
      real(wp) :: start_energy = 0.0_wp
   contains
      procedure :: begin
      procedure :: find_end
      procedure :: go_to
      procedure :: take_sample
      procedure :: energy_at
      procedure :: finish
      procedure :: measure
      procedure :: follow
   end type flight_t

contains

   !> Prepare all flights of a run.
   subroutine make_flight(beam, stop, flight)
      !> Beam and stop; they must outlive the flight
      type(modal_beam_t), target, intent(in) :: beam
      class(contact_t), target, intent(in) :: stop
      type(flight_t), intent(out) :: flight

      flight%beam => beam
      flight%stop => stop
      call make_modal_signal(beam%oscillators, -stop%surface, beam%stop_value, flight%gap)
      call make_modal_signal(beam%oscillators, -stop%surface, beam%stop_value, flight%eta)
      allocate (flight%last%z(beam%count), flight%last%v(beam%count))
   end subroutine make_flight

   !> Take over the state of the motion.
   subroutine begin(self, motion)
      class(flight_t), target, intent(inout) :: self
      type(motion_t), intent(inout) :: motion

      self%gap%z = motion%q
      self%gap%v = motion%v
      self%gap%start_order = self%stop%start_order
      self%gap%surface = self%stop%depth
      self%gap%rate = self%stop%rate
      self%gap%last => self%last
      self%last%time = -1.0_wp
      if (self%stop%is_rigid) then
         self%eta%surface = self%stop%depth
         self%eta%rate = self%stop%rate
      end if
      call self%sampler%restart()
      if (motion%recorder%asked%energy) self%start_energy = sum(modal_energy(self%beam%oscillators, motion%q, motion%v))
   end subroutine begin

   !> Where the gap is closed. A low hop is no flight.
   subroutine find_end(self, limit)
      class(flight_t), intent(inout) :: self
      !> Time left to the end of the run
      real(wp), intent(in) :: limit

      call self%gap%find_zero(limit, self%search, self%trail)
      if (self%search%outcome == found_zero .and. self%search%greatest < self%stop%hop_tolerance) then
         if (self%search%ceiling < self%stop%hop_tolerance) then
            self%search%outcome = found_taken_back
         else
            call judge_hop(self%gap, self%stop%hop_tolerance, self%search)
         end if
      end if
   end subroutine find_end

   !> Does a flight stay below the tolerance all the way, for certain? As far as the rounding error of the gap can tell.
   subroutine judge_hop(gap, tolerance, search)
      !> The gap and its state at the start of the flight
      type(modal_signal_t), intent(in) :: gap
      !> Hop tolerance, in eta
      real(wp), intent(in) :: tolerance
      !> Its end; taken back if it does
      type(search_t), intent(inout) :: search

      class(viewed_signal_t), allocatable :: room
      type(search_t) :: rise
      real(wp) :: noise

      noise = 4.0_wp*epsilon(1.0_wp)*(abs(gap%offset) + sum(abs(gap%weight*gap%z)))
      call gap%view(0.0_wp, -1.0_wp, tolerance + noise, 0, room)
      call first_zero(room, search%time, rise)
      if (rise%outcome == found_none) search%outcome = found_taken_back
      search%evaluations = search%evaluations + rise%evaluations
   end subroutine judge_hop

   !> Free modal state at a time in the flight.
   subroutine go_to(self, time, q, v, node)
      class(flight_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp), intent(out) :: q(:)
      real(wp), intent(out) :: v(:)
      real(wp), optional, intent(out) :: node(2)

      if (present(node)) node = node_of(self, time)
      call propagate(self%beam%oscillators, time, self%gap%z, self%gap%v, q, v)
   end subroutine go_to

   !> Displacement and velocity of a massless node at the stop, besides those of the modes there.
   pure function node_of(self, time) result(node)
      type(flight_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp) :: node(2)

      node = 0.0_wp
      associate (stop => self%stop)
         if (stop%is_rigid) node = [1.0_wp, -stop%rate]*stop%depth*exp(-stop%rate*time)
      end associate
   end function node_of

   !> The next sample.
   subroutine take_sample(self, time, step, asked, sample)
      class(flight_t), intent(inout) :: self
      real(wp), intent(in) :: time
      real(wp), intent(in) :: step
      type(asked_t), intent(in) :: asked
      type(sample_t), intent(inout) :: sample

      real(wp) :: node(2)

      call next_sample(self%sampler, self%beam%oscillators, self%gap%z, self%gap%v, step, time)
      node = node_of(self, time)
      associate (beam => self%beam, stop => self%stop, z => self%sampler%z, v => self%sampler%v)
         if (asked%history(eta_stop)) sample%history(eta_stop) = sum(beam%stop_value*z) - stop%surface + node(1)
         if (asked%history(eta_tip)) sample%history(eta_tip) = sum(beam%tip_value*z) - stop%surface &
            + merge(node(1), 0.0_wp, beam%stop_is_tip)
         if (asked%history(velocity_stop)) sample%history(velocity_stop) = sum(beam%stop_value*v) + node(2)
         if (.not. asked%energy) return
         sample%beam_energy = modal_energy(beam%oscillators, z, v)
         sample%stop_energy = stop%energy*exp(-stop%energy_rate*time)
         ! what a damped mode loses is what its damping takes: 2 zeta W^2 v^2 integrated
         sample%lost = [self%start_energy - sum(sample%beam_energy), stop%energy - sample%stop_energy]
         if (.not. stop%is_rigid) return
         ! the node belongs to the beam
         sample%lost = [sum(sample%lost), 0.0_wp]
         sample%beam_energy(2) = sample%beam_energy(2) + sample%stop_energy
         sample%stop_energy = 0.0_wp
      end associate
   end subroutine take_sample

   !> Energy of beam and stop at a time in the flight.
   function energy_at(self, time) result(energy)
      class(flight_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp) :: energy

      real(wp), dimension(self%beam%count) :: q, v

      call self%go_to(time, q, v)
      energy = energy_of(self, time, q, v)
   end function energy_at

   !> The same in a state.
   pure function energy_of(self, time, q, v) result(energy)
      type(flight_t), intent(in) :: self
      real(wp), intent(in) :: time
      !> Free modal state, [modes]
      real(wp), intent(in) :: q(:)
      real(wp), intent(in) :: v(:)
      real(wp) :: energy

      energy = self%stop%energy*exp(-self%stop%energy_rate*time) + 0.5_wp*sum(v**2 + self%beam%oscillators%square*q**2)
   end function energy_of

   !> Bring the motion to the end of the flight.
   subroutine finish(self, motion)
      class(flight_t), intent(inout) :: self
      type(motion_t), intent(inout) :: motion

      real(wp) :: lost

      if (abs(self%last%time - self%search%time) > 0.0_wp) then
         call self%go_to(self%search%time, motion%q, motion%v)
      else
         motion%q(:) = self%last%z
         motion%v(:) = self%last%v
      end if
      associate (ledger => motion%recorder%ledger, stop => self%stop)
         if (motion%recorder%asked%energy) then
            ledger%dissipated_beam = ledger%dissipated_beam + self%start_energy &
               - sum(modal_energy(self%beam%oscillators, motion%q, motion%v))
            lost = stop%energy*(1.0_wp - exp(-stop%energy_rate*self%search%time))
            if (stop%is_rigid) then
               ledger%dissipated_beam = ledger%dissipated_beam + lost
            else
               ledger%dissipated_stop = ledger%dissipated_stop + lost
            end if
         end if
      end associate
      ! a massless node is where it is held
      if (self%stop%is_rigid .and. self%beam%node_flexibility <= 0.0_wp) then
         call raise_to_surface(self%stop%surface, motion)
      end if
   end subroutine finish

   !> A flight that rounding let dip below the surface ends on it: a static shape brings the stop point back, as that
   !> takes the least energy, and the ledger is charged with it.
   pure subroutine raise_to_surface(surface, motion)
      !> delta
      real(wp), intent(in) :: surface
      type(motion_t), intent(inout) :: motion

      real(wp), parameter :: least = 5.0e-12_wp
      real(wp) :: dip, force

      associate (beam => motion%beam)
         dip = surface - sum(beam%stop_value*motion%q)
         if (dip < least) return
         force = dip/beam%flexibility
         call charge_event(motion%recorder%ledger, force*(sum(beam%stop_value*motion%q) + 0.5_wp*dip))
         motion%q = motion%q + beam%stop_value/beam%oscillators%square*force
      end associate
   end subroutine raise_to_surface

   !> Is it a rebound, is it loud, when is the energy spent?
   subroutine measure(self, is_last, motion)
      class(flight_t), intent(inout) :: self
      logical, intent(in) :: is_last
      type(motion_t), intent(inout) :: motion

      real(wp) :: at_end
      logical :: is_low, rises

      associate (measurer => motion%measurer, stop => self%stop, length => self%search%time)
         if (.not. measurer%is_wanted) return
         self%eta%z = self%gap%z
         self%eta%v = self%gap%v
         ! most hops are too low to be looked into again
         rises = self%search%ceiling > quiet_level
         ! where the surface is indented the gap is not what was seen
         if (abs(stop%depth) > 0.0_wp) self%trail%count = 0
         if (rises) call measure_rise(measurer, self%eta, motion%tau, length, motion%tau <= 0.0_wp, is_last, &
            self%search%greatest - merge(0.0_wp, stop%depth, stop%is_rigid), rises, self%trail)
         if (rises) call end_episode(measurer%tally)
         ! over a surface that is still indented it may stay below; no deeper than at its start
         is_low = sum(self%beam%stop_value*self%gap%z) - stop%surface < -quiet_level
         if (rises .or. is_low) call keep_loud(measurer, self%eta, motion%tau, length, is_low, &
            last_above(self%trail, quiet_level))
         if (.not. stop%is_rigid) then
            measurer%lost_stop = measurer%lost_stop - stop%energy*expm1(-stop%energy_rate*length)
         end if
         if (is_last) then
            at_end = self%energy_at(length)
         else
            at_end = energy_of(self, length, motion%q, motion%v)
         end if
         call measure_energy(self, at_end, motion)
      end associate
   end subroutine measure

   !> When a signal was last seen above a level, 0: never.
   pure function last_above(trail, level) result(time)
      !> What was seen of it
      type(trail_t), intent(in) :: trail
      real(wp), intent(in) :: level
      real(wp) :: time

      integer :: k

      time = 0.0_wp
      do k = 1, min(trail%count, most_kept)
         if (trail%look(k)%value > level) time = trail%time(k)
      end do
   end function last_above

   !> The stop point has come to the surface.
   subroutine follow(self, motion, response)
      class(flight_t), intent(inout) :: self
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      call self%stop%meet(self%search, motion, response)
   end subroutine follow

   !> exp(x) - 1 for x <= 0 without cancellation.
   elemental function expm1(x) result(value)
      !> The argument
      real(wp), intent(in) :: x
      real(wp) :: value

      ! exp(x) - 1 = tanh(x/2) (exp(x) + 1)
      value = tanh(0.5_wp*x)*(exp(x) + 1.0_wp)
   end function expm1

end module free_flight
