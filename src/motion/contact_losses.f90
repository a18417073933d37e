!> What is dissipated in a contact with the three-element stop, integrated in closed form.
!>
!> Power is a quadratic form of the exponentials, so its integral is one sum over pairs of exponents. From one sample
!> to the next, which is the same length of time again and again, that sum is a real matrix made once.
module contact_losses
   use contact_modes, only: contact_modes_t
   use contact_secular, only: size_of
   use damped_oscillators, only: propagate
   use kinds, only: wp
   use modal_beam, only: modal_beam_t
   implicit none (type, external)
   private
   public :: contact_losses_t, make_contact_losses, losses_until, losses_of_step, integral

   !> Dissipation per pair of exponents: power = Re sum (plain A_m A_n + conjugate A_m conj(A_n))/2, [count, count].
   type :: contact_losses_t
      logical :: made = .false.
      !> In the beam: 2 zeta sum W_i^2 v_i^2
      complex(wp), allocatable :: beam_plain(:, :), beam_conjugate(:, :)
      !> In the damper: nu P2^2/(beta k)
      complex(wp), allocatable :: stop_plain(:, :), stop_conjugate(:, :)
      !> Over one step: x^T matrix x with x the real parts of all A_m, then the imaginary ones, [2 count, 2 count]
      logical :: has_step = .false.
      real(wp), allocatable :: beam_step(:, :), stop_step(:, :)
   end type contact_losses_t

