!> The two models of the stop as arithmetic on scalars, for any way through time (docs/theory.md, sections 7 and 8).
!>
!> Scales: displacement eta, time tau, mass in rho Abar L; so forces are Pbar / (hbar/L) and stiffnesses
!> k / (lambda1^4 E Ibar / L^3).
!>
!> Model A: coefficient of restitution. Model B: a spring k parallel to a Maxwell branch (spring beta k in
!> series with a damper c), with the indentation u and P = k u + P2, dP2/dtau + rate P2 = beta k du/dtau,
!> rate = beta k / c.
module stop_models
   use kinds, only: lambda1_power4, wp
   implicit none (type, external)
   private
   public :: rebound_impulse, rebound_energy_change, nodal_impulse, nodal_energy_change
   public :: three_element_t, make_three_element, branch_decay, branch_gain, branch_mean_gain, surface_decay
   public :: mean_force_coefficients, contact_force, unload_surface, stop_energy

   !> Model B.
   type :: three_element_t
      !> k
      real(wp) :: stiffness = 0.0_wp
      !> beta k, 0 where the branch is absent
      real(wp) :: branch_stiffness = 0.0_wp
      !> beta k / c; 0: the damper does not yield; `huge`: the branch bears nothing
      real(wp) :: relaxation_rate = 0.0_wp
      !> Rate at which the surface comes back without force, beta k / ((1 + beta) c)
      real(wp) :: surface_rate = 0.0_wp
   end type three_element_t

