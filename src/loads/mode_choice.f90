!> Numbers of lowest modes for the trial runs from which `choose_modes` finds the number of modes of a run; selection,
!> order and damping rates of the chosen modes (docs/theory.md, section 13).
module mode_choice
   use applied_loads, only: courses_of
   use damped_oscillators, only: damping_order
   use free_modes, only: free_modes_t, order_modes, retain_modes
   use kinds, only: pi, wp
   use load_courses, only: frequency_of
   use load_settings, only: course_table, time_course_t
   use run_settings, only: run_settings_t
   implicit none (type, external)
   private
   public :: first_count, next_count, max_count, max_all_modes, rates_of_modes, select_modes, damps_each_mode, &
      common_zeta

   !> A beam with up to this number of modes uses all of them: trial runs would cost more time than they save.
   integer, parameter :: max_all_modes = 32
   !> Numbers of lowest modes in successive trial runs; the trials end with the last of them.
   integer, parameter :: counts(*) = [8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256]
   !> Maximum number of lowest modes.
   integer, parameter :: max_count = counts(size(counts))
   !> Modes up to this multiple of the highest load frequency are always included, `max_for_loads` at most, because a
   !> resonance may need longer than a trial run to develop.
   real(wp), parameter :: frequency_margin = 2.0_wp
   !> Maximum number of modes that are included because of the frequencies of loads.
   integer, parameter :: max_for_loads = 64
   !> Reversals of a table count if they change its value by more than this fraction of its maximum magnitude.
   real(wp), parameter :: min_reversal = 1.0e-3_wp
