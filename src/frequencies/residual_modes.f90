!> Residual modes: a few vectors that represent the flexibility of the truncated modes at some points (docs/theory.md,
!> section 13).
!>
!> Vectors are given in coordinates q with strain energy q.q/2 and kinetic energy |B dq/dt|^2/2 (`support_coordinates`).
!>
!> The static shapes under forces at these points, minus their components along the retained modes, are orthogonal to
!> the retained modes in strain energy and therefore in mass (MacNeal, Computers and Structures 1 (1971) 581; Rubin,
!> AIAA J. 13 (1975) 995). The Rayleigh-Ritz method makes modes of these vectors. With the residual modes the
!> flexibility at and between the points equals that of all modes.
module residual_modes
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use lanczos_solver, only: orthogonalise
   use lapack_interfaces, only: dsygv, lapack_message
   use support_coordinates, only: bend, supported_beam_t
   implicit none (type, external)
   private
   public :: find_residual_modes

contains

   !> The residual modes of static shapes, in addition to the retained modes.
   subroutine find_residual_modes(beam, shapes, vectors, residual, deflection, error)
      type(supported_beam_t), intent(in) :: beam
      !> Coordinates of the static shapes, [order, shapes]
      real(wp), intent(in) :: shapes(:, :)
      !> Coordinates of the retained modes, [order, modes]
      real(wp), intent(in) :: vectors(:, :)
      !> Coordinates of the residual modes of unit modal mass, at most one for each shape, in ascending order of
      !> frequency, [order, residual]
      real(wp), allocatable, intent(out) :: residual(:, :)
      !> B times the residual modes, [rows, residual]
      real(wp), allocatable, intent(out) :: deflection(:, :)
      !> Set if the eigenproblem of the residual modes fails
      type(failure_t), allocatable, intent(out) :: error

      integer :: j

      allocate (residual, source=residual_vectors(shapes, vectors))
      allocate (deflection(beam%rows, size(residual, 2)))
      if (size(residual, 2) == 0) return
      do j = 1, size(residual, 2)
         call bend(beam, residual(:, j), deflection(:, j))
      end do
      call rotate(residual, deflection, error)
      if (.not. allocated(error)) call orthogonalise(residual, deflection, error)
   end subroutine find_residual_modes

   !> Shapes minus their components along the modes, orthonormalised. Shapes that depend linearly on modes and other
   !> shapes are dropped.
   pure function residual_vectors(shapes, vectors) result(residual)
      !> Coordinates of the static shapes, [order, shapes]
      real(wp), intent(in) :: shapes(:, :)
      !> Coordinates of the retained modes, [order, modes]
      real(wp), intent(in) :: vectors(:, :)
      real(wp), allocatable :: residual(:, :)

      ! minimum norm of a residual relative to its shape; smaller residuals are rounding errors
      real(wp), parameter :: min_norm = 1.0e-11_wp
      real(wp) :: found(size(shapes, 1), size(shapes, 2)), q(size(shapes, 1))
      integer :: count, i, j, pass

      count = 0
      do j = 1, size(shapes, 2)
         q = shapes(:, j)/norm2(shapes(:, j))
         do pass = 1, 2
            do i = 1, size(vectors, 2)
               q = q - vectors(:, i)*(dot_product(vectors(:, i), q)/dot_product(vectors(:, i), vectors(:, i)))
            end do
            do i = 1, count
               q = q - found(:, i)*dot_product(found(:, i), q)
            end do
         end do
         if (.not. norm2(q) > min_norm) cycle
         count = count + 1
         q = q/norm2(q)
         do i = 1, count - 1
            q = q - found(:, i)*dot_product(found(:, i), q)
         end do
         found(:, count) = q/norm2(q)
      end do
      allocate (residual, source=found(:, :count))
   end function residual_vectors

   !> Rotate vectors that are orthogonal in strain energy so that they become orthogonal in mass as well, in ascending
   !> order of frequency, which is descending order of modal mass at unit strain energy.
   subroutine rotate(vectors, deflection, error)
      !> Orthonormal vectors, [order, count]
      real(wp), intent(inout) :: vectors(:, :)
      !> B times the vectors, [rows, count]
      real(wp), intent(inout) :: deflection(:, :)
      !> Set if DSYGV fails
      type(failure_t), allocatable, intent(out) :: error

      real(wp), dimension(size(vectors, 2), size(vectors, 2)) :: mass, unit
      ! workspace, sufficient for blocks of 32 columns
      real(wp) :: work(34*size(vectors, 2) + 1)
      real(wp) :: value(size(vectors, 2))
      integer :: count, i, info

      count = size(vectors, 2)
      mass = matmul(transpose(deflection), deflection)
      unit = 0.0_wp
      do i = 1, count
         unit(i, i) = 1.0_wp
      end do
      call dsygv(1, 'V', 'U', count, mass, count, unit, count, value, work, size(work), info)
      if (info /= 0) then
         call fail(error, status_run_failed, lapack_message('DSYGV', info, count))
         return
      end if
      mass = mass(:, count:1:-1)
      vectors = matmul(vectors, mass)
      deflection = matmul(deflection, mass)
   end subroutine rotate

end module residual_modes
