!> A signal of what swings of itself, and of what loads do to it besides (docs/theory.md, section 18).
module driven_signal
   use certified_search, only: bound_curvature, bound_jerk, bound_value, found_none, bounds_t, search_t, term_columns, &
      term_curvature, term_rate, term_value, viewed_signal_t
   use driven_modes, only: bound_driven_mode, driven_mode_at, driven_mode_t
   use exponential_signal, only: exponential_signal_t
   use kinds, only: wp
   use modal_signal, only: add_more, modal_signal_t
   implicit none (type, external)
   private
   public :: driven_signal_t, driven_terms_t, add_terms, find_short_driven, start_of, turn_of

   !> constant + slope t + Re sum harmonic exp(i frequency t), and modes driven from rest.
   type :: driven_terms_t
      real(wp) :: constant = 0.0_wp
      real(wp) :: slope = 0.0_wp
      complex(wp), allocatable :: harmonic(:)
      real(wp), allocatable :: frequency(:)
      !> So many modes, and their shares of the signal, of themselves and of their rates; unallocated: there are none
      integer :: modes = 0
      type(driven_mode_t), allocatable :: mode(:)
      real(wp), allocatable :: share(:), share_of_rate(:)
   end type driven_terms_t

   type, extends(viewed_signal_t) :: driven_signal_t
      class(viewed_signal_t), allocatable :: free
      !> What is added to it: its own `factor` times a derivative of the terms, from an instant of theirs on
      type(driven_terms_t) :: terms
      real(wp) :: factor = 1.0_wp
      real(wp) :: from = 0.0_wp
      integer :: order = 0
      !> No bound is asked for beyond that instant
      real(wp) :: until = huge(1.0_wp)
   contains
      procedure :: find_bounds
      procedure :: find_bounds_without_step
      procedure :: evaluate
      procedure :: view
      procedure :: stands_off
   end type driven_signal_t

   !> Which of the columns go with a derivative and those after it, and which bound them
   integer, parameter :: value_columns(3) = [term_value, term_rate, term_curvature]
   integer, parameter :: bound_columns(3) = [bound_value, bound_curvature, bound_jerk]

