!> The maximum of a signal over the steps of a path, that is, of a phase of the motion (docs/theory.md, section 23). In
!> each step the signal is a quintic Hermite polynomial plus a bounded error, as in `row_signals`.
module row_peaks
   use damped_oscillators, only: lanes
   use exponential_powers, only: exponentials
   use kinds, only: i8, wp
   use row_basis, only: advance_by, bound_rows, index_of, row_basis_t, seventh_column, sixth_column
   use row_signals, only: bernstein_coefficients, bound_signal, error_fraction, evaluate_signal, max_steps, &
      monomial_coefficients, row_path_t, row_signal_t
   implicit none (type, external)
   private
   public :: max_on_path, range_on_path, state_on_path, highest_point, peak_tolerance

   !> The search misses a peak only if it exceeds the maximum found in the same phase by less than this fraction.
   real(wp), parameter :: peak_tolerance = 1.0e-6_wp

   !> An interval within a step: its ends, value, slope and curvature of the signal at both ends, and a bound of the
   !> sixth derivative of the signal.
   type :: interval_t
      real(wp) :: from
      real(wp) :: to
      real(wp) :: at_start(0:2)
      real(wp) :: at_end(0:2)
      real(wp) :: bound
   end type interval_t

   !> The maximum found until now and its instant; `is_found`: it exceeds the value known before the search.
   type :: maximum_t
      real(wp) :: value = 0.0_wp
      real(wp) :: time = 0.0_wp
      logical :: is_found = .false.
   end type maximum_t

