!> Finds the mesh of a scene that gives none. The mesh is found for a few of the runs, before all of them, and is the
!> same for all runs.
module default_mesh
   use kinds, only: wp
   use mesh_checks, only: mesh_check_t
   use mesh_choice, only: case_beam_t, search_mesh
   use number_text, only: list_of_numbers
   use orbit_settings, only: vary_frequency, vary_nothing
   use scene_requests, only: harmonic_loads
   use scene_types, only: scene_t
   use sweep_plan, only: make_plan, plan_t
   use sweep_run, only: sample_plan
   implicit none (type, external)
   private
   public :: find_mesh

contains

   !> Find the mesh of a scene that gives none: the finest of the meshes found for its sample runs. A scene with a mesh
   !> does not change. If no sample run can be made, the scene keeps the default number of elements, and its run reports
   !> the reason.
   subroutine find_mesh(scene)
      type(scene_t), intent(inout) :: scene

      type(scene_t), allocatable :: sample(:)
      ! allocated, because the type is large
      type(case_beam_t), allocatable :: beam
      type(mesh_check_t) :: found
      integer :: i
      ! whether the mesh of each sample run is within the tolerance
      logical :: all_accepted

      if (.not. scene%mesh%is_sought) return
      call find_sample(scene, sample)
      all_accepted = .true.
      do i = 1, size(sample)
         allocate (beam)
         call search_mesh(sample(i), 1.0_wp/real(size(sample), wp), beam)
         associate (check => beam%check)
            if (.not. allocated(beam%error) .and. check%finer_elements > 0) then
               all_accepted = all_accepted .and. check%is_converged
               ! of equally fine meshes, the mesh with the maximum difference is reported
               if (check%elements > found%elements .or. (check%elements == found%elements .and. &
                  check%difference > found%difference)) found = check
            end if
         end associate
         deallocate (beam)
      end do
      scene%mesh%is_sought = .false.
      if (found%finer_elements == 0) return
      found%is_converged = all_accepted
      scene%mesh%found = found
      scene%mesh%elements = found%elements
      scene%mesh%ratio = found%ratio
      call change_echo('elements', real(found%elements, wp))
      call change_echo('ratio', found%ratio)

   contains

      !> Change a number of &mesh in the echo of the scene.
      subroutine change_echo(name, value)
         character(*), intent(in) :: name
         real(wp), intent(in) :: value

         integer :: k

         if (.not. allocated(scene%echo)) return
         do k = 1, size(scene%echo)
            if (scene%echo(k)%group == 'mesh' .and. scene%echo(k)%name == name) scene%echo(k)%number = [value]
         end do
      end subroutine change_echo

   end subroutine find_mesh

   !> The runs from which the mesh is found: a few cases from the first to the last, the ends of a branch of periodic
   !> motions, or the run of the scene.
   subroutine find_sample(scene, sample)
      !> Scene; on return with the description of these runs (`found_for`)
      type(scene_t), intent(inout) :: scene
      type(scene_t), allocatable, intent(out) :: sample(:)

      type(plan_t) :: plan
      integer, allocatable :: numbers(:)

      if (scene%wants_sweep .or. scene%wants_cases) then
         call make_plan(scene, plan)
         call sample_plan(scene, plan, numbers, sample)
         scene%mesh%found_for = 'in cases '//list_of_numbers(numbers)
      else if (scene%wants_orbit .and. scene%orbit%varied /= vary_nothing) then
         scene%mesh%found_for = 'for the run and the ends of the branch'
         allocate (sample(3), source=scene)
         call vary_load(sample(2), scene%orbit%min_ratio)
         call vary_load(sample(3), scene%orbit%max_ratio)
      else
         allocate (sample(1), source=scene)
      end if
   end subroutine find_sample

   !> Multiply the amplitude of the load that a branch of periodic motions varies, or the frequencies of all loads.
   pure subroutine vary_load(scene, factor)
      type(scene_t), intent(inout) :: scene
      real(wp), intent(in) :: factor

      integer :: forces, place
      integer, allocatable :: places(:)

      if (scene%orbit%varied == vary_frequency) then
         if (scene%has_forces) scene%forces%course%frequency = factor*scene%forces%course%frequency
         if (scene%has_bases) scene%bases%course%frequency = factor*scene%bases%course%frequency
         return
      end if
      places = harmonic_loads(scene)
      place = places(scene%orbit%load)
      forces = 0
      if (scene%has_forces) forces = size(scene%forces)
      if (place <= forces) then
         scene%forces(place)%course%amplitude = factor*scene%forces(place)%course%amplitude
      else
         associate (course => scene%bases(place - forces)%course)
            course%amplitude = factor*course%amplitude
         end associate
      end if
   end subroutine vary_load

end module default_mesh
