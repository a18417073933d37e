!> Fourier integrals of signals over an interval of a motion, in closed form, at many frequencies (docs/theory.md,
!> section 24).
!>
!> An exponential exp(s t) from 0 to h gives (exp(z) - 1)/(s - i omega), z = (s - i omega) h. Where z is small this is
!> 0/0, and h exp(z/2) sinh(z/2)/(z/2) takes its place, by the series of the last factor. Frequencies ascend, so those
!> for which z is small stand side by side, and every loop over frequencies is one of real numbers without branches.
module fourier_integrals
   use interval_sums, only: interval_sums_t
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: add_fourier_integrals, add_impulse

   !> |z| from which on the closed form is taken as it stands.
   real(wp), parameter :: least_direct = 0.5_wp
   !> omega h from which on that is done for powers of t.
   real(wp), parameter :: least_turn = 2.0_wp
   !> Frequencies that are taken at a time, so that what belongs to them stays near to the processor.
   integer, parameter :: chunk = 256
   !> exp(-x) below this is nothing.
   real(wp), parameter :: max_exponent = 700.0_wp

   !> What belongs to a chunk of frequencies.
   type :: chunk_t
      !> Frequencies, their number, and the length of the stretch
      real(wp) :: omega(chunk) = 0.0_wp
      integer :: count = 0
      real(wp) :: length = 0.0_wp
      !> Real and imaginary parts of exp(-i omega h) and of exp(-i omega h/2)
      real(wp), dimension(chunk) :: turn_re = 1.0_wp, turn_im = 0.0_wp, half_re = 1.0_wp, half_im = 0.0_wp
   end type chunk_t

   !> Sums over terms of one signal: those to be multiplied by exp(-i omega h), and those that stand alone.
   type :: sums_t
      real(wp), dimension(chunk) :: end_re = 0.0_wp, end_im = 0.0_wp, alone_re = 0.0_wp, alone_im = 0.0_wp
   end type sums_t

