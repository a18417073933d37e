!> The zero of a function that falls, evaluated by whoever asks for it.
module falling_zero
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: bracket_t, start_bracket, narrow

   !> Where a falling function passes zero: regula falsi, the weight of an end that stays halved (Illinois).
   type :: bracket_t
      real(wp) :: low = 0.0_wp
      real(wp) :: high = 0.0_wp
      real(wp) :: value_low = 0.0_wp
      real(wp) :: value_high = 0.0_wp
      !> Where to evaluate next
      real(wp) :: guess = 0.0_wp
      integer :: last_side = 0
      integer :: count = 0
      logical :: is_done = .false.
   end type bracket_t

contains

   !> Bracket the zero of a function that falls from 0 to a length.
   pure subroutine start_bracket(length, at_start, at_end, bracket)
      real(wp), intent(in) :: length
      !> Values; the last one is not positive
      real(wp), intent(in) :: at_start
      real(wp), intent(in) :: at_end
      !> The bracket
      type(bracket_t), intent(out) :: bracket

      bracket%high = length
      bracket%value_low = at_start
      bracket%value_high = at_end
      ! an impact before the phase may have made it so already
      bracket%is_done = at_start <= 0.0_wp
      if (.not. bracket%is_done) call next_guess(bracket)
   end subroutine start_bracket

   !> Enter the value at the guess and make the next.
   pure subroutine narrow(bracket, value)
      type(bracket_t), intent(inout) :: bracket
      real(wp), intent(in) :: value

      integer, parameter :: cap = 200
      integer :: side

      side = merge(1, -1, value > 0.0_wp)
      if (value > 0.0_wp) then
         bracket%low = bracket%guess
         bracket%value_low = value
         if (bracket%last_side == side) bracket%value_high = 0.5_wp*bracket%value_high
      else
         bracket%high = bracket%guess
         bracket%value_high = value
         if (bracket%last_side == side) bracket%value_low = 0.5_wp*bracket%value_low
      end if
      bracket%last_side = side
      bracket%count = bracket%count + 1
      bracket%is_done = bracket%count >= cap .or. abs(value) <= 0.0_wp .or. &
         bracket%high - bracket%low <= 4.0_wp*epsilon(1.0_wp)*bracket%high
      if (.not. bracket%is_done) call next_guess(bracket)
   end subroutine narrow

   !> Where the chord passes zero, and the middle now and then.
   pure subroutine next_guess(bracket)
      type(bracket_t), intent(inout) :: bracket

      real(wp) :: middle, guess

      middle = bracket%low + 0.5_wp*(bracket%high - bracket%low)
      guess = bracket%low + (bracket%high - bracket%low)*(bracket%value_low/(bracket%value_low - bracket%value_high))
      if (.not. (guess > bracket%low .and. guess < bracket%high) .or. modulo(bracket%count, 8) == 7) guess = middle
      bracket%guess = guess
      if (.not. (guess > bracket%low .and. guess < bracket%high)) bracket%is_done = .true.
   end subroutine next_guess

end module falling_zero
