!> A signal of what swings of itself, and of what loads do to it besides (docs/theory.md, section 18).
module driven_signal
   use certified_search, only: local_t, viewed_signal_t
   use kinds, only: wp
   use phase_drives, only: exponents_of, resonance_at, resonance_t
   implicit none (type, external)
   private
   public :: driven_signal_t, driven_terms_t

   !> constant + slope t + Re sum harmonic exp(i frequency t), and what resonates.
   type :: driven_terms_t
      real(wp) :: constant = 0.0_wp
      real(wp) :: slope = 0.0_wp
      complex(wp), allocatable :: harmonic(:)
      real(wp), allocatable :: frequency(:)
      !> And its share of the signal, of itself and of its rate
      type(resonance_t), allocatable :: resonance(:)
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
      procedure :: look
      procedure :: evaluate
      procedure :: view
   end type driven_signal_t

contains

   !> The signal and its slope at an instant.
   subroutine evaluate(self, t, value, slope)
      class(driven_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> s and s'
      real(wp), intent(out) :: value
      real(wp), intent(out) :: slope

      real(wp) :: terms(0:3)

      call self%free%evaluate(t, value, slope)
      call derivatives(self, t, 0, terms)
      value = value + terms(0)
      slope = slope + terms(1)
   end subroutine evaluate

   !> Value, slope and bounds of a derivative of the signal at an instant.
   subroutine look(self, t, order, here)
      class(driven_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Which derivative, 0: the signal itself
      integer, intent(in) :: order
      !> What is there
      type(local_t), intent(out) :: here

      real(wp) :: terms(0:3), known(0:3), bounds(0:3), rounding

      call self%free%look(t, order, here)
      ! its own steps know nothing of the rest
      here%free = 0.0_wp
      call derivatives(self, t, order, terms)
      call bound_derivatives(self, order, bounds)
      rounding = 4.0_wp*epsilon(1.0_wp)*(1.0_wp + highest_frequency(self)*(self%from + t))
      if (order == 0) then
         here%floor = here%floor + self%factor*constant_of(self) - bounds(0)
         known = terms
      else
         call derivatives(self, t, 0, known)
      end if
      here%signal = here%signal + known(0)
      here%value = here%value + terms(0)
      here%slope = here%slope + terms(1)
      here%curvature = here%curvature + terms(2)
      here%bound = here%bound + bounds(2)
      here%bound_both = here%bound_both + bounds(2)
      here%bound_jerk = min(here%bound_jerk, huge(1.0_wp) - bounds(3)) + bounds(3)
      here%rounding = here%rounding + rounding*(abs(terms(0)) + swing_of(self, order))
      here%signal_rounding = here%signal_rounding + rounding*(abs(known(0)) + swing_of(self, 0))
   end subroutine look

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

   !> Derivatives of what is added, from one on.
   subroutine derivatives(self, t, order, values)
      type(driven_signal_t), intent(in) :: self
      real(wp), intent(in) :: t
      !> The first
      integer, intent(in) :: order
      !> It and three more
      real(wp), intent(out) :: values(0:3)

      complex(wp) :: term
      real(wp), allocatable :: resonance(:)
      real(wp) :: time
      integer :: first, i, k

      first = order + self%order
      time = self%from + t
      values = 0.0_wp
      if (first == 0) values(0:1) = [self%terms%constant + self%terms%slope*time, self%terms%slope]
      if (first == 1) values(0) = self%terms%slope
      do i = 1, size(self%terms%frequency)
         associate (w => self%terms%frequency(i))
            term = self%terms%harmonic(i)*cmplx(cos(w*time), sin(w*time), wp)*cmplx(0.0_wp, w, wp)**first
            values = values + real([term, term*cmplx(0.0_wp, w, wp), -w**2*term, term*cmplx(0.0_wp, -w**3, wp)], wp)
         end associate
      end do
      do i = 1, size(self%terms%resonance)
         allocate (resonance(0:first + 4))
         resonance(:) = resonance_at(self%terms%resonance(i), time, first + 4)
         do k = 0, 3
            values(k) = values(k) + self%terms%share(i)*resonance(first + k) &
               + self%terms%share_of_rate(i)*resonance(first + k + 1)
         end do
         deallocate (resonance)
      end do
      values = self%factor*values
   end subroutine derivatives

   !> Bounds on their magnitudes from the present on, the constant part of the signal itself left out.
   subroutine bound_derivatives(self, order, bounds)
      type(driven_signal_t), intent(in) :: self
      integer, intent(in) :: order
      real(wp), intent(out) :: bounds(0:3)

      real(wp), allocatable :: resonance(:)
      integer :: first, i, k

      first = order + self%order
      bounds = 0.0_wp
      associate (slope => abs(self%terms%slope))
         ! zero times infinity is none
         if (first == 0 .and. slope > 0.0_wp) bounds(0) = slope*(self%from + self%until)
         if (first == 0) bounds(1) = slope
         if (first == 1) bounds(0) = slope
      end associate
      do i = 1, size(self%terms%frequency)
         do k = 0, 3
            bounds(k) = bounds(k) + abs(self%terms%harmonic(i))*self%terms%frequency(i)**(first + k)
         end do
      end do
      do i = 1, size(self%terms%resonance)
         allocate (resonance(0:first + 4))
         call bound_resonance(self%terms%resonance(i), self%from + self%until, resonance)
         do k = 0, 3
            bounds(k) = bounds(k) + abs(self%terms%share(i))*resonance(first + k) &
               + abs(self%terms%share_of_rate(i))*resonance(first + k + 1)
         end do
         deallocate (resonance)
      end do
      bounds = abs(self%factor)*bounds
   end subroutine bound_derivatives

   !> Of a mode that starts from rest: it swings no further than a sine of its own frequency summed up, each derivative
   !> by the equation of motion.
   pure subroutine bound_resonance(resonance, until, bounds)
      type(resonance_t), intent(in) :: resonance
      !> Not beyond that time
      real(wp), intent(in) :: until
      !> From the mode itself on
      real(wp), intent(out) :: bounds(0:)

      complex(wp) :: s(2)
      real(wp) :: length
      integer :: k

      s = exponents_of(resonance)
      length = min(until, 1.0_wp/max(resonance%decay, tiny(1.0_wp)))
      bounds(0) = length/resonance%spread
      bounds(1) = abs(s(1))*length/resonance%spread
      do k = 2, ubound(bounds, 1)
         bounds(k) = resonance%frequency**(k - 2) + 2.0_wp*resonance%decay*bounds(k - 1) + resonance%square*bounds(k - 2)
      end do
      bounds = abs(resonance%force)*bounds
   end subroutine bound_resonance

   !> What of the signal is constant.
   pure function constant_of(self) result(constant)
      type(driven_signal_t), intent(in) :: self
      real(wp) :: constant

      constant = merge(self%terms%constant, 0.0_wp, self%order == 0)
   end function constant_of

   !> How far what is harmonic swings, and how far it stands off where that is constant.
   pure function swing_of(self, order) result(swing)
      type(driven_signal_t), intent(in) :: self
      !> Of a derivative
      integer, intent(in) :: order
      real(wp) :: swing

      swing = abs(self%factor)*sum(abs(self%terms%harmonic)*self%terms%frequency**(self%order + order))
      if (order == 0) swing = swing + abs(self%factor*constant_of(self))
   end function swing_of

   pure function highest_frequency(self) result(frequency)
      type(driven_signal_t), intent(in) :: self
      real(wp) :: frequency

      frequency = 0.0_wp
      if (size(self%terms%frequency) > 0) frequency = maxval(self%terms%frequency)
   end function highest_frequency

end module driven_signal
