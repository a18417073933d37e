!> A stop of three elements, model B: the beam sinks into it from P = 0 to P = 0, and the surface that it leaves behind
!> relaxes.
module yielding_contact
   use certified_search, only: first_zero, found_never_left, search_t
   use contact_losses, only: contact_losses_t, losses_of_step, losses_until, make_contact_losses
   use contact_modes, only: contact_amplitudes, contact_modes_t, state_of_terms, terms_at
   use damped_oscillators, only: modal_energy
   use exponential_signal, only: exponential_signal_t
   use failures, only: failure_t
   use history_list, only: eta_stop, eta_tip, force_stop, velocity_stop
   use kept_contacts, only: contact_store_t, find_contact, kept_contact_t
   use kinds, only: wp
   use modal_beam, only: modal_beam_t
   use motion_phases, only: contact_t, event_at, measure_energy, motion_t
   use phase_measures, only: keep_loud, measure_force
   use response_types, only: append_event, event_contact, event_separation, quiet_level, response_t
   use run_measures, only: take_contact
   use run_recorder, only: asked_t, charge_event, sample_t
   use run_settings, only: run_settings_t
   use signal_peaks, only: exceeds
   use yielding_stop, only: yielding_stop_t
   implicit none (type, external)
   private
   public :: yielding_contact_t, make_yielding_contact

   !> Samples after which the recurrence starts anew from the closed form.
   integer, parameter :: renewal = 64

   type, extends(contact_t) :: yielding_contact_t
      type(modal_beam_t), pointer :: beam => null()
      class(yielding_stop_t), allocatable :: spring
      !> P2, the force in the branch: at the start of a contact, and of a flight
      real(wp) :: branch_force = 0.0_wp
      !> First derivative of P that does not vanish as contact begins: 1 on arrival, 2 from rest
      integer :: force_order = 1
      !> Those of runs before
      type(contact_store_t), pointer :: store => null()
      !> Exponents of the contact, found at the first one, and what they dissipate, made where it is asked for
      type(contact_modes_t), pointer :: modes => null()
      type(contact_losses_t), pointer :: losses => null()
      !> State and amplitudes at the start of a contact
      real(wp), allocatable :: q(:), v(:)
      complex(wp), allocatable :: amplitude(:)
      !> P, and its terms at the end of the contact
      type(exponential_signal_t) :: force
      complex(wp), allocatable :: end_term(:)
      !> The terms of P at the last sample, what a step makes of them, and the samples since they came from the closed
      !> form
      complex(wp), allocatable :: term(:), factor(:), rate_value(:)
      integer :: since = renewal
      !> Dissipated up to that sample in beam and stop
      real(wp) :: lost(2) = 0.0_wp
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
   end type yielding_contact_t

