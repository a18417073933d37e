!> Judges statements 2, 3 and 4 of the paper (Irie, Yamada and Asano 1977): the two models of the stop, the preload, the
!> coefficient of restitution. The main peak is the peak of the main rebound, the highest rebound within a period of the
!> first mode after the first impact.
module stop_statements
   use kinds, only: pi, wp
   use paper_cases, only: coarse_nodal, fine, variant_count
   use paper_outcomes, only: definition_count, energy_end, displacement_end
   use paper_series, only: end_tau_of, series_t
   use statement_types, only: add_statement, add_end_statement, listed, number, rank_correlation, percent, statements_t
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
      type(statements_t), intent(inout) :: list

      real(wp), parameter :: period = 2.0_wp*pi
      ! differences of the main peaks for one variant, [kappa]
      real(wp) :: difference(size(soft%cases))
      ! maximum indentations for one variant, [kappa]
      real(wp) :: indentation(size(soft%cases))
      ! durations of the first contact relative to the period for one variant, [kappa]
      real(wp) :: contact_fraction(size(soft%cases))
      ! these three results for kappa = 10, [variants]
      real(wp), dimension(variant_count) :: difference_10, indentation_10, fraction_10
      ! whether at kappa = 10 the models differ little (2a)
      logical :: similar(variant_count)
      ! whether at kappa = 10 the indentation is small (2b)
      logical :: stiff(variant_count)
      ! whether at kappa = 10 contacts are short (2c)
      logical :: short(variant_count)
      character(240) :: detail(3)
      character(60) :: remark(3)
      integer :: variant

      detail = ''
      do variant = 1, variant_count
         difference = abs(soft%outcome(:, variant)%main_peak - rigid%outcome(rigid_case, variant)%main_peak)
         indentation = soft%outcome(:, variant)%indentation
         contact_fraction = soft%outcome(:, variant)%contact_length/period
         ! the value printed in the paper is kappa = 10, the first of the series
         difference_10(variant) = difference(1)
         indentation_10(variant) = indentation(1)
         fraction_10(variant) = contact_fraction(1)
         similar(variant) = difference(1) < 0.05_wp
         stiff(variant) = indentation(1) < 0.01_wp
         short(variant) = contact_fraction(1) < 0.05_wp
         if (variant /= fine) cycle
         detail(1) = 'at kappa = 10, 1e2 ... 1e5: '//listed(difference, 4)
         remark(1) = 'with the printed kappa; from kappa = '//first_kappa_below(difference, 0.05_wp)//' on it does'
         detail(2) = 'at kappa = 10, 1e2 ... 1e5: '//listed(indentation, 5)
         remark(2) = 'with the printed kappa; from kappa = '//first_kappa_below(indentation, 0.01_wp)//' on it does'
         detail(3) = 'at kappa = 10, 1e2 ... 1e5: '//listed(contact_fraction, 4)
         remark(3) = 'with the printed kappa; from kappa = '//first_kappa_below(contact_fraction, 0.05_wp) &
            //' on it does'
      end do
      call add_statement(list, '2a', 'The two models of the stop give no marked difference.', &
         'difference of the main peaks at the printed kappa = 10; required: under 0.05', difference_10, similar, &
         trim(detail(1)), 'the printed kappa has probably lost its exponent', trim(remark(1)))
      call add_statement(list, '2b', 'The stop yields very slightly.', &
         'deepest indentation in eta at the printed kappa = 10; required: under 0.01', indentation_10, stiff, &
         trim(detail(2)), &
         'the printed kappa has probably lost its exponent', trim(remark(2)))
      call add_statement(list, '2c', 'The time of an impact is short against the period.', &
         'first contact over 2 pi at the printed kappa = 10; required: under 0.05', fraction_10, short, &
         trim(detail(3)), &
         'a first contact is a series of impacts and rests that lasts as long as the higher modes press the beam '// &
         'on the stop', &
         trim(remark(3)))

   contains

      !> Minimum kappa of the series from which on a value stays below its limit.
      function first_kappa_below(values, limit) result(text)
         !> Value for each kappa
         real(wp), intent(in) :: values(:)
         real(wp), intent(in) :: limit
         character(:), allocatable :: text

         integer :: last

         last = findloc(values < limit, .false., dim=1, back=.true.)
         text = 'none of these'
         if (last < size(values)) text = number(soft%value(last + 1), 0)
      end function first_kappa_below

   end subroutine judge_models

   !> Judge statement 3: the larger the preload, the earlier the end of motion.
   subroutine judge_preload(preload, list)
      !> Cases of ascending preload
      type(series_t), intent(in) :: preload
      type(statements_t), intent(inout) :: list

      ! value that decides the judgement of each variant
      real(wp) :: deciding_value(variant_count)
      ! ends of motion on the fine mesh, tau, [cases]
      real(wp) :: end_tau(size(preload%cases))
      ! whether the end of motion is earlier with larger preload
      logical :: sooner(definition_count, variant_count)
      integer :: variant, definition

      do variant = 1, variant_count
         deciding_value(variant) = end_ratio(variant, displacement_end)
         do definition = 1, definition_count
            sooner(definition, variant) = end_ratio(variant, definition) < 0.8_wp .and. &
               rank_correlation(end_tau_of(preload, variant, definition)) < -0.3_wp
         end do
      end do
      end_tau = end_tau_of(preload, fine, displacement_end)
      call add_end_statement(list, '3', 'The larger the preload, the sooner the vibration ends.', &
         'end at delta = 0.5 over the end at 0; required: under 0.8, and most pairs in order', deciding_value, sooner, &
         'ends at tau = '//listed(end_tau, 1)//' at delta = 0, 0.1 ... 0.5: order '// &
         number(rank_correlation(end_tau), 2)// &
         ' (-1: each sooner than the one before); energy down to 1 %: '// &
         listed(end_tau_of(preload, fine, energy_end), 1), &
         'at delta = 0.2 a nearly periodic bounce delays the end, its rebounds '// &
         listed(preload%outcome(3, fine)%peak_eta, 2), 'as a trend')

   contains

      !> Ratio of the end of motion at the maximum preload to that without preload.
      function end_ratio(variant, definition) result(ratio)
         !> Number of the variant
         integer, intent(in) :: variant
         !> Number of the definition of the end
         integer, intent(in) :: definition
         real(wp) :: ratio

         ratio = preload%outcome(size(preload%cases), variant)%end_tau(definition) &
            /preload%outcome(1, variant)%end_tau(definition)
      end function end_ratio

   end subroutine judge_preload

   !> Judge statement 4: a smaller eps gives a somewhat earlier end of motion, without marked difference above 0.6.
   subroutine judge_restitution(restitution, list)
      !> Cases of ascending eps
      type(series_t), intent(in) :: restitution
      type(statements_t), intent(inout) :: list

      ! relative reduction of the end of motion from eps = 0.6 to 0, [variants]
      real(wp) :: reduction(variant_count)
      ! relative spread of the ends of motion from eps = 0.6 on, [variants]
      real(wp) :: spread_above(variant_count)
      ! whether the end of motion is earlier with eps = 0 than with 0.6
      logical :: sooner(definition_count, variant_count)
      ! whether the ends of motion from eps = 0.6 on are similar
      logical :: similar(definition_count, variant_count)
      real(wp) :: end_tau(size(restitution%cases)), peaks(size(restitution%cases))
      integer :: variant, i, definition
      ! index of the first case with eps of at least 0.6
      integer :: first_high

      first_high = findloc(restitution%value >= 0.6_wp, .true., dim=1)
      do variant = 1, variant_count
         reduction(variant) = end_reduction(variant, displacement_end)
         do definition = 1, definition_count
            sooner(definition, variant) = end_reduction(variant, definition) > 0.05_wp
            end_tau = end_tau_of(restitution, variant, definition)
            similar(definition, variant) = maxval(end_tau(first_high:))/minval(end_tau(first_high:)) - 1.0_wp < 0.1_wp
         end do
         end_tau = end_tau_of(restitution, variant, displacement_end)
         spread_above(variant) = maxval(end_tau(first_high:))/minval(end_tau(first_high:)) - 1.0_wp
      end do
      end_tau = end_tau_of(restitution, fine, displacement_end)
      peaks = [(restitution%outcome(i, fine)%main_peak, i=1, size(peaks))]
      call add_end_statement(list, '4a', 'The smaller eps, the somewhat sooner the vibration ends.', &
         'by what share eps = 0 ends before eps = 0.6; required: over 0.05', reduction, sooner, &
         'ends at tau = '//listed(end_tau, 2)//"; paper's mesh, nodal reading: "// &
         listed(end_tau_of(restitution, coarse_nodal, displacement_end), 2)//', energy down to 1 %: '// &
         listed(end_tau_of(restitution, coarse_nodal, energy_end), 2)//'; spread of the main peaks '// &
         number(1.0e6_wp*(maxval(peaks) - minval(peaks)), 2)//'e-6', &
         'with a consistent impulse the mass that takes part in an impact, '// &
         percent(1.0_wp/restitution%outcome(1, fine)%inverse_mass)// &
         ' of the beam on the fine mesh, shrinks with the elements, so eps ceases to matter unless there is a tip '// &
         'mass; by the nodal reading eps matters, but its order is not the same by eta and by energy')
      associate (nodal => end_tau_of(restitution, coarse_nodal, displacement_end))
         call add_end_statement(list, '4b', 'Above eps = 0.6 there is no marked difference.', &
            'spread of the ends over eps = 0.6 ... 0.9; required: under 0.1', spread_above, similar, &
            'ends at tau = '//listed(end_tau(first_high:), 2)//"; paper's mesh, nodal reading: "// &
            listed(nodal(first_high:), 2), '')
      end associate

   contains

      !> Relative reduction of the end of motion from the first eps of at least 0.6 to the lowest eps.
      function end_reduction(variant, definition) result(reduction)
         !> Number of the variant
         integer, intent(in) :: variant
         !> Number of the definition of the end
         integer, intent(in) :: definition
         real(wp) :: reduction

         associate (end_at_lowest => restitution%outcome(1, variant)%end_tau(definition), &
            end_at_06 => restitution%outcome(first_high, variant)%end_tau(definition))
            reduction = (end_at_06 - end_at_lowest)/end_at_06
         end associate
      end function end_reduction

   end subroutine judge_restitution

end module stop_statements
