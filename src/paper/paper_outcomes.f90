!> What is measured of one case of the paper, computed in one way.
module paper_outcomes
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use free_modes, only: find_free_modes, free_modes_t
   use history_list, only: eta_stop, eta_tip, force_stop
   use kinds, only: pi, wp
   use motion_run, only: run_motion
   use paper_cases, only: figure_case_t, height_ratio, model_of_case, stop_of_case, way_t
   use response_types, only: event_contact, event_impact, response_t, run_measures_t
   use run_settings, only: output_settings_t, run_settings_t
   use skyline_matrix, only: multiply
   implicit none (type, external)
   private
   public :: outcome_t, find_outcome, end_levels, end_shares, definition_count, usual_end, energy_end, &
      most_modes, never, sample_step

   !> The motion has ended when |eta_c| last exceeds one of these,
   real(wp), parameter :: end_levels(3) = [0.05_wp, 0.02_wp, 0.01_wp]
   !> or when the energy above rest has fallen to one of these shares of the start's.
   real(wp), parameter :: end_shares(3) = [0.05_wp, 0.01_wp, 0.002_wp]
   !> The two by which figures are told: |eta_c| last exceeds 2 percent, 1 percent of the energy is left.
   integer, parameter :: usual_end = 2
   integer, parameter :: energy_end = size(end_levels) + 2
   integer, parameter :: definition_count = size(end_levels) + size(end_shares)

   !> Modes whose part is measured.
   integer, parameter :: most_modes = 8

   !> Distance of the samples by which ends are told, tau; the paper's step too.
   real(wp), parameter :: sample_step = 0.01_wp

   !> It has not ended within the run.
   real(wp), parameter :: never = 1.0e9_wp

   !> The stop point lies on the stop below this eta.
   real(wp), parameter :: touching_level = 1.0e-3_wp

   type :: outcome_t
      !> Instants of the end, by `end_levels`, then by `end_shares`
      real(wp) :: ends(definition_count) = never
      !> First meeting with the stop
      real(wp) :: first_tau = never
      !> Highest points of the rebounds and when
      real(wp), allocatable :: peak_eta(:), peak_tau(:)
      !> Deepest indentation
      real(wp) :: indentation = 0.0_wp
      !> The main rebound: the highest one within a period of the free beam from the first meeting on
      logical :: rebounds = .false.
      real(wp) :: main_peak = 0.0_wp
      !> Length of the first contact that lasts, and time from the first meeting to the main rebound
      real(wp) :: first_contact = 0.0_wp
      real(wp) :: first_touching = 0.0_wp
      !> Time on the stop over time away from it, from the first meeting to the end
      real(wp) :: contact_ratio = 0.0_wp
      !> Energy lost at impacts until the main rebound, of the energy to lose; in all; and created in all
      real(wp) :: lost_at_first = 0.0_wp
      real(wp) :: lost_at_impacts = 0.0_wp
      real(wp) :: created = 0.0_wp
      !> Greatest velocity of approach after the main rebound
      real(wp) :: later_velocity = 0.0_wp
      !> Early in the main rebound: share of the energy in each of the lowest modes
      real(wp) :: energy_share(most_modes) = 0.0_wp
      !> and the part of the modes above the second in the motion of the stop point, by displacement and by velocity
      real(wp) :: high_displacement = 0.0_wp
      real(wp) :: high_velocity = 0.0_wp
      !> Lowest frequency of the beam, in omega1
      real(wp) :: own_frequency = 1.0_wp
      !> One over the mass that takes part in an impact, rho Abar L = 1
      real(wp) :: mobility = 0.0_wp
      !> Kinetic energy at the first meeting, of the energy to lose
      real(wp) :: kinetic_at_first = 0.0_wp
   end type outcome_t

