!> A rigid stop with a coefficient of restitution, model A: the beam rebounds, and where its rebounds die out the stop
!> point is held like a pinned support until the reaction would have to pull.
module held_contact
   use certified_search, only: found_never_left, found_zero, local_t, search_t
   use damped_oscillators, only: elastic_and_viscous, modal_energy, next_sample, propagate, sampler_t
   use free_modes, only: free_modes_t
   use history_list, only: eta_tip, force_stop
   use kinds, only: wp
   use modal_beam, only: make_pinned_beam, modal_beam_t, pinned_beam_t, support_t, to_free, to_pinned
   use modal_signal, only: make_modal_signal, modal_signal_t
   use motion_phases, only: contact_t, event_at, found_taken_back, measure_energy, motion_t
   use phase_measures, only: measure_impulse
   use response_types, only: append_event, event_capture, event_impact, event_release, event_t, response_t
   use run_measures, only: early_part, take_contact
   use run_recorder, only: asked_t, charge_event, sample_t
   use run_settings, only: impulse_nodal, run_settings_t
   implicit none (type, external)
   private
   public :: held_contact_t, make_held_contact

   type, extends(contact_t) :: held_contact_t
      type(modal_beam_t), pointer :: beam => null()
      !> eps
      real(wp) :: restitution = 0.0_wp
      !> Nodal reading: (M phi_i)_c, [modes]; unallocated: the momentum reading
      real(wp), allocatable :: nodal_mass(:)
      !> A flight after a rebound that stays below this is captured
      real(wp) :: tolerance = 0.0_wp
      !> The beam held at the stop, made at the first contact; from modes made beforehand, where they fit
      type(support_t), pointer :: shared => null()
      type(pinned_beam_t) :: pinned
      !> What the stop gives the beam
      type(modal_signal_t) :: reaction
      !> It at the start of a contact
      type(local_t) :: at_start
      !> State in the pinned modes at the start of a contact and at its end, [pinned]
      real(wp), allocatable :: p(:), rate_p(:), p_end(:), rate_end(:)
      type(sampler_t) :: sampler
      !> A massless node is held so far from where the modes have it; from their displacement it were rounding alone on
      !> a fine mesh, and its spring stiff
      real(wp) :: offset = 0.0_wp
      !> Energy of the static shape, and of the pinned modes at the start
      real(wp) :: static_energy = 0.0_wp
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
      procedure :: start
      procedure :: meet
   end type held_contact_t

