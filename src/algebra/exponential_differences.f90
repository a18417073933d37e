!> Divided differences of exp(s t) over points s of which some may be near to each other, or one.
!>
!> With these a linear oscillator that a load drives from rest is in closed form, and nothing cancels: the answer of
!> (d/dt - s_1)(d/dt - s_2) y = exp(s_3 t) is the one over s_1, s_2 and s_3, its integral that with a further point 0.
module exponential_differences
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: exponential_difference, find_differences, square_of

   !> Further apart than this two points are taken by the difference of what is left without either.
   real(wp), parameter :: greatest_spread = 1.0_wp

   integer, parameter :: most_points = 6

contains

   !> The one of exp(s t) over the points s.
   pure function exponential_difference(points, time) result(value)
      !> 1 to `most_points`
      complex(wp), intent(in) :: points(:)
      !> t
      real(wp), intent(in) :: time
      complex(wp) :: value

      complex(wp), dimension(size(points)) :: power, x

      associate (n => size(points))
         x = points*time
         if (are_near(x)) then
            value = series(n, x)*time**(n - 1)
         else
            power = exp(x)
            value = difference(n, x, power)*time**(n - 1)
         end if
      end associate
   end function exponential_difference

   !> Those over the points from each on, and the exponential of the last.
   pure subroutine find_differences(points, time, values)
      !> 1 to `most_points`
      complex(wp), intent(in) :: points(:)
      !> t
      real(wp), intent(in) :: time
      !> As many as points
      complex(wp), intent(out) :: values(:)

      complex(wp), dimension(size(points)) :: power, x
      integer :: i

      associate (n => size(points))
         x = points*time
         power = exp(x)
         do i = 1, n
            values(i) = difference(n - i + 1, x(i:), power(i:))*time**(n - i)
         end do
      end associate
   end subroutine find_differences

   !> Is none of the points further from another than `greatest_spread`?
   pure function are_near(x) result(are)
      complex(wp), intent(in) :: x(:)
      logical :: are

      integer :: j

      are = .true.
      do j = 2, size(x)
         are = are .and. .not. any(square_of(x(:j - 1) - x(j)) > greatest_spread**2)
      end do
   end function are_near

   !> The one of exp over points.
   pure recursive function difference(count, x, power) result(value)
      integer, intent(in) :: count
      complex(wp), intent(in) :: x(count)
      !> exp(x)
      complex(wp), intent(in) :: power(count)
      complex(wp) :: value

      real(wp) :: apart, furthest
      integer :: i, j, one, other

      furthest = 0.0_wp
      one = 1
      other = 1
      do j = 2, count
         do i = 1, j - 1
            apart = square_of(x(i) - x(j))
            if (.not. apart > furthest) cycle
            furthest = apart
            one = i
            other = j
         end do
      end do
      if (count == 1) then
         value = power(1)
      else if (.not. furthest > greatest_spread**2) then
         value = series(count, x)
      else if (count == 2) then
         value = of_two(x(1), x(2), power(1), power(2))
      else if (count == 3) then
         ! mostly so: without copies
         associate (third => 6 - one - other)
            value = (of_two(x(one), x(third), power(one), power(third)) &
               - of_two(x(other), x(third), power(other), power(third)))/(x(one) - x(other))
         end associate
      else
         value = (difference(count - 1, without(other, x), without(other, power)) &
            - difference(count - 1, without(one, x), without(one, power)))/(x(one) - x(other))
      end if
   end function difference

   pure function of_two(one, other, power, power_of_other) result(value)
      complex(wp), intent(in) :: one
      complex(wp), intent(in) :: other
      complex(wp), intent(in) :: power
      complex(wp), intent(in) :: power_of_other
      complex(wp) :: value

      if (square_of(one - other) > greatest_spread**2) then
         value = (power - power_of_other)/(one - other)
      else
         value = series(2, [one, other])
      end if
   end function of_two

   !> All but one, in a length that is known: these are asked for by the million.
   pure function without(place, all) result(others)
      integer, intent(in) :: place
      complex(wp), intent(in) :: all(:)
      complex(wp) :: others(most_points)

      others(:place - 1) = all(:place - 1)
      others(place:size(all) - 1) = all(place + 1:)
   end function without

   !> For points near to each other: exp(c) sum h_k(x - c)/(n - 1 + k)!, h_k the sum of all products of k of them. About
   !> their mean c it is sum (-1)^(j + 1) e_j h_(k - j), j = 2 to n, e_j the sum of products of j different ones.
   pure function series(count, x) result(value)
      integer, intent(in) :: count
      complex(wp), intent(in) :: x(count)
      complex(wp) :: value

      ! the last with points as far apart as they may be
      integer, parameter :: most_terms = 20
      complex(wp) :: center, h(1 - most_points:most_terms), signed(0:count)
      real(wp) :: factor, left, radius
      integer :: j, k

      center = sum(x)/real(count, wp)
      ! (-1)^(j + 1) e_j
      signed(0) = (-1.0_wp, 0.0_wp)
      signed(1:) = (0.0_wp, 0.0_wp)
      do j = 1, count
         do k = j, 1, -1
            signed(k) = signed(k) - (x(j) - center)*signed(k - 1)
         end do
      end do
      radius = sqrt(maxval(square_of(x - center)))
      factor = 1.0_wp
      do j = 2, count - 1
         factor = factor/real(j, wp)
      end do
      h(1 - most_points:-1) = (0.0_wp, 0.0_wp)
      h(0) = (1.0_wp, 0.0_wp)
      value = factor
      left = 1.0_wp
      do k = 1, most_terms
         factor = factor/real(count - 1 + k, wp)
         left = left*radius/real(k, wp)
         h(k) = sum(signed(2:)*h(k - 2:k - count:-1))
         value = value + factor*h(k)
         ! h_k is at most the k-th power of the radius times the number of products
         if (left <= 0.01_wp*epsilon(1.0_wp)) exit
      end do
      value = exp(center)*value
   end function series

   !> |z|^2, of numbers far from overflow, without its square root.
   elemental function square_of(z) result(square)
      complex(wp), intent(in) :: z
      real(wp) :: square

      square = real(z, wp)**2 + aimag(z)**2
   end function square_of

end module exponential_differences
