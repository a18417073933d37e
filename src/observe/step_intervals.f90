!> A step of Newmark's method as an interval for observers. Displacements are the Hermite cubics through the values and
!> velocities at both ends, so that the peak of a rebound within a step is observed. An impact lies between two steps:
!> the earlier step ends with the velocity before the impact, the later step starts with the velocity after it. Forces,
!> moments, energy and the accelerations of the scheme are linear. All these but the energy are rows of the interval
!> (`motion_intervals`).
module step_intervals
   use bracketed_zero, only: bracket_t, enter_value, choose_point
   use exponential_sums, only: exponential_sums_t, open_sums
   use kinds, only: i8, wp
   use motion_intervals, only: curve_t, interval_t, observed_contact_t, peak_t, output_row_t
   use signal_peaks, only: extreme_search_t
   implicit none (type, external)
   private
   public :: step_interval_t, open_step_interval, cubic_of, maximum_of

   !> Cubic c0 + c1 s + c2 s^2 + c3 s^3 for s = 0 ... 1.
   type :: cubic_t
      real(wp) :: c(0:3) = 0.0_wp
   end type cubic_t

   !> A step of Newmark's method.
   type, extends(interval_t) :: step_interval_t
      !> Status of each contact
      type(observed_contact_t), allocatable :: seen(:)
      !> Displacements at both ends of the step, then velocities: gaps, tip, others, [4, contacts + 1 + others]
      real(wp), allocatable :: ends(:, :)
      !> Values at both ends of the step for the rows of forces and of moments, [2, contacts + places]
      real(wp), allocatable :: line(:, :)
      !> Accelerations of the scheme at both ends: gaps, tip, [2, contacts + 1]; a short cubic has lost those digits
      real(wp), allocatable :: acceleration(:, :)
      !> Displacement from which the run counts that of the tip (0) and each other one, [0:others]; `ends` includes it
      real(wp), allocatable :: origin(:)
      !> Energy of beam and stops at both ends of the step
      real(wp) :: energies(2) = 0.0_wp
      !> Energy dissipated in the dampers of each stop over the step, [contacts]
      real(wp), allocatable :: lost(:)
   contains
      procedure :: contact, evaluate, gap_bound, rounding, exceeds, range_of, seek_peak, seek_turn, record_gap
      procedure :: impulse, integrate, expand_in_exponentials, energy, dissipated
   end type step_interval_t

   !> The gap of a contact over a step.
   type, extends(curve_t) :: cubic_curve_t
      !> Displacements at both ends of the step, then velocities
      real(wp) :: ends(4) = 0.0_wp
   contains
      procedure :: last_exceedance
   end type cubic_curve_t

