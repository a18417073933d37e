!> Computes the cases of the paper (Irie, Yamada and Asano 1977) and judges all its statements about them.
module statements_study
   use component_statements, only: judge_components
   use failures, only: failure_t
   use frequency_statements, only: judge_frequencies
   use kinds, only: wp
   use paper_cases, only: coarse, fine, variant_count, variant_t
   use paper_series, only: convergence_t, find_convergence, compute_series, make_series, series_t, vary_mass, &
      vary_position, vary_preload, vary_restitution, vary_stiffness, vary_taper, vary_zeta
   use parameter_statements, only: judge_mass, judge_taper, judge_damping, judge_position
   use statement_types, only: statement_t
   use stop_statements, only: judge_models, judge_preload, judge_restitution
   implicit none (type, external)
   private
   public :: judge_statements, study_t

   !> Number of series, one for each `vary_` constant.
   integer, parameter :: series_count = 7

   !> The statements with their verdicts, and the results on which the verdicts are based.
   type :: study_t
      type(variant_t) :: variants(variant_count)
      type(statement_t), allocatable :: statements(:)
      !> All computed series, indexed by the `vary_` constants
      type(series_t) :: series(series_count)
      type(convergence_t) :: convergence
   end type study_t

contains

   !> Compute all cases in every variant of `paper_cases`, and the convergence of the first example, and judge all
   !> statements in the order of the paper.
   subroutine judge_statements(variants, duration, study, error)
      type(variant_t), intent(in) :: variants(variant_count)
      !> Duration of the runs in tau
      real(wp), intent(in) :: duration
      !> Statements with their verdicts, and the results on which the verdicts are based
      type(study_t), intent(out) :: study
      !> Set if a run fails
      type(failure_t), allocatable, intent(out) :: error

      ! maximum number of elements of the coarsest mesh in the study of convergence
      integer, parameter :: max_coarsest_elements = 4
      ! case 1 of the series of zeta: the paper's first example, with a rigid stop
      integer, parameter :: first_example = 1
      ! maximum duration tau of the runs of the first example on finer meshes: |eta_c| last exceeds 0.02 before tau = 23
      ! on every mesh, so that a longer run changes no result
      real(wp), parameter :: max_example_duration = 40.0_wp
      integer :: i

      study%variants = variants
      do i = 1, series_count
         call make_series(i, study%series(i))
         call compute_series(variants, duration, study%series(i), error)
         if (allocated(error)) return
      end do
      call find_convergence(min(max_coarsest_elements, variants(coarse)%elements), 2*variants(fine)%elements, &
         min(duration, max_example_duration), study%convergence, error)
      if (allocated(error)) return
      allocate (study%statements(0))
      call judge_frequencies(study%statements, error)
      if (allocated(error)) return
      associate (series => study%series)
         call judge_models(series(vary_stiffness), series(vary_zeta), first_example, study%statements)
         call judge_preload(series(vary_preload), study%statements)
         call judge_restitution(series(vary_restitution), study%statements)
         call judge_position(series(vary_position), study%statements)
         call judge_damping(series(vary_zeta), study%statements)
         call judge_mass(series(vary_mass), study%statements)
         call judge_taper(series(vary_taper), study%statements)
         call judge_components(series, study%statements)
      end associate
   end subroutine judge_statements

end module statements_study
