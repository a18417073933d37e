!> The response in closed form between events: free modes of the beam, then model A or B of the stop.
module exact_motion
   use beam_model, only: beam_model_t
   use exact_restitution, only: restitution_run_t, run_exact_restitution
   use exact_three_element, only: run_exact_three_element, three_element_run_t
   use failures, only: failure_t
   use flight_measures, only: finish_measures, start_measures
   use free_modes, only: find_free_modes, free_modes_t
   use kinds, only: wp
   use modal_beam, only: make_modal_beam, modal_beam_t
   use modal_recorder, only: make_recorder, recorder_t
   use mode_choice, only: agreement, check_output, check_settings, compare_modes, modes_that_matter, next_count
   use response_records, only: count_samples, open_records
   use response_types, only: mode_check_t, response_t
   use scene_types, only: impulse_nodal, law_three_element, output_settings_t, response_settings_t, stop_settings_t
   use stop_models, only: make_three_element
   implicit none (type, external)
   private
   public :: exact_response, exact_response_in_modes

contains

   !> Run a beam that no other run shares: its modes, then its motion.
   subroutine exact_response(model, zeta, stop_settings, response_settings, output_settings, height_ratio, response, error)
      !> The assembled beam
      type(beam_model_t), intent(in) :: model
      !> zeta = gamma omega1 / 2
      real(wp), intent(in) :: zeta
      !> The stop
      type(stop_settings_t), intent(in) :: stop_settings
      !> Duration, samples, tolerances
      type(response_settings_t), intent(in) :: response_settings
      !> What to keep
      type(output_settings_t), intent(in) :: output_settings
      !> hbar/L
      real(wp), intent(in) :: height_ratio
      !> Events and histories
      type(response_t), intent(out) :: response
      !> Set when the modes cannot be found or the run fails
      type(failure_t), allocatable, intent(out) :: error

      type(free_modes_t) :: modes

      call find_free_modes(model, modes, error)
      if (allocated(error)) return
      call exact_response_in_modes(modes, zeta, stop_settings, response_settings, output_settings, height_ratio, &
                                   response, error)
      response%factorisations = response%factorisations + 1
   end subroutine exact_response

   !> Run with the modes that the mode tolerance asks for.
   subroutine exact_response_in_modes(modes, zeta, stop_settings, response_settings, output_settings, height_ratio, &
                                      response, error)
      !> The modes of the free beam, which other runs may share
      type(free_modes_t), intent(in) :: modes
      !> zeta = gamma omega1 / 2
      real(wp), intent(in) :: zeta
      !> The stop
      type(stop_settings_t), intent(in) :: stop_settings
      !> Duration, samples, tolerances
      type(response_settings_t), intent(in) :: response_settings
      !> What to keep
      type(output_settings_t), intent(in) :: output_settings
      !> hbar/L
      real(wp), intent(in) :: height_ratio
      !> Events and histories
      type(response_t), intent(out) :: response
      !> Set when the run fails
      type(failure_t), allocatable, intent(out) :: error

      type(mode_check_t) :: check

      check%kept = size(modes%lambda)
      if (.not. response_settings%keep_all_modes .and. stop_settings%impulse /= impulse_nodal) &
         call choose_modes(modes, zeta, stop_settings, response_settings, height_ratio, check)
      call run_in_modes(modes, check%kept, zeta, stop_settings, response_settings, output_settings, height_ratio, response, &
                        error)
      response%evaluations = response%evaluations + check%evaluations
      response%mode_check = check
   end subroutine exact_response_in_modes

   !> The modes to keep: those that can matter at all, then more of them until more change nothing.
   !>
   !> That what is left out moves the stop point by little does not say that the others move as if it were there: it makes
   !> the beam more yielding where it hits. So a run is compared with one of more modes, and that one is kept if both
   !> agree far within the tolerance, up to the third rebound: chatter lets any difference grow without end.
   subroutine choose_modes(modes, zeta, stop_settings, response_settings, height_ratio, check)
      !> The modes of the free beam
      type(free_modes_t), intent(in) :: modes
      !> zeta = gamma omega1 / 2
      real(wp), intent(in) :: zeta
      !> The stop
      type(stop_settings_t), intent(in) :: stop_settings
      !> Duration, tolerances
      type(response_settings_t), intent(in) :: response_settings
      !> hbar/L
      real(wp), intent(in) :: height_ratio
      !> How many to keep, and how that was found
      type(mode_check_t), intent(inout) :: check

      type(response_settings_t) :: settings
      type(response_t) :: fewer, more
      type(failure_t), allocatable :: error
      integer :: all

      all = size(modes%lambda)
      associate (b => modes%mode(modes%stop_dof, :), tolerance => response_settings%mode_tolerance)
         check%kept = modes_that_matter(modes%square, b, 1.0_wp + stop_settings%preload, tolerance, &
                                        stop_settings%law /= law_three_element)
         if (check%kept == all) return
         settings = check_settings(response_settings, modes%lambda(1))
         do
            check%compared = check%kept
            check%kept = next_count(modes%square, b, check%compared)
            if (check%kept == all) exit
            if (.not. allocated(fewer%tau)) then
               call run_in_modes(modes, check%compared, zeta, stop_settings, settings, check_output(), height_ratio, fewer, &
                                 error)
               if (allocated(error)) exit
               check%evaluations = check%evaluations + fewer%evaluations
            end if
            call run_in_modes(modes, check%kept, zeta, stop_settings, settings, check_output(), height_ratio, more, error)
            if (allocated(error)) exit
            check%evaluations = check%evaluations + more%evaluations
            call compare_modes(fewer, more, settings%duration, check)
            if (check%difference <= agreement*tolerance) return
            fewer = more
         end do
      end associate
      check = mode_check_t(kept=all, evaluations=check%evaluations)
   end subroutine choose_modes

   !> Run from rest, the stop point pulled to eta = 1 by a point force, to the end.
   !>
   !> The start is the static shape in the modes kept, so that eta is 1 exactly whatever modes those are.
   subroutine run_in_modes(modes, kept, zeta, stop_settings, response_settings, output_settings, height_ratio, response, error)
      !> The modes of the free beam, which other runs may share
      type(free_modes_t), intent(in) :: modes
      !> Only the first of them are used
      integer, intent(in) :: kept
      !> zeta = gamma omega1 / 2
      real(wp), intent(in) :: zeta
      !> The stop
      type(stop_settings_t), intent(in) :: stop_settings
      !> Duration, samples, tolerances
      type(response_settings_t), intent(in) :: response_settings
      !> What to keep
      type(output_settings_t), intent(in) :: output_settings
      !> hbar/L
      real(wp), intent(in) :: height_ratio
      !> Events and histories
      type(response_t), intent(out) :: response
      !> Set when the run fails
      type(failure_t), allocatable, intent(out) :: error

      type(modal_beam_t), target :: beam
      type(recorder_t) :: recorder
      real(wp), allocatable :: start(:)
      integer :: i, samples

      call make_modal_beam(modes%square(:kept), modes%mode(modes%stop_dof, :kept), modes%mode(modes%tip_dof, :kept), &
                           zeta, beam)
      samples = count_samples(response_settings%duration, response_settings%step)
      call open_records(modes%elements, output_settings, samples, response_settings%step, response)
      call make_recorder(samples, response_settings%step, beam%count, response, recorder)
      allocate (start, source=(1.0_wp + stop_settings%preload)*beam%stop_value &
                /(beam%oscillators%square*beam%flexibility))
      response%initial_energy = 0.5_wp*sum(beam%oscillators%square*start**2)
      call start_measures(output_settings%measures, output_settings%most_peaks, stop_settings, response%initial_energy, &
                          height_ratio, recorder%measurer)
      if (stop_settings%law == law_three_element) then
         call run_exact_three_element(beam, three_element_run(), start, recorder, response, error)
      else
         call run_exact_restitution(beam, modes%support, restitution_run(), start, recorder, response, error)
      end if
      if (allocated(error)) return
      if (output_settings%measures) call finish_measures(recorder%measurer, response_settings%duration, &
                                                         recorder%ledger%dissipated_impact, recorder%ledger%created, response)
      if (.not. allocated(response%shape_tau)) return
      do i = 1, modes%elements
         response%shape_displacement(i, :) = matmul(modes%mode(2*i - 1, :kept), recorder%shape_z) - stop_settings%preload
         response%shape_slope(i, :) = matmul(modes%mode(2*i, :kept), recorder%shape_z)
         response%shape_velocity(i, :) = matmul(modes%mode(2*i - 1, :kept), recorder%shape_v)
         response%shape_slope_velocity(i, :) = matmul(modes%mode(2*i, :kept), recorder%shape_v)
      end do
      response%shape_displacement(0, :) = -stop_settings%preload

   contains

      !> Model A from the settings.
      function restitution_run() result(run)
         type(restitution_run_t) :: run

         run%surface = stop_settings%preload
         run%restitution = stop_settings%restitution
         run%zeta = zeta
         run%duration = response_settings%duration
         run%hop_tolerance = response_settings%hop_tolerance
         run%event_limit = response_settings%event_limit
         run%force_scale = height_ratio
         if (stop_settings%impulse /= impulse_nodal) return
         allocate (run%nodal_mass, source=modes%nodal_mass(:beam%count))
      end function restitution_run

      !> Model B from the settings.
      function three_element_run() result(run)
         type(three_element_run_t) :: run

         run%spring = make_three_element(stop_settings%stiffness_ratio, stop_settings%branch_ratio, &
                                         stop_settings%damper_ratio)
         run%surface = stop_settings%preload
         run%zeta = zeta
         run%duration = response_settings%duration
         run%event_limit = response_settings%event_limit
         run%force_scale = height_ratio
      end function three_element_run

   end subroutine run_in_modes

end module exact_motion