contains

   !> Prepare the stop of a run.
   subroutine make_yielding_contact(beam, settings, spring, store, contact)
      !> The beam in its free modes; it must outlive the contact
      type(modal_beam_t), target, intent(in) :: beam
      type(run_settings_t), intent(in) :: settings
      class(yielding_stop_t), intent(in) :: spring
      !> It must outlive the contact, too, and serve no other at the same time
      type(contact_store_t), target, intent(inout) :: store
      type(yielding_contact_t), intent(out) :: contact

      contact%beam => beam
      contact%store => store
      contact%surface = settings%stop%preload
      contact%force_scale = settings%height_ratio
      allocate (contact%spring, source=spring)
      if (contact%spring%branch_stiffness > 0.0_wp) contact%rate = contact%spring%surface_rate
      contact%energy_rate = 2.0_wp*contact%rate
      call indent(contact, 0.0_wp)
   end subroutine make_yielding_contact

   !> The surface as a force in the branch leaves it, where P = k u + P2 = 0.
   pure subroutine indent(self, branch_force)
      type(yielding_contact_t), intent(inout) :: self
      !> P2
      real(wp), intent(in) :: branch_force

      self%branch_force = branch_force
      self%depth = -branch_force/self%spring%stiffness
      self%energy = self%spring%energy(self%depth, branch_force)
   end subroutine indent

   !> The run starts at rest on the surface: the beam leaves, or the force grows from zero like the indentation.
   subroutine start(self, motion, response)
      class(yielding_contact_t), intent(inout) :: self
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      self%start_order = 2
      self%force_order = 2
      if (sum(self%beam%stop_value*self%beam%oscillators%square*motion%q) > 0.0_wp) call close_stop(self, motion, &
         response)
   end subroutine start

   !> A flight has ended: contact begins, unless the beam goes with the surface.
   subroutine meet(self, flight, motion, response)
      class(yielding_contact_t), intent(inout) :: self
      type(search_t), intent(in) :: flight
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      logical :: is_pressed

      call indent(self, self%branch_force*exp(-self%rate*flight%time))
      self%force_order = 1
      is_pressed = .true.
      if (flight%outcome == found_never_left) call follow_surface(self, motion, is_pressed)
      self%start_order = 2
      if (is_pressed) call close_stop(self, motion, response)
   end subroutine meet

   !> A flight too low to be told from none: let the stop point go with the surface, which relaxes, and see whether
   !> it is pressed on it.
   subroutine follow_surface(self, motion, is_pressed)
      type(yielding_contact_t), intent(inout) :: self
      type(motion_t), intent(inout) :: motion
      !> It is, so contact goes on
      logical, intent(out) :: is_pressed

      real(wp) :: speed, surface_speed

      associate (beam => self%beam, two_zeta => self%beam%oscillators%two_zeta)
         speed = sum(beam%stop_value*motion%v)
         surface_speed = self%rate*self%depth
         ! a surface that comes up to a slower point meets it
         is_pressed = abs(speed) < surface_speed
         if (is_pressed) return
         self%force_order = 2
         motion%v = motion%v - beam%stop_value*(speed - surface_speed)/beam%mobility
         call charge_event(motion%recorder%ledger, -0.5_wp*(speed - surface_speed)*(speed &
            + surface_speed)/beam%mobility)
         is_pressed = sum(beam%stop_value*beam%oscillators%square*(motion%q + two_zeta*motion%v)) > &
            self%rate*surface_speed
      end associate
   end subroutine follow_surface

   !> Contact begins.
   subroutine close_stop(self, motion, response)
      type(yielding_contact_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion
      type(response_t), intent(inout) :: response

      self%is_closed = .true.
      call append_event(response, event_at(motion, event_contact, self%surface))
   end subroutine close_stop

   !> Take over the state of the motion: amplitudes of the exponentials.
   subroutine begin(self, motion)
      class(yielding_contact_t), target, intent(inout) :: self
      type(motion_t), intent(inout) :: motion

      if (.not. associated(self%modes)) then
         call find_modes(self, motion%error)
         if (allocated(motion%error)) return
         motion%factorisations = motion%factorisations + 1
      end if
      if (motion%recorder%asked%energy .or. motion%measurer%is_wanted) then
         call make_contact_losses(self%beam, self%modes, self%losses, motion%recorder%asked%energy)
      end if
      associate (modes => self%modes)
         self%q = motion%q
         self%v = motion%v
         call contact_amplitudes(self%beam, modes, self%surface, self%q, self%v, self%branch_force, self%force%offset, &
            self%amplitude)
         self%force%amplitude = modes%weight*self%amplitude
         self%force%start_order = self%force_order
         self%since = renewal
      end associate
   end subroutine begin

   !> The exponents of the run, and room for their terms.
   subroutine find_modes(self, error)
      type(yielding_contact_t), intent(inout) :: self
      !> Set when they are not found
      type(failure_t), allocatable, intent(inout) :: error

      type(kept_contact_t), pointer :: kept

      call find_contact(self%beam, self%spring, self%store, kept, error)
      if (allocated(error)) return
      self%modes => kept%modes
      self%losses => kept%losses
      associate (modes => self%modes)
         allocate (self%amplitude(modes%count), self%term(modes%count), self%end_term(modes%count))
         allocate (self%rate_value, source=modes%exponent*modes%stop_value)
         allocate (self%force%exponent, source=modes%exponent)
         allocate (self%force%amplitude(modes%count))
      end associate
   end subroutine find_modes

   !> Where the force falls to zero.
   subroutine find_end(self, limit)
      class(yielding_contact_t), intent(inout) :: self
      real(wp), intent(in) :: limit

      call first_zero(self%force, limit, self%search)
   end subroutine find_end

   !> Free modal state at a time in the contact.
   subroutine go_to(self, time, q, v, node)
      class(yielding_contact_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp), intent(out) :: q(:)
      real(wp), intent(out) :: v(:)
      real(wp), optional, intent(out) :: node(2)

      if (present(node)) node = 0.0_wp
      call state_of_terms(self%beam, self%modes, self%force%offset, terms_at(self%modes, self%force%amplitude, time), &
         self%q, self%v, time, q, v)
   end subroutine go_to

   !> The next sample.
   subroutine take_sample(self, time, step, asked, sample)
      class(yielding_contact_t), intent(inout) :: self
      real(wp), intent(in) :: time
      real(wp), intent(in) :: step
      type(asked_t), intent(in) :: asked
      type(sample_t), intent(inout) :: sample

      call next_terms(self, time, step, asked%energy)
      associate (modes => self%modes, static_force => self%force%offset, history => sample%history)
         if (asked%history(eta_stop)) history(eta_stop) = &
            static_force*self%beam%flexibility - self%surface + sum(real(modes%stop_value*self%term, wp))
         if (asked%history(eta_tip)) history(eta_tip) = &
            static_force*modes%static_tip - self%surface + sum(real(modes%tip_value*self%term, wp))
         if (asked%history(velocity_stop)) history(velocity_stop) = sum(real(self%rate_value*self%term, wp))
         if (asked%history(force_stop)) history(force_stop) = &
            self%force_scale*(static_force + sum(real(self%term, wp)))
      end associate
      if (asked%energy) call take_energy(self, time, sample)
   end subroutine take_sample

   !> Its energies.
   subroutine take_energy(self, time, sample)
      type(yielding_contact_t), intent(in) :: self
      !> Since the start of the contact
      real(wp), intent(in) :: time
      type(sample_t), intent(inout) :: sample

      real(wp), dimension(self%beam%count) :: q, v

      call self%go_to(time, q, v)
      sample%beam_energy = modal_energy(self%beam%oscillators, q, v)
      sample%stop_energy = stop_energy(self, self%term)
      sample%lost = self%lost
   end subroutine take_energy

   !> How far the stop is indented. From the displacements of a beam on a hard stop it would be a rounding error.
   pure function indentation(self, term) result(depth)
      type(yielding_contact_t), intent(in) :: self
      !> Those of P at the instant, [count]
      complex(wp), intent(in) :: term(:)
      real(wp) :: depth

      depth = self%force%offset/self%spring%stiffness - sum(real(self%modes%stop_value*term, wp))
   end function indentation

   !> Energy of the stop.
   pure function stop_energy(self, term) result(energy)
      type(yielding_contact_t), intent(in) :: self
      !> Those of P at the instant, [count]
      complex(wp), intent(in) :: term(:)
      real(wp) :: energy

      energy = self%spring%energy(indentation(self, term), sum(real(self%modes%branch_value*term, wp)))
   end function stop_energy

   !> Go to a sample: from the one before by one factor a term, or from the closed form when that is due.
   subroutine next_terms(self, time, step, with_losses)
      type(yielding_contact_t), intent(inout) :: self
      !> Since the start of the contact
      real(wp), intent(in) :: time
      !> Distance of samples
      real(wp), intent(in) :: step
      !> What is dissipated is kept up, too
      logical, intent(in) :: with_losses

      real(wp) :: of_step(2)

      if (self%since >= renewal .or. (with_losses .and. size(self%modes%inactive) > 0)) then
         self%term(:) = terms_at(self%modes, self%force%amplitude, time)
         self%since = 0
         if (with_losses) call losses_until(self%beam, self%modes, self%losses, self%force%amplitude, self%q, self%v, &
            time, self%lost)
         return
      end if
      if (with_losses) then
         call losses_of_step(self%modes, step, self%losses, self%term, of_step)
         self%lost = self%lost + of_step
      end if
      if (.not. allocated(self%factor)) allocate (self%factor, source=exp(self%modes%exponent*step))
      self%term = self%term*self%factor
      self%since = self%since + 1
   end subroutine next_terms

   !> Energy of beam and stop at a time in the contact.
   function energy_at(self, time) result(energy)
      class(yielding_contact_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp) :: energy

      if (time > 0.0_wp) then
         energy = energy_of(self, terms_at(self%modes, self%force%amplitude, time), time)
      else
         energy = sum(modal_energy(self%beam%oscillators, self%q, self%v)) + stop_energy(self, self%force%amplitude)
      end if
   end function energy_at

   !> The same from the terms of P.
   function energy_of(self, term, time) result(energy)
      type(yielding_contact_t), intent(in) :: self
      complex(wp), intent(in) :: term(:)
      real(wp), intent(in) :: time
      real(wp) :: energy

      real(wp), dimension(self%beam%count) :: q, v

      call state_of_terms(self%beam, self%modes, self%force%offset, term, self%q, self%v, time, q, v)
      energy = sum(modal_energy(self%beam%oscillators, q, v)) + stop_energy(self, term)
   end function energy_of

   !> Bring the motion to the separation, where P = k u + P2 = 0.
   !>
   !> The displacements follow the indentation.
   subroutine finish(self, motion)
      class(yielding_contact_t), intent(inout) :: self
      type(motion_t), intent(inout) :: motion

      real(wp) :: depth, lost(2)

      associate (beam => self%beam, modes => self%modes, ledger => motion%recorder%ledger, length => self%search%time)
         if (motion%recorder%asked%energy) then
            call losses_until(beam, modes, self%losses, self%force%amplitude, self%q, self%v, length, lost)
            ledger%dissipated_beam = ledger%dissipated_beam + lost(1)
            ledger%dissipated_stop = ledger%dissipated_stop + lost(2)
         end if
         self%end_term(:) = terms_at(modes, self%force%amplitude, length)
         call state_of_terms(beam, modes, self%force%offset, self%end_term, self%q, self%v, length, motion%q, motion%v)
         depth = indentation(self, self%end_term)
         if (self%spring%branch_stiffness > 0.0_wp) then
            call indent(self, -self%spring%stiffness*max(depth, 0.0_wp))
         else
            call indent(self, 0.0_wp)
         end if
         motion%q = motion%q + beam%stop_value/beam%oscillators%square* &
            (((self%surface + self%branch_force/self%spring%stiffness) - sum(beam%stop_value*motion%q)) &
            /beam%flexibility)
      end associate
   end subroutine finish

   !> Its force and impulse, is it loud, and when is the energy spent?
   subroutine measure(self, is_last, motion)
      class(yielding_contact_t), intent(inout) :: self
      logical, intent(in) :: is_last
      type(motion_t), intent(inout) :: motion

      type(exponential_signal_t) :: eta
      real(wp) :: lost(2), impulse

      associate (measurer => motion%measurer, force => self%force, length => self%search%time)
         if (.not. measurer%is_wanted) return
         if (is_last) self%end_term(:) = terms_at(self%modes, force%amplitude, length)
         call measure_force(measurer%tally, force, length, self%search%greatest)
         call losses_until(self%beam, self%modes, self%losses, force%amplitude, self%q, self%v, length, lost, impulse)
         call take_contact(measurer%tally, motion%tau, length, force%offset*length + impulse, 0.0_wp)
         measurer%lost_stop = measurer%lost_stop + lost(2)
         ! the stop yields; never less than nothing, as a branch that was drawn in pulls
         if (may_sink(self)) then
            eta%offset = force%offset*self%beam%flexibility - self%surface
            allocate (eta%exponent, source=force%exponent)
            allocate (eta%amplitude, source=self%modes%stop_value*force%amplitude)
            if (sinks(eta, length)) call keep_loud(measurer, eta, motion%tau, length)
         end if
         ! beam and stop together win no energy
         if (measurer%tally%has_spent .and. .not. is_last) return
         call measure_energy(self, energy_of(self, self%end_term, length), motion)
      end associate
   end subroutine measure

   !> Could the stop point sink below the quiet level? Its terms only grow less.
   pure function may_sink(self) result(may)
      type(yielding_contact_t), intent(in) :: self
      logical :: may

      associate (term => self%modes%stop_value*self%force%amplitude)
         may = self%surface - self%force%offset*self%beam%flexibility + sum(sqrt(real(term, wp)**2 + aimag(term)**2)) &
            > quiet_level
      end associate
   end function may_sink

   !> Does the stop point sink below the quiet level?
   function sinks(eta, length) result(does)
      !> eta of the stop point
      type(exponential_signal_t), intent(in) :: eta
      !> Length of the contact
      real(wp), intent(in) :: length
      logical :: does

      type(exponential_signal_t) :: depth

      depth = eta
      depth%offset = -eta%offset
      depth%amplitude = -eta%amplitude
      does = exceeds(depth, length, quiet_level)
   end function sinks

   !> Separation.
   subroutine follow(self, motion, response)
      class(yielding_contact_t), intent(inout) :: self
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response

      call append_event(response, event_at(motion, event_separation, self%surface))
      self%is_closed = .false.
      self%start_order = 1
   end subroutine follow

end module yielding_contact
