!> Settings of the search for periodic motions (orbits), and of branches of orbits along which a load varies: &orbit.
module orbit_settings
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: orbit_settings_t, vary_nothing, vary_amplitude, vary_frequency, varied_names

   !> Nothing varies: only the orbit itself is found, without a branch of periodic motions.
   integer, parameter :: vary_nothing = 1
   !> The amplitude of a load varies along the branch.
   integer, parameter :: vary_amplitude = 2
   !> The frequency of a load varies along the branch.
   integer, parameter :: vary_frequency = 3
   !> Names of the `vary_` constants in scene files.
   character(*), parameter :: varied_names(3) = [character(9) :: 'none', 'amplitude', 'frequency']

   !> Settings of &orbit.
   type :: orbit_settings_t
      !> Period of the orbit in periods of the load; 0: detected from the run
      integer :: periods = 0
      !> Periods of the load that are computed before the search
      integer :: skip = 100
      !> Maximum distance between the states at start and end of the period, relative to the norm of the states
      real(wp) :: tolerance = 1.0e-10_wp
      !> Maximum number of Newton steps
      integer :: max_steps = 30
      !> What varies: one of the `vary_` constants
      integer :: varied = vary_nothing
      !> Number of the harmonic load that varies; the numbers count &force before &base
      integer :: load = 1
      !> Minimum of the varied amplitude or frequency over its value in the scene
      real(wp) :: min_ratio = 0.5_wp
      !> Maximum of the varied amplitude or frequency over its value in the scene
      real(wp) :: max_ratio = 2.0_wp
      !> First step along a branch, as a fraction of the range of the varied value and of the norm of the states
      real(wp) :: step = 0.005_wp
      !> Maximum step along a branch, in the same unit as `step`
      real(wp) :: max_step = 0.02_wp
      !> Maximum number of points of a branch in either direction
      integer :: max_points = 500
      !> Maximum number of successive period doublings whose branches are followed
      integer :: doublings = 1
      !> Common period of all loads, tau
      real(wp) :: period = 0.0_wp
   end type orbit_settings_t

end module orbit_settings
