!> The study of a scene with &fit: parameters are fitted to a measured signal from several starts, which are the cases
!> of a sweep. Estimates and their errors follow from the best start.
module fit_study
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use, intrinsic :: iso_c_binding, only: c_size_t
   use case_runs, only: runner_t
   use checksums, only: checksum_of_numbers
   use failures, only: fail, failure_t, status_run_failed
   use fit_model, only: coordinates_of, fit_count, fit_model_t, fit_names, max_name_length, &
      parameters_of_signal, start_model
   use fit_results, only: fit_t, print_fit, write_fit, find_certainty, growth_rate, whiteness
   use fit_start, only: extras_of_fit, fit_from
   use inference_settings, only: observed_table
   use kinds, only: pi, wp
   use least_squares, only: final_tolerance, minimise
   use motion_run, only: set_store_t
   use number_text, only: to_text
   use quantities, only: units_t, units_in
   use quantity_groups, only: quantity_group_t
   use reader_units, only: scene_unit_of, unit_in
   use results_file, only: begin_results, finish_results
   use scene_types, only: scene_t
   use singular_vectors, only: find_singular
   use sorting, only: ascending_order
   use study_job, only: job_t
   use sweep_best, only: update_search, next_poll, search_state_t, start_search
   use sweep_chunks, only: chunk_rows_t, load_chunks, remove_chunk_folder
   use sweep_plan, only: make_plan, plan_t
   use sweep_ranks, only: is_first_rank
   use sweep_run, only: start_plan
   use sweep_study, only: plan_run_t, run_plan
   implicit none (type, external)
   private
   public :: run_fit, plan_starts, find_estimates

   !> Added to the coordinates of the parameters, which are angles, for the last minimisations: the steps of lmdif's
   !> differences are a fraction of a coordinate and would be rounding errors near 0, the middle of a range.
   real(wp), parameter :: whole_turn = 2.0_wp*pi

