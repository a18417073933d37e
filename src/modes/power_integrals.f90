!> Integrals of quadratic forms of exponentials, none of which grows: what a power takes in some time.
module power_integrals
   use damped_oscillators, only: padded
   use exponential_powers, only: find_terms
   use kinds, only: wp
   use lapack_interfaces, only: dgemm
   implicit none (type, external)
   private
   public :: power_form_t, span_t, make_power_form, find_span, taken_by, integral, integrals_in

   !> Re sum (plain A_m A_n + conjugate A_m conj(A_n))/2 of terms A_m that go with exp(s_m t); `find_pair` tells both of
   !> a pair.
   type :: power_form_t
      !> s, [count], with -Re s and Im s filled up with zeros to whole vectors
      complex(wp), allocatable :: exponent(:)
      real(wp), allocatable :: decay(:), omega(:)
      !> Sums of products of the real parts of the rates, then of the imaginary ones, [2 count, 2 count]
      real(wp), allocatable :: product(:, :)
      !> Its integral: x^T matrix x with x the real parts of all A_m, then the imaginary ones, [2 count, 2 count], but
      !> for A_m conj(A_m), which decays as slowly as it may: the factors of the integral of |A_m|^2, [count]
      real(wp), allocatable :: matrix(:, :), steady(:)
      !> And but for pairs that nearly are each other's conjugate, [2, pairs]
      integer, allocatable :: close(:, :)
   end type power_form_t

   !> The terms between two instants.
   type :: span_t
      real(wp) :: time = 0.0_wp
      !> At the first of them, and at the second, [count]
      complex(wp), allocatable :: amplitude(:), term(:)
      !> What they change by, exp(s t) - 1 times that, [count]
      complex(wp), allocatable :: change(:)
      !> Real and imaginary parts of that and of the sum of first and last, [2 count]; integral of |A_m|^2, [count]
      real(wp), allocatable :: changes(:), sums(:), steady(:)
   end type span_t

   !> A sum of two exponents smaller than this share of them loses digits.
   real(wp), parameter :: nearness = 0.02_wp
   !> And the square of a sum below this is none.
   real(wp), parameter :: least = tiny(1.0_wp)

