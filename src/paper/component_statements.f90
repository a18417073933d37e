!> Judges statements 9 and 10 of the paper (Irie, Yamada and Asano 1977): contributions of high modes to displacement
!> and velocity, and the parameters that reduce these contributions. The main peak is the peak of the main rebound, the
!> highest rebound within a period of the first mode after the first impact.
module component_statements
   use kinds, only: wp
   use paper_cases, only: fine, variant_count, outcome_t
   use paper_series, only: series_t, vary_mass, vary_position, vary_preload, vary_taper, vary_zeta
   use statement_types, only: listed, number, statement_t
   implicit none (type, external)
   private
   public :: judge_components

contains

   !> Judge statement 9 (contributions of high modes to velocity and displacement; scatter of the peaks of the rebounds)
   !> and statement 10 (parameters that reduce high modes, displacements and velocities).
   subroutine judge_components(series, list)
      !> All series, indexed by the `vary_` constants
      type(series_t), intent(in) :: series(:)
      type(statement_t), allocatable, intent(inout) :: list(:)

      ! number of remedies; a remedy is one changed parameter
      integer, parameter :: remedy_count = 5
      ! series of each remedy
      integer, parameter :: parameter_of(remedy_count) = [vary_zeta, vary_preload, vary_mass, vary_taper, vary_position]
      ! number of the case of each remedy in its series
      integer, parameter :: case_of(remedy_count) = [3, 4, 4, 4, 5]
      ! name of each remedy
      character(*), parameter :: name_of(remedy_count) = [character(16) :: 'zeta = 0.05', 'delta = 0.3', 'mu = 0.5', &
         'alpha = 0.075', 'Lc/L = 0.875']
      ! values that decide statement 9a; 1e-12 and 1e6 keep quotients finite
      real(wp) :: ratio(variant_count)
      ! values that decide statement 9b; the same limits keep quotients finite
      real(wp) :: scatter(variant_count)
      ! values that decide statement 10
      real(wp) :: reduced(variant_count)
      ! list of the values of each remedy
      character(:), allocatable :: detail
      ! list of the remedies that do not reduce all three values
      character(:), allocatable :: exceptions
      integer :: variant, k
      ! number of the three values that a remedy reduces
      integer :: reductions(variant_count)

      detail = ''
      exceptions = ''
      reduced = 0.0_wp
      ! reference: first case of the series of zeta, 0.001, which is the paper's first example; heavy_tip: mu = 2
      associate (reference => series(vary_zeta)%outcome(1, :), heavy_tip => series(vary_mass)%outcome(6, :))
         ratio = reference%high_mode_velocity/max(reference%high_mode_displacement, 1.0e-12_wp)
         scatter = [(scatter_of(reference(variant))/max(scatter_of(heavy_tip(variant)), 1.0e-12_wp), variant=1, &
            variant_count)]
         do k = 1, remedy_count
            associate (other => series(parameter_of(k))%outcome(case_of(k), :))
               reductions = merge(1, 0, other%high_mode_velocity < reference%high_mode_velocity) &
                  + merge(1, 0, other%main_peak < reference%main_peak) &
                  + merge(1, 0, other%later_velocity < reference%later_velocity)
               reduced = reduced + real(reductions, wp)
               if (reductions(fine) < 3) exceptions = exceptions &
                  //trim(merge(', ', '  ', exceptions /= ''))//' '//trim(name_of(k))
               detail = detail//trim(merge('   ', ';  ', k == 1))//' '//trim(name_of(k))//': ' &
                  //listed([other(fine)%high_mode_velocity/reference(fine)%high_mode_velocity, &
                  other(fine)%main_peak/reference(fine)%main_peak, &
                  other(fine)%later_velocity/reference(fine)%later_velocity], 2)
            end associate
         end do
      end associate
      associate (reference => series(vary_zeta)%outcome(1, fine), heavy_tip => series(vary_mass)%outcome(6, fine), &
         damped => series(vary_zeta)%outcome(3, fine))
         list = [list, statement_t('9a', &
            'After an impact the velocity shows high components far more than the displacement.', &
            'part of the modes above the second in the velocity of the stop point over that in its displacement; '// &
            'required: over 2', &
            ratio, ratio > 2.0_wp, 'parts '//number(reference%high_mode_velocity, 3)//' and '// &
            number(reference%high_mode_displacement, 3))]
         list = [list, statement_t('9b', 'The points of figure 10 lie off one smooth curve because of high modes.', &
            'scatter of log10(peak) about a parabola in tau, reference over mu = 2; required: over 2', &
            min(scatter, 1.0e6_wp), scatter > 2.0_wp, &
            'scatter: reference '//number(scatter_of(reference), 3)//', mu = 2 '// &
            number(scatter_of(heavy_tip), 3)//', zeta = 0.05 '//number(scatter_of(damped), 3))]
      end associate
      list = [list, statement_t('10', &
         'More damping, more preload, a suitable mass, shape and contact position reduce high '// &
         'components, displacements and contact velocities.', &
         'number of values that fall, of 15: high part of the velocity, main peak and maximum later velocity for '// &
         'each of 5 remedies; required: all', &
         reduced, reduced > 14.5_wp, "of the reference's:"//detail, &
         'the remedies that do not reduce all three:'//exceptions)]
   end subroutine judge_components

   !> Root mean square deviation of log10 of the peaks from their least-squares parabola in tau.
   pure real(wp) function scatter_of(outcome) result(scatter)
      type(outcome_t), intent(in) :: outcome

      integer, parameter :: terms = 3
      ! 1, tau, tau^2 at the peaks, made orthonormal
      real(wp) :: basis(size(outcome%peak_eta), terms)
      ! log10 of the peaks less its projections on `basis`
      real(wp) :: deviation(size(outcome%peak_eta))
      integer :: j, k

      scatter = 0.0_wp
      ! a parabola passes through three points exactly
      if (size(outcome%peak_eta) <= terms) return
      deviation = log10(outcome%peak_eta)
      basis(:, 1) = 1.0_wp
      basis(:, 2) = outcome%peak_tau
      basis(:, 3) = outcome%peak_tau**2
      ! Gram-Schmidt orthogonalisation
      do j = 1, terms
         do k = 1, j - 1
            basis(:, j) = basis(:, j) - basis(:, k)*dot_product(basis(:, k), basis(:, j))
         end do
         basis(:, j) = basis(:, j)/norm2(basis(:, j))
         deviation = deviation - basis(:, j)*dot_product(basis(:, j), deviation)
      end do
      scatter = norm2(deviation)/sqrt(real(size(deviation), wp))
   end function scatter_of

end module component_statements
