!> Rows of a phase (the motion between two events) as sums of the same exponentials, advanced by steps whose powers are
!> stored (docs/theory.md, section 23).
!>
!> A row is one linear functional of the state, such as a gap, a contact force or a displacement: Re sum c_m z_m(t) with
!> z_m(t) = z_m(0) exp(s_m t), Re s_m <= 0. One product of the coefficients c and the amplitudes z gives all rows and
!> their first three derivatives. A step multiplies the amplitudes by stored powers exp(s_m 2**k), so a search evaluates
!> no exponential and no sine.
module row_basis
   use damped_oscillators, only: lanes, padded
   use exponential_powers, only: exponentials
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: row_basis_t, has_terms, make_row_basis, set_row, advance, advance_by, evaluate_rows, bound_rows, index_of
   public :: lowest_step, sixth_column, seventh_column, magnitude_column, rate_magnitude_column

   !> The shortest stored step is 2**lowest_step.
   integer, parameter :: lowest_step = -40

   !> Number of columns of a row: its value and first three derivatives.
   integer, parameter :: row_columns = 4

   !> Number of columns of the bounds of a row, which hold from an instant on.
   integer, parameter :: bound_columns = 4
   !> Column with the bound on the magnitude of the sixth derivative of a row.
   integer, parameter :: sixth_column = 0
   !> Column with the bound on the magnitude of the seventh derivative of a row.
   integer, parameter :: seventh_column = 1
   !> Column with the bound on the magnitude of a row.
   integer, parameter :: magnitude_column = 2
   !> Column with the bound on the magnitude of the rate of a row.
   integer, parameter :: rate_magnitude_column = 3

   !> Coefficients of all rows, bounds, and stored powers.
   type :: row_basis_t
      !> Number of rows
      integer :: rows = 0
      !> Number of terms
      integer :: terms = 0
      !> Number of SIMD vectors for all rows and derivatives
      integer :: blocks = 0
      !> Exponent of 2 of the longest stored step
      integer :: highest = 0
      !> -Re s, padded with zeros to whole SIMD vectors, [padded terms]
      real(wp), allocatable :: decay(:)
      !> Im s, padded with zeros to whole SIMD vectors
      real(wp), allocatable :: omega(:)
      !> |s|, padded with zeros to whole SIMD vectors
      real(wp), allocatable :: modulus(:)
      !> Real and minus imaginary part of c s**k, k = 0 ... 3, for each row; row and k together make an index
      !> (`index_of`), which is divided into SIMD vectors, [lanes, 2, padded terms, blocks]
      real(wp), allocatable :: column(:, :, :, :)
      !> Real and minus imaginary part of c for each row, then those of c s, [padded terms, 2, 2 rows]
      real(wp), allocatable :: coefficient(:, :, :)
      !> |c| |s|**6, |c| |s|**7, |c| and |c s| of each row, [lanes, padded terms, blocks]
      real(wp), allocatable :: weight(:, :, :)
      !> Real and imaginary part of exp(s 2**k), computed at first use, [padded terms, 2, lowest_step:highest]
      real(wp), allocatable :: power(:, :, :)
      !> Whether each power has been computed
      logical, allocatable :: has_power(:)
   end type row_basis_t

