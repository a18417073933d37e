!> Limits of Newmark's scheme: steps beyond the stability limit, and meshes on which rounding errors disturb the motion
!> (docs/theory.md, sections 10 and 11).
!>
!> Hughes, The Finite Element Method, section 9.1: with gamma >= 1/2 and 2 beta < gamma a mode of frequency omega and
!> damping ratio xi is stable as long as
!>    omega h <= (xi (gamma - 1/2) + sqrt(gamma/2 - beta + xi^2 (gamma - 1/2)^2)) / (gamma/2 - beta),
!> with h the length of the step; with 2 beta >= gamma every step is stable.
module newmark_limits
   use beam_model, only: beam_model_t, static_shape
   use bracketed_zero, only: bracket_t, enter_value, choose_point
   use failures, only: fail, failure_t, status_bad_input, status_run_failed
   use kinds, only: lambda1_power4, wp
   use number_text, only: rounded, to_text
   use run_settings, only: response_settings_t
   use skyline_matrix, only: multiply, skyline_t, combine, factorise, negative_pivots
   implicit none (type, external)
   private
   public :: divide_step, check_mesh, explain_mesh_error, check_energy_balance, rounding_of_energy, &
      is_unconditionally_stable, critical_step, highest_frequency

contains

   !> Explain a failed factorisation by the mesh that caused it.
   pure subroutine explain_mesh_error(error)
      !> The failure, whose message is replaced
      type(failure_t), intent(inout) :: error

      error%message = "on this mesh Newmark's steps are lost in rounding ("//error%message// &
         "): take elements of more equal length, a shorter step, or method = 'exact'"
   end subroutine explain_mesh_error

   !> Refuse a step that is too long for a conditionally stable scheme, or divide the step if the settings allow that.
   pure subroutine divide_step(model, zeta, settings, steps_per_sample, error)
      type(beam_model_t), intent(in) :: model
      !> Damping C = 2 zeta K
      real(wp), intent(in) :: zeta
      !> Step length and parameters of the scheme
      type(response_settings_t), intent(in) :: settings
      !> Number of steps between two samples
      integer, intent(out) :: steps_per_sample
      !> Set if the step is too long and may not be divided
      type(failure_t), allocatable, intent(out) :: error

      ! length of a divided step over the longest stable step: close to the stability limit the mass matrix M* of the
      ! scheme (`newmark_stepper`) has almost no mass in the highest modes, and their velocities become large
      real(wp), parameter :: fraction_of_limit = 0.5_wp
      ! highest frequency of the mesh
      real(wp) :: frequency
      ! longest stable step
      real(wp) :: limit
      ! a step that needs more parts than this is taken for an error of the user
      real(wp), parameter :: max_parts = 1.0e6_wp
      character(:), allocatable :: remedy

      steps_per_sample = 1
      if (is_unconditionally_stable(settings%newmark_beta, settings%newmark_gamma)) return
      call highest_frequency(model%stiffness, model%mass, frequency, error)
      if (allocated(error)) return
      ! the frequency in omega1: the eigenvalues of the model's matrices are lambda_i^4, and lambda1^4 belongs to omega1
      limit = critical_step(settings%newmark_beta, settings%newmark_gamma, zeta, frequency/sqrt(lambda1_power4))
      if (settings%step <= limit) return
      if (settings%step >= max_parts*limit) then
         remedy = ' or, with substep = .true., below '//rounded_down(max_parts*limit)//'; shorten it, '
      else if (settings%substep) then
         steps_per_sample = ceiling(settings%step/(fraction_of_limit*limit))
         return
      else
         remedy = '; shorten it, give substep = .true., '
      end if
      call fail(error, status_bad_input, 'step '//to_text(settings%step)// &
         ' is too long for this Newmark scheme: on this '// &
         'mesh it must be at most d tau = '//rounded_down(limit)//remedy// &
         'or take newmark_beta = newmark_gamma / 2 = '//to_text(0.5_wp*settings%newmark_gamma))
   end subroutine divide_step

   !> Refuse a mesh on which rounding alone violates the energy balance.
   pure subroutine check_mesh(model, error)
      type(beam_model_t), intent(in) :: model
      !> Set if the rounding error is too large
      type(failure_t), allocatable, intent(out) :: error

      ! maximum estimate of the rounding error of the energy as a fraction of the energy. The error itself must not
      ! exceed 1e-6; in runs it was about a tenth of the estimate of `rounding_of_energy`
      real(wp), parameter :: max_fraction = 1.0e-5_wp
      ! the estimate
      real(wp) :: fraction

      call rounding_of_energy(model, fraction, error)
      if (allocated(error) .or. fraction <= max_fraction) return
      call fail(error, status_bad_input, "on this mesh the energy of Newmark's steps is lost in rounding, up to "// &
         rounded(fraction)//' of it where at most '//to_text(max_fraction)//' is allowed: take fewer elements or '// &
         "elements of more equal length, or method = 'exact'")
   end subroutine check_mesh

   !> Bound of the rounding error of the strain energy, as a fraction of that energy: eps |y| . |K| |y| / (y . K y) for
   !> the static shape y. The error is large if elements are short, because these move almost as rigid bodies, so that
   !> the large terms of their nodal forces cancel.
   pure subroutine rounding_of_energy(model, fraction, error)
      type(beam_model_t), intent(in) :: model
      !> The bound
      real(wp), intent(out) :: fraction
      !> Set if the stiffness cannot be factorised
      type(failure_t), allocatable, intent(out) :: error

      type(skyline_t) :: magnitudes
      real(wp), allocatable :: shape(:), forces(:), large_forces(:)

      fraction = 0.0_wp
      call static_shape(model, shape, error)
      if (allocated(error)) return
      magnitudes = model%stiffness
      magnitudes%values = abs(magnitudes%values)
      allocate (forces(size(shape)), large_forces(size(shape)))
      call multiply(model%stiffness, shape, forces)
      call multiply(magnitudes, abs(shape), large_forces)
      fraction = epsilon(1.0_wp)*dot_product(abs(shape), large_forces)/abs(dot_product(shape, forces))
   end subroutine rounding_of_energy

   !> A number rounded down to six digits, as text.
   pure function rounded_down(value) result(text)
      !> The number, > 0
      real(wp), intent(in) :: value
      character(:), allocatable :: text

      character(16) :: buffer
      real(wp) :: rounded

      write (buffer, '(es16.5)') value
      read (buffer, *) rounded
      ! the term subtracted is at least half a unit of the last digit
      if (rounded > value) write (buffer, '(es16.5)') value*(1.0_wp - 5.0e-6_wp)
      read (buffer, *) rounded
      text = to_text(rounded)
   end function rounded_down

   !> Fail if the energy balance is violated by more than a fraction of the energy, because rounding has then disturbed
   !> the motion.
   pure subroutine check_energy_balance(tau, energy_error, total_energy, error)
      !> Instant, tau
      real(wp), intent(in) :: tau
      !> Error of the energy balance
      real(wp), intent(in) :: energy_error
      !> Energy at the start plus the energy created and the work of loads in magnitude
      real(wp), intent(in) :: total_energy
      !> Set if the error is too large
      type(failure_t), allocatable, intent(out) :: error

      ! energy of displacements by rounding errors: that of a beam which loads press onto contacts may be no larger
      real(wp), parameter :: rounding = 1.0e-26_wp
      real(wp), parameter :: tolerance = 1.0e-6_wp

      if (energy_error <= tolerance*total_energy + rounding) return
      call fail(error, status_run_failed, "Newmark's steps are lost in rounding: by tau = "//rounded(tau)// &
         ' the energy is off by '//rounded(energy_error/total_energy)// &
         ' of that at the start, and at most '//to_text(tolerance)// &
         " is allowed: take a shorter step, fewer elements or elements of more equal length, or method = 'exact'")
   end subroutine check_energy_balance

   !> Whether the scheme is stable for steps of any length.
   elemental logical function is_unconditionally_stable(beta, gamma) result(stable)
      !> Newmark's beta
      real(wp), intent(in) :: beta
      !> Newmark's gamma, at least 1/2
      real(wp), intent(in) :: gamma

      stable = 2.0_wp*beta >= gamma
   end function is_unconditionally_stable

   !> The longest stable step of a conditionally stable scheme with damping in proportion to the stiffness. The highest
   !> frequency decides, because the stable step decreases with the frequency.
   elemental function critical_step(beta, gamma, zeta, frequency) result(step)
      !> Newmark's beta, below gamma/2
      real(wp), intent(in) :: beta
      !> Newmark's gamma, at least 1/2
      real(wp), intent(in) :: gamma
      !> Damping factor; the damping ratio of a mode is zeta omega
      real(wp), intent(in) :: zeta
      !> Highest frequency, in omega1
      real(wp), intent(in) :: frequency
      !> Length of the step, tau
      real(wp) :: step

      ! xi (gamma - 1/2) and gamma/2 - beta of the formula above
      real(wp) :: damping_term

      damping_term = zeta*frequency*(gamma - 0.5_wp)
      associate (stability_deficit => 0.5_wp*gamma - beta)
         step = (damping_term + sqrt(stability_deficit + damping_term**2))/(stability_deficit*frequency)
      end associate
   end function critical_step

   !> An upper bound of the highest frequency omega of K y = omega^2 M y, within one part in a million, by bisection for
   !> the eigenvalue omega^2: the number of negative pivots of K - sigma M is the number of eigenvalues below sigma.
   pure subroutine highest_frequency(stiffness, mass, frequency, error)
      !> K
      type(skyline_t), intent(in) :: stiffness
      !> M, of the same profile
      type(skyline_t), intent(in) :: mass
      !> omega, or slightly more, per unit of the time in which K and M are given
      real(wp), intent(out) :: frequency
      !> Set if no bound is found
      type(failure_t), allocatable, intent(out) :: error

      ! relative error of omega^2, which is twice that of omega
      real(wp), parameter :: accuracy = 2.0e-6_wp
      integer, parameter :: max_doublings = 2000
      type(bracket_t) :: bracket
      ! lower bound of the highest eigenvalue
      real(wp) :: below
      ! upper bound of the highest eigenvalue
      real(wp) :: above
      integer :: i

      frequency = 0.0_wp
      ! the Rayleigh quotient of each unit vector is a lower bound of the highest eigenvalue
      below = maxval(stiffness%values(stiffness%diagonal)/mass%values(mass%diagonal))
      above = 2.0_wp*below
      do i = 1, max_doublings
         if (all_below(stiffness, mass, above)) exit
         below = above
         above = 2.0_wp*above
      end do
      if (i > max_doublings) then
         call fail(error, status_run_failed, 'no bound of the highest frequency of this beam was found')
         return
      end if
      ! The value of a point is 1 below the highest eigenvalue and -1 above it. Only the signs have a meaning, so a
      ! negative tolerance switches off the test of the values. The search ends if the bracket is shorter than
      ! `accuracy` times its upper end, which is an upper bound of the eigenvalue throughout
      bracket = bracket_t(low=below, high=above, value_tolerance=-1.0_wp, length_tolerance=accuracy)
      call choose_point(bracket)
      do while (.not. bracket%is_found)
         call enter_value(bracket, merge(-1.0_wp, 1.0_wp, all_below(stiffness, mass, bracket%point)))
         call choose_point(bracket)
      end do
      frequency = sqrt(bracket%high)
   end subroutine highest_frequency

   !> Whether all eigenvalues of K y = omega^2 M y are below sigma. If a pivot vanishes, sigma may be an eigenvalue; the
   !> result is then false, so that the caller seeks the bound above sigma.
   pure logical function all_below(stiffness, mass, sigma) result(below)
      !> K
      type(skyline_t), intent(in) :: stiffness
      !> M
      type(skyline_t), intent(in) :: mass
      real(wp), intent(in) :: sigma

      type(skyline_t) :: shifted
      type(failure_t), allocatable :: error

      shifted = combine(1.0_wp, stiffness, -sigma, mass)
      call factorise(shifted, error, positive=.false.)
      below = .false.
      if (.not. allocated(error)) below = negative_pivots(shifted) == shifted%order
   end function all_below

end module newmark_limits
