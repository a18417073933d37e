!> The present phase (motion between two events): closed contacts, modes, ending signals (docs/theory.md, section 17).
module phase_state
   use applied_loads, only: applied_loads_t
   use certified_search, only: search_history_t, transformable_signal_t
   use compliant_stop, only: dynamic_stiffness_t, is_rigid_stop
   use constrained_sets, only: free_beam_t, to_constrained_modes, to_free_modes
   use contact_sets, only: contact_set_t, find_set, start_sets, set_store_t
   use contact_states, only: dynamic_stiffness_of, reactions_t, contact_state_t
   use coupled_modes, only: coupled_amplitudes
   use damped_oscillators, only: acceleration, padded, propagate
   use driven_signal, only: add_terms, driven_terms_t
   use exponential_signal, only: add_decay, exponential_signal_t
   use failures, only: failure_t
   use forced_responses, only: find_rows_at, make_unit_responses, forced_response_t, start_forced_response
   use kinds, only: wp
   use load_courses, only: load_segment_at, load_segment_t
   use modal_signal, only: make_modal_signal, modal_signal_t, set_reaction_state, set_state
   use row_integrals, only: row_interval_terms_t
   use row_signals, only: row_path_t
   use set_motions, only: state_in, state_of_terms
   use summed_signal, only: summed_signal_t
   use surrogate_loads, only: forced_terms
   implicit none (type, external)
   private
   public :: phase_state_t, open_set_store, start_phase, find_load, signal_of, find_gap_signal, cache_state
   public :: driven_terms, find_state, find_homogeneous_state, to_free_state, force_terms
   public :: end_gap, end_force, end_undeformed, end_renewed_contact, observed_gap, observed_tip

   ! The following constants are kinds of signals. A zero of an `end_` signal ends the phase.
   !> Gap of an open contact.
   integer, parameter :: end_gap = 1
   !> Force of a closed contact.
   integer, parameter :: end_force = 2
   !> Indentation of an open contact that has not yet recovered its undeformed surface.
   integer, parameter :: end_undeformed = 3
   !> Negative of the force that an open contact with an indentation would have if it were closed.
   integer, parameter :: end_renewed_contact = 4
   !> Gap to the undeformed contact.
   integer, parameter :: observed_gap = 5
   !> Displacement of the tip.
   integer, parameter :: observed_tip = 6

   !> The beam in its free modes, the states of its contacts, and the present phase of its motion.
   type :: phase_state_t
      type(free_beam_t) :: beam
      type(contact_state_t), allocatable :: states(:)
      !> Index of the release contact, the reference of histories and measures even without a release; 0: none
      integer :: release_contact = 1
      !> Store of contact sets, which later runs use as well
      type(set_store_t), pointer :: store => null()
      !> Contact set of the present phase: its closed contacts, with the constrained modes
      type(contact_set_t), pointer :: set => null()
      !> State z, v of the constrained modes at the start of the phase, homogeneous part, stored in `set`, [modes]
      real(wp), pointer, contiguous :: z(:) => null(), v(:) => null()
      !> Indentation of a massless node (`is_node` of its contact) at the start of the phase
      real(wp) :: node_depth = 0.0_wp
      !> Loads on the beam; none: `count` = 0
      type(applied_loads_t) :: loads
      !> Load response in the present phase
      type(forced_response_t) :: forced
      !> Whether the beam does not move until loads change
      logical :: is_at_rest = .false.
      !> Reactions of rigid contacts at the last transition between phases
      type(reactions_t) :: reactions
      !> Maximum length of the phase, the end of the load segments
      real(wp) :: max_length = huge(1.0_wp)
      !> Modal loads at the instant of `find_load`, and their rates d/dtau, [free modes]
      real(wp), allocatable :: load(:), load_rate(:)
      !> Values of the terms exp(s t) at the start of a phase with closed compliant contacts, [terms]
      complex(wp), allocatable :: amplitude(:)
      !> The signal that `signal_of` returned last
      class(transformable_signal_t), allocatable :: signal
      !> The last force signal that was searched in the phase
      class(transformable_signal_t), allocatable :: force_signal
      !> Index of the contact of `force_signal`; 0: none was searched
      integer :: force_signal_at = 0
      !> History of the search of the gap that ends the phase at a rigid contact
      type(search_history_t) :: history
      !> Index of the contact of `history`; 0: none
      integer :: history_of = 0
      !> Index of the first contact at the same point of the beam, which may be the contact itself, [contacts]
      integer, allocatable :: colocated(:)
      !> 1: the contact and `colocated` are on the same side of the beam; -1: on opposite sides, [contacts]
      real(wp), allocatable :: colocated_sign(:)
      !> Whether the phase goes on when an open contact becomes undeformed
      logical :: passes_undeformed = .false.
      !> Whether observers request extremes of rows in each phase, which the path of the simultaneous search gives
      logical :: needs_extremes = .false.
      !> Time in the phase at which each contact becomes undeformed, [contacts]
      real(wp), allocatable :: undeformed_at(:)
      !> Steps of the simultaneous search of all contacts
      type(row_path_t) :: path
      !> Terms of the output rows over the interval of the phase that was integrated last
      type(row_interval_terms_t) :: span
   end type phase_state_t

