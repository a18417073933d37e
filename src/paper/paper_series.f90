!> Series of cases of the figures of the paper (Irie, Yamada and Asano 1977). Each series varies one parameter; each
!> case is computed in every variant (method, mesh, kind of impulse and mass matrix) of `paper_cases`. The end of motion
!> of a case is an instant tau by one of the definitions of `paper_cases`. Besides the series, the first example is
!> computed on finer and finer meshes, with an impulse on the whole beam and with replacement of the nodal velocity.
module paper_series
   use failures, only: failure_t
   use kinds, only: wp
   use paper_cases, only: comparison_variant, paper_case_t, variant_count, variant_t, definition_count, &
      find_outcome, outcome_t, sample_step
   use run_settings, only: impulse_momentum, impulse_nodal, method_exact
   implicit none (type, external)
   private
   public :: series_t, make_series, compute_series, end_tau_of, may_end_earliest, find_earliest_end, series_names, &
      series_symbols, vary_preload, vary_restitution, vary_position, vary_zeta, vary_mass, vary_taper, vary_stiffness, &
      convergence_t, find_convergence, impulse_kinds

   !> Parameters that are varied, one for each series
   integer, parameter :: vary_preload = 1
   integer, parameter :: vary_restitution = 2
   integer, parameter :: vary_position = 3
   integer, parameter :: vary_zeta = 4
   integer, parameter :: vary_mass = 5
   integer, parameter :: vary_taper = 6
   integer, parameter :: vary_stiffness = 7

   !> Names of the varied parameters in scene files, and their symbols in the paper
   character(*), parameter :: series_names(7) = [character(16) :: 'preload', 'restitution', 'position', 'zeta', &
      'tip_mass_ratio', 'taper', 'stiffness_ratio']
   character(*), parameter :: series_symbols(7) = [character(8) :: 'delta', 'eps', 'Lc/L', 'zeta', 'mu', 'alpha', &
      'kappa']

   !> A series, the curves of one figure.
   type :: series_t
      !> Values of the varied parameter, [cases]
      real(wp), allocatable :: value(:)
      type(paper_case_t), allocatable :: cases(:)
      !> Measures of the cases, [cases, variants]
      type(outcome_t), allocatable :: outcome(:, :)
   end type series_t

   !> Names of the kinds of impulse in tables, in the order of the `impulse_` constants.
   character(*), parameter :: impulse_kinds(2) = [character(8) :: 'momentum', 'nodal']

   !> The first example on each mesh.
   type :: convergence_t
      !> Number of equal elements of each mesh, [meshes]
      integer, allocatable :: elements(:)
      !> Measures, [meshes, kinds of impulse]
      type(outcome_t), allocatable :: outcome(:, :)
   end type convergence_t

