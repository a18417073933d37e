!> Judges statements 7 and 8 of the paper (Irie, Yamada and Asano 1977): the tip mass and the taper. The main peak is
!> the peak of the main rebound, the highest rebound within a period of the first mode after the first impact. Values of
!> a list for all variants (methods and meshes) have the dimension [variants].
module mass_and_taper_statements
   use kinds, only: wp
   use paper_cases, only: coarse_nodal, fine, variant_count
   use paper_outcomes, only: definition_count, energy_end, outcome_t, displacement_end
   use paper_series, only: end_tau_of, find_earliest_end, series_t, may_end_earliest
   use statement_types, only: add_statement, add_end_statement, listed, mark_ties, number, percent, &
      statements_t
   implicit none (type, external)
   private
   public :: judge_mass, judge_taper

contains

   !> Judge statement 7: a small tip mass excites high modes, a large tip mass makes the beam an oscillator of one
   !> degree of freedom, mu = 0.5 gives small displacements, and the end of motion depends little on mu.
   subroutine judge_mass(mass, list)
      !> Cases with mu = 0, 0.1, 0.25, 0.5, 1, 2 of the paper's figure, and mu = 10 and 30
      type(series_t), intent(in) :: mass
      type(statements_t), intent(inout) :: list

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
      ! the same in periods of the lowest frequency over 2 pi
      real(wp) :: scaled_ends(printed_count)
      ! whether the ends of motion differ by less than a fifth
      logical :: similar(definition_count, variant_count)
      ! whether the main peak at mu = 0.5 exceeds the lowest main peak by at most a tenth
      logical :: half_is_low(variant_count)
      integer :: variant, i, definition, limit_case

      do variant = 1, variant_count
         ratio(variant) = mass%outcome(1, variant)%high_mode_velocity &
            /max(mass%outcome(mu_two, variant)%high_mode_velocity, 1.0e-12_wp)
         peaks = mass%outcome(:, variant)%main_peak
         deviation(variant) = abs(peaks(mu_two)/one_dof_peak - 1.0_wp)
         best_mass(variant) = mass%value(minloc(peaks(:printed_count), dim=1))
         half_is_low(variant) = peaks(mu_half) <= 1.1_wp*minval(peaks(:printed_count))
         end_spread(variant) = spread_of(mass%outcome(:printed_count, variant), displacement_end)
         do definition = 1, definition_count
            similar(definition, variant) = spread_of(mass%outcome(:printed_count, variant), definition) < 0.2_wp
         end do
      end do
      peaks = mass%outcome(:, fine)%main_peak
      ! first case from which on the main peak is within 10 percent of the oscillator's; mu = 10 and 30, beyond the
      ! paper's figure, serve to find this case
      limit_case = 1 + findloc(abs(peaks/one_dof_peak - 1.0_wp) < 0.1_wp, .false., dim=1, back=.true.)
      limit_case = min(limit_case, size(peaks))
      end_tau = [(mass%outcome(i, fine)%end_tau(displacement_end), i=1, printed_count)]
      call add_statement(list, '7a', 'With a small tip mass high components are strong.', &
         'part of the modes above the second in the velocity of the stop point, mu = 0 over mu = 2; required: over 2', &
         min(ratio, 1.0e6_wp), ratio > 2.0_wp, 'parts at mu = 0 ... 2, 10, 30: '// &
         listed([(mass%outcome(i, fine)%high_mode_velocity, i=1, size(peaks))], 4), '')
      call add_statement(list, '7b', &
         'With a large tip mass the beam comes close to an impact oscillator of one degree of freedom.', &
         'main peak at mu = 2 against the eps of that oscillator; required: within 0.1', deviation, &
         deviation < 0.1_wp, &
         'main peaks at mu = 0 ... 2, 10, 30: '//listed(peaks, 3), &
         "at mu = 2 the beam's own mass still takes energy away in its higher modes", &
         'at mu = 2; from mu = '//number(mass%value(limit_case), 0)//' on it does')
      call add_statement(list, '7c', 'mu = 0.5 gives small displacements after the impact.', &
         'mu with the lowest main peak; required: 0.5, or there at most a tenth above the lowest', best_mass, &
         abs(best_mass - 0.5_wp) < 1.0e-6_wp .or. half_is_low, &
         'main peaks at mu = 0, 0.1, 0.25, 0.5, 1, 2: '//listed(peaks(:printed_count), 3)//'; at 0.5 '// &
         percent(peaks(mu_half)/maxval(peaks(:printed_count)))//' of the highest', '')
      scaled_ends = [(end_tau(i)*mass%outcome(i, fine)%lowest_frequency, i=1, printed_count)]
      call add_end_statement(list, '7d', 'The end hardly depends on mu.', &
         'spread of the ends over mu = 0 ... 2; required: under 0.2', end_spread, similar, &
         'ends at tau = '//listed(end_tau, 1)//'; energy down to 1 %: '// &
         listed([(mass%outcome(i, fine)%end_tau(energy_end), i=1, printed_count)], 1)// &
         '; times the lowest frequency of the beam with its mass: '//listed(scaled_ends, 1), &
         'a heavier tip swings more slowly; counted in its own swings the end does depend little on mu, but for 0.25')
   end subroutine judge_mass

   !> Spread of the ends of motion of some cases, relative to the earliest end.
   pure function spread_of(outcome, definition) result(relative_spread)
      type(outcome_t), intent(in) :: outcome(:)
      !> Number of the definition of the end of motion
      integer, intent(in) :: definition
      real(wp) :: relative_spread

      real(wp) :: end_tau(size(outcome))
      integer :: i

      end_tau = [(outcome(i)%end_tau(definition), i=1, size(outcome))]
      ! the limit replaces the huge value of an end that lies beyond the run (`never`)
      relative_spread = min(maxval(end_tau)/minval(end_tau) - 1.0_wp, 1.0e6_wp)
   end function spread_of

   !> Judge statement 8: with little or much taper the motion lasts longer, with alpha = 0.075 the motion ends earliest,
   !> and the reasons.
   subroutine judge_taper(taper, list)
      !> Cases with alpha = 0, 0.025 ... 0.15
      type(series_t), intent(in) :: taper
      type(statements_t), intent(inout) :: list

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
      integer :: variant, i, definition
      ! number of definitions by which 0.075 ends earliest of the tapered beams
      integer :: agreeing

      do variant = 1, variant_count
         end_tau = end_tau_of(taper, variant, displacement_end)
         excess(variant) = min(end_tau(uniform), end_tau(wedge))/end_tau(middle) - 1.0_wp
         earliest(variant) = taper%value(minloc(end_tau, dim=1))
         peak_change(variant) = taper%outcome(strong, variant)%main_peak - taper%outcome(uniform, variant)%main_peak
         kinetic_ratio(variant) = taper%outcome(wedge, variant)%kinetic_at_impact &
            /max(taper%outcome(uniform, variant)%kinetic_at_impact, 1.0e-12_wp)
         loss_ratio(variant) = taper%outcome(wedge, variant)%lost_before_peak &
            /max(taper%outcome(uniform, variant)%lost_before_peak, 1.0e-12_wp)
      end do
      do variant = 1, variant_count
         do definition = 1, definition_count
            end_tau = end_tau_of(taper, variant, definition)
            outlasts(definition, variant) = min(end_tau(uniform), end_tau(wedge)) > 1.05_wp*end_tau(middle)
         end do
      end do
      call find_earliest_end(taper, middle, first, tied)
      end_tau = end_tau_of(taper, fine, displacement_end)
      agreeing = count([(minloc(taper%outcome(2:, fine)%end_tau(definition), dim=1) + 1 == middle, definition=1, &
         definition_count)])
      call add_end_statement(list, '8a', 'With very little or much taper the vibration lasts longer.', &
         'how much longer alpha = 0 and 0.15 last than 0.075, the lesser; required: over 0.05', excess, outlasts, &
         'ends at tau = '//listed(end_tau, 1)//' at alpha = 0, 0.025 ... 0.15; energy down to 1 %: '// &
         listed(end_tau_of(taper, fine, energy_end), 1)//"; paper's mesh, nodal reading: "// &
         listed(end_tau_of(taper, coarse_nodal, displacement_end), 1), &
         'without taper it ends about as soon as with 0.075, in between later; much taper does last longer')
      call add_end_statement(list, '8b', 'alpha = 0.075 ends soonest.', 'alpha that ends soonest; required: 0.075', &
         earliest, first, &
         'ends as in 8a; on the fine mesh the soonest may be '// &
         listed(pack(taper%value, may_end_earliest(taper, fine, displacement_end)), 3), &
         'among the tapered beams alone it is the soonest by '//number(real(agreeing, wp), 0)//' of '// &
         number(real(definition_count, wp), 0)//' definitions; the uniform beam ends about as soon')
      call mark_ties(list, tied)
      call add_statement(list, '8c', 'With little taper the mass near the tip keeps the displacement small.', &
         'main peak at alpha = 0.125 less that of the uniform beam; required: over 0', peak_change, &
         peak_change > 0.0_wp, &
         'main peaks: '//listed([(taper%outcome(i, fine)%main_peak, i=1, size(end_tau))], 3)// &
         ' at alpha = 0, 0.025 ... 0.15', 'the minimum displacement is that at alpha = 0.05')
      call add_statement(list, '8d', 'With much taper little kinetic energy takes part.', &
         'kinetic energy at the first impact, of the energy to lose, wedge over uniform beam; required: under 0.9', &
         kinetic_ratio, kinetic_ratio < 0.9_wp, &
         'shares '//listed([(taper%outcome(i, fine)%kinetic_at_impact, i=1, size(end_tau))], 3)// &
         '; mass that takes part in an impact, of the beam: '// &
         listed([(1.0_wp/taper%outcome(i, fine)%inverse_mass, i=1, size(end_tau))], 5), '')
      call add_statement(list, '8e', 'With much taper more energy is lost at impacts.', &
         'energy lost at impacts until the main rebound, wedge over uniform beam; required: over 1', &
         loss_ratio, loss_ratio > 1.0_wp, &
         'shares until the main rebound: '// &
         listed([(taper%outcome(i, fine)%lost_before_peak, i=1, size(end_tau))], 4)// &
         '; in all: '//listed([(taper%outcome(i, fine)%lost_at_impacts, i=1, size(end_tau))], 4)// &
         "; paper's mesh, nodal reading, in all: "// &
         listed([(taper%outcome(i, coarse_nodal)%lost_at_impacts, i=1, size(end_tau))], 2)//', created: '// &
         listed([(taper%outcome(i, coarse_nodal)%created, i=1, size(end_tau))], 2), &
         'the mass that takes part in an impact shrinks with the taper, and with it what an impact can take; the '// &
         'nodal reading takes more as the taper grows, but of the strongest tapers it creates as well')
   end subroutine judge_taper

end module mass_and_taper_statements
