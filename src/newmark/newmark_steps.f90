!> Newmark steps of the beam with closed contacts: a rigid contact fixes its point, and the force of a compliant contact
!> is implicit in the step.
!>
!> The contact forces f at the end of a step enter through the columns A^-1 w of the contact rows, so the closed
!> contacts yield a small system of linear equations for their forces. A is the matrix of a step (`newmark_stepper`),
!> and the row w of a contact gives the normal displacement w . y of its point. At a rigid contact the displacement of
!> the point does not change. At a three-element stop the mean of the force P over the step follows from the indentation
!> u+ at its end: slope u+ + intercept, exact if u is linear in time. A spring and damper has the force k u+ + c du/dtau
!> at the end of the step. There u+ = height + shift - w . y, with the height of the contact surface and the shift, the
!> gap at which contact began (components of the contact).
!>
!> During a trial step `states(now)` is the state at the beginning, and `states(3 - now)` the state at the end.
module newmark_steps
   use banded_steps, only: add_column
   use complementarity, only: solve_active
   use compliant_stop, only: contact_force, mean_force_coefficients
   use contact_rows, only: row_value, band
   use kinds, only: wp
   use motion_intervals, only: observed_contact_t
   use newmark_energies, only: beam_dissipation
   use newmark_loads, only: load_at_end
   use newmark_run, only: indentation_at, gap_at, instant_of, is_constrained, is_inactive, is_in_contact, is_unloaded, &
      is_open, &
      is_force_free, newmark_run_t, contact_energy, whole_step
   use newmark_stepper, only: deepest_level, finish_step, impose_row_value, make_factors, predict_step, solve_for_row
   use run_observers, only: observe
   use stop_contacts, only: observed_height
   implicit none (type, external)
   private
   public :: prepare_level, try_step, find_violations, account_step, observe_step

