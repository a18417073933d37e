!> Judges statements 5 and 6 of the paper (Irie, Yamada and Asano 1977): position of the stop, and damping.
module position_and_damping_statements
   use kinds, only: wp
   use paper_cases, only: coarse_nodal, fine, variant_count
   use paper_outcomes, only: definition_count, energy_end, displacement_end
   use paper_series, only: end_tau_of, find_earliest_end, series_t, may_end_earliest
   use statement_types, only: add_end_statement, listed, rank_correlation, statement_t
   implicit none (type, external)
   private
   public :: judge_position, judge_damping

contains

   !> Judge statement 5: contact at a node of a mode does not excite this mode, and the motion ends earliest with the
   !> stop at 0.875 L.
   subroutine judge_position(position, list)
      !> Cases with stop positions Lc/L = 0.5, 0.7, 0.75, 0.87, 0.875, 1
      type(series_t), intent(in) :: position
      type(statement_t), allocatable, intent(inout) :: list(:)

      ! index of the case Lc/L = 0.50
      integer, parameter :: at_050 = 1
      ! index of the case Lc/L = 0.70
      integer, parameter :: at_070 = 2
      ! index of the case Lc/L = 0.87
      integer, parameter :: at_087 = 4
      ! index of the case Lc/L = 0.875
      integer, parameter :: at_0875 = 5
      ! fraction of the energy below which a mode counts as not excited
      real(wp), parameter :: absent_fraction = 1.0e-3_wp
      ! energy share of mode 3
      real(wp) :: third_mode(variant_count)
      ! energy share of mode 2
      real(wp) :: second_mode(variant_count)
      ! position whose motion ends earliest
      real(wp) :: earliest(variant_count)
      real(wp) :: end_tau(size(position%cases))
      ! whether the motion with the stop at 0.875 ends earliest
      logical :: first(definition_count, variant_count)
      ! whether its end is tied with the earliest of others within the error
      logical :: tied(definition_count, variant_count)

      third_mode = max(position%outcome(at_050, :)%energy_fraction(3), position%outcome(at_087, :)%energy_fraction(3))
      second_mode = position%outcome(at_070, :)%energy_fraction(2)
      earliest = position%value(minloc(position%outcome%end_tau(displacement_end), dim=1))
      call find_earliest_end(position, at_0875, first, tied)
      end_tau = end_tau_of(position, fine, displacement_end)
      list = [list, statement_t('5a', 'Contact at a node of mode 3 (0.50, 0.87) leaves out its component.', &
         'share of the energy in mode 3 early in the main rebound, the greater of the two; required: under 0.001', &
         third_mode, third_mode < absent_fraction, 'share of mode 3 at Lc/L = 0.5, 0.7, 0.75, 0.87, 0.875, 1: '// &
         listed(position%outcome(:, fine)%energy_fraction(3), 5), &
         'nodes of mode 3 lie at 0.504 and 0.868')]
      list = [list, statement_t('5b', 'Contact at a node of mode 2 (0.70) leaves out its component.', &
         'share of the energy in mode 2 early in the main rebound at Lc/L = 0.7; required: under 0.001', &
         second_mode, second_mode < absent_fraction, 'share of mode 2 at Lc/L = 0.5, 0.7, 0.75, 0.87, 0.875, 1: '// &
         listed(position%outcome(:, fine)%energy_fraction(2), 5), &
         'the node of mode 2 lies at 0.783, not at 0.70')]
      call add_end_statement(list, statement_t('5c', 'Contact at 0.875 ends soonest.', &
         'Lc/L that ends soonest; required: 0.875', earliest, detail='ends at tau = '//listed(end_tau, 1)// &
         " at Lc/L = 0.5, 0.7, 0.75, 0.87, 0.875, 1; paper's mesh, nodal reading: "// &
         listed(end_tau_of(position, coarse_nodal, displacement_end), 2)//'; energy down to 1 %: '// &
         listed(end_tau_of(position, fine, energy_end), 1), &
         reason='from 0.75 to 1 the ends lie near each other and their order changes with the definition; by energy ' &
         //'it is the tip', &
         remark="on the paper's mesh by the nodal reading a tie of "// &
         listed(pack(position%value, may_end_earliest(position, coarse_nodal, displacement_end)), 3)), first, tied)
   end subroutine judge_position

   !> Judge statement 6: contributions of high modes are large with small damping, the motion ends earlier with larger
   !> damping, and the time in contact is a third of the time out of contact.
   subroutine judge_damping(zeta, list)
      !> Cases with zeta = 0.001, 0.01, 0.05, 0.1
      type(series_t), intent(in) :: zeta
      type(statement_t), allocatable, intent(inout) :: list(:)

      ! index of the case zeta = 0.001
      integer, parameter :: lowest = 1
      ! index of the case zeta = 0.01
      integer, parameter :: one_percent = 2
      ! index of the case zeta = 0.05
      integer, parameter :: five_percent = 3
      real(wp), parameter :: third = 1.0_wp/3.0_wp, quarter = 0.25_wp
      ! ratio of the contributions of high modes; 1e-12 and 1e6 keep quotients finite
      real(wp) :: ratio(variant_count)
      ! rank correlation of the ends of motion with zeta
      real(wp) :: end_correlation(variant_count)
      ! time in contact over time out of contact, mean of zeta = 0.01 and 0.05
      real(wp) :: mean_ratio(variant_count)
      ! maximum deviation of these two ratios of times from 1/3
      real(wp) :: max_deviation(variant_count)
      ! whether the end of motion is earlier with larger zeta
      logical :: decreases(definition_count, variant_count)
      integer :: variant, definition

      ratio = zeta%outcome(lowest, :)%high_mode_velocity &
         /max(zeta%outcome(five_percent, :)%high_mode_velocity, 1.0e-12_wp)
      associate (small => zeta%outcome(one_percent, :)%contact_ratio, &
         large => zeta%outcome(five_percent, :)%contact_ratio)
         mean_ratio = 0.5_wp*(small + large)
         max_deviation = max(abs(small - third), abs(large - third))
      end associate
      do variant = 1, variant_count
         end_correlation(variant) = rank_correlation(end_tau_of(zeta, variant, displacement_end))
         do definition = 1, definition_count
            decreases(definition, variant) = rank_correlation(end_tau_of(zeta, variant, definition)) < -0.6_wp
         end do
      end do
      list = [list, statement_t('6a', 'With small damping high components are strong.', &
         'part of the modes above the second in the velocity of the stop point: ' &
         //'ratio of that at zeta = 0.001 to that at 0.05; required: above 2', &
         min(ratio, 1.0e6_wp), ratio > 2.0_wp, 'parts at zeta = 0.001, 0.01, 0.05, 0.1: '// &
         listed(zeta%outcome(:, fine)%high_mode_velocity, 4))]
      call add_end_statement(list, statement_t('6b', 'The larger the damping, the sooner the vibration ends.', &
         'rank correlation (Kendall) of the ends with zeta; required: under -0.6', end_correlation, &
         detail='ends at tau = '//listed(end_tau_of(zeta, fine, displacement_end), 1)//'; energy down to 1 %: '// &
         listed(end_tau_of(zeta, fine, energy_end), 1)), decreases)
      list = [list, statement_t('6c', &
         'With ordinary damping (0.01 to 0.05) the beam stays on the stop for about 1/3 of the time away.', &
         'time on the stop over time away at zeta = 0.01 and 0.05, mean; required: both nearer 1/3 than 1/4', &
         mean_ratio, max_deviation < 0.5_wp*(third - quarter), &
         'ratio at zeta = 0.001, 0.01, 0.05, 0.1: '// &
         listed(zeta%outcome(:, fine)%contact_ratio, 3), &
         'it is about 1/4: half a period of the first mode of the beam held at its tip (lambda = 3.927) over half '// &
         'a period of the free one is 0.228')]
   end subroutine judge_damping

end module position_and_damping_statements
