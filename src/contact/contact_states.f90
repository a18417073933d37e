!> Surfaces during a run: whether the beam is on them, and what they keep of what was.
module contact_states
   use kinds, only: wp
   use run_settings, only: law_spring_damper
   use spring_damper_stop, only: make_node_pad
   use stop_laws, only: is_rigid, make_yielding_stop
   use stop_contacts, only: contact_t
   use yielding_stop, only: impedance_t, yielding_stop_t
   implicit none (type, external)
   private
   public :: contact_state_t, make_contact_state, put_node_before, node_at, of_rigid_stop, impedance_of, recover
   public :: energy_in, force_in, indent, keep_start, reactions_t

   type :: contact_state_t
      type(contact_t) :: contact
      logical :: is_rigid = .true.
      !> It yields; unallocated: it is rigid
      class(yielding_stop_t), allocatable :: spring
      !> The stop is rigid, and what yields is a node of the beam without mass before it: to users it is rigid, and the
      !> energy of the node is the beam's
      logical :: is_node = .false.
      !> The surface goes with the beam once the force has vanished
      logical :: relaxes = .false.
      !> It can be met: no other at its place is before it, and the energy of the start may bring the beam there
      logical :: is_active = .true.
      logical :: is_closed = .false.
      !> Open, but the spring of one that follows is not yet home
      logical :: is_deformed = .false.
      !> It yields, and the beam touches it without a force and without leaving it
      logical :: is_touched = .false.
      !> Open: order of the first derivative of the gap that does not vanish as the coming phase starts; 0: the gap is
      !> open. Closed: the same of the force
      integer :: start_order = 0
      !> u and P2 as the coming phase starts
      real(wp) :: depth = 0.0_wp
      real(wp) :: branch_force = 0.0_wp
      !> The flight under way is a capture if it never rises above this; 0: it is not asked. It began with this phase,
      !> and did not rise so far
      real(wp) :: hop_tolerance = 0.0_wp
      logical :: is_new_flight = .true.
      logical :: is_low = .true.
      !> How often the beam has left it since the start of the run
      integer :: flights = 0
      !> Dissipated so far in the stop, and at impacts on it
      real(wp) :: dissipated = 0.0_wp
      real(wp) :: lost_at_impacts = 0.0_wp
   end type contact_state_t

   !> Rigid surfaces on which the beam rests at an instant.
   type :: reactions_t
      !> These surfaces
      integer, allocatable :: place(:)
      !> Acceleration of each gap by a force at another, [place, place]
      real(wp), allocatable :: mobility(:, :)
      !> Acceleration of each gap without them, and its rounding error, [place]
      real(wp), allocatable :: free(:), noise(:)
      !> Away from the surface, >= 0, [place]
      real(wp), allocatable :: force(:)
      !> Of the free modes with them
      real(wp), allocatable :: acceleration(:)
   end type reactions_t

contains

   !> Open, as a run starts.
   subroutine make_contact_state(contact, state)
      type(contact_t), intent(in) :: contact
      type(contact_state_t), intent(out) :: state

      state%contact = contact
      state%is_rigid = is_rigid(contact%settings)
      call make_yielding_stop(contact%settings, state%spring)
      state%relaxes = contact%settings%law == law_spring_damper
   end subroutine make_contact_state

   !> A node of the beam without mass comes to this rigid stop.
   subroutine put_node_before(state, flexibility, two_zeta)
      type(contact_state_t), intent(inout) :: state
      !> As `make_node_pad` has them
      real(wp), intent(in) :: flexibility
      real(wp), intent(in) :: two_zeta

      state%is_rigid = .false.
      state%is_node = .true.
      allocate (state%spring, source=make_node_pad(flexibility, two_zeta))
   end subroutine put_node_before

   !> What it answers to an exponential.
   pure function impedance_of(state) result(impedance)
      type(contact_state_t), intent(in) :: state
      type(impedance_t) :: impedance

      if (allocated(state%spring)) impedance = state%spring%impedance_t
   end function impedance_of

   !> Is the stop rigid, with or without a node before it that yields?
   elemental function of_rigid_stop(state) result(answer)
      type(contact_state_t), intent(in) :: state
      logical :: answer

      answer = state%is_rigid .or. state%is_node
   end function of_rigid_stop

   !> Displacement and velocity of a node without mass, besides those of the modes, some time after a rigid stop has let
   !> it go.
   pure function node_at(state, time) result(node)
      !> As the flight, or a part of it, starts
      type(contact_state_t), intent(in) :: state
      !> Since then
      real(wp), intent(in) :: time
      real(wp) :: node(2)

      node = 0.0_wp
      if (.not. state%is_node) return
      if (state%spring%surface_rate < huge(1.0_wp)) node = [1.0_wp, -state%spring%surface_rate]*state%depth &
         *exp(-state%spring%surface_rate*time)
   end function node_at

   !> An open surface comes back for some time, without force; what that dissipates.
   subroutine recover(state, time)
      type(contact_state_t), intent(inout) :: state
      real(wp), intent(in) :: time

      real(wp) :: before

      if (.not. allocated(state%spring) .or. state%is_closed .or. state%relaxes) return
      if (.not. state%depth > 0.0_wp) return
      before = energy_in(state)
      call indent(state, state%depth*exp(-state%spring%surface_rate*time))
      state%dissipated = state%dissipated + (before - energy_in(state))
   end subroutine recover

   !> The surface of an open stop is there, without force: P = k u + P2 = 0.
   elemental subroutine indent(state, depth)
      type(contact_state_t), intent(inout) :: state
      !> u
      real(wp), intent(in) :: depth

      associate (has_branch => state%spring%branch_stiffness > 0.0_wp)
         state%depth = merge(max(depth, 0.0_wp), 0.0_wp, has_branch .or. state%relaxes .or. (state%is_node .and. &
            state%spring%surface_rate < huge(1.0_wp)))
         state%branch_force = merge(-state%spring%stiffness*state%depth, 0.0_wp, has_branch)
      end associate
   end subroutine indent

   !> Force of one that yields, if the beam is on it.
   elemental function force_in(state, velocity) result(force)
      type(contact_state_t), intent(in) :: state
      !> Of the beam, away from the surface
      real(wp), intent(in) :: velocity
      real(wp) :: force

      force = state%spring%stiffness*state%depth + state%branch_force - state%spring%viscosity*velocity
   end function force_in

   !> Keep what the course of a phase changes of surfaces as it starts.
   subroutine keep_start(states, at_start)
      type(contact_state_t), intent(in) :: states(:)
      !> Of the phase before, or of none yet
      type(contact_state_t), allocatable, intent(inout) :: at_start(:)

      if (.not. allocated(at_start)) at_start = states
      at_start%depth = states%depth
      at_start%branch_force = states%branch_force
      at_start%is_closed = states%is_closed
      at_start%is_deformed = states%is_deformed
   end subroutine keep_start

   !> Energy in its springs.
   elemental function energy_in(state) result(energy)
      type(contact_state_t), intent(in) :: state
      real(wp) :: energy

      energy = 0.0_wp
      if (allocated(state%spring)) energy = state%spring%energy(state%depth, state%branch_force)
   end function energy_in

end module contact_states
