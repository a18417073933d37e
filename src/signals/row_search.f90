!> The first zero among many signals that are made of the same rows, so that none before it can be missed
!> (docs/theory.md, section 23).
!>
!> All signals take the same steps. A step over which a signal may have a zero is halved until there is certainly
!> none, or certainly just one.
module row_search
   use bracketed_zero, only: bracket_t, enter, go_to
   use kinds, only: i8, wp
   use row_basis, only: advance, advance_by, bound_rows, evaluate_rows, lowest_step, row_basis_t
   use row_signals, only: bounds_of, coefficients, error_share, most_nodes, row_path_t, row_signal_t, values_of
   implicit none (type, external)
   private
   public :: search_rows

   !> Error of the slope of a quintic Hermite polynomial as a share of B h**5 [Birkhoff].
   real(wp), parameter :: slope_error_share = sqrt(5.0_wp)/30000.0_wp

   !> A step is chosen so that the error is about this share of the value and of its change.
   real(wp), parameter :: chosen_share = 0.03_wp

   !> A search that takes more evaluations is left to searches of the signals one by one.
   integer(i8), parameter :: most_evaluations = 4_i8*most_nodes

   !> Can a signal vanish in a step?
   integer, parameter :: is_safe = 0
   integer, parameter :: is_unclear = 1
   integer, parameter :: is_crossing = 2

   !> A step: its start and length, the node at its end, and how many came before it.
   type :: step_t
      real(wp) :: from = 0.0_wp
      real(wp) :: length = 0.0_wp
      integer :: next = 0
      integer :: count = 0
      !> Value, slope and curvature of each signal at both ends, [0:2, signals]
      real(wp), allocatable :: here(:, :), there(:, :)
      !> Bound of the sixth derivative, rounding error, and what the signal does not come below, [signals]
      real(wp), allocatable :: bound(:), noise(:), floor(:)
      !> One of the constants above, [signals]
      integer, allocatable :: answer(:)
   end type step_t

