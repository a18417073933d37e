!> A fit from one start. A fit is repeated from many starts (multistart), because the sum of squares has local minima.
!> The starts are cases of a sweep plan: the parameters of a case are the start, and its extra values, stored beside its
!> measures, are the fitted parameters.
module fit_start
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use case_runs, only: runner_t
   use fit_model, only: coordinates_of, fit_count, fit_model_t, neutral, parameters_of_signal, start_model
   use inference_settings, only: observed_table
   use kinds, only: wp
   use least_squares, only: final_tolerance, minimise
   use measure_list, only: measure_status, measure_table
   use measure_rows, only: row_in_units
   use motion_run, only: set_store_t
   use quantities, only: units_in
   use response_types, only: response_t
   use run_measures, only: row_of
   use sweep_plan, only: make_plan, plan_t
   implicit none (type, external)
   private
   public :: fit_from, find_start_values, extras_of_fit

contains

   !> Number of extra values of a case: the fitted parameters, the weighted sum of squared residuals, and the number of
   !> runs.
   pure integer function extras_of_fit(parameters)
      !> Number of fitted parameters
      integer, intent(in) :: parameters

      extras_of_fit = parameters + 2
   end function extras_of_fit

   !> Fit from a start by minimisations in passes. The first pass fits only the beginning of the signal, each further
   !> pass a longer part of the signal, because the later part depends more strongly on the parameters and has many
   !> local minima. If a signal jumps at impacts, the sum of squares jumps whenever a change of the parameters moves an
   !> impact across the instant of a sample. All passes but the last therefore fit the integrals of the residuals over
   !> time, which are continuous.
   subroutine fit_from(runner, start_values, measures, reason, sets, extras)
      type(runner_t), target, intent(inout) :: runner
      !> Start: parameters of the sweep, in the order of the axes
      real(wp), intent(in) :: start_values(:)
      !> Measures of the run with the fitted parameters
      real(wp), intent(out) :: measures(:)
      !> Reason of a failure; unallocated: no failure
      character(:), allocatable, intent(out) :: reason
      !> Cache of the modes of the beam for each combination of closed contacts, shared by all runs of the fit
      type(set_store_t), target, intent(inout) :: sets
      !> Extra values as `extras_of_fit` lists them
      real(wp), intent(out) :: extras(:)

      ! status of a case whose run failed
      real(wp), parameter :: status_failed = 1.0_wp
      ! tolerance of all minimisations but the last, whose results are only starts
      real(wp), parameter :: start_tolerance = 1.0e-4_wp
      ! fraction of the signal that each pass fits; the last pass is only for signals with jumps, without integration
      real(wp), parameter :: fitted_fraction(7) = [0.125_wp, 0.25_wp, 0.375_wp, 0.5_wp, 0.75_wp, 1.0_wp, 1.0_wp]
      type(fit_model_t), allocatable :: model
      type(plan_t) :: plan
      type(response_t) :: response
      ! fitted parameters
      real(wp), allocatable :: parameters(:)
      ! unbounded coordinates that stand for the parameters in the minimisation
      real(wp), allocatable :: coordinates(:)
      real(wp), allocatable :: signal(:)
      real(wp) :: sum_of_squares, tolerance
      ! number of samples that a pass fits
      integer :: samples
      ! number of evaluations of the signal in a pass
      integer :: evaluations
      ! number of evaluations in all passes until now
      integer :: total_evaluations
      integer :: i, n
      logical :: is_last

      measures = merge(0.0_wp, ieee_value(1.0_wp, ieee_quiet_nan), measure_table%is_whole)
      measures(measure_status) = status_failed
      extras = ieee_value(1.0_wp, ieee_quiet_nan)
      allocate (model)
      call make_plan(runner%scene, plan)
      call start_model(runner%scene, plan, runner, sets, model)
      associate (all_samples => size(model%fit%value), passes => size(fitted_fraction), &
         has_jumps => observed_table(model%fit%observed)%jumps)
         n = fit_count(runner%scene, size(start_values))
         allocate (parameters(n), coordinates(n), signal(all_samples))
         call find_start_values(model, start_values, parameters)
         coordinates = coordinates_of(model, parameters)
         total_evaluations = 0
         sum_of_squares = huge(1.0_wp)
         do i = 1, passes
            samples = nint(fitted_fraction(i)*real(all_samples, wp))
            ! fewer than two samples for each parameter do not determine the parameters
            if (samples < min(max(2*n, 8), all_samples)) cycle
            if (total_evaluations >= model%fit%evaluations) exit
            if (.not. has_jumps .and. i == passes) exit
            model%integrates = has_jumps .and. i < passes
            is_last = i == passes .or. (.not. has_jumps .and. samples == all_samples)
            tolerance = merge(final_tolerance, start_tolerance, is_last)
            call minimise(model, samples, tolerance, coordinates, sum_of_squares, evaluations, &
               model%fit%evaluations - total_evaluations)
            total_evaluations = total_evaluations + evaluations
            ! a parameter at the limit of its range is moved inside, so that it can leave the limit
            if (i < passes) coordinates = coordinates_of(model, model%parameters_at(coordinates))
         end do
      end associate
      parameters = model%parameters_at(coordinates)
      call model%find_signal(parameters, signal, response)
      if (allocated(model%reason)) then
         reason = model%reason
         return
      end if
      measures = row_in_units(units_in(runner%scene), row_of(response%measures))
      extras(:n) = parameters
      extras(n + 1) = sum(((signal - model%fit%value)/model%divisor)**2)
      extras(n + 2) = real(total_evaluations, wp)
   end subroutine fit_from

   !> Start values of the fitted parameters: those of the case, and the offset and scale that fit best with them.
   subroutine find_start_values(model, start_values, parameters)
      type(fit_model_t), intent(inout) :: model
      !> Parameters of the sweep, in the order of the axes
      real(wp), intent(in) :: start_values(:)
      !> Parameters of the sweep, then offset, scale and delay of the signal if they are fitted
      real(wp), intent(out) :: parameters(:)

      ! A fitted scale of smaller magnitude starts from 1, because the signal would hardly depend on the parameters
      real(wp), parameter :: min_scale = 1.0e-3_wp
      ! maximum magnitude of a scale at the start, inside the range of +-100 in which it is fitted
      real(wp), parameter :: max_scale = 99.0_wp
      real(wp) :: signal(size(model%fit%value)), measured_mean, model_mean, scale
      integer :: n

      parameters = [start_values, pack(neutral, parameters_of_signal(model%fit))]
      if (.not. (model%fit%has_offset .or. model%fit%has_scale)) return
      call model%find_signal(parameters, signal)
      if (allocated(model%reason)) return
      n = size(signal)
      measured_mean = 0.0_wp
      model_mean = 0.0_wp
      if (model%fit%has_offset) measured_mean = sum(model%fit%value)/real(n, wp)
      if (model%fit%has_offset) model_mean = sum(signal)/real(n, wp)
      scale = 1.0_wp
      if (model%fit%has_scale) then
         associate (square => sum((signal - model_mean)**2))
            if (square > 0.0_wp) scale = sum((signal - model_mean)*(model%fit%value - measured_mean))/square
         end associate
         if (abs(scale) < min_scale) scale = 1.0_wp
         parameters(size(start_values) + merge(2, 1, model%fit%has_offset)) = min(max(scale, -max_scale), max_scale)
      end if
      if (model%fit%has_offset) parameters(size(start_values) + 1) = measured_mean - scale*model_mean
   end subroutine find_start_values

end module fit_start
