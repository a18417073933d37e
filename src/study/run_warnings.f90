!> Warnings about the results of a run: deflections beyond the linear theory, stresses beyond the strength, stresses
!> without a limit on finer meshes, stress cycles that are counted in a part of the run only, a run that ends soon after
!> its settling time, and impacts that are parts of a closing.
module run_warnings
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use frequency_study, only: solve_modes
   use history_list, only: eta_tip
   use kinds, only: lambda1, pi, wp
   use load_settings, only: field_mode, start_drop, start_velocity
   use measure_list, only: first_statistic, measure_named
   use number_text, only: rounded, to_text
   use quantities, only: quantity_named, units_of, units_t, units_in
   use reader_units, only: phrase, with_unit, unit_in
   use response_types, only: response_t
   use run_settings, only: side_above, stop_settings_t
   use scene_beam_model, only: model_of, varies_at_end
   use scene_types, only: all_stops, scene_t, solver_auto
   use scene_warnings, only: add_warning
   use scene_words, only: stop_of_release
   use warning_list, only: warning_impacts, warning_large_slope, warning_over_strength, warning_settling, &
      warning_stress_start, warning_uncounted_cycles
   implicit none (type, external)
   private
   public :: warn_of_run, ends_unsettled, half_period_of

   !> Slope beyond which deflections are not small.
   real(wp), parameter :: max_slope = 0.2_wp
   !> Mean number of impacts at a contact in a period of the first mode beyond which they are parts of closings.
   real(wp), parameter :: max_impacts = 50.0_wp
   !> Slope at the tip over the ratio of displacement to length, for a cantilever bent by a force at its tip: F L^2/(2 E
   !> I) over F L^2/(3 E I).
   real(wp), parameter :: slope_ratio = 1.5_wp

