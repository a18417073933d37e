!> What engineers ask of a run: how soon, how hard, how long, how high again, when quiet.
!>
!> The displacement of the stop point is taken as a chain of pieces between knots. Knots are the samples
!> and the events, so a bounce between two samples is not lost, and a velocity that jumps at an impact
!> has its two values. Where the velocity was recorded a piece is the cubic with the displacements and
!> velocities of its ends (Hermite); where it was not, a straight line, and the peaks are those of
!> parabolas through three knots.
module response_measures
   use kinds, only: wp
   use response_types, only: event_capture, event_contact, event_impact, is_contact_end, is_contact_start, quiet_energy, &
      quiet_level, response_t
   use scene_types, only: law_three_element, stop_settings_t
   use stop_models, only: make_three_element, three_element_t
   implicit none (type, external)
   private
   public :: response_measures_t, measure_response, quiet_level, rebound_level, rest_energy, find_quiet_instant, &
      find_spent_instant

   !> A flight is a rebound if eta rises above this in it.
   real(wp), parameter :: rebound_level = quiet_level

   type :: response_measures_t
      !> Length of the run, tau
      real(wp) :: duration = 0.0_wp
      !> Impacts of model A, or contacts of model B
      integer :: impacts = 0
      !> Contacts that last: capture to release, contact to separation, or to the end of the run
      real(wp), allocatable :: contact_start(:)
      real(wp), allocatable :: contact_end(:)
      !> Time of the first meeting with the stop, and d eta/d tau before it; meaningless without any
      logical :: has_met_stop = .false.
      real(wp) :: first_impact_tau = 0.0_wp
      real(wp) :: first_impact_velocity = 0.0_wp
      !> Longest and total time in contact
      real(wp) :: longest_contact = 0.0_wp
      real(wp) :: total_contact = 0.0_wp
      !> Highest eta of each rebound, and when; unallocated: eta at the stop was not recorded
      real(wp), allocatable :: peak_eta(:)
      real(wp), allocatable :: peak_tau(:)
      !> When |eta_c| last exceeded `quiet_level`. Not known: eta at the stop was not recorded.
      logical :: knows_quiet = .false.
      !> False: at the end it still does
      logical :: is_quiet = .false.
      real(wp) :: quiet_tau = 0.0_wp
      !> When the energy above that at rest last exceeded `quiet_energy` of the start's. Not known: no ledger.
      logical :: knows_spent = .false.
      !> False: at the end it still does
      logical :: has_spent = .false.
      real(wp) :: spent_tau = 0.0_wp
   end type response_measures_t

   !> Knots of the displacement of the stop point.
   type :: chain_t
      real(wp), allocatable :: tau(:)
      real(wp), allocatable :: eta(:)
      !> Velocity just before and after the knot; unallocated: not recorded
      real(wp), allocatable :: before(:)
      real(wp), allocatable :: after(:)
      !> Number of the knot's event; 0: the knot is a sample
      integer, allocatable :: event(:)
   end type chain_t

