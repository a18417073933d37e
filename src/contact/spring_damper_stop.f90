!> A stop of a spring k and a damper c in parallel: P = max(0, k u + c u'), with u the indentation and u' = du/dtau.
!>
!> The contact surface does not recover independently of the beam: P vanishes while the stop is still indented, and from
!> then on spring and damper balance each other without contact force, and the surface moves with the beam. The branch
!> force P2 = c u' is that of the damper. A massless node of the beam in front of a rigid stop has the same law, but
!> recovers independently (`make_node_spring`).
module spring_damper_stop
   use compliant_stop, only: stop_step_t, compliant_stop_t
   use kinds, only: lambda1_power4, wp
   implicit none (type, external)
   private
   public :: spring_damper_t, make_spring_damper, make_node_spring

   !> Spring and damper in parallel as contact law of a stop.
   type, extends(compliant_stop_t) :: spring_damper_t
   contains
      procedure :: step
      procedure :: energy
      procedure :: unload
   end type spring_damper_t

contains

   !> Make the stop from the dimensionless ratios of a scene.
   elemental type(spring_damper_t) function make_spring_damper(stiffness_ratio, damper_ratio) result(stop)
      !> Stiffness ratio kappa = k/(3 E Ibar/L^3)
      real(wp), intent(in) :: stiffness_ratio
      !> Damping ratio c* = c omega1/(3 E Ibar/L^3)
      real(wp), intent(in) :: damper_ratio

      stop%stiffness = 3.0_wp*stiffness_ratio/lambda1_power4
      stop%viscosity = 3.0_wp*damper_ratio/lambda1_power4
   end function make_spring_damper

   !> A massless node between the beam and a rigid stop as a spring with a damper: the spring is the stiffness of the
   !> beam elements next to the node, whose damping is proportional to their stiffness. After its release the node
   !> returns exponentially to the displacement that the modes give it.
   elemental type(spring_damper_t) function make_node_spring(flexibility, two_zeta) result(stop)
      !> Displacement of the node per unit force on it, with all other degrees of freedom fixed, in L^3/(lambda1^4 E
      !> Ibar)
      real(wp), intent(in) :: flexibility
      !> 2 zeta of the beam; 0: the node returns instantly
      real(wp), intent(in) :: two_zeta

      stop%stiffness = 1.0_wp/flexibility
      stop%viscosity = two_zeta*stop%stiffness
      stop%recovery_rate = huge(1.0_wp)
      if (two_zeta > 0.0_wp) stop%recovery_rate = 1.0_wp/two_zeta
   end function make_node_spring

   !> Coefficients of a time step h from u0 to u1 in contact: the mean force k (u0 + u1)/2 + c (u1 - u0)/h; a step of
   !> length zero has no damper force.
   pure type(stop_step_t) function step(self, length)
      class(spring_damper_t), intent(in) :: self
      real(wp), intent(in) :: length

      real(wp) :: per_step

      per_step = 0.0_wp
      if (length > 0.0_wp) per_step = self%viscosity/length
      step%mean_slope = 0.5_wp*self%stiffness + per_step
      step%mean_indentation = 0.5_wp*self%stiffness - per_step
      step%decay = 0.0_wp
      step%gain = per_step
   end function step

   !> Set the branch force to that of a released stop; the indentation stays, because the surface moves with the beam.
   pure subroutine unload(self, indentation, branch_force)
      class(spring_damper_t), intent(in) :: self
      real(wp), intent(inout) :: indentation
      real(wp), intent(inout) :: branch_force

      branch_force = -self%stiffness*indentation
   end subroutine unload

   !> Energy in the spring.
   pure real(wp) function energy(self, indentation, branch_force)
      class(spring_damper_t), intent(in) :: self
      real(wp), intent(in) :: indentation
      real(wp), intent(in) :: branch_force

      ! the damper stores no energy
      associate (unused => branch_force)
      end associate
      energy = 0.5_wp*self%stiffness*max(indentation, 0.0_wp)**2
   end function energy

end module spring_damper_stop
