!> How two runs of one scene differ, and what they are compared by.
module motion_errors
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use free_modes, only: free_modes_t
   use history_list, only: eta_stop, eta_tip
   use kinds, only: lambda1_power4, wp
   use mode_choice, only: rates_of_modes
   use response_types, only: event_capture, event_contact, event_impact, response_t
   use run_settings, only: run_settings_t
   use skyline_matrix, only: factorise, multiply, skyline_t, solve_factorised
   implicit none (type, external)
   private
   public :: motion_errors_t, motion_facts_t, balance_t, make_balance, facts_of, difference_of, extrapolate, &
      horizon_of

   !> What a run is judged by, up to a horizon.
   type :: motion_facts_t
      !> First meeting with the stop: instant and velocity
      real(wp) :: impact_tau = 0.0_wp
      real(wp) :: impact_velocity = 0.0_wp
      !> Energy of beam and stop at the horizon, in that at the start
      real(wp) :: energy = 0.0_wp
      !> Contact impulse up to the horizon
      real(wp) :: impulse = 0.0_wp
      !> eta of stop and tip at the samples up to the horizon, [samples, 2]
      real(wp), allocatable :: history(:, :)
   end type motion_facts_t

   !> What the balance of impulses needs of a beam.
   type :: balance_t
      !> M s and C s, s the static shape of a unit force at the stop, and s there
      real(wp), allocatable :: mass(:)
      real(wp), allocatable :: damping(:)
      real(wp) :: flexibility = 0.0_wp
      !> delta
      real(wp) :: preload = 0.0_wp
   end type balance_t

   !> Differences of two runs.
   type :: motion_errors_t
      !> d tau and relative
      real(wp) :: impact_tau = 0.0_wp
      real(wp) :: impact_velocity = 0.0_wp
      !> Largest d eta
      real(wp) :: history = 0.0_wp
      !> In the energy at the start
      real(wp) :: energy = 0.0_wp
      !> Relative
      real(wp) :: impulse = 0.0_wp
      !> How far the ledger of energy is from closing, in the energy at the start
      real(wp) :: ledger = 0.0_wp
   end type motion_errors_t

