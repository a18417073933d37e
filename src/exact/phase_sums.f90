!> Rows of a phase of exact motion (the motion between two events) as explicit sums of exponentials (docs/theory.md,
!> sections 20 and 24). Rows are linear functionals of the motion: displacements, contact forces, bending moments.
module phase_sums
   use certified_search, only: transformable_signal_t
   use exponential_sums, only: exponential_sums_t, open_sums, value_of
   use history_list, only: acceleration_stop, acceleration_tip
   use kinds, only: wp
   use moment_signals, only: find_row, moment_row_t, moments_t
   use phase_integrals, only: find_signals
   use phase_state, only: observed_gap, observed_tip, phase_state_t, signal_of
   use response_types, only: contact_record_t
   use run_recorder, only: sample_t
   use signal_integrals, only: integrate_signals, signals_t
   implicit none (type, external)
   private
   public :: find_sums, find_acceleration, integrate_accelerations, sample_accelerations

contains

   !> Find the sums of some rows of an interval. With n contacts, rows 1 to n are the displacements at the contacts, row
   !> n + 1 is the displacement of the tip, rows n + 2 to 2 n + 1 are contact forces, and the others are bending moments
   !> and then displacements of bodies.
   subroutine find_sums(now, moments, length, rows, sums, order)
      type(phase_state_t), intent(in) :: now
      type(moments_t), intent(in) :: moments
      !> Length of the phase, > 0
      real(wp), intent(in) :: length
      !> Numbers of the rows
      integer, intent(in) :: rows(:)
      type(exponential_sums_t), intent(out) :: sums
      !> Order of the time derivative of the rows, as in `find_signals`; default: 0
      integer, intent(in), optional :: order

      type(signals_t) :: signals
      type(moment_row_t), allocatable :: bending(:)
      integer, allocatable :: closed(:), places(:), wanted(:)
      integer :: i, last, n, place

      n = size(now%states)
      allocate (places, source=pack(rows, rows <= n))
      allocate (closed, source=pack(rows, rows > n + 1 .and. rows <= 2*n + 1) - (n + 1))
      closed = pack(closed, now%set%is_closed(closed))
      allocate (wanted, source=pack(rows, rows > 2*n + 1) - (2*n + 1))
      allocate (bending(size(wanted)))
      do i = 1, size(wanted)
         call find_row(moments, wanted(i), now, bending(i))
      end do
      call find_signals(now, length, places, closed, signals, bending, order)
      last = size(signals%exponent)
      call open_sums(size(rows), last + count(now%states%is_node), sums)
      sums%exponent(:last) = signals%exponent
      do i = 1, size(rows)
         ! `find_signals` orders the signals of each kind as in `rows`
         if (rows(i) <= n) then
            place = count(rows(:i) <= n)
         else if (rows(i) == n + 1) then
            place = size(places) + 1
         else if (rows(i) <= 2*n + 1) then
            place = findloc(closed, rows(i) - (n + 1), dim=1)
            if (place == 0) cycle
            place = size(places) + 1 + place
         else
            place = size(places) + 1 + size(closed) + count(rows(:i) > 2*n + 1)
         end if
         sums%power(0, i) = signals%offset(place)
         sums%power(1, i) = signals%slope(place)
         sums%amplitude(i, :last) = signals%amplitude(place, :)
      end do
      call add_nodes(now, rows, last, sums)
      if (.not. present(order)) return
      ! `find_signals` has differentiated the terms of the modes
      sums%power(:order - 1, :) = 0.0_wp
      do i = last + 1, size(sums%exponent)
         sums%amplitude(:, i) = sums%exponent(i)**order*sums%amplitude(:, i)
      end do
   end subroutine find_sums

   !> The acceleration at a contact, in the direction of its gap, or of the tip as a signal, valid until the next call.
   subroutine find_acceleration(now, row, signal)
      type(phase_state_t), target, intent(inout) :: now
      !> Number of the row: a contact, or the number of contacts + 1 for the tip
      integer, intent(in) :: row
      class(transformable_signal_t), pointer, intent(out) :: signal

      class(transformable_signal_t), allocatable :: acceleration, rate
      real(wp) :: factor
      ! index of the contact; at the tip, of a massless node that is the tip, or 0
      integer :: k

      k = row
      factor = 1.0_wp
      if (row > size(now%states)) then
         k = findloc(now%states%is_node .and. abs(now%beam%tip_sign) > 0.0_wp, .true., dim=1)
         ! a node on its stop does not move
         if (k > 0) factor = merge(0.0_wp, now%beam%tip_sign(k), now%set%is_closed(k))
      end if
      call signal_of(now, k, merge(observed_tip, observed_gap, k == 0), signal)
      call signal%transform(0.0_wp, factor, 0.0_wp, 1, rate)
      call rate%transform(0.0_wp, 1.0_wp, 0.0_wp, 1, acceleration)
      call move_alloc(acceleration, now%signal)
      signal => now%signal
   end subroutine find_acceleration

   !> Integrals of accelerations and of their squares over a span of a phase.
   subroutine integrate_accelerations(now, moments, length, span, integrals, square_integrals)
      type(phase_state_t), intent(inout) :: now
      type(moments_t), intent(in) :: moments
      !> Length of the phase
      real(wp), intent(in) :: length
      !> Beginning and end of the span, since the start of the phase
      real(wp), intent(in) :: span(2)
      !> Integrals of the accelerations at the contacts, in the direction of their gaps, and of the tip, [contacts + 1]
      real(wp), intent(out) :: integrals(:)
      !> Integrals of their squares, [contacts + 1]
      real(wp), intent(out) :: square_integrals(:)

      type(exponential_sums_t) :: sums
      type(signals_t) :: signals
      integer :: k

      call find_sums(now, moments, length, [(k, k=1, size(integrals))], sums, order=2)
      ! constant and slope are zero, because second derivatives of sums of exponentials have exponentials alone
      allocate (signals%offset(size(integrals)), signals%slope(size(integrals)), source=0.0_wp)
      call move_alloc(sums%exponent, signals%exponent)
      call move_alloc(sums%amplitude, signals%amplitude)
      call integrate_signals(signals, span(1), span(2), now%set%squares, integrals, square_integrals)
   end subroutine integrate_accelerations

   !> Accelerations of the beam at the contacts and at the tip, positive upwards; impulses are not part of them.
   subroutine find_accelerations(now, moments, length, sums)
      type(phase_state_t), intent(in) :: now
      type(moments_t), intent(in) :: moments
      !> Length of the phase, > 0
      real(wp), intent(in) :: length
      !> Accelerations at the contacts and at the tip, [contacts + 1]
      type(exponential_sums_t), intent(out) :: sums

      integer :: k

      call find_sums(now, moments, length, [(k, k=1, size(now%states) + 1)], sums, order=2)
      do k = 1, size(now%states)
         if (now%states(k)%contact%sign > 0.0_wp) cycle
         sums%power(:, k) = -sums%power(:, k)
         sums%amplitude(k, :) = -sums%amplitude(k, :)
      end do
   end subroutine find_accelerations

   !> Accelerations at a sample. The histories of the run refer to the release contact or, without a stop, to the tip.
   subroutine sample_accelerations(now, moments, length, time, place, sums, records, sample)
      type(phase_state_t), intent(in) :: now
      type(moments_t), intent(in) :: moments
      !> Length of the phase
      real(wp), intent(in) :: length
      !> Time since the start of the phase
      real(wp), intent(in) :: time
      !> Index of the sample in the histories of contacts
      integer, intent(in) :: place
      !> Accelerations in the phase; unallocated: not found yet
      type(exponential_sums_t), allocatable, intent(inout) :: sums
      type(contact_record_t), intent(inout) :: records(:)
      type(sample_t), intent(inout) :: sample

      ! accelerations at the contacts and at the tip, [contacts + 1]
      real(wp) :: values(size(now%states) + 1)
      integer :: k

      if (.not. allocated(sums)) then
         allocate (sums)
         call find_accelerations(now, moments, max(length, tiny(1.0_wp)), sums)
      end if
      values = value_of(sums, time)
      associate (n => size(now%states), release => now%release_contact)
         sample%history(acceleration_tip) = values(n + 1)
         sample%history(acceleration_stop) = values(merge(n + 1, release, release == 0))
         do k = 1, n
            if (allocated(records(k)%acceleration)) records(k)%acceleration(place) = values(k)
         end do
      end associate
   end subroutine sample_accelerations

   !> Add the displacement of massless nodes at rigid stops relative to the modes. A node on its stop does not move. A
   !> node away from its stop carries no force, so its displacement relative to the modes decays exponentially by the
   !> damping of the elements beside it. The displacement at the start of the phase is `node_depth`, because the
   !> `indentation` of the contact is already that at the end of the phase.
   pure subroutine add_nodes(now, rows, last, sums)
      type(phase_state_t), intent(in) :: now
      !> Numbers of the rows
      integer, intent(in) :: rows(:)
      !> Number of terms of the modes; the term of each node follows
      integer, intent(in) :: last
      type(exponential_sums_t), intent(inout) :: sums

      real(wp) :: sign
      integer :: i, k, term

      term = last
      do k = 1, size(now%states)
         associate (state => now%states(k))
            if (.not. state%is_node) cycle
            term = term + 1
            if (state%spring%recovery_rate < huge(1.0_wp)) sums%exponent(term) = cmplx( &
               -state%spring%recovery_rate, 0.0_wp, wp)
            do i = 1, size(rows)
               ! factor of the node's displacement in the row, not zero for contacts at the node (`colocated`) and for
               ! the tip if the node is at the tip
               sign = 0.0_wp
               if (rows(i) <= size(now%states)) then
                  if (now%colocated(rows(i)) == now%colocated(k)) sign = now%colocated_sign(rows(i)) &
                     *now%colocated_sign(k)
               else if (rows(i) == size(now%states) + 1) then
                  sign = now%beam%tip_sign(k)
               end if
               if (.not. abs(sign) > 0.0_wp) cycle
               if (now%set%is_closed(k)) then
                  sums%power(:, i) = [sign*now%beam%height(k), 0.0_wp, 0.0_wp, 0.0_wp]
                  sums%amplitude(i, :) = (0.0_wp, 0.0_wp)
               else if (state%spring%recovery_rate < huge(1.0_wp)) then
                  sums%amplitude(i, term) = cmplx(sign*now%node_depth, 0.0_wp, wp)
               end if
            end do
         end associate
      end do
   end subroutine add_nodes

end module phase_sums
