!> The first zero among many signals that are made of the same rows, so that none before it can be missed, and the
!> greatest values of rows on the way (docs/theory.md, section 23).
!>
!> All signals take the same steps. Over a step of length h a signal differs from the quintic Hermite polynomial that
!> shares its value, slope and curvature at both ends by at most B h**6/46080, where B bounds its sixth derivative; the
!> coefficients of the polynomial in Bernstein's form bound the polynomial. A step over which a signal may have a zero is
!> halved until there is certainly none, or certainly just one.
module row_search
   use bracketed_zero, only: bracket_t, enter, go_to
   use kinds, only: i8, wp
   use row_basis, only: advance, advance_by, bound_rows, evaluate_rows, lowest_step, place_of, rate_size_column, &
      row_basis_t, seventh_column, sixth_column, size_column
   implicit none (type, external)
   private
   public :: row_signal_t, row_path_t, search_rows, greatest_on_path, node_at_time, value_at_node, most_nodes, peak_tolerance

   !> Room for so many steps; of a longer path the end is known, and not the way.
   integer, parameter :: most_nodes = 64

   !> A higher peak in the same phase is missed only if it is higher by less than this share.
   real(wp), parameter :: peak_tolerance = 1.0e-6_wp

   !> Errors of a quintic Hermite polynomial as shares of B h**6, where the signal and its first derivatives vanish at
   !> the start: x**3 (1 - x)**3/720 is at most so many times x**order. And of its derivative: [Birkhoff].
   real(wp), parameter :: error_share(0:3) = [1.0_wp/46080.0_wp, 0.03456_wp/720.0_wp, 0.10547_wp/720.0_wp, &
      1.0_wp/720.0_wp]
   real(wp), parameter :: slope_error_share = sqrt(5.0_wp)/30000.0_wp

   !> A step is chosen so that the error is about this share of the value and of its change.
   real(wp), parameter :: chosen_share = 0.03_wp

   !> A signal offset + slope t + factor row + of_rate row'.
   type :: row_signal_t
      integer :: row = 1
      real(wp) :: factor = 1.0_wp
      real(wp) :: of_rate = 0.0_wp
      real(wp) :: offset = 0.0_wp
      real(wp) :: slope = 0.0_wp
      !> It and so many of its derivatives less one vanish at the start, and the next is positive; 0: it is positive
      integer :: start_order = 0
      !> Whether it has a zero could be told
      logical :: is_sure = .true.
      !> Greatest value seen on the way, and what it does not exceed there
      real(wp) :: greatest = 0.0_wp
      real(wp) :: ceiling = 0.0_wp
      !> Rounding error of its value at the start
      real(wp) :: rounding = 0.0_wp
   end type row_signal_t

   !> The steps of a phase.
   type :: row_path_t
      !> Number of nodes, and whether they reach from the start to the end
      integer :: count = 0
      logical :: is_complete = .false.
      !> Since the start of the phase, [nodes]
      real(wp) :: time(0:most_nodes)
      !> Amplitudes, rows and bounds of rows there, as `row_basis` has them, [.., 0:most_nodes]
      real(wp), allocatable :: z(:, :, :), rows(:, :), bounds(:, :)
      integer(i8) :: evaluations = 0_i8
   end type row_path_t

   !> Can a signal vanish in a step?
   integer, parameter :: is_safe = 0
   integer, parameter :: is_unclear = 1
   integer, parameter :: is_crossing = 2

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

      real(wp), dimension(0:2, size(signals)) :: here, there
      real(wp), dimension(size(signals)) :: bound, floor, noise
      integer :: answer(size(signals))
      real(wp) :: from, length
      integer :: at, n, next, step, steps

      ended = 0
      at = 0
      from = 0.0_wp
      path%time(0) = 0.0_wp
      path%is_complete = .true.
      path%evaluations = 1_i8
      call evaluate_rows(basis, path%z(:, :, 0), path%rows(:, 0))
      steps = 0
      do
         call bound_rows(basis, path%z(:, :, at), path%bounds(:, at))
         do n = 1, size(signals)
            call values_of(basis, signals(n), path%rows(:, at), from, here(:, n))
            call bounds_of(basis, signals(n), path%bounds(:, at), from, steps, bound(n), noise(n), limit, floor(n))
            ! what has died away so far that its digits underflow has no zero
            if (max(maxval(abs(here(:, n))), bound(n)) < tiny(1.0_wp)/epsilon(1.0_wp)) floor(n) = huge(1.0_wp)
            if (from > 0.0_wp) cycle
            call begin_signal(signals(n), here(:, n), noise(n))
         end do
         if (.not. any(signals%is_sure .and. .not. floor > noise) .or. .not. from < limit) exit
         answer = is_safe
         step = min(minval(longest_steps(here, bound), mask=signals%is_sure), basis%highest)
         next = at + 1
         if (at == most_nodes) then
            path%is_complete = .false.
            next = 0
         end if
         do
            length = 2.0_wp**step
            if (from + length < limit) then
               call advance(basis, step, path%z(:, :, at), path%z(:, :, next))
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
               call values_of(basis, signals(n), path%rows(:, next), path%time(next), there(:, n))
               answer(n) = answer_of(here(:, n), there(:, n), length, signals(n)%start_order, bound(n), noise(n))
            end do
            if (.not. any(signals%is_sure .and. answer == is_unclear)) exit
            ! rounding errors decide, and shorter steps would not tell more
            where (answer == is_unclear .and. (bound*length**6*error_share(0) < 0.1_wp*noise .or. &
               step <= lowest_step .or. .not. from + 4.0_wp*length > from)) signals%is_sure = .false.
            if (.not. any(signals%is_sure .and. answer == is_unclear)) exit
            do
               step = step - 1
               if (2.0_wp**step < length) exit
            end do
         end do
         if (.not. any(signals%is_sure)) exit
         steps = steps + 1
         do n = 1, size(signals)
            if (.not. signals(n)%is_sure) cycle
            signals(n)%start_order = 0
            if (answer(n) == is_safe) signals(n)%greatest = max(signals(n)%greatest, there(0, n))
            signals(n)%ceiling = max(signals(n)%ceiling, maxval(coefficients(here(:, n), there(:, n), length)) &
               + bound(n)*length**6*error_share(0) + noise(n))
         end do
         at = next
         from = path%time(next)
         if (any(signals%is_sure .and. answer == is_crossing)) then
            call find_crossing(basis, signals, merge(is_safe, answer, .not. signals%is_sure), here, there, length, &
               path, at, ended)
            exit
         end if
      end do
      path%count = at
      time = merge(path%time(at), limit, ended > 0)
      path%is_complete = path%is_complete .and. (ended > 0 .or. .not. from < limit)
      if (ended == 0 .and. from < limit) signals%ceiling = huge(1.0_wp)
   end subroutine search_rows

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

   !> Value, slope and curvature.
   pure subroutine values_of(basis, signal, rows, time, values)
      type(row_basis_t), intent(in) :: basis
      type(row_signal_t), intent(in) :: signal
      real(wp), contiguous, intent(in) :: rows(:)
      real(wp), intent(in) :: time
      real(wp), intent(out) :: values(0:2)

      associate (n => basis%rows, i => signal%row)
         values(0) = signal%offset + signal%slope*time + signal%factor*rows(i) + signal%of_rate*rows(i + n)
         values(1) = signal%slope + signal%factor*rows(i + n) + signal%of_rate*rows(i + 2*n)
         values(2) = signal%factor*rows(i + 2*n) + signal%of_rate*rows(i + 3*n)
      end associate
   end subroutine values_of

   !> Bound of the sixth derivative, rounding error, and what the signal does not come below before the limit.
   pure subroutine bounds_of(basis, signal, bounds, time, steps, bound, noise, limit, floor)
      type(row_basis_t), intent(in) :: basis
      type(row_signal_t), intent(in) :: signal
      real(wp), contiguous, intent(in) :: bounds(:)
      !> Since the start, and by so many products
      real(wp), intent(in) :: time
      integer, intent(in) :: steps
      real(wp), intent(out) :: bound
      real(wp), intent(out) :: noise
      real(wp), intent(in), optional :: limit
      real(wp), intent(out), optional :: floor

      real(wp) :: curvature, magnitude, rate

      associate (factor => abs(signal%factor), of_rate => abs(signal%of_rate), row => signal%row)
         associate (sixth => bounds(place_of(basis, row, sixth_column)), &
            size_of_rate => bounds(place_of(basis, row, rate_size_column)))
            bound = factor*sixth
            magnitude = factor*bounds(place_of(basis, row, size_column))
            rate = factor*size_of_rate
            if (of_rate > 0.0_wp) then
               bound = bound + of_rate*bounds(place_of(basis, row, seventh_column))
               magnitude = magnitude + of_rate*size_of_rate
               ! Hoelder's inequality
               curvature = 0.0_wp
               if (size_of_rate > 0.0_wp) curvature = size_of_rate*(sixth/size_of_rate)**0.2_wp
               rate = rate + of_rate*curvature
            end if
         end associate
      end associate
      noise = epsilon(1.0_wp)*((4.0_wp + 2.0_wp*real(steps, wp))*magnitude + time*rate &
         + 4.0_wp*(abs(signal%offset) + abs(signal%slope)*time))
      if (present(floor)) floor = signal%offset + min(signal%slope*time, signal%slope*limit) - magnitude
   end subroutine bounds_of

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

   !> Coefficients of the polynomial in Bernstein's form.
   pure function coefficients(here, there, length) result(b)
      !> Value, slope and curvature at both ends
      real(wp), intent(in) :: here(0:2)
      real(wp), intent(in) :: there(0:2)
      real(wp), intent(in) :: length
      real(wp) :: b(0:5)

      b(0) = here(0)
      b(1) = here(0) + 0.2_wp*length*here(1)
      b(2) = here(0) + 0.4_wp*length*here(1) + 0.05_wp*length**2*here(2)
      b(3) = there(0) - 0.4_wp*length*there(1) + 0.05_wp*length**2*there(2)
      b(4) = there(0) - 0.2_wp*length*there(1)
      b(5) = there(0)
   end function coefficients

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
   subroutine find_crossing(basis, signals, answer, here, there, length, path, at, ended)
      type(row_basis_t), intent(in) :: basis
      type(row_signal_t), intent(in) :: signals(:)
      !> Of each signal
      integer, intent(in) :: answer(:)
      !> Value, slope and curvature at both ends, [3, signals]
      real(wp), intent(in) :: here(0:, :)
      real(wp), intent(in) :: there(0:, :)
      real(wp), intent(in) :: length
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
         if (answer(n) == is_crossing) root(n) = root_of(coefficients(here(:, n), there(:, n), length))
      end do
      best = huge(1.0_wp)
      ended = 0
      do n = 1, size(signals)
         if (root(n) > minval(root) + apart) cycle
         zero = length*root(n)
         call polish(basis, signals(n), path, at, length, zero)
         if (zero > best) cycle
         best = zero
         ended = n
      end do
      ! the last one that was polished may be another
      if (count(root <= minval(root) + apart) > 1) call polish(basis, signals(ended), path, at, length, best)
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

      before = merge(most_nodes, at - 1, at == 0)
      from = path%time(before)
      do round = 1, 10
         call advance_by(basis, zero, path%z(:, :, before), path%z(:, :, at))
         call evaluate_rows(basis, path%z(:, :, at), path%rows(:, at))
         path%evaluations = path%evaluations + 1_i8
         call values_of(basis, signal, path%rows(:, at), from + zero, values)
         correction = -values(0)/values(1)
         correction = correction - 0.5_wp*values(2)*correction**2/values(1)
         zero = min(max(zero + correction, 0.0_wp), length)
         if (abs(correction) <= last_correction*length .and. abs(correction*values(2)) <= last_correction*abs(values(1))) exit
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

   !> The node at the start or at the end of a path; -1: neither is at that time.
   pure function node_at_time(path, time) result(node)
      type(row_path_t), intent(in) :: path
      real(wp), intent(in) :: time
      integer :: node

      node = -1
      if (.not. time > 0.0_wp) node = 0
      if (.not. abs(time - path%time(path%count)) > 0.0_wp) node = path%count
   end function node_at_time

   !> A signal and its rate at a node.
   pure function value_at_node(basis, path, signal, node) result(state)
      type(row_basis_t), intent(in) :: basis
      type(row_path_t), intent(in) :: path
      type(row_signal_t), intent(in) :: signal
      integer, intent(in) :: node
      real(wp) :: state(2)

      real(wp) :: values(0:2)

      call values_of(basis, signal, path%rows(:, node), path%time(node), values)
      state = values(:1)
   end function value_at_node

   !> The greatest value of a signal from one instant of a path to another, if it exceeds what is known.
   subroutine greatest_on_path(basis, path, signal, ends, scale, is_found, value, time)
      type(row_basis_t), intent(in) :: basis
      type(row_path_t), intent(inout) :: path
      type(row_signal_t), intent(in) :: signal
      real(wp), intent(in) :: ends(2)
      !> A peak that is higher by less than a small share of itself, or of this, may be missed
      real(wp), intent(in) :: scale
      logical, intent(out) :: is_found
      !> What is known; the greatest value
      real(wp), intent(inout) :: value
      !> Its instant
      real(wp), intent(inout) :: time

      type :: stretch_t
         real(wp) :: from, to
         real(wp) :: here(0:2), there(0:2)
      end type stretch_t
      type(stretch_t) :: open(64), stretch
      real(wp), allocatable :: z(:, :), rows(:)
      real(wp) :: bound, middle(0:2), noise, t
      integer :: node, waiting

      associate (from => ends(1), to => ends(2))
      is_found = .false.
      allocate (z, mold=path%z(:, :, 0))
      allocate (rows, mold=path%rows(:, 0))
      do node = 0, path%count - 1
         if (path%time(node + 1) <= from .or. path%time(node) >= to) cycle
         call bounds_of(basis, signal, path%bounds(:, node), path%time(node), node, bound, noise)
         stretch%from = path%time(node)
         stretch%to = path%time(node + 1)
         call values_of(basis, signal, path%rows(:, node), stretch%from, stretch%here)
         call values_of(basis, signal, path%rows(:, node + 1), stretch%to, stretch%there)
         if (stretch%from < from) call cut(from, stretch%from, stretch%here)
         if (stretch%to > to) call cut(to, stretch%to, stretch%there)
         call take(stretch%from, stretch%here(0))
         call take(stretch%to, stretch%there(0))
         open(1) = stretch
         waiting = 1
         do while (waiting > 0)
            stretch = open(waiting)
            waiting = waiting - 1
            associate (length => stretch%to - stretch%from)
               if (.not. maxval(coefficients(stretch%here, stretch%there, length)) + bound*length**6*error_share(0) &
                  > higher(value)) cycle
               t = stretch%from + length*top_of(coefficients(stretch%here, stretch%there, length))
            end associate
            if (.not. (t > stretch%from .and. t < stretch%to) .or. waiting + 2 > size(open)) cycle
            call climb(stretch%from, stretch%to, t, middle)
            call take(t, middle(0))
            open(waiting + 1) = stretch
            open(waiting + 1)%to = t
            open(waiting + 1)%there = middle
            open(waiting + 2) = stretch
            open(waiting + 2)%from = t
            open(waiting + 2)%here = middle
            waiting = waiting + 2
         end do
      end do
      end associate

   contains

      !> What is greater.
      pure function higher(known) result(level)
         real(wp), intent(in) :: known
         real(wp) :: level

         level = known + peak_tolerance*max(abs(known), scale) + 4.0_wp*noise
      end function higher

      subroutine take(instant, found)
         real(wp), intent(in) :: instant
         real(wp), intent(in) :: found

         if (.not. found > value) return
         is_found = .true.
         value = found
         time = instant
      end subroutine take

      subroutine values_at(instant, values)
         real(wp), intent(in) :: instant
         real(wp), intent(out) :: values(0:2)

         call advance_by(basis, instant - path%time(node), path%z(:, :, node), z)
         call evaluate_rows(basis, z, rows)
         path%evaluations = path%evaluations + 1_i8
         call values_of(basis, signal, rows, instant, values)
      end subroutine values_at

      !> To the top by Newton's method, while that stays within a stretch.
      subroutine climb(least, most, instant, values)
         real(wp), intent(in) :: least
         real(wp), intent(in) :: most
         real(wp), intent(inout) :: instant
         real(wp), intent(out) :: values(0:2)

         integer, parameter :: most_rounds = 6
         real(wp), parameter :: least_shift = 1.0e-9_wp
         real(wp) :: shift
         integer :: round

         do round = 1, most_rounds
            call values_at(instant, values)
            if (.not. values(2) < 0.0_wp) return
            shift = -values(1)/values(2)
            if (.not. (instant + shift > least .and. instant + shift < most)) return
            if (abs(shift) <= least_shift*(most - least)) return
            instant = instant + shift
         end do
      end subroutine climb

      !> Begin or end a stretch within a step.
      subroutine cut(instant, end, values)
         real(wp), intent(in) :: instant
         real(wp), intent(out) :: end
         real(wp), intent(out) :: values(0:2)

         end = instant
         call values_at(instant, values)
      end subroutine cut
   end subroutine greatest_on_path

   !> About where a polynomial in Bernstein's form is greatest, as a share of the step: not too near to its ends.
   pure function top_of(b) result(top)
      real(wp), intent(in) :: b(0:5)
      real(wp) :: top

      integer, parameter :: samples = 16
      real(wp) :: best, c(0:5), value, x
      integer :: i, k

      c = b
      best = -huge(1.0_wp)
      top = 0.5_wp
      do i = 1, samples - 1
         x = real(i, wp)/real(samples, wp)
         c = b
         do k = 5, 1, -1
            c(:k - 1) = c(:k - 1) + x*(c(1:k) - c(:k - 1))
         end do
         value = c(0)
         if (value <= best) cycle
         best = value
         top = x
      end do
   end function top_of

end module row_search
