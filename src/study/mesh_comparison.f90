!> Comparison of the motions on two meshes (docs/theory.md, section 15).
module mesh_comparison
   use history_list, only: eta_stop, eta_tip
   use kinds, only: wp
   use mesh_checks, only: mesh_check_t
   use response_types, only: response_t, run_measures_t
   use run_differences, only: count_hops, horizon_of, max_difference
   implicit none (type, external)
   private
   public :: compare_meshes

contains

   !> The maximum difference of two runs, up to the earlier of the peaks of their third rebounds, and whether they
   !> agree: in eta of stops, bodies and tip, and in tau of the first impact and of settling. If the check is relative:
   !> in eta over the maximum displacement, and in tau of the first impact over this instant. Motions that agree have
   !> the same number of flights that rise above the tolerance, because two motions can differ little at the samples by
   !> chance.
   pure subroutine compare_meshes(coarse, fine, duration, fraction, check)
      !> The runs, with the same samples
      type(response_t), intent(in) :: coarse
      type(response_t), intent(in) :: fine
      !> Duration of both runs, tau
      real(wp), intent(in) :: duration
      !> The meshes agree if the difference is at most this fraction of the tolerance
      real(wp), intent(in) :: fraction
      !> Check of the coarse mesh with its tolerance; difference, horizon (end of the comparison), and whether the
      !> meshes agree are set
      type(mesh_check_t), intent(inout) :: check

      ! difference of the first impacts; height of the flights that are counted; maximum eta of stop and tip
      real(wp) :: first_impact, height, max_displacement
      integer :: last

      check%horizon = min(horizon_of(coarse, duration), horizon_of(fine, duration))
      last = count(fine%tau <= check%horizon)
      check%difference = max_difference(coarse, fine, last)
      height = check%tolerance
      first_impact = 0.0_wp
      associate (one => coarse%measures, other => fine%measures)
         if (one%has_hit_stop .and. other%has_hit_stop) then
            first_impact = abs(one%first_impact_tau - other%first_impact_tau)
         end if
         if (check%is_relative) then
            max_displacement = max(maxval(abs(fine%history(eta_stop)%values(:last))), &
               maxval(abs(fine%history(eta_tip)%values(:last))))
            check%difference = max(check%difference/max(max_displacement, tiny(1.0_wp)), &
               first_impact/max(1.0_wp, other%first_impact_tau))
            height = height*max_displacement
         else
            check%difference = max(check%difference, first_impact, &
               abs(settling_or_horizon(one, check%horizon) - settling_or_horizon(other, check%horizon)))
         end if
      end associate
      check%is_converged = check%difference <= fraction*check%tolerance
      if (.not. check%is_converged) return
      check%is_converged = count_hops(coarse, check%horizon, height) == count_hops(fine, check%horizon, height)
   end subroutine compare_meshes

   !> The settling time, or the horizon of the comparison if it is earlier.
   pure real(wp) function settling_or_horizon(measures, horizon) result(tau)
      type(run_measures_t), intent(in) :: measures
      real(wp), intent(in) :: horizon

      tau = horizon
      if (measures%has_settled) tau = min(measures%settling_tau, horizon)
   end function settling_or_horizon

end module mesh_comparison
