!> The period of what acts on a beam: of one harmonic load, or the least that holds whole periods of all of them.
module load_periods
   use kinds, only: wp
   use load_settings, only: course_step, time_course_t
   implicit none (type, external)
   private
   public :: period_of, is_steady

contains

   !> In tau; 0: there is none.
   pure function period_of(frequencies, which) result(period)
      !> Of all harmonic loads
      real(wp), intent(in) :: frequencies(:)
      !> Whose; 0: of all
      integer, intent(in) :: which
      real(wp) :: period

      ! in a common period the slowest turns no more often, and what decimals miss of whole ratios is less than this
      integer, parameter :: most_turns = 64
      real(wp), parameter :: rounding = 1.0e-9_wp
      real(wp), parameter :: one_turn = 2.0_wp*acos(-1.0_wp)
      integer :: turns

      period = 0.0_wp
      if (size(frequencies) == 0 .or. which > size(frequencies)) return
      if (which > 0) then
         period = one_turn/frequencies(which)
         return
      end if
      do turns = 1, most_turns
         associate (ratio => frequencies*(real(turns, wp)/minval(frequencies)))
            if (any(abs(ratio - anint(ratio)) > rounding*ratio)) cycle
         end associate
         period = real(turns, wp)*(one_turn/minval(frequencies))
         return
      end do
   end function period_of

   !> Does a load go on as at the start for ever: harmonic or constant?
   elemental function is_steady(course) result(is)
      type(time_course_t), intent(in) :: course
      logical :: is

      is = course%kind <= course_step .and. course%start <= 0.0_wp .and. course%end >= huge(1.0_wp)
   end function is_steady

end module load_periods
