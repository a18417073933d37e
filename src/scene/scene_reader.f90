!> A scene file read, checked and made dimensionless.
module scene_reader
   use failures, only: fail, failure_t, status_bad_input
   use namelist_text, only: namelist_t, parse_namelist
   use number_text, only: to_text
   use scene_groups, only: physical_t, walk_scene
   use scene_input, only: scene_input_t
   use scene_resolve, only: resolve_scene
   use scene_types, only: scene_t
   use scene_walk, only: scene_walk_t
   use text_file, only: load_text
   implicit none (type, external)
   private
   public :: read_scene, parse_scene, complain_of_scene

contains

   !> Read a scene from a file.
   subroutine read_scene(file, scene, error)
      !> Name of the file
      character(*), intent(in) :: file
      !> What it asks for
      type(scene_t), intent(out) :: scene
      !> What is wrong with it, on one line; unallocated: nothing
      type(failure_t), allocatable, intent(out) :: error

      character(:), allocatable :: text, problem

      call load_text(file, text, problem)
      if (allocated(problem)) then
         call fail(error, status_bad_input, trim(file)//': '//problem)
         return
      end if
      call parse_scene(text, trim(file), scene, error)
   end subroutine read_scene

   !> Read a scene from a text.
   subroutine parse_scene(text, file, scene, error)
      !> The text
      character(*), intent(in) :: text
      !> Name of the file that it came from, for messages and as the name of the scene
      character(*), intent(in) :: file
      !> What it asks for
      type(scene_t), intent(out) :: scene
      !> What is wrong with it, on one line; unallocated: nothing
      type(failure_t), allocatable, intent(out) :: error

      type(scene_walk_t) :: walk
      type(physical_t) :: physical
      type(namelist_t) :: namelist
      character(:), allocatable :: problem
      integer :: line

      scene%file = file
      scene%text = text
      scene%name = name_of_file(file)
      call parse_namelist(text, namelist, line, problem)
      if (allocated(problem)) then
         call fail(error, status_bad_input, file//':'//to_text(line)//': '//problem)
         return
      end if

      call walk%start_reading(file, namelist)
      call walk_scene(walk, scene, physical)
      call walk%input%finish()
      if (.not. walk%input%has_problem()) call resolve_scene(walk%input, physical, scene)
      if (.not. allocated(scene%title)) scene%title = scene%name
      call walk%input%get_problem(problem)
      if (allocated(problem)) call fail(error, status_bad_input, problem)
   end subroutine parse_scene

   !> A problem of a scene that was read without one, told where it stands in the file.
   subroutine complain_of_scene(scene, group, names, problem, error)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> The group
      character(*), intent(in) :: group
      !> Names for the quantity; the first that the file has is told
      character(*), intent(in) :: names(:)
      !> What is wrong
      character(*), intent(in) :: problem
      !> The problem with file, line, group, name and value
      type(failure_t), allocatable, intent(inout) :: error

      type(scene_input_t) :: input
      type(namelist_t) :: namelist
      character(:), allocatable :: message
      integer :: line, i

      call parse_namelist(scene%text, namelist, line, message)
      call input%start(scene%file, namelist)
      do i = 1, size(names) - 1
         if (input%has(group, trim(names(i)))) exit
      end do
      call input%complain(group, trim(names(i)), problem)
      call input%get_problem(message)
      call fail(error, status_bad_input, message)
   end subroutine complain_of_scene

   !> Name of a file without folders and ending.
   pure function name_of_file(file) result(name)
      !> Name of the file
      character(*), intent(in) :: file
      character(:), allocatable :: name

      integer :: i

      name = file(index(file, '/', back=.true.) + 1:)
      i = index(name, '.', back=.true.)
      if (i > 1) name = name(:i - 1)
   end function name_of_file

end module scene_reader
