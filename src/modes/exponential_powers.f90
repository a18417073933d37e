!> exp(s t) of many exponents with Re s <= 0, in SIMD vectors of real numbers.
module exponential_powers
   use damped_oscillators, only: max_exponent, lanes
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: exponentials, exponentials_less_one, find_terms

contains

   !> Real and imaginary parts of exp(s t).
   pure subroutine exponentials(blocks, decay, omega, t, real_part, imaginary_part)
      !> Number of SIMD vectors in each array
      integer, intent(in) :: blocks
      !> -Re s
      real(wp), intent(in), dimension(lanes*blocks) :: decay
      !> Im s
      real(wp), intent(in), dimension(lanes*blocks) :: omega
      !> Time, >= 0
      real(wp), intent(in) :: t
      !> Real part of exp(s t)
      real(wp), intent(out), dimension(lanes*blocks) :: real_part
      !> Imaginary part of exp(s t)
      real(wp), intent(out), dimension(lanes*blocks) :: imaginary_part

      ! each loop has one function, so that the compiler vectorises it
      !GCC$ builtin (exp) attributes simd (notinbranch) if('x86_64')
      !GCC$ builtin (sin) attributes simd (notinbranch) if('x86_64')
      !GCC$ builtin (cos) attributes simd (notinbranch) if('x86_64')
      real(wp), dimension(lanes*blocks) :: factors, cosines, sines
      integer :: i

      do i = 1, lanes*blocks
         factors(i) = exp(-min(decay(i)*t, max_exponent))
      end do
      do i = 1, lanes*blocks
         cosines(i) = cos(omega(i)*t)
      end do
      do i = 1, lanes*blocks
         sines(i) = sin(omega(i)*t)
      end do
      !$omp simd
      do i = 1, lanes*blocks
         real_part(i) = factors(i)*cosines(i)
         imaginary_part(i) = factors(i)*sines(i)
      end do
   end subroutine exponentials

   !> exp(s t) and exp(s t) - 1, the latter without cancellation at short times.
   pure subroutine exponentials_less_one(blocks, decay, omega, t, real_part, imaginary_part, less_one, modulus_change)
      !> Number of SIMD vectors in each array
      integer, intent(in) :: blocks
      !> -Re s
      real(wp), intent(in), dimension(lanes*blocks) :: decay
      !> Im s
      real(wp), intent(in), dimension(lanes*blocks) :: omega
      !> Time, >= 0
      real(wp), intent(in) :: t
      !> Real part of exp(s t)
      real(wp), intent(out), dimension(lanes*blocks) :: real_part
      !> Imaginary part of exp(s t)
      real(wp), intent(out), dimension(lanes*blocks) :: imaginary_part
      !> Real part of exp(s t) - 1; the imaginary part is that of exp(s t)
      real(wp), intent(out) :: less_one(lanes*blocks)
      !> |exp(s t)| - 1
      real(wp), intent(out) :: modulus_change(lanes*blocks)

      !GCC$ builtin (exp) attributes simd (notinbranch) if('x86_64')
      !GCC$ builtin (sin) attributes simd (notinbranch) if('x86_64')
      !GCC$ builtin (cos) attributes simd (notinbranch) if('x86_64')
      ! Up to this x, (exp(-x) - 1)/(-x) = 1 + sum series(k) x^k, series(k) = (-1)^k/(k + 1)!
      real(wp), parameter :: series_limit = 0.25_wp
      real(wp), parameter :: series(11) = [-1.0_wp/2.0_wp, 1.0_wp/6.0_wp, -1.0_wp/24.0_wp, 1.0_wp/120.0_wp, &
         -1.0_wp/720.0_wp, 1.0_wp/5040.0_wp, -1.0_wp/40320.0_wp, 1.0_wp/362880.0_wp, -1.0_wp/3628800.0_wp, &
         1.0_wp/39916800.0_wp, -1.0_wp/479001600.0_wp]
      real(wp), dimension(lanes*blocks) :: factors, cosines, sines
      real(wp) :: x, versine
      integer :: i

      do i = 1, lanes*blocks
         factors(i) = exp(-min(decay(i)*t, max_exponent))
      end do
      do i = 1, lanes*blocks
         cosines(i) = cos(0.5_wp*omega(i)*t)
      end do
      do i = 1, lanes*blocks
         sines(i) = sin(0.5_wp*omega(i)*t)
      end do
      !$omp simd private(x, versine)
      do i = 1, lanes*blocks
         x = min(decay(i)*t, series_limit)
         modulus_change(i) = -x*(1.0_wp + x*(series(1) + x*(series(2) + x*(series(3) + x*(series(4) + x*(series(5) &
            + x*(series(6) + x*(series(7) + x*(series(8) + x*(series(9) + x*(series(10) + x*series(11))))))))))))
         modulus_change(i) = merge(modulus_change(i), factors(i) - 1.0_wp, decay(i)*t <= series_limit)
         ! 1 - cos(omega t)
         versine = 2.0_wp*sines(i)**2
         less_one(i) = modulus_change(i) - factors(i)*versine
         real_part(i) = factors(i)*(1.0_wp - versine)
         imaginary_part(i) = factors(i)*(2.0_wp*sines(i)*cosines(i))
      end do
   end subroutine exponentials_less_one

   !> Terms A exp(s t). The exponentials are always those of `exponentials_less_one`, so that the rounding errors of a
   !> motion do not depend on the other quantities that a run evaluates.
   pure subroutine find_terms(amplitude, decay, omega, t, term, imaginary_part, less_one, modulus_change)
      !> Amplitudes A, [count]
      complex(wp), intent(in) :: amplitude(:)
      !> -Re s, [padded]
      real(wp), contiguous, intent(in) :: decay(:)
      !> Im s, [padded]
      real(wp), contiguous, intent(in) :: omega(:)
      !> Time, >= 0
      real(wp), intent(in) :: t
      !> A exp(s t), [count]
      complex(wp), intent(out) :: term(:)
      !> Further results of `exponentials_less_one`, [padded]
      real(wp), contiguous, intent(out) :: imaginary_part(:)
      real(wp), contiguous, intent(out) :: less_one(:)
      real(wp), contiguous, intent(out) :: modulus_change(:)

      real(wp) :: real_part(size(decay))
      integer :: m

      call exponentials_less_one(size(decay)/lanes, decay, omega, t, real_part, imaginary_part, less_one, &
         modulus_change)
      do m = 1, size(amplitude)
         associate (x => real(amplitude(m), wp), y => aimag(amplitude(m)))
            term(m) = cmplx(x*real_part(m) - y*imaginary_part(m), x*imaginary_part(m) + y*real_part(m), wp)
         end associate
      end do
   end subroutine find_terms

end module exponential_powers
