!> Signals made of rows (linear functionals of the state), their values at the ends of the steps of a phase, and
!> their bounds within a step (docs/theory.md, section 23).
!>
!> Over a step of length h a signal differs from the quintic Hermite polynomial that shares its value, slope and
!> curvature at both ends by at most B h**6/46080, where B bounds its sixth derivative; the coefficients of the
!> polynomial in Bernstein's form bound the polynomial.
module row_signals
   use kinds, only: i8, wp
   use row_basis, only: index_of, rate_magnitude_column, row_basis_t, seventh_column, sixth_column, magnitude_column
   implicit none (type, external)
   private
   public :: row_signal_t, row_path_t, max_nodes, error_share, values_of, bounds_of, coefficients, powers_of, &
      node_at_time, value_at_node

   !> Maximum number of steps of a path.
   integer, parameter :: max_nodes = 64

   !> Errors of a quintic Hermite polynomial as shares of B h**6. If the signal and its first k - 1 derivatives vanish
   !> at the start, the error at a share x of the step is at most `error_share(k)` x**k B h**6, because it is at most
   !> x**3 (1 - x)**3/720 B h**6.
   real(wp), parameter :: error_share(0:3) = [1.0_wp/46080.0_wp, 0.03456_wp/720.0_wp, 0.10547_wp/720.0_wp, &
      1.0_wp/720.0_wp]

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
      !> The search has begun with this signal
      logical :: is_begun = .false.
      !> The common search of all signals is certain about the zeros of this signal so far
      logical :: is_certified = .true.
      !> Maximum over the nodes, and upper bound of the signal over the path
      real(wp) :: max_value = 0.0_wp
      real(wp) :: ceiling = 0.0_wp
      !> Rounding error of the value at the start
      real(wp) :: rounding = 0.0_wp
   end type row_signal_t

   !> The steps of a phase (the motion between two events); a node is an instant at which a step ends or starts.
   type :: row_path_t
      !> Index of the last node (the first is 0), and whether the steps reach from the start to the end of the phase
      integer :: count = 0
      logical :: is_complete = .false.
      !> Time since the start of the phase, [nodes]
      real(wp) :: time(0:max_nodes)
      !> Amplitudes, rows and bounds of rows at the nodes, as in `row_basis`, [.., nodes]
      real(wp), allocatable :: z(:, :, :), rows(:, :), bounds(:, :)
      !> Lower and upper bounds of rows and of their rates on the whole path, [2 rows, 2], and whether they are computed
      real(wp), allocatable :: range(:, :)
      logical :: has_range = .false.
      !> Number of evaluations of all rows
      integer(i8) :: evaluations = 0_i8
   end type row_path_t

contains

   !> Value, slope and curvature of a signal.
   pure subroutine values_of(basis, signal, rows, time, values)
      type(row_basis_t), intent(in) :: basis
      type(row_signal_t), intent(in) :: signal
      !> All rows and their derivatives, from `evaluate_rows`
      real(wp), contiguous, intent(in) :: rows(:)
      real(wp), intent(in) :: time
      real(wp), intent(out) :: values(0:2)

      associate (n => basis%rows, i => signal%row)
         values(0) = signal%offset + signal%slope*time + signal%factor*rows(i) + signal%rate_factor*rows(i + n)
         values(1) = signal%slope + signal%factor*rows(i + n) + signal%rate_factor*rows(i + 2*n)
         values(2) = signal%factor*rows(i + 2*n) + signal%rate_factor*rows(i + 3*n)
      end associate
   end subroutine values_of

   !> Bounds of a signal that hold from an instant on.
   pure subroutine bounds_of(basis, signal, bounds, time, steps, bound, noise, limit, floor)
      type(row_basis_t), intent(in) :: basis
      type(row_signal_t), intent(in) :: signal
      !> Bounds of all rows, from `bound_rows`
      real(wp), contiguous, intent(in) :: bounds(:)
      !> Time since the start, and number of steps that led there
      real(wp), intent(in) :: time
      integer, intent(in) :: steps
      !> Bound of the magnitude of the sixth derivative
      real(wp), intent(out) :: bound
      !> Rounding error of the value
      real(wp), intent(out) :: noise
      !> End of the search, and lower bound of the signal up to it
      real(wp), intent(in), optional :: limit
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
               ! Hoelder's inequality: sum |c| |s|^2 from the sums of |c| |s| and |c| |s|^6
               curvature = 0.0_wp
               if (rate_bound > 0.0_wp) curvature = rate_bound*(sixth/rate_bound)**0.2_wp
               rate = rate + rate_factor*curvature
            end if
         end associate
      end associate
      noise = epsilon(1.0_wp)*((4.0_wp + 2.0_wp*real(steps, wp))*magnitude + time*rate &
         + 4.0_wp*(abs(signal%offset) + abs(signal%slope)*time))
      if (present(floor)) floor = signal%offset + min(signal%slope*time, signal%slope*limit) - magnitude
   end subroutine bounds_of

   !> Bernstein coefficients of the quintic Hermite polynomial of a step.
   pure function coefficients(at_start, at_end, length) result(b)
      !> Value, slope and curvature at both ends
      real(wp), intent(in) :: at_start(0:2)
      real(wp), intent(in) :: at_end(0:2)
      real(wp), intent(in) :: length
      real(wp) :: b(0:5)

      b(0) = at_start(0)
      b(1) = at_start(0) + 0.2_wp*length*at_start(1)
      b(2) = at_start(0) + 0.4_wp*length*at_start(1) + 0.05_wp*length**2*at_start(2)
      b(3) = at_end(0) - 0.4_wp*length*at_end(1) + 0.05_wp*length**2*at_end(2)
      b(4) = at_end(0) - 0.2_wp*length*at_end(1)
      b(5) = at_end(0)
   end function coefficients

   !> Coefficients of the powers of the share of the step, from Bernstein coefficients.
   pure function powers_of(b) result(c)
      real(wp), intent(in) :: b(0:5)
      real(wp) :: c(0:5)

      c = [b(0), 5.0_wp*(b(1) - b(0)), 10.0_wp*(b(2) - 2.0_wp*b(1) + b(0)), &
         10.0_wp*(b(3) - 3.0_wp*b(2) + 3.0_wp*b(1) - b(0)), &
         5.0_wp*(b(4) - 4.0_wp*b(3) + 6.0_wp*b(2) - 4.0_wp*b(1) + b(0)), &
         b(5) - 5.0_wp*b(4) + 10.0_wp*b(3) - 10.0_wp*b(2) + 5.0_wp*b(1) - b(0)]
   end function powers_of

   !> The node at the start or at the end of a path; -1: neither node is at that time.
   pure function node_at_time(path, time) result(node)
      type(row_path_t), intent(in) :: path
      real(wp), intent(in) :: time
      integer :: node

      node = -1
      if (.not. time > 0.0_wp) node = 0
      if (.not. abs(time - path%time(path%count)) > 0.0_wp) node = path%count
   end function node_at_time

   !> A signal and its rate at a node.
   pure function value_at_node(basis, path, signal, node) result(state)
      type(row_basis_t), intent(in) :: basis
      type(row_path_t), intent(in) :: path
      type(row_signal_t), intent(in) :: signal
      integer, intent(in) :: node
      real(wp) :: state(2)

      real(wp) :: values(0:2)

      call values_of(basis, signal, path%rows(:, node), path%time(node), values)
      state = values(:1)
   end function value_at_node

end module row_signals
