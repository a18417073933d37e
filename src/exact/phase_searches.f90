!> Search for the time at which a single contact ends a phase, the motion between two events: the first zero of a
!> signal, such as the gap or the contact force (docs/theory.md, section 17).
module phase_searches
   use certified_search, only: first_zero, found_none, found_zero, search_t, transformable_signal_t
   use driven_signal, only: find_short_driven, first_nonzero_order
   use kinds, only: i8, wp
   use modal_signal, only: modal_signal_t
   use phase_state, only: driven_terms, end_force, end_gap, end_undeformed, end_renewed_contact, find_gap_signal, &
      phase_state_t, signal_of
   implicit none (type, external)
   private
   public :: search_contact

contains

   !> Find the time at which a contact ends the phase.
   subroutine search_contact(self, k, limit, search, ended_by)
      type(phase_state_t), target, intent(inout) :: self
      integer, intent(in) :: k
      !> Time at which the search ends
      real(wp), intent(in) :: limit
      type(search_t), intent(out) :: search
      !> One of the `end_` constants
      integer, intent(out) :: ended_by

      class(transformable_signal_t), pointer :: signal
      ! search for the end of the deformation of an open contact
      type(search_t) :: other

      associate (state => self%states(k), constrained => self%set%constrained)
         ended_by = end_gap
         if (state%is_closed) ended_by = end_force
         if (state%is_deformed) ended_by = end_renewed_contact
         if (self%is_at_rest) then
            search = search_t(outcome=found_none, time=limit)
            return
         end if
         if (ended_by == end_gap .and. size(self%set%compliant) == 0) then
            call search_gap(self, k, limit, search)
            return
         end if
         if (ended_by == end_force .and. size(self%set%compliant) == 0 .and. self%loads%count == 0) then
            associate (force => constrained%force(findloc(constrained%closed, k, dim=1)))
               force%start_order = first_nonzero_order(force, state%start_order)
               call force%prepare(0)
               call search_force(force, limit, search)
            end associate
            return
         end if
         call signal_of(self, k, ended_by, signal)
         signal%start_order = first_nonzero_order(signal, state%start_order)
         if (ended_by == end_force) then
            call search_force(signal, limit, search)
            call move_alloc(self%signal, self%force_signal)
            self%force_signal_at = k
            self%history_of = 0
            return
         end if
         call first_zero(signal, limit, search, self%history)
         self%history_of = 0
         if (ended_by == end_gap) call assign_history(self, k, search)
         if (.not. state%is_deformed) return
         call signal_of(self, k, end_undeformed, signal)
         signal%start_order = first_nonzero_order(signal, 0)
         call first_zero(signal, min(limit, search%time), other)
         if (other%outcome == found_zero) then
            search = other
            ended_by = end_undeformed
         end if
      end associate
   end subroutine search_contact

   !> Find the time at which a contact force vanishes. If the force never exceeds its rounding error, the contact opens
   !> only when the force is negative by more than this error; otherwise rounding errors would open and close the
   !> contact.
   subroutine search_force(force, limit, search)
      class(transformable_signal_t), intent(in) :: force
      !> Time at which the search ends
      real(wp), intent(in) :: limit
      type(search_t), intent(out) :: search

      ! force plus `error`, its rounding error
      class(transformable_signal_t), allocatable :: raised
      ! number of evaluations of the first search
      integer(i8) :: before
      real(wp) :: error

      call first_zero(force, limit, search)
      ! 64: margin, because the rounding error is an estimate
      error = 64.0_wp*search%rounding
      if (search%outcome == found_none .or. search%max_value > error) return
      before = search%evaluations
      call force%transform(0.0_wp, 1.0_wp, error, 0, raised)
      call first_zero(raised, limit, search)
      search%evaluations = search%evaluations + before
   end subroutine search_force

   !> Find the time at which a gap closes if no compliant contact is closed.
   subroutine search_gap(self, k, limit, search)
      type(phase_state_t), target, intent(inout) :: self
      integer, intent(in) :: k
      !> Time at which the search ends
      real(wp), intent(in) :: limit
      type(search_t), intent(out) :: search

      type(modal_signal_t), pointer :: gap

      call find_gap_signal(self, k, gap)
      associate (state => self%states(k), forced => self%forced)
         ! the search stores the state at its last instant, so that the end of the phase need not compute it again
         gap%last => self%set%last
         if (allocated(state%spring)) then
            if (.not. state%moves_with_beam) gap%relaxation = state%indentation
            gap%rate = min(state%spring%recovery_rate, huge(1.0_wp))
         end if
         if (self%loads%count == 0) then
            gap%start_order = first_nonzero_order(gap, state%start_order)
            call gap%prepare(0)
            call gap%find_zero(limit, search, self%history)
            call assign_history(self, k, search)
            return
         end if
         ! a short flight after a rebound, such as those of chatter, is found with less work
         if (state%start_order == 1 .and. size(forced%pair) == 0) then
            associate (row => self%set%forced%at%gaps + k)
               call find_short_driven(gap, forced%slope(row), forced%harmonic(row, :), forced%frequency, limit, search)
            end associate
            if (search%outcome == found_zero) then
               self%history_of = 0
               return
            end if
         end if
         associate (driven => self%set%forced%gap(k))
            call driven_terms(self, k, end_gap, driven%terms)
            call gap%prepare(0)
            driven%until = self%max_length
            driven%start_order = first_nonzero_order(driven, state%start_order)
            call first_zero(driven, limit, search, self%history)
         end associate
         call assign_history(self, k, search)
      end associate
   end subroutine search_gap

   !> Attribute the search history, which the search has just written, to contact k if the contact is rigid and the
   !> search found the zero of its gap; otherwise the history belongs to no contact.
   pure subroutine assign_history(self, k, search)
      type(phase_state_t), intent(inout) :: self
      !> The contact whose gap was searched
      integer, intent(in) :: k
      type(search_t), intent(in) :: search

      self%history_of = 0
      if (search%outcome == found_zero .and. self%states(k)%is_rigid) self%history_of = k
   end subroutine assign_history

end module phase_searches
