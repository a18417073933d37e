!> Continuation of a motion by a Newmark run: its start from the stored final state of an earlier run, and storage of
!> its own final state. In a chain of cases each motion is continued in this way, after whole periods of the loads
!> (docs/theory.md, section 21).
module newmark_continuation
   use contact_rows, only: row_value
   use kinds, only: wp
   use newmark_contacts, only: resolve_contacts
   use newmark_energies, only: total_energy
   use newmark_run, only: gap_at, instant_of, is_constrained, is_inactive, is_in_contact, is_unloaded, is_open, &
      newmark_run_t
   use newmark_stepper, only: restart_acceleration
   use response_types, only: response_t
   use section_types, only: section_state_t
   implicit none (type, external)
   private
   public :: state_of, start_from_state, resolve_stored_contacts

contains

   !> Copy the present state, from which another run can start.
   pure subroutine state_of(run, state)
      type(newmark_run_t), intent(in) :: run
      type(section_state_t), intent(out) :: state

      state%tau = instant_of(run)
      associate (now => run%states(run%now))
         state%q = now%beam%displacement
         state%v = now%beam%velocity
         state%is_closed = run%contacts%status == is_constrained .or. run%contacts%status == is_in_contact
         state%is_deformed = run%contacts%status == is_unloaded
         state%indentation = now%indentation
         state%branch_force = now%branch_force
         ! with Newmark's method, `flight_height` of a stored state is the maximum gap of the flight so far
         state%flight_height = run%contacts%peak
         state%may_be_captured = run%contacts%may_be_captured
      end associate
   end subroutine state_of

   !> Start a run from a stored state. The run must have the same contacts in the same order as the run that stored the
   !> state; the parameters of their laws may differ.
   subroutine start_from_state(state, run)
      type(section_state_t), intent(in) :: state
      !> The run, ready to start
      type(newmark_run_t), intent(inout) :: run

      integer :: k

      associate (now => run%states(run%now))
         now%beam%displacement(:) = state%q
         now%beam%velocity(:) = state%v
         now%force = 0.0_wp
         now%indentation = state%indentation
         now%branch_force = state%branch_force
         do k = 1, size(run%contacts)
            associate (contact => run%contacts(k))
               if (contact%status == is_inactive) cycle
               contact%status = is_open
               contact%may_be_captured = state%may_be_captured(k)
               contact%peak = state%flight_height(k)
               if (state%is_deformed(k)) contact%status = is_unloaded
               if (state%is_closed(k)) contact%status = merge(is_in_contact, is_constrained, allocated(contact%stop))
               ! the indentation is measured from the gap at which contact began, which is not stored
               if (contact%status == is_in_contact) contact%shift = state%indentation(k) - contact%contact%height &
                  + row_value(contact%row, now%beam%displacement)
               contact%is_penetrating = contact%status == is_open .and. gap_at(run, k, now) < -run%contact_tolerance
            end associate
         end do
         call restart_acceleration(run%stepper, now%beam)
         call total_energy(run, run%start_energy)
      end associate
      run%states(3 - run%now) = run%states(run%now)
   end subroutine start_from_state

   !> Find the contact forces at the first instant, and the contacts that open at this instant under the loads of this
   !> run, although they were closed when the state was stored.
   pure subroutine resolve_stored_contacts(run, response)
      type(newmark_run_t), intent(inout) :: run
      !> Receives the events, and which contacts were closed
      type(response_t), intent(inout) :: response

      integer :: k

      allocate (response%starts_closed(size(run%contacts)))
      do k = 1, size(run%contacts)
         associate (contact => run%contacts(k))
            response%starts_closed(contact%contact%number) = contact%status == is_constrained &
               .or. contact%status == is_in_contact
         end associate
      end do
      call resolve_contacts(run, response)
   end subroutine resolve_stored_contacts

end module newmark_continuation