contains

   !> Allocate an interval.
   pure subroutine open_step_interval(contacts, places, interval, origin)
      integer, intent(in) :: contacts
      integer, intent(in) :: places
      type(step_interval_t), intent(out) :: interval
      !> Displacement from which the run counts each displacement that is not of the beam, [others]
      real(wp), intent(in) :: origin(:)

      interval%contacts = contacts
      interval%places = places
      interval%others = size(origin)
      allocate (interval%origin(0:size(origin)), source=[0.0_wp, origin])
      interval%may_gain = .true.
      allocate (interval%seen(contacts))
      allocate (interval%ends(4, contacts + 1 + size(origin)), interval%line(2, contacts + places), &
         interval%acceleration(2, contacts + 1), interval%lost(contacts), source=0.0_wp)
   end subroutine open_step_interval

   !> Status of contact k.
   pure type(observed_contact_t) function contact(self, k)
      class(step_interval_t), intent(in) :: self
      integer, intent(in) :: k

      contact = self%seen(k)
   end function contact

   !> Index in `ends` of a row that is a cubic; 0: the row is a straight line.
   pure integer function cubic_index(self, row)
      class(step_interval_t), intent(in) :: self
      type(output_row_t), intent(in) :: row

      cubic_index = row%number
      if (row%number > self%contacts + 1) then
         ! displacements that are not of the beam are the rows after the straight lines
         cubic_index = row%number - size(self%line, 2)
         if (cubic_index <= self%contacts + 1) cubic_index = 0
      end if
      if (row%order > 0) cubic_index = 0
   end function cubic_index

   !> Values at both ends of the step of a row that is a straight line.
   pure function line_of(self, row) result(values)
      class(step_interval_t), intent(in) :: self
      type(output_row_t), intent(in) :: row
      real(wp) :: values(2)

      if (row%order > 0) values = self%acceleration(:, row%number)
      if (row%order == 0) values = self%line(:, row%number - self%contacts - 1)
   end function line_of

   !> Value and rate of a row at a time since the start of the step.
   function evaluate(self, row, time) result(state)
      class(step_interval_t), intent(in) :: self
      type(output_row_t), intent(in) :: row
      real(wp), intent(in) :: time
      real(wp) :: state(2)

      type(cubic_t) :: cubic
      real(wp) :: s

      ! at the start, which is evaluated most often, the stored values: the rate of the cubic would be rounded
      if (.not. time > 0.0_wp .and. cubic_index(self, row) > 0) then
         state = row%factor*self%ends([1, 3], cubic_index(self, row)) + [row%offset, 0.0_wp]
         return
      end if
      s = min(max(time/self%length, 0.0_wp), 1.0_wp)
      cubic = cubic_of_row(self, row, [0.0_wp, self%length])
      state = [value_at(cubic, s), rate_at(cubic, s)/self%length]
   end function evaluate

   !> Upper bound of the magnitude of a gap, from the control points of its cubic.
   pure real(wp) function gap_bound(self, k)
      class(step_interval_t), intent(in) :: self
      integer, intent(in) :: k

      associate (ends => self%ends(:, k))
         gap_bound = max(abs(ends(1)), abs(ends(2)), abs(ends(1) + self%length*ends(3)/3.0_wp), &
            abs(ends(2) - self%length*ends(4)/3.0_wp))
      end associate
   end function gap_bound

   !> Rounding error of a gap: zero, because the discretisation error is larger; the product only uses the arguments.
   pure real(wp) function rounding(self, k)
      class(step_interval_t), intent(in) :: self
      integer, intent(in) :: k

      rounding = 0.0_wp*self%ends(1, k)
   end function rounding

   !> Whether a row exceeds a level during the step.
   logical function exceeds(self, row, level) result(does)
      class(step_interval_t), intent(in) :: self
      type(output_row_t), intent(in) :: row
      real(wp), intent(in) :: level

      real(wp) :: bounds(2)

      bounds = self%range_of(row)
      does = bounds(2) > level
      if (does) does = maximum_of(cubic_of_row(self, row, [0.0_wp, self%length])) > level
   end function exceeds

   !> Lower and upper bound of a row over the step, from the control points of its cubic; they spare most searches.
   function range_of(self, row) result(bounds)
      class(step_interval_t), intent(in) :: self
      type(output_row_t), intent(in) :: row
      real(wp) :: bounds(2), ends(4)

      if (cubic_index(self, row) > 0) then
         ends = self%ends(:, cubic_index(self, row))
         ends(3:) = [ends(1) + self%length*ends(3)/3.0_wp, ends(2) - self%length*ends(4)/3.0_wp]
      else
         ends = [line_of(self, row), line_of(self, row)]
      end if
      bounds = row%offset + [minval(row%factor*ends), maxval(row%factor*ends)]
   end function range_of

   !> Find the maximum of a row on a span of the step, which needs no tolerance.
   subroutine seek_peak(self, row, span, known, peak, search_state)
      class(step_interval_t), intent(inout) :: self
      type(output_row_t), intent(in) :: row
      real(wp), intent(in) :: span(2)
      real(wp), intent(in) :: known
      type(peak_t), intent(inout) :: peak
      type(extreme_search_t), intent(inout) :: search_state

      type(cubic_t) :: cubic
      ! both ends of the span and up to two turning points between them, as fractions of the span
      real(wp) :: s(4)
      real(wp) :: bounds(2), value
      integer :: count, k

      associate (unused => search_state)
      end associate
      peak%is_found = .false.
      bounds = self%range_of(row)
      if (.not. bounds(2) > known) return
      cubic = cubic_of_row(self, row, span)
      ! no cubic exceeds its control points
      associate (c => cubic%c)
         if (.not. max(c(0), c(0) + c(1)/3.0_wp, c(0) + (2.0_wp*c(1) + c(2))/3.0_wp, sum(c)) > known) return
      end associate
      call find_turns(cubic, count, s)
      peak%value = known
      do k = 1, count
         value = value_at(cubic, s(k))
         if (.not. value > peak%value) cycle
         peak%is_found = .true.
         peak%value = value
         peak%time = span(1) + s(k)*(span(2) - span(1))
         peak%still_rises = k == count
      end do
   end subroutine seek_peak

   !> Find the first turning point of a row inside a span of the step.
   subroutine seek_turn(self, row, span, direction, is_found, time, evaluations)
      class(step_interval_t), intent(inout) :: self
      type(output_row_t), intent(in) :: row
      real(wp), intent(in) :: span(2)
      integer, intent(inout) :: direction
      logical, intent(out) :: is_found
      real(wp), intent(out) :: time
      integer(i8), intent(inout) :: evaluations

      type(cubic_t) :: cubic
      ! the ends of the span and turning points between them
      real(wp) :: turn(4)
      integer :: count, k

      cubic = cubic_of_row(self, row, span)
      evaluations = evaluations + 1_i8
      call find_turns(cubic, count, turn)
      is_found = .false.
      time = span(2)
      do k = 2, count - 1
         ! the turning point at the beginning of the span may appear inside it by rounding
         if (direction /= 0 .and. turn(k) < 1.0e-9_wp) cycle
         is_found = .true.
         time = span(1) + turn(k)*(span(2) - span(1))
         direction = merge(1, -1, rate_at(cubic, 0.5_wp*(turn(k) + turn(k + 1))) > 0.0_wp)
         return
      end do
   end subroutine seek_turn

   !> Store the gap of contact k over the step.
   subroutine record_gap(self, k, curve)
      class(step_interval_t), intent(in) :: self
      integer, intent(in) :: k
      class(curve_t), allocatable, intent(inout) :: curve

      if (.not. allocated(curve)) allocate (cubic_curve_t :: curve)
      curve%start = self%start
      curve%length = self%length
      select type (curve)
      type is (cubic_curve_t)
         curve%ends = self%ends(:, k)
      end select
   end subroutine record_gap

   !> Integral of a force from the start of the step.
   real(wp) function impulse(self, k, time)
      class(step_interval_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: time

      ! weight of the value at the end of the step in the mean force
      real(wp) :: fraction

      fraction = 0.5_wp*time/self%length
      impulse = time*((1.0_wp - fraction)*self%line(1, k) + fraction*self%line(2, k))
   end function impulse

   !> Integrals of rows and of their squares, as cubics by the mass matrix of the Hermite shape functions.
   subroutine integrate(self, span, integrals, square_integrals, order)
      class(step_interval_t), intent(inout) :: self
      real(wp), intent(in) :: span(2)
      real(wp), intent(out) :: integrals(:)
      real(wp), intent(out) :: square_integrals(:)
      integer, intent(in), optional :: order

      ! consistent mass matrix of a beam element of unit length and unit mass, for value and slope at both ends
      real(wp), parameter :: mass(4, 4) = reshape([156.0_wp, 22.0_wp, 54.0_wp, -13.0_wp, 22.0_wp, 4.0_wp, 13.0_wp, &
         -3.0_wp, 54.0_wp, 13.0_wp, 156.0_wp, -22.0_wp, -13.0_wp, -3.0_wp, -22.0_wp, 4.0_wp], [4, 4])/420.0_wp
      type(output_row_t) :: row
      type(cubic_t) :: cubic
      real(wp) :: a(4), length
      integer :: k

      length = span(2) - span(1)
      if (present(order)) row%order = order
      do k = 1, size(integrals)
         row%number = k
         cubic = cubic_of_row(self, row, span)
         ! s d converts the gap into s times the displacement from the undeformed beam
         if (k <= self%contacts .and. row%order == 0) cubic%c(0) = cubic%c(0) + self%seen(k)%signed_height
         a = [cubic%c(0), cubic%c(1), sum(cubic%c), rate_at(cubic, 1.0_wp)]
         integrals(k) = length*(0.5_wp*(a(1) + a(3)) + (a(2) - a(4))/12.0_wp)
         square_integrals(k) = length*dot_product(a, matmul(mass, a))
      end do
   end subroutine integrate

   !> Expand rows into the cubics and straight lines of the step.
   subroutine expand_in_exponentials(self, rows, sums)
      class(step_interval_t), intent(in) :: self
      integer, intent(in) :: rows(:)
      type(exponential_sums_t), intent(out) :: sums

      type(cubic_t) :: cubic
      integer :: i

      call open_sums(size(rows), 0, sums)
      do i = 1, size(rows)
         cubic = cubic_of_row(self, output_row_t(rows(i)), [0.0_wp, self%length])
         if (rows(i) <= self%contacts) cubic%c(0) = cubic%c(0) + self%seen(rows(i))%signed_height
         sums%power(:, i) = cubic%c/self%length**[0, 1, 2, 3]
      end do
   end subroutine expand_in_exponentials

   !> Energy of beam and stops at a time since the start of the step.
   real(wp) function energy(self, time)
      class(step_interval_t), intent(in) :: self
      real(wp), intent(in) :: time

      energy = self%energies(1) + time/self%length*(self%energies(2) - self%energies(1))
   end function energy

   !> Energy dissipated in the dampers of a stop, in proportion to the time.
   real(wp) function dissipated(self, k, time) result(energy)
      class(step_interval_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: time

      energy = time/self%length*self%lost(k)
   end function dissipated

   !> Last time at which the magnitude of the cubic exceeds a level.
   subroutine last_exceedance(self, level, time, is_at_end)
      class(cubic_curve_t), intent(in) :: self
      real(wp), intent(in) :: level
      real(wp), intent(out) :: time
      logical, intent(out) :: is_at_end

      type(cubic_t) :: cubic
      real(wp) :: points(4)
      integer :: count, k

      cubic = cubic_of(self%ends(1:2), self%length*self%ends(3:4))
      call find_turns(cubic, count, points)
      is_at_end = abs(sum(cubic%c)) > level
      time = merge(self%length, 0.0_wp, is_at_end)
      if (is_at_end) return
      ! the last of these times counts; if points(k + 1) is above the level too, the next time replaces this time
      do k = 1, count - 1
         if (abs(value_at(cubic, points(k))) > level) time = self%length*crossing(cubic, level, points(k), &
            points(k + 1))
      end do
   end subroutine last_exceedance

   !> A row on a span of the step, as a cubic.
   pure type(cubic_t) function cubic_of_row(self, row, span) result(cubic)
      class(step_interval_t), intent(in) :: self
      type(output_row_t), intent(in) :: row
      !> Beginning and end of the span, since the start of the step
      real(wp), intent(in) :: span(2)

      type(cubic_t) :: whole
      real(wp) :: s(2)

      s = span/self%length
      if (cubic_index(self, row) == 0) then
         associate (line => line_of(self, row))
            cubic%c(0) = line(1) + s(1)*(line(2) - line(1))
            cubic%c(1) = (s(2) - s(1))*(line(2) - line(1))
         end associate
      else
         associate (ends => self%ends(:, cubic_index(self, row)))
            whole = cubic_of(ends(1:2), self%length*ends(3:4))
         end associate
         cubic = whole
         if (s(1) > 0.0_wp .or. s(2) < 1.0_wp) cubic = cubic_of([value_at(whole, s(1)), value_at(whole, s(2))], &
            (s(2) - s(1))*[rate_at(whole, s(1)), rate_at(whole, s(2))])
      end if
      cubic%c = row%factor*cubic%c
      cubic%c(0) = cubic%c(0) + row%offset
   end function cubic_of_row

   !> The cubic with given values and slopes at s = 0 and 1.
   pure type(cubic_t) function cubic_of(values, slope) result(cubic)
      real(wp), intent(in) :: values(2)
      real(wp), intent(in) :: slope(2)

      real(wp) :: rise

      rise = values(2) - values(1)
      cubic%c = [values(1), slope(1), 3.0_wp*rise - 2.0_wp*slope(1) - slope(2), slope(1) + slope(2) - 2.0_wp*rise]
   end function cubic_of

   !> Maximum of a cubic on 0 <= s <= 1.
   pure real(wp) function maximum_of(cubic) result(maximum)
      type(cubic_t), intent(in) :: cubic

      real(wp) :: points(4)
      integer :: count, k

      call find_turns(cubic, count, points)
      maximum = maxval([(value_at(cubic, points(k)), k=1, count)])
   end function maximum_of

   !> The point at which |cubic| falls through a level, between a point above the level and a point not above it,
   !> without a turning point in between: bisection to adjacent floating-point numbers.
   pure real(wp) function crossing(cubic, level, above, below) result(point)
      type(cubic_t), intent(in) :: cubic
      real(wp), intent(in) :: level
      !> Point above the level
      real(wp), intent(in) :: above
      !> Point not above the level
      real(wp), intent(in) :: below

      type(bracket_t) :: bracket

      ! with a negative tolerance the search ends only when the bracket cannot be divided
      bracket = bracket_t(low=above, high=below, point=above, value_tolerance=-1.0_wp)
      call choose_point(bracket)
      do while (.not. bracket%is_found)
         call enter_value(bracket, abs(value_at(cubic, bracket%point)) - level)
         call choose_point(bracket)
      end do
      point = bracket%low
   end function crossing

   !> Value of a cubic.
   pure real(wp) function value_at(cubic, s) result(value)
      type(cubic_t), intent(in) :: cubic
      real(wp), intent(in) :: s

      value = cubic%c(0) + s*(cubic%c(1) + s*(cubic%c(2) + s*cubic%c(3)))
   end function value_at

   !> Derivative of a cubic with respect to s.
   pure real(wp) function rate_at(cubic, s) result(rate)
      type(cubic_t), intent(in) :: cubic
      real(wp), intent(in) :: s

      rate = cubic%c(1) + s*(2.0_wp*cubic%c(2) + 3.0_wp*s*cubic%c(3))
   end function rate_at

   !> The points at which a cubic may be greatest or least for 0 <= s <= 1: the ends and the turning points between
   !> them, the roots of c1 + 2 c2 s + 3 c3 s^2, without cancellation.
   pure subroutine find_turns(cubic, count, points)
      type(cubic_t), intent(in) :: cubic
      !> Number of points, 2 to 4
      integer, intent(out) :: count
      !> The points, ascending; 1 beyond their number
      real(wp), intent(out) :: points(4)

      integer :: k
      ! a quarter of the discriminant of the slope
      real(wp) :: discriminant
      ! numerator of the larger magnitude in the quadratic formula
      real(wp) :: root_numerator
      real(wp) :: root(2)

      count = 2
      points = [0.0_wp, 1.0_wp, 1.0_wp, 1.0_wp]
      associate (c => cubic%c)
         discriminant = c(2)**2 - 3.0_wp*c(1)*c(3)
         if (discriminant <= 0.0_wp) return
         root_numerator = -(c(2) + sign(sqrt(discriminant), c(2)))
         ! quotients outside 0 ... 1 are not computed, because they may overflow
         root = -1.0_wp
         if (is_fraction(root_numerator, 3.0_wp*c(3))) root(1) = root_numerator/(3.0_wp*c(3))
         if (is_fraction(c(1), root_numerator)) root(2) = c(1)/root_numerator
      end associate
      if (root(1) > root(2)) root = root([2, 1])
      do k = 1, 2
         if (root(k) <= 0.0_wp .or. root(k) >= 1.0_wp) cycle
         points(count) = root(k)
         count = count + 1
      end do
   end subroutine find_turns

   !> Whether 0 < numerator/denominator < 1, or the numerator is 0 and the denominator negative.
   elemental logical function is_fraction(numerator, denominator) result(answer)
      !> Numerator of the quotient
      real(wp), intent(in) :: numerator
      !> Denominator of the quotient
      real(wp), intent(in) :: denominator

      answer = abs(numerator) < abs(denominator) .and. (numerator > 0.0_wp .eqv. denominator > 0.0_wp)
   end function is_fraction

end module step_intervals
