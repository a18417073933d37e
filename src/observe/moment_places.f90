!> Bending moment and stress at given positions of the beam ("places"), for either method: the weights that give the
!> moments from state and loads, and the extremes of the moments (docs/theory.md, section 19).
!>
!> Displacements are in D, times in tau. Moments are in the unit of Pbar times L, lambda1^4 E Ibar D/(hbar L), stresses
!> in E D/L; hbar is the mean height of the beam, `height_ratio` is hbar/L.
module moment_places
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use applied_loads, only: applied_loads_t, count_forces
   use beam_loads, only: moment_of_line_load, moment_of_point_load, moment_weights, moment_weights_t
   use beam_model, only: beam_model_t
   use beam_section, only: fibre_over_inertia, inertia, outer_fibre
   use free_modes, only: free_modes_t
   use kinds, only: lambda1_power4, wp
   use motion_intervals, only: interval_t, peak_t, output_row_t
   use response_types, only: moment_record_t, response_t
   use run_settings, only: run_settings_t
   use signal_peaks, only: extreme_search_t
   use stop_contacts, only: contact_t
   implicit none (type, external)
   private
   public :: place_weights_t, find_place_weights, take_modes, open_moments, track_moments, finish_moments

   !> Weights of the moments. The moment at a place is stiffness . (y + 2 zeta y') + mass . (y'' + alpha y') + load . F,
   !> with y the displacements of the degrees of freedom, a prime for d/dtau, alpha the coefficient of mass-proportional
   !> damping, and F the values of the time courses of the loads.
   type :: place_weights_t
      !> Weights of the degrees of freedom in the term with y + 2 zeta y', [degrees of freedom, places]
      real(wp), allocatable :: stiffness(:, :)
      !> Weights in the term with y'' + alpha y', [degrees of freedom, places]
      real(wp), allocatable :: mass(:, :)
      !> Moment per unit of the time course of a load, [loads, places]
      real(wp), allocatable :: load(:, :)
      !> Moment per unit of contact force by the static response of truncated modes, [contacts, places]; unallocated:
      !> the degrees of freedom are no modes
      real(wp), allocatable :: contact(:, :)
   end type place_weights_t

