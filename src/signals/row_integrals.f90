!> Integrals of signals made of rows, and of their squares, over a part of a phase, in closed form (docs/theory.md,
!> section 20).
!>
!> All signals are sums of the same terms with different amplitudes. The integral of a square is the change of a
!> quadratic form of the terms, whose matrix depends only on the exponents of the set, so one product of this matrix
!> with the amplitudes of all signals gives the integrals of all squares.
module row_integrals
   use damped_oscillators, only: lanes
   use exponential_powers, only: exponentials_less_one
   use kinds, only: wp
   use power_integrals, only: decay_integral, integral, make_power_form, power_form_t
   use row_basis, only: advance_by, index_of, row_basis_t
   use row_signals, only: row_signal_t
   implicit none (type, external)
   private
   public :: row_form_t, row_span_t, make_row_form, find_row_span, integrate_rows

   !> Number of signals for which the matrix is read once.
   integer, parameter :: signals_at_once = 4

   !> The quadratic form of the terms of a row basis.
   type :: row_form_t
      !> The form for a signal with all coefficients 1; its matrix is moved to `matrix`, its other components are used
      type(power_form_t) :: power
      !> The symmetric matrix of the form, rows in whole SIMD vectors, [lanes, 2 terms, blocks]
      real(wp), allocatable :: matrix(:, :, :)
      !> Real and imaginary part of 1/s, [padded terms, 2]
      real(wp), allocatable :: inverse(:, :)
   end type row_form_t

   !> The terms z of a row basis over a part of a phase.
   type :: row_span_t
      !> Start of the part, since the start of the phase, and its length; negative length: the terms are not computed
      real(wp) :: from = 0.0_wp
      real(wp) :: length = -1.0_wp
      !> Terms at the start of the part, their change and their integral, real and imaginary parts, [padded terms, 2];
      !> integrals of |z|^2, [padded terms]
      real(wp), allocatable :: start(:, :), change(:, :), integral(:, :), square(:)
   end type row_span_t

