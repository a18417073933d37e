!> What Newmark's steps cannot do: a step beyond the limit of stability, a mesh on which rounding moves the beam
!> (docs/theory.md, sections 10 and 11).
module newmark_limits
   use beam_model, only: beam_model_t, static_shape
   use failures, only: fail, failure_t, status_bad_input, status_run_failed
   use kinds, only: lambda1_power4, wp
   use newmark_stability, only: critical_step, highest_frequency, is_unconditionally_stable
   use number_text, only: to_text
   use run_settings, only: response_settings_t
   use skyline_matrix, only: multiply, skyline_t
   implicit none (type, external)
   private
   public :: divide_step, check_mesh, blame_mesh, check_ledger, rounding_of_energy

contains

   !> What a matrix that cannot be factorised tells of a mesh.
   pure subroutine blame_mesh(error)
      !> The message changes
      type(failure_t), intent(inout) :: error

      error%message = "on this mesh Newmark's steps are lost in rounding ("//error%message// &
         "): take elements of more equal length, a shorter step, or method = 'exact'"
   end subroutine blame_mesh

   !> Refuse a step that is too long for a conditionally stable scheme, or divide it if that was asked for.
   pure subroutine divide_step(model, zeta, settings, parts, error)
      type(beam_model_t), intent(in) :: model
      real(wp), intent(in) :: zeta
      !> Step and scheme
      type(response_settings_t), intent(in) :: settings
      !> Number of steps between two samples
      integer, intent(out) :: parts
      !> Set when the step is too long
      type(failure_t), allocatable, intent(out) :: error

      ! close to the limit M* leaves the highest modes hardly any mass, and velocities grow
      real(wp), parameter :: share = 0.5_wp
      real(wp) :: frequency, limit
      ! beyond so many parts the step between two samples is a slip
      real(wp), parameter :: most_parts = 1.0e6_wp
      character(24) :: gamma_text
      character(:), allocatable :: way_out

      parts = 1
      if (settings%newmark_gamma < 0.5_wp) then
         write (gamma_text, '(f24.4)') settings%newmark_gamma
         call fail(error, status_bad_input, 'newmark_gamma must be at least 1/2: with '//trim(adjustl(gamma_text))// &
            ' every step would feed energy into the motion')
         return
      end if
      if (is_unconditionally_stable(settings%newmark_beta, settings%newmark_gamma)) return
      call highest_frequency(model%stiffness, model%mass, frequency, error)
      if (allocated(error)) return
      limit = critical_step(settings%newmark_beta, settings%newmark_gamma, zeta, frequency/sqrt(lambda1_power4))
      if (settings%step <= limit) return
      if (settings%step >= most_parts*limit) then
         way_out = ' or, with substep = .true., below '//rounded_down(most_parts*limit)//'; shorten it, '
      else if (settings%substep) then
         parts = ceiling(settings%step/(share*limit))
         return
      else
         way_out = '; shorten it, give substep = .true., '
      end if
      call fail(error, status_bad_input, 'step '//to_text(settings%step)// &
         ' is too long for this Newmark scheme: on this '// &
         'mesh it must be at most d tau = '//rounded_down(limit)//way_out// &
         'or take newmark_beta = newmark_gamma / 2 = '//to_text(0.5_wp*settings%newmark_gamma))
   end subroutine divide_step

   !> Refuse a mesh on which rounding alone opens the ledger.
   pure subroutine check_mesh(model, error)
      type(beam_model_t), intent(in) :: model
      !> Set when it does
      type(failure_t), allocatable, intent(out) :: error

      ! a tenth of the bound is mostly seen, and more than 1e-6 must not be
      real(wp), parameter :: most = 1.0e-5_wp
      real(wp) :: share

      call rounding_of_energy(model, share, error)
      if (allocated(error) .or. share <= most) return
      call fail(error, status_bad_input, "on this mesh the energy of Newmark's steps is lost in rounding, up to "// &
         to_text(share)//' of it where at most '//to_text(most)//' is allowed: take fewer elements or elements of '// &
         "more equal length, or method = 'exact'")
   end subroutine check_mesh

   !> Share of the strain energy that rounding may take: eps |y| |K| |y| / (y K y) for the shape at the start. Where
   !> short elements move as rigid bodies, large forces cancel.
   pure subroutine rounding_of_energy(model, share, error)
      type(beam_model_t), intent(in) :: model
      real(wp), intent(out) :: share
      !> Set when the stiffness cannot be factorised
      type(failure_t), allocatable, intent(out) :: error

      type(skyline_t) :: magnitudes
      real(wp), allocatable :: shape(:), forces(:), large_forces(:)

      share = 0.0_wp
      call static_shape(model, shape, error)
      if (allocated(error)) return
      magnitudes = model%stiffness
      magnitudes%values = abs(magnitudes%values)
      allocate (forces(size(shape)), large_forces(size(shape)))
      call multiply(model%stiffness, shape, forces)
      call multiply(magnitudes, abs(shape), large_forces)
      share = epsilon(1.0_wp)*dot_product(abs(shape), large_forces)/abs(dot_product(shape, forces))
   end subroutine rounding_of_energy

   !> The first six digits of a number; what is written is not above it.
   pure function rounded_down(value) result(text)
      !> The number, > 0
      real(wp), intent(in) :: value
      character(:), allocatable :: text

      character(16) :: buffer
      real(wp) :: rounded

      write (buffer, '(es16.5)') value
      read (buffer, *) rounded
      if (rounded > value) write (buffer, '(es16.5)') value*(1.0_wp - 5.0e-6_wp)
      read (buffer, *) rounded
      text = to_text(rounded)
   end function rounded_down

   !> Refuse what misses the ledger by more than a share of the energy: rounding has moved the beam.
   pure subroutine check_ledger(tau, miss, whole, error)
      !> The instant
      real(wp), intent(in) :: tau
      !> By how much energy
      real(wp), intent(in) :: miss
      !> Energy at the start and created
      real(wp), intent(in) :: whole
      !> Set when it is too much
      type(failure_t), allocatable, intent(out) :: error

      real(wp), parameter :: tolerance = 1.0e-6_wp

      if (miss <= tolerance*whole) return
      call fail(error, status_run_failed, "Newmark's steps are lost in rounding: by tau = "//to_text(tau)// &
         ' the energy is off by '//to_text(miss/whole)//' of that at the start, and at most '//to_text(tolerance)// &
         " is allowed: take a shorter step, fewer elements or elements of more equal length, or method = 'exact'")
   end subroutine check_ledger

end module newmark_limits
