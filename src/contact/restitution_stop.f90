!> Model A of the stop, a coefficient of restitution, as arithmetic on scalars for any way through time (docs/theory.md,
!> section 7).
!>
!> Scales: displacement eta, time tau, mass in rho Abar L.
module restitution_stop
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: rebound_impulse, rebound_energy_change, nodal_impulse, nodal_energy_change

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

end module restitution_stop
