!> A sum of decaying complex exponentials as a signal with certain bounds: the force of the three-element
!> stop. No term grows, so from any instant on the second derivative is at most sum |c s^2 exp(s t)|.
module exponential_signal
   use certified_search, only: bound_curvature, bound_jerk, bound_value, falls_to_zero, free_step, local_t, &
      term_columns, term_curvature, term_rate, term_value, viewed_signal_t
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: exponential_signal_t

   !> s(t) = offset + sum weight Re(c exp(s t)).
   type, extends(viewed_signal_t) :: exponential_signal_t
      real(wp) :: offset = 0.0_wp
      !> Exponents, Re s <= 0, [count]
      complex(wp), allocatable :: exponent(:)
      !> weight times c, [count]
      complex(wp), allocatable :: amplitude(:)
      !> Places of the terms, the fastest last, which lets the steps be long, [count]; unallocated: as they stand
      integer, allocatable :: place(:)
   contains
      procedure :: look
      procedure :: evaluate
      procedure :: view
   end type exponential_signal_t

contains

   !> The signal and its slope at an instant.
   subroutine evaluate(self, t, value, slope)
      class(exponential_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> s and s'
      real(wp), intent(out) :: value
      real(wp), intent(out) :: slope

      complex(wp) :: term
      integer :: m

      value = self%offset
      slope = 0.0_wp
      do m = 1, size(self%exponent)
         term = self%amplitude(m)*exp(self%exponent(m)*t)
         value = value + real(term, wp)
         slope = slope + real(self%exponent(m)*term, wp)
      end do
   end subroutine evaluate

   !> Value, slope and bounds of a derivative of the signal at an instant.
   subroutine look(self, t, order, here)
      class(exponential_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Which derivative, 0: the signal itself
      integer, intent(in) :: order
      !> What is there
      type(local_t), intent(out) :: here

      real(wp) :: terms(size(self%exponent), term_columns)
      complex(wp) :: term
      real(wp) :: magnitude, size_of_signal, speed, swing
      integer :: k, m

      here%signal = self%offset
      magnitude = 4.0_wp*abs(self%offset)
      size_of_signal = 0.0_wp
      do k = 1, size(self%exponent)
         m = k
         if (allocated(self%place)) m = self%place(k)
         term = self%amplitude(m)*exp(self%exponent(m)*t)
         ! far from where a square could overflow, so without the care that abs takes
         speed = sqrt(real(self%exponent(m), wp)**2 + aimag(self%exponent(m))**2)
         swing = sqrt(real(term, wp)**2 + aimag(term)**2)
         here%signal = here%signal + real(term, wp)
         size_of_signal = size_of_signal + swing
         magnitude = magnitude + (4.0_wp + speed*t)*swing
         if (order > 0) then
            term = term*self%exponent(m)**order
            swing = swing*speed**order
            here%rounding = here%rounding + (4.0_wp + speed*t)*epsilon(1.0_wp)*swing
         end if
         terms(k, term_value) = real(term, wp)
         term = term*self%exponent(m)
         terms(k, term_rate) = real(term, wp)
         terms(k, term_curvature) = real(term*self%exponent(m), wp)
         terms(k, bound_value) = swing
         terms(k, bound_curvature) = swing*speed**2
         terms(k, bound_jerk) = min(terms(k, bound_curvature)*speed, huge(1.0_wp))
      end do
      here%slope = sum(terms(:, term_rate))
      here%curvature = sum(terms(:, term_curvature))
      here%bound = sum(terms(:, bound_curvature))
      here%bound_both = here%bound
      here%bound_jerk = sum(terms(:, bound_jerk))
      here%signal_rounding = epsilon(1.0_wp)*magnitude
      if (order == 0) then
         here%value = here%signal
         here%rounding = here%signal_rounding
         here%floor = self%offset - size_of_signal
         if (here%floor > here%rounding .or. falls_to_zero(here)) return
      else
         here%value = sum(terms(:, term_value))
      end if
      here%free = free_step(terms, merge(self%offset, 0.0_wp, order == 0), 0.0_wp, here%value, here%slope)
   end subroutine look

   !> offset + factor times a derivative of the signal, from an instant on.
   subroutine view(self, from, factor, offset, order, part)
      class(exponential_signal_t), intent(in) :: self
      !> The instant
      real(wp), intent(in) :: from
      real(wp), intent(in) :: factor
      real(wp), intent(in) :: offset
      !> 0: the signal itself, 1: its slope
      integer, intent(in) :: order
      !> The same as a signal
      class(viewed_signal_t), allocatable, intent(out) :: part

      type(exponential_signal_t), allocatable :: exponential

      allocate (exponential)
      exponential%offset = offset
      if (order == 0) exponential%offset = offset + factor*self%offset
      allocate (exponential%exponent, source=self%exponent)
      if (allocated(self%place)) allocate (exponential%place, source=self%place)
      allocate (exponential%amplitude, source=factor*self%amplitude*exp(self%exponent*from)*self%exponent**order)
      call move_alloc(exponential, part)
   end subroutine view

end module exponential_signal
