!> Signals made of rows (linear functionals of the state), their values at the ends of the steps of a phase, and
!> their bounds within a step. The search for the first zero of many signals (module `row_search`) and the search for
!> maxima (module `row_peaks`) use them (docs/theory.md, section 23).
!>
!> In a step of length h a signal is approximated by the quintic Hermite polynomial with the same value, slope and
!> curvature (first and second derivative with respect to time) at both ends of the step. The error is at most B
!> h**6/46080, with a bound B of the magnitude of the sixth derivative of the signal. The polynomial lies between the
!> minimum and the maximum of its Bernstein coefficients.
module row_signals
   use kinds, only: i8, wp
   use row_basis, only: index_of, rate_magnitude_column, row_basis_t, seventh_column, sixth_column, magnitude_column
   implicit none (type, external)
   private
   public :: row_signal_t, row_path_t, max_steps, error_fraction, evaluate_signal, bound_signal, exponent_of
   public :: power_of_two, bernstein_coefficients, monomial_coefficients

   !> Maximum number of steps of a path.
   integer, parameter :: max_steps = 64

   !> Bounds of the error of the quintic Hermite polynomial, divided by B h**6. At the time x h since the start of a
   !> step, 0 <= x <= 1, the error is at most x**3 (1 - x)**3/720 B h**6, and therefore at most
   !> `error_fraction(k)` x**k B h**6. The bounds with k > 0 serve for signals that vanish at the start together with
   !> their first k - 1 derivatives. The numerators are the maxima of x**(3 - k) (1 - x)**3 (docs/theory.md,
   !> section 23).
   real(wp), parameter :: error_fraction(0:3) = [1.0_wp/46080.0_wp, 0.03456_wp/720.0_wp, 0.10547_wp/720.0_wp, &
      1.0_wp/720.0_wp]

   !> Format of a number of kind `wp` (binary64 of IEEE 754).
   integer, parameter :: mantissa_bits = 52, exponent_bits = 11, exponent_bias = 1023

   !> A signal `offset` + `slope` t + `factor` y + `rate_factor` y', with y the row of number `row`.
   type :: row_signal_t
      integer :: row = 1
      real(wp) :: factor = 1.0_wp
      real(wp) :: rate_factor = 0.0_wp
      real(wp) :: offset = 0.0_wp
      real(wp) :: slope = 0.0_wp
      !> Order of the first derivative that does not vanish at the start, where it is positive; 0: the signal is
      !> positive
      integer :: start_order = 0
      !> Whether the search for zeros (`search_rows` of module `row_search`) has begun with this signal
      logical :: is_begun = .false.
      !> Whether the search for zeros, common to all signals, is certain about the zeros of this signal so far
      logical :: is_certified = .true.
      !> Maximum of the signal at the nodes
      real(wp) :: max_value = 0.0_wp
      !> Upper bound of the signal over the path
      real(wp) :: ceiling = 0.0_wp
      !> Rounding error of the value at the start
      real(wp) :: rounding = 0.0_wp
   end type row_signal_t

   !> The steps of a phase (the motion between two events); a node is an instant at which a step ends or starts.
   type :: row_path_t
      !> Number of steps, which is the index of the last node (the first is 0)
      integer :: steps = 0
      !> Whether the amplitudes at the start of the phase are set
      logical :: is_begun = .false.
      !> Whether the steps reach from the start to the end of the phase
      logical :: is_complete = .false.
      !> Time since the start of the phase, [nodes]
      real(wp) :: time(0:max_steps)
      !> Real and imaginary parts of the amplitudes z_m of module `row_basis`, [padded terms, 2, nodes]
      real(wp), allocatable :: z(:, :, :)
      !> Values and first three time derivatives of all rows, [`index_of` row and order, nodes]
      real(wp), allocatable :: rows(:, :)
      !> Bounds of all rows from the node on, [`index_of` row and column of the bound, nodes]
      real(wp), allocatable :: bounds(:, :)
      !> Lower and upper bounds of rows and of their rates on the whole path, [2 rows, 2]
      real(wp), allocatable :: range(:, :)
      !> Whether `range` has been computed
      logical :: has_range = .false.
      !> Number of evaluations of all rows
      integer(i8) :: evaluations = 0_i8
   end type row_path_t

