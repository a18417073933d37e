!> Newton's method for a periodic orbit, at a given parameter or by pseudo-arclength along a branch, and the Floquet
!> multipliers of the orbit (docs/theory.md, section 22). The equations demand that the Poincare map of `section_map`
!> returns to the initial state. "Units of the map" are the units of its unknowns and of the parameter
!> (`section_map_t%unit`).
module orbit_newton
   use kinds, only: wp
   use lapack_interfaces, only: dgeev, dgesv
   use orbit_types, only: orbit_point_t
   use section_map, only: evaluate_map, map_result_t, set_unknowns, section_map_t, unknowns_of
   use section_types, only: section_state_t
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: initial_state_t, solution_t, solve_orbit, find_branch_tangent, doubling_direction, predictor, distance_of

   !> Initial state of an orbit, and the value of the parameter.
   type :: initial_state_t
      type(section_state_t) :: state
      !> Value of the parameter: amplitude or frequency of a load
      real(wp) :: value = 0.0_wp
      !> Phase of the section in the load period, as a fraction of the period
      real(wp) :: section_phase = 0.0_wp
   end type initial_state_t

   !> Result of Newton's method: initial state, orbit, and map at the initial state.
   type :: solution_t
      type(initial_state_t) :: initial
      type(orbit_point_t) :: point
      type(map_result_t) :: map
      !> Minimum normal speed of an impact with restitution in all trial motions
      real(wp) :: min_speed = huge(1.0_wp)
      !> Whether the residual is within the tolerance, and at both ends of the motion the same contacts are closed, or
      !> open with a surface that moves with the beam
      logical :: converged = .false.
   end type solution_t

