!> A fit from one start, as a case of a sweep plan: the parameters of the case are the start, the extra values of the
!> case are the fitted parameters.
module fit_start
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use case_runs, only: runner_t
   use fit_model, only: coordinates_of, fit_count, fit_model_t, start_model
   use inference_settings, only: jumps
   use kinds, only: wp
   use least_squares, only: final_tolerance, minimise
   use measure_list, only: measure_status, measure_table
   use measure_rows, only: row_in_units
   use motion_run, only: set_store_t
   use response_types, only: response_t
   use run_measures, only: row_of
   use scene_units, only: units_in
   use sweep_plan, only: make_plan, plan_t
   implicit none (type, external)
   private
   public :: fit_from, extras_of_fit

contains

   !> Number of extra values of a case: the fitted parameters, the sum of the squares of residuals over their divisors,
   !> and the number of runs.
   pure integer function extras_of_fit(values)
      !> Number of fitted parameters
      integer, intent(in) :: values

      extras_of_fit = values + 2
   end function extras_of_fit

   !> Fit from a start. First only the beginning of the signal is fitted, then more and more of it: the later part
   !> depends more strongly on the parameters and has many local minima. Residuals of a signal that jumps at impacts are
   !> integrated over time until the last step, because each sample at which an impact may lie gives a local minimum.
   subroutine fit_from(runner, values, row, reason, sets, extras)
      type(runner_t), target, intent(inout) :: runner
      !> Start: parameters of the sweep, in the order of the axes
      real(wp), intent(in) :: values(:)
      !> Measures of the run with the fitted parameters
      real(wp), intent(out) :: row(:)
      !> Reason of a failure; unallocated: no failure
      character(:), allocatable, intent(out) :: reason
      type(set_store_t), target, intent(inout) :: sets
      !> Extra values as `extras_of_fit` lists them
      real(wp), intent(out) :: extras(:)

      real(wp), parameter :: fractions(7) = [0.125_wp, 0.25_wp, 0.375_wp, 0.5_wp, 0.75_wp, 1.0_wp, 1.0_wp]
      type(fit_model_t), allocatable :: model
      type(plan_t) :: plan
      type(response_t) :: response
      real(wp), allocatable :: x(:), found(:), signal(:)
      real(wp) :: sum_of_squares
      integer :: all_evaluations, count, evaluations, i, n

      row = merge(0.0_wp, ieee_value(1.0_wp, ieee_quiet_nan), measure_table%is_whole)
      row(measure_status) = 1.0_wp
      extras = ieee_value(1.0_wp, ieee_quiet_nan)
      allocate (model)
      call make_plan(runner%scene, plan)
      call start_model(runner%scene, plan, runner, sets, model)
      associate (all_values => size(model%fit%value))
         n = fit_count(runner%scene, size(values))
         allocate (found(n), x(n), signal(all_values))
         call find_start_values(model, values, found)
         x = coordinates_of(model, found)
         all_evaluations = 0
         sum_of_squares = huge(1.0_wp)
         ! The last pass, over the whole signal again, is only for a signal with jumps, then without integration. Passes
         ! before the last minimisation need no more than 1e-4; fewer than two values a parameter do not determine it
         do i = 1, size(fractions)
            count = nint(fractions(i)*real(all_values, wp))
            if (count < min(max(2*n, 8), all_values)) cycle
            if (all_evaluations >= model%fit%evaluations) exit
            model%integrates = jumps(model%fit%observed) .and. i < size(fractions)
            if (.not. jumps(model%fit%observed) .and. i == size(fractions)) exit
            call minimise(model, count, merge(final_tolerance, 1.0e-4_wp, i == size(fractions) .or. &
               (.not. jumps(model%fit%observed) .and. count == all_values)), x, &
               sum_of_squares, evaluations, model%fit%evaluations - all_evaluations)
            all_evaluations = all_evaluations + evaluations
            ! a parameter at the limit of its range is moved inside, so that it can leave the limit
            if (i < size(fractions)) x = coordinates_of(model, model%parameters_at(x))
         end do
      end associate
      found = model%parameters_at(x)
      call model%find_signal(found, signal, response)
      if (allocated(model%reason)) then
         reason = model%reason
         return
      end if
      row = row_in_units(units_in(runner%scene), row_of(response%measures))
      extras(:n) = found
      extras(n + 1) = sum(((signal - model%fit%value)/model%divisor)**2)
      extras(n + 2) = real(all_evaluations, wp)
   end subroutine fit_from

   !> Start values of the fitted parameters: those of the case, and the offset and scale that fit best with them.
   subroutine find_start_values(model, values, found)
      type(fit_model_t), intent(inout) :: model
      real(wp), intent(in) :: values(:)
      real(wp), intent(out) :: found(:)

      real(wp) :: signal(size(model%fit%value)), measured_mean, model_mean, slope
      integer :: k, n

      found(:size(values)) = values
      k = size(values)
      if (model%fit%has_offset) found(k + 1) = 0.0_wp
      if (model%fit%has_offset) k = k + 1
      if (model%fit%has_scale) found(k + 1) = 1.0_wp
      if (model%fit%time_shift > 0.0_wp) found(size(found)) = 0.0_wp
      if (.not. (model%fit%has_offset .or. model%fit%has_scale)) return
      call model%find_signal(found, signal)
      if (allocated(model%reason)) return
      n = size(signal)
      measured_mean = 0.0_wp
      model_mean = 0.0_wp
      if (model%fit%has_offset) measured_mean = sum(model%fit%value)/real(n, wp)
      if (model%fit%has_offset) model_mean = sum(signal)/real(n, wp)
      slope = 1.0_wp
      if (model%fit%has_scale) then
         associate (square => sum((signal - model_mean)**2))
            if (square > 0.0_wp) slope = sum((signal - model_mean)*(model%fit%value - measured_mean))/square
         end associate
         if (abs(slope) < 1.0e-3_wp) slope = 1.0_wp
         found(size(values) + merge(2, 1, model%fit%has_offset)) = min(max(slope, -99.0_wp), 99.0_wp)
      end if
      if (model%fit%has_offset) found(size(values) + 1) = measured_mean - slope*model_mean
   end subroutine find_start_values

end module fit_start
