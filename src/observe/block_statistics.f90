!> Statistics of a run from sums over equal blocks of time (docs/theory.md, section 20). During the run integrals are
!> added as phases or steps end, and impacts are formed from events and closed contacts; at the end of the run the
!> statistics follow as quotients of sums, with confidence intervals from the scatter of the blocks.
!>
!> An impact comprises all contact between two flights that exceed the hop tolerance and last longer than `rest`.
module block_statistics
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kinds, only: wp
   use measure_list, only: first_statistic, measure_named
   use response_types, only: event_capture, event_contact, event_impact, response_t
   use run_settings, only: end_of_run, run_settings_t
   use statistic_types, only: block_sums_t, impact_t, minimum_displacement, minimum_tip, run_statistics_t, &
      statistic_count, sum_contact, sum_count, sum_displacement, sum_force, sum_impact_impulse, sum_impacts, &
      sum_impulse, sum_square_displacement, sum_square_force, sum_square_tip, sum_time, sum_tip, sum_velocity, &
      contact_sums_t, maximum_displacement, maximum_force, maximum_impulse, maximum_tip, maximum_velocity
   use student, only: student_quantile
   implicit none (type, external)
   private
   public :: open_blocks, empty_block, blocks_begun, add_events, add_contact, record_flight
   public :: finish_blocks, finish_statistics

   !> Formula by which a statistic follows from the sums of a contact.
   type :: form_t
      character(24) :: name
      !> Index of the sum, or of the numerator of a quotient, and index of the denominator; 0: the statistic is not a
      !> quotient
      integer :: numerator
      integer :: denominator = 0
      !> The statistic is the square root of the quotient
      logical :: is_root = .false.
   end type form_t

   type(form_t), parameter :: forms(statistic_count) = [ &
      form_t('mean_force', sum_impulse, sum_time), &
      form_t('rms_force', sum_square_force, sum_time, .true.), &
      form_t('maximum_force', maximum_force), &
      form_t('mean_contact_force', sum_force, sum_contact), &
      form_t('rms_contact_force', sum_square_force, sum_contact, .true.), &
      form_t('impact_rate', sum_impacts, sum_time), &
      form_t('mean_impact_velocity', sum_velocity, sum_impacts), &
      form_t('maximum_impact_velocity', maximum_velocity), &
      form_t('mean_impulse', sum_impact_impulse, sum_impacts), &
      form_t('maximum_impulse', maximum_impulse), &
      form_t('contact_time', sum_contact), &
      form_t('contact_share', sum_contact, sum_time), &
      form_t('mean_displacement', sum_displacement, sum_time), &
      form_t('rms_displacement', sum_square_displacement, sum_time, .true.), &
      form_t('minimum_displacement', minimum_displacement), &
      form_t('maximum_displacement', maximum_displacement), &
      form_t('mean_tip', sum_tip, sum_time), &
      form_t('rms_tip', sum_square_tip, sum_time, .true.), &
      form_t('minimum_tip', minimum_tip), &
      form_t('maximum_tip', maximum_tip)]

   !> Sums that are extremes
   integer, parameter :: maxima(*) = [maximum_force, maximum_velocity, maximum_impulse, &
      maximum_displacement, maximum_tip]
   integer, parameter :: minima(*) = [minimum_displacement, minimum_tip]

   !> Confidence level of the intervals
   real(wp), parameter :: confidence = 0.95_wp

