!> Divided differences of exp(s t) over points s, some of which may be close to each other or equal.
!>
!> Divided differences give the response of a linear oscillator to a load, from rest, in closed form without
!> cancellation: the solution of (d/dt - s_1)(d/dt - s_2) y = exp(s_3 t) is the difference over s_1, s_2 and s_3, and
!> its integral is the difference with a further point 0.
module exponential_differences
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: exponential_difference, find_differences, square_of

   !> Maximum distance of points x = s t for which a series is used; the recurrence of divided differences separates
   !> points farther apart.
   real(wp), parameter :: max_spread = 1.0_wp

   !> Maximum number of points.
   integer, parameter :: max_points = 6

contains

   !> The divided difference of exp(s t) over the points s.
   pure function exponential_difference(points, time) result(value)
      !> Points s, 1 to `max_points`
      complex(wp), intent(in) :: points(:)
      !> Time t
      real(wp), intent(in) :: time
      complex(wp) :: value

      complex(wp), dimension(size(points)) :: exp_x, x

      associate (n => size(points))
         x = points*time
         if (are_near(x)) then
            value = series(n, x)*time**(n - 1)
         else
            exp_x = exp(x)
            value = difference(n, x, exp_x)*time**(n - 1)
         end if
      end associate
   end function exponential_difference

   !> Divided differences over points i ... n for each i; the last one is the exponential of the last point.
   pure subroutine find_differences(points, time, values)
      !> Points s, 1 to `max_points`
      complex(wp), intent(in) :: points(:)
      !> Time t
      real(wp), intent(in) :: time
      !> One difference for each point
      complex(wp), intent(out) :: values(:)

      complex(wp), dimension(size(points)) :: exp_x, x
      integer :: i

      associate (n => size(points))
         x = points*time
         exp_x = exp(x)
         do i = 1, n
            values(i) = difference(n - i + 1, x(i:), exp_x(i:))*time**(n - i)
         end do
      end associate
   end subroutine find_differences

   !> Whether the distance of any two points is at most `max_spread`.
   pure logical function are_near(x) result(are)
      complex(wp), intent(in) :: x(:)

      integer :: j

      are = .true.
      do j = 2, size(x)
         are = are .and. .not. any(square_of(x(:j - 1) - x(j)) > max_spread**2)
      end do
   end function are_near

   !> The divided difference of exp over points. The recurrence separates the two points `first` and `second` that are
   !> farthest from each other, if a series is not accurate for all points.
   pure recursive function difference(count, x, exp_x) result(value)
      integer, intent(in) :: count
      complex(wp), intent(in) :: x(count)
      !> exp(x)
      complex(wp), intent(in) :: exp_x(count)
      complex(wp) :: value

      real(wp) :: square, largest
      integer :: i, j, first, second

      largest = 0.0_wp
      first = 1
      second = 1
      do j = 2, count
         do i = 1, j - 1
            square = square_of(x(i) - x(j))
            if (.not. square > largest) cycle
            largest = square
            first = i
            second = j
         end do
      end do
      if (count == 1) then
         value = exp_x(1)
      else if (.not. largest > max_spread**2) then
         value = series(count, x)
      else if (count == 2) then
         value = difference_of_two(x(1), x(2), exp_x(1), exp_x(2))
      else if (count == 3) then
         ! The most frequent case, without copies; the indices of the three points add to 6
         associate (third => 6 - first - second)
            value = (difference_of_two(x(first), x(third), exp_x(first), exp_x(third)) &
               - difference_of_two(x(second), x(third), exp_x(second), exp_x(third)))/(x(first) - x(second))
         end associate
      else
         value = (difference(count - 1, without(second, x), without(second, exp_x)) &
            - difference(count - 1, without(first, x), without(first, exp_x)))/(x(first) - x(second))
      end if
   end function difference

   !> The divided difference of exp over two points.
   pure function difference_of_two(first, second, exp_first, exp_second) result(value)
      complex(wp), intent(in) :: first
      complex(wp), intent(in) :: second
      complex(wp), intent(in) :: exp_first
      complex(wp), intent(in) :: exp_second
      complex(wp) :: value

      if (square_of(first - second) > max_spread**2) then
         value = (exp_first - exp_second)/(first - second)
      else
         value = series(2, [first, second])
      end if
   end function difference_of_two

   !> All elements except one; the elements of the result after them are undefined. The length of the result is
   !> constant, because this function is called millions of times.
   pure function without(place, all) result(others)
      !> Index of the omitted element
      integer, intent(in) :: place
      complex(wp), intent(in) :: all(:)
      complex(wp) :: others(max_points)

      others(:place - 1) = all(:place - 1)
      others(place:size(all) - 1) = all(place + 1:)
   end function without

   !> Divided difference over points close to each other: exp(c) sum h_k(x - c)/(n - 1 + k)!, with h_k the complete
   !> symmetric polynomial (the sum of all products of k points). With c the mean of the points,
   !> h_k = sum (-1)^(j + 1) e_j h_(k - j), j = 2 to n, with e_j the sum of all products of j different points.
   pure function series(count, x) result(value)
      integer, intent(in) :: count
      complex(wp), intent(in) :: x(count)
      complex(wp) :: value

      ! enough terms for points at the maximum distance
      integer, parameter :: max_terms = 20
      complex(wp) :: center, h(1 - max_points:max_terms), signed(0:count)
      ! 1/(n - 1 + k)!
      real(wp) :: factor
      ! bound of |h_k| (n - 1)!/(n - 1 + k)!
      real(wp) :: remainder
      ! maximum distance of the points from their mean
      real(wp) :: radius
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
      h(1 - max_points:-1) = (0.0_wp, 0.0_wp)
      h(0) = (1.0_wp, 0.0_wp)
      value = factor
      remainder = 1.0_wp
      do k = 1, max_terms
         factor = factor/real(count - 1 + k, wp)
         remainder = remainder*radius/real(k, wp)
         h(k) = sum(signed(2:)*h(k - 2:k - count:-1))
         value = value + factor*h(k)
         ! |h_k| is at most the k-th power of the radius times the number of products
         if (remainder <= 0.01_wp*epsilon(1.0_wp)) exit
      end do
      value = exp(center)*value
   end function series

   !> |z|^2, without the square root of abs, for numbers far from overflow.
   elemental real(wp) function square_of(z) result(square)
      complex(wp), intent(in) :: z

      square = real(z, wp)**2 + aimag(z)**2
   end function square_of

end module exponential_differences
