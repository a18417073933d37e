!> Statements 7 and 8: the tip mass and the taper.
module mass_and_taper_statements
   use kinds, only: wp
   use paper_cases, only: fine, way_count
   use paper_outcomes, only: definition_count, outcome_t
   use paper_series, only: ends_of, series_t
   use statement_types, only: add_statement, listed, number, percent, statements_t
   implicit none (type, external)
   private
   public :: judge_mass, judge_taper

   integer, parameter :: usual_end = 2

contains

   !> 7: high components with small mass; one degree of freedom with large mass; mu = 0.5; the end hardly depends on mu.
   subroutine judge_mass(mass, list)
      !> mu = 0, 0.1, 0.25, 0.5, 1, 2 of the figure, then 10 and 30
      type(series_t), intent(in) :: mass
      !> Gets the statements
      type(statements_t), intent(inout) :: list

      integer, parameter :: printed = 6, half = 4, two = 6
      !> An oscillator of one degree of freedom, let go at eta = 1 over a stop at its place of rest, rebounds to eps
      real(wp), parameter :: one_degree = 0.6_wp
      real(wp), dimension(way_count) :: ratio, off, smallest, spread
      real(wp) :: peaks(size(mass%cases)), ends(printed)
      integer :: way, i, agreeing, definition

      do way = 1, way_count
         ratio(way) = mass%outcome(1, way)%high_velocity/max(mass%outcome(two, way)%high_velocity, 1.0e-12_wp)
         peaks = mass%outcome(:, way)%main_peak
         off(way) = abs(peaks(two)/one_degree - 1.0_wp)
         smallest(way) = mass%value(minloc(peaks(:printed), dim=1))
         spread(way) = spread_of(mass%outcome(:printed, way), usual_end)
      end do
      agreeing = 0
      do definition = 1, definition_count
         if ((spread_of(mass%outcome(:printed, fine), definition) < 0.2_wp) .eqv. (spread(fine) < 0.2_wp)) agreeing = agreeing + 1
      end do
      peaks = mass%outcome(:, fine)%main_peak
      ends = [(mass%outcome(i, fine)%ends(usual_end), i=1, printed)]
      call add_statement(list, '7a', 'With a small tip mass high components are strong.', &
         'part of the modes above the second in the velocity of the stop point, mu = 0 over mu = 2, over 2', &
         min(ratio, 1.0e6_wp), ratio > 2.0_wp, 'parts at mu = 0 ... 2, 10, 30: '// &
         listed([(mass%outcome(i, fine)%high_velocity, i=1, size(peaks))], 4), '')
      call add_statement(list, '7b', &
         'With a large tip mass the beam comes close to an impact oscillator of one degree of freedom.', &
         'main peak at mu = 2 against the eps of that oscillator, within 0.1', off, off < 0.1_wp, &
         'main peaks at mu = 0 ... 2, 10, 30: '//listed(peaks, 3), &
         'it does tend to it, but at mu = 2 the beam''s own mass still takes energy away in its higher modes')
      call add_statement(list, '7c', 'mu = 0.5 gives small displacements after the impact.', &
         'mu with the lowest main peak, 0.5', smallest, abs(smallest - 0.5_wp) < 1.0e-6_wp .or. half_is_low(mass), &
         'main peaks at mu = 0, 0.1, 0.25, 0.5, 1, 2: '//listed(peaks(:printed), 3)//'; at 0.5 '// &
         percent(peaks(half)/maxval(peaks(:printed)))//' of the highest', '')
      call add_statement(list, '7d', 'The end hardly depends on mu.', &
         'spread of the ends over mu = 0 ... 2, under 0.2', spread, spread < 0.2_wp, 'ends at tau = '//listed(ends, 1), &
         'a heavier tip swings more slowly, and damping that grows with the frequency takes less from it', agreeing)

   end subroutine judge_mass

   !> Is the main peak at mu = 0.5 within a tenth of the lowest one's height above it?
   pure function half_is_low(mass) result(low)
      !> The series of `judge_mass`
      type(series_t), intent(in) :: mass
      logical :: low(way_count)

      real(wp) :: peaks(size(mass%cases))
      integer :: way

      do way = 1, way_count
         peaks = mass%outcome(:, way)%main_peak
         low(way) = peaks(4) <= 1.1_wp*minval(peaks(:6))
      end do
   end function half_is_low

   !> How far the ends of some cases lie apart, over the soonest.
   pure function spread_of(outcome, definition) result(spread)
      !> The cases
      type(outcome_t), intent(in) :: outcome(:)
      !> Definition of the end
      integer, intent(in) :: definition
      real(wp) :: spread

      real(wp) :: ends(size(outcome))
      integer :: i

      ends = [(outcome(i)%ends(definition), i=1, size(outcome))]
      spread = min(maxval(ends)/minval(ends) - 1.0_wp, 1.0e6_wp)
   end function spread_of

   !> 8: little or much taper lasts longer, 0.075 ends soonest, and why.
   subroutine judge_taper(taper, list)
      !> alpha = 0, 0.025 ... 0.15
      type(series_t), intent(in) :: taper
      !> Gets the statements
      type(statements_t), intent(inout) :: list

      integer, parameter :: none = 1, middle = 4, wedge = 7
      real(wp), dimension(way_count) :: longer, soonest, lower, less, more
      real(wp) :: ends(size(taper%cases))
      integer :: way, i, agreeing, agreeing_longer, definition

      do way = 1, way_count
         ends = ends_of(taper, way, usual_end)
         longer(way) = min(ends(none), ends(wedge))/ends(middle) - 1.0_wp
         soonest(way) = taper%value(minloc(ends, dim=1))
         lower(way) = taper%outcome(none, way)%main_peak - taper%outcome(wedge, way)%main_peak
         less(way) = taper%outcome(wedge, way)%kinetic_at_first/max(taper%outcome(none, way)%kinetic_at_first, 1.0e-12_wp)
         more(way) = taper%outcome(wedge, way)%lost_at_first/max(taper%outcome(none, way)%lost_at_first, 1.0e-12_wp)
      end do
      agreeing = 0
      agreeing_longer = 0
      do definition = 1, definition_count
         ends = ends_of(taper, fine, definition)
         if ((min(ends(none), ends(wedge))/ends(middle) > 1.05_wp) .eqv. (longer(fine) > 0.05_wp)) &
            agreeing_longer = agreeing_longer + 1
         if ((abs(taper%value(minloc(ends, dim=1)) - 0.075_wp) < 1.0e-6_wp) .eqv. (abs(soonest(fine) - 0.075_wp) < 1.0e-6_wp)) &
            agreeing = agreeing + 1
      end do
      ends = ends_of(taper, fine, usual_end)
      call add_statement(list, '8a', 'With very little or much taper the vibration lasts longer.', &
         'how much longer alpha = 0 and 0.15 last than 0.075, the lesser, over 0.05', longer, longer > 0.05_wp, &
         'ends at tau = '//listed(ends, 1)//' at alpha = 0, 0.025 ... 0.15', '', agreeing_longer)
      call add_statement(list, '8b', 'alpha = 0.075 ends soonest.', 'alpha that ends soonest', soonest, &
         abs(soonest - 0.075_wp) < 1.0e-6_wp, 'ends at tau = '//listed(ends, 1)//' at alpha = 0, 0.025 ... 0.15', '', agreeing)
      call add_statement(list, '8c', 'With little taper the mass near the tip keeps the displacement small.', &
         'main peak of the wedge less that of the uniform beam, over 0', -lower, -lower > 0.0_wp, &
         'main peaks: '//listed([(taper%outcome(i, fine)%main_peak, i=1, size(ends))], 3), &
         'up to alpha = 0.05 and again from there to 0.125 it is so, but the full wedge rebounds least of all')
      call add_statement(list, '8d', 'With much taper little kinetic energy takes part.', &
         'kinetic energy at the first impact, of the energy to lose, wedge over uniform beam, under 0.9', less, less < 0.9_wp, &
         'shares '//listed([(taper%outcome(i, fine)%kinetic_at_first, i=1, size(ends))], 3)// &
         '; mass that takes part in an impact, of the beam: '// &
         listed([(1.0_wp/taper%outcome(i, fine)%mobility, i=1, size(ends))], 5), '')
      call add_statement(list, '8e', 'With much taper more energy is lost at impacts.', &
         'energy lost at impacts until the main rebound, wedge over uniform beam, over 1', more, more > 1.0_wp, &
         'shares until the main rebound: '//listed([(taper%outcome(i, fine)%lost_at_first, i=1, size(ends))], 4)// &
         '; in all: '//listed([(taper%outcome(i, fine)%lost_at_impacts, i=1, size(ends))], 4), &
         'the mass that takes part in an impact shrinks with the taper, and with it what an impact can take')
   end subroutine judge_taper

end module mass_and_taper_statements
