!> A table of frequencies: one column a solver and mesh, one row a mode.
module frequency_types
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: frequency_table_t, frequency_column_t, error_in_percent

   type :: frequency_column_t
      !> Name of the solver as users write it
      character(:), allocatable :: solver
      !> Elements and ratio of the mesh; 0: its nodes are given
      integer :: elements = 0
      real(wp) :: ratio = 1.0_wp
      !> lambda_i, [modes found]
      real(wp), allocatable :: lambda(:)
      !> Why the solver gave no values; unallocated: it did
      character(:), allocatable :: failure
   end type frequency_column_t

   type :: frequency_table_t
      !> Computed columns
      type(frequency_column_t), allocatable :: columns(:)
      !> Exact lambda_i, [rows]; unallocated: not asked for
      real(wp), allocatable :: exact(:)
      !> Positions x/L of the nodes of the first column's mesh, [0:n], and mode shapes on them,
      !> [0:n, modes]: unit modal mass, positive tip; unallocated: not asked for
      real(wp), allocatable :: node(:)
      real(wp), allocatable :: shape(:, :)
      real(wp), allocatable :: shape_slope(:, :)
      !> How good these are: largest |phi_i^T M phi_j - delta_ij|, and the same in K relative to
      !> lambda_i^2 lambda_j^2, which the cancellation within the assembled K bounds from below
      real(wp) :: mass_orthogonality = 0.0_wp
      real(wp) :: stiffness_orthogonality = 0.0_wp
   end type frequency_table_t

contains

   !> Error of a lambda in percent; NaN: the beam moves without strain.
   elemental function error_in_percent(lambda, exact) result(error)
      real(wp), intent(in) :: lambda
      real(wp), intent(in) :: exact
      real(wp) :: error

      error = ieee_value(1.0_wp, ieee_quiet_nan)
      if (exact > 0.0_wp) error = 100.0_wp*(lambda/exact - 1.0_wp)
   end function error_in_percent

end module frequency_types
