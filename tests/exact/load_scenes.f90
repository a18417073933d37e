!> Beams under loads that the tests share, and their motion by Duhamel's integral.
module load_scenes
   use applied_loads, only: applied_loads_t, gather_loads
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use free_modes, only: find_free_modes, free_modes_t
   use kinds, only: wp
   use load_courses, only: load_segment_at, load_segment_t, value_at
   use load_settings, only: course_pulse, course_step, course_table, force_settings_t, pulse_half_sine, start_rest, &
      time_course_t
   use run_settings, only: run_settings_t
   implicit none (type, external)
   private
   public :: kinds_of_course, course_of, driven_by, force_of, duhamel

   !> Courses that `course_of` knows.
   integer, parameter :: kinds_of_course = 6

contains

   !> A course of each kind, with breaks that no sample meets.
   function course_of(kind) result(course)
      integer, intent(in) :: kind
      type(time_course_t) :: course

      integer :: i

      select case (kind)
      case (1)
         course = time_course_t(amplitude=0.5_wp, frequency=0.7_wp, phase=0.4_wp)
      case (2)
         course = time_course_t(kind=course_step, amplitude=-0.5_wp, start=1.03_wp, end=6.3_wp)
      case (3)
         course = time_course_t(kind=course_pulse, amplitude=0.8_wp, start=0.31_wp, duration=1.7_wp)
      case (4)
         course = time_course_t(kind=course_pulse, shape=pulse_half_sine, amplitude=-1.5_wp, start=0.52_wp, duration=3.1_wp)
      case (5)
         course = time_course_t(kind=course_table, amplitude=0.7_wp, start=0.21_wp)
         allocate (course%time, source=[(0.37_wp*real(i, wp), i=0, 20)])
         allocate (course%value, source=[(sin(2.3_wp*real(i, wp)), i=0, 20)])
      case (6)
         course = time_course_t(amplitude=0.3_wp, frequency=3.0_wp, start=2.2_wp, end=7.7_wp)
      end select
   end function course_of

   !> A beam under one load, from rest; its only stop is far away.
   function driven_by(force, duration) result(settings)
      type(force_settings_t), intent(in) :: force
      real(wp), intent(in) :: duration
      type(run_settings_t) :: settings

      settings%zeta = 0.02_wp
      settings%stop%preload = -1.0e3_wp
      settings%start%kind = start_rest
      allocate (settings%forces(1), source=[force])
      settings%response%duration = duration
      settings%output%energy = .true.
      settings%output%measures = .true.
   end function driven_by

   function force_of(course, position) result(force)
      type(time_course_t), intent(in) :: course
      real(wp), intent(in) :: position
      type(force_settings_t) :: force

      force = force_settings_t(course=course, position=[position])
   end function force_of

   !> The tip of a free beam at one instant: Duhamel's integral mode by mode, by a Gauss rule between the breaks.
   function duhamel(model, settings, time, own_modes) result(eta)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      real(wp), intent(in) :: time
      !> Instead of those of the beam
      type(free_modes_t), intent(in), optional :: own_modes
      real(wp) :: eta

      ! five points, exact up to t**9
      real(wp), parameter :: node(5) = [-0.9061798459386640_wp, -0.5384693101056831_wp, 0.0_wp, 0.5384693101056831_wp, &
         0.9061798459386640_wp]
      real(wp), parameter :: share(5) = [0.2369268850561891_wp, 0.4786286704993665_wp, 0.5688888888888889_wp, &
         0.4786286704993665_wp, 0.2369268850561891_wp]
      type(applied_loads_t) :: loads
      type(free_modes_t) :: modes
      type(failure_t), allocatable :: error
      type(load_segment_t) :: segment
      real(wp) :: decay, from, mode_load, rate, to, t, value, width
      integer :: g, i, j, panel, panels

      call gather_loads(model, settings, loads)
      if (present(own_modes)) then
         modes = own_modes
      else
         call find_free_modes(model, modes, error)
      end if
      eta = -settings%stop%preload
      do g = 1, loads%count
         do i = 1, size(modes%square)
            mode_load = sum(modes%mode(:, i)*loads%vector(:, g))
            decay = settings%zeta*modes%square(i) + settings%zeta_mass
            rate = sqrt(modes%square(i) - decay**2)
            value = 0.0_wp
            from = 0.0_wp
            do while (from < time)
               segment = load_segment_at(loads%course(g), from)
               to = min(segment%until, time)
               panels = ceiling(4.0_wp*(to - from)*sqrt(modes%square(i))) + 40
               width = 0.5_wp*(to - from)/real(panels, wp)
               do panel = 1, panels
                  do j = 1, 5
                     t = from + width*(real(2*panel - 1, wp) + node(j))
                     value = value + width*share(j)*value_at(loads%course(g), t)*exp(-decay*(time - t)) &
                        *sin(rate*(time - t))/rate
                  end do
               end do
               from = to
            end do
            eta = eta + modes%mode(modes%tip_dof, i)*mode_load*value
         end do
      end do
   end function duhamel

end module load_scenes