contains

   !> What the ledger needs of each pair of exponents.
   pure subroutine make_contact_losses(beam, modes, losses)
      type(modal_beam_t), intent(in) :: beam
      !> Exponents and shapes
      type(contact_modes_t), intent(in) :: modes
      !> The pairs
      type(contact_losses_t), intent(out) :: losses

      complex(wp), allocatable :: rate(:, :)
      real(wp) :: factor
      integer :: m, n

      associate (k => modes%count)
         allocate (losses%beam_plain(k, k), losses%beam_conjugate(k, k), losses%stop_plain(k, k), &
            losses%stop_conjugate(k, k), rate(beam%count, k))
      end associate
      factor = 0.0_wp
      associate (spring => modes%spring)
         if (spring%branch_stiffness > 0.0_wp) factor = spring%relaxation_rate/spring%branch_stiffness
      end associate
      do m = 1, modes%count
         rate(:, m) = sqrt(modes%two_zeta*beam%oscillators%square)*modes%exponent(m)*modes%shape(:, m)
      end do
      losses%made = .true.
      do n = 1, modes%count
         do m = 1, modes%count
            losses%beam_plain(m, n) = sum(rate(:, m)*rate(:, n))
            losses%beam_conjugate(m, n) = sum(rate(:, m)*conjg(rate(:, n)))
            losses%stop_plain(m, n) = factor*modes%branch_value(m)*modes%branch_value(n)
            losses%stop_conjugate(m, n) = factor*modes%branch_value(m)*conjg(modes%branch_value(n))
         end do
      end do
   end subroutine make_contact_losses

   !> Dissipated from the start of a contact up to a time, integrated in closed form.
   pure subroutine losses_until(beam, modes, losses, amplitude, q0, v0, t, lost)
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
      !> In the beam, in the stop
      real(wp), intent(out) :: lost(2)

      complex(wp) :: plain, conjugate, pair, factor(modes%count)
      real(wp), dimension(size(q0)) :: q, v
      integer :: m, n

      lost = 0.0_wp
      factor = exp(modes%exponent*t)
      do n = 1, modes%count
         ! both forms are symmetric in the two exponents, up to conjugation
         do m = 1, n
            pair = merge(0.5_wp, 1.0_wp, m == n)*amplitude(m)*amplitude(n)
            plain = pair*integral(modes%exponent(m) + modes%exponent(n), t, factor(m)*factor(n))
            pair = merge(0.5_wp, 1.0_wp, m == n)*amplitude(m)*conjg(amplitude(n))
            conjugate = pair*integral(modes%exponent(m) + conjg(modes%exponent(n)), t, factor(m)*conjg(factor(n)))
            lost(1) = lost(1) + real(losses%beam_plain(m, n)*plain + losses%beam_conjugate(m, n)*conjugate, wp)
            lost(2) = lost(2) + real(losses%stop_plain(m, n)*plain + losses%stop_conjugate(m, n)*conjugate, wp)
         end do
      end do
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

      if (.not. losses%has_step) then
         call make_step_matrix(modes, step, losses%beam_plain, losses%beam_conjugate, losses%beam_step)
         call make_step_matrix(modes, step, losses%stop_plain, losses%stop_conjugate, losses%stop_step)
         losses%has_step = .true.
      end if
      parts = [real(term, wp), aimag(term)]
      ! products of what has died out would be subnormal, which is slow
      where (abs(parts) < negligible) parts = 0.0_wp
      lost = [quadratic_form(size(parts), losses%beam_step, parts), quadratic_form(size(parts), losses%stop_step, &
         parts)]
   end subroutine losses_of_step

   !> x^T A x.
   pure function quadratic_form(order, matrix, x) result(value)
      integer, intent(in) :: order
      real(wp), intent(in) :: matrix(order, order)
      real(wp), intent(in) :: x(order)
      real(wp) :: value

      real(wp) :: product
      integer :: i, k

      value = 0.0_wp
      do k = 1, order
         product = 0.0_wp
         !$omp simd reduction(+:product)
         do i = 1, order
            product = product + matrix(i, k)*x(i)
         end do
         value = value + product*x(k)
      end do
   end function quadratic_form

   !> The quadratic form of one step on real and imaginary parts.
   pure subroutine make_step_matrix(modes, step, plain, conjugate, matrix)
      !> Exponents
      type(contact_modes_t), intent(in) :: modes
      real(wp), intent(in) :: step
      !> Power per pair of exponents
      complex(wp), intent(in) :: plain(:, :)
      complex(wp), intent(in) :: conjugate(:, :)
      !> Its matrix, [2 count, 2 count]
      real(wp), allocatable, intent(out) :: matrix(:, :)

      complex(wp) :: factor(modes%count), u, v
      integer :: m, n

      factor = exp(modes%exponent*step)
      associate (k => modes%count, s => modes%exponent)
         allocate (matrix(2*k, 2*k))
         do n = 1, k
            do m = 1, k
               u = 0.5_wp*plain(m, n)*integral(s(m) + s(n), step, factor(m)*factor(n))
               v = 0.5_wp*conjugate(m, n)*integral(s(m) + conjg(s(n)), step, factor(m)*conjg(factor(n)))
               matrix(m, n) = real(u, wp) + real(v, wp)
               matrix(k + m, k + n) = real(v, wp) - real(u, wp)
               matrix(m, k + n) = aimag(v) - aimag(u)
               matrix(k + m, n) = -aimag(v) - aimag(u)
            end do
         end do
      end associate
   end subroutine make_step_matrix

   !> (exp(s t) - 1)/s without cancellation.
   elemental function integral(s, t, power) result(value)
      !> Exponent
      complex(wp), intent(in) :: s
      !> Time
      real(wp), intent(in) :: t
      !> exp(s t)
      complex(wp), intent(in) :: power
      complex(wp) :: value

      complex(wp) :: x

      x = s*t
      if (size_of(x) < 0.1_wp) then
         value = t*(1.0_wp + x/2.0_wp*(1.0_wp + x/3.0_wp*(1.0_wp + x/4.0_wp*(1.0_wp + x/5.0_wp*(1.0_wp + x/6.0_wp &
            *(1.0_wp + x/7.0_wp*(1.0_wp + x/8.0_wp*(1.0_wp + x/9.0_wp*(1.0_wp + x/10.0_wp)))))))))
      else
         value = (power - 1.0_wp)/s
      end if
   end function integral

end module contact_losses
