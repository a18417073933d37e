!> Energies of the finite-element beam in Newmark's scheme, the energy dissipated inside it by a step, and its momentum
!> at a contact.
!>
!> A Newmark step of any beta and gamma equals a step by average acceleration of a beam with the mass matrix M* and the
!> damping matrix C* (module `newmark_stepper`). Energies and momentum are those of this equivalent beam: with them the
!> energy balance of a step (change of energy + dissipated energy = work of loads and contact forces) is exact to
!> rounding. y is the displacement vector, v = dy/dtau.
module newmark_energies
   use contact_rows, only: row_value, band, contact_row_t
   use kinds, only: wp
   use modal_steps, only: loss_of_modes
   use newmark_run, only: contact_energy, newmark_run_t
   use newmark_stepper, only: newmark_state_t, newmark_stepper_t
   use skyline_matrix, only: multiply
   implicit none (type, external)
   private
   public :: total_energy, kinetic_energy, strain_energy, beam_dissipation, momentum_along

contains

   !> Energy of beam and stops at the present state.
   pure subroutine total_energy(run, energy)
      type(newmark_run_t), intent(inout) :: run
      real(wp), intent(out) :: energy

      real(wp) :: kinetic
      integer :: k

      associate (state => run%states(run%now))
         call strain_energy(run%stepper, state%beam, energy)
         call kinetic_energy(run%stepper, state%beam, kinetic)
         energy = energy + kinetic + sum([(contact_energy(run, k, state), k=1, size(run%contacts))])
      end associate
   end subroutine total_energy

   !> Kinetic energy v . M* v / 2
   pure subroutine kinetic_energy(stepper, state, energy)
      !> The beam; its work arrays are overwritten
      type(newmark_stepper_t), intent(inout) :: stepper
      type(newmark_state_t), intent(in) :: state
      real(wp), intent(out) :: energy

      associate (n => stepper%order)
         call multiply(stepper%mass, state%velocity(1:n), stepper%result(1:n))
         energy = 0.5_wp*dot_product(state%velocity(1:n), stepper%result(1:n))
      end associate
   end subroutine kinetic_energy

   !> Strain energy y . K y / 2
   pure subroutine strain_energy(stepper, state, energy)
      !> The beam; its work arrays are overwritten
      type(newmark_stepper_t), intent(inout) :: stepper
      type(newmark_state_t), intent(in) :: state
      real(wp), intent(out) :: energy

      associate (n => stepper%order)
         if (stepper%uses_skyline) then
            call multiply(stepper%stiffness, state%displacement(1:n), stepper%result(1:n))
            energy = 0.5_wp*dot_product(state%displacement(1:n), stepper%result(1:n))
            return
         end if
         energy = 0.5_wp*quadratic_form(n, stepper%stiffness_diagonals, state%displacement)
      end associate
   end subroutine strain_energy

   !> Energy dissipated inside the beam over a step of length h: h u . C* u, with u the mean of the velocities at both
   !> ends. If gamma > 1/2 this energy includes the numerical dissipation of the scheme, because C* then contains a term
   !> (gamma - 1/2) times the undivided step times K.
   pure subroutine beam_dissipation(stepper, step, old, new, dissipated)
      !> The beam; its work arrays are overwritten
      type(newmark_stepper_t), intent(inout) :: stepper
      real(wp), intent(in) :: step
      !> State at the beginning of the step
      type(newmark_state_t), intent(in) :: old
      !> State at the end of the step
      type(newmark_state_t), intent(in) :: new
      !> The dissipated energy
      real(wp), intent(out) :: dissipated

      dissipated = 0.0_wp
      if (allocated(stepper%point_shape)) then
         dissipated = step*loss_of_modes(stepper%order, stepper%damping%values, old%velocity(1), new%velocity(1))
         return
      end if
      if (stepper%stiffness_damping <= 0.0_wp .and. .not. stepper%uses_skyline) return
      associate (n => stepper%order)
         stepper%work(1:n) = 0.5_wp*(old%velocity(1:n) + new%velocity(1:n))
         if (stepper%uses_skyline) then
            call multiply(stepper%damping, stepper%work(1:n), stepper%result(1:n))
            dissipated = step*dot_product(stepper%work(1:n), stepper%result(1:n))
            return
         end if
         dissipated = step*stepper%stiffness_damping*quadratic_form(n, stepper%stiffness_diagonals, stepper%work)
      end associate
   end subroutine beam_dissipation

   !> Quadratic form x . K x from the main diagonal of the symmetric matrix K and the three diagonals above it, summed
   !> by vector instructions: this takes a third of the time of a matrix product followed by a scalar product.
   pure real(wp) function quadratic_form(order, diagonals, x) result(form)
      !> Number of degrees of freedom
      integer, intent(in) :: order
      !> K(i, i + k) at (i, k)
      real(wp), intent(in) :: diagonals(order, -band:band)
      !> x, padded with zeros
      real(wp), intent(in) :: x(1 - band:order + band)

      integer :: i

      form = 0.0_wp
      !$omp simd reduction(+:form)
      do i = 1, order
         form = form + x(i)*(diagonals(i, 0)*x(i) &
            + 2.0_wp*(diagonals(i, 1)*x(i + 1) + diagonals(i, 2)*x(i + 2) + diagonals(i, 3)*x(i + 3)))
      end do
   end function quadratic_form

   !> Momentum u . M* v of the beam and mass u . M* u, with u the motion in which only the node at a contact moves, with
   !> the normal velocity 1. In degrees of freedom of the nodes u is the row vector of the contact, whose only entry is
   !> 1 or -1, so the mass is one entry of the diagonal of M*.
   pure subroutine momentum_along(stepper, state, row, momentum, mass, nodal_shape)
      !> The beam; its work arrays are overwritten
      type(newmark_stepper_t), intent(inout) :: stepper
      type(newmark_state_t), intent(in) :: state
      !> Row vector w, which gives the normal displacement at a contact
      type(contact_row_t), intent(in) :: row
      !> Momentum of the node along w
      real(wp), intent(out) :: momentum
      !> Mass of the node along w
      real(wp), intent(out) :: mass
      !> Velocities of the modes if only the node moves, with the velocity 1, [modes]; absent: the degrees of freedom
      !> are those of the nodes
      real(wp), intent(in), optional :: nodal_shape(:)

      associate (n => stepper%order)
         call multiply(stepper%mass, state%velocity(1:n), stepper%result(1:n))
         if (present(nodal_shape)) then
            momentum = row%sign*dot_product(nodal_shape, stepper%result(1:n))
            mass = dot_product(nodal_shape, stepper%mass%values*nodal_shape)
            return
         end if
         momentum = row_value(row, stepper%result)
      end associate
      mass = stepper%mass%values(stepper%mass%diagonal(row%dof))
   end subroutine momentum_along

end module newmark_energies
