!> One case of a sweep: its run and the row of measures that remains of it.
module sweep_case
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use case_beam, only: case_beam_t, find_case_beam
   use failures, only: failure_t
   use kinds, only: wp
   use measure_list, only: measure_status, measure_table, peak_count
   use motion_run, only: run_motion
   use response_types, only: response_t
   use run_measures, only: row_of
   use run_settings, only: output_settings_t
   use scene_beam_model, only: run_of
   use scene_parameters, only: set_parameter
   use scene_types, only: scene_t
   use sweep_plan, only: plan_t
   implicit none (type, external)
   private
   public :: runner_t, start_runner, run_case

   !> It belongs to one thread.
   type :: runner_t
      private
      !> The scene with the parameters of the present case; it keeps measures only
      type(scene_t) :: scene
      type(case_beam_t) :: beam
   end type runner_t

contains

   !> Prepare a runner.
   subroutine start_runner(scene, runner)
      type(scene_t), intent(in) :: scene
      type(runner_t), intent(out) :: runner

      runner%scene = scene
      runner%scene%output = output_settings_t(history=.false., measures=.true., most_peaks=peak_count)
   end subroutine start_runner

   !> Run a case.
   subroutine run_case(runner, plan, values, row, reason)
      type(runner_t), intent(inout) :: runner
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
      call find_case_beam(runner%scene, values, plan%axes%parameter%is_of_beam, runner%beam)
      row = merge(0.0_wp, ieee_value(1.0_wp, ieee_quiet_nan), measure_table%is_whole)
      row(measure_status) = 1.0_wp
      if (allocated(runner%beam%trouble)) then
         reason = runner%beam%trouble%message
         return
      end if
      call run_motion(runner%beam%model, run_of(runner%scene), response, error, runner%beam%modes)
      if (allocated(error)) then
         reason = error%message
         return
      end if
      row = row_of(response%measures)
   end subroutine run_case

end module sweep_case
