!> The HDF5 file of a scene, which has only the results that were computed.
!>
!> Values are dimensionless, as they are inside the program, or in units of the scene. The attribute `in_scene_units` of
!> a dataset is the value of one dimensionless unit in units of the scene, if known.
module results_file
   use, intrinsic :: iso_c_binding, only: c_size_t
   use beam_section, only: heights_of_elements, section_t
   use failures, only: fail, failure_t
   use file_system, only: make_folder, replace_file
   use frequency_results, only: write_frequencies
   use frequency_types, only: frequency_table_t
   use history_list, only: history_count
   use kinds, only: wp
   use program_identity, only: program_name, program_version
   use quantities, only: system_names, system_none, units_in
   use quantity_groups, only: quantity_group_t
   use response_groups, only: write_run
   use response_types, only: response_t
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: write_results, results_name, begin_results, expected_size, finish_results, write_header, write_groups

   !> Attribute `conventions` of the file: the definitions of dimensionless quantities.
   character(*), parameter :: conventions = &
      'tau = omega1 t; eta = (y - d)/(y_c(0) - d), y from the unstressed beam, the stop at y = d, y_c at the stop; ' &
      //'omega1 = 1.8751040687^2 sqrt(E Ibar/(rho Abar L^4)) of the uniform beam of mean height without tip mass; ' &
      //'omega_i = lambda_i^2 sqrt(E Ibar/(rho Abar L^4)); ' &
      //'contact force Pbar = hbar L^2 P/(1.8751040687^4 (y_c(0) - d) E Ibar); mass in rho Abar L, ' &
      //'so impulses in rho Abar L omega1 (y_c(0) - d) and energies in rho Abar L omega1^2 (y_c(0) - d)^2; ' &
      //'in_scene_units: one unit of a dataset in the units of the scene'
   !> Beginning of this attribute in a file with units.
   character(*), parameter :: conventions_in_units = &
      'in_scene_units: by that a dataset was multiplied to be in its units; divided by it, it is dimensionless: '

