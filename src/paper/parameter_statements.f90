!> Judges statements 5 to 8 of the paper (Irie, Yamada and Asano 1977): position of the stop, damping, tip mass and
!> taper. The main peak is the peak of the main rebound, the highest rebound within a period of the first mode after the
!> first impact. Values of a list for all variants (methods and meshes) have the dimension [variants].
module parameter_statements
   use kinds, only: wp
   use paper_cases, only: coarse_nodal, fine, variant_count, definition_count, energy_end, displacement_end
   use paper_series, only: end_tau_of, find_earliest_end, series_t, may_end_earliest
   use statement_types, only: add_end_statement, listed, number, percent, rank_correlation, statement_t
   implicit none (type, external)
   private
   public :: judge_position, judge_damping, judge_mass, judge_taper

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

   !> Judge statement 7: a small tip mass excites high modes, a large tip mass makes the beam an oscillator of one
   !> degree of freedom, mu = 0.5 gives small displacements, and the end of motion depends little on mu.
   subroutine judge_mass(mass, list)
      !> Cases with mu = 0, 0.1, 0.25, 0.5, 1, 2 of the paper's figure, and mu = 10 and 30
      type(series_t), intent(in) :: mass
      type(statement_t), allocatable, intent(inout) :: list(:)

      ! number of cases in the paper's figure
      integer, parameter :: printed_count = 6
      ! index of the case mu = 0.5
      integer, parameter :: mu_half = 4
      ! index of the case mu = 2
      integer, parameter :: mu_two = 6
      ! rebound height of an oscillator of one degree of freedom that is released at eta = 1 above a stop at its
      ! equilibrium: the coefficient of restitution eps
      real(wp), parameter :: one_dof_peak = 0.6_wp
      ! values that decide statements 7a to 7d; 1e-12 and 1e6 keep quotients finite
      real(wp), dimension(variant_count) :: ratio, deviation, best_mass, end_spread
      ! main peaks
      real(wp) :: peaks(size(mass%cases))
      ! ends of motion on the fine mesh, tau
      real(wp) :: end_tau(printed_count)
      ! whether the ends of motion differ by less than a fifth
      logical :: similar(definition_count, variant_count)
      ! whether the main peak at mu = 0.5 exceeds the lowest main peak by at most a tenth
      logical :: half_is_low(variant_count)
      integer :: definition, limit_case

      ratio = mass%outcome(1, :)%high_mode_velocity/max(mass%outcome(mu_two, :)%high_mode_velocity, 1.0e-12_wp)
      deviation = abs(mass%outcome(mu_two, :)%main_peak/one_dof_peak - 1.0_wp)
      best_mass = mass%value(minloc(mass%outcome(:printed_count, :)%main_peak, dim=1))
      half_is_low = mass%outcome(mu_half, :)%main_peak &
         <= 1.1_wp*minval(mass%outcome(:printed_count, :)%main_peak, dim=1)
      end_spread = spread_of(displacement_end)
      do definition = 1, definition_count
         similar(definition, :) = spread_of(definition) < 0.2_wp
      end do
      peaks = mass%outcome(:, fine)%main_peak
      ! first case from which on the main peak is within 10 percent of the oscillator's; mu = 10 and 30, beyond the
      ! paper's figure, serve to find this case
      limit_case = 1 + findloc(abs(peaks/one_dof_peak - 1.0_wp) < 0.1_wp, .false., dim=1, back=.true.)
      limit_case = min(limit_case, size(peaks))
      end_tau = mass%outcome(:printed_count, fine)%end_tau(displacement_end)
      list = [list, statement_t('7a', 'With a small tip mass high components are strong.', &
         'part of the modes above the second in the velocity of the stop point, mu = 0 over mu = 2; required: over 2', &
         min(ratio, 1.0e6_wp), ratio > 2.0_wp, 'parts at mu = 0 ... 2, 10, 30: '// &
         listed(mass%outcome(:, fine)%high_mode_velocity, 4))]
      list = [list, statement_t('7b', &
         'With a large tip mass the beam comes close to an impact oscillator of one degree of freedom.', &
         'main peak at mu = 2 against the eps of that oscillator; required: within 0.1', deviation, &
         deviation < 0.1_wp, &
         'main peaks at mu = 0 ... 2, 10, 30: '//listed(peaks, 3), &
         "at mu = 2 the beam's own mass still takes energy away in its higher modes", &
         'at mu = 2; from mu = '//number(mass%value(limit_case), 0)//' on it does')]
      list = [list, statement_t('7c', 'mu = 0.5 gives small displacements after the impact.', &
         'mu with the lowest main peak; required: 0.5, or there at most a tenth above the lowest', best_mass, &
         abs(best_mass - 0.5_wp) < 1.0e-6_wp .or. half_is_low, &
         'main peaks at mu = 0, 0.1, 0.25, 0.5, 1, 2: '//listed(peaks(:printed_count), 3)//'; at 0.5 '// &
         percent(peaks(mu_half)/maxval(peaks(:printed_count)))//' of the highest')]
      call add_end_statement(list, statement_t('7d', 'The end hardly depends on mu.', &
         'spread of the ends over mu = 0 ... 2; required: under 0.2', end_spread, &
         detail='ends at tau = '//listed(end_tau, 1)//'; energy down to 1 %: '// &
         listed(mass%outcome(:printed_count, fine)%end_tau(energy_end), 1)// &
         '; times the lowest frequency of the beam with its mass: '// &
         listed(end_tau*mass%outcome(:printed_count, fine)%lowest_frequency, 1), &
         reason='a heavier tip swings more slowly; counted in its own swings the end does depend little on mu, but ' &
         //'for 0.25'), similar)

   contains

      !> Spread of the ends of motion over the cases of the paper's figure, relative to the earliest end, [variants].
      pure function spread_of(definition_number) result(relative_spread)
         !> Number of the definition of the end of motion
         integer, intent(in) :: definition_number
         real(wp) :: relative_spread(variant_count)

         associate (ends => mass%outcome(:printed_count, :)%end_tau(definition_number))
            ! the limit replaces the huge value of an end that lies beyond the run (`never`)
            relative_spread = min(maxval(ends, dim=1)/minval(ends, dim=1) - 1.0_wp, 1.0e6_wp)
         end associate
      end function spread_of
   end subroutine judge_mass

   !> Judge statement 8: with little or much taper the motion lasts longer, with alpha = 0.075 the motion ends earliest,
   !> and the reasons.
   subroutine judge_taper(taper, list)
      !> Cases with alpha = 0, 0.025 ... 0.15
      type(series_t), intent(in) :: taper
      type(statement_t), allocatable, intent(inout) :: list(:)

      ! index of the case alpha = 0
      integer, parameter :: uniform = 1
      ! index of the case alpha = 0.075
      integer, parameter :: middle = 4
      ! index of the case alpha = 0.125
      integer, parameter :: strong = 6
      ! index of the case alpha = 0.15
      integer, parameter :: wedge = 7
      ! values that decide statements 8a to 8e; earliest: the taper alpha whose motion ends earliest
      real(wp), dimension(variant_count) :: excess, earliest, peak_change, kinetic_ratio, loss_ratio
      real(wp) :: end_tau(size(taper%cases))
      ! whether the motions with alpha = 0 and 0.15 last longer than that with 0.075
      logical :: outlasts(definition_count, variant_count)
      ! whether the motion with 0.075 ends earliest (`first`), or is `tied` with the earliest of others within the error
      logical, dimension(definition_count, variant_count) :: first, tied
      integer :: definition
      ! number of definitions by which 0.075 ends earliest of the tapered beams
      integer :: agreeing

      associate (ends => taper%outcome%end_tau(displacement_end))
         excess = min(ends(uniform, :), ends(wedge, :))/ends(middle, :) - 1.0_wp
         earliest = taper%value(minloc(ends, dim=1))
      end associate
      peak_change = taper%outcome(strong, :)%main_peak - taper%outcome(uniform, :)%main_peak
      kinetic_ratio = taper%outcome(wedge, :)%kinetic_at_impact &
         /max(taper%outcome(uniform, :)%kinetic_at_impact, 1.0e-12_wp)
      loss_ratio = taper%outcome(wedge, :)%lost_before_peak/max(taper%outcome(uniform, :)%lost_before_peak, 1.0e-12_wp)
      do definition = 1, definition_count
         associate (ends => taper%outcome%end_tau(definition))
            outlasts(definition, :) = min(ends(uniform, :), ends(wedge, :)) > 1.05_wp*ends(middle, :)
         end associate
      end do
      call find_earliest_end(taper, middle, first, tied)
      end_tau = end_tau_of(taper, fine, displacement_end)
      agreeing = count([(minloc(taper%outcome(2:, fine)%end_tau(definition), dim=1) + 1 == middle, definition=1, &
         definition_count)])
      call add_end_statement(list, statement_t('8a', 'With very little or much taper the vibration lasts longer.', &
         'how much longer alpha = 0 and 0.15 last than 0.075, the lesser; required: over 0.05', excess, &
         detail='ends at tau = '//listed(end_tau, 1)//' at alpha = 0, 0.025 ... 0.15; energy down to 1 %: '// &
         listed(end_tau_of(taper, fine, energy_end), 1)//"; paper's mesh, nodal reading: "// &
         listed(end_tau_of(taper, coarse_nodal, displacement_end), 1), &
         reason='without taper it ends about as soon as with 0.075, in between later; much taper does last longer'), &
         outlasts)
      call add_end_statement(list, statement_t('8b', 'alpha = 0.075 ends soonest.', &
         'alpha that ends soonest; required: 0.075', earliest, &
         detail='ends as in 8a; on the fine mesh the soonest may be '// &
         listed(pack(taper%value, may_end_earliest(taper, fine, displacement_end)), 3), &
         reason='among the tapered beams alone it is the soonest by '//number(real(agreeing, wp), 0)//' of '// &
         number(real(definition_count, wp), 0)//' definitions; the uniform beam ends about as soon'), first, tied)
      list = [list, statement_t('8c', 'With little taper the mass near the tip keeps the displacement small.', &
         'main peak at alpha = 0.125 less that of the uniform beam; required: over 0', peak_change, &
         peak_change > 0.0_wp, &
         'main peaks: '//listed(taper%outcome(:, fine)%main_peak, 3)// &
         ' at alpha = 0, 0.025 ... 0.15', 'the minimum displacement is that at alpha = 0.05')]
      list = [list, statement_t('8d', 'With much taper little kinetic energy takes part.', &
         'kinetic energy at the first impact, of the energy to lose, wedge over uniform beam; required: under 0.9', &
         kinetic_ratio, kinetic_ratio < 0.9_wp, &
         'shares '//listed(taper%outcome(:, fine)%kinetic_at_impact, 3)// &
         '; mass that takes part in an impact, of the beam: '// &
         listed(1.0_wp/taper%outcome(:, fine)%inverse_mass, 5))]
      list = [list, statement_t('8e', 'With much taper more energy is lost at impacts.', &
         'energy lost at impacts until the main rebound, wedge over uniform beam; required: over 1', &
         loss_ratio, loss_ratio > 1.0_wp, &
         'shares until the main rebound: '// &
         listed(taper%outcome(:, fine)%lost_before_peak, 4)// &
         '; in all: '//listed(taper%outcome(:, fine)%lost_at_impacts, 4)// &
         "; paper's mesh, nodal reading, in all: "// &
         listed(taper%outcome(:, coarse_nodal)%lost_at_impacts, 2)//', created: '// &
         listed(taper%outcome(:, coarse_nodal)%created, 2), &
         'the mass that takes part in an impact shrinks with the taper, and with it what an impact can take; the '// &
         'nodal reading takes more as the taper grows, but of the strongest tapers it creates as well')]
   end subroutine judge_taper

end module parameter_statements
