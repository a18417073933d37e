!> One Newmark step of the beam: M y'' + C y' + K y = sum f_j w_j + F(tau), with C = 2 zeta K or any other damping, f_j
!> the force of contact j and w_j its row, so that w_j . y is the displacement normal to the contact. A prime is d/dtau,
!> v = y'. K is the stiffness of a beam with E Ibar = rho Abar = L = 1, over lambda1^4; D is the unit of displacement,
!> so forces are in lambda1^4 E Ibar D/L^3.
!>
!> In displacements, steps of length h with any beta and gamma are steps by average acceleration (1/4 and 1/2) of a beam
!> with
!>    M* = M + (gamma - 1/2) h C + (beta - gamma/2) h^2 K,   C* = C + (gamma - 1/2) h K
!> (Krenk, Computer Methods in Applied Mechanics and Engineering 195, 2006, 6110-6124; eliminate velocities and
!> accelerations from three steps). The program therefore uses M* and C* throughout, for impulses too, and does not
!> change M* and C* when it halves the step. With + for values at the end of a step, y+ - y = h (v + v+)/2, and the
!> energy v . M* v/2 + y . K y/2 changes by
!>    -h u . C* u + sum w_j . (y+ - y) (f_j + f_j+)/2,   u = (v + v+)/2,
!> for any sequence of step lengths: in free motion, at closed rigid contacts (w_j . y+ = w_j . y) and at impulses the
!> energy never grows. M* is positive definite up to just below the stability limit. Velocities and accelerations
!> computed in the usual way, with M, do not satisfy an energy balance: an impulse that adds the velocity v makes M y''
!> = -C v huge in strongly damped modes, and the term (beta - 1/4) h^2 y'' then displaces the beam.
!>
!> The acceleration is the unknown (Hughes, The Finite Element Method, section 9.1): one matrix product and one solution
!> a step. The forces f of contacts enter afterwards through the columns A^-1 w of their rows, so that one factorisation
!> with A = M* + h C*/2 + h^2 K/4 serves free motion, closed rigid contacts and closed compliant contacts.
!>
!> The half bandwidth of the beam's matrices is three, so product and solution run over diagonals, and vectors are
!> padded with zeros at both ends instead of testing for the ends. A whole step thus takes less time than the general
!> skyline product and solution alone (measured at 8 elements: 0.10 against 0.18 microseconds).
module newmark_stepper
   use beam_model, only: beam_model_t
   use contact_rows, only: band, contact_row_t, set_row_value
   use failures, only: failure_t
   use kinds, only: lambda1_power4, wp
   use skyline_matrix, only: combine, factorise, multiply, skyline_t, solve_factorised
   implicit none (type, external)
   private
   public :: newmark_stepper_t, newmark_state_t, deepest_level
   public :: make_newmark_stepper, make_factors, solve_for_row, predict_step, finish_step
   public :: restart_acceleration, add_column, copy_state

   !> Maximum number of halvings of a step.
   integer, parameter :: deepest_level = 40

   !> Displacement, velocity and acceleration of all degrees of freedom.
   type :: newmark_state_t
      !> y, y', y'' of the degrees of freedom, padded with zeros, [-2 : order + 3]
      real(wp), allocatable :: displacement(:)
      real(wp), allocatable :: velocity(:)
      real(wp), allocatable :: acceleration(:)
      !> Applied loads, padded with zeros; unallocated: there are none
      real(wp), allocatable :: load(:)
   end type newmark_state_t

   !> Factors and coefficients of a step of given length.
   type :: newmark_factors_t
      !> The factors have been made
      logical :: made = .false.
      !> Length of the step, h
      real(wp) :: step = 0.0_wp
      !> L of A = L D L^T by diagonals: L(i, i - k) at (i, k), and 1/D, [order + 3, 3] and [order]
      real(wp), allocatable :: lower(:, :)
      real(wp), allocatable :: reciprocal_pivot(:)
      !> If inertia was redistributed, the slope at the tip is coupled to the last node but two as well: L(order, order
      !> - 5) and L(order, order - 4)
      real(wp) :: lower_left(2) = 0.0_wp
      !> Skyline factors of A, used instead of the diagonals if the stepper `uses_skyline`
      type(skyline_t) :: skyline_factors
   end type newmark_factors_t

   type :: newmark_stepper_t
      !> Number of degrees of freedom
      integer :: order = 0
      !> Degrees of freedom of the stop point and of the tip
      integer :: stop_dof = 0
      integer :: tip_dof = 0
      !> 2 zeta + (gamma - 1/2) step, so that C* = `stiffness_damping` K if C = 2 zeta K
      real(wp) :: stiffness_damping = 0.0_wp
      !> C* is not a multiple of K, or the root is not fixed: products and solutions use skyline matrices instead of
      !> diagonals, and `damping` is C*
      logical :: uses_skyline = .false.
      type(skyline_t) :: damping
      !> Length of the undivided step
      real(wp) :: step = 0.0_wp
      !> K by diagonals, K(i, i + k) at (i, k), [order, -3:3]
      real(wp), allocatable :: stiffness_diagonals(:, :)
      !> K, M* and the factors of M*
      type(skyline_t) :: stiffness
      type(skyline_t) :: mass
      type(skyline_t) :: mass_factors
      !> Factors of the step h = step/2^level, made when first needed, [0:deepest_level]
      type(newmark_factors_t), allocatable :: factors(:)
      !> Number of factorisations so far
      integer :: factorisations = 0
      !> Work arrays for the argument and the result of a matrix product, padded with zeros, [-2 : order + 3]
      real(wp), allocatable :: work(:)
      real(wp), allocatable :: result(:)
   end type newmark_stepper_t

