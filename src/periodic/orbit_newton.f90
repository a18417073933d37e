!> Newton's method for a motion that returns, alone or at a distance from others along a branch, and its Floquet
!> multipliers (docs/theory.md, section 22).
module orbit_newton
   use kinds, only: wp
   use lapack_interfaces, only: dgeev, dgesv
   use orbit_types, only: orbit_point_t
   use section_map, only: evaluate_map, map_result_t, put_unknowns, section_map_t, unknowns_of
   use section_types, only: section_state_t
   implicit none (type, external)
   private
   public :: place_t, solution_t, close_orbit, find_direction, direction_of_multiplier, moved_along, distance_of

   !> Where a motion begins, and the value of the parameter.
   type :: place_t
      type(section_state_t) :: state
      real(wp) :: value = 0.0_wp
      !> Where in the period that is
      real(wp) :: turn = 0.0_wp
   end type place_t

   type :: solution_t
      type(place_t) :: place
      type(orbit_point_t) :: point
      type(map_result_t) :: map
      !> Least speed of an impact with restitution in all motions that were tried
      real(wp) :: least_speed = huge(1.0_wp)
      logical :: converged = .false.
   end type solution_t

contains

   !> From a guess to a motion that returns. With a direction the parameter is found, too: the sum of squares goes along
   !> the direction as far as the guess does.
   subroutine close_orbit(map, guess, tolerance, most_steps, solution, direction)
      type(section_map_t), target, intent(inout) :: map
      type(place_t), intent(in) :: guess
      !> Of the residual, in units of the motion
      real(wp), intent(in) :: tolerance
      integer, intent(in) :: most_steps
      type(solution_t), intent(out) :: solution
      !> In units of the map, [unknowns + 1]
      real(wp), intent(in), optional :: direction(:)

      integer, parameter :: most_halvings = 12
      type(place_t) :: trial
      type(map_result_t) :: result
      real(wp), allocatable :: move(:), residual(:)
      real(wp) :: share, size_of_residual
      logical :: fits
      integer :: halving, step

      map%turn = guess%turn
      solution%place = guess
      call put_unknowns(map, unknowns_of(map, guess%state), solution%place%state, fits)
      if (.not. fits) return
      call evaluate_map(map, solution%place%value, solution%place%state, solution%map)
      if (.not. allocated(solution%map%unknowns)) return
      solution%least_speed = solution%map%least_speed
      do step = 0, most_steps
         residual = residual_of(map, solution%place, solution%map)
         size_of_residual = norm2(residual)
         solution%point%residual = size_of_residual
         solution%point%iterations = step
         if (size_of_residual <= tolerance) exit
         if (step == most_steps) return
         call find_move(map, solution%map, residual, move, direction)
         if (.not. allocated(move)) return
         share = 1.0_wp
         do halving = 0, most_halvings
            if (halving == most_halvings) return
            trial = solution%place
            associate (n => size(residual))
               call put_unknowns(map, unknowns_of(map, trial%state) + share*map%unit(:n)*move(:n), trial%state, fits)
               trial%value = trial%value + share*map%unit(n + 1)*move(n + 1)
            end associate
            ! a load neither vanishes nor turns on the way
            if (map%parameter > 0) fits = fits .and. trial%value/guess%value > 0.1_wp
            share = 0.5_wp*share
            if (.not. fits) cycle
            call evaluate_map(map, trial%value, trial%state, result)
            if (.not. allocated(result%unknowns)) cycle
            solution%least_speed = min(solution%least_speed, result%least_speed)
            if (norm2(residual_of(map, trial, result)) < (1.0_wp - 1.0e-3_wp*share)*size_of_residual) exit
         end do
         solution%place = trial
         solution%map = result
      end do
      if (solution%map%failed) return
      solution%converged = .true.
      call fill_point(map, solution)
   end subroutine close_orbit

   !> A guess in a direction.
   function moved_along(map, place, direction, length) result(guess)
      type(section_map_t), intent(in) :: map
      type(place_t), intent(in) :: place
      !> In units of the map, [unknowns + 1]
      real(wp), intent(in) :: direction(:)
      real(wp), intent(in) :: length
      type(place_t) :: guess

      logical :: fits

      guess = place
      associate (n => size(direction) - 1)
         call put_unknowns(map, unknowns_of(map, place%state) + length*map%unit(:n)*direction(:n), guess%state, fits)
         guess%value = place%value + length*map%unit(n + 1)*direction(n + 1)
      end associate
   end function moved_along

   !> In units of the map.
   pure function distance_of(map, place, other) result(distance)
      type(section_map_t), intent(in) :: map
      type(place_t), intent(in) :: place
      type(place_t), intent(in) :: other
      real(wp) :: distance

      distance = norm2([unknowns_of(map, place%state) - unknowns_of(map, other%state), place%value - other%value] &
         /map%unit)
   end function distance_of

   !> By how much the motion misses its start.
   pure function residual_of(map, place, result) result(residual)
      type(section_map_t), intent(in) :: map
      type(place_t), intent(in) :: place
      type(map_result_t), intent(in) :: result
      real(wp), allocatable :: residual(:)

      allocate (residual, source=(result%unknowns - unknowns_of(map, place%state)))
      residual = residual/map%unit(:size(residual))
   end function residual_of

   !> Newton's step, in units of the map; unallocated: there is none.
   subroutine find_move(map, result, residual, move, direction)
      type(section_map_t), intent(in) :: map
      type(map_result_t), intent(in) :: result
      real(wp), intent(in) :: residual(:)
      real(wp), allocatable, intent(out) :: move(:)
      real(wp), intent(in), optional :: direction(:)

      real(wp), allocatable :: matrix(:, :), right(:, :)
      integer :: n

      n = size(residual)
      if (present(direction)) then
         allocate (matrix, source=bordered(map, result, direction))
      else
         allocate (matrix, source=bordered(map, result, [spread(0.0_wp, 1, n), 1.0_wp]))
      end if
      allocate (right(n + 1, 1), source=reshape([-residual, 0.0_wp], [n + 1, 1]))
      call solve(matrix, right, move)
   end subroutine find_move

   !> The derivative of the residual in units of the map, and a last row.
   pure function bordered(map, result, row) result(matrix)
      type(section_map_t), intent(in) :: map
      type(map_result_t), intent(in) :: result
      real(wp), intent(in) :: row(:)
      real(wp), allocatable :: matrix(:, :)

      integer :: i, n

      n = size(row) - 1
      allocate (matrix(n + 1, n + 1))
      do i = 1, n + 1
         matrix(:n, i) = result%derivative(:, i)*map%unit(i)/map%unit(:n)
      end do
      do i = 1, n
         matrix(i, i) = matrix(i, i) - 1.0_wp
      end do
      matrix(n + 1, :) = row
   end function bordered

   subroutine solve(matrix, right, solution)
      real(wp), intent(inout) :: matrix(:, :)
      real(wp), intent(inout) :: right(:, :)
      !> Unallocated: there is none
      real(wp), allocatable, intent(out) :: solution(:)

      integer :: info, pivot(size(right))

      ! the derivative at a graze is no number
      if (.not. all(abs(matrix) < huge(1.0_wp))) return
      call dgesv(size(right), 1, matrix, size(right), pivot, right, size(right), info)
      if (info /= 0) return
      if (all(abs(right) < huge(1.0_wp))) allocate (solution, source=right(:, 1))
   end subroutine solve

   !> The direction of a branch at a motion that returns, of length 1, on the side of another.
   subroutine find_direction(map, result, along, direction)
      type(section_map_t), intent(in) :: map
      type(map_result_t), intent(in) :: result
      !> [unknowns + 1]
      real(wp), intent(in) :: along(:)
      !> Unallocated: there is none
      real(wp), allocatable, intent(out) :: direction(:)

      real(wp), allocatable :: matrix(:, :), right(:, :)

      allocate (matrix, source=bordered(map, result, along))
      allocate (right(size(along), 1), source=0.0_wp)
      right(size(along), 1) = 1.0_wp
      call solve(matrix, right, direction)
      if (allocated(direction)) direction = direction/norm2(direction)
   end subroutine find_direction

   !> Multipliers, what sections of phase 0 have, impacts.
   subroutine fill_point(map, solution)
      type(section_map_t), intent(in) :: map
      type(solution_t), intent(inout) :: solution

      associate (point => solution%point, result => solution%map)
         point%value = solution%place%value
         point%periods = map%periods
         point%impacts = result%impacts
         point%least_speed = result%least_speed
         point%period = result%response%sections%period
         allocate (point%tip, source=result%response%sections%tip)
         call find_multipliers(map, result, point%multiplier)
      end associate
   end subroutine fill_point

   !> Eigenvalues of the derivative, the greatest first.
   subroutine find_multipliers(map, result, multiplier)
      type(section_map_t), intent(in) :: map
      type(map_result_t), intent(in) :: result
      complex(wp), allocatable, intent(out) :: multiplier(:)

      complex(wp) :: other
      real(wp), allocatable :: matrix(:, :), real_part(:), imaginary_part(:), work(:)
      real(wp), dimension(1, 1) :: left, right
      integer :: i, info, j, n

      n = size(result%derivative, 1)
      allocate (matrix(n, n), source=scaled(map, result))
      allocate (real_part(n), imaginary_part(n), work(8*n))
      call dgeev('N', 'N', n, matrix, n, real_part, imaginary_part, left, 1, right, 1, work, size(work), info)
      allocate (multiplier(n), source=cmplx(huge(1.0_wp), 0.0_wp, wp))
      if (info == 0) multiplier = cmplx(real_part, imaginary_part, wp)
      do i = 2, n
         other = multiplier(i)
         j = i - 1
         do while (j > 0)
            if (abs(multiplier(j)) >= abs(other)) exit
            multiplier(j + 1) = multiplier(j)
            j = j - 1
         end do
         multiplier(j + 1) = other
      end do
   end subroutine find_multipliers

   !> The derivative by the state, in units of the map.
   pure function scaled(map, result) result(matrix)
      type(section_map_t), intent(in) :: map
      type(map_result_t), intent(in) :: result
      real(wp) :: matrix(size(result%derivative, 1), size(result%derivative, 1))

      integer :: i

      associate (n => size(matrix, 1))
         do i = 1, n
            matrix(:, i) = result%derivative(:, i)*map%unit(i)/map%unit(:n)
         end do
      end associate
   end function scaled

   !> Where a motion goes beside one of which a multiplier is -1, of length 1: by inverse iteration, as LAPACK's vectors
   !> of matrices with both great and vanishing numbers are of no use.
   subroutine direction_of_multiplier(map, result, direction)
      type(section_map_t), intent(in) :: map
      type(map_result_t), intent(in) :: result
      !> [unknowns + 1]; unallocated: there is none
      real(wp), allocatable, intent(out) :: direction(:)

      integer, parameter :: rounds = 3
      ! beside the multiplier, so that the matrix has an inverse
      real(wp), parameter :: shift = 1.0_wp + 1.0e-9_wp
      real(wp), allocatable :: matrix(:, :), right(:, :), vector(:)
      integer :: i, n, round

      n = size(result%derivative, 1)
      allocate (right(n, 1), source=1.0_wp)
      do round = 1, rounds
         allocate (matrix(n, n), source=scaled(map, result))
         do i = 1, n
            matrix(i, i) = matrix(i, i) + shift
         end do
         call solve(matrix, right, vector)
         deallocate (matrix)
         if (.not. allocated(vector)) return
         right(:, 1) = vector/norm2(vector)
      end do
      allocate (direction, source=[right(:, 1), 0.0_wp])
   end subroutine direction_of_multiplier

end module orbit_newton
