!> Energies of the beam of Newmark's steps, and what a step dissipates.
module newmark_energies
   use contact_rows, only: along, band, contact_row_t
   use kinds, only: wp
   use newmark_stepper, only: newmark_state_t, newmark_stepper_t
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
         energy = 0.5_wp*form_of(n, stepper%stiffness_diagonals, state%displacement)
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
         call find_mean(n, old%velocity, new%velocity, stepper%work)
         if (stepper%is_general) then
            call multiply(stepper%damping, stepper%work(1:n), stepper%result(1:n))
            dissipated = step*dot_product(stepper%work(1:n), stepper%result(1:n))
            return
         end if
         dissipated = step*stepper%double_zeta*form_of(n, stepper%stiffness_diagonals, stepper%work)
      end associate
   end subroutine beam_dissipation

   !> (x + y)/2
   pure subroutine find_mean(order, x, y, mean)
      !> Number of degrees of freedom
      integer, intent(in) :: order
      !> Padded
      real(wp), intent(in) :: x(1 - band:order + band)
      real(wp), intent(in) :: y(1 - band:order + band)
      !> The padding stays as it is
      real(wp), intent(inout) :: mean(1 - band:order + band)

      integer :: i

      do i = 1, order
         mean(i) = 0.5_wp*(x(i) + y(i))
      end do
   end subroutine find_mean

   !> x K x by the diagonals of K on one side, in partial sums: a third of the time of product and sum.
   pure function form_of(order, diagonals, x) result(form)
      !> Number of degrees of freedom
      integer, intent(in) :: order
      !> K(i, i + k) at (i, k)
      real(wp), intent(in) :: diagonals(order, -band:band)
      !> x, padded with zeros
      real(wp), intent(in) :: x(1 - band:order + band)
      real(wp) :: form

      integer :: i

      form = 0.0_wp
      !$omp simd reduction(+:form)
      do i = 1, order
         form = form + x(i)*(diagonals(i, 0)*x(i) &
            + 2.0_wp*(diagonals(i, 1)*x(i + 1) + diagonals(i, 2)*x(i + 2) + diagonals(i, 3)*x(i + 3)))
      end do
   end function form_of

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
         momentum = along(row, stepper%result)
      end associate
      mass = stepper%mass%values(stepper%mass%diagonal(row%dof))
   end subroutine momentum_along

end module newmark_energies
