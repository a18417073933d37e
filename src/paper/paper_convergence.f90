!> How the paper's first example settles as the mesh is refined, by both readings of an impulse.
module paper_convergence
   use failures, only: failure_t
   use kinds, only: wp
   use paper_cases, only: figure_case_t, way_t
   use paper_outcomes, only: energy_end, find_outcome, outcome_t, usual_end
   use run_settings, only: impulse_momentum, impulse_nodal, method_exact
   implicit none (type, external)
   private
   public :: convergence_t, find_convergence, reading_names

   !> Columns of the tables, in the order of the impulse's constants.
   character(*), parameter :: reading_names(2) = [character(8) :: 'momentum', 'nodal']

   type :: convergence_t
      !> Meshes of equal elements
      integer, allocatable :: elements(:)
      !> Mass that takes part in an impact, of the beam
      real(wp), allocatable :: mass(:)
      !> First meeting with the stop, tau
      real(wp), allocatable :: first_tau(:)
      !> By mesh and reading: main peak; when |eta_c| last exceeds 2 percent; when 1 percent of the energy is left;
      !> energy lost at impacts and created, of the energy to lose
      real(wp), allocatable :: main_peak(:, :)
      real(wp), allocatable :: quiet(:, :)
      real(wp), allocatable :: spent(:, :)
      real(wp), allocatable :: lost(:, :)
      real(wp), allocatable :: created(:, :)
   end type convergence_t

contains

   !> Run the example on a chain of meshes.
   subroutine find_convergence(coarsest, finest, duration, convergence, error)
      !> Elements of the coarsest mesh; they are halved while there are no more than these
      integer, intent(in) :: coarsest
      integer, intent(in) :: finest
      !> Length of the runs, tau
      real(wp), intent(in) :: duration
      !> What was found
      type(convergence_t), intent(out) :: convergence
      !> Set when a run fails
      type(failure_t), allocatable, intent(out) :: error

      integer, parameter :: readings(2) = [impulse_momentum, impulse_nodal]
      type(outcome_t) :: outcome
      integer :: i, k, meshes

      meshes = 1
      do while (coarsest*2**meshes <= finest)
         meshes = meshes + 1
      end do
      allocate (convergence%elements, source=[(coarsest*2**(i - 1), i=1, meshes)])
      allocate (convergence%mass(meshes), convergence%first_tau(meshes))
      allocate (convergence%main_peak(meshes, 2), convergence%quiet(meshes, 2), convergence%spent(meshes, 2), &
         convergence%lost(meshes, 2), convergence%created(meshes, 2))
      do i = 1, meshes
         do k = 1, 2
            call find_outcome(figure_case_t(), way_t('', convergence%elements(i), method_exact, readings(k)), &
               duration, outcome, error)
            if (allocated(error)) return
            convergence%mass(i) = 1.0_wp/outcome%mobility
            convergence%first_tau(i) = outcome%first_tau
            convergence%main_peak(i, k) = outcome%main_peak
            convergence%quiet(i, k) = outcome%ends(usual_end)
            convergence%spent(i, k) = outcome%ends(energy_end)
            convergence%lost(i, k) = outcome%lost_at_impacts
            convergence%created(i, k) = outcome%created
         end do
      end do
   end subroutine find_convergence

end module paper_convergence
