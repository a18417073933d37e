!> Frequencies by LAPACK's DSYGV on dense copies of (K, M), the eigenproblem of Irie, Yamada and Asano (1977).
!>
!> The lowest modes depend on the smallest eigenvalues of K, which the cancellation in its assembly changes by more the
!> finer the mesh is. The solver `natural_solver` does not lose these digits.
module dsygv_solver
   use beam_model, only: beam_model_t
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use lapack_interfaces, only: dsygv, lapack_message
   use mode_shapes, only: fix_mode_signs
   use natural_coordinates, only: deflect, deflect_transposed, make_natural_beam, natural_beam_t
   use skyline_matrix, only: skyline_t, to_dense
   implicit none (type, external)
   private
   public :: dsygv_modes

   !> Maximum relative error of lambda_1; eigenvalues with a larger error are refused.
   real(wp), parameter :: max_error = 0.01_wp

contains

   !> The first lambda_i of the mesh, ascending, and the mode shapes if requested.
   subroutine dsygv_modes(model, count, lambda, error, modes)
      type(beam_model_t), intent(in) :: model
      !> Number of modes, at most the number of degrees of freedom
      integer, intent(in) :: count
      !> lambda_i, [count]
      real(wp), allocatable, intent(out) :: lambda(:)
      !> Set if DSYGV fails or its eigenvalues have lost all digits
      type(failure_t), allocatable, intent(out) :: error
      !> Mode shapes as columns, unit modal mass, positive displacement of the tip, [2 n, count]
      real(wp), allocatable, intent(out), optional :: modes(:, :)

      real(wp), allocatable :: eigenvalue(:), mass(:, :), vectors(:, :), work(:)
      integer, allocatable :: free(:)
      character :: job
      real(wp) :: work_size(1)
      integer :: first, info, order

      ! degrees of freedom that no rigid support constrains
      free = pack([(first, first=1, model%stiffness%order)], [(all(model%supports%dof /= first .or. &
         model%supports%stiffness > 0.0_wp), first=1, model%stiffness%order)])
      order = size(free)
      job = merge('V', 'N', present(modes))
      if (count < 0 .or. count > order) then
         call fail(error, status_run_failed, 'DSYGV: more modes requested than the mesh has')
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
      if (model%root%is_pinned .and. size(model%supports) == 0) then
         ! the eigenvalue of the rigid-body rotation about the root is 0, but DSYGV returns rounding errors
         first = 2
         eigenvalue(1) = 0.0_wp
      end if
      ! the comparisons are written so that NaN is refused
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
         if (.not. is_accurate(model, eigenvalue(first:))) then
            deallocate (lambda)
            call fail(error, status_run_failed, 'DSYGV: the first eigenvalue of this mesh is lost in '// &
               'rounding, use another solver')
            return
         end if
      end if
      if (.not. present(modes)) return
      ! the vectors of DSYGV satisfy x^T M x = 1
      allocate (modes(model%stiffness%order, count), source=0.0_wp)
      modes(free, :) = vectors(:, :count)
      call fix_mode_signs(model%tip_dof, modes)
   end subroutine dsygv_modes

   !> Selected rows and columns of a matrix.
   pure function rows_and_columns(matrix, selected) result(dense)
      type(skyline_t), intent(in) :: matrix
      integer, intent(in) :: selected(:)
      real(wp), allocatable :: dense(:, :)

      allocate (dense, source=to_dense(matrix))
      if (size(selected) < matrix%order) dense = dense(selected, selected)
   end function rows_and_columns

   !> Whether the first eigenvalue is accurate to `max_error`. With supports or a pinned root the error is estimated by
   !> the rounding of the largest eigenvalue; otherwise the eigenvalue is compared with `lowest_lambda`.
   pure logical function is_accurate(model, eigenvalue) result(answer)
      type(beam_model_t), intent(in) :: model
      !> All lambda_i^4 except that of a rigid-body rotation about the root
      real(wp), intent(in) :: eigenvalue(:)

      if (size(model%supports) > 0 .or. model%root%is_pinned) then
         ! the relative error of lambda^4 is four times that of lambda
         answer = epsilon(1.0_wp)*eigenvalue(size(eigenvalue)) <= 4.0_wp*max_error*eigenvalue(1)
      else
         answer = abs(sqrt(sqrt(eigenvalue(1)))/lowest_lambda(model) - 1.0_wp) <= max_error
      end if
   end function is_accurate

   !> Estimate of lambda_1 with a few digits by power iteration in element curvatures, which has no cancellation.
   pure real(wp) function lowest_lambda(model) result(lambda)
      type(beam_model_t), intent(in) :: model

      type(natural_beam_t) :: natural
      real(wp), allocatable :: curvature(:), deflection(:)
      integer :: step

      call make_natural_beam(model, natural)
      allocate (curvature(natural%order), deflection(natural%rows))
      deflection = 1.0_wp
      ! four steps suffice for an error well below `max_error`
      do step = 1, 4
         call deflect_transposed(natural, deflection, curvature)
         call deflect(natural, curvature, deflection)
      end do
      lambda = sqrt(norm2(curvature)/norm2(deflection))
   end function lowest_lambda

end module dsygv_solver