contains

   !> Compute the weights at all places.
   pure subroutine find_place_weights(model, settings, loads, place_weights)
      type(beam_model_t), intent(in) :: model
      !> Settings that request moments
      type(run_settings_t), intent(in) :: settings
      !> Applied loads, the forces first and then the motions of the base; their count may be 0
      type(applied_loads_t), intent(in) :: loads
      !> The weights
      type(place_weights_t), intent(out) :: place_weights

      ! weights at one place, for E Ibar = rho Abar = L = 1
      type(moment_weights_t) :: weights
      real(wp) :: moment_unit
      integer :: forces, g, i, p

      ! E Ibar D/L^2 in the unit of moments
      moment_unit = settings%height_ratio/lambda1_power4
      forces = count_forces(settings)
      associate (x => settings%stress%position, order => model%mass%order)
         allocate (place_weights%stiffness(order, size(x)), place_weights%mass(order, size(x)))
         allocate (place_weights%load(loads%count, size(x)), source=0.0_wp)
         do p = 1, size(x)
            weights = moment_weights(model, x(p))
            place_weights%stiffness(:, p) = moment_unit*weights%stiffness
            place_weights%mass(:, p) = settings%height_ratio*weights%mass
            do g = 1, forces
               associate (force => settings%forces(g))
                  if (allocated(force%position)) then
                     place_weights%load(g, p) = sum([(moment_of_point_load(model, x(p), force%position(i)), &
                        i=1, size(force%position))])
                  else
                     place_weights%load(g, p) = moment_of_line_load(model, x(p), force%stretch(1), force%stretch(2))
                  end if
               end associate
            end do
            ! forces of the settings are in 3 E Ibar D/L^3
            place_weights%load(:forces, p) = 3.0_wp*moment_unit*place_weights%load(:forces, p)
            place_weights%load(forces + 1:, p) = settings%height_ratio*weights%base
         end do
      end associate
   end subroutine find_place_weights

   !> Turn weights of the degrees of freedom into weights of modes, and add the static response of truncated modes to
   !> loads and contact forces.
   pure subroutine take_modes(model, modes, contacts, loads, weights)
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(in) :: modes
      type(contact_t), intent(in) :: contacts(:)
      !> The loads on the degrees of freedom
      type(applied_loads_t), intent(in) :: loads
      type(place_weights_t), intent(inout) :: weights

      ! static response of truncated modes: moment at each place per unit of force on each degree of freedom
      real(wp), allocatable :: static(:, :)
      integer :: k

      allocate (weights%contact(size(contacts), size(weights%stiffness, 2)), source=0.0_wp)
      if (allocated(modes%truncated_mode)) then
         static = matmul(modes%truncated_mode, matmul(transpose(modes%truncated_mode), &
            weights%stiffness(:size(modes%truncated_mode, 1), :)) &
            /spread(modes%truncated_square, 2, size(weights%stiffness, 2)))
         if (loads%count > 0) weights%load = weights%load + matmul(transpose(loads%vector(:size(static, 1), :)), static)
         do k = 1, size(contacts)
            if (contacts(k)%settings%is_of_base) cycle
            weights%contact(k, :) = contacts(k)%sign*static(model%stop_dofs(contacts(k)%stop), :)
         end do
      end if
      associate (shapes => modes%mode(:model%mass%order, :))
         weights%stiffness = matmul(transpose(shapes), weights%stiffness)
         weights%mass = matmul(transpose(shapes), weights%mass)
      end associate
   end subroutine take_modes

   !> Allocate the recorded moments.
   pure subroutine open_moments(model, settings, samples, response)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      !> Number of samples after that at the start
      integer, intent(in) :: samples
      !> The response; its other histories are allocated already
      type(response_t), intent(inout) :: response

      integer :: i, p

      if (.not. allocated(settings%stress)) return
      associate (x => settings%stress%position)
         allocate (response%moments(size(x)))
         response%moments%position = x
         do p = 1, size(x)
            ! the section is described by the distance 1 - x to the tip; `outer_fibre` is 0 if it is unknown
            associate (moment => response%moments(p), tip_distance => 1.0_wp - x(p))
               moment%has_stress = outer_fibre(model%section, tip_distance) > 0.0_wp .or. &
                  inertia(model%section, tip_distance) <= 0.0_wp
               moment%stress_per_moment = lambda1_power4*fibre_over_inertia(model%section, tip_distance)
               if (settings%stress%history) allocate (moment%moment(samples + 1), source=0.0_wp)
            end associate
         end do
      end associate
      if (.not. settings%stress%history .or. allocated(response%tau)) return
      allocate (response%tau, source=[(real(i, wp)*settings%response%step, i=0, samples)])
   end subroutine open_moments

   !> Update the extremes of the moments by an interval of the motion (a phase or a step).
   subroutine track_moments(interval, moments)
      class(interval_t), intent(inout) :: interval
      !> Recorded moments, [places]
      type(moment_record_t), intent(inout) :: moments(:)

      ! value and rate of the moment
      real(wp) :: state(2)
      integer :: p

      do p = 1, size(moments)
         associate (moment => moments(p))
            ! `seek_peak` returns at once if a bound of the moment does not exceed the extremes so far, which the values
            ! at both ends mostly raise
            state = interval%evaluate(output_row_t(interval%moment_row(p)), 0.0_wp)
            call update_extremes(moment, state(1), interval%start)
            state = interval%evaluate(output_row_t(interval%moment_row(p)), interval%length)
            call update_extremes(moment, state(1), interval%start + interval%length)
            call seek_extreme(1.0_wp, moment%maximum, moment%maximum_search)
            call seek_extreme(-1.0_wp, -moment%minimum, moment%minimum_search)
         end associate
      end do

   contains

      !> Search for a value of sign times the moment that exceeds a threshold.
      subroutine seek_extreme(sign, threshold, search_state)
         real(wp), intent(in) :: sign
         real(wp), intent(in) :: threshold
         type(extreme_search_t), intent(inout) :: search_state

         type(peak_t) :: peak

         ! the row is sign times the moment plus 0; the tolerance refers to the maximum magnitude so far
         call interval%seek_peak(output_row_t(interval%moment_row(p), sign, 0.0_wp, max(moments(p)%maximum, &
            -moments(p)%minimum)), [0.0_wp, interval%length], threshold, peak, search_state)
         if (peak%is_found) call update_extremes(moments(p), sign*peak%value, interval%start + peak%time)
      end subroutine seek_extreme
   end subroutine track_moments

   !> Update the extremes of a moment by its value at an instant.
   elemental subroutine update_extremes(moment, value, tau)
      type(moment_record_t), intent(inout) :: moment
      real(wp), intent(in) :: value
      real(wp), intent(in) :: tau

      if (value > moment%maximum) then
         moment%maximum = value
         moment%maximum_tau = tau
      end if
      if (value < moment%minimum) then
         moment%minimum = value
         moment%minimum_tau = tau
      end if
   end subroutine update_extremes

   !> Store the extremes over all places among the measures at the end of the run. Measures named `greatest` are maxima
   !> of the magnitude; `maximum` and `minimum` of a place are signed.
   pure subroutine finish_moments(response)
      type(response_t), intent(inout) :: response

      integer :: p

      if (.not. (allocated(response%moments) .and. allocated(response%measures))) return
      if (size(response%moments) == 0) return
      associate (moments => response%moments, measures => response%measures)
         measures%has_moment = .true.
         measures%extremes_tolerance = max(measures%extremes_tolerance, &
            maxval(moments%minimum_search%tolerance), maxval(moments%maximum_search%tolerance))
         measures%greatest_moment = max(maxval(moments%maximum), maxval(-moments%minimum))
         measures%has_stress = all(moments%has_stress)
         call finish_window_measures(response)
         if (.not. measures%has_stress) return
         measures%stress_range = maxval(moments%stress_per_moment*(moments%maximum - moments%minimum))
         ! the place of the maximum stress
         p = maxloc(moments%stress_per_moment*max(moments%maximum, -moments%minimum), dim=1)
         associate (moment => moments(p))
            measures%greatest_stress = moment%stress_per_moment*max(moment%maximum, -moment%minimum)
            measures%greatest_stress_tau = merge(moment%maximum_tau, moment%minimum_tau, &
               moment%maximum >= -moment%minimum)
            measures%greatest_stress_position = moment%position
         end associate
      end associate
   end subroutine finish_moments

   !> Store the extremes over all places within the window of &statistics, and the cycles, among the measures.
   pure subroutine finish_window_measures(response)
      type(response_t), intent(inout) :: response

      real(wp) :: stress_per_moment(size(response%moments)), nan
      integer :: p

      if (.not. allocated(response%moment_windows)) return
      nan = ieee_value(1.0_wp, ieee_quiet_nan)
      stress_per_moment = response%moments%stress_per_moment
      associate (windows => response%moment_windows, measures => response%measures)
         measures%extremes_tolerance = max(measures%extremes_tolerance, maxval(windows%tolerance))
         measures%steady = [minval(windows%extremes(1)), maxval(windows%extremes(2)), &
            maxval(windows%extremes(2) - windows%extremes(1)), nan, nan, nan]
         if (.not. measures%has_stress) return
         measures%steady(4:6) = [minval(stress_per_moment*windows%extremes(1)), &
            maxval(stress_per_moment*windows%extremes(2)), &
            maxval(stress_per_moment*(windows%extremes(2) - windows%extremes(1)))]
         p = maxloc(windows%equivalent_range, dim=1)
         if (any(windows%counted_until < [(windows(p)%window(2), p=1, size(windows))])) return
         if (windows(p)%slope > 0.0_wp) measures%fatigue = [windows(p)%cycles, windows(p)%equivalent_range]
      end associate
   end subroutine finish_window_measures

end module moment_places
