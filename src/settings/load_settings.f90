!> Settings of the loads on a beam, of the motion of its base (clamp, stops and supports together) and of its initial
!> conditions; and properties of the time courses of loads: their common period, their last change, and whether a load
!> is steady or still varies at the end of a run.
!>
!> Dimensionless scales: lengths and times as in `run_settings`. Forces in 3 E Ibar D / L^3, line loads in 3 E Ibar D /
!> L^4, accelerations in D omega1^2, velocities in D omega1, where D is the unit of displacement and E Ibar the bending
!> stiffness of the mean section.
module load_settings
   use kinds, only: pi, wp
   implicit none (type, external)
   private
   public :: time_course_t, force_settings_t, base_settings_t, start_settings_t, course_harmonic, course_step, &
      course_pulse, course_table, course_names, pulse_half_sine, pulse_names, base_displacement, base_names, &
      is_in_mode, start_release, start_rest, start_balance, start_velocity, start_mode, start_table, start_drop, &
      start_names, field_uniform, field_rotation, field_mode, field_names, period_of, is_steady, varies_to, last_change

   !> Kind of the time function of a load, called its course: amplitude sin(frequency tau + phase), from the start to
   !> the end
   integer, parameter :: course_harmonic = 1
   !> Course with the constant value amplitude, from the start to the end
   integer, parameter :: course_step = 2
   !> Course with the value amplitude, or amplitude times half a period of a sine, during a given duration after the
   !> start
   integer, parameter :: course_pulse = 3
   !> Course that is the amplitude times a table of values, linear between its points and zero outside
   integer, parameter :: course_table = 4

   !> Shape of a pulse: constant.
   integer, parameter :: pulse_rectangle = 1
   !> Shape of a pulse: half a period of a sine.
   integer, parameter :: pulse_half_sine = 2

   !> A base motion is given by its acceleration.
   integer, parameter :: base_acceleration = 1
   !> A base motion is given by its displacement. A table of displacements is interpolated by a cubic spline; the base
   !> is at rest before and after the table.
   integer, parameter :: base_displacement = 2

   !> Start: released from rest, after a static force at a stop has deflected the beam away from this stop
   integer, parameter :: start_release = 1
   !> Start: at rest and undeformed
   integer, parameter :: start_rest = 2
   !> Start: at rest in static equilibrium with the loads at tau = 0, which are taken as constant, and with the forces
   !> of closed contacts
   integer, parameter :: start_balance = 3
   !> Start: undeformed, with an initial velocity field
   integer, parameter :: start_velocity = 4
   !> Start: displacements and velocities in the shape of a mode
   integer, parameter :: start_mode = 5
   !> Start: displacements and velocities of a table, interpolated by cubic splines
   integer, parameter :: start_table = 6
   !> Start: the base falls and stops at tau = 0, so that the beam is undeformed and has the velocity of the fall
   !> relative to the base
   integer, parameter :: start_drop = 7

   !> Initial velocity field: uniform.
   integer, parameter :: field_uniform = 1
   !> Initial velocity field: rotation about the root.
   integer, parameter :: field_rotation = 2
   !> Initial velocity field: in the shape of a mode.
   integer, parameter :: field_mode = 3

   !> Names of these constants in scene files, such as `course_names(course_step)`.
   character(*), parameter :: course_names(4) = [character(8) :: 'harmonic', 'step', 'pulse', 'table']
   character(*), parameter :: pulse_names(2) = [character(9) :: 'rectangle', 'half_sine']
   character(*), parameter :: base_names(2) = [character(12) :: 'acceleration', 'displacement']
   character(*), parameter :: start_names(7) = [character(8) :: 'pull', 'rest', 'balance', 'velocity', 'mode', &
      'table', 'drop']
   character(*), parameter :: field_names(3) = [character(8) :: 'uniform', 'rotation', 'mode']

   !> Time function of a load or of a base motion: zero before its start and after its end.
   type :: time_course_t
      !> One of the `course_` constants
      integer :: kind = course_harmonic
      !> Amplitude in the scale of the load; for a table, the factor of its values
      real(wp) :: amplitude = 0.0_wp
      !> Frequency of a harmonic function, over omega1
      real(wp) :: frequency = 1.0_wp
      !> Phase of a harmonic function, in radians
      real(wp) :: phase = 0.0_wp
      !> Start of the load, tau; the times of a table count from it
      real(wp) :: start = 0.0_wp
      !> End of the load, tau
      real(wp) :: end = huge(1.0_wp)
      !> Duration of a pulse, tau
      real(wp) :: duration = 1.0_wp
      !> One of the `pulse_` constants: shape of a pulse
      integer :: shape = pulse_rectangle
      !> Times of the points of a table, tau, ascending
      real(wp), allocatable :: time(:)
      !> Values at these points
      real(wp), allocatable :: value(:)
   end type time_course_t

   !> Settings of &force: forces at points, or a line load along a part of the beam; positive upwards.
   type :: force_settings_t
      type(time_course_t) :: course
      !> x/L of the points, at each of which the full force acts; unallocated: a line load acts along `stretch`
      real(wp), allocatable :: position(:)
      !> x/L of the ends of a line load
      real(wp) :: stretch(2) = [0.0_wp, 1.0_wp]
   end type force_settings_t

   !> Settings of &base: common motion of the clamp, the stops and the supports, positive upwards. Displacements of the
   !> beam are relative to the base.
   type :: base_settings_t
      !> `base_acceleration` or `base_displacement`: the quantity that `course` gives
      integer :: quantity = base_acceleration
      !> Time course of that quantity
      type(time_course_t) :: course
   end type base_settings_t

   !> Settings of &start: initial conditions, relative to the base.
   type :: start_settings_t
      !> One of the `start_` constants
      integer :: kind = start_release
      !> One of the `field_` constants, used with `start_velocity`
      integer :: field = field_uniform
      !> Initial velocity, positive upwards: of all points, or of the tip for a rotation or a mode; for `start_drop`,
      !> velocity at the end of the fall, positive downwards
      real(wp) :: velocity = 0.0_wp
      !> Displacement of the tip, used with `start_mode`
      real(wp) :: displacement = 0.0_wp
      !> Number of the mode of the beam with open contacts, for `start_mode` and `field_mode`
      integer :: mode = 1
      !> Positions x/L of the table of `start_table`, ascending
      real(wp), allocatable :: position(:)
      !> Displacements at these positions
      real(wp), allocatable :: displacements(:)
      !> Velocities at these positions
      real(wp), allocatable :: velocities(:)
   end type start_settings_t

contains

   !> Whether the initial displacements or velocities have the shape of a mode of the beam.
   pure logical function is_in_mode(start) result(answer)
      type(start_settings_t), intent(in) :: start

      answer = start%kind == start_mode .or. (start%kind == start_velocity .and. start%field == field_mode)
   end function is_in_mode

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
      integer :: cycles

      period = 0.0_wp
      if (size(frequencies) == 0 .or. which > size(frequencies)) return
      if (which > 0) then
         period = 2.0_wp*pi/frequencies(which)
         return
      end if
      do cycles = 1, max_cycles
         associate (ratio => frequencies*(real(cycles, wp)/minval(frequencies)))
            if (any(abs(ratio - anint(ratio)) > min(rounding*ratio, max_phase_error))) cycle
         end associate
         period = real(cycles, wp)*(2.0_wp*pi/minval(frequencies))
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

end module load_settings
