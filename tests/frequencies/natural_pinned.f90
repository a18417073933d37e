!> Modes of a beam with a constraint at the stop, by the natural solver: a reference for constrained modes.
module natural_pinned
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use kinds, only: wp
   use mode_shapes, only: fix_mode_signs
   use natural_coordinates, only: find_flexibility, make_natural_beam, natural_beam_t
   use natural_solver, only: omit_direction, right_singular_vectors, shapes_from_vectors
   implicit none (type, external)
   private
   public :: natural_pinned_modes

contains

   !> The first lambda_i and mode shapes of the beam with the constraint y = 0 at the stop. The root must not be pinned.
   !>
   !> The constraint is c.q = 0 on the curvature coordinates, with c_j the displacement at the stop under coordinate j.
   !> A Householder reflection turns c into one coordinate axis, which is omitted. The reflection combines columns of
   !> different size, so on strongly graded meshes the high modes have fewer correct digits than those of the
   !> unconstrained beam. The slope of the tip is positive if the stop is at the tip, else its displacement.
   subroutine natural_pinned_modes(model, count, lambda, modes, error)
      type(beam_model_t), intent(in) :: model
      !> Number of modes, at most 2 n - 1
      integer, intent(in) :: count
      !> lambda_i, [count]
      real(wp), allocatable, intent(out) :: lambda(:)
      !> Mode shapes as columns, y and dy/dx of the nodes, unit modal mass, [2 n, count]
      real(wp), allocatable, intent(out) :: modes(:, :)
      !> Set if DGEJSV does not converge
      type(failure_t), allocatable, intent(out) :: error

      type(natural_beam_t) :: natural
      real(wp), allocatable :: flexibility(:, :), nodal(:, :), singular(:), vectors(:, :)
      integer :: sign_dof

      call make_natural_beam(model, natural)
      call find_flexibility(natural, flexibility, nodal)
      call omit_direction(nodal(model%stop_dof, :), flexibility, nodal)
      nodal(model%stop_dof, :) = 0.0_wp

      call right_singular_vectors(flexibility, .true., singular, vectors, error)
      if (allocated(error)) return
      allocate (lambda, source=1.0_wp/sqrt(singular(:count)))
      allocate (modes(natural%dofs, count))
      call shapes_from_vectors(model%mass, nodal, singular(:count), vectors(:, :count), modes, error)
      if (allocated(error)) return
      sign_dof = merge(model%tip_dof + 1, model%tip_dof, model%stop_dof == model%tip_dof)
      call fix_mode_signs(sign_dof, modes)
   end subroutine natural_pinned_modes

end module natural_pinned
