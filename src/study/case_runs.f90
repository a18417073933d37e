!> Runs of several cases of one scene, one after the other: the beam of the case, its response, and the analyses of the
!> response. The cases of &cases store their responses, for figures with several curves; a sweep stores rows of
!> measures.
module case_runs
   use analyses, only: analyse, analysed_t
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use mesh_choice, only: case_beam_t, update_case_beam
   use motion_run, only: run_motion, set_store_t
   use number_text, only: to_text
   use response_types, only: response_t
   use run_settings, only: output_settings_t, run_settings_t
   use scene_beam_model, only: run_settings_of
   use scene_reader, only: draft_t, set_parameters
   use scene_types, only: scene_t
   use section_types, only: section_state_t
   use sweep_settings, only: parameter_t
   implicit none (type, external)
   private
   public :: runner_t, start_runner, set_case, run_case, case_interface, case_t, run_cases

   !> State of the runs of one thread.
   type :: runner_t
      !> The scene with the parameters of the current case
      type(scene_t) :: scene
      type(case_beam_t) :: beam
      !> Final state of the preceding case, from which the next case starts; unallocated: the cases are independent
      type(section_state_t), allocatable :: carried
      !> Contents of the scene file with its table of names, from which the scene of each case is made
      type(draft_t), private :: draft
      !> Values of the parameters in `scene`; unallocated: `scene` has those of the file
      real(wp), allocatable, private :: values(:)
      !> Parameters that differ from case to case
      type(parameter_t), allocatable, private :: parameter(:)
      !> Minimum of each parameter over all cases
      real(wp), allocatable, private :: minimum(:)
      !> Maximum of each parameter over all cases
      real(wp), allocatable, private :: maximum(:)
      !> The two cases from which the mesh is found: with the minimum and with the maximum values of all parameters that
      !> do not change the beam, [2]; unallocated: the mesh is given
      type(scene_t), allocatable, private :: extremes(:)
   end type runner_t

   !> One of the cases of &cases.
   type :: case_t
      !> The scene with the parameter of the case
      type(scene_t) :: scene
      !> x/L of the nodes, [0:n]
      real(wp), allocatable :: node_position(:)
      type(response_t) :: response
      !> Analyses of the run with their results
      type(analysed_t), allocatable :: analysed(:)
      !> Whether the case has run; if not, the other components but `reason` are not set
      logical :: has_run = .false.
      !> Reason of the failure, if the case has not run
      character(:), allocatable :: reason
   end type case_t

   abstract interface
      !> Compute a case otherwise than by one run; for example, fit a signal from the parameters of the case.
      subroutine case_interface(runner, values, row, reason, sets, extras)
         import :: runner_t, set_store_t, wp
         implicit none (type, external)
         type(runner_t), target, intent(inout) :: runner
         !> Parameters of the case, in the order of the axes
         real(wp), intent(in) :: values(:)
         !> Measures of the case, [measure_count]
         real(wp), intent(out) :: row(:)
         !> Reason of the failure; unallocated: no failure
         character(:), allocatable, intent(out) :: reason
         !> Cached contact sets (the beam with given closed contacts), shared by the runs of a thread
         type(set_store_t), target, intent(inout) :: sets
         !> Values of the case besides the measures
         real(wp), intent(out) :: extras(:)
      end subroutine case_interface
   end interface

