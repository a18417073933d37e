!> Integrals of signals made of rows, and of their squares, over a part of a phase, in closed form (docs/theory.md,
!> section 20).
!>
!> All signals are sums of the same terms with different amplitudes. The integral of a square is the change of a
!> quadratic form of the terms, whose matrix depends only on the exponents of the set, so one product of this matrix
!> with the amplitudes of all signals gives the integrals of all squares.
module row_integrals
   use damped_oscillators, only: lanes, padded
   use exponential_powers, only: exponentials_less_one
   use kinds, only: wp
   use panel_products, only: multiply_panel
   use power_integrals, only: decay_integral, integral, make_power_form, power_form_t
   use row_basis, only: advance_by, index_of, row_basis_t
   use row_signals, only: row_signal_t
   implicit none (type, external)
   private
   public :: row_interval_terms_t, shared_rows_t, make_row_form, find_row_interval_terms, integrate_rows

   !> Number of signals for which the matrix is read once.
   integer, parameter :: signals_at_once = 4

   !> The quadratic form of the terms of a row basis.
   type :: row_form_t
      !> The form for a signal with all coefficients 1; its matrix is moved to `half`, its other components are used
      type(power_form_t) :: power
      !> Number of rows of the symmetric matrix of the form, padded with zeros to whole SIMD vectors
      integer :: order = 0
      !> The part of the matrix up to its diagonal in panels of `lanes` rows, one after the other, each with the columns
      !> up to its block on the diagonal, which is halved. Only this part is stored, because many sets share the caches
      !> of the processor
      real(wp), allocatable :: half(:)
      !> Real and imaginary part of 1/s, [padded terms, 2]
      real(wp), allocatable :: inverse(:, :)
   end type row_form_t

   !> Rows that several sets of closed contacts share.
   type :: shared_rows_t
      !> Number of sets that use the rows
      integer :: users = 0
      !> Run for which the rows are made, as the sets count runs
      integer :: run = 0
      type(row_basis_t) :: basis
      !> Quadratic form of the terms of the rows; unallocated: no integral was requested
      type(row_form_t), allocatable :: form
   end type shared_rows_t

   ! The following constants are columns of the sums of a row over a part of a phase.
   !> Integral of the row.
   integer, parameter :: integral_sum = 1
   !> Value at the start of the part.
   integer, parameter :: start_sum = 2
   !> Change of the value over the part.
   integer, parameter :: change_sum = 3
   !> Integral of the square of the row.
   integer, parameter :: square_sum = 4

   !> The terms z of a row basis over a part of a phase.
   type :: row_interval_terms_t
      !> Start of the part, since the start of the phase
      real(wp) :: from = 0.0_wp
      !> Length of the part; negative: the terms are not computed
      real(wp) :: length = -1.0_wp
      !> Terms at the start of the part, real and imaginary parts, [padded terms, 2]
      real(wp), allocatable :: start(:, :)
      !> Change of the terms over the part, real and imaginary parts, [padded terms, 2]
      real(wp), allocatable :: change(:, :)
      !> Integrals of the terms over the part, real and imaginary parts, [padded terms, 2]
      real(wp), allocatable :: integral(:, :)
      !> Integrals of |z|^2, [padded terms]
      real(wp), allocatable :: square(:)
      !> Sums of rows, then of their rates, from which the integrals of several signals follow, [4, 2 rows]
      real(wp), allocatable :: sums(:, :)
      !> Number of columns that are computed in each of these sums, [2 rows]
      integer, allocatable :: known(:)
   end type row_interval_terms_t

