!> What the text of a scene does not tell but its beam does, told before anything runs.
module scene_checks
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use motion_run, only: check_motion
   use number_text, only: to_text
   use run_settings, only: method_newmark
   use scene_beam_model, only: motion_model_of, run_of
   use scene_reader, only: complain_of_scene, set_parameters
   use scene_types, only: mass_redistributed, scene_t
   use stop_surfaces, only: is_plain
   use sweep_settings, only: is_swept, parameter_t
   implicit none (type, external)
   private
   public :: check_scene

contains

   !> Can the runs of a scene start? A sweep keeps cases that fail as rows: it is refused only if all of them would.
   subroutine check_scene(scene, error)
      !> The scene, read without a problem
      type(scene_t), intent(in) :: scene
      !> What keeps a run from starting, with file, line, group and name
      type(failure_t), allocatable, intent(out) :: error

      type(beam_model_t) :: model
      type(scene_t) :: one
      character(:), allocatable :: problem
      integer :: i
      logical :: is_plain_scene

      if (.not. scene%wants_response) return
      is_plain_scene = is_plain(run_of(scene)) .and. .not. scene%has_supports .and. scene%response%mode_count == 0
      if (is_plain_scene .and. scene%response%method /= method_newmark) then
         if (scene%mesh%mass /= mass_redistributed) return
      end if
      if (scene%wants_sweep) then
         if (any(is_swept(scene%sweep%swept) .and. changes_start(scene%sweep%swept%parameter, is_plain_scene))) return
      end if
      if (.not. scene%wants_cases) then
         call check_run(scene, scene, '', .true., model, error)
         return
      end if
      one = scene
      associate (parameter => scene%cases%parameter)
         do i = 1, size(scene%cases%values)
            if (i > 1 .and. .not. changes_start(parameter, is_plain_scene)) return
            call set_parameters(one, [parameter], [scene%cases%values(i)], problem)
            if (allocated(problem)) then
               call complain_of_scene(scene, 'cases', 'values', trim(parameter%name)//' = ' &
                  //to_text(scene%cases%values(i))//': '//problem, error)
               return
            end if
            call check_run(scene, one, trim(parameter%name)//' = '//to_text(scene%cases%values(i))//': ', &
               i == 1 .or. parameter%is_of_beam, model, error)
            if (allocated(error)) return
         end do
      end associate
   end subroutine check_scene

   !> Can this run start?
   subroutine check_run(scene, one, subject, is_new_beam, model, error)
      !> The scene as read
      type(scene_t), intent(in) :: scene
      !> The same with the values of this run
      type(scene_t), intent(in) :: one
      !> Which run it is, in words
      character(*), intent(in) :: subject
      !> The beam must be made
      logical, intent(in) :: is_new_beam
      type(beam_model_t), intent(inout) :: model
      !> What keeps it from starting
      type(failure_t), allocatable, intent(inout) :: error

      character(*), parameter :: of_stops(3) = [character(13) :: 'the beam', 'the stops at ', 'the position ']
      type(failure_t), allocatable :: trouble
      integer :: i

      if (is_new_beam) call motion_model_of(one, one%mesh%elements, one%mesh%ratio, model, trouble)
      if (.not. allocated(trouble)) call check_motion(model, run_of(one), trouble)
      if (.not. allocated(trouble)) return
      if (index(trouble%message, 'mass = ') == 1) then
         call complain_of_scene(scene, 'mesh', 'mass', subject//trouble%message, error)
      else if (index(trouble%message, 'contact_tolerance ') == 1) then
         call complain_of_scene(scene, 'response', 'contact_tolerance', subject//trouble%message, error)
      else if (index(trouble%message, 'the mode of the start ') == 1) then
         call complain_of_scene(scene, 'start', 'mode', subject//trouble%message, error)
      else if (index(trouble%message, 'the support at ') == 1) then
         call complain_of_scene(scene, 'support', '', subject//trouble%message, error)
      else if (any([(index(trouble%message, trim(of_stops(i))) == 1, i=1, size(of_stops))])) then
         call complain_of_scene(scene, 'stop', '', subject//trouble%message, error)
      else
         call complain_of_scene(scene, 'response', 'step step_time', &
            subject//trouble%message, error)
      end if
   end subroutine check_run

   !> Does the longest step of a Newmark scheme, or the start in a mode or among several stops, depend on it?
   elemental function changes_start(parameter, is_plain_scene) result(changes)
      type(parameter_t), intent(in) :: parameter
      !> One stop below the beam
      logical, intent(in) :: is_plain_scene
      logical :: changes

      changes = parameter%is_of_beam .or. parameter%name == 'zeta' .or. parameter%name == 'start_mode' .or. &
         (parameter%group == 'stop' .and. .not. is_plain_scene)
   end function changes_start

end module scene_checks
