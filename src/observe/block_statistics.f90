!> Statistics of a run from sums over equal blocks of time (docs/theory.md, section 20). During the run integrals are
!> added as phases or steps end, and impacts are formed from events and closed contacts; at the end of the run the
!> statistics follow as quotients of sums, with confidence intervals from the scatter of the blocks.
!>
!> Successive contacts belong to one impact unless between them the beam rises above the hop tolerance and a pause
!> longer than `min_pause` passes.
module block_statistics
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use distributions, only: student_quantile
   use kinds, only: wp
   use measure_list, only: first_statistic, measure_named, statistics_of_stop
   use response_types, only: event_capture, event_contact, event_impact, response_t
   use run_settings, only: end_of_run, run_settings_t
   use statistic_types, only: find_statistics, forms, minima, block_sums_t, contact_sums_t, impact_t, &
      maximum_acceleration, maximum_displacement, maximum_force, maximum_impulse, maximum_tip, &
      maximum_tip_acceleration, maximum_velocity, minimum_acceleration, minimum_displacement, minimum_force, &
      minimum_tip, minimum_tip_acceleration, run_statistics_t, statistic_count, sum_contact, sum_count, &
      sum_displacement, sum_force, sum_impact_impulse, sum_impacts, sum_impulse, sum_square_acceleration, &
      sum_square_displacement, sum_square_force, sum_square_tip, sum_square_tip_acceleration, sum_time, sum_tip, &
      sum_velocity, sum_work
   implicit none (type, external)
   private
   public :: open_blocks, clear_blocks, blocks_begun, add_events, add_contact, record_separation
   public :: finish_blocks, finish_statistics

   !> Confidence level of the intervals
   real(wp), parameter :: confidence = 0.95_wp

