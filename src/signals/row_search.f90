!> The first zero among many signals made of the same rows, found so that no zero before it can be missed
!> (docs/theory.md, section 23).
!>
!> All signals take the same steps. A step in which a signal may have a zero is halved until the signal certainly has no
!> zero, or exactly one, within the step.
module row_search
   use bracketed_zero, only: bracket_t, enter_value, choose_point
   use kinds, only: i8, wp
   use row_basis, only: advance, advance_by, bound_rows, evaluate_rows, lowest_step, row_basis_t
   use row_signals, only: bernstein_coefficients, bound_signal, error_fraction, evaluate_signal, exponent_of, &
      max_steps, monomial_coefficients, power_of_two, row_path_t, row_signal_t
   implicit none (type, external)
   private
   public :: search_rows

   !> Error of the slope of a quintic Hermite polynomial as a fraction of B h**5 (Birkhoff and Priver).
   real(wp), parameter :: slope_error_fraction = sqrt(5.0_wp)/30000.0_wp

   !> The polynomial of the first trial of a step has an error of about this fraction of the value of the signal or of
   !> its change.
   real(wp), parameter :: target_error_fraction = 0.03_wp

   !> Maximum number of evaluations, after which the signals are searched one by one.
   integer(i8), parameter :: max_evaluations = 4_i8*max_steps

   !> Number of zeros of a signal in a step: none. The integers of loops over signals are as long as the real numbers,
   !> so that both fill SIMD vectors alike.
   integer(i8), parameter :: has_no_zero = 0_i8
   !> Number of zeros of a signal in a step: unknown.
   integer(i8), parameter :: is_undecided = 1_i8
   !> Number of zeros of a signal in a step: exactly one.
   integer(i8), parameter :: has_one_zero = 2_i8

   !> Columns of the coefficients of the signals, as in `row_signal_t`.
   integer, parameter :: offset = 1, slope = 2, factor = 3, rate_factor = 4

   !> A step of all signals.
   type :: step_t
      !> Start of the step, since the start of the phase
      real(wp) :: from = 0.0_wp
      !> Length of the step
      real(wp) :: length = 0.0_wp
      !> Node (index of the path) at the end of the step
      integer :: next = 0
      !> Number of steps before this step
      integer :: count = 0
      !> Coefficients of each signal, [signals, 4]. The arrays are those of `search_rows`, which allocates none because
      !> searches are many and short
      real(wp), pointer, contiguous :: coefficient(:, :) => null()
      !> Row of each signal, [signals]
      integer(i8), pointer, contiguous :: row(:) => null()
      !> Order of the first derivative of each signal that does not vanish at the start of the step, [signals]
      integer(i8), pointer, contiguous :: order(:) => null()
      !> Value, slope and curvature of each signal at the start of the step, [signals, 0:2]
      real(wp), pointer, contiguous :: at_start(:, :) => null()
      !> The same at the end of the step
      real(wp), pointer, contiguous :: at_end(:, :) => null()
      !> Bound of the sixth derivative of each signal, [signals]
      real(wp), pointer, contiguous :: bound(:) => null()
      !> Rounding error of each signal, [signals]
      real(wp), pointer, contiguous :: rounding(:) => null()
      !> Lower bound of each signal, [signals]
      real(wp), pointer, contiguous :: floor(:) => null()
      !> Maximum Bernstein coefficient of each signal in the step, [signals]
      real(wp), pointer, contiguous :: top(:) => null()
      !> `has_no_zero`, `is_undecided` or `has_one_zero`, [signals]
      integer(i8), pointer, contiguous :: answer(:) => null()
   end type step_t

