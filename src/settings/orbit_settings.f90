!> Settings of the search for periodic motions (orbits), and of branches of orbits along which a load varies: &orbit.
module orbit_settings
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: orbit_settings_t, vary_nothing, vary_amplitude, vary_frequency, varied_names

   !> What varies along a branch of periodic motions: nothing (there is no branch), the amplitude or the frequency of a
   !> load
   integer, parameter :: vary_nothing = 1
   integer, parameter :: vary_amplitude = 2
   integer, parameter :: vary_frequency = 3
   character(*), parameter :: varied_names(3) = [character(9) :: 'none', 'amplitude', 'frequency']

   !> Settings of &orbit.
   type :: orbit_settings_t
      !> Period of the orbit in periods of the load; 0: detected from the run
      integer :: periods = 0
      !> Periods of the load that are computed before the search
      integer :: skip = 100
      !> Maximum distance between the states at start and end of the period, relative to the norm of the states, and
      !> maximum number of Newton steps
      real(wp) :: tolerance = 1.0e-10_wp
      integer :: max_steps = 30
      !> One of the `vary_` constants, and the number of the harmonic load that varies; the numbers count &force before
      !> &base
      integer :: varied = vary_nothing
      integer :: load = 1
      !> Minimum and maximum of the varied amplitude or frequency over its value in the scene
      real(wp) :: min_ratio = 0.5_wp
      real(wp) :: max_ratio = 2.0_wp
      !> First and maximum step along a branch, as fractions of the range of the varied value and of the norm of the
      !> states; and maximum number of points of a branch in either direction
      real(wp) :: step = 0.005_wp
      real(wp) :: max_step = 0.02_wp
      integer :: max_points = 500
      !> Maximum number of successive period doublings whose branches are followed
      integer :: doublings = 1
      !> Common period of all loads, tau
      real(wp) :: period = 0.0_wp
   end type orbit_settings_t

end module orbit_settings