contains

   !> Allocate the sums of a run.
   subroutine open_blocks(settings, has_finite_force, release_contact, blocks)
      !> Settings with &statistics
      type(run_settings_t), intent(in) :: settings
      !> Whether the force of each contact is finite, in the scene's order
      logical, intent(in) :: has_finite_force(:)
      !> Number of the release contact, to which histories refer; 0: there is none
      integer, intent(in) :: release_contact
      !> The sums of the run, at their initial values
      type(block_sums_t), intent(out) :: blocks

      integer :: i, k
      real(wp) :: end

      associate (requested => settings%statistics)
         end = min(requested%end, end_of_run(settings%response))
         allocate (blocks%edge(0:requested%blocks))
         blocks%edge = [(requested%start + (end - requested%start)*real(i, wp)/real(requested%blocks, wp), i=0, &
            requested%blocks)]
         blocks%edge(requested%blocks) = end
         blocks%min_pause = requested%rest
         blocks%hop_tolerance = settings%response%hop_tolerance
         blocks%threshold = requested%threshold/settings%height_ratio
         blocks%classes = requested%classes
         blocks%has_acceleration = requested%acceleration
      end associate
      blocks%force_scale = settings%height_ratio
      blocks%release_contact = release_contact
      allocate (blocks%contact(size(has_finite_force)))
      do k = 1, size(has_finite_force)
         call open_contact(has_finite_force(k), blocks%edge, blocks%contact(k))
      end do
      call open_contact(.true., blocks%edge, blocks%tip)
   end subroutine open_blocks

   !> Allocate the sums of a contact.
   subroutine open_contact(has_finite_force, edge, contact)
      !> Whether the force of the contact is finite
      logical, intent(in) :: has_finite_force
      !> Instants between the blocks, tau, [0:blocks]
      real(wp), intent(in) :: edge(0:)
      type(contact_sums_t), intent(inout) :: contact

      integer :: blocks

      blocks = ubound(edge, 1)
      contact%has_finite_force = has_finite_force
      allocate (contact%sums(sum_count, blocks))
      call clear_blocks((edge(blocks) - edge(0))/real(blocks, wp), 1, blocks, contact%sums)
      allocate (contact%impacts(16))
   end subroutine open_contact

   !> Set the sums of some blocks to their initial values.
   pure subroutine clear_blocks(length, first, last, sums)
      !> Length of each block, tau; the same for all blocks, so that equal values in them have no scatter by rounding
      real(wp), intent(in) :: length
      !> Numbers of the first and the last of these blocks
      integer, intent(in) :: first, last
      !> Sums of all blocks, [sums, blocks]
      real(wp), intent(inout) :: sums(:, :)

      sums(:, first:last) = 0.0_wp
      sums(sum_time, first:last) = length
      sums([maximum_displacement, maximum_tip, maximum_acceleration, maximum_tip_acceleration], first:last) = &
         -huge(1.0_wp)
      sums(minima, first:last) = huge(1.0_wp)
   end subroutine clear_blocks

   !> Index of the block that contains an instant; 0: no block contains it.
   pure integer function block_at(blocks, tau)
      type(block_sums_t), intent(in) :: blocks
      real(wp), intent(in) :: tau

      associate (last => ubound(blocks%edge, 1))
         block_at = 0
         if (tau <= blocks%edge(last)) block_at = min(blocks_begun(blocks, tau), last)
      end associate
   end function block_at

   !> Number of blocks that have begun at an instant; from the end of the last block on, the number of blocks plus one.
   pure integer function blocks_begun(blocks, tau)
      type(block_sums_t), intent(in) :: blocks
      !> Instant, tau
      real(wp), intent(in) :: tau

      associate (edge => blocks%edge, last => ubound(blocks%edge, 1))
         ! the blocks are equally spaced, so this index is right except for rounding
         blocks_begun = int(min(max((tau - edge(0))/((edge(last) - edge(0))/real(last, wp)), 0.0_wp), real(last, wp)))
         do while (blocks_begun <= last)
            if (edge(blocks_begun) > tau) exit
            blocks_begun = blocks_begun + 1
         end do
         do while (blocks_begun > 0)
            if (edge(blocks_begun - 1) <= tau) exit
            blocks_begun = blocks_begun - 1
         end do
      end associate
   end function blocks_begun

   !> Begin impacts at new events, and add the impulses of all new events. The impulse of a capture at the beginning of
   !> a low flight cancels the rebound velocity, so it is negative, that is, directed towards the stop.
   subroutine add_events(blocks, response)
      type(block_sums_t), intent(inout) :: blocks
      !> The run; events after the first `blocks%seen` are new
      type(response_t), intent(in) :: response

      integer :: block, i

      do i = blocks%seen + 1, response%event_count
         associate (event => response%events(i), contact => blocks%contact(response%events(i)%contact))
            block = block_at(blocks, event%tau)
            if (any(event%kind == [event_impact, event_capture, event_contact])) then
               call begin_contact(blocks, contact, event%tau, abs(event%velocity_before), block > 0)
            end if
            if (block > 0) contact%sums(sum_work, block) = contact%sums(sum_work, block) - event%energy_change
            if (.not. abs(event%impulse) > 0.0_wp) cycle
            if (contact%count == 0) call begin_impact(contact, event%tau, 0.0_wp, .false.)
            associate (impact => contact%impacts(contact%count))
               impact%until = event%tau
               if (block == 0) cycle
               impact%impulse = impact%impulse + event%impulse
               contact%sums(sum_impulse, block) = contact%sums(sum_impulse, block) + event%impulse
            end associate
         end associate
      end do
      blocks%seen = response%event_count
   end subroutine add_events

   !> Begin a contact. The contact begins a new impact if the beam has risen above the hop tolerance since the last
   !> impact, and if more time than `min_pause` has passed since that impact ended. The first impact of a run, before
   !> which the beam need not have risen, counts only if its velocity d eta/d tau exceeds the hop tolerance (compared as
   !> dimensionless numbers), so that a start at rest on a contact is no impact.
   pure subroutine begin_contact(blocks, contact, tau, velocity, is_within)
      type(block_sums_t), intent(in) :: blocks
      !> Sums of the contact, a component of `blocks`
      type(contact_sums_t), intent(inout) :: contact
      real(wp), intent(in) :: tau
      !> Velocity towards the stop
      real(wp), intent(in) :: velocity
      !> Whether the instant lies within the blocks
      logical, intent(in) :: is_within

      logical :: has_separated

      has_separated = contact%has_separated
      contact%has_separated = .false.
      if (contact%count > 0) then
         if (.not. has_separated .or. tau - contact%impacts(contact%count)%until <= blocks%min_pause) return
      end if
      call begin_impact(contact, tau, velocity, &
         is_within .and. velocity > merge(0.0_wp, blocks%hop_tolerance, has_separated))
   end subroutine begin_contact

   !> Append an impact.
   pure subroutine begin_impact(contact, tau, velocity, counts)
      type(contact_sums_t), intent(inout) :: contact
      real(wp), intent(in) :: tau
      !> Velocity towards the stop
      real(wp), intent(in) :: velocity
      !> Whether the impact counts in the statistics
      logical, intent(in) :: counts

      ! twice as many; the second half is overwritten
      if (contact%count == size(contact%impacts)) contact%impacts = [contact%impacts, contact%impacts]
      contact%count = contact%count + 1
      contact%impacts(contact%count) = impact_t(tau=tau, until=tau, velocity=velocity, counts=counts)
   end subroutine begin_impact

   !> Record that the beam has separated from a contact, if its gap exceeds the hop tolerance.
   elemental subroutine record_separation(contact, height, hop_tolerance)
      type(contact_sums_t), intent(inout) :: contact
      !> Maximum gap to the undeformed contact
      real(wp), intent(in) :: height
      real(wp), intent(in) :: hop_tolerance

      contact%has_separated = contact%has_separated .or. height > hop_tolerance
   end subroutine record_separation

   !> Add a closed contact, or the part of a closed contact within a block.
   pure subroutine add_contact(contact, from, to, block, integrals, max_force)
      type(contact_sums_t), intent(inout) :: contact
      !> Beginning of the contact or of its part, tau
      real(wp), intent(in) :: from
      !> End of the contact or of its part, tau
      real(wp), intent(in) :: to
      !> Index of the block; 0: the contact lies outside the blocks, or its integrals are added separately
      integer, intent(in) :: block
      !> Integrals of the force and of its square
      real(wp), intent(in) :: integrals(2)
      !> Maximum force
      real(wp), intent(in) :: max_force

      if (contact%count == 0) call begin_impact(contact, from, 0.0_wp, .false.)
      associate (impact => contact%impacts(contact%count))
         impact%until = to
         if (block == 0) return
         impact%impulse = impact%impulse + integrals(1)
         impact%force = max(impact%force, max_force)
      end associate
      associate (sums => contact%sums(:, block))
         sums(sum_contact) = sums(sum_contact) + (to - from)
         sums([sum_force, sum_square_force]) = sums([sum_force, sum_square_force]) + integrals
         sums(sum_impulse) = sums(sum_impulse) + integrals(1)
         sums(maximum_force) = max(sums(maximum_force), max_force)
      end associate
   end subroutine add_contact

   !> Store the statistics in the response, and the statistics of the whole run among its measures.
   subroutine finish_statistics(blocks, response)
      type(block_sums_t), intent(inout) :: blocks
      !> The run, with its measures if they are requested
      type(response_t), intent(inout) :: response

      integer :: k

      allocate (response%statistics)
      call finish_blocks(blocks, response%statistics, response%contacts%owner)
      if (.not. allocated(response%measures)) return
      associate (measures => response%measures, statistics => response%statistics)
         if (allocated(statistics%of_stop)) measures%of_stops = statistics%of_stop([( &
            measure_named(statistics_of_stop(k)%name) - first_statistic + 1, k=1, size(statistics_of_stop))], :)
         measures%statistics = statistics%value(:, 0)
         measures%extremes_tolerance = max(measures%extremes_tolerance, maxval(statistics%tolerance))
      end associate
   end subroutine finish_statistics

   !> Compute the statistics at the end of the run.
   subroutine finish_blocks(blocks, statistics, owner)
      type(block_sums_t), intent(inout) :: blocks
      type(run_statistics_t), intent(out) :: statistics
      !> Index in `measured_groups` of the stop or body of each contact, 0: none
      integer, intent(in) :: owner(:)

      integer, parameter :: of_tip(*) = [sum_tip, sum_square_tip, minimum_tip, maximum_tip, &
         sum_square_tip_acceleration, minimum_tip_acceleration, maximum_tip_acceleration]
      ! sums to which forces contribute linearly
      integer, parameter :: of_force(*) = [sum_force, sum_impulse, maximum_force, minimum_force]
      real(wp), allocatable :: half_width(:), in_block(:, :)
      ! maximum size of an impact on contacts of each kind
      real(wp) :: max_size(2)
      real(wp) :: quantile
      integer :: k, n

      n = size(blocks%tip%sums, 2)
      quantile = student_quantile(confidence, max(n - 1, 1))
      associate (contacts => size(blocks%contact))
         allocate (statistics%edge(0:n), source=blocks%edge)
         allocate (statistics%value(statistic_count, 0:contacts), statistics%half_width(statistic_count, 0:contacts), &
            statistics%in_block(statistic_count, n, 0:contacts), statistics%class_edge(blocks%classes, contacts), &
            statistics%class_count(blocks%classes, contacts))
         allocate (statistics%has_finite_force(contacts), statistics%is_maximum_unfinished(contacts))
         statistics%has_finite_force(:) = blocks%contact%has_finite_force
         ! the tolerance of a statistic is that of the search for the extreme in its formula
         statistics%tolerance([(measure_named(forms(k)%name) - first_statistic + 1, k=1, statistic_count)]) &
            = blocks%search_state(forms%numerator)%tolerance
         max_size = 0.0_wp
         do k = 1, contacts
            associate (contact => blocks%contact(k))
               contact%sums(of_tip, :) = blocks%tip%sums(of_tip, :)
               call count_impacts(blocks, contact)
               associate (impacts => contact%impacts(:contact%count))
                  statistics%is_maximum_unfinished(k) = any(impacts%counts .and. impacts%until >= blocks%edge(n) .and. &
                     impacts%impulse >= maxval(contact%sums(maximum_impulse, :)))
               end associate
               max_size(kind_of(contact)) = maxval([max_size(kind_of(contact)), impact_sizes(blocks, contact)])
            end associate
         end do
         do k = 1, contacts
            associate (contact => blocks%contact(k))
               call classify(impact_sizes(blocks, contact), max_size(kind_of(contact)), statistics%class_edge(:, k), &
                  statistics%class_count(:, k))
               ! to Pbar
               contact%sums(of_force, :) = blocks%force_scale*contact%sums(of_force, :)
               contact%sums(sum_square_force, :) = blocks%force_scale**2*contact%sums(sum_square_force, :)
            end associate
            call gather_contacts(blocks, [(n == k, n=1, contacts)], k, quantile, statistics%value(:, k), &
               statistics%half_width(:, k), statistics%in_block(:, :, k))
         end do
         call gather_contacts(blocks, [(.true., k=1, contacts)], blocks%release_contact, quantile, &
            statistics%value(:, 0), statistics%half_width(:, 0), statistics%in_block(:, :, 0))
         if (contacts == 0) return
         if (all(owner == owner(1))) return
         allocate (statistics%of_stop(statistic_count, maxval(owner)), source=ieee_value(1.0_wp, ieee_quiet_nan))
         half_width = statistics%half_width(:, 0)
         in_block = statistics%in_block(:, :, 0)
         do k = 1, maxval(owner)
            if (any(owner == k)) call gather_contacts(blocks, owner == k, findloc(owner, k, dim=1), quantile, &
               statistics%of_stop(:, k), half_width, in_block)
         end do
      end associate
   end subroutine finish_blocks

   !> Statistics of some contacts together: of the sums of their forces, impacts, times in contact and dissipated
   !> energies.
   pure subroutine gather_contacts(blocks, is_selected, displaced, quantile, value, half_width, in_block)
      !> Sums with impacts, forces as Pbar
      type(block_sums_t), intent(in) :: blocks
      !> Whether each contact belongs to the selected contacts
      logical, intent(in) :: is_selected(:)
      !> Number of the contact whose displacements the statistics describe; 0: there is none
      integer, intent(in) :: displaced
      !> Quantile of Student's distribution for the number of blocks
      real(wp), intent(in) :: quantile
      !> Statistics of the run, [statistic_count]
      real(wp), intent(out) :: value(:)
      !> Half widths of their confidence intervals, [statistic_count]
      real(wp), intent(out) :: half_width(:)
      !> Values in each block, [statistic_count, blocks]
      real(wp), intent(out) :: in_block(:, :)

      integer, parameter :: of_displacement(*) = [sum_displacement, sum_square_displacement, minimum_displacement, &
         maximum_displacement, sum_square_acceleration, minimum_acceleration, maximum_acceleration]
      integer, parameter :: of_acceleration(*) = [sum_square_acceleration, minimum_acceleration, &
         maximum_acceleration, sum_square_tip_acceleration, minimum_tip_acceleration, maximum_tip_acceleration]
      ! sums of all selected contacts together; the displacements are those of one contact and of the tip
      real(wp) :: combined(sum_count, size(blocks%tip%sums, 2))
      logical :: is_missing(sum_count)
      integer :: k

      combined = blocks%tip%sums
      do k = 1, size(blocks%contact)
         if (.not. is_selected(k)) cycle
         associate (sums => blocks%contact(k)%sums)
            combined(sum_contact:sum_impact_impulse, :) = combined(sum_contact:sum_impact_impulse, :) &
               + sums(sum_contact:sum_impact_impulse, :)
            combined(sum_work, :) = combined(sum_work, :) + sums(sum_work, :)
            combined(maximum_force:maximum_impulse, :) = max(combined(maximum_force:maximum_impulse, :), &
               sums(maximum_force:maximum_impulse, :))
            combined(minimum_force, :) = min(combined(minimum_force, :), sums(minimum_force, :))
         end associate
      end do
      is_missing = .false.
      is_missing([sum_square_force, maximum_force, minimum_force]) = &
         .not. all(blocks%contact%has_finite_force .or. .not. is_selected)
      is_missing(minimum_force) = is_missing(minimum_force) .or. .not. any(is_selected)
      is_missing(of_displacement) = displaced == 0
      if (.not. blocks%has_acceleration) is_missing(of_acceleration) = .true.
      if (displaced > 0) combined(of_displacement, :) = blocks%contact(displaced)%sums(of_displacement, :)
      call find_statistics(combined, is_missing, quantile, value, half_width, in_block)
   end subroutine gather_contacts

   !> Add the impacts to the sums of the blocks in which they begin.
   subroutine count_impacts(blocks, contact)
      type(block_sums_t), intent(in) :: blocks
      type(contact_sums_t), intent(inout) :: contact

      integer :: i

      do i = 1, contact%count
         associate (impact => contact%impacts(i))
            impact%counts = impact%counts .and. (.not. contact%has_finite_force .or. impact%force >= blocks%threshold)
            if (.not. impact%counts) cycle
            associate (sums => contact%sums(:, block_at(blocks, impact%tau)))
               sums([sum_impacts, sum_velocity, sum_impact_impulse]) = &
                  sums([sum_impacts, sum_velocity, sum_impact_impulse]) + [1.0_wp, impact%velocity, impact%impulse]
               sums([maximum_velocity, maximum_impulse]) = max(sums([maximum_velocity, maximum_impulse]), &
                  [impact%velocity, impact%impulse])
            end associate
         end associate
      end do
   end subroutine count_impacts

   !> 1 if the impacts of a contact are measured by their maximum force, 2 if by their impulse.
   pure integer function kind_of(contact) result(kind)
      type(contact_sums_t), intent(in) :: contact

      kind = merge(1, 2, contact%has_finite_force)
   end function kind_of

   !> Maximum forces of the impacts of a contact if its force is finite, else their impulses.
   function impact_sizes(blocks, contact) result(sizes)
      type(block_sums_t), intent(in) :: blocks
      type(contact_sums_t), intent(in) :: contact
      real(wp), allocatable :: sizes(:)

      associate (impacts => contact%impacts(:contact%count))
         if (contact%has_finite_force) then
            sizes = pack(blocks%force_scale*impacts%force, impacts%counts)
         else
            sizes = pack(impacts%impulse, impacts%counts)
         end if
      end associate
   end function impact_sizes

   !> Histogram of the impacts of a contact. Contacts of one kind have the same classes, so that their histograms can be
   !> compared.
   subroutine classify(sizes, max_size, edge, number)
      !> Force or impulse of each impact
      real(wp), intent(in) :: sizes(:)
      !> Maximum of all contacts of the same kind
      real(wp), intent(in) :: max_size
      !> Upper edges of the classes, which have equal widths from 0 to the maximum
      real(wp), intent(out) :: edge(:)
      !> Number of impacts in each class
      integer, intent(out) :: number(:)

      integer :: i, place

      edge = [(max_size*real(i, wp)/real(size(edge), wp), i=1, size(edge))]
      edge(size(edge)) = max_size
      number = 0
      do i = 1, size(sizes)
         place = min(count(edge < sizes(i)) + 1, size(edge))
         number(place) = number(place) + 1
      end do
   end subroutine classify

end module block_statistics
