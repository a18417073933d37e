!> Contribution of an interval of the motion (a phase or a step) to the statistics of a run: integrals of forces, of
!> displacements and of their squares, and extremes (docs/theory.md, section 20). An interval is divided at the ends of
!> the blocks of time in which statistics are accumulated. The observed quantities of an interval are called rows; they
!> are numbered in the order gaps of the contacts, displacement of the tip, forces of the contacts (module
!> `motion_intervals`).
module interval_statistics
   use block_statistics, only: blocks_begun, add_contact, record_separation
   use kinds, only: wp
   use motion_intervals, only: interval_t, observed_contact_t, peak_t, output_row_t
   use signal_peaks, only: extreme_search_t
   use statistic_types, only: block_sums_t, minimum_displacement, minimum_force, minimum_tip, &
      sum_displacement, sum_work, sum_square_acceleration, sum_square_tip_acceleration, minimum_acceleration, &
      maximum_acceleration, minimum_tip_acceleration, maximum_tip_acceleration, &
      sum_square_displacement, sum_square_tip, sum_tip, contact_sums_t, maximum_displacement, maximum_force, maximum_tip
   implicit none (type, external)
   private
   public :: add_interval, widen_range

contains

   !> Add an interval, divided at the ends of blocks.
   subroutine add_interval(interval, blocks)
      class(interval_t), intent(inout) :: interval
      type(block_sums_t), intent(inout) :: blocks

      type(observed_contact_t) :: contact
      real(wp) :: span(2)
      integer :: block, k, last

      last = ubound(blocks%edge, 1)
      if (.not. interval%length > 0.0_wp) return
      associate (tau => interval%start, length => interval%length)
         if (tau < blocks%edge(last) .and. tau + length > blocks%edge(0)) then
            do block = max(blocks_begun(blocks, tau), 1), last
               span = [max(blocks%edge(block - 1) - tau, 0.0_wp), min(blocks%edge(block) - tau, length)]
               if (span(2) > span(1)) call add_span(interval, span, block, blocks)
               if (blocks%edge(block) >= tau + length) exit
            end do
         end if
         do k = 1, interval%contacts
            contact = interval%contact(k)
            associate (contact_sums => blocks%contact(contact%number))
               if (contact%is_closed) then
                  ! the closed contact extends the impact in progress, even if the interval lies outside all blocks
                  call add_contact(contact_sums, tau, tau + length, 0, [0.0_wp, 0.0_wp], 0.0_wp)
               else if (contact%is_active .and. .not. contact_sums%has_separated) then
                  call check_separation(interval, k, blocks%hop_tolerance, contact_sums)
               end if
            end associate
         end do
      end associate
   end subroutine add_interval

   !> Record whether the gap of an open contact exceeds the hop tolerance in the interval, which separates two impacts.
   subroutine check_separation(interval, k, hop_tolerance, contact_sums)
      class(interval_t), intent(in) :: interval
      integer, intent(in) :: k
      real(wp), intent(in) :: hop_tolerance
      type(contact_sums_t), intent(inout) :: contact_sums

      real(wp) :: level, state(2)

      if (interval%gap_bound(k) <= hop_tolerance) return
      level = hop_tolerance + interval%rounding(k)
      ! no search is needed if the value at the end of the interval exceeds the level
      state = interval%evaluate(output_row_t(k), interval%length)
      if (state(1) <= level) then
         ! any value above the level records the separation; the maximum itself is not needed
         if (interval%exceeds(output_row_t(k), level)) state(1) = huge(1.0_wp)
      end if
      call record_separation(contact_sums, state(1), level)
   end subroutine check_separation

   !> Add the span of an interval that lies within one block. Statistics refer to displacements upwards from the
   !> undeformed beam, y = s (gap + s d) with the sign s of a contact and the coordinate d of its surface. `integrate`
   !> gives the integrals of gap + s d; `evaluate` and searches give the gap, which an output row with factor s and
   !> offset d converts to y.
   subroutine add_span(interval, span, block, blocks)
      class(interval_t), intent(inout) :: interval
      !> Beginning and end of the span, since the start of the interval
      real(wp), intent(in) :: span(2)
      integer, intent(in) :: block
      type(block_sums_t), intent(inout) :: blocks

      type(observed_contact_t) :: contact
      ! opposite contact at the same point of the beam, whose displacement is the same
      type(observed_contact_t) :: opposite
      ! integrals of the rows over the span
      real(wp) :: integrals(2*interval%contacts + 1)
      ! integrals of the squares of the rows over the span
      real(wp) :: square_integrals(2*interval%contacts + 1)
      ! minimum force of the block, and maximum force of the span or a lower bound of the maxima known before
      real(wp) :: force(2)
      ! number of a contact at the tip, 0: there is none
      integer :: at_tip
      integer :: k, row

      if (blocks%has_acceleration) call add_accelerations(interval, span, block, blocks)
      call interval%integrate(span, integrals, square_integrals)
      at_tip = 0
      do k = 1, interval%contacts
         contact = interval%contact(k)
         if (contact%is_at_tip) at_tip = contact%number
         associate (contact_sums => blocks%contact(contact%number), sign => contact%sign)
            associate (sums => contact_sums%sums(:, block))
               sums([sum_displacement, sum_square_displacement]) = sums([sum_displacement, sum_square_displacement]) &
                  + [sign*integrals(k), square_integrals(k)]
               if (contact%has_zero_gap) then
                  call include_range(sign*contact%signed_height*[1.0_wp, 1.0_wp], &
                     sums(minimum_displacement:maximum_displacement))
               else if (contact%first_at_place < k) then
                  opposite = interval%contact(contact%first_at_place)
                  call include_range(blocks%contact(opposite%number)%sums(minimum_displacement:maximum_displacement, &
                     block), sums(minimum_displacement:maximum_displacement))
               else
                  call widen_range(interval, output_row_t(k, sign, sign*contact%signed_height), span, &
                     sums(minimum_displacement:maximum_displacement), &
                     blocks%search_state(minimum_displacement:maximum_displacement))
               end if
            end associate
            associate (sums => contact_sums%sums(:, block))
               sums(sum_work) = sums(sum_work) + (interval%dissipated(k, span(2)) &
                  - interval%dissipated(k, span(1)))
               if (.not. contact%is_closed) then
                  sums(minimum_force) = 0.0_wp
                  cycle
               end if
               force = [sums(minimum_force), 0.0_wp]
               ! only a force above the maxima of the impact and of the block changes these maxima
               if (contact_sums%count > 0) force(2) = min(contact_sums%impacts(contact_sums%count)%force, &
                  sums(maximum_force))
               row = interval%force_row(k)
               if (contact%has_finite_force) call widen_range(interval, output_row_t(row), span, force, &
                  blocks%search_state(minimum_force:maximum_force), lower_limit=0.0_wp)
               sums(minimum_force) = force(1)
            end associate
            call add_contact(contact_sums, interval%start + span(1), interval%start + span(2), block, &
               [integrals(row), square_integrals(row)], force(2))
         end associate
      end do
      row = interval%tip_row()
      associate (sums => blocks%tip%sums(:, block), search_state => blocks%search_state)
         ! these sums are integrals over time
         sums([sum_tip, sum_square_tip]) = sums([sum_tip, sum_square_tip]) + [integrals(row), square_integrals(row)]
         if (at_tip > 0) then
            call include_range(blocks%contact(at_tip)%sums(minimum_displacement:maximum_displacement, block), &
               sums(minimum_tip:maximum_tip))
            search_state(minimum_tip:maximum_tip)%tolerance = max(search_state(minimum_tip:maximum_tip)%tolerance, &
               search_state(minimum_displacement:maximum_displacement)%tolerance)
         else
            call widen_range(interval, output_row_t(row), span, sums(minimum_tip:maximum_tip), &
               search_state(minimum_tip:maximum_tip))
         end if
      end associate
   end subroutine add_span

   !> Add the accelerations on a span, the second derivatives of the displacements at contacts and of the tip.
   subroutine add_accelerations(interval, span, block, blocks)
      class(interval_t), intent(inout) :: interval
      !> Beginning and end of the span, since the start of the interval
      real(wp), intent(in) :: span(2)
      integer, intent(in) :: block
      type(block_sums_t), intent(inout) :: blocks

      type(observed_contact_t) :: contact
      real(wp), dimension(interval%tip_row()) :: integrals, square_integrals
      integer :: k

      call interval%integrate(span, integrals, square_integrals, order=2)
      k = interval%tip_row()
      associate (sums => blocks%tip%sums(:, block))
         sums(sum_square_tip_acceleration) = sums(sum_square_tip_acceleration) + square_integrals(k)
         call widen_range(interval, output_row_t(k, order=2), span, &
            sums(minimum_tip_acceleration:maximum_tip_acceleration), &
            blocks%search_state(minimum_tip_acceleration:maximum_tip_acceleration))
      end associate
      do k = 1, interval%contacts
         contact = interval%contact(k)
         associate (sums => blocks%contact(contact%number)%sums(:, block))
            if (contact%has_zero_gap) then
               sums(minimum_acceleration) = min(sums(minimum_acceleration), 0.0_wp)
               sums(maximum_acceleration) = max(sums(maximum_acceleration), 0.0_wp)
               cycle
            end if
            sums(sum_square_acceleration) = sums(sum_square_acceleration) + square_integrals(k)
            call widen_range(interval, output_row_t(k, contact%sign, order=2), span, &
               sums(minimum_acceleration:maximum_acceleration), &
               blocks%search_state(minimum_acceleration:maximum_acceleration))
         end associate
      end do
   end subroutine add_accelerations

   !> Widen a range (minimum, maximum) by the values of a row on a span.
   subroutine widen_range(interval, row, span, range, search_state, lower_limit)
      class(interval_t), intent(inout) :: interval
      type(output_row_t), intent(in) :: row
      real(wp), intent(in) :: span(2)
      real(wp), intent(inout) :: range(2)
      !> Tolerance of the searches for the minimum and for the maximum, and effort that remains for them
      type(extreme_search_t), intent(inout) :: search_state(2)
      !> Value below which the row never falls; absent: there is none
      real(wp), intent(in), optional :: lower_limit

      real(wp) :: bounds(2), negated_minimum, scale, state(2)
      integer :: i

      bounds = interval%range_of(row)
      if (.not. (bounds(1) < range(1) .or. bounds(2) > range(2))) return
      ! a search between known bounds starts with the ends
      if (bounds(2) >= huge(1.0_wp) .or. range(1) > range(2)) then
         do i = 1, 2
            state = interval%evaluate(row, span(i))
            call include_range([state(1), state(1)], range)
         end do
      end if
      ! magnitude to which the tolerance of the extremes refers
      scale = maxval(abs(range))
      if (bounds(2) > range(2)) call raise_maximum(interval, output_row_t(row%number, row%factor, row%offset, scale, &
         order=row%order), span, range(2), search_state(2))
      if (present(lower_limit)) then
         range(1) = max(range(1), lower_limit)
         if (.not. range(1) > lower_limit) return
      end if
      if (.not. bounds(1) < range(1)) return
      negated_minimum = -range(1)
      scale = maxval(abs(range))
      call raise_maximum(interval, output_row_t(row%number, -row%factor, -row%offset, scale, order=row%order), span, &
         negated_minimum, search_state(1))
      range(1) = -negated_minimum
   end subroutine widen_range

   !> Widen a range by another range.
   pure subroutine include_range(other, range)
      real(wp), intent(in) :: other(2)
      real(wp), intent(inout) :: range(2)

      range = [min(range(1), other(1)), max(range(2), other(2))]
   end subroutine include_range

   !> Raise a known maximum of a row, if the row exceeds it.
   subroutine raise_maximum(interval, row, span, known_maximum, search_state)
      class(interval_t), intent(inout) :: interval
      type(output_row_t), intent(in) :: row
      real(wp), intent(in) :: span(2)
      real(wp), intent(inout) :: known_maximum
      type(extreme_search_t), intent(inout) :: search_state

      type(peak_t) :: peak

      call interval%seek_peak(row, span, known_maximum, peak, search_state)
      if (peak%is_found) known_maximum = peak%value
   end subroutine raise_maximum

end module interval_statistics