contains

   !> Prepare a step of given length.
   pure subroutine prepare_level(run, level)
      type(newmark_run_t), intent(inout) :: run
      !> Number of halvings of the step
      integer, intent(in) :: level

      integer :: j, k

      call make_factors(run%stepper, level, run%error)
      if (allocated(run%error)) return
      associate (factors => run%factors(level), contacts => run%contacts, n => size(run%contacts))
         ! vectors are padded with `band` zeros at both ends, the half bandwidth of the beam's matrices
         allocate (factors%columns(1 - band:run%stepper%length + band, n), factors%gains(n, n), factors%stops(n))
         do k = 1, n
            call solve_for_row(run%stepper, level, contacts(k)%row, factors%columns(:, k))
            if (allocated(contacts(k)%stop)) factors%stops(k) = contacts(k)%stop%step(run%stepper%factors(level)%step)
            factors%gains(:, k) = [(row_value(contacts(j)%row, factors%columns(:, k)), j=1, n)]
         end do
         factors%made = .true.
      end associate
   end subroutine prepare_level

   !> Take a trial step from the present state; the result is stored at the other index of `states`.
   pure subroutine try_step(run, level)
      type(newmark_run_t), intent(inout) :: run
      !> Number of halvings of the step
      integer, intent(in) :: level

      ! number of all closed contacts
      integer :: count_closed
      ! number of the closed rigid contacts, which come first in the list `closed`
      integer :: count_constrained
      integer :: j
      integer :: k

      ! the load at the end of the step, and the instant at which it is evaluated: shortly before the end if the load
      ! jumps at the end
      if (run%loads%count > 0) call load_at_end(run, instant_of(run, shiftr(whole_step, level)), &
         run%states(3 - run%now)%beam%load, run%states(3 - run%now)%load_tau)
      call predict_step(run%stepper, level, run%states(run%now)%beam, run%states(3 - run%now)%beam)
      count_closed = 0
      do k = 1, size(run%contacts)
         run%states(3 - run%now)%force(k) = 0.0_wp
         if (run%contacts(k)%status == is_constrained) call append_closed(run, k, count_closed)
      end do
      count_constrained = count_closed
      if (run%has_compliant_stop) then
         do k = 1, size(run%contacts)
            if (run%contacts(k)%status == is_in_contact) call append_closed(run, k, count_closed)
         end do
      end if
      if (count_closed == 1 .and. count_constrained == 1) then
         ! a single rigid contact is solved in closed form: 4 % fewer instructions in a run of 8 elements at rest on it
         k = run%closed(1)
         run%right(1) = -row_value(run%contacts(k)%row, run%states(3 - run%now)%beam%acceleration) &
            /run%factors(level)%gains(k, k)
         run%states(3 - run%now)%force(k) = run%right(1)
      else if (count_closed > 0) then
         call find_forces_of_closed(run, level, count_closed)
      end if
      call finish_step(run%stepper, level, size(run%contacts), run%factors(level)%columns, count_closed, run%closed, &
         run%right, run%states(3 - run%now)%beam)
      if (count_closed > count_constrained) call correct_compliant(run, level, count_constrained, count_closed)
      do j = 1, count_constrained
         associate (row => run%contacts(run%closed(j))%row, old => run%states(run%now)%beam, &
            new => run%states(3 - run%now)%beam)
            ! these values are exact but for rounding errors
            call impose_row_value(run%stepper, row, row_value(row, old%displacement), new%displacement)
            call impose_row_value(run%stepper, row, 0.0_wp, new%velocity)
            call impose_row_value(run%stepper, row, 0.0_wp, new%acceleration)
         end associate
      end do
      if (run%has_compliant_stop) call move_open_contacts(run, level)
   end subroutine try_step

   !> Advance the indentation of compliant contacts that carry no force.
   pure subroutine move_open_contacts(run, level)
      type(newmark_run_t), intent(inout) :: run
      !> Number of halvings of the step
      integer, intent(in) :: level

      integer :: k

      associate (old => run%states(run%now), new => run%states(3 - run%now))
         do k = 1, size(run%contacts)
            associate (contact => run%contacts(k), u => new%indentation(k))
               ! without force 0 = P = k u + P2, so the branch force is -k u
               select case (contact%status)
               case (is_open)
                  contact%work = 0.0_wp
                  u = 0.0_wp
                  new%branch_force(k) = 0.0_wp
                  if (old%indentation(k) <= 0.0_wp .or. contact%is_viscous) cycle
                  ! the free surface of a three-element stop recovers exponentially
                  u = old%indentation(k)*run%factors(level)%stops(k)%recovery
                  new%branch_force(k) = -contact%stop%stiffness*u
               case (is_unloaded)
                  ! the surface of a spring and damper stays on the beam
                  contact%work = 0.0_wp
                  u = max(indentation_at(run, k, new), 0.0_wp)
                  new%branch_force(k) = -contact%stop%stiffness*u
               end select
            end associate
         end do
      end associate
   end subroutine move_open_contacts

   !> Append a contact to the list of closed contacts.
   pure subroutine append_closed(run, k, count_closed)
      type(newmark_run_t), intent(inout) :: run
      !> Index of the contact
      integer, intent(in) :: k
      !> Number of closed contacts in the list
      integer, intent(inout) :: count_closed

      count_closed = count_closed + 1
      run%closed(count_closed) = k
   end subroutine append_closed

   !> Find the forces f of the closed contacts from the linear equations sum_j rows(i, j) f_j = right(i). For a rigid
   !> contact and for a spring and damper f is the force at the end of the step. For a three-element stop f is twice the
   !> mean force of the step less the force at its beginning: a force that changes linearly to f has the right mean.
   pure subroutine find_forces_of_closed(run, level, count_closed)
      type(newmark_run_t), intent(inout) :: run
      !> Number of halvings of the step
      integer, intent(in) :: level
      !> Number of closed contacts
      integer, intent(in) :: count_closed

      ! normal acceleration at the end of the step without contact forces
      real(wp) :: acceleration
      ! normal displacement at the end of the step without contact forces
      real(wp) :: y
      ! normal velocity at the end of the step without contact forces
      real(wp) :: v
      ! derivatives of displacement, h^2/4, and velocity, h/2, by the acceleration at the end of a step of length h;
      ! they hold for any beta and gamma, because the stepper has turned the scheme into average acceleration
      real(wp) :: displacement_factor, velocity_factor
      ! minus the derivative of the contact force with respect to that acceleration; > 0, because the force falls as the
      ! beam moves away
      real(wp) :: factor
      ! the mean force of a three-element stop is slope u+ + intercept
      real(wp) :: slope, intercept
      integer :: i, k

      velocity_factor = 0.5_wp*run%stepper%factors(level)%step
      displacement_factor = velocity_factor**2
      associate (old => run%states(run%now), new => run%states(3 - run%now), factors => run%factors(level), &
         closed => run%closed(:count_closed))
         do i = 1, count_closed
            k = closed(i)
            associate (contact => run%contacts(k), right => run%right(i))
               acceleration = row_value(contact%row, new%beam%acceleration)
               if (contact%status == is_constrained) then
                  run%rows(i, :count_closed) = factors%gains(k, closed)
                  right = -acceleration
                  cycle
               end if
               y = row_value(contact%row, new%beam%displacement) + displacement_factor*acceleration
               if (contact%is_viscous) then
                  v = row_value(contact%row, new%beam%velocity) + velocity_factor*acceleration
                  factor = contact%stop%stiffness*displacement_factor + contact%stop%viscosity*velocity_factor
                  right = contact%stop%stiffness*(contact%contact%height + contact%shift - y) - contact%stop%viscosity*v
               else
                  call mean_force_coefficients(factors%stops(k), old%indentation(k), old%branch_force(k), slope, &
                     intercept)
                  factor = 2.0_wp*slope*displacement_factor
                  right = 2.0_wp*(slope*(contact%contact%height + contact%shift - y) + intercept) - old%force(k)
               end if
               run%rows(i, :count_closed) = factor*factors%gains(k, closed)
               run%rows(i, i) = 1.0_wp + run%rows(i, i)
            end associate
         end do
         if (count_closed == 1) then
            ! 3 % fewer instructions than by a call, in a run of 8 elements that is in contact with a three-element stop
            ! half the time
            run%right(1) = run%right(1)/run%rows(1, 1)
         else
            call solve_active(run%rows(:count_closed, :count_closed), -run%right(:count_closed), &
               spread(.true., 1, count_closed), run%right(:count_closed))
         end if
         new%force(closed) = run%right(:count_closed)
      end associate
   end subroutine find_forces_of_closed

   !> Replace the force f of three-element stops, by which the step had the right mean force (`find_forces_of_closed`),
   !> by the force P at the end of the step. Accelerations and rigid reactions change accordingly; displacements and
   !> velocities do not. Also set indentation, branch force and work of all closed compliant contacts.
   pure subroutine correct_compliant(run, level, count_constrained, count_closed)
      type(newmark_run_t), intent(inout) :: run
      !> Number of halvings of the step
      integer, intent(in) :: level
      !> Number of closed rigid contacts, which come first in the list of closed contacts
      integer, intent(in) :: count_constrained
      !> Number of closed contacts
      integer, intent(in) :: count_closed

      ! P less f
      real(wp) :: change
      ! the mean force over the step is slope u+ + intercept
      real(wp) :: intercept, slope
      integer :: i, k

      associate (old => run%states(run%now), new => run%states(3 - run%now), stops => run%factors(level)%stops, &
         closed => run%closed(:count_constrained))
         run%right(:count_constrained) = 0.0_wp
         do i = count_constrained + 1, count_closed
            k = run%closed(i)
            associate (contact => run%contacts(k), u => new%indentation(k))
               u = indentation_at(run, k, new)
               if (contact%is_viscous) then
                  new%branch_force(k) = new%force(k) - contact%stop%stiffness*u
                  contact%work = 0.5_wp*(old%force(k) + new%force(k))*(u - old%indentation(k))
                  cycle
               end if
               call mean_force_coefficients(stops(k), old%indentation(k), old%branch_force(k), slope, intercept)
               contact%work = (slope*u + intercept)*(u - old%indentation(k))
               new%branch_force(k) = stops(k)%decay*old%branch_force(k) + stops(k)%gain*(u - old%indentation(k))
               change = contact_force(contact%stop, u, new%branch_force(k)) - new%force(k)
               call add_force(run, k, change)
               run%right(:count_constrained) = run%right(:count_constrained) - change*run%mobility(closed, k)
            end associate
         end do
         if (count_constrained > 0) then
            ! the changes of the reactions keep the accelerations at the rigid contacts zero
            call solve_active(run%mobility(closed, closed), -run%right(:count_constrained), &
               spread(.true., 1, count_constrained), run%right(:count_constrained))
            do i = 1, count_constrained
               call add_force(run, closed(i), run%right(i))
            end do
         end if
      end associate
   end subroutine correct_compliant

   !> Add a contact force and its acceleration to the state at the end of the trial step.
   pure subroutine add_force(run, k, force)
      type(newmark_run_t), intent(inout) :: run
      !> Index of the contact
      integer, intent(in) :: k
      real(wp), intent(in) :: force

      associate (new => run%states(3 - run%now))
         new%force(k) = new%force(k) + force
         call add_column(run%stepper%length, force, run%mass_columns(:, k), new%beam%acceleration)
      end associate
   end subroutine add_force

   !> Find the contacts whose conditions the trial step violates. A NaN counts as a violation.
   pure subroutine find_violations(run, level, is_accepted)
      type(newmark_run_t), intent(inout) :: run
      !> Number of halvings of the step
      integer, intent(in) :: level
      !> Whether the step violates no contact condition
      logical, intent(out) :: is_accepted

      ! gap of a contact
      real(wp) :: gap
      ! minimum gap that is permitted, below zero by the tolerance
      real(wp) :: min_gap
      integer :: k

      ! the shortest step cannot be halved, so more rounding of the gap is permitted
      min_gap = -run%contact_tolerance
      if (level == deepest_level) min_gap = 2.0_wp*min_gap
      is_accepted = .true.
      associate (new => run%states(3 - run%now))
         do k = 1, size(run%contacts)
            select case (run%contacts(k)%status)
            case (is_open)
               gap = gap_at(run, k, new)
               ! a penetrating contact (`is_penetrating`) is violated by a NaN only, for which every comparison is false
               run%violates(k) = .not. (gap >= min_gap .or. (run%contacts(k)%is_penetrating .and. gap >= -huge(1.0_wp)))
            case (is_constrained, is_in_contact)
               run%violates(k) = .not. new%force(k) > 0.0_wp
            case (is_unloaded)
               run%violates(k) = .not. is_force_free(run, k, new)
            case (is_inactive)
               ! an inactive contact lies behind another rigid contact and has no condition
               run%violates(k) = .false.
            end select
            is_accepted = is_accepted .and. .not. run%violates(k)
         end do
      end associate
   end subroutine find_violations

   !> Add the work of loads and the dissipated energy of the accepted step to the energy balance.
   pure subroutine account_step(run, step)
      type(newmark_run_t), intent(inout) :: run
      !> Length of the step
      real(wp), intent(in) :: step

      real(wp) :: dissipated, work
      integer :: k

      ! the step has been accepted, so the state at its end has become the present state
      associate (old => run%states(3 - run%now), new => run%states(run%now), balance => run%energy_balance)
         if (run%loads%count > 0) then
            work = 0.5_wp*dot_product(old%beam%load + new%beam%load, new%beam%displacement - old%beam%displacement)
            balance%work = balance%work + work
            run%absolute_work = run%absolute_work + abs(work)
         end if
         call beam_dissipation(run%stepper, step, old%beam, new%beam, dissipated)
         balance%dissipated_beam = balance%dissipated_beam + dissipated
         if (.not. run%has_compliant_stop) return
         do k = 1, size(run%contacts)
            if (.not. allocated(run%contacts(k)%stop)) cycle
            dissipated = run%contacts(k)%work + contact_energy(run, k, old) - contact_energy(run, k, new)
            run%contacts(k)%dissipated = run%contacts(k)%dissipated + dissipated
            balance%dissipated_stop = balance%dissipated_stop + dissipated
         end do
      end associate
   end subroutine account_step

   !> Pass the accepted step to the observers.
   subroutine observe_step(run, from, step, energies, moments)
      type(newmark_run_t), intent(inout) :: run
      !> Beginning of the step, tau
      real(wp), intent(in) :: from
      !> Length of the step
      real(wp), intent(in) :: step
      !> Energy of beam and stops at both ends of the step
      real(wp), intent(in) :: energies(2)
      !> Bending moments at both ends of the step, [places, 2]
      real(wp), intent(in) :: moments(:, :)

      integer :: d, i, k

      associate (old => run%states(3 - run%now), new => run%states(run%now), interval => run%interval)
         interval%start = from
         interval%length = step
         interval%is_last = run%sample >= run%samples
         interval%energies = energies
         do k = 1, size(run%contacts)
            associate (contact => run%contacts(k), seen => interval%seen(k))
               ! the components after `signed_height`: `is_closed`, `is_compliant`, `has_finite_force`, `is_active`,
               ! `has_zero_gap` and `flights`. `has_finite_force` equals `is_compliant`, because each node has mass in
               ! Newmark's method, so that only compliant contacts have a finite maximum of the force. `has_zero_gap` is
               ! false, because the gap of a closed contact is zero only within the contact tolerance
               seen = observed_contact_t(contact%contact%number, contact%row%sign, observed_height(contact%contact), &
                  contact%status == is_constrained .or. contact%status == is_in_contact, allocated(contact%stop), &
                  allocated(contact%stop), contact%status /= is_inactive, .false., contact%flights)
               interval%ends(:, k) = [row_value(contact%row, old%beam%displacement) - contact%contact%height, &
                  row_value(contact%row, new%beam%displacement) - contact%contact%height, &
                  row_value(contact%row, old%beam%velocity), row_value(contact%row, new%beam%velocity)]
               interval%acceleration(:, k) = [row_value(contact%row, old%beam%acceleration), &
                  row_value(contact%row, new%beam%acceleration)]
               interval%line(:, k) = [old%force(k), new%force(k)]
            end associate
            ! energy dissipated since the last observed step, including that of an event at the start of this step
            associate (contact => run%contacts(k))
               interval%lost(k) = contact%dissipated - contact%lost_at_impacts - contact%observed
               contact%observed = contact%dissipated - contact%lost_at_impacts
            end associate
         end do
         ! k is now the number of contacts + 1, the index of the tip and of the first moment
         associate (tip => run%stepper%tip_dof)
            interval%acceleration(:, k) = [old%beam%acceleration(tip), new%beam%acceleration(tip)]
         end associate
         if (size(moments) > 0) interval%line(:, k:) = transpose(moments)
         ! displacement 0 is that of the tip, and the others are those of the recorded points
         do d = 0, size(run%points)
            i = run%stepper%tip_dof
            if (d > 0) i = run%points(d)%dof
            interval%ends(:, k + d) = [interval%origin(d) + [old%beam%displacement(i), new%beam%displacement(i)], &
               old%beam%velocity(i), new%beam%velocity(i)]
         end do
      end associate
      call observe(run%observers, run%interval)
   end subroutine observe_step

end module newmark_steps
