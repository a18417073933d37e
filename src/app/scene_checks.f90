!> What the text of a scene does not tell but its beam does, told before anything runs.
module scene_checks
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use kinds, only: wp
   use motion_run, only: check_motion
   use number_text, only: to_text
   use run_settings, only: method_newmark
   use scene_beam_model, only: motion_model_of, run_of
   use scene_reader, only: complain_of_scene, draft_t, set_parameters
   use scene_types, only: mass_redistributed, scene_t
   use stop_contacts, only: has_one_contact
   use sweep_plan, only: case_values, make_plan, plan_t
   use sweep_settings, only: is_swept, parameter_t
   implicit none (type, external)
   private
   public :: check_scene, misfits_of

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
      logical :: is_lost, is_alone

      if (.not. scene%wants_response) return
      if (scene%wants_sweep .and. scene%has_misfits) then
         problem = misfits_of(scene, is_lost)
         if (is_lost) call complain_of_scene(scene, 'sweep', '', problem, error)
         if (is_lost) return
      end if
      is_alone = has_one_contact(run_of(scene), merge(1, 0, scene%has_supports)) .and. &
         scene%response%mode_count == 0
      if (is_alone .and. scene%response%method /= method_newmark) then
         if (scene%mesh%mass /= mass_redistributed) return
      end if
      if (scene%wants_sweep) then
         if (any(is_swept(scene%sweep%swept) .and. changes_start(scene%sweep%swept%parameter, is_alone))) return
      end if
      if (.not. scene%wants_cases) then
         call check_run(scene, scene, '', .true., model, error)
         return
      end if
      one = scene
      associate (parameter => scene%cases%parameter)
         do i = 1, size(scene%cases%values)
            if (i > 1 .and. .not. changes_start(parameter, is_alone)) return
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

      call find_trouble(one, is_new_beam, model, trouble)
      if (.not. allocated(trouble)) return
      if (index(trouble%message, 'mass = ') == 1) then
         call complain_of_scene(scene, 'mesh', 'mass', subject//trouble%message, error)
      else if (index(trouble%message, 'contact_tolerance ') == 1) then
         call complain_of_scene(scene, 'response', 'contact_tolerance', subject//trouble%message, error)
      else if (index(trouble%message, 'the mode of the start ') == 1) then
         call complain_of_scene(scene, 'start', 'mode', subject//trouble%message, error)
      else if (index(trouble%message, 'displacements of ') == 1) then
         call complain_of_scene(scene, 'start', 'displacement_ratios displacements', subject//trouble%message, error)
      else if (index(trouble%message, 'velocities of ') == 1) then
         call complain_of_scene(scene, 'start', 'velocity_ratios velocities', subject//trouble%message, error)
      else if (index(trouble%message, 'the support at ') == 1) then
         call complain_of_scene(scene, 'support', '', subject//trouble%message, error)
      else if (any([(index(trouble%message, trim(of_stops(i))) == 1, i=1, size(of_stops))])) then
         call complain_of_scene(scene, 'stop', '', subject//trouble%message, error)
      else
         call complain_of_scene(scene, 'response', 'step step_time', &
            subject//trouble%message, error)
      end if
   end subroutine check_run

   !> What keeps a run from starting.
   subroutine find_trouble(scene, is_new_beam, model, trouble)
      type(scene_t), intent(in) :: scene
      !> The beam must be made
      logical, intent(in) :: is_new_beam
      type(beam_model_t), intent(inout) :: model
      type(failure_t), allocatable, intent(out) :: trouble

      if (is_new_beam) call motion_model_of(scene, scene%mesh%elements, scene%mesh%ratio, model, trouble)
      if (.not. allocated(trouble)) call check_motion(model, run_of(scene), trouble)
   end subroutine find_trouble

   !> Cases of a sweep that cannot start, in words; of a long one some are looked at, from the first to the last. Empty:
   !> all can.
   function misfits_of(scene, are_all) result(words)
      !> Read and checked
      type(scene_t), intent(in) :: scene
      !> None can start
      logical, intent(out), optional :: are_all
      character(:), allocatable :: words

      integer, parameter :: most_cases = 1000
      type(draft_t), allocatable :: draft
      type(beam_model_t) :: model
      type(failure_t), allocatable :: trouble
      type(plan_t) :: plan
      type(scene_t) :: one
      character(:), allocatable :: problem
      real(wp), allocatable :: values(:)
      integer :: cases, failing, i, k
      logical :: has_beam

      words = ''
      has_beam = .false.
      if (present(are_all)) are_all = .false.
      if (.not. scene%wants_sweep) return
      call make_plan(scene, plan)
      allocate (draft)
      allocate (values(size(plan%axes)))
      cases = min(plan%cases, most_cases)
      failing = 0
      one = scene
      do i = 1, cases
         call case_values(plan, 1 + nint(real(i - 1, wp)*real(plan%cases - 1, wp)/real(max(cases - 1, 1), wp)), values)
         call set_parameters(one, plan%axes%parameter, values, problem, draft)
         ! a mesh that is to be found is not known yet
         if (.not. allocated(problem) .and. scene%mesh%tolerance <= 0.0_wp) then
            call find_trouble(one, .not. has_beam .or. any(plan%axes%parameter%is_of_beam), model, trouble)
            has_beam = model%mesh%elements > 0
            if (allocated(trouble)) problem = trouble%message
         end if
         if (.not. allocated(problem)) cycle
         failing = failing + 1
         if (failing > 1) cycle
         do k = 1, size(values)
            words = words//trim(plan%axes(k)%parameter%name)//' = '//to_text(values(k))//', '
         end do
         words = words(:len(words) - 2)//': '//problem
      end do
      if (failing == 0) return
      if (present(are_all)) are_all = failing == plan%cases
      words = to_text(failing)//' of '//to_text(cases)//' cases'//trim(merge(' looked at', '          ', &
         cases < plan%cases))//' cannot start; '//words
   end function misfits_of

   !> Does the longest step of a Newmark scheme, or the start in a mode or among several stops, depend on it?
   elemental function changes_start(parameter, is_alone) result(changes)
      type(parameter_t), intent(in) :: parameter
      !> It is about one contact
      logical, intent(in) :: is_alone
      logical :: changes

      changes = parameter%is_of_beam .or. parameter%name == 'zeta' .or. parameter%name == 'start_mode' .or. &
         (parameter%group == 'stop' .and. .not. is_alone)
   end function changes_start

end module scene_checks
