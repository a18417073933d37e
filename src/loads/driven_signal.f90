!> A signal that is the sum of a free motion and of the load response, for certified searches (docs/theory.md, section
!> 18). A signal is a scalar function of the time t since the start of the phase, such as a gap or a contact force.
module driven_signal
   use certified_search, only: bound_curvature, bound_jerk, bound_value, found_none, bounds_t, search_t, term_columns, &
      term_curvature, term_rate, term_value, transformable_signal_t
   use driven_modes, only: bound_driven_mode, driven_mode_at, driven_mode_t
   use exponential_signal, only: exponential_signal_t, insert_term
   use kinds, only: wp
   use modal_signal, only: modal_signal_t
   implicit none (type, external)
   private
   public :: driven_signal_t, driven_terms_t, add_terms, find_short_driven, first_nonzero_order, phasor_of

   !> Load response in a signal: constant + slope t + Re sum harmonic exp(i frequency t), plus modes driven from rest
   !> (module `driven_modes`).
   type :: driven_terms_t
      real(wp) :: constant = 0.0_wp
      real(wp) :: slope = 0.0_wp
      complex(wp), allocatable :: harmonic(:)
      real(wp), allocatable :: frequency(:)
      !> Number of modes driven from rest
      integer :: modes = 0
      !> The modes driven from rest; unallocated: there are none
      type(driven_mode_t), allocatable :: mode(:)
      !> Weights of their displacements in the signal
      real(wp), allocatable :: weight(:)
      !> Weights of their velocities in the signal
      real(wp), allocatable :: weight_of_rate(:)
   end type driven_terms_t

   !> Sum of a free motion and a transformed load response.
   type, extends(transformable_signal_t) :: driven_signal_t
      class(transformable_signal_t), allocatable :: free
      !> Load response, from which the signal added to `free` follows
      type(driven_terms_t) :: terms
      !> Factor of the load response
      real(wp) :: factor = 1.0_wp
      !> Time at which the signal begins in the load response: at time t the terms at from + t are used
      real(wp) :: from = 0.0_wp
      !> Order of the derivative of the load response that is added
      integer :: order = 0
      !> Instant up to which bounds must hold
      real(wp) :: until = huge(1.0_wp)
   contains
      procedure :: find_bounds
      procedure :: evaluate
      procedure :: transform
      procedure :: starts_positive
   end type driven_signal_t

   !> Columns of `certified_search` for a derivative and its two successors.
   integer, parameter :: value_columns(3) = [term_value, term_rate, term_curvature]
   !> Columns for the bounds on the derivative and on its second and third derivative.
   integer, parameter :: bound_columns(3) = [bound_value, bound_curvature, bound_jerk]

