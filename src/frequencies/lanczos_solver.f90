!> The few lowest frequencies and modes of a large mesh in O(n): Lanczos iteration on K^-1 M in
!> element curvatures, where it is B^T B (`support_coordinates`): two sums along the beam a step,
!> no factorisation and no cancellation.
!>
!> Every vector is orthogonalised against all before it. The tridiagonal matrix gives its small
!> values only to the rounding of the largest. So modes whose value is too small beside the first
!> are left to another iteration, orthogonal to those found; and frequencies are Rayleigh quotients
!> of modes that have been orthogonalised in the mass product from low to high.
!>
!> Each mode must pass a residual test, and none may be missed: mode i changes its sign i - 1 times
!> along the beam, if it is turned over at each point that is held (Gantmacher and Krein, Oscillation
!> Matrices); where a coarse mesh or other supports do not show that, K - sigma M must have the right
!> number of negative pivots (`mode_count`).
module lanczos_solver
   use beam_model, only: beam_model_t, is_mechanism
   use failures, only: fail, failure_t, status_run_failed
   use support_coordinates, only: bend, bend_transposed, displace, supported_beam_t, make_supported_beam
   use kinds, only: wp
   use lapack_interfaces, only: dgemm, dgemv, dpotrf, dstevd, dtrsm, lapack_message
   use mode_count, only: modes_below
   use mode_shapes, only: fix_mode_signs, sign_changes
   use number_text, only: to_text
   use pinned_coordinates, only: rigid_rotation
   implicit none (type, external)
   private
   public :: lanczos_modes, lanczos_vectors, lambda_of, orthogonalise

   !> Relative residual at which a mode has converged, by the estimate from the tridiagonal matrix.
   real(wp), parameter :: convergence = 1.0e-11_wp
   !> Smallest value, beside the first, that one iteration is trusted to resolve.
   real(wp), parameter :: resolution = 1.0e-6_wp
   !> Relative residual of B^T B v = lambda^-4 v that a mode may have at the end: lambda then is wrong
   !> by its square.
   real(wp), parameter :: residual_limit = 1.0e-8_wp
   !> Steps after which the tridiagonal matrix is looked at, at the latest.
   integer, parameter :: least_steps = 36
   !> Relative distance below the highest mode found at which modes are counted: more than rounding, and one that is
   !> nearer to it is as good as that mode.
   real(wp), parameter :: count_margin = 1.0e-9_wp
   !> Up to so many elements the dense solver takes minutes at most.
   integer, parameter :: largest_dense = 2048

