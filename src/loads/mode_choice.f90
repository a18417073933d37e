!> Numbers of modes that a run can do with, and the modes themselves (docs/theory.md, section 13).
module mode_choice
   use applied_loads, only: courses_of
   use damped_oscillators, only: damping_order
   use free_modes, only: free_modes_t
   use kinds, only: pi, wp
   use load_settings, only: course_harmonic, course_pulse, course_table, pulse_half_sine, time_course_t
   use run_settings, only: run_settings_t
   use sorting, only: order_columns
   implicit none (type, external)
   private
   public :: first_count, next_count, most_count, largest_untried, rates_of_modes, take_modes

   !> A beam of so many modes moves in all of them: trials would cost what they save.
   integer, parameter :: largest_untried = 32
   !> Numbers of the lowest modes that are tried, one after the other.
   integer, parameter :: counts(*) = [8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256]
   integer, parameter :: most_count = counts(size(counts))
   !> Modes up to so many times the frequency of the fastest load are not left out, as far as that asks for no more than
   !> so many: a resonance may need longer than a trial to show.
   real(wp), parameter :: beyond_loads = 2.0_wp
   integer, parameter :: most_for_loads = 64
   !> Turns of a table count that change it by more than this share of its greatest value.
   real(wp), parameter :: least_turn = 1.0e-3_wp
contains

   !> Number of the lowest modes of the first trial.
   pure function first_count(settings, base) result(count_of_first)
      type(run_settings_t), intent(in) :: settings
      !> All modes, or the lowest
      type(free_modes_t), intent(in) :: base
      integer :: count_of_first

      type(time_course_t), allocatable :: courses(:)
      integer :: k

      count_of_first = counts(1)
      allocate (courses, source=courses_of(settings))
      do k = 1, size(courses)
         associate (fastest => beyond_loads*fastest_of(courses(k)))
            count_of_first = max(count_of_first, min(count(sqrt(base%square) < fastest), most_for_loads))
         end associate
      end do
      if (allocated(settings%mode_ratios)) count_of_first = max(count_of_first, size(settings%mode_ratios))
      count_of_first = max(count_of_first, settings%start%mode)
   end function first_count

   !> The frequency of a load; of a table the highest at which it turns.
   pure function fastest_of(course) result(frequency)
      type(time_course_t), intent(in) :: course
      !> Over omega1
      real(wp) :: frequency

      frequency = 0.0_wp
      if (course%kind == course_harmonic) frequency = course%frequency
      if (course%kind == course_pulse .and. course%shape == pulse_half_sine) frequency = pi/course%duration
      if (course%kind == course_table) frequency = pi/shortest_swing(course%time, course%value)
   end function fastest_of

   !> The shortest time from one turn of a table to the next.
   pure function shortest_swing(time, value) result(shortest)
      real(wp), intent(in) :: time(:)
      real(wp), intent(in) :: value(:)
      real(wp) :: shortest

      real(wp) :: least
      integer :: i, turn, farthest

      shortest = huge(1.0_wp)
      least = least_turn*maxval(abs(value))
      ! the last turn, and the farthest point from there so far
      turn = 1
      farthest = 1
      do i = 2, size(value)
         if (abs(value(i) - value(turn)) >= abs(value(farthest) - value(turn)) .and. &
            (value(i) - value(turn))*(value(farthest) - value(turn)) >= 0.0_wp) farthest = i
         if (abs(value(i) - value(farthest)) <= least) cycle
         shortest = min(shortest, time(farthest) - time(turn))
         turn = farthest
         farthest = i
      end do
      if (farthest > turn) shortest = min(shortest, time(farthest) - time(turn))
   end function shortest_swing

   !> The number of the next trial.
   pure function next_count(count) result(more)
      !> That of the last one
      integer, intent(in) :: count
      integer :: more

      integer :: place

      place = findloc(counts > count, .true., dim=1)
      more = 2*count
      if (place > 0) more = counts(place)
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

end module mode_choice
