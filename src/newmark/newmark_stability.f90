!> Stability limit of Newmark's scheme.
!>
!> Hughes, The Finite Element Method, section 9.1: with gamma >= 1/2 and 2 beta < gamma a mode of frequency omega and
!> damping ratio xi is stable as long as
!>    omega h <= (xi (gamma - 1/2) + sqrt(gamma/2 - beta + xi^2 (gamma - 1/2)^2)) / (gamma/2 - beta),
!> with h the length of the step; with 2 beta >= gamma every step is stable.
module newmark_stability
   use bracketed_zero, only: bracket_t, enter_value, choose_point
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use skyline_matrix, only: combine, factorise, negative_pivots, skyline_t
   implicit none (type, external)
   private
   public :: is_unconditionally_stable, critical_step, highest_frequency

contains

   !> Whether the scheme is stable for steps of any length.
   elemental logical function is_unconditionally_stable(beta, gamma) result(stable)
      !> Newmark's beta
      real(wp), intent(in) :: beta
      !> Newmark's gamma, at least 1/2
      real(wp), intent(in) :: gamma

      stable = 2.0_wp*beta >= gamma
   end function is_unconditionally_stable

   !> The longest stable step of a conditionally stable scheme with damping in proportion to the stiffness. The highest
   !> frequency decides, because the stable step decreases with the frequency.
   elemental function critical_step(beta, gamma, zeta, frequency) result(step)
      !> Newmark's beta, below gamma/2
      real(wp), intent(in) :: beta
      !> Newmark's gamma, at least 1/2
      real(wp), intent(in) :: gamma
      !> Damping factor; the damping ratio of a mode is zeta omega
      real(wp), intent(in) :: zeta
      !> Highest frequency, in omega1
      real(wp), intent(in) :: frequency
      !> Length of the step, tau
      real(wp) :: step

      ! xi (gamma - 1/2) and gamma/2 - beta of the formula above
      real(wp) :: damping_term

      damping_term = zeta*frequency*(gamma - 0.5_wp)
      associate (stability_deficit => 0.5_wp*gamma - beta)
         step = (damping_term + sqrt(stability_deficit + damping_term**2))/(stability_deficit*frequency)
      end associate
   end function critical_step

   !> An upper bound of the highest frequency omega of K y = omega^2 M y, within one part in a million, by bisection for
   !> the eigenvalue omega^2: the number of negative pivots of K - sigma M is the number of eigenvalues below sigma.
   pure subroutine highest_frequency(stiffness, mass, frequency, error)
      !> K
      type(skyline_t), intent(in) :: stiffness
      !> M, of the same profile
      type(skyline_t), intent(in) :: mass
      !> omega, or slightly more, per unit of the time in which K and M are given
      real(wp), intent(out) :: frequency
      !> Set if no bound is found
      type(failure_t), allocatable, intent(out) :: error

      ! relative error of omega^2, which is twice that of omega
      real(wp), parameter :: accuracy = 2.0e-6_wp
      integer, parameter :: max_doublings = 2000
      type(bracket_t) :: bracket
      ! lower bound of the highest eigenvalue
      real(wp) :: below
      ! upper bound of the highest eigenvalue
      real(wp) :: above
      integer :: i

      frequency = 0.0_wp
      ! the Rayleigh quotient of each unit vector is a lower bound of the highest eigenvalue
      below = maxval(stiffness%values(stiffness%diagonal)/mass%values(mass%diagonal))
      above = 2.0_wp*below
      do i = 1, max_doublings
         if (all_below(stiffness, mass, above)) exit
         below = above
         above = 2.0_wp*above
      end do
      if (i > max_doublings) then
         call fail(error, status_run_failed, 'no bound of the highest frequency of this beam was found')
         return
      end if
      ! The value of a point is 1 below the highest eigenvalue and -1 above it. Only the signs have a meaning, so a
      ! negative tolerance switches off the test of the values. The search ends if the bracket is shorter than
      ! `accuracy` times its upper end, which is an upper bound of the eigenvalue throughout
      bracket = bracket_t(low=below, high=above, value_tolerance=-1.0_wp, length_tolerance=accuracy)
      call choose_point(bracket)
      do while (.not. bracket%is_found)
         call enter_value(bracket, merge(-1.0_wp, 1.0_wp, all_below(stiffness, mass, bracket%point)))
         call choose_point(bracket)
      end do
      frequency = sqrt(bracket%high)
   end subroutine highest_frequency

   !> Whether all eigenvalues of K y = omega^2 M y are below sigma. If a pivot vanishes, sigma may be an eigenvalue; the
   !> result is then false, so that the caller seeks the bound above sigma.
   pure logical function all_below(stiffness, mass, sigma) result(below)
      !> K
      type(skyline_t), intent(in) :: stiffness
      !> M
      type(skyline_t), intent(in) :: mass
      real(wp), intent(in) :: sigma

      type(skyline_t) :: shifted
      type(failure_t), allocatable :: error

      shifted = combine(1.0_wp, stiffness, -sigma, mass)
      call factorise(shifted, error, positive=.false.)
      below = .false.
      if (.not. allocated(error)) below = negative_pivots(shifted) == shifted%order
   end function all_below

end module newmark_stability
