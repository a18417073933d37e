!> Model of a measured signal for &fit: the signal of a run as a function of fitted parameters. These are the parameters
!> of &sweep within their ranges and, if requested, offset, scale and delay of the signal.
module fit_model
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use analyses, only: analysed_t, of_run
   use case_runs, only: run_case, runner_t, set_case
   use failures, only: failure_t
   use history_list, only: force_stop
   use inference_settings, only: fit_settings_t, observed_acceleration_tip, observed_force, observed_impacts, &
      observed_table
   use kinds, only: pi, wp
   use least_squares, only: residuals_t
   use measure_list, only: peak_count
   use motion_run, only: set_store_t
   use quantities, only: quantity_named, units_t, units_in
   use response_types, only: is_impact, response_t
   use run_settings, only: count_samples, output_settings_t, response_settings_t, stop_settings_t
   use scene_types, only: all_stops, scene_t
   use scene_words, only: stop_of_release
   use sweep_plan, only: fraction_at_value, plan_t, value_at_fraction
   implicit none (type, external)
   private
   public :: fit_model_t, start_model, coordinates_of, fit_count, fit_names, max_name_length
   public :: parameters_of_signal, neutral

   !> Maximum length of the name of a parameter.
   integer, parameter :: max_name_length = 48

   !> Model of a signal as a function for the least-squares method.
   type, extends(residuals_t) :: fit_model_t
      !> Runs the cases
      type(runner_t), pointer :: runner => null()
      !> Contact sets that the runs share
      type(set_store_t), pointer :: sets => null()
      type(fit_settings_t) :: fit
      !> Minimum of each fitted parameter (those of the sweep first), [fitted parameters]
      real(wp), allocatable :: minimum(:)
      !> Maximum of each fitted parameter, [fitted parameters]
      real(wp), allocatable :: maximum(:)
      !> Whether the logarithm of the parameter is varied, [fitted parameters]
      logical, allocatable :: is_logarithmic(:)
      !> Whether residuals are integrated over time, because those of a signal with jumps do not depend smoothly on
      !> parameters
      logical :: integrates = .false.
      !> Standard deviation of the measured signal
      real(wp) :: spread = 1.0_wp
      !> Divisors of residuals: standard deviations of the noise or, if unknown, that of the signal, [samples]
      real(wp), allocatable :: divisor(:)
      !> Number of features of the signal that the last run does not have
      integer :: missing = 0
      !> Reason why the last run failed; unallocated: it did not fail
      character(:), allocatable :: reason
   contains
      procedure :: evaluate => evaluate_residuals
      procedure :: parameters_at
      procedure :: find_signal
      procedure, private :: find_signal_of_run
   end type fit_model_t

   !> Offset, scale and delay that do not change the signal.
   real(wp), parameter :: neutral(3) = [0.0_wp, 1.0_wp, 0.0_wp]

