!> Observers of a run, for either method: measures, statistics, Poincare sections and extremes of moments, which are
!> computed from the intervals (phases or steps) and events of the run. Every observer is called by the procedures of
!> this module.
module run_observers
   use block_statistics, only: finish_statistics, open_blocks, add_events
   use contact_measures, only: finish_measures, measure_interval, measures_t
   use interval_statistics, only: add_interval
   use kinds, only: wp
   use moment_places, only: finish_moments, track_moments
   use motion_intervals, only: interval_t
   use response_types, only: moment_record_t, response_t
   use run_settings, only: run_settings_t
   use run_spectra, only: finish_spectrum, open_spectrum, spectrum_sums_t, take_impulses, &
      take_spectrum => add_interval
   use section_records, only: finish_sections, open_sections, record_sections
   use section_types, only: run_sections_t
   use statistic_types, only: block_sums_t
   use stress_windows, only: finish_windows, open_windows, stress_windows_t, add_to_windows => add_interval
   implicit none (type, external)
   private
   public :: observers_t, open_observers, observe, observe_events, finish_observers, reads_losses

   !> State of all observers of a run.
   type :: observers_t
      type(measures_t) :: measures
      !> Sums for &statistics; unallocated, like each of the next four components: not requested
      type(block_sums_t), allocatable :: blocks
      !> Sections for &poincare
      type(run_sections_t), allocatable :: sections
      !> Extremes of moments for &stress
      type(moment_record_t), allocatable :: moments(:)
      !> Extremes within the window of &statistics, and cycles, for &stress
      type(stress_windows_t), allocatable :: stress_windows
      !> Integrals for &spectrum
      type(spectrum_sums_t), allocatable :: spectrum
   end type observers_t

contains

   !> Prepare the observers of a run.
   subroutine open_observers(settings, number, has_finite_force, release_contact, response, observers, modes)
      type(run_settings_t), intent(in) :: settings
      !> Number of each contact in the scene's order
      integer, intent(in) :: number(:)
      !> Whether the force of each contact is finite: the stop is compliant, or a massless node of the beam is in front
      !> of it
      logical, intent(in) :: has_finite_force(:)
      !> Index of the release contact, to which histories refer; 0: there is none
      integer, intent(in) :: release_contact
      !> The run; its moments are allocated if they are requested
      type(response_t), intent(in) :: response
      type(observers_t), intent(inout) :: observers
      !> Number of modes whose state sections may record; absent: none
      integer, intent(in), optional :: modes

      logical :: is_finite_in_order(size(number))
      ! number of the release contact in the scene's order; 0: there is none
      integer :: first

      is_finite_in_order(number) = has_finite_force
      first = 0
      if (release_contact > 0) first = number(release_contact)
      if (allocated(response%moments)) then
         observers%moments = response%moments
         call open_windows(settings, response%moments, observers%stress_windows)
      end if
      if (allocated(settings%statistics)) then
         allocate (observers%blocks)
         call open_blocks(settings, is_finite_in_order, first, observers%blocks)
      end if
      if (allocated(settings%spectrum)) then
         allocate (observers%spectrum)
         call open_spectrum(settings, first, observers%spectrum)
      end if
      if (allocated(settings%poincare)) call open_sections(settings, size(number), first, observers%sections, modes)
   end subroutine open_observers

   !> Whether observers read the energy that stops dissipate.
   pure logical function reads_losses(observers) result(reads)
      type(observers_t), intent(in) :: observers

      reads = observers%measures%is_wanted .or. allocated(observers%blocks)
   end function reads_losses

   !> Pass an interval to the observers. The caller passes the events at its end by `observe_events`.
   subroutine observe(observers, interval)
      type(observers_t), intent(inout) :: observers
      class(interval_t), intent(inout) :: interval

      if (allocated(observers%blocks)) call add_interval(interval, observers%blocks)
      if (allocated(observers%sections)) call record_sections(interval, observers%sections)
      if (allocated(observers%spectrum)) call take_spectrum(interval, observers%spectrum)
      if (allocated(observers%stress_windows)) call add_to_windows(interval, observers%stress_windows)
      if (.not. observers%measures%is_wanted) return
      if (allocated(observers%moments)) call track_moments(interval, observers%moments)
      call measure_interval(interval, observers%measures)
   end subroutine observe

   !> Pass new events of a run to the observers.
   subroutine observe_events(observers, response)
      type(observers_t), intent(inout) :: observers
      type(response_t), intent(in) :: response

      if (allocated(observers%blocks)) call add_events(observers%blocks, response)
      if (allocated(observers%spectrum)) call take_impulses(response, observers%spectrum)
   end subroutine observe_events

   !> Store the results of the observers in the response at the end of the run.
   subroutine finish_observers(observers, duration, lost, created, number, response)
      type(observers_t), intent(inout) :: observers
      !> Length of the run, tau
      real(wp), intent(in) :: duration
      !> Energy dissipated in the beam, in stops, at impacts
      real(wp), intent(in) :: lost(3)
      !> Energy created by replacing nodal velocities
      real(wp), intent(in) :: created
      !> Number of each contact in the scene's order
      integer, intent(in) :: number(:)
      !> The run, with its events and contacts
      type(response_t), intent(inout) :: response

      integer :: p

      if (allocated(observers%moments)) then
         do p = 1, size(response%moments)
            call move_alloc(response%moments(p)%moment, observers%moments(p)%moment)
         end do
         call move_alloc(observers%moments, response%moments)
      end if
      if (observers%measures%is_wanted) call finish_measures(observers%measures, duration, lost, created, number, &
         response)
      if (allocated(observers%blocks)) call finish_statistics(observers%blocks, response)
      if (allocated(observers%sections)) call finish_sections(observers%sections, response)
      if (allocated(observers%spectrum)) call finish_spectrum(observers%spectrum, response%spectrum)
      if (allocated(observers%stress_windows)) call finish_windows(observers%stress_windows, response)
      call finish_moments(response)
   end subroutine finish_observers

end module run_observers