contains

   !> Add warnings to a scene: of cycles that are not counted, of stresses that depend on the mesh, of a settling time
   !> close to the end and of impacts that are parts of closings; in units, of a slope that is not small, and of a
   !> stress beyond the strength.
   subroutine warn_of_run(scene, response)
      type(scene_t), intent(inout) :: scene
      !> The run of the scene
      type(response_t), intent(in) :: response

      type(stop_settings_t), allocatable :: stops(:)
      type(units_t) :: units
      real(wp) :: height, impacts, slope, stress
      ! maximum displacement of the tip from the unstressed beam; 0: the run records none
      real(wp) :: reach
      integer :: p

      if (.not. allocated(scene%warnings)) return
      if (allocated(response%moment_windows)) then
         associate (windows => response%moment_windows, window_ends => [(response%moment_windows(p)%window(2), &
            p=1, size(response%moment_windows))])
            ! with a slope of the S-N curve, cycles are counted
            if (any(windows%slope > 0.0_wp .and. windows%counted_until < window_ends)) call add_warning(scene, &
               warning_uncounted_cycles, 'cycles of the stress are counted only'//phrase(units_in(scene), &
               ' until {tau~t} = ', &
               'time', minval(windows%counted_until))//', after which it has more than fatigue_limit turning points; ' &
               //'measures have no stress_cycles, /stress those until then')
         end associate
      end if
      if (has_unlimited_stress(scene, response)) call add_warning(scene, warning_stress_start, 'the stress has an ' &
         //'extreme at the start, where the velocity does not fit the root or a support: with damping in proportion ' &
         //'to stiffness it grows with the number of elements; measures after a start of &statistics leave it out')
      if (run_ends_unsettled(scene, response)) call add_warning(scene, warning_settling, 'the run ends less than ' &
         //'half a period of the first frequency after the settling time: the beam may leave the stop again; a ' &
         //'longer run shows it')
      impacts = impacts_of_period(scene, response)
      if (impacts > max_impacts) call add_warning(scene, warning_impacts, 'a contact has '//to_text(nint(impacts)) &
         //' impacts in a period of the first frequency, on average: a closing consists of several impacts, which ' &
         //'rest_time of &statistics counts as one')
      if (scene%scales%displacement <= 0.0_wp) return
      reach = 0.0_wp
      if (allocated(response%history(eta_tip)%values)) then
         ! the history counts from the surface of the stop of the release, at the height of the preload below the beam,
         ! minus the preload above it
         height = 0.0_wp
         if (scene%has_stop) then
            stops = all_stops(scene)
            associate (stop => stops(max(stop_of_release(scene), 1)))
               height = merge(-1.0_wp, 1.0_wp, stop%side == side_above)*stop%preload
            end associate
         end if
         reach = maxval(abs(response%history(eta_tip)%values + height))
      else if (allocated(response%statistics)) then
         reach = maxval(abs(response%statistics%value([measure_named('minimum_tip'), measure_named('maximum_tip')] &
            - first_statistic + 1, 0)))
      end if
      slope = slope_ratio*reach*scene%scales%displacement/scene%scales%length
      if (slope > max_slope) call add_warning(scene, warning_large_slope, 'the slope of the beam is about ' &
         //rounded(real(nint(100.0_wp*slope), wp)/100.0_wp)//'; the theory is one of small deflections, to about ' &
         //rounded(max_slope))
      if (scene%stress%strength <= 0.0_wp .or. .not. allocated(response%measures)) return
      if (.not. response%measures%has_stress) return
      units = units_of(scene%scales, scene%unit_system, .true.)
      stress = response%measures%greatest_stress*units%factor(quantity_named('stress'))
      if (stress > scene%stress%strength) call add_warning(scene, warning_over_strength, 'the maximum stress, ' &
         //with_unit(stress, unit_in(units, 'stress'))//', is beyond the strength of ' &
         //with_unit(scene%stress%strength, unit_in(units, 'stress')))
   end subroutine warn_of_run

   !> Mean number of impacts in a period of the first mode, the maximum of all contacts, if statistics count each impact
   !> as one; 0 otherwise.
   real(wp) function impacts_of_period(scene, response) result(impacts)
      type(scene_t), intent(in) :: scene
      !> The run of the scene
      type(response_t), intent(in) :: response

      impacts = 0.0_wp
      if (.not. allocated(response%statistics) .or. scene%statistics%rest > 0.0_wp) return
      associate (rates => response%statistics%value(measure_named('impact_rate') - first_statistic + 1, 1:))
         if (any(rates > 0.0_wp)) impacts = 2.0_wp*half_period_of(scene)*maxval(rates, mask=rates > 0.0_wp)
      end associate
   end function impacts_of_period

   !> Whether a run with a stop ends so soon after its settling time that the settling time is uncertain.
   logical function run_ends_unsettled(scene, response) result(answer)
      type(scene_t), intent(in) :: scene
      !> The run of the scene
      type(response_t), intent(in) :: response

      answer = .false.
      if (.not. (scene%has_stop .and. allocated(response%measures)) .or. varies_at_end(scene)) return
      associate (measures => response%measures)
         if (measures%has_settled) answer = ends_unsettled(measures%settling_tau, measures%duration, &
            half_period_of(scene))
      end associate
   end function run_ends_unsettled

   !> Whether a run ends so soon after the last excursion of the stop beyond the settling level that another one may
   !> follow. Excursions of the motion in the first mode are at most half a period apart.
   elemental logical function ends_unsettled(settling_tau, duration, half_period) result(answer)
      !> Settling time, tau; NaN: the motion has not settled
      real(wp), intent(in) :: settling_tau
      !> Length of the run, tau
      real(wp), intent(in) :: duration
      !> Half a period of the first mode, tau
      real(wp), intent(in) :: half_period

      answer = .not. ieee_is_nan(settling_tau)
      if (answer) answer = settling_tau > 0.0_wp .and. duration - settling_tau < half_period
   end function ends_unsettled

   !> Half a period of the first mode of the beam that has a restoring force, tau.
   real(wp) function half_period_of(scene) result(half_period)
      type(scene_t), intent(in) :: scene

      ! below this lambda, a mode is a free rotation
      real(wp), parameter :: min_lambda = 1.0e-3_wp
      type(beam_model_t) :: model
      type(failure_t), allocatable :: error
      real(wp), allocatable :: lambda(:)

      half_period = pi
      call model_of(scene, scene%mesh%elements, scene%mesh%ratio, model, error, moves=.false.)
      if (.not. allocated(error)) call solve_modes(model, solver_auto, 2, lambda, error)
      if (allocated(error)) return
      lambda = pack(lambda, lambda > min_lambda)
      if (size(lambda) > 0) half_period = pi*(lambda1/lambda(1))**2
   end function half_period_of

   !> Whether an extreme of a moment is the damping moment of an initial velocity with a jump or a kink at the root or a
   !> support. The curvature of such a velocity, and with it the moment, grow with the number of elements.
   pure logical function has_unlimited_stress(scene, response) result(answer)
      type(scene_t), intent(in) :: scene
      !> The run of the scene
      type(response_t), intent(in) :: response

      answer = .false.
      if (.not. allocated(response%moments) .or. scene%zeta <= 0.0_wp .or. allocated(scene%mode_ratios)) return
      associate (start => scene%start, moments => response%moments)
         if (start%kind /= start_drop .and. (start%kind /= start_velocity .or. start%field == field_mode)) return
         answer = any((moments%minimum_tau <= 0.0_wp .and. moments%minimum < 0.0_wp) .or. &
            (moments%maximum_tau <= 0.0_wp .and. moments%maximum > 0.0_wp))
      end associate
   end function has_unlimited_stress

end module run_warnings
