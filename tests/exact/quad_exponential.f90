!> An independent way through a linear phase: the matrix exponential in quadruple precision by scaling and
!> squaring, for the modes of a beam alone, held at the stop, or on the three-element stop.
module quad_exponential
   use, intrinsic :: iso_fortran_env, only: real128
   use constrained_sets, only: free_beam_t
   use kinds, only: wp
   use three_element_stop, only: three_element_t
   implicit none (type, external)
   private
   public :: qp, exponential, free_matrix, contact_matrix

   integer, parameter :: qp = real128

contains

   !> exp(A t).
   function exponential(matrix, t) result(power)
      !> A, square
      real(qp), intent(in) :: matrix(:, :)
      !> t >= 0
      real(qp), intent(in) :: t
      real(qp) :: power(size(matrix, 1), size(matrix, 1))

      real(qp), dimension(size(matrix, 1), size(matrix, 1)) :: scaled, term
      integer :: halvings, i, k

      scaled = matrix*t
      halvings = max(0, exponent(maxval(sum(abs(scaled), dim=2))) + 4)
      scaled = scaled*2.0_qp**(-halvings)
      ! exp - 1 is squared, so that small exponents keep their digits: (1 + e)^2 - 1 = 2 e + e^2
      term = scaled
      power = scaled
      do k = 2, 24
         term = matmul(term, scaled)/real(k, qp)
         power = power + term
      end do
      do k = 1, halvings
         power = 2.0_qp*power + matmul(power, power)
      end do
      do i = 1, size(matrix, 1)
         power(i, i) = power(i, i) + 1.0_qp
      end do
   end function exponential

   !> d/dt (q, v) of the free beam.
   function free_matrix(beam, zeta) result(matrix)
      !> The beam in its modes
      type(free_beam_t), intent(in) :: beam
      !> zeta
      real(wp), intent(in) :: zeta
      real(qp) :: matrix(2*beam%oscillators%count, 2*beam%oscillators%count)

      integer :: i, n

      n = beam%oscillators%count
      matrix = 0.0_qp
      do i = 1, n
         matrix(i, n + i) = 1.0_qp
         matrix(n + i, i) = -real(beam%oscillators%square(i), qp)
         matrix(n + i, n + i) = -2.0_qp*real(zeta, qp)*real(beam%oscillators%square(i), qp)
      end do
   end function free_matrix

   !> d/dt (q, v, P2, 1) in contact with the three-element stop.
   function contact_matrix(beam, zeta, spring) result(matrix)
      !> The beam in its modes
      type(free_beam_t), intent(in) :: beam
      !> zeta
      real(wp), intent(in) :: zeta
      !> The stop, with its branch
      type(three_element_t), intent(in) :: spring
      real(qp) :: matrix(2*beam%oscillators%count + 2, 2*beam%oscillators%count + 2)

      real(qp) :: b(beam%oscillators%count)
      integer :: i, n

      n = beam%oscillators%count
      b = real(beam%value(:, 1), qp)
      matrix = 0.0_qp
      matrix(:2*n, :2*n) = free_matrix(beam, zeta)
      do i = 1, n
         ! P = k (delta - b.q) + P2
         matrix(n + 1:2*n, i) = matrix(n + 1:2*n, i) - b*real(spring%stiffness, qp)*b(i)
      end do
      matrix(n + 1:2*n, 2*n + 1) = b
      matrix(n + 1:2*n, 2*n + 2) = b*real(spring%stiffness, qp)*real(beam%height(1), qp)
      matrix(2*n + 1, n + 1:2*n) = -real(spring%branch_stiffness, qp)*b
      matrix(2*n + 1, 2*n + 1) = -real(spring%relaxation_rate, qp)
   end function contact_matrix

end module quad_exponential