contains

   !> Solve for a periodic orbit from an initial guess. If a direction is given, the parameter is unknown, too, and
   !> corrections are orthogonal to the direction, so that the orbit keeps the component of the guess along the
   !> direction (pseudo-arclength). A Newton step is halved until its state penetrates no contact, the run from this
   !> state succeeds, and the residual decreases.
   subroutine solve_orbit(map, guess, tolerance, max_steps, solution, direction)
      type(section_map_t), target, intent(inout) :: map
      type(initial_state_t), intent(in) :: guess
      !> Tolerance of the residual, in units of the map
      real(wp), intent(in) :: tolerance
      !> Maximum number of Newton steps
      integer, intent(in) :: max_steps
      type(solution_t), intent(out) :: solution
      !> Direction in units of the map, the parameter last, [unknowns + 1]
      real(wp), intent(in), optional :: direction(:)

      integer, parameter :: max_halvings = 12
      type(initial_state_t) :: trial
      type(map_result_t) :: result
      ! Newton step in units of the map, [unknowns + 1]
      real(wp), allocatable :: correction(:)
      ! residual in units of the map, [unknowns]
      real(wp), allocatable :: residual(:)
      ! fraction of the Newton step that is taken
      real(wp) :: step_fraction
      real(wp) :: size_of_residual
      logical :: is_admissible
      integer :: halving, step

      map%section_phase = guess%section_phase
      solution%initial = guess
      ! sets the indentations that follow from the unknowns, and checks that no contact is penetrated
      call set_unknowns(map, unknowns_of(map, guess%state), solution%initial%state, is_admissible)
      if (.not. is_admissible) return
      call evaluate_map(map, solution%initial%value, solution%initial%state, solution%map)
      ! unallocated: the run failed
      if (.not. allocated(solution%map%unknowns)) return
      solution%min_speed = solution%map%min_speed
      do step = 0, max_steps
         residual = residual_of(map, solution%initial, solution%map)
         size_of_residual = norm2(residual)
         solution%point%residual = size_of_residual
         solution%point%iterations = step
         if (size_of_residual <= tolerance) exit
         if (step == max_steps) return
         call find_correction(map, solution%map, residual, correction, direction)
         if (.not. allocated(correction)) return
         step_fraction = 2.0_wp
         do halving = 0, max_halvings
            if (halving == max_halvings) return
            step_fraction = 0.5_wp*step_fraction
            trial = solution%initial
            associate (n => size(residual))
               call set_unknowns(map, unknowns_of(map, trial%state) + step_fraction*map%unit(:n)*correction(:n), &
                  trial%state, is_admissible)
               trial%value = trial%value + step_fraction*map%unit(n + 1)*correction(n + 1)
            end associate
            ! the parameter, if the map has one (`no_parameter` is 0), must keep its sign and more than a tenth of its
            ! value in the guess
            if (map%parameter > 0) is_admissible = is_admissible .and. trial%value/guess%value > 0.1_wp
            if (.not. is_admissible) cycle
            call evaluate_map(map, trial%value, trial%state, result)
            if (.not. allocated(result%unknowns)) cycle
            solution%min_speed = min(solution%min_speed, result%min_speed)
            ! sufficient decrease: at least 5e-4 of that of the linearised residual
            if (norm2(residual_of(map, trial, result)) < (1.0_wp - 5.0e-4_wp*step_fraction)*size_of_residual) exit
         end do
         solution%initial = trial
         solution%map = result
      end do
      ! the unknowns return, but other contacts are closed or move with the beam at the end than at the start: no orbit
      if (solution%map%failed) return
      solution%converged = .true.
      call fill_point(map, solution)
   end subroutine solve_orbit

   !> Predictor: initial guess at a distance from an orbit in a direction.
   type(initial_state_t) function predictor(map, initial, direction, length) result(guess)
      type(section_map_t), intent(in) :: map
      type(initial_state_t), intent(in) :: initial
      !> Direction in units of the map, the parameter last, [unknowns + 1]
      real(wp), intent(in) :: direction(:)
      !> Distance in units of the map
      real(wp), intent(in) :: length

      ! not needed, because `solve_orbit` checks the guess again
      logical :: is_admissible

      guess = initial
      associate (n => size(direction) - 1)
         call set_unknowns(map, unknowns_of(map, initial%state) + length*map%unit(:n)*direction(:n), guess%state, &
            is_admissible)
         guess%value = initial%value + length*map%unit(n + 1)*direction(n + 1)
      end associate
   end function predictor

   !> Distance of two initial states with their parameters, in units of the map.
   pure real(wp) function distance_of(map, initial, other) result(distance)
      type(section_map_t), intent(in) :: map
      type(initial_state_t), intent(in) :: initial
      type(initial_state_t), intent(in) :: other

      distance = norm2([unknowns_of(map, initial%state) - unknowns_of(map, other%state), initial%value - other%value] &
         /map%unit)
   end function distance_of

   !> Residual: end state minus initial state, in units of the map.
   pure function residual_of(map, initial, result) result(residual)
      type(section_map_t), intent(in) :: map
      type(initial_state_t), intent(in) :: initial
      type(map_result_t), intent(in) :: result
      real(wp), allocatable :: residual(:)

      allocate (residual, source=(result%unknowns - unknowns_of(map, initial%state)))
      residual = residual/map%unit(:size(residual))
   end function residual_of

   !> Newton step, in units of the map; unallocated if the matrix is singular. The last equation fixes the parameter or,
   !> if a direction is given, makes the step orthogonal to it.
   subroutine find_correction(map, result, residual, correction, direction)
      type(section_map_t), intent(in) :: map
      type(map_result_t), intent(in) :: result
      real(wp), intent(in) :: residual(:)
      real(wp), allocatable, intent(out) :: correction(:)
      real(wp), intent(in), optional :: direction(:)

      real(wp) :: last_row(size(residual) + 1)

      last_row = [spread(0.0_wp, 1, size(residual)), 1.0_wp]
      if (present(direction)) last_row = direction
      call solve_linear(bordered(map, result, last_row), [-residual, 0.0_wp], correction)
   end subroutine find_correction

   !> Derivative of the residual in units of the map, with one more row below for the equation of the parameter.
   pure function bordered(map, result, last_row) result(matrix)
      type(section_map_t), intent(in) :: map
      type(map_result_t), intent(in) :: result
      !> Coefficients of the equation of the parameter, [unknowns + 1]
      real(wp), intent(in) :: last_row(:)
      real(wp), allocatable :: matrix(:, :)

      integer :: i, n

      n = size(last_row) - 1
      allocate (matrix(n + 1, n + 1))
      matrix(:n, :) = scaled_derivative(map, result, n + 1)
      do i = 1, n
         matrix(i, i) = matrix(i, i) - 1.0_wp
      end do
      matrix(n + 1, :) = last_row
   end function bordered

   !> Solve a system of linear equations by LAPACK.
   subroutine solve_linear(matrix, right, solution)
      real(wp), intent(in) :: matrix(:, :)
      !> Right side
      real(wp), intent(in) :: right(:)
      !> Unallocated if the matrix is singular or the solution not finite
      real(wp), allocatable, intent(out) :: solution(:)

      real(wp), allocatable :: factors(:, :)
      integer :: info, pivot(size(right))

      ! the derivative at grazing is not finite
      if (.not. all(abs(matrix) < huge(1.0_wp))) return
      allocate (factors, source=matrix)
      allocate (solution, source=right)
      call dgesv(size(right), 1, factors, size(right), pivot, solution, size(right), info)
      if (info /= 0 .or. .not. all(abs(solution) < huge(1.0_wp))) deallocate (solution)
   end subroutine solve_linear

   !> Unit tangent of a branch at a periodic orbit in units of the map, with a positive component along a given
   !> direction.
   subroutine find_branch_tangent(map, result, along, direction)
      type(section_map_t), intent(in) :: map
      type(map_result_t), intent(in) :: result
      !> The given direction, in units of the map, the parameter last, [unknowns + 1]
      real(wp), intent(in) :: along(:)
      !> Unallocated if the matrix is singular or the solution not finite
      real(wp), allocatable, intent(out) :: direction(:)

      call solve_linear(bordered(map, result, along), [spread(0.0_wp, 1, size(along) - 1), 1.0_wp], direction)
      if (allocated(direction)) direction = direction/norm2(direction)
   end subroutine find_branch_tangent

   !> Fill the branch point with multipliers, displacement and velocity of the tip at the sections, and impacts.
   subroutine fill_point(map, solution)
      type(section_map_t), intent(in) :: map
      type(solution_t), intent(inout) :: solution

      real(wp), allocatable :: matrix(:, :), real_part(:), imaginary_part(:), work(:)
      real(wp), dimension(1, 1) :: left, right
      integer :: info

      associate (point => solution%point, result => solution%map, n => size(solution%map%derivative, 1))
         point%value = solution%initial%value
         point%periods = map%periods
         point%impacts = result%impacts
         point%min_speed = result%min_speed
         point%period = result%response%sections%period
         allocate (point%tip, source=result%response%sections%displacement(:, 0, :))
         ! the multipliers are the eigenvalues of the derivative of the map, in descending order of magnitude; a huge
         ! value marks multipliers that were not found, so that the orbit counts as unstable
         allocate (matrix(n, n), source=scaled_derivative(map, result, n))
         allocate (real_part(n), imaginary_part(n), work(8*n))
         point%multiplier = spread(cmplx(huge(1.0_wp), 0.0_wp, wp), 1, n)
         ! the derivative at grazing is not finite
         if (.not. all(abs(matrix) < huge(1.0_wp))) return
         call dgeev('N', 'N', n, matrix, n, real_part, imaginary_part, left, 1, right, 1, work, size(work), info)
         if (info == 0) point%multiplier = cmplx(real_part, imaginary_part, wp)
         point%multiplier = point%multiplier(ascending_order(-abs(point%multiplier)))
      end associate
   end subroutine fill_point

   !> Derivative of the map with respect to the state, and perhaps the parameter, in units of the map.
   pure function scaled_derivative(map, result, columns) result(matrix)
      type(section_map_t), intent(in) :: map
      type(map_result_t), intent(in) :: result
      !> Number of variables; the parameter is the last one
      integer, intent(in) :: columns
      real(wp) :: matrix(size(result%derivative, 1), columns)

      integer :: i

      do i = 1, columns
         matrix(:, i) = result%derivative(:, i)*map%unit(i)/map%unit(:size(matrix, 1))
      end do
   end function scaled_derivative

   !> Unit direction in which an orbit of twice the period branches off: the eigenvector of the multiplier -1 by inverse
   !> iteration, because LAPACK's eigenvectors are inaccurate for matrices with both large and vanishing entries.
   subroutine doubling_direction(map, result, direction)
      type(section_map_t), intent(in) :: map
      type(map_result_t), intent(in) :: result
      !> Direction in units of the map, the parameter last, [unknowns + 1]; unallocated if the inverse iteration fails
      real(wp), allocatable, intent(out) :: direction(:)

      ! number of inverse iterations
      integer, parameter :: rounds = 3
      ! the matrix is the derivative of the map plus this number times the unit matrix; for exactly 1 it would be
      ! singular
      real(wp), parameter :: shift = 1.0_wp + 1.0e-9_wp
      real(wp), allocatable :: matrix(:, :), unit_vector(:), vector(:)
      integer :: i, n, round

      n = size(result%derivative, 1)
      allocate (matrix(n, n), source=scaled_derivative(map, result, n))
      do i = 1, n
         matrix(i, i) = matrix(i, i) + shift
      end do
      allocate (unit_vector(n), source=1.0_wp)
      do round = 1, rounds
         call solve_linear(matrix, unit_vector, vector)
         if (.not. allocated(vector)) return
         unit_vector = vector/norm2(vector)
      end do
      allocate (direction, source=[unit_vector, 0.0_wp])
   end subroutine doubling_direction

end module orbit_newton
