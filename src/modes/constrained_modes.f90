!> Modes of a structure with a support or a spring added at a point, from its modes without the addition.
!>
!> With W_i^2 the squared frequencies and b_i the modes at the point, mass-normalised, the new squared frequencies w^2
!> are the roots of f + sum b_i^2/(W_i^2 - w^2) = 0, with f the flexibility of the spring, 0 for a rigid support: one
!> root between each two neighbouring poles and, with a spring, one above all poles. The new modes are r b_i/(W_i^2 -
!> w^2), with r their reaction (Dowell, J. Appl. Mech. 46 (1979) 206: free vibrations of a linear structure with
!> constraints). A root is sought as its distance from the nearer pole, so that no difference W_i^2 - w^2 cancels.
module constrained_modes
   use beam_model, only: beam_support_t
   use bracketed_zero, only: bracket_t, enter_value, choose_point
   use kinds, only: wp
   use sorting, only: ascending_order, order_columns
   implicit none (type, external)
   private
   public :: attach_supports, constrain

contains

   !> Modes of a beam with supports along it, added one after the other.
   pure subroutine attach_supports(supports, lambda, mode)
      type(beam_support_t), intent(in) :: supports(:)
      !> Wave numbers lambda_i (squared frequencies lambda_i^4, E Ibar = rho Abar = L = 1), ascending. On
      !> entry without supports; on return with supports, one fewer for each rigid support
      real(wp), allocatable, intent(inout) :: lambda(:)
      !> The modes, mass-normalised, [degrees of freedom, modes]
      real(wp), allocatable, intent(inout) :: mode(:, :)

      real(wp), allocatable :: combination(:, :), reaction(:), square(:)
      real(wp) :: flexibility
      integer :: i

      do i = 1, size(supports)
         flexibility = 0.0_wp
         if (supports(i)%stiffness > 0.0_wp) flexibility = 1.0_wp/supports(i)%stiffness
         call constrain(lambda**4, mode(supports(i)%dof, :), flexibility, square, combination, reaction)
         lambda = sqrt(sqrt(square))
         mode = matmul(mode, combination)
      end do
      do i = 1, size(supports)
         ! displacements or slopes at rigid supports become exactly zero, not only zero to within rounding
         if (supports(i)%stiffness <= 0.0_wp) mode(supports(i)%dof, :) = 0.0_wp
      end do
   end subroutine attach_supports

   !> Modes with the point fixed or on a spring. A mode with a node at the point (b_i vanishes) does not change.
   pure subroutine constrain(square, value, flexibility, new_square, mode, reaction, tolerance)
      !> W_i^2, in any order, [modes]
      real(wp), intent(in) :: square(:)
      !> b_i, [modes]
      real(wp), intent(in) :: value(:)
      !> Flexibility f of the spring; 0: the point is fixed, and the number of modes decreases by one
      real(wp), intent(in) :: flexibility
      !> w^2, ascending, [new]
      real(wp), allocatable, intent(out) :: new_square(:)
      !> The new modes as combinations of the old modes, orthonormal, [modes, new]
      real(wp), allocatable, intent(out) :: mode(:, :)
      !> Reaction r per unit of each new mode, [new]
      real(wp), allocatable, intent(out) :: reaction(:)
      !> Relative length of the last step towards a root, whose error is of the order of the square of this length;
      !> absent: the error is rounding
      real(wp), intent(in), optional :: tolerance

      integer, allocatable :: active(:), order(:)
      real(wp), parameter :: rounding = 1.0e-14_wp
      ! W_i^2 - w^2, [active, changed modes]
      real(wp), allocatable :: distance(:, :)
      ! b_i^2, then b_i, for which the computed w^2 are exact, [active]
      real(wp), allocatable :: consistent(:)
      ! w^2, [new]
      real(wp), allocatable :: roots(:)
      ! |b_i| over the frequency, [modes]
      real(wp), allocatable :: scaled(:)
      ! W_i^2 and b_i^2 of the active modes
      real(wp), allocatable :: pole(:), weight(:)
      real(wp) :: last_step, norm
      integer :: i, j, a, n, unchanged, modes

      last_step = 1.0e-10_wp
      if (present(tolerance)) last_step = tolerance
      n = size(square)
      modes = n
      if (flexibility <= 0.0_wp) modes = n - 1
      allocate (mode(n, modes), reaction(modes), roots(modes))
      mode = 0.0_wp
      ! Modes whose value at the point exceeds rounding; the other modes have a node at the point. The values are
      ! compared after division by the frequency, too: if the values are slopes, those of the highest modes of a mesh
      ! with a short element may be so large that those of the low modes would seem to be rounding errors
      allocate (scaled, source=abs(value)/sqrt(max(square, 1.0_wp)))
      allocate (active, source=pack([(i, i=1, n)], abs(value) > rounding*maxval(abs(value)) .or. &
         scaled > rounding*maxval(scaled)))
      active = active(ascending_order(square(active)))
      j = 0
      do i = 1, n
         if (any(active == i)) cycle
         j = j + 1
         roots(j) = square(i)
         reaction(j) = 0.0_wp
         mode(i, j) = 1.0_wp
      end do
      unchanged = j
      allocate (distance(size(active), modes - unchanged), consistent(size(active)))
      pole = square(active)
      weight = value(active)**2
      do a = 1, modes - unchanged
         call root_between(pole, weight, flexibility, a, last_step, roots(unchanged + a), distance(:, a))
      end do
      call consistent_weights(pole, sum(weight), flexibility, distance, consistent)
      consistent = sign(sqrt(consistent), value(active))
      do a = 1, modes - unchanged
         norm = 1.0_wp/sqrt(sum((consistent/distance(:, a))**2))
         reaction(unchanged + a) = norm
         mode(active, unchanged + a) = norm*consistent/distance(:, a)
      end do
      call move_alloc(roots, new_square)
      ! the changed modes are in order
      if (unchanged == 0) return
      order = ascending_order(new_square)
      call order_columns(mode, order)
      reaction = reaction(order)
      new_square = new_square(order)
   end subroutine constrain

   !> Weights for which the computed roots are exact. They differ from the given weights by rounding only, but the modes
   !> computed from them are orthogonal to rounding (Gu and Eisenstat, SIAM J. Matrix Anal. Appl. 15 (1994) 1266):
   !> weight_i = constant prod_k (root_k - pole_i)/prod_k (pole_k - pole_i), k /= i in the denominator. Without a root
   !> above the last pole, the sum of the weights replaces constant (root - pole_i) of that root.
   pure subroutine consistent_weights(pole, total, constant, distance, weight)
      !> Poles, ascending
      real(wp), intent(in) :: pole(:)
      !> Sum of the weights
      real(wp), intent(in) :: total
      !> Constant of the equation, >= 0; if > 0, there is a root above the last pole
      real(wp), intent(in) :: constant
      !> pole - root, [poles, roots]
      real(wp), intent(in) :: distance(:, :)
      !> The weights, [poles]
      real(wp), intent(out) :: weight(:)

      integer :: i, k

      weight = total
      if (constant > 0.0_wp) weight = -constant*distance(:, size(pole))
      ! root k lies between poles k and k + 1; its distance from pole i is divided by the distance of one of these two
      ! from pole i, so that each factor is at most 1 and nothing overflows
      do k = 1, size(pole) - 1
         do i = 1, size(pole)
            weight(i) = weight(i)*(distance(i, k)/(pole(i) - merge(pole(k), pole(k + 1), k < i)))
         end do
      end do
   end subroutine consistent_weights

   !> The root of constant + sum weight_k/(pole_k - x) between two neighbouring poles, or above the last.
   pure subroutine root_between(pole, weight, constant, left, last_step, root, distance)
      !> Poles, ascending and distinct
      real(wp), intent(in) :: pole(:)
      !> Weights, > 0
      real(wp), contiguous, intent(in) :: weight(:)
      !> Constant, >= 0; > 0 for the root above the last pole
      real(wp), intent(in) :: constant
      !> The root lies between poles `left` and `left` + 1
      integer, intent(in) :: left
      !> Relative length of the last step
      real(wp), intent(in) :: last_step
      real(wp), intent(out) :: root
      !> pole_k - root, to full relative precision, [size(pole)]
      real(wp), intent(out) :: distance(:)

      type(bracket_t) :: bracket
      real(wp) :: high, low, next, shifted(size(pole)), slope, slope_below, value
      integer :: origin

      origin = left
      low = 0.0_wp
      if (left == size(pole)) then
         ! The root above all poles is at most this far beyond the last one
         high = sum(weight)/constant*(1.0_wp + 4.0_wp*epsilon(1.0_wp))
         next = 0.5_wp*high
      else
         high = 0.5_wp*(pole(left + 1) - pole(left))
         ! the function increases from -infinity to +infinity; its sign in the middle shows which pole is nearer
         call evaluate(pole - pole(left), weight, constant, left, high, value, slope, slope_below)
         next = high + step_between(-high, high, value, slope, slope_below)
         if (value <= 0.0_wp) then
            origin = left + 1
            low = -high
            high = 0.0_wp
            next = next + 2.0_wp*low
         end if
      end if
      shifted = pole - pole(origin)
      if (.not. (next > low .and. next < high)) next = 0.5_wp*(low + high)
      bracket = bracket_t(low=low, high=high, point=next, grows=.true., step_tolerance=epsilon(1.0_wp), &
         value_tolerance=-1.0_wp)
      do while (.not. bracket%is_found)
         call evaluate(shifted, weight, constant, left, bracket%point, value, slope, slope_below)
         call enter_value(bracket, value)
         next = bracket%point + step_between(shifted(left) - bracket%point, shifted(min(left + 1, size(pole))) &
            - bracket%point, value, slope, slope_below)
         if (abs(next - bracket%point) <= last_step*abs(bracket%point)) exit
         low = bracket%low
         high = bracket%high
         if (.not. (next > low .and. next < high)) then
            next = 0.5_wp*(low + high)
            ! towards a pole, bisect the exponent instead of the interval
            if (low > 0.0_wp .and. high > 4.0_wp*low) next = sqrt(low)*sqrt(high)
            if (high < 0.0_wp .and. low < 4.0_wp*high) next = -sqrt(-low)*sqrt(-high)
         end if
         call choose_point(bracket, next)
      end do
      root = pole(origin) + next
      distance = shifted - next
   end subroutine root_between

   !> The function of `root_between`, its slope, and the part of the slope from the poles up to `left`.
   pure subroutine evaluate(shifted, weight, constant, left, x, value, slope, slope_below)
      !> Poles, relative to the origin of x
      real(wp), contiguous, intent(in) :: shifted(:)
      real(wp), contiguous, intent(in) :: weight(:)
      real(wp), intent(in) :: constant
      integer, intent(in) :: left
      real(wp), intent(in) :: x
      real(wp), intent(out) :: value
      real(wp), intent(out) :: slope
      real(wp), intent(out) :: slope_below

      real(wp) :: inverse, term
      integer :: k

      value = constant
      slope = 0.0_wp
      slope_below = 0.0_wp
      !$omp simd private(inverse, term) reduction(+:value, slope, slope_below)
      do k = 1, size(shifted)
         inverse = 1.0_wp/(shifted(k) - x)
         term = weight(k)*inverse
         value = value + term
         slope = slope + term*inverse
         slope_below = slope_below + merge(term*inverse, 0.0_wp, k <= left)
      end do
   end subroutine evaluate

   !> Step towards the root between two poles, or above the last pole. A constant and the nearest pole below represent
   !> the sum of all poles below, with its value and slope; another constant and the nearest pole above represent that
   !> of all poles above. The root of both together is the next point (Li, LAPACK Working Note 89, 1994). The steps
   !> converge quadratically, so that a step of relative length 1e-10 leads to the root to rounding.
   pure real(wp) function step_between(below, above, value, slope, slope_below) result(step)
      !> Distance of the pole below, < 0
      real(wp), intent(in) :: below
      !> Distance of the pole above, > 0; < 0: there is none
      real(wp), intent(in) :: above
      real(wp), intent(in) :: value
      real(wp), intent(in) :: slope
      !> Part of the slope from the poles below
      real(wp), intent(in) :: slope_below

      ! the step x solves first x^2 - 2 half x + last = 0
      real(wp) :: first, half, last
      ! square root of a quarter of the discriminant, half^2 - first last
      real(wp) :: root

      first = value - below*slope_below - above*(slope - slope_below)
      half = 0.5_wp*((below + above)*value - below*above*slope)
      last = below*above*value
      root = sqrt(abs(half**2 - first*last))
      step = 0.0_wp
      if (above < 0.0_wp) then
         step = below*value/(value - below*slope)
      else if (half > 0.0_wp) then
         step = last/(half + root)
      else if (abs(first) > 0.0_wp) then
         step = (half - root)/first
      end if
   end function step_between

end module constrained_modes