contains

   !> Name of the results file of a scene, without folder.
   pure function results_name(scene) result(name)
      type(scene_t), intent(in) :: scene
      character(:), allocatable :: name

      name = scene%name//'.h5'
   end function results_name

   !> Write the results file of a scene, either complete or not at all.
   subroutine write_results(folder, scene, error, node_position, frequencies, response)
      !> Folder of the results file
      character(*), intent(in) :: folder
      type(scene_t), intent(in) :: scene
      !> Reason why the file could not be written
      type(failure_t), allocatable, intent(out) :: error
      !> Positions x/L of the nodes, clamp first, if the scene has a single mesh
      real(wp), contiguous, intent(in), optional :: node_position(:)
      !> Table of frequencies; absent: not computed
      type(frequency_table_t), intent(in), optional :: frequencies
      !> Response of the run; absent: not computed
      type(response_t), intent(in), optional :: response
      type(quantity_group_t) :: root

      call begin_results(root, expected_size(response), scene)
      if (present(node_position)) then
         call write_groups(root, node_position, frequencies, response)
      else
         call write_groups(root, frequencies=frequencies, response=response)
      end if
      call finish_results(root, folder, scene, error)
   end subroutine write_results

   !> Write a group for each kind of result that was computed.
   subroutine write_groups(group, node_position, frequencies, response, section)
      type(quantity_group_t), intent(in) :: group
      !> Positions x/L of the nodes, clamp first, if the scene has a single mesh
      real(wp), contiguous, intent(in), optional :: node_position(:)
      !> Results that were computed
      type(frequency_table_t), intent(in), optional :: frequencies
      type(response_t), intent(in), optional :: response
      !> Section of the beam, if pictures of the scene are to show it
      type(section_t), intent(in), optional :: section

      if (present(node_position)) call write_mesh(group%subgroup('mesh'), node_position, section)
      if (present(frequencies)) call write_frequencies(group%subgroup('frequencies'), frequencies)
      if (present(response)) then
         ! the address sanitizer reports an absent array that is passed on as if the array were read
         if (present(node_position)) then
            call write_run(group, response, node_position)
         else
            call write_run(group, response)
         end if
      end if
   end subroutine write_groups

   !> Start the results file of a scene with the attributes of the file and the scene. A study adds its own groups.
   subroutine begin_results(root, expected_bytes, scene)
      !> Root of the file
      type(quantity_group_t), intent(inout) :: root
      !> Estimated size of the file in bytes
      integer(c_size_t), intent(in) :: expected_bytes
      type(scene_t), intent(in) :: scene

      call root%begin(expected_bytes)
      root%units = units_in(scene)
      call write_header(root, scene)
   end subroutine begin_results

   !> Write the start of every file: the attributes of the file and the scene.
   subroutine write_header(root, scene)
      type(quantity_group_t), intent(in) :: root
      type(scene_t), intent(in) :: scene

      if (allocated(scene%title)) then
         call root%attribute('title', scene%title)
      else
         call root%attribute('title', scene%name)
      end if
      call root%attribute('name', scene%name)
      call root%attribute('program', program_name)
      call root%attribute('version', program_version)
      if (root%units%are_physical) then
         call root%attribute('conventions', conventions_in_units//conventions(:index(conventions, '; in_scene') - 1))
         call root%attribute('units', trim(merge('scene   ', system_names(root%units%system), &
            root%units%system == system_none)))
      else
         call root%attribute('conventions', conventions)
      end if
      call write_scene(root%subgroup('scene'), scene)
   end subroutine write_header

   !> Write the finished file into its folder, which is made if it does not exist.
   subroutine finish_results(root, folder, scene, error)
      !> Root of the file
      type(quantity_group_t), intent(inout) :: root
      !> Folder of the results file
      character(*), intent(in) :: folder
      type(scene_t), intent(in) :: scene
      !> Reason why the file could not be written
      type(failure_t), allocatable, intent(out) :: error

      character(:), allocatable :: bytes
      type(failure_t), allocatable :: refusal

      call root%finish(bytes, refusal)
      if (allocated(refusal)) then
         call fail(error, refusal%status, "cannot make '"//results_name(scene)//"': "//refusal%message)
         return
      end if
      call make_folder(folder, error)
      if (.not. allocated(error)) call replace_file(folder, results_name(scene), bytes, error)
   end subroutine finish_results

   !> Estimated size of the file in bytes, so that its memory need not be reallocated.
   pure integer(c_size_t) function expected_size(response) result(bytes)
      type(response_t), intent(in), optional :: response

      ! numbers stored for an event
      integer(c_size_t), parameter :: event_parts = 8_c_size_t
      ! numbers stored for a node in a shape
      integer(c_size_t), parameter :: shape_parts = 4_c_size_t
      ! size of the scene and of all other contents, bytes
      integer(c_size_t), parameter :: overhead = 262144_c_size_t
      integer :: histories, i

      bytes = 0_c_size_t
      if (present(response)) then
         histories = count([allocated(response%tau), (allocated(response%history(i)%values), i=1, history_count)])
         ! about eight datasets: the terms of the energy balance and a dataset tau of their own
         if (allocated(response%energy)) histories = histories + 8
         if (allocated(response%tau)) bytes = bytes + int(histories, c_size_t)*size(response%tau, kind=c_size_t)
         bytes = bytes + event_parts*int(response%event_count, c_size_t)
         if (allocated(response%shape_displacement)) then
            bytes = bytes + shape_parts*size(response%shape_displacement, kind=c_size_t)
         end if
      end if
      bytes = overhead + bytes*(storage_size(1.0_wp)/8)
   end function expected_size

   !> Write the text of the scene file, and for each of its namelist groups an HDF5 group with the values that the
   !> program used, defaults included, as attributes.
   subroutine write_scene(group, scene)
      type(quantity_group_t), intent(in) :: group
      type(scene_t), intent(in) :: scene

      ! number of reals in the 64 kB that an HDF5 attribute may have
      integer, parameter :: max_attribute_size = 8000
      type(quantity_group_t) :: echo_group
      character(:), allocatable :: name
      integer :: i

      if (allocated(scene%text)) call group%add('text', scene%text, 'none', 'scene file as read')
      if (.not. allocated(scene%echo)) return
      name = ''
      do i = 1, size(scene%echo)
         associate (entry => scene%echo(i))
            if (entry%group /= name) then
               name = entry%group
               echo_group = group%subgroup(name)
            end if
            if (.not. allocated(entry%number)) then
               call echo_group%attribute(entry%name, entry%text)
            else if (size(entry%number) > max_attribute_size) then
               call echo_group%add(entry%name, entry%number, 'none', 'values as the scene has them')
            else if (entry%is_list) then
               call echo_group%attribute(entry%name, entry%number)
            else
               call echo_group%attribute(entry%name, entry%number(1))
            end if
         end associate
      end do
   end subroutine write_scene

   !> Write the nodes and the elements.
   subroutine write_mesh(group, node_position, section)
      type(quantity_group_t), intent(in) :: group
      !> Positions x/L of the nodes
      real(wp), contiguous, intent(in) :: node_position(:)
      type(section_t), intent(in), optional :: section

      real(wp), allocatable :: height(:, :)
      integer :: elements, i

      elements = size(node_position) - 1
      call group%put('x', node_position, 'length', 'position of the nodes{ x/L}', is_scale=.true.)
      call group%put('element', [(i, i=1, elements)], 'element, clamp first', is_scale=.true.)
      call group%put('element_length', node_position(2:) - node_position(:elements), 'length', &
         'length of the elements{ in L}', along='element')
      if (.not. present(section)) return
      allocate (height, source=transpose(heights_of_elements(section, node_position)))
      call group%put('height_root_side', height(:, 1), 'number', 'height of the section at the end of the element ' &
         //'towards the root, over the mean height; if area and second moment of area are given, sqrt(12 I/A)', &
         along='element')
      call group%put('height_tip_side', height(:, 2), 'number', 'the same at the end towards the tip', along='element')
   end subroutine write_mesh

end module results_file