contains

   !> Advance until the first signal vanishes, or to the limit.
   subroutine search_rows(basis, limit, signals, path, first_signal, time, first_node)
      type(row_basis_t), intent(inout) :: basis
      real(wp), intent(in) :: limit
      !> Signals without `is_certified` on return must be searched one by one
      type(row_signal_t), intent(inout) :: signals(:)
      !> On entry node 0 has the amplitudes at the start
      type(row_path_t), intent(inout) :: path
      !> The signal that vanishes first; 0: none
      integer, intent(out) :: first_signal
      !> Instant of the zero, or the limit
      real(wp), intent(out) :: time
      !> Last node of an earlier search of the phase, at which this search begins; absent: it begins at the start
      integer, intent(in), optional :: first_node

      type(step_t) :: step
      ! arrays of the step
      real(wp), target :: values(size(signals), 0:2, 2), bounds(size(signals), 4), coefficient(size(signals), 4)
      integer(i8), target :: marks(size(signals), 3)
      integer :: node, n

      step%at_start(1:, 0:) => values(:, :, 1)
      step%at_end(1:, 0:) => values(:, :, 2)
      step%bound => bounds(:, 1)
      step%rounding => bounds(:, 2)
      step%floor => bounds(:, 3)
      step%top => bounds(:, 4)
      step%coefficient => coefficient
      step%row => marks(:, 1)
      step%order => marks(:, 2)
      step%answer => marks(:, 3)
      do n = 1, size(signals)
         coefficient(n, :) = [signals(n)%offset, signals(n)%slope, signals(n)%factor, signals(n)%rate_factor]
         step%row(n) = int(signals(n)%row, i8)
      end do
      first_signal = 0
      node = 0
      if (present(first_node)) node = first_node
      step%count = node
      if (node == 0) then
         path%time(0) = 0.0_wp
         path%evaluations = 0_i8
         signals%is_begun = .false.
      else
         ! `path%z` at the node has the amplitudes before the last correction of the zero
         call advance_by(basis, path%time(node) - path%time(node - 1), path%z(:, :, node - 1), path%z(:, :, node))
      end if
      step%from = path%time(node)
      path%is_complete = .true.
      path%has_range = .false.
      path%evaluations = path%evaluations + 1_i8
      call evaluate_rows(basis, path%z(:, :, node), path%rows(:, node))
      do
         call begin_step(basis, limit, signals, path, node, step)
         if (.not. any(signals%is_certified .and. .not. step%floor > step%rounding) .or. .not. step%from < limit) exit
         ! Stiff terms of small amplitude make the steps of this search short; the search of a single signal
         ! (`certified_search`) has better bounds for such terms
         if (node == max_steps .or. path%evaluations > max_evaluations) signals%is_certified = .false.
         if (.not. any(signals%is_certified)) exit
         step%next = node + 1
         call take_step(basis, limit, signals, path, node, step)
         if (.not. any(signals%is_certified)) exit
         step%count = step%count + 1
         node = step%next
         step%from = path%time(node)
         if (any(signals%is_certified .and. step%answer == has_one_zero)) then
            call find_crossing(basis, signals, step, path, node, first_signal)
            exit
         end if
      end do
      path%steps = node
      time = merge(path%time(node), limit, first_signal > 0)
      if (first_signal > 0 .or. .not. step%from < limit) return
      path%is_complete = .false.
      signals%ceiling = huge(1.0_wp)
   end subroutine search_rows

   !> Values and bounds of the signals at the start of a step.
   subroutine begin_step(basis, limit, signals, path, node, step)
      type(row_basis_t), intent(in) :: basis
      real(wp), intent(in) :: limit
      type(row_signal_t), intent(inout) :: signals(:)
      type(row_path_t), intent(inout) :: path
      !> Node at the start of the step
      integer, intent(in) :: node
      !> The step
      type(step_t), intent(inout) :: step

      integer :: n

      call bound_rows(basis, path%z(:, :, node), path%bounds(:, node))
      call evaluate_signals(size(signals), int(basis%rows, i8), step%row, step%coefficient, path%rows(:, node), &
         step%from, step%at_start)
      do n = 1, size(signals)
         call bound_signal(basis, signals(n), path%bounds(:, node), step%from, step%count, step%bound(n), &
            step%rounding(n), limit, step%floor(n))
         ! a signal that has decayed so far that its digits underflow has no zero
         if (max(maxval(abs(step%at_start(n, :))), step%bound(n)) < tiny(1.0_wp)/epsilon(1.0_wp)) step%floor(n) = &
            huge(1.0_wp)
         if (.not. signals(n)%is_begun) call begin_signal(signals(n), step%at_start(n, :), step%rounding(n))
         step%order(n) = int(min(signals(n)%start_order, ubound(error_fraction, 1)), i8)
      end do
   end subroutine begin_step

   !> Value, slope and curvature of all signals.
   pure subroutine evaluate_signals(count, rows, row, coefficient, values, time, signals)
      !> Number of signals
      integer, intent(in) :: count
      !> Number of rows
      integer(i8), intent(in) :: rows
      !> Row of each signal
      integer(i8), intent(in) :: row(count)
      !> Coefficients of each signal
      real(wp), intent(in) :: coefficient(count, 4)
      !> All rows and their time derivatives, from `evaluate_rows`
      real(wp), contiguous, intent(in) :: values(:)
      !> Time since the start of the phase
      real(wp), intent(in) :: time
      real(wp), intent(out) :: signals(count, 0:2)

      real(wp) :: curvature, rate
      integer :: n

      !$omp simd private(curvature, rate)
      do n = 1, count
         rate = values(row(n) + rows)
         curvature = values(row(n) + 2_i8*rows)
         signals(n, 0) = coefficient(n, offset) + coefficient(n, slope)*time + coefficient(n, factor)*values(row(n)) &
            + coefficient(n, rate_factor)*rate
         signals(n, 1) = coefficient(n, slope) + coefficient(n, factor)*rate + coefficient(n, rate_factor)*curvature
         signals(n, 2) = coefficient(n, factor)*curvature + coefficient(n, rate_factor)*values(row(n) + 3_i8*rows)
      end do
   end subroutine evaluate_signals

   !> Take a step so short that each signal with `is_certified` certainly has no zero, or exactly one, within the step.
   subroutine take_step(basis, limit, signals, path, node, step)
      type(row_basis_t), intent(inout) :: basis
      real(wp), intent(in) :: limit
      type(row_signal_t), intent(inout) :: signals(:)
      type(row_path_t), intent(inout) :: path
      integer, intent(in) :: node
      type(step_t), intent(inout) :: step

      ! whether a signal has a zero within the step
      logical :: has_crossing
      integer :: n, power

      power = min(minval(trial_exponents(size(signals), step%at_start, step%bound), mask=signals%is_certified), &
         basis%highest)
      step%answer = has_no_zero
      associate (from => step%from, next => step%next, length => step%length)
         do
            length = power_of_two(power)
            if (from + length < limit) then
               call advance(basis, power, path%z(:, :, node), path%z(:, :, next))
               path%time(next) = from + length
            else
               length = limit - from
               call advance_by(basis, length, path%z(:, :, node), path%z(:, :, next))
               path%time(next) = limit
            end if
            call evaluate_rows(basis, path%z(:, :, next), path%rows(:, next))
            path%evaluations = path%evaluations + 1_i8
            call evaluate_signals(size(signals), int(basis%rows, i8), step%row, step%coefficient, path%rows(:, next), &
               path%time(next), step%at_end)
            call examine_step(size(signals), step%at_start, step%at_end, length, step%order, step%bound, &
               step%rounding, step%top, step%answer)
            do n = 1, size(signals)
               if (.not. signals(n)%is_certified) step%answer(n) = has_no_zero
            end do
            if (.not. any(step%answer == is_undecided)) exit
            ! if rounding errors decide, a shorter step decides no better
            where (step%answer == is_undecided .and. (step%bound*length**6*error_fraction(0) < 0.1_wp*step%rounding &
               .or. power <= lowest_step .or. .not. from + 4.0_wp*length > from)) signals%is_certified = .false.
            if (.not. any(signals%is_certified .and. step%answer == is_undecided)) exit
            power = power - 1
            do while (.not. power_of_two(power) < length)
               power = power - 1
            end do
         end do
      end associate
      has_crossing = any(signals%is_certified .and. step%answer == has_one_zero)
      do n = 1, size(signals)
         if (.not. signals(n)%is_certified) step%answer(n) = has_no_zero
         if (.not. signals(n)%is_certified) cycle
         signals(n)%start_order = 0
         ! a zero ends the search within the step: the values at the end of the step are beyond it
         if (.not. has_crossing) signals(n)%max_value = max(signals(n)%max_value, step%at_end(n, 0))
         signals(n)%ceiling = max(signals(n)%ceiling, step%top(n) + step%bound(n)*step%length**6*error_fraction(0) &
            + step%rounding(n))
      end do
   end subroutine take_step

   !> Begin a signal. A signal whose value at the start may be zero within rounding loses `is_certified`, so that it is
   !> searched alone.
   pure subroutine begin_signal(signal, at_start, rounding)
      type(row_signal_t), intent(inout) :: signal
      !> Value, slope and curvature
      real(wp), intent(inout) :: at_start(0:2)
      real(wp), intent(in) :: rounding

      ! a value below this fraction of the magnitude of its terms may be rounding error
      real(wp), parameter :: min_fraction = 1.0e-9_wp

      signal%is_begun = .true.
      signal%rounding = rounding
      if (signal%start_order == 0) then
         signal%is_certified = signal%is_certified .and. at_start(0) > min_fraction*rounding/epsilon(1.0_wp)
      else
         at_start(:min(signal%start_order - 1, 2)) = 0.0_wp
      end if
      signal%max_value = max(at_start(0), 0.0_wp)
      signal%ceiling = at_start(0)
   end subroutine begin_signal

   !> Exponent of 2 of the step for which the error of the polynomial is a small fraction of the value of the signal or
   !> of its change.
   pure function trial_exponents(count, at_start, bound) result(step)
      !> Number of signals
      integer, intent(in) :: count
      !> Value, slope and curvature of each signal
      real(wp), intent(in) :: at_start(count, 0:2)
      !> Bounds of the sixth derivatives
      real(wp), intent(in) :: bound(count)
      integer :: step(count)

      ! B h^6 is a fraction of the derivative k times h^k at h^(6 - k); rounding does not matter in a trial
      real(wp), parameter :: root_order(0:2) = 1.0_wp/[6.0_wp, 5.0_wp, 4.0_wp]
      integer :: k, n, of_bound

      do n = 1, count
         step(n) = lowest_step
         of_bound = exponent_of(max(error_fraction(0)/target_error_fraction*bound(n), tiny(1.0_wp)))
         do k = 0, 2
            step(n) = max(step(n), floor(real(exponent_of(at_start(n, k)) - of_bound - 1, wp)*root_order(k)))
         end do
      end do
   end function trial_exponents

   !> Find the signals that have zeros in a step.
   pure subroutine examine_step(count, at_start, at_end, length, order, bound, rounding, top, answer)
      !> Number of signals
      integer, intent(in) :: count
      !> Value, slope and curvature at the start of the step
      real(wp), intent(in) :: at_start(count, 0:2)
      !> The same at the end of the step
      real(wp), intent(in) :: at_end(count, 0:2)
      !> Length of the step
      real(wp), intent(in) :: length
      !> Order of the first derivative that does not vanish at the start
      integer(i8), intent(in) :: order(count)
      !> Bound of the sixth derivative
      real(wp), intent(in) :: bound(count)
      !> Rounding error of the signal
      real(wp), intent(in) :: rounding(count)
      !> Maximum Bernstein coefficient
      real(wp), intent(out) :: top(count)
      integer(i8), intent(out) :: answer(count)

      ! Bernstein coefficients, their minimum and the maximum change between neighbours, and B h^6
      real(wp) :: b0, b1, b2, b3, b4, b5, change, lowest, size_of_error
      integer :: n

      !$omp simd private(b0, b1, b2, b3, b4, b5, change, lowest, size_of_error)
      do n = 1, count
         b0 = at_start(n, 0)
         b1 = b0 + 0.2_wp*length*at_start(n, 1)
         b2 = b0 + 0.4_wp*length*at_start(n, 1) + 0.05_wp*length**2*at_start(n, 2)
         b5 = at_end(n, 0)
         b4 = b5 - 0.2_wp*length*at_end(n, 1)
         b3 = b5 - 0.4_wp*length*at_end(n, 1) + 0.05_wp*length**2*at_end(n, 2)
         top(n) = max(b0, b1, b2, b3, b4, b5)
         change = max(b1 - b0, b2 - b1, b3 - b2, b4 - b3, b5 - b4)
         ! the first `order` coefficients vanish with the first derivatives at the start
         lowest = min(b3, b4, b5, merge(b2, b5, order(n) <= 2_i8), merge(b1, b5, order(n) <= 1_i8), &
            merge(b0, b5, order(n) <= 0_i8))
         size_of_error = bound(n)*length**6
         ! the slope is bounded by 5/h times the differences of the coefficients
         answer(n) = merge(has_one_zero, is_undecided, order(n) == 0_i8 .and. b5 < -2.0_wp*rounding(n) .and. &
            change < -0.2_wp*size_of_error*slope_error_fraction - 4.0_wp*rounding(n))
         answer(n) = merge(has_no_zero, answer(n), &
            lowest > size_of_error*error_fraction(order(n)) + 2.0_wp*rounding(n))
      end do
   end subroutine examine_step

   !> The earliest zero in a step in which some signals fall through zero, each exactly once.
   subroutine find_crossing(basis, signals, step, path, node, first_signal)
      type(row_basis_t), intent(in) :: basis
      type(row_signal_t), intent(in) :: signals(:)
      type(step_t), intent(in) :: step
      type(row_path_t), intent(inout) :: path
      !> Node at the end of the step, which is moved to the zero; the step starts at the node before
      integer, intent(in) :: node
      integer, intent(out) :: first_signal

      ! if two roots of polynomials differ by more than this fraction of the step, the zeros of the signals are in the
      ! same order
      real(wp), parameter :: min_apart = 0.05_wp
      real(wp) :: best, root(size(signals)), zero
      integer :: n

      root = huge(1.0_wp)
      do n = 1, size(signals)
         if (step%answer(n) == has_one_zero) root(n) = root_of(bernstein_coefficients(step%at_start(n, :), &
            step%at_end(n, :), step%length))
      end do
      best = huge(1.0_wp)
      first_signal = 0
      do n = 1, size(signals)
         if (root(n) > minval(root) + min_apart) cycle
         zero = step%length*root(n)
         call refine(basis, signals(n), path, node, step%length, zero)
         if (zero > best) cycle
         best = zero
         first_signal = n
      end do
      ! another signal may have moved the node to its own, later zero
      if (count(root <= minval(root) + min_apart) > 1) call refine(basis, signals(first_signal), path, node, &
         step%length, best)
   end subroutine find_crossing

   !> Zero of a falling polynomial in Bernstein's form, as a fraction of the step.
   pure real(wp) function root_of(b) result(root)
      real(wp), intent(in) :: b(0:5)

      type(bracket_t) :: bracket
      real(wp) :: c(0:5), value, slope
      integer :: k

      c = monomial_coefficients(b)
      bracket%high = 1.0_wp
      bracket%point = b(0)/(b(0) - b(5))
      bracket%step_tolerance = 1.0e-9_wp
      do while (.not. bracket%is_found)
         value = c(5)
         slope = 0.0_wp
         do k = 4, 0, -1
            slope = value + bracket%point*slope
            value = c(k) + bracket%point*value
         end do
         call enter_value(bracket, value)
         call choose_point(bracket, bracket%point - value/slope)
      end do
      root = bracket%point
   end function root_of

   !> Refine a zero by third-order steps on the exact rows, and move a node to it.
   subroutine refine(basis, signal, path, node, length, zero)
      type(row_basis_t), intent(in) :: basis
      type(row_signal_t), intent(in) :: signal
      type(row_path_t), intent(inout) :: path
      !> Node that is moved to the zero; the step starts at the node before
      integer, intent(in) :: node
      !> Length of the step
      real(wp), intent(in) :: length
      !> Time from the start of the step to the zero
      real(wp), intent(inout) :: zero

      ! the cube of a smaller correction is below rounding
      real(wp), parameter :: correction_tolerance = 4.0e-6_wp
      real(wp) :: correction, from, values(0:2)
      integer :: start_node, i, n, round

      start_node = node - 1
      from = path%time(start_node)
      do round = 1, 10
         call advance_by(basis, zero, path%z(:, :, start_node), path%z(:, :, node))
         call evaluate_rows(basis, path%z(:, :, node), path%rows(:, node))
         path%evaluations = path%evaluations + 1_i8
         call evaluate_signal(basis, signal, path%rows(:, node), from + zero, values)
         correction = -values(0)/values(1)
         correction = correction - 0.5_wp*values(2)*correction**2/values(1)
         zero = min(max(zero + correction, 0.0_wp), length)
         if (abs(correction) <= correction_tolerance*length .and. &
            abs(correction*values(2)) <= correction_tolerance*abs(values(1))) exit
      end do
      n = basis%rows
      associate (rows => path%rows(:, node))
         do i = 1, n
            rows(i) = rows(i) + correction*(rows(i + n) + 0.5_wp*correction*rows(i + 2*n))
            rows(i + n) = rows(i + n) + correction*(rows(i + 2*n) + 0.5_wp*correction*rows(i + 3*n))
            rows(i + 2*n) = rows(i + 2*n) + correction*rows(i + 3*n)
         end do
      end associate
      path%time(node) = from + zero
   end subroutine refine

end module row_search
