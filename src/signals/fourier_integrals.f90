!> Fourier integrals of signals over an interval of a motion, in closed form, at many frequencies (docs/theory.md,
!> section 24).
!>
!> The integral of exp(s t) exp(-i omega t) from 0 to h is the closed form (exp(z) - 1)/(s - i omega) with
!> z = (s - i omega) h. For small z the closed form is 0/0 and the equal expression h exp(z/2) sinh(z/2)/(z/2) is used,
!> with a series for the last factor. Frequencies ascend, so the frequencies with a small z are neighbours and no loop
!> over frequencies has a branch; loops have real variables, because compilers then use vector instructions.
module fourier_integrals
   use exponential_sums, only: exponential_sums_t
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: add_fourier_integrals, add_impulse

   !> Minimum |z| for the closed form of an exponential.
   real(wp), parameter :: min_closed_exponential = 0.5_wp
   !> Minimum omega h for the closed form of powers of t.
   real(wp), parameter :: min_closed_power = 2.0_wp
   !> Number of frequencies that are computed together; their arrays fit into the first cache of a processor.
   integer, parameter :: band_size = 256
   !> exp(-x) counts as zero for x above this number, near the underflow.
   real(wp), parameter :: max_exponent = 700.0_wp

   !> A band of frequencies, and their phasors over a span of the length h.
   type :: band_t
      !> Frequencies; only the first `count` are used
      real(wp) :: omega(band_size) = 0.0_wp
      !> Number of frequencies
      integer :: count = 0
      !> Length h of the span
      real(wp) :: length = 0.0_wp
      !> Real and imaginary parts of exp(-i omega h)
      real(wp), dimension(band_size) :: phasor_re = 1.0_wp, phasor_im = 0.0_wp
      !> Real and imaginary parts of exp(-i omega h/2)
      real(wp), dimension(band_size) :: half_re = 1.0_wp, half_im = 0.0_wp
   end type band_t

   !> Sums over the terms of one signal: contributions of the end of the span, still to be multiplied by
   !> exp(-i omega h), and contributions of its start.
   type :: sums_t
      real(wp), dimension(band_size) :: end_re = 0.0_wp, end_im = 0.0_wp, start_re = 0.0_wp, start_im = 0.0_wp
   end type sums_t

