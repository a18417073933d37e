!> &root and &mass checked: masses that say nothing, motions that nothing would hold.
module scene_body
   use body_settings, only: root_pinned
   use load_settings, only: start_balance, start_pull
   use run_settings, only: method_newmark
   use scene_input, only: scene_input_t
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: check_root, check_masses

contains

   !> Problems go into the input.
   subroutine check_root(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene

      if (scene%root%kind /= root_pinned .or. scene%has_supports) return
      if (.not. (scene%wants_response .or. scene%wants_precision)) return
      if (scene%start%kind == start_pull) then
         call input%complain('root', 'kind', 'a beam that turns freely about its root needs a &support to be pulled ' &
            //'away from a stop; without one give another &start, or only &frequencies')
      else if (scene%start%kind == start_balance .and. scene%response%method == method_newmark) then
         call input%complain('root', 'kind', 'the balance of a beam that turns freely about its root is found by ' &
            //"method = 'exact' alone")
      end if
   end subroutine check_root

   !> Problems go into the input.
   subroutine check_masses(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene

      integer :: k

      if (.not. scene%has_masses .or. scene%wants_sweep .or. scene%wants_cases) return
      do k = 1, size(scene%masses)
         if (any([input%has('mass', 'mass_ratio', k), input%has('mass', 'mass', k), input%has('mass', &
            'rotary_inertia_ratio', k), input%has('mass', 'rotary_inertia', k)])) cycle
         call input%complain('mass', '', 'needs mass_ratio or mass, or rotary_inertia_ratio or rotary_inertia', k)
      end do
   end subroutine check_masses

end module scene_body