contains

   !> Make the quadratic form of the terms of a basis.
   pure subroutine make_row_form(basis, form)
      type(row_basis_t), intent(in) :: basis
      type(row_form_t), intent(out) :: form

      complex(wp) :: exponent(basis%terms), rate(1, basis%terms)
      integer :: i, n

      n = basis%terms
      exponent = cmplx(-basis%decay(:n), basis%omega(:n), wp)
      rate = (1.0_wp, 0.0_wp)
      call make_power_form(exponent, rate, form%power)
      allocate (form%matrix(lanes, 2*n, (2*n - 1)/lanes + 1), form%inverse(size(basis%decay), 2), source=0.0_wp)
      do i = 1, 2*n
         form%matrix(mod(i - 1, lanes) + 1, :, (i - 1)/lanes + 1) = form%power%matrix(i, :)
      end do
      ! only one copy of the matrix is stored, because many sets share the caches of the processor
      deallocate (form%power%matrix, form%power%product)
      form%inverse(:n, 1) = real(1.0_wp/exponent, wp)
      form%inverse(:n, 2) = aimag(1.0_wp/exponent)
   end subroutine make_row_form

   !> Compute the terms over a part of a phase, unless they are those of the call before.
   pure subroutine find_row_span(basis, form, z, from, length, span)
      type(row_basis_t), intent(in) :: basis
      type(row_form_t), intent(in) :: form
      !> Amplitudes at the start of the phase, [padded terms, 2]
      real(wp), contiguous, intent(in) :: z(:, :)
      !> Start of the part, since the start of the phase, and its length
      real(wp), intent(in) :: from
      real(wp), intent(in) :: length
      !> The terms; the caller sets their length negative when a new phase begins
      type(row_span_t), intent(inout) :: span

      real(wp), dimension(size(z, 1)) :: less_one, modulus_change, power, power_imag
      integer :: m, n

      if (.not. (abs(span%length - length) > 0.0_wp .or. abs(span%from - from) > 0.0_wp)) return
      n = size(z, 1)
      if (allocated(span%square)) then
         if (size(span%square) /= n) deallocate (span%start, span%change, span%integral, span%square)
      end if
      if (.not. allocated(span%square)) allocate (span%start(n, 2), span%change(n, 2), span%integral(n, 2), &
         span%square(n))
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
   end subroutine find_row_span

   !> Integrals of signals without slope, and of their squares.
   pure subroutine integrate_rows(basis, form, span, signals, first, second)
      type(row_basis_t), intent(in) :: basis
      type(row_form_t), intent(in) :: form
      !> From `find_row_span`
      type(row_span_t), intent(in) :: span
      !> Signals whose `slope` is zero
      type(row_signal_t), intent(in) :: signals(:)
      !> Integrals of each signal and, if requested, of its square, [signals]
      real(wp), intent(out) :: first(:)
      real(wp), intent(out), optional :: second(:)

      ! coefficients of the terms, real part and minus imaginary part; changes of the parts of the signal's terms, and
      ! sums of these parts at both ends, [2 terms in whole SIMD vectors]
      real(wp) :: c(basis%terms, 2, signals_at_once)
      real(wp), dimension(size(form%matrix, 3)*lanes, signals_at_once) :: changes, sums
      real(wp) :: quadratic(signals_at_once), square, total
      complex(wp) :: s
      ! number of signals of one product, and of those before it
      integer :: count, last
      integer :: i, k, m, n

      n = basis%terms
      do last = 0, size(signals) - 1, signals_at_once
         count = min(signals_at_once, size(signals) - last)
         changes = 0.0_wp
         sums = 0.0_wp
         do i = 1, count
            associate (asked => signals(last + i))
               call gather_coefficients(basis, asked, c(:, :, i))
               total = 0.0_wp
               square = 0.0_wp
               !$omp simd reduction(+:total, square)
               do m = 1, n
                  total = total + (c(m, 1, i)*span%integral(m, 1) + c(m, 2, i)*span%integral(m, 2))
                  changes(m, i) = c(m, 1, i)*span%change(m, 1) + c(m, 2, i)*span%change(m, 2)
                  changes(m + n, i) = c(m, 1, i)*span%change(m, 2) - c(m, 2, i)*span%change(m, 1)
                  sums(m, i) = 2.0_wp*(c(m, 1, i)*span%start(m, 1) + c(m, 2, i)*span%start(m, 2)) + changes(m, i)
                  sums(m + n, i) = 2.0_wp*(c(m, 1, i)*span%start(m, 2) - c(m, 2, i)*span%start(m, 1)) &
                     + changes(m + n, i)
                  square = square + form%power%diagonal(m)*(c(m, 1, i)**2 + c(m, 2, i)**2)*span%square(m)
               end do
               first(last + i) = asked%offset*span%length + total
               if (present(second)) second(last + i) = square + asked%offset*(asked%offset*span%length + 2.0_wp*total)
            end associate
         end do
         if (.not. present(second)) cycle
         call quadratic_forms(n, size(form%matrix, 3), form%matrix, changes, sums, quadratic)
         second(last + 1:last + count) = second(last + 1:last + count) + quadratic(:count)
         do k = 1, size(form%power%pairs, 2)
            associate (a => form%power%pairs(1, k), b => form%power%pairs(2, k))
               s = cmplx(-(basis%decay(a) + basis%decay(b)), basis%omega(a) - basis%omega(b), wp)
               s = integral(s, span%length, exp(s*span%length))
               do i = 1, count
                  second(last + i) = second(last + i) + 0.5_wp*real(s*start_of(a)*conjg(start_of(b)), wp)
               end do
            end associate
         end do
      end do

   contains

      !> A term of signal i at the start.
      pure function start_of(m) result(term)
         integer, intent(in) :: m
         complex(wp) :: term

         term = cmplx(c(m, 1, i), -c(m, 2, i), wp)*cmplx(span%start(m, 1), span%start(m, 2), wp)
      end function start_of
   end subroutine integrate_rows

   !> Coefficients of the terms in a signal: real parts and minus imaginary parts.
   pure subroutine gather_coefficients(basis, signal, c)
      type(row_basis_t), intent(in) :: basis
      type(row_signal_t), intent(in) :: signal
      real(wp), intent(out) :: c(:, :)

      integer :: m, place, rate

      place = index_of(basis, signal%row, 0) - 1
      rate = index_of(basis, signal%row, 1) - 1
      do m = 1, basis%terms
         c(m, :) = signal%factor*basis%column(mod(place, lanes) + 1, :, m, place/lanes + 1) &
            + signal%rate_factor*basis%column(mod(rate, lanes) + 1, :, m, rate/lanes + 1)
      end do
   end subroutine gather_coefficients

   !> sums^T A changes for several pairs of vectors. The products with one SIMD vector of rows of the matrix stay in
   !> registers.
   pure subroutine quadratic_forms(terms, blocks, matrix, changes, sums, value)
      integer, intent(in) :: terms
      integer, intent(in) :: blocks
      !> The matrix A
      real(wp), intent(in) :: matrix(lanes, 2*terms, blocks)
      real(wp), dimension(lanes*blocks, signals_at_once), intent(in) :: changes, sums
      real(wp), intent(out) :: value(signals_at_once)

      real(wp), dimension(lanes) :: a, b, c, d
      real(wp), dimension(lanes) :: total_a, total_b, total_c, total_d
      integer :: block, i, k, n

      total_a = 0.0_wp
      total_b = 0.0_wp
      total_c = 0.0_wp
      total_d = 0.0_wp
      do block = 1, blocks
         a = 0.0_wp
         b = 0.0_wp
         c = 0.0_wp
         d = 0.0_wp
         do n = 1, 2*terms
            !$omp simd
            do i = 1, lanes
               a(i) = a(i) + matrix(i, n, block)*changes(n, 1)
               b(i) = b(i) + matrix(i, n, block)*changes(n, 2)
               c(i) = c(i) + matrix(i, n, block)*changes(n, 3)
               d(i) = d(i) + matrix(i, n, block)*changes(n, 4)
            end do
         end do
         k = lanes*(block - 1)
         !$omp simd
         do i = 1, lanes
            total_a(i) = total_a(i) + a(i)*sums(k + i, 1)
            total_b(i) = total_b(i) + b(i)*sums(k + i, 2)
            total_c(i) = total_c(i) + c(i)*sums(k + i, 3)
            total_d(i) = total_d(i) + d(i)*sums(k + i, 4)
         end do
      end do
      value = [sum(total_a), sum(total_b), sum(total_c), sum(total_d)]
   end subroutine quadratic_forms

end module row_integrals
