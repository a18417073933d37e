!> Roots of a secular equation (the characteristic equation of modes that contacts couple), each stored as a pole
!> (an exponent of a free mode) and an offset: the root of a weakly coupled mode lies so near to its pole that only
!> their distance has significant digits. Near s = -1/(2 zeta), where the poles of heavily damped
!> modes cluster, differences of poles are taken in e = 1 + 2 zeta s, because s would lose the leading digits.
module pole_offsets
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: secular_t, find_mode_poles, relative_rate, distances, root_distances, sum_of_inverses, strengths, abs1

   !> Poles of a secular equation.
   type :: secular_t
      !> Number of modes
      integer :: modes = 0
      !> Number of roots
      integer :: roots = 0
      !> Number of poles
      integer :: poles = 0
      !> 2 zeta, with zeta of stiffness-proportional damping
      real(wp) :: two_zeta = 0.0_wp
      !> W_i^2, [modes]
      real(wp), allocatable :: square(:)
      !> Poles, [poles]
      complex(wp), allocatable :: pole(:)
      !> 1 + 2 zeta pole, [poles]
      complex(wp), allocatable :: relative(:)
      !> Whether the pole is one of the cluster near -1/(2 zeta), [poles]
      logical, allocatable :: is_clustered(:)
   end type secular_t

