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
   use sweep_settings, only: parameter_t
   use text_file, only: load_text
   implicit none (type, external)
   private
   public :: read_scene, parse_scene, complain_of_scene, set_parameter

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

      type(scene_input_t) :: input
      type(table_t) :: table
      type(physical_t) :: physical
      type(namelist_t) :: namelist
      character(:), allocatable :: problem
      integer :: line, reader

      reader = program_any
      if (present(program)) reader = program
      scene%file = file
      scene%text = text
      scene%name = name_of_file(file)
      call parse_namelist(text, namelist, line, problem)
      if (allocated(problem)) then
         call fail(error, status_bad_input, file//':'//to_text(line)//': '//problem)
         return
      end if

      call input%start(file, namelist)
      call input%announce(table)
      call list_scene(table, scene, physical)
      call input%read_table(table, reader)
      call table%give_values()
      call list_scene(table, scene, physical)
      if (.not. input%has_problem()) call resolve_scene(input, table, reader, physical, scene)
      if (.not. allocated(scene%title)) scene%title = scene%name
      if (.not. input%has_problem()) call make_echo(table, scene)
      call input%get_problem(problem)
      if (allocated(problem)) call fail(error, status_bad_input, problem)
   end subroutine parse_scene

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

   !> Give a scene that has been read another value of a parameter.
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
