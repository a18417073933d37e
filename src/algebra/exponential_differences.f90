!> Divided differences of exp(s t) over points s of which some may be near to each other, or one.
!>
!> With these a linear oscillator that a load drives from rest is in closed form, and nothing cancels: the answer of
!> (d/dt - s_1)(d/dt - s_2) y = exp(s_3 t) is the one over s_1, s_2 and s_3, its integral that with a further point 0.
module exponential_differences
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: exponential_difference

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

      complex(wp), dimension(most_points) :: power, x
      integer :: i

      associate (n => size(points))
         do i = 1, n
            x(i) = points(i)*time
            power(i) = exp(x(i))
         end do
         value = difference(n, x, power)*time**(n - 1)
      end associate
   end function exponential_difference

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

   !> For points near to each other: exp(c) sum h_k(x - c)/(n - 1 + k)!, h_k the sum of all products of k of them.
   pure function series(count, x) result(value)
      integer, intent(in) :: count
      complex(wp), intent(in) :: x(count)
      complex(wp) :: value

      integer, parameter :: most_terms = 20
      complex(wp) :: center, product_sum(most_points), term
      real(wp) :: factor
      integer :: j, k

      center = sum(x)/real(count, wp)
      ! h_k over the first points
      product_sum = (1.0_wp, 0.0_wp)
      factor = 1.0_wp
      do j = 2, count - 1
         factor = factor/real(j, wp)
      end do
      value = factor
      do k = 1, most_terms
         factor = factor/real(count - 1 + k, wp)
         product_sum(1) = product_sum(1)*(x(1) - center)
         do j = 2, count
            product_sum(j) = product_sum(j - 1) + (x(j) - center)*product_sum(j)
         end do
         term = factor*product_sum(count)
         value = value + term
         if (maxval(square_of(product_sum(:count)))*factor**2 <= (0.01_wp*epsilon(1.0_wp))**2*square_of(value)) exit
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