contains

   !> Make the quadratic form of the terms of a basis.
   pure subroutine make_row_form(basis, form)
      type(row_basis_t), intent(in) :: basis
      type(row_form_t), intent(out) :: form

      complex(wp) :: exponent(basis%terms), rate(1, basis%terms)
      ! the rows of the matrix from `first` on
      real(wp), allocatable :: panel(:, :)
      integer :: first, last, n

      n = basis%terms
      exponent = cmplx(-basis%decay(:n), basis%omega(:n), wp)
      rate = (1.0_wp, 0.0_wp)
      call make_power_form(exponent, rate, form%power)
      form%order = padded(2*n)
      allocate (form%half((form%order*(form%order + lanes))/2), form%inverse(size(basis%decay), 2), source=0.0_wp)
      last = 0
      do first = 1, form%order, lanes
         allocate (panel(lanes, first + lanes - 1), source=0.0_wp)
         associate (rows => min(lanes, 2*n - first + 1), columns => min(first + lanes - 1, 2*n))
            panel(:rows, :columns) = form%power%matrix(first:first + rows - 1, :columns)
         end associate
         panel(:, first:) = 0.5_wp*panel(:, first:)
         form%half(last + 1:last + size(panel)) = reshape(panel, [size(panel)])
         last = last + size(panel)
         deallocate (panel)
      end do
      deallocate (form%power%matrix, form%power%product)
      form%inverse(:n, 1) = real(1.0_wp/exponent, wp)
      form%inverse(:n, 2) = aimag(1.0_wp/exponent)
   end subroutine make_row_form

   !> Compute the terms over a part of a phase, unless they are those of the call before.
   pure subroutine find_row_interval_terms(basis, form, z, from, length, span)
      type(row_basis_t), intent(in) :: basis
      type(row_form_t), intent(in) :: form
      !> Amplitudes at the start of the phase, [padded terms, 2]
      real(wp), contiguous, intent(in) :: z(:, :)
      !> Start of the part, since the start of the phase
      real(wp), intent(in) :: from
      !> Length of the part
      real(wp), intent(in) :: length
      !> The terms; the caller sets their length negative when a new phase begins
      type(row_interval_terms_t), intent(inout) :: span

      ! real part of exp(s length)
      real(wp) :: power(size(z, 1))
      ! imaginary part of exp(s length)
      real(wp) :: power_imag(size(z, 1))
      ! real part of exp(s length) - 1
      real(wp) :: less_one(size(z, 1))
      ! |exp(s length)| - 1
      real(wp) :: modulus_change(size(z, 1))
      integer :: m, n

      if (.not. (abs(span%length - length) > 0.0_wp .or. abs(span%from - from) > 0.0_wp)) return
      n = size(z, 1)
      if (allocated(span%square)) then
         if (size(span%square) /= n .or. size(span%known) /= size(basis%coefficient, 3)) deallocate (span%start, &
            span%change, span%integral, span%square, span%sums, span%known)
      end if
      if (.not. allocated(span%square)) then
         allocate (span%start(n, 2), span%change(n, 2), span%integral(n, 2), span%square(n))
         allocate (span%known(size(basis%coefficient, 3)), span%sums(square_sum, size(basis%coefficient, 3)))
      end if
      span%known(:) = 0
      span%sums(:, :) = 0.0_wp
      span%from = from
      span%length = length
      if (from > 0.0_wp) then
         call advance_by(basis, from, z, span%start)
      else
         span%start(:, :) = z
      end if
      call exponentials_less_one(n/lanes, basis%decay, basis%omega, length, power, power_imag, less_one, modulus_change)
      !$omp simd
      do m = 1, n
         span%change(m, 1) = span%start(m, 1)*less_one(m) - span%start(m, 2)*power_imag(m)
         span%change(m, 2) = span%start(m, 1)*power_imag(m) + span%start(m, 2)*less_one(m)
         span%integral(m, 1) = span%change(m, 1)*form%inverse(m, 1) - span%change(m, 2)*form%inverse(m, 2)
         span%integral(m, 2) = span%change(m, 1)*form%inverse(m, 2) + span%change(m, 2)*form%inverse(m, 1)
         span%square(m) = (span%start(m, 1)**2 + span%start(m, 2)**2)*decay_integral(basis%decay(m), length, &
            modulus_change(m))
      end do
   end subroutine find_row_interval_terms

   !> Integrals of signals, and of their squares. Signals made of the same rows share their sums: the square of
   !> f y + g y' is f^2 y^2 + f g d(y^2)/dt + g^2 y'^2.
   pure subroutine integrate_rows(basis, form, span, signals, first, second, has_digits)
      type(row_basis_t), intent(in) :: basis
      type(row_form_t), intent(in) :: form
      !> From `find_row_interval_terms`; receives the sums of rows
      type(row_interval_terms_t), intent(inout) :: span
      type(row_signal_t), intent(in) :: signals(:)
      !> Integral of each signal, [signals]
      real(wp), intent(out) :: first(:)
      !> Integral of the square of each signal, [signals]; absent: not requested
      real(wp), intent(out), optional :: second(:)
      !> Receives false if the response to a load that rises or falls is so much larger than the motion that the square
      !> of a signal would lose its digits
      logical, intent(inout), optional :: has_digits

      ! minimum of the mean square of a signal over the largest square of one of its terms
      real(wp), parameter :: min_square = 1.0e-7_wp
      ! a square that is a smaller fraction of the squares of its two parts would lose digits
      real(wp), parameter :: min_fraction = 1.0e-3_wp
      ! integral of f y + g y'
      real(wp) :: total
      ! integral of (f y)^2 + (g y')^2
      real(wp) :: separate
      ! integral of (f y + g y')^2
      real(wp) :: square
      real(wp) :: sums(square_sum, 1)
      ! value of offset + slope t at the start of the part
      real(wp) :: offset
      ! index of the row y in the sums
      integer :: value
      ! index of the rate y' in the sums
      integer :: rate
      integer :: i

      call find_row_sums(basis, form, span, signals, merge(square_sum, change_sum, present(second)))
      do i = 1, size(signals)
         associate (signal => signals(i), f => signals(i)%factor, g => signals(i)%rate_factor)
            value = index_of(basis, signal%row, 0)
            rate = index_of(basis, signal%row, 1)
            total = f*span%sums(integral_sum, value) + g*span%sums(integral_sum, rate)
            offset = signal%offset + signal%slope*span%from
            first(i) = (offset + 0.5_wp*signal%slope*span%length)*span%length + total
            if (.not. present(second)) cycle
            separate = f**2*span%sums(square_sum, value) + g**2*span%sums(square_sum, rate)
            square = separate + f*g*span%sums(change_sum, value)*(2.0_wp*span%sums(start_sum, value) &
               + span%sums(change_sum, value))
            if (square < min_fraction*separate) then
               call sum_rows(basis%terms, form, span, square_sum, &
                  reshape(f*basis%coefficient(:, :, value) + g*basis%coefficient(:, :, rate), &
                  [size(basis%decay), 2, 1]), [1], sums)
               square = sums(square_sum, 1)
            end if
            second(i) = square + offset*(offset*span%length + 2.0_wp*total)
            if (.not. abs(signal%slope) > 0.0_wp) cycle
            associate (c => f*basis%coefficient(:, :, value) + g*basis%coefficient(:, :, rate))
               second(i) = second(i) + signal%slope*((offset + signal%slope*span%length/3.0_wp)*span%length**2 &
                  + 2.0_wp*integral_with_time(basis%terms, form, span, c))
               if (present(has_digits)) has_digits = has_digits .and. second(i) >= min_square*span%length &
                  *max(offset**2, maxval((c(:, 1)**2 + c(:, 2)**2)*(span%start(:, 1)**2 + span%start(:, 2)**2)))
            end associate
         end associate
      end do
   end subroutine integrate_rows

   !> Integral of a row times the time since the start of the part: each term z exp(s t) contributes the integral of z t
   !> exp(s t), (length z_end - integral of z exp(s t))/s.
   pure real(wp) function integral_with_time(terms, form, span, coefficient) result(total)
      integer, intent(in) :: terms
      type(row_form_t), intent(in) :: form
      type(row_interval_terms_t), intent(in) :: span
      !> Coefficients of the terms, real part and minus imaginary part, [padded terms, 2]
      real(wp), intent(in) :: coefficient(:, :)

      real(wp) :: part(2)
      integer :: m

      total = 0.0_wp
      do m = 1, terms
         part = span%length*(span%start(m, :) + span%change(m, :)) - span%integral(m, :)
         total = total + coefficient(m, 1)*(part(1)*form%inverse(m, 1) - part(2)*form%inverse(m, 2)) &
            + coefficient(m, 2)*(part(1)*form%inverse(m, 2) + part(2)*form%inverse(m, 1))
      end do
   end function integral_with_time

   !> Compute the sums of all rows, and of the rates of rows, of which some signals are made.
   pure subroutine find_row_sums(basis, form, span, signals, columns)
      type(row_basis_t), intent(in) :: basis
      type(row_form_t), intent(in) :: form
      type(row_interval_terms_t), intent(inout) :: span
      type(row_signal_t), intent(in) :: signals(:)
      !> Number of columns of the sums
      integer, intent(in) :: columns

      real(wp) :: sums(square_sum, signals_at_once)
      ! indices of the rows and rates whose sums are not known yet
      integer :: places(2*size(signals))
      integer :: count, i, last, order, place

      count = 0
      do i = 1, size(signals)
         do order = 0, 1
            if (.not. abs(merge(signals(i)%factor, signals(i)%rate_factor, order == 0)) > 0.0_wp) cycle
            place = index_of(basis, signals(i)%row, order)
            if (span%known(place) >= columns) cycle
            span%known(place) = columns
            count = count + 1
            places(count) = place
         end do
      end do
      do last = 0, count - 1, signals_at_once
         associate (batch => places(last + 1:min(last + signals_at_once, count)))
            call sum_rows(basis%terms, form, span, columns, basis%coefficient, batch, sums)
            do i = 1, size(batch)
               span%sums(:columns, batch(i)) = sums(:columns, i)
            end do
         end associate
      end do
   end subroutine find_row_sums

   !> Sums of up to `signals_at_once` rows over the part of the phase. The integral of a square is a quadratic form of
   !> the terms; pairs of nearly conjugate exponents (`pairs` of the form) are added one by one.
   pure subroutine sum_rows(terms, form, span, columns, coefficient, places, sums)
      integer, intent(in) :: terms
      type(row_form_t), intent(in) :: form
      type(row_interval_terms_t), intent(in) :: span
      !> Number of columns of the sums
      integer, intent(in) :: columns
      !> Coefficients of the terms, real part and minus imaginary part, [padded terms, 2, rows]
      real(wp), contiguous, intent(in) :: coefficient(:, :, :)
      !> Indices of the rows in `coefficient`
      integer, intent(in) :: places(:)
      !> Sums in the columns `integral_sum` to `square_sum`, [4, rows]
      real(wp), contiguous, intent(inout) :: sums(:, :)

      ! changes of the real and imaginary parts of the terms of each row, [terms, rows]
      real(wp) :: changes(form%order, signals_at_once)
      ! sums of their values at both ends, [terms, rows]
      real(wp) :: ends(form%order, signals_at_once)
      ! values of the quadratic form of changes and ends, of each row
      real(wp) :: quadratic(signals_at_once)
      ! real part of a term of a row at the start
      real(wp) :: part
      ! change of a real or imaginary part of the term
      real(wp) :: part_change
      ! integral of a row (`total`), value at the start, change, integral of the square of the row
      real(wp) :: total, start, change, square
      complex(wp) :: s
      integer :: i, k, m

      do i = 1, size(places)
         changes(2*terms + 1:, i) = 0.0_wp
         ends(2*terms + 1:, i) = 0.0_wp
         total = 0.0_wp
         start = 0.0_wp
         change = 0.0_wp
         square = 0.0_wp
         associate (c => coefficient(:, :, places(i)))
            !$omp simd reduction(+:total, start, change, square) private(part, part_change)
            do m = 1, terms
               total = total + (c(m, 1)*span%integral(m, 1) + c(m, 2)*span%integral(m, 2))
               part = c(m, 1)*span%start(m, 1) + c(m, 2)*span%start(m, 2)
               part_change = c(m, 1)*span%change(m, 1) + c(m, 2)*span%change(m, 2)
               start = start + part
               change = change + part_change
               changes(m, i) = part_change
               ends(m, i) = 2.0_wp*part + part_change
               part_change = c(m, 1)*span%change(m, 2) - c(m, 2)*span%change(m, 1)
               changes(m + terms, i) = part_change
               ends(m + terms, i) = 2.0_wp*(c(m, 1)*span%start(m, 2) - c(m, 2)*span%start(m, 1)) + part_change
               square = square + form%power%diagonal(m)*(c(m, 1)**2 + c(m, 2)**2)*span%square(m)
            end do
         end associate
         sums([integral_sum, start_sum, change_sum, square_sum], i) = [total, start, change, square]
      end do
      if (columns < square_sum) return
      ! an odd number of pairs counts as the next even one
      changes(:, size(places) + 1:size(places) + mod(size(places), 2)) = 0.0_wp
      ends(:, size(places) + 1:size(places) + mod(size(places), 2)) = 0.0_wp
      call quadratic_forms(form%order, size(places), form%half, changes, ends, quadratic)
      sums(square_sum, :size(places)) = sums(square_sum, :size(places)) + quadratic(:size(places))
      do k = 1, size(form%power%pairs, 2)
         associate (a => form%power%pairs(1, k), b => form%power%pairs(2, k))
            s = cmplx(-(form%power%decay(a) + form%power%decay(b)), form%power%omega(a) - form%power%omega(b), wp)
            s = integral(s, span%length, exp(s*span%length))
            do i = 1, size(places)
               sums(square_sum, i) = sums(square_sum, i) + 0.5_wp*real(s*start_of(a)*conjg(start_of(b)), wp)
            end do
         end associate
      end do

   contains

      !> A term of row i at the start.
      pure function start_of(m) result(term)
         integer, intent(in) :: m
         complex(wp) :: term

         term = cmplx(coefficient(m, 1, places(i)), -coefficient(m, 2, places(i)), wp) &
            *cmplx(span%start(m, 1), span%start(m, 2), wp)
      end function start_of
   end subroutine sum_rows

   !> y^T A x for several pairs of vectors x and y, two pairs at a time. With L the stored half of the symmetric matrix
   !> A, which is L + L^T, the form is y.(L x) + x.(L y).
   pure subroutine quadratic_forms(order, pairs, half, x, y, value)
      !> A multiple of `lanes`
      integer, intent(in) :: order
      !> Number of pairs; an odd number counts as the next even one
      integer, intent(in) :: pairs
      !> `row_form_t%half`
      real(wp), contiguous, intent(in) :: half(:)
      real(wp), intent(in) :: x(order, signals_at_once)
      real(wp), intent(in) :: y(order, signals_at_once)
      !> y^T A x of each pair
      real(wp), intent(out) :: value(signals_at_once)

      ! products of the rows of L in a panel and x and y of the first pair, then of the second, [lanes, 4]
      real(wp) :: product(lanes, 4)
      ! sum of the value of the first pair in the lanes of a SIMD vector
      real(wp) :: sum_1(lanes)
      ! sum of the value of the second pair, likewise
      real(wp) :: sum_2(lanes)
      integer :: first, i, k, last

      value = 0.0_wp
      do i = 1, pairs, 2
         sum_1 = 0.0_wp
         sum_2 = 0.0_wp
         last = 0
         do first = 0, order - 1, lanes
            associate (columns => first + lanes)
               call multiply_panel(columns, half(last + 1:last + lanes*columns), x(:columns, i), y(:columns, i), &
                  x(:columns, i + 1), y(:columns, i + 1), product)
               last = last + lanes*columns
            end associate
            !$omp simd
            do k = 1, lanes
               sum_1(k) = sum_1(k) + (y(first + k, i)*product(k, 1) + x(first + k, i)*product(k, 2))
               sum_2(k) = sum_2(k) + (y(first + k, i + 1)*product(k, 3) + x(first + k, i + 1)*product(k, 4))
            end do
         end do
         value(i) = sum(sum_1)
         value(i + 1) = sum(sum_2)
      end do
   end subroutine quadratic_forms

end module row_integrals