contains

   !> Number of lowest modes of the first trial run.
   pure integer function first_count(settings, base) result(count_of_first)
      type(run_settings_t), intent(in) :: settings
      !> Modes among which the run chooses: all modes, or the lowest
      type(free_modes_t), intent(in) :: base

      type(time_course_t), allocatable :: courses(:)
      integer :: k

      count_of_first = counts(1)
      allocate (courses, source=courses_of(settings))
      do k = 1, size(courses)
         count_of_first = max(count_of_first, min(count(sqrt(base%square) < frequency_margin &
            *highest_frequency(courses(k))), max_for_loads))
      end do
      if (allocated(settings%mode_ratios)) count_of_first = max(count_of_first, size(settings%mode_ratios))
      count_of_first = max(count_of_first, settings%start%mode)
      ! at least as many modes as stops, which can be closed at once: the forces of more closed contacts than modes
      ! would not be determined (`check_mode_count`)
      if (allocated(settings%more_stops)) count_of_first = max(count_of_first, 1 + size(settings%more_stops))
   end function first_count

   !> Circular frequency of a load; for a table pi over the minimum time between two reversals. 0: the load is a step or
   !> a rectangular pulse, which has no frequency.
   pure function highest_frequency(course) result(frequency)
      type(time_course_t), intent(in) :: course
      !> Circular frequency over omega1
      real(wp) :: frequency

      frequency = frequency_of(course)
      if (course%kind == course_table) frequency = pi/min_half_period(course%time, course%value)
   end function highest_frequency

   !> Minimum time from one reversal of a table to the next, the first point counted as a reversal, and from the last
   !> reversal to the last extremum.
   pure real(wp) function min_half_period(time, value) result(half_period)
      real(wp), intent(in) :: time(:)
      real(wp), intent(in) :: value(:)

      real(wp) :: threshold
      integer :: i, reversal, farthest

      half_period = huge(1.0_wp)
      threshold = min_reversal*maxval(abs(value))
      ! index of the last reversal, and of the point of maximum deviation from it since then
      reversal = 1
      farthest = 1
      do i = 2, size(value)
         if (abs(value(i) - value(reversal)) >= abs(value(farthest) - value(reversal)) .and. &
            (value(i) - value(reversal))*(value(farthest) - value(reversal)) >= 0.0_wp) farthest = i
         if (abs(value(i) - value(farthest)) <= threshold) cycle
         if (abs(value(farthest) - value(reversal)) <= threshold) then
            ! the table begins with a change below the threshold
            farthest = i
            cycle
         end if
         half_period = min(half_period, time(farthest) - time(reversal))
         reversal = farthest
         farthest = i
      end do
      if (farthest > reversal) half_period = min(half_period, time(farthest) - time(reversal))
   end function min_half_period

   !> Number of lowest modes of the next trial run; after the last number of the list, a number above `max_count`, which
   !> ends the trials.
   pure integer function next_count(count) result(more)
      !> Number of the last trial run
      integer, intent(in) :: count

      integer :: place

      place = findloc(counts > count, .true., dim=1)
      more = 2*count
      if (place > 0) more = counts(place)
   end function next_count

   !> Whether damping rates are given mode by mode, because damping ratios of modes are given, or because modes have
   !> damping rates of their own.
   pure logical function damps_each_mode(settings, modes) result(answer)
      type(run_settings_t), intent(in) :: settings
      type(free_modes_t), intent(in) :: modes

      answer = allocated(settings%mode_ratios) .or. allocated(modes%own_rate)
   end function damps_each_mode

   !> zeta of the stiffness-proportional damping that all modes have; 0 if damping ratios are given mode by mode.
   pure real(wp) function common_zeta(settings) result(zeta)
      type(run_settings_t), intent(in) :: settings

      zeta = merge(0.0_wp, settings%zeta, allocated(settings%mode_ratios))
   end function common_zeta

   !> Coefficient alpha of mass-proportional damping for each mode: that of the settings, or 2 xi_i W_i for a damping
   !> ratio xi_i of mode i. The last ratio given holds for all further modes. If a mode has a damping rate of its own,
   !> alpha is this rate minus 2 zeta W^2, with zeta of `common_zeta`, and may be negative.
   pure function rates_of_modes(settings, square, own_rate) result(rate)
      type(run_settings_t), intent(in) :: settings
      !> Squared circular frequencies W_i^2, [modes]
      real(wp), intent(in) :: square(:)
      !> Component `own_rate` of the modes; absent: no mode has a rate of its own, [modes]
      real(wp), intent(in), optional :: own_rate(:)
      real(wp) :: rate(size(square))

      integer :: i

      rate = 2.0_wp*settings%zeta_mass
      if (allocated(settings%mode_ratios)) then
         associate (ratio => settings%mode_ratios)
            rate = 2.0_wp*sqrt(square)*ratio([(min(i, size(ratio)), i=1, size(square))])
         end associate
      end if
      if (.not. present(own_rate)) return
      where (own_rate >= 0.0_wp) rate = own_rate - 2.0_wp*common_zeta(settings)*square
   end function rates_of_modes

   !> Select the lowest modes and all that no other mode can replace, order them as `damping_order` requires, find
   !> their damping rates, and reorder the settings of single modes in the same way. Stresses need the truncated modes,
   !> too, for their static response.
   subroutine select_modes(mode_count, modes, settings)
      !> Number of modes of the beam that are selected; if `modes` are those of a run already, number of all modes, none
      !> of which is truncated then
      integer, intent(in) :: mode_count
      type(free_modes_t), intent(inout) :: modes
      type(run_settings_t), intent(inout) :: settings

      integer, allocatable :: order(:)
      integer :: i, total

      if (mode_count < size(modes%square) .and. allocated(settings%stress)) then
         allocate (modes%truncated_square, source=modes%square(mode_count + 1:))
         allocate (modes%truncated_mode, source=modes%mode(:, mode_count + 1:))
      end if
      call retain_modes(settings, mode_count, modes, total)
      modes%rate = rates_of_modes(settings, modes%square(:total), modes%own_rate)
      order = damping_order(modes%square(:total), common_zeta(settings), modes%rate)
      call order_modes(order, modes)
      ! 1: the beam does not start in a mode, or `check_mode_of_start` refuses the mode
      settings%start%mode = max(findloc(order, settings%start%mode, dim=1), 1)
      if (.not. allocated(settings%mode_ratios)) return
      settings%mode_ratios = settings%mode_ratios([(min(order(i), size(settings%mode_ratios)), i=1, total)])
   end subroutine select_modes

end module mode_choice