contains

   !> Fit the parameters, write the results file, print the table.
   subroutine run_fit(scene, job, error)
      !> Scene with &fit
      type(scene_t), intent(in) :: scene
      type(job_t), intent(in) :: job
      !> Set if there are no results
      type(failure_t), allocatable, intent(out) :: error

      type(plan_t) :: plan
      type(plan_run_t) :: run
      type(fit_t) :: fit
      type(quantity_group_t) :: root
      ! estimated size of the file
      integer(c_size_t), parameter :: expected_bytes = 200000_c_size_t
      type(chunk_rows_t) :: starts
      integer :: n

      call plan_starts(scene, plan)
      call run_plan(scene, plan, job, run, error)
      if (allocated(error) .or. .not. is_first_rank()) return
      call load_chunks(plan, starts, error)
      if (allocated(error)) return
      n = plan%extras - extras_of_fit(0)
      fit%started = starts%values
      fit%ended = starts%extras(:n, :)
      fit%sums = starts%extras(n + 1, :)
      fit%runs = starts%extras(n + 2, :)
      if (all(ieee_is_nan(fit%sums))) then
         call remove_chunk_folder(plan%path)
         call fail(error, status_run_failed, 'no start of the fit has a run: '//trim(starts%reasons(1)))
         return
      end if
      call find_estimates(scene, plan, fit)
      call begin_results(root, expected_bytes, scene)
      call write_fit(root%subgroup('fit'), scene, plan, fit)
      call finish_results(root, job%folder, scene, error)
      if (allocated(error)) return
      call remove_chunk_folder(plan%path)
      if (.not. job%quiet) call print_fit(job%unit, scene, plan, fit)
   end subroutine run_fit

   !> Plan the starts. Each start is a chunk of its own, so that finished starts survive an interrupted run.
   subroutine plan_starts(scene, plan)
      !> Scene with &fit
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(out) :: plan

      call make_plan(scene, plan)
      plan%chunk_cases = 1
      plan%chunks = plan%cases
      plan%extras = extras_of_fit(fit_count(scene, size(plan%axes)))
      plan%run => fit_from
      plan%remark = 'signal, checksum '//to_text(checksum_of_numbers([scene%fit%time, scene%fit%value, &
         scene%fit%noise_of_value]))
   end subroutine plan_starts

   !> Find the estimates and their errors from the best of all starts.
   subroutine find_estimates(scene, plan, fit)
      !> Scene with &fit
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      !> On entry results of the starts; on return all other components
      type(fit_t), intent(inout) :: fit

      ! residuals below this fraction of the standard deviation of the signal are rounding errors
      real(wp), parameter :: rounding_residual = 1.0e-8_wp
      integer, parameter :: passes = 3
      ! a motion counts as chaotic if small changes of parameters grow by more than this power of e over the signal;
      ! changes that are proportional to time grow by less
      real(wp), parameter :: chaotic = 5.0_wp
      type(runner_t), allocatable, target :: runner
      type(set_store_t), target :: sets
      type(fit_model_t), allocatable :: model
      real(wp), allocatable :: jacobian(:, :), step(:), x(:)
      ! noise of each value relative to the RMS of the noise, [samples]
      real(wp), allocatable :: relative_noise(:)
      ! residuals divided by `relative_noise`, [samples]
      real(wp), allocatable :: residual(:)
      real(wp) :: noise, sum_of_squares
      integer :: best, evaluations, i, k

      allocate (runner, model)
      call start_plan(scene, plan, runner)
      call start_model(scene, plan, runner, sets, model)
      best = minloc(fit%sums, dim=1, mask=.not. ieee_is_nan(fit%sums))
      ! minimise once more from the end of the best fit, because its differences used steps that suited its start
      x = whole_turn + coordinates_of(model, fit%ended(:, best))
      call minimise(model, size(scene%fit%value), final_tolerance, x, sum_of_squares, evaluations, &
         scene%fit%evaluations)
      allocate (fit%values, source=fit%ended(:, best))
      if (sum_of_squares < fit%sums(best)) fit%values = model%parameters_at(x)
      fit%sums(best) = min(fit%sums(best), sum_of_squares)
      allocate (fit%names, source=fit_names(scene, plan))
      allocate (fit%units(size(fit%names)))
      call name_units(scene, plan, fit%units)
      allocate (fit%minimum, source=model%minimum)
      allocate (fit%maximum, source=model%maximum)
      allocate (fit%model(size(scene%fit%value)), step(size(fit%values)))
      if (observed_table(scene%fit%observed)%jumps) call search_nearby(model, fit%values, fit%sums(best))
      fit%ended(:, best) = fit%values
      call model%find_signal(fit%values, fit%model)
      fit%missing = model%missing
      step = 0.0_wp
      do i = 1, passes
         call find_jacobian(model, fit%values, fit%model, step, jacobian)
         ! the step of each parameter changes the signal by as much as the noise, so that the derivative averages over
         ! events that appear or disappear within a smaller change
         noise = norm2(scene%fit%value - fit%model)/sqrt(real(size(fit%model), wp))
         do k = 1, size(step)
            step(k) = noise/max(norm2(jacobian(:, k)), noise/(fit%maximum(k) - fit%minimum(k)), tiny(1.0_wp))
         end do
      end do
      allocate (relative_noise, source=model%divisor*sqrt(real(size(fit%model), wp))/norm2(model%divisor))
      allocate (residual, source=(scene%fit%value - fit%model)/relative_noise)
      call find_certainty(jacobian/spread(relative_noise, 2, size(step)), fit%maximum - fit%minimum, model%spread, &
         residual, norm2(scene%fit%noise_of_value)/sqrt(real(size(residual), wp)), fit%certainty)
      fit%is_exact = fit%certainty%noise < rounding_residual*model%spread
      allocate (fit%interval_share, source=share_at_interval_ends(model, fit, jacobian))
      if (.not. observed_table(scene%fit%observed)%is_feature) fit%growth_rate = growth_rate(scene%fit%time, &
         jacobian(:, pack([(k, k=1, size(step))], fit%certainty%is_determined)))
      noise = max(fit%certainty%noise, rounding_residual*model%spread)
      associate (time => scene%fit%time)
         if (fit%growth_rate*(time(size(time)) - time(1)) > chaotic) fit%horizon = time(1) + &
            log(max(model%spread/noise, 1.0_wp))/fit%growth_rate
      end associate
      fit%whiteness = whiteness(residual)
      fit%agreeing = agreeing_starts(model, fit)
   end subroutine find_estimates

   !> Search the neighbourhood of the best parameters without derivatives, and minimise again from the best point found.
   !> A signal with jumps has many local minima of the sum of squares, one for each sample at which an impact may lie.
   !> Each search begins at the minimum without outliers. The first search is in a box. The valley of the sum of squares
   !> may be much longer than wide, so the last searches are in its principal axes, some standard errors to each side.
   subroutine search_nearby(model, values, minimum)
      type(fit_model_t), intent(inout) :: model
      !> Parameters of the minimum sum of squares so far; on return improved
      real(wp), intent(inout) :: values(:)
      !> Minimum sum of squares
      real(wp), intent(inout) :: minimum

      ! width of the neighbourhood, in the unbounded coordinates, whose range is -pi/2 to pi/2
      real(wp), parameter :: box = 0.04_wp
      ! first step of the search, as a fraction of the neighbourhood
      real(wp), parameter :: first_step = 0.125_wp
      ! last step, as a fraction of the neighbourhood
      real(wp), parameter :: precision = 1.0e-5_wp
      ! number of searches
      integer, parameter :: rounds = 4
      ! maximum number of points in each search
      integer, parameter :: max_points = 600
      type(search_state_t) :: state
      real(wp), allocatable :: points(:, :), residual(:), sums(:)
      ! edges of the region that is searched, in the unbounded coordinates, as columns
      real(wp) :: edges(size(values), size(values))
      ! parameters of the minimum without outliers, and its sum of squares
      real(wp) :: found(size(values)), others
      real(wp) :: centre(size(values)), x(size(values)), sum_of_squares
      integer :: evaluations, i, k

      allocate (residual(size(model%fit%value)))
      do i = 1, rounds
         found = values
         others = minimum
         call minimise_without_outliers(model, found, others)
         centre = whole_turn + coordinates_of(model, found)
         if (i == 1) then
            edges = 0.0_wp
            do k = 1, size(values)
               edges(k, k) = box
            end do
         else
            call find_principal_edges(model, found, others, box, edges)
         end if
         call model%evaluate(centre, residual)
         call start_search(spread(0.5_wp, 1, size(values)), sum(residual**2), first_step, precision, max_points, i, &
            state)
         do while (.not. state%is_over)
            call next_poll(state, points)
            allocate (sums(size(points, 2)))
            do k = 1, size(sums)
               call model%evaluate(centre + matmul(edges, points(:, k) - 0.5_wp), residual)
               sums(k) = sum(residual**2)
            end do
            call update_search(state, points, sums)
            deallocate (sums)
         end do
         x = centre + matmul(edges, state%best - 0.5_wp)
         call minimise(model, size(residual), final_tolerance, x, sum_of_squares, evaluations, model%fit%evaluations)
         if (sum_of_squares >= minimum) cycle
         minimum = sum_of_squares
         values = model%parameters_at(x)
      end do
   end subroutine search_nearby

   !> Minimise without outliers. The residual of a sample on the wrong side of an impact is the jump of the signal. It
   !> leads the parameters away from the minimum of the other samples.
   subroutine minimise_without_outliers(model, values, minimum)
      type(fit_model_t), intent(inout) :: model
      !> On entry parameters of a minimum of the sum of squares of all samples; on return of that of the others
      real(wp), intent(inout) :: values(:)
      !> This sum of squares
      real(wp), intent(inout) :: minimum

      ! magnitude of an outlier in medians of the magnitudes of all residuals: six standard deviations of normal noise
      real(wp), parameter :: far = 9.0_wp
      ! maximum number of minimisations, each of which may bring other samples to the other side of an impact
      integer, parameter :: passes = 4
      real(wp) :: divisor(size(model%divisor)), residual(size(model%divisor)), x(size(values)), limit
      integer :: evaluations, pass

      divisor = model%divisor
      do pass = 1, passes
         x = whole_turn + coordinates_of(model, values)
         call model%evaluate(x, residual)
         residual = abs(residual)
         associate (order => ascending_order(residual))
            limit = far*residual(order((size(order) + 1)/2))
         end associate
         if (.not. any(residual > limit)) exit
         where (residual > limit) model%divisor = sqrt(huge(1.0_wp))
         call minimise(model, size(residual), final_tolerance, x, minimum, evaluations, model%fit%evaluations)
         values = model%parameters_at(x)
         model%divisor = divisor
      end do
   end subroutine minimise_without_outliers

   !> Edges of a region along the principal axes of the sum of squares, some standard errors long.
   subroutine find_principal_edges(model, values, minimum, longest, edges)
      type(fit_model_t), intent(inout) :: model
      !> Parameters of the minimum sum of squares
      real(wp), intent(in) :: values(:)
      !> Minimum sum of squares
      real(wp), intent(in) :: minimum
      !> Maximum length of an edge
      real(wp), intent(in) :: longest
      !> Edges in the unbounded coordinates, as columns
      real(wp), intent(out) :: edges(:, :)

      ! length of an edge in standard errors
      real(wp), parameter :: errors = 8.0_wp
      ! small change of a coordinate
      real(wp), parameter :: change = 1.0e-6_wp
      real(wp), allocatable :: jacobian(:, :), singular(:), vectors(:, :)
      real(wp) :: signal(size(model%fit%value)), rates(size(values)), step(size(values)), x(size(values)), noise
      integer :: info, k

      x = coordinates_of(model, values)
      rates = (model%parameters_at(x + change) - model%parameters_at(x - change))/(2.0_wp*change)
      call model%find_signal(values, signal)
      step = 0.0_wp
      call find_jacobian(model, values, signal, step, jacobian)
      noise = sqrt(minimum/real(size(signal), wp))
      do k = 1, size(values)
         jacobian(:, k) = jacobian(:, k)*rates(k)/model%divisor
      end do
      call find_singular(jacobian, .true., singular, vectors, info)
      do k = 1, size(values)
         edges(:, k) = vectors(:, k)*errors*noise/max(singular(k), errors*noise/longest, tiny(1.0_wp))
      end do
   end subroutine find_principal_edges

   !> Units of the fitted parameters.
   subroutine name_units(scene, plan, names)
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      character(max_name_length), intent(out) :: names(:)

      ! units of offset, scale and delay
      character(max_name_length) :: of_signal(3)
      type(units_t) :: units
      integer :: k

      units = units_in(scene)
      do k = 1, size(plan%axes)
         names(k) = scene_unit_of(units, plan%axes(k)%parameter%quantity)
      end do
      of_signal = '1'
      of_signal(1) = unit_in(units, observed_table(scene%fit%observed)%quantity)
      of_signal(3) = unit_in(units, 'time')
      names(size(plan%axes) + 1:) = pack(of_signal, parameters_of_signal(scene%fit))
      where (names == '') names = '1'
   end subroutine name_units

   !> Derivatives of the signal with respect to the fitted parameters, by central differences, at a limit of the range
   !> by one-sided differences.
   subroutine find_jacobian(model, values, signal, step, jacobian)
      type(fit_model_t), intent(inout) :: model
      real(wp), intent(in) :: values(:)
      !> Signal for these values
      real(wp), intent(in) :: signal(:)
      !> Step of each parameter; the procedure limits it to a part of the range
      real(wp), intent(in) :: step(:)
      !> Derivatives, [samples, fitted parameters]
      real(wp), allocatable, intent(out) :: jacobian(:, :)

      real(wp), parameter :: min_relative_step = 1.0e-5_wp, max_relative_step = 0.01_wp
      real(wp) :: above(size(signal)), below(size(signal)), moved(size(values)), lower, upper
      integer :: k

      allocate (jacobian(size(signal), size(values)))
      do k = 1, size(values)
         associate (h => min(max(step(k), min_relative_step*max(abs(values(k)), 1.0e-3_wp*(model%maximum(k) - &
            model%minimum(k)))), max_relative_step*(model%maximum(k) - model%minimum(k))))
            upper = min(values(k) + h, model%maximum(k))
            lower = max(values(k) - h, model%minimum(k))
         end associate
         moved = values
         moved(k) = upper
         call model%find_signal(moved, above)
         if (allocated(model%reason)) above = signal
         if (allocated(model%reason)) upper = values(k)
         moved(k) = lower
         call model%find_signal(moved, below)
         if (allocated(model%reason)) below = signal
         if (allocated(model%reason)) lower = values(k)
         jacobian(:, k) = 0.0_wp
         if (upper > lower) jacobian(:, k) = (above - below)/(upper - lower)
         ! if an impact passes a sample within one of both steps, the signal jumps there, and only the other step has
         ! the derivative
         if (.not. observed_table(model%fit%observed)%jumps .or. upper <= values(k) .or. lower >= values(k)) cycle
         associate (rise => (above - signal)/(upper - values(k)), fall => (signal - below)/(values(k) - lower))
            where (abs(rise - fall) > 0.5_wp*abs(rise + fall)) &
               jacobian(:, k) = merge(rise, fall, abs(rise) < abs(fall))
         end associate
      end do
   end subroutine find_jacobian

   !> Increase of the sum of squares from the estimates to the ends of each 95 % interval, over the increase if the
   !> signal were linear in the parameters. The other parameters move along, as their covariance says. A share below 1
   !> says that the interval is too narrow. The smaller share of both ends counts.
   function share_at_interval_ends(model, fit, jacobian) result(share)
      type(fit_model_t), intent(inout) :: model
      type(fit_t), intent(in) :: fit
      !> Derivatives of the signal with respect to the parameters, [samples, parameters]
      real(wp), intent(in) :: jacobian(:, :)
      !> [parameters]; 1: not known
      real(wp) :: share(size(fit%values))

      real(wp) :: found(size(fit%model)), linear, moved(size(fit%values)), step(size(fit%values))
      integer :: k, side

      share = 1.0_wp
      if (fit%is_exact) return
      do k = 1, size(share)
         if (.not. fit%certainty%is_determined(k)) cycle
         associate (covariance => fit%certainty%covariance(:, k), half_width => fit%certainty%half_width(k))
            step = 0.0_wp
            where (fit%certainty%is_determined) step = covariance*half_width/covariance(k)
         end associate
         do side = -1, 1, 2
            moved = min(max(fit%values + real(side, wp)*step, fit%minimum), fit%maximum)
            linear = sum((matmul(jacobian, moved - fit%values)/model%divisor)**2)
            call model%find_signal(moved, found)
            if (allocated(model%reason) .or. linear <= 0.0_wp) cycle
            associate (value => model%fit%value)
               share(k) = min(share(k), (sum(((value - found)/model%divisor)**2) - &
                  sum(((value - fit%model)/model%divisor)**2))/linear)
            end associate
         end do
      end do
   end function share_at_interval_ends

   !> Number of starts that ended at the best estimates, compared in the parameters that the signal determines.
   pure integer function agreeing_starts(model, fit)
      type(fit_model_t), intent(in) :: model
      type(fit_t), intent(in) :: fit

      ! tolerance in coordinates (a range is -pi/2 to pi/2)
      real(wp), parameter :: nearby = 0.02_wp
      integer :: i

      agreeing_starts = 0
      do i = 1, size(fit%sums)
         if (ieee_is_nan(fit%sums(i))) cycle
         if (all(.not. fit%certainty%is_determined .or. abs(coordinates_of(model, fit%ended(:, i)) - &
            coordinates_of(model, fit%values)) < nearby)) agreeing_starts = agreeing_starts + 1
      end do
   end function agreeing_starts

end module fit_study
