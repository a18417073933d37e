!> State of the contacts during a run: open or closed, and the deformation of compliant stops. A flight is the motion
!> between an opening of a contact and its next closing; a phase is the motion between two events of any contact or
!> load.
module contact_states
   use compliant_stop, only: dynamic_stiffness_t, compliant_stop_t
   use kinds, only: wp
   use run_settings, only: law_spring_damper
   use spring_damper_stop, only: make_node_spring
   use stop_contacts, only: contact_t
   use stop_laws, only: is_rigid, make_compliant_stop
   implicit none (type, external)
   private
   public :: contact_state_t, make_contact_state, add_massless_node, node_motion_at, has_rigid_stop, &
      dynamic_stiffness_of
   public :: recover, energy_in, force_in, set_indentation, record_start, reactions_t

   !> State of one contact during a run.
   type :: contact_state_t
      type(contact_t) :: contact
      !> Whether the contact is rigid: the stop is rigid, and no compliant massless node is in front of it
      logical :: is_rigid = .true.
      !> Law of a compliant stop; unallocated: the stop is rigid
      class(compliant_stop_t), allocatable :: spring
      !> Whether the stop is rigid, and `spring` is the compliance of a massless node of the beam in front of the stop.
      !> The results show a rigid stop, and the energy of the node counts as energy of the beam
      logical :: is_node = .false.
      !> Whether the law is spring and damper: after the force has vanished the contact surface moves with the beam
      !> until the spring is undeformed
      logical :: moves_with_beam = .false.
      !> Whether the contact can close: no other rigid contact at the same point and on the same side is in front of it,
      !> and the energy at the start is enough to close it
      logical :: is_active = .true.
      !> Index of the active rigid contact on the other side at the same point, if this contact is rigid; 0: there is
      !> none
      integer :: opposite = 0
      !> Whether no clearance beyond rounding is between this contact and the opposite contact
      logical :: has_no_clearance = .false.
      !> Whether the contact is closed
      logical :: is_closed = .false.
      !> Whether the contact is open and its surface moves with the beam, but the spring is not yet undeformed; from
      !> `set_initial_state` to `begin_contacts_at_start`: whether the contact has a force
      logical :: is_deformed = .false.
      !> Whether the stop is compliant, and the beam touches it without force and without separation
      logical :: is_touched = .false.
      !> Order of the first derivative that is not zero at the start of the next phase: of the gap of an open contact,
      !> of the force of a closed contact; 0: gap or force itself is not zero
      integer :: start_order = 0
      !> Indentation u of the stop at the start of the next phase
      real(wp) :: indentation = 0.0_wp
      !> Force P2 of the Maxwell branch at the start of the next phase; 0 without a branch: the force c u' of a damper
      !> parallel to the spring, P2 in `spring_damper_stop`, is not part of the state here
      real(wp) :: branch_force = 0.0_wp
      !> If the gap never exceeds this value during the present flight, the contact is captured at the end of the
      !> flight; 0: no capture is possible
      real(wp) :: hop_tolerance = 0.0_wp
      !> Whether the flight began with the present phase
      logical :: is_new_flight = .true.
      !> Whether the gap has not exceeded `hop_tolerance` so far
      logical :: may_be_captured = .true.
      !> Number of flights since the start of the run
      integer :: flights = 0
      !> Energy dissipated so far in the stop
      real(wp) :: dissipated = 0.0_wp
      !> Energy lost so far at impacts on the stop
      real(wp) :: lost_at_impacts = 0.0_wp
   end type contact_state_t

   !> Reactions of the closed rigid contacts at one instant.
   type :: reactions_t
      !> Indices of the closed rigid contacts
      integer, allocatable :: place(:)
      !> Acceleration of each gap per unit force at another contact, [place, place]
      real(wp), allocatable :: mobility(:, :)
      !> Acceleration of each gap without the reactions, [place]
      real(wp), allocatable :: free(:)
      !> Rounding error of that acceleration, [place]
      real(wp), allocatable :: rounding(:)
      !> Reactions, which push the beam away from the surface, >= 0, [place]
      real(wp), allocatable :: force(:)
      !> Accelerations of the free modes under these reactions, [modes]
      real(wp), allocatable :: acceleration(:)
   end type reactions_t

