!> A sum of decaying complex exponentials as a signal with certain bounds: the force of the three-element
!> stop. No term grows, so from any instant on the second derivative is at most sum |c s^2 exp(s t)|.
module exponential_signal
   use certified_search, only: certified_signal_t, local_t
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: exponential_signal_t

   !> s(t) = offset + sum weight Re(c exp(s t)).
   type, extends(certified_signal_t) :: exponential_signal_t
      real(wp) :: offset = 0.0_wp
      !> Exponents, Re s <= 0, [count]
      complex(wp), allocatable :: exponent(:)
      !> weight times c, [count]
      complex(wp), allocatable :: amplitude(:)
   contains
      procedure :: look
      procedure :: evaluate
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

      complex(wp) :: term
      real(wp) :: magnitude, swing, size_of_term, speed
      integer :: m

      here%signal = self%offset
      magnitude = 4.0_wp*abs(self%offset)
      swing = 0.0_wp
      do m = 1, size(self%exponent)
         term = self%amplitude(m)*exp(self%exponent(m)*t)
         ! far from where a square could overflow, so without the care that abs takes
         speed = sqrt(real(self%exponent(m), wp)**2 + aimag(self%exponent(m))**2)
         size_of_term = sqrt(real(term, wp)**2 + aimag(term)**2)
         here%signal = here%signal + real(term, wp)
         swing = swing + size_of_term
         magnitude = magnitude + (4.0_wp + speed*t)*size_of_term
         if (order > 0) then
            term = term*self%exponent(m)**order
            size_of_term = size_of_term*speed**order
            here%value = here%value + real(term, wp)
            here%rounding = here%rounding + (4.0_wp + speed*t)*epsilon(1.0_wp)*size_of_term
         end if
         here%slope = here%slope + real(term*self%exponent(m), wp)
         here%bound = here%bound + size_of_term*speed**2
      end do
      here%signal_rounding = epsilon(1.0_wp)*magnitude
      if (order == 0) then
         here%value = here%signal
         here%rounding = here%signal_rounding
         here%floor = self%offset - swing
      end if
      here%bound_both = here%bound
   end subroutine look

end module exponential_signal
