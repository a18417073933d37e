!> What modes that are left out do at some points, in a few vectors (docs/theory.md, section 13).
!>
!> The static shapes of forces there, less the part of the modes that are kept, are orthogonal to these in strain and so
!> in mass (MacNeal, Computers and Structures 1 (1971) 581; Rubin, AIAA J. 13 (1975) 995). Rayleigh and Ritz make modes
!> of them: with those the flexibility at and between the points is that of all modes.
module residual_modes
   use failures, only: fail, failure_t, status_run_failed
   use support_coordinates, only: bend, supported_beam_t
   use kinds, only: wp
   use lanczos_solver, only: orthogonalise
   use lapack_interfaces, only: dsygv, lapack_message
   implicit none (type, external)
   private
   public :: find_residual_modes

contains

   !> The residual modes of shapes beside others.
   subroutine find_residual_modes(beam, shapes, vectors, rest, deflection, error)
      type(supported_beam_t), intent(in) :: beam
      !> Coordinates of the shapes, [order, shapes]
      real(wp), intent(in) :: shapes(:, :)
      !> Coordinates of the modes that are kept, [order, modes]
      real(wp), intent(in) :: vectors(:, :)
      !> Residual modes of unit modal mass, at most one for each shape, the lowest frequency first, [order, residual]
      real(wp), allocatable, intent(out) :: rest(:, :)
      !> B times these, [rows, residual]
      real(wp), allocatable, intent(out) :: deflection(:, :)
      !> Set when their small eigenproblem fails
      type(failure_t), allocatable, intent(out) :: error

      integer :: j

      allocate (rest, source=remainders(shapes, vectors))
      allocate (deflection(beam%rows, size(rest, 2)))
      if (size(rest, 2) == 0) return
      do j = 1, size(rest, 2)
         call bend(beam, rest(:, j), deflection(:, j))
      end do
      call rotate(rest, deflection, error)
      if (.not. allocated(error)) call orthogonalise(rest, deflection, error)
   end subroutine find_residual_modes

   !> What is left of shapes beside modes, orthonormal; nothing of one that the others make up.
   pure function remainders(shapes, vectors) result(rest)
      !> [order, shapes]
      real(wp), intent(in) :: shapes(:, :)
      !> [order, modes]
      real(wp), intent(in) :: vectors(:, :)
      real(wp), allocatable :: rest(:, :)

      !> Of which rounding leaves too little
      real(wp), parameter :: least = 1.0e-11_wp
      real(wp) :: found(size(shapes, 1), size(shapes, 2)), q(size(shapes, 1))
      integer :: count, i, j, round

      count = 0
      do j = 1, size(shapes, 2)
         q = shapes(:, j)/norm2(shapes(:, j))
         do round = 1, 2
            do i = 1, size(vectors, 2)
               q = q - vectors(:, i)*(dot_product(vectors(:, i), q)/dot_product(vectors(:, i), vectors(:, i)))
            end do
            do i = 1, count
               q = q - found(:, i)*dot_product(found(:, i), q)
            end do
         end do
         if (.not. norm2(q) > least) cycle
         count = count + 1
         q = q/norm2(q)
         do i = 1, count - 1
            q = q - found(:, i)*dot_product(found(:, i), q)
         end do
         found(:, count) = q/norm2(q)
      end do
      allocate (rest, source=found(:, :count))
   end function remainders

   !> Vectors that are orthogonal in strain made so in mass as well, that of most mass first.
   subroutine rotate(vectors, deflection, error)
      !> Orthonormal, [order, count]
      real(wp), intent(inout) :: vectors(:, :)
      !> B times the vectors, [rows, count]
      real(wp), intent(inout) :: deflection(:, :)
      !> Set when DSYGV fails
      type(failure_t), allocatable, intent(out) :: error

      real(wp), dimension(size(vectors, 2), size(vectors, 2)) :: mass, unit
      real(wp) :: value(size(vectors, 2)), work(34*size(vectors, 2) + 1)
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
