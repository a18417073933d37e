!> Compares two runs of one scene: instant and velocity of the first impact, displacements, energy and contact impulse.
module motion_errors
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use free_modes, only: free_modes_t
   use history_list, only: eta_stop, eta_tip
   use kinds, only: lambda1_power4, wp
   use load_settings, only: start_release
   use mode_choice, only: rates_of_modes
   use response_types, only: event_capture, event_contact, event_impact, response_t
   use run_settings, only: run_settings_t, side_below
   use skyline_matrix, only: factorise, multiply, skyline_t, solve_factorised
   implicit none (type, external)
   private
   public :: motion_errors_t, run_results_t, impulse_balance_t, make_balance, results_of, difference_of, extrapolate, &
      horizon_of, energy_unit

   !> Quantities by which a run is compared, up to the end of comparison (the horizon).
   type :: run_results_t
      !> Instant of the first impact, tau
      real(wp) :: impact_tau = 0.0_wp
      !> Velocity d eta/d tau of the first impact
      real(wp) :: impact_velocity = 0.0_wp
      !> Energy of beam and stops at the horizon, in `energy_unit`
      real(wp) :: energy = 0.0_wp
      !> Impulse of the contact force up to the horizon; 0: not compared
      real(wp) :: impulse = 0.0_wp
      !> Displacement eta at stop and tip at the samples up to the horizon, [samples, 2]
      real(wp), allocatable :: history(:, :)
   end type run_results_t

   !> Quantities from which the impulse of the contact force follows, for a beam without loads that is released from its
   !> only stop; unallocated components: the scene is of another kind, and impulses are not compared.
   type :: impulse_balance_t
      !> M s, where s is the static displacement under a unit force at the stop, [degrees of freedom]
      real(wp), allocatable :: mass(:)
      !> C s, [degrees of freedom]
      real(wp), allocatable :: damping(:)
      !> Displacement s at the stop
      real(wp) :: flexibility = 0.0_wp
      !> Preload delta
      real(wp) :: preload = 0.0_wp
   end type impulse_balance_t

   !> Differences between two runs.
   type :: motion_errors_t
      !> Difference of the instant of the first impact, tau
      real(wp) :: impact_tau = 0.0_wp
      !> Relative difference of the velocity of the first impact
      real(wp) :: impact_velocity = 0.0_wp
      !> Maximum difference of eta of stop and tip
      real(wp) :: history = 0.0_wp
      !> Difference of the energy at the horizon, in `energy_unit`
      real(wp) :: energy = 0.0_wp
      !> Relative difference of the contact impulse
      real(wp) :: impulse = 0.0_wp
      !> Maximum error of the energy balance of the first run, in `energy_unit`
      real(wp) :: energy_balance = 0.0_wp
   end type motion_errors_t

