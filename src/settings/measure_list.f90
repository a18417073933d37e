!> Measures, the scalar results of a run: one table entry for each measure. The columns of sweeps, the datasets of
!> results files and the lines on the console follow from this table; `row_of` in `run_measures` computes the values of
!> a run, in the order of the table (a row).
module measure_list
   use kinds, only: wp
   use number_text, only: to_text
   implicit none (type, external)
   private
   public :: measure_table, measure_count, measure_named, measure_status, measure_settling, peak_count, first_peak, &
      first_statistic, former_names, formerly_named, measure_of_word, measure_words
   public :: force_window, measure_decay, measure_force, measure_mean_force, measure_tolerance
   public :: contact_owner_t, contact_name
   public :: measured_groups, likewise_measured, owner_of, statistics_of_stop, first_of_stops, demand_of

   !> A measure.
   type :: measure_t
      !> Name of the column in a sweep
      character(32) :: name
      !> The name if the results file of one run or of &cases has a dataset of the measure, else empty
      character(32) :: run_name
      !> Meaning; `{this~that}` marks two versions of a text: `this` is printed in dimensionless results, `that` in
      !> results with units; without ~, `that` is empty
      character(160) :: meaning
      !> Name of the physical quantity in `quantity_table`
      character(24) :: quantity
      !> Whether the values are whole numbers
      logical :: is_whole
      !> Label of the line on the console; empty: the measure is not printed
      character(24) :: label = ''
      !> Text between the label and the number, such as 'at tau =' before an instant; empty: the number follows the
      !> label. If a whole number has such a text, 0 means that none was found
      character(16) :: lead = ''
      !> Whether each contact of a run with several contacts has its own value
      logical :: is_of_contact = .false.
      !> Group that a scene must have for this measure; empty: every scene has the measure
      character(12) :: group = ''
   end type measure_t

   !> Number of stops that have measures of their own.
   integer, parameter :: measured_stops = 6
   !> Number of bodies that have measures of their own.
   integer, parameter :: measured_bodies = 3
   !> Number of groups of such measures: of each stop, of each body, of floor and ceiling of each body.
   integer, parameter :: measured = measured_stops + 2*measured_bodies
   !> Groups of these measures: stops, contacts of bodies with the beam, floors and ceilings of bodies
   character(7), parameter :: measured_groups(measured) = [character(7) :: 'stop_1', 'stop_2', 'stop_3', 'stop_4', &
      'stop_5', 'stop_6', 'body_1', 'body_2', 'body_3', 'floor_1', 'floor_2', 'floor_3']
   !> Words after the meaning of a measure of the first of these groups
   character(*), parameter :: likewise_measured = '; likewise '//trim(measured_groups(2))//' to ' &
      //trim(measured_groups(measured_stops))//', '//trim(measured_groups(measured_stops + 1))//' to ' &
      //trim(measured_groups(measured_stops + measured_bodies))//', '//trim(measured_groups(measured_stops &
      + measured_bodies + 1))//' to '//trim(measured_groups(measured))
   ! the groups in words
   character(28), parameter :: group_words(measured) = [character(28) :: 'stop 1', 'stop 2', 'stop 3', 'stop 4', &
      'stop 5', 'stop 6', 'body 1', 'body 2', 'body 3', 'floor or ceiling of body 1', 'floor or ceiling of body 2', &
      'floor or ceiling of body 3']
   !> Statistics of each of several stops and bodies, both sides together; their names end with the group
   type(measure_t), parameter :: statistics_of_stop(*) = [ &
      measure_t('contact_share', '', 'share of time in contact at', 'number', .false.), &
      measure_t('mean_force', '', 'mean force, impulses included, at', 'force', .false.), &
      measure_t('rms_force', '', 'RMS force, none with restitution, at', 'force', .false.), &
      measure_t('impact_rate', '', 'impacts over time at', 'rate', .false.), &
      measure_t('mean_impact_velocity', '', 'mean velocity with which impacts begin at', 'velocity', .false.), &
      measure_t('maximum_impact_velocity', '', 'maximum velocity with which impacts begin at', 'velocity', .false.), &
      measure_t('mean_impulse', '', 'mean impulse of an impact at', 'impulse', .false.), &
      measure_t('work_rate', '', 'mean power that is dissipated at', 'power', .false.)]
   ! indices of the implied loops below
   integer, private :: i, k
   ! texts of these measures, as constants of the declared length, because gfortran 12 does not convert the length of
   ! expressions within a table
   character(32), parameter :: stop_names(size(statistics_of_stop), measured) = reshape([character(32) :: &
      ((trim(statistics_of_stop(i)%name)//'_'//measured_groups(k), i=1, size(statistics_of_stop)), &
      k=1, measured)], shape(stop_names))
   character(160), parameter :: stop_meanings(size(statistics_of_stop), measured) = reshape([character(160) :: &
      ((trim(statistics_of_stop(i)%meaning)//' '//group_words(k), i=1, size(statistics_of_stop)), &
      k=1, measured)], shape(stop_meanings))

   !> All measures, in the order of rows and results files.
   type(measure_t), parameter :: measure_table(*) = [ &
      measure_t('status', '', '0: done, 1: failed, the reason is in failure_reason', 'number', .true.), &
      measure_t('impacts', 'impacts', 'impacts on rigid stops, contacts with compliant ones, without one ' &
      //'that is closed at the start', 'number', .true., 'impacts', is_of_contact=.true.), &
      measure_t('contacts', '', 'contacts of finite duration', 'number', .true., 'contacts', is_of_contact=.true.), &
      measure_t('rebounds', '', 'flights that rise above {eta = 0.02~0.02 of the unit of displacement}', 'number', &
      .true.), &
      measure_t('first_impact_time', 'first_impact_time', 'instant at which an open contact first closes', &
      'time', .false., 'first impact', 'at {tau~t} =', is_of_contact=.true.), &
      measure_t('first_impact_velocity', 'first_impact_velocity', &
      '{d eta/d tau~velocity} at the stop point before it, upwards', 'velocity', .false., 'velocity before it', &
      is_of_contact=.true.), &
      measure_t('greatest_force', 'greatest_force', 'maximum contact force{ Pbar}; not defined for a rigid stop, ' &
      //'where it has no limit in the mesh', 'force', .false., 'maximum force', is_of_contact=.true.), &
      measure_t('greatest_mean_force', 'greatest_mean_force', 'of a rigid stop, the maximum mean contact ' &
      //'force{, Pbar,} over the first 0.1 {of tau~/ omega1} of an episode', 'force', .false., 'mean force', &
      is_of_contact=.true.), &
      measure_t('greatest_impulse', 'greatest_impulse', &
      'maximum impulse of an episode, between flights above 0.02{~ of the unit of displacement}, less that of the ' &
      //'force at rest', 'impulse', &
      .false., is_of_contact=.true.), &
      measure_t('total_contact', 'total_contact', 'time in contact', 'time', .false., 'time in contact', &
      is_of_contact=.true.), &
      measure_t('longest_contact', 'longest_contact', 'longest contact', 'time', .false., 'longest contact', &
      is_of_contact=.true.), &
      measure_t('peak_1', '', 'greatest distance from the surface in the first rebound{, eta}', 'displacement', &
      .false.), &
      measure_t('peak_2', '', 'greatest distance from the surface in the second rebound', 'displacement', .false.), &
      measure_t('peak_3', '', 'greatest distance from the surface in the third rebound', 'displacement', .false.), &
      measure_t('peak_4', '', 'greatest distance from the surface in the fourth rebound', 'displacement', .false.), &
      measure_t('peak_5', '', 'greatest distance from the surface in the fifth rebound', 'displacement', .false.), &
      measure_t('settling_time', 'settling_time', 'instant after which {|eta_c|~the stop point} stays within 0.02' &
      //'{~ of the unit of displacement} of the surface; nan: it does not', 'time', .false., &
      'settling time, 2 %', 'at {tau~t} ='), &
      measure_t('spent_time', 'spent_time', &
      'instant at which the energy above rest has fallen to 1 percent; nan: it has not', &
      'time', .false., 'energy below 1 %', 'after {tau~t} ='), &
      measure_t('lost_beam', 'lost_beam', "share of the start's energy above rest that the beam dissipated", 'number', &
      .false.), &
      measure_t('lost_stop', 'lost_stop', "share of the start's energy above rest that the stop dissipated", 'number', &
      .false.), &
      measure_t('lost_impact', 'lost_impact', "share of the start's energy above rest that impacts dissipated", &
      'number', .false.), &
      measure_t('created', 'created', "energy that impulse = 'nodal' creates at impacts, over the start's energy " &
      //'above rest', 'number', .false.), &
      measure_t('left', 'left', "share of the start's energy above rest that is left at the end", 'number', .false.), &
      measure_t('greatest_moment', 'greatest_moment', 'maximum bending moment at the places of &stress, in magnitude' &
      //'{, Pbar L}', 'moment', .false., group='stress'), &
      measure_t('greatest_stress', 'greatest_stress', 'maximum stress at the outer fibre at the places of ' &
      //'&stress, in magnitude{, in E D/L}', 'stress', .false., 'maximum stress', group='stress'), &
      measure_t('greatest_stress_time', 'greatest_stress_time', 'instant of the maximum stress', 'time', .false., &
      'reached', &
      'at {tau~t} =', group='stress'), &
      measure_t('greatest_stress_position', 'greatest_stress_position', 'place of the maximum stress{, x/L}', &
      'length', .false., &
      'and at', '{x/L~x} =', group='stress'), &
      measure_t('stress_range', 'stress_range', 'maximum less minimum stress of a place, the maximum of all places: ' &
      //'twice an amplitude of fatigue{, in E D/L}', 'stress', .false., 'range of stress', group='stress'), &
      measure_t('extremes_tolerance', 'extremes_tolerance', 'part of themselves within which peaks and extremes are ' &
      //'certain, if it is more than 1e-6', 'number', .false., group='stress'), &
      measure_t('minimum_moment', 'minimum_moment', 'minimum bending moment within the window of &statistics, of all ' &
      //'places of &stress{, Pbar L}', 'moment', .false., group='steady'), &
      measure_t('maximum_moment', 'maximum_moment', 'maximum bending moment within the window of &statistics, of all ' &
      //'places of &stress{, Pbar L}', 'moment', .false., &
      group='steady'), &
      measure_t('moment_range', 'moment_range', 'maximum less minimum moment of a place within the window of ' &
      //'&statistics, the maximum of all places{, Pbar L}', 'moment', .false., group='steady'), &
      measure_t('minimum_stress', 'minimum_stress', 'minimum stress at the outer fibre below the axis within the ' &
      //'window of &statistics, of all places{, in E D/L}', 'stress', .false., 'minimum, steady', group='steady'), &
      measure_t('maximum_stress', 'maximum_stress', 'maximum stress at the outer fibre below the axis within the ' &
      //'window of &statistics, of all places{, in E D/L}', 'stress', .false., &
      'maximum, steady', group='steady'), &
      measure_t('steady_stress_range', 'steady_stress_range', 'maximum less minimum stress of a place within the ' &
      //'window of &statistics, the maximum of all places{, in E D/L}', 'stress', .false., &
      'range, steady', group='steady'), &
      measure_t('stress_cycles', 'stress_cycles', 'cycles of the stress by rainflow counting, half cycles included, ' &
      //'at the place of equivalent_range', 'number', .false., 'stress cycles', group='fatigue'), &
      measure_t('equivalent_range', 'equivalent_range', 'range of as many equal cycles that do the same damage, the ' &
      //'maximum of all places{, in E D/L}', 'stress', .false., 'equivalent range', group='fatigue'), &
      measure_t('mesh_elements', '', 'elements of the mesh', 'number', .true.), &
      measure_t('bounces', 'bounces', 'openings of the contact after its first closing, but for those below ' &
      //'shortest_opening of &relay', 'number', &
      .true., 'bounces', is_of_contact=.true., group='relay'), &
      measure_t('bounce_time', 'bounce_time', 'from the first closing (of a contact closed at the start, that ' &
      //'after its first opening) to the final one; nan: it is open at the end', 'time', .false., 'bounce time', &
      is_of_contact=.true., group='relay'), &
      measure_t('last_opening', 'last_opening', 'instant of the last of the bounces; nan: there is none', 'time', &
      .false., 'last opening', 'at {tau~t} =', is_of_contact=.true., group='relay'), &
      measure_t('final_closing', 'final_closing', 'instant from which the contact is closed to the end of the run; ' &
      //'nan: it is open at the end', 'time', .false., 'closed to the end', 'from {tau~t} =', is_of_contact=.true., &
      group='relay'), &
      measure_t('minimum_force_closed', 'minimum_force_closed', 'minimum contact force{ Pbar} after the maximum that ' &
      //'follows the final closing; a rigid contact has none', 'force', .false., 'minimum force then', &
      is_of_contact=.true., group='relay'), &
      measure_t('static_force', 'static_force', 'contact force{ Pbar} in static equilibrium; nan: loads act', 'force', &
      .false., 'static force', is_of_contact=.true., group='relay'), &
      measure_t('force_lasts', 'force_lasts', 'instant from which the contact force stays at least lasting_force; ' &
      //'nan: it does not', 'time', .false., 'the force lasts', 'from {tau~t} =', is_of_contact=.true., &
      group='relay'), &
      measure_t('motion_period', 'motion_period', &
      'period of the motion in periods of the load, from sections; 0: none was found', 'number', .true., &
      'repeats after', 'load periods:', group='poincare'), &
      measure_t('impacts_per_period', 'impacts_per_period', &
      'impacts in a period of the load, over that of the motion or, where none was found, over all sections kept', &
      'number', .false., 'impacts a period', 'from sections:', group='poincare'), &
      measure_t('lyapunov_exponent', 'lyapunov_exponent', &
      'maximum Lyapunov exponent: rate at which motions that begin side by side separate, from the first section to ' &
      //'the last', &
      'rate', .false., 'Lyapunov exponent', group='poincare'), &
      measure_t('strongest_frequency', 'strongest_frequency', '{omega over omega1~frequency} of the strongest line ' &
      //'in the first spectrum', 'frequency', .false., 'strongest line', 'at {omega~f} =', group='spectrum'), &
      measure_t('strongest_line', 'strongest_line', 'maximum amplitude in the first spectrum of a displacement', &
      'displacement', .false., 'with amplitude', group='spectrum'), &
      measure_t('strongest_velocity', 'strongest_velocity', 'maximum amplitude in the first spectrum of a ' &
      //'velocity', 'velocity', .false., &
      'strongest velocity', group='spectrum'), &
      measure_t('strongest_acceleration', 'strongest_acceleration', 'maximum amplitude in the first spectrum ' &
      //'of an acceleration', 'acceleration', &
      .false., 'maximum in accel.', group='spectrum'), &
      measure_t('strongest_force', 'strongest_force', 'maximum amplitude in the first spectrum of a contact ' &
      //'force{, Pbar}', 'force', .false., &
      'strongest in force', group='spectrum'), &
      measure_t('strongest_moment', 'strongest_moment', 'maximum amplitude in the first spectrum of a bending ' &
      //'moment{, Pbar L}', 'moment', &
      .false., 'strongest in moment', group='spectrum'), &
      ((measure_t(stop_names(i, k), stop_names(i, k), stop_meanings(i, k), statistics_of_stop(i)%quantity, .false., &
      group=measured_groups(k)), i=1, size(statistics_of_stop)), k=1, measured), &
      measure_t('mean_force', '', 'mean force, which is the impulse over the time, that of impacts included', &
      'force', .false., group='statistics'), &
      measure_t('rms_force', '', 'RMS force, of all contacts the root of the sum of squares; none with restitution', &
      'force', .false., group='statistics'), &
      measure_t('maximum_force', '', 'maximum force; with restitution there is none', &
      'force', .false., group='statistics'), &
      measure_t('minimum_force', '', 'minimum force, 0 if the contact opens; with restitution there is none', &
      'force', .false., group='statistics'), &
      measure_t('force_range', '', 'maximum less minimum force', 'force', .false., group='statistics'), &
      measure_t('mean_contact_force', '', 'mean force over the time in contact, without impulses', &
      'force', .false., group='statistics'), &
      measure_t('rms_contact_force', '', 'RMS force over the time in contact; with restitution there is none', &
      'force', .false., group='statistics'), &
      measure_t('impact_rate', '', 'impacts over time', 'rate', .false., group='statistics'), &
      measure_t('mean_impact_velocity', '', 'mean velocity with which impacts begin', &
      'velocity', .false., group='statistics'), &
      measure_t('maximum_impact_velocity', '', 'maximum velocity with which impacts begin', 'velocity', &
      .false., group='statistics'), &
      measure_t('mean_impulse', '', 'mean impulse of an impact, with those that belong to it; of one that ' &
      //'lasts at the end until then', &
      'impulse', .false., group='statistics'), &
      measure_t('maximum_impulse', '', 'maximum impulse of an impact; of one that lasts at the end until then', &
      'impulse', .false., group='statistics'), &
      measure_t('contact_time', '', 'time in contact', 'time', .false., group='statistics'), &
      measure_t('contact_share', '', 'share of time in contact', 'number', .false., group='statistics'), &
      measure_t('work_rate', '', 'mean power that is dissipated at the stop, by dampers and at impacts', &
      'power', .false., group='statistics'), &
      measure_t('mean_displacement', '', 'mean displacement of the stop point, up from the unstressed beam', &
      'displacement', .false., group='statistics'), &
      measure_t('rms_displacement', '', 'RMS displacement of the stop point, up from the unstressed beam', &
      'displacement', .false., group='statistics'), &
      measure_t('minimum_displacement', '', 'minimum displacement of the stop point, up from the unstressed beam', &
      'displacement', .false., group='statistics'), &
      measure_t('maximum_displacement', '', 'maximum displacement of the stop point, up from the unstressed beam', &
      'displacement', .false., group='statistics'), &
      measure_t('rms_acceleration', '', 'RMS acceleration of the stop point, without impulses; asked for with ' &
      //'acceleration', 'acceleration', .false., group='statistics'), &
      measure_t('minimum_acceleration', '', 'minimum acceleration of the stop point', 'acceleration', .false., &
      group='statistics'), &
      measure_t('maximum_acceleration', '', 'maximum acceleration of the stop point', 'acceleration', .false., &
      group='statistics'), &
      measure_t('displacement_range', '', 'maximum less minimum displacement of the stop point', 'displacement', &
      .false., group='statistics'), &
      measure_t('mean_tip', '', 'mean displacement of the tip, up from the unstressed beam', &
      'displacement', .false., group='statistics'), &
      measure_t('rms_tip', '', 'RMS displacement of the tip, up from the unstressed beam', &
      'displacement', .false., group='statistics'), &
      measure_t('minimum_tip', '', 'minimum displacement of the tip, up from the unstressed beam', &
      'displacement', .false., group='statistics'), &
      measure_t('maximum_tip', '', 'maximum displacement of the tip, up from the unstressed beam', &
      'displacement', .false., group='statistics'), &
      measure_t('rms_tip_acceleration', '', 'RMS acceleration of the tip, without impulses; asked for with ' &
      //'acceleration', 'acceleration', .false., group='statistics'), &
      measure_t('minimum_tip_acceleration', '', 'minimum acceleration of the tip', 'acceleration', .false., &
      group='statistics'), &
      measure_t('maximum_tip_acceleration', '', 'maximum acceleration of the tip', 'acceleration', .false., &
      group='statistics'), &
      measure_t('tip_range', '', 'maximum less minimum displacement of the tip', 'displacement', .false., &
      group='statistics')]

   integer, parameter :: measure_count = size(measure_table)
   !> Index of the status of a case.
   integer, parameter :: measure_status = findloc(measure_table%name, 'status', dim=1)
   !> Index of the settling time.
   integer, parameter :: measure_settling = findloc(measure_table%name, 'settling_time', dim=1)
   !> Index of the tolerance of extremes.
   integer, parameter :: measure_tolerance = findloc(measure_table%name, 'extremes_tolerance', dim=1)
   !> Index of the instant from which the energy counts as decayed.
   integer, parameter :: measure_decay = findloc(measure_table%name, 'spent_time', dim=1)
   !> Former names of measures, which scenes may still use, and the indices of these measures
   character(*), parameter :: former_names(5) = [character(32) :: 'first_impact_tau', 'quiet_tau', 'quiet_time', &
      'spent_tau', 'greatest_stress_tau']
   integer, parameter :: formerly_named(5) = [findloc(measure_table%name, 'first_impact_time', dim=1), &
      measure_settling, measure_settling, measure_decay, findloc(measure_table%name, 'greatest_stress_time', dim=1)]
   !> Words by which scenes name measures: all measures but the status of a case, and former names
   character(*), parameter :: measure_words(*) = [measure_table(measure_status + 1:)%name, former_names]
   !> Index in `measure_table` of the measure that each of these words names
   integer, parameter :: measure_of_word(*) = [(k, k=measure_status + 1, measure_count), formerly_named]
   !> Index of the first statistical measure; all measures after this index belong to &statistics too
   integer, parameter :: first_statistic = findloc(measure_table%group, 'statistics', dim=1)
   !> Index of the maximum contact force.
   integer, parameter :: measure_force = findloc(measure_table%name, 'greatest_force', dim=1)
   !> Index of the maximum mean force of a rigid stop over `force_window`.
   integer, parameter :: measure_mean_force = findloc(measure_table%name, 'greatest_mean_force', dim=1)
   !> Length of the time from the beginning of an episode over which the mean force is taken, tau
   real(wp), parameter :: force_window = 0.1_wp
   !> Index of the peak of the first rebound; those of the further rebounds follow
   integer, parameter :: first_peak = findloc(measure_table%name, 'peak_1', dim=1)
   !> Index of the first statistic of stop 1; all statistics of a group are followed by those of the next group
   integer, parameter :: first_of_stops = findloc(measure_table%group, 'stop_1', dim=1)
   !> Number of rebounds (flights above the settling level) whose peak displacements are measures
   integer, parameter :: peak_count = count(index(measure_table%name, 'peak_') == 1)

   !> The stop or body to which a contact belongs.
   type :: contact_owner_t
      !> Number of its &stop; 0: the contact belongs to a &body
      integer :: stop = 1
      !> Number of its &body; 0: the contact belongs to a &stop
      integer :: body = 0
      !> Whether the contact is that of the body with its floor or ceiling instead of the beam
      logical :: is_of_base = .false.
      !> Side: 1 below the beam or the body, -1 above it
      integer :: sign = 1
      !> Index in `measured_groups` of the stop or body, 0: none
      integer :: owner = 0
   end type contact_owner_t

contains

   !> Index of a measure in the table; 0: no measure has this name.
   pure integer function measure_named(name)
      character(*), intent(in) :: name

      measure_named = findloc(measure_table%name, name, dim=1)
   end function measure_named

   !> Name of a contact, such as 'stop_1_below', 'body_2_above' or 'body_2_floor'.
   pure function contact_name(contact) result(name)
      class(contact_owner_t), intent(in) :: contact
      character(:), allocatable :: name

      name = trim(merge('_below', '_above', contact%sign > 0))
      if (contact%is_of_base) name = trim(merge('_floor  ', '_ceiling', contact%sign > 0))
      if (contact%body == 0) name = 'stop_'//to_text(contact%stop)//name
      if (contact%body > 0) name = 'body_'//to_text(contact%body)//name
   end function contact_name

   !> Index in `measured_groups` of the stop or body to which a contact belongs; 0: it has no measures of its own.
   elemental integer function owner_of(stop, body, is_of_base) result(owner)
      !> Number of the stop
      integer, intent(in) :: stop
      !> Number of the body; 0: the contact belongs to a stop
      integer, intent(in) :: body
      !> Whether the contact is that of the body with its floor or ceiling
      logical, intent(in) :: is_of_base

      owner = 0
      if (body == 0 .and. stop <= measured_stops) owner = stop
      if (body > 0 .and. body <= measured_bodies) owner = measured_stops + merge(measured_bodies, 0, is_of_base) + body
   end function owner_of

   !> The groups that a scene must have for a measure, as a text for messages.
   pure function demand_of(group) result(words)
      !> Component `group` of the measure, not empty
      character(*), intent(in) :: group
      character(:), allocatable :: words

      words = 'needs &'//trim(group)
      if (group == 'stress') words = words//', which gives the positions'
      if (group == 'steady') words = 'needs &stress, with &statistics or fatigue_slope'
      if (group == 'fatigue') words = 'needs &stress with fatigue_slope'
      if (index(group, 'stop_') == 1) words = 'needs &statistics and several &stop groups, of which number ' &
         //trim(group(6:))
      if (index(group, 'body_') == 1) words = 'needs &statistics and &body with further contacts, of which number ' &
         //trim(group(6:))
      if (index(group, 'floor_') == 1) words = 'needs &statistics and a floor or ceiling of &body number ' &
         //trim(group(7:))
   end function demand_of

end module measure_list
