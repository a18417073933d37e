!> Which modes of the beam a run can do without, and how far that may be trusted (docs/theory.md, section 13).
module mode_choice
   use damped_oscillators, only: damping_order
   use free_modes, only: free_modes_t
   use history_list, only: eta_stop, eta_tip, history_table
   use kinds, only: lambda1, pi, wp
   use response_types, only: mode_check_t, quiet_level, response_t
   use run_settings, only: output_settings_t, run_settings_t, stress_settings_t
   use sorting, only: order_columns
   implicit none (type, external)
   private
   public :: agreement, compare_runs, modes_that_matter, next_count, trial_settings, rates_of_modes, take_modes

   !> Two runs that differ by no more than this share of the mode tolerance agree: the rest is for what more modes yet
   !> would change, which falls with their number.
   real(wp), parameter :: agreement = 0.03_wp
   !> The modes left out of the run of more modes yield at the stop by this share of what those of the other do.
   real(wp), parameter :: growth = 0.5_wp
   !> Runs are compared until the peak of this rebound, and over so many periods of the lowest mode at most.
   integer, parameter :: last_rebound = 3, most_periods = 4
   !> Samples in such a period.
   integer, parameter :: samples = 256

contains

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

   !> More modes than a number, so many that those left out yield much less at the stop; all, if no fewer do.
   pure function next_count(square, stop_value, count) result(more)
      !> W_i^2, ascending
      real(wp), intent(in) :: square(:)
      !> b_i
      real(wp), intent(in) :: stop_value(:)
      !> The number
      integer, intent(in) :: count
      integer :: more

      real(wp) :: tail

      tail = sum(stop_value(count + 1:)**2/square(count + 1:))
      do more = count + 1, size(square) - 1
         if (sum(stop_value(more + 1:)**2/square(more + 1:)) <= growth*tail) return
      end do
   end function next_count

   !> alpha of each mode: that of damping by mass, or what gives it a ratio of its own.
   pure function rates_of_modes(settings, square) result(rate)
      type(run_settings_t), intent(in) :: settings
      !> W_i^2
      real(wp), intent(in) :: square(:)
      real(wp) :: rate(size(square))

      integer :: i

      rate = 2.0_wp*settings%zeta_mass
      if (.not. allocated(settings%mode_ratios)) return
      associate (ratio => settings%mode_ratios)
         rate = 2.0_wp*sqrt(square)*ratio([(min(i, size(ratio)), i=1, size(square))])
      end associate
   end function rates_of_modes

   !> The lowest modes in the order of their damping, and what settings say of single ones.
   subroutine take_modes(kept, modes, settings)
      !> How many
      integer, intent(in) :: kept
      type(free_modes_t), intent(inout) :: modes
      type(run_settings_t), intent(inout) :: settings

      real(wp), allocatable :: ratio(:)
      integer :: i, order(kept)

      order = damping_order(modes%square(:kept), settings%zeta, rates_of_modes(settings, modes%square(:kept)))
      if (kept < size(modes%square) .and. allocated(settings%stress)) then
         allocate (modes%left_square, source=modes%square(kept + 1:))
         allocate (modes%left_mode, source=modes%mode(:, kept + 1:))
      end if
      modes%lambda = modes%lambda(order)
      modes%square = modes%square(order)
      call order_columns(modes%mode, order)
      settings%start%mode = max(findloc(order, settings%start%mode, dim=1), 1)
      if (.not. allocated(settings%mode_ratios)) return
      allocate (ratio, source=settings%mode_ratios)
      deallocate (settings%mode_ratios)
      allocate (settings%mode_ratios, source=[(ratio(min(order(i), size(ratio))), i=1, kept)])
   end subroutine take_modes

   !> A run to compare: no longer than it may be trusted, with samples of its own.
   pure function trial_settings(asked, lowest) result(settings)
      !> The run itself
      type(run_settings_t), intent(in) :: asked
      !> lambda of the lowest mode
      real(wp), intent(in) :: lowest
      type(run_settings_t) :: settings

      real(wp) :: period

      settings = asked
      settings%output = output_settings_t(history=history_table%quantity == 'displacement')
      ! what is not compared costs nothing: moments nowhere, so that a run among surfaces stays one
      if (allocated(settings%stress) .or. allocated(settings%statistics)) then
         settings%stress = stress_settings_t(history=.false.)
         allocate (settings%stress%position(0))
         if (allocated(settings%statistics)) deallocate (settings%statistics)
      end if
      if (allocated(settings%poincare)) deallocate (settings%poincare)
      period = 2.0_wp*pi*(lambda1/lowest)**2
      associate (response => settings%response)
         response%duration = min(asked%response%duration, real(most_periods, wp)*period)
         response%step = min(response%duration, period)/real(samples, wp)
      end associate
   end function trial_settings

   !> The greatest difference of two runs in eta of stop and tip, up to the peak of the third rebound of either.
   pure subroutine compare_runs(fewer, more, duration, check)
      !> The runs, sampled alike
      type(response_t), intent(in) :: fewer
      type(response_t), intent(in) :: more
      !> Their length
      real(wp), intent(in) :: duration
      !> Gets difference and horizon
      type(mode_check_t), intent(inout) :: check

      integer :: last

      check%horizon = min(horizon_of(fewer, duration), horizon_of(more, duration))
      last = count(more%tau <= check%horizon)
      check%difference = max(maxval(abs(fewer%history(eta_stop)%values(:last) &
         - more%history(eta_stop)%values(:last))), &
         maxval(abs(fewer%history(eta_tip)%values(:last) - more%history(eta_tip)%values(:last))))
   end subroutine compare_runs

   !> The sample at the peak of the third rebound, a flight that rises above the quiet level; the end if there are
   !> fewer.
   pure function horizon_of(response, duration) result(horizon)
      type(response_t), intent(in) :: response
      !> Its length
      real(wp), intent(in) :: duration
      real(wp) :: horizon

      real(wp) :: highest
      integer :: event, rebounds, i

      horizon = duration
      event = 0
      rebounds = 0
      do i = 1, size(response%tau)
         do while (event < response%event_count)
            if (response%events(event + 1)%tau > response%tau(i)) exit
            event = event + 1
            highest = quiet_level
         end do
         if (event == 0) cycle
         if (response%history(eta_stop)%values(i) <= highest) cycle
         if (highest <= quiet_level) rebounds = rebounds + 1
         if (rebounds > last_rebound) return
         if (rebounds == last_rebound) horizon = response%tau(i)
         highest = response%history(eta_stop)%values(i)
      end do
   end function horizon_of

end module mode_choice
