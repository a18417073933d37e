!> &root and &mass: the names of the groups, and checks for masses without values and for beams without sufficient
!> supports. A file may have any number of &mass groups.
module scene_root_and_masses
   use kinds, only: wp
   use load_settings, only: start_release
   use name_table, only: table_t
   use name_types, only: condition_t, group_t, in_units_t, name_t, sweep_t, off_root_range, range_t, stiffness_range
   use root_and_mass_settings, only: root_names, root_pinned
   use scene_input, only: scene_input_t
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: list_root, list_masses, check_root, check_masses

   !> Condition of the stiffnesses of the root: `kind` is 'clamped'; springs then replace the rigid clamp.
   type(condition_t), parameter :: elastic_clamp = condition_t(name='kind', words='clamped')

   !> Allowed ratios of masses and of rotary inertias.
   type(range_t), parameter :: mass_range = range_t(0.0_wp, 1.0e6_wp)

contains

   !> List the names of &root in the table, and bind them to the components of the scene.
   subroutine list_root(table, scene)
      class(table_t), intent(inout) :: table
      !> The scene; its root is bound
      type(scene_t), intent(inout) :: scene

      call table%open(group_t('root'), scene%has_root_group)
      if (.not. table%lists_names) return
      associate (root => scene%root)
         call table%bind(root%kind, name_t('kind', 'support of the root: clamped, or pinned, so that the beam turns ' &
            //'freely about it'), root_names)
         call table%bind(root%rotation_stiffness_ratio, name_t('rotation_stiffness_ratio', 'k / (3 E Ibar / L) of a ' &
            //'spring against rotation', stiffness_range, elastic_clamp, default='none: it does not turn', &
            is_optional=.true., &
            sweep=sweep_t(20, changes_beam=.true., is_in_cases=.true., name='root_rotation_stiffness_ratio')), &
            in_units_t('rotation_stiffness', 'rotational_stiffness', 'the same, moment over angle', &
            swept_as='root_rotation_stiffness'))
         call table%bind(root%translation_stiffness_ratio, name_t('translation_stiffness_ratio', 'k / (3 E Ibar / ' &
            //'L^3) of a spring against displacement', stiffness_range, elastic_clamp, &
            default='none: it does not move', is_optional=.true., sweep=sweep_t(21, changes_beam=.true., &
            is_in_cases=.true., name='root_translation_stiffness_ratio')), in_units_t('translation_stiffness', &
            'stiffness', 'the same, force over length', swept_as='root_translation_stiffness'))
      end associate
   end subroutine list_root

   !> List the names of all &mass groups in the table, and bind them to the components of the scene.
   subroutine list_masses(table, scene)
      class(table_t), intent(inout) :: table
      !> The scene; its masses are bound
      type(scene_t), intent(inout) :: scene

      integer :: k

      if (.not. allocated(scene%masses)) allocate (scene%masses(table%groups_to_list('mass', 0)))
      do k = 1, size(scene%masses)
         call table%open_numbered('mass', k, scene%has_masses)
         if (.not. table%lists_names) cycle
         associate (mass => scene%masses(k))
            call table%bind(mass%position, name_t('position', 'position of the mass over length', off_root_range, &
               sweep=sweep_t(17, changes_beam=.true., is_in_cases=.true.)), &
               in_units_t('position_length', 'length', 'the same as a length from the root'))
            call table%bind(mass%mass_ratio, name_t('mass_ratio', 'mass over that of the beam', mass_range, &
               sweep=sweep_t(18, changes_beam=.true., is_in_cases=.true.)), in_units_t('mass', 'mass', 'mass'))
            call table%bind(mass%rotary_inertia_ratio, name_t('rotary_inertia_ratio', 'J / (rho Abar L^3), J: moment ' &
               //'of inertia of the mass about the axis of bending', mass_range, &
               sweep=sweep_t(19, changes_beam=.true., is_in_cases=.true.)), &
               in_units_t('rotary_inertia', 'rotary_inertia', 'J, mass times length squared'))
         end associate
      end do
      if (.not. scene%has_masses) deallocate (scene%masses)
   end subroutine list_masses

   !> Check the start of a beam with a pinned root and without supports: a release needs a static shape, which a beam
   !> that turns freely does not have. Problems are reported to `input`.
   subroutine check_root(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene

      if (scene%root%kind /= root_pinned .or. scene%has_supports) return
      if (.not. (scene%wants_response .or. scene%wants_precision)) return
      if (scene%start%kind == start_release) then
         call input%complain('root', 'kind', 'a beam that turns freely about its root needs a &support to be pulled ' &
            //'away from a stop; without one give another &start, or only &frequencies')
      end if
   end subroutine check_root

   !> Check that each &mass has a mass or a rotary inertia; a sweep or &cases may give the values. Problems are reported
   !> to `input`.
   subroutine check_masses(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      !> Table of names with the values of the file
      type(table_t), intent(in) :: table
      type(scene_t), intent(in) :: scene

      integer :: k

      if (.not. scene%has_masses .or. scene%wants_sweep .or. scene%wants_cases) return
      do k = 1, size(scene%masses)
         if (table%has_either('mass', 'mass_ratio', k) .or. table%has_either('mass', 'rotary_inertia_ratio', k)) cycle
         call input%complain('mass', '', 'needs mass_ratio or mass, or rotary_inertia_ratio or rotary_inertia', k)
      end do
   end subroutine check_masses

end module scene_root_and_masses
