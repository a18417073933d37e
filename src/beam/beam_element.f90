!> Matrices of the cubic Hermite beam element, eqs. (4) and (5) of Irie, Yamada and Asano (1977), in
!> units where E Ibar = rho Abar = L = 1 (docs/theory.md, section 3). Degrees of freedom: y and dy/dx at the left, then
!> at the right node.
module beam_element
   use beam_section, only: area, area_degree, inertia, inertia_degree, section_is_taper, section_is_uniform, section_t
   use kinds, only: pi, wp
   implicit none (type, external)
   private
   public :: element_mass, element_stiffness, hermite_shape, hermite_curvature, gauss_rule, section_pieces

contains

   !> M_e: closed form where the beam is uniform or a taper, else Gauss quadrature of the order that is exact.
   pure function element_mass(section, length, right_tip_distance) result(mass)
      type(section_t), intent(in) :: section
      !> Length of the element in L
      real(wp), intent(in) :: length
      !> Distance of its right node to the tip in L
      real(wp), intent(in) :: right_tip_distance
      real(wp) :: mass(4, 4)

      real(wp), allocatable :: cut(:), point(:), weight(:)
      real(wp) :: shape(4), xi, width, factor
      integer :: piece, i, j

      if (section_is_uniform(section)) then
         mass = uniform_mass(length)
         return
      end if
      if (section_is_taper(section)) then
         mass = tapered_mass(length, area(section, right_tip_distance + length), area(section, right_tip_distance))
         return
      end if
      mass = 0.0_wp
      allocate (cut, source=section_pieces(section, length, right_tip_distance))
      call gauss_rule(points_for_degree(6 + area_degree(section)), point, weight)
      do piece = 1, size(cut) - 1
         width = cut(piece + 1) - cut(piece)
         do i = 1, size(point)
            xi = cut(piece) + width*point(i)
            shape = hermite_shape(xi, length)
            factor = weight(i)*width*length*area(section, right_tip_distance + (1.0_wp - xi)*length)
            do j = 1, 4
               mass(:, j) = mass(:, j) + factor*shape(j)*shape
            end do
         end do
      end do
   end function element_mass

   !> K_e: closed form where the beam is uniform or a taper, else Gauss quadrature of the order that is exact.
   pure function element_stiffness(section, length, right_tip_distance) result(stiffness)
      type(section_t), intent(in) :: section
      !> Length of the element in L
      real(wp), intent(in) :: length
      !> Distance of its right node to the tip in L
      real(wp), intent(in) :: right_tip_distance
      real(wp) :: stiffness(4, 4)

      real(wp), allocatable :: cut(:), point(:), weight(:)
      real(wp) :: curvature(4), xi, width, factor
      integer :: piece, i, j

      if (section_is_uniform(section)) then
         stiffness = uniform_stiffness(length)
         return
      end if
      if (section_is_taper(section)) then
         ! of constant width: the height is the area
         stiffness = tapered_stiffness(length, area(section, right_tip_distance + length), &
            area(section, right_tip_distance))
         return
      end if
      stiffness = 0.0_wp
      allocate (cut, source=section_pieces(section, length, right_tip_distance))
      call gauss_rule(points_for_degree(2 + inertia_degree(section)), point, weight)
      do piece = 1, size(cut) - 1
         width = cut(piece + 1) - cut(piece)
         do i = 1, size(point)
            xi = cut(piece) + width*point(i)
            curvature = hermite_curvature(xi, length)
            factor = weight(i)*width*length*inertia(section, right_tip_distance + (1.0_wp - xi)*length)
            do j = 1, 4
               stiffness(:, j) = stiffness(:, j) + factor*curvature(j)*curvature
            end do
         end do
      end do
   end function element_stiffness

   !> Consistent mass of a uniform element.
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

   !> Stiffness of a uniform element.
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

   !> Consistent mass of an element whose area varies linearly; nothing cancels.
   pure function tapered_mass(length, left, right) result(mass)
      !> Length in L
      real(wp), intent(in) :: length
      !> Area at the left and at the right node
      real(wp), intent(in) :: left
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

   !> Stiffness of an element whose height varies linearly. The three integrals over the curvatures of rotations are
   !> sums of products of heights, none negative; the forces follow from them by equilibrium.
   pure function tapered_stiffness(length, left, right) result(stiffness)
      !> Length in L
      real(wp), intent(in) :: length
      !> Height at the left and at the right node
      real(wp), intent(in) :: left
      real(wp), intent(in) :: right
      real(wp) :: stiffness(4, 4)

      real(wp) :: term(4), own_left, own_right, mixed, force_left, force_right, shear

      term = [left**3, left**2*right, left*right**2, right**3]/(5.0_wp*length)
      own_left = sum([11.0_wp, 5.0_wp, 2.0_wp, 2.0_wp]*term)
      own_right = sum([2.0_wp, 2.0_wp, 5.0_wp, 11.0_wp]*term)
      mixed = sum([4.0_wp, 1.0_wp, 1.0_wp, 4.0_wp]*term)
      force_left = (own_left + mixed)/length
      force_right = (mixed + own_right)/length
      shear = (force_left + force_right)/length
      stiffness = reshape([ &
         shear, force_left, -shear, force_right, &
         force_left, own_left, -force_left, mixed, &
         -shear, -force_left, shear, -force_right, &
         force_right, mixed, -force_right, own_right], [4, 4])
   end function tapered_stiffness

   !> Shape functions at xi.
   pure function hermite_shape(xi, length) result(shape)
      !> Place in the element, 0 left to 1 right
      real(wp), intent(in) :: xi
      !> Length in L
      real(wp), intent(in) :: length
      real(wp) :: shape(4)

      associate (eta => 1.0_wp - xi)
         shape = [eta**2*(1.0_wp + 2.0_wp*xi), length*xi*eta**2, xi**2*(1.0_wp + 2.0_wp*eta), -length*xi**2*eta]
      end associate
   end function hermite_shape

   !> Second derivatives of the shape functions by x at xi.
   pure function hermite_curvature(xi, length) result(curvature)
      !> Place in the element, 0 left to 1 right
      real(wp), intent(in) :: xi
      !> Length in L
      real(wp), intent(in) :: length
      real(wp) :: curvature(4)

      curvature = [12.0_wp*xi - 6.0_wp, (6.0_wp*xi - 4.0_wp)*length, 6.0_wp - 12.0_wp*xi, &
         (6.0_wp*xi - 2.0_wp)*length]/length**2
   end function hermite_curvature

   !> Where the element must be cut so that the section is one polynomial on each piece.
   pure function section_pieces(section, length, right_tip_distance) result(cut)
      type(section_t), intent(in) :: section
      !> Length of the element in L
      real(wp), intent(in) :: length
      !> Distance of its right node to the tip in L
      real(wp), intent(in) :: right_tip_distance
      !> Ascending from 0 (left node) to 1 (right node)
      real(wp), allocatable :: cut(:)

      real(wp), allocatable :: xi(:)

      if (.not. allocated(section%tip_distance)) then
         allocate (cut, source=[0.0_wp, 1.0_wp])
         return
      end if
      allocate (xi, source=1.0_wp - (section%tip_distance - right_tip_distance)/length)
      allocate (cut, source=[0.0_wp, pack(xi, xi > 1.0e-12_wp .and. xi < 1.0_wp - 1.0e-12_wp), 1.0_wp])
   end function section_pieces

   !> Gauss points needed for a polynomial of a degree.
   pure function points_for_degree(degree) result(points)
      !> Degree of the integrand
      integer, intent(in) :: degree
      integer :: points

      points = degree/2 + 1
   end function points_for_degree

   !> Gauss-Legendre rule on (0, 1).
   pure subroutine gauss_rule(points, point, weight)
      !> Number of points
      integer, intent(in) :: points
      !> Points, [points]
      real(wp), allocatable, intent(out) :: point(:)
      !> Weights, their sum 1, [points]
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

   !> The rule on (-1, 1) by Newton's method on the Legendre polynomial.
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
