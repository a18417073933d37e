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

contains

   !> The one of exp(s t) over the points s.
   pure function exponential_difference(points, time) result(value)
      !> At least one
      complex(wp), intent(in) :: points(:)
      !> t
      real(wp), intent(in) :: time
      complex(wp) :: value

      value = difference(points*time)*time**(size(points) - 1)
   end function exponential_difference

   !> The one of exp over points.
   pure recursive function difference(x) result(value)
      complex(wp), intent(in) :: x(:)
      complex(wp) :: value

      complex(wp) :: others(size(x) - 1)
      real(wp) :: apart, furthest
      integer :: i, j, one, other

      furthest = 0.0_wp
      one = 1
      other = 1
      do j = 2, size(x)
         do i = 1, j - 1
            apart = square_of(x(i) - x(j))
            if (.not. apart > furthest) cycle
            furthest = apart
            one = i
            other = j
         end do
      end do
      if (furthest > greatest_spread**2) then
         others(:other - 1) = x(:other - 1)
         others(other:) = x(other + 1:)
         value = difference(others)
         others(one:other - 1) = x(one + 1:other)
         value = (value - difference(others))/(x(one) - x(other))
      else
         value = series(x)
      end if
   end function difference

   !> For points near to each other: exp(c) sum h_k(x - c)/(n - 1 + k)!, h_k the sum of all products of k of them.
   pure function series(x) result(value)
      complex(wp), intent(in) :: x(:)
      complex(wp) :: value

      integer, parameter :: most_terms = 20
      complex(wp) :: center, product_sum(size(x)), term
      real(wp) :: factor
      integer :: j, k

      center = sum(x)/real(size(x), wp)
      if (size(x) == 1) then
         value = exp(center)
         return
      end if
      ! h_k over the first points
      product_sum = (1.0_wp, 0.0_wp)
      factor = 1.0_wp
      do j = 2, size(x) - 1
         factor = factor/real(j, wp)
      end do
      value = factor
      do k = 1, most_terms
         factor = factor/real(size(x) - 1 + k, wp)
         product_sum(1) = product_sum(1)*(x(1) - center)
         do j = 2, size(x)
            product_sum(j) = product_sum(j - 1) + (x(j) - center)*product_sum(j)
         end do
         term = factor*product_sum(size(x))
         value = value + term
         if (maxval(square_of(product_sum))*factor**2 <= (0.01_wp*epsilon(1.0_wp))**2*square_of(value)) exit
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