contains

   !> Value, slope and curvature (first and second time derivative) of a signal.
   pure subroutine evaluate_signal(basis, signal, rows, time, values)
      type(row_basis_t), intent(in) :: basis
      type(row_signal_t), intent(in) :: signal
      !> All rows and their time derivatives, from `evaluate_rows`
      real(wp), contiguous, intent(in) :: rows(:)
      !> Time since the start of the phase
      real(wp), intent(in) :: time
      real(wp), intent(out) :: values(0:2)

      associate (n => basis%rows, i => signal%row)
         values(0) = signal%offset + signal%slope*time + signal%factor*rows(i) + signal%rate_factor*rows(i + n)
         values(1) = signal%slope + signal%factor*rows(i + n) + signal%rate_factor*rows(i + 2*n)
         values(2) = signal%factor*rows(i + 2*n) + signal%rate_factor*rows(i + 3*n)
      end associate
   end subroutine evaluate_signal

   !> Bounds of a signal that hold from an instant on.
   pure subroutine bound_signal(basis, signal, bounds, time, steps, bound, rounding, limit, floor)
      type(row_basis_t), intent(in) :: basis
      type(row_signal_t), intent(in) :: signal
      !> Bounds of all rows, from `bound_rows`
      real(wp), contiguous, intent(in) :: bounds(:)
      !> Time since the start of the phase
      real(wp), intent(in) :: time
      !> Number of steps that led to this time
      integer, intent(in) :: steps
      !> Bound of the magnitude of the sixth derivative
      real(wp), intent(out) :: bound
      !> Rounding error of the value
      real(wp), intent(out) :: rounding
      !> End of the search
      real(wp), intent(in), optional :: limit
      !> Lower bound of the signal up to that end
      real(wp), intent(out), optional :: floor

      real(wp) :: curvature, magnitude, rate

      associate (factor => abs(signal%factor), rate_factor => abs(signal%rate_factor), row => signal%row)
         associate (sixth => bounds(index_of(basis, row, sixth_column)), &
            rate_bound => bounds(index_of(basis, row, rate_magnitude_column)))
            bound = factor*sixth
            magnitude = factor*bounds(index_of(basis, row, magnitude_column))
            rate = factor*rate_bound
            if (rate_factor > 0.0_wp) then
               bound = bound + rate_factor*bounds(index_of(basis, row, seventh_column))
               magnitude = magnitude + rate_factor*rate_bound
               ! With the coefficients c and exponents s of the terms of the row, Hoelder's inequality bounds the sum of
               ! |c| |s|^2 by the sums of |c| |s| and |c| |s|^6
               curvature = 0.0_wp
               if (rate_bound > 0.0_wp) curvature = rate_bound*bound_of_fifth_root(sixth/rate_bound)
               rate = rate + rate_factor*curvature
            end if
         end associate
      end associate
      rounding = epsilon(1.0_wp)*((4.0_wp + 2.0_wp*real(steps, wp))*magnitude + time*rate &
         + 4.0_wp*(abs(signal%offset) + abs(signal%slope)*time))
      if (present(floor)) floor = signal%offset + min(signal%slope*time, signal%slope*limit) - magnitude
   end subroutine bound_signal

   !> Upper bound of x**(1/5), at most 15 per cent above it.
   pure real(wp) function bound_of_fifth_root(x) result(bound)
      !> At least zero
      real(wp), intent(in) :: x

      real(wp), parameter :: root(0:4) = 2.0_wp**[0.0_wp, 0.2_wp, 0.4_wp, 0.6_wp, 0.8_wp]

      ! x is at most two to this power
      associate (power => exponent_of(x))
         bound = root(modulo(power, 5))*power_of_two((power - modulo(power, 5))/5)
      end associate
   end function bound_of_fifth_root

   !> Exponent e of a number with 2**(e - 1) <= |x| < 2**e, read from its bits because the intrinsic function calls the
   !> library. For zero and subnormal numbers -1022.
   elemental integer function exponent_of(x) result(power)
      real(wp), intent(in) :: x

      power = int(ibits(transfer(x, 0_i8), mantissa_bits, exponent_bits)) - (exponent_bias - 1)
   end function exponent_of

   !> 2**k, made from its bits.
   elemental real(wp) function power_of_two(k) result(power)
      !> -1022 to 1023
      integer, intent(in) :: k

      power = transfer(shiftl(int(k + exponent_bias, i8), mantissa_bits), 0.0_wp)
   end function power_of_two

   !> Bernstein coefficients of the quintic Hermite polynomial of a step, from value, slope and curvature at both ends.
   pure function bernstein_coefficients(at_start, at_end, length) result(b)
      !> Value, slope and curvature at the start
      real(wp), intent(in) :: at_start(0:2)
      !> The same at the end
      real(wp), intent(in) :: at_end(0:2)
      !> Length of the interval
      real(wp), intent(in) :: length
      real(wp) :: b(0:5)

      b(0) = at_start(0)
      b(1) = at_start(0) + 0.2_wp*length*at_start(1)
      b(2) = at_start(0) + 0.4_wp*length*at_start(1) + 0.05_wp*length**2*at_start(2)
      b(3) = at_end(0) - 0.4_wp*length*at_end(1) + 0.05_wp*length**2*at_end(2)
      b(4) = at_end(0) - 0.2_wp*length*at_end(1)
      b(5) = at_end(0)
   end function bernstein_coefficients

   !> Coefficients of the powers x**0 to x**5 of the polynomial with the given Bernstein coefficients; x is 0 at the
   !> start of the step and 1 at its end.
   pure function monomial_coefficients(b) result(c)
      real(wp), intent(in) :: b(0:5)
      real(wp) :: c(0:5)

      c = [b(0), 5.0_wp*(b(1) - b(0)), 10.0_wp*(b(2) - 2.0_wp*b(1) + b(0)), &
         10.0_wp*(b(3) - 3.0_wp*b(2) + 3.0_wp*b(1) - b(0)), &
         5.0_wp*(b(4) - 4.0_wp*b(3) + 6.0_wp*b(2) - 4.0_wp*b(1) + b(0)), &
         b(5) - 5.0_wp*b(4) + 10.0_wp*b(3) - 10.0_wp*b(2) + 5.0_wp*b(1) - b(0)]
   end function monomial_coefficients

end module row_signals