contains

   !> Add the integrals of x(t) exp(-i omega (start + t)) over a stretch of an interval.
   pure subroutine add_fourier_integrals(sums, from, to, start, omega, transform)
      type(interval_sums_t), intent(in) :: sums
      !> Ends of the stretch, since the start of the interval
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
      !> Start of the interval
      real(wp), intent(in) :: start
      !> Ascending
      real(wp), intent(in) :: omega(:)
      !> [frequencies, signals]
      complex(wp), intent(inout) :: transform(:, :)

      !GCC$ builtin (sin) attributes simd (notinbranch) if('x86_64')
      !GCC$ builtin (cos) attributes simd (notinbranch) if('x86_64')
      type(chunk_t) :: here
      type(sums_t) :: total(size(transform, 2))
      real(wp), dimension(chunk) :: turned_re, turned_im
      ! at the beginning of the stretch
      complex(wp) :: amplitude(size(transform, 2), size(sums%exponent))
      real(wp) :: power(0:3, size(transform, 2))
      integer :: first, i, k, m

      do k = 1, size(transform, 2)
         power(:, k) = moved(sums%power(:, k), from)
      end do
      do m = 1, size(sums%exponent)
         amplitude(:, m) = sums%amplitude(:, m)
         if (from > 0.0_wp) amplitude(:, m) = amplitude(:, m)*exponential(sums%exponent(m), from)
      end do
      do first = 1, size(omega), chunk
         here%count = min(chunk, size(omega) - first + 1)
         call open_chunk(omega(first:first + here%count - 1), to - from, here)
         total = sums_t()
         do k = 1, size(total)
            call add_powers(here, power(:, k), total(k))
         end do
         do m = 1, size(sums%exponent)
            call add_term(here, sums%exponent(m), amplitude(:, m), total)
         end do
         do i = 1, chunk
            turned_re(i) = cos(here%omega(i)*(start + from))
         end do
         do i = 1, chunk
            turned_im(i) = -sin(here%omega(i)*(start + from))
         end do
         do k = 1, size(total)
            do i = 1, here%count
               transform(first + i - 1, k) = transform(first + i - 1, k) + cmplx(turned_re(i), turned_im(i), wp)*( &
                  cmplx(total(k)%alone_re(i), total(k)%alone_im(i), wp) &
                  + cmplx(here%turn_re(i), here%turn_im(i), wp)*cmplx(total(k)%end_re(i), total(k)%end_im(i), wp))
            end do
         end do
      end do
   end subroutine add_fourier_integrals

   !> Add the transform of an impulse.
   pure subroutine add_impulse(omega, time, value, transform)
      real(wp), intent(in) :: omega(:)
      real(wp), intent(in) :: time
      real(wp), intent(in) :: value
      !> [frequencies]
      complex(wp), intent(inout) :: transform(:)

      transform = transform + value*cmplx(cos(omega*time), -sin(omega*time), wp)
   end subroutine add_impulse

   !> A polynomial about another origin.
   pure function moved(power, by) result(now)
      real(wp), intent(in) :: power(0:3)
      real(wp), intent(in) :: by
      real(wp) :: now(0:3)

      now(0) = power(0) + by*(power(1) + by*(power(2) + by*power(3)))
      now(1) = power(1) + by*(2.0_wp*power(2) + 3.0_wp*by*power(3))
      now(2) = power(2) + 3.0_wp*by*power(3)
      now(3) = power(3)
   end function moved

   !> exp(s t), which is nothing where it has died away.
   elemental function exponential(s, t) result(value)
      complex(wp), intent(in) :: s
      real(wp), intent(in) :: t
      complex(wp) :: value

      value = (0.0_wp, 0.0_wp)
      if (real(s, wp)*t > -max_exponent) value = exp(s*t)
   end function exponential

   pure subroutine open_chunk(omega, length, here)
      real(wp), intent(in) :: omega(:)
      real(wp), intent(in) :: length
      !> Its number of frequencies is there
      type(chunk_t), intent(inout) :: here

      ! short loops of one function each: the compiler makes vector calls of them
      !GCC$ builtin (sin) attributes simd (notinbranch) if('x86_64')
      !GCC$ builtin (cos) attributes simd (notinbranch) if('x86_64')
      integer :: i

      here%length = length
      here%omega(:here%count) = omega
      here%omega(here%count + 1:) = omega(here%count)
      do i = 1, chunk
         here%half_re(i) = cos(0.5_wp*length*here%omega(i))
      end do
      do i = 1, chunk
         here%half_im(i) = -sin(0.5_wp*length*here%omega(i))
      end do
      !$omp simd
      do i = 1, chunk
         here%turn_re(i) = (here%half_re(i) - here%half_im(i))*(here%half_re(i) + here%half_im(i))
         here%turn_im(i) = 2.0_wp*here%half_re(i)*here%half_im(i)
      end do
   end subroutine open_chunk

   !> Integrals of powers of t: h^(k + 1) times that of v^k exp(-i theta v) from 0 to 1, theta = omega h.
   pure subroutine add_powers(here, power, total)
      type(chunk_t), intent(in) :: here
      real(wp), intent(in) :: power(0:3)
      type(sums_t), intent(inout) :: total

      ! pairs of terms of the series in theta; 2^n/n! is below 1e-17 behind the last
      integer, parameter :: pairs = 12
      real(wp) :: even(0:pairs), odd(0:pairs), scaled(0:3)
      real(wp) :: closed_re, closed_im, integral_re, inverse, series_re, series_im, square, theta, x
      integer :: highest, i, k, n

      highest = findloc(abs(power) > 0.0_wp, .true., dim=1, back=.true.) - 1
      if (highest < 0) return
      scaled = power*here%length**[1, 2, 3, 4]
      do n = 0, pairs
         even(n) = sum([(scaled(k)/real(2*n + k + 1, wp), k=0, highest)])/gamma(real(2*n + 1, wp))
         odd(n) = -sum([(scaled(k)/real(2*n + k + 2, wp), k=0, highest)])/gamma(real(2*n + 2, wp))
      end do
      !$omp simd private(closed_re, closed_im, integral_re, inverse, k, n, series_re, series_im, square, theta, x)
      do i = 1, here%count
         theta = here%omega(i)*here%length
         square = -min(abs(theta), least_turn)**2
         series_re = even(pairs)
         series_im = odd(pairs)
         do n = pairs - 1, 0, -1
            series_re = even(n) + square*series_re
            series_im = odd(n) + square*series_im
         end do
         ! by parts: I_k = (k I_(k-1) - exp(-i theta))/(i theta)
         inverse = 1.0_wp/merge(theta, 1.0_wp, abs(theta) >= least_turn)
         integral_re = -here%turn_im(i)*inverse
         x = (here%turn_re(i) - 1.0_wp)*inverse
         closed_re = scaled(0)*integral_re
         closed_im = scaled(0)*x
         do k = 1, 3
            theta = (real(k, wp)*x - here%turn_im(i))*inverse
            x = (here%turn_re(i) - real(k, wp)*integral_re)*inverse
            integral_re = theta
            closed_re = closed_re + scaled(k)*integral_re
            closed_im = closed_im + scaled(k)*x
         end do
         theta = here%omega(i)*here%length
         total%alone_re(i) = total%alone_re(i) + merge(closed_re, series_re, abs(theta) >= least_turn)
         total%alone_im(i) = total%alone_im(i) + merge(closed_im, theta*series_im, abs(theta) >= least_turn)
      end do
   end subroutine add_powers

   !> An exponential: with its conjugate where it has one, together where both are far from 0/0.
   pure subroutine add_term(here, s, amplitude, total)
      type(chunk_t), intent(in) :: here
      complex(wp), intent(in) :: s
      !> Of each signal at the beginning of the stretch, [signals]
      complex(wp), intent(in) :: amplitude(:)
      type(sums_t), intent(inout) :: total(:)

      integer :: ends(2, 2), k, last
      real(wp) :: reach

      if (all(abs(real(amplitude, wp)) + abs(aimag(amplitude)) <= 0.0_wp)) return
      reach = (least_direct/here%length)**2 - real(s, wp)**2
      reach = sqrt(max(reach, 0.0_wp))
      ! frequencies near to that of the conjugate, then of the term itself; both may be the same
      ends(:, 1) = near_ends(here, -abs(aimag(s)), reach)
      ends(:, 2) = near_ends(here, abs(aimag(s)), reach)
      ends(1, 2) = max(ends(1, 2), ends(2, 1) + 1)
      last = 0
      do k = 1, 2
         call add_far(here, s, amplitude, last + 1, ends(1, k) - 1, total)
         call add_near(here, s, amplitude, ends(1, k), ends(2, k), total)
         last = max(last, ends(2, k))
      end do
      call add_far(here, s, amplitude, last + 1, here%count, total)
   end subroutine add_term

   !> First and last frequency that is near to another; the last before the first: there is none.
   pure function near_ends(here, center, reach) result(ends)
      type(chunk_t), intent(in) :: here
      real(wp), intent(in) :: center
      real(wp), intent(in) :: reach
      integer :: ends(2)

      ends(1) = count_below(here, center - reach) + 1
      ends(2) = ends(1) - 1
      if (reach > 0.0_wp) ends(2) = count_below(here, center + reach)
   end function near_ends

   !> Frequencies below a value: they ascend.
   pure integer function count_below(here, value)
      type(chunk_t), intent(in) :: here
      real(wp), intent(in) :: value

      integer :: middle, upper

      count_below = 0
      upper = here%count + 1
      do while (upper - count_below > 1)
         middle = (count_below + upper)/2
         if (here%omega(middle) < value) then
            count_below = middle
         else
            upper = middle
         end if
      end do
   end function count_below

   !> Both of a pair far from 0/0: half the sum of A/(s - i omega) and its conjugate is a real linear function of
   !> i omega over (s - i omega)(conjg(s) - i omega).
   pure subroutine add_far(here, s, amplitude, first, last, total)
      type(chunk_t), intent(in) :: here
      complex(wp), intent(in) :: s
      complex(wp), intent(in) :: amplitude(:)
      integer, intent(in) :: first
      integer, intent(in) :: last
      type(sums_t), intent(inout) :: total(:)

      real(wp), dimension(chunk) :: re, im, turned_re, turned_im
      complex(wp) :: at_end
      real(wp) :: decay, inverse, omega, x, y
      integer :: i, k

      if (last < first) return
      decay = real(s, wp)
      omega = aimag(s)
      !$omp simd private(x, y, inverse)
      do i = first, last
         x = (omega - here%omega(i))*(omega + here%omega(i)) + decay**2
         y = -2.0_wp*decay*here%omega(i)
         inverse = 1.0_wp/(x*x + y*y)
         re(i) = x*inverse
         im(i) = -y*inverse
         turned_re(i) = here%omega(i)*re(i)
         turned_im(i) = here%omega(i)*im(i)
      end do
      do k = 1, size(total)
         at_end = amplitude(k)*exponential(s, here%length)
         call add_shares(real(at_end*conjg(s), wp), real(at_end, wp), total(k)%end_re, total(k)%end_im)
         call add_shares(-real(amplitude(k)*conjg(s), wp), -real(amplitude(k), wp), total(k)%alone_re, &
            total(k)%alone_im)
      end do

   contains

      !> Add (fixed - i omega turning) over the product.
      pure subroutine add_shares(fixed, turning, sum_re, sum_im)
         real(wp), intent(in) :: fixed
         real(wp), intent(in) :: turning
         real(wp), intent(inout) :: sum_re(chunk)
         real(wp), intent(inout) :: sum_im(chunk)

         integer :: j

         !$omp simd
         do j = first, last
            sum_re(j) = sum_re(j) + fixed*re(j) + turning*turned_im(j)
            sum_im(j) = sum_im(j) + fixed*im(j) - turning*turned_re(j)
         end do
      end subroutine add_shares
   end subroutine add_far

   !> One of a pair near to 0/0, or a term that has no conjugate, too.
   pure subroutine add_near(here, s, amplitude, first, last, total)
      type(chunk_t), intent(in) :: here
      complex(wp), intent(in) :: s
      complex(wp), intent(in) :: amplitude(:)
      integer, intent(in) :: first
      integer, intent(in) :: last
      type(sums_t), intent(inout) :: total(:)

      real(wp), dimension(chunk) :: re, im, other_re, other_im
      real(wp) :: even, odd
      integer :: i, k

      if (last < first) return
      call find_kernel(here, s, first, last, re, im)
      call find_kernel(here, conjg(s), first, last, other_re, other_im)
      do k = 1, size(total)
         even = 0.5_wp*real(amplitude(k), wp)
         odd = 0.5_wp*aimag(amplitude(k))
         !$omp simd
         do i = first, last
            total(k)%alone_re(i) = total(k)%alone_re(i) + even*(re(i) + other_re(i)) - odd*(im(i) - other_im(i))
            total(k)%alone_im(i) = total(k)%alone_im(i) + even*(im(i) + other_im(i)) + odd*(re(i) - other_re(i))
         end do
      end do
   end subroutine add_near

   !> h (exp(z) - 1)/z, z = (s - i omega) h, however small z is.
   pure subroutine find_kernel(here, s, first, last, re, im)
      type(chunk_t), intent(in) :: here
      complex(wp), intent(in) :: s
      integer, intent(in) :: first
      integer, intent(in) :: last
      real(wp), intent(inout) :: re(chunk)
      real(wp), intent(inout) :: im(chunk)

      ! of y^k/(2 k + 1)!, the ratio of a term to the one before
      real(wp), parameter :: ratio(6) = 1.0_wp/[6.0_wp, 20.0_wp, 42.0_wp, 72.0_wp, 110.0_wp, 156.0_wp]
      complex(wp) :: half, whole
      real(wp) :: a, b, closed_re, closed_im, inverse, series_re, series_im, x, y, y_re, y_im, z_re, z_im
      logical :: is_near
      integer :: i, n

      half = exponential(s, 0.5_wp*here%length)
      whole = exponential(s, here%length)
      !$omp simd private(a, b, closed_re, closed_im, inverse, is_near, n, series_re, series_im, x, y, y_re, y_im) &
      !$omp& private(z_re, z_im)
      do i = first, last
         z_re = real(s, wp)*here%length
         z_im = (aimag(s) - here%omega(i))*here%length
         is_near = z_re**2 + z_im**2 < least_direct**2
         ! z^2/4 by what is small
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
         a = real(half, wp)*here%half_re(i) - aimag(half)*here%half_im(i)
         b = real(half, wp)*here%half_im(i) + aimag(half)*here%half_re(i)
         x = here%length*(a*series_re - b*series_im)
         y = here%length*(a*series_im + b*series_re)
         ! (exp(z) - 1) over z
         a = real(whole, wp)*here%turn_re(i) - aimag(whole)*here%turn_im(i) - 1.0_wp
         b = real(whole, wp)*here%turn_im(i) + aimag(whole)*here%turn_re(i)
         inverse = here%length/merge(1.0_wp, z_re**2 + z_im**2, is_near)
         closed_re = (a*z_re + b*z_im)*inverse
         closed_im = (b*z_re - a*z_im)*inverse
         re(i) = merge(x, closed_re, is_near)
         im(i) = merge(y, closed_im, is_near)
      end do
   end subroutine find_kernel

end module fourier_integrals
