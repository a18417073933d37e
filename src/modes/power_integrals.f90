!> Integrals of quadratic forms of decaying exponentials over an interval of time: the work of a force, or the energy
!> that a damper dissipates.
module power_integrals
   use damped_oscillators, only: padded
   use exponential_powers, only: find_terms
   use kinds, only: wp
   use lapack_interfaces, only: dgemm
   implicit none (type, external)
   private
   public :: power_form_t, interval_terms_t, make_power_form, find_interval_terms, energy_over, integral, &
      integrals_in, decay_integral

   !> Power Re sum (p_mn A_m A_n + c_mn A_m conj(A_n))/2, with terms A_m proportional to exp(s_m t); `find_pair` gives
   !> the direct coefficient p and the conjugate coefficient c of a pair.
   type :: power_form_t
      !> Exponents s, [count]
      complex(wp), allocatable :: exponent(:)
      !> -Re s, padded with zeros to whole SIMD vectors
      real(wp), allocatable :: decay(:)
      !> Im s, padded with zeros to whole SIMD vectors
      real(wp), allocatable :: omega(:)
      !> R^T R, with R the real parts, then the imaginary parts of the rates of `make_power_form`, [2 count, 2 count]
      real(wp), allocatable :: product(:, :)
      !> The integral of the power is the change of x^T matrix x, with x the real parts of all A_m, then the imaginary
      !> parts, [2 count, 2 count]. The matrix omits the products A_m conj(A_m), which may decay slowly
      real(wp), allocatable :: matrix(:, :)
      !> Factors of the integrals of |A_m|^2, [count]
      real(wp), allocatable :: diagonal(:)
      !> Pairs of terms whose exponents are nearly conjugate; the matrix omits their products, too, [2, pairs]
      integer, allocatable :: pairs(:, :)
   end type power_form_t

   !> Terms at both ends of an interval of time, and their changes, from which the integrals of all forms with the same
   !> exponents follow.
   type :: interval_terms_t
      !> Length of the interval
      real(wp) :: time = 0.0_wp
      !> A_m at the start of the interval, [count]
      complex(wp), allocatable :: amplitude(:)
      !> A_m at the end of the interval, [count]
      complex(wp), allocatable :: term(:)
      !> Change (exp(s t) - 1) A_m over the interval, [count]
      complex(wp), allocatable :: change(:)
      !> Real and imaginary parts of the change of A_m, [2 count]
      real(wp), allocatable :: changes(:)
      !> Real and imaginary parts of the sum of A_m at start and end, [2 count]
      real(wp), allocatable :: sums(:)
      !> Integral of |A_m|^2, [count]
      real(wp), allocatable :: squares(:)
   end type interval_terms_t

   !> If |s_m + conj(s_n)| is below this fraction of |s_m| and |s_n|, the change of the quadratic form loses digits.
   real(wp), parameter :: cancellation_fraction = 0.02_wp
   !> A squared magnitude of a sum of exponents below this counts as zero.
   real(wp), parameter :: negligible = tiny(1.0_wp)