contains

   !> Impulse at the stop point that turns its velocity v_c into -eps v_c; with eps = 0 it stops the point.
   elemental function rebound_impulse(velocity, restitution, mobility) result(impulse)
      !> v_c before
      real(wp), intent(in) :: velocity
      !> eps
      real(wp), intent(in) :: restitution
      !> (M^-1)_cc, velocity of the stop point under a unit impulse on it
      real(wp), intent(in) :: mobility
      real(wp) :: impulse

      impulse = -(1.0_wp + restitution)*velocity/mobility
   end function rebound_impulse

   !> Change of energy under that impulse, never positive.
   elemental function rebound_energy_change(velocity, restitution, mobility) result(change)
      !> v_c before
      real(wp), intent(in) :: velocity
      !> eps
      real(wp), intent(in) :: restitution
      !> (M^-1)_cc
      real(wp), intent(in) :: mobility
      real(wp) :: change

      change = -(1.0_wp - restitution)*(1.0_wp + restitution)*velocity**2/(2.0_wp*mobility)
   end function rebound_energy_change

   !> What replacing v_c by -eps v_c alone does to the momentum in the row of the stop point.
   elemental function nodal_impulse(velocity, restitution, mass_diagonal) result(impulse)
      !> v_c before
      real(wp), intent(in) :: velocity
      !> eps
      real(wp), intent(in) :: restitution
      !> M_cc
      real(wp), intent(in) :: mass_diagonal
      real(wp) :: impulse

      impulse = -(1.0_wp + restitution)*velocity*mass_diagonal
   end function nodal_impulse

   !> Change of kinetic energy when v_c alone is replaced by -eps v_c; it can have either sign.
   elemental function nodal_energy_change(velocity, restitution, momentum, mass_diagonal) result(change)
      !> v_c before
      real(wp), intent(in) :: velocity
      !> eps
      real(wp), intent(in) :: restitution
      !> (M v)_c before
      real(wp), intent(in) :: momentum
      !> M_cc
      real(wp), intent(in) :: mass_diagonal
      real(wp) :: change

      real(wp) :: jump

      jump = -(1.0_wp + restitution)*velocity
      change = jump*(momentum + 0.5_wp*mass_diagonal*jump)
   end function nodal_energy_change

   !> Model B from the ratios of the paper.
   elemental function make_three_element(stiffness_ratio, branch_ratio, damper_ratio) result(stop)
      !> kappa
      real(wp), intent(in) :: stiffness_ratio
      !> beta
      real(wp), intent(in) :: branch_ratio
      !> c*; 0: the branch bears nothing
      real(wp), intent(in) :: damper_ratio
      type(three_element_t) :: stop

      real(wp) :: branch

      branch = branch_ratio*stiffness_ratio
      stop%stiffness = 3.0_wp*stiffness_ratio/lambda1_power4
      if (branch <= 0.0_wp) return
      if (damper_ratio <= branch*tiny(1.0_wp)) then
         ! a damper without resistance: the branch is absent, and without force the surface is at home
         stop%relaxation_rate = huge(1.0_wp)
         stop%surface_rate = huge(1.0_wp)
      else
         stop%branch_stiffness = branch_ratio*stop%stiffness
         stop%relaxation_rate = branch/damper_ratio
         stop%surface_rate = stop%relaxation_rate/(1.0_wp + branch_ratio)
      end if
   end function make_three_element

   !> E in P2(tau + step) = E P2(tau) + beta k phi (u(tau + step) - u(tau)), exact where u is linear in tau.
   elemental function branch_decay(stop, step) result(decay)
      !> Model B
      type(three_element_t), intent(in) :: stop
      !> Length of the step, tau
      real(wp), intent(in) :: step
      real(wp) :: decay

      decay = decay_over(stop%relaxation_rate, step)
   end function branch_decay

   !> beta k phi of the same formula, phi = (1 - E)/(rate step): beta k if the damper does not yield, 0 if it does not resist.
   elemental function branch_gain(stop, step) result(gain)
      !> Model B
      type(three_element_t), intent(in) :: stop
      !> Length of the step, tau
      real(wp), intent(in) :: step
      real(wp) :: gain

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

   !> beta k (1 - phi)/(rate step), phi as there: the mean of P2 over the step is phi P2(tau) + this (u(tau + step) - u(tau)).
   elemental function branch_mean_gain(stop, step) result(gain)
      !> Model B
      type(three_element_t), intent(in) :: stop
      !> Length of the step, tau
      real(wp), intent(in) :: step
      real(wp) :: gain

      integer, parameter :: last = 20
      real(wp) :: x, term
      integer :: i

      gain = 0.0_wp
      if (stop%relaxation_rate >= huge(1.0_wp)) return
      x = stop%relaxation_rate*step
      if (x > 1.0_wp) then
         gain = stop%branch_stiffness*(1.0_wp - (1.0_wp - exp(-x))/x)/x
      else
         ! 1/2 - x/6 + x^2/24 - ...
         term = 0.5_wp*stop%branch_stiffness
         do i = 3, last
            gain = gain + term
            term = -term*x/real(i, wp)
         end do
      end if
   end function branch_mean_gain

   !> Factor by which the indentation of the free surface shrinks over a step; there P2 = -k u.
   elemental function surface_decay(stop, step) result(decay)
      !> Model B
      type(three_element_t), intent(in) :: stop
      !> Length of the step, tau
      real(wp), intent(in) :: step
      real(wp) :: decay

      decay = decay_over(stop%surface_rate, step)
   end function surface_decay

   !> exp(-rate step), both limits of the rate included.
   elemental function decay_over(rate, step) result(decay)
      !> Rate; `huge` stands for infinity
      real(wp), intent(in) :: rate
      !> Time
      real(wp), intent(in) :: step
      real(wp) :: decay

      decay = 1.0_wp
      if (step <= 0.0_wp) return
      decay = 0.0_wp
      if (rate < huge(1.0_wp)) decay = exp(-rate*step)
   end function decay_over

   !> Mean of P over a step = slope u(tau + step) + rest, exact where u is linear in tau: then it gives the stop the energy that
   !> its springs keep and its damper takes, no less.
   elemental subroutine mean_force_coefficients(stop, gain, mean_gain, indentation, branch_force, slope, rest)
      !> Model B
      type(three_element_t), intent(in) :: stop
      !> `branch_gain` of the step
      real(wp), intent(in) :: gain
      !> `branch_mean_gain` of the step
      real(wp), intent(in) :: mean_gain
      !> u(tau)
      real(wp), intent(in) :: indentation
      !> P2(tau)
      real(wp), intent(in) :: branch_force
      !> Coefficient of u(tau + step)
      real(wp), intent(out) :: slope
      !> What the past contributes
      real(wp), intent(out) :: rest

      slope = 0.5_wp*stop%stiffness + mean_gain
      rest = (0.5_wp*stop%stiffness - mean_gain)*indentation
      if (stop%branch_stiffness > 0.0_wp) rest = rest + gain/stop%branch_stiffness*branch_force
   end subroutine mean_force_coefficients

   !> P = k u + P2.
   elemental function contact_force(stop, indentation, branch_force) result(force)
      !> Model B
      type(three_element_t), intent(in) :: stop
      !> u
      real(wp), intent(in) :: indentation
      !> P2
      real(wp), intent(in) :: branch_force
      real(wp) :: force

      force = stop%stiffness*indentation + branch_force
   end function contact_force

   !> Take what is left of the force off at once: both springs give, the damper does not move. The
   !> surface is then free, P2 = -k u.
   elemental subroutine unload_surface(stop, indentation, branch_force)
      !> Model B
      type(three_element_t), intent(in) :: stop
      !> u; that of the free surface on return
      real(wp), intent(inout) :: indentation
      !> P2; -k u on return
      real(wp), intent(inout) :: branch_force

      real(wp) :: total

      total = stop%stiffness + stop%branch_stiffness
      if (total > 0.0_wp) indentation = indentation - contact_force(stop, indentation, branch_force)/total
      branch_force = -stop%stiffness*indentation
   end subroutine unload_surface

   !> Energy in both springs, k u^2/2 + P2^2/(2 beta k).
   elemental function stop_energy(stop, indentation, branch_force) result(energy)
      !> Model B
      type(three_element_t), intent(in) :: stop
      !> u
      real(wp), intent(in) :: indentation
      !> P2
      real(wp), intent(in) :: branch_force
      real(wp) :: energy

      energy = 0.5_wp*stop%stiffness*indentation**2
      if (stop%branch_stiffness > 0.0_wp) energy = energy + 0.5_wp*branch_force**2/stop%branch_stiffness
   end function stop_energy

end module stop_models
