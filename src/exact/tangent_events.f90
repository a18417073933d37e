!> Variations of a motion across its events (docs/theory.md, section 22). A variation is the derivative of the state
!> with respect to the initial state or a load parameter, stored as a column of a matrix. A varied motion reaches an
!> event (a change of the contacts) at a varied instant. So each column is shifted to that instant, mapped by the event,
!> and shifted back to the instant of the unvaried motion.
module tangent_events
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use certified_search, only: found_never_positive, search_t
   use complementarity, only: solve_active
   use kinds, only: wp
   use phase_state, only: end_force, end_gap, end_undeformed, end_renewed_contact, phase_state_t
   use section_types, only: run_sections_t
   use tangent_columns, only: no_parameter, shift_columns, column_norm, state_rates_t, tangent_t
   use tangent_flow, only: find_rates, propagate_columns, has_branch_force, find_load_changes
   implicit none (type, external)
   private
   public :: begin_columns, end_columns, revert_columns, record_sizes

   !> A single column larger than this, or smaller than the inverse, is scaled to size 1.
   real(wp), parameter :: max_size = 1.0e50_wp

contains

   !> Start of a phase: shift each column from its own instant of the last event to the instant of the unvaried motion.
   subroutine begin_columns(now, tangent)
      !> State of the phase, which has started
      type(phase_state_t), intent(in) :: now
      type(tangent_t), intent(inout) :: tangent

      real(wp) :: column_size

      call find_rates(now, 0.0_wp, tangent%boundary_rates)
      call shift_columns(tangent%boundary_rates, -1.0_wp, tangent)
      if (size(tangent%delay) > 1) return
      column_size = column_norm(tangent, now%beam%oscillators)
      ! a single column belongs to a Lyapunov exponent, which needs the logarithm of its size alone
      if (column_size < max_size .and. column_size*max_size > 1.0_wp .or. column_size <= 0.0_wp) return
      tangent%log_scale = tangent%log_scale + log(column_size)
      tangent%q = tangent%q/column_size
      tangent%v = tangent%v/column_size
      tangent%branch_force = tangent%branch_force/column_size
      tangent%delay = tangent%delay/column_size
   end subroutine begin_columns

   !> A phase is cancelled: shift each column back to its own instant of the event at the start of the phase.
   pure subroutine revert_columns(tangent)
      !> Unallocated: there are no variations
      type(tangent_t), allocatable, intent(inout) :: tangent

      if (allocated(tangent)) call shift_columns(tangent%boundary_rates, 1.0_wp, tangent)
   end subroutine revert_columns

   !> End of a phase: propagate each column, and shift it to its own instant of the event.
   subroutine end_columns(now, ended_at, ended_by, search, tangent)
      type(phase_state_t), intent(in) :: now
      !> Index of the contact that ends the phase; 0: there is none
      integer, intent(in) :: ended_at
      !> How the contact ends the phase: one of the `end_` constants
      integer, intent(in) :: ended_by
      type(search_t), intent(in) :: search
      type(tangent_t), intent(inout) :: tangent

      type(state_rates_t) :: rates
      ! derivatives of the loads with respect to the load parameter, [loads]
      real(wp) :: by_parameter(now%loads%count)
      ! rates of the loads d/dtau, [loads]
      real(wp) :: load_rate(now%loads%count)
      ! zeros: the initial state does not change the loads, [loads]
      real(wp) :: no_change(now%loads%count)
      ! rate d/dtau of the signal that ends the phase
      real(wp) :: slope
      integer :: i

      if (search%outcome == found_never_positive) then
         ! a flight that never rose above rounding has no length: as in `revert_columns`
         call shift_columns(tangent%boundary_rates, 1.0_wp, tangent)
         return
      end if
      call propagate_columns(now, search%time, tangent)
      tangent%delay = 0.0_wp
      call find_rates(now, search%time, rates)
      if (ended_at == 0) tangent%boundary_rates = rates
      if (ended_at == 0) return
      call find_load_changes(now, search%time, tangent, by_parameter, load_rate)
      no_change = 0.0_wp
      slope = signal_change(now, ended_at, ended_by, rates%q, rates%v, rates%branch_force, load_rate)
      if (ended_by == end_gap .and. now%states(ended_at)%is_rigid) tangent%min_speed = &
         min(tangent%min_speed, abs(slope))
      ! at a grazing event (zero rate of the signal) the derivative does not exist: the delay is large but finite
      slope = sign(max(abs(slope), tiny(1.0_wp)**0.25_wp), slope)
      ! delay of the event by a variation: - (change of the signal)/(rate of the signal)
      do i = 1, size(tangent%delay)
         tangent%delay(i) = -signal_change(now, ended_at, ended_by, tangent%q(:, i), tangent%v(:, i), &
            tangent%branch_force(:, i), merge(by_parameter, no_change, i == size(tangent%delay) .and. &
            tangent%parameter /= no_parameter))/slope
      end do
      call shift_columns(rates, 1.0_wp, tangent)
   end subroutine end_columns

   !> Record the logarithm of the size of the first column at the sections in the phase.
   subroutine record_sizes(now, tau, length, tangent, sections)
      type(phase_state_t), intent(in) :: now
      !> Start of the phase
      real(wp), intent(in) :: tau
      !> Length of the phase
      real(wp), intent(in) :: length
      !> Variations at the start of the phase
      type(tangent_t), intent(in) :: tangent
      type(run_sections_t), intent(inout) :: sections

      type(tangent_t) :: at_section
      real(wp) :: size_at_section
      integer :: n

      if (.not. allocated(sections%log_norm)) return
      do n = sections%count + 1, size(sections%tau)
         ! a section within rounding error after the end belongs to the phase
         if (sections%tau(n) > tau + length + 4.0_wp*epsilon(1.0_wp)*tau) exit
         at_section = tangent
         call propagate_columns(now, min(max(sections%tau(n) - tau, 0.0_wp), length), at_section)
         size_at_section = column_norm(at_section, now%beam%oscillators)
         sections%log_norm(n) = ieee_value(1.0_wp, ieee_quiet_nan)
         if (size_at_section > 0.0_wp) sections%log_norm(n) = at_section%log_scale + log(size_at_section)
      end do
   end subroutine record_sizes

   !> Change of the signal that ends a phase by a small change of state and loads.
   real(wp) function signal_change(now, k, ended_by, q, v, branch_force, load) result(change)
      type(phase_state_t), intent(in) :: now
      integer, intent(in) :: k
      !> One of the `end_` constants
      integer, intent(in) :: ended_by
      !> Changes of the displacements q of the free modes, [free modes]
      real(wp), intent(in) :: q(:)
      !> Changes of the velocities v of the free modes, [free modes]
      real(wp), intent(in) :: v(:)
      !> Changes of branch forces P2, [contacts]
      real(wp), intent(in) :: branch_force(:)
      !> Changes of the loads, [loads]
      real(wp), intent(in) :: load(:)

      associate (state => now%states(k), gap => sum(now%beam%value(:, k)*q))
         select case (ended_by)
         case (end_gap)
            change = gap
            ! an open three-element stop bears no force and has the indentation u = -P2/k
            if (has_branch_force(state)) change = gap - branch_force(k)/state%spring%stiffness
         case (end_undeformed)
            change = -gap
         case (end_renewed_contact)
            ! the signal is minus the force; a stop whose surface moves with the beam has no branch
            change = -force_change(now, k, q, v, 0.0_wp*branch_force)
         case (end_force)
            if (state%is_rigid) then
               change = reaction_change(now, k, q, v, branch_force, load)
            else
               change = force_change(now, k, q, v, branch_force)
            end if
         case default
            change = 0.0_wp
         end select
      end associate
   end function signal_change

   !> Change of the force of a compliant contact by a change of state.
   pure real(wp) function force_change(now, k, q, v, branch_force) result(change)
      type(phase_state_t), intent(in) :: now
      integer, intent(in) :: k
      !> Changes of q, [free modes]
      real(wp), intent(in) :: q(:)
      !> Changes of v, [free modes]
      real(wp), intent(in) :: v(:)
      !> Changes of the branch forces, as in `signal_change`
      real(wp), intent(in) :: branch_force(:)

      ! force of the spring, damper and Maxwell branch: P = P2 + c du/dtau + k u, and the indentation u is minus the gap
      associate (spring => now%states(k)%spring, b => now%beam%value(:, k))
         change = branch_force(k) - spring%viscosity*sum(b*v) - spring%stiffness*sum(b*q)
      end associate
   end function force_change

   !> Change of the reaction of a closed rigid contact by a change of state and loads.
   recursive real(wp) function reaction_change(now, k, q, v, branch_force, load) result(change)
      type(phase_state_t), intent(in) :: now
      integer, intent(in) :: k
      !> Changes of q, [free modes]
      real(wp), intent(in) :: q(:)
      !> Changes of v, [free modes]
      real(wp), intent(in) :: v(:)
      !> Changes of the branch forces, as in `signal_change`
      real(wp), intent(in) :: branch_force(:)
      !> Changes of the loads, as in `signal_change`
      real(wp), intent(in) :: load(:)

      ! change of the modal forces that the contact reactions must balance, [free modes]
      real(wp), allocatable :: forces(:)
      ! acceleration at each closed rigid contact by a unit reaction at each of them, [rigid, rigid]
      real(wp), allocatable :: mobility(:, :)
      ! changes of the reactions, [rigid]
      real(wp), allocatable :: reaction(:)
      ! indices of the closed rigid contacts, [rigid]
      integer, allocatable :: rigid(:)
      integer :: i, place

      associate (set => now%set, constrained => now%set%constrained, beam => now%beam)
         place = findloc(constrained%closed, k, dim=1)
         allocate (forces(size(q)), source=0.0_wp)
         ! the contact is a constraint of the set: change of its reaction by the constrained equations of motion
         if (place > 0) then
            change = sum(constrained%reaction(place, :)*matmul(q + constrained%oscillators%two_zeta*v, &
               constrained%mode))
            if (now%loads%count > 0) change = change - sum(set%forced%balanced_fraction(place, :)*load)
            do i = 1, size(set%compliant)
               associate (other => set%compliant(i), fraction => constrained%balanced_fraction(place, set%compliant(i)))
                  ! a rigid contact that is no constraint applies a force, too
                  if (now%states(other)%is_rigid) then
                     change = change - fraction*reaction_change(now, other, q, v, branch_force, load)
                  else
                     change = change - fraction*force_change(now, other, q, v, branch_force)
                  end if
               end associate
            end do
            return
         end if
         ! modal damping ratios: rigid contacts are not constraints but apply forces to the free modes
         allocate (rigid, source=pack(set%compliant, now%states(set%compliant)%is_rigid))
         associate (oscillators => beam%oscillators, n => size(q))
            forces = oscillators%square*(q + oscillators%two_zeta*v) + oscillators%mass_rate(:n)*v
         end associate
         if (now%loads%count > 0) forces = forces - matmul(now%loads%mode, load)
         do i = 1, size(set%compliant)
            associate (other => set%compliant(i))
               if (.not. now%states(other)%is_rigid) forces = forces - beam%value(:, other) &
                  *force_change(now, other, q, v, branch_force)
            end associate
         end do
         allocate (reaction(size(rigid)))
         mobility = matmul(transpose(beam%value(:, rigid)), beam%value(:, rigid))
         call solve_active(mobility, -matmul(forces, beam%value(:, rigid)), spread(.true., 1, size(rigid)), reaction)
         change = reaction(findloc(rigid, k, dim=1))
      end associate
   end function reaction_change

end module tangent_events
