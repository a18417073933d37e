!> A linear functional of damped oscillators as a signal with certain bounds: the gap in flight, the reaction in contact.
!>
!> Every derivative z^(k) obeys the same oscillator equation, whose energy never grows. So from any
!> instant on |z_i^(k)| <= hypot(z_i^(k), z_i^(k+1)/W_i), under-, critically or over-damped.
module modal_signal
   use certified_search, only: certified_signal_t, local_t
   use damped_oscillators, only: oscillators_t, propagate
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: modal_signal_t, make_modal_signal

   !> s(t) = offset + sum c_i z_i(t) + surface exp(-rate t). The last term, a surface that relaxes, is convex.
   type, extends(certified_signal_t) :: modal_signal_t
      type(oscillators_t), pointer :: oscillators => null()
      !> What the oscillators swing about
      real(wp) :: offset = 0.0_wp
      !> c_i, [count]
      real(wp), allocatable :: weight(:)
      !> z_i and z_i' at t = 0, [count]
      real(wp), allocatable :: z(:), v(:)
      !> Indentation of the surface at t = 0, >= 0, and the rate at which it relaxes
      real(wp) :: surface = 0.0_wp
      real(wp) :: rate = 0.0_wp
   contains
      procedure :: look
      procedure :: evaluate
   end type modal_signal_t

contains

   !> Prepare a signal; its state `z`, `v` is set by the caller.
   subroutine make_modal_signal(oscillators, offset, weight, signal)
      !> The oscillators; they must outlive the signal
      type(oscillators_t), target, intent(in) :: oscillators
      !> Offset
      real(wp), intent(in) :: offset
      !> c_i, [count]
      real(wp), intent(in) :: weight(:)
      !> The signal
      type(modal_signal_t), intent(out) :: signal

      signal%oscillators => oscillators
      signal%offset = offset
      allocate (signal%weight, source=weight)
      allocate (signal%z(size(weight)), signal%v(size(weight)))
   end subroutine make_modal_signal

   !> The signal and its slope at an instant.
   subroutine evaluate(self, t, value, slope)
      class(modal_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> s and s'
      real(wp), intent(out) :: value
      real(wp), intent(out) :: slope

      real(wp), dimension(self%oscillators%count) :: z, v
      real(wp) :: surface

      call propagate(self%oscillators, t, self%z, self%v, z, v)
      value = self%offset + sum(self%weight*z)
      slope = sum(self%weight*v)
      if (self%surface > 0.0_wp) then
         surface = self%surface*exp(-self%rate*t)
         value = value + surface
         slope = slope - self%rate*surface
      end if
   end subroutine evaluate

   !> Value, slope and bounds of a derivative of the signal at an instant; the surface counts in order 0 only.
   subroutine look(self, t, order, here)
      class(modal_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Which derivative, 0: the signal itself
      integer, intent(in) :: order
      !> What is there
      type(local_t), intent(out) :: here

      real(wp), dimension(self%oscillators%count) :: z, v, a, jerk
      real(wp) :: magnitude, surface
      integer :: i, k

      associate (oscillators => self%oscillators, weight => self%weight)
         call propagate(oscillators, t, self%z, self%v, z, v)
         here%signal = self%offset
         magnitude = 4.0_wp*abs(self%offset)
         do i = 1, oscillators%count
            here%signal = here%signal + weight(i)*z(i)
            ! the phase W t is rounded too
            magnitude = magnitude + abs(weight(i))*(4.0_wp*abs(z(i)) + t*abs(v(i)))
         end do
         here%signal_rounding = epsilon(1.0_wp)*magnitude
         if (order == 0 .and. self%offset > 0.0_wp) here%floor = self%offset - bound_of_sum(oscillators, weight, z, v)
         do k = 1, order
            a = -oscillators%square*(z + oscillators%two_zeta*v)
            z = v
            v = a
         end do
         if (order == 0) then
            here%value = here%signal
            here%rounding = here%signal_rounding
         else
            here%value = sum(weight*z)
            here%rounding = 4.0_wp*epsilon(1.0_wp)*sum(abs(weight*z))
         end if
         do i = 1, oscillators%count
            a(i) = -oscillators%square(i)*(z(i) + oscillators%two_zeta*v(i))
            jerk(i) = -oscillators%square(i)*(v(i) + oscillators%two_zeta*a(i))
            here%slope = here%slope + weight(i)*v(i)
         end do
         here%bound = bound_of_sum(oscillators, weight, a, jerk)
         here%bound_both = here%bound
         if (self%surface > 0.0_wp) then
            surface = self%surface*exp(-self%rate*t)
            here%value = here%value + surface
            here%signal = here%value
            here%slope = here%slope - self%rate*surface
            here%bound_both = here%bound_both + self%rate**2*surface
         end if
      end associate
   end subroutine look

   !> From now on |sum weight z| stays within this. Each oscillator by the smaller of two bounds: its energy's,
   !> which is good near critical damping, and its envelope's, which is good far from it.
   pure function bound_of_sum(oscillators, weight, z, v) result(bound)
      !> The family
      type(oscillators_t), intent(in) :: oscillators
      !> Weights, [count]
      real(wp), intent(in) :: weight(:)
      !> State now, [count]
      real(wp), intent(in) :: z(:)
      real(wp), intent(in) :: v(:)
      real(wp) :: bound

      real(wp) :: energy, envelope, spread
      integer :: i

      bound = 0.0_wp
      associate (square => oscillators%square, decay => oscillators%decay)
         do i = 1, oscillators%oscillating
            spread = max(oscillators%spread(i), tiny(1.0_wp)**0.25_wp)
            energy = v(i)**2/square(i)
            envelope = ((v(i) + decay(i)*z(i))/spread)**2
            bound = bound + abs(weight(i))*sqrt(z(i)**2 + min(energy, envelope))
         end do
         do i = oscillators%oscillating + 1, oscillators%count
            ! z = A exp(-slow t) + B exp(-fast t)
            spread = max(oscillators%spread(i), tiny(1.0_wp)**0.25_wp)
            energy = sqrt(z(i)**2 + v(i)**2/square(i))
            envelope = (abs(v(i) + (decay(i) + 2.0_wp*spread)*z(i)) + abs(v(i) + decay(i)*z(i)))/(2.0_wp*spread)
            bound = bound + abs(weight(i))*min(energy, envelope)
         end do
      end associate
   end function bound_of_sum

end module modal_signal