contains

   !> Make the cases of one figure.
   pure subroutine make_series(parameter, series)
      !> One of the `vary_` constants
      integer, intent(in) :: parameter
      type(series_t), intent(out) :: series

      integer :: i

      select case (parameter)
      case (vary_preload)
         series%value = [0.0_wp, 0.1_wp, 0.2_wp, 0.3_wp, 0.4_wp, 0.5_wp]
         series%cases = [(paper_case_t(preload=series%value(i)), i=1, size(series%value))]
      case (vary_restitution)
         series%value = [0.0_wp, 0.2_wp, 0.4_wp, 0.6_wp, 0.8_wp, 0.9_wp]
         series%cases = [(paper_case_t(restitution=series%value(i)), i=1, size(series%value))]
      case (vary_position)
         series%value = [0.5_wp, 0.7_wp, 0.75_wp, 0.87_wp, 0.875_wp, 1.0_wp]
         series%cases = [(paper_case_t(position=series%value(i)), i=1, size(series%value))]
      case (vary_zeta)
         series%value = [0.001_wp, 0.01_wp, 0.05_wp, 0.1_wp]
         series%cases = [(paper_case_t(zeta=series%value(i)), i=1, size(series%value))]
      case (vary_mass)
         ! the last two values extend the figure towards the oscillator of one degree of freedom
         series%value = [0.0_wp, 0.1_wp, 0.25_wp, 0.5_wp, 1.0_wp, 2.0_wp, 10.0_wp, 30.0_wp]
         series%cases = [(paper_case_t(tip_mass=series%value(i)), i=1, size(series%value))]
      case (vary_taper)
         series%value = [0.0_wp, 0.025_wp, 0.05_wp, 0.075_wp, 0.1_wp, 0.125_wp, 0.15_wp]
         series%cases = [(paper_case_t(taper=series%value(i)), i=1, size(series%value))]
      case default
         series%value = [10.0_wp, 1.0e2_wp, 1.0e3_wp, 1.0e4_wp, 1.0e5_wp]
         series%cases = [(paper_case_t(stiffness=series%value(i)), i=1, size(series%value))]
      end select
   end subroutine make_series

   !> Compute all cases of a series in every variant.
   subroutine compute_series(variants, duration, series, error)
      type(variant_t), intent(in) :: variants(variant_count)
      !> Duration of the runs in tau
      real(wp), intent(in) :: duration
      type(series_t), intent(inout) :: series
      !> Set if a run fails
      type(failure_t), allocatable, intent(out) :: error

      integer :: i, variant

      allocate (series%outcome(size(series%cases), variant_count))
      do variant = 1, variant_count
         do i = 1, size(series%cases)
            call find_outcome(series%cases(i), variants(variant), duration, series%outcome(i, variant), error)
            if (allocated(error)) return
         end do
      end do
   end subroutine compute_series

   !> Instants tau of the end of motion over the cases of a series.
   pure function end_tau_of(series, variant, definition) result(end_tau)
      type(series_t), intent(in) :: series
      integer, intent(in) :: variant
      !> Number of the definition of the end of motion
      integer, intent(in) :: definition
      real(wp) :: end_tau(size(series%cases))

      end_tau = series%outcome(:, variant)%end_tau(definition)
   end function end_tau_of

   !> Whether each case may be the case whose motion ends earliest. The error of the instant of an end is estimated by
   !> its difference from the instant in the variant for comparison (`comparison_variant`).
   pure function may_end_earliest(series, variant, definition) result(may_be_earliest)
      type(series_t), intent(in) :: series
      integer, intent(in) :: variant
      !> Number of the definition of the end of motion
      integer, intent(in) :: definition
      logical :: may_be_earliest(size(series%cases))

      ! case with the earliest end
      integer :: first

      associate (end_tau => end_tau_of(series, variant, definition), &
         compared => end_tau_of(series, comparison_variant(variant), definition))
         first = minloc(end_tau, dim=1)
         ! the earlier of both instants of the case is not later than the later one of the case `first`; the instants
         ! are multiples of the sampling interval, so an instant less than one interval later is not later
         may_be_earliest = min(end_tau, compared) < max(end_tau(first), compared(first)) + sample_step
      end associate
   end function may_end_earliest

   !> For each definition of the end of motion and each variant, whether the motion of a given case ends earliest, or is
   !> tied with the earliest of other cases within the error.
   pure subroutine find_earliest_end(series, case_number, is_first, is_tied)
      type(series_t), intent(in) :: series
      !> Number of the given case
      integer, intent(in) :: case_number
      logical, dimension(definition_count, variant_count), intent(out) :: is_first
      logical, dimension(definition_count, variant_count), intent(out) :: is_tied

      logical :: may_be_earliest(size(series%cases))
      integer :: definition, variant

      do variant = 1, variant_count
         do definition = 1, definition_count
            may_be_earliest = may_end_earliest(series, variant, definition)
            is_first(definition, variant) = may_be_earliest(case_number) .and. count(may_be_earliest) == 1
            is_tied(definition, variant) = may_be_earliest(case_number) .and. count(may_be_earliest) > 1
         end do
      end do
   end subroutine find_earliest_end

   !> Compute the first example, whose parameters are the defaults of `paper_case_t`, on a sequence of meshes.
   subroutine find_convergence(coarsest, finest, duration, convergence, error)
      !> Number of elements of the coarsest mesh, which is doubled from mesh to mesh
      integer, intent(in) :: coarsest
      !> Maximum number of elements
      integer, intent(in) :: finest
      !> Duration of the runs in tau
      real(wp), intent(in) :: duration
      !> Results of all meshes
      type(convergence_t), intent(out) :: convergence
      !> Set if a run fails
      type(failure_t), allocatable, intent(out) :: error

      integer, parameter :: impulses(2) = [impulse_momentum, impulse_nodal]
      integer :: i, k, meshes

      meshes = 1
      do while (coarsest*2**meshes <= finest)
         meshes = meshes + 1
      end do
      allocate (convergence%elements, source=[(coarsest*2**(i - 1), i=1, meshes)])
      allocate (convergence%outcome(meshes, 2))
      do i = 1, meshes
         do k = 1, 2
            call find_outcome(paper_case_t(), variant_t('', convergence%elements(i), method_exact, impulses(k)), &
               duration, convergence%outcome(i, k), error)
            if (allocated(error)) return
         end do
      end do
   end subroutine find_convergence

end module paper_series
