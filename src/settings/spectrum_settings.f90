!> Settings of &spectrum, and the table of signals of which a spectrum can be computed.
module spectrum_settings
   use kinds, only: pi, wp
   implicit none (type, external)
   private
   public :: spectrum_settings_t, signal_t, signal_table, signal_names, window_names, window_hann, window_rectangle
   public :: quantity_force, quantity_moment

   !> A signal is a displacement or its derivative with respect to time.
   integer, parameter :: quantity_displacement = 1
   !> A signal is a contact force.
   integer, parameter :: quantity_force = 2
   !> A signal is a bending moment.
   integer, parameter :: quantity_moment = 3

   !> A signal of which a spectrum can be computed.
   type :: signal_t
      !> Name in scenes, and last part of the names of datasets
      character(24) :: name = ''
      !> Meaning; of {this~that}, `this` is printed in dimensionless results and `that` in results with units
      character(60) :: meaning = ''
      !> Name of its quantity in `quantity_table`
      character(24) :: quantity = ''
      !> Name of the quantity of its power spectral density
      character(24) :: density = ''
      !> Quantity of which the signal is a derivative with respect to time: one of the `quantity_` constants
      integer :: base = quantity_displacement
      !> Order of the derivative
      integer :: derivatives = 0
      !> Whether the signal belongs to a contact instead of the tip
      logical :: is_of_contact = .false.
      !> Name of the measure with the amplitude of its strongest line
      character(24) :: measure = ''
      !> Whether the signal belongs to a recorded point, that of a body, instead of the tip
      logical :: is_of_point = .false.
   end type signal_t

   !> All signals.
   type(signal_t), parameter :: signal_table(*) = [ &
      signal_t('displacement_tip', 'displacement of the tip{, eta}', 'displacement', 'displacement_density', &
      quantity_displacement, 0, .false., 'strongest_line'), &
      signal_t('displacement_stop', 'displacement of the beam at the stop{, eta}', 'displacement', &
      'displacement_density', quantity_displacement, 0, .true., 'strongest_line'), &
      signal_t('velocity_tip', 'velocity of the tip', 'velocity', 'velocity_density', quantity_displacement, 1, &
      .false., 'strongest_velocity'), &
      signal_t('velocity_stop', 'velocity of the beam at the stop', 'velocity', 'velocity_density', &
      quantity_displacement, 1, .true., 'strongest_velocity'), &
      signal_t('acceleration_tip', 'acceleration of the tip', 'acceleration', 'acceleration_density', &
      quantity_displacement, 2, .false., 'strongest_acceleration'), &
      signal_t('acceleration_stop', 'acceleration of the beam at the stop', 'acceleration', 'acceleration_density', &
      quantity_displacement, 2, .true., 'strongest_acceleration'), &
      signal_t('contact_force', 'contact force{ Pbar}', 'force', 'force_density', quantity_force, 0, .true., &
      'strongest_force'), &
      signal_t('moment', 'bending moment', 'moment', 'moment_density', quantity_moment, 0, .false., &
      'strongest_moment'), &
      signal_t('displacement_body', 'displacement of the body', 'displacement', 'displacement_density', &
      quantity_displacement, 0, .false., 'strongest_line', is_of_point=.true.), &
      signal_t('velocity_body', 'velocity of the body', 'velocity', 'velocity_density', quantity_displacement, 1, &
      .false., 'strongest_velocity', is_of_point=.true.), &
      signal_t('acceleration_body', 'acceleration of the body', 'acceleration', 'acceleration_density', &
      quantity_displacement, 2, .false., 'strongest_acceleration', is_of_point=.true.), &
      signal_t('force_body', 'sum of the contact forces on the body{, Pbar}, up', 'force', 'force_density', &
      quantity_force, 0, .false., 'strongest_force', is_of_point=.true.)]

   integer, private :: k
   !> Names of the signals in scenes
   character(*), parameter :: signal_names(*) = [(signal_table(k)%name, k=1, size(signal_table))]

   !> Window functions by which segments are multiplied, and their names in scenes: Hann, or none.
   integer, parameter :: window_hann = 1
   integer, parameter :: window_rectangle = 2
   character(*), parameter :: window_names(2) = [character(9) :: 'hann', 'rectangle']

   !> Settings of &spectrum.
   type :: spectrum_settings_t
      !> Indices of the signals in `signal_table`; unallocated: displacement of the tip
      integer, allocatable :: of(:)
      !> Number of the contact of the signals; 0: the release contact, for forces the sum over all contacts
      integer :: contact = 0
      !> Index of the point of &stress at which bending moments are taken
      integer :: point = 1
      !> Index of the recorded point of the signals of a body: the number of the &body
      integer :: recorded_point = 1
      !> Minimum and maximum frequency, over omega1
      real(wp), allocatable :: range(:)
      !> Number of frequencies; 0: `resolution` is given
      integer :: points = 0
      !> Spacing of the frequencies over omega1; if both values are 0, half the resolution of a segment
      real(wp) :: resolution = 0.0_wp
      !> Number of segments
      integer :: segments = 8
      !> One of the `window_` constants
      integer :: window = window_hann
      !> Start of the part of the run that is transformed, tau
      real(wp) :: start = 0.0_wp
      !> End of that part, tau; `huge`: the end of the run
      real(wp) :: end = huge(1.0_wp)
      !> Maximum number of integrals in closed form (terms times frequencies times signals); the rest of the motion is
      !> sampled
      real(wp) :: closed_form_limit = 2.0e10_wp
   contains
      procedure :: frequency_count
      procedure :: frequency_spacing
      procedure :: segment_length
   end type spectrum_settings_t

contains

   !> Number of frequencies of a spectrum: the number in the scene, or the number that follows from their spacing.
   pure real(wp) function frequency_count(settings, length) result(number)
      class(spectrum_settings_t), intent(in) :: settings
      !> Length of the part of the run that is transformed, tau
      real(wp), intent(in) :: length

      number = real(settings%points, wp)
      if (settings%points == 0) number = aint((settings%range(2) - &
         settings%range(1))/settings%frequency_spacing(length) &
         *(1.0_wp + 1.0e-12_wp)) + 1.0_wp
   end function frequency_count

   !> Spacing of the frequencies over omega1: by default half the resolution of a segment, 2 pi over its length.
   pure real(wp) function frequency_spacing(settings, length) result(spacing)
      class(spectrum_settings_t), intent(in) :: settings
      !> Length of the part of the run that is transformed, tau
      real(wp), intent(in) :: length

      if (settings%points > 1) then
         spacing = (settings%range(2) - settings%range(1))/real(settings%points - 1, wp)
      else if (settings%resolution > 0.0_wp) then
         spacing = settings%resolution
      else
         spacing = pi/settings%segment_length(length)
      end if
   end function frequency_spacing

   !> Length of a segment, tau; segments of Hann windows overlap by half.
   pure real(wp) function segment_length(settings, length) result(segment)
      class(spectrum_settings_t), intent(in) :: settings
      !> Length of the part of the run that is transformed, tau
      real(wp), intent(in) :: length

      segment = length/real(settings%segments, wp)
      if (settings%window == window_hann) segment = 2.0_wp*length/real(settings%segments + 1, wp)
   end function segment_length

end module spectrum_settings
