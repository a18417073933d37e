!> Sign and orthogonality of mode shapes.
!>
!> Every solver returns unit modal mass, phi^T M phi = 1 in units of rho Abar L (tip mass included), and a positive
!> displacement of the tip; if a support constrains that displacement, a positive slope of the tip; if both are
!> constrained, a positive displacement of the node before the tip. The sign is certain except for high modes of graded
!> meshes that leave the tip at rest to within rounding.
module mode_shapes
   use beam_model, only: beam_model_t
   use kinds, only: lambda1, wp
   use skyline_matrix, only: multiply
   implicit none (type, external)
   private
   public :: fix_mode_signs, mode_quality, mode_quality_t, sign_changes

   !> Relative orthogonality errors of a set of modes.
   type :: mode_quality_t
      !> Maximum |phi_i^T M phi_j - delta_ij|
      real(wp) :: mass_orthogonality = 0.0_wp
      !> Maximum |phi_i^T K phi_j - lambda_i^4 delta_ij| / (lambda_i^2 lambda_j^2)
      real(wp) :: stiffness_orthogonality = 0.0_wp
   end type mode_quality_t

contains

   !> Fix the sign of each mode so that the displacement of the tip is positive, or the slope of the tip if its
   !> displacement is constrained in all modes, or else the displacement of the node before the tip.
   pure subroutine fix_mode_signs(tip_dof, modes)
      !> Degree of freedom of the displacement of the tip
      integer, intent(in) :: tip_dof
      !> Mode shapes as columns
      real(wp), intent(inout) :: modes(:, :)

      integer :: mode, dof

      dof = tip_dof
      if (all(abs(modes(dof, :)) <= 0.0_wp)) dof = tip_dof + 1
      if (all(abs(modes(dof, :)) <= 0.0_wp)) dof = max(1, tip_dof - 2)
      do mode = 1, size(modes, 2)
         if (modes(dof, mode) < 0.0_wp) modes(:, mode) = -modes(:, mode)
      end do
   end subroutine fix_mode_signs

   !> Number of sign changes in a sequence of values. Zeros are ignored.
   pure integer function sign_changes(values) result(changes)
      real(wp), intent(in) :: values(:)

      real(wp) :: previous
      integer :: i

      changes = 0
      previous = 0.0_wp
      do i = 1, size(values)
         if (.not. abs(values(i)) > 0.0_wp) cycle
         if (values(i) < 0.0_wp .neqv. previous < 0.0_wp) then
            if (abs(previous) > 0.0_wp) changes = changes + 1
         end if
         previous = values(i)
      end do
   end function sign_changes

   !> Orthogonality errors in M and K of a set of modes. The error in K includes the cancellation inside the assembled
   !> K, which grows with the number of elements, besides the errors of the modes.
   pure type(mode_quality_t) function mode_quality(model, lambda, modes) result(quality)
      type(beam_model_t), intent(in) :: model
      !> lambda_i, [modes]
      real(wp), intent(in) :: lambda(:)
      !> Mode shapes as columns, [2 n, modes]
      real(wp), intent(in) :: modes(:, :)

      real(wp), allocatable :: inertial(:), elastic(:)
      real(wp) :: expected, reference, value
      integer :: i, j

      allocate (inertial(size(modes, 1)), elastic(size(modes, 1)))
      do j = 1, size(modes, 2)
         call multiply(model%mass, modes(:, j), inertial)
         call multiply(model%stiffness, modes(:, j), elastic)
         do i = 1, size(modes, 2)
            expected = merge(1.0_wp, 0.0_wp, i == j)
            quality%mass_orthogonality = max(quality%mass_orthogonality, abs(dot_product(modes(:, i), inertial) &
               - expected))
            ! a rigid-body rotation about the root has lambda = 0, so its error is relative to the first bending mode,
            ! or, without one, to that of a clamped beam
            if (lambda(i)*lambda(j) > 0.0_wp) then
               value = dot_product(modes(:, i), elastic)/(lambda(i)*lambda(j))**2
            else
               reference = max(lambda(min(2, size(lambda))), lambda(j))
               if (.not. reference > 0.0_wp) reference = lambda1
               value = expected + dot_product(modes(:, i), elastic)/reference**4
            end if
            quality%stiffness_orthogonality = max(quality%stiffness_orthogonality, abs(value - expected))
         end do
      end do
   end function mode_quality

end module mode_shapes
