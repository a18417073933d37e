!> Products of matrices and vectors in loops that compilers keep in the registers of a processor.
module panel_products
   use damped_oscillators, only: lanes
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: multiply_panel

contains

   !> Products of a panel of a matrix and four vectors. Sums over odd and even columns stay in registers.
   pure subroutine multiply_panel(columns, panel, vector_1, vector_2, vector_3, vector_4, product)
      !> An even number
      integer, intent(in) :: columns
      real(wp), intent(in) :: panel(lanes, columns)
      real(wp), intent(in), dimension(columns) :: vector_1, vector_2, vector_3, vector_4
      real(wp), intent(out) :: product(lanes, 4)

      real(wp), dimension(lanes) :: even_1, even_2, even_3, even_4, odd_1, odd_2, odd_3, odd_4
      integer :: i, n

      even_1 = 0.0_wp
      even_2 = 0.0_wp
      even_3 = 0.0_wp
      even_4 = 0.0_wp
      odd_1 = 0.0_wp
      odd_2 = 0.0_wp
      odd_3 = 0.0_wp
      odd_4 = 0.0_wp
      do n = 1, columns, 2
         !$omp simd
         do i = 1, lanes
            odd_1(i) = odd_1(i) + panel(i, n)*vector_1(n)
            odd_2(i) = odd_2(i) + panel(i, n)*vector_2(n)
            odd_3(i) = odd_3(i) + panel(i, n)*vector_3(n)
            odd_4(i) = odd_4(i) + panel(i, n)*vector_4(n)
            even_1(i) = even_1(i) + panel(i, n + 1)*vector_1(n + 1)
            even_2(i) = even_2(i) + panel(i, n + 1)*vector_2(n + 1)
            even_3(i) = even_3(i) + panel(i, n + 1)*vector_3(n + 1)
            even_4(i) = even_4(i) + panel(i, n + 1)*vector_4(n + 1)
         end do
      end do
      product(:, 1) = even_1 + odd_1
      product(:, 2) = even_2 + odd_2
      product(:, 3) = even_3 + odd_3
      product(:, 4) = even_4 + odd_4
   end subroutine multiply_panel

end module panel_products