contains

   !> Prepare the store of contact sets for the contacts of a run. Beam and contact states are already set.
   subroutine open_set_store(self, store)
      type(phase_state_t), intent(inout) :: self
      type(set_store_t), target, intent(inout) :: store

      integer :: j, k

      call start_sets(self%beam, self%states%is_rigid, &
         [(dynamic_stiffness_of(self%states(k)), k=1, size(self%states))], store)
      self%store => store
      allocate (self%forced%frequency(0), self%undeformed_at(size(self%states)))
      self%colocated = [(k, k=1, size(self%states))]
      self%colocated_sign = [(1.0_wp, k=1, size(self%states))]
      do k = 1, size(self%states)
         do j = 1, k - 1
            associate (b => self%beam%value)
               if (any(abs(b(:, j) - b(:, k)) > 0.0_wp) .and. any(abs(b(:, j) + b(:, k)) > 0.0_wp)) cycle
               if (any(abs(b(:, j) - b(:, k)) > 0.0_wp)) self%colocated_sign(k) = -1.0_wp
            end associate
            self%colocated(k) = j
            exit
         end do
      end do
   end subroutine open_set_store

   !> Start a phase at time tau with the set of contacts that are closed now.
   subroutine start_phase(self, tau, q, v, is_new, error)
      type(phase_state_t), target, intent(inout) :: self
      real(wp), intent(in) :: tau
      !> Displacements q and velocities v of the free modes, [free modes]
      real(wp), contiguous, intent(in) :: q(:), v(:)
      !> Whether the run uses the set for the first time
      logical, intent(out) :: is_new
      type(failure_t), allocatable, intent(inout) :: error

      real(wp), dimension(size(self%states)) :: indentation, branch_force
      ! velocities of the stop points at the compliant contacts; unallocated: none of them is rigid
      real(wp), allocatable :: velocity(:)
      integer :: k

      self%force_signal_at = 0
      self%history_of = 0
      self%path%is_begun = .false.
      self%path%is_complete = .false.
      self%undeformed_at(:) = huge(1.0_wp)
      self%node_depth = sum(self%states%indentation, mask=self%states%is_node)
      call find_set(self%states%is_closed, self%store, self%set, is_new, error)
      if (allocated(error)) return
      self%z => self%set%state(:, 1)
      self%v => self%set%state(:, 2)
      self%set%last%time = -1.0_wp
      associate (constrained => self%set%constrained, coupled => self%set%coupled, compliant => self%set%compliant)
         call to_constrained_modes(self%beam, constrained, q, v, self%z, self%v)
         indentation = self%states%indentation
         branch_force = self%states%branch_force
         if (self%loads%count > 0) call start_load_response(self, tau, is_new, indentation, branch_force)
         if (size(compliant) > 0) then
            if (any(is_rigid_stop(coupled%spring))) velocity = merge(0.0_wp, matmul(self%v, constrained%value(:, &
               compliant)), is_rigid_stop(coupled%spring))
            if (.not. allocated(self%amplitude)) allocate (self%amplitude(coupled%count))
            if (size(self%amplitude) /= coupled%count) self%amplitude = spread((0.0_wp, 0.0_wp), 1, coupled%count)
            call coupled_amplitudes(constrained%oscillators%square, coupled, -constrained%static_gap(compliant), &
               indentation(compliant), branch_force(compliant), self%z, self%v, self%amplitude, &
               velocity)
            self%amplitude = coupled%weight*self%amplitude
         else
            do k = 1, size(constrained%closed)
               call set_reaction_state(self%z, self%v, constrained%force(k))
            end do
         end if
      end associate
   end subroutine start_phase

   !> Find the modal loads at an instant, after the jump if they jump at the instant.
   pure subroutine find_load(self, tau)
      type(phase_state_t), intent(inout) :: self
      real(wp), intent(in) :: tau

      type(load_segment_t) :: segment
      integer :: g

      self%load(:) = 0.0_wp
      self%load_rate(:) = 0.0_wp
      do g = 1, self%loads%count
         segment = load_segment_at(self%loads%course(g), tau)
         self%load(:) = self%load + self%loads%mode(:, g)*(segment%constant + real(segment%harmonic, wp))
         self%load_rate(:) = self%load_rate + self%loads%mode(:, g)*(segment%slope &
            - segment%frequency*aimag(segment%harmonic))
      end do
   end subroutine find_load

   !> Start the load response of a phase, and subtract it from the initial state: the homogeneous part remains.
   subroutine start_load_response(self, tau, is_new, indentation, branch_force)
      type(phase_state_t), intent(inout) :: self
      real(wp), intent(in) :: tau
      !> Whether the run uses the set for the first time: unit responses of an earlier run are not valid
      logical, intent(in) :: is_new
      !> Indentation and branch force of each contact, [contacts]
      real(wp), intent(inout) :: indentation(:), branch_force(:)

      type(dynamic_stiffness_t) :: spring(size(self%states))
      ! the rows before that of the tip, and their rates
      real(wp), dimension(size(self%z) + 4*size(self%states)) :: rows, rates
      integer :: k

      associate (set => self%set)
         if (is_new .and. allocated(set%forced)) deallocate (set%forced)
         if (is_new) allocate (set%forced)
         if (set%forced%has_slow_terms) spring = [(dynamic_stiffness_of(self%states(k)), k=1, size(self%states))]
         if (is_new) call make_unit_responses(self%beam, set%constrained, set%compliant, spring, self%loads, set%forced)
         call start_forced_response(set%forced, set%constrained%oscillators, self%loads, tau, self%forced)
         if (set%forced%has_slow_terms) call forced_terms(set%constrained, set%coupled, set%compliant, spring, &
            self%loads, is_new, set%forced, self%forced)
         self%max_length = self%forced%until - tau
      end associate
      call find_rows_at(self%set%forced, self%forced, 1, size(rows), 0.0_wp, rows, rates, &
         [((1.0_wp, 0.0_wp), k=1, size(self%forced%frequency))])
      self%z(:) = self%z - rows(:size(self%z))
      self%v(:) = self%v - rates(:size(self%v))
      associate (at => self%set%forced%at)
         indentation = indentation - rows(at%indentations + 1:at%branches)
         branch_force = branch_force - rows(at%branches + 1:at%tip)
      end associate
   end subroutine start_load_response

   !> A signal of a contact in the present phase, valid until the next call.
   subroutine signal_of(self, k, kind, signal)
      type(phase_state_t), target, intent(inout) :: self
      integer, intent(in) :: k
      !> One of the `end_` or `observed_` constants, here and in the procedures below
      integer, intent(in) :: kind
      class(transformable_signal_t), pointer, intent(out) :: signal

      class(transformable_signal_t), allocatable :: made
      type(modal_signal_t), pointer :: gap
      type(driven_terms_t) :: terms

      if (size(self%set%compliant) > 0) then
         call exponential_of(self, k, kind, made)
         if (size(self%set%coupled%inactive) > 0) call add_inactive_modes(self, k, kind, made)
      else if (kind == end_gap .or. kind == observed_gap) then
         call find_gap_signal(self, k, gap)
         ! the gap to the stop includes the displacement of the massless node
         if (self%states(k)%is_node .and. kind == observed_gap) then
            if (self%states(k)%spring%recovery_rate < huge(1.0_wp)) then
               gap%relaxation = self%node_depth
               gap%rate = self%states(k)%spring%recovery_rate
            end if
         end if
         signal => gap
         if (self%loads%count == 0) return
         allocate (made, source=gap)
      else
         call modal_signal_of(self, k, kind, made)
      end if
      if (self%loads%count > 0) then
         call driven_terms(self, k, kind, terms)
         call add_terms(terms, self%max_length, made)
      end if
      call move_alloc(made, self%signal)
      signal => self%signal
   end subroutine signal_of

   !> The homogeneous part of a gap in the present phase as a signal, if no compliant contact is closed.
   subroutine find_gap_signal(self, k, gap)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      type(modal_signal_t), pointer, intent(out) :: gap

      gap => self%set%constrained%gap(k)
      if (self%loads%count > 0) then
         select type (free => self%set%forced%gap(k)%free)
         type is (modal_signal_t)
            gap => free
         end select
      end if
      call set_state(self%z, self%v, gap)
      gap%start_order = 0
      gap%rate = 0.0_wp
      gap%relaxation = 0.0_wp
      gap%last => null()
   end subroutine find_gap_signal

   !> Contribution of the load response to a signal: a factor times an output row plus another factor times its rate.
   subroutine driven_terms(self, k, kind, terms)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k, kind
      type(driven_terms_t), intent(inout) :: terms

      real(wp) :: factor, rate_factor
      integer :: i, row

      factor = merge(-1.0_wp, 1.0_wp, kind == end_undeformed)
      rate_factor = 0.0_wp
      if (kind == end_renewed_contact) then
         factor = self%states(k)%spring%stiffness
         rate_factor = self%states(k)%spring%viscosity
      end if
      associate (set => self%set%forced, forced => self%forced)
         row = set%at%gaps + k
         if (kind == end_force) row = set%at%forces + k
         if (kind == observed_tip) row = set%at%tip + 1
         terms%constant = factor*forced%constant(row) + rate_factor*forced%slope(row)
         terms%slope = factor*forced%slope(row)
         terms%frequency = forced%frequency
         terms%harmonic = cmplx(factor, rate_factor*forced%frequency, wp)*forced%harmonic(row, :)
         terms%modes = size(forced%pair)
         if (terms%modes == 0) return
         terms%mode = forced%mode
         terms%weight = [(factor*set%driven(forced%pair(i))%row(row), i=1, size(forced%pair))]
         terms%weight_of_rate = [(factor*set%driven(forced%pair(i))%row_of_rate(row) &
            + rate_factor*set%driven(forced%pair(i))%row(row), i=1, size(forced%pair))]
      end associate
   end subroutine driven_terms

   !> A signal other than a gap as a sum over modes.
   subroutine modal_signal_of(self, k, kind, signal)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k, kind
      class(transformable_signal_t), allocatable, intent(out) :: signal

      type(modal_signal_t), allocatable :: modal

      associate (constrained => self%set%constrained, n => self%set%constrained%count)
         allocate (modal)
         select case (kind)
         case (end_force)
            modal = constrained%force(findloc(constrained%closed, k, dim=1))
         case (observed_tip)
            call make_modal_signal(constrained%oscillators, constrained%static_tip, constrained%tip_value, modal)
            call set_state(self%z, self%v, modal)
         case (end_renewed_contact)
            associate (stiff => self%states(k)%spring%stiffness, viscous => self%states(k)%spring%viscosity)
               call make_modal_signal(constrained%oscillators, stiff*constrained%static_gap(k), constrained%value(:, &
                  k), modal)
               modal%z(:n) = stiff*self%z + viscous*self%v
               modal%v(:n) = stiff*self%v + viscous*acceleration(constrained%oscillators, self%z, self%v)
            end associate
         case default
            call make_modal_signal(constrained%oscillators, -constrained%static_gap(k), -constrained%value(:, k), modal)
            call set_state(self%z, self%v, modal)
         end select
      end associate
      call move_alloc(modal, signal)
   end subroutine modal_signal_of

   !> A signal as a sum of exponential terms if a compliant contact is closed.
   subroutine exponential_of(self, k, kind, signal)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k, kind
      class(transformable_signal_t), allocatable, intent(out) :: signal

      type(exponential_signal_t), allocatable :: sum

      allocate (sum)
      associate (set => self%set, state => self%states(max(k, 1)), exponent => self%set%coupled%exponent)
         allocate (sum%exponent, source=exponent)
         select case (kind)
         case (end_force, observed_tip)
            call force_terms(self, merge(0, k, kind == observed_tip), self%amplitude, sum%offset, sum%amplitude)
         case (end_renewed_contact)
            sum%offset = state%spring%stiffness*set%rest_gap(k)
            allocate (sum%amplitude, source=(state%spring%stiffness + state%spring%viscosity*exponent) &
               *set%gap(k, :)*self%amplitude)
         case (end_undeformed)
            sum%offset = -set%rest_gap(k)
            allocate (sum%amplitude, source=-set%gap(k, :)*self%amplitude)
         case default
            sum%offset = set%rest_gap(k)
            allocate (sum%amplitude, source=set%gap(k, :)*self%amplitude)
            if (kind == end_gap .and. state%indentation > 0.0_wp &
               .and. .not. state%moves_with_beam) call add_decay(state%indentation, state%spring%recovery_rate, sum)
         end select
      end associate
      call move_alloc(sum, signal)
   end subroutine exponential_of

   !> Add the motion of the modes that vanish at all compliant contacts, which are not among the terms of the set.
   subroutine add_inactive_modes(self, k, kind, signal)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k, kind
      class(transformable_signal_t), allocatable, intent(inout) :: signal

      class(transformable_signal_t), allocatable :: modes
      type(summed_signal_t), allocatable :: total
      real(wp) :: sign
      ! with padding
      logical :: is_inactive(padded(size(self%z)))

      if (kind == end_force .and. all(self%set%constrained%closed /= k)) return
      is_inactive = .false.
      is_inactive(self%set%coupled%inactive) = .true.
      call modal_signal_of(self, k, kind, modes)
      select type (modes)
      type is (modal_signal_t)
         if (kind == end_force) call set_reaction_state(self%z, self%v, modes)
         if (.not. any(is_inactive .and. abs(modes%weight) > 0.0_wp)) return
         modes%offset = 0.0_wp
         ! `modal_signal_of` gives minus the gap
         sign = merge(-1.0_wp, 1.0_wp, kind == end_gap .or. kind == observed_gap)
         call set_state(sign*merge(modes%z, 0.0_wp, is_inactive), sign*merge(modes%v, 0.0_wp, is_inactive), modes)
      end select
      allocate (total)
      call move_alloc(signal, total%first)
      call move_alloc(modes, total%second)
      call move_alloc(total, signal)
   end subroutine add_inactive_modes

   !> Force of closed contact k (k = 0: displacement of the tip) as offset plus terms, if a compliant contact is closed.
   pure subroutine force_terms(self, k, factor, offset, amplitude)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      !> Amplitudes of the terms exp(s t), or the integrals of the terms with these amplitudes, [terms]
      complex(wp), intent(in) :: factor(:)
      real(wp), intent(out) :: offset
      !> Amplitudes of the result, [terms]
      complex(wp), allocatable, intent(out) :: amplitude(:)

      integer :: place

      associate (set => self%set)
         place = findloc(set%compliant, k, dim=1)
         if (k == 0) then
            offset = set%constrained%static_tip + sum(set%constrained%tip_value*set%rest_modes)
            allocate (amplitude, source=matmul(set%constrained%tip_value, set%coupled%shape)*factor)
         else if (place > 0) then
            offset = set%rest_force(place)
            allocate (amplitude, source=set%coupled%force(place, :)*factor)
         else
            place = findloc(set%constrained%closed, k, dim=1)
            offset = set%rest_reaction(place)
            allocate (amplitude, source=set%reaction(place, :)*factor)
         end if
      end associate
   end subroutine force_terms

   !> Cache the homogeneous part of the state at a time in the phase.
   subroutine cache_state(self, time, term)
      type(phase_state_t), intent(in) :: self
      real(wp), intent(in) :: time
      !> Values of the terms exp(s t) if a compliant contact is closed, [terms]
      complex(wp), intent(in) :: term(:)

      associate (set => self%set)
         if (size(set%compliant) == 0) then
            call find_homogeneous_state(self, time, set%last%z, set%last%v)
         else
            call state_of_terms(set, term, self%z, self%v, time, set%last%z, set%last%v)
         end if
         set%last%time = time
      end associate
   end subroutine cache_state

   !> State of the constrained modes at a time in the phase.
   pure subroutine find_state(self, time, z, v, phasor)
      type(phase_state_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp), contiguous, intent(out) :: z(:), v(:)
      !> exp(i w t) of the load frequencies w if already known, [harmonics]
      complex(wp), intent(in), optional :: phasor(:)

      real(wp), dimension(size(z)) :: rows, rates

      call find_homogeneous_state(self, time, z, v)
      if (self%loads%count == 0) return
      call find_rows_at(self%set%forced, self%forced, 1, size(z), time, rows, rates, phasor)
      z(:) = z + rows
      v(:) = v + rates
   end subroutine find_state

   !> Homogeneous part of the state of the constrained modes at a time in the phase.
   pure subroutine find_homogeneous_state(self, time, z, v)
      type(phase_state_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp), contiguous, intent(out) :: z(:), v(:)

      if (.not. time > 0.0_wp) then
         z = self%z
         v = self%v
      else if (.not. abs(self%set%last%time - time) > 0.0_wp) then
         z = self%set%last%z
         v = self%set%last%v
      else if (size(self%set%compliant) > 0) then
         call state_in(self%set, self%amplitude, self%z, self%v, time, z, v)
      else
         call propagate(self%set%constrained%oscillators, time, self%z, self%v, z, v)
      end if
   end subroutine find_homogeneous_state

   !> State q, rate of the free modes, [free modes], from the state z, v of the constrained modes, [modes].
   pure subroutine to_free_state(self, z, v, q, rate)
      type(phase_state_t), intent(in) :: self
      real(wp), contiguous, intent(in) :: z(:), v(:)
      real(wp), contiguous, intent(out) :: q(:), rate(:)

      call to_free_modes(self%beam, self%set%constrained, z, v, q, rate)
   end subroutine to_free_state

end module phase_state