contains

   !> Where comparison ends: at the peak of the third rebound, or with the run; on a grid of instants that all runs
   !> sample.
   pure function horizon_of(response, duration, grid) result(horizon)
      !> The run, measured
      type(response_t), intent(in) :: response
      !> Its length
      real(wp), intent(in) :: duration
      !> Distance of these instants
      real(wp), intent(in) :: grid
      real(wp) :: horizon

      integer, parameter :: third = 3

      horizon = duration
      if (size(response%measures%peak_tau) >= third) horizon = response%measures%peak_tau(third)
      horizon = grid*real(floor(horizon/grid*(1.0_wp + 8.0_wp*epsilon(1.0_wp))), wp)
   end function horizon_of

   !> Take the facts of a run.
   pure subroutine facts_of(response, horizon, balance, facts, every)
      !> The run, with all histories, energies, and the shapes at the start, where it rests, and at the horizon
      type(response_t), intent(in) :: response
      !> Up to here
      real(wp), intent(in) :: horizon
      type(balance_t), intent(in) :: balance
      type(motion_facts_t), intent(out) :: facts
      !> Take every so many samples, of which the horizon is one; default 1
      integer, intent(in), optional :: every

      integer :: i, last, stride

      stride = 1
      if (present(every)) stride = every
      last = count(response%tau <= horizon*(1.0_wp + 8.0_wp*epsilon(1.0_wp)))
      do i = 1, response%event_count
         associate (event => response%events(i))
            if (all(event%kind /= [event_impact, event_capture, event_contact])) cycle
            facts%impact_tau = event%tau
            facts%impact_velocity = event%velocity_before
            exit
         end associate
      end do
      associate (energy => response%energy)
         facts%energy = (energy%kinetic(last) + energy%strain(last) + energy%stop(last))/response%initial_energy
      end associate
      facts%impulse = contact_impulse(response, balance, last, stride)
      allocate (facts%history((last - 1)/stride + 1, 2))
      facts%history(:, 1) = response%history(eta_stop)%values(:last:stride)
      facts%history(:, 2) = response%history(eta_tip)%values(:last:stride)
   end subroutine facts_of

   !> What the stop has given to the beam up to the last sample, from the balance with the static shape s of a unit
   !> force at the stop: s.(M y'' + C y' + K y) = s_c f with s.K y = y_c, integrated. Only y_c is integrated over
   !> samples; the force itself falls within a fraction of a sample after each impact. The last shape kept is that at
   !> this instant.
   pure function contact_impulse(response, balance, last, every) result(impulse)
      !> The run, with these shapes
      type(response_t), intent(in) :: response
      type(balance_t), intent(in) :: balance
      !> Last sample, and the distance of those to take
      integer, intent(in) :: last
      integer, intent(in) :: every
      real(wp) :: impulse

      real(wp) :: way
      integer :: n

      n = (last - 1)/every + 1
      associate (eta => response%history(eta_stop)%values(:last:every), tau => response%tau(:last:every))
         way = sum(0.5_wp*(eta(2:) + eta(:n - 1))*(tau(2:) - tau(:n - 1))) + balance%preload*tau(n)
         associate (y => response%shape_displacement, slope => response%shape_slope, now => size(response%shape_tau))
            impulse = sum(balance%mass(1::2)*response%shape_velocity(1:, now)) &
               + sum(balance%mass(2::2)*response%shape_slope_velocity(1:, now)) &
               + sum(balance%damping(1::2)*(y(1:, now) - y(1:, 1))) &
               + sum(balance%damping(2::2)*(slope(1:, now) - slope(1:, 1))) + way
         end associate
         impulse = impulse/balance%flexibility
      end associate
   end function contact_impulse

   !> Prepare the balance of impulses.
   pure subroutine make_balance(model, modes, settings, balance, error)
      type(beam_model_t), intent(in) :: model
      !> All that it has
      type(free_modes_t), intent(in) :: modes
      !> Preload and damping of the run
      type(run_settings_t), intent(in) :: settings
      type(balance_t), intent(out) :: balance
      !> Set when the stiffness cannot be factorised
      type(failure_t), allocatable, intent(out) :: error

      type(skyline_t) :: factors
      real(wp), dimension(model%stiffness%order) :: static, momentum, damping

      factors = model%stiffness
      call factorise(factors, error)
      if (allocated(error)) return
      static = 0.0_wp
      static(model%stop_dof) = lambda1_power4
      call solve_factorised(factors, static)
      call multiply(model%mass, static, momentum)
      ! damping besides 2 zeta K: each mode has a rate of its own
      call multiply(model%mass, matmul(modes%mode, rates_of_modes(settings, modes%square)* &
         matmul(momentum, modes%mode)), damping)
      damping(model%stop_dof) = damping(model%stop_dof) + 2.0_wp*settings%zeta
      balance%mass = momentum
      balance%damping = damping
      balance%flexibility = static(model%stop_dof)
      balance%preload = settings%stop%preload
   end subroutine make_balance

   !> The difference of two runs sampled at the same instants, or one of them at every k-th of the other's.
   pure function difference_of(facts, reference) result(errors)
      !> The runs
      type(motion_facts_t), intent(in) :: facts
      type(motion_facts_t), intent(in) :: reference
      type(motion_errors_t) :: errors

      integer :: samples

      errors%impact_tau = abs(facts%impact_tau - reference%impact_tau)
      errors%impact_velocity = abs(facts%impact_velocity - reference%impact_velocity) &
         /max(abs(reference%impact_velocity), tiny(1.0_wp))
      errors%energy = abs(facts%energy - reference%energy)
      errors%impulse = abs(facts%impulse - reference%impulse)/max(abs(reference%impulse), tiny(1.0_wp))
      samples = min(size(facts%history, 1), size(reference%history, 1))
      errors%history = maxval(abs(facts%history(:samples, :) - reference%history(:samples, :)))
   end function difference_of

   !> What two runs tend to, the second with half the step or with elements of half the length: their errors fall with a
   !> power of it.
   pure subroutine extrapolate(coarse, fine, limit, order)
      !> The runs; the second sampled like the first, or twice as densely
      type(motion_facts_t), intent(in) :: coarse
      type(motion_facts_t), intent(in) :: fine
      !> Sampled like the coarse one
      type(motion_facts_t), intent(out) :: limit
      !> The power; default 2
      integer, intent(in), optional :: order

      integer :: every, samples
      real(wp) :: part

      part = 1.0_wp/3.0_wp
      if (present(order)) part = 1.0_wp/real(2**order - 1, wp)
      every = merge(2, 1, size(fine%history, 1) > size(coarse%history, 1))
      samples = min(size(coarse%history, 1), (size(fine%history, 1) - 1)/every + 1)
      limit%impact_tau = fine%impact_tau + part*(fine%impact_tau - coarse%impact_tau)
      limit%impact_velocity = fine%impact_velocity + part*(fine%impact_velocity - coarse%impact_velocity)
      limit%energy = fine%energy + part*(fine%energy - coarse%energy)
      limit%impulse = fine%impulse + part*(fine%impulse - coarse%impulse)
      associate (last => every*(samples - 1) + 1)
         limit%history = fine%history(:last:every, :) &
            + part*(fine%history(:last:every, :) - coarse%history(:samples, :))
      end associate
   end subroutine extrapolate

end module motion_errors
