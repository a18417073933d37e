!> Interpolating cubic splines through tables of values: their second derivatives, and their slopes, limited at jumps.
module cubic_splines
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: spline_curvature, spline_slope

contains

   !> Second derivatives y'' of the cubic spline at its points, from the continuity of its slope: with the length l_i
   !> and the slope s_i of the interval after point i,
   !>
   !>    l_(i-1) y''_(i-1) + 2 (l_(i-1) + l_i) y''_i + l_i y''_(i+1) = 6 (s_i - s_(i-1)).
   !>
   !> At each end either the slope or the curvature is zero.
   pure function spline_curvature(x, y, is_flat) result(curvature)
      !> Coordinates x of the points, ascending, two or more
      real(wp), intent(in) :: x(:)
      !> Coordinates y of the points
      real(wp), intent(in) :: y(:)
      !> At the first and the last point: true: the slope is zero; false: the curvature is zero
      logical, intent(in) :: is_flat(2)
      real(wp) :: curvature(size(x))

      ! lengths of the intervals; 0 for the two intervals beyond the ends
      real(wp) :: length(0:size(x))
      ! slopes of the intervals; 0 for the two intervals beyond the ends, which makes the slope at the ends zero
      real(wp) :: slope(0:size(x))
      real(wp), dimension(size(x)) :: diagonal, lower, upper
      real(wp) :: factor
      integer :: i, k, n

      n = size(x)
      curvature = 0.0_wp
      if (n < 2) return
      length = 0.0_wp
      slope = 0.0_wp
      length(1:n - 1) = x(2:) - x(:n - 1)
      slope(1:n - 1) = (y(2:) - y(:n - 1))/length(1:n - 1)
      lower = length(0:n - 1)
      upper = length(1:n)
      diagonal = 2.0_wp*(lower + upper)
      curvature = 6.0_wp*(slope(1:n) - slope(0:n - 1))
      do i = 1, 2
         if (is_flat(i)) cycle
         k = merge(1, n, i == 1)
         diagonal(k) = 1.0_wp
         lower(k) = 0.0_wp
         upper(k) = 0.0_wp
         curvature(k) = 0.0_wp
      end do
      ! The equations are tridiagonal: elimination, then back substitution
      do i = 2, n
         factor = lower(i)/diagonal(i - 1)
         diagonal(i) = diagonal(i) - factor*upper(i - 1)
         curvature(i) = curvature(i) - factor*curvature(i - 1)
      end do
      curvature(n) = curvature(n)/diagonal(n)
      do i = n - 1, 1, -1
         curvature(i) = (curvature(i) - upper(i)*curvature(i + 1))/diagonal(i)
      end do
   end function spline_curvature

   !> Slopes of the spline at its points, with a limit: a slope times the longer interval beside its point is at most
   !> `max_ratio` times the largest change of the values in the four nearest intervals. Without this limit the spline
   !> would overshoot far beside an interval much shorter than its neighbours, which represents a jump. A limited slope
   !> makes the curvature discontinuous; slopes at evenly spaced points of a smooth curve are not limited.
   pure function spline_slope(x, y, is_flat) result(slope)
      !> Coordinates x of the points, ascending, two or more
      real(wp), intent(in) :: x(:)
      !> Coordinates y of the points
      real(wp), intent(in) :: y(:)
      !> At the first and the last point: true: zero slope; false: zero curvature
      logical, intent(in) :: is_flat(2)
      real(wp) :: slope(size(x))

      real(wp), parameter :: max_ratio = 2.0_wp
      real(wp), dimension(size(x)) :: curvature
      real(wp), dimension(size(x) - 1) :: length, step
      real(wp) :: max_slope
      integer :: k, n

      n = size(x)
      length = x(2:) - x(:n - 1)
      step = y(2:) - y(:n - 1)
      curvature = spline_curvature(x, y, is_flat)
      slope(:n - 1) = step/length - length*(2.0_wp*curvature(:n - 1) + curvature(2:))/6.0_wp
      slope(n) = step(n - 1)/length(n - 1) + length(n - 1)*(curvature(n - 1) + 2.0_wp*curvature(n))/6.0_wp
      if (is_flat(1)) slope(1) = 0.0_wp
      if (is_flat(2)) slope(n) = 0.0_wp
      do k = 1, n
         max_slope = max_ratio*maxval(abs(step(max(1, k - 2):min(n - 1, k + 1)))) &
            /maxval(length(max(1, k - 1):min(n - 1, k)))
         slope(k) = sign(min(abs(slope(k)), max_slope), slope(k))
      end do
   end function spline_slope

end module cubic_splines
