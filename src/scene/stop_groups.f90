!> The names of &stop and &support, of which a file may have any number.
module stop_groups
   use kinds, only: wp
   use name_table, only: table_t
   use name_types, only: condition_t, group_t, name_t, sweep_t
   use number_text, only: to_text
   use program_identity, only: in_motion_and_benchmark
   use run_settings, only: impulse_names, law_names, side_both, side_names, stop_settings_t
   use scene_types, only: scene_t, support_motion_names, support_settings_t
   use value_rules, only: physical_range, place_range, range_t, stiffness_range
   implicit none (type, external)
   private
   public :: list_stops, list_supports

   ! What more than one name needs
   type(condition_t), parameter :: one_side = condition_t(name='side', words='below above')
   type(condition_t), parameter :: both_sides = condition_t(name='side', words='both')
   type(condition_t), parameter :: restitution = condition_t(name='law', words='restitution')
   type(condition_t), parameter :: three_element = condition_t(name='law', words='three_element')
   type(condition_t), parameter :: yielding = condition_t(name='law', words='three_element spring_damper')

   ! Of more than one name
   type(range_t), parameter :: height_range = range_t(-1.0e12_wp, 1.0e12_wp)

contains

   !> Every &stop.
   subroutine list_stops(table, scene)
      class(table_t), intent(inout) :: table
      !> Its stops
      type(scene_t), intent(inout) :: scene

      integer :: number, k

      number = 1
      if (allocated(scene%more_stops)) number = 1 + size(scene%more_stops)
      number = table%times('stop', number)
      if (number > 1 .and. .not. allocated(scene%more_stops)) allocate (scene%more_stops(number - 1))
      call table%open(group_t('stop', in_motion_and_benchmark, repeats=.true.), scene%has_stop)
      if (table%is_open) call list_stop(table, 1, number, scene%stop, scene%pulled)
      do k = 2, number
         call table%open(group_t('stop', in_motion_and_benchmark, repeats=.true., occurrence=k, &
            label='stop_'//to_text(k)))
         if (table%is_open) call list_stop(table, k, number, scene%more_stops(k - 1), scene%pulled)
      end do
   end subroutine list_stops

   subroutine list_stop(table, which, number, stop, pulled)
      class(table_t), intent(inout) :: table
      !> Which of so many it is
      integer, intent(in) :: which
      integer, intent(in) :: number
      type(stop_settings_t), intent(inout) :: stop
      !> The one from which the beam is released
      integer, intent(inout) :: pulled

      real(wp) :: clearance
      logical :: is_pulled

      call table%bind(stop%position, name_t('position', &
         'position of the stop Lc over length; ' &
         //'the tip where the element beyond would be under 1/100 of its neighbour', place_range, &
         sweep=sweep_t(5, is_of_beam=.true., is_in_cases=.true., meaning='position of the stop Lc over length')))
      call table%bind(stop%side, name_t('side', 'where the stop is: below the beam, above it, or on both sides'), &
         side_names)
      is_pulled = pulled == which .and. number > 1
      call table%bind(is_pulled, name_t('pulled', 'the beam is released from this stop', default='that with ' &
         //'initial_height, or the one nearest the tip', is_optional=.true.))
      if (is_pulled) pulled = which
      call table%bind(stop%preload, name_t('preload', 'delta = d / (y_c(0) - d); > 0: presses on the stop at rest', &
         range_t(-1.0e6_wp, 1.0e6_wp), one_side, &
         sweep=sweep_t(9, is_in_cases=.true., meaning='delta = d / (y_c(0) - d)')))
      clearance = 0.0_wp - stop%preload
      call table%bind(clearance, name_t('clearance_ratio', 'distance of the unstressed beam to each side over ' &
         //'|y_c(0) - d|', range_t(0.0_wp, 1.0e6_wp, excludes_least=.true.), both_sides, default='none: give one', &
         sweep=sweep_t(14, is_in_cases=.true.)))
      if (stop%side == side_both) stop%preload = -clearance
      call table%keep(name_t('surface_height', &
         'd, the stop above the unstressed beam, length', height_range, one_side, instead_of='preload', &
         quantity='displacement'))
      call table%keep(name_t('clearance', 'distance of the unstressed beam to each side, length', &
         range_t(0.0_wp, 1.0e12_wp, excludes_least=.true.), both_sides, instead_of='clearance_ratio', &
         quantity='displacement'))
      call table%keep(name_t('initial_height', &
         'y_c(0) above the unstressed beam, at the stop from which it is released, length', height_range, &
         instead_of='preload', quantity='displacement', is_scale=.true.))
      call table%bind(stop%law, name_t('law', 'model of the stop'), law_names)
      call list_law(table, stop)
   end subroutine list_stop

   !> What the laws of stops need.
   subroutine list_law(table, stop)
      class(table_t), intent(inout) :: table
      type(stop_settings_t), intent(inout) :: stop

      call table%bind(stop%restitution, name_t('restitution', 'coefficient of restitution eps', &
         range_t(0.0_wp, 1.0_wp), restitution, sweep=sweep_t(10, is_in_cases=.true.)))
      call table%bind(stop%impulse, name_t('impulse', 'what an impact acts on: the whole beam, or one velocity', &
         needs=restitution), impulse_names)
      call table%bind(stop%stiffness_ratio, name_t('stiffness_ratio', 'kappa = k / (3 E Ibar / L^3)', &
         stiffness_range, yielding, sweep=sweep_t(11, is_in_cases=.true.)))
      call table%keep(name_t('stiffness', 'spring k, force over length', physical_range, &
         yielding, instead_of='stiffness_ratio', quantity='stiffness'))
      call table%bind(stop%branch_ratio, name_t('branch_ratio', 'beta = spring of the Maxwell branch over k', &
         range_t(0.0_wp, 1.0e6_wp), three_element, sweep=sweep_t(12, is_in_cases=.true.)))
      call table%keep(name_t('branch_stiffness', 'spring beta k, force over length', &
         physical_range, three_element, instead_of='branch_ratio', quantity='stiffness', over='stiffness'))
      call table%bind(stop%damper_ratio, name_t('damper_ratio', 'c* = c omega1 / (3 E Ibar / L^3), in the branch or ' &
         //'beside the spring; 0: none', range_t(0.0_wp, 1.0e9_wp), yielding, &
         sweep=sweep_t(13, is_in_cases=.true., meaning='c* = c omega1 / (3 E Ibar / L^3)')))
      call table%keep(name_t('damper', 'damper c, force over velocity', physical_range, yielding, &
         instead_of='damper_ratio', quantity='damper'))
   end subroutine list_law

   !> Every &support.
   subroutine list_supports(table, scene)
      class(table_t), intent(inout) :: table
      !> Its supports
      type(scene_t), intent(inout) :: scene

      type(support_settings_t), allocatable :: supports(:)
      integer :: number, k

      number = 0
      if (allocated(scene%supports)) number = size(scene%supports)
      number = table%times('support', number)
      allocate (supports(number))
      if (allocated(scene%supports)) supports(:) = scene%supports
      do k = 1, number
         if (k == 1) then
            call table%open(group_t('support', repeats=.true., label='support_1'), scene%has_supports)
         else
            call table%open(group_t('support', repeats=.true., occurrence=k, label='support_'//to_text(k)))
         end if
         if (table%is_open) call list_support(table, supports(k))
      end do
      if (scene%has_supports) call move_alloc(supports, scene%supports)
   end subroutine list_supports

   subroutine list_support(table, support)
      class(table_t), intent(inout) :: table
      type(support_settings_t), intent(inout) :: support

      call table%bind(support%position, name_t('position', 'position of the support over length', place_range, &
         sweep=sweep_t(15, is_of_beam=.true., is_in_cases=.true.)))
      call table%bind(support%motion, name_t('motion', 'what it holds, at zero'), support_motion_names)
      call table%bind(support%stiffness_ratio, name_t('stiffness_ratio', &
         'k / (3 E Ibar / L^3) of its spring, against rotation k / (3 E Ibar / L)', stiffness_range, &
         default='none: rigid', is_optional=.true., sweep=sweep_t(16, is_of_beam=.true., is_in_cases=.true.)))
      call table%keep(name_t('stiffness', &
         'spring, force over length, or moment over angle', physical_range, instead_of='stiffness_ratio', &
         quantity='stiffness'))
   end subroutine list_support

end module stop_groups
