!> Integrals of signals and of their squares over an interval of a phase, in closed form (docs/theory.md, section 20).
!>
!> All signals of a phase are sums of the same exponentials with different amplitudes, besides a constant and a slope.
!> The integral of a square is a sum over pairs of exponents: a quadratic form of the amplitudes, whose real matrix
!> serves all intervals of one length.
module signal_integrals
   use beam_element, only: gauss_rule
   use damped_oscillators, only: lanes, padded
   use exponential_powers, only: exponentials_less_one
   use exponential_sums, only: exponential_sums_t
   use kinds, only: wp
   use lapack_interfaces, only: dgemm
   use pole_offsets, only: abs1
   use power_integrals, only: integral
   implicit none (type, external)
   private
   public :: squares_t, integrate_signals

   !> Quadratic form of the integrals of squares over an interval of one length: x^T matrix x with x the real parts of
   !> all amplitudes at the start of the interval, then the imaginary parts.
   type :: squares_t
      !> Length of the interval
      real(wp), private :: length = 0.0_wp
      !> Exponents s, [terms]
      complex(wp), allocatable, private :: exponent(:)
      !> -Re s, padded with zeros to whole SIMD vectors, [padded terms]
      real(wp), allocatable, private :: decay(:)
      !> Im s, padded with zeros to whole SIMD vectors
      real(wp), allocatable, private :: omega(:)
      !> Real and imaginary parts of 1/(s_m + s_n) and of 1/(s_m + conjg(s_n)), 0 for close pairs, [terms, terms, 4]
      real(wp), allocatable, private :: inverse(:, :, :)
      !> Close pairs m >= n: m, n, and 1 if the sum s_m + s_n is small, 2 if s_m + conjg(s_n) is, [3, pairs]
      integer, allocatable, private :: close(:, :)
      !> exp(s length), real and imaginary parts, [padded terms, 2]
      real(wp), allocatable, private :: power(:, :)
      !> exp(s length) - 1, real and imaginary parts, [padded terms, 2]
      real(wp), allocatable, private :: change(:, :)
      !> The quadratic form, [2 terms, 2 terms]
      real(wp), allocatable :: matrix(:, :)
   end type squares_t

   !> Two exponents are a close pair if the magnitude of their sum is below this fraction of the larger magnitude. The
   !> quotient (exp((s_m + s_n) t) - 1)/(s_m + s_n) would lose digits; `integral` computes it for these pairs.
   real(wp), parameter :: close_fraction = 1.0e-2_wp

   !> An exponent is slow if its magnitude times the length of the interval is below this. The sine of a slow harmonic
   !> with a large amplitude is small, and its square would be lost as the difference of 1 and a cosine.
   real(wp), parameter :: max_slow = 0.1_wp
   !> Number of points of Gauss's quadrature, which is exact to rounding for products of slow exponentials.
   integer, parameter :: gauss_points = 4

