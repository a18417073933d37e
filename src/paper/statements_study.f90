!> Every statement of the paper, computed and judged.
module statements_study
   use component_statements, only: judge_components
   use failures, only: failure_t
   use frequency_statements, only: judge_frequencies
   use kinds, only: wp
   use mass_and_taper_statements, only: judge_mass, judge_taper
   use paper_cases, only: way_count, way_t
   use paper_series, only: compute_series, make_series, series_t, vary_mass, vary_position, vary_preload, vary_restitution, &
                           vary_stiffness, vary_taper, vary_zeta
   use place_and_damping_statements, only: judge_damping, judge_position
   use statement_types, only: statements_t
   use stop_statements, only: judge_models, judge_preload, judge_restitution
   implicit none (type, external)
   private
   public :: judge_statements

   integer, parameter :: series_count = 7

contains

   !> Compute all cases in every way and judge all statements, in their order.
   subroutine judge_statements(ways, duration, list, error)
      !> The ways
      type(way_t), intent(in) :: ways(way_count)
      !> Length of the runs, tau
      real(wp), intent(in) :: duration
      !> The statements
      type(statements_t), intent(out) :: list
      !> Set when a run fails
      type(failure_t), allocatable, intent(out) :: error

      type(series_t) :: series(series_count)
      integer :: i

      do i = 1, series_count
         call make_series(i, series(i))
         call compute_series(ways, duration, series(i), error)
         if (allocated(error)) return
      end do
      call judge_frequencies(list, error)
      if (allocated(error)) return
      call judge_models(series(vary_stiffness), series(vary_zeta), 1, list)
      call judge_preload(series(vary_preload), list)
      call judge_restitution(series(vary_restitution), list)
      call judge_position(series(vary_position), list)
      call judge_damping(series(vary_zeta), list)
      call judge_mass(series(vary_mass), list)
      call judge_taper(series(vary_taper), list)
      call judge_components(series, list)
   end subroutine judge_statements

end module statements_study
