!> The sum of two signals as one signal.
module summed_signal
   use certified_search, only: bounds_t, transformable_signal_t
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: summed_signal_t

   !> first + second.
   type, extends(transformable_signal_t) :: summed_signal_t
      class(transformable_signal_t), allocatable :: first
      class(transformable_signal_t), allocatable :: second
   contains
      procedure :: find_bounds
      procedure :: evaluate
      procedure :: transform
   end type summed_signal_t

   !> Replaces a bound that is unknown, so that sums of bounds do not overflow.
   real(wp), parameter :: unbounded = 0.25_wp*huge(1.0_wp)

contains

   !> The signal and its slope at an instant.
   subroutine evaluate(self, t, value, slope)
      class(summed_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Value of the signal
      real(wp), intent(out) :: value
      !> Slope of the signal
      real(wp), intent(out) :: slope

      real(wp) :: second_value, second_slope

      call self%first%evaluate(t, value, slope)
      call self%second%evaluate(t, second_value, second_slope)
      value = value + second_value
      slope = slope + second_slope
   end subroutine evaluate

   !> A derivative of the signal at an instant, with bounds that hold from that instant on.
   subroutine find_bounds(self, t, order, bounds)
      class(summed_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Order of the derivative; 0: the signal itself
      integer, intent(in) :: order
      !> Values and bounds at the instant
      type(bounds_t), intent(out) :: bounds

      type(bounds_t) :: first_bounds, second_bounds

      ! The zero-free step of the sum is not computed (0), because it does not follow from the steps of the two signals
      call self%first%find_bounds(t, order, first_bounds)
      call self%second%find_bounds(t, order, second_bounds)
      bounds%value = first_bounds%value + second_bounds%value
      bounds%slope = first_bounds%slope + second_bounds%slope
      bounds%curvature = first_bounds%curvature + second_bounds%curvature
      bounds%bound = first_bounds%bound + second_bounds%bound
      bounds%two_sided_bound = first_bounds%two_sided_bound + second_bounds%two_sided_bound
      bounds%bound_jerk = min(first_bounds%bound_jerk, unbounded) + min(second_bounds%bound_jerk, unbounded)
      bounds%rounding = first_bounds%rounding + second_bounds%rounding
      bounds%signal = first_bounds%signal + second_bounds%signal
      bounds%signal_rounding = first_bounds%signal_rounding + second_bounds%signal_rounding
      bounds%floor = max(first_bounds%floor, -unbounded) + max(second_bounds%floor, -unbounded)
   end subroutine find_bounds

   !> The signal offset + factor d(from + t), with d the derivative of the given order of this signal.
   subroutine transform(self, from, factor, offset, order, transformed)
      class(summed_signal_t), intent(in) :: self
      !> Instant that becomes t = 0
      real(wp), intent(in) :: from
      !> Factor of the transformed signal
      real(wp), intent(in) :: factor
      !> Constant that is added to the signal
      real(wp), intent(in) :: offset
      !> 0: d is the signal itself, 1: d is its slope
      integer, intent(in) :: order
      !> The new signal
      class(transformable_signal_t), allocatable, intent(out) :: transformed

      type(summed_signal_t), allocatable :: summed

      allocate (summed)
      call self%first%transform(from, factor, offset, order, summed%first)
      call self%second%transform(from, factor, 0.0_wp, order, summed%second)
      call move_alloc(summed, transformed)
   end subroutine transform

end module summed_signal