contains

   !> Add the integrals of x(t) exp(-i omega (start + t)) over a span of an interval.
   pure subroutine add_fourier_integrals(sums, from, to, start, omega, transform)
      !> Signals x
      type(exponential_sums_t), intent(in) :: sums
      !> Time from the start of the interval to the start of the span
      real(wp), intent(in) :: from
      !> Time from the start of the interval to the end of the span
      real(wp), intent(in) :: to
      !> Instant of the start of the interval
      real(wp), intent(in) :: start
      !> Frequencies, ascending
      real(wp), intent(in) :: omega(:)
      !> Sums of the integrals, [frequencies, signals]
      complex(wp), intent(inout) :: transform(:, :)

      type(band_t) :: band
      type(sums_t) :: total(size(transform, 2))
      ! exp(-i omega t) at the start of the span
      real(wp), dimension(band_size) :: origin_re, origin_im
      ! amplitudes of the exponentials at the start of the span, [signals, terms]
      complex(wp) :: amplitude(size(transform, 2), size(sums%exponent))
      ! coefficients of the powers of the time from the start of the span, [0:3, signals]
      real(wp) :: power(0:3, size(transform, 2))
      ! index of the first frequency of a band
      integer :: first
      integer :: i, k, m

      do k = 1, size(transform, 2)
         power(:, k) = shifted(sums%power(:, k), from)
      end do
      do m = 1, size(sums%exponent)
         amplitude(:, m) = sums%amplitude(:, m)
         if (from > 0.0_wp) amplitude(:, m) = amplitude(:, m)*exponential(sums%exponent(m), from)
      end do
      do first = 1, size(omega), band_size
         band%count = min(band_size, size(omega) - first + 1)
         call open_band(omega(first:first + band%count - 1), to - from, band)
         total = sums_t()
         do k = 1, size(total)
            call add_powers(band, power(:, k), total(k))
         end do
         do m = 1, size(sums%exponent)
            call add_term(band, sums%exponent(m), amplitude(:, m), total)
         end do
         call find_phasors(band%omega, start + from, origin_re, origin_im)
         do k = 1, size(total)
            do i = 1, band%count
               transform(first + i - 1, k) = transform(first + i - 1, k) + cmplx(origin_re(i), origin_im(i), wp)*( &
                  cmplx(total(k)%start_re(i), total(k)%start_im(i), wp) &
                  + cmplx(band%phasor_re(i), band%phasor_im(i), wp)*cmplx(total(k)%end_re(i), total(k)%end_im(i), wp))
            end do
         end do
      end do
   end subroutine add_fourier_integrals

   !> Add the Fourier integral of an impulse.
   pure subroutine add_impulse(omega, time, value, transform)
      !> Frequencies
      real(wp), intent(in) :: omega(:)
      !> Instant of the impulse
      real(wp), intent(in) :: time
      !> Magnitude of the impulse
      real(wp), intent(in) :: value
      !> Sum of the integrals, [frequencies]
      complex(wp), intent(inout) :: transform(:)

      real(wp), dimension(size(omega)) :: re, im

      call find_phasors(omega, time, re, im)
      transform = transform + value*cmplx(re, im, wp)
   end subroutine add_impulse

   !> Find exp(-i omega t).
   pure subroutine find_phasors(omega, time, re, im)
      !> Frequencies
      real(wp), intent(in) :: omega(:)
      !> Time t
      real(wp), intent(in) :: time
      !> Real and imaginary parts, [frequencies]
      real(wp), dimension(:), intent(out) :: re, im

      ! each statement calls one function, because the compiler then calls a vector version of the function
      !GCC$ builtin (sin) attributes simd (notinbranch) if('x86_64')
      !GCC$ builtin (cos) attributes simd (notinbranch) if('x86_64')

      re = cos(omega*time)
      im = -sin(omega*time)
   end subroutine find_phasors

   !> Coefficients of a cubic polynomial of t + shift as a polynomial of t.
   pure function shifted(power, shift) result(of_t)
      !> Coefficients of the powers of t + shift
      real(wp), intent(in) :: power(0:3)
      !> Shift of the time
      real(wp), intent(in) :: shift
      real(wp) :: of_t(0:3)

      of_t(0) = power(0) + shift*(power(1) + shift*(power(2) + shift*power(3)))
      of_t(1) = power(1) + shift*(2.0_wp*power(2) + 3.0_wp*shift*power(3))
      of_t(2) = power(2) + 3.0_wp*shift*power(3)
      of_t(3) = power(3)
   end function shifted

   !> exp(s t), or zero near the underflow.
   elemental function exponential(s, t) result(value)
      complex(wp), intent(in) :: s
      real(wp), intent(in) :: t
      complex(wp) :: value

      value = (0.0_wp, 0.0_wp)
      if (real(s, wp)*t > -max_exponent) value = exp(s*t)
   end function exponential

   !> Set the frequencies of a band, and their phasors.
   pure subroutine open_band(omega, length, band)
      !> Frequencies, ascending
      real(wp), intent(in) :: omega(:)
      !> Length of the span
      real(wp), intent(in) :: length
      !> On entry `count` is set
      type(band_t), intent(inout) :: band

      integer :: i

      band%length = length
      band%omega(:band%count) = omega
      band%omega(band%count + 1:) = omega(band%count)
      call find_phasors(band%omega, 0.5_wp*length, band%half_re, band%half_im)
      !$omp simd
      do i = 1, band_size
         band%phasor_re(i) = (band%half_re(i) - band%half_im(i))*(band%half_re(i) + band%half_im(i))
         band%phasor_im(i) = 2.0_wp*band%half_re(i)*band%half_im(i)
      end do
   end subroutine open_band

   !> Add the integrals of the powers of t: h^(k + 1) times the integral of v^k exp(-i theta v) from 0 to 1, with
   !> theta = omega h.
   pure subroutine add_powers(band, power, total)
      type(band_t), intent(in) :: band
      !> Coefficients of the powers 0 to 3 of t
      real(wp), intent(in) :: power(0:3)
      type(sums_t), intent(inout) :: total

      ! highest even power, over 2, of the series in theta: for n = 26 and theta = 2 the term theta^n/n! is below 1e-17
      integer, parameter :: pairs = 12
      ! implied-do variable of the following constant
      integer :: m
      ! 1/m!
      real(wp), parameter :: inverse_factorial(0:2*pairs + 1) = [(1.0_wp/gamma(real(m + 1, wp)), m=0, 2*pairs + 1)]
      ! coefficients of the series in even powers (real part) and odd powers (imaginary part) of theta
      real(wp) :: even(0:pairs), odd(0:pairs)
      ! coefficients of the powers of v = t/h, times h
      real(wp) :: scaled(0:3)
      ! real and imaginary part of the sum by the series
      real(wp) :: series_re, series_im
      ! real and imaginary part of the sum in closed form
      real(wp) :: closed_re, closed_im
      ! real and imaginary part of I_k, the integral of v^k exp(-i theta v) from 0 to 1
      real(wp) :: integral_re, integral_im
      ! real part of the next I_k
      real(wp) :: next_re
      ! 1/theta
      real(wp) :: inverse
      ! -theta^2 for the series
      real(wp) :: square
      real(wp) :: theta
      integer :: highest, i, k, n

      highest = findloc(abs(power) > 0.0_wp, .true., dim=1, back=.true.) - 1
      if (highest < 0) return
      scaled = power*band%length**[1, 2, 3, 4]
      do n = 0, pairs
         even(n) = sum([(scaled(k)/real(2*n + k + 1, wp), k=0, highest)])*inverse_factorial(2*n)
         odd(n) = -sum([(scaled(k)/real(2*n + k + 2, wp), k=0, highest)])*inverse_factorial(2*n + 1)
      end do
      !$omp simd private(closed_re, closed_im, integral_re, integral_im, inverse, k, n, next_re, series_re, series_im) &
      !$omp& private(square, theta)
      do i = 1, band%count
         theta = band%omega(i)*band%length
         square = -min(abs(theta), min_closed_power)**2
         series_re = even(pairs)
         series_im = odd(pairs)
         do n = pairs - 1, 0, -1
            series_re = even(n) + square*series_re
            series_im = odd(n) + square*series_im
         end do
         ! integration by parts: I_k = (k I_(k-1) - exp(-i theta))/(i theta)
         inverse = 1.0_wp/merge(theta, 1.0_wp, abs(theta) >= min_closed_power)
         integral_re = -band%phasor_im(i)*inverse
         integral_im = (band%phasor_re(i) - 1.0_wp)*inverse
         closed_re = scaled(0)*integral_re
         closed_im = scaled(0)*integral_im
         do k = 1, 3
            next_re = (real(k, wp)*integral_im - band%phasor_im(i))*inverse
            integral_im = (band%phasor_re(i) - real(k, wp)*integral_re)*inverse
            integral_re = next_re
            closed_re = closed_re + scaled(k)*integral_re
            closed_im = closed_im + scaled(k)*integral_im
         end do
         total%start_re(i) = total%start_re(i) + merge(closed_re, series_re, abs(theta) >= min_closed_power)
         total%start_im(i) = total%start_im(i) + merge(closed_im, theta*series_im, abs(theta) >= min_closed_power)
      end do
   end subroutine add_powers

   !> Add the integrals of the real part of amplitude exp(s t), which is half the sum of the exponential and its
   !> conjugate. At frequencies with a large z of both, one closed form gives their sum (`add_far`), elsewhere the
   !> kernel of each (`add_near`).
   pure subroutine add_term(band, s, amplitude, total)
      type(band_t), intent(in) :: band
      !> Exponent
      complex(wp), intent(in) :: s
      !> Amplitude in each signal at the start of the span, [signals]
      complex(wp), intent(in) :: amplitude(:)
      type(sums_t), intent(inout) :: total(:)

      ! indices of the first and last frequency with a small z of the conjugate, then of the exponential
      integer :: ends(2, 2)
      ! index of the last frequency that is done
      integer :: last
      ! a frequency omega has a small z if it differs by less than this from that of the exponential
      real(wp) :: reach
      integer :: k

      if (all(abs(real(amplitude, wp)) + abs(aimag(amplitude)) <= 0.0_wp)) return
      reach = (min_closed_exponential/band%length)**2 - real(s, wp)**2
      reach = sqrt(max(reach, 0.0_wp))
      ! the two groups of frequencies may overlap
      ends(:, 1) = near_ends(band, -abs(aimag(s)), reach)
      ends(:, 2) = near_ends(band, abs(aimag(s)), reach)
      ends(1, 2) = max(ends(1, 2), ends(2, 1) + 1)
      last = 0
      do k = 1, 2
         call add_far(band, s, amplitude, last + 1, ends(1, k) - 1, total)
         call add_near(band, s, amplitude, ends(1, k), ends(2, k), total)
         last = max(last, ends(2, k))
      end do
      call add_far(band, s, amplitude, last + 1, band%count, total)
   end subroutine add_term

   !> Indices of the first and last frequency within a distance of another frequency; last < first: there is none.
   pure function near_ends(band, center, reach) result(ends)
      type(band_t), intent(in) :: band
      !> The other frequency
      real(wp), intent(in) :: center
      !> The distance
      real(wp), intent(in) :: reach
      integer :: ends(2)

      ends(1) = count_below(band, center - reach) + 1
      ends(2) = ends(1) - 1
      if (reach > 0.0_wp) ends(2) = count_below(band, center + reach)
   end function near_ends

   !> Number of frequencies below a value, by bisection.
   pure integer function count_below(band, value)
      type(band_t), intent(in) :: band
      real(wp), intent(in) :: value

      integer :: middle, upper

      count_below = 0
      upper = band%count + 1
      do while (upper - count_below > 1)
         middle = (count_below + upper)/2
         if (band%omega(middle) < value) then
            count_below = middle
         else
            upper = middle
         end if
      end do
   end function count_below

   !> Add an exponential and its conjugate in closed form: half the sum of A/(s - i omega) and
   !> conjg(A)/(conjg(s) - i omega) is a real linear function of i omega over (s - i omega)(conjg(s) - i omega).
   pure subroutine add_far(band, s, amplitude, first, last, total)
      type(band_t), intent(in) :: band
      !> Exponent
      complex(wp), intent(in) :: s
      !> Amplitude in each signal at the start of the span, [signals]
      complex(wp), intent(in) :: amplitude(:)
      !> Index of the first frequency
      integer, intent(in) :: first
      !> Index of the last frequency; below `first`: there is none
      integer, intent(in) :: last
      type(sums_t), intent(inout) :: total(:)

      ! real and imaginary part of the reciprocal of the denominator
      real(wp), dimension(band_size) :: re, im
      ! real and imaginary part of this reciprocal times the frequency
      real(wp), dimension(band_size) :: omega_re, omega_im
      ! amplitude at the end of the span
      complex(wp) :: at_end
      ! real and imaginary part of the exponent
      real(wp) :: decay, omega
      ! real and imaginary part of the denominator
      real(wp) :: x, y
      ! reciprocal of its squared magnitude
      real(wp) :: inverse
      integer :: i, k

      if (last < first) return
      decay = real(s, wp)
      omega = aimag(s)
      !$omp simd private(x, y, inverse)
      do i = first, last
         x = (omega - band%omega(i))*(omega + band%omega(i)) + decay**2
         y = -2.0_wp*decay*band%omega(i)
         inverse = 1.0_wp/(x*x + y*y)
         re(i) = x*inverse
         im(i) = -y*inverse
         omega_re(i) = band%omega(i)*re(i)
         omega_im(i) = band%omega(i)*im(i)
      end do
      do k = 1, size(total)
         at_end = amplitude(k)*exponential(s, band%length)
         call add_contributions(real(at_end*conjg(s), wp), real(at_end, wp), total(k)%end_re, total(k)%end_im)
         call add_contributions(-real(amplitude(k)*conjg(s), wp), -real(amplitude(k), wp), total(k)%start_re, &
            total(k)%start_im)
      end do

   contains

      !> Add (fixed - i omega factor) divided by the denominator.
      pure subroutine add_contributions(fixed, factor, sum_re, sum_im)
         real(wp), intent(in) :: fixed
         real(wp), intent(in) :: factor
         real(wp), intent(inout) :: sum_re(band_size)
         real(wp), intent(inout) :: sum_im(band_size)

         integer :: j

         !$omp simd
         do j = first, last
            sum_re(j) = sum_re(j) + fixed*re(j) + factor*omega_im(j)
            sum_im(j) = sum_im(j) + fixed*im(j) - factor*omega_re(j)
         end do
      end subroutine add_contributions
   end subroutine add_far

   !> Add an exponential and its conjugate by their kernels, which hold for small z too.
   pure subroutine add_near(band, s, amplitude, first, last, total)
      type(band_t), intent(in) :: band
      !> Exponent
      complex(wp), intent(in) :: s
      !> Amplitude in each signal at the start of the span, [signals]
      complex(wp), intent(in) :: amplitude(:)
      !> Index of the first frequency
      integer, intent(in) :: first
      !> Index of the last frequency; below `first`: there is none
      integer, intent(in) :: last
      type(sums_t), intent(inout) :: total(:)

      ! real and imaginary part of the kernel of the exponential
      real(wp), dimension(band_size) :: re, im
      ! real and imaginary part of the kernel of the conjugate exponential
      real(wp), dimension(band_size) :: conjugate_re, conjugate_im
      ! half of the real part of the amplitude
      real(wp) :: even
      ! half of the imaginary part of the amplitude
      real(wp) :: odd
      integer :: i, k

      if (last < first) return
      call find_kernel(band, s, first, last, re, im)
      call find_kernel(band, conjg(s), first, last, conjugate_re, conjugate_im)
      do k = 1, size(total)
         even = 0.5_wp*real(amplitude(k), wp)
         odd = 0.5_wp*aimag(amplitude(k))
         !$omp simd
         do i = first, last
            total(k)%start_re(i) = total(k)%start_re(i) + even*(re(i) + conjugate_re(i)) - odd*(im(i) - conjugate_im(i))
            total(k)%start_im(i) = total(k)%start_im(i) + even*(im(i) + conjugate_im(i)) + odd*(re(i) - conjugate_re(i))
         end do
      end do
   end subroutine add_near

   !> Kernel h (exp(z) - 1)/z with z = (s - i omega) h, also for small z.
   pure subroutine find_kernel(band, s, first, last, re, im)
      type(band_t), intent(in) :: band
      !> Exponent
      complex(wp), intent(in) :: s
      !> Index of the first frequency
      integer, intent(in) :: first
      !> Index of the last frequency; below `first`: there is none
      integer, intent(in) :: last
      !> Real part of the kernel
      real(wp), intent(inout) :: re(band_size)
      !> Imaginary part of the kernel
      real(wp), intent(inout) :: im(band_size)

      ! ratios of neighbouring coefficients of the series of sinh(z/2)/(z/2) in z^2/4, 1/((2 k)(2 k + 1))
      real(wp), parameter :: ratio(6) = 1.0_wp/[6.0_wp, 20.0_wp, 42.0_wp, 72.0_wp, 110.0_wp, 156.0_wp]
      ! exp(s h/2)
      complex(wp) :: half
      ! exp(s h)
      complex(wp) :: whole
      ! real and imaginary part of z
      real(wp) :: z_re, z_im
      ! real and imaginary part of z/2
      real(wp) :: x, y
      ! real and imaginary part of z^2/4
      real(wp) :: y_re, y_im
      ! real and imaginary part of the series of sinh(z/2)/(z/2)
      real(wp) :: series_re, series_im
      ! real and imaginary part of the kernel in closed form
      real(wp) :: closed_re, closed_im
      ! real and imaginary part of a factor: first of exp(z/2), then of exp(z) - 1
      real(wp) :: a, b
      ! h/|z|^2
      real(wp) :: inverse
      ! whether z is small
      logical :: is_near
      integer :: i, n

      half = exponential(s, 0.5_wp*band%length)
      whole = exponential(s, band%length)
      !$omp simd private(a, b, closed_re, closed_im, inverse, is_near, n, series_re, series_im, x, y, y_re, y_im) &
      !$omp& private(z_re, z_im)
      do i = first, last
         z_re = real(s, wp)*band%length
         z_im = (aimag(s) - band%omega(i))*band%length
         is_near = z_re**2 + z_im**2 < min_closed_exponential**2
         ! z^2/4, or 0 if the series is not used
         x = merge(0.5_wp*z_re, 0.0_wp, is_near)
         y = merge(0.5_wp*z_im, 0.0_wp, is_near)
         y_re = (x - y)*(x + y)
         y_im = 2.0_wp*x*y
         series_re = 1.0_wp
         series_im = 0.0_wp
         do n = 6, 1, -1
            a = ratio(n)*(y_re*series_re - y_im*series_im)
            b = ratio(n)*(y_re*series_im + y_im*series_re)
            series_re = 1.0_wp + a
            series_im = b
         end do
         ! kernel h exp(z/2) sinh(z/2)/(z/2)
         a = real(half, wp)*band%half_re(i) - aimag(half)*band%half_im(i)
         b = real(half, wp)*band%half_im(i) + aimag(half)*band%half_re(i)
         x = band%length*(a*series_re - b*series_im)
         y = band%length*(a*series_im + b*series_re)
         ! kernel in closed form, h (exp(z) - 1)/z
         a = real(whole, wp)*band%phasor_re(i) - aimag(whole)*band%phasor_im(i) - 1.0_wp
         b = real(whole, wp)*band%phasor_im(i) + aimag(whole)*band%phasor_re(i)
         inverse = band%length/merge(1.0_wp, z_re**2 + z_im**2, is_near)
         closed_re = (a*z_re + b*z_im)*inverse
         closed_im = (b*z_re - a*z_im)*inverse
         re(i) = merge(x, closed_re, is_near)
         im(i) = merge(y, closed_im, is_near)
      end do
   end subroutine find_kernel

end module fourier_integrals
