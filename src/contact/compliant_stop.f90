!> Contact laws of compliant stops, as arithmetic on scalars that every integration method can use.
!>
!> Scales: displacements in D (eta), times tau, forces in lambda1^4 E Ibar D/L^3, stiffnesses in lambda1^4 E Ibar/L^3.
!>
!> With the indentation u the force of the stop is P = k u + P2, with P2 the force in a branch parallel to the spring
!> (Maxwell branch, or damper). After separation from the beam P is zero, and the surface recovers (three elements) or
!> stays at the beam without force (spring and damper).
module compliant_stop
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: dynamic_stiffness_t, compliant_stop_t, stop_step_t, contact_force, rounding_of_force, &
      mean_force_coefficients
   public :: dynamic_stiffness, has_same_dynamic_stiffness, is_rigid_stop

   !> Parameters of the dynamic stiffness of a stop: an indentation u exp(s tau) needs the force
   !> P = [k + c s + beta k s/(s + nu)] u exp(s tau).
   type :: dynamic_stiffness_t
      !> k; 0: the stop is rigid
      real(wp) :: stiffness = 0.0_wp
      !> beta k; 0: the branch is absent
      real(wp) :: branch_stiffness = 0.0_wp
      !> Relaxation rate nu of the branch: beta k over the damping coefficient of the branch; 0: the damper of the
      !> branch is rigid, or the branch is absent; `huge`: the branch bears no force
      real(wp) :: relaxation_rate = 0.0_wp
      !> Coefficient c of a damper parallel to the spring; 0 in every stop with a branch
      real(wp) :: viscosity = 0.0_wp
   end type dynamic_stiffness_t

   !> Coefficients of a time step of fixed length in which the indentation changes linearly from u to u+. The branch
   !> force then changes from P2 to P2+, not linearly.
   type :: stop_step_t
      !> Factor of u+ in the mean of P over the step
      real(wp) :: mean_slope = 0.0_wp
      !> Factor of u in the mean of P over the step
      real(wp) :: mean_indentation = 0.0_wp
      !> Factor of P2 in the mean of P over the step
      real(wp) :: mean_branch = 0.0_wp
      !> Factor of P2 in P2+ = decay P2 + gain (u+ - u)
      real(wp) :: decay = 1.0_wp
      !> Factor of u+ - u in P2+ = decay P2 + gain (u+ - u)
      real(wp) :: gain = 0.0_wp
      !> Decay factor u+/u of the free surface, which bears no force; 1: the surface does not recover by itself, but
      !> stays at the beam without force
      real(wp) :: recovery = 1.0_wp
   end type stop_step_t

   !> Contact law of a compliant stop; each extension is one law.
   type, abstract, extends(dynamic_stiffness_t) :: compliant_stop_t
      !> Rate of the exponential recovery of the free surface; 0: the surface does not recover by itself, but stays at
      !> the beam without force; `huge`: it recovers instantaneously
      real(wp) :: recovery_rate = 0.0_wp
   contains
      procedure(step_interface), deferred :: step
      procedure(energy_interface), deferred :: energy
      procedure(unload_interface), deferred :: unload
   end type compliant_stop_t

   abstract interface
      !> Coefficients of a time step, exact if u is linear in tau.
      pure type(stop_step_t) function step_interface(self, length) result(step)
         import :: stop_step_t, wp, compliant_stop_t
         implicit none (type, external)
         class(compliant_stop_t), intent(in) :: self
         !> Length of the step, tau
         real(wp), intent(in) :: length
      end function step_interface

      !> Energy in the springs.
      pure real(wp) function energy_interface(self, indentation, branch_force) result(energy)
         import :: wp, compliant_stop_t
         implicit none (type, external)
         class(compliant_stop_t), intent(in) :: self
         !> u
         real(wp), intent(in) :: indentation
         !> P2
         real(wp), intent(in) :: branch_force
      end function energy_interface

      !> Set the state without force, k u + P2 = 0, in which the surface is free. The law determines whether u jumps
      !> (three elements, if no damper prevents a jump) or P2 alone.
      pure subroutine unload_interface(self, indentation, branch_force)
         import :: wp, compliant_stop_t
         implicit none (type, external)
         class(compliant_stop_t), intent(in) :: self
         !> u; on return the indentation of the free surface
         real(wp), intent(inout) :: indentation
         !> P2; -k u on return
         real(wp), intent(inout) :: branch_force
      end subroutine unload_interface
   end interface

contains

   !> Whether the stop is rigid. A stiffness of 0 stands for an infinite one.
   elemental logical function is_rigid_stop(stop) result(answer)
      class(dynamic_stiffness_t), intent(in) :: stop

      answer = stop%stiffness <= 0.0_wp
   end function is_rigid_stop

   !> P = k u + P2.
   elemental real(wp) function contact_force(stop, indentation, branch_force) result(force)
      class(dynamic_stiffness_t), intent(in) :: stop
      !> u
      real(wp), intent(in) :: indentation
      !> P2
      real(wp), intent(in) :: branch_force

      force = stop%stiffness*indentation + branch_force
   end function contact_force

   !> Bound of the rounding error of P near its zeros: four units of rounding of the terms whose difference is P.
   elemental real(wp) function rounding_of_force(stop, max_term, speed) result(force)
      class(dynamic_stiffness_t), intent(in) :: stop
      !> Maximum magnitude of the terms whose difference is u
      real(wp), intent(in) :: max_term
      !> Magnitude of du/dtau
      real(wp), intent(in) :: speed

      force = 4.0_wp*epsilon(1.0_wp)*((stop%stiffness + stop%branch_stiffness)*max_term + stop%viscosity*speed)
   end function rounding_of_force

   !> Coefficients of the mean of P over a step as a function of u+: slope u+ + constant.
   elemental subroutine mean_force_coefficients(step, indentation, branch_force, slope, constant)
      type(stop_step_t), intent(in) :: step
      !> Indentation u at the start of the step
      real(wp), intent(in) :: indentation
      !> Branch force P2 at the start of the step
      real(wp), intent(in) :: branch_force
      !> Factor of u+, the indentation at the end of the step
      real(wp), intent(out) :: slope
      !> Contribution of the state at the start of the step
      real(wp), intent(out) :: constant

      slope = step%mean_slope
      constant = step%mean_indentation*indentation + step%mean_branch*branch_force
   end subroutine mean_force_coefficients

   !> Whether two stops have exactly the same dynamic stiffness.
   elemental logical function has_same_dynamic_stiffness(a, b) result(answer)
      type(dynamic_stiffness_t), intent(in) :: a
      type(dynamic_stiffness_t), intent(in) :: b

      answer = .not. (abs(a%stiffness - b%stiffness) > 0.0_wp .or. abs(a%viscosity - b%viscosity) > 0.0_wp .or. &
         abs(a%branch_stiffness - b%branch_stiffness) > 0.0_wp .or. abs(a%relaxation_rate - b%relaxation_rate) > 0.0_wp)
   end function has_same_dynamic_stiffness

   !> Dynamic stiffness of a stop: P over the indentation u exp(s tau).
   elemental function dynamic_stiffness(stop, s) result(stiffness)
      type(dynamic_stiffness_t), intent(in) :: stop
      !> Exponent s
      complex(wp), intent(in) :: s
      complex(wp) :: stiffness

      stiffness = stop%stiffness + stop%viscosity*s
      if (stop%branch_stiffness > 0.0_wp) then
         stiffness = stiffness + stop%branch_stiffness*s/(s + stop%relaxation_rate)
      end if
   end function dynamic_stiffness

end module compliant_stop
