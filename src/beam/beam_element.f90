!> Matrices of the cubic Hermite beam element, eqs. (4) and (5) of Irie, Yamada and Asano (1977), in units where E Ibar
!> = rho Abar = L = 1 (docs/theory.md, section 3). The degrees of freedom are y and dy/dx at the left node, then at the
!> right node.
module beam_element
   use beam_section, only: area, area_degree, inertia, inertia_degree, section_is_taper, section_is_uniform, section_t
   use kinds, only: pi, wp
   implicit none (type, external)
   private
   public :: element_mass, element_stiffness, hermite_shape, hermite_curvature, gauss_rule, section_breaks

contains

   !> Element mass matrix M_e: closed form for a uniform beam or a taper, else exact Gauss quadrature.
   pure function element_mass(section, length, right_tip_distance) result(mass)
      type(section_t), intent(in) :: section
      !> Length of the element in L
      real(wp), intent(in) :: length
      !> Distance of the right node to the tip in L
      real(wp), intent(in) :: right_tip_distance
      real(wp) :: mass(4, 4)

      real(wp), allocatable :: breakpoint(:), point(:), weight(:)
      real(wp) :: shape(4), xi, width, factor
      integer :: segment, i, j

      if (section_is_uniform(section)) then
         mass = uniform_mass(length)
         return
      end if
      if (section_is_taper(section)) then
         mass = tapered_mass(length, area(section, right_tip_distance + length), area(section, right_tip_distance))
         return
      end if
      mass = 0.0_wp
      allocate (breakpoint, source=section_breaks(section, length, right_tip_distance))
      call gauss_rule((6 + area_degree(section))/2 + 1, point, weight)
      do segment = 1, size(breakpoint) - 1
         width = breakpoint(segment + 1) - breakpoint(segment)
         do i = 1, size(point)
            xi = breakpoint(segment) + width*point(i)
            shape = hermite_shape(xi, length)
            factor = weight(i)*width*length*area(section, right_tip_distance + (1.0_wp - xi)*length)
            do j = 1, 4
               mass(:, j) = mass(:, j) + factor*shape(j)*shape
            end do
         end do
      end do
   end function element_mass

   !> Element stiffness matrix K_e: closed form for a uniform beam or a taper, else exact Gauss quadrature.
   pure function element_stiffness(section, length, right_tip_distance) result(stiffness)
      type(section_t), intent(in) :: section
      !> Length of the element in L
      real(wp), intent(in) :: length
      !> Distance of the right node to the tip in L
      real(wp), intent(in) :: right_tip_distance
      real(wp) :: stiffness(4, 4)

      real(wp), allocatable :: breakpoint(:), point(:), weight(:)
      real(wp) :: curvature(4), xi, width, factor
      integer :: segment, i, j

      if (section_is_uniform(section)) then
         stiffness = uniform_stiffness(length)
         return
      end if
      if (section_is_taper(section)) then
         ! a taper has constant width, so its height h/hbar equals its area A/Abar
         stiffness = tapered_stiffness(length, area(section, right_tip_distance + length), &
            area(section, right_tip_distance))
         return
      end if
      stiffness = 0.0_wp
      allocate (breakpoint, source=section_breaks(section, length, right_tip_distance))
      call gauss_rule((2 + inertia_degree(section))/2 + 1, point, weight)
      do segment = 1, size(breakpoint) - 1
         width = breakpoint(segment + 1) - breakpoint(segment)
         do i = 1, size(point)
            xi = breakpoint(segment) + width*point(i)
            curvature = hermite_curvature(xi, length)
            factor = weight(i)*width*length*inertia(section, right_tip_distance + (1.0_wp - xi)*length)
            do j = 1, 4
               stiffness(:, j) = stiffness(:, j) + factor*curvature(j)*curvature
            end do
         end do
      end do
   end function element_stiffness

   !> Consistent mass matrix of a uniform element.
   pure function uniform_mass(length) result(mass)
      !> Length in L
      real(wp), intent(in) :: length
      real(wp) :: mass(4, 4)

      associate (l => length)
         mass = reshape([ &
            156.0_wp, 22.0_wp*l, 54.0_wp, -13.0_wp*l, &
            22.0_wp*l, 4.0_wp*l**2, 13.0_wp*l, -3.0_wp*l**2, &
            54.0_wp, 13.0_wp*l, 156.0_wp, -22.0_wp*l, &
            -13.0_wp*l, -3.0_wp*l**2, -22.0_wp*l, 4.0_wp*l**2], [4, 4])*(l/420.0_wp)
      end associate
   end function uniform_mass

   !> Stiffness matrix of a uniform element.
   pure function uniform_stiffness(length) result(stiffness)
      !> Length in L
      real(wp), intent(in) :: length
      real(wp) :: stiffness(4, 4)

      associate (l => length)
         stiffness = reshape([ &
            12.0_wp, 6.0_wp*l, -12.0_wp, 6.0_wp*l, &
            6.0_wp*l, 4.0_wp*l**2, -6.0_wp*l, 2.0_wp*l**2, &
            -12.0_wp, -6.0_wp*l, 12.0_wp, -6.0_wp*l, &
            6.0_wp*l, 2.0_wp*l**2, -6.0_wp*l, 4.0_wp*l**2], [4, 4])/l**3
      end associate
   end function uniform_stiffness

   !> Consistent mass matrix of an element of linearly varying area, as sums without cancellation.
   pure function tapered_mass(length, left, right) result(mass)
      !> Length in L
      real(wp), intent(in) :: length
      !> A/Abar at the left node
      real(wp), intent(in) :: left
      !> A/Abar at the right node
      real(wp), intent(in) :: right
      real(wp) :: mass(4, 4)

      mass(1, 1) = 240.0_wp*left + 72.0_wp*right
      mass(2, 1) = (30.0_wp*left + 14.0_wp*right)*length
      mass(3, 1) = 54.0_wp*(left + right)
      mass(4, 1) = -(14.0_wp*left + 12.0_wp*right)*length
      mass(2, 2) = (5.0_wp*left + 3.0_wp*right)*length**2
      mass(3, 2) = (12.0_wp*left + 14.0_wp*right)*length
      mass(4, 2) = -3.0_wp*(left + right)*length**2
      mass(3, 3) = 72.0_wp*left + 240.0_wp*right
      mass(4, 3) = -(14.0_wp*left + 30.0_wp*right)*length
      mass(4, 4) = (3.0_wp*left + 5.0_wp*right)*length**2
      mass(1, 2:4) = mass(2:4, 1)
      mass(2, 3:4) = mass(3:4, 2)
      mass(3, 4) = mass(4, 3)
      mass = mass*(length/840.0_wp)
   end function tapered_mass

   !> Stiffness matrix of an element of linearly varying height. The three rotational terms, integrals of curvatures,
   !> are sums of non-negative products of heights; the other terms follow from them by equilibrium.
   pure function tapered_stiffness(length, left, right) result(stiffness)
      !> Length in L
      real(wp), intent(in) :: length
      !> h/hbar at the left node
      real(wp), intent(in) :: left
      !> h/hbar at the right node
      real(wp), intent(in) :: right
      real(wp) :: stiffness(4, 4)

      real(wp) :: term(4), moment_left, moment_right, moment_coupling, force_left, force_right, shear

      term = [left**3, left**2*right, left*right**2, right**3]/(5.0_wp*length)
      moment_left = sum([11.0_wp, 5.0_wp, 2.0_wp, 2.0_wp]*term)
      moment_right = sum([2.0_wp, 2.0_wp, 5.0_wp, 11.0_wp]*term)
      moment_coupling = sum([4.0_wp, 1.0_wp, 1.0_wp, 4.0_wp]*term)
      force_left = (moment_left + moment_coupling)/length
      force_right = (moment_coupling + moment_right)/length
      shear = (force_left + force_right)/length
      stiffness = reshape([ &
         shear, force_left, -shear, force_right, &
         force_left, moment_left, -force_left, moment_coupling, &
         -shear, -force_left, shear, -force_right, &
         force_right, moment_coupling, -force_right, moment_right], [4, 4])
   end function tapered_stiffness

   !> Hermite shape functions at xi.
   pure function hermite_shape(xi, length) result(shape)
      !> Local coordinate, 0 at the left node, 1 at the right node
      real(wp), intent(in) :: xi
      !> Length in L
      real(wp), intent(in) :: length
      real(wp) :: shape(4)

      associate (eta => 1.0_wp - xi)
         shape = [eta**2*(1.0_wp + 2.0_wp*xi), length*xi*eta**2, xi**2*(1.0_wp + 2.0_wp*eta), -length*xi**2*eta]
      end associate
   end function hermite_shape

   !> Second derivatives of the Hermite shape functions with respect to x at xi.
   pure function hermite_curvature(xi, length) result(curvature)
      !> Local coordinate, 0 at the left node, 1 at the right node
      real(wp), intent(in) :: xi
      !> Length in L
      real(wp), intent(in) :: length
      real(wp) :: curvature(4)

      curvature = [12.0_wp*xi - 6.0_wp, (6.0_wp*xi - 4.0_wp)*length, 6.0_wp - 12.0_wp*xi, &
         (6.0_wp*xi - 2.0_wp)*length]/length**2
   end function hermite_curvature

   !> Local coordinates of the breakpoints between which the section is a single polynomial within an element.
   pure function section_breaks(section, length, right_tip_distance) result(breakpoint)
      type(section_t), intent(in) :: section
      !> Length of the element in L
      real(wp), intent(in) :: length
      !> Distance of the right node to the tip in L
      real(wp), intent(in) :: right_tip_distance
      !> Breakpoints, ascending from 0 (left node) to 1 (right node)
      real(wp), allocatable :: breakpoint(:)

      real(wp), allocatable :: xi(:)

      if (.not. allocated(section%tip_distance)) then
         allocate (breakpoint, source=[0.0_wp, 1.0_wp])
         return
      end if
      ! breakpoints within rounding of a node are left out
      allocate (xi, source=1.0_wp - (section%tip_distance - right_tip_distance)/length)
      allocate (breakpoint, source=[0.0_wp, pack(xi, xi > 1.0e-12_wp .and. xi < 1.0_wp - 1.0e-12_wp), 1.0_wp])
   end function section_breaks

   !> Gauss-Legendre rule on (0, 1).
   pure subroutine gauss_rule(points, point, weight)
      !> Number of points
      integer, intent(in) :: points
      !> Points, [points]
      real(wp), allocatable, intent(out) :: point(:)
      !> Weights with sum 1, [points]
      real(wp), allocatable, intent(out) :: weight(:)

      real(wp) :: a, b, wa, wb

      select case (points)
      case (1)
         point = [0.0_wp]
         weight = [2.0_wp]
      case (2)
         a = sqrt(1.0_wp/3.0_wp)
         point = [-a, a]
         weight = [1.0_wp, 1.0_wp]
      case (3)
         a = sqrt(0.6_wp)
         point = [-a, 0.0_wp, a]
         weight = [5.0_wp, 8.0_wp, 5.0_wp]/9.0_wp
      case (4)
         a = sqrt(3.0_wp/7.0_wp - 2.0_wp/7.0_wp*sqrt(1.2_wp))
         b = sqrt(3.0_wp/7.0_wp + 2.0_wp/7.0_wp*sqrt(1.2_wp))
         wa = (18.0_wp + sqrt(30.0_wp))/36.0_wp
         wb = (18.0_wp - sqrt(30.0_wp))/36.0_wp
         point = [-b, -a, a, b]
         weight = [wb, wa, wa, wb]
      case (5)
         a = sqrt(5.0_wp - 2.0_wp*sqrt(10.0_wp/7.0_wp))/3.0_wp
         b = sqrt(5.0_wp + 2.0_wp*sqrt(10.0_wp/7.0_wp))/3.0_wp
         wa = (322.0_wp + 13.0_wp*sqrt(70.0_wp))/900.0_wp
         wb = (322.0_wp - 13.0_wp*sqrt(70.0_wp))/900.0_wp
         point = [-b, -a, 0.0_wp, a, b]
         weight = [wb, wa, 128.0_wp/225.0_wp, wa, wb]
      case default
         call find_gauss_rule(points, point, weight)
      end select
      point = 0.5_wp*(1.0_wp + point)
      weight = 0.5_wp*weight
   end subroutine gauss_rule

   !> Gauss-Legendre rule on (-1, 1) by Newton's method on the Legendre polynomial.
   pure subroutine find_gauss_rule(points, point, weight)
      !> Number of points
      integer, intent(in) :: points
      real(wp), allocatable, intent(out) :: point(:)
      real(wp), allocatable, intent(out) :: weight(:)

      real(wp) :: x, slope, values(0:points)
      integer :: degree, i, step

      allocate (point(points), weight(points))
      do i = 1, points
         x = -cos(pi*(real(i, wp) - 0.25_wp)/(real(points, wp) + 0.5_wp))
         do step = 1, 8
            values(0) = 1.0_wp
            values(1) = x
            do degree = 2, points
               values(degree) = (real(2*degree - 1, wp)*x*values(degree - 1) - real(degree - 1, &
                  wp)*values(degree - 2)) &
                  /real(degree, wp)
            end do
            slope = real(points, wp)*(x*values(points) - values(points - 1))/(x**2 - 1.0_wp)
            x = x - values(points)/slope
         end do
         point(i) = x
         weight(i) = 2.0_wp/((1.0_wp - x**2)*slope**2)
      end do
   end subroutine find_gauss_rule

end module beam_element
