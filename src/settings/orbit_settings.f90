!> What is asked about periodic motions.
module orbit_settings
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: orbit_settings_t, vary_nothing, vary_amplitude, vary_frequency, varied_names

   integer, parameter :: vary_nothing = 1
   integer, parameter :: vary_amplitude = 2
   integer, parameter :: vary_frequency = 3
   character(*), parameter :: varied_names(3) = [character(9) :: 'none', 'amplitude', 'frequency']

   !> &orbit
   type :: orbit_settings_t
      !> Periods of the load after which the motion returns; 0: those that are found
      integer :: periods = 0
      !> Periods that run before
      integer :: skip = 100
      !> How near it must return, in units of its size, and in how many steps
      real(wp) :: tolerance = 1.0e-10_wp
      integer :: most_steps = 30
      !> One of the `vary_` constants: what a branch goes over, and of which harmonic load, forces first
      integer :: varied = vary_nothing
      integer :: load = 1
      !> From and to what share of its value in the scene
      real(wp) :: lowest_ratio = 0.5_wp
      real(wp) :: greatest_ratio = 2.0_wp
      !> First and greatest step along a branch, as shares of the range, and the most points of one
      real(wp) :: step = 0.005_wp
      real(wp) :: greatest_step = 0.02_wp
      integer :: most_points = 500
      !> How often branches leave from where the period doubles
      integer :: doublings = 1
      !> Common period of all loads, tau
      real(wp) :: period = 0.0_wp
   end type orbit_settings_t

end module orbit_settings