contains

   !> Compute a case and measure it.
   subroutine find_outcome(this, way, duration, outcome, error)
      type(figure_case_t), intent(in) :: this
      !> How it is computed
      type(way_t), intent(in) :: way
      !> Length of the run, tau
      real(wp), intent(in) :: duration
      !> What was measured
      type(outcome_t), intent(out) :: outcome
      !> Set when the run fails
      type(failure_t), allocatable, intent(out) :: error

      type(beam_model_t) :: model
      type(free_modes_t) :: modes
      type(response_t) :: response
      type(output_settings_t) :: output
      real(wp) :: start

      call model_of_case(this, way, model, error)
      if (allocated(error)) return
      call find_free_modes(model, modes, error)
      if (allocated(error)) return
      output%history(eta_tip) = .false.
      output%history(force_stop) = .false.
      output%energy = .true.
      output%measures = .true.
      call respond(this, way, model, modes, duration, output, response, error)
      if (allocated(error)) return
      outcome%own_frequency = sqrt(modes%square(1))
      outcome%mobility = sum(modes%mode(modes%stop_dof, :)**2)
      call measure(response, response%measures, outcome, start)
      if (.not. outcome%rebounds) return
      ! one sample into the flight: what the release itself does to the highest modes is over
      output = output_settings_t(history=.false.)
      allocate (output%shape_times, source=[start + 0.01_wp])
      call respond(this, way, model, modes, start + 0.05_wp, output, response, error)
      if (allocated(error)) return
      call measure_components(this, model, modes, response, outcome)
   end subroutine find_outcome

   !> The motion of a case.
   subroutine respond(this, way, model, modes, duration, output, response, error)
      type(figure_case_t), intent(in) :: this
      !> How it is computed
      type(way_t), intent(in) :: way
      !> Its beam and the modes of the beam
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(in) :: modes
      !> Length of the run, tau
      real(wp), intent(in) :: duration
      !> What to keep
      type(output_settings_t), intent(in) :: output
      type(response_t), intent(out) :: response
      !> Set when the run fails
      type(failure_t), allocatable, intent(out) :: error

      type(run_settings_t) :: settings

      ! Newmark's beta = 1/4 and tolerances of 1e-4 and 1e-2 are the paper's
      settings%zeta = this%zeta
      settings%stop = stop_of_case(this, way%impulse)
      settings%response%duration = duration
      settings%response%step = sample_step
      settings%response%method = way%method
      settings%response%keep_all_modes = .true.
      settings%output = output
      settings%height_ratio = height_ratio
      call run_motion(model, settings, response, error, modes)
   end subroutine respond

   !> What histories and events tell.
   pure subroutine measure(response, measures, outcome, start)
      !> The motion of a case
      type(response_t), intent(in) :: response
      type(run_measures_t), intent(in) :: measures
      !> What was measured
      type(outcome_t), intent(inout) :: outcome
      !> Instant at which the main rebound begins
      real(wp), intent(out) :: start

      real(wp) :: to_lose, rest, above
      integer :: i, first, last, on, main

      start = 0.0_wp
      allocate (outcome%peak_eta, source=measures%peak_eta)
      allocate (outcome%peak_tau, source=measures%peak_tau)
      rest = measures%rest_energy
      to_lose = measures%start_energy - rest
      outcome%indentation = max(0.0_wp, -minval(response%history(eta_stop)%values))
      associate (eta => response%history(eta_stop)%values, tau => response%tau, energy => response%energy)
         do i = 1, size(end_levels)
            last = findloc(abs(eta) > end_levels(i), .true., dim=1, back=.true.)
            if (last < size(tau)) outcome%ends(i) = tau(last)
         end do
         do i = 1, size(end_shares)
            last = findloc(energy%kinetic + energy%strain + energy%stop - rest > end_shares(i)*to_lose, .true., dim=1, &
               back=.true.)
            if (last < size(tau)) outcome%ends(size(end_levels) + i) = tau(last)
         end do
         outcome%created = energy%created(size(tau))/to_lose
         outcome%lost_at_impacts = energy%dissipated_impact(size(tau))/to_lose
         if (.not. measures%has_met_stop) return
         outcome%first_tau = measures%first_impact_tau
         first = min(size(tau), 1 + count(tau < measures%first_impact_tau))
         above = energy%kinetic(max(first - 1, 1))
         outcome%kinetic_at_first = above/to_lose
         last = max(first, findloc(eta > end_levels(2), .true., dim=1, back=.true.))
         on = count(eta(first:last) < touching_level)
         outcome%contact_ratio = real(on, wp)/real(max(last - first + 1 - on, 1), wp)
      end associate
      if (size(measures%contact_start) > 0) outcome%first_contact = measures%contact_end(1) - measures%contact_start(1)
      associate (early => outcome%peak_tau < measures%first_impact_tau + 2.0_wp*pi/outcome%own_frequency)
         outcome%rebounds = any(early)
         if (.not. outcome%rebounds) return
         main = maxloc(outcome%peak_eta, dim=1, mask=early)
      end associate
      outcome%main_peak = outcome%peak_eta(main)
      do i = 1, response%event_count
         associate (event => response%events(i))
            if (event%tau <= outcome%peak_tau(main)) then
               start = event%tau
               outcome%lost_at_first = outcome%lost_at_first + max(0.0_wp, -event%energy_change)/to_lose
            else if (event%kind == event_impact .or. event%kind == event_contact) then
               outcome%later_velocity = max(outcome%later_velocity, -event%velocity_before)
            end if
         end associate
      end do
      outcome%first_touching = start - measures%first_impact_tau
   end subroutine measure

   !> The parts of the modes early in the first rebound.
   pure subroutine measure_components(this, model, modes, response, outcome)
      type(figure_case_t), intent(in) :: this
      !> Its beam and the modes of the beam
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(in) :: modes
      !> A run with one shape
      type(response_t), intent(in) :: response
      !> What was measured
      type(outcome_t), intent(inout) :: outcome

      real(wp), dimension(2*model%mesh%elements) :: shape, rate, product, q, v, energy, swing
      integer :: n

      n = model%mesh%elements
      shape(1::2) = response%shape_displacement(1:n, 1) + this%preload
      shape(2::2) = response%shape_slope(1:n, 1)
      rate(1::2) = response%shape_velocity(1:n, 1)
      rate(2::2) = response%shape_slope_velocity(1:n, 1)
      call multiply(model%mass, shape, product)
      q = matmul(product, modes%mode)
      call multiply(model%mass, rate, product)
      v = matmul(product, modes%mode)
      energy = 0.5_wp*(v**2 + modes%square*q**2)
      n = min(most_modes, 2*n)
      outcome%energy_share(:n) = energy(:n)/sum(energy)
      swing = abs(modes%mode(modes%stop_dof, :))*sqrt(2.0_wp*energy/modes%square)
      outcome%high_displacement = sum(swing(3:))/sum(swing)
      swing = swing*sqrt(modes%square)
      outcome%high_velocity = sum(swing(3:))/sum(swing)
   end subroutine measure_components

end module paper_outcomes
