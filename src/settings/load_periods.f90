!> Properties of the time courses of loads: the period of one harmonic load and the common period of all, the last
!> change of the loads of a run, and whether a load is steady or still varies at the end of a run.
module load_periods
   use kinds, only: wp
   use load_settings, only: course_harmonic, course_step, course_table, time_course_t
   implicit none (type, external)
   private
   public :: period_of, is_steady, varies_to, last_change

contains

   !> The period of one harmonic load, or the smallest common period of all, in tau; 0: there is none.
   pure real(wp) function period_of(frequencies, which) result(period)
      !> Frequencies of all harmonic loads, over omega1
      real(wp), intent(in) :: frequencies(:)
      !> Number of the load; 0: the common period of all loads
      integer, intent(in) :: which

      ! maximum number of periods of the slowest load in a common period
      integer, parameter :: max_cycles = 64
      ! maximum relative deviation of the ratio of two frequencies from a ratio of whole numbers, to which the rounded
      ! decimals of a scene may lead
      real(wp), parameter :: rounding = 1.0e-9_wp
      ! maximum phase error of a load after the common period, in periods of that load; it limits the relative deviation
      ! if the common period has many periods of the load
      real(wp), parameter :: max_phase_error = 1.0e-6_wp
      real(wp), parameter :: two_pi = 2.0_wp*acos(-1.0_wp)
      integer :: cycles

      period = 0.0_wp
      if (size(frequencies) == 0 .or. which > size(frequencies)) return
      if (which > 0) then
         period = two_pi/frequencies(which)
         return
      end if
      do cycles = 1, max_cycles
         associate (ratio => frequencies*(real(cycles, wp)/minval(frequencies)))
            if (any(abs(ratio - anint(ratio)) > min(rounding*ratio, max_phase_error))) cycle
         end associate
         period = real(cycles, wp)*(two_pi/minval(frequencies))
         return
      end do
   end function period_of

   !> Whether a load is harmonic or constant from tau = 0 without end.
   elemental logical function is_steady(course) result(answer)
      type(time_course_t), intent(in) :: course

      answer = any(course%kind == [course_harmonic, course_step]) .and. course%start <= 0.0_wp &
         .and. course%end >= huge(1.0_wp)
   end function is_steady

   !> The last instant before the end of a run at which a load begins, reaches its given `end`, or, if it is a table, is
   !> greatest in magnitude; 0: there is none. The end of a pulse and the last point of a table do not count.
   pure real(wp) function last_change(courses, end) result(tau)
      type(time_course_t), intent(in) :: courses(:)
      !> End of the run, tau
      real(wp), intent(in) :: end

      real(wp) :: instants(3)
      integer :: k

      tau = 0.0_wp
      do k = 1, size(courses)
         associate (course => courses(k))
            instants = [course%start, course%start, course%end]
            if (course%kind == course_table) instants(1) = course%start + course%time(maxloc(abs(course%value), dim=1))
         end associate
         tau = max(tau, maxval(instants, mask=instants < end))
      end do
   end function last_change

   !> Whether a harmonic load or a table lasts to the end of a run, so that the motion does not settle. A pulse does not
   !> count.
   pure logical function varies_to(course, end) result(answer)
      type(time_course_t), intent(in) :: course
      !> End of the run, tau
      real(wp), intent(in) :: end

      ! a table that ends within this last fraction of the run counts as lasting to the end of the run, because the
      ! instant of its last point may be rounded
      real(wp), parameter :: rounding = 1.0e-3_wp
      real(wp) :: last

      last = course%end
      if (course%kind == course_table) last = min(last, course%start + maxval(course%time))
      answer = any(course%kind == [course_harmonic, course_table]) .and. last >= end*(1.0_wp - rounding)
   end function varies_to

end module load_periods
