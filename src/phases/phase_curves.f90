!> The gap of a contact during a phase of exact motion (the motion between two events), stored because the last
!> exceedance of the settling level is searched at the end of the run.
module phase_curves
   use certified_search, only: transformable_signal_t
   use kinds, only: wp
   use motion_intervals, only: curve_t
   use response_types, only: settling_level
   use signal_peaks, only: find_last_exceedance
   implicit none (type, external)
   private
   public :: signal_curve_t

   !> The gap of a contact during a phase.
   type, extends(curve_t) :: signal_curve_t
      class(transformable_signal_t), allocatable :: signal
      !> Whether the gap is always above minus the settling level (`settling_level`): only positive gaps need a search
      logical :: is_above = .false.
      !> Latest known time at which the gap exceeds the settling level; 0: none known
      real(wp) :: known_above = 0.0_wp
   contains
      procedure :: last_exceedance
   end type signal_curve_t

contains

   !> Find the last time at which the magnitude of the gap exceeds a level.
   subroutine last_exceedance(self, level, time, is_at_end)
      class(signal_curve_t), intent(in) :: self
      real(wp), intent(in) :: level
      real(wp), intent(out) :: time
      logical, intent(out) :: is_at_end

      ! minus the gap, and the result of its search
      class(transformable_signal_t), allocatable :: indentation
      real(wp) :: last_negative
      logical :: ends_negative

      call find_last_exceedance(self%signal, self%length, level, time, is_at_end, &
         merge(self%known_above, 0.0_wp, level <= settling_level))
      if (self%is_above .and. level >= settling_level) return
      call self%signal%transform(0.0_wp, -1.0_wp, 0.0_wp, 0, indentation)
      call find_last_exceedance(indentation, self%length, level, last_negative, ends_negative)
      time = max(time, last_negative)
      is_at_end = is_at_end .or. ends_negative
   end subroutine last_exceedance

end module phase_curves
