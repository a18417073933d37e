!> Histories (functions of time) recorded at the sample times: one table entry for each history. The names that a scene
!> may request and the datasets of results files follow from this table; recorders of other modules compute the values.
!>
!> Displacements, velocities and accelerations are relative to the base and positive upwards. If the scene has more than
!> one contact, "the stop" is the release contact: the contact from which the beam is released or, in other starts,
!> could be released (`stop_released_from`).
module history_list
   implicit none (type, external)
   private
   public :: history_table, history_count, eta_stop, eta_tip, velocity_stop, force_stop, &
      acceleration_stop, acceleration_tip

   !> A history.
   type :: history_t
      !> Name in scene files
      character(24) :: name
      !> Meaning; of a part `{this~that}`, dimensionless results have only `this`, results with units only `that`; a
      !> part `{this}` is in dimensionless results only
      character(120) :: meaning
      !> Name of its physical quantity in `quantity_table`
      character(24) :: quantity
      !> Whether the history is recorded if the scene names no histories
      logical :: is_default = .true.
   end type history_t

   !> All histories, in the order of results files.
   type(history_t), parameter :: history_table(*) = [ &
      history_t('displacement_stop', 'displacement of the beam at the stop, up from its surface{, eta}', &
      'displacement'), &
      history_t('displacement_tip', 'displacement of the tip, up from the height of the surface, without a stop ' &
      //'from the unstressed beam{, eta}', &
      'displacement'), &
      history_t('velocity_stop', 'velocity of the beam at the stop, upwards{, d eta/d tau}', &
      'velocity'), &
      history_t('contact_force', 'contact force{ Pbar}', 'force'), &
      history_t('acceleration_stop', 'acceleration at the stop, without impulses', 'acceleration', .false.), &
      history_t('acceleration_tip', 'acceleration of the tip, without impulses', 'acceleration', .false.)]

   !> Number of histories.
   integer, parameter :: history_count = size(history_table)
   ! The following constants are the indices of the histories in the table.
   !> Displacement of the beam at the stop, upwards from the surface of the stop, eta.
   integer, parameter :: eta_stop = findloc(history_table%name, 'displacement_stop', dim=1)
   !> Displacement of the tip, upwards from the height of the surface of the stop, eta.
   integer, parameter :: eta_tip = findloc(history_table%name, 'displacement_tip', dim=1)
   !> Velocity of the beam at the stop, upwards, d eta/d tau.
   integer, parameter :: velocity_stop = findloc(history_table%name, 'velocity_stop', dim=1)
   !> Contact force, Pbar.
   integer, parameter :: force_stop = findloc(history_table%name, 'contact_force', dim=1)
   !> Acceleration of the beam at the stop, upwards, without the impulses of impacts.
   integer, parameter :: acceleration_stop = findloc(history_table%name, 'acceleration_stop', dim=1)
   !> Acceleration of the tip, upwards, without the impulses of impacts.
   integer, parameter :: acceleration_tip = findloc(history_table%name, 'acceleration_tip', dim=1)

end module history_list
