!> What is dissipated in a contact with the three-element stop, integrated in closed form.
!>
!> Power is a quadratic form of the exponentials, so its integral is one sum over pairs of exponents. From one sample
!> to the next, which is the same length of time again and again, that sum is a real matrix made once.
module contact_losses
   use contact_modes, only: contact_modes_t
   use contact_secular, only: size_of
   use damped_oscillators, only: lanes, propagate
   use exponential_powers, only: powers_less_one
   use kinds, only: wp
   use modal_beam, only: modal_beam_t
   implicit none (type, external)
   private
   public :: contact_losses_t, make_contact_losses, losses_until, losses_of_step, integral

   !> A power, a quadratic form of the terms A_m: Re sum (plain A_m A_n + conjugate A_m conj(A_n))/2.
   type :: power_form_t
      !> Per pair of exponents, [count, count]
      complex(wp), allocatable :: plain(:, :), conjugate(:, :)
      !> Its integral: x^T matrix x with x the real parts of all A_m, then the imaginary ones, [2 count, 2 count], but
      !> for A_m conj(A_m), which decays as slowly as it may: that has the factors half |A_m|^2
      real(wp), allocatable :: integral(:, :), steady(:)
      !> Over one step, A_m conj(A_m) included
      real(wp), allocatable :: step(:, :)
   end type power_form_t

   !> What is dissipated in the beam, 2 zeta sum W_i^2 v_i^2, and in the damper, nu P2^2/(beta k).
   type :: contact_losses_t
      logical :: has_beam = .false.
      logical :: has_stop = .false.
      type(power_form_t) :: beam, stop
      !> Length of the step; 0: there is none yet
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
      integer :: m, n

      if (.not. losses%has_stop) then
         factor = 0.0_wp
         associate (spring => modes%spring)
            if (spring%branch_stiffness > 0.0_wp) factor = spring%relaxation_rate/spring%branch_stiffness
         end associate
         allocate (losses%stop%plain(modes%count, modes%count), losses%stop%conjugate(modes%count, modes%count))
         do n = 1, modes%count
            losses%stop%plain(:, n) = factor*modes%branch_value*modes%branch_value(n)
            losses%stop%conjugate(:, n) = factor*modes%branch_value*conjg(modes%branch_value(n))
         end do
         call integrate_form(modes, losses%stop)
         losses%has_stop = .true.
      end if
      if (losses%has_beam .or. .not. with_beam) return
      allocate (rate(beam%count, modes%count))
      allocate (losses%beam%plain(modes%count, modes%count), losses%beam%conjugate(modes%count, modes%count))
      do m = 1, modes%count
         rate(:, m) = sqrt(modes%two_zeta*beam%oscillators%square)*modes%exponent(m)*modes%shape(:, m)
      end do
      do n = 1, modes%count
         do m = 1, modes%count
            losses%beam%plain(m, n) = sum(rate(:, m)*rate(:, n))
            losses%beam%conjugate(m, n) = sum(rate(:, m)*conjg(rate(:, n)))
         end do
      end do
      call integrate_form(modes, losses%beam)
      losses%has_beam = .true.
      losses%step = 0.0_wp
   end subroutine make_contact_losses

   !> What a power takes between two instants is the difference of a quadratic form of the terms.
   pure subroutine integrate_form(modes, form)
      type(contact_modes_t), intent(in) :: modes
      !> Gets its integral
      type(power_form_t), intent(inout) :: form

      complex(wp) :: u, v
      integer :: m, n

      associate (k => modes%count, s => modes%exponent)
         allocate (form%integral(2*k, 2*k), form%steady(k))
         do n = 1, k
            do m = 1, k
               u = 0.5_wp*form%plain(m, n)/(s(m) + s(n))
               v = 0.0_wp
               if (m /= n) v = 0.5_wp*form%conjugate(m, n)/(s(m) + conjg(s(n)))
               call place_pair(m, n, k, u, v, form%integral)
            end do
            form%steady(n) = 0.5_wp*real(form%conjugate(n, n), wp)
         end do
      end associate
   end subroutine integrate_form

   !> The pair m, n of Re sum (u_mn A_m A_n + v_mn A_m conj(A_n)) in the matrix of real and imaginary parts.
   pure subroutine place_pair(m, n, k, u, v, matrix)
      integer, intent(in) :: m
      integer, intent(in) :: n
      !> Number of terms
      integer, intent(in) :: k
      complex(wp), intent(in) :: u
      complex(wp), intent(in) :: v
      real(wp), intent(inout) :: matrix(2*k, 2*k)

      matrix(m, n) = real(u, wp) + real(v, wp)
      matrix(k + m, k + n) = real(v, wp) - real(u, wp)
      matrix(m, k + n) = aimag(v) - aimag(u)
      matrix(k + m, n) = -aimag(v) - aimag(u)
   end subroutine place_pair

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

      complex(wp), dimension(modes%count) :: change, both
      real(wp), dimension(size(modes%decay)) :: real_part, imaginary_part, less_one, fall
      real(wp) :: changes(2*modes%count), sums(2*modes%count), steady(modes%count)
      real(wp), dimension(size(q0)) :: q, v

      call powers_less_one(size(modes%decay)/lanes, modes%decay, modes%swing, t, real_part, imaginary_part, less_one, &
         fall)
      associate (k => modes%count)
         ! of A^2 and B^2 the difference is (A - B) (A + B)
         change = amplitude*cmplx(less_one(:k), imaginary_part(:k), wp)
         both = amplitude*cmplx(1.0_wp + real_part(:k), imaginary_part(:k), wp)
         changes = [real(change, wp), aimag(change)]
         sums = [real(both, wp), aimag(both)]
         steady = (real(amplitude, wp)**2 + aimag(amplitude)**2)*time_of_decay(modes%decay(:k), t, fall(:k))
      end associate
      if (present(impulse)) impulse = sum(real(change/modes%exponent, wp))
      lost = 0.0_wp
      lost(2) = bilinear_form(size(sums), losses%stop%integral, changes, sums) + sum(losses%stop%steady*steady)
      if (.not. losses%has_beam) return
      lost(1) = bilinear_form(size(sums), losses%beam%integral, changes, sums) + sum(losses%beam%steady*steady)
      if (size(modes%inactive) == 0) return
      call propagate(beam%oscillators, t, q0, v0, q, v)
      associate (i => modes%inactive, w2 => beam%oscillators%square)
         lost(1) = lost(1) + 0.5_wp*sum(v0(i)**2 - v(i)**2 + w2(i)*(q0(i)**2 - q(i)**2))
      end associate
   end subroutine losses_until

   !> Integral of exp(-2 decay t) up to a time.
   elemental function time_of_decay(decay, t, fall) result(value)
      real(wp), intent(in) :: decay
      real(wp), intent(in) :: t
      !> exp(-decay t) - 1
      real(wp), intent(in) :: fall
      real(wp) :: value

      ! what decays so little lasts for all of it
      value = merge(-fall*(2.0_wp + fall), 2.0_wp*t, decay*t > 1.0e-17_wp) &
         /merge(2.0_wp*decay, 2.0_wp, decay*t > 1.0e-17_wp)
   end function time_of_decay

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
         call make_step_matrix(modes, step, losses%beam)
         call make_step_matrix(modes, step, losses%stop)
         losses%step = step
      end if
      parts = [real(term, wp), aimag(term)]
      ! products of what has died out would be subnormal, which is slow
      where (abs(parts) < negligible) parts = 0.0_wp
      lost = [bilinear_form(size(parts), losses%beam%step, parts, parts), &
         bilinear_form(size(parts), losses%stop%step, parts, parts)]
   end subroutine losses_of_step

   !> x^T A y.
   pure function bilinear_form(order, matrix, x, y) result(value)
      integer, intent(in) :: order
      real(wp), intent(in) :: matrix(order, order)
      real(wp), intent(in) :: x(order)
      real(wp), intent(in) :: y(order)
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
         value = value + product*y(k)
      end do
   end function bilinear_form

   !> The quadratic form of one step on real and imaginary parts.
   pure subroutine make_step_matrix(modes, step, form)
      !> Exponents
      type(contact_modes_t), intent(in) :: modes
      real(wp), intent(in) :: step
      type(power_form_t), intent(inout) :: form

      complex(wp) :: factor(modes%count), u, v
      integer :: m, n

      factor = exp(modes%exponent*step)
      associate (k => modes%count, s => modes%exponent)
         if (.not. allocated(form%step)) allocate (form%step(2*k, 2*k))
         do n = 1, k
            do m = 1, k
               u = 0.5_wp*form%plain(m, n)*integral(s(m) + s(n), step, factor(m)*factor(n))
               v = 0.5_wp*form%conjugate(m, n)*integral(s(m) + conjg(s(n)), step, factor(m)*conjg(factor(n)))
               call place_pair(m, n, k, u, v, form%step)
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
