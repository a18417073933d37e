!> Convergence of the first example of the paper (Irie, Yamada and Asano 1977) under mesh refinement, with an impulse on
!> the whole beam and with replacement of the nodal velocity.
module paper_convergence
   use failures, only: failure_t
   use kinds, only: wp
   use paper_cases, only: paper_case_t, variant_t
   use paper_outcomes, only: energy_end, find_outcome, outcome_t, displacement_end
   use run_settings, only: impulse_momentum, impulse_nodal, method_exact
   implicit none (type, external)
   private
   public :: convergence_t, find_convergence, impulse_kinds

   !> Names of the kinds of impulse in tables, in the order of the `impulse_` constants.
   character(*), parameter :: impulse_kinds(2) = [character(8) :: 'momentum', 'nodal']

   !> Measures of the first example on each mesh. eta_c is the displacement eta at the stop.
   type :: convergence_t
      !> Number of equal elements of each mesh, [meshes]
      integer, allocatable :: elements(:)
      !> Effective mass at the stop in an impact, relative to the mass of the beam, [meshes]
      real(wp), allocatable :: mass(:)
      !> Instant tau of the first impact, [meshes]
      real(wp), allocatable :: impact_tau(:)
      !> Main peak in eta, the highest rebound within a period of the first mode after the first impact, [meshes, kinds
      !> of impulse]
      real(wp), allocatable :: main_peak(:, :)
      !> Instant tau of the last exceedance of 2 percent by |eta_c|, [meshes, kinds of impulse]
      real(wp), allocatable :: settling_tau(:, :)
      !> Instant tau at which the energy above rest last exceeds 1 percent of its initial value, [meshes, kinds of
      !> impulse]
      real(wp), allocatable :: energy_tau(:, :)
      !> Energy lost at impacts, relative to the initial energy above rest, [meshes, kinds of impulse]
      real(wp), allocatable :: lost(:, :)
      !> Energy created by replacing nodal velocities, relative to that initial energy, [meshes, kinds of impulse]
      real(wp), allocatable :: created(:, :)
   end type convergence_t

contains

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
      type(outcome_t) :: outcome
      integer :: i, k, meshes

      meshes = 1
      do while (coarsest*2**meshes <= finest)
         meshes = meshes + 1
      end do
      allocate (convergence%elements, source=[(coarsest*2**(i - 1), i=1, meshes)])
      allocate (convergence%mass(meshes), convergence%impact_tau(meshes))
      allocate (convergence%main_peak(meshes, 2), convergence%settling_tau(meshes, 2), &
         convergence%energy_tau(meshes, 2), convergence%lost(meshes, 2), convergence%created(meshes, 2))
      do i = 1, meshes
         do k = 1, 2
            call find_outcome(paper_case_t(), variant_t('', convergence%elements(i), method_exact, impulses(k)), &
               duration, outcome, error)
            if (allocated(error)) return
            convergence%mass(i) = 1.0_wp/outcome%inverse_mass
            convergence%impact_tau(i) = outcome%impact_tau
            convergence%main_peak(i, k) = outcome%main_peak
            convergence%settling_tau(i, k) = outcome%end_tau(displacement_end)
            convergence%energy_tau(i, k) = outcome%end_tau(energy_end)
            convergence%lost(i, k) = outcome%lost_at_impacts
            convergence%created(i, k) = outcome%created
         end do
      end do
   end subroutine find_convergence

end module paper_convergence
