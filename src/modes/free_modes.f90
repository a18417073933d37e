!> The modes of a free beam and what follows from them alone. Every run of the same beam, whatever its damping,
!> its stop and its length, can share them; they are never changed by a run, so threads share them too.
module free_modes
   use beam_model, only: beam_model_t
   use constrained_modes, only: attach_supports
   use failures, only: failure_t
   use kinds, only: lambda1, wp
   use natural_solver, only: natural_modes
   use skyline_matrix, only: multiply
   implicit none (type, external)
   private
   public :: free_modes_t, find_free_modes, describe_modes, rigid_square

   type :: free_modes_t
      !> Elements of the mesh
      integer :: elements = 0
      !> The stop point and the tip among the degrees of freedom
      integer :: stop_dof = 0
      integer :: tip_dof = 0
      !> Displacement and rotation of the root; 0: held
      integer :: root_dofs(2) = 0
      !> lambda_i, ascending, [modes]
      real(wp), allocatable :: lambda(:)
      !> W_i^2 = (lambda_i/lambda1)^4, [modes]
      real(wp), allocatable :: square(:)
      !> Mass-normalised modes, rho Abar L = 1, [degrees of freedom, modes]
      real(wp), allocatable :: mode(:, :)
      !> Modes above these that a run leaves out and whose static share its moments take; unallocated: there are none
      real(wp), allocatable :: left_square(:)
      real(wp), allocatable :: left_mode(:, :)
      !> Of a massless node at the stop: how far a unit force on it moves it, all else held; 0: it has mass
      real(wp) :: node_flexibility = 0.0_wp
      !> (M phi_i)_c: what the nodal reading of an impulse needs, [modes]
      real(wp), allocatable :: nodal_mass(:)
   end type free_modes_t

   !> W^2 of a rigid mode, whose motion differs from a polynomial in time, or with alpha from an exponential, by
   !> (W t)^2/2: no run is so long that this is more than rounding.
   real(wp), parameter :: rigid_square = 1.0e-40_wp

contains

   !> Solve for all modes of an assembled beam.
   subroutine find_free_modes(model, modes, error)
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(out) :: modes
      !> Set when the modes cannot be found
      type(failure_t), allocatable, intent(out) :: error

      call natural_modes(model, model%stiffness%order - merge(1, 0, model%has_massless_node), modes%lambda, error, &
         modes%mode)
      if (allocated(error)) return
      call attach_supports(model%supports, modes%lambda, modes%mode)
      call describe_modes(model, modes)
   end subroutine find_free_modes

   !> What follows from lambda and the shapes.
   subroutine describe_modes(model, modes)
      type(beam_model_t), intent(in) :: model
      !> Has both
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
   end subroutine describe_modes

end module free_modes
