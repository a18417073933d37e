!> What is asked about the frequencies in a motion.
module spectrum_settings
   use kinds, only: pi, wp
   implicit none (type, external)
   private
   public :: spectrum_settings_t, signal_t, signal_table, signal_names, window_names, window_hann, window_rectangle
   public :: quantity_force, quantity_moment

   !> What a signal is made of: a displacement, the force of a contact, a bending moment.
   integer, parameter :: quantity_displacement = 1
   integer, parameter :: quantity_force = 2
   integer, parameter :: quantity_moment = 3

   !> A signal that may be asked for.
   type :: signal_t
      !> As a scene asks for it; its datasets end with it
      character(24) :: name = ''
      !> Of {this~that} this without units, that in units
      character(60) :: meaning = ''
      !> One of `quantity_table`, and that of its power spectral density
      character(24) :: quantity = ''
      character(24) :: density = ''
      !> One of the `quantity_` constants, and how often it is differentiated
      integer :: base = quantity_displacement
      integer :: derivatives = 0
      !> It is of a contact, not of the tip
      logical :: is_of_contact = .false.
      !> Its measure of the strongest line
      character(24) :: measure = ''
   end type signal_t

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
      'strongest_moment')]

   integer, private :: k
   !> As users write them
   character(*), parameter :: signal_names(*) = [(signal_table(k)%name, k=1, size(signal_table))]

   integer, parameter :: window_hann = 1
   integer, parameter :: window_rectangle = 2
   character(*), parameter :: window_names(2) = [character(9) :: 'hann', 'rectangle']

   !> &spectrum
   type :: spectrum_settings_t
      !> Places in `signal_table`; unallocated: the displacement of the tip
      integer, allocatable :: of(:)
      !> Number of the contact that is meant; 0: that from which the beam is released, of forces the sum of all
      integer :: contact = 0
      !> Which of the points of &stress
      integer :: point = 1
      !> Least and greatest frequency, over omega1
      real(wp), allocatable :: range(:)
      !> Frequencies in it, and their distance, over omega1; 0: half of what a segment resolves
      integer :: points = 0
      real(wp) :: resolution = 0.0_wp
      integer :: segments = 8
      !> One of the `window_` constants
      integer :: window = window_hann
      !> What of the run counts, tau; no end: that of the run
      real(wp) :: start = 0.0_wp
      real(wp) :: end = huge(1.0_wp)
      !> Terms times frequencies that are integrated in closed form; what comes after is sampled
      real(wp) :: closed_form_limit = 2.0e10_wp
   contains
      procedure :: count_of
      procedure :: distance_of
      procedure :: segment_of
   end type spectrum_settings_t

contains

   !> Frequencies of a spectrum: as many as are asked for, or as fit at their distance.
   pure function count_of(asked, length) result(number)
      class(spectrum_settings_t), intent(in) :: asked
      !> What of the run counts, tau
      real(wp), intent(in) :: length
      real(wp) :: number

      number = real(asked%points, wp)
      if (asked%points == 0) number = aint((asked%range(2) - asked%range(1))/asked%distance_of(length) &
         *(1.0_wp + 1.0e-12_wp)) + 1.0_wp
   end function count_of

   !> Distance of the frequencies: by default half of what a segment resolves, 2 pi over its length.
   pure function distance_of(asked, length) result(distance)
      class(spectrum_settings_t), intent(in) :: asked
      real(wp), intent(in) :: length
      real(wp) :: distance

      if (asked%points > 1) then
         distance = (asked%range(2) - asked%range(1))/real(asked%points - 1, wp)
      else if (asked%resolution > 0.0_wp) then
         distance = asked%resolution
      else
         distance = pi/asked%segment_of(length)
      end if
   end function distance_of

   !> Length of a segment.
   pure function segment_of(asked, length) result(segment)
      class(spectrum_settings_t), intent(in) :: asked
      real(wp), intent(in) :: length
      real(wp) :: segment

      segment = length/real(asked%segments, wp)
      if (asked%window == window_hann) segment = 2.0_wp*length/real(asked%segments + 1, wp)
   end function segment_of

end module spectrum_settings