contains

   !> Take the measures of a run.
   pure subroutine measure_response(response, duration, measures, energy_at_rest)
      !> The run
      type(response_t), intent(in) :: response
      !> Its length, tau
      real(wp), intent(in) :: duration
      !> What was measured
      type(response_measures_t), intent(out) :: measures
      !> Energy when all motion is over, see `rest_energy`; without it the spending of energy is not measured
      real(wp), intent(in), optional :: energy_at_rest

      type(chain_t) :: chain

      measures%duration = duration
      call measure_events(response, measures)
      if (present(energy_at_rest) .and. allocated(response%energy)) then
         measures%knows_spent = .true.
         call find_spent_instant(response, energy_at_rest, quiet_energy, measures%has_spent, measures%spent_tau)
      end if
      if (.not. allocated(response%displacement_stop) .or. .not. allocated(response%tau)) return
      if (size(response%tau) == 0) return
      call join(response, chain)
      call find_peaks(response, chain, measures)
      measures%knows_quiet = .true.
      call find_quiet(chain, quiet_level, measures%is_quiet, measures%quiet_tau)
   end subroutine measure_response

   !> When |eta_c| last exceeded any level.
   pure subroutine find_quiet_instant(response, level, is_quiet, tau)
      !> The run, with displacement and velocity of the stop point
      type(response_t), intent(in) :: response
      !> The level
      real(wp), intent(in) :: level
      !> False: at the end it still does
      logical, intent(out) :: is_quiet
      !> The instant
      real(wp), intent(out) :: tau

      type(chain_t) :: chain

      call join(response, chain)
      call find_quiet(chain, level, is_quiet, tau)
   end subroutine find_quiet_instant

   !> When the energy above that at rest last exceeded a share of the start's: between samples it is taken to fall
   !> on a straight line.
   pure subroutine find_spent_instant(response, energy_at_rest, share, is_spent, tau)
      !> The run, with the ledger
      type(response_t), intent(in) :: response
      !> Energy when all motion is over
      real(wp), intent(in) :: energy_at_rest
      !> The share
      real(wp), intent(in) :: share
      !> False: at the end it still does
      logical, intent(out) :: is_spent
      !> The instant
      real(wp), intent(out) :: tau

      real(wp) :: excess(size(response%tau)), limit
      integer :: last

      associate (energy => response%energy)
         excess = energy%kinetic + energy%strain + energy%stop - energy_at_rest
      end associate
      limit = share*(response%initial_energy - energy_at_rest)
      last = findloc(excess > limit, .true., dim=1, back=.true.)
      is_spent = last < size(excess)
      tau = 0.0_wp
      if (.not. is_spent .or. last == 0) return
      tau = response%tau(last) + (response%tau(last + 1) - response%tau(last)) &
            *(excess(last) - limit)/(excess(last) - excess(last + 1))
   end subroutine find_spent_instant

   !> Energy that remains when all motion is over: of a beam that presses on the stop, and of the stop.
   pure function rest_energy(stop, initial_energy) result(energy)
      !> The stop
      type(stop_settings_t), intent(in) :: stop
      !> Energy of the static shape of the start, whose stop point is 1 + delta away from where it is unstressed
      real(wp), intent(in) :: initial_energy
      real(wp) :: energy

      real(wp) :: flexibility
      type(three_element_t) :: spring

      energy = 0.0_wp
      if (stop%preload <= 0.0_wp) return
      flexibility = 0.5_wp*(1.0_wp + stop%preload)**2/initial_energy
      if (stop%law == law_three_element) then
         spring = make_three_element(stop%stiffness_ratio, stop%branch_ratio, stop%damper_ratio)
         flexibility = flexibility + 1.0_wp/spring%stiffness
      end if
      energy = 0.5_wp*stop%preload**2/flexibility
   end function rest_energy

   !> What the events alone tell.
   pure subroutine measure_events(response, measures)
      !> The run
      type(response_t), intent(in) :: response
      !> What was measured; the length of the run is there
      type(response_measures_t), intent(inout) :: measures

      integer :: contacts, i
      logical :: in_contact
      real(wp), allocatable :: limits(:, :)

      allocate (limits(2, response%event_count))
      contacts = 0
      in_contact = .false.
      do i = 1, response%event_count
         associate (event => response%events(i))
            if (event%kind == event_impact .or. event%kind == event_contact) measures%impacts = measures%impacts + 1
            if (.not. measures%has_met_stop .and. arrives(event%kind)) then
               measures%has_met_stop = .true.
               measures%first_impact_tau = event%tau
               measures%first_impact_velocity = event%velocity_before
            end if
            if (is_contact_start(event%kind) .and. .not. in_contact) then
               in_contact = .true.
               contacts = contacts + 1
               limits(:, contacts) = [event%tau, measures%duration]
            else if (is_contact_end(event%kind) .and. in_contact) then
               in_contact = .false.
               limits(2, contacts) = event%tau
            end if
         end associate
      end do
      measures%contact_start = limits(1, :contacts)
      measures%contact_end = limits(2, :contacts)
      measures%total_contact = sum(measures%contact_end - measures%contact_start)
      if (contacts > 0) measures%longest_contact = maxval(measures%contact_end - measures%contact_start)
   end subroutine measure_events

   !> Does the stop point arrive at the stop with this event?
   elemental function arrives(kind) result(answer)
      !> Kind of the event
      integer, intent(in) :: kind
      logical :: answer

      answer = kind == event_impact .or. kind == event_capture .or. kind == event_contact
   end function arrives

   !> Merge samples and events in the order of time. A sample at the instant of an event gives way to it.
   pure subroutine join(response, chain)
      !> The run, with the displacement of the stop point
      type(response_t), intent(in) :: response
      !> Its knots
      type(chain_t), intent(out) :: chain

      integer :: event, events, knots, sample, samples
      logical :: has_velocity, takes_event

      samples = size(response%tau)
      events = response%event_count
      has_velocity = allocated(response%velocity_stop)
      allocate (chain%tau(samples + events), chain%eta(samples + events), chain%event(samples + events))
      if (has_velocity) allocate (chain%before(samples + events), chain%after(samples + events))
      knots = 0
      event = 1
      sample = 1
      do while (sample <= samples .or. event <= events)
         if (event > events) then
            takes_event = .false.
         else if (sample > samples) then
            takes_event = .true.
         else
            takes_event = response%events(event)%tau <= response%tau(sample)
         end if
         knots = knots + 1
         if (takes_event) then
            chain%tau(knots) = response%events(event)%tau
            chain%eta(knots) = response%events(event)%eta
            chain%event(knots) = event
            if (has_velocity) then
               chain%before(knots) = response%events(event)%velocity_before
               chain%after(knots) = response%events(event)%velocity_after
            end if
            if (sample <= samples) then
               if (response%tau(sample) <= chain%tau(knots)) sample = sample + 1
            end if
            event = event + 1
         else
            chain%tau(knots) = response%tau(sample)
            chain%eta(knots) = response%displacement_stop(sample)
            chain%event(knots) = 0
            if (has_velocity) then
               chain%before(knots) = response%velocity_stop(sample)
               chain%after(knots) = response%velocity_stop(sample)
            end if
            sample = sample + 1
         end if
      end do
      chain%tau = chain%tau(:knots)
      chain%eta = chain%eta(:knots)
      chain%event = chain%event(:knots)
      if (has_velocity) then
         chain%before = chain%before(:knots)
         chain%after = chain%after(:knots)
      end if
   end subroutine join

   !> The peak of each flight that follows an impact or a contact. A flight that the end of the run cuts
   !> while it still rises has none.
   pure subroutine find_peaks(response, chain, measures)
      !> The run
      type(response_t), intent(in) :: response
      !> Its knots
      type(chain_t), intent(in) :: chain
      !> What was measured
      type(response_measures_t), intent(inout) :: measures

      integer :: first, knot, knots, peaks
      logical :: has_peak, is_flight_end
      real(wp) :: peak_eta, peak_tau
      real(wp), allocatable :: found(:, :)

      knots = size(chain%tau)
      allocate (found(2, response%event_count))
      peaks = 0
      first = 0
      do knot = 1, knots
         is_flight_end = knot == knots
         if (chain%event(knot) > 0) is_flight_end = .true.
         if (first > 0 .and. is_flight_end) then
            call find_peak(chain, first, knot, has_peak, peak_tau, peak_eta)
            if (has_peak .and. peak_eta > rebound_level) then
               peaks = peaks + 1
               found(:, peaks) = [peak_tau, peak_eta]
            end if
            first = 0
         end if
         if (chain%event(knot) > 0) then
            if (departs(response%events(chain%event(knot))%kind)) first = knot
         end if
      end do
      measures%peak_tau = found(1, :peaks)
      measures%peak_eta = found(2, :peaks)
   end subroutine find_peaks

   !> Does a flight begin with this event?
   elemental function departs(kind) result(answer)
      !> Kind of the event
      integer, intent(in) :: kind
      logical :: answer

      answer = kind == event_impact .or. is_contact_end(kind)
   end function departs

   !> The highest point in a range of knots.
   pure subroutine find_peak(chain, first, last, has_peak, tau, eta)
      !> Knots
      type(chain_t), intent(in) :: chain
      !> First and last knot of the range
      integer, intent(in) :: first
      integer, intent(in) :: last
      !> False if the highest point is the last knot
      logical, intent(out) :: has_peak
      !> Where and how high it is
      real(wp), intent(out) :: tau
      real(wp), intent(out) :: eta

      integer :: highest, i, k, turns
      real(wp) :: candidate, cubic(0:3), turn(2)

      highest = first + maxloc(chain%eta(first:last), dim=1) - 1
      tau = chain%tau(highest)
      eta = chain%eta(highest)
      has_peak = highest < last
      if (allocated(chain%after)) then
         do i = first, last - 1
            cubic = piece(chain, i)
            call find_turns(cubic, turns, turn)
            do k = 1, turns
               candidate = cubic_value(cubic, turn(k))
               if (candidate <= eta) cycle
               eta = candidate
               tau = chain%tau(i) + turn(k)*(chain%tau(i + 1) - chain%tau(i))
               has_peak = .true.
            end do
         end do
      else if (highest > first .and. highest < last) then
         call refine_by_parabola(chain%tau(highest - 1:highest + 1), chain%eta(highest - 1:highest + 1), tau, eta)
      end if
   end subroutine find_peak

   !> The vertex of the parabola through three points, the middle one the highest.
   pure subroutine refine_by_parabola(abscissa, ordinate, vertex, height)
      !> Three points, ascending
      real(wp), intent(in) :: abscissa(3)
      real(wp), intent(in) :: ordinate(3)
      !> The vertex
      real(wp), intent(out) :: vertex
      real(wp), intent(out) :: height

      real(wp) :: curvature, left, right, slope

      left = (ordinate(2) - ordinate(1))/(abscissa(2) - abscissa(1))
      right = (ordinate(3) - ordinate(2))/(abscissa(3) - abscissa(2))
      curvature = (right - left)/(abscissa(3) - abscissa(1))
      vertex = abscissa(2)
      height = ordinate(2)
      ! Three equal heights have no vertex; otherwise left >= 0 >= right and the curvature is negative.
      if (curvature >= 0.0_wp) return
      slope = left + curvature*(abscissa(2) - abscissa(1))
      vertex = abscissa(2) - slope/(2.0_wp*curvature)
      height = ordinate(2) - slope**2/(4.0_wp*curvature)
   end subroutine refine_by_parabola

   !> When |eta_c| last exceeded the level: from the end back to the first piece that exceeds it.
   pure subroutine find_quiet(chain, level, is_quiet, tau)
      !> Knots
      type(chain_t), intent(in) :: chain
      !> The level
      real(wp), intent(in) :: level
      !> False: at the end it still does
      logical, intent(out) :: is_quiet
      !> The instant
      real(wp), intent(out) :: tau

      integer :: i, k, loud, turns
      real(wp) :: cubic(0:3), mark(0:3), turn(2)

      tau = chain%tau(1)
      is_quiet = abs(chain%eta(size(chain%eta))) <= level
      if (.not. is_quiet) return
      do i = size(chain%tau) - 1, 1, -1
         cubic = piece(chain, i)
         call find_turns(cubic, turns, turn)
         mark(0) = 0.0_wp
         mark(1:turns) = turn(:turns)
         mark(turns + 1) = 1.0_wp
         loud = -1
         do k = 0, turns
            if (abs(cubic_value(cubic, mark(k))) > level) loud = k
         end do
         if (loud >= 0) then
            tau = chain%tau(i) &
               + last_loud_point(cubic, level, mark(loud), mark(loud + 1))*(chain%tau(i + 1) - chain%tau(i))
            return
         end if
      end do
   end subroutine find_quiet

   !> Where |cubic| falls through the level between a point above it and one that is not, with no
   !> turn in between: bisection down to neighbouring numbers.
   pure function last_loud_point(cubic, level, loud, quiet) result(point)
      !> Coefficients
      real(wp), intent(in) :: cubic(0:3)
      !> The level
      real(wp), intent(in) :: level
      !> The two points
      real(wp), intent(in) :: loud
      real(wp), intent(in) :: quiet
      real(wp) :: point

      real(wp) :: high, low, middle

      low = loud
      high = quiet
      do
         middle = low + 0.5_wp*(high - low)
         if (middle <= low .or. middle >= high) exit
         if (abs(cubic_value(cubic, middle)) > level) then
            low = middle
         else
            high = middle
         end if
      end do
      point = low
   end function last_loud_point

   !> Coefficients of the displacement between a knot and the next, as a polynomial of s = 0 ... 1.
   pure function piece(chain, i) result(cubic)
      !> Knots
      type(chain_t), intent(in) :: chain
      !> The first of the two knots
      integer, intent(in) :: i
      real(wp) :: cubic(0:3)

      real(wp) :: left, rise, right, width

      rise = chain%eta(i + 1) - chain%eta(i)
      cubic = [chain%eta(i), rise, 0.0_wp, 0.0_wp]
      if (.not. allocated(chain%after)) return
      width = chain%tau(i + 1) - chain%tau(i)
      left = width*chain%after(i)
      right = width*chain%before(i + 1)
      cubic = [chain%eta(i), left, 3.0_wp*rise - 2.0_wp*left - right, left + right - 2.0_wp*rise]
   end function piece

   !> The value of a polynomial.
   pure function cubic_value(cubic, s) result(value)
      !> Coefficients, ascending
      real(wp), intent(in) :: cubic(0:3)
      !> Argument
      real(wp), intent(in) :: s
      real(wp) :: value

      value = cubic(0) + s*(cubic(1) + s*(cubic(2) + s*cubic(3)))
   end function cubic_value

   !> Where a cubic turns inside 0 < s < 1: the roots of c1 + 2 c2 s + 3 c3 s^2, without cancellation.
   pure subroutine find_turns(cubic, turns, turn)
      !> Coefficients, ascending
      real(wp), intent(in) :: cubic(0:3)
      !> Number of turns, 0 to 2
      integer, intent(out) :: turns
      !> The turns, ascending
      real(wp), intent(out) :: turn(2)

      integer :: k
      real(wp) :: discriminant, root(2), sum

      turns = 0
      turn = 0.0_wp
      discriminant = cubic(2)**2 - 3.0_wp*cubic(1)*cubic(3)
      if (discriminant <= 0.0_wp) return
      sum = -(cubic(2) + sign(sqrt(discriminant), cubic(2)))
      ! Quotients outside 0 ... 1 are never formed: they may overflow.
      root = -1.0_wp
      if (is_fraction(sum, 3.0_wp*cubic(3))) root(1) = sum/(3.0_wp*cubic(3))
      if (is_fraction(cubic(1), sum)) root(2) = cubic(1)/sum
      if (root(1) > root(2)) root = root([2, 1])
      do k = 1, 2
         if (root(k) <= 0.0_wp .or. root(k) >= 1.0_wp) cycle
         turns = turns + 1
         turn(turns) = root(k)
      end do
   end subroutine find_turns

   !> Is 0 < numerator/denominator < 1?
   elemental function is_fraction(numerator, denominator) result(answer)
      !> The quotient
      real(wp), intent(in) :: numerator
      real(wp), intent(in) :: denominator
      logical :: answer

      answer = abs(numerator) < abs(denominator) .and. (numerator > 0.0_wp .eqv. denominator > 0.0_wp)
   end function is_fraction

end module response_measures