contains

   !> The signal and its slope at an instant.
   subroutine evaluate(self, t, value, slope)
      class(driven_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> s and s'
      real(wp), intent(out) :: value
      real(wp), intent(out) :: slope

      real(wp) :: added, added_slope

      call self%free%evaluate(t, value, slope)
      call terms_at(self, t, turn_of(self%terms%frequency, self%from + t), added, added_slope)
      value = value + added
      slope = slope + added_slope
   end subroutine evaluate

   !> Value, slope and bounds of a derivative of the signal at an instant.
   subroutine find_bounds(self, t, order, here)
      class(driven_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Which derivative, 0: the signal itself
      integer, intent(in) :: order
      !> What is there
      type(bounds_t), intent(out) :: here

      call look_for(self, t, order, .true., here)
   end subroutine find_bounds

   !> The same for who takes no step from there.
   subroutine find_bounds_without_step(self, t, order, here)
      class(driven_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Which derivative, 0: the signal itself
      integer, intent(in) :: order
      !> What is there
      type(bounds_t), intent(out) :: here

      call look_for(self, t, order, .false., here)
   end subroutine find_bounds_without_step

   !> Either.
   subroutine look_for(self, t, order, takes_step, here)
      class(driven_signal_t), intent(in) :: self
      real(wp), intent(in) :: t
      integer, intent(in) :: order
      logical, intent(in) :: takes_step
      type(bounds_t), intent(out) :: here

      complex(wp) :: turn(size(self%terms%frequency))
      real(wp) :: floor, known, magnitude, more(term_columns), rest(0:1), rounding, slope

      turn = turn_of(self%terms%frequency, self%from + t)
      rest = rest_of(self, t, order)
      call find_swing(self, t, turn, order, more, magnitude)
      more(term_value) = rest(0) + more(term_value)
      more(term_rate) = rest(1) + more(term_rate)
      floor = min(rest(0), rest(0) + rest(1)*max(self%until - t, 0.0_wp)) - more(bound_value)
      select type (free => self%free)
      type is (modal_signal_t)
         call free%find_bounds_among(t, order, here, more, floor, takes_step)
      class default
         call free%find_bounds(t, order, here)
         ! its own steps know nothing of the rest
         here%free = 0.0_wp
         call add_more(more, floor, here)
      end select
      rounding = 4.0_wp*epsilon(1.0_wp)*(1.0_wp + highest_frequency(self)*(self%from + t))
      here%rounding = here%rounding + rounding*(abs(rest(0)) + magnitude)
      if (order == 0) then
         here%signal = here%value
         here%signal_rounding = here%rounding
      else
         call terms_at(self, t, turn, known, slope)
         here%signal = here%signal + known
         here%signal_rounding = here%signal_rounding + rounding*(abs(known) + abs(self%factor) &
            *sum(abs(self%terms%harmonic)*self%terms%frequency**self%order))
      end if
   end subroutine look_for

   !> offset + factor times a derivative of the signal, from an instant on.
   subroutine view(self, from, factor, offset, order, part)
      class(driven_signal_t), intent(in) :: self
      !> The instant
      real(wp), intent(in) :: from
      real(wp), intent(in) :: factor
      real(wp), intent(in) :: offset
      !> 0: the signal itself, 1: its slope
      integer, intent(in) :: order
      !> The same as a signal
      class(viewed_signal_t), allocatable, intent(out) :: part

      type(driven_signal_t), allocatable :: driven

      allocate (driven)
      call self%free%view(from, factor, offset, order, driven%free)
      driven%terms = self%terms
      driven%factor = factor*self%factor
      driven%from = self%from + from
      driven%order = self%order + order
      driven%until = self%until - from
      call move_alloc(driven, part)
   end subroutine view

   !> What is added, and its slope.
   subroutine terms_at(self, t, turn, value, slope)
      class(driven_signal_t), intent(in) :: self
      real(wp), intent(in) :: t
      !> exp(i W t), [harmonics]
      complex(wp), intent(in) :: turn(:)
      real(wp), intent(out) :: value
      real(wp), intent(out) :: slope

      complex(wp) :: term
      real(wp) :: here(0:self%order + 2), rest(0:1), time
      integer :: i

      rest = rest_of(self, t, 0)
      value = 0.0_wp
      slope = 0.0_wp
      time = self%from + t
      associate (terms => self%terms)
         do i = 1, size(terms%frequency)
            associate (w => terms%frequency(i))
               term = turned(self%factor*terms%harmonic(i)*turn(i), w, self%order)
               value = value + real(term, wp)
               slope = slope - w*aimag(term)
            end associate
         end do
         do i = 1, terms%modes
            here(:) = driven_mode_at(terms%mode(i), time, self%order + 2)
            value = value + self%factor*(terms%share(i)*here(self%order) + terms%share_of_rate(i)*here(self%order + 1))
            slope = slope + self%factor*(terms%share(i)*here(self%order + 1) &
               + terms%share_of_rate(i)*here(self%order + 2))
         end do
      end associate
      value = rest(0) + value
      slope = rest(1) + slope
   end subroutine terms_at

   !> The constant and the slope: a derivative of what is added, and the next.
   pure function rest_of(self, t, order) result(rest)
      class(driven_signal_t), intent(in) :: self
      real(wp), intent(in) :: t
      integer, intent(in) :: order
      real(wp) :: rest(0:1)

      rest = 0.0_wp
      associate (terms => self%terms)
         if (self%order + order == 0) rest = self%factor*[terms%constant + terms%slope*(self%from + t), terms%slope]
         if (self%order + order == 1) rest(0) = self%factor*terms%slope
      end associate
   end function rest_of

   !> A derivative of the sum of all harmonics and modes driven from rest, those after it, and bounds on them from now
   !> on.
   subroutine find_swing(self, t, turn, order, omega, magnitude)
      class(driven_signal_t), intent(in) :: self
      real(wp), intent(in) :: t
      !> exp(i W t), [harmonics]
      complex(wp), intent(in) :: turn(:)
      integer, intent(in) :: order
      !> Columns as in `certified_search`
      real(wp), intent(out) :: omega(term_columns)
      !> What the rounding error of that derivative is measured by
      real(wp), intent(out) :: magnitude

      complex(wp) :: term
      real(wp), allocatable :: here(:), bounds(:)
      real(wp) :: greatest, time
      integer :: first, i

      first = order + self%order
      time = self%from + t
      omega = 0.0_wp
      do i = 1, size(turn)
         associate (w => self%terms%frequency(i))
            term = turned(self%factor*self%terms%harmonic(i)*turn(i), w, first)
            greatest = size_of(self%factor*self%terms%harmonic(i))*w**first
            omega(term_value) = omega(term_value) + real(term, wp)
            omega(term_rate) = omega(term_rate) - w*aimag(term)
            omega(term_curvature) = omega(term_curvature) - w**2*real(term, wp)
            omega(bound_value) = omega(bound_value) + greatest
            omega(bound_curvature) = omega(bound_curvature) + greatest*w**2
            omega(bound_jerk) = omega(bound_jerk) + greatest*w**3
         end associate
      end do
      magnitude = omega(bound_value)
      if (self%terms%modes == 0) return
      allocate (here(0:first + 5), bounds(0:first + 4))
      do i = 1, self%terms%modes
         associate (share => self%factor*self%terms%share(i), of_rate => self%factor*self%terms%share_of_rate(i), &
            mode => self%terms%mode(i))
            here(:) = driven_mode_at(mode, time, first + 5)
            omega(value_columns) = omega(value_columns) + share*here(first:first + 2) &
               + of_rate*here(first + 1:first + 3)
            call bound_driven_mode(mode, time, bounds)
            magnitude = magnitude + abs(share)*bounds(first) + abs(of_rate)*bounds(first + 1)
            call bound_driven_mode(mode, self%from + self%until, bounds, time, here)
            omega(bound_columns) = omega(bound_columns) + abs(share)*bounds(first + [0, 2, 3]) &
               + abs(of_rate)*bounds(first + [1, 3, 4])
         end associate
      end do
   end subroutine find_swing

   !> Its magnitude, without care for overflow.
   elemental function size_of(harmonic) result(magnitude)
      complex(wp), intent(in) :: harmonic
      real(wp) :: magnitude

      magnitude = sqrt(real(harmonic, wp)**2 + aimag(harmonic)**2)
   end function size_of

   !> What a harmonic has turned by: exp(i w t).
   elemental function turn_of(w, time) result(turn)
      !> Circular frequency
      real(wp), intent(in) :: w
      real(wp), intent(in) :: time
      complex(wp) :: turn

      turn = cmplx(cos(w*time), sin(w*time), wp)
   end function turn_of

   !> A derivative of what turns with i w.
   elemental function turned(turning, w, order) result(term)
      complex(wp), intent(in) :: turning
      real(wp), intent(in) :: w
      integer, intent(in) :: order
      complex(wp) :: term

      integer :: k

      term = turning
      do k = 1, order
         term = w*cmplx(-aimag(term), real(term, wp), wp)
      end do
   end function turned

   !> The end of a short hop of modes and what loads add, which rise from zero together.
   subroutine find_short_driven(modes, slope, harmonic, frequency, limit, search)
      type(modal_signal_t), intent(in) :: modes
      !> Of what is added, as in `driven_terms_t`
      real(wp), intent(in) :: slope
      complex(wp), intent(in) :: harmonic(:)
      real(wp), intent(in) :: frequency(:)
      !> Where the search ends
      real(wp), intent(in) :: limit
      !> As of `find_short_flight`
      type(search_t), intent(inout) :: search

      ! whose powers are numbers
      real(wp), parameter :: greatest_frequency = 1.0e5_wp
      complex(wp) :: turning(size(harmonic))

      search%outcome = found_none
      if (any(frequency > greatest_frequency)) return
      if (size(frequency) == 0 .and. abs(slope) <= 0.0_wp) then
         call modes%find_short(limit, search)
      else
         turning = harmonic
         call modes%find_short(limit, search, slope, turning, frequency)
      end if
   end subroutine find_short_driven

   !> Is the signal at its start far from zero, as its terms go?
   pure function stands_off(self) result(is)
      class(driven_signal_t), intent(in) :: self
      logical :: is

      real(wp) :: magnitude, value

      is = .false.
      ! modes driven from rest are at rest
      select type (free => self%free)
      type is (modal_signal_t)
         if (self%order > 0 .or. self%from > 0.0_wp) return
         value = free%offset + sum(free%weight*free%z) + min(free%contact, 0.0_wp) + self%factor*(self%terms%constant &
            + sum(real(self%terms%harmonic, wp)))
         magnitude = abs(free%offset) + sum(abs(free%weight*free%z)) + abs(self%factor)*(abs(self%terms%constant) &
            + sum(abs(self%terms%harmonic)))
         is = value > 1.0e-9_wp*magnitude
      end select
   end function stands_off

   !> A signal that has nothing left to tell where it stands begins with its slope.
   function start_of(signal, known) result(order)
      class(viewed_signal_t), intent(in) :: signal
      !> What is known of it; 0: nothing
      integer, intent(in) :: known
      integer :: order

      type(bounds_t) :: here

      order = known
      if (known > 0) return
      select type (signal)
      type is (modal_signal_t)
         ! far from that
         if (signal%offset + sum(signal%weight*signal%z) + min(signal%contact, 0.0_wp) > &
            1.0e-9_wp*(abs(signal%offset) + sum(abs(signal%weight*signal%z)))) return
      type is (driven_signal_t)
         if (signal%stands_off()) return
      end select
      call signal%find_bounds(0.0_wp, 0, here)
      if (here%value <= here%rounding .and. here%slope > 0.0_wp) order = 1
   end function start_of

   !> Of all that the loads swing with.
   pure function highest_frequency(self) result(frequency)
      class(driven_signal_t), intent(in) :: self
      real(wp) :: frequency

      frequency = 0.0_wp
      if (size(self%terms%frequency) > 0) frequency = maxval(self%terms%frequency)
   end function highest_frequency

   !> What loads do to a signal, through a phase that lasts no longer than that.
   subroutine add_terms(terms, longest, signal)
      !> Gone afterwards
      type(driven_terms_t), intent(inout) :: terms
      real(wp), intent(in) :: longest
      class(viewed_signal_t), allocatable, intent(inout) :: signal

      type(driven_signal_t), allocatable :: driven

      select type (signal)
      type is (exponential_signal_t)
         if (abs(terms%slope) <= 0.0_wp) then
            call add_harmonics(terms, signal)
            return
         end if
      end select
      allocate (driven)
      driven%terms%constant = terms%constant
      driven%terms%slope = terms%slope
      driven%terms%modes = terms%modes
      call move_alloc(terms%harmonic, driven%terms%harmonic)
      call move_alloc(terms%frequency, driven%terms%frequency)
      call move_alloc(terms%mode, driven%terms%mode)
      call move_alloc(terms%share, driven%terms%share)
      call move_alloc(terms%share_of_rate, driven%terms%share_of_rate)
      driven%until = longest
      call move_alloc(signal, driven%free)
      call move_alloc(driven, signal)
   end subroutine add_terms

   !> As further terms.
   pure subroutine add_harmonics(terms, sum)
      type(driven_terms_t), intent(in) :: terms
      type(exponential_signal_t), intent(inout) :: sum

      complex(wp), dimension(size(sum%exponent) + size(terms%frequency)) :: exponent, amplitude
      integer :: i, last, slower

      sum%offset = sum%offset + terms%constant
      last = size(sum%exponent)
      exponent(:last) = sum%exponent
      amplitude(:last) = sum%amplitude
      do i = 1, size(terms%frequency)
         slower = count(real(exponent(:last), wp)**2 + aimag(exponent(:last))**2 < terms%frequency(i)**2)
         exponent(slower + 2:last + 1) = exponent(slower + 1:last)
         amplitude(slower + 2:last + 1) = amplitude(slower + 1:last)
         exponent(slower + 1) = cmplx(0.0_wp, terms%frequency(i), wp)
         amplitude(slower + 1) = terms%harmonic(i)
         last = last + 1
      end do
      sum%exponent = exponent
      sum%amplitude = amplitude
   end subroutine add_harmonics

end module driven_signal
