!> Two signals as one.
module summed_signal
   use certified_search, only: bounds_t, viewed_signal_t
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: summed_signal_t

   type, extends(viewed_signal_t) :: summed_signal_t
      class(viewed_signal_t), allocatable :: first
      class(viewed_signal_t), allocatable :: second
   contains
      procedure :: find_bounds
      procedure :: evaluate
      procedure :: view
   end type summed_signal_t

   !> More than any bound that says something.
   real(wp), parameter :: endless = 0.25_wp*huge(1.0_wp)

contains

   !> The signal and its slope at an instant.
   subroutine evaluate(self, t, value, slope)
      class(summed_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> s and s'
      real(wp), intent(out) :: value
      real(wp), intent(out) :: slope

      real(wp) :: more, more_slope

      call self%first%evaluate(t, value, slope)
      call self%second%evaluate(t, more, more_slope)
      value = value + more
      slope = slope + more_slope
   end subroutine evaluate

   !> Value, slope and bounds of a derivative of the signal at an instant.
   subroutine find_bounds(self, t, order, here)
      class(summed_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Which derivative, 0: the signal itself
      integer, intent(in) :: order
      !> What is there
      type(bounds_t), intent(out) :: here

      type(bounds_t) :: one, other

      call self%first%find_bounds(t, order, one)
      call self%second%find_bounds(t, order, other)
      here%value = one%value + other%value
      here%slope = one%slope + other%slope
      here%curvature = one%curvature + other%curvature
      here%bound = one%bound + other%bound
      here%bound_both = one%bound_both + other%bound_both
      here%bound_jerk = min(one%bound_jerk, endless) + min(other%bound_jerk, endless)
      here%rounding = one%rounding + other%rounding
      here%signal = one%signal + other%signal
      here%signal_rounding = one%signal_rounding + other%signal_rounding
      here%floor = max(one%floor, -endless) + max(other%floor, -endless)
   end subroutine find_bounds

   !> offset + factor times a derivative of the signal, from an instant on.
   subroutine view(self, from, factor, offset, order, part)
      class(summed_signal_t), intent(in) :: self
      !> The instant
      real(wp), intent(in) :: from
      real(wp), intent(in) :: factor
      real(wp), intent(in) :: offset
      !> 0: the signal itself, 1: its slope
      integer, intent(in) :: order
      !> The same as a signal
      class(viewed_signal_t), allocatable, intent(out) :: part

      type(summed_signal_t), allocatable :: summed

      allocate (summed)
      call self%first%view(from, factor, offset, order, summed%first)
      call self%second%view(from, factor, 0.0_wp, order, summed%second)
      call move_alloc(summed, part)
   end subroutine view

end module summed_signal