contains

   !> End of the comparison of two runs: the peak of the third rebound, or the end of the run if there are fewer
   !> rebounds, or loads or several contacts; rounded down to an instant that all runs sample.
   pure real(wp) function horizon_of(settings, response, duration, grid) result(horizon)
      !> Settings of the run
      type(run_settings_t), intent(in) :: settings
      !> Run with measures
      type(response_t), intent(in) :: response
      !> Length of the run, tau
      real(wp), intent(in) :: duration
      !> Interval of the instants that all runs sample, tau
      real(wp), intent(in) :: grid

      integer, parameter :: third = 3

      horizon = duration
      if (is_released_from_one_stop(settings) .and. size(response%measures%peak_tau) >= third) then
         horizon = response%measures%peak_tau(third)
      end if
      horizon = grid*real(floor(horizon/grid*(1.0_wp + 8.0_wp*epsilon(1.0_wp))), wp)
   end function horizon_of

   !> Whether the run begins with the release of the beam from its only stop, below the beam, and has no loads.
   pure logical function is_released_from_one_stop(settings) result(answer)
      type(run_settings_t), intent(in) :: settings

      answer = settings%start%kind == start_release .and. settings%stop%side == side_below .and. &
         .not. (allocated(settings%more_stops) .or. allocated(settings%forces) .or. allocated(settings%bases))
   end function is_released_from_one_stop

   !> Extract the compared quantities of a run.
   pure subroutine results_of(response, horizon, balance, results, every)
      !> Run with the default histories, energies and two shapes: at the start, where the beam is at rest, and at the
      !> horizon
      type(response_t), intent(in) :: response
      !> End of the comparison, tau
      real(wp), intent(in) :: horizon
      type(impulse_balance_t), intent(in) :: balance
      type(run_results_t), intent(out) :: results
      !> Use every n-th sample, of which the horizon must be one; default 1
      integer, intent(in), optional :: every

      ! index of the last sample up to the horizon
      integer :: last
      ! stride of the samples
      integer :: stride
      integer :: i

      stride = 1
      if (present(every)) stride = every
      last = count(response%tau <= horizon*(1.0_wp + 8.0_wp*epsilon(1.0_wp)))
      do i = 1, response%event_count
         associate (event => response%events(i))
            if (all(event%kind /= [event_impact, event_capture, event_contact])) cycle
            results%impact_tau = event%tau
            results%impact_velocity = event%velocity_before
            exit
         end associate
      end do
      associate (energy => response%energy)
         results%energy = (energy%kinetic(last) + energy%strain(last) + energy%stop(last))/energy_unit(response)
      end associate
      if (allocated(balance%mass)) results%impulse = contact_impulse(response, balance, last, stride)
      allocate (results%history((last - 1)/stride + 1, 2))
      results%history(:, 1) = response%history(eta_stop)%values(:last:stride)
      results%history(:, 2) = response%history(eta_tip)%values(:last:stride)
   end subroutine results_of

   !> Energy to which errors of energies refer: the initial energy, or the maximum energy of a run that starts at rest.
   pure real(wp) function energy_unit(response) result(unit)
      !> Run with energies
      type(response_t), intent(in) :: response

      unit = response%initial_energy
      associate (energy => response%energy)
         if (.not. unit > 0.0_wp) unit = maxval(energy%kinetic + energy%strain + energy%stop)
      end associate
      if (.not. unit > 0.0_wp) unit = 1.0_wp
   end function energy_unit

   !> Impulse of the contact force on the beam up to the last sample. With the static displacement s under a unit force
   !> at the stop, s.(M a + C v + K y) = s_c f (with velocities v and accelerations a) and s.K y = y_c, and the integral
   !> of this equation over time gives the integral of f. Only y_c is integrated numerically over the samples, because
   !> the force itself decays within a fraction of a sample after each impact. The last stored shape must be the shape
   !> at the last sample.
   pure real(wp) function contact_impulse(response, balance, last, stride) result(impulse)
      !> Run with the shapes at the start and at the last sample
      type(response_t), intent(in) :: response
      type(impulse_balance_t), intent(in) :: balance
      !> Index of the last sample
      integer, intent(in) :: last
      !> Stride of the samples that are used
      integer, intent(in) :: stride

      ! integral of y_c = eta + delta over time
      real(wp) :: eta_integral
      ! number of samples that are used
      integer :: n

      n = (last - 1)/stride + 1
      associate (eta => response%history(eta_stop)%values(:last:stride), tau => response%tau(:last:stride))
         eta_integral = sum(0.5_wp*(eta(2:) + eta(:n - 1))*(tau(2:) - tau(:n - 1))) + balance%preload*tau(n)
         ! shapes begin with index 0, the root, which has no degrees of freedom
         associate (y => response%shape_displacement, slope => response%shape_slope, final => size(response%shape_tau))
            impulse = sum(balance%mass(1::2)*response%shape_velocity(1:, final)) &
               + sum(balance%mass(2::2)*response%shape_slope_velocity(1:, final)) &
               + sum(balance%damping(1::2)*(y(1:, final) - y(1:, 1))) &
               + sum(balance%damping(2::2)*(slope(1:, final) - slope(1:, 1))) + eta_integral
         end associate
         impulse = impulse/balance%flexibility
      end associate
   end function contact_impulse

   !> Compute the quantities of the balance of impulses of a beam that is released from its only stop, without loads.
   pure subroutine make_balance(model, modes, settings, balance, error)
      type(beam_model_t), intent(in) :: model
      !> All modes of the beam
      type(free_modes_t), intent(in) :: modes
      !> Settings of the run, with preload and damping
      type(run_settings_t), intent(in) :: settings
      type(impulse_balance_t), intent(out) :: balance
      !> Set if the stiffness matrix cannot be factorised
      type(failure_t), allocatable, intent(out) :: error

      type(skyline_t) :: factors
      ! static shape s
      real(wp) :: static(model%stiffness%order)
      ! M s
      real(wp) :: momentum(model%stiffness%order)
      ! C s
      real(wp) :: damping(model%stiffness%order)

      if (.not. is_released_from_one_stop(settings)) return
      factors = model%stiffness
      call factorise(factors, error)
      if (allocated(error)) return
      ! in units of time 1/omega1 the stiffness matrix is K/lambda1^4
      static = 0.0_wp
      static(model%stop_dof) = lambda1_power4
      call solve_factorised(factors, static)
      call multiply(model%mass, static, momentum)
      ! damping in addition to 2 zeta K: each mode has its own damping rate
      call multiply(model%mass, matmul(modes%mode, rates_of_modes(settings, modes%square)* &
         matmul(momentum, modes%mode)), damping)
      ! K s is the unit force at the stop, so 2 zeta K s has this one entry
      damping(model%stop_dof) = damping(model%stop_dof) + 2.0_wp*settings%zeta
      balance%mass = momentum
      balance%damping = damping
      balance%flexibility = static(model%stop_dof)
      balance%preload = settings%stop%preload
   end subroutine make_balance

   !> Difference of two runs that are sampled at the same instants.
   pure type(motion_errors_t) function difference_of(results, reference) result(errors)
      !> Compared quantities of the runs
      type(run_results_t), intent(in) :: results
      type(run_results_t), intent(in) :: reference

      integer :: samples

      errors%impact_tau = abs(results%impact_tau - reference%impact_tau)
      errors%impact_velocity = abs(results%impact_velocity - reference%impact_velocity) &
         /max(abs(reference%impact_velocity), tiny(1.0_wp))
      errors%energy = abs(results%energy - reference%energy)
      errors%impulse = abs(results%impulse - reference%impulse)/max(abs(reference%impulse), tiny(1.0_wp))
      samples = min(size(results%history, 1), size(reference%history, 1))
      errors%history = maxval(abs(results%history(:samples, :) - reference%history(:samples, :)))
   end function difference_of

   !> Richardson extrapolation of two runs, the second with half the step or with elements of half the length. Errors
   !> are assumed to be proportional to a power (the order) of the step or the length.
   pure subroutine extrapolate(coarse, fine, limit, order)
      !> Compared quantities of the first run
      type(run_results_t), intent(in) :: coarse
      !> Compared quantities of the second run, which has the samples of the first, or twice as many
      type(run_results_t), intent(in) :: fine
      !> Extrapolated quantities, at the samples of the first run
      type(run_results_t), intent(out) :: limit
      !> Order of the errors; default 2
      integer, intent(in), optional :: order

      ! stride by which the samples of the second run are those of the first
      integer :: every
      ! number of these samples
      integer :: samples
      ! extrapolation weight of the difference of both runs, 1/(2^order - 1)
      real(wp) :: weight

      weight = 1.0_wp/3.0_wp
      if (present(order)) weight = 1.0_wp/real(2**order - 1, wp)
      every = merge(2, 1, size(fine%history, 1) > size(coarse%history, 1))
      samples = min(size(coarse%history, 1), (size(fine%history, 1) - 1)/every + 1)
      limit%impact_tau = fine%impact_tau + weight*(fine%impact_tau - coarse%impact_tau)
      limit%impact_velocity = fine%impact_velocity + weight*(fine%impact_velocity - coarse%impact_velocity)
      limit%energy = fine%energy + weight*(fine%energy - coarse%energy)
      limit%impulse = fine%impulse + weight*(fine%impulse - coarse%impulse)
      associate (last => every*(samples - 1) + 1)
         limit%history = fine%history(:last:every, :) &
            + weight*(fine%history(:last:every, :) - coarse%history(:samples, :))
      end associate
   end subroutine extrapolate

end module motion_errors
