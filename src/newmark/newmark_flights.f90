!> Low flights of a Newmark run. A flight is a time span in which a contact is open after a rebound. If the beam returns
!> to the contact without having exceeded the hop height, the flight is cancelled: the run returns to the instant at
!> which the flight began, at which the contact then captures the beam, and overwrites the histories and shapes recorded
!> since. Statistics are sums over equal blocks of the run; blocks that have begun since that instant are cleared.
!> Integrals of spectra return to their values at that instant.
module newmark_flights
   use block_statistics, only: blocks_begun, clear_blocks
   use newmark_run, only: begins_now, instant_of, newmark_run_t, run_state_t
   use newmark_stepper, only: copy_state
   use statistic_types, only: sum_time
   implicit none (type, external)
   private
   public :: record_flight_start, cancel_flight

contains

   !> Store the present state as the state at which flights begin.
   subroutine record_flight_start(run, events)
      type(newmark_run_t), intent(inout) :: run
      !> Number of events of the run
      integer, intent(in) :: events

      run%begins_flight = .false.
      associate (start => run%flight_start)
         if (.not. allocated(start%contacts)) then
            start%state = run%states(run%now)
            allocate (start%contacts(size(run%contacts)))
         end if
         where (run%contacts%flight_events == begins_now) run%contacts%flight_events = events
         start%contacts = run%contacts%contact_progress_t
         call copy(run%states(run%now), start%state)
         start%progress = run%run_progress_t
         if (allocated(run%observers%moments)) start%moments = run%observers%moments%moment_extremes_t
         if (allocated(run%observers%stress_windows)) start%windows = run%observers%stress_windows%now
         if (run%observers%measures%is_wanted) start%measurers = run%observers%measures%of
         if (allocated(run%observers%sections)) start%sections = run%observers%sections%count
         if (allocated(run%observers%blocks)) call store_sums(run)
         if (allocated(run%observers%spectrum)) start%spectrum = run%observers%spectrum
      end associate
   end subroutine record_flight_start

   !> Restore the state at which the last flight began.
   pure subroutine cancel_flight(run)
      type(newmark_run_t), intent(inout) :: run

      integer :: last

      ! the last block of the statistics that has begun before the run returns
      last = 0
      if (allocated(run%observers%blocks)) last = min(blocks_begun(run%observers%blocks, instant_of(run)), &
         size(run%observers%blocks%tip%sums, 2))
      associate (start => run%flight_start)
         call copy(start%state, run%states(run%now))
         run%run_progress_t = start%progress
         ! the stored contacts may have rejected steps that end after the restored state
         run%has_event_ahead = .true.
         run%contacts%contact_progress_t = start%contacts
         if (allocated(run%observers%moments)) run%observers%moments%moment_extremes_t = start%moments
         if (allocated(run%observers%stress_windows)) run%observers%stress_windows%now = start%windows
         if (run%observers%measures%is_wanted) run%observers%measures%of = start%measurers
         if (allocated(run%observers%sections)) run%observers%sections%count = start%sections
         if (allocated(run%observers%blocks)) call restore_sums(run, last)
         if (allocated(run%observers%spectrum)) run%observers%spectrum = start%spectrum
      end associate
   end subroutine cancel_flight

   !> Store the sums of the block of the statistics in progress, and the data of the last impact at each contact that
   !> may change.
   subroutine store_sums(run)
      type(newmark_run_t), intent(inout) :: run

      integer :: k

      associate (start => run%flight_start, blocks => run%observers%blocks)
         start%block = blocks_begun(blocks, instant_of(run))
         if (.not. allocated(start%impacts)) then
            allocate (start%impacts(size(blocks%contact)), start%has_separated(size(blocks%contact)))
            allocate (start%sums(size(blocks%tip%sums, 1), 0:size(blocks%contact)))
         end if
         ! before the first block, the first block is stored, whose sums are still empty; after the last block, the last
         associate (block => min(max(start%block, 1), size(blocks%tip%sums, 2)))
            start%sums(:, 0) = blocks%tip%sums(:, block)
            do k = 1, size(blocks%contact)
               associate (contact => blocks%contact(k))
                  start%sums(:, k) = contact%sums(:, block)
                  if (contact%count > 0) start%impacts(k) = contact%impacts(contact%count)
                  start%has_separated(k) = contact%has_separated
               end associate
            end do
         end associate
      end associate
   end subroutine store_sums

   !> Restore the stored sums, and clear the blocks that have begun since the sums were stored. No impact has been added
   !> since then, but the data of the last impact (end, impulse, force) may have changed.
   pure subroutine restore_sums(run, last)
      type(newmark_run_t), intent(inout) :: run
      !> Number of the last block that has begun
      integer, intent(in) :: last

      ! number of the block that was in progress when the flight began
      integer :: first
      integer :: k

      associate (start => run%flight_start, blocks => run%observers%blocks)
         first = min(max(start%block, 1), size(blocks%tip%sums, 2))
         blocks%tip%sums(:, first) = start%sums(:, 0)
         call clear_blocks((blocks%tip%sums(sum_time, first)), first + 1, last, blocks%tip%sums)
         do k = 1, size(blocks%contact)
            associate (contact => blocks%contact(k))
               contact%sums(:, first) = start%sums(:, k)
               call clear_blocks((blocks%tip%sums(sum_time, first)), first + 1, last, contact%sums)
               if (contact%count > 0) contact%impacts(contact%count) = start%impacts(k)
               contact%has_separated = start%has_separated(k)
            end associate
         end do
      end associate
   end subroutine restore_sums

   !> Copy a state without allocating.
   pure subroutine copy(from, to)
      type(run_state_t), intent(in) :: from
      !> The copy, allocated to the same size
      type(run_state_t), intent(inout) :: to

      call copy_state(from%beam, to%beam)
      to%force(:) = from%force
      to%indentation(:) = from%indentation
      to%branch_force(:) = from%branch_force
      to%load_tau = from%load_tau
   end subroutine copy

end module newmark_flights
