!> Model B of the stop (standard linear solid): a spring k in parallel with a Maxwell branch, which is a spring beta k
!> in series with a damper c (docs/theory.md, section 8).
!>
!> The branch force P2 follows from dP2/dtau + nu P2 = beta k du/dtau, with u the indentation and nu = beta k/c the
!> relaxation rate. The force of the stop is P = k u + P2.
module three_element_stop
   use compliant_stop, only: contact_force, stop_step_t, compliant_stop_t
   use kinds, only: lambda1_power4, wp
   implicit none (type, external)
   private
   public :: three_element_t, make_three_element

   !> The standard linear solid as contact law of a stop.
   type, extends(compliant_stop_t) :: three_element_t
   contains
      procedure :: step
      procedure :: energy
      procedure :: unload
   end type three_element_t

contains

   !> Make model B from the dimensionless ratios of the paper (Irie, Yamada, Asano 1977).
   elemental type(three_element_t) function make_three_element(stiffness_ratio, branch_ratio, damper_ratio) result(stop)
      !> Stiffness ratio kappa = k/(3 E Ibar/L^3), with Ibar that of the section of mean height
      real(wp), intent(in) :: stiffness_ratio
      !> Stiffness beta of the branch spring over k
      real(wp), intent(in) :: branch_ratio
      !> Damping ratio c* = c omega1/(3 E Ibar/L^3); 0: the branch bears no force
      real(wp), intent(in) :: damper_ratio

      ! c/k below which the force of the damper in any mode is below the rounding error of that of the spring
      real(wp), parameter :: min_damper = 1.0e-30_wp
      real(wp) :: branch

      branch = branch_ratio*stiffness_ratio
      stop%stiffness = 3.0_wp*stiffness_ratio/lambda1_power4
      ! the force of a weaker branch is below the rounding error of that of the spring
      if (branch_ratio <= epsilon(1.0_wp)) return
      if (damper_ratio <= min_damper*stiffness_ratio) then
         ! a damper without resistance: the branch is absent, and without force the surface is undeformed
         stop%relaxation_rate = huge(1.0_wp)
         stop%recovery_rate = huge(1.0_wp)
      else
         stop%branch_stiffness = branch_ratio*stop%stiffness
         stop%relaxation_rate = branch/damper_ratio
         ! without force P2 = -k u, and the equation of the branch becomes du/dtau = -nu u/(1 + beta)
         stop%recovery_rate = stop%relaxation_rate/(1.0_wp + branch_ratio)
      end if
   end function make_three_element

   !> Gain beta k phi in the formula of `branch_decay`: beta k if the damper is rigid (nu = 0), 0 if the damper has no
   !> resistance (nu infinite).
   elemental real(wp) function branch_gain(stop, step) result(gain)
      type(three_element_t), intent(in) :: stop
      !> Length of the step, tau
      real(wp), intent(in) :: step

      real(wp) :: x

      gain = 0.0_wp
      if (stop%relaxation_rate >= huge(1.0_wp)) return
      x = stop%relaxation_rate*step
      if (x > 1.0_wp) then
         gain = stop%branch_stiffness*(1.0_wp - exp(-x))/x
      else if (x > 0.0_wp) then
         ! 1 - exp(-x) = 2 exp(-x/2) sinh(x/2), without cancellation
         gain = stop%branch_stiffness*exp(-0.5_wp*x)*sinh(0.5_wp*x)/(0.5_wp*x)
      else
         gain = stop%branch_stiffness
      end if
   end function branch_gain

   !> Coefficient g = beta k (1 - phi)/(nu step) in the mean of P2 over the step, phi P2(tau) + g (u(tau + step) -
   !> u(tau)), with phi = (1 - exp(-nu step))/(nu step).
   elemental real(wp) function branch_mean_gain(stop, step) result(gain)
      type(three_element_t), intent(in) :: stop
      !> Length of the step, tau
      real(wp), intent(in) :: step

      integer, parameter :: last_factor = 20
      real(wp) :: x, term
      integer :: i

      gain = 0.0_wp
      if (stop%relaxation_rate >= huge(1.0_wp)) return
      x = stop%relaxation_rate*step
      if (x > 1.0_wp) then
         gain = stop%branch_stiffness*(1.0_wp - (1.0_wp - exp(-x))/x)/x
      else
         ! power series (1 - phi)/x = 1/2 - x/6 + x^2/24 - ..., up to x^17/19!
         term = 0.5_wp*stop%branch_stiffness
         do i = 3, last_factor
            gain = gain + term
            term = -term*x/real(i, wp)
         end do
      end if
   end function branch_mean_gain

   !> exp(-rate step), including the limits of rate 0 and infinity.
   elemental real(wp) function decay_over(rate, step) result(decay)
      !> Rate per tau; `huge` means infinity
      real(wp), intent(in) :: rate
      !> Time
      real(wp), intent(in) :: step

      decay = 1.0_wp
      if (step <= 0.0_wp) return
      decay = 0.0_wp
      if (rate < huge(1.0_wp)) decay = exp(-rate*step)
   end function decay_over

   !> Coefficients of a time step. The energy stored in the springs plus the energy dissipated in the damper equals the
   !> work of the mean of P on the stop.
   pure type(stop_step_t) function step(self, length)
      class(three_element_t), intent(in) :: self
      real(wp), intent(in) :: length

      real(wp) :: mean_gain

      mean_gain = branch_mean_gain(self, length)
      step%decay = decay_over(self%relaxation_rate, length)
      step%gain = branch_gain(self, length)
      step%mean_slope = 0.5_wp*self%stiffness + mean_gain
      step%mean_indentation = 0.5_wp*self%stiffness - mean_gain
      if (self%branch_stiffness > 0.0_wp) step%mean_branch = step%gain/self%branch_stiffness
      step%recovery = decay_over(self%recovery_rate, length)
   end function step

   !> Release the remaining force instantaneously: both springs deform, the damper does not move. The surface is then
   !> free, P2 = -k u.
   pure subroutine unload(self, indentation, branch_force)
      class(three_element_t), intent(in) :: self
      !> u; on return the indentation of the free surface
      real(wp), intent(inout) :: indentation
      !> P2; -k u on return
      real(wp), intent(inout) :: branch_force

      real(wp) :: total

      total = self%stiffness + self%branch_stiffness
      if (total > 0.0_wp) indentation = indentation - contact_force(self, indentation, branch_force)/total
      branch_force = -self%stiffness*indentation
   end subroutine unload

   !> Energy in both springs, k u^2/2 + P2^2/(2 beta k).
   pure real(wp) function energy(self, indentation, branch_force)
      class(three_element_t), intent(in) :: self
      !> u
      real(wp), intent(in) :: indentation
      !> P2
      real(wp), intent(in) :: branch_force

      energy = 0.5_wp*self%stiffness*indentation**2
      if (self%branch_stiffness > 0.0_wp) energy = energy + 0.5_wp*branch_force**2/self%branch_stiffness
   end function energy

end module three_element_stop