contains

   !> Prepare the stop of a run.
   subroutine make_held_contact(beam, modes, settings, contact)
      !> The beam in its free modes, and all that runs of it share; they must outlive the contact
      type(modal_beam_t), target, intent(in) :: beam
      type(free_modes_t), target, intent(in) :: modes
      type(run_settings_t), intent(in) :: settings
      type(held_contact_t), intent(out) :: contact

      contact%beam => beam
      contact%shared => modes%support
      contact%surface = settings%stop%preload
      contact%force_scale = settings%height_ratio
      contact%is_rigid = .true.
      contact%restitution = settings%stop%restitution
      contact%tolerance = settings%response%hop_tolerance
      if (settings%stop%impulse == impulse_nodal) allocate (contact%nodal_mass, source=modes%nodal_mass(:beam%count))
      if (settings%zeta > 0.0_wp) then
         call leave_node(contact, beam%node_flexibility*(1.0_wp + settings%stop%preload)/beam%flexibility)
      end if
   end subroutine make_held_contact

   !> A massless node is let go: force and damping of its spring balance, and it comes back to where the modes would
   !> have it; at once where nothing damps it.
   pure subroutine leave_node(self, displacement)
      type(held_contact_t), intent(inout) :: self
      !> From there
      real(wp), intent(in) :: displacement

      associate (beam => self%beam, two_zeta => self%beam%oscillators%two_zeta)
         if (beam%node_flexibility <= 0.0_wp .or. two_zeta <= 0.0_wp) return
         self%depth = displacement
         self%rate = 1.0_wp/two_zeta
         self%energy = 0.5_wp*displacement**2/beam%node_flexibility
         self%energy_rate = 2.0_wp*self%rate
      end associate
   end subroutine leave_node

   !> The run starts on the surface.
   subroutine start(self, motion, response)
      class(held_contact_t), intent(inout) :: self
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      if (self%beam%node_flexibility > 0.0_wp) then
         call hold_node(self, self%surface - sum(self%beam%stop_value*motion%q), motion, response)
      else
         call capture(self, motion, response)
      end if
      self%hop_tolerance = 0.0_wp
   end subroutine start

   !> A flight has ended: impact, or capture.
   subroutine meet(self, flight, motion, response)
      class(held_contact_t), intent(inout) :: self
      type(search_t), intent(in) :: flight
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      if (self%beam%node_flexibility > 0.0_wp) then
         call hold_node(self, &
            self%depth*exp(-self%rate*merge(0.0_wp, flight%time, flight%outcome == found_taken_back)), &
            motion, response)
      else if (flight%outcome == found_zero) then
         call rebound(self, motion, response)
      else if (flight%outcome == found_never_left .and. self%start_order > 1) then
         ! from rest: what would lift it is lost in the rounding error of the displacement, so it is pressed
         call capture(self, motion, response, is_pressed=.true.)
      else
         call capture(self, motion, response)
      end if
      self%hop_tolerance = merge(self%tolerance, 0.0_wp, self%start_order == 1)
   end subroutine meet

   !> The velocity of the stop point becomes -eps times what it was.
   subroutine rebound(self, motion, response)
      type(held_contact_t), intent(inout) :: self
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      type(event_t) :: event
      real(wp) :: kinetic

      event = event_at(motion, event_impact, self%surface)
      event%velocity_before = min(event%velocity_before, 0.0_wp)
      event%velocity_after = -self%restitution*event%velocity_before
      associate (v => motion%v, beam => self%beam)
         if (allocated(self%nodal_mass)) then
            kinetic = 0.5_wp*sum(v**2)
            v = v + self%nodal_mass*(event%velocity_after - event%velocity_before)
            event%energy_change = 0.5_wp*sum(v**2) - kinetic
            event%impulse = sum(self%nodal_mass**2)*(event%velocity_after - event%velocity_before)
         else
            event%impulse = (event%velocity_after - event%velocity_before)/beam%mobility
            v = v + beam%stop_value*event%impulse
            event%energy_change = -0.5_wp*(1.0_wp - self%restitution**2)*event%velocity_before**2/beam%mobility
         end if
      end associate
      call append_event(response, event)
      call measure_impulse(motion%measurer, motion%tau, event%impulse)
      call charge_event(motion%recorder%ledger, event%energy_change)
      self%start_order = 1
      if (.not. event%velocity_after > 0.0_wp) call capture(self, motion, response)
   end subroutine rebound

   !> A massless node is held at once: there is no impact.
   subroutine hold_node(self, offset, motion, response)
      type(held_contact_t), intent(inout) :: self
      !> It is so far from where the modes have it
      real(wp), intent(in) :: offset
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      type(event_t) :: event

      event = event_at(motion, event_capture, self%surface)
      ! it was coming back to them
      event%velocity_before = event%velocity_before - self%rate*offset
      event%eta = 0.0_wp
      event%velocity_after = 0.0_wp
      self%is_closed = .true.
      self%offset = offset
      self%start_order = 0
      self%depth = 0.0_wp
      self%energy = 0.0_wp
      call append_event(response, event)
      call measure_impulse(motion%measurer, motion%tau, event%impulse)
   end subroutine hold_node

   !> Bring the stop point to rest and, if it is pressed against the stop, hold it; else it is released at once.
   subroutine capture(self, motion, response, is_pressed)
      type(held_contact_t), intent(inout) :: self
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response
      !> It is known to be pressed against the stop; default: find out
      logical, intent(in), optional :: is_pressed

      type(event_t) :: event

      associate (beam => self%beam)
         event = event_at(motion, event_capture, self%surface)
         event%velocity_after = 0.0_wp
         event%impulse = -event%velocity_before/beam%mobility
         event%energy_change = -0.5_wp*event%velocity_before**2/beam%mobility
         call charge_event(motion%recorder%ledger, event%energy_change)
         motion%v = motion%v + beam%stop_value*event%impulse
         self%start_order = leaving_order(beam, motion%q, motion%v)
      end associate
      if (present(is_pressed)) self%start_order = merge(0, self%start_order, is_pressed)
      self%is_closed = self%start_order == 0
      ! with no impulse given (eps = 0, a start at rest) and none to hold it there was no capture to speak of
      if (.not. (self%is_closed .or. abs(event%velocity_before) > 0.0_wp)) return
      call append_event(response, event)
      call measure_impulse(motion%measurer, motion%tau, event%impulse)
      if (.not. self%is_closed) call append_event(response, event_t(tau=motion%tau, kind=event_release))
   end subroutine capture

   !> Which way a stop point at rest on the stop goes: the order of the first derivative of the gap that is
   !> certainly positive if it leaves (2: the support would have to pull; 3: its force vanishes and falls), or
   !> 0 if it is pressed against the stop.
   pure function leaving_order(beam, q, v) result(order)
      type(modal_beam_t), intent(in) :: beam
      !> Modal state, [modes]
      real(wp), intent(in) :: q(:)
      real(wp), intent(in) :: v(:)
      integer :: order

      real(wp), dimension(beam%count) :: weight, held
      real(wp) :: force, noise

      associate (two_zeta => beam%oscillators%two_zeta)
         weight = beam%stop_value*beam%oscillators%square
         force = sum(weight*(q + two_zeta*v))
         noise = 4.0_wp*epsilon(1.0_wp)*sum(abs(weight)*(abs(q) + two_zeta*abs(v)))
         order = 0
         if (force < -noise) then
            order = 2
         else if (force <= noise) then
            ! the force as it changes under the support
            held = beam%stop_value*force/beam%mobility - beam%oscillators%square*(q + two_zeta*v)
            if (sum(weight*(v + two_zeta*held)) < 0.0_wp) order = 3
         end if
      end associate
   end function leaving_order

   !> Take over the state of the motion: static shape of the surface and pinned modes.
   subroutine begin(self, motion)
      class(held_contact_t), target, intent(inout) :: self
      type(motion_t), intent(inout) :: motion

      associate (pinned => self%pinned, two_zeta => self%beam%oscillators%two_zeta)
         if (.not. pinned%made) then
            call make_pinned_beam(self%beam, 0.5_wp*two_zeta, self%shared, pinned)
            motion%factorisations = motion%factorisations + 1
            call make_modal_signal(self%pinned%oscillators, self%surface*pinned%static_force, pinned%reaction, &
               self%reaction)
            self%reaction%is_viscous = .true.
            self%static_energy = 0.5_wp*self%surface**2*pinned%static_force
            allocate (self%p_end(pinned%count), self%rate_end(pinned%count))
         end if
         self%p = to_pinned(pinned, self%beam%oscillators%square, &
            self%surface*pinned%static_force*self%beam%node_flexibility - self%offset, &
            motion%q - self%surface*pinned%static)
         self%rate_p = matmul(motion%v, pinned%mode)
         ! p + 2 zeta p' swings like p itself
         self%reaction%z = self%p + two_zeta*self%rate_p
         self%reaction%v = self%rate_p - two_zeta*pinned%oscillators%square*self%reaction%z
         associate (first => pinned%oscillators%blended + 1)
            self%reaction%z(first:) = self%p(first:)
            self%reaction%v(first:) = self%rate_p(first:)
         end associate
         self%reaction%start_order = 0
         call self%reaction%look(0.0_wp, 0, self%at_start)
         if (self%at_start%value <= self%at_start%rounding) self%reaction%start_order = 1
         call self%sampler%restart()
         if (motion%recorder%asked%energy) self%start_energy = &
            sum(modal_energy(pinned%oscillators, self%p, self%rate_p))
      end associate
   end subroutine begin

   !> Where the reaction falls to zero.
   subroutine find_end(self, limit)
      class(held_contact_t), intent(inout) :: self
      real(wp), intent(in) :: limit

      call self%reaction%find_zero(limit, self%search, at_start=self%at_start)
   end subroutine find_end

   !> Free modal state at a time in the contact.
   subroutine go_to(self, time, q, v, node)
      class(held_contact_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp), intent(out) :: q(:)
      real(wp), intent(out) :: v(:)
      real(wp), optional, intent(out) :: node(2)

      real(wp), dimension(self%pinned%count) :: p, rate_p

      call propagate(self%pinned%oscillators, time, self%p, self%rate_p, p, rate_p)
      q = self%surface*self%pinned%static + matmul(self%pinned%mode, p)
      v = matmul(self%pinned%mode, rate_p)
      if (.not. present(node)) return
      node = 0.0_wp
      if (self%beam%node_flexibility > 0.0_wp) then
         node = [self%surface - sum(self%beam%stop_value*q), -sum(self%beam%stop_value*v)]
      end if
   end subroutine go_to

   !> The next sample.
   subroutine take_sample(self, time, step, asked, sample)
      class(held_contact_t), intent(inout) :: self
      real(wp), intent(in) :: time
      real(wp), intent(in) :: step
      type(asked_t), intent(in) :: asked
      type(sample_t), intent(inout) :: sample

      call next_sample(self%sampler, self%pinned%oscillators, self%p, self%rate_p, step, time)
      associate (pinned => self%pinned, z => self%sampler%z, v => self%sampler%v)
         if (asked%history(eta_tip)) then
            sample%history(eta_tip) = self%surface*pinned%static_tip - self%surface + sum(pinned%tip_value*z)
         end if
         if (asked%history(force_stop)) sample%history(force_stop) = self%force_scale* &
            (self%reaction%offset + sum(pinned%reaction*elastic_and_viscous(pinned%oscillators, z, v, time, &
            self%p, self%rate_p)))
         if (.not. asked%energy) return
         sample%beam_energy = modal_energy(pinned%oscillators, z, v)
         sample%lost = [self%start_energy - sum(sample%beam_energy), 0.0_wp]
         ! static shape and pinned modes are orthogonal in K
         sample%beam_energy(2) = sample%beam_energy(2) + self%static_energy
      end associate
   end subroutine take_sample

   !> Energy of the beam at a time in the contact.
   function energy_at(self, time) result(energy)
      class(held_contact_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp) :: energy

      real(wp), dimension(self%pinned%count) :: p, rate_p

      call propagate(self%pinned%oscillators, time, self%p, self%rate_p, p, rate_p)
      energy = self%static_energy + 0.5_wp*sum(rate_p**2 + self%pinned%oscillators%square*p**2)
   end function energy_at

   !> Bring the motion to the release.
   subroutine finish(self, motion)
      class(held_contact_t), intent(inout) :: self
      type(motion_t), intent(inout) :: motion

      associate (pinned => self%pinned, beam => self%beam, ledger => motion%recorder%ledger)
         call propagate(pinned%oscillators, self%search%time, self%p, self%rate_p, self%p_end, self%rate_end)
         if (motion%recorder%asked%energy) then
            ledger%dissipated_beam = ledger%dissipated_beam + self%start_energy &
               - sum(modal_energy(pinned%oscillators, self%p_end, self%rate_end))
         end if
         motion%q = self%surface*pinned%static + to_free(pinned, beam%oscillators%square, beam%stop_value, self%p_end)
         motion%v = matmul(pinned%mode, self%rate_end)
      end associate
   end subroutine finish

   !> Its impulse, and when is the energy spent?
   subroutine measure(self, is_last, motion)
      class(held_contact_t), intent(inout) :: self
      logical, intent(in) :: is_last
      type(motion_t), intent(inout) :: motion

      real(wp), dimension(self%pinned%count) :: p_then, rate_then
      real(wp) :: at_end, early, early_impulse

      associate (measurer => motion%measurer, pinned => self%pinned, length => self%search%time)
         if (.not. measurer%is_wanted) return
         early = early_part(measurer%tally, motion%tau, length)
         early_impulse = 0.0_wp
         if (early > 0.0_wp) then
            call propagate(pinned%oscillators, early, self%p, self%rate_p, p_then, rate_then)
            early_impulse = impulse_until(self, early, rate_then)
         end if
         if (is_last) call propagate(pinned%oscillators, length, self%p, self%rate_p, self%p_end, self%rate_end)
         call take_contact(measurer%tally, motion%tau, length, impulse_until(self, length, self%rate_end), &
            early_impulse)
         at_end = self%static_energy + 0.5_wp*sum(self%rate_end**2 + pinned%oscillators%square*self%p_end**2)
         call measure_energy(self, at_end, motion)
      end associate
   end subroutine measure

   !> Integral of the reaction: a mode's part, p + 2 zeta p', is -p''/w^2.
   pure function impulse_until(self, time, rate_then) result(impulse)
      type(held_contact_t), intent(in) :: self
      !> Since the start of the contact
      real(wp), intent(in) :: time
      !> p' there, [pinned]
      real(wp), intent(in) :: rate_then(:)
      real(wp) :: impulse

      impulse = self%surface*self%pinned%static_force*time &
         + sum(self%pinned%reaction*(self%rate_p - rate_then)/self%pinned%square)
   end function impulse_until

   !> Release.
   subroutine follow(self, motion, response)
      class(held_contact_t), intent(inout) :: self
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      call append_event(response, event_t(tau=motion%tau, kind=event_release))
      self%is_closed = .false.
      self%hop_tolerance = 0.0_wp
      self%start_order = 3
      if (self%beam%node_flexibility <= 0.0_wp) return
      ! its own damping lets the node go smoothly, without it the node leaves at the modes' velocity
      self%start_order = merge(2, 1, self%beam%oscillators%two_zeta > 0.0_wp)
      call leave_node(self, self%beam%node_flexibility*(self%surface*self%pinned%static_force &
         + sum(self%pinned%reaction*self%p_end)))
   end subroutine follow

end module held_contact
