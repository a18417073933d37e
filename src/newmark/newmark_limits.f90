!> Limits of Newmark's scheme: steps beyond the stability limit, and meshes on which rounding errors disturb the motion
!> (docs/theory.md, sections 10 and 11).
module newmark_limits
   use beam_model, only: beam_model_t, static_shape
   use failures, only: fail, failure_t, status_bad_input, status_run_failed
   use kinds, only: lambda1_power4, wp
   use newmark_stability, only: critical_step, highest_frequency, is_unconditionally_stable
   use number_text, only: rounded, to_text
   use run_settings, only: response_settings_t
   use skyline_matrix, only: multiply, skyline_t
   implicit none (type, external)
   private
   public :: divide_step, check_mesh, explain_mesh_error, check_energy_balance, rounding_of_energy

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

end module newmark_limits
