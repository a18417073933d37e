!> The maximum of a signal over the steps of a path (docs/theory.md, section 23).
module row_peaks
   use kinds, only: i8, wp
   use row_basis, only: advance_by, evaluate_rows, row_basis_t
   use row_signals, only: bounds_of, coefficients, error_share, row_path_t, row_signal_t, values_of
   implicit none (type, external)
   private
   public :: greatest_on_path, peak_tolerance

   !> A higher peak in the same phase is missed only if it is higher by less than this share.
   real(wp), parameter :: peak_tolerance = 1.0e-6_wp

   !> An interval within a step: its ends, and value, slope and curvature of the signal at both ends.
   type :: interval_t
      real(wp) :: from = 0.0_wp
      real(wp) :: to = 0.0_wp
      real(wp) :: at_start(0:2) = 0.0_wp
      real(wp) :: at_end(0:2) = 0.0_wp
   end type interval_t

   !> The maximum found until now and its instant.
   type :: maximum_t
      real(wp) :: value = 0.0_wp
      real(wp) :: time = 0.0_wp
      logical :: is_found = .false.
   end type maximum_t

contains

   !> The maximum of a signal between two instants of a path, if it exceeds a known value.
   subroutine greatest_on_path(basis, path, signal, ends, scale, is_found, value, time)
      type(row_basis_t), intent(in) :: basis
      type(row_path_t), intent(inout) :: path
      type(row_signal_t), intent(in) :: signal
      real(wp), intent(in) :: ends(2)
      !> The search may miss a peak that is higher by less than the share `peak_tolerance` of itself or of this
      real(wp), intent(in) :: scale
      logical, intent(out) :: is_found
      !> In: the known value. Out: the maximum, if it is higher
      real(wp), intent(inout) :: value
      !> Instant of the maximum
      real(wp), intent(inout) :: time

      type(maximum_t) :: best
      type(interval_t) :: step
      integer :: node

      best%value = value
      do node = 0, path%count - 1
         if (path%time(node + 1) <= ends(1) .or. path%time(node) >= ends(2)) cycle
         step%from = max(path%time(node), ends(1))
         step%to = min(path%time(node + 1), ends(2))
         if (step%from > path%time(node)) then
            call values_at(basis, path, signal, node, step%from, step%at_start)
         else
            call values_of(basis, signal, path%rows(:, node), step%from, step%at_start)
         end if
         if (step%to < path%time(node + 1)) then
            call values_at(basis, path, signal, node, step%to, step%at_end)
         else
            call values_of(basis, signal, path%rows(:, node + 1), step%to, step%at_end)
         end if
         call update_maximum(step%from, step%at_start(0), best)
         call update_maximum(step%to, step%at_end(0), best)
         call search_step(basis, path, signal, node, scale, step, best)
      end do
      is_found = best%is_found
      if (is_found) value = best%value
      if (is_found) time = best%time
   end subroutine greatest_on_path

   !> The maximum in a step: an interval in which the signal may exceed the maximum found until now is divided at its
   !> highest point.
   subroutine search_step(basis, path, signal, node, scale, step, best)
      type(row_basis_t), intent(in) :: basis
      type(row_path_t), intent(inout) :: path
      type(row_signal_t), intent(in) :: signal
      !> Node at the start of the step
      integer, intent(in) :: node
      real(wp), intent(in) :: scale
      type(interval_t), intent(in) :: step
      type(maximum_t), intent(inout) :: best

      type(interval_t) :: stack(64), interval
      real(wp) :: b(0:5), bound, level, length, middle(0:2), noise, t
      integer :: depth

      call bounds_of(basis, signal, path%bounds(:, node), path%time(node), node, bound, noise)
      stack(1) = step
      depth = 1
      do while (depth > 0)
         interval = stack(depth)
         depth = depth - 1
         length = interval%to - interval%from
         b = coefficients(interval%at_start, interval%at_end, length)
         level = best%value + peak_tolerance*max(abs(best%value), scale) + 4.0_wp*noise
         if (.not. maxval(b) + bound*length**6*error_share(0) > level) cycle
         t = interval%from + length*sampled_maximum(b)
         if (.not. (t > interval%from .and. t < interval%to) .or. depth + 2 > size(stack)) cycle
         call refine_maximum(basis, path, signal, node, interval, t, middle)
         call update_maximum(t, middle(0), best)
         stack(depth + 1) = interval_t(interval%from, t, interval%at_start, middle)
         stack(depth + 2) = interval_t(t, interval%to, middle, interval%at_end)
         depth = depth + 2
      end do
   end subroutine search_step

   !> Replace the maximum by a higher value.
   pure subroutine update_maximum(instant, found, best)
      real(wp), intent(in) :: instant
      real(wp), intent(in) :: found
      type(maximum_t), intent(inout) :: best

      if (found > best%value) best = maximum_t(found, instant, .true.)
   end subroutine update_maximum

   !> A signal, its slope and its curvature at an instant of a step.
   subroutine values_at(basis, path, signal, node, instant, values)
      type(row_basis_t), intent(in) :: basis
      type(row_path_t), intent(inout) :: path
      type(row_signal_t), intent(in) :: signal
      integer, intent(in) :: node
      real(wp), intent(in) :: instant
      real(wp), intent(out) :: values(0:2)

      real(wp) :: rows(size(path%rows, 1)), z(size(path%z, 1), 2)

      call advance_by(basis, instant - path%time(node), path%z(:, :, node), z)
      call evaluate_rows(basis, z, rows)
      path%evaluations = path%evaluations + 1_i8
      call values_of(basis, signal, rows, instant, values)
   end subroutine values_at

   !> Move to the local maximum by Newton's method, as long as the iteration stays within the interval.
   subroutine refine_maximum(basis, path, signal, node, interval, instant, values)
      type(row_basis_t), intent(in) :: basis
      type(row_path_t), intent(inout) :: path
      type(row_signal_t), intent(in) :: signal
      integer, intent(in) :: node
      type(interval_t), intent(in) :: interval
      real(wp), intent(inout) :: instant
      real(wp), intent(out) :: values(0:2)

      integer, parameter :: max_rounds = 6
      real(wp), parameter :: min_shift = 1.0e-9_wp
      real(wp) :: shift
      integer :: round

      do round = 1, max_rounds
         call values_at(basis, path, signal, node, instant, values)
         if (.not. values(2) < 0.0_wp) return
         shift = -values(1)/values(2)
         if (.not. (instant + shift > interval%from .and. instant + shift < interval%to)) return
         if (abs(shift) <= min_shift*(interval%to - interval%from)) return
         instant = instant + shift
      end do
   end subroutine refine_maximum

   !> Approximate position of the maximum of a polynomial in Bernstein's form, by samples inside the step, as a share of
   !> the step.
   pure function sampled_maximum(b) result(top)
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
   end function sampled_maximum

end module row_peaks
