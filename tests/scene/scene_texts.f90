!> Scenes as short texts, for the tests.
module scene_texts
   use failures, only: failure_t
   use scene_reader, only: parse_scene
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: lines, message_of, scene_of

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

   !> The scene of a file without problems; with some, its title is the message.
   subroutine scene_of(text, scene)
      !> The file, with bars for line ends
      character(*), intent(in) :: text
      !> The scene
      type(scene_t), intent(out) :: scene

      type(failure_t), allocatable :: error

      call parse_scene(lines(text), 's.nml', scene, error)
      if (allocated(error)) scene%title = error%message
   end subroutine scene_of

end module scene_texts
