!> A sum of decaying complex exponentials as a signal with guaranteed bounds: a gap, a contact force or a bending moment
!> while compliant contacts are closed. No term grows, so from any instant on the second derivative is at most sum |c
!> s^2 exp(s t)|.
module exponential_signal
   use certified_search, only: bound_curvature, bound_jerk, bound_value, falls_to_zero, bounds_t, &
      step_without_zero, term_columns, term_curvature, term_rate, term_value, transformable_signal_t
   use damped_oscillators, only: lanes, padded
   use exponential_powers, only: exponentials
   use kinds, only: wp
   use summed_signal, only: add_to_bounds
   use zero_free_steps, only: taylor_step, zero_free_step
   implicit none (type, external)
   private
   public :: exponential_signal_t, insert_term, add_decay

   !> offset + Re sum c exp(s t).
   type, extends(transformable_signal_t) :: exponential_signal_t
      real(wp) :: offset = 0.0_wp
      !> Exponents s, Re s <= 0, in order of increasing |s|: `zero_free_step` replaces the last terms by bounds of their
      !> values, so that their large second derivatives do not shorten the step, [count]
      complex(wp), allocatable :: exponent(:)
      !> c, [count]
      complex(wp), allocatable :: amplitude(:)
   contains
      procedure :: find_bounds
      procedure :: evaluate
      procedure :: transform
   end type exponential_signal_t