contains

   !> Allocate the sums of a run.
   subroutine open_blocks(settings, yields, release_contact, blocks)
      !> Settings with &statistics
      type(run_settings_t), intent(in) :: settings
      !> Whether each contact is compliant, in the scene's order
      logical, intent(in) :: yields(:)
      !> Number of the contact from which the beam is released; 0: there is none
      integer, intent(in) :: release_contact
      type(block_sums_t), intent(out) :: blocks

      integer :: i, k
      real(wp) :: end

      associate (asked => settings%statistics)
         end = min(asked%end, end_of_run(settings%response))
         allocate (blocks%edge(0:asked%blocks))
         blocks%edge = [(asked%start + (end - asked%start)*real(i, wp)/real(asked%blocks, wp), i=0, asked%blocks)]
         blocks%edge(asked%blocks) = end
         blocks%rest = asked%rest
         blocks%hop_tolerance = settings%response%hop_tolerance
         blocks%threshold = asked%threshold/settings%height_ratio
         blocks%classes = asked%classes
      end associate
      blocks%force_scale = settings%height_ratio
      blocks%release_contact = release_contact
      allocate (blocks%contact(size(yields)))
      do k = 1, size(yields)
         call open_contact(yields(k), blocks%edge, blocks%contact(k))
      end do
      call open_contact(.true., blocks%edge, blocks%tip)
   end subroutine open_blocks

   !> Allocate the sums of a contact.
   subroutine open_contact(yields, edge, contact)
      !> The contact is compliant
      logical, intent(in) :: yields
      !> Instants between the blocks, tau, [0:blocks]
      real(wp), intent(in) :: edge(0:)
      type(contact_sums_t), intent(inout) :: contact

      integer :: blocks, i

      blocks = ubound(edge, 1)
      contact%yields = yields
      allocate (contact%sums(sum_count, blocks))
      do i = 1, blocks
         contact%sums(:, i) = empty_block(edge(i - 1:i))
      end do
      allocate (contact%impacts(16))
   end subroutine open_contact

   !> Initial sums of a block.
   pure function empty_block(edge) result(sums)
      !> Beginning and end of the block, tau
      real(wp), intent(in) :: edge(2)
      real(wp) :: sums(sum_count)

      sums = 0.0_wp
      sums(sum_time) = edge(2) - edge(1)
      sums([maximum_displacement, maximum_tip]) = -huge(1.0_wp)
      sums(minima) = huge(1.0_wp)
   end function empty_block

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
         blocks_begun = int(min(max((tau - edge(0))/width_of_blocks(blocks), 0.0_wp), real(last, wp)))
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

   !> Length of a block, tau; all blocks have the same length except for rounding.
   pure function width_of_blocks(blocks) result(width)
      type(block_sums_t), intent(in) :: blocks
      real(wp) :: width

      associate (last => ubound(blocks%edge, 1))
         width = (blocks%edge(last) - blocks%edge(0))/real(last, wp)
      end associate
   end function width_of_blocks

   !> Begin impacts at new events, and add the impulses of all new events. A capture at the beginning of a low flight
   !> takes back the velocity of the rebound, so its impulse is negative, that is, directed towards the stop.
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
   !> impact, and if more time than `rest` has passed since that impact ended. If the run starts in contact, the impact
   !> counts only if its velocity, d eta/d tau, exceeds the number that the hop tolerance is for eta: both are
   !> dimensionless.
   pure subroutine begin_contact(blocks, contact, tau, velocity, is_within)
      type(block_sums_t), intent(in) :: blocks
      !> Sums of the contact, a component of `blocks`
      type(contact_sums_t), intent(inout) :: contact
      real(wp), intent(in) :: tau
      !> Velocity towards the stop
      real(wp), intent(in) :: velocity
      !> The instant lies within the blocks
      logical, intent(in) :: is_within

      logical :: has_flown

      has_flown = contact%has_flown
      contact%has_flown = .false.
      if (contact%count > 0) then
         if (.not. has_flown .or. tau - contact%impacts(contact%count)%until <= blocks%rest) return
      end if
      call begin_impact(contact, tau, velocity, &
         is_within .and. velocity > merge(0.0_wp, blocks%hop_tolerance, has_flown))
   end subroutine begin_contact

   !> Append an impact.
   pure subroutine begin_impact(contact, tau, velocity, counts)
      type(contact_sums_t), intent(inout) :: contact
      real(wp), intent(in) :: tau
      !> Velocity towards the stop
      real(wp), intent(in) :: velocity
      !> The impact counts in the statistics
      logical, intent(in) :: counts

      type(impact_t), allocatable :: larger(:)

      if (contact%count == size(contact%impacts)) then
         allocate (larger(2*contact%count))
         larger(:contact%count) = contact%impacts
         call move_alloc(larger, contact%impacts)
      end if
      contact%count = contact%count + 1
      contact%impacts(contact%count) = impact_t(tau=tau, until=tau, velocity=velocity, counts=counts)
   end subroutine begin_impact

   !> Record that the beam has risen above the hop tolerance over a contact, if the height of its flight exceeds it.
   elemental subroutine record_flight(contact, height, hop_tolerance)
      type(contact_sums_t), intent(inout) :: contact
      !> Maximum gap to the undeformed contact
      real(wp), intent(in) :: height
      real(wp), intent(in) :: hop_tolerance

      contact%has_flown = contact%has_flown .or. height > hop_tolerance
   end subroutine record_flight

   !> Add a closed contact, or the part of a closed contact within a block.
   pure subroutine add_contact(contact, from, to, block, integrals, max_force)
      type(contact_sums_t), intent(inout) :: contact
      !> Beginning and end, tau
      real(wp), intent(in) :: from
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

      allocate (response%statistics)
      call finish_blocks(blocks, response%statistics)
      if (.not. allocated(response%measures)) return
      associate (measures => response%measures, statistics => response%statistics)
         measures%statistics = statistics%value(:, 0)
         measures%extremes_tolerance = max(measures%extremes_tolerance, maxval(statistics%tolerance))
      end associate
   end subroutine finish_statistics

   !> Compute the statistics at the end of the run.
   subroutine finish_blocks(blocks, statistics)
      type(block_sums_t), intent(inout) :: blocks
      type(run_statistics_t), intent(out) :: statistics

      integer, parameter :: of_stop(*) = [sum_displacement, sum_square_displacement, minimum_displacement, &
         maximum_displacement]
      integer, parameter :: of_tip(*) = [sum_tip, sum_square_tip, minimum_tip, maximum_tip]
      ! `whole`: sums of all contacts together
      real(wp) :: quantile, whole(sum_count, size(blocks%tip%sums, 2))
      logical :: is_missing(sum_count)
      integer :: k, n

      n = size(blocks%tip%sums, 2)
      quantile = student_quantile(confidence, max(n - 1, 1))
      associate (contacts => size(blocks%contact))
         allocate (statistics%edge(0:n), source=blocks%edge)
         allocate (statistics%value(statistic_count, 0:contacts), statistics%half_width(statistic_count, 0:contacts), &
            statistics%in_block(statistic_count, n, 0:contacts), statistics%class_edge(blocks%classes, contacts), &
            statistics%class_count(blocks%classes, contacts))
         allocate (statistics%yields(contacts))
         statistics%yields(:) = blocks%contact%yields
         statistics%tolerance([(measure_named(forms(k)%name) - first_statistic + 1, k=1, statistic_count)]) &
            = blocks%search_state(forms%numerator)%tolerance
         whole = blocks%tip%sums
         do k = 1, contacts
            associate (contact => blocks%contact(k))
               contact%sums(of_tip, :) = blocks%tip%sums(of_tip, :)
               call count_impacts(blocks, contact)
               call classify(blocks, contact, statistics%class_edge(:, k), statistics%class_count(:, k))
               call scale_forces(blocks%force_scale, contact)
               is_missing = .false.
               is_missing([sum_square_force, maximum_force]) = .not. contact%yields
               call find_statistics(contact%sums, is_missing, quantile, statistics%value(:, k), &
                  statistics%half_width(:, k), statistics%in_block(:, :, k))
               whole(sum_contact:sum_impact_impulse, :) = whole(sum_contact:sum_impact_impulse, :) &
                  + contact%sums(sum_contact:sum_impact_impulse, :)
               whole(maximum_force:maximum_impulse, :) = max(whole(maximum_force:maximum_impulse, :), &
                  contact%sums(maximum_force:maximum_impulse, :))
            end associate
         end do
         is_missing = .false.
         is_missing([sum_square_force, maximum_force]) = .not. all(statistics%yields)
         is_missing(of_stop) = blocks%release_contact == 0
         if (blocks%release_contact > 0) whole(of_stop, :) = blocks%contact(blocks%release_contact)%sums(of_stop, :)
         call find_statistics(whole, is_missing, quantile, statistics%value(:, 0), statistics%half_width(:, 0), &
            statistics%in_block(:, :, 0))
      end associate
   end subroutine finish_blocks

   !> Add the impacts to the sums of the blocks in which they begin.
   subroutine count_impacts(blocks, contact)
      type(block_sums_t), intent(in) :: blocks
      type(contact_sums_t), intent(inout) :: contact

      integer :: i

      do i = 1, contact%count
         associate (impact => contact%impacts(i))
            impact%counts = impact%counts .and. (.not. contact%yields .or. impact%force >= blocks%threshold)
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

   !> Histogram of the maximum forces of impacts; for a rigid contact, of their impulses.
   subroutine classify(blocks, contact, edge, number)
      type(block_sums_t), intent(in) :: blocks
      type(contact_sums_t), intent(in) :: contact
      !> Upper edges of the classes, of equal width from 0 to the maximum, and numbers of impacts in them
      real(wp), intent(out) :: edge(:)
      integer, intent(out) :: number(:)

      real(wp), allocatable :: impact_size(:)
      real(wp) :: max_size
      integer :: i, place

      associate (impacts => contact%impacts(:contact%count))
         if (contact%yields) then
            impact_size = pack(blocks%force_scale*impacts%force, impacts%counts)
         else
            impact_size = pack(impacts%impulse, impacts%counts)
         end if
      end associate
      max_size = maxval([0.0_wp, impact_size])
      edge = [(max_size*real(i, wp)/real(size(edge), wp), i=1, size(edge))]
      edge(size(edge)) = max_size
      number = 0
      do i = 1, size(impact_size)
         place = min(count(edge < impact_size(i)) + 1, size(edge))
         number(place) = number(place) + 1
      end do
   end subroutine classify

   !> Convert forces to Pbar.
   pure subroutine scale_forces(scale, contact)
      !> Pbar per unit of force
      real(wp), intent(in) :: scale
      type(contact_sums_t), intent(inout) :: contact

      integer, parameter :: linear(*) = [sum_force, sum_impulse, maximum_force]

      contact%sums(linear, :) = scale*contact%sums(linear, :)
      contact%sums(sum_square_force, :) = scale**2*contact%sums(sum_square_force, :)
   end subroutine scale_forces

   !> Compute each statistic from the sums of the blocks: its value over all blocks, the half width of its confidence
   !> interval, and its value in each block.
   pure subroutine find_statistics(sums, is_missing, quantile, value, half_width, in_block)
      !> Sums, [sum_count, blocks]
      real(wp), intent(in) :: sums(:, :)
      !> Sums that are not available, [sum_count]
      logical, intent(in) :: is_missing(:)
      !> Quantile of Student's distribution for the number of blocks
      real(wp), intent(in) :: quantile
      real(wp), intent(out) :: value(:)
      real(wp), intent(out) :: half_width(:)
      !> Values in each block, [statistic_count, blocks]
      real(wp), intent(out) :: in_block(:, :)

      type(form_t) :: form
      integer :: i, number

      value = ieee_value(1.0_wp, ieee_quiet_nan)
      half_width = value
      in_block = value(1)
      do number = 1, statistic_count
         form = forms(number)
         i = measure_named(form%name) - first_statistic + 1
         associate (numerator => sums(form%numerator, :))
            if (is_missing(form%numerator)) cycle
            if (form%denominator > 0) then
               call find_quotient(numerator, sums(form%denominator, :), form%is_root, quantile, value(i), &
                  half_width(i), in_block(i, :))
               cycle
            end if
            in_block(i, :) = numerator
            if (any(maxima == form%numerator)) then
               value(i) = maxval(numerator)
            else if (any(minima == form%numerator)) then
               value(i) = minval(numerator)
            else
               value(i) = sum(numerator)
            end if
         end associate
      end do
   end subroutine find_statistics

   !> Quotient of two sums, or its square root. The confidence interval follows from the linearised quotient; a single
   !> block with a nonzero denominator gives no interval.
   pure subroutine find_quotient(numerator, denominator, is_root, quantile, value, half_width, in_block)
      !> Sums of each block, [blocks]
      real(wp), intent(in) :: numerator(:)
      real(wp), intent(in) :: denominator(:)
      logical, intent(in) :: is_root
      real(wp), intent(in) :: quantile
      !> NaN if the denominator is zero
      real(wp), intent(inout) :: value
      real(wp), intent(inout) :: half_width
      real(wp), intent(inout) :: in_block(:)

      real(wp) :: number, quotient, spread
      integer :: i

      do i = 1, size(numerator)
         if (denominator(i) > 0.0_wp) in_block(i) = root_of(numerator(i)/denominator(i))
      end do
      if (.not. sum(denominator) > 0.0_wp) return
      number = real(size(numerator), wp)
      quotient = sum(numerator)/sum(denominator)
      value = root_of(quotient)
      if (count(denominator > 0.0_wp) < 2) return
      spread = sqrt(sum((numerator - quotient*denominator)**2)/(number*(number - 1.0_wp)))
      half_width = quantile*spread*number/sum(denominator)
      if (is_root .and. value > 0.0_wp) half_width = half_width/(2.0_wp*value)

   contains

      pure function root_of(number) result(root)
         real(wp), intent(in) :: number
         real(wp) :: root

         root = number
         if (is_root) root = sqrt(max(number, 0.0_wp))
      end function root_of
   end subroutine find_quotient

end module block_statistics
