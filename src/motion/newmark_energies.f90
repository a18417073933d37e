!> Energies of the beam of Newmark's steps, and what a step dissipates.
module newmark_energies
   use contact_rows, only: along, contact_row_t
   use kinds, only: wp
   use newmark_stepper, only: negative_product, newmark_state_t, newmark_stepper_t
   use skyline_matrix, only: multiply
   implicit none (type, external)
   private
   public :: kinetic_energy, strain_energy, beam_dissipation, momentum_along

contains

   !> y' M* y' / 2
   pure subroutine kinetic_energy(stepper, state, energy)
      !> The beam; its room is used
      type(newmark_stepper_t), intent(inout) :: stepper
      type(newmark_state_t), intent(in) :: state
      real(wp), intent(out) :: energy

      associate (n => stepper%order)
         call multiply(stepper%mass, state%velocity(1:n), stepper%result(1:n))
         energy = 0.5_wp*dot_product(state%velocity(1:n), stepper%result(1:n))
      end associate
   end subroutine kinetic_energy

   !> y K y / 2
   pure subroutine strain_energy(stepper, state, energy)
      !> The beam; its room is used
      type(newmark_stepper_t), intent(inout) :: stepper
      type(newmark_state_t), intent(in) :: state
      real(wp), intent(out) :: energy

      associate (n => stepper%order)
         if (stepper%is_general) then
            call multiply(stepper%stiffness, state%displacement(1:n), stepper%result(1:n))
            energy = 0.5_wp*dot_product(state%displacement(1:n), stepper%result(1:n))
            return
         end if
         call negative_product(n, stepper%stiffness_diagonals, state%displacement, stepper%result)
         energy = -0.5_wp*dot_product(state%displacement(1:n), stepper%result(1:n))
      end associate
   end subroutine strain_energy

   !> Energy dissipated inside the beam over a step, h w C* w with the mean velocity w: with gamma > 1/2 the scheme
   !> takes its part. The balance is exact to rounding.
   pure subroutine beam_dissipation(stepper, step, old, new, dissipated)
      !> The beam; its room is used
      type(newmark_stepper_t), intent(inout) :: stepper
      real(wp), intent(in) :: step
      !> State at the beginning
      type(newmark_state_t), intent(in) :: old
      !> State at the end
      type(newmark_state_t), intent(in) :: new
      !> The energy
      real(wp), intent(out) :: dissipated

      dissipated = 0.0_wp
      if (stepper%double_zeta <= 0.0_wp .and. .not. stepper%is_general) return
      associate (n => stepper%order)
         stepper%work = 0.5_wp*(old%velocity + new%velocity)
         if (stepper%is_general) then
            call multiply(stepper%damping, stepper%work(1:n), stepper%result(1:n))
            dissipated = step*dot_product(stepper%work(1:n), stepper%result(1:n))
            return
         end if
         call negative_product(n, stepper%stiffness_diagonals, stepper%work, stepper%result)
         dissipated = -step*stepper%double_zeta*dot_product(stepper%work(1:n), stepper%result(1:n))
      end associate
   end subroutine beam_dissipation

   !> w . M* y', and w . M* w
   pure subroutine momentum_along(stepper, state, row, momentum, mass)
      !> The beam; its room is used
      type(newmark_stepper_t), intent(inout) :: stepper
      type(newmark_state_t), intent(in) :: state
      !> w
      type(contact_row_t), intent(in) :: row
      real(wp), intent(out) :: momentum
      real(wp), intent(out) :: mass

      associate (n => stepper%order)
         call multiply(stepper%mass, state%velocity(1:n), stepper%result(1:n))
         momentum = along(row, stepper%result(1:n))
      end associate
      mass = stepper%mass%values(stepper%mass%diagonal(row%dof))
   end subroutine momentum_along

end module newmark_energies
