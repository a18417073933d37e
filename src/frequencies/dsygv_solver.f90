!> Frequencies by LAPACK's DSYGV on dense copies of (K, M), as Irie, Yamada and Asano (1977) have it.
!>
!> K is formed by cancellation and the small eigenvalues are the ones wanted, so digits are lost as
!> the mesh is refined: for what a mesh can give, see `natural_solver`.
module dsygv_solver
   use beam_model, only: beam_model_t, has_rigid_mode
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use lapack_interfaces, only: dsygv, lapack_message
   use mode_shapes, only: fix_mode_signs
   use natural_coordinates, only: deflect, deflect_transposed, make_natural_beam, natural_beam_t
   use skyline_matrix, only: skyline_t, to_dense
   implicit none (type, external)
   private
   public :: dsygv_modes

   !> Relative error of lambda_1 from which on the eigenvalues are refused.
   real(wp), parameter :: tolerated = 0.01_wp

contains

   !> The first lambda_i of the mesh, ascending, and the mode shapes where they are asked for.
   subroutine dsygv_modes(model, count, lambda, error, modes)
      type(beam_model_t), intent(in) :: model
      !> Number of modes, at most as many as there are
      integer, intent(in) :: count
      !> lambda_i, [count]
      real(wp), allocatable, intent(out) :: lambda(:)
      !> Set when DSYGV fails or its eigenvalues have lost all digits
      type(failure_t), allocatable, intent(out) :: error
      !> Shapes as columns, unit modal mass, positive tip, [2 n, count]
      real(wp), allocatable, intent(out), optional :: modes(:, :)

      real(wp), allocatable :: eigenvalue(:), mass(:, :), vectors(:, :), work(:)
      integer, allocatable :: free(:)
      character :: job
      real(wp) :: work_size(1)
      integer :: first, info, order

      allocate (free, source=free_dofs(model))
      order = size(free)
      job = merge('V', 'N', present(modes))
      if (count < 0 .or. count > order) then
         call fail(error, status_run_failed, 'DSYGV: more modes asked for than the mesh has')
         return
      end if
      allocate (vectors, source=rows_and_columns(model%stiffness, free))
      allocate (mass, source=rows_and_columns(model%mass, free))
      allocate (eigenvalue(order))
      call dsygv(1, job, 'U', order, vectors, order, mass, order, eigenvalue, work_size, -1, info)
      allocate (work(int(work_size(1))))
      call dsygv(1, job, 'U', order, vectors, order, mass, order, eigenvalue, work, size(work), info)
      if (info /= 0) then
         call fail(error, status_run_failed, lapack_message('DSYGV', info, order))
         return
      end if
      first = 1
      if (has_rigid_mode(model) .and. size(model%supports) == 0) then
         ! of the rotation about the root it has rounding alone
         first = 2
         eigenvalue(1) = 0.0_wp
      end if
      ! all comparisons are written so that a NaN is refused too
      if (.not. all(eigenvalue(first:count) > 0.0_wp .and. eigenvalue(first:count) <= huge(1.0_wp))) then
         call fail(error, status_run_failed, &
            'DSYGV: an eigenvalue of this mesh came out zero, negative or not finite; '// &
            'rounding has taken over, use another solver')
         return
      end if
      if (present(modes)) then
         if (.not. all(abs(vectors(:, :count)) <= huge(1.0_wp))) then
            call fail(error, status_run_failed, 'DSYGV: a mode shape of this mesh is not finite; use another solver')
            return
         end if
      end if
      allocate (lambda, source=sqrt(sqrt(eigenvalue(:count))))
      if (count >= first) then
         if (.not. is_sure(model, eigenvalue(first:))) then
            deallocate (lambda)
            call fail(error, status_run_failed, 'DSYGV: the first eigenvalue of this mesh has drowned in '// &
               'rounding, use another solver')
            return
         end if
      end if
      if (.not. present(modes)) return
      ! DSYGV's vectors have x^T M x = 1 already
      allocate (modes(model%stiffness%order, count), source=0.0_wp)
      modes(free, :) = vectors(:, :count)
      call fix_mode_signs(model%tip_dof, modes)
   end subroutine dsygv_modes

   !> The degrees of freedom that no rigid support holds.
   pure function free_dofs(model) result(free)
      type(beam_model_t), intent(in) :: model
      integer, allocatable :: free(:)

      integer :: i

      free = pack([(i, i=1, model%stiffness%order)], &
         [(all(model%supports%dof /= i .or. model%supports%stiffness > 0.0_wp), i=1, model%stiffness%order)])
   end function free_dofs

   !> Some rows and columns of a matrix.
   pure function rows_and_columns(matrix, kept) result(dense)
      type(skyline_t), intent(in) :: matrix
      integer, intent(in) :: kept(:)
      real(wp), allocatable :: dense(:, :)

      allocate (dense, source=to_dense(matrix))
      if (size(kept) < matrix%order) dense = dense(kept, kept)
   end function rows_and_columns

   !> Has the first eigenvalue kept a few digits? With supports or a root that turns freely only its error, of rounding
   !> in the greatest, is known.
   pure function is_sure(model, eigenvalue) result(answer)
      type(beam_model_t), intent(in) :: model
      !> lambda_i^4, all of them but that of a rotation about the root
      real(wp), intent(in) :: eigenvalue(:)
      logical :: answer

      if (size(model%supports) > 0 .or. has_rigid_mode(model)) then
         answer = epsilon(1.0_wp)*eigenvalue(size(eigenvalue)) <= 4.0_wp*tolerated*eigenvalue(1)
      else
         answer = abs(sqrt(sqrt(eigenvalue(1)))/lowest_lambda(model) - 1.0_wp) <= tolerated
      end if
   end function is_sure

   !> lambda_1 to a few digits by power iteration in element curvatures, where nothing cancels.
   pure function lowest_lambda(model) result(lambda)
      type(beam_model_t), intent(in) :: model
      real(wp) :: lambda

      type(natural_beam_t) :: natural
      real(wp), allocatable :: curvature(:), deflection(:)
      integer :: step

      call make_natural_beam(model, natural)
      allocate (curvature(natural%order), deflection(natural%rows))
      deflection = 1.0_wp
      do step = 1, 4
         call deflect_transposed(natural, deflection, curvature)
         call deflect(natural, curvature, deflection)
      end do
      lambda = sqrt(norm2(curvature)/norm2(deflection))
   end function lowest_lambda

end module dsygv_solver
