!> Checks of a scene, the contents of one input file, that need the model of its beam and are made before any run.
module scene_checks
   use beam_model, only: beam_model_t
   use failures, only: failure_t, status_bad_input
   use kinds, only: wp
   use motion_run, only: check_motion
   use number_text, only: to_text
   use run_settings, only: method_newmark
   use scene_beam_model, only: model_of, run_settings_of
   use scene_reader, only: complain_of_position, complain_of_scene, draft_t, set_parameters, values_in_words
   use scene_types, only: mass_redistributed, scene_t
   use stop_contacts, only: has_one_contact
   use sweep_plan, only: case_values, make_plan, plan_t
   use sweep_settings, only: is_swept, parameter_t
   implicit none (type, external)
   private
   public :: check_scene, failing_cases, locate_failure

   !> Beginning of a message, and the group and the names that it is about; the last for all other messages.
   character(*), parameter :: subjects(3, 10) = reshape([character(40) :: &
      'mass = ', 'mesh', 'mass', &
      'contact_tolerance ', 'response', 'contact_tolerance', &
      'modes must be ', 'response', 'modes', &
      'the mode of the start ', 'start', 'mode', &
      'displacements of ', 'start', 'displacement_ratios displacements', &
      'velocities of ', 'start', 'velocity_ratios velocities', &
      'the support at ', 'support', '', &
      'the beam', 'stop', '', &
      'the stops at ', 'stop', '', &
      '', 'response', 'step step_time'], [3, 10])