contains

   !> Prepare a runner.
   subroutine start_runner(scene, output, parameter, minimum, maximum, runner)
      type(scene_t), intent(in) :: scene
      !> Results that are recorded in each run besides its measures
      type(output_settings_t), intent(in) :: output
      !> Parameters that differ from case to case
      type(parameter_t), intent(in) :: parameter(:)
      !> Minimum of each parameter over all cases
      real(wp), intent(in) :: minimum(:)
      !> Maximum of each parameter over all cases
      real(wp), intent(in) :: maximum(:)
      type(runner_t), intent(out) :: runner

      runner%scene = scene
      runner%scene%output = output
      runner%scene%output%measures = .true.
      runner%parameter = parameter
      runner%minimum = minimum
      runner%maximum = maximum
      if (scene%mesh%tolerance > 0.0_wp) allocate (runner%extremes(2), source=runner%scene)
   end subroutine start_runner

   !> Give the scene of a runner the parameters of a case. Its units of time and force may change with them.
   subroutine set_case(runner, values, error)
      type(runner_t), intent(inout) :: runner
      !> Values of the parameters
      real(wp), intent(in) :: values(:)
      !> Set if the scene refuses them
      type(failure_t), allocatable, intent(out) :: error

      character(:), allocatable :: problem
      integer :: i

      ! gfortran stores the lengths of texts that functions return in static variables, which threads would share
      !$omp critical (case_scenes)
      call set_parameters(runner%scene, runner%parameter, values, problem, runner%draft, runner%values)
      if (allocated(runner%extremes)) then
         do i = 1, 2
            ! the parameters that change the beam have the values of this case in both extreme cases
            if (.not. allocated(problem)) call set_parameters(runner%extremes(i), runner%parameter, merge(values, &
               merge(runner%minimum, runner%maximum, i == 1), runner%parameter%changes_beam), problem, runner%draft)
         end do
      end if
      !$omp end critical (case_scenes)
      if (allocated(problem)) call fail(error, status_run_failed, problem)
      if (.not. allocated(error)) runner%values = values
   end subroutine set_case

   !> Run the case that `set_case` set. Cases with the same beam share its modes.
   subroutine run_case(runner, response, analysed, error, sets, selection)
      type(runner_t), intent(inout) :: runner
      type(response_t), intent(out) :: response
      !> Analyses of the run with their results; empty if none is requested
      type(analysed_t), allocatable, intent(out) :: analysed(:)
      !> Set if the case fails
      type(failure_t), allocatable, intent(out) :: error
      !> Cached contact sets (the beam with given closed contacts), shared by several runs; absent: not shared
      type(set_store_t), target, intent(inout), optional :: sets
      !> `of_run` or `of_beam`: only analyses of this kind are computed; absent: all
      logical, intent(in), optional :: selection

      type(run_settings_t) :: settings

      call update_case_beam(runner%scene, runner%values, runner%parameter%changes_beam, runner%beam, runner%extremes)
      if (allocated(runner%beam%error)) error = runner%beam%error
      if (allocated(error)) return
      settings = run_settings_of(runner%scene)
      call run_motion(runner%beam%model, settings, response, error, runner%beam%modes, sets, runner%carried)
      if (allocated(runner%carried)) then
         ! the next case computes its own tangent for the Lyapunov exponent
         if (allocated(runner%carried%tangent)) deallocate (runner%carried%tangent)
      end if
      if (allocated(error)) return
      ! only a mesh that was found within a tolerance has a check
      if (runner%beam%check%finer_elements > 0) response%mesh_check = runner%beam%check
      call analyse(runner%scene, runner%beam%model, settings, response, analysed, error, selection)
   end subroutine run_case

   !> Run all cases of a scene, in the order of the values. A case that fails does not end the others.
   subroutine run_cases(scene, cases, error)
      !> A scene with &cases
      type(scene_t), intent(in) :: scene
      type(case_t), allocatable, intent(out) :: cases(:)
      !> Set if all cases fail
      type(failure_t), allocatable, intent(out) :: error

      ! allocated, because the type is large
      type(runner_t), allocatable :: runner
      type(set_store_t) :: sets
      type(failure_t), allocatable :: failure
      integer :: i

      allocate (runner)
      associate (parameter => scene%cases%parameter, values => scene%cases%list)
         call start_runner(scene, scene%output, [parameter], [minval(values)], [maxval(values)], runner)
         allocate (cases(size(values)))
         do i = 1, size(cases)
            call set_case(runner, [values(i)], failure)
            if (.not. allocated(failure)) call run_case(runner, cases(i)%response, cases(i)%analysed, failure, sets)
            cases(i)%has_run = .not. allocated(failure)
            if (allocated(failure)) then
               cases(i)%reason = trim(parameter%name)//' = '//to_text(values(i))//': '//failure%message
               cycle
            end if
            cases(i)%scene = runner%scene
            allocate (cases(i)%node_position, source=runner%beam%model%mesh%position)
         end do
      end associate
      if (.not. any(cases%has_run)) call fail(error, status_run_failed, 'all '//to_text(size(cases)) &
         //' cases failed, '//cases(1)%reason)
   end subroutine run_cases

end module case_runs
