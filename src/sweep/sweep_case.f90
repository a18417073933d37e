!> One case of a sweep: its run and the row of measures that remains of it.
!>
!> A runner keeps the beam of the case before, with its modes, for the next case if that has the same beam. It
!> belongs to one thread.
module sweep_case
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use beam_model, only: beam_model_t
   use exact_motion, only: exact_response_in_modes
   use failures, only: failure_t
   use free_modes, only: find_free_modes, free_modes_t
   use kinds, only: wp
   use newmark_motion, only: newmark_response
   use response_measures, only: measure_response, response_measures_t
   use response_types, only: event_impact, most_peaks, quiet_energy, response_t
   use scene_beam_model, only: model_of
   use scene_types, only: law_three_element, method_exact, output_settings_t, scene_t, stop_settings_t
   use stop_models, only: make_three_element, three_element_t
   use sweep_plan, only: plan_t, set_parameter
   use sweep_settings, only: column_contacts, column_created, column_first_tau, column_first_velocity, column_force, &
      column_impacts, column_impulse, column_left, column_longest_contact, column_lost_beam, column_lost_impact, &
      column_lost_stop, column_peak, column_quiet, column_rebounds, column_spent, column_status, column_total_contact, &
      is_of_beam, measure_count, measure_is_whole
   implicit none (type, external)
   private
   public :: runner_t, start_runner, run_case

   type :: runner_t
      private
      !> The scene with the parameters of the present case
      type(scene_t) :: scene
      type(output_settings_t) :: output
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

      logical :: samples

      runner%scene = scene
      ! Newmark's method has its measures from samples at its own steps
      samples = scene%response%method /= method_exact
      runner%output%displacement_stop = samples
      runner%output%displacement_tip = .false.
      runner%output%velocity_stop = samples
      runner%output%contact_force = samples
      runner%output%energy = samples
      runner%output%measures = .not. samples
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
      type(response_measures_t) :: events
      type(failure_t), allocatable :: error
      integer :: k

      do k = 1, size(values)
         call set_parameter(runner%scene, plan%axes(k)%parameter, values(k))
      end do
      call find_beam(runner, plan, values)
      row = merge(0.0_wp, ieee_value(1.0_wp, ieee_quiet_nan), measure_is_whole)
      row(column_status) = 1.0_wp
      if (allocated(runner%trouble)) then
         reason = runner%trouble%message
         return
      end if
      associate (scene => runner%scene)
         if (scene%response%method == method_exact) then
            call exact_response_in_modes(runner%modes, scene%zeta, scene%stop, scene%response, runner%output, &
                                         scene%scales%height_ratio, response, error)
         else
            call newmark_response(runner%model, scene%zeta, scene%stop, scene%response, runner%output, &
                                  scene%scales%height_ratio, response, error)
         end if
         if (allocated(error)) then
            reason = error%message
            return
         end if
         call measure_response(response, scene%response%duration, events)
         call fill_events(response, events, row)
         if (allocated(response%measures)) then
            call fill_measures(response, scene%stop%law, row)
         else
            call fill_samples(response, events, scene%stop, row)
         end if
      end associate
      row(column_status) = 0.0_wp
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
         if (all(abs(values - runner%beam_values) <= 0.0_wp .or. .not. is_of_beam(plan%axes%parameter))) return
         deallocate (runner%beam_values)
      end if
      allocate (runner%beam_values, source=values)
      if (allocated(runner%trouble)) deallocate (runner%trouble)
      associate (scene => runner%scene)
         call model_of(scene, scene%mesh%elements, scene%mesh%ratio, runner%model, runner%trouble)
         if (allocated(runner%trouble) .or. scene%response%method /= method_exact) return
         call find_free_modes(runner%model, runner%modes, runner%trouble, with_support=scene%stop%law /= law_three_element)
      end associate
   end subroutine find_beam

   !> What the events tell.
   pure subroutine fill_events(response, events, row)
      !> The run
      type(response_t), intent(in) :: response
      !> Its measures
      type(response_measures_t), intent(in) :: events
      !> The row
      real(wp), intent(inout) :: row(:)

      integer :: i

      row(column_impacts) = real(events%impacts, wp)
      row(column_contacts) = real(size(events%contact_start), wp)
      if (events%has_met_stop) then
         row(column_first_tau) = events%first_impact_tau
         row(column_first_velocity) = events%first_impact_velocity
      end if
      row(column_total_contact) = events%total_contact
      row(column_longest_contact) = events%longest_contact
      row(column_impulse) = 0.0_wp
      do i = 1, response%event_count
         if (response%events(i)%kind == event_impact) &
            row(column_impulse) = max(row(column_impulse), response%events(i)%impulse)
      end do
   end subroutine fill_events

   !> What the phases of exact motion tell.
   pure subroutine fill_measures(response, law, row)
      !> The run
      type(response_t), intent(in) :: response
      !> `law_restitution` or `law_three_element`
      integer, intent(in) :: law
      !> The row
      real(wp), intent(inout) :: row(:)

      real(wp) :: share
      integer :: peaks

      associate (measures => response%measures)
         row(column_force) = measures%greatest_force
         if (law == law_three_element) row(column_impulse) = measures%greatest_impulse
         row(column_rebounds) = real(measures%rebounds, wp)
         peaks = min(measures%rebounds, most_peaks)
         row(column_peak:column_peak + peaks - 1) = measures%peak_eta(:peaks)
         if (measures%is_quiet) row(column_quiet) = measures%quiet_tau
         if (measures%has_spent) row(column_spent) = measures%spent_tau
         share = 1.0_wp/(measures%start_energy - measures%rest_energy)
         row(column_lost_beam) = share*measures%lost_beam
         row(column_lost_stop) = share*measures%lost_stop
         row(column_lost_impact) = share*measures%lost_impact
         row(column_created) = share*measures%created
         row(column_left) = share*(measures%final_energy - measures%rest_energy)
      end associate
   end subroutine fill_measures

   !> What the samples of Newmark's method tell.
   pure subroutine fill_samples(response, events, stop, row)
      !> The run
      type(response_t), intent(in) :: response
      !> Its measures
      type(response_measures_t), intent(in) :: events
      !> The stop
      type(stop_settings_t), intent(in) :: stop
      !> The row
      real(wp), intent(inout) :: row(:)

      type(three_element_t) :: spring
      real(wp) :: total(size(response%tau)), share, rest, compliance
      integer :: peaks, last, first

      row(column_force) = maxval(response%contact_force)
      ! the impulse of a contact is not known from its samples
      if (stop%law == law_three_element) row(column_impulse) = ieee_value(1.0_wp, ieee_quiet_nan)
      row(column_rebounds) = real(size(events%peak_eta), wp)
      peaks = min(size(events%peak_eta), most_peaks)
      row(column_peak:column_peak + peaks - 1) = events%peak_eta(:peaks)
      if (events%is_quiet) row(column_quiet) = events%quiet_tau
      associate (energy => response%energy)
         total = energy%kinetic + energy%strain + energy%stop
         ! the start is the static shape of a force that moves the stop point by 1 + delta
         compliance = 0.5_wp*(1.0_wp + stop%preload)**2/total(1)
         if (stop%law == law_three_element) then
            spring = make_three_element(stop%stiffness_ratio, stop%branch_ratio, stop%damper_ratio)
            compliance = compliance + 1.0_wp/spring%stiffness
         end if
         rest = 0.5_wp*max(stop%preload, 0.0_wp)**2/compliance
         total = total - rest
         last = size(total)
         first = findloc(total <= quiet_energy*total(1), .true., dim=1)
         if (first > 0) row(column_spent) = response%tau(first)
         share = 1.0_wp/total(1)
         row(column_lost_beam) = share*energy%dissipated_beam(last)
         row(column_lost_stop) = share*energy%dissipated_stop(last)
         row(column_lost_impact) = share*energy%dissipated_impact(last)
         row(column_created) = share*energy%created(last)
         row(column_left) = share*total(last)
      end associate
   end subroutine fill_samples

end module sweep_case
