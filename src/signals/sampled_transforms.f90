!> Fourier sums of samples at equal steps, at frequencies at equal steps: Bluestein's way to make one convolution of
!> them, and that by fast Fourier transforms of a power of two.
module sampled_transforms
   use kinds, only: pi, wp
   implicit none (type, external)
   private
   public :: fourier_sums

contains

   !> Sums of x_n exp(-i omega (start + n step)), n = 0, 1, ...
   pure function fourier_sums(samples, start, step, least, spacing, count) result(sums)
      real(wp), intent(in) :: samples(0:)
      !> Instant of the first, and their distance
      real(wp), intent(in) :: start
      real(wp), intent(in) :: step
      !> The least frequency, their distance and number
      real(wp), intent(in) :: least
      real(wp), intent(in) :: spacing
      integer, intent(in) :: count
      complex(wp) :: sums(0:count - 1)

      complex(wp), allocatable :: chirp(:), filter(:), signal(:)
      integer :: k, n, room, samples_count

      ! omega_k t_n has the product k n = (k^2 + n^2 - (k - n)^2)/2
      samples_count = size(samples)
      room = 1
      do while (room < samples_count + count - 1)
         room = 2*room
      end do
      allocate (chirp(0:max(samples_count, count) - 1))
      chirp = [(chirp_at(n), n=0, ubound(chirp, 1))]
      allocate (signal(0:room - 1), filter(0:room - 1), source=(0.0_wp, 0.0_wp))
      do n = 0, samples_count - 1
         signal(n) = samples(n)*chirp(n)*turn(least*step*real(n, wp))
         if (n > 0) filter(room - n) = conjg(chirp(n))
      end do
      filter(0:count - 1) = conjg(chirp(0:count - 1))
      call transform(signal, .false.)
      call transform(filter, .false.)
      signal = signal*filter
      call transform(signal, .true.)
      do k = 0, count - 1
         sums(k) = signal(k)*chirp(k)*turn((least + spacing*real(k, wp))*start)
      end do

   contains

      !> exp(-i spacing step n^2/2): whole turns of the square are taken out before they cost digits.
      pure complex(wp) function chirp_at(number)
         integer, intent(in) :: number

         real(wp) :: turns

         turns = spacing*step/(4.0_wp*pi)
         chirp_at = turn(2.0_wp*pi*modulo(modulo(turns*real(number, wp), 1.0_wp)*real(number, wp), 1.0_wp))
      end function chirp_at

      pure complex(wp) function turn(angle)
         real(wp), intent(in) :: angle

         turn = cmplx(cos(angle), -sin(angle), wp)
      end function turn
   end function fourier_sums

   !> The fast transform of a power of two, in place (Cooley and Tukey 1965).
   pure subroutine transform(values, is_inverse)
      complex(wp), intent(inout) :: values(0:)
      !> With the other sign, and over the number of values
      logical, intent(in) :: is_inverse

      complex(wp), allocatable :: factor(:)
      complex(wp) :: value
      real(wp) :: sign
      integer :: bit, first, half, i, mirrored, n

      n = size(values)
      sign = merge(1.0_wp, -1.0_wp, is_inverse)
      allocate (factor(0:max(n/2, 1) - 1))
      do i = 0, ubound(factor, 1)
         factor(i) = cmplx(cos(2.0_wp*pi*real(i, wp)/real(n, wp)), sign*sin(2.0_wp*pi*real(i, wp)/real(n, wp)), wp)
      end do
      mirrored = 0
      do i = 1, n - 1
         bit = n/2
         do while (mirrored >= bit)
            mirrored = mirrored - bit
            bit = bit/2
         end do
         mirrored = mirrored + bit
         if (i >= mirrored) cycle
         value = values(i)
         values(i) = values(mirrored)
         values(mirrored) = value
      end do
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
