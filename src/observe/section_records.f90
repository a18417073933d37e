!> Poincare sections of a run, by either method: states of tip and contacts at intervals of one period of the load (in
!> the record of a periodic orbit, of a fraction of the orbit's period), and measures that follow from them: the period
!> of the motion, impacts per period, and the Lyapunov exponent (docs/theory.md, section 21).
module section_records
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
   use kinds, only: pi, wp
   use motion_intervals, only: interval_t, observed_contact_t, output_row_t
   use response_types, only: is_impact, response_t
   use run_settings, only: run_settings_t
   use section_types, only: run_sections_t
   implicit none (type, external)
   private
   public :: open_sections, record_sections, finish_sections

contains

   !> Compute the instants of the sections, and allocate the records.
   pure subroutine open_sections(settings, contacts, release_contact, sections, modes)
      !> Settings with sections
      type(run_settings_t), intent(in) :: settings
      !> Number of contacts
      integer, intent(in) :: contacts
      !> Number of the release contact, to which histories refer; 0: there is none
      integer, intent(in) :: release_contact
      type(run_sections_t), allocatable, intent(out) :: sections
      !> Number of modes whose state is recorded; absent: none
      integer, intent(in), optional :: modes

      ! instant of the first section without skipped periods, in periods of the load
      real(wp) :: first
      integer :: k, n

      allocate (sections)
      associate (requested => settings%poincare, duration => settings%response%duration)
         sections%period = requested%period
         sections%max_periods = requested%max_periods
         sections%tolerance = requested%tolerance
         sections%release_contact = release_contact
         first = modulo(requested%phase, 1.0_wp)
         ! the start of the run is not a section
         if (first <= 0.0_wp) first = 1.0_wp
         ! includes a section at the end of the run in spite of rounding
         n = int(max(0.0_wp, min(real(requested%keep, wp), duration/requested%period*(1.0_wp + 8.0_wp*epsilon(1.0_wp)) &
            - (real(requested%skip, wp) + first) + 1.0_wp)))
         allocate (sections%tau(n), sections%contact(2, contacts, n), sections%impacts(n))
         sections%tau = [(min(duration, (real(requested%skip + k - 1, wp) + first)*requested%period), k=1, n)]
         if (present(modes) .and. requested%records_modes) allocate (sections%modes(2, modes, n))
      end associate
   end subroutine open_sections

   !> Record the sections within an interval, including its end.
   subroutine record_sections(interval, sections)
      class(interval_t), intent(in) :: interval
      type(run_sections_t), intent(inout) :: sections

      type(observed_contact_t) :: contact
      real(wp) :: end, time
      integer :: k

      ! a section after the end of the interval by rounding only lies within the interval
      end = (interval%start + interval%length)*(1.0_wp + 8.0_wp*epsilon(1.0_wp))
      if (.not. allocated(sections%displacement)) allocate (sections%displacement(2, 0:interval%others, &
         size(sections%tau)))
      do while (sections%count < size(sections%tau))
         associate (n => sections%count + 1)
            if (sections%tau(n) > end) exit
            time = min(max(sections%tau(n) - interval%start, 0.0_wp), interval%length)
            do k = 0, interval%others
               sections%displacement(:, k, n) = interval%evaluate(output_row_t(interval%displacement_row(k)), time)
            end do
            do k = 1, interval%contacts
               contact = interval%contact(k)
               sections%contact(:, contact%number, n) = [contact%sign*contact%signed_height, 0.0_wp]
               if (.not. contact%has_zero_gap) sections%contact(:, contact%number, &
                  n) = interval%evaluate(output_row_t(k, contact%sign, contact%sign*contact%signed_height), time)
            end do
         end associate
         sections%count = sections%count + 1
      end do
   end subroutine record_sections

   !> Compute the measures of the sections at the end of the run, and store the sections in the response.
   pure subroutine finish_sections(sections, response)
      type(run_sections_t), allocatable, intent(inout) :: sections
      !> The run, with its events and, if requested, its measures; receives the sections
      type(response_t), intent(inout) :: response

      ! number of sections over which impacts are averaged
      integer :: last

      call count_impacts(response, sections)
      call find_period(sections)
      last = sections%motion_period
      if (last == 0) last = sections%count
      sections%impacts_per_period = ieee_value(1.0_wp, ieee_quiet_nan)
      if (last > 0) sections%impacts_per_period = real(sum(sections%impacts(sections%count - last &
         + 1:sections%count)), wp)/real(last, wp)
      sections%lyapunov_exponent = exponent_of(sections)
      if (allocated(response%measures)) then
         response%measures%has_sections = .true.
         response%measures%lyapunov_exponent = sections%lyapunov_exponent
         response%measures%motion_period = sections%motion_period
         response%measures%impacts_per_period = sections%impacts_per_period
      end if
      call move_alloc(sections, response%sections)
   end subroutine finish_sections

   !> Lyapunov exponent: growth rate of a variation from the first section to the last; NaN if the variation was not
   !> computed or has vanished.
   pure real(wp) function exponent_of(sections) result(exponent)
      type(run_sections_t), intent(in) :: sections

      exponent = ieee_value(1.0_wp, ieee_quiet_nan)
      associate (n => sections%count)
         if (.not. allocated(sections%log_norm) .or. n < 2) return
         if (ieee_is_nan(sections%log_norm(n))) return
         exponent = (sections%log_norm(n) - sections%log_norm(1))/(sections%tau(n) - sections%tau(1))
      end associate
   end function exponent_of

   !> Count the impacts in the period before each section.
   pure subroutine count_impacts(response, sections)
      type(response_t), intent(in) :: response
      type(run_sections_t), intent(inout) :: sections

      integer :: i, k

      sections%impacts = 0
      k = 1
      do i = 1, response%event_count
         associate (event => response%events(i))
            if (.not. is_impact(event)) cycle
            do while (k <= sections%count)
               if (event%tau <= sections%tau(k)) exit
               k = k + 1
            end do
            if (k > sections%count) return
            if (event%tau > sections%tau(k) - sections%period) sections%impacts(k) = sections%impacts(k) + 1
         end associate
      end do
   end subroutine count_impacts

   !> Find the period of the motion at the end of the run: the minimum number p of periods of the load for which each of
   !> the last p sections equals the section p periods before it.
   pure subroutine find_period(sections)
      type(run_sections_t), intent(inout) :: sections

      ! if sections differ by more than the tolerance, but by less than this multiple of the tolerance, no period is
      ! reported
      real(wp), parameter :: ambiguity = 100.0_wp
      ! maximum size of a section
      real(wp) :: max_size
      ! maximum size of a difference of sections
      real(wp) :: return_error
      integer :: p

      associate (n => sections%count, displacement => sections%displacement, positions => sections%contact)
         max_size = max(size_of(displacement(:, :, :n)), size_of(positions(:, :, :n)))
         do p = 1, min(sections%max_periods, n/2)
            return_error = max(size_of(displacement(:, :, n - p + 1:n) - displacement(:, :, n - 2*p + 1:n - p)), &
               size_of(positions(:, :, n - p + 1:n) - positions(:, :, n - 2*p + 1:n - p)))
            if (return_error <= sections%tolerance*max_size) sections%motion_period = p
            ! a transient that has nearly decayed would otherwise appear as a motion of a longer period
            if (return_error <= ambiguity*sections%tolerance*max_size) return
         end do
      end associate

   contains

      !> Maximum magnitude of displacement, or of velocity over the frequency of the load.
      pure real(wp) function size_of(states) result(max_size)
         !> Displacements and velocities, [2, points, sections]
         real(wp), intent(in) :: states(:, :, :)

         max_size = 0.0_wp
         if (size(states) == 0) return
         max_size = max(maxval(abs(states(1, :, :))), maxval(abs(states(2, :, :)))*sections%period/(2.0_wp*pi))
      end function size_of
   end subroutine find_period

end module section_records
