!> What is asked about the parameters of a scene: how measures change with them, which of them explain a measured
!> signal, and what their uncertainty makes of measures.
module inference_settings
   use kinds, only: wp
   use sweep_settings, only: parameter_t
   implicit none (type, external)
   private
   public :: sensitivity_settings_t, fit_settings_t, uncertainty_settings_t, observed_names
   public :: observed_acceleration_tip, observed_force, is_of_tip, is_velocity, jumps, quantity_observed

   !> What a measured signal may be.
   integer, parameter :: observed_displacement_tip = 1
   integer, parameter :: observed_velocity_tip = 2
   integer, parameter :: observed_displacement_stop = 3
   integer, parameter :: observed_velocity_stop = 4
   integer, parameter :: observed_force = 5
   integer, parameter :: observed_acceleration_tip = 6
   character(*), parameter :: observed_names(6) = [character(24) :: 'displacement_tip', 'velocity_tip', &
      'displacement_stop', 'velocity_stop', 'contact_force', 'acceleration_tip']

   !> &sensitivity
   type :: sensitivity_settings_t
      !> Parameters; unallocated: not given
      type(parameter_t), allocatable :: parameters(:)
      !> Their values in the scene, and what these may be
      real(wp), allocatable :: values(:)
      real(wp), allocatable :: minimum(:)
      real(wp), allocatable :: maximum(:)
      !> Places in the table of measures; unallocated: all that a run of the scene has
      integer, allocatable :: measures(:)
      !> First step, as a share of the value
      real(wp) :: step = 0.02_wp
      !> Number of steps, each half of the one before
      integer :: steps = 12
   end type sensitivity_settings_t

   !> &fit
   type :: fit_settings_t
      !> File of the signal as the scene names it
      character(:), allocatable :: data
      !> One of the `observed_` constants; 0: not given
      integer :: observed = 0
      !> Columns of the file
      integer :: time_column = 1
      integer :: value_column = 2
      !> Column with the standard deviation of the noise of each value; 0: there is none
      integer :: noise_column = 0
      !> Part of the signal that is fitted, in time as results have it; its end: huge is the end of the run
      real(wp) :: start = 0.0_wp
      real(wp) :: end = huge(1.0_wp)
      !> Standard deviation of the noise, in units of results; 0: it follows from the residuals
      real(wp) :: noise = 0.0_wp
      !> The signal has an unknown zero, an unknown scale, and its time differs from that of the run by at most this; 0:
      !> not at all
      logical :: has_offset = .false.
      logical :: has_scale = .false.
      real(wp) :: time_shift = 0.0_wp
      !> Most runs from one start
      integer :: evaluations = 2000
      !> The part that is fitted, in units of results, ascending in time
      real(wp), allocatable :: time(:)
      real(wp), allocatable :: value(:)
      !> Standard deviation of the noise of each value; 0: it follows from the residuals
      real(wp), allocatable :: noise_of_value(:)
   end type fit_settings_t

   !> &uncertainty
   type :: uncertainty_settings_t
      !> Parameters of the sweep that are distributed normally, or where a range is logarithmic lognormally, with 95 %
      !> of the values in their range; unallocated: none
      type(parameter_t), allocatable :: normal(:)
      !> Results file of a fit whose estimates and covariance count, as the scene names it; unallocated: none
      character(:), allocatable :: fit
      !> Places in the table of measures; unallocated: all that a run of the scene has
      integer, allocatable :: measures(:)
      !> Probabilities of the quantiles
      real(wp), allocatable :: quantiles(:)
      !> Classes of a histogram
      integer :: classes = 40
   end type uncertainty_settings_t

contains

   !> Is a signal of the tip, not of the stop point?
   elemental function is_of_tip(observed) result(is)
      !> One of the `observed_` constants
      integer, intent(in) :: observed
      logical :: is

      is = any(observed == [observed_displacement_tip, observed_velocity_tip, observed_acceleration_tip])
   end function is_of_tip

   !> Does a signal jump at impacts?
   elemental function jumps(observed)
      !> One of the `observed_` constants
      integer, intent(in) :: observed
      logical :: jumps

      jumps = is_velocity(observed) .or. observed == observed_force .or. observed == observed_acceleration_tip
   end function jumps

   !> Is a signal a velocity?
   elemental function is_velocity(observed) result(is)
      !> One of the `observed_` constants
      integer, intent(in) :: observed
      logical :: is

      is = observed == observed_velocity_tip .or. observed == observed_velocity_stop
   end function is_velocity

   !> The quantity of a signal, as in `quantity_table`.
   pure function quantity_observed(observed) result(quantity)
      !> One of the `observed_` constants
      integer, intent(in) :: observed
      character(len(observed_names)) :: quantity

      select case (observed)
      case (observed_displacement_tip, observed_displacement_stop)
         quantity = 'displacement'
      case (observed_velocity_tip, observed_velocity_stop)
         quantity = 'velocity'
      case (observed_acceleration_tip)
         quantity = 'acceleration'
      case default
         quantity = 'force'
      end select
   end function quantity_observed

end module inference_settings