contains

   !> Exponents (poles) of the free modes, two for each mode, side by side: the roots of s^2 + (2 zeta W^2 + alpha) s +
   !> W^2 = 0. The product of their two e = 1 + 2 zeta s is 1 - 2 zeta alpha.
   pure subroutine find_mode_poles(squares, zeta, mass_rate, pole, relative)
      !> W_i^2, [modes]
      real(wp), intent(in) :: squares(:)
      !> Coefficient of stiffness-proportional damping
      real(wp), intent(in) :: zeta
      !> alpha of damping proportional to mass, or 2 xi W of a damping ratio xi, [modes]
      real(wp), intent(in) :: mass_rate(:)
      !> Poles s, [2 modes at least]
      complex(wp), intent(inout) :: pole(:)
      !> 1 + 2 zeta s, [2 modes at least]
      complex(wp), intent(inout) :: relative(:)

      real(wp) :: decay, frequency, product, rate, spread
      integer :: i, larger

      do i = 1, size(squares)
         product = relative_rate(2.0_wp*zeta, mass_rate(i))
         rate = mass_rate(i)
         ! both poles change with the product
         if (abs(1.0_wp - 2.0_wp*zeta*rate) < abs(product)) rate = rate*(1.0_wp - product)
         decay = max(zeta*squares(i) + 0.5_wp*rate, 0.0_wp)
         frequency = sqrt(squares(i))
         associate (p => pole(2*i - 1:2*i), e => relative(2*i - 1:2*i))
            if (decay > frequency) then
               spread = sqrt((decay - frequency)*(decay + frequency))
               p = -cmplx([squares(i)/(decay + spread), decay + spread], 0.0_wp, wp)
               e = 1.0_wp + 2.0_wp*zeta*p
               ! the sum has lost digits of the smaller e
               larger = maxloc(abs(e), dim=1)
               if (abs(e(larger)) > 0.0_wp) e(3 - larger) = product/e(larger)
            else
               p(1) = cmplx(-decay, sqrt((frequency - decay)*(frequency + decay)), wp)
               p(2) = conjg(p(1))
               e = 1.0_wp + 2.0_wp*zeta*p
            end if
         end associate
      end do
   end subroutine find_mode_poles

   !> 1 + 2 zeta s at s = -rate. If alpha = 1/(2 zeta), all modes have the pole -alpha, next to which no equation
   !> distinguishes them, and perhaps stops do, too. A number instead of 0 separates these poles. It is not much below
   !> rounding, because the modes in the cluster, each of which moves stops at one point alike, would hide all others.
   pure real(wp) function relative_rate(two_zeta, rate) result(relative)
      real(wp), intent(in) :: two_zeta
      !> The rate, which is also alpha in the product of both values of a mode
      real(wp), intent(in) :: rate

      real(wp), parameter :: min_relative = 64.0_wp*epsilon(1.0_wp)

      relative = 1.0_wp - two_zeta*rate
      if (abs(relative) < min_relative) relative = min_relative
   end function relative_rate

   !> Difference of two poles, without cancellation where both lie near -1/(2 zeta).
   elemental function pole_difference(problem, a, b) result(difference)
      type(secular_t), intent(in) :: problem
      !> Index of the first pole
      integer, intent(in) :: a
      !> Index of the second pole
      integer, intent(in) :: b
      complex(wp) :: difference

      if (problem%is_clustered(a) .and. problem%is_clustered(b)) then
         difference = (problem%relative(a) - problem%relative(b))/problem%two_zeta
      else
         difference = problem%pole(a) - problem%pole(b)
      end if
   end function pole_difference

   !> s - pole for every pole.
   pure subroutine distances(problem, near, offset, distance)
      type(secular_t), intent(in) :: problem
      !> Index of the pole nearest to s
      integer, intent(in) :: near
      !> s less this pole
      complex(wp), intent(in) :: offset
      !> s - pole, [poles]
      complex(wp), intent(out) :: distance(:)

      integer :: j

      if (problem%is_clustered(near)) then
         do j = 1, problem%poles
            distance(j) = pole_difference(problem, near, j) + offset
         end do
      else
         do j = 1, problem%poles
            distance(j) = (problem%pole(near) - problem%pole(j)) + offset
         end do
      end if
   end subroutine distances

   !> Distances of one root from all other roots.
   pure subroutine root_distances(problem, near, offset, root, distance)
      type(secular_t), intent(in) :: problem
      !> Index of the pole that is nearest to each root
      integer, intent(in) :: near(:)
      !> Offset of each root from that pole
      complex(wp), intent(in) :: offset(:)
      !> Index of the root
      integer, intent(in) :: root
      !> The root less each other root; 0 for itself, [roots]
      complex(wp), intent(out) :: distance(:)

      integer :: j

      if (problem%is_clustered(near(root))) then
         do j = 1, size(near)
            distance(j) = pole_difference(problem, near(root), near(j)) + (offset(root) - offset(j))
         end do
      else
         do j = 1, size(near)
            distance(j) = (problem%pole(near(root)) - problem%pole(near(j))) + (offset(root) - offset(j))
         end do
      end if
      distance(root) = (0.0_wp, 0.0_wp)
   end subroutine root_distances

   !> Sum of 1/z over all z that are not 0.
   pure function sum_of_inverses(z) result(total)
      !> Numbers z; their squares do not underflow, except those of zeros
      complex(wp), intent(in) :: z(:)
      complex(wp) :: total

      real(wp) :: square, total_real, total_imaginary
      integer :: j

      total_real = 0.0_wp
      total_imaginary = 0.0_wp
      !$omp simd private(square) reduction(+:total_real, total_imaginary)
      do j = 1, size(z)
         square = max(real(z(j), wp)**2 + aimag(z(j))**2, tiny(1.0_wp))
         total_real = total_real + real(z(j), wp)/square
         total_imaginary = total_imaginary - aimag(z(j))/square
      end do
      total = cmplx(total_real, total_imaginary, wp)
   end function sum_of_inverses

   !> How much each mode moves the stops: b_i.b_i/|D_i|.
   pure function strengths(squared_value, distance) result(strength)
      !> b_i.b_i, [modes]
      real(wp), intent(in) :: squared_value(:)
      !> s - pole, of two poles for each mode, [poles]
      complex(wp), contiguous, intent(in) :: distance(:)
      real(wp) :: strength(size(squared_value))

      complex(wp) :: product
      integer :: i

      do i = 1, size(strength)
         product = distance(2*i - 1)*distance(2*i)
         strength(i) = squared_value(i)/max(abs(real(product, wp)) + abs(aimag(product)), sqrt(tiny(1.0_wp)))
      end do
   end function strengths

   !> |Re z| + |Im z|: within sqrt(2) of |z|, without its square root.
   elemental real(wp) function abs1(z) result(value)
      complex(wp), intent(in) :: z

      value = abs(real(z, wp)) + abs(aimag(z))
   end function abs1

end module pole_offsets