contains

   !> Allocate rows over the given exponents; `set_row` sets their coefficients.
   pure subroutine make_row_basis(exponents, rows, basis)
      !> Exponents s, Re s <= 0, [terms]
      complex(wp), intent(in) :: exponents(:)
      !> Number of rows
      integer, intent(in) :: rows
      type(row_basis_t), intent(out) :: basis

      real(wp) :: slowest
      integer :: n

      n = size(exponents)
      basis%rows = rows
      basis%terms = n
      basis%blocks = padded(row_columns*rows)/lanes
      allocate (basis%decay(padded(n)), basis%omega(padded(n)), basis%modulus(padded(n)), source=0.0_wp)
      basis%decay(:n) = -real(exponents, wp)
      basis%omega(:n) = aimag(exponents)
      basis%modulus(:n) = abs(exponents)
      allocate (basis%column(lanes, 2, padded(n), basis%blocks), basis%weight(lanes, padded(n), basis%blocks), &
         source=0.0_wp)
      allocate (basis%coefficient(padded(n), 2, 2*rows), source=0.0_wp)
      ! The longest step is at most four radians of the slowest term, whose frequency counts as 2**-20 to 2**20
      slowest = minval(basis%modulus(:n), mask=basis%modulus(:n) > 0.0_wp)
      basis%highest = 2 - min(max(exponent(slowest), -20), 20)
      allocate (basis%power(padded(n), 2, lowest_step:basis%highest))
      allocate (basis%has_power(lowest_step:basis%highest), source=.false.)
   end subroutine make_row_basis

   !> Whether a basis has these exponents and this number of rows.
   pure logical function has_terms(basis, exponents, rows) result(answer)
      type(row_basis_t), intent(in) :: basis
      !> Exponents s, [terms]
      complex(wp), intent(in) :: exponents(:)
      integer, intent(in) :: rows

      answer = basis%rows == rows .and. basis%terms == size(exponents)
      if (answer) answer = all(abs(basis%decay(:basis%terms) + real(exponents, wp)) <= 0.0_wp .and. &
         abs(basis%omega(:basis%terms) - aimag(exponents)) <= 0.0_wp)
   end function has_terms

   !> Index of a derivative of a row, or of one of its bounds, in the arrays of all rows.
   elemental integer function index_of(basis, row, column) result(place)
      type(row_basis_t), intent(in) :: basis
      !> Number of the row, from 1
      integer, intent(in) :: row
      !> Order of the derivative or column of the bound, from 0
      integer, intent(in) :: column

      place = row + basis%rows*column
   end function index_of

   !> Set the coefficients of a row.
   pure subroutine set_row(basis, row, first, coefficient)
      type(row_basis_t), intent(inout) :: basis
      integer, intent(in) :: row
      !> First term with a coefficient
      integer, intent(in) :: first
      !> c_m of this and the following terms
      complex(wp), intent(in) :: coefficient(:)

      complex(wp) :: s, scaled
      real(wp) :: weight(0:bound_columns - 1)
      integer :: k, m, place

      do m = first, first + size(coefficient) - 1
         s = cmplx(-basis%decay(m), basis%omega(m), wp)
         scaled = coefficient(m - first + 1)
         weight(magnitude_column) = abs(scaled)
         weight(rate_magnitude_column) = weight(magnitude_column)*basis%modulus(m)
         weight(sixth_column) = weight(magnitude_column)*basis%modulus(m)**6
         weight(seventh_column) = weight(sixth_column)*basis%modulus(m)
         do k = 0, row_columns - 1
            place = index_of(basis, row, k) - 1
            basis%column(mod(place, lanes) + 1, 1, m, place/lanes + 1) = real(scaled, wp)
            basis%column(mod(place, lanes) + 1, 2, m, place/lanes + 1) = -aimag(scaled)
            basis%weight(mod(place, lanes) + 1, m, place/lanes + 1) = weight(k)
            if (k < 2) basis%coefficient(m, :, place + 1) = [real(scaled, wp), -aimag(scaled)]
            scaled = s*scaled
         end do
      end do
   end subroutine set_row

   !> Amplitudes z one stored step later: z exp(s 2**step).
   pure subroutine advance(basis, step, z, later)
      type(row_basis_t), intent(inout) :: basis
      !> Exponent of 2 of the step
      integer, intent(in) :: step
      !> Real and imaginary parts of the amplitudes, [padded terms, 2]
      real(wp), contiguous, intent(in) :: z(:, :)
      !> The same after the step, [padded terms, 2]
      real(wp), contiguous, intent(out) :: later(:, :)

      if (.not. basis%has_power(step)) then
         call exponentials(size(basis%decay)/lanes, basis%decay, basis%omega, 2.0_wp**step, basis%power(:, 1, step), &
            basis%power(:, 2, step))
         basis%has_power(step) = .true.
      end if
      call multiply(basis%power(:, :, step), z, later)
   end subroutine advance

   !> Amplitudes z after any time: z exp(s time).
   pure subroutine advance_by(basis, time, z, later)
      type(row_basis_t), intent(in) :: basis
      real(wp), intent(in) :: time
      !> Real and imaginary parts of the amplitudes, [padded terms, 2]
      real(wp), contiguous, intent(in) :: z(:, :)
      !> The same after the step, [padded terms, 2]
      real(wp), contiguous, intent(out) :: later(:, :)

      real(wp) :: power(size(z, 1), 2)

      call exponentials(size(basis%decay)/lanes, basis%decay, basis%omega, time, power(:, 1), power(:, 2))
      call multiply(power, z, later)
   end subroutine advance_by

   !> Products of complex numbers, each as real and imaginary part, [numbers, 2].
   pure subroutine multiply(a, b, product)
      real(wp), contiguous, intent(in) :: a(:, :)
      real(wp), contiguous, intent(in) :: b(:, :)
      real(wp), contiguous, intent(out) :: product(:, :)

      integer :: i

      !$omp simd
      do i = 1, size(b, 1)
         product(i, 1) = b(i, 1)*a(i, 1) - b(i, 2)*a(i, 2)
         product(i, 2) = b(i, 1)*a(i, 2) + b(i, 2)*a(i, 1)
      end do
   end subroutine multiply

   !> All rows and their first three derivatives.
   pure subroutine evaluate_rows(basis, z, rows)
      type(row_basis_t), intent(in) :: basis
      !> Real and imaginary parts of the amplitudes, [padded terms, 2]
      real(wp), contiguous, intent(in) :: z(:, :)
      !> Values, indexed by `index_of`, [lanes*blocks]
      real(wp), contiguous, intent(out) :: rows(:)

      ! separate sums over odd and even terms, and over real and imaginary parts, so that no addition waits for another
      real(wp), dimension(lanes) :: even, even_imag, odd, odd_imag
      integer :: block, i, m

      do block = 1, basis%blocks
         even = 0.0_wp
         even_imag = 0.0_wp
         odd = 0.0_wp
         odd_imag = 0.0_wp
         do m = 1, basis%terms, 2
            !$omp simd
            do i = 1, lanes
               odd(i) = odd(i) + basis%column(i, 1, m, block)*z(m, 1)
               odd_imag(i) = odd_imag(i) + basis%column(i, 2, m, block)*z(m, 2)
               even(i) = even(i) + basis%column(i, 1, m + 1, block)*z(m + 1, 1)
               even_imag(i) = even_imag(i) + basis%column(i, 2, m + 1, block)*z(m + 1, 2)
            end do
         end do
         rows(lanes*(block - 1) + 1:lanes*block) = (odd + odd_imag) + (even + even_imag)
      end do
   end subroutine evaluate_rows

   !> Bounds of all rows that hold from this instant on.
   pure subroutine bound_rows(basis, z, bounds)
      type(row_basis_t), intent(in) :: basis
      !> Real and imaginary parts of the amplitudes, [padded terms, 2]
      real(wp), contiguous, intent(in) :: z(:, :)
      !> Bounds, indexed by `index_of`, [lanes*blocks]
      real(wp), contiguous, intent(out) :: bounds(:)

      real(wp), dimension(lanes) :: even, odd
      real(wp) :: magnitude(size(z, 1))
      integer :: block, i, m

      !$omp simd
      do i = 1, size(z, 1)
         magnitude(i) = sqrt(z(i, 1)**2 + z(i, 2)**2)
      end do
      do block = 1, basis%blocks
         even = 0.0_wp
         odd = 0.0_wp
         do m = 1, basis%terms, 2
            !$omp simd
            do i = 1, lanes
               odd(i) = odd(i) + basis%weight(i, m, block)*magnitude(m)
               even(i) = even(i) + basis%weight(i, m + 1, block)*magnitude(m + 1)
            end do
         end do
         bounds(lanes*(block - 1) + 1:lanes*block) = odd + even
      end do
   end subroutine bound_rows

end module row_basis
