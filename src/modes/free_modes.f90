!> The modes of a beam without contact, and quantities that follow from modes and matrices of the mesh. As
!> `find_free_modes` returns them, they do not depend on damping, the laws of the stops and the duration of a run, so
!> all runs of a beam on one mesh, in all threads, share them. A run that selects or reorders modes, or adds residual
!> modes or modes of bodies, does so in a copy.
module free_modes
   use beam_model, only: beam_model_t
   use constrained_modes, only: attach_supports
   use failures, only: failure_t
   use kinds, only: lambda1, wp
   use natural_solver, only: natural_modes
   use skyline_matrix, only: multiply
   implicit none (type, external)
   private
   public :: free_modes_t, find_free_modes, complete_modes, rigid_square, max_rigid_square

   type :: free_modes_t
      !> Number of elements of the mesh
      integer :: elements = 0
      !> Degree of freedom of the displacement at the first stop
      integer :: stop_dof = 0
      !> Degree of freedom of the tip
      integer :: tip_dof = 0
      !> Degrees of freedom of the displacement and rotation of the root; 0: fixed
      integer :: root_dofs(2) = 0
      !> Wave numbers lambda_i, [modes], ascending as computed (`append_bodies` and `select_modes` change the order)
      real(wp), allocatable :: lambda(:)
      !> Squared frequencies W_i^2 = (lambda_i/lambda1)^4 in omega1^2, [modes]
      real(wp), allocatable :: square(:)
      !> Mass-normalised modes, rho Abar L = 1, [degrees of freedom, modes]. Modes of bodies have degrees of freedom of
      !> their own, which follow those of the beam
      real(wp), allocatable :: mode(:, :)
      !> Number of the body to which each mode belongs; 0: the beam. Unallocated: modes of bodies have not been
      !> appended, [modes]
      integer, allocatable :: body(:)
      !> Squared frequencies of the truncated modes, whose static part a run adds to the bending moments; unallocated:
      !> no mode is truncated, or the run needs no truncated modes (it has no stresses, or it has residual modes)
      real(wp), allocatable :: truncated_square(:)
      !> Shapes of the truncated modes
      real(wp), allocatable :: truncated_mode(:, :)
      !> Displacement of a massless node at the stop (of a redistributed mass matrix, docs/theory.md, section 14) under
      !> a force on it of one unit, rho Abar L omega1^2 D, if all other degrees of freedom are fixed; 0: the node has
      !> mass
      real(wp) :: node_flexibility = 0.0_wp
      !> Component of M phi_i at the degree of freedom of the stop, for impacts that replace the velocity of the node at
      !> the stop alone, [modes]
      real(wp), allocatable :: nodal_mass(:)
   end type free_modes_t

   !> W^2 of a rigid-body mode, positive because formulas divide by W^2. The motion of the mode differs from a
   !> polynomial in time, or with mass-proportional damping from an exponential, by (W t)^2/2, which is below rounding
   !> in a run of the maximum duration, t = 1e9.
   real(wp), parameter :: rigid_square = 1.0e-40_wp
   !> Modes up to this W^2 have no restoring force: rigid-body modes, bodies without springs, and combinations of both.
   !> The limit is so far above the W^2 of these modes (`rigid_square`, and `append_bodies`) that rounding errors of the
   !> combinations do not exceed it.
   real(wp), parameter :: max_rigid_square = 1.0e-30_wp

contains

   !> Compute all modes of an assembled beam.
   subroutine find_free_modes(model, modes, error)
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(out) :: modes
      !> Set if the modes cannot be found
      type(failure_t), allocatable, intent(out) :: error

      call natural_modes(model, model%stiffness%order - merge(1, 0, model%has_massless_node), modes%lambda, error, &
         modes%mode)
      if (allocated(error)) return
      call attach_supports(model%supports, modes%lambda, modes%mode)
      call complete_modes(model, modes)
   end subroutine find_free_modes

   !> Compute the quantities that follow from lambda and the mode shapes.
   subroutine complete_modes(model, modes)
      type(beam_model_t), intent(in) :: model
      !> On entry with lambda and the mode shapes; on return complete
      type(free_modes_t), intent(inout) :: modes

      real(wp), allocatable :: unit(:), mass_column(:)

      modes%elements = model%mesh%elements
      modes%stop_dof = model%stop_dof
      modes%tip_dof = model%tip_dof
      modes%root_dofs = model%root_dofs
      allocate (modes%square, source=max((modes%lambda/lambda1)**4, rigid_square))
      allocate (unit(model%mass%order), mass_column(model%mass%order))
      if (model%has_massless_node) then
         modes%node_flexibility = lambda1**4/model%stiffness%values(model%stiffness%diagonal(model%stop_dof))
      end if
      unit = 0.0_wp
      unit(model%stop_dof) = 1.0_wp
      call multiply(model%mass, unit, mass_column)
      allocate (modes%nodal_mass(size(modes%lambda)))
      modes%nodal_mass(:) = matmul(mass_column, modes%mode)
   end subroutine complete_modes

end module free_modes
