!> What acts on a beam besides its stops, and how its motion begins.
!>
!> Scales: as in run_settings. Forces in 3 E Ibar D/L^3, those along a stretch in 3 E Ibar D/L^4, accelerations in
!> D omega1^2, velocities in D omega1, with D the unit of displacement.
module load_settings
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: time_course_t, force_settings_t, base_settings_t, start_settings_t
   public :: course_harmonic, course_step, course_pulse, course_table, course_names
   public :: pulse_half_sine, pulse_names
   public :: base_displacement, base_names
   public :: is_in_mode
   public :: start_release, start_rest, start_balance, start_velocity, start_mode, start_table, start_drop, start_names
   public :: field_uniform, field_rotation, field_mode, field_names

   !> amplitude sin(frequency tau + phase)
   integer, parameter :: course_harmonic = 1
   !> amplitude
   integer, parameter :: course_step = 2
   !> amplitude, or half a period of a sine, for a duration
   integer, parameter :: course_pulse = 3
   !> amplitude times a table, linear between its points, nothing outside
   integer, parameter :: course_table = 4

   integer, parameter :: pulse_rectangle = 1
   integer, parameter :: pulse_half_sine = 2

   integer, parameter :: base_acceleration = 1
   !> Of a table: a cubic spline, at rest before and after
   integer, parameter :: base_displacement = 2

   !> At rest, pulled away from a stop by a force there
   integer, parameter :: start_release = 1
   !> At rest and straight
   integer, parameter :: start_rest = 2
   !> At rest under the loads that act at tau = 0, as if they never changed, on the stops that carry it
   integer, parameter :: start_balance = 3
   !> Straight, moving
   integer, parameter :: start_velocity = 4
   !> In the shape of a mode, at rest or moving
   integer, parameter :: start_mode = 5
   !> As a table says, a cubic spline through its points
   integer, parameter :: start_table = 6
   !> Straight, as the base, which has fallen, stops
   integer, parameter :: start_drop = 7

   !> Velocities of a start
   integer, parameter :: field_uniform = 1
   integer, parameter :: field_rotation = 2
   integer, parameter :: field_mode = 3

   !> The constants above as users write them.
   character(*), parameter :: course_names(4) = [character(8) :: 'harmonic', 'step', 'pulse', 'table']
   character(*), parameter :: pulse_names(2) = [character(9) :: 'rectangle', 'half_sine']
   character(*), parameter :: base_names(2) = [character(12) :: 'acceleration', 'displacement']
   character(*), parameter :: start_names(7) = [character(8) :: 'pull', 'rest', 'balance', 'velocity', 'mode', &
      'table', 'drop']
   character(*), parameter :: field_names(3) = [character(8) :: 'uniform', 'rotation', 'mode']

   !> How something goes on in time: zero before its start and after its end.
   type :: time_course_t
      !> One of the `course_` constants
      integer :: kind = course_harmonic
      !> In the scale of what it is of; the factor of a table
      real(wp) :: amplitude = 0.0_wp
      !> Of a harmonic, over omega1
      real(wp) :: frequency = 1.0_wp
      !> Of a harmonic, in radians
      real(wp) :: phase = 0.0_wp
      !> tau; a table's times count from there
      real(wp) :: start = 0.0_wp
      real(wp) :: end = huge(1.0_wp)
      !> Of a pulse, tau
      real(wp) :: duration = 1.0_wp
      !> One of the `pulse_` constants
      integer :: shape = pulse_rectangle
      !> Points of a table: tau, ascending, and values
      real(wp), allocatable :: time(:), value(:)
   end type time_course_t

   !> &force: upwards where positive, at points or along a stretch
   type :: force_settings_t
      type(time_course_t) :: course
      !> x/L of the points, each with the whole force; unallocated: along the stretch
      real(wp), allocatable :: position(:)
      !> x/L of its ends
      real(wp) :: stretch(2) = [0.0_wp, 1.0_wp]
   end type force_settings_t

   !> &base: how the clamp, stops and supports move, upwards where positive
   type :: base_settings_t
      !> `base_acceleration` or `base_displacement`, of which the course tells
      integer :: quantity = base_acceleration
      type(time_course_t) :: course
   end type base_settings_t

   !> &start, relative to the base
   type :: start_settings_t
      !> One of the `start_` constants
      integer :: kind = start_release
      !> One of the `field_` constants, of `start_velocity`
      integer :: field = field_uniform
      !> Upwards, of all points, or of the tip of a rotation or a mode; downwards at the end of a fall
      real(wp) :: velocity = 0.0_wp
      !> Of the tip in a mode
      real(wp) :: displacement = 0.0_wp
      !> Which mode of the free beam
      integer :: mode = 1
      !> A table: x/L, ascending, displacements and velocities there
      real(wp), allocatable :: position(:), displacements(:), velocities(:)
   end type start_settings_t

contains

   !> Does a motion begin in a mode of the beam, displaced or moving?
   pure function is_in_mode(start) result(is)
      type(start_settings_t), intent(in) :: start
      logical :: is

      is = start%kind == start_mode .or. (start%kind == start_velocity .and. start%field == field_mode)
   end function is_in_mode

end module load_settings
