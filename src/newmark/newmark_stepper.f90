!> One Newmark step of the beam: M y'' + C y' + K y = sum f_j w_j + F(tau), with C = 2 zeta K or any other damping, f_j
!> the force of contact j and w_j its row, so that w_j . y is the displacement normal to the contact. A prime is d/dtau,
!> v = y'. K is the stiffness of a beam with E Ibar = rho Abar = L = 1, over lambda1^4. With displacements in units of
!> D, forces are in lambda1^4 E Ibar D/L^3.
!>
!> In displacements, steps of length h without forces and with any beta and gamma are steps by average acceleration (1/4
!> and 1/2) of a beam with
!>    M* = M + (gamma - 1/2) h C + (beta - gamma/2) h^2 K,   C* = C + (gamma - 1/2) h K
!> (Krenk, Computer Methods in Applied Mechanics and Engineering 195, 2006, 6110-6124; eliminate velocities and
!> accelerations from three steps). The program therefore uses M* and C* throughout, for impulses too, and does not
!> change M* and C* when it halves the step; forces are weighted as by average acceleration. With + for values at the
!> end of a step, y+ - y = h (v + v+)/2, and the energy v . M* v/2 + y . K y/2 changes, besides the work of F, by
!>    -h u . C* u + sum w_j . (y+ - y) (f_j + f_j+)/2,   u = (v + v+)/2,
!> for any sequence of step lengths: in free motion, at closed rigid contacts (w_j . y+ = w_j . y) and at impulses the
!> energy never grows. M* is positive definite for steps below the stability limit. Velocities and accelerations
!> computed in the usual way, with M, do not satisfy an energy balance. In those steps (with gamma = 1/2)
!> y+ = y + h (v + v+)/2 + (beta - 1/4) h^2 (y''+ - y''). An impulse that changes v by dv changes y'' by -M^-1 C dv,
!> which is huge in strongly damped modes, and the last term displaces the beam.
!>
!> The acceleration is the unknown (Hughes, The Finite Element Method, section 9.1): one matrix product and one solution
!> a step. The forces f of contacts enter afterwards through the columns A^-1 w of their rows, so that one factorisation
!> with A = M* + h C*/2 + h^2 K/4 serves free motion, closed rigid contacts and closed compliant contacts.
!>
!> The half bandwidth of the beam's matrices is three, so product and solution run over diagonals, and vectors are
!> padded with zeros at both ends instead of testing for the ends. A whole step thus takes less time than the general
!> skyline product and solution alone (measured at 8 elements: 0.10 against 0.18 microseconds).
!>
!> The degrees of freedom y may be modes of the beam instead of displacements and slopes of its nodes. K, M* and C* are
!> then diagonal, and a state vector holds the displacements of the stop points and the tip after the modal coordinates
!> (module `modal_steps`), so that the row of a contact has the same entries in both cases. Bodies that move have the
!> last entries of a state vector, as degrees of freedom or as points.
module newmark_stepper
   use banded_steps, only: add_column, add_column_and_correct, correct, negative_product, predict, solve_banded
   use beam_model, only: beam_model_t
   use contact_rows, only: band, contact_row_t, row_value, set_row_value
   use failures, only: failure_t
   use kinds, only: lambda1_power4, wp
   use modal_steps, only: place_points, predict_modes
   use skyline_matrix, only: combine, factorise, multiply, skyline_t, solve_factorised
   implicit none (type, external)
   private
   public :: newmark_stepper_t, newmark_state_t, deepest_level
   public :: make_newmark_stepper, make_factors, solve_for_row, solve_mass_for_row, predict_step, finish_step
   public :: restart_acceleration, copy_state, impose_row_value, place_points_in_column

   !> Maximum number of halvings of a step.
   integer, parameter :: deepest_level = 40

   !> Displacement, velocity and acceleration of all degrees of freedom.
   type :: newmark_state_t
      !> Displacements y of the degrees of freedom, and of points if these are modes, padded with zeros, [-2 : length +
      !> 3], with `length` of the stepper
      real(wp), allocatable :: displacement(:)
      !> Velocities y', in the order of the displacements
      real(wp), allocatable :: velocity(:)
      !> Accelerations y'', in the order of the displacements
      real(wp), allocatable :: acceleration(:)
      !> Applied loads on the degrees of freedom, padded with zeros; unallocated: there are none
      real(wp), allocatable :: load(:)
   end type newmark_state_t

   !> Factors and coefficients of a step of given length.
   type :: newmark_factors_t
      !> Whether the factors have been made
      logical :: made = .false.
      !> Length of the step, h
      real(wp) :: step = 0.0_wp
      !> L of A = L D L^T by diagonals: L(i, i - k) at (i, k), [n + 3, 3] with n degrees of freedom
      real(wp), allocatable :: lower(:, :)
      !> 1/D, [n]
      real(wp), allocatable :: reciprocal_pivot(:)
      !> L(n, n - 5) and L(n, n - 4), not 0 if inertia was redistributed: the displacement of the tip is then
      !> extrapolated also from the last node but two, y(n - 5), to which the slope at the tip is thus coupled (theory,
      !> section 14)
      real(wp) :: lower_left(2) = 0.0_wp
      !> Skyline factors of A, used instead of the diagonals if the stepper `uses_skyline`
      type(skyline_t) :: skyline_factors
      !> Diagonals of K, of C* and of A^-1 if the degrees of freedom are modes, [order, 3]
      real(wp), allocatable :: diagonals(:, :)
   end type newmark_factors_t

   !> The beam with the matrices, factors and work arrays of its steps.
   type :: newmark_stepper_t
      !> Number of degrees of freedom
      integer :: order = 0
      !> Number of entries of a state vector without its padding: degrees of freedom; if these are modes, points, too
      integer :: length = 0
      !> Displacement of each point per unit of each mode, [order, points]; unallocated: the degrees of freedom are
      !> displacements and slopes of nodes, and coordinates of bodies
      real(wp), allocatable :: point_shape(:, :)
      !> Entry of the stop point in a state vector
      integer :: stop_dof = 0
      !> Entry of the tip in a state vector
      integer :: tip_dof = 0
      !> 2 zeta + (gamma - 1/2) step, so that C* = `stiffness_damping` K if C = 2 zeta K
      real(wp) :: stiffness_damping = 0.0_wp
      !> Whether products and solutions use skyline matrices instead of bands: C* is not a multiple of K, or the root is
      !> not fixed, or the degrees of freedom are modes
      logical :: uses_skyline = .false.
      !> C*, if skyline matrices are used
      type(skyline_t) :: damping
      !> Length of the undivided step
      real(wp) :: step = 0.0_wp
      !> K by diagonals, K(i, i + k) at (i, k), [order, -3:3]
      real(wp), allocatable :: stiffness_diagonals(:, :)
      !> K
      type(skyline_t) :: stiffness
      !> M*
      type(skyline_t) :: mass
      !> Factors of M*
      type(skyline_t) :: mass_factors
      !> Factors of the step h = step/2^level, made when first needed, [0:deepest_level]
      type(newmark_factors_t), allocatable :: factors(:)
      !> Number of factorisations so far
      integer :: factorisations = 0
      !> Work array for the argument of a matrix product, padded with zeros, [-2 : length + 3]
      real(wp), allocatable :: work(:)
      !> Work array for the result of a matrix product, padded with zeros, [-2 : length + 3]
      real(wp), allocatable :: result(:)
   end type newmark_stepper_t