contains

   !> Insert a real exponential that decays, so that the magnitudes of the exponents remain in increasing order.
   pure subroutine add_decay(amplitude, decay, signal)
      real(wp), intent(in) :: amplitude
      !> Decay rate, >= 0; `huge`: the exponential vanishes instantaneously
      real(wp), intent(in) :: decay
      type(exponential_signal_t), intent(inout) :: signal

      call insert_term(cmplx(-min(decay, huge(1.0_wp)), 0.0_wp, wp), cmplx(amplitude, 0.0_wp, wp), signal)
   end subroutine add_decay

   !> Insert a term, so that the magnitudes of the exponents remain in increasing order.
   pure subroutine insert_term(exponent, amplitude, signal)
      complex(wp), intent(in) :: exponent
      complex(wp), intent(in) :: amplitude
      type(exponential_signal_t), intent(inout) :: signal

      integer :: slower

      slower = count(abs(signal%exponent) < abs(exponent))
      signal%exponent = [signal%exponent(:slower), exponent, signal%exponent(slower + 1:)]
      signal%amplitude = [signal%amplitude(:slower), amplitude, signal%amplitude(slower + 1:)]
   end subroutine insert_term

   !> The signal and its slope at an instant.
   subroutine evaluate(self, t, value, slope)
      class(exponential_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Value of the signal
      real(wp), intent(out) :: value
      !> Slope of the signal
      real(wp), intent(out) :: slope

      real(wp), dimension(padded(size(self%exponent))) :: decay, omega, c_real, c_imag, exp_real, exp_imag
      real(wp) :: term, term_imag
      integer :: k

      call copy_to_vectors(self, decay, omega, c_real, c_imag)
      call exponentials(size(decay)/lanes, decay, omega, t, exp_real, exp_imag)
      value = self%offset
      slope = 0.0_wp
      !$omp simd reduction(+:value, slope) private(term, term_imag)
      do k = 1, size(self%exponent)
         term = c_real(k)*exp_real(k) - c_imag(k)*exp_imag(k)
         term_imag = c_real(k)*exp_imag(k) + c_imag(k)*exp_real(k)
         value = value + term
         slope = slope - decay(k)*term - omega(k)*term_imag
      end do
   end subroutine evaluate

   !> Copy exponents and amplitudes into real vectors.
   pure subroutine copy_to_vectors(self, decay, omega, c_real, c_imag)
      type(exponential_signal_t), intent(in) :: self
      !> -Re s, padded with zeros to whole SIMD vectors
      real(wp), intent(out) :: decay(:)
      !> Im s, padded with zeros to whole SIMD vectors
      real(wp), intent(out) :: omega(:)
      !> Real part of each amplitude, [count at least]
      real(wp), intent(inout) :: c_real(:)
      !> Imaginary part of each amplitude, [count at least]
      real(wp), intent(inout) :: c_imag(:)

      integer :: k

      do k = 1, size(self%exponent)
         decay(k) = -real(self%exponent(k), wp)
         omega(k) = aimag(self%exponent(k))
         c_real(k) = real(self%amplitude(k), wp)
         c_imag(k) = aimag(self%amplitude(k))
      end do
      decay(size(self%exponent) + 1:) = 0.0_wp
      omega(size(self%exponent) + 1:) = 0.0_wp
   end subroutine copy_to_vectors

   !> A derivative of the signal, or of its sum with another signal, at an instant, as in `bounds_interface`.
   subroutine find_bounds(self, t, order, bounds, added, added_floor, needs_step)
      class(exponential_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Order of the derivative; 0: the signal itself
      integer, intent(in) :: order
      !> Values and bounds of the sum at the instant
      type(bounds_t), intent(out) :: bounds
      !> That derivative of the other signal, columns as in `certified_search`
      real(wp), intent(in), optional :: added(term_columns)
      !> Lower bound of the other signal
      real(wp), intent(in), optional :: added_floor
      !> False: the length of a step without a zero is not needed
      logical, intent(in), optional :: needs_step

      real(wp) :: terms(size(self%exponent), term_columns)
      real(wp), dimension(padded(size(self%exponent))) :: decay, omega, c_real, c_imag, exp_real, exp_imag
      real(wp), dimension(size(self%exponent)) :: value, value_imag, modulus, bound
      real(wp) :: magnitude, term_bounds, signal, rounding, rate, rate_imag
      integer :: k, m, n

      n = size(self%exponent)
      call copy_to_vectors(self, decay, omega, c_real, c_imag)
      call exponentials(size(decay)/lanes, decay, omega, t, exp_real, exp_imag)
      signal = self%offset
      ! The rounding error of a term is that of its amplitude and of its phase s t
      magnitude = 4.0_wp*abs(self%offset)
      term_bounds = 0.0_wp
      !$omp simd reduction(+:signal, magnitude, term_bounds)
      do k = 1, n
         value(k) = c_real(k)*exp_real(k) - c_imag(k)*exp_imag(k)
         value_imag(k) = c_real(k)*exp_imag(k) + c_imag(k)*exp_real(k)
         ! the squares are far from overflow, so the scaling of abs is not needed
         modulus(k) = sqrt(decay(k)**2 + omega(k)**2)
         bound(k) = sqrt(value(k)**2 + value_imag(k)**2)
         signal = signal + value(k)
         term_bounds = term_bounds + bound(k)
         magnitude = magnitude + (4.0_wp + modulus(k)*t)*bound(k)
      end do
      bounds%signal = signal
      do m = 1, order
         !$omp simd private(rate)
         do k = 1, n
            rate = -decay(k)*value(k) - omega(k)*value_imag(k)
            value_imag(k) = omega(k)*value(k) - decay(k)*value_imag(k)
            value(k) = rate
            bound(k) = bound(k)*modulus(k)
         end do
      end do
      rounding = 0.0_wp
      !$omp simd reduction(+:rounding) private(rate, rate_imag)
      do k = 1, n
         rounding = rounding + (4.0_wp + modulus(k)*t)*bound(k)
         rate = -decay(k)*value(k) - omega(k)*value_imag(k)
         rate_imag = omega(k)*value(k) - decay(k)*value_imag(k)
         terms(k, term_value) = value(k)
         terms(k, term_rate) = rate
         terms(k, term_curvature) = -decay(k)*rate - omega(k)*rate_imag
         terms(k, bound_value) = bound(k)
         terms(k, bound_curvature) = bound(k)*modulus(k)**2
         terms(k, bound_jerk) = min(terms(k, bound_curvature)*modulus(k), huge(1.0_wp))
      end do
      bounds%slope = sum(terms(:, term_rate))
      bounds%curvature = sum(terms(:, term_curvature))
      bounds%bound = sum(terms(:, bound_curvature))
      bounds%two_sided_bound = bounds%bound
      bounds%bound_jerk = sum(terms(:, bound_jerk))
      bounds%signal_rounding = epsilon(1.0_wp)*magnitude
      bounds%value = bounds%signal
      bounds%rounding = bounds%signal_rounding
      if (order == 0) bounds%floor = self%offset - term_bounds
      if (order > 0) bounds%value = sum(terms(:, term_value))
      if (order > 0) bounds%rounding = epsilon(1.0_wp)*rounding
      if (present(added)) call add_to_bounds(added, added_floor, bounds)
      if (present(needs_step)) then
         if (.not. needs_step) return
      end if
      if (order == 0 .and. (bounds%floor > bounds%rounding .or. falls_to_zero(bounds))) return
      call find_step(self, merge(self%offset, 0.0_wp, order == 0), cmplx(value, value_imag, wp), terms, bounds, added)
   end subroutine find_bounds

   !> Find the length of a step without a zero.
   pure subroutine find_step(self, constant, exponentials, terms, bounds, added)
      type(exponential_signal_t), intent(in) :: self
      !> Constant of the derivative of the signal
      real(wp), intent(in) :: constant
      !> Exponentials in that derivative, [count]
      complex(wp), intent(in) :: exponentials(:)
      !> Their real parts with bounds, columns as in `certified_search`, [count, 6]
      real(wp), contiguous, intent(in) :: terms(:, :)
      !> Contains values and bounds of the sum; receives the length
      type(bounds_t), intent(inout) :: bounds
      !> The other signal
      real(wp), intent(in), optional :: added(term_columns)

      real(wp) :: depth, lower_value, other_terms(term_columns)

      other_terms = 0.0_wp
      if (present(added)) other_terms = added
      other_terms(term_value) = other_terms(term_value) + constant
      associate (step => bounds%zero_free_step)
         step = zero_free_step(terms, other_terms, bounds%value, bounds%slope)
         if (.not. present(added)) then
            step = max(step, taylor_step(self%exponent, exponentials, constant, bounds%value, step))
            return
         end if
         ! all exponentials may be replaced by their bounds
         depth = sum(terms(:, bound_value))
         lower_value = other_terms(term_value) - depth
         lower_value = lower_value - 16.0_wp*epsilon(1.0_wp)*(abs(other_terms(term_value)) + other_terms(bound_value) &
            + depth)
         if (lower_value >= 0.0_wp) step = max(step, step_without_zero(lower_value, added(term_rate), &
            added(bound_curvature)))
      end associate
   end subroutine find_step

   !> The signal offset + factor d(from + t), with d the derivative of the given order of this signal.
   subroutine transform(self, from, factor, offset, order, transformed)
      class(exponential_signal_t), intent(in) :: self
      !> Instant that becomes t = 0
      real(wp), intent(in) :: from
      !> Factor of the transformed signal
      real(wp), intent(in) :: factor
      !> Constant that is added to the signal
      real(wp), intent(in) :: offset
      !> 0: d is the signal itself, 1: d is its slope
      integer, intent(in) :: order
      !> The new signal
      class(transformable_signal_t), allocatable, intent(out) :: transformed

      type(exponential_signal_t), allocatable :: exponential
      real(wp), dimension(padded(size(self%exponent))) :: decay, omega, c_real, c_imag, exp_real, exp_imag

      allocate (exponential)
      exponential%offset = offset
      if (order == 0) exponential%offset = offset + factor*self%offset
      allocate (exponential%exponent, source=self%exponent)
      allocate (exponential%amplitude, source=factor*self%amplitude)
      if (order == 1) exponential%amplitude(:) = exponential%amplitude*self%exponent
      if (from > 0.0_wp) then
         call copy_to_vectors(self, decay, omega, c_real, c_imag)
         call exponentials(size(decay)/lanes, decay, omega, from, exp_real, exp_imag)
         exponential%amplitude(:) = exponential%amplitude*cmplx(exp_real(:size(self%exponent)), &
            exp_imag(:size(self%exponent)), wp)
      end if
      call move_alloc(exponential, transformed)
   end subroutine transform

end module exponential_signal
