!> The zero of a function of one variable, evaluated by the caller: a bracket holds the zero, chooses the next point and
!> decides, in one place, when the zero has been found.
module bracketed_zero
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: bracket_t, enter_value, choose_point, chord

   !> A bracket of the zero, and the state of the search.
   type :: bracket_t
      !> Lower end of the bracket, where the function is > 0, or <= 0 if the function grows.
      real(wp) :: low = 0.0_wp
      !> Upper end of the bracket, where the function is <= 0, or > 0 if the function grows.
      real(wp) :: high = 0.0_wp
      !> Whether the function grows with the argument.
      logical :: grows = .false.
      !> Next point to evaluate; the zero, if `is_found`
      real(wp) :: point = 0.0_wp
      !> Whether the zero is found, or the permitted evaluations are used up
      logical :: is_found = .false.
      !> The zero is found if the magnitude of the value does not exceed this; negative: values do not end the search
      real(wp) :: value_tolerance = 0.0_wp
      !> The zero is found if the step to the next point does not exceed this fraction of the point
      real(wp) :: step_tolerance = 0.0_wp
      !> The zero is found if the step to the next point does not exceed this number of spacings of floating-point
      !> numbers at the point
      real(wp) :: step_spacings = 0.0_wp
      !> The zero is found if the length of the bracket does not exceed this fraction of `high`; negative: the length
      !> does not end the search
      real(wp) :: length_tolerance = -1.0_wp
      !> Maximum number of evaluations
      integer :: max_evaluations = 200
      !> Number of evaluations so far
      integer :: evaluations = 0
      !> Value of the function at `low`, for the chord. If an end stays twice in succession, its value is halved
      !> (Illinois method), so that the chord approaches the zero from both sides
      real(wp) :: value_low = 0.0_wp
      !> Value of the function at `high`, for the chord; halved as the value at `low`
      real(wp) :: value_high = 0.0_wp
      !> End that was replaced last: 1: `low`, -1: `high`, 0: none
      integer :: last_side = 0
   end type bracket_t

contains

   !> Enter the value of the function at the point.
   elemental subroutine enter_value(bracket, value)
      type(bracket_t), intent(inout) :: bracket
      real(wp), intent(in) :: value

      integer :: side

      side = merge(1, -1, (value > 0.0_wp) .neqv. bracket%grows)
      if (side > 0) then
         bracket%low = bracket%point
         bracket%value_low = value
         if (bracket%last_side == side) bracket%value_high = 0.5_wp*bracket%value_high
      else
         bracket%high = bracket%point
         bracket%value_high = value
         if (bracket%last_side == side) bracket%value_low = 0.5_wp*bracket%value_low
      end if
      bracket%last_side = side
      bracket%evaluations = bracket%evaluations + 1
      bracket%is_found = abs(value) <= bracket%value_tolerance .or. &
         bracket%evaluations >= bracket%max_evaluations .or. &
         bracket%high - bracket%low <= bracket%length_tolerance*abs(bracket%high)
   end subroutine enter_value

   !> Choose the next point, unless the zero has been found.
   elemental subroutine choose_point(bracket, proposal)
      type(bracket_t), intent(inout) :: bracket
      !> Proposed next point; if it lies outside the bracket or is absent, the middle of the bracket is taken, so that
      !> each evaluation shortens the bracket
      real(wp), intent(in), optional :: proposal

      real(wp) :: next

      next = 0.5_wp*(bracket%low + bracket%high)
      if (present(proposal)) then
         if (proposal > bracket%low .and. proposal < bracket%high) next = proposal
      end if
      bracket%is_found = bracket%is_found .or. abs(next - bracket%point) <= &
         max(bracket%step_tolerance*abs(bracket%point), bracket%step_spacings*spacing(bracket%point))
      if (.not. bracket%is_found) bracket%point = next
   end subroutine choose_point

   !> Zero of the chord between the ends of the bracket; at every eighth evaluation the middle of the bracket, which
   !> bounds the number of evaluations.
   elemental real(wp) function chord(bracket) result(point)
      type(bracket_t), intent(in) :: bracket

      associate (low => bracket%low, high => bracket%high, value_low => bracket%value_low)
         point = low + (high - low)*(value_low/(value_low - bracket%value_high))
         if (.not. (point > low .and. point < high) .or. modulo(bracket%evaluations, 8) == 7) then
            point = low + 0.5_wp*(high - low)
         end if
      end associate
   end function chord

end module bracketed_zero
