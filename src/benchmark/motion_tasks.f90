!> Tasks that a precision study (run time against error) times: a run by any method, one part of a run, or the
!> computation of frequencies by one solver.
module motion_tasks
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use free_modes, only: find_free_modes, free_modes_t
   use frequency_study, only: solve_modes
   use kinds, only: wp
   use lanczos_solver, only: lanczos_modes
   use motion_run, only: run_motion
   use response_types, only: response_t
   use run_settings, only: method_newmark, output_settings_t, response_settings_t, run_settings_t, &
      strict_mode_tolerance
   use scene_beam_model, only: model_of, run_settings_of
   use scene_types, only: integrator_average, integrator_exact, integrator_linear, precision_settings_t, scene_t
   use timed_tasks, only: timed_task_t
   implicit none (type, external)
   private
   public :: task_t, task_assembly, task_modes, task_run, task_motion, task_few_modes, task_solver
   public :: prepare_task, settings_for, events_only, histories_and_energy

   !> Kinds of tasks: assemble the beam.
   integer, parameter :: task_assembly = 1
   !> Compute all modes of the beam.
   integer, parameter :: task_modes = 2
   !> Compute a run of the assembled beam, with the modes if the run needs them.
   integer, parameter :: task_run = 3
   !> Compute a run with modes that are already known.
   integer, parameter :: task_motion = 4
   !> Assemble the beam and compute its lowest modes.
   integer, parameter :: task_few_modes = 5
   !> Compute frequencies by one solver.
   integer, parameter :: task_solver = 6

   !> Output of events only.
   type(output_settings_t), parameter :: events_only = output_settings_t(history=.false.)
   !> Output of the default histories and of the energy balance.
   type(output_settings_t), parameter :: histories_and_energy = output_settings_t(energy=.true.)

   !> A task with its input and its results. `settings` and `output` replace those of the scene in a run.
   type, extends(timed_task_t) :: task_t
      !> Kind of the task, one of the `task_` constants
      integer :: action = task_run
      type(scene_t) :: scene
      type(response_settings_t) :: settings
      type(output_settings_t) :: output
      type(beam_model_t) :: model
      type(free_modes_t) :: modes
      !> Number of elements of the mesh to assemble
      integer :: elements = 0
      !> Length of an element over that of its neighbour towards the tip
      real(wp) :: ratio = 1.0_wp
      !> Number of modes to compute
      integer :: mode_count = 0
      !> Frequency solver: one of the `solver_` constants
      integer :: solver = 0
      !> Result: response of a run
      type(response_t) :: response
      !> Result: lambda of the modes
      real(wp), allocatable :: lambda(:)
   contains
      procedure :: run
   end type task_t

contains

   !> Prepare a task of a scene: assemble the beam; the output is set to events only.
   subroutine prepare_task(scene, elements, task, error, with_modes, mass)
      type(scene_t), intent(in) :: scene
      !> Number of elements
      integer, intent(in) :: elements
      !> Task; scene, mesh and model are set
      class(task_t), intent(inout) :: task
      !> Set if the assembly or the computation of modes fails
      type(failure_t), allocatable, intent(out) :: error
      !> Whether to compute all modes too; default false
      logical, intent(in), optional :: with_modes
      !> One of the `mass_` constants; default: that of the scene
      integer, intent(in), optional :: mass

      task%scene = scene
      if (present(mass)) task%scene%mesh%mass = mass
      task%elements = elements
      task%ratio = scene%mesh%ratio
      task%output = events_only
      task%action = task_assembly
      call task%run(error)
      if (allocated(error) .or. .not. present(with_modes)) return
      task%action = task_modes
      if (with_modes) call task%run(error)
   end subroutine prepare_task

   !> Execute the task once. All tasks but `task_assembly` and `task_few_modes` need the model of an earlier assembly,
   !> `task_motion` needs the modes too.
   subroutine run(self, error)
      class(task_t), intent(inout) :: self
      !> Set if the task fails
      type(failure_t), allocatable, intent(out) :: error

      ! shapes of the lowest modes, not used
      real(wp), allocatable :: modes(:, :)

      associate (scene => self%scene)
         select case (self%action)
         case (task_assembly)
            call model_of(scene, self%elements, self%ratio, self%model, error, moves=.true.)
         case (task_modes)
            call find_free_modes(self%model, self%modes, error)
         case (task_motion)
            call run_motion(self%model, run_of_task(self), self%response, error, self%modes)
         case (task_few_modes)
            call model_of(scene, self%elements, self%ratio, self%model, error, moves=.true.)
            if (allocated(error)) return
            call lanczos_modes(self%model, min(self%mode_count, self%elements), self%lambda, error, modes)
         case (task_solver)
            call solve_modes(self%model, self%solver, self%mode_count, self%lambda, error)
         case default
            call run_motion(self%model, run_of_task(self), self%response, error)
         end select
      end associate
   end subroutine run

   !> Settings of the scene's run, with the response settings and the output of the task.
   pure type(run_settings_t) function run_of_task(self) result(settings)
      type(task_t), intent(in) :: self

      settings = run_settings_of(self%scene)
      settings%response = self%settings
      settings%output = self%output
   end function run_of_task

   !> Settings of a run by one of the compared methods. The contact and release tolerances of Newmark's method are those
   !> of the paper at the paper's step of 0.01 and are proportional to the square of the step, as the error of the
   !> method is.
   pure type(response_settings_t) function settings_for(integrator, precision, step) result(settings)
      !> Method, one of the `integrator_` constants
      integer, intent(in) :: integrator
      !> Settings of the study
      type(precision_settings_t), intent(in) :: precision
      !> Newmark's step, or the interval of the samples of exact motion, tau
      real(wp), intent(in) :: step

      real(wp), parameter :: paper_step = 0.01_wp

      settings%duration = precision%duration
      settings%step = step
      ! without a given number of modes, the mode tolerance alone decides how many are used: an accuracy of 1 limits
      ! nothing
      settings%accuracy = 1.0_wp
      settings%mode_tolerance = strict_mode_tolerance
      settings%mode_count = precision%mode_count
      if (integrator == integrator_exact) return
      settings%method = method_newmark
      settings%contact_tolerance = settings%contact_tolerance*(step/paper_step)**2
      settings%release_tolerance = settings%release_tolerance*(step/paper_step)**2
      settings%substep = .true.
      ! average acceleration, linear acceleration, or central differences
      select case (integrator)
      case (integrator_average)
         settings%newmark_beta = 0.25_wp
      case (integrator_linear)
         settings%newmark_beta = 1.0_wp/6.0_wp
      case default
         settings%newmark_beta = 0.0_wp
      end select
   end function settings_for

end module motion_tasks
