!> What is kept of a Newmark run: histories at the sample times, shapes, the energy ledger. Nothing is
!> computed that was not asked for.
module newmark_recorder
   use history_list, only: eta_stop, eta_tip, force_stop, velocity_stop
   use kinds, only: wp
   use newmark_stepper, only: kinetic_energy, newmark_state_t, newmark_stepper_t, strain_energy
   use response_types, only: response_t
   use stop_models, only: stop_energy, three_element_t
   implicit none (type, external)
   private
   public :: ledger_t, record_sample, record_shapes

   !> Energies lost and won so far.
   type :: ledger_t
      !> Inside the beam, in the stop, at impacts
      real(wp) :: dissipated_beam = 0.0_wp
      real(wp) :: dissipated_stop = 0.0_wp
      real(wp) :: dissipated_impact = 0.0_wp
      !> By the nodal reading of the impulse
      real(wp) :: created = 0.0_wp
   end type ledger_t

contains

   !> Keep the state at a sample time.
   pure subroutine record_sample(stepper, stop, state, ledger, sample, preload, height_ratio, response)
      !> The beam; its room is used
      type(newmark_stepper_t), intent(inout) :: stepper
      !> Model B; without it the defaults, which hold no energy
      type(three_element_t), intent(in) :: stop
      !> The state
      type(newmark_state_t), intent(in) :: state
      !> What was lost and won
      type(ledger_t), intent(in) :: ledger
      !> Number of the sample, from 0
      integer, intent(in) :: sample
      !> delta
      real(wp), intent(in) :: preload
      !> hbar/L
      real(wp), intent(in) :: height_ratio
      !> What is kept
      type(response_t), intent(inout) :: response

      associate (i => sample + 1, c => stepper%stop_dof)
         if (allocated(response%history(eta_stop)%values)) response%history(eta_stop)%values(i) = state%displacement(c) - preload
         if (allocated(response%history(eta_tip)%values)) &
            response%history(eta_tip)%values(i) = state%displacement(stepper%tip_dof) - preload
         if (allocated(response%history(velocity_stop)%values)) response%history(velocity_stop)%values(i) = state%velocity(c)
         if (allocated(response%history(force_stop)%values)) response%history(force_stop)%values(i) = height_ratio*state%force
         if (.not. allocated(response%energy)) return
         associate (energy => response%energy)
            call kinetic_energy(stepper, state, energy%kinetic(i))
            call strain_energy(stepper, state, energy%strain(i))
            energy%stop(i) = stop_energy(stop, state%indentation, state%branch_force)
            energy%dissipated_beam(i) = ledger%dissipated_beam
            energy%dissipated_stop(i) = ledger%dissipated_stop
            energy%dissipated_impact(i) = ledger%dissipated_impact
            energy%created(i) = ledger%created
         end associate
      end associate
   end subroutine record_sample

   !> Keep the shapes asked for within a step: displacements by the cubic through both states and their rates, rates on
   !> the straight line between them. At an event the state before it counts.
   pure subroutine record_shapes(order, old, new, tau, step, preload, next, response)
      !> Number of degrees of freedom
      integer, intent(in) :: order
      !> State at the beginning of the step
      type(newmark_state_t), intent(in) :: old
      !> State at its end
      type(newmark_state_t), intent(in) :: new
      !> Instant of the end
      real(wp), intent(in) :: tau
      !> Length of the step
      real(wp), intent(in) :: step
      !> delta
      real(wp), intent(in) :: preload
      !> The next shape to keep
      integer, intent(inout) :: next
      !> What is kept
      type(response_t), intent(inout) :: response

      real(wp) :: s, weight(4)

      do while (next <= size(response%shape_tau))
         if (response%shape_tau(next) > tau) exit
         ! the instant lies in the step, but for rounding
         s = 1.0_wp
         if (step > 0.0_wp) s = max(0.0_wp, 1.0_wp - (tau - response%shape_tau(next))/step)
         weight = [(1.0_wp + 2.0_wp*s)*(1.0_wp - s)**2, step*s*(1.0_wp - s)**2, &
                   s**2*(3.0_wp - 2.0_wp*s), -step*s**2*(1.0_wp - s)]
         associate (y => response%shape_displacement(:, next), slope => response%shape_slope(:, next), &
                    v => response%shape_velocity(:, next), slope_rate => response%shape_slope_velocity(:, next))
            y(1) = -preload
            y(2:) = weight(1)*old%displacement(1:order:2) + weight(2)*old%velocity(1:order:2) &
                    + weight(3)*new%displacement(1:order:2) + weight(4)*new%velocity(1:order:2) - preload
            slope(2:) = weight(1)*old%displacement(2:order:2) + weight(2)*old%velocity(2:order:2) &
                        + weight(3)*new%displacement(2:order:2) + weight(4)*new%velocity(2:order:2)
            v(2:) = (1.0_wp - s)*old%velocity(1:order:2) + s*new%velocity(1:order:2)
            slope_rate(2:) = (1.0_wp - s)*old%velocity(2:order:2) + s*new%velocity(2:order:2)
         end associate
         next = next + 1
      end do
   end subroutine record_shapes

end module newmark_recorder