contains

   !> Integrals from one instant to another. The exponential terms are integrated over the length of the stored
   !> quadratic form; an interval whose length differs by rounding adds this difference times the value at its end.
   pure subroutine integrate_signals(signals, from, to, squares, first, second)
      !> The signals, without powers of t above the first
      type(exponential_sums_t), intent(in) :: signals
      !> Start of the interval, time since the start of the phase
      real(wp), intent(in) :: from
      !> End of the interval, time since the start of the phase
      real(wp), intent(in) :: to
      !> The quadratic form, computed anew if the exponents or the length of the interval have changed
      type(squares_t), intent(inout) :: squares
      !> Integral of each signal, [signals]
      real(wp), intent(out) :: first(:)
      !> Integral of the square of each signal, [signals]
      real(wp), intent(out) :: second(:)

      ! lengths that differ by less than this fraction are equal: the ends of an interval are rounded
      real(wp), parameter :: rounding = 1.0e-9_wp
      ! amplitudes below this count as zero, because subnormal products of decayed terms are slow
      real(wp), parameter :: negligible = 1.0e-140_wp
      ! integral of exp(s t)
      complex(wp) :: simple
      ! integral of t exp(s t)
      complex(wp) :: ramp
      ! exp(s t) at the start of the interval
      complex(wp) :: start
      ! real and imaginary parts of the amplitudes at the start of the interval, [2 terms, signals]
      real(wp) :: parts(2*size(signals%exponent), size(first))
      ! matrix of the quadratic form times these parts, [2 terms, signals]
      real(wp) :: products(2*size(signals%exponent), size(first))
      ! factors of the parts in the integral of a signal, [2 terms]
      real(wp) :: of_simple(2*size(signals%exponent))
      ! factors of the parts in the integral of a signal times t, [2 terms]
      real(wp) :: of_ramp(2*size(signals%exponent))
      ! factors of the parts in the value of a signal at the end of the interval, [2 terms]
      real(wp) :: of_end(2*size(signals%exponent))
      ! length of the interval
      real(wp) :: length
      ! constant part of a signal at the start of the interval
      real(wp) :: offset
      integer :: i, k, n

      length = to - from
      k = size(signals%exponent)
      associate (s => signals%exponent, slope => signals%power(1, :))
         call find_inverses(s, squares)
         if (abs(length - squares%length) > rounding*squares%length) call make_squares(length, squares)
         of_ramp = 0.0_wp
         do n = 1, k
            start = (1.0_wp, 0.0_wp)
            if (from > 0.0_wp) start = exp(s(n)*from)
            do i = 1, size(first)
               associate (amplitude => signals%amplitude(i, n)*start)
                  parts(n, i) = real(amplitude, wp)
                  parts(n + k, i) = aimag(amplitude)
               end associate
            end do
            associate (power => cmplx(squares%power(n, 1), squares%power(n, 2), wp))
               simple = integral(s(n), squares%length, power)
               of_simple([n, n + k]) = [real(simple, wp), -aimag(simple)]
               of_end([n, n + k]) = [real(power, wp), -aimag(power)]
               if (any(abs(slope) > 0.0_wp)) then
                  ramp = ramp_integral(s(n), squares%length, power)
                  of_ramp([n, n + k]) = [real(ramp, wp), -aimag(ramp)]
               end if
            end associate
         end do
         where (abs(parts) < negligible) parts = 0.0_wp
         if (k > 0) call dgemm('n', 'n', 2*k, size(first), 2*k, 1.0_wp, squares%matrix, 2*k, parts, 2*k, 0.0_wp, &
            products, 2*k)
         do i = 1, size(first)
            offset = signals%power(0, i) + slope(i)*from
            ! `difference`: length of this interval less that of the quadratic form, by rounding
            associate (end => sum(parts(:, i)*of_end), difference => length - squares%length)
               first(i) = length*(offset + 0.5_wp*slope(i)*length) + sum(parts(:, i)*of_simple) + difference*end
               second(i) = length*(offset*(offset + slope(i)*length) + slope(i)**2*length**2/3.0_wp) &
                  + 2.0_wp*(offset*sum(parts(:, i)*of_simple) + slope(i)*sum(parts(:, i)*of_ramp)) &
                  + sum(parts(:, i)*products(:, i)) + difference*end*(end + 2.0_wp*(offset + slope(i)*length))
            end associate
         end do
      end associate
   end subroutine integrate_signals

   !> Compute the inverses for exponents, unless they are those of the call before.
   pure subroutine find_inverses(exponent, squares)
      complex(wp), intent(in) :: exponent(:)
      type(squares_t), intent(inout) :: squares

      complex(wp) :: inverse, total
      integer :: k, kind, m, n

      if (allocated(squares%exponent)) then
         if (size(squares%exponent) == size(exponent)) then
            associate (change => squares%exponent - exponent)
               if (all(abs(real(change, wp)) + abs(aimag(change)) <= 0.0_wp)) return
            end associate
         end if
      end if
      squares = squares_t()
      k = size(exponent)
      allocate (squares%exponent, source=exponent)
      allocate (squares%decay(padded(k)), squares%omega(padded(k)), source=0.0_wp)
      squares%decay(:k) = -real(exponent, wp)
      squares%omega(:k) = aimag(exponent)
      allocate (squares%power(padded(k), 2), squares%change(padded(k), 2), squares%matrix(2*k, 2*k))
      allocate (squares%inverse(k, k, 4), source=0.0_wp)
      allocate (squares%close(3, 0))
      do kind = 1, 2
         do n = 1, k
            do m = 1, k
               total = exponent(m) + merge(exponent(n), conjg(exponent(n)), kind == 1)
               if (abs1(total) > close_fraction*max(abs1(exponent(m)), abs1(exponent(n)))) then
                  inverse = 1.0_wp/total
                  squares%inverse(m, n, 2*kind - 1) = real(inverse, wp)
                  squares%inverse(m, n, 2*kind) = aimag(inverse)
               else if (m >= n) then
                  squares%close = reshape([squares%close, m, n, kind], [3, size(squares%close, 2) + 1])
               end if
            end do
         end do
      end do
   end subroutine find_inverses

   !> Compute the quadratic form for intervals of one length. With e = exp(s t) - 1 the integral of exp((s_m + s_n) t)
   !> is (e_m + e_n + e_m e_n)/(s_m + s_n).
   pure subroutine make_squares(length, squares)
      real(wp), intent(in) :: length
      !> The quadratic form, with the inverses
      type(squares_t), intent(inout) :: squares

      ! real and imaginary part of the integral of exp((s_m + s_n) t)
      real(wp) :: direct, direct_imag
      ! real and imaginary part of the integral of exp((s_m + conjg(s_n)) t)
      real(wp) :: conjugate, conjugate_imag
      real(wp) :: modulus_change(size(squares%decay)), product_sign, u, v, x, y
      complex(wp) :: less_one, half_integral, power(2), total
      integer :: i, k, m, n

      squares%length = length
      k = size(squares%exponent)
      associate (s => squares%exponent, e => squares%change, inverse => squares%inverse, matrix => squares%matrix)
         call exponentials_less_one(size(squares%decay)/lanes, squares%decay, squares%omega, length, &
            squares%power(:, 1), squares%power(:, 2), e(:, 1), modulus_change)
         e(:, 2) = squares%power(:, 2)
         do n = 1, k
            ! The points of a circle around slow poles (`slow_exponents` of `mode_terms`) may have a positive real part,
            ! for which `exponentials_less_one` is not made
            if (squares%decay(n) >= 0.0_wp) cycle
            power(1) = exp(s(n)*length)
            squares%power(n, :) = [real(power(1), wp), aimag(power(1))]
            less_one = s(n)*integral(s(n), length, power(1))
            e(n, :) = [real(less_one, wp), aimag(less_one)]
         end do
         do n = 1, k
            !$omp simd private(x, y, u, v, direct, direct_imag, conjugate, conjugate_imag)
            do m = 1, k
               ! x + i y = e_m + e_n + e_m e_n; u + i v: the same with conjg(e_n)
               x = e(m, 1) + e(n, 1) + e(m, 1)*e(n, 1) - e(m, 2)*e(n, 2)
               y = e(m, 2) + e(n, 2) + e(m, 1)*e(n, 2) + e(m, 2)*e(n, 1)
               u = e(m, 1) + e(n, 1) + e(m, 1)*e(n, 1) + e(m, 2)*e(n, 2)
               v = e(m, 2) - e(n, 2) - e(m, 1)*e(n, 2) + e(m, 2)*e(n, 1)
               direct = x*inverse(m, n, 1) - y*inverse(m, n, 2)
               direct_imag = x*inverse(m, n, 2) + y*inverse(m, n, 1)
               conjugate = u*inverse(m, n, 3) - v*inverse(m, n, 4)
               conjugate_imag = u*inverse(m, n, 4) + v*inverse(m, n, 3)
               matrix(m, n) = 0.5_wp*(conjugate + direct)
               matrix(m + k, n + k) = 0.5_wp*(conjugate - direct)
               matrix(m, n + k) = 0.5_wp*(conjugate_imag - direct_imag)
               matrix(m + k, n) = -0.5_wp*(conjugate_imag + direct_imag)
            end do
         end do
         do i = 1, size(squares%close, 2)
            m = squares%close(1, i)
            n = squares%close(2, i)
            power = cmplx(squares%power([m, n], 1), squares%power([m, n], 2), wp)
            product_sign = merge(1.0_wp, -1.0_wp, squares%close(3, i) == 2)
            total = s(m) + merge(conjg(s(n)), s(n), product_sign > 0.0_wp)
            if (product_sign > 0.0_wp) power(2) = conjg(power(2))
            half_integral = 0.5_wp*integral(total, length, power(1)*power(2))
            call add(m, n, half_integral, product_sign, matrix)
            if (m /= n) call add(n, m, merge(conjg(half_integral), half_integral, product_sign > 0.0_wp), &
               product_sign, matrix)
         end do
         call integrate_slow_pairs(length, s, matrix)
      end associate

   contains

      !> Add half the integral of a close pair. The sign is that of the products of two imaginary parts of amplitudes.
      pure subroutine add(m, n, half_integral, product_sign, matrix)
         integer, intent(in) :: m
         integer, intent(in) :: n
         complex(wp), intent(in) :: half_integral
         real(wp), intent(in) :: product_sign
         real(wp), intent(inout) :: matrix(:, :)

         matrix(m, n) = matrix(m, n) + real(half_integral, wp)
         matrix(m + k, n + k) = matrix(m + k, n + k) + product_sign*real(half_integral, wp)
         matrix(m, n + k) = matrix(m, n + k) + product_sign*aimag(half_integral)
         matrix(m + k, n) = matrix(m + k, n) - aimag(half_integral)
      end subroutine add
   end subroutine make_squares

   !> Compute the entries of pairs of slow exponents by quadrature.
   pure subroutine integrate_slow_pairs(length, exponent, matrix)
      real(wp), intent(in) :: length
      complex(wp), intent(in) :: exponent(:)
      !> The quadratic form
      real(wp), intent(inout) :: matrix(:, :)

      ! real parts of the slow exponentials at the points, then minus their imaginary parts
      real(wp) :: parts(gauss_points, 2*size(exponent))
      real(wp), allocatable :: point(:), weight(:)
      ! their indices in the form
      integer :: place(2*size(exponent))
      integer :: i, j, n, slow

      slow = 0
      do n = 1, size(exponent)
         if (.not. abs1(exponent(n))*length < max_slow) cycle
         slow = slow + 1
         place(slow) = n
      end do
      if (slow == 0) return
      call gauss_rule(gauss_points, point, weight)
      place(slow + 1:2*slow) = place(:slow) + size(exponent)
      do n = 1, slow
         associate (powers => exp(exponent(place(n))*(length*point)))
            parts(:, n) = real(powers, wp)
            parts(:, slow + n) = -aimag(powers)
         end associate
      end do
      do j = 1, 2*slow
         do i = 1, 2*slow
            matrix(place(i), place(j)) = length*sum(weight*parts(:, i)*parts(:, j))
         end do
      end do
   end subroutine integrate_slow_pairs

   !> Integral of t exp(s t) from 0 to t, without loss of digits if s t is small.
   elemental function ramp_integral(s, t, power) result(value)
      complex(wp), intent(in) :: s
      real(wp), intent(in) :: t
      !> exp(s t)
      complex(wp), intent(in) :: power
      complex(wp) :: value

      complex(wp) :: x

      x = s*t
      if (abs(x) < 1.0_wp) then
         value = t**2*series(x)
      else
         value = t**2*(power*(x - 1.0_wp) + 1.0_wp)/x**2
      end if

   contains

      !> sum over k of x^k/(k! (k + 2)).
      pure function series(x) result(total)
         complex(wp), intent(in) :: x
         complex(wp) :: total

         real(wp) :: factorial
         integer :: i

         total = (0.0_wp, 0.0_wp)
         factorial = gamma(20.0_wp)
         do i = 19, 0, -1
            total = 1.0_wp/(factorial*real(i + 2, wp)) + x*total
            factorial = factorial/real(max(i, 1), wp)
         end do
      end function series
   end function ramp_integral

end module signal_integrals
