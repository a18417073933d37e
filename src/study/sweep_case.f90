!> One case of a sweep: its run and the row of measures that remains of it.
!>
!> A runner keeps the beam of the case before, with its modes, for the next case if that has the same beam. It
!> belongs to one thread.
module sweep_case
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use free_modes, only: free_modes_t
   use kinds, only: wp
   use measure_list, only: measure_status, measure_table, peak_count
   use motion_run, only: find_shared_modes, run_motion
   use response_types, only: response_t
   use run_measures, only: row_of
   use run_settings, only: output_settings_t
   use scene_beam_model, only: model_of, run_of
   use scene_parameters, only: set_parameter
   use scene_types, only: scene_t
   use sweep_plan, only: plan_t
   implicit none (type, external)
   private
   public :: runner_t, start_runner, run_case

   type :: runner_t
      private
      !> The scene with the parameters of the present case; it keeps measures only
      type(scene_t) :: scene
      !> Parameters of the beam at hand, in the order of the axes; unallocated: there is none
      real(wp), allocatable :: beam_values(:)
      type(beam_model_t) :: model
      type(free_modes_t) :: modes
      !> Why it could not be made
      type(failure_t), allocatable :: trouble
   end type runner_t

contains

   !> Prepare a runner.
   subroutine start_runner(scene, runner)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> The runner
      type(runner_t), intent(out) :: runner

      runner%scene = scene
      runner%scene%output = output_settings_t(history=.false., measures=.true., most_peaks=peak_count)
   end subroutine start_runner

   !> Run a case.
   subroutine run_case(runner, plan, values, row, reason)
      !> The runner
      type(runner_t), intent(inout) :: runner
      !> The plan
      type(plan_t), intent(in) :: plan
      !> Parameters of the case, in the order of the axes
      real(wp), intent(in) :: values(:)
      !> Its measures, [measure_count]
      real(wp), intent(out) :: row(:)
      !> Why it failed; unallocated: it did not
      character(:), allocatable, intent(out) :: reason

      type(response_t) :: response
      type(failure_t), allocatable :: error
      integer :: k

      do k = 1, size(values)
         call set_parameter(runner%scene, plan%axes(k)%parameter, values(k))
      end do
      call find_beam(runner, plan, values)
      row = merge(0.0_wp, ieee_value(1.0_wp, ieee_quiet_nan), measure_table%is_whole)
      row(measure_status) = 1.0_wp
      if (allocated(runner%trouble)) then
         reason = runner%trouble%message
         return
      end if
      call run_motion(runner%model, run_of(runner%scene), response, error, runner%modes)
      if (allocated(error)) then
         reason = error%message
         return
      end if
      row = row_of(response%measures)
   end subroutine run_case

   !> Make the beam of a case, unless it is at hand.
   subroutine find_beam(runner, plan, values)
      !> The runner; its parameters are set
      type(runner_t), intent(inout) :: runner
      !> The plan
      type(plan_t), intent(in) :: plan
      !> Parameters of the case
      real(wp), intent(in) :: values(:)

      if (allocated(runner%beam_values)) then
         if (all(abs(values - runner%beam_values) <= 0.0_wp .or. .not. plan%axes%parameter%is_of_beam)) return
         deallocate (runner%beam_values)
      end if
      allocate (runner%beam_values, source=values)
      if (allocated(runner%trouble)) deallocate (runner%trouble)
      associate (scene => runner%scene)
         call model_of(scene, scene%mesh%elements, scene%mesh%ratio, runner%model, runner%trouble)
         if (.not. allocated(runner%trouble)) call find_shared_modes(runner%model, run_of(scene), runner%modes, runner%trouble)
      end associate
   end subroutine find_beam

end module sweep_case
