!> The few lowest frequencies and modes of a mesh of n elements in O(n) operations, by Lanczos iteration on K^-1 M in
!> element curvatures. In these coordinates q (`support_coordinates`) the strain energy is q.q/2 and the kinetic energy
!> |B dq/dt|^2/2, so that K^-1 M is B^T B: a step takes two sums along the beam, without factorisation and without
!> cancellation.
!>
!> Every Lanczos vector is orthogonalised against all earlier vectors. The small eigenvalues of the tridiagonal matrix
!> have the rounding error of the largest. Modes whose eigenvalue is too small relative to the first are therefore
!> computed by a further iteration, orthogonal to the modes found; and frequencies are Rayleigh quotients of modes that
!> have been orthogonalised in the mass product in ascending order.
!>
!> Each mode must pass a residual test, and no mode may be missed: mode i has i - 1 sign changes along the beam, if its
!> sign is reversed at each rigid support (Gantmacher and Krein, Oscillation Matrices). If a coarse mesh or other
!> supports do not show these sign changes, K - sigma M must have the right number of negative pivots (`mode_count`).
module lanczos_solver
   use beam_model, only: beam_model_t, is_mechanism
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use lapack_interfaces, only: dgemm, dgemv, dpotrf, dstevd, dtrsm, lapack_message
   use mode_count, only: modes_below
   use mode_shapes, only: fix_mode_signs, sign_changes
   use number_text, only: to_text
   use pinned_coordinates, only: rigid_rotation
   use support_coordinates, only: bend, bend_transposed, displace, supported_beam_t, make_supported_beam
   implicit none (type, external)
   private
   public :: lanczos_modes, lanczos_vectors, lambda_of, orthogonalise

   !> Relative residual at which a mode has converged, estimated from the tridiagonal matrix.
   real(wp), parameter :: convergence = 1.0e-11_wp
   !> Minimum eigenvalue that one iteration resolves, relative to its first eigenvalue.
   real(wp), parameter :: resolution = 1.0e-6_wp
   !> Maximum relative residual of B^T B v = lambda^-4 v of a final mode. The relative error of lambda is of the order
   !> of its square.
   real(wp), parameter :: residual_limit = 1.0e-8_wp
   !> Maximum number of steps before the first convergence test.
   integer, parameter :: max_first_test = 36
   !> Relative distance below the highest mode found at which modes are counted. The distance exceeds rounding, and a
   !> missed mode within this distance would have practically the same frequency.
   real(wp), parameter :: count_margin = 1.0e-9_wp
   !> Maximum number of elements for which the dense solver takes minutes at most; a message recommends this solver only
   !> for such meshes.
   integer, parameter :: max_recommended_elements = 2048

