!> Scenes as short texts, for the tests.
module scene_texts
   use failures, only: failure_t
   use sweep_names, only: find_parameters, parameter_of
   use name_table, only: table_t
   use scene_groups, only: list_scene
   use scene_reader, only: parse_scene
   use scene_types, only: scene_t
   use sweep_settings, only: parameter_t
   implicit none (type, external)
   private
   public :: lines, message_of, scene_of, parameter_called

contains

   !> A text with a line end for each bar.
   pure function lines(text)
      !> The text
      character(*), intent(in) :: text
      character(len(text)) :: lines

      integer :: i

      lines = text
      do i = 1, len(text)
         if (text(i:i) == '|') lines(i:i) = achar(10)
      end do
   end function lines

   !> What the user is told about a scene file s.nml; nothing, if all is well.
   function message_of(text) result(message)
      !> The file, with bars for line ends
      character(*), intent(in) :: text
      character(:), allocatable :: message

      type(scene_t) :: scene
      type(failure_t), allocatable :: error

      call parse_scene(lines(text), 's.nml', scene, error)
      message = ''
      if (allocated(error)) message = error%message
   end function message_of

   !> The scene of a file without problems. A refused file ends the suite: tests would go on with half a scene.
   subroutine scene_of(text, scene)
      !> The file, with bars for line ends
      character(*), intent(in) :: text
      !> The scene
      type(scene_t), intent(out) :: scene

      type(failure_t), allocatable :: error

      call parse_scene(lines(text), 's.nml', scene, error)
      if (allocated(error)) error stop 'the scene of a test is refused: '//error%message
   end subroutine scene_of

   !> The parameter that &sweep calls by a name; without a name: there is none.
   function parameter_called(name, of) result(parameter)
      character(*), intent(in) :: name
      !> Of this scene, which may have several stops; default one without any
      type(scene_t), intent(in), optional :: of
      type(parameter_t) :: parameter

      type(table_t) :: table
      type(scene_t) :: scene
      integer, allocatable :: places(:)
      integer :: i

      if (present(of)) scene = of
      call list_scene(table, scene)
      call find_parameters(table, places)
      do i = 1, size(places)
         parameter = parameter_of(table, places(i))
         if (parameter%name == name) return
      end do
      parameter = parameter_t()
   end function parameter_called

end module scene_texts
