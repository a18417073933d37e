!> Cases of one scene, one after the other: each its beam, its run, what is computed from that. Those of &cases keep
!> their responses, a figure of several curves; a sweep takes rows.
module case_runs
   use analyses, only: analyse, analysed_t
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use mesh_choice, only: case_beam_t, find_case_beam
   use motion_run, only: run_motion, set_store_t
   use number_text, only: to_text
   use response_types, only: response_t
   use run_settings, only: output_settings_t, run_settings_t
   use scene_beam_model, only: run_of
   use scene_reader, only: draft_t, set_parameters
   use scene_types, only: scene_t
   use section_types, only: section_state_t
   use sweep_settings, only: parameter_t
   implicit none (type, external)
   private
   public :: runner_t, start_runner, run_next, case_t, run_cases

   !> It belongs to one thread.
   type :: runner_t
      !> The scene with the parameters of the present case
      type(scene_t) :: scene
      type(case_beam_t) :: beam
      !> Motion where the case before ended; unallocated: each case is by itself
      type(section_state_t), allocatable :: carried
      type(draft_t), private :: draft
      !> What differs from case to case, and its least and greatest value
      type(parameter_t), allocatable, private :: parameter(:)
      real(wp), allocatable, private :: least(:)
      real(wp), allocatable, private :: most(:)
      !> The cases with the least and with the greatest values of what makes no other beam, [2]; unallocated: the mesh
      !> is given
      type(scene_t), allocatable, private :: extremes(:)
   end type runner_t

   type :: case_t
      !> The scene with the case's value
      type(scene_t) :: scene
      real(wp) :: value = 0.0_wp
      !> x/L of the nodes, [0:n]
      real(wp), allocatable :: node_position(:)
      type(response_t) :: response
      type(analysed_t), allocatable :: analysed(:)
   end type case_t

contains

   !> Prepare a runner.
   subroutine start_runner(scene, output, parameter, least, most, runner)
      type(scene_t), intent(in) :: scene
      !> What is kept of each run
      type(output_settings_t), intent(in) :: output
      !> What differs from case to case, and its least and greatest value
      type(parameter_t), intent(in) :: parameter(:)
      real(wp), intent(in) :: least(:)
      real(wp), intent(in) :: most(:)
      type(runner_t), intent(out) :: runner

      runner%scene = scene
      runner%scene%output = output
      runner%parameter = parameter
      runner%least = least
      runner%most = most
      if (scene%mesh%tolerance > 0.0_wp) allocate (runner%extremes(2), source=runner%scene)
   end subroutine start_runner

   !> Run a case. Cases of one beam share its modes.
   subroutine run_next(runner, values, response, analysed, error, sets, only_those)
      type(runner_t), intent(inout) :: runner
      !> Of the parameters
      real(wp), intent(in) :: values(:)
      type(response_t), intent(out) :: response
      type(analysed_t), allocatable, intent(out) :: analysed(:)
      !> Why it failed
      type(failure_t), allocatable, intent(out) :: error
      !> What runs among several stops share; absent: nothing
      type(set_store_t), target, intent(inout), optional :: sets
      !> Which analyses are done; absent: all
      logical, intent(in), optional :: only_those

      type(run_settings_t) :: settings
      character(:), allocatable :: problem
      integer :: i

      ! texts made by functions of gfortran keep their lengths in static variables, which threads would share
      !$omp critical (case_scenes)
      call set_parameters(runner%scene, runner%parameter, values, problem, runner%draft)
      if (allocated(runner%extremes)) then
         do i = 1, 2
            if (.not. allocated(problem)) call set_parameters(runner%extremes(i), runner%parameter, merge(values, &
               merge(runner%least, runner%most, i == 1), runner%parameter%is_of_beam), problem, runner%draft)
         end do
      end if
      !$omp end critical (case_scenes)
      if (allocated(problem)) then
         call fail(error, status_run_failed, problem)
         return
      end if
      call find_case_beam(runner%scene, values, runner%parameter%is_of_beam, runner%beam, runner%extremes)
      if (allocated(runner%beam%trouble)) then
         allocate (error, source=runner%beam%trouble)
         return
      end if
      settings = run_of(runner%scene)
      call run_motion(runner%beam%model, settings, response, error, runner%beam%modes, sets, runner%carried)
      if (allocated(runner%carried)) then
         ! the next case follows a variation of its own
         if (allocated(runner%carried%tangent)) deallocate (runner%carried%tangent)
      end if
      if (allocated(error)) return
      if (runner%beam%check%compared > 0) response%mesh_check = runner%beam%check
      call analyse(runner%scene, runner%beam%model, settings, response, analysed, error, only_those)
   end subroutine run_next

   !> Run all cases of a scene, in the order of the values.
   subroutine run_cases(scene, cases, error)
      !> The scene; it has &cases
      type(scene_t), intent(in) :: scene
      type(case_t), allocatable, intent(out) :: cases(:)
      !> Set when a run fails
      type(failure_t), allocatable, intent(out) :: error

      ! large
      type(runner_t), allocatable :: runner
      type(set_store_t) :: sets
      type(output_settings_t) :: output
      integer :: i

      output = scene%output
      output%measures = .true.
      allocate (runner)
      associate (parameter => scene%cases%parameter, values => scene%cases%values)
         call start_runner(scene, output, [parameter], [minval(values)], [maxval(values)], runner)
         allocate (cases(size(values)))
         do i = 1, size(cases)
            call run_next(runner, [values(i)], cases(i)%response, cases(i)%analysed, error, sets)
            if (allocated(error)) then
               error%message = trim(parameter%name)//' = '//to_text(values(i))//': '//error%message
               return
            end if
            cases(i)%scene = runner%scene
            cases(i)%value = values(i)
            allocate (cases(i)%node_position, source=runner%beam%model%mesh%position)
         end do
      end associate
   end subroutine run_cases

end module case_runs