contains

   !> The signal and its slope at an instant.
   subroutine evaluate(self, t, value, slope)
      class(driven_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Signal s
      real(wp), intent(out) :: value
      !> Slope s'
      real(wp), intent(out) :: slope

      real(wp) :: added, added_slope

      call self%free%evaluate(t, value, slope)
      call terms_at(self, t, phasor_of(self%terms%frequency, self%from + t), added, added_slope)
      value = value + added
      slope = slope + added_slope
   end subroutine evaluate

   !> A derivative of the signal, or of its sum with another signal, at an instant, as in `bounds_interface`.
   subroutine find_bounds(self, t, order, bounds, added, added_floor, needs_step)
      class(driven_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Order of the derivative; 0: the signal itself
      integer, intent(in) :: order
      !> Values and bounds at the instant
      type(bounds_t), intent(out) :: bounds
      !> That derivative of the other signal, columns as in `certified_search`
      real(wp), intent(in), optional :: added(term_columns)
      !> Lower bound of the other signal
      real(wp), intent(in), optional :: added_floor
      !> False: the length of a step without a zero is not needed
      logical, intent(in), optional :: needs_step

      complex(wp) :: phasor(size(self%terms%frequency))
      ! lower bound of the load response and of the other signal from this instant on
      real(wp) :: floor
      ! columns of `certified_search` for the harmonics and modes driven from rest, then for the whole load response and
      ! the other signal
      real(wp) :: response_terms(term_columns)
      ! constant and slope of the load response at this instant, or their derivatives
      real(wp) :: linear(0:1)
      ! relative rounding error of the load response
      real(wp), parameter :: rounding = 4.0_wp*epsilon(1.0_wp)
      ! magnitude to which this error refers
      real(wp) :: magnitude
      ! load response
      real(wp) :: response
      ! slope of the load response
      real(wp) :: slope

      phasor = phasor_of(self%terms%frequency, self%from + t)
      linear = linear_part_of(self, t, order)
      call sum_oscillating_terms(self, t, phasor, order, response_terms, magnitude)
      response_terms(term_value) = linear(0) + response_terms(term_value)
      response_terms(term_rate) = linear(1) + response_terms(term_rate)
      floor = min(linear(0), linear(0) + linear(1)*max(self%until - t, 0.0_wp)) - response_terms(bound_value)
      if (present(added)) response_terms = response_terms + added
      if (present(added_floor)) floor = floor + added_floor
      call self%free%find_bounds(t, order, bounds, response_terms, floor, needs_step)
      bounds%rounding = bounds%rounding + rounding*(abs(linear(0)) + magnitude)
      if (order == 0) then
         bounds%signal = bounds%value
         if (present(added)) bounds%signal = bounds%signal - added(term_value)
         bounds%signal_rounding = bounds%rounding
      else
         call terms_at(self, t, phasor, response, slope)
         bounds%signal = bounds%signal + response
         bounds%signal_rounding = bounds%signal_rounding + rounding*(abs(response) + abs(self%factor) &
            *sum(abs(self%terms%harmonic)*self%terms%frequency**self%order &
            *(1.0_wp + self%terms%frequency*(self%from + t))))
      end if
   end subroutine find_bounds

   !> The signal offset + factor times a derivative of this signal, with its time starting at an instant.
   subroutine transform(self, from, factor, offset, order, transformed)
      class(driven_signal_t), intent(in) :: self
      !> Instant that becomes time 0 of the new signal
      real(wp), intent(in) :: from
      real(wp), intent(in) :: factor
      real(wp), intent(in) :: offset
      !> 0: the signal itself, 1: its slope
      integer, intent(in) :: order
      !> The new signal
      class(transformable_signal_t), allocatable, intent(out) :: transformed

      type(driven_signal_t), allocatable :: driven

      allocate (driven)
      call self%free%transform(from, factor, offset, order, driven%free)
      driven%terms = self%terms
      driven%factor = factor*self%factor
      driven%from = self%from + from
      driven%order = self%order + order
      driven%until = self%until - from
      call move_alloc(driven, transformed)
   end subroutine transform

   !> Load response and its slope.
   subroutine terms_at(self, t, phasor, value, slope)
      class(driven_signal_t), intent(in) :: self
      real(wp), intent(in) :: t
      !> Phasors exp(i w (from + t)) of the harmonics with frequencies w, [harmonics]
      complex(wp), intent(in) :: phasor(:)
      real(wp), intent(out) :: value
      real(wp), intent(out) :: slope

      complex(wp) :: term
      real(wp) :: derivative(0:self%order + 2), linear(0:1), time
      integer :: i

      linear = linear_part_of(self, t, 0)
      value = 0.0_wp
      slope = 0.0_wp
      time = self%from + t
      associate (terms => self%terms)
         do i = 1, size(terms%frequency)
            associate (w => terms%frequency(i))
               term = differentiate(self%factor*terms%harmonic(i)*phasor(i), w, self%order)
               value = value + real(term, wp)
               slope = slope - w*aimag(term)
            end associate
         end do
         do i = 1, terms%modes
            derivative(:) = driven_mode_at(terms%mode(i), time, self%order + 2)
            value = value + self%factor*(terms%weight(i)*derivative(self%order) &
               + terms%weight_of_rate(i)*derivative(self%order + 1))
            slope = slope + self%factor*(terms%weight(i)*derivative(self%order + 1) &
               + terms%weight_of_rate(i)*derivative(self%order + 2))
         end do
      end associate
      value = linear(0) + value
      slope = linear(1) + slope
   end subroutine terms_at

   !> A derivative of the constant and the slope in the load response, and the next derivative.
   pure function linear_part_of(self, t, order) result(linear)
      class(driven_signal_t), intent(in) :: self
      real(wp), intent(in) :: t
      integer, intent(in) :: order
      real(wp) :: linear(0:1)

      linear = 0.0_wp
      associate (terms => self%terms)
         if (self%order + order == 0) linear = self%factor*[terms%constant + terms%slope*(self%from + t), terms%slope]
         if (self%order + order == 1) linear(0) = self%factor*terms%slope
      end associate
   end function linear_part_of

   !> A derivative of the sum of all harmonics and modes driven from rest, the next two derivatives, and bounds on them
   !> from this instant on.
   subroutine sum_oscillating_terms(self, t, phasor, order, columns, magnitude)
      class(driven_signal_t), intent(in) :: self
      real(wp), intent(in) :: t
      !> Phasors exp(i w (from + t)) of the harmonics with frequencies w, [harmonics]
      complex(wp), intent(in) :: phasor(:)
      integer, intent(in) :: order
      !> Columns as in `certified_search`
      real(wp), intent(out) :: columns(term_columns)
      !> Magnitude to which the rounding error of that derivative is relative
      real(wp), intent(out) :: magnitude

      complex(wp) :: term
      real(wp) :: derivative(0:order + self%order + 5), bounds(0:order + self%order + 4)
      real(wp) :: amplitude
      ! time in the load response
      real(wp) :: time
      ! order of the derivative of the load response
      integer :: first
      integer :: i

      first = order + self%order
      time = self%from + t
      columns = 0.0_wp
      magnitude = 0.0_wp
      do i = 1, size(phasor)
         associate (w => self%terms%frequency(i))
            term = differentiate(self%factor*self%terms%harmonic(i)*phasor(i), w, first)
            amplitude = abs1(self%factor*self%terms%harmonic(i))*w**first
            columns(term_value) = columns(term_value) + real(term, wp)
            columns(term_rate) = columns(term_rate) - w*aimag(term)
            columns(term_curvature) = columns(term_curvature) - w**2*real(term, wp)
            columns(bound_value) = columns(bound_value) + amplitude
            columns(bound_curvature) = columns(bound_curvature) + amplitude*w**2
            columns(bound_jerk) = columns(bound_jerk) + amplitude*w**3
            ! the rounding error of the phase grows with time, that of other harmonics does not matter
            magnitude = magnitude + amplitude*(1.0_wp + w*time)
         end associate
      end do
      do i = 1, self%terms%modes
         associate (weight => self%factor*self%terms%weight(i), of_rate => self%factor*self%terms%weight_of_rate(i), &
            mode => self%terms%mode(i))
            if (time > mode%terms_from) then
               call add_terms_of_mode(mode, time, first, weight, of_rate, columns, magnitude)
               cycle
            end if
            derivative(:) = driven_mode_at(mode, time, first + 5)
            columns(value_columns) = columns(value_columns) + weight*derivative(first:first + 2) &
               + of_rate*derivative(first + 1:first + 3)
            call bound_driven_mode(mode, time, bounds)
            magnitude = magnitude &
               + (abs(weight)*bounds(first) + abs(of_rate)*bounds(first + 1))*(1.0_wp + mode%frequency*time)
            call bound_driven_mode(mode, self%from + self%until, bounds, time, derivative)
            columns(bound_columns) = columns(bound_columns) + abs(weight)*bounds(first + [0, 2, 3]) &
               + abs(of_rate)*bounds(first + [1, 3, 4])
         end associate
      end do
   end subroutine sum_oscillating_terms

   !> Add a derivative of the terms of a mode driven from rest, the next two derivatives, and the bounds on them.
   pure subroutine add_terms_of_mode(mode, time, order, weight, of_rate, columns, magnitude)
      type(driven_mode_t), intent(in) :: mode
      !> Time in the load response
      real(wp), intent(in) :: time
      !> Order of the derivative of the load response
      integer, intent(in) :: order
      !> Weight of the displacement of the mode
      real(wp), intent(in) :: weight
      !> Weight of its velocity
      real(wp), intent(in) :: of_rate
      !> Columns as in `certified_search`
      real(wp), intent(inout) :: columns(term_columns)
      !> Magnitude to which the rounding error of that derivative is relative
      real(wp), intent(inout) :: magnitude

      complex(wp) :: term
      ! magnitude of the term
      real(wp) :: size
      integer :: i, k

      do i = 1, mode%terms
         associate (point => mode%point(i), rate => mode%rate(i))
            size = exp(real(point, wp)*time)
            term = size*(weight + of_rate*point)*mode%amplitude(i)*phasor_of(aimag(point), time)
            size = size*(abs(weight) + abs(of_rate)*rate)*mode%magnitude(i)
            do k = 1, order
               term = point*term
               size = rate*size
            end do
            columns(value_columns) = columns(value_columns) &
               + [real(term, wp), real(point*term, wp), real(point**2*term, wp)]
            columns(bound_columns) = columns(bound_columns) + size*[1.0_wp, rate**2, rate**3]
            ! the rounding error of the phase grows with time
            magnitude = magnitude + size*(1.0_wp + rate*time)
         end associate
      end do
   end subroutine add_terms_of_mode

   !> Magnitude of a complex amplitude, without the protection of `abs` against overflow, which costs time.
   elemental real(wp) function abs1(harmonic) result(magnitude)
      complex(wp), intent(in) :: harmonic

      magnitude = sqrt(real(harmonic, wp)**2 + aimag(harmonic)**2)
   end function abs1

   !> Phasor exp(i w t) of a harmonic.
   elemental function phasor_of(w, time) result(phasor)
      !> Circular frequency
      real(wp), intent(in) :: w
      real(wp), intent(in) :: time
      complex(wp) :: phasor

      phasor = cmplx(cos(w*time), sin(w*time), wp)
   end function phasor_of

   !> A derivative of a harmonic term with the factor exp(i w t).
   elemental function differentiate(phasor, w, order) result(term)
      complex(wp), intent(in) :: phasor
      real(wp), intent(in) :: w
      integer, intent(in) :: order
      complex(wp) :: term

      integer :: k

      term = phasor
      do k = 1, order
         term = w*cmplx(-aimag(term), real(term, wp), wp)
      end do
   end function differentiate

   !> Find the end of a short flight whose gap is a sum of modes and load response and rises from zero.
   subroutine find_short_driven(modes, slope, harmonic, frequency, limit, search)
      !> Free motion of the gap
      type(modal_signal_t), intent(in) :: modes
      !> Slope of the load response of the gap
      real(wp), intent(in) :: slope
      !> Complex amplitudes of its harmonics, [harmonics]
      complex(wp), intent(in) :: harmonic(:)
      !> Circular frequencies of its harmonics, [harmonics]
      real(wp), intent(in) :: frequency(:)
      !> End of the search
      real(wp), intent(in) :: limit
      !> Result of the search, as in `find_short_flight`
      type(search_t), intent(inout) :: search

      ! powers of the frequencies must not overflow
      real(wp), parameter :: max_frequency = 1.0e5_wp
      complex(wp) :: phasor(size(harmonic))

      search%outcome = found_none
      if (any(frequency > max_frequency)) return
      if (size(frequency) == 0 .and. abs(slope) <= 0.0_wp) then
         call modes%find_end_of_short_flight(limit, search)
      else
         phasor = harmonic
         call modes%find_end_of_short_flight(limit, search, slope, phasor, frequency)
      end if
   end subroutine find_short_driven

   !> Whether the signal is clearly positive at its start, relative to the magnitudes of its terms.
   pure logical function starts_positive(self) result(answer)
      class(driven_signal_t), intent(in) :: self

      real(wp) :: magnitude, value

      answer = .false.
      ! modes driven from rest are zero at the start
      select type (free => self%free)
      type is (modal_signal_t)
         if (self%order > 0 .or. self%from > 0.0_wp) return
         value = free%offset + sum(free%weight*free%z) + min(free%relaxation, &
            0.0_wp) + self%factor*(self%terms%constant &
            + sum(real(self%terms%harmonic, wp)))
         magnitude = abs(free%offset) + sum(abs(free%weight*free%z)) + abs(self%factor)*(abs(self%terms%constant) &
            + sum(abs(self%terms%harmonic)))
         answer = value > 1.0e-9_wp*magnitude
      end select
   end function starts_positive

   !> Order of the first derivative that a search must treat as nonzero at the start: 1 if the signal is zero to within
   !> its rounding error and its slope is positive.
   integer function first_nonzero_order(signal, known_order) result(order)
      class(transformable_signal_t), intent(in) :: signal
      !> Order known to the caller; 0: unknown
      integer, intent(in) :: known_order

      type(bounds_t) :: at_start

      order = known_order
      if (known_order > 0) return
      select type (signal)
      type is (modal_signal_t)
         ! the signal is clearly positive
         if (signal%offset + sum(signal%weight*signal%z) + min(signal%relaxation, 0.0_wp) > &
            1.0e-9_wp*(abs(signal%offset) + sum(abs(signal%weight*signal%z)))) return
      type is (driven_signal_t)
         if (signal%starts_positive()) return
      end select
      call signal%find_bounds(0.0_wp, 0, at_start)
      if (at_start%value <= at_start%rounding .and. at_start%slope > 0.0_wp) order = 1
   end function first_nonzero_order

   !> Add the load response to the signal of a free motion.
   subroutine add_terms(terms, max_length, signal)
      !> Load response
      type(driven_terms_t), intent(in) :: terms
      !> Maximum length of the phase
      real(wp), intent(in) :: max_length
      class(transformable_signal_t), allocatable, intent(inout) :: signal

      type(driven_signal_t), allocatable :: driven
      integer :: i

      select type (signal)
      type is (exponential_signal_t)
         if (abs(terms%slope) <= 0.0_wp .and. .not. has_driven_modes(terms)) then
            ! the harmonics are further exponential terms, in order of increasing magnitude of the exponents
            signal%offset = signal%offset + terms%constant
            do i = 1, size(terms%frequency)
               call insert_term(cmplx(0.0_wp, terms%frequency(i), wp), terms%harmonic(i), signal)
            end do
            return
         end if
      end select
      allocate (driven)
      driven%terms = terms
      driven%until = max_length
      call move_alloc(signal, driven%free)
      call move_alloc(driven, signal)
   end subroutine add_terms

   !> Whether modes driven from rest contribute to the load response.
   pure logical function has_driven_modes(terms) result(has)
      type(driven_terms_t), intent(in) :: terms

      has = terms%modes > 0
      if (has) has = any(abs(terms%weight) > 0.0_wp .or. abs(terms%weight_of_rate) > 0.0_wp)
   end function has_driven_modes

end module driven_signal
