!> Time courses of loads in segments: in each segment a constant, a slope and a harmonic (docs/theory.md, section 18).
module load_courses
   use cubic_splines, only: spline_curvature
   use kinds, only: pi, wp
   use load_settings, only: base_displacement, base_settings_t, course_harmonic, course_pulse, course_step, &
      course_table, pulse_half_sine, time_course_t
   implicit none (type, external)
   private
   public :: load_segment_t, load_segment_at, value_at, acceleration_of, frequency_of

   !> Circular frequency below which a harmonic is followed by its tangents.
   real(wp), parameter :: lowest_harmonic = 1e-10_wp

   !> A load segment: constant + slope t + Re(harmonic exp(i frequency t)), with the time t from the instant for which
   !> the segment was requested. The default is a segment without load.
   type :: load_segment_t
      real(wp) :: constant = 0.0_wp
      real(wp) :: slope = 0.0_wp
      complex(wp) :: harmonic = (0.0_wp, 0.0_wp)
      real(wp) :: frequency = 0.0_wp
      !> tau at the end of the segment
      real(wp) :: until = huge(1.0_wp)
   end type load_segment_t

contains

   !> The load segment that contains an instant, or begins at this instant.
   pure type(load_segment_t) function load_segment_at(course, tau) result(segment)
      type(time_course_t), intent(in) :: course
      !> Instant; if it equals the boundary of two segments to rounding, the later segment is returned
      real(wp), intent(in) :: tau

      real(wp) :: last
      integer :: k

      if (.not. is_past(tau, course%start)) then
         segment%until = course%start
         return
      end if
      last = course%end
      if (course%kind == course_pulse) last = min(last, course%start + course%duration)
      if (is_past(tau, last)) return
      segment%until = last
      select case (course%kind)
      case (course_harmonic)
         call set_harmonic(course%amplitude, course%frequency, course%frequency*tau + course%phase, tau, segment)
      case (course_step)
         segment%constant = course%amplitude
      case (course_pulse)
         if (course%shape == pulse_half_sine) then
            associate (frequency => pi/course%duration)
               call set_harmonic(course%amplitude, frequency, frequency*(tau - course%start), tau, segment)
            end associate
         else
            segment%constant = course%amplitude
         end if
      case (course_table)
         k = last_point_before(course, tau)
         if (k < size(course%time)) segment%until = min(last, course%start + course%time(k + 1))
         ! outside its table a load is zero
         if (k == 0 .or. k == size(course%time)) return
         associate (t => course%time, v => course%value)
            segment%slope = course%amplitude*((v(k + 1) - v(k))/(t(k + 1) - t(k)))
            segment%constant = course%amplitude*v(k) + segment%slope*((tau - course%start) - t(k))
         end associate
      end select
   end function load_segment_at

   !> Set a segment to amplitude sin(angle + frequency t). Below `lowest_harmonic` the segment is the tangent of the
   !> sine and so short that their difference, amplitude (frequency t)**2/2, is below rounding. The response to such a
   !> harmonic would be the small part of a complex number, with the rounding error of the large part.
   pure subroutine set_harmonic(amplitude, frequency, angle, tau, segment)
      real(wp), intent(in) :: amplitude
      real(wp), intent(in) :: frequency
      !> Phase angle at the start of the segment
      real(wp), intent(in) :: angle
      !> Instant at which the segment starts
      real(wp), intent(in) :: tau
      type(load_segment_t), intent(inout) :: segment

      if (frequency < lowest_harmonic) then
         segment%constant = amplitude*sin(angle)
         segment%slope = amplitude*frequency*cos(angle)
         segment%until = min(segment%until, tau + sqrt(epsilon(1.0_wp))/frequency)
      else
         segment%frequency = frequency
         segment%harmonic = cmplx(amplitude*sin(angle), -amplitude*cos(angle), wp)
      end if
   end subroutine set_harmonic

   !> Whether an instant has been reached, to rounding.
   elemental logical function is_past(tau, instant) result(answer)
      real(wp), intent(in) :: tau
      real(wp), intent(in) :: instant

      answer = instant - tau <= 2.0_wp*epsilon(1.0_wp)*abs(tau)
   end function is_past

   !> Index of the last point of a table at or before an instant; 0: there is none.
   pure integer function last_point_before(course, tau) result(place)
      type(time_course_t), intent(in) :: course
      real(wp), intent(in) :: tau

      integer :: above, middle

      place = 0
      above = size(course%time) + 1
      do while (above - place > 1)
         middle = place + (above - place)/2
         if (is_past(tau, course%start + course%time(middle))) then
            place = middle
         else
            above = middle
         end if
      end do
   end function last_point_before

   !> Value of a load at an instant; at a jump the value after the jump.
   elemental real(wp) function value_at(course, tau) result(value)
      type(time_course_t), intent(in) :: course
      real(wp), intent(in) :: tau

      type(load_segment_t) :: segment

      segment = load_segment_at(course, tau)
      value = segment%constant + real(segment%harmonic, wp)
   end function value_at

   !> Circular frequency of a harmonic or a half-sine; 0: the load is another.
   elemental real(wp) function frequency_of(course) result(frequency)
      type(time_course_t), intent(in) :: course

      frequency = 0.0_wp
      if (course%kind == course_harmonic) frequency = course%frequency
      if (course%kind == course_pulse .and. course%shape == pulse_half_sine) frequency = pi/course%duration
   end function frequency_of

   !> Acceleration of a base whose displacement is harmonic or a table. A cubic spline with zero end slopes interpolates
   !> the table, so the acceleration is linear between its points.
   pure type(time_course_t) function acceleration_of(base) result(course)
      type(base_settings_t), intent(in) :: base

      course = base%course
      if (base%quantity /= base_displacement) return
      if (course%kind == course_harmonic) course%amplitude = -course%frequency**2*course%amplitude
      ! the course becomes the second derivative of the spline at the points
      if (course%kind == course_table) course%value(:) = &
         spline_curvature(course%time, course%value, [.true., .true.])
   end function acceleration_of

end module load_courses
