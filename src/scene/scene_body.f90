!> &root and &mass checked and completed: ratios of what is given in units, motions that nothing would hold.
module scene_body
   use body_groups, only: physical_mass_t, physical_root_t
   use body_settings, only: root_pinned
   use kinds, only: wp
   use load_settings, only: start_balance, start_pull
   use name_table, only: table_t
   use run_settings, only: method_newmark
   use scene_input, only: scene_input_t
   use scene_types, only: scene_t
   use unit_ratios, only: take_ratio
   implicit none (type, external)
   private
   public :: resolve_root, resolve_masses

contains

   !> Problems go into the input.
   subroutine resolve_root(input, table, physical, scene)
      type(scene_input_t), intent(inout) :: input
      !> Its names, read
      type(table_t), intent(in) :: table
      !> What it gives in physical units
      type(physical_root_t), intent(in) :: physical
      !> Scales in; root out
      type(scene_t), intent(inout) :: scene

      real(wp) :: unit

      unit = 3.0_wp*scene%scales%bending_stiffness/scene%beam%length
      call take_ratio(input, table, 'root', 'rotation_stiffness', physical%rotation_stiffness/unit, &
         scene%root%rotation_stiffness_ratio)
      unit = unit/scene%beam%length**2
      call take_ratio(input, table, 'root', 'translation_stiffness', physical%translation_stiffness/unit, &
         scene%root%translation_stiffness_ratio)
      if (scene%root%kind /= root_pinned .or. scene%has_supports) return
      if (.not. (scene%wants_response .or. scene%wants_precision)) return
      if (scene%start%kind == start_pull) then
         call input%complain('root', 'kind', 'a beam that turns freely about its root needs a &support to be pulled ' &
            //'away from a stop; without one give another &start, or only &frequencies')
      else if (scene%start%kind == start_balance .and. scene%response%method == method_newmark) then
         call input%complain('root', 'kind', 'the balance of a beam that turns freely about its root is found by ' &
            //"method = 'exact' alone")
      end if
   end subroutine resolve_root

   !> Problems go into the input.
   subroutine resolve_masses(input, table, physical, scene)
      type(scene_input_t), intent(inout) :: input
      !> Its names, read
      type(table_t), intent(in) :: table
      !> What they give in physical units, [masses]
      type(physical_mass_t), intent(in) :: physical(:)
      !> Scales in; masses out
      type(scene_t), intent(inout) :: scene

      integer :: k

      do k = 1, size(physical)
         associate (mass => scene%masses(k), beam_mass => scene%scales%beam_mass)
            call take_ratio(input, table, 'mass', 'mass', physical(k)%mass/beam_mass, mass%mass_ratio, k)
            call take_ratio(input, table, 'mass', 'rotary_inertia', &
               physical(k)%rotary_inertia/(beam_mass*scene%beam%length**2), mass%rotary_inertia_ratio, k)
         end associate
         if (any([input%has('mass', 'mass_ratio', k), input%has('mass', 'mass', k), input%has('mass', &
            'rotary_inertia_ratio', k), input%has('mass', 'rotary_inertia', k)])) cycle
         if (scene%wants_sweep .or. scene%wants_cases) cycle
         call input%complain('mass', '', 'needs mass_ratio or mass, or rotary_inertia_ratio or rotary_inertia', k)
      end do
   end subroutine resolve_masses

end module scene_body