contains

   !> The first lambda_i of the mesh on its supports, ascending, and the mode shapes if requested.
   subroutine lanczos_modes(model, count, lambda, error, modes)
      type(beam_model_t), intent(in) :: model
      !> Number of modes, at most n
      integer, intent(in) :: count
      !> lambda_i, [count]
      real(wp), allocatable, intent(out) :: lambda(:)
      !> Set if a mode does not converge or is missed
      type(failure_t), allocatable, intent(out) :: error
      !> Mode shapes as columns, y and dy/dx of the nodes, unit modal mass, positive displacement of the tip, [degrees
      !> of freedom, count]
      real(wp), allocatable, intent(out), optional :: modes(:, :)

      type(supported_beam_t) :: beam
      real(wp), allocatable :: deflection(:, :), direction(:), vectors(:, :)
      integer :: mode, rigid

      if (count < 0 .or. count > model%mesh%elements) then
         call fail(error, status_run_failed, 'Lanczos: it finds at most as many modes as the mesh has elements')
         return
      end if
      call make_supported_beam(model, beam)
      rigid = merge(1, 0, is_mechanism(model) .and. count > 0)
      call lanczos_vectors(model, beam, count - rigid, vectors, deflection, error)
      if (allocated(error)) then
         error%message = error%message//remedy(model)
         return
      end if
      allocate (lambda(count), source=0.0_wp)
      lambda(rigid + 1:) = lambda_of(vectors, deflection)
      if (.not. present(modes)) return
      allocate (modes(beam%dofs, count))
      if (rigid > 0) then
         allocate (direction(beam%rows))
         call rigid_rotation(beam%natural, direction, modes(:, 1))
      end if
      do mode = rigid + 1, count
         call displace(beam, vectors(:, mode - rigid), modes(:, mode))
      end do
      call fix_mode_signs(model%tip_dof, modes)
   end subroutine lanczos_modes

   !> Advice to a user whose frequencies are not found.
   pure function remedy(model) result(words)
      type(beam_model_t), intent(in) :: model
      character(:), allocatable :: words

      words = '; '
      if (model%mesh%elements <= max_recommended_elements) words = "; solver = 'natural' finds all; or "
      words = words//'ask for fewer (count), or '
      associate (length => model%mesh%length)
         if (maxval(length) > (1.0_wp + count_margin)*minval(length)) then
            words = words//'bring the mesh ratio nearer to 1'
         else
            words = words//'take fewer elements'
         end if
      end associate
   end function remedy

   !> The modes with strain energy in the coordinates of the beam, in ascending order.
   subroutine lanczos_vectors(model, beam, count, vectors, deflection, error)
      type(beam_model_t), intent(in) :: model
      !> The beam in element curvatures
      type(supported_beam_t), intent(in) :: beam
      !> Number of modes
      integer, intent(in) :: count
      !> Modes of unit modal mass, [order, count]
      real(wp), allocatable, intent(out) :: vectors(:, :)
      !> B times the vectors, [rows, count]
      real(wp), allocatable, intent(out) :: deflection(:, :)
      !> Set if a mode does not converge or is missed
      type(failure_t), allocatable, intent(out) :: error

      real(wp) :: lambda(count)
      integer :: found

      allocate (vectors(beam%order, count), deflection(beam%rows, count))
      found = 0
      do while (found < count)
         call find_further_modes(beam, found, vectors, error)
         if (allocated(error)) return
         call refine(beam, vectors(:, :found), deflection(:, :found), error)
         if (allocated(error)) return
      end do
      if (count == 0) return
      lambda = lambda_of(vectors, deflection)
      call check_residuals(beam, lambda, vectors, deflection, error)
      if (allocated(error)) return
      call check_none_missed(model, beam, lambda, deflection, error)
   end subroutine lanczos_vectors

   !> Values lambda of vectors by Rayleigh quotients of strain energy and kinetic energy.
   pure function lambda_of(vectors, deflection) result(lambda)
      !> Vectors, [order, count]
      real(wp), intent(in) :: vectors(:, :)
      !> B times the vectors, [rows, count]
      real(wp), intent(in) :: deflection(:, :)
      real(wp) :: lambda(size(vectors, 2))

      integer :: mode

      do mode = 1, size(lambda)
         lambda(mode) = (sum_of_squares(vectors(:, mode))/sum_of_squares(deflection(:, mode)))**0.25_wp
      end do
   end function lambda_of

   !> Find further modes by Lanczos steps on B^T B orthogonal to the vectors found.
   subroutine find_further_modes(beam, found, vectors, error)
      type(supported_beam_t), intent(in) :: beam
      !> Number of vectors found; larger on return
      integer, intent(inout) :: found
      !> Vectors as columns, in ascending order of frequency, [order, wanted]
      real(wp), intent(inout) :: vectors(:, :)
      !> Set if no further vector converges
      type(failure_t), allocatable, intent(out) :: error

      real(wp), allocatable :: basis(:, :), deflection(:), diagonal(:), off_diagonal(:), eigenvectors(:, :)
      real(wp) :: previous
      integer :: limit, next_test, order, column, converged, step, wanted
      logical :: finished, is_complete

      order = size(vectors, 1)
      wanted = size(vectors, 2) - found
      ! empirical limit of the number of steps; the iteration ends when the modes have converged
      limit = min(beam%free - found, 6*wanted + 60)
      allocate (basis(order, found + limit + 1), deflection(beam%rows))
      allocate (diagonal(limit), off_diagonal(limit), eigenvectors(limit, wanted))
      do column = 1, found
         basis(:, column) = vectors(:, column)/norm2(vectors(:, column))
      end do
      call start_vector(beam, deflection, basis(:, :found + 1))

      previous = 0.0_wp
      converged = 0
      next_test = min(2*wanted, max_first_test)
      do step = 1, limit
         column = found + step
         associate (next => basis(:, column + 1))
            call bend(beam, basis(:, column), deflection)
            call bend_transposed(beam, deflection, next)
            call project_out(basis(:, :column), previous, next, diagonal(step), off_diagonal(step))
            previous = off_diagonal(step)
            finished = step == limit .or. off_diagonal(step) <= epsilon(1.0_wp)*maxval(diagonal(:step))
            if (step == next_test .or. finished) then
               call test_convergence(diagonal(:step), off_diagonal(:step), eigenvectors(:step, :), converged, &
                  is_complete, error)
               if (allocated(error)) return
               if (is_complete .or. finished) exit
               next_test = step + max(4, step/16)
            end if
         end associate
      end do
      if (converged == 0) then
         call fail(error, status_run_failed, 'Lanczos: of '//to_text(size(vectors, 2))//' modes '// &
            to_text(found)//' converge: the others are lost in rounding')
         return
      end if
      step = column - found
      call dgemm('N', 'N', order, converged, step, 1.0_wp, basis(:, found + 1:column), order, eigenvectors, limit, &
         0.0_wp, vectors(:, found + 1:found + converged), order)
      found = found + converged
   end subroutine find_further_modes

   !> Subtract from w its components along the columns of Q. The components along the last two columns are by far the
   !> largest; if they are subtracted first, one pass over all columns leaves only rounding errors.
   subroutine project_out(basis, previous, vector, diagonal, off_diagonal)
      !> Q, orthonormal columns, [order, m]
      real(wp), contiguous, intent(in) :: basis(:, :)
      !> Previous off-diagonal entry
      real(wp), intent(in) :: previous
      !> w on entry; its part orthogonal to Q, normalised, on return, [order]
      real(wp), intent(inout) :: vector(:)
      !> Component along the last column
      real(wp), intent(out) :: diagonal
      !> Length of the orthogonal part
      real(wp), intent(out) :: off_diagonal

      real(wp) :: coefficient(size(basis, 2))
      integer :: m, order

      order = size(basis, 1)
      m = size(basis, 2)
      diagonal = dot_product(basis(:, m), vector)
      vector = vector - diagonal*basis(:, m)
      if (m > 1) vector = vector - previous*basis(:, m - 1)
      call dgemv('T', order, m, 1.0_wp, basis, order, vector, 1, 0.0_wp, coefficient, 1)
      call dgemv('N', order, m, -1.0_wp, basis, order, coefficient, 1, 1.0_wp, vector, 1)
      off_diagonal = norm2(vector)
      if (off_diagonal > 0.0_wp) vector = vector/off_diagonal
   end subroutine project_out

   !> Start vector with components along all modes: the curvatures under point forces of varying sign, which are smooth.
   subroutine start_vector(beam, forces, basis)
      type(supported_beam_t), intent(in) :: beam
      !> Workspace, [rows]
      real(wp), intent(inout) :: forces(:)
      !> Vectors found, then the start vector, which is orthogonal to them and normalised, [order, found + 1]
      real(wp), intent(inout) :: basis(:, :)

      real(wp), parameter :: golden = 0.61803398874989485_wp
      integer :: i, row

      ! multiples of the golden ratio modulo 1 are irregular numbers that are the same in every run
      do row = 1, size(forces)
         forces(row) = modulo(golden*real(row, wp), 1.0_wp) - 0.3_wp
      end do
      associate (vector => basis(:, size(basis, 2)))
         call bend_transposed(beam, forces, vector)
         vector = vector/norm2(vector)
         do i = 1, size(basis, 2) - 1
            vector = vector - dot_product(basis(:, i), vector)*basis(:, i)
         end do
         vector = vector/norm2(vector)
      end associate
   end subroutine start_vector

   !> Number of the largest eigenvalues of the tridiagonal matrix that have converged. The residual of a Ritz vector is
   !> the last off-diagonal entry times the last entry of the eigenvector of the tridiagonal matrix.
   subroutine test_convergence(diagonal, off_diagonal, eigenvectors, converged, finished, error)
      !> Diagonal, [m]
      real(wp), intent(in) :: diagonal(:)
      !> Off-diagonal, whose last entry belongs to the next step, [m]
      real(wp), intent(in) :: off_diagonal(:)
      !> Eigenvectors of the tridiagonal matrix for its largest eigenvalues, descending, [m, wanted]
      real(wp), intent(inout) :: eigenvectors(:, :)
      !> Number of converged eigenvalues, counted from the largest without a gap
      integer, intent(out) :: converged
      !> Whether all eigenvalues have converged or the next eigenvalue is too small to be resolved
      logical, intent(out) :: finished
      !> Set if DSTEVD fails
      type(failure_t), allocatable, intent(out) :: error

      real(wp), allocatable :: all_vectors(:, :), off_copy(:), value(:), work(:)
      integer, allocatable :: integer_work(:)
      integer :: info, m, column

      m = size(diagonal)
      converged = 0
      finished = .false.
      allocate (value, source=diagonal)
      allocate (off_copy, source=off_diagonal)
      allocate (all_vectors(m, m), work(1 + 4*m + m**2), integer_work(3 + 5*m))
      call dstevd('V', m, value, off_copy, all_vectors, m, work, size(work), integer_work, size(integer_work), info)
      if (info /= 0) then
         call fail(error, status_run_failed, lapack_message('DSTEVD', info, m))
         return
      end if
      do while (converged < min(size(eigenvectors, 2), m))
         column = m - converged
         finished = value(column) < resolution*value(m)
         if (finished) return
         if (.not. abs(off_diagonal(m)*all_vectors(m, column)) <= convergence*value(column)) return
         converged = converged + 1
         eigenvectors(:, converged) = all_vectors(:, column)
      end do
      finished = .true.
   end subroutine test_convergence

   !> Orthogonalise the vectors in the mass product in ascending order, which removes rounding errors along lower modes;
   !> then apply B^T B once, which reduces rounding errors along higher modes.
   subroutine refine(beam, vectors, deflection, error)
      type(supported_beam_t), intent(in) :: beam
      !> Vectors, of unit modal mass on return, [order, count]
      real(wp), intent(inout) :: vectors(:, :)
      !> B times the vectors, [rows, count]
      real(wp), intent(inout) :: deflection(:, :)
      !> Set if the vectors are linearly dependent
      type(failure_t), allocatable, intent(out) :: error

      integer :: mode, pass

      do pass = 1, 2
         do mode = 1, size(vectors, 2)
            if (pass == 2) call bend_transposed(beam, deflection(:, mode), vectors(:, mode))
            call bend(beam, vectors(:, mode), deflection(:, mode))
         end do
         call orthogonalise(vectors, deflection, error)
         if (allocated(error)) return
      end do
   end subroutine refine

   !> Orthogonalise vectors in the mass product in ascending order by the Cholesky factor of their modal mass matrix.
   subroutine orthogonalise(vectors, deflection, error)
      !> Vectors, [order, count]
      real(wp), intent(inout) :: vectors(:, :)
      !> B times the vectors, [rows, count]
      real(wp), intent(inout) :: deflection(:, :)
      !> Set if the vectors are linearly dependent
      type(failure_t), allocatable, intent(out) :: error

      real(wp) :: modal_mass(size(vectors, 2), size(vectors, 2))
      integer :: count, info, order, rows

      order = size(vectors, 1)
      count = size(vectors, 2)
      rows = size(deflection, 1)
      call dgemm('T', 'N', count, count, rows, 1.0_wp, deflection, rows, deflection, rows, 0.0_wp, modal_mass, count)
      call dpotrf('U', count, modal_mass, count, info)
      if (info /= 0) then
         call fail(error, status_run_failed, lapack_message('DPOTRF', info, count))
         return
      end if
      call dtrsm('R', 'U', 'N', 'N', order, count, 1.0_wp, modal_mass, count, vectors, order)
      call dtrsm('R', 'U', 'N', 'N', rows, count, 1.0_wp, modal_mass, count, deflection, rows)
   end subroutine orthogonalise

   !> Sum of squares in blocks, so that rounding errors do not grow with the number of terms.
   pure real(wp) function sum_of_squares(values) result(total)
      real(wp), intent(in) :: values(:)

      integer, parameter :: block = 512
      real(wp), allocatable :: block_sum(:)
      integer :: i

      allocate (block_sum((size(values) + block - 1)/block))
      do i = 1, size(block_sum)
         block_sum(i) = sum(values((i - 1)*block + 1:min(i*block, size(values)))**2)
      end do
      total = sum(block_sum)
   end function sum_of_squares

   !> Check that each mode satisfies its eigenvalue equation: |B^T B v - lambda^-4 v| is small relative to lambda^-4
   !> |v|.
   subroutine check_residuals(beam, lambda, vectors, deflection, error)
      type(supported_beam_t), intent(in) :: beam
      !> lambda_i, [count]
      real(wp), intent(in) :: lambda(:)
      !> Vectors, [order, count]
      real(wp), intent(in) :: vectors(:, :)
      !> B times the vectors, [rows, count]
      real(wp), intent(in) :: deflection(:, :)
      !> Set if a mode fails the check
      type(failure_t), allocatable, intent(out) :: error

      real(wp), allocatable :: product(:)
      real(wp) :: residual
      character(80) :: numbers
      integer :: mode

      allocate (product(size(vectors, 1)))
      do mode = 1, size(lambda)
         call bend_transposed(beam, deflection(:, mode), product)
         residual = norm2(product*lambda(mode)**4 - vectors(:, mode))/norm2(vectors(:, mode))
         if (.not. residual <= residual_limit) then
            write (numbers, '(a,i0,a,es9.2)') 'mode ', mode, ' has a residual of ', residual
            call fail(error, status_run_failed, 'Lanczos: '//trim(numbers))
            return
         end if
      end do
   end subroutine check_residuals

   !> Sign factors that reverse a mode at each rigid support, one for each displacement along the beam, in the order of
   !> the rows of B. The row of the tip mass is left out if there are supports, which may constrain the tip.
   pure function sign_factors(model, beam) result(sign_factor)
      type(beam_model_t), intent(in) :: model
      type(supported_beam_t), intent(in) :: beam
      real(wp), allocatable :: sign_factor(:)

      integer :: i, last

      associate (natural => beam%natural)
         last = natural%beam_rows
         if (size(model%supports) > 0) last = natural%last_row(natural%elements)
         allocate (sign_factor(last), source=1.0_wp)
         do i = 1, size(beam%supported)
            ! a second support at the same degree of freedom has no effect
            if (any(beam%supported(:i - 1) == beam%supported(i))) cycle
            associate (first_row => natural%last_row((beam%supported(i) + 1)/2) + 1)
               sign_factor(first_row:) = -sign_factor(first_row:)
            end associate
         end do
      end associate
   end function sign_factors

   !> Check that no mode is missed: mode i has i - 1 sign changes, or, if a coarse mesh or supports prevent this test,
   !> the number of modes below the highest mode agrees with the number found.
   subroutine check_none_missed(model, beam, lambda, deflection, error)
      type(beam_model_t), intent(in) :: model
      !> The beam in element curvatures
      type(supported_beam_t), intent(in) :: beam
      !> lambda_i of the modes with strain energy, [count]
      real(wp), intent(in) :: lambda(:)
      !> B times the modes, [rows, count]
      real(wp), intent(in) :: deflection(:, :)
      !> Set if a mode has been missed
      type(failure_t), allocatable, intent(out) :: error

      real(wp), allocatable :: sign_factor(:)
      real(wp) :: highest
      integer :: below, found, mode, rigid
      logical :: complete

      ! a rotary inertia, a spring or a constrained slope may add a sign change
      complete = .not. any(model%point_masses%rotary_inertia > 0.0_wp) .and. &
         .not. any(model%supports%stiffness > 0.0_wp .or. modulo(model%supports%dof, 2) == 0)
      allocate (sign_factor, source=sign_factors(model, beam))
      rigid = merge(1, 0, is_mechanism(model))
      do mode = 1, size(lambda)
         complete = complete .and. sign_changes(sign_factor*deflection(:size(sign_factor), mode)) == mode - 1 + rigid
      end do
      if (complete) return
      highest = maxval(lambda)*(1.0_wp - count_margin)
      found = count(lambda < highest)
      below = modes_below(model, highest) - rigid
      if (below == found) return
      call fail(error, status_run_failed, 'Lanczos: '//to_text(found)//' modes were found where '//to_text(below) &
         //' are')
   end subroutine check_none_missed

end module lanczos_solver
