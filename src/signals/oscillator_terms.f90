!> The terms that damped oscillators add to a signal, and bounds on these terms that hold from an instant on.
!>
!> From the start of a phase on, each mode is a sum of two functions of time, its basis, with constant factors: cosine
!> and sine with their envelope, or the two exponentials of a mode far beyond critical damping. The factors of the
!> terms, of their derivatives and of their bounds depend on the initial state alone.
module oscillator_terms
   use certified_search, only: bound_curvature, bound_jerk, bound_value, term_columns, &
      term_curvature, term_rate, term_value
   use damped_oscillators, only: find_decay_factors, find_oscillations, decay_integral, lanes, oscillators_t, padded
   use kinds, only: i8, wp
   implicit none (type, external)
   private
   public :: find_basis, find_factors, find_terms, find_values, weighted_sum, basis_columns, factor_columns

   ! The following constants are columns of the basis, an array with one row for each mode, at one instant.
   !> exp(-d t) cos(w t) with the decay rate d and the spread w; beyond critical damping exp(-d t).
   integer, parameter :: first_function = 1
   !> exp(-d t) sin(w t)/w; beyond critical damping exp(-d t) (1 - exp(-2 w t))/(2 w), or, if the exponents are
   !> separated, the fast exponential.
   integer, parameter :: second_function = 2
   !> Bound on the first function: exp(-d t).
   integer, parameter :: first_envelope = 3
   !> Bound on the second function: t exp(-d t), or the fast exponential.
   integer, parameter :: second_envelope = 4
   !> Number of these columns.
   integer, parameter :: basis_columns = 4
   !> Number of the factors of a mode: each column of `certified_search` is a sum of two products. Columns 2 c - 1 and
   !> 2 c are the factors of the first and the second function, or of the envelopes if column c is a bound.
   integer, parameter :: factor_columns = 2*term_columns