contains

   !> Whether offset, scale and delay of the signal are fitted, after the parameters of the sweep.
   pure function parameters_of_signal(fit) result(are_fitted)
      type(fit_settings_t), intent(in) :: fit
      logical :: are_fitted(3)

      are_fitted = [fit%has_offset, fit%has_scale, fit%max_time_shift > 0.0_wp]
   end function parameters_of_signal

   !> Number of fitted parameters: those of the sweep, and those of the signal.
   pure integer function fit_count(scene, parameters)
      type(scene_t), intent(in) :: scene
      !> Number of parameters of the sweep
      integer, intent(in) :: parameters

      fit_count = parameters + count(parameters_of_signal(scene%fit))
   end function fit_count

   !> Names of the fitted parameters, [fitted parameters].
   pure function fit_names(scene, plan) result(names)
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      character(max_name_length), allocatable :: names(:)

      allocate (names(size(plan%axes)))
      names(:) = plan%axes%parameter%name
      names = [character(max_name_length) :: names, pack([character(max_name_length) :: 'signal_offset', &
         'signal_scale', 'signal_delay'], parameters_of_signal(scene%fit))]
   end function fit_names

   !> Initialise the model of a scene.
   subroutine start_model(scene, plan, runner, sets, model)
      !> Scene with &fit
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      type(runner_t), target, intent(inout) :: runner
      type(set_store_t), target, intent(inout) :: sets
      type(fit_model_t), intent(out) :: model

      ! maximum magnitudes of offset, scale and delay of the signal
      real(wp) :: limits(3)
      integer :: n

      model%runner => runner
      model%sets => sets
      model%fit = scene%fit
      n = size(model%fit%value)
      model%spread = sqrt(sum((model%fit%value - sum(model%fit%value)/real(n, wp))**2)/real(n, wp))
      allocate (model%divisor, source=merge(model%fit%noise_of_value, model%spread, model%fit%noise_of_value > 0.0_wp))
      associate (fit => model%fit, are_fitted => parameters_of_signal(model%fit))
         limits = [10.0_wp*maxval(abs(fit%value)), 100.0_wp, fit%max_time_shift]
         model%minimum = [plan%axes%minimum, pack(-limits, are_fitted)]
         model%maximum = [plan%axes%maximum, pack(limits, are_fitted)]
         model%is_logarithmic = [plan%axes%is_logarithmic, spread(.false., 1, count(are_fitted))]
      end associate
   end subroutine start_model

   !> Parameters within their ranges as functions of unbounded coordinates x; sin x = -1 is the minimum, 1 the maximum.
   pure function parameters_at(self, x) result(values)
      class(fit_model_t), intent(in) :: self
      real(wp), intent(in) :: x(:)
      real(wp) :: values(size(x))

      values = value_at_fraction(self%minimum, self%maximum, self%is_logarithmic, 0.5_wp*(1.0_wp + sin(x)))
   end function parameters_at

   !> Unbounded coordinates of parameters, the inverse of `parameters_at`. The result has a distance from +-pi/2, where
   !> the derivative of the parameter vanishes.
   pure function coordinates_of(model, values) result(x)
      type(fit_model_t), intent(in) :: model
      real(wp), intent(in) :: values(:)
      real(wp) :: x(size(values))

      x = 2.0_wp*fraction_at_value(model%minimum, model%maximum, model%is_logarithmic, values) - 1.0_wp
      x = asin(min(max(x, -1.0_wp), 1.0_wp))
      x = min(max(x, -0.499_wp*pi), 0.499_wp*pi)
   end function coordinates_of

   !> Residuals: model minus signal, divided by `divisor`.
   subroutine evaluate_residuals(self, x, residual)
      class(fit_model_t), intent(inout) :: self
      real(wp), intent(in) :: x(:)
      !> Residuals of the first samples of the signal, [number of samples that are fitted]
      real(wp), intent(out) :: residual(:)

      ! residual of a run that fails, in standard deviations of the signal
      real(wp), parameter :: failed_residual = 100.0_wp
      real(wp) :: found(size(residual))

      call self%find_signal(self%parameters_at(x), found)
      if (allocated(self%reason)) then
         residual = failed_residual*self%spread/self%divisor(:size(residual))
      else
         residual = (found - self%fit%value(:size(residual)))/self%divisor(:size(residual))
         if (self%integrates) then
            call integrate(self%fit%time(:size(residual)), residual)
            if (self%fit%observed == observed_acceleration_tip) call integrate(self%fit%time(:size(residual)), residual)
         end if
      end if
   end subroutine evaluate_residuals

   !> Replace residuals by their integral over time, divided by the mean sampling interval.
   pure subroutine integrate(time, residual)
      real(wp), intent(in) :: time(:)
      real(wp), intent(inout) :: residual(:)

      real(wp) :: mean
      integer :: i

      mean = (time(size(time)) - time(1))/real(size(time) - 1, wp)
      do i = 2, size(residual)
         residual(i) = residual(i - 1) + residual(i)*(time(i) - time(i - 1))/mean
      end do
   end subroutine integrate

   !> Compute the signal of the model.
   subroutine find_signal(self, values, found, response_of_run)
      class(fit_model_t), intent(inout) :: self
      !> Fitted parameters: those of the sweep, then offset, scale and delay if they are fitted
      real(wp), intent(in) :: values(:)
      !> Signal at the first instants of the measured signal
      real(wp), intent(out) :: found(:)
      !> Response of the run with its measures
      type(response_t), intent(out), optional :: response_of_run

      ! offset, scale and delay
      real(wp) :: of_signal(3)
      integer :: n

      n = size(values) - count(parameters_of_signal(self%fit))
      of_signal = unpack(values(n + 1:), parameters_of_signal(self%fit), neutral)
      call self%find_signal_of_run(values(:n), self%fit%time(:size(found)) - of_signal(3), found, response_of_run)
      found = of_signal(1) + of_signal(2)*found
   end subroutine find_signal

   !> Run a case and evaluate the observed quantity at given instants.
   subroutine find_signal_of_run(self, values, time, found, response_of_run)
      class(fit_model_t), intent(inout) :: self
      !> Parameters of the sweep
      real(wp), intent(in) :: values(:)
      !> Instants in the unit of time of the results
      real(wp), intent(in) :: time(:)
      real(wp), intent(out) :: found(:)
      type(response_t), intent(out), optional :: response_of_run

      type(response_t) :: response
      type(analysed_t), allocatable :: analysed(:)
      type(failure_t), allocatable :: error
      type(output_settings_t) :: output
      type(units_t) :: units
      real(wp) :: unit_of_time, last
      real(wp), allocatable :: instants(:)
      integer, allocatable :: place(:)

      if (allocated(self%reason)) deallocate (self%reason)
      found = 0.0_wp
      call set_case(self%runner, values, error)
      if (allocated(error)) then
         self%reason = error%message
         return
      end if
      units = units_in(self%runner%scene)
      unit_of_time = 1.0_wp
      if (units%are_physical) unit_of_time = units%factor(quantity_named('time'))
      if (.not. observed_table(self%fit%observed)%is_feature) call lengthen(self%runner%scene%response, &
         self%fit%time(size(self%fit%time))/unit_of_time)
      last = self%runner%scene%response%duration
      output%history = .false.
      output%history(force_stop) = self%fit%observed == observed_force
      output%measures = present(response_of_run) .or. observed_table(self%fit%observed)%is_feature
      output%max_peaks = peak_count
      if (observed_table(self%fit%observed)%is_feature) output%max_peaks = max(peak_count, nint(time(size(time))))
      if (self%fit%observed == observed_acceleration_tip) then
         allocate (instants, source=limits_of_cells(time))
      else
         allocate (instants, source=time)
      end if
      ! before the run the beam is in its initial state
      instants = min(max(instants/unit_of_time, 0.0_wp), last)
      allocate (place(size(instants)), source=0)
      if (.not. (self%fit%observed == observed_force .or. observed_table(self%fit%observed)%is_feature)) then
         call request_shapes(instants, output, place)
      end if
      self%runner%scene%output = output
      call run_case(self%runner, response, analysed, error, self%sets, of_run)
      if (allocated(error)) then
         self%reason = error%message
         return
      end if
      if (observed_table(self%fit%observed)%is_feature) then
         call find_features(response, self%fit%observed, nint(time), last, found, self%missing)
      else if (self%fit%observed == observed_force) then
         call interpolate(response%tau, response%history(force_stop)%values, time/unit_of_time, found)
      else
         call sample_shapes(self, response, instants, place, found)
      end if
      if (units%are_physical) found = found*units%factor(quantity_named(observed_table(self%fit%observed)%quantity))
      if (.not. all(ieee_is_finite(found))) self%reason = 'the run has no finite values'
      if (present(response_of_run)) response_of_run = response
   end subroutine find_signal_of_run

   !> Lengthen a run to the end of the signal. A duration in periods is shorter in time for a shorter beam, but the
   !> signal keeps its length.
   pure subroutine lengthen(response, end_of_signal)
      type(response_settings_t), intent(inout) :: response
      !> Instant of the last sample of the signal, tau
      real(wp), intent(in) :: end_of_signal

      ! the end of a signal exceeds the last sample of its run by rounding at most
      real(wp), parameter :: rounding = 1.0e-12_wp
      real(wp) :: last_sample

      last_sample = real(count_samples(response%duration, response%step), wp)*response%step
      if (end_of_signal > (1.0_wp + rounding)*last_sample) response%duration = end_of_signal + response%step
   end subroutine lengthen

   !> Evaluate a displacement, a velocity or a mean acceleration in the deflected shapes of a run.
   subroutine sample_shapes(model, response, instants, place, found)
      type(fit_model_t), intent(in) :: model
      !> Response with shapes
      type(response_t), intent(in) :: response
      !> Instants of the samples or, for accelerations, limits of their cells, tau
      real(wp), intent(in) :: instants(:)
      !> Index of the shape of each instant, [instants]
      integer, intent(in) :: place(:)
      !> Dimensionless signal, [samples]
      real(wp), intent(out) :: found(:)

      type(stop_settings_t), allocatable :: stops(:)
      real(wp), allocatable :: values(:)
      ! index of the shape of each instant that exists
      integer :: existing(size(place))
      integer :: i, node

      found = 0.0_wp
      node = ubound(response%shape_displacement, 1)
      if (.not. observed_table(model%fit%observed)%is_of_tip) then
         stops = all_stops(model%runner%scene)
         associate (position => model%runner%beam%model%mesh%position, &
            stop => stops(max(stop_of_release(model%runner%scene), 1)))
            node = lbound(response%shape_displacement, 1) - 1 + minloc(abs(position - stop%position), dim=1)
         end associate
      end if
      ! an instant at the end of the run may exceed the last shape by rounding
      existing = min(place, size(response%shape_tau))
      if (model%fit%observed == observed_acceleration_tip) then
         values = response%shape_velocity(node, existing)
         do i = 1, size(found)
            if (instants(i + 1) > instants(i)) found(i) = (values(i + 1) - values(i)) &
               /(instants(i + 1) - instants(i))
         end do
      else if (observed_table(model%fit%observed)%quantity == 'velocity') then
         found = response%shape_velocity(node, existing)
      else
         found = response%shape_displacement(node, existing)
      end if
   end subroutine sample_shapes

   !> Find features of a motion by their numbers. An impact that the run does not have gets the instant of the end of
   !> the run; a rebound that the run does not have gets the height 0.
   pure subroutine find_features(response, observed, numbers, end, found, missing)
      type(response_t), intent(in) :: response
      !> Index in `observed_table` of a signal of features
      integer, intent(in) :: observed
      !> Numbers of the features, ascending, >= 1
      integer, intent(in) :: numbers(:)
      !> End of the run, tau
      real(wp), intent(in) :: end
      !> Instants of impacts, tau, or peak displacements eta
      real(wp), intent(out) :: found(:)
      !> Number of features that the run does not have
      integer, intent(out) :: missing

      real(wp), allocatable :: features(:)

      if (observed == observed_impacts) then
         allocate (features(0))
         if (response%event_count > 0) then
            associate (events => response%events(:response%event_count))
               features = pack(events%tau, is_impact(events))
            end associate
         end if
         found = end
      else
         features = response%measures%peak_eta
         found = 0.0_wp
      end if
      associate (known => count(numbers <= size(features)))
         found(:known) = features(numbers(:known))
         missing = size(numbers) - known
      end associate
   end subroutine find_features

   !> Request the shapes of the beam at some instants, each once.
   pure subroutine request_shapes(instants, output, place)
      !> tau, ascending
      real(wp), intent(in) :: instants(:)
      type(output_settings_t), intent(inout) :: output
      !> Index of the shape of each instant
      integer, intent(out) :: place(:)

      integer :: i, shapes

      allocate (output%shape_times(size(instants)))
      shapes = 0
      do i = 1, size(instants)
         if (shapes == 0) then
            shapes = 1
         else if (instants(i) > output%shape_times(shapes)) then
            shapes = shapes + 1
         end if
         output%shape_times(shapes) = instants(i)
         place(i) = shapes
      end do
      output%shape_times = output%shape_times(:shapes)
   end subroutine request_shapes

   !> Limits of the intervals over which accelerations are averaged: halfway between samples. Accelerometers also
   !> average over a short time, and the mean is finite at impacts of rigid stops.
   pure function limits_of_cells(time) result(limits)
      real(wp), intent(in) :: time(:)
      real(wp) :: limits(size(time) + 1)

      associate (n => size(time))
         limits(2:n) = 0.5_wp*(time(:n - 1) + time(2:))
         limits(1) = time(1) - (limits(2) - time(1))
         limits(n + 1) = time(n) + (time(n) - limits(n))
      end associate
   end function limits_of_cells

   !> Interpolate linearly between samples.
   pure subroutine interpolate(tau, values, instants, found)
      !> Instants of the samples, equidistant
      real(wp), intent(in) :: tau(:)
      real(wp), intent(in) :: values(:)
      real(wp), intent(in) :: instants(:)
      real(wp), intent(out) :: found(:)

      real(wp) :: fraction
      integer :: i, k

      do i = 1, size(instants)
         associate (step => tau(2) - tau(1))
            k = min(max(1 + int(max(instants(i), 0.0_wp)/step), 1), size(tau) - 1)
            fraction = min(max((instants(i) - tau(k))/(tau(k + 1) - tau(k)), 0.0_wp), 1.0_wp)
         end associate
         found(i) = (1.0_wp - fraction)*values(k) + fraction*values(k + 1)
      end do
   end subroutine interpolate

end module fit_model
