!> Frequencies and modes of a mesh of n elements to full double precision, from the singular values of the mass-weighted
!> flexibility matrix B in element curvatures (`natural_coordinates`), by LAPACK's DGEJSV.
!>
!> The Jacobi rotations of DGEJSV are insensitive to the scaling of columns. The usual DGESDD is four times as fast, but
!> under a heavy tip mass or with short elements at the clamp loses digits of the highest modes (n = 16: relative error
!> 2e-13 for a tip mass of 1e6 rho Abar L, 2e-12 for a length ratio of 0.7; with DGEJSV at most 1e-14).
module natural_solver
   use beam_model, only: beam_model_t
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use lapack_interfaces, only: dgemm, dpotrf, dtrsm, lapack_message
   use mode_shapes, only: fix_mode_signs
   use natural_coordinates, only: coordinates_of_shape, find_flexibility, make_natural_beam, natural_beam_t, &
      rows_of_unit_displacement
   use pinned_coordinates, only: pinned_flexibility, rigid_rotation, remove_rotation
   use singular_vectors, only: find_singular
   use skyline_matrix, only: multiply, skyline_t
   implicit none (type, external)
   private
   public :: natural_modes, omit_direction, right_singular_vectors, shapes_from_vectors

contains

   !> The first lambda_i of the mesh, ascending, and the mode shapes if requested.
   !>
   !> A massless node at the stop adds no mode, because the motion of this node alone has strain energy but no kinetic
   !> energy. This motion is orthogonal in K to all modes and is removed by `omit_direction`. Only the coordinates of
   !> the two adjacent elements take part in the reflection, so no accuracy is lost.
   subroutine natural_modes(model, count, lambda, error, modes)
      type(beam_model_t), intent(in) :: model
      !> Number of modes, at most the number of modes of the mesh
      integer, intent(in) :: count
      !> lambda_i, [count]
      real(wp), allocatable, intent(out) :: lambda(:)
      !> Set if more modes are requested than the mesh has, or DGEJSV does not converge
      type(failure_t), allocatable, intent(out) :: error
      !> Mode shapes as columns, y and dy/dx of the nodes, unit modal mass, positive displacement of the tip, [order of
      !> the model, count]
      real(wp), allocatable, intent(out), optional :: modes(:, :)

      type(natural_beam_t) :: natural
      real(wp), allocatable :: flexibility(:, :), nodal(:, :), singular(:), unit(:), vectors(:, :)
      ! number of modes with strain energy
      integer :: bending
      ! number of rigid-body modes
      integer :: rigid

      call make_natural_beam(model, natural)
      if (count < 0 .or. count > model%stiffness%order - merge(1, 0, model%has_massless_node)) then
         call fail(error, status_run_failed, 'natural solver: more modes requested than the mesh has')
         return
      end if
      rigid = merge(1, 0, model%root%is_pinned .and. count > 0)
      bending = count - rigid
      if (model%root%is_pinned) then
         call pinned_flexibility(natural, flexibility, nodal)
      else
         call find_flexibility(natural, flexibility, nodal)
      end if
      if (model%is_redistributed) call continue_displacement(model, natural, nodal, flexibility)
      if (model%root%is_pinned) call remove_rotation(natural, flexibility, nodal)
      if (model%has_massless_node) then
         allocate (unit(natural%dofs), source=0.0_wp)
         unit(2*model%mesh%redistributed_node - 1) = 1.0_wp
         call omit_direction(coordinates_of_shape(natural, unit), flexibility, nodal)
      end if
      call right_singular_vectors(flexibility, present(modes), singular, vectors, error)
      if (allocated(error)) return
      allocate (lambda(count), source=0.0_wp)
      lambda(rigid + 1:) = 1.0_wp/sqrt(singular(:bending))
      if (.not. present(modes)) return
      allocate (modes(natural%dofs, count))
      if (rigid > 0) call rigid_rotation(natural, flexibility(:, 1), modes(:, 1))
      call shapes_from_vectors(model%mass, nodal, singular(:bending), vectors(:, :bending), modes, error)
      if (allocated(error)) return
      call fix_mode_signs(model%tip_dof, modes)
   end subroutine natural_modes

   !> Replace the displacement of the node at the stop in B by its continuation, which is interpolated from neighbouring
   !> nodes (`redistributed_mass`).
   pure subroutine continue_displacement(model, natural, nodal, flexibility)
      type(beam_model_t), intent(in) :: model
      !> The beam in its element curvatures
      type(natural_beam_t), intent(in) :: natural
      !> N: y and dy/dx of the nodes under each coordinate, [order of M, columns]
      real(wp), intent(in) :: nodal(:, :)
      !> B, [rows, 2 n]
      real(wp), intent(inout) :: flexibility(:, :)

      real(wp) :: change(size(nodal, 2)), shape(natural%rows)
      integer :: i

      change = -nodal(2*model%mesh%redistributed_node - 1, :)
      associate (continuation => model%continuation)
         do i = 1, size(continuation%dof)
            if (continuation%dof(i) > 0) change = change + continuation%weight(i)*nodal(continuation%dof(i), :)
         end do
      end associate
      shape = rows_of_unit_displacement(natural, model%mesh%redistributed_node)
      do i = 1, size(change)
         flexibility(:, i) = flexibility(:, i) + shape*change(i)
      end do
   end subroutine continue_displacement

   !> Reflect the coordinates so that a given direction becomes a coordinate axis, and omit this coordinate.
   pure subroutine omit_direction(direction, flexibility, nodal)
      !> Direction that is omitted, in the coordinates
      real(wp), intent(in) :: direction(:)
      !> Matrices with a column for each coordinate; one column fewer on return
      real(wp), allocatable, intent(inout) :: flexibility(:, :)
      real(wp), allocatable, intent(inout) :: nodal(:, :)

      real(wp) :: axis(size(direction))
      integer :: pivot

      pivot = maxloc(abs(direction), dim=1)
      axis = direction
      axis(pivot) = axis(pivot) + sign(norm2(axis), axis(pivot))
      axis = axis/norm2(axis)
      call reflect_and_omit(flexibility, axis, pivot)
      call reflect_and_omit(nodal, axis, pivot)
   end subroutine omit_direction

   !> Replace a matrix by matrix (I - 2 a a^T) without its column `pivot`.
   pure subroutine reflect_and_omit(matrix, axis, pivot)
      !> Matrix, one column fewer on return
      real(wp), allocatable, intent(inout) :: matrix(:, :)
      !> Unit vector a
      real(wp), intent(in) :: axis(:)
      !> Column that is omitted
      integer, intent(in) :: pivot

      real(wp), allocatable :: reduced(:, :)
      real(wp) :: projection(size(matrix, 1))
      integer :: column, new_column

      projection = 2.0_wp*matmul(matrix, axis)
      allocate (reduced(size(matrix, 1), size(matrix, 2) - 1))
      new_column = 0
      do column = 1, size(matrix, 2)
         if (column == pivot) cycle
         new_column = new_column + 1
         reduced(:, new_column) = matrix(:, column) - projection*axis(column)
      end do
      call move_alloc(reduced, matrix)
   end subroutine reflect_and_omit

   !> Singular values, descending, and right singular vectors of a matrix with at least as many rows as columns.
   subroutine right_singular_vectors(matrix, with_vectors, singular, vectors, error)
      !> Matrix, [rows, columns]
      real(wp), intent(in) :: matrix(:, :)
      !> Whether to compute the singular vectors
      logical, intent(in) :: with_vectors
      !> Singular values, [columns]
      real(wp), allocatable, intent(out) :: singular(:)
      !> Right singular vectors as columns, [columns, columns]; [1, 1] if not requested
      real(wp), allocatable, intent(out) :: vectors(:, :)
      !> Set if DGEJSV does not converge
      type(failure_t), allocatable, intent(out) :: error

      integer :: info

      call find_singular(matrix, with_vectors, singular, vectors, info)
      if (info /= 0) then
         call fail(error, status_run_failed, lapack_message('DGEJSV', info, size(matrix, 2)))
      else if (.not. all(singular > 0.0_wp)) then
         call fail(error, status_run_failed, 'the mesh is too uneven: some of its modes vanish in double precision')
      end if
   end subroutine right_singular_vectors

   !> Mode shapes from right singular vectors, y = N v/s. Rounding errors of v along lower modes grow by the squared
   !> ratio of the frequencies. They are removed by orthogonalising the shapes in M in ascending order, with the
   !> Cholesky factor of their modal mass matrix.
   subroutine shapes_from_vectors(mass, nodal, singular, vectors, modes, error)
      !> Mass matrix M
      type(skyline_t), intent(in) :: mass
      !> N: y and dy/dx of the nodes under each coordinate, [order of M, columns]
      real(wp), intent(in) :: nodal(:, :)
      !> Singular values of the modes with strain energy, [bending]
      real(wp), intent(in) :: singular(:)
      !> Right singular vectors, [columns, bending]
      real(wp), intent(in) :: vectors(:, :)
      !> Mode shapes of unit modal mass as columns, [order of M, count]. If there is one shape more than vectors, the
      !> first is a given rigid-body mode
      real(wp), intent(inout) :: modes(:, :)
      !> Set if the shapes are linearly dependent
      type(failure_t), allocatable, intent(out) :: error

      real(wp), allocatable :: inertia_force(:, :), modal_mass(:, :)
      integer :: bending, columns, count, first, info, mode, order

      order = size(nodal, 1)
      columns = size(nodal, 2)
      count = size(modes, 2)
      bending = size(singular)
      first = count - bending + 1
      if (count == 0) return
      allocate (inertia_force(order, count), modal_mass(count, count))
      if (bending > 0) call dgemm('N', 'N', order, bending, columns, 1.0_wp, nodal, order, vectors, columns, 0.0_wp, &
         modes(:, first:), order)
      do mode = 1, count
         if (mode >= first) modes(:, mode) = modes(:, mode)/singular(mode - first + 1)
         call multiply(mass, modes(:, mode), inertia_force(:, mode))
      end do
      call dgemm('T', 'N', count, count, order, 1.0_wp, modes, order, inertia_force, order, 0.0_wp, modal_mass, count)
      call dpotrf('U', count, modal_mass, count, info)
      if (info /= 0) then
         call fail(error, status_run_failed, lapack_message('DPOTRF', info, count))
         return
      end if
      call dtrsm('R', 'U', 'N', 'N', order, count, 1.0_wp, modal_mass, count, modes, order)
   end subroutine shapes_from_vectors

end module natural_solver