contains

   !> Prepare everything that does not depend on the length of the step.
   pure subroutine make_newmark_stepper(model, zeta, beta, gamma, step, stepper, error, more_damping)
      type(beam_model_t), intent(in) :: model
      !> Damping C = 2 zeta K
      real(wp), intent(in) :: zeta
      !> Newmark's beta and gamma; the step is stable with these
      real(wp), intent(in) :: beta
      real(wp), intent(in) :: gamma
      !> Length of the undivided step, tau
      real(wp), intent(in) :: step
      !> The stepper, ready to make factors
      type(newmark_stepper_t), intent(out) :: stepper
      !> Set if the mass matrix cannot be factorised
      type(failure_t), allocatable, intent(out) :: error
      !> Damping besides 2 zeta K, with the profile of the model; absent: there is none
      type(skyline_t), intent(in), optional :: more_damping

      integer :: column, row
      real(wp) :: entry

      stepper%order = model%stiffness%order
      stepper%stop_dof = model%stop_dof
      stepper%tip_dof = model%tip_dof
      stepper%stiffness_damping = 2.0_wp*zeta + (gamma - 0.5_wp)*step
      stepper%step = step
      stepper%stiffness = model%stiffness
      stepper%stiffness%values = model%stiffness%values/lambda1_power4
      stepper%mass = combine(1.0_wp, model%mass, &
         step*(2.0_wp*zeta*(gamma - 0.5_wp) + (beta - 0.5_wp*gamma)*step), stepper%stiffness)
      ! the root's degrees of freedom are numbered last, outside the band of those to which they are coupled
      stepper%uses_skyline = present(more_damping) .or. any(model%root_dofs > 0)
      if (present(more_damping)) then
         stepper%mass = combine(1.0_wp, stepper%mass, step*(gamma - 0.5_wp), more_damping)
         stepper%damping = combine(stepper%stiffness_damping, stepper%stiffness, 1.0_wp, more_damping)
      else if (stepper%uses_skyline) then
         stepper%damping = combine(stepper%stiffness_damping, stepper%stiffness, 0.0_wp, stepper%stiffness)
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
      allocate (stepper%work(1 - band:stepper%order + band), source=0.0_wp)
      allocate (stepper%result(1 - band:stepper%order + band), source=0.0_wp)
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
      matrix = combine(1.0_wp, stepper%mass, &
         h*(0.5_wp*stepper%stiffness_damping + 0.25_wp*h), stepper%stiffness)
      if (stepper%uses_skyline) matrix = combine(1.0_wp, combine(1.0_wp, stepper%mass, 0.5_wp*h, stepper%damping), &
         0.25_wp*h**2, stepper%stiffness)
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
         factors%made = .true.
      end associate
   end subroutine make_factors

   !> A^-1 w: the acceleration at the end of a step due to a unit contact force there.
   pure subroutine solve_for_row(stepper, level, row, column)
      !> The stepper, with the factors of this level
      type(newmark_stepper_t), intent(in) :: stepper
      !> Number of halvings of the step
      integer, intent(in) :: level
      !> Row vector w, which gives the normal displacement at the contact
      type(contact_row_t), intent(in) :: row
      !> A^-1 w, padded with zeros, [-2 : order + 3]
      real(wp), intent(out) :: column(1 - band:)

      column = 0.0_wp
      call set_row_value(row, 1.0_wp, column)
      call solve(stepper, stepper%factors(level), column)
   end subroutine solve_for_row

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
      !> The beam; its `work` holds y + `stiffness_damping` v
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
         call predict(stepper%order, h, stepper%stiffness_damping, &
            old%displacement, old%velocity, old%acceleration, new%displacement, new%velocity, stepper%work)
         call find_forces(stepper, new)
         call solve(stepper, factors, new%acceleration)
      end associate
   end subroutine predict_step

   !> Predictors of displacement, y + h v + h^2 a/4, and velocity, v + h a/2, and the combination of both by which
   !> stiffness and damping forces are a single product with K.
   pure subroutine predict(order, h, stiffness_damping, y, v, a, y_new, v_new, combined)
      !> Number of degrees of freedom
      integer, intent(in) :: order
      !> Length of the step
      real(wp), intent(in) :: h
      !> C* as a multiple of K
      real(wp), intent(in) :: stiffness_damping
      !> State at the beginning
      real(wp), intent(in) :: y(1 - band:order + band)
      real(wp), intent(in) :: v(1 - band:order + band)
      real(wp), intent(in) :: a(1 - band:order + band)
      !> Predictors
      real(wp), intent(inout) :: y_new(1 - band:order + band)
      real(wp), intent(inout) :: v_new(1 - band:order + band)
      !> Predictor of displacement + `stiffness_damping` times that of velocity
      real(wp), intent(inout) :: combined(1 - band:order + band)

      real(wp) :: factor_y, factor_v
      integer :: i

      factor_y = 0.25_wp*h*h
      factor_v = 0.5_wp*h
      do i = 1, order
         y_new(i) = y(i) + (h*v(i) + factor_y*a(i))
         v_new(i) = v(i) + factor_v*a(i)
         combined(i) = y_new(i) + stiffness_damping*v_new(i)
      end do
   end subroutine predict

   !> Product -K x by diagonals.
   pure subroutine negative_product(order, diagonals, x, product)
      !> Number of degrees of freedom
      integer, intent(in) :: order
      !> K(i, i + k) at (i, k)
      real(wp), intent(in) :: diagonals(order, -band:band)
      !> x, padded with zeros
      real(wp), intent(in) :: x(1 - band:order + band)
      !> -K x; the padding stays as it is
      real(wp), intent(inout) :: product(1 - band:order + band)

      integer :: i

      do i = 1, order
         product(i) = -(diagonals(i, -3)*x(i - 3) + diagonals(i, -2)*x(i - 2) + diagonals(i, -1)*x(i - 1) &
            + diagonals(i, 0)*x(i) &
            + diagonals(i, 1)*x(i + 1) + diagonals(i, 2)*x(i + 2) + diagonals(i, 3)*x(i + 3))
      end do
   end subroutine negative_product

   !> Solve L D L^T x = b. In each sum the entry of x computed last comes last, so that most operations do not wait for
   !> it.
   pure subroutine solve_banded(order, lower, lower_left, reciprocal_pivot, x)
      !> Number of degrees of freedom
      integer, intent(in) :: order
      !> L(i, i - k) at (i, k), padded with zeros
      real(wp), intent(in) :: lower(order + band, band)
      !> L(order, order - 5) and L(order, order - 4)
      real(wp), intent(in) :: lower_left(2)
      !> 1/D
      real(wp), intent(in) :: reciprocal_pivot(order)
      !> b; x on return
      real(wp), intent(inout) :: x(1 - band:order + band)

      integer :: i

      do i = 1, order
         x(i) = ((x(i) - lower(i, 3)*x(i - 3)) - lower(i, 2)*x(i - 2)) - lower(i, 1)*x(i - 1)
      end do
      if (order > 5) x(order) = x(order) - (lower_left(1)*x(order - 5) + lower_left(2)*x(order - 4))
      do i = 1, order
         x(i) = x(i)*reciprocal_pivot(i)
      end do
      if (order > 5) x(order - 5:order - 4) = x(order - 5:order - 4) - lower_left*x(order)
      do i = order, 1, -1
         x(i) = ((x(i) - lower(i + 3, 3)*x(i + 3)) - lower(i + 2, 2)*x(i + 2)) - lower(i + 1, 1)*x(i + 1)
      end do
   end subroutine solve_banded

   !> Add the accelerations of the contact forces, and correct the predictors.
   pure subroutine finish_step(stepper, level, contacts, columns, count, closed, forces, state)
      !> The beam, with the factors of this level
      type(newmark_stepper_t), intent(in) :: stepper
      !> Number of halvings of the step
      integer, intent(in) :: level
      !> Number of all contacts
      integer, intent(in) :: contacts
      !> A^-1 w of all contacts, padded with zeros, [-2 : order + 3, contacts]
      real(wp), intent(in) :: columns(1 - band:stepper%order + band, contacts)
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
         do j = 1, count - 1
            call add_column(stepper%order, forces(j), columns(1 - band, closed(j)), state%acceleration)
         end do
         if (count > 0) then
            call add_column_and_correct(stepper%order, forces(count), columns(1 - band, closed(count)), &
               0.25_wp*h*h, 0.5_wp*h, state%displacement, state%velocity, state%acceleration)
         else
            call correct(stepper%order, 0.25_wp*h*h, 0.5_wp*h, state%displacement, state%velocity, state%acceleration)
         end if
      end associate
   end subroutine finish_step

   !> Add the acceleration due to a contact force.
   pure subroutine add_column(order, force, column, acceleration)
      !> Number of degrees of freedom
      integer, intent(in) :: order
      real(wp), intent(in) :: force
      !> A^-1 w or M*^-1 w
      real(wp), intent(in) :: column(1 - band:order + band)
      real(wp), intent(inout) :: acceleration(1 - band:order + band)

      integer :: i

      do i = 1, order
         acceleration(i) = acceleration(i) + force*column(i)
      end do
   end subroutine add_column

   !> Add a contact force, and correct the predictors: a + f A^-1 w, y + h^2 a/4, v + h a/2. One loop does both, because
   !> besides product and solution these operations take most of the time of a step in contact.
   pure subroutine add_column_and_correct(order, force, column, factor_y, factor_v, y, v, a)
      !> Number of degrees of freedom
      integer, intent(in) :: order
      !> f
      real(wp), intent(in) :: force
      !> A^-1 w
      real(wp), intent(in) :: column(1 - band:order + band)
      !> h^2/4
      real(wp), intent(in) :: factor_y
      !> h/2
      real(wp), intent(in) :: factor_v
      !> Predictors; the state on return
      real(wp), intent(inout) :: y(1 - band:order + band)
      real(wp), intent(inout) :: v(1 - band:order + band)
      real(wp), intent(inout) :: a(1 - band:order + band)

      integer :: i

      do i = 1, order
         a(i) = a(i) + force*column(i)
         y(i) = y(i) + factor_y*a(i)
         v(i) = v(i) + factor_v*a(i)
      end do
   end subroutine add_column_and_correct

   !> Correct the predictors: y + h^2 a/4, v + h a/2
   pure subroutine correct(order, factor_y, factor_v, y, v, a)
      !> Number of degrees of freedom
      integer, intent(in) :: order
      !> h^2/4
      real(wp), intent(in) :: factor_y
      !> h/2
      real(wp), intent(in) :: factor_v
      !> Predictors; the state on return
      real(wp), intent(inout) :: y(1 - band:order + band)
      real(wp), intent(inout) :: v(1 - band:order + band)
      real(wp), intent(in) :: a(1 - band:order + band)

      integer :: i

      do i = 1, order
         y(i) = y(i) + factor_y*a(i)
         v(i) = v(i) + factor_v*a(i)
      end do
   end subroutine correct

   !> The acceleration from the equation of motion without contact forces, after velocities or loads have jumped.
   pure subroutine restart_acceleration(stepper, state)
      !> The beam; its work arrays are overwritten
      type(newmark_stepper_t), intent(inout) :: stepper
      !> Displacement and velocity are given; acceleration is set
      type(newmark_state_t), intent(inout) :: state

      stepper%work = state%displacement + stepper%stiffness_damping*state%velocity
      call find_forces(stepper, state)
      call solve_factorised(stepper%mass_factors, state%acceleration(1:stepper%order))
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
