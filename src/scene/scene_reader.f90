!> A scene file read, checked and made dimensionless; what is said of a scene that was read, and what is changed in it.
module scene_reader
   use failures, only: fail, failure_t, status_bad_input
   use kinds, only: wp
   use name_table, only: table_t
   use namelist_text, only: namelist_t, parse_namelist
   use number_text, only: to_text
   use program_identity, only: program_any
   use scene_beam, only: set_taper
   use scene_echo, only: make_echo
   use scene_groups, only: list_group, list_scene, physical_t
   use scene_input, only: scene_input_t
   use scene_resolve, only: resolve_scene
   use scene_types, only: scene_t
   use sweep_settings, only: is_swept, parameter_t, place_of, values_given
   use text_file, only: load_text
   implicit none (type, external)
   private
   public :: read_scene, parse_scene, complain_of_scene, set_parameter, set_parameters, draft_t

   !> What a file gives, before it is a scene.
   type :: draft_t
      private
      type(scene_input_t) :: input
      type(table_t) :: table
      type(physical_t) :: physical
      !> Of cases: the scene, not resolved, and which parameters count as given; unallocated: it is not read yet
      type(scene_t), allocatable :: scene
   end type draft_t

contains

   !> Read a scene from a file.
   subroutine read_scene(file, scene, error, program)
      character(*), intent(in) :: file
      !> What it asks for
      type(scene_t), intent(out) :: scene
      !> What is wrong with it, on one line; unallocated: nothing
      type(failure_t), allocatable, intent(out) :: error
      !> The program that reads it, one of the `program_` constants; absent: any
      integer, intent(in), optional :: program

      character(:), allocatable :: text, problem

      call load_text(file, text, problem)
      if (allocated(problem)) then
         call fail(error, status_bad_input, trim(file)//': '//problem)
         return
      end if
      call parse_scene(text, trim(file), scene, error, program)
   end subroutine read_scene

   !> Read a scene from a text.
   subroutine parse_scene(text, file, scene, error, program)
      character(*), intent(in) :: text
      !> Name of the file that it came from, for messages and as the name of the scene
      character(*), intent(in) :: file
      !> What it asks for
      type(scene_t), intent(out) :: scene
      !> What is wrong with it, on one line; unallocated: nothing
      type(failure_t), allocatable, intent(out) :: error
      !> The program that reads it, one of the `program_` constants; absent: any
      integer, intent(in), optional :: program

      type(draft_t) :: draft
      character(:), allocatable :: problem
      integer :: reader

      reader = program_any
      if (present(program)) reader = program
      call read_draft(text, file, reader, draft, scene, problem)
      if (.not. allocated(problem)) then
         if (.not. draft%input%has_problem()) call resolve_scene(draft%input, draft%table, reader, draft%physical, &
            scene)
         if (.not. allocated(scene%title)) scene%title = scene%name
         if (.not. draft%input%has_problem()) call check_extremes(draft%input, scene)
         if (.not. draft%input%has_problem()) call make_echo(draft%table, scene)
         call draft%input%get_problem(problem)
      end if
      if (allocated(problem)) call fail(error, status_bad_input, problem)
   end subroutine parse_scene

   !> A scene as it stands in a text.
   subroutine read_draft(text, file, program, draft, scene, problem)
      character(*), intent(in) :: text
      character(*), intent(in) :: file
      !> One of the `program_` constants, or a sum of them
      integer, intent(in) :: program
      type(draft_t), intent(out) :: draft
      !> Not resolved
      type(scene_t), intent(inout) :: scene
      !> The text is none of groups and names
      character(:), allocatable, intent(out) :: problem

      type(namelist_t) :: namelist
      integer :: line

      scene%file = file
      scene%text = text
      scene%name = name_of_file(file)
      call parse_namelist(text, namelist, line, problem)
      if (allocated(problem)) then
         problem = file//':'//to_text(line)//': '//problem
         return
      end if
      call draft%input%start(file, namelist)
      call draft%input%announce(draft%table)
      call list_scene(draft%table, scene, draft%physical)
      call draft%input%read_table(draft%table, program)
      call draft%table%give_values()
      call list_scene(draft%table, scene, draft%physical)
   end subroutine read_draft

   !> A problem of a scene that was read without one, told where it stands in the file.
   subroutine complain_of_scene(scene, group, name, problem, error)
      type(scene_t), intent(in) :: scene
      character(*), intent(in) :: group
      !> The name, or several for one quantity with blanks between them
      character(*), intent(in) :: name
      character(*), intent(in) :: problem
      !> The problem with file, line, group, name and value
      type(failure_t), allocatable, intent(inout) :: error

      type(scene_input_t) :: input
      type(namelist_t) :: namelist
      character(:), allocatable :: message
      integer :: line

      call parse_namelist(scene%text, namelist, line, message)
      call input%start(scene%file, namelist)
      call input%complain(group, name, problem)
      call input%get_problem(message)
      call fail(error, status_bad_input, message)
   end subroutine complain_of_scene

   !> Give a scene that has been read other values of parameters.
   subroutine set_parameters(scene, parameters, values, problem, draft)
      type(scene_t), intent(inout) :: scene
      !> All that have other values than in the file
      type(parameter_t), intent(in) :: parameters(:)
      real(wp), intent(in) :: values(:)
      !> Why these values cannot be; unallocated: they can
      character(:), allocatable, intent(out) :: problem
      !> Kept from case to case with the same scene and parameters it saves reading the file again
      type(draft_t), intent(inout), optional :: draft

      ! large, and threads have small stacks
      type(draft_t), allocatable :: own
      integer :: k

      if (any(parameters%quantity /= '') .or. scene%has_misfits) then
         if (present(draft)) then
            call resolve_anew(scene, parameters, values, draft, problem)
         else
            allocate (own)
            call resolve_anew(scene, parameters, values, own, problem)
         end if
      end if
      if (allocated(problem)) return
      do k = 1, size(parameters)
         if (parameters(k)%quantity == '') call set_parameter(scene, parameters(k), values(k))
      end do
   end subroutine set_parameters

   !> Give a scene that has been read another value of a ratio or a number.
   subroutine set_parameter(scene, parameter, value)
      type(scene_t), intent(inout) :: scene
      type(parameter_t), intent(in) :: parameter
      real(wp), intent(in) :: value

      type(table_t) :: table
      type(physical_t) :: physical

      call table%give_one(parameter%occurrence, trim(parameter%name_in_group), value)
      call list_group(trim(parameter%group), table, scene, physical)
      if (parameter%name == 'taper') call set_taper(scene%beam, scene%scales%height_ratio*scene%beam%length, value)
   end subroutine set_parameter

   !> Resolve a scene anew as if its file gave these values: one of a quantity in units may change the ratios of all,
   !> any may not fit the others.
   subroutine resolve_anew(scene, parameters, values, draft, problem)
      type(scene_t), intent(inout) :: scene
      type(parameter_t), intent(in) :: parameters(:)
      real(wp), intent(in) :: values(:)
      !> Of the scene's file, or nothing
      type(draft_t), intent(inout) :: draft
      character(:), allocatable, intent(out) :: problem

      type(scene_t) :: made
      type(table_t) :: one
      integer :: k

      if (.not. allocated(draft%scene)) call read_for_cases(scene, parameters, draft, problem)
      made = draft%scene
      do k = 1, size(parameters)
         if (keeps_others(parameters(k))) cycle
         call one%give_one(parameters(k)%occurrence, trim(parameters(k)%name_in_group), values(k))
         call list_group(trim(parameters(k)%group), one, made, draft%physical)
         deallocate (one%groups, one%entries)
      end do
      call resolve_scene(draft%input, draft%table, program_any, draft%physical, made)
      call draft%input%get_problem(problem)
      if (allocated(problem)) then
         ! it would be told of the next case too
         deallocate (draft%scene)
         ! its line says nothing of a value that stands elsewhere
         problem = problem(len(scene%file) + 2:)
         k = 0
         if (problem(1:1) /= ' ') k = index(problem, ':')
         problem = problem(k + 2:)
         return
      end if
      made%title = scene%title
      made%output = scene%output
      made%wants_sweep = scene%wants_sweep
      made%wants_cases = scene%wants_cases
      made%has_misfits = scene%has_misfits
      if (allocated(scene%echo)) made%echo = scene%echo
      scene = made
   end subroutine resolve_anew

   !> A taper is set with the mean height kept, whatever the file gives of the section.
   pure function keeps_others(parameter) result(keeps)
      type(parameter_t), intent(in) :: parameter
      logical :: keeps

      keeps = parameter%name == 'taper'
   end function keeps_others

   !> Read a scene's file, in which the parameters count as given.
   subroutine read_for_cases(scene, parameters, draft, problem)
      type(scene_t), intent(in) :: scene
      type(parameter_t), intent(in) :: parameters(:)
      type(draft_t), intent(inout) :: draft
      character(:), allocatable, intent(out) :: problem

      type(scene_t) :: made
      integer :: k, place

      call read_draft(scene%text, scene%file, program_any, draft, made, problem)
      do k = 1, size(parameters)
         if (keeps_others(parameters(k))) cycle
         associate (parameter => parameters(k), table => draft%table)
            call draft%input%add(trim(parameter%group), trim(parameter%name_in_group), parameter%occurrence)
            place = table%find(table%find_group(parameter%group, parameter%occurrence), parameter%name_in_group)
            table%entries(place)%is_given = .true.
         end associate
      end do
      made%wants_sweep = .false.
      made%wants_cases = .false.
      allocate (draft%scene, source=made)
   end subroutine read_for_cases

   !> The least and the greatest values of a sweep or of cases make scenes. Problems of quantities in units, and of
   !> cases, go into the input; those of a sweep's ratios are told of each case that has them.
   subroutine check_extremes(input, scene)
      type(scene_input_t), intent(inout) :: input
      !> Resolved
      type(scene_t), intent(inout) :: scene

      type(parameter_t), allocatable :: parameters(:)
      character(:), allocatable :: problem
      real(wp), allocatable :: ends(:, :)
      logical, allocatable :: refuses(:)
      integer :: k

      if (scene%wants_sweep) then
         associate (swept => scene%sweep%swept)
            parameters = pack(swept%parameter, is_swept(swept))
            allocate (ends(2, size(parameters)))
            do k = 1, size(parameters)
               associate (all => values_given(swept(place_of(trim(parameters(k)%name), swept))))
                  ends(:, k) = [minval(all), maxval(all)]
               end associate
            end do
         end associate
      else if (scene%wants_cases) then
         parameters = [scene%cases%parameter]
         ends = reshape([minval(scene%cases%values), maxval(scene%cases%values)], [2, 1])
      else
         return
      end if
      refuses = parameters%quantity /= '' .or. scene%wants_cases
      call try_corners(scene, pack(parameters, refuses), reshape(pack(ends, spread(refuses, 1, 2)), &
         [2, count(refuses)]), problem)
      if (allocated(problem)) then
         k = findloc(refuses, .true., dim=1)
         call input%complain(trim(merge('sweep', 'cases', scene%wants_sweep)), trim(parameters(k)%name) &
            //' '//trim(parameters(k)%name)//'_range '//trim(parameters(k)%name)//'_log_range values', problem)
      else if (scene%wants_sweep) then
         call try_corners(scene, parameters, ends, problem)
         scene%has_misfits = allocated(problem)
      end if
   end subroutine check_extremes

   !> What is wrong with the first scene that does not fit, of all with the least or greatest value of each parameter.
   subroutine try_corners(scene, parameters, ends, problem)
      type(scene_t), intent(in) :: scene
      type(parameter_t), intent(in) :: parameters(:)
      !> Least and greatest value, [2, parameters]
      real(wp), intent(in) :: ends(:, :)
      !> Unallocated: they all fit
      character(:), allocatable, intent(out) :: problem

      ! of more, some corners are left out
      integer, parameter :: most_checked = 6
      type(draft_t), allocatable :: draft
      type(scene_t) :: one
      character(:), allocatable :: given
      real(wp) :: values(size(parameters))
      integer :: corner, k

      if (size(parameters) == 0) return
      allocate (draft)
      do corner = 0, 2**min(size(parameters), most_checked) - 1
         given = ''
         do k = 1, size(parameters)
            values(k) = ends(1 + ibits(corner, modulo(k - 1, most_checked), 1), k)
            given = given//trim(parameters(k)%name)//' = '//to_text(values(k))//', '
         end do
         one = scene
         one%has_misfits = .true.
         call set_parameters(one, parameters, values, problem, draft)
         if (.not. allocated(problem)) cycle
         problem = given(:len(given) - 2)//': '//problem
         return
      end do
   end subroutine try_corners

   !> Name of a file without folders and ending.
   pure function name_of_file(file) result(name)
      character(*), intent(in) :: file
      character(:), allocatable :: name

      integer :: i

      name = file(index(file, '/', back=.true.) + 1:)
      i = index(name, '.', back=.true.)
      if (i > 1) name = name(:i - 1)
   end function name_of_file

end module scene_reader
