!> The sum of two signals as one signal.
module summed_signal
   use certified_search, only: bound_curvature, bound_jerk, bound_value, bounds_t, term_columns, term_curvature, &
      term_rate, term_value, transformable_signal_t
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: summed_signal_t, add_to_bounds

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

   !> A derivative of the sum, or of its sum with another signal, at an instant, as in `bounds_interface`. The signal
   !> with the larger second derivative bounds each of its terms, so that its fast terms do not shorten the step.
   recursive subroutine find_bounds(self, t, order, bounds, added, added_floor, needs_step)
      class(summed_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Order of the derivative; 0: the signal itself
      integer, intent(in) :: order
      !> Values and bounds at the instant
      type(bounds_t), intent(out) :: bounds
      !> That derivative of the other signal, columns as in `certified_search`
      real(wp), intent(in), optional :: added(term_columns)
      !> Lower bound of the other signal
      real(wp), intent(in), optional :: added_floor
      !> False: the length of a step without a zero is not needed
      logical, intent(in), optional :: needs_step

      type(bounds_t) :: first_bounds, second_bounds

      call self%first%find_bounds(t, order, first_bounds, needs_step=.false.)
      call self%second%find_bounds(t, order, second_bounds, needs_step=.false.)
      if (first_bounds%bound > second_bounds%bound) then
         call add_slower(self%first, second_bounds)
      else
         call add_slower(self%second, first_bounds)
      end if

   contains

      !> The faster signal with the values and bounds of the slower one.
      subroutine add_slower(faster, slower)
         class(transformable_signal_t), intent(in) :: faster
         type(bounds_t), intent(in) :: slower

         real(wp) :: columns(term_columns), floor

         columns(term_value) = slower%value
         columns(term_rate) = slower%slope
         columns(term_curvature) = slower%curvature
         ! only the rounding error depends on this magnitude
         columns(bound_value) = slower%rounding/epsilon(1.0_wp)
         columns(bound_curvature) = slower%two_sided_bound
         columns(bound_jerk) = min(slower%bound_jerk, unbounded)
         floor = max(slower%floor, -unbounded)
         if (present(added)) columns = columns + added
         if (present(added_floor)) floor = floor + max(added_floor, -unbounded)
         call faster%find_bounds(t, order, bounds, columns, floor, needs_step)
         bounds%rounding = bounds%rounding + slower%rounding
         bounds%signal = bounds%signal + slower%signal
         bounds%signal_rounding = bounds%signal_rounding + slower%signal_rounding
      end subroutine add_slower
   end subroutine find_bounds

   !> Add another signal to values and bounds.
   pure subroutine add_to_bounds(added, floor, bounds)
      !> The other signal, columns as in `certified_search`
      real(wp), intent(in) :: added(term_columns)
      !> Lower bound of the other signal
      real(wp), intent(in) :: floor
      type(bounds_t), intent(inout) :: bounds

      bounds%value = bounds%value + added(term_value)
      bounds%slope = bounds%slope + added(term_rate)
      bounds%curvature = bounds%curvature + added(term_curvature)
      bounds%bound = bounds%bound + added(bound_curvature)
      bounds%two_sided_bound = bounds%two_sided_bound + added(bound_curvature)
      bounds%bound_jerk = min(bounds%bound_jerk, unbounded) + added(bound_jerk)
      ! a missing floor is -huge; the sum must not overflow
      bounds%floor = max(bounds%floor, -unbounded) + max(floor, -unbounded)
   end subroutine add_to_bounds

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
