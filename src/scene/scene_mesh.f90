!> Checks and resolution of &mesh.
module scene_mesh
   use kinds, only: wp
   use run_settings, only: method_newmark
   use scene_beam, only: check_stations
   use scene_input, only: scene_input_t
   use scene_types, only: scene_t
   use sweep_settings, only: is_swept
   implicit none (type, external)
   private
   public :: decide_mesh, resolve_mesh, resolve_nodes

contains

   !> Check the nodes of a mesh, if they are given.
   subroutine resolve_nodes(input, scene)
      type(scene_input_t), intent(inout) :: input
      !> On entry with the length of the beam; on return with the number of elements
      type(scene_t), intent(inout) :: scene

      call check_stations(input, 'mesh', 'nodes', scene%beam%length, scene%mesh%nodes)
      scene%mesh%elements = size(scene%mesh%nodes) - 1
      if (scene%wants_precision) call input%complain('mesh', 'nodes', &
         'does not go with &precision, which refines meshes')
      if (allocated(scene%frequencies%mesh_elements) .or. allocated(scene%frequencies%mesh_ratios)) then
         call input%complain('frequencies', 'mesh_elements mesh_ratios', &
            'does not go with nodes of &mesh, which say all of the mesh')
      end if
   end subroutine resolve_nodes

   !> Check the requests for a mesh within a tolerance and for error estimates.
   subroutine resolve_mesh(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(inout) :: scene

      if (scene%mesh%estimate .and. .not. scene%wants_response) then
         call input%complain('mesh', 'estimate', 'estimates errors of measures; add &response / (with &stop /)')
      end if
      if (scene%mesh%tolerance <= 0.0_wp) return
      if (.not. scene%wants_response) then
         call input%complain('mesh', 'tolerance', 'finds a mesh for a response; add &response / (with &stop /)')
      end if
   end subroutine resolve_mesh

   !> Decide whether the mesh is found before the runs, because the scene gives none, and whether a single run estimates
   !> its error.
   subroutine decide_mesh(input, scene)
      type(scene_input_t), intent(in) :: input
      type(scene_t), intent(inout) :: scene

      logical :: varies_mesh

      scene%mesh%estimates_if_cheap = scene%wants_response .and. .not. input%has('mesh', 'estimate')
      varies_mesh = scene%wants_precision
      if (allocated(scene%sweep%swept)) varies_mesh = varies_mesh .or. any(is_swept(scene%sweep%swept) .and. &
         scene%sweep%swept%parameter%group == 'mesh')
      scene%mesh%is_sought = scene%wants_response .and. .not. (varies_mesh .or. allocated(scene%mesh%nodes) .or. &
         scene%mesh%tolerance > 0.0_wp .or. input%has('mesh', 'elements') .or. input%has('mesh', 'ratio'))
      ! where the mesh limits the time step, the given step may be too long for another mesh
      associate (response => scene%response)
         if (response%method == method_newmark .and. .not. response%substep .and. &
            2.0_wp*response%newmark_beta < response%newmark_gamma) scene%mesh%is_sought = .false.
      end associate
   end subroutine decide_mesh

end module scene_mesh
