!> Newmark's steps in modes of the beam: the beam as a model whose degrees of freedom are modes, so that its matrices
!> are diagonal, and the way back from modes to nodes (docs/theory.md, section 10).
!>
!> The modes are those of exact motion: the lowest modes and, on large meshes, residual modes, which give stops and
!> loads the static flexibility of all other modes.
module newmark_modes
   use beam_model, only: beam_model_t
   use contact_rows, only: band
   use free_modes, only: free_modes_t
   use kinds, only: lambda1_power4, wp
   use newmark_stepper, only: newmark_state_t
   use skyline_matrix, only: make_skyline
   implicit none (type, external)
   private
   public :: make_modal_model, nodal_state

contains

   !> Make the model of a beam in its modes.
   pure subroutine make_modal_model(model, modes, modal, point_shape)
      type(beam_model_t), intent(in) :: model
      !> The modes, of unit modal mass
      type(free_modes_t), intent(in) :: modes
      !> K = lambda1^4 W^2 and M = 1 of the modes, in E Ibar/L^3 and rho Abar L as those of any model; `stop_dof`,
      !> `stop_dofs`, `partner_dofs`, `points` and `tip_dof` are the entries of these points in a state vector (module
      !> `modal_steps`). Root and supports are part of the modes
      type(beam_model_t), intent(out) :: modal
      !> Displacement of each of these points per unit of each mode, [modes, points]
      real(wp), allocatable, intent(out) :: point_shape(:, :)

      ! degrees of freedom of the points in the model, with repetitions
      integer, allocatable :: repeated_dofs(:)
      ! degrees of freedom of the points in the model, without repetitions
      integer, allocatable :: dofs(:)
      integer :: i

      ! components that are not set below describe the beam, which is the same
      modal = model
      associate (order => size(modes%square))
         call make_skyline(modal%stiffness, [(i, i=1, order)])
         modal%mass = modal%stiffness
         modal%stiffness%values = lambda1_power4*modes%square
         modal%mass%values = 1.0_wp
         modal%supports = modal%supports(:0)
         modal%root_dofs = 0
         repeated_dofs = [model%tip_dof, model%stop_dof, model%stop_dofs, model%points%dof]
         dofs = pack(repeated_dofs, [(findloc(repeated_dofs, repeated_dofs(i), dim=1) == i, &
            i=1, size(repeated_dofs))])
         point_shape = transpose(modes%mode(dofs, :))
         modal%tip_dof = order + 1
         modal%stop_dof = order + findloc(dofs, model%stop_dof, dim=1)
         modal%stop_dofs = [(order + findloc(dofs, model%stop_dofs(i), dim=1), i=1, size(model%stop_dofs))]
         modal%partner_dofs = [(merge(order + findloc(dofs, model%partner_dofs(i), dim=1), 0, &
            model%partner_dofs(i) > 0), i=1, size(model%partner_dofs))]
         modal%points%dof = [(order + findloc(dofs, model%points(i)%dof, dim=1), i=1, size(model%points))]
      end associate
   end subroutine make_modal_model

   !> Convert a state from modes to the degrees of freedom of the model.
   pure type(newmark_state_t) function nodal_state(modes, state) result(nodes)
      type(free_modes_t), intent(in) :: modes
      !> Displacement and velocity of the modes
      type(newmark_state_t), intent(in) :: state

      associate (dofs => size(modes%mode, 1), count => size(modes%mode, 2))
         allocate (nodes%displacement(1 - band:dofs + band), nodes%velocity(1 - band:dofs + band), source=0.0_wp)
         nodes%displacement(1:dofs) = matmul(modes%mode, state%displacement(1:count))
         nodes%velocity(1:dofs) = matmul(modes%mode, state%velocity(1:count))
      end associate
   end function nodal_state

end module newmark_modes