contains

   !> Go on until the first signal vanishes, or to the limit.
   subroutine search_rows(basis, limit, signals, path, ended, time)
      type(row_basis_t), intent(inout) :: basis
      real(wp), intent(in) :: limit
      !> Those that are not sure are to be asked one by one
      type(row_signal_t), intent(inout) :: signals(:)
      !> The amplitudes at the start are in its first node
      type(row_path_t), intent(inout) :: path
      !> The signal that vanishes first; 0: none does
      integer, intent(out) :: ended
      !> When, or the limit
      real(wp), intent(out) :: time

      type(step_t) :: step
      integer :: at, n

      allocate (step%here(0:2, size(signals)), step%there(0:2, size(signals)), step%bound(size(signals)), &
         step%floor(size(signals)), step%noise(size(signals)), step%answer(size(signals)))
      ended = 0
      at = 0
      path%time(0) = 0.0_wp
      path%is_complete = .true.
      path%evaluations = 1_i8
      call evaluate_rows(basis, path%z(:, :, 0), path%rows(:, 0))
      do
         call begin_step(basis, limit, signals, path, at, step)
         if (.not. any(signals%is_sure .and. .not. step%floor > step%noise) .or. .not. step%from < limit) exit
         ! stiff terms make steps short, even if they are small: a search of one signal bounds them otherwise
         if (at == most_nodes .or. path%evaluations > most_evaluations) signals%is_sure = .false.
         if (.not. any(signals%is_sure)) exit
         step%next = at + 1
         call take_step(basis, limit, signals, path, at, step)
         if (.not. any(signals%is_sure)) exit
         step%count = step%count + 1
         do n = 1, size(signals)
            if (.not. signals(n)%is_sure) cycle
            signals(n)%start_order = 0
            if (step%answer(n) == is_safe) signals(n)%greatest = max(signals(n)%greatest, step%there(0, n))
            signals(n)%ceiling = max(signals(n)%ceiling, maxval(coefficients(step%here(:, n), step%there(:, n), &
               step%length)) + step%bound(n)*step%length**6*error_share(0) + step%noise(n))
         end do
         at = step%next
         step%from = path%time(at)
         if (any(signals%is_sure .and. step%answer == is_crossing)) then
            call find_crossing(basis, signals, step, path, at, ended)
            exit
         end if
      end do
      path%count = at
      time = merge(path%time(at), limit, ended > 0)
      if (ended > 0 .or. .not. step%from < limit) return
      path%is_complete = .false.
      signals%ceiling = huge(1.0_wp)
   end subroutine search_rows

   !> Signals at the start of a step.
   subroutine begin_step(basis, limit, signals, path, at, step)
      type(row_basis_t), intent(in) :: basis
      real(wp), intent(in) :: limit
      type(row_signal_t), intent(inout) :: signals(:)
      type(row_path_t), intent(inout) :: path
      !> The node there
      integer, intent(in) :: at
      type(step_t), intent(inout) :: step

      integer :: n

      call bound_rows(basis, path%z(:, :, at), path%bounds(:, at))
      do n = 1, size(signals)
         call values_of(basis, signals(n), path%rows(:, at), step%from, step%here(:, n))
         call bounds_of(basis, signals(n), path%bounds(:, at), step%from, step%count, step%bound(n), step%noise(n), &
            limit, step%floor(n))
         ! what has died away so far that its digits underflow has no zero
         if (max(maxval(abs(step%here(:, n))), step%bound(n)) < tiny(1.0_wp)/epsilon(1.0_wp)) step%floor(n) = &
            huge(1.0_wp)
         if (step%from > 0.0_wp) cycle
         call begin_signal(signals(n), step%here(:, n), step%noise(n))
      end do
   end subroutine begin_step

   !> A step so short that each signal that is sure has certainly no zero in it, or just one.
   subroutine take_step(basis, limit, signals, path, at, step)
      type(row_basis_t), intent(inout) :: basis
      real(wp), intent(in) :: limit
      type(row_signal_t), intent(inout) :: signals(:)
      type(row_path_t), intent(inout) :: path
      integer, intent(in) :: at
      type(step_t), intent(inout) :: step

      integer :: n, power

      power = min(minval(longest_steps(step%here, step%bound), mask=signals%is_sure), basis%highest)
      step%answer = is_safe
      associate (from => step%from, next => step%next, length => step%length)
         do
            length = 2.0_wp**power
            if (from + length < limit) then
               call advance(basis, power, path%z(:, :, at), path%z(:, :, next))
               path%time(next) = from + length
            else
               length = limit - from
               call advance_by(basis, length, path%z(:, :, at), path%z(:, :, next))
               path%time(next) = limit
            end if
            call evaluate_rows(basis, path%z(:, :, next), path%rows(:, next))
            path%evaluations = path%evaluations + 1_i8
            do n = 1, size(signals)
               if (.not. signals(n)%is_sure) cycle
               call values_of(basis, signals(n), path%rows(:, next), path%time(next), step%there(:, n))
               step%answer(n) = answer_of(step%here(:, n), step%there(:, n), length, signals(n)%start_order, &
                  step%bound(n), step%noise(n))
            end do
            if (.not. any(signals%is_sure .and. step%answer == is_unclear)) exit
            ! rounding errors decide, and shorter steps would not tell more
            where (step%answer == is_unclear .and. (step%bound*length**6*error_share(0) < 0.1_wp*step%noise .or. &
               power <= lowest_step .or. .not. from + 4.0_wp*length > from)) signals%is_sure = .false.
            if (.not. any(signals%is_sure .and. step%answer == is_unclear)) exit
            power = power - 1
            do while (.not. 2.0_wp**power < length)
               power = power - 1
            end do
         end do
      end associate
      where (.not. signals%is_sure) step%answer = is_safe
   end subroutine take_step

   !> What a signal is at the start: one that is not told from zero is to be asked alone.
   pure subroutine begin_signal(signal, here, noise)
      type(row_signal_t), intent(inout) :: signal
      !> Value, slope and curvature
      real(wp), intent(inout) :: here(0:2)
      real(wp), intent(in) :: noise

      ! below this share of its parts a value may be what rounding leaves
      real(wp), parameter :: least_share = 1.0e-9_wp

      signal%rounding = noise
      if (signal%start_order == 0) then
         signal%is_sure = signal%is_sure .and. here(0) > least_share*noise/epsilon(1.0_wp)
      else
         here(:min(signal%start_order - 1, 2)) = 0.0_wp
      end if
      signal%greatest = max(here(0), 0.0_wp)
      signal%ceiling = here(0)
   end subroutine begin_signal

   !> Exponent of 2 of a step for which the error of the polynomial is a small share of what the signal is or becomes.
   pure function longest_steps(here, bound) result(step)
      !> Value, slope and curvature of each signal, [3, signals]
      real(wp), intent(in) :: here(0:, :)
      !> Of the sixth derivatives, [signals]
      real(wp), intent(in) :: bound(:)
      integer :: step(size(bound))

      real(wp) :: least
      integer :: k, n

      do n = 1, size(bound)
         step(n) = lowest_step
         least = max(error_share(0)/chosen_share*bound(n), tiny(1.0_wp))
         do k = 0, 2
            step(n) = max(step(n), floor(real(exponent(abs(here(k, n))) - exponent(least) - 1)/real(6 - k)))
         end do
      end do
   end function longest_steps

   !> Can a signal vanish in a step?
   pure function answer_of(here, there, length, order, bound, noise) result(answer)
      !> Value, slope and curvature at both ends
      real(wp), intent(in) :: here(0:2)
      real(wp), intent(in) :: there(0:2)
      real(wp), intent(in) :: length
      !> Of the first derivative that does not vanish at the start
      integer, intent(in) :: order
      !> Of the sixth derivative, and the rounding error
      real(wp), intent(in) :: bound
      real(wp), intent(in) :: noise
      integer :: answer

      real(wp) :: b(0:5), size_of_error

      b = coefficients(here, there, length)
      size_of_error = bound*length**6
      answer = is_unclear
      if (minval(b(order:)) > size_of_error*error_share(order) + 2.0_wp*noise) then
         answer = is_safe
      else if (order == 0 .and. there(0) < -2.0_wp*noise) then
         ! 5/h times the differences bound the slope
         if (maxval(b(1:) - b(:4)) < -0.2_wp*size_of_error*slope_error_share - 4.0_wp*noise) answer = is_crossing
      end if
   end function answer_of

   !> The earliest zero in a step, in which some signals fall through zero without a turn.
   subroutine find_crossing(basis, signals, step, path, at, ended)
      type(row_basis_t), intent(in) :: basis
      type(row_signal_t), intent(in) :: signals(:)
      type(step_t), intent(in) :: step
      type(row_path_t), intent(inout) :: path
      !> The node at the end of the step, which gets the zero; another one than that at its start
      integer, intent(in) :: at
      integer, intent(out) :: ended

      ! roots of polynomials that are no nearer to each other come in the same order as zeros
      real(wp), parameter :: apart = 0.05_wp
      real(wp) :: best, root(size(signals)), zero
      integer :: n

      root = huge(1.0_wp)
      do n = 1, size(signals)
         if (step%answer(n) == is_crossing) root(n) = root_of(coefficients(step%here(:, n), step%there(:, n), &
            step%length))
      end do
      best = huge(1.0_wp)
      ended = 0
      do n = 1, size(signals)
         if (root(n) > minval(root) + apart) cycle
         zero = step%length*root(n)
         call polish(basis, signals(n), path, at, step%length, zero)
         if (zero > best) cycle
         best = zero
         ended = n
      end do
      ! the last one that was polished may be another
      if (count(root <= minval(root) + apart) > 1) call polish(basis, signals(ended), path, at, step%length, best)
   end subroutine find_crossing

   !> Zero of a falling polynomial in Bernstein's form, as a share of the step.
   pure function root_of(b) result(root)
      real(wp), intent(in) :: b(0:5)
      real(wp) :: root

      type(bracket_t) :: bracket
      real(wp) :: c(0:5), value, slope
      integer :: k

      c = [b(0), 5.0_wp*(b(1) - b(0)), 10.0_wp*(b(2) - 2.0_wp*b(1) + b(0)), &
         10.0_wp*(b(3) - 3.0_wp*b(2) + 3.0_wp*b(1) - b(0)), &
         5.0_wp*(b(4) - 4.0_wp*b(3) + 6.0_wp*b(2) - 4.0_wp*b(1) + b(0)), &
         b(5) - 5.0_wp*b(4) + 10.0_wp*b(3) - 10.0_wp*b(2) + 5.0_wp*b(1) - b(0)]
      bracket%high = 1.0_wp
      bracket%point = b(0)/(b(0) - b(5))
      bracket%least_step = 1.0e-9_wp
      do while (.not. bracket%is_found)
         value = c(5)
         slope = 0.0_wp
         do k = 4, 0, -1
            slope = value + bracket%point*slope
            value = c(k) + bracket%point*value
         end do
         call enter(bracket, value)
         call go_to(bracket, bracket%point - value/slope)
      end do
      root = bracket%point
   end function root_of

   !> The zero itself.
   subroutine polish(basis, signal, path, at, length, zero)
      type(row_basis_t), intent(in) :: basis
      type(row_signal_t), intent(in) :: signal
      type(row_path_t), intent(inout) :: path
      !> The node that gets it; the step starts at the one before
      integer, intent(in) :: at
      real(wp), intent(in) :: length
      !> Since the start of the step
      real(wp), intent(inout) :: zero

      ! the cube of a smaller correction is below rounding
      real(wp), parameter :: last_correction = 4.0e-6_wp
      real(wp) :: correction, from, values(0:2)
      integer :: before, i, n, round

      before = at - 1
      from = path%time(before)
      do round = 1, 10
         call advance_by(basis, zero, path%z(:, :, before), path%z(:, :, at))
         call evaluate_rows(basis, path%z(:, :, at), path%rows(:, at))
         path%evaluations = path%evaluations + 1_i8
         call values_of(basis, signal, path%rows(:, at), from + zero, values)
         correction = -values(0)/values(1)
         correction = correction - 0.5_wp*values(2)*correction**2/values(1)
         zero = min(max(zero + correction, 0.0_wp), length)
         if (abs(correction) <= last_correction*length .and. &
            abs(correction*values(2)) <= last_correction*abs(values(1))) exit
      end do
      n = basis%rows
      associate (rows => path%rows(:, at))
         do i = 1, n
            rows(i) = rows(i) + correction*(rows(i + n) + 0.5_wp*correction*rows(i + 2*n))
            rows(i + n) = rows(i + n) + correction*(rows(i + 2*n) + 0.5_wp*correction*rows(i + 3*n))
            rows(i + 2*n) = rows(i + 2*n) + correction*rows(i + 3*n)
         end do
      end associate
      path%time(at) = from + zero
   end subroutine polish

end module row_search