contains

   !> Prepare everything that does not depend on the number of halvings of the step.
   pure subroutine make_newmark_stepper(model, zeta, beta, gamma, step, stepper, error, more_damping, point_shape)
      type(beam_model_t), intent(in) :: model
      !> zeta of the damping C = 2 zeta K
      real(wp), intent(in) :: zeta
      !> Newmark's beta, with which the step is stable
      real(wp), intent(in) :: beta
      !> Newmark's gamma, with which the step is stable
      real(wp), intent(in) :: gamma
      !> Length of the undivided step, tau
      real(wp), intent(in) :: step
      !> The stepper, ready to make factors
      type(newmark_stepper_t), intent(out) :: stepper
      !> Set if the mass matrix cannot be factorised
      type(failure_t), allocatable, intent(out) :: error
      !> Damping besides 2 zeta K, with the profile of the model; absent: there is none
      type(skyline_t), intent(in), optional :: more_damping
      !> Displacement of each point per unit of each mode, [order, points]; unallocated or absent: the degrees of
      !> freedom of the model are not modes
      real(wp), allocatable, intent(in), optional :: point_shape(:, :)

      integer :: column, row
      real(wp) :: entry

      stepper%order = model%stiffness%order
      stepper%length = stepper%order
      if (present(point_shape)) then
         if (allocated(point_shape)) stepper%point_shape = point_shape
      end if
      if (allocated(stepper%point_shape)) stepper%length = stepper%order + size(stepper%point_shape, 2)
      stepper%stop_dof = model%stop_dof
      stepper%tip_dof = model%tip_dof
      stepper%stiffness_damping = 2.0_wp*zeta + (gamma - 0.5_wp)*step
      stepper%step = step
      stepper%stiffness = model%stiffness
      stepper%stiffness%values = model%stiffness%values/lambda1_power4
      stepper%mass = combine(1.0_wp, model%mass, &
         step*(2.0_wp*zeta*(gamma - 0.5_wp) + (beta - 0.5_wp*gamma)*step), stepper%stiffness)
      ! the root's degrees of freedom are numbered last, outside the band of those to which they are coupled
      stepper%uses_skyline = present(more_damping) .or. any(model%root_dofs > 0) .or. allocated(stepper%point_shape)
      if (present(more_damping)) then
         stepper%mass = combine(1.0_wp, stepper%mass, step*(gamma - 0.5_wp), more_damping)
         stepper%damping = combine(stepper%stiffness_damping, stepper%stiffness, 1.0_wp, more_damping)
      else if (stepper%uses_skyline) then
         stepper%damping = stepper%stiffness
         stepper%damping%values = stepper%stiffness_damping*stepper%stiffness%values
      end if

      allocate (stepper%stiffness_diagonals(stepper%order, -band:band))
      stepper%stiffness_diagonals = 0.0_wp
      associate (k => stepper%stiffness)
         do column = 1, k%order
            do row = max(k%first_row(column), column - band), column
               entry = k%values(k%diagonal(column) - column + row)
               stepper%stiffness_diagonals(row, column - row) = entry
               stepper%stiffness_diagonals(column, row - column) = entry
            end do
         end do
      end associate

      stepper%mass_factors = stepper%mass
      call factorise(stepper%mass_factors, error)
      if (allocated(error)) return
      stepper%factorisations = 1
      allocate (stepper%factors(0:deepest_level))
      allocate (stepper%work(1 - band:stepper%length + band), source=0.0_wp)
      allocate (stepper%result(1 - band:stepper%length + band), source=0.0_wp)
   end subroutine make_newmark_stepper

   !> Make the factors for the step h = step/2^level, unless they exist.
   pure subroutine make_factors(stepper, level, error)
      !> Stores the factors
      type(newmark_stepper_t), intent(inout) :: stepper
      !> Number of halvings of the step
      integer, intent(in) :: level
      !> Set if A cannot be factorised
      type(failure_t), allocatable, intent(out) :: error

      type(skyline_t) :: matrix
      real(wp) :: h
      integer :: column, row

      if (stepper%factors(level)%made) return
      h = scale(stepper%step, -level)
      if (stepper%uses_skyline) then
         matrix = combine(1.0_wp, combine(1.0_wp, stepper%mass, 0.5_wp*h, stepper%damping), 0.25_wp*h**2, &
            stepper%stiffness)
      else
         matrix = combine(1.0_wp, stepper%mass, h*(0.5_wp*stepper%stiffness_damping + 0.25_wp*h), stepper%stiffness)
      end if
      call factorise(matrix, error)
      if (allocated(error)) return
      stepper%factorisations = stepper%factorisations + 1
      associate (factors => stepper%factors(level), n => stepper%order)
         factors%step = h
         if (stepper%uses_skyline) factors%skyline_factors = matrix
         allocate (factors%lower(n + band, band), source=0.0_wp)
         allocate (factors%reciprocal_pivot(n))
         do column = 1, n
            do row = max(matrix%first_row(column), column - band), column - 1
               factors%lower(column, column - row) = matrix%values(matrix%diagonal(column) - column + row)
            end do
            factors%reciprocal_pivot(column) = 1.0_wp/matrix%values(matrix%diagonal(column))
         end do
         if (matrix%first_row(n) == n - 5) then
            associate (last => matrix%diagonal(n))
               factors%lower_left = matrix%values(last - 5:last - 4)
            end associate
         end if
         if (allocated(stepper%point_shape)) then
            allocate (factors%diagonals(n, 3))
            factors%diagonals(:, 1) = stepper%stiffness%values
            factors%diagonals(:, 2) = stepper%damping%values
            factors%diagonals(:, 3) = factors%reciprocal_pivot
         end if
         factors%made = .true.
      end associate
   end subroutine make_factors

   !> A^-1 w: the acceleration at the end of a step that a unit contact force at this instant causes.
   pure subroutine solve_for_row(stepper, level, row, column)
      !> The stepper, with the factors of this level
      type(newmark_stepper_t), intent(in) :: stepper
      !> Number of halvings of the step
      integer, intent(in) :: level
      !> Row vector w, which gives the normal displacement at the contact
      type(contact_row_t), intent(in) :: row
      !> A^-1 w, padded with zeros, [-2 : length + 3]
      real(wp), intent(out) :: column(1 - band:)

      call load_row(stepper, row, column)
      call solve(stepper, stepper%factors(level), column)
      call place_points_in_column(stepper, column)
   end subroutine solve_for_row

   !> M*^-1 w: the change of velocity by a unit impulse at a contact.
   pure subroutine solve_mass_for_row(stepper, row, column)
      type(newmark_stepper_t), intent(in) :: stepper
      !> Row vector w, which gives the normal displacement at the contact
      type(contact_row_t), intent(in) :: row
      !> M*^-1 w, padded with zeros, [-2 : length + 3]
      real(wp), intent(out) :: column(1 - band:)

      call load_row(stepper, row, column)
      call solve_factorised(stepper%mass_factors, column(1:stepper%order))
      call place_points_in_column(stepper, column)
   end subroutine solve_mass_for_row

   !> The load vector w of a unit force at a contact.
   pure subroutine load_row(stepper, row, load)
      type(newmark_stepper_t), intent(in) :: stepper
      type(contact_row_t), intent(in) :: row
      !> w, padded with zeros
      real(wp), intent(out) :: load(1 - band:)

      load = 0.0_wp
      if (allocated(stepper%point_shape)) then
         load(1:stepper%order) = modal_row(stepper, row)
      else
         load(row%dof) = row%sign
         if (row%partner > 0) load(row%partner) = -row%sign
      end if
   end subroutine load_row

   !> The row of a contact over the modes, if these are the degrees of freedom.
   pure function modal_row(stepper, row) result(value)
      type(newmark_stepper_t), intent(in) :: stepper
      !> Row over the points
      type(contact_row_t), intent(in) :: row
      !> Normal displacement per unit of each mode, [order]
      real(wp) :: value(stepper%order)

      value = row%sign*stepper%point_shape(:, row%dof - stepper%order)
      if (row%partner > 0) value = value - row%sign*stepper%point_shape(:, row%partner - stepper%order)
   end function modal_row

   !> Set the entries of the points in a vector of modes.
   pure subroutine place_points_in_column(stepper, column)
      type(newmark_stepper_t), intent(in) :: stepper
      !> Vector, padded with zeros
      real(wp), intent(inout) :: column(1 - band:)

      integer :: p

      if (.not. allocated(stepper%point_shape)) return
      associate (n => stepper%order)
         do p = 1, size(stepper%point_shape, 2)
            column(n + p) = dot_product(column(1:n), stepper%point_shape(:, p))
         end do
      end associate
   end subroutine place_points_in_column

   !> Set w . x to a value from which it differs by rounding errors only. In modes the rounding errors are removed from
   !> the modes, too, because they would add up from step to step.
   pure subroutine impose_row_value(stepper, row, value, vector)
      type(newmark_stepper_t), intent(in) :: stepper
      !> Row vector w of the contact
      type(contact_row_t), intent(in) :: row
      real(wp), intent(in) :: value
      !> x: displacements, velocities or accelerations, padded
      real(wp), intent(inout) :: vector(1 - band:)

      real(wp) :: change, norm

      if (allocated(stepper%point_shape)) then
         change = row%sign*(value - row_value(row, vector))
         ! without a copy of the row, which would be allocated in each step of a closed contact
         associate (shape => stepper%point_shape, p => row%dof - stepper%order, &
            partner => row%partner - stepper%order)
            if (row%partner > 0) then
               norm = sum((shape(:, p) - shape(:, partner))**2)
            else
               norm = sum(shape(:, p)**2)
            end if
            if (norm > 0.0_wp) change = change/norm
            vector(1:stepper%order) = vector(1:stepper%order) + change*shape(:, p)
            if (row%partner > 0) vector(1:stepper%order) = vector(1:stepper%order) &
               - change*shape(:, partner)
         end associate
      end if
      call set_row_value(row, value, vector)
   end subroutine impose_row_value

   !> Solve A x = b.
   pure subroutine solve(stepper, factors, x)
      type(newmark_stepper_t), intent(in) :: stepper
      type(newmark_factors_t), intent(in) :: factors
      !> b, padded with zeros; x on return
      real(wp), intent(inout) :: x(1 - band:)

      if (stepper%uses_skyline) then
         call solve_factorised(factors%skyline_factors, x(1:stepper%order))
      else
         call solve_banded(stepper%order, factors%lower, factors%lower_left, factors%reciprocal_pivot, x)
      end if
   end subroutine solve

   !> Forces F - K y - C* v on the degrees of freedom.
   pure subroutine find_forces(stepper, state)
      !> The beam; unless it uses skyline matrices, its `work` holds y + `stiffness_damping` v
      type(newmark_stepper_t), intent(inout) :: stepper
      !> The forces replace its acceleration
      type(newmark_state_t), intent(inout) :: state

      associate (n => stepper%order, forces => state%acceleration)
         if (stepper%uses_skyline) then
            call multiply(stepper%stiffness, state%displacement(1:n), forces(1:n))
            call multiply(stepper%damping, state%velocity(1:n), stepper%result(1:n))
            forces(1:n) = -(forces(1:n) + stepper%result(1:n))
         else
            call negative_product(n, stepper%stiffness_diagonals, stepper%work, forces)
         end if
         if (allocated(state%load)) forces(:) = forces + state%load
      end associate
   end subroutine find_forces

   !> Predict the end of a step without contact forces: predictors of displacement and velocity, and their acceleration.
   pure subroutine predict_step(stepper, level, old, new)
      !> The beam, with the factors of this level; its work arrays are overwritten
      type(newmark_stepper_t), intent(inout) :: stepper
      !> Number of halvings of the step
      integer, intent(in) :: level
      !> State at the beginning
      type(newmark_state_t), intent(in) :: old
      !> Predictors and acceleration without contact forces
      type(newmark_state_t), intent(inout) :: new

      associate (factors => stepper%factors(level), h => stepper%factors(level)%step)
         if (allocated(stepper%point_shape)) then
            new%acceleration(1:) = 0.0_wp
            if (allocated(new%load)) new%acceleration(1:) = new%load(1:)
            ! the first element after the padding stands for the array, which is thus not copied
            call predict_modes(stepper%order, h, factors%diagonals, old%displacement(1), old%velocity(1), &
               old%acceleration(1), new%displacement(1), new%velocity(1), new%acceleration(1))
            call place_points(stepper%order, stepper%length - stepper%order, stepper%point_shape, &
               new%displacement(1), new%velocity(1), new%acceleration(1))
            return
         end if
         call predict(stepper%order, h, stepper%stiffness_damping, &
            old%displacement, old%velocity, old%acceleration, new%displacement, new%velocity, stepper%work)
         call find_forces(stepper, new)
         call solve(stepper, factors, new%acceleration)
      end associate
   end subroutine predict_step

   !> Add the accelerations of the contact forces, and correct the predictors.
   pure subroutine finish_step(stepper, level, contacts, columns, count, closed, forces, state)
      !> The beam, with the factors of this level
      type(newmark_stepper_t), intent(in) :: stepper
      !> Number of halvings of the step
      integer, intent(in) :: level
      !> Number of all contacts
      integer, intent(in) :: contacts
      !> A^-1 w of all contacts, padded with zeros, [-2 : length + 3, contacts]
      real(wp), intent(in) :: columns(1 - band:stepper%length + band, contacts)
      !> Number of contacts with a force
      integer, intent(in) :: count
      !> Indices of these contacts
      integer, intent(in) :: closed(count)
      !> Forces f of these contacts at the end of the step
      real(wp), intent(in) :: forces(count)
      !> Result of `predict_step`; the state on return
      type(newmark_state_t), intent(inout) :: state

      integer :: j

      associate (h => stepper%factors(level)%step)
         ! the first element of a column stands for the column, which is thus not copied
         do j = 1, count - 1
            call add_column(stepper%length, forces(j), columns(1 - band, closed(j)), state%acceleration)
         end do
         if (count > 0) then
            call add_column_and_correct(stepper%length, forces(count), columns(1 - band, closed(count)), &
               0.25_wp*h*h, 0.5_wp*h, state%displacement, state%velocity, state%acceleration)
         else
            call correct(stepper%length, 0.25_wp*h*h, 0.5_wp*h, state%displacement, state%velocity, &
               state%acceleration)
         end if
      end associate
   end subroutine finish_step

   !> The acceleration from the equation of motion without contact forces, after velocities or loads have jumped.
   pure subroutine restart_acceleration(stepper, state)
      !> The beam; its work arrays are overwritten
      type(newmark_stepper_t), intent(inout) :: stepper
      !> Displacement and velocity are given; acceleration is set
      type(newmark_state_t), intent(inout) :: state

      stepper%work = state%displacement + stepper%stiffness_damping*state%velocity
      call find_forces(stepper, state)
      call solve_factorised(stepper%mass_factors, state%acceleration(1:stepper%order))
      if (allocated(stepper%point_shape)) call place_points(stepper%order, stepper%length - stepper%order, &
         stepper%point_shape, state%displacement(1), state%velocity(1), state%acceleration(1))
   end subroutine restart_acceleration

   !> Copy a state without allocating.
   pure subroutine copy_state(from, to)
      type(newmark_state_t), intent(in) :: from
      !> The copy, allocated to the same size
      type(newmark_state_t), intent(inout) :: to

      to%displacement(:) = from%displacement
      to%velocity(:) = from%velocity
      to%acceleration(:) = from%acceleration
      if (allocated(from%load)) to%load(:) = from%load
   end subroutine copy_state

end module newmark_stepper