contains

   !> The maximum of a signal between two instants of a path, if it exceeds a known value.
   subroutine max_on_path(basis, path, signal, ends, scale, is_found, value, time)
      type(row_basis_t), intent(in) :: basis
      type(row_path_t), intent(inout) :: path
      type(row_signal_t), intent(in) :: signal
      !> The two instants
      real(wp), intent(in) :: ends(2)
      !> The search may miss a peak that is higher by less than `peak_tolerance` times the maximum or this magnitude
      real(wp), intent(in) :: scale
      logical, intent(out) :: is_found
      !> On entry the known value; on return the maximum, if it is higher
      real(wp), intent(inout) :: value
      !> Instant of the maximum
      real(wp), intent(inout) :: time

      type(maximum_t) :: best
      real(wp) :: range(2)
      ! the nodes between the two instants, and these instants; value, slope and curvature at each of them
      real(wp) :: instant(0:max_steps), at(0:2, 0:max_steps)
      ! upper bound of the signal in each step
      real(wp) :: upper(0:max_steps - 1)
      integer :: first, last, node

      is_found = .false.
      range = range_on_path(basis, path, signal)
      if (.not. range(2) > value) return
      best%value = value
      first = 0
      last = path%steps - 1
      do while (first < last .and. path%time(first + 1) <= ends(1))
         first = first + 1
      end do
      do while (last > first .and. path%time(last) >= ends(2))
         last = last - 1
      end do
      ! the ends of all steps are evaluated first, because a high value at an end makes searches within steps
      ! unnecessary
      do node = first, last + 1
         instant(node) = min(max(path%time(node), ends(1)), ends(2))
         if (abs(instant(node) - path%time(node)) > 0.0_wp) then
            call values_at(basis, path, signal, min(node, last), instant(node), at(:, node))
         else
            call evaluate_signal(basis, signal, path%rows(:, node), instant(node), at(:, node))
         end if
         call update_maximum(instant(node), at(0, node), best)
      end do
      do node = first, last
         associate (length => instant(node + 1) - instant(node))
            upper(node) = maxval(bernstein_coefficients(at(:, node), at(:, node + 1), length)) &
               + error_fraction(0)*length**6*bound_of_sixth(basis, signal, path%bounds(:, node))
         end associate
      end do
      ! the step with the highest upper bound is searched first, because other steps may then need no search
      do
         node = first - 1 + maxloc(upper(first:last), dim=1)
         if (.not. upper(node) > best%value + peak_tolerance*max(abs(best%value), scale)) exit
         call search_step(basis, path, signal, node, scale, interval_t(instant(node), instant(node + 1), at(:, node), &
            at(:, node + 1), bound_of_sixth(basis, signal, path%bounds(:, node))), best)
         upper(node) = -huge(1.0_wp)
      end do
      is_found = best%is_found
      if (is_found) value = best%value
      if (is_found) time = best%time
   end subroutine max_on_path

   !> Lower and upper bound of a signal on a whole path. The bounds of all rows are computed once for all signals of the
   !> path.
   function range_on_path(basis, path, signal) result(bounds)
      type(row_basis_t), intent(in) :: basis
      type(row_path_t), intent(inout) :: path
      type(row_signal_t), intent(in) :: signal
      real(wp) :: bounds(2)

      real(wp) :: curvature, end_curvature, error, length, inner(4)
      integer :: i, n, node

      n = basis%rows
      if (.not. path%has_range) then
         if (allocated(path%range)) then
            if (size(path%range, 1) /= 2*n) deallocate (path%range)
         end if
         if (.not. allocated(path%range)) allocate (path%range(2*n, 2))
         path%range(:, 1) = huge(1.0_wp)
         path%range(:, 2) = -huge(1.0_wp)
         do node = 0, path%steps - 1
            length = path%time(node + 1) - path%time(node)
            associate (left => path%rows(:, node), right => path%rows(:, node + 1), bound => path%bounds(:, node), &
               low => path%range(:, 1), high => path%range(:, 2))
               ! coefficients of the quintic in Bernstein's form; the next derivative of row i has the index i + n
               !$omp simd private(curvature, end_curvature, error, inner)
               do i = 1, 2*n
                  error = bound(i)*length**6*error_fraction(0)
                  curvature = 0.05_wp*length**2*left(i + 2*n)
                  end_curvature = 0.05_wp*length**2*right(i + 2*n)
                  inner(1) = left(i) + 0.2_wp*length*left(i + n)
                  inner(2) = left(i) + 0.4_wp*length*left(i + n) + curvature
                  inner(3) = right(i) - 0.4_wp*length*right(i + n) + end_curvature
                  inner(4) = right(i) - 0.2_wp*length*right(i + n)
                  low(i) = min(low(i), min(left(i), right(i), inner(1), inner(2), inner(3), inner(4)) - error)
                  high(i) = max(high(i), max(left(i), right(i), inner(1), inner(2), inner(3), inner(4)) + error)
               end do
            end associate
         end do
         path%has_range = .true.
      end if
      associate (row => signal%factor*path%range(signal%row, :), ramp => signal%slope*path%time(path%steps), &
         rate => signal%rate_factor*path%range(signal%row + n, :))
         bounds = signal%offset + [min(0.0_wp, ramp), max(0.0_wp, ramp)] + [minval(row), maxval(row)] &
            + [minval(rate), maxval(rate)]
      end associate
   end function range_on_path

   !> Bound of the sixth derivative of a signal from bounds of all rows.
   pure real(wp) function bound_of_sixth(basis, signal, bounds) result(bound)
      type(row_basis_t), intent(in) :: basis
      type(row_signal_t), intent(in) :: signal
      !> Bounds of all rows, from `bound_rows`
      real(wp), contiguous, intent(in) :: bounds(:)

      bound = abs(signal%factor)*bounds(index_of(basis, signal%row, sixth_column)) &
         + abs(signal%rate_factor)*bounds(index_of(basis, signal%row, seventh_column))
   end function bound_of_sixth

   !> Find the maximum in a step. An interval in which the signal may exceed the maximum found until now is divided at
   !> the highest point of the polynomial of the signal.
   subroutine search_step(basis, path, signal, node, scale, step, best)
      type(row_basis_t), intent(in) :: basis
      type(row_path_t), intent(inout) :: path
      type(row_signal_t), intent(in) :: signal
      !> Node at the start of the step
      integer, intent(in) :: node
      !> Minimum magnitude to which the tolerance of the peak refers
      real(wp), intent(in) :: scale
      type(interval_t), intent(in) :: step
      type(maximum_t), intent(inout) :: best

      integer, parameter :: max_depth = 64
      type(interval_t) :: stack(max_depth), interval
      real(wp) :: b(0:5), bound, bounds(size(path%bounds, 1)), length, middle(0:2), rounding, t, tolerance, &
         z(size(path%z, 1), 2)
      integer :: depth
      logical :: may_rise

      call bound_signal(basis, signal, path%bounds(:, node), path%time(node), node, bound, rounding)
      interval = step
      depth = 0
      do
         length = interval%to - interval%from
         b = bernstein_coefficients(interval%at_start, interval%at_end, length)
         tolerance = peak_tolerance*max(abs(best%value), scale) + 4.0_wp*rounding
         may_rise = may_exceed(b, interval%bound*length**6, best%value, tolerance)
         if (may_rise .and. maxval(b) <= best%value + tolerance .and. interval%from > path%time(node)) then
            ! the bound decides: without terms that have decayed since the start of the step it may be far smaller
            call advance_by(basis, interval%from - path%time(node), path%z(:, :, node), z)
            call bound_rows(basis, z, bounds)
            interval%bound = bound_of_sixth(basis, signal, bounds)
            may_rise = may_exceed(b, interval%bound*length**6, best%value, tolerance)
         end if
         if (may_rise) then
            t = interval%from + length*highest_point(b)
            ! when the stack is full, the interval is a tiny fraction of the step and is not divided further
            if (t > interval%from .and. t < interval%to .and. depth + 2 <= max_depth) then
               call refine_maximum(basis, path, signal, node, interval, t, middle)
               call update_maximum(t, middle(0), best)
               stack(depth + 1) = interval_t(interval%from, t, interval%at_start, middle, interval%bound)
               stack(depth + 2) = interval_t(t, interval%to, middle, interval%at_end, interval%bound)
               depth = depth + 2
            end if
         end if
         if (depth == 0) exit
         interval = stack(depth)
         depth = depth - 1
      end do
   end subroutine search_step

   !> Whether a signal may exceed the maximum found until now by more than a tolerance. If that maximum is at an end of
   !> the interval, the signal is compared with the maximum per distance, or per squared distance, from that end,
   !> because the error of the polynomial vanishes with the distance from an end, too.
   pure logical function may_exceed(b, size_of_error, maximum, tolerance) result(may)
      !> Bernstein coefficients of the quintic Hermite polynomial
      real(wp), intent(in) :: b(0:5)
      !> Bound of the sixth derivative times the sixth power of the length
      real(wp), intent(in) :: size_of_error
      !> Maximum so far
      real(wp), intent(in) :: maximum
      !> Tolerance of the maximum
      real(wp), intent(in) :: tolerance

      may = maxval(b) + size_of_error*error_fraction(0) > maximum + tolerance
      if (may .and. .not. b(0) < maximum) may = may_exceed_from(b)
      if (may .and. .not. b(5) < maximum) may = may_exceed_from(b(5:0:-1))

   contains

      !> `may_exceed` if the maximum found until now is the first coefficient. If this coefficient is a local maximum,
      !> the second coefficient exceeds it by rounding at most.
      pure logical function may_exceed_from(b) result(may)
         real(wp), intent(in) :: b(0:5)

         may = maxval(b(1:)) + size_of_error*error_fraction(1) > maximum
         if (may .and. b(1) <= maximum + 0.5_wp*tolerance) then
            may = maxval(b(2:)) + size_of_error*error_fraction(2) > maximum
         end if
      end function may_exceed_from
   end function may_exceed

   !> Replace the maximum by a higher value.
   pure subroutine update_maximum(instant, found, best)
      real(wp), intent(in) :: instant
      real(wp), intent(in) :: found
      type(maximum_t), intent(inout) :: best

      if (found > best%value) best = maximum_t(found, instant, .true.)
   end subroutine update_maximum

   !> A signal and its slope at an instant of a path.
   subroutine state_on_path(basis, path, signal, instant, state)
      type(row_basis_t), intent(in) :: basis
      type(row_path_t), intent(inout) :: path
      type(row_signal_t), intent(in) :: signal
      !> Time since the start of the phase
      real(wp), intent(in) :: instant
      real(wp), intent(out) :: state(2)

      ! value, slope and curvature
      real(wp) :: values(0:2)
      integer :: node

      ! the last node before the instant or at it
      node = count(path%time(1:path%steps) <= instant)
      if (instant > path%time(node)) then
         call values_at(basis, path, signal, node, instant, values)
      else
         call evaluate_signal(basis, signal, path%rows(:, node), instant, values)
      end if
      state = values(0:1)
   end subroutine state_on_path

   !> A signal, its slope, its curvature and the next derivative of its row at an instant of a step.
   subroutine values_at(basis, path, signal, node, instant, values, third)
      type(row_basis_t), intent(in) :: basis
      type(row_path_t), intent(inout) :: path
      type(row_signal_t), intent(in) :: signal
      integer, intent(in) :: node
      real(wp), intent(in) :: instant
      real(wp), intent(out) :: values(0:2)
      !> `factor` of the signal times the third derivative of the row
      real(wp), intent(out), optional :: third

      ! exp(s t) of the terms, real and imaginary parts, [terms]
      real(wp), dimension(size(path%z, 1)) :: power, power_imag
      ! value and first three derivatives of the row, and their sums over the terms
      real(wp) :: row(0:3), row_0, row_1, row_2, row_3
      ! parts of one term
      real(wp) :: imaginary_part, next, part
      integer :: m

      call exponentials(size(basis%decay)/lanes, basis%decay, basis%omega, instant - path%time(node), power, power_imag)
      path%evaluations = path%evaluations + 1_i8
      row_0 = 0.0_wp
      row_1 = 0.0_wp
      row_2 = 0.0_wp
      row_3 = 0.0_wp
      associate (z => path%z, c => basis%coefficient, s => signal%row)
         !$omp simd reduction(+:row_0, row_1, row_2, row_3) private(imaginary_part, next, part)
         do m = 1, size(power)
            next = z(m, 1, node)*power(m) - z(m, 2, node)*power_imag(m)
            imaginary_part = z(m, 1, node)*power_imag(m) + z(m, 2, node)*power(m)
            part = c(m, 1, s)*next + c(m, 2, s)*imaginary_part
            imaginary_part = c(m, 1, s)*imaginary_part - c(m, 2, s)*next
            row_0 = row_0 + part
            next = -basis%decay(m)*part - basis%omega(m)*imaginary_part
            imaginary_part = basis%omega(m)*part - basis%decay(m)*imaginary_part
            row_1 = row_1 + next
            part = -basis%decay(m)*next - basis%omega(m)*imaginary_part
            imaginary_part = basis%omega(m)*next - basis%decay(m)*imaginary_part
            row_2 = row_2 + part
            row_3 = row_3 - (basis%decay(m)*part + basis%omega(m)*imaginary_part)
         end do
      end associate
      row = [row_0, row_1, row_2, row_3]
      values = signal%factor*row(0:2) + signal%rate_factor*row(1:3)
      values(0:1) = values(0:1) + [signal%offset + signal%slope*instant, signal%slope]
      if (present(third)) third = signal%factor*row(3)
   end subroutine values_at

   !> Move to the local maximum by Halley's method, as long as the iteration stays within the interval.
   subroutine refine_maximum(basis, path, signal, node, interval, instant, values)
      type(row_basis_t), intent(in) :: basis
      type(row_path_t), intent(inout) :: path
      type(row_signal_t), intent(in) :: signal
      integer, intent(in) :: node
      type(interval_t), intent(in) :: interval
      real(wp), intent(inout) :: instant
      real(wp), intent(out) :: values(0:2)

      integer, parameter :: max_rounds = 6
      ! A shift below this fraction of the interval is not evaluated again, because the third derivative gives the
      ! maximum with an error of the order of the fourth power of the fraction. If a signal contains the rate of its
      ! row, its third derivative is not known, and the smaller fraction holds
      real(wp), parameter :: last_shift = 1.0e-3_wp, last_shift_of_rate = 1.0e-5_wp
      real(wp) :: shift, third
      integer :: round

      do round = 1, max_rounds
         call values_at(basis, path, signal, node, instant, values, third)
         if (.not. values(2) < 0.0_wp) return
         shift = -values(1)/values(2)
         shift = -values(1)/min(values(2) + 0.5_wp*third*shift, 0.5_wp*values(2))
         if (.not. (instant + shift > interval%from .and. instant + shift < interval%to)) return
         instant = instant + shift
         if (abs(shift) > (interval%to - interval%from)*merge(last_shift_of_rate, last_shift, &
            abs(signal%rate_factor) > 0.0_wp)) cycle
         values = [values(0) + shift*(values(1) + shift*(0.5_wp*values(2) + shift*third/6.0_wp)), 0.0_wp, &
            values(2) + shift*third]
         return
      end do
   end subroutine refine_maximum

   !> Approximate position of the maximum of a polynomial in Bernstein's form, as a fraction of the step, by samples
   !> inside the step and Newton's method.
   pure real(wp) function highest_point(b) result(top)
      real(wp), intent(in) :: b(0:5)

      integer, parameter :: samples = 8, max_rounds = 3
      integer :: i, k
      real(wp), parameter :: fractions(samples - 1) = [(real(i, wp)/real(samples, wp), i=1, samples - 1)]
      real(wp) :: c(0:5), curvature, slope, value(samples - 1), x

      c = monomial_coefficients(b)
      value = c(5)
      do k = 4, 0, -1
         value = c(k) + fractions*value
      end do
      top = fractions(maxloc(value, dim=1))
      ! Newton's method for a zero of the slope
      do i = 1, max_rounds
         slope = 5.0_wp*c(5)
         curvature = 0.0_wp
         do k = 4, 1, -1
            curvature = slope + top*curvature
            slope = real(k, wp)*c(k) + top*slope
         end do
         if (.not. curvature < 0.0_wp) return
         x = top - slope/curvature
         if (.not. abs(x - top) < 1.0_wp/real(samples, wp) .or. x <= 0.0_wp .or. x >= 1.0_wp) return
         top = x
      end do
   end function highest_point

end module row_peaks
