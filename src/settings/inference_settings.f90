!> Settings of the analyses of parameters: sensitivities of measures, fits to a measured signal, and uncertainty of
!> measures.
module inference_settings
   use kinds, only: wp
   use sweep_settings, only: parameter_t
   implicit none (type, external)
   private
   public :: sensitivity_settings_t, fit_settings_t, uncertainty_settings_t, observed_names
   public :: observed_acceleration_tip, observed_force, observed_impacts, is_of_tip, is_velocity, is_feature, jumps
   public :: quantity_observed

   !> Quantities that a measured signal may be, `of` in &fit.
   integer, parameter :: observed_displacement_tip = 1
   integer, parameter :: observed_velocity_tip = 2
   integer, parameter :: observed_displacement_stop = 3
   integer, parameter :: observed_velocity_stop = 4
   integer, parameter :: observed_force = 5
   integer, parameter :: observed_acceleration_tip = 6
   !> Instants of impacts, features of a motion instead of samples, numbered from 1.
   integer, parameter :: observed_impacts = 7
   !> Peak displacements of rebounds, likewise.
   integer, parameter :: observed_peaks = 8
   !> Names of these constants in scene files.
   character(*), parameter :: observed_names(8) = [character(24) :: 'displacement_tip', 'velocity_tip', &
      'displacement_stop', 'velocity_stop', 'contact_force', 'acceleration_tip', 'impact_times', 'rebound_peaks']

   !> Settings of &sensitivity.
   type :: sensitivity_settings_t
      !> Parameters; unallocated: not given
      type(parameter_t), allocatable :: parameters(:)
      !> Values of the parameters in the scene
      real(wp), allocatable :: values(:)
      !> Minimum allowed values
      real(wp), allocatable :: minimum(:)
      !> Maximum allowed values
      real(wp), allocatable :: maximum(:)
      !> Indices in `measure_table`; unallocated: all measures that a run of the scene has
      integer, allocatable :: measures(:)
      !> First step of the finite differences, as a fraction of the value
      real(wp) :: step = 0.02_wp
      !> Number of steps, each half of the preceding one
      integer :: steps = 12
   end type sensitivity_settings_t

   !> Settings of &fit.
   type :: fit_settings_t
      !> Path of the file of the signal as in the scene
      character(:), allocatable :: data
      !> One of the `observed_` constants; 0: not given
      integer :: observed = 0
      !> Column of the times in the file
      integer :: time_column = 1
      !> Column of the values in the file
      integer :: value_column = 2
      !> Column with the standard deviation of the noise of each value; 0: there is none
      integer :: noise_column = 0
      !> Start of the part of the signal that is fitted, in the unit of time of the results
      real(wp) :: start = 0.0_wp
      !> End of that part; `huge`: the end of the run
      real(wp) :: end = huge(1.0_wp)
      !> Standard deviation of the noise, in the unit of the results; 0: estimated from the residuals
      real(wp) :: noise = 0.0_wp
      !> Whether the signal has an unknown offset
      logical :: has_offset = .false.
      !> Whether the signal has an unknown scale factor
      logical :: has_scale = .false.
      !> Maximum delay or advance of the signal relative to the run, in the unit of time of the results; 0: none
      real(wp) :: max_time_shift = 0.0_wp
      !> Maximum number of runs from one start
      integer :: evaluations = 2000
      !> Times (of features: numbers) of the part that is fitted, ascending, in the unit of the results, [samples]
      real(wp), allocatable :: time(:)
      !> Values of that part, in the unit of the results, [samples]
      real(wp), allocatable :: value(:)
      !> Standard deviation of the noise of each value, [samples]; 0: estimated from the residuals
      real(wp), allocatable :: noise_of_value(:)
   end type fit_settings_t

   !> Settings of &uncertainty.
   type :: uncertainty_settings_t
      !> Parameters of the sweep with a normal distribution (lognormal if the range is logarithmic) that has 95 % of its
      !> values in the range; unallocated: none
      type(parameter_t), allocatable :: normal(:)
      !> Path, as in the scene, of the results file of a fit whose estimates and covariance are the distribution of its
      !> parameters; unallocated: none
      character(:), allocatable :: fit
      !> Indices in `measure_table`; unallocated: all measures that a run of the scene has
      integer, allocatable :: measures(:)
      !> Probabilities of the quantiles
      real(wp), allocatable :: quantiles(:)
      !> Number of classes of a histogram
      integer :: classes = 40
   end type uncertainty_settings_t

contains

   !> Whether a signal belongs to the tip instead of the stop point.
   elemental function is_of_tip(observed) result(answer)
      !> One of the `observed_` constants
      integer, intent(in) :: observed
      logical :: answer

      answer = any(observed == [observed_displacement_tip, observed_velocity_tip, observed_acceleration_tip])
   end function is_of_tip

   !> Whether a signal consists of numbered features instead of samples at times.
   elemental function is_feature(observed) result(answer)
      !> One of the `observed_` constants
      integer, intent(in) :: observed
      logical :: answer

      answer = observed == observed_impacts .or. observed == observed_peaks
   end function is_feature

   !> Whether a signal is discontinuous at impacts.
   elemental function jumps(observed)
      !> One of the `observed_` constants
      integer, intent(in) :: observed
      logical :: jumps

      jumps = is_velocity(observed) .or. observed == observed_force .or. observed == observed_acceleration_tip
   end function jumps

   !> Whether a signal is a velocity.
   elemental function is_velocity(observed) result(answer)
      !> One of the `observed_` constants
      integer, intent(in) :: observed
      logical :: answer

      answer = observed == observed_velocity_tip .or. observed == observed_velocity_stop
   end function is_velocity

   !> The quantity of a signal, as in `quantity_table`.
   pure function quantity_observed(observed) result(quantity)
      !> One of the `observed_` constants
      integer, intent(in) :: observed
      character(len(observed_names)) :: quantity

      select case (observed)
      case (observed_displacement_tip, observed_displacement_stop, observed_peaks)
         quantity = 'displacement'
      case (observed_velocity_tip, observed_velocity_stop)
         quantity = 'velocity'
      case (observed_acceleration_tip)
         quantity = 'acceleration'
      case (observed_impacts)
         quantity = 'time'
      case default
         quantity = 'force'
      end select
   end function quantity_observed

end module inference_settings