contains

   !> Check that the runs of a scene can start. A sweep records failed cases as rows, so it is refused only if all cases
   !> fail.
   subroutine check_scene(scene, error)
      !> The scene, which was read without a failure
      type(scene_t), intent(in) :: scene
      !> Reason why a run cannot start, with file, line, group and name
      type(failure_t), allocatable, intent(out) :: error

      type(beam_model_t) :: model
      type(scene_t) :: modified
      character(:), allocatable :: problem
      integer :: i
      logical :: all_fail
      ! whether the run has a single contact and all modes
      logical :: single_contact

      if (.not. scene%wants_response) return
      if (scene%wants_sweep .and. scene%has_inconsistent_cases) then
         problem = failing_cases(scene, all_fail)
         if (all_fail) call complain_of_scene(scene, 'sweep', '', problem, error)
         if (all_fail) return
      end if
      single_contact = has_one_contact(run_settings_of(scene), merge(1, 0, scene%has_supports)) .and. &
         scene%response%mode_count == 0
      ! with one contact and all modes a run by the exact method can always start, unless inertia is redistributed
      if (single_contact .and. scene%response%method /= method_newmark) then
         if (scene%mesh%mass /= mass_redistributed) return
      end if
      ! if a swept parameter changes the start, each case is checked by its own run; a case that cannot start becomes a
      ! row of the results
      if (scene%wants_sweep) then
         if (any(is_swept(scene%sweep%swept) .and. changes_start(scene%sweep%swept%parameter, single_contact))) return
      end if
      if (.not. scene%wants_cases) then
         call check_run(scene, scene, '', .true., model, error)
         return
      end if
      modified = scene
      associate (parameter => scene%cases%parameter)
         do i = 1, size(scene%cases%list)
            ! if the parameter has no effect on the start, one case represents all
            if (i > 1 .and. .not. changes_start(parameter, single_contact)) return
            call set_parameters(modified, [parameter], [scene%cases%list(i)], problem)
            if (allocated(problem)) then
               call complain_of_scene(scene, 'cases', 'values', trim(parameter%name)//' = ' &
                  //to_text(scene%cases%list(i))//': '//problem, error)
               return
            end if
            call check_run(scene, modified, trim(parameter%name)//' = '//to_text(scene%cases%list(i))//': ', &
               i == 1 .or. parameter%changes_beam, model, error)
            if (allocated(error)) return
         end do
      end associate
   end subroutine check_scene

   !> Check that one run can start. The beginning of the failure's message decides which group and name of the scene are
   !> reported.
   subroutine check_run(scene, modified, subject, is_new_beam, model, error)
      !> The scene as read
      type(scene_t), intent(in) :: scene
      !> The scene with the parameter values of this run
      type(scene_t), intent(in) :: modified
      !> Description of the run, the start of the message
      character(*), intent(in) :: subject
      !> Whether the model of the beam must be made
      logical, intent(in) :: is_new_beam
      type(beam_model_t), intent(inout) :: model
      !> Reason why the run cannot start
      type(failure_t), allocatable, intent(inout) :: error

      type(failure_t), allocatable :: failure

      call find_failure(modified, is_new_beam, model, failure)
      if (allocated(failure)) call complain_of_run(scene, modified, subject, failure%message, error)
   end subroutine check_run

   !> Report a failure in the line of the group that it is about.
   subroutine complain_of_run(scene, modified, subject, message, error)
      !> The scene as read
      type(scene_t), intent(in) :: scene
      !> The scene with the parameter values of this run
      type(scene_t), intent(in) :: modified
      !> Description of the run, the start of the message
      character(*), intent(in) :: subject
      character(*), intent(in) :: message
      type(failure_t), allocatable, intent(inout) :: error

      integer :: i

      if (any([index(message, 'the position '), index(message, 'the beam')] == 1)) then
         call complain_of_position(scene, modified, subject, message, error)
      else
         i = subject_of(message)
         call complain_of_scene(scene, trim(subjects(2, i)), trim(subjects(3, i)), subject//message, error)
      end if
   end subroutine complain_of_run

   !> Name the file, and the line and group of the scene, in the failure of a run whose start was refused only by the
   !> run itself.
   subroutine locate_failure(scene, error)
      type(scene_t), intent(in) :: scene
      !> Failure of the run
      type(failure_t), allocatable, intent(inout) :: error

      type(failure_t), allocatable :: failure

      if (error%status == status_bad_input .and. subject_of(error%message) < size(subjects, 2)) then
         call move_alloc(error, failure)
         call complain_of_run(scene, scene, '', failure%message, error)
      else
         error%message = scene%file//': '//error%message
      end if
   end subroutine locate_failure

   !> Column of `subjects` for a message.
   pure integer function subject_of(message) result(i)
      character(*), intent(in) :: message

      i = findloc([(index(message, trim(subjects(1, i))) == 1, i=1, size(subjects, 2))], .true., dim=1)
   end function subject_of

   !> Find the reason why a run cannot start, if there is one.
   subroutine find_failure(scene, is_new_beam, model, failure)
      type(scene_t), intent(in) :: scene
      !> Whether the model of the beam must be made
      logical, intent(in) :: is_new_beam
      type(beam_model_t), intent(inout) :: model
      type(failure_t), allocatable, intent(out) :: failure

      if (is_new_beam) call model_of(scene, scene%mesh%elements, scene%mesh%ratio, model, failure, moves=.true.)
      if (.not. allocated(failure)) call check_motion(model, run_settings_of(scene), failure)
   end subroutine find_failure

   !> Description of the cases of a sweep that cannot start; empty: all can. Of a long sweep only some cases are tested,
   !> spread evenly from the first to the last.
   function failing_cases(scene, all_fail) result(words)
      !> The scene, read and checked
      type(scene_t), intent(in) :: scene
      !> Whether no case can start
      logical, intent(out), optional :: all_fail
      character(:), allocatable :: words

      integer, parameter :: max_cases = 1000
      type(draft_t), allocatable :: draft
      type(beam_model_t) :: model
      type(failure_t), allocatable :: failure
      type(plan_t) :: plan
      type(scene_t) :: modified
      character(:), allocatable :: problem
      real(wp), allocatable :: values(:)
      ! number of tested cases
      integer :: cases
      ! number of these cases that cannot start
      integer :: failing
      integer :: i
      logical :: has_beam

      words = ''
      has_beam = .false.
      if (present(all_fail)) all_fail = .false.
      if (.not. scene%wants_sweep) return
      call make_plan(scene, plan)
      allocate (draft)
      allocate (values(size(plan%axes)))
      cases = min(plan%cases, max_cases)
      failing = 0
      modified = scene
      do i = 1, cases
         call case_values(plan, 1 + nint(real(i - 1, wp)*real(plan%cases - 1, wp)/real(max(cases - 1, 1), wp)), values)
         call set_parameters(modified, plan%axes%parameter, values, problem, draft)
         ! a mesh that the run chooses by a tolerance is not known yet, so the start is not tested
         if (.not. allocated(problem) .and. scene%mesh%tolerance <= 0.0_wp) then
            call find_failure(modified, .not. has_beam .or. any(plan%axes%parameter%changes_beam), model, failure)
            has_beam = model%mesh%elements > 0
            if (allocated(failure)) problem = failure%message
         end if
         if (.not. allocated(problem)) cycle
         failing = failing + 1
         if (failing > 1) cycle
         words = values_in_words(plan%axes%parameter, values)//': '//problem
      end do
      if (failing == 0) return
      if (present(all_fail)) all_fail = failing == plan%cases
      words = to_text(failing)//' of '//to_text(cases)//' cases'//trim(merge(' tested', '       ', &
         cases < plan%cases))//' cannot start; '//words
   end function failing_cases

   !> Whether a parameter changes the maximum time step of a Newmark scheme, a start in a mode, or a start between
   !> several stops.
   elemental logical function changes_start(parameter, single_contact) result(changes)
      type(parameter_t), intent(in) :: parameter
      !> Whether the run has a single contact (and all modes)
      logical, intent(in) :: single_contact

      changes = parameter%changes_beam .or. parameter%name == 'zeta' .or. parameter%name == 'start_mode' .or. &
         (parameter%changes_contacts .and. .not. single_contact)
   end function changes_start

end module scene_checks