contains

   !> Power as the sum over i of the squares of Re sum_m rate_im A_m. Its integral between two instants is the
   !> difference of a quadratic form of the terms.
   pure subroutine make_power_form(exponent, rate, form)
      !> Exponents s, Re s <= 0 <= Im s
      complex(wp), intent(in) :: exponent(:)
      !> rate_im, for example the velocity of damper i per unit of A_m, [squares, count]
      complex(wp), intent(in) :: rate(:, :)
      !> The power and its integral
      type(power_form_t), intent(out) :: form

      complex(wp) :: conjugate, direct
      real(wp), allocatable :: parts(:, :)
      integer, allocatable :: near(:)
      real(wp) :: distance(size(exponent))
      integer :: m, n

      associate (k => size(exponent), squares => size(rate, 1))
         allocate (form%exponent, source=exponent)
         allocate (form%decay(padded(k)), form%omega(padded(k)), source=0.0_wp)
         form%decay(:k) = -real(exponent, wp)
         form%omega(:k) = aimag(exponent)
         allocate (parts(squares, 2*k))
         parts(:, :k) = real(rate, wp)
         parts(:, k + 1:) = aimag(rate)
         allocate (form%product(2*k, 2*k), form%matrix(2*k, 2*k), form%diagonal(k), form%pairs(2, 0))
         call dgemm('T', 'N', 2*k, 2*k, squares, 1.0_wp, parts, squares, parts, squares, 0.0_wp, form%product, 2*k)
         do n = 1, k
            call integrate_pairs(n, form%decay(:k), form%omega(:k), form%product(:, n), form%product(:, k + n), &
               form%matrix(:, n), form%matrix(:, k + n), distance)
            call find_pair(form, n, n, direct, conjugate)
            form%diagonal(n) = 0.5_wp*real(conjugate, wp)
            ! A constant term (s = 0): A_n^2 is integrated like |A_n|^2
            if (abs(exponent(n))**2 <= negligible) form%diagonal(n) = form%diagonal(n) + 0.5_wp*real(direct, wp)
            if (count(distance <= negligible) == 1) cycle
            near = pack([(m, m=1, k)], distance <= negligible .and. [(m /= n, m=1, k)])
            form%pairs = reshape([form%pairs, [([near(m), n], m=1, size(near))]], [2, size(form%pairs, 2) + size(near)])
         end do
      end associate
   end subroutine make_power_form

   !> Compute the two columns of the matrix that belong to a term.
   pure subroutine integrate_pairs(n, decay, omega, product_real, product_imag, integral_real, integral_imag, distance)
      !> Index n of the term
      integer, intent(in) :: n
      !> -Re s, [count]
      real(wp), contiguous, intent(in) :: decay(:)
      !> Im s, [count]
      real(wp), contiguous, intent(in) :: omega(:)
      !> Products of all rates with the real part of rate n, [2 count]
      real(wp), contiguous, intent(in) :: product_real(:)
      !> Products of all rates with the imaginary part of rate n, [2 count]
      real(wp), contiguous, intent(in) :: product_imag(:)
      !> Column of the matrix that belongs to the real part of term n, [2 count]
      real(wp), contiguous, intent(inout) :: integral_real(:)
      !> Column that belongs to its imaginary part, [2 count]
      real(wp), contiguous, intent(inout) :: integral_imag(:)
      !> |s_m + conj(s_n)|^2; 0 for m = n and if the two terms nearly are each other's conjugate, [count]
      real(wp), contiguous, intent(out) :: distance(:)

      real(wp) :: total_decay, re, min_distance, minus, im, over_minus, over_plus, plus, square, u, v, x, y
      integer :: k, m

      k = size(decay)
      min_distance = cancellation_fraction**2*(decay(n)**2 + omega(n)**2)
      !$omp simd private(minus, square)
      do m = 1, k
         distance(m) = (decay(m) + decay(n))**2 + (omega(m) - omega(n))**2
         square = cancellation_fraction**2*(decay(m)**2 + omega(m)**2)
         distance(m) = merge(0.0_wp, distance(m), distance(m) <= square .and. distance(m) <= min_distance)
      end do
      distance(n) = 0.0_wp
      !$omp simd private(total_decay, re, minus, im, over_minus, over_plus, plus, square, u, v, x, y)
      do m = 1, k
         total_decay = decay(m) + decay(n)
         plus = omega(m) + omega(n)
         minus = omega(m) - omega(n)
         ! 1/(s_m + s_n)/2 = -(total_decay + i plus) over_plus, and likewise with s_m + conj(s_n), minus and over_minus;
         ! the factor 1/2 is that of the power
         square = total_decay**2 + plus**2
         over_plus = merge(0.5_wp, 0.0_wp, square > negligible)/max(square, negligible)
         over_minus = merge(0.5_wp, 0.0_wp, distance(m) > negligible)/max(distance(m), negligible)
         ! With re + i im the direct coefficient, then the conjugate coefficient of the pair: u - i x and v - i y are
         ! these coefficients over 2 (s_m + s_n) and over 2 (s_m + conj(s_n)), and Re((u - i x) A_m A_n
         ! + (v - i y) A_m conj(A_n)) has the entries of the matrix
         re = product_real(m) - product_imag(k + m)
         im = product_imag(m) + product_real(k + m)
         u = over_plus*(plus*im - total_decay*re)
         x = over_plus*(total_decay*im + plus*re)
         re = product_real(m) + product_imag(k + m)
         im = product_real(k + m) - product_imag(m)
         v = over_minus*(minus*im - total_decay*re)
         y = over_minus*(total_decay*im + minus*re)
         integral_real(m) = u + v
         integral_imag(k + m) = v - u
         integral_imag(m) = x - y
         integral_real(k + m) = x + y
      end do
   end subroutine integrate_pairs

   !> Direct coefficient p and conjugate coefficient c of a pair of terms.
   pure subroutine find_pair(form, m, n, direct, conjugate)
      type(power_form_t), intent(in) :: form
      integer, intent(in) :: m
      integer, intent(in) :: n
      complex(wp), intent(out) :: direct
      complex(wp), intent(out) :: conjugate

      associate (k => size(form%exponent), p => form%product)
         direct = cmplx(p(m, n) - p(k + m, k + n), p(m, k + n) + p(k + m, n), wp)
         conjugate = cmplx(p(m, n) + p(k + m, k + n), p(k + m, n) - p(m, k + n), wp)
      end associate
   end subroutine find_pair

   !> Compute the terms over an interval from the amplitudes at its start.
   pure subroutine find_interval_terms(form, amplitude, time, span)
      !> The power, which has the exponents
      type(power_form_t), intent(in) :: form
      !> A_m at the start, [count]
      complex(wp), intent(in) :: amplitude(:)
      real(wp), intent(in) :: time
      !> Terms over the interval. They are not computed again for the amplitudes and length of the last call
      type(interval_terms_t), intent(inout) :: span

      real(wp), dimension(size(form%decay)) :: imaginary_part, less_one, modulus_change
      integer :: m

      associate (k => size(amplitude))
         if (allocated(span%amplitude)) then
            if (size(span%amplitude) == k .and. .not. abs(span%time - time) > 0.0_wp) then
               if (all(abs(real(span%amplitude - amplitude, wp)) <= 0.0_wp .and. &
                  abs(aimag(span%amplitude - amplitude)) <= 0.0_wp)) return
            end if
            if (size(span%amplitude) /= k) deallocate (span%amplitude, span%term, span%change, span%changes, &
               span%sums, span%squares)
         end if
         if (.not. allocated(span%amplitude)) allocate (span%amplitude(k), span%term(k), span%change(k), &
            span%changes(2*k), span%sums(2*k), span%squares(k))
         call find_terms(amplitude, form%decay, form%omega, time, span%term, imaginary_part, less_one, modulus_change)
         span%time = time
         span%amplitude(:) = amplitude
         ! the difference of A^2 and B^2 is (A - B) (A + B)
         do m = 1, k
            associate (x => real(amplitude(m), wp), y => aimag(amplitude(m)))
               span%changes(m) = x*less_one(m) - y*imaginary_part(m)
               span%changes(k + m) = x*imaginary_part(m) + y*less_one(m)
               span%change(m) = cmplx(span%changes(m), span%changes(k + m), wp)
               span%sums(m) = 2.0_wp*x + span%changes(m)
               span%sums(k + m) = 2.0_wp*y + span%changes(k + m)
               span%squares(m) = (x**2 + y**2)*decay_integral(form%decay(m), time, modulus_change(m))
            end associate
         end do
      end associate
   end subroutine find_interval_terms

   !> Energy: the integral of a power over an interval.
   pure real(wp) function energy_over(form, span) result(energy)
      type(power_form_t), intent(in) :: form
      !> Terms of the power over the interval
      type(interval_terms_t), intent(in) :: span

      complex(wp) :: conjugate, direct, s
      integer :: i

      energy = bilinear_form(size(span%sums), form%matrix, span%changes, span%sums) + sum(form%diagonal*span%squares)
      do i = 1, size(form%pairs, 2)
         associate (m => form%pairs(1, i), n => form%pairs(2, i))
            s = form%exponent(m) + conjg(form%exponent(n))
            call find_pair(form, m, n, direct, conjugate)
            energy = energy + 0.5_wp*real(conjugate*span%amplitude(m)*conjg(span%amplitude(n)) &
               *integral(s, span%time, exp(s*span%time)), wp)
         end associate
      end do
   end function energy_over

   !> Integral of exp(-2 decay t) from 0 to t.
   elemental real(wp) function decay_integral(decay, t, modulus_change) result(value)
      real(wp), intent(in) :: decay
      real(wp), intent(in) :: t
      !> exp(-decay t) - 1
      real(wp), intent(in) :: modulus_change

      ! the integral is t if the decay over the interval is below rounding
      value = merge(-modulus_change*(2.0_wp + modulus_change), 2.0_wp*t, decay*t > 1.0e-17_wp) &
         /merge(2.0_wp*decay, 2.0_wp, decay*t > 1.0e-17_wp)
   end function decay_integral

   !> x^T A y.
   pure real(wp) function bilinear_form(order, matrix, x, y) result(value)
      integer, intent(in) :: order
      real(wp), intent(in) :: matrix(order, order)
      real(wp), intent(in) :: x(order)
      real(wp), intent(in) :: y(order)

      real(wp) :: product
      integer :: i, k

      value = 0.0_wp
      do k = 1, order
         product = 0.0_wp
         !$omp simd reduction(+:product)
         do i = 1, order
            product = product + matrix(i, k)*x(i)
         end do
         value = value + product*y(k)
      end do
   end function bilinear_form

   !> Integrals of the terms over an interval, [count].
   pure function integrals_in(form, span) result(value)
      !> The power, which has the exponents
      type(power_form_t), intent(in) :: form
      type(interval_terms_t), intent(in) :: span
      complex(wp) :: value(size(span%change))

      integer :: m

      value = span%amplitude*span%time
      do m = 1, size(value)
         if (form%decay(m) + form%omega(m) > 0.0_wp) value(m) = span%change(m)/form%exponent(m)
      end do
   end function integrals_in

   !> (exp(s t) - 1)/s without cancellation.
   elemental function integral(s, t, exponential) result(value)
      !> Exponent
      complex(wp), intent(in) :: s
      !> Time
      real(wp), intent(in) :: t
      !> exp(s t)
      complex(wp), intent(in) :: exponential
      complex(wp) :: value

      integer :: k
      real(wp), parameter :: inverse_factorial(10) = 1.0_wp/[(gamma(real(k + 1, wp)), k=1, 10)]
      complex(wp) :: x
      real(wp) :: magnitude

      x = s*t
      magnitude = abs(real(x, wp)) + abs(aimag(x))
      if (magnitude < 0.1_wp) then
         ! the series has as many terms as double precision needs
         value = (0.0_wp, 0.0_wp)
         do k = merge(4, size(inverse_factorial), magnitude < 1.0e-3_wp), 1, -1
            value = inverse_factorial(k) + x*value
         end do
         value = t*value
      else
         value = (exponential - 1.0_wp)/s
      end if
   end function integral

end module power_integrals
