!> Mode shapes: sign and normalisation are fixed here, and their quality is measured.
!>
!> Every solver returns unit modal mass, phi^T M phi = 1 in units of rho Abar L (tip mass included),
!> and a positive displacement of the tip, or, where a support holds that, a positive slope there, or displacement of
!> the node before. The sign is sure but for high modes of uneven meshes that leave the tip at rest to within rounding.
module mode_shapes
   use beam_model, only: beam_model_t
   use kinds, only: wp
   use skyline_matrix, only: multiply
   implicit none (type, external)
   private
   public :: fix_mode_signs, mode_quality, mode_quality_t, sign_changes

   !> How good a set of modes is; every figure is relative.
   type :: mode_quality_t
      !> Largest |phi_i^T M phi_j - delta_ij|
      real(wp) :: mass_orthogonality = 0.0_wp
      !> Largest |phi_i^T K phi_j - lambda_i^4 delta_ij| / (lambda_i^2 lambda_j^2)
      real(wp) :: stiffness_orthogonality = 0.0_wp
   end type mode_quality_t

contains

   !> Turn each mode so that its tip moves by a positive amount, or, where it is held, turns, or else the node before it
   !> moves.
   pure subroutine fix_mode_signs(tip_dof, modes)
      !> Row of the displacement of the tip
      integer, intent(in) :: tip_dof
      !> Shapes as columns
      real(wp), intent(inout) :: modes(:, :)

      integer :: mode, dof

      dof = tip_dof
      if (all(abs(modes(dof, :)) <= 0.0_wp)) dof = tip_dof + 1
      if (all(abs(modes(dof, :)) <= 0.0_wp)) dof = max(1, tip_dof - 2)
      do mode = 1, size(modes, 2)
         if (modes(dof, mode) < 0.0_wp) modes(:, mode) = -modes(:, mode)
      end do
   end subroutine fix_mode_signs

   !> Changes of sign along a row of values; zeros count for neither sign.
   pure function sign_changes(values) result(changes)
      real(wp), intent(in) :: values(:)
      integer :: changes

      real(wp) :: last
      integer :: i

      changes = 0
      last = 0.0_wp
      do i = 1, size(values)
         if (.not. abs(values(i)) > 0.0_wp) cycle
         if (values(i) < 0.0_wp .neqv. last < 0.0_wp) then
            if (abs(last) > 0.0_wp) changes = changes + 1
         end if
         last = values(i)
      end do
   end function sign_changes

   !> M- and K-orthogonality of a set of modes. With K assembled, the second figure contains the
   !> cancellation inside K, which grows with the mesh, beside the error of the modes.
   pure function mode_quality(model, lambda, modes) result(quality)
      type(beam_model_t), intent(in) :: model
      !> lambda_i, [modes]
      real(wp), intent(in) :: lambda(:)
      !> Shapes as columns, [2 n, modes]
      real(wp), intent(in) :: modes(:, :)
      type(mode_quality_t) :: quality

      real(wp), allocatable :: product(:)
      real(wp) :: expected, value
      integer :: i, j

      allocate (product(size(modes, 1)))
      do j = 1, size(modes, 2)
         call multiply(model%mass, modes(:, j), product)
         do i = 1, size(modes, 2)
            expected = merge(1.0_wp, 0.0_wp, i == j)
            value = dot_product(modes(:, i), product)
            quality%mass_orthogonality = max(quality%mass_orthogonality, abs(value - expected))
         end do
         call multiply(model%stiffness, modes(:, j), product)
         do i = 1, size(modes, 2)
            expected = merge(1.0_wp, 0.0_wp, i == j)
            ! a rotation about the root, whose lambda is 0, beside the first bending
            if (lambda(i)*lambda(j) > 0.0_wp) then
               value = dot_product(modes(:, i), product)/(lambda(i)*lambda(j))**2
            else
               value = expected + dot_product(modes(:, i), product)/max(lambda(min(2, size(lambda))), lambda(j))**4
            end if
            quality%stiffness_orthogonality = max(quality%stiffness_orthogonality, abs(value - expected))
         end do
      end do
   end function mode_quality

end module mode_shapes