contains

   !> A power is the sum of squares of Re sum rate_im A_m over i. What it takes between two instants is the difference
   !> of a quadratic form of the terms.
   pure subroutine make_power_form(exponent, rate, form)
      !> s, Re s <= 0 <= Im s
      complex(wp), intent(in) :: exponent(:)
      !> Of what is squared, per unit of each term, [squares, count]
      complex(wp), intent(in) :: rate(:, :)
      !> With its integral
      type(power_form_t), intent(out) :: form

      complex(wp) :: conjugate, plain
      real(wp), allocatable :: parts(:, :)
      integer, allocatable :: near(:)
      real(wp) :: apart(size(exponent))
      integer :: m, n

      associate (k => size(exponent), squares => size(rate, 1))
         allocate (form%exponent, source=exponent)
         allocate (form%decay(padded(k)), form%omega(padded(k)), source=0.0_wp)
         form%decay(:k) = -real(exponent, wp)
         form%omega(:k) = aimag(exponent)
         allocate (parts(squares, 2*k))
         parts(:, :k) = real(rate, wp)
         parts(:, k + 1:) = aimag(rate)
         allocate (form%product(2*k, 2*k), form%matrix(2*k, 2*k), form%steady(k), form%close(2, 0))
         call dgemm('T', 'N', 2*k, 2*k, squares, 1.0_wp, parts, squares, parts, squares, 0.0_wp, form%product, 2*k)
         do n = 1, k
            call integrate_pairs(n, form%decay(:k), form%omega(:k), form%product(:, n), form%product(:, k + n), &
               form%matrix(:, n), form%matrix(:, k + n), apart)
            call find_pair(form, n, n, plain, conjugate)
            form%steady(n) = 0.5_wp*real(conjugate, wp)
            if (abs(exponent(n))**2 <= least) form%steady(n) = form%steady(n) + 0.5_wp*real(plain, wp)
            if (count(apart <= least) == 1) cycle
            near = pack([(m, m=1, k)], apart <= least .and. [(m /= n, m=1, k)])
            form%close = reshape([form%close, [([near(m), n], m=1, size(near))]], [2, size(form%close, 2) + size(near)])
         end do
      end associate
   end subroutine make_power_form

   !> The columns of the matrix for a term.
   pure subroutine integrate_pairs(n, decay, omega, low, high, low_integral, high_integral, apart)
      !> Which one
      integer, intent(in) :: n
      !> -Re s, Im s, [count]
      real(wp), contiguous, intent(in) :: decay(:)
      real(wp), contiguous, intent(in) :: omega(:)
      !> Products with its real and with its imaginary part, [2 count]
      real(wp), contiguous, intent(in) :: low(:)
      real(wp), contiguous, intent(in) :: high(:)
      !> What is there in the matrix, [2 count]
      real(wp), contiguous, intent(inout) :: low_integral(:)
      real(wp), contiguous, intent(inout) :: high_integral(:)
      !> |s_m + conj(s_n)|^2, 0 for itself and where they nearly are each other's conjugate, [count]
      real(wp), contiguous, intent(out) :: apart(:)

      real(wp) :: both, even, least_apart, minus, odd, over_minus, over_plus, plus, square, u, v, x, y
      integer :: k, m

      k = size(decay)
      least_apart = nearness**2*(decay(n)**2 + omega(n)**2)
      !$omp simd private(minus, square)
      do m = 1, k
         apart(m) = (decay(m) + decay(n))**2 + (omega(m) - omega(n))**2
         square = nearness**2*(decay(m)**2 + omega(m)**2)
         apart(m) = merge(0.0_wp, apart(m), apart(m) <= square .and. apart(m) <= least_apart)
      end do
      apart(n) = 0.0_wp
      !$omp simd private(both, even, minus, odd, over_minus, over_plus, plus, square, u, v, x, y)
      do m = 1, k
         both = decay(m) + decay(n)
         plus = omega(m) + omega(n)
         minus = omega(m) - omega(n)
         ! 1/(s_m + s_n) = -(both + i plus) over_plus, 1/(s_m + conj(s_n)) = -(both + i minus) over_minus
         square = both**2 + plus**2
         over_plus = merge(0.5_wp, 0.0_wp, square > least)/max(square, least)
         over_minus = merge(0.5_wp, 0.0_wp, apart(m) > least)/max(apart(m), least)
         even = low(m) - high(k + m)
         odd = high(m) + low(k + m)
         u = over_plus*(plus*odd - both*even)
         x = over_plus*(both*odd + plus*even)
         even = low(m) + high(k + m)
         odd = low(k + m) - high(m)
         v = over_minus*(minus*odd - both*even)
         y = over_minus*(both*odd + minus*even)
         low_integral(m) = u + v
         high_integral(k + m) = v - u
         high_integral(m) = x - y
         low_integral(k + m) = x + y
      end do
   end subroutine integrate_pairs

   !> Sums of products of the rates of a pair: its plain and its conjugate share.
   pure subroutine find_pair(form, m, n, plain, conjugate)
      type(power_form_t), intent(in) :: form
      integer, intent(in) :: m
      integer, intent(in) :: n
      complex(wp), intent(out) :: plain
      complex(wp), intent(out) :: conjugate

      associate (k => size(form%exponent), p => form%product)
         plain = cmplx(p(m, n) - p(k + m, k + n), p(m, k + n) + p(k + m, n), wp)
         conjugate = cmplx(p(m, n) + p(k + m, k + n), p(k + m, n) - p(m, k + n), wp)
      end associate
   end subroutine find_pair

   !> The terms from now on.
   pure subroutine find_span(form, amplitude, time, span)
      !> With the exponents
      type(power_form_t), intent(in) :: form
      !> A_m now, [count]
      complex(wp), intent(in) :: amplitude(:)
      real(wp), intent(in) :: time
      !> As it is where it is that already
      type(span_t), intent(inout) :: span

      real(wp), dimension(size(form%decay)) :: imaginary_part, less_one, fall
      integer :: m

      associate (k => size(amplitude))
         if (allocated(span%amplitude)) then
            if (size(span%amplitude) == k .and. .not. abs(span%time - time) > 0.0_wp) then
               if (all(abs(real(span%amplitude - amplitude, wp)) <= 0.0_wp .and. &
                  abs(aimag(span%amplitude - amplitude)) <= 0.0_wp)) return
            end if
            if (size(span%amplitude) /= k) deallocate (span%amplitude, span%term, span%change, span%changes, &
               span%sums, span%steady)
         end if
         if (.not. allocated(span%amplitude)) allocate (span%amplitude(k), span%term(k), span%change(k), &
            span%changes(2*k), span%sums(2*k), span%steady(k))
         call find_terms(amplitude, form%decay, form%omega, time, span%term, imaginary_part, less_one, fall)
         span%time = time
         span%amplitude(:) = amplitude
         ! of A^2 and B^2 the difference is (A - B) (A + B)
         do m = 1, k
            associate (x => real(amplitude(m), wp), y => aimag(amplitude(m)))
               span%changes(m) = x*less_one(m) - y*imaginary_part(m)
               span%changes(k + m) = x*imaginary_part(m) + y*less_one(m)
               span%change(m) = cmplx(span%changes(m), span%changes(k + m), wp)
               span%sums(m) = 2.0_wp*x + span%changes(m)
               span%sums(k + m) = 2.0_wp*y + span%changes(k + m)
               span%steady(m) = (x**2 + y**2)*time_of_decay(form%decay(m), time, fall(m))
            end associate
         end do
      end associate
   end subroutine find_span

   !> What a power takes.
   pure function taken_by(form, span) result(energy)
      type(power_form_t), intent(in) :: form
      !> Of its terms
      type(span_t), intent(in) :: span
      real(wp) :: energy

      complex(wp) :: conjugate, plain, s
      integer :: i

      energy = bilinear_form(size(span%sums), form%matrix, span%changes, span%sums) + sum(form%steady*span%steady)
      do i = 1, size(form%close, 2)
         associate (m => form%close(1, i), n => form%close(2, i))
            s = form%exponent(m) + conjg(form%exponent(n))
            call find_pair(form, m, n, plain, conjugate)
            energy = energy + 0.5_wp*real(conjugate*span%amplitude(m)*conjg(span%amplitude(n)) &
               *integral(s, span%time, exp(s*span%time)), wp)
         end associate
      end do
   end function taken_by

   !> Integral of exp(-2 decay t) up to a time.
   elemental function time_of_decay(decay, t, fall) result(value)
      real(wp), intent(in) :: decay
      real(wp), intent(in) :: t
      !> exp(-decay t) - 1
      real(wp), intent(in) :: fall
      real(wp) :: value

      ! what decays so little lasts for all of it
      value = merge(-fall*(2.0_wp + fall), 2.0_wp*t, decay*t > 1.0e-17_wp) &
         /merge(2.0_wp*decay, 2.0_wp, decay*t > 1.0e-17_wp)
   end function time_of_decay

   !> x^T A y.
   pure function bilinear_form(order, matrix, x, y) result(value)
      integer, intent(in) :: order
      real(wp), intent(in) :: matrix(order, order)
      real(wp), intent(in) :: x(order)
      real(wp), intent(in) :: y(order)
      real(wp) :: value

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

   !> Integrals of the terms of a span, [count].
   pure function integrals_in(form, span) result(value)
      !> With the exponents
      type(power_form_t), intent(in) :: form
      type(span_t), intent(in) :: span
      complex(wp) :: value(size(span%change))

      integer :: m

      value = span%amplitude*span%time
      do m = 1, size(value)
         if (form%decay(m) + form%omega(m) > 0.0_wp) value(m) = span%change(m)/form%exponent(m)
      end do
   end function integrals_in

   !> (exp(s t) - 1)/s without cancellation.
   elemental function integral(s, t, power) result(value)
      !> Exponent
      complex(wp), intent(in) :: s
      !> Time
      real(wp), intent(in) :: t
      !> exp(s t)
      complex(wp), intent(in) :: power
      complex(wp) :: value

      integer :: k
      real(wp), parameter :: inverse_factorial(10) = 1.0_wp/[(gamma(real(k + 1, wp)), k=1, 10)]
      complex(wp) :: x
      real(wp) :: angle

      x = s*t
      angle = abs(real(x, wp)) + abs(aimag(x))
      if (angle < 0.1_wp) then
         ! as many terms as there are digits in
         value = (0.0_wp, 0.0_wp)
         do k = merge(4, size(inverse_factorial), angle < 1.0e-3_wp), 1, -1
            value = inverse_factorial(k) + x*value
         end do
         value = t*value
      else
         value = (power - 1.0_wp)/s
      end if
   end function integral

end module power_integrals
