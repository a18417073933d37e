!> Histories at the sample times: one entry a history. What may be asked for and the datasets of files follow from it;
!> recorders fill them.
module history_list
   implicit none (type, external)
   private
   public :: history_table, history_count, eta_stop, eta_tip, velocity_stop, force_stop

   type :: history_t
      !> As a scene asks for it
      character(24) :: name
      !> Its dataset
      character(24) :: dataset
      !> Of {this~that} this without units, that in units
      character(60) :: meaning
      !> One of `quantity_table`
      character(24) :: quantity
   end type history_t

   type(history_t), parameter :: history_table(*) = [ &
      history_t('displacement_stop', 'eta_stop', 'displacement of the beam at the stop{, eta}', 'displacement'), &
      history_t('displacement_tip', 'eta_tip', 'displacement of the tip{, eta}', 'displacement'), &
      history_t('velocity_stop', 'velocity_stop', 'velocity of the beam at the stop{, d eta/d tau}', &
      'velocity'), &
      history_t('contact_force', 'contact_force', 'contact force{ Pbar}', 'force')]

   integer, parameter :: history_count = size(history_table)
   !> For who fills them or asks for one
   integer, parameter :: eta_stop = findloc(history_table%dataset, 'eta_stop', dim=1)
   integer, parameter :: eta_tip = findloc(history_table%dataset, 'eta_tip', dim=1)
   integer, parameter :: velocity_stop = findloc(history_table%dataset, 'velocity_stop', dim=1)
   integer, parameter :: force_stop = findloc(history_table%dataset, 'contact_force', dim=1)

end module history_list
