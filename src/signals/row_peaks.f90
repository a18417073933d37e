!> The greatest value of a signal on a path of steps (docs/theory.md, section 23).
module row_peaks
   use kinds, only: i8, wp
   use row_basis, only: advance_by, evaluate_rows, row_basis_t
   use row_signals, only: bounds_of, coefficients, error_share, row_path_t, row_signal_t, values_of
   implicit none (type, external)
   private
   public :: greatest_on_path, peak_tolerance

   !> A higher peak in the same phase is missed only if it is higher by less than this share.
   real(wp), parameter :: peak_tolerance = 1.0e-6_wp

   !> A part of a step: its ends, and value, slope and curvature of the signal there.
   type :: stretch_t
      real(wp) :: from = 0.0_wp
      real(wp) :: to = 0.0_wp
      real(wp) :: here(0:2) = 0.0_wp
      real(wp) :: there(0:2) = 0.0_wp
   end type stretch_t

   !> What has been found.
   type :: best_t
      real(wp) :: value = 0.0_wp
      real(wp) :: time = 0.0_wp
      logical :: is_found = .false.
   end type best_t

contains

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

      type(best_t) :: best
      type(stretch_t) :: step
      integer :: node

      best%value = value
      do node = 0, path%count - 1
         if (path%time(node + 1) <= ends(1) .or. path%time(node) >= ends(2)) cycle
         step%from = max(path%time(node), ends(1))
         step%to = min(path%time(node + 1), ends(2))
         if (step%from > path%time(node)) then
            call values_at(basis, path, signal, node, step%from, step%here)
         else
            call values_of(basis, signal, path%rows(:, node), step%from, step%here)
         end if
         if (step%to < path%time(node + 1)) then
            call values_at(basis, path, signal, node, step%to, step%there)
         else
            call values_of(basis, signal, path%rows(:, node + 1), step%to, step%there)
         end if
         call take(step%from, step%here(0), best)
         call take(step%to, step%there(0), best)
         call seek_in_step(basis, path, signal, node, scale, step, best)
      end do
      is_found = best%is_found
      if (is_found) value = best%value
      if (is_found) time = best%time
   end subroutine greatest_on_path

   !> The greatest value in a step: what may exceed the best so far is divided at its top.
   subroutine seek_in_step(basis, path, signal, node, scale, step, best)
      type(row_basis_t), intent(in) :: basis
      type(row_path_t), intent(inout) :: path
      type(row_signal_t), intent(in) :: signal
      !> At the start of the step
      integer, intent(in) :: node
      real(wp), intent(in) :: scale
      type(stretch_t), intent(in) :: step
      type(best_t), intent(inout) :: best

      type(stretch_t) :: parts(64), stretch
      real(wp) :: b(0:5), bound, level, length, middle(0:2), noise, t
      integer :: waiting

      call bounds_of(basis, signal, path%bounds(:, node), path%time(node), node, bound, noise)
      parts(1) = step
      waiting = 1
      do while (waiting > 0)
         stretch = parts(waiting)
         waiting = waiting - 1
         length = stretch%to - stretch%from
         b = coefficients(stretch%here, stretch%there, length)
         level = best%value + peak_tolerance*max(abs(best%value), scale) + 4.0_wp*noise
         if (.not. maxval(b) + bound*length**6*error_share(0) > level) cycle
         t = stretch%from + length*top_of(b)
         if (.not. (t > stretch%from .and. t < stretch%to) .or. waiting + 2 > size(parts)) cycle
         call climb(basis, path, signal, node, stretch, t, middle)
         call take(t, middle(0), best)
         parts(waiting + 1) = stretch_t(stretch%from, t, stretch%here, middle)
         parts(waiting + 2) = stretch_t(t, stretch%to, middle, stretch%there)
         waiting = waiting + 2
      end do
   end subroutine seek_in_step

   !> Keep a greater value.
   pure subroutine take(instant, found, best)
      real(wp), intent(in) :: instant
      real(wp), intent(in) :: found
      type(best_t), intent(inout) :: best

      if (found > best%value) best = best_t(found, instant, .true.)
   end subroutine take

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

   !> To the top by Newton's method, while that stays within a stretch.
   subroutine climb(basis, path, signal, node, stretch, instant, values)
      type(row_basis_t), intent(in) :: basis
      type(row_path_t), intent(inout) :: path
      type(row_signal_t), intent(in) :: signal
      integer, intent(in) :: node
      type(stretch_t), intent(in) :: stretch
      real(wp), intent(inout) :: instant
      real(wp), intent(out) :: values(0:2)

      integer, parameter :: most_rounds = 6
      real(wp), parameter :: least_shift = 1.0e-9_wp
      real(wp) :: shift
      integer :: round

      do round = 1, most_rounds
         call values_at(basis, path, signal, node, instant, values)
         if (.not. values(2) < 0.0_wp) return
         shift = -values(1)/values(2)
         if (.not. (instant + shift > stretch%from .and. instant + shift < stretch%to)) return
         if (abs(shift) <= least_shift*(stretch%to - stretch%from)) return
         instant = instant + shift
      end do
   end subroutine climb

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

end module row_peaks