contains

   !> The basis at an instant.
   pure subroutine find_basis(oscillators, n, t, basis)
      type(oscillators_t), intent(in) :: oscillators
      !> Number of modes, padded
      integer, intent(in) :: n
      !> Instant, >= 0
      real(wp), intent(in) :: t
      !> Columns as above
      real(wp), intent(out) :: basis(n, basis_columns)

      ! sin(w t)/w of the underdamped modes
      real(wp) :: sines(padded(oscillators%underdamped))
      ! number of modes in SIMD vectors of underdamped modes alone
      integer :: below
      ! number of modes in all SIMD vectors that contain modes up to `unseparated`
      integer :: last
      integer :: b, i

      associate (unseparated => oscillators%unseparated)
         if (.not. t > 0.0_wp) then
            basis(:, first_function) = 1.0_wp
            basis(:, first_envelope) = 1.0_wp
            basis(:unseparated, second_function) = 0.0_wp
            basis(unseparated + 1:, second_function) = 1.0_wp
            basis(:, second_envelope) = basis(:, second_function)
            return
         end if
         below = lanes*(oscillators%underdamped/lanes)
         last = padded(unseparated)
         call find_decay_factors(n/lanes, t, oscillators%decay, basis(:, first_envelope))
         if (below < n) call find_decay_factors((n - below)/lanes, t, oscillators%second(below + 1:), &
            basis(below + 1:, second_envelope))
         if (oscillators%underdamped > 0) call find_oscillations(size(sines)/lanes, t, oscillators, &
            basis(:size(sines), first_function), sines)
         do b = 0, below - lanes, lanes
            !$omp simd
            do i = b + 1, b + lanes
               basis(i, first_function) = basis(i, first_envelope)*basis(i, first_function)
               basis(i, second_function) = basis(i, first_envelope)*sines(i)
               basis(i, second_envelope) = t*basis(i, first_envelope)
            end do
         end do
         if (below < last) call mix_functions(below, last, n, oscillators, t, sines, basis)
         do b = last, n - lanes, lanes
            !$omp simd
            do i = b + 1, b + lanes
               basis(i, first_function) = basis(i, first_envelope)
               basis(i, second_function) = basis(i, second_envelope)
            end do
         end do
      end associate
   end subroutine find_basis

   !> The basis in SIMD vectors that contain modes of different kinds.
   pure subroutine mix_functions(below, last, n, oscillators, t, sines, basis)
      !> Number of modes in the SIMD vectors before
      integer, intent(in) :: below
      !> Index of the last mode in these SIMD vectors
      integer, intent(in) :: last
      !> Number of modes, padded
      integer, intent(in) :: n
      type(oscillators_t), intent(in) :: oscillators
      real(wp), intent(in) :: t
      !> sin(w t)/w of the underdamped modes
      real(wp), intent(in) :: sines(:)
      !> On entry cosines of underdamped modes, first envelope, and exponentials of the rates `second`
      real(wp), intent(inout) :: basis(n, basis_columns)

      ! second function over the first envelope
      real(wp) :: second(lanes)
      real(wp) :: envelope
      ! as long as real numbers, so that both fill SIMD vectors alike
      integer(i8) :: b, i, j, underdamped, unseparated

      underdamped = int(oscillators%underdamped, i8)
      unseparated = int(oscillators%unseparated, i8)
      do b = int(below, i8), int(last - lanes, i8), lanes
         second = 0.0_wp
         if (unseparated > underdamped) then
            !$omp simd
            do j = 1, lanes
               second(j) = decay_integral(2.0_wp*oscillators%spread(b + j)*t, basis(b + j, second_envelope), t, &
                  oscillators%inverse_spread(b + j))
            end do
         end if
         if (b < underdamped) then
            !$omp simd
            do j = 1, lanes
               second(j) = merge(sines(b + j), second(j), b + j <= underdamped)
               basis(b + j, first_function) = merge(basis(b + j, first_function), 1.0_wp, b + j <= underdamped)
            end do
         else
            basis(b + 1:b + lanes, first_function) = 1.0_wp
         end if
         !$omp simd private(i, envelope)
         do j = 1, lanes
            i = b + j
            envelope = basis(i, first_envelope)
            basis(i, first_function) = envelope*basis(i, first_function)
            basis(i, second_function) = merge(envelope*second(j), basis(i, second_envelope), i <= unseparated)
            basis(i, second_envelope) = merge(t*envelope, basis(i, second_envelope), i <= unseparated)
         end do
      end do
   end subroutine mix_functions

   !> The factors of the terms of a signal, or of a derivative of the signal.
   pure subroutine find_factors(oscillators, n, order, weight, cutoff, is_viscous, z0, v0, factors)
      type(oscillators_t), intent(in) :: oscillators
      !> Number of modes, padded
      integer, intent(in) :: n
      !> Order of the derivative; 0: the signal itself
      integer, intent(in) :: order
      !> Weights of the modes
      real(wp), intent(in) :: weight(n)
      !> Fast exponentials whose weighted amplitude does not exceed this are left out
      real(wp), intent(in) :: cutoff
      !> Whether modes with separated exponents enter by z + 2 zeta z', the elastic and viscous force over W^2, not by z
      logical, intent(in) :: is_viscous
      !> Displacements at time 0
      real(wp), intent(in) :: z0(n)
      !> Velocities at time 0
      real(wp), intent(in) :: v0(n)
      !> Columns as above
      real(wp), intent(out) :: factors(n, factor_columns)

      call find_oscillator_factors(padded(oscillators%unseparated), n, order, oscillators, weight, z0, v0, factors)
      if (oscillators%unseparated < n) call find_exponential_factors(n, order, oscillators, weight, cutoff, &
         is_viscous, z0, v0, factors)
   end subroutine find_factors

   !> The factors of the modes without separated exponents.
   pure subroutine find_oscillator_factors(last, n, order, oscillators, weight, z0, v0, factors)
      !> Number of these modes, padded
      integer, intent(in) :: last
      integer, intent(in) :: n
      integer, intent(in) :: order
      type(oscillators_t), intent(in) :: oscillators
      real(wp), intent(in), dimension(n) :: weight, z0, v0
      real(wp), intent(inout) :: factors(n, factor_columns)

      ! derivatives of this order and of higher orders
      real(wp), dimension(lanes) :: z, v, a, jerk, snap
      real(wp) :: next
      ! as long as real numbers, so that both fill SIMD vectors alike
      integer(i8) :: b, i, j, underdamped
      integer :: k

      underdamped = int(oscillators%underdamped, i8)
      do b = 0_i8, int(last - lanes, i8), lanes
         z = z0(b + 1:b + lanes)
         v = v0(b + 1:b + lanes)
         do k = 1, order
            !$omp simd private(next)
            do j = 1, lanes
               next = derivative(z(j), v(j), oscillators%lane_square(b + j), oscillators%two_zeta, &
                  oscillators%mass_rate(b + j))
               z(j) = v(j)
               v(j) = next
            end do
         end do
         !$omp simd private(i)
         do j = 1, lanes
            i = b + j
            a(j) = derivative(z(j), v(j), oscillators%lane_square(i), oscillators%two_zeta, oscillators%mass_rate(i))
            jerk(j) = derivative(v(j), a(j), oscillators%lane_square(i), oscillators%two_zeta, oscillators%mass_rate(i))
            snap(j) = derivative(a(j), jerk(j), oscillators%lane_square(i), oscillators%two_zeta, &
               oscillators%mass_rate(i))
            factors(i, 2*term_value - 1) = weight(i)*z(j)
            factors(i, 2*term_value) = weight(i)*(v(j) + oscillators%decay(i)*z(j))
            factors(i, 2*term_rate - 1) = weight(i)*v(j)
            factors(i, 2*term_rate) = weight(i)*(a(j) + oscillators%decay(i)*v(j))
            factors(i, 2*term_curvature - 1) = weight(i)*a(j)
            factors(i, 2*term_curvature) = weight(i)*(jerk(j) + oscillators%decay(i)*a(j))
         end do
         !$omp simd private(i)
         do j = 1, lanes
            i = b + j
            call bound_factors(factors(i, 2*term_value - 1), factors(i, 2*term_value), oscillators%decay(i), &
               oscillators%spread(i), oscillators%inverse_spread(i), i <= underdamped, factors(i, 2*bound_value - 1), &
               factors(i, 2*bound_value))
            call bound_factors(factors(i, 2*term_curvature - 1), factors(i, 2*term_curvature), oscillators%decay(i), &
               oscillators%spread(i), oscillators%inverse_spread(i), i <= underdamped, &
               factors(i, 2*bound_curvature - 1), factors(i, 2*bound_curvature))
            call bound_factors(weight(i)*jerk(j), weight(i)*(snap(j) + oscillators%decay(i)*jerk(j)), &
               oscillators%decay(i), oscillators%spread(i), oscillators%inverse_spread(i), i <= underdamped, &
               factors(i, 2*bound_jerk - 1), factors(i, 2*bound_jerk))
         end do
      end do
   end subroutine find_oscillator_factors

   !> The next derivative of a mode, by its equation of motion.
   elemental real(wp) function derivative(z, v, square, two_zeta, mass_rate)
      real(wp), intent(in) :: z
      real(wp), intent(in) :: v
      !> W^2
      real(wp), intent(in) :: square
      real(wp), intent(in) :: two_zeta
      !> alpha
      real(wp), intent(in) :: mass_rate

      derivative = -square*(z + two_zeta*v) - mass_rate*v
   end function derivative

   !> Factors of the bound on a term a f + b g, with f and g the two functions of the basis, from an instant on. The
   !> magnitudes of f exp(d t) and g exp(d t) are at most 1 and 1/w, or 1/(2 w) beyond critical damping. Near critical
   !> damping these are far above the term; |a| exp(-d t) + |b| t exp(-d t) then bounds the term at the instant t, and
   !> later the second of these summands rises by at most |b| exp(-d t)/(e d).
   elemental subroutine bound_factors(a, b, decay, spread, inverse_spread, is_underdamped, first, second)
      !> Factors of the term
      real(wp), intent(in) :: a, b
      !> Decay rate d
      real(wp), intent(in) :: decay
      !> w
      real(wp), intent(in) :: spread
      real(wp), intent(in) :: inverse_spread
      logical, intent(in) :: is_underdamped
      !> Factors of the envelopes in the bound
      real(wp), intent(out) :: first, second

      ! 1/e
      real(wp), parameter :: max_rise = exp(-1.0_wp)
      ! spread over decay rate from which on the mode is not near critical damping
      real(wp), parameter :: min_ratio = 0.3_wp
      logical :: is_near

      is_near = spread < min_ratio*decay
      first = merge(sqrt(a**2 + (b*inverse_spread)**2), abs(a) + 0.5_wp*abs(b)*inverse_spread, is_underdamped)
      first = merge(abs(a) + abs(b)*max_rise/max(decay, spread), first, is_near)
      second = merge(abs(b), 0.0_wp, is_near)
   end subroutine bound_factors

   !> The factors of the modes with separated exponents: A exp(-slow t) + B exp(-fast t). Each exponential is
   !> differentiated by itself: in the equation of motion the terms z and 2 zeta z' of the slow exponential cancel,
   !> which leaves rounding errors.
   pure subroutine find_exponential_factors(n, order, oscillators, weight, cutoff, is_viscous, z0, v0, factors)
      integer, intent(in) :: n
      integer, intent(in) :: order
      type(oscillators_t), intent(in) :: oscillators
      real(wp), intent(in) :: weight(n)
      real(wp), intent(in) :: cutoff
      logical, intent(in) :: is_viscous
      real(wp), intent(in) :: z0(n), v0(n)
      !> Modes up to `unseparated` stay unchanged
      real(wp), intent(inout) :: factors(n, factor_columns)

      real(wp) :: slow(n), fast(n), slow_rate, fast_rate
      ! as long as real numbers, so that both fill SIMD vectors alike
      integer(i8) :: first, i, last, unchanged
      integer :: k

      first = int(lanes*(oscillators%unseparated/lanes) + 1, i8)
      last = int(n, i8)
      !$omp simd
      do i = first, last
         fast(i) = -0.5_wp*oscillators%inverse_spread(i)*(v0(i) + oscillators%decay(i)*z0(i))
         fast(i) = merge(fast(i), 0.0_wp, abs(weight(i)*fast(i)) > cutoff)
         slow(i) = weight(i)*(z0(i) - fast(i))
         fast(i) = weight(i)*fast(i)
      end do
      if (is_viscous) then
         ! 1 - 2 zeta s = -s (s - alpha)/W^2 for both decay rates s
         !$omp simd
         do i = first, last
            slow(i) = -slow(i)*oscillators%inverse_square(i)*(oscillators%decay(i)*(oscillators%decay(i) &
               - oscillators%mass_rate(i)))
            fast(i) = -fast(i)*oscillators%inverse_square(i)*(oscillators%fast(i)*oscillators%fast_excess(i))
         end do
      end if
      do k = 1, order
         slow(first:) = -oscillators%decay(first:)*slow(first:)
         fast(first:) = -oscillators%fast(first:)*fast(first:)
      end do
      unchanged = int(oscillators%unseparated, i8)
      !$omp simd private(slow_rate, fast_rate)
      do i = first, last
         slow_rate = -oscillators%decay(i)
         fast_rate = -oscillators%fast(i)
         factors(i, 1) = merge(factors(i, 1), slow(i), i <= unchanged)
         factors(i, 2) = merge(factors(i, 2), fast(i), i <= unchanged)
         factors(i, 3) = merge(factors(i, 3), slow_rate*slow(i), i <= unchanged)
         factors(i, 4) = merge(factors(i, 4), fast_rate*fast(i), i <= unchanged)
         slow(i) = slow_rate**2*slow(i)
         fast(i) = fast_rate**2*fast(i)
         factors(i, 5) = merge(factors(i, 5), slow(i), i <= unchanged)
         factors(i, 6) = merge(factors(i, 6), fast(i), i <= unchanged)
         ! `find_terms` bounds the depth of these modes by their terms
         factors(i, 7) = merge(factors(i, 7), 0.0_wp, i <= unchanged)
         factors(i, 8) = merge(factors(i, 8), 0.0_wp, i <= unchanged)
         factors(i, 9) = merge(factors(i, 9), abs(slow(i)), i <= unchanged)
         factors(i, 10) = merge(factors(i, 10), abs(fast(i)), i <= unchanged)
         factors(i, 11) = merge(factors(i, 11), abs(slow_rate*slow(i)), i <= unchanged)
         factors(i, 12) = merge(factors(i, 12), abs(fast_rate*fast(i)), i <= unchanged)
      end do
   end subroutine find_exponential_factors

   !> The terms and their bounds at an instant, the sums of all columns, and a magnitude proportional to the rounding
   !> error of the sum.
   pure subroutine find_terms(blocks, factors, basis, t, terms, sums, magnitude)
      !> Number of SIMD vectors in each column
      integer, intent(in) :: blocks
      real(wp), intent(in) :: factors(lanes, blocks, factor_columns)
      real(wp), intent(in) :: basis(lanes, blocks, basis_columns)
      !> Time since the start, with which the rounding error of the phase W t grows
      real(wp), intent(in) :: t
      !> Columns as in `certified_search`
      real(wp), intent(out) :: terms(lanes, blocks, term_columns)
      real(wp), intent(out) :: sums(term_columns)
      !> sum of 4 |value| + t |rate| of the terms
      real(wp), intent(out) :: magnitude

      real(wp) :: partial(lanes, term_columns), magnitudes(lanes)
      integer :: b, c, i

      partial = 0.0_wp
      magnitudes = 0.0_wp
      do b = 1, blocks
         do c = 1, term_curvature
            !$omp simd
            do i = 1, lanes
               terms(i, b, c) = factors(i, b, 2*c - 1)*basis(i, b, first_function) &
                  + factors(i, b, 2*c)*basis(i, b, second_function)
            end do
         end do
         do c = bound_value, bound_jerk
            !$omp simd
            do i = 1, lanes
               terms(i, b, c) = factors(i, b, 2*c - 1)*basis(i, b, first_envelope) &
                  + factors(i, b, 2*c)*basis(i, b, second_envelope)
            end do
         end do
         !$omp simd
         do i = 1, lanes
            ! if two exponentials differ in sign, their sum ends with the sign of the slow one; the depth of other modes
            ! exceeds their present terms
            terms(i, b, bound_value) = max(terms(i, b, bound_value), -terms(i, b, term_value), &
               -factors(i, b, 2*term_value - 1)*basis(i, b, first_function))
            magnitudes(i) = magnitudes(i) + 4.0_wp*abs(terms(i, b, term_value)) + t*abs(terms(i, b, term_rate))
         end do
         do c = 1, term_columns
            !$omp simd
            do i = 1, lanes
               partial(i, c) = partial(i, c) + terms(i, b, c)
            end do
         end do
      end do
      do c = 1, term_columns
         sums(c) = total(partial(:, c))
      end do
      magnitude = total(magnitudes)
   end subroutine find_terms

   !> The signal, its slope, and a magnitude as in `find_terms`.
   pure subroutine find_values(blocks, factors, basis, t, value, slope, magnitude)
      integer, intent(in) :: blocks
      real(wp), intent(in) :: factors(lanes, blocks, factor_columns)
      real(wp), intent(in) :: basis(lanes, blocks, basis_columns)
      real(wp), intent(in) :: t
      real(wp), intent(out) :: value
      real(wp), intent(out) :: slope
      real(wp), intent(out) :: magnitude

      real(wp) :: values(lanes), slopes(lanes), magnitudes(lanes), term, rate
      integer :: b, i

      values = 0.0_wp
      slopes = 0.0_wp
      magnitudes = 0.0_wp
      do b = 1, blocks
         !$omp simd private(term, rate)
         do i = 1, lanes
            term = factors(i, b, 2*term_value - 1)*basis(i, b, first_function) &
               + factors(i, b, 2*term_value)*basis(i, b, second_function)
            rate = factors(i, b, 2*term_rate - 1)*basis(i, b, first_function) &
               + factors(i, b, 2*term_rate)*basis(i, b, second_function)
            values(i) = values(i) + term
            slopes(i) = slopes(i) + rate
            magnitudes(i) = magnitudes(i) + 4.0_wp*abs(term) + t*abs(rate)
         end do
      end do
      value = total(values)
      slope = total(slopes)
      magnitude = total(magnitudes)
   end subroutine find_values

   !> Sum of the modes with their weights.
   pure real(wp) function weighted_sum(blocks, weight, mode)
      integer, intent(in) :: blocks
      real(wp), intent(in) :: weight(lanes, blocks)
      real(wp), intent(in) :: mode(lanes, blocks)

      real(wp) :: values(lanes)
      integer :: b

      values = 0.0_wp
      do b = 1, blocks
         values = values + weight(:, b)*mode(:, b)
      end do
      weighted_sum = total(values)
   end function weighted_sum

   !> Sum of the elements of a SIMD vector, by halves.
   pure real(wp) function total(vector)
      real(wp), intent(in) :: vector(lanes)

      real(wp) :: half(lanes/2), quarter(lanes/4)

      half = vector(:lanes/2) + vector(lanes/2 + 1:)
      quarter = half(:lanes/4) + half(lanes/4 + 1:)
      total = quarter(1) + quarter(2)
   end function total

end module oscillator_terms
