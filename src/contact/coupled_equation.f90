!> Characteristic equation of a beam with several closed compliant contacts, at any s (docs/theory.md, sections 17 and
!> 18).
!>
!> The modes and the stops can move as exp(s tau) if s is a root of det(1/Z + H) = 0, with Z the diagonal matrix of the
!> dynamic stiffnesses of the stops and H(s) = sum b_i b_i'/D_i, where b_i are the modal values at the stops (b_i' is
!> the transpose) and D_i(s) = s^2 + W_i^2 (1 + 2 zeta s) + alpha_i s, with damping proportional to stiffness (zeta) and
!> to mass (alpha_i is then the same for all modes; damping ratios xi_i given mode by mode make it 2 xi_i W_i). A stop
!> has a Maxwell branch or viscosity, never both: N = s + nu and M = N Z = k (s + nu) + beta k s with a branch of
!> relaxation rate nu, N = 1 and M = Z = k + c s without a branch, N = 0 and M = 1 if the stop is rigid. N and M stand
!> for diagonal matrices, too, and the equation is det (N + M H) prod D_i = 0. All derivatives
!> are with respect to s.
module coupled_equation
   use compliant_stop, only: is_rigid_stop, dynamic_stiffness_t
   use damped_oscillators, only: lanes, padded
   use kinds, only: wp
   use pole_offsets, only: find_mode_poles, relative_rate, secular_t, abs1
   implicit none (type, external)
   private
   public :: coupled_equation_t, make_coupled_equation, even, stop_fractions

   !> Equation of the beam and the stops. The poles of `secular_t` are the two roots of D_i for each mode, side by side,
   !> then -nu of each branch. Numbers that are no poles follow, because distances from them are as small: the zeros of
   !> M and, if a branch or damper may creep, 0. Its `relative` is 1 + 2 zeta pole.
   type, extends(secular_t) :: coupled_equation_t
      !> b_i at the stops, [modes, stops]
      real(wp), allocatable :: value(:, :)
      !> alpha_i, [modes]
      real(wp), allocatable :: mass_rate(:)
      !> Dynamic stiffnesses of the stops, [stops]
      type(dynamic_stiffness_t), allocatable :: spring(:)
      !> Index of the pole of the branch of each stop, [stops]; 0: the stop has no branch
      integer, allocatable :: branch_pole(:)
      !> Index of the zero of M of each stop among the poles, [stops]; 0: M is constant
      integer, allocatable :: zero(:)
      !> b_ij b_ik of each pair of stops j <= k, with zeros up to whole SIMD vectors and an even number of modes,
      !> [lanes, even modes, vectors]
      real(wp), allocatable :: product(:, :, :)
      !> Sum of b_ij^2 over the stops, [modes]
      real(wp), allocatable :: squared_value(:)
   end type coupled_equation_t