contains

   !> The first lambda_i of the mesh on its supports, ascending, and the mode shapes where they are asked for.
   subroutine lanczos_modes(model, count, lambda, error, modes)
      type(beam_model_t), intent(in) :: model
      !> Number of modes, at most n
      integer, intent(in) :: count
      !> lambda_i, [count]
      real(wp), allocatable, intent(out) :: lambda(:)
      !> Set when a mode does not converge, or one is missed
      type(failure_t), allocatable, intent(out) :: error
      !> Shapes as columns, y and dy/dx of the nodes, unit modal mass, positive tip, [degrees of freedom, count]
      real(wp), allocatable, intent(out), optional :: modes(:, :)

      type(supported_beam_t) :: beam
      real(wp), allocatable :: deflection(:, :), direction(:), motion(:), vectors(:, :)
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
         allocate (direction(beam%rows), motion(beam%dofs))
         call rigid_rotation(beam%natural, direction, motion)
         modes(:, 1) = motion
      end if
      do mode = rigid + 1, count
         call displace(beam, vectors(:, mode - rigid), modes(:, mode))
      end do
      call fix_mode_signs(model%tip_dof, modes)
   end subroutine lanczos_modes

   !> What a user who asks for frequencies can do where they are not found.
   pure function remedy(model) result(words)
      type(beam_model_t), intent(in) :: model
      character(:), allocatable :: words

      words = '; '
      if (model%mesh%elements <= largest_dense) words = "; solver = 'natural' finds all; or "
      words = words//'ask for fewer (count), or '
      associate (length => model%mesh%length)
         if (maxval(length) > (1.0_wp + count_margin)*minval(length)) then
            words = words//'bring the mesh ratio nearer to 1'
         else
            words = words//'take fewer elements'
         end if
      end associate
   end function remedy

   !> The modes with strain in the coordinates of the beam, the lowest first.
   subroutine lanczos_vectors(model, beam, count, vectors, deflection, error)
      type(beam_model_t), intent(in) :: model
      !> The same beam in its coordinates
      type(supported_beam_t), intent(in) :: beam
      !> Number of modes
      integer, intent(in) :: count
      !> Of unit modal mass, [order, count]
      real(wp), allocatable, intent(out) :: vectors(:, :)
      !> B times the vectors, [rows, count]
      real(wp), allocatable, intent(out) :: deflection(:, :)
      !> Set when a mode does not converge, or one is missed
      type(failure_t), allocatable, intent(out) :: error

      real(wp) :: lambda(count)
      integer :: found

      allocate (vectors(beam%order, count), deflection(beam%rows, count))
      found = 0
      do while (found < count)
         call find_more(beam, found, vectors, error)
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

   !> lambda of vectors, from their strain and kinetic energy.
   pure function lambda_of(vectors, deflection) result(lambda)
      !> [order, count]
      real(wp), intent(in) :: vectors(:, :)
      !> B times the vectors, [rows, count]
      real(wp), intent(in) :: deflection(:, :)
      real(wp) :: lambda(size(vectors, 2))

      integer :: mode

      do mode = 1, size(lambda)
         lambda(mode) = (sum_of_squares(vectors(:, mode))/sum_of_squares(deflection(:, mode)))**0.25_wp
      end do
   end function lambda_of

   !> Lanczos steps on B^T B, orthogonal to the vectors found, until the next ones have converged.
   subroutine find_more(beam, found, vectors, error)
      type(supported_beam_t), intent(in) :: beam
      !> Number of vectors found, the lowest frequencies; more on return
      integer, intent(inout) :: found
      !> Vectors as columns, the lowest frequency first, [order, wanted]
      real(wp), intent(inout) :: vectors(:, :)
      !> Set when no further one converges
      type(failure_t), allocatable, intent(out) :: error

      real(wp), allocatable :: basis(:, :), deflection(:), diagonal(:), off_diagonal(:), small(:, :)
      real(wp) :: before
      integer :: limit, next_look, order, place, ready, step, wanted
      logical :: finished, look

      order = size(vectors, 1)
      wanted = size(vectors, 2) - found
      limit = min(beam%free - found, 6*wanted + 60)
      allocate (basis(order, found + limit + 1), deflection(beam%rows))
      allocate (diagonal(limit), off_diagonal(limit), small(limit, wanted))
      do place = 1, found
         basis(:, place) = vectors(:, place)/norm2(vectors(:, place))
      end do
      call start_vector(beam, deflection, basis(:, :found + 1))

      before = 0.0_wp
      ready = 0
      next_look = min(2*wanted, least_steps)
      do step = 1, limit
         place = found + step
         associate (next => basis(:, place + 1))
            call bend(beam, basis(:, place), deflection)
            call bend_transposed(beam, deflection, next)
            call project_out(basis(:, :place), before, next, diagonal(step), off_diagonal(step))
            before = off_diagonal(step)
            finished = step == limit .or. off_diagonal(step) <= epsilon(1.0_wp)*maxval(diagonal(:step))
            if (step == next_look .or. finished) then
               call look_at_tridiagonal(diagonal(:step), off_diagonal(:step), small(:step, :), ready, look, error)
               if (allocated(error)) return
               if (look .or. finished) exit
               next_look = step + max(4, step/16)
            end if
         end associate
      end do
      if (ready == 0) then
         call fail(error, status_run_failed, 'Lanczos: of '//to_text(size(vectors, 2))//' modes '// &
            to_text(found)//' converge: the others are lost in rounding')
         return
      end if
      step = place - found
      call dgemm('N', 'N', order, ready, step, 1.0_wp, basis(:, found + 1:place), order, small, limit, &
         0.0_wp, vectors(:, found + 1:found + ready), order)
      found = found + ready
   end subroutine find_more

   !> w less its components along the columns of Q. The two last ones hold nearly all of these; with
   !> them taken out first, one pass over all columns leaves nothing but rounding.
   subroutine project_out(basis, before, vector, diagonal, off_diagonal)
      !> Q, orthonormal columns, [order, m]
      real(wp), contiguous, intent(in) :: basis(:, :)
      !> The off-diagonal before
      real(wp), intent(in) :: before
      !> w; what is orthogonal to Q, of unit length, on return, [2 n]
      real(wp), intent(inout) :: vector(:)
      !> Component along the last column
      real(wp), intent(out) :: diagonal
      !> Length of what remained
      real(wp), intent(out) :: off_diagonal

      real(wp) :: coefficient(size(basis, 2))
      integer :: m, order

      order = size(basis, 1)
      m = size(basis, 2)
      diagonal = dot_product(basis(:, m), vector)
      vector = vector - diagonal*basis(:, m)
      if (m > 1) vector = vector - before*basis(:, m - 1)
      call dgemv('T', order, m, 1.0_wp, basis, order, vector, 1, 0.0_wp, coefficient, 1)
      call dgemv('N', order, m, -1.0_wp, basis, order, coefficient, 1, 1.0_wp, vector, 1)
      off_diagonal = norm2(vector)
      if (off_diagonal > 0.0_wp) vector = vector/off_diagonal
   end subroutine project_out

   !> A smooth vector in which no mode is missing: the curvatures under point forces of all signs.
   subroutine start_vector(beam, forces, basis)
      type(supported_beam_t), intent(in) :: beam
      !> Work space, [rows]
      real(wp), intent(inout) :: forces(:)
      !> Vectors to which it shall be orthogonal, then the vector, of unit length, [order, found + 1]
      real(wp), intent(inout) :: basis(:, :)

      real(wp), parameter :: golden = 0.61803398874989485_wp
      integer :: i, row

      ! multiples of the golden ratio, modulo 1: the same irregular numbers in every run
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

   !> How many of the largest values of the tridiagonal matrix have converged? The residual of a Ritz
   !> vector is the last off-diagonal times the last entry of the small vector.
   subroutine look_at_tridiagonal(diagonal, off_diagonal, small, ready, finished, error)
      !> Diagonal, [m]
      real(wp), intent(in) :: diagonal(:)
      !> Off-diagonal, the last entry the next one, [m]
      real(wp), intent(in) :: off_diagonal(:)
      !> Vectors of the largest values, descending, [m, wanted]
      real(wp), intent(inout) :: small(:, :)
      !> Number of converged ones, without a gap from the largest
      integer, intent(out) :: ready
      !> All have converged, or the next one is too small to be resolved
      logical, intent(out) :: finished
      !> Set when DSTEVD fails
      type(failure_t), allocatable, intent(out) :: error

      real(wp), allocatable :: all_vectors(:, :), beside(:), value(:), work(:)
      integer, allocatable :: integer_work(:)
      integer :: info, m, place

      m = size(diagonal)
      ready = 0
      finished = .false.
      allocate (value, source=diagonal)
      allocate (beside, source=off_diagonal)
      allocate (all_vectors(m, m), work(1 + 4*m + m**2), integer_work(3 + 5*m))
      call dstevd('V', m, value, beside, all_vectors, m, work, size(work), integer_work, size(integer_work), info)
      if (info /= 0) then
         call fail(error, status_run_failed, lapack_message('DSTEVD', info, m))
         return
      end if
      do while (ready < min(size(small, 2), m))
         place = m - ready
         finished = value(place) < resolution*value(m)
         if (finished) return
         if (.not. abs(off_diagonal(m)*all_vectors(m, place)) <= convergence*value(place)) return
         ready = ready + 1
         small(:, ready) = all_vectors(:, place)
      end do
      finished = .true.
   end subroutine look_at_tridiagonal

   !> Orthogonalise the vectors in the mass product, from low to high, which takes out what rounding
   !> left of lower modes; then one application of B^T B, which takes out what it left of higher ones.
   subroutine refine(beam, vectors, deflection, error)
      type(supported_beam_t), intent(in) :: beam
      !> Vectors; of unit modal mass on return, [order, count]
      real(wp), intent(inout) :: vectors(:, :)
      !> B times the vectors, [rows, count]
      real(wp), intent(inout) :: deflection(:, :)
      !> Set when the vectors are not independent
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

   !> From low to high, by Cholesky's factor of the modal masses.
   subroutine orthogonalise(vectors, deflection, error)
      !> Vectors, [order, count]
      real(wp), intent(inout) :: vectors(:, :)
      !> B times the vectors, [rows, count]
      real(wp), intent(inout) :: deflection(:, :)
      !> Set when the vectors are not independent
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

   !> Sum of squares by blocks, so that rounding does not grow with the length.
   pure function sum_of_squares(values) result(total)
      real(wp), intent(in) :: values(:)
      real(wp) :: total

      integer, parameter :: block = 512
      real(wp), allocatable :: part(:)
      integer :: i

      allocate (part((size(values) + block - 1)/block))
      do i = 1, size(part)
         part(i) = sum(values((i - 1)*block + 1:min(i*block, size(values)))**2)
      end do
      total = sum(part)
   end function sum_of_squares

   !> Each mode must satisfy its equation: |B^T B v - lambda^-4 v| small against lambda^-4 |v|.
   subroutine check_residuals(beam, lambda, vectors, deflection, error)
      type(supported_beam_t), intent(in) :: beam
      !> lambda_i, [count]
      real(wp), intent(in) :: lambda(:)
      !> Vectors, [order, count]
      real(wp), intent(in) :: vectors(:, :)
      !> B times the vectors, [rows, count]
      real(wp), intent(in) :: deflection(:, :)
      !> Set when a mode fails
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

   !> Signs that turn a mode over at each point that is held, one a displacement along the beam: rows of B, that of the
   !> tip mass left out where a support may hold it.
   pure function sides_of(model, beam) result(side)
      type(beam_model_t), intent(in) :: model
      type(supported_beam_t), intent(in) :: beam
      real(wp), allocatable :: side(:)

      integer :: i, last

      associate (natural => beam%natural)
         last = natural%beam_rows
         if (size(model%supports) > 0) last = natural%last_row(natural%elements)
         allocate (side(last), source=1.0_wp)
         do i = 1, size(beam%supported)
            ! of two supports at one point the second turns nothing
            if (any(beam%supported(:i - 1) == beam%supported(i))) cycle
            associate (beyond => natural%last_row((beam%supported(i) + 1)/2) + 1)
               side(beyond:) = -side(beyond:)
            end associate
         end do
      end associate
   end function sides_of

   !> Mode i changes its sign i - 1 times; or else, where the mesh is too coarse or supports are in the way to show
   !> that, so many modes lie below the highest as were found there.
   subroutine check_none_missed(model, beam, lambda, deflection, error)
      type(beam_model_t), intent(in) :: model
      !> The same beam in its coordinates
      type(supported_beam_t), intent(in) :: beam
      !> lambda_i of the modes with strain, [count]
      real(wp), intent(in) :: lambda(:)
      !> B times the modes, [rows, count]
      real(wp), intent(in) :: deflection(:, :)
      !> Set when a mode has been missed
      type(failure_t), allocatable, intent(out) :: error

      real(wp), allocatable :: side(:)
      real(wp) :: highest
      integer :: below, found, mode, rigid
      logical :: complete

      ! a rotary inertia, a spring or a slope that is held may add a change of sign
      complete = .not. any(model%point_masses%rotary_inertia > 0.0_wp) .and. &
         .not. any(model%supports%stiffness > 0.0_wp .or. modulo(model%supports%dof, 2) == 0)
      allocate (side, source=sides_of(model, beam))
      rigid = merge(1, 0, is_mechanism(model))
      do mode = 1, size(lambda)
         complete = complete .and. sign_changes(side*deflection(:size(side), mode)) == mode - 1 + rigid
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
