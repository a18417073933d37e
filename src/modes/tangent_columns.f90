!> Variations of a motion, side by side: by how much its state would differ had it begun otherwise, or were a load
!> another one (docs/theory.md, section 22).
module tangent_columns
   use complementarity, only: solve_active
   use damped_oscillators, only: oscillators_t
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: tangent_t, state_rates_t, open_tangent, strike_columns, shift_columns, size_of_column
   public :: by_nothing, by_amplitude, by_frequency

   !> What the last column is the derivative by, besides those by the state: nothing, the amplitude of a load, or the
   !> frequency of a load, those of all others in proportion.
   integer, parameter :: by_nothing = 0
   integer, parameter :: by_amplitude = 1
   integer, parameter :: by_frequency = 2

   !> How fast the state changes.
   type :: state_rates_t
      !> In the free modes, [modes], and of P2 of each surface, [surfaces]
      real(wp), allocatable :: q(:), v(:), memory(:)
   end type state_rates_t

   type :: tangent_t
      !> In the free modes, [modes, columns], and of P2 of each surface, [surfaces, columns]
      real(wp), allocatable :: q(:, :), v(:, :), memory(:, :)
      !> By how much later the last event comes, [columns]
      real(wp), allocatable :: delay(:)
      !> With these the present phase began; after a run, those at its end
      type(state_rates_t) :: begun
      !> One of the `by_` constants, and of which load
      integer :: parameter = by_nothing
      integer :: load = 0
      !> Least speed at which a rigid surface was met, and the least rate of anything that ended a phase as a share of
      !> what its sum is made of: where that vanishes there is no derivative
      real(wp) :: least_speed = huge(1.0_wp)
      !> Logarithm of what the columns were divided by
      real(wp) :: log_scale = 0.0_wp
   end type tangent_t

contains

   !> Room for so many columns, all zero.
   pure subroutine open_tangent(modes, contacts, columns, tangent)
      integer, intent(in) :: modes
      integer, intent(in) :: contacts
      integer, intent(in) :: columns
      type(tangent_t), intent(inout) :: tangent

      allocate (tangent%q(modes, columns), tangent%v(modes, columns), tangent%memory(contacts, columns), &
         tangent%delay(columns), source=0.0_wp)
   end subroutine open_tangent

   !> Impulses at surfaces turn the velocities there back: B'v+ = -eps B'v over those that give one.
   subroutine strike_columns(value, restitution, is_active, tangent)
      !> Modes at those that take part, [modes, taking]
      real(wp), intent(in) :: value(:, :)
      !> [taking]
      real(wp), intent(in) :: restitution(:)
      logical, intent(in) :: is_active(:)
      type(tangent_t), intent(inout) :: tangent

      real(wp) :: mobility(size(is_active), size(is_active)), impulse(size(is_active))
      integer :: i

      mobility = matmul(transpose(value), value)
      do i = 1, size(tangent%delay)
         call solve_active(mobility, (1.0_wp + restitution)*matmul(tangent%v(:, i), value), is_active, impulse)
         tangent%v(:, i) = tangent%v(:, i) + matmul(value, impulse)
      end do
   end subroutine strike_columns

   !> The state where each column meets the event, from that at one instant, or back.
   pure subroutine shift_columns(rates, factor, tangent)
      type(state_rates_t), intent(in) :: rates
      !> 1: to the event, -1: back
      real(wp), intent(in) :: factor
      type(tangent_t), intent(inout) :: tangent

      integer :: i

      do i = 1, size(tangent%delay)
         associate (delay => factor*tangent%delay(i))
            tangent%q(:, i) = tangent%q(:, i) + rates%q*delay
            tangent%v(:, i) = tangent%v(:, i) + rates%v*delay
            tangent%memory(:, i) = tangent%memory(:, i) + rates%memory*delay
         end associate
      end do
   end subroutine shift_columns

   !> So measured that it shrinks evenly in each mode that swings alone.
   pure function size_of_column(tangent, place, oscillators) result(length)
      type(tangent_t), intent(in) :: tangent
      integer, intent(in) :: place
      !> The free modes
      type(oscillators_t), intent(in) :: oscillators
      real(wp) :: length

      associate (q => tangent%q(:, place), v => tangent%v(:, place), n => oscillators%oscillating, &
         last => oscillators%count)
         length = sqrt(sum((oscillators%spread(:n)*q(:n))**2 + (v(:n) + oscillators%decay(:n)*q(:n))**2) &
            + sum(oscillators%square(n + 1:last)*q(n + 1:)**2 + v(n + 1:)**2) + sum(tangent%memory(:, place)**2))
      end associate
   end function size_of_column

end module tangent_columns
