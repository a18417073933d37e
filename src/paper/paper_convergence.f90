!> Convergence of the first example of the paper (Irie, Yamada and Asano 1977) under mesh refinement, with an impulse on
!> the whole beam and with replacement of the nodal velocity.
module paper_convergence
   use failures, only: failure_t
   use kinds, only: wp
   use paper_cases, only: paper_case_t, variant_t
   use paper_outcomes, only: find_outcome, outcome_t
   use run_settings, only: impulse_momentum, impulse_nodal, method_exact
   implicit none (type, external)
   private
   public :: convergence_t, find_convergence, impulse_kinds

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

end module paper_convergence