contains

   !> Set up the equation and find its poles.
   subroutine make_coupled_equation(square, value, zeta, mass_rate, spring, problem)
      !> Squared circular frequencies W_i^2 of the modes with nonzero values at stops, ascending, [modes]
      real(wp), intent(in) :: square(:)
      !> b_i, [modes, stops]
      real(wp), intent(in) :: value(:, :)
      !> Coefficient of stiffness-proportional damping
      real(wp), intent(in) :: zeta
      !> alpha_i, [modes]
      real(wp), intent(in) :: mass_rate(:)
      !> Dynamic stiffnesses, [stops]
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      type(coupled_equation_t), intent(out) :: problem

      integer :: j, k, pair
      ! whether a branch or damper may creep slowly, so that 0 is stored as a pole, too
      logical :: creeps

      problem%modes = size(square)
      problem%two_zeta = 2.0_wp*zeta
      problem%poles = 2*size(square) + count(spring%branch_stiffness > 0.0_wp)
      ! each rigid stop removes one mode
      problem%roots = problem%poles - 2*count(is_rigid_stop(spring))
      problem%spring = spring
      allocate (problem%square, source=square)
      allocate (problem%value, source=value)
      allocate (problem%mass_rate, source=mass_rate)
      creeps = any(spring%branch_stiffness > 0.0_wp .or. spring%viscosity > 0.0_wp)
      allocate (problem%pole(problem%poles + count(spring%branch_stiffness > 0.0_wp .or. spring%viscosity > 0.0_wp) &
         + merge(1, 0, creeps)))
      allocate (problem%relative(size(problem%pole)))
      allocate (problem%branch_pole(size(spring)), problem%zero(size(spring)), source=0)
      call find_mode_poles(square, zeta, mass_rate, problem%pole, problem%relative)
      problem%poles = 2*size(square)
      do j = 1, size(spring)
         if (spring(j)%branch_stiffness <= 0.0_wp) cycle
         call add_pole(spring(j)%relaxation_rate)
         problem%branch_pole(j) = problem%poles
      end do
      do j = 1, size(spring)
         if (spring(j)%branch_stiffness > 0.0_wp) then
            call add_pole(spring(j)%relaxation_rate*(spring(j)%stiffness/(spring(j)%stiffness &
               + spring(j)%branch_stiffness)))
         else if (spring(j)%viscosity > 0.0_wp) then
            call add_pole(spring(j)%stiffness/spring(j)%viscosity)
         else
            cycle
         end if
         problem%zero(j) = problem%poles
      end do
      ! s = 0 is no pole, but slow creep has a root so near to 0 that only its distance from 0 has correct digits
      if (creeps) call add_pole(0.0_wp)
      allocate (problem%squared_value, source=sum(value**2, dim=2))
      allocate (problem%product(lanes, even(size(square)), padded((size(spring)*(size(spring) + 1))/2)/lanes), &
         source=0.0_wp)
      pair = 0
      do k = 1, size(spring)
         do j = 1, k
            problem%product(mod(pair, lanes) + 1, :size(square), pair/lanes + 1) = value(:, j)*value(:, k)
            pair = pair + 1
         end do
      end do
      ! poles whose distance from -1/(2 zeta) is less than half of 1/(2 zeta)
      problem%is_clustered = problem%two_zeta > 0.0_wp .and. abs(problem%relative) < 0.5_wp

   contains

      !> Append minus a rate to the poles.
      subroutine add_pole(rate)
         real(wp), intent(in) :: rate

         problem%poles = problem%poles + 1
         problem%pole(problem%poles) = -rate
         problem%relative(problem%poles) = relative_rate(problem%two_zeta, rate)
      end subroutine add_pole
   end subroutine make_coupled_equation

   !> The number itself if it is even, else the next one.
   pure integer function even(number)
      integer, intent(in) :: number

      even = number + mod(number, 2)
   end function even

   !> Denominator N and numerator M of Z = M/N of each stop, and their derivatives.
   pure subroutine stop_fractions(problem, s, distance, n, m, n_slope, m_slope)
      type(coupled_equation_t), intent(in) :: problem
      complex(wp), intent(in) :: s
      !> s - pole, [poles]
      complex(wp), intent(in) :: distance(:)
      !> N at s, [stops]
      complex(wp), intent(out), dimension(:) :: n
      !> M at s, [stops]
      complex(wp), intent(out), dimension(:) :: m
      !> Derivative of N at s, [stops]
      complex(wp), intent(out), dimension(:) :: n_slope
      !> Derivative of M at s, [stops]
      complex(wp), intent(out), dimension(:) :: m_slope

      integer :: j

      do j = 1, size(problem%spring)
         associate (spring => problem%spring(j))
            if (is_rigid_stop(spring)) then
               n(j) = 0.0_wp
               n_slope(j) = 0.0_wp
               m(j) = 1.0_wp
               m_slope(j) = 0.0_wp
            else if (problem%branch_pole(j) > 0) then
               n(j) = distance(problem%branch_pole(j))
               n_slope(j) = 1.0_wp
               m(j) = spring%stiffness*n(j) + spring%branch_stiffness*s
               m_slope(j) = spring%stiffness + spring%branch_stiffness
            else
               n(j) = 1.0_wp
               n_slope(j) = 0.0_wp
               m(j) = spring%stiffness + spring%viscosity*s
               m_slope(j) = spring%viscosity
            end if
            if (problem%zero(j) == 0) cycle
            ! near its zero, the sum has lost digits
            if (abs1(m(j)) < 0.1_wp*(spring%stiffness*abs1(n(j)))) m(j) = m_slope(j)*distance(problem%zero(j))
         end associate
      end do
   end subroutine stop_fractions

end module coupled_equation