contains

   !> An open contact at the start of a run.
   subroutine make_contact_state(contact, state)
      type(contact_t), intent(in) :: contact
      type(contact_state_t), intent(out) :: state

      state%contact = contact
      state%is_rigid = is_rigid(contact%settings)
      call make_compliant_stop(contact%settings, state%spring)
      state%moves_with_beam = contact%settings%law == law_spring_damper
   end subroutine make_contact_state

   !> Put a massless node of the beam in front of this rigid stop.
   subroutine add_massless_node(state, flexibility, two_zeta)
      type(contact_state_t), intent(inout) :: state
      !> Displacement of the node per unit force on it, as in `make_node_spring`
      real(wp), intent(in) :: flexibility
      !> Twice the coefficient zeta of stiffness-proportional damping
      real(wp), intent(in) :: two_zeta

      state%is_rigid = .false.
      state%is_node = .true.
      allocate (state%spring, source=make_node_spring(flexibility, two_zeta))
   end subroutine add_massless_node

   !> Coefficients of the dynamic stiffness of the stop for a motion exp(s tau); all are zero if the stop is rigid.
   pure type(dynamic_stiffness_t) function dynamic_stiffness_of(state) result(dynamic_stiffness)
      type(contact_state_t), intent(in) :: state

      if (allocated(state%spring)) dynamic_stiffness = state%spring%dynamic_stiffness_t
   end function dynamic_stiffness_of

   !> Whether the stop is rigid, with or without a compliant massless node in front of it.
   elemental logical function has_rigid_stop(state) result(answer)
      type(contact_state_t), intent(in) :: state

      answer = state%is_rigid .or. state%is_node
   end function has_rigid_stop

   !> Displacement and velocity of a massless node relative to those that the modes give it, at a time after its release
   !> by a rigid stop: an exponential recovery, instantaneous if the rate is `huge`.
   pure function node_motion_at(state, time) result(node)
      !> State at the start of the flight, or at a later instant of it
      type(contact_state_t), intent(in) :: state
      !> Time since the instant of this state
      real(wp), intent(in) :: time
      real(wp) :: node(2)

      node = 0.0_wp
      if (.not. state%is_node) return
      if (state%spring%recovery_rate < huge(1.0_wp)) node = [1.0_wp, -state%spring%recovery_rate]*state%indentation &
         *exp(-state%spring%recovery_rate*time)
   end function node_motion_at

   !> Viscoelastic recovery of a stop after the contact has opened, and the energy that the recovery dissipates. A
   !> surface that moves with the beam does not recover independently.
   subroutine recover(state, time)
      type(contact_state_t), intent(inout) :: state
      !> Time since the contact opened, or since the last call
      real(wp), intent(in) :: time

      real(wp) :: before

      if (.not. allocated(state%spring) .or. state%is_closed .or. state%moves_with_beam) return
      if (.not. state%indentation > 0.0_wp) return
      before = energy_in(state)
      call set_indentation(state, state%indentation*exp(-state%spring%recovery_rate*time))
      state%dissipated = state%dissipated + (before - energy_in(state))
   end subroutine recover

   !> Set the indentation u of an open contact, which bears no force: with a branch P2 = -k u; without one P2 = 0, and
   !> the damper balances the spring. The indentation remains zero if the stop recovers instantaneously.
   elemental subroutine set_indentation(state, indentation)
      type(contact_state_t), intent(inout) :: state
      !> Indentation u
      real(wp), intent(in) :: indentation

      associate (has_branch => state%spring%branch_stiffness > 0.0_wp)
         state%indentation = merge(max(indentation, 0.0_wp), 0.0_wp, has_branch .or. state%moves_with_beam .or. &
            (state%is_node .and. state%spring%recovery_rate < huge(1.0_wp)))
         state%branch_force = merge(-state%spring%stiffness*state%indentation, 0.0_wp, has_branch)
      end associate
   end subroutine set_indentation

   !> Force P = k u + P2 + c u' of a closed compliant contact, where u' = -(velocity of the gap).
   elemental real(wp) function force_in(state, velocity) result(force)
      type(contact_state_t), intent(in) :: state
      !> Velocity of the gap: positive if the beam moves away from the surface
      real(wp), intent(in) :: velocity

      force = state%spring%stiffness*state%indentation + state%branch_force - state%spring%viscosity*velocity
   end function force_in

   !> Record those components of the contact states that change during a phase, at the start of the phase.
   subroutine record_start(states, at_start)
      type(contact_state_t), intent(in) :: states(:)
      !> The record. Components that are not assigned here have their values of the first phase. Unallocated before it
      type(contact_state_t), allocatable, intent(inout) :: at_start(:)

      if (.not. allocated(at_start)) at_start = states
      at_start%indentation = states%indentation
      at_start%branch_force = states%branch_force
      at_start%is_closed = states%is_closed
      at_start%is_deformed = states%is_deformed
      at_start%dissipated = states%dissipated
   end subroutine record_start

   !> Energy in the springs of the stop.
   elemental real(wp) function energy_in(state) result(energy)
      type(contact_state_t), intent(in) :: state

      energy = 0.0_wp
      if (allocated(state%spring)) energy = state%spring%energy(state%indentation, state%branch_force)
   end function energy_in

end module contact_states
