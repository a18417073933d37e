!> Solutions of the variational equations as columns of a matrix: derivatives of the state of a motion with respect to
!> the initial state and to a parameter of a load (docs/theory.md, section 22).
module tangent_columns
   use complementarity, only: solve_active
   use damped_oscillators, only: oscillators_t
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: tangent_t, state_rates_t, allocate_tangent, reflect_columns, shift_columns, column_norm
   public :: no_parameter, load_amplitude, load_frequency

   !> Parameter with respect to which the last column, after those of the initial state, is the derivative: no
   !> parameter, so that no change of a load drives the last column.
   integer, parameter :: no_parameter = 0
   !> Parameter of the last column: the amplitude of a load.
   integer, parameter :: load_amplitude = 1
   !> Parameter of the last column: the frequency of a load; the frequencies of all other loads change in proportion.
   integer, parameter :: load_frequency = 2

   !> Time derivatives of the state.
   type :: state_rates_t
      !> Rates of the displacements of the free modes, [modes]
      real(wp), allocatable :: q(:)
      !> Rates of the velocities of the free modes, [modes]
      real(wp), allocatable :: v(:)
      !> Rates of the force P2 (Maxwell branch) of each contact, [contacts]
      real(wp), allocatable :: branch_force(:)
   end type state_rates_t

   !> Columns of variations during a motion.
   type :: tangent_t
      !> Variations of the displacements of the free modes, [modes, columns]
      real(wp), allocatable :: q(:, :)
      !> Variations of the velocities of the free modes, [modes, columns]
      real(wp), allocatable :: v(:, :)
      !> Variations of the force P2 of each contact, [contacts, columns]
      real(wp), allocatable :: branch_force(:, :)
      !> Variation of the instant of the last event in each column, [columns]
      real(wp), allocatable :: delay(:)
      !> Time derivatives of the state at the start of the present phase; after a run, those at its end
      type(state_rates_t) :: boundary_rates
      !> Parameter of the last column: `no_parameter`, `load_amplitude` or `load_frequency`
      integer :: parameter = no_parameter
      !> Number of the load
      integer :: load = 0
      !> Minimum so far of the normal speeds at impacts on rigid contacts. If it vanishes (a grazing impact), the
      !> derivative does not exist
      real(wp) :: min_speed = huge(1.0_wp)
      !> Logarithm of the factor by which the columns were divided
      real(wp) :: log_scale = 0.0_wp
   end type tangent_t

contains

   !> Allocate columns of zeros.
   pure subroutine allocate_tangent(modes, contacts, columns, tangent)
      integer, intent(in) :: modes
      integer, intent(in) :: contacts
      integer, intent(in) :: columns
      type(tangent_t), intent(inout) :: tangent

      allocate (tangent%q(modes, columns), tangent%v(modes, columns), tangent%branch_force(contacts, columns), &
         tangent%delay(columns), source=0.0_wp)
   end subroutine allocate_tangent

   !> Apply Newton's impact law to all columns: B^T v+ = -eps B^T v-, with B the modes at the contacts with an impulse.
   subroutine reflect_columns(value, restitution, is_active, tangent)
      !> Modes at the contacts of the impact, [modes, contacts]
      real(wp), intent(in) :: value(:, :)
      !> Coefficients of restitution eps, [contacts]
      real(wp), intent(in) :: restitution(:)
      !> Whether the contact has an impulse, [contacts]
      logical, intent(in) :: is_active(:)
      type(tangent_t), intent(inout) :: tangent

      real(wp) :: mobility(size(is_active), size(is_active)), impulse(size(is_active))
      integer :: i, j

      mobility = matmul(transpose(value), value)
      do i = 1, size(tangent%delay)
         call solve_active(mobility, (1.0_wp + restitution)*matmul(tangent%v(:, i), value), is_active, impulse, value, &
            [(j, j=1, size(is_active))])
         tangent%v(:, i) = tangent%v(:, i) + matmul(value, impulse)
      end do
   end subroutine reflect_columns

   !> Move each column from the instant of the event in the unvaried motion to that in its varied motion, or back.
   pure subroutine shift_columns(rates, factor, tangent)
      type(state_rates_t), intent(in) :: rates
      !> 1: to the instant of the varied motion, -1: back
      real(wp), intent(in) :: factor
      type(tangent_t), intent(inout) :: tangent

      integer :: i

      do i = 1, size(tangent%delay)
         associate (delay => factor*tangent%delay(i))
            tangent%q(:, i) = tangent%q(:, i) + rates%q*delay
            tangent%v(:, i) = tangent%v(:, i) + rates%v*delay
            tangent%branch_force(:, i) = tangent%branch_force(:, i) + rates%branch_force*delay
         end associate
      end do
   end subroutine shift_columns

   !> Norm of the first column, chosen such that the norm of a single free underdamped mode decays monotonically.
   pure real(wp) function column_norm(tangent, oscillators) result(norm)
      type(tangent_t), intent(in) :: tangent
      !> The free modes
      type(oscillators_t), intent(in) :: oscillators

      associate (q => tangent%q(:, 1), v => tangent%v(:, 1), n => oscillators%underdamped, &
         last => oscillators%count)
         norm = sqrt(sum((oscillators%spread(:n)*q(:n))**2 + (v(:n) + oscillators%decay(:n)*q(:n))**2) &
            + sum(oscillators%square(n + 1:last)*q(n + 1:)**2 + v(n + 1:)**2) + sum(tangent%branch_force(:, 1)**2))
      end associate
   end function column_norm

end module tangent_columns
