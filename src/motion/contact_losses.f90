!> What is dissipated in a contact with the three-element stop, integrated in closed form.
!>
!> Power is a quadratic form of the exponentials, so its integral is one sum over pairs of exponents. From one sample
!> to the next, which is the same length of time again and again, that sum is a real matrix made once.
module contact_losses
   use contact_modes, only: contact_modes_t
   use damped_oscillators, only: propagate
   use kinds, only: wp
   use modal_beam, only: modal_beam_t
   use power_integrals, only: bilinear_form, find_pair, find_span, integral, make_power_form, place_pair, &
      power_form_t, span_t, taken_by
   implicit none (type, external)
   private
   public :: contact_losses_t, make_contact_losses, losses_until, losses_of_step

   !> What is dissipated in the beam, 2 zeta sum W_i^2 v_i^2, and in the damper, nu P2^2/(beta k).
   type :: contact_losses_t
      logical :: has_beam = .false.
      logical :: has_stop = .false.
      type(power_form_t) :: beam, stop
      !> Integrals over one step as matrices, and its length; 0: there is none yet
      real(wp), allocatable :: beam_step(:, :), stop_step(:, :)
      real(wp) :: step = 0.0_wp
   end type contact_losses_t

contains

   !> What the ledger needs of each pair of exponents, unless it has been made.
   pure subroutine make_contact_losses(beam, modes, losses, with_beam)
      type(modal_beam_t), intent(in) :: beam
      !> Exponents and shapes
      type(contact_modes_t), intent(in) :: modes
      !> The pairs
      type(contact_losses_t), intent(inout) :: losses
      !> Not only what the damper dissipates
      logical, intent(in) :: with_beam

      complex(wp), allocatable :: rate(:, :)
      real(wp) :: factor
      integer :: m

      if (.not. losses%has_stop) then
         factor = 0.0_wp
         associate (spring => modes%spring)
            if (spring%branch_stiffness > 0.0_wp) factor = spring%relaxation_rate/spring%branch_stiffness
         end associate
         call make_power_form(modes%exponent, reshape(sqrt(factor)*modes%branch_value, [1, modes%count]), losses%stop)
         losses%has_stop = .true.
      end if
      if (losses%has_beam .or. .not. with_beam) return
      allocate (rate(beam%count, modes%count))
      do m = 1, modes%count
         rate(:, m) = sqrt(modes%two_zeta*beam%oscillators%square)*modes%exponent(m)*modes%shape(:, m)
      end do
      call make_power_form(modes%exponent, rate, losses%beam)
      losses%has_beam = .true.
      losses%step = 0.0_wp
   end subroutine make_contact_losses

   !> Dissipated from the start of a contact up to a time, integrated in closed form.
   pure subroutine losses_until(beam, modes, losses, amplitude, q0, v0, t, lost, impulse)
      type(modal_beam_t), intent(in) :: beam
      !> Exponents
      type(contact_modes_t), intent(in) :: modes
      !> From `make_contact_losses`
      type(contact_losses_t), intent(in) :: losses
      !> weight times c
      complex(wp), intent(in) :: amplitude(:)
      !> Modal state at the start; only the modes with a node at the stop are read
      real(wp), intent(in) :: q0(:)
      real(wp), intent(in) :: v0(:)
      !> Time
      real(wp), intent(in) :: t
      !> In the beam, if that is known, and in the stop
      real(wp), intent(out) :: lost(2)
      !> That of P less what remains of it
      real(wp), intent(out), optional :: impulse

      type(span_t) :: span
      real(wp), dimension(size(q0)) :: q, v

      call find_span(losses%stop, amplitude, t, span)
      if (present(impulse)) impulse = sum(real(span%change/modes%exponent, wp))
      lost = 0.0_wp
      lost(2) = taken_by(losses%stop, span)
      if (.not. losses%has_beam) return
      lost(1) = taken_by(losses%beam, span)
      if (size(modes%inactive) == 0) return
      call propagate(beam%oscillators, t, q0, v0, q, v)
      associate (i => modes%inactive, w2 => beam%oscillators%square)
         lost(1) = lost(1) + 0.5_wp*sum(v0(i)**2 - v(i)**2 + w2(i)*(q0(i)**2 - q(i)**2))
      end associate
   end subroutine losses_until

   !> Dissipated in a step of one length, the same at every call, by the modes that move the stop point.
   pure subroutine losses_of_step(modes, step, losses, term, lost)
      !> Exponents
      type(contact_modes_t), intent(in) :: modes
      real(wp), intent(in) :: step
      !> From `make_contact_losses`; gets its matrices at the first call
      type(contact_losses_t), intent(inout) :: losses
      !> weight times c exp(s t) at the start of the step
      complex(wp), intent(in) :: term(:)
      !> In the beam, in the stop
      real(wp), intent(out) :: lost(2)

      real(wp), parameter :: negligible = 1.0e-140_wp
      real(wp) :: parts(2*modes%count)

      if (losses%step < step .or. losses%step > step) then
         call make_step_matrix(modes, step, losses%beam, losses%beam_step)
         call make_step_matrix(modes, step, losses%stop, losses%stop_step)
         losses%step = step
      end if
      parts = [real(term, wp), aimag(term)]
      ! products of what has died out would be subnormal, which is slow
      where (abs(parts) < negligible) parts = 0.0_wp
      lost = [bilinear_form(size(parts), losses%beam_step, parts, parts), &
         bilinear_form(size(parts), losses%stop_step, parts, parts)]
   end subroutine losses_of_step

   !> The quadratic form of one step on real and imaginary parts.
   pure subroutine make_step_matrix(modes, step, form, matrix)
      !> Exponents
      type(contact_modes_t), intent(in) :: modes
      real(wp), intent(in) :: step
      type(power_form_t), intent(in) :: form
      !> [2 count, 2 count]
      real(wp), allocatable, intent(out) :: matrix(:, :)

      complex(wp) :: conjugate, factor(modes%count), plain, u, v
      integer :: m, n

      factor = exp(modes%exponent*step)
      associate (k => modes%count, s => modes%exponent)
         allocate (matrix(2*k, 2*k))
         do n = 1, k
            do m = 1, k
               call find_pair(form, m, n, plain, conjugate)
               u = 0.5_wp*plain*integral(s(m) + s(n), step, factor(m)*factor(n))
               v = 0.5_wp*conjugate*integral(s(m) + conjg(s(n)), step, factor(m)*conjg(factor(n)))
               call place_pair(m, n, k, u, v, matrix)
            end do
         end do
      end associate
   end subroutine make_step_matrix

end module contact_losses
