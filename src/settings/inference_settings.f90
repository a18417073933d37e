!> Settings of the analyses of parameters: sensitivities of measures, fits to a measured signal, and uncertainty of
!> measures.
module inference_settings
   use kinds, only: wp
   use sweep_settings, only: parameter_t
   implicit none (type, external)
   private
   public :: sensitivity_settings_t, fit_settings_t, uncertainty_settings_t
   public :: observed_table, observed_acceleration_tip, observed_force, observed_impacts

   !> A quantity that a measured signal may be.
   type :: observed_t
      !> Value of `of` in &fit
      character(24) :: name
      !> The quantity as in `quantity_table`
      character(24) :: quantity
      !> Whether the signal belongs to the tip instead of the stop point
      logical :: is_of_tip = .false.
      !> Whether the signal is discontinuous at impacts
      logical :: jumps = .false.
      !> Whether the signal consists of features, numbered from 1, instead of samples at times
      logical :: is_feature = .false.
   end type observed_t

   type(observed_t), parameter :: observed_table(*) = [ &
      observed_t('displacement_tip', 'displacement', is_of_tip=.true.), &
      observed_t('velocity_tip', 'velocity', is_of_tip=.true., jumps=.true.), &
      observed_t('displacement_stop', 'displacement'), &
      observed_t('velocity_stop', 'velocity', jumps=.true.), &
      observed_t('contact_force', 'force', jumps=.true.), &
      observed_t('acceleration_tip', 'acceleration', is_of_tip=.true., jumps=.true.), &
      observed_t('impact_times', 'time', is_feature=.true.), &
      observed_t('rebound_peaks', 'displacement', is_feature=.true.)]
   integer, parameter :: observed_force = findloc(observed_table%name, 'contact_force', dim=1)
   integer, parameter :: observed_acceleration_tip = findloc(observed_table%name, 'acceleration_tip', dim=1)
   integer, parameter :: observed_impacts = findloc(observed_table%name, 'impact_times', dim=1)

   !> Settings of &sensitivity.
   type :: sensitivity_settings_t
      !> Parameters; unallocated: not given
      type(parameter_t), allocatable :: parameters(:)
      !> Values of the parameters in the scene
      real(wp), allocatable :: values(:)
      !> Indices in `measure_table`; unallocated: all measures that a run of the scene has
      integer, allocatable :: measures(:)
      !> First step of the finite differences, as a fraction of the value
      real(wp) :: step = 0.02_wp
      !> Number of steps, each half of the preceding step
      integer :: steps = 16
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

end module inference_settings
