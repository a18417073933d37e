!> Judges statements 2, 3 and 4 of the paper (Irie, Yamada and Asano 1977): the two models of the stop, the preload, the
!> coefficient of restitution. The main peak is the peak of the main rebound, the highest rebound within a period of the
!> first mode after the first impact.
module stop_statements
   use kinds, only: pi, wp
   use paper_cases, only: coarse_nodal, fine, variant_count, definition_count, energy_end, displacement_end
   use paper_series, only: end_tau_of, series_t
   use statement_types, only: add_end_statement, listed, number, rank_correlation, percent, statement_t
   implicit none (type, external)
   private
   public :: judge_models, judge_preload, judge_restitution

contains

   !> Judge statement 2: the two models differ little, the indentation of the stop is very small, impacts are short.
   subroutine judge_models(soft, rigid, rigid_case, list)
      !> Series of three-element stops of ascending kappa
      type(series_t), intent(in) :: soft
      !> A series with the rigid stop
      type(series_t), intent(in) :: rigid
      !> Number of the case to compare
      integer, intent(in) :: rigid_case
      type(statement_t), allocatable, intent(inout) :: list(:)

      real(wp), parameter :: period = 2.0_wp*pi
      ! differences of the main peaks, maximum indentations, and durations of the first contact relative to the period,
      ! on the fine mesh, [kappa]
      real(wp), dimension(size(soft%cases)) :: difference, indentation, contact_fraction
      ! these three results for kappa = 10, the value printed in the paper and the first of the series, [variants]
      real(wp), dimension(variant_count) :: difference_10, indentation_10, fraction_10

      difference = abs(soft%outcome(:, fine)%main_peak - rigid%outcome(rigid_case, fine)%main_peak)
      indentation = soft%outcome(:, fine)%indentation
      contact_fraction = soft%outcome(:, fine)%contact_length/period
      difference_10 = abs(soft%outcome(1, :)%main_peak - rigid%outcome(rigid_case, :)%main_peak)
      indentation_10 = soft%outcome(1, :)%indentation
      fraction_10 = soft%outcome(1, :)%contact_length/period
      list = [list, statement_t('2a', 'The two models of the stop give no marked difference.', &
         'difference of the main peaks at the printed kappa = 10; required: under 0.05', difference_10, &
         difference_10 < 0.05_wp, 'at kappa = 10, 1e2 ... 1e5: '//listed(difference, 4), &
         'the printed kappa has probably lost its exponent', kappa_in_words(difference, 0.05_wp))]
      list = [list, statement_t('2b', 'The stop yields very slightly.', &
         'deepest indentation in eta at the printed kappa = 10; required: under 0.01', indentation_10, &
         indentation_10 < 0.01_wp, 'at kappa = 10, 1e2 ... 1e5: '//listed(indentation, 5), &
         'the printed kappa has probably lost its exponent', kappa_in_words(indentation, 0.01_wp))]
      list = [list, statement_t('2c', 'The time of an impact is short against the period.', &
         'first contact over 2 pi at the printed kappa = 10; required: under 0.05', fraction_10, &
         fraction_10 < 0.05_wp, 'at kappa = 10, 1e2 ... 1e5: '//listed(contact_fraction, 4), &
         'a first contact is a series of impacts and rests that lasts as long as the higher modes press the beam '// &
         'on the stop', kappa_in_words(contact_fraction, 0.05_wp))]

   contains

      !> Qualification of a verdict: the minimum kappa of the series from which on a value stays below its limit.
      function kappa_in_words(values, limit) result(text)
         !> Value for each kappa
         real(wp), intent(in) :: values(:)
         real(wp), intent(in) :: limit
         character(:), allocatable :: text

         integer :: last

         last = findloc(values < limit, .false., dim=1, back=.true.)
         text = 'none of these'
         if (last < size(values)) text = number(soft%value(last + 1), 0)
         text = 'with the printed kappa; from kappa = '//text//' on it does'
      end function kappa_in_words

   end subroutine judge_models

   !> Judge statement 3: the larger the preload, the earlier the end of motion.
   subroutine judge_preload(preload, list)
      !> Cases of ascending preload
      type(series_t), intent(in) :: preload
      type(statement_t), allocatable, intent(inout) :: list(:)

      ! value that decides the judgement of each variant
      real(wp) :: deciding_value(variant_count)
      ! ends of motion on the fine mesh, tau, [cases]
      real(wp) :: end_tau(size(preload%cases))
      ! whether the end of motion is earlier with larger preload
      logical :: sooner(definition_count, variant_count)
      integer :: variant, definition

      deciding_value = end_ratio(displacement_end)
      do definition = 1, definition_count
         sooner(definition, :) = end_ratio(definition) < 0.8_wp .and. &
            [(rank_correlation(end_tau_of(preload, variant, definition)), variant=1, variant_count)] < -0.3_wp
      end do
      end_tau = end_tau_of(preload, fine, displacement_end)
      call add_end_statement(list, statement_t('3', 'The larger the preload, the sooner the vibration ends.', &
         'end at delta = 0.5 over the end at 0; required: under 0.8, and most pairs in order', deciding_value, &
         detail='ends at tau = '//listed(end_tau, 1)//' at delta = 0, 0.1 ... 0.5: order '// &
         number(rank_correlation(end_tau), 2)// &
         ' (-1: each sooner than the one before); energy down to 1 %: '// &
         listed(end_tau_of(preload, fine, energy_end), 1), &
         reason='at delta = 0.2 a nearly periodic bounce delays the end, its rebounds '// &
         listed(preload%outcome(3, fine)%peak_eta, 2), remark='as a trend'), sooner)

   contains

      !> Ratio of the end of motion at the maximum preload to that without preload, [variants].
      pure function end_ratio(definition_number) result(ratio)
         !> Number of the definition of the end
         integer, intent(in) :: definition_number
         real(wp) :: ratio(variant_count)

         associate (ends => preload%outcome%end_tau(definition_number))
            ratio = ends(size(ends, 1), :)/ends(1, :)
         end associate
      end function end_ratio

   end subroutine judge_preload

   !> Judge statement 4: a smaller eps gives a somewhat earlier end of motion, without marked difference above 0.6.
   subroutine judge_restitution(restitution, list)
      !> Cases of ascending eps
      type(series_t), intent(in) :: restitution
      type(statement_t), allocatable, intent(inout) :: list(:)

      ! relative reduction of the end of motion from eps = 0.6 to 0, [variants]
      real(wp) :: reduction(variant_count)
      ! relative spread of the ends of motion from eps = 0.6 on, [variants]
      real(wp) :: spread_above(variant_count)
      ! the same two results by one of the definitions of the end, [variants]
      real(wp), dimension(variant_count) :: reduction_by, spread_by
      ! whether the end of motion is earlier with eps = 0 than with 0.6
      logical :: sooner(definition_count, variant_count)
      ! whether the ends of motion from eps = 0.6 on are similar
      logical :: similar(definition_count, variant_count)
      real(wp) :: end_tau(size(restitution%cases)), peaks(size(restitution%cases))
      integer :: definition
      ! index of the first case with eps of at least 0.6
      integer :: first_high

      first_high = findloc(restitution%value >= 0.6_wp, .true., dim=1)
      call compare_ends(displacement_end, reduction, spread_above)
      do definition = 1, definition_count
         call compare_ends(definition, reduction_by, spread_by)
         sooner(definition, :) = reduction_by > 0.05_wp
         similar(definition, :) = spread_by < 0.1_wp
      end do
      end_tau = end_tau_of(restitution, fine, displacement_end)
      peaks = restitution%outcome(:, fine)%main_peak
      call add_end_statement(list, statement_t('4a', 'The smaller eps, the somewhat sooner the vibration ends.', &
         'by what share eps = 0 ends before eps = 0.6; required: over 0.05', reduction, &
         detail='ends at tau = '//listed(end_tau, 2)//"; paper's mesh, nodal reading: "// &
         listed(end_tau_of(restitution, coarse_nodal, displacement_end), 2)//', energy down to 1 %: '// &
         listed(end_tau_of(restitution, coarse_nodal, energy_end), 2)//'; spread of the main peaks '// &
         number(1.0e6_wp*(maxval(peaks) - minval(peaks)), 2)//'e-6', &
         reason='with a consistent impulse the mass that takes part in an impact, '// &
         percent(1.0_wp/restitution%outcome(1, fine)%inverse_mass)// &
         ' of the beam on the fine mesh, shrinks with the elements, so eps ceases to matter unless there is a tip '// &
         'mass; by the nodal reading eps matters, but its order is not the same by eta and by energy'), sooner)
      associate (nodal => end_tau_of(restitution, coarse_nodal, displacement_end))
         call add_end_statement(list, statement_t('4b', 'Above eps = 0.6 there is no marked difference.', &
            'spread of the ends over eps = 0.6 ... 0.9; required: under 0.1', spread_above, &
            detail='ends at tau = '//listed(end_tau(first_high:), 2)//"; paper's mesh, nodal reading: "// &
            listed(nodal(first_high:), 2)), similar)
      end associate

   contains

      !> Relative reduction of the end of motion from the first eps of at least 0.6 to the lowest eps, and relative
      !> spread of the ends from that eps on.
      pure subroutine compare_ends(definition_number, reductions, spreads)
         !> Number of the definition of the end
         integer, intent(in) :: definition_number
         real(wp), intent(out) :: reductions(variant_count)
         real(wp), intent(out) :: spreads(variant_count)

         associate (ends => restitution%outcome%end_tau(definition_number))
            reductions = (ends(first_high, :) - ends(1, :))/ends(first_high, :)
            spreads = maxval(ends(first_high:, :), dim=1)/minval(ends(first_high:, :), dim=1) - 1.0_wp
         end associate
      end subroutine compare_ends

   end subroutine judge_restitution

end module stop_statements
