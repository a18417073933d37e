!> Fourier sums of equidistant samples at equidistant frequencies by Bluestein's algorithm: the sums are a convolution,
!> which is computed by fast Fourier transforms whose length is a power of two.
module sampled_transforms
   use kinds, only: pi, wp
   implicit none (type, external)
   private
   public :: fourier_sums

contains

   !> Sums of x_n exp(-i omega (start + n step)), n = 0, 1, ...
   pure function fourier_sums(samples, start, step, min_frequency, spacing, count) result(sums)
      real(wp), intent(in) :: samples(0:)
      !> Instant of the first sample
      real(wp), intent(in) :: start
      !> Sampling interval
      real(wp), intent(in) :: step
      !> Minimum circular frequency
      real(wp), intent(in) :: min_frequency
      !> Difference of neighbouring circular frequencies
      real(wp), intent(in) :: spacing
      !> Number of frequencies
      integer, intent(in) :: count
      complex(wp) :: sums(0:count - 1)

      complex(wp), allocatable :: chirp(:), filter(:), signal(:)
      ! length of the fast Fourier transforms
      integer :: length
      integer :: k, n, samples_count

      ! omega_k n step contains spacing*step*k*n, and k n = (k^2 + n^2 - (k - n)^2)/2: with chirp_n = exp(-i spacing
      ! step n^2/2), the sums are those of signal_n conjg(chirp_(k - n)), a convolution, times chirp_k. The other
      ! factors of exp(-i omega_k (start + n step)) depend on k alone or on n alone
      samples_count = size(samples)
      length = 1
      do while (length < samples_count + count - 1)
         length = 2*length
      end do
      allocate (chirp(0:max(samples_count, count) - 1))
      chirp = [(chirp_at(n), n=0, ubound(chirp, 1))]
      allocate (signal(0:length - 1), filter(0:length - 1), source=(0.0_wp, 0.0_wp))
      do n = 0, samples_count - 1
         signal(n) = samples(n)*chirp(n)*phasor(min_frequency*step*real(n, wp))
         ! the convolution is circular: an index k - n < 0 is stored from the end
         if (n > 0) filter(length - n) = conjg(chirp(n))
      end do
      filter(0:count - 1) = conjg(chirp(0:count - 1))
      call transform(signal, .false.)
      call transform(filter, .false.)
      signal = signal*filter
      call transform(signal, .true.)
      do k = 0, count - 1
         sums(k) = signal(k)*chirp(k)*phasor((min_frequency + spacing*real(k, wp))*start)
      end do

   contains

      !> exp(-i spacing step n^2/2). Whole turns are subtracted before each multiplication by n. The error of the angle
      !> still grows as the number of turns times n^2 times the rounding error of a real number.
      pure complex(wp) function chirp_at(number)
         integer, intent(in) :: number

         real(wp) :: turns

         turns = spacing*step/(4.0_wp*pi)
         chirp_at = phasor(2.0_wp*pi*modulo(modulo(turns*real(number, wp), 1.0_wp)*real(number, wp), 1.0_wp))
      end function chirp_at

      !> exp(-i angle).
      pure complex(wp) function phasor(angle)
         real(wp), intent(in) :: angle

         phasor = cmplx(cos(angle), -sin(angle), wp)
      end function phasor
   end function fourier_sums

   !> Fast Fourier transform, in place; the number of values is a power of two (Cooley and Tukey 1965).
   pure subroutine transform(values, is_inverse)
      complex(wp), intent(inout) :: values(0:)
      !> Whether the inverse transform is computed: with the other sign of the exponent, and divided by the number of
      !> values
      logical, intent(in) :: is_inverse

      complex(wp), allocatable :: factor(:)
      complex(wp) :: value
      real(wp) :: sign
      ! the number with the binary digits of i in reverse order
      integer :: reversed
      integer :: bit, first, half, i, n

      n = size(values)
      sign = merge(1.0_wp, -1.0_wp, is_inverse)
      allocate (factor(0:max(n/2, 1) - 1))
      do i = 0, ubound(factor, 1)
         factor(i) = cmplx(cos(2.0_wp*pi*real(i, wp)/real(n, wp)), sign*sin(2.0_wp*pi*real(i, wp)/real(n, wp)), wp)
      end do
      ! exchange the values i and `reversed`, which is counted up like i, but from its most significant binary digit, so
      ! carries go to lower digits
      reversed = 0
      do i = 1, n - 1
         bit = n/2
         do while (reversed >= bit)
            reversed = reversed - bit
            bit = bit/2
         end do
         reversed = reversed + bit
         if (i >= reversed) cycle
         value = values(i)
         values(i) = values(reversed)
         values(reversed) = value
      end do
      ! merge pairs of transforms of length `half`
      half = 1
      do while (half < n)
         do first = 0, n - 1, 2*half
            do i = 0, half - 1
               value = values(first + half + i)*factor(i*(n/(2*half)))
               values(first + half + i) = values(first + i) - value
               values(first + i) = values(first + i) + value
            end do
         end do
         half = 2*half
      end do
      if (is_inverse) values = values/real(n, wp)
   end subroutine transform

end module sampled_transforms
