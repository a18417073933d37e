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
   use response_records, only: count_samples, open_records
   use response_types, only: response_t
   use scene_types, only: impulse_nodal, law_three_element, output_settings_t, response_settings_t, stop_settings_t
   use stop_models, only: make_three_element
   implicit none (type, external)
   private
   public :: exact_response, exact_response_in_modes, modes_that_matter

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

   !> Run from rest, the stop point pulled to eta = 1 by a point force, to the end.
   !>
   !> The start is the static shape in the modes kept, so that eta is 1 exactly whatever modes those are.
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

      type(modal_beam_t), target :: beam
      type(recorder_t) :: recorder
      real(wp), allocatable :: start(:)
      integer :: i, kept, samples

      kept = size(modes%lambda)
      if (.not. response_settings%keep_all_modes .and. stop_settings%impulse /= impulse_nodal) &
         kept = modes_that_matter(modes%square, modes%mode(modes%stop_dof, :), 1.0_wp + stop_settings%preload, &
                                  response_settings%mode_tolerance, stop_settings%law /= law_three_element)
      call make_modal_beam(modes%square(:kept), modes%mode(modes%stop_dof, :kept), modes%mode(modes%tip_dof, :kept), &
                           zeta, beam)
      samples = count_samples(response_settings%duration, response_settings%step)
      call open_records(modes%elements, output_settings, samples, response_settings%step, response)
      call make_recorder(samples, response_settings%step, beam%count, response, recorder)
      allocate (start, source=(1.0_wp + stop_settings%preload)*beam%stop_value &
                /(beam%oscillators%square*beam%flexibility))
      response%initial_energy = 0.5_wp*sum(beam%oscillators%square*start**2)
      response%modes_kept = beam%count
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

   end subroutine exact_response_in_modes

   !> How many of the lowest modes can matter. No energy is ever won, so at any time sum W_i^2 q_i^2 <= 2 E(0),
   !> and the modes left out move the stop point by |sum b_i q_i| <= sqrt(2 E(0) sum b_i^2/W_i^2). Where impulses
   !> act, the mass that takes part in them counts as well, 1/sum b_i^2, which high modes hold as much of as low ones.
   pure function modes_that_matter(square, stop_value, pull, tolerance, impulsive) result(kept)
      !> W_i^2, ascending
      real(wp), intent(in) :: square(:)
      !> b_i
      real(wp), intent(in) :: stop_value(:)
      !> y_c(0), where the run starts
      real(wp), intent(in) :: pull
      !> What they may contribute together
      real(wp), intent(in) :: tolerance
      !> Impulses act on the stop point
      logical, intent(in) :: impulsive
      integer :: kept

      real(wp) :: twice_energy, tail, mobility, lost

      twice_energy = pull**2/sum(stop_value**2/square)
      mobility = sum(stop_value**2)
      tail = 0.0_wp
      lost = 0.0_wp
      ! a pinned beam needs two free modes
      do kept = size(square), 3, -1
         tail = tail + stop_value(kept)**2/square(kept)
         lost = lost + stop_value(kept)**2
         if (sqrt(twice_energy*tail) > tolerance) return
         if (impulsive .and. lost > tolerance*mobility) return
      end do
   end function modes_that_matter

end module exact_motion
